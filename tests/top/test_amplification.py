"""The amplification of a motion: against runs from changed starts, and against the rates of saddles."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import permutations
from random import Random

import numpy
import pytest

import heavytop as ht
from heavytop.cases import CASES
from heavytop.integrate.multiword.motions import integrate_to_samples
from heavytop.integrate.trajectory import Problem
from heavytop.precision import exact, number, real
from heavytop.top.amplification import FOLLOWED, amplification, loss, rate
from heavytop.top.equations import HEAVY_TOP, Parameters
from heavytop.top.heavy_top import HeavyTop, State
from support.helpers import in_units

GENERIC = CASES["generic"]


def of(top: HeavyTop, start: State, horizon, steps: int = 1000) -> float:
    return amplification(HEAVY_TOP, HEAVY_TOP.parameters(top, start), tuple(start.flat), Fraction(horizon), steps)


def hanging(sign: int, weight: object = 1) -> HeavyTop:
    """A symmetric top that stands upright (1) or hangs down (-1) at γ = (0, 0, 1)."""
    return HeavyTop((1, 1, "1/2"), weight, (0, 0, sign))


STILL = State((0, 0, 0), (0, 0, 1))


FINE = real(200)
FLIPS = (Fraction(919, 15000), Fraction(967, 15000), Fraction(83, 15000))
"""The moments of a body that turns over about its axis 1."""


def drawn(seed: int) -> tuple[HeavyTop, State, Fraction]:
    """A random top and start, and a horizon of some radians."""
    draw = Random(seed)
    inertia = [Fraction(draw.randint(60, 100), 100) for _ in range(3)]
    centre = [Fraction(draw.randint(-9, 9), 10) for _ in range(3)]
    omega = [Fraction(draw.randint(-20, 20), 10) for _ in range(3)]
    return HeavyTop(inertia, draw.randint(0, 3), centre), State(omega, ("2/7", "3/7", "6/7")), Fraction(8)


def turning_over(part: str, until: str) -> tuple[HeavyTop, State, Fraction]:
    return HeavyTop(FLIPS, 0, (0, 0, 0)), State((10, 0, part), (0, "3/5", "4/5")), Fraction(until)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("top", "start", "horizon"),
    [
        (CASES["kovalevskaya"].top, CASES["kovalevskaya"].start, Fraction(-9)),
        drawn(1),
        turning_over("1e-3", "2.5"),
    ],
)
def test_it_is_that_of_runs_from_states_changed_at_any_time(top: HeavyTop, start: State, horizon: Fraction) -> None:
    count, every, small = (96, 4, Fraction(1, 10**30)) if top.inertia == FLIPS else (60, 10, Fraction(1, 10**20))
    times = [horizon * k / count for k in range(count + 1)]
    p = HEAVY_TOP.parameters(top, start)
    scale = rate(HEAVY_TOP, p, start.flat)
    units = [scale] * 3 + [Fraction(1)] * 3
    along = [list(start.flat), *follow_all(problem_of(p, list(start.flat)), times[1:])]
    # where a change is made, and samples after it
    largest = lost = 1.0
    for at in range(0, count, every):
        columns = []
        for j in range(6):
            state = [v + small * u * (k == j) for k, (v, u) in enumerate(zip(along[at], units, strict=True))]
            changed = follow_all(problem_of(p, state), [t - times[at] for t in times[at + every :: every]])
            parts = [
                [(a - b) / u / small for a, b, u in zip(there, plain, units, strict=True)]
                for there, plain in zip(changed, along[at + every :: every], strict=True)
            ]
            columns.append([float(sum(part * part for part in line)) for line in parts])
        weights = [float(v / u) ** 2 for v, u in zip(along[at], units, strict=True)]
        for squares in zip(*columns, strict=True):
            largest = max(largest, math.sqrt(sum(squares) / 6))
            lost = max(lost, math.sqrt(sum(a * b for a, b in zip(squares, weights, strict=True))))
    given = HEAVY_TOP, p, tuple(start.flat), horizon
    # its own samples are the ends of its steps, not these
    assert amplification(*given) == pytest.approx(largest, rel=0.5 if top.inertia == FLIPS else 0.25)
    assert loss(*given) == (pytest.approx(lost, rel=0.5 if top.inertia == FLIPS else 0.25), True)


def problem_of(p: Parameters, state: list[Fraction]) -> Problem:
    return Problem(HEAVY_TOP, FINE, p, State(state[:3], state[3:]), None)


def follow_all(problem: Problem, times: list[Fraction]) -> list[list[Fraction]]:
    run = integrate_to_samples(problem, [number(time, FINE) for time in times])
    return [[exact(value) for value in state] for state in run.states]


def largest_error(run: ht.Trajectory, known: ht.Reference) -> float:
    pairs = [
        (a, b) for one, two in zip(run.states, known.states, strict=True) for a, b in zip(one[:3], two[:3], strict=True)
    ]
    return max(abs(float(exact(a) - exact(b.value))) for a, b in pairs)


@pytest.mark.slow
def test_a_body_that_turns_over_twice_loses_every_digit_of_double_and_not_of_quad() -> None:
    top, start, horizon = turning_over("1e-10", "10")
    times = [horizon * k / 20 for k in range(1, 21)]
    known = ht.reference(top, start, times, digits=40)
    wide = numpy.finfo(numpy.longdouble).nmant > 60
    for precision, text in (
        ("double", "has lost all 16 digits before t = 10" if wide else "has lost at least 1"),
        ("quad", "has lost at least 1"),
    ):
        run = ht.propagate(top, start, times, precision)
        assert text in run.amplification_text()
        assert text in repr(run)
        assert (largest_error(run, known) > 5) == (precision == "double")


def near_a_separatrix(seed: int) -> tuple[HeavyTop, State]:
    """A random free body that turns about its middle axis, but for 1e-6 to 1e-12 of its rate."""
    draw = Random(seed)
    axes, inertia, omega = [0, 1, 2], [Fraction(0)] * 3, [Fraction(0)] * 3
    draw.shuffle(axes)
    for axis, moment in zip(axes, sorted(draw.sample(range(50, 100), 3)), strict=True):
        inertia[axis] = Fraction(moment, 100)
    omega[axes[1]], omega[axes[2]] = Fraction(draw.randint(10, 90), 10), Fraction(1, 10 ** draw.randint(6, 12))
    return HeavyTop(inertia, 0, (0, 0, 0)), State(omega, ("2/7", "3/7", "6/7"))


@pytest.mark.slow
def test_where_all_digits_are_said_to_be_lost_no_integrator_has_one_right() -> None:
    top, start = near_a_separatrix(2)
    p, until = HEAVY_TOP.parameters(top, start), Fraction(4)
    while loss(HEAVY_TOP, p, tuple(start.flat), until)[0] < 2.0**57:
        until *= Fraction(3, 2)
        assert until < 10**4
    times = [until * k / 40 for k in range(1, 41)]
    known = ht.reference(top, start, times, digits=30)
    for integrator in ("heyoka", "scipy:DOP853", "splitting:8"):
        run = ht.propagate(top, start, times, integrator=integrator)
        assert "all 16 digits" in run.amplification_text()
        assert largest_error(run, known) > 0.1 * float(max(start.omega))


def test_what_stays_0_is_not_rounded_and_nothing_is_claimed_beyond_what_is_followed() -> None:
    middle = turning_over("0", "1000")
    p = HEAVY_TOP.parameters(*middle[:2])
    assert amplification(HEAVY_TOP, p, tuple(middle[1].flat), Fraction(1000)) == 1e300
    assert loss(HEAVY_TOP, p, tuple(middle[1].flat), Fraction(3))[0] < 200
    assert loss(HEAVY_TOP, HEAVY_TOP.parameters(hanging(1), STILL), tuple(STILL.flat), Fraction(30)) == (1.0, True)
    top, start, _ = turning_over("1e-10", "10")
    lost, followed = loss(HEAVY_TOP, HEAVY_TOP.parameters(top, start), tuple(start.flat), Fraction(200))
    assert not followed
    assert 2.0**53 < lost < 2.0**64


@pytest.mark.parametrize("weight", [1, 4, "1/9"])
def test_near_a_saddle_it_grows_with_its_rate(weight: object) -> None:
    top = hanging(1, weight)
    saddle = math.sqrt(top.weight)
    early, late = (of(top, STILL, Fraction(turns / saddle)) for turns in (10, 20))
    assert math.log(late / early) == pytest.approx(10, rel=0.001)
    # in proportion beyond what double follows
    beyond = of(top, STILL, Fraction(200 / saddle))
    assert beyond > FOLLOWED
    assert math.log(beyond) == pytest.approx(200, rel=0.05)
    assert of(top, STILL, 10**9) == 1e300
    assert of(hanging(-1, weight), STILL, Fraction(20 / saddle)) < 5


def test_on_a_homoclinic_motion_it_goes_on_where_double_has_left_the_saddle() -> None:
    case = CASES["delone"]
    early, late = (math.log(of(case.top, case.start, time)) for time in (25, 100))
    assert late - early == pytest.approx(75 * case.rate, rel=0.1)


@pytest.mark.slow
def test_on_a_regular_motion_it_grows_like_the_time_and_is_extrapolated_so() -> None:
    case = CASES["euler"]
    short, long = (of(case.top, case.start, time) for time in (200, 400))
    assert long / short == pytest.approx(2, rel=0.2)
    assert of(case.top, case.start, 400, steps=100) == pytest.approx(long, rel=0.3)
    assert of(case.top, case.start, 10**6) == pytest.approx(10**6 / 400 * long, rel=0.3)


@pytest.mark.slow
def test_neither_units_nor_names_of_axes_matter() -> None:
    top, start = GENERIC.top, GENERIC.start
    plain = of(top, start, 20)
    for power in (-300, -2, 2, 300):
        faster = Fraction(2) ** power
        assert of(*in_units(top, start, faster), Fraction(20) / faster) == plain
        heavier = HeavyTop([faster * i for i in top.inertia], faster * top.weight, top.centre)
        assert of(heavier, start, 20) == plain
    for axes in permutations(range(3)):
        odd = -1 if axes in ((0, 2, 1), (1, 0, 2), (2, 1, 0)) else 1
        renamed = HeavyTop([top.inertia[k] for k in axes], top.weight, [top.centre[k] for k in axes])
        moved = State([odd * start.omega[k] for k in axes], [start.gamma[k] for k in axes])
        assert of(renamed, moved, 20) == pytest.approx(plain, rel=1e-6)
    back = State([-w for w in start.omega], start.gamma)
    assert of(top, back, -20) == pytest.approx(plain, rel=1e-6)


def test_without_motion_there_is_none() -> None:
    still = HeavyTop((1, 2, 3), 0, (0, 0, 0))
    assert of(still, STILL, 10**9) == 1
    assert of(GENERIC.top, GENERIC.start, 0) == 1
    assert rate(HEAVY_TOP, Parameters((1, 2, 3), (0, 0, 0), 0), STILL.flat) == 0


@pytest.mark.parametrize("omega", ["1e-140", "1e-3", "1", "3.999", "4", "4.001", "1e140"])
def test_the_rate_is_a_power_of_two_above_every_part(omega: str) -> None:
    found = rate(HEAVY_TOP, Parameters((4, 1, 2), (0, 0, 0), 0), State((0, omega, 0), (0, 0, 1)).flat)
    assert exact(omega) < found <= 4 * exact(omega)
    pull = rate(HEAVY_TOP, Parameters((4, "1/4", 2), (0, exact(omega), 0), 0), STILL.flat)
    assert exact(omega) * 4 < pull**2 <= 64 * exact(omega)
