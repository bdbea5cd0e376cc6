"""Statements of claims in symbols, and what the algebra says of an expression: t, real a to e, positive p and q."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import sympy

from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.prover import Region
from heavytop.features.claims.algebra.signs import Sign
from heavytop.features.claims.algebra.statement import ALL, Domain, Flow, Formulas, Setting, Statement

T = sympy.Symbol("t", real=True)
A, B, C, D, E = SYMBOLS = sympy.symbols("a b c d e", real=True)
P, Q = sympy.symbols("p q", positive=True)


def sign_of(e: sympy.Expr, inside: Sequence[sympy.Expr] = (), **known: Any) -> Sign:
    """The sign of an expression where p and q are positive and more is known, beside others that are there."""
    field = Field(Assumptions(T, **({"positive": (P, Q)} | known)), [*inside, e])
    return field.tower.sign(field.enter(e))


def vanishes(e: sympy.Expr, **known: Any) -> bool:
    return Field(Assumptions(T, (P, Q), **known), [e]).vanishes(e)


def statement(
    residual: sympy.Expr, flow: Flow | None = None, domain: Domain = ALL, formulas: Formulas | None = None
) -> Statement:
    """The statement that the residual is 0, resting on its own formula, or on others."""
    return Statement("1", 1, "smooth", domain, residual, "", formulas or Formulas((residual,)), flow)


def setting(a: Fraction | int = Fraction(1, 3), **known: Any) -> Setting:
    """A claim in t and p whose one sample has p = 2 and this a."""
    return Setting(T, (P,), **({"samples": ({P: Fraction(2), A: Fraction(a)},)} | known))


def region_of(e: sympy.Expr, of: Setting, flow: Flow | None = None, stated: sympy.Expr = T) -> Region:
    """The region of a claim, whose formulas hold the expression, with the samples of its setting."""
    said = statement(stated, flow)
    return Region(Field(of.assumptions(0), [e]), of, said, list(of.sample_points(said)))
