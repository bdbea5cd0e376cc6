"""Principal axes of a symmetric tensor: exact where they are rational, else a rational rotation all but theirs.

A is a rotation in exact rationals whose columns are the principal axes, v_given = A v_principal.  Where the axes are
irrational Aᵀ J A keeps entries off its diagonal, of some 2^-bits relative to the largest: what is left of the tensor is
known exactly, and so is what a motion in these axes lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import permutations
from math import isqrt, lcm
from typing import Any

from heavytop.errors import InputError
from heavytop.precision import round_to
from heavytop.top.angles import perpendicular
from heavytop.top.attitude import Rows, multiplied, rotation_of, transposed
from heavytop.top.vectors import Vector, cross, dot, rational_root

IDENTITY: tuple[Vector, Vector, Vector] = tuple(tuple(Fraction(i == j) for j in range(3)) for i in range(3))  # type: ignore[assignment]
_GUARD_BITS = 64
_MOST_SWEEPS = 60
_MOST_SPREAD = 2048
"""Bits; beyond it two moments differ by a factor of 2^1021 at least, more than any data may."""


@dataclass(frozen=True, slots=True)
class PrincipalAxes:
    """axes: the rows of A, a rotation, v_given = A v_principal.  moments: the diagonal.

    left: Aᵀ J A − diag(moments), exact; all 0 where the axes are exact.
    """

    axes: tuple[Vector, Vector, Vector]
    moments: Vector
    left: tuple[Vector, Vector, Vector]

    @property
    def exact(self) -> bool:
        """Whether these are the principal axes, with no rest."""
        return not any(value for row in self.left for value in row)


def principal_axes(tensor: Rows, bits: int) -> PrincipalAxes:
    """The principal axes of a symmetric tensor of exact rationals.

    A diagonal tensor keeps its axes.  bits: where they are irrational, what is left is within some 2^-bits of the
    smallest moment.  Raises InputError where moments of a tensor that is not diagonal differ by a factor above 1e300.
    """
    if not any(tensor[i][j] for i in range(3) for j in range(i)):
        return _with_rest(tensor, IDENTITY, (tensor[0][0], tensor[1][1], tensor[2][2]))
    bits += _spread(tensor)
    near = _near(tensor, bits)
    found = _rational(tensor, near)
    if found is not None:
        return found
    turned = multiplied(transposed(near), multiplied(tensor, near))
    first, second, third = (round_to(turned[i][i], bits + _GUARD_BITS) for i in range(3))
    return _with_rest(tensor, near, _exact_moments(tensor, (first, second, third)))


def _with_rest(tensor: Rows, axes: Any, moments: Vector) -> PrincipalAxes:
    turned = multiplied(transposed(axes), multiplied(tensor, axes))
    first, second, third = (tuple(turned[i][j] - (moments[i] if i == j else 0) for j in range(3)) for i in range(3))
    return PrincipalAxes(axes, moments, (first, second, third))


def _spread(tensor: Rows) -> int:
    """Bits by which the smallest moment may be below the largest entry, in whole words: det/trace² is a bound of it.

    0 for ordinary bodies, whose guard bits do, and for a tensor that has a moment below 0.
    """
    trace, determinant = tensor[0][0] + tensor[1][1] + tensor[2][2], _determinant(tensor)
    if determinant <= 0:
        return 0
    ratio = Fraction(trace**3 / determinant)
    spread = ratio.numerator.bit_length() - ratio.denominator.bit_length()
    if spread > _MOST_SPREAD:
        raise InputError(
            "Two principal moments of the inertia tensor differ by a factor above 1e300.",
            "Check its entries and their units: no body that can be computed has such moments.",
        )
    return spread // _GUARD_BITS * _GUARD_BITS


def _determinant(rows: Rows) -> Any:
    return dot(rows[0], cross(rows[1], rows[2]))


def _less(tensor: Rows, moment: Fraction) -> tuple[Any, Any, Any]:
    """J − moment."""
    first, second, third = (tuple(tensor[i][j] - (moment if i == j else 0) for j in range(3)) for i in range(3))
    return first, second, third


def _exact_moments(tensor: Rows, near: Vector) -> Vector:
    """Each moment that is rational in place of the number near it: over the common denominator it is an integer."""
    common = lcm(*(value.denominator for row in tensor for value in row))
    found = []
    for value in near:
        candidate = Fraction(round(value * common), common)
        found.append(candidate if _determinant(_less(tensor, candidate)) == 0 else value)
    return found[0], found[1], found[2]


def _rational(tensor: Rows, near: Rows) -> PrincipalAxes | None:
    """The principal axes where all moments and unit vectors are rational, ordered as the axes near them; else None."""
    turned = multiplied(transposed(near), multiplied(tensor, near))
    guess = (turned[0][0], turned[1][1], turned[2][2])
    moments = _exact_moments(tensor, guess)
    if any(_determinant(_less(tensor, moment)) for moment in moments):
        return None
    vectors = _unit_vectors(tensor, moments)
    if vectors is None:
        return None
    order = max(
        permutations(range(3)),
        key=lambda chosen: sum(abs(dot(vectors[chosen[i]], transposed(near)[i])) for i in range(3)),
    )
    columns = [vectors[place] for place in order]
    columns = [v if dot(v, u) >= 0 else (-v[0], -v[1], -v[2]) for v, u in zip(columns, transposed(near), strict=True)]
    if _determinant(columns) < 0:
        columns[2] = (-columns[2][0], -columns[2][1], -columns[2][2])
    axes = transposed(columns)
    turned = multiplied(transposed(axes), multiplied(tensor, axes))
    return _with_rest(tensor, axes, (turned[0][0], turned[1][1], turned[2][2]))


def _unit_vectors(tensor: Rows, moments: Vector) -> list[Vector] | None:
    """Three rational unit vectors along principal axes; None where there are none."""
    single = [moment for moment in moments if moments.count(moment) == 1]
    found = []
    for moment in single:
        rows = _less(tensor, moment)
        v = max((cross(rows[i], rows[j]) for i, j in ((0, 1), (1, 2), (2, 0))), key=lambda v: dot(v, v))
        length = rational_root(dot(v, v))
        if length is None:
            return None
        found.append((v[0] / length, v[1] / length, v[2] / length))
    if len(found) == 1:  # the other two moments are equal: any axes across
        across = perpendicular(found[0])
        found += [across, cross(found[0], across)]
    return found


def _near(tensor: Rows, bits: int) -> tuple[Vector, Vector, Vector]:
    """A rotation that all but diagonalizes the tensor: Jacobi's method, each of its rotations a rational one.

    A sweep squares what is off the diagonal; it is computed from the tensor itself again after each.
    """
    size = max(abs(value) for row in tensor for value in row)
    working = bits + _GUARD_BITS
    q: tuple[Fraction, ...] = (Fraction(1), Fraction(0), Fraction(0), Fraction(0))
    for _ in range(_MOST_SWEEPS):
        axes = rotation_of(q)
        turned = multiplied(transposed(axes), multiplied(tensor, axes))
        off = max(abs(turned[i][j]) for i in range(3) for j in range(i))
        if off <= size / 2**working:
            break
        present = [[round_to(value / size, working + _GUARD_BITS) for value in row] for row in turned]
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            u = _half_angle(present, i, j, working + _GUARD_BITS)
            turn = [Fraction(1), Fraction(0), Fraction(0), Fraction(0)]
            turn[1 + axis] = u
            step = rotation_of(turn)
            present = [
                [round_to(value, working + _GUARD_BITS) for value in row]
                for row in multiplied(transposed(step), multiplied(present, step))
            ]
            q = tuple(round_to(value, working + _GUARD_BITS) for value in _product(q, turn))
    return rotation_of(q)


def _half_angle(rows: Sequence[Sequence[Fraction]], i: int, j: int, bits: int) -> Fraction:
    """tan of half the angle about the third axis by which the entry (i, j) vanishes, in [−tan π/8, tan π/8]."""
    if rows[i][j] == 0:
        return Fraction(0)
    # tan 2φ = −2 J_ij/(J_jj − J_ii) for the rotation R_k(φ), i j k cyclic, of Jᵢⱼ' = 0
    theta = (rows[j][j] - rows[i][i]) / (2 * rows[i][j])
    t = -1 / (abs(theta) + _root(theta * theta + 1, bits)) * (1 if theta >= 0 else -1)
    return round_to(t / (1 + _root(1 + t * t, bits)), bits)


def _root(value: Fraction, bits: int) -> Fraction:
    """√value for value ≥ 1, within 2^-bits of it relatively."""
    return Fraction(isqrt((value.numerator << 2 * bits) // value.denominator), 1 << bits)


def _product(p: Sequence[Fraction], q: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """The product of two quaternions: the rotation of q first."""
    w = cross(p[1:], q[1:])
    return (p[0] * q[0] - dot(p[1:], q[1:]), *(p[0] * q[i + 1] + q[0] * p[i + 1] + w[i] for i in range(3)))
