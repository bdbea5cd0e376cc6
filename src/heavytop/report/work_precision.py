"""Work against precision, read off the rows of a report: one line for each integrator and format, and what it shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from heavytop.records import Row

OURS = "heyoka"
TARGET = -10.0
"""log10 of the error at which integrators are compared."""


@dataclass(frozen=True, slots=True)
class Point:
    """One rung that reached the end: log10 of its error, its seconds, its tolerance or step.

    seconds: of its fastest run.  Other work on the machine only ever adds, and adds more to longer runs: medians on a
    busy machine would flatter whoever is quick.
    """

    log10: float
    seconds: float
    setting: str


@dataclass(slots=True)
class Line:
    """One integrator in one format, from coarse to fine as the plan has it.

    failures: the seconds that rungs took which did not reach the end; they have no error.
    """

    integrator: str
    precision: str
    points: list[Point] = field(default_factory=list)
    failures: list[float] = field(default_factory=list)

    @property
    def label(self) -> str:
        """``heyoka quad``; double goes without saying for a peer."""
        plain = self.precision == "double" and self.integrator != OURS
        return self.integrator if plain else f"{self.integrator} {self.precision}"

    @property
    def best(self) -> Point | None:
        """The rung with the smallest error."""
        return min(self.points, key=lambda point: point.log10, default=None)

    def seconds_at(self, log10: float) -> float | None:
        """The seconds for an error of 10^log10: the least over rungs as fine, and between rungs on either side of it,
        where a straight line on logarithmic axes is drawn; None where no rung is as fine.
        """
        found = [point.seconds for point in self.points if point.log10 <= log10]
        for one, other in zip(self.points, self.points[1:], strict=False):
            if min(one.log10, other.log10) <= log10 <= max(one.log10, other.log10) and one.log10 != other.log10:
                part = (log10 - one.log10) / (other.log10 - one.log10)
                found.append(one.seconds ** (1 - part) * other.seconds**part)
        return min(found, default=None)


@dataclass(frozen=True, slots=True)
class Lead:
    """How heyoka in double compares with the best peer that reaches the error, on one case.

    ours, theirs: seconds, None where none reaches it.  peer: the best one.
    """

    case: str
    log10: float
    ours: float | None
    peer: str
    theirs: float | None

    @property
    def ratio(self) -> float | None:
        """How many times faster heyoka is."""
        return None if self.ours is None or self.theirs is None else self.theirs / self.ours

    @property
    def text(self) -> str:
        """The lead in a sentence."""
        goal = f"{self.case}: heyoka double at error 1e{self.log10:g}"
        if self.ours is None:
            return f"{goal}: not reached"
        if self.ratio is None or self.theirs is None:
            return f"{goal} takes {_time(self.ours)}; no peer gets there"
        speed = f"{self.ratio:.1f} times faster" if self.ratio >= 1 else f"{1 / self.ratio:.1f} times slower"
        pair = f"{_time(self.ours)} against {_time(self.theirs)}"
        return f"{goal} is {speed} than the best peer that gets there, {self.peer} ({pair})"


def panels(rows: Sequence[Row], metric: str = "error_max") -> dict[str, list[Line]]:
    """The lines of each case.  metric: error_max (over the whole horizon) or error_final."""
    found: dict[str, dict[tuple[str, str], Line]] = {}
    for row in rows:
        if row.measure != "work_precision":
            continue
        name, _, setting = row.integrator.partition(" ")
        line = found.setdefault(row.case, {}).setdefault((name, row.precision), Line(name, row.precision))
        seconds = row.seconds.get("least", math.nan)
        error = row.metrics.get(metric)
        if row.outcome != "success":
            line.failures.append(seconds)
        elif error is not None and error.log10 is not None and seconds > 0:
            line.points.append(Point(error.log10, seconds, setting))
    return {case: list(lines.values()) for case, lines in found.items()}


def leads(rows: Sequence[Row], log10: float = TARGET) -> list[Lead]:
    """heyoka in double against the best peer, for each case that has both."""
    result = []
    for case, lines in panels(rows).items():
        ours = next((line for line in lines if (line.integrator, line.precision) == (OURS, "double")), None)
        peers = [line for line in lines if line.integrator.partition(":")[0] != OURS]
        if ours is None or not peers:
            continue
        times = [(seconds, line.label) for line in peers if (seconds := line.seconds_at(log10)) is not None]
        theirs, name = min(times, default=(None, ""))
        result.append(Lead(case, log10, ours.seconds_at(log10), name, theirs))
    return result


def _time(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 1 else f"{1000 * seconds:.3g} ms"
