"""Digits: sums of products against integers, digits of words, and steps against integers."""

from fractions import Fraction
from random import Random
from typing import Any

import numpy
import pytest

from heavytop.multiword.codegen.machine_code import INT, INT_POINTER, LANES, POINTER, Machine, doubles, pointer
from heavytop.multiword.fixed_point import products
from heavytop.multiword.fixed_point.arithmetic import Grid, exact, grid_of
from heavytop.multiword.fixed_point.fixed_point_run import Fixed
from heavytop.multiword.fixed_point.products import DigitRows, digits_of
from heavytop.multiword.fixed_point.steps import rows_of, size_of
from heavytop.multiword.integers.integer_series import IntegerMotion
from heavytop.multiword.problem import Scaled, Status
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters, System
from support.words_helpers import machine_of

LARGEST = 2**23 + 4


def sums_code(wide: bool) -> Machine:
    """f(left, right, where, orders, levels, sums)."""
    return machine_of(
        lambda module, code: code.call(DigitRows.write_kernels(module, grid_of(8), 0, wide)[0], code.arguments),
        [POINTER, POINTER, INT_POINTER, INT, INT, POINTER],
    )


def known_sums(rows: numpy.ndarray, row: int, orders: int, levels: int) -> list[int]:
    """Σ d_i d'_j of each lane over i + j < levels, in units of the last level, whole."""
    total = [0] * LANES
    pairs = [(row * n, row * (orders - 1 - n)) for n in range(orders)]
    for lane in range(LANES):
        for i in range(levels):
            for j in range(levels - i):
                total[lane] += sum(int(rows[a + i, lane]) * int(rows[b + j, lane]) for a, b in pairs) << (
                    products.BITS * (levels - 1 - i - j)
                )
    return total


def sums_of(machine: Machine, table: numpy.ndarray, row: int, orders: int, levels: int) -> numpy.ndarray:
    """The sums of a table of digits with itself reversed, each level a row."""
    sums, where = doubles(LANES * (levels + 1)), (LANES * row * numpy.arange(orders)).astype(numpy.int64)
    arrays = table.ravel(), table[row * (orders - 1) :].ravel(), where
    machine.functions["f"](*map(pointer, arrays), orders, levels, pointer(sums))
    return sums.reshape(-1, LANES)


def whole(sums: numpy.ndarray, levels: int) -> list[int]:
    return [sum(int(s) << products.BITS * (levels - k) for k, s in enumerate(lane)) for lane in sums.T]


@pytest.mark.slow
@pytest.mark.parametrize("wide", [True, False], ids=["8 by 8", "4 by 4"])
@pytest.mark.parametrize("kind", ["random", "largest", "alternating"])
def test_sums_of_products_are_exact(wide: bool, kind: str) -> None:
    """As integers, for every number of levels up to two tiles and more, with digits as large as they may be."""
    machine, random = sums_code(wide), Random(f"{wide} {kind}")
    for levels in (1, 2, 3, 5, 8, 9, 13, 14, 17, 25):
        orders = random.randint(1, 45)
        row = levels + 1
        table = doubles(LANES * row * orders).reshape(-1, LANES)
        if kind == "random":
            table[:] = [[random.randint(-LARGEST, LARGEST) for _ in range(LANES)] for _ in range(row * orders)]
        else:
            table[:] = LARGEST if kind == "largest" else -LARGEST * (-1) ** numpy.arange(row * orders)[:, None]
        found = sums_of(machine, table, row, orders, levels)
        assert numpy.abs(found).max() < 2.0**products.SUM_BITS
        assert whole(found, levels) == known_sums(table, row, orders, levels)


@pytest.mark.parametrize("words", [8, 13, 24])
def test_what_is_left_out_of_a_sum_is_as_small_as_is_said(words: int) -> None:
    """(J + 1)/4 units of the last word a product, of which the largest digits use more than half."""
    grid = grid_of(words)
    count = digits_of(grid)
    unit = Fraction(2) ** (2 * products._HEAD + grid.total)
    left_out = sum(
        Fraction(LARGEST**2, 2 ** (products.BITS * (i + j + 2))) for i in range(count) for j in range(count - i, count)
    )
    lacking = 2 * Fraction(LARGEST, 2**products.BITS) * Fraction(1, 2 ** (products.BITS * count + 1))
    said = Fraction(count + 1, 4)
    assert (left_out + lacking) * unit <= said
    spare = products.BITS * count - grid.total - products._HEAD - products._BEHIND
    assert (left_out + lacking) * unit * 2**spare > said / 2


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, 4])
def test_with_more_products_in_a_sum_some_would_be_wrong(times: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The number of products is what keeps sums exact: with four times as many, large digits are added up wrongly."""
    monkeypatch.setattr(products, "_PRODUCTS", times * products._PRODUCTS)
    machine, levels, orders = sums_code(True), 8, 60
    table = doubles(LANES * levels * orders).reshape(-1, LANES)
    table[:] = LARGEST - numpy.random.default_rng(1).integers(0, 9, len(table))[:, None]
    found, known = (
        whole(sums_of(machine, table, levels, orders, levels), levels),
        known_sums(table, levels, orders, levels),
    )
    assert (found[0] == known[0]) == (times == 1)


def conversion(grid: Grid, name: str, length: int) -> Machine:
    """f(words, found) for the digits of words, or f(sums, found) for the words of sums."""

    def write(_, code) -> None:
        given, to = code.arguments
        rows = DigitRows(code, grid, 1, 0, *[code.null] * 4, [])
        values = [code.load(given, LANES * k) for k in range(length)]
        for k, value in enumerate(getattr(rows, name)(values)):
            code.store(value, to, LANES * k)

    return machine_of(write, [POINTER, POINTER])


@pytest.mark.slow
@pytest.mark.parametrize("words", [5, 13, 24])
def test_digits_are_those_of_the_words_and_sums_become_words(words: int) -> None:
    grid, random = grid_of(words), Random(words)
    count = digits_of(grid)
    of_words, of_sums = conversion(grid, "_digits", words), conversion(grid, "_words", count + 1)
    last = Fraction(2) ** (products._HEAD - products.BITS * count)
    assert last <= Fraction(2) ** (-grid.total - products._BEHIND)
    for _ in range(40):
        given, found = doubles(LANES * grid.words), doubles(LANES * count)
        for k in range(grid.words):
            most = 2 ** (grid.bits + (3 if k else 5))
            given[LANES * k : LANES * (k + 1)] = [
                random.choice([-most, most, random.randint(-most, most), 1, 0]) * grid.unit(k) for _ in range(LANES)
            ]
        of_words.functions["f"](pointer(given), pointer(found))
        assert numpy.abs(found).max() <= LARGEST
        assert (found == numpy.round(found)).all()
        for lane in range(LANES):
            value = sum(int(d) * last * 2 ** (products.BITS * (count - 1 - j)) for j, d in enumerate(found[lane::8]))
            assert abs(value - exact(given[lane::8])) <= last / 2
    unit = Fraction(2) ** (2 * products._HEAD - products.BITS * (count + 1))
    for _ in range(40):
        given, found = doubles(LANES * (count + 1)), doubles(LANES * grid.words)
        for k in range(1 + count):
            most = 2**products.SUM_BITS if k > 3 else 2**10
            given[LANES * k : LANES * (k + 1)] = [random.randint(-most, most) for _ in range(LANES)]
        of_sums.functions["f"](pointer(given), pointer(found))
        for lane in range(LANES):
            value = sum(int(s) * unit * 2 ** (products.BITS * (count - k)) for k, s in enumerate(given[lane::8]))
            assert abs(value - exact(found[lane::8])) * 2 ** (grid.total + 4) <= 1
            for k in range(grid.words - 1):
                assert (Fraction(found[LANES * k + lane]) * 2 ** (grid.bits * (k + 1))).denominator == 1
                assert k == 0 or abs(found[LANES * k + lane]) <= 2.0 ** (grid.bits + 5) * grid.unit(k)


def scaled(omega: str, gamma: str, moment: str = "1/2 1/3 1/5", system: System = HEAVY_TOP, xi: str = "") -> Scaled:
    omegas, gammas, moments, xis = (tuple(map(Fraction, text.split())) for text in (omega, gamma, moment, xi))
    rotor: Any = Fraction(1, 3) if system is GYROSTAT else Fraction(0)
    if system is HEAVY_GYROSTAT:
        rotor = (Fraction(1, 3), Fraction(-2), Fraction(3, 4))
    return Scaled.of(system, Parameters((Fraction(3), Fraction(2), Fraction(1)), moments, rotor),
                     (*omegas, *gammas, *xis), bounded=True)  # fmt: skip


MOTIONS = {
    "generic": scaled("1/10 1/5 9/10", "3/5 0 4/5"),
    "with an attitude": scaled("1/10 1/5 9/10", "3/5 0 4/5", xi="0 1 0"),
    "gyrostat": scaled("1/10 1/5 9/10", "3/5 0 4/5", "0 0 0", GYROSTAT),
    "heavy gyrostat, attitude": scaled("1/10 1/5 9/10", "3/5 0 4/5", system=HEAVY_GYROSTAT, xi="0 1 0"),
    "from rest: every other order is 0": scaled("0 0 0", "3/5 0 4/5"),
    "an entire function": scaled("0 0 1", "3/5 0 4/5", "0 0 0"),
    "tiny beside a middle axis": scaled(f"1/{2**90} 1 0", "5/8 -3/8 11/16", "0 0 0"),
    "a tiny weight": scaled("1/10 1/5 9/10", "3/5 0 4/5", f"1/{10**30} 0 1/{10**40}"),
    "tiny and then not": scaled(f"1/{2**60} 0 0", f"1/{2**70} 0 1", f"1/{2**50} 0 1"),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "name", "forwards"),
    [(8, name, True) for name in MOTIONS] + [(8, "tiny and then not", False), (13, "with an attitude", False)],
)
def test_steps_are_those_of_whole_numbers(words: int, name: str, forwards: bool) -> None:
    given, grid, span = MOTIONS[name], grid_of(words), Fraction(2 if words == 8 else 1)
    assert rows_of(grid) is DigitRows
    run, known = Fixed(given, grid, forwards), IntegerMotion(given, 64 * (grid.total // 64 + 2), forwards)
    for each in (run, known):
        assert each.advance(span, 10**4) is Status.OK
    assert run.redone == 0 or name == "an entire function"  # which allows any step
    found, truth = run.sample(span), known.sample(span)
    assert max(abs(a - b) for a, b in zip(found, truth, strict=True)) * 2**grid.total < 100


@pytest.mark.slow
@pytest.mark.parametrize("name", MOTIONS)
def test_digits_that_count_as_zero_are(name: str) -> None:
    given, grid = MOTIONS[name], grid_of(8)
    run = Fixed(given, grid, True)
    for _ in range(3):
        assert run.advance(Fraction(10**6), 1) is Status.OK
        count, row = digits_of(grid), size_of(grid, run.vectors).row
        for n in range(run.order + 1):
            digits = run.rows[row * n : row * (n + 1)].reshape(-1, LANES)
            assert not digits[: products._BEFORE].any()
            for side in digits[products._BEFORE :].reshape(1 + run.vectors, count, LANES):
                assert not side[: run.starts[n]].any()
        assert run.starts[: run.order + 1].max() > 0


def test_words_that_are_too_wide_for_the_bounds_are_watched() -> None:
    """The products with the coefficients of the field of words of 46 bits are: see :attr:`Grid.bounded`."""
    for grid in (Grid(8, 46), Grid(8, 44, whole=True), grid_of(4)):
        assert not grid.bounded
        assert rows_of(grid) is not DigitRows
    assert all(grid_of(words).bounded for words in range(5, 25))
