"""Numbers of K words on fixed grids, and sums of their products in machine code.

Word k is a multiple of its unit g_k = 2^(-b (k + 1)), about b bits wide, so that K words are a number in fixed point
with K b bits (after J. van der Hoeven, "Multiple precision floating-point arithmetic on SIMD processors", ARITH 24,
2017).  A sum for level k begins at C_k = 1.5 × 2^52 g_k, where the last bit of a double is worth g_k.  For a product
with i + j = k:

    S' = fma(a_i, b_j, S_k),   d = S' − S_k,   l = fma(a_i, b_j, −d),   S_(k+1) += l.

d and l are exact, and l is a multiple of g_(k+1): only the last level is inexact, as long as each S_k stays
between 2^52 g_k and 2^53 g_k wherever a low part is added to it.  That is checked there, by the exponent: the bits of
S ^ C are accumulated, and a set exponent bit means that the step must be rejected.

Where K b bits are more than a double's exponents reach, each word is kept over its own unit, as an integer, and S_k
over g_(k+1).  Then a low part is multiplied by 2^b when it moves to the next word, and a carry by 2^-b: the operations
are the same and exact (:attr:`Grid.relative`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy

from heavytop.multiword.codegen.machine_code import (
    INT,
    LANES,
    POINTER,
    Code,
    Doubles,
    Machine,
    Operand,
    compiled,
    function,
    ir,
    once,
)

EXPONENT_BITS = 0x7FF << 52
WIDEST = 51
"""Bits of a word whose sums and quotients are on the grid."""
_FEWEST_BOUNDED, _WIDEST_BOUNDED = 5, 45
_HEAD, _EXCESS = 4, 2


@dataclass(frozen=True, slots=True)
class Grid:
    """words: K.  bits: b, of each.

    relative: whether word k is kept over its unit g_k; only where the grid is whole.

    whole: whether the last word is a multiple of its unit too, as proofs need it.  Else its sums begin at 0: it keeps
    some bits below the unit, and coefficients below the unit are not rounded to 0, an error that would accumulate.
    """

    words: int
    bits: int
    whole: bool = False
    relative: bool = False

    @property
    def bounded(self) -> bool:
        """Whether words are so small that products with the coefficients of the field need no check.

        With fewer words it gains nothing.
        """
        return not self.whole and self.words >= _FEWEST_BOUNDED and self.bits <= _WIDEST_BOUNDED

    def most_bits(self, k: int) -> int:
        """log2 of the bound of word k of a coefficient, in its units.

        At the start of a step |ω| ≤ 4, |γ| and |ξ| ≤ √3 and so 2 |γ × ω| < 16: short steps keep within.
        """
        if not self.bounded:
            return WIDEST
        return self.bits + (_EXCESS if k else _HEAD)

    @property
    def smallest(self) -> float:
        """The bound of the two successive coefficients that end a series, in the scale of the last word."""
        return self.unit(self.words - 1) * (2.0 if self.whole else 2.0**-12)

    @property
    def total(self) -> int:
        """Bits of a number behind the binary point."""
        return self.words * self.bits

    @property
    def apart(self) -> float:
        """The ratio of a number in the next word to the same number in this one."""
        return float(2.0**self.bits) if self.relative else 1.0

    def unit(self, k: int) -> float:
        """g_k, in the scale of word k."""
        return 1.0 if self.relative else float(2.0 ** (-self.bits * (k + 1)))

    def centre(self, k: int) -> float:
        """The number that rounds word k to its unit when added and subtracted."""
        if k == self.words - 1 and not self.whole:
            return 0.0
        return 1.5 * 2.0**52 * self.unit(k)

    def coarse(self, k: int) -> float:
        """C_k, at which a sum for level k begins, in the scale of that sum."""
        return self.centre(k) * self.apart


@dataclass(slots=True)
class Accumulator:
    """Sums for the levels ``base`` to K − 1, and the bits that show whether they left their range.

    sums: S_k.  seen: the accumulated bits of S ^ C, eight integers.
    """

    code: Code
    grid: Grid
    base: int
    sums: list[Operand]
    seen: Operand

    def add_product(self, a: list[Operand], b: list[Operand], watched: bool = False, below: bool = False) -> None:
        """Add a b, of words numbered from 0 that count from level ``base`` on.

        Levels do not wait for each other: low parts are added after the products of all but the last two.  Terms of the
        last level are summed before they are added to it, as the next product depends on its sum.

        watched: check a sum after each of its products, not only where low parts are added to it.
        below: include the products of the level below the last, rounded.
        """
        code, last = self.code, len(self.sums) - 1
        if last == 0:
            self.sums[0] = code.fma(a[0], b[0], self.sums[0])
            return
        lows = list[Operand]()
        for k in range(last):
            if k == last - 1:
                for level, low in enumerate(lows, 1):
                    self.look(level)
                    self.sums[level] = passed_on(code, self.grid, low, self.sums[level])
                    self.look(level)
            parts = []
            for i in range(k + 1):
                total = code.fma(a[i], b[k - i], self.sums[k])
                parts.append(code.fma(a[i], b[k - i], -(total - self.sums[k])))
                self.sums[k] = total
                if k == 0 or watched:
                    self.look(k)
            lows.append(in_pairs(parts))
        low = lows[-1]
        if self.grid.relative:
            low *= self.grid.apart
        pairs = [(i, last - i) for i in range(last + 1)] + [(i, last + 1 - i) for i in range(1, last + 1) if below]
        for i, j in pairs:
            low = code.fma(a[i], b[j], low)
        self.sums[last] += low

    def look(self, k: int) -> None:
        """Accumulate the bits of a sum; the last level needs no check."""
        level = self.base + k
        if level < self.grid.words - 1:
            self.seen |= self.sums[k].bits() ^ _bits(self.grid.coarse(level))

    def look_at_all(self) -> None:
        """Accumulate the bits of every sum."""
        for k in range(len(self.sums)):
            self.look(k)


def _bits(value: float) -> int:
    return int(numpy.float64(value).view(numpy.int64))


def in_pairs(values: list[Operand]) -> Operand:
    """Their sum, exact for multiples of one unit; in pairs."""
    while len(values) > 1:
        pairs = zip(values[::2], values[1::2], strict=False)
        values = [a + b for a, b in pairs] + values[len(values) - len(values) % 2 :]
    return values[0]


def write_kernels(module: ir.Module, grid: Grid, row: int) -> list[ir.Function]:
    """Functions (left, right, count, sums, seen): S += Σ_m left[m] right[-m] in the levels from the q-th last on.

    left goes up by a row for each product and right goes down; both point to their first word that is not zero.
    The list begins with q = 1.
    """
    return [_write_kernel(module, grid, count, row) for count in range(1, grid.words + 1)]


def _write_kernel(module: ir.Module, grid: Grid, count: int, row: int) -> ir.Function:
    arguments = [POINTER, POINTER, INT, POINTER, POINTER]
    made, code = function(module, f"products_{count}", ir.VoidType(), arguments, internal=True)
    left, right, terms, sums, seen = code.arguments
    base = grid.words - count

    def term(m: Operand, values: list[Operand]) -> list[Operand]:
        total = Accumulator(code, grid, base, list(values[:-1]), values[-1])
        at = code.address(left, m * row)
        against = code.address(right, m * -row)
        a, c = ([code.load(base, 8 * i) for i in range(count)] for base in (at, against))
        # where a leading word is small in some lane, their omission would accumulate
        total.add_product(a, c, below=count == 2 and not grid.whole)
        return [*total.sums, total.seen]

    begin = [code.load(sums, 8 * k) for k in range(count)] + [code.load(seen, 0).bits()]
    values = code.loop(0, terms, term, begin)
    for k in range(count):
        code.store(values[k], sums, 8 * k)
    code.store(values[-1].of_bits(), seen, 0)
    code.builder.ret_void()
    return made


_UNROLLED = 4
"""Products of a level in an unrolled loop."""


def write_long_kernel(module: ir.Module, grid: Grid, row: int) -> ir.Function:
    """The functions of :func:`write_kernels` as one, (left, right, count, sums, seen, levels), of a relative grid.

    It is a loop over the products of a level: unrolled, its code would not fit into the processor's cache.  Levels do
    not depend on each other: the low parts of a level are added after the products of the next, between two checks.
    """
    arguments = [POINTER, POINTER, INT, POINTER, POINTER, INT]
    made, code = function(module, "long_products", ir.VoidType(), arguments, internal=True)
    left, right, terms, sums, seen, levels = code.arguments
    last, centre = levels - 1, _bits(grid.coarse(0))

    def look(largest: Operand, total: Operand) -> Operand:
        return largest | (total.bits() ^ centre)

    def exact_product(a: Operand, c: Operand, values: list[Operand]) -> list[Operand]:
        total = code.fma(a, c, values[0])
        low = code.fma(a, c, -(total - values[0]))
        return [total, values[1] + low]

    def rounded_product(a: Operand, c: Operand, values: list[Operand]) -> list[Operand]:
        return [code.fma(a, c, values[0])]

    def term(m: Operand, values: list[Operand]) -> list[Operand]:
        ahead = code.address(left, m * row)
        behind = code.address(right, m * -row)

        def level(k: Operand, product: Callable[..., list[Operand]], values: list[Operand]) -> list[Operand]:
            end, count = k * LANES, k + 1

            def some(start: Operand, width: int, values: list[Operand]) -> list[Operand]:
                for j in range(width):
                    offset = (start + j) * LANES
                    pair = code.load(ahead, offset), code.load(behind, end - offset)
                    values = product(*pair, values)
                return values

            groups = count // _UNROLLED
            unrolled = groups * _UNROLLED
            values = code.loop(0, groups, lambda g, v: some(g * _UNROLLED, _UNROLLED, v), values)
            return code.loop(unrolled, count, lambda i, v: some(i, 1, v), values)

        def exact_level(k: Operand, values: list[Operand]) -> list[Operand]:
            offset = k * LANES
            total, lows = level(k, exact_product, [code.load(sums, offset), code.zero])
            largest = look(values[1], total)
            total = code.fma(values[0], grid.apart, total)
            code.store(total, sums, offset)
            return [lows, look(largest, total)]

        lows, largest = code.loop(0, last, exact_level, [code.zero, values[0]])
        low = level(last, rounded_product, [lows * grid.apart])[0]
        offset = last * LANES
        code.store(code.load(sums, offset) + low, sums, offset)
        return [largest]

    total = code.loop(0, terms, term, [code.load(seen, 0).bits()])[0]
    code.store(total.of_bits(), seen, 0)
    code.builder.ret_void()
    return made


def bounded_product(code: Code, grid: Grid, a: list[Operand], b: list[Operand], zeros: int = 0) -> list[Operand]:
    """a b in K words, not carried, where no sum can leave its range; low parts are added at the end.

    zeros: the number of leading words of b that are 0 and are skipped.

    a: a coefficient of the field, |a_0| ≤ 2^b units and the others half as many at most.  b: |b_0| ≤ 2^(b + 4) units,
    the others at most 2^(b + 2).  Over 2^b units, the sum for level k is at most 2^4 for k = 0 and else
    2^3 + 2^2 + 2 (k − 1): less than 2^51 units for 24 words of 45 bits.
    """
    last = grid.words - 1
    products, lows = [], [list[Operand]() for _ in range(grid.words)]
    for k in range(last):
        centre = total = code.constant(grid.centre(k))
        for i in range(k + 1 - zeros):
            after = code.fma(a[i], b[k - i], total)
            lows[k + 1].append(code.fma(a[i], b[k - i], -(after - total)))
            total = after
        products.append(total - centre)
    total = code.zero
    # those of the level below the last first: they matter where a leading word is 0
    for i, j in [(i, last + 1 - i) for i in range(1, last + 1)] + [(i, last - i) for i in range(last + 1)]:
        if j >= zeros:
            total = code.fma(a[i], b[j], total)
    products.append(total)
    return [products[0], *(products[k] + in_pairs(lows[k]) if lows[k] else products[k] for k in range(1, last + 1))]


def passed_on(code: Code, grid: Grid, left: Operand, word: Operand) -> Operand:
    """``word`` plus the remainder ``left`` of the word before it."""
    return code.fma(left, grid.apart, word) if grid.relative else word + left


def carried_over(code: Code, grid: Grid, carry: Operand, word: Operand) -> Operand:
    """``word`` plus the ``carry`` of the word after it."""
    return code.fma(carry, 1 / grid.apart, word) if grid.relative else word + carry


def centred(code: Code, grid: Grid, count: int) -> list[Operand]:
    """The initial values of all sums."""
    return [code.constant(grid.coarse(k)) for k in range(count)]


def summed(code: Code, grid: Grid, sums: list[Operand]) -> list[Operand]:
    """The words of sums from :func:`centred`."""
    words = [s - c for s, c in zip(sums, centred(code, grid, len(sums)), strict=True)]
    return [word * (1 / grid.apart) for word in words] if grid.relative else words


def carried(code: Code, grid: Grid, words: list[Operand]) -> list[Operand]:
    """A number with carries, so that each word but the first has about b bits."""
    carries = []
    for k in range(1, grid.words):
        big = code.constant(grid.coarse(k - 1))
        carries.append(words[k] + big - big)
    result = []
    for k, word in enumerate(words):
        value = word if k == 0 else word - carries[k - 1]
        result.append(carried_over(code, grid, carries[k], value) if k + 1 < grid.words else value)
    return result


# Exact numbers as words on fixed grids, and the grid for a number of bits.


# (words, bits of each): products of a few hundred orders stay inside the range of the sums
_BITS_OF_A_WORD = ((2, 48), (4, 46), (6, 45), (12, 44), (45, 43))
MOST_WORDS = 24
"""The most words whose units are doubles."""
_NARROWER = 2
"""Words are narrower by so many bits where that suffices, as fewer bits take fewer orders."""


def grid_of(words: int, whole: bool = False) -> Grid:
    """The grid of 2 to 24 words, or to 45 if ``whole``, as in :class:`Grid`."""
    return Grid(words, next(bits for most, bits in _BITS_OF_A_WORD if words <= most), whole, words > MOST_WORDS)


def grid_for(bits: int) -> Grid | None:
    """The smallest grid with at least ``bits`` bits and three words, of two widths; None beyond the largest."""
    wide = next((grid for grid in map(grid_of, range(3, MOST_WORDS + 1)) if grid.total >= bits), None)
    if wide is None:
        return None
    narrow = Grid(wide.words, wide.bits - _NARROWER)
    return narrow if narrow.total >= bits else wide


def digits(value: Fraction, grid: Grid) -> list[float]:
    """``value`` rounded to a multiple of the last unit, as words."""
    return words_of(round(value * 2**grid.total), grid)


def words_of(ulps: int, grid: Grid) -> list[float]:
    """The words of an integer number of the last unit."""
    words = []
    for k in range(grid.words):
        shift = grid.bits * (grid.words - 1 - k)
        digit = (ulps + (1 << shift >> 1)) >> shift if k < grid.words - 1 else ulps
        ulps -= digit << shift
        words.append(float(digit) * grid.unit(k))
    return words


def exact(words: Doubles) -> Fraction:
    """The exact sum of words."""
    ratios = [word.as_integer_ratio() for word in words.tolist()]
    bottom = max(below for _, below in ratios)  # all are powers of two
    return Fraction(sum(above * (bottom // below) for above, below in ratios), bottom)


# The sizes of the words of a series, in machine code, for the proof of
# :mod:`heavytop.multiword.fixed_point.certified_series`.


# y out of L = (Ω2, Ω3, Ω1, γ2 + γ3, γ1 + γ2, 2 γ2, …): lane by lane L[first] − L[second]/2, where 8 is a zero
_FIRST, _SECOND = (2, 0, 1, 4, 5, 3, 8, 8), (8, 8, 8, 5, 5, 5, 8, 8)


FIRST_BEHIND = 20
"""The first word of those whose sizes are stored separately: those before it are far above the smallest double."""


@once
def machine(grid: Grid, vectors: int) -> Machine:
    """extents(rows, orders, values, sizes, behind, widest, added) for rows of R and L of each vector, K words each.

    values, sizes: for each order and vector Σ_k y_k and Σ_k |word k of y|, eight doubles each; the smallest words are
    added first, so that a value is right to 2^-50 of its size.  behind: of a relative grid, the sizes from word
    :data:`FIRST_BEHIND` on, over its unit.  widest: max_n |word k| of R and of each L.
    added: Σ_n |word k of y| of each vector.
    """
    words, coarser = grid.words, 1 / grid.apart
    module = ir.Module("extents")
    _, code = function(module, "extents", ir.VoidType(), [POINTER, INT, *[POINTER] * 5])
    rows, orders, values, sizes, behind, widest, added = code.arguments
    row = words * (1 + vectors)
    for k in range(row):
        code.store(code.zero, widest, 8 * k)
    for k in range(words * vectors):
        code.store(code.zero, added, 8 * k)

    def order(n: Operand, _: list[Operand]) -> None:
        at = code.address(rows, n * (8 * row))
        side = [code.load(at, 8 * k) for k in range(row)]
        for k, word in enumerate(side):
            code.store(code.larger(code.absolute(word), code.load(widest, 8 * k)), widest, 8 * k)
        for v in range(vectors):
            value = size = far = code.zero
            for k in reversed(range(words)):
                y = component(code, side[words * (1 + v) + k])
                magnitude, offset = code.absolute(y), 8 * (words * v + k)
                code.store(code.load(added, offset) + magnitude, added, offset)
                value, size = (carried_over(code, grid, *pair) for pair in ((value, y), (size, magnitude)))
                far = size if k == FIRST_BEHIND else far
            offset_of_order = (n * vectors + v) * 8
            code.store(value * coarser, code.address(values, offset_of_order), 0)
            code.store(size * coarser, code.address(sizes, offset_of_order), 0)
            if grid.relative:
                code.store(far, code.address(behind, offset_of_order), 0)

    code.loop(0, orders + 1, order, [])
    code.builder.ret_void()
    return compiled(module)


def component(code: Code, left: Operand) -> Operand:
    """A word of y out of one of L, exactly."""
    half = code.shuffle(left, code.zero, _SECOND)
    return code.fma(half, -0.5, code.shuffle(left, code.zero, _FIRST))
