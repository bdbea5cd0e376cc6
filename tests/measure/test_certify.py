"""Certificates: two sources, the digits on which they agree, and faults that must be caught."""

import json
from fractions import Fraction

import msgspec
import pytest
from flint import arb

from heavytop import GYROSTAT, Contradiction, HeavyTop, InputError, OutOfReach, State
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.cases.euler import Euler
from heavytop.exact.cases.kovalevskaya import Kovalevskaya
from heavytop.exact.closed_form import Renamed
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint, radius, working_precision
from heavytop.measure.certify import _digits, agreed_digits, certify
from heavytop.measure.reference import reference
from heavytop.measure.scalar import GUARD_BITS
from heavytop.measure.truth import certified
from support.helpers import VECTORS, start_of, top_of
from support.proofs import Changed

KNOWN = [DeloneHomoclinic(Fraction(1), Fraction(1)), ErshkovPartial(Fraction(1), Fraction(6), Fraction(1))]


def shifted(known, error, after=5):
    """A closed form that is wrong by ``error`` in its second component after a time."""
    return Changed(known, lambda values, time: [values[0], values[1] + error * (abs(time) > after), *values[2:]])


def blurred(known, radius, until=None):
    """A motion known within ``radius``, at all times or up to one."""
    wide = arb(0, radius)
    return Changed(known, lambda balls, t: [b + wide for b in balls] if not until or 0 < abs(t) <= until else balls)


def fixed(middle, radius, scale=-100):
    """Six equal balls, of integers times 2^scale."""
    return [arb((middle, scale), (radius, scale))] * 6


@pytest.mark.slow
@pytest.mark.parametrize("known", KNOWN, ids=lambda k: k.system.name)
@pytest.mark.parametrize("time", [Fraction(-7, 3), Fraction(8)])
def test_closed_forms_are_certified_by_validated_integration(known, time):
    certificate = certify(known, time, 60)
    assert certificate.kind == "proven"
    assert certificate.second_source == "validated integration"
    assert certificate.agreed_digits >= 60


@pytest.mark.parametrize("known", KNOWN, ids=lambda k: k.system.name)
def test_far_times_are_certified_at_both_ends(known):
    certificate = certify(known, Fraction(10**6), 50)
    assert "from t - 1 to t; first integrals" in certificate.second_source
    assert certificate.kind == "proven at both ends"
    assert certificate.agreed_digits >= 50


KOVALEVSKAYA = Kovalevskaya(
    HeavyTop((2, 2, 1), 1, ("3/5", "1/3", 0)), State(("1/3", "4/5", "-7/10"), ("2/7", "3/7", "6/7"))
)


@pytest.mark.slow
@pytest.mark.parametrize("known", [KOVALEVSKAYA, Renamed(KOVALEVSKAYA, (2, 0, 1))], ids=["as it is", "renamed"])
def test_a_second_closed_form_certifies_far_times_at_the_time_itself(known):
    certificate = certify(known, Fraction(10**6), 50)
    assert certificate.second_source.endswith("first integrals at t; a second closed form at t")
    assert certificate.kind == "proven"
    assert certificate.agreed_digits >= 50


def test_a_second_closed_form_that_excludes_the_first_is_a_contradiction():
    wrong = shifted(KOVALEVSKAYA, 0)
    wrong.second_state = shifted(KOVALEVSKAYA, arb("1e-40")).state
    with pytest.raises(Contradiction, match="its second closed form contradict each other at t = 1e\\+06"):
        certify(wrong, Fraction(10**6), 50)


def test_a_wrong_closed_form_is_refused():
    with pytest.raises(Contradiction, match="contradict each other at t = 8: component 2 differs at digit 29"):
        certify(shifted(KNOWN[0], arb("1e-30")), Fraction(8), 50)
    with pytest.raises(Contradiction, match="contradict each other"):
        certified(shifted(KNOWN[0], arb("1e-17")), Fraction(8), 117)


def test_a_formula_wrong_only_far_away_loses_its_digits():
    certificate = certify(shifted(KNOWN[0], arb("1e-20"), 10**5), Fraction(10**6), 50)
    assert 18 <= certificate.agreed_digits <= 20


def test_validated_stands_on_its_own_proof():
    top, start = HeavyTop((3, 2, 1), 1, (1, 0, 0)), State((0, 0, 1), (0, 0, 1))
    certificate = certify(Validated(top, start), Fraction(1), 40)
    assert certificate.kind == "proven"
    assert certificate.agreed_digits >= 40


def test_agreement_counts_the_radii():
    with working_precision(200):
        assert agreed_digits([arb(1)], [arb(1, "1e-12")]) in (11, 12)
        assert agreed_digits([arb(100)], [arb(101)]) == 2
        assert agreed_digits([arb(0)], [arb(5)]) == 0


def test_reference_has_the_keys_that_scripts_rely_on_and_holds_the_reference_states():
    vector = VECTORS[0]
    record = reference(top_of(vector), start_of(vector), ["1/3", vector["time"]], 60)
    document = json.loads(msgspec.json.encode(record))
    assert {"method", "digits", "times", "states"} <= set(document)
    assert document["times"] == ["1/3", "8"]
    for ball, value in zip(document["states"][1], vector["state"], strict=True):
        assert abs(Fraction(ball["value"]) - Fraction(value)) <= Fraction(ball["radius"]) + Fraction(1, 10**59)
        assert Fraction(ball["radius"]) < Fraction(1, 10**59)


def test_reference_serves_the_gyrostat():
    known = KNOWN[1]
    record = reference(known.top, known.start, ["-1/2"], 40, GYROSTAT)
    for ball, value in zip(record.states[0], known.state(Fraction(-1, 2), 160), strict=True):
        assert abs(Fraction(ball.value) - midpoint(value)) <= Fraction(ball.radius) + radius(value)


TURNING = Euler(HeavyTop((3, 2, 1), 1, (0, 0, 0)), State((1, "1/2", "-1/3"), ("2/3", "-1/3", "2/3")))


# too fast by a part of 10^-30 after t = 5: its first integrals are right throughout
LATE = Changed(TURNING, lambda v, t: TURNING.state(t * (1 + Fraction(1, 10**30)), 400) if abs(t) > 5 else v)


@pytest.mark.parametrize(
    ("solution", "least", "most"), [(TURNING, 50, 99), (LATE, 25, 31), (blurred(TURNING, 1e-25, 5), 23, 25)]
)
def test_each_end_counts_where_the_middle_is_out_of_reach(solution, least, most):
    certificate = certify(solution, Fraction(10**6), 50)
    assert certificate.kind == "proven at both ends"
    assert least <= certificate.agreed_digits <= most


def test_a_motion_scores_only_what_has_three_digits_less_than_it():
    """In double precision, of 15 whole digits: 18 are needed."""
    assert certified(blurred(TURNING, 9e-19), Fraction(1), 53 + GUARD_BITS) is not None
    assert certified(blurred(TURNING, 1.1e-18), Fraction(1), 53 + GUARD_BITS) is None


@pytest.mark.parametrize("middle", [0, 1 << 90])
def test_balls_that_just_touch_agree_and_balls_just_apart_contradict(middle):
    def always(middle, radius):
        return Changed(KNOWN[0], lambda *_: fixed(middle, radius))

    one = always(middle, 1000)
    for sign in (1, -1):
        certify(one, Fraction(1), 20, enclosure=always(middle + sign * 3000, 2000))
        with pytest.raises(Contradiction, match="component 1"):
            certify(one, Fraction(1), 20, enclosure=always(middle + sign * 3001, 2000))


@pytest.mark.parametrize(
    ("first", "second"), [((3 << 98, 7), ((3 << 98) + 900, 50)), ((-(1 << 110), 7), (12 - (1 << 110), 0))]
)
def test_agreed_digits_are_those_of_the_farthest_points_of_two_balls(first, second):
    apart = Fraction(abs(first[0] - second[0]) + first[1] + second[1], 2**100)
    size = max(Fraction(1), Fraction(abs(first[0]), 2**100))
    digits = agreed_digits(fixed(*first), fixed(*second))
    assert Fraction(1, 10 ** (digits + 1)) < apart / size <= Fraction(1, 10**digits)


def test_digits_of_a_gap_are_exact_at_powers_of_ten():
    for digits in (0, 1, 2, 17, 40, 1000):
        for gap, found in (
            (Fraction(1, 10**digits), digits),
            (Fraction(1, 10**digits) * (1 + Fraction(1, 10**9)), digits - 1),
        ):
            assert _digits(gap) == max(0, found)


@pytest.mark.parametrize(("middle", "wide", "narrow"), [("100", "1e-28", "0.9e-28"), ("0", "1.01e-30", "0.99e-30")])
def test_a_radius_beyond_the_digits_promised_is_not_printed(middle, wide, narrow):
    def asked(radius):
        wide = Changed(KNOWN[0], lambda *_: [arb(middle, radius), *[arb(0)] * 5], "too wide")
        return reference(KNOWN[0].top, KNOWN[0].start, ["1"], 30, finder=lambda *_: wide)

    assert Fraction(asked(narrow).states[0][0].radius) >= Fraction(narrow)
    with pytest.raises(OutOfReach, match="not to 30 digits, by too wide"):
        asked(wide)


@pytest.mark.slow
def test_more_digits_than_python_reads_at_once_are_printed():
    record = reference(KNOWN[0].top, KNOWN[0].start, [Fraction(1, 10**5000), 1], 5000)
    assert record.times == ["1/1" + 5000 * "0", "1"]
    assert all(4990 < len(ball.value.lstrip("-0.")) <= 5002 for ball in record.states[1])


@pytest.mark.parametrize("digits", [0, -1, 20001])
def test_digits_outside_the_range_are_bad_input(digits):
    with pytest.raises(InputError, match="1 to 20000"):
        reference(KNOWN[0].top, KNOWN[0].start, ["1"], digits)


@pytest.mark.parametrize("time", ["nan", "inf", "1/0", "soon"])
def test_times_that_are_no_finite_rationals_are_bad_input(time):
    with pytest.raises(InputError):
        reference(KNOWN[0].top, KNOWN[0].start, [time], 30)
