"""The 2 × 2 linear system of Hess' top over the phase of its period, solved by Taylor polynomials with a proven tail.

With s = m + d cos θ, ρ² = 2 (E − s), ω = K/ρ² and D = 1/√(2 (top − s)) = dt/dθ

    du/dθ = b v,  dv/dθ = c u,   b = ½ (ω − βρ) D,   c = −½ (ω + βρ) D

E and top lie above the gap; b and c are analytic but for cuts upwards from iβ and downwards from −iβ, and the same at
2π, 4π, ..., where cosh β = (E − m)/d.

*Tail.*  On a disc of radius r < √(x² + β²) about a place x, 0 ≤ x ≤ π, let |b|, |c| ≤ κ: their largest values are on
its circle, which is covered by balls.  A solution with |u|, |v| ≤ 1 in the middle is analytic in the disc and at most
e^(κr) (Gronwall's lemma along a radius), so that its Taylor coefficients are at most e^(κr)/r^n, and what follows the
first L terms at a distance δ < r is at most e^(κr) (δ/r)^L/(1 − δ/r).  Segments reach r/R to either side of their
places and grow away from 0 with the discs; where κr is large they are shorter.  There are log(1/β) of them for small β
(M·γ all but 0) and κ for large κ (moments of very different size): both are counted before any of them is made.

*The matrix.*  Y(θ), Y(0) = 1, is the product over segments of 0 ≤ θ ≤ π.  b and c are even, so with J = diag(1, −1)
Y(−θ) = J Y(θ) J, and the matrix over a period is Y(2π) = J Y(π)⁻¹ J Y(π).  det Y = 1.

*The polynomials.*  In units of the half length r/R of a segment the n-th coefficient is about R^-n, and n log2 R bits
fewer of it count.  n u_n = Σ_j b_(n−1−j) v_j, and so on.  Terms of the lower half of a range, once known, are
multiplied into the sums of its upper half all at once, halves of halves likewise: products of polynomials, which cost
less than their terms one by one.  Every factor is rounded to the bits that count (:func:`_trimmed`), and its ball holds
what that took away.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import ceil, hypot, log2, pi
from typing import Any

from flint import acb, arb, arb_mat, arb_poly, arb_series

from heavytop.errors import OutOfReach
from heavytop.exact.flint.balls import (
    Balls,
    Undecided,
    current_length,
    current_precision,
    series_length,
    working_precision,
)

_RATIO_BITS = 2
RATIO = 2**_RATIO_BITS
"""R: how many times a segment's half length the radius of its disc is."""
_SHARE, _WIDEST = 0.85, 2.0
"""The radius of a disc over its distance from a cut; its largest."""
_STEEPEST = 32
"""The largest κr."""
_ARCS, _BOUND_BITS = 64, 64
MOST_SEGMENTS = 96
_MOST_WORK, _WORK_BITS = 2048, 256
"""Segments times the square of the working precision over so many bits: some 15 s of one core."""
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
        short = _short if isinstance(phase, arb_series) else _same
        sine = short((phase / 2).sin())
        lowered = short(4 * self.reach * short(sine * sine))
        square = 2 * self.energy + lowered
        inverse = square.rsqrt()
        factor = short((2 * self.top + lowered).rsqrt() * inverse / 2)
        turning, bending = short(self.torque * inverse), short(self.skew * square)
        return factor * (turning - bending), -factor * (turning + bending)

    def width(self) -> arb:
        """β."""
        return 2 * (self.energy / (2 * self.reach)).sqrt().asinh()

    def bound(self, place: arb, radius: float) -> arb:
        """κ on the disc; not finite where the disc meets a cut."""
        with working_precision(_BOUND_BITS):
            largest = arb(0)
            # an arc of 2π/64 lies in a box of half its length about its middle
            spread = acb(arb(0, radius * pi / _ARCS), arb(0, radius * pi / _ARCS))
            for arc in range(_ARCS):
                angle = acb(0, 2 * arb.pi() * arc / _ARCS).exp()
                for entry in self.entries(place + radius * angle + spread):
                    largest = largest.max(abs(entry).upper())
            return largest


@dataclass(frozen=True, slots=True)
class Segment:
    """Y about one place: polynomials in (θ − place)/half of so many terms.

    half: r/R.  growth: e^(κr).
    """

    place: arb
    half: float
    growth: arb
    parts: tuple[arb_poly, ...]

    @classmethod
    def of(cls, system: System2, left: float, radius: float, bound: arb) -> Segment:
        """The segment that begins at ``left``, at the working precision; bound: κ."""
        place, half = arb(left) + radius / RATIO, radius / RATIO
        growth = (radius * bound).exp()
        length = ceil((current_precision() + 8 + log2(float(growth.upper()))) / _RATIO_BITS) + 2
        return cls(place, half, growth, polynomials(system, place, half, length))

    def at(self, phase: arb) -> arb_mat:
        """Y(phase) Y(place)⁻¹."""
        away = (phase - self.place) / self.half
        size, length = abs(away).upper() / RATIO, len(self.parts[0])
        tail = arb(0, (self.growth * size**length / (1 - size)).upper()) if size < 1 else arb("nan")
        one, two, three, four = (part(away) + tail for part in self.parts)
        return arb_mat([[one, two], [three, four]])


def plan(system: System2) -> list[tuple[float, float, arb]]:
    """Where each segment begins, the radius of its disc, and κ there.

    Raises Undecided where the working precision does not suffice, OutOfReach for more than MOST_SEGMENTS.
    """
    width, left = float(system.width().lower()), 0.0
    if not width > 0:
        raise Undecided
    found: list[tuple[float, float, arb]] = []
    while left < pi:
        radius = min(_WIDEST, _SHARE * hypot(left, width))
        while True:
            bound = system.bound(arb(left) + radius / RATIO, radius)
            if not bound.is_finite():
                raise Undecided
            steep = float(radius * bound)
            if steep <= _STEEPEST:
                break
            radius *= max(_STEEPEST / steep / 2, 2.0**-100)
        found.append((left, radius, bound))
        left += 2 * radius / RATIO
        if len(found) > MOST_SEGMENTS:
            raise OutOfReach(
                f"The linear system over the period has more than {MOST_SEGMENTS} segments: M·gamma is all but 0, or "
                "the moments differ by many decades.",
                "Ask for an earlier time.",
            )
    return found


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
        """At the working precision.

        Raises Undecided where it does not suffice, OutOfReach where there is too much to do at so many bits.
        """
        planned = plan(system)
        work = len(planned) * (current_precision() / _WORK_BITS) ** 2
        if work > _MOST_WORK:
            raise OutOfReach(
                f"The linear system of Hess' top has {len(planned)} segments, too many at {current_precision()} bits.",
                "Ask for fewer digits.",
            )
        now = arb_mat([[1, 0], [0, 1]])
        lefts, segments, before = [], [], []
        for left, radius, bound in planned:
            segment = Segment.of(system, left, radius, bound)
            right = left + 2 * radius / RATIO
            lefts.append(left)
            segments.append(segment)
            before.append(_adjugate(segment.at(arb(left))) * now)
            now = segment.at(arb(right) if right < pi else arb.pi()) * before[-1]
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


def polynomials(system: System2, place: arb, half: float, length: int) -> tuple[arb_poly, ...]:
    """The first ``length`` Taylor coefficients in ε of Y(place + half ε), Y(place) = 1: four polynomials, by rows."""
    with series_length(length):
        b, c = (half * entry for entry in system.entries(arb_series([place, half], prec=length)))
    rates = _trimmed(b.coeffs()), _trimmed(c.coeffs())
    # by columns: u and v of Y's first, u and v of its second
    y = [[arb(one)] + [arb(0)] * (length - 1) for one in (1, 0, 0, 1)]
    _fill(y, [[arb(0)] * length for _ in y], rates, 0, length)
    return arb_poly(y[0]), arb_poly(y[2]), arb_poly(y[1]), arb_poly(y[3])


def _fill(y: list[list[arb]], sums: list[list[arb]], rates: tuple[list[arb], list[arb]], first: int, last: int) -> None:
    """The terms ``first`` to ``last`` − 1 of u and v, whose ``sums`` hold what the terms before contribute to n u_n."""
    if last - first == 1:
        for row, total in zip(y, sums, strict=True):
            if first:
                (row[first],) = _trimmed([total[first] / first])
        return
    middle = (first + last) // 2
    _fill(y, sums, rates, first, middle)
    # the terms that they are multiplied by are about R^-first
    b, c = (arb_poly(_trimmed(rate[: last - first - 1], first)) for rate in rates)
    for k, rate in enumerate((b, c, b, c)):
        # u' = b v and v' = c u
        product = rate * arb_poly(y[k ^ 1][first:middle])
        for n in range(middle, last):
            sums[k][n] += product[n - 1 - first]
    _fill(y, sums, rates, middle, last)


def _short(series: arb_series) -> arb_series:
    """The series with the bits that count."""
    return arb_series(_trimmed(series.coeffs()), prec=current_length())


def _same(number: Balls) -> Balls:
    return number


def _trimmed(values: list[arb], order: int = 0) -> list[arb]:
    """Balls around the values with no bits below R^order 2^-precision, or 1/16."""
    unit = arb(2) ** min(order * _RATIO_BITS, current_precision() - 4)
    return [value + unit - unit for value in values]


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
