"""Polynomials over FLINT in generators, some of which are square roots of polynomials in earlier generators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx

from heavytop.errors import HeavyTopError

SLOTS = 32, 64
"""Generators that a ring has room for: time grows with the room, and the paper's claims need 21."""
_MAX_PRODUCT = 10_000
"""Terms of a product: the paper's claims need 95; proofs that need many more do not end."""
_MAX_QUOTIENT = 1_500
"""Terms of numerator times denominator where a common factor is sought: the paper's claims need 600."""


class Unprovable(HeavyTopError):
    """An expression beyond the exact algebra: balls decide, or the claim stays undecided."""


_P = ParamSpec("_P")
_T = TypeVar("_T")


def where_provable(otherwise: Any) -> Callable[[Callable[_P, _T]], Callable[_P, _T]]:
    """A decorator: the function returns ``otherwise`` where it raises Unprovable."""

    def decorated(function: Callable[_P, _T]) -> Callable[_P, _T]:
        @wraps(function)
        def provable(*args: _P.args, **kwargs: _P.kwargs) -> _T:
            try:
                return function(*args, **kwargs)
            except Unprovable:
                return otherwise  # type: ignore[no-any-return]

        return provable

    return decorated


def as_fraction(value: Any) -> Fraction:
    """A rational number of FLINT."""
    return Fraction(int(value.p), int(value.q))


def used(p: fmpq_mpoly) -> set[int]:
    """The generators that occur in a polynomial."""
    return {index for index, degree in enumerate(p.degrees()) if degree > 0}


@dataclass(frozen=True, slots=True)
class Quotient:
    """numerator / denominator, reduced by its tower; arithmetic with quotients of that tower and with fractions.

    Raises Unprovable for results that are too large, and for a division by 0.
    """

    numerator: fmpq_mpoly
    denominator: Any
    tower: PolynomialRing = field(compare=False, repr=False)

    def __add__(self, other: Quotient | Fraction | int) -> Quotient:
        t, b = self.tower, self._operand(other)
        if self.denominator == b.denominator:
            return t.quotient(self.numerator + b.numerator, b.denominator)
        left, right = t.times(self.numerator, b.denominator), t.times(b.numerator, self.denominator)
        return t.quotient(left + right, t.times(self.denominator, b.denominator))

    def __mul__(self, other: Quotient | Fraction | int) -> Quotient:
        t, b = self.tower, self._operand(other)
        return t.quotient(t.times(self.numerator, b.numerator), t.times(self.denominator, b.denominator))

    def __truediv__(self, other: Quotient | Fraction | int) -> Quotient:
        b = self._operand(other)
        return self * self.tower.quotient(b.denominator, b.numerator)

    def __pow__(self, exponent: int) -> Quotient:
        result, base = self.tower.number(1), self if exponent >= 0 else 1 / self
        for bit in f"{abs(exponent):b}":
            result = result * result
            result = result * base if bit == "1" else result
        return result

    def __neg__(self) -> Quotient:
        return Quotient(-self.numerator, self.denominator, self.tower)

    def __sub__(self, other: Quotient | Fraction | int) -> Quotient:
        return self + -self._operand(other)

    def __rsub__(self, other: Fraction | int) -> Quotient:
        return -self + other

    def __rtruediv__(self, other: Fraction | int) -> Quotient:
        return self._operand(other) / self

    __radd__, __rmul__ = __add__, __mul__

    def _operand(self, other: Quotient | Fraction | int) -> Quotient:
        return other if isinstance(other, Quotient) else self.tower.number(other)


@dataclass(frozen=True, slots=True)
class Generator:
    """A generator: its meaning, whether it is constant in time, and its sign.

    sign: 1 for >= 0, -1 for <= 0 on the whole domain, 0 for unknown.  strict: it is never 0.
    kind: ``symbol``, ``number``, ``root`` (√arguments[0]) or the name of a function of ``arguments``.
    """

    meaning: Any
    constant: bool
    sign: int = 0
    strict: bool = False
    kind: str = "symbol"
    arguments: tuple[Quotient, ...] = ()


class PolynomialRing:
    """Generators with the relations R² = q of the roots among them, and polynomials modulo these.

    slots: the room for generators.  squares: q of each root, by its index.
    """

    def __init__(self, slots: int) -> None:
        self.context = fmpq_mpoly_ctx.get([f"x{index}" for index in range(slots)], Ordering.lex)
        self.gens = self.context.gens()
        self.generators: list[Generator] = []
        self.squares: dict[int, fmpq_mpoly] = {}
        self.one = self.context.constant(1)
        # divisors of all divisions so far, by their texts: nothing is proven where one of them is 0
        self.divisors: dict[str, fmpq_mpoly] = {}

    def add(self, generator: Generator) -> int:
        """The index of a new free generator."""
        if len(self.generators) == len(self.gens):
            raise Unprovable(
                f"More than {len(self.gens)} independent quantities.", "Split the claim into smaller ones."
            )
        self.generators.append(generator)
        return len(self.generators) - 1

    def relations(self) -> list[fmpq_mpoly]:
        """R² − q for every root R = √q."""
        return [self.gens[index] ** 2 - square for index, square in self.squares.items()]

    def times(self, a: fmpq_mpoly, b: fmpq_mpoly) -> fmpq_mpoly:
        """The product of two polynomials; raises Unprovable where it would be too large to hold."""
        if len(a) * len(b) > _MAX_PRODUCT:
            raise Unprovable("A product of polynomials is too large.", "Split the claim into smaller ones.")
        return a * b

    def reduce(self, p: fmpq_mpoly) -> fmpq_mpoly:
        """``p`` with every root to a power below 2."""
        degrees = p.degrees()
        for index in sorted(self.squares, reverse=True):
            if degrees[index] > 1:
                parts = self.by_power(p, index)
                q, root = self.squares[index], self.gens[index]
                total = self.context.constant(0)
                for power, part in parts.items():
                    total += self.times(self.raised(q, power // 2), part * root ** (power % 2))
                p, degrees = total, total.degrees()
        return p

    def raised(self, p: fmpq_mpoly, exponent: int) -> fmpq_mpoly:
        """A power of a polynomial; raises Unprovable where it would be too large to hold."""
        result = self.one
        for _ in range(exponent):
            result = self.times(result, p)
        return result

    def by_power(self, p: fmpq_mpoly, index: int) -> dict[int, fmpq_mpoly]:
        """The coefficients of the powers of one generator."""
        parts: dict[int, dict[Any, Any]] = {}
        for monomial, coefficient in p.to_dict().items():
            cofactor = (*monomial[:index], 0, *monomial[index + 1 :])
            parts.setdefault(int(monomial[index]), {})[cofactor] = coefficient
        return {power: self.context.from_dict(terms) for power, terms in parts.items()}

    # --- quotients --------------------------------------------------------------------------------------------------

    def polynomial(self, numerator: fmpq_mpoly) -> Quotient:
        """A polynomial as a quotient."""
        return Quotient(self.reduce(numerator), self.one, self)

    def number(self, value: Fraction | int) -> Quotient:
        """A rational number as a quotient."""
        return Quotient(self.context.constant(fmpq(value.numerator, value.denominator)), self.one, self)

    def quotient(self, numerator: fmpq_mpoly, denominator: Any) -> Quotient:
        """The reduced quotient without roots in the denominator; raises Unprovable for a denominator 0."""
        numerator, denominator = self.reduce(numerator), self.reduce(denominator)
        degrees = denominator.degrees()
        for index in sorted(self.squares, reverse=True):
            if degrees[index] == 1:
                parts = self.by_power(denominator, index)
                conjugate = parts.get(0, self.context.constant(0)) - parts[1] * self.gens[index]
                rational = self.reduce(self.times(denominator, conjugate))
                if rational:
                    numerator = self.reduce(self.times(numerator, conjugate))
                    denominator, degrees = rational, rational.degrees()
        if not denominator:
            raise Unprovable("A denominator is identically 0.", "Check the formula, or the domain it is claimed on.")
        if len(denominator) > 1 and len(numerator) * len(denominator) > _MAX_QUOTIENT:
            raise Unprovable("A quotient of polynomials is too large.", "Split the claim into smaller ones.")
        if not denominator.is_constant():
            self.divisors.setdefault(str(denominator), denominator)
        common = numerator.gcd(denominator) if numerator else denominator
        numerator, denominator = numerator / common, denominator / common
        lead = denominator.leading_coefficient()
        return Quotient(numerator / lead, denominator / lead, self)
