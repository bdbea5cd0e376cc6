"""Fixed grids: products against exact numbers, every overflow caught, the same bits on every processor."""

import math
from collections.abc import Iterator
from fractions import Fraction
from random import Random

import numpy
import pytest

import heavytop as ht
from heavytop.multiword.codegen.machine_code import INT, POINTER, Machine, doubles, once, pointer
from heavytop.multiword.fixed_point import arithmetic, fixed_point_run, steps
from heavytop.multiword.fixed_point.arithmetic import EXPONENT_BITS, Grid, digits, exact, grid_for, grid_of
from heavytop.multiword.fixed_point.fixed_point_run import Fixed
from heavytop.multiword.fixed_point.steps import build, sample_row
from heavytop.multiword.problem import Scaled, Status
from heavytop.top.equations import HEAVY_TOP, Parameters
from support.helpers import moments_of_a_body
from support.words_helpers import machine_of, problem

HORIZON = 2
WRONG_ULP = 1e6


def random_problem(random: Random) -> Scaled:
    """A top that a rigid body can have, |P r| up to 2 and |Ω| up to 3."""
    moments = moments_of_a_body(random)
    weights = tuple(Fraction(random.randint(-4096, 4096), 4096) for _ in range(3))
    omega = [Fraction(random.randint(-7000, 7000), 4096) for _ in range(3)]
    gamma = [Fraction(random.randint(-2300, 2300), 4096) for _ in range(3)]
    p = Parameters(moments, weights, Fraction(0))
    return Scaled.of(HEAVY_TOP, p, (*omega, *gamma), bounded=True)


def test_words_hold_numbers_to_half_a_unit_and_add_up_exactly() -> None:
    random = Random(1)
    for grid in (grid_of(3), grid_of(12), Grid(4, 50)):
        for _ in range(100):
            value = Fraction(random.randint(-(10**30), 10**30), random.randint(1, 10**30)) % 8 - 4
            words = digits(value, grid)
            assert abs(exact(numpy.array(words)) - value) <= Fraction(1, 2 ** (grid.total + 1))
            for k, word in enumerate(words):
                assert (Fraction(word) * 2 ** (grid.bits * (k + 1))).denominator == 1
                assert k == 0 or abs(word) <= grid.unit(k - 1) / 2


_SERVED = [(100, 3, 44), (132, 3, 44), (133, 3, 46), (138, 3, 46), (139, 4, 44), (276, 7, 42), (295, 7, 44)]


@pytest.mark.parametrize(("bits", "words", "width"), [*_SERVED, (528, 12, 44), (1000, 24, 43), (1032, 24, 43)])
def test_the_smallest_grid_that_has_the_bits_is_taken(bits: int, words: int, width: int) -> None:
    assert grid_for(bits) == Grid(words, width)
    assert width <= grid_of(words).bits
    assert grid_for(1033) is None


def product_code(grid: Grid) -> Machine:
    """f(left, right, count, sums, seen) in all K levels."""
    return machine_of(
        lambda module, code: code.call(arithmetic.write_kernels(module, grid, 8 * grid.words)[-1], code.arguments),
        [POINTER, POINTER, INT, POINTER, POINTER],
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "grid", [grid_of(3), grid_of(6), Grid(3, 51), Grid(4, 46, whole=True)], ids=lambda grid: f"{grid.words}x{grid.bits}"
)
@pytest.mark.parametrize("kind", ["random", "largest", "alternating"])
def test_sums_of_products_are_exact_but_for_the_last_level_or_are_caught(grid: Grid, kind: str) -> None:
    """|Σ a b − S| <= n (K + 1) units of the last word, whatever the words; or an exponent bit says that it may not be.

    Proven: every S_k but the last is exact where no bit is set; the products left out have i + j >= K, and each of the
    K of one sum is below (2^(b−1) g)² or half a unit; the K roundings of the last level are half a unit each.
    """
    machine, random = product_code(grid), Random(f"{grid.words} {kind}")
    caught = 0
    for _ in range(15):
        count = random.randint(1, 60)
        bound = Fraction(1) if grid.bits == 51 else Fraction(1, 2)
        rows = [doubles(8 * grid.words * count) for _ in range(2)]
        for row in rows:
            for n in range(count):
                for lane in range(8):
                    if kind == "random":
                        value = bound * random.randint(-(2**200), 2**200) / 2**200 / (n + 1)
                        words = digits(value, grid)
                    else:
                        sign = -1 if kind == "alternating" and (n + lane) % 2 else 1
                        words = [sign * grid.unit(k) * (2.0 ** (grid.bits - 1)) for k in range(grid.words)]
                    start = 8 * grid.words * n + lane
                    row[start : start + 8 * grid.words : 8] = words
        sums, seen = doubles(8 * grid.words), doubles(8)
        for k in range(grid.words):
            sums[8 * k : 8 * k + 8] = grid.centre(k)
        last = 8 * grid.words * (count - 1)
        machine.functions["f"](pointer(rows[0]), pointer(rows[1][last:]), count, pointer(sums), pointer(seen))
        if numpy.bitwise_or.reduce(seen.view(numpy.int64)) & EXPONENT_BITS:
            caught += 1
            continue
        for lane in range(8):
            known = Fraction(0)
            for n in range(count):
                low, high = (8 * grid.words * m + lane for m in (n, count - 1 - n))
                a, b = (exact(r[at : at + 8 * grid.words : 8]) for r, at in zip(rows, (low, high), strict=True))
                known += a * b
            total = exact(sums[lane::8]) - sum(Fraction(grid.centre(k)) for k in range(grid.words))
            assert abs(total - known) * 2**grid.total <= count * (grid.words + 1)
    assert caught < 15 or grid.bits == 51 or kind == "largest"


def beside_finer(grid: Grid, finer: Grid, count: int) -> Iterator[tuple[Fixed, Status, float]]:
    """Runs of random tops, how they end, and their errors in ulp, infinite without a sample."""
    random, span = Random(grid.bits * grid.words), Fraction(HORIZON)
    for _ in range(count):
        scaled = random_problem(random)
        known, run = (Fixed(scaled, each, True) for each in (finer, grid))
        assert known.advance(span, 10**4) is Status.OK
        status, truth = run.advance(span, 10**4), known.sample(span)
        found = run.sample(span)
        off = max(abs(a - b) for a, b in zip(found, truth, strict=True)) if found else math.inf
        yield run, status, float(off * 2**grid.total)


@pytest.mark.slow
@pytest.mark.parametrize(("words", "count"), [(3, 20), (6, 8)])
def test_at_the_sizes_in_use_no_check_fires_and_all_is_right(words: int, count: int) -> None:
    for run, status, off in beside_finer(grid_of(words), grid_of(2 * words), count):
        assert (status, run.redone) == (Status.OK, 0)
        assert off < 1e4


@pytest.mark.slow
@pytest.mark.parametrize("bits", [48, 50, 52])
def test_words_that_are_too_wide_give_no_wrong_number(bits: int) -> None:
    """Each run is right, if need be with shorter steps, or its outcome says that it is not."""
    runs = [*beside_finer(Grid(3, bits), grid_of(6), 20)]
    assert {status for _, status, _ in runs} <= {Status.OK, Status.CAPACITY}
    assert all(off < WRONG_ULP or off == math.inf for _, status, off in runs if status is Status.OK)
    assert sum(run.redone for run, _, _ in runs) > 0 or bits < 50


@pytest.mark.slow
def test_without_the_check_some_would_be_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """The check is what makes them right: with the sums unwatched, words of 51 bits give wrong numbers."""
    monkeypatch.setattr(arithmetic.Accumulator, "look", lambda self, k: None)
    monkeypatch.setattr(fixed_point_run, "machine", once(build))
    assert any(off > WRONG_ULP for _, _, off in beside_finer(Grid(3, 51), grid_of(6), 15))


def test_steps_grow_and_shrink_with_the_motion() -> None:
    """A body that hangs nearly still and then falls: the step is halved and doubled on the way."""
    p = Parameters((Fraction(2), Fraction(2), Fraction(1)), (Fraction(0), Fraction(1), Fraction(0)), Fraction(0))
    y = tuple(Fraction(n, 1024) for n in (1, 0, 512, 0, 1024, 0))
    run, lengths = Fixed(Scaled.of(HEAVY_TOP, p, y, bounded=True), grid_of(3), True), set()
    for _ in range(300):
        before = run.time
        assert run.advance(Fraction(10**6), 1) is Status.OK
        lengths.add(run.time - before)
    assert len(lengths) > 1
    assert all(length.numerator == 1 or length.denominator == 1 for length in lengths)


@pytest.mark.slow
def test_the_new_state_is_the_sum_of_the_coefficients_rounded_once() -> None:
    """Terms below the last bit of the sum are not lost one by one, which would err in the same way at every step."""
    run = Fixed(problem(), grid_of(3), True)
    for _ in range(100):
        assert run.advance(Fraction(10**6), 1) is Status.OK
        total = [sum(column) for column in zip(*map(run.coefficients, range(run.order + 1)), strict=True)]
        last = Fraction(run.grid.unit(1)) / 2**50
        for value, exact_sum in zip(run.state[:3], total[:3], strict=True):
            assert abs(value - exact_sum) <= last


@pytest.mark.slow
@pytest.mark.parametrize("words", [3, 6])
def test_a_sample_is_the_sum_of_the_coefficients_and_zeros_that_are_passed_over_change_no_bit(
    words: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, random = Fixed(problem(), grid_of(words), True), Random(words)
    for _ in range(3):
        assert run.advance(Fraction(10**6), 1) is Status.OK
    began, length = run._began, run.time - run._began
    coefficients = [run.coefficients(n) for n in range(run.order + 1)]
    at, rows = doubles(words * 40), [doubles(sample_row(run.grid, 1) * 40) for _ in range(2)]
    for place in range(40):
        x = Fraction(random.randint(0, 2**12), 2**12) / 2 ** random.randint(0, 9)
        at[words * place : words * (place + 1)] = digits(x, run.grid)
        if place > 4:
            continue
        for value, column in zip(run.sample(began + x * length), zip(*coefficients, strict=True), strict=True):
            total = sum(c * x**n for n, c in enumerate(column))
            assert abs(value - total) * 2**run.grid.total < run.order + words
    for parts, row in zip((steps._PARTS, 1), rows, strict=True):
        monkeypatch.setattr(steps, "_PARTS", parts)
        machine = build(run.grid, HEAVY_TOP, False)
        machine.functions["samples"](pointer(run.rows), run.order, pointer(at), 0, 40, pointer(row))
    assert rows[0].tobytes() == rows[1].tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("words", [3, 4, 6])
def test_products_of_second_words_count_where_a_leading_word_is_small(words: int) -> None:
    """Else coefficients of one word would err alike at every step; two words more tell what is right."""
    p = Parameters((Fraction(4), Fraction(2), Fraction(1)), tuple(Fraction(k, 4) for k in (2, 1, 4)), Fraction(0))
    y = tuple(Fraction(k, 8) for k in (3, -10, 9, 4, 6, -1))
    scaled = Scaled.of(HEAVY_TOP, p, y, bounded=True)
    grids = Grid(words, 44), Grid(words + 2, 44)
    short, wide = (Fixed(scaled, grid, True) for grid in grids)
    for run in (short, wide):
        assert run.advance(Fraction(1, 100), 1) is Status.OK
    unit = Fraction(short.grid.unit(words - 1))
    pairs = [(short.coefficients(n), wide.coefficients(n)) for n in range(short.order)]
    of_one_word = [(a, b) for a, b in pairs if max(map(abs, b)) < 2**44 * unit]
    assert len(of_one_word) > 10
    assert max(abs(x - z) for a, b in of_one_word for x, z in zip(a, b, strict=True)) < unit / 2**8


@pytest.mark.parametrize("third", [Fraction(0), Fraction(1, 3)])
def test_the_spread_is_that_of_the_smallest_component(third: Fraction) -> None:
    """Which an unstable axis would amplify, whatever of the others is 0."""
    p = Parameters((Fraction(3), Fraction(2), Fraction(1)), (Fraction(0),) * 3, Fraction(0))
    y = (Fraction(1, 2**140), Fraction(1), third, Fraction(5, 8), Fraction(-3, 8), Fraction(11, 16))
    assert 140 <= fixed_point_run.spread(Scaled.of(HEAVY_TOP, p, y, bounded=True)) < 144


@pytest.mark.parametrize("speed", ["0", "1e-12", "1e-30"])
@pytest.mark.parametrize("precision", ["quad", "real:184", "real:276"])
def test_an_order_that_nearly_vanishes_shortens_no_step(precision: str, speed: str) -> None:
    """The third order of a pendulum from rest beside its pivot is 0, the fourth is not: 7 steps or 9 to t = 2."""
    top, start = ht.HeavyTop((1, 1, 1), 1, (0, 0, 1)), ht.State((0, speed, 0), (1, 0, 0))
    run = ht.propagate(top, start, [2], precision, integrator="multiword")
    assert run.outcome is ht.Outcome.SUCCESS
    assert run.steps < 10
    known = ht.reference(top, start, [2], digits=35)
    assert numpy.abs(run.to_numpy() - known.to_numpy()).max() < 1e-15
    assert ht.score([2], run.to_numpy(), top=top, start=start).against.endswith("(proven)")
