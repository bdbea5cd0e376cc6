"""The amplification of a motion: against runs from changed starts, and against the rates of saddles."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import permutations

import pytest

from heavytop.cases import CASES
from heavytop.integrate.multiword.motions import integrate_to_samples
from heavytop.integrate.trajectory import Problem
from heavytop.precision import QUAD, exact, number
from heavytop.top.amplification import FOLLOWED, _path, amplification, rate
from heavytop.top.equations import HEAVY_TOP, Parameters
from heavytop.top.heavy_top import HeavyTop, State

GENERIC = CASES["generic"]


def of(top: HeavyTop, start: State, horizon, steps: int = 1000) -> float:
    return amplification(HEAVY_TOP, HEAVY_TOP.parameters(top, start), tuple(start.flat), Fraction(horizon), steps)


def hanging(sign: int, weight: object = 1) -> HeavyTop:
    """A symmetric top that stands upright (1) or hangs down (-1) at γ = (0, 0, 1)."""
    return HeavyTop((1, 1, "1/2"), weight, (0, 0, sign))


STILL = State((0, 0, 0), (0, 0, 1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "horizon"), [("generic", 30), ("lagrange", 20), ("gyrostat", 15), ("kovalevskaya", -9)]
)
def test_it_is_that_of_runs_from_changed_starts(name: str, horizon: int) -> None:
    case, small = CASES[name], Fraction(1, 10**12)
    problem = Problem.of(case.top, case.start, QUAD, case.system)
    p, y = problem.parameters, problem.start.flat
    scale = rate(case.system, p, y)
    units = [scale] * 3 + [Fraction(1)] * 3
    times = [Fraction(horizon) * k / 40 for k in range(1, 41)]

    def states(start) -> list:
        changed = Problem(case.system, QUAD, p, State(start[:3], start[3:]), None)
        return follow_all(changed, times)

    plain = states(y)
    columns = [
        states([v + small * u * (k == j) for k, (v, u) in enumerate(zip(y, units, strict=True))]) for j in range(6)
    ]
    largest = 1.0
    for at in range(len(times)):
        parts = [(column[at][k] - plain[at][k]) / units[k] / small for column in columns for k in range(6)]
        largest = max(largest, math.sqrt(float(sum(part * part for part in parts)) / 6))
    found = amplification(case.system, p, tuple(y), Fraction(horizon))
    # its own samples are the ends of its steps, not these
    assert found == pytest.approx(largest, rel=0.1)


def follow_all(problem: Problem, times: list[Fraction]) -> list[list[Fraction]]:
    run = integrate_to_samples(problem, [number(time, QUAD) for time in times])
    return [[exact(value) for value in state] for state in run.states]


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
        other = HeavyTop(top.inertia, top.weight * faster**2, top.centre)
        assert of(other, State([faster * w for w in start.omega], start.gamma), Fraction(20) / faster) == plain
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


def test_a_path_that_is_shared_gives_what_a_fresh_one_does() -> None:
    given = HEAVY_TOP, HEAVY_TOP.parameters(GENERIC.top, GENERIC.start), tuple(GENERIC.start.flat)
    horizons = [Fraction(1, 3), Fraction(7), Fraction(-7), Fraction(40), Fraction(10**5)]
    fresh = []
    for horizon in horizons:
        _path.cache_clear()
        amplification.cache_clear()
        fresh.append(amplification(*given, horizon, 60))
    amplification.cache_clear()
    shared = [amplification(*given, horizon, 60) for horizon in reversed(horizons)]
    assert shared[::-1] == fresh
    assert fresh[0] < fresh[1] < fresh[3] < fresh[4]
