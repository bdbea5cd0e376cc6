"""The statements of the paper's two claims: `ershkov-general` (2.1)-(3.4) and `ershkov-partial` (4.1)-(6.2).

The formulas are those of :mod:`heavytop.features.claims.library.ershkov` and
:mod:`heavytop.features.claims.library.ershkov_general`, over SymPy; each can be replaced, to audit another formula.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Any, ClassVar

import sympy

from heavytop.errors import InputError
from heavytop.features.claims.algebra.conditions import conditions_of
from heavytop.features.claims.algebra.statement import AFTER, ALL, BEFORE, Domain, Formulas, Setting, Statement
from heavytop.features.claims.audit.judge import Audit, ExplanationStep, Progress, judge, silent, verdict_of
from heavytop.features.claims.audit.statements import (
    SYMBOLIC,
    SYSTEMS,
    ClaimedMotion,
    attitude,
    determinant,
    differences,
    motion_statements,
    numbered,
    why_not_equivalent,
)
from heavytop.features.claims.library import ershkov, ershkov_general
from heavytop.features.claims.library.ershkov_general import GeneralConstants
from heavytop.top.attitude import gamma_from_angles
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, VARIABLES, Parameters, System, energy, momentum_squared

# Why a claim of the paper fails for the heavy top, and which system it solves: each step checked by the audit.


_HOLDS = {"holds": True, "refuted": False, "undecided": None}


def explain(
    motion: ClaimedMotion, parameters: Parameters, setting: Setting
) -> tuple[list[ExplanationStep], tuple[str, ...]]:
    """The steps of the explanation for a motion with γ ∥ M, and the systems whose (1.1), (1.2) it satisfies."""
    row = judge([determinant(motion, parameters)], setting)[0]
    steps = [*why_not_equivalent(), ExplanationStep("along the claim det(gamma, M, P*r) = 0 identically", row.holds)]
    solves = []
    for system in SYSTEMS:
        verdicts = _by_equation(motion, parameters, system, setting)
        if verdicts["1.1"] == verdicts["1.2"] == "holds":
            solves.append(system.name)
        if system is GYROSTAT:
            equations = {
                "1.1": "M' = M x (Omega + lambda*e2), lambda = P*b/C0: the free gyrostat with a rotor on axis 2",
                "1.2": "gamma' = gamma x (Omega + lambda*e2)",
                "3.1": "(3.1) with omega = Omega + lambda*e2 in the place of Omega",
            }
            steps += [
                ExplanationStep(f"it solves {text}", _HOLDS[verdicts[name]])
                for name, text in equations.items()
                if name in verdicts
            ]
    return steps, tuple(solves)


def _by_equation(motion: ClaimedMotion, parameters: Parameters, system: System, setting: Setting) -> dict[str, str]:
    rows = judge(list(motion_statements(motion, parameters, system)), setting)
    names = {row.equation for row in rows}
    return {name: verdict_of([row for row in rows if row.equation == name]) for name in names}


SOURCE = "S. V. Ershkov, On the invariant motions of rigid body rotation over the fixed point, via Euler's angles"
Formula = Callable[..., Any]


class _PaperClaim:
    """A claim of the paper; branches: its branches and where each is claimed, the smooth one first."""

    __slots__ = ()
    branches: ClassVar[tuple[tuple[str, Domain], ...]]

    @property
    def motion(self: Any) -> ClaimedMotion:
        """The smooth branch, which follows the flow."""
        motion: ClaimedMotion = self._motion(*self.branches[0])
        return motion

    def about(self, requested: System | None) -> System:
        """The system requested, else the heavy top; raises InputError for one that the paper says nothing about."""
        about = HEAVY_TOP if requested is None else requested
        if about not in SYSTEMS:
            names = " or ".join(system.name for system in SYSTEMS)
            raise InputError(f"The paper makes no claim about {about.name}.", f"Use {names}.")
        return about

    def statements(self: Any, system: System) -> list[Statement]:
        """Every equation of a motion of ``system``, and the steps of the paper."""
        motions = [self._motion(branch, domain) for branch, domain in self.branches]
        about = [statement for motion in motions for statement in motion_statements(motion, self.parameters, system)]
        return [*about, *self._steps()]

    def audit(self: Any, about: System, progress: Progress = silent) -> Audit:
        """The audit as a claim about a system, with the reason why det(γ, M, P r) = 0 makes it one of the gyrostat."""
        rows = judge(self.statements(about), self.setting, progress)
        steps, solves = explain(self.motion, self.parameters, self.setting)
        constants = tuple((name, str(value)) for name, value in self.setting.constants)
        return Audit(self.name, about.name, self.source, rows, tuple(steps), solves, constants)

    def _branch_parts(self: Any) -> dict[str, tuple[tuple[str, sympy.Expr], ...]]:
        return {name: _parts(self._motion(name, where)) for name, where in (("smooth", _ANY), ("printed", _RISING))}


@dataclass(frozen=True, slots=True)
class PartialClaim(_PaperClaim):
    """(4.1)-(4.6), (6.1)-(6.2), one field a formula."""

    u: Formula = ershkov.u
    omega1: Formula = ershkov.omega1
    omega1_smooth: Formula = ershkov.omega1_smooth
    omega3: Formula = ershkov.omega3
    phi: Formula = ershkov.phi
    theta: Formula = ershkov.theta
    psi: Formula = ershkov.psi
    name: str = "ershkov-partial"
    source: str = f"{SOURCE}, (4.1)-(4.6), (6.1)-(6.2)"

    @property
    def setting(self) -> Setting:
        """α, I1 > I3, P > 0."""
        samples = ((2, 1, 1, 1), ("7/3", "1/2", "3/4", "2"))
        return Setting(
            variable=_T,
            positive=(_ALPHA, _I3, _I1, _P),
            greater=((_I1, _I3),),
            samples=tuple(_sample((_I1, _I3, _ALPHA, _P), values) for values in samples),
            parts=self._branch_parts(),
            constants=(("k/2", _ALPHA * (_I1 - _I3) / (2 * _I3)),),
        )

    @property
    def parameters(self) -> Parameters:
        """I, P r and λ = P b/C0 of (4.1)."""
        c = _partial_constants()
        b = c.c1 / _P * (_I1 - _I3) / _I1
        return Parameters((_I1, _I1, _I3), (sympy.Integer(0), _P * b, sympy.Integer(0)), _P * b / c.c0)

    def _motion(self, branch: str, domain: Domain) -> ClaimedMotion:
        c = _partial_constants()
        u = self.u(c.a, c.alpha, _T, SYMBOLIC)
        omega2 = u * u
        if branch == "printed":
            u, first = sympy.sqrt(omega2), self.omega1(c, omega2, SYMBOLIC)
            phi, theta = self.phi(c, u, SYMBOLIC), self.theta(c, u, SYMBOLIC)
        else:
            first = self.omega1_smooth(c, u, SYMBOLIC)
            phi, theta = ershkov.angles_smooth(c, u, SYMBOLIC)
        omega = (first, omega2, self.omega3(c, omega2, SYMBOLIC))
        psi = self.psi(_I1, _I3, c.alpha, u, _T, SYMBOLIC)
        gamma = ershkov.gamma(c, omega)
        return ClaimedMotion(
            branch,
            domain,
            omega,
            gamma,
            _rate,
            phi,
            (_rate(phi), _rate(theta), _rate(psi)),
            (sympy.Integer(1), c.c0, c.c1),
            conditions_of((*omega, *gamma)),
            attitude(phi, theta, psi),
            conditions_of((phi, theta, psi)),
            _POLE,
        )

    def _steps(self) -> Iterator[Statement]:
        yield from self._omega_steps()
        yield from self._angle_steps()
        yield from self._psi_steps()

    def _omega_steps(self) -> Iterator[Statement]:
        c, p = _partial_constants(), self.parameters
        general = GeneralConstants((_I1, _I1, _I3), _P, p.moment[1] / _P, c.c0, c.c1)
        lam2 = 2 * p.moment[1] / c.c0
        data = (
            (c.c0**2 - 2 * _I3 * c.c1, "C0^2 = 2*I3*C1"),
            ((2 * _I1 * c.c1 - c.c0**2) / _I1**2 - c.alpha * lam2, "(2*I1*C1 - C0^2)/I1^2 = alpha*2*P*b/C0"),
            (lam2 - c.alpha * (_I1 - _I3) / _I3, "2*P*b/C0 = alpha*(I1 - I3)/I3"),
        )
        yield from numbered("4.1", "smooth", ALL, data)
        u = self.u(c.a, c.alpha, _T, SYMBOLIC)
        omega2 = u * u
        f1, f2 = ershkov_general.f1(general, omega2), ershkov_general.f2(general, omega2)
        yield Statement("4.2", 1, "smooth", ALL, _rate(omega2) ** 2 - f1 * f2, "(4.2) in (2.3): Omega2'^2 = f1*f2")
        for domain in (BEFORE, AFTER):
            residual = _rate(omega2) - sympy.sqrt(f1) * sympy.sqrt(f2)
            yield Statement(
                "2.3", 1, "printed", domain, residual, "(4.2) in (2.3) with its printed sign: Omega2' = +sqrt(f1*f2)"
            )
        first = ershkov_general.omega1_squared(general, omega2)
        text = "(4.3) in (2.4): Omega1^2"
        yield Statement("4.3", 1, "smooth", ALL, self.omega1_smooth(c, u, SYMBOLIC) ** 2 - first, text)
        yield Statement("4.3", 1, "printed", ALL, self.omega1(c, omega2, SYMBOLIC) ** 2 - first, text)
        third = self.omega3(c, omega2, SYMBOLIC) ** 2 - ershkov_general.omega3_squared(general, omega2)
        yield Statement("4.4", 1, "smooth", ALL, third, "(4.4) in (2.2): Omega3^2")

    def _angle_steps(self) -> Iterator[Statement]:
        c, smooth = _partial_constants(), self.motion
        u = self.u(c.a, c.alpha, _T, SYMBOLIC)
        root = sympy.sqrt(u * u)
        printed = self.phi(c, root, SYMBOLIC), self.theta(c, root, SYMBOLIC)
        continued = ershkov.angles_smooth(c, u, SYMBOLIC)
        branches = (("smooth", ALL, continued), ("printed", BEFORE, printed), ("printed", AFTER, printed))
        for branch, domain, (phi, theta) in branches:
            of_angles = gamma_from_angles(phi, theta, SYMBOLIC)
            text = "(4.5) in (3.2): gamma of the angles is gamma of the smooth branch"
            formulas = _angle_formulas((*of_angles, *smooth.gamma), (phi, theta))
            yield from numbered("4.5", branch, domain, differences(of_angles, smooth.gamma, text), formulas)
        final = (ershkov.phi_of_6_1(c.alpha, root, SYMBOLIC), ershkov.theta_of_6_1(c.alpha, root, SYMBOLIC))
        of_angles = gamma_from_angles(*printed, SYMBOLIC)
        formulas = _angle_formulas((*of_angles, *smooth.gamma), (*printed, *final))
        for domain in (BEFORE, AFTER):
            yield from numbered("6.1", "printed", domain, differences(printed, final, "(6.1) is (4.5)"), formulas)
        a = ershkov.a_of_6_2(_I1, _I3, c.alpha, SYMBOLIC)
        yield Statement("6.2", 1, "smooth", ALL, a - c.a, "A of (6.2) is A of (4.1)")

    def _psi_steps(self) -> Iterator[Statement]:
        c = _partial_constants()
        line = c.alpha * _T * (_I1 + _I3) / (2 * _I3)
        readings = {"smooth": "u of (4.2)", "printed": "u = sqrt(Omega2)"}
        for branch, domain in self.branches:
            u = self.u(c.a, c.alpha, _T, SYMBOLIC)
            if branch == "printed":
                u = sympy.sqrt(u * u)
            psi = self.psi(_I1, _I3, c.alpha, u, _T, SYMBOLIC)
            text = f"(4.6) with {readings[branch]} is the line alpha*t*(I1 + I3)/(2*I3)"
            motion = self._motion(branch, domain)
            yield Statement("4.6", 1, branch, domain, psi - line, text, motion.angle_formulas)
            assert motion.rates is not None
            rate = ershkov_general.psi_rate(
                GeneralConstants((_I1, _I1, _I3), _P, 0, c.c0, c.c1), motion.omega[2], motion.rates[0]
            )
            text = f"(4.6) with {readings[branch]} in (3.4)"
            yield Statement("4.6", 2, branch, domain, motion.rates[2] - rate, text, motion.angle_formulas)


@dataclass(frozen=True, slots=True)
class GeneralClaim(_PaperClaim):
    """(2.1)-(2.4), (3.3), (3.4), one field a formula."""

    gamma: Formula = ershkov_general.gamma
    omega1_squared: Formula = ershkov_general.omega1_squared
    omega3_squared: Formula = ershkov_general.omega3_squared
    f1: Formula = ershkov_general.f1
    f2: Formula = ershkov_general.f2
    name: str = "ershkov-general"
    source: str = f"{SOURCE}, (2.1)-(2.4), (3.3), (3.4)"

    @property
    def setting(self) -> Setting:
        """I1 > I3 and C0 > 0; b of either sign; s1, s3 stand for the signs of Ω1, Ω3."""
        data = ((3, 2, 1, 1, "1/3", 2, 1), ("5/2", 3, "4/3", 2, "-1/8", 3, 2))
        signs = ((1, 1), (1, -1), (-1, 1))
        symbols = (_I1, _I2, _I3, _P, _B, _C0, _C1, _S1, _S3)
        return Setting(
            variable=_W,
            positive=(_I3, _I2, _I1, _P, _C0),
            greater=((_I1, _I3),),
            samples=tuple(_sample(symbols, (*values, *pair)) for values in data for pair in signs),
            parts=self._branch_parts(),
            constants=(("P*b/C0", _P * _B / _C0),),
            nonzero=(_S1, _S3),
        )

    @property
    def parameters(self) -> Parameters:
        """I, P r, λ = P b/C0."""
        return Parameters((_I1, _I2, _I3), (sympy.Integer(0), _P * _B, sympy.Integer(0)), _P * _B / _C0)

    def _motion(self, branch: str, domain: Domain) -> ClaimedMotion:
        c = _GENERAL
        first, third = sympy.sqrt(self.omega1_squared(c, _W)), sympy.sqrt(self.omega3_squared(c, _W))
        speed = sympy.sqrt(self.f1(c, _W)) * sympy.sqrt(self.f2(c, _W))
        if branch == "smooth":
            first, third, speed = _SIGN1 * first, _SIGN3 * third, -_SIGN1 * _SIGN3 * speed
        elif domain is _FALLING:
            speed = -speed
        omega = (first, _W, third)

        def rate(value: sympy.Expr) -> sympy.Expr:
            return _derivative(value, _W) * speed

        gamma = self.gamma(c, omega)
        # (3.3) prints arctan, right for Ω2 > 0; the smooth branch keeps the quadrant
        phi = ershkov_general.phi(c, omega, SYMBOLIC) if branch == "printed" else sympy.atan2(gamma[0], gamma[1])
        theta = ershkov_general.theta(c, omega, SYMBOLIC)
        psi_rate = ershkov_general.psi_rate(c, third, rate(phi))
        rates = (rate(phi), rate(theta), psi_rate)
        return ClaimedMotion(
            branch,
            domain,
            omega,
            gamma,
            rate,
            phi,
            rates,
            (sympy.Integer(1), _C0, _C1),
            conditions_of((*omega, *gamma)),
            gamma_from_angles(phi, theta, SYMBOLIC),
            conditions_of((phi, theta)),
            "sin(theta) ≠ 0 (pole of the angles)",
        )

    def _steps(self) -> Iterator[Statement]:
        """(2.2)-(2.4) against the invariants: |M|² = C0² and (1.3) with (2.1), solved for Ω1², Ω3²."""
        c, p = _GENERAL, self.parameters
        x, z = sympy.symbols("x z", positive=True)
        omega = (sympy.sqrt(x), _W, sympy.sqrt(z))
        y = (*omega, *ershkov_general.gamma(c, omega))
        solution = sympy.solve([momentum_squared(p, y) - _C0**2, energy(p, y) - _C1], [x, z], dict=True)[0]
        yield Statement(
            "2.2", 1, "smooth", _ANY, self.omega3_squared(c, _W) - solution[z], "(2.2) from the invariants: Omega3^2"
        )
        speed = (_I3 - _I1) ** 2 * solution[x] * solution[z] / _I2**2
        text = "(2.3) from the invariants and (1.1): Omega2'^2 = f1*f2"
        yield Statement("2.3", 1, "smooth", _ANY, self.f1(c, _W) * self.f2(c, _W) - speed, text)
        yield Statement(
            "2.4", 1, "smooth", _ANY, self.omega1_squared(c, _W) - solution[x], "(2.4) from the invariants: Omega1^2"
        )
        printed = self._motion("printed", _ANY_ROOT)
        of_angles = gamma_from_angles(printed.phi, ershkov_general.theta(c, printed.omega, SYMBOLIC), SYMBOLIC)
        for component, (ours, theirs) in enumerate(zip(of_angles, printed.gamma, strict=True), 1):
            text = "(3.3) in (3.2): gamma of the angles is gamma; arctan loses the quadrant where Omega2 < 0"
            formulas = Formulas((ours, theirs), conditions_of((ours, theirs)))
            yield Statement("3.3", component, "printed", _ANY_ROOT, ours - theirs, text, formulas)


def _rate(value: sympy.Expr) -> sympy.Expr:
    return _derivative(value, _T)


_derivative = lru_cache(maxsize=256)(sympy.diff)
"""Branches, steps and both systems have theirs in common."""


def _angle_formulas(gamma: tuple[sympy.Expr, ...], angles: tuple[sympy.Expr, ...]) -> Formulas:
    """The formulas that an equation between angles rests on: γ of the angles, which is continuous."""
    return Formulas(gamma, frozenset(), (), conditions_of(angles), _POLE)


def _partial_constants() -> ershkov.Constants[Any]:
    return ershkov.constants(_I1, _I3, _ALPHA**2 * _I1**2 / (2 * _I3), SYMBOLIC)


def _parts(motion: ClaimedMotion) -> tuple[tuple[str, sympy.Expr], ...]:
    """γ, its products and the rates, of which a residual may be a constant multiple."""
    components = [(f"gamma{index}", part) for index, part in enumerate(motion.gamma, 1)]
    pairs = combinations_with_replacement(components, 2)
    products = [(f"{name}*{other}", part * factor) for (name, part), (other, factor) in pairs]
    rates = [(f"{name}'", motion.rate(value)) for name, value in zip(VARIABLES, motion.state, strict=True)]
    return (*components, *products, *rates)


def _sample(symbols: tuple[sympy.Symbol, ...], values: tuple[Any, ...]) -> dict[sympy.Symbol, Fraction]:
    return {symbol: Fraction(value) for symbol, value in zip(symbols, values, strict=True)}


_T, _W, _B, _C1, _S1, _S3 = sympy.symbols("t Omega2 b C1 s1 s3", real=True)
_I1, _I2, _I3, _P, _C0, _ALPHA = sympy.symbols("I1 I2 I3 P C0 alpha", positive=True)
_SIGN1, _SIGN3 = sympy.sign(_S1), sympy.sign(_S3)
_GENERAL = GeneralConstants((_I1, _I2, _I3), _P, _B, _C0, _C1)
_POLE = "t ≠ 0 (pole of the angles)"
PartialClaim.branches = (("smooth", ALL), ("printed", BEFORE), ("printed", AFTER))
_HERE = (Fraction(1, 5), Fraction(1, 3))
_BOTH_HERE = (*_HERE, Fraction(-1, 5))
_REAL = (ershkov_general.f1(_GENERAL, _W), ershkov_general.f2(_GENERAL, _W))
_ANY = Domain("all", 0, _BOTH_HERE, "every Omega2 with f1, f2 > 0; sign(Omega1*Omega3) = -sign(Omega2')", _REAL)
_ANY_ROOT = Domain("all", 0, _BOTH_HERE, "positive roots, every Omega2 with f1, f2 > 0", _REAL)
_MINIMUM = "time is counted from a minimum of Omega2"
_FALLING = Domain("t<=0", 1, _HERE, f"positive roots, Omega2' < 0, Omega2 > 0: {_MINIMUM}", _REAL)
_RISING = Domain("t>0", 1, _HERE, f"positive roots, Omega2' > 0, Omega2 > 0: {_MINIMUM}", _REAL)
GeneralClaim.branches = (("smooth", _ANY), ("printed", _FALLING), ("printed", _RISING))
