"""Coefficients in digits of 24 bits, whose products are summed exactly.

L and R of an order are Σ_j d_j u_j with u_j = 2^(6 − 24 (j + 1)) and digits d_j, j < J, as
:mod:`heavytop.words.digit_sums` takes them.  What is left out of a sum of n products of numbers, products of digits
with i + j ≥ J and what J digits lack, is at most n (J + 1)/4 units of the last word.

From some order on the first z digits are 0: |y| ≤ u_(z−1)/8 is enough, for L and R are at most twice as large, and
what lies behind digit z is at most 0.51 u_(z−1).  S_n begins at level s = min_m z(m) + z(n − m), and the pair
(m, n − m) with digit z(m) on the left and digit s − z(m) on the right.  That is kept from lying more than two before
the first digit, where zeros are.  What a left side has behind its last digit then meets these zeros.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from llvmlite import ir

from heavytop.words.digit_sums import BITS, SUM_BITS, rounded, write_sums
from heavytop.words.kernels import Grid
from heavytop.words.machine import Doubles
from heavytop.words.rows import Rows, Size
from heavytop.words.vector import INT, LANES, Code, Index

_HEAD = 6
"""log2 of the unit before the first digit: L and R are at most half of it, and y a quarter."""
_BEHIND = 6
"""Digits go on for so many bits behind the unit of the last word."""
_BEFORE = 2


def digits_of(grid: Grid) -> int:
    """J."""
    return -(-(grid.total + _HEAD + _BEHIND) // BITS)


class DigitRows(Rows):
    """A row: two zeros, the digits of R, those of each L.  places: z(n) and, behind, where digit z(n) of the first L is
    from the first digit of order 0 on.
    """

    @staticmethod
    def size(grid: Grid, vectors: int, orders: int) -> Size:
        row = LANES * (_BEFORE + digits_of(grid) * (1 + vectors))
        return Size(row, row * orders, LANES * (digits_of(grid) + 1), 2 * orders)

    @staticmethod
    def write_kernels(module: ir.Module, grid: Grid, row: int, wide: bool) -> list[Any]:
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

    def stored(self, n: Any, vector: int) -> list[Any]:
        code, grid, count = self.code, self.grid, digits_of(self.grid)
        row = code.integer(self.size(grid, self.vectors, 1).row)
        at = code.address(self.rows, code.builder.mul(n, row))
        found = [code.zero] * grid.words
        for j in range(count):
            exponent = _HEAD - BITS * (j + 1)
            digit = code.load(at, LANES * (_BEFORE + count * (1 + vector) + j))
            value = code.multiply(digit, code.constant(2.0**exponent))
            k = min(max(0, -(exponent // grid.bits) - 1), grid.words - 1)  # the first word whose unit is no larger
            if k:  # what is large beside that unit goes to the word before
                big = code.constant(grid.centre(k - 1))
                high = code.subtract(code.add(value, big), big)
                found[k - 1] = code.add(found[k - 1], high)
                value = code.subtract(value, high)
            found[k] = code.add(found[k], value)
        return found

    def begin(self, y: list[Any], wide: Any) -> Any:
        return self.keep(0, y, self.code.integer(0), wide)[2]

    def keep(self, n: Index, y: list[Any], zeros: Any, wide: Any) -> tuple[list[Any], Any, Any]:
        code, b, grid = self.code, self.code.builder, self.grid
        for place, word in enumerate(y):
            wide = self.watch(wide, word, place % grid.words, grid.most_bits(place % grid.words))
        count, start = digits_of(grid), b.mul(code.integer(n), code.integer(self.size(grid, self.vectors, 1).row))
        at = code.address(self.rows, start)
        for part, words in enumerate(self.sides(y)):
            for j, digit in enumerate(self._digits(words)):
                code.store(digit, at, LANES * (_BEFORE + part * count + j))
        # |y| < 2^(e + 1), in bits of a double
        size = b.bitcast(self.largest_sum(y), INT)
        exponent = b.sub(b.lshr(size, code.integer(52)), code.integer(1023))
        z = b.sdiv(self._larger(b.sub(code.integer(_HEAD - 4), exponent), code.integer(0)), code.integer(BITS))
        z = self._smaller(z, code.integer(count - 1))
        self._put_place(n, z)
        return y, self._larger(z, zeros), wide

    def _put_place(self, n: Index, z: Any) -> None:
        code, b = self.code, self.code.builder
        row = code.integer(self.size(self.grid, self.vectors, 1).row)
        b.store(z, code.address(self.places, n))
        place = b.add(b.mul(code.integer(n), row), b.mul(z, code.integer(LANES)))
        b.store(place, code.address(self._where, n))

    @property
    def _where(self) -> Any:
        return self.code.address(self.places, self.orders)

    def products(self, n: Any, zeros: Any, vector: int) -> list[Any]:
        code, b, count = self.code, self.code.builder, digits_of(self.grid)
        level = self._level(n, zeros)
        for k in range(count + 1):
            code.store(code.zero, self.sums, LANES * k)
        row = code.integer(self.size(self.grid, self.vectors, 1).row)
        first = code.address(self.rows, LANES * (_BEFORE + count * (1 + vector)))
        right = code.address(self.rows, b.add(b.mul(n, row), code.integer(LANES * _BEFORE)))
        arguments = [
            first,
            code.address(right, b.mul(level, code.integer(LANES))),
            self._where,
            b.add(n, code.integer(1)),
            b.sub(code.integer(count), level),
            code.address(self.sums, b.mul(level, code.integer(LANES))),
        ]
        b.call(self.kernels[0], arguments)
        return self._words([code.load(self.sums, LANES * k) for k in range(count + 1)])

    def _level(self, n: Any, most: Any) -> Any:
        """s; where some z(m) exceeds s + 2, it counts as s + 2, so that s is looked for again."""
        code, b = self.code, self.code.builder
        before, search = b.block, b.append_basic_block("level")
        b.branch(search)
        b.position_at_end(search)
        largest = b.phi(INT)
        largest.add_incoming(most, before)
        half = b.add(b.ashr(n, code.integer(1)), code.integer(1))

        def lower(m: Any, values: list[Any]) -> list[Any]:
            pair = [b.load(code.address(self.places, k)) for k in (m, b.sub(n, m))]
            return [self._smaller(values[0], b.add(*pair))]

        level = code.loop(0, half, lower, [code.integer(digits_of(self.grid))])[0]
        limit = b.add(level, code.integer(_BEFORE))
        again, found = b.append_basic_block("again"), b.append_basic_block("found")
        b.cbranch(b.icmp_signed(">", largest, limit), again, found)
        b.position_at_end(again)

        def clip(m: Any, _: list[Any]) -> None:
            self._put_place(m, self._smaller(b.load(code.address(self.places, m)), limit))

        code.loop(0, b.add(n, code.integer(1)), clip, [])
        largest.add_incoming(limit, b.block)
        b.branch(search)
        b.position_at_end(found)
        return level

    def _smaller(self, a: Any, c: Any) -> Any:
        return self.code.builder.select(self.code.builder.icmp_signed("<", a, c), a, c)

    def _larger(self, a: Any, c: Any) -> Any:
        return self.code.builder.select(self.code.builder.icmp_signed(">", a, c), a, c)

    def _digits(self, words: list[Any]) -> list[Any]:
        """The digits of words, the last rounded."""
        code, grid, count = self.code, self.grid, digits_of(self.grid)
        found: list[Any] = [None] * count
        for k, word in enumerate(words):
            rest = _times(code, word, _raised(grid))
            for j in range(self._first_digit(k), count):
                exact = self._place(j) <= -grid.bits * (k + 1) and k + 1 < grid.words
                piece = rest if exact else rounded(code, rest, self._place(j) + _raised(grid))
                found[j] = piece if found[j] is None else code.add(found[j], piece)
                if exact:
                    break
                rest = code.subtract(rest, piece)
        carries = [None, *(rounded(code, d, self._place(j) + _raised(grid)) for j, d in enumerate(found[1:])), None]
        carried = [self._carried(*three) for three in zip(found, carries, carries[1:], strict=False)]
        return [_times(code, digit, -self._place(j) - _raised(grid)) for j, digit in enumerate(carried)]

    def _carried(self, digit: Any, out: Any, into: Any) -> Any:
        value = digit if out is None else self.code.subtract(digit, out)
        return value if into is None else self.code.add(value, into)

    def _place(self, j: int) -> int:
        """log2 u_j."""
        return _HEAD - BITS * (j + 1)

    def _first_digit(self, k: int) -> int:
        """Where the digits of word k begin."""
        return max(0, (_HEAD + self.grid.bits * k + BITS - 2) // BITS - 1)

    def _words(self, sums: list[Any]) -> list[Any]:
        """Σ_l of sums of level l − 1, whole multiples of its unit, as words."""
        code, grid = self.code, self.grid
        found: list[Any] = [None] * grid.words
        for index in reversed(range(len(sums))):
            unit = 2 * _HEAD - BITS * (index + 1)
            rest = _times(code, sums[index], unit + _raised(grid))
            for k in range(min(grid.words - 1, max(0, (3 - unit - SUM_BITS) // grid.bits)), grid.words):
                exact = k == grid.words - 1 or unit + grid.bits * (k + 1) >= 0
                piece = rest if exact else rounded(code, rest, _raised(grid) - grid.bits * (k + 1))
                found[k] = piece if found[k] is None else code.add(found[k], piece)
                if exact:
                    break
                rest = code.subtract(rest, piece)
        return [code.zero if word is None else _times(code, word, -_raised(grid)) for word in found]


def _raised(grid: Grid) -> int:
    """Numbers are split times 2 to the power of this, where digits are small beside the range of doubles."""
    return 500 if grid.total > 800 else 0


def _times(code: Code, value: Any, exponent: int) -> Any:
    """value 2^exponent."""
    while exponent:
        part = max(-1000, min(1000, exponent))
        value, exponent = code.multiply(value, code.constant(2.0**part)), exponent - part
    return value
