"""The true motion of any rounded problem, proven where that is in reach, else computed with more bits; it says which.

Proven: a closed form that is certified, or the validated enclosure, as far as
:func:`heavytop.measure.known.known_motion` gives it, by a model of its cost and never by a clock: the same plan gives
the same bytes.  Computed: two runs in words with 30 bits more than the format, and 30 more again.  On a chaotic motion
these lose what the format loses, so that they know the motion better as long as the format knows anything.  Where it
has no digit left the truth ends, and the time is named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Protocol

import msgspec
from flint import arb

from heavytop.errors import InputError, OutOfReach
from heavytop.integrate.trajectory import Problem
from heavytop.measure.computed_reference import MORE_BITS, ComputedReference
from heavytop.measure.known import Known, known_motion
from heavytop.precision import shown
from heavytop.records import Against

CHEAP = 1.0
"""Seconds of the model of the cost that the enclosure of a row may take beyond |t| = 100."""


class Balls(Protocol):
    """Whatever knows a motion at (time, bits)."""

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """Six balls."""


@dataclass(frozen=True, slots=True)
class Truth:
    """The states of a row at its times.

    against: how it is known, proven or computed, by which method and to which radius or agreement, for the row.
    ends: the first time at which the format has no digit left; None where it keeps one to the last.
    """

    against: Against
    bits: int
    source: Balls = field(repr=False)
    ends: Fraction | None = None

    def state(self, time: Fraction) -> list[arb]:
        """Six balls.  Raises OutOfReach where the truth has ended."""
        if self.ends is not None and abs(time) >= abs(self.ends):
            raise OutOfReach(f"No digit is left from t = {shown(self.ends)} on.", "Ask for an earlier time.")
        return self.source.state(time, self.bits)


def truth(problem: Problem, times: Sequence[Fraction]) -> Truth:
    """The true motion of a rounded problem at ``times``, exact numbers in the order of a run.

    Raises OutOfReach where it is neither proven nor computed: for more bits than there are words for, and for runs
    longer than anyone waits; Contradiction where a second source excludes a closed form.
    """
    horizon = max(times, key=abs)
    known = known_motion(problem, horizon, CHEAP)
    if isinstance(known, Known):
        return Truth(known.against, known.bits, known.solution)
    try:
        computed = ComputedReference.of(problem, times, problem.precision.bits + MORE_BITS)
    except InputError as error:
        raise OutOfReach(f"{known}; {error.cause}", error.remedy) from error
    ends = last_digit(computed, times, problem.precision.bits)
    before = times if ends is None else [time for time in times if abs(time) < abs(ends)]
    until = "" if ends is None else shown(ends)
    against = msgspec.structs.replace(computed.against_at(before), until=until, reason=str(known))
    return Truth(against, computed.bits, computed, ends)


def last_digit(computed: ComputedReference, times: Sequence[Fraction], bits: int) -> Fraction | None:
    """The first of ``times`` at which a format of ``bits`` bits has no digit left.

    Its error is that of the shorter words, times 2 to as many bits as it has fewer: both are amplified alike.
    """
    amplified = 10 * Fraction(2) ** max(0, computed.accuracy - bits)
    return next((time for time in times if computed.radius(time) * amplified >= 1), None)
