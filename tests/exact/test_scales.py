"""Numbers of any size: a closed form answers, or says why not, and what it says is right."""

import random
from fractions import Fraction
from itertools import product
from time import process_time

import pytest

from exact.test_every_naming import MOTIONS, in_other_units
from heavytop import GYROSTAT, HEAVY_TOP, HeavyTop, OutOfReach, State
from heavytop.exact.catalogue import find
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, midpoint, radius, unit_of_time, working_precision
from heavytop.measure.certify import bits_of
from heavytop.measure.reference import reference

DIGITS = 50
BITS = bits_of(DIGITS)
TIME = Fraction(7, 3)
DECADES = (-1000, -300, -100, -30, 30, 100, 300, 1000)
SECONDS = 10
UNITS = ((Fraction(2, 3), Fraction(-1, 3), Fraction(2, 3)), (Fraction(3, 5), Fraction(0), Fraction(4, 5)))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "top", "start", "system"), MOTIONS, ids=[m[0] for m in MOTIONS])
def test_other_units_give_the_same_motion(name, top, start, system):
    known = find(top, start, system).state(TIME, BITS + 16)
    for decades in (-1000, 300):
        rate, size = Fraction(10) ** decades, Fraction(10) ** random.Random(decades).choice(DECADES)
        other = find(*in_other_units(top, start, rate, size), system)
        begun = process_time()
        values = other.state(TIME / rate, BITS)
        series = other.series(TIME / rate, 3, BITS)
        assert process_time() - begun < SECONDS
        with working_precision(4 * BITS):
            scales = [ball(rate)] * 3 + [ball(Fraction(1))] * 3
            for value, first, scale, part in zip(values, known, scales, series, strict=True):
                assert value.overlaps(first * scale)
                assert part[0].overlaps(value)
                assert radius(value) <= Fraction(1, 2**BITS) * max(Fraction(1), abs(midpoint(value)) * 2)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "top", "start", "system"), MOTIONS, ids=[m[0] for m in MOTIONS])
def test_any_time_is_answered_or_refused_in_words(name, top, start, system):
    for decades in (-100, 100):
        begun = process_time()
        if name == "generic" and decades > 0:
            with pytest.raises(OutOfReach, match="Validated integration cannot prove"):
                reference(top, start, [Fraction(10) ** decades], DIGITS, system)
        else:
            assert narrow(reference(top, start, [Fraction(10) ** decades], DIGITS, system))
        assert process_time() - begun < SECONDS


def narrow(record):
    return all(
        Fraction(ball.radius) <= Fraction(1, 10**record.digits) * max(Fraction(1), abs(Fraction(ball.value)))
        for state in record.states
        for ball in state
    )


def mixed(rng):
    """Tops whose moments, weight and rates differ by thousands of decades, one of each class that leaves them free."""

    def number():
        size = Fraction(10) ** rng.choice((0, 0, 0, *DECADES))
        return Fraction(rng.randint(1, 20) * rng.choice((-1, 1)), rng.randint(1, 9)) * size

    first, second, third = (abs(number()) for _ in range(3))
    weight, unit = number(), rng.choice(UNITS)
    yield (
        HeavyTop((first, first, second), weight, (0, 0, number())),
        State([number() for _ in range(3)], unit),
        HEAVY_TOP,
    )
    yield HeavyTop((first, second, third), 0, (0, 0, 1)), State([number() for _ in range(3)], unit), HEAVY_TOP
    level = (0, Fraction(3, 5), Fraction(4, 5))
    yield HeavyTop((first, second, third), weight, (0, number(), number())), State((number(), 0, 0), level), HEAVY_TOP
    area, inertia = number(), (first, second, third)
    omega = [area * g / i for g, i in zip(unit, inertia, strict=True)]
    yield HeavyTop(inertia, weight, (0, number(), 0)), State(omega, unit), GYROSTAT
    spin = number()
    steady = (spin, 0, weight * unit[2] / (first * spin))
    yield HeavyTop((2 * first, second, first), weight, (1, 0, 0)), State(steady, unit), HEAVY_TOP
    w, n = ((number(), number()) for _ in range(2))
    gamma = times(times(w, w), (n[0] / (n[0] ** 2 + n[1] ** 2), -n[1] / (n[0] ** 2 + n[1] ** 2)))
    start = State((*w, number()), (first * gamma[0], first * gamma[1], number()))
    yield HeavyTop((2 * first, 2 * first, first), 1, (*n, 0)), start, HEAVY_TOP


def times(a, b):
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 5))
def test_numbers_of_very_different_size_are_answered(seed):
    for top, start, system in mixed(random.Random(seed)):
        begun = process_time()
        assert not isinstance(find(top, start, system), Validated)
        assert narrow(reference(top, start, [TIME, Fraction(-1, 10**30)], DIGITS, system))
        assert process_time() - begun < SECONDS


def test_a_weight_next_to_nothing_moves_next_to_nothing():
    """Against the closed form without a weight, which shares no formula with Lagrange's."""
    start = State(("1/5", "1/3", 2), UNITS[1])
    free = find(HeavyTop((2, 2, 1), 0, (0, 0, 1)), start).state(TIME, BITS)
    for decades in (-60, -300, -1000):
        heavy = find(HeavyTop((2, 2, 1), Fraction(10) ** decades, (0, 0, 1)), start)
        assert "Lagrange" in heavy.method
        for value, other in zip(heavy.state(TIME, BITS), free, strict=True):
            assert abs(midpoint(value) - midpoint(other)) <= radius(value) + radius(other) + Fraction(1, 10**55)


def test_numbers_that_nobody_waits_for_are_refused():
    start = State((1, 2, 3), UNITS[0])
    tiny = Fraction(10) ** -20_000
    for top in (HeavyTop((2, 2, tiny), 1, (0, 0, 1)), HeavyTop((3, 2, 1), tiny, (1, 2, 3))):
        with pytest.raises(OutOfReach, match="at most 32768 bits; got 664"):
            find(top, start)
        with pytest.raises(OutOfReach, match="at most 32768 bits; got 664"):
            Validated(top, start)
    with pytest.raises(OutOfReach, match="at most 32768 bits; got 664"):
        reference(HeavyTop((3, 2, 1), 0, (1, 2, 3)), start, [tiny], DIGITS)


def test_the_unit_of_time_is_that_of_the_fastest_rate():
    for spin, weight in product((-200, -3, 0, 3, 200), repeat=2):
        top = HeavyTop((4, 2, 1), Fraction(4) ** weight, (0, 0, 1))
        start = State((Fraction(2) ** spin, 0, 0), (0, 0, 1))
        p = HEAVY_TOP.parameters(top, start)
        largest = max(spin, weight)
        assert unit_of_time(p, start.flat) == (largest if abs(largest) > 16 else 0)
