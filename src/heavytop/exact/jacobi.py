"""Jacobi's elliptic functions by theta quotients, for every parameter 0 ≤ m ≤ 1, both ends included.

With K(m), K' = K(1 − m) and nome q = exp(−π K'/K), for m ≤ 1/2, z = u/(2K):

    sn u = θ3 θ1(z)/(θ2 θ4(z)),   cn u = θ4 θ2(z)/(θ2 θ4(z)),   dn u = θ4 θ3(z)/(θ3 θ4(z))

and for m > 1/2, by Jacobi's imaginary transformation, with the complementary nome and z = u/(2iK'):

    sn u = i θ3 θ1(z)/(θ4 θ2(z)),  cn u = θ2 θ4(z)/(θ4 θ2(z)),  dn u = θ2 θ3(z)/(θ3 θ2(z))

So the nome never exceeds exp(−π).  Where it is 0 the thetas are sin πz, cos πz, 1, 1 (the common factor 2 q^(1/4)
of θ1 and θ2 cancels everywhere): circular functions at m = 0, hyperbolic ones at m = 1.
Arguments are reduced modulo 2K before anything is evaluated.  DLMF 22.2, 20.7.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import acb, acb_series, arb, arb_series, ctx

from heavytop.exact.balls import midpoint
from heavytop.exact.closed_form import real_part, series_length

_I = acb(0, 1)


@dataclass(frozen=True, slots=True)
class Jacobi:
    """sn, cn, dn of one parameter at one working precision; made by :func:`jacobi`.

    parameter, complement: m and 1 − m.
    quarter: K, or None where m = 1 and there is no real period.
    scale: z = scale · u.
    tau: the ratio of the periods for the theta functions; None where the nome is 0.
    null: θ2, θ3, θ4 at 0.
    """

    parameter: arb
    complement: arb
    quarter: arb | None
    scale: acb
    tau: acb | None
    null: tuple[acb, acb, acb]
    hyperbolic: bool

    def reduced(self, u: Any) -> tuple[Any, int]:
        """(u − 2nK, n) with |u − 2nK| at most about K; n = 0 without a period."""
        if self.quarter is None:
            return u, 0
        head = u[0] if isinstance(u, arb_series) else u
        turns = round(midpoint(head / (2 * self.quarter))) if head.is_finite() else 0
        return u - 2 * turns * self.quarter, turns

    def thetas(self, u: Any) -> tuple[acb_series, ...]:
        """θ1, θ2, θ3, θ4 at z = scale · u, for a real or complex series u."""
        return _thetas(self.scale * acb_series(u, prec=ctx.cap), self.tau)

    def functions(self, u: arb_series) -> tuple[arb_series, arb_series, arb_series]:
        """(sn, cn, dn) at the series u."""
        u, turns = self.reduced(u)
        t1, t2, t3, t4 = self.thetas(u)
        n2, n3, n4 = self.null
        if self.hyperbolic:
            sn, cn, dn = _I * n3 / n4 * (t1 / t2), n2 / n4 * (t4 / t2), n2 / n3 * (t3 / t2)
        else:
            sn, cn, dn = n3 / n2 * (t1 / t4), n4 / n2 * (t2 / t4), n4 / n3 * (t3 / t4)
        flip = -1 if turns % 2 else 1
        return flip * real_part(sn), flip * real_part(cn), real_part(dn)

    def phase(self, u: Any, shift: arb, period: acb) -> acb_series:
        """θ1/|θ1| at u + i·shift for real u: a function of modulus 1, without poles on the real line.

        Its logarithm has the derivative of an elliptic function with simple poles of residue ± 1/2 at ∓ i·shift,
        up to a constant.  period: :meth:`phase_period`.
        """
        rest, turns = self.reduced(u)
        value = self._phase(rest, shift)
        return period**turns * value if turns else value

    def phase_period(self, shift: arb) -> acb:
        """What :meth:`phase` is multiplied by over 2K: the direction of a factor of θ1 that does not depend on u."""
        if self.quarter is None:
            return acb(1)
        with series_length(1):
            return (self._phase(self.quarter, shift) / self._phase(-self.quarter, shift))[0]

    def _phase(self, u: Any, shift: arb) -> acb_series:
        theta = self.thetas(acb_series(u, prec=ctx.cap) + _I * shift)[0]
        conjugate = acb_series([c.conjugate() for c in theta.coeffs()], prec=ctx.cap)
        return theta / acb_series(real_part(theta * conjugate).sqrt(), prec=ctx.cap)

    def phase_rate(self, shift: arb) -> arb:
        """The derivative of arg :meth:`phase` at u = 0."""
        with series_length(2):
            theta = self.thetas(arb_series([0, 1], prec=2) + _I * shift)[0]
            return (theta[1] / theta[0]).imag


def legendre_f(sine2: arb, cosine2: arb, delta2: arb) -> arb:
    """F(φ|m) for 0 ≤ φ ≤ π/2 from sin²φ, cos²φ and 1 − m sin²φ; at most one of the last two may be 0.

    The u in [0, K] with these squares of sn, cn, dn: F = sinφ R_F(cos²φ, 1 − m sin²φ, 1), DLMF 19.25.5.
    """
    return sine2.sqrt() * acb.elliptic_rf(cosine2, delta2, 1).real


def jacobi(parameter: arb, complement: arb) -> Jacobi:
    """The functions of parameter m = ``parameter``, with 1 − m given beside it, 0 ≤ m ≤ 1.

    A limit is taken where m or 1 − m is an exact 0, so both come from exact tests.
    """
    half_pi = arb.pi() / 2
    along: Any
    quarter = None if complement.is_zero() else half_pi / arb(1).agm(complement.sqrt())
    other = None if parameter.is_zero() else half_pi / arb(1).agm(parameter.sqrt())
    hyperbolic = quarter is None or bool(parameter.mid() > arb(0.5))
    across, along = (quarter, other) if hyperbolic else (other, quarter)
    scale = (acb(0, -1) if hyperbolic else acb(1)) / (2 * along)
    tau = None if across is None else acb(0, across / along)
    with series_length(1):
        _, t2, t3, t4 = _thetas(acb_series([0], prec=1), tau)
    return Jacobi(parameter, complement, quarter, scale, tau, (t2[0], t3[0], t4[0]), hyperbolic)


def _thetas(z: acb_series, tau: acb | None) -> tuple[acb_series, ...]:
    if tau is not None:
        return tuple(acb_series.modular_theta(z, tau))
    sine, cosine = acb_series.sin_cos_pi(z)
    one = acb_series([1], prec=ctx.cap)
    return sine, cosine, one, one
