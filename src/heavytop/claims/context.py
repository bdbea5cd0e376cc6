"""What every kind of claim in a file shares: its names, assumptions and samples, and the top that it is about."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Self

import sympy
from flint import arb
from msgspec import structs

from heavytop.claims.assume import Assumed, assume, comparisons
from heavytop.claims.claim_file import ClaimFile, sample_rows
from heavytop.claims.conditions import Kind, Need, condition, is_exactly_zero
from heavytop.claims.entry import Entry
from heavytop.claims.evaluate import evaluate
from heavytop.claims.expression import FUNCTIONS as FUNCTION_NAMES
from heavytop.claims.expression import Formula, parse, symbol
from heavytop.claims.real_zeros import conditions_for_zero
from heavytop.claims.relations import solve_relations
from heavytop.claims.sign import Unprovable
from heavytop.claims.statement import Setting
from heavytop.claims.statements import SYSTEMS
from heavytop.claims.tensor import minors, of_bodies, read_tensor
from heavytop.errors import InputError, quoted
from heavytop.precision import exact
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters, System, system

TIME = sympy.Symbol("t", real=True)
STATE = sympy.symbols("Omega1:4 gamma1:4", real=True)
RESERVED = {"t", "pi", *FUNCTION_NAMES, *(str(variable) for variable in STATE)}
_SAMPLE_BITS = 512
_MOST_BITS = 6_640
"""Of numerator and denominator of a number in a sample: 2000 digits."""
_OF_THE_TOP = "The moments, the weight, the centre of mass and k of a top are constant: use numbers and parameters."
_OF_PARAMETERS = "Relations are between parameters; conditions on the state stand in where of [integral]."


@dataclass(frozen=True, slots=True)
class Context:
    """What every kind of claim shares: names, assumptions, samples, and the top they are about.

    rotor: λ of a gyrostat, with what it needs.  carried: k of a heavy gyrostat.
    """

    names: dict[str, Formula]
    symbols: dict[str, sympy.Symbol]
    assumed: Assumed
    samples: tuple[dict[sympy.Symbol, Fraction], ...]
    relations: tuple[sympy.Expr, ...]
    top: Parameters
    rotor: sympy.Expr | None
    needs: frozenset[Need]
    rotor_needs: frozenset[Need]
    carried: tuple[sympy.Expr, ...] | None = None

    def with_rotor(self, rotor: sympy.Expr | None, is_constant: bool) -> Context:
        """The context with the rotor in this form; raises InputError unless it is shown to be constant in time."""
        if not is_constant:
            text = quoted(str(self.rotor))[1:-1]
            raise InputError(
                f"top.rotor: {text} is not shown to be constant in time.",
                "The rotor of a gyrostat turns at a constant rate: use parameters, or first integrals of its motion.",
            )
        return replace(self, rotor=rotor)

    @property
    def systems(self) -> tuple[System, ...]:
        """The systems that the claim says something about."""
        if self.carried is not None:
            return (HEAVY_GYROSTAT,)
        return tuple(system for system in SYSTEMS if system is not GYROSTAT or self._turns_about_two)

    @property
    def _turns_about_two(self) -> bool:
        return self.rotor is not None and not isinstance(self.top.inertia[0], tuple)

    def parameters(self, system: System) -> Parameters:
        """Parameters of the field; raises InputError where the rotor of the file is none, or not that of the system."""
        if (system is HEAVY_GYROSTAT) is not (self.carried is not None):
            raise _other_rotor(system)
        if self.carried is not None:
            return self.top._replace(rotor=self.carried)
        if system is GYROSTAT and isinstance(self.top.inertia[0], tuple):
            cause = "gyrostat has its rotor on a principal axis, and top.inertia has products of inertia."
            raise InputError(cause, "Give the three principal moments, or use heavy_gyrostat.")
        if system is GYROSTAT and self.rotor is None:
            raise InputError("The file gives no rotor, so it says nothing about gyrostat.", "Add rotor to [top].")
        return self.top._replace(rotor=sympy.Integer(0) if self.rotor is None else self.rotor)


def _other_rotor(system: System) -> InputError:
    """What is said where one of the two has a rotor of three components, and the other has not."""
    if system is HEAVY_GYROSTAT:
        cause = "The file gives no rotor of three components, so it says nothing about heavy_gyrostat."
        return InputError(cause, "Add rotor = [k1, k2, k3] to [top].")
    cause = f"The file gives a rotor of three components, so it says nothing about {system.name}."
    return InputError(cause, "Use the system heavy_gyrostat, or give no such rotor.")


def parse_context(content: ClaimFile, variables: Iterable[sympy.Symbol]) -> Context:
    """Parsed parameters, assumptions, definitions and top; raises InputError for what cannot be understood."""
    variables = tuple(variables)
    reserved = RESERVED.union(map(str, variables))
    for name in (*content.parameters, *content.definitions):
        if name in reserved or (name in content.parameters and name in content.definitions):
            raise InputError(f"The name {name!r} is taken.", f"Taken are {', '.join(sorted(reserved))}.")
    above = [link for text in content.assume for link in comparisons(text)]
    tensor = read_tensor(content.top.inertia)
    # the moments of inertia of a top are positive, said or not
    positive = {left for left, right in above if right == "0"} | {text.strip() for text in tensor.diagonal}
    symbols = {
        name: sympy.Symbol(name, positive=True) if name in positive else sympy.Symbol(name, real=True)
        for name in content.parameters
    }
    names = {name: symbol(value) for name, value in symbols.items()}
    names |= {"pi": symbol(sympy.pi), **{str(variable): symbol(variable) for variable in variables}}
    for name, text in content.definitions.items():
        names[name] = parse(text, names, f"definition of {name}")
    sides = [(parse(left, names, "assume"), parse(right, names, "assume")) for left, right in above]
    bounds = [(left.expression, right.expression) for left, right in sides]
    top = content.top
    moments = [parse(text, names, "top.inertia") for text in tensor.texts]
    arm = [*three(top.centre, names, "top.centre"), parse(top.weight, names, "top.weight")]
    rotor = parse(top.rotor, names, "top.rotor") if isinstance(top.rotor, str) else None
    carried = three(top.rotor, names, "top.rotor") if isinstance(top.rotor, list) else ()
    relations = [parse(text, names, "relations") for text in content.relations]
    _check_constant("top.inertia", moments, _OF_THE_TOP, variables)
    _check_constant("top.centre", arm[:3], _OF_THE_TOP, variables)
    _check_constant("top.weight", arm[3:], _OF_THE_TOP, variables)
    _check_constant("top.rotor", carried, _OF_THE_TOP, variables)
    _check_constant("relations", relations, _OF_PARAMETERS, variables)
    weight = arm.pop()
    inertia = tensor.of([part.expression for part in moments])
    centre = tuple(part.expression for part in arm)
    context = Context(
        names,
        symbols,
        assume(bounds, needs_of(side for link in sides for side in link), minors(inertia), symbols.values()),
        tuple(
            {symbols[name]: sample_number(value, name) for name, value in row.items()}
            for row in sample_rows(content.parameters)
        ),
        tuple(relation.expression for relation in relations),
        Parameters(inertia, tuple(weight.expression * part for part in centre), sympy.Integer(0)),
        None if rotor is None else rotor.expression,
        needs_of([*moments, *arm, weight, *carried, *relations]).union(
            *(condition("/", (part,)) for part in minors(inertia)[-3:])
        ),
        frozenset() if rotor is None else rotor.needs,
        tuple(part.expression for part in carried) or None,
    )
    _check_samples(context, bounds)
    return context


def sample_number(text: str, what: str) -> Fraction:
    """The exact number of a sample, a state or a time; raises InputError for one of thousands of digits."""
    try:
        value = exact(text)
    except InputError as error:
        raise InputError(f"{what}: {error.cause}", error.remedy) from None
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > _MOST_BITS:
        raise InputError(f"{what} = {quoted(text)[1:-1]} is too long a number.", "Use numbers of at most 2000 digits.")
    return value


def needs_of(formulas: Iterable[Formula]) -> frozenset[Need]:
    """What all of them need."""
    return frozenset().union(*(formula.needs for formula in formulas))


def three(texts: Iterable[str], names: dict[str, Formula], where: str) -> tuple[Formula, Formula, Formula]:
    """The formulas of three texts."""
    first, second, third = (parse(text, names, f"{where}[{index}]") for index, text in enumerate(texts))
    return first, second, third


def _check_constant(where: str, formulas: Sequence[Formula], remedy: str, variables: Iterable[sympy.Symbol]) -> None:
    """Raises InputError where a formula, or what it needs, depends on what moves, directly or not."""
    for formula in formulas:
        free = formula.expression.free_symbols.union(*(need.expression.free_symbols for need in formula.needs))
        moving = sorted(map(str, free & {TIME, *STATE, *variables}))
        if moving:
            text = quoted(str(formula.expression))[1:-1]
            raise InputError(f"{where}: {text} depends on {', '.join(moving)}.", remedy)


def _check_samples(context: Context, bounds: list[tuple[sympy.Expr, sympy.Expr]]) -> None:
    """Samples that break the claim's own assumptions would be false witnesses: raises InputError."""
    for sample in context.samples:
        shown = ", ".join(f"{name} = {value}" for name, value in sample.items())
        for left, right in bounds:
            if not _at(left - right, sample) > 0:
                raise InputError(f"The sample {shown} breaks the assumption {left} > {right}.", "Change the sample.")
        for relation in context.relations:
            if is_exactly_zero(relation, sample) is False:
                raise InputError(f"The sample {shown} breaks the relation {relation} = 0.", "Change the sample.")
        for index, moment in enumerate(minors(context.top.inertia), 1):
            if not _at(moment, sample) > 0:
                full = isinstance(context.top.inertia[0], tuple)
                what = "the tensor of inertia not positive definite" if full else f"I{index} not positive"
                raise InputError(f"The sample {shown} makes {what}.", "Change the sample.")


def _at(expression: sympy.Expr, sample: dict[sympy.Symbol, Fraction]) -> arb:
    try:
        return evaluate(expression, sample, _SAMPLE_BITS)
    except (KeyError, Unprovable):
        raise InputError(
            f"{str(expression)[:80]} is not a number at a sample.", "It may hold parameters only."
        ) from None


def setting_of(context: Context, variable: sympy.Symbol) -> Setting:
    """The setting of a claim in this context."""
    a = context.assumed
    relations = tuple(part for relation in context.relations for part in conditions_for_zero(relation))
    parameters = frozenset(context.symbols.values())
    setting = Setting(
        variable,
        a.positive,
        context.samples,
        a.greater,
        relations=relations,
        facts=a.facts,
        weak=a.weak,
        ranges=a.ranges,
        parameters=parameters,
        bodies=_body_needs(context.top.inertia),
    )
    known = replace(setting.assumptions(0), relations=())
    return replace(setting, solutions=solve_relations(relations, known, parameters))


def _body_needs(inertia: Sequence[sympy.Expr]) -> tuple[Need, ...]:
    """No principal moment of a rigid body exceeds the sum of the other two; () for moments that are numbers.

    A claim about one top is judged about that top, as the equations do not mind; one about many is not refuted by a
    top that no body is.
    """
    if isinstance(inertia[0], tuple):
        return of_bodies(inertia)
    if not any(moment.free_symbols for moment in inertia):
        return ()
    return tuple(Need(Kind.NONNEGATIVE, sum(inertia) - 2 * moment) for moment in inertia)


@dataclass(frozen=True)
class FileClaim:
    """A claim of a file."""

    content: ClaimFile
    context: Context = field(init=False)

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """What its formulas may hold beside its parameters."""
        return ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "context", parse_context(self.content, self.variables))

    @property
    def name(self) -> str:
        """As the file has it."""
        return self.content.name

    @property
    def source(self) -> str:
        """As the file has it."""
        return self.content.source

    @property
    def unassumed(self) -> list[str]:
        """Parameters that stand in no assumption."""
        words = set(re.findall(r"\w+", " ".join(self.content.assume)))
        return [name for name in self.content.parameters if name not in words]

    def assuming(self, bound: str) -> Self:
        """The same claim with one assumption more; raises InputError where a sample breaks it."""
        return type(self)(structs.replace(self.content, assume=[*self.content.assume, bound]))

    @property
    def entry(self) -> Entry | None:
        """What the file says as an entry of the library."""
        return self.content.entry

    @property
    def kind(self) -> str:
        """motion, integral or relation."""
        return self.content.kind

    def about(self, asked: System | None) -> System:
        """The system asked for, else the file's, else `heavy_gyrostat` where it gives k, else `heavy_top`.

        Raises InputError where the file names another system, or gives another rotor than the system has.
        """
        own = None if self.content.system is None else system(self.content.system)
        if asked is not None and own is not None and asked is not own:
            raise InputError(
                f"The file is about {own.name}, but {asked.name} was asked for.", "Ask for that of the file, or none."
            )
        by_rotor = HEAVY_TOP if self.context.carried is None else HEAVY_GYROSTAT
        found = asked or own or by_rotor
        self.context.parameters(found)
        return found
