"""Coefficients in the K words of the grid itself, for few words and for proofs.

Words that have become 0 in all lanes are skipped: from some order on the first u words of every coefficient are 0.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from llvmlite import ir

from heavytop.words.digits import exact
from heavytop.words.kernels import Accumulator, Grid, centred, write_kernels
from heavytop.words.machine import Doubles
from heavytop.words.rows import Rows, Size
from heavytop.words.vector import DOUBLE, INT_VECTOR, VECTOR, Index

_FAR = 1 << 40


class WordRows(Rows):
    """A row: R, then L of each vector, K words each.  places: from which order on u leading words are 0."""

    @staticmethod
    def size(grid: Grid, vectors: int, orders: int) -> Size:
        row = 8 * grid.words * (1 + vectors)
        return Size(row, row * orders, 8 * grid.words, grid.words + 2)

    @staticmethod
    def write_kernels(module: ir.Module, grid: Grid, row: int, wide: bool) -> list[Any]:
        return write_kernels(module, grid, row)

    @staticmethod
    def left(rows: Doubles, grid: Grid, vectors: int, n: int, vector: int) -> list[Fraction]:
        start = 8 * grid.words * (n * (1 + vectors) + 1 + vector)
        block = rows[start : start + 8 * grid.words]
        return [exact(block[lane::8]) for lane in range(8)]

    def stored(self, n: Any, vector: int) -> list[Any]:
        code, words = self.code, self.grid.words
        row = code.integer(self.size(self.grid, self.vectors, 1).row)
        at = code.address(self.rows, code.builder.mul(n, row))
        return [code.load(at, 8 * (words * (1 + vector) + k)) for k in range(words)]

    def begin(self, y: list[Any], wide: Any) -> Any:
        code = self.code
        self._put(0, y)
        code.builder.store(code.integer(0), code.address(self.places, 0))
        for k in range(1, self.grid.words + 2):
            code.builder.store(code.integer(_FAR), code.address(self.places, k))
        return wide

    def keep(self, n: Any, y: list[Any], zeros: Any, wide: Any) -> tuple[list[Any], Any, Any]:
        code, b, words = self.code, self.code.builder, self.grid.words
        zeros_after = self._leading_zeros(y, zeros)

        def begin(k: Any, _: list[Any]) -> None:
            b.store(n, code.address(self.places, b.add(k, code.integer(1))))

        # several at once, where the first order is far smaller than the state
        code.loop(zeros, zeros_after, begin, [])
        folded: list[Any] = []
        for v in range(self.vectors):
            one, wide = self._folded(y[words * v : words * (v + 1)], zeros_after, wide)
            folded += one
        self._put(n, folded)
        return folded, zeros_after, wide

    def _put(self, n: Index, y: list[Any]) -> None:
        code = self.code
        row = code.integer(self.size(self.grid, self.vectors, 1).row)
        at = code.address(self.rows, code.builder.mul(code.integer(n), row))
        for k, word in enumerate(word for one in self.sides(y) for word in one):
            code.store(word, at, 8 * k)

    def products(self, n: Any, zeros: Any, vector: int) -> list[Any]:
        # for each number u of leading zero words on the left and w on the right, where orders have those
        code, b, words = self.code, self.code.builder, self.grid.words
        rows, sums, places, seen = self.rows, self.sums, self.places, self.seen
        row = self.code.integer(self.size(self.grid, self.vectors, 1).row)
        for k, centre in enumerate(centred(code, self.grid, words)):
            code.store(centre, sums, 8 * k)
        one, zero = code.integer(1), code.integer(0)

        def smaller(a: Any, c: Any) -> Any:
            return b.select(b.icmp_signed("<", a, c), a, c)

        def larger(a: Any, c: Any) -> Any:
            return b.select(b.icmp_signed(">", a, c), a, c)

        def place(k: Any) -> Any:
            return b.load(code.address(places, k))

        def left(u: Any, _: list[Any]) -> None:
            begin, end = place(u), place(b.add(u, one))

            def right(w: Any, _: list[Any]) -> None:
                low = larger(larger(begin, b.add(b.sub(n, place(b.add(w, one))), one)), zero)
                high = smaller(smaller(end, b.add(b.sub(n, place(w)), one)), b.add(n, one))
                count = b.sub(high, low)
                with b.if_then(b.icmp_signed(">", count, zero)):
                    at = b.add(b.mul(low, row), b.mul(u, code.integer(8)))
                    against = b.add(b.mul(b.sub(n, low), row), b.mul(w, code.integer(8)))
                    skipped = b.add(u, w)
                    arguments = [
                        code.address(rows, b.add(at, code.integer(8 * words * (1 + vector)))),
                        code.address(rows, against),
                        count,
                        code.address(sums, b.mul(skipped, code.integer(8))),
                        seen,
                    ]
                    self._call(skipped, arguments)

            code.loop(0, smaller(b.sub(code.integer(words), u), b.add(zeros, one)), right, [])

        code.loop(0, b.add(zeros, one), left, [])
        found = [code.load(sums, 8 * k) for k in range(words)]
        watched = Accumulator(code, self.grid, 0, found, b.bitcast(code.load(seen, 0), INT_VECTOR))
        watched.look_at_all()
        code.store(b.bitcast(watched.seen, VECTOR), seen, 0)
        return [code.subtract(s, c) for s, c in zip(found, centred(code, self.grid, words), strict=True)]

    def _call(self, skipped: Any, arguments: list[Any]) -> None:
        """The kernel for the levels behind ``skipped`` leading zero words."""
        b, words = self.code.builder, self.grid.words
        end = b.append_basic_block("called")
        switch = b.switch(skipped, end)
        for k in range(words):
            block = b.append_basic_block(f"skipped_{k}")
            switch.add_case(self.code.integer(k), block)
            b.position_at_end(block)
            b.call(self.kernels[words - 1 - k], arguments)
            b.branch(end)
        b.position_at_end(end)

    def _leading_zeros(self, y: list[Any], before: Any) -> Any:
        """How many leading words are 0 in every lane, all but the last at most; never fewer than before."""
        code, b, words = self.code, self.code.builder, self.grid.words
        count, only = code.integer(0), ir.Constant(ir.IntType(1), 1)
        for k in range(words - 1):
            largest = code.absolute(y[k])
            for v in range(1, self.vectors):
                largest = code.larger(code.absolute(y[words * v + k]), largest)
            only = b.and_(only, b.fcmp_ordered("==", code.largest(largest), ir.Constant(DOUBLE, 0.0)))
            count = b.select(only, code.integer(k + 1), count)
        return b.select(b.icmp_signed(">", count, before), count, before)

    def _folded(self, y: list[Any], zeros: Any, wide: Any) -> tuple[list[Any], Any]:
        """Words that count as 0 and are not: added to the first that does not."""
        code, b = self.code, self.code.builder
        found, left = [], code.zero
        for k, word in enumerate(y):
            value = code.add(word, left)
            wide = self.watch(wide, value, k, self.grid.most_bits(k))
            skipped = b.icmp_signed("<", code.integer(k), zeros)
            found.append(b.select(skipped, code.zero, value))
            left = b.select(skipped, value, code.zero)
        return found, wide
