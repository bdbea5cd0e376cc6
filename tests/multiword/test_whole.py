"""Motions in integers: the field, proven accuracy, the same bits however a run is cut."""

from fractions import Fraction
from random import Random

import pytest

from heavytop import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, HeavyTop, Outcome, State, real
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.multiword.codegen.recurrence import rates, series_rates
from heavytop.multiword.integers.integer_series import IntegerMotion, field_of
from heavytop.multiword.problem import Scaled, Status
from heavytop.precision import exact
from support.helpers import random_parameters, vector
from support.words_helpers import problem

TOP = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = State(("1/8", "3/8", "7/8"), ("5/8", 0, "3/4"))
MANY = real(1040)


@pytest.mark.slow
@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT], ids=lambda system: system.name)
@pytest.mark.parametrize("attitude", [False, True])
@pytest.mark.parametrize("forwards", [True, False])
def test_the_field_is_that_of_the_lanes(system, attitude: bool, forwards: bool) -> None:
    random = Random(16)
    for _ in range(20):
        p = random_parameters(random, system)
        y = (*vector(random), *vector(random), *(vector(random) if attitude else ()))
        scaled = Scaled.of(system, p, y, bounded=True)
        field, state = field_of(scaled, forwards), scaled.state
        products = [state[j] * state[k] for j, k in field.pairs]
        found = [
            Fraction(sum(c * products[i] for c, i in row.products) + sum(c * state[j] for c, j in row.linear))
            / row.denominator
            for row in field.rows
        ]
        assert found == [(1 if forwards else -1) * rate for rate in rates(system, scaled.coefficients, state)]


@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT], ids=lambda system: system.name)
@pytest.mark.parametrize("attitude", [False, True])
def test_components_that_stay_0_are_those_whose_taylor_coefficients_are_0(system, attitude: bool) -> None:
    random, planes = Random(7), 0
    for _ in range(60):
        drawn = random_parameters(random, system)
        share = random.choice((0, 1))
        moment = tuple(value * random.choice((0, 1)) for value in drawn.moment)
        rotor = tuple(share * value for value in drawn.rotor) if isinstance(drawn.rotor, tuple) else drawn.rotor
        y = tuple(value * random.choice((0, 0, 1)) for _ in range(2 + attitude) for value in vector(random))
        problem = Scaled.of(system, drawn._replace(moment=moment, rotor=rotor), y)
        plane = problem.in_invariant_plane()
        series = [problem.state]
        while len(series) < 8:
            series.append(tuple(rate / len(series) for rate in series_rates(system, problem.coefficients, series)))
        constant = [not any(column) for column in zip(*series, strict=True)]
        state = [0 if zero else value for zero, value in zip(constant, vector(random) * 3, strict=False)]
        assert rates(system, plane.coefficients, state) == rates(system, problem.coefficients, state)
        probe = rates(system, plane.coefficients, [*map(Fraction, (2, 3, 5, 7, 11, 13, 17, 19, 23)[: len(y)])])
        assert all(rate == 0 for rate, zero in zip(probe, constant, strict=True) if zero)
        planes += 0 < sum(constant) < len(y)
        assert (plane is problem) == (not any(constant))
    assert planes > 5


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1, -1])
def test_more_bits_than_words_have_are_met_to_the_last(sign: int) -> None:
    times = [sign * Fraction(1, 3), sign * Fraction(3, 4)]
    run = propagate_multiword(TOP, START, times, MANY)
    assert run.outcome is Outcome.SUCCESS
    assert run.flags["arithmetic"] == "integers"
    proven = Validated(run.problem.top, run.problem.start)
    for time, state in zip(run.times, run.states, strict=True):
        for ball, value in zip(proven.state(time, MANY.bits + 8), state, strict=True):
            assert abs(midpoint(ball) - exact(value)) <= MANY.eps


@pytest.mark.slow
def test_a_run_is_taken_up_to_the_same_bits_and_samples_change_none() -> None:
    whole = IntegerMotion(problem(1, attitude=True), 200, True)
    assert whole.advance(Fraction(3), 100) is Status.OK
    before, place = whole.steps, whole.resume_words()
    whole.sample(whole.time - Fraction(1, 1000))
    again = IntegerMotion(problem(1, attitude=True), 200, True)
    again.restore(place, before - 1)
    for run in (whole, again):
        assert run.advance(Fraction(6), 100) is Status.OK
    one, other = ((run.state, run.time, run.steps, run.resume_words()) for run in (whole, again))
    assert one == other
    assert whole.sample(whole.time) == whole.state


def test_steps_can_be_limited() -> None:
    run = propagate_multiword(TOP, START, [Fraction(50)], MANY, step_limit=1)
    assert (run.outcome, run.steps) == (Outcome.STEP_LIMIT, 1)


def test_what_an_unstable_axis_amplifies_is_there_though_no_words_would_hold_it() -> None:
    """2^-1100 of another axis needs its own bits beside those of the format."""
    start = State((Fraction(1, 2**1100), 1, 0), ("5/8", "-3/8", "11/16"))
    free = HeavyTop((3, 2, 1), 0, (0, 0, 1))
    run = propagate_multiword(free, start, [Fraction(1)], real(237))
    assert int(run.flags["bits"]) > 237 + 1100
    first = exact(run.states[0][0]) * 2**1100
    # ω1' = ω2 ω3/3 and ω3' = ω1 ω2 with ω2 = 1: cosh(t/√3)
    assert abs(float(first) - 1.1714) < 1e-3
