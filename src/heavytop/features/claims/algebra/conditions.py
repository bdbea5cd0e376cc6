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
from heavytop.features.claims.algebra.ring import Unprovable, used, where_provable
from heavytop.features.claims.algebra.signs import Sign
from heavytop.features.claims.algebra.structure import Defined, at_values, rationals, sign_of

_LONGEST = 120
_BITS = 512


class ConditionKind(Enum):
    """The kind of a condition on an expression; the value is how it is written."""

    NONZERO = "{} ≠ 0"
    POSITIVE = "{} > 0"
    NONNEGATIVE = "{} ≥ 0"

    def is_met_by(self, sign: Sign) -> bool:
        """Whether an expression of that sign meets it."""
        if self is ConditionKind.NONZERO:
            return sign.strict
        return sign.value > 0 and (sign.strict or self is ConditionKind.NONNEGATIVE)


def written(text: str) -> str:
    """A formula as files have it: a power is ``^``, and SymPy's Abs(x) is sqrt(x^2)."""
    while "Abs(" in text:
        before, _, rest = text.partition("Abs(")
        depth, length = 1, 0
        while depth and length < len(rest):
            depth += (rest[length] == "(") - (rest[length] == ")")
            length += 1
        inside = rest[: length - 1]
        text = f"{before}sqrt({inside if inside.isalnum() else f'({inside})'}^2){rest[length:]}"
    return text.replace("**", "^")


@dataclass(frozen=True, slots=True)
class Need:
    """One condition on one expression.

    shown: how it is written where that is not the expression itself, such as |u| ≤ 1 for 1 − u² ≥ 0.
    """

    kind: ConditionKind
    expression: sympy.Expr
    shown: str = ""

    @property
    def text(self) -> str:
        """The condition as people read it."""
        text = self.shown or self.kind.value.format(as_text(self.expression))
        return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"

    @where_provable(None)
    def is_met(self, values: Mapping[sympy.Symbol, Fraction]) -> bool | None:
        """True or False where that is certain at exact values of the symbols; None where a ball cannot tell."""
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
    """As SymPy writes it, which takes it a millisecond."""
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
"""Sign conditions on the last argument, a parameter m or a nome q, compared with 0, and 1 with it."""


def condition(function: str, arguments: tuple[sympy.Expr, ...]) -> frozenset[Need]:
    """Conditions for ``function`` to be defined and real: ``/`` on a divisor, ``sqrt``, ``log``, ..."""
    needs, m = set(), arguments[-1]
    # a nome has an m of its own, between 0 and 1
    if function in _OF_PARAMETER and not (isinstance(m, sympy.exp) and not isinstance(modulus(m), modulus)):
        below, above = _OF_PARAMETER[function]
        needs = {Need(below, m)} if below else set()
        needs.add(Need(above, 1 - m, f"{m} {'<' if above is _P else '≤'} 1"))
    if function in _NEEDS:
        needs.add(_NEEDS[function](*arguments))
    return frozenset(need for need in needs if not _is_plain(need))


def _is_plain(need: Need) -> bool:
    """Numbers that meet it, as anyone can see."""
    e = need.expression
    return bool(e.is_Rational and (e > 0 or (e < 0 and need.kind is ConditionKind.NONZERO)))


def parts_of(expressions: Iterable[sympy.Expr]) -> set[sympy.Expr]:
    """Every subexpression once, of a residual too, which as a tree is a hundred times as large."""
    parts: set[sympy.Expr] = set()
    waiting = [*expressions]
    while waiting:
        if (part := waiting.pop()) not in parts:
            parts.add(part)
            waiting.extend(part.args)
    return parts


def conditions_of(expressions: Iterable[sympy.Expr]) -> frozenset[Need]:
    """The conditions of sympy expressions, as they stand: what has been simplified away is not seen."""
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
    """Whether it is 0 at exact values: True and False are proofs, None is not decided.

    Polynomials are computed in fractions: what is off by 1e-200 is off.
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


# Conditions that are 0, over the real numbers: simpler conditions that hold together at exactly the same points.
#
# exp(L) − 1, atan(L), |L| and L³ are 0 only where L is; a sum of squares only where each of them is.  A function with
# further zeros, such as sin(L), is left as it is.


_ONLY_ZERO = {
    # f(u) = value at one real u alone
    **dict.fromkeys(("exp", "cosh", "sech"), (1, 0)),
    **dict.fromkeys(("sinh", "tanh", "atan", "asin", "Abs"), (0, 0)),
    **dict.fromkeys(("acos", "log"), (0, 1)),
}
_ANALYTIC = (sympy.sin, sympy.cos, sympy.exp, sympy.sinh, sympy.cosh, sympy.tanh, sympy.sech, sympy.atan, sympy.log)
# a polynomial of more terms is left as it is
_MOST_TERMS = 1_000
_MOST_PRODUCTS = 16


def conditions_for_zero(e: sympy.Expr) -> tuple[sympy.Expr, ...]:
    """Expressions that are all 0 exactly where ``e`` is, as far as ``e`` is defined and real."""
    if e.is_Mul:
        return _of_product(e.args)
    if e.is_Pow and e.args[1].is_Rational and e.args[1] > 0:
        base, exponent = e.args
        if exponent.is_Integer or (exponent.q == 2 and sign_of(base).value > 0):
            return conditions_for_zero(base)
    inside = _inside(e)
    if inside is not None:
        return conditions_for_zero(inside)
    return _of_sum(e) if e.is_Add else (e,)


def _of_product(factors: Sequence[sympy.Expr]) -> tuple[sympy.Expr, ...]:
    """Without the factors that are 0 nowhere; what they need to be defined is asked elsewhere."""
    left = [conditions_for_zero(factor) for factor in factors if not sign_of(factor).strict]
    if len(left) == 1:
        return left[0]
    # (u = v = 0) or (w = x = 0) is u w = u x = v w = v x = 0
    if prod(map(len, left)) > _MOST_PRODUCTS:
        return (sympy.Mul(*factors),)
    return tuple(sympy.Mul(*parts) for parts in product(*left))


def _inside(e: sympy.Expr) -> sympy.Expr | None:
    """u − u0 where ``e`` is c + k f(u), with numbers c and k, and 0 at u = u0 alone: √u = 2 where u = 4."""
    constant, rest = e.as_coeff_Add()
    factor, function = rest.as_coeff_Mul()
    root = function.is_Pow and function.args[1] == sympy.Rational(1, 2)
    if root and constant.is_Rational and factor.is_Rational and -constant / factor > 0:
        return function.args[0] - (constant / factor) ** 2
    name = "exp" if isinstance(function, sympy.exp) else type(function).__name__
    if name not in _ONLY_ZERO or not constant.is_Rational or not factor.is_Rational:
        return None
    value, where = _ONLY_ZERO[name]
    return function.args[0] - where if -constant == factor * value else None


def _of_sum(e: sympy.Expr) -> tuple[sympy.Expr, ...]:
    signs = [sign_of(part) for part in e.args]
    if abs(sum(sign.value for sign in signs)) == len(signs):
        return (e,) if any(sign.strict for sign in signs) else _of_all(e.args)
    if not is_small_polynomial(e):
        return (e,)
    factors = sympy.factor_list(e)[1]
    if len(factors) > 1 or factors[0][1] > 1:
        return _of_product([factor for factor, _ in factors])
    squares = _as_squares(e)
    return _of_all(squares) if squares else (e,)


def _of_all(parts: Iterable[sympy.Expr]) -> tuple[sympy.Expr, ...]:
    return tuple(dict.fromkeys(condition for part in parts for condition in conditions_for_zero(part)))


def _as_squares(e: sympy.Expr) -> list[sympy.Expr]:
    """The u of a polynomial that is ± a sum of c u² with c > 0, by completing squares; [] where that fails."""
    squares, sign, rest = [], 0, sympy.expand(e)
    while rest != 0:
        for x in sorted((symbol for symbol in rest.free_symbols if not symbol.is_positive), key=str):
            p = sympy.Poly(rest, x)
            leading = sign_of(p.nth(2))
            known = all(symbol.is_positive for symbol in p.nth(2).free_symbols)
            if p.degree() == 2 and known and leading.strict and leading.value in ({sign} if sign else {1, -1}):
                break
        else:
            return []
        sign, linear = leading.value, p.nth(1)
        squares.append(2 * p.nth(2) * x + linear)
        rest = sympy.expand(sympy.cancel(p.nth(0) - linear**2 / (4 * p.nth(2))))
    return squares if len(squares) > 1 else []


def on_conditions(e: sympy.Expr, conditions: Sequence[sympy.Expr]) -> sympy.Expr:
    """``e`` where the conditions are 0: a polynomial, or the arguments of analytic functions, reduced by them."""
    divisors = [condition for condition in conditions if condition.free_symbols and is_small_polynomial(condition)]
    if not divisors:
        return e
    shorter: dict[sympy.Expr, sympy.Expr] = {}
    for node in e.atoms(*_ANALYTIC):
        value = node.func(_rest(node.args[0], divisors))
        if not value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I):
            shorter[node] = value
    return _rest(e.xreplace(shorter), divisors)


def all_over(e: sympy.Expr, zeros: Sequence[sympy.Expr]) -> sympy.Expr:
    """``e`` as it is where the polynomials ``zeros`` are 0: every polynomial in it is reduced by them."""
    if not e.args or is_small_polynomial(e):
        return _rest(e, zeros)
    value = e.func(*(all_over(part, zeros) for part in e.args))
    return e if value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I) else value


def _rest(e: sympy.Expr, divisors: Sequence[sympy.Expr]) -> sympy.Expr:
    """The remainder of the division, if that is shorter."""
    if not e.free_symbols or not is_small_polynomial(e):
        return e
    rest = sympy.reduced(e, divisors)[1]
    return rest if rest.is_number or sympy.count_ops(rest) < sympy.count_ops(e) else e


def is_small_polynomial(e: sympy.Expr) -> bool:
    """Whether it is a polynomial that can be expanded in no time."""
    return bool(e.is_polynomial(*e.free_symbols)) and _terms(e) <= _MOST_TERMS


def _terms(e: sympy.Expr) -> int:
    """A bound on the terms of its expansion."""
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
# from 0 are left out, what is linear in a parameter is divided by a coefficient that is never 0, and a root takes the
# sign that the parameter is known to have.


_MAX_DEGREE = 12


def solve_relations(
    relations: Collection[sympy.Expr], known: Assumptions, parameters: Collection[sympy.Symbol]
) -> tuple[SolvedRelation, ...]:
    """Solutions of those relations that can be solved for one of the ``parameters``, each using those before it."""
    solutions: list[SolvedRelation] = []
    for relation in relations:
        if relation.free_symbols <= set(parameters):
            try:
                solution = _solve(relation, replace(known, solved=tuple(solutions)), parameters)
            except Unprovable:
                continue
            if solution is not None:
                solutions.append(solution)
    return tuple(solutions)


def _solve(relation: sympy.Expr, known: Assumptions, parameters: Collection[sympy.Symbol]) -> SolvedRelation | None:
    field = Field(known, [relation])
    factors = _factors_with_zeros(field, field.enter(relation).numerator)
    if len(factors) != 1:
        return None
    solutions = list(_solutions(field, factors[0], relation, parameters))
    # what needs no root first, and of these the shortest
    return min(solutions, key=lambda s: (s.radicand is not None, sympy.count_ops(s.value)), default=None)


def _factors_with_zeros(field: Field, p: fmpq_mpoly) -> list[fmpq_mpoly]:
    """The factors of ``p`` that may be 0, but for those that are 0 at points where another is."""
    signs = field.tower.signs
    factors = [factor for factor, _ in signs.factors(p)[1] if not signs.of(factor).strict]
    isolated = [factor for factor in factors if _is_zero_at_origin_alone(factor)]
    others = [factor for factor in factors if factor not in isolated]

    def adds_something(form: fmpq_mpoly) -> bool:
        """A factor that is 0 at the origin alone adds nothing to one that is 0 there."""
        terms = [other.to_dict() for other in others]
        return not any(all(any(monomial[index] for index in used(form)) for monomial in term) for term in terms)

    return [*others, *filter(adds_something, isolated)]


def _is_zero_at_origin_alone(p: fmpq_mpoly) -> bool:
    """A form in two generators that is irreducible and has no real direction in which it is 0."""
    indices = sorted(used(p))
    terms = p.to_dict()
    degrees = {sum(map(int, monomial)) for monomial in terms}
    if len(indices) != 2 or len(degrees) != 1 or max(degrees) > _MAX_DEGREE:
        return False
    z = sympy.Symbol("z")
    line = sympy.Poly(sum(sympy.Rational(int(c.p), int(c.q)) * z ** int(m[indices[0]]) for m, c in terms.items()), z)
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
    """Whether a root or a function in ``p`` holds the generator."""
    generators = [field.tower.generators[i] for i in used(p)]
    inner = [
        part for g in generators for argument in g.arguments for part in (argument.numerator, argument.denominator)
    ]
    return any(index in used(part) or _occurs_inside(field, index, part) for part in inner)


# Is a formula of the claim 0 all over its domain for some values of the parameters: then no zero of it is removable.
#
# ``Omega3*g/g`` is Ω3 where g is not 0, and nothing where it is: that a divisor is 0 on a thin set of all states and
# parameters together is not enough.  Parameters are held fixed here, and the state or the time moves.


_ORDERS = 4
"""Derivatives that are looked at where a formula is not a polynomial."""
_MOST_OPERATIONS = 60
"""Operations of a formula that is looked at."""
_MAY_JUMP = (sympy.Abs, sympy.sign, sympy.DiracDelta, sympy.atan2)


def for_no_parameters(
    e: sympy.Expr,
    assumptions: Assumptions,
    points: Sequence[Mapping[sympy.Symbol, sympy.Expr]],
    sphere: Collection[sympy.Expr] = (),
) -> bool:
    """True only where ``e`` is 0 all over its domain for no values of the parameters that ``assumptions`` admit.

    points: values of all that moves, where ``e`` is analytic, or at an end of such a domain.
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
    # all of them are 0 together, or the formula is not 0 all over
    together = sympy.Add(*(part**2 for part in parts))
    return any(is_never_zero(part, assumptions) for part in (*parts, *([together] if len(parts) > 1 else [])))


def _taylor(
    e: sympy.Expr, moving: Sequence[sympy.Symbol], points: Sequence[Mapping[sympy.Symbol, sympy.Expr]]
) -> Iterator[sympy.Expr]:
    """Values and derivatives at the points, where they are finite."""
    for point in points:
        for x in moving:
            derivative = e
            for _ in range(_ORDERS):
                value = derivative.subs(point, simultaneous=True)
                # what is finite and made of continuous functions is the limit from within, at an end too
                if value.has(sympy.zoo, sympy.oo, sympy.nan, sympy.I) or derivative.has(*_MAY_JUMP):
                    break
                if value != 0:
                    yield value
                derivative = sympy.diff(derivative, x)


@where_provable(False)
def is_never_zero(e: sympy.Expr, assumptions: Assumptions) -> bool:
    """By the algebra, for all parameters that the assumptions admit."""
    field = Field(assumptions, [e])
    value = field.enter(e)
    return field.tower.sign(value).strict or field.never_zero_on_relations(value.numerator)
