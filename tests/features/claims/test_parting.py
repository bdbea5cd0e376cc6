"""When claim and truth are 1 % of α apart: proven, first, the same at every scale, and on each branch its own."""

from fractions import Fraction
from itertools import pairwise

import pytest

from heavytop.errors import OutOfReach
from heavytop.features.claims import claim_error as module
from heavytop.features.claims.claim_error import CLOSE, PARTED, divergence_time, exact_claim, true_solution
from heavytop.features.claims.library.ershkov import PartialCase
from heavytop.precision import exact
from support.reports import measure, tasks_of

HORIZON = Fraction(2)
KNOWN = [(2, "smooth", 1, "0.2014"), (2, "printed", 1, "0.0100"), (2, "printed", -1, "0.2014")]
KNOWN += [(6, "smooth", -1, "0.0231"), (6, "printed", 1, "0.0020"), (Fraction(3, 2), "smooth", 1, "0.4719")]


def case(ratio, alpha=Fraction(1), i1=Fraction(1)) -> PartialCase:
    return PartialCase(alpha, i1, i1 / ratio)


def distance(given: PartialCase, time: Fraction, branch: str) -> Fraction:
    """|ΔΩ|, largest component, of the formulas as they stand in the claim, from the midpoints of 200-bit balls."""
    claimed = exact_claim(given, time, branch, 200).omega
    true = true_solution(given).state(time, 200)[:3]
    man = [(a.mid().man_exp(), b.mid().man_exp()) for a, b in zip(claimed, true, strict=True)]
    parts = [[int(m) * Fraction(2) ** int(e) for m, e in pair] for pair in man]
    return max(abs(a - b) for a, b in parts)


@pytest.mark.parametrize(("ratio", "branch", "sign", "expected"), KNOWN)
def test_the_distance_crosses_the_limit_between_the_two_ends(ratio, branch, sign, expected) -> None:
    given = case(ratio)
    found = divergence_time(given, sign * HORIZON, branch)
    assert f"{float(found.time):.4f}" == expected
    assert 0 < found.after - found.before <= CLOSE * found.before
    ends = [distance(given, sign * time, branch) for time in (found.before, found.after)]
    assert ends[0] < PARTED <= ends[1]


@pytest.mark.parametrize("branch", ["smooth", "printed"])
@pytest.mark.parametrize("ratio", [2, 6])
def test_it_is_the_first_time(ratio, branch) -> None:
    given = case(ratio)
    found = divergence_time(given, HORIZON, branch)
    before = [distance(given, found.before * i / 50, branch) for i in range(1, 51)]
    assert max(before) < PARTED
    # from 0 on it grows, so there is no earlier one between these samples either
    assert all(one < two for one, two in pairwise(before))


@pytest.mark.parametrize(("alpha", "i1"), [("1e-100", "1"), ("1e100", "1e-100"), ("7/3", "1e50")])
def test_time_scales_like_one_over_alpha_and_moments_change_nothing(alpha, i1) -> None:
    alpha, i1 = exact(alpha), exact(i1)
    for ratio in (2, 6):
        one = divergence_time(case(ratio), HORIZON, "smooth")
        other = divergence_time(case(ratio, alpha, i1), HORIZON / alpha, "smooth")
        assert (other.before * alpha, other.after * alpha) == (one.before, one.after)


def test_before_it_nothing_parts_and_the_horizon_itself_counts() -> None:
    found = divergence_time(case(2), HORIZON, "smooth")
    assert divergence_time(case(2), found.before, "smooth") is None
    assert divergence_time(case(2), -found.before, "smooth") is None
    late = divergence_time(case(2), found.after * (1 + CLOSE), "smooth")
    assert abs(late.after - found.after) <= CLOSE * found.after


def test_a_limit_that_is_touched_and_not_passed_is_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    # a claim that parts by less than the limit provably does not; one that is undecidable is refused, not guessed
    monkeypatch.setattr(module._Pair, "reached", lambda *_: False)
    with pytest.raises(OutOfReach, match="differ by only 1 %"):
        divergence_time(case(2), HORIZON, "smooth")


def test_the_slope_between_two_times_is_within_its_bound() -> None:
    pair = module._Pair(case(6), "smooth", backward=False)
    time, step = Fraction(1, 50), Fraction(1, 200)
    bounds = [
        (motion.rates(time, step), [motion.state(time + step * i / 16) for i in range(17)])
        for motion in (pair.truth, pair.claim)
    ]
    for rates, states in bounds:
        for one, two in pairwise(states):
            for rate, a, b in zip(rates, one, two, strict=True):
                assert abs(float((b - a) / (step.numerator) * step.denominator * 16) - float(rate.mid())) <= float(
                    rate.rad()
                )


def test_the_row_does_not_depend_on_the_grid(tmp_path) -> None:
    text = 'name = "p"\n[[measure]]\nkind = "claim_model"\ncases = ["ershkov-partial-2"]\ndirections = ["forward"]\n'
    values = []
    for grid, times in (("1", '["1"]'), ("7", '["1/2", "5"]')):
        rows = [measure(task) for task in tasks_of(tmp_path, f"{text}times = {times}\ngrid = {grid}\n")]
        values.append({row.integrator: row.metrics["claim_parts_by_1_percent_at"].value for row in rows})
    assert values == [{"claim:smooth": "0.201444", "claim:printed": "0.0100002"}] * 2


def test_the_bounds_of_a_motion_are_those_of_its_energy_and_its_step() -> None:
    given = case(6)
    motion = module._Motion(true_solution(given), given)
    (i1, i2, i3), (_, n, _) = given.solves.top.inertia, given.solves.top.moment
    # the kinetic energy is at most C1 + |P b|: γ2 >= −1
    most = 2 * float(given.c1 + n)
    w1, w2, w3 = ((most / float(moment)) ** 0.5 for moment in (i1, i2, i3))
    first = (float(i2 - i3) * w2 * w3 + float(n)) / float(i1)
    expected = [first, float(i1 - i3) * w1 * w3 / float(i2), float(n / i3), w2 + w3, w1 + w3, w1 + w2]
    assert [float(rate) for rate in motion.fastest] == pytest.approx(expected)
    # over a step no component moves by more than that rate times the step
    motion.field = lambda _, box: tuple(box)
    time, step = Fraction(1, 50), Fraction(1, 200)
    for box, value, rate in zip(motion.rates(time, step), motion.state(time), motion.fastest, strict=True):
        assert float((box - value.mid()).abs_upper()) == pytest.approx(float(rate) * float(step), rel=1e-6)
