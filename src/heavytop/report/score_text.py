"""How good one trajectory is, for people: the answer in its first lines."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from dataclasses import asdict
from fractions import Fraction
from typing import Any

import msgspec
from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.text import Text

from heavytop.measure.digits import digits_kept, digits_of, digits_right, digits_text
from heavytop.records import Peer, Row
from heavytop.report.diagnosis_text import diagnosis_text
from heavytop.report.text import short, table
from heavytop.suite.score import Assessment, direction, passed

WIDTH = 80
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


def sizes(row: Row) -> list[list[str]]:
    """Label, largest, root mean square and final value of each error and of the drift of each first integral."""
    until = f" before t = {short(row.reference.until)}" if row.reference.until else ""
    names = {f"solution_error_{key}": f"error{until}, {label}" for key, label in _PARTS.items()}
    names |= {key: f"error{until}, {label}" for key, label in _OBSERVED.items()}
    names |= {name[:-4]: f"drift, {name[6:-4]}" for name in row.metrics if name[:6] == "drift_" and name[-4:] == "_max"}
    return [
        [label, *(short(row.metrics[f"{name}_{part}"].value) for part in ("max", "rms", "final"))]
        for name, label in names.items()
        if f"{name}_max" in row.metrics
    ]


def score_text(found: Assessment) -> RenderableType:
    """Digits right, distance from the known motion, drift of every first integral, what explains the error."""
    row = found.row
    numbers = table(["", f"largest over {row.samples} samples", "rms", "final"], sizes(row))
    about = f"{row.case}: {row.integrator}, {row.system} in {row.precision} ({row.bits} bits)"
    parts: list[RenderableType] = [_Sentence(line) for line in answer(row, found.peer)]
    parts += [Text(), numbers, Text(), *_wrapped(about), *_wrapped(f"Compared with {row.against}.")]
    explained = told(found)
    if explained:
        parts += [Text(), *(line for each in explained for line in _wrapped(each))]
    return Group(*parts)


class _Sentence:
    """A sentence that is broken behind a semicolon where the console is too narrow for it."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        fits = len(self.text) <= options.max_width
        yield Text(self.text if fits else self.text.replace("; ", ";\n"))


def _wrapped(text: str) -> list[Text]:
    return [Text(line) for line in textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)]
