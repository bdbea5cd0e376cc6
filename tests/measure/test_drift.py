"""Drift and distance: evaluated with guard bits, never a number where there is none."""

from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from functools import partial
from operator import add, mul, sub, truediv
from random import Random

import numpy
import pytest
from flint import arb

from heavytop import DOUBLE, DOUBLE_DOUBLE, EXTENDED, QUAD, HeavyTop, InputError, State, holding, real
from heavytop.cases import CASES, case
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Problem
from heavytop.measure import scorer as scoring
from heavytop.measure.bounded_doubles import BoundedDoubles
from heavytop.measure.scalar import to_ball, to_balls
from heavytop.measure.scorer import Drift, Scorer, SolutionError
from heavytop.measure.truth import Truth, closed_form
from heavytop.multiword.pairs import Pairs
from heavytop.precision import exact, number
from heavytop.records import Against
from heavytop.top.equations import SYSTEMS, Parameters, kovalevskaya_yehia
from heavytop.top.equations import sretensky as sretensky_integral
from support.helpers import in_units

TOP = HeavyTop((3, 3, "3/2"), 2, ("1/3", "3/4", 0))
START = State(("1/10", "1/5", "9/10"), ("3/5", 0, "4/5"))
PROBLEM = Problem.of(TOP, START, DOUBLE)
START_DOUBLES = tuple(map(float, START.flat))


def test_the_rms_lies_between_final_and_maximum_and_the_series_holds_the_kept_times() -> None:
    keep = [Fraction(10), Fraction(100)]
    drift = Drift(PROBLEM, holding(TOP, START), keep)
    propagate(TOP, START, range(1, 101), DOUBLE, observer=drift)
    for name in ("gamma_squared", "area", "energy", "kovalevskaya"):
        values = {part: exact(drift.metrics()[f"drift_{name}_{part}"].value) for part in ("max", "rms", "final")}
        assert 0 < values["rms"] <= values["max"] < Fraction(1, 10**13)
        assert values["final"] <= values["max"]
        series = drift.series(str)[f"drift_{name}"]
        assert series.times == ["10", "100"]
        assert exact(series.values[-1]) == values["final"]


def test_without_a_sample_the_metrics_are_missing() -> None:
    drift = Drift(PROBLEM, holding(TOP, START))
    assert {m.value for m in drift.metrics().values()} == {"missing"}
    assert {m.log10 for m in drift.metrics().values()} == {None}


@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, QUAD, real(200)], ids=lambda p: p.name)
@pytest.mark.parametrize("moment", ["3/20", "1/3", "2"])
def test_a_state_that_does_not_move_has_no_drift_that_is_not_a_number(precision, moment: str) -> None:
    """Where an integral is rounded its drift is a ball around 0: unresolved, with a bound, and never NaN."""
    body, start = HeavyTop((moment,) * 3, 0, (0, 0, 0)), State(("1/3", "1/7", "23/10"), ("3/5", 0, "4/5"))
    problem = Problem.of(body, start, precision)
    drift = Drift(problem, holding(body, start))
    for time in range(1, 4):
        drift(Fraction(time), problem.start.flat)
    for found in drift.metrics().values():
        assert found.value in ("0", "unresolved")
        assert found.value == "0" or exact(found.bound) < Fraction(1, 2**50) * precision.eps


def test_a_nan_is_never_a_number() -> None:
    drift = Drift(PROBLEM, holding(TOP, START))
    drift(Fraction(1), numpy.array([float("nan")] * 6))
    drift(Fraction(2), numpy.array([float(v) for v in START.flat]))
    assert drift.metrics()["drift_energy_max"].value == "nan"
    assert drift.metrics()["drift_energy_rms"].value == "nan"


def near_the_start(problem: Problem, count: int, random: Random) -> numpy.ndarray:
    """States that a few roundings have moved, in the numbers of the format."""
    start, rows = problem.start, []
    units = [problem.precision.eps * max(map(abs, part)) for part in (start.omega, start.gamma) for _ in range(3)]
    for _ in range(count):
        moved = [value + unit * random.randint(-8, 8) for value, unit in zip(start.flat, units, strict=True)]
        rows.append([number(value, problem.precision) for value in moved])
    return numpy.array(rows)


def balls_counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    counted: list[int] = []
    monkeypatch.setattr(scoring, "to_balls", lambda state: counted.append(1) or to_balls(state))
    return counted


@pytest.mark.parametrize(
    ("precision", "scale"),
    [(p, Fraction(10) ** k) for p in (DOUBLE, EXTENDED) for k in (0, 4, -4, 15, -15)]
    + [(QUAD, Fraction(1)), (real(237), Fraction(1))],
    ids=str,
)
def test_many_states_at_once_have_the_drift_of_exact_fractions(monkeypatch, precision, scale: Fraction) -> None:
    """All digits of all numbers, and by arrays of doubles and extended: in units of time from 1e-15 to 1e15."""
    random = Random(f"{precision} {scale}")
    problem = Problem.of(*in_units(TOP, START, scale), precision)
    rows = near_the_start(problem, 300, random)
    counted, drift = balls_counted(monkeypatch), Drift(problem, problem.integrals())
    drift.add_states(rows)
    metrics = drift.metrics()
    assert precision not in (DOUBLE, EXTENDED) or len(counted) < 30
    start, exact_rows = problem.start.flat, [[exact(value) for value in row] for row in rows]
    for integral in problem.integrals():
        first = integral.value(problem.parameters, start)
        offs = [abs(integral.value(problem.parameters, row) - first) for row in exact_rows]
        expected = {"max": max(offs) ** 2, "rms": sum(off**2 for off in offs) / 300, "final": offs[-1] ** 2}
        for part, square in expected.items():
            text = Decimal(metrics[f"drift_{integral.name}_{part}"].value)
            half = Fraction(Decimal((0, (5,), text.adjusted() - 8))) + abs(first) / 2 ** (problem.precision.bits + 59)
            assert (Fraction(text) - half) ** 2 <= square <= (Fraction(text) + half) ** 2


@pytest.mark.parametrize("exponent", [-100, -80, -36, -21, -19, 19, 20, 36, 100])
def test_at_odd_scales_numbers_are_those_of_balls(monkeypatch, exponent: int) -> None:
    """Where words overflow or underflow, just beyond and far, balls are evaluated of each state."""
    problem = Problem.of(*in_units(TOP, START, Fraction(10) ** exponent), DOUBLE)
    rows = near_the_start(problem, 160, Random(exponent))
    one_by_one = Drift(problem, problem.integrals())
    one_by_one.one_by_one()
    for row in rows:
        one_by_one(Fraction(1), row)
    expected = one_by_one.metrics()
    drift, counted = Drift(problem, problem.integrals()), balls_counted(monkeypatch)
    drift.add_states(rows)
    assert drift.metrics() == expected
    assert (len(counted) == 160) == (not -20 < exponent < 20)


@pytest.mark.parametrize("size", [1e153, 1.2e154, 1.3e154, 1e155, 1e300])
def test_squares_whose_sum_is_beyond_a_double_are_added_as_balls(size: float) -> None:
    lagrange = case("lagrange")
    problem = Problem.of(lagrange.top, lagrange.start, DOUBLE)
    known = closed_form(problem)
    at_once, one_by_one = Scorer(problem, true(known)), Scorer(problem, true(known))
    one_by_one.one_by_one()
    state = numpy.array([size, *map(float, problem.start.flat[1:])])
    for index in range(1, 31):
        for scorer in (at_once, one_by_one):
            scorer(Fraction(index, 30), state)
    assert at_once.metrics() == one_by_one.metrics()


class Depth:
    """How many operations a term of an expression goes through at most: those of both factors, of one summand."""

    def __init__(self, count: int = 0) -> None:
        self.count = count

    def __add__(self, other: object) -> "Depth":
        return Depth(1 + max(self.count, getattr(other, "count", 0)))

    def __mul__(self, other: object) -> "Depth":
        return Depth(1 + self.count + getattr(other, "count", 0))

    __sub__ = __add__
    __truediv__ = __mul__


def test_no_term_of_an_integral_goes_through_more_than_sixteen_operations() -> None:
    seen = set()
    for body in CASES.values():
        for system in SYSTEMS:
            with suppress(InputError):
                parameters = system.parameters(body.top, body.start).mapped(lambda _: Depth())
                for integral in holding(body.top, body.start, system):
                    seen.add(integral.name.rstrip("123"))
                    assert integral.value(parameters, [Depth()] * 6).count <= 16
    yehia, sretensky = (partial(value, axes=(0, 1, 2)) for value in (kovalevskaya_yehia, sretensky_integral))
    parameters = Parameters((Depth(),) * 3, (Depth(),) * 3, (Depth(),) * 3)
    assert max(value(parameters, [Depth()] * 6).count for value in (yehia, sretensky)) <= 16
    assert {"energy", "kovalevskaya", "goryachev_chaplygin", "hess", "gyrostat_energy", "spin"} <= seen


@pytest.mark.parametrize("operation", [add, sub, mul, truediv], ids=lambda operation: operation.__name__)
def test_an_operation_on_double_doubles_is_off_by_sixteen_squares_of_a_rounding(operation) -> None:
    """Of the sum of its absolute terms, so that cancellation counts for nothing; exact fractions at random."""
    random = Random(operation.__name__)
    numbers = [
        [Fraction(random.randint(-(2**120), 2**120), 2 ** random.choice((118, 119, 121, 170))) for _ in range(3000)]
        for _ in range(2)
    ]
    pairs = [Pairs.nearest(values) for values in numbers]
    exacts = [list(map(add, map(Fraction, pair.high.tolist()), map(Fraction, pair.low.tolist()))) for pair in pairs]
    result = operation(*pairs)
    for high, low, one, other in zip(result.high.tolist(), result.low.tolist(), *exacts, strict=True):
        scale = abs(one) + abs(other) if operation in (add, sub) else abs(operation(one, other))
        assert abs(Fraction(high) + Fraction(low) - operation(one, other)) <= 16 * scale / 2**106


def test_a_drift_that_doubles_do_not_resolve_is_evaluated_in_balls(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a state that comes back to the start, and of one whose component is not finite."""
    rows = numpy.array([[float(value) for value in PROBLEM.start.flat]] * 160)
    same, broken = Drift(PROBLEM, PROBLEM.integrals()), Drift(PROBLEM, PROBLEM.integrals())
    same.add_states(rows)
    assert {metric.value for metric in same.metrics().values()} <= {"0", "unresolved"}
    rows[7, 2] = numpy.nan
    broken.add_states(rows)
    assert broken.metrics()["drift_energy_rms"].value == "nan"
    assert broken.metrics()["drift_energy_final"].value in ("0", "unresolved")


def test_states_that_wait_are_counted_before_anything_is_told() -> None:
    """Also where arrays and lists take turns, and more come than wait."""
    rows = near_the_start(PROBLEM, 2100, Random(1))
    drift, one_by_one = Drift(PROBLEM, PROBLEM.integrals()), Drift(PROBLEM, PROBLEM.integrals())
    one_by_one.one_by_one()
    for index, row in enumerate(rows):
        drift(Fraction(index), row.tolist() if index in (3, 1500) else row)
        one_by_one(Fraction(index), row)
        if index in (0, 100, 1030):
            assert {running.count for running in drift.quantities().values()} == {index + 1}
    assert drift.metrics() == one_by_one.metrics()
    assert drift.running["energy"].count == 2100


def true(known: DeloneHomoclinic) -> Truth:
    return Truth(Against("proven", known.method), known.state)


def test_solution_error_of_a_run_started_on_a_known_motion() -> None:
    known = DeloneHomoclinic(Fraction(5, 4), Fraction(3))
    for precision in (DOUBLE, QUAD, real(237)):
        problem = Problem.of(known.top, known.start, precision)
        error = SolutionError(problem, true(known), threshold=Fraction(1, 1000))
        propagate(known.top, known.start, [1, 2, 3, 4], precision, observer=error)
        values = {k: exact(m.value) for k, m in error.metrics().items()}
        assert 0 < values["solution_error_omega_max"] < 2000 * precision.eps
        assert error.escape is None


def test_a_perturbed_start_is_charged_to_the_solution_error_with_its_size() -> None:
    known = DeloneHomoclinic(Fraction(1), Fraction(2))
    off = Fraction(1, 2**30)
    moved = State((known.start.omega[0] + off, *known.start.omega[1:]), known.start.gamma)
    error = SolutionError(Problem.of(known.top, known.start, QUAD), true(known))
    propagate(known.top, moved, ["1/1000"], QUAD, observer=error)
    assert exact(error.metrics()["solution_error_omega_max"].value) == pytest.approx(off, rel=1e-2)


@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, DOUBLE_DOUBLE, QUAD, real(300)], ids=lambda p: p.name)
def test_native_numbers_become_exact_balls(precision) -> None:
    """At the ends of the range of doubles too, and beyond."""
    with working_precision(400):
        for exponent in (0, 100, 305, -100, -290, -305) + (() if precision is DOUBLE else (320, -320, -330, -4000)):
            native = number(Fraction(-10, 7) * Fraction(10) ** exponent, precision)
            assert to_ball(native).is_exact()
            assert to_ball(native) == ball(exact(native))
        assert not to_ball(number(Fraction(1), precision) * float("inf")).is_finite()


@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, QUAD], ids=lambda p: p.name)
@pytest.mark.parametrize("name", ["euler", "lagrange", "gyrostat"])
def test_samples_at_once_and_one_by_one_give_the_same_text(monkeypatch, name: str, precision) -> None:
    known = case(name)
    problem = Problem.of(known.top, known.start, precision, known.system)
    truth = Truth(Against("proven"), closed_form(problem).state)
    times = [Fraction(time) for time in range(1, 81)]
    options = {"threshold": 40 * precision.eps, "until": 60.0}
    scorers = [Scorer(problem, truth, times[9::20], **options) for _ in range(3)]
    for scorer in scorers:
        propagate(known.top, known.start, times, precision, system=known.system, observer=scorer)
    one, two, three = scorers
    two.one_by_one()
    counted = evaluations_counted(monkeypatch)
    assert one.metrics() == two.metrics()
    assert 0 < len(counted) < 40
    assert one.series(str) == two.series(str)
    assert one.error.escape == two.error.escape
    assert three.content() == two.content()
    for scorer in scorers:
        scorer(Fraction(81), problem.start.flat)
    assert one.metrics() == two.metrics() == three.metrics()
    assert three.content() == two.content()


def evaluations_counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Errors of single states that are evaluated as balls."""
    counted, values = [], SolutionError.values
    monkeypatch.setattr(SolutionError, "values", lambda *args: counted.append(1) or values(*args))
    return counted


def test_a_state_that_is_not_finite_and_a_digit_that_stays_open_are_taken_one_by_one(monkeypatch) -> None:
    for value in (float("nan"), 0.5):
        wide = Truth(
            Against("computed"), lambda time, bits: [to_ball(x).union(to_ball(x + 0.001)) for x in START_DOUBLES]
        )
        scorer, counted = Scorer(PROBLEM, wide), evaluations_counted(monkeypatch)
        for time in range(1, 41):
            scorer(Fraction(time), numpy.array([*START_DOUBLES[:5], value]))
        assert (scorer.metrics()["drift_energy_max"].value == "nan") == (value != value)
        assert len(counted) == 40


def test_bounds_of_rough_numbers_hold_the_exact_ones() -> None:
    generator = numpy.random.default_rng(5)
    mantissas, exponents = generator.uniform(-1, 1, (2, 300)), generator.integers(-40, 3, (2, 300))
    radii = generator.uniform(0, 1, (2, 300)) * 2.0 ** (exponents - generator.integers(5, 60, (2, 300)))
    middles = mantissas * 2.0**exponents
    middles[1, ::3] = middles[0, ::3] * (1 + 2.0**-45)
    ends = generator.choice([-1, 1], (2, 300))
    with working_precision(300):
        balls = [
            [arb(float(m), float(r)) for m, r in zip(*row, strict=True)] for row in zip(middles.T, radii.T, strict=True)
        ]
    rough = BoundedDoubles.of(balls)
    true = [
        [Fraction(m) + int(e) * Fraction(r) for m, e, r in zip(*row, strict=True)]
        for row in zip(middles, ends, radii, strict=True)
    ]
    for rule in (add, sub, mul, truediv, lambda a, b: (a - b) * (a + b)):
        with numpy.errstate(all="ignore"):
            found = rule(rough[0], rough[1])
        assert numpy.isfinite(found.error).mean() > 0.9
        for value, error, a, b in zip(found.value, found.error, *true, strict=True):
            assert error == float("inf") or abs(Fraction(value) - rule(a, b)) <= Fraction(error)
    narrow = BoundedDoubles.of([[to_ball(3.0), to_ball(7.0)]])
    assert float((narrow[0] / narrow[1]).error[0]) < 2.0**-51
    assert BoundedDoubles.of([[to_ball(0.0)]])[0].squared().error[0] == 0
