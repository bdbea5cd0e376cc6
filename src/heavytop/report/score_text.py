"""How good one trajectory is, for people: the answer in its first lines."""

from __future__ import annotations

import math
from dataclasses import asdict
from fractions import Fraction
from typing import Any

import msgspec
from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.measure.digits import digits_kept, digits_of, digits_right, digits_text
from heavytop.measure.drift import DRIFT
from heavytop.measure.solution_error import SOLUTION_ERROR
from heavytop.records import Peer, Quantity, Row
from heavytop.report.diagnosis_text import diagnosis_text
from heavytop.report.document import Cell, Value
from heavytop.report.printable import short
from heavytop.report.text import table, wrapped
from heavytop.suite.score import Assessment, direction, passed

_PARTS = {"omega": "Ω", "gamma": "γ", "along": "along the flow", "across": "across the flow"}
_OBSERVED = {
    "attitude_error": "attitude (rad)",
    "position_error": "position",
    "position_error_relative": "position, relative",
}
_DIRECTIONS = {
    "along": "The error is mostly along the flow, that is in phase.",
    "across": "The error is mostly across the flow.",
    "both": "The error is along and across the flow alike.",
}


def answer(row: Row, peer: Peer | None) -> list[str]:
    """The sentences that say how good it is; the first may be longer than a line, and can be broken behind its ";"."""
    digits = digits_kept(row)
    lines = []
    if row.outcome != "success":
        lines.append(f"The run ended early ({row.outcome}), at t = {row.time_reached} of {row.horizon}.")
    if digits is None:
        return [*lines, _without_digits(row)]
    where = "every sample up to" if row.samples > 1 else "its one sample,"
    said = f"{digits_text(digits)} of {digits_of(row.bits)} digits right at {where} T = {short(row.time_reached)}"
    if peer is not None:
        said += f"; {peer.integrator} in {peer.precision} keeps {digits_text(peer.digits_right)}"
    lines.append(f"{said}.")
    mostly = direction(row)
    if mostly is not None:
        lines.append(_DIRECTIONS[mostly])
    return lines


def _without_digits(row: Row) -> str:
    if not row.samples:
        return "No digit can be counted: the first state is not finite."
    return "How many digits are right is not known: there is no reference. Drift is measured."


def requirement(row: Row, needed: Fraction) -> str:
    """Whether as many digits are right as are required, in a sentence."""
    asked = f"{float(needed):g} digits are required"
    kept, good = digits_right(row), passed(row, needed)
    # rounded down, so that what is not enough does not look so
    shown = "" if kept is None else f"{math.floor(kept * 1000) / 1000:g}"
    if good is not None:
        return f"{asked}: " + ("they are right." if good else f"{shown} are right.")
    if row.outcome != "success":
        return f"{asked}: not known, for the run ended early."
    return f"{asked}: not known, for " + ("there is no reference." if kept is None else f"{shown} are resolved.")


def guessed(found: Assessment) -> str | None:
    """That the format was not named, and what it was taken for."""
    if not found.format_guessed:
        return None
    said = f"No format is named; {found.row.precision} is the narrowest that holds the digits written."
    single = " Every number in the states is one of single precision (24 bits): perhaps they were computed in it."
    return said + (single if found.single else "")


def told(found: Assessment) -> list[str]:
    """What explains the error, and what was guessed."""
    said = [diagnosis_text(each, found.row.system) for each in found.diagnoses]
    note = guessed(found)
    return [*([found.used] if found.used else []), *said, *([note] if note else [])]


def to_json(found: Assessment) -> dict[str, Any]:
    """The row, and beside it what `score --json` says more."""
    peer = None if found.peer is None else asdict(found.peer)
    said = [asdict(each) | {"sentence": diagnosis_text(each, found.row.system)} for each in found.diagnoses]
    answers = {"digits_kept": found.digits_right, "digits_right": found.digits_right, "of_digits": found.of_digits}
    more: dict[str, Any] = {"scored": found.used} if found.used else {}
    more |= {"peer": peer, "mostly": found.direction, "format_guessed": found.format_guessed, "diagnosis": said}
    row: dict[str, Any] = msgspec.to_builtins(found.row)
    return row | answers | more


def sizes(row: Row) -> list[list[Cell]]:
    """Label, largest, root mean square and final value of each error and of the drift of each first integral."""
    until = f" before t = {short(row.reference.until)}" if row.reference.until else ""
    names = {Quantity(SOLUTION_ERROR, part): f"error{until}, {label}" for part, label in _PARTS.items()}
    names |= {Quantity(name): f"error{until}, {label}" for name, label in _OBSERVED.items()}
    found = [metric.quantity for metric in row.metrics.values() if metric.quantity]
    names |= {Quantity(DRIFT, q.component): f"drift, {q.component}" for q in found if q.name == DRIFT}
    return [
        [label, *(Value(row.metrics.get(each.over(part).text)) for part in ("max", "rms", "final"))]
        for each, label in names.items()
        if each.over("max").text in row.metrics
    ]


def score_text(found: Assessment) -> RenderableType:
    """Digits right, distance from the known motion, drift of every first integral, what explains the error."""
    row = found.row
    numbers = table(["", f"largest over {row.samples} samples", "rms", "final"], sizes(row))
    about = f"{row.case}: {row.integrator}, {row.system} in {row.precision} ({row.bits} bits)"
    parts: list[RenderableType] = [Text(line) for line in answer(row, found.peer)]
    parts += [Text(), numbers, Text(), *_wrapped(about), *_wrapped(f"Compared with {row.against}.")]
    explained = told(found)
    if explained:
        parts += [Text(), *(line for each in explained for line in _wrapped(each))]
    return Group(*parts)


def _wrapped(text: str) -> list[Text]:
    return [Text(line) for line in wrapped(text, "")]
