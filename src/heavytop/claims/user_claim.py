"""A claim from a file as statements: its formulas over sympy, its assumptions, its samples."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy
from flint import arb

from heavytop.claims.evaluate import evaluate
from heavytop.claims.expression import FUNCTIONS as FUNCTION_NAMES
from heavytop.claims.expression import Formula, parse, symbol
from heavytop.claims.from_file import ClaimFile, IntegralTable, MotionTable, sample_rows
from heavytop.claims.judge import AFTER, ALL, BEFORE, Domain, Finding, Setting, Statement, judge, verdict_of
from heavytop.claims.rational import Unprovable
from heavytop.claims.statements import SYMBOLIC, SYSTEMS, Motion, Triple, motion_statements
from heavytop.errors import InputError
from heavytop.precision import exact
from heavytop.top.angles import gamma_from_angles, omega_from_angles
from heavytop.top.equations import GYROSTAT, Parameters, System

_TIME = sympy.Symbol("t", real=True)
_STATE = sympy.symbols("Omega1:4 gamma1:4", real=True)
_RESERVED = {"t", "pi", *FUNCTION_NAMES, *(str(variable) for variable in _STATE)}
_DOMAINS = {"all": ALL, "t<=0": BEFORE, "t>0": AFTER}
_SAMPLE_BITS = 512


@dataclass(frozen=True, slots=True)
class Ground:
    """What every kind of claim shares: names, assumptions, samples, and the top they are about."""

    names: dict[str, Formula]
    symbols: dict[str, sympy.Symbol]
    positive: tuple[sympy.Symbol, ...]
    greater: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    samples: tuple[dict[sympy.Symbol, Fraction], ...]
    relations: tuple[sympy.Expr, ...]
    top: Parameters
    rotor: sympy.Expr | None

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
    above = [_comparison(text) for text in content.assume]
    positive_names = {left for left, right in above if right == "0"}
    symbols = {
        name: sympy.Symbol(name, positive=True) if name in positive_names else sympy.Symbol(name, real=True)
        for name in content.parameters
    }
    names = {name: symbol(value) for name, value in symbols.items()}
    names |= {"pi": symbol(sympy.pi), **{str(variable): symbol(variable) for variable in variables}}
    for name, text in content.definitions.items():
        names[name] = parse(text, names, f"definition of {name}")
    unknown = [left for left, _ in above if left not in symbols]
    if unknown:
        raise InputError(f"An assumption is about {unknown[0][:40]!r}, no parameter.", "Write: parameter > formula.")
    greater = tuple((symbols[left], _formula(right, names, "assume")) for left, right in above if right != "0")
    samples = tuple(
        {symbols[name]: exact(value) for name, value in row.items()} for row in sample_rows(content.parameters)
    )
    top = content.top
    moments, centre = (
        _three(part, names, f"top.{what}") for part, what in ((top.inertia, "inertia"), (top.centre, "centre"))
    )
    weight = _formula(top.weight, names, "top.weight")
    moment = tuple(weight * part for part in centre)
    ground = Ground(
        names,
        symbols,
        tuple(symbols[name] for name in symbols if name in positive_names),
        greater,
        samples,
        tuple(_formula(text, names, "relations") for text in content.relations),
        Parameters(moments, moment, sympy.Integer(0)),
        None if top.rotor is None else _formula(top.rotor, names, "top.rotor"),
    )
    _check_samples(ground)
    return ground


def _comparison(text: str) -> tuple[str, str]:
    left, found, right = text.partition(">")
    if not found or ">" in right or "=" in right or not re.fullmatch(r"\w+", left.strip()):
        raise InputError(f"assume: {text[:60]!r} is not understood.", "Write: parameter > formula.")
    return left.strip(), right.strip()


def _formula(text: str, names: dict[str, Formula], where: str) -> sympy.Expr:
    return parse(text, names, where).expression


def _three(texts: Iterable[str], names: dict[str, Formula], where: str) -> Triple:
    first, second, third = (_formula(text, names, f"{where}[{index}]") for index, text in enumerate(texts))
    return first, second, third


def _check_samples(ground: Ground) -> None:
    """Samples that break the claim's own assumptions would be false witnesses: raises InputError."""
    for sample in ground.samples:
        shown = ", ".join(f"{name} = {value}" for name, value in sample.items())
        above = [(value, sympy.Integer(0)) for value in ground.positive] + list(ground.greater)
        for left, right in above:
            if not _at(left - right, sample) > 0:
                raise InputError(f"The sample {shown} breaks the assumption {left} > {right}.", "Change the sample.")
        for relation in ground.relations:
            if not _at(relation, sample).contains(0):
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


def _setting(ground: Ground, variable: sympy.Symbol) -> Setting:
    return Setting(variable, ground.positive, ground.samples, ground.greater, relations=ground.relations)


@dataclass(frozen=True)
class UserMotion:
    """A motion claimed in a file."""

    content: ClaimFile
    ground: Ground = field(init=False)
    motion: Motion = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "ground", lay_ground(self.content, [_TIME]))
        assert self.content.motion is not None
        object.__setattr__(self, "motion", _read_motion(self.content, self.content.motion, self.ground))

    @property
    def name(self) -> str:
        """As the file has it."""
        return self.content.name

    @property
    def source(self) -> str:
        """As the file has it."""
        return self.content.source

    @property
    def setting(self) -> Setting:
        """The file's assumptions and samples; γ as the part through which residuals are written."""
        parts = tuple((f"gamma{index}", part) for index, part in enumerate(self.motion.gamma, 1))
        return replace(_setting(self.ground, _TIME), parts={"smooth": parts})

    def statements(self, system: System) -> list[Statement]:
        """(1.1)-(1.3), (3.1) where angles are claimed, and (3.2) where γ is claimed beside them."""
        return [*motion_statements(self.motion, self.ground.parameters(system), system), *self._angles_give_gamma()]

    def _angles_give_gamma(self) -> Iterator[Statement]:
        table = self.content.motion
        if table is not None and table.angles is not None and table.gamma is not None:
            phi, theta, _ = _three(table.angles, self.ground.names, "motion.angles")
            turned = gamma_from_angles(phi, theta, SYMBOLIC)
            for component, (ours, theirs) in enumerate(zip(turned, self.motion.gamma, strict=True), 1):
                text = "(3.2): gamma of the angles is gamma"
                yield Statement("3.2", component, "smooth", self.motion.domain, ours - theirs, text)

    def explain(self) -> tuple[list[Finding], tuple[str, ...]]:
        """No steps; the systems whose (1.1), (1.2) are proven."""
        solves = []
        for system in SYSTEMS:
            if system is not GYROSTAT or self.ground.rotor is not None:
                statements = list(motion_statements(self.motion, self.ground.parameters(system), system))
                rows = judge([s for s in statements if s.equation in ("1.1", "1.2")], self.setting)
                if verdict_of(rows) == "holds":
                    solves.append(system.name)
        return [], tuple(solves)


def _read_motion(content: ClaimFile, table: MotionTable, ground: Ground) -> Motion:
    def rate(value: sympy.Expr) -> sympy.Expr:
        return sympy.diff(value, _TIME)

    angles = None if table.angles is None else _three(table.angles, ground.names, "motion.angles")
    if angles is None and (table.omega is None or table.gamma is None):
        raise InputError("[motion] has neither angles nor both omega and gamma.", "Give omega and gamma, or angles.")
    rates = None if angles is None else (rate(angles[0]), rate(angles[1]), rate(angles[2]))
    gamma = None if table.gamma is None else _three(table.gamma, ground.names, "motion.gamma")
    if gamma is None:
        assert angles is not None
        gamma = gamma_from_angles(angles[0], angles[1], SYMBOLIC)
    omega = None if table.omega is None else _three(table.omega, ground.names, "motion.omega")
    if omega is None:
        assert angles is not None
        omega = omega_from_angles(gamma, angles[0], rates, SYMBOLIC)
    domain = _domain(content)
    return Motion("smooth", domain, omega, gamma, rate, None if angles is None else angles[0], rates)


def _domain(content: ClaimFile) -> Domain:
    domain = _DOMAINS[content.domain]
    if content.times is None:
        return domain
    times = tuple(exact(time) for time in content.times)
    if any(time * domain.sign < 0 for time in times):
        raise InputError(
            f"A time of {', '.join(content.times)} lies outside {domain.label}.", "Change times or domain."
        )
    return replace(domain, points=times)


@dataclass(frozen=True)
class UserIntegral:
    """A first integral or an invariant relation claimed in a file."""

    content: ClaimFile
    ground: Ground = field(init=False)
    value: sympy.Expr = field(init=False)
    where: tuple[sympy.Expr, ...] = field(init=False)

    def __post_init__(self) -> None:
        ground = lay_ground(self.content, _STATE)
        table = self._table
        object.__setattr__(self, "ground", ground)
        object.__setattr__(self, "value", _formula(table.value, ground.names, "integral.value"))
        where = [_formula(text, ground.names, "integral.where") for text in table.where]
        if self.content.kind == "relation":
            where.append(self.value)
        object.__setattr__(self, "where", tuple(where))

    @property
    def _table(self) -> IntegralTable:
        assert self.content.integral is not None
        return self.content.integral

    @property
    def name(self) -> str:
        """As the file has it."""
        return self.content.name

    @property
    def source(self) -> str:
        """As the file has it."""
        return self.content.source

    @property
    def setting(self) -> Setting:
        """The file's assumptions; the samples are its parameters at those of its states that lie on the conditions."""
        base = _setting(self.ground, _TIME)
        states = [dict(zip(_STATE, map(exact, values), strict=True)) for values in self._table.states]
        samples = [{**sample, **state} for sample in self.ground.samples for state in states]
        on = tuple(place for place in samples if all(_at(condition, place).contains(0) for condition in self.where))
        if not on:
            raise InputError("No state of the file lies on its conditions.", "Give states with `where` equal to 0.")
        return replace(base, samples=on, relations=(*self.ground.relations, *self.where))

    def statements(self, system: System) -> list[Statement]:
        """dF/dt = 0 along the field of ``system``, on the conditions."""
        rates = system.field(self.ground.parameters(system), _STATE)
        rate = sum((sympy.diff(self.value, x) * dx for x, dx in zip(_STATE, rates, strict=True)), sympy.Integer(0))
        text = "dF/dt = 0 along the motion" + (", where the conditions hold" if self.where else "")
        domain = replace(ALL, points=(Fraction(0),))
        return [Statement("dF/dt", 1, "smooth", domain, rate, text)]

    def explain(self) -> tuple[list[Finding], tuple[str, ...]]:
        """No steps; the systems that conserve it, by proof."""
        systems = [system for system in SYSTEMS if system is not GYROSTAT or self.ground.rotor is not None]
        proven = [s.name for s in systems if verdict_of(judge(self.statements(s), self.setting)) == "holds"]
        return [], tuple(proven)
