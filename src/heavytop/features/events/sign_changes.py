"""Changes of sign of a polynomial with integer coefficients, isolated and refined without rounding.

Isolation is Vincent's theorem with bisection (Collins and Akritas, 1976): on (0, 1) the number of roots is at most
the number v of sign changes among the coefficients of (1 + x)^n g(1/(1 + x)), and equal to it for v = 0 and v = 1.
An interval that is shorter than asked for is not divided any more: the signs at its ends tell whether the function
changes sign in it, so roots that coincide in the format count as one change, or as none where they are
even in number.

Refinement is Abbott's quadratic interval refinement (2014): a secant says where among N parts the root lies, and
exact signs prove it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from flint import fmpq, fmpq_poly, fmpz, fmpz_poly

_ONE_MORE = fmpz_poly([1, 1])
_DEEPEST = 400
"""Bisections of an interval at most: roots that lie 2^-400 of a step apart are not distinguished in any format."""
_MOST_PARTS_BITS = 4096


@dataclass(frozen=True, slots=True)
class SignChange:
    """A change of sign between ``low`` and ``high``, equal where it is known exactly; rising: from − to +."""

    low: fmpq
    high: fmpq
    rising: bool


def sign_after(polynomial: fmpz_poly) -> int:
    """The sign at a small x > 0: −1, 0 for the polynomial 0, or 1."""
    return next((1 if c > 0 else -1 for c in polynomial.coeffs() if c), 0)


def sign_before(polynomial: fmpz_poly, end: fmpq | None = None) -> int:
    """The sign just before x = ``end``, None for 1."""
    total = polynomial(fmpq(1) if end is None else end)
    if total:
        return 1 if total > 0 else -1
    moved = (polynomial if end is None else _scaled(polynomial, end))(_ONE_MORE)
    return next(((1 if c > 0 else -1) * (-1) ** n for n, c in enumerate(moved.coeffs()) if c), 0)


def sign_changes(polynomial: fmpz_poly, end: fmpq, resolution: int) -> Iterator[SignChange]:
    """Every change of sign of a polynomial in 0 < x < ``end`` ≤ 1, in order.

    resolution: intervals of length 2^-resolution ``end`` are not divided any more.
    """
    sizes = [abs(int(c)) for c in polynomial.coeffs()]
    # unless the constant coefficient alone keeps the polynomial from 0 on 0 ≤ x ≤ 1
    if end > 0 and (not sizes or sizes[0] <= sum(sizes[1:])):
        yield from _isolated(_scaled(polynomial, end), 0, 0, end, min(resolution, _DEEPEST))


def _isolated(part: fmpz_poly, position: int, depth: int, span: fmpq, resolution: int) -> Iterator[SignChange]:
    """The changes in part ``position`` of 2^``depth`` of (0, span); ``part`` is the polynomial there on (0, 1)."""
    at_zero = next((n for n, c in enumerate(part.coeffs()) if c), 0)
    coefficients = part.coeffs()[at_zero:]  # without a root at 0
    part = fmpz_poly(coefficients)
    # Descartes' bound of the number of roots in (0, 1)
    if not _alternates(coefficients) or not (
        variations := _alternates(fmpz_poly(coefficients[::-1])(_ONE_MORE).coeffs())
    ):
        return
    if variations == 1 or depth >= resolution:
        before, after = sign_after(part), sign_before(part)
        if before != after:
            yield SignChange(span * fmpq(position, 1 << depth), span * fmpq(position + 1, 1 << depth), after > 0)
        return
    left = fmpz_poly([c << (len(coefficients) - 1 - n) for n, c in enumerate(coefficients)])  # 2^n g(x/2)
    right = left(_ONE_MORE)
    yield from _isolated(left, 2 * position, depth + 1, span, resolution)
    if right[0] == 0 and sign_before(left) != (after := sign_after(right)):
        middle = span * fmpq(2 * position + 1, 2 << depth)
        yield SignChange(middle, middle, after > 0)
    yield from _isolated(right, 2 * position + 1, depth + 1, span, resolution)


def _scaled(polynomial: fmpz_poly, end: fmpq) -> fmpz_poly:
    """A positive multiple of g(end x): that on (0, 1) is g on (0, end)."""
    return polynomial if end == 1 else fmpq_poly(polynomial)(fmpq_poly([0, end])).numer()


def _alternates(coefficients: Sequence[fmpz]) -> int:
    signs = [c > 0 for c in coefficients if c]
    return sum(a != b for a, b in pairwise(signs))


def refined(polynomial: fmpz_poly, change: SignChange, bits: int) -> fmpq:
    """A point within 2^-bits of the change, as a dyadic part of its interval or exactly."""
    low, high = change.low, change.high
    before = -1 if change.rising else 1
    goal, parts_bits = fmpq(1, 1 << bits), 2
    at_low = polynomial(low)
    while high - low > goal:
        width, at_high = high - low, polynomial(high)
        unit = width / (1 << parts_bits)
        if parts_bits == 1 or at_low * at_high >= 0:
            # bisection: also where an end of the interval is a root of its own, which is not the one that is meant
            middle = low + width / 2
            value = polynomial(middle)
            if value == 0:
                return middle
            low, high, at_low = (middle, high, value) if (value < 0) == (before < 0) else (low, middle, at_low)
            parts_bits = 2
            continue
        cell = (at_low / (at_low - at_high) * (1 << parts_bits) + fmpq(1, 2)).floor()
        x = low + unit * cell
        value = polynomial(x)
        if value == 0:
            return x
        onward = (value < 0) == (before < 0)
        other = x + unit if onward else x - unit
        beyond = polynomial(other)
        if beyond == 0:
            return other
        if low <= other <= high and ((beyond < 0) == (before < 0)) != onward:
            low, high, at_low = (x, other, value) if onward else (other, x, beyond)
            parts_bits = min(2 * parts_bits, _MOST_PARTS_BITS)
        else:
            parts_bits = max(1, parts_bits // 2)
    return (low + high) / 2
