"""A body and a start in principal axes, in exact rationals, with bounds of the error of these data.

All motions are computed in principal axes from exact rationals.  Where the principal axes of a tensor, or an attitude
given by angles, are irrational, rational data replace them: a rational rotation A near the principal axes, a rational
rotation near the attitude.  Their error is bounded (:class:`Uncertainty`):

the true tensor in the axes A is D + E with D diagonal and E = Aᵀ J A − D, exactly, so that with X = (D + E)⁻¹

    Ω' = D⁻¹ ((D Ω + k) × Ω + γ × n) + δ,
    |δ| ≤ |X| |E| |D⁻¹| ((|J| |Ω| + |k|) |Ω| + |n|) + |D⁻¹| ((|E| |Ω| + |δk|) |Ω| + |δn|),

and |Ω| is bounded for all times by the energy, |Ω|² ≤ 2 (½ Ω·JΩ + 2 |n|)/min J.  The enclosure adds δ to its
defect and takes the error of the start as the radii of its first node, so that its balls contain the *true* motion.
Algebraic motions (:mod:`heavytop.exact.cases.algebraic_starts`) have algebraic numbers as data, and need none of this.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import Any

from heavytop.exact.flint.balls import FUNCTIONS, ball, midpoint, radius, whole_evaluation, working_precision
from heavytop.precision import Vector, dot, round_to
from heavytop.top.attitude import Attitude, Rows, perpendicular, rotated, transposed
from heavytop.top.bodies import IDENTITY, Body, PrincipalAxes
from heavytop.top.heavy_top import HeavyTop, State

_GUARD_BITS = 96
_MORE_BITS, _NEAR = (0, 512, 2048, 8192, 32768), 8
"""Tried for angles of many turns, and how many units of the last bit a rotation may be off."""
_MARGIN = Fraction(1, 2**200)


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Bounds of the error of rational data that replace irrational ones.

    start: of each component of (Ω, γ, ξ) at t = 0.  rate: of each component of Ω', at any time of the true motion.
    """

    start: tuple[Fraction, ...]
    rate: Fraction


@dataclass(frozen=True, slots=True)
class Resolved:
    """A motion in principal axes, in exact rationals.

    top, start: in principal axes.  xi: ξ at t = 0 in these; None where |γ| ≠ 1 and there is no attitude.
    axes: the rows of A, v_input = A v_principal.  uncertainty: None where the data are exact.
    """

    top: HeavyTop
    start: State
    xi: Vector | None
    axes: tuple[Vector, Vector, Vector]
    uncertainty: Uncertainty | None

    @property
    def is_rotated(self) -> bool:
        """Whether the input axes are not the principal ones."""
        return self.axes != IDENTITY


def resolve(body: Body | HeavyTop, start: State, bits: int = 256) -> Resolved:
    """The motion of a body, or of a top, from ``start``, in principal axes.

    bits: of the rounding of irrational data: of a tensor relative to its smallest moment, of others to the largest of
    their kind.
    """
    omega, rows, start_errors = _start(start, bits)
    if isinstance(body, HeavyTop):
        top, axes, exact = body, IDENTITY, True
    else:
        principal = body.principal(bits)
        top, axes, exact = body.top_in(principal), principal.axes, principal.exact
    back, up = transposed(axes), rows[2] if rows is not None else start.gamma
    vector = rows[0] if rows is not None else perpendicular(up) if dot(up, up) == 1 else None
    xi = None if vector is None else rotated(back, vector)
    if exact and not any(start_errors):
        return Resolved(top, State(rotated(back, omega), rotated(back, up)), xi, axes, None)
    # inexact data are shortened
    rounding, rate = Fraction(1, 2**bits), Fraction(0)
    short_omega, change = _shortened(rotated(back, omega), bits)
    if not exact:
        assert isinstance(body, Body)
        top, lacks = _rounded_top(top, bits)
        fastest = _root(dot(omega, omega)) + 2 * (start_errors[0] + change)
        rate = _field_error(body, principal, lacks, fastest)
    # a vector rotated by A changes by at most √3 times the largest of its components
    errors = (*[2 * start_errors[0] + change] * 3, *[2 * start_errors[1] + rounding] * 6)
    return Resolved(top, State(short_omega, rotated(back, up)), xi, axes, Uncertainty(errors, rate))


def _start(start: State, bits: int) -> tuple[Vector, tuple[Vector, Vector, Vector] | None, tuple[Fraction, Fraction]]:
    """Ω, the rows of R (None where only γ is known), and bounds of the error of Ω and of each row."""
    attitude = start.attitude
    if attitude is None:
        return start.omega, None, (Fraction(0), Fraction(0))
    exact = attitude.exact_rows()
    rows, error = (exact, Fraction(0)) if exact else _near(attitude, bits)
    if start.omega_space is None:
        return start.omega, rows, (Fraction(0), error)
    omega = rotated(transposed(rows), start.omega_space)
    return omega, rows, (error * sum(map(abs, start.omega_space), Fraction(0)), error)


def _near(attitude: Attitude, bits: int) -> tuple[tuple[Vector, Vector, Vector], Fraction]:
    """A rational rotation, and a bound of the error of its entries, about 2^-bits; large angles take more bits."""
    for more in _MORE_BITS:
        rows = attitude.rational_rows(bits + more)
        error = _distance(attitude, rows, bits + more)
        if error * 2**bits <= _NEAR:
            break
    return rows, error


@whole_evaluation
def _distance(attitude: Attitude, near: Rows[Fraction], bits: int) -> Fraction:
    """A bound of every entry of R − ``near``."""
    with working_precision(bits + _GUARD_BITS):
        rows = attitude.rows(FUNCTIONS, ball)
        gaps = [rows[i][j] - ball(near[i][j]) for i in range(3) for j in range(3)]
        return max(abs(midpoint(gap)) + radius(gap) for gap in gaps)


def _shortened(values: Vector, bits: int) -> tuple[Vector, Fraction]:
    """The vector rounded to ``bits`` bits, and the largest change of a component."""
    first, second, third = (round_to(value, bits) for value in values)
    return (first, second, third), max(abs(a - b) for a, b in zip((first, second, third), values, strict=True))


def _rounded_top(top: HeavyTop, bits: int) -> tuple[HeavyTop, tuple[Vector, Vector]]:
    """The top with rounded numbers, and the errors of its n and k."""
    centre = tuple(round_to(value, bits) for value in top.centre)
    rotor = None if top.rotor is None else tuple(round_to(value, bits) for value in top.rotor)
    short = HeavyTop(top.inertia, top.weight, centre, rotor, top.mass)
    missing = [
        tuple(a - b for a, b in zip(exact or (Fraction(0),) * 3, rounded or (Fraction(0),) * 3, strict=True))
        for exact, rounded in ((top.moment, short.moment), (top.rotor, short.rotor))
    ]
    return short, (missing[0], missing[1])  # type: ignore[return-value]


def _field_error(body: Body, principal: PrincipalAxes, lacks: tuple[Vector, Vector], start_speed: Fraction) -> Fraction:
    """A bound of every component of δ in the head of this file.  Norms are Frobenius' and Euclid's, rounded up."""
    beyond = _root(sum(value * value for row in principal.left for value in row))
    tensor = _root(sum(value * value for row in body.tensor for value in row))
    vectors = body.moment, body.rotor or (Fraction(0),) * 3, *lacks
    pull, whirl, pull_error, whirl_error = (_root(dot(vector, vector)) for vector in vectors)
    # |D⁻¹| and |X| as norms of matrices; |γ| is 1 within _MARGIN
    smallest = min(principal.moments) - beyond
    inverse = 1 / smallest
    square = 2 * (tensor * start_speed**2 / 2 + (2 + _MARGIN) * pull) / smallest
    fastest = _root(square)
    torque = (tensor * fastest + whirl) * fastest + (1 + _MARGIN) * pull
    missing = (beyond * fastest + whirl_error) * fastest + (1 + _MARGIN) * pull_error
    return inverse**2 * beyond * torque + inverse * missing


def _root(square: Any) -> Fraction:
    """An upper bound of the root of a rational, at most 2^-30 too large relatively; 0 for 0."""
    value = Fraction(square)
    if value == 0:
        return value
    shift = max(0, 64 - (value.numerator.bit_length() - value.denominator.bit_length()))
    shift += shift % 2
    return Fraction(isqrt((value.numerator << shift) // value.denominator) + 1, 1 << (shift // 2))
