"""Trajectory files of other programs, in JSON, CSV and formats of logs, read exactly and validated."""

from __future__ import annotations

import hashlib
import json
import math
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path
from typing import Any

from heavytop import written_numbers
from heavytop.arguments import MOST_STATES
from heavytop.cases import Case
from heavytop.display import plural
from heavytop.errors import InputError, meant, nearest, prefixed, quoted, refusal
from heavytop.features.score.trajectories import bags, logs
from heavytop.features.score.trajectories import columns as observed_columns
from heavytop.features.score.trajectories.observed import (
    LONGEST_NAME,
    AnyBody,
    GivenTrajectory,
    RawStart,
    in_principal_axes,
    named,
    observed,
    require_states,
    require_system,
    rounded_state,
    slack_of_start,
    too_many,
)
from heavytop.files import read_whole, readable, without_repeats
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.attitude_error import WIDTHS, Convention
from heavytop.precision import DOUBLE, EXTENDED, QUAD, Precision, Vector, exact_text, parse, real, shown, six_digits
from heavytop.top.attitude import SHAPES, key_of
from heavytop.top.bodies import BODY, CENTRE, Body, body_of
from heavytop.top.equations import NAMES, VARIABLES, System, system_of
from heavytop.top.heavy_top import HeavyTop, State, check_times, require_physical

# Text tables of other programs: separators, header, comments.


REMEDY = "`heavytop docs score` describes both file formats; `heavytop list --case lagrange` prints an example."
COLUMNS = ("t", *VARIABLES)
_COMMENT = ("#", "%", "!", "//")
_REMARK = re.compile(r"((?<!1\.)#|#(?!inf|ind|qnan|snan)).*", re.IGNORECASE)
"""Remarks after the numbers of a line; an older C library writes infinity and NaN as 1.#INF and 1.#QNAN."""
_STARTS = ("gamma", "start_quaternion", "start_matrix", "start_euler")
_COMMA = re.compile(r",(?![^\[(]*[\])])")
"""A comma, but for one in brackets, as in R[0,1] or R(1,1)."""
_ALL_COLUMNS = "Give every row all of its columns, with decimal points, not commas."
_COUNTS = {"inertia": (3, 6, 9), "start_quaternion": (4,), "start_matrix": (9,)}
"""Counts of numbers of keys that are not vectors."""
_DECIMAL_COMMAS = re.compile(r"(?!.*,\s).*(?<![^;\s])[-+]?\d+,\d+(?![^;\s])")
"""A number such as 2,5 between semicolons or spaces, where these and no commas separate."""
_POINT = "Write a decimal point in each number, and commas or spaces between them."
_LIKE = 0.75
"""Similarity from which a key is a misspelling of another."""


def unknown(key: str, known: Sequence[str]) -> InputError:
    """Error text for an unknown key."""
    return InputError(f"Unknown key {quoted(key)}.", meant(key, known, _LIKE).rstrip() or REMEDY)


def read_table(text: str, started: bool = False) -> tuple[dict[str, Any], list[str]]:
    """The comments and columns of a text table, as the JSON document would hold them, and notes.

    started: the attitude at t = 0 is known without them.
    Raises InputError for a header or a row that cannot be understood, for a misspelt key and one that stands twice.
    """
    if "\0" in text:
        raise InputError("A table must be text; got a zero byte.", REMEDY)
    if text.count("\n") > 2 * MOST_STATES:
        raise too_many(text.count("\n"), "lines")
    keys, comments, lines, body = _lines(text)
    if not body:
        raise _no_header([])
    separator = _separator(body[0])
    first = _cells(body[0], separator)
    header: Sequence[str] | None
    if _is_number(first[0]):
        header = next((names for names in reversed(comments) if _is_header(names, len(first))), None)
    else:
        header, body, lines = first, body[1:], lines[1:]
        below = _cells(body[0], separator) if body else []
        if 1 < len(below) <= len(first) and _are_units(below):
            header = [f"{name} [{unit.strip('[]()')}]" for name, unit in zip_longest(first, below, fillvalue="")]
            body, lines = body[1:], lines[1:]
    names, notes = _without_header(first) if header is None else (header, [])
    if not body:
        raise InputError("The table has no rows below its header.", "Give a row for each time.")
    cells = _split(body, lines, separator, len(names))
    names, cells, noted = logs.with_one_time(names, cells, started or not keys.keys().isdisjoint(_STARTS))
    notes += noted
    if keys.get("attitude") == "rotation vector":
        names = [re.sub(r"^r_?([xyz])\b", r"rotvec\1", name.strip(), flags=re.IGNORECASE) for name in names]
    joint = str(keys.get("joint", ""))
    # qpos[0] to qpos[2] are where the origin of the body is
    if joint == "free" and any(name.strip().startswith("qpos") for name in names):
        keys.setdefault("point", ["0", "0", "0"])
    meaning = observed_columns.header(names, joint)
    logs.require_understood(names, meaning.others, [*meaning.places], cells)
    cut, times = "", [] if meaning.time is None else [logs.number(row[meaning.time]) for row in cells]
    if times and None not in times:
        rows, noted, cut = logs.without_repeats([time for time in times if time is not None], cells, lines)
        cells, lines = [cells[i] for i in rows], [lines[i] for i in rows]
        notes += noted
    units = {"omega" if name == "framed" else name: unit.name for name, unit in meaning.units.items()}
    in_units = [f"{name} is in {unit}" for name, unit in units.items() if name != "position"]
    notes += [f"as the header declares, {', '.join(in_units)}"] if in_units else []
    if meaning.unknown:
        notes.append(f"unknown units in the header, not converted: {', '.join(sorted(meaning.unknown))}")
    beyond_states = observed_columns.is_more_than_states(meaning)
    if beyond_states and meaning.time is None:
        raise InputError("No column holds the times.", "Call it t, or t [ms] for milliseconds.")
    plain = not beyond_states and not meaning.units
    if plain and meaning.missing:
        raise _no_header(meaning.missing, names)
    columns = {"header": meaning, "plain": plain, "cells": cells, "lines": lines, "cut": cut}
    unused = [*meaning.others, *(names[index] for index in _incomplete(meaning))]
    return keys | columns, notes + unread(unused, names)


def _lines(text: str) -> tuple[dict[str, str | list[str]], list[list[str]], list[int], list[str]]:
    """The keys of the comments, the words of those above the table that are no keys, and the rows with their lines."""
    keys: dict[str, str | list[str]] = {}
    comments: list[list[str]] = []
    lines: list[int] = []
    body: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.strip()
        padded = stripped.rstrip(",; ")  # of a spreadsheet, which quotes a cell with commas
        comment = padded[1:-1] if padded[:1] == padded[-1:] == '"' else padded
        if comment.startswith(_COMMENT):
            comment = comment.lstrip("#%!/ ")
            if not body and not _take_key(comment, keys):
                comments.append(_cells(comment, None))
                if stripped.startswith("%time"):  # of rostopic, in nanoseconds
                    comments[-1][0] = "%time"
        elif stripped and not re.fullmatch("sep=.", stripped):  # a declaration for spreadsheets
            body.append(stripped)
            lines.append(number)
    return keys, comments, lines, body


def _take_key(comment: str, keys: dict[str, str | list[str]]) -> bool:
    """Add ``key: value`` or ``key = value`` to the keys; whether the comment is one."""
    match = re.match(r"([A-Za-z_][A-Za-z_ ]*?)\s*[:=]\s*(.*)", comment)
    if match is None or not match[2]:
        return False
    key, value, known = match[1], match[2].strip(), sorted({*_KEYS, "attitude", "joint"} - {"times", "states"})
    if key not in known:
        # other comments may say what they like
        if nearest(key, known, _LIKE):
            raise unknown(key, known)
        return False
    if key in keys:
        raise InputError(f"The key {key} occurs twice.", "Give each key once.")
    keys[key] = _numbers(key, re.sub(r"[][()]", " ", value).strip()) if key in logs.LISTS else value
    return True


def _without_header(first: Sequence[str]) -> tuple[Sequence[str], list[str]]:
    """The columns of a table that does not name them, by its first row, and the note that says so."""
    width = len(first)
    if text := next((text for text in first if not _is_number(text)), None):
        raise InputError(f"The first row must be a header or numbers; got {quoted(text)}.", logs.NAMES)
    if width == len(logs.KITTI):
        raise InputError(
            "The rows have 12 numbers and no times, as in KITTI: the first three rows of [R p; 0 1].",
            f"Put the time before each row, and above the first row t {' '.join(logs.KITTI)}.",
        )
    names = logs.TUM if width == len(logs.TUM) and logs.is_unit(first[-4:]) else COLUMNS
    if width != len(names):
        raise InputError(
            f"The header is not {','.join(COLUMNS)}: without a header row 1 has {plural(width, 'column')}, not 7.",
            "Give a header that names the columns.",
        )
    return names, [f"columns without a header, read as {' '.join(names)}"]


def _numbers(key: str, text: str) -> list[str]:
    """The numbers of a key; raises InputError, with the text as it stands, where its commas are decimal ones."""
    numbers = re.split(r"\s*[,;]\s*|\s+", text)
    counts = _COUNTS.get(key, (3,))
    if "," in text and (len(numbers) not in counts or _DECIMAL_COMMAS.match(text)):
        remedy = _POINT if len(numbers) > counts[0] or _DECIMAL_COMMAS.match(text) else "Give each of them."
        raise refusal(key, f"{counts[0]} numbers", quoted(text), remedy)
    return numbers


def _incomplete(header: observed_columns.Header) -> list[int]:
    """Indices of quantities with a missing or further component, which are not read if Ω and γ are complete."""
    if not {"omega", "gamma"} <= header.places.keys():
        return []
    incomplete = (indices for name, indices in header.places.items() if len(indices) != WIDTHS.get(name, 3))
    return [index for indices in incomplete for index in indices.values()]


def unread(names: Sequence[str], header: Sequence[str]) -> list[str]:
    """The note on columns that are not read, except ξ and radii, which heavytop writes itself."""
    columns = {name.strip() for name in header}
    ours = {"xi1", "xi2", "xi3"} | {f"{name}_radius" for name in columns}
    others = [name for name in names if name.strip() not in {"", *ours}]
    return [f"ignored columns: {', '.join(name[:40] for name in others[:6])}"] if others else []


def _no_header(missing: list[str], names: Sequence[str] = ()) -> InputError:
    among = f" among {', '.join(name[:20] for name in names[:9])}" if names else ""
    cause = f": {', '.join(missing)} not found{among}" if missing else ": the file has no rows"
    return InputError(f"The header is not {','.join(COLUMNS)}{cause}.", f"{logs.NAMES} {REMEDY}")


def _separator(line: str) -> str | None:
    """Semicolon, comma, tab, or None for white space."""
    return next((mark for mark in (";", ",", "\t") if mark in line), None)


def _cells(line: str, separator: str | None) -> list[str]:
    if separator is None and any(mark in line for mark in ";,\t"):
        separator = _separator(line)
    line = _REMARK.sub("", line).rstrip()
    in_brackets = separator == "," and ("[" in line or "(" in line)
    cells = _COMMA.split(line) if in_brackets else line.split(separator)
    # a separator behind the last column is not a column
    if separator and len(cells) > 1 and not cells[-1].strip():
        cells = cells[:-1]
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _is_number(text: str) -> bool:
    return bool(re.fullmatch(r"[+-]?(\.?\d.*|nan(\(.*\))?|inf(inity)?)", text, re.IGNORECASE))


def _are_units(cells: list[str]) -> bool:
    """Whether the row below the names of the columns has units in it; 1 is that of γ."""
    return not _is_number(cells[0]) and not any(map(_is_number, {*cells} - {"1", "1/s"}))


def _is_header(names: list[str], width: int) -> bool:
    """Whether the words of a comment name the columns, of rows of this width."""
    try:
        # one that stands twice is refused where it is used
        header = observed_columns.header(list(dict.fromkeys(names)))
    except InputError:  # of a sentence, unless these are as many as the columns
        return len(names) == width
    has_time = header.time is not None or names[:1] == ["%time"]
    complete = not header.missing and len(header.places["gamma"]) == 3
    return complete or (has_time and bool(header.places) and (not header.others or len(names) == width > 2))


def _split(body: list[str], lines: list[int], separator: str | None, width: int) -> list[list[str]]:
    """The cells of every row; raises InputError that names the line of one with another number than the header."""
    rows: list[list[str]] = []
    for number, line in zip(lines, body, strict=True):
        spaced = separator is None and _DECIMAL_COMMAS.match(line)
        cells = _cells(line.replace(",", ".") if spaced else line, separator)
        cells += [""] * (len(cells) == width - 1 and line.endswith(separator or "\0"))
        if len(cells) != width:
            decimal_commas = separator == "," and len(cells) == 2 * width
            remedy = "For decimal commas, separate the columns by semicolons." if decimal_commas else _ALL_COLUMNS
            if (not rows or width == 1) and not decimal_commas:
                remedy = "Begin each line above the names of the columns with #, and name every column."
            raise InputError(f"Line {number} has {plural(len(cells), 'column')}, not {width}.", remedy)
        # where a semicolon, a tab or a space separates, a comma is the point of a decimal
        rows.append([cell.replace(",", ".") for cell in cells] if separator in (";", "\t") else cells)
    return rows


# Agreement of a trajectory file with its case.

_NONE: Vector = (Fraction(0), Fraction(0), Fraction(0))


def require_case(case: Case, top: HeavyTop, start: State, which: System, at_start: State | None) -> None:
    """Raises InputError where file and case differ."""
    if which is not case.system:
        raise _differs(case, "system", which.name, case.system.name)
    _require_alike(case, ("weight",), [top.weight], [case.top.weight])
    for i, (new, old) in enumerate(zip(top.inertia, case.top.inertia, strict=True), 1):
        _require_alike(case, (f"I{i}",), [new], [old])
    _require_alike(case, [f"{name} of the centre" for name in "abc"], top.centre, case.top.centre)
    _require_alike(case, [f"k{i} of the rotor" for i in (1, 2, 3)], top.rotor or _NONE, case.top.rotor or _NONE)
    for state, where in ((start, ""), (at_start or start, " of the row t = 0")):
        for vector, names in (("omega", NAMES[:3]), ("gamma", NAMES[3:])):
            _require_alike(case, [name + where for name in names], getattr(state, vector), getattr(case.start, vector))


def require_body(case: Case, body: Body) -> None:
    """Raises InputError where a body, in whatever axes, has another weight, other principal moments, or along a
    principal axis another centre or rotor than the case.
    """
    top, _ = in_principal_axes(body, 64)
    moments = sorted(case.top.inertia)
    _require_alike(case, ("weight",), [top.weight], [case.top.weight])
    for i, (new, old) in enumerate(zip(sorted(top.inertia), moments, strict=True), 1):
        _require_alike(case, (f"principal moment {i}",), [new], [old])
    for vector in ("centre", "rotor") if case.top.weight else ("rotor",):
        names = [f"the {vector} along principal axis {i}" for i in (1, 2, 3)]
        _require_alike(case, names, *([_along(side, vector, moment) for moment in moments] for side in (top, case.top)))


def _along(top: HeavyTop, vector: str, moment: Fraction) -> Fraction:
    """Length of the part of its centre or rotor along the principal axes of that moment, in double."""
    parts = zip(top.inertia, getattr(top, vector) or _NONE, strict=True)
    return Fraction(math.hypot(*(float(value) for inertia, value in parts if _alike(inertia, moment, moment))))


def _alike(new: Fraction, old: Fraction, size: Fraction) -> bool:
    """Whether two numbers agree to three digits of a size."""
    return abs(new - old) <= abs(size) / 1000


def _require_alike(case: Case, names: Sequence[str], stated: Sequence[Fraction], known: Sequence[Fraction]) -> None:
    """Raises InputError for the first component of a vector that is another, relative to the largest of the case."""
    size = max(map(abs, known))
    for name, new, old in zip(names, stated, known, strict=True):
        if not _alike(new, old, size):
            raise _differs(case, name, _briefly(new), _briefly(old))


def _differs(case: Case, name: str, new: str, old: str) -> InputError:
    return InputError(
        f"The file has {name} = {new}, but the case {case.name} has {old}.",
        f"`heavytop list --case {case.name}` shows the data. Without a case the file is scored with its own data.",
    )


def _briefly(value: Fraction) -> str:
    return str(value) if value.denominator < 1000 else six_digits(value)


_FLAGS = ("language", "tolerance", "step")
_KEYS = {*logs.VECTORS, *_FLAGS, "weight", "system", "times", "states", "precision", "bits", "name", "integrator"}
_KEYS |= {"outcome", "steps", *observed_columns.KEYS}
_NOT_READ = {
    "time_reached",
    "order",
    "flags",
    "seconds",
    "amplification",
    "digits_lost",
    "stability",
    "metrics",
    "attitude",
    "angles",
}
_NOT_READ |= {
    "times_given",
    "xi",
    "start_attitude",
    "command",
    "version",
    "sequence",
    "point",
    "pivot",
    *map(key_of, SHAPES),
}
"""Further keys of `heavytop propagate --json`."""


def read(path: Path, case: Case | None = None, normalize: bool = False) -> GivenTrajectory:
    """The trajectory in a ``.json`` or ``.csv`` file (or ``.tsv``, ``.dat``), or ``-`` for standard input.

    case: gives top, start and system where the file does not.
    normalize: take quaternions and matrices of any length for their rotations, and γ of the start for its direction.
    Raises InputError for a file that cannot be read or is neither, for a key or column that is missing or unknown, a
    text that is not a number, times out of order, states of another shape or count, data that no heavy top has, and
    data that are not those of the case.
    """
    shown_path = str(path)[:LONGEST_NAME]
    if path.is_dir():
        path = next(path.glob("report.json"), None) or bags.storage(path)
    piped = str(path) == "-"
    if not piped and path.exists() and not path.is_dir() and path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{shown_path} must end in one of {', '.join(_SUFFIXES)}.", REMEDY)
    with readable(f"The trajectory {shown_path}", REMEDY), prefixed(shown_path):
        content = sys.stdin.buffer.read() if piped else read_whole(path)
        text = logs.as_table(_text_of(path, content))
    if re.match(r'\s*\{\s*"schema"\s*:\s*"heavytop-report', text):
        raise InputError(f"{shown_path} is a report, not a trajectory.", f"`heavytop show {shown_path}` shows it.")
    is_json = text.lstrip().startswith("{") if piped else path.suffix.lower() == ".json"
    try:
        document, notes = (_json(text), []) if is_json else read_table(text, case is not None)
        name = "given" if piped else path.stem
        reader = _observed if observed_columns.is_observed(document) else _of_states
        trajectory = reader(document, name, case, normalize)
        return replace(trajectory, sha256=hashlib.sha256(content).hexdigest(), notes=(*notes, *trajectory.notes))
    except InputError as error:
        raise InputError(f"{shown_path}: {error.cause}", error.remedy or REMEDY) from None


_ARRAYS = (".npy", ".npz", ".parquet")
_SUFFIXES = (".json", ".csv", ".tsv", ".dat", ".txt", ".tum", ".aem", ".sto", ".mot", *_ARRAYS, *bags.SUFFIXES)


def _text_of(path: Path, content: bytes) -> str:
    suffix = path.suffix.lower()
    if suffix in bags.SUFFIXES:
        return bags.of_bag(path)
    if suffix in _ARRAYS:
        return logs.of_arrays(content, suffix)
    text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    return text.replace("\N{MINUS SIGN}", "-")


def _json(text: str) -> dict[str, Any]:
    """The document, every number as the text it is written as."""
    try:
        document = json.loads(
            text, parse_float=str, parse_int=str, parse_constant=str, object_pairs_hook=without_repeats
        )
    except (ValueError, RecursionError) as error:
        raise InputError(f"This is not JSON: {error}.", REMEDY) from None
    if not isinstance(document, dict):
        raise InputError("The JSON document must be an object.", REMEDY)
    for key in sorted(document.keys() - _KEYS - _NOT_READ):
        raise unknown(key, sorted(_KEYS))
    return document


def _of_states(document: dict[str, Any], stem: str, case: Case | None, normalize: bool) -> GivenTrajectory:
    if isinstance(document.get("times"), list) and len(document["times"]) > MOST_STATES:
        raise too_many(len(document["times"]))
    top, times = _top(document, case), _times(document)
    table = observed_columns.columns(document, Convention())
    require_states(times, table.places)
    values = [*zip(table.values["omega"], table.values["gamma"], strict=True)]
    (omega, gamma), at_start = values[0], None
    if not times[0] and omega and gamma:
        at_start = State(omega, gamma)
    if case is not None:
        document = {key: [*map(exact_text, getattr(case.start, key))] for key in ("omega", "gamma")} | document
    raw = observed_columns.start(document, table, not times[0], Convention())
    start = State(raw.omega, raw.values)
    which = system_of(_system(document, case), top)
    if case is not None:
        require_case(case, top, start, which, at_start)
    require_physical(top, start)
    precision = _precision(document, table.texts)
    slack = slack_of_start(raw.from_row, precision)
    if normalize:
        start = start.normalized()
    start.require_unit_gamma(slack, "Write all its digits, or use --normalize (normalize=True in Python).")
    which.parameters(top, start)
    states = [rounded_state([*w, *g], precision) if w and g else None for w, g in values]
    about = _about(document, stem, case, None in states)
    return GivenTrajectory(top=top, start=start, system=which, precision=precision, times=times, states=states, **about)


def _observed(document: dict[str, Any], stem: str, case: Case | None, normalize: bool) -> GivenTrajectory:
    """The trajectory of a document with attitudes, positions, Ω in any axes, or the data of a body."""
    times = _times(document)
    convention = observed_columns.convention(document, document.get("header"))
    table = observed_columns.columns(document, convention)
    require_states(times, table.places)
    body = _body(document, case)
    table = observed_columns.in_unit_of_body(table, document.get("header"), convention, body.centre)
    notes: tuple[str, ...] = ()
    if not body.weight and not any(body.centre) and {"position"} < set(table.values):
        table = replace(table, values={name: rows for name, rows in table.values.items() if name != "position"})
        notes = ("positions of a free body are ignored: its rotation does not determine them",)
    which = system_of(_system(document, case), body)
    require_system(which)
    if case is not None and isinstance(body, HeavyTop):
        require_case(case, body, case.start, which, None)
    elif case is not None and isinstance(body, Body):
        require_body(case, body)
    if case is not None and not document.keys() & {"omega", "gamma", *observed_columns.STARTS}:
        raw = RawStart("gamma", case.start.gamma, case.start.omega)
    else:
        raw = observed_columns.start(document, table, not times[0], convention, not body.weight)
    words = [word for word in observed_columns.unused(convention, {*table.values, raw.form}) if word in document]
    words += ["link"] if "link" in document and "file" not in document else []  # of ROS
    words += ["frame"] if observed_columns.in_space(document) and "omega_space" not in table.values else []
    notes += (f"ignored keys: {', '.join(words)}",) if words else ()
    precision = _precision(document, table.texts)
    quantities, rows = observed(body, raw, convention, table.values, table.places, precision, normalize)
    quantities = replace(quantities, attitude=observed_columns.attitude(document))
    top, start = quantities.posed.top, quantities.posed.start
    require_physical(top, start)
    about = _about(document, stem, case, None in rows) | {"observed": quantities, "notes": notes}
    return GivenTrajectory(top=top, start=start, system=which, precision=precision, times=times, states=rows, **about)


def _times(document: dict[str, Any]) -> list[Fraction]:
    """The times, exact and in order; raises InputError where all are 0."""
    if "lines" in document:
        texts = observed_columns.times(document)
    else:
        texts = [written_numbers.finite(time, f"Row {i}, t") for i, time in enumerate(_list(document, "times"), 1)]
    times = list(check_times(texts))
    if not any(times):
        raise InputError("No time other than 0 was given.", "Give states at later times.")
    return times


def _about(document: dict[str, Any], stem: str, case: Case | None, broken: bool) -> dict[str, Any]:
    """Metadata of a file: name, integrator, outcome, steps, flags, and whether its format was guessed."""
    word = _text(document, "outcome", "success")
    if word not in [outcome.value for outcome in Outcome]:
        raise InputError(f"Unknown outcome {word[:60]!r}.", f"Use {', '.join(outcome.value for outcome in Outcome)}.")
    if "step" in document and written_numbers.finite(document["step"], "step") <= 0:
        raise refusal("step", "positive", document["step"], "Give the step of the method, or leave the key out.")
    return {
        "name": named(_text(document, "name", stem if case is None else case.name), "name"),
        "integrator": named(_text(document, "integrator", "given"), "integrator"),
        "outcome": Outcome.NON_FINITE if broken else Outcome(word),
        "steps": _integer(document.get("steps", "0"), "steps"),
        "flags": {key: named(_text(document, key), key) for key in _FLAGS if key in document},
        "format_guessed": "precision" not in document and "bits" not in document,
        "cut": document.get("cut", ""),
    }


def _body(document: dict[str, Any], case: Case | None) -> AnyBody:
    """The body of a file of a robot, a body with its mass, or a top by its weight."""
    if "file" in document:
        return body_of({key: document[key] for key in ("file", "link", *BODY) if key in document})
    keys = [key for key in ("mass", "gravity") if key in document]
    if not keys:
        if document.get("about") in ("centre", CENTRE):
            remedy = "Give both: moments beside a weight are about the fixed point."
            raise InputError(f"about = {document['about']} was given without mass and gravity.", remedy)
        return _top(document, case)
    if "weight" in document:
        raise InputError(f"weight and {keys[0]} were given.", "Give the weight, or mass and gravity.")
    mass, gravity, about = (_text(document, key, "") for key in ("mass", "gravity", "about"))
    for key, value in (("mass", mass), ("gravity", gravity)):
        if not value:
            raise InputError(f"The key {key} is missing.", "Give both; gravity may be 0.")
    if not written_numbers.finite(gravity, "gravity"):
        document = {"centre": ["0", "0", "0"], **document}
    inertia, centre = _list(document, "inertia"), _list(document, "centre", 3)
    flat = [entry for row in inertia for entry in (row if isinstance(row, list) else [row])]
    rotor = document.get("rotor")
    return Body(mass, gravity, centre, flat, {"centre": CENTRE}.get(about, about or None), rotor)


def _top(document: dict[str, Any], case: Case | None) -> HeavyTop:
    """The top of the file, with the data of the case where the file has none."""
    inertia, centre = (
        list(getattr(case.top, key)) if case and key not in document else _list(document, key, 3)
        for key in ("inertia", "centre")
    )
    weight = _text(document, "weight", None if case is None else exact_text(case.top.weight))
    rotor = _list(document, "rotor", 3) if "rotor" in document else None if case is None else case.top.rotor
    return HeavyTop(inertia, weight, centre, rotor)


def _system(document: dict[str, Any], case: Case | None) -> str | None:
    """The name of the system: the file's, else that of the case; None where neither says it."""
    return _text(document, "system") if "system" in document else None if case is None else case.system.name


def _list(document: dict[str, Any], key: str, count: int | None = None) -> list[Any]:
    value = document.get(key)
    if value is None:
        raise InputError(f"The key {key} is {'null' if key in document else 'missing'}.", REMEDY)
    return observed_columns.listed(value, key, count)


def _text(document: dict[str, Any], key: str, default: str | None = None) -> str:
    value = document.get(key, default)
    if value is None:
        raise InputError(f"The key {key} is {'null' if key in document else 'missing'}.", REMEDY)
    if not isinstance(value, str):
        raise InputError(f"{key} must be text or a number; got a {type(value).__name__}.", "Give one of these.")
    return value


def _integer(value: object, what: str) -> int:
    number = written_numbers.finite(value, what)
    if number < 0 or number.denominator != 1 or number >= 1 << 63:
        raise InputError(f"{what} must be an integer from 0 to 2^63 - 1; got {shown(number)}.", "Correct the count.")
    return int(number)


def _precision(document: dict[str, Any], texts: list[str]) -> Precision:
    """The format that the file names, or the narrowest that holds every number of the states as it is written."""
    if "precision" in document:
        precision = parse(_text(document, "precision"))
        bits = _integer(document["bits"], "bits") if "bits" in document else precision.bits
        if bits != precision.bits:
            raise InputError(f"bits = {bits}, but {precision.name} has {precision.bits}.", "Give precision or bits.")
        return precision
    if "bits" in document:
        bits = _integer(document["bits"], "bits")
        return next((form for form in (DOUBLE, EXTENDED, QUAD) if bits == form.bits), None) or real(bits)
    return written_numbers.format_of(texts)
