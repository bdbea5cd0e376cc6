"""Proven derivatives of a motion with respect to its start and its data, as decimal text with radii."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import msgspec
import numpy
from flint import arb
from numpy.typing import NDArray

from heavytop.errors import InputError, OutOfReach, quoted, refusal
from heavytop.exact.bodies import in_axes
from heavytop.exact.enclosure.derivatives import DATA, METHOD, derivatives
from heavytop.exact.enclosure.run import EFFORT, Validated
from heavytop.exact.flint.balls import ball, largest_singular_value, value_text, whole_evaluation, working_precision
from heavytop.exact.resolved import Resolved, resolve
from heavytop.measure.certify import bits_of
from heavytop.precision import exact, shown
from heavytop.top.bodies import Body
from heavytop.top.equations import NAMES, System
from heavytop.top.heavy_top import HeavyTop, State

WHICH = ("start", "data", "all")
STARTS = tuple(f"{name}(0)" for name in NAMES)
"""Names of the columns of the derivatives with respect to the start."""
PARAMETERS = DATA
"""Names of the columns of the derivatives with respect to the data."""
_SPARE_BITS = 12

Balls = list[list[arb]]


class Ball(msgspec.Struct, frozen=True):
    """Value and radius as decimal text: the true number is within the radius of the printed value."""

    value: str
    radius: str

    @classmethod
    def proven(cls, value: arb, digits: int, name: str, time: Fraction, source: str = "") -> Ball:
        """A ball printed with one digit more than ``digits``, so that rounding hides none of them.

        Raises OutOfReach where the radius exceeds 10^-digits, relative to a value above 1.
        """
        printed = cls(*value_text(value, digits + 1))
        if exact(printed.radius) > Fraction(1, 10**digits) * max(Fraction(1), abs(exact(printed.value))):
            raise OutOfReach(
                f"{name} at t = {shown(time)} is known within {printed.radius} only, not to {digits} digits{source}.",
                "Request fewer digits.",
            )
        return printed


class Derivatives(msgspec.Struct, frozen=True, omit_defaults=True):
    """Proven derivatives; their JSON is that of ``heavytop reference --derivatives``.

    start: ∂y_i(t)/∂y_j(0) as [i][j] at each time, y = (Ω1, Ω2, Ω3, γ1, γ2, γ3).  lyapunov: with them, the logarithm of
    the largest singular value of that matrix over |t|, in 1/time unit; None at t = 0.
    data: ∂y_i(t)/∂θ_j, θ = (I1, I2, I3, n1, n2, n3), n = P r.  None if not requested.
    """

    method: str
    start: list[list[list[Ball]]] | None = None
    data: list[list[list[Ball]]] | None = None
    lyapunov: list[Ball | None] | None = None

    def numpy(self) -> NDArray[numpy.float64] | dict[str, NDArray[numpy.float64]]:
        """``start`` in double, shape (n, 6, 6); if there are data, a dict of "start" and "data"."""
        arrays = {
            name: numpy.array([[[float(ball.value) for ball in row] for row in rows] for rows in part])
            for name, part in (("start", self.start), ("data", self.data))
            if part is not None
        }
        return arrays["start"] if self.data is None else arrays


def which_derivatives(value: object) -> str | None:
    """ "start", "data", "all", or None for none; raises InputError for any other."""
    if value is None or (isinstance(value, str) and value in WHICH):
        return value
    raise refusal("derivatives", '"start", "data" or "all"', quoted(value), "Give one of these, or leave it out.")


def known_derivatives(
    body: HeavyTop | Body,
    start: State,
    times: Sequence[Fraction],
    digits: int,
    system: System,
    which: str,
    effort: float = EFFORT,
) -> Derivatives:
    """The derivatives at ``times`` to ``digits`` digits: each within 10^-digits, relative above 1, absolute below.

    body, start: a body or a top, and its state; the derivatives are in its axes.  which: one of :data:`WHICH`.
    effort: of the enclosure.
    Raises OutOfReach if the digits cannot be proven; InputError for a body whose principal axes are irrational.
    """
    resolved = resolve(body, start, bits_of(digits) + 256)
    if resolved.uncertainty is not None:
        raise InputError(
            "Derivatives need exact data, but the principal axes or the attitude are irrational.",
            "Give principal moments, and gamma or an attitude with rational entries such as a quaternion.",
        )
    known = Validated(resolved.top, resolved.start, system, effort=effort)
    bits = bits_of(digits) + _SPARE_BITS
    enclosed = derivatives(known, times, bits, which != "start")
    of_start = of_data = lyapunov = None
    if which != "data":
        matrices = [in_given_axes(enclosed.start, resolved) for enclosed in enclosed]
        of_start = [_texts(matrix, time, digits) for matrix, time in zip(matrices, times, strict=True)]
        exponents = [_exponent(matrix, time, bits) for matrix, time in zip(matrices, times, strict=True)]
        lyapunov = [None if value is None else Ball(*value_text(value, digits + 1)) for value in exponents]
    if which != "start":
        matrices = [in_given_axes(enclosed.data or [], resolved, scalars=3) for enclosed in enclosed]
        of_data = [_texts(matrix, time, digits) for matrix, time in zip(matrices, times, strict=True)]
    return Derivatives(METHOD, of_start, of_data, lyapunov)


@whole_evaluation
def in_given_axes(matrix: Balls, resolved: Resolved, scalars: int = 0) -> Balls:
    """A matrix of derivatives, from principal axes to the axes given: A on both sides of each 3 × 3 block.

    scalars: leading columns that are not vector components, the principal moments.
    """
    if not resolved.is_rotated:
        return matrix
    longest = max(int(value.mid().man_exp()[0]).bit_length() for row in matrix for value in row)
    with working_precision(longest + 64):
        columns = [in_axes(resolved.axes, column) for column in zip(*matrix, strict=True)]
        rows = zip(*columns, strict=True)
        return [[*row[:scalars], *in_axes(resolved.axes, row[scalars:])] for row in rows]


@whole_evaluation
def _exponent(matrix: Balls, time: Fraction, bits: int) -> arb | None:
    """log σ/|t| of the largest singular value σ; None at t = 0."""
    if time == 0:
        return None
    value = largest_singular_value(matrix, bits)
    with working_precision(bits + 64):
        return value.log() / ball(abs(time))


def _texts(matrix: Balls, time: Fraction, digits: int) -> list[list[Ball]]:
    return [
        [Ball.proven(value, digits, f"A derivative of {name}", time) for value in row]
        for row, name in zip(matrix, NAMES, strict=True)
    ]
