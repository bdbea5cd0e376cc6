"""The truth of every row: proven or computed, and until when."""

from fractions import Fraction

import pytest

from heavytop.errors import OutOfReach
from heavytop.exact import validated
from heavytop.exact.balls import midpoint, radius
from heavytop.exact.ershkov_partial import ErshkovPartial
from heavytop.exact.validated import Validated
from heavytop.integrate.trajectory import Problem
from heavytop.measure import computed_reference
from heavytop.measure import truth as truths
from heavytop.measure.computed_reference import ComputedReference
from heavytop.measure.truth import last_digit, truth
from heavytop.precision import DOUBLE, QUAD, real
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State

CHAOTIC = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
EULER = HeavyTop((3, 2, 1), 0, (0, 0, 1))


def times(horizon, count=8):
    return [Fraction(horizon * k, count) for k in range(1, count + 1)]


def test_the_truth_is_proven_up_to_100_and_beyond_where_that_is_cheap() -> None:
    problem = Problem.of(CHAOTIC, START, DOUBLE)
    for horizon in (30, 120):
        found = truth(problem, times(horizon))
        assert found.against.how == "proven"
        assert found.ends is None
        assert found.against.text.startswith("known: validated")


def test_a_closed_form_is_proven_at_any_time() -> None:
    found = truth(Problem.of(EULER, START, QUAD), times(10**5, 3))
    assert found.against.how == "proven"
    assert "Euler" in found.against.text


def test_the_gyrostat_takes_the_rotor_of_the_problem() -> None:
    """Rounded, γ is no longer parallel to M: the rotor is not that of the rounded start."""
    case = ErshkovPartial(Fraction(1, 3), Fraction(2), Fraction(1))
    problem = Problem.of(case.top, case.start, DOUBLE, GYROSTAT)
    computed, time = ComputedReference.of(problem, times(3), 83), Fraction(3)
    for value, true in zip(computed.state(time), truth(problem, times(3)).state(time), strict=True):
        assert abs(midpoint(value) - midpoint(true)) <= radius(value)


def test_what_is_too_dear_to_prove_is_computed_and_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """With no enclosure allowed beyond 100: the computed one is within its radius of what the enclosure would be."""
    monkeypatch.setattr(truths, "CHEAP", 0.0)
    problem = Problem.of(CHAOTIC, START, DOUBLE)
    found = truth(problem, times(120, 2))
    assert found.against.how == "computed"
    assert found.ends is None
    assert "words of 106 and 138 bits agree within" in found.against.text
    assert "no closed form, and no enclosure beyond" in found.against.text
    proven = Validated(problem.top, problem.start)
    for time in times(120, 2):
        for value, true in zip(found.state(time), proven.state(time, 120), strict=True):
            assert abs(midpoint(value) - midpoint(true)) <= radius(value)
            assert radius(value) < Fraction(1, 2**40)


def test_the_truth_of_a_chaotic_row_ends_where_its_format_has_no_digit_left() -> None:
    problem = Problem.of(CHAOTIC, START, DOUBLE)
    found = truth(problem, times(1200, 12))
    assert found.against.how == "computed"
    assert found.ends is not None
    assert Fraction(200) <= found.ends <= Fraction(600)
    assert f"no digit is left from t = {found.ends} on" in found.against.text
    with pytest.raises(OutOfReach, match=f"from t = {found.ends} on"):
        found.state(Fraction(1200))
    assert found.state(Fraction(100))
    # a run in the format itself is lost there, and was not long before
    own = ComputedReference.of(problem, times(1200, 12), problem.precision.bits)
    amplified = {time: own.radius(time) * Fraction(2) ** (own.accuracy - problem.precision.bits) for time in own.balls}
    assert amplified[found.ends] > Fraction(1, 1000)
    assert amplified[found.ends / 4] < Fraction(1, 10)


def test_more_digits_last_longer() -> None:
    ends = []
    for precision in (DOUBLE, QUAD):
        computed = ComputedReference.of(Problem.of(CHAOTIC, START, precision), times(900, 18), precision.bits + 30)
        ends.append(last_digit(computed, times(900, 18), precision.bits) or Fraction(10**9))
    assert ends[0] < ends[1]


def test_the_choice_and_the_text_are_the_same_however_busy_the_machine_is(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = Problem.of(CHAOTIC, START, DOUBLE)
    first = truth(problem, times(130, 2))
    monkeypatch.setattr("time.perf_counter", lambda: 0.0)
    monkeypatch.setattr("time.process_time", lambda: 0.0)
    again = truth(problem, times(130, 2))
    assert (first.against, first.ends) == (again.against, again.ends)
    costs = [Validated(CHAOTIC, START).cost(Fraction(t), 117) for t in (0, 50, 200, 800)]
    assert costs == sorted(costs)
    assert costs[0] == 0


def test_the_words_of_both_runs_differ_though_their_formats_are_served_by_the_same() -> None:
    computed = ComputedReference.of(Problem.of(CHAOTIC, START, QUAD), times(2), 143)
    assert computed.words[1] >= computed.words[0] + computed_reference.MORE_BITS
    assert 0 < computed.radius(Fraction(2)) < Fraction(1, 2**140)


def test_what_takes_longer_than_anyone_waits_is_out_of_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(validated, "_seconds_a_step", lambda *_: 1e9)
    monkeypatch.setattr(computed_reference, "EFFORT", 0.3)
    with pytest.raises(OutOfReach):
        truth(Problem.of(CHAOTIC, START, real(1000)), times(200, 2))
