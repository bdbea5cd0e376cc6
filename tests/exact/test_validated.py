"""Validated enclosures hold the true motion and are narrow."""

import random
from fractions import Fraction
from time import process_time

import pytest
from flint import arb

from heavytop import GYROSTAT, HEAVY_TOP, HeavyTop, InputError, OutOfReach, State
from heavytop.cases import CASES
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.catalogue import find
from heavytop.exact.enclosure import run
from heavytop.exact.enclosure import step as enclosure
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.enclosure.step import quadratic
from heavytop.exact.flint.balls import midpoint, radius, relative_bits, working_precision
from heavytop.measure.certify import bits_of
from support.helpers import FLIPPED, VECTORS, start_of, top_of
from support.proofs import assert_overlap, assert_solves

BITS_OF_60_DIGITS = 200


def motion(vector, system=HEAVY_TOP):
    return Validated(top_of(vector), start_of(vector), system)


def holds(balls, vector):
    """Each ball and the 60 digits of the vector (within one unit of the last) have a number in common."""
    off = [abs(midpoint(b) - Fraction(x)) for b, x in zip(balls, vector["state"], strict=True)]
    return all(
        o <= radius(b) + Fraction(1, 10**59) * max(1, abs(Fraction(x)))
        for o, b, x in zip(off, balls, vector["state"], strict=True)
    )


@pytest.mark.parametrize("vector", VECTORS, ids=lambda v: v["name"])
def test_every_reference_state_is_inside_its_ball_to_60_digits(vector):
    """Of the enclosure, and of the closed form where there is one."""
    for solution in (motion(vector), find(top_of(vector), start_of(vector))):
        balls = solution.state(Fraction(vector["time"]), BITS_OF_60_DIGITS)
        assert min(map(relative_bits, balls)) >= BITS_OF_60_DIGITS
        assert holds(balls, vector)


@pytest.mark.slow
def test_a_wrong_sign_in_the_field_is_caught_by_the_reference_states():
    balls = motion(VECTORS[0], FLIPPED).state(Fraction(VECTORS[0]["time"]), BITS_OF_60_DIGITS)
    assert not holds(balls, VECTORS[0])


@pytest.mark.parametrize("name", ["generic", "heavy-gyrostat"])
def test_the_series_solves_the_equations_and_starts_at_the_state(name):
    solution, time = Validated(CASES[name].top, CASES[name].start, CASES[name].system), Fraction(5, 3)
    assert_solves(solution, time, length=12)
    assert_overlap([y[0] for y in solution.series(time, 2, 150)], solution.state(time, 150))


def test_taylor_coefficients_of_a_known_motion_obey_the_a_priori_bound():
    rng = random.Random(23)
    for _ in range(5):
        known = DeloneHomoclinic(Fraction(rng.randint(2, 9), 7), Fraction(rng.randint(2, 9), 5))
        p = known.system.parameters(known.top, known.start)
        field = quadratic(lambda y, p=p: HEAVY_TOP.field(p, y), 6)
        size = max(map(abs, known.start.flat))
        bound = enclosure.coefficient_bound(field, size)
        series = Validated(known.top, known.start).series(Fraction(0), 20, 100)
        for y in series:
            for n in range(20):
                assert midpoint(y[n].abs_upper()) <= size * bound**n * (1 + Fraction(1, 10**9))
        # a single step of half the proven radius of convergence, against the closed form
        step = Fraction(1, 2) / bound
        tail = size * Fraction(1, 2) ** 20 * 2 / (1 - Fraction(1, 2)) / 2
        with working_precision(150):
            for y, true in zip(series, known.state(step, 100), strict=True):
                value = sum((y[n] * arb(step.numerator) ** n / arb(step.denominator) ** n for n in range(20)), arb(0))
                assert abs(midpoint(value) - midpoint(true)) <= tail


def test_increasing_times_continue_from_what_is_known():
    solution = motion(VECTORS[0])
    solution.state(Fraction(30), 100)
    before = process_time()
    solution.state(Fraction(30) + Fraction(1, 64), 100)
    assert process_time() - before < 0.1


@pytest.mark.slow
def test_equilibria_cost_nothing_and_are_exact():
    hanging = Validated(HeavyTop((3, 2, 1), 1, (0, 0, 1)), State((0, 0, 2), (0, 0, 1)))
    for ball, value in zip(hanging.state(Fraction(50), 200), (0, 0, 2, 0, 0, 1), strict=True):
        assert ball.contains(value)


def test_attitude_of_a_gamma_off_the_sphere_asks_for_xi():
    off = Validated(HeavyTop((3, 2, 1), 1, (1, 0, 0)), State((1, 0, 0), (0, 0, "1.1")))
    with pytest.raises(InputError, match="not a unit vector"):
        off.attitude(Fraction(1), 60)


@pytest.mark.slow
def test_a_rounded_gyrostat_takes_its_rotor_as_data():
    known = ErshkovPartial(Fraction(1), Fraction(6), Fraction(1))
    exact = Validated(known.top, known.start, GYROSTAT).state(Fraction(1), 150)
    nudged = State((Fraction(1, 2**200), 0, known.start.omega[2]), known.start.gamma)
    with pytest.raises(InputError, match="parallel"):
        Validated(known.top, nudged, GYROSTAT)
    rotor = known.system.parameters(known.top, known.start).rotor
    near = Validated(known.top, nudged, GYROSTAT, rotor=rotor).state(Fraction(1), 150)
    for one, two in zip(exact, near, strict=True):
        assert abs(midpoint(one) - midpoint(two)) < Fraction(1, 2**140)


@pytest.mark.slow
@pytest.mark.parametrize("time", [Fraction(-(10**9)), Fraction(10**30)])
def test_a_horizon_out_of_reach_is_refused_at_once(time):
    vector = VECTORS[0]
    before = process_time()
    with pytest.raises(OutOfReach, match=r"cannot prove a digit at .*\n.*earlier time"):
        motion(vector).state(time, 100)
    assert process_time() - before < 15


def test_too_many_digits_are_refused_with_the_digits_that_could_be_reached():
    with pytest.raises(OutOfReach) as caught:
        motion(VECTORS[0]).state(Fraction(8), 66439)
    digits = int(caught.value.remedy.split()[1])
    assert 100 < digits < 20000


def test_a_motion_that_changes_far_faster_than_it_turns_is_refused():
    for size in ("1e80", "1e1000"):
        top = HeavyTop((1, 1 / Fraction(size), 3), 1, (0, 1, 1))
        with pytest.raises(OutOfReach, match="times its angular velocity"):
            Validated(top, State((1, 1, 0), (0, 0, 1)))


def test_bits_are_given_though_the_forecast_was_too_low(monkeypatch):
    """The schedule of precisions is met at every offset: the last bit asked for counts."""
    monkeypatch.setattr(Validated, "forecast", lambda *_: (-8.0, 20.0))
    solution = motion(VECTORS[0])
    for bits in range(96, 130):
        assert min(map(relative_bits, solution.state(Fraction(3), bits))) >= bits


@pytest.mark.parametrize("effort", [0.2, 0.5, 2, 8])
def test_the_digits_that_a_refusal_offers_are_not_refused(effort):
    top, start = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
    generic, asked = Validated(top, start, effort=effort), 4000
    for _ in range(3):
        with pytest.raises(OutOfReach) as refused:
            generic.state(Fraction(60), bits_of(asked))
        offered = int(refused.value.remedy.split()[1])
        assert 0 < offered < asked
        assert generic.cost(Fraction(60), bits_of(offered)) <= effort
        named = float(refused.value.cause.split("about ")[1].split()[0])
        assert effort < named < 1.3 * Validated(top, start).cost(Fraction(60), bits_of(asked)) + 0.2 * effort
        asked = next(n for n in range(offered, asked + 1) if generic.cost(Fraction(60), bits_of(n)) > effort)


@pytest.mark.parametrize("before", [(), ((Fraction(1), 40),), ((Fraction(20), 300), (Fraction(3), 120))])
def test_where_the_bits_of_the_pilot_do_no_step_is_taken_twice(before, monkeypatch):
    """And the ball is that of a fresh enclosure, whatever was asked before."""
    vector = VECTORS[0]
    solution, fresh, steps = motion(vector), motion(vector).state(Fraction(8), 203), []
    for time, bits in before:
        solution.state(time, bits)

    def counted(field, node, *arguments):
        steps.append(node.time)
        return enclosure.step(field, node, *arguments)

    monkeypatch.setattr(run, "step", counted)
    found = solution.state(Fraction(8), 203)
    assert [(midpoint(b), radius(b)) for b in found] == [(midpoint(b), radius(b)) for b in fresh]
    # the step that covers the time is known to the pilot by its end alone
    assert len(steps) <= len(set(steps)) + 1
