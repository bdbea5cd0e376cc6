"""A claim substituted into every equation: a verdict for each, with a proof or a witness.

``holds`` is an identity proven by exact algebra; ``refuted`` is a witness: exact parameters and a time where a ball
excludes 0; anything else is ``undecided`` with a bound at the sample points.  Balls alone never prove.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import sympy
from flint import arb

from heavytop.claims.algebra import Assumptions, Field
from heavytop.claims.evaluate import evaluate
from heavytop.claims.rational import Quotient, Unprovable
from heavytop.exact.balls import radius as radius_of
from heavytop.exact.balls import radius_text, value_text

_BITS = (192, 1024)
_LONGEST = 160


@dataclass(frozen=True, slots=True)
class Domain:
    """Where a statement is made.

    label: ``all``, ``t<=0`` or ``t>0``.  sign: the sign of the variable there, 0 for both.
    points: exact values of the variable at which balls are taken.  note: what the label means, if not time.
    """

    label: str
    sign: int
    points: tuple[Fraction, ...]
    note: str = ""


_BEFORE = (Fraction(-1, 2), Fraction(-7, 5), Fraction(-1, 9))
_AFTER = (Fraction(1, 2), Fraction(7, 5), Fraction(1, 9))
ALL = Domain("all", 0, (*_BEFORE[:2], *_AFTER[:2]))
BEFORE = Domain("t<=0", -1, _BEFORE)
AFTER = Domain("t>0", 1, _AFTER)


@dataclass(frozen=True, slots=True)
class Statement:
    """One equation, component, branch and domain; it says that ``residual`` is 0.

    text: the equation in words and signs.
    """

    equation: str
    component: int
    branch: str
    domain: Domain
    residual: sympy.Expr
    text: str


@dataclass(frozen=True, slots=True)
class Setting:
    """What the statements of a claim are about.

    variable: the symbol that moves (t, or Ω2 in the general case).
    samples: exact parameter sets.  parts: names with expressions through which a residual may be written, such as γ3.
    constants: the same for constant factors, such as k/2.  relations: what is 0 wherever the claim is made.
    """

    variable: sympy.Symbol
    positive: tuple[sympy.Symbol, ...]
    samples: tuple[Mapping[sympy.Symbol, Fraction], ...]
    greater: tuple[tuple[sympy.Symbol, sympy.Expr], ...] = ()
    parts: Mapping[str, tuple[tuple[str, sympy.Expr], ...]] = field(default_factory=dict)
    constants: tuple[tuple[str, sympy.Expr], ...] = ()
    relations: tuple[sympy.Expr, ...] = ()

    def assumptions(self, sign: int) -> Assumptions:
        """What the algebra may use on a domain where the variable has this sign."""
        return Assumptions(self.variable, self.positive, self.greater, sign, self.relations)


@dataclass(frozen=True, slots=True)
class Row:
    """The verdict on one statement.

    holds: True (proven), False (refuted by ``witness``), None (undecided).
    residual: "0", the closed form where found, else what the balls say.
    """

    equation: str
    component: int
    branch: str
    domain: str
    holds: bool | None
    residual: str
    statement: str
    witness: Mapping[str, Any] | None = None
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        """The row with the keys that scripts rely on."""
        names = ("equation", "component", "branch", "domain", "holds", "residual", "statement")
        document: dict[str, Any] = {name: getattr(self, name) for name in names}
        if self.witness is not None:
            document["witness"] = dict(self.witness)
        if self.note:
            document["where"] = self.note
        return document


def verdict_of(rows: Sequence[Row]) -> str:
    """refuted if one row is, else undecided if one is, else holds."""
    if any(row.holds is False for row in rows):
        return "refuted"
    return "undecided" if any(row.holds is None for row in rows) else "holds"


@dataclass(frozen=True, slots=True)
class Finding:
    """A step of the explanation: a statement and the verdict on it."""

    statement: str
    holds: bool | None


@dataclass(frozen=True, slots=True)
class AuditReport:
    """The audit of one claim about one system.

    why: what explains the verdict, each step checked.  solves: the systems whose equations of motion the claim
    satisfies on its smooth branch.  constants: names in the residuals with what they stand for, such as k/2.
    """

    claim: str
    system: str
    source: str
    rows: tuple[Row, ...]
    why: tuple[Finding, ...] = ()
    solves: tuple[str, ...] = ()
    constants: tuple[tuple[str, str], ...] = ()

    @property
    def verdict(self) -> str:
        """``holds``, ``refuted`` or ``undecided``."""
        return verdict_of(self.rows)

    @property
    def exit_code(self) -> int:
        """0 if every equation holds, 1 if one is refuted, 3 if none is but one is undecided."""
        return {"holds": 0, "refuted": 1, "undecided": 3}[self.verdict]

    def to_json(self) -> dict[str, Any]:
        """The document of ``heavytop audit --json``."""
        return {
            "claim": self.claim,
            "system": self.system,
            "verdict": self.verdict,
            "source": self.source,
            "solves": list(self.solves),
            "constants": dict(self.constants),
            "why": [{"statement": finding.statement, "holds": finding.holds} for finding in self.why],
            "equations": [row.to_json() for row in self.rows],
        }


def judge(statements: Sequence[Statement], setting: Setting) -> tuple[Row, ...]:
    """The verdict on each statement, in their order."""
    fields = _Fields(statements, setting)
    return tuple(_judge_one(statement, setting, fields) for statement in statements)


class _Fields:
    """One field for each (domain, branch): its expressions share their exponentials."""

    def __init__(self, statements: Sequence[Statement], setting: Setting) -> None:
        self._statements = statements
        self._setting = setting
        self._fields: dict[tuple[int, str, str], Field | None] = {}

    def of(self, statement: Statement, sign: int) -> Field | None:
        """The field for this statement with this sign of the variable; None where the algebra cannot carry it."""
        key = (sign, statement.branch, statement.domain.label)
        if key not in self._fields:
            alike = [
                other.residual
                for other in self._statements
                if (other.branch, other.domain.label) == (statement.branch, statement.domain.label)
            ]
            parts = [part for _, part in self._setting.parts.get(statement.branch, ())]
            self._fields[key] = self._make(sign, [*alike, *parts])
        found = self._fields[key]
        return found if found is not None else self._make(sign, [statement.residual])

    def _make(self, sign: int, expressions: list[sympy.Expr]) -> Field | None:
        try:
            return Field(self._setting.assumptions(sign), expressions)
        except Unprovable:
            return None


def _judge_one(statement: Statement, setting: Setting, fields: _Fields) -> Row:
    witness = next(_witnesses(statement, setting), None)
    if witness is not None:
        found = fields.of(statement, statement.domain.sign)
        closed = None if found is None else _closed_form(statement, setting, found)
        return _row(statement, False, closed or f"{witness['value']} at the witness", witness)
    if _proven(statement, fields):
        return _row(statement, True, "0")
    return _row(statement, None, f"|residual| < {_bound(statement, setting)} at the sample points")


def _row(statement: Statement, holds: bool | None, residual: str, witness: Mapping[str, Any] | None = None) -> Row:
    s = statement
    return Row(s.equation, s.component, s.branch, s.domain.label, holds, residual, s.text, witness, s.domain.note)


def _proven(statement: Statement, fields: _Fields) -> bool:
    """By one field, or for ``all`` by one for either sign of the variable: together they cover it by continuity."""
    field_ = fields.of(statement, statement.domain.sign)
    if field_ is not None and field_.is_zero(statement.residual):
        return True
    if statement.domain.sign or statement.domain.note:
        return False
    halves = [fields.of(statement, sign) for sign in (-1, 1)]
    return all(half is not None and half.is_zero(statement.residual) for half in halves)


def _places(statement: Statement, setting: Setting) -> Iterator[dict[sympy.Symbol, Fraction]]:
    for sample in setting.samples:
        for point in statement.domain.points:
            yield {setting.variable: point, **sample}


def _witnesses(statement: Statement, setting: Setting) -> Iterator[dict[str, Any]]:
    """Exact parameters and times where a ball of the residual excludes 0."""
    for bits in _BITS:
        for values in _places(statement, setting):
            ball = _ball(statement.residual, values, bits)
            if ball is not None and not ball.contains(0):
                value, radius = value_text(ball, 20)
                place = {str(symbol): str(number) for symbol, number in values.items()}
                time = place.pop(str(setting.variable))
                yield {"parameters": place, str(setting.variable): time, "value": value, "radius": radius}


def _ball(residual: sympy.Expr, values: Mapping[sympy.Symbol, Fraction], bits: int) -> arb | None:
    """The residual at one place; None where it is undefined there."""
    try:
        ball = evaluate(residual, values, bits)
    except Unprovable:
        return None
    return ball if ball.is_finite() else None


def _bound(statement: Statement, setting: Setting) -> str:
    balls = [_ball(statement.residual, values, _BITS[-1]) for values in _places(statement, setting)]
    bounds = [abs(ball).upper() for ball in balls if ball is not None]
    if len(bounds) < len(balls) or not bounds:
        return "infinity (undefined at a sample point)"
    return radius_text(max(radius_of(arb(0, bound)) for bound in bounds))


def _closed_form(statement: Statement, setting: Setting, field_: Field) -> str | None:
    """The residual as (constant) · (part), such as -(k/2)·gamma3; else as it stands, if it is short."""
    try:
        residual = field_.enter(statement.residual)
        for name, part in (("", sympy.Integer(1)), *setting.parts.get(statement.branch, ())):
            value = field_.enter(part)
            factor = field_.tower.divide(residual, value) if value.numerator else None
            if factor is not None and field_.is_constant(factor):
                return _product_text(_constant_text(factor, setting, field_), name)
        text = str(field_.expression(residual))
    except Unprovable:
        return None
    return text if len(text) <= _LONGEST else None


def _constant_text(factor: Quotient, setting: Setting, field_: Field) -> str:
    tower = field_.tower
    for name, constant in setting.constants:
        ratio = tower.divide(factor, field_.enter(constant))
        for number, sign in ((1, ""), (-1, "-")):
            if ratio == tower.number(number):
                return f"{sign}({name})"
    return str(field_.expression(factor))


def _product_text(factor: str, name: str) -> str:
    simple = factor.startswith(("(", "-(")) and factor.endswith(")") and factor.count("(") == 1
    if not name:
        return factor.replace("(", "", 1)[:-1] if simple else factor
    if factor in ("1", "-1"):
        return factor.removesuffix("1") + name
    return f"{factor}*{name}" if simple or re.fullmatch(r"-?\d+(/\d+)?", factor) else f"({factor})*{name}"
