"""Elliptic functions and integrals in formulas of claims: their derivatives, which are their algebra, and values.

Jacobi's functions of a real argument u and a parameter m = k², 0 ≤ m ≤ 1 (DLMF 22.6.1, 22.13.1):

    sn² + cn² = 1,   dn² + m sn² = 1,   dn > 0,   sn' = cn dn,   cn' = −sn dn,   dn' = −m sn cn

Every other function is a free generator over those in its derivative, with constant parameters:

    am' = dn,   ellipticF' = 1/Δ,   ellipticE' = Δ,   ellipticPi' = 1/((1 − n sin²φ) Δ),   Δ = √(1 − m sin²φ)
    thetan' = thetan Z,   Z(u) = E(am u) − u E/K          (Neville's θn = Θ(u)/Θ(0); DLMF 20.1, 22.16.32)
    ℘'' = 6℘² − g2/2,   ℘'² = 4℘³ − g2 ℘ − g3,   ζ' = −℘,   σ' = σ ζ                  (DLMF 23.2.8, 23.3.10, 23.3.12)

Jacobi's Θ, H and the four theta functions are θn and sn, cn, dn times constants (DLMF 22.2).  A function with a 3 at
its end is that of u + ω3, with the imaginary half-period ω3, real and without poles for real u where
Δ = g2³ − 27 g3² > 0: ℘, ℘', ζ(u + ω3) − η3, and σ(u + ω3) e^(−η3 u)/σ(ω3).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import sympy
from flint import acb, arb

from heavytop.errors import OutOfReach
from heavytop.exact.elliptic.jacobi import jacobi
from heavytop.exact.elliptic.weierstrass import DegenerateLattice, from_invariants, thetas
from heavytop.exact.flint.balls import nearest_integer


class Analytic(sympy.Function):  # type: ignore[misc]
    """A real function with one moving argument; its other arguments have no rate, and are constant in proven claims.

    moving: the number of that argument.  parity: 1 or −1 where it is even or odd in it, else 0.
    """

    is_real = True
    moving, parity = 1, 0

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """The derivative by the moving argument."""
        name = type(self).__name__
        if argindex != self.moving:
            return sympy.Function(f"rate_of_{name}_by_{argindex}", real=True)(*self.args)
        return _RATES[name](*self.args)

    @classmethod
    def eval(cls, *arguments: sympy.Expr) -> sympy.Expr | None:
        """Simpler values: at u = 0, −u and u + 2nK, at m = 0 and 1, and of an inverse function."""
        last = cls.moving - 1
        u, m = arguments[last], arguments[-1]
        if cls.parity and u.could_extract_minus_sign():
            return cls.parity * cls(*arguments[:last], -u, *arguments[last + 1 :])
        if cls.parity and u == 0 and not cls.__name__.startswith("wp"):
            return sympy.Integer(cls.parity > 0)
        inverse = _INVERSE.get(cls.__name__)
        if inverse == type(u).__name__ and u.args[1] == m:
            return u.args[0]
        if cls.__name__ in _BY_2K and u.has(first) and (n := u.coeff(quarter(m)) / 2).is_Integer and n != 0:
            factor, turn = _BY_2K[cls.__name__]
            return factor**n * cls(u - 2 * n * quarter(m), m) + n * turn
        if cls is third and arguments[0] == 0:
            return first(u, m)
        simpler = _DEGENERATE[cls.__name__].get(m) if cls.__name__ in _DEGENERATE else None
        return None if simpler is None else simpler(u)


def _made(name: str, nargs: int, parity: int = 0, moving: int = 1) -> Any:
    return type(name, (Analytic,), {"nargs": nargs, "parity": parity, "moving": moving, "__module__": __name__})


JACOBI = ("sn", "cn", "dn")
sn, cn, dn = (_made(name, 2, parity) for name, parity in zip(JACOBI, (-1, 1, 1), strict=True))
_OF_ANGLE = am, first, second = tuple(_made(name, 2, -1) for name in ("am", "ellipticF", "ellipticE"))
third, thetan = _made("ellipticPi", 3, -1, 2), _made("thetan", 2, 1)
wp, wp3, wpinverse, wsigma3 = (_made(name, 3, 1) for name in ("wp", "wp3", "wpinverse", "wsigma3"))
wpprime, wp3prime = (_made(name, 3, -1) for name in ("wpprime", "wp3prime"))
wzeta, wsigma, wzeta3 = (_made(name, 3, -1) for name in ("wzeta", "wsigma", "wzeta3"))
_BY_2K = {"sn": (-1, 0), "cn": (-1, 0), "dn": (1, 0), "am": (1, sympy.pi)}
"""f(u + 2K) = factor f(u) + summand."""
_INVERSE = {"am": "ellipticF", "ellipticF": "am"}
_DEGENERATE: dict[str, dict[int, Callable[[sympy.Expr], sympy.Expr]]] = {
    "sn": {0: sympy.sin, 1: sympy.tanh},
    "cn": {0: sympy.cos, 1: sympy.sech},
    "dn": {0: lambda u: sympy.Integer(1), 1: sympy.sech},
    "am": {0: lambda u: u, 1: lambda u: sympy.atan(sympy.sinh(u))},
    "ellipticF": {0: lambda u: u},
    "ellipticE": {0: lambda u: u},
    "thetan": {0: lambda u: sympy.Integer(1)},
}
"""The functions for m = 0 and 1."""


class modulus(sympy.Function):  # type: ignore[misc]  # noqa: N801
    """The parameter m = k² of a nome q."""

    nargs, is_real, is_nonnegative = 1, True, True

    @classmethod
    def eval(cls, q: sympy.Expr) -> sympy.Expr | None:
        """m where q is the nome of m."""
        quotient = -sympy.log(q) / sympy.pi if isinstance(q, sympy.exp) else None
        quarters = quotient.atoms(first) if quotient is not None else ()
        return next((f.args[1] for f in quarters if nome(f.args[1]) == q), sympy.Integer(0) if q == 0 else None)


def _delta(phi: sympy.Expr, m: sympy.Expr) -> sympy.Expr:
    return sympy.sqrt(1 - m * sympy.sin(phi) ** 2)


_RATES: dict[str, Callable[..., sympy.Expr]] = {
    "sn": lambda u, m: cn(u, m) * dn(u, m),
    "cn": lambda u, m: -sn(u, m) * dn(u, m),
    "dn": lambda u, m: -m * sn(u, m) * cn(u, m),
    "am": dn,
    "ellipticF": lambda phi, m: 1 / _delta(phi, m),
    "ellipticE": _delta,
    "ellipticPi": lambda n, phi, m: 1 / ((1 - n * sympy.sin(phi) ** 2) * _delta(phi, m)),
    "thetan": lambda u, m: thetan(u, m) * zeta_of_jacobi(u, m),
    "wp": lambda *a: wpprime(*a),
    "wpprime": lambda *a: 6 * wp(*a) ** 2 - a[1] / 2,
    "wp3": lambda *a: wp3prime(*a),
    "wp3prime": lambda *a: 6 * wp3(*a) ** 2 - a[1] / 2,
    "wpinverse": lambda *a: -wpprime(*a) / wp(*a) ** 2,
    "wzeta": lambda *a: -wp(*a),
    "wsigma": lambda *a: wsigma(*a) * wzeta(*a),
    "wzeta3": lambda *a: -wp3(*a),
    "wsigma3": lambda *a: wsigma3(*a) * wzeta3(*a),
}


# --- formulas in these functions --------------------------------------------------------------------------------------


def quarter(m: sympy.Expr) -> sympy.Expr:
    """K(m)."""
    return first(sympy.pi / 2, m)


def nome(m: sympy.Expr) -> sympy.Expr:
    """q = e^(−π K(1 − m)/K(m))."""
    return sympy.exp(-sympy.pi * quarter(1 - m) / quarter(m))


def zeta_of_jacobi(u: sympy.Expr, m: sympy.Expr) -> sympy.Expr:
    """Z(u)."""
    return second(am(u, m), m) - u * second(sympy.pi / 2, m) / quarter(m)


def jacobi_theta(index: int, u: sympy.Expr, m: sympy.Expr) -> sympy.Expr:
    """θ1, ..., θ4 at π u/(2K), of the nome of m: H, H1, Θ1, Θ."""
    k, k1 = sympy.sqrt(m), sympy.sqrt(1 - m)
    factors = {1: sympy.sqrt(k) * sn(u, m), 2: sympy.sqrt(k / k1) * cn(u, m), 3: dn(u, m) / sympy.sqrt(k1), 4: 1}
    return sympy.sqrt(2 * k1 * quarter(m) / sympy.pi) * factors[index] * thetan(u, m)


def theta(index: int, z: sympy.Expr, q: sympy.Expr) -> sympy.Expr:
    """θ1, ..., θ4 of z with nome q (DLMF 20.2)."""
    m = modulus(q)
    return jacobi_theta(index, 2 * quarter(m) * z / sympy.pi, m)


def theta_rate(s: sympy.Expr, m: sympy.Expr) -> sympy.Expr:
    """Z(i a)/i where sn(i a) = i s: s √((1 + m s²)/(1 + s²)) − E(φ, 1 − m) + (1 − E/K) F(φ, 1 − m), φ = atan s."""
    phi, e = sympy.atan(s), second(sympy.pi / 2, m)
    slope = s * sympy.sqrt((1 + m * s**2) / (1 + s**2))
    return slope - second(phi, 1 - m) + (1 - e / quarter(m)) * first(phi, 1 - m)


def theta_argument(u: sympy.Expr, s: sympy.Expr, m: sympy.Expr) -> sympy.Expr:
    """The argument of Θ(u + i a), 0 at u = 0, where sn(i a) = i s: by its rate, Im Z(u + i a) (DLMF 22.16.33)."""
    beyond = third(-m * s**2, am(u, m), m) - u
    return theta_rate(s, m) * u + sympy.sqrt((1 + m * s**2) * (1 + s**2)) / s * beyond


_TOWERS = (*_OF_ANGLE, third, thetan, wp, wpprime, wp3, wp3prime, wzeta, wsigma, wzeta3, wsigma3)
FORMULAS: dict[str, tuple[Any, int]] = {
    **{function.__name__: (function, max(function.nargs)) for function in _TOWERS},
    "ellipticK": (quarter, 1),
    "modulus": (modulus, 1),
    "nome": (nome, 1),
    "jacobiZeta": (zeta_of_jacobi, 2),
    **{name: (partial(jacobi_theta, index), 2) for name, index in {"Theta": 4, "Eta": 1}.items()},
    **{f"theta{index}": (partial(theta, index), 2) for index in (1, 2, 3, 4)},
    "thetaRate": (theta_rate, 2),
    "thetaArgument": (theta_argument, 3),
}
"""Functions that formulas may call, with the numbers of their arguments."""
FREE = {function.__name__: function for function in (*_OF_ANGLE, third, thetan, modulus, *_TOWERS[-4:])}
"""Functions that are free generators."""
WEIERSTRASS = {function.__name__: function for function in (wp, wpprime, wp3, wp3prime, wpinverse)}


# --- at numbers -------------------------------------------------------------------------------------------------------

_NAN = arb("nan")


def jacobi_at(u: arb, m: arb) -> tuple[arb, arb, arb]:
    """(sn, cn, dn); not finite unless 0 ≤ m ≤ 1 is certain."""
    if not (u.is_finite() and m >= 0 and m <= 1):
        return _NAN, _NAN, _NAN
    sine, cosine, delta = jacobi(m, 1 - m).functions(u)
    return sine, cosine, delta


def _amplitude(u: arb, m: arb) -> arb:
    turns = 0
    if m >= 0 and m < 1 and u.is_finite():
        half = 2 * acb(m).elliptic_k().real
        turns = nearest_integer(u / half)
        u -= turns * half
    sine, cosine, _ = jacobi_at(u, m)
    return turns * arb.pi() + arb.atan2(sine, cosine) if sine.is_finite() else _NAN


def _neville(u: arb, m: arb) -> arb:
    if m.is_zero() or not (m > 0 and m < 1):
        return arb(1) if m.is_zero() else _NAN
    k = acb(m).elliptic_k().real
    ratio = acb(0, acb(1 - m).elliptic_k().real / k)
    return arb((thetas(acb(u / (2 * k)), ratio)[3] / thetas(acb(0), ratio)[3]).real)


def _lattice(g2: arb, g3: arb) -> tuple[arb, acb] | None:
    """(2ω, τ); None where the discriminant may be 0."""
    try:
        lattice = from_invariants(g2, g3)
    except OutOfReach:
        return None
    return None if isinstance(lattice, DegenerateLattice) else (2 * lattice.half_period, lattice.ratio)


def _of_lattice(name: str, u: arb, g2: arb, g3: arb) -> arb:
    """A function of Weierstrass, by FLINT's of the periods 1 and τ: ℘' is −σ(2z)/σ(z)⁴."""
    bounded = "3" in name
    periods = _lattice(g2, g3) if u.is_finite() and g2.is_finite() and g3.is_finite() else None
    if periods is None or (bounded and not periods[1].real.is_zero()):
        return _NAN
    (period, tau), kind = periods, name.replace("3", "")
    half = tau / 2
    z = acb(u / period) + (half if bounded else 0)
    if kind == "wzeta":
        return ((z.elliptic_zeta(tau) - (half.elliptic_zeta(tau) if bounded else 0)) / period).real
    if kind == "wsigma":
        turn = (-half.elliptic_zeta(tau) * u / period).exp() / half.elliptic_sigma(tau) if bounded else period
        return (z.elliptic_sigma(tau) * turn).real
    if kind == "wpprime":
        return (-(2 * z).elliptic_sigma(tau) / (z.elliptic_sigma(tau) ** 4 * period**3)).real
    value = (z.elliptic_p(tau) / period**2).real
    return 1 / value if kind == "wpinverse" else value


VALUES: dict[str, Callable[..., arb]] = {
    **{name: lambda u, m, i=i: jacobi_at(u, m)[i] for i, name in enumerate(JACOBI)},
    "am": _amplitude,
    "ellipticF": lambda phi, m: acb.elliptic_f(acb(phi), acb(m)).real if m < 1 else _NAN,
    "ellipticE": lambda phi, m: acb.elliptic_e_inc(acb(phi), acb(m)).real if m <= 1 else _NAN,
    "ellipticPi": lambda n, phi, m: acb.elliptic_pi_inc(acb(n), acb(phi), acb(m)).real if m < 1 and n < 1 else _NAN,
    "thetan": _neville,
    "modulus": lambda q: (
        q if q.is_zero() else acb(0, -q.log() / arb.pi()).modular_lambda().real if q > 0 and q < 1 else _NAN
    ),
    **{name: partial(_of_lattice, name) for name in (*WEIERSTRASS, "wzeta", "wsigma", "wzeta3", "wsigma3")},
}
"""The functions of balls, at the working precision: each result contains the true values."""
