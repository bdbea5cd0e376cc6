"""The clock of a claimed motion: the time itself, or a quadrature t = F(u) + constant that is not inverted.

Formulas in u are a motion where u is between bounds and F' is finite and never 0 there: u(t) is the inverse of F, with
u' = 1/F'(u), and rates are taken through it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import sympy

from heavytop.claims.assume import comparisons
from heavytop.claims.claim_file import ClaimFile, QuadratureTable
from heavytop.claims.conditions import Need, condition
from heavytop.claims.context import RESERVED, TIME, Context, needs_of, sample_number
from heavytop.claims.defined import rate_along
from heavytop.claims.expression import parse
from heavytop.claims.statement import AFTER, ALL, BEFORE, Domain
from heavytop.errors import InputError

_DOMAINS = {"all": ALL, "t<=0": BEFORE, "t>0": AFTER}
_POINTS = tuple(Fraction(*pair) for pair in ((1, 3), (-1, 2), (7, 5), (-9, 4)))
_BETWEEN = (Fraction(1, 2), Fraction(1, 3), Fraction(4, 5))
_BEYOND = (Fraction(1, 7), Fraction(3, 2))


@dataclass(frozen=True, slots=True)
class Clock:
    """What the formulas of a motion hold, and its rate.

    variable: t or u.  rate: the derivative in time.  values: F' and 1/F', both of which have to be continuous; none
    where t itself is the variable.  needs: for these, and for the bounds of u, to be defined.
    """

    variable: sympy.Symbol
    rate: Callable[[sympy.Expr], sympy.Expr]
    domain: Domain
    values: tuple[sympy.Expr, ...] = ()
    needs: frozenset[Need] = frozenset()


def variable_of(content: ClaimFile) -> sympy.Symbol:
    """The symbol that the formulas of a motion hold: t, or the variable of its quadrature.

    Raises InputError where that name is taken.
    """
    if content.quadrature is None:
        return TIME
    name = content.quadrature.variable
    if name in RESERVED:
        taken = f"Taken are {', '.join(sorted(RESERVED))}."
        raise InputError(f"The name {name!r} of the variable of [quadrature] is taken.", taken)
    return sympy.Symbol(name, real=True)


def read_clock(content: ClaimFile, context: Context) -> Clock:
    """The clock of a motion claimed in a file; raises InputError for a quadrature that cannot be understood."""
    table, u = content.quadrature, variable_of(content)
    if table is None:
        return Clock(TIME, rate_along({TIME: sympy.Integer(1)}), _DOMAINS[content.domain])
    if content.domain != "all" or content.times is not None:
        cause = f"domain and times are about t, and the formulas of this claim hold {u}."
        raise InputError(cause, "Bound it by where, and give points, in [quadrature].")
    text = table.time or table.integrand
    if text is None or (table.time is not None and table.integrand is not None):
        raise InputError("[quadrature] needs either time or integrand.", "Give F(u) as time, or F'(u) as integrand.")
    given = parse(text, context.names, "quadrature")
    integrand = given.expression if table.time is None else rate_along({u: sympy.Integer(1)})(given.expression)
    if integrand == 0:
        raise InputError(f"[quadrature]: t = {text[:60]} does not move with {u}.", "Give t as a function of it.")
    links = [link for text in table.where for link in comparisons(text, "where of [quadrature]")]
    sides = [[parse(side, context.names, "where of [quadrature]") for side in link] for link in links]
    facts = tuple(above.expression - below.expression for above, below in sides)
    label = ", ".join(table.where) or f"all {u}"
    domain = Domain(label, 0, _points(table, u, facts, context.samples), f"{u} is the variable of [quadrature]", facts)
    needs = needs_of([given, *(side for pair in sides for side in pair)]) | condition("/", (integrand,))
    return Clock(u, rate_along({u: 1 / integrand}), domain, (integrand, 1 / integrand), needs)


def _points(
    table: QuadratureTable,
    u: sympy.Symbol,
    facts: Sequence[sympy.Expr],
    samples: Sequence[Mapping[sympy.Symbol, Fraction]],
) -> tuple[Fraction, ...]:
    """Those of the file, else some between and beyond the bounds at the samples, on the domain or not."""
    if table.points is not None:
        return tuple(sample_number(point, "quadrature.points") for point in table.points)
    found = list(_POINTS)
    for sample in samples:
        ends = sorted(end for fact in facts if (end := _end(fact, u, sample)) is not None)
        found += [low + (high - low) * part for low, high in pairwise(ends) for part in _BETWEEN]
        found += [end + sign * step for end in ends for step in _BEYOND for sign in (1, -1)]
    return tuple(dict.fromkeys(found))


def _end(fact: sympy.Expr, u: sympy.Symbol, sample: Mapping[sympy.Symbol, Fraction]) -> Fraction | None:
    """The rational zero of a bound that is linear in u, at a sample."""
    slope = sympy.diff(fact, u)
    if u in slope.free_symbols or slope == 0:
        return None
    value = (u - fact / slope).subs({s: sympy.Rational(n.numerator, n.denominator) for s, n in sample.items()})
    value = sympy.expand(value)
    return Fraction(int(value.p), int(value.q)) if value.is_Rational else None
