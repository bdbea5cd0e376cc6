"""Attitude of Kovalevskaya's top at any time: a level vector of the state whose azimuth is one more Abel integral.

With I = (2, 2, 1), n = (c, 0, 0), γ^ = γ/|γ|, a = c|γ|, l = M·γ^, s = p² + q² and h, k, w1, w2 as in
:mod:`heavytop.exact.kovalevskaya_level`, e = l²/2 − h (:meth:`Level.double`), the vector

    v1 = r (l²/2 − 2p²) + γ^3 (2ap − l (h + q² − p²))
    v2 = −2pqr − a l γ^2γ^3 + 2l pq γ^3 + l r (pγ^2 − qγ^1)
    v3 = l (k² − s²)/a + 2p (s + e)

is level, v·γ = 0, v² = −4q² (w1 − e)(w2 − e), and its azimuth Λ in space about γ has

    Λ' = (l/2) (1 − (e² − k²)/((w1 − e)(w2 − e))),   dΛ = (l/2) Σ (w² − k²)/(w − e) dw/y

along both commuting flows: Λ is conjugate to l where w1 + h and w2 + h are variables of separation.  As φ(e) is
½ l² (e² − k²)² ≥ 0, e lies in neither gap, and v never vanishes.  In v_k = 1/(w_k − μ), with ε = e − μ,

    Λ = (l/2) (t + (e² − k²) Σ_k ∫ v_k²/((εv_k − 1)√g) dθ_k)

so that a motion on two frequencies costs two more Fourier series.  Two kinds of levels need none: on the degenerate
ones with e² = k² Λ grows uniformly, and where l = 0, so that v is 2p times a vector of constant length, Λ is a
constant.  There v is divided by 2p.

On asymptotic motions e² = k², v tends to 0 and v² = f², f = l (s − e) − 2ap.  With b = γ^ × v and the level part of M

    M·v = fX,   M·b = −2qf,   X = −2pr/l − (l² − 4p²)/(lq) (log f)',   f' = −aq (r − lγ^3)

and (log f)' is known however small f is (:meth:`AbelMotion.approach`), so that M stands in the place of v.

Derived here: the vector by fitting polynomials to motions; v·γ, v² and Λ' are then proven as identities between
polynomials on |γ| = 1 (tests/exact/test_attitude.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, arb

from heavytop.errors import OutOfReach
from heavytop.exact.abel import Variable
from heavytop.exact.azimuth import Azimuth, Bearing
from heavytop.exact.balls import ball
from heavytop.exact.gaps import Gap
from heavytop.exact.kovalevskaya_abel import AbelMotion
from heavytop.exact.kovalevskaya_level import Level
from heavytop.exact.resting import Rest


@dataclass(frozen=True, slots=True)
class KovalevskayaAttitude:
    """The azimuth beside a motion, at one working precision.

    integrals: of each variable; none where Λ is uniform.  side: the sign of f.
    """

    motion: AbelMotion
    integrals: tuple[Azimuth, ...]
    side: int = 1

    @classmethod
    def of(cls, motion: AbelMotion, most: int) -> KovalevskayaAttitude:
        """Beside ``motion``, at its working precision.

        Raises Undecided where it does not suffice, OutOfReach for Fourier series of more than ``most`` terms and where
        a variable rests: there v = 0.
        """
        level = motion.level
        if any(isinstance(variable, Rest) for variable in motion.variables):
            raise OutOfReach("The azimuth of a motion with a variable at rest is not done.", "Ask for the state alone.")
        apart = level.double() ** 2 - level.fourth
        if apart == 0 or level.area == 0:
            return cls(motion, (), 1 if _factor(level, level.turned()) > 0 else -1)
        offset = ball(level.double()) - motion.pole
        weight = ball(apart) * along_gamma(level) / 2
        return cls(motion, tuple(_integral(variable, offset, weight, most) for variable in motion.variables))

    def bearing(self, time: Fraction) -> Bearing:
        """v in the top's own axes, and Λ.  Raises Undecided where the working precision does not prove the phases."""
        level = self.motion.level
        phases, turns = self.motion.phases(time)
        turned = self.motion.reduced(phases, turns, 1)
        azimuth = along_gamma(level) * ball(time * level.rate) / 2
        for integral, phase, turn in zip(self.integrals, phases, turns, strict=False):
            azimuth += integral.at(phase, turn)
        state = [x[0] for x in turned]
        vector, off = level_vector(level, state), arb(0)
        rate = self.motion.approach(phases, turns)
        # with q near 0 the vector itself is known well enough
        if rate is not None and level.area != 0 and not state[1].contains(0):
            vector, off = [2 * state[0], 2 * state[1], state[2]], _of_momentum(level, state, rate, self.side)
        return Bearing.of(level.in_body(state[3:]), level.in_body(vector), azimuth - off)


def along_gamma(level: Level) -> arb:
    """l."""
    return ball(level.area) / ball(level.gamma_square).sqrt()


def level_vector(level: Level, state: Sequence[Any]) -> list[Any]:
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


def _factor(level: Level, state: Sequence[arb]) -> arb:
    """f."""
    p, q, *_ = state
    a = ball(level.moment_square * level.gamma_square).sqrt()
    return along_gamma(level) * (p * p + q * q - ball(level.double())) - 2 * a * p


def _of_momentum(level: Level, state: Sequence[arb], rate: arb, side: int) -> arb:
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
