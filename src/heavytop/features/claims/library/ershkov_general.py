"""The paper's general case (2.1)-(2.4), (3.3), (3.4) exactly as printed: a = c = 0.

Every formula takes numbers of any ring and ``lib`` as in :mod:`heavytop.features.claims.library.ershkov`. Ω2 is the
variable: Ω1² and Ω3² are polynomials in it, and (2.3) gives its motion.  Both roots of (2.2) and (2.4) are printed as
squares; the paper takes the positive ones.  The flow takes them with sign(Ω1 Ω3) = -sign(Ω2') for I1 > I3, by the
second equation of (1.1).
"""

from __future__ import annotations

from typing import Any, Generic, NamedTuple

from heavytop.precision import Real
from heavytop.top.attitude import Library


class GeneralConstants(NamedTuple, Generic[Real]):
    """Data of the general case in any ring: I1 != I3, C0 != 0."""

    inertia: tuple[Real, Real, Real]
    weight: Real
    b: Real
    c0: Real
    c1: Real


def gamma(c: GeneralConstants[Real], omega: tuple[Real, Real, Real]) -> tuple[Real, Real, Real]:
    """(2.1): γ = (I1 Ω1, I2 Ω2, I3 Ω3)/C0."""
    i1, i2, i3 = c.inertia
    return i1 * omega[0] / c.c0, i2 * omega[1] / c.c0, i3 * omega[2] / c.c0


def omega3_squared(c: GeneralConstants[Real], omega2: Real) -> Real:
    """(2.2): Ω3² = (C2 C3 + (I2 − I1) I2 Ω2² − b I2 C3 Ω2)/((I1 − I3) I3)."""
    i1, i2, i3 = c.inertia
    c2 = c.c0 * (c.c1 / c.weight - c.c0 * c.c0 / (2 * c.weight * i1))
    c3 = 2 * c.weight * i1 / c.c0
    return (c2 * c3 + (i2 - i1) * i2 * (omega2 * omega2) - c.b * i2 * c3 * omega2) / ((i1 - i3) * i3)


def f1(c: GeneralConstants[Real], omega2: Real) -> Real:
    """f1 of (2.3)."""
    i1, i2, i3 = c.inertia
    return (
        (2 * i1 * c.c1 - c.c0 * c.c0) / (i3 * i2)
        - 2 * c.weight * i1 * c.b / (c.c0 * i3) * omega2
        + (i2 - i1) * (omega2 * omega2) / i3
    )


def f2(c: GeneralConstants[Real], omega2: Real) -> Real:
    """f2 of (2.3)."""
    i1, i2, i3 = c.inertia
    return (
        (c.c0 * c.c0 - 2 * i3 * c.c1) / (i1 * i2)
        + 2 * c.weight * i3 * c.b / (c.c0 * i1) * omega2
        - (i2 - i3) / i1 * (omega2 * omega2)
    )


def omega1_squared(c: GeneralConstants[Real], omega2: Real) -> Real:
    """(2.4): Ω1² as a polynomial in Ω2."""
    i1, i2, i3 = c.inertia
    return (
        (c.c0 * c.c0 - 2 * i3 * c.c1) / (i1 * (i1 - i3))
        + 2 * c.weight * i3 * c.b * i2 / (c.c0 * i1 * (i1 - i3)) * omega2
        - i2 / i1 * ((i2 - i3) / (i1 - i3)) * (omega2 * omega2)
    )


def phi(c: GeneralConstants[Real], omega: tuple[Real, Real, Real], lib: Library) -> Any:
    """(3.3): φ = arctan(I1 Ω1/(I2 Ω2))."""
    return lib.arctan(c.inertia[0] * omega[0] / (c.inertia[1] * omega[1]))


def theta(c: GeneralConstants[Real], omega: tuple[Real, Real, Real], lib: Library) -> Any:
    """(3.3): θ = arccos(I3 Ω3/C0)."""
    return lib.arccos(c.inertia[2] * omega[2] / c.c0)


def psi_rate(c: GeneralConstants[Real], omega3: Real, phi_rate: Real) -> Real:
    """(3.4): ψ' = (C0/I3)(1 − φ'/Ω3)."""
    return c.c0 / c.inertia[2] * (1 - phi_rate / omega3)
