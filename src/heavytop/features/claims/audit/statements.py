"""The equations of the heavy top as statements about a claimed motion, and the explanation when (1.2) fails.

The fields, integrals and angles are those of :mod:`heavytop.top`, over sympy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
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

    rate: the derivative in time.  rates: (φ', θ', ψ').
    constants: (|γ|², C0, C1) of (1.3); without them (1.3) states that the three are constant.
    needs: of Ω and γ.  attitude, angle_needs, pole: as in Formulas.
    clock: of a quadrature, F' and 1/F', which have to be continuous for the motion to exist.
    identities: of a quaternion or a matrix, residuals that are 0 for an attitude, each with its equation.
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
    identities: Identities = ()

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

    def compared(
        self, equation: str, left: Iterable[sympy.Expr], right: Iterable[sympy.Expr], text: str
    ) -> Iterator[Statement]:
        """The statements that two vectors are equal, which rest on the angles."""
        for component, (a, b) in enumerate(zip(left, right, strict=True), 1):
            yield Statement(equation, component, self.branch, self.domain, a - b, text, self.angle_formulas)


def attitude(phi: sympy.Expr, theta: sympy.Expr, psi: sympy.Expr) -> tuple[sympy.Expr, ...]:
    """γ and ξ of the angles, which are continuous where the attitude is, at the poles too."""
    return (*gamma_from_angles(phi, theta, SYMBOLIC), *attitude_from_angles(phi, theta, psi, SYMBOLIC))


def motion_statements(motion: ClaimedMotion, p: Parameters, system: System) -> Iterator[Statement]:
    """(1.1), (1.2), (1.3) and, where there are angles, (3.1), each component, about ``system``."""
    y = motion.state
    velocity = "(Omega + lambda*e2)" if system is GYROSTAT else "Omega"
    torque = "" if system is GYROSTAT else " + P*gamma x r"
    carried = ", M = I*Omega + k" if system is HEAVY_GYROSTAT else ""
    field = system.rates(p, y)
    for index, (value, claimed) in enumerate(zip(y, field, strict=True)):
        text = f"gamma' = gamma x {velocity}" if index >= 3 else f"M' = M x {velocity}{torque}{carried}"
        residual = motion.rate(value) - claimed
        yield _statement("1.2" if index >= 3 else "1.1", index % 3 + 1, motion, residual, text)
    yield from _integral_statements(motion, p, system)
    omega = system.angular_velocity(p, y)
    if motion.phi is not None and motion.rates is not None:
        of_angles = omega_from_angles(motion.gamma, motion.phi, motion.rates, SYMBOLIC)
        text = f"{velocity} = psi', theta', phi' of the angles"
        yield from motion.compared("3.1", omega, of_angles, text)
    if motion.identities:
        xi = motion.attitude[:3]
        equations = [
            (ours - theirs, "xi' = xi x Omega, the first row of R")
            for ours, theirs in zip(map(motion.rate, xi), cross(xi, omega), strict=True)
        ]
        for component, (residual, text) in enumerate((*motion.identities, *equations), 1):
            yield Statement("attitude", component, motion.branch, motion.domain, residual, text, motion.angle_formulas)


def of_quaternion(q: Sequence[sympy.Expr], rate: Derivative) -> tuple[tuple[sympy.Expr, ...], Triple, Identities]:
    """R row by row, Ω = 2 Im(q* q'), and |q|² = 1."""
    w, *v = q
    products = cross(v, [rate(part) for part in v])
    omega = [2 * (w * rate(part) - rate(w) * part - product) for part, product in zip(v, products, strict=True)]
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
    """The general steps, each a polynomial identity in Ω, γ, δ, I and P r, checked by expansion.

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
    difference = [momentum - c0 * g for momentum, g in zip(m, gamma, strict=True)]
    square = momentum_squared(p, state) - 2 * c0 * area(p, state) + c0**2 * gamma_squared(p, state)
    along = "with gamma' = gamma x Omega + delta and (1.1):"
    identities = [
        (
            "|M|^2 = C0^2 with (1.3) makes |M - C0*gamma|^2 = C0^2 - 2*C0*C0 + C0^2 = 0: M is parallel to gamma (2.1)",
            dot(difference, difference) - square,
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
"""The systems of the paper, and of tops without k."""
