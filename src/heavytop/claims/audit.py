"""`audit`: one claim, one system, a verdict for every equation and the reason for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from heavytop.claims.auditable import Assuming, Auditable
from heavytop.claims.entry import file_of
from heavytop.claims.from_file import read_claim
from heavytop.claims.guard import in_time
from heavytop.claims.judge import Audit, Row, judge, verdict_of
from heavytop.claims.values import ValueClaim
from heavytop.errors import HeavyTopError, InputError
from heavytop.top.equations import System, system

PAPER = ("ershkov-general", "ershkov-partial")
_SEARCH, _MOST_FOUND = 6.0, 3
"""Seconds for assumptions that would decide a claim, and how many of them are said."""


def paper_claim(name: str) -> Auditable:
    """The paper's claim of that name, one of :data:`PAPER`."""
    from heavytop.claims.ershkov_audit import GeneralClaim, PartialClaim

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
    found = file_of(name)
    if found is None:
        remedy = f"Use {', '.join(PAPER)}, an entry that `heavytop claims` lists, or the path of a TOML file."
        raise InputError(f"Unknown claim {name[:60]!r}.", remedy)
    return found


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
        return Audit(claim.name, about.name, claim.source, claim.rows(about), kind=claim.kind, entry=claim.entry)
    rows = judge(claim.statements(about), claim.setting, progress)
    deciding = would_decide(claim, about, rows, perf_counter() - began)
    why, solves = claim.explain(about, rows)
    constants = tuple((name, str(value)) for name, value in claim.setting.constants)
    said = (claim.name, about.name, claim.source, rows, tuple(why), solves, constants, claim.kind, claim.entry)
    return Audit(*said, deciding)


def would_decide(claim: Auditable, about: System, rows: Sequence[Row], seconds: float) -> tuple[tuple[str, str], ...]:
    """Assumptions on the parameters of an undecided claim in a file, each of which decides it, with the verdict then.

    seconds: that the audit took; what would take more than :data:`_SEARCH` together is not tried.
    """
    if not isinstance(claim, Assuming) or verdict_of(rows) != "undecided":
        return ()
    open_ones = [c.positive for row in rows for c in row.conditions if c.positive and not c.discharged]
    found: list[tuple[str, str]] = []
    began = perf_counter()
    for formula in dict.fromkeys([*claim.unassumed, *open_ones]):
        if perf_counter() - began + 2 * seconds > _SEARCH or len(found) == _MOST_FOUND:
            break
        bound = f"{formula} > 0"
        try:
            other = claim.assuming(bound)
            verdict = verdict_of(judge(other.statements(about), other.setting))
        except HeavyTopError:  # a sample breaks it, or the formula is none that may be assumed
            continue
        if verdict != "undecided":
            found.append((bound, verdict))
    return tuple(found)


def require_branch(branch: str) -> None:
    """Raises InputError for what is no branch."""
    if branch not in ("smooth", "printed"):
        raise InputError(f"Unknown branch {branch[:40]!r}.", "Use smooth or printed.")


def only_branch(report: Audit, branch: str) -> Audit:
    """The same report with the rows of one branch, and its verdict on them; raises InputError where there are none."""
    require_branch(branch)
    rows = tuple(row for row in report.rows if row.branch == branch)
    if not rows:
        raise InputError(f"{report.claim} says nothing on the {branch} branch.", "Leave out --branch.")
    return replace(report, rows=rows)
