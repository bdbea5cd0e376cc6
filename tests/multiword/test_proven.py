"""The proven bound of coefficients in words, attacked with exact integers."""

import pickle
from fractions import Fraction
from random import Random

import numpy
import pytest

from heavytop.exact.enclosure.run import ScaledMotion
from heavytop.exact.enclosure.step import lacking
from heavytop.multiword.codegen.machine_code import doubles, pointer
from heavytop.multiword.codegen.recurrence import LEFT, RIGHT
from heavytop.multiword.fixed_point import arithmetic, certified_series
from heavytop.multiword.fixed_point.arithmetic import Grid, grid_of
from heavytop.multiword.fixed_point.certified_series import CertifiedSeries
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters
from support.helpers import moments_of_a_body, rotor


def some_motion(random: Random, system=HEAVY_TOP, attitude: bool = False, decades: int = 0) -> ScaledMotion:
    """A top that a rigid body can have, with speeds and weights over so many decades."""

    def size() -> Fraction:
        return Fraction(10) ** random.randint(-decades, decades)

    moments = moments_of_a_body(random)
    weight, speed = size(), size()
    p = Parameters(
        moments,
        tuple(weight * Fraction(random.randint(-4096, 4096), 4096) for _ in range(3)),
        rotor(system, lambda: speed * Fraction(random.randint(-99, 99), 70)),
    )
    y = [speed * Fraction(random.randint(-7000, 7000), 4096) for _ in range(3)]
    y += [Fraction(random.randint(-2300, 2300), 4096) for _ in range(6 if attitude else 3)]
    return ScaledMotion.of(system, p, tuple(y), random.random() < 0.5)


def extreme_centre(random: Random, grid: Grid, size: int) -> list[int]:
    """|ω| = 4 and |γ| = √3, as large as they come, with every word as large too, all of one sign or alternating."""
    found = []
    for axis in range(size):
        first = random.choice([-1, 1]) * int(2.0**grid.bits * (2.309 if axis < 3 else 0.999))
        alternating = random.random() < 0.5
        value = first
        for k in range(1, grid.words):
            sign = -1 if alternating and k % 2 else 1
            value = (value << grid.bits) + sign * ((1 << (grid.bits - 1)) - 1)
        found.append(value)
    return found


def rounded(motion: ScaledMotion, grid: Grid) -> list[int]:
    return [round(value * 2**grid.total) for value in motion.scaled.state]


def used(motion: ScaledMotion, certified: CertifiedSeries, centre: list[int], halvings: int) -> float | None:
    """How much of the bound is used; None where there is no series."""
    series = certified.series(centre, halvings)
    if series is None:
        return None
    true = lacking(motion.field, series, certified.grid.total, halvings)
    assert [sum(component) for component in series.values] == list(series.total)
    assert [component[0] for component in series.values] == centre
    for n, column in enumerate(zip(*series.values, strict=True)):
        assert max(map(abs, column)) <= Fraction(series.sizes[n]) * 2**certified.grid.total
    return float(sum(true) / Fraction(series.rounding))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "system", "attitude"),
    [
        (3, HEAVY_TOP, False),
        (4, GYROSTAT, False),
        (6, HEAVY_GYROSTAT, True),
        (12, HEAVY_GYROSTAT, False),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_what_coefficients_lack_is_within_the_bound(words: int, system, attitude: bool) -> None:
    random, grid = Random(words), grid_of(words, whole=True)
    shares = []
    for _ in range(6):
        motion = some_motion(random, system, attitude, decades=random.choice([0, 3, 100]))
        assert motion.in_words
        certified = CertifiedSeries(motion.scaled, grid, motion.forwards)
        for centre in (rounded(motion, grid), extreme_centre(random, grid, len(motion.scaled.state))):
            for halvings in range(8):
                share = used(motion, certified, centre, halvings)
                if share is not None:
                    shares.append(share)
                    break
    assert len(shares) == 12
    assert 1e-5 < max(shares) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("words", [3, 12])
def test_coefficients_that_are_smaller_than_the_state_by_several_words(words: int) -> None:
    """Near an equilibrium, near a permanent rotation, and with moments that hardly differ."""
    grid, e_x = grid_of(words, whole=True), (Fraction(1), Fraction(0), Fraction(0))
    for digits in (12, 16, 30, 40, 90, 140):
        off = Fraction(1, 10**digits)
        for moments, moment, state in (
            ((3, 2, 1), e_x, (0, off, 0, *e_x)),
            ((3, 2, 1), e_x, (1, off, -off, *e_x)),
            ((3, 2, 1), (off, 0, 0), (1, 0, 0, *e_x)),
            ((2 + off, 2, 2 - off), (0, 0, 0), (1, Fraction(1, 3), Fraction(2, 3), *e_x)),
        ):
            p = Parameters(tuple(map(Fraction, moments)), tuple(map(Fraction, moment)), Fraction(0))
            motion = ScaledMotion.of(HEAVY_TOP, p, tuple(map(Fraction, state)), True)
            certified = CertifiedSeries(motion.scaled, grid, True)
            for halvings in (2, 5):
                share = used(motion, certified, rounded(motion, grid), halvings)
                assert share is None or share <= 1


@pytest.mark.slow
@pytest.mark.parametrize("words", [3, 12])
def test_the_bound_is_the_theorem_in_exact_numbers(words: int) -> None:
    """ε(T) with all words as wide as b bits, and (2) summed over the orders."""
    grid, orders = grid_of(words, whole=True), 40
    wide = [Fraction(2) ** grid.bits] * words
    ulp = [Fraction(2) ** (grid.bits * (words - 1 - k)) for k in range(words)]
    last = Fraction(2) ** (grid.bits * words)
    m = {(i, j): wide[i] * wide[j] * ulp[i] * ulp[j] / last for i in range(words) for j in range(words)}
    kept, dropped = (sum(v for (i, j), v in m.items() if (i + j >= words) is off) for off in (False, True))
    level = sum(v for (i, j), v in m.items() if i + j == words - 1)
    assert kept > level
    column = numpy.full((words, 1), 2.0**grid.bits)
    each, once = certified_series._error(grid, certified_series._levels(grid, column, column)[1], orders)
    largest = Fraction(3, 2) * 2**52 + orders * (level + words * 2**grid.bits)
    rounding = largest / 2**53
    for terms in (1, orders):
        assert each * terms + once >= terms * ((words + 1) * rounding + dropped) + rounding
    motion = some_motion(Random(2))
    certified = CertifiedSeries(motion.scaled, grid, True)
    widest, added = numpy.zeros((2, words, 8)), numpy.zeros((1, words, 8))
    each, once = certified_series._error(grid, numpy.zeros(2 * words - 1), orders)
    for scale in (0.0, 2.0**20):
        sums = [
            Fraction(scale) * (2 * Fraction(each * n + once) + Fraction(certified._of_constants[0]))
            for n in range(1, 41)
        ]
        total = sum((part + Fraction(1, 2)) / n + Fraction(3, 4) for n, part in enumerate(sums, 1))
        assert total <= Fraction(certified.bound(widest, added, orders, scale)) <= 2 * total


def test_sums_have_room_for_the_largest_products_between_two_looks() -> None:
    """(1): four products of 2^50 units are one too many."""
    grid = grid_of(3, whole=True)
    certified = CertifiedSeries(some_motion(Random(2)).scaled, grid, True)
    for share, fine in ((1 - 2.0**-10, True), (1.0, False)):
        widest, added = numpy.zeros((2, 3, 8)), numpy.zeros((1, 3, 8))
        widest[0, 0], widest[1, 0] = (2.0 ** (48 - grid.bits) * part for part in (1.0, 2.0 ** (grid.bits - 46) * share))
        assert (certified.bound(widest, added, 2, 1.0) is not None) is fine
    # and the sum of all coefficients stays exact
    for share, fine in ((0.5, True), (2.0, False)):
        added = numpy.zeros((1, 3, 8))
        added[0, 0, 5] = share * 2.0 ** (52 - grid.bits)
        assert (certified.bound(numpy.zeros((2, 3, 8)), added, 2, 1.0) is not None) is fine


@pytest.mark.parametrize(("words", "vectors"), [(3, 1), (4, 2), (24, 1), (45, 2)])
def test_how_large_words_are_is_measured_on_the_words_themselves(words: int, vectors: int) -> None:
    """y as the lanes give it, from random words of y; against sums and maxima of exact fractions."""
    random, grid, orders = numpy.random.default_rng(words), grid_of(words, whole=True), 5
    units = numpy.array([grid.unit(k) for k in range(words)])[:, None]
    places = [Fraction(1, 2 ** (grid.bits * (k + 1))) / Fraction(grid.unit(k)) for k in range(words)]
    y = numpy.rint(random.normal(0, 2.0 ** (grid.bits - 2), (orders + 1, vectors, words, 8))) * units
    y[..., 6:] = 0
    right, *left = (
        y[:, v][..., list(which.first)] + which.sign * y[:, v][..., list(which.second)]
        for v, which in [(0, RIGHT), *((v, LEFT) for v in range(vectors))]
    )
    rows = doubles((orders + 1) * (1 + vectors) * words * 8)
    table = rows.reshape(orders + 1, 1 + vectors, words, 8)
    table[:] = numpy.stack([right, *left], axis=1)
    found = [doubles(8 * count) for count in (*[vectors * (orders + 1)] * 3, (1 + vectors) * words, vectors * words)]
    arithmetic.machine(grid, vectors).functions["extents"](pointer(rows), orders, *map(pointer, found))
    values, sizes, behind, widest, added = (array.reshape(-1, 8) for array in found)
    assert (widest.reshape(table.shape[1:]) == numpy.abs(table).max(axis=0)).all()
    for n, block in enumerate(y.reshape(-1, words, 8)):
        for lane in range(8):
            exactly = [Fraction(float(word)) * place for word, place in zip(block[:, lane], places, strict=True)]
            size = sum(map(abs, exactly))
            if grid.relative:
                far = sum(map(abs, exactly[arithmetic.FIRST_BEHIND :]))
                shown = Fraction(float(behind[n, lane])) / 2 ** (grid.bits * (arithmetic.FIRST_BEHIND + 1))
                assert abs(shown - far) <= far / 2**46
            assert abs(Fraction(float(values[n, lane])) - sum(exactly)) <= size / 2**50
            assert abs(Fraction(float(sizes[n, lane])) - size) <= size / 2**48
    for index, each in enumerate(y.transpose(1, 2, 3, 0).reshape(-1, orders + 1)):
        total = sum(abs(Fraction(float(word))) for word in each)
        assert abs(Fraction(float(added.ravel()[index])) - total) <= total / 2**48


@pytest.mark.slow
@pytest.mark.parametrize(("words", "system", "attitude"), [(3, HEAVY_TOP, False), (6, HEAVY_GYROSTAT, True)])
def test_words_over_their_own_units_are_the_same_numbers(words: int, system, attitude: bool) -> None:
    """What many words are kept as, with few: coefficients, bound and sizes are those of words that are doubles."""
    random, plain = Random(words), grid_of(words, whole=True)
    relative = Grid(words, plain.bits, whole=True, relative=True)
    for _ in range(3):
        motion = some_motion(random, system, attitude)
        series = [CertifiedSeries(motion.scaled, grid, motion.forwards) for grid in (plain, relative)]
        for centre in (rounded(motion, plain), extreme_centre(random, plain, len(motion.scaled.state))):
            one, other = ([each.series(centre, halvings) for halvings in range(2, 9)] for each in series)
            assert any(one)
            for a, b in zip(one, other, strict=True):
                if a is None or b is None:
                    assert a is b
                    continue
                assert a.values == b.values
                assert list(a.total) == list(b.total)
                assert a.nearest.tolist() == b.nearest.tolist()
                assert a.scaled(3).tolist() == pytest.approx(b.scaled(3).tolist(), rel=2.0**-50, abs=2.0**-900)
                assert a.rounding <= b.rounding <= a.rounding * 1.01


@pytest.mark.slow
def test_more_bits_than_the_exponents_of_doubles_reach_are_within_the_bound() -> None:
    """1,204 bits, a coefficient below 2^-1200: its size is bounded at any power."""
    grid, random = grid_of(28, whole=True), Random(28)
    motion = some_motion(random)
    certified = CertifiedSeries(motion.scaled, grid, motion.forwards)
    centre = extreme_centre(random, grid, 6)
    halvings = next(h for h in range(2, 9) if certified.series(centre, h) is not None)
    share = used(motion, certified, centre, halvings)
    assert 1e-6 < share <= 1
    series = certified.series(centre, halvings)
    for n, (column, size) in enumerate(zip(zip(*series.values, strict=True), series.scaled(2), strict=True)):
        largest = max(map(abs, column))
        assert Fraction(largest << 2 * n, 2**grid.total) <= Fraction(size)
        assert Fraction(size) <= 8 * Fraction((largest + 8) << 2 * n, 2**grid.total)
    assert largest < 8


@pytest.mark.slow
def test_words_that_are_too_wide_are_refused_or_within_the_bound() -> None:
    random, refused = Random(3), 0
    for bits in (49, 50, 51):
        grid = Grid(3, bits, whole=True)
        for _ in range(6):
            motion = some_motion(random)
            certified = CertifiedSeries(motion.scaled, grid, motion.forwards)
            for centre in (rounded(motion, grid), extreme_centre(random, grid, 6)):
                share = used(motion, certified, centre, 3)
                refused += share is None
                assert share is None or share <= 1
    assert refused


def test_a_carrier_travels_between_processes() -> None:
    motion, grid = some_motion(Random(6)), grid_of(3, whole=True)
    certified = CertifiedSeries(motion.scaled, grid, True)
    again = pickle.loads(pickle.dumps(certified))
    centre = rounded(motion, grid)
    assert again.series(centre, 4).values == certified.series(centre, 4).values
