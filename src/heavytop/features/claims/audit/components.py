"""Claims of one component of a motion as a function of time, of its reduced equation, and of angles by their rates.

A component u of the state obeys u'² = f(u) where first integrals have the values of a start.  On these values that
equation and u'' = f'(u)/2 are proven from the equations of motion.  Then the same two equations are proven of the
function of time, and that it begins with the u and u' of the start: the second equation has only one such solution.  A
quadrature t = ∫ du/√f(u) and the rates of angles are statements on the state; angles are judged by their rates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from itertools import product

import sympy
from msgspec import structs

from heavytop.errors import InputError
from heavytop.exact.flint.balls import midpoint
from heavytop.features.claims.algebra.conditions import (
    ConditionKind,
    Need,
    condition,
    for_no_parameters,
    is_exactly_zero,
    reduced_everywhere,
    sign_of,
    written,
)
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.prover import shortest
from heavytop.features.claims.algebra.rational import forces_zero
from heavytop.features.claims.algebra.reader import Formula, parse, symbol
from heavytop.features.claims.algebra.ring import Unprovable, where_provable
from heavytop.features.claims.algebra.statement import (
    AFTER,
    ALL,
    TIME,
    Domain,
    Flow,
    Formulas,
    Point,
    Setting,
    Statement,
)
from heavytop.features.claims.algebra.structure import at_values, rate_along, rational_values
from heavytop.features.claims.audit.context import (
    DOMAINS,
    STATE,
    ClaimFile,
    ComponentTable,
    IntegralTable,
    QuadratureTable,
    needs_of,
    setting_of,
    three,
)
from heavytop.features.claims.audit.judge import Audit, Progress, StatementVerdict, judge, silent, verdict_of
from heavytop.features.claims.audit.user_claims import OFF_SPHERE, Rate, UserIntegral
from heavytop.top.equations import GYROSTAT, System, area, energy, gyrostat_energy, momentum_squared

_OMEGA, _GAMMA = STATE[:3], STATE[3:]
_ACROSS = _GAMMA[0] ** 2 + _GAMMA[1] ** 2
_POLE = "gamma is not vertical in the body: elsewhere phi and psi are undefined"
_IN_TIME = rate_along({TIME: sympy.Integer(1)})
_AT_A_STATE = replace(ALL, points=(Fraction(0),))
_ANGLES = ("phi", "theta", "psi")
_SHORT_TIMES = sympy.Rational(1, 2**8), sympy.Rational(1, 2**64)
_BITS = 256
_FROM_START = DOMAINS | {"t>0": replace(AFTER, label="t>=0")}
"""The domains of a function of time with its start, which belongs to it."""


def _rate_of_angle(name: str, omega: tuple[sympy.Expr, ...]) -> tuple[sympy.Expr, sympy.Expr]:
    """(a, b): the rate of an angle of (3.2) is a/b, where b is 0 only at the poles."""
    level = omega[0] * _GAMMA[0] + omega[1] * _GAMMA[1]
    if name == "psi":
        return level, _ACROSS
    if name == "phi":
        return omega[2] * _ACROSS - level * _GAMMA[2], _ACROSS
    return omega[0] * _GAMMA[1] - omega[1] * _GAMMA[0], sympy.sqrt(_ACROSS)


def _read(text: str, names: Mapping[str, Formula], where: str) -> Formula:
    """The formula of a text, without symbols for definitions: u and the state are substituted in it."""
    return _expanded(parse(text, names, where))


def _expanded(formula: Formula) -> Formula:
    needs = (replace(need, expression=at_values(need.expression, {})) for need in formula.needs)
    return replace(formula, expression=at_values(formula.expression, {}), needs=frozenset(needs))


class UserComponent(UserIntegral):
    """A component claimed in a file; its statements on the state are on the relations with the values of the start."""

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """Ω, γ, and the name of the component in reduced equations."""
        return (*STATE, self._u)

    @property
    def _u(self) -> sympy.Symbol:
        table = self.content.quadrature
        return sympy.Symbol("u" if table is None else table.variable, real=True)

    @property
    def _component(self) -> ComponentTable:
        assert self.content.component is not None
        return self.content.component

    @property
    def _table(self) -> IntegralTable:
        return IntegralTable("0", self._component.where)

    def __init__(self, content: ClaimFile) -> None:
        super().__init__(content)
        names, table, start = self.context.names, self._component, content.start
        self.quantity = _read(table.quantity, names, "component.quantity")
        self._check(table, self.quantity)
        self.start: tuple[Formula, ...] = ()
        if start is not None and start.omega is not None and start.gamma is not None:
            parts = (*three(start.omega, names, "start.omega"), *three(start.gamma, names, "start.gamma"))
            self.start = tuple(map(_expanded, parts))
        elif start is not None or table.value is not None:
            raise InputError("[start] needs omega and gamma.", "Give the state at t = 0, in the parameters.")
        self.where = (*map(_expanded, self.where), *self._levels())

    def _check(self, table: ComponentTable, quantity: Formula) -> None:
        if not quantity.expression.free_symbols & frozenset(STATE):
            raise InputError(f"component.quantity: {table.quantity[:40]!r} is constant.", "Name a component: gamma3.")
        quadrature = self.content.quadrature
        forms = ("reduced", table), ("time", quadrature), ("integrand", quadrature)
        given = [name for name, part in forms if getattr(part, name, None) is not None]
        if len(given) > 1:
            raise InputError(
                f"The claim gives {' and '.join(given)}.", "Give one of them, and the other in a claim of its own."
            )
        if table.value is not None and self._square is None:
            remedy = "Give reduced = f(u) in [component], or time or integrand in [quadrature]."
            raise InputError("[component] gives a value and no reduced equation u'^2 = f(u).", remedy)

    def _levels(self) -> Iterator[Formula]:
        """First integrals minus their values at the start, and the components that stay 0 from it."""
        if not self.start:
            return
        about = self.about(None)
        p, rate = self.context.parameters(about), self._rate(about)
        standard = [(gyrostat_energy if about is GYROSTAT else energy)(p, STATE), area(p, STATE)]
        standard += [e for e in (*_OMEGA, momentum_squared(p, STATE)) if sympy.cancel(rate(e)) == 0]
        zeros = {x for x, part in zip(STATE, self.start, strict=True) if part.expression == 0}
        while moving := {x for x in zeros if sympy.cancel(rate(x).subs(dict.fromkeys(zeros, 0))) != 0}:
            zeros -= moving
        constants = [_read(text, self.context.names, "component.constants") for text in self._component.constants]
        formulas = dict.fromkeys((*map(symbol, (*standard, *sorted(zeros, key=str))), *constants))
        levels = (replace(part, expression=part.expression - self._at_start(part.expression)) for part in formulas)
        yield from (level for level in levels if level not in self.where)

    def _at_start(self, e: sympy.Expr) -> sympy.Expr:
        return e.xreplace({x: part.expression for x, part in zip(STATE, self.start, strict=True)})

    def _states(self, conditions: Sequence[sympy.Expr], parameters: Mapping[sympy.Symbol, Fraction]) -> list[Point]:
        """The start where it is rational at these parameters; without a start states on the conditions."""
        if not self.start:
            return super()._states(conditions, parameters)
        values = rational_values((part.expression for part in self.start), parameters)
        return [] if values is None else [dict(zip(STATE, values, strict=True))]

    @cached_property
    def _quadrature(self) -> Formula | None:
        """F(u) or F'(u), where f(u) is given by it."""
        table = None if self._component.reduced is not None else self.content.quadrature
        text = None if table is None else table.time or table.integrand
        return None if text is None else _read(text, self.context.names, "quadrature")

    @cached_property
    def _square(self) -> Formula | None:
        """f(u)."""
        table, quadrature = self.content.quadrature, self._quadrature
        if self._component.reduced is not None:
            return _read(self._component.reduced, self.context.names, "component.reduced")
        if table is None or quadrature is None:
            return None
        slope = (
            quadrature.expression
            if table.time is None
            else rate_along({self._u: sympy.Integer(1)})(quadrature.expression)
        )
        # the equation without roots is equivalent where the integrand is real
        f = 1 / slope**2
        needs = frozenset(kept for need in quadrature.needs for kept in self._kept_real(need, f))
        return replace(quadrature, expression=f, needs=needs)

    def _kept_real(self, need: Need, f: sympy.Expr) -> Iterator[Need]:
        """The conditions that imply this one wherever u moves, except at single values of u.

        There f(u) = u'^2 > 0, and R = f/c^2 has its sign.  A polynomial R with f = R g keeps its sign at the start: u
        turns or rests at a zero of R.  Where R is 0 at the start, it takes the sign of g.  A divisor, or the argument
        of a logarithm, must not be 0 for all u.
        """
        u, radicand = self._u, need.expression
        if u not in radicand.free_symbols:
            yield need
            return
        if need.kind is ConditionKind.NONZERO:
            for base in (factor.as_base_exp()[0] for factor in sympy.Mul.make_args(radicand)):
                numerator = sympy.numer(sympy.together(base))
                common = sympy.gcd(numerator, sympy.denom(sympy.cancel(f / base)))
                if common.free_symbols and not for_no_parameters(numerator, self.setting.assumptions(0), ()):
                    yield Need(ConditionKind.NONZERO, base)
            return
        radicand = sympy.prod(sympy.fraction(sympy.together(radicand)))
        if need.kind is ConditionKind.POSITIVE and not for_no_parameters(radicand, self.setting.assumptions(0), ()):
            yield need
        elif not self._has_sign_of(radicand, f):
            keeps_sign = self._is_continuous and self._divides(radicand, f)
            yield Need(ConditionKind.POSITIVE, self._at_begin(radicand, f)) if keeps_sign else need

    @property
    def _is_continuous(self) -> bool:
        return bool(self.start) and not self.quantity.expression.has(sympy.atan2)

    @where_provable(False)
    def _has_sign_of(self, radicand: sympy.Expr, f: sympy.Expr) -> bool:
        """Whether f(u) > 0, with the signs of its factors, implies that an expression is >= 0."""
        field = Field(self.setting.assumptions(0, facts=(f, *self._signed_factors(f))), [radicand])
        return field.tower.sign(field.enter(radicand)).value > 0

    def _at_begin(self, p: sympy.Expr, f: sympy.Expr) -> sympy.Expr:
        """An expression with the sign that a divisor p of f has after the start."""
        begin = {self._u: self._at_start(self.quantity.expression)}
        at_start = sympy.factor(p.xreplace(begin))
        return at_start if at_start != 0 else sympy.factor(_cofactor(p, f).xreplace(begin))

    def _of(self, name: str, table: QuadratureTable | ComponentTable | None) -> Formula | None:
        """A formula of a table, which may contain t in [component]; None where absent."""
        text = getattr(table, name, None)
        names = self.context.names | ({"t": symbol(TIME)} if table is self._component else {})
        return None if text is None else _read(text, names, f"{name} of the claim")

    # --- on the state -------------------------------------------------------------------------------------------------

    def _groups(self, system: System) -> Iterator[tuple[list[Statement], Setting]]:
        """Statements with their settings: in u, on the state where they are no functions of u, and in time."""
        in_u, on_state = self._reduced(system)
        squares = [s for s in on_state if s.equation == "reduced"]
        states, base = self.at_states, setting_of(self.context, self._u)
        # where u is constant, u'^2 = f(u) does not imply u'' = f'(u)/2
        moving = [s for s in base.samples if self._moves(system, s)]
        yield in_u, replace(base, samples=tuple(filter(self._is_on_conditions, moving)))
        yield squares, replace(states, samples=tuple(s for s in states.samples if self._moves(system, s)))
        yield [s for s in on_state if s.equation != "reduced"], self.at_states
        in_time, at_times = self._in_time(system), setting_of(self.context, TIME)
        second = [
            s for s in in_time if (s.equation, s.component) == ("component", 2) and len(moving) < len(base.samples)
        ]
        yield [s for s in in_time if s not in second], at_times
        yield second, replace(at_times, samples=tuple(moving))

    def audit(self, about: System, progress: Progress = silent) -> Audit:
        """The audit as a claim about a system, with the values at the start of its own first integrals."""
        if about is self.about(None):
            return super().audit(about, progress)
        return UserComponent(structs.replace(self.content, system=about.name)).audit(about, progress)

    def rows(self, about: System, progress: Progress = silent) -> tuple[StatementVerdict, ...]:
        """The verdicts, group by group."""
        return tuple(row for statements, setting in self._groups(about) for row in judge(statements, setting))

    def solves(self, about: System, rows: Sequence[StatementVerdict]) -> tuple[str, ...]:
        """The claim's own system, where every row holds."""
        return (about.name,) if verdict_of(rows) == "holds" else ()

    def _moves(self, system: System, sample: Mapping[sympy.Symbol, Fraction]) -> bool:
        """Whether u is not constant along the motion from the start; without one, from a state on the conditions."""
        rates = self._rates(system)[1:]
        if self.start:
            return any(is_exactly_zero(self._at_start(e), sample) is False for e in rates)
        states = (state for state in self.at_states.samples if sample.items() <= state.items())
        on_conditions = (state for state in states if _is_at(state, self.at_states.relations))
        return any(is_exactly_zero(e, state) is False for state in on_conditions for e in rates)

    def _is_on_conditions(self, sample: Mapping[sympy.Symbol, Fraction]) -> bool:
        """Whether the start, if any, lies on the conditions at a sample."""
        zeros = (*(part.expression for part in self.where), OFF_SPHERE)
        return not self.start or _is_at(sample, map(self._at_start, zeros))

    def _reduced(self, system: System) -> tuple[list[Statement], list[Statement]]:
        """u'² = f(u), u'' = f'(u)/2 and the rates of the angles, where the first integrals have their values."""
        rate, u, q = self._rate(system), self._u, self.quantity
        kept = tuple((str(part.expression), sympy.expand(rate(part.expression))) for part in self.where)
        base = needs_of([q, *self.where, *self.start]) | self.context.needs
        omega = tuple(system.angular_velocity(self.context.parameters(system), STATE))
        in_u: list[Statement] = []
        on_state: list[Statement] = []
        claims: list[tuple[str, int, sympy.Expr, sympy.Expr, sympy.Expr, str, frozenset[Need]]] = []
        one, slope = sympy.Integer(1), rate(q.expression)
        if self._square is not None:
            f, needs = self._square.expression, self._square.needs
            claims.append(("reduced", 1, f, slope**2, one, "u'^2 = f(u)", needs))
            claims.append(("reduced", 2, sympy.diff(f, u) / 2, rate(slope), one, "u'' = f'(u)/2", needs))
            in_u += self._clock(f, system)
        for index, name in enumerate(_ANGLES, 1):
            claimed = self._of(name, self.content.quadrature)
            if claimed is not None:
                above, below = _rate_of_angle(name, omega)
                text = f"{name}' of the angles"
                claims.append(("rate", index, claimed.expression, above, below, text, claimed.needs))
        if not claims:
            raise InputError("[component] makes no claim.", "Give reduced, or rates of angles in [quadrature].")
        zeros = [*(part.expression for part in self.where), OFF_SPHERE]
        known = self._known_components()
        lasting = all(sympy.expand(e) == 0 for _, e in kept)
        for equation, index, claimed, above, below, text, needs in claims:
            pole = _POLE if equation == "rate" else ""
            of_u = claimed.xreplace(known)
            on_motion = sympy.numer(sympy.together(claimed.xreplace({u: q.expression}) * below - above))
            is_of_u = lasting and not of_u.free_symbols & frozenset(STATE)
            choices = self._eliminations(zeros, (above, below), on_motion, rate) if is_of_u else ()
            through = _through(u, q.expression, choices, (above, below))
            put = known if through else {u: q.expression}
            needs = frozenset(_off_pole(need, u if through else None) for need in _put(needs, put))
            if through is not None:
                residual = sympy.numer(sympy.together(of_u * through[1] - through[0]))
                at_samples = _without(base, *STATE) | _nonzero(through[2])
                needs |= at_samples
                formulas = Formulas((u,), needs, pole=pole, sampled=at_samples if equation == "reduced" else needs)
                # beyond the way of u two functions may differ that agree on it
                is_rational = of_u.is_rational_function(u)
                domain = ALL if is_rational else replace(ALL, points=self._shortly_after(system))
                in_u.append(Statement(equation, index, "smooth", domain, residual, text, formulas))
            elif index == 1 or equation == "rate":
                # sin θ is the root of 1 - γ3² in a formula, and that of γ1² + γ2² in the rate
                residual = reduced_everywhere(on_motion, [OFF_SPHERE]) if below.is_Pow else on_motion
                flow = Flow(rate, frozenset(STATE), kept, False, (OFF_SPHERE,))
                needs |= base
                # a function of time has no kink, and so must be u
                smooth = (q.expression, slope) if equation == "reduced" and self._component.value else ()
                sampled = base if equation == "reduced" else needs
                formulas = Formulas((*STATE, *smooth), needs, pole=pole, sampled=sampled)
                on_state.append(Statement(equation, index, "smooth", _AT_A_STATE, residual, text, formulas, flow))
        return in_u, on_state

    def _eliminations(
        self, zeros: Sequence[sympy.Expr], parts: Sequence[sympy.Expr], residual: sympy.Expr, rate: Rate
    ) -> Iterator[list[sympy.Expr]]:
        """The relations that hold variables of u and the parts alone, then all of them.

        All may take minutes: only where the others outnumber their further variables and, unless u is a component of
        the state and another one constant, neither the residual nor its first two derivatives are known to differ from
        0 at a state.
        """
        variables = {z: z.free_symbols & frozenset(STATE) for z in zeros}
        constant = set().union(*(x for x in variables.values() if len(x) == 1))
        near = constant.union(*(e.free_symbols for e in (self.quantity.expression, *parts)))
        moving = [z for z in zeros if variables[z]]
        far = [z for z in moving if not variables[z] <= near]
        if far:
            yield [z for z in moving if z not in far]
            if len(far) <= len(set().union(*(variables[z] for z in far)) - near):
                return
        if far or not constant or self.quantity.expression not in STATE:
            first = rate(residual)
            points, residuals = self.at_states.samples, (residual, first, rate(first))
            if any(is_exactly_zero(e, point) is False for e, point in product(residuals, points)):
                return
        yield moving

    def _clock(self, f: sympy.Expr, system: System) -> Iterator[Statement]:
        """F is continuous and F' real and of one sign where u moves: f(u) > 0 there, as are radicands that divide f.

        That they are real is a condition of the reduced equation, which a state refutes where they are not; so are
        arguments of logarithms, which are > 0.
        """
        clock, u, table = self._quadrature, self._u, self.content.quadrature
        if clock is None or table is None or self._square is None:
            return
        slope = clock.expression if table.time is None else rate_along({u: sympy.Integer(1)})(clock.expression)
        factors = (factor.as_base_exp() for factor in sympy.Mul.make_args(slope))
        has_one_sign = all(n.q == 2 or sign_of(p).strict or self._divides(p, f) for p, n in factors)
        values = () if has_one_sign and table.time is None else (slope, 1 / slope)
        values += () if table.time is None else (clock.expression,)
        proven = {need.expression for need in self._square.needs if need.kind is ConditionKind.POSITIVE}
        real = (need.expression for need in sorted(clock.needs, key=str) if need.kind is not ConditionKind.NONZERO)
        facts = (f, *(e for e in real if e in proven or self._divides(e, f)), *self._signed_factors(f))
        domain = Domain("f(u) > 0", 0, self._shortly_after(system), f"{u} is the component", facts)
        text = "t = F(u) is continuous, and F' is real and keeps its sign"
        # t is no function of a constant u
        rates = [self._at_start(e) ** 2 for e in self._rates(system)[1:]] if self.start else [sympy.Integer(1)]
        moves = frozenset(replace(need, shown=f"{u} is not constant") for need in _nonzero(sympy.Add(*rates)))
        formulas = Formulas(values, moves, sampled=clock.needs)
        yield Statement("time", 1, "smooth", domain, sympy.Integer(0), text, formulas)

    def _signed_factors(self, f: sympy.Expr) -> Iterator[sympy.Expr]:
        """The factors of a rational f(u) that have a known sign at the start, which they keep, times that sign."""
        if not self._is_continuous or not f.is_rational_function(self._u):
            return
        for factor in sympy.Mul.make_args(sympy.factor(sympy.numer(sympy.together(f)))):
            p, _ = factor.as_base_exp()
            if self._u in p.free_symbols and self._divides(p, f):
                with suppress(Unprovable):
                    begin = self._at_begin(p, f)
                    field = Field(self.setting.assumptions(0), [begin])
                    sign = field.tower.sign(field.enter(begin))
                    yield from [sign.value * p] if sign.value and sign.strict else []

    def _divides(self, p: sympy.Expr, f: sympy.Expr) -> bool:
        """Whether a polynomial in u, or a constant, is 0 only where f is: so it keeps its sign where u moves."""
        cofactor = _cofactor(p, f)
        below = sympy.denom(cofactor)
        is_finite = cofactor.is_rational_function(self._u) and (
            self._u not in below.free_symbols or sign_of(below).strict
        )
        return is_finite and p.is_polynomial(self._u)

    def _rates(self, system: System) -> tuple[sympy.Expr, sympy.Expr, sympy.Expr]:
        """u, u' and u'' on the state."""
        first = self._rate(system)(self.quantity.expression)
        return self.quantity.expression, first, self._rate(system)(first)

    def _shortly_after(self, system: System) -> tuple[Fraction, ...]:
        """Values of u on the way of the motion from each sample, to the second order in a short time."""
        u, speed, acceleration = self._rates(system)
        after = [u + speed * time + acceleration * time**2 / 2 for time in _SHORT_TIMES]
        points: dict[Fraction, None] = {}
        for sample, value in product(self.at_states.samples, after):
            with suppress(Unprovable):
                ball = evaluate(value, sample, _BITS)
                points |= {midpoint(ball): None} if ball.is_finite() else {}
        return tuple(points)

    def _known_components(self) -> dict[sympy.Expr, sympy.Expr]:
        """Components of the state in terms of u and of constants, where first integrals are components."""
        values = {
            x: x - part.expression for part in self.where for x in part.expression.free_symbols & frozenset(STATE)
        }
        return {
            x: e for x, e in {**values, self.quantity.expression: self._u}.items() if not e.free_symbols & set(STATE)
        }

    def _true_rate(self, name: str, system: System) -> Formula:
        """The rate of an angle as a function of u, where the first integrals have their values."""
        omega = tuple(system.angular_velocity(self.context.parameters(system), STATE))
        zeros = [*(part.expression for part in self.where), OFF_SPHERE]
        parts = _rate_of_angle(name, omega)
        choices = self._eliminations(zeros, parts, sympy.Integer(0), self._rate(system))
        through = _through(self._u, self.quantity.expression, choices, parts)
        if through is None:
            raise InputError(f"The rate of {name} is not a function of {self._u}.", f"Give {name} by its rate alone.")
        needs = condition("/", (through[1],)) | _nonzero(through[2])
        return replace(symbol(through[0] / through[1]), needs=needs)

    # --- in time ------------------------------------------------------------------------------------------------------

    def _in_time(self, system: System) -> list[Statement]:
        """The two equations of the function of time, its start, and the rates of the angles along it."""
        domain = _FROM_START[self.content.domain]
        at_start = replace(domain, points=(Fraction(0),)), Formulas(needs=needs_of(self.start))

        def begins(index: int, residual: sympy.Expr, text: str) -> Statement:
            return Statement("start", index, "smooth", at_start[0], residual, f"{text} at t = 0", at_start[1])

        zeros = [part.expression for part in self.where[: len(self._component.where)]] if self.start else []
        on_start = {OFF_SPHERE: "|gamma|^2 = 1"} if self.start else {}
        on_start |= {part: f"{written(str(part))} = 0" for part in zeros}
        on_conditions = [begins(n, self._at_start(part), text) for n, (part, text) in enumerate(on_start.items(), 3)]
        value = self._of("value", self._component)
        if value is None or self._square is None:
            return on_conditions
        u, f = self._u, self._square.expression
        c = shortest(value.expression, setting_of(self.context, TIME), domain)
        first, second = _IN_TIME(c), _IN_TIME(_IN_TIME(c))
        # one solution begins with u and u' if u' is continuous, and if f' has a continuous derivative
        regular = (c, first) if f.is_rational_function(u) else (c, first, sympy.diff(f, u, 2).xreplace({u: c}))
        along = _put(self._square.needs, {u: c})
        formulas = Formulas(regular, value.needs | along | self.context.needs)

        def made(equation: str, index: int, residual: sympy.Expr, text: str, extra: Formulas = formulas) -> Statement:
            return Statement(equation, index, "smooth", domain, residual, text, extra)

        equations = [
            made("component", 1, first**2 - f.xreplace({u: c}), "u'^2 = f(u) of the function of t"),
            made("component", 2, second - sympy.diff(f, u).xreplace({u: c}) / 2, "u'' = f'(u)/2 of the function of t"),
        ]
        begin = ((c, self.quantity.expression), (first, self._rate(system)(self.quantity.expression)))
        for component, (ours, theirs) in enumerate(begin, 1):
            residual = at_values(ours, {TIME: sympy.Integer(0)}) - self._at_start(theirs)
            equations.append(begins(component, residual, f"u{chr(39) * (component - 1)}"))
        equations += on_conditions
        for index, name in enumerate(_ANGLES, 1):
            angle, claimed = self._of(name, self._component), self._of(name, self.content.quadrature)
            if angle is not None:
                if claimed is None or claimed.expression.free_symbols & frozenset(STATE):
                    claimed = self._true_rate(name, system)
                needs = angle.needs | _put(claimed.needs, {u: c}) | formulas.needs
                residual = _IN_TIME(angle.expression) - claimed.expression.xreplace({u: c})
                equations.append(
                    made("angle", index, residual, f"{name}' of {name}", Formulas((c, angle.expression), needs))
                )
        return equations


def _cofactor(p: sympy.Expr, f: sympy.Expr) -> sympy.Expr:
    """f/p without their common factors."""
    return sympy.factor(f) / sympy.factor(p)


def _is_at(state: Mapping[sympy.Symbol, Fraction], zeros: Iterable[sympy.Expr]) -> bool:
    """Whether the formulas are proven to be 0 at a state."""
    return all(is_exactly_zero(zero, state) for zero in zeros)


def _put(needs: frozenset[Need], values: Mapping[sympy.Expr, sympy.Expr]) -> frozenset[Need]:
    return frozenset(Need(need.kind, need.expression.xreplace(values)) for need in needs)


def _nonzero(divisor: sympy.Expr) -> frozenset[Need]:
    """The needs that no factor of a divisor is 0."""
    factors = sympy.Mul.make_args(sympy.factor(sympy.numer(sympy.together(divisor))))
    return frozenset(need for factor in factors for need in condition("/", (factor.as_base_exp()[0],)))


def _off_pole(need: Need, u: sympy.Symbol | None) -> Need:
    """The remaining need where γ is not vertical in the body; u: the symbol of γ3 in it, if any."""
    across = _ACROSS if u is None else 1 - u**2
    base = need.expression.as_base_exp()[0] if need.kind is ConditionKind.NONZERO else need.expression
    ratio = sympy.cancel(base.subs(_GAMMA[2] ** 2, 1 - _ACROSS) / across)
    is_constant = not ratio.free_symbols & frozenset((*STATE, u))
    return Need(need.kind, ratio) if is_constant and need.kind is ConditionKind.NONZERO else need


def _without(needs: frozenset[Need], *symbols: sympy.Symbol) -> frozenset[Need]:
    """The needs without these symbols."""
    return frozenset(need for need in needs if not need.expression.free_symbols & frozenset(symbols))


def _through(
    u: sympy.Symbol, q: sympy.Expr, choices: Iterable[Sequence[sympy.Expr]], parts: Sequence[sympy.Expr]
) -> tuple[sympy.Expr, sympy.Expr, sympy.Expr] | None:
    """Polynomials of the state as functions of u = q where the zeros of a choice are 0, and a divisor that is not 0.

    A Gröbner basis over fractions of the coefficients proposes the functions; they are proven as combinations of the
    zeros.  None where the polynomials are no functions of u.
    """
    results = (_through_zeros(u, q, zeros, parts) for zeros in choices)
    return next((result for result in results if result is not None), None)


def _through_zeros(
    u: sympy.Symbol, q: sympy.Expr, zeros: Sequence[sympy.Expr], parts: Sequence[sympy.Expr]
) -> tuple[sympy.Expr, sympy.Expr, sympy.Expr] | None:
    """The result of :func:`_through` with these zeros."""
    if not all(e.is_polynomial(*STATE) for e in (q, *zeros, *parts)):
        return None
    names: dict[sympy.Expr, sympy.Symbol] = {}

    def named(e: sympy.Expr, monic: bool) -> sympy.Expr:
        p = sympy.Poly(e, *STATE, u)
        scale = p.LC() if monic else sympy.Integer(1)
        total = sympy.Integer(0)
        for monomial, coefficient in p.terms():
            value = sympy.cancel(coefficient / scale)
            value = value if value.is_Rational else names.setdefault(value, sympy.Symbol(f"c{len(names)}", real=True))
            total += value * sympy.prod(x**n for x, n in zip((*STATE, u), monomial, strict=True))
        return total

    relations = [named(e, True) for e in (*zeros, u - q)]
    targets = [named(e, False) for e in parts]
    order = (*(x for x in STATE if x != q), *(x for x in STATE if x == q), u)
    basis = sympy.groebner(
        relations, *order, order="lex", domain=sympy.QQ.frac_field(*names.values()) if names else sympy.QQ
    )
    meanings = {name: value for value, name in names.items()}
    divisor, functions = sympy.Integer(1), []
    for e in targets:
        above, below = sympy.fraction(sympy.together(basis.reduce(e)[1]))
        if above.free_symbols & frozenset(STATE):
            return None
        field_ = Field(Assumptions(u), [*relations, below * e - above])
        numerators = [field_.enter(relation).numerator for relation in relations]
        if not forces_zero(numerators, field_.enter(below * e - above).numerator, radical=False):
            return None
        divisor *= below.xreplace(meanings)
        functions.append((above / below).xreplace(meanings))
    for z in (*zeros, u - q):
        divisor *= sympy.Poly(z, *STATE, u).LC()
    return functions[0], functions[1], divisor
