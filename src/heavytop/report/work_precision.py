"""Work against precision, read off the rows of a report: one line for each integrator and format, and what it shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from heavytop.precision import parse
from heavytop.records import UNMEASURED, Row

OURS, CONSTANTS, LANES = "heyoka", "heyoka:constants", "heyoka:lanes"
"""heyoka; with the numbers of the top compiled into its code; eight motions at once.  All others are peers."""


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
    compile: seconds that compiling took, at most over the rungs; 0 where none is known.
    """

    integrator: str
    precision: str
    points: list[Point] = field(default_factory=list)
    failures: list[float] = field(default_factory=list)
    compile: float = 0.0

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
    """How heyoka compares with the best peer that reaches an error, on one case.

    log10: of the error.  ours, theirs, lanes: seconds, None where none reaches it.  name, peer: who took them.
    general: label and seconds of heyoka with one code for every top, where ``name`` is compiled for this one.
    compile: seconds to compile, at most, of each of the two forms.
    """

    case: str
    log10: float
    name: str
    ours: float | None
    peer: str
    theirs: float | None
    lanes: float | None = None
    general: tuple[str, float | None] | None = None
    compile: dict[str, float] = field(default_factory=dict)

    @property
    def ratio(self) -> float | None:
        """How many times faster heyoka is."""
        return self._ratio(self.ours)

    def _ratio(self, seconds: float | None) -> float | None:
        return None if seconds is None or self.theirs is None else self.theirs / seconds

    @property
    def short(self) -> str:
        """The ratios in a line; "" where there is none."""
        if self.ratio is None:
            return ""
        if self.ratio < 1:
            return f"At 1e{self.log10:g} {self.peer} is {1 / self.ratio:.1f} × as fast as {self.name}"
        other = self.general and self._ratio(self.general[1])
        more = f" ({self.general[0]} {other:.1f} ×)" if self.general and other else ""
        return f"At 1e{self.log10:g} {self.name} is {self.ratio:.1f} × as fast as {self.peer}{more}"

    @property
    def text(self) -> str:
        """The lead in a sentence."""
        goal = f"{self.case}: {self.name} at error 1e{self.log10:g}"
        if self.ours is None:
            fastest = (
                "" if self.theirs is None else f"; the fastest that gets there is {self.peer} ({_time(self.theirs)})"
            )
            return f"{goal}: not reached{fastest}"
        if self.ratio is None or self.theirs is None:
            parts = [f"{goal} takes {_time(self.ours)}; no peer gets there"]
        elif self.ratio < 1:
            parts = [f"{self.case}: the fastest at error 1e{self.log10:g} is {self.peer} ({_time(self.theirs)})"]
            parts.append(f"{self.name} is {_speed(self.ratio)} ({_time(self.ours)})")
        else:
            pair = f"{_time(self.ours)} against {_time(self.theirs)}"
            parts = [f"{goal} is {_speed(self.ratio)} than the best peer that gets there, {self.peer} ({pair})"]
        if self.general is not None:
            parts.append(f"{self.general[0]}, one code for every top, {self._general_said(self.general[1])}")
        if self.lanes is not None:
            parts.append(f"a motion in lanes takes {_time(self.lanes)}")
        if self.compile:
            parts.append("to compile, at most: " + ", ".join(f"{name} {_time(s)}" for name, s in self.compile.items()))
        return "; ".join(parts)

    def _general_said(self, seconds: float | None) -> str:
        if seconds is None:
            return "does not get there"
        ratio = self._ratio(seconds)
        return f"takes {_time(seconds)}" if ratio is None else f"is {_speed(ratio)} ({_time(seconds)})"


def panels(rows: Sequence[Row], metric: str = "error_max") -> dict[str, list[Line]]:
    """The lines of each case.  metric: error_max (over the whole horizon) or error_final."""
    found: dict[str, dict[tuple[str, str], Line]] = {}
    for row in rows:
        if row.outcome in UNMEASURED:
            continue
        name, setting = row.key.subject.name, row.key.subject.setting
        line = found.setdefault(row.case, {}).setdefault((name, row.precision), Line(name, row.precision))
        seconds = row.seconds.get("least", math.nan)
        error = row.metrics.get(metric)
        if row.outcome != "success":
            line.failures.append(seconds)
        elif error is not None and error.log10 is not None and seconds > 0:
            line.points.append(Point(error.log10, seconds, setting))
            line.compile = max(line.compile, row.seconds.get("compile", 0.0))
    return {case: list(lines.values()) for case, lines in found.items()}


def beside_ours(rows: Sequence[Row]) -> list[str]:
    """Of each integrator that is measured at one setting alone: its error, its seconds, and heyoka's for that error."""
    said = []
    for case, lines in panels(rows).items():
        ours = [line for line in lines if line.integrator == OURS]
        for line in lines:
            if line.integrator in (OURS, CONSTANTS, LANES) or len(line.points) != 1 or not ours:
                continue
            (point,) = line.points
            seconds, _ = _quickest([each for each in ours if each.precision == line.precision], point.log10)
            needs = "does not get there" if seconds is None else f"takes {_time(seconds)} for that"
            text = f"{case}: {line.label} is off by {10**point.log10:.1e} at most after {_time(point.seconds)}"
            said.append(f"{text}; {OURS} {needs}")
    return said


def leads(rows: Sequence[Row]) -> list[Lead]:
    """heyoka's best scalar line against the best peer, for each case that has both and an error that one of them
    reaches: in double at 1e-10, and beyond extended at 1e-30.
    """
    return [
        lead
        for case, lines in panels(rows).items()
        for log10, formats in ((-10.0, ("double",)), (-30.0, ("double-double", "quad", "real")))
        if (lead := _lead(case, log10, [line for line in lines if parse(line.precision).family in formats]))
    ]


def _lead(case: str, log10: float, lines: Sequence[Line]) -> Lead | None:
    ours = [line for line in lines if line.integrator in (OURS, CONSTANTS)]
    lanes = [line for line in lines if line.integrator == LANES]
    peers = [line for line in lines if line.integrator not in (OURS, CONSTANTS, LANES)]
    if not ours or not peers:
        return None
    (mine, name), (theirs, peer), (side_by_side, _) = (_quickest(group, log10) for group in (ours, peers, lanes))
    if mine is None and theirs is None:
        return None
    name = name or ours[0].label
    general = [(line.label, line.seconds_at(log10)) for line in ours if line.integrator == OURS]
    two_forms = any(line.integrator == CONSTANTS for line in ours)
    return Lead(
        case,
        log10,
        name,
        mine,
        peer,
        theirs,
        side_by_side,
        general[0] if name == CONSTANTS and general else None,
        {line.label: line.compile for line in ours if line.compile and two_forms},
    )


def _quickest(lines: Sequence[Line], log10: float) -> tuple[float | None, str]:
    times = [(seconds, line.label) for line in lines if (seconds := line.seconds_at(log10)) is not None]
    return min(times, default=(None, ""))


def _speed(ratio: float) -> str:
    return f"{ratio:.1f} times faster" if ratio >= 1 else f"{1 / ratio:.1f} times slower"


def _time(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 1 else f"{1000 * seconds:.3g} ms"
