"""The known motion that a run is compared with: from the same rounded data, and certified by a second source."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from heavytop.errors import OutOfReach
from heavytop.exact.balls import radius_text
from heavytop.exact.catalogue import matches
from heavytop.exact.gyrostat import Gyrostat
from heavytop.exact.solution import ExactSolution
from heavytop.exact.validated import Validated
from heavytop.integrate.trajectory import Problem
from heavytop.measure.certify import EXACTLY, Certificate, certify, enclosure_of
from heavytop.measure.scalar import GUARD_BITS
from heavytop.precision import shown
from heavytop.records import Against, Certified
from heavytop.top.equations import GYROSTAT

_DIGITS_A_BIT = Fraction(30103, 100000)
_VALIDATED_HORIZON = 100
"""Up to this time a motion without a closed form is enclosed as far as that is in reach at all."""
_SPARE_DIGITS = 3
_EFFORT = 1.0
"""Seconds that a second source at the horizon itself may cost; beyond, it is held near 0 and near the horizon."""


@dataclass(frozen=True, slots=True)
class Known:
    """A known motion and its certificate at ``time``."""

    solution: ExactSolution
    certificate: Certificate
    time: Fraction
    bits: int

    @property
    def certified(self) -> Certified:
        """Time, digits and second source."""
        c = self.certificate
        return Certified(
            shown(self.time), None if c.agreed_digits >= EXACTLY else c.agreed_digits, c.second_source, c.kind
        )

    @property
    def against(self) -> Against:
        """Method, radius and certificate, for the row."""
        limit = radius_text(Fraction(1, 2**self.bits))
        return Against("proven", self.certificate.method, limit, (self.certified,))


def certified(solution: ExactSolution, time: Fraction, bits: int) -> Known | None:
    """``solution`` for references of ``bits`` bits, if it is certified to more digits than its format has at ``time``.

    None if not: a reference below its certified digits scores nothing.  Raises Contradiction where the second source
    excludes it.
    """
    digits = int(bits * _DIGITS_A_BIT)
    certificate = certify(solution, time, digits, enclosure=enclosure_of(solution, effort=_EFFORT))
    needed = int((bits - GUARD_BITS) * _DIGITS_A_BIT) + _SPARE_DIGITS
    return Known(solution, certificate, time, bits) if certificate.agreed_digits >= needed else None


def closed_form(problem: Problem) -> ExactSolution | None:
    """The closed form of a rounded problem, if it has one here."""
    if problem.system is GYROSTAT:
        # rounded, γ is no longer parallel to M: the rotor is that of the exact data
        return Gyrostat(problem.top, problem.start, problem.parameters.rotor)
    return next(matches(problem.top, problem.start), None)


def known_motion(problem: Problem, horizon: Fraction, effort_beyond: float = 0.0) -> Known | str:
    """The closed form of a rounded problem, or up to |t| = 100 its enclosure; why not, where there is neither.

    effort_beyond: seconds of the model of the cost that the enclosure may take beyond |t| = 100.

    Certified at ``horizon`` for the bits of the format and its guard bits.  Raises Contradiction where the second
    source excludes it: then something is wrong with this program.
    """
    bits = problem.precision.bits + GUARD_BITS
    try:
        found = closed_form(problem)
        if found is None:
            found = Validated(problem.top, problem.start, problem.system)
            far = abs(horizon) > _VALIDATED_HORIZON
            if far and (effort_beyond == 0 or found.cost(horizon, bits) > effort_beyond):
                return f"no closed form, and no enclosure beyond |t| = {_VALIDATED_HORIZON}"
        known = certified(found, horizon, bits)
    except OutOfReach as error:
        return error.cause
    return known or "certified to fewer digits than the format has"
