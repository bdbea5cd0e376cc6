"""The error of a claim in its parts, never mixed: the formula compared with the truth, and the formula compared with
itself in floating point.  (The third, an integrator compared with the exact claim, is measured by SolutionError.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy
from flint import arb

from heavytop.claims.ershkov import Branch, PartialCase, Values, partial_case
from heavytop.exact.balls import FUNCTIONS, ball, to_bits, working_precision
from heavytop.exact.ershkov_partial import hyperbolic, hyperbolic_angles
from heavytop.exact.flint_context import whole_evaluation
from heavytop.measure.scalar import largest, to_ball
from heavytop.precision import Precision, exact, number
from heavytop.top.angles import attitude_from_angles, euler_angles, rotation_angle

MODEL_BITS = 160

Truth = Callable[[Fraction], tuple[list[arb], list[arb]]]
"""time -> (six balls of the state, three of the attitude vector ξ)."""


@dataclass(frozen=True, slots=True)
class ModelError:
    """How far a claim is from the true motion at one time.

    omega, gamma: largest component.  phi, theta, psi: modulo a turn, in [−π, π].  attitude: angle of the rotation
    between the two attitudes, which also makes sense at the poles.  All angles in radians.
    """

    omega: arb
    gamma: arb
    phi: arb
    theta: arb
    psi: arb
    attitude: arb


def exact_claim(case: PartialCase, time: Fraction, branch: Branch, bits: int = MODEL_BITS) -> Values:
    """The printed formulas (4.2)-(4.6) at ``time`` as balls of ``bits`` bits; angles are NaN at t = 0, where φ divides
    by 0.  Raises OutOfReach where even a high working precision leaves less.
    """

    def evaluate(_working: int) -> list[arb]:
        v = _on_balls(case, time, branch)
        return [*v.omega, *v.gamma, *((v.phi, v.theta, v.psi) if time else ())]

    o1, o2, o3, g1, g2, g3, *angles = to_bits(evaluate, bits)
    phi, theta, psi = angles or [arb("nan")] * 3
    return Values((o1, o2, o3), (g1, g2, g3), phi, theta, psi)


def _on_balls(case: PartialCase, time: Fraction, branch: Branch) -> Values:
    if time == 0:
        # (4.2) is exactly 0, and the roots of (4.3), (4.5) must not see a ball that reaches below it
        return partial_case(ball(case.i1), ball(case.i3), ball(case.c1), arb(0), FUNCTIONS, "smooth")
    return partial_case(ball(case.i1), ball(case.i3), ball(case.c1), ball(time), FUNCTIONS, branch)


@whole_evaluation
def claim_attitude(case: PartialCase, time: Fraction, branch: Branch) -> tuple[Any, Any, Any]:
    """The claimed attitude vector ξ at ``time``: on the smooth branch (4.5) continued through the pole at t = 0."""
    if branch == "smooth":
        angles = case.solves.angles(time, MODEL_BITS)
    else:
        values = exact_claim(case, time, branch)
        angles = [values.phi, values.theta, values.psi]
    with working_precision(MODEL_BITS + 32):
        return attitude_from_angles(angles[0], angles[1], angles[2], FUNCTIONS)


def model_error(case: PartialCase, time: Fraction, truth: Truth, branch: Branch = "smooth") -> ModelError:
    """The claim, exactly evaluated, against the true heavy-top motion from its own data at t = 0."""
    return _difference(exact_claim(case, time, branch), claim_attitude(case, time, branch), *truth(time))


@whole_evaluation
def _difference(claim: Values, claimed_xi: tuple[Any, Any, Any], state: Sequence[arb], xi: Sequence[arb]) -> ModelError:
    with working_precision(MODEL_BITS + 32):
        gamma = tuple(state[3:6])
        claimed = euler_angles(claim.gamma, claimed_xi, FUNCTIONS)
        true = euler_angles(gamma, tuple(xi), FUNCTIONS)
        phi, theta, psi = (_modulo_turn(a - b) for a, b in zip(claimed, true, strict=True))
        return ModelError(
            largest(a - b for a, b in zip(claim.omega, state[:3], strict=True)),
            largest(a - b for a, b in zip(claim.gamma, gamma, strict=True)),
            phi,
            theta,
            psi,
            rotation_angle((claim.gamma, claimed_xi), (gamma, tuple(xi)), FUNCTIONS),
        )


def _modulo_turn(angle: arb) -> arb:
    return arb.atan2(angle.sin(), angle.cos())


@dataclass(frozen=True, slots=True)
class EvaluationError:
    """Absolute error of a formula evaluated in a format: a ball for each quantity, NaN where the format's value is not
    finite.  omega: largest component.  Angles in radians."""

    omega: arb
    phi: arb
    theta: arb
    psi: arb


@whole_evaluation
def evaluation_error(case: PartialCase, time: Fraction, precision: Precision, form: str) -> EvaluationError:
    """The formulas evaluated in ``precision`` against themselves evaluated exactly, from the same rounded data.

    form: ``printed`` for (4.2)-(4.6) to the letter, with the positive roots also for t > 0; ``stable`` for the
    hyperbolic forms.
    """
    given = [number(value, precision) for value in (case.i1, case.i3, case.c1, time)]
    i1, i3, c1, t = (exact(value) for value in given)
    alpha = number(case.alpha, precision)
    with numpy.errstate(all="ignore"):
        if form == "printed":
            computed = partial_case(given[0], given[1], given[2], given[3], numpy, "printed")
        else:
            computed = stable_case(alpha, given[0], given[1], given[3], numpy)
    bits = precision.bits + 64

    def evaluate(_working: int) -> list[arb]:
        if form == "printed":
            v = partial_case(ball(i1), ball(i3), ball(c1), ball(t), FUNCTIONS, "printed" if t else "smooth")
        else:
            v = stable_case(ball(exact(alpha)), ball(i1), ball(i3), ball(t), FUNCTIONS)
        return [*v.omega, v.theta, v.psi, *([v.phi] if t or form == "stable" else [])]

    o1, o2, o3, theta, psi, *phi = to_bits(evaluate, bits)
    with working_precision(bits):
        return EvaluationError(
            largest(to_ball(a) - b for a, b in zip(computed.omega, (o1, o2, o3), strict=True)),
            abs(to_ball(computed.phi) - phi[0]) if phi else arb("nan"),
            abs(to_ball(computed.theta) - theta),
            abs(to_ball(computed.psi) - psi),
        )


def stable_case(alpha: Any, i1: Any, i3: Any, t: Any, lib: Any) -> Values:
    """The same motion in the forms that lose no digits, over any ring; smooth branch."""
    s = alpha * ((i1 - i3) / i3) * t / 2
    omega, gamma = hyperbolic(alpha, i1 / i3, lib.tanh(s), 1 / lib.cosh(s))
    phi, theta = hyperbolic_angles(s, lib)
    return Values(omega, gamma, phi, theta, alpha * t * ((i1 + i3) / i3) / 2)


def first_failure(times: Sequence[Fraction], errors: Sequence[arb]) -> Fraction | None:
    """The earliest |t| from which on no value is finite, None if the last one is."""
    failing: Fraction | None = None
    for time, error in zip(reversed(times), reversed(errors), strict=True):
        if error.is_finite():
            break
        failing = time
    return failing
