"""Rational functions over FLINT modulo square roots, in which identities are proven.

A :class:`Tower` holds generators x0, x1, ...; some are free (parameters, time, an exponential), some are roots with
a relation R² = q, q a polynomial in earlier generators.  An expression that reduces to 0 modulo the relations is 0
wherever none of the tower's ``divisors`` is 0.  The converse needs independent roots and is not claimed.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import isqrt, lcm, prod
from typing import Any

from flint import Ordering, fmpq, fmpq_mpoly, fmpz, fmpz_mpoly_ctx, fmpz_mpoly_vec

from heavytop.exact.flint.balls import working_precision
from heavytop.features.claims.algebra.ring import Generator, PolynomialRing, Quotient, Unprovable, as_fraction, used
from heavytop.features.claims.algebra.signs import NUMBER_BITS, Sign, Signs

# Nested square roots that are sums of simpler ones: √(3 + 2√2) = 1 + √2, √(a + √(a² − b²)) = (√(a + b) + √(a − b))/√2.
#
# With p = A + B R, R = √C ≥ 0, and A² − B² C = D²,
#
#     √p = √((A + D)/2) + s √((A − D)/2),   s = sign B,
#
# where A ≥ 0, so that both radicands are ≥ 0 with p; for s < 0 also D ≥ 0, so that the sum is.


# depth of nested roots that are denested
_DEPTH = 3
_MAX_TERMS = 40


def denested(tower: Tower, p: fmpq_mpoly, depth: int = _DEPTH) -> Quotient | None:
    """√p as a sum of less nested roots, for a polynomial ``p`` in roots; None without such a sum.

    It equals √p wherever that is real.
    """
    roots = [index for index in sorted(used(p), reverse=True) if tower.generators[index].kind == "root"]
    if not depth or len(p) > _MAX_TERMS:
        return None
    for index in roots:
        try:
            roots_sum = _as_sum(tower, p, index, depth)
        except Unprovable:
            continue
        if roots_sum is not None:
            return roots_sum
    return _through_conjugate(tower, p) if roots else None


def _as_sum(tower: Tower, p: fmpq_mpoly, index: int, depth: int) -> Quotient | None:
    """√(A + B R), R = √C the generator ``index``."""
    parts = tower.by_power(p, index)
    if parts.keys() != {0, 1}:
        return None
    a, b = parts[0], parts[1]
    s = tower.signs.of(b).value
    norm = tower.reduce(tower.times(a, a) - tower.times(tower.times(b, b), tower.squares[index]))
    if not s or tower.signs.of(a).value <= 0:
        return None
    d = _plain_root(tower, norm, any_sign=s > 0)
    if d is None or d.denominator != tower.one:
        return None
    halves = []
    for radicand in ((a + d.numerator) / 2, (a - d.numerator) / 2):
        plain = _plain_root(tower, radicand)
        halves.append(denested(tower, radicand, depth - 1) if plain is None else plain)
    if halves[0] is None or halves[1] is None:
        return None
    return halves[0] + halves[1] * s


def _plain_root(tower: Tower, p: fmpq_mpoly, *, any_sign: bool = False) -> Quotient | None:
    """√p without nested roots, from factors of known sign; with ``any_sign`` some D with D² = p."""
    if not p:
        return tower.number(0)
    constant, factors = tower.signs.factors(p)
    result, signed = tower.one, []
    for factor, power in factors:
        # an even power comes out of the root where it is a fourth power, or where the root may have either sign
        needs_no_sign = power % 4 == 0 or (any_sign and power % 2 == 0)
        sign = 1 if needs_no_sign else tower.signs.of(factor).value
        is_nested = power % 2 and bool(tower.squares.keys() & used(factor))
        if not sign or (is_nested and tower.known_root(factor * sign) is None):
            return None
        constant = constant * sign if power % 2 else constant
        signed.append((factor * sign, power))
    if constant < 0:
        return None
    root = tower.root_of_number(constant)
    for factor, power in signed:
        result = tower.times(result, tower.raised(factor, int(power) // 2))
        if power % 2:
            result = tower.times(result, tower.gens[tower.root_of(factor)])
    return root * tower.polynomial(result)


def _through_conjugate(tower: Tower, p: fmpq_mpoly) -> Quotient | None:
    """√p = √(p q)/√q, for a root √q of the tower and a p q whose root is not nested: √(√2 − 1) = 1/√(√2 + 1)."""
    for index, q in reversed(list(tower.squares.items())):
        if tower.generators[index].kind != "root" or not tower.generators[index].strict:
            continue
        if len(q) > _MAX_TERMS or not tower.squares.keys() & used(q) & used(p):
            continue
        try:
            root = _plain_root(tower, tower.reduce(tower.times(p, q)))
        except Unprovable:
            continue
        if root is not None:
            return root / tower.polynomial(tower.gens[index])
    return None


_FACTORED_BITS = 64


class Tower(PolynomialRing):
    """Generators with relations and signs, and the absolute values and roots of quotients."""

    def __init__(self, slots: int) -> None:
        super().__init__(slots)
        self._roots: dict[str, int] = {}
        self.signs = Signs(self)

    # --- generators -----------------------------------------------------------------------------------------------

    def add_root(self, meaning: Any, square: fmpq_mpoly, *, sign: int, kind: str = "root") -> int:
        """The index of a new generator R with R² = ``square``, a polynomial in the generators so far."""
        constant = all(self.generators[i].constant for i in used(square))
        strict = kind == "root" and self.signs.of(square).strict
        argument = Quotient(square, self.one, self)
        index = self.add(Generator(meaning, constant, sign, strict, kind, (argument,)))
        self.squares[index] = square
        number = self.signs.ball(square)
        if number is not None and kind == "root":
            with working_precision(NUMBER_BITS):
                self.signs.numbers[index] = number.sqrt()
        return index

    # --- arithmetic -----------------------------------------------------------------------------------------------

    def summands(self, argument: Quotient) -> list[Quotient]:
        """The summands of the numerator, each over the denominator."""
        return [
            self.quotient(self.context.from_dict({monomial: coefficient}), argument.denominator)
            for monomial, coefficient in argument.numerator.to_dict().items()
        ]

    # --- absolute values and roots ----------------------------------------------------------------------------------

    def ratio(self, a: Quotient, b: Quotient) -> Fraction | None:
        """The number c with a = c b, found without a division; None without one."""
        left = self.reduce(self.times(a.numerator, b.denominator))
        right = self.reduce(self.times(b.numerator, a.denominator))
        if not left or not right:
            return None
        c = left.leading_coefficient() / right.leading_coefficient()
        return as_fraction(c) if left == right * c else None

    def sign(self, value: Quotient) -> Sign:
        """The sign of a quotient where it is defined."""
        numerator, denominator = self.signs.of(value.numerator), self.signs.of(value.denominator)
        return Sign(numerator.value * denominator.value, numerator.strict)

    def declare(self, value: Quotient, *, strict: bool = True) -> None:
        """Assumes value > 0, or >= 0 where it is not strict."""
        denominator = self.signs.of(value.denominator)
        p = value.numerator if denominator.value else self.times(value.numerator, value.denominator)
        self.signs.declare(p, Sign(denominator.value or 1, strict))

    def absolute(self, value: Quotient) -> Quotient:
        """|value|, factor by factor; the absolute value of a factor of unknown sign is the root of its square."""
        return self.polynomial(self._absolute(value.numerator)) / self.polynomial(self._absolute(value.denominator))

    def _absolute(self, p: fmpq_mpoly) -> fmpq_mpoly:
        constant, factors = self.signs.factors(p)
        result = self.context.constant(abs(constant))
        for factor, power in factors:
            sign = self.signs.of(factor).value
            size = factor * sign if sign else self.gens[self.root_of(factor * factor)]
            result = self.times(result, self.raised(size, int(power)))
        return result

    def root(self, value: Quotient) -> Quotient:
        """√value >= 0; raises Unprovable for a value that is negative on the whole domain."""
        square = self.times(value.numerator, value.denominator)
        if not square:
            return self.number(0)
        return self._root(square) / self.polynomial(self._absolute(value.denominator))

    def _root(self, p: fmpq_mpoly) -> Quotient:
        """√p: absolute values of squares, times a root for each factor of known sign and one for the others."""
        constant, factors = self.signs.factors(p)
        outside, radicand, sign = self.one, self.one, 1 if constant > 0 else -1
        roots = []
        for factor, power in factors:
            outside = self.times(outside, self._absolute(self.raised(factor, int(power) // 2)))
            if power % 2:
                known = self.signs.of(factor).value
                if known:
                    roots.append(self._simplest_root(factor * known))
                    sign *= known
                else:
                    radicand = self.times(radicand, factor)
        if radicand != self.one:
            roots.append(self._simplest_root(radicand * sign))
        elif sign < 0:
            raise Unprovable("A square root of a negative number.", "Check the formula, or its domain.")
        return prod(roots, start=self.polynomial(outside)) * self.root_of_number(abs(constant))

    def _simplest_root(self, square: fmpq_mpoly) -> Quotient:
        """√square as a sum of less nested roots where that exists, else as a generator."""
        if self.known_root(square) is None:
            simpler = denested(self, square)
            if simpler is not None:
                return simpler
        return self.polynomial(self.gens[self.root_of(square)])

    def known_root(self, square: fmpq_mpoly) -> int | None:
        """The generator √square, None before it is made."""
        return self._roots.get(str(square))

    def root_of_number(self, value: Any) -> Quotient:
        """√(p/q) = √(p q)/q, over the primes of p q."""
        radicand = int(value.p) * int(value.q)
        root = isqrt(radicand)
        if root * root == radicand:
            return self.number(Fraction(root, int(value.q)))
        primes = fmpz(radicand).factor() if radicand.bit_length() <= _FACTORED_BITS else [(radicand, 1)]
        result = self.one / fmpq(value.q)
        for prime, power in primes:
            result *= int(prime) ** (int(power) // 2)
            if power % 2:
                result = self.times(result, self.gens[self.root_of(self.context.constant(int(prime)))])
        return self.polynomial(result)

    def root_of(self, square: fmpq_mpoly) -> int:
        """The generator √square, made once."""
        key = str(square)
        if key not in self._roots:
            self._roots[key] = self.add_root(("sqrt", square), square, sign=1)
        return self._roots[key]


# Membership in the ideal of a few polynomial relations: the proof that another polynomial is 0 where they are.


# elements of the basis, terms and bits of each: beyond, the basis is abandoned and the verdict stays undecided
_LIMITS = (60, 2_000, 4_096)


def forces_zero(
    relations: Sequence[fmpq_mpoly], p: fmpq_mpoly, *, radical: bool, never_zero: Sequence[Any] = ()
) -> bool:
    """True only where ``p`` is a combination of ``relations`` with polynomial factors, so 0 where they all are.

    radical: or where a power of ``p`` is one (Rabinowitsch: the relations and 1 − y p = 0 exclude each other).
    never_zero: or where ``p`` times powers of these is one (saturation: 1 − z Π never_zero joins the relations).
    """
    if not p:
        return True
    indices = sorted(set().union(used(p), *(used(relation) for relation in (*relations, *never_zero))))
    context = fmpz_mpoly_ctx.get([*(f"x{index}" for index in indices), "y", "z"], Ordering.degrevlex)

    def integral(q: Any) -> Any:
        terms = {(*(monomial[index] for index in indices), 0, 0): c for monomial, c in q.to_dict().items()}
        common = lcm(*(int(coefficient.q) for coefficient in terms.values()))
        return context.from_dict({monomial: int(c.p) * (common // int(c.q)) for monomial, c in terms.items()})

    # the basis may be incomplete; a polynomial that reduces to 0 is in the ideal all the same
    generators = [integral(relation) for relation in relations]
    if never_zero:
        product = context.gens()[-1]
        for q in never_zero:
            product *= integral(q)
        generators.append(1 - product)
    if not integral(p).reduction_primitive_part(_basis(generators, context)):
        return True
    if not radical:
        return False
    inverse = 1 - context.gens()[-2] * integral(p)
    return any(element.is_constant() and element for element in _basis([*generators, inverse], context))


def _basis(generators: Sequence[Any], context: Any) -> Any:
    basis, _complete = fmpz_mpoly_vec(generators, context).buchberger_naive(limits=_LIMITS)
    return basis
