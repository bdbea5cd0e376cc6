"""The common part of claims in files: tables, names, assumptions, samples, the top, and the clock of a motion."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations, pairwise
from typing import Annotated

import msgspec
import sympy
from flint import arb

from heavytop.errors import InputError, quoted, refusal
from heavytop.features.claims.algebra.conditions import (
    ConditionKind,
    Need,
    condition,
    conditions_for_zero,
    is_exactly_zero,
    solve_relations,
    written,
)
from heavytop.features.claims.algebra.elliptic import FORMULAS
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Field
from heavytop.features.claims.algebra.reader import FUNCTIONS as FUNCTION_NAMES
from heavytop.features.claims.algebra.reader import (
    SIGNS,
    Comparison,
    Formula,
    assume,
    assumptions,
    comparisons,
    parse,
    symbol,
)
from heavytop.features.claims.algebra.ring import Unprovable
from heavytop.features.claims.algebra.statement import AFTER, ALL, BEFORE, TIME, Domain, Setting
from heavytop.features.claims.algebra.structure import rate_along, rationals
from heavytop.features.claims.audit.statements import SYSTEMS
from heavytop.features.claims.library.entry import Entry
from heavytop.precision import exact
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, Parameters, System, system

# The tables of a claim in TOML: a motion, a component of one, a first integral or an invariant relation.


Text = Annotated[str, msgspec.Meta(max_length=20_000)]
Three = Annotated[list[Text], msgspec.Meta(min_length=3, max_length=3, description="a list of three")]
Tensor = Annotated[list[Text | list[Text]], msgspec.Meta(min_length=3, max_length=9)]
Samples = Annotated[list[Text], msgspec.Meta(min_length=1, max_length=8)]


class TopTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[top]: moments of inertia, weight, centre of mass; the rotor, λ where the claim is about `gyrostat`, or k1, k2,
    k3 where it is about `heavy_gyrostat`.

    inertia: three principal moments; or a tensor in other axes: six numbers I11, I22, I33, I12, I13, I23, nine row by
    row, or three rows of three.
    """

    inertia: Tensor
    weight: Text
    centre: Three
    rotor: Text | Three | None = None


class ClaimedMotionTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[motion]: Ω(t), γ(t), and the attitude by one of angles (φ, θ, ψ), quaternion (w, x, y, z) and matrix R.

    γ and Ω may be left out where the attitude is given.
    """

    omega: Three | None = None
    gamma: Three | None = None
    angles: Three | None = None
    quaternion: Annotated[list[Text], msgspec.Meta(min_length=4, max_length=4, description="a list of four")] | None = (
        None
    )
    matrix: (
        Annotated[list[Three], msgspec.Meta(min_length=3, max_length=3, description="three rows of three")] | None
    ) = None


class QuadratureTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[quadrature]: the formulas of [motion] contain u, and t = F(u) + constant where u is between bounds.

    time: F(u); or integrand: F'(u).  where: comparisons that bound u.  points: values of u for a witness.
    phi, theta, psi: of a component, rates of the angles in the state and u.
    """

    variable: str
    time: Text | None = None
    integrand: Text | None = None
    phi: Text | None = None
    theta: Text | None = None
    psi: Text | None = None
    where: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    points: Samples | None = None


class IntegralTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[integral]: F(Ω, γ), where it is claimed to be constant, and exact states for a witness.

    Without states the audit uses states of its own, on the conditions where it finds such.
    """

    value: Text
    where: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    states: (
        Annotated[
            list[Annotated[list[Text], msgspec.Meta(min_length=6, max_length=6)]],
            msgspec.Meta(min_length=1, max_length=8, description="1 to 8 lists of six"),
        ]
        | None
    ) = None


class ComponentTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[component]: a quantity u of the state and angles, claimed as functions of t.

    reduced: f(u), the square of its rate.  constants: first integrals with the value of the start, besides energy,
    area, |M|² and components of Ω.  where: formulas that are 0 at every state of the claim.
    """

    quantity: Text
    value: Text | None = None
    reduced: Text | None = None
    constants: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    where: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    phi: Text | None = None
    theta: Text | None = None
    psi: Text | None = None


class ClaimFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file; entry: its keys as an entry of the library, where it is one."""

    name: Annotated[str, msgspec.Meta(min_length=1, max_length=80)]
    kind: str
    top: TopTable
    stable: bool | None = None
    system: str | None = None
    source: Annotated[str, msgspec.Meta(max_length=2_000)] = ""
    domain: str = "all"
    times: Samples | None = None
    assume: Annotated[list[Text], msgspec.Meta(max_length=20)] = []
    parameters: Annotated[dict[str, Samples | Text], msgspec.Meta(max_length=20)] = {}
    definitions: Annotated[dict[str, Text], msgspec.Meta(max_length=40)] = {}
    relations: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    motion: ClaimedMotionTable | None = None
    quadrature: QuadratureTable | None = None
    integral: IntegralTable | None = None
    component: ComponentTable | None = None
    start: ClaimedMotionTable | None = None
    entry: Entry | None = None


def sample_rows(parameters: Mapping[str, Sequence[str] | str]) -> list[dict[str, str]]:
    """The values of the parameters, one dict per sample; a single value is that of all samples, in a list too.

    Raises InputError where the lists differ in length.
    """
    samples = {name: [values] if isinstance(values, str) else values for name, values in parameters.items()}
    lengths = {name: len(values) for name, values in samples.items() if len(values) > 1}
    if len({*lengths.values()}) > 1:
        counts = ", ".join(f"{count} of {name}" for name, count in lengths.items())
        raise InputError(f"The numbers of samples differ: {counts}.", "Give as many for each, or one for all.")
    return [
        {name: values[index % len(values)] for name, values in samples.items()}
        for index in range(max(lengths.values(), default=1))
    ]


# The inertia of a claim: three principal moments, or six or nine entries of the tensor in other axes.


_ORDER = (0, 3, 4, 3, 1, 5, 4, 5, 2)
"""Indices of the nine entries, row by row, among I11, I22, I33, I12, I13, I23."""
_REMEDY = "Give 3 principal moments, 6 entries I11, I22, I33, I12, I13, I23 of the tensor, or 9, row by row."


def read_tensor(inertia: Sequence[str | list[str]]) -> tuple[str, ...]:
    """The texts of ``inertia``: three moments, or nine entries row by row.

    Raises InputError unless they are 3, 6 or 9, or 3 rows of 3.
    """
    if all(isinstance(part, list) for part in inertia):
        if len(inertia) != 3 or any(len(row) != 3 for row in inertia):
            raise InputError("top.inertia must have three rows of three.", _REMEDY)
        return tuple(text for row in inertia for text in row)
    if not all(isinstance(part, str) for part in inertia) or len(inertia) not in (3, 6, 9):
        raise InputError(f"top.inertia must have 3, 6 or 9 entries; got {len(inertia)}.", _REMEDY)
    texts = tuple(str(part) for part in inertia)
    return tuple(texts[index] for index in _ORDER) if len(texts) == 6 else texts


def tensor_of(entries: Sequence[sympy.Expr], texts: Sequence[str]) -> tuple[sympy.Expr | tuple[sympy.Expr, ...], ...]:
    """Three moments, or three rows; raises InputError, with its texts, for a tensor that is not symmetric."""
    if len(entries) == 3:
        return tuple(entries)
    rows = tuple(tuple(entries[3 * i : 3 * i + 3]) for i in range(3))
    for i, j in combinations(range(3), 2):
        if sympy.expand(rows[i][j] - rows[j][i]) != 0:
            pair = f"I{i + 1}{j + 1} = {texts[3 * i + j]}, I{j + 1}{i + 1} = {texts[3 * j + i]}"
            raise InputError(f"The tensor of inertia is not symmetric: {pair}.", _REMEDY)
    is_diagonal = all(rows[i][j] == 0 for i, j in combinations(range(3), 2))
    return (rows[0][0], rows[1][1], rows[2][2]) if is_diagonal else rows


def minors(inertia: Sequence[sympy.Expr | tuple[sympy.Expr, ...]]) -> tuple[sympy.Expr, ...]:
    """Expressions > 0 of every body: the moments; of a full tensor its principal minors, the determinant last."""
    if not isinstance(inertia[0], tuple):
        return tuple(inertia)
    return _principal_minors(sympy.Matrix(inertia))


def _principal_minors(matrix: sympy.Matrix) -> tuple[sympy.Expr, ...]:
    indices = (chosen for size in (1, 2, 3) for chosen in combinations(range(3), size))
    return tuple(sympy.expand(matrix.extract(chosen, chosen).det()) for chosen in indices)


STATE = sympy.symbols("Omega1:4 gamma1:4", real=True)
RESERVED = {"t", "pi", *(FUNCTION_NAMES.keys() - FORMULAS.keys()), *(str(variable) for variable in STATE)}
"""Names that no parameter may have; names of elliptic functions are free, since these precede a parenthesis."""
_SAMPLE_BITS = 512
_MOST_BITS = 6_640
"""The most bits of numerator and denominator of a number in a sample: 2000 digits."""
_OF_THE_TOP = "The moments, the weight, the centre of mass and k of a top are constant: use numbers and parameters."
_ASSUMED = "Assumptions may contain parameters only."
_OF_PARAMETERS = "Relations may contain parameters only; put conditions on the state into where of [integral]."


@dataclass(frozen=True, slots=True)
class Context:
    """The context of a claim: names, assumptions, samples, and the top.

    rotor: λ of a gyrostat; rotor_needs: of it.  carried: k of a heavy gyrostat.  compared: the assumptions.
    """

    names: dict[str, Formula]
    symbols: dict[str, sympy.Symbol]
    assumed: Setting
    samples: tuple[dict[sympy.Symbol, Fraction], ...]
    relations: tuple[sympy.Expr, ...]
    top: Parameters
    rotor: sympy.Expr | None
    needs: frozenset[Need]
    rotor_needs: frozenset[Need]
    carried: tuple[sympy.Expr, ...] | None = None
    compared: tuple[Comparison, ...] = ()

    def with_other_samples(self) -> Context:
        """The context with samples near the first, and with parameters of other signs, as far as the claim admits."""
        others = []
        for sign in (1, -1):
            sample = dict(self.samples[0])
            for n, (parameter, value) in enumerate(sample.items()):
                for step in (Fraction(1, 7 + 2 * n), Fraction(-1, 7 + 2 * n)):
                    trial = {**sample, parameter: sign * (value + step * (abs(value) or 1))}
                    if _is_admitted(self, trial, self.compared):
                        sample = trial
                        break
            others.append(sample)
        return replace(self, samples=(*self.samples, *others))

    def with_rotor(self, rotor: sympy.Expr | None, is_constant: bool) -> Context:
        """The context with a simplified rotor; raises InputError unless it is shown to be constant in time."""
        if not is_constant:
            text = quoted(str(self.rotor))[1:-1]
            raise InputError(
                f"top.rotor: {text} is not shown to be constant in time.",
                "The rotor of a gyrostat turns at a constant rate: use parameters, or first integrals of its motion.",
            )
        return replace(self, rotor=rotor)

    @property
    def systems(self) -> tuple[System, ...]:
        """The systems that the claim may be about."""
        if self.carried is not None:
            return (HEAVY_GYROSTAT,)
        turns_about_two = self.rotor is not None and not isinstance(self.top.inertia[0], tuple)
        return tuple(system for system in SYSTEMS if system is not GYROSTAT or turns_about_two)

    def parameters(self, system: System) -> Parameters:
        """The parameters of the field; raises InputError where the file lacks the rotor of the system."""
        if (system is HEAVY_GYROSTAT) is not (self.carried is not None):
            raise _other_rotor(system)
        if self.carried is not None:
            return self.top._replace(rotor=self.carried)
        if system is GYROSTAT and isinstance(self.top.inertia[0], tuple):
            cause = "gyrostat has its rotor on a principal axis, and top.inertia has products of inertia."
            raise InputError(cause, "Give the three principal moments, or use heavy_gyrostat.")
        if system is GYROSTAT and self.rotor is None:
            raise InputError("gyrostat needs a rotor, and the file gives none.", "Add rotor to [top].")
        return self.top._replace(rotor=sympy.Integer(0) if self.rotor is None else self.rotor)


def _other_rotor(system: System) -> InputError:
    if system is HEAVY_GYROSTAT:
        cause = "heavy_gyrostat needs a rotor of three components."
        return InputError(cause, "Add rotor = [k1, k2, k3] to [top].")
    cause = f"{system.name} does not take a rotor of three components."
    return InputError(cause, "Use the system heavy_gyrostat, or give no such rotor.")


def parse_context(content: ClaimFile, variables: Iterable[sympy.Symbol]) -> Context:
    """Parsed parameters, assumptions, definitions and top; raises InputError for an invalid one."""
    variables = tuple(variables)
    reserved = RESERVED.union(map(str, variables))
    for name in (*content.parameters, *content.definitions):
        _require_name("A name", name)
        if name in content.parameters and name in content.definitions:
            raise InputError(f"The name {name!r} is a parameter and a definition.", "Rename one of them.")
        if name in reserved:
            raise InputError(f"The name {name!r} is reserved.", f"Reserved names: {', '.join(sorted(reserved))}.")
    texts = list(assumptions(content.assume))
    tensor = read_tensor(content.top.inertia)
    diagonal = tensor if len(tensor) == 3 else tensor[::4]
    # the moments of inertia of a top are positive, assumed or not
    positive = {left for left, right, kind in texts if right == "0" and kind is ConditionKind.POSITIVE}
    positive |= {text.strip() for text in diagonal}
    symbols = {
        name: sympy.Symbol(name, positive=True) if name in positive else sympy.Symbol(name, real=True)
        for name in content.parameters
    }
    names = {name: symbol(value) for name, value in symbols.items()}
    names |= {"pi": symbol(sympy.pi), **{str(variable): symbol(variable) for variable in variables}}
    for name, text in content.definitions.items():
        later = content.definitions.keys() - names.keys() - FUNCTION_NAMES.keys()
        if used := sorted(later.intersection(re.findall(r"\b\w+\b(?!\s*\()", text))):
            cause = f"The definition of {name} uses {used[0]}, which is not defined before it."
            raise InputError(cause, "Change the order of [definitions].")
        names[name] = parse(text, names, f"definition of {name}")
    sides = [(parse(a, names, "assume"), parse(b, names, "assume"), kind) for a, b, kind in texts]
    compared = [(a.expression, b.expression, kind) for a, b, kind in sides]
    needs = needs_of(formula for a, b, _ in sides for formula in (a, b))
    top = content.top
    moments = [parse(text, names, "top.inertia") for text in tensor]
    arm, weight = three(top.centre, names, "top.centre"), parse(top.weight, names, "top.weight")
    rotor = parse(top.rotor, names, "top.rotor") if isinstance(top.rotor, str) else None
    carried = three(top.rotor, names, "top.rotor") if isinstance(top.rotor, list) else ()
    relations = [parse(text, names, "relations") for text in content.relations]
    weak = [(a, b) for a, b, kind in compared if kind is ConditionKind.NONNEGATIVE]
    equal = [a - b for index, (a, b) in enumerate(weak) if (b, a) in weak[:index]]
    for where, formulas in {"inertia": moments, "centre": arm, "weight": [weight], "rotor": carried}.items():
        _require_constant(f"top.{where}", formulas, _OF_THE_TOP, variables)
    _require_constant("relations", relations, _OF_PARAMETERS, variables)
    _require_constant("assume", [side for *pair, _ in sides for side in pair], _ASSUMED, variables)
    inertia = tensor_of([part.expression for part in moments], tensor)
    centre = tuple(part.expression for part in arm)
    context = Context(
        names,
        symbols,
        assume(compared, needs, minors(inertia), symbols.values()),
        tuple(
            {symbols[name]: sample_number(value, name) for name, value in row.items()}
            for row in sample_rows(content.parameters)
        ),
        (*(relation.expression for relation in relations), *equal),
        Parameters(inertia, tuple(weight.expression * part for part in centre), sympy.Integer(0)),
        None if rotor is None else rotor.expression,
        needs_of([*moments, *arm, weight, *carried, *relations]).union(
            *(condition("/", (part,)) for part in minors(inertia)[-3:])
        ),
        frozenset() if rotor is None else rotor.needs,
        tuple(part.expression for part in carried) or None,
        tuple(compared),
    )
    _check_samples(context, compared)
    return replace(context, samples=(*context.samples, *_at_equality(context, compared)))


def _require_name(what: str, name: str) -> None:
    """Raises InputError for a text that no formula can contain as a name."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,30}", name):
        rule = "a letter and up to 30 of a-z, A-Z, 0-9 and _"
        raise refusal(what, rule, quoted(name), "Rename it, also in the formulas: I1, alpha, k_2.")


def sample_number(text: str, what: str) -> Fraction:
    """The exact number of a sample, a state or a time; raises InputError for one of thousands of digits."""
    try:
        value = exact(text)
    except InputError:
        remedy = "Give a decimal or a fraction; a name for sqrt(2) goes into [definitions]."
        raise refusal(what, "a rational number", quoted(text), remedy) from None
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > _MOST_BITS:
        raise InputError(f"{what} = {quoted(text)[1:-1]} is too long a number.", "Use numbers of at most 2000 digits.")
    return value


def needs_of(formulas: Iterable[Formula]) -> frozenset[Need]:
    """The needs of all of them."""
    return frozenset().union(*(formula.needs for formula in formulas))


def three(texts: Iterable[str], names: dict[str, Formula], where: str) -> tuple[Formula, Formula, Formula]:
    """The formulas of three texts."""
    first, second, third = (parse(text, names, f"{where}[{index}]") for index, text in enumerate(texts))
    return first, second, third


def _require_constant(where: str, formulas: Sequence[Formula], remedy: str, variables: Iterable[sympy.Symbol]) -> None:
    """Raises InputError where a formula or one of its needs depends on a symbol that moves."""
    for formula in formulas:
        free = formula.expression.free_symbols.union(*(need.expression.free_symbols for need in formula.needs))
        moving = sorted(map(str, free & {TIME, *STATE, *variables}))
        if moving:
            text = quoted(written(str(formula.expression)))[1:-1]
            raise InputError(f"{where}: {text} depends on {', '.join(moving)}.", remedy)


def _check_samples(context: Context, compared: Sequence[Comparison]) -> None:
    """Raises InputError for a sample that breaks the claim's own assumptions: it would be a false witness."""
    for sample in context.samples:
        values = ", ".join(f"{name} = {value}" for name, value in sample.items())
        broken = next(_broken(context, sample, compared), None)
        if broken is not None:
            cause = f"The sample {values or 'without parameters'} violates the {written(broken)}."
            raise InputError(cause, "Change the sample.")
        for index, moment in enumerate(minors(context.top.inertia), 1):
            if not (ball := _at(moment, sample)) > 0:
                is_full = isinstance(context.top.inertia[0], tuple)
                name = "The principal minor" if is_full else f"I{index} ="
                at_sample = moment.subs(rationals(sample))
                number = written(str(at_sample)) if at_sample.is_Rational else ball.str(6, radius=False)
                got = f"; it is {number} at the sample {values}" if moment.free_symbols else ""
                cause = f"{name} {written(str(moment))} of top.inertia must be positive{got}."
                raise InputError(cause, _remedy_for_moment(context, moment, compared))


def _remedy_for_moment(context: Context, moment: sympy.Expr, compared: Sequence[Comparison]) -> str:
    """The remedy for a moment that is not positive: another sample, or another formula where no sample helps."""
    others = [other for other in minors(context.top.inertia) if other != moment]
    for facts in ((), others):
        assumed = assume(compared, (), facts, context.symbols.values())
        with suppress(Unprovable):
            field_ = Field(assumed.assumptions(0), [moment])
            if field_.tower.sign(field_.enter(-moment)).value > 0:
                return "Change top.inertia: no values of the parameters make it positive."
    return "Change the sample."


def _broken(context: Context, sample: dict[sympy.Symbol, Fraction], compared: Sequence[Comparison]) -> Iterator[str]:
    """The assumptions and relations that a sample breaks."""
    for a, b, kind in compared:
        is_met = kind is not ConditionKind.NONZERO and bool(_at(a - b, sample) > 0)
        if not is_met and kind is not ConditionKind.POSITIVE:
            is_met = is_exactly_zero(a - b, sample) is (kind is ConditionKind.NONNEGATIVE)
        if not is_met:
            yield f"assumption {a} {next(sign for sign in SIGNS if SIGNS[sign] is kind)} {b}"
    yield from (f"relation {zero} = 0" for zero in context.relations if is_exactly_zero(zero, sample) is False)


def _at_equality(context: Context, compared: Sequence[Comparison]) -> Iterator[dict[sympy.Symbol, Fraction]]:
    """Samples at which both sides of a weak assumption are equal, where one side is a parameter."""
    for *pair, kind in compared:
        for parameter, other in (pair, pair[::-1]) if kind is ConditionKind.NONNEGATIVE else ():
            for sample in context.samples if parameter.is_Symbol else ():
                value = other.subs(rationals(sample))
                if not value.is_Rational:
                    continue
                at_end = {**sample, parameter: Fraction(value)}
                if _is_admitted(context, at_end, compared):
                    yield at_end
                    break


def _is_admitted(context: Context, sample: dict[sympy.Symbol, Fraction], compared: Sequence[Comparison]) -> bool:
    """Whether a sample has positive moments and breaks no assumption or relation."""
    moments = (_at(moment, sample) for moment in minors(context.top.inertia))
    return all(m > 0 for m in moments) and not any(_broken(context, sample, compared))


def _at(expression: sympy.Expr, sample: dict[sympy.Symbol, Fraction]) -> arb:
    try:
        return evaluate(expression, sample, _SAMPLE_BITS)
    except (KeyError, Unprovable):
        raise InputError(f"{written(str(expression))[:80]} has no value at a sample.", "Use parameters only.") from None


def setting_of(context: Context, variable: sympy.Symbol) -> Setting:
    """The setting of a claim in this context."""
    relations = tuple(part for relation in context.relations for part in conditions_for_zero(relation))
    parameters = frozenset(context.symbols.values())
    setting = replace(
        context.assumed,
        variable=variable,
        relations=relations,
        parameters=parameters,
        samples=context.samples,
        bodies=_body_needs(context.top.inertia),
    )
    known = replace(setting.assumptions(0), relations=())
    return replace(setting, solutions=solve_relations(relations, known, parameters))


def _body_needs(inertia: Sequence[sympy.Expr]) -> tuple[Need, ...]:
    """The needs of a rigid body: no principal moment exceeds the sum of the other two.

    For a tensor ∫ x xᵀ dm = ½ tr I − I is positive semidefinite: its principal minors are >= 0.
    () for numbers: a claim about one top is judged for that top, and a claim about many is not refuted by a top that
    no body has.
    """
    matrix = sympy.Matrix(inertia)
    if not matrix.free_symbols:
        return ()
    if not isinstance(inertia[0], tuple):
        return tuple(Need(ConditionKind.NONNEGATIVE, sum(inertia) - 2 * moment) for moment in inertia)
    minors = _principal_minors(sympy.eye(3) * matrix.trace() / 2 - matrix)
    return tuple(Need(ConditionKind.NONNEGATIVE, minor) for minor in minors if minor.free_symbols)


def of_file(requested: System | None, written: str | None, default: System) -> System:
    """The system requested, else the one written in a file, else the default; raises InputError where two differ."""
    of_claim = None if written is None else system(written)
    if requested is not None and of_claim is not None and requested is not of_claim:
        cause = f"The file is about {of_claim.name}, but {requested.name} was requested."
        raise InputError(cause, "Give the system of the file, or none.")
    return requested or of_claim or default


# The clock of a claimed motion: the time itself, or a quadrature t = F(u) + constant that is not inverted.
#
# Formulas in u are a motion where u is between bounds and F' is finite and never 0 there: u(t) is the inverse of F,
# with u' = 1/F'(u), and rates are taken through it.


DOMAINS = {"all": ALL, "t<=0": BEFORE, "t>0": AFTER}
_POINTS = tuple(Fraction(*pair) for pair in ((1, 3), (-1, 2), (7, 5), (-9, 4)))
_BETWEEN = (Fraction(1, 2), Fraction(1, 3), Fraction(4, 5))
_BEYOND = (Fraction(1, 7), Fraction(3, 2))


@dataclass(frozen=True, slots=True)
class Clock:
    """The variable in the formulas of a motion, and the derivative in time.

    variable: t or u.  values: F, if given, F' and 1/F', which have to be continuous; none where t is the variable.
    needs: of these, and of the bounds of u.
    """

    variable: sympy.Symbol
    rate: Callable[[sympy.Expr], sympy.Expr]
    domain: Domain
    values: tuple[sympy.Expr, ...] = ()
    needs: frozenset[Need] = frozenset()


def variable_of(content: ClaimFile) -> sympy.Symbol:
    """The variable in the formulas of a motion: t, or that of its quadrature.

    Raises InputError where that name is taken.
    """
    if content.quadrature is None:
        return TIME
    name = content.quadrature.variable
    _require_name("quadrature.variable", name)
    if name in RESERVED:
        taken = f"Reserved names: {', '.join(sorted(RESERVED))}."
        raise InputError(f"The name {name!r} of the variable of [quadrature] is reserved.", taken)
    return sympy.Symbol(name, real=True)


def read_clock(content: ClaimFile, context: Context) -> Clock:
    """The clock of a motion claimed in a file; raises InputError for an invalid quadrature."""
    table, u = content.quadrature, variable_of(content)
    if table is None:
        return Clock(TIME, rate_along({TIME: sympy.Integer(1)}), DOMAINS[content.domain])
    if content.domain != "all" or content.times is not None:
        cause = f"domain and times are about t, and the formulas of this claim hold {u}."
        raise InputError(cause, "Bound it by where, and give points, in [quadrature].")
    text = table.time or table.integrand
    if text is None or (table.time is not None and table.integrand is not None):
        raise InputError("[quadrature] needs either time or integrand.", "Give F(u) as time, or F'(u) as integrand.")
    clock = parse(text, context.names, "quadrature")
    integrand = clock.expression if table.time is None else rate_along({u: sympy.Integer(1)})(clock.expression)
    if integrand == 0:
        raise InputError(f"[quadrature]: t = {text[:60]} does not depend on {u}.", "Give t as a function of it.")
    where = "where of [quadrature]"
    links = [link for text in table.where for link in comparisons(text, where)]
    if any(kind is not ConditionKind.POSITIVE for *_, kind in links):
        raise InputError(f"{where}: the bounds of {u} must be strict.", "Write < and > in place of <= and >=.")
    sides = [[parse(side, context.names, where) for side in link[:2]] for link in links]
    facts = tuple(above.expression - below.expression for above, below in sides)
    label = ", ".join(table.where) or f"all {u}"
    domain = Domain(label, 0, _points(table, u, facts, context.samples), f"{u} is the variable of [quadrature]", facts)
    needs = needs_of([clock, *(side for pair in sides for side in pair)]) | condition("/", (integrand,))
    values = (integrand, 1 / integrand) if table.time is None else (clock.expression, integrand, 1 / integrand)
    return Clock(u, rate_along({u: 1 / integrand}), domain, values, needs)


def _points(
    table: QuadratureTable,
    u: sympy.Symbol,
    facts: Sequence[sympy.Expr],
    samples: Sequence[Mapping[sympy.Symbol, Fraction]],
) -> tuple[Fraction, ...]:
    """The points of the file, else points between and beyond the bounds at the samples."""
    if table.points is not None:
        return tuple(sample_number(point, "quadrature.points") for point in table.points)
    points = list(_POINTS)
    for sample in samples:
        ends = sorted(end for fact in facts if (end := _end(fact, u, sample)) is not None)
        points += [low + (high - low) * part for low, high in pairwise(ends) for part in _BETWEEN]
        points += [end + sign * step for end in ends for step in _BEYOND for sign in (1, -1)]
    return tuple(dict.fromkeys(points))


def _end(fact: sympy.Expr, u: sympy.Symbol, sample: Mapping[sympy.Symbol, Fraction]) -> Fraction | None:
    """The rational zero of a bound that is linear in u, at a sample."""
    slope = sympy.diff(fact, u)
    if u in slope.free_symbols or slope == 0:
        return None
    value = sympy.expand((u - fact / slope).subs(rationals(sample)))
    return Fraction(value) if value.is_Rational else None
