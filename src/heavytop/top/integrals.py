"""First integrals and invariant relations, written once over any ring, each with the tops and starts it holds for.

Every integral takes (Parameters, y) with y in the order of the state.  Cases count up to a renaming of the axes:
a renaming of odd sign turns Ω into -Ω, which changes no integral here but for its own sign.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from typing import Any

from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State, cross, dot

Axes = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Integral:
    """A function that stays constant along the motions of ``system`` it is offered for.

    name: as it appears in reports.
    value: the function, over any ring.
    condition: where it holds, in words.
    """

    name: str
    value: Callable[[Parameters, Any], Any]
    condition: str


def momentum(p: Parameters, y: Any) -> tuple[Any, Any, Any]:
    """M = I Ω; of a full tensor where the moments are its three rows."""
    if isinstance(p.inertia[0], tuple):
        return dot(p.inertia[0], y[:3]), dot(p.inertia[1], y[:3]), dot(p.inertia[2], y[:3])
    return p.inertia[0] * y[0], p.inertia[1] * y[1], p.inertia[2] * y[2]


def gamma_squared(p: Parameters, y: Any) -> Any:
    """|γ|² = 1, the first of (1.3)."""
    return dot(y[3:6], y[3:6])


def area(p: Parameters, y: Any) -> Any:
    """C0 = M·γ, the second of (1.3)."""
    return dot(momentum(p, y), y[3:6])


def energy(p: Parameters, y: Any) -> Any:
    """C1 = ½ Ω·M + P r·γ, the third of (1.3)."""
    return dot(momentum(p, y), y[:3]) / 2 + dot(p.moment, y[3:6])


def momentum_squared(p: Parameters, y: Any) -> Any:
    """|M|²: Euler's top (P r = 0), and the gyrostat."""
    m = momentum(p, y)
    return dot(m, m)


def gyrostat_energy(p: Parameters, y: Any) -> Any:
    """½ M·I⁻¹M + λ M2, the gyrostat's energy."""
    m = momentum(p, y)
    return dot(m, y[:3]) / 2 + p.rotor * m[1]


def spin(p: Parameters, y: Any, axes: Axes) -> Any:
    """Lagrange's integral: Ω along the axis of symmetry ``axes[2]``."""
    return y[axes[2]]


def kovalevskaya_xi(p: Parameters, y: Any, axes: Axes) -> tuple[Any, Any]:
    """ξ = (Ω1 + iΩ2)² − (n1 + i n2)(γ1 + iγ2), n = P r/I3, the small moment on axis ``axes[2]``: (real, imaginary)."""
    i, j, k = axes
    a, b = p.moment[i], p.moment[j]
    real = y[i] * y[i] - y[j] * y[j] - (a * y[3 + i] - b * y[3 + j]) / p.inertia[k]
    imaginary = y[i] * y[j] + y[i] * y[j] - (a * y[3 + j] + b * y[3 + i]) / p.inertia[k]
    return real, imaginary


def kovalevskaya(p: Parameters, y: Any, axes: Axes) -> Any:
    """|ξ|² of :func:`kovalevskaya_xi`."""
    real, imaginary = kovalevskaya_xi(p, y, axes)
    return real * real + imaginary * imaginary


def goryachev_chaplygin(p: Parameters, y: Any, axes: Axes) -> Any:
    """Ω3 (Ω1² + Ω2²) − (n1 Ω1 + n2 Ω2) γ3, n = P r/I3, conserved on C0 = 0; the small moment on axis ``axes[2]``."""
    i, j, k = axes
    along = p.moment[i] * y[i] + p.moment[j] * y[j]
    return y[k] * (y[i] * y[i] + y[j] * y[j]) - along * y[3 + k] / p.inertia[k]


def hess(p: Parameters, y: Any, axes: Axes) -> Any:
    """I1 a Ω1 + I3 c Ω3 (times P), an invariant relation: conserved where it is 0."""
    i, _, k = axes
    return p.moment[i] * p.inertia[i] * y[i] + p.moment[k] * p.inertia[k] * y[k]


def moment_along_centre(p: Parameters, y: Any) -> Any:
    """M·r (times P) of a top with I1 = I2 = I3."""
    return dot(momentum(p, y), p.moment)


def momentum_with_rotor(p: Parameters, y: Any) -> tuple[Any, Any, Any]:
    """M = I Ω + k of `heavy_gyrostat`."""
    first, second, third = momentum(p, y)
    return first + p.rotor[0], second + p.rotor[1], third + p.rotor[2]


def area_with_rotor(p: Parameters, y: Any) -> Any:
    """M·γ with M = I Ω + k."""
    return dot(momentum_with_rotor(p, y), y[3:6])


def momentum_with_rotor_squared(p: Parameters, y: Any) -> Any:
    """|M|² with M = I Ω + k: P r = 0, the gyrostat of Zhukovsky and Volterra."""
    m = momentum_with_rotor(p, y)
    return dot(m, m)


def _equatorial_square(y: Any, axes: Axes) -> Any:
    return y[axes[0]] * y[axes[0]] + y[axes[1]] * y[axes[1]]


def kovalevskaya_yehia(p: Parameters, y: Any, axes: Axes) -> Any:
    """|ξ|² of :func:`kovalevskaya_xi` + 2λ (Ω3 − λ)(Ω1² + Ω2²) − 4λ (n1 Ω1 + n2 Ω2) γ3, λ = k3/I3, n = P r/I3.

    The rotor lies on the axis of the small moment, ``axes[2]``.  Source: H. M. Yehia, 1986.
    """
    i, j, k = axes
    rotor = p.rotor[k] / p.inertia[k]
    along = (p.moment[i] * y[i] + p.moment[j] * y[j]) * y[3 + k] / p.inertia[k]
    half = rotor * ((y[k] - rotor) * _equatorial_square(y, axes) - (along + along))
    return kovalevskaya(p, y, axes) + half + half


def sretensky(p: Parameters, y: Any, axes: Axes) -> Any:
    """(Ω3 − λ)(Ω1² + Ω2²) − (n1 Ω1 + n2 Ω2) γ3, λ = k3/I3, n = P r/I3, conserved on M·γ = 0.

    The rotor lies on the axis of the small moment, ``axes[2]``.  Source: L. N. Sretensky, 1963.
    """
    rotor = p.rotor[axes[2]] / p.inertia[axes[2]]
    return goryachev_chaplygin(p, y, axes) - rotor * _equatorial_square(y, axes)


class _Magnitude:
    """A bound of |x| in a ring: that of a difference is a sum, so that no terms cancel."""

    def __init__(self, size: Any) -> None:
        self.size: Any = size.size if isinstance(size, _Magnitude) else abs(size)

    def __add__(self, other: Any) -> _Magnitude:
        return _Magnitude(self.size + _Magnitude(other).size)

    def __mul__(self, other: Any) -> _Magnitude:
        return _Magnitude(self.size * _Magnitude(other).size)

    def __truediv__(self, other: Any) -> _Magnitude:
        return _Magnitude(self.size / _Magnitude(other).size)

    __sub__ = __radd__ = __add__
    __rmul__ = __mul__


def largest(integral: Integral, p: Parameters, omega: Any) -> Any:
    """The sum of the absolute terms of a first integral where every |Ω_i| is ``omega`` and every |γ_i| is 1."""
    return integral.value(p.mapped(_Magnitude), [*map(_Magnitude, (omega,) * 3), *map(_Magnitude, (1, 1, 1))]).size


def holding(top: HeavyTop, start: State, system: System = HEAVY_TOP) -> tuple[Integral, ...]:
    """Every integral that holds for this top and start, found by exact rational tests on the exact data.

    Invariant relations (Goryachev-Chaplygin, Hess) are offered only for starts on them.
    """
    square = Integral("gamma_squared", gamma_squared, "every motion")
    if system is GYROSTAT:
        return (square, Integral("area", area, "every motion"), *_of_gyrostat(top))
    with_rotor = system is HEAVY_GYROSTAT
    about_gamma = Integral("area", area_with_rotor if with_rotor else area, "every motion")
    more = _of_heavy_gyrostat if with_rotor else _of_heavy_top
    p = system.parameters(top, start)
    return (square, about_gamma, Integral("energy", energy, "every motion"), *more(p, start.flat))


def _of_gyrostat(top: HeavyTop) -> Iterator[Integral]:
    yield Integral("momentum_squared", momentum_squared, "every motion of the gyrostat")
    yield Integral("gyrostat_energy", gyrostat_energy, "every motion of the gyrostat")
    if top.inertia[0] == top.inertia[2]:
        yield Integral("spin2", partial(spin, axes=(2, 0, 1)), "I1 = I3: the rotor lies on the axis of symmetry")


def _of_heavy_top(p: Parameters, y: tuple[Any, ...]) -> Iterator[Integral]:
    n = p.moment
    if not any(n):
        yield Integral("momentum_squared", momentum_squared, "Euler: P r = 0")
    if p.inertia[0] == p.inertia[1] == p.inertia[2] and any(n):
        yield Integral("moment_along_centre", moment_along_centre, "I1 = I2 = I3")
    on_zero_area = area(p, y) == 0
    for axes in permutations(range(3)):
        i, j, k = axes
        i1, i2, i3 = (p.inertia[axis] for axis in axes)
        if i < j and i1 == i2:
            if n[i] == n[j] == 0:
                yield Integral(f"spin{k + 1}", partial(spin, axes=axes), f"Lagrange about axis {k + 1}")
            if i1 == 2 * i3 and n[k] == 0:
                yield Integral("kovalevskaya", partial(kovalevskaya, axes=axes), f"Kovalevskaya about axis {k + 1}")
        if i < j and i1 == i2 == 4 * i3 and n[k] == 0 and any(n) and on_zero_area:
            yield Integral(
                "goryachev_chaplygin",
                partial(goryachev_chaplygin, axes=axes),
                f"Goryachev-Chaplygin about axis {k + 1}, on M·gamma = 0",
            )
        if i < k and n[j] == 0 and n[i] != 0 and n[k] != 0 and i1 * (i2 - i3) * n[i] ** 2 == i3 * (i1 - i2) * n[k] ** 2:
            relation = partial(hess, axes=axes)
            if relation(p, y) == 0:
                yield Integral("hess", relation, "Hess, on its invariant relation")


def _of_heavy_gyrostat(p: Parameters, y: tuple[Any, ...]) -> Iterator[Integral]:
    n, rotor = p.moment, p.rotor
    if not any(n):
        yield Integral("momentum_squared", momentum_with_rotor_squared, "Zhukovsky-Volterra: P r = 0")
    if p.inertia[0] == p.inertia[1] == p.inertia[2] and any(n) and not any(cross(rotor, n)):
        yield Integral("moment_along_centre", moment_along_centre, "I1 = I2 = I3, the rotor along r")
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        i, j, k = axes
        if p.inertia[i] != p.inertia[j] or rotor[i] != 0 or rotor[j] != 0:
            continue
        if n[i] == n[j] == 0:
            yield Integral(f"spin{k + 1}", partial(spin, axes=axes), f"Lagrange's gyrostat about axis {k + 1}")
        if n[k] != 0 or not any(n):
            continue
        if p.inertia[i] == 2 * p.inertia[k]:
            relation = partial(kovalevskaya_yehia, axes=axes)
            yield Integral("kovalevskaya_yehia", relation, f"Kovalevskaya-Yehia about axis {k + 1}")
        if p.inertia[i] == 4 * p.inertia[k] and area_with_rotor(p, y) == 0:
            condition = f"Sretensky about axis {k + 1}, on M·gamma = 0"
            yield Integral("sretensky", partial(sretensky, axes=axes), condition)
