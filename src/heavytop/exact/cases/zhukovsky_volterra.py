"""Zhukovsky and Volterra's gyrostat: n = 0, any inertia, any rotor k, any start: M' = M × Ω, M = IΩ + k.

M moves on the curve |M|² = G², ½ Ω·IΩ = h.  With the homogeneous forms S = |M|² − G² w² and E = (M − kw)·I⁻¹(M − kw) −
2h w² of both quadrics, f(λ) = det(λS + E) = a0λ⁴ + 4a1λ³ + 6a2λ² + 4a3λ + a4 is a quartic whose invariants are those of
the lattice of M(t), a0 = −G².  The four poles of M(t) and one more point, less five times t = 0, are the zeros and the
pole of one function D, so that

    D(t) and D(t) Mi(t) are combinations of 1, ℘, ℘', ℘², ℘℘',

over the rational numbers: t = 0 is a rational point of the curve.  They follow from the Taylor series of M(t) by linear
equations: D Mi has no residue at t = 0 and agrees with its principal part up to t^5; an elliptic function with at
most four poles that vanishes so often is 0.

A vector Z = u + i M × u/G fixed in space, u ⟂ M, has in body axes components with the same poles.  Their zeros are
those of two lines on the sphere of one of its two rulings; so they are functions of the second kind with V the
difference of both rulings, which are the two points of y² = f(λ) at λ = ∞:

    ℘(V) = (a1² − a0a2)/a0,   ℘'(V) = i G (a0²a3 − 3a0a1a2 + 2a1³)/a0²,   κ = G a1/a0
    Zj D = e^(iκt) (c0 Φ + c1 Φ' + c2 Φ'' + c3 Φ''' + c4 Φ''''),   Φ as in :mod:`heavytop.exact.elliptic.weierstrass`

with c from the principal part of e^(−iκt) Zj D.  D is the only divisor that depends on the time.
Sources: N. E. Zhukovsky (1885), V. Volterra, Acta Math. 22 (1899) 201; the formulas are derived here, and proven by
their residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import factorial
from typing import Any, NamedTuple

from flint import arb, arb_mat, fmpq, fmpq_mat, fmpq_poly

from heavytop.errors import LevelNotDone
from heavytop.exact.cases.lagrange import polynomial
from heavytop.exact.closed_form import (
    ClosedForm,
    balls,
    cached_per_precision,
    initial_xi,
    instant,
    once,
    rotate,
    taylor,
    unwound,
)
from heavytop.exact.elliptic.quartic import QuarticMotion, lift
from heavytop.exact.elliptic.weierstrass import (
    Lattice,
    Point,
    SecondKind,
    Winding,
    from_invariants,
    imag,
    real,
    second_kind,
)
from heavytop.exact.flint.balls import BallLike, Balls, ball, current_length, rational, unit_of_time
from heavytop.exact.solution import NO_TORQUE
from heavytop.precision import Vector, cross, dot, exact
from heavytop.top.bodies import IDENTITY
from heavytop.top.equations import HEAVY_GYROSTAT

_POLE, _LAST = 5, 5
"""Order of the pole of D and D Mi at t = 0, and the power of t up to which they are compared."""


@dataclass(frozen=True, slots=True)
class ZhukovskyVolterra(ClosedForm):
    """The motion of a gyrostat without weight, γ of any length and direction.

    Raises NotInClass where n is not 0, LevelNotDone where M(t) is not an elliptic function but a limit of some.
    """

    method = "closed form: Zhukovsky-Volterra, Weierstrass functions"
    source = "N. E. Zhukovsky (1885); V. Volterra, Acta Math. 22 (1899) 201; formulas derived in the program"
    system = HEAVY_GYROSTAT
    body = (NO_TORQUE,)

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        g2, g3 = self.invariants()
        if not self.permanent and g2**3 == 27 * g3**2:
            raise LevelNotDone(
                "|M|^2 and the energy have tangent level surfaces: the motion is aperiodic, or the top symmetric.",
                "Use the enclosure for this motion.",
            )
        if not self.permanent:
            _exact(self)

    @property
    def momentum(self) -> Vector:
        """M = IΩ + k at t = 0."""
        return self.top.angular_momentum(self.start.omega)

    @property
    def _rotor(self) -> Vector:
        return self.top.rotor or (Fraction(0), Fraction(0), Fraction(0))

    @property
    @once
    def permanent(self) -> bool:
        """Whether M is at rest in the body."""
        return not any(cross(self.momentum, self.start.omega))

    def coefficients(self) -> tuple[Fraction, ...]:
        """a0, a1, a2, a3, a4 of f."""
        weights = (1, 4, 6, 4, 1)
        return tuple(c / weight for c, weight in zip(reversed(self._quartic()), weights, strict=True))

    def _quartic(self) -> list[Fraction]:
        """f, the lowest coefficient first."""
        rates, rotor = ([*map(rational, part)] for part in ([1 / i for i in self.top.inertia], self._rotor))
        lines = [fmpq_poly([rate, 1]) for rate in rates]
        square, energy = dot(self.momentum, self.momentum), dot(self.start.omega, self.momentum)
        energy -= dot(self.start.omega, self._rotor)
        last = fmpq_poly([dot(rotor, [k * a for k, a in zip(rotor, rates, strict=True)]) - rational(energy)])
        product = lines[0] * lines[1] * lines[2] * (last - fmpq_poly([0, rational(square)]))
        for row in range(3):
            product -= (rotor[row] * rates[row]) ** 2 * lines[row - 1] * lines[row - 2]
        return list(map(exact, product.coeffs()))

    def invariants(self) -> tuple[Fraction, Fraction]:
        """(g2, g3)."""
        return QuarticMotion(tuple(self._quartic()), Fraction(0), Fraction(0)).invariants()

    def winding(self) -> Winding:
        """V and κ of Z."""
        a0, a1, a2, a3, _ = self.coefficients()
        slope = (a0 * a0 * a3 - 3 * a0 * a1 * a2 + 2 * a1**3) / a0**2
        return Winding((a1 * a1 - a0 * a2) / a0, slope, a1 / a0, -a0)

    def evaluate(self, time: Fraction) -> list[BallLike]:
        if self.permanent:
            return [*balls(self.start.omega), *rotate(balls(self.start.gamma), self.start.omega, instant(time))]
        momentum, point, inverse = self._momentum(time)
        omega = [(m - ball(k)) * ball(1 / i) for m, k, i in zip(momentum, self._rotor, self.top.inertia, strict=True)]
        return [*omega, *_gamma(self).at(momentum, point, inverse)]

    def xi_at(self, time: Fraction) -> list[arb]:
        xi = initial_xi(self.start.gamma)
        if self.permanent:
            return rotate(xi, self.start.omega, ball(time))
        momentum, point, inverse = self._momentum(time)
        images = [unit.at(momentum, point, inverse) for unit in _axes(self)]
        return [dot(xi, components) for components in zip(*images, strict=True)]

    def own_time(self, time: Fraction) -> Fraction:
        return _unit(self) * time

    def _momentum(self, time: Fraction) -> tuple[list[BallLike], Point, BallLike]:
        """M, the point of the lattice, and 1/(D T^5)."""
        curve, length = _curve(self), current_length()
        point = _lattice(self).point(time, length if length > 1 else 0)
        below, *above = _combined(curve.rows, _terms(point, curve.order))
        inverse = 1 / below
        return [part * inverse for part in above], point, inverse


@once
def _unit(case: ZhukovskyVolterra) -> Fraction:
    return Fraction(2) ** unit_of_time(_parameters(case), case.start.flat)


def _powers(value: Any, most: int) -> list[Any]:
    """1, value, ..., value^most."""
    powers = [value * 0 + 1]
    for _ in range(most):
        powers.append(powers[-1] * value)
    return powers


def _terms(point: Point, order: int) -> list[BallLike]:
    """1, ℘, ℘', ℘² and ℘℘', each times T^order."""
    wp, slope, powers = point.above(Fraction(0)), point.slope, _powers(point.scale, order)
    terms = [powers[order], wp * powers[order - 2], slope * powers[order - 3], wp * wp * powers[order - 4]]
    return [*terms, wp * slope] if order == _POLE else terms


def _combined(rows: arb_mat, terms: Sequence[Any]) -> list[BallLike]:
    """The linear combinations of the terms, numbers or real series, with the factors of each row."""
    if isinstance(terms[0], arb):
        return list((rows * arb_mat(len(terms), 1, list(terms))).entries())
    table: Any = rows.table()
    return [sum((t * c for t, c in zip(terms[1:], row[1:], strict=True)), terms[0] * row[0]) for row in table]


@dataclass(frozen=True, slots=True)
class _Exact:
    """D and D Mi as combinations of 1, ℘, ℘', ℘², ℘℘', and the Laurent series of D, times t^5."""

    denominator: tuple[Fraction, ...]
    numerators: tuple[tuple[Fraction, ...], ...]
    series: fmpq_poly


class _Curve(NamedTuple):
    """The curve in balls: D in the first row, D Mi below it; order: of the pole of D at t = 0."""

    rows: arb_mat
    order: int


def _basis(g2: Fraction, g3: Fraction) -> list[fmpq_poly]:
    """The Laurent series of 1, ℘, ℘', ℘², ℘℘' up to t^5, times t^5 (DLMF 23.9)."""
    c2, c3, t = rational(g2 / 20), rational(g3 / 28), fmpq_poly([0, 1])
    wp = fmpq_poly([1, 0, 0, 0, c2, 0, c3, 0, c2 * c2 / 3, 0, 3 * c2 * c3 / 11])  # t²℘
    slope = t * wp.derivative() - 2 * wp
    return [row % t ** (_POLE + _LAST + 1) for row in (t**5, t**3 * wp, t**2 * slope, t * wp * wp, wp * slope)]


def _momentum_series(case: ZhukovskyVolterra) -> list[fmpq_poly]:
    """The Taylor series of M at t = 0, up to t^10."""
    rows = taylor(HEAVY_GYROSTAT.field, _parameters(case), case.start.flat, _POLE + _LAST + 1)
    parts = zip(case.top.inertia, rows[:3], case._rotor, strict=True)
    return [rational(moment) * polynomial(*row) + rational(rotor) for moment, row, rotor in parts]


def _parameters(case: ZhukovskyVolterra) -> Any:
    return HEAVY_GYROSTAT.parameters(case.top, case.start)


@once
def _exact(case: ZhukovskyVolterra) -> _Exact:
    """The exact data of the curve, by linear equations."""
    basis, equations = _basis(*case.invariants()), []
    for axis, momentum in enumerate(_momentum_series(case)):
        products = [row * momentum for row in basis]
        for power in range(_POLE + _LAST + 1):
            line = [product[power] for product in products] + [fmpq(0)] * 15
            line[5 + 5 * axis : 10 + 5 * axis] = [-row[power] for row in basis]
            equations.append(line)
    solution = _kernel(equations)
    denominator, *numerators = (tuple(solution[start : start + 5]) for start in (0, 5, 10, 15))
    series = sum((rational(d) * row for d, row in zip(denominator, basis, strict=True)), fmpq_poly())
    return _Exact(denominator, tuple(numerators), series)


def _kernel(equations: Sequence[Sequence[fmpq]]) -> list[Fraction]:
    """The one solution of homogeneous equations, up to a factor; raises LevelNotDone where there are more."""
    matrix: Any = fmpq_mat(equations)
    basis, count = matrix.numer_denom()[0].nullspace()
    if count != 1:
        raise LevelNotDone("The curve of M is degenerate.", "Use the enclosure for this motion.")
    return [Fraction(int(row[0])) for row in basis.table()]


@cached_per_precision
def _curve(case: ZhukovskyVolterra) -> _Curve:
    curve = _exact(case)
    order = _POLE if curve.denominator[4] else _POLE - 1
    rows: Any = [[ball(c) for c in row[:order]] for row in (curve.denominator, *curve.numerators)]
    return _Curve(arb_mat(rows), order)


@cached_per_precision
def _lattice(case: ZhukovskyVolterra) -> Lattice:
    lattice = from_invariants(*case.invariants())
    assert isinstance(lattice, Lattice)
    return lattice


@dataclass(frozen=True, slots=True)
class _Fixed:
    """A vector fixed in space: share M + Re Z.

    factors: Re c0 .. Re c4, −Im c0 .. −Im c4 of each component of Z, a row each; None where the vector is along M.
    """

    share: arb
    wave: SecondKind | None
    factors: arb_mat | None
    invariant: arb
    order: int

    def at(self, momentum: list[Balls], point: Point, inverse: Balls) -> list[Balls]:
        """Its body components at the point."""
        along = [m * self.share for m in momentum]
        if self.wave is None or self.factors is None:
            return along
        terms = self._terms(self.wave, point)
        waves = _combined(self.factors, [*map(real, terms), *map(imag, terms)])
        return [a + part * inverse for a, part in zip(along, waves, strict=True)]

    def _terms(self, wave: SecondKind, point: Point) -> list[BallLike]:
        """Φ .. Φ'''' times e^(iκt) T^order, by Lamé's equation."""
        phi, slope = map(lift, wave.at(point))
        square, powers = lift(point.square), _powers(lift(point.scale), self.order - 1)
        wp, steep = lift(point.above(Fraction(0))), lift(point.slope)
        lame = 2 * wp + wave.value * square if isinstance(wave.value, arb) else 2 * wp + ball(wave.value) * square
        terms = [
            phi * powers[self.order - 1],
            slope * powers[self.order - 2],
            lame * phi * powers[self.order - 3],
            (2 * steep * phi + lame * slope) * powers[self.order - 4],
        ]
        if self.order == _POLE:
            terms.append((12 * wp * wp - self.invariant * square * square + lame * lame) * phi + 4 * steep * slope)
        return terms


@cached_per_precision
def _gamma(case: ZhukovskyVolterra) -> _Fixed:
    return _fixed(case, case.start.gamma)


@cached_per_precision
def _axes(case: ZhukovskyVolterra) -> list[_Fixed]:
    """The axes of the body at t = 0."""
    return [_fixed(case, unit) for unit in IDENTITY]


def _fixed(case: ZhukovskyVolterra, vector: Vector) -> _Fixed:
    momentum = case.momentum
    square = dot(momentum, momentum)
    share = dot(vector, momentum) / square
    across: Any = tuple(v - share * m for v, m in zip(vector, momentum, strict=True))
    order, invariant = _curve(case).order, ball(case.invariants()[0])
    if not any(across):
        return _Fixed(ball(share), None, None, invariant, order)
    winding = case.winding()
    normal: Any = tuple(c / square for c in cross(momentum, across))
    root = ball(winding.square).sqrt()
    factors: Any = []
    for real_part, imaginary in zip(_body_series(case, across), _body_series(case, normal), strict=True):
        products = [_exact(case).series * polynomial(*part) for part in (real_part, imaginary)]
        # Φ^(k) begins with (−1)^k k!/t^(k + 1)
        first, second = ([exact(series[n]) for n in range(_POLE)] for series in products)
        parts = enumerate(reversed(unwound(first, second, winding)))
        scaled = [(a * (-1) ** k / factorial(k), b * (-1) ** k / factorial(k)) for k, (a, b) in parts]
        factors.append([*(ball(a) for a, _ in scaled[:order]), *(ball(-b) * root for _, b in scaled[:order])])
    return _Fixed(ball(share), second_kind(_lattice(case), winding), arb_mat(factors), invariant, order)


def _body_series(case: ZhukovskyVolterra, fixed: Vector) -> list[list[Fraction]]:
    """The Taylor coefficients of a vector fixed in space in body axes, up to t^4."""
    return taylor(HEAVY_GYROSTAT.field, _parameters(case), (*case.start.omega, *fixed), _POLE)[3:]
