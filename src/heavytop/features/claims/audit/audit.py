"""Audits of claims by name or file, in this process or in one of their own, and the verdicts on the library."""

from __future__ import annotations

import hashlib
import re
import signal
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import msgspec

from heavytop import files
from heavytop.errors import HeavyTopError, InputError, invalid, meant, prefixed, quoted, refusal
from heavytop.features.claims.algebra.reader import plain
from heavytop.features.claims.audit.components import UserComponent
from heavytop.features.claims.audit.context import ClaimFile
from heavytop.features.claims.audit.guard import Answer, AuditEnded, in_time, limit_process, no_memory, too_deep
from heavytop.features.claims.audit.judge import Audit, Progress, silent
from heavytop.features.claims.audit.stability import UserStability
from heavytop.features.claims.audit.user_claims import FileClaim, UserIntegral, UserMotion
from heavytop.features.claims.audit.values import ValueClaim, ValueFile
from heavytop.features.claims.library.entry import FOLDER, Entry, Verdict, file_of, library, split
from heavytop.files import readable
from heavytop.guard import processors
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, System, system

if TYPE_CHECKING:
    from heavytop.features.claims.library.ershkov_audit import GeneralClaim, PartialClaim

# Claims that a user writes in TOML: a motion, a first integral, an invariant relation, or numbers.
#
# The format is that of docs/claims-in-toml.md.  Formulas go through :mod:`heavytop.features.claims.algebra.reader`;
# nothing in a file is ever evaluated as code.


Claim: TypeAlias = "FileClaim | ValueClaim | PartialClaim | GeneralClaim"
_TABLES: dict[str, tuple[str, Callable[[ClaimFile], FileClaim]]] = {
    "motion": ("motion", UserMotion),
    "component": ("component", UserComponent),
    "integral": ("integral", UserIntegral),
    "relation": ("integral", UserIntegral),
    "stability": ("motion", UserStability),
}
"""The table that each kind of claim needs, and its class."""
_ANY_TOP = {"inertia": ["1", "1", "1"], "weight": "1", "centre": ["0", "0", "0"]}
_MAX_BYTES = 100_000
_MOST_BITS = 10_000
_AS_TEXT = 'Give decimals as text, "0.1", which is exact. '
_REMEDY = "`heavytop docs claims-in-toml` describes the format, with examples."


def read_claim(path: Path) -> FileClaim | ValueClaim:
    """The claim in a TOML file; raises InputError for a file that holds no valid claim."""
    remedy = "Give an existing TOML file, or an id that `heavytop claims` lists."
    with readable(path, remedy), path.open("rb") as stream:
        raw = stream.read(_MAX_BYTES + 1)
    if len(raw) > _MAX_BYTES:
        raise InputError(f"{path} is longer than {_MAX_BYTES} bytes.", "Shorten it: a claim is a page of formulas.")
    try:
        table = tomllib.loads(raw.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # an integer of too many digits is a ValueError of its own
        raise InputError(f"{path} is not TOML: {str(error)[:200]}.", _REMEDY) from None
    return claim_from_table(table, str(path))


def claim_from_table(table: Mapping[str, Any], where: str) -> FileClaim | ValueClaim:
    """The claim in a TOML table; raises InputError for a table that holds no valid claim."""
    entry, claim = split(table, where)
    is_value = claim.get("kind") == "value"
    claim |= {key: _as_text(part, is_value) for key, part in claim.items() if key not in ("name", "source")}
    if "entry" in claim:
        raise InputError(f"{where}: a claim has no key entry.", _REMEDY)
    if is_value:
        return _value_claim(claim, entry, where)
    if "value" in claim:
        raise InputError(f"{where}: kind = {quoted(claim.get('kind'))} with [[value]].", 'Use "value".')
    try:
        content = msgspec.convert(claim, ClaimFile)
    except (msgspec.ValidationError, RecursionError) as error:
        cause = _with_name(invalid(error, ClaimFile), claim)
        raise InputError(f"{where}: {cause}.", _AS_TEXT * ("got a number" in cause) + _REMEDY) from None
    if content.kind not in _TABLES:
        rule = f"one of {', '.join(_TABLES)}, value"
        raise refusal(f"{where}: kind", rule, repr(content.kind[:40]), _REMEDY)
    needed, claim_class = _TABLES[content.kind]
    if {name for name, _ in _TABLES.values() if getattr(content, name) is not None} != {needed}:
        raise InputError(f"{where}: kind {content.kind!r} needs the table [{needed}], and no other claim.", _REMEDY)
    if (content.stable is None) is (content.kind == "stability"):
        raise InputError(f"{where}: stable must be true or false of kind 'stability', and of no other.", _REMEDY)
    if content.quadrature is not None and needed == "integral":
        raise InputError(f"{where}: [quadrature] is about a motion, and kind = {content.kind!r}.", _REMEDY)
    if unused := next(_unused(content), ""):
        cause = f"{where}: a claim of kind {content.kind!r} does not use {unused}."
        raise InputError(cause, "Leave it out, or state it in a claim of its own.")
    if content.domain not in ("all", "t<=0", "t>0"):
        raise InputError(f'{where}: domain must be "all", "t<=0" or "t>0"; got {content.domain[:40]!r}.', "Change it.")
    content = msgspec.structs.replace(content, entry=entry)
    with prefixed(where):
        return claim_class(content)


def _as_text(part: Any, is_printed: bool) -> Any:
    """A part of a claim with its integers as texts, and its formulas in ASCII unless they are printed numbers."""
    if isinstance(part, list):
        return [_as_text(item, is_printed) for item in part]
    if isinstance(part, dict):
        named = {name if is_printed else plain(name): _as_text(item, is_printed) for name, item in part.items()}
        return named if len(named) == len(part) else part
    if isinstance(part, str):
        return part if is_printed else plain(part)
    return str(part) if type(part) is int and part.bit_length() < _MOST_BITS else part


def _unused(content: ClaimFile) -> Iterator[str]:
    """Entries of a claim that its audit would ignore."""
    component, angles, attitude = content.component, ("phi", "theta", "psi"), ("angles", "quaternion", "matrix")
    unused = {
        "[start]": (content.start, attitude if component else ("omega", "gamma", *attitude)),
        "[quadrature]": (content.quadrature, ("where", "points") if component else angles),
        "[component] without value": (component, angles if component and component.value is None else ()),
    }
    for table, (part, names) in unused.items():
        yield from (f"{name} of {table}" for name in names if getattr(part, name, None))


def _with_name(cause: str, claim: Mapping[str, Any]) -> str:
    """The cause with the name of the parameter or definition that it is about."""
    table = cause.partition("[...]")[0]
    for name, value in claim[table].items() if "[...]" in cause else ():
        try:
            msgspec.convert({table: {name: value}, "name": "claim", "kind": "", "top": _ANY_TOP}, ClaimFile)
        except msgspec.ValidationError:
            return cause.replace("[...]", f".{quoted(name)[1:-1]}", 1)
    return cause


def _value_claim(table: Mapping[str, Any], entry: Entry | None, where: str) -> ValueClaim:
    def counted_from_1(match: re.Match[str]) -> str:
        """``value 3: `` for ``value[2].``."""
        return f"value {int(match[1]) + 1}" + (": " if match[2] else "")

    try:
        with prefixed(where):
            return ValueClaim(msgspec.convert(table, ValueFile, strict=False), entry)
    except (msgspec.ValidationError, RecursionError) as error:
        cause = re.sub(r"\bvalue\[(\d+)\](\.)?", counted_from_1, invalid(error, ValueFile))
        raise InputError(f"{where}: {cause}.", _AS_TEXT * ("got a number" in cause) + _REMEDY) from None


PAPER = ("ershkov-general", "ershkov-partial")


def paper_claim(name: str) -> PartialClaim | GeneralClaim:
    """The paper's claim of that name, one of :data:`PAPER`."""
    from heavytop.features.claims.library.ershkov_audit import GeneralClaim, PartialClaim

    return GeneralClaim() if name == "ershkov-general" else PartialClaim()


def find_claim(name: str) -> Claim:
    """The paper's claim of that name, or the claim in the TOML file at that path; raises InputError for neither."""
    return paper_claim(name) if name in PAPER else read_claim(_path(name))


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


def audit(name: str, system_name: str | None = None, progress: Progress = silent) -> Audit:
    """The audit of a claim of the paper, or of a TOML file, as a motion of that system; None for the claim's own.

    progress: of a claim of the paper.
    Raises InputError for an unknown claim or system and for a file that cannot be read.
    """
    requested = None if system_name is None else system(system_name)
    if name in PAPER:
        return audit_claim(paper_claim(name), requested, progress)
    return in_time(str(_path(name)), "" if requested is None else requested.name)


def audit_claim(claim: Claim, requested: System | None = None, progress: Progress = silent) -> Audit:
    """The audit of a claim as a motion of the requested system; None for its own."""
    return claim.audit(claim.about(requested), progress)


def require_branch(branch: str) -> None:
    """Raises InputError for an invalid branch."""
    if branch not in ("smooth", "printed"):
        raise InputError(f"Unknown branch {branch[:40]!r}.", "Use smooth or printed.")


def only_branch(report: Audit, branch: str) -> Audit:
    """The report with the rows of one branch, and its verdict on them; raises InputError where there are none."""
    require_branch(branch)
    rows = tuple(row for row in report.rows if row.branch == branch)
    if not rows:
        raise InputError(f"{report.claim} has no equations on the {branch} branch.", "Leave out --branch.")
    return replace(report, rows=rows)


# The verdicts on the library of claims: audited now, or from the cache, whose key is a digest of entry and program.


SECONDS = 60.0
"""An audit of an entry that takes longer is undecided."""
_PACKAGE = Path(__file__).parents[3]
_ROOMS = ("features/claims", "top", "exact")


class Judged(msgspec.Struct, frozen=True):
    """The verdict on an entry, and the duration of its audit.

    reason: why the verdict is missing, where the audit was stopped or the file is invalid.
    """

    verdict: Verdict
    seconds: float
    reason: str = ""


def audited(entry: Entry) -> tuple[Judged, Audit | None]:
    """The audit of an entry; undecided, with None, where it is stopped or the file is invalid."""
    began = perf_counter()
    try:
        audit = in_time(str(FOLDER / f"{entry.id}.toml"), "", SECONDS)
    except AuditEnded:
        raise
    except HeavyTopError as error:
        return Judged("undecided", perf_counter() - began, error.cause), None
    return Judged(cast(Verdict, audit.verdict), perf_counter() - began), audit


@cache
def own_system(name: str) -> str:
    """The system of an entry, by the keys of its file: ``about`` of its claim, without parsing formulas."""
    table = tomllib.loads((FOLDER / f"{name}.toml").read_text("utf-8"))
    carries = isinstance((table.get("top") or table["body"]).get("rotor"), list)
    return str(table.get("system") or (HEAVY_GYROSTAT if carries else HEAVY_TOP).name)


def judged(
    entries: Sequence[Entry], *, anew: bool = False, done: Callable[[], None] = lambda: None
) -> dict[str, Judged]:
    """The verdict on each entry by its id, in as many audits at once as there are processors.

    anew: without the cache.  done: called after each.
    Raises AuditEnded where the process of an audit ends without an answer.
    """

    def verdict(entry: Entry) -> Judged:
        judged = None if anew else _cached_verdict(entry)
        if judged is None:
            judged, _ = audited(entry)
            if not judged.reason:  # an audit that was stopped may end another time
                with suppress(OSError, InputError):  # without a cache that can be written
                    path = _cache_file(entry)
                    path.parent.mkdir(parents=True, exist_ok=True)
                    files.replace(path, msgspec.json.encode(judged))
        done()
        return judged

    with ThreadPoolExecutor(max_workers=processors()) as pool:
        return dict(zip((entry.id for entry in entries), pool.map(verdict, entries), strict=True))


def _cached_verdict(entry: Entry) -> Judged | None:
    """The verdict in the cache on exactly this entry by this program."""
    try:
        return msgspec.json.decode(_cache_file(entry).read_bytes(), type=Judged)
    except (OSError, msgspec.DecodeError, msgspec.ValidationError):
        return None


def _cache_file(entry: Entry) -> Path:
    content = (FOLDER / f"{entry.id}.toml").read_bytes()
    return files.cache_folder("claims") / f"{hashlib.sha256(_program() + content).hexdigest()}.json"


@cache
def _program() -> bytes:
    """A digest of the versions of Python, SymPy and FLINT, and of the source of the rooms that determine a verdict."""
    digest = hashlib.sha256(sys.version.encode())
    for name in ("sympy", "flint"):
        digest.update(str(__import__(name).__version__).encode())
    for path in sorted(path for room in _ROOMS for path in (_PACKAGE / room).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()


# The process in which the claim of a file is audited: :mod:`heavytop.features.claims.audit.guard` starts it.


def child() -> None:
    """Writes the :data:`Answer` for ``sys.argv[2:]`` = path, system, seconds of the processor and of the clock."""
    path, system_name, seconds, last = sys.argv[2:]
    if hasattr(signal, "alarm"):
        signal.alarm(int(last))
    limit_process(int(seconds))
    sys.stdout.buffer.write(msgspec.json.encode(answer(path, system_name)))


def answer(path: str, system_name: str) -> Answer:
    """The audit of a file, or the cause and remedy of the error."""
    try:
        claim = find_claim(path)
        with prefixed(path):
            return audit_claim(claim, system(system_name) if system_name else None)
    except MemoryError:
        error: HeavyTopError = no_memory(path)
    except RecursionError:
        error = too_deep(path)
    except HeavyTopError as raised:
        error = raised
    except ValueError as raised:
        if "is not a prime factor of" not in str(raised):
            raise
        cause = f"{path}: SymPy cannot take the root of a number of the claim: {quoted(str(raised))[1:-1]}."
        error = InputError(cause, "Give the number under the root as a parameter.")
    return error.cause.encode(errors="replace").decode(), error.remedy  # a path may hold bytes that are no characters
