"""Is a formula of the claim 0 all over its domain for some values of the parameters: then no zero of it is removable.

``Omega3*g/g`` is Ω3 where g is not 0, and nothing where it is: that a divisor is 0 on a thin set of all states and
parameters together is not enough.  Parameters are held fixed here, and the state or the time moves.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import islice

import sympy

from heavytop.claims.algebra.conditions import is_small_polynomial
from heavytop.claims.algebra.fields import Assumptions, Field
from heavytop.claims.algebra.signs import Unprovable
from heavytop.claims.algebra.structure import Defined

_ORDERS = 4
"""Derivatives that are looked at where a formula is no polynomial."""
_MOST_OPERATIONS = 60
"""Of a formula that is looked at."""
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


def is_never_zero(e: sympy.Expr, assumptions: Assumptions) -> bool:
    """By the algebra, for all parameters that the assumptions admit."""
    try:
        field = Field(assumptions, [e])
        value = field.enter(e)
    except Unprovable:
        return False
    return field.tower.sign(value).strict or (
        bool(assumptions.relations) and field.never_zero_on_relations(value.numerator)
    )
