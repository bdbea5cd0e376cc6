"""The storage of the coefficients of a step, an order a row, and the sums of their products: two implementations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.multiword.codegen.machine_code import (
    INT,
    INT_POINTER,
    LANES,
    POINTER,
    Code,
    Doubles,
    Index,
    Operand,
    function,
    ir,
)
from heavytop.multiword.codegen.recurrence import LEFT, RIGHT, Sum
from heavytop.multiword.fixed_point.arithmetic import (
    WIDEST,
    Accumulator,
    Grid,
    centred,
    exact,
    passed_on,
    summed,
    write_kernels,
    write_long_kernel,
)


@dataclass(frozen=True, slots=True)
class ProductSize:
    """Doubles of a row, of all rows and of the sums; integers of the starts."""

    row: int
    rows: int
    sums: int
    starts: int


@dataclass(slots=True)
class Rows(ABC):
    """Writes code that stores the coefficients y_n of ``vectors`` state vectors, K words each, and sums their products.

    orders: the capacity.  rows, sums, starts, seen: scratch of :meth:`size`, initially zeros.
    """

    code: Code
    grid: Grid
    vectors: int
    orders: int
    rows: Operand
    sums: Operand
    starts: Operand
    seen: Operand
    kernels: list[ir.Function]

    @staticmethod
    @abstractmethod
    def size(grid: Grid, vectors: int, orders: int) -> ProductSize:
        """The size of ``orders`` orders."""

    @staticmethod
    @abstractmethod
    def write_kernels(module: ir.Module, grid: Grid, row: int, wide: bool) -> list[ir.Function]:
        """The functions that sum products; wide: of the registers, on which no result depends."""

    @staticmethod
    @abstractmethod
    def left(rows: Doubles, grid: Grid, vectors: int, n: int, vector: int) -> list[Fraction]:
        """The eight lanes of L of an order, from the rows."""

    @abstractmethod
    def stored(self, n: Operand, vector: int) -> list[Operand]:
        """L of an order as K words, not carried."""

    @abstractmethod
    def begin(self, y: list[Operand], wide: Operand) -> Operand:
        """Store y_0; returns the largest word over its limit."""

    @abstractmethod
    def keep(self, n: Index, y: list[Operand], zeros: Operand, wide: Operand) -> tuple[list[Operand], Operand, Operand]:
        """Store y_n; returns the stored y_n, the updated zeros, and the largest word over its limit.

        zeros: an integer that describes leading zeros, initially 0.
        """

    @abstractmethod
    def products(self, n: Operand, zeros: Operand, vector: int) -> list[Operand]:
        """S_n = Σ L_m ∘ R_(n−m) of a vector: K words, not carried."""

    def sides(self, y: list[Operand]) -> list[list[Operand]]:
        """R, and L of each vector, word by word."""
        words = self.grid.words
        parts = [y[words * v : words * (v + 1)] for v in range(self.vectors)]
        return [_side(self.code, parts[0], RIGHT), *(_side(self.code, part, LEFT) for part in parts)]

    def largest_sum(self, y: list[Operand]) -> Operand:
        """The largest sum of |words| of a component, in the scale of the last word; infinite beyond a double."""
        code, words = self.code, self.grid.words
        largest = code.zero
        for v in range(self.vectors):
            total = code.absolute(y[words * v])
            for word in y[words * v + 1 : words * (v + 1)]:
                total = passed_on(code, self.grid, total, code.absolute(word))
            largest = code.larger(total, largest)
        return code.largest(largest)

    def watch(self, wide: Operand, value: Operand, k: int, bits: int = WIDEST) -> Operand:
        """The largest word so far, relative to 2^bits of its unit."""
        share = self.code.absolute(value) * (2.0**-bits / self.grid.unit(k))
        return self.code.larger(share, wide)


def _side(code: Code, y: list[Operand], which: Sum) -> list[Operand]:
    signs = code.constant(which.sign)
    return [
        code.fma(code.shuffle(word, code.zero, which.second), signs, code.shuffle(word, code.zero, which.first))
        for word in y
    ]


# Sums of products of series in digits of 24 bits: every product and every sum is exact.
#
# Digits are integers, |d| ≤ 2^23 + 4.  A product of two is an integer of at most 2^46 (1 + 2^-18), and 120 of
# them add up to less than 2^53: a double holds their sum, one operation a product, in any order and without a check of
# exponents.  Products with i + j < q are computed in tiles, some digits of the left by as many of the right with a sum
# for each i + j, over so many orders that no sum has more than 120 products; it is then split at 2^24, so that the
# sums over all orders stay far below 2^53 too.


BITS = 24
SUM_BITS = 38
"""Bits of the sum of a level over 700 orders: 50 groups in 8 tiles, or fewer in more, of 2^29 and 2^23 each."""
_PRODUCTS = 120
_ROUND = 1.5 * 2.0**52


def rounded(code: Code, value: Operand, bit: int = 0) -> Operand:
    """``value`` rounded to the nearest multiple of 2^bit, for |value| ≤ 2^(51 + bit)."""
    big = code.constant(_ROUND * 2.0**bit)
    return value + big - big


@dataclass(frozen=True, slots=True)
class _Tiles:
    """side: digits of the left and of the right in a tile.  triangle: levels up to which one tile has all.
    sums: kept in registers.
    """

    side: int
    triangle: int
    sums: int


_WIDE, _NARROW = _Tiles(8, 13, 18), _Tiles(4, 4, 7)


def _write_tile(module: ir.Module, levels: int, side: int, most_sums: int) -> ir.Function:
    """(left, right, where, orders, sums): sums += Σ_m left[where[m]] right[−where[m]] for i + j < levels, i, j < side.

    Split at 2^24: multiples of that are added to the level before.
    """
    arguments = [POINTER, POINTER, INT_POINTER, INT, POINTER]
    made, code = function(module, f"tile_{levels}_{side}", ir.VoidType(), arguments, internal=True)
    left, right, where, orders, sums = code.arguments
    pairs = [
        [(i, level - i) for i in range(side) if 0 <= level - i < side] for level in range(min(levels, 2 * side - 1))
    ]
    parts = [1] * len(pairs)
    while sum(parts) < most_sums and (splittable := [k for k, pair in enumerate(pairs) if parts[k] < len(pair)]):
        parts[max(splittable, key=lambda k: len(pairs[k]) / parts[k])] += 1
    orders_per_group = _PRODUCTS // max(map(len, pairs))
    begins = [sum(parts[:level]) for level in range(len(parts) + 1)]

    def order(m: Operand, values: list[Operand]) -> list[Operand]:
        at, sums = code.load_one(where, m), list(values)
        one, other = code.address(left, at), code.address(right, -at)
        a = [code.load(one, LANES * i) for i in range(side)]
        for j in range(side):
            c = code.load(other, LANES * j)
            for i in range(side):
                if i + j < levels:
                    index = begins[i + j] + pairs[i + j].index((i, j)) % parts[i + j]
                    sums[index] = code.multiply_add(a[i], c, sums[index])
        return sums

    def group(g: Operand, _: list[Operand]) -> None:
        start = g * orders_per_group
        stop = code.smaller(start + orders_per_group, orders)
        _add_levels(code, sums, begins, code.loop(start, stop, order, [code.zero] * begins[-1]))

    code.loop(0, (orders + (orders_per_group - 1)) // orders_per_group, group, [])
    code.builder.ret_void()
    return made


def _add_levels(code: Code, sums: Operand, begins: list[int], values: list[Operand]) -> None:
    """sums += the values of each level, split at 2^24."""
    carries, remainders = [], []
    for level in range(len(begins) - 1):
        first, *others = values[begins[level] : begins[level + 1]]
        for value in others:
            first += value
        carries.append(rounded(code, first, BITS))
        remainders.append(first - carries[-1])
    for level, (value, carry) in enumerate(zip([code.zero, *remainders], [*carries, code.zero], strict=True)):
        offset = LANES * level
        total = code.load(sums, offset) + value
        code.store(code.multiply_add(carry, 2.0**-BITS, total), sums, offset)


def write_sums(module: ir.Module, wide: bool) -> ir.Function:
    """(left, right, where, orders, levels, sums): sums += Σ_m left[where[m]] right[−where[m]] for i + j < levels.

    sums begins with multiples of a level before the first.  where counts doubles, a digit has eight.
    wide: as :attr:`heavytop.multiword.codegen.machine_code.Processor.wide`; the sums are the same.

    Few levels are one tile.  Else all tiles are computed for a few orders at a time, which stay in cache.
    """
    sizes = _WIDE if wide else _NARROW
    side = sizes.side
    triangles = [_write_tile(module, d, d, sizes.sums) for d in range(1, sizes.triangle + 1)]
    tiles = triangles[:side] + [_write_tile(module, d, side, sizes.sums) for d in range(side + 1, 2 * side)]
    arguments = [POINTER, POINTER, INT_POINTER, INT, INT, POINTER]
    made, code = function(module, "sum_products", ir.VoidType(), arguments, internal=True)
    left, right, where, orders, levels, sums = code.arguments
    b, tile, group = code.builder, code.integer(LANES * side), code.integer(_PRODUCTS // side)
    with b.if_then(~(levels > len(triangles))):
        _call(code, triangles, levels, [left, right, where, orders, sums])
        b.ret_void()
    parts = (levels + (side - 1)) // side

    def some(g: Operand, _: list[Operand]) -> None:
        start = g * group
        remaining = orders - start
        count = code.smaller(remaining, group)

        def one(i: Operand, _: list[Operand]) -> None:
            def other(j: Operand, _: list[Operand]) -> None:
                ahead = i + j
                addresses = [code.address(base, k * tile) for base, k in ((left, i), (right, j))]
                operands = [code.address(where, start), count, code.address(sums, ahead * tile)]
                _call(code, tiles, levels - ahead * side, [*addresses, *operands])

            code.loop(0, parts - i, other, [])

        code.loop(0, parts, one, [])

    code.loop(0, (orders + (group - 1)) // group, some, [])
    b.ret_void()
    return made


def _call(code: Code, tiles: list[ir.Function], levels: Operand, arguments: list[Operand]) -> None:
    """Call the tile of so many levels, none for 0, the last for more."""
    b = code.builder
    end = b.append_basic_block("end")
    blocks = [b.append_basic_block(f"levels_{d}") for d in range(1, len(tiles) + 1)]
    switch = b.switch(levels, blocks[-1])
    switch.add_case(0, end)
    for d, (tile, block) in enumerate(zip(tiles, blocks, strict=True), 1):
        switch.add_case(d, block)
        b.position_at_end(block)
        code.call(tile, arguments)
        b.branch(end)
    b.position_at_end(end)


# Coefficients in digits of 24 bits, whose products are summed exactly.
#
# L and R of an order are Σ_j d_j u_j with u_j = 2^(6 − 24 (j + 1)) and digits d_j, j < J, as
# in the code above.  The error of a sum of n products of numbers, from products of digits with i + j ≥ J and from the
# truncation to J digits, is at most n (J + 1)/4 units of the last word.
#
# From some order on the first z digits are 0: |y| ≤ u_(z−1)/8 is enough, for L and R are at most twice as large, and
# the part after digit z is at most 0.51 u_(z−1).  S_n begins at level s = min_m z(m) + z(n − m), and the pair
# (m, n − m) with digit z(m) on the left and digit s − z(m) on the right.  That is at most two before the first
# digit, where zeros are.  Digits of a left side beyond its last one then meet these zeros.


_HEAD = 6
"""log2 of the unit before the first digit: L and R are at most half of it, and y a quarter."""
_BEHIND = 6
"""Bits of digits below the unit of the last word."""
_BEFORE = 2


def digits_of(grid: Grid) -> int:
    """J."""
    return -(-(grid.total + _HEAD + _BEHIND) // BITS)


class DigitRows(Rows):
    """A row: two zeros, the digits of R, those of each L.  starts: z(n) and, behind, where digit z(n) of the first L is
    from the first digit of order 0 on.
    """

    @staticmethod
    def size(grid: Grid, vectors: int, orders: int) -> ProductSize:
        row = LANES * (_BEFORE + digits_of(grid) * (1 + vectors))
        return ProductSize(row, row * orders, LANES * (digits_of(grid) + 1), 2 * orders)

    @staticmethod
    def write_kernels(module: ir.Module, grid: Grid, row: int, wide: bool) -> list[ir.Function]:
        return [write_sums(module, wide)]

    @staticmethod
    def left(rows: Doubles, grid: Grid, vectors: int, n: int, vector: int) -> list[Fraction]:
        count, row = digits_of(grid), DigitRows.size(grid, vectors, 1).row
        start = n * row + LANES * (_BEFORE + count * (1 + vector))
        block = rows[start : start + LANES * count].reshape(count, LANES)
        unit = Fraction(2) ** (_HEAD - BITS * count)
        return [
            sum((int(d) << BITS * (count - 1 - j) for j, d in enumerate(block[:, lane])), 0) * unit
            for lane in range(LANES)
        ]

    def stored(self, n: Operand, vector: int) -> list[Operand]:
        code, grid, count = self.code, self.grid, digits_of(self.grid)
        at = code.address(self.rows, n * self.size(grid, self.vectors, 1).row)
        words = [code.zero] * grid.words
        for j in range(count):
            exponent = _HEAD - BITS * (j + 1)
            digit = code.load(at, LANES * (_BEFORE + count * (1 + vector) + j))
            value = digit * 2.0**exponent
            k = min(max(0, -(exponent // grid.bits) - 1), grid.words - 1)  # the first word whose unit is no larger
            if k:  # the large part goes to the word before
                big = code.constant(grid.centre(k - 1))
                high = value + big - big
                words[k - 1] += high
                value -= high
            words[k] += value
        return words

    def begin(self, y: list[Operand], wide: Operand) -> Operand:
        return self.keep(0, y, self.code.integer(0), wide)[2]

    def keep(self, n: Index, y: list[Operand], zeros: Operand, wide: Operand) -> tuple[list[Operand], Operand, Operand]:
        code, grid = self.code, self.grid
        for index, word in enumerate(y):
            wide = self.watch(wide, word, index % grid.words, grid.most_bits(index % grid.words))
        count, start = digits_of(grid), code.integer(n) * self.size(grid, self.vectors, 1).row
        at = code.address(self.rows, start)
        for part, words in enumerate(self.sides(y)):
            for j, digit in enumerate(self._digits(words)):
                code.store(digit, at, LANES * (_BEFORE + part * count + j))
        # |y| < 2^(e + 1), in bits of a double
        size = self.largest_sum(y).bits()
        exponent = size.unsigned_shift(52) - 1023
        z = code.smaller(code.larger(_HEAD - 4 - exponent, 0) // BITS, count - 1)
        self._put_start(n, z)
        return y, code.larger(z, zeros), wide

    def _put_start(self, n: Index, z: Operand) -> None:
        code = self.code
        row = self.size(self.grid, self.vectors, 1).row
        code.store_one(z, self.starts, n)
        code.store_one(code.integer(n) * row + z * LANES, self._where, n)

    @property
    def _where(self) -> Operand:
        return self.code.address(self.starts, self.orders)

    def products(self, n: Operand, zeros: Operand, vector: int) -> list[Operand]:
        code, count = self.code, digits_of(self.grid)
        level = self._level(n, zeros)
        for k in range(count + 1):
            code.store(code.zero, self.sums, LANES * k)
        row = self.size(self.grid, self.vectors, 1).row
        first = code.address(self.rows, LANES * (_BEFORE + count * (1 + vector)))
        right = code.address(self.rows, n * row + LANES * _BEFORE)
        arguments = [
            first,
            code.address(right, level * LANES),
            self._where,
            n + 1,
            count - level,
            code.address(self.sums, level * LANES),
        ]
        code.call(self.kernels[0], arguments)
        return self._words([code.load(self.sums, LANES * k) for k in range(count + 1)])

    def _level(self, n: Operand, largest_zeros: Operand) -> Operand:
        """s; where some z(m) exceeds s + 2, it is set to s + 2, and s is computed again."""
        code, b = self.code, self.code.builder
        before, search = b.block, b.append_basic_block("level")
        b.branch(search)
        b.position_at_end(search)
        largest = code.phi(INT)
        code.add_incoming([largest], [largest_zeros], before)
        half = (n >> 1) + 1

        def lower(m: Operand, values: list[Operand]) -> list[Operand]:
            zeros_left, zeros_right = (code.load_one(self.starts, k) for k in (m, n - m))
            return [code.smaller(values[0], zeros_left + zeros_right)]

        level = code.loop(0, half, lower, [code.integer(digits_of(self.grid))])[0]
        limit = level + _BEFORE
        again, exit_block = b.append_basic_block("again"), b.append_basic_block("found")
        b.cbranch(largest > limit, again, exit_block)
        b.position_at_end(again)

        def clip(m: Operand, _: list[Operand]) -> None:
            self._put_start(m, code.smaller(code.load_one(self.starts, m), limit))

        code.loop(0, n + 1, clip, [])
        code.add_incoming([largest], [limit])
        b.branch(search)
        b.position_at_end(exit_block)
        return level

    def _digits(self, words: list[Operand]) -> list[Operand]:
        """The digits of words, the last rounded."""
        code, grid, count = self.code, self.grid, digits_of(self.grid)
        digits: list[Any] = [None] * count
        for k, word in enumerate(words):
            remainder = _times(code, word, _raised(grid))
            for j in range(max(0, (_HEAD + grid.bits * k + BITS - 2) // BITS - 1), count):
                exact = self._exponent(j) <= -grid.bits * (k + 1) and k + 1 < grid.words
                piece = remainder if exact else rounded(code, remainder, self._exponent(j) + _raised(grid))
                digits[j] = piece if digits[j] is None else digits[j] + piece
                if exact:
                    break
                remainder -= piece
        carries = [None, *(rounded(code, d, self._exponent(j) + _raised(grid)) for j, d in enumerate(digits[1:])), None]
        carried = [self._carried(*three) for three in zip(digits, carries, carries[1:], strict=False)]
        return [_times(code, digit, -self._exponent(j) - _raised(grid)) for j, digit in enumerate(carried)]

    def _carried(self, digit: Operand, out: Operand | None, into: Operand | None) -> Operand:
        value = digit if out is None else digit - out
        return value if into is None else value + into

    def _exponent(self, j: int) -> int:
        """log2 u_j."""
        return _HEAD - BITS * (j + 1)

    def _words(self, sums: list[Operand]) -> list[Operand]:
        """Σ_l of sums of level l − 1, whole multiples of its unit, as words."""
        code, grid = self.code, self.grid
        words: list[Any] = [None] * grid.words
        for index in reversed(range(len(sums))):
            unit = 2 * _HEAD - BITS * (index + 1)
            remainder = _times(code, sums[index], unit + _raised(grid))
            for k in range(min(grid.words - 1, max(0, (3 - unit - SUM_BITS) // grid.bits)), grid.words):
                exact = k == grid.words - 1 or unit + grid.bits * (k + 1) >= 0
                piece = remainder if exact else rounded(code, remainder, _raised(grid) - grid.bits * (k + 1))
                words[k] = piece if words[k] is None else words[k] + piece
                if exact:
                    break
                remainder -= piece
        return [code.zero if word is None else _times(code, word, -_raised(grid)) for word in words]


def _raised(grid: Grid) -> int:
    """log2 of a factor of the numbers to be split, where digits are near the underflow of doubles."""
    return 500 if grid.total > 800 else 0


def _times(code: Code, value: Operand, exponent: int) -> Operand:
    """value 2^exponent."""
    while exponent:
        part = max(-1000, min(1000, exponent))
        value, exponent = value * 2.0**part, exponent - part
    return value


# Coefficients in the K words of the grid itself, for few words and for proofs.
#
# Words that have become 0 in all lanes are skipped: from some order on the first u words of every coefficient are 0.


_FAR = 1 << 40


class WordRows(Rows):
    """A row: R, then L of each vector, K words each.  starts: from which order on u leading words are 0, and
    behind, how many are in the latest order.
    """

    @staticmethod
    def size(grid: Grid, vectors: int, orders: int) -> ProductSize:
        row = 8 * grid.words * (1 + vectors)
        return ProductSize(row, row * orders, 8 * grid.words, grid.words + 3)

    @staticmethod
    def write_kernels(module: ir.Module, grid: Grid, row: int, wide: bool) -> list[ir.Function]:
        return [write_long_kernel(module, grid, row)] if grid.relative else write_kernels(module, grid, row)

    @staticmethod
    def left(rows: Doubles, grid: Grid, vectors: int, n: int, vector: int) -> list[Fraction]:
        start = 8 * grid.words * (n * (1 + vectors) + 1 + vector)
        block = rows[start : start + 8 * grid.words]
        return [exact(block[lane::8]) for lane in range(8)]

    def stored(self, n: Operand, vector: int) -> list[Operand]:
        code, words = self.code, self.grid.words
        at = code.address(self.rows, n * self.size(self.grid, self.vectors, 1).row)
        return [code.load(at, 8 * (words * (1 + vector) + k)) for k in range(words)]

    def begin(self, y: list[Operand], wide: Operand) -> Operand:
        self._put(0, y)
        self.code.store_one(0, self.starts, 0)
        for k in range(1, self.grid.words + 2):
            self.code.store_one(_FAR, self.starts, k)
        self.code.store_one(0, self.starts, self.grid.words + 2)
        return wide

    def keep(self, n: Index, y: list[Operand], zeros: Operand, wide: Operand) -> tuple[list[Operand], Operand, Operand]:
        code, words = self.code, self.grid.words
        zeros_after = self._leading_zeros(y, zeros)

        def begin(k: Operand, _: list[Operand]) -> None:
            code.store_one(n, self.starts, k + 1)

        # several at once where the first order is far smaller than the state
        code.loop(zeros, zeros_after, begin, [])
        folded: list[Operand] = []
        for v in range(self.vectors):
            words_of_vector, wide = self._folded(y[words * v : words * (v + 1)], zeros_after, wide)
            folded += words_of_vector
        self._put(n, folded)
        return folded, zeros_after, wide

    def _put(self, n: Index, y: list[Operand]) -> None:
        code = self.code
        at = code.address(self.rows, code.integer(n) * self.size(self.grid, self.vectors, 1).row)
        for k, word in enumerate(word for one in self.sides(y) for word in one):
            code.store(word, at, 8 * k)

    def products(self, n: Operand, zeros: Operand, vector: int) -> list[Operand]:
        self.begin_sums()
        self.add_products(n, (self, zeros), (self, zeros), vector)
        return self.end_sums()

    def begin_sums(self) -> None:
        """S = 0."""
        for k, centre in enumerate(centred(self.code, self.grid, self.grid.words)):
            self.code.store(centre, self.sums, 8 * k)

    def add_products(
        self, n: Operand, lefts: tuple[WordRows, Operand], rights: tuple[WordRows, Operand], vector: int
    ) -> None:
        """S += Σ L_m ∘ R_(n−m), L and R each of rows with a number of leading zeros."""
        # for each number u of leading zero words on the left and w on the right, where orders have those
        code, b, words = self.code, self.code.builder, self.grid.words
        row = self.size(self.grid, self.vectors, 1).row

        def offset(rows: WordRows, k: Operand) -> Operand:
            return code.load_one(rows.starts, k)

        def left(u: Operand, _: list[Operand]) -> None:
            begin, end = offset(lefts[0], u), offset(lefts[0], u + 1)

            def right(w: Operand, _: list[Operand]) -> None:
                low = code.larger(code.larger(begin, n - offset(rights[0], w + 1) + 1), 0)
                high = code.smaller(code.smaller(end, n - offset(rights[0], w) + 1), n + 1)
                count = high - low
                with b.if_then(count > 0):
                    at = low * row + u * 8
                    against = (n - low) * row + w * 8
                    skipped = u + w
                    arguments = [
                        code.address(lefts[0].rows, at + 8 * words * (1 + vector)),
                        code.address(rights[0].rows, against),
                        count,
                        code.address(self.sums, skipped * 8),
                        self.seen,
                    ]
                    self._call(skipped, arguments)

            code.loop(0, code.smaller(words - u, rights[1] + 1), right, [])

        code.loop(0, lefts[1] + 1, left, [])

    def end_sums(self) -> list[Operand]:
        """S as K words, not carried, after a check of each."""
        code, words, seen = self.code, self.grid.words, self.seen
        sums = [code.load(self.sums, 8 * k) for k in range(words)]
        watched = Accumulator(code, self.grid, 0, sums, code.load(seen, 0).bits())
        watched.look_at_all()
        code.store(watched.seen.of_bits(), seen, 0)
        return summed(code, self.grid, sums)

    def _call(self, skipped: Operand, arguments: list[Operand]) -> None:
        """The kernel for the levels behind ``skipped`` leading zero words."""
        code, b, words = self.code, self.code.builder, self.grid.words
        if self.grid.relative:
            code.call(self.kernels[0], [*arguments, words - skipped])
            return
        end = b.append_basic_block("called")
        switch = b.switch(skipped, end)
        for k in range(words):
            block = b.append_basic_block(f"skipped_{k}")
            switch.add_case(k, block)
            b.position_at_end(block)
            code.call(self.kernels[words - 1 - k], arguments)
            b.branch(end)
        b.position_at_end(end)

    def _leading_zeros(self, y: list[Operand], before: Operand) -> Operand:
        """The number of leading words that are 0 in every lane of this order and of the last, at most all but the last
        word, at least ``before``.

        A single order may vanish, or nearly, and not those behind: of a pendulum from rest every fourth does.
        """
        code, words = self.code, self.grid.words
        count, only = code.integer(0), code.true
        for k in range(words - 1):
            largest = code.absolute(y[k])
            for v in range(1, self.vectors):
                largest = code.larger(code.absolute(y[words * v + k]), largest)
            only &= code.largest(largest) == 0
            count = code.select(only, k + 1, count)
        last = code.load_one(self.starts, words + 2)
        code.store_one(count, self.starts, words + 2)
        return code.larger(code.smaller(count, last), before)

    def _folded(self, y: list[Operand], zeros: Operand, wide: Operand) -> tuple[list[Operand], Operand]:
        """The words with those that count as 0 but are not added to the first that does not."""
        code = self.code
        folded, left = [], code.zero
        for k, word in enumerate(y):
            value = passed_on(code, self.grid, left, word)
            wide = self.watch(wide, value, k, self.grid.most_bits(k))
            skipped = code.integer(k) < zeros
            folded.append(code.select(skipped, code.zero, value))
            left = code.select(skipped, value, code.zero)
        return folded, wide
