"""A motion claimed in a file as statements, and what every kind of claim in a file shares."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy
from flint import arb

from heavytop.claims.assume import Assumed, assume, comparison
from heavytop.claims.conditions import Need, condition, is_exactly_zero
from heavytop.claims.evaluate import evaluate
from heavytop.claims.expression import FUNCTIONS as FUNCTION_NAMES
from heavytop.claims.expression import Formula, parse, symbol
from heavytop.claims.from_file import ClaimFile, MotionTable, sample_rows
from heavytop.claims.judge import Finding, Row, judge, verdict_of
from heavytop.claims.prover import shortest
from heavytop.claims.real_zeros import conditions_for_zero
from heavytop.claims.signs import Unprovable
from heavytop.claims.statement import AFTER, ALL, BEFORE, Domain, Setting, Statement
from heavytop.claims.statements import SYMBOLIC, SYSTEMS, Motion, Triple, attitude, motion_statements
from heavytop.errors import InputError
from heavytop.precision import exact
from heavytop.top.angles import omega_from_angles
from heavytop.top.equations import GYROSTAT, Parameters, System

TIME = sympy.Symbol("t", real=True)
STATE = sympy.symbols("Omega1:4 gamma1:4", real=True)
_RESERVED = {"t", "pi", *FUNCTION_NAMES, *(str(variable) for variable in STATE)}
_DOMAINS = {"all": ALL, "t<=0": BEFORE, "t>0": AFTER}
_SAMPLE_BITS = 512


@dataclass(frozen=True, slots=True)
class Ground:
    """What every kind of claim shares: names, assumptions, samples, and the top they are about."""

    names: dict[str, Formula]
    symbols: dict[str, sympy.Symbol]
    assumed: Assumed
    samples: tuple[dict[sympy.Symbol, Fraction], ...]
    relations: tuple[sympy.Expr, ...]
    top: Parameters
    rotor: sympy.Expr | None
    needs: frozenset[Need]
    rotor_needs: frozenset[Need]

    @property
    def systems(self) -> tuple[System, ...]:
        """The systems that the claim says something about."""
        return tuple(system for system in SYSTEMS if system is not GYROSTAT or self.rotor is not None)

    def parameters(self, system: System) -> Parameters:
        """Parameters of the field; raises InputError where `gyrostat` is asked for and the file gives no rotor."""
        if system is GYROSTAT and self.rotor is None:
            raise InputError("The file gives no rotor, so it says nothing about gyrostat.", "Add rotor to [top].")
        return self.top._replace(rotor=sympy.Integer(0) if self.rotor is None else self.rotor)


def lay_ground(content: ClaimFile, variables: Iterable[sympy.Symbol]) -> Ground:
    """Parsed parameters, assumptions, definitions and top; raises InputError for what cannot be understood."""
    for name in (*content.parameters, *content.definitions):
        if name in _RESERVED or (name in content.parameters and name in content.definitions):
            raise InputError(f"The name {name!r} is taken.", f"Taken are {', '.join(sorted(_RESERVED))}.")
    above = [comparison(text) for text in content.assume]
    # the principal moments of a top are positive, said or not
    positive = {left for left, right in above if right == "0"} | {text.strip() for text in content.top.inertia}
    symbols = {
        name: sympy.Symbol(name, positive=True) if name in positive else sympy.Symbol(name, real=True)
        for name in content.parameters
    }
    names = {name: symbol(value) for name, value in symbols.items()}
    names |= {"pi": symbol(sympy.pi), **{str(variable): symbol(variable) for variable in variables}}
    for name, text in content.definitions.items():
        names[name] = parse(text, names, f"definition of {name}")
    bounds = [
        (parse(left, names, "assume").expression, parse(right, names, "assume").expression) for left, right in above
    ]
    top = content.top
    moments = _three(top.inertia, names, "top.inertia")
    arm = [*_three(top.centre, names, "top.centre"), parse(top.weight, names, "top.weight")]
    rotor = None if top.rotor is None else parse(top.rotor, names, "top.rotor")
    relations = [parse(text, names, "relations") for text in content.relations]
    weight = arm.pop()
    inertia, centre = (tuple(part.expression for part in parts) for parts in (moments, arm))
    ground = Ground(
        names,
        symbols,
        assume(bounds, inertia, symbols.values()),
        tuple({symbols[name]: exact(value) for name, value in row.items()} for row in sample_rows(content.parameters)),
        tuple(relation.expression for relation in relations),
        Parameters(inertia, tuple(weight.expression * part for part in centre), sympy.Integer(0)),
        None if rotor is None else rotor.expression,
        needs_of([*moments, *arm, weight, *relations]).union(*(condition("/", (part,)) for part in inertia)),
        frozenset() if rotor is None else rotor.needs,
    )
    _check_samples(ground, bounds)
    return ground


def needs_of(formulas: Iterable[Formula]) -> frozenset[Need]:
    """What all of them need."""
    return frozenset().union(*(formula.needs for formula in formulas))


def _three(texts: Iterable[str], names: dict[str, Formula], where: str) -> tuple[Formula, Formula, Formula]:
    first, second, third = (parse(text, names, f"{where}[{index}]") for index, text in enumerate(texts))
    return first, second, third


def _expressions(formulas: tuple[Formula, Formula, Formula]) -> Triple:
    return formulas[0].expression, formulas[1].expression, formulas[2].expression


def _check_samples(ground: Ground, bounds: list[tuple[sympy.Expr, sympy.Expr]]) -> None:
    """Samples that break the claim's own assumptions would be false witnesses: raises InputError."""
    for sample in ground.samples:
        shown = ", ".join(f"{name} = {value}" for name, value in sample.items())
        for left, right in bounds:
            if not _at(left - right, sample) > 0:
                raise InputError(f"The sample {shown} breaks the assumption {left} > {right}.", "Change the sample.")
        for relation in ground.relations:
            if is_exactly_zero(relation, sample) is False:
                raise InputError(f"The sample {shown} breaks the relation {relation} = 0.", "Change the sample.")
        for index, moment in enumerate(ground.top.inertia, 1):
            if not _at(moment, sample) > 0:
                raise InputError(f"The sample {shown} makes I{index} not positive.", "Change the sample.")


def _at(expression: sympy.Expr, sample: dict[sympy.Symbol, Fraction]) -> arb:
    try:
        return evaluate(expression, sample, _SAMPLE_BITS)
    except (KeyError, Unprovable):
        raise InputError(
            f"{str(expression)[:80]} is not a number at a sample.", "It may hold parameters only."
        ) from None


def setting_of(ground: Ground, variable: sympy.Symbol) -> Setting:
    """The setting of a claim on this ground."""
    a = ground.assumed
    relations = tuple(part for relation in ground.relations for part in conditions_for_zero(relation))
    return Setting(variable, a.positive, ground.samples, a.greater, relations=relations, facts=a.facts, ranges=a.ranges)


@dataclass(frozen=True)
class UserMotion:
    """A motion claimed in a file."""

    content: ClaimFile
    ground: Ground = field(init=False)
    motion: Motion = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "ground", lay_ground(self.content, [TIME]))
        assert self.content.motion is not None
        motion = _read_motion(self.content, self.content.motion, self.ground)
        object.__setattr__(self, "motion", motion)

    @property
    def name(self) -> str:
        """As the file has it."""
        return self.content.name

    @property
    def source(self) -> str:
        """As the file has it."""
        return self.content.source

    @property
    def kind(self) -> str:
        """motion."""
        return self.content.kind

    @property
    def setting(self) -> Setting:
        """The file's assumptions and samples; γ as the part through which residuals are written."""
        parts = tuple((f"gamma{index}", part) for index, part in enumerate(self.motion.gamma, 1))
        return replace(setting_of(self.ground, TIME), parts={"smooth": parts})

    def statements(self, system: System) -> list[Statement]:
        """(1.1)-(1.3), (3.1) where angles are claimed, and (3.2) where γ is claimed beside them."""
        motion = self.motion
        if system is GYROSTAT:
            motion = replace(motion, needs=motion.needs | self.ground.rotor_needs)
        return [*motion_statements(motion, self.ground.parameters(system), system), *self._angles_give_gamma()]

    def _angles_give_gamma(self) -> Iterator[Statement]:
        table = self.content.motion
        if table is not None and table.angles is not None and table.gamma is not None:
            turned = self.motion.attitude[:3]
            for component, (ours, theirs) in enumerate(zip(turned, self.motion.gamma, strict=True), 1):
                text = "(3.2): gamma of the angles is gamma"
                formulas = self.motion.angle_formulas
                yield Statement("3.2", component, "smooth", self.motion.domain, ours - theirs, text, formulas)

    def explain(self, about: System, rows: Sequence[Row]) -> tuple[list[Finding], tuple[str, ...]]:
        """No steps; the systems whose (1.1), (1.2) are proven."""
        return [], tuple(s.name for s in self.ground.systems if self._verdict(s, about, rows) == "holds")

    def _verdict(self, system: System, about: System, rows: Sequence[Row]) -> str:
        if system is about:
            return verdict_of([row for row in rows if row.equation in ("1.1", "1.2")])
        return verdict_of(judge([s for s in self.statements(system) if s.equation in ("1.1", "1.2")], self.setting))


def _read_motion(content: ClaimFile, table: MotionTable, ground: Ground) -> Motion:
    def rate(value: sympy.Expr) -> sympy.Expr:
        return sympy.diff(value, TIME)

    names, needs, domain = ground.names, ground.needs, _domain(content)

    def reduced(formulas: Triple) -> Triple:
        first, second, third = (shortest(formula, setting_of(ground, TIME), domain) for formula in formulas)
        return first, second, third

    if table.angles is None and (table.omega is None or table.gamma is None):
        raise InputError("[motion] has neither angles nor both omega and gamma.", "Give omega and gamma, or angles.")
    phi = rates = None
    turned: tuple[sympy.Expr, ...] = ()
    angle_needs: frozenset[Need] = frozenset()
    if table.angles is not None:
        formulas = _three(table.angles, names, "motion.angles")
        phi, theta, psi = reduced(_expressions(formulas))
        rates, turned = (rate(phi), rate(theta), rate(psi)), attitude(phi, theta, psi)
        angle_needs = needs_of(formulas)
    gamma: Triple
    if table.gamma is not None:
        formulas = _three(table.gamma, names, "motion.gamma")
        gamma, needs = reduced(_expressions(formulas)), needs | needs_of(formulas)
    else:
        gamma, needs = turned[:3], needs | angle_needs
    if table.omega is not None:
        formulas = _three(table.omega, names, "motion.omega")
        omega, needs = reduced(_expressions(formulas)), needs | needs_of(formulas)
    else:
        omega, needs = omega_from_angles(gamma, phi, rates, SYMBOLIC), needs | angle_needs
    return Motion(
        "smooth", domain, omega, gamma, rate, phi, rates, needs=needs, attitude=turned, angle_needs=angle_needs
    )


def _domain(content: ClaimFile) -> Domain:
    domain = _DOMAINS[content.domain]
    if content.times is None:
        return domain
    times = tuple(exact(time) for time in content.times)
    if any(time * domain.sign < 0 or (domain is AFTER and time == 0) for time in times):
        raise InputError(
            f"A time of {', '.join(content.times)} lies outside {domain.label}.", "Change times or domain."
        )
    return replace(domain, points=(*times, *(point for point in domain.points if point not in times)))
