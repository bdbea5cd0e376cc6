"""Kovalevskaya's top by real Abel inversion: p, q, r from the phases of the two separated variables.

w1 runs through infinity where q = 0, so v = 1/(w − μ) takes its place, μ a real number in neither gap.  With
v_e = 1/(e − μ), c6 = −2 Π (μ − e) and Y² = c6 v Π (v − v_e) over the roots e of φ (:mod:`kovalevskaya_level`)

    θ1' = √g1 v2/(v1 − v2),   θ2' = −√g2 v1/(v1 − v2),   G_0 → G_0 − t,   G_1 constant   (ε1 = ε2 = 1)

Recovery.  For a root e_j of the cubic the form (w − w1)(w − w2)(x1 − x2)² is a square:

    P_j = √((w1 − e_j)(w2 − e_j)) = α_j (X − e_j Z) + β_j Y,   X = x1x2/(x1 − x2),  Y = (x1 + x2)/(x1 − x2),
    α_j² = 2(h + e_j),   β_j² = G + e_j²,   α_j β_j = −C,      Z = 1/(x1 − x2)

three linear equations for X, Y, Z.  Let h_kb be a root of ±(v_k − b), analytic in θ_k: √(2d) sin(θ/2), √(2d) cos(θ/2)
for the ends of the gap, √(v − b) or √|v − b| otherwise.  Then P_j = f_j (μ − e_j) h_1j h_2j/(h_10 h_20) with one
f_j ∈ {1, i, −1, −i} for the whole motion, as both sides are meromorphic and have equal squares.  With
κ_j = f_j (μ − e_j), (X, Y, Z) = 𝓜^−1 P, N = Σ Y_j κ_j h_1j h_2j, D = Σ Z_j κ_j h_1j h_2j

    p = N/(2D),   q = h_10 h_20/(2i D)

and r = 2p'/q, in which h_10 h_20 cancels term by term.  γ follows from q', r' and the energy:

    γ3 = (2q' + pr)/c,   γ2 = −r'/c,   γ1 = (h − p² − q² − r²/2)/c

f_j is found by exclusion: q P_j h_10 h_20 = q κ_j h_1j h_2j at the start, as power series in t of which one coefficient
differs from 0 (turning points and q = 0 included: both at once make a zero of order 4); balls exclude the other f_j.
Source: the squares are Kovalevskaya's and Kötter's; derived here, and checked by sympy for a generic level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations
from typing import Any

from flint import acb, acb_series, arb, arb_series

from heavytop.exact.abel import Variable
from heavytop.exact.asymptotic import Approach
from heavytop.exact.balls import Undecided, ball
from heavytop.exact.closed_form import series_length
from heavytop.exact.flint_context import coefficient
from heavytop.exact.gaps import Roots
from heavytop.exact.kovalevskaya_gaps import Interval, intervals, pole
from heavytop.exact.kovalevskaya_level import ORDERS, Level, Root, Start, linear, real_part, roots, start_of
from heavytop.exact.resting import Rest
from heavytop.exact.separated import Line, variable_between

_UNITS = (acb(1), acb(0, 1), acb(-1), acb(0, -1))


@dataclass(frozen=True, slots=True)
class AbelMotion:
    """The motion of a level at one working precision.

    pole: μ.  branch: the branch points in v, number 0 is 0.  ends: of the gaps.  cubic: numbers of
    the three e_j.  rows: the rows of 𝓜^−1 for Y and Z, times κ_j.
    """

    level: Level
    start: Start
    pole: arb
    branch: tuple[acb, ...]
    ends: tuple[Interval, Interval]
    line: Line
    cubic: tuple[int, ...]
    rows: tuple[tuple[acb, ...], tuple[acb, ...]]

    @classmethod
    def of(cls, level: Level, most: int) -> AbelMotion:
        """At the working precision.

        Raises Undecided where it does not suffice, OutOfReach for Fourier series of more than ``most`` terms.
        """
        start, curve = start_of(level), roots(level)
        ends = intervals(level, curve, start)
        mu, _ = pole(curve, ends)
        branch = (acb(0), *(_real(1 / (root.value - mu), root.value) for root in curve))
        lead = arb(2)
        for root in curve:
            lead *= abs(mu - root.value) ** root.multiplicity
        gaps = tuple(_variable(branch, curve, interval, lead, most) for interval in ends)
        phases = start_phases(start, mu, gaps)
        line = Line.of(gaps, (1, 1), (-1, 0), phases)
        cubic = tuple(i for i, root in enumerate(curve, 1) if root.cubic)
        plain = cls(level, start, mu, branch, ends, line, cubic, ((), ()))
        return plain._with_factors(curve, mu, phases)

    def at(self, time: Fraction, length: int) -> list[Any]:
        """The six components at ``time``, numbers, or series in t of that length.

        Raises Undecided where the working precision does not prove the phases.
        """
        return self.level.restored(self.reduced(*self.phases(time), length), length)

    def phases(self, time: Fraction) -> tuple[list[arb], list[int]]:
        """The phases at ``time`` in the first turns, and whole turns; see :meth:`Line.phases`."""
        return self.line.phases(ball(time * self.level.rate))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """v1 and v2."""
        return self.line.variables

    def reduced(self, phases: Sequence[arb], turns: Sequence[int], length: int) -> tuple[Any, ...]:
        """The six components there in the turned frame, series in t' of that length or longer."""
        with series_length(length + 1):
            velocity = self._velocity(self.moving(phases), turns)
        return self.start.state(velocity, length)

    def exponents(self) -> list[arb]:
        """The mean rate of X of a variable that tends to a double root, in a list of its own; else nothing."""
        open_ones = [k for k, variable in enumerate(self.variables) if isinstance(variable, Approach)]
        return [abs(self.line.mean_rates()[k]) * ball(self.level.rate) for k in open_ones]

    def approach(self, phases: Sequence[arb], turns: Sequence[int]) -> arb | None:
        """(log q √((w1 − e)(w2 − e)))' in t' where one variable tends to a double root e; None where none does.

        The number under the logarithm goes to 0, its rate of change is as exact as the phases.
        """
        for variable, (low, high) in zip(self.variables, self.ends, strict=True):
            if not isinstance(variable, Approach):
                continue
            number = high if variable.length > 0 else low
            with series_length(2):
                first, second = (self.halves(k, x, turns[k]) for k, x in enumerate(self.moving(phases)))
                below = sum((a * (first[i] * second[i]) for a, i in zip(self.rows[1], self.cubic, strict=True)), acb(0))
                value = first[number] * second[number] / below
                return arb((coefficient(value, 1) / coefficient(value, 0)).real)
        return None

    def _speeds(self, v1: Any, v2: Any) -> tuple[Any, Any]:
        """θ1'/v2 and −θ2'/v1."""
        first, second = (
            v * 0 if isinstance(g, Rest) else 1 / ((v1 - v2) * g.density(v))
            for g, v in zip(self.variables, (v1, v2), strict=True)
        )
        return first, second

    def _rates(self, v1: Any, v2: Any) -> tuple[Any, Any]:
        """θ1' and θ2'."""
        first, second = self._speeds(v1, v2)
        return v2 * first, -v1 * second

    def moving(self, phases: Sequence[arb]) -> list[Any]:
        """The phases as power series in t."""
        return self.line.series(phases, self._rates)

    def halves(self, variable: int, phase: Any, turns: int) -> list[Any]:
        """h_kb at every branch point."""
        gap, ends = self.variables[variable], self.ends[variable]
        low, high = gap.ends(phase)
        side = -1 if turns % 2 else 1
        v, found = gap.position(phase), []
        for number, b in enumerate(self.branch):
            if number in ends:
                found.append(acb_series(side * (low if number == ends[0] else high)))
            elif b.imag.is_zero():
                found.append(acb_series((self._side(variable, number) * (v - b.real)).sqrt()))
            else:
                found.append((acb_series(v) - b).sqrt())
        return found

    def _side(self, variable: int, number: int) -> int:
        """s with h² = s (v − b)."""
        low, high = self.ends[variable]
        b = self.branch[number]
        if number == low or not b.imag.is_zero():
            return 1
        return -1 if number == high or self.branch[low].real < b.real else 1

    def _velocity(self, phases: Sequence[Any], turns: Sequence[int]) -> tuple[Any, Any, Any]:
        """(p, q, r) from series of the phases."""
        first, second = (self.halves(k, phases[k], turns[k]) for k in (0, 1))
        products = [first[i] * second[i] for i in self.cubic]
        above, below = (sum((a * h for a, h in zip(row, products, strict=True)), acb_series([0])) for row in self.rows)
        half = 1 / (2 * below)
        p, q = above * half, first[0] * second[0] * half * acb(0, -1)
        return real_part(p), real_part(q), real_part(self._spin(phases, first, second) * half * acb(0, 4))

    def _spin(self, phases: Sequence[Any], first: Sequence[Any], second: Sequence[Any]) -> Any:
        """(N'D − ND')/(h_10 h_20)."""
        v1, v2 = (g.position(x) for g, x in zip(self.variables, phases, strict=True))
        speeds = self._speeds(v1, v2)
        # v2/h_20 = s h_20, and what is left of θ1' but for 1/h_10
        rates = (
            acb_series(speeds[0]) * second[0] * self._side(1, 0),
            acb_series(-speeds[1]) * first[0] * self._side(0, 0),
        )
        total = acb_series([0])
        for a, b in combinations(range(3), 2):
            i, j = self.cubic[a], self.cubic[b]
            weight = self.rows[0][a] * self.rows[1][b] - self.rows[0][b] * self.rows[1][a]
            for k, own, other in ((0, first, second), (1, second, first)):
                if not isinstance(self.variables[k], Rest):
                    total += rates[k] * self._turn(k, phases[k], own, i, j) * other[i] * other[j] * weight
        return total

    def _turn(self, variable: int, phase: Any, halves: Sequence[Any], i: int, j: int) -> Any:
        """(h_i' h_j − h_i h_j')/h_0, by θ: ½ s_i s_j (v_i − v_j) dv/dθ/(h_0 h_i h_j), in which the ends cancel."""
        low, high = self.ends[variable]
        signs = self._side(variable, i) * self._side(variable, j)
        value = acb_series(self.variables[variable].bend(phase))
        below = {0, i, j}
        for number in (low, high):
            if number not in below:
                value *= halves[number]
        for number in below - {low, high}:
            value /= halves[number]
        return value * (self.branch[i] - self.branch[j]) * (-signs) / 2

    def _with_factors(self, curve: Sequence[Root], mu: arb, phases: Sequence[arb]) -> AbelMotion:
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
                # P_j = 0 for ever at a root where a variable rests
                rests = (i, i) in self.ends
                kappas.append((mu - e) if rests else _fourth_root(left, right) * (mu - e))
        first, second = (tuple(inverse[row, j] * kappas[j] for j in range(3)) for row in (1, 2))
        return replace(self, rows=(first, second))


def _fourth_root(left: Any, right: Any) -> acb:
    """The one f in {1, i, −1, −i} with left = f right; raises Undecided where more than one can be."""
    sides = [(coefficient(left, n), coefficient(right, n)) for n in range(ORDERS)]
    possible = [f for f in _UNITS if all((one - f * other).contains(0) for one, other in sides)]
    if len(possible) != 1:
        raise Undecided
    return possible[0]


def _real(value: acb, like: acb) -> acb:
    """``value`` without the imaginary part that rounding gave it, where ``like`` is real."""
    return acb(value.real) if like.imag.is_zero() else value


def start_phases(start: Start, mu: arb, variables: Sequence[Variable]) -> list[arb]:
    """θ1, θ2 at t = 0, modulo whole turns."""
    with series_length(ORDERS):
        v1, v2 = start.inverses(mu)
        apart = (v1 - v2)[0]
        # v2' goes to 0 with v1, to second order in t, where q = 0
        order = 2 if start.still else 0
        rates = v1.derivative()[0] / v2[0], -v2.derivative()[order] / v1[order]
        slopes = [rate * apart * g.density(v[0]) for rate, g, v in zip(rates, variables, (v1, v2), strict=True)]
    return [g.phase(v[0], slope) for g, v, slope in zip(variables, (v1, v2), slopes, strict=True)]


def _variable(branch: Sequence[acb], curve: Sequence[Root], interval: Interval, lead: arb, most: int) -> Variable:
    """The gap between two simple branch points, or the way from a simple one to a double one and back."""
    low, high = (branch[number].real for number in interval)
    if interval[0] == interval[1]:
        return Rest(low)
    many = [1, *(root.multiplicity for root in curve)]
    rest = Roots.of(lead, [(b, many[i]) for i, b in enumerate(branch) if i not in interval])
    return variable_between(low, high, (many[interval[0]] > 1, many[interval[1]] > 1), rest, most)
