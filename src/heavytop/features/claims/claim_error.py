"""The error of a claim in its parts: of the formula, against the true motion, and of its evaluation in floating point.

The third part, the error of an integrator against the exact claim, is measured by SolutionError.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from typing import NamedTuple

import numpy
from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import hyperbolic, hyperbolic_angles
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import FUNCTIONS, ball, to_bits, whole_evaluation, working_precision
from heavytop.exact.solution import ExactSolution
from heavytop.features.claims.library.ershkov import Branch, PartialCase, Values, partial_case
from heavytop.measure.attitude_error import attitude_angle
from heavytop.measure.scalar import largest, to_ball
from heavytop.precision import Precision, Real, decimal_text, exact, number, shown
from heavytop.top.attitude import Library, attitude_from_angles, euler_angles, rows_of

MODEL_BITS = 160

Truth = Callable[[Fraction], Sequence[arb]]
"""The true Ω, γ and attitude vector ξ at a time: nine balls."""


class ModelError(NamedTuple):
    """The error of a claim against the true motion at one time.

    omega, gamma: largest component.  phi, theta, psi: modulo a turn, in [−π, π].  attitude: angle of the rotation
    between the two attitudes, which is defined at the poles too.  All angles in radians.
    """

    omega: arb
    gamma: arb
    phi: arb
    theta: arb
    psi: arb
    attitude: arb


def exact_claim(case: PartialCase, time: Fraction, branch: Branch, bits: int = MODEL_BITS) -> Values[arb]:
    """The printed formulas (4.2)-(4.6) at ``time`` as balls of ``bits`` bits; angles are NaN at t = 0, where φ divides
    by 0.  Raises OutOfReach where even a high working precision leaves less.
    """

    def evaluate(_working: int) -> list[arb]:
        # at t = 0 (4.2) is exactly 0, and the roots of (4.3), (4.5) must not see a ball that reaches below it
        data = (ball(case.i1), ball(case.i3), ball(case.c1), ball(time) if time else arb(0))
        v = partial_case(*data, FUNCTIONS, branch if time else "smooth")
        return [*v.omega, *v.gamma, *((v.phi, v.theta, v.psi) if time else ())]

    o1, o2, o3, g1, g2, g3, *angles = to_bits(evaluate, bits)
    phi, theta, psi = angles or [arb("nan")] * 3
    return Values((o1, o2, o3), (g1, g2, g3), phi, theta, psi)


@whole_evaluation
def claim_attitude(case: PartialCase, time: Fraction, branch: Branch) -> Sequence[arb]:
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
    return _difference(exact_claim(case, time, branch), claim_attitude(case, time, branch), truth(time))


@whole_evaluation
def _difference(claim: Values[arb], claimed_xi: Sequence[arb], truth: Sequence[arb]) -> ModelError:
    with working_precision(MODEL_BITS + 32):
        omega, gamma, xi = truth[:3], tuple(truth[3:6]), tuple(truth[6:])
        claimed = euler_angles(claim.gamma, claimed_xi, FUNCTIONS)
        true = euler_angles(gamma, xi, FUNCTIONS)
        phi, theta, psi = (arb.atan2((a - b).sin(), (a - b).cos()) for a, b in zip(claimed, true, strict=True))
        return ModelError(
            largest(a - b for a, b in zip(claim.omega, omega, strict=True)),
            largest(a - b for a, b in zip(claim.gamma, gamma, strict=True)),
            phi,
            theta,
            psi,
            attitude_angle(rows_of(claim.gamma, claimed_xi), rows_of(gamma, xi)),
        )


class EvaluationError(NamedTuple):
    """The absolute error of a formula evaluated in a format: balls, NaN where the format's value is not finite.

    omega: largest component.  Angles in radians.
    """

    omega: arb
    phi: arb
    theta: arb
    psi: arb


@whole_evaluation
def evaluation_error(case: PartialCase, time: Fraction, precision: Precision, form: str) -> EvaluationError:
    """The formulas evaluated in ``precision`` against their exact evaluation with the same rounded data.

    form: ``printed`` for (4.2)-(4.6) to the letter, with the positive roots also for t > 0; ``stable`` for the
    hyperbolic forms.
    """
    data = [number(value, precision) for value in (case.i1, case.i3, case.c1, time, case.alpha)]
    i1, i3, c1, t, alpha = data
    with numpy.errstate(all="ignore"):
        if form == "printed":
            computed = partial_case(i1, i3, c1, t, numpy, "printed")
        else:
            computed = stable_case(alpha, i1, i3, t, numpy)
    bits = precision.bits + 64

    def evaluate(_working: int) -> list[arb]:
        i1, i3, c1, t, alpha = (ball(exact(value)) for value in data)
        if form == "printed":
            v = partial_case(i1, i3, c1, t, FUNCTIONS, "printed" if t else "smooth")
        else:
            v = stable_case(alpha, i1, i3, t, FUNCTIONS)
        return [*v.omega, v.theta, v.psi, *([v.phi] if t or form == "stable" else [])]

    o1, o2, o3, theta, psi, *phi = to_bits(evaluate, bits)
    with working_precision(bits):
        return EvaluationError(
            largest(to_ball(a) - b for a, b in zip(computed.omega, (o1, o2, o3), strict=True)),
            abs(to_ball(computed.phi) - phi[0]) if phi else arb("nan"),
            abs(to_ball(computed.theta) - theta),
            abs(to_ball(computed.psi) - psi),
        )


def stable_case(alpha: Real, i1: Real, i3: Real, t: Real, lib: Library) -> Values[Real]:
    """The motion in forms without cancellation, over any ring; smooth branch."""
    s = alpha * ((i1 - i3) / i3) * t / 2
    omega, gamma = hyperbolic(alpha, i1 / i3, lib.tanh(s), 1 / lib.cosh(s))
    phi, theta = hyperbolic_angles(s, lib)
    return Values(omega, gamma, phi, theta, alpha * t * ((i1 + i3) / i3) / 2)


def first_failure(times: Sequence[Fraction], errors: Sequence[arb]) -> Fraction | None:
    """The earliest |t| from which on no error is finite; None if the last one is."""
    failing: Fraction | None = None
    for time, error in zip(reversed(times), reversed(errors), strict=True):
        if error.is_finite():
            break
        failing = time
    return failing


# The divergence time of a claim: the first time at which its Ω differs from that of the true motion by 1 % of α.
#
# The norm is the largest component of |ΔΩ|, as in reports.  The time is proven: bounds of both motions over an interval
# show that ΔΩ stays below the limit there, and bisection encloses the time at which it reaches the limit.


PARTED = Fraction(1, 100)
"""The limit of the largest component of |ΔΩ|, in units of α."""
CLAIM_XI = (Fraction(0), Fraction(-1), Fraction(0))
"""ξ at t = 0 of the claimed attitude, where φ + ψ = π/2 and θ = 0."""
CLOSE = Fraction(1, 10**8)
"""Relative width of the proven interval of the time."""
DIGITS = 6
"""Significant digits of the time in reports."""
_BITS = 128
_SHORTEST = Fraction(1, 2**80)
"""The shortest interval, relative to the time, that this working precision resolves."""
_EFFORT = 20.0
"""Seconds that the validated true motion may cost."""


@lru_cache(maxsize=4)
def true_solution(case: PartialCase) -> DeloneHomoclinic | Validated:
    """The heavy-top motion from the claim's own data at t = 0: in closed form for I1 = 2 I3, else enclosed."""
    if case.i1 == 2 * case.i3:
        return DeloneHomoclinic(case.alpha, case.i1)
    return Validated(case.solves.top, case.solves.start, xi=CLAIM_XI, effort=_EFFORT)


@dataclass(frozen=True, slots=True)
class DivergenceTime:
    """Proven: |ΔΩ| stays below the limit from 0 up to ``before`` and has reached it at ``after``; both > 0, of |t|."""

    before: Fraction
    after: Fraction

    @property
    def time(self) -> Fraction:
        """|t| to :data:`DIGITS` significant digits."""
        return Fraction(decimal_text((self.before + self.after) / 2, DIGITS))


@whole_evaluation
def divergence_time(case: PartialCase, horizon: Fraction, branch: Branch) -> DivergenceTime | None:
    """The divergence time between 0 and ``horizon`` ≠ 0; None if |ΔΩ| provably stays below the limit.

    Raises OutOfReach where the true motion cannot be proven so far, or |ΔΩ| touches the limit without passing it.
    """
    # in units of 1/α the motions depend on I1/I3 alone
    pair = _Pair(PartialCase(Fraction(1), case.i1 / case.i3, Fraction(1)), branch, backward=horizon < 0)
    end = abs(horizon) * case.alpha
    before, step = Fraction(0), end
    while before < end:
        step = min(step, end - before)
        if pair.below(before, step):
            before += step
            step *= 2
        elif step <= CLOSE * before and pair.reached(before + step):
            return DivergenceTime(before / case.alpha, (before + step) / case.alpha)
        elif step <= _SHORTEST * before:
            raise OutOfReach(
                f"Claim and true motion differ by only 1 % of alpha at t = {shown(before / case.alpha)}.",
                "Give an earlier horizon.",
            )
        else:
            step /= 2
    return None


class _Pair:
    """The claim and the true motion in one direction of time, each a motion of its own system."""

    def __init__(self, case: PartialCase, branch: Branch, backward: bool) -> None:
        self.sign = -1 if backward else 1
        # for t > 0 the printed roots give Ω1 the other sign than the smooth branch, which solves the gyrostat
        self.first = -1 if branch == "printed" and not backward else 1
        self.truth, self.claim = _Motion(true_solution(case), case), _Motion(case.solves, case)
        with working_precision(_BITS):
            self.limit = ball(case.alpha * PARTED)

    def below(self, time: Fraction, step: Fraction) -> bool:
        """Whether |ΔΩ| provably stays below the limit from ``time`` to ``time + step``: |ΔΩ| + step·sup|ΔΩ'| does."""
        start = self.sign * time
        gaps = self._differences(self.truth.state(start), self.claim.state(start))
        slopes = self._differences(self.truth.rates(start, step), self.claim.rates(start, step))
        with working_precision(_BITS):
            return all(abs(gap) + abs(slope) * ball(step) < self.limit for gap, slope in zip(gaps, slopes, strict=True))

    def reached(self, time: Fraction) -> bool:
        """Whether |ΔΩ| has provably reached the limit at ``time``."""
        at = self.sign * time
        gaps = self._differences(self.truth.state(at), self.claim.state(at))
        with working_precision(_BITS):
            return any(abs(gap) >= self.limit for gap in gaps)

    def _differences(self, truth: Sequence[arb], claim: Sequence[arb]) -> list[arb]:
        with working_precision(_BITS):
            return [truth[0] - self.first * claim[0], truth[1] - claim[1], truth[2] - claim[2]]


class _Motion:
    """A motion with bounds of its states and rates over an interval."""

    def __init__(self, solution: ExactSolution, case: PartialCase) -> None:
        self.field = solution.system.field
        self.state = cache(lambda time: solution.state(time, _BITS))
        parameters = solution.system.parameters(solution.top, solution.start)
        with working_precision(_BITS):
            self.parameters = parameters.mapped(ball)
            # ½ I Ω² <= C1 + |P r| along the truth, and along the claim as well, which keeps (1.3)
            most = 2 * (case.c1 + sum(map(abs, parameters.moment)))
            omega = [ball(most / moment).sqrt().abs_upper() for moment in parameters.inertia]
            everywhere = [arb(0, bound) for bound in (*omega, *[arb(1)] * 3)]
            self.fastest = [rate.abs_upper() for rate in self.field(self.parameters, everywhere)]

    def rates(self, time: Fraction, step: Fraction) -> list[arb]:
        """Ω' and γ' over all times within ``step`` of ``time``, one ball each."""
        state = self.state(time)
        with working_precision(_BITS):
            near = [y + arb(0, (ball(step) * rate).abs_upper()) for y, rate in zip(state, self.fastest, strict=True)]
            return list(self.field(self.parameters, near))
