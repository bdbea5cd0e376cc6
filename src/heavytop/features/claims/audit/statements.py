"""The equations of the heavy top as statements about a claimed motion, and the explanation when (1.2) fails.

The fields, integrals and angles are those of :mod:`heavytop.top`, over sympy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace

import sympy

from heavytop.features.claims.algebra.conditions import Need
from heavytop.features.claims.algebra.statement import Domain, Formulas, Statement
from heavytop.features.claims.audit.judge import ExplanationStep
from heavytop.precision import cross, dot
from heavytop.top.attitude import (
    attitude_from_angles,
    gamma_from_angles,
    matrix_of_quaternion,
    omega_from_angles,
    transposed,
)
from heavytop.top.equations import (
    GYROSTAT,
    HEAVY_GYROSTAT,
    HEAVY_TOP,
    Parameters,
    System,
    area,
    energy,
    gamma_squared,
    gyrostat_energy,
    momentum,
    momentum_squared,
)

_NAMES = ("sqrt", "exp", "log", "sin", "cos", "tanh", "sech", "atan2")
SYMBOLIC = SimpleNamespace(**{n: getattr(sympy, n) for n in _NAMES}, arctan=sympy.atan, arccos=sympy.acos)

Derivative = Callable[[sympy.Expr], sympy.Expr]
Triple = tuple[sympy.Expr, sympy.Expr, sympy.Expr]
Rows = Sequence[Sequence[sympy.Expr]]
Identities = tuple[tuple[sympy.Expr, str], ...]


@dataclass(frozen=True, slots=True)
class ClaimedMotion:
    """A claimed motion on one branch and domain, as expressions.

    rate: the derivative in time.  angles: (φ, θ); rates: (φ', θ', ψ').
    constants: (|γ|², C0, C1) that (1.3) should have; without them (1.3) says that the three are constant.
    needs: what Ω and γ need to be defined.  attitude, angle_needs, pole: as in Formulas.
    clock: of a quadrature, F' and 1/F', which have to be continuous for the motion to exist.
    turned: of a quaternion or a matrix, what is 0 where it is the attitude, each with the equation in words.
    """

    branch: str
    domain: Domain
    omega: Triple
    gamma: Triple
    rate: Derivative
    phi: sympy.Expr | None = None
    rates: Triple | None = None
    constants: Triple | None = None
    needs: frozenset[Need] = frozenset()
    attitude: tuple[sympy.Expr, ...] = ()
    angle_needs: frozenset[Need] = frozenset()
    pole: str = ""
    clock: tuple[sympy.Expr, ...] = ()
    turned: tuple[tuple[sympy.Expr, str], ...] = ()

    @property
    def state(self) -> tuple[sympy.Expr, ...]:
        """The six variables in the order of the state."""
        return (*self.omega, *self.gamma)

    @property
    def formulas(self) -> Formulas:
        """The formulas that the equations in Ω and γ rest on."""
        return Formulas((*self.state, *self.clock), self.needs)

    @property
    def angle_formulas(self) -> Formulas:
        """The formulas that the equations in the angles rest on."""
        return Formulas((*self.state, *self.clock), self.needs, self.attitude, self.angle_needs, self.pole)


def attitude(phi: sympy.Expr, theta: sympy.Expr, psi: sympy.Expr) -> tuple[sympy.Expr, ...]:
    """γ and ξ of the angles: they are continuous where the attitude is, at the poles too."""
    return (*gamma_from_angles(phi, theta, SYMBOLIC), *attitude_from_angles(phi, theta, psi, SYMBOLIC))


def motion_statements(motion: ClaimedMotion, p: Parameters, system: System) -> Iterator[Statement]:
    """(1.1), (1.2), (1.3) and, where there are angles, (3.1), each component, about ``system``."""
    y = motion.state
    turning = "(Omega + lambda*e2)" if system is GYROSTAT else "Omega"
    torque = "" if system is GYROSTAT else " + P*gamma x r"
    carried = ", M = I*Omega + k" if system is HEAVY_GYROSTAT else ""
    field = system.rates(p, y)
    for index, (value, claimed) in enumerate(zip(y, field, strict=True)):
        text = f"gamma' = gamma x {turning}" if index >= 3 else f"M' = M x {turning}{torque}{carried}"
        residual = motion.rate(value) - claimed
        yield _statement("1.2" if index >= 3 else "1.1", index % 3 + 1, motion, residual, text)
    yield from _integral_statements(motion, p, system)
    if motion.phi is not None and motion.rates is not None:
        turned = omega_from_angles(motion.gamma, motion.phi, motion.rates, SYMBOLIC)
        actual = system.angular_velocity(p, y)
        for component, (ours, theirs) in enumerate(zip(actual, turned, strict=True), 1):
            text = f"{turning} = psi', theta', phi' of the angles"
            statement = _statement("3.1", component, motion, ours - theirs, text)
            yield replace(statement, formulas=motion.angle_formulas)
    for component, (residual, text) in enumerate(_turning(motion, system.angular_velocity(p, y)), 1):
        yield replace(_statement("attitude", component, motion, residual, text), formulas=motion.angle_formulas)


def _turning(motion: ClaimedMotion, omega: Sequence[sympy.Expr]) -> Iterator[tuple[sympy.Expr, str]]:
    """Residuals that are 0 where a quaternion or a matrix is the attitude: its own identities, and ξ' = ξ × Ω."""
    if motion.turned:
        yield from motion.turned
        xi = motion.attitude[:3]
        for ours, theirs in zip(map(motion.rate, xi), cross(xi, omega), strict=True):
            yield ours - theirs, "xi' = xi x Omega, the first row of R"


def of_quaternion(q: Sequence[sympy.Expr], rate: Derivative) -> tuple[tuple[sympy.Expr, ...], Triple, Identities]:
    """R row by row, Ω = 2 Im(q* q'), and |q|² = 1."""
    w, *v = q
    turn = cross(v, [rate(part) for part in v])
    omega = [2 * (w * rate(part) - rate(w) * part - across) for part, across in zip(v, turn, strict=True)]
    return (
        tuple(part for row in matrix_of_quaternion(q) for part in row),
        (omega[0], omega[1], omega[2]),
        ((sum(part**2 for part in q) - 1, "|q|^2 = 1"),),
    )


def of_matrix(rows: Rows, rate: Derivative) -> tuple[tuple[sympy.Expr, ...], Triple, Identities]:
    """R row by row, Ω of R' = R [Ω]×, and R⁻¹ = Rᵀ with det R = 1, by ξ, η = γ × ξ and γ."""
    xi, eta, gamma = rows
    one, two, three = transposed(rows)
    rates = transposed([[rate(part) for part in row] for row in rows])
    omega = dot(three, rates[1]), dot(one, rates[2]), dot(two, rates[0])
    identities = [(dot(xi, xi) - 1, "|xi|^2 = 1, the first row of R"), (dot(xi, gamma), "xi.gamma = 0")]
    identities += [(a - b, "eta = gamma x xi, the second row of R") for a, b in zip(eta, cross(gamma, xi), strict=True)]
    return (*xi, *eta, *gamma), omega, tuple(identities)


def _integral_statements(motion: ClaimedMotion, p: Parameters, system: System) -> Iterator[Statement]:
    third = {
        HEAVY_TOP.name: (energy, "Omega.M/2 + P*r.gamma", "C1"),
        GYROSTAT.name: (gyrostat_energy, "Omega.M/2 + lambda*M2", "C1"),
        HEAVY_GYROSTAT.name: (energy, "Omega.(M - k)/2 + P*r.gamma", "C1"),
    }[system.name]
    known = (gamma_squared, "|gamma|^2", "1"), (area, "M.gamma", "C0"), third
    for component, (integral, left, right) in enumerate(known, 1):
        text = f"{left} = {right}"
        value = integral(p, motion.state)
        if motion.constants is not None:
            yield _statement("1.3", component, motion, value - motion.constants[component - 1], text)
        elif component == 1:
            yield _statement("1.3", component, motion, value - 1, text)
        else:
            yield _statement("1.3", component, motion, motion.rate(value), f"{left} is constant")


def _statement(equation: str, component: int, motion: ClaimedMotion, residual: sympy.Expr, text: str) -> Statement:
    return Statement(equation, component, motion.branch, motion.domain, residual, text, motion.formulas)


def why_not_equivalent() -> Sequence[ExplanationStep]:
    """The general steps, each a polynomial identity in Ω, γ, δ, I and P r, checked by expanding it.

    Along (1.1) with γ' = γ × Ω + δ the rates of (1.3) are 2γ·δ, M·δ and P r·δ; so they force δ = 0 only where
    det(γ, M, r) is not 0.  And |M|² = C0² with (1.3) makes |M − C0 γ|² = 0.
    """
    omega, gamma, delta, inertia, moment = (
        sympy.symbols(f"{name}1:4") for name in ("Omega", "gamma", "delta", "I", "n")
    )
    p = Parameters(inertia, moment, sympy.Integer(0))
    state = (*omega, *gamma)
    field = HEAVY_TOP.rates(p, state)
    rates = (*field[:3], *(g + d for g, d in zip(field[3:], delta, strict=True)))

    def rate(value: sympy.Expr) -> sympy.Expr:
        return sum((sympy.diff(value, x) * dx for x, dx in zip(state, rates, strict=True)), sympy.Integer(0))

    m = momentum(p, state)
    c0 = sympy.Symbol("C0")
    off = [ours - c0 * g for ours, g in zip(m, gamma, strict=True)]
    square = momentum_squared(p, state) - 2 * c0 * area(p, state) + c0**2 * gamma_squared(p, state)
    along = "with gamma' = gamma x Omega + delta and (1.1):"
    identities = [
        (
            "|M|^2 = C0^2 with (1.3) makes |M - C0*gamma|^2 = C0^2 - 2*C0*C0 + C0^2 = 0: M is parallel to gamma (2.1)",
            dot(off, off) - square,
        ),
        (f"{along} (|gamma|^2)' = 2*gamma.delta", rate(gamma_squared(p, state)) - 2 * dot(gamma, delta)),
        (f"{along} (M.gamma)' = M.delta", rate(area(p, state)) - dot(m, delta)),
        (f"{along} (energy)' = P*r.delta", rate(energy(p, state)) - dot(moment, delta)),
        (
            "so (1.3) constant gives (1.2) only where det(gamma, M, r) is not 0; for M = C0*gamma it is 0",
            dot(cross(gamma, [c0 * g for g in gamma]), moment),
        ),
    ]
    return [ExplanationStep(text, True if sympy.expand(identity) == 0 else None) for text, identity in identities]


def determinant(motion: ClaimedMotion, p: Parameters) -> Statement:
    """det(γ, M, P r) = 0 along the claim."""
    value = dot(cross(motion.gamma, momentum(p, motion.state)), p.moment)
    return Statement(
        "det(gamma, M, r)", 1, motion.branch, motion.domain, value, "det(gamma, M, P*r) = 0", motion.formulas
    )


SYSTEMS = (HEAVY_TOP, GYROSTAT)
"""Systems of the paper, and of tops without k."""
