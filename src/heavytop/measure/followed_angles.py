"""Euler angles φ and ψ without jumps by whole turns, from samples of the attitude in between.

φ is an azimuth about e3 in the body, ψ one in space; both turn about the poles of θ.  From one sample to the next a
path of length L ends within half a turn of where it began if L < d1 + d2 for the distances d1, d2 of both ends from
either pole, for a path that goes round on the other side is not shorter.  With the speed v at both ends and a bound a
of the acceleration L <= τ (v1 + v2)/2 + a τ²/4.  Where that is too long there are more samples in between, until
|ω| τ < 2^-14, or 50,000 samples in all: then the path goes through a pole as far as anybody can tell.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

from heavytop.integrate.trajectory import Problem
from heavytop.precision import exact, number
from heavytop.top.angles import euler_angles, unwrap
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import cross

Angles = tuple[float, float, float]

_LONGEST = Fraction(1, 2)
_SHORTEST = Fraction(1, 1 << 14)
_PARTS = 16
_MOST = 50_000


class _Seen(NamedTuple):
    """(φ, θ, ψ) of one sample in rad, and the larger speed of γ in the body and of e3 in space, in rad/time unit."""

    angles: Angles
    speed: float


class FollowedAngles:
    """(φ, θ, ψ) in rad at the samples that were seen, in any order.

    problem: of the run.  start: (Ω, γ, ξ) at t = 0, in the axes whose angles these are, as are all states seen.
    """

    def __init__(self, problem: Problem, start: Sequence[Fraction]) -> None:
        self._problem = problem
        self._rate = _fastest(problem)
        inertia = problem.parameters.inertia
        self._bend = 2 + max(inertia) / min(inertia)
        self._seen: dict[Fraction, _Seen] = {}
        self.see(Fraction(0), start)

    def see(self, time: Fraction, state: Any) -> None:
        """Keep the angles of a state (Ω, γ, ξ)."""
        values = [float(value) for value in state]
        omega, gamma = self._problem.system.angular_velocity(self._problem.parameters, values[:6]), values[3:6]
        turning = [math.hypot(*map(float, cross(fixed, omega))) for fixed in (gamma, (0, 0, 1))]
        self._seen[time] = _Seen(euler_angles(gamma, values[6:9], math), max(turning))

    def samples(self, times: Sequence[Fraction]) -> list[Fraction]:
        """``times`` with others in between, the body turning by at most 1/2 rad from one to the next.

        Where these would be more than 50,000 there are none in between, and angles may jump by whole turns.
        """
        count = math.ceil(self._rate * abs(times[-1]) / _LONGEST)
        between = set(self._parts(Fraction(0), times[-1], count) if count <= _MOST else ())
        return sorted({*times, *between.difference(map(self._held, times))}, key=abs)

    def complete(self, follow: Callable[[Sequence[Fraction]], Any]) -> dict[Fraction, Angles]:
        """The angles at every sample, by time.  follow: makes :meth:`see` see the states at more times, in order."""
        while more := [time for pair in pairwise(self._times()) for time in self._missing(*pair)]:
            if len(more) + len(self._seen) > _MOST:
                break
            follow(more)
        times = self._times()
        phi, theta, psi = zip(*(self._seen[time].angles for time in times), strict=True)
        followed = zip(unwrap(phi, math.tau), theta, unwrap(psi, math.tau), strict=True)
        return dict(zip(times, followed, strict=True))

    def _times(self) -> list[Fraction]:
        return sorted(self._seen, key=abs)

    def _missing(self, first: Fraction, last: Fraction) -> Iterable[Fraction]:
        """Times in between that are needed; none where both ends are at a pole and there is nothing to follow."""
        turned = self._rate * abs(last - first)
        ends = self._seen[first], self._seen[last]
        apart = sum(end.angles[1] for end in ends)
        if turned < _SHORTEST or turned > _LONGEST + 1 or apart in (0, math.tau):
            return ()
        speed = sum(Fraction(end.speed) for end in ends) / (2 * self._rate)
        length = min(turned, turned * speed + self._bend * turned**2 / 4)
        return () if length < min(apart, math.tau - apart) else self._parts(first, last, _PARTS)

    def _parts(self, first: Fraction, last: Fraction, count: int) -> Iterable[Fraction]:
        """The times in between that divide the way into equal parts, as the format holds them."""
        inner = {self._held(first + (last - first) * i / count) for i in range(1, count)}
        return sorted(inner - {first, last}, key=abs)

    def _held(self, time: Fraction) -> Fraction:
        return exact(number(time, self._problem.precision))


def _fastest(problem: Problem) -> Fraction:
    """Not less than |ω| at any time: |Ω|² <= (Ω·IΩ + 4 |P r|)/min I by the energy (heavy top and heavy gyrostat), or by
    |M| (gyrostat).  The rotor is added: |λ|, or |k|/min I, by which it bends the path.
    """
    p, omega = problem.parameters, problem.start.omega
    least, most = min(p.inertia), max(p.inertia)
    twice = sum((i * w * w for i, w in zip(p.inertia, omega, strict=True)), Fraction(0))
    square = (twice + 4 * sum(map(abs, p.moment))) * most / least**2
    root = Fraction(math.isqrt(square.numerator * square.denominator << 40) + 1, square.denominator << 20)
    rotor = sum(abs(Fraction(part)) for part in p.rotors)
    return root + (rotor if problem.system is GYROSTAT else rotor / least)
