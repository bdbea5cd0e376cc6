"""Verdicts on the statements of a claim, each with a proof or a witness.

``holds`` is an identity proven by exact algebra with every condition of the proof discharged; ``refuted`` is a
witness: exact parameters and a time in the domain, on all relations, where every formula is defined and real and a
ball excludes 0; other statements are ``undecided``, with a bound at the sample points.  Balls alone prove nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import msgspec
import sympy
from flint import arb

from heavytop.display import Tabular, TitledTable, printable
from heavytop.errors import ExitCode
from heavytop.exact.flint.balls import radius as radius_of
from heavytop.exact.flint.balls import radius_text, value_text
from heavytop.features.claims.algebra.conditions import conditions_of, is_exactly_zero, written
from heavytop.features.claims.algebra.evaluate import evaluate
from heavytop.features.claims.algebra.fields import Field
from heavytop.features.claims.algebra.prover import Condition, Prover
from heavytop.features.claims.algebra.ring import Quotient, where_provable
from heavytop.features.claims.algebra.statement import Formulas, Setting, Statement
from heavytop.features.claims.library.entry import Entry

VERDICTS = {True: "holds", False: "refuted", None: "undecided"}
ABOUT = {
    "motion": "a motion",
    "component": "a component of a motion",
    "integral": "a first integral",
    "relation": "an invariant relation",
    "stability": "the stability of a steady motion",
    "value": "numbers of a motion",
}
"""The subject of each kind of claim."""
_BITS = (192, 1024)
_MOST_BITS = 300_000
"""The largest exponent of 2 of a residual written as exact text: that of decimal text ends at 10^100000."""
_LONGEST = 160
_ORDERS, _MOST_OPERATIONS = 4, 4_000
"""The derivatives of a residual tried for a witness, and the largest number of operations of one to derive."""


@dataclass(frozen=True, slots=True)
class StatementVerdict:
    """The verdict on one statement.

    holds: True (proven), False (refuted by ``witness``), None (undecided).
    residual: "0", a closed form, or a bound by balls.
    conditions: of the proof; the row is undecided if one is not discharged.
    figures: of a published number, the printed text, the number of its correct digits, the proven value.
    error, reason: of a published number, by how much it is off, and why it is undecided.
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
    conditions: tuple[Condition, ...] = ()
    figures: Mapping[str, Any] | None = None
    error: str = ""
    reason: str = ""

    def to_json(self) -> dict[str, Any]:
        """The row with the keys that scripts rely on."""
        names = ("equation", "component", "branch", "domain", "holds", "residual", "statement")
        document: dict[str, Any] = {name: getattr(self, name) for name in names}
        if self.witness is not None:
            document["witness"] = dict(self.witness)
        if self.note:
            document["where"] = self.note
        document |= self.figures or {}
        document["conditions"] = [
            {"text": c.text, "discharged": c.discharged, "reason": c.reason} for c in self.conditions
        ]
        return document


def verdict_of(rows: Sequence[StatementVerdict]) -> str:
    """``refuted`` if one row is, else ``undecided`` if one is, else ``holds``."""
    if any(row.holds is False for row in rows):
        return "refuted"
    return "undecided" if any(row.holds is None for row in rows) else "holds"


@dataclass(frozen=True, slots=True)
class ExplanationStep:
    """A step of the explanation: a statement and the verdict on it."""

    statement: str
    holds: bool | None


@dataclass(frozen=True, slots=True, repr=False)
class Audit(Tabular):
    """The audit of one claim about one system.

    why: the explanation of the verdict, each step checked.  solves: the systems whose equations of motion the claim
    satisfies on its smooth branch, or under which the integral or relation is invariant.  kind: a key of ``ABOUT``.
    constants: names in the residuals with their meanings, such as k/2.  entry: of the library, where it is one.
    deciding: of an undecided claim, assumptions each of which decides it, with the verdict then.
    unused: parameters of a file that no formula uses.  where: formulas that are 0 where an integral is claimed.
    """

    claim: str
    system: str
    source: str
    rows: tuple[StatementVerdict, ...]
    why: tuple[ExplanationStep, ...] = ()
    solves: tuple[str, ...] = ()
    constants: tuple[tuple[str, str], ...] = ()
    kind: str = "motion"
    entry: Entry | None = None
    deciding: tuple[tuple[str, str], ...] = ()
    unused: tuple[str, ...] = ()
    where: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """``holds``, ``refuted`` or ``undecided``."""
        return verdict_of(self.rows)

    @property
    def exit_code(self) -> ExitCode:
        """0 if every equation holds, 1 if one is refuted, 3 if none is but one is undecided."""
        return {"holds": ExitCode.GOOD, "refuted": ExitCode.FINDING, "undecided": ExitCode.INCOMPLETE}[self.verdict]

    def to_json(self) -> dict[str, Any]:
        """The document of ``heavytop audit --json``."""
        document = {
            "claim": self.claim,
            "system": self.system,
            "kind": self.kind,
            "verdict": self.verdict,
            "source": self.source,
            "solves": list(self.solves),
            "constants": dict(self.constants),
            "why": [msgspec.to_builtins(step) for step in self.why],
            "equations": [row.to_json() for row in self.rows],
        }
        if self.entry is not None:
            document["entry"] = msgspec.to_builtins(self.entry)
        document |= {name: list(texts) for name, texts in (("unused", self.unused), ("where", self.where)) if texts}
        return document | ({"would_decide": dict(self.deciding)} if self.deciding else {})

    def _table(self) -> TitledTable:
        lines = [(r.equation, str(r.component or ""), r.branch, r.domain, VERDICTS[r.holds]) for r in self.rows]
        title = f"{printable(self.claim)} as {ABOUT[self.kind]} of {self.system}: {self.verdict}"
        return TitledTable(title, ("equation", "component", "branch", "domain", "verdict"), lines)


Progress = Callable[[int, int], None]
"""A function of (statements judged, of how many)."""


def silent(_done: int, _of: int) -> None:
    """No report of progress."""


def judge(
    statements: Sequence[Statement], setting: Setting, progress: Progress = silent
) -> tuple[StatementVerdict, ...]:
    """The verdict on each statement, in their order."""
    statements = [
        # an identity without a motion rests on the needs of its own terms
        s if s.formulas != Formulas() else replace(s, formulas=Formulas(needs=conditions_of([s.residual])))
        for s in statements
    ]
    prover, solved = Prover(statements, setting), setting.with_solutions()
    second = Prover(statements, solved) if setting.solutions else None
    rows = []
    for statement in statements:
        row = _judge_one(statement, setting, prover)
        if row.holds is None and second is not None:
            # with a relation solved for a parameter more is seen, if not always
            with_solutions = _judge_one(statement, solved, second)
            row = min(row, with_solutions, key=lambda r: (r.holds is None, sum(not c.discharged for c in r.conditions)))
        rows.append(row)
        progress(len(rows), len(statements))
    return tuple(rows)


def _judge_one(statement: Statement, setting: Setting, prover: Prover) -> StatementVerdict:
    proven, conditions = prover.prove(statement)
    certain = proven and all(condition.discharged for condition in conditions)
    witness = next(_witnesses(statement, setting, prover, _BITS[:1] if certain else _BITS), None)
    if witness is not None:
        proof = prover.field(statement, statement.domain.sign, strict=bool(statement.domain.sign))
        closed = None if proof is None else _closed_form(statement, setting, proof)
        return _row(statement, False, closed or f"{witness['value']} at the witness", conditions, witness)
    flow = statement.flow
    kept = () if flow is None else (*flow.kept, *((("F", statement.residual),) if flow.is_relation else ()))
    for order, derivative in enumerate(("the rate", "the second derivative")):
        for text, rate in kept:
            residual = rate if not order or flow is None else flow.rate(rate)
            witness = next(_witnesses(replace(statement, residual=residual), setting, prover), None)
            if witness is not None:
                left = f"the flow leaves {text} = 0, at {derivative} {witness['value']} at the witness"
                return _row(statement, False, left, conditions, witness)
    if certain:
        return _row(statement, True, "0", conditions)
    residual = statement.residual
    for order in range(1, _ORDERS + 1):
        if flow is None or sympy.count_ops(residual) > _MOST_OPERATIONS:
            break
        residual = flow.rate(residual)
        witness = next(_witnesses(replace(statement, residual=residual), setting, prover), None)
        if witness is not None:
            left = f"0 at the witness, its derivative of order {order} {witness['value']}"
            return _row(statement, False, left, conditions, witness)
    is_empty = not prover.sample_points(statement)
    bound = "0 if the conditions hold" if proven and not is_empty else _bound(statement, prover)
    if not proven:
        conditions = (*conditions, Condition("the residual is 0", False, "not shown, and no sample tried refutes it"))
    return _row(statement, None, bound, conditions)


def _row(
    s: Statement,
    holds: bool | None,
    residual: str,
    conditions: tuple[Condition, ...],
    witness: Mapping[str, Any] | None = None,
) -> StatementVerdict:
    name, note = s.domain.label, s.domain.note
    readable = tuple(replace(c, text=written(c.text), reason=written(c.reason)) for c in conditions)
    return StatementVerdict(
        s.equation, s.component, s.branch, name, holds, written(residual), s.text, witness, note, readable
    )


def _witnesses(
    statement: Statement, setting: Setting, prover: Prover, precisions: Sequence[int] = _BITS
) -> Iterator[dict[str, Any]]:
    """Exact parameters and times in the domain, on all relations, where a ball of the residual excludes 0."""
    always = () if statement.flow is None else statement.flow.always
    sample_points = [v for v in prover.sample_points(statement) if all(is_exactly_zero(zero, v) for zero in always)]
    for bits in precisions:
        for values in sample_points:
            ball = _ball(statement.residual, values, bits)
            if ball is not None and not ball.contains(0) and prover.is_defined(statement, values):
                value, radius = _texts(ball)
                point = {str(symbol): str(number) for symbol, number in values.items()}
                time = point.pop(str(setting.variable))
                moving = {} if statement.flow is not None else {str(setting.variable): time}
                yield {"parameters": point, **moving, "value": value, "radius": radius}


def _texts(ball: arb) -> tuple[str, str]:
    """(value, radius) to 20 digits, for any exponent: balls such as exp(-10^9) are not made exact numbers."""
    if max(abs(_power_of_2(part)) for part in (ball.mid(), ball.rad())) < _MOST_BITS:
        return value_text(ball, 20)
    value, _, radius = ball.str(20).strip("[]").partition(" +/- ")
    return value, radius or "0"


def _power_of_2(number: arb) -> int:
    """The exponent of an exact number; 0 for 0."""
    mantissa, exponent = number.man_exp()
    return int(exponent) + int(mantissa).bit_length() if mantissa else 0


@where_provable(None)
def _ball(residual: sympy.Expr, values: Mapping[sympy.Symbol, Fraction], bits: int) -> arb | None:
    """The residual at one point; None where it is undefined."""
    ball = evaluate(residual, values, bits)
    return ball if ball.is_finite() else None


def _bound(statement: Statement, prover: Prover) -> str:
    if not (sample_points := prover.sample_points(statement)):
        return "no sample lies there"
    sample_points = [point for point in sample_points if prover.is_defined(statement, point)]
    balls = [_ball(statement.residual, values, _BITS[-1]) for values in sample_points]
    bounds = [abs(ball).upper() for ball in balls if ball is not None]
    if not bounds:
        return "undefined at every sample point"
    largest = max(bounds)
    if largest == 0:
        return "0 at the sample points"
    if _power_of_2(largest) > _MOST_BITS:
        return f"|residual| < 2^{_power_of_2(largest)} at the sample points"
    largest = max(largest, arb((1, -_MOST_BITS)))
    return f"|residual| < {radius_text(radius_of(arb(0, largest)))} at the sample points"


@where_provable(None)
def _closed_form(statement: Statement, setting: Setting, field_: Field) -> str | None:
    """The residual as (constant) · (part), such as -(k/2)·gamma3, else as an expression, if it is short."""
    residual = field_.enter(statement.residual)
    for name, part in (("", sympy.Integer(1)), *setting.parts.get(statement.branch, ())):
        value = field_.enter(part)
        factor = residual / value if value.numerator else None
        if factor is not None and field_.is_constant(factor):
            return _product_text(_constant_text(factor, setting, field_), name)
    text = str(field_.expression(residual))
    return text if len(text) <= _LONGEST else None


def _constant_text(factor: Quotient, setting: Setting, field_: Field) -> str:
    tower = field_.tower
    for name, constant in setting.constants:
        ratio = factor / field_.enter(constant)
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
