"""An expression at exact parameters and an exact time, as a ball."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import sympy
from flint import acb_poly, arb

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
_NEWTON = 12


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


def _elliptic_jacobi(u: arb, m: arb) -> tuple[arb, arb, arb]:
    """(sn, cn, dn) as balls; not finite unless 0 ≤ m ≤ 1 is certain."""
    from heavytop.exact.elliptic.jacobi import jacobi

    complement = 1 - m
    if not (u.is_finite() and m >= 0 and complement >= 0):
        return _NAN, _NAN, _NAN
    found: tuple[arb, arb, arb] = jacobi(m, complement).functions(u)
    return found


def _roots(g2: arb, g3: arb) -> tuple[arb, arb, arb] | None:
    """e1 > e2 > e3; None unless Δ > 0 is certain."""
    if not g2**3 - 27 * g3**2 > 0:
        return None
    # 4x³ − g2 x = g3 with x = 2√(g2/12) cos θ is cos 3θ = g3/(8 (g2/12)^(3/2))
    size = (g2 / 12).sqrt()
    theta = (g3 / (8 * size**3)).acos() / 3
    third = 2 * arb.pi() / 3
    return 2 * size * theta.cos(), 2 * size * (theta - third).cos(), 2 * size * (theta + third).cos()


def _complex_roots(g2: arb, g3: arb) -> tuple[arb, arb] | None:
    """(e, H) with the real root e and H² = 3e² − g2/4 > 0; None unless Δ < 0 is certain."""
    if not g2**3 - 27 * g3**2 < 0:
        return None
    try:
        found = acb_poly([-g3, -g2, 0, 4]).roots()
    except ValueError:
        return None
    real = [root.real for root in found if root.imag.contains(0)]
    if len(real) != 1:
        return None
    e = real[0]
    for _ in range(_NEWTON):  # the root lies in each of these balls
        middle = e.mid()
        closer = middle - (4 * middle**3 - g2 * middle - g3) / (12 * e**2 - g2)
        if not (closer.is_finite() and closer.rad() < e.rad()):
            break
        e = closer
    return e, (3 * e**2 - g2 / 4).sqrt()


def _weierstrass(u: arb, g2: arb, g3: arb) -> tuple[arb, arb]:
    """(℘, ℘'), DLMF 23.6.16, 23.6.21 and Abramowitz and Stegun 18.9.11; not finite at poles, and where Δ = 0 may be."""
    if (roots := _roots(g2, g3)) is not None:
        e1, e2, e3 = roots
        scale = (e1 - e3).sqrt()
        s, c, d = _elliptic_jacobi(scale * u, (e2 - e3) / (e1 - e3))
        return e3 + (e1 - e3) / s**2, -2 * scale**3 * c * d / s**3
    if (pair := _complex_roots(g2, g3)) is not None:
        e, h = pair
        scale = 2 * h.sqrt()
        s, c, d = _elliptic_jacobi(scale * u, arb("0.5") - 3 * e / (4 * h))
        # ((1 + c)/(1 − c))' = 2c'/(1 − c)² = −2 s d/(1 − c)²
        return e + h * (1 + c) / (1 - c), -2 * h * scale * s * d / (1 - c) ** 2
    return _NAN, _NAN


def _bounded(u: arb, g2: arb, g3: arb) -> tuple[arb, arb]:
    """(℘, ℘') at u + ω3: e3 + (e2 − e3) sn²; not finite unless Δ > 0 is certain."""
    roots = _roots(g2, g3)
    if roots is None:
        return _NAN, _NAN
    e1, e2, e3 = roots
    scale = (e1 - e3).sqrt()
    s, c, d = _elliptic_jacobi(scale * u, (e2 - e3) / (e1 - e3))
    return e3 + (e2 - e3) * s**2, 2 * (e2 - e3) * scale * s * c * d


VALUES: dict[str, Callable[..., arb]] = {
    "wp": lambda u, g2, g3: _weierstrass(u, g2, g3)[0],
    "wpprime": lambda u, g2, g3: _weierstrass(u, g2, g3)[1],
    "wp3": lambda u, g2, g3: _bounded(u, g2, g3)[0],
    "wp3prime": lambda u, g2, g3: _bounded(u, g2, g3)[1],
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
    **VALUES,
}


def _jacobi(u: arb, m: arb) -> tuple[arb, arb, arb]:
    """sn, cn, dn; not finite unless 0 ≤ m ≤ 1 is certain."""
    from heavytop.exact.elliptic.jacobi import jacobi

    if not (m >= 0 and m <= 1):
        return arb("nan"), arb("nan"), arb("nan")
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
