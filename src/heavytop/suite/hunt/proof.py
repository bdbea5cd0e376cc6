"""The error of a found motion, proven: against a closed form or the enclosure, whose balls hold the true motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flint import arb

from heavytop.exact.balls import rational, working_precision
from heavytop.exact.flint_context import whole_evaluation
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.integrator import ChosenIntegrator
from heavytop.measure.scalar import GUARD_BITS, largest, to_ball
from heavytop.measure.truth import Truth, truth
from heavytop.suite.hunt.apart import Run
from heavytop.suite.hunt.measured import Measured, Meter
from heavytop.top.amplification import rate
from heavytop.top.equations import HEAVY_TOP


@dataclass(frozen=True, slots=True)
class Proof:
    """What is known of a found motion.

    error: at least so large, where the truth is proven; as computed, where it is not.  other: that of the integrator
    that it is shown beside; None where that is unknown.  against: how the true motion is known.
    proven: whether by a theorem.
    """

    error: float
    other: float | None
    against: str
    proven: bool


def proof(meter: Meter, found: Measured, other: ChosenIntegrator) -> Proof:
    """The error of a found motion and of ``other`` on it, against the best that is known of it.

    Raises Contradiction where two proofs exclude each other.
    """
    problem = Problem.of(*found.motion, meter.precision, HEAVY_TOP)
    known = truth(problem, meter.times)
    runs = [meter.run_of(each, found.motion) for each in (meter.integrator, other)]
    if isinstance(known, str):
        return Proof(found.error, None, f"nothing: {known}", False)
    errors = [_distance(problem, known, meter, run) for run in runs]
    return Proof(errors[0], errors[1], known.against.text, known.against.how == "proven")


@whole_evaluation
def _distance(problem: Problem, known: Truth, meter: Meter, run: Run) -> float:
    """max(|δΩ|/rate, |δγ|) over the samples, at least; infinite of a run that came to nothing."""
    if run.outcome != Outcome.SUCCESS.value:
        return math.inf
    bits = problem.precision.bits + GUARD_BITS
    unit = rate(HEAVY_TOP, problem.parameters, problem.start.flat) or 1
    found = 0.0
    with working_precision(bits):
        for time, state in zip(meter.times, run.states, strict=True):
            if not known.covers(time):
                break
            try:
                apart = [to_ball(a) - b for a, b in zip(state[:6], known.state(time, bits), strict=True)]
            except (ValueError, TypeError, ArithmeticError):
                return math.inf
            if not all(each.is_finite() for each in apart):
                return math.inf
            scaled: arb = largest((largest(apart[:3]) / rational(unit), largest(apart[3:])))
            found = max(found, float(scaled.abs_lower()))
    return found
