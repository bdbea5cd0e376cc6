"""The truth of every row: proven or computed, and until when."""

import math
import random
from fractions import Fraction

import pytest
from flint import arb

from heavytop import DOUBLE, GYROSTAT, QUAD, HeavyTop, OutOfReach, Precision, State, real
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.enclosure import run as validated
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.multiword import motions
from heavytop.integrate.multiword.motions import integrate_to_samples
from heavytop.integrate.trajectory import Problem
from heavytop.measure import truth as truths
from heavytop.measure.truth import ComputedReference, Truth, known_motion, of_rounded, truth
from heavytop.precision import exact, number
from support.helpers import in_units

CHAOTIC = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
EULER = HeavyTop((3, 2, 1), 0, (0, 0, 1))


@pytest.fixture(autouse=True)
def _nothing_is_remembered() -> None:
    known_motion.cache_clear()


def times(horizon, count=8):
    return [Fraction(horizon) * k / count for k in range(1, count + 1)]


def chaotic(precision: Precision = DOUBLE) -> Problem:
    return Problem.of(CHAOTIC, START, precision)


def found(problem: Problem, instants) -> Truth:
    answer = truth(problem, instants)
    assert isinstance(answer, Truth), answer
    return answer


@pytest.mark.slow
def test_the_truth_is_proven_up_to_100_and_beyond_where_that_is_cheap() -> None:
    for horizon in (30, 120):
        answer = found(chaotic(), times(horizon))
        assert answer.against.how == "proven"
        assert answer.ends is None
        assert answer.against.text.startswith("known: validated")


@pytest.mark.slow
@pytest.mark.parametrize("horizon", [100, 101, -101])
def test_the_boundary_of_the_model_of_the_cost(horizon: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Just below its cost an enclosure is proven and just beyond it is not; up to 100 it is, whatever it costs."""
    problem = chaotic()
    cost = Validated(problem.top, problem.start).cost(Fraction(horizon), problem.precision.bits + truths.GUARD_BITS)
    for allowed, how in ((cost, "proven"), (math.nextafter(cost, 0), "computed")):
        known_motion.cache_clear()
        monkeypatch.setattr(truths, "CHEAP", allowed)
        answer = found(problem, times(horizon, 2))
        assert answer.against.how == ("proven" if abs(horizon) <= 100 else how)


def test_a_closed_form_is_proven_at_any_time() -> None:
    answer = found(Problem.of(EULER, START, QUAD), times(10**5, 3))
    assert answer.against.how == "proven"
    assert "Euler" in answer.against.text


@pytest.mark.slow
def test_the_gyrostat_takes_the_rotor_of_the_problem() -> None:
    """Rounded, γ is no longer parallel to M: the rotor is not that of the rounded start."""
    case = ErshkovPartial(Fraction(1, 3), Fraction(2), Fraction(1))
    problem = Problem.of(case.top, case.start, DOUBLE, GYROSTAT)
    (computed,), time = of_rounded([problem], times(3)), Fraction(3)
    for value, true in zip(computed.state(time), found(problem, times(3)).state(time, 120), strict=True):
        assert abs(midpoint(value) - midpoint(true)) <= radius(value)


@pytest.mark.slow
def test_what_is_too_dear_to_prove_is_computed_and_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """With no enclosure allowed beyond 100: the computed one is within its radius of what the enclosure would be."""
    monkeypatch.setattr(truths, "CHEAP", 0.0)
    problem = chaotic()
    answer = found(problem, times(120, 2))
    assert answer.against.how == "computed"
    assert answer.ends is None
    assert "computed, not proven: words of 106 and 138 bits agree within" in answer.against.text
    assert "no closed form, and an enclosure to |t| = 120 takes too long" in answer.against.text
    proven = Validated(problem.top, problem.start)
    for time in times(120, 2):
        for value, true in zip(answer.state(time, 120), proven.state(time, 120), strict=True):
            assert abs(midpoint(value) - midpoint(true)) <= radius(value)
            assert radius(value) < Fraction(1, 2**40)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_no_scale_makes_a_computed_truth_wrong(seed: int) -> None:
    """Tops and starts over ten decades, components down to 1e-30 of others, units of time of 1e±40: within the radius
    of the enclosure, and that radius leaves the digits of the format.
    """
    rng = random.Random(seed)

    def any_size(decades: int) -> Fraction:
        return Fraction(rng.randint(1, 999), 1000) * Fraction(10) ** rng.randint(-decades, decades)

    unit = Fraction(10) ** rng.choice((-40, 0, 40))
    inertia = (2 + any_size(0), 2 + any_size(0), 2 + any_size(0))
    omega = [any_size(0) * unit, any_size(2) * unit, any_size(30) ** rng.choice((0, 1)) * unit / 10**30]
    rng.shuffle(omega)
    top = HeavyTop(inertia, any_size(2) * unit**2, (any_size(1), any_size(1), 0))
    problem = Problem.of(top, State(omega, ("3/5", 0, "4/5")), real(100))
    rate = max(*map(abs, omega), unit)
    instants = times(3 / rate, 2)
    (computed,) = of_rounded([problem], instants)
    proven = Validated(problem.top, problem.start)
    for time in computed.balls:
        pairs = list(zip(computed.state(time), proven.state(time, 200), strict=True))
        for k in (0, 3):
            size = max(abs(midpoint(true)) for _, true in pairs[k : k + 3])
            for value, true in pairs[k : k + 3]:
                assert abs(midpoint(value) - midpoint(true)) <= radius(value) + radius(true)
                assert radius(value) < size / 2**100


@pytest.mark.slow
def test_the_truth_of_a_chaotic_row_ends_where_its_format_has_no_digit_left() -> None:
    answer = found(chaotic(), times(1200, 12))
    assert answer.against.how == "computed"
    assert Fraction(200) <= answer.ends <= Fraction(600)
    assert answer.against.until == str(answer.ends)
    assert f"all significant digits are lost from t = {answer.ends} on" in answer.against.text
    assert not answer.covers(answer.ends)
    assert answer.covers(answer.ends / 2)
    # a run in the format itself is lost there, and was not long before
    instants = times(answer.ends, 4)
    (known,), own = of_rounded([chaotic()], instants), propagate(CHAOTIC, START, instants, DOUBLE)
    errors = [
        max(abs(exact(a) - midpoint(b)) for a, b in zip(state, known.balls[time], strict=True))
        for time, state in zip(instants, own.states, strict=True)
    ]
    assert errors[-1] > Fraction(1, 1000) > errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("unit", [Fraction(10) ** -40, Fraction(10) ** 40])
def test_the_truth_ends_at_the_same_time_in_any_unit_of_time(unit: Fraction) -> None:
    ends = []
    for rate in (Fraction(1), unit):
        (computed,) = of_rounded([Problem.of(*in_units(CHAOTIC, START, rate), DOUBLE)], times(800 / rate, 8))
        ends.append(computed.ends * rate)
    assert abs(ends[0] - ends[1]) <= 100


@pytest.mark.slow
def test_a_tiny_component_on_an_unstable_axis_takes_no_digit() -> None:
    """Ω1 = 1e-60 about the middle axis: its growth is no loss of digits, in a format that floats."""
    start = State((Fraction(1, 10**60), 1, 0), ("3/5", 0, "4/5"))
    for precision in (DOUBLE, QUAD):
        (computed,) = of_rounded([Problem.of(EULER, start, precision)], times(100, 4))
        assert computed.ends is None


@pytest.mark.slow
def test_more_digits_last_longer() -> None:
    ends = [of_rounded([chaotic(precision)], times(900, 18))[0].ends for precision in (DOUBLE, QUAD)]
    assert ends[1] is None or ends[0] < ends[1]


def test_a_format_without_a_digit_at_the_first_sample_has_no_truth() -> None:
    answer = truth(chaotic(), times(10**4, 2))
    assert "all significant digits of the format are lost at the first sample, t = 5000" in answer


@pytest.mark.slow
def test_the_choice_and_the_text_are_the_same_however_busy_the_machine_is(monkeypatch: pytest.MonkeyPatch) -> None:
    first = found(chaotic(), times(130, 2))
    known_motion.cache_clear()
    monkeypatch.setattr("time.perf_counter", lambda: 0.0)
    monkeypatch.setattr("time.process_time", lambda: 0.0)
    again = found(chaotic(), times(130, 2))
    assert (first.against, first.ends) == (again.against, again.ends)
    costs = [Validated(CHAOTIC, START).cost(Fraction(t), 117) for t in (0, 50, 200, 800)]
    assert costs == sorted(costs)
    assert costs[0] == 0


def test_the_words_of_both_runs_differ_though_their_formats_are_served_by_the_same() -> None:
    (computed,) = of_rounded([chaotic(QUAD)], times(2))
    assert computed.words[1] >= computed.words[0] + truths.MORE_BITS
    assert 0 < computed.radius(Fraction(2)) < Fraction(1, 2**140)


@pytest.mark.slow
def test_what_takes_longer_than_anyone_waits_has_no_truth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(validated, "seconds_a_step", lambda *_: 1e9)
    monkeypatch.setattr(truths, "EFFORT", 0.005)
    problem = chaotic(real(300))
    with pytest.raises(OutOfReach, match="stopped at the step limit"):
        of_rounded([problem], times(200, 2))
    assert "stopped at the step limit" in truth(problem, times(200, 2))


@pytest.mark.parametrize(("precision", "horizon"), [(DOUBLE, 10**4), (DOUBLE, -(10**8)), (DOUBLE, 10**40)])
def test_one_late_sample_is_not_computed_where_no_digit_is_left_on_the_way(
    precision: Precision, horizon: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor one that would take longer than its effort: neither costs more than the first steps tell."""
    steps = 0

    def counted(problem, targets, step_limit):
        nonlocal steps
        run = integrate_to_samples(problem, targets, step_limit=step_limit)
        steps += run.steps
        return run

    monkeypatch.setattr(motions, "integrate_to_samples", counted)
    answer = truth(chaotic(precision), [Fraction(horizon)])
    assert isinstance(answer, str)
    far = abs(horizon) > 10**20
    too_late = "all significant digits of the format are lost at"
    assert ("takes too long: its first 1000 steps end at" if far else too_late) in answer
    assert ".;" not in answer
    assert not answer.endswith(".")
    assert steps < 60_000


def test_the_first_steps_forecast_a_run_up_to_its_effort_and_not_beyond(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truths, "_PILOT_STEPS", 20)
    monkeypatch.setattr(truths, "seconds_a_step", lambda bits: 1.0)
    monkeypatch.setattr(truths, "EFFORT", 40.0)

    reached = integrate_to_samples(chaotic(real(84)), [number(Fraction(10**6), real(84))], step_limit=20).time_reached
    for beyond, says in ((Fraction(0), "stopped at the step limit"), (Fraction(1, 2**20), "takes too long")):
        at = exact(number(2 * reached * (1 + beyond), real(84)))
        with pytest.raises(OutOfReach, match=says):
            truths.compute([chaotic], [at], 84)


def test_runs_that_agree_to_the_last_bit_are_off_by_a_rounding_of_the_coarser() -> None:
    state = [Fraction(n, 8) for n in (1, -5, 3, 2, 0, -1)]
    for bits in (60, 100):
        balls = truths._balls_by_vector(state, [*state[:5], Fraction(-9, 8)], bits)
        found = [radius(ball) * 2**bits for ball in balls]
        assert all(Fraction(5, 8) <= each < Fraction(6, 8) for each in found[:3])
        assert all(2**bits < each < 2**bits * (1 + Fraction(1, 2**28)) for each in found[3:])


def test_what_is_uncertain_by_more_than_a_part_of_the_largest_is_beyond() -> None:
    balls = {
        Fraction(t): [arb(size, wide)] * 3 + [arb(1, "1e-20")] * 3
        for t, size, wide in ((1, 1, "1e-9"), (2, 10, "2e-8"))
    }
    found = ComputedReference((106, 138), balls)
    assert [found.beyond(Fraction(part)) for part in ("9e-11", "11e-11", "21e-10")] == [{1, 2}, {2}, set()]
