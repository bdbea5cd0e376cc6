"""Conditions for a formula to be defined and real: collected as it is read, before anything is simplified."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from fractions import Fraction
from functools import lru_cache
from itertools import islice, product
from math import comb, prod

import sympy
from flint import arb, fmpq_mpoly

from heavytop.features.claims.algebra.elliptic import JACOBI, modulus, wpinverse
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Assumptions, Field, SolvedRelation
from heavytop.features.claims.algebra.ring import as_fraction, used, where_provable
from heavytop.features.claims.algebra.signs import UNKNOWN, Sign
from heavytop.features.claims.algebra.structure import Defined, at_values, rationals

_LONGEST = 120
_BITS = 512


class ConditionKind(Enum):
    """The kind of a condition on an expression; the value is its notation."""

    NONZERO = "{} ≠ 0"
    POSITIVE = "{} > 0"
    NONNEGATIVE = "{} ≥ 0"

    def is_met_by(self, sign: Sign) -> bool:
        """Whether an expression of that sign meets the condition."""
        if self is ConditionKind.NONZERO:
            return sign.strict
        return sign.value > 0 and (sign.strict or self is ConditionKind.NONNEGATIVE)


def written(text: str) -> str:
    """A formula in the notation of files: a power is ``^``, and SymPy's Abs(x) is sqrt(x^2)."""
    while "Abs(" in text:
        before, _, after = text.partition("Abs(")
        depth, length = 1, 0
        while depth and length < len(after):
            depth += (after[length] == "(") - (after[length] == ")")
            length += 1
        inside = after[: length - 1]
        text = f"{before}sqrt({inside if inside.isalnum() else f'({inside})'}^2){after[length:]}"
    return text.replace("**", "^")


@dataclass(frozen=True, slots=True)
class Need:
    """One condition on one expression.

    shown: its text where that is not the expression itself, such as |u| ≤ 1 for 1 − u² ≥ 0.
    """

    kind: ConditionKind
    expression: sympy.Expr
    shown: str = ""

    @property
    def text(self) -> str:
        """The condition as text."""
        text = self.shown or self.kind.value.format(as_text(self.expression))
        return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"

    @where_provable(None)
    def is_met(self, values: Mapping[sympy.Symbol, Fraction]) -> bool | None:
        """Whether it is met at exact values of the symbols: True or False proven, None undecided by the ball."""
        ball = evaluate(self.expression, values, _BITS)
        if not ball.is_finite():
            return None
        e = self.expression
        is_rational = ball.contains(0) and e.is_rational_function(*e.free_symbols)
        if ball.is_zero() or (is_rational and is_exactly_zero(e, values)):
            return self.kind is ConditionKind.NONNEGATIVE
        if self.kind is ConditionKind.NONZERO:
            return True if not ball.contains(0) else None
        above = ball > 0 if self.kind is ConditionKind.POSITIVE else ball >= 0
        below = ball <= 0 if self.kind is ConditionKind.POSITIVE else ball < 0
        return True if above else False if below else None


@lru_cache(maxsize=10_000)
def as_text(expression: sympy.Expr) -> str:
    """SymPy's text of an expression, which takes a millisecond."""
    return str(expression)


_Z, _P, _N = ConditionKind.NONZERO, ConditionKind.POSITIVE, ConditionKind.NONNEGATIVE
_NEEDS: dict[str, Callable[..., Need]] = {
    "/": lambda u: Need(_Z, u),
    "sqrt": lambda u: Need(_N, u),
    "log": lambda u: Need(_P, u),
    "atan2": lambda y, x: Need(_P, y**2 + x**2),
    **dict.fromkeys(("asin", "acos"), lambda u: Need(_N, 1 - u**2, f"-1 ≤ {as_text(u)} ≤ 1")),
    **dict.fromkeys(("tan", "sec"), lambda u: Need(_Z, sympy.cos(u))),
    **dict.fromkeys(("coth", "csch"), lambda u: Need(_Z, sympy.sinh(u))),
    **dict.fromkeys(
        ("wp", "wpprime", "wzeta"),
        lambda u, g2, g3: Need(_Z, wpinverse(u, g2, g3), f"{u} is not a period of wp(u, {g2}, {g3})"),
    ),
    **dict.fromkeys(("wp3", "wp3prime", "wzeta3", "wsigma3"), lambda u, g2, g3: Need(_P, g2**3 - 27 * g3**2)),
    "ellipticPi": lambda n, phi, m: Need(_P, 1 - n, f"{n} < 1"),
    "thetaArgument": lambda u, s, m: Need(_Z, s),
}
"""Conditions on a divisor ``/``, a radicand, and the arguments of functions."""
_OF_PARAMETER: dict[str, tuple[ConditionKind | None, ConditionKind]] = {
    **dict.fromkeys((*JACOBI, "am"), (_N, _N)),
    **dict.fromkeys(("Theta", "Eta", "thetan", "jacobiZeta", "modulus", *(f"theta{i}" for i in range(1, 5))), (_N, _P)),
    **dict.fromkeys(("nome", "thetaRate", "thetaArgument"), (_P, _P)),
    **dict.fromkeys(("ellipticF", "ellipticK", "ellipticPi"), (None, _P)),
    "ellipticE": (None, _N),
}
"""Conditions on the last argument, a parameter m or a nome q: on m, and on 1 − m."""


def condition(function: str, arguments: tuple[sympy.Expr, ...]) -> frozenset[Need]:
    """Conditions for ``function`` to be defined and real: ``/`` on a divisor, ``sqrt``, ``log``, ..."""
    needs, m = set(), arguments[-1]
    # a nome of a parameter lies between 0 and 1
    if function in _OF_PARAMETER and not (isinstance(m, sympy.exp) and not isinstance(modulus(m), modulus)):
        below, above = _OF_PARAMETER[function]
        needs = {Need(below, m)} if below else set()
        needs.add(Need(above, 1 - m, f"{m} {'<' if above is _P else '≤'} 1"))
    if function in _NEEDS:
        needs.add(_NEEDS[function](*arguments))
    return frozenset(need for need in needs if not _is_plain(need))


def _is_plain(need: Need) -> bool:
    """Whether a number meets it obviously."""
    e = need.expression
    return bool(e.is_Rational and (e > 0 or (e < 0 and need.kind is ConditionKind.NONZERO)))


def parts_of(expressions: Iterable[sympy.Expr]) -> set[sympy.Expr]:
    """The different subexpressions: the tree of a residual has a hundred times as many."""
    parts: set[sympy.Expr] = set()
    stack = [*expressions]
    while stack:
        if (part := stack.pop()) not in parts:
            parts.add(part)
            stack.extend(part.args)
    return parts


def conditions_of(expressions: Iterable[sympy.Expr]) -> frozenset[Need]:
    """The conditions of SymPy expressions as they stand, without those of terms that SymPy has cancelled."""
    needs: set[Need] = set()
    for part in parts_of(expressions):
        if isinstance(part, sympy.exp):
            continue
        if part.is_Pow:
            base, exponent = part.args
            if exponent.is_Rational and exponent.q % 2 == 0:
                needs |= condition("sqrt", (base,))
            if exponent.is_negative:
                needs |= condition("/", (base,))
        elif part.is_Function:
            name = "/" if type(part).__name__ == "sign" else type(part).__name__
            needs |= condition(name, part.args)
    return frozenset(needs)


@where_provable(None)
def is_exactly_zero(expression: sympy.Expr, values: Mapping[sympy.Symbol, Fraction]) -> bool | None:
    """Whether it is 0 at exact values: True and False are proven, None is undecided.

    Rational functions are evaluated exactly.
    """
    if not all(need.is_met(values) for need in conditions_of([expression])):
        return None
    try:
        value = at_values(expression, rationals(values))
    except ValueError:
        # sympy cannot take the root of some numbers of hundreds of digits
        return None
    if value.is_Rational:
        return bool(value == 0)
    ball: arb = evaluate(expression, values, _BITS)
    if ball.is_finite() and not ball.contains(0):
        return False
    return Field(Assumptions(sympy.Dummy("t", real=True)), [value]).vanishes(value) or None


# Equations e = 0 over the real numbers as simpler equations with the same common zeros.
#
# exp(L) − 1, atan(L), |L| and L³ are 0 only where L is; a sum of squares only where each of them is.  A function with
# further zeros, such as sin(L), is left as it is.


_ONLY_ZERO = {
    # f(u) = value at one real u only
    **dict.fromkeys(("exp", "cosh", "sech"), (1, 0)),
    **dict.fromkeys(("sinh", "tanh", "atan", "asin", "Abs"), (0, 0)),
    **dict.fromkeys(("acos", "log"), (0, 1)),
}
_ANALYTIC = (sympy.sin, sympy.cos, sympy.exp, sympy.sinh, sympy.cosh, sympy.tanh, sympy.sech, sympy.atan, sympy.log)
# a polynomial of more terms is left as it is
_MOST_TERMS = 1_000
_MOST_PRODUCTS = 16


@lru_cache(maxsize=1_000)
@where_provable(UNKNOWN)
def sign_of(e: sympy.Expr) -> Sign:
    """The sign of an expression where it is defined and real, for all values of its symbols."""
    positive = tuple(symbol for symbol in e.free_symbols if symbol.is_positive)
    field = Field(Assumptions(sympy.Dummy("t", real=True), positive), [e])
    return field.sign(e)


def conditions_for_zero(e: sympy.Expr) -> tuple[sympy.Expr, ...]:
    """Expressions whose common zeros are the zeros of ``e``, where ``e`` is defined and real."""
    if e.is_Mul:
        return _for_zero_product(e.args)
    if e.is_Pow and e.args[1].is_Rational and e.args[1] > 0:
        base, exponent = e.args
        if exponent.is_Integer or (exponent.q == 2 and sign_of(base).value > 0):
            return conditions_for_zero(base)
    inside = _inside(e)
    if inside is not None:
        return conditions_for_zero(inside)
    return _for_zero_sum(e) if e.is_Add else (e,)


def _for_zero_product(factors: Sequence[sympy.Expr]) -> tuple[sympy.Expr, ...]:
    """The products of the conditions of factors that may be 0; where these are defined is checked elsewhere."""
    conditions = [conditions_for_zero(factor) for factor in factors if not sign_of(factor).strict]
    if len(conditions) == 1:
        return conditions[0]
    # (u = v = 0) or (w = x = 0) is u w = u x = v w = v x = 0
    if prod(map(len, conditions)) > _MOST_PRODUCTS:
        return (sympy.Mul(*factors),)
    return tuple(sympy.Mul(*parts) for parts in product(*conditions))


def _inside(e: sympy.Expr) -> sympy.Expr | None:
    """u − u0 where ``e`` is c + k f(u), with numbers c and k, and 0 at u = u0 only: √u = 2 where u = 4."""
    constant, term = e.as_coeff_Add()
    factor, function = term.as_coeff_Mul()
    is_root = function.is_Pow and function.args[1] == sympy.Rational(1, 2)
    if is_root and constant.is_Rational and factor.is_Rational and -constant / factor > 0:
        return function.args[0] - (constant / factor) ** 2
    name = "exp" if isinstance(function, sympy.exp) else type(function).__name__
    if name not in _ONLY_ZERO or not constant.is_Rational or not factor.is_Rational:
        return None
    value, u0 = _ONLY_ZERO[name]
    return function.args[0] - u0 if -constant == factor * value else None


def _for_zero_sum(e: sympy.Expr) -> tuple[sympy.Expr, ...]:
    signs = [sign_of(part) for part in e.args]
    if abs(sum(sign.value for sign in signs)) == len(signs):
        return (e,) if any(sign.strict for sign in signs) else _for_common_zero(e.args)
    if not is_small_polynomial(e):
        return (e,)
    factors = sympy.factor_list(e)[1]
    if len(factors) > 1 or factors[0][1] > 1:
        return _for_zero_product([factor for factor, _ in factors])
    squares = _as_squares(e)
    return _for_common_zero(squares) if squares else (e,)


def _for_common_zero(parts: Iterable[sympy.Expr]) -> tuple[sympy.Expr, ...]:
    return tuple(dict.fromkeys(condition for part in parts for condition in conditions_for_zero(part)))


def _as_squares(e: sympy.Expr) -> list[sympy.Expr]:
    """The u of a polynomial ± Σ c u² with c > 0, by completing squares; [] where that fails."""
    squares, sign, remainder = [], 0, sympy.expand(e)
    while remainder != 0:
        for x in sorted((symbol for symbol in remainder.free_symbols if not symbol.is_positive), key=str):
            p = sympy.Poly(remainder, x)
            leading = sign_of(p.nth(2))
            known = all(symbol.is_positive for symbol in p.nth(2).free_symbols)
            if p.degree() == 2 and known and leading.strict and leading.value in ({sign} if sign else {1, -1}):
                break
        else:
            return []
        sign, linear = leading.value, p.nth(1)
        squares.append(2 * p.nth(2) * x + linear)
        remainder = sympy.expand(sympy.cancel(p.nth(0) - linear**2 / (4 * p.nth(2))))
    return squares if len(squares) > 1 else []


def on_conditions(e: sympy.Expr, conditions: Sequence[sympy.Expr]) -> sympy.Expr:
    """``e`` on the common zeros of the conditions: as a polynomial, or in arguments of functions, reduced by them."""
    divisors = [condition for condition in conditions if condition.free_symbols and is_small_polynomial(condition)]
    if not divisors:
        return e
    shorter: dict[sympy.Expr, sympy.Expr] = {}
    for node in e.atoms(*_ANALYTIC):
        value = node.func(_remainder(node.args[0], divisors))
        if not value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I):
            shorter[node] = value
    return _remainder(e.xreplace(shorter), divisors)


def reduced_everywhere(e: sympy.Expr, zeros: Sequence[sympy.Expr]) -> sympy.Expr:
    """``e`` where the polynomials ``zeros`` are 0: every polynomial in it is reduced by them."""
    if not e.args or is_small_polynomial(e):
        return _remainder(e, zeros)
    value = e.func(*(reduced_everywhere(part, zeros) for part in e.args))
    return e if value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I) else value


def _remainder(e: sympy.Expr, divisors: Sequence[sympy.Expr]) -> sympy.Expr:
    """The remainder of the division, if that is shorter than ``e``."""
    if not e.free_symbols or not is_small_polynomial(e):
        return e
    remainder = sympy.reduced(e, divisors)[1]
    return remainder if remainder.is_number or sympy.count_ops(remainder) < sympy.count_ops(e) else e


def is_small_polynomial(e: sympy.Expr) -> bool:
    """Whether it is a polynomial of few terms when expanded."""
    return bool(e.is_polynomial(*e.free_symbols)) and _terms(e) <= _MOST_TERMS


def _terms(e: sympy.Expr) -> int:
    """A bound on the number of terms of its expansion."""
    if e.is_Add:
        return sum(map(_terms, e.args))
    if e.is_Mul:
        return prod(map(_terms, e.args))
    if e.is_Pow and e.args[1].is_Integer and e.args[1] > 0:
        return comb(_terms(e.args[0]) + int(e.args[1]) - 1, int(e.args[1]))
    return 1


# Relations between the parameters of a claim, solved for a parameter: a³ = 1 is a = 1, a² + b² = 1 is b = √(1 − a²).
#
# A relation is solved only where the solution holds at exactly the same real points: factors that the assumptions keep
# from 0 are omitted, a linear relation is divided by a coefficient that is never 0, and a root takes the known sign of
# the parameter.


_MAX_DEGREE = 12


def solve_relations(
    relations: Collection[sympy.Expr], known: Assumptions, parameters: Collection[sympy.Symbol]
) -> tuple[SolvedRelation, ...]:
    """Solutions of the relations that can be solved for one of the ``parameters``, each with the earlier ones."""
    solutions: tuple[SolvedRelation, ...] = ()
    for relation in relations:
        if relation.free_symbols <= set(parameters):
            solution = _solve(relation, replace(known, solved=solutions), parameters)
            solutions += () if solution is None else (solution,)
    return solutions


@where_provable(None)
def _solve(relation: sympy.Expr, known: Assumptions, parameters: Collection[sympy.Symbol]) -> SolvedRelation | None:
    field = Field(known, [relation])
    factors = _factors_with_zeros(field, field.enter(relation).numerator)
    if len(factors) != 1:
        return None
    solutions = list(_solutions(field, factors[0], relation, parameters))
    # the shortest without a root, else the shortest with one
    return min(solutions, key=lambda s: (s.radicand is not None, sympy.count_ops(s.value)), default=None)


def _factors_with_zeros(field: Field, p: fmpq_mpoly) -> list[fmpq_mpoly]:
    """The factors of ``p`` that may be 0, without those that are 0 only where another is."""
    signs = field.tower.signs
    factors = [factor for factor, _ in signs.factors(p)[1] if not signs.of(factor).strict]
    isolated = [factor for factor in factors if _is_zero_at_origin_only(factor)]
    others = [factor for factor in factors if factor not in isolated]

    def adds_zeros(form: fmpq_mpoly) -> bool:
        """Whether no other factor is 0 where the generators of the form are."""
        terms = [other.to_dict() for other in others]
        return not any(all(any(monomial[index] for index in used(form)) for monomial in term) for term in terms)

    return [*others, *filter(adds_zeros, isolated)]


def _is_zero_at_origin_only(p: fmpq_mpoly) -> bool:
    """Whether it is an irreducible form in two generators without a real zero direction."""
    indices = sorted(used(p))
    terms = p.to_dict()
    degrees = {sum(map(int, monomial)) for monomial in terms}
    if len(indices) != 2 or len(degrees) != 1 or max(degrees) > _MAX_DEGREE:
        return False
    z = sympy.Symbol("z")
    line = sympy.Poly(sum(as_fraction(c) * z ** int(m[indices[0]]) for m, c in terms.items()), z)
    return bool(line.degree() == degrees.pop() and line.eval(0) != 0 and line.count_roots() == 0)


def _solutions(
    field: Field, p: fmpq_mpoly, relation: sympy.Expr, parameters: Collection[sympy.Symbol]
) -> Iterator[SolvedRelation]:
    """The solutions of p = 0 for each of the parameters in it."""
    tower = field.tower
    zero = tower.context.constant(0)
    for index in sorted(used(p), reverse=True):
        symbol = tower.generators[index].meaning
        if tower.generators[index].kind != "symbol" or symbol not in parameters or _occurs_inside(field, index, p):
            continue
        parts = tower.by_power(p, index)
        leading = parts[max(parts)]
        if not tower.signs.of(leading).strict:
            continue
        if max(parts) == 1:
            yield SolvedRelation(symbol, field.expression(tower.quotient(-parts.get(0, zero), leading)), relation)
        elif parts.keys() == {0, 2}:
            sign = tower.signs.of(tower.gens[index])
            if sign.value and sign.strict:
                square = field.expression(tower.quotient(-parts[0], leading))
                yield SolvedRelation(symbol, sign.value * sympy.sqrt(square, evaluate=False), relation, square)


def _occurs_inside(field: Field, index: int, p: fmpq_mpoly) -> bool:
    """Whether the generator occurs in the argument of a root or function in ``p``."""
    generators = [field.tower.generators[i] for i in used(p)]
    inner = [
        part for g in generators for argument in g.arguments for part in (argument.numerator, argument.denominator)
    ]
    return any(index in used(part) or _occurs_inside(field, index, part) for part in inner)


# Whether a formula of the claim is 0 on its whole domain for some values of the parameters: then no zero is removable.
#
# ``Omega3*g/g`` is Ω3 where g is not 0, and undefined where it is: a divisor that is 0 on a thin set of states and
# parameters may be 0 at all states for some parameters.  Here parameters are fixed, and the state or the time moves.


_ORDERS = 4
"""The number of derivatives of a formula that is not a polynomial."""
_MOST_OPERATIONS = 60
"""The largest number of operations of such a formula."""
_MAY_JUMP = (sympy.Abs, sympy.sign, sympy.DiracDelta, sympy.atan2)


def for_no_parameters(
    e: sympy.Expr,
    assumptions: Assumptions,
    points: Sequence[Mapping[sympy.Symbol, sympy.Expr]],
    sphere: Collection[sympy.Expr] = (),
) -> bool:
    """True only where ``e`` is 0 on its whole domain for no values of the parameters that ``assumptions`` admit.

    points: values of the moving symbols, where ``e`` is analytic, or at an end of such a domain.
    sphere: |γ|² - 1 for a formula of the state.
    """
    parameters = e.free_symbols & assumptions.parameters
    if not parameters:
        return True
    if e.atoms(Defined) or sympy.count_ops(e) > _MOST_OPERATIONS:
        return False
    moving = sorted(e.free_symbols - parameters, key=str)
    if is_small_polynomial(e):
        for zero in sphere:
            e = sympy.rem(e, zero, max(zero.free_symbols, key=str))
        parts = sympy.Poly(e, *moving).coeffs() if moving and e != 0 else [e]
    else:
        parts = list(islice(_taylor(e, moving, points), 2 * _ORDERS))
    # a formula that is 0 everywhere has only zeros among its parts
    squares = [sympy.Add(*(part**2 for part in parts))] if len(parts) > 1 else []
    return any(is_never_zero(part, assumptions) for part in (*parts, *squares))


def _taylor(
    e: sympy.Expr, moving: Sequence[sympy.Symbol], points: Sequence[Mapping[sympy.Symbol, sympy.Expr]]
) -> Iterator[sympy.Expr]:
    """Values and derivatives at the points, where they are finite."""
    for point in points:
        for x in moving:
            derivative = e
            for _ in range(_ORDERS):
                value = derivative.subs(point, simultaneous=True)
                # a finite value of continuous functions at an end is the limit from within
                if value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I) or derivative.has(*_MAY_JUMP):
                    break
                if value != 0:
                    yield value
                derivative = sympy.diff(derivative, x)


@where_provable(False)
def is_never_zero(e: sympy.Expr, assumptions: Assumptions) -> bool:
    """Whether the algebra proves that it is not 0 for any parameters that the assumptions admit."""
    field = Field(assumptions, [e])
    value = field.enter(e)
    return field.tower.sign(value).strict or field.never_zero_on_relations(value.numerator)
