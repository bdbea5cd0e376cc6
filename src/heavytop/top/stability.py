"""Whether an equilibrium, a permanent rotation or a regular precession is stable, decided in exact rationals.

Linearised about a steady motion, the field has eigenvalues ±λ beside those, 0, of its conserved quantities: λ² are the
roots of a polynomial of degree one (of Ω alone, where γ does not enter its rates) or two, of rational coefficients.
One of them that is positive or not real proves the motion unstable, at the rate max Re λ.  That none is proves nothing
by itself.  Stable is said where the second variation of E − ω M·γ − κ γ²/2 is definite on the level of the two Casimir
functions (Arnold's energy-Casimir method, (M, γ) at an equilibrium with Ω = ωγ), of a free rotation about the axis of
the largest or smallest moment, of Lagrange's sleeping top where (I3 Ω3)² > 4 I1 P r·γ, and of a regular precession of
his top, whose inclination is a minimum of the effective potential.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from flint import fmpq, fmpq_mat

from heavytop.precision import cross
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, Parameters, System

Matrix = list[list[Fraction]]
_AXES = {0: "smallest", 1: "middle", 2: "largest"}


@dataclass(frozen=True, slots=True)
class Stability:
    """motion: which it is, in words.  verdict: ``"stable"`` and ``"unstable"`` are proven; ``"spectrally stable"``: no
    eigenvalue proves it unstable, and nothing proves it stable.  rate: max Re λ, 1/time unit; 0 unless unstable.
    """

    motion: str
    verdict: Literal["stable", "unstable", "spectrally stable"]
    rate: float = 0.0

    def text(self, bits: int = 53) -> str:
        """A sentence; bits: of a rounding whose growth is told."""
        if self.verdict != "unstable":
            why = "" if self.verdict == "stable" else ": no eigenvalue proves it unstable, and nothing proves it stable"
            return f"{self.motion}, {self.verdict}{why}"
        until = bits * math.log(2) / self.rate
        return f"{self.motion}, unstable, {self.rate:.4g} per unit of time: 2^-{bits} grows to 1 by t = {until:.2g}"


def stability(system: System, parameters: Parameters, start: Sequence[Fraction]) -> Stability | None:
    """Stability of the motion from an exact start, six numbers; None where it is not steady."""
    p, y = parameters.mapped(Fraction), [Fraction(value) for value in start]
    rates = system.field(p, y)
    free = system is GYROSTAT or not any(p.moment)
    if any(rates[:3]) or (any(rates[3:]) and not free):
        return _precession(system, p, y)
    size = 3 if free else 6
    jacobian = _jacobian(system, p, y, size)
    motion = _words(system, p, y, free)
    powers = _characteristic(jacobian)

    squares = powers[0 : 4 if free else 6 : 2]
    rate = _largest_real_part(squares)
    if rate:
        return Stability(motion, "unstable", rate)
    return Stability(motion, "stable" if _proven_stable(system, p, y, free) else "spectrally stable")


def _jacobian(system: System, p: Parameters, y: Sequence[Fraction], size: int) -> Matrix:
    """The Jacobian of the first components; exact as the field is of degree two: half a difference of steps 1."""
    columns = []
    for j in range(size):
        up, down = (system.field(p, [v + sign * (k == j) for k, v in enumerate(y)]) for sign in (1, -1))
        columns.append([(a - b) / 2 for a, b in zip(up[:size], down[:size], strict=True)])
    return [list(row) for row in zip(*columns, strict=True)]


def _characteristic(matrix: Matrix) -> list[Fraction]:
    """1, c1, ..., cn of λⁿ + c1 λⁿ⁻¹ + ... + cn."""
    entries = [fmpq(value.numerator, value.denominator) for row in matrix for value in row]
    polynomial = fmpq_mat(len(matrix), len(matrix), entries).charpoly()
    return [Fraction(int(c.p), int(c.q)) for c in reversed(polynomial.coeffs())]


def _inner(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    """Σ a_i b_i, of vectors of any length."""
    return sum((v * w for v, w in zip(a, b, strict=True)), Fraction(0))


def _largest_real_part(squares: Sequence[Fraction]) -> float:
    """max Re λ where μ = λ² are the roots of 1, a or 1, a, b; 0 where all μ are real and not positive."""
    a, b = (*squares[1:], Fraction(0))[:2]
    disc = a * a - 4 * b
    if disc >= 0:
        if a >= 0 and b >= 0:
            return 0.0
        # the larger root without cancellation
        root = _root(disc)
        largest = (root - float(a)) / 2 if a <= 0 else float(-2 * b) / (root + float(a))
        return math.sqrt(largest)
    # μ = (−a ± i √−disc)/2 and Re √μ = √((|μ| + Re μ)/2), |μ|² = b
    size = _root(b)
    together = size - float(a) / 2 if a <= 0 else float(-disc) / 4 / (size + float(a) / 2)
    return math.sqrt(together / 2)


def _root(value: Fraction) -> float:
    shift = 2 * ((value.denominator.bit_length() - value.numerator.bit_length()) // 2)
    return math.sqrt(value * Fraction(2) ** shift) * 2.0 ** (-shift // 2)


def _words(system: System, p: Parameters, y: Sequence[Fraction], free: bool) -> str:
    turning = [k for k in range(3) if y[k]]
    if not turning:
        return "equilibrium"
    if len(set(p.inertia)) == 3 and len(turning) == 1 and free:
        return f"permanent rotation about the {_AXES[sorted(p.inertia).index(p.inertia[turning[0]])]} axis"
    about = f"axis {turning[0] + 1}" if len(turning) == 1 else "an axis fixed in the body"
    return f"permanent rotation about {about}"


def _proven_stable(system: System, p: Parameters, y: Sequence[Fraction], free: bool) -> bool:
    if system is not HEAVY_TOP:
        return False
    turning = [k for k in range(3) if y[k]]
    if free:
        others = [p.inertia[k] for k in range(3) if k not in turning]
        own = {p.inertia[k] for k in turning}
        return len(own) == 1 and (all(i < min(own) for i in others) or all(i > min(own) for i in others))
    return _sleeps(p, y) or _definite(p, y)


def _sleeps(p: Parameters, y: Sequence[Fraction]) -> bool:
    """Lagrange's top on its axis, fast enough."""
    for k in range(3):
        i, j = ((k + 1) % 3, (k + 2) % 3)
        if p.inertia[i] == p.inertia[j] and not (p.moment[i] or p.moment[j] or y[i] or y[j] or y[3 + i] or y[3 + j]):
            return bool((p.inertia[k] * y[k]) ** 2 > 4 * p.inertia[i] * p.moment[k] * y[3 + k])
    return False


def _definite(p: Parameters, y: Sequence[Fraction]) -> bool:
    """Whether the second variation is definite on the tangent space δM·γ + M·δγ = 0, γ·δγ = 0."""
    gamma, momentum = y[3:], [i * w for i, w in zip(p.inertia, y[:3], strict=True)]
    square = _inner(gamma, gamma)
    turning = _inner(y[:3], gamma) / square
    kappa = (_inner(p.moment, gamma) - turning * _inner(momentum, gamma)) / square
    axis = max(range(3), key=lambda k: abs(gamma[k]))
    across = [cross(gamma, [Fraction(k == j) for k in range(3)]) for j in range(3) if j != axis]
    basis = [[*v, Fraction(0), Fraction(0), Fraction(0)] for v in across]
    basis += [[*(-_inner(momentum, v) / square * g for g in gamma), *v] for v in across]

    def form(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
        kinetic = sum((u * v / i for u, v, i in zip(a[:3], b[:3], p.inertia, strict=True)), Fraction(0))
        return kinetic - turning * (_inner(a[:3], b[3:]) + _inner(a[3:], b[:3])) - kappa * _inner(a[3:], b[3:])

    hessians = [[[form(u, v) for v in basis[:n]] for u in basis[:n]] for n in range(1, 5)]
    minors = [_characteristic(hessian)[-1] * (-1) ** len(hessian) for hessian in hessians]
    return all(minor > 0 for minor in minors)  # kinetic energy is positive: it is never negative definite


def _precession(system: System, p: Parameters, y: Sequence[Fraction]) -> Stability | None:
    """A precession of Lagrange's top, or of a free body of revolution: where its inclination stays."""
    if system is not HEAVY_TOP:
        return None
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        if p.inertia[i] != p.inertia[j] or p.moment[i] or p.moment[j]:
            continue
        rates = system.field(p, y)
        falling = [y[3 + i] * y[j], y[3 + j] * y[i]]
        faster = rates[3 + i] * y[j] + y[3 + i] * rates[j] - rates[3 + j] * y[i] - y[3 + j] * rates[i]
        if falling[0] == falling[1] and not faster and p.moment[k]:
            return Stability(f"regular precession of axis {k + 1}", "stable")
    return None
