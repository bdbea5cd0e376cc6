"""A motion claimed in a file as statements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import sympy

from heavytop.claims.claim_file import ClaimFile, MotionTable
from heavytop.claims.conditions import Need
from heavytop.claims.context import Context, FileClaim, needs_of, sample_number, setting_of, three
from heavytop.claims.expression import Formula
from heavytop.claims.judge import Finding, Row, judge, verdict_of
from heavytop.claims.prover import shortest
from heavytop.claims.quadrature import Clock, read_clock, variable_of
from heavytop.claims.statement import AFTER, Setting, Statement
from heavytop.claims.statements import SYMBOLIC, Motion, Triple, attitude, motion_statements
from heavytop.errors import InputError
from heavytop.top.angles import omega_from_angles
from heavytop.top.equations import GYROSTAT, System


def _expressions(formulas: tuple[Formula, Formula, Formula]) -> Triple:
    return formulas[0].expression, formulas[1].expression, formulas[2].expression


@dataclass(frozen=True)
class UserMotion(FileClaim):
    """A motion claimed in a file."""

    motion: Motion = field(init=False)
    clock: Clock = field(init=False)

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """t, or the variable of the quadrature."""
        return (variable_of(self.content),)

    def __post_init__(self) -> None:
        FileClaim.__post_init__(self)
        assert self.content.motion is not None
        object.__setattr__(self, "clock", _with_times(read_clock(self.content, self.context), self.content))
        object.__setattr__(self, "context", _with_constant_rotor(self.context, self.clock))
        motion = _read_motion(self.content.motion, self.context, self.clock)
        object.__setattr__(self, "motion", motion)

    @property
    def setting(self) -> Setting:
        """The file's assumptions and samples; γ as the part through which residuals are written."""
        parts = tuple((f"gamma{index}", part) for index, part in enumerate(self.motion.gamma, 1))
        return replace(setting_of(self.context, self.clock.variable), parts={"smooth": parts})

    def statements(self, system: System) -> list[Statement]:
        """(1.1)-(1.3), (3.1) where angles are claimed, and (3.2) where γ is claimed beside them."""
        motion = self.motion
        if system is GYROSTAT:
            motion = replace(motion, needs=motion.needs | self.context.rotor_needs)
        return [*motion_statements(motion, self.context.parameters(system), system), *self._angles_give_gamma()]

    def _angles_give_gamma(self) -> Iterator[Statement]:
        table = self.content.motion
        if table is not None and table.angles is not None and table.gamma is not None:
            turned = self.motion.attitude[:3]
            for component, (ours, theirs) in enumerate(zip(turned, self.motion.gamma, strict=True), 1):
                text = "(3.2): gamma of the angles is gamma"
                formulas = self.motion.angle_formulas
                yield Statement("3.2", component, "smooth", self.motion.domain, ours - theirs, text, formulas)

    def explain(self, about: System, rows: Sequence[Row]) -> tuple[list[Finding], tuple[str, ...]]:
        """No steps; the systems whose (1.1), (1.2) are proven, with |γ| = 1."""
        return [], tuple(s.name for s in self.context.systems if self._verdict(s, about, rows) == "holds")

    def _verdict(self, system: System, about: System, rows: Sequence[Row]) -> str:
        if system is about:
            return verdict_of([row for row in rows if _is_of_motion(row)])
        return verdict_of(judge([s for s in self.statements(system) if _is_of_motion(s)], self.setting))


def _is_of_motion(row: Row | Statement) -> bool:
    """(1.1), (1.2), and |γ|² = 1 of (1.3)."""
    return row.equation in ("1.1", "1.2") or (row.equation, row.component) == ("1.3", 1)


def _with_constant_rotor(context: Context, clock: Clock) -> Context:
    """The rotor as the algebra writes it, without t; raises InputError where t is left."""
    if context.rotor is None or clock.variable not in context.rotor.free_symbols:
        return context
    rotor = shortest(context.rotor, setting_of(context, clock.variable), clock.domain)
    return context.with_rotor(rotor, clock.variable not in rotor.free_symbols)


def _read_motion(table: MotionTable, context: Context, clock: Clock) -> Motion:
    rate, domain, names, needs = clock.rate, clock.domain, context.names, context.needs | clock.needs

    def reduced(formulas: Triple) -> Triple:
        first, second, third = (shortest(formula, setting_of(context, clock.variable), domain) for formula in formulas)
        return first, second, third

    if table.angles is None and (table.omega is None or table.gamma is None):
        raise InputError("[motion] has neither angles nor both omega and gamma.", "Give omega and gamma, or angles.")
    phi = rates = None
    turned: tuple[sympy.Expr, ...] = ()
    angle_needs: frozenset[Need] = frozenset()
    if table.angles is not None:
        formulas = three(table.angles, names, "motion.angles")
        phi, theta, psi = reduced(_expressions(formulas))
        rates, turned = (rate(phi), rate(theta), rate(psi)), attitude(phi, theta, psi)
        angle_needs = needs_of(formulas)
    gamma: Triple
    if table.gamma is not None:
        formulas = three(table.gamma, names, "motion.gamma")
        gamma, needs = reduced(_expressions(formulas)), needs | needs_of(formulas)
    else:
        gamma, needs = turned[:3], needs | angle_needs
    if table.omega is not None:
        formulas = three(table.omega, names, "motion.omega")
        omega, needs = reduced(_expressions(formulas)), needs | needs_of(formulas)
    else:
        omega, needs = omega_from_angles(gamma, phi, rates, SYMBOLIC), needs | angle_needs
    return Motion(
        "smooth",
        domain,
        omega,
        gamma,
        rate,
        phi,
        rates,
        needs=needs,
        attitude=turned,
        angle_needs=angle_needs,
        clock=clock.values,
    )


def _with_times(clock: Clock, content: ClaimFile) -> Clock:
    """With the times of the file as the first that a witness is looked for at."""
    domain = clock.domain
    if content.times is None:
        return clock
    times = tuple(sample_number(time, "times") for time in content.times)
    if any(time * domain.sign < 0 or (domain is AFTER and time == 0) for time in times):
        raise InputError(
            f"A time of {', '.join(content.times)} lies outside {domain.label}.", "Change times or domain."
        )
    return replace(
        clock, domain=replace(domain, points=(*times, *(point for point in domain.points if point not in times)))
    )
