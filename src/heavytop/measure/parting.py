"""When a claim departs from the truth: the first time at which Ω of the two differ by 1 % of α.

The norm is that of every error of Ω in a report, the largest component of |ΔΩ|; the limit is α/100; the branch is
smooth or printed, as everywhere.  Both motions are known at any time, so the time is proven and no sample of a grid:
bounds of both motions over an interval show that ΔΩ cannot reach the limit there, and bisection closes in on the time
at which it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache

from flint import arb

from heavytop.claims.ershkov import Branch, PartialCase
from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, working_precision
from heavytop.exact.delone import DeloneHomoclinic
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.solution import ExactSolution
from heavytop.exact.validated import Validated
from heavytop.precision import decimal_text, shown

PARTED = Fraction(1, 100)
"""Claim and truth have parted when the largest component of |ΔΩ| reaches this, in units of α."""
CLAIM_XI = (Fraction(0), Fraction(-1), Fraction(0))
"""ξ at t = 0 of the claimed attitude, where φ + ψ = π/2 and θ = 0."""
CLOSE = Fraction(1, 10**8)
"""Relative width of the interval that the time is proven to lie in."""
DIGITS = 6
"""Significant digits of the time in reports."""
_BITS = 128
_SHORTEST = Fraction(1, 2**80)
"""Of an interval, relative to the time: shorter ones tell nothing at this working precision."""
_EFFORT = 20.0
"""Seconds that a validated truth may cost."""


@lru_cache(maxsize=4)
def true_solution(case: PartialCase) -> DeloneHomoclinic | Validated:
    """The heavy-top motion from the claim's own data at t = 0: in closed form for I1 = 2 I3, else enclosed."""
    if case.i1 == 2 * case.i3:
        return DeloneHomoclinic(case.alpha, case.i1)
    return Validated(case.solves.top, case.solves.start, xi=CLAIM_XI, effort=_EFFORT)


@dataclass(frozen=True, slots=True)
class Parting:
    """Proven: |ΔΩ| stays below the limit from 0 up to ``before`` and has reached it at ``after``; both > 0, of |t|."""

    before: Fraction
    after: Fraction

    @property
    def time(self) -> Fraction:
        """|t| to :data:`DIGITS` significant digits."""
        return Fraction(decimal_text((self.before + self.after) / 2, DIGITS))


@whole_evaluation
def parting(case: PartialCase, horizon: Fraction, branch: Branch) -> Parting | None:
    """When the claim parts from the truth on the way from 0 to ``horizon`` ≠ 0; None if it provably does not.

    Raises OutOfReach where the true motion cannot be proven so far, or |ΔΩ| touches the limit without passing it.
    """
    # in units of 1/α nothing but I1/I3 is left of the data
    pair = _Pair(PartialCase(Fraction(1), case.i1 / case.i3, Fraction(1)), branch, backward=horizon < 0)
    end = abs(horizon) * case.alpha
    before, step = Fraction(0), end
    while before < end:
        step = min(step, end - before)
        if pair.below(before, step):
            before += step
            step *= 2
        elif step <= CLOSE * before and pair.reached(before + step):
            return Parting(before / case.alpha, (before + step) / case.alpha)
        elif step <= _SHORTEST * before:
            raise OutOfReach(
                f"Claim and truth are 1 % of alpha apart at t = {shown(before / case.alpha)} and no more.",
                "Ask for an earlier horizon.",
            )
        else:
            step /= 2
    return None


class _Pair:
    """Claim and truth in one direction of time, both a motion of a system of their own."""

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
        given = solution.system.parameters(solution.top, solution.start)
        with working_precision(_BITS):
            self.parameters = given.mapped(ball)
            # ½ I Ω² <= C1 + |P r| along the truth, and along the claim as well, which keeps (1.3)
            most = 2 * (case.c1 + sum(map(abs, given.moment)))
            omega = [ball(most / each).sqrt().abs_upper() for each in given.inertia]
            everywhere = [arb(0, bound) for bound in (*omega, *[arb(1)] * 3)]
            self.fastest = [rate.abs_upper() for rate in self.field(self.parameters, everywhere)]

    def rates(self, time: Fraction, step: Fraction) -> list[arb]:
        """Ω' and γ' over all times within ``step`` of ``time``, one ball each."""
        state = self.state(time)
        with working_precision(_BITS):
            near = [y + arb(0, (ball(step) * rate).abs_upper()) for y, rate in zip(state, self.fastest, strict=True)]
            return list(self.field(self.parameters, near))
