"""The paper's formulas exactly as printed, with the paper's equation numbers, and their data.

S. V. Ershkov, "On the invariant motions of rigid body rotation over the fixed point, via Euler's angles".

Every formula takes numbers of any ring and ``lib``, a namespace with sqrt, exp, log, arctan, arccos of those numbers:
numpy for double, extended, quad and real, :data:`heavytop.exact.flint.balls.FUNCTIONS` for balls.  The forms that lose
no digits stand in :mod:`heavytop.exact.cases.ershkov_partial`.

Two branches for t > 0, where the paper's u of (4.2) turns negative:
``smooth``: u of (4.2) throughout, and Ω1 = u √(α − u²);
``printed``: u = √Ω2 and the positive roots of (4.3) and (4.5).  For t <= 0 the two are one.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Generic, Literal, NamedTuple

from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.precision import Real
from heavytop.top.attitude import Library

Branch = Literal["smooth", "printed"]


@dataclass(frozen=True, slots=True)
class PartialCase:
    """Data of the partial case (4.1), exact: α > 0 and I1 = I2 > I3 > 0.  The motion they define is ``solves``."""

    alpha: Fraction
    i1: Fraction
    i3: Fraction

    @property
    def solves(self) -> ErshkovPartial:
        """The stable form: an exact motion of ``gyrostat``; about ``heavy_top`` it is only a claim."""
        return ErshkovPartial(self.alpha, self.i1, self.i3)

    @property
    def c1(self) -> Fraction:
        """C1 = α² I1²/(2 I3), from α = √(2 C1 I3/I1²) of (4.1)."""
        return self.alpha**2 * self.i1**2 / (2 * self.i3)


class Constants(NamedTuple, Generic[Real]):
    """The constants of (4.1), in any ring."""

    i1: Real
    i3: Real
    c1: Real
    alpha: Real
    a: Real
    c0: Real


class Values(NamedTuple, Generic[Real]):
    """The claims of the partial case at one time."""

    omega: tuple[Real, Real, Real]
    gamma: tuple[Real, Real, Real]
    phi: Real
    theta: Real
    psi: Real


def constants(i1: Real, i3: Real, c1: Real, lib: Library) -> Constants[Real]:
    """(4.1): α = √(2 C1 (I3/I1²)), A = √(√(2 C1/I3) (I1 − I3)²/(I1 I3)), C0 = √(2 I3 C1)."""
    alpha = lib.sqrt(2 * c1 * (i3 / (i1 * i1)))
    a = lib.sqrt(lib.sqrt(2 * c1 / i3) * ((i1 - i3) * (i1 - i3) / (i1 * i3)))
    return Constants(i1, i3, c1, alpha, a, lib.sqrt(2 * i3 * c1))


def a_of_6_2(i1: Real, i3: Real, alpha: Real, lib: Library) -> Any:
    """A = √(α (I1 − I3)²/I3²) of (6.2); equal to that of (4.1)."""
    return lib.sqrt(alpha * ((i1 - i3) * (i1 - i3) / (i3 * i3)))


def u(a: Real, alpha: Real, t: Real, lib: Library) -> Any:
    """(4.2): u = (exp(−A√α t) − 1)/(exp(−A√α t) + 1) √α, and Ω2 = u²."""
    growth = lib.exp(-(a * lib.sqrt(alpha)) * t)
    return (growth - 1) / (growth + 1) * lib.sqrt(alpha)


def omega1(c: Constants[Real], omega2: Real, lib: Library) -> Any:
    """(4.3): Ω1 = √((√(2 I3 C1)/I1) Ω2 − Ω2²), the positive root."""
    return lib.sqrt(c.c0 / c.i1 * omega2 - omega2 * omega2)


def omega1_smooth(c: Constants[Real], u: Real, lib: Library) -> Any:
    """The root of (4.3) that follows the flow for all t: u √(α − u²)."""
    return u * lib.sqrt(c.alpha - u * u)


def omega3(c: Constants[Real], omega2: Real, lib: Library) -> Any:
    """(4.4): Ω3 = √((2 C1/I3) (1 − I1/√(2 I3 C1) Ω2))."""
    return lib.sqrt(2 * c.c1 / c.i3 * (1 - c.i1 / c.c0 * omega2))


def gamma(c: Constants[Real], omega: tuple[Real, Real, Real]) -> tuple[Real, Real, Real]:
    """(2.1) with I1 = I2: γ = I Ω/C0."""
    return c.i1 * omega[0] / c.c0, c.i1 * omega[1] / c.c0, c.i3 * omega[2] / c.c0


def phi(c: Constants[Real], u: Real, lib: Library) -> Any:
    """(4.5): φ = arctan √((√(2 I3 C1)/I1)(1/u²) − 1).  Divides by 0 at t = 0."""
    return lib.arctan(lib.sqrt(c.c0 / c.i1 * (1 / (u * u)) - 1))


def theta(c: Constants[Real], u: Real, lib: Library) -> Any:
    """(4.5): θ = arccos √(1 − I1/√(2 I3 C1) u²)."""
    return lib.arccos(lib.sqrt(1 - c.i1 / c.c0 * (u * u)))


def angles_smooth(c: Constants[Real], u: Real, lib: Library) -> tuple[Any, Any]:
    """(φ, θ) with φ = arccos(u/√α), θ = arctan(u/√(α − u²)): (4.5) for t <= 0, and its continuation for t > 0.

    θ takes the sign of −t and φ passes π/2 at t = 0, so γ of (3.2) is that of the smooth branch for all t.
    """
    return lib.arccos(u / lib.sqrt(c.alpha)), lib.arctan(u / lib.sqrt(c.alpha - u * u))


def phi_of_6_1(alpha: Real, u: Real, lib: Library) -> Any:
    """(6.1): φ = arctan √(α/u² − 1).  Divides by 0 at t = 0."""
    return lib.arctan(lib.sqrt(alpha / (u * u) - 1))


def theta_of_6_1(alpha: Real, u: Real, lib: Library) -> Any:
    """(6.1): θ = arccos √(1 − u²/α)."""
    return lib.arccos(lib.sqrt(1 - u * u / alpha))


def psi(i1: Real, i3: Real, alpha: Real, u: Real, t: Real, lib: Library) -> Any:
    """(4.6) and (6.2): ψ = (I1/I3) α t + ½ ln((√α + u)/(√α − u))."""
    root = lib.sqrt(alpha)
    return i1 / i3 * alpha * t + lib.log((root + u) / (root - u)) / 2


def partial_case(i1: Real, i3: Real, c1: Real, t: Real, lib: Library, branch: Branch = "smooth") -> Values[Real]:
    """(4.1)-(4.6) at time t, all in the arithmetic of the numbers given."""
    c = constants(i1, i3, c1, lib)
    u_of_t = u(c.a, c.alpha, t, lib)
    omega2 = u_of_t * u_of_t
    if branch == "printed":
        u_of_t = lib.sqrt(omega2)
    first = omega1_smooth(c, u_of_t, lib) if branch == "smooth" else omega1(c, omega2, lib)
    omega = (first, omega2, omega3(c, omega2, lib))
    return Values(
        omega,
        gamma(c, omega),
        phi(c, u_of_t, lib),
        theta(c, u_of_t, lib),
        psi(i1, i3, c.alpha, u_of_t, t, lib),
    )
