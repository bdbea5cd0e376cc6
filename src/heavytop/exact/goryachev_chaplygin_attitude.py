"""Attitude of Goryachev and Chaplygin's top and of Sretensky's gyrostat: the azimuth of M, by Fourier series.

On M·γ = 0 the angular momentum is level, and M' = γ × n in space turns it about γ at the rate |γ| n·M/M².  In the
notation of :mod:`heavytop.exact.goryachev_chaplygin_abel`, M = (4p, 4q, ρ), M² = 16 s + ρ² = (u1 − u2)², its azimuth
has

    Λ' = 4ap/(u1 − u2)² = σ (α1β2 + α2β1)/(u1 − u2)².

With ds = −dt/(u1 − u2) each phase moves by itself, dθ_k = √g_k ds, and φ_k = F_k0(θ_k)/c_k uniformly at the rate 1/c_k,
where c_k is the mean of 1/√g_k over a turn.  Λ is then the integral of

    dΛ/ds = −σ (α1β2 + α2β1)/(u1 − u2)

along a straight line (:mod:`heavytop.exact.two_frequencies`), at any time.  No vector of the state has an azimuth that
splits into integrals of one variable each: Λ would then grow alike along all closed motions of a resonant torus, and
the coefficients of the resonant terms of dΛ/ds do not vanish there (tests/exact/test_goryachev_chaplygin_attitude.py).

Strips.  In s, up to signs, u' = αβ, α' = ½ (a − X'(u)) β, β' = ½ (a + X'(u)) α, X'(u) = 3u²/2 − 2λu − h: polynomials.
From any real s the solution goes on upwards, s + iy, where it stays within (A, B, C) of (u, α, β) at s, as long as

    A' = (|α| + B)(|β| + C),   B' = ½ (|a − X'| + E)(|β| + C),   C' = ½ (|a + X'| + E)(|α| + B)

with E = (3|u| + 2|λ|)A + 3A²/2

has a solution from 0 that is finite, and so it is analytic on the strip where this holds from every real s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

from heavytop.errors import OutOfReach
from heavytop.exact.abel import Inversion, Variable
from heavytop.exact.azimuth import Bearing
from heavytop.exact.balls import Undecided, ball, working_precision
from heavytop.exact.gaps import Gap
from heavytop.exact.goryachev_chaplygin_abel import Motion
from heavytop.exact.resting import Rest
from heavytop.exact.two_frequencies import Factor, LineIntegral, Symmetry, counts, error_of, points

_CELLS, _BOUND_BITS = 256, 64
_GROWTH, _STEPS = 30.0, 200
_ROUNDING = 1 + 1e-12
"""More than the rounding of a few sums and products of positive floats."""
_ROOM = 0.45
"""Of the way to the other gap that u1 and u2 may each go on the strips."""


@dataclass(frozen=True, slots=True)
class Strip:
    """Where u, α, β are analytic in s.

    height: |Im s| is at most that.  largest: bounds on |α| and |β| there.
    """

    height: float
    largest: tuple[float, float]

    @classmethod
    def of(cls, motion: Motion, gap: Gap, other: arb) -> Strip:
        """u stays nearer to where it is at Im s = 0 than _ROOM of the way to ``other``, the end of the other gap."""
        place, alpha, beta, less, more, away = _sizes(motion, gap, other)
        room, twice = _ROOM / _ROUNDING * away, 2 * _ROUNDING * float(abs(motion.level.rotor))
        off = [np.zeros(_CELLS)] * 3
        scale, height, grown = alpha.max() + beta.max(), 0.0, off

        def rates(near: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
            a, b, c = near
            excess, first, second = (3 * place + twice) * a + 1.5 * a * a, alpha + b, beta + c
            return [first * second, (less + excess) * second / 2, (more + excess) * first / 2]

        for _ in range(5 * _STEPS):
            sizes = room, scale + off[1], scale + off[2]
            # a step of the solution is below what no point of its own step leaves
            wide = [x + size / _STEPS for x, size in zip(off, sizes, strict=True)]
            slopes = rates(wide)
            step = min(float((size / slope).min()) for size, slope in zip(sizes, slopes, strict=True)) / _STEPS
            off = [_ROUNDING * (x + step * slope) for x, slope in zip(off, slopes, strict=True)]
            if (off[0] > room).any() or max(off[1].max(), off[2].max()) > _GROWTH * scale:
                break
            height, grown = height + step / _ROUNDING, off
        return cls(height, (float((alpha + grown[1]).max()), float((beta + grown[2]).max())))


def _sizes(motion: Motion, gap: Gap, other: arb) -> NDArray[np.float64]:
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
    def of(cls, motion: Motion, variable: Variable, other: arb) -> Uniform:
        """other: the end of the other gap.  Raises OutOfReach for a variable that tends to a double root."""
        if isinstance(variable, Rest):
            size, place = motion.size, abs(variable.middle)
            bound = float((2 * size * place).sqrt().upper()) * _ROUNDING
            return cls(None, None, (bound, bound))
        if not isinstance(variable, Gap):
            raise OutOfReach("The azimuth of an asymptotic motion is not done.", "Ask for the state alone.")
        low, high = variable.middle - variable.reach, variable.middle + variable.reach
        gap, strip = Gap(low, high, variable.rest, count=1), Strip.of(motion, variable, other)
        return cls(gap, (strip.height / gap.means[0]).lower(), strip.largest)

    @property
    def rate(self) -> arb:
        """dφ/ds."""
        return arb(0) if self.gap is None else 1 / self.gap.means[0]

    def phases(self, count: int) -> list[arb]:
        """θ where φ is at each of the points."""
        if self.gap is None:
            return [arb(0)]
        inversion, found = Inversion((self.gap,), (1,)), []
        for angle in points(count):
            (phase,), (turns,) = inversion.phases([angle * self.gap.means[0]])
            found.append(phase + 2 * arb.pi() * turns)
        return found

    def passed(self, phase: arb, turns: int) -> arb:
        """s = F_0 at the phase after so many turns."""
        return arb(0) if self.gap is None else self.gap.integrals(phase)[0] + turns * self.gap.column[0]


@dataclass(frozen=True, slots=True)
class Torus:
    """Both phases φ.

    sizes: n1, n2.  apart: a lower bound on |u1 − u2| on the strips.
    """

    uniform: tuple[Uniform, Uniform]
    sizes: tuple[int, int]
    apart: arb

    @classmethod
    def of(cls, motion: Motion) -> Torus:
        """At the working precision; raises as :meth:`GoryachevChaplyginAttitude.of`."""
        first, second = motion.line.variables
        above, below = first.middle - _reach(first), second.middle + _reach(second)
        if not above > below:
            raise Undecided
        both = Uniform.of(motion, first, below), Uniform.of(motion, second, above)
        return cls(both, counts([one.width for one in both]), (1 - 2 * arb(_ROOM)) * (above - below))

    def passed(self, phases: Sequence[arb], turns: Sequence[int]) -> list[arb]:
        """s of both variables."""
        return [one.passed(phase, turn) for one, phase, turn in zip(self.uniform, phases, turns, strict=True)]

    def largest(self) -> arb:
        """A bound on |dΛ/ds|, on either of its two terms, on the strips."""
        (alpha1, beta1), (alpha2, beta2) = (one.largest for one in self.uniform)
        return arb(max(alpha1 * beta2, beta1 * alpha2)) / self.apart

    def integral(self, motion: Motion, began: Sequence[arb]) -> LineIntegral:
        """Of dΛ/ds from where s is ``began`` for both variables."""
        halves = [
            [motion.halves(k, phase, 0) for phase in one.phases(size)]
            for k, (one, size) in enumerate(zip(self.uniform, self.sizes, strict=True))
        ]
        kernel = arb_mat([[-motion.sign / (u - v) for v, _, _ in halves[1]] for u, _, _ in halves[0]])
        alphas, betas = (
            [Factor(_symmetry(motion, k, factor), [half[factor + 1] for half in halves[k]]) for k in (0, 1)]
            for factor in (0, 1)
        )
        pairs = [(alphas[0], betas[1]), (betas[0], alphas[1])]
        largest, rates = self.largest(), [one.rate for one in self.uniform]
        error = error_of(largest, [one.width for one in self.uniform], self.sizes)
        return LineIntegral.of(
            pairs, kernel, rates, [rate * s for rate, s in zip(rates, began, strict=True)], largest, error
        )


@dataclass(frozen=True, slots=True)
class GoryachevChaplyginAttitude:
    """The azimuth Λ of M beside a motion, at one working precision.

    began: s of both variables at t = 0.
    """

    motion: Motion
    torus: Torus
    began: list[arb]
    integral: LineIntegral

    @classmethod
    def of(cls, motion: Motion) -> GoryachevChaplyginAttitude:
        """Beside ``motion``, at its working precision.

        Raises Undecided where it does not suffice, OutOfReach for Fourier series of too many terms and for asymptotic
        motions.
        """
        torus = Torus.of(motion)
        began = torus.passed(*motion.phases(Fraction(0)))
        return cls(motion, torus, began, torus.integral(motion, began))

    def bearing(self, time: Fraction) -> Bearing:
        """M in the top's own axes, and Λ.  Raises Undecided where the working precision does not prove the phases."""
        phases, turns = self.motion.phases(time)
        passed, uniform = self.torus.passed(phases, turns), self.torus.uniform
        # the same for both, but for one at rest
        moving = 1 if uniform[0].gap is None else 0
        angles = [one.rate * s for one, s in zip(uniform, passed, strict=True)]
        p, q, r, *gamma = self.motion.turned(phases, turns)
        level, rotor = self.motion.level, ball(self.motion.level.rotor)
        turned = self.integral.at(angles, passed[moving] - self.began[moving])
        return Bearing.of(level.in_body(gamma), level.in_body([4 * p, 4 * q, r + rotor]), turned)


def _reach(variable: Variable) -> arb:
    return variable.reach if isinstance(variable, Gap) else arb(0)


def _symmetry(motion: Motion, variable: int, factor: int) -> Symmetry:
    """Of α or β: √(2d) cos(θ/2) at the lower end of the gap, √(2d) sin(θ/2) at the upper one."""
    low, high = motion.ends[variable]
    at_low, at_high = (low != high and motion.curve[number].counts[factor] > 0 for number in (low, high))
    return Symmetry(odd=at_high, half=at_low != at_high)
