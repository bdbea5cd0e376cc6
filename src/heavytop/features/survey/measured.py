"""The records of a chunk: errors, digits, drifts, steps and outcomes of many motions, as columns.

The reference is a run in double-double arithmetic, eight motions in lanes; its radius is the distance from a second run
with another order and other steps.  The first motion of each chunk has a proven one too, and a computed one that is
further from it than ten of its radii and rounding is a contradiction.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy
from numpy.typing import NDArray

from heavytop.cases import Case
from heavytop.display import Lazy
from heavytop.errors import Contradiction, PeerFailed
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.harness.sweeps import Random, Sweep
from heavytop.integrate.heyoka.lanes import states_on_a_grid
from heavytop.integrate.multiword.lanes import double_double_states, propagate_multiword_ensemble
from heavytop.integrate.registry import Integrator, described
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.rounding_noise import factor, scaled
from heavytop.measure.truth import Known, known_motion
from heavytop.multiword.pairs import Pairs
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, Precision, exact, number
from heavytop.records import HEYOKA
from heavytop.top.equations import HEAVY_TOP, Integral, Parameters, System, holding
from heavytop.top.heavy_top import HeavyTop, State

# A chunk of a sweep as arrays: the tops and starts that the sweep's cases have, rounded to the format.


CHUNK = 4096
"""Motions in a chunk, a row group of the file."""
GENERAL = "general"
_CLASSES = {
    "momentum_squared": "euler",
    "moment_along_centre": "spherical",
    "spin": "lagrange",
    "kovalevskaya": "kovalevskaya",
    "goryachev_chaplygin": "goryachev-chaplygin",
    "hess": "hess",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Chunk(Case):
    """Motions ``first`` to before ``first + count`` of a sweep, as a case; its own top and start are those of the
    first.
    """

    sweep: Sweep
    first: int
    count: int


def chunks(sweep: Sweep, cases: Sequence[Case], index: int) -> Chunk:
    """The chunk of that index."""
    first = index * CHUNK
    case = cases[first]
    own = {name: getattr(case, name) for name in Case.__dataclass_fields__}
    return Chunk(**own, sweep=sweep, first=first, count=min(CHUNK, len(cases) - first))


def number_of(cases: Sequence[Case]) -> int:
    """How many chunks a sweep has."""
    return -(-len(cases) // CHUNK)


@dataclass(frozen=True, slots=True)
class Drawn:
    """Rounded motions: exactly what an integrator of the format is given.

    numbers: what enters the field, and the start, (motions, k + 6).
    """

    problems: Sequence[Problem]
    integrals: list[tuple[Integral, ...]]
    numbers: Pairs

    @property
    def system(self) -> System:
        """The system of all motions."""
        return self.problems[0].system

    @property
    def parameters(self) -> Parameters:
        """Each a column, (motions, 1)."""
        columns = [self.numbers[:, k : k + 1] for k in range(self.numbers.high.shape[1] - 6)]
        parameters = self.system.taken_in(columns)
        nothing = Pairs.of(numpy.zeros((len(self.problems), 1)))
        moment = parameters.moment or (nothing,) * 3
        return parameters._replace(moment=moment, rotor=nothing if parameters.rotor is None else parameters.rotor)

    @property
    def start(self) -> list[Pairs]:
        """The six components, (motions, 1) each."""
        width = self.numbers.high.shape[1]
        return [self.numbers[:, k : k + 1] for k in range(width - 6, width)]

    @property
    def classes(self) -> list[str]:
        """The class of each motion, by the further integrals that it has."""
        names = [[integral.name.rstrip("123") for integral in integrals] for integrals in self.integrals]
        return [next((_CLASSES[name] for name in reversed(own) if name in _CLASSES), GENERAL) for own in names]


def drawn(chunk: Chunk, precision: Precision, seed: int = 0) -> Drawn:
    """The motions of a chunk, bit for bit those of the sweep's cases; seed: of other roundings."""
    cases = chunk.sweep.cases()
    places = range(chunk.first, chunk.first + chunk.count)
    if isinstance(chunk.sweep, Random) and precision == DOUBLE and not seed:
        numbers = _rounded(numpy.array([chunk.sweep.integers(index) for index in places]))
        further = _may_have_more(numbers)
        integrals = [_integrals(cases[index]) if more else _ALWAYS for index, more in zip(places, further, strict=True)]
        return Drawn(Lazy(chunk.count, lambda index: _problem(numbers[index])), integrals, Pairs.of(numbers))
    cases_drawn = [cases[index] for index in places]
    if seed:
        cases_drawn = [replace(case, top=scaled(case.top, factor(seed))) for case in cases_drawn]
    problems = [Problem.of(case.top, case.start, precision, case.system) for case in cases_drawn]
    rows = [[*problem.system.entering(problem.parameters), *problem.start.flat] for problem in problems]
    # two doubles hold the numbers of formats of 106 bits at most
    return Drawn(problems, [*map(_integrals, cases_drawn)], Pairs.nearest(rows))


def _integrals(case: Case) -> tuple[Integral, ...]:
    return holding(case.top, case.start, case.system)


def _rounded(numbers: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
    """I, n and the start, (motions, 12), of the integers of :meth:`Random.integers`.

    All of them are below 2^53, so that each quotient is the exact number rounded once.
    """
    thousandths, weight, centre = numbers[:, :3] / 1000.0, numbers[:, 3:4], numbers[:, 4:7]
    moment = (weight * centre) / 1e6
    return numpy.hstack([thousandths, moment, numbers[:, 7:10] / 1000.0, numbers[:, 10:13] / numbers[:, 13:14]])


def _problem(numbers: NDArray[numpy.float64]) -> Problem:
    i1, i2, i3, n1, n2, n3, w1, w2, w3, g1, g2, g3 = map(Fraction, numbers.tolist())
    parameters = Parameters((i1, i2, i3), (n1, n2, n3), 0)
    return Problem(HEAVY_TOP, DOUBLE, parameters, State((w1, w2, w3), (g1, g2, g3)), None)


def _may_have_more(p: Any) -> Any:
    """Where two moments of inertia are equal or a component of the centre is 0; others have no further integral."""
    equal = (p[:, 0] == p[:, 1]) | (p[:, 1] == p[:, 2]) | (p[:, 0] == p[:, 2])
    return (equal | (p[:, 3:6] == 0).any(axis=1)).tolist()


_ALWAYS = holding(HeavyTop((4, 5, 6), 1, (1, 1, 1)), State((1, 0, 0), (0, 0, 1)))
"""The three integrals of every heavy top."""


DRIFTS = ("gamma_squared", "area", "energy", "further")
"""Integrals whose drift is a column; further: the largest drift of all others that the motion has."""
_TOLERANCES = Fraction(1, 2**96), Fraction(1, 2**84)
"""The tolerances of both runs in double; other orders and steps.  In extended: double-double's own, and the first."""
_MODERATE = 1e4
"""Motions with larger data or times are computed one by one."""
_STEP_LIMIT = 1_000_000
_FLOOR = 1e-28
_RADII = 10

Columns = dict[str, Any]


def measured(
    drawn: Drawn, integrator: Integrator, times: Sequence[Fraction], precision: Precision, options: dict[str, Any]
) -> Columns:
    """Each quantity over the motions.  Errors of Ω are in 1/time unit, drifts in units of the integral; NaN where a run
    or its reference did not reach the horizon.

    Raises Contradiction where the computed reference is off the proven one, PeerFailed where every run failed.
    """
    outcomes, states, steps = _runs(integrator, drawn, times, precision, options)
    truth, apart = _truth(drawn, times, precision)
    with numpy.errstate(all="ignore"):
        wrong = (outcomes == Outcome.SUCCESS.value) & ~numpy.isfinite(states.high).all(axis=(1, 2))
        outcomes[wrong] = Outcome.NON_FINITE.value
        errors = _errors(states, truth, times, precision)
        errors |= _drifts(drawn, states)
    _require_agreement(drawn.problems[0], times, truth, float(apart[0]))
    return {"outcome": outcomes.tolist(), "steps": steps} | errors | {"reference_radius": apart}


def _usual(drawn: Drawn, times: Sequence[Fraction], precision: Precision) -> bool:
    """Whether the motions can be computed as arrays: doubles, and data and times of moderate size."""
    if precision != DOUBLE or times[0] <= 0 or max(abs(drawn.numbers.high).max(), float(times[-1])) > _MODERATE:
        return False
    return bool(drawn.numbers.high[:, :3].min() > 1 / _MODERATE)


def _runs(
    integrator: Integrator, drawn: Drawn, times: Sequence[Fraction], precision: Precision, options: dict[str, Any]
) -> tuple[Any, Pairs, Any]:
    """Outcome, states and steps of each; one after the other where the integrator has no lanes."""
    count = len(drawn.problems)
    outcomes, steps = numpy.full(count, Outcome.SUCCESS.value, object), numpy.zeros(count, int)
    states, good = _pairs([()] * count, len(times)), numpy.zeros(count, bool)
    if integrator == described(HEYOKA) and _usual(drawn, times, precision):
        data = drawn.numbers.high[:, :-6], drawn.numbers.high[:, -6:]
        samples, steps, good = states_on_a_grid(drawn.system, *data, times, **options)
        states = Pairs(samples, numpy.zeros_like(samples))
    rest = numpy.flatnonzero(~good)
    problems = [drawn.problems[index] for index in rest.tolist()]
    if problems:
        runs = _one_by_one(integrator, problems, times, options)
        outcomes[rest] = [run[0] for run in runs]
        again = _pairs([run[1] for run in runs], len(times))
        states.high[rest], states.low[rest] = again.high, again.low
        steps[rest] = [run[2] for run in runs]
    return outcomes, states, steps


def _one_by_one(
    integrator: Integrator, problems: Sequence[Problem], times: Sequence[Fraction], options: dict[str, Any]
) -> list[tuple[str, Sequence[Any], int]]:
    """Outcome, states and steps of each, by the integrator's own ensembles where it has them."""
    if integrator.ensemble:
        many = integrator.propagate_many(problems, times, threads=1, **options)
        return [(run.outcome.value, run.states, run.steps) for run in many]
    runs: list[tuple[str, Sequence[Any], int]] = []
    failures = []
    for problem in problems:
        try:
            (run,) = integrator.propagate_many([problem], times, threads=1, **options)
        except PeerFailed as error:
            failures.append(error)
            runs.append((Outcome.FAILED.value, (), 0))
            continue
        short = run.outcome is Outcome.SUCCESS and len(run.states) < len(times)
        runs.append(((Outcome.INCOMPLETE if short else run.outcome).value, run.states, run.steps))
    if len(failures) == len(runs):
        raise failures[0]
    return runs


def _pairs(states: Sequence[Sequence[Any]], samples: int) -> Pairs:
    """(motions, samples, 6) of native states, exact in two doubles; NaN where absent."""
    high, low = (numpy.full((len(states), samples, 6), math.nan) for _ in range(2))
    for index, run in enumerate(states):
        if not len(run):
            continue
        rows = numpy.asarray(run)[:samples, :6]
        if rows.dtype == numpy.float64:
            high[index, : len(rows)], low[index, : len(rows)] = rows, 0.0
            continue
        first = rows.astype(float)
        high[index, : len(rows)], low[index, : len(rows)] = first, (rows - first).astype(float)
    return Pairs(high, low)


def _truth(drawn: Drawn, times: Sequence[Fraction], precision: Precision) -> tuple[Pairs, Any]:
    """The reference, and the largest distance of the second run from it, absolute, a rounding of the format added, for
    short motions often agree in every bit.
    """
    first, second = _references(drawn, times, precision)
    with numpy.errstate(all="ignore"):
        apart = numpy.abs((first - second).high).max(axis=(1, 2))
        size = numpy.abs(first.high).max(axis=(1, 2))
        return first, apart + float(DOUBLE_DOUBLE.eps) * numpy.maximum(1.0, size)


def _references(drawn: Drawn, times: Sequence[Fraction], precision: Precision) -> list[Pairs]:
    """Two runs of all motions in double-double, of different tolerances."""
    tolerances = _TOLERANCES if precision == DOUBLE else (None, _TOLERANCES[0])
    if drawn.system is HEAVY_TOP and _usual(drawn, times, precision):
        parameters, starts = drawn.numbers.high[:, :6], drawn.numbers.high[:, 6:]
        runs = double_double_states(parameters, starts, times, _TOLERANCES, _STEP_LIMIT)
    else:
        count = len(drawn.problems)
        runs = [(_pairs([()] * count, len(times)), numpy.zeros(count, bool)) for _ in tolerances]
    targets = [number(time, DOUBLE_DOUBLE) for time in times]
    for tolerance, (states, good) in zip(tolerances, runs, strict=True):
        rest = numpy.flatnonzero(~good)
        problems = [replace(drawn.problems[index], precision=DOUBLE_DOUBLE) for index in rest.tolist()]
        if problems:
            settings: dict[str, Any] = {"threads": 1, "step_limit": _STEP_LIMIT, "tolerance": tolerance}
            again = propagate_multiword_ensemble(problems, targets, **settings)
            pairs = _pairs([run.states for run in again], len(times))
            states.high[rest], states.low[rest] = pairs.high, pairs.low
    return [states for states, _ in runs]


def _errors(states: Pairs, truth: Pairs, times: Sequence[Fraction], precision: Precision) -> Columns:
    """As :class:`heavytop.measure.scorer.SolutionError` has them, the largest over the samples."""
    delta = numpy.abs((states - truth).high)
    relative = (delta / numpy.maximum(1.0, numpy.abs(truth.high))).max(axis=2)
    largest = relative.max(axis=1)
    finite = numpy.isfinite(largest)
    where = numpy.where(finite[:, None], relative, 0.0).argmax(axis=1)
    most = precision.bits * math.log10(2)
    digits = numpy.minimum(most, -numpy.log10(largest))
    scale = float(precision.eps) * float(abs(times[-1])) ** 1.5
    return {
        "error_max": largest,
        "error_time": numpy.where(finite, numpy.array([float(t) for t in times])[where], math.nan),
        "error_omega": delta[:, :, :3].max(axis=(1, 2)),
        "error_gamma": delta[:, :, 3:].max(axis=(1, 2)),
        "error_scaled": largest / scale,
        "digits_right": digits,
    }


def _drifts(drawn: Drawn, states: Pairs) -> Columns:
    """The largest |I(t) - I(0)| over the samples, of each integral from the rounded start."""
    groups: dict[Any, list[int]] = defaultdict(list)
    for index, integrals in enumerate(drawn.integrals):
        groups[tuple((i.name, getattr(i.value, "keywords", {}).get("axes")) for i in integrals)].append(index)
    drifts = {f"drift_{name}": numpy.full(len(drawn.problems), math.nan) for name in DRIFTS}
    parameters, start = drawn.parameters, drawn.start
    for places in groups.values():
        own = parameters.mapped(lambda column, places=places: column[places])  # type: ignore[misc]
        now = [states[places, :, k] for k in range(6)]
        before = [column[places] for column in start]
        for integral in drawn.integrals[places[0]]:
            change = integral.value(own, now) - integral.value(own, before)
            size = numpy.abs(change.high).max(axis=1)
            name = f"drift_{integral.name}"
            if name in drifts:
                drifts[name][places] = size
            else:
                drifts["drift_further"][places] = numpy.fmax(drifts["drift_further"][places], size)
    return drifts


def _require_agreement(problem: Problem, times: Sequence[Fraction], truth: Pairs, apart: float) -> None:
    """Raises Contradiction where the first motion's reference is off its closed form or enclosure."""
    if not math.isfinite(apart):
        return
    known = known_motion(problem, times[-1])
    if not isinstance(known, Known):
        return
    for index, time in enumerate(times):
        if not known.truth.covers(time):
            continue
        balls = known.truth.state(time, DOUBLE_DOUBLE.bits)
        for k, ball in enumerate(balls):
            computed = Fraction(float(truth.high[0, index, k])) + Fraction(float(truth.low[0, index, k]))
            middle = exact(midpoint(ball))
            off = abs(computed - middle) - exact(radius(ball))
            if off > _RADII * Fraction(apart) + Fraction(_FLOOR) * (1 + abs(middle)):
                raise Contradiction(
                    f"The computed reference at t = {float(time):.6g} is {float(off):.3g} off the proven one, and its "
                    f"radius is {apart:.3g}."
                )
