"""What a computed run tells of the attitude: in double at once for all samples, else from the exact native numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from heavytop.errors import InputError
from heavytop.precision import DOUBLE, decimal_text, exact
from heavytop.top.attitude import euler_terms, quaternion_of_rows, quaternion_products, rows_of
from heavytop.top.heavy_top import Vector
from heavytop.top.outputs import Output, first_sign, shaped, signs

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from heavytop.integrate.trajectory import Trajectory

_GUARD_BITS = 64
_LOCKED = 16
"""Times the eps of the format: where the sine (or cosine) by which two Euler angles are told apart is smaller, they are
told from rounding alone."""
_SIGN_BITS = 8
"""A component of the quaternion at the start that is within so many bits of rounding counts as 0."""


def in_double(run: Trajectory, output: Output) -> NDArray[np.float64]:
    """The output at every sample, shape (n, 4), (n, 3, 3) or (n, 3); ``nan`` where an Euler angle is not defined."""
    import numpy

    attitude, size = attitude_of(run), math.prod(output.shape)
    if run.problem.precision == DOUBLE:
        values = _columns(run, attitude, output)
    else:
        exact_values = [_exactly(run, place, attitude, output) for place in range(len(run.states))]
        values = numpy.array([[float(value) for value in line] for line in exact_values]).reshape(-1, size)
    if output.name == "quaternion":
        values = values * signs(_start(run), values)[:, None]
    return values.reshape(-1, *output.shape)


def as_texts(run: Trajectory, output: Output) -> list[Any]:
    """The same as decimal text in the digits of the format, rounded once; nested lists of the same shape."""
    attitude, digits = attitude_of(run), run.problem.precision.digits
    lines = [_exactly(run, place, attitude, output) for place in range(len(run.states))]
    if output.name == "quaternion" and lines:
        import numpy

        turns = signs(_start(run), numpy.array([[float(value) for value in line] for line in lines]))
        lines = [[value * int(turn) for value in line] for line, turn in zip(lines, turns, strict=True)]
    return [shaped([_text(value, digits) for value in line], output.shape) for line in lines]


def attitude_of(run: Trajectory) -> Any:
    """ξ at every sample, native numbers, shape (n, 3); raises InputError for a run without."""
    if run.problem.xi is None:
        raise InputError(
            "The attitude was not computed: gamma alone does not fix it.",
            "Give attitude=True for a rotation about the vertical that starts where docs/outputs.md says, or xi.",
        )
    return run.attitude if run.attitude is not None else run.states[:, 6:9]


def _start(run: Trajectory) -> list[float]:
    """The quaternion at t = 0, of the sign of the convention."""
    problem = run.problem
    rows = rows_of(problem.start.gamma, problem.xi) if run.frame is None else rows_of(run.frame.gamma, run.frame.xi)
    products = quaternion_products(rows)
    multiple = max(zip(products, range(4), strict=True), key=lambda each: each[0][each[1]])[0]
    sign = first_sign(multiple, 2**_SIGN_BITS * problem.precision.eps)
    return [sign * float(value) for value in quaternion_of_rows(rows, SimpleNamespace(sqrt=_root))]


def _root(value: Any) -> Fraction:
    return Fraction(math.sqrt(value))


def _centre(run: Trajectory, output: Output) -> Vector:
    """The centre of mass, which a rounded problem alone does not know: only its product with the weight."""
    if run.frame is not None:
        return run.frame.centre
    if run.problem.given is not None:
        return run.problem.given[0].centre
    if output.name == "position" and output.point is None:
        raise InputError("This run does not say where its centre of mass is.", "Give a point.")
    return run.problem.top.centre


def _columns(run: Trajectory, attitude: Any, output: Output) -> NDArray[np.float64]:
    """The output of doubles, all samples at once, shape (n, 4, 9 or 3); quaternions of either sign."""
    import numpy

    lib = SimpleNamespace(sqrt=numpy.sqrt, atan2=numpy.arctan2)
    omega, gamma, xi = (
        tuple(part.astype(float).T) for part in (run.states[:, :3], run.states[:, 3:6], attitude[:, :3])
    )
    if output.name == "quaternion":
        products = quaternion_products(rows_of(gamma, xi))
        largest = numpy.argmax([products[place][place] for place in range(4)], axis=0)
        multiples = [numpy.choose(largest, column) for column in products]
        length = numpy.sqrt(sum(part * part for part in multiples))
        return numpy.stack([part / length for part in multiples], axis=1)
    values = output.at(omega, gamma, xi, _centre(run, output), lib, float)
    found = numpy.stack([numpy.broadcast_to(value, omega[0].shape) for value in values], axis=1)
    if output.name == "euler":
        square = euler_terms(rows_of(gamma, xi), output.sequence)[1][0]
        found[numpy.ix_(square < (_LOCKED * float(DOUBLE.eps)) ** 2, [0, 2])] = math.nan
    return found


def _exactly(run: Trajectory, place: int, attitude: Any, output: Output) -> Sequence[Any]:
    """The output at one sample from the exact native numbers: exact, or of more bits than the format has."""
    numbers = [*run.states[place][:6], *attitude[place]]
    try:
        state = [exact(value) for value in numbers]
    except InputError:  # the last state of a run that failed
        return [math.nan] * math.prod(output.shape)
    lib = _functions(run.problem.precision.bits + _GUARD_BITS)
    omega, gamma, xi = state[:3], state[3:6], state[6:]
    values = list(output.at(omega, gamma, xi, _centre(run, output), lib, Fraction))
    if output.name == "euler":
        square = euler_terms(rows_of(gamma, xi), output.sequence)[1][0]
        if square < (_LOCKED * run.problem.precision.eps) ** 2:
            values[0] = values[2] = math.nan
    return values


def _functions(bits: int) -> SimpleNamespace:
    """Elementary functions of Fractions with so many bits right; a context of its own, which no thread shares."""
    from mpmath import MPContext

    own = MPContext()
    own.prec = bits

    def number(value: Fraction) -> Any:
        return own.mpf(value.numerator) / value.denominator

    def atan2(y: Fraction, x: Fraction) -> Fraction:
        return exact(own.atan2(number(y), number(x)))

    return SimpleNamespace(sqrt=lambda value: exact(own.sqrt(number(value))), atan2=atan2)


def _text(value: Any, digits: int) -> str:
    return "nan" if value != value else decimal_text(exact(value), digits)
