"""Work-precision curves of the rows of a report, one for each integrator and format, and comparisons of them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from heavytop.display import plural
from heavytop.integrate.registry import INTEGRATORS
from heavytop.measure.scorer import ERRORS
from heavytop.precision import exact, parse
from heavytop.records import FINEST, MULTIWORD, UNMEASURED, UNRESOLVED_SECONDS, Row
from heavytop.report.document.document import Headline, In, Table, clip, scientific

_MOST_CASES = 2
_ABOVE_ROUNDING = 100
"""Multiple of the roundings of all steps above which an error shows an order."""
_APART = 1.2
"""Ratio of two steps from which an order is computed: nearer ones are dominated by rounding."""
OURS, CONSTANTS, LANES = "heyoka", "heyoka:constants", "heyoka:lanes"
"""heyoka; with the numbers of the top compiled into its code; eight motions at once.  Others compare with these."""


@dataclass(frozen=True, slots=True)
class WorkPrecisionPoint:
    """One point that reached the end: log10 of its error, its seconds, its tolerance or step in words.

    step: fixed, or the mean one of a method with an order and a tolerance; 0 where its error may be rounding.
    seconds: of its fastest run, or the resolution where these are fewer.  Other work on the machine only adds time, and
    more to longer runs: medians on a busy machine would favour the faster integrator.
    """

    log10: float
    seconds: float
    setting: str
    resolved: bool = True
    step: float = 0.0

    def takes(self, digits: int = 3) -> str:
        """``15 ms``, or ``< 0.1 ms``."""
        return ("" if self.resolved else "< ") + seconds_text(self.seconds, digits)


@dataclass(slots=True)
class WorkPrecisionLine:
    """The curve of one integrator in one format, from coarse to fine in the order of the plan.

    failures: seconds of runs that did not reach the end; they have no error.  declared: the order of the integrator.
    compile: most seconds of compilation over the points; 0 where unknown.
    resolution: seconds up to which times are not resolved.
    """

    integrator: str
    precision: str
    points: list[WorkPrecisionPoint] = field(default_factory=list)
    failures: list[float] = field(default_factory=list)
    compile: float = 0.0
    declared: int = 0
    resolution: float = 0.0

    @property
    def order(self) -> float | None:
        """The order observed in whole runs: between the finest step whose error exceeds rounding and the next one that
        is 1.2 times as long; None where a step up to that has no larger error.
        """
        points = sorted((point for point in self.points if point.step), key=lambda point: point.step)
        coarse = next((point for point in points if point.step >= _APART * points[0].step), None)
        if coarse is None or any(point.log10 <= points[0].log10 for point in points[1 : points.index(coarse) + 1]):
            return None
        return (coarse.log10 - points[0].log10) / math.log10(coarse.step / points[0].step)

    @property
    def order_text(self) -> str:
        """The observed order followed by the declared one; "-" where none is observed."""
        declared = f" (declared: {self.declared})" if self.declared else ""
        return "-" if self.order is None else f"{self.order:z.1f}{declared}"

    @property
    def label(self) -> str:
        """``heyoka quad``; double goes without saying for others."""
        plain = self.precision == "double" and self.integrator != OURS
        return self.integrator if plain else f"{self.integrator} {self.precision}"

    @property
    def best(self) -> WorkPrecisionPoint | None:
        """The point with the smallest error."""
        return min(self.points, key=lambda point: point.log10, default=None)

    def takes(self, seconds: float) -> str:
        """``0.015 s``, or ``< 0.0001 s`` of what is not resolved."""
        return f"< {self.resolution:.2g} s" if seconds <= self.resolution else f"{seconds:.2g} s"

    def seconds_at(self, log10: float) -> float | None:
        """The seconds for an error of 10^log10: the least over points as fine, and between points on either side of it,
        where a straight line on logarithmic axes is drawn; None where no point is as fine.
        """
        seconds = [point.seconds for point in self.points if point.log10 <= log10]
        for one, other in zip(self.points, self.points[1:], strict=False):
            if min(one.log10, other.log10) <= log10 <= max(one.log10, other.log10) and one.log10 != other.log10:
                part = (log10 - one.log10) / (other.log10 - one.log10)
                seconds.append(one.seconds ** (1 - part) * other.seconds**part)
        return min(seconds, default=None)


@dataclass(frozen=True, slots=True)
class Lead:
    """Comparison of heyoka with the fastest other integrator that reaches an error, on one case.

    log10: of the error.  ours, theirs, lanes: seconds, None where none reaches it.  name, other: of these integrators.
    general: label and seconds of heyoka with one code for every top, where ``name`` has the constants of this one.
    compile: most seconds of compilation of each of the two forms.
    """

    case: str
    log10: float
    name: str
    ours: float | None
    other: str
    theirs: float | None
    lanes: float | None = None
    general: tuple[str, float | None] | None = None
    compile: dict[str, float] = field(default_factory=dict)

    @property
    def ratio(self) -> float | None:
        """The seconds of the other integrator over those of heyoka."""
        return self._ratio(self.ours)

    def _ratio(self, seconds: float | None) -> float | None:
        return None if seconds is None or self.theirs is None else self.theirs / seconds

    @property
    def short(self) -> str:
        """The ratios in a line, who is faster first; "" where absent."""
        if self.ratio is None:
            return ""
        if self.ratio < 1:
            return f"At 1e{self.log10:g} {self.other} is {_times(1 / self.ratio)}as fast as {self.name}"
        other = self.general and self._ratio(self.general[1])
        more = f"{self.ratio:.1f} ×, {self.general[0]} {other:.1f} × " if self.general and other else ""
        return f"At 1e{self.log10:g} {self.name} is {more or _times(self.ratio)}as fast as {self.other}"

    @property
    def text(self) -> str:
        """The lead in a sentence."""
        goal = f"{self.case}: {self.name} at error 1e{self.log10:g}"
        if self.ours is None:
            theirs = "" if self.theirs is None else seconds_text(self.theirs)
            fastest = f"; the fastest that reaches it is {self.other} ({theirs})" if theirs else ""
            return f"{goal}: not reached{fastest}"
        if self.ratio is None or self.theirs is None:
            parts = [f"{goal} takes {seconds_text(self.ours)}; no other reaches it"]
        elif self.ratio < 1:
            parts = [
                f"{self.case}: the fastest at error 1e{self.log10:g} is {self.other} ({seconds_text(self.theirs)})"
            ]
            parts.append(f"{self.name} is {_speed(self.ratio)} ({seconds_text(self.ours)})")
        else:
            pair = f"{seconds_text(self.ours)} against {seconds_text(self.theirs)}"
            parts = [f"{goal} is {_speed(self.ratio)} as the best other integrator, {self.other} ({pair})"]
        if self.general is not None:
            parts.append(f"{self.general[0]}, one code for every top, {self._general_said(self.general[1])}")
        if self.lanes is not None:
            parts.append(f"a motion in lanes takes {seconds_text(self.lanes)}")
        if self.compile:
            parts.append(
                "to compile, at most: " + ", ".join(f"{name} {seconds_text(s)}" for name, s in self.compile.items())
            )
        return "; ".join(parts)

    def _general_said(self, seconds: float | None) -> str:
        if seconds is None:
            return "does not reach it"
        ratio = self._ratio(seconds)
        return f"takes {seconds_text(seconds)}" if ratio is None else f"is {_speed(ratio)} ({seconds_text(seconds)})"


def panels(rows: Sequence[Row]) -> dict[str, list[WorkPrecisionLine]]:
    """The lines of each case, by the largest error over the samples."""
    cases: dict[str, dict[tuple[str, str], WorkPrecisionLine]] = {}
    for row in rows:
        if row.outcome in UNMEASURED:
            continue
        name = row.key.subject.name
        line = cases.setdefault(row.case, {}).setdefault((name, row.precision), WorkPrecisionLine(name, row.precision))
        seconds, resolution = row.seconds.get("least", math.nan), row.seconds.get(UNRESOLVED_SECONDS, 0.0)
        error = row.metrics.get(ERRORS[0].text)
        if row.outcome != "success":
            line.failures.append(seconds)
        elif error is not None and error.log10 is not None and seconds > 0:
            asked, step = row.key.subject.asked, _step(row, error.log10)
            point = WorkPrecisionPoint(error.log10, max(seconds, resolution), asked, not resolution, step)
            line.points.append(point)
            line.declared = row.order or 0
            line.resolution = max(line.resolution, resolution)
            line.compile = max(line.compile, row.seconds.get("compile", 0.0))
    return {case: list(lines.values()) for case, lines in cases.items()}


def _step(row: Row, log10: float) -> float:
    """The step of a row, mean where a tolerance sets it, whose error is more than its roundings, in one direction, come
    to as the motion amplifies them; else 0, as where samples bound the steps, and of heyoka and multiword, whose order
    is another for each tolerance.
    """
    factor = max(_ABOVE_ROUNDING, row.amplification or 1)
    rounding = math.log10(factor * max(row.steps, 1) * float(parse(row.precision).eps))
    if log10 <= rounding:
        return 0.0
    subject = row.key.subject
    if subject.step not in ("", FINEST):
        return float(exact(subject.step))
    adaptive = subject.tolerance and row.order and subject.name not in (OURS, CONSTANTS, LANES, MULTIWORD)
    return float(exact(row.horizon)) / row.steps if adaptive and row.steps > 4 * row.samples else 0.0


def beside_ours(rows: Sequence[Row]) -> list[Table]:
    """The integrator that is measured beside heyoka alone, or comes from another package: a table a case, two at most,
    a line a point of the curve with its error, its time and, where heyoka is measured, heyoka's time for that error.
    """
    lines_by_case = panels(rows)
    names = {line.integrator for lines in lines_by_case.values() for line in lines} - {OURS, CONSTANTS, LANES}
    beside = any(line.integrator == OURS for lines in lines_by_case.values() for line in lines)
    tables = []
    own = names if beside and len(names) == 1 else names - INTEGRATORS.keys()
    for name in sorted(own):
        of_name = {case: [line for line in lines if line.integrator == name] for case, lines in lines_by_case.items()}
        for case in [case for case, lines in of_name.items() if any(line.points for line in lines)][:_MOST_CASES]:
            cells = []
            for line in of_name[case]:
                ours = [
                    curve
                    for curve in lines_by_case[case]
                    if (curve.integrator, curve.precision) == (OURS, line.precision)
                ]
                cells += [_point(line, point, ours)[: 3 + beside] for point in line.points]
                order = "order, finest two" if len(own) == 1 else f"order of {name}, finest two"
                cells += [] if line.order is None else [[order, line.order_text, "", ""][: 3 + beside]]
            columns = [f"{name}, {case}", "error", "time", "heyoka's time"][: 3 + beside]
            tables.append(Table("", columns, cells, shown=In.SHORT))
    return tables


def _point(line: WorkPrecisionLine, point: WorkPrecisionPoint, ours: Sequence[WorkPrecisionLine]) -> list[str]:
    """The setting of a point, its error and its time, and heyoka's time for that error."""
    setting = point.setting if line.precision == "double" else f"{line.precision} {point.setting}"
    seconds = _quickest(ours, point.log10)[0]
    known = "not reached" if seconds is None else seconds_text(seconds, 2)
    compared = known if ours and point.resolved else "-"
    return [setting, f"{10**point.log10:.1e}", point.takes(2), compared]


def leads(rows: Sequence[Row]) -> list[Lead]:
    """heyoka's best scalar line against the best of the others, for each case that has both and an error that one
    reaches: in double at 1e-10, and beyond extended at 1e-30.
    """
    return [
        lead
        for case, lines in panels(rows).items()
        for log10, formats in ((-10.0, ("double",)), (-30.0, ("double-double", "quad", "real")))
        if (lead := _lead(case, log10, [line for line in lines if parse(line.precision).family in formats]))
    ]


def _lead(case: str, log10: float, lines: Sequence[WorkPrecisionLine]) -> Lead | None:
    ours = [line for line in lines if line.integrator in (OURS, CONSTANTS)]
    lanes = [line for line in lines if line.integrator == LANES]
    others = [line for line in lines if line.integrator not in (OURS, CONSTANTS, LANES)]
    if not ours or not others:
        return None
    (mine, name), (theirs, other), (side_by_side, _) = (_quickest(group, log10) for group in (ours, others, lanes))
    if (mine is None and theirs is None) or (theirs or math.inf) <= max(line.resolution for line in others):
        return None
    name = name or ours[0].label
    general = [(line.label, line.seconds_at(log10)) for line in ours if line.integrator == OURS]
    two_forms = any(line.integrator == CONSTANTS for line in ours)
    return Lead(
        case,
        log10,
        name,
        mine,
        other,
        theirs,
        side_by_side,
        general[0] if name == CONSTANTS and general else None,
        {line.label: line.compile for line in ours if line.compile and two_forms},
    )


def _quickest(lines: Sequence[WorkPrecisionLine], log10: float) -> tuple[float | None, str]:
    times = [(seconds, line.label) for line in lines if (seconds := line.seconds_at(log10)) is not None]
    return min(times, default=(None, ""))


def _times(ratio: float) -> str:
    """``1.3 × ``; "" where that is one."""
    return "" if f"{ratio:.1f}" == "1.0" else f"{ratio:.1f} × "


def _speed(ratio: float) -> str:
    return f"{ratio:.1f} × as fast" if ratio >= 1 else f"{ratio:.2g} × as fast"


def seconds_text(seconds: float, digits: int = 3) -> str:
    """1.5 s, or 15 ms."""
    value, unit = (seconds, "s") if seconds >= 1 else (1000 * seconds, "ms")
    return f"{value:.0f} {unit}" if value >= 100 else f"{value:.{digits}g} {unit}"


def fastest(rows: Sequence[Row]) -> Headline | None:
    """The fastest integrator at 1e-10 and its lead, over the motions on which heyoka and another reach it; else the
    least error of all.
    """
    ratios_of = [(lead, ratio) for lead in leads(rows) if lead.log10 == -10 and (ratio := lead.ratio) is not None]
    if not ratios_of:
        return _least_error(rows)
    ends = [(lead.name, lead.other) if ratio >= 1 else (lead.other, lead.name) for lead, ratio in ratios_of]
    (first, count), *rest = Counter(winner for winner, _ in ends).most_common()
    ratios = [max(ratio, 1 / ratio) for (winner, _), (_, ratio) in zip(ends, ratios_of, strict=True) if winner == first]
    behind = {other for winner, other in ends if winner == first}
    where = f"{count} of {len(ratios_of)} motions" if rest else f"all {plural(len(ratios_of), 'motion')}"
    where = clip(ratios_of[0][0].case, 40) if len(ratios_of) == 1 else where
    low, high = (f"{ratio:.0f}" if ratio >= 100 else f"{ratio:.1f}" for ratio in (min(ratios), max(ratios)))
    times = low if low == high else f"{low} to {high}"
    best = "the best other than heyoka" if first.startswith(OURS) else "heyoka"
    other = clip(behind.pop(), 40) if len(behind) == 1 else best
    text = f"{clip(first, 40)} is the fastest at error 1e-10 on {where}: {times} times as fast as {other}"
    return Headline("; ".join([text, *(f"{clip(name, 40)} on {n}" for name, n in rest)]) + ".")


def _least_error(rows: Sequence[Row]) -> Headline | None:
    best = [(line.best, case, line.label) for case, lines in panels(rows).items() for line in lines if line.best]
    if not best:
        return None
    point, case, label = min(best, key=lambda entry: entry[0].log10)
    text = f"The smallest error is {scientific(point.log10)}: {clip(label, 40)} on {clip(case, 40)}"
    return Headline(f"{text}, in {point.takes()}.")
