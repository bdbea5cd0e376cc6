"""Motions as arrays: heyoka's states bit for bit, double-double's within its rounding, and odd ones left to others."""

from fractions import Fraction

import numpy
import pytest

from heavytop import DOUBLE, DOUBLE_DOUBLE, HEAVY_TOP, HeavyTop, State
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.harness.sweeps import Random
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.heyoka.engines import arrays
from heavytop.integrate.heyoka.lanes import states_on_a_grid
from heavytop.integrate.multiword.lanes import double_double_states
from heavytop.integrate.trajectory import Problem
from heavytop.measure.truth import known_motion
from heavytop.multiword.pairs import Numerators
from heavytop.precision import exact

TIMES = [Fraction(1, 8), Fraction(1), Fraction(5, 2), Fraction(6)]
TOLERANCE = Fraction(1, 2**96)


def problems(count: int, family: str = "any") -> list[Problem]:
    cases = Random(name="s", seed=5, count=count, family=family).cases()  # type: ignore[arg-type]
    return [Problem.of(case.top, case.start, DOUBLE) for case in cases]


def as_arrays(motions: list[Problem]) -> tuple[numpy.ndarray, numpy.ndarray]:
    both = [arrays(motion) for motion in motions]
    return numpy.array([p for p, _ in both]), numpy.array([y for _, y in both])


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 8, 21])
def test_states_on_a_grid_are_those_of_the_ensemble_bit_for_bit(count: int) -> None:
    motions = problems(count)
    states, steps, good = states_on_a_grid(HEAVY_TOP, *as_arrays(motions), TIMES)
    runs = propagate_ensemble(motions, TIMES, threads=1)
    assert good.all()
    assert (states == numpy.array([run.states for run in runs])).all()
    assert steps.tolist() == [run.steps for run in runs]


@pytest.mark.slow
@pytest.mark.parametrize("family", ["any", "euler", "lagrange", "kovalevskaya"])
def test_double_double_is_within_its_rounding_of_what_is_proven(family: str) -> None:
    motions = problems(3, family)
    states, good = double_double_states(*as_arrays(motions), TIMES, [TOLERANCE], 10**6)[0]
    assert good.all()
    for place, motion in enumerate(motions):
        known = known_motion(motion, TIMES[-1])
        for sample, time in enumerate(TIMES):
            for k, ball in enumerate(known.truth.state(time, DOUBLE_DOUBLE.bits)):
                found = Fraction(float(states.high[place, sample, k])) + Fraction(float(states.low[place, sample, k]))
                assert abs(found - exact(midpoint(ball))) <= 2**10 * TOLERANCE + exact(radius(ball))


def test_no_bit_depends_on_the_motions_beside() -> None:
    parameters, starts = as_arrays(problems(13))
    together, _ = double_double_states(parameters, starts, TIMES, [TOLERANCE], 10**6)[0]
    for place in (0, 7, 12):
        one = slice(place, place + 1)
        alone, _ = double_double_states(parameters[one], starts[one], TIMES, [TOLERANCE], 10**6)[0]
        assert (alone.high[0] == together.high[place]).all()
        assert (alone.low[0] == together.low[place]).all()


def test_odd_motions_are_left_to_others() -> None:
    up = (0, 0, 1)
    odd = [
        Problem.of(HeavyTop((3, 2, 1), 1, up), State((0, 0, 0), up), DOUBLE),  # at rest
        Problem.of(HeavyTop((3, 2, 1), 1, up), State(("1e-9", 1, 1), up), DOUBLE),
        Problem.of(HeavyTop((3, 2, 1), "1e200", up), State((0, 0, 1), (0, 1, 0)), DOUBLE),
    ]
    usual = problems(1)
    states, good = double_double_states(*as_arrays(odd + usual), TIMES, [TOLERANCE], 10**6)[0]
    assert good.tolist() == [False, False, False, True]
    assert numpy.isnan(states.high[:3]).all()
    assert double_double_states(*as_arrays(usual), TIMES, [TOLERANCE], 2)[0][1].tolist() == [False]


def test_a_lane_that_fails_spoils_its_eight_and_no_others() -> None:
    parameters, starts = as_arrays(problems(16))
    starts[3, 0] = numpy.nan
    _, _, good = states_on_a_grid(HEAVY_TOP, parameters, starts, TIMES)
    assert good.tolist() == [False] * 8 + [True] * 8


def test_quotients_have_three_words() -> None:
    one, three = (Numerators.of(numpy.array([value])) for value in (0.1, 3.7))
    words = (one - three) / three
    value = sum(Fraction(float(word[0])) for word in words)
    true = (Fraction(0.1) - Fraction(3.7)) / Fraction(3.7)
    assert abs(value - true) <= abs(true) * Fraction(1, 2**145)
