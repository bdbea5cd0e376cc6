"""The 2 × 2 linear system of Hess' top over the phase of its period, solved by Taylor polynomials with a proven tail.

With s = m + d cos θ, ρ² = 2 (E − s), ω = K/ρ² and D = 1/√(2 (top − s)) = dt/dθ

    du/dθ = b v,  dv/dθ = c u,   b = ½ (ω − βρ) D,   c = −½ (ω + βρ) D

E and top lie above the gap; b and c are analytic but for cuts upwards from iβ and downwards from −iβ, and the same at
2π, 4π, ..., where cosh β = (E − m)/d.

*Tail.*  On a disc of radius r < √(x² + β²) about a place x, 0 ≤ x ≤ π, let |b|, |c| ≤ κ: their largest values are on
its circle, which is covered by balls.  A solution with |u|, |v| ≤ 1 in the middle is analytic in the disc and at most
e^(κr) (Gronwall's lemma along a radius), so that its Taylor coefficients are at most e^(κr)/r^n, and what follows the
first L terms at a distance δ < r is at most e^(κr) (δ/r)^L/(1 − δ/r).  Segments grow away from 0 with the discs.

*The matrix.*  Y(θ), Y(0) = 1, is the product over segments of 0 ≤ θ ≤ π.  b and c are even, so with J = diag(1, −1)
Y(−θ) = J Y(θ) J, and the matrix over a period is Y(2π) = J Y(π)⁻¹ J Y(π).  det Y = 1.

*The polynomials.*  If Y is right up to ε^(n − 1), Y + Y ∫ adj(Y) (A Y − Y') is up to ε^(2n − 1): both the neglected
factor 1 + O(ε^n) and det Y − 1 = O(ε^n) multiply a residual of order ε^(n − 1).
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import ceil, hypot, log2, pi
from typing import Any

from flint import acb, arb, arb_mat, arb_poly, arb_series

from heavytop.exact.balls import Undecided, working_precision
from heavytop.exact.flint_context import current_precision, series_length

_SHARE, _WIDEST, _RATIO = 0.75, 1.5, 8
"""The radius of a disc over its distance from a cut; its largest; how many times a segment's half length it is."""
_ARCS, _BOUND_BITS = 32, 64
Matrix = tuple[Any, Any, Any, Any]


@dataclass(frozen=True, slots=True)
class System2:
    """The coefficients: d, E − m − d, top − m − d, K = NC0 and β."""

    reach: arb
    energy: arb
    top: arb
    torque: arb
    skew: arb

    def entries(self, phase: Any) -> tuple[Any, Any]:
        """(b, c) at a number or series, real or complex."""
        sine = (phase / 2).sin()
        lowered = 2 * self.reach * sine * sine
        square = 2 * (self.energy + lowered)
        half = (2 * (self.top + lowered)).rsqrt() / 2
        turning, bending = self.torque / square, self.skew * square.sqrt()
        return (turning - bending) * half, -(turning + bending) * half

    def width(self) -> arb:
        """β."""
        return 2 * (self.energy / (2 * self.reach)).sqrt().asinh()

    def bound(self, place: arb, radius: float) -> arb:
        """κ on the disc; not finite where the disc meets a cut."""
        with working_precision(_BOUND_BITS):
            largest = arb(0)
            # an arc of 2π/32 lies in a box of half its length about its middle
            spread = acb(arb(0, radius * pi / _ARCS), arb(0, radius * pi / _ARCS))
            for arc in range(_ARCS):
                angle = acb(0, 2 * arb.pi() * arc / _ARCS).exp()
                for entry in self.entries(place + radius * angle + spread):
                    largest = largest.max(abs(entry).upper())
            return largest


@dataclass(frozen=True, slots=True)
class Segment:
    """Y about one place: polynomials in (θ − place)/radius of so many terms, and the matrix from θ = 0 to the place.

    growth: e^(κr).
    """

    place: arb
    radius: float
    growth: arb
    parts: tuple[arb_poly, ...]

    @classmethod
    def of(cls, system: System2, left: float, radius: float) -> Segment:
        """The segment that begins at ``left``, at the working precision."""
        place = arb(left) + radius / _RATIO
        growth = (radius * system.bound(place, radius)).exp()
        if not growth.is_finite():
            raise Undecided
        length = ceil((current_precision() + 8 + log2(float(growth.upper()))) / log2(_RATIO)) + 2
        return cls(place, radius, growth, polynomials(system, place, radius, length))

    def at(self, phase: arb) -> arb_mat:
        """Y(phase) Y(place)⁻¹."""
        away = (phase - self.place) / self.radius
        size, length = abs(away).upper(), len(self.parts[0])
        tail = arb(0, (self.growth * size**length / (1 - size)).upper()) if size < 1 else arb("nan")
        one, two, three, four = (part(away) + tail for part in self.parts)
        return arb_mat([[one, two], [three, four]])


@dataclass(frozen=True, slots=True)
class Transfer:
    """Y at any phase.

    lefts: where the segments begin.  before: Y at their places.  period: Y(2π).
    """

    lefts: tuple[float, ...]
    segments: tuple[Segment, ...]
    before: tuple[arb_mat, ...]
    period: arb_mat

    @classmethod
    def of(cls, system: System2) -> Transfer:
        """At the working precision; raises Undecided where it does not suffice."""
        width, left = float(system.width().lower()), 0.0
        if not width > 0:
            raise Undecided
        now = arb_mat([[1, 0], [0, 1]])
        lefts, segments, before = [], [], []
        while left < pi:
            radius = min(_WIDEST, _SHARE * hypot(left, width))
            segment = Segment.of(system, left, radius)
            right = left + 2 * radius / _RATIO
            lefts.append(left)
            segments.append(segment)
            before.append(_adjugate(segment.at(arb(left))) * now)
            now = segment.at(arb(right) if right < pi else arb.pi()) * before[-1]
            left = right
        return cls(tuple(lefts), tuple(segments), tuple(before), _mirrored(_adjugate(now)) * now)

    def at(self, phase: arb, turns: int) -> arb_mat:
        """Y(phase + 2π turns)."""
        turn = 2 * arb.pi()
        while phase > arb.pi():
            phase, turns = phase - turn, turns + 1
        while phase < -arb.pi():
            phase, turns = phase + turn, turns - 1
        there = _mirrored(self._inside(-phase)) if phase < 0 else self._inside(phase)
        if turns == 0:
            return there
        power = _power(self.period, abs(turns))
        return there * (power if turns > 0 else _adjugate(power))

    def inverse(self, phase: arb) -> arb_mat:
        """Y(phase)⁻¹."""
        return _adjugate(self.at(phase, 0))

    def _inside(self, phase: arb) -> arb_mat:
        """Y at 0 ≤ phase ≤ π, or about there."""
        number = max(0, bisect_right(self.lefts, float(phase)) - 1)
        return self.segments[number].at(phase) * self.before[number]


def polynomials(system: System2, place: arb, radius: float, length: int) -> tuple[arb_poly, ...]:
    """The first ``length`` Taylor coefficients in ε of Y(place + radius ε), Y(place) = 1: four polynomials, by rows."""
    with series_length(length):
        b, c = (radius * entry for entry in system.entries(arb_series([place, radius], prec=length)))
    y: Matrix = (arb_series([1]), arb_series([0]), arb_series([0]), arb_series([1]))
    right = 1
    while right < length:
        wanted = min(2 * right, length)
        with series_length(wanted):
            y = _doubled(tuple(arb_series(x.coeffs(), prec=wanted) for x in y), b, c, right, wanted)
        right = wanted
    return tuple(arb_poly(x.coeffs()) for x in y)


def _doubled(y: tuple[arb_series, ...], b: arb_series, c: arb_series, right: int, wanted: int) -> Matrix:
    """Y with ``wanted`` ≤ 2·``right`` terms, from ``right`` of them."""
    y1, y2, y3, y4 = y
    slopes = (b * y3, b * y4, c * y1, c * y2)
    rest = [slope - x.derivative() for slope, x in zip(slopes, y, strict=True)]
    # up to ε^(right − 2) it is 0, as the terms there are right
    r1, r2, r3, r4 = (arb_series([*[0] * (right - 1), *x.coeffs()[right - 1 :]], prec=wanted) for x in rest)
    z1, z2 = (y4 * r1 - y2 * r3).integral(), (y4 * r2 - y2 * r4).integral()
    z3, z4 = (y1 * r3 - y3 * r1).integral(), (y1 * r4 - y3 * r2).integral()
    return (y1 + y1 * z1 + y2 * z3, y2 + y1 * z2 + y2 * z4, y3 + y3 * z1 + y4 * z3, y4 + y3 * z2 + y4 * z4)


def _power(matrix: arb_mat, exponent: int) -> arb_mat:
    """matrix^exponent for any exponent > 0: FLINT's own takes 64 bits."""
    found = matrix
    for bit in f"{exponent:b}"[1:]:
        found = found * found
        if bit == "1":
            found = found * matrix
    return found


def _adjugate(matrix: arb_mat) -> arb_mat:
    """The inverse of a matrix of determinant 1."""
    one, two, three, four = matrix.entries()
    return arb_mat([[four, -two], [-three, one]])


def _mirrored(matrix: arb_mat) -> arb_mat:
    """J Y J."""
    one, two, three, four = matrix.entries()
    return arb_mat([[one, -two], [-three, four]])
