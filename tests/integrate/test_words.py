"""multiword behind heyoka's call, and what both keep: proven accuracy, the same bits however cut, outcomes."""

import json
import math
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from random import Random

import pytest

from heavytop.errors import Contradiction, InputError
from heavytop.exact.cases.gyrostat import Gyrostat
from heavytop.exact.catalogue import find
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.multiword import engines
from heavytop.integrate.multiword import motions as words_module
from heavytop.integrate.multiword.lanes import propagate_multiword_ensemble
from heavytop.integrate.multiword.motions import propagate_multiword, sums_of_two
from heavytop.integrate.trajectory import Outcome, Problem, ResumePoint, Trajectory
from heavytop.multiword.codegen import recurrence
from heavytop.multiword.double_double import double_double_run, steps
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, EXTENDED, QUAD, Precision, dot, exact, number, real
from heavytop.top.attitude import perpendicular
from heavytop.top.equations import GYROSTAT, HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State
from support.helpers import PAPER, VECTORS, bits, distance, in_units, start_of, top_of

TOP = HeavyTop((3, 3, "3/2"), 2, ("1/3", "3/4", 0))
START = State(("1/10", "1/5", "9/10"), ("3/5", 0, "4/5"))
GENERIC = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
EULER = HeavyTop((3, 2, 1), 0, (0, 0, 0))
LAGRANGE = HeavyTop((1, 1, "1/2"), 1, (0, 0, 1))
FORMATS = [DOUBLE, EXTENDED, DOUBLE_DOUBLE, QUAD, real(237)]
EVERY_FORMAT = [
    pytest.param(run, precision, id=f"{name}-{precision.name}")
    for name, run, formats in (
        ("heyoka", propagate, (DOUBLE, EXTENDED, QUAD, real(100))),
        ("multiword", propagate_multiword, FORMATS),
    )
    for precision in formats
]


def truth(problem: Problem) -> Callable[[Fraction, int], list]:
    """The states of the proven motion from the rounded data."""
    if problem.xi:
        return Validated(problem.top, problem.start, problem.system, xi=problem.xi).with_attitude
    if problem.system is GYROSTAT:
        return Gyrostat(problem.top, problem.start, problem.parameters.rotor).state
    return find(problem.top, problem.start, problem.system).state


def worst(run: Trajectory) -> Fraction:
    """The largest |error| / max(1, |value|) over all samples, in eps of the format; the truth is proven."""
    proven, precision = truth(run.problem), run.problem.precision
    found = Fraction(0)
    for time, state in zip(run.times, bits(run), strict=True):
        for ball, value in zip(proven(time, precision.bits + 24), state, strict=True):
            centre = midpoint(ball)
            found = max(found, abs(value - centre) / max(1, abs(centre)) / precision.eps)
    return found


@pytest.mark.parametrize("precision", FORMATS, ids=lambda precision: precision.name)
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("attitude", [False, True])
def test_a_pendulum_about_the_unstable_axis_stays_in_its_plane(axis: int, attitude: bool, precision: Precision) -> None:
    """Rounding errors out of the plane would grow by 1e16 until t = 20."""
    inertia, centre, omega, gamma = (
        vector[-axis:] + vector[:-axis]
        for vector in ([2, 1, 3], [0, Fraction(1, 3), Fraction(1, 5)], [-8, 0, 0], [0, Fraction(3, 5), Fraction(4, 5)])
    )
    top, start = HeavyTop(inertia, 1, centre), State(omega, gamma)
    xi = perpendicular(start.gamma) if attitude else None
    run = propagate_multiword(top, start, [Fraction(20)], precision, xi=xi)
    moving = [axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3]
    known = find(run.problem.top, run.problem.start).state(Fraction(20), precision.bits + 24)
    errors = [abs(value - midpoint(ball)) for value, ball in zip(bits(run)[0][:6], known, strict=True)]
    assert max(errors[k] for k in moving) <= 2000 * precision.eps
    assert max(errors[k] for k in range(6) if k not in moving) <= precision.eps * Fraction(1, 2**20)


@pytest.mark.slow
@pytest.mark.parametrize(("integrate", "precision"), EVERY_FORMAT)
@pytest.mark.parametrize("given", VECTORS, ids=lambda given: given["name"])
def test_every_reference_state_is_met_in_every_format(given, integrate, precision: Precision) -> None:
    limits = {"double": "1e-14", "extended": "1e-17", "double-double": "1e-29", "quad": "1e-31"}
    limits |= {"real:100": "1e-27", "real:237": "1e-58"}
    run = integrate(top_of(given), start_of(given), [given["time"]], precision)
    assert run.outcome is Outcome.SUCCESS
    off = max(abs(a - Fraction(b)) for a, b in zip(bits(run)[0], given["state"], strict=True))
    assert off <= Fraction(limits[precision.name])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("precision", "horizon", "limit"),
    [(DOUBLE, 2000, 1), (EXTENDED, 1000, 1), (DOUBLE_DOUBLE, 20, 400), (QUAD, 500, 1), (real(500), 10, 1)],
    ids=lambda value: getattr(value, "name", value),
)
@pytest.mark.parametrize(
    ("top", "start", "system"),
    [
        (EULER, START, HEAVY_TOP),
        (LAGRANGE, START, HEAVY_TOP),
        (LAGRANGE, State((1, 2, 10), ("3/5", 0, "4/5")), HEAVY_TOP),
        (*PAPER, GYROSTAT),
    ],
    ids=["euler", "lagrange", "fast lagrange", "gyrostat"],
)
def test_what_is_returned_is_the_true_motion_rounded(precision, horizon, limit, top, start, system) -> None:
    """Within an eps of the proven motion from the same rounded data; double-double has no bits to spare."""
    times = [Fraction(horizon * i, 5) for i in range(1, 6)]
    run = propagate_multiword(top, start, times, precision, system=system)
    assert worst(run) <= limit


@pytest.mark.slow
@pytest.mark.parametrize(("top", "horizon"), [(TOP, 8), (GENERIC, 8)], ids=["kovalevskaya", "generic"])
@pytest.mark.parametrize("sign", [1, -1], ids=["forwards", "backwards"])
def test_motions_without_a_closed_form_lie_in_their_enclosure(top: HeavyTop, horizon: int, sign: int) -> None:
    times = [sign * Fraction(horizon * i, 3) for i in range(1, 4)]
    for precision, limit in ((DOUBLE, 1), (EXTENDED, 1), (DOUBLE_DOUBLE, 40), (QUAD, 1), (real(237), 1)):
        assert worst(propagate_multiword(top, START, times, precision)) <= limit


@pytest.mark.slow
@pytest.mark.parametrize(("integrate", "precision"), EVERY_FORMAT)
def test_samples_and_chunks_change_no_bit(integrate, precision, monkeypatch: pytest.MonkeyPatch) -> None:
    few = integrate(TOP, START, [5, 10], precision)
    many = integrate(TOP, START, [Fraction(i, 8) for i in range(1, 81)], precision)
    assert bits(many)[39] == bits(few)[0]
    assert bits(many)[-1] == bits(few)[1]
    assert many.steps == few.steps
    monkeypatch.setattr(words_module, "_FIRST_CHUNK", 1)
    monkeypatch.setattr(words_module, "CHUNK_SECONDS", 0.0)
    assert bits(integrate(TOP, START, [5, 10], precision)) == bits(few)


@pytest.mark.slow
@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT], ids=lambda system: system.name)
def test_the_attitude_rides_along_and_stays_orthonormal(system) -> None:
    top, start = (TOP, START) if system is HEAVY_TOP else PAPER
    xi = perpendicular(start.gamma)
    run = propagate_multiword(top, start, [3], DOUBLE_DOUBLE, xi=xi, system=system)
    values = bits(run)[0]
    assert abs(dot(values[6:9], values[6:9]) - 1) < Fraction(1, 10**29)
    assert abs(dot(values[6:9], values[3:6])) < Fraction(1, 10**29)
    assert distance(run, propagate(top, start, [3], QUAD, xi=xi, system=system)) < Fraction(1, 10**28)


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "exponent"), [*zip(FORMATS, (60, -30, 60, -30, 6), strict=True)])
def test_units_of_time_and_weight_change_nothing_but_the_units(precision, exponent: int) -> None:
    """The same motion with Ω in other units: the same error relative to Ω, a step less or more at the end."""
    unit = Fraction(10) ** exponent
    run = propagate_multiword(*in_units(GENERIC, START, unit), [5 / unit], precision)
    same = Problem.of(HeavyTop(run.problem.top.inertia, 1, run.problem.top.moment), run.problem.start, real(300))
    wide = propagate(same.top, same.start, run.times, real(300))
    for low, size in ((0, unit), (3, 1)):
        off = max(abs(a - exact(b)) for a, b in zip(bits(run)[0][low : low + 3], wide.states[0][low:], strict=False))
        assert off <= 60 * size * precision.eps


@pytest.mark.slow
@pytest.mark.parametrize(("integrate", "precision"), EVERY_FORMAT)
@pytest.mark.parametrize(
    ("top", "start"),
    [
        (HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, 0, 3), (0, 0, 1))),
        (HeavyTop((3, 2, 1), 1, (0, 0, 1)), State((0, 0, 0), (0, 0, -1))),
        (HeavyTop((3, 2, 1), 1, (0, "1/3", 0)), State((0, "14/9", 0), (0, 1, 0))),
    ],
    ids=["sleeping", "hanging", "permanent rotation"],
)
def test_an_equilibrium_stays_where_it_is(integrate, precision, top: HeavyTop, start: State) -> None:
    run = integrate(top, start, [1, 2000], precision)
    assert run.outcome is Outcome.SUCCESS
    assert bits(run) == [[exact(number(v, precision)) for v in start.flat]] * 2
    assert run.steps == 0
    assert bits(integrate(top, start, [-5], precision)) == bits(run)[:1]


def test_what_is_too_large_for_the_format_is_an_outcome_and_what_is_too_small_is_zero() -> None:
    state = words_module.native_state((Fraction(1), Fraction(10) ** 400), DOUBLE)
    assert state is None
    assert list(words_module.native_state((Fraction(1), Fraction(1, 10**400)), DOUBLE)) == [1, 0]


def test_a_derivative_that_no_double_holds_is_an_outcome() -> None:
    """Moments so far apart that the second derivative overflows in every unit of time."""
    top = HeavyTop((Fraction(1, 10**150), Fraction(10**150), Fraction(2 * 10**150)), 0, (0, 0, 0))
    run = propagate_multiword(top, State((1, 1, 1), (0, 0, 1)), [1], DOUBLE, step_limit=100)
    assert run.outcome in (Outcome.NON_FINITE, Outcome.STEP_TOO_SMALL)
    assert len(run.states) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrate", "precision", "case"),
    [
        pytest.param(*form.values, case, id=f"{form.id}-{case}")
        for case in ("forward", "backward", "attitude", "resting")
        for form in EVERY_FORMAT[:: 1 if case == "forward" else 3]
    ],
)
def test_a_run_taken_up_at_any_sample_goes_on_to_the_same_bits(integrate, precision, case: str) -> None:
    """Samples lie closer than steps and farther apart; -0 and rest are kept."""
    top, start, sign, options = TOP, START, 1, {}
    if case == "backward":
        sign = -1
    elif case == "attitude":
        options = {"xi": perpendicular(START.gamma)}
    elif case == "resting":
        top, start = HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, 0, 3), (0, 0, 1))
    times = [sign * Fraction(t) for t in ("1/64", "1/32", "1", "3", "193/64", "4")]

    def run(place: ResumePoint | None = None):
        states, places = [], []
        found = integrate(
            top, start, times, precision, place=place, mark=lambda at: places.append(at.content(precision)),
            observer=lambda time, state: states.append((time, [str(v) for v in state])), **options,
        )  # fmt: skip
        for each in places:
            each["seconds"] = 0.0
        return (found.outcome, found.steps, found.time_reached), states, places

    summary, states, places = run()
    assert len(places) == len(times)
    for index, content in enumerate(places):
        again, rest, later = run(ResumePoint.of(json.loads(json.dumps(content)), precision))
        assert again == summary
        assert rest == states[index + 1 :]
        assert later == places[index + 1 :]


def test_a_run_cannot_go_on_with_other_flags() -> None:
    places: list[ResumePoint] = []
    propagate_multiword(TOP, START, [1, 2], DOUBLE, mark=places.append)
    with pytest.raises(InputError, match="tolerance"):
        propagate_multiword(TOP, START, [1, 2], DOUBLE, tolerance=Fraction(1, 10**9), place=places[0])


def test_the_error_falls_with_the_tolerance_backwards_too() -> None:
    rounded = propagate_multiword(TOP, START, [-20], DOUBLE_DOUBLE).problem
    known = propagate(rounded.top, rounded.start, [-20], real(160)).states[0]
    last = Fraction(1)
    for exponent in range(6, 31, 4):
        tolerance = Fraction(1, 10**exponent)
        run = propagate_multiword(TOP, START, [-20], DOUBLE_DOUBLE, tolerance=tolerance)
        error = max(abs(a - exact(b)) for a, b in zip(bits(run)[0], known, strict=True))
        assert error < 200 * tolerance
        # 106 bits end at about 2^-100 here
        assert error < max(last / 50, Fraction(1, 2**100))
        last = error


@pytest.mark.parametrize("tolerance", [0, -1, 1, Fraction(1, 10**5), Fraction(1, 10**40)])
def test_a_tolerance_it_cannot_do_is_refused(tolerance) -> None:
    with pytest.raises(InputError, match="tolerance"):
        propagate_multiword(TOP, START, [1], DOUBLE, tolerance=Fraction(tolerance))


@pytest.mark.slow
def test_wrong_machine_code_is_caught_by_the_step_that_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong sign in one lane, in one of the two recurrences or in both."""
    monkeypatch.setattr(double_double_run, "machine", lru_cache(steps.build))  # not from the disk
    monkeypatch.setattr(engines._double_double, "results", {})
    damaged = [list(part) for part in recurrence.GATHERED]
    damaged[2][4] = (6, -1)
    monkeypatch.setattr(recurrence, "GATHERED", tuple(map(tuple, damaged)))
    with pytest.raises(Contradiction):
        propagate_multiword(TOP, START, [1], DOUBLE)


def test_everything_that_changes_bits_is_in_the_flags() -> None:
    flags = propagate_multiword(TOP, START, [1], DOUBLE).flags
    assert {"arithmetic", "words", "bits", "order", "tolerance", "step_rule"} <= set(flags)


_TINY = Fraction(1, 2**90)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("weight", "arm", "gamma", "precision"),
    [
        pytest.param(weight, arm, gamma, precision, id=f"{name}-{precision.name}")
        for name, weight, arm, gamma, other in (
            ("an arm beside the axis", 1, (0, 1, _TINY), (0, 1, 0), EXTENDED),
            ("two, hanging", 1, (_TINY, "1/2", -_TINY), (0, -1, 0), DOUBLE_DOUBLE),
            ("of two sizes", 1, (_TINY**2, "1/2", _TINY), (0, 1, 0), real(237)),
            ("a weight", _TINY, ("1/2", "1/4", "1/8"), ("3/4", 0, "-1/2"), QUAD),
        )
        for precision in (DOUBLE, other)
    ],
)
def test_what_a_tiny_coefficient_makes_of_nothing_is_computed_as_finely_as_it_needs(
    weight: object, arm: tuple[object, ...], gamma: tuple[object, ...], precision: Precision
) -> None:
    """Spin about the middle axis, and nothing about the others at the start; against the enclosure.

    Under every naming of the axes in the format of the fewest bits, under one in the others.
    """
    for turned in range(3) if precision is DOUBLE else [precision.bits % 3]:
        moments, arms, omega, gammas = ((*v[turned:], *v[:turned]) for v in ((3, 2, 1), arm, (0, 1, 0), gamma))
        run = propagate_multiword(HeavyTop(moments, weight, arms), State(omega, gammas), [80], precision)
        assert run.outcome is Outcome.SUCCESS
        assert worst(run) <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("precision", "about", "horizon"),
    [(DOUBLE, "1e-60", 110), (EXTENDED, "1e-12", 20), (DOUBLE_DOUBLE, "1e-30", 60)],
    ids=lambda value: getattr(value, "name", value),
)
def test_what_an_unstable_axis_amplifies_is_computed_as_finely_as_it_needs(
    precision: Precision, about: str, horizon: int
) -> None:
    """Spin about the middle axis with a weight on it; alone and with others beside it in lanes."""
    top = HeavyTop((3, 2, 1), 1, (0, 1, 0))
    problem = Problem.of(top, State((about, 1, 0), (0, 1, 0)), precision)
    alone = propagate_multiword(top, problem.start, [horizon], precision)
    true = propagate_multiword(top, problem.start, [horizon], real(400)).states[0]
    allowed = exact(precision.eps) * (40 if precision is DOUBLE_DOUBLE else 1)
    for value, expected in zip(map(exact, alone.states[0]), map(exact, true), strict=True):
        assert abs(value - expected) <= allowed * max(1, abs(expected))
    usual = [Problem.of(TOP, START, precision)] * 3
    together = propagate_multiword_ensemble([*usual, problem, *usual], [horizon])
    first = propagate_multiword_ensemble([problem, *usual], [horizon])
    assert [*together[3].states[0]] == [*first[0].states[0]] == [*alone.states[0]]
    assert [*together[0].states[0]] == [*first[1].states[0]]


@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, DOUBLE_DOUBLE, real(53), real(90)], ids=lambda p: p.name)
def test_a_sum_of_two_doubles_is_rounded_as_its_exact_value(precision) -> None:
    random, words = Random(3), [(-0.0, -0.0, 3), (1.0, 2.0**-53, 0), (1 + 2.0**-52, 2.0**-53, -7), (1.0, -1.0, 5)]
    for _ in range(300):
        high = random.uniform(-2, 2) * 2.0 ** random.randint(-200, 200)
        low = math.ulp(high) * random.choice([-0.5, 0.5, random.random(), 2.0**-53])
        words.append((high, low, random.randint(-9, 9)))
    for high, low, exponent in words:
        value = (Fraction(high) + Fraction(low)) * Fraction(2) ** exponent
        (found,), expected = sums_of_two([(high, low, exponent)], precision) or [None], number(value, precision)
        assert type(found) is type(expected)
        assert exact(found) == exact(expected)
        assert str(found) == str(expected)  # a zero has no sign


@pytest.mark.parametrize("words", [(1.0, 0.0, 501), (2.0**501, 0.0, 0), (2.0**-501, 0.0, 0), (math.inf, 0.0, 0)])
def test_a_sum_that_may_leave_the_exponents_of_doubles_is_left_to_exact_numbers(words) -> None:
    assert sums_of_two([(1.0, 0.0, 0), words], DOUBLE) is None
    assert [sums_of_two([(1.0, 0.0, 0)], each) for each in (QUAD, real(52))] == [None, None]
