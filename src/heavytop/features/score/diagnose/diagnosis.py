"""Diagnosis of a trajectory that is off: each hypothesis is a motion that is computed and compared with the states.

A hypothesis is accepted if the error falls by two decades, by three where a number was fitted to the states; otherwise
nothing is said.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from sys import float_info

import numpy

from heavytop.features.score.diagnose import hypotheses
from heavytop.features.score.diagnose.conventions import ConventionSearch
from heavytop.features.score.diagnose.readings import Observations, of_states
from heavytop.features.score.diagnose.samples import (
    AS_AT_START,
    MOST_AT_ONCE,
    VARIES,
    WITH_ATTITUDE,
    Examined,
    FileAxes,
    examined,
    in_units,
)
from heavytop.features.score.diagnose.search import (
    FIRST,
    FLOOR,
    LIKELY_DROP,
    WORTH_ASKING,
    Array,
    Diagnosis,
    Hypothesis,
    Search,
    rounded,
    scope,
)
from heavytop.measure.scalar import EXPLAINS, LEAST, Rounding, roundings
from heavytop.precision import Precision, decimal_text, plain_decimal
from heavytop.top.equations import System, holding
from heavytop.top.heavy_top import HeavyTop, State

_WRONG = 1e-3
"""Relative errors below it are not those of other equations."""
_TOO_FAR = 1.0
"""Taken for the error where heyoka does not get to the times."""
_CONSTANT = 100.0
"""Integrals are constant but off if they are off by so many times what they vary by, ..."""
_OFF = 1e-3
"""... and by so much of what they may be; they vary if they vary by as much."""
_FEWEST_ROWS = 4
_FEWEST_STILL = 3
_WHOLE = slice(None)
_VECTORS = {"": _WHOLE, "γ": slice(3, None), "Ω": slice(0, 3)}
"""Parts of a state that may be frozen."""
_ALONE = 1000.0
"""A few states are outliers if their error is so many times that of any other, ..."""
_RIGHT = 1e-2
"""... if these errors are at most that, ..."""
_FEW_OF, _MOST_ALONE = 4, 8
"""... and if they are at most one in four, and so many."""
_GRID = 200
"""Times at which the motion is evaluated within one interval between samples."""
_BACK, _JUMPS = 0.05, 0.3
"""Distance within which a state is back near the start, and beyond which it jumps."""
_AGAIN, _FOLLOWED = 10.0, 6
"""Factor by which the error of so many samples must fall for a motion that starts again."""
_LONG = 1.5
"""The last state is not judged if the interval before it is so many times the longest other."""


def diagnose(
    top: HeavyTop,
    start: State,
    system: System,
    times: Sequence[Fraction],
    states: Sequence[Sequence[Fraction | None]],
    precision: Precision,
    relative_error: float | None,
    errors: Sequence[float] = (),
    frame: FileAxes | None = None,
    seen: Observations | None = None,
    step: Fraction | None = None,
) -> list[Diagnosis]:
    """The explanation of the states of a motion: one mistake, or the digits they are written with; empty without any.

    relative_error: the largest |error|/max(1, |value|) that was measured; None without a reference.
    errors: that of each state relative to the size of Ω and γ, up to where the reference ends; empty without one.
    frame, seen: of a file of other columns, whose states are in its axes, with None for what it does not give.
    step: of the method, where it is known.
    """

    def written_so(least: int) -> list[Rounding]:
        return [] if frame else roundings([[value for value in row if value] for row in states], precision, least)

    measured, written = numpy.array(errors, dtype=float), written_so(LEAST)
    with numpy.errstate(all="ignore"):  # what overflows explains nothing
        samples = examined(top, start, system, times, states, int(measured.argmax()) if len(measured) else None, frame)
        trusted = None if samples is None or frame is not None else samples.trusted()
        alone = [rounding for rounding in written_so(1) if _only_rounded(rounding, relative_error, trusted)]
        if alone:
            return rounded([rounding for rounding in alone if rounding in written], relative_error)
        mistake = _still(samples, states, relative_error) or _reset(samples) or _off_alone(samples, times, measured)
        if mistake is None:
            if seen is None and system in WITH_ATTITUDE:
                seen = of_states(top, start, times, states)
            samples = samples if samples is not None and samples.rows else None
            searches: list[Search] = [] if samples is None else [StateSearch(samples)]
            if seen is not None:
                searches.insert(0 if frame else len(searches), ConventionSearch(seen, step))
            mistake = _explanation(searches, samples)
    return [mistake] if mistake else []


def _explanation(searches: Sequence[Search], examined: Examined | None) -> Diagnosis | None:
    """The explanation of the states, by the first search that has one, over all samples or the first ones."""

    def sure(first: int | None = None) -> Diagnosis | None:
        return next((fit for search in searches if (fit := search.sure(first)) is not None), None)

    exact = sure()
    if exact is None and examined is not None:
        every = examined.widened()
        exact = _looked_at(every, _lost_row(every))
    exact = exact or sure(FIRST[0]) or sure(FIRST[1])
    for columns in searches:
        if isinstance(columns, ConventionSearch):
            exact = exact or columns.of_rates() or columns.of_start()
    if exact is not None:
        return exact
    for first in (None, *FIRST):
        guesses = [fit for search in searches if (fit := search.sure(first, LIKELY_DROP)) is not None]
        if guesses:
            return min(guesses, key=lambda fit: (fit.left or 0.0) / (fit.error or 1.0))
    return None if examined is None else _looked_at(examined, _integrals_off(examined))


def _only_rounded(written: Rounding, error: float | None, examined: Examined | None) -> bool:
    """Whether every component compared is the true one, rounded as it is written."""
    if error is not None and error > EXPLAINS * written.error:
        return False
    truth = None if examined is None or not examined.rows else examined.simulated(examined.times)
    if examined is None or truth is None:
        return error is not None
    units, sizes = (numpy.repeat([value, 1.0], 3) for value in (float(examined.units.time), examined.rate))
    allowed = EXPLAINS * written.spacing(examined.states / units) / 2 * units + 10 * WORTH_ASKING * sizes
    return bool((numpy.abs(examined.states - truth) <= allowed).all())


class StateSearch(Search):
    """The search among hypotheses about the states, the data and the equations."""

    def __init__(self, examined: Examined) -> None:
        self.truth = examined.simulated(examined.times)
        self.file_errors = examined.errors(self.truth)
        self.examined = examined.refusing(float(self.file_errors.max()))
        self.times, self.states = examined.given_times, len(examined.all_times)

    def hypotheses(self) -> Iterator[Hypothesis]:
        """All hypotheses, the simplest first, those with a fitted number last."""
        examined, truth = self.examined, self.truth
        single, several = ([], []) if truth is None else hypotheses.readings(examined, truth)
        yield from single
        yield from hypotheses.without_numbers(examined)
        yield from hypotheses.clock(examined)
        yield from several
        if truth is not None:
            yield from hypotheses.scaled(examined, truth)
        for fitted in (
            hypotheses.fitted_clock,
            hypotheses.all_scaled,
            hypotheses.another_weight,
            hypotheses.another_start,
            hypotheses.another_top,
        ):
            yield from fitted(examined)

    def further(self, diagnosis: Diagnosis | None, error: float) -> Iterator[Hypothesis]:
        """Other equations; a sign in those of a symmetric body is another top as well."""
        if (diagnosis is None or diagnosis.kind == "top") and error > _WRONG and self.truth is not None:
            yield from hypotheses.of_equations(self.examined, self.truth)


def _reset(examined: Examined | None) -> Diagnosis | None:
    """From some sample on, states are those of the motion that starts again there, as a program restarts what it lost.

    They jump, to a state near the start, and go on from it: a motion that comes back to its start does not jump.
    Where the first sample after t = 0 is the start, all rows are late.
    """
    if examined is None or not examined.is_whole or len(examined.all_times) < _FEWEST_ROWS:
        return None
    every = examined.at(range(min(len(examined.all_times), MOST_AT_ONCE)))
    times = numpy.array([float(time) for time in every.times])
    grid = numpy.linspace(0, numpy.diff(times).max() if times[0] >= 0 else numpy.diff(times).min(), _GRID)
    truth = every.simulated(every.times)
    errors = every.errors(truth)
    orbit = (
        every.simulated([Fraction(value) for value in grid]) if truth is not None and errors.max() > _JUMPS else None
    )
    if orbit is None:
        return None
    sizes = numpy.repeat([every.rate, 1.0], [3, orbit.shape[1] - 3])
    near = numpy.array([numpy.abs((orbit - state) / sizes).max(axis=1).min() for state in every.states])
    first = 2 if times[0] == 0 else 1
    back = numpy.flatnonzero((near[first:-2] <= _BACK) & (errors[first:-2] > _JUMPS)) + first
    for row in map(int, back):
        rows = range(row, min(row + _FOLLOWED, len(times)))
        nearest = int(numpy.abs((orbit - every.states[row]) / sizes).max(axis=1).argmin())
        expected = every.follows(row - 1)
        repeated = every.at([every.rows[n] for n in rows])
        moved = repeated.simulated([time - every.times[row] + Fraction(grid[nearest]) for time in repeated.times])
        jumps = expected is not None and _apart(every, every.states[row], expected) > _JUMPS
        left, error = float(repeated.errors(moved).max()), float(errors[rows].max())
        if jumps and left * _AGAIN <= error:
            return Diagnosis("reset", {"t": in_units(times[row], every.units.time)}, error, left)
    return None


def _still(
    examined: Examined | None, states: Sequence[Sequence[Fraction | None]], relative_error: float | None
) -> Diagnosis | None:
    """At least three last states, or their Ω or γ, that are equal although the motion changes there."""
    if examined is None or (relative_error is not None and relative_error <= _WRONG):
        return None
    for name, components in _VECTORS.items():
        rows = [list(state[components]) for state in states]
        count = next((n for n, row in enumerate(reversed(rows)) if row != rows[-1]), len(rows))
        if count < _FEWEST_STILL or not _moves(examined, len(rows) - count, components):
            continue
        if count < len(rows):
            first = in_units(examined.all_times[-count], examined.units.time)
            of = {"vector": name} if name else {}
            return Diagnosis("frozen", {"t": first, "states": f"{count} of {len(states)}", **of})
        if not name:
            return Diagnosis("constant")
    return None


def _moves(examined: Examined, row: int, components: slice) -> bool:
    """Whether the motion from the start, or that from the state of ``row``, moves from there to the next sample."""
    true, here = examined.simulated(examined.all_times[row : row + 2]), examined.all_states[row]
    pairs = [(here, examined.follows(row))] + ([] if true is None else [(true[0], true[1])])
    return any(after is not None and _apart(examined, after, before, components) > _WRONG for before, after in pairs)


def _apart(examined: Examined, first: Array, second: Array, part: slice = _WHOLE) -> float:
    """How far two states, or parts of them, are apart, relative to the size of Ω and of γ."""
    return float((numpy.abs(first - second) / numpy.repeat([examined.rate, 1.0], [3, len(first) - 3]))[part].max())


def _off_alone(examined: Examined | None, times: Sequence[Fraction], errors: Array) -> Diagnosis | None:
    """A few outliers among states that are right.

    errors: as far as they were measured; where there are none, those relative to heyoka's motion.
    """
    every = examined.widened() if examined is not None and not len(errors) else None
    truth = None if every is None or not every.rows else every.simulated(every.times)
    if every is not None and truth is not None:
        errors = every.errors(truth)
    order = numpy.argsort(-errors, kind="stable")
    most = max(1, min(_MOST_ALONE, len(errors) // _FEW_OF)) if len(errors) > 2 else 0
    gaps = [n for n in range(1, most + 1) if _gap(errors[order[n - 1]], errors[order[n]])]
    off = sorted(map(int, order[: gaps[-1]])) if gaps else []
    last = len(errors) - 1
    if not off or (last in off and (len(off) > 1 or not _jumps(examined, times, last, errors))):
        return None
    error, left = (min(float(errors[row]), float_info.max) for row in (order[0], order[len(off)]))
    where = ", ".join(plain_decimal(times[row], 6) for row in off)
    which = ", ".join(str(row + 1) for row in off)
    looked_at = None if len(errors) == len(times) else (len(errors), len(times), decimal_text(times[last], 6))
    numbers = {"t": where, "state": f"{which} of {len(errors)}"}
    return Diagnosis("one_state" if len(off) == 1 else "some_states", numbers, error, left, looked_at)


def _gap(error: float, next_error: float) -> bool:
    """Whether the first error is that of an outlier, and the other that of a right state."""
    return bool(error > WORTH_ASKING and error >= _ALONE * next_error and next_error <= _RIGHT)


def _jumps(examined: Examined | None, times: Sequence[Fraction], last: int, errors: Array) -> bool:
    """Whether the last state is not that of the motion through the one before, nor much later than that."""
    spans = [abs(b - a) for a, b in zip([Fraction(0), *times[: last - 1]], times[:last], strict=True)]
    if examined is None or abs(times[last] - times[last - 1]) > _LONG * max(spans):
        return False
    if numpy.isnan(examined.all_states[last]).any():  # without Ω no motion goes on from the state before
        return bool(errors[last] * max(errors[last - 2], FLOOR) >= _ALONE * errors[last - 1] ** 2)
    expected = examined.follows(last - 1)
    if expected is None:
        return False
    return _apart(examined, examined.all_states[last], expected) >= float(errors[last]) / 2


def _looked_at(examined: Examined, diagnosis: Diagnosis | None) -> Diagnosis | None:
    """The diagnosis with the number of states that were compared, where that is not all of them."""
    if diagnosis is None:
        return None
    return replace(diagnosis, looked_at=scope(examined.given_times, len(examined.all_times)))


def _lost_row(every: Examined) -> Diagnosis | None:
    """States that are right up to a time, and from there on those of the next sample, or of the one before."""
    times = every.times
    if len(times) < _FEWEST_ROWS:
        return None
    ends = {"row_missing": [*times[1:], 2 * times[-1] - times[-2]], "row_twice": [Fraction(0), *times[:-1]]}
    readings = [(kind, every.simulated(moved)) for kind, moved in ends.items()]
    truth = every.simulated(times)
    if truth is None:
        return None
    errors = every.errors(truth)
    for kind, moved_truth in readings:
        if moved_truth is None:
            continue
        moved = every.errors(moved_truth)
        left = [max(errors[:row].max(), moved[row:].max()) for row in range(1, len(times) - 1)]
        row = int(numpy.argmin(left))
        if left[row] * _ALONE <= errors.max():
            return Diagnosis(
                kind, {"t": in_units(times[row + 1], every.units.time)}, float(errors.max()), float(left[row])
            )
    return None


def _integrals_off(examined: Examined) -> Diagnosis | None:
    """First integrals that keep a value from the first sample on which is not that of the start, and what others do."""
    if len(examined.rows) < 3 or not examined.is_whole:
        return None
    truth = examined.simulated(examined.times)
    error = _TOO_FAR if truth is None else float(examined.errors(truth).max())
    if error <= WORTH_ASKING:
        return None
    p = examined.system.parameters(examined.top, examined.start)
    start = [float(value) for value in examined.start.flat]
    vectors = examined.states.reshape(len(examined.states), -1, 3) @ examined.frame.axes
    numbers: dict[str, str] = {}
    for integral in holding(examined.top, examined.start, examined.system):
        if integral.name not in (sizes := _sizes(examined)):
            continue
        size, unit = sizes[integral.name]
        values = numpy.array([float(integral.value(p, [*omega, *gamma])) for omega, gamma, *_ in vectors])
        at_start = float(integral.value(p, start))
        off, varies = abs(float(values.mean()) - at_start), float(values.max() - values.min())
        if not varies <= _OFF * size:
            numbers[integral.name] = VARIES
        elif off > max(_CONSTANT * varies, _OFF * size):
            numbers[integral.name] = f"{in_units(values.mean(), unit)}, not {in_units(at_start, unit)}"
        elif off <= _OFF * size:
            numbers[integral.name] = AS_AT_START
    differing = set(numbers.values()) - {VARIES, AS_AT_START}
    return Diagnosis("integrals_off", numbers, error) if differing else None


def _sizes(examined: Examined) -> dict[str, tuple[float, Fraction]]:
    """Sizes and units of the integrals."""
    p = examined.system.parameters(examined.top, examined.start)
    inertia, moment = max(map(float, p.inertia)), max(abs(float(value)) for value in p.moment)
    rotor = max(abs(float(value)) for value in examined.top.rotor or (0,))
    area, energy = inertia * examined.rate + rotor, inertia * examined.rate**2 + moment
    area_unit, energy_unit = examined.units.moment * examined.units.time, examined.units.moment
    return {
        "gamma_squared": (1.0, Fraction(1)),
        "area": (area, area_unit),
        "energy": (energy, energy_unit),
        "gyrostat_energy": (energy, energy_unit),
        "momentum_squared": (area**2, area_unit**2),
        "spin": (examined.rate, 1 / examined.units.time),
    }
