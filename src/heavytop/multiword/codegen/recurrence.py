"""The Taylor recurrence of both systems in eight lanes: products of series in double-double below an order n0, in plain
doubles above it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Any

from gmpy2 import mpq

from heavytop.multiword.codegen.machine_code import Code, Index, Operand, Pair
from heavytop.multiword.double_double.arithmetic import Constant, accumulated, add, by_constant, divided
from heavytop.top.equations import Parameters, System

# The layout of the products of the three fields in eight lanes.
#
# A state vector holds Ω1 Ω2 Ω3 γ1 γ2 γ3 in lanes 0 to 5; an attitude vector ξ lies in lanes 3 to 5 of a second one,
# whose other lanes are 0.  Lanes 6 and 7 are 0.  The products of Taylor series that the fields need are then, lane by
# lane,
#
#     S_n = Σ_m L_m ∘ R_(n−m),   L, R: sums of two lanes of y,
#
# three lanes for Ω × Ω and five for γ × Ω: the determinant is a sum of five products, so that no sum runs across lanes.
# For ξ × Ω the left sides come from the second vector and the right sides are the same.  The derivative is
#
#     y' = A ∘ (S permuted and added) + Σ_l B_l ∘ (y permuted),
#
# with A = 1/2 in lanes 3 to 5.  A and B are computed from the field.


ZERO = 6
"""A lane that is 0 in every state vector."""


@dataclass(frozen=True, slots=True)
class Sum:
    """Lane by lane y[first] + sign y[second]; where the second is ZERO, y[first] alone."""

    first: tuple[int, ...]
    second: tuple[int, ...]
    sign: tuple[int, ...]


LEFT = Sum((1, 2, 0, 4, 3, 4, 5, 3), (6, 6, 6, 5, 4, 4, 4, 4), (0, 0, 0, 1, 1, 1, -1, -1))
RIGHT = Sum((2, 0, 1, 0, 1, 2, 0, 1), (6, 6, 6, 1, 2, 0, 1, 2), (0, 0, 0, -1, -1, -1, 1, 1))

# lanes 3 to 7 of S are T1 to T5: γ × Ω = (T1 + T3 − T4, T1 + T2 + T4 − T5, T2 + T3 + T5) / 2
GATHERED: tuple[tuple[tuple[int, int], ...], ...] = (
    ((0, 1), (1, 1), (2, 1), (3, 1), (3, 1), (4, 1)),
    ((0, 0), (0, 0), (0, 0), (5, 1), (4, 1), (5, 1)),
    ((0, 0), (0, 0), (0, 0), (6, -1), (6, 1), (7, 1)),
    ((0, 0), (0, 0), (0, 0), (0, 0), (7, -1), (0, 0)),
)
"""Four lists of (lane of S, sign), one for each lane 0 to 5 of the derivative; they are added."""

_NO_LANE = (ZERO,) * 5
_TORQUE, _TURNING = ((4, 5, 3, *_NO_LANE), (5, 3, 4, *_NO_LANE)), ((2, 0, 1, *_NO_LANE), (1, 2, 0, *_NO_LANE))
# γ × n for the heavy top; λ terms for the gyrostat; γ × n and k × Ω for the heavy gyrostat
_TURNED: dict[str, tuple[tuple[int, ...], ...]] = {
    "heavy_top": _TORQUE,
    "gyrostat": ((2, ZERO, 0, 5, ZERO, 3, ZERO, ZERO),),
    "heavy_gyrostat": (*_TORQUE, *_TURNING),
}
_TORQUES = {"heavy_top": 2, "gyrostat": 0, "heavy_gyrostat": 2}
"""The number of them, the first, that multiply γ in the rate of Ω."""


_BESIDE: dict[str, tuple[tuple[int, ...], ...]] = {
    "heavy_top": ((4, 5, 3, 5, 3, 4, ZERO, ZERO),),
    "gyrostat": _TURNED["gyrostat"],
    "heavy_gyrostat": ((4, 5, 3, 5, 3, 4, ZERO, ZERO), (2, 0, 1, 1, 2, 0, ZERO, ZERO)),
}


def paired_permutations(system: System) -> tuple[tuple[tuple[int, ...], ...], bool]:
    """The permutations of y in the linear part, two combined; whether lanes 3 to 5 are then added to 0 to 2."""
    return _BESIDE[system.name], len(_TURNED[system.name]) > 1


def permutations(system: System) -> tuple[tuple[int, ...], ...]:
    """The permutations of y in the linear part, one, two or four."""
    return _TURNED[system.name]


@dataclass(frozen=True, slots=True)
class Coefficients:
    """A and B_l of each state vector, eight exact numbers each: shape (vectors, 1 + number of permutations, 8).

    torques: the number of B_l, the first, that multiply γ in the rate of Ω.  torque, turning: the largest |coefficient|
    of the first vector in those and in the others.
    """

    vectors: tuple[tuple[tuple[Fraction, ...], ...], ...]
    torques: int
    torque: Fraction
    turning: Fraction

    @property
    def largest(self) -> Fraction:
        """The largest |coefficient|."""
        return max(abs(c) for vector in self.vectors for row in vector for c in row)

    @property
    def paired(self) -> tuple[tuple[tuple[Fraction, ...], ...], ...]:
        """A and one B of each vector for each permutation of :func:`paired_permutations`."""
        return tuple(
            (first, *linear)
            if len(linear) == 1
            else (first, *((*a[:3], *b[:3], *a[6:]) for a, b in zip(linear[::2], linear[1::2], strict=True)))
            for first, *linear in self.vectors
        )

    def with_linear(self, torque: Fraction, turning: Fraction) -> Coefficients:
        """The coefficients with scaled B: by ``torque`` where they multiply γ in the rate of Ω, else by ``turning``."""
        factors = [Fraction(1), *(torque if k < self.torques else turning for k in range(len(self.vectors[0]) - 1))]
        return Coefficients(
            tuple(
                tuple(tuple(c and c * factor for c in row) for row, factor in zip(rows, factors, strict=True))
                for rows in self.vectors
            ),
            self.torques,
            self.torque * torque,
            self.turning * turning,
        )

    def without(self, components: AbstractSet[int]) -> Coefficients:
        """The coefficients with rates 0 of these components of (Ω, γ, ξ)."""
        kept = [[3 * vector + lane not in components for lane in range(8)] for vector in range(len(self.vectors))]
        vectors = (
            tuple(tuple(c if keep else Fraction(0) for c, keep in zip(row, lanes, strict=True)) for row in rows)
            for rows, lanes in zip(self.vectors, kept, strict=True)
        )
        return replace(self, vectors=tuple(vectors))


@lru_cache(maxsize=256)
def coefficients(system: System, p: Parameters, attitude: bool) -> Coefficients:
    """The coefficients of the field, exactly, for exact parameters."""
    exactly = p.mapped(mpq)  # quicker than Fractions, and as exact
    coefficients = coefficients_of(system, lambda y: system.field(exactly, y), mpq(1, 2))
    if not attitude:
        return coefficients
    # ξ' = ξ × ω turns as γ does
    third = [[Fraction(0)] * 3 + list(row[3:6]) for row in coefficients.vectors[0]]
    return replace(coefficients, vectors=(coefficients.vectors[0], tuple(_eight(row) for row in third)))


def coefficients_of(system: System, rates: Callable[[Sequence[Any]], Sequence[Any]], turning: mpq) -> Coefficients:
    """The coefficients of a field whose terms are some of those of ``system``, with A = ``turning`` in lanes 3 to 5."""

    def unit(*axes: int) -> list[Any]:
        return [mpq(int(axis in axes)) for axis in range(6)]

    others = ((1, 2), (2, 0), (0, 1))
    at, against = ([rates([sign * v for v in unit(j)]) for j in range(6)] for sign in (1, -1))
    products = [rates(unit(i, j))[k] - at[i][k] - at[j][k] for k, (i, j) in enumerate(others)]
    linear = [[(a - b) / 2 for a, b in zip(*pair, strict=True)] for pair in zip(at, against, strict=True)]
    permuted = [[mpq(0) if j == ZERO else linear[j][k] for k, j in enumerate(row[:6])] for row in permutations(system)]
    rows = [_eight(row) for row in ([*products, turning, turning, turning], *permuted)]
    torques = _TORQUES[system.name]
    sizes = [[abs(c) for row in part for c in row] for part in (rows[1 : 1 + torques], rows[1 + torques :])]
    largest = [max(part, default=Fraction(0)) for part in sizes]
    return Coefficients((tuple(rows),), torques, *largest)


def _eight(row: Sequence[Any]) -> tuple[Fraction, ...]:
    return tuple(Fraction(int(c.numerator), int(c.denominator)) for c in row) + (Fraction(0),) * (8 - len(row))


def rates(system: System, coefficients: Coefficients, y: Sequence[Any]) -> list[Any]:
    """The derivative of (Ω, γ) or (Ω, γ, ξ) by the formula of the lanes, exact for exact numbers."""
    return series_rates(system, coefficients, [y])


def series_rates(system: System, coefficients: Coefficients, series: Sequence[Sequence[Any]]) -> list[Any]:
    """Coefficient n of the derivative of a motion, from its Taylor coefficients 0 to n."""
    lanes = [[[*y[:6], 0, 0], [0, 0, 0, *y[6:], 0, 0]][: len(coefficients.vectors)] for y in series]
    right = [_side(y[0], RIGHT) for y in reversed(lanes)]
    rates: list[Any] = []
    for vector, (first, *linear) in enumerate(coefficients.vectors):
        left, state = [_side(y[vector], LEFT) for y in lanes], lanes[-1][vector]
        products = [sum(a[k] * b[k] for a, b in zip(left, right, strict=True)) for k in range(8)]
        gathered = [sum(sign * products[lane] for lane, sign in column) for column in zip(*GATHERED, strict=True)]
        derivative = [a * s for a, s in zip(first, gathered, strict=False)]
        for row, permutation in zip(linear, permutations(system), strict=True):
            derivative = [d + b * state[lane] for d, b, lane in zip(derivative, row, permutation, strict=False)]
        rates += derivative[3 * vector :]
    return rates


def _side(y: Sequence[Any], which: Sum) -> list[Any]:
    return [y[a] + sign * y[b] for a, b, sign in zip(which.first, which.second, which.sign, strict=True)]


LEAST_LOW_ORDER = 2
MOST_ORDER = 60
"""n0 is at least the one, N at most the other."""
_NONE = 8
"""A lane of the second operand of a shuffle, which is 0."""


@dataclass(frozen=True, slots=True)
class Layout:
    """The layout of arrays: each vector of a row is eight doubles.

    vectors: 1, or 2 with an attitude.  linear: permutations in the linear part.
    """

    vectors: int
    linear: int

    @property
    def row(self) -> int:
        """Doubles of one order: two words of R and its two parts, then the same of L, and two words of y, for each
        vector.
        """
        return 8 * (4 + 6 * self.vectors)

    @property
    def constants(self) -> int:
        """A and each B of every vector."""
        return (1 + self.linear) * self.vectors

    @property
    def table_row(self) -> int:
        """Doubles of one order of the table: n + 1 and its inverse in two words, then A/(n + 1) and each B/(n + 1)."""
        return 8 * (1 + self.constants)

    @property
    def state(self) -> int:
        """Doubles of a state: two words of each vector, units of the next step, and of the last."""
        return 32 * self.vectors

    @property
    def units(self) -> int:
        """Offset in a state of the units of split coefficients."""
        return 16 * self.vectors

    def left(self, vector: int) -> int:
        """Offset in a row of L of a vector; low words follow 8 doubles later."""
        return 32 + 48 * vector

    def value(self, vector: int) -> int:
        """Offset in a row of y of a vector."""
        return 64 + 48 * vector


@dataclass(frozen=True, slots=True)
class Recurrence:
    """Writes the recurrence y_(n+1) = (A ∘ gathered S_n + Σ B_l ∘ permuted y_n)/(n + 1).

    table: A and B_l in three words, then a row for each order.  scratch: a row of R, L and y for each order.
    """

    code: Code
    layout: Layout
    system: System
    table: Operand
    scratch: Operand

    @property
    def vectors(self) -> range:
        """The state vectors."""
        return range(self.layout.vectors)

    def row(self, n: Index) -> Operand:
        """The address of the row of order n."""
        return self.code.address(self.scratch, self.code.integer(n) * self.layout.row)

    def pair(self, row: Operand, offset: int) -> Pair:
        """Both words of a pair at the offset."""
        return self.code.load(row, offset), self.code.load(row, offset + 8)

    def _side_pair(self, y: Pair, which: Sum) -> Pair:
        first = [self.code.shuffle(word, self.code.zero, which.first) for word in y]
        signs = self.code.constant(which.sign)
        second = [self.code.shuffle(word, self.code.zero, which.second) * signs for word in y]
        return add(self.code, (first[0], first[1]), (second[0], second[1]))

    def side(self, y: Operand, which: Sum) -> Operand:
        """L or R of a plain double, or of a part that is exact."""
        first, second = (self.code.shuffle(y, self.code.zero, lanes) for lanes in (which.first, which.second))
        return self.code.fma(second, self.code.constant(which.sign), first)

    def put(self, n: Index, y: list[Pair]) -> None:
        row = self.row(n)
        sides = [(self._side_pair(y[0], RIGHT), 0)]
        for vector in self.vectors:
            sides.append((self._side_pair(y[vector], LEFT), self.layout.left(vector)))
            sides.append((y[vector], self.layout.value(vector)))
        for pair, offset in sides:
            for word in range(2):
                self.code.store(pair[word], row, offset + 8 * word)

    def _put_plain(self, n: Index, y: list[Operand]) -> list[Operand]:
        """Store a row; returns R, each L and each y."""
        row = self.row(n)
        right, left = self.side(y[0], RIGHT), [self.side(value, LEFT) for value in y]
        self.code.store(right, row, 0)
        for vector in self.vectors:
            self.code.store(left[vector], row, self.layout.left(vector))
            self.code.store(y[vector], row, self.layout.value(vector))
            self.code.store(self.code.zero, row, self.layout.value(vector) + 8)
        return [right, *left, *y]

    def _accumulate_pairs(self, m: Index, other: Index, sums: list[Operand]) -> list[Operand]:
        """Σ L_m R_other in words (s, c), c unordered."""
        code, left, right = self.code, self.row(m), self.row(other)
        added: list[Any] = []
        for vector in self.vectors:
            total = (sums[2 * vector], sums[2 * vector + 1])
            added += accumulated(code, total, self.pair(left, self.layout.left(vector)), self.pair(right, 0))
        return added

    def _accumulate(self, m: Index, other: Index, sums: list[Operand]) -> list[Operand]:
        left, right = self.row(m), self.row(other)
        high = self.code.load(right, 0)
        return [
            self.code.fma(self.code.load(left, self.layout.left(vector)), high, sums[vector]) for vector in self.vectors
        ]

    def _gather(self, word: Operand, part: int) -> Operand:
        """One of four summands of the products, without its signs; 0 where absent."""
        lanes = [lane if sign else _NONE for lane, sign in GATHERED[part]]
        return self.code.shuffle(word, self.code.zero, [*lanes, _NONE, _NONE])

    def _signed(self, value: Operand, part: int) -> Operand:
        return value if min(_signs(part)) >= 0 else value * self.code.constant(_signs(part))

    def _anywhere(self, word: Operand, part: int) -> Operand:
        """One of four summands; an arbitrary number where absent."""
        return self.code.shuffle(word, word, [*(lane for lane, _ in GATHERED[part]), 0, 0])

    def constant(self, vector: int, row: int) -> Constant:
        """A, or B of a row from 1 on."""
        offset = 24 * ((1 + self.layout.linear) * vector + row)
        return (*self.pair(self.table, offset), self.code.load(self.table, offset + 16))

    def gathered(self, total: Operand) -> Operand:
        """The sums of products that the field needs, where they are exact."""
        result = self._anywhere(total, 0) * self.code.constant(_signs(0))
        for k in range(1, len(GATHERED)):
            result = self.code.fma(self._anywhere(total, k), self.code.constant(_signs(k)), result)
        return result

    def divisor(self, n: Index) -> Pair:
        """n + 1 and its inverse, doubles."""
        base = self._table_row(n)
        words = [self.code.spread(self.code.load_one(base, k)) for k in range(2)]
        return words[0], words[1]

    def _table_row(self, n: Index) -> Operand:
        offset = self.code.integer(n) * self.layout.table_row
        return self.code.address(self.table, offset + 24 * self.layout.constants)

    def _over(self, n: Index, vector: int, row: int) -> Operand:
        """A constant over n + 1, a double."""
        return self.code.load(self._table_row(n), 8 * (1 + (1 + self.layout.linear) * vector + row))

    def _next_pair(self, n: Index, vector: int, total: Pair, y: Pair) -> Pair:
        """y_(n+1) = (A ∘ gathered S_n + Σ B ∘ permuted y_n)/(n + 1)."""
        code, base = self.code, self._table_row(n)
        parts = []
        for k in range(4):
            high, low = (self._signed(self._gather(word, k), k) for word in total)
            parts.append((high, low))
        result = add(code, add(code, parts[0], parts[1]), add(code, parts[2], parts[3]))
        result = by_constant(code, self.constant(vector, 0), result)
        linear: Pair | None = None
        for k, lanes in enumerate(permutations(self.system), 1):
            moved = tuple(code.shuffle(word, code.zero, lanes) for word in y)
            term = by_constant(code, self.constant(vector, k), (moved[0], moved[1]))
            linear = term if linear is None else add(code, linear, term)
        if linear is not None:
            result = add(code, result, linear)
        after, high, low = (code.spread(code.load_one(base, k)) for k in range(3))
        return code.quick_two_sum(*divided(code, result, after, (high, low)))

    def _next(self, n: Index, vector: int, total: Operand, y: Operand) -> Operand:
        code = self.code
        linear = code.zero
        for k, lanes in enumerate(permutations(self.system), 1):
            linear = code.fma(self._over(n, vector, k), code.shuffle(y, code.zero, lanes), linear)
        a = self._over(n, vector, 0)
        # two sums side by side, the signs in the factors
        first, second, third, fourth = ((self._gather(total, k), self._signed(a, k)) for k in range(4))
        first_sum = code.fma(*second, code.fma(*first, linear))
        return first_sum + code.fma(*fourth, third[0] * third[1])

    def orders_in_pairs(self, first: list[Pair], low_order: Operand) -> list[Operand]:
        """Write y_1 to y_n0 and return the last; the products of y_n come last, as the others need not wait for it."""
        code, zeros = self.code, [self.code.zero] * (2 * len(self.vectors))

        def order(n: Operand, words: list[Operand]) -> list[Operand]:
            y = [(words[2 * v], words[2 * v + 1]) for v in self.vectors]
            sums = code.loop(1, n, lambda m, sums: self._accumulate_pairs(m, n - m, sums), zeros)
            sums = self._accumulate_pairs(n, 0, self._accumulate_pairs(0, n, sums))
            return self._stored_pairs(n, sums, y)

        words = self._stored_pairs(0, self._accumulate_pairs(0, 0, zeros), first)
        return code.loop(1, low_order, order, words)

    def _stored_pairs(self, n: Index, sums: list[Operand], y: list[Pair]) -> list[Operand]:
        following = [self._next_pair(n, v, (sums[2 * v], sums[2 * v + 1]), y[v]) for v in self.vectors]
        self.put(self.code.integer(n) + 1, following)
        return [word for pair in following for word in pair]

    def plain_orders(self, low_order: Operand, order: Operand, last: list[Operand]) -> None:
        """Write y_(n0+1) to y_N in plain doubles; each order has its own code, entered at n0 and left at N."""
        code, b, row = self.code, self.code.builder, self.row(low_order)
        sides = [code.load(row, offset) for offset in (0, *map(self.layout.left, self.vectors))]
        after = b.append_basic_block("summed")
        switch, before = b.switch(low_order, after), b.block
        entry, incoming = before, None
        blocks = {n: b.append_basic_block(f"order_{n}") for n in range(LEAST_LOW_ORDER, MOST_ORDER)}
        for n, block in blocks.items():
            switch.add_case(n, block)
            b.position_at_end(block)
            carried = [code.phi(value.type) for value in (*sides, *last)]
            code.add_incoming(carried, [*sides, *last], entry)
            if incoming is not None:
                code.add_incoming(carried, incoming, before)
            incoming, before = self._plain_order(n, carried), block
            next_block = blocks.get(n + 1, after)
            b.cbranch(order == n + 1, after, next_block)
        b.position_at_end(after)

    def _plain_order(self, n: int, values: list[Operand]) -> list[Operand]:
        """R, each L and each y of order n + 1 from those of n, with four sums side by side.

        The products of y_n come last, from registers.
        """
        code, width = self.code, len(self.vectors)
        right, left, y = values[0], values[1 : 1 + width], values[1 + width :]
        sums = [code.zero] * (4 * width)
        for m in range(1, n):
            at = width * (m % 4)
            sums[at : at + width] = self._accumulate(m, n - m, sums[at : at + width])
        first = self.row(0)
        totals = [sums[v] + sums[width + v] + (sums[2 * width + v] + sums[3 * width + v]) for v in self.vectors]
        totals = [code.fma(code.load(first, self.layout.left(v)), right, totals[v]) for v in self.vectors]
        totals = [code.fma(left[v], code.load(first, 0), totals[v]) for v in self.vectors]
        return self._put_plain(n + 1, [self._next(n, v, totals[v], y[v]) for v in self.vectors])


def _signs(part: int) -> list[int]:
    """The signs of a summand of the products, lane by lane; 0 where absent."""
    return [*(sign for _, sign in GATHERED[part]), 0, 0]
