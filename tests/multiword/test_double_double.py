"""Double-double steps: the same bits on every processor, n0 that follows the motion, elementary functions by bits."""

import math
from fractions import Fraction
from random import Random

import numpy
import pytest

from heavytop.multiword.codegen.machine_code import DOUBLE, POINTER, doubles, pointer
from heavytop.multiword.double_double import steps as dd
from heavytop.multiword.double_double.arithmetic import by_constant, log2, power_of_two, split, split_constant
from heavytop.multiword.double_double.double_double_run import Floating, OrderSchedule
from heavytop.multiword.double_double.eight_lane_run import Eight
from heavytop.multiword.problem import Scaled, Status
from heavytop.top.equations import HEAVY_TOP, Parameters
from support.words_helpers import machine_of, problem

LADDER = OrderSchedule.of(Fraction(1, 2**105))


@pytest.mark.slow
def test_simple_fractions_round_without_a_bias() -> None:
    """y_1 of a free body with A = −3/4, 5/6, −2/9, alone and in lanes: its relative errors average out.

    Two words of 5/6 and −2/9 are off by 0.2 and 0.25 × 2^-106.
    """
    zero, states = (Fraction(0),) * 3, 1500
    p = Parameters((Fraction(2), Fraction(3), Fraction(9, 2)), zero, Fraction(0))
    y = tuple(Fraction(n, 32) for n in (-22, -4, 21, 3, 17, -25))
    scaled = Scaled.of(HEAVY_TOP, p, y)
    alone, lanes = Floating(scaled, LADDER, True), Eight(HEAVY_TOP, LADDER, LADDER.order - 1)
    lanes.put(0, scaled, True, None)
    lanes.aim(0, Fraction(10**9))
    errors: list[list[float]] = []
    for _ in range(states):
        began = alone.time
        assert alone.advance(Fraction(10**9), 1) is Status.OK
        lanes.advance(1)
        row: list[float] = []
        for before, found in (
            (alone.coefficients(0), [value / (alone.time - began) for value in alone.coefficients(1)]),
            (lanes.coefficients(0, 0), lanes.coefficients(0, 1)),
        ):
            exact = HEAVY_TOP.field(p, before)
            row += [float((a - b) / b * 2**106) for a, b in zip(found[:3], exact[:3], strict=True)]
        errors.append(row)
    mean, deviation = numpy.mean(errors, axis=0), numpy.std(errors, axis=0)
    assert (deviation > 0.1).all()
    assert (abs(mean) < 0.08).all()


@pytest.mark.slow
def test_a_constant_times_a_number_has_the_nearest_high_word() -> None:
    """Not the nearest to the product with the constant's first word: its remainders are not symmetric about 0."""

    def write(_, code) -> None:
        given, factor, result = code.arguments
        constant, number = ([code.load(base, 8 * k) for k in range(3)] for base in (given, factor))
        words = by_constant(code, (constant[0], constant[1], constant[2]), (number[0], number[1]))
        for k, word in enumerate(words):
            code.store(word, result, 8 * k)

    machine = machine_of(write, [POINTER] * 3)
    random, unit = Random(1), 2.0**-53
    for c in (Fraction(text) for text in ("2/5", "-3/20", "5/6", "1/3", "-3/7", "4/9", "17/21", "1/2")):
        constants, found = doubles(24), doubles(16)
        for k, word in enumerate(split_constant(c)):
            constants[8 * k : 8 * k + 8] = word
        for _ in range(200):
            numbers = doubles(24)
            numbers[:8] = [random.uniform(-1, 1) for _ in range(8)]
            numbers[8:16] = [random.uniform(-unit, unit) * abs(high) / 2 for high in numbers[:8]]
            machine.functions["f"](pointer(constants), pointer(numbers), pointer(found))
            for a, low, high, rest in zip(numbers[:8], numbers[8:16], found[:8], found[8:], strict=True):
                whole = c * (Fraction(a) + Fraction(low))
                assert high == float(c * Fraction(a))
                assert abs(Fraction(high) + Fraction(rest) - whole) <= abs(whole) / 2**105


def test_more_orders_are_kept_in_double_double_where_the_spin_is_fast() -> None:
    schedule = OrderSchedule.of(Fraction(1, 10**20))
    slow, fast = Floating(problem(), schedule, True), Floating(problem(20), schedule, True)
    for run in (slow, fast):
        run.advance(Fraction(20), 10**6)
    assert slow.counts[dd.USED] < fast.counts[dd.USED]


def test_n0_rises_within_one_step_to_what_the_motion_needs() -> None:
    """Begun with nearly every order in plain doubles, the first step that stands is as good as any."""
    schedule = OrderSchedule.of(Fraction(1, 10**25))
    careful, careless = (Floating(problem(), schedule, True, low_order=n) for n in (None, 2))
    for run in (careful, careless):
        run.advance(Fraction(1, 2**30), 1)
        assert run.steps == 1
    assert careless.time == careful.time
    off = max(abs(a - b) for a, b in zip(careful.state, careless.state, strict=True))
    assert off < Fraction(1, 10**27)


def test_steps_add_to_the_time_exactly() -> None:
    run, total = Floating(problem(), LADDER, True), Fraction(0)
    for _ in range(50):
        before = run.time
        run.advance(Fraction(10**6), 1)
        step = run.time - before
        assert step.numerator.bit_length() <= 20  # so that every time is two words
        total += step
    assert run.time == total


def test_a_state_that_is_not_finite_stops_the_run() -> None:
    run = Floating(problem(), LADDER, True)
    run.words[1] = math.nan
    assert run.advance(Fraction(10), 100) is Status.NON_FINITE
    assert run.steps == 0
    assert run.time == 0


def test_logarithm_and_power_are_good_to_a_thousandth() -> None:
    logarithm = machine_of(lambda _, code: log2(code.arguments[0]), [DOUBLE], DOUBLE)
    exponential = machine_of(lambda _, code: power_of_two(code, code.arguments[0], 6, 10), [DOUBLE], DOUBLE)
    log, power = logarithm.functions["f"], exponential.functions["f"]
    for x in numpy.geomspace(1e-300, 1e300, 4001):
        assert abs(log(x) - math.log2(x)) < 1e-3
    for y in numpy.linspace(-890, 5.99, 4001):
        value = power(y)
        assert abs(value / 2**y - 1) < 3e-3
        assert Fraction(value).numerator.bit_length() <= 10
    assert power(1e9) == power(math.inf) == 64.0
    assert power(-1e9) == 2.0**-900
    assert log(0.0) == -1023


def test_numbers_of_106_bits_are_split_exactly() -> None:
    for value in (Fraction(2**106 - 1, 2**50), Fraction(-(2**105) - 1), Fraction(3, 2**200)):
        assert sum(map(Fraction, split(value))) == value
