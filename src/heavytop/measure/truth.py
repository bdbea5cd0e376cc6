"""What a row is compared with: the true motion of its rounded problem, proven where that is in reach, else computed.

Proven: a closed form that a second source certifies, or the validated enclosure: up to |t| = 100 as far as that is in
reach at all, beyond where the model of its cost stays below :data:`CHEAP`.  No clock is asked: the same plan gives the
same bytes.  Computed: two runs in words with 30 bits more than the format, and 30 more again.  On a chaotic motion
these lose what the format loses, so that they know the motion better as long as the format knows anything.  Where it
has no digit left the truth ends, and the time is named.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, lru_cache

from flint import arb
from msgspec.structs import replace as replace_struct

from heavytop.errors import HeavyTopError, InputError, OutOfReach
from heavytop.exact.balls import radius_text
from heavytop.exact.catalogue import matches
from heavytop.exact.gyrostat import Gyrostat
from heavytop.exact.solution import ExactSolution
from heavytop.exact.validated import Validated
from heavytop.integrate.trajectory import Problem
from heavytop.measure.certify import EXACTLY, Certificate, certify, enclosure_of
from heavytop.measure.computed_reference import of_rounded
from heavytop.measure.scalar import GUARD_BITS
from heavytop.precision import shown, time_text
from heavytop.records import Against, Certified
from heavytop.top.equations import GYROSTAT

CHEAP = 1.0
"""Seconds of the model of the cost that the enclosure of a row may take beyond |t| = 100."""
_ALWAYS_ENCLOSED = 100
_DIGITS_A_BIT = Fraction(30103, 100000)
_SPARE_DIGITS = 3
_EFFORT = 1.0
"""Seconds that a second source at the horizon itself may cost; beyond, it is compared near 0 and near the horizon."""

Evaluate = Callable[[Fraction, int], list[arb]]


@dataclass(frozen=True, slots=True)
class Truth:
    """The states that a run is compared with.

    against: how they are known, for the row.  state: six balls at (time, bits).
    ends: the first time at which the format has no digit left, and from which on there are no states; None where it
    keeps one to the last.
    """

    against: Against
    state: Evaluate = field(repr=False)
    ends: Fraction | None = None

    def covers(self, time: Fraction) -> bool:
        """Whether there is a state at that time."""
        return self.ends is None or abs(time) < abs(self.ends)

    def remembered(self) -> Truth:
        """The same, with each state worked out once: for several runs over the same times."""
        return replace(self, state=cache(self.state))


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

    @property
    def truth(self) -> Truth:
        """For a scorer."""
        return Truth(self.against, self.solution.state)


def truth(problem: Problem, times: Sequence[Fraction], effort: float | None = None) -> Truth | str:
    """The true motion of a rounded problem at ``times``, exact numbers in the order of a run; why not, where it is
    neither proven nor computed.

    effort: of a computed one, :func:`heavytop.measure.computed_reference.compute`.
    Raises Contradiction where a second source excludes a proven one: then something is wrong with this program.
    """
    known = known_motion(problem, max(times, key=abs))
    if isinstance(known, Known):
        return known.truth
    found = _computed(problem, times, effort)
    if isinstance(found, str):
        return f"{known}; {found}"
    return replace(found, against=replace_struct(found.against, reason=known))


def uncertified(problem: Problem, times: Sequence[Fraction]) -> Truth | str:
    """The same, enough for the scatter of runs that differ in their roundings: no second source is asked."""
    form = closed_form(problem)
    if form is not None:
        return Truth(Against("proven", form.method), form.state).remembered()
    return _computed(problem, times)


def _computed(problem: Problem, times: Sequence[Fraction], effort: float | None = None) -> Truth | str:
    try:
        (found,) = of_rounded([problem], times, effort=effort)
    except (InputError, OutOfReach) as error:
        return clause(error)
    if found.ends == times[0]:
        return f"no digit of the format is left at t = {time_text(found.ends)}, the first sample"
    return Truth(found.against, found.state, found.ends)


def clause(error: HeavyTopError) -> str:
    """Its cause inside a sentence."""
    return error.cause[:1].lower() + error.cause[1:].removesuffix(".")


def certified(solution: ExactSolution, time: Fraction, bits: int) -> Known | None:
    """``solution`` for references of ``bits`` bits, if it is certified to more digits than its format has at ``time``.

    None if not: a reference below its certified digits scores nothing.  Raises Contradiction where the second source
    excludes it.
    """
    digits = int(bits * _DIGITS_A_BIT)
    certificate = certify(solution, time, digits, enclosure=enclosure_of(solution, effort=_EFFORT))
    needed = int((bits - GUARD_BITS) * _DIGITS_A_BIT) + _SPARE_DIGITS
    return Known(solution, certificate, time, bits) if certificate.agreed_digits >= needed else None


@lru_cache(maxsize=8)
def closed_form(problem: Problem) -> ExactSolution | None:
    """The closed form of a rounded problem, if it has one here; the same for rows one after another of one problem."""
    if problem.system is GYROSTAT:
        # rounded, γ is no longer parallel to M: the rotor is that of the exact data
        return Gyrostat(problem.top, problem.start, problem.parameters.rotor)
    return next(matches(problem.top, problem.start, problem.system), None)


@lru_cache(maxsize=32)
def known_motion(problem: Problem, horizon: Fraction) -> Known | str:
    """The closed form of a rounded problem, or its enclosure where that is cheap; why not, where there is neither.

    Certified at ``horizon`` for the bits of the format and its guard bits.  Raises Contradiction where the second
    source excludes it.
    """
    bits = problem.precision.bits + GUARD_BITS
    try:
        found = closed_form(problem)
        if found is None:
            found = Validated(problem.top, problem.start, problem.system)
            if abs(horizon) > _ALWAYS_ENCLOSED and found.cost(horizon, bits, CHEAP) > CHEAP:
                return f"no closed form, and an enclosure to |t| = {time_text(abs(horizon))} takes too long"
        known = certified(found, horizon, bits)
    except OutOfReach as error:
        return clause(error)
    return known or "certified to fewer digits than the format has"
