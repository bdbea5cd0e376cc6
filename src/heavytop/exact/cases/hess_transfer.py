"""The 2 × 2 linear system of Hess' top over the phase of its period, solved by Taylor polynomials with a proven tail.

With s = m + d cos θ, ρ² = 2 (E − s), ω = K/ρ² and D = 1/√(2 (top − s)) = dt/dθ

    du/dθ = b v,  dv/dθ = c u,   b = ½ (ω − βρ) D,   c = −½ (ω + βρ) D

E and top lie above the gap; b and c are analytic except on cuts upwards from iβ and downwards from −iβ, and the same at
2π, 4π, ..., where cosh β = (E − m)/d.

*Without roots.*  About a place x let z = tan ½(θ − x) and w = 1 + z².  Then ρ² = P/w and 2 (top − s) = Q/w with
quadratic polynomials P and Q of z, and with U = u √(Pw), V = v √(w/Q), W = v √(P/Q), in derivatives by z,

    u' = K V/P − β W/w
    U' = ½ (P'/P + w'/w) U + K w W/P − β P V/w
    V' = ½ (w'/w − Q'/Q) V − (K w u/P + β U/w)/Q
    W' = ½ (P'/P − Q'/Q) W − (K U/P + β P u/w)/Q

A quotient by a quadratic polynomial takes two products a term, so that L terms take 32 L of them.

*Tail.*  On a disc |z| < r without zeros of P, Q and w let κ be the largest value on its circle of

    |K| √|w|/(|P| √|Q|) + |β| √|P|/(|w| √|Q|),

which bounds |du/dz|/|v| and |dv/dz|/|u| in it, whatever the signs of the roots: a sum of sizes of analytic functions is
largest on the circle, which is covered by balls.  A solution with |u|, |v| ≤ 1 in the middle is analytic in the disc
and at most e^(κr) (Gronwall's lemma along a radius), so that its Taylor coefficients are at most e^(κr)/r^n, and what
follows the first L terms at a distance δ < r is at most e^(κr) (δ/r)^L/(1 − δ/r); for V that times the largest √|w/Q|.
Segments reach r/R to either side of their places and grow away from 0 with the discs; where κr is large they are
shorter.  There are log(1/β) of them for small β (M·γ near 0) and κ for large κ (moments of very different size):
both are counted before any of them is computed.

*The matrix.*  Y(θ), Y(0) = 1, is the product over segments of 0 ≤ θ ≤ π.  b and c are even, so with J = diag(1, −1)
Y(−θ) = J Y(θ) J, and the matrix over a period is Y(2π) = J Y(π)⁻¹ J Y(π).  det Y = 1.

*Bits.*  The n-th term is about R^-n of the first, so that n log2 R fewer bits of it count, and it is computed in these.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import atan, ceil, cos, log2, pi, sin, sinh, sqrt
from typing import Any

from flint import acb, arb, arb_mat, arb_poly

from heavytop.errors import OutOfReach
from heavytop.exact.flint.balls import Undecided, current_precision, working_precision

_RATIO_BITS = 2
RATIO = 2**_RATIO_BITS
"""R: how many times a segment's half length in z the radius of its disc is."""
_SHARE, _WIDEST = 0.85, 32.0
"""The radius of a disc over its distance from the nearest zero; the largest β that this is looked up at."""
_STEEPEST = 32
"""The largest κr."""
_ARCS, _BOUND_BITS = 64, 64
_GUARD, _BLOCK = 32, 16
"""Guard bits; terms that are computed in the same bits."""
MOST_SEGMENTS = 96
_MOST_WORK, _WORK_BITS = 16384, 256
"""The largest cost, segments times (working precision/:data:`_WORK_BITS`)²: some 15 s of one core."""
Quadratic = tuple[arb, arb, arb]


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
        lowered = 4 * self.reach * sine * sine
        square = 2 * self.energy + lowered
        inverse = square.rsqrt()
        factor = (2 * self.top + lowered).rsqrt() * inverse / 2
        turning, bending = self.torque * inverse, self.skew * square
        return factor * (turning - bending), -factor * (turning + bending)

    def quadratics(self, centre: arb) -> tuple[Quadratic, Quadratic]:
        """P and Q about a place, by their coefficients of 1, z, z²."""
        sine, cosine = (centre / 2).sin(), (centre / 2).cos()
        lowered = 4 * self.reach * sine**2, 8 * self.reach * sine * cosine, 4 * self.reach * cosine**2
        first, second = ((2 * x + lowered[0], lowered[1], 2 * x + lowered[2]) for x in (self.energy, self.top))
        return first, second

    def width(self) -> arb:
        """β."""
        return 2 * (self.energy / (2 * self.reach)).sqrt().asinh()

    def bound(self, centre: float, radius: float) -> tuple[arb, arb]:
        """κ on the disc and the largest √|w/Q|; not finite where a zero is too near to it."""
        with working_precision(_BOUND_BITS):
            steepness, widest = arb(0), arb(0)
            # c ((z + b/2c)² + gap): no zero is found where two are near each other
            shapes = [
                (c, b / c / 2, 4 * x * (x + 2 * self.reach) / c**2)
                for x, (_, b, c) in zip((self.energy, self.top), self.quadratics(arb(centre)), strict=True)
            ]
            # an arc of 2π/64 lies in a box of half its length about its middle
            spread = acb(arb(0, radius * pi / _ARCS), arb(0, radius * pi / _ARCS))
            for arc in range(_ARCS):
                z = radius * acb(0, 2 * arb.pi() * arc / _ARCS).exp() + spread
                p, q = (abs(c * ((z + shift) ** 2 + gap)) for c, shift, gap in shapes)
                w = abs(1 + z**2)
                value = abs(self.torque) * w.sqrt() / p + abs(self.skew) * p.sqrt() / w
                steepness, widest = steepness.max((value / q.sqrt()).upper()), widest.max((w / q).sqrt().upper())
            return steepness, widest


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc about a place, with its segment.

    left, right: ends of the segment.  radius: r.  steepness: κ.  widest: the largest √|w/Q|.
    """

    left: float
    place: float
    right: float
    radius: float
    steepness: arb
    widest: arb

    @classmethod
    def of(cls, system: System2, left: float, radius: float) -> Disc:
        """The disc whose segment begins at ``left``."""
        angle = left + 2 * atan(radius / RATIO)
        return cls(left, angle, 2 * angle - left, radius, *system.bound(angle, radius))


@dataclass(frozen=True, slots=True)
class Segment:
    """Y about one place: polynomials in z for u and V of its columns.

    growth: e^(κr).  roots: Q.
    """

    disc: Disc
    growth: arb
    roots: Quadratic
    parts: tuple[arb_poly, ...]

    @classmethod
    def of(cls, system: System2, disc: Disc) -> Segment:
        """The segment of a disc at the working precision."""
        growth = (disc.radius * disc.steepness).exp()
        bits = ceil(current_precision() + 8 + log2(float(growth.upper())))
        length, (first, second) = ceil(bits / _RATIO_BITS) + 2, system.quadratics(arb(disc.place))
        # u, U, V and W of a solution that begins with (1, 0), and of one with (0, 1)
        scale, zero = 1 / second[0].sqrt(), arb(0)
        starts = (arb(1), first[0].sqrt(), zero, zero), (zero, zero, scale, scale * first[0].sqrt())
        parts = [part for start in starts for part in _series(system, first, second, start, length, bits)]
        return cls(disc, growth, second, tuple(parts))

    def at(self, phase: arb) -> arb_mat:
        """Y(phase) Y(place)⁻¹."""
        z = ((phase - self.disc.place) / 2).tan()
        size, length = abs(z).upper() / self.disc.radius, len(self.parts[0])
        tail = (self.growth * size**length / (1 - size)).upper() if size < 1 else arb("nan")
        a, b, c = self.roots
        back = ((a + z * (b + z * c)) / (1 + z * z)).sqrt()
        (u, v), (other_u, other_v) = (
            (first(z) + arb(0, tail), (second(z) + arb(0, (tail * self.disc.widest).upper())) * back)
            for first, second in (self.parts[:2], self.parts[2:])
        )
        return arb_mat([[u, other_u], [v, other_v]])


def plan(system: System2) -> list[Disc]:
    """The discs over 0 ≤ θ ≤ π.

    Raises Undecided where the working precision does not suffice, OutOfReach for more than MOST_SEGMENTS.
    """
    width, left = float(system.width().lower()), 0.0
    if not width > 0:
        raise Undecided
    discs: list[Disc] = []
    while left < pi:
        disc = Disc.of(system, left, _SHARE * _distance(left, width))
        while True:
            if not (disc.steepness.is_finite() and disc.widest.is_finite()):
                raise Undecided
            steep = float(disc.radius * disc.steepness)
            if steep <= _STEEPEST:
                break
            disc = Disc.of(system, left, disc.radius * max(0.9 * _STEEPEST / steep, 2.0**-100))
        discs.append(disc)
        left = disc.right
        if len(discs) > MOST_SEGMENTS:
            raise OutOfReach(
                f"The linear system over the period has more than {MOST_SEGMENTS} segments: M·gamma is nearly 0, or "
                "the moments differ by many decades.",
                "Give an earlier time.",
            )
    return discs


def _distance(centre: float, width: float) -> float:
    """The distance of z = 0 from the nearest zero of P, Q and w, which does not decrease away from 0.

    The zeros of Q are farther than those of P: E < top, for the cubic of the height is −K² at E.
    """
    sine, half = sin(centre / 2), sinh(min(width, _WIDEST) / 2)
    return min(1.0, sqrt((half**2 + sine**2) / (half**2 + cos(centre / 2) ** 2)))


@dataclass(frozen=True, slots=True)
class Transfer:
    """Y at any phase.

    before: Y at the places of the segments.  period: Y(2π).
    """

    segments: tuple[Segment, ...]
    before: tuple[arb_mat, ...]
    period: arb_mat

    @classmethod
    def of(cls, system: System2) -> Transfer:
        """The matrices at the working precision.

        Raises Undecided where that does not suffice, OutOfReach where the cost at so many bits is too high.
        """
        planned = plan(system)
        work = len(planned) * (current_precision() / _WORK_BITS) ** 2
        if work > _MOST_WORK:
            raise OutOfReach(
                f"The linear system of Hess' top has {len(planned)} segments, too many at {current_precision()} bits.",
                "Request fewer digits.",
            )
        now = arb_mat([[1, 0], [0, 1]])
        segments, before = [], []
        for disc in planned:
            segment = Segment.of(system, disc)
            segments.append(segment)
            before.append(_adjugate(segment.at(arb(disc.left))) * now)
            now = segment.at(arb(disc.right) if disc.right < pi else arb.pi()) * before[-1]
        return cls(tuple(segments), tuple(before), _mirrored(_adjugate(now)) * now)

    def at(self, phase: arb, turns: int) -> arb_mat:
        """Y(phase + 2π turns)."""
        turn = 2 * arb.pi()
        while phase > arb.pi():
            phase, turns = phase - turn, turns + 1
        while phase < -arb.pi():
            phase, turns = phase + turn, turns - 1
        matrix = _mirrored(self._inside(-phase)) if phase < 0 else self._inside(phase)
        if turns == 0:
            return matrix
        power = _power(self.period, abs(turns))
        return matrix * (power if turns > 0 else _adjugate(power))

    def inverse(self, phase: arb) -> arb_mat:
        """Y(phase)⁻¹."""
        return _adjugate(self.at(phase, 0))

    def _inside(self, phase: arb) -> arb_mat:
        """Y at 0 ≤ phase ≤ π, or about there."""
        number = max(0, bisect_right(self.segments, float(phase), key=lambda segment: segment.disc.left) - 1)
        return self.segments[number].at(phase) * self.before[number]


def _series(
    system: System2, first: Quadratic, second: Quadratic, start: tuple[arb, ...], length: int, bits: int
) -> tuple[arb_poly, arb_poly]:
    """The first ``length`` Taylor coefficients of u and V from (u, U, V, W) at z = 0, the first in ``bits`` bits."""
    (p, p1, p2), (q, q1, q2) = ((a, b / a, c / a) for a, b, c in (first, second))
    k_p, k_pq, skew = system.torque / p, system.torque / (p * q), system.skew
    skew_p, skew_q, skew_pq = skew * p, skew / q, skew * p / q
    half_p, half_q = p1 / 2, q1 / 2
    # each preceded by two zeros: the solution, its quotients by P/p and by w, and the quotients by Q/q
    solution = u, _, v, w = tuple([arb(0), arb(0), value] for value in start)
    over_p = u_p, uu_p, v_p, w_p = tuple([arb(0), arb(0)] for _ in solution)
    over_w = u_w, uu_w, v_w, w_w = tuple([arb(0), arb(0)] for _ in solution)
    for_v, for_w = [arb(0), arb(0)], [arb(0), arb(0)]
    for begin in range(0, length - 1, _BLOCK):
        with working_precision(max(_BOUND_BITS, bits + _GUARD - _RATIO_BITS * begin)):
            for n in range(begin, min(begin + _BLOCK, length - 1)):
                for solution_values, quotient in zip(solution, over_p, strict=True):
                    quotient.append(solution_values[-1] - p1 * quotient[-1] - p2 * quotient[-2])
                for solution_values, quotient in zip(solution, over_w, strict=True):
                    quotient.append(solution_values[-1] - quotient[-2])
                term, coupled = half_q * v[-1] + q2 * v[-2], k_pq * (u_p[-1] + u_p[-3]) + skew_q * uu_w[-1]
                for_v.append(term + coupled - q1 * for_v[-1] - q2 * for_v[-2])
                term, coupled = half_q * w[-1] + q2 * w[-2], skew_pq * (u_w[-1] + p1 * u_w[-2] + p2 * u_w[-3])
                for_w.append(term + coupled + k_pq * uu_p[-1] - q1 * for_w[-1] - q2 * for_w[-2])
                term, coupled = half_p * uu_p[-1] + p2 * uu_p[-2], v_w[-1] + p1 * v_w[-2] + p2 * v_w[-3]
                slopes = (
                    k_p * v_p[-1] - skew * w_w[-1],
                    term + uu_w[-2] + k_p * (w_p[-1] + w_p[-3]) - skew_p * coupled,
                    v_w[-2] - for_v[-1],
                    half_p * w_p[-1] + p2 * w_p[-2] - for_w[-1],
                )
                for values, slope in zip(solution, slopes, strict=True):
                    values.append(slope / (n + 1))
    return arb_poly(u[2:]), arb_poly(v[2:])


def _power(matrix: arb_mat, exponent: int) -> arb_mat:
    """matrix^exponent for any exponent > 0: FLINT's own takes 64 bits."""
    power = matrix
    for bit in f"{exponent:b}"[1:]:
        power = power * power
        if bit == "1":
            power = power * matrix
    return power


def _adjugate(matrix: arb_mat) -> arb_mat:
    """The inverse of a matrix of determinant 1."""
    one, two, three, four = matrix.entries()
    return arb_mat([[four, -two], [-three, one]])


def _mirrored(matrix: arb_mat) -> arb_mat:
    """J Y J."""
    one, two, three, four = matrix.entries()
    return arb_mat([[one, -two], [-three, four]])
