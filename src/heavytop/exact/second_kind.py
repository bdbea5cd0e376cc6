"""e^(iκt) Φ(t), Φ(t) = σ(V − t) e^(ζ(V) t)/(σ(V) σ(t)): what turns along with an elliptic motion, as balls.

A doubly periodic function of the second kind (Hermite): over the periods it takes constant factors.  Lamé's equation is
Φ'' = (2℘ + ℘(V)) Φ, and Φ'/Φ = ½ (℘' + ℘'(V))/(℘ − ℘(V)).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, acb_series, arb, arb_poly

from heavytop.exact.balls import ball, midpoint
from heavytop.exact.weierstrass import AnyLattice, Lattice, Point, Scalar, as_ball, thetas


@dataclass(frozen=True, slots=True)
class Winding:
    """A function of the second kind: ℘(V) = value, ℘'(V) = i slope √square, turning besides with κ = rate √square.

    All exact.  value is real and slope real, so that V is imaginary, or imaginary plus a real half-period; slope 0
    means that V is a half-period.
    """

    value: Fraction
    slope: Fraction
    rate: Fraction
    square: Fraction


@dataclass(frozen=True, slots=True)
class SecondKind:
    """e^(iκt) Φ(t) ready for evaluation.

    winding: its V and κ.  shift: V/(2ω).  unit: θ1(shift).  rate: θ1'/θ1(shift)/(2ω) + iκ, the whole exponent.
    index: of the half-period that V is, in the order of the lattice's roots, or None.
    parts: the polynomials of θ1(shift − z)/unit for numbers, its real part over cos πz, its imaginary over sin πz.
    """

    lattice: AnyLattice
    value: Scalar
    slope: acb
    shift: acb
    unit: acb
    rate: acb
    index: int | None
    parts: tuple[arb_poly, ...] = ()

    def at(self, point: Point) -> tuple[Any, Any]:
        """(Φ T, Φ' T²) e^(iκt), complex."""
        factor: Any = 1 if self.rate.is_zero() else exponential(point.time, self.rate)
        if not isinstance(self.lattice, Lattice):
            return self._degenerate(point, factor)
        if self.index is not None:
            sign, *others = point.thetas
            phi = others.pop(self.index) * (sign if self.index else 1)
            return factor * phi, factor * (others[0] * others[1] * (-sign if self.index else -1))
        above = point.above(self.value) * 2
        if isinstance(point.z, tuple):
            sine, cosine, c = point.z
            even, odd = self.parts
            phi = acb(even(c) * cosine, odd(c) * sine) * factor
            return phi, phi * acb(point.slope / above, point.scale * point.square * self.slope.imag / above)
        theta = thetas(self.shift - point.z, self.lattice.ratio)[0]
        phi = theta * (1 / self.unit) * factor
        return phi, phi * ((point.scale * point.square) * self.slope + point.slope) / above

    def _degenerate(self, point: Point, factor: Any) -> tuple[Any, Any]:
        """Φ = e^(Kt) (κ coth κt − K), or κ/sinh κt where V is at infinity."""
        cosine = point.slope / -2
        if self.index is not None:
            return factor, -(factor * cosine)
        phi = factor * (cosine - point.scale * self.shift)
        return phi, phi * point.scale * self.shift - factor


def exponential(time: Any, rate: acb) -> Any:
    """e^(rate·time) of a number or a series."""
    return (acb_series(time) * rate).exp() if not isinstance(time, arb) else (rate * time).exp()


def second_kind(lattice: AnyLattice, winding: Winding) -> SecondKind:
    """:class:`SecondKind` at the working precision."""
    root = ball(winding.square).sqrt()
    slope, turning = acb(0, ball(winding.slope) * root), acb(0, ball(winding.rate) * root)
    if not isinstance(lattice, Lattice):
        off = ball(winding.value) - as_ball(lattice.double)
        if winding.value == lattice.double:
            return SecondKind(lattice, winding.value, slope, acb(0), acb(1), turning, 0)
        rate = -slope / (2 * off)
        return SecondKind(lattice, winding.value, slope, rate, acb(1), rate + turning, None)
    if winding.slope == 0:
        value = ball(winding.value)
        index = min(range(3), key=lambda j: midpoint(abs(lattice.roots[j] - value).upper()))
        return SecondKind(lattice, winding.value, slope, acb(0), acb(1), turning, index)
    shift = _imaginary_argument(lattice, winding) / (2 * lattice.half_period)
    unit = thetas(shift, lattice.ratio)[0]
    log_slope = thetas(shift, lattice.ratio, 1)[0] / unit / (2 * lattice.half_period)
    # θ1'/θ1 is imaginary there
    rate = acb(0, log_slope.imag) + turning
    return SecondKind(lattice, ball(winding.value), slope, shift, unit, rate, None, _wave_parts(lattice, shift))


def _wave_parts(lattice: Lattice, shift: acb) -> tuple[arb_poly, ...]:
    if lattice.theta is None:
        return ()
    sine, cosine = lattice.theta.odd(shift)
    first = 1 / cosine(acb(1))
    # cosine/first is real and sine/first imaginary
    return tuple(arb_poly([c.real for c in (p * w).coeffs()]) for p, w in ((cosine, first), (sine, first * acb(0, 1))))


def _imaginary_argument(lattice: Lattice, winding: Winding) -> acb:
    """V with ℘(V) = value on the imaginary axis, or beside it by ω; the sign of Im V follows ℘'(V).

    ℘(iy; g2, g3) = −℘(y; g2, −g3) (DLMF 23.10(iv)), and y is Carlson's R_F (DLMF 19.25.35).  Beyond e3 ℘(V − ω) is
    taken, by the addition theorem, DLMF 23.10.1.
    """
    value, (e1, e2, e3) = acb(ball(winding.value)), lattice.roots
    beside = e2.imag == 0 and (value - e3).real > 0
    if beside:
        value = e1 + (e1 - e2) * (e1 - e3) / (value - e1)
    height = acb.elliptic_rf(e1 - value, e2 - value, e3 - value).real
    if (winding.slope > 0) != beside:
        height = -height
    return acb(lattice.half_period if beside else 0, height)
