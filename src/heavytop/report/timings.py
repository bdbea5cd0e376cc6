"""The seconds of repeated runs of one row against those of another, on one machine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from heavytop.report.verdicts import SAME, Judged, Verdict

BAND = "band"
"""Of seconds: half-width in decades of the interval that holds the middle 95 % of the runs."""
_WIDEST = 0.25
"""Decades.  Runs that scatter by a factor of 3 say nothing of a machine's speed."""


def judge_repeated(
    old: Mapping[str, float], new: Mapping[str, float], ratio: float, noise: float
) -> Iterator[tuple[str, Judged]]:
    """The name of a timing and its verdict: of the median, of the fastest run, and of how much the runs scatter.

    A median or a least may grow by ``ratio``, or by ``noise`` times what two runs of the baseline are apart; what the
    candidate's scatter by excuses nothing.
    """
    if missing := [name for name in ("run", "least", BAND) if name not in new]:
        yield missing[0], (Verdict.INCOMPARABLE, "its runs are no longer repeated for a comparison")
        return
    if not all(math.isfinite(seconds) for each in (old, new) for seconds in each.values()):
        yield "run", (Verdict.INCOMPARABLE, "no finite time")
        return
    if old[BAND] > _WIDEST:
        yield BAND, (Verdict.INCOMPARABLE, f"runs of the baseline scatter by a factor of {10 ** (2 * old[BAND]):.2g}")
        return
    allowed = max(math.log10(ratio), noise * math.sqrt(2) * old[BAND])
    for name in ("run", "least"):
        yield name, _apart(old.get(name, 0.0), new[name], allowed)
    if new[BAND] > _WIDEST:
        yield BAND, (Verdict.INCOMPARABLE, f"its runs scatter by a factor of {10 ** (2 * new[BAND]):.2g}")


def _apart(old: float, new: float, allowed: float) -> Judged:
    if min(old, new) <= 0:
        return SAME if old == new else (Verdict.INCOMPARABLE, "a run that took no time")
    grown = math.log10(new / old)
    if abs(grown) <= allowed:
        return SAME
    if grown > 0:
        return Verdict.WORSE, f"{10**grown:.3g} times as long, where {10**allowed:.2g} is allowed"
    return Verdict.BETTER, f"{10**-grown:.3g} times as fast, where {10**allowed:.2g} is allowed"
