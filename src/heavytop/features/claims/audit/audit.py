"""`audit`: one claim, one system, a verdict for every equation and the reason for it."""

from __future__ import annotations

import hashlib
import re
import signal
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import msgspec

from heavytop import files
from heavytop.errors import HeavyTopError, InputError, invalid, meant, prefixed, quoted
from heavytop.features.claims.audit.components import UserComponent
from heavytop.features.claims.audit.context import ClaimFile, FileClaim
from heavytop.features.claims.audit.guard import Answer, AuditEnded, in_time, limit_process
from heavytop.features.claims.audit.judge import Audit, StatementVerdict, judge, verdict_of
from heavytop.features.claims.audit.stability import UserStability
from heavytop.features.claims.audit.user_claims import UserIntegral, UserMotion
from heavytop.features.claims.audit.values import ValueClaim, ValueFile
from heavytop.features.claims.library.entry import FOLDER, Entry, Verdict, file_of, library, split
from heavytop.guard import processors
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, System, system

if TYPE_CHECKING:
    from heavytop.features.claims.library.ershkov_audit import GeneralClaim, PartialClaim

# Claims that a user writes in TOML: a motion, a first integral, an invariant relation, or numbers.
#
# The format is that of docs/claims-in-toml.md.  Formulas go through :mod:`heavytop.features.claims.algebra.reader`;
# nothing in a file is ever evaluated as code.


Auditable: TypeAlias = "UserMotion | UserIntegral | PartialClaim | GeneralClaim"
"""A claim whose formulas can be put into equations."""
_TABLES: dict[str, tuple[str, Callable[[ClaimFile], Auditable]]] = {
    "motion": ("motion", UserMotion),
    "component": ("component", UserComponent),
    "integral": ("integral", UserIntegral),
    "relation": ("integral", UserIntegral),
    "stability": ("motion", UserStability),
}
"""The table that each kind of claim needs, and what it is read as."""
_MAX_BYTES = 100_000
_REMEDY = "`heavytop docs claims-in-toml` has the format, with examples."


def read_claim(path: Path) -> Auditable | ValueClaim:
    """The claim in a TOML file; raises InputError, with the reason, for anything that is not one."""
    try:
        with path.open("rb") as stream:
            raw = stream.read(_MAX_BYTES + 1)
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}.",
            "Give a TOML file that is there, or an id that `heavytop claims` lists.",
        ) from None
    if len(raw) > _MAX_BYTES:
        raise InputError(f"{path} is longer than {_MAX_BYTES} bytes.", "A claim is a page of formulas.")
    try:
        table = tomllib.loads(raw.decode())
    except (ValueError, RecursionError) as error:  # an integer of too many digits is a ValueError of its own
        raise InputError(f"{path} is not TOML: {str(error)[:200]}.", _REMEDY) from None
    return claim_from_table(table, str(path))


def claim_from_table(table: Mapping[str, Any], where: str) -> Auditable | ValueClaim:
    """The claim in a TOML table that has been read; raises InputError for anything that is not one."""
    entry, rest = split(table, where)
    if "entry" in rest:
        raise InputError(f"{where}: a claim has no key entry.", _REMEDY)
    if rest.get("kind") == "value":
        return _value_claim(rest, entry, where)
    if "value" in rest:
        raise InputError(f"{where}: kind = {quoted(rest.get('kind'))} with [[value]].", 'Use "value".')
    try:
        content = msgspec.convert(rest, ClaimFile)
    except (msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{where}: {invalid(error, ClaimFile)}.", _REMEDY) from None
    if content.kind not in _TABLES:
        raise InputError(f"{where}: kind = {content.kind[:40]!r}.", f"Use {', '.join(_TABLES)} or value.")
    wanted, made = _TABLES[content.kind]
    if {name for name, _ in _TABLES.values() if getattr(content, name) is not None} != {wanted}:
        raise InputError(f"{where}: kind {content.kind!r} needs the table [{wanted}], and no other claim.", _REMEDY)
    if (content.stable is None) is (content.kind == "stability"):
        raise InputError(f"{where}: stable must be true or false of kind 'stability', and of no other.", _REMEDY)
    if content.quadrature is not None and wanted == "integral":
        raise InputError(f"{where}: [quadrature] is about a motion, and kind = {content.kind!r}.", _REMEDY)
    if content.domain not in ("all", "t<=0", "t>0"):
        raise InputError(f"{where}: domain = {content.domain[:40]!r}.", 'Use "all", "t<=0" or "t>0".')
    content = msgspec.structs.replace(content, entry=entry)
    with prefixed(where):
        return made(content)


def _value_claim(table: Mapping[str, Any], entry: Entry | None, where: str) -> ValueClaim:
    def place(match: re.Match[str]) -> str:
        """``value 3: `` of ``value[2].``: the numbers of a file are counted from 1."""
        return f"value {int(match[1]) + 1}" + (": " if match[2] else "")

    try:
        with prefixed(where):
            return ValueClaim(msgspec.convert(table, ValueFile), entry)
    except (msgspec.ValidationError, RecursionError) as error:
        cause = re.sub(r"\bvalue\[(\d+)\](\.)?", place, invalid(error, ValueFile))
        raise InputError(f"{where}: {cause}.", f"Numbers are text, as they are printed. {_REMEDY}") from None


PAPER = ("ershkov-general", "ershkov-partial")
_SEARCH, _MOST_ASSUMPTIONS = 6.0, 3
"""Seconds for assumptions that would decide a claim, and how many of them are said."""


def paper_claim(name: str) -> Auditable:
    """The paper's claim of that name, one of :data:`PAPER`."""
    from heavytop.features.claims.library.ershkov_audit import GeneralClaim, PartialClaim

    return GeneralClaim() if name == "ershkov-general" else PartialClaim()


def find_claim(name: str) -> Auditable | ValueClaim:
    """The paper's claim of that name, or the claim in the TOML file at that path; raises InputError for neither."""
    if name in PAPER:
        return paper_claim(name)
    return read_claim(_path(name))


def _path(name: str) -> Path:
    """The path of a claim in TOML, or of the entry of that name; raises InputError for any other name."""
    path = Path(name)
    if path.suffix == ".toml":
        return path
    chosen = file_of(name)
    if chosen is None:
        remedy = f"Use {', '.join(PAPER)}, an entry that `heavytop claims` lists, or the path of a TOML file."
        raise InputError(f"Unknown claim {name[:60]!r}.", meant(name, [*PAPER, *library()]) + remedy)
    return chosen


def audit(
    name: str, system_name: str | None = None, progress: Callable[[int, int], None] = lambda done, of: None
) -> Audit:
    """The audit of a claim of the paper, or of a TOML file, as a motion of that system; None for the claim's own.

    progress: hears of a claim of the paper how many equations are judged, of how many.
    Raises InputError for an unknown claim or system and for a file that cannot be read.
    """
    asked = None if system_name is None else system(system_name)
    if name in PAPER:
        return audit_claim(paper_claim(name), asked, progress)
    return in_time(str(_path(name)), "" if asked is None else asked.name)


def audit_claim(
    claim: Auditable | ValueClaim,
    asked: System | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Audit:
    """The audit of a claim that is at hand, as a motion of the system asked for.  progress: as in :func:`audit`."""
    about, began = claim.about(asked), perf_counter()
    if isinstance(claim, ValueClaim):
        return Audit(
            claim.content.name, about.name, claim.content.source, claim.rows(about), kind=claim.kind, entry=claim.entry
        )
    rows = _rows(claim, about, progress)
    deciding = would_decide(claim, about, rows, perf_counter() - began)
    why, solves = claim.explain(about, rows)
    constants = tuple((name, str(value)) for name, value in claim.setting.constants)
    heading = claim.name, about.name, claim.source
    unused = claim.unused if isinstance(claim, FileClaim) else ()
    table = claim.content.integral if isinstance(claim, UserIntegral) else None
    where = tuple(table.where) if table else ()
    return Audit(*heading, rows, tuple(why), solves, constants, claim.kind, claim.entry, deciding, unused, where)


def _rows(
    claim: Auditable, about: System, progress: Callable[[int, int], None] = lambda done, of: None
) -> tuple[StatementVerdict, ...]:
    if not isinstance(claim, UserComponent):
        rows = judge(claim.statements(about), claim.setting, progress)
        return (*rows, claim.judged(about, rows)) if isinstance(claim, UserStability) else rows
    return tuple(row for statements, setting in claim.groups(about) for row in judge(statements, setting))


def would_decide(
    claim: Auditable, about: System, rows: Sequence[StatementVerdict], seconds: float
) -> tuple[tuple[str, str], ...]:
    """Assumptions on the parameters of an undecided claim in a file, each of which decides it, with the verdict then.

    seconds: that the audit took; what would take more than :data:`_SEARCH` together is not tried.
    """
    if not isinstance(claim, FileClaim) or verdict_of(rows) != "undecided":
        return ()
    missing = [c.assumption for row in rows for c in row.conditions if c.assumption and not c.discharged]
    deciding: list[tuple[str, str]] = []
    began = perf_counter()
    for bound in dict.fromkeys([*missing, *(f"{name} > 0" for name in claim.unassumed)]):
        if perf_counter() - began + 2 * seconds > _SEARCH or len(deciding) == _MOST_ASSUMPTIONS:
            break
        if (bound.replace(">", "!="), "holds") in deciding:  # more than is needed
            continue
        try:
            verdict = verdict_of(_rows(claim.assuming(bound), about))
        except HeavyTopError:  # a sample breaks it, or the formula may not be assumed
            continue
        if verdict != "undecided":
            deciding.append((bound, verdict))
    return tuple(deciding)


def require_branch(branch: str) -> None:
    """Raises InputError for an invalid branch."""
    if branch not in ("smooth", "printed"):
        raise InputError(f"Unknown branch {branch[:40]!r}.", "Use smooth or printed.")


def only_branch(report: Audit, branch: str) -> Audit:
    """The report with the rows of one branch, and its verdict on them; raises InputError where there are none."""
    require_branch(branch)
    rows = tuple(row for row in report.rows if row.branch == branch)
    if not rows:
        raise InputError(f"{report.claim} says nothing on the {branch} branch.", "Leave out --branch.")
    return replace(report, rows=rows)


# The verdicts on the library of claims: audited now, or found in the cache by what they follow from.


SECONDS = 60.0
"""An audit of an entry that takes longer is undecided."""
_PACKAGE = Path(__file__).parents[3]
_ROOMS = ("features/claims", "top", "exact")


class Judged(msgspec.Struct, frozen=True):
    """The verdict on an entry, and the seconds that its audit took when it was made.

    reason: why a verdict is missing, where the audit was stopped or the file cannot be judged.
    """

    verdict: Verdict
    seconds: float
    reason: str = ""


Done = Callable[[], None]


def audited(entry: Entry, system: str = "") -> tuple[Judged, Audit | None]:
    """The audit of an entry; undecided, with None, where it is stopped or its file cannot be judged."""
    began = perf_counter()
    try:
        audit = in_time(str(FOLDER / f"{entry.id}.toml"), system, SECONDS)
    except AuditEnded:
        raise
    except HeavyTopError as error:
        return Judged("undecided", perf_counter() - began, error.cause), None
    return Judged(cast(Verdict, audit.verdict), perf_counter() - began), audit


@cache
def own_system(name: str) -> str:
    """The system that an entry is about, by the keys of its file: ``about`` of its claim, but no formula is read."""
    table = tomllib.loads((FOLDER / f"{name}.toml").read_text("utf-8"))
    carries = isinstance((table.get("top") or table["body"]).get("rotor"), list)
    return str(table.get("system") or (HEAVY_GYROSTAT if carries else HEAVY_TOP).name)


def judged(entries: Iterable[Entry], *, anew: bool = False, done: Done = lambda: None) -> dict[str, Judged]:
    """The verdict on each entry by its id, as many audits at once as there are processors.

    anew: whatever the cache holds.  done: called after each.
    Raises AuditEnded where the process of an audit ends without an answer.
    """
    todo = list(entries)

    def one(entry: Entry) -> Judged:
        judged = None if anew else _kept(entry)
        if judged is None:
            judged, _ = audited(entry)
            with suppress(OSError, InputError):  # a cache that cannot be written is left out
                path = _cached(entry)
                path.parent.mkdir(parents=True, exist_ok=True)
                files.replace(path, msgspec.json.encode(judged))
        done()
        return judged

    with ThreadPoolExecutor(max_workers=processors()) as pool:
        return dict(zip((entry.id for entry in todo), pool.map(one, todo), strict=True))


def _kept(entry: Entry) -> Judged | None:
    """The verdict in the cache on exactly this entry and this program."""
    try:
        return msgspec.json.decode(_cached(entry).read_bytes(), type=Judged)
    except (OSError, msgspec.DecodeError, msgspec.ValidationError):
        return None


def _cached(entry: Entry) -> Path:
    content = (FOLDER / f"{entry.id}.toml").read_bytes()
    return files.cache_folder("claims") / f"{hashlib.sha256(_program() + content).hexdigest()}.json"


@cache
def _program() -> bytes:
    """A digest of what a verdict follows from: the versions of Python and its algebra, and the source of the rooms."""
    digest = hashlib.sha256(sys.version.encode())
    for name in ("sympy", "flint"):
        digest.update(str(__import__(name).__version__).encode())
    for path in sorted(path for room in _ROOMS for path in (_PACKAGE / room).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()


# The process in which the claim of a file is audited: :mod:`heavytop.features.claims.audit.guard` starts it.


def child() -> None:
    """The audit of ``sys.argv[2:]`` = path, system, seconds of the processor and of the clock: a JSON document of
    :class:`Answer` on standard output.
    """
    path, system_name, seconds, last = sys.argv[2:]
    if hasattr(signal, "alarm"):
        signal.alarm(int(last))
    limit_process(int(seconds))
    sys.stdout.buffer.write(msgspec.json.encode(answer(path, system_name)))


def answer(path: str, system_name: str) -> Answer:
    """The audit of a file, or why it cannot be audited."""
    try:
        claim = find_claim(path)
        with prefixed(path):
            return Answer(report=audit_claim(claim, system(system_name) if system_name else None))
    except HeavyTopError as error:
        # a path may hold bytes that are no characters
        return Answer(error=(error.cause.encode(errors="replace").decode(), error.remedy))
    except MemoryError:
        return Answer(memory=True)
    except RecursionError:
        return Answer(depth=True)
