"""Claims of kind `value`: published numbers of a state, against balls that are proven to contain the true numbers.

A number is right where the ball lies within the source's tolerance of it, or within half a unit of its last digit;
wrong where the ball lies outside; and undecided otherwise.  The balls are those of closed forms and validated
enclosures (:mod:`heavytop.exact.bodies`), made narrower until they decide.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
from flint import arb

from heavytop.errors import InputError, OutOfReach, prefixed, quoted, refusal
from heavytop.exact.flint.balls import (
    FUNCTIONS,
    ball,
    midpoint,
    radius,
    radius_text,
    require_handy,
    whole_evaluation,
    working_precision,
)
from heavytop.features.claims.audit.context import Tensor, Text, Three, of_file
from heavytop.features.claims.audit.judge import Audit, Progress, StatementVerdict, silent
from heavytop.features.claims.library.entry import Entry
from heavytop.precision import decimal_text, dot, exact, round_to
from heavytop.top.attitude import Output, rotated, transposed
from heavytop.top.bodies import Body, motion_of
from heavytop.top.equations import (
    HEAVY_GYROSTAT,
    HEAVY_TOP,
    Integral,
    Parameters,
    System,
    holding,
    require_no_other_rotor,
)
from heavytop.top.heavy_top import HeavyTop, State

if TYPE_CHECKING:
    from heavytop.exact.bodies import BodyMotion


# A number as it is printed: its value, the unit of its last digit, and the number of its correct digits.


_DECIMAL = re.compile(r"[+-]?(?P<integer>[0-9]*)(?:\.(?P<part>[0-9]*))?(?:[eEdD](?P<power>[+-]?[0-9]{1,5}))?")
_MINUS = "\N{MINUS SIGN}"
_MOST_DIGITS = 1_000
_LARGEST_POWER = 9_000
_REMEDY = "Write it as it is printed, as text: a decimal such as 0.450, -1.5e-3 or 12; its zeros at the end count."


@dataclass(frozen=True, slots=True)
class PrintedNumber:
    """A decimal number with its printed digits; zeros at the end count, those at the front do not.

    text: as it is printed.  unit: of the last digit.  digits: from the first that is not 0; of 0.000 all of them.
    """

    text: str
    value: Fraction
    unit: Fraction
    digits: int

    @classmethod
    def read(cls, text: str, what: str) -> PrintedNumber:
        """Raises InputError for an invalid decimal number, and for one of more than 1000 digits or beyond 1e±9000."""
        plain = text.strip().replace(_MINUS, "-")
        match = _DECIMAL.fullmatch(plain)
        integer, part = (match["integer"], match["part"] or "") if match is not None else ("", "")
        if match is None or not integer + part:
            raise refusal(what, "a decimal number", quoted(text), _REMEDY)
        power = int(match["power"] or 0)
        if len(integer + part) > _MOST_DIGITS or abs(power) > _LARGEST_POWER:
            raise InputError(
                f"{what}: {quoted(text)} is too long a number.",
                f"Give at most {_MOST_DIGITS} digits, and exponents up to {_LARGEST_POWER}.",
            )
        unit = Fraction(10) ** (power - len(part))
        size = int(integer + part)
        digits = len(str(size)) if size else len(part) + 1
        return cls(text.strip(), (-size if plain.startswith("-") else size) * unit, unit, digits)

    def right(self, error: Fraction) -> int:
        """The number of correct digits for an error ≥ 0: the most of which the last is right to half a unit."""
        limit, count = self.half_unit, self.digits
        while count and error > limit:
            count, limit = count - 1, limit * 10
        return count

    @property
    def half_unit(self) -> Fraction:
        """Half a unit of the last digit: the rounding error of a printed number."""
        return self.unit / 2


SIZES = {"omega": 3, "gamma": 3, "omega_space": 3, "quaternion": 4, "position": 3}
"""Components of each quantity; a first integral has one."""
_FIRST_BITS, _FEWEST_BITS, _MOST_BITS = 64, 20, 66_500
"""Absolute bits of the balls: the first trial, a second one where that is out of reach, and the most."""
_SPARE_BITS = 24
_DOUBLINGS = 3
_MORE_DIGITS, _WITNESS_DIGITS = 5, 20
"""Digits of the proven value beyond those printed, and of the difference."""
_INVARIANT = ("gamma_squared", "area", "energy", "momentum_squared")
"""First integrals that are the same in any axes."""


class PrincipalTopTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[top]: in principal axes."""

    inertia: Three
    weight: Text
    centre: Three
    rotor: Text | Three | None = None


class BodyTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[body]: in any axes; the tensor as 3, 6 or 9 numbers, or three rows."""

    mass: Text
    gravity: Text
    centre: Three
    inertia: Tensor
    about: str | None = None
    rotor: Three | None = None


class StartTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[start]: Ω in body or space axes, and γ or an attitude; normalize: for rounded components."""

    omega: Three | None = None
    omega_space: Three | None = None
    gamma: Three | None = None
    quaternion: list[Text] | None = None
    matrix: Tensor | None = None
    euler: Text | None = None
    axis_angle: Text | None = None
    normalize: bool = False


class ValueTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[[value]]: one number.  component: 1, 2, 3, of a quaternion w, x, y, z 1 to 4, of a first integral none or 1."""

    time: Text
    quantity: Text
    number: Text
    component: Annotated[int, msgspec.Meta(ge=1, le=4)] | None = None
    tolerance: Text | None = None


class ValueFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file."""

    name: Annotated[str, msgspec.Meta(max_length=80)]
    kind: Literal["value"]
    start: StartTable
    value: Annotated[list[ValueTable], msgspec.Meta(min_length=1, max_length=2_000)]
    top: PrincipalTopTable | None = None
    body: BodyTable | None = None
    system: str | None = None
    source: Annotated[str, msgspec.Meta(max_length=2_000)] = ""


@dataclass(frozen=True, slots=True)
class Figure:
    """One published number.

    time_text: as in the file.  tolerance: that of the source; None for half a unit of the last digit.
    place: its name in error texts, by its index in the file.
    """

    time: Fraction
    time_text: str
    quantity: str
    component: int
    number: PrintedNumber
    tolerance: Fraction | None
    tolerance_text: str = ""
    place: str = ""

    @property
    def allowed(self) -> Fraction:
        """The largest error of a right number."""
        return self.number.half_unit if self.tolerance is None else self.tolerance

    @property
    def bits(self) -> int:
        """Absolute bits of a ball that usually decides it."""
        limit = min(self.number.half_unit, self.allowed or self.number.half_unit)
        return max(0, limit.denominator.bit_length() - limit.numerator.bit_length()) + _SPARE_BITS


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict of a ball on a number.

    holds: None where the ball is too wide.  right: the number of proven correct digits.  decided: whether a narrower
    ball would give the same.  middle, radius: of the ball.  error: of the number, as an interval.
    """

    holds: bool | None
    right: int
    decided: bool
    middle: Fraction
    radius: Fraction
    error: tuple[Fraction, Fraction]


def judge_figure(figure: Figure, known: Fraction | arb) -> Judgement:
    """The verdict on a number whose true value is ``known``, exactly or as a ball."""
    middle, r = (known, Fraction(0)) if isinstance(known, Fraction) else (midpoint(known), radius(known))
    distance = abs(figure.number.value - middle)
    low, high = max(Fraction(0), distance - r), distance + r
    holds = True if high <= figure.allowed else False if low > figure.allowed else None
    fewest, most = figure.number.right(high), figure.number.right(low)
    return Judgement(holds, fewest, holds is not None and fewest == most, middle, r, (low, high))


class ValueClaim:
    """Published numbers of one motion."""

    def __init__(self, content: ValueFile, entry: Entry | None = None) -> None:
        self.content, self.entry = content, entry
        self.figures = tuple(_figures(content.value))
        self.motion = _read_motion(content)

    def about(self, requested: System | None) -> System:
        """The system requested, else the file's, else `heavy_gyrostat` where there is a rotor, else `heavy_top`.

        Raises InputError where the file names another system, or the system does not admit the body.
        """
        default = HEAVY_TOP if self.motion[0].rotor is None else HEAVY_GYROSTAT
        about = of_file(requested, self.content.system, default)
        require_no_other_rotor(about, self.motion[0])
        return about

    def audit(self, about: System, _progress: Progress = silent) -> Audit:
        """The audit as a claim about a system."""
        content = self.content
        return Audit(content.name, about.name, content.source, self.rows(about), kind=content.kind, entry=self.entry)

    def rows(self, about: System) -> tuple[StatementVerdict, ...]:
        """A verdict on each number, in the order of the file; raises InputError for an unknown quantity."""
        motion = _KnownNumbers(*self.motion, about)
        motion.require(self.figures)
        try:
            motion.require_handy(self.figures)
        except OutOfReach as error:
            return tuple(_row(figure, None, "not known", f"{error.cause} {error.remedy}") for figure in self.figures)
        verdicts: dict[Figure, StatementVerdict] = {}
        groups: dict[tuple[Fraction, str], list[Figure]] = {}
        for figure in self.figures:
            groups.setdefault((figure.time, figure.quantity), []).append(figure)
        for group in groups.values():
            verdicts |= zip(group, _rows_of(group, motion), strict=True)
        return tuple(verdicts[figure] for figure in self.figures)


def _figures(tables: Sequence[ValueTable]) -> Iterator[Figure]:
    """The numbers of a file; raises InputError for an invalid or repeated one."""
    indices: dict[tuple[Fraction, str, int], int] = {}
    for index, table in enumerate(tables, 1):
        place = f"value {index}"
        time = _number(table.time, f"{place}: time")
        size = SIZES.get(table.quantity, 1)
        component = table.component or 1
        if component > size or (table.component is None and size > 1):
            lacks = "of a component that is not named" if table.component is None else f"has no component {component}"
            raise InputError(f"{place}: {table.quantity[:40]} {lacks}.", f"Its components are 1 to {size}.")
        subject = time, table.quantity, component
        if indices.setdefault(subject, index) != index:
            repeated = f"{table.quantity[:40]} {component} at t = {table.time[:40]} is in value {indices[subject]}"
            raise InputError(f"{place}: {repeated} already.", "Give each number once.")
        tolerance = None if table.tolerance is None else _number(table.tolerance, f"{place}: tolerance")
        if tolerance is not None and tolerance < 0:
            cause = f"{place}: tolerance must not be negative; got {quoted(str(table.tolerance))[1:-1]}."
            raise InputError(cause, "Give it as 1e-10, or not at all.")
        number = PrintedNumber.read(table.number, f"{place}: number")
        tolerance_text = (table.tolerance or "").strip()
        yield Figure(time, table.time.strip(), *subject[1:], number, tolerance, tolerance_text, place)


def _number(text: str, what: str) -> Fraction:
    with prefixed(what):
        return exact(text)


def _read_motion(content: ValueFile) -> tuple[HeavyTop | Body, State]:
    """The body and its start; raises InputError for an invalid one."""
    if (content.top is None) == (content.body is None):
        raise InputError(
            "A claim of kind value needs one of [top] and [body].",
            "Give [top] with inertia, weight and centre, or [body] with mass, gravity, centre, inertia and about.",
        )
    if content.top is not None and isinstance(content.top.rotor, str):
        raise InputError(
            "top.rotor is one number.",
            "Give [k1, k2, k3] for heavy_gyrostat; the rotor of gyrostat follows from the start, P b/(M.gamma).",
        )
    values = msgspec.to_builtins(content.top or content.body) | msgspec.to_builtins(content.start)
    normalize = values.pop("normalize")
    with prefixed("top, body or start"):
        body, start = motion_of(values, normalize)
    if start.attitude is None:
        start.require_unit_gamma(remedy="Give exact numbers such as 3/5, 0, 4/5, or normalize = true in [start].")
    return body, start


def _rows_of(group: Sequence[Figure], motion: _KnownNumbers) -> list[StatementVerdict]:
    """The rows of the numbers of one quantity at one time, each judged by the narrowest ball."""
    judged: list[Judgement] | None = None
    missing = "the balls that can be proven do not decide whether that is within what is allowed"
    needed = min(_MOST_BITS, max(_FIRST_BITS, *(figure.bits for figure in group)))
    trials = [_FIRST_BITS, *(min(_MOST_BITS, needed << doubling) for doubling in range(_DOUBLINGS + 1))]
    while trials and not (judged and all(judgement.decided for judgement in judged)):
        bits = trials.pop(0)
        try:
            judged = _judged(group, motion.at(group[0].time, group[0].quantity, bits))
        except OutOfReach as error:
            missing = f"{error.cause} {error.remedy}".strip()
            trials = [_FEWEST_BITS] if bits == _FIRST_BITS else []
    judgements: Sequence[Judgement | None] = judged or [None] * len(group)
    pairs = zip(group, judgements, strict=True)
    return [_row(figure, judgement, motion.method, missing) for figure, judgement in pairs]


def _judged(group: Sequence[Figure], known: Sequence[Fraction | arb]) -> list[Judgement]:
    """The verdicts of balls; of a quaternion with the sign of the numbers, as q and -q are one attitude."""
    judged = [judge_figure(figure, known[figure.component - 1]) for figure in group]
    if group[0].quantity != "quaternion":
        return judged
    opposite = [-value if isinstance(value, Fraction) else value.neg(exact=True) for value in known]
    of_opposite = [judge_figure(figure, opposite[figure.component - 1]) for figure in group]

    def rank(judged: Sequence[Judgement]) -> tuple[int, Fraction]:
        verdicts = [judgement.holds for judgement in judged]
        worst = 2 if False in verdicts else 1 if None in verdicts else 0
        return worst, sum((judgement.error[1] ** 2 for judgement in judged), Fraction(0))

    return min(judged, of_opposite, key=rank)


def _row(figure: Figure, judged: Judgement | None, method: str, missing: str) -> StatementVerdict:
    """The row of a number; missing: why there is no ball, or no narrower one."""
    name = figure.quantity if figure.quantity not in SIZES else f"{figure.quantity} {figure.component}"
    allowed = "half a unit of the last digit" if figure.tolerance is None else figure.tolerance_text
    figures: dict[str, Any] = {"printed": figure.number.text}
    figures |= {} if figure.tolerance is None else {"tolerance": figure.tolerance_text}
    figures["digits_printed"] = figure.number.digits
    error, reason, witness = "", missing if judged is None or judged.holds is None else "", None
    if judged is not None:
        value, r = _texts(judged.middle, judged.radius, figure.number.digits + _MORE_DIGITS)
        figures |= {"digits_right": judged.right, "proven": {"value": value, "radius": r}}
        error = _error_text(judged)
    if judged is not None and judged.holds is False:
        value, r = _texts(figure.number.value - judged.middle, judged.radius, _WITNESS_DIGITS)
        witness = {"parameters": {}, "t": figure.time_text, "value": value, "radius": r}
    return StatementVerdict(
        figure.quantity,
        figure.component,
        "printed",
        f"t={figure.time_text}",
        None if judged is None else judged.holds,
        "; ".join(filter(None, (error and f"off by {error}", reason))),
        f"{name} = {figure.number.text} within {allowed} at t = {figure.time_text}",
        witness,
        note=method,
        figures=figures,
        error=error,
        reason=reason,
    )


def _texts(middle: Fraction, r: Fraction, digits: int) -> tuple[str, str]:
    """(value, radius) of a ball as decimal text: the radius includes the rounding of the value."""
    text = decimal_text(middle, digits)
    return text, radius_text(r + abs(Fraction(text) - middle))


def _error_text(judged: Judgement) -> str:
    low, high = (decimal_text(round_to(part, 64), 3) if part else "0" for part in judged.error)
    if low == high:
        return high
    most = radius_text(judged.error[1])
    return f"less than {most}" if low == "0" else f"{low} to {most}"


class _KnownNumbers:
    """The true numbers of a motion, as fractions where they are known to be rational, else as balls."""

    def __init__(self, body: HeavyTop | Body, start: State, system: System) -> None:
        from heavytop.exact.bodies import BodyMotion

        self.body, self.start, self.system = body, start, system
        self.motion: BodyMotion = BodyMotion(body, start, system)
        self._exact = self.motion.resolved.uncertainty is None
        system.parameters(self.motion.resolved.top, self.motion.resolved.start)

    @cached_property
    def method(self) -> str:
        """The method by which the motion is known."""
        try:
            return self.motion.method
        except OutOfReach as error:
            return error.cause

    def require_handy(self, figures: Sequence[Figure]) -> None:
        """Raises OutOfReach for fractions whose exact arithmetic takes too long."""
        resolved = self.motion.resolved
        require_handy(resolved.top, resolved.start, [figure.time for figure in figures])

    def require(self, figures: Sequence[Figure]) -> None:
        """Raises InputError for an unknown quantity, and for one that γ alone does not determine."""
        for figure in figures:
            place = f"{figure.place} (component {figure.component}, t = {figure.time_text[:40]})"
            if figure.quantity not in SIZES and figure.quantity not in self._integrals:
                known = ", ".join((*SIZES, *self._integrals))
                raise refusal(f"{place}: quantity", "one of this motion", quoted(figure.quantity), f"Use {known}.")
            is_fixed = figure.quantity in ("omega", "gamma", *self._integrals)
            is_fixed |= figure.quantity == "position" and figure.component == 3
            if not is_fixed and self.start.attitude is None:
                raise InputError(
                    f"{place}: gamma does not fix {figure.quantity} {figure.component}.",
                    "Give the attitude of the start: quaternion, matrix, euler or axis_angle in place of gamma.",
                )

    @cached_property
    def _integrals(self) -> dict[str, Integral]:
        """The first integrals that are constant along the motion, by name."""
        resolved = self.motion.resolved
        integrals = holding(resolved.top, resolved.start, self.system)
        return {integral.name: integral for integral in integrals if self._exact or integral.name in _INVARIANT}

    @whole_evaluation
    def at(self, time: Fraction, quantity: str, bits: int) -> Sequence[Fraction | arb]:
        """The components of a quantity, of ``bits`` bits: relative above 1, absolute below.

        Raises OutOfReach where they cannot be proven.
        """
        if quantity in self._integrals:
            return [self._integral(self._integrals[quantity], bits)]
        if quantity in ("omega", "gamma"):
            if time == 0 and self._exact:
                return self.start.omega if quantity == "omega" else self.start.gamma
            state = self.motion.state(time, bits)
            return state[:3] if quantity == "omega" else state[3:6]
        if self.start.attitude is None:  # a position of which the third component is known
            state = self.motion.state(time, bits)
            with working_precision(bits + _SPARE_BITS):
                return [arb("nan"), arb("nan"), dot([*map(ball, self.body.centre)], state[3:6])]
        output, motion = Output(quantity.replace("_", "-")), self.motion.with_attitude(time, bits)
        with working_precision(bits + _SPARE_BITS):
            components = list(output.at(motion[:3], motion[3:6], motion[6:], self.body.centre, FUNCTIONS, ball))
        if not all(value.is_finite() for value in components):
            raise OutOfReach(f"The {output.name} is not known to {bits} bits.")
        return components

    def _integral(self, integral: Integral, bits: int) -> Fraction | arb:
        """A first integral at the start: exactly, or as a ball for an irrational attitude."""
        resolved, body, start = self.motion.resolved, self.body, self.start
        if self._exact:
            p = self.system.parameters(resolved.top, resolved.start)
            return exact(integral.value(p, resolved.start.flat))
        tensor = body.inertia if isinstance(body, HeavyTop) else body.tensor
        p = Parameters(tensor, body.moment, body.rotor or (Fraction(0),) * 3)
        if start.attitude is None or start.attitude.exact_rows() is not None:
            return exact(integral.value(p, start.flat))
        with working_precision(bits + 4 * _SPARE_BITS):
            rows = start.attitude.rows(FUNCTIONS, ball)
            omega = _balls(start.omega)
            if start.omega_space is not None:
                omega = rotated(transposed(rows), _balls(start.omega_space))
            return arb(integral.value(type(p)(*map(_balls, p)), (*omega, *rows[2])))


def _balls(values: Any) -> Any:
    """Exact rationals, in tuples of any depth, as balls."""
    return tuple(map(_balls, values)) if isinstance(values, tuple) else ball(values)
