"""Events against root finding that shares nothing with them: mpmath on Taylor series of its own, and closed forms."""

import itertools
import math
import random
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from flint import fmpq

import heavytop as ht
from heavytop.errors import InputError, OutOfReach
from heavytop.features.events.functions import Wanted, event_function, first_term, rate_along, start_series
from heavytop.features.events.located import locate
from heavytop.integrate.dense import Dense, Piece
from heavytop.integrate.trajectory import Problem
from heavytop.top.equations import HEAVY_TOP
from support.helpers import START, TOP

PENDULUM = ht.HeavyTop((1, 1, 1), 1, (1, 0, 0))
AT_REST = ht.State((0, 0, 0), ("-3/5", "4/5", 0))
TURNING = ht.HeavyTop((2, 2, 1), 0, (0, 0, 0)), ht.State((0, 0, 1), (1, 0, 0))  # γ = (cos t, −sin t, 0)
FUNCTIONS = ("omega1 = 1/5", "gamma3 = 1/2", "omega1*gamma2 - omega2*gamma1 = 1/10", "omega3/(gamma1 + 2) = 1/5")


def floats(found) -> np.ndarray:
    """The times of computed events, and of proven ones."""
    return found.times_numpy() if hasattr(found, "times_numpy") else found.times


def value(name: str, y):
    w1, w2, w3, g1, g2, g3 = y
    return {
        "omega1 = 1/5": w1 - mpmath.mpf(1) / 5,
        "gamma3 = 1/2": g3 - mpmath.mpf(1) / 2,
        "omega1*gamma2 - omega2*gamma1 = 1/10": w1 * g2 - w2 * g1 - mpmath.mpf(1) / 10,
        "omega3/(gamma1 + 2) = 1/5": w3 / (g1 + 2) - mpmath.mpf(1) / 5,
    }[name]


def field(t, y):
    """(1.1) and (1.2) for TOP, written out."""
    w1, w2, w3, g1, g2, g3 = y
    n1, n2, n3 = mpmath.mpf(1) / 2, mpmath.mpf(1) / 3, mpmath.mpf(1) / 5
    return [
        ((2 - 1) * w2 * w3 + g2 * n3 - g3 * n2) / 3,
        ((1 - 3) * w3 * w1 + g3 * n1 - g1 * n3) / 2,
        ((3 - 2) * w1 * w2 + g1 * n2 - g2 * n1) / 1,
        g2 * w3 - g3 * w2,
        g3 * w1 - g1 * w3,
        g1 * w2 - g2 * w1,
    ]


@pytest.fixture(scope="module")
def independent() -> dict[str, list[tuple[mpmath.mpf, list[mpmath.mpf], int]]]:
    """Events up to t = 6 by mpmath: its Taylor integrator at 40 digits, samples each 0.02, and its root finder."""
    with mpmath.workdps(40):
        start = [mpmath.mpf(x.numerator) / x.denominator for x in START.flat]
        motion = mpmath.odefun(field, 0, start)
        grid = [mpmath.mpf(k) / 50 for k in range(301)]
        states = [motion(t) for t in grid]
        found = {}
        for name in FUNCTIONS:
            events = []
            for (a, u), (b, v) in itertools.pairwise([(t, value(name, y)) for t, y in zip(grid, states, strict=True)]):
                if u * v < 0:
                    root = mpmath.findroot(lambda t: value(name, motion(t)), (a, b), solver="anderson")  # noqa: B023
                    events.append((root, motion(root), 1 if v > 0 else -1))
            found[name] = events
        return found


@pytest.mark.slow
@pytest.mark.parametrize("name", FUNCTIONS)
def test_proven_events_are_those_of_mpmath(name, independent) -> None:
    known = ht.events(TOP, START, 6, name, digits=30)
    assert known.guarantee == "proven"
    assert len(known) == len(independent[name]) > 0
    assert known.directions == [direction for *_, direction in independent[name]]
    with mpmath.workdps(40):
        for ball, state, (time, other, _) in zip(known.times, known.states, independent[name], strict=True):
            assert abs(mpmath.mpf(ball.value) - time) <= mpmath.mpf(ball.radius) + mpmath.mpf(10) ** -33
            assert Fraction(ball.radius) <= Fraction(1, 10**30) * max(1, abs(Fraction(ball.value)))
            for mine, theirs in zip(state, other, strict=True):
                assert abs(mpmath.mpf(mine.value) - theirs) <= mpmath.mpf(mine.radius) + mpmath.mpf(10) ** -33


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "precision"),
    [("heyoka", "double"), ("heyoka", "quad"), ("multiword", "extended"), ("multiword", "real:150")],
)
def test_computed_events_are_right_to_the_format(integrator, precision) -> None:
    for until, name in ((6, FUNCTIONS[2]), (-6, FUNCTIONS[1])):
        found = ht.events(TOP, START, until, name, precision=precision, integrator=integrator)
        known = ht.events(TOP, START, until, name, digits=found.problem.precision.digits + 4)
        assert found.guarantee == "polynomial"
        assert list(found.directions) == known.directions
        allowed = 60 * found.problem.precision.eps
        for time, ball in zip(found.time_texts(), known.times, strict=True):
            assert abs(Fraction(time) - Fraction(ball.value)) <= allowed * max(1, abs(Fraction(ball.value)))
        for state, balls in zip(found.texts(), known.texts(), strict=True):
            assert max(abs(Fraction(a) - Fraction(b)) for a, b in zip(state, balls, strict=True)) <= allowed


def test_the_state_lies_on_the_section_to_rounding() -> None:
    found = ht.events(TOP, START, 200, "gamma3 = 1/2")
    assert len(found) > 40
    assert abs(found.to_numpy()[:, 5] - 0.5).max() < 1e-16
    assert (np.diff(found.times) > 0).all()
    assert (np.diff(found.directions) != 0).all()  # they alternate: none is missed and none is twice


@pytest.mark.slow
def test_the_pendulum_has_the_events_of_its_elliptic_functions() -> None:
    # from rest at sin(θ/2) = k it passes the bottom at K, 3K, 5K, ... (unit frequency)
    known = ht.events(PENDULUM, AT_REST, 20, "gamma2", digits=40)
    with mpmath.workdps(50):
        quarter = mpmath.ellipk((1 - mpmath.mpf(3) / 5) / 2)
        assert len(known) == int((20 / quarter + 1) / 2) > 4
        for n, ball in enumerate(known.times):
            assert abs(mpmath.mpf(ball.value) - (2 * n + 1) * quarter) <= mpmath.mpf(ball.radius)
    assert known.directions == [(-1) ** (n + 1) for n in range(len(known))]
    computed = ht.events(PENDULUM, AT_REST, 2000, "gamma2")
    expected = (2 * np.arange(len(computed)) + 1) * float(quarter)
    assert len(computed) > 500
    assert abs(computed.times - expected).max() < 1e-10


def test_the_start_on_a_section_is_no_event() -> None:
    for until in (10, -10):
        # Ω3 = 0 at rest: the first return is half a period later
        half = 2 * float(mpmath.ellipk(0.2))
        for digits in (None, 20):
            found = ht.events(PENDULUM, AT_REST, until, "omega3", digits=digits)
            assert abs(np.abs(floats(found)) - half * np.arange(1, len(found) + 1)).max() < 1e-13
            assert len(found) == 3


def test_a_zero_of_higher_order_at_the_start_is_followed() -> None:
    # γ1 − γ1(0) begins like t², and Ω3 γ3 + ... of order 1; none but later changes of sign count
    start = ht.State((0, 0, 0), ("3/5", "4/5", 0))
    assert len(ht.events(PENDULUM, start, 4, "gamma1 = 3/5", digits=20)) == 0
    assert len(ht.events(PENDULUM, start, 4, "(gamma1 - 3/5)*omega3", digits=20)) == 0
    # γ1 = d t − ..., d = 1e-12: a second zero right after the start, which no rounding hides as γ1(0) is exact
    start = ht.State((0, "0.74999999999875", 1), (0, "3/5", "4/5"))
    times = [floats(ht.events(TOP, start, "1/20", "gamma1", digits=digits)) for digits in (None, 16)]
    assert len(times[0]) == 1
    assert np.allclose(*times, rtol=1e-3, atol=0)


@pytest.mark.parametrize(
    "function", ["gamma3 = 4/5", "omega1 = 1/10", "gamma1 = 3/5", "(omega1 - 1/10)*(omega2 - 2/5)*(gamma1 - 3/5)"]
)
def test_rounding_the_start_makes_no_event_of_a_zero_there(function) -> None:
    for until in (6, -6):
        known = ht.events(TOP, START, until, function, digits=16)
        for precision, integrator in (("double", "heyoka"), ("extended", "heyoka"), ("quad", "multiword")):
            computed = ht.events(TOP, START, until, function, precision=precision, integrator=integrator)
            assert np.allclose(floats(computed), floats(known), rtol=0, atol=1e-12)


def two_close(distance: Fraction) -> tuple[str, float]:
    """γ3 = c for a c just below a maximum of γ3 of TOP, so that it is passed twice within ``distance``."""
    top = ht.events(TOP, START, 30, "gamma1*omega2 - gamma2*omega1", -1, digits=60)
    time, state = top.times[2], top.states[2]
    y = [float(ball.value) for ball in state]
    rate = field(0, y)
    curvature = rate[3] * y[1] + y[3] * rate[1] - rate[4] * y[0] - y[4] * rate[0]
    level = Fraction(state[5].value) + Fraction(float(curvature)) / 2 * (distance / 2) ** 2
    return f"gamma3 = {level}", float(Fraction(time.value))


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["heyoka", "multiword"])
def test_two_roots_a_millionth_apart_inside_a_step_are_both_found(integrator) -> None:
    function, near = two_close(Fraction(1, 10**6))
    for digits in (None, 20):
        options = {"digits": digits} if digits else {"integrator": integrator}
        found = ht.events(TOP, START, near + 1, function, **options)
        close = [t for t in floats(found) if abs(t - near) < 1e-5]
        assert len(close) == 2
        assert 0.9e-6 < close[1] - close[0] < 1.1e-6
    # one sample in the middle of each step sees neither: the fault that this guards against
    run = ht.propagate(TOP, START, [near - 0.01, near + 0.01]).to_numpy()
    level = float(Fraction(function.split("=")[1]))
    assert (run[:, 5] < level).all()


@pytest.mark.slow
def test_two_roots_in_balls_at_a_distance_of_1e_minus_20() -> None:
    function, near = two_close(Fraction(1, 10**20))
    found = ht.events(TOP, START, Fraction(near).limit_denominator(1000) + 1, function, digits=25)
    close = [Fraction(ball.value) for ball in found.times if abs(float(ball.value) - near) < 1e-5]
    assert len(close) == 2
    assert Fraction(9, 10**21) < close[1] - close[0] < Fraction(11, 10**21)


@pytest.mark.slow
def test_a_function_that_only_touches_zero_is_undecided_by_name() -> None:
    with pytest.raises(OutOfReach, match=r"Near t = 3\.31.* whether the function changes sign or only touches"):
        ht.events(PENDULUM, AT_REST, 5, "gamma1 = -3/5", digits=15)
    # a change of sign at the end of the run itself cannot be distinguished from one behind it
    at_end = Fraction(ht.events(PENDULUM, AT_REST, 3, "gamma2", digits=400).times[0].value)
    with pytest.raises(OutOfReach, match="before the end of the run"):
        ht.events(PENDULUM, AT_REST, at_end, "gamma2", digits=15)


@pytest.mark.slow
@pytest.mark.parametrize("digits", [None, 20])
def test_powers_change_sign_where_their_bases_do_or_never(digits) -> None:
    for power in (1, 2, 3, 8):
        for function, first in ((f"gamma1**{power}", math.pi / 2), (f"gamma2^{power}/gamma1**2", math.pi)):
            found = ht.events(*TURNING, 6, function, digits=digits)
            times, expected = floats(found), (np.arange(first, 6, math.pi) if power % 2 else [])
            assert len(times) == len(expected)
            assert np.allclose(times, expected, rtol=0, atol=1e-13)


@pytest.mark.slow
def test_a_zero_of_third_order_that_is_no_power_is_undecided() -> None:
    with pytest.raises(OutOfReach, match=r"Near t = 3\.14159265359 .* changes sign or only touches"):
        ht.events(*TURNING, 4, "(1 + gamma1)*gamma2", digits=2)


@pytest.mark.slow
@pytest.mark.parametrize("digits", [None, 20])
def test_a_function_that_is_zero_along_the_motion_is_refused(digits) -> None:
    start = ht.State((0, 0, 1), ("-3/5", "4/5", 0))
    for function in ("omega2", "omega1*gamma2", "gamma1**2 + gamma2**2 = 1", "omega3**2/2 + gamma1 = -1/10"):
        with pytest.raises(InputError, match="is zero along this motion"):
            ht.events(PENDULUM, start, 10, function, digits=digits)
    for function in ("gamma1/omega2", "gamma1/(gamma1**2 + gamma2**2 - 1)**2"):
        with pytest.raises(InputError, match="is divided by 0 along this motion"):
            ht.events(PENDULUM, start, 10, function, digits=digits)
    with pytest.raises(InputError, match="is zero at every sample"):
        ht.events(PENDULUM, start, 10, lambda omega, gamma: abs(omega[1]))


def test_a_function_has_the_taylor_coefficients_of_its_derivatives_along_the_motion() -> None:
    """f^(n)(0)/n!, by differentiating the polynomial along the field, exactly."""
    top = ht.HeavyTop((3, 2, 1), 2, ("1/2", "1/3", "-1/5"))
    start = ht.State(("1/10", "-2/5", "9/10"), ("3/5", 0, "4/5"))
    parameters = HEAVY_TOP.parameters(top, start)
    rate = event_function("omega1**2*gamma3 - omega2*gamma1 + 3*omega3").numerator
    (series,) = start_series([rate], HEAVY_TOP, parameters, start.flat)
    for n in range(6):
        value = rate(*(fmpq(v.numerator, v.denominator) for v in start.flat))
        assert series[n] == Fraction(int(value.p), int(value.q)) / math.factorial(n)
        rate = rate_along(rate, HEAVY_TOP, parameters)


@pytest.mark.slow
def test_directions_split_the_events() -> None:
    both = ht.events(TOP, START, 60, "gamma2")
    rising, falling = (ht.events(TOP, START, 60, "gamma2", direction) for direction in (1, -1))
    assert sorted([*rising.times, *falling.times]) == list(both.times)
    assert set(rising.directions) == {1}
    assert set(falling.directions) == {-1}
    # the direction is that of time, also where the run goes back
    back = ht.events(TOP, START, -20, "gamma2", digits=15)
    for ball, direction in zip(back.times, back.directions, strict=True):
        time = Fraction(ball.value)
        before, after = ht.reference(TOP, START, [time - Fraction(1, 1000), time + Fraction(1, 1000)], 15).to_numpy()
        assert np.sign(after[4] - before[4]) == direction
    assert list(ht.events(TOP, START, -20, "gamma2").directions) == back.directions


@pytest.mark.slow
def test_text_and_callables_are_the_same_function() -> None:
    text = ht.events(TOP, START, 20, "Ω1*γ2 - 2*γ1/3 = -1/4")
    ring = ht.events(TOP, START, 20, lambda omega, gamma: omega[0] * gamma[1] - 2 * gamma[0] / 3 + 0.25)
    sampled = ht.events(TOP, START, 20, lambda omega, gamma: float(omega[0] * gamma[1] - 2 * gamma[0] / 3 + 0.25))
    assert (text.guarantee, ring.guarantee, sampled.guarantee) == ("polynomial", "polynomial", "sampled")
    assert list(text.times) == list(ring.times)
    assert abs(text.times - sampled.times).max() < 1e-13
    vector = event_function(lambda omega, gamma: omega @ np.array([1, 0, 2]) / 2)
    assert str(vector.numerator) == "omega1 + 2*omega3"
    cancelled = event_function("omega1*omega2/omega2")
    assert str(cancelled.numerator) == "omega1"


@pytest.mark.slow
def test_a_sampled_callable_finds_two_close_roots_at_its_minimum() -> None:
    function, near = two_close(Fraction(1, 1000))
    level = float(Fraction(function.split("=")[1]))
    found = ht.events(TOP, START, near + 1, lambda omega, gamma: math.atan(gamma[2] - level))
    assert len([t for t in found.times if abs(t - near) < 1e-2]) == 2


def test_a_pole_is_no_event() -> None:
    assert len(ht.events(TOP, START, 20, "gamma2")) > 3
    assert len(ht.events(TOP, START, 20, "1/gamma2")) == len(ht.events(TOP, START, 4, "1/gamma2", digits=15)) == 0
    # the sign of the denominator turns the direction
    plain, over = (ht.events(TOP, START, 8, f, digits=15) for f in ("omega1", "omega1/(gamma2 - 2)"))
    assert [-d for d in plain.directions] == over.directions


def broken(first, second):
    """Two steps of f = Ω1 that do not meet at their common end, by a rounding."""

    def steps(run: Dense):
        for began, coefficients in ((0, first), (1, second)):
            yield Piece(Fraction(began), Fraction(1), 53, lambda i, c=coefficients: c if i == 0 else [(1, 0)] * len(c))
            run.steps += 1

    return steps


@pytest.mark.parametrize(
    ("first", "second", "count"),
    [
        ([(-1, 0), (1, 0), (-1, -60)], [(1, -60), (1, 0)], 1),  # changes in between
        ([(-1, 0), (1, 0), (1, -60)], [(-1, -60), (1, 0)], 1),  # just before the end, and again just behind it
        ([(-1, 0), (1, 0), (1, -60)], [(1, -61), (1, 0)], 1),
        ([(-1, 0), (1, 0)], [(0, 0), (1, 0)], 1),  # exactly at the end
        ([(-1, 0), (1, 0)], [(0, 0), (-1, 0)], 0),  # touches there
    ],
)
def test_a_change_at_the_common_end_of_two_steps_counts_once(first, second, count) -> None:
    problem = Problem.of(TOP, START, ht.DOUBLE)
    found = locate(Dense(broken(first, second), problem, Fraction(2)), "planted", Wanted(event_function("omega1")))
    assert len(found) == count
    assert all(abs(float(t) - 1) < 1e-12 for t in found.times)


@pytest.mark.slow
def test_odd_scales_and_names_of_axes() -> None:
    # lengths, masses and times scaled by powers of two scale the times of events exactly
    scale = Fraction(2) ** 200
    fast = ht.State([w * scale for w in START.omega], START.gamma)
    heavy = ht.HeavyTop(TOP.inertia, scale**2, TOP.centre)
    plain = ht.events(TOP, START, 10, "omega1*gamma1 = 1/20", digits=20)
    other = ht.events(heavy, fast, 10 / scale, f"omega1*gamma1 = {scale / 20}", digits=1)
    assert [Fraction(b.value) * scale for b in other.times] != []
    assert len(plain) == len(other)
    assert other.directions == plain.directions
    computed = ht.events(heavy, fast, 10 / scale, f"omega1*gamma1 = {scale / 20}", integrator="multiword")
    for mine, ball in zip(computed.times, plain.times, strict=True):
        assert abs(float(Fraction(float(mine)) * scale) - float(ball.value)) < 1e-13
    turned = ht.HeavyTop((1, 3, 2), 1, ("1/5", "1/2", "1/3"))
    again = ht.State(("9/10", "1/10", "2/5"), ("4/5", "3/5", 0))
    renamed = ht.events(turned, again, 10, "omega2*gamma2 = 1/20", digits=20)
    assert [b.value[:18] for b in renamed.times] == [b.value[:18] for b in plain.times]


def test_a_run_that_ends_early_says_so() -> None:
    found = ht.events(TOP, START, 1000, "gamma2", step_limit=20)
    assert found.outcome.value == "step_limit"
    assert found.steps == 20
    assert "only" in repr(found)
    assert len(ht.events(TOP, START, 1000, "gamma2", limit=3)) == 3
    assert len(ht.events(TOP, START, 100, "gamma2", digits=15, limit=3)) == 3


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"until": 0}, "until must be a time other than 0; got 0"),
        ({"until": "nan"}, "not a finite number"),
        ({"until": "1e151"}, "too large"),
        ({"direction": 2}, "direction must be a sign; got 2"),
        ({"direction": 0.5}, "must be an integer"),
        ({"function": ""}, "not a function"),
        ({"function": "omega4"}, "not a component"),
        ({"function": "omega1 = 1 = 2"}, "not a function"),
        ({"function": "1"}, "does not depend"),
        ({"function": "omega1/(omega2 - omega2)"}, "divides by zero"),
        ({"function": "omega1**99"}, "power"),
        ({"function": "(omega1 + gamma1)**20 * omega2**20"}, "degree 40"),
        ({"function": "omega1 + __import__('os')"}, "not part of"),
        ({"function": "omega1 + " * 2000 + "1"}, "too long"),
        ({"function": "(" * 90 + "omega1"}, "not a function"),
        ({"function": 3}, "must be text or a callable"),
        ({"function": lambda omega, gamma: 1 / 0}, "raised ZeroDivisionError"),
        ({"function": lambda omega, gamma: float("nan")}, "gave nan"),
        ({"function": lambda omega, gamma: "x"}, "gave 'x'"),
        ({"function": lambda omega, gamma: None}, "gave None"),
        ({"function": lambda omega, gamma: [abs(omega[0])]}, r"gave \["),
        ({"function": lambda omega, gamma: abs(omega[:2])}, r"gave array\("),
        ({"function": lambda omega, gamma: 1j * abs(omega[0])}, "gave .*j"),
        ({"function": lambda omega, gamma: abs(omega[0]), "digits": 10}, "must be rational"),
        ({"integrator": "scipy"}, "has no dense output"),
        ({"digits": 0}, "digits must be from 1"),
        ({"digits": 10, "precision": ht.QUAD}, "do not support precision"),
        ({"limit": 0}, "must be at least 1"),
    ],
)
def test_bad_input_is_named(changes, match) -> None:
    options = {"until": 5, "function": "omega1"} | changes
    with pytest.raises(InputError, match=match):
        ht.events(TOP, START, options.pop("until"), **options)


def test_what_is_out_of_reach_says_so() -> None:
    with pytest.raises(OutOfReach, match="too many for dense output"):
        ht.events(TOP, START, 10**12)
    with pytest.raises(OutOfReach, match="Computed ones reach further"):
        ht.events(TOP, START, 10**7, digits=20)


def test_a_section_of_several_starts() -> None:
    rng = random.Random(3)
    starts = [ht.State(("1/10", Fraction(rng.randint(-9, 9), 10), "9/10"), ("3/5", 0, "4/5")) for _ in range(3)]
    section = ht.poincare(TOP, starts, 40, "gamma2")
    points = section.points("omega3", "γ3")
    assert [p.shape[1] for p in points] == [2, 2, 2]
    assert [len(p) for p in points] == [len(each) for each in section.events]
    assert not section.on_one_level
    assert "different levels" in repr(section)
    assert ht.poincare(TOP, START, 40, "gamma2").on_one_level
    assert len(ht.poincare(TOP, START, 10, "gamma2", digits=15).points()[0]) > 0
    with_rotor = ht.HeavyTop(TOP.inertia, TOP.weight, TOP.centre, (1, 2, 3))
    (area,) = ht.poincare(with_rotor, START, 1, "gamma2").areas
    momentum = with_rotor.angular_momentum(START.omega)
    assert area == float(sum(m * g for m, g in zip(momentum, START.gamma, strict=True)))
    with pytest.raises(InputError, match="No starts were given"):
        ht.poincare(TOP, [], 40)
    with pytest.raises(InputError, match="does not support precision or integrator"):
        ht.poincare(TOP, START, 10, precision=ht.QUAD, digits=15)
    with pytest.raises(InputError, match="does not support precision or integrator"):
        ht.poincare(TOP, START, 10, integrator="scipy:Radau", digits=15)
    with pytest.raises(InputError, match=r"Start 1: .*zero along"):
        ht.poincare(PENDULUM, [ht.State((0, 1, 0), (1, 0, 0)), ht.State((0, 0, 1), (1, 0, 0))], 5, "omega2")
    with pytest.raises(InputError, match="not a component"):
        section.points("omega7")


@pytest.mark.parametrize("options", [{}, {"integrator": "multiword"}, {"digits": 15}], ids=str)
def test_records_without_events_keep_their_shapes(options) -> None:
    """Of a motion, and of an equilibrium."""
    still = ht.events(PENDULUM, ht.State((0, 0, 0), (1, 0, 0)), 10, "omega1 = 1", **options)
    for none in (still, ht.events(TOP, START, "1/100", "omega1 = 5", **options)):
        assert len(none) == 0
        assert none.to_numpy().shape == (0, 6)
        assert "0 events" in repr(none)


@pytest.mark.parametrize(
    ("function", "order"), [("gamma2**24 + (gamma1 - 3/5)**27", 24), ("(omega1 - 1/10)**31 + gamma2**27", 27)]
)
def test_a_function_that_vanishes_to_a_high_order_at_the_start_is_not_zero_along_the_motion(function, order) -> None:
    top = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
    start = ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
    found, value = first_term(event_function(function), HEAVY_TOP, HEAVY_TOP.parameters(top, start), start.flat)
    assert found == order
    assert value != 0
