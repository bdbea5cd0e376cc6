"""Jacobi's elliptic functions by theta quotients, for every parameter 0 ≤ m ≤ 1, both ends included.

With K(m), K' = K(1 − m) and nome q = exp(−π K'/K), for m ≤ 0.9, z = u/(2K):

    sn u = θ3 θ1(z)/(θ2 θ4(z)),   cn u = θ4 θ2(z)/(θ2 θ4(z)),   dn u = θ4 θ3(z)/(θ3 θ4(z))

and for larger m, by Jacobi's imaginary transformation, with the complementary nome and z = iu/(2K'):

    sn u = −i θ3 θ1(z)/(θ4 θ2(z)),  cn u = θ2 θ4(z)/(θ4 θ2(z)),  dn u = θ2 θ3(z)/(θ3 θ2(z))

So the nome never exceeds 0.15.  Where it is 0 the thetas are sin πz, cos πz, 1, 1 (the common factor 2 q^(1/4)
of θ1 and θ2 cancels everywhere): circular functions at m = 0, hyperbolic ones at m = 1.
For larger m arguments are reduced modulo 2K before anything is evaluated.  DLMF 22.2.4-22.2.6, 20.7(viii).
Numbers are evaluated by the series of :mod:`heavytop.exact.elliptic.weierstrass`, power series by FLINT's theta
functions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series

from heavytop.exact.closed_form import constant
from heavytop.exact.elliptic.weierstrass import Theta, real
from heavytop.exact.flint.balls import BallLike, coefficient, current_length, nearest_integer, series_length

_I = acb(0, 1)
_REACH = arb(1.25)  # quarter periods: the largest reduced argument
_LARGE = arb("0.9")


@dataclass(frozen=True, slots=True)
class Jacobi:
    """sn, cn, dn of one parameter at one working precision; made by :func:`jacobi`.

    parameter, complement: m and 1 − m.
    quarter: K, or None where m = 1 and there is no real period.
    scale: z = scale · u.
    tau: the ratio of the periods for the theta functions; None where the nome is 0.
    null: θ2, θ3, θ4 at 0.
    period: 2K and the largest reduced argument; None where arguments need no reduction.
    theta: their series for numbers, hyperbolic for large m.  parts: the polynomials of the numerators of sn, cn, dn and
    of their denominator, with the null values in the coefficients.
    """

    parameter: arb
    complement: arb
    quarter: arb | None
    scale: acb
    tau: acb | None
    null: tuple[acb, acb, acb]
    period: tuple[arb, arb] | None
    theta: Theta
    parts: tuple[arb_poly, arb_poly, arb_poly, arb_poly]

    def reduced(self, u: BallLike) -> tuple[Any, int]:
        """(u − 2nK, n) with |u − 2nK| at most about K; n = 0 where no reduction is needed."""
        if self.period is None:
            return u, 0
        turns = nearest_integer(constant(u) / self.period[0])
        reduced = u - turns * self.period[0]
        return (reduced, turns) if abs(constant(reduced)) < self.period[1] else (arb("nan"), 0)

    def thetas(self, u: Any) -> tuple[acb_series, ...]:
        """θ1, θ2, θ3, θ4 at z = scale · u, for a real or complex series u."""
        return _thetas(self.scale * acb_series(u, prec=current_length()), self.tau)

    def functions(self, u: Any) -> tuple[Any, Any, Any]:
        """(sn, cn, dn) at the number or series u."""
        u, turns = self.reduced(u)
        sn, cn, dn = self._numbers(u) if isinstance(u, arb) else self._series(u)
        return (-sn, -cn, dn) if turns % 2 else (sn, cn, dn)

    def _numbers(self, u: arb) -> tuple[arb, arb, arb]:
        sine, cosine, c = self.theta.angles(u)
        first, second, third, fourth = self.parts
        sn, cn, dn, below = first(c), second(c), third(c), fourth(c)
        if self.theta.hyperbolic:
            inverse = 1 / (below * cosine)
            return sine * sn * inverse, cn * inverse, dn * inverse
        inverse = 1 / below
        return sine * sn * inverse, cosine * cn * inverse, dn * inverse

    def _series(self, u: arb_series) -> tuple[arb_series, arb_series, arb_series]:
        t1, t2, t3, t4 = self.thetas(u)
        n2, n3, n4 = self.null
        if self.theta.hyperbolic:
            sn, cn, dn = _I * -n3 / n4 * (t1 / t2), n2 / n4 * (t4 / t2), n2 / n3 * (t3 / t2)
        else:
            sn, cn, dn = n3 / n2 * (t1 / t4), n4 / n2 * (t2 / t4), n4 / n3 * (t3 / t4)
        return real(sn), real(cn), real(dn)


@dataclass(frozen=True, slots=True)
class Wave:
    """θ1(u + i·shift) over the denominator of sn, for real u, up to a constant: it has neither poles nor zeros there.

    Its logarithm has the derivative of an elliptic function with simple poles of residue ± 1/2 at ∓ i·shift, up to a
    constant and a real part.  Made by :func:`wave`.
    real, imaginary: the polynomials of θ1 times cos x and sin x.  period: the argument of its factor, of modulus 1,
    over 2K.
    """

    functions: Jacobi
    shift: arb
    real: arb_poly
    imaginary: arb_poly
    period: arb

    def at(self, u: BallLike) -> tuple[Any, arb]:
        """The value at u reduced by n periods, a number or a series, and the angle n · period of the missing factor."""
        reduced, turns = self.functions.reduced(u)
        return self._number(reduced) if isinstance(reduced, arb) else self._series(reduced), turns * self.period

    def _number(self, u: arb) -> acb:
        theta, below = self.functions.theta, self.functions.parts[3]
        s, c, double = theta.angles(u)
        if theta.hyperbolic:
            inverse = 1 / below(double)
            return acb(self.real(double) * inverse, self.imaginary(double) * inverse * s / c)
        inverse = 1 / below(double)
        return acb(self.real(double) * c * inverse, self.imaginary(double) * s * inverse)

    def _series(self, u: arb_series) -> Any:
        functions = self.functions
        above = functions.thetas(acb_series(u, prec=current_length()) + _I * self.shift)[0]
        _, second, _, fourth = functions.thetas(u)
        if functions.theta.hyperbolic:
            return -above / second
        return _I * above / (functions.null[0] / functions.theta.odd()[1](arb(1)) * fourth)

    def rate(self) -> arb:
        """The derivative of its argument at u = 0."""
        with series_length(2):
            value = self.at(arb_series([0, 1], prec=2))[0]
            return arb((coefficient(value, 1) / value[0]).imag)


def wave(functions: Jacobi, shift: arb) -> Wave:
    """:class:`Wave` at the working precision, |shift| ≤ K(1 − m)."""
    sine, cosine = functions.theta.odd(-functions.scale * _I * shift)
    # one of them is real, the other imaginary
    if functions.theta.hyperbolic:
        made = Wave(functions, shift, _reals(cosine), _reals(_I * sine), arb(0))
    else:
        made = Wave(functions, shift, _reals(-_I * cosine), _reals(sine), arb(0))
    if functions.quarter is None or not functions.theta.hyperbolic:
        return made
    factor = made._number(functions.quarter) / made._number(-functions.quarter)
    # away from the cut of the argument
    period = (-factor).arg() + arb.pi() if factor.real < 0 else factor.arg()
    return replace(made, period=period)


def legendre_f(sine2: arb, cosine2: arb, delta2: arb) -> arb:
    """F(φ|m) for 0 ≤ φ ≤ π/2 from sin²φ, cos²φ and 1 − m sin²φ; at most one of the last two may be 0.

    The u in [0, K] with these squares of sn, cn, dn: F = sinφ R_F(cos²φ, 1 − m sin²φ, 1), DLMF 19.25.5.
    """
    return sine2.sqrt() * acb.elliptic_rf(cosine2, delta2, 1).real


def jacobi(parameter: arb, complement: arb) -> Jacobi:
    """The functions of parameter m = ``parameter`` and ``complement`` = 1 − m, 0 ≤ m ≤ 1.

    They are limits where m or 1 − m is an exact 0, which exact tests decide.
    """
    half_pi = arb.pi() / 2
    along: Any
    quarter = None if complement.is_zero() else half_pi / arb(1).agm(complement.sqrt())
    complementary = None if parameter.is_zero() else half_pi / arb(1).agm(parameter.sqrt())
    hyperbolic = quarter is None or bool(parameter.mid() > _LARGE)
    across, along = (quarter, complementary) if hyperbolic else (complementary, quarter)
    scale = (acb(0, 1) if hyperbolic else acb(1)) / (2 * along)
    tau = None if across is None else acb(0, across / along)
    nome = arb(0) if across is None else (-arb.pi() * across / along).exp()
    rate = half_pi / along
    period, growth = None, arb(1)
    if hyperbolic and quarter is not None:
        period = 2 * quarter, quarter * _REACH
        growth = (2 * rate * period[1]).exp().upper()
    theta = Theta(nome * nome, rate, hyperbolic, growth)
    with series_length(1):
        _, t2, t3, t4 = _thetas(acb_series([0], prec=1), tau)
    null = t2[0], t3[0], t4[0]
    return Jacobi(parameter, complement, quarter, scale, tau, null, period, theta, _parts(theta))


def _reals(poly: acb_poly) -> arb_poly:
    return arb_poly([c.real for c in poly.coeffs()])


def _parts(theta: Theta) -> tuple[arb_poly, arb_poly, arb_poly, arb_poly]:
    (first, second), third, fourth = theta.odd(), theta.even(1), theta.even(-1)
    one = arb(1)
    n2, n3, n4 = second(one), third(one), fourth(one)
    if theta.hyperbolic:
        return first * (n3 / n4), fourth * (n2 / n4), third * (n2 / n3), second
    return first * (n3 / n2), second * (n4 / n2), third * (n4 / n3), fourth


def _thetas(z: acb_series, tau: acb | None) -> tuple[acb_series, ...]:
    if tau is not None:
        return tuple(acb_series.modular_theta(z, tau))
    sine, cosine = acb_series.sin_cos_pi(z)
    one = acb_series([1], prec=current_length())
    return sine, cosine, one, one
