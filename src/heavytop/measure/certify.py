"""The certificate of a reference: the digits that agree with a second source, which shares no formula with the first.

The second source of a closed form is the validated integration from the same exact start.  Where that is out of reach,
the closed form is compared with the validated integration from the start to an early time, and over the last unit of
time before t from its own state there: the formula solves the equations near 0 and near t, and is one analytic function
in between.  The unit is 1, or that of the motion (:func:`heavytop.exact.flint.balls.unit_of_time`) where its rates
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
"""The agreed digits of two sources that do not differ at all: more than can be requested."""
_EARLY = Fraction(4)
_LAST = Fraction(1)
# seconds that a second source may cost, by the model of its cost
_EFFORT = 20.0
_BITS_A_DIGIT = log2(10)


@dataclass(frozen=True, slots=True)
class Certificate:
    """Two sources and the digits to which they agree.

    method, second_source: their names.  agreed_digits: relative above 1, absolute below; :data:`EXACTLY` where both are
    equal numbers of radius 0, as at t = 0 and at an equilibrium.
    kind: ``proven`` if both enclose the motion at the time itself, ``proven at both ends`` if the second encloses it
    near 0 and over the last unit of time only.
    """

    method: str
    second_source: str
    agreed_digits: int
    kind: Literal["proven", "proven at both ends"]


def bits_of(digits: int) -> int:
    """Bits that hold ``digits`` decimal digits."""
    return ceil(digits * _BITS_A_DIGIT) + 4


def agreed_digits(first: Sequence[arb], second: Sequence[arb]) -> int:
    """The digits to which each number of one ball agrees with each of the other, for all pairs; relative above 1."""
    digits = []
    for a, b in zip(first, second, strict=True):
        gap = abs(midpoint(a) - midpoint(b)) + radius(a) + radius(b)
        digits.append(_digits(gap / max(Fraction(1), abs(midpoint(a)))))
    return min(digits)


def certify(
    solution: ExactSolution,
    time: Fraction,
    digits: int,
    enclosure: Validated | None = None,
) -> Certificate:
    """The certificate of ``solution`` at ``time`` for ``digits`` digits.

    enclosure: :func:`enclosure_of` the solution, shared by several times; None for a new one.
    Raises Contradiction if two proven sources exclude each other: one of them is wrong.  Raises OutOfReach if no second
    source reaches the time.
    """
    bits = bits_of(digits)
    values = solution.state(time, bits)
    if isinstance(solution, Validated):
        return Certificate(solution.method, "its own proven tail", agreed_digits(values, values), "proven")
    try:
        enclosure = enclosure or enclosure_of(solution)
        enclosed = None if _refuses(enclosure, time, bits) else enclosure.state(time, bits)
    except OutOfReach:
        if enclosure is None:
            raise
        enclosed = None
    if enclosed is None:
        return _early_and_last(solution, enclosure, time, values, bits)
    _require_overlap(solution, time, values, enclosed)
    return Certificate(solution.method, "validated integration", agreed_digits(values, enclosed), "proven")


def _refuses(source: ExactSolution, time: Fraction, bits: int) -> bool:
    """Whether its cost model exceeds its effort; its own refusal is slower, for it finds the digits in reach."""
    return isinstance(source, Validated) and source.cost(time, bits, source.effort) > source.effort


def enclosure_of(solution: ExactSolution, start: State | None = None, effort: float = _EFFORT) -> Validated:
    """The validated integration of the motion of ``solution``, or from another start with its parameters."""
    rotor = _parameters(solution).rotor
    return Validated(solution.top, start or solution.start, solution.system, rotor=rotor, effort=effort)


def _early_and_last(
    solution: ExactSolution, enclosure: Validated, time: Fraction, values: Sequence[arb], bits: int
) -> Certificate:
    direction = Fraction(1 if time > 0 else -1) / Fraction(2) ** enclosure.unit
    early, last_span = direction * _EARLY, direction * _LAST
    known = solution.state(early, bits)
    enclosed = enclosure.state(early, bits)
    _require_overlap(solution, early, known, enclosed)
    late_start = [midpoint(value) for value in solution.state(time - last_span, bits + 64)]
    last = enclosure_of(solution, State(late_start[:3], late_start[3:])).state(last_span, bits + 16)
    agreed = min(agreed_digits(known, enclosed), agreed_digits(values, last), _integral_digits(solution, values, bits))
    before = f"t {'-' if time > 0 else '+'} {shown(abs(last_span))}"
    source = f"validated integration from 0 to {shown(early)} and from {before} to t; first integrals at t"
    try:
        second = solution.second_state(time, bits) if hasattr(solution, "second_state") else None
    except OutOfReach:
        second = None
    if second is None:
        return Certificate(solution.method, source, agreed, "proven at both ends")
    _require_overlap(solution, time, values, second, "its second closed form")
    source += "; a second closed form at t"
    return Certificate(solution.method, source, min(agreed, agreed_digits(values, second)), "proven")


@whole_evaluation
def _integral_digits(solution: ExactSolution, values: Sequence[arb], bits: int) -> int:
    """The digits to which the first integrals at ``values`` agree with those of the exact start."""
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
    """The parameters of the motion: the rotor of a gyrostat from rounded data differs from that of its start."""
    parameters: Parameters | None = getattr(solution, "parameters", None)
    return parameters or solution.system.parameters(solution.top, solution.start)


def _require_overlap(
    solution: ExactSolution,
    time: Fraction,
    first: Sequence[arb],
    second: Sequence[arb],
    source: str = "validated integration",
) -> None:
    for component, (a, b) in enumerate(zip(first, second, strict=True), 1):
        gap = abs(midpoint(a) - midpoint(b))
        if gap > radius(a) + radius(b):
            raise Contradiction(
                f"{solution.method} and {source} contradict each other at t = {float(time):.6g}: component "
                f"{component} differs at digit {_digits(gap)}.",
                "One of them is wrong: neither can serve as a reference.",
            )


def _digits(gap: Fraction) -> int:
    """The largest d ≥ 0 with gap ≤ 10^-d; :data:`EXACTLY` for a gap of 0."""
    if gap == 0:
        return EXACTLY
    digits = max(0, int((gap.denominator.bit_length() - gap.numerator.bit_length() - 1) / _BITS_A_DIGIT) - 1)
    while gap * 10 ** (digits + 1) <= 1:
        digits += 1
    return digits
