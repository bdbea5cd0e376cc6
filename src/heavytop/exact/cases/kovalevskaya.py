"""Kovalevskaya's top, I1 = I2 = 2 I3, c = 0: every start but those on three kinds of degenerate levels.

The centre of mass may lie anywhere in the plane of the equal moments, and γ ≠ 0 have any length.  The two separated
variables (:mod:`heavytop.exact.cases.kovalevskaya_theta`) move along a straight line in Abel's integrals, which are
inverted in balls: the cost does not depend on the time.  Near levels where
the curve has a multiple root the Fourier series there grow like the root of the distance; where they need more than
2^14 terms, theta functions of two variables take over (:mod:`heavytop.exact.cases.kovalevskaya_theta`), down to a
distance of two roots of 2^-27 of the largest.  Nearer than that the motion is refused, with the distance, and the
enclosure applies.

Levels where the quintic has a multiple root, found exactly (Appelrot, Trudy otd. fiz. nauk 16 (1911)):

    k = 0                            Delone's class, elliptic: :mod:`heavytop.exact.cases.delone`
    double root outside both gaps    no special case, at any distance from it
    double root at an end of a gap   asymptotic motions (:mod:`heavytop.exact.separable.oscillation`)
    a variable at rest on it         Appelrot's especially remarkable motions (:mod:`heavytop.exact.separable.abel`);
                                     refused if the other variable passes it
    common end of both gaps          both variables tend to it: refused
    double root of the cubic         refused

Source: S. Kovalevskaya, Acta Math. 12 (1889) 177; recovery of Ω and γ without Kötter's formulas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations, pairwise
from typing import Any

from flint import acb, acb_series, arb, arb_series

from heavytop.errors import LevelNotDone, NotInClass, OutOfReach
from heavytop.exact.cases.kovalevskaya_theta import (
    ORDERS,
    KovalevskayaLevel,
    PhiRoot,
    ThetaMotion,
    WorkingStart,
    linear,
    real_part,
    roots,
    separation,
    start_of,
)
from heavytop.exact.closed_form import ClosedForm, cached_per_precision
from heavytop.exact.flint.balls import (
    BallLike,
    Balls,
    ball,
    coefficient,
    current_length,
    series_length,
    the_only,
    to_bits,
)
from heavytop.exact.separable.abel import (
    REMEDY,
    Line,
    Rest,
    Variable,
    alternate,
    decide,
    ordered,
    refuse,
    variable_between,
)
from heavytop.exact.separable.oscillation import Approach, Azimuth, Bearing, Gap, WithBearing, distance_of_others
from heavytop.exact.solution import GAMMA, NOT_XI, plane_top
from heavytop.precision import shown

# Where Kovalevskaya's two variables move on the curve of a level, and the pole of v = 1/(w − μ).
#
# w1 starts in (−∞, lowest root], or like w2 between two roots where φ ≤ 0.  Which it is, the exact start decides, in
# balls that meet one closed interval only.


_SHARES = (0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98)
_BEYOND = (0.05, 0.3, 1.0, 3.0, 10.0)
Interval = tuple[int, int]
"""Numbers of the branch points at the lower and upper end in v; 0 is v = 0, j is root number j − 1."""


def intervals(level: KovalevskayaLevel, curve: Sequence[PhiRoot], start: WorkingStart) -> tuple[Interval, Interval]:
    """The ranges of w1 and w2: pairs of indices of branch points, (lower, upper) in v and so (upper, lower) in w.

    Twice the same index for a variable at rest at a double root.
    Raises Undecided where the balls do not determine them.
    """
    resting = _resting(level, curve, start)
    first, second = (
        (resting[k] + 1, resting[k] + 1) if k in resting else interval_of(k, curve, start, [*resting.values()])
        for k in (0, 1)
    )
    return first, second


def interval_of(variable: int, curve: Sequence[PhiRoot], start: WorkingStart, resting: Sequence[int] = ()) -> Interval:
    """The range of w1 (variable 0) or w2, as in :func:`intervals`; resting: roots at which another variable rests."""
    real = [i for i in ordered([root.value for root in curve]) if i not in resting]
    between = alternate(real, [root.multiplicity for root in curve], True)
    holding = [
        (upper, lower)
        for upper, lower in [(real[0] + 1, 0), *((high + 1, low + 1) for low, high in between)]
        if not (lower > 0 and start.above(variable, curve[lower - 1].value.real) < 0)
        and not start.above(variable, curve[upper - 1].value.real) > 0
    ]
    return the_only(holding)


def _resting(level: KovalevskayaLevel, curve: Sequence[PhiRoot], start: WorkingStart) -> dict[int, int]:
    """The index of the double root at which a variable rests, by that variable."""
    double = [i for i, root in enumerate(curve) if root.multiplicity > 1]
    if not double or level.separated(level.double()) != 0:
        return {}
    return {the_only([k for k in (0, 1) if start.above(k, curve[double[0]].value.real).contains(0)]): double[0]}


def pole(curve: Sequence[PhiRoot], occupied: Sequence[Interval]) -> tuple[arb, float]:
    """μ outside both gaps for which the branch points in v are farthest from the gaps, and that distance."""
    real = ordered([root.value for root in curve])
    occupied_pairs = {(upper - 1, lower - 1) for upper, lower in occupied}
    lowest, highest = (curve[i].value.real.mid() for i in (real[0], real[-1]))
    candidates = [highest + share * (highest - lowest) for share in _BEYOND]
    for low, high in pairwise(real):
        if (high, low) not in occupied_pairs:
            start, width = curve[low].value.real.mid(), (curve[high].value.real - curve[low].value.real).mid()
            candidates += [start + share * width for share in _SHARES]

    def distance(mu: arb) -> float:
        points = [acb(0), *(1 / (root.value - mu) for root in curve)]
        return min(float(distance_of_others(points, (low, high))) for low, high in occupied if low != high)

    distances = [distance(mu.mid()) for mu in candidates]
    best = max(range(len(candidates)), key=distances.__getitem__)
    return candidates[best].mid(), distances[best]


# Kovalevskaya's top by real Abel inversion: p, q, r from the phases of the two separated variables.
#
# w1 runs through infinity where q = 0, so v = 1/(w − μ) takes its place, μ a real number in neither gap.  With
# v_e = 1/(e − μ), c6 = −2 Π (μ − e) and Y² = c6 v Π (v − v_e) over the roots e of φ (:mod:`kovalevskaya_level`)
#
#     θ1' = √g1 v2/(v1 − v2),   θ2' = −√g2 v1/(v1 − v2),   G_0 → G_0 − t,   G_1 constant   (ε1 = ε2 = 1)
#
# Recovery.  For a root e_j of the cubic the form (w − w1)(w − w2)(x1 − x2)² is a square:
#
#     P_j = √((w1 − e_j)(w2 − e_j)) = α_j (X − e_j Z) + β_j Y,   X = x1x2/(x1 − x2),  Y = (x1 + x2)/(x1 − x2),
#     α_j² = 2(h + e_j),   β_j² = G + e_j²,   α_j β_j = −C,      Z = 1/(x1 − x2)
#
# three linear equations for X, Y, Z.  Let h_kb be a root of ±(v_k − b), analytic in θ_k: √(2d) sin(θ/2), √(2d) cos(θ/2)
# for the ends of the gap, √(v − b) or √|v − b| otherwise.  Then P_j = f_j (μ − e_j) h_1j h_2j/(h_10 h_20) with one
# f_j ∈ {1, i, −1, −i} for the whole motion, as both sides are meromorphic and have equal squares.  With
# κ_j = f_j (μ − e_j), (X, Y, Z) = 𝓜^−1 P, N = Σ Y_j κ_j h_1j h_2j, D = Σ Z_j κ_j h_1j h_2j
#
#     p = N/(2D),   q = h_10 h_20/(2i D)
#
# and r = 2p'/q, in which h_10 h_20 cancels term by term.  γ follows from q', r' and the energy:
#
#     γ3 = (2q' + pr)/c,   γ2 = −r'/c,   γ1 = (h − p² − q² − r²/2)/c
#
# f_j is found by exclusion: q P_j h_10 h_20 = q κ_j h_1j h_2j at the start, as power series in t of which one
# coefficient differs from 0 (turning points and q = 0 included: both at once make a zero of order 4); balls exclude the
# other f_j. Source: the squares are Kovalevskaya's and Kötter's; derived here, and checked by sympy for a generic
# level.


_UNITS = (acb(1), acb(0, 1), acb(-1), acb(0, -1))


@dataclass(frozen=True, slots=True)
class AbelMotion:
    """The motion of a level at one working precision.

    pole: μ.  branch: the branch points in v, number 0 is 0.  ends: of the gaps.  cubic: numbers of
    the three e_j.  rows: the rows of 𝓜^−1 for Y and Z, times κ_j.
    """

    level: KovalevskayaLevel
    start: WorkingStart
    pole: arb
    branch: tuple[acb, ...]
    ends: tuple[Interval, Interval]
    line: Line
    cubic: tuple[int, ...]
    rows: tuple[tuple[acb, ...], tuple[acb, ...]]

    @classmethod
    def of(cls, level: KovalevskayaLevel, most: int) -> AbelMotion:
        """The motion at the working precision.

        Raises Undecided where that does not suffice, OutOfReach for Fourier series of more than ``most`` terms.
        """
        start, curve = start_of(level), roots(level)
        ends = intervals(level, curve, start)
        mu, _ = pole(curve, ends)
        branch, lead = branch_points(curve, mu)
        points = [*zip(branch, (1, *(root.multiplicity for root in curve)), strict=True)]
        gaps = tuple(variable_between(interval, points, lead, most) for interval in ends)
        phases = start_phases(start, mu, gaps)
        line = Line.of(gaps, (1, 1), (-1, 0), phases)
        cubic = tuple(i for i, root in enumerate(curve, 1) if root.cubic)
        plain = cls(level, start, mu, branch, ends, line, cubic, ((), ()))
        return plain._with_factors(curve, mu, phases)

    def at(self, time: Fraction, length: int) -> list[BallLike]:
        """The six components at ``time``, numbers, or series in t of that length.

        Raises Undecided where the working precision does not prove the phases.
        """
        with series_length(length):
            return self.level.restored(self.reduced(*self.phases(time), length))

    def phases(self, time: Fraction) -> tuple[list[arb], list[int]]:
        """The phases at ``time`` in the first turns, and whole turns, as :meth:`Line.phases`."""
        return self.line.phases(ball(time * self.level.rate))

    def reduced(self, phases: Sequence[arb], turns: Sequence[int], length: int) -> tuple[Any, ...]:
        """The six components there in the turned frame, series in t' of that length or longer."""
        with series_length(length + 1):
            velocity = self._velocity(self.moving(phases), turns)
        return self.start.state(velocity, length)

    def approach(self, phases: Sequence[arb], turns: Sequence[int]) -> arb | None:
        """(log q √((w1 − e)(w2 − e)))' in t' where one variable tends to a double root e; None where none does.

        The argument of the logarithm tends to 0; its rate of change is as exact as the phases.
        """
        for variable, (low, high) in zip(self.line.variables, self.ends, strict=True):
            if not isinstance(variable, Approach):
                continue
            number = high if variable.length > 0 else low
            with series_length(2):
                first, second = (self.halves(k, x, turns[k]) for k, x in enumerate(self.moving(phases)))
                below = sum((a * (first[i] * second[i]) for a, i in zip(self.rows[1], self.cubic, strict=True)), acb(0))
                value = first[number] * second[number] / below
                return arb((coefficient(value, 1) / coefficient(value, 0)).real)
        return None

    def _speeds(self, v1: Balls, v2: Balls) -> tuple[Balls, Balls]:
        """θ1'/v2 and −θ2'/v1."""
        first, second = (
            v * 0 if isinstance(g, Rest) else 1 / ((v1 - v2) * g.density(v))
            for g, v in zip(self.line.variables, (v1, v2), strict=True)
        )
        return first, second

    def _rates(self, v1: Balls, v2: Balls) -> tuple[Balls, Balls]:
        """θ1' and θ2'."""
        first, second = self._speeds(v1, v2)
        return v2 * first, -v1 * second

    def moving(self, phases: Sequence[arb]) -> list[BallLike]:
        """The phases as power series in t."""
        return self.line.series(phases, self._rates)

    def halves(self, variable: int, phase: Any, turns: int) -> list[Any]:
        """h_kb at every branch point."""
        gap, ends = self.line.variables[variable], self.ends[variable]
        low, high = gap.ends(phase)
        side = -1 if turns % 2 else 1
        v, half_periods = gap.position(phase), []
        for number, b in enumerate(self.branch):
            if number in ends:
                half_periods.append(acb_series(side * (low if number == ends[0] else high)))
            elif b.imag.is_zero():
                half_periods.append(acb_series((self._side(variable, number) * (v - b.real)).sqrt()))
            else:
                half_periods.append((acb_series(v) - b).sqrt())
        return half_periods

    def _side(self, variable: int, number: int) -> int:
        """s with h² = s (v − b)."""
        low, high = self.ends[variable]
        b = self.branch[number]
        if number == low or not b.imag.is_zero():
            return 1
        return -1 if number == high or self.branch[low].real < b.real else 1

    def _velocity(self, phases: Sequence[Balls], turns: Sequence[int]) -> tuple[Balls, Balls, Balls]:
        """(p, q, r) from series of the phases."""
        first, second = (self.halves(k, phases[k], turns[k]) for k in (0, 1))
        products = [first[i] * second[i] for i in self.cubic]
        above, below = (sum((a * h for a, h in zip(row, products, strict=True)), acb_series([0])) for row in self.rows)
        half = 1 / (2 * below)
        p, q = above * half, first[0] * second[0] * half * acb(0, -1)
        return real_part(p), real_part(q), real_part(self._spin(phases, first, second) * half * acb(0, 4))

    def _spin(self, phases: Sequence[Any], first: Sequence[BallLike], second: Sequence[BallLike]) -> BallLike:
        """(N'D − ND')/(h_10 h_20)."""
        v1, v2 = (g.position(x) for g, x in zip(self.line.variables, phases, strict=True))
        speeds = self._speeds(v1, v2)
        # v2/h_20 = s h_20, and θ1' without its factor 1/h_10
        rates = (
            acb_series(speeds[0]) * second[0] * self._side(1, 0),
            acb_series(-speeds[1]) * first[0] * self._side(0, 0),
        )
        total = acb_series([0])
        for a, b in combinations(range(3), 2):
            i, j = self.cubic[a], self.cubic[b]
            weight = self.rows[0][a] * self.rows[1][b] - self.rows[0][b] * self.rows[1][a]
            for k, of_variable, of_other in ((0, first, second), (1, second, first)):
                if not isinstance(self.line.variables[k], Rest):
                    total += rates[k] * self._turn(k, phases[k], of_variable, i, j) * of_other[i] * of_other[j] * weight
        return total

    def _turn(self, variable: int, phase: Any, halves: Sequence[Any], i: int, j: int) -> Any:
        """(h_i' h_j − h_i h_j')/h_0, by θ: ½ s_i s_j (v_i − v_j) dv/dθ/(h_0 h_i h_j), in which the ends cancel."""
        low, high = self.ends[variable]
        signs = self._side(variable, i) * self._side(variable, j)
        value = acb_series(self.line.variables[variable].bend(phase))
        below = {0, i, j}
        for number in (low, high):
            if number not in below:
                value *= halves[number]
        for number in below - {low, high}:
            value /= halves[number]
        return value * (self.branch[i] - self.branch[j]) * (-signs) / 2

    def _with_factors(self, curve: Sequence[PhiRoot], mu: arb, phases: Sequence[arb]) -> AbelMotion:
        """κ_j, certified at the start."""
        start = self.start
        values = [root.value for root in curve if root.cubic]
        alphas, betas, inverse = linear(start, values)
        with series_length(ORDERS):
            p, q = (arb_series(x) for x in start.motion[:2])
            halves = [self.halves(k, phase, 0) for k, phase in enumerate(self.moving(phases))]
            ends = halves[0][0] * halves[1][0]
            kappas = []
            for i, a, b, e in zip(self.cubic, alphas, betas, values, strict=True):
                # q P_j, regular where q = 0
                form = (acb_series(p * p + q * q) - e) * a + acb_series(2 * p) * b
                left = form * ends * acb(0, -0.5)
                right = acb_series(q) * halves[0][i] * halves[1][i] * (mu - e)
                # P_j stays 0 at a root where a variable rests
                rests = (i, i) in self.ends
                kappas.append((mu - e) if rests else _fourth_root(left, right) * (mu - e))
        first, second = (tuple(inverse[row, j] * kappas[j] for j in range(3)) for row in (1, 2))
        return replace(self, rows=(first, second))


def _fourth_root(left: BallLike, right: BallLike) -> acb:
    """The one f in {1, i, −1, −i} with left = f right; raises Undecided where more than one can be."""
    sides = [(coefficient(left, n), coefficient(right, n)) for n in range(ORDERS)]
    return the_only([f for f in _UNITS if all((a - f * b).contains(0) for a, b in sides)])


def branch_points(curve: Sequence[PhiRoot], mu: arb) -> tuple[tuple[acb, ...], arb]:
    """The branch points in v, real where the roots are, number 0 at 0; and |c6|."""
    branch, lead = [acb(0)], arb(2)
    for root in curve:
        value = 1 / (root.value - mu)
        branch.append(acb(value.real) if root.value.imag.is_zero() else value)
        lead *= abs(mu - root.value) ** root.multiplicity
    return tuple(branch), lead


def start_phases(start: WorkingStart, mu: arb, variables: Sequence[Variable]) -> list[arb]:
    """θ1, θ2 at t = 0, modulo whole turns."""
    with series_length(ORDERS):
        v1, v2 = start.inverses(mu)
        apart = (v1 - v2)[0]
        # v2' goes to 0 with v1, to second order in t, where q = 0
        order = 2 if start.still else 0
        rates = v1.derivative()[0] / v2[0], -v2.derivative()[order] / v1[order]
        slopes = [rate * apart * g.density(v[0]) for rate, g, v in zip(rates, variables, (v1, v2), strict=True)]
    return [g.phase(v[0], slope) for g, v, slope in zip(variables, (v1, v2), slopes, strict=True)]


# Attitude of Kovalevskaya's top at any time: a level vector of the state whose azimuth is one more Abel integral.
#
# With I = (2, 2, 1), n = (c, 0, 0), γ^ = γ/|γ|, a = c|γ|, l = M·γ^, s = p² + q² and h, k, w1, w2 as in
# :mod:`heavytop.exact.cases.kovalevskaya_theta`, e = l²/2 − h (:meth:`Level.double`), the vector
#
#     v1 = r (l²/2 − 2p²) + γ^3 (2ap − l (h + q² − p²))
#     v2 = −2pqr − a l γ^2γ^3 + 2l pq γ^3 + l r (pγ^2 − qγ^1)
#     v3 = l (k² − s²)/a + 2p (s + e)
#
# is level, v·γ = 0, v² = −4q² (w1 − e)(w2 − e), and its azimuth Λ in space about γ has
#
#     Λ' = (l/2) (1 − (e² − k²)/((w1 − e)(w2 − e))),   dΛ = (l/2) Σ (w² − k²)/(w − e) dw/y
#
# along both commuting flows: Λ is conjugate to l where w1 + h and w2 + h are variables of separation.  As φ(e) is
# ½ l² (e² − k²)² ≥ 0, e lies in neither gap, and v never vanishes.  In v_k = 1/(w_k − μ), with ε = e − μ,
#
#     Λ = (l/2) (t + (e² − k²) Σ_k ∫ v_k²/((εv_k − 1)√g) dθ_k)
#
# so that a motion on two frequencies costs two more Fourier series.  Two kinds of levels need none: on the degenerate
# ones with e² = k² Λ grows uniformly, and where l = 0, so that v is 2p times a vector of constant length, Λ is a
# constant.  There v is divided by 2p.
#
# On asymptotic motions e² = k², v tends to 0 and v² = f², f = l (s − e) − 2ap.  With b = γ^ × v and the level part of M
#
#     M·v = fX,   M·b = −2qf,   X = −2pr/l − (l² − 4p²)/(lq) (log f)',   f' = −aq (r − lγ^3)
#
# and (log f)' is known for any small f (:meth:`AbelMotion.approach`), so that M replaces v.
#
# Derived here: the vector by fitting polynomials to motions; v·γ, v² and Λ' are then proven as identities between
# polynomials on |γ| = 1 (tests/exact/test_attitude.py).


@dataclass(frozen=True, slots=True)
class KovalevskayaAttitude:
    """The azimuth of a motion at one working precision.

    integrals: of each variable; none where Λ is uniform.  side: the sign of f.
    """

    motion: AbelMotion
    integrals: tuple[Azimuth, ...]
    side: int = 1

    @classmethod
    def of(cls, motion: AbelMotion, most: int) -> KovalevskayaAttitude:
        """The azimuth of ``motion``, at its working precision.

        Raises Undecided where that does not suffice, OutOfReach for Fourier series of more than ``most`` terms and
        where
        a variable rests: there v = 0.
        """
        level = motion.level
        if any(isinstance(variable, Rest) for variable in motion.line.variables):
            raise OutOfReach(
                "The azimuth of a motion with a constant separated variable is not implemented.",
                "Request the state alone.",
            )
        apart = level.double() ** 2 - level.fourth
        if apart == 0 or level.area == 0:
            return cls(motion, (), 1 if _factor(level, level.turned()) > 0 else -1)
        offset = ball(level.double()) - motion.pole
        weight = ball(apart) * along_gamma(level) / 2
        return cls(motion, tuple(_integral(variable, offset, weight, most) for variable in motion.line.variables))

    def bearing(self, time: Fraction) -> Bearing:
        """v in the top's own axes, and Λ.  Raises Undecided where the working precision does not prove the phases."""
        level = self.motion.level
        phases, turns = self.motion.phases(time)
        reduced = self.motion.reduced(phases, turns, 1)
        azimuth = along_gamma(level) * ball(time * level.rate) / 2
        for integral, phase, turn in zip(self.integrals, phases, turns, strict=False):
            azimuth += integral.at(phase, turn)
        state = [x[0] for x in reduced]
        vector, angle = level_vector(level, state), arb(0)
        rate = self.motion.approach(phases, turns)
        # with q near 0 the vector itself is accurate enough
        if rate is not None and level.area != 0 and not state[1].contains(0):
            vector, angle = [2 * state[0], 2 * state[1], state[2]], _of_momentum(level, state, rate, self.side)
        return Bearing.of(level.in_body(state[3:]), level.in_body(vector), azimuth - angle)


def along_gamma(level: KovalevskayaLevel) -> arb:
    """l."""
    return ball(level.area) / ball(level.gamma_square).sqrt()


def level_vector(level: KovalevskayaLevel, state: Sequence[Any]) -> list[Any]:
    """v in the turned frame, from the six components there."""
    p, q, r, *gamma = state
    size = ball(level.gamma_square).sqrt()
    g1, g2, g3 = (x / size for x in gamma)
    a, h = ball(level.moment_square).sqrt() * size, ball(level.energy)
    e, s = ball(level.double()), p * p + q * q
    if level.area == 0:
        return [a * g3 - p * r, -q * r, s + e]
    l, k2 = along_gamma(level), ball(level.fourth)  # noqa: E741
    return [
        r * (l * l / 2 - 2 * p * p) + g3 * (2 * a * p - l * (h + q * q - p * p)),
        l * (2 * p * q * g3 + r * (p * g2 - q * g1) - a * g2 * g3) - 2 * p * q * r,
        l * (k2 - s * s) / a + 2 * p * (s + e),
    ]


def _factor(level: KovalevskayaLevel, state: Sequence[arb]) -> arb:
    """f."""
    p, q, *_ = state
    a = ball(level.moment_square * level.gamma_square).sqrt()
    return along_gamma(level) * (p * p + q * q - ball(level.double())) - 2 * a * p


def _of_momentum(level: KovalevskayaLevel, state: Sequence[arb], rate: arb, side: int) -> arb:
    """The angle from M to v about γ; rate: (log f)'."""
    p, q, r, *_ = state
    l = along_gamma(level)  # noqa: E741
    along = -2 * p * r / l - (l * l - 4 * p * p) / (l * q) * rate
    return acb(side * along, side * 2 * q).arg()


def _integral(variable: Variable, offset: arb, weight: arb, most: int) -> Azimuth:
    """weight ∫ v²/((εv − 1)√g) dθ of a variable in a gap; offset: ε."""
    if not isinstance(variable, Gap):
        raise TypeError("Only where e² = k² does a variable rest or tend to a root.")
    low, high = variable.middle - variable.reach, variable.middle + variable.reach
    side = 1 if offset * variable.middle > 1 else -1
    gap = Gap(low, high, variable.rest.with_line(offset), count=3, most=most)
    return Azimuth(gap, (arb(0), arb(0), side * weight))


MOST_TERMS = 1 << 14
SEPARATION = 2.0**-27
"""The smallest distance of two roots, over the largest, at which periods are integrated."""
_DISTANCE = 3e-4
"""cosh β − 1 of :func:`pole` where the Fourier series take :data:`MOST_TERMS` terms for 50 digits."""


@dataclass(frozen=True, slots=True)
class Kovalevskaya(WithBearing, ClosedForm):
    """A motion of Kovalevskaya's top with the small moment on axis 3.

    Raises NotInClass unless I1 = I2 = 2 I3, P c = 0, P r ≠ 0 and γ ≠ 0, and on and near the levels not covered.
    """

    method = "closed form: Kovalevskaya, inversion of Abel's integrals"
    source = "S. Kovalevskaya, Acta Math. 12 (1889) 177; F. Kötter, Acta Math. 17 (1893) 209"
    body = plane_top(2)
    starts = GAMMA, NOT_XI

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        _require_done(KovalevskayaLevel.of(self.top, self.start))

    def evaluate(self, time: Fraction) -> list[Any]:
        return _motion(self).at(time, current_length())

    def bearing(self, time: Fraction) -> Bearing:
        """The bearing of v; raises OutOfReach where a variable rests and very near M·γ = 0."""
        return _attitude(self).bearing(time)

    def exponent(self, bits: int) -> arb:
        """The rate λ of an asymptotic motion, > 0: its distance from the motion that it tends to goes like e^(−λ|t|).

        Raises NotInClass for any other motion.
        """

        def evaluate(working: int) -> list[arb]:
            motion = _motion(self)
            if isinstance(motion, AbelMotion):
                for k, variable in enumerate(motion.line.variables):
                    if isinstance(variable, Approach):  # the mean rate of its X
                        return [abs(motion.line.mean_rates()[k]) * ball(motion.level.rate)]
            raise NotInClass("The motion is not asymptotic.", "Only asymptotic ones have an exponent.")

        return to_bits(evaluate, bits)[0]

    def second_state(self, time: Fraction, bits: int) -> list[arb]:
        """The state at ``time`` by theta functions, to compare with :meth:`state`, which mostly inverts integrals.

        Raises OutOfReach on a degenerate level, where there are no such functions, and where :meth:`state` uses them.
        """

        def evaluate(working: int) -> list[arb]:
            if isinstance(_motion(self), ThetaMotion) or not _has_thetas(KovalevskayaLevel.of(self.top, self.start)):
                raise OutOfReach("This motion has only one closed form.", "Certify it by the enclosure.")
            return _thetas(self).at(time, 1)

        return to_bits(evaluate, bits, time, 1)


@cached_per_precision
def _motion(case: Kovalevskaya) -> AbelMotion | ThetaMotion:
    level = KovalevskayaLevel.of(case.top, case.start)
    try:
        return AbelMotion.of(level, MOST_TERMS)
    except OutOfReach:
        if not _has_thetas(level):
            return AbelMotion.of(level, 8 * MOST_TERMS)
    return ThetaMotion.of(level)


@cached_per_precision
def _attitude(case: Kovalevskaya) -> KovalevskayaAttitude:
    motion = _motion(case)
    if isinstance(motion, ThetaMotion):
        motion = AbelMotion.of(motion.level, 8 * MOST_TERMS)
    return KovalevskayaAttitude.of(motion, 8 * MOST_TERMS)


@cached_per_precision
def _thetas(case: Kovalevskaya) -> ThetaMotion:
    return ThetaMotion.of(KovalevskayaLevel.of(case.top, case.start))


def _has_thetas(level: KovalevskayaLevel) -> bool:
    """Whether the five roots are distinct and separated at the working precision."""
    values = [root.value for root in roots(level)]
    return len(values) == 5 and separation(values) >= SEPARATION


def _require_done(level: KovalevskayaLevel) -> None:
    """Raise NotInClass on the levels that are not covered."""
    cubic, double = level.cubic(), level.double()
    if cubic.gcd(cubic.derivative()).degree() > 0:
        raise LevelNotDone("The level is degenerate: the cubic (w + h)(w^2 + G) - C^2/2 has a double root.", REMEDY)
    name = "The level is degenerate"
    if double * double == level.fourth:
        # w1 = w2 = e: a double root of the quadratic of both
        if level.separated(double) == 0 and level.separated(double + 1) == level.separated(double - 1):
            raise LevelNotDone(f"{name}, and both separated variables rest at e = {shown(double)}.", REMEDY)
        name = f"{name}: l^2 = 2 |gamma|^2 (h + e) with e = {shown(double)}, e^2 = k^2"

    def test() -> None:
        curve = roots(level)
        _require_apart(curve, intervals(level, curve, start_of(level)), name)

    decide(test)


def _require_apart(curve: Sequence[PhiRoot], ends: Sequence[Interval], name: str) -> None:
    """Raise NotInClass where neither of the two forms evaluates the motion."""
    limits = [number for pair in ends if pair[0] != pair[1] for number in pair]
    if sum(curve[number - 1].multiplicity > 1 for number in limits if number) > 1:
        raise LevelNotDone(f"{name}, and both separated variables tend to e.", REMEDY)
    order = [0, *(number + 1 for number in ordered([root.value for root in curve]))]
    for low, high in ends:
        resting = [one for one, other in ends if one == other and low != high]
        if resting and order.index(high) < order.index(resting[0]) < order.index(low):
            raise LevelNotDone(f"{name}, one separated variable rests at e, and the other passes it.", REMEDY)
    nearest = separation([root.value for root in curve])
    if not nearest >= SEPARATION and pole(curve, ends)[1] < _DISTANCE:
        refuse(name, nearest, "two roots, relative to the largest")
