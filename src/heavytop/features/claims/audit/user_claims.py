"""Claims in files: motions, first integrals and invariant relations as statements, and their audits."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from itertools import islice, product
from time import thread_time

import msgspec
import sympy
from msgspec import structs

from heavytop.errors import HeavyTopError, InputError
from heavytop.features.claims.algebra.conditions import (
    Need,
    conditions_for_zero,
    is_exactly_zero,
    is_small_polynomial,
    on_conditions,
    reduced_everywhere,
    written,
)
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.prover import shortest
from heavytop.features.claims.algebra.reader import Formula, parse
from heavytop.features.claims.algebra.ring import where_provable
from heavytop.features.claims.algebra.statement import AFTER, ALL, TIME, Flow, Formulas, Point, Setting, Statement
from heavytop.features.claims.algebra.structure import Names, rate_along, rationals
from heavytop.features.claims.audit.context import (
    STATE,
    ClaimedMotionTable,
    ClaimFile,
    Clock,
    Context,
    IntegralTable,
    needs_of,
    of_file,
    parse_context,
    read_clock,
    sample_number,
    setting_of,
    three,
    variable_of,
)
from heavytop.features.claims.audit.judge import Audit, Progress, StatementVerdict, judge, silent, verdict_of
from heavytop.features.claims.audit.statements import (
    SYMBOLIC,
    ClaimedMotion,
    Identities,
    Triple,
    attitude,
    differences,
    motion_statements,
    numbered,
    of_matrix,
    of_quaternion,
)
from heavytop.precision import shown
from heavytop.top.attitude import omega_from_angles
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, System

Rate = Callable[[sympy.Expr], sympy.Expr]
_NO_FORMULAS = ("name", "kind", "stable", "system", "source", "domain", "assume", "parameters", "definitions", "entry")
_SEARCH, _MOST_ASSUMPTIONS = 6.0, 3
"""Seconds of the processor for assumptions that would decide a claim, and the largest number of them."""
_MOST_SECONDS = 3.0
"""Of an undecided audit that is done again with further samples."""


class FileClaim(ABC):
    """A claim of a file: its kind is motion, component, integral, relation or stability.

    is_searched: whether a witness is looked for at more states than usual.
    """

    is_searched = False

    def __init__(self, content: ClaimFile) -> None:
        self.content = content
        self.context = parse_context(content, self.variables)
        self.name, self.source, self.kind = content.name, content.source, content.kind

    @property
    @abstractmethod
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """The symbols other than parameters that its formulas may hold."""

    @property
    @abstractmethod
    def setting(self) -> Setting:
        """The file's assumptions and samples."""

    @abstractmethod
    def statements(self, system: System) -> list[Statement]:
        """The equations of the claim about ``system``."""

    def rows(self, about: System, progress: Progress = silent) -> tuple[StatementVerdict, ...]:
        """The verdicts on all statements."""
        return judge(self.statements(about), self.setting, progress)

    def solves(self, about: System, rows: Sequence[StatementVerdict]) -> tuple[str, ...]:
        """The systems that the equations of motion, or all, are proven for; ``rows`` are those about ``about``."""

        def judged(system: System) -> Sequence[StatementVerdict]:
            if system is about:
                return [row for row in rows if self.is_of_motion(row)]
            return judge([s for s in self.statements(system) if self.is_of_motion(s)], self.setting)

        return tuple(s.name for s in self.context.systems if verdict_of(judged(s)) == "holds")

    def is_of_motion(self, row: StatementVerdict | Statement) -> bool:
        """Whether a system whose motion the claim is must satisfy the equation."""
        return True

    def about(self, requested: System | None) -> System:
        """The system requested, else the file's, else `heavy_gyrostat` where it gives k, else `heavy_top`.

        Raises InputError where the file names another system, or gives another rotor than the system has.
        """
        default = HEAVY_TOP if self.context.carried is None else HEAVY_GYROSTAT
        about = of_file(requested, self.content.system, default)
        self.context.parameters(about)
        is_without = about is HEAVY_TOP and (self.content.system is not None or self.kind == "stability")
        if is_without and self.context.rotor is not None:
            raise InputError("The claim is about heavy_top, and top.rotor is that of a gyrostat.", "Leave it out.")
        return about

    def audit(self, about: System, progress: Progress = silent) -> Audit:
        """The audit as a claim about a system."""
        content, began = self.content, thread_time()
        rows = self.rows(about, progress)
        seconds = thread_time() - began
        deciding: tuple[tuple[str, str], ...] = ()
        if verdict_of(rows) == "undecided":
            more = rows
            with suppress(HeavyTopError):
                more = self._with_other_samples().rows(about) if seconds < _MOST_SECONDS else rows
            deciding = self._deciding(about, rows, seconds)
            rows = more if verdict_of(more) == "refuted" else rows
        return Audit(
            self.name,
            about.name,
            self.source,
            rows,
            solves=self.solves(about, rows),
            kind=self.kind,
            entry=content.entry,
            deciding=deciding,
            unused=self._unused(),
            where=() if content.integral is None else tuple(content.integral.where),
        )

    def _with_other_samples(self) -> FileClaim:
        """The claim with further samples and states for a witness."""
        claim = type(self)(self.content)
        claim.context, claim.is_searched = claim.context.with_other_samples(), True
        return claim

    def _deciding(self, about: System, rows: Sequence[StatementVerdict], seconds: float) -> tuple[tuple[str, str], ...]:
        """Assumptions each of which decides an undecided claim, with the verdict then.

        seconds: duration of the audit; the search ends after :data:`_SEARCH`.
        """
        began, assumed = thread_time(), self.content.assume
        signs = set(re.findall(r"\w+", " ".join(text for text in assumed if "!=" not in text)))
        bounds = [c.assumption for row in rows for c in row.conditions if c.assumption and not c.discharged]
        bounds += [f"{name} > 0" for name in self.content.parameters if name not in signs]
        deciding: list[tuple[str, str]] = []
        for bound in dict.fromkeys(bounds):
            if thread_time() - began + 2 * seconds > _SEARCH or len(deciding) == _MOST_ASSUMPTIONS:
                break
            if (bound.replace(">", "!="), "holds") in deciding:  # a weaker one suffices
                continue
            try:
                claim = type(self)(structs.replace(self.content, assume=[*assumed, bound]))
                verdict = verdict_of(claim.rows(about))
            except HeavyTopError:  # a sample breaks it, or the formula may not be assumed
                continue
            if verdict != "undecided":
                deciding.append((bound, verdict))
        return tuple(deciding)

    def _unused(self) -> tuple[str, ...]:
        """The parameters that no formula uses, nor a definition that a formula uses."""
        tables = {name: part for name, part in structs.asdict(self.content).items() if name not in _NO_FORMULAS}
        words = set(re.findall(r"\w+", str(msgspec.to_builtins(tables))))
        for name, text in reversed(self.content.definitions.items()):
            words |= set(re.findall(r"\w+", text)) if name in words else set()
        return tuple(name for name in self.content.parameters if name not in words)


def _expressions(formulas: tuple[Formula, Formula, Formula]) -> Triple:
    return formulas[0].expression, formulas[1].expression, formulas[2].expression


class UserMotion(FileClaim):
    """A motion claimed in a file."""

    def __init__(self, content: ClaimFile) -> None:
        super().__init__(content)
        assert content.motion is not None
        self.table = content.motion
        self.clock = _with_times(read_clock(content, self.context), content)
        self.context = _with_constant_rotor(self.context, self.clock)
        self.motion = _read_motion(self.table, self.context, self.clock)

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """t, or the variable of the quadrature."""
        return (variable_of(self.content),)

    @property
    def setting(self) -> Setting:
        """The file's assumptions and samples; γ as the part through which residuals are written."""
        parts = tuple((f"gamma{index}", part) for index, part in enumerate(self.motion.gamma, 1))
        return replace(setting_of(self.context, self.clock.variable), parts={"smooth": parts})

    def statements(self, system: System) -> list[Statement]:
        """(1.1)-(1.3), (3.1) where angles are claimed, and (3.2) where γ is claimed with them."""
        motion = self.motion
        if system is GYROSTAT:
            motion = replace(motion, needs=motion.needs | self.context.rotor_needs)
        statements = [*motion_statements(motion, self.context.parameters(system), system)]
        if self.table.angles is not None and self.table.gamma is not None:
            identities = differences(motion.attitude[:3], motion.gamma, "(3.2): gamma of the angles is gamma")
            statements += numbered("3.2", motion.branch, motion.domain, identities, self.motion.angle_formulas)
        return statements

    def is_of_motion(self, row: StatementVerdict | Statement) -> bool:
        """(1.1), (1.2), and |γ|² = 1 of (1.3)."""
        return row.equation in ("1.1", "1.2") or (row.equation, row.component) == ("1.3", 1)


def _with_constant_rotor(context: Context, clock: Clock) -> Context:
    """The rotor as the algebra writes it, without t; raises InputError where t is left."""
    if context.rotor is None or clock.variable not in context.rotor.free_symbols:
        return context
    rotor = shortest(context.rotor, setting_of(context, clock.variable), clock.domain)
    return context.with_rotor(rotor, clock.variable not in rotor.free_symbols)


def _read_motion(table: ClaimedMotionTable, context: Context, clock: Clock) -> ClaimedMotion:
    rate, domain, names, needs = clock.rate, clock.domain, context.names, context.needs | clock.needs

    def reduced(formulas: Triple) -> Triple:
        first, second, third = (shortest(formula, setting_of(context, clock.variable), domain) for formula in formulas)
        return first, second, third

    rotation: tuple[sympy.Expr, ...] = ()
    identities: Identities = ()
    attitude_needs: frozenset[Need] = frozenset()
    phi = rates = None
    omega: Triple | None = None
    gamma: Triple | None = None
    if sum(part is not None for part in (table.angles, table.quaternion, table.matrix)) > 1:
        raise InputError("[motion] gives the attitude twice.", "Give angles, or a quaternion, or a matrix.")
    if table.angles is not None:
        formulas = three(table.angles, names, "motion.angles")
        phi, theta, psi = reduced(_expressions(formulas))
        rates, rotation = (rate(phi), rate(theta), rate(psi)), attitude(phi, theta, psi)
        gamma, attitude_needs = (rotation[0], rotation[1], rotation[2]), needs_of(formulas)
    elif table.quaternion is not None or table.matrix is not None:
        rotation, omega, identities, attitude_needs = _read_rotation(table, names, rate)
        gamma = rotation[6], rotation[7], rotation[8]
    elif table.omega is None or table.gamma is None:
        cause = "[motion] has neither an attitude nor both omega and gamma."
        raise InputError(cause, "Give omega and gamma, or angles, a quaternion or a matrix.")
    needs |= attitude_needs if table.gamma is None or table.omega is None else frozenset()
    if table.gamma is not None:
        formulas = three(table.gamma, names, "motion.gamma")
        claimed, needs = reduced(_expressions(formulas)), needs | needs_of(formulas)
        if identities:
            identities += differences(claimed, gamma or (), "gamma is the third row of R")
        gamma = claimed
    if table.omega is not None:
        formulas = three(table.omega, names, "motion.omega")
        omega, needs = reduced(_expressions(formulas)), needs | needs_of(formulas)
    assert gamma is not None  # it is given, or follows from the attitude
    if rates is not None and omega is None:
        omega = omega_from_angles(gamma, phi, rates, SYMBOLIC)
    assert omega is not None
    return ClaimedMotion(
        "smooth",
        domain,
        omega,
        gamma,
        rate,
        phi,
        rates,
        needs=needs,
        attitude=rotation,
        angle_needs=attitude_needs,
        clock=clock.values,
        identities=identities,
    )


def _read_rotation(
    table: ClaimedMotionTable, names: dict[str, Formula], rate: Rate
) -> tuple[tuple[sympy.Expr, ...], Triple, Identities, frozenset[Need]]:
    """R row by row, its Ω and identities, and the needs of a quaternion or a matrix."""
    if table.quaternion is not None:
        q = [parse(text, names, f"motion.quaternion[{index}]") for index, text in enumerate(table.quaternion)]
        return *of_quaternion([part.expression for part in q], rate), needs_of(q)
    parts = [three(row, names, f"motion.matrix[{index}]") for index, row in enumerate(table.matrix or ())]
    return *of_matrix([_expressions(row) for row in parts], rate), needs_of(part for row in parts for part in row)


def _with_times(clock: Clock, content: ClaimFile) -> Clock:
    """The clock with the times of the file as the first points for a witness."""
    domain = clock.domain
    if content.times is None:
        return clock
    times = tuple(sample_number(time, "times") for time in content.times)
    if any(time * domain.sign < 0 or (domain is AFTER and time == 0) for time in times):
        raise InputError(f"A time of {', '.join(content.times)} is outside {domain.label}.", "Change one of them.")
    points = tuple(dict.fromkeys((*times, *domain.points)))
    return replace(clock, domain=replace(domain, points=points))


# Exact states on the conditions of a claim whose file gives none: by elimination and a small search.
#
# A linear variable is eliminated, a polynomial in one variable gives its rational roots and those of its quadratic
# factors, and otherwise a variable gets a value from a short list.  The states are only proposals: the caller proves
# that they lie on the conditions.


# with points of the unit circle and sphere, such as (3/5, 4/5) and (2/3, 1/3, 2/3)
_VALUES = tuple(sympy.Rational(*pair) for pair in ((2, 3), (1, 3), (4, 5), (3, 5), (-1, 2), (2, 1), (1, 1), (0, 1)))
_SCALES = (1, -1, 1, -1, 20, -20)
_MOST_STEPS = 300
_MOST_STATES, _MOST_BRANCHES = 24, 6
_MOST_BITS = 600


def states_on(
    conditions: Sequence[sympy.Expr],
    variables: Sequence[sympy.Symbol],
    parameters: Mapping[sympy.Symbol, Fraction],
) -> Iterator[dict[sympy.Symbol, Fraction]]:
    """Values of ``variables`` where polynomial ``conditions`` are 0 at these parameters, as far as found.

    A value is a Fraction or an irrational number of SymPy.
    """
    numbers = rationals(parameters)
    # states with a divisor 0 are rejected by the caller
    equations = [
        # u = 0 suffices for sin u = 0
        sympy.numer(sympy.together(condition.subs(numbers, simultaneous=True).replace(sympy.sin, lambda u: u)))
        for condition in conditions
    ]
    # SymPy takes minutes to factor polynomials with longer numbers
    sizes = (max(abs(n.p), n.q).bit_length() for e in equations for n in e.atoms(sympy.Rational))
    if max(sizes, default=0) > _MOST_BITS:
        return
    if all(is_small_polynomial(equation) and equation.free_symbols <= set(variables) for equation in equations):
        # the only rational states on conditions with irrational numbers may be those where these have the factor 0
        is_rational = all(c.is_Rational for e in equations for c in sympy.Poly(e, *variables).coeffs())
        for field in "QR" if is_rational else "RQ":
            yield from _Search(variables, field).states(equations)


class _Search:
    """A depth-first search with a limited number of steps, for states of rational or real numbers: "Q" or "R"."""

    def __init__(self, variables: Sequence[sympy.Symbol], numbers: str) -> None:
        self._variables, self._numbers = tuple(variables), numbers
        self._steps = 0

    def states(self, equations: Sequence[sympy.Expr]) -> Iterator[dict[sympy.Symbol, Fraction]]:
        """The states, up to a number."""
        yield from islice(self._solve([sympy.expand(equation) for equation in equations], {}, 0), _MOST_STATES)

    def _solve(
        self, equations: list[sympy.Expr], known: dict[sympy.Symbol, sympy.Expr], depth: int
    ) -> Iterator[dict[sympy.Symbol, Fraction]]:
        """Completions of ``known``, the eliminated variables as expressions in the free ones."""
        self._steps += 1
        equations = [equation for equation in equations if equation != 0]
        if self._steps > _MOST_STEPS or any(equation.is_number for equation in equations):
            return
        if not equations:
            yield from self._filled(known, depth)
            return
        for x, value, guesses in self._choices(equations, depth):
            reduced = [sympy.expand(equation.subs(x, value)) for equation in equations]
            values = {symbol: expression.subs(x, value) for symbol, expression in known.items()}
            yield from self._solve(reduced, {**values, x: value}, depth + guesses)

    def _choices(self, equations: Sequence[sympy.Expr], depth: int) -> Iterator[tuple[sympy.Symbol, sympy.Expr, int]]:
        """(variable, value, whether it is a guess): solutions of an equation, or values that make it simpler."""
        if solved := self._linear(equations):
            yield (*solved, 0)
            return
        shortest = min(equations, key=lambda equation: (len(equation.free_symbols), str(equation)))
        for factor, _ in sympy.factor_list(shortest)[1]:
            symbols = [x for x in self._variables if x in factor.free_symbols]
            if solved := self._linear([factor]):
                yield (*solved, 0)
            elif len(symbols) == 1:
                with suppress(ValueError):  # SymPy cannot take the root of some numbers of dozens of digits
                    roots = sympy.roots(factor, symbols[0], filter=self._numbers, cubics=False, quartics=False)
                    yield from ((symbols[0], root, 0) for root in roots)
            else:
                # the variable of the highest power gets a value first, which leaves the simplest equation
                x = max(symbols, key=lambda symbol: (sympy.degree(factor, symbol), str(symbol)))
                yield from ((x, _VALUES[(index + depth) % len(_VALUES)], 1) for index in range(len(_VALUES)))

    def _linear(self, equations: Sequence[sympy.Expr]) -> tuple[sympy.Symbol, sympy.Expr] | None:
        """A variable that an equation determines as a polynomial in the others."""
        for equation in equations:
            for x in reversed(self._variables):
                if x in equation.free_symbols:
                    p = sympy.Poly(equation, x)
                    if p.degree() == 1 and p.nth(1).is_number:
                        return x, -p.nth(0) / p.nth(1)
        return None

    def _filled(self, known: Mapping[sympy.Symbol, sympy.Expr], depth: int) -> Iterator[dict[sympy.Symbol, Fraction]]:
        """Numbers for all variables, with values of both signs and several sizes for the free ones."""
        free = [x for x in self._variables if x not in known]
        for shift, scale in enumerate(_SCALES if free else _SCALES[:1]):
            values = {x: scale * _VALUES[(shift + i + depth) % (len(_VALUES) - 1)] for i, x in enumerate(free)}
            numbers = {
                x: known[x].subs(values, simultaneous=True) if x in known else values[x] for x in self._variables
            }
            if all(number.is_Rational or (number.is_real and self._numbers == "R") for number in numbers.values()):
                yield {x: Fraction(n) if n.is_Rational else n for x, n in numbers.items()}


# A first integral or an invariant relation claimed in a file as statements.


_STATES = (
    ("1/2", "-2/3", "3/4", "2/3", "-1/3", "2/3"),
    ("1", "2", "-1", "3/5", "0", "4/5"),
    # of other signs, with angles beyond the first period
    ("-4", "-7/2", "9/2", "-2/7", "6/7", "-3/7"),
)
# at poles, on planes, slow and fast
_MORE_STATES = (
    ("1", "1/2", "1/3", "12/13", "0", "5/13"),
    ("1/10", "-1/20", "1/7", "-24/25", "7/25", "0"),
    ("2", "0", "-3", "0", "40/41", "-9/41"),
    ("-1/3", "1/2", "0", "9/41", "0", "-40/41"),
    ("20", "-30", "10", "0", "3/5", "4/5"),
    ("0", "1/40", "1/50", "-20/29", "-21/29", "0"),
)
# the number of states on the conditions, where a file gives none
_ENOUGH = 3
_BITS = 192
# 0 at every state of a body: |γ|² - 1
OFF_SPHERE = sum(x**2 for x in STATE[3:]) - 1


class UserIntegral(FileClaim):
    """A first integral or an invariant relation claimed in a file."""

    def __init__(self, content: ClaimFile) -> None:
        super().__init__(content)
        table, names = self._table, self.context.names
        self.value = parse(table.value, names, "integral.value")
        where = "component.where" if content.integral is None else "integral.where"
        self.where = tuple(parse(text, names, where) for text in table.where)
        _check_states(table)
        self.context = self._with_constant_rotor()

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """Ω and γ."""
        return tuple(STATE)

    def _with_constant_rotor(self) -> Context:
        """The context; raises InputError unless the rotor is constant along the motion of the gyrostat."""
        rotor = self.context.rotor
        if rotor is None or not rotor.free_symbols & frozenset(STATE):
            return self.context
        change, assumptions = self._rate(GYROSTAT)(rotor), setting_of(self.context, TIME).assumptions(0)
        vanishes = where_provable(False)(lambda: Field(assumptions, [change]).vanishes(change))
        return self.context.with_rotor(rotor, vanishes())

    @property
    def _table(self) -> IntegralTable:
        assert self.content.integral is not None
        return self.content.integral

    @property
    def setting(self) -> Setting:
        """The setting with the states as samples."""
        return self.at_states

    @cached_property
    def at_states(self) -> Setting:
        """The file's assumptions, with its parameters at each of the states as samples."""
        base = setting_of(self.context, TIME)
        conditions = [part for formula in self._zero for part in conditions_for_zero(formula.expression)]
        samples = tuple({**row, **state} for row in self.context.samples for state in self._states(conditions, row))
        relations = (*base.relations, *conditions)
        ranges = (*base.ranges, *((component, (Fraction(-1), Fraction(1))) for component in STATE[3:]))
        return replace(base, samples=samples, relations=(*relations, OFF_SPHERE) if relations else (), ranges=ranges)

    @property
    def _zero(self) -> tuple[Formula, ...]:
        """The formulas that are 0 where the claim is made."""
        return (*self.where, self.value) if self.kind == "relation" else self.where

    def _states(self, conditions: Sequence[sympy.Expr], parameters: Mapping[sympy.Symbol, Fraction]) -> list[Point]:
        """The states of the file, else fixed states, or states on the conditions where none of these lies there."""
        states = _numbers([*(self._table.states or _STATES), *(_MORE_STATES if self.is_searched else ())])
        if self._table.states is not None and not self.is_searched:
            return states
        needs = needs_of([self.value, *self.where])

        def is_valid(state: Point) -> bool:
            point = {**parameters, **state}
            return all(is_exactly_zero(c, point) for c in conditions) and all(need.is_met(point) for need in needs)

        if any(map(is_valid, states)) and not (self.is_searched and conditions):
            return states
        # where a product is 0 one of its factors is
        branches = islice(product(*map(sympy.Mul.make_args, conditions)), _MOST_BRANCHES)
        proposed = (states_on([*branch, OFF_SPHERE], STATE, parameters) for branch in branches)
        samples = [state for of_branch in proposed for state in islice(filter(is_valid, of_branch), _ENOUGH)]
        return samples or states

    def statements(self, system: System) -> list[Statement]:
        """dF/dt = 0 along the field of ``system``, on the conditions."""
        rate = self._rate(system)
        needs = needs_of([self.value, *self.where]) | self.context.needs
        if system is GYROSTAT:
            needs |= self.context.rotor_needs
        text = " = 0 along the motion"
        if self.kind == "relation":
            text += ", where F = 0"
        if self.where:
            text += ", where the conditions hold"
        value, named, names = self._with_names(rate, needs)
        is_relation = self.kind == "relation"
        flow = Flow(rate, frozenset((*STATE, *names)), self._kept(rate), is_relation, (OFF_SPHERE,), names)
        # the simpler conditions have the same zeros
        where = tuple(part for formula in self.where for part in conditions_for_zero(formula.expression))
        rotor = (self.context.rotor,) if system is GYROSTAT and self.context.rotor is not None else ()
        values = (*self._parts(value), *where, *rotor)
        domain = replace(ALL, points=(Fraction(0),))
        formulas = Formulas(values, named, sampled=needs)
        parts = [(part, "dF/dt" if part == value else f"d({written(str(part))})/dt") for part in self._parts(value)]
        return [
            Statement("dF/dt", component, "smooth", domain, self._on_relations(rate(part)), name + text, formulas, flow)
            for component, (part, name) in enumerate(parts, 1)
        ]

    def _rate(self, system: System) -> Rate:
        """The derivative along the field of ``system``."""
        rates = system.rates(self.context.parameters(system), STATE)
        return rate_along(dict(zip(STATE, rates, strict=True)))

    def _parts(self, value: sympy.Expr) -> tuple[sympy.Expr, ...]:
        """The expressions to be constant: F, or the parts of a relation that is no polynomial: |L| has no rate at 0."""
        if self.kind != "relation" or value.is_polynomial(*STATE):
            return (value,)
        return conditions_for_zero(value) or (value,)

    def _kept(self, rate: Rate) -> tuple[tuple[str, sympy.Expr], ...]:
        """The side conditions with their rates, and those of a relation that is split into simpler ones."""
        simpler = {formula: conditions_for_zero(formula.expression) for formula in self._zero}
        return tuple(
            (str(part), self._on_relations(rate(part)))
            for formula, parts in simpler.items()
            for part in parts
            if formula in self.where or parts != (self.value.expression,)
        )

    def _on_relations(self, rate: sympy.Expr) -> sympy.Expr:
        return on_conditions(rate, (*self.at_states.relations, OFF_SPHERE))

    def _with_names(
        self, rate: Rate, needs: frozenset[Need]
    ) -> tuple[sympy.Expr, frozenset[Need], dict[sympy.Symbol, sympy.Expr]]:
        """(F, its needs, symbols): with symbols for first integrals in F, where nothing else of the state remains.

        F is reduced by |γ| = 1.
        """
        if self.kind == "relation":
            return self.value.expression, needs, {}
        value = reduced_everywhere(self.value.expression, [OFF_SPHERE])
        assumptions = self.setting.assumptions(0)
        state = frozenset(STATE)
        names = Names(state, lambda e: _is_constant(rate(e), assumptions, self.setting.samples))
        named = names.put_into(value)
        if named.free_symbols & state:
            return value, needs, {}
        renamed = frozenset(
            Need(need.kind, names.put_into(reduced_everywhere(need.expression, [OFF_SPHERE])), need.text)
            for need in needs
        )
        return named, renamed, names.meanings


def _numbers(states: Sequence[Sequence[str]]) -> list[Point]:
    """The states of a file, exactly."""
    return [
        {symbol: sample_number(text, f"states: {symbol}") for symbol, text in zip(STATE, values, strict=True)}
        for values in states
    ]


def _check_states(table: IntegralTable) -> None:
    """Raises InputError for a state that no body has: off |γ| = 1."""
    for index, state in enumerate(_numbers(table.states or ()), 1):
        size = sum((state[symbol] ** 2 for symbol in STATE[3:]), Fraction(0))
        if size != 1:
            raise InputError(
                f"State {index} of [integral] has |gamma|^2 = {shown(size)}, not 1: gamma is a unit vector.",
                "Give rational components such as 3/5, 0, 4/5 or 2/3, -1/3, 2/3.",
            )


@where_provable(False)
def _is_constant(
    rate: sympy.Expr, assumptions: Assumptions, samples: Sequence[Mapping[sympy.Symbol, Fraction]]
) -> bool:
    """Whether a rate is proven to be 0 without divisors that may be 0."""
    # a rate that is not 0 at a sample needs no algebra
    balls = [evaluate(rate, {TIME: Fraction(0), **sample}, _BITS) for sample in samples[:1]]
    if any(ball.is_finite() and not ball.contains(0) for ball in balls):
        return False
    field = Field(assumptions, [rate])
    return field.is_zero(rate) and all(field.tower.signs.of(p).strict for p in field.tower.divisors.values())
