"""The section of a page about work and precision: seconds against error, one curve an integrator."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from heavytop.features.work_precision.curves import Lead, WorkPrecisionLine, leads, panels, seconds_text
from heavytop.integrate.registry import INTEGRATORS
from heavytop.measure.growth import BENT, CLASSES, FEWEST_SAMPLES, NEAR
from heavytop.measure.scorer import ERRORS
from heavytop.records import UNRESOLVED_SECONDS, Row, Series
from heavytop.report.document.document import (
    DASHED,
    TIME,
    Key,
    Keys,
    Section,
    Sources,
    Table,
    clip,
    draw,
    left_out,
    numbered,
    points,
    scientific,
    short,
)
from heavytop.report.document.svg import COLOURS, End, Picture, decades, finish, new_axes, room, spoken

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_CASES = 12
_LEADS = (
    "case",
    "error",
    "heyoka",
    "takes",
    "best of the others",
    "takes",
    "times as fast",
    "general code takes",
    "in lanes",
)


def work_precision(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Seconds of a run against its error; an aborted run is a cross, and no point."""
    rows = [(source, row) for source, report in sources for row in report.rows]
    if not rows:
        return None
    cells = [_lead_cells(lead, source) for source, report in sources for lead in leads(report.rows)]
    section = Section(
        "work-precision",
        "Work and precision",
        [
            "Run time against error: the fastest of several runs, because other work on the machine only adds time, "
            "and the largest error of a component over the samples, compared with the known motion. Lower and "
            "farther left is better. Each curve is one integrator over its tolerances or steps; compile times are in "
            "the numbers. A cross on the right edge is a run that was aborted, at the time it took: it has no error. "
            "heyoka:constants has the parameters of the top compiled into its code; heyoka with general code and the "
            "other integrators receive them at run time. heyoka:lanes runs eight motions side by side; its time is "
            "an eighth of the total, and it is not ranked.",
        ],
        answers=Table("Seconds that heyoka and the best of the others take for an error", _LEADS, cells)
        if cells
        else None,
        columns=[
            "case",
            "integrator",
            "format",
            "error on the way",
            "at the end",
            "s",
            "compile (s)",
            "steps",
            "outcome",
        ],
        rows=[_numbers(source, row) for source, row in rows],
        across=2,
        place=50,
    )
    cases = list(dict.fromkeys(row.case for _, row in rows))
    left_out(section, len(cases) - MOST_CASES, "case")
    drawn = {source: panels(report.rows) for source, report in sources}
    colours = _in_colour([lines for of_cases in drawn.values() for lines in of_cases.values()])
    if len(colours) > _MOST_COLOURS:
        section.notes.append("Grey: integrators that are less often among the five fastest at error 1e-10.")
    for number, case in enumerate(cases[:MOST_CASES]):
        lines = [(source, line) for source, of_cases in drawn.items() for line in of_cases.get(case, ())]
        section.pictures.append(_picture(lines, colours, f"{clip(case, 40)}: time against error", f"work-{number}"))
    return section


_MOST_COLOURS = 5


def _in_colour(cases: Sequence[Sequence[WorkPrecisionLine]]) -> dict[str, int]:
    """The number of each label's look: first the integrators of other packages and those that are fastest at error
    1e-10, as many as there are colours beside grey, in the order in which they come; then, in grey, the others, which
    differ in marker and dashes.
    """
    points: Counter[str] = Counter()
    for lines in cases:
        times = sorted((seconds, line.label) for line in lines if (seconds := line.seconds_at(-10.0)) is not None)
        points.update({label: _MOST_COLOURS - index for index, (_, label) in enumerate(times[:_MOST_COLOURS])})
    labels = list(dict.fromkeys(line.label for lines in cases for line in lines))
    theirs = [line.label for lines in cases for line in lines if line.integrator not in INTEGRATORS]
    best = list(dict.fromkeys([*theirs, *(label for label, _ in points.most_common()), *labels]))[:_MOST_COLOURS]
    grey = range(_MOST_COLOURS, len(COLOURS) * len(labels), len(COLOURS))
    return dict(zip(sorted(labels, key=lambda label: label not in best), (*range(_MOST_COLOURS), *grey), strict=False))


def _lead_cells(lead: Lead, source: str) -> list[str]:
    def said(seconds: float | None) -> str:
        return "not reached" if seconds is None else seconds_text(seconds)

    return [
        clip(lead.case, 40) + (f", {source}" if source else ""),
        f"1e{lead.log10:g}",
        clip(lead.name, 40),
        said(lead.ours),
        clip(lead.other, 40),
        said(lead.theirs) if lead.other else "",
        "" if lead.ratio is None else f"{'slower, ' * (round(lead.ratio, 1) < 1)}{lead.ratio:.1f}\N{NO-BREAK SPACE}×",
        "" if lead.general is None else said(lead.general[1]),
        "" if lead.lanes is None else seconds_text(lead.lanes),
    ]


def _picture(lines: Sequence[tuple[str, WorkPrecisionLine]], colours: dict[str, int], title: str, name: str) -> Picture:
    names = [clip(line.label, 30) + (f", {source}" if source else "") for source, line in lines]
    marked = [name + ", × aborted" * bool(line.failures) for name, (_, line) in zip(names, lines, strict=True)]
    height = max(3.4, 1 + 0.17 * len(lines))
    axes = new_axes("error (units of Ω and γ)", "time of a run (s)", height, room(marked))
    decades(axes.xaxis)
    decades(axes.yaxis)
    alternative, ends = [], []
    for (source, line), label, at_end in zip(lines, names, marked, strict=True):
        key = numbered(label, colours[line.label], source == "baseline")
        points = sorted((point.log10, math.log10(point.seconds)) for point in line.points)
        if points:
            draw(axes, key, [x for x, _ in points], [y for _, y in points], 4.2, every=None)
            finest = min(line.points, key=lambda point: point.log10)
            alternative.append(f"{key.label}: {scientific(finest.log10)} in {finest.takes()}.")
        failures = [math.log10(seconds) for seconds in line.failures if seconds > 0]
        if line.failures:
            edge = {"transform": axes.get_yaxis_transform(), "clip_on": False, "color": COLOURS[key.colour]}
            axes.plot([1.0] * len(failures), failures, "x", ms=6, mew=1.6, **edge)
            alternative.append(f"{key.label}: aborted ({len(line.failures)}).")
        if points or failures:
            x, y = points[-1] if points else (axes.get_xlim()[1], failures[-1])
            ends.append(End(at_end, COLOURS[key.colour], x, y))
    return finish(axes, title, spoken(alternative, 24), name, ends=ends)


def _numbers(source: str, row: Row) -> list[str]:
    errors = (row.metrics.get(quantity.text) for quantity in ERRORS)
    return [
        clip(row.case) + (f", {source}" if source else ""),
        clip(row.integrator, 50),
        clip(row.precision, 20),
        *(short(error.value) if error else "" for error in errors),
        _least(row),
        f"{row.seconds['compile']:.3g}" if "compile" in row.seconds else "",
        str(row.steps),
        clip(row.outcome, 30),
    ]


def _least(row: Row) -> str:
    """Seconds of the fastest run, or the resolution below which they lie."""
    if UNRESOLVED_SECONDS in row.seconds:
        return f"< {row.seconds[UNRESOLVED_SECONDS]:.3g}"
    return f"{row.seconds['least']:.3g}" if "least" in row.seconds else ""


# Growth of the errors of methods of about the same accuracy: one that preserves structure, and two that do not.


METHODS = ("heyoka", "cyrk:DOP853", "splitting:4")
QUANTITIES = (
    ("drift_energy", "energy drift", "|E(t) − E(0)| (units of the energy)", 0.5),
    ("solution_error_along", "error along the flow (phase)", "error along the flow (units of Ω and γ)", 1.5),
)
"""Series, name, axis, and the power of the steps by which rounding errors alone grow."""
_LOG10 = -5.0
"""log10 of the error at which the methods are compared."""
_DECADES, _FEWEST_DECADES = 2.0, 1.5
_FITTED = Key("fitted power of t", 5, "", "6 3")
_ABOVE_ROUNDING = 10
"""Multiple of the error that rounding may cause below which the exponent of a single motion is random."""


@dataclass(frozen=True, slots=True)
class Trend:
    """A power of t through the largest error so far: log10 error = height + exponent log10 t between ``span``.

    halves: the exponents of the first and of the second half.  above: whether the error is well above what rounding
    may have made of it.
    """

    exponent: float
    halves: tuple[float, float]
    height: float
    span: tuple[float, float]
    above: bool

    @property
    def law(self) -> str:
        """The class that the exponent is within 0.12 of, if the halves differ by 0.25 at most; else ``unresolved``."""
        for name, value in CLASSES.items():
            if self.above and abs(self.exponent - value) <= NEAR and abs(self.halves[1] - self.halves[0]) <= BENT:
                return name
        return "unresolved"

    @property
    def text(self) -> str:
        """The exponent and the law in words."""
        law = self.law if self.law in ("bounded", "unresolved") else f"like {self.law}"
        return f"{law}, exponent {self.said}"

    @property
    def said(self) -> str:
        """The exponent, and those of the halves in brackets."""
        return f"{self.exponent:z.2f} ({self.halves[0]:z.2f}, then {self.halves[1]:z.2f})"


def trend(series: Series, rounding: float = 0.0) -> Trend | None:
    """The power by which the largest error so far grows, by least squares on logarithms over the last two decades of t.

    The largest so far, because an error that is bounded goes through 0 again and again.  None for fewer than eight
    samples, four in either half, or less than one and a half decades, that have a logarithm.

    rounding: what rounding alone may have made of the last error.
    """
    import numpy

    x, y = (numpy.array(part) for part in points(series))
    late = x >= max(x, default=0.0) - _DECADES - 1e-3
    times, errors = x[late], numpy.maximum.accumulate(y)[late]
    if len(times) < FEWEST_SAMPLES or numpy.ptp(times) < _FEWEST_DECADES:
        return None
    middle = (times[0] + times[-1]) / 2
    first, second = times <= middle, times >= middle
    if min(first.sum(), second.sum()) < FEWEST_SAMPLES / 2:
        return None
    slope, height = numpy.polyfit(times, errors, 1)
    halves = tuple(float(numpy.polyfit(times[half], errors[half], 1)[0]) for half in (first, second))
    above = bool(10 ** errors[-1] > _ABOVE_ROUNDING * rounding)
    return Trend(float(slope), (halves[0], halves[1]), float(height), (float(times[0]), float(times[-1])), above)


def alike(rows: Sequence[Row]) -> list[Row]:
    """The point of each method whose error is nearest to 1e-5, on the case of the longest horizon that has them all."""
    cases: dict[tuple[str, str], dict[str, list[tuple[float, int]]]] = {}
    for index, row in enumerate(rows):
        name, error = row.key.subject.name, row.metrics.get("error_max")
        if row.precision != "double" or row.outcome != "success":
            continue
        if name in METHODS and "drift_energy" in row.series and error is not None and error.log10 is not None:
            points = cases.setdefault((row.case, row.horizon), {}).setdefault(name, [])
            points.append((abs(error.log10 - _LOG10), index))
    whole = [case for case, methods in cases.items() if len(methods) == len(METHODS)]
    if not whole:
        return []
    chosen = cases[max(whole, key=lambda case: Fraction(case[1]))]
    return [rows[min(chosen[name])[1]] for name in METHODS]


def _curve(axes: Axes, key: Key, row: Row, name: str, power: float) -> tuple[Trend | None, str, End | None]:
    """Draw the series ``name`` of a row over time, its trend dashed: the trend, the last value, the place of the law.

    The axes carry decimal logarithms.  power: of the steps, by which rounding errors grow.
    """
    held, end = row.series.get(name, Series([], [])), None
    x, y = points(held)
    fit = trend(held, 2.0 ** (1 - row.bits) * row.steps**power)
    if x:
        draw(axes, key, x, y, 4.2, every=None)
    if fit is not None:
        heights = [fit.height + fit.exponent * t for t in fit.span]
        axes.plot(fit.span, heights, color=COLOURS[key.colour], lw=1.2, ls=DASHED, label=_FITTED.label)
        law = "no law" if fit.law == "unresolved" else fit.law
        end = End(f"{law} ({fit.exponent:z.2f})", COLOURS[key.colour], x[-1], heights[-1])
    return fit, scientific(y[-1]) if y else "", end


def method_growth(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """The section of the page: energy drift and phase error of the three methods, with the power of t of each."""
    keys = Keys()
    chosen = [(keys.key(row.integrator, source), row) for source, report in sources for row in alike(report.rows)]
    if not chosen:
        return None
    section = Section(
        "method-growth",
        "Growth by method",
        [
            f"{clip(chosen[0][1].case)}: a splitting, which preserves structure, and two methods that do not, each at "
            "the tolerance or step whose error is nearest to 1e-5.",
            "Dashed lines, labelled with their exponents, are powers of t fitted to the largest error so far by least "
            "squares on the last two decades of t; the numbers give the exponent of each half too. A law is named only "
            "where the halves agree and the error is ten times what rounding may have caused: below that, the exponent "
            "of a single motion is chance.",
        ],
        columns=["integrator", "error on the way", "quantity", "last |t|", "last value", "exponent", "law"],
        across=2,
        place=60,
    )
    for number, (name, title, unit, power) in enumerate(QUANTITIES):
        axes = new_axes(TIME, unit, height=3.2, right=1.2)
        decades(axes.xaxis)
        decades(axes.yaxis)
        alternative = []
        ends = []
        for key, row in chosen:
            line, last, end = _curve(axes, key, row, name, power)
            ends += [end] if end else []
            section.key(key)
            alternative.append(f"{key.label}: {line.text if line else 'too few samples for a law'}.")
            exponent = line.said if line else ""
            error, law = short(row.metrics["error_max"].value), line.law if line else ""
            section.rows.append([key.label, error, title, short(row.time_reached), last, exponent, law])
        said = [f"{row[0]}: {row[4]} at |t| = {row[3]}." for row in section.rows if row[2] == title]
        heading = f"{title[0].upper()}{title[1:]} over time"
        section.pictures.append(
            finish(axes, heading, spoken([*said, *alternative]), f"method-growth-{number}", ends=ends)
        )
    section.key(_FITTED)
    return section
