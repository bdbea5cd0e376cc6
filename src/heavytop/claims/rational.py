"""Rational functions over FLINT modulo square roots: where an identity is proven, exactly.

A :class:`Tower` holds generators x0, x1, ...; some are free (parameters, time, an exponential), some are roots with
a relation R² = q, q a polynomial in the generators before R.  Whatever reduces to 0 modulo the relations is 0
wherever none of the tower's ``divisors`` is 0.  The converse needs the roots to be independent and is not claimed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import Any

from flint import Ordering, fmpq, fmpq_mpoly_ctx, fmpz

from heavytop.claims.radicals import denested
from heavytop.claims.sign import NUMBER_BITS, Sign, Unprovable, used
from heavytop.claims.signs import Signs
from heavytop.exact.balls import working_precision

SLOTS = 64
# terms of a product, and of numerator times denominator where a common factor is sought: the paper's claims need
# 95 and 600, and what needs much more does not end
_MAX_PRODUCT = 10_000
_MAX_QUOTIENT = 1_500
_FACTORED_BITS = 64


@dataclass(frozen=True, slots=True)
class Quotient:
    """numerator / denominator, reduced by its tower."""

    numerator: Any
    denominator: Any


@dataclass(frozen=True, slots=True)
class Generator:
    """One generator: what it stands for, whether it is constant in time, and what is known of its sign.

    sign: 1 or -1 where it is so all over the domain, 0 allowed; else 0.  strict: it is never 0.
    kind: ``symbol``, ``number``, ``root`` (√arguments[0]) or the name of a function of ``arguments``.
    """

    meaning: Any
    constant: bool
    sign: int
    strict: bool = False
    kind: str = "symbol"
    arguments: tuple[Quotient, ...] = ()


class Tower:
    """Generators with their relations and signs, and the arithmetic of quotients modulo them."""

    def __init__(self) -> None:
        self.context = fmpq_mpoly_ctx.get([f"x{index}" for index in range(SLOTS)], Ordering.lex)
        self.gens = self.context.gens()
        self.generators: list[Generator] = []
        self._radicands: dict[int, Any] = {}
        self._roots: dict[str, int] = {}
        self.one = self.context.constant(1)
        self.signs = Signs(self)
        # what has been divided by so far, by its text: nothing is proven where one of them is 0
        self.divisors: dict[str, Any] = {}

    # --- generators -----------------------------------------------------------------------------------------------

    def add(
        self,
        meaning: Any,
        *,
        constant: bool,
        sign: int = 0,
        strict: bool = False,
        kind: str = "symbol",
        arguments: tuple[Quotient, ...] = (),
    ) -> int:
        """The index of a new free generator."""
        if len(self.generators) == SLOTS:
            raise Unprovable(f"More than {SLOTS} independent quantities.", "Split the claim into smaller ones.")
        self.generators.append(Generator(meaning, constant, sign, strict, kind, arguments))
        return len(self.generators) - 1

    def add_root(self, meaning: Any, square: Any, *, sign: int, kind: str = "root") -> int:
        """The index of a new generator R with R² = ``square``, a polynomial in the generators so far."""
        constant = all(self.generators[i].constant for i in used(square))
        strict = kind == "root" and self.signs.of(square).strict
        argument = Quotient(square, self.one)
        index = self.add(meaning, constant=constant, sign=sign, strict=strict, kind=kind, arguments=(argument,))
        self._radicands[index] = square
        number = self.signs.ball(square)
        if number is not None and kind == "root":
            with working_precision(NUMBER_BITS):
                self.signs.numbers[index] = number.sqrt()
        return index

    def radicand(self, index: int) -> Any | None:
        """q of a root R² = q; None for a free generator."""
        return self._radicands.get(index)

    def radicands(self) -> list[tuple[int, Any]]:
        """(R, q) of every root R² = q."""
        return list(self._radicands.items())

    def relations(self) -> list[Any]:
        """R² − q for every root R = √q."""
        return [self.gens[index] ** 2 - square for index, square in self._radicands.items()]

    # --- arithmetic -----------------------------------------------------------------------------------------------

    def polynomial(self, numerator: Any) -> Quotient:
        """A polynomial as a quotient."""
        return Quotient(self.reduce(numerator), self.one)

    def number(self, value: Fraction | int) -> Quotient:
        """A rational number as a quotient."""
        return Quotient(self.context.constant(fmpq(value.numerator, value.denominator)), self.one)

    def times(self, a: Any, b: Any) -> Any:
        """The product of two polynomials; raises Unprovable where it would be too large to hold."""
        if len(a) * len(b) > _MAX_PRODUCT:
            raise Unprovable("A product of polynomials is too large.", "Split the claim into smaller ones.")
        return a * b

    def reduce(self, p: Any) -> Any:
        """``p`` with every root to a power below 2."""
        degrees = p.degrees()
        for index in sorted(self._radicands, reverse=True):
            if degrees[index] > 1:
                parts = self.by_power(p, index)
                q, root = self._radicands[index], self.gens[index]
                total = self.context.constant(0)
                for power, part in parts.items():
                    total += self.times(self.raised(q, power // 2), part * root ** (power % 2))
                p, degrees = total, total.degrees()
        return p

    def raised(self, p: Any, exponent: int) -> Any:
        """A power of a polynomial; raises Unprovable where it would be too large to hold."""
        result = self.one
        for _ in range(exponent):
            result = self.times(result, p)
        return result

    def by_power(self, p: Any, index: int) -> dict[int, Any]:
        """The coefficients of the powers of one generator."""
        parts: dict[int, dict[Any, Any]] = {}
        for monomial, coefficient in p.to_dict().items():
            rest = (*monomial[:index], 0, *monomial[index + 1 :])
            parts.setdefault(int(monomial[index]), {})[rest] = coefficient
        return {power: self.context.from_dict(terms) for power, terms in parts.items()}

    def summands(self, argument: Quotient) -> list[Quotient]:
        """The summands of the numerator, each over the denominator."""
        return [
            self.quotient(self.context.from_dict({monomial: coefficient}), argument.denominator)
            for monomial, coefficient in argument.numerator.to_dict().items()
        ]

    def quotient(self, numerator: Any, denominator: Any) -> Quotient:
        """Reduced, with no root left in the denominator; raises Unprovable where that is 0."""
        numerator, denominator = self.reduce(numerator), self.reduce(denominator)
        degrees = denominator.degrees()
        for index in sorted(self._radicands, reverse=True):
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
        self._divided_by(denominator)
        common = numerator.gcd(denominator) if numerator else denominator
        numerator, denominator = numerator / common, denominator / common
        lead = denominator.leading_coefficient()
        return Quotient(numerator / lead, denominator / lead)

    def _divided_by(self, p: Any) -> None:
        if not p.is_constant():
            self.divisors.setdefault(str(p), p)

    def sum(self, parts: Iterable[Quotient]) -> Quotient:
        """The sum of quotients."""
        total = self.number(0)
        for part in parts:
            if part.denominator == total.denominator:
                total = self.quotient(total.numerator + part.numerator, total.denominator)
            else:
                left = self.times(total.numerator, part.denominator)
                right = self.times(part.numerator, total.denominator)
                total = self.quotient(left + right, self.times(total.denominator, part.denominator))
        return total

    def product(self, parts: Iterable[Quotient]) -> Quotient:
        """The product of quotients."""
        total = self.number(1)
        for part in parts:
            total = self.quotient(
                self.times(total.numerator, part.numerator), self.times(total.denominator, part.denominator)
            )
        return total

    def power(self, base: Quotient, exponent: int) -> Quotient:
        """An integer power, by squaring."""
        if exponent < 0:
            return self.power(self.quotient(base.denominator, base.numerator), -exponent)
        result, square = self.number(1), base
        while exponent:
            if exponent & 1:
                result = self.product((result, square))
            exponent >>= 1
            if exponent:
                square = self.product((square, square))
        return result

    def divide(self, a: Quotient, b: Quotient) -> Quotient:
        """a / b."""
        return self.product((a, self.power(b, -1)))

    # --- absolute values and roots ----------------------------------------------------------------------------------

    def ratio(self, a: Quotient, b: Quotient) -> Fraction | None:
        """The number c with a = c b, where there is one; nothing is divided for it."""
        above = self.reduce(self.times(a.numerator, b.denominator))
        below = self.reduce(self.times(b.numerator, a.denominator))
        if not above or not below:
            return None
        c = above.leading_coefficient() / below.leading_coefficient()
        return Fraction(int(c.p), int(c.q)) if above == below * c else None

    def sign(self, value: Quotient) -> Sign:
        """The sign of a quotient where it is defined."""
        above, below = self.signs.of(value.numerator), self.signs.of(value.denominator)
        return Sign(above.value * below.value, above.strict)

    def absolute(self, value: Quotient) -> Quotient:
        """|value|, factor by factor; a factor of unknown sign becomes a root of its square."""
        return self.divide(
            self.polynomial(self._absolute(value.numerator)), self.polynomial(self._absolute(value.denominator))
        )

    def _absolute(self, p: Any) -> Any:
        constant, factors = p.factor()
        result = self.context.constant(abs(constant))
        for factor, power in factors:
            sign = self.signs.of(factor).value
            size = factor * sign if sign else self.gens[self.root_of(factor * factor)]
            result = self.times(result, self.raised(size, int(power)))
        return result

    def root(self, value: Quotient) -> Quotient:
        """√value >= 0; raises Unprovable where value is negative all over the domain."""
        square = self.times(value.numerator, value.denominator)
        if not square:
            return self.number(0)
        return self.divide(self._root(square), self.polynomial(self._absolute(value.denominator)))

    def _root(self, p: Any) -> Quotient:
        """√p: squares come out as absolute values, factors of known sign as roots of their own."""
        constant, factors = p.factor()
        outside, rest, sign = self.one, self.one, 1 if constant > 0 else -1
        roots = []
        for factor, power in factors:
            outside = self.times(outside, self._absolute(self.raised(factor, int(power) // 2)))
            if power % 2:
                known = self.signs.of(factor).value
                if known:
                    roots.append(self._simplest_root(factor * known))
                    sign *= known
                else:
                    rest = self.times(rest, factor)
        if rest != self.one:
            roots.append(self._simplest_root(rest * sign))
        elif sign < 0:
            raise Unprovable(
                "A square root of a negative number.", "Check the formula, or the domain it is claimed on."
            )
        return self.product((self.polynomial(outside), *roots, self.root_of_number(abs(constant))))

    def _simplest_root(self, square: Any) -> Quotient:
        """√square as a sum of simpler roots where there is one, else as a generator."""
        if self.known_root(square) is None:
            simpler = denested(self, square)
            if simpler is not None:
                return simpler
        return self.polynomial(self.gens[self.root_of(square)])

    def known_root(self, square: Any) -> int | None:
        """The generator √square, None where there is none yet."""
        return self._roots.get(str(square))

    def root_of_number(self, value: Any) -> Quotient:
        """√(p/q) = √(p q)/q, over the primes of p q."""
        whole = int(value.p) * int(value.q)
        root = isqrt(whole)
        if root * root == whole:
            return self.number(Fraction(root, int(value.q)))
        primes = fmpz(whole).factor() if whole.bit_length() <= _FACTORED_BITS else [(whole, 1)]
        result = self.one / fmpq(value.q)
        for prime, power in primes:
            result *= int(prime) ** (int(power) // 2)
            if power % 2:
                result = self.times(result, self.gens[self.root_of(self.context.constant(int(prime)))])
        return self.polynomial(result)

    def root_of(self, square: Any) -> int:
        """The generator √square, made once."""
        key = str(square)
        if key not in self._roots:
            self._roots[key] = self.add_root(("sqrt", square), square, sign=1)
        return self._roots[key]
