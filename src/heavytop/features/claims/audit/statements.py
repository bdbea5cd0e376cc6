"""The equations of the heavy top as statements about a claimed motion, and the explanation when (1.2) fails.

The fields, integrals and angles are those of :mod:`heavytop.top`, over sympy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
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
Identity = tuple[sympy.Expr, str]
"""An expression that is 0, and the equation in words."""
Identities = tuple[Identity, ...]


@dataclass(frozen=True, slots=True)
class ClaimedMotion:
    """A claimed motion on one branch and domain, as expressions.

    rate: the derivative in time.  rates: (φ', θ', ψ').
    constants: (|γ|², C0, C1) of (1.3); without them (1.3) states that the three are constant.
    needs: of Ω and γ.  attitude, angle_needs, pole: as in Formulas.
    clock: of a quadrature, F, F' and 1/F', which have to be continuous for the motion to exist.
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
        # a quaternion may jump to −q, which is the same attitude
        subject = "Omega and gamma" if self.identities else "the formulas"
        return Formulas((*self.state, *self.clock), self.needs, subject=subject)

    @property
    def angle_formulas(self) -> Formulas:
        """The formulas that the equations in the angles rest on."""
        return replace(self.formulas, attitude=self.attitude, angle_needs=self.angle_needs, pole=self.pole)


def differences(left: Iterable[sympy.Expr], right: Iterable[sympy.Expr], text: str) -> Identities:
    """The components of left − right, which are 0 by the equation ``text``."""
    return tuple((a - b, text) for a, b in zip(left, right, strict=True))


def numbered(
    equation: str, branch: str, domain: Domain, identities: Iterable[Identity], formulas: Formulas = Formulas()
) -> Iterator[Statement]:
    """Identities as the components of one equation."""
    for component, (residual, text) in enumerate(identities, 1):
        yield Statement(equation, component, branch, domain, residual, text, formulas)


def attitude(phi: sympy.Expr, theta: sympy.Expr, psi: sympy.Expr) -> tuple[sympy.Expr, ...]:
    """γ and ξ of the angles, which are continuous where the attitude is, at the poles too."""
    return (*gamma_from_angles(phi, theta, SYMBOLIC), *attitude_from_angles(phi, theta, psi, SYMBOLIC))


def motion_statements(motion: ClaimedMotion, p: Parameters, system: System) -> Iterator[Statement]:
    """(1.1), (1.2), (1.3) and, where there are angles, (3.1), each component, about ``system``."""
    y, field = motion.state, system.rates(p, motion.state)
    rates, omega = [motion.rate(value) for value in y], system.angular_velocity(p, y)
    velocity = "(Omega + lambda*e2)" if system is GYROSTAT else "Omega"
    torque = "" if system is GYROSTAT else " + P*gamma x r"
    carried = ", M = I*Omega + k" if system is HEAVY_GYROSTAT else ""
    in_state = {
        "1.1": differences(rates[:3], field[:3], f"M' = M x {velocity}{torque}{carried}"),
        "1.2": differences(rates[3:], field[3:], f"gamma' = gamma x {velocity}"),
        "1.3": _integrals(motion, p, system),
    }
    in_angles: dict[str, Identities] = {}
    if motion.phi is not None and motion.rates is not None:
        of_angles = omega_from_angles(motion.gamma, motion.phi, motion.rates, SYMBOLIC)
        in_angles["3.1"] = differences(omega, of_angles, f"{velocity} = psi', theta', phi' of the angles")
    if motion.identities:
        xi, text = motion.attitude[:3], "xi' = xi x Omega, the first row of R"
        in_angles["attitude"] = (*motion.identities, *differences(map(motion.rate, xi), cross(xi, omega), text))
    for equations, formulas in ((in_state, motion.formulas), (in_angles, motion.angle_formulas)):
        for equation, identities in equations.items():
            yield from numbered(equation, motion.branch, motion.domain, identities, formulas)


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
    identities = (dot(xi, xi) - 1, "|xi|^2 = 1, the first row of R"), (dot(xi, gamma), "xi.gamma = 0")
    of_eta = differences(eta, cross(gamma, xi), "eta = gamma x xi, the second row of R")
    return (*xi, *eta, *gamma), omega, (*identities, *of_eta)


def _integrals(motion: ClaimedMotion, p: Parameters, system: System) -> Identities:
    third = {
        HEAVY_TOP.name: (energy, "Omega.M/2 + P*r.gamma", "C1"),
        GYROSTAT.name: (gyrostat_energy, "Omega.M/2 + lambda*M2", "C1"),
        HEAVY_GYROSTAT.name: (energy, "Omega.(M - k)/2 + P*r.gamma", "C1"),
    }[system.name]
    identities = []
    for index, (integral, left, right) in enumerate(
        ((gamma_squared, "|gamma|^2", "1"), (area, "M.gamma", "C0"), third)
    ):
        value, constants = integral(p, motion.state), motion.constants or (sympy.Integer(1),)
        if index < len(constants):
            identities.append((value - constants[index], f"{left} = {right}"))
        else:
            identities.append((motion.rate(value), f"{left} is constant"))
    return tuple(identities)


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
