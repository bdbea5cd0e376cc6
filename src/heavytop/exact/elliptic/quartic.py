"""x'² = f(x) for any real quartic f and any start, and functions of the second kind with the same periods.

Every elliptic motion of the suite rests on two theorems.  Write f = a0x⁴ + 4a1x³ + 6a2x² + 4a3x + a4, c = f''(x0)/24,
f' = f'(x0) and so on, y0 = x'(0), ℘ with the invariants of f, and D(t) = 2 (℘(t) − c)² − f f''''/48.

1. Biermann-Weierstrass (Whittaker & Watson, A Course of Modern Analysis, 20.6, example 2):

    x(t) = x0 + [ −y0 ℘' + ½ f' (℘ − c) + f f'''/24 ] / D,    g2 = a0a4 − 4a1a3 + 3a2²,
    g3 = a0a2a4 + 2a1a2a3 − a2³ − a0a3² − a1²a4

2. Let F be meromorphic with poles only where x has them and of no higher order, and let e^(−iκt) F take the same
factors over the periods as Φ(t) = σ(V − t) e^(ζ(V) t)/(σ(V) σ(t)) does.  Then e^(−iκt) F D has no pole but one of order
four at t = 0, so it is a combination of Φ, Φ', Φ'', Φ''' (Hermite's theorem on functions of the second kind;
Halphen, Traité des fonctions elliptiques, I).
Φ = 1/t − P t/2 + P' t²/6 + ..., P = ℘(V), and so the combination follows from f_k, the derivatives of e^(−iκt) F at 0:

    F = e^(iκt) [ (f3/3 − 4c f1) Φ + (4c f0 − f2) Φ' + f1 Φ'' − f0 Φ'''/3 ] / D
    Φ'/Φ = ½ (℘' + P')/(℘ − P),    Φ'' = (2℘ + P) Φ    (Lamé's equation)

No formula divides by a quantity that depends on the start, so turning points, double roots and rest need no special
case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, acb_series, arb, arb_series

from heavytop.exact.elliptic.weierstrass import (
    AnyLattice,
    DegenerateLattice,
    Lattice,
    Point,
    Scalar,
    SecondKind,
    Winding,
    as_ball,
    difference,
    exponential,
    from_invariants,
    second_kind,
)
from heavytop.exact.flint.balls import BallLike, Balls, ball

Pair = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class QuarticMotion:
    """The motion x'² = f(x) from x(0) = start, x'(0) = speed.

    coefficients: of 1, x, x², x³, x⁴ (fewer for a lower degree).  The caller ensures speed² = f(start).
    The result is not finite at times where x is not.
    """

    coefficients: tuple[Fraction, ...]
    start: Fraction
    speed: Fraction

    def derivatives(self) -> tuple[Fraction, ...]:
        """f and its first four derivatives at the start."""
        row, values = list(self.coefficients), []
        for _ in range(5):
            values.append(sum((c * self.start**n for n, c in enumerate(row)), Fraction(0)))
            row = [coefficient * index for index, coefficient in enumerate(row)][1:]
        return tuple(values)

    def invariants(self) -> tuple[Fraction, Fraction]:
        """(g2, g3) of f."""
        row = (*self.coefficients, *[Fraction(0)] * 5)[:5]
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
        """All constants of the motion at the working precision."""
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

    On discriminant 0 the numbers stay exact.
    """

    lattice: AnyLattice
    centre: Scalar
    offset: Scalar
    start: arb
    numerators: tuple[Scalar, Scalar, Scalar]
    at_rest: bool

    def denominator(self, point: Point) -> Any:
        """D T⁴; on discriminant 0 from exact coefficients, of which the first vanishes where f is a square."""
        square = point.square
        if isinstance(self.lattice, DegenerateLattice):
            shift: Any = difference(self.lattice.double, self.centre)
            lead = 2 * shift * shift - self.offset
            return square * square * as_ball(lead) + square * as_ball(4 * shift) + 2
        above = point.above(self.centre)
        return above * above * 2 - square * square * as_ball(self.offset)

    def numerator(self, point: Point) -> Any:
        """(x − x0) D T⁴, finite where x is infinite."""
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
        """Several F of the second theorem with the same winding.

        taylors: f0, f1, f2/2 and f3/6, each as (real, imaginary/√square).
        """
        wave = second_kind(self.lattice, winding)
        still = not any(part for taylor in taylors for pair in taylor for part in pair)
        return Companions(wave, tuple(self._factors(winding, taylor) for taylor in taylors), still)

    def _factors(self, winding: Winding, coefficients: Sequence[Pair]) -> Factors:
        taylor = [(n * a, n * b) for n, (a, b) in zip((1, 1, 2, 6), coefficients, strict=True)]
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
        """The combination on discriminant 0, in powers of T; terms that cancel at large T cancel here, exactly."""
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


Factors = tuple[Any, ...]
"""Factors of Φ T times (T³, ℘T³, ℘'T³) and of Φ' T² times (T², ℘T²) in an F of the second theorem."""


@dataclass(frozen=True, slots=True)
class Companions:
    """Several F with the same winding, prepared for evaluation.  still: all are 0."""

    wave: SecondKind
    factors: tuple[Factors, ...]
    still: bool

    def at(self, point: Point, inverse: Balls) -> list[Balls]:
        """Each F at the point, complex where it is not real; inverse: 1/:meth:`PreparedMotion.denominator`."""
        if self.still:
            return [lift(point.scale * 0)] * len(self.factors)
        phi, slope = map(lift, self.wave.at(point))
        factor = lift(inverse)
        phi, slope, square = phi * factor, slope * factor, lift(point.square)
        # a complex ball times a real one is fast in this order only
        low, steep = phi * lift(point.scale), phi * lift(point.slope)
        if isinstance(self.wave.lattice, DegenerateLattice):
            slope_part = slope
            if self.wave.index is None:
                slope_part = -exponential(point.time, self.wave.rate) * factor
            # Φ' T² = K T ΦT − e: its K T ΦT is part of the cubic coefficient
            parts = low * square, low, steep, slope_part * square, slope
        else:
            p = lift(point.high + point.root * point.square)
            parts = low * square, low * p, steep, slope * square, slope * p
        a, b, c, d, e = parts
        return [a * f + b * g + c * h + d * i + e * j for f, g, h, i, j in self.factors]


def lift(value: BallLike) -> Any:
    """A series as a complex one; a number as it is."""
    return acb_series(value) if isinstance(value, arb_series) else value
