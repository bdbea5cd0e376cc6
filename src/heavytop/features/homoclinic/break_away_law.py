"""The growth of escape times with the bits of the format, fitted and compared with the law of the saddle."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

import numpy
from msgspec.structs import replace

from heavytop.cases import CASES
from heavytop.errors import InputError
from heavytop.integrate.trajectory import Outcome
from heavytop.kind import Kind
from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import HEYOKA, Against, Beside, Direction, Metric, Quantity, Row, RowKey, Subject, by_name
from heavytop.report.document.document import (
    DASHED,
    Block,
    Chart,
    Headline,
    Key,
    Section,
    Sources,
    Table,
    Value,
    clip,
    draw,
    left_out,
    logarithm,
    short,
)
from heavytop.report.document.svg import COLOURS, MARKERS, finish, new_axes, spoken
from heavytop.report.render.text import both
from heavytop.report.store.checks import CLOSE

NAME = "break_away_law"
ESCAPE = Quantity("break_away_time")
SLOPE, EXPECTED, OFF_BY = (Quantity("break_away_slope", statistic=part) for part in ("", "expected", "off_by"))
_AGAINST = Against("proven", "ln 2 / rate of the saddle")
_LAW = Key("law, ln 2 / rate per bit", 5, "", "6 3")
_LARGEST = 150.0
"""log10 of the longest time that is drawn."""


def break_away_law(rows: Sequence[Row]) -> list[Row]:
    """Rows with the growth of the escape time with the bits, for each homoclinic case in two formats or more.

    Least squares over the formats; expected slope ln 2/rate, for the errors of p-bit arithmetic leave the saddle
    like 2^-p e^(rate t).
    """
    groups: dict[tuple[str, Subject], list[Row]] = {}
    for row in rows:
        if row.outcome == Outcome.SUCCESS.value and row.metrics[ESCAPE.text].log10 is not None:
            groups.setdefault((row.case, row.key.subject), []).append(row)
    laws = []
    for members in groups.values():
        if len(members) < 2:
            continue
        bits = [float(row.bits) for row in members]
        times = [float(Fraction(row.metrics[ESCAPE.text].value)) for row in members]
        slope = float(numpy.polyfit(bits, times, 1)[0])
        expected = float(numpy.log(2)) / CASES[members[0].key.case].rate
        bands = [row.metrics[ESCAPE.text].band or 0.0 for row in members]
        noise = [time * (10**band - 1) for time, band in zip(times, bands, strict=True)]
        weights = numpy.subtract(bits, numpy.mean(bits)) / (len(bits) * numpy.var(bits))
        off = float(numpy.linalg.norm(weights * noise))
        laws.append(_law_row(members, Fraction(slope), Fraction(expected), off))
    return laws


def _law_row(members: Sequence[Row], slope: Fraction, expected: Fraction, noise: float) -> Row:
    """The row of a fit; noise: the change of the slope by rounding noise of the escape times."""
    off_by = abs(slope / expected - 1)
    first, horizon = members[0], max((row.horizon for row in members), key=lambda t: abs(Fraction(t)))
    formats = ",".join(row.precision for row in members)
    metrics = {
        SLOPE: _with_band(of_fraction(slope, "value"), noise / float(slope)),
        EXPECTED: of_fraction(expected, "value"),
        OFF_BY: _with_band(of_fraction(off_by), noise / float(expected * off_by or 1)),
    }
    return Row(
        case=first.case,
        integrator=first.integrator,
        bits=max(row.bits for row in members),
        outcome=Outcome.SUCCESS.value,
        time_reached=max((row.time_reached for row in members), key=lambda t: abs(Fraction(t))),
        steps=sum(row.steps for row in members),
        finite=True,
        metrics=by_name(metrics),
        key=RowKey(NAME, first.key.case, first.system, first.key.subject, formats, first.key.direction, horizon),
        reference=_AGAINST,
        measured="time units of escape gained per bit, least squares over the formats",
    )


def _with_band(metric: Metric, relative: float) -> Metric:
    return replace(metric, band=round(math.log10(1 + abs(relative)), 4))


_Run = tuple[str, Direction, str]
"""Case, direction, source."""


def escape_times(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Escape time against the bits of the format, with the law of the saddle."""
    escapes: dict[_Run, dict[int, Fraction]] = {}
    slopes: dict[_Run, tuple[str, str]] = {}
    for source, report in sources:
        for row in report.rows:
            run = _case(row), row.key.direction, source
            if row.outcome == "success" and (metric := row.metrics.get(ESCAPE.text)):
                if metric.log10 is not None and metric.log10 < _LARGEST:
                    escapes.setdefault(run, {})[row.bits] = exact(metric.number)
            elif row.key.kind == NAME and row.metrics:
                slopes[run] = row.metrics[SLOPE.text].value, row.metrics[EXPECTED.text].value
    if not escapes:
        return None
    section = Section(
        "break-away",
        "Escape times",
        [
            "A homoclinic motion tends to a saddle, which multiplies every rounding error by e^(rate·|t|). No "
            "integrator stays on it: more digits buy time in proportion. It has escaped where Ω is off by α/1000, "
            "α being the angular velocity that it tends to, or the largest component of Ω at the start. Rate: the "
            "growth rate at the saddle. Dashed: the law, ln 2 / rate time units per bit, through the points' mean."
        ],
        columns=["case", "escape |t| per format", "slope (time per bit)", "ln 2 / rate"],
        place=40,
    )
    axes = new_axes("format (bits)", "escape |t| (time units of the data)", 3.0)
    merged = _both_directions(escapes)
    left_out(section, len(merged) - len(COLOURS) * max(1, len(sources)), "case")
    alternative, bases = [], list(dict.fromkeys(name for name, _ in merged))[: len(COLOURS)]
    for name, run in merged:
        if name not in bases:
            continue
        source = run[2]
        old, number = source == "baseline", bases.index(name)
        label = f"{clip(name, 40)}, {source}" if source else clip(name, 40)
        key = section.key(Key(label, number, MARKERS[number], "", old, False))
        bits, times = zip(*((float(b), float(t)) for b, t in sorted(escapes[run].items())), strict=True)
        draw(axes, key, bits, times, 5.5)
        measured, expected = slopes.get(run, ("", ""))
        if logarithm(expected) is not None and not old:
            slope, middle = float(exact(expected)), (sum(bits) / len(bits), sum(times) / len(times))
            line = [middle[1] + slope * (b - middle[0]) for b in bits]
            axes.plot(bits, line, color=COLOURS[number], lw=1.2, ls=DASHED, label=_LAW.label)
        listed = ", ".join(f"{t:g} at {b:g}" for b, t in zip(bits, times, strict=True))
        alternative.append(f"{label}: {listed} bits.")
        section.rows.append([label, listed, short(measured), short(expected)])
    if slopes:
        section.key(_LAW)
    axes.set(xlim=(0, 1.06 * axes.dataLim.x1), ylim=(0, 1.06 * axes.dataLim.y1))
    section.pictures.append(finish(axes, "Escape time against bits", spoken(alternative), "break-away"))
    return section


def _case(row: Row) -> str:
    return row.key.case if row.key.subject.name == HEYOKA else f"{row.key.case} ({row.key.subject.name})"


def _both_directions(escapes: dict[_Run, dict[int, Fraction]]) -> list[tuple[str, _Run]]:
    """(name, run): a case that escapes at the same times forward and backward is named once."""
    runs = []
    for (case, direction, source), times in escapes.items():
        reverse = escapes.get((case, "backward" if direction == "forward" else "forward", source))
        if not direction or reverse != times:
            runs.append((f"{case}/{direction}" if direction else case, (case, direction, source)))
        elif direction == "forward":
            runs.append((case, (case, direction, source)))
    return runs


class BreakAwayLaw(Kind):
    """Rows drawn from those of homoclinic motions; no plan asks for them."""

    name = NAME
    needed = (SLOPE.text, EXPECTED.text, OFF_BY.text)
    noise_factor = 8.0
    place = 70

    def carries_band(self, metric: Metric) -> bool:
        """True for errors, and for the slope."""
        return super().carries_band(metric) or metric.quantity == SLOPE

    def noise_is_added(self, metric: Metric) -> bool:
        """True: the noise of slopes adds up."""
        return True

    def contradictions(self, row: Row) -> Iterator[str]:
        """A deviation that is not that of the slope from the expected one."""
        values = [metric.value for metric in _numbers(row)]
        if len(values) < 3:
            return
        try:
            slope, expected, off = map(exact, values)
        except InputError:
            return
        if expected == 0 or abs(abs(slope / expected - 1) - off) > CLOSE / 100:
            yield f"{OFF_BY.text}: {values[2]}, where the slope is {values[0]} and {values[1]} is expected"

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The delay of the escape per bit of the format, its deviation from the law, and a line for each case."""
        slopes, off = ([float(row.metrics[metric.text]) for row in rows if row.metrics] for metric in (SLOPE, OFF_BY))
        if slopes:
            low, high = f"{min(slopes):.2g}", f"{max(slopes):.2g}"
            delay = low if low == high else f"{low} to {high}"
            law = f"ln 2 / growth rate at the saddle, within {100 * max(off):.2g} %"
            yield Headline(f"Each bit of the format delays the escape by {delay} time units: {law}.")
        yield Table(
            "Escape time gained per bit of the format",
            ("case", "measured", "ln 2 / rate", "off by"),
            both(
                (row, [*map(Value, values[:2]), f"{float(values[2]):.1%}"]) for row in rows if (values := _numbers(row))
            ),
        )
        yield Chart(escape_times)


def _numbers(row: Row) -> list[Metric]:
    """The slope, the expected slope and the relative deviation."""
    return [row.metrics[metric.text] for metric in (SLOPE, EXPECTED, OFF_BY) if metric.text in row.metrics]
