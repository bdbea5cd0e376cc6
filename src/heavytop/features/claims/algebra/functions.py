"""Exponentials, circular functions, logarithms and inverse functions as generators of a tower.

Exponentials and circular functions of commensurable arguments become powers of one generator each; inverse functions
and logarithms become free generators.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import prod
from typing import Any, Protocol

import sympy
from flint import fmpq_mpoly, fmpz

from heavytop.features.claims.algebra.elliptic import FREE, WEIERSTRASS, cn, sn, wpinverse
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.rational import Tower
from heavytop.features.claims.algebra.ring import Generator, Quotient, Unprovable, as_fraction, used
from heavytop.features.claims.algebra.signs import NUMBER_BITS, PLUS, UNKNOWN, Sign


class Expressions(Protocol):
    """The interface of a field (:class:`heavytop.features.claims.algebra.fields.Field`) for its generators."""

    tower: Tower

    def enter(self, expression: sympy.Expr) -> Quotient: ...
    def expression(self, value: Quotient) -> sympy.Expr: ...
    def is_constant(self, value: Quotient) -> bool: ...


_MAX_MULTIPLE = 64
_FACTORED_BITS = 64
INVERSE = ("asin", "acos", "atan", "atan2")
# below π/2 and π
_QUARTER, _HALF = Fraction(3, 2), Fraction(3)
_UNIT = (Fraction(-1), Fraction(1))
# 22/7 is larger than pi
_RANGES = {
    "asin": (Fraction(-11, 7), Fraction(11, 7)),
    "atan": (Fraction(-11, 7), Fraction(11, 7)),
    "acos": (Fraction(0), Fraction(22, 7)),
    "atan2": (Fraction(-22, 7), Fraction(22, 7)),
}
# 1 where the function increases, -1 where it decreases
_MONOTONE = {"exp": 1, "log": 1, "asin": 1, "atan": 1, "acos": -1}
_OF_ANGLE = ("am", "ellipticF", "ellipticE", "ellipticPi")
"""Odd functions that increase."""
_POSITIVE = {"thetan": True, "wsigma3": True, "modulus": False}
"""Functions >= 0, and whether they are never 0; the others are 0 with their argument alone."""
Circle = tuple[Quotient, Quotient]
"""(sin, cos) of an angle, or a multiple of both."""


def circle_of_sum(a: Circle, b: Circle) -> Circle:
    """(sin, cos) of a sum."""
    return a[0] * b[1] + a[1] * b[0], a[1] * b[1] - a[0] * b[0]


class Refine(Exception):
    """A base of exponentials has to be divided, and the field built again."""


class Transcendental:
    """The transcendental generators of ``field``.  divisors: of the bases, which persist when the field is rebuilt."""

    def __init__(self, field: Expressions, divisors: list[int]) -> None:
        self._field = field
        self._tower = field.tower
        self._divisors = divisors
        self._bases: list[tuple[str, Quotient, int]] = []
        self._functions: dict[tuple[str, ...], int] = {}
        self._pairs: dict[tuple[str, ...], tuple[int, int]] = {}

    # --- exponentials -----------------------------------------------------------------------------------------------

    def exponential(self, argument: Quotient) -> Quotient:
        """exp of an argument; integer and half-integer multiples of logarithms in it become powers."""
        argument, factor = self._without_logarithms(argument)
        if not argument.numerator:
            return factor
        parts = self._in_parts(argument)
        if len(parts) > 1:
            return prod(map(self.exponential, parts), start=factor)

        def make(base: Quotient) -> int:
            meaning = sympy.exp(self._field.expression(base))
            index = self._new("exp", meaning, (base,), PLUS)
            sign, strict = self._tower.sign(base)
            if sign:  # it lies above or below 1
                excess = self._tower.add(Generator(f"excess over 1 of x{index}", constant=False, sign=1, strict=strict))
                self._tower.signs.declare_form(index, self._tower.gens[excess] + 1, below_one=sign < 0)
            return index

        index, multiple = self._multiple("exp", argument, make)
        return factor * self._generator(index) ** multiple

    def hyperbolic(self, name: str, argument: Quotient) -> Quotient:
        """sinh, cosh, tanh and their reciprocals."""
        growing = self.exponential(argument)
        twice_sine, twice_cosine, two = growing - 1 / growing, growing + 1 / growing, self._tower.number(2)
        numerator, denominator = {
            "sinh": (twice_sine, two),
            "cosh": (twice_cosine, two),
            "tanh": (twice_sine, twice_cosine),
            "coth": (twice_cosine, twice_sine),
            "sech": (two, twice_cosine),
            "csch": (two, twice_sine),
        }[name]
        return numerator / denominator

    def _in_parts(self, argument: Quotient) -> list[Quotient]:
        """The constant and the moving part of an argument; or its terms, where each is a multiple of a known base."""
        terms = self._tower.summands(argument)
        constant = [term for term in terms if self._field.is_constant(term)]
        if constant and len(constant) < len(terms):
            moving = [term for term in terms if not self._field.is_constant(term)]
            zero = self._tower.number(0)
            return [sum(constant, zero), sum(moving, zero)]
        bases = [base for kind, base, _ in self._bases if kind == "exp"]
        multiples = all(any(self._tower.ratio(term, base) is not None for base in bases) for term in terms)
        return terms if multiples else [argument]

    def _without_logarithms(self, argument: Quotient) -> tuple[Quotient, Quotient]:
        """(argument without multiples of logarithms, their exponentials)."""
        t, factor, terms = self._tower, self._tower.number(1), {}
        denominator = argument.denominator
        if not denominator.is_constant():
            return argument, factor
        for monomial, coefficient in argument.numerator.to_dict().items():
            twice = 2 * as_fraction(coefficient)
            index = _single(monomial)
            is_log = index is not None and t.generators[index].kind == "log"
            if is_log and index is not None and twice.denominator == 1 and abs(twice) <= _MAX_MULTIPLE:
                inside = t.generators[index].arguments[0]
                base = inside if twice % 2 == 0 else t.root(inside)
                power = int(twice) // 2 if twice % 2 == 0 else int(twice)
                factor = factor * base**power
            else:
                terms[monomial] = coefficient
        return t.polynomial(t.context.from_dict(terms)), factor

    def _multiple(self, kind: str, argument: Quotient, make: Callable[[Quotient], int]) -> tuple[int, int]:
        """(generator, n): the argument is n times the generator's base.

        make: adds the generator of a new base, the argument over the divisor known so far.
        """
        for position, (known_kind, base, index) in enumerate(self._bases):
            if kind == known_kind and index >= 0:  # a base whose generator could not be added has none
                value = self._tower.ratio(argument, base)
                if value is not None:
                    if value.denominator > 1:
                        self._divisors[position] *= value.denominator
                        raise Refine
                    if abs(value) > _MAX_MULTIPLE:
                        raise Unprovable(f"A multiple {value} of an argument.")
                    return index, int(value)
        if len(self._divisors) <= len(self._bases):
            self._divisors.append(1)
        divisor = self._divisors[len(self._bases)]
        if divisor > _MAX_MULTIPLE:
            raise Unprovable(f"A multiple {divisor} of an argument.")
        base = argument / divisor
        position = len(self._bases)
        self._bases.append((kind, base, -1))
        self._bases[position] = (kind, base, index := make(base))
        return index, divisor

    # --- the circle -------------------------------------------------------------------------------------------------

    def circle(self, argument: Quotient) -> Circle:
        """(sin, cos) of an argument: sums and multiples by the addition theorem."""
        total = self._tower.number(0), self._tower.number(1)
        if argument.numerator:
            for part in self._tower.summands(argument):
                total = circle_of_sum(total, self._circle_of_term(part))
        return total

    def _circle_of_term(self, value: Quotient) -> Circle:
        is_number = used(value.numerator) <= self._tower.signs.numbers.keys()
        turn = self._tower.ratio(value, self._field.enter(sympy.pi)) if is_number else None
        if turn is not None and 12 % turn.denominator == 0:
            return self.circle_of_turn(turn)
        inverse = self._inverse_multiple(value)
        if inverse is not None:
            return self._times(*inverse)

        def make(base: Quotient) -> int:
            t, angle = self._tower, self._field.expression(base)
            sine, cosine = sympy.sin(angle, evaluate=False), sympy.cos(angle, evaluate=False)
            sine_index, cosine_index = self._new_pair("sin", sine, "cos", cosine, (base,))
            t.signs.circles[sine_index] = cosine_index
            if self._is_between(base, -_QUARTER, _QUARTER):  # the cosine is > 0
                for positive in (t.gens[cosine_index], 1 - t.gens[sine_index], 1 + t.gens[sine_index]):
                    t.signs.declare(positive, PLUS)
            return sine_index

        index, multiple = self._multiple("circle", value, make)
        return self._times((self._generator(index), self._generator(self._tower.signs.circles[index])), multiple)

    def circle_of_turn(self, turn: Fraction) -> Circle:
        """(sin, cos) of a multiple of π, in square roots; the denominator of ``turn`` divides 12."""
        angle = sympy.pi * sympy.Rational(turn)
        return self._field.enter(sympy.sin(angle)), self._field.enter(sympy.cos(angle))

    def _inverse_multiple(self, value: Quotient) -> tuple[Circle, int] | None:
        """((sin, cos) of an inverse function, n) where the value is n times it."""
        terms = value.numerator.to_dict()
        if len(terms) != 1 or not value.denominator.is_constant():
            return None
        ((monomial, coefficient),) = terms.items()
        index = _single(monomial)
        if index is None or coefficient.q != 1 or abs(coefficient.p) > _MAX_MULTIPLE:
            return None
        g = self._tower.generators[index]
        if g.kind == "am":
            return (self.jacobi("sn", *g.arguments), self.jacobi("cn", *g.arguments)), int(coefficient.p)
        if g.kind not in INVERSE:
            return None
        sine, cosine = self.direction(index)
        radius = self._tower.root(sine * sine + cosine * cosine)
        return (sine / radius, cosine / radius), int(coefficient.p)

    def direction(self, index: int) -> Circle:
        """A positive multiple of (sin, cos) of the angle that an inverse function is."""
        g, one = self._tower.generators[index], self._tower.number(1)
        u = g.arguments[0]
        if g.kind in ("atan", "atan2"):
            return u, (*g.arguments, one)[1]
        root = self._tower.root(one - u * u)
        return (u, root) if g.kind == "asin" else (root, u)

    def _times(self, circle: Circle, multiple: int) -> Circle:
        """(sin, cos) of a multiple."""
        sine, cosine = circle if multiple > 0 else (-circle[0], circle[1])
        result = self._tower.number(0), self._tower.number(1)
        for _ in range(abs(multiple)):
            result = circle_of_sum(result, (sine, cosine))
        return result

    # --- Jacobi's functions -----------------------------------------------------------------------------------------

    def jacobi(self, name: str, argument: Quotient, parameter: Quotient) -> Quotient:
        """sn, cn, dn: sn is a free generator, cn one with cn² = 1 − sn², and dn = √(1 − m sn²) > 0."""
        key = _key("sn", argument, parameter)
        if key not in self._pairs:
            u, m = self._field.expression(argument), self._field.expression(parameter)
            meanings = sn(u, m, evaluate=False), cn(u, m, evaluate=False)
            self._pairs[key] = self._new_pair("sn", meanings[0], "cn", meanings[1], (argument, parameter))
        sine, cosine = map(self._generator, self._pairs[key])
        if name != "dn":
            return sine if name == "sn" else cosine
        square = 1 - parameter * sine * sine
        self._tower.declare(square)  # for 0 ≤ m ≤ 1, which is a condition of each proof
        return self._tower.root(square)

    def weierstrass(self, name: str, arguments: tuple[Quotient, Quotient, Quotient]) -> Quotient:
        """℘ is a free generator, (L ℘')² = L² (4℘³ − g2 ℘ − g3) with a common denominator L of the invariants.

        1/℘, which occurs in conditions only, is another free generator: it may be 0.
        """
        t, kind = self._tower, name.removesuffix("prime")
        lowest = self._lowest_root(*arguments[1:]) if kind == "wp3" and not arguments[0].numerator else None
        if lowest is not None:
            return lowest if kind == name else t.number(0)
        key = _key(kind, *arguments)
        if key not in self._pairs:
            self._pairs[key] = self._new_weierstrass(kind, arguments)
        value, rate = map(self._generator, self._pairs[key])
        return value if kind == name else rate / t.polynomial(_scale(*arguments[1:]))

    def _lowest_root(self, g2: Quotient, g3: Quotient) -> Quotient | None:
        """℘(ω3): the root e < 0 of 4x³ − g2 x − g3 with 12e² > g2, where it is a rational function of the symbols."""
        t = self._tower
        index = t.add(Generator(f"root {len(t.generators)}", constant=True))
        x = self._generator(index)
        for factor, _ in (4 * x**3 - g2 * x - g3).numerator.factor()[1]:
            parts = t.by_power(factor, index)
            if parts.keys() == {0, 1}:
                e = t.quotient(-parts[0], parts[1])
                if t.sign(-e) == PLUS and t.sign(12 * e * e - g2) == PLUS:
                    return e
        return None

    def _new_weierstrass(self, kind: str, arguments: tuple[Quotient, Quotient, Quotient]) -> tuple[int, int]:
        t, (_, g2, g3) = self._tower, arguments
        texts = [self._field.expression(part) for part in arguments]
        if kind == "wpinverse":
            index = self._new(kind, wpinverse(*texts, evaluate=False), arguments)
            return index, index
        value, rate = (WEIERSTRASS[kind + end](*texts, evaluate=False) for end in ("", "prime"))
        index, scale = self._new(kind, value, arguments), t.polynomial(_scale(g2, g3))
        p = self._generator(index)
        square = (scale * scale * (4 * p**3 - g2 * p - g3)).numerator
        return index, self._new_root(self._field.expression(scale) * rate, square, f"{kind}prime")

    # --- logarithms and other functions -----------------------------------------------------------------------------

    def logarithm(self, inside: Quotient) -> Quotient:
        """ln as a sum: arguments of exponentials, logarithms of positive factors and primes, and one of the others."""
        t = self._tower
        total, sign, number, remaining = t.number(0), 1, Fraction(1), [t.one, t.one]
        for side, part in enumerate((inside.numerator, inside.denominator)):
            constant, factors = part.factor()
            sign *= 1 if constant > 0 else -1
            number *= abs(as_fraction(constant)) ** (1 - 2 * side)
            for factor, power in factors:
                known = t.signs.of(factor)
                if known.value:  # where it is 0, the logarithm is undefined
                    sign *= known.value ** int(power)
                    weight = int(power) * (1 - 2 * side)
                    total = total + weight * self._logarithm_of_factor(factor * known.value)
                else:
                    remaining[side] = t.times(remaining[side], t.raised(factor, int(power)))
        total = total + self._logarithm_of_number(number)
        if remaining == [t.one, t.one] and sign > 0:
            return total
        return total + self.function("log", (t.quotient(remaining[0] * sign, remaining[1]),))

    def _logarithm_of_number(self, value: Fraction) -> Quotient:
        """ln of a positive fraction, over its primes where they are small."""
        t, total = self._tower, self._tower.number(0)
        for integer, weight in ((value.numerator, 1), (value.denominator, -1)):
            primes = fmpz(integer).factor() if integer.bit_length() <= _FACTORED_BITS else [(integer, 1)]
            for prime, power in primes:
                if prime != 1:
                    total = total + weight * int(power) * self.function("log", (t.number(int(prime)),))
        return total

    def _logarithm_of_factor(self, factor: fmpq_mpoly) -> Quotient:
        """ln of an irreducible positive polynomial."""
        t = self._tower
        index = _single(next(iter(factor.to_dict()))) if len(factor) == 1 else None
        if index is not None and factor == t.gens[index]:
            g = t.generators[index]
            if g.kind == "exp":
                return g.arguments[0]
            if g.kind == "root":
                return self.logarithm(g.arguments[0]) / 2
        return self.function("log", (t.polynomial(factor),))

    def function(self, name: str, arguments: tuple[Quotient, ...]) -> Quotient:
        """The free generator of a function of these arguments."""
        key = _key(name, *arguments)
        if key not in self._functions:
            known = self._through_known(name, arguments[0]) if name in ("asin", "acos", "atan") else None
            if known is not None:
                return known
            make = FREE.get(name) or getattr(sympy, name)
            meaning = make(*map(self._field.expression, arguments), evaluate=False)
            sign, signs = self._sign_of(name, arguments), self._tower.signs
            self._functions[key] = index = self._new(name, meaning, arguments, sign)
            if name == "modulus":
                signs.declare(1 - self._tower.gens[index], PLUS)
            if name == "atan":
                one_sided = sign.value if sign.strict else 0
                low, high = 0 if one_sided > 0 else -1, 0 if one_sided < 0 else 1
                signs.turns[index] = Fraction(low, 2), Fraction(high, 2)
            if name in _RANGES:
                signs.ranges[index] = _RANGES[name]
        return self._generator(self._functions[key])

    def _sign_of(self, name: str, arguments: tuple[Quotient, ...]) -> Sign:
        """The sign of a function of these arguments."""
        t, first = self._tower, arguments[0]
        if name in ("asin", "atan"):
            return t.sign(first)
        if name == "acos":
            return Sign(1, t.sign(1 - first).strict)
        if name in _OF_ANGLE:
            return t.sign(arguments[FREE[name].moving - 1])
        return Sign(1, _POSITIVE[name] or t.sign(first).strict) if name in _POSITIVE else UNKNOWN

    def _through_known(self, name: str, u: Quotient) -> Quotient | None:
        """asin, acos or atan of ``u`` by the angle in ``u``, or by a function that the field has already.

        acos(cos w) = w, asin(−u) = −asin u, asin u + acos u = π/2, atan u + atan 1/u = ± π/2.
        """
        angle = self._angle_in(name, u)
        if angle is not None:
            return angle
        opposite = self._known(name, -u)
        if opposite is not None:
            return (self._field.enter(sympy.pi) if name == "acos" else 0) - opposite
        quarter, partner = Fraction(1, 2), self._known("acos" if name == "asin" else "asin", u)
        if name == "atan":
            sign = self._tower.sign(u)
            partner = self._known("atan", 1 / u) if sign.strict and sign.value else None
            quarter *= sign.value
        return None if partner is None else quarter * self._field.enter(sympy.pi) - partner

    def _known(self, name: str, argument: Quotient) -> Quotient | None:
        index = self._functions.get(_key(name, argument))
        return None if index is None else self._generator(index)

    def _angle_in(self, name: str, u: Quotient) -> Quotient | None:
        """w of acos(cos w), asin(sin w), atan(tan w), where w lies in the range of the inverse function."""
        for sine, cosine in self._tower.signs.circles.items():
            (angle,) = self._tower.generators[sine].arguments
            s, c = self._generator(sine), self._generator(cosine)
            if not (u * c - s if name == "atan" else u - (c if name == "acos" else s)).numerator:
                low, high = (Fraction(0), _HALF) if name == "acos" else (-_QUARTER, _QUARTER)
                return angle if self._is_between(angle, low, high) else None
        return None

    def _is_between(self, angle: Quotient, low: Fraction, high: Fraction) -> bool:
        """Whether low ≤ angle ≤ high is proven on the whole domain."""
        return self._tower.sign(angle - low).value > 0 and self._tower.sign(high - angle).value > 0

    # --- generators -------------------------------------------------------------------------------------------------

    def _generator(self, index: int) -> Quotient:
        return self._tower.polynomial(self._tower.gens[index])

    def _new(self, kind: str, meaning: sympy.Expr, arguments: tuple[Quotient, ...], sign: Sign = UNKNOWN) -> int:
        constant = all(map(self._field.is_constant, arguments))
        index = self._tower.add(Generator(meaning, constant, *sign, kind, arguments))
        self._set_number(index, meaning)
        if kind in _MONOTONE:
            self._declare_order(index)
        return index

    def _new_root(self, meaning: sympy.Expr, square: fmpq_mpoly, kind: str) -> int:
        """A root of either sign."""
        index = self._tower.add_root(meaning, square, sign=0, kind=kind)
        self._set_number(index, meaning)
        return index

    def _new_pair(
        self, kind: str, sine: sympy.Expr, other: str, cosine: sympy.Expr, arguments: tuple[Quotient, ...]
    ) -> tuple[int, int]:
        """Generators s, c with s² + c² = 1."""
        index = self._new(kind, sine, arguments)
        partner = self._new_root(cosine, 1 - self._tower.gens[index] ** 2, other)
        self._tower.signs.ranges |= {index: _UNIT, partner: _UNIT}
        return index, partner

    def _declare_order(self, index: int) -> None:
        """Declares the order of the values of a monotone function at constants."""
        t, g = self._tower, self._tower.generators[index]
        for other, before in enumerate(t.generators[:index]):
            if before.kind == g.kind and g.constant and before.constant:
                sign = t.sign(g.arguments[0] - before.arguments[0])
                if sign.value and sign.strict:
                    t.signs.declare(t.gens[index] - t.gens[other], Sign(sign.value * _MONOTONE[g.kind], True))

    def _set_number(self, index: int, meaning: sympy.Expr) -> None:
        if not meaning.free_symbols:
            self._tower.signs.numbers[index] = evaluate(meaning, {}, NUMBER_BITS)


def _key(name: str, *arguments: Quotient) -> tuple[str, ...]:
    return (name, *(str((argument.numerator, argument.denominator)) for argument in arguments))


def _scale(g2: Quotient, g3: Quotient) -> fmpq_mpoly:
    """A common denominator of the invariants."""
    return g2.tower.times(g2.denominator, g3.denominator)


def _single(monomial: Any) -> int | None:
    """The generator that a monomial is, or None."""
    powers = [(index, int(power)) for index, power in enumerate(monomial) if power]
    return powers[0][0] if len(powers) == 1 and powers[0][1] == 1 else None
