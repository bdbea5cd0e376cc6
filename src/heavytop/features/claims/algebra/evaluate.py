"""An expression at exact parameters and an exact time, as a ball."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import sympy
from flint import acb, arb

from heavytop.errors import OutOfReach
from heavytop.exact.flint.balls import ball, whole_evaluation, working_precision
from heavytop.features.claims.algebra.ring import Unprovable
from heavytop.features.claims.algebra.structure import Defined

# Weierstrass' ℘ of (u, g2, g3) as formulas of a claim, and their values as balls.
#
# wp is ℘(u), with poles at the real periods; wp3 is ℘(u + ω3) with the imaginary half-period ω3: it runs between the
# two lower roots, real and without poles for real u where Δ = g2³ − 27 g3² > 0.
#
#     ℘'' = 6℘² − g2/2,   ℘'² = 4℘³ − g2 ℘ − g3      (DLMF 23.3.10, 23.3.12, 23.6)


_NAN = arb("nan")


class _Elliptic(sympy.Function):  # type: ignore[misc]
    """A function of u whose invariants have no rate here: they do not move in any claim that is proven."""

    nargs = 3
    is_real = True

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """The derivative in u."""
        if argindex != 1:
            return sympy.Function(f"rate_of_{self.func.__name__}_by_g{argindex}", real=True)(*self.args)
        return self.rate()

    def rate(self) -> sympy.Expr:
        """The derivative in u."""
        raise NotImplementedError


class wp(_Elliptic):  # noqa: N801
    """℘(u; g2, g3)."""

    def rate(self) -> sympy.Expr:
        """℘'."""
        return wpprime(*self.args)


class wpprime(_Elliptic):  # noqa: N801
    """℘'(u; g2, g3)."""

    def rate(self) -> sympy.Expr:
        """6℘² − g2/2."""
        return 6 * wp(*self.args) ** 2 - self.args[1] / 2


class wp3(_Elliptic):  # noqa: N801
    """℘(u + ω3; g2, g3)."""

    def rate(self) -> sympy.Expr:
        """℘'(u + ω3)."""
        return wp3prime(*self.args)


class wp3prime(_Elliptic):  # noqa: N801
    """℘'(u + ω3; g2, g3)."""

    def rate(self) -> sympy.Expr:
        """6℘² − g2/2 at u + ω3."""
        return 6 * wp3(*self.args) ** 2 - self.args[1] / 2


class wpinverse(_Elliptic):  # noqa: N801
    """1/℘(u; g2, g3), which is 0 at the poles of ℘: it stands in conditions alone."""

    def rate(self) -> sympy.Expr:
        """−℘'/℘²."""
        return -wpprime(*self.args) / wp(*self.args) ** 2


WEIERSTRASS = {"wp": wp, "wpprime": wpprime, "wp3": wp3, "wp3prime": wp3prime}
"""Each function as a formula calls it."""


# --- at numbers ----------------------------------------------------------------------------------------------------


def _weierstrass(u: arb, g2: arb, g3: arb, third: bool = False) -> tuple[arb, arb]:
    """(℘, ℘') at u, or at u + ω3, as balls; not finite at poles, where Δ = 0 may be, and at u + ω3 unless Δ > 0.

    By theta quotients, as in :mod:`heavytop.exact.elliptic.weierstrass`.
    """
    from heavytop.exact.elliptic.weierstrass import Lattice, from_invariants, thetas

    try:
        lattice = from_invariants(g2, g3)
    except OutOfReach:
        return _NAN, _NAN
    if not isinstance(lattice, Lattice) or not u.is_finite() or (third and not g2**3 > 27 * g3**2):
        return _NAN, _NAN
    z, _ = lattice.reduced(acb(u))
    first, *others = thetas(z + lattice.ratio / 2 if third else z, lattice.ratio)
    scale = 2 * lattice.half_period * first / lattice.zero[0]
    two, three, four = (value / at_zero for value, at_zero in zip(others, lattice.zero[1:], strict=True))
    return (lattice.roots[0] + (two / scale) ** 2).real, (-2 * two * three * four / scale**3).real


_VALUES: dict[str, Callable[..., arb]] = {
    "wp": lambda u, g2, g3: _weierstrass(u, g2, g3)[0],
    "wpprime": lambda u, g2, g3: _weierstrass(u, g2, g3)[1],
    "wp3": lambda u, g2, g3: _weierstrass(u, g2, g3, True)[0],
    "wp3prime": lambda u, g2, g3: _weierstrass(u, g2, g3, True)[1],
    "wpinverse": lambda u, g2, g3: 1 / _weierstrass(u, g2, g3)[0],
}
"""Each function of balls, as a ball that is proven to hold it, at the working precision."""


_FUNCTIONS: dict[str, Callable[..., arb]] = {
    "exp": arb.exp,
    "log": arb.log,
    "sin": arb.sin,
    "cos": arb.cos,
    "tan": arb.tan,
    "sinh": arb.sinh,
    "cosh": arb.cosh,
    "tanh": arb.tanh,
    "sech": arb.sech,
    "csch": arb.csch,
    "coth": arb.coth,
    "asin": arb.asin,
    "acos": arb.acos,
    "atan": arb.atan,
    "asinh": arb.asinh,
    "acosh": arb.acosh,
    "atanh": arb.atanh,
    "atan2": lambda y, x: arb.atan2(y, x),
    "Abs": abs,
    "sign": arb.sgn,
    "sn": lambda u, m: _jacobi(u, m)[0],
    "cn": lambda u, m: _jacobi(u, m)[1],
    "dn": lambda u, m: _jacobi(u, m)[2],
    **_VALUES,
}


def _jacobi(u: arb, m: arb) -> tuple[arb, arb, arb]:
    """sn, cn, dn; not finite unless 0 ≤ m ≤ 1 is certain."""
    from heavytop.exact.elliptic.jacobi import jacobi

    if not (m >= 0 and m <= 1):
        return _NAN, _NAN, _NAN
    sine, cosine, delta = jacobi(m, 1 - m).functions(u)
    return sine, cosine, delta


@whole_evaluation
def evaluate(expression: sympy.Expr, values: Mapping[sympy.Symbol, Fraction], bits: int) -> arb:
    """The ball of ``expression`` where each symbol has its exact value; not finite where it is undefined there."""
    known: dict[sympy.Expr, arb] = {}

    def visit(e: sympy.Expr) -> arb:
        if e not in known:
            known[e] = compute(e)
        return known[e]

    def compute(e: sympy.Expr) -> Any:
        if e.is_Rational:
            return ball(Fraction(int(e.p), int(e.q)))
        if isinstance(e, Defined):
            return visit(e.meaning)
        if e.is_Symbol:
            return ball(values[e])
        if e is sympy.pi:
            return arb.pi()
        if e is sympy.E:
            return arb(1).exp()
        if e.is_Add:
            return sum((visit(part) for part in e.args), arb(0))
        if e.is_Mul:
            product = arb(1)
            for part in e.args:
                product *= visit(part)
            return product
        if e.is_Pow and not isinstance(e, sympy.exp):
            return _power(visit(e.args[0]), e.args[1])
        name = type(e).__name__
        if name not in _FUNCTIONS:
            raise Unprovable(f"{name} cannot be evaluated.")
        return _FUNCTIONS[name](*(visit(part) for part in e.args))

    with working_precision(bits):
        return visit(expression)


def _power(base: arb, exponent: sympy.Expr) -> arb:
    if exponent.is_Rational and exponent.q in (1, 2):
        root = base if exponent.q == 1 else base.sqrt()
        power = _whole_power(root, abs(int(exponent.p)))
        return power if exponent.p > 0 else 1 / power
    raise Unprovable(f"The power {exponent} is no multiple of 1/2.")


def _whole_power(base: arb, exponent: int) -> arb:
    """By squaring: python-flint's power of a ball with midpoint 0 is nan."""
    result, square = arb(1), base
    while exponent:
        if exponent & 1:
            result *= square
        exponent >>= 1
        if exponent:
            square *= square
    return result
