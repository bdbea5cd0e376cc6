"""Scores of derivatives of a motion that another program computed, from Python."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop import arguments
from heavytop.arguments import MOST_STATES, Number, Numbers, bits_of, component, required
from heavytop.display import Tabular, TitledTable
from heavytop.errors import InputError, quoted, require_as_many
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.derivatives import PARAMETERS, STARTS, Derivatives, known_derivatives
from heavytop.measure.scalar import digits_of, digits_text
from heavytop.precision import decimal_text, exact, exact_text, log10, ordered
from heavytop.top.bodies import Body
from heavytop.top.equations import NAMES, System
from heavytop.top.heavy_top import HeavyTop, State

_SHAPE = "Give an array of shape (n, 6, 6) with [i, j] = ∂y_i(t)/∂y_j(0), y = (Ω1, Ω2, Ω3, γ1, γ2, γ3)."
_MORE = 6
"""Digits of the reference beyond those of the input."""
_EXPLAINS = 2.0
"""Additional digits right that another convention must explain."""

Matrix = Sequence[Sequence[Fraction]]


@dataclass(frozen=True, slots=True, repr=False)
class DerivativeScore(Tabular):
    """The score of the derivatives of a motion.

    outcome: ``success``, or ``non_finite`` where an entry is NaN or infinite: the times before are scored.
    digits_right: −log10 of the largest |error|/max(1, |true value|) of an entry, over all times, at most the digits
    of the format; None where no time was scored.  digits: likewise at each of ``times`` that was scored.
    worst: the name of the entry with that error at each, such as ``∂Ω1/∂γ2(0)``; errors: its |error|/max(1, |value|).
    of_digits: decimal digits of the input.  against: the reference, and its largest radius.
    diagnosis: conventions that fit better, one sentence each.
    passed: whether the required digits are right; None if unknown, which is not a pass.
    """

    outcome: str
    digits_right: float | None
    times: tuple[str, ...]
    digits: tuple[float, ...]
    worst: tuple[str, ...]
    errors: tuple[float, ...]
    of_digits: int
    against: str
    diagnosis: tuple[str, ...]
    passed: bool | None

    def _table(self) -> TitledTable:
        summary = "no Jacobian to score"
        if self.digits_right is not None:
            summary = f"{digits_text(self.digits_right)} of {self.of_digits} digits right"
        rows = [
            [time, digits_text(digits), name, f"{error:.2g}"]
            for time, digits, name, error in zip(self.times, self.digits, self.worst, self.errors, strict=True)
        ]
        title = f"derivatives: {self.outcome}, {summary}"
        return TitledTable(
            title, ("t", "digits", "worst", "error"), rows, [f"compared with {self.against}", *self.diagnosis]
        )


def score_derivatives(
    times: Numbers,
    jacobians: Any,
    *,
    top: HeavyTop | Body,
    start: State,
    derivatives: str = "start",
    system: System | str | None = None,
    require: Number | None = None,
) -> DerivativeScore:
    """Score derivatives of any program by their digits right: automatic, adjoint, or finite differences.

    Arguments:
        times: shape (n,), exact numbers in any order.
        jacobians: shape (n, 6, 6), [i, j] = ∂y_i(t)/∂y_j(0) with y = (Ω1, Ω2, Ω3, γ1, γ2, γ3), γ0 as three independent
            variables; an array of float64 or longdouble, or lists of numbers of any format or of text.  NaN and
            infinities are an outcome, not an error.
        top, start: the data of the program, exact: they are not rounded to a format.
        derivatives: "start", or "data" for [i, j] = ∂y_i(t)/∂θ_j with θ = (I1, I2, I3, n1, n2, n3), n = P r.
        system: as in :func:`heavytop.reference`.
        require: digits that must be right for ``passed`` of the result; None requires that every entry is finite.

    Returns:
        A :class:`DerivativeScore`.

    Raises:
        InputError: for an invalid motion, time or number, and for arrays of another shape.
        OutOfReach: if the derivatives cannot be proven to so many digits.
    """
    needed = None if require is None else required(require)
    body, state = arguments.motion(top, start, of_any_size=True)
    about, instants = arguments.system(system, body), arguments.any_times(times)
    if not isinstance(derivatives, str) or derivatives not in ("start", "data"):
        raise InputError(f"derivatives = {quoted(derivatives)} cannot be scored.", 'Give "start" or "data".')
    matrices = _matrices(jacobians, len(instants))
    of_digits = digits_of(max(bits_of(value) for matrix in matrices for row in matrix for value in row))
    values = [[[component(value) for value in row] for row in matrix] for matrix in matrices]
    finite = next((i for i, m in enumerate(values) if any(v is None for row in m for v in row)), len(values))
    outcome = Outcome.SUCCESS if finite == len(values) else Outcome.NON_FINITE
    if not finite:
        return DerivativeScore(outcome.value, None, (), (), (), (), of_digits, "nothing", (), None)
    known = known_derivatives(body, state, instants[:finite], of_digits + _MORE, about, derivatives)
    return _scored(outcome, instants[:finite], values[:finite], known, of_digits, state, needed)


def _matrices(jacobians: Any, count: int) -> list[list[list[Any]]]:
    """The entries as given; raises InputError for another shape."""
    shape = getattr(jacobians, "shape", None)
    if shape is not None and (len(shape) != 3 or tuple(shape[1:]) != (6, 6)):
        raise InputError(f"jacobians must have the shape (n, 6, 6); got {tuple(shape)}.", _SHAPE)
    matrices = []
    for i, matrix in enumerate(ordered(jacobians, "jacobians", _SHAPE)):
        rows = [
            ordered(row, f"jacobians[{i}][{j}]", _SHAPE)
            for j, row in enumerate(ordered(matrix, f"jacobians[{i}]", _SHAPE))
        ]
        if len(rows) != 6 or any(len(row) != 6 for row in rows):
            raise InputError(f"jacobians[{i}] has {len(rows)} rows of {sorted({len(r) for r in rows})}.", _SHAPE)
        matrices.append([list(row) for row in rows])
    require_as_many("Jacobians", len(matrices), count)
    if count > MOST_STATES:
        raise InputError(f"{count} Jacobians are too many to score.", f"Give at most {MOST_STATES}.")
    return matrices


def _scored(
    outcome: Outcome,
    times: list[Fraction],
    matrices: list[Any],
    known: Derivatives,
    of_digits: int,
    start: State,
    needed: Fraction | None,
) -> DerivativeScore:
    columns = PARAMETERS if known.start is None else STARTS
    balls = known.start or known.data or []
    true = [[[exact(ball.value) for ball in row] for row in matrix] for matrix in balls]
    radii = [[[exact(ball.radius) for ball in row] for row in matrix] for matrix in balls]
    errors = [_worst(*pair) for pair in zip(matrices, true, radii, strict=True)]
    digits = tuple(_digits(error, of_digits) for error, _ in errors)
    names = tuple(f"∂{NAMES[i]}/∂{columns[j]}" for _, (i, j) in errors)
    right = min(digits)
    passed = True if outcome is Outcome.SUCCESS else None
    if needed is not None and exact(right) < needed:
        passed = False
    radius = max(r for matrix in radii for row in matrix for r in row)
    return DerivativeScore(
        outcome.value,
        right,
        tuple(map(exact_text, times)),
        digits,
        names,
        tuple(float(decimal_text(error, 17)) for error, _ in errors),
        of_digits,
        f"{known.method}, largest radius {decimal_text(radius, 3)}",
        tuple(_diagnoses(matrices[-1], true[-1], radii[-1], start)) if known.start is not None else (),
        passed,
    )


def _worst(matrix: Matrix, true: Matrix, radii: Matrix) -> tuple[Fraction, tuple[int, int]]:
    """The largest upper bound of |error|/max(1, |true value|) of an entry, and its indices."""
    errors = (
        ((abs(matrix[i][j] - true[i][j]) + radii[i][j]) / max(Fraction(1), abs(true[i][j])), (i, j))
        for i in range(len(true))
        for j in range(len(true[i]))
    )
    return max(errors, key=lambda pair: pair[0])


def _digits(error: Fraction, most: int) -> float:
    size = log10(error)
    return float(most) if size is None or not math.isfinite(size) else min(float(most), -size)


def _diagnoses(matrix: Matrix, true: Matrix, radii: Matrix, start: State) -> list[str]:
    """Conventions under which the last Jacobian fits much better than as given."""
    size, gamma = range(6), (Fraction(0), Fraction(0), Fraction(0), *start.gamma)
    projection = [[int(i == j) - gamma[i] * gamma[j] for j in size] for i in size]
    projected = [[sum((true[i][k] * projection[k][j] for k in size), Fraction(0)) for j in size] for i in size]
    conventions = {
        "It is transposed: row i, column j is ∂y_i(t)/∂y_j(0).": [list(column) for column in zip(*true, strict=True)],
        "gamma0 was held on the unit sphere: here it counts as three independent variables.": projected,
    }
    given = _digits(_worst(matrix, true, radii)[0], 10**6)
    return [
        text
        for text, known in conventions.items()
        if _digits(_worst(matrix, known, radii)[0], 10**6) > given + _EXPLAINS
    ]
