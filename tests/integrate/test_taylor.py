"""heyoka behind one call: right in every format, the same bits however it is cut, and honest about failure."""

from fractions import Fraction

import numpy
import pytest

from heavytop import DOUBLE, EXTENDED, GYROSTAT, HEAVY_TOP, QUAD, HeavyTop, Outcome, State
from heavytop.integrate.heyoka.engines import compiled
from heavytop.integrate.heyoka.motions import Stepper, propagate
from heavytop.integrate.trajectory import Problem
from heavytop.precision import exact, number
from heavytop.top.attitude import perpendicular
from support.helpers import PAPER, bits

TOP = HeavyTop((3, 3, "3/2"), 2, ("1/3", "3/4", 0))
START = State(("1/10", "1/5", "9/10"), ("3/5", 0, "4/5"))


@pytest.mark.parametrize(
    "changed",
    [lambda count: 1, lambda count: count if count == 1 else 2 * count],
    ids=["one by one", "too far, and taken back"],
)
def test_chunks_of_any_length_change_no_bit(monkeypatch: pytest.MonkeyPatch, changed) -> None:
    usual, original = propagate(TOP, START, [50, 200], DOUBLE), Stepper._steps_short_of
    monkeypatch.setattr(Stepper, "_steps_short_of", lambda self, target: changed(original(self, target)))
    other = propagate(TOP, START, [50, 200], DOUBLE)
    assert (bits(other), other.steps) == (bits(usual), usual.steps)


@pytest.mark.parametrize("omega", [(0, 4, 2), (0, 2, 4), ("1/1000", 3, 0), (8, 1, 1)], ids=str)
@pytest.mark.parametrize("horizon", [100, 1000, -1000])
def test_steps_to_a_far_time_are_taken_once(monkeypatch: pytest.MonkeyPatch, omega, horizon: int) -> None:
    """A first step that is shorter or longer than the mean does not send a run too far again and again."""
    taken, original = [], Stepper._several

    def several(self: Stepper, count: int, target: object) -> Outcome:
        taken.append(count)
        return original(self, count, target)

    monkeypatch.setattr(Stepper, "_several", several)
    top = HeavyTop((1, "7/16", "3/4"), 1, ("45/32", 0, 0))
    run = propagate(top, State(omega, (-1, 0, 0)), [horizon], DOUBLE)
    assert run.outcome is Outcome.SUCCESS
    assert sum(taken) < 1.2 * run.steps
    assert len(taken) < 60


@pytest.mark.slow
def test_a_compiled_integrator_is_used_again_and_gives_the_same_bits_as_a_fresh_one() -> None:
    first = propagate(TOP, START, [5], DOUBLE)
    propagate(HeavyTop((5, 4, 2), 1, (1, 2, 3)), State((1, 2, 3), (0, 0, 1)), [7], DOUBLE)
    again = propagate(TOP, START, [5], DOUBLE)
    assert bits(again) == bits(first)
    assert compiled(HEAVY_TOP, DOUBLE) is compiled(HEAVY_TOP, DOUBLE)
    assert compiled(HEAVY_TOP, DOUBLE) is not compiled(GYROSTAT, DOUBLE)


def test_an_overflow_is_an_outcome_and_not_numbers() -> None:
    run = propagate(TOP, State((10**300, 10**300, 1), (0, 0, 1)), [1], EXTENDED)
    assert run.outcome is Outcome.NON_FINITE
    assert len(run.states) == 0
    assert run.time_reached == 0


@pytest.mark.slow
def test_everything_that_changes_bits_is_in_the_flags() -> None:
    flags = propagate(TOP, START, [1], DOUBLE, high_accuracy=True).flags
    assert flags["high_accuracy"] == "true"
    assert flags["compact_mode"] == "false"
    assert {"tolerance", "order", "opt_level", "fast_math", "force_avx512", "slp_vectorize", "code_cache"} <= set(flags)


def test_a_looser_tolerance_takes_fewer_steps_of_lower_order() -> None:
    tight, loose = (
        propagate(TOP, START, [50], DOUBLE),
        propagate(TOP, START, [50], DOUBLE, tolerance=Fraction(1, 10**9)),
    )
    assert loose.order < tight.order
    assert loose.flags["tolerance"] == "1e-09"


def test_the_problem_is_rounded_once_and_the_rotor_comes_from_the_exact_data() -> None:
    problem = Problem.of(*PAPER, DOUBLE, GYROSTAT)
    assert problem.parameters.rotor == exact(number(Fraction(1, 21 * 11), DOUBLE))
    assert problem.parameters.moment == (0, exact(number(Fraction(1, 21), DOUBLE)), 0)
    assert problem.top.moment == problem.parameters.moment


def test_the_body_of_a_sleeping_top_turns_though_omega_and_gamma_rest() -> None:
    top, start = HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, 0, 3), (0, 0, 1))
    run = propagate(top, start, [1], QUAD, xi=perpendicular(start.gamma))
    values = [exact(v) for v in run.states[0]]
    assert values[:6] == list(start.flat)
    assert float(values[6]) == pytest.approx(float(numpy.cos(3.0)))
