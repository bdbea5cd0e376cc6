"""Steklov's motions: r on axis 1, any moments of inertia, M·γ = 0, Ω2² and Ω3² quadratic in Ω1.

With I = (A, B, C), n = P r = (N, 0, 0), Δ = (A − B)(A − C)(B − C) and E0 = ±N|γ|

    Ω2² = b0 + b2 Ω1²,   b2 =  A (A − C)/((A − 2B)(B − C)),   b0 = −A E0 (A − 2C)/Δ
    Ω3² = c0 + c2 Ω1²,   c2 = −A (A − B)/((A − 2C)(B − C)),   c0 =  A E0 (A − 2B)/Δ
    Ω1' = ((B − C)/A) Ω2 Ω3,   Nγ2 = Ω2 T(Ω1),   Nγ3 = Ω3 U(Ω1),   Nγ1 = S(Ω1)

with S, T, U of :mod:`heavytop.exact.one_gap`, where Ω1 is evaluated; it is a quotient of Jacobi's functions.  The roots
of both quadratics are simple and different, so that there are no degenerate motions, equilibria or asymptotic ones.
b0 and c0 of a start are rational, so that membership is an exact test.
Source: V. A. Steklov, Trudy otd. fiz. nauk 10 (1899) 1; coefficients derived here from the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError
from heavytop.exact.azimuth import Azimuth, Bearing, WithBearing
from heavytop.exact.balls import ball
from heavytop.exact.closed_form import ClosedForm
from heavytop.exact.conditions import GAMMA, ON_AXIS_1, Condition, differ
from heavytop.exact.flint_context import current_precision, whole_evaluation
from heavytop.exact.motion import kept
from heavytop.exact.one_gap import Curve, OneGapMotion, in_units, value
from heavytop.exact.reduced import polynomial
from heavytop.exact.scales import unit_of_time
from heavytop.exact.separated import decide
from heavytop.precision import shown
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

_LEAST = 256
_TERMS_A_BIT = 64
"""How long the Fourier series may be at a working precision: 2^14 terms at 256 bits."""


def _moments(top: HeavyTop, _start: State) -> Sequence[Fraction]:
    a, b, c = top.inertia
    return a - b, a - c, b - c, a - 2 * b, a - 2 * c


def _height(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    """E0 of Ω2² = b0 + b2 Ω1², for A = 1 in the units of :func:`_units`, and what Ω3² lacks then."""
    rate, _ = _units(top, start)
    p, q, r = (w / rate for w in start.omega)
    b2, b0, c2, c0 = quadratics(Fraction(1), top.inertia[1] / top.inertia[0], top.inertia[2] / top.inertia[0])
    height = (q * q - b2 * p * p) / b0
    return height, rate**2 * (r * r - c2 * p * p - height * c0)


def _gamma_off(top: HeavyTop, start: State) -> list[Fraction]:
    rate, torque = _units(top, start)
    p, q, r = (w / rate for w in start.omega)
    heights = _curve(top, start).heights
    wanted = [factor * value(part, p) for factor, part in zip((Fraction(1), q, r), heights, strict=True)]
    return [g - w / torque for g, w in zip(start.gamma, wanted, strict=True)]


@dataclass(frozen=True, slots=True)
class Steklov(WithBearing, ClosedForm):
    """A Steklov motion of a top with its centre of mass on axis 1.

    Raises NotInClass unless P b = P c = 0, P r ≠ 0, γ ≠ 0, no two moments are equal, A ≠ 2B, A ≠ 2C, and the start
    satisfies the equalities above exactly.
    """

    method = "closed form: Steklov, inversion of an elliptic integral"
    body = *ON_AXIS_1, Condition("I1, I2, I3 different, I1 != 2 I2, 2 I3", "the differences", _moments, differ)
    starts = (
        GAMMA,
        Condition("Omega3^2 = c0 + c2 Omega1^2", "the difference", lambda top, start: (_height(top, start)[1],)),
        Condition("E0 != 0", "E0", lambda top, start: (_height(top, start)[0],), any),
        Condition("gamma as it follows from Omega", "the difference", _gamma_off),
    )

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        _require_reach(self)

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`heavytop.exact.closed_form.ClosedForm`."""
        rate, torque = _units(self.top, self.start)
        return in_units(_motion(self).at(ball(rate * time)), rate, 1 / torque)

    def bearing(self, time: Fraction) -> Bearing:
        """See :class:`heavytop.exact.azimuth.WithBearing`."""
        rate, _ = _units(self.top, self.start)
        return _motion(self).bearing(_azimuth(self), ball(rate * time))


@kept
def _azimuth(case: Steklov) -> Azimuth:
    return _motion(case).azimuth()


@kept
def _motion(case: Steklov) -> OneGapMotion:
    rate, _ = _units(case.top, case.start)
    p, q, r = (w / rate for w in case.start.omega)
    signs = (q > 0) - (q < 0), (r > 0) - (r < 0)
    return OneGapMotion.of(_curve(case.top, case.start), p, signs, max(current_precision(), _LEAST) * _TERMS_A_BIT)


@whole_evaluation
def _require_reach(case: Steklov) -> None:
    """Raises LevelNotDone where the Fourier series of Abel's integral is too long, and beside a turning point."""
    name = "Two moments of inertia all but satisfy an equality, or the start a turning point's"
    decide(lambda: _motion(case), name, _LEAST)


def _units(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    """(σ, N/(A σ²)): Ω/σ and γ N/(A σ²) are of ordinary size."""
    rate = Fraction(2) ** unit_of_time(HEAVY_TOP.parameters(top, start), start.flat)
    return rate, top.moment[0] / (top.inertia[0] * rate**2)


def quadratics(a: Fraction, b: Fraction, c: Fraction) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """(b2, b0/E0, c2, c0/E0)."""
    product = (a - b) * (a - c) * (b - c)
    return (
        a * (a - c) / ((a - 2 * b) * (b - c)),
        -a * (a - 2 * c) / product,
        -a * (a - b) / ((a - 2 * c) * (b - c)),
        a * (a - 2 * b) / product,
    )


def _curve(top: HeavyTop, start: State) -> Curve:
    """The curve of a start with A = 1, in the units of :func:`_units`."""
    height, zero = _height(top, start)[0], Fraction(0)
    b, c = top.inertia[1] / top.inertia[0], top.inertia[2] / top.inertia[0]
    b2, b0, c2, c0 = quadratics(Fraction(1), b, c)
    return Curve.of((Fraction(1), b, c), polynomial(b0 * height, zero, b2), polynomial(c0 * height, zero, c2))


def steklov_motion(
    first: Fraction, second: Fraction, ratio: Fraction, rate: Fraction, upwards: int = 1, size: Fraction = Fraction(1)
) -> Steklov:
    """A top with a Steklov motion, and a start on it with Ω1 = 0 and γ = ±e1, all rational.

    first, second: I1 and I2 over ``size``.  ratio: s = Ω2/Ω3 at the start, I3 = ½ (I1 + s² (I1 − 2 I2)).  rate: Ω3
    there.  upwards: −1 turns γ and r round.  Raises InputError where a moment would not be positive or two are equal.
    """
    a, b = size * first, size * second
    c = (a + ratio**2 * (a - 2 * b)) / 2
    if min(a, b, c) <= 0 or 0 in ((a - b) * (a - c) * (b - c), (a - 2 * b) * (a - 2 * c), rate):
        raise InputError(
            f"No Steklov top has moments ({shown(a)}, {shown(b)}, {shown(c)}) and rate {shown(rate)}.",
            "Give three different positive moments, I1 not twice another one, and a rate other than 0.",
        )
    _, _, _, c0 = quadratics(a, b, c)
    height = rate**2 / c0
    top = HeavyTop((a, b, c), 1, (upwards * height, 0, 0))
    return Steklov(top, State((0, ratio * rate, rate), (upwards, 0, 0)))
