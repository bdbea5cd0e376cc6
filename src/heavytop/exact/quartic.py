"""x'² = f(x), any real quartic f, from any start, and the functions that turn along with such a motion.

Two theorems carry every elliptic motion of the suite.  Write f = a0x⁴ + 4a1x³ + 6a2x² + 4a3x + a4, c = f''(x0)/24,
f' = f'(x0) and so on, y0 = x'(0), ℘ with the invariants of f, and D(t) = 2 (℘(t) − c)² − f f''''/48.

1. Biermann-Weierstrass (Whittaker & Watson, A Course of Modern Analysis, 20.6, example 2):

    x(t) = x0 + [ −y0 ℘' + ½ f' (℘ − c) + f f'''/24 ] / D,    g2 = a0a4 − 4a1a3 + 3a2²,
    g3 = a0a2a4 + 2a1a2a3 − a2³ − a0a3² − a1²a4

2. Let F be meromorphic with poles only where x has them and of no higher order, and let e^(−iκt) F take the same
factors over the periods as Φ(t) = σ(V − t) e^(ζ(V) t)/(σ(V) σ(t)) does.  Then e^(−iκt) F D has no pole but one of order
four at t = 0, so it is a combination of Φ, Φ', Φ'', Φ''' (Hermite's theorem on functions of the second kind;
Halphen, Traité des fonctions elliptiques, I).
Φ = 1/t − P t/2 + P' t²/6 + ..., P = ℘(V), and so the combination is known from f_k, the derivatives of e^(−iκt) F at 0:

    F = e^(iκt) [ (f3/3 − 4c f1) Φ + (4c f0 − f2) Φ' + f1 Φ'' − f0 Φ'''/3 ] / D
    Φ'/Φ = ½ (℘' + P')/(℘ − P),    Φ'' = (2℘ + P) Φ    (Lamé's equation)

Nothing is divided by anything that depends on the start, so turning points, double roots and rest are starts like any
other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, acb_series, arb, arb_poly, arb_series

from heavytop.exact.balls import ball, midpoint
from heavytop.exact.weierstrass import (
    AnyLattice,
    DegenerateLattice,
    Lattice,
    Point,
    Scalar,
    as_ball,
    difference,
    from_invariants,
    thetas,
)

Pair = tuple[Fraction, Fraction]


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
class QuarticMotion:
    """The motion x'² = f(x) from x(0) = start, x'(0) = speed.

    coefficients: of 1, x, x², x³, x⁴ (fewer for a lower degree).  Exact numbers or balls; speed² = f(start) is the
    caller's promise.  x must stay finite for all real times that are asked for, else the result is not finite.
    """

    coefficients: tuple[Scalar, ...]
    start: Scalar
    speed: Scalar

    def _numbers(self, *values: Scalar) -> list[Any]:
        """The values in one ring: Fractions, or balls as soon as one of the motion's own numbers is a ball."""
        balls = any(isinstance(own, arb) for own in (*self.coefficients, self.start))
        return [value if isinstance(value, arb) else ball(value) if balls else Fraction(value) for value in values]

    def derivatives(self) -> tuple[Any, ...]:
        """f and its first four derivatives at the start."""
        row = self._numbers(*self.coefficients)
        start, zero = self._numbers(self.start, 0)
        found = []
        for _ in range(5):
            value = zero
            for coefficient in reversed(row):
                value = value * start + coefficient
            found.append(value)
            row = [coefficient * index for index, coefficient in enumerate(row)][1:]
        return tuple(found)

    def invariants(self) -> tuple[Any, Any]:
        """(g2, g3) of f."""
        row = self._numbers(*self.coefficients, 0, 0, 0, 0, 0)[:5]
        a4, a3, a2, a1, a0 = (coefficient / weight for coefficient, weight in zip(row, (1, 4, 6, 4, 1), strict=True))
        g2 = a0 * a4 - 4 * a1 * a3 + 3 * a2 * a2
        g3 = a0 * a2 * a4 + 2 * a1 * a2 * a3 - a2 * a2 * a2 - a0 * a3 * a3 - a1 * a1 * a4
        return g2, g3

    def lattice(self) -> AnyLattice:
        """The lattice of f at the working precision."""
        return from_invariants(*self.invariants())

    @property
    def at_rest(self) -> bool:
        """Whether x is constant: start on a double root."""
        return bool(self.speed == 0 and self.derivatives()[1] == 0)

    def prepared(self) -> PreparedMotion:
        """Everything that does not depend on time, at the working precision."""
        value, first, second, third, fourth = self.derivatives()
        centre, lattice = second / 24, self.lattice()
        number: Any = as_ball if isinstance(lattice, Lattice) else lambda exact: exact
        return PreparedMotion(
            lattice,
            number(centre),
            number(value * fourth / 48),
            as_ball(self.start),
            (number(value * third / 24), number(first / 2), number(-self.speed)),
            self.at_rest,
        )


@dataclass(frozen=True, slots=True)
class PreparedMotion:
    """A :class:`QuarticMotion` at one working precision: lattice, c, f f''''/48, x0 and its numerators.

    On discriminant 0 the numbers stay as exact as they were.
    """

    lattice: AnyLattice
    centre: Scalar
    offset: Scalar
    start: arb
    numerators: tuple[Scalar, Scalar, Scalar]
    at_rest: bool

    def denominator(self, point: Point) -> Any:
        """D T⁴; on discriminant 0 by its exact coefficients, of which the first vanishes where f is a square."""
        square = point.square
        if isinstance(self.lattice, DegenerateLattice):
            off: Any = difference(self.lattice.double, self.centre)
            lead = 2 * off * off - self.offset
            return square * square * as_ball(lead) + square * as_ball(4 * off) + 2
        above = point.above(self.centre)
        return above * above * 2 - square * square * as_ball(self.offset)

    def numerator(self, point: Point) -> Any:
        """(x − x0) D T⁴: beside :meth:`denominator`, what is left of x where it is infinite."""
        if self.at_rest:
            return point.scale * 0
        constant, even, odd = self.numerators
        square = point.square
        lead: Any = constant
        above = point.above(self.centre)
        if isinstance(self.lattice, DegenerateLattice):
            even_part: Any = even
            lead, above = constant + even_part * difference(self.lattice.double, self.centre), point.raised
        inner = (square * as_ball(lead) + above * as_ball(even)) * point.scale + point.slope * as_ball(odd)
        return inner * point.scale

    def position(self, point: Point, inverse: Any) -> Any:
        """x at the point; inverse: 1/:meth:`denominator`."""
        return self.numerator(point) * inverse + self.start

    def companions(self, winding: Winding, *taylors: Sequence[Pair]) -> Companions:
        """Several F of the second theorem with the same winding; taylors: f0..f3, each as (real, imaginary/√square)."""
        wave = second_kind(self.lattice, winding)
        still = not any(part for taylor in taylors for pair in taylor for part in pair)
        return Companions(wave, tuple(self._factors(winding, taylor) for taylor in taylors), still)

    def _factors(self, winding: Winding, taylor: Sequence[Pair]) -> Factors:
        if isinstance(self.lattice, DegenerateLattice):
            return self._elementary(self.lattice, winding, taylor)
        root = ball(winding.square).sqrt()
        f0, f1, f2, f3 = (acb(ball(a), ball(b) * root) for a, b in taylor)
        centre, value = as_ball(self.centre), ball(winding.value)
        factors = (
            f3 / 3 - 4 * centre * f1 + value * f1,
            2 * f1,
            -2 * f0 / 3,
            4 * centre * f0 - f2 - value * f0 / 3,
            -2 * f0 / 3,
        )
        return tuple(factor.real if factor.imag.is_zero() else factor for factor in factors)

    def _elementary(self, lattice: DegenerateLattice, winding: Winding, taylor: Sequence[Pair]) -> Factors:
        """The same on discriminant 0, in powers of T; what cancels at large T cancels here, exactly."""
        double: Any = lattice.double
        centre: Any = self.centre
        value, root = winding.value, ball(winding.square).sqrt()
        rate = Fraction(0) if value == double else -winding.slope / (2 * (value - double))  # K/(i √square)
        phi, slope = (
            tuple(sum((w * f[part] for w, f in zip(weights, taylor, strict=True)), Fraction(0)) for part in (0, 1))
            for weights in (
                (0, value - 4 * centre + 2 * double, 0, Fraction(1, 3)),
                (4 * centre - value / 3 - Fraction(2, 3) * double, 0, -1, 0),
            )
        )
        cubic = (phi[0] - winding.square * rate * slope[1], phi[1] + rate * slope[0])
        f0, f1, cube, second = (acb(ball(a), ball(b) * root) for a, b in (*taylor[:2], cubic, slope))
        return cube, 2 * f1, -2 * f0 / 3, second, -2 * f0 / 3


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
        factor: Any = 1 if self.rate.is_zero() else _exponential(point.time, self.rate)
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


def _exponential(time: Any, rate: acb) -> Any:
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

    ℘(iy; g2, g3) = −℘(y; g2, −g3), and y is Carlson's R_F (DLMF 19.25.35).  Beyond e3 ℘(V − ω) is taken, DLMF 23.10.4.
    """
    value, (e1, e2, e3) = acb(ball(winding.value)), lattice.roots
    beside = e2.imag == 0 and (value - e3).real > 0
    if beside:
        value = e1 + (e1 - e2) * (e1 - e3) / (value - e1)
    height = acb.elliptic_rf(e1 - value, e2 - value, e3 - value).real
    if (winding.slope > 0) != beside:
        height = -height
    return acb(lattice.half_period if beside else 0, height)


Factors = tuple[Any, ...]
"""What Φ T times (T³, ℘T³, ℘'T³) and Φ' T² times (T², ℘T²) are multiplied by in an F of the second theorem."""


@dataclass(frozen=True, slots=True)
class Companions:
    """Several F with the same winding, ready for evaluation.  still: all are 0."""

    wave: SecondKind
    factors: tuple[Factors, ...]
    still: bool

    def at(self, point: Point, inverse: Any) -> list[Any]:
        """Each F at the point, complex where it is not real; inverse: 1/:meth:`PreparedMotion.denominator`."""
        if self.still:
            return [lift(point.scale * 0)] * len(self.factors)
        phi, slope = map(lift, self.wave.at(point))
        whole = lift(inverse)
        phi, slope, square = phi * whole, slope * whole, lift(point.square)
        # a complex ball times a real one is quick in this order only
        low, steep = phi * lift(point.scale), phi * lift(point.slope)
        if isinstance(self.wave.lattice, DegenerateLattice):
            rest = slope
            if self.wave.index is None:
                rest = -_exponential(point.time, self.wave.rate) * whole
            # Φ' T² = K T ΦT − e: its K T ΦT stands in the cubic coefficient
            parts = low * square, low, steep, rest * square, slope
        else:
            p = lift(point.high + point.root * point.square)
            parts = low * square, low * p, steep, slope * square, slope * p
        a, b, c, d, e = parts
        return [a * f + b * g + c * h + d * i + e * j for f, g, h, i, j in self.factors]


def lift(value: Any) -> Any:
    """A series as a complex one; a number as it is."""
    return acb_series(value) if isinstance(value, arb_series) else value
