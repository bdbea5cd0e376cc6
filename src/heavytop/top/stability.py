"""Whether an equilibrium, a permanent rotation or a regular precession is stable, decided in exact rationals.

Linearised about a steady motion, the field has eigenvalues ±λ, and 0 for its conserved quantities; λ² are the
roots of a polynomial of degree one (of Ω alone, where γ does not enter its rates) or two, of rational coefficients.
A positive or complex root proves the motion unstable, at the rate max Re λ.  The absence of such a root proves nothing
by itself.  A free body of two equal moments that turns about an axis between them is unstable without one: its Jordan
block is a constant part ε of Ω along the axis of symmetry, by which Ω turns at a rate in proportion to ε.
The verdict is *stable* where the second variation of E − ω M·γ − κ γ²/2 − c G is definite on the level of the two
Casimir functions (Arnold's energy-Casimir method; G is |M|²/2 of a free body, M_k of a top symmetric about axis k), and
of a regular precession of Lagrange's top, whose inclination is a minimum of the effective potential.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, Literal

from heavytop.precision import cross, dot
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, Parameters, System

Matrix = list[list[Any]]
_AXES = {0: "smallest", 1: "middle", 2: "largest"}


@dataclass(frozen=True, slots=True)
class Stability:
    """motion: which it is, in words.  verdict: ``"stable"`` and ``"unstable"`` are proven; ``"spectrally stable"``: no
    eigenvalue proves it unstable, and nothing proves it stable.  rate: max Re λ, 1/time unit; 0 unless unstable by an
    eigenvalue.  drift: where Ω turns away linearly in time, the angle over the time and the part ε of Ω; else 0.
    """

    motion: str
    verdict: Literal["stable", "unstable", "spectrally stable"]
    rate: float = 0.0
    drift: float = 0.0

    @property
    def why(self) -> str:
        """The reason of the verdict; empty where an eigenvalue or an energy proves it."""
        if self.drift:
            return (
                f": a component ε of Ω along the axis of symmetry makes it drift away linearly, by {self.drift:.4g} ε t"
            )
        return (
            ": no eigenvalue has a positive real part, and stability is not proven"
            if self.verdict.startswith("spec")
            else ""
        )

    def text(self, bits: int = 53) -> str:
        """A sentence; bits: of the rounding error whose growth it states."""
        if not self.rate:
            return f"{self.motion}, {self.verdict}{self.why}"
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
    rate = _largest_real_part(*quadratic_of_squares(system, p, y, size))
    motion = _words(system, p, y, free)
    drift = _drift(system, p, y) if free and not rate else 0.0
    if rate or drift:
        return Stability(motion, "unstable", rate, drift)
    # of a free rotation γ, which enters no rate of Ω, is taken along Ω
    state = [*y[:3], *y[:3]] if free else y
    proven = system is HEAVY_TOP and any(state[3:]) and is_stable(p, state, _sign)
    return Stability(motion, "stable" if proven else "spectrally stable")


def _drift(system: System, p: Parameters, y: Sequence[Fraction]) -> float:
    """The rate of :func:`drifts` over |Ω|; 0 where none is."""
    return next((_root(square / size) for square, size in drifts(system, p, y) if square), 0.0)


def drifts(system: System, p: Parameters, y: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    """|∂Ω'/∂Ω_k|² and Ω_i² + Ω_j² at a steady free rotation where Ω_k is constant and Ω' linear in the others.

    There two moments are equal, and (Ω_i, Ω_j) turns at the constant rate that Ω_k gives it.  Exact in any ring.
    """
    along_2 = (Fraction(0), p.rotor, Fraction(0)) if system is GYROSTAT else (p.rotor,) * 3
    rotor = p.rotor if isinstance(p.rotor, tuple) else along_2
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        if p.inertia[i] == p.inertia[j] and not rotor[i] and not rotor[j]:
            rates = system.rates(p, [value + int(n == k) for n, value in enumerate(y)])
            yield rates[i] ** 2 + rates[j] ** 2, y[i] ** 2 + y[j] ** 2


def quadratic_of_squares(system: System, p: Parameters, y: Sequence[Any], size: int = 6) -> tuple[Any, Any]:
    """a, b of μ² + a μ + b, whose roots are the μ = λ² of a steady motion; of the first components alone b is 0.

    Exact in any ring, as the field is of degree two: its Jacobian is half a difference of steps 1.  It is unstable if
    a < 0, b < 0 or a² < 4b, and else each λ is imaginary.
    """
    columns = []
    for j in range(size):
        up, down = (system.rates(p, [v + sign * (k == j) for k, v in enumerate(y)]) for sign in (1, -1))
        columns.append([(a - b) / 2 for a, b in zip(up[:size], down[:size], strict=True)])
    square = [[_inner(row, column) for column in columns] for row in zip(*columns, strict=True)]
    second = sum(square[i][i] for i in range(size))
    fourth = sum(square[i][j] * square[j][i] for i in range(size) for j in range(size))
    return -second / 2, (second * second / 2 - fourth) / 4


def _inner(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Σ a_i b_i, of vectors of any length."""
    return sum(v * w for v, w in zip(a, b, strict=True))


def _sign(value: Fraction) -> int:
    return (value > 0) - (value < 0)


def _largest_real_part(a: Fraction, b: Fraction) -> float:
    """max Re λ where μ = λ² are the roots of μ² + a μ + b; 0 where all μ are real and not positive."""
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
    axis = f"axis {turning[0] + 1}" if len(turning) == 1 else "an axis fixed in the body"
    return f"permanent rotation about {axis}"


def is_stable(p: Parameters, y: Sequence[Any], sign: Callable[[Any], int | None]) -> bool:
    """Whether a second variation is definite: Ω and γ of every motion that starts close enough then stay close.

    That is so in all six variables: a definite form on the level of integrals becomes so everywhere with multiples of
    the squares of their deviations.  Exact in any ring with its ``sign``, which may be undecided.
    """
    for squares, zeros, hessian in _second_variations(p, y):
        if all(sign(square) == 1 for square in squares) and all(sign(zero) == 0 for zero in zeros):
            minors = [_determinant([row[:n] for row in hessian[:n]]) for n in range(1, 5)]
            if any(all(sign(s**n * minor) == 1 for n, minor in enumerate(minors, 1)) for s in (1, -1)):
                return True
    return False


def _second_variations(p: Parameters, y: Sequence[Any]) -> Iterator[tuple[list[Any], list[Any], Matrix]]:
    """(quantities to be positive, quantities to be 0, the form) on the tangent space δM·γ + M·δγ = 0, γ·δγ = 0."""
    gamma, momentum = y[3:], [i * w for i, w in zip(p.inertia, y[:3], strict=True)]
    square, spin = dot(gamma, gamma), dot(momentum, gamma)
    for turning, gradient, curvature, zeros, squares in _multipliers(p, y, momentum):
        kappa = (dot(p.moment, gamma) - turning * spin) / square
        first = [w - turning * g - c for w, g, c in zip(y[:3], gamma, gradient, strict=True)]
        first += [n - turning * m - kappa * g for n, m, g in zip(p.moment, momentum, gamma, strict=True)]
        for axis in (k for k in range(3) if gamma[k]):
            across = [cross(gamma, [int(k == j) for k in range(3)]) for j in range(3) if j != axis]
            basis: list[tuple[Sequence[Any], Sequence[Any]]] = [(v, (0, 0, 0)) for v in across]
            basis += [([-dot(momentum, v) / square * g for g in gamma], v) for v in across]
            form = partial(_form, p, turning, curvature, kappa)
            yield [*squares, square, gamma[axis] ** 2], [*zeros, *first], [[form(u, v) for v in basis] for u in basis]


def _form(p: Parameters, turning: Any, curvature: Any, kappa: Any, a: Sequence[Any], b: Sequence[Any]) -> Any:
    kinetic = sum((1 / i - curvature) * u * v for u, v, i in zip(a[0], b[0], p.inertia, strict=True))
    return kinetic - turning * (dot(a[0], b[1]) + dot(a[1], b[0])) - kappa * dot(a[1], b[1])


def _multipliers(p: Parameters, y: Sequence[Any], momentum: Sequence[Any]) -> Iterator[tuple[Any, ...]]:
    """ω, c ∇G and c G'' by M, the quantities that are 0 if G is an integral, and the divisors; without G, and for each.

    −ω of the free body makes the form definite about the axis of the smallest moment, M·γ/(2 I) that of a sleeping top.
    """
    square = dot(y[3:], y[3:])
    turning = dot(y[:3], y[3:]) / square
    yield turning, [0, 0, 0], 0, [], []
    if any(momentum):
        size = dot(momentum, momentum)
        c = (dot(y[:3], momentum) + turning * dot(y[3:], momentum)) / size
        yield -turning, [c * m for m in momentum], c, list(p.moment), [size]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        sleeping = dot(momentum, y[3:]) / (2 * p.inertia[i] * square)
        gradient = [(y[n] - sleeping * y[3 + n]) * int(n == k) for n in range(3)]
        yield sleeping, gradient, 0, [p.inertia[i] - p.inertia[j], p.moment[i], p.moment[j]], []


def _determinant(rows: Matrix) -> Any:
    if len(rows) == 1:
        return rows[0][0]
    return sum(
        (-1) ** k * value * _determinant([[*row[:k], *row[k + 1 :]] for row in rows[1:]])
        for k, value in enumerate(rows[0])
    )


def _precession(system: System, p: Parameters, y: Sequence[Fraction]) -> Stability | None:
    """A precession of constant inclination of Lagrange's top, or of a free body of revolution; None for others."""
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
