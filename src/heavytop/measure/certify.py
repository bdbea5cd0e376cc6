"""The certificate of a reference: a second source that shares no formula with the first, and the digits both give.

The second source of a closed form is the validated integration from the same exact start.  Where that is out of reach,
the closed form is compared with the validated integration at an early time from the start, and over the last unit of
time before t from its own state there: a formula that is a motion near 0 and near t, and in between the same analytic
function.  The unit is 1, or that of the motion (:func:`heavytop.exact.flint.balls.unit_of_time`) where its rates
are far from 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, log2
from typing import Literal

from flint import arb

from heavytop.errors import Contradiction, OutOfReach
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, midpoint, radius, whole_evaluation, working_precision
from heavytop.exact.solution import ExactSolution
from heavytop.precision import shown
from heavytop.top.equations import Parameters, holding
from heavytop.top.heavy_top import State

EXACTLY = 10**6
"""More digits than anyone may ask for: those of two sources without any gap between them."""
_EARLY = Fraction(4)
_LAST = Fraction(1)
# a second source may cost this many seconds of the model of the cost
_EFFORT = 20.0
_BITS_A_DIGIT = log2(10)


@dataclass(frozen=True, slots=True)
class Certificate:
    """Two sources and how far they agree.

    method, second_source: in words.  agreed_digits: digits that both give, relative above 1 and absolute below;
    :data:`EXACTLY` where both are the same numbers without a radius, as at t = 0 and at rest.
    kind: ``proven`` if both are balls that hold the motion at the time itself, ``proven at both ends`` if the second is
    one near 0 and over the last unit of time only.
    """

    method: str
    second_source: str
    agreed_digits: int
    kind: Literal["proven", "proven at both ends"]


def bits_of(digits: int) -> int:
    """Bits that hold ``digits`` decimal digits."""
    return ceil(digits * _BITS_A_DIGIT) + 4


def agreed_digits(first: Sequence[arb], second: Sequence[arb]) -> int:
    """The digits to which every pair of balls agrees, whatever numbers they stand for; relative to a size above 1."""
    digits = []
    for one, two in zip(first, second, strict=True):
        apart = abs(midpoint(one) - midpoint(two)) + radius(one) + radius(two)
        digits.append(_digits(apart / max(Fraction(1), abs(midpoint(one)))))
    return min(digits)


def certify(
    solution: ExactSolution,
    time: Fraction,
    digits: int,
    enclosure: Validated | None = None,
) -> Certificate:
    """The certificate of ``solution`` at ``time`` for ``digits`` digits.

    enclosure: :func:`enclosure_of` the solution, to be used again for many times; None for a new one.
    Raises Contradiction where two proven sources exclude each other: one of them is wrong.  Raises OutOfReach where no
    second source reaches.
    """
    bits = bits_of(digits)
    values = solution.state(time, bits)
    if isinstance(solution, Validated):
        return Certificate(solution.method, "its own proven tail", agreed_digits(values, values), "proven")
    try:
        enclosure = enclosure or enclosure_of(solution)
        other = None if _refuses(enclosure, time, bits) else enclosure.state(time, bits)
    except OutOfReach:
        if enclosure is None:
            raise
        other = None
    if other is None:
        return _early_and_last(solution, enclosure, time, values, bits)
    _require_overlap(solution, time, values, other)
    return Certificate(solution.method, "validated integration", agreed_digits(values, other), "proven")


def _refuses(source: ExactSolution, time: Fraction, bits: int) -> bool:
    """Whether it would, by the model of its cost: a refusal takes longer, as it says which digits are in reach."""
    return isinstance(source, Validated) and source.cost(time, bits, source.effort) > source.effort


def enclosure_of(solution: ExactSolution, start: State | None = None, effort: float = _EFFORT) -> Validated:
    """The validated integration of the same motion, or from another start with the same parameters."""
    rotor = _parameters(solution).rotor
    return Validated(solution.top, start or solution.start, solution.system, rotor=rotor, effort=effort)


def _early_and_last(
    solution: ExactSolution, enclosure: Validated, time: Fraction, values: Sequence[arb], bits: int
) -> Certificate:
    direction = Fraction(1 if time > 0 else -1) / Fraction(2) ** enclosure.unit
    early, while_last = direction * _EARLY, direction * _LAST
    known = solution.state(early, bits)
    enclosed = enclosure.state(early, bits)
    _require_overlap(solution, early, known, enclosed)
    earlier = [midpoint(value) for value in solution.state(time - while_last, bits + 64)]
    last = enclosure_of(solution, State(earlier[:3], earlier[3:])).state(while_last, bits + 16)
    agreed = min(agreed_digits(known, enclosed), agreed_digits(values, last), _integral_digits(solution, values, bits))
    before = f"t {'-' if time > 0 else '+'} {shown(abs(while_last))}"
    source = f"validated integration from 0 to {shown(early)} and from {before} to t; first integrals at t"
    try:
        other = solution.second_state(time, bits) if hasattr(solution, "second_state") else None
    except OutOfReach:
        other = None
    if other is None:
        return Certificate(solution.method, source, agreed, "proven at both ends")
    _require_overlap(solution, time, values, other, "its second closed form")
    source += "; a second closed form at t"
    return Certificate(solution.method, source, min(agreed, agreed_digits(values, other)), "proven")


@whole_evaluation
def _integral_digits(solution: ExactSolution, values: Sequence[arb], bits: int) -> int:
    """The digits to which the first integrals at ``values`` are those of the exact start."""
    exact = _parameters(solution)
    digits = []
    with working_precision(bits + 64):
        p = exact.mapped(lambda value: ball(Fraction(value)))
        for integral in holding(solution.top, solution.start, solution.system):
            known = Fraction(integral.value(exact, solution.start.flat))
            drift = integral.value(p, values) - ball(known)
            digits.append(_digits((abs(midpoint(drift)) + radius(drift)) / max(Fraction(1), abs(known))))
    return min(digits)


def _parameters(solution: ExactSolution) -> Parameters:
    """The motion's own parameters: the rotor of a gyrostat from rounded data is not that of its start."""
    own: Parameters | None = getattr(solution, "parameters", None)
    return own or solution.system.parameters(solution.top, solution.start)


def _require_overlap(
    solution: ExactSolution,
    time: Fraction,
    first: Sequence[arb],
    second: Sequence[arb],
    source: str = "validated integration",
) -> None:
    for component, (one, two) in enumerate(zip(first, second, strict=True), 1):
        apart = abs(midpoint(one) - midpoint(two))
        if apart > radius(one) + radius(two):
            raise Contradiction(
                f"{solution.method} and {source} exclude each other at t = {float(time):.6g}: component "
                f"{component} differs at digit {_digits(apart)}.",
                "One of them is wrong: neither can serve as a reference.",
            )


def _digits(gap: Fraction) -> int:
    """The largest d ≥ 0 with gap ≤ 10^-d; :data:`EXACTLY` for no gap at all."""
    if gap == 0:
        return EXACTLY
    digits = max(0, int((gap.denominator.bit_length() - gap.numerator.bit_length() - 1) / _BITS_A_DIGIT) - 1)
    while gap * 10 ** (digits + 1) <= 1:
        digits += 1
    return digits
