"""What became of a row as a whole: of two rows of which one, or neither, reached its horizon."""

from __future__ import annotations

from heavytop.precision import exact
from heavytop.records import CONTRADICTION, FAILED, OUT_OF_REACH, OUT_OF_TIME, UNMEASURED, UNSUPPORTED, Row
from heavytop.report.verdicts import Judged, Verdict

SUCCESS = "success"
_NO_INTEGRATORS = (OUT_OF_REACH, CONTRADICTION, UNSUPPORTED)
"""Outcomes that say nothing of what is measured: of its reference, or of what it declares that it cannot do."""


def ended(row: Row, which: str) -> str:
    """``the candidate ended as failed at t = 0: it returned NaN``."""
    why = f": {row.reference.reason}" if row.outcome in UNMEASURED else ""
    return f"the {which} ended as {row.outcome} at t = {row.time_reached}{why}"


def judge_outcomes(old: Row, new: Row, duration: float) -> Judged | None:
    """The verdict of the outcomes; None where both are success, or the same and numbers decide.

    A run that no longer reaches its horizon is worse, whatever ended it, and one that now does is better.  Of two that
    failed neither has a number: the same where they failed in the same way, else incomparable.  Of two that stopped
    early the one that stops earlier by more than the allowed part ``duration`` is worse.
    """
    before, after = old.outcome, new.outcome
    if before == after == SUCCESS:
        return None
    for row, which in ((old, "baseline"), (new, "candidate")):
        if row.outcome in _NO_INTEGRATORS:
            return Verdict.INCOMPARABLE, ended(row, which)
    if before == SUCCESS:
        return Verdict.WORSE, ended(new, "candidate")
    if after == SUCCESS:
        return Verdict.BETTER, f"it reaches its horizon, and {ended(old, 'baseline')}"
    if before != after:
        return Verdict.INCOMPARABLE, f"{ended(old, 'baseline')}, {ended(new, 'candidate')}"
    if before in (FAILED, OUT_OF_TIME):
        return Verdict.SAME, "failed in both reports"
    return _reached(old, new, duration)


def _reached(old: Row, new: Row, duration: float) -> Judged | None:
    """The verdict of two runs that stopped early in the same way, by how far they came."""
    first, second = (abs(exact(row.time_reached)) for row in (old, new))
    if second < first * (1 - exact(duration)):
        return Verdict.WORSE, f"{ended(new, 'candidate')}, the baseline at {old.time_reached}"
    return None
