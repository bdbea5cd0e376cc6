"""An integration that shares nothing with the program: Taylor series of a rotation matrix and of Ω, full tensor.

J Ω' = (J Ω + k) × Ω + γ × n and R' = R [Ω]×, in body axes of any direction, in mpmath; each row of R obeys r' = r × Ω.
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import mpmath

from heavytop.precision import exact
from heavytop.top.heavy_top import HeavyTop, State


def rotation(q: Sequence[Fraction]) -> tuple[tuple[Fraction, ...], ...]:
    """R of a quaternion of any length, by Euler and Rodrigues."""
    w, v = q[0], q[1:]
    size = w * w + sum(x * x for x in v)
    skew = ((0, -v[2], v[1]), (v[2], 0, -v[0]), (-v[1], v[0], 0))
    return tuple(
        tuple(((w * w - size + w * w) * (i == j) + 2 * v[i] * v[j] + 2 * w * skew[i][j]) / size for j in range(3))
        for i in range(3)
    )


def integrate_top(top: HeavyTop, start: State, time: Fraction, xi: Any, digits: int = 40) -> list[Fraction]:
    """(Ω, γ, ξ) at ``time`` of a top on its principal axes, in a unit of time of its own."""
    k = top.rotor or (0, 0, 0)
    unit = max(1, *map(abs, start.omega), *map(abs, k))
    tensor = [[i * (row == column) for column in range(3)] for row, i in enumerate(top.inertia)]
    moment, rotor, omega = (
        [x / u for x in part] for part, u in ((top.moment, unit**2), (k, unit), (start.omega, unit))
    )
    found = integrate(tensor, moment, rotor, (xi, None, start.gamma), omega, time * unit, digits)
    return [*(unit * w for w in found[:3]), *found[3:]]


def integrate(
    tensor: Any, moment: Any, rotor: Any, rows: Any, omega: Any, time: Fraction, digits: int = 40
) -> list[Fraction]:
    """(Ω, γ, ξ) at ``time``, right to some so many digits over short times."""
    mp, order = mpmath.MPContext(), int(0.9 * digits)
    mp.dps = digits + 6

    def number(value: Any) -> Any:
        return mp.mpf(Fraction(value).numerator) / Fraction(value).denominator

    j = mp.matrix([[number(x) for x in row] for row in tensor])
    inverse = j**-1
    n, k = [number(x) for x in moment], [number(x) for x in rotor]
    state = [number(x) for x in (*omega, *rows[2], *rows[0])]
    left, sign = number(abs(time)), 1 if time >= 0 else -1
    while left > 0:
        series = [[x] for x in state]
        for m in range(order):
            found = [*_rates(series, m, j, inverse, n, k, mp), *_turned(series, 3, m), *_turned(series, 6, m)]
            for row, rate in zip(series, found, strict=True):
                row.append(sign * rate / (m + 1))
        last = max(abs(row[-1]) for row in series)
        step = min(left, (mp.mpf(10) ** -(digits + 2) / last) ** (mp.mpf(1) / order) if last else left)
        state = [mp.polyval(row[::-1], step) for row in series]
        left -= step
    return [exact(x) for x in state]


def _convolved(a: Any, b: Any, m: int) -> Any:
    return sum(a[i] * b[m - i] for i in range(m + 1))


def _crossed(u: Any, v: Any, m: int) -> list[Any]:
    return [
        _convolved(u[(i + 1) % 3], v[(i + 2) % 3], m) - _convolved(u[(i + 2) % 3], v[(i + 1) % 3], m) for i in range(3)
    ]


def _turned(series: Any, place: int, m: int) -> list[Any]:
    return _crossed(series[place : place + 3], series[:3], m)


def _rates(series: Any, m: int, j: Any, inverse: Any, n: Any, k: Any, mp: Any) -> list[Any]:
    spin = series[:3]
    momentum = [
        [sum(j[i, c] * spin[c][o] for c in range(3)) + (k[i] if o == 0 else 0) for o in range(m + 1)] for i in range(3)
    ]
    torque = _crossed(momentum, spin, m)
    g = [series[3 + i][m] for i in range(3)]
    pull = [g[1] * n[2] - g[2] * n[1], g[2] * n[0] - g[0] * n[2], g[0] * n[1] - g[1] * n[0]]
    total = mp.matrix([a + b for a, b in zip(torque, pull, strict=True)])
    return list(inverse * total)
