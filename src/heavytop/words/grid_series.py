"""One Taylor step on a grid of K words: the function ``series``.

Coefficients carry h^n, so that the step is a sum.  Words that have become 0 in all lanes are skipped: from some order
on the first u words of every coefficient are 0, which is most of the speed.  The series ends where two coefficients in
a row are below :attr:`heavytop.words.kernels.Grid.smallest`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from llvmlite import ir

from heavytop.top.equations import System
from heavytop.words.kernels import EXPONENT_BITS, Accumulator, Grid, carried, centred, write_kernels
from heavytop.words.lanes import GATHERED, LEFT, RIGHT, Sum, turned
from heavytop.words.vector import DOUBLE, INT, INT_POINTER, INT_VECTOR, POINTER, VECTOR, Code, Index, function

FIRED, UNSETTLED = -1, -2
"""What ``series`` gives in place of its number of orders: a sum left its range; no convergence."""
_FAR = 1 << 40
_WIDEST, _WIDEST_DIVIDEND = 51, 53
"""Bits of a word whose sums and quotients are on the grid; of one that is divided, behind the first."""


def most_orders(grid: Grid) -> int:
    """Orders after which a step is given up."""
    return int(0.64 * grid.total) + 14


@dataclass(slots=True)
class Series:
    """Writes ``series(state, constants, inverses, rows, sums, places, seen, factor, raises, result)``.

    state, result: K words of each vector.  constants: K words of A and each B, for each vector.  inverses: 1/(n + 1).
    rows: R, then L of each vector, K words each, an order a row.  sums, seen, places: scratch.  factor, raises: from
    one order to the next coefficients are multiplied by factor 16^raises; factor is ± a power of two, at most 1.
    """

    module: ir.Module
    grid: Grid
    system: System
    vectors: int
    made: Any = field(init=False)
    code: Code = field(init=False)
    kernels: list[Any] = field(init=False)

    @property
    def row(self) -> int:
        """Doubles of one order."""
        return 8 * self.grid.words * (1 + self.vectors)

    def write(self) -> Any:
        """The function."""
        self.kernels = write_kernels(self.module, self.grid, self.row)
        arguments = [POINTER] * 5 + [INT_POINTER, POINTER, DOUBLE, INT, POINTER]
        self.made, self.code = function(self.module, "series", INT, arguments)
        state, _, _, _, _, places, seen, _, _, result = self.made.args
        code, b = self.code, self.code.builder
        words = self.grid.words
        y = [code.load(state, 8 * k) for k in range(words * self.vectors)]
        self._put(0, y)
        code.store(code.zero, seen, 0)
        b.store(code.integer(0), code.address(places, 0))
        for k in range(1, words + 2):
            b.store(code.integer(_FAR), code.address(places, k))
        orders, small, wide, total = self._orders(y)
        bits = b.and_(code.any_bit(b.bitcast(code.load(seen, 0), INT_VECTOR)), code.integer(EXPONENT_BITS))
        in_range = b.icmp_signed("==", bits, code.integer(0))
        quiet = b.and_(in_range, b.fcmp_ordered("<", code.largest(wide), ir.Constant(DOUBLE, 1.0)))
        settled = b.icmp_signed(">=", small, code.integer(2))
        for v in range(self.vectors):
            one = total[words * v : words * (v + 1)]
            one = carried(code, self.grid, carried(code, self.grid, one))
            for k, word in enumerate(one):
                code.store(word, result, 8 * (words * v + k))
        found = b.select(settled, orders, code.integer(UNSETTLED))
        b.ret(b.select(quiet, found, code.integer(FIRED)))
        return self.made

    def _side(self, y: list[Any], which: Sum) -> list[Any]:
        code, signs = self.code, self.code.constant(which.sign)
        return [
            code.fma(code.shuffle(word, code.zero, which.second), signs, code.shuffle(word, code.zero, which.first))
            for word in y
        ]

    def _put(self, n: Index, y: list[Any]) -> None:
        words = self.grid.words
        rows = self.made.args[3]
        at = self.code.address(rows, self.code.builder.mul(self.code.integer(n), self.code.integer(self.row)))
        sides = self._side(y[:words], RIGHT)
        for v in range(self.vectors):
            sides += self._side(y[words * v : words * (v + 1)], LEFT)
        for k, word in enumerate(sides):
            self.code.store(word, at, 8 * k)

    def _orders(self, first: list[Any]) -> tuple[Any, Any, Any, list[Any]]:
        """The loop over orders: their number, how many were small at the end, the largest word, the sum."""
        code, b = self.code, self.code.builder
        entry = b.block
        head, body, out = (b.append_basic_block(name) for name in ("orders", "order", "summed"))
        b.branch(head)
        b.position_at_end(head)
        n, zeros, small = (b.phi(INT) for _ in range(3))
        wide = b.phi(VECTOR)
        y, total = ([b.phi(VECTOR) for _ in first] for _ in range(2))
        floating = range(self.grid.words - 1, len(first), self.grid.words) if not self.grid.whole else ()
        rest = {k: b.phi(VECTOR) for k in floating}
        carriers = [n, zeros, small, wide, *y, *total, *rest.values()]
        begin = [code.integer(0)] * 3 + [code.zero, *first, *first, *(code.zero for _ in rest)]
        for phi, value in zip(carriers, begin, strict=True):
            phi.add_incoming(value, entry)
        more = b.icmp_signed("<", n, code.integer(most_orders(self.grid)))
        b.cbranch(b.and_(more, b.icmp_signed("<", small, code.integer(2))), body, out)
        b.position_at_end(body)
        following, zeros_after, wide_after = self._order(n, zeros, wide, y)
        after = b.add(n, code.integer(1))
        self._put(after, following)
        size = self._size(following)
        limit = ir.Constant(DOUBLE, self.grid.smallest)
        counted = b.add(small, code.integer(1))
        small_after = b.select(b.fcmp_ordered("<=", size, limit), counted, code.integer(0))
        sums = [code.add(a, c) for a, c in zip(total, following, strict=True)]
        lost = []
        for k, before in rest.items():
            sums[k], error = code.two_sum(total[k], following[k])
            lost.append(code.add(before, error))
        values = [after, zeros_after, small_after, wide_after, *following, *sums, *lost]
        for phi, value in zip(carriers, values, strict=True):
            phi.add_incoming(value, b.block)
        b.branch(head)
        b.position_at_end(out)
        return n, small, wide, [code.add(word, rest[k]) if k in rest else word for k, word in enumerate(total)]

    def _size(self, y: list[Any]) -> Any:
        """The largest sum of |words| of a component."""
        code, words = self.code, self.grid.words
        largest = code.zero
        for v in range(self.vectors):
            one = code.absolute(y[words * v])
            for word in y[words * v + 1 : words * (v + 1)]:
                one = code.add(one, code.absolute(word))
            largest = code.larger(one, largest)
        return code.largest(largest)

    def _order(self, n: Any, zeros: Any, wide: Any, y: list[Any]) -> tuple[list[Any], Any, Any]:
        """y_(n+1), the number of its words that are 0 from now on, and the largest word over its limit."""
        words, code = self.grid.words, self.code
        found: list[Any] = []
        for v in range(self.vectors):
            products = self._products(n, zeros, v)
            rates, wide = self._rates(v, products, y[words * v : words * (v + 1)], wide)
            raised, wide = self._raised(rates, wide)
            quotient, wide = self._divided(n, self._times(raised), wide)
            found += quotient
        zeros_after = self._leading_zeros(found, zeros)
        b, places = code.builder, self.made.args[5]

        def begin(k: Any, _: list[Any]) -> None:
            b.store(b.add(n, code.integer(1)), code.address(places, b.add(k, code.integer(1))))

        # several at once, where the first order is far smaller than the state
        code.loop(zeros, zeros_after, begin, [])
        folded: list[Any] = []
        for v in range(self.vectors):
            one, wide = self._folded(found[words * v : words * (v + 1)], zeros_after, wide)
            folded += one
        return folded, zeros_after, wide

    def _products(self, n: Any, zeros: Any, vector: int) -> list[Any]:
        """S_n: for each number u of leading zero words on the left and w on the right, where orders have those."""
        code, b, words = self.code, self.code.builder, self.grid.words
        rows, sums, places, seen = self.made.args[3:7]
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
                    at = b.add(b.mul(low, code.integer(self.row)), b.mul(u, code.integer(8)))
                    against = b.add(b.mul(b.sub(n, low), code.integer(self.row)), b.mul(w, code.integer(8)))
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
        return [code.load(sums, 8 * k) for k in range(words)]

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

    def _rates(self, vector: int, sums: list[Any], y: list[Any], wide: Any) -> tuple[list[Any], Any]:
        """A ∘ gathered S + Σ B ∘ permuted y, and the largest word."""
        code, b, grid = self.code, self.code.builder, self.grid
        constants, seen = self.made.args[1], self.made.args[6]
        words, linear = grid.words, turned(self.system)
        gathered_bits = b.bitcast(code.load(seen, 0), INT_VECTOR)
        watched = Accumulator(code, grid, 0, sums, gathered_bits)
        watched.look_at_all()
        total = carried(
            code, grid, [code.subtract(s, c) for s, c in zip(sums, centred(code, grid, words), strict=True)]
        )
        sources = [self._gathered(total)]
        wide = self._watch(wide, sources[0][0], 0)
        sources += [[code.shuffle(word, code.zero, lanes) for word in y] for lanes in linear]
        result = Accumulator(code, grid, 0, centred(code, grid, words), watched.seen)
        for k, source in enumerate(sources):
            place = 8 * words * ((1 + len(linear)) * vector + k)
            factors = [code.load(constants, place + 8 * i) for i in range(words)]
            result.add_product(factors, source, each=True, below=not grid.whole)
        result.look_at_all()
        code.store(b.bitcast(result.seen, VECTOR), seen, 0)
        parts = zip(result.sums, centred(code, grid, words), strict=True)
        return carried(code, grid, [code.subtract(total, centre) for total, centre in parts]), wide

    def _gathered(self, total: list[Any]) -> list[Any]:
        code = self.code
        found = []
        for word in total:
            parts = []
            for column in GATHERED:
                lanes, signs = ([pair[i] for pair in column] for i in range(2))
                moved = code.shuffle(word, code.zero, [*lanes, 0, 0])
                parts.append(code.multiply(moved, code.constant([*signs, 0, 0])))
            found.append(code.add(code.add(parts[0], parts[1]), code.add(parts[2], parts[3])))
        return found

    def _raised(self, words: list[Any], wide: Any) -> tuple[list[Any], Any]:
        """Multiplied by 16 as often as is asked; seldom at all."""
        code, sixteen = self.code, self.code.constant(16.0)

        def once(_: Any, values: list[Any]) -> list[Any]:
            products = [code.multiply(word, sixteen) for word in values[:-1]]
            widest = values[-1]
            for k, word in enumerate(products):
                widest = self._watch(widest, word, k)
            return [*carried(code, self.grid, products), widest]

        values = code.loop(0, self.made.args[8], once, [*words, wide])
        return values[:-1], values[-1]

    def _times(self, words: list[Any]) -> list[Any]:
        """Each word times the factor, rounded to its grid; what is left goes to the next, exactly."""
        code, found, left = self.code, [], None
        factor = code.spread(self.made.args[7])
        for k, word in enumerate(words):
            big = code.constant(self.grid.centre(k))
            high = code.subtract(code.fma(word, factor, big), big)
            low = code.fma(word, factor, code.negative(high))
            found.append(high if left is None else code.add(high, left))
            left = low
        return found

    def _divided(self, n: Any, words: list[Any], wide: Any) -> tuple[list[Any], Any]:
        """Divided by n + 1, digit by digit: each remainder is exact and goes to the next word."""
        code, b = self.code, self.code.builder
        after = b.sitofp(b.add(n, code.integer(1)), DOUBLE)
        divisor, inverse = code.spread(after), code.spread(b.load(code.address(self.made.args[2], n)))
        found, rest = [], None
        for k, word in enumerate(words):
            value = word if rest is None else code.add(word, rest)
            wide = self._watch(wide, value, k, _WIDEST_DIVIDEND if k else _WIDEST)
            big = code.constant(self.grid.centre(k))
            quotient = code.subtract(code.fma(value, inverse, big), big)
            rest = code.fma(code.negative(quotient), divisor, value)
            found.append(quotient)
        if not self.grid.whole:
            found[-1] = code.fma(rest, inverse, found[-1])
        return found, wide

    def _watch(self, wide: Any, value: Any, k: int, bits: int = _WIDEST) -> Any:
        """The largest word so far, over 2^bits of its unit."""
        share = self.code.multiply(self.code.absolute(value), self.code.constant(2.0**-bits / self.grid.unit(k)))
        return self.code.larger(share, wide)

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
            wide = self._watch(wide, value, k)
            skipped = b.icmp_signed("<", code.integer(k), zeros)
            found.append(b.select(skipped, code.zero, value))
            left = b.select(skipped, value, code.zero)
        return found, wide
