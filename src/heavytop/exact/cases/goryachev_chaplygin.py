"""Goryachev-Chaplygin: I1 = I2 = 4 I3, c = 0, M·γ = 0, by inversion of Abel's integrals; Sretensky's gyrostat too.

Sretensky's gyrostat is that top with a rotor along axis 3, on M·γ = 0 with M = IΩ + k.  The centre of mass may lie
anywhere in the plane of the equal moments, and γ ≠ 0 have any length.  The separated variables move along a straight
line in Abel's integrals, at a cost that does not depend on the time; the attitude is one more integral.

Levels where f has a multiple root are found exactly.  A multiple root outside both gaps needs no special case.  Where
one variable tends to it the motion is asymptotic (:mod:`heavytop.exact.separable.oscillation`), and one variable may
rest on it (:mod:`heavytop.exact.separable.abel`).  Motions where both variables tend to it (G = 0; without a rotor:
:mod:`heavytop.exact.cases.goryachev_chaplygin_rest`) or both rest are refused; so are motions so near to them that the
Fourier series do not resolve them, with the distance.  Source: Chaplygin, Trudy otd. fiz. nauk 12 (1904); L. N.
Sretensky, Doklady Akad. Nauk SSSR 149 (1963) 292.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import acb, arb, arb_mat, arb_series, fmpq_poly
from numpy.typing import NDArray

from heavytop.errors import LevelNotDone, OutOfReach
from heavytop.exact.cases.lagrange import Reduced, polynomial
from heavytop.exact.closed_form import ClosedForm, cached_per_precision, constant
from heavytop.exact.flint.balls import (
    BallLike,
    Balls,
    Undecided,
    ball,
    current_length,
    series_length,
    the_only,
    working_precision,
)
from heavytop.exact.separable.abel import (
    REMEDY,
    Factor,
    Inversion,
    Line,
    LineIntegral,
    Rest,
    Symmetry,
    Variable,
    alternate,
    counts,
    decide,
    error_of,
    ordered,
    points,
    refuse,
    variable_between,
)
from heavytop.exact.separable.oscillation import MOST_TERMS, Bearing, Gap, WithBearing, distance_of_others
from heavytop.exact.solution import AXIAL_ROTOR, GAMMA, LEVEL_MOMENTUM, plane_top
from heavytop.top.equations import HEAVY_GYROSTAT, Parameters, sretensky

# The exact level of a Goryachev-Chaplygin or Sretensky start, the roots of its curve, and u1, u2 there.
#
# Notation as above.


class GoryachevLevel(Reduced):
    """The exact level of a start."""

    __slots__ = ()

    @property
    def energy(self) -> Fraction:
        """h, the energy less λ²/2."""
        w1, w2, w3 = self.omega
        return 2 * (w1 * w1 + w2 * w2) + (w3 * w3 - self.rotor * self.rotor) / 2 + self.along(self.gamma)

    @property
    def axial_momentum(self) -> Fraction:
        """ρ = r + λ."""
        return self.omega[2] + self.rotor

    @property
    def third(self) -> Fraction:
        """G, Sretensky's integral: without a rotor Goryachev and Chaplygin's."""
        parameters = Parameters((4, 4, 1), (*self.moment, 0), (0, 0, self.rotor))
        return Fraction(sretensky(parameters, (*self.omega, *self.gamma), (0, 1, 2)))

    def sextic(self) -> fmpq_poly:
        """f."""
        zero, square = Fraction(0), self.moment_square * self.gamma_square
        cubic = polynomial(-4 * self.third, -2 * self.energy, -2 * self.rotor, Fraction(1))
        return polynomial(zero, zero, 4 * square) - cubic * cubic

    def separated(self) -> fmpq_poly:
        """u² − ρ u − 4s, with the roots u1, u2."""
        w1, w2, _ = self.omega
        return polynomial(-4 * (w1 * w1 + w2 * w2), -self.axial_momentum, Fraction(1))

    def resting(self) -> Fraction | None:
        """The double root of f at which u1 or u2 rests; 0 where both rest, None where none does."""
        sextic = self.sextic()
        common = self.separated().gcd(sextic.gcd(sextic.derivative()))
        if common.degree() != 1:
            return Fraction(0) if common.degree() == 2 else None
        root = -common[0] / common[1]
        return Fraction(int(root.p), int(root.q))


@dataclass(frozen=True, slots=True)
class Root:
    """A root of f.  counts: its multiplicities as a root of au − X and of au + X."""

    value: acb
    counts: tuple[int, int]

    @property
    def multiplicity(self) -> int:
        """The multiplicity as a root of f."""
        return sum(self.counts)


def roots(level: GoryachevLevel) -> list[Root]:
    """The roots of f at the working precision; raises Undecided where it does not determine their factor."""
    h, constant, a = ball(level.energy), 4 * ball(level.third), size_of(level)
    rotor = ball(level.rotor)
    roots_in_order: list[Root] = []
    pairs: Any = level.sextic().complex_roots()
    for value, many in pairs:
        if value.is_zero():
            roots_in_order.append(Root(acb(value), (many // 2, many - many // 2)))
            continue
        cubics = [value * (value * (value - 2 * rotor) - 2 * (h + side * a)) - constant for side in (1, -1)]
        of = [cubic.contains(0) for cubic in cubics]
        if sum(of) != 1:
            raise Undecided
        roots_in_order.append(Root(acb(value), (many * of[0], many * of[1])))
    return roots_in_order


def size_of(level: GoryachevLevel) -> arb:
    """a = c|γ|."""
    return ball(level.moment_square * level.gamma_square).sqrt()


def separated_start(level: GoryachevLevel) -> tuple[arb, arb]:
    """u1, u2 at t = 0; the smaller one follows from the product, without cancellation."""
    (w1, w2, _), axial = level.omega, level.axial_momentum
    square = w1 * w1 + w2 * w2
    larger = (abs(ball(axial)) + ball(axial * axial + 16 * square).sqrt()) / 2
    smaller = 4 * ball(square) / larger
    return (larger, -smaller) if axial >= 0 else (smaller, -larger)


def gap_ends(level: GoryachevLevel, curve: Sequence[Root], values: Sequence[arb]) -> list[tuple[int, int]]:
    """The indices of the two real roots between which u1 and u2 move; twice the same index for a variable at rest.

    Raises Undecided where the balls do not determine them.
    """
    resting = _resting(level, curve)
    real = [i for i in ordered([root.value for root in curve]) if i not in resting.values()]
    allowed, ends = alternate(real, [root.multiplicity for root in curve], False), []
    for k, u in enumerate(values):
        holding = [pair for pair in allowed if not (u < curve[pair[0]].value.real or u > curve[pair[1]].value.real)]
        ends.append((resting[k], resting[k]) if k in resting else the_only(holding))
    return ends


def _resting(level: GoryachevLevel, curve: Sequence[Root]) -> dict[int, int]:
    """The index of the double root at which a variable rests, by that variable."""
    double_root = level.resting()
    if double_root is None:
        return {}
    coinciding = [
        i for i, root in enumerate(curve) if root.multiplicity > 1 and root.value.overlaps(acb(ball(double_root)))
    ]
    return {0 if double_root > 0 else 1: the_only(coinciding)}


# Goryachev and Chaplygin's top, and Sretensky's gyrostat, by real Abel inversion: the state from two phases.
#
# With I = (4, 4, 1), a rotor k = (0, 0, λ), λ = 0 for the top, n = (c, 0, 0) (:mod:`heavytop.exact.cases.lagrange`), on
# M·γ = 0, with s = p² + q², ρ = r + λ = M3 and a = c|γ|
#
#     h = 2s + r²/2 + cγ1 − λ²/2,   G = (r − λ) s − c p γ3,   u1,2 = ½ (ρ ± √(ρ² + 16 s)),   u1 ≥ 0 ≥ u2
#     X(u) = ½ (u³ − 2λ u² − 2h u − 4G)
#     x_k = X(u_k) = c (2pγ3 − γ1 u_k),   y_k = u_k' (u_k − u_other) = c (2qγ3 − γ2 u_k),   x_k² + y_k² = a² u_k²
#     f(u) = a² u² − X² = (au − X)(au + X),   y_k² = f(u_k),   Σ du/y = 0,   Σ u du/y = dt
#
# f has rational coefficients.  u_k = m + d cos θ_k, f = (u − lo)(hi − u) g
# (:mod:`heavytop.exact.separable.oscillation`),
#
#     θ1' = −√g1/(u1 − u2),   θ2' = −√g2/(u1 − u2),   G_0 constant,   G_1 → G_1 − t   (ε1 = 1, ε2 = −1)
#
# With α_k = √|au_k − X(u_k)|, β_k = √|au_k + X(u_k)|, analytic in θ_k, y1 = α1 β1, y2 = −α2 β2, and one sign σ for the
# whole motion
#
#     r = u1 + u2 − λ    p = σ (α1β2 + α2β1)/(4a)           q = −σ (β1β2 − α1α2)/(4a)
#     γ1 = −(X(u1) − X(u2))/(c (u1 − u2))     γ2 = −(α1β1 + α2β2)/(c (u1 − u2))     γ3 = −σ (α1β2 − α2β1)/(c (u1 − u2))
#
# so that turning points need no special case.  σ is found by exclusion at the start.
# Source: Chaplygin, Trudy otd. fiz. nauk 12 (1904); L. N. Sretensky, Doklady Akad. Nauk SSSR 149 (1963) 292.
# Signs, recovery and the place of λ derived here from the integrals (tests/exact/test_sretensky.py).


_MINUS, _PLUS = 0, 1
"""The factors au − X and au + X of f."""


@dataclass(frozen=True, slots=True)
class GoryachevMotion:
    """The motion of a level at one working precision.

    moment, size: c and a.  ends: indices of the roots at both ends of each gap.  sign: σ.
    """

    level: GoryachevLevel
    moment: arb
    size: arb
    curve: tuple[Root, ...]
    ends: tuple[tuple[int, int], ...]
    line: Line
    sign: int

    @classmethod
    def of(cls, level: GoryachevLevel) -> GoryachevMotion:
        """The motion at the working precision.

        Raises Undecided where that does not suffice, OutOfReach where the Fourier series need too many terms.
        """
        curve, values = roots(level), separated_start(level)
        ends = gap_ends(level, curve, values)
        branch = [(root.value, root.multiplicity) for root in curve]
        gaps = tuple(variable_between(pair, branch, arb(1) / 4, MOST_TERMS) for pair in ends)
        c, a = ball(level.moment_square).sqrt(), size_of(level)
        start = level.turned()
        speeds = [c * (2 * start[1] * start[5] - start[4] * u) for u in values]
        # du/dθ is −y1/√g1 and y2/√g2
        slopes = -speeds[0] * gaps[0].density(values[0]), speeds[1] * gaps[1].density(values[1])
        phases = [gap.phase(u, slope) for gap, u, slope in zip(gaps, values, slopes, strict=True)]
        line = Line.of(gaps, (1, -1), (0, -1), phases)
        with series_length(1):
            possible = []
            for sign in (1, -1):
                motion = cls(level, c, a, tuple(curve), tuple(ends), line, sign)
                position = motion.turned([arb_series([phase], prec=1) for phase in phases], [0, 0])
                if all(one[0].overlaps(other) for one, other in zip(position, start, strict=True)):
                    possible.append(motion)
        return the_only(possible)

    def at(self, time: Fraction, length: int) -> list[BallLike]:
        """The six components at ``time``, numbers, or series in t of that length.

        Raises Undecided where the working precision does not prove the phases.
        """
        phases, turns = self.phases(time)
        with series_length(length):
            moving = self.line.series(phases, self._rates)
            return self.level.restored(self.turned(moving, turns))

    def phases(self, time: Fraction) -> tuple[list[arb], list[int]]:
        """The phases at ``time`` in the first turns, and whole turns, as :meth:`Line.phases`."""
        return self.line.phases(ball(time * self.level.rate))

    def _rates(self, u1: Balls, u2: Balls) -> list[Balls]:
        """θ1' and θ2'."""
        return [
            u * 0 if isinstance(gap, Rest) else -1 / ((u1 - u2) * gap.density(u))
            for gap, u in zip(self.line.variables, (u1, u2), strict=True)
        ]

    def turned(self, phases: Sequence[Balls], turns: Sequence[int]) -> list[Balls]:
        """The six components in the turned frame."""
        (u1, a1, b1), (u2, a2, b2) = (self.halves(k, phases[k], turns[k]) for k in (0, 1))
        h, rotor, apart = ball(self.level.energy), ball(self.level.rotor), 1 / (self.moment * (u1 - u2))
        quarter = self.sign / (4 * self.size)
        # (X(u1) − X(u2))/(u1 − u2)
        slope = (u1 * u1 + u1 * u2 + u2 * u2) / 2 - rotor * (u1 + u2) - h
        return [
            quarter * (a1 * b2 + a2 * b1),
            quarter * (a1 * a2 - b1 * b2),
            u1 + u2 - rotor,
            -slope / self.moment,
            -(a1 * b1 + a2 * b2) * apart,
            -self.sign * (a1 * b2 - a2 * b1) * apart,
        ]

    def halves(self, variable: int, phase: Balls, turns: int) -> tuple[Balls, Balls, Balls]:
        """(u, α, β), at a phase of the first turn or a series there."""
        gap, (low, high) = self.line.variables[variable], self.ends[variable]
        u, side = gap.position(phase), -1 if turns % 2 else 1
        at_end = dict(zip((low, high), gap.ends(phase), strict=True))
        half_periods = []
        for factor in (_MINUS, _PLUS):
            value, others = phase * 0 + 1, phase * 0 + arb(1) / 2
            for number, root in enumerate(self.curve):
                if root.counts[factor] and number in at_end:
                    # no power: FLINT would take the logarithm of 0 at a turning point
                    value *= side * at_end[number] * (at_end[number] if root.counts[factor] > 1 else 1)
                elif root.counts[factor]:
                    others *= _distance(u, root.value, root.counts[factor], gap.middle)
            half_periods.append(value * others.sqrt())
        # y_k = ±α_k β_k has the sign of −du/dθ
        return u, -half_periods[0] if constant(gap.bend(phase)) < 0 else half_periods[0], half_periods[1]


def _distance(u: BallLike, root: acb, many: int, middle: arb) -> Any:
    """|u − root|^many for a real root, its square for a pair once; 1 for the other of the pair."""
    if root.imag.is_zero():
        return (u - root.real if root.real < middle else root.real - u) ** many
    if root.imag < 0:
        return 1
    return ((u - root.real) ** 2 + root.imag**2) ** many


# Attitude of Goryachev and Chaplygin's top and of Sretensky's gyrostat: the azimuth of M, by Fourier series.
#
# On M·γ = 0 the angular momentum is level, and M' = γ × n in space turns it about γ at the rate |γ| n·M/M².  In the
# notation above, M = (4p, 4q, ρ), M² = 16 s + ρ² = (u1 − u2)², its azimuth
# has
#
#     Λ' = 4ap/(u1 − u2)² = σ (α1β2 + α2β1)/(u1 − u2)².
#
# With ds = −dt/(u1 − u2) each phase moves by itself, dθ_k = √g_k ds, and φ_k = F_k0(θ_k)/c_k uniformly at the rate
# 1/c_k, where c_k is the mean of 1/√g_k over a turn.  Λ is then the integral of
#
#     dΛ/ds = −σ (α1β2 + α2β1)/(u1 − u2)
#
# along a straight line (:mod:`heavytop.exact.separable.abel`), at any time.  No vector of the state has an azimuth that
# splits into integrals of one variable each: Λ would then grow alike along all closed motions of a resonant torus, and
# the coefficients of the resonant terms of dΛ/ds do not vanish there
# (tests/exact/test_goryachev_chaplygin_attitude.py).
#
# Strips.  In s, up to signs, u' = αβ, α' = ½ (a − X'(u)) β, β' = ½ (a + X'(u)) α, X'(u) = 3u²/2 − 2λu − h: polynomials.
# From any real s the solution continues to s + iy, and stays within (A, B, C) of its (u, α, β) at s, as long as
#
#     A' = (|α| + B)(|β| + C),   B' = ½ (|a − X'| + E)(|β| + C),   C' = ½ (|a + X'| + E)(|α| + B)
#
# with E = (3|u| + 2|λ|)A + 3A²/2
#
# has a finite solution from 0; so it is analytic on the strip where this holds from every real s.


_CELLS, _BOUND_BITS = 256, 64
_GROWTH, _STEPS = 30.0, 200
_ROUNDING = 1 + 1e-12
"""More than the rounding of a few sums and products of positive floats."""
_ROOM = 0.45
"""The share of the distance to the other gap that u1 and u2 may move on the strips."""


@dataclass(frozen=True, slots=True)
class Strip:
    """A strip |Im s| ≤ ``height`` on which u, α, β are analytic.

    largest: bounds of |α| and |β| there.
    """

    height: float
    largest: tuple[float, float]

    @classmethod
    def of(cls, motion: GoryachevMotion, gap: Gap, other: arb) -> Strip:
        """The strip on which u moves by less than _ROOM of its distance to ``other``, the end of the other gap."""
        middle, alpha, beta, less, more, away = _sizes(motion, gap, other)
        room, twice = _ROOM / _ROUNDING * away, 2 * _ROUNDING * float(abs(motion.level.rotor))
        distances = [np.zeros(_CELLS)] * 3
        scale, height, grown = alpha.max() + beta.max(), 0.0, distances

        def rates(near: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
            a, b, c = near
            excess, first, second = (3 * middle + twice) * a + 1.5 * a * a, alpha + b, beta + c
            return [first * second, (less + excess) * second / 2, (more + excess) * first / 2]

        for _ in range(5 * _STEPS):
            sizes = room, scale + distances[1], scale + distances[2]
            # a step of the solution stays below a bound that no point of its own step exceeds
            wide = [x + size / _STEPS for x, size in zip(distances, sizes, strict=True)]
            slopes = rates(wide)
            step = min(float((size / slope).min()) for size, slope in zip(sizes, slopes, strict=True)) / _STEPS
            distances = [_ROUNDING * (x + step * slope) for x, slope in zip(distances, slopes, strict=True)]
            if (distances[0] > room).any() or max(distances[1].max(), distances[2].max()) > _GROWTH * scale:
                break
            height, grown = height + step / _ROUNDING, distances
        return cls(height, (float((alpha + grown[1]).max()), float((beta + grown[2]).max())))


def _sizes(motion: GoryachevMotion, gap: Gap, other: arb) -> NDArray[np.float64]:
    """Upper bounds on |u|, |α|, |β|, |a − X'| and |a + X'| on cells of the gap, and a lower one on |u − ``other``|."""
    rows = []
    with working_precision(_BOUND_BITS):
        a, h, constant = motion.size, ball(motion.level.energy), 2 * ball(motion.level.third)
        rotor, half = ball(motion.level.rotor), arb.pi() / (2 * _CELLS)
        for i in range(_CELLS):
            u = gap.position((2 * i + 1) * half + arb(0, half.upper()))
            center, spread = u.mid(), arb(0, u.rad())
            slope = (3 * u / 2 - 2 * rotor) * u - h
            value = center * ((center / 2 - rotor) * center - h) - constant
            squares = [abs(a * center - side * value + (a - side * slope) * spread) for side in (1, -1)]
            row = [abs(u), *(square.upper().sqrt() for square in squares), abs(a - slope), abs(a + slope)]
            rows.append([_ROUNDING * float(x.upper()) for x in row] + [float(abs(u - other).lower()) / _ROUNDING])
    return np.array(rows).transpose()


@dataclass(frozen=True, slots=True)
class Uniform:
    """The phase φ of one variable.

    gap: with the integral F_0 alone; None for a variable at rest.  width: of the strip in φ; None at rest.
    """

    gap: Gap | None
    width: arb | None
    largest: tuple[float, float]

    @classmethod
    def of(cls, motion: GoryachevMotion, variable: Variable, other: arb) -> Uniform:
        """The uniform phase of a variable.

        other: the end of the other gap.  Raises OutOfReach for a variable that tends to a double root.
        """
        if isinstance(variable, Rest):
            size, middle = motion.size, abs(variable.middle)
            bound = float((2 * size * middle).sqrt().upper()) * _ROUNDING
            return cls(None, None, (bound, bound))
        if not isinstance(variable, Gap):
            raise OutOfReach("The azimuth of an asymptotic motion is not implemented.", "Request the state alone.")
        low, high = variable.middle - variable.reach, variable.middle + variable.reach
        gap, strip = Gap(low, high, variable.rest, count=1), Strip.of(motion, variable, other)
        return cls(gap, (strip.height / gap.means[0]).lower(), strip.largest)

    @property
    def rate(self) -> arb:
        """dφ/ds."""
        return arb(0) if self.gap is None else 1 / self.gap.means[0]

    def phases(self, count: int) -> list[arb]:
        """θ at the points of φ."""
        if self.gap is None:
            return [arb(0)]
        inversion, phases = Inversion((self.gap,), (1,)), []
        for angle in points(count):
            (phase,), (turns,) = inversion.phases([angle * self.gap.means[0]])
            phases.append(phase + 2 * arb.pi() * turns)
        return phases

    def passed(self, phase: arb, turns: int) -> arb:
        """s = F_0 at the phase after whole turns."""
        return arb(0) if self.gap is None else self.gap.integrals(phase)[0] + turns * self.gap.column[0]


@dataclass(frozen=True, slots=True)
class GoryachevChaplyginAttitude:
    """The azimuth Λ of M at one working precision.

    uniform: the phases φ.  began: s of both variables at t = 0.  integral: of dΛ/ds from there.
    """

    motion: GoryachevMotion
    uniform: tuple[Uniform, Uniform]
    began: list[arb]
    integral: LineIntegral

    @classmethod
    def of(cls, motion: GoryachevMotion) -> GoryachevChaplyginAttitude:
        """The azimuth of ``motion``, at its working precision.

        Raises Undecided where that does not suffice, OutOfReach for Fourier series of too many terms and for asymptotic
        motions.
        """
        first, second = motion.line.variables
        above, below = first.middle - _reach(first), second.middle + _reach(second)
        if not above > below:
            raise Undecided
        uniform = Uniform.of(motion, first, below), Uniform.of(motion, second, above)
        widths = [phase.width for phase in uniform]
        sizes, began = counts(widths), _passed(uniform, *motion.phases(Fraction(0)))
        halves = [
            [motion.halves(k, angle, 0) for angle in phase.phases(size)]
            for k, (phase, size) in enumerate(zip(uniform, sizes, strict=True))
        ]
        kernel = arb_mat([[-motion.sign / (u - v) for v, _, _ in halves[1]] for u, _, _ in halves[0]])
        alphas, betas = (
            [Factor(_symmetry(motion, k, factor), [half[factor + 1] for half in halves[k]]) for k in (0, 1)]
            for factor in (0, 1)
        )
        # a bound on either term of |dΛ/ds| on the strips, with a lower bound on |u1 − u2| there
        (alpha1, beta1), (alpha2, beta2) = (phase.largest for phase in uniform)
        largest = arb(max(alpha1 * beta2, beta1 * alpha2)) / ((1 - 2 * arb(_ROOM)) * (above - below))
        pairs, rates = [(alphas[0], betas[1]), (betas[0], alphas[1])], [phase.rate for phase in uniform]
        angles = [rate * s for rate, s in zip(rates, began, strict=True)]
        error = error_of(largest, widths, sizes)
        return cls(motion, uniform, began, LineIntegral.of(pairs, kernel, rates, angles, largest, error))

    def bearing(self, time: Fraction) -> Bearing:
        """M in the top's own axes, and Λ.  Raises Undecided where the working precision does not prove the phases."""
        phases, turns = self.motion.phases(time)
        passed = _passed(self.uniform, phases, turns)
        # the same for both, unless one is at rest
        moving = 1 if self.uniform[0].gap is None else 0
        angles = [phase.rate * s for phase, s in zip(self.uniform, passed, strict=True)]
        p, q, r, *gamma = self.motion.turned(phases, turns)
        level, rotor = self.motion.level, ball(self.motion.level.rotor)
        azimuth = self.integral.at(angles, passed[moving] - self.began[moving])
        return Bearing.of(level.in_body(gamma), level.in_body([4 * p, 4 * q, r + rotor]), azimuth)


def _passed(uniform: Sequence[Uniform], phases: Sequence[arb], turns: Sequence[int]) -> list[arb]:
    """s of both variables."""
    return [variable.passed(phase, turn) for variable, phase, turn in zip(uniform, phases, turns, strict=True)]


def _reach(variable: Variable) -> arb:
    return variable.reach if isinstance(variable, Gap) else arb(0)


def _symmetry(motion: GoryachevMotion, variable: int, factor: int) -> Symmetry:
    """The symmetry of α or β: √(2d) cos(θ/2) at the lower end of the gap, √(2d) sin(θ/2) at the upper one."""
    low, high = motion.ends[variable]
    at_low, at_high = (low != high and motion.curve[number].counts[factor] > 0 for number in (low, high))
    return Symmetry(odd=at_high, half=at_low != at_high)


_DISTANCE = 1e-5
"""cosh β − 1 (:mod:`heavytop.exact.separable.oscillation`) where the Fourier series take nearly 2^17 terms for 50
digits.
"""


@dataclass(frozen=True, slots=True)
class GoryachevChaplygin(WithBearing, ClosedForm):
    """A motion of the Goryachev-Chaplygin top with the small moment on axis 3.

    Raises NotInClass unless I1 = I2 = 4 I3, P c = 0, P r ≠ 0, M·γ = 0 and γ ≠ 0, and on the levels not covered.
    """

    method = "closed form: Goryachev-Chaplygin, inversion of Abel's integrals"
    source = "S. A. Chaplygin, Trudy otd. fiz. nauk 12 (1904)"
    body = plane_top(4)
    starts = GAMMA, LEVEL_MOMENTUM

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        _require_done(GoryachevLevel.of(self.top, self.start))

    def evaluate(self, time: Fraction) -> list[BallLike]:
        return _motion(self).at(time, current_length())

    def bearing(self, time: Fraction) -> Bearing:
        """The bearing of M; raises OutOfReach for asymptotic motions and for very many digits."""
        return _attitude(self).bearing(time)


@dataclass(frozen=True, slots=True)
class Sretensky(GoryachevChaplygin):
    """A motion of Sretensky's gyrostat with the small moment and the rotor on axis 3.

    Raises NotInClass unless I1 = I2 = 4 I3, P c = 0, P r ≠ 0, k1 = k2 = 0, M·γ = 0 with M = IΩ + k, and γ ≠ 0, and on
    the levels not covered.
    """

    method = "closed form: Sretensky's gyrostat, inversion of Abel's integrals"
    source = "L. N. Sretensky, Doklady 149 (1963) 292"
    system = HEAVY_GYROSTAT
    body = *GoryachevChaplygin.body, AXIAL_ROTOR


@cached_per_precision
def _attitude(case: GoryachevChaplygin) -> GoryachevChaplyginAttitude:
    return GoryachevChaplyginAttitude.of(_motion(case))


@cached_per_precision
def _motion(case: GoryachevChaplygin) -> GoryachevMotion:
    return GoryachevMotion.of(GoryachevLevel.of(case.top, case.start))


def _require_done(level: GoryachevLevel) -> None:
    """Raise NotInClass on the levels that are not covered, and too near to them."""
    resting = level.resting()
    if resting == 0:
        raise LevelNotDone("The level is degenerate: both separated variables rest, or one rests at 0.", REMEDY)

    def test() -> None:
        curve = roots(level)
        ends = gap_ends(level, curve, separated_start(level))
        # 0 is a root of both factors only, once of each, or more often for h = ±a
        if any(min(curve[number].counts) > 0 for pair in ends for number in pair):
            raise LevelNotDone("The level is degenerate: G = 0, one or both separated variables tend to 0.", REMEDY)
        moving = [(low, high) for low, high in ends if low != high]
        if resting is not None and not any(
            curve[low].value.real > ball(resting) or curve[high].value.real < ball(resting) for low, high in moving
        ):
            raise LevelNotDone("The level is degenerate: one variable rests, and the other passes it.", REMEDY)
        apart = min((distance_of_others([root.value for root in curve], pair) for pair in moving), key=arb.mid)
        if not apart > _DISTANCE:
            refuse("The level is degenerate", apart, "a root from an oscillation interval")

    decide(test)
