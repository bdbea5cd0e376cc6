"""Exponentials, circular functions, logarithms and inverse functions as generators of a tower.

Exponentials and circular functions of commensurable arguments become powers of one generator each; what is left
(inverse functions, logarithms) becomes a free generator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any, Protocol

import sympy
from flint import fmpq_mpoly, fmpz

from heavytop.features.claims.algebra import structure
from heavytop.features.claims.algebra.elliptic import FREE, WEIERSTRASS, wpinverse
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.rational import Tower
from heavytop.features.claims.algebra.ring import Quotient, Unprovable, used
from heavytop.features.claims.algebra.signs import NUMBER_BITS, Sign

# Inverse functions that are one another: asin u + acos u = π/2, atan u + atan 1/u = ± π/2, acos(cos w) = w.


# below π/2 and π
_QUARTER, _HALF = Fraction(3, 2), Fraction(3)
Known = Callable[[str, Quotient], Quotient | None]


class Expressions(Protocol):
    """The interface of a field for its generators, which :class:`heavytop.features.claims.algebra.fields.Field` is."""

    tower: Tower

    def enter(self, expression: sympy.Expr) -> Quotient: ...
    def expression(self, value: Quotient) -> sympy.Expr: ...
    def is_constant(self, value: Quotient) -> bool: ...
    def means(self, index: int, meaning: sympy.Expr) -> None: ...


def same_as(name: str, u: Quotient, field: Expressions, known: Known) -> Quotient | None:
    """asin, acos or atan of ``u`` through a function that the field has already, or through the angle in it.

    known: the generator of a function of an argument, None before the first.
    """
    if name not in ("asin", "acos", "atan"):
        return None
    t = field.tower
    angle = _angle_in(name, u, field)
    if angle is not None:
        return angle
    minus = t.product((t.number(-1), u))
    opposite = known(name, minus)
    if opposite is not None:
        return _difference(field, field.enter(sympy.pi) if name == "acos" else t.number(0), opposite)
    quarter = Fraction(1, 2)
    if name == "atan":
        sign = t.sign(u)
        partner = known("atan", t.power(u, -1)) if sign.strict and sign.value else None
        quarter *= sign.value
    else:
        partner = known("acos" if name == "asin" else "asin", u)
    if partner is None:
        return None
    return _difference(field, t.product((t.number(quarter), field.enter(sympy.pi))), partner)


def _difference(field: Expressions, a: Quotient, b: Quotient) -> Quotient:
    t = field.tower
    return t.sum((a, t.product((t.number(-1), b))))


def _angle_in(name: str, u: Quotient, field: Expressions) -> Quotient | None:
    """w of acos(cos w), asin(sin w), atan(tan w), where w lies in the range of the inverse function."""
    t = field.tower
    for sine, cosine, angle in _circles(field):
        above, below = {
            "acos": (t.gens[cosine], t.one),
            "asin": (t.gens[sine], t.one),
            "atan": (t.gens[sine], t.gens[cosine]),
        }[name]
        if t.reduce(t.times(u.numerator, below)) == t.reduce(t.times(above, u.denominator)):
            inside = is_between(field, angle, Fraction(0), _HALF) if name == "acos" else is_below_quarter(field, angle)
            return angle if inside else None
    return None


def _circles(field: Expressions) -> Iterator[tuple[int, int, Quotient]]:
    """(sine, cosine, angle) of the field."""
    for sine, cosine in field.tower.signs.circles.items():
        arguments = field.tower.generators[sine].arguments
        if arguments:
            yield sine, cosine, arguments[0]


def is_below_quarter(field: Expressions, angle: Quotient) -> bool:
    """|angle| ≤ 3/2, so that its cosine is > 0."""
    return is_between(field, angle, -_QUARTER, _QUARTER)


def is_between(field: Expressions, angle: Quotient, low: Fraction, high: Fraction) -> bool:
    """low ≤ angle ≤ high all over the domain, shown."""
    t = field.tower
    up = _difference(field, angle, t.number(low))
    down = _difference(field, t.number(high), angle)
    return t.sign(up).value > 0 and t.sign(down).value > 0


_MAX_MULTIPLE = 64
_FACTORED_BITS = 64
_INVERSE = ("asin", "acos", "atan", "atan2")
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
"""Whether it is never 0; where not, it is 0 with its argument alone."""
Circle = tuple[Quotient, Quotient]


class Refine(Exception):
    """A base of exponentials has to be divided: start again."""


class Transcendental:
    """The transcendental generators of ``field``.  ``divisors`` outlives it: what the bases have to be divided by."""

    def __init__(self, field: Expressions, divisors: list[int]) -> None:
        self._field = field
        self._tower = field.tower
        self._divisors = divisors
        self._bases: list[tuple[str, Quotient, int]] = []
        self._functions: dict[tuple[str, ...], int] = {}
        self._weierstrass: dict[tuple[str, ...], tuple[int, int]] = {}
        self._elliptic: dict[tuple[str, ...], tuple[int, int]] = {}

    # --- exponentials -----------------------------------------------------------------------------------------------

    def exponential(self, argument: Quotient) -> Quotient:
        """exp of an argument; whole and half multiples of logarithms in it come out as powers."""
        argument, factor = self._without_logarithms(argument)
        if not argument.numerator:
            return factor
        parts = self._in_parts(argument)
        if len(parts) > 1:
            return self._tower.product((factor, *(self.exponential(part) for part in parts)))

        def make(base: Quotient, _divisor: int) -> int:
            meaning = sympy.exp(self._field.expression(base))
            index = self._new("exp", meaning, (base,), Sign(1, True))
            self._declare_size(index, self._tower.sign(base).value)
            return index

        index, multiple = self._multiple("exp", argument, make)
        return self._tower.product(
            (factor, self._tower.power(self._tower.polynomial(self._tower.gens[index]), multiple))
        )

    def hyperbolic(self, name: str, argument: Quotient) -> Quotient:
        """sinh, cosh, tanh and their reciprocals."""
        t = self._tower
        up = self.exponential(argument)
        down = t.power(up, -1)
        sine, cosine = t.sum((up, t.product((t.number(-1), down)))), t.sum((up, down))
        two = t.number(2)
        above, below = {
            "sinh": (sine, two),
            "cosh": (cosine, two),
            "tanh": (sine, cosine),
            "coth": (cosine, sine),
            "sech": (two, cosine),
            "csch": (two, sine),
        }[name]
        return t.divide(above, below)

    def _in_parts(self, argument: Quotient) -> list[Quotient]:
        """Constant terms apart from those that move; all terms apart where each is a multiple of a known base."""
        terms = self._tower.summands(argument)
        still = [term for term in terms if self._field.is_constant(term)]
        if still and len(still) < len(terms):
            moving = [term for term in terms if not self._field.is_constant(term)]
            return [self._tower.sum(still), self._tower.sum(moving)]
        bases = [base for kind, base, _ in self._bases if kind == "exp"]
        multiples = all(any(self._tower.ratio(term, base) is not None for base in bases) for term in terms)
        return terms if multiples else [argument]

    def _without_logarithms(self, argument: Quotient) -> tuple[Quotient, Quotient]:
        """(argument without multiples of logarithms, their exponentials)."""
        t, factor, rest = self._tower, self._tower.number(1), {}
        denominator = argument.denominator
        if not denominator.is_constant():
            return argument, factor
        for monomial, coefficient in argument.numerator.to_dict().items():
            twice = 2 * Fraction(int(coefficient.p), int(coefficient.q))
            index = _single(monomial)
            is_log = index is not None and t.generators[index].kind == "log"
            if is_log and index is not None and twice.denominator == 1 and abs(twice) <= _MAX_MULTIPLE:
                inside = t.generators[index].arguments[0]
                base = inside if twice % 2 == 0 else t.root(inside)
                power = int(twice) // 2 if twice % 2 == 0 else int(twice)
                factor = t.product((factor, t.power(base, power)))
            else:
                rest[monomial] = coefficient
        return t.polynomial(t.context.from_dict(rest)), factor

    def _declare_size(self, index: int, sign: int) -> None:
        """An exponential of known sign of the argument lies above or below 1."""
        if sign:
            excess = self._tower.add(f"excess over 1 of x{index}", constant=False, sign=1)
            self._tower.signs.declare_form(index, self._tower.gens[excess] + 1)
            if sign < 0:
                self._tower.signs.declare_below_one(index)

    def _multiple(self, kind: str, argument: Quotient, make: Callable[[Quotient, int], int]) -> tuple[int, int]:
        """(generator, n): the argument is n times the generator's base.

        make: adds the generator of a new base, which is the argument over as much as has turned out to be needed.
        """
        for position, (known_kind, base, index) in enumerate(self._bases):
            if kind == known_kind:
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
        base = self._tower.product((argument, self._tower.number(Fraction(1, divisor))))
        position = len(self._bases)
        self._bases.append((kind, base, -1))
        self._bases[position] = (kind, base, make(base, divisor))
        return self._bases[position][2], divisor

    # --- the circle -------------------------------------------------------------------------------------------------

    def circle(self, argument: Quotient) -> Circle:
        """(sin, cos) of an argument: sums by the addition theorem, multiples by powers of cos + i sin."""
        t = self._tower
        total: Circle = (t.number(0), t.number(1))
        if not argument.numerator:
            return total
        for part in self._tower.summands(argument):
            total = self._turn(total, self._circle_of_term(part))
        return total

    def _circle_of_term(self, value: Quotient) -> Circle:
        known = self._circle_of_number(value)
        if known is not None:
            return known
        inverse = self._inverse_multiple(value)
        if inverse is not None:
            return self._turned(*inverse)

        def make(base: Quotient, _divisor: int) -> int:
            part = self._field.expression(base)
            sine, cosine = sympy.sin(part, evaluate=False), sympy.cos(part, evaluate=False)
            index = self._new("sin", sine, (base,), Sign(0, False))
            square = 1 - self._tower.gens[index] ** 2
            partner = self._tower.add_root(("cos", part), square, sign=0, kind="cos")
            self._field.means(partner, cosine)
            self._set_number(partner, cosine)
            self._tower.signs.circles[index] = partner
            unit = (Fraction(-1), Fraction(1))
            self._tower.signs.ranges |= {index: unit, partner: unit}
            if is_below_quarter(self._field, base):
                for positive in (self._tower.gens[partner], *(1 + n * self._tower.gens[index] for n in (-1, 1))):
                    self._tower.signs.declare(positive, Sign(1, True))
            return index

        index, multiple = self._multiple("circle", value, make)
        t = self._tower
        cosine = self._tower.signs.circles[index]
        return self._turned((t.polynomial(t.gens[index]), t.polynomial(t.gens[cosine])), multiple)

    def _circle_of_number(self, value: Quotient) -> Circle | None:
        """(sin, cos) of a multiple of π/12, in square roots."""
        is_number = used(value.numerator) <= self._tower.signs.numbers.keys()
        turn = self._tower.ratio(value, self._field.enter(sympy.pi)) if is_number else None
        if turn is None or 12 % turn.denominator:
            return None
        angle = sympy.pi * sympy.Rational(turn.numerator, turn.denominator)
        return self._field.enter(sympy.sin(angle)), self._field.enter(sympy.cos(angle))

    def _inverse_multiple(self, value: Quotient) -> tuple[Circle, int] | None:
        """((sin, cos) of an inverse function, n) where the value is n times it."""
        t = self._tower
        terms = value.numerator.to_dict()
        if len(terms) != 1 or not value.denominator.is_constant():
            return None
        ((monomial, coefficient),) = terms.items()
        index = _single(monomial)
        if index is None or coefficient.q != 1 or abs(coefficient.p) > _MAX_MULTIPLE:
            return None
        g = t.generators[index]
        if g.kind == "am":
            return (self.jacobi("sn", *g.arguments), self.jacobi("cn", *g.arguments)), int(coefficient.p)
        if g.kind not in _INVERSE:
            return None
        u, one = g.arguments[0], t.number(1)
        square = t.product((u, u))
        other = t.root(t.sum((one, t.product((t.number(1 if g.kind == "atan" else -1), square)))))
        if g.kind == "atan2":
            x = g.arguments[1]
            radius = t.root(t.sum((square, t.product((x, x)))))
            pair = t.divide(u, radius), t.divide(x, radius)
        elif g.kind == "atan":
            pair = t.divide(u, other), t.divide(one, other)
        else:
            pair = (u, other) if g.kind == "asin" else (other, u)
        return pair, int(coefficient.p)

    def _turned(self, pair: Circle, multiple: int) -> Circle:
        """(sin, cos) of a multiple."""
        sine, cosine = pair
        if multiple < 0:
            sine = self._tower.product((self._tower.number(-1), sine))
        result = (self._tower.number(0), self._tower.number(1))
        for _ in range(abs(multiple)):
            result = self._turn(result, (sine, cosine))
        return result

    def _turn(self, a: Sequence[Quotient], b: Sequence[Quotient]) -> Circle:
        """(sin, cos) of a sum."""
        t = self._tower
        minus = t.number(-1)
        return (
            t.sum((t.product((a[0], b[1])), t.product((a[1], b[0])))),
            t.sum((t.product((a[1], b[1])), t.product((minus, a[0], b[0])))),
        )

    # --- Jacobi's functions -----------------------------------------------------------------------------------------

    def jacobi(self, name: str, argument: Quotient, parameter: Quotient) -> Quotient:
        """sn, cn, dn: sn is a free generator, cn one with cn² = 1 − sn², and dn = √(1 − m sn²) > 0."""
        t = self._tower
        key = _key("sn", argument, parameter)
        if key not in self._elliptic:
            self._elliptic[key] = self._new_elliptic(argument, parameter)
        sine, cosine = self._elliptic[key]
        if name != "dn":
            return t.polynomial(t.gens[sine if name == "sn" else cosine])
        s = t.polynomial(t.gens[sine])
        square = t.sum((t.number(1), t.product((t.number(-1), parameter, s, s))))
        below = t.signs.of(square.denominator)
        above = square.numerator if below.value else t.times(square.numerator, square.denominator)
        t.signs.declare(above, Sign(below.value or 1, True))  # where 0 ≤ m ≤ 1, which is a condition of each proof
        return t.root(square)

    def _new_elliptic(self, argument: Quotient, parameter: Quotient) -> tuple[int, int]:
        t = self._tower
        u, m = self._field.expression(argument), self._field.expression(parameter)
        sine, cosine = structure.sn(u, m, evaluate=False), structure.cn(u, m, evaluate=False)
        index = self._new("sn", sine, (argument, parameter), Sign(0, False))
        partner = t.add_root(("cn", u, m), 1 - t.gens[index] ** 2, sign=0, kind="cn")
        self._field.means(partner, cosine)
        self._set_number(partner, cosine)
        unit = (Fraction(-1), Fraction(1))
        t.signs.ranges |= {index: unit, partner: unit}
        return index, partner

    def weierstrass(self, name: str, arguments: tuple[Quotient, Quotient, Quotient]) -> Quotient:
        """℘ is a free generator, (L ℘')² = L² (4℘³ − g2 ℘ − g3) with a common denominator L of the invariants.

        1/℘, which stands in conditions alone, is one of its own: it may be 0.
        """
        t, kind = self._tower, name.removesuffix("prime")
        lowest = self._lowest_root(*arguments[1:]) if kind == "wp3" and not arguments[0].numerator else None
        if lowest is not None:
            return lowest if kind == name else t.number(0)
        key = _key(kind, *arguments)
        if key not in self._weierstrass:
            self._weierstrass[key] = self._new_weierstrass(kind, arguments)
        value, rate = self._weierstrass[key]
        if kind == name:
            return t.polynomial(t.gens[value])
        scale = t.times(arguments[1].denominator, arguments[2].denominator)
        return t.divide(t.polynomial(t.gens[rate]), t.polynomial(scale))

    def _lowest_root(self, g2: Quotient, g3: Quotient) -> Quotient | None:
        """℘(ω3): the root e < 0 of 4x³ − g2 x − g3 with 12e² > g2, where it is a rational function of the symbols."""
        t = self._tower
        index = t.add(f"root {len(t.generators)}", constant=True)
        x = t.polynomial(t.gens[index])
        cubic = t.sum(
            (t.product((t.number(4), x, x, x)), t.product((t.number(-1), g2, x)), t.product((t.number(-1), g3)))
        )
        for factor, _ in cubic.numerator.factor()[1]:
            parts = t.by_power(factor, index)
            if parts.keys() == {0, 1}:
                e = t.quotient(-parts[0], parts[1])
                slope = t.sum((t.product((t.number(12), e, e)), t.product((t.number(-1), g2))))
                if t.sign(e) == Sign(-1, True) and t.sign(slope) == Sign(1, True):
                    return e
        return None

    def _new_weierstrass(self, kind: str, arguments: tuple[Quotient, Quotient, Quotient]) -> tuple[int, int]:
        t, (_, g2, g3) = self._tower, arguments
        texts = [self._field.expression(part) for part in arguments]
        if kind == "wpinverse":
            index = self._new(kind, wpinverse(*texts, evaluate=False), arguments, Sign(0, False))
            return index, index
        value, rate = (WEIERSTRASS[kind + end](*texts, evaluate=False) for end in ("", "prime"))
        index = self._new(kind, value, arguments, Sign(0, False))
        p, scale = t.gens[index], t.times(g2.denominator, g3.denominator)
        square = 4 * scale**2 * p**3
        square -= scale * (g2.numerator * g3.denominator * p + g3.numerator * g2.denominator)
        meaning = self._field.expression(Quotient(scale, t.one)) * rate
        root = t.add_root((rate, scale), square, sign=0, kind=f"{kind}prime")
        self._field.means(root, meaning)
        self._set_number(root, meaning)
        return index, root

    # --- logarithms and the rest ------------------------------------------------------------------------------------

    def logarithm(self, inside: Quotient) -> Quotient:
        """ln: exponentials come out as their arguments, positive factors and primes as logarithms of their own."""
        t = self._tower
        total, sign, number, left = t.number(0), 1, Fraction(1), [t.one, t.one]
        for side, part in enumerate((inside.numerator, inside.denominator)):
            constant, factors = part.factor()
            sign *= 1 if constant > 0 else -1
            number *= abs(Fraction(int(constant.p), int(constant.q))) ** (1 - 2 * side)
            for factor, power in factors:
                known = t.signs.of(factor)
                if known.value:  # where it is 0, the whole has no logarithm
                    sign *= known.value ** int(power)
                    weight = t.number(int(power) * (1 - 2 * side))
                    total = t.sum((total, t.product((weight, self._logarithm_of_factor(factor * known.value)))))
                else:
                    left[side] = t.times(left[side], t.raised(factor, int(power)))
        total = t.sum((total, self._logarithm_of_number(number)))
        if left == [t.one, t.one] and sign > 0:
            return total
        return t.sum((total, self.function("log", (t.quotient(left[0] * sign, left[1]),))))

    def _logarithm_of_number(self, value: Fraction) -> Quotient:
        """ln of a positive fraction, over its primes where they are small."""
        t, total = self._tower, self._tower.number(0)
        for whole, weight in ((value.numerator, 1), (value.denominator, -1)):
            primes = fmpz(whole).factor() if whole.bit_length() <= _FACTORED_BITS else [(whole, 1)]
            for prime, power in primes:
                if prime != 1:
                    one = self.function("log", (t.number(int(prime)),))
                    total = t.sum((total, t.product((t.number(weight * int(power)), one))))
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
                return t.product((t.number(Fraction(1, 2)), self.logarithm(g.arguments[0])))
        return self.function("log", (t.polynomial(factor),))

    def function(self, name: str, arguments: tuple[Quotient, ...]) -> Quotient:
        """A free generator for a function of these arguments: the same arguments, the same generator."""
        key = _key(name, *arguments)
        if key not in self._functions:
            same = same_as(name, arguments[0], self._field, self._known)
            if same is not None:
                return same
            make = FREE.get(name) or getattr(sympy, name)
            meaning = make(*(self._field.expression(argument) for argument in arguments), evaluate=False)
            sign = Sign(0, False)
            if name in ("asin", "atan"):
                sign = self._tower.sign(arguments[0])
            elif name == "acos":
                below = self._tower.sum(
                    (self._tower.number(1), self._tower.product((self._tower.number(-1), *arguments)))
                )
                sign = Sign(1, self._tower.sign(below).strict)
            elif name in _OF_ANGLE:
                sign = self._tower.sign(arguments[FREE[name].moving - 1])
            elif name in _POSITIVE:
                sign = Sign(1, _POSITIVE[name] or self._tower.sign(arguments[0]).strict)
            index = self._new(name, meaning, arguments, sign)
            if name == "modulus":
                self._tower.signs.declare(1 - self._tower.gens[index], Sign(1, True))
            if name == "atan":
                one_sided = sign.value if sign.strict else 0
                low, high = 0 if one_sided > 0 else -1, 0 if one_sided < 0 else 1
                self._tower.signs.turns[index] = Fraction(low, 2), Fraction(high, 2)
            if name in _RANGES:
                self._tower.signs.ranges[index] = _RANGES[name]
            self._functions[key] = index
        return self._tower.polynomial(self._tower.gens[self._functions[key]])

    def _known(self, name: str, argument: Quotient) -> Quotient | None:
        index = self._functions.get(_key(name, argument))
        return None if index is None else self._tower.polynomial(self._tower.gens[index])

    def _new(self, kind: str, meaning: sympy.Expr, arguments: tuple[Quotient, ...], sign: Sign) -> int:
        constant = all(self._field.is_constant(argument) for argument in arguments)
        index = self._tower.add(
            meaning, constant=constant, sign=sign.value, strict=sign.strict, kind=kind, arguments=arguments
        )
        self._field.means(index, meaning)
        self._set_number(index, meaning)
        if kind in _MONOTONE:
            self._declare_order(index)
        return index

    def _declare_order(self, index: int) -> None:
        """Declares the order of the values of a monotone function at ordered constants."""
        t, g = self._tower, self._tower.generators[index]
        for other, before in enumerate(t.generators[:index]):
            if before.kind == g.kind and g.constant and before.constant:
                minus = t.product((t.number(-1), before.arguments[0]))
                sign = t.sign(t.sum((g.arguments[0], minus)))
                if sign.value and sign.strict:
                    t.signs.declare(t.gens[index] - t.gens[other], Sign(sign.value * _MONOTONE[g.kind], True))

    def _set_number(self, index: int, meaning: sympy.Expr) -> None:
        if not meaning.free_symbols:
            self._tower.signs.numbers[index] = evaluate(meaning, {}, NUMBER_BITS)


def _key(name: str, *arguments: Quotient) -> tuple[str, ...]:
    return (name, *(str((argument.numerator, argument.denominator)) for argument in arguments))


def _single(monomial: Any) -> int | None:
    """The generator that a monomial is, or None."""
    powers = [(index, int(power)) for index, power in enumerate(monomial) if power]
    return powers[0][0] if len(powers) == 1 and powers[0][1] == 1 else None
