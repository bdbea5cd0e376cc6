"""The Taylor recurrence of both systems in eight lanes: products of series in double-double below an order n0, in plain
doubles above it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from heavytop.top.equations import System
from heavytop.words.lanes import GATHERED, LEFT, RIGHT, Sum, turned
from heavytop.words.pairs import add, multiply
from heavytop.words.vector import Code, Index, Pair


@dataclass(frozen=True, slots=True)
class Layout:
    """Where numbers lie: each vector of a row is eight doubles.

    vectors: 1, or 2 with an attitude.  linear: permutations in the linear part.
    """

    vectors: int
    linear: int

    @property
    def row(self) -> int:
        """Doubles of one order: the two words of R, then of L and of y for each vector."""
        return 8 * (2 + 4 * self.vectors)

    @property
    def table_row(self) -> int:
        """Doubles of one order of the table: both words of A/(n + 1) and each B/(n + 1), for each vector."""
        return 16 * (1 + self.linear) * self.vectors

    def left(self, vector: int) -> int:
        """Where L of a vector is in a row; its low word is 8 behind, as all low words are."""
        return 16 + 32 * vector

    def value(self, vector: int) -> int:
        """Where y of a vector is in a row."""
        return 32 + 32 * vector


@dataclass(frozen=True, slots=True)
class Recurrence:
    """Writes the recurrence y_(n+1) = (A ∘ gathered S_n + Σ B_l ∘ permuted y_n)/(n + 1).

    table: A/(n + 1) and B_l/(n + 1) as pairs.  scratch: a row of R, L and y for each order.
    """

    code: Code
    layout: Layout
    system: System
    table: Any
    scratch: Any

    @property
    def vectors(self) -> range:
        """The state vectors."""
        return range(self.layout.vectors)

    def row(self, n: Index) -> Any:
        """Where the row of order n begins."""
        offset = self.code.builder.mul(self.code.integer(n), self.code.integer(self.layout.row))
        return self.code.address(self.scratch, offset)

    def pair(self, row: Any, place: int) -> Pair:
        """Both words of what lies there."""
        return self.code.load(row, place), self.code.load(row, place + 8)

    def _side_pair(self, y: Pair, which: Sum) -> Pair:
        first = [self.code.shuffle(word, self.code.zero, which.first) for word in y]
        signs = self.code.constant(which.sign)
        second = [self.code.multiply(self.code.shuffle(word, self.code.zero, which.second), signs) for word in y]
        return add(self.code, (first[0], first[1]), (second[0], second[1]))

    def _side(self, y: Any, which: Sum) -> Any:
        first, second = (self.code.shuffle(y, self.code.zero, lanes) for lanes in (which.first, which.second))
        return self.code.fma(second, self.code.constant(which.sign), first)

    def put(self, n: Index, y: list[Pair]) -> None:
        row = self.row(n)
        places = [(self._side_pair(y[0], RIGHT), 0)]
        for vector in self.vectors:
            places.append((self._side_pair(y[vector], LEFT), self.layout.left(vector)))
            places.append((y[vector], self.layout.value(vector)))
        for pair, place in places:
            for word in range(2):
                self.code.store(pair[word], row, place + 8 * word)

    def _put_plain(self, n: Index, y: list[Any]) -> None:
        row = self.row(n)
        self.code.store(self._side(y[0], RIGHT), row, 0)
        for vector in self.vectors:
            self.code.store(self._side(y[vector], LEFT), row, self.layout.left(vector))
            self.code.store(y[vector], row, self.layout.value(vector))
            self.code.store(self.code.zero, row, self.layout.value(vector) + 8)

    def _accumulate_pairs(self, m: Index, other: Index, sums: list[Any]) -> list[Any]:
        """Σ L_m R_other in words (s, c), c unordered."""
        code, left, right = self.code, self.row(m), self.row(other)
        high, low = self.pair(right, 0)
        found: list[Any] = []
        for vector in self.vectors:
            s, c = sums[2 * vector : 2 * vector + 2]
            a, a_low = self.pair(left, self.layout.left(vector))
            product, error = code.two_product(a, high)
            s, rounding = code.two_sum(s, product)
            c = code.add(code.add(c, rounding), code.fma(a, low, code.fma(a_low, high, error)))
            found += [s, c]
        return found

    def _accumulate(self, m: Index, other: Index, sums: list[Any]) -> list[Any]:
        left, right = self.row(m), self.row(other)
        high = self.code.load(right, 0)
        return [
            self.code.fma(self.code.load(left, self.layout.left(vector)), high, sums[vector]) for vector in self.vectors
        ]

    def _gather(self, word: Any, part: int) -> Any | None:
        lanes = [lane for lane, _ in GATHERED[part]] + [0, 0]
        signs = [sign for _, sign in GATHERED[part]] + [0, 0]
        moved = self.code.shuffle(word, self.code.zero, lanes)
        return self.code.multiply(moved, self.code.constant(signs))

    def _table_place(self, n: Index, vector: int, row: int) -> tuple[Any, int]:
        offset = self.code.builder.mul(self.code.integer(n), self.code.integer(self.layout.table_row))
        return self.code.address(self.table, offset), 16 * ((1 + self.layout.linear) * vector + row)

    def _next_pair(self, n: Index, vector: int, total: Pair, y: Pair) -> Pair:
        """y_(n+1) = A/(n + 1) ∘ gathered S_n + Σ B/(n + 1) ∘ permuted y_n."""
        code = self.code
        parts = [(self._gather(total[0], k), self._gather(total[1], k)) for k in range(4)]
        result = add(code, add(code, parts[0], parts[1]), add(code, parts[2], parts[3]))
        base, place = self._table_place(n, vector, 0)
        result = multiply(code, self.pair(base, place), result)
        linear: Pair | None = None
        for k, lanes in enumerate(turned(self.system), 1):
            base, place = self._table_place(n, vector, k)
            moved = tuple(code.shuffle(word, code.zero, lanes) for word in y)
            term = multiply(code, self.pair(base, place), (moved[0], moved[1]))
            linear = term if linear is None else add(code, linear, term)
        if linear is not None:
            result = add(code, result, linear)
        return code.quick_two_sum(*result)

    def _next(self, n: Index, vector: int, total: Any, y: Any) -> Any:
        code = self.code
        parts = [self._gather(total, k) for k in range(4)]
        result = code.add(code.add(parts[0], parts[1]), code.add(parts[2], parts[3]))
        linear = code.zero
        for k, lanes in enumerate(turned(self.system), 1):
            base, place = self._table_place(n, vector, k)
            linear = code.fma(code.load(base, place), code.shuffle(y, code.zero, lanes), linear)
        base, place = self._table_place(n, vector, 0)
        return code.fma(code.load(base, place), result, linear)

    def orders_in_pairs(self, first: list[Pair], low_order: Any) -> list[Any]:
        """y_1 to y_n0, the last returned; the products of y_n come last, so that the others need not wait for it."""
        code = self.code

        def order(n: Any, flat: list[Any]) -> list[Any]:
            y = [(flat[2 * v], flat[2 * v + 1]) for v in self.vectors]
            inner = partial(self._inner_pairs, n)
            sums = code.loop(1, n, inner, [code.zero] * (2 * len(self.vectors)))
            sums = self._accumulate_pairs(0, n, sums)
            sums = self._accumulate_pairs(n, 0, sums)
            return self._stored_pairs(n, sums, y)

        sums = self._accumulate_pairs(0, 0, [code.zero] * (2 * len(self.vectors)))
        flat = self._stored_pairs(0, sums, first)
        return code.loop(1, low_order, order, flat)

    def _inner_pairs(self, n: Any, m: Any, sums: list[Any]) -> list[Any]:
        return self._accumulate_pairs(m, self.code.builder.sub(n, m), sums)

    def _stored_pairs(self, n: Index, sums: list[Any], y: list[Pair]) -> list[Any]:
        following = [self._next_pair(n, v, (sums[2 * v], sums[2 * v + 1]), y[v]) for v in self.vectors]
        self.put(self.code.builder.add(self.code.integer(n), self.code.integer(1)), following)
        return [word for pair in following for word in pair]

    def plain_orders(self, low_order: Any, order: Any, last: list[Any]) -> None:
        """y_(n0+1) to y_N in plain doubles."""
        code, b, width = self.code, self.code.builder, len(self.vectors)

        def four(n: Any, k: Any, sums: list[Any]) -> list[Any]:
            m = b.add(b.shl(k, code.integer(2)), code.integer(1))
            found: list[Any] = []
            for i in range(4):
                at = b.add(m, code.integer(i))
                found += self._accumulate(at, b.sub(n, at), sums[width * i : width * (i + 1)])
            return found

        def one(n: Any, m: Any, sums: list[Any]) -> list[Any]:
            return self._accumulate(m, b.sub(n, m), sums)

        def body(n: Any, y: list[Any]) -> list[Any]:
            fours = b.lshr(b.sub(n, code.integer(1)), code.integer(2))
            parts = code.loop(0, fours, partial(four, n), [code.zero] * (4 * width))
            sums = [
                code.add(code.add(parts[v], parts[width + v]), code.add(parts[2 * width + v], parts[3 * width + v]))
                for v in self.vectors
            ]
            sums = code.loop(b.add(b.shl(fours, code.integer(2)), code.integer(1)), n, partial(one, n), sums)
            sums = self._accumulate(n, 0, self._accumulate(0, n, sums))
            following = [self._next(n, v, sums[v], y[v]) for v in self.vectors]
            self._put_plain(b.add(n, code.integer(1)), following)
            return following

        code.loop(low_order, order, body, last)
