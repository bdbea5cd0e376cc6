"""The Taylor recurrence of eight motions side by side, a lane each: in double-double, split, and in plain doubles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from heavytop.top.equations import System
from heavytop.words.lanes import ZERO, turned
from heavytop.words.pairs import Constant, accumulated, add, by_constant, divided, multiply
from heavytop.words.recurrence import MOST_ORDER
from heavytop.words.split_orders import parts, quotient, rises
from heavytop.words.vector import DOUBLE, LANES, Code, Pair

ROW = 6 * LANES
"""Doubles of one order in each of four tables."""
LOW, COARSE, FINE, SCRATCH = (k * ROW * MOST_ORDER for k in range(1, 5))
"""Where the tables of low words and of the two parts of split coefficients begin, behind that of high words; low words
of orders above n0 are 0 from the beginning.  Apart from each other, what an order needs fits into the nearest cache."""

Products = Sequence[tuple[int, int, int, int]]
# (left, right, component of the sum, sign): Ω × Ω without its coefficients, and γ × Ω
_OMEGA = (1, 2, 0, 1), (2, 0, 1, 1), (0, 1, 2, 1)
_GAMMA = (4, 2, 3, 1), (5, 0, 4, 1), (3, 1, 5, 1), (5, 1, 3, -1), (3, 2, 4, -1), (4, 0, 5, -1)
_GROUPS = (range(3), _OMEGA), (range(3, 6), _GAMMA)


def terms(system: System) -> list[tuple[int, int, int]]:
    """(row of the coefficients, component, component that it multiplies) of the linear part."""
    return [
        (row, lane, source)
        for row, lanes in enumerate(turned(system), 1)
        for lane, source in enumerate(lanes[:6])
        if source != ZERO
    ]


class LaneOrders:
    """Writes the recurrence.

    arrays: A and each B, 1/(n + 1), and a row for each order.  units: three vectors, 1.5 · 2^52 units of split
    coefficients, of Ω and of γ, and their slope.
    """

    def __init__(self, code: Code, system: System, arrays: tuple[Any, Any, Any], units: Any) -> None:
        self.code, self.units = code, units
        self.coefficients, self.quotients, self.scratch = arrays
        self.terms = [(k, component, source) for k, (_, component, source) in enumerate(terms(system), 3)]
        self.absent = {k: self._is_zero(k) for k in (2, *(k for k, *_ in self.terms))}

    def write(self, pair_order: Any, low_order: Any, order: Any) -> tuple[Any, list[Any]]:
        """y_1 to y_N; whether any are split, a bit, and the largest |y_m| 2^(e_0 - e_m) of Ω and of γ."""
        code, b = self.code, self.code.builder
        code.loop(0, pair_order, self._pair_order, [])
        splitting = b.icmp_signed("<", pair_order, low_order)
        stop = b.select(splitting, b.add(pair_order, code.integer(1)), code.integer(0))
        peaks = code.loop(0, stop, self._split_row, [code.zero] * 2)
        peaks = code.loop(pair_order, low_order, self._split_order, peaks)
        plain = partial(self._plain_orders, low_order, order)
        code.either(self.absent[2], lambda: plain(_OMEGA[:2]), lambda: plain(_OMEGA))
        return splitting, peaks

    def row(self, n: Any) -> Any:
        """Where the row of order n begins."""
        return self.code.address(self.scratch, self.code.builder.mul(self.code.integer(n), self.code.integer(ROW)))

    def pair(self, row: Any, i: int) -> Pair:
        """Both words of a component of a row."""
        return self.code.load(row, LANES * i), self.code.load(row, LOW + LANES * i)

    def _put(self, row: Any, i: int, y: Pair) -> None:
        for word, table in zip(y, (0, LOW), strict=True):
            self.code.store(word, row, table + LANES * i)

    def _coefficient(self, k: int) -> Constant:
        high, middle, low = (self.code.load(self.coefficients, 24 * k + 8 * word) for word in range(3))
        return high, middle, low

    def _is_zero(self, k: int) -> Any:
        """Whether a coefficient is 0 in every lane, a bit."""
        return self.code.all_of(self.code.builder.fcmp_ordered("==", self._coefficient(k)[0], self.code.zero))

    def _sums(self, group: Products, sums: Callable[[Products], list[Any]]) -> list[Any]:
        """``sums`` of a group of products; those of Ω3 are zeros, not computed, where all tops have I1 = I2."""
        if group is not _OMEGA:
            return sums(group)

        def two() -> list[Any]:
            found = sums(group[:2])
            return [*found, *[self.code.zero] * (len(found) // 2)]

        return self.code.either(self.absent[2], two, lambda: sums(group))

    def _quotient(self, n: Any) -> Pair:
        """1/(n + 1) in every lane."""
        place = self.code.address(self.quotients, self.code.builder.shl(n, self.code.integer(1)))
        words = [self.code.builder.load(self.code.address(place, i)) for i in range(2)]
        return self.code.spread(words[0]), self.code.spread(words[1])

    def _pair_order(self, n: Any, _: list[Any]) -> None:
        """y_(n+1) in double-double."""
        code, b = self.code, self.code.builder
        y, following, quotient = self.row(n), self.row(b.add(n, code.integer(1))), self._quotient(n)
        after = code.spread(b.sitofp(b.add(n, code.integer(1)), DOUBLE))
        for rows, group in _GROUPS:
            words = self._sums(group, partial(self._pair_sums, n))
            for i in rows:
                total = code.quick_two_sum(*words[2 * (i % 3) : 2 * (i % 3) + 2])
                if i < 3:
                    total = by_constant(code, self._coefficient(i), total)
                for k, component, source in self.terms:
                    if component == i:
                        total = self._with_term(k, total, self.pair(y, source))
                high, low = code.quick_two_sum(*divided(code, total, after, quotient))
                self._put(following, i, (high, low))

    def _with_term(self, k: int, total: Pair, y: Pair) -> Pair:
        def added() -> list[Any]:
            return [*add(self.code, total, by_constant(self.code, self._coefficient(k), y))]

        high, low = self.code.either(self.absent[k], lambda: [*total], added)
        return high, low

    def _pair_sums(self, n: Any, group: Products) -> list[Any]:
        products = partial(self._pair_products, n, group)
        stop = self.code.builder.add(n, self.code.integer(1))
        return self.code.loop(1, stop, products, products(self.code.integer(0), []))

    def _pair_products(self, n: Any, group: Products, m: Any, words: list[Any]) -> list[Any]:
        code, b = self.code, self.code.builder
        left, right = self.row(m), self.row(b.sub(n, m))
        found = list(words) or [None] * 2 * (1 + group[-1][2] % 3)
        for first, second, component, sign in group:
            (a, a_low), (c, c_low) = self.pair(left, first), self.pair(right, second)
            if sign < 0:
                c, c_low = code.negative(c), code.negative(c_low)
            at = 2 * (component % 3)
            x, y = (a, a_low), (c, c_low)
            total = found[at], found[at + 1]
            found[at : at + 2] = multiply(code, x, y) if total[0] is None else accumulated(code, total, x, y)
        return found

    def _split_row(self, m: Any, peaks: list[Any]) -> list[Any]:
        """Split y_m; the largest |y_m| 2^(e_0 - e_m) of Ω and of γ, this one with it."""
        row = self.row(m)
        return self._put_parts(m, [self.pair(row, i) for i in range(6)], peaks)

    def _put_parts(self, m: Any, y: list[Pair], peaks: list[Any]) -> list[Any]:
        code, row, found = self.code, self.row(m), []
        up, down = rises(code, m, code.load(self.units, 16))
        for k, (rows, _) in enumerate(_GROUPS):
            big, largest = code.multiply(code.load(self.units, 8 * k), up), code.zero
            for i in rows:
                coarse, fine = parts(code, y[i], big)
                largest = code.larger(code.absolute(y[i][0]), largest)
                code.store(coarse, row, COARSE + LANES * i)
                code.store(fine, row, FINE + LANES * i)
            found.append(code.larger(code.multiply(largest, down), peaks[k]))
        return found

    def _split_order(self, n: Any, peaks: list[Any]) -> list[Any]:
        """y_(n+1) from split coefficients."""
        code, b = self.code, self.code.builder
        y, following = self.row(n), self.row(b.add(n, code.integer(1)))
        divisor = code.spread(b.sitofp(b.add(n, code.integer(1)), DOUBLE)), self._quotient(n)[0]
        found = []
        for rows, group in _GROUPS:
            words = self._sums(group, partial(self._split_sums, n))
            for i in rows:
                at = 3 * (i % 3)
                total = words[at], code.add(words[at + 1], words[at + 2])
                factors = [(self._coefficient(i), total)] if i < 3 else []
                for k, component, source in self.terms:
                    if component == i:
                        factors.append((self._coefficient(k), self.pair(y, source)))
                pair = quotient(code, None if i < 3 else total, factors, divisor)
                self._put(following, i, pair)
                found.append(pair)
        return self._put_parts(b.add(n, code.integer(1)), found, peaks)

    def _split_sums(self, n: Any, group: Products) -> list[Any]:
        code = self.code
        zeros = [code.zero] * 3 * (1 + group[-1][2] % 3)
        return code.loop(0, code.builder.add(n, code.integer(1)), partial(self._split_products, n, group), zeros)

    def _split_products(self, n: Any, group: Products, m: Any, sums: list[Any]) -> list[Any]:
        code, left, right = self.code, self.row(m), self.row(self.code.builder.sub(n, m))
        found = list(sums)
        for first, second, component, sign in group:
            a, rest = (code.load(left, part + LANES * first) for part in (COARSE, FINE))
            coarse, fine = (code.load(right, part + LANES * second) for part in (COARSE, FINE))
            if sign < 0:
                a, rest = code.negative(a), code.negative(rest)
            at = 3 * (component % 3)
            whole = code.load(right, LANES * second)
            for k, (one, factor) in enumerate(((a, coarse), (a, fine), (rest, whole))):
                found[at + k] = code.fma(one, factor, found[at + k])
        return found

    def _plain_orders(self, start: Any, stop: Any, omega: Products) -> list[Any]:
        """y_(start+1) to y_stop in plain doubles; omega: those products of Ω that are needed."""
        code, b, one = self.code, self.code.builder, self.code.integer(1)
        count = b.sub(stop, start)
        odd = b.and_(count, one)
        code.loop(0, odd, lambda _, values: self._plain_order(omega, start), [])
        begin = b.add(start, odd)
        two = partial(self._two_plain_orders, omega)
        return code.loop(0, b.lshr(count, one), lambda k, _: two(b.add(begin, b.shl(k, one))), [])

    def _plain_order(self, group: Products, n: Any) -> None:
        """y_(n+1)."""
        code, b = self.code, self.code.builder

        def products(m: Any, sums: list[Any]) -> list[Any]:
            return self._both(group, self._highs(m), self._highs(b.sub(n, m)), sums)

        sums = code.loop(0, b.add(n, code.integer(1)), products, [code.zero] * 6)
        self._plain_rates(n, range(6), sums)

    def _two_plain_orders(self, group: Products, n: Any) -> None:
        """y_(n+1) and y_(n+2).

        Sums of γ_(n+1) wait for each other, twice as long as those of Ω_(n+1); so those of y_(n+2), which begin with
        Ω_(n+1), go beside them.
        """
        code, b = self.code, self.code.builder
        after = b.add(n, code.integer(1))

        def alone(m: Any, sums: list[Any]) -> list[Any]:
            return self._plain(group, self._highs(m), self._highs(b.sub(n, m)), sums)

        def beside(m: Any, values: list[Any]) -> list[Any]:
            y, omega, following = self._highs(m), self._highs(b.sub(n, m))[:3], values[9:]
            gamma = self._plain(_GAMMA, y, omega, values[:3])
            return [*gamma, *self._both(group, y, following, values[3:9]), *omega]

        self._plain_rates(n, range(3), code.loop(0, after, alone, [code.zero] * 3))
        values = code.loop(0, after, beside, [*[code.zero] * 9, *self._highs(after)[:3]])
        self._plain_rates(n, range(3, 6), values[:3])
        last = self._both(group, self._highs(after), self._highs(code.integer(0)), values[3:9])
        self._plain_rates(after, range(6), last)

    def _highs(self, n: Any) -> list[Any]:
        """The high words of y_n."""
        row = self.row(n)
        return [self.code.load(row, LANES * i) for i in range(6)]

    def _both(self, group: Products, y: list[Any], omega: list[Any], sums: list[Any]) -> list[Any]:
        return [*self._plain(group, y, omega, sums[:3]), *self._plain(_GAMMA, y, omega, sums[3:])]

    def _plain(self, group: Products, y: list[Any], omega: list[Any], sums: list[Any]) -> list[Any]:
        """Three sums with the products of Ω and of the same part of y."""
        code, found = self.code, list(sums)
        for first, second, component, sign in group:
            factor = y[first] if sign > 0 else code.negative(y[first])
            found[component % 3] = code.fma(factor, omega[second], found[component % 3])
        return found

    def _plain_rates(self, n: Any, components: Sequence[int], sums: list[Any]) -> None:
        """Components of y_(n+1) from their sums."""
        code, b = self.code, self.code.builder
        y, following, quotient = self.row(n), self.row(b.add(n, code.integer(1))), self._quotient(n)[0]
        for i, products in zip(components, sums, strict=True):
            total = code.multiply(self._coefficient(i)[0], products) if i < 3 else products
            for k, component, source in self.terms:
                if component == i:
                    total = code.fma(self._coefficient(k)[0], code.load(y, LANES * source), total)
            code.store(code.multiply(total, quotient), following, LANES * i)
