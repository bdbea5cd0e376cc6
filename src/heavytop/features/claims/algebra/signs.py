"""The sign of a polynomial in the generators of a ring on the whole domain of the claim.

Every rule is a proof.  A sign that no rule decides is unknown, and a condition that needs it stays undischarged.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from math import prod
from typing import Any, NamedTuple

import sympy
from flint import arb, fmpq, fmpq_mpoly

from heavytop.exact.flint.balls import working_precision
from heavytop.features.claims.algebra.combinations import nonnegative_combination
from heavytop.features.claims.algebra.ring import PolynomialRing, Unprovable, as_fraction, used

NUMBER_BITS = 512
"""Working precision of the balls of generators that are numbers."""


class Sign(NamedTuple):
    """value: 1 for >= 0, -1 for <= 0, 0 for unknown.  strict: never 0 (also where the value is unknown)."""

    value: int
    strict: bool

    def times(self, other: Sign) -> Sign:
        """The sign of a product."""
        return Sign(self.value * other.value, self.strict and other.strict)

    def also(self, other: Sign) -> Sign:
        """The sign of one expression by two proofs, each of its value or of its strictness."""
        return Sign(self.value or other.value, self.strict or other.strict)

    def between(self, other: Sign) -> Sign:
        """The sign of all values between two with these signs."""
        return Sign(self.value, self.strict and other.strict) if self.value == other.value != 0 else UNKNOWN


UNKNOWN = Sign(0, False)
PLUS, MINUS = Sign(1, True), Sign(-1, True)


def sign_of_number(value: Any) -> Sign:
    """The sign of a number other than 0."""
    return PLUS if value > 0 else MINUS


def value_of(p: fmpq_mpoly, numbers: Mapping[int, arb]) -> arb:
    """The ball of a polynomial at the balls of its generators."""
    with working_precision(NUMBER_BITS):
        total = arb(0)
        for monomial, coefficient in p.to_dict().items():
            term = arb(coefficient)
            for index, power in enumerate(monomial):
                for _ in range(int(power)):
                    term *= numbers[index]
            total += term
        return total


def sum_of(signs: Iterable[Sign]) -> Sign:
    """The sign of a sum whose parts have one sign; UNKNOWN of others."""
    values, strict = set(), False
    for value, part_strict in signs:
        values.add(value)
        strict = strict or part_strict
        if len(values) > 1 or value == 0:
            return UNKNOWN
    return Sign(values.pop(), strict) if values else Sign(1, False)


_DEPTH = 4
# factors looked at for one polynomial: beyond, its sign is unknown
_BUDGET = 120
_MAX_TERMS = 200
# terms of a factor that the costly rules are tried for
_MAX_COSTLY_TERMS = 40
_MAX_DEGREE = 24
# atoms and products of a combination, their degree, and linear programs per tower
_MAX_ATOMS = 10
_MAX_PRODUCTS = 150
_MAX_DEGREE_OF_PRODUCTS = 4
_PROGRAMS = 30
_MOST_FACTORED = 10_000
_factors: dict[tuple[int, str], Any] = {}
"""Factors of polynomials by room for generators and text: rings of the same room share one context of FLINT."""


class Signs:
    """The known signs and ranges of the generators of ``ring``, and the signs of polynomials that follow.

    ranges: closed intervals of generators.  circles: cosine of each sine.  numbers: the ball of each generator that
    is a number.  pi: the generator π.  turns: the ends, over π, of open intervals in which generators lie.
    """

    def __init__(self, ring: PolynomialRing) -> None:
        self._ring = ring
        self._forms: dict[int, fmpq_mpoly] = {}
        self._below_one: set[int] = set()
        self._facts: list[tuple[fmpq_mpoly, Sign]] = []
        self._products: list[tuple[fmpq_mpoly, Sign]] = []
        self._known: dict[str, tuple[Sign, int]] = {}
        self._left = _BUDGET
        self._depth = 0
        self._programs = _PROGRAMS
        self.ranges: dict[int, tuple[Fraction, Fraction]] = {}
        self.circles: dict[int, int] = {}
        self.numbers: dict[int, arb] = {}
        self.pi: int | None = None
        self.turns: dict[int, tuple[Fraction, Fraction]] = {}

    def declare_form(self, index: int, form: fmpq_mpoly, *, below_one: bool = False) -> None:
        """Generator ``index`` equals ``form``, a polynomial in generators of known sign; below_one: 1/x does."""
        self._forms[index] = form
        self._below_one |= {index} if below_one else set()
        self._known.clear()

    def can_have_form(self, index: int, form: fmpq_mpoly) -> bool:
        """Whether ``form`` may be declared: it is the first, and no generator in it is declared by its reciprocal."""
        return index not in self._forms and not self._below_one & used(form)

    def declare(self, p: fmpq_mpoly, sign: Sign) -> None:
        """Assumes this sign of ``p``, and so the sign of the product of its factors of unknown sign.

        A sign that is not strict determines no factor where another may be 0.
        """
        constant, factors = self.factors(p)
        total = sign_of_number(constant)
        open_factors = []
        for factor, power in factors:
            known = self._by_terms(factor)
            known = known if known.value and known.strict else self._by_forms(factor)
            if power % 2 and not (known.value and known.strict):
                open_factors.append(factor)
            else:
                total = total.times(known if power % 2 else Sign(1, known.strict or sign.strict))
                if sign.strict and not known.strict:
                    self._facts.append((factor, Sign(0, True)))
        if not sign.strict and not total.strict:
            return
        known = Sign(sign.value * total.value, sign.strict)
        if len(open_factors) == 1:
            self._facts.append((open_factors[0], known))
        elif open_factors:
            self._products.append((prod(open_factors, start=self._ring.one), known))
            self._declare_each(open_factors, known)
        self._known.clear()

    def declare_largest_terms(self) -> None:
        """The one term that may have the sign of its fact has it: where 4ac - b² > 0, ac > 0."""
        for fact, sign in [*self._facts]:
            terms = [self._ring.context.from_dict({m: c}) for m, c in fact.to_dict().items()] if sign.value else []
            candidates = [term for term in terms if self.of(term).value != -sign.value]
            if len(candidates) == 1 < len(terms):
                self.declare(candidates[0], sign)

    def _declare_each(self, factors: list[fmpq_mpoly], known: Sign) -> None:
        """None is 0; two with a product > 0 have the sign of their sum, with a product < 0, of their difference."""
        if known.strict:
            self._facts += [(factor, Sign(0, True)) for factor in factors]
        if len(factors) != 2 or not (known.value and known.strict):
            return
        first, second = factors
        total = self.of(first + second * known.value)
        if total.value and total.strict:
            self._facts += [(first, Sign(total.value, True)), (second, Sign(total.value * known.value, True))]

    def never_zero(self, relations: Sequence[fmpq_mpoly]) -> list[fmpq_mpoly]:
        """Polynomials that are 0 nowhere and share generators with these: facts, factors, generators."""
        indices = set().union(*map(used, relations))
        nonzero = [fact for fact, sign in (*self._facts, *self._products) if sign.strict and used(fact) & indices]
        nonzero += [self._ring.gens[index] for index in sorted(indices) if self._ring.generators[index].strict]
        factors = [factor for relation in relations for factor, _ in self.factors(relation)[1]]
        nonzero += [factor for factor in factors if self.of(factor).strict]
        return list({str(p): p for p in nonzero}.values())

    def factors(self, p: fmpq_mpoly) -> Any:
        """(constant, [(factor, power)]), computed once for all rings."""
        key = len(self._ring.gens), str(p)
        if key not in _factors:
            if len(_factors) == _MOST_FACTORED:
                _factors.clear()
            _factors[key] = p.factor()
        return _factors[key]

    def of(self, p: fmpq_mpoly) -> Sign:
        """The sign of ``p``: the product of those of its factors."""
        if not p:
            return Sign(1, False)
        if p.is_constant():
            return sign_of_number(p.leading_coefficient())
        if self._depth == 0:
            self._left = _BUDGET
        if self._depth > _DEPTH or self._left <= 0 or len(p) > _MAX_TERMS or max(p.degrees()) > _MAX_DEGREE:
            return UNKNOWN
        for product, sign in self._products:
            quotient, remainder = divmod(p, product)
            if not remainder:
                return self.of(quotient).times(sign)
        self._depth += 1
        try:
            constant, factors = self.factors(p)
            total = sign_of_number(constant)
            for factor, power in factors:
                sign = self._of_factor(factor)
                total = total.times(sign if power % 2 else Sign(1, sign.strict))
            return total
        except Unprovable:
            return UNKNOWN
        finally:
            self._depth -= 1

    def _of_factor(self, p: fmpq_mpoly) -> Sign:
        key = str(p)
        if key in self._known:
            known, depth = self._known[key]
            if (known.value and known.strict) or depth <= self._depth:
                return known
        self._left -= 1
        sign = UNKNOWN
        for rule in self._rules(p):
            with suppress(Unprovable):  # too large for this rule
                sign = sign.also(rule(p))
            if sign.value and sign.strict:
                break
        # where the budget was used up, the next call may find more
        self._known[key] = sign, self._depth if self._left > 0 else _DEPTH
        return sign

    def _rules(self, p: fmpq_mpoly) -> Iterator[Callable[[fmpq_mpoly], Sign]]:
        yield from (self._by_facts, self._by_number, self._by_terms, self._by_forms)
        if len(p) <= _MAX_COSTLY_TERMS and self._left > 0:
            yield from (
                self._by_facts_at_its_zeros,
                self._by_square_of_a_sine,
                self._by_roots_of_one_variable,
                self._by_generators,
            )
            yield from (self._by_difference_from_facts, self._by_products_of_facts)

    # --- rules ------------------------------------------------------------------------------------------------------

    def _by_facts(self, p: fmpq_mpoly) -> Sign:
        result = UNKNOWN
        for fact, sign in self._facts:
            ratio = p.leading_coefficient() / fact.leading_coefficient()
            if p == fact * ratio:
                result = result.also(sign.times(sign_of_number(ratio)))
        return result

    def ball(self, p: fmpq_mpoly) -> arb | None:
        """The ball of a polynomial in generators that are numbers; None for any other."""
        return value_of(p, self.numbers) if used(p) <= self.numbers.keys() else None

    def _by_number(self, p: fmpq_mpoly) -> Sign:
        """Irrational numbers: by the ball of p."""
        total = self.ball(p)
        if total is None or not total.is_finite() or total.contains(0):
            return UNKNOWN
        return sign_of_number(total)

    def _by_terms(self, p: fmpq_mpoly) -> Sign:
        """Terms of one sign; their coefficients may be irrational numbers."""
        if not self.numbers.keys() & used(p):
            signs = (self._of_term(monomial, sign_of_number(c)) for monomial, c in p.to_dict().items())
            return next(signs) if len(p) == 1 else sum_of(signs)
        groups: dict[Any, dict[Any, Any]] = {}
        for monomial, coefficient in p.to_dict().items():
            number = tuple(power if index in self.numbers else 0 for index, power in enumerate(monomial))
            cofactor = tuple(0 if index in self.numbers else power for index, power in enumerate(monomial))
            groups.setdefault(cofactor, {})[number] = coefficient
        signs = (self._of_term(term, self._by_number(self._ring.context.from_dict(c))) for term, c in groups.items())
        return next(signs) if len(groups) == 1 else sum_of(signs)

    def _of_term(self, monomial: Any, sign: Sign) -> Sign:
        """The sign of a monomial times a coefficient of that sign."""
        for index, power in enumerate(monomial):
            if power:
                g = self._ring.generators[index]
                sign = sign.times(Sign(g.sign if power % 2 else 1, g.strict))
        return sign

    def _by_facts_at_its_zeros(self, p: fmpq_mpoly) -> Sign:
        """A sum of terms c x^n of one sign, 0 only where each x is, where a fact that is never 0 would be 0 too."""
        sign, gens = self._by_terms(p), self._ring.generators
        open_ones = [{i for i, power in enumerate(m) if power and not gens[i].strict} for m in p.to_dict()]
        if not sign.value or any(len(indices) != 1 for indices in open_ones):
            return UNKNOWN
        zeros = set().union(*open_ones)
        facts = (fact.to_dict() for fact, known in self._facts if known.strict)
        return Sign(sign.value, any(all(any(m[i] for i in zeros) for m in fact) for fact in facts))

    def _by_forms(self, p: fmpq_mpoly) -> Sign:
        """Terms of one sign after each generator is replaced by its form in positive ones."""
        reciprocals = self._below_one & used(p)
        for index in reciprocals:
            # p(X) has the sign of X^n p(1/Z) with Z = 1/X >= 1
            degree = int(p.degrees()[index])
            terms = {
                (*monomial[:index], degree - monomial[index], *monomial[index + 1 :]): coefficient
                for monomial, coefficient in p.to_dict().items()
            }
            p = self._ring.context.from_dict(terms)
        if not self._forms.keys() & used(p):
            return UNKNOWN
        p = self._without_forms(p, reciprocals)
        return self._by_terms(p) if p else UNKNOWN

    def _without_forms(self, p: fmpq_mpoly, reciprocals: Collection[int] = ()) -> Any:
        """``p`` with every generator replaced by its form; raises Unprovable where that is too large.

        reciprocals: generators that stand for their reciprocals in ``p``; others below 1 are left as they are.
        The loop ends, since no form depends on itself.
        """
        excluded = self._below_one.difference(reciprocals)
        while forms := self._forms.keys() & used(p) - excluded:
            index = min(forms)
            p = self.substituted(p, index, self._forms[index])
            if len(p) > _MAX_TERMS:
                raise Unprovable("A polynomial is too large.", "Split the claim into smaller ones.")
        return p

    def substituted(self, p: fmpq_mpoly, index: int, form: fmpq_mpoly) -> fmpq_mpoly:
        """``p`` with a polynomial in the place of a generator."""
        total = self._ring.context.constant(0)
        for power, part in self._ring.by_power(p, index).items():
            total += self._ring.times(part, self._ring.raised(form, power))
        return total

    def _by_roots_of_one_variable(self, p: fmpq_mpoly) -> Sign:
        """Irreducible polynomials in one generator without a real root inside its range (Sturm)."""
        if len(used(p)) != 1:
            return UNKNOWN
        (index,) = used(p)
        low, high = self._range(index)
        x = sympy.Symbol("x")
        polynomial = sympy.Poly(sum(as_fraction(c) * x ** int(m[index]) for m, c in p.to_dict().items()), x)
        ends = [end for end in (low, high) if end is not None]
        at_ends = [polynomial.eval(end) for end in ends]
        line = Sign(0, polynomial.degree() == 1 and self._by_other_of_circle(index, polynomial))
        if polynomial.count_roots(low, high) > at_ends.count(0):
            return line
        inside = sum(ends) / 2 if len(ends) == 2 else 0 if not ends else low + 1 if high is None else high - 1
        return Sign(sign_of_number(polynomial.eval(inside)).value, 0 not in at_ends).also(line)

    def _by_other_of_circle(self, index: int, line: Any) -> bool:
        """Whether the line is 0 at ±1 alone, where a sine or cosine has no value, as the other one is never 0."""
        others = (pair[1 - pair.index(index)] for pair in self.circles.items() if index in pair)
        return abs(line.eval(0)) == abs(line.LC()) and any(self._by_facts(self._ring.gens[i]).strict for i in others)

    def _range(self, index: int) -> tuple[Any, Any]:
        """The closed interval of a generator; None for no bound."""
        zero, sign = sympy.Integer(0), self._ring.generators[index].sign
        if index not in self.ranges:
            return zero if sign > 0 else None, zero if sign < 0 else None
        low, high = map(sympy.Rational, self.ranges[index])
        return max(low, zero) if sign > 0 else low, min(high, zero) if sign < 0 else high

    def _by_generators(self, p: fmpq_mpoly) -> Sign:
        """Polynomials in one of their generators with coefficients of known sign."""
        result = UNKNOWN
        for index in sorted(used(p), reverse=True):
            for sign in self._as_polynomial_in(index, p, self._ring.by_power(p, index)):
                result = result.also(sign)
                if result.value and result.strict:
                    return result
        return result

    def _as_polynomial_in(self, index: int, p: fmpq_mpoly, parts: dict[int, Any]) -> Iterator[Sign]:
        g, degree = self._ring.generators[index], max(parts)
        if len(parts) > 1:
            yield sum_of(
                self.of(part).times(Sign(g.sign if power % 2 else 1, g.strict or not power))
                for power, part in parts.items()
            )
        zero = self._ring.context.constant(0)
        radicand = self._ring.squares.get(index)
        if degree == 1 and radicand is not None:
            yield self._of_root_sum(parts.get(0, zero), parts[1], radicand, g.sign)
        if degree == 2:
            a, b, c = (parts.get(power, zero) for power in (2, 1, 0))
            leading, defect = self.of(a), self.of(4 * a * c - b * b)
            if leading.value and leading.strict and defect.value == 1:
                yield Sign(leading.value, defect.strict)
        if degree == 1 and index in self.ranges:
            low, high = (self.of(self.substituted(p, index, self._constant(end))) for end in self.ranges[index])
            yield low.between(high)
        if degree == 1 and index in self.turns and self.pi in used(p):
            pi = self._ring.gens[self.pi]
            low, high = (self.of(self.substituted(p, index, self._constant(end) * pi)) for end in self.turns[index])
            if low.value == high.value != 0:  # of an open interval: one strict end suffices
                yield low.also(high)

    def _constant(self, value: Fraction) -> fmpq_mpoly:
        return self._ring.context.constant(fmpq(value.numerator, value.denominator))

    def _of_root_sum(self, a: fmpq_mpoly, b: fmpq_mpoly, radicand: fmpq_mpoly, sign: int) -> Sign:
        """a + b R with R² = radicand >= 0: the larger of a² and b² R² decides."""
        difference = self.of(self._ring.reduce(a * a - b * b * radicand))
        if difference.value > 0:
            return Sign(self.of(a).value, difference.strict)
        if difference.value < 0:
            return Sign(self.of(b).value * sign, difference.strict)
        return UNKNOWN

    def _by_square_of_a_sine(self, p: fmpq_mpoly) -> Sign:
        """Linear in g² with −1 ≤ g ≤ 1: between its values at g² = 0 and g² = 1."""
        for index in used(p):
            parts = self._ring.by_power(p, index) if self.ranges.get(index) == (Fraction(-1), Fraction(1)) else {}
            if parts.keys() == {0, 2} and (sign := self.of(parts[0]).between(self.of(parts[0] + parts[2]))).value:
                return sign
        return UNKNOWN

    def _by_difference_from_facts(self, p: fmpq_mpoly) -> Sign:
        """p = q·fact + r with q and r of one sign."""
        for fact, sign in self._facts:
            for factor, factor_sign in ((fact, sign), (-fact, Sign(-sign.value, sign.strict))):
                quotient, remainder = divmod(p, factor)
                if quotient and remainder and len(remainder) < len(p) + len(fact):
                    bound = sum_of((self.of(quotient).times(factor_sign), self.of(remainder)))
                    if bound.value:
                        return bound
        return UNKNOWN

    def _directly(self, p: fmpq_mpoly) -> Sign:
        """The sign of ``p`` by the rules that need no other sign."""
        signs = [rule(p) for rule in (self._by_facts, self._by_terms, self._by_forms)]
        return next((sign for sign in signs if sign.value), UNKNOWN)

    # --- combinations of products -----------------------------------------------------------------------------------

    def _by_products_of_facts(self, p: fmpq_mpoly) -> Sign:
        """p or −p = Σ c q with c ≥ 0, each q a product of atoms that are ≥ 0."""
        generators = [self._ring.generators[index] for index in used(p)]
        of_parameters = all(g.constant and g.kind in ("symbol", "root") for g in generators)
        if not (self._facts or self._forms) or not of_parameters or self._programs <= 0 or self._depth > 2:
            return UNKNOWN
        p = self._ring.reduce(self._without_forms(p))
        degree = max((sum(map(int, monomial)) for monomial in p.to_dict()), default=0)
        atoms = self._atoms_for(p)
        if not 0 < degree <= _MAX_DEGREE_OF_PRODUCTS or len(p) > _MAX_COSTLY_TERMS or len(atoms) < 2:
            return UNKNOWN
        self._programs -= 1
        products = self._products_of(atoms, degree)
        for sign in (1, -1):
            weights = nonnegative_combination((sign * p).to_dict(), [product.to_dict() for product, _ in products])
            if weights is not None:
                return Sign(sign, any(weight and strict for weight, (_, strict) in zip(weights, products, strict=True)))
        return UNKNOWN

    def _atoms_for(self, p: fmpq_mpoly) -> list[tuple[fmpq_mpoly, bool]]:
        """(polynomial ≥ 0, whether it is never 0): facts and generators that share generators with ``p``."""
        facts = []
        for fact, sign in self._facts:
            if sign.value:
                with suppress(Unprovable):
                    facts.append((self._ring.reduce(self._without_forms(fact * sign.value)), sign.strict))
        for index in self._forms:
            g = self._ring.generators[index]
            if g.sign and index not in self._below_one:
                with suppress(Unprovable):
                    facts.append((self._without_forms(self._ring.gens[index] * g.sign), g.strict))
        near, chosen = used(p), []
        while more := [fact for fact in facts if fact not in chosen and used(fact[0]) & near]:
            chosen += more
            near = near.union(*(used(fact) for fact, _ in more))
        for index in sorted(near):
            g, square = self._ring.generators[index], self._ring.squares.get(index)
            is_real = square is None or index in used(p) or self._directly(square).value > 0
            if g.sign and index not in self._forms.keys() - self._below_one and is_real:
                chosen.append((self._ring.gens[index] * g.sign, g.strict))
        return chosen[:_MAX_ATOMS]

    def _products_of(self, atoms: list[tuple[fmpq_mpoly, bool]], degree: int) -> list[tuple[fmpq_mpoly, bool]]:
        """1 and the products of up to ``degree`` atoms, up to a number."""
        products = level = [(self._ring.one, True, 0)]
        for _ in range(degree):
            level = [
                (self._ring.times(product, atom), strict and atom_strict, i)
                for product, strict, first in level
                for i, (atom, atom_strict) in enumerate(atoms[first:], first)
            ]
            if len(products) + len(level) > _MAX_PRODUCTS:
                break
            products = products + level
        return [(self._ring.reduce(product), strict) for product, strict, _ in products]
