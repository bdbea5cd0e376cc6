"""What the elliptic motions share: working precision, exact Taylor coefficients at the start, rotation in space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import wraps
from math import factorial
from typing import Any, TypeVar

from flint import arb, fmpq_series

from heavytop.errors import InputError
from heavytop.exact.balls import ball, rational
from heavytop.exact.flint_context import coefficient, current_precision, require_undisturbed, series_length
from heavytop.exact.quartic import Pair
from heavytop.exact.second_kind import Winding
from heavytop.top.angles import perpendicular
from heavytop.top.equations import Parameters
from heavytop.top.heavy_top import Vector, dot
from heavytop.top.vectors import rational_root

Made = TypeVar("Made")


def kept(make: Callable[[Any], Made]) -> Callable[[Any], Made]:
    """``make(motion)`` once for each motion and working precision: kept in the motion's ``made``.

    A cache of functools would hash a dozen Fractions at each look-up, longer than many a state takes.
    """

    @wraps(make)
    def look_up(motion: Any) -> Made:
        made: dict[Any, Made] = motion.made
        key = make, current_precision()
        try:
            return made[key]
        except KeyError:
            found = make(motion)
            require_undisturbed()
            made[key] = found
            return found

    return look_up


def taylor(
    field: Callable[[Parameters, Any], tuple[Any, ...]], parameters: Parameters, start: Sequence[Fraction], length: int
) -> list[list[Fraction]]:
    """The exact derivatives (not divided by factorials) of each component at the start, from the field itself."""
    exact = parameters.mapped(rational)
    rows = [[rational(value)] for value in start]
    with series_length(length):
        for order in range(1, length):
            y = [fmpq_series(row, prec=length) for row in rows]
            for row, slope in zip(rows, field(exact, y), strict=True):
                row.append(coefficient(fmpq_series(slope), order - 1) / order)
    return [[Fraction(int(c.p), int(c.q)) * factorial(n) for n, c in enumerate(row)] for row in rows]


def turned(real: Sequence[Fraction], imaginary: Sequence[Fraction], winding: Winding) -> list[Pair]:
    """Derivatives at 0 of e^(−iκt) (u + i √square v), κ = rate √square, as pairs (real, imaginary/√square).

    real, imaginary: the derivatives of u and v.
    """
    found = []
    for order in range(len(real)):
        a = b = Fraction(0)
        for k in range(order + 1):
            ways = factorial(order) // (factorial(k) * factorial(order - k))
            # (−iκ)^k = (−rate)^k (i√square)^k, and (i√square)² = −square
            weight = ways * (-winding.rate) ** k * (-winding.square) ** (k // 2)
            u, v = real[order - k], imaginary[order - k]
            a, b = (a + weight * u, b + weight * v) if k % 2 == 0 else (a - weight * winding.square * v, b + weight * u)
        found.append((a, b))
    return found


def initial_xi(gamma: Vector) -> list[arb]:
    """ξ at t = 0 where nobody gave it: :func:`perpendicular` of γ/|γ|; raises InputError for γ = 0."""
    square = dot(gamma, gamma)
    if square == 0:
        raise InputError(
            "gamma is the zero vector: no attitude stands on it.", "Give the direction that points vertically up."
        )
    root = rational_root(square)
    if root is not None:
        return [ball(x) for x in perpendicular((gamma[0] / root, gamma[1] / root, gamma[2] / root))]
    size: Any = ball(square).sqrt()
    return list(perpendicular((ball(gamma[0]) / size, ball(gamma[1]) / size, ball(gamma[2]) / size)))  # type: ignore[arg-type]
