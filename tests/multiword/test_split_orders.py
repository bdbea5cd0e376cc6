"""Coefficients split in two: their sums are exact, and what they leave out is as small as the schedule says."""

from dataclasses import replace
from fractions import Fraction
from math import floor
from random import Random

import pytest

from heavytop.multiword.codegen.recurrence import MOST_ORDER
from heavytop.multiword.double_double import steps as dd
from heavytop.multiword.double_double import steps as parts
from heavytop.multiword.double_double.double_double_run import Floating, OrderSchedule
from heavytop.multiword.double_double.eight_lane_run import Eight
from heavytop.multiword.problem import Scaled, Status
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters
from support.helpers import rotor
from support.words_helpers import problem

FINE = OrderSchedule.of(Fraction(1, 2**70))
ALL_PAIRS = replace(FINE, depth=-1000.0)


def rise(m: int, slope: int) -> int:
    """e_m - e_0, as the machine code has it."""
    return floor(Fraction(m * slope, 2**parts.SLOPE_BITS) + Fraction(1, 2))


def test_no_sum_of_coarse_parts_leaves_what_doubles_hold() -> None:
    """Every order and slope: 2^21 units each, L and R sums of two, four sums added, in the smallest unit there is."""
    random, largest = Random(1), 0
    slopes = [random.randint(-8, 8) * 2**16 + random.randint(-(2**15), 2**15) for _ in range(40)]
    for slope in slopes:
        for n in (*range(8), MOST_ORDER // 2, MOST_ORDER - 1, MOST_ORDER):
            common = min(rise(m, slope) + rise(n - m, slope) for m in range(n + 1))
            terms = (2 ** (rise(m, slope) + rise(n - m, slope) - common) for m in range(n + 1))
            largest = max(largest, 4 * sum(terms) * (2 * 2**parts.UNIT_BITS) ** 2)
    assert 2**52 < largest <= 2**53


def random_problem(random: Random, system, attitude: bool, scale: int) -> Scaled:
    """Moments within a factor of ten, spins up to ten times the rest; time in units of 10^scale."""
    p = Parameters(
        tuple(Fraction(random.randint(10, 40), 20) for _ in range(3)),
        tuple(Fraction(random.randint(-9, 9), 10) * Fraction(10) ** (-2 * scale) for _ in range(3)),
        rotor(system, lambda: Fraction(random.randint(-9, 9), 9) * Fraction(10) ** -scale),
    )
    spin = random.choice((1, 3, 10))
    omega = [Fraction(random.randint(-99, 99) * spin, 100) * Fraction(10) ** -scale for _ in range(3)]
    rest = [Fraction(random.randint(-99, 99), 100) for _ in range(6 if attitude else 3)]
    return Scaled.of(system, p, (*omega, *rest))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("system", "attitude"),
    [(HEAVY_TOP, False), (GYROSTAT, False), (HEAVY_GYROSTAT, True)],
    ids=["plain", "gyrostat", "xi"],
)
def test_a_step_in_split_coefficients_differs_by_less_than_its_ladder_allows(system, attitude: bool) -> None:
    random, most = Random(2), Fraction(1, 2**79)
    for scale in (0, 100, -100, 0, 0):
        given = random_problem(random, system, attitude, scale)
        split, exact = (Floating(given, schedule, True) for schedule in (FINE, ALL_PAIRS))
        for _ in range(20):
            for run in (split, exact):
                assert run.advance(run.time + Fraction(1, 10**9), 1) is Status.OK
            size = max(map(abs, exact.state))
            assert split.time == exact.time
            assert max(abs(a - b) for a, b in zip(split.state, exact.state, strict=True)) < most * size
            # from the same state again
            split.words[: 16 * split.layout.vectors] = exact.words[: 16 * exact.layout.vectors]
        assert split.counts[dd.USED_TRIES] < parts.MOST_TRIES


def scaled_units(run: Floating, factor: float) -> None:
    run.words[run.layout.units : run.layout.units + 8] *= factor


def another_slope(run: Floating, slope: int) -> None:
    run.counts[dd.SLOPE] = slope


@pytest.mark.parametrize(
    ("spoil", "number"),
    [(scaled_units, 2.0**k) for k in (-40, -8, 8, 40)]
    + [(another_slope, slope) for slope in (2**20, -(2**20), 30 * 2**16, 2**62, -(2**62))],
)
def test_a_step_with_units_or_a_slope_that_do_not_fit_is_done_again(spoil, number) -> None:
    known, run = (Floating(problem(), FINE, True) for _ in range(2))
    for one in (known, run):
        one.advance(Fraction(3), 10**6)
    spoil(run, number)
    for one in (known, run):
        one.advance(one.time + Fraction(1, 10**9), 1)
    # units that are too coarse from the first order on are not used at all
    assert spoil is another_slope or run.counts[dd.USED_TRIES] == (number < 2**40)
    assert known.counts[dd.USED_TRIES] == 0
    assert max(abs(a - b) for a, b in zip(known.state, run.state, strict=True)) < Fraction(1, 2**79)


def test_lanes_are_split_as_a_motion_by_itself_is() -> None:
    random = Random(3)
    schedule = OrderSchedule.of(Fraction(1, 2**70), 1.6)
    for system in (HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT):
        given = [random_problem(random, system, False, (0, 40, -40)[k % 3]) for k in range(8)]
        found = []
        for pairs in (False, True):
            eight = Eight(system, replace(schedule, depth=-1000.0) if pairs else schedule, schedule.order - 2)
            assert (eight.pair_order == eight.low_order) is pairs
            for lane, one in enumerate(given):
                eight.put(lane, one, True, 5)
                eight.aim(lane, Fraction(10**6))
            eight.advance(100)
            assert [eight.taken(lane, 5) for lane in range(8)] == [5] * 8
            found.append([(eight.time(lane), eight.state(lane)) for lane in range(8)])
        for (time, state), (same, exact) in zip(*found, strict=True):
            assert time == same
            assert max(abs(a - b) for a, b in zip(state, exact, strict=True)) < Fraction(1, 2**74) * max(
                map(abs, exact)
            )
