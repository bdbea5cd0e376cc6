"""Taylor coefficients of a motion of a quadratic field in integers, each rounded once.

In units of 2^-precision, for steps h = 2^-halvings: b_{n+1} = round(h f_n/(n + 1)), where f_n needs every product
b_j b_{n−j}.  Inside short blocks these are summed one by one; between blocks they are products of polynomials
with integer coefficients, as soon as both factors are known (relaxed multiplication; J. van der Hoeven, "Relax, but
don't be too lazy", 2002).  All sums are exact, so the coefficients do not depend on the way they were summed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import lcm
from operator import mul
from typing import Protocol

from flint import fmpz_poly
from gmpy2 import mpz

from heavytop.multiword.problem import OTHER_AXES, ResumableRun, Scaled, Status

_BLOCK = 64


@dataclass(frozen=True, slots=True)
class QuadraticComponent:
    """One component of a field of degree two, (Σ c y_j y_k + Σ c y_j) / denominator with integers c.

    products: (c, index of the pair (j, k)).  linear: (c, j).
    """

    denominator: int
    products: tuple[tuple[int, int], ...]
    linear: tuple[tuple[int, int], ...]


class QuadraticField(Protocol):
    """A field of degree two without a constant part."""

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """The products y_j y_k that occur."""

    @property
    def rows(self) -> tuple[QuadraticComponent, ...]:
        """The components."""


def coefficients(
    motion: QuadraticField, centre: Sequence[int], precision: int, halvings: int
) -> list[list[mpz]] | None:
    """b_0, b_1, ... of each component, up to two successive ones within 2 units; None where the series is too long.

    It should end within 0.45 orders per bit; a step twice too long is abandoned at half an order per bit.
    """
    longest = max(abs(value) for value in centre).bit_length() // 2 + 32
    series = _Series(motion, precision, precision + halvings, longest, [[mpz(value)] for value in centre])
    size = _BLOCK
    while size < longest:
        size *= 2
    series.fill(0, size)
    return series.values if series.settled else None


@dataclass(slots=True)
class _Series:
    """values: the known coefficients of each component.  between: the sums of products of each row so far."""

    motion: QuadraticField
    precision: int
    shift: int
    longest: int
    values: list[list[mpz]]
    between: list[list[mpz]] = field(default_factory=list)
    settled: bool = False

    def __post_init__(self) -> None:
        self.between = [[mpz(0)] * self.longest for _ in self.motion.rows]

    def fill(self, low: int, high: int) -> None:
        """b_{n+1} for low ≤ n < high."""
        if self.settled or low >= self.longest:
            return
        if high - low <= _BLOCK:
            self._fill_block(low, min(high, self.longest))
            return
        middle = (low + high) // 2
        self.fill(low, middle)
        if not self.settled and middle < self.longest:
            self._multiply(low, middle, min(high, self.longest))
            self.fill(middle, high)

    def _fill_block(self, low: int, high: int) -> None:
        y = self.values
        for n in range(low, high):
            sums = [self._within(y[j], y[k], low, n) for j, k in self.motion.pairs]
            last = [component[n] for component in y]
            for component, row, before in zip(y, self.motion.rows, self.between, strict=True):
                linear = sum((c * last[j] for c, j in row.linear), mpz(0))
                numerator = sum((c * sums[pair] for c, pair in row.products), before[n] + (linear << self.precision))
                divisor = mpz(row.denominator * (n + 1)) << self.shift
                component.append((2 * numerator + divisor) // (2 * divisor))
            if n > 2 and all(-2 <= component[i] <= 2 for component in y for i in (-1, -2)):
                self.settled = True
                return

    @staticmethod
    def _within(a: list[mpz], b: list[mpz], low: int, n: int) -> mpz:
        """The products a_j b_{n−j} that are new in this block: j or n − j from ``low`` on."""
        total = sum(map(mul, a[low:], reversed(b[: n - low + 1])), mpz(0))
        return total if low == 0 else total + sum(map(mul, b[low:], reversed(a[: n - low + 1])))

    def _multiply(self, low: int, middle: int, high: int) -> None:
        """Add the products of b_low..b_{middle−1} with all known ones to the sums of middle ≤ n < high."""
        length = high - low
        used = {index for pair in self.motion.pairs for index in pair}
        new = {i: fmpz_poly([int(v) for v in self.values[i][low:middle]]) for i in used}
        first = new if low == 0 else {i: fmpz_poly([int(v) for v in self.values[i][:length]]) for i in used}
        products = [new[j].mul_low(first[k], length) for j, k in self.motion.pairs]
        if low > 0:
            products = [
                product + first[j].mul_low(new[k], length)
                for product, (j, k) in zip(products, self.motion.pairs, strict=True)
            ]
        for row, between in zip(self.motion.rows, self.between, strict=True):
            total = sum((c * products[pair] for c, pair in row.products), fmpz_poly([]))
            for n, value in enumerate(total.coeffs()[middle - low :], middle):
                between[n] += int(value)


# One motion in integers of any length, for precisions beyond those of words.
#
# A number of p bits is an integral multiple of 2^-p, the ulp; coefficients are made by
# the code above, and h is a power of two, halved and doubled by the number of orders
# that a step takes.


_MANY_ORDERS, _FEW_ORDERS = 0.45, 0.27
_FIRST_HALVINGS = 2
_MOST_HALVINGS = 64


@dataclass(frozen=True, slots=True)
class _Field:
    """pairs, rows: see :class:`heavytop.multiword.integers.integer_series.QuadraticField`."""

    pairs: tuple[tuple[int, int], ...]
    rows: tuple[QuadraticComponent, ...]


def field_of(problem: Scaled, forwards: bool) -> _Field:
    """The field of a scaled problem, with its sign changed backwards in time.

    Products: ω_j ω_k in the rate of ω_i with the coefficients of the lanes, and γ × ω, ξ × ω.
    """
    sign = 1 if forwards else -1
    vectors = 1 + (len(problem.state) - 3) // 3
    turning = [
        (3 * v + j, k) for v in range(1, vectors) for j, k in (pair for a, b in OTHER_AXES for pair in ((a, b), (b, a)))
    ]
    pairs = (*OTHER_AXES, *turning)
    rows = []
    for component in range(len(problem.state)):
        products = {pairs.index(pair): c for pair, c in problem.products(component).items()}
        rows.append(_row(products, problem.linear(component), sign))
    return _Field(pairs, tuple(rows))


def _row(products: dict[int, Fraction], linear: dict[int, Fraction], sign: int) -> QuadraticComponent:
    common = lcm(*(c.denominator for c in (*products.values(), *linear.values())))
    return QuadraticComponent(
        common,
        tuple((int(sign * c * common), pair) for pair, c in products.items() if c),
        tuple((int(sign * c * common), j) for j, c in linear.items()),
    )


class IntegerMotion(ResumableRun):
    """A motion that advances in integers of ``bits`` bits; the problem is scaled so that |ω| ≤ 4."""

    def __init__(self, problem: Scaled, bits: int, forwards: bool) -> None:
        self.problem, self.bits, self.forwards = problem, bits, forwards
        self.field = field_of(problem, forwards)
        self.steps, self.redone = 0, 0
        self._state = [mpz(round(value * 2**bits)) for value in problem.state]
        self._series = [[value] for value in self._state]
        self._time = self._began = Fraction(0)
        self._halvings, self._taken = _FIRST_HALVINGS, _FIRST_HALVINGS

    @property
    def order(self) -> int:
        return len(self._series[0]) - 1

    @property
    def time(self) -> Fraction:
        return self._time

    @property
    def state(self) -> tuple[Fraction, ...]:
        return self._exact(self._state)

    def _exact(self, values: list[mpz]) -> tuple[Fraction, ...]:
        return tuple(Fraction(int(value), 1 << self.bits) for value in values)

    def advance(self, target: Fraction, steps: int) -> Status:
        for _ in range(steps):
            if self._time >= target:
                break
            if not self._step():
                return Status.TOO_SMALL
        return Status.OK

    def _step(self) -> bool:
        """Take one step; False where no length converges."""
        for halvings in range(self._halvings, _MOST_HALVINGS):
            series = coefficients(self.field, self._state, self.bits, halvings)
            if series is not None:
                break
            self.redone += 1
        else:
            return False
        self._series, self._taken, self._began = series, halvings, self._time
        self._state = [sum(component, mpz(0)) for component in series]
        self._time += Fraction(1, 2) ** halvings
        self.steps += 1
        doubled = 2 * Fraction(1, 2) ** halvings
        if self.order > _MANY_ORDERS * self.bits:
            halvings += 1
        elif self.order < _FEW_ORDERS * self.bits and self._time % doubled == 0:
            halvings -= 1
        self._halvings = halvings
        return True

    def sample(self, time: Fraction) -> tuple[Fraction, ...]:
        behind = (time - self._began) * Fraction(2) ** self._taken
        return self._exact([horner(component, behind) for component in self._series])

    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        return self._exact([component[n] for component in self._series])

    def resume_words(self) -> tuple[str, ...]:
        before = (component[0] for component in self._series)
        return (str(self._taken), str(self._began), *(f"{int(value):x}" for value in before))

    def restore(self, numbers: tuple[str, ...], steps: int) -> None:
        self._halvings = int(numbers[0])
        self._time = Fraction(numbers[1])
        self._state = [mpz(int(text, 16)) for text in numbers[2:]]
        self.steps = steps


def horner(coefficients: list[mpz], x: Fraction) -> mpz:
    """Σ c_n xⁿ for 0 ≤ x ≤ 1, with each step of Horner's scheme rounded to nearest; exact at 1."""
    if x == 1:
        return sum(coefficients, mpz(0))
    total, numerator, denominator = mpz(0), mpz(x.numerator), mpz(x.denominator)
    for value in reversed(coefficients):
        total = value + (2 * total * numerator + denominator) // (2 * denominator)
    return total
