"""One motion, computed or proven, as tables."""

from __future__ import annotations

import hashlib
import shlex
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.display import plural, printable
from heavytop.measure.certify import bits_of
from heavytop.measure.derivatives import PARAMETERS, STARTS, Ball, Derivatives
from heavytop.measure.motion import Motion
from heavytop.measure.reference import Reference
from heavytop.precision import REAL_BITS, dot, exact, exact_text
from heavytop.report.document.document import integral_text, short
from heavytop.top.attitude import Output, perpendicular, rows_of
from heavytop.top.equations import NAMES, VARIABLES

# The table of one motion, computed or proven, for a terminal, a CSV file and a LaTeX table.


_GREEK = {"Ω": r"\Omega", "γ": r"\gamma", "ξ": r"\xi", "φ": r"\varphi", "θ": r"\theta", "ψ": r"\psi"}
_BODY = ("mass", "gravity", "inertia", "about", "weight", "centre", "rotor")
_DATA = (*_BODY, "omega", "gamma", "start_quaternion", "start_matrix", "start_attitude", "xi")
_LINES = 45
"""Most lines of a LaTeX table on one page."""
_DIGITS_A_LINE = 48
"""Digits of a number on a line of a LaTeX table; a multiple of 3, the size of a group."""
_MORE_BITS = 64
_BESIDE = 64
"""Most characters of a value and its radius on one line of a terminal of 80 columns; else the radius is below."""
_KNOWN = ("precision", "integrator", "outcome", "steps")
"""Facts of a computed motion, by the keys that `heavytop score` reads."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column.  name: in a CSV file.  label: on a terminal.  tex: in math mode."""

    name: str
    label: str
    tex: str


@dataclass(frozen=True, slots=True)
class MotionTable:
    """The values of a motion at its times, and the facts needed to cite them.

    facts: key and text, in order.  times: as text.
    values: one line per time, (value, radius) for each column, as text; radius None for values that are not proven.
    """

    facts: tuple[tuple[str, str], ...]
    columns: tuple[Column, ...]
    times: tuple[str, ...]
    values: tuple[tuple[tuple[str, str | None], ...], ...]

    def of_case(self, name: str | None) -> MotionTable:
        """This table with the name of the case among its facts; unchanged for None."""
        return self if name is None else replace(self, facts=(*self.facts[:2], ("name", name), *self.facts[2:]))

    def csv(self) -> str:
        """A header of comments, the names of the columns, a line per time; radii in the last columns.

        `heavytop score` reads it.
        """
        proven = any(radius is not None for line in self.values for _, radius in line)
        names = ["t", *(column.name for column in self.columns)]
        names += [f"{column.name}_radius" for column in self.columns] if proven else []
        lines = [f"# {key}: {text}" for key, text in self.facts] + [",".join(names)]
        for time, line in zip(self.times, self.values, strict=True):
            radii = [str(radius) for _, radius in line] if proven else []
            lines.append(",".join([time, *(value for value, _ in line), *radii]))
        return "\n".join(lines) + "\n"

    def latex(self) -> str:
        """A table with siunitx and booktabs: a line per number, its radius after ±; the facts as comments and caption.

        It is a longtable where it is longer than a page.
        """
        body = [self._tex_lines(index) for index in range(len(self.times))]
        long = sum(map(len, body)) > _LINES
        rows = ("\n" + r"\addlinespace" + "\n").join("\n".join(lines) for lines in body)
        packages = "siunitx, booktabs" + (", longtable" if long else "")
        facts = dict(self.facts)
        head = [f"% {key}: {_one_line(text)}" for key, text in self.facts]
        head += [f"% needs \\usepackage{{{package}}}" for package in packages.split(", ")]
        caption = r"\caption{" + _caption(facts) + "}"
        top = "\n".join([r"\toprule", r"$t$ & & \\", r"\midrule"])
        if long:
            parts = [r"\begin{longtable}{@{}lll@{}}", caption + r"\\", top, r"\endhead", r"\bottomrule", r"\endfoot"]
            parts += [rows, r"\end{longtable}"]
        else:
            parts = [r"\begin{table}", r"\centering", caption, r"\begin{tabular}{@{}lll@{}}", top, rows]
            parts += [r"\bottomrule", r"\end{tabular}", r"\end{table}"]
        return "\n".join([*head, *parts]) + "\n"

    def bibtex(self) -> str:
        """An entry @misc that cites the numbers: program, version, commit, command, method and its source."""
        facts = {key: _one_line(text) for key, text in self.facts}
        facts["command"] = _without_paths(facts["command"])
        digest = hashlib.sha256(f"{facts['command']} {facts['version']}".encode()).hexdigest()
        methods = ("method", "method of the attitude", "source", "precision", "integrator", "digits")
        fields = {
            "author": "{The heavytop authors}",
            "title": _bibtex(f"{facts['system']}: a motion by heavytop {facts['version']}"),
            "version": _bibtex(facts["version"]),
            "howpublished": r"\texttt{" + _bibtex(facts["command"]) + "}",
            "note": _bibtex("; ".join(f"{key}: {facts[key]}" for key in methods if key in facts)),
        }
        lines = [f"  {name} = {{{text}}}," for name, text in fields.items()]
        return "\n".join([f"@misc{{heavytop-{digest[:12]},", *lines, "}"]) + "\n"

    def _tex_lines(self, row: int) -> list[str]:
        """The lines of one time."""
        lines = []
        for index, (column, (value, radius)) in enumerate(zip(self.columns, self.values[row], strict=True)):
            first = _tex_number(self.times[row]) if index == 0 else ""
            parts = _tex_parts(value, radius)
            lines.append(rf"{first} & ${column.tex}$ & {parts[0]} \\")
            lines += [rf" & & {part} \\" for part in parts[1:]]
        return lines


def of_motion(motion: Motion, command: str, version: str) -> MotionTable:
    """The table of a computed motion: states, ξ and Euler angles where requested, outputs."""
    columns, parts, document = _states(), [motion.states], motion.to_json()
    if motion.attitude is not None and motion.angles is not None:
        columns = (*columns, *_xi(), *(Column(name, mark, _GREEK[mark]) for name, mark in _ANGLES))
        parts += [motion.attitude, motion.angles]
    facts = [("system", motion.trajectory.problem.system.name), *((key, str(document[key])) for key in _KNOWN)]
    data = [*_made_by(command, version), *_data_of(document), *facts]
    return _table(data, columns, parts, motion.outputs, motion.output_texts, motion.written_times)


def of_reference(reference: Reference, outputs: Sequence[Output], command: str, version: str) -> MotionTable:
    """The table of a proven motion: states, ξ where requested, outputs, each with its radius."""
    columns, parts = _states(), [reference.states]
    if reference.attitude is not None:
        columns, parts = (*columns, *_xi()), [*parts, reference.attitude]
    facts = [*_made_by(command, version), *_data_of(msgspec.to_builtins(reference)), ("system", reference.system)]
    facts += [("precision", _wide_format(reference)), ("digits", str(reference.digits)), ("method", reference.method)]
    facts.append(("source", reference.source))
    if reference.attitude_method not in (None, reference.method):
        facts.append(("method of the attitude", str(reference.attitude_method)))
    return _table(facts, columns, parts, outputs, reference.balls, list(map(str, reference.times)))


def _table(
    facts: Sequence[tuple[str, str]],
    columns: tuple[Column, ...],
    parts: Sequence[Sequence[Sequence[Any]]],
    outputs: Sequence[Output],
    of_output: Callable[[Output], list[Any]],
    times: Sequence[str],
) -> MotionTable:
    """The table of parts of a motion, each with a line per time, and of its outputs; numbers are texts or balls."""
    columns = (*columns, *(column for output in outputs for column in _columns_of(output)))
    parts = [*parts, *([_flat(value) for value in of_output(output)] for output in outputs)]
    lines = (chain(*line) for line in zip(*parts, strict=True))
    values = tuple(tuple((n, None) if isinstance(n, str) else (n.value, n.radius) for n in line) for line in lines)
    return MotionTable((*facts, *_outputs_of(outputs)), columns, tuple(times), values)


_ANGLES = (("phi", "φ"), ("theta", "θ"), ("psi", "ψ"))


def _states() -> tuple[Column, ...]:
    marks = [f"Ω{axis}" for axis in (1, 2, 3)] + [f"γ{axis}" for axis in (1, 2, 3)]
    return tuple(Column(name, mark, _tex_mark(mark)) for name, mark in zip(VARIABLES, marks, strict=True))


def _xi() -> tuple[Column, ...]:
    return tuple(Column(f"xi{axis}", f"ξ{axis}", _tex_mark(f"ξ{axis}")) for axis in (1, 2, 3))


def _columns_of(output: Output) -> tuple[Column, ...]:
    """The columns of an output; Euler angles are named by their sequence, the vector of Ω in space by its axes."""
    if output.name == "euler":
        letters = zip(output.columns, "abc", strict=True)
        return tuple(
            Column(name, f"{letter} {output.sequence}", rf"{letter}_{{\mathrm{{{output.sequence}}}}}")
            for name, letter in letters
        )
    if output.name == "omega-space":
        return tuple(
            Column(name, f"Ω{axis}", rf"\Omega_{axis}") for name, axis in zip(output.columns, "xyz", strict=True)
        )
    if output.name == "position":
        return tuple(Column(name, name, name) for name in output.columns)
    return tuple(Column(name, name, f"{name[0]}_{{{name[1:]}}}") for name in output.columns)


def _tex_mark(mark: str) -> str:
    return f"{_GREEK[mark[0]]}_{mark[1:]}"


def _flat(value: object) -> list[Any]:
    """The numbers of a nested list."""
    return [part for item in value for part in _flat(item)] if isinstance(value, list) else [value]


def _made_by(command: str, version: str) -> list[tuple[str, str]]:
    return [("command", _one_line(command)), ("version", version)]


def _data_of(document: dict[str, Any]) -> list[tuple[str, str]]:
    """The body, the start and ξ at t = 0, by the keys of the JSON document; R at t = 0 where no other key gives it."""
    facts = [(key, document[key]) for key in _DATA if document.get(key) is not None]
    if document.get("xi") is not None and not any(key.startswith("start_") for key, _ in facts):
        x, y, z = (exact(part) for part in document["gamma"])
        xi = tuple(exact(part) for part in document["xi"])
        if x * x + y * y + z * z == dot(xi, xi) == 1 and xi != perpendicular((x, y, z)):
            facts.append(("start_matrix", [exact_text(part) for row in rows_of((x, y, z), xi) for part in row]))
    return [(key, value if isinstance(value, str) else ", ".join(value)) for key, value in facts]


def _outputs_of(outputs: Sequence[Output]) -> list[tuple[str, str]]:
    """Parameters of an output: sequence, point, pivot."""
    result = []
    for output in outputs:
        if output.name == "euler":
            result.append(("sequence", output.sequence))
        if output.name == "position":
            for key, vector in (("point", output.point), ("pivot", output.pivot if any(output.pivot) else None)):
                result += [] if vector is None else [(key, ", ".join(map(str, vector)))]
    return result


def _wide_format(reference: Reference) -> str:
    """A format in which the rounding of data and times does not affect the digits of a reference.

    `heavytop score` rounds the data of a file to the format that the file names.
    """
    last = max((abs(exact(str(time))) for time in reference.times), default=exact(0))
    bits = bits_of(reference.digits) + _MORE_BITS + 2 * int(last).bit_length()
    return f"real:{min(bits, REAL_BITS[-1])}"


def _one_line(text: str) -> str:
    return printable(" ".join(text.split()))


def _caption(facts: dict[str, str]) -> str:
    """Caption that makes the table readable alone."""
    methods = ("digits", "method") if "digits" in facts else ("precision", "integrator")
    entries = [(key, _escaped(facts[key])) for key in ("name", *_DATA, *methods) if key in facts]
    listed = "; ".join(f"{_escaped(_one_line(key))} " + text.replace("/", r"/\allowbreak ") for key, text in entries)
    return f"{listed}. heavytop {_escaped(facts['version'])}."


def _escaped(text: str) -> str:
    for mark in "\\{}$&#%_^~":
        text = text.replace(mark, {"\\": "/", "^": r"\^{}", "~": r"\~{}"}.get(mark, "\\" + mark))
    return text.replace("'", "{'}")


def _without_paths(command: str) -> str:
    """The command without its output files, and with the names, not paths, of its input files."""
    options = tuple(f"{option}=" for option in (*_WRITTEN, *_READ))
    words = [w for word in shlex.split(command) for w in (word.split("=", 1) if word.startswith(options) else [word])]
    cleaned = []
    for previous, word in pairwise(["", *words]):
        if word not in _WRITTEN and (previous not in _WRITTEN or word.startswith("--")):
            cleaned.append(Path(word).name if previous in _READ else word)
    return shlex.join(cleaned)


_WRITTEN, _READ = ("--csv", "--latex", "--bibtex"), ("--file", "--integrator")
_ACCENTS = {"\u0300": r"\`", "\u0301": r"\'", "\u0302": r"\^", "\u0308": r"\""}


def _bibtex(text: str) -> str:
    """ASCII text with balanced braces and the accents of TeX."""
    text = text.translate(str.maketrans("{}", "()"))
    parts: list[str] = []
    for letter in unicodedata.normalize("NFD", _escaped(text)):
        if letter in _ACCENTS:
            parts[-1] = f"{{{_ACCENTS[letter]}{parts[-1]}}}"
        else:
            parts.append(letter if letter.isascii() else r"$\cdot$" if letter == "·" else "?")
    return "".join(parts)


def _tex_number(text: str) -> str:
    r"""A number in \num; a fraction as one."""
    above, slash, below = text.partition("/")
    return rf"$\num{{{above}}}/\num{{{below}}}$" if slash else rf"\num{{{text}}}"


def _tex_parts(value: str, radius: str | None) -> list[str]:
    """A number and its radius, on as many lines as the digits need."""
    if value in ("nan", "inf", "-inf"):
        return ["undefined" if value == "nan" else rf"${value.replace('inf', chr(92) + 'infty')}$"]
    mantissa, _, power = value.lower().partition("e")
    integer, _, decimals = mantissa.partition(".")
    pieces = [decimals[i : i + _DIGITS_A_LINE] for i in range(0, len(decimals), _DIGITS_A_LINE)] or [""]
    first = integer + (f".{pieces[0]}" if pieces[0] else "")
    tail = rf" \pm \num{{{radius}}}" if radius is not None else ""
    if len(pieces) == 1:
        return [rf"$\num{{{first}{f'e{power}' if power else ''}}}{tail}$"]
    more = [r"\,".join(piece[i : i + 3] for i in range(0, len(piece), 3)) for piece in pieces[1:]]
    more[-1] += (rf" \times 10^{{{int(power)}}}" if power else "") + tail
    return [rf"$\num{{{first}}}$", *(rf"$\quad {part}$" for part in more)]


# Proven derivatives of a motion on a terminal: one per line, so that nothing is truncated at 80 columns.


def derivative_lines(times: Sequence[str], derivatives: Derivatives) -> list[RenderableType]:
    """The method, then the derivatives at each time, each with its radius, and the Lyapunov exponent."""
    parts: list[RenderableType] = [Text(), Text(f"derivatives: {derivatives.method}")]
    for index, time in enumerate(times):
        for matrices, columns in ((derivatives.start, STARTS), (derivatives.data, PARAMETERS)):
            if matrices is not None:
                parts += [Text(), _entries(time, matrices[index], columns)]
        exponent = None if derivatives.lyapunov is None else derivatives.lyapunov[index]
        if exponent is not None:
            parts += [Text(), Text(f"finite-time Lyapunov exponent {exponent.value} ± {exponent.radius}")]
    return parts


def _entries(time: str, matrix: Sequence[Sequence[Ball]], columns: Sequence[str]) -> Table:
    table = Table(box=None, show_header=False)
    table.add_row("t", Text(time, overflow="fold"))
    for name, row in zip(NAMES, matrix, strict=True):
        for column, entry in zip(columns, row, strict=True):
            table.add_row(f"∂{name}/∂{column}", Text(f"{entry.value} ± {entry.radius}", overflow="fold"))
    return table


def motion_text(motion: Motion, table: MotionTable) -> RenderableType:
    """States, further requested outputs, and the drift of the first integrals."""
    run = motion.trajectory
    precision = run.problem.precision
    head = f"{run.problem.system.name} in {precision.name} ({precision.bits} bits) by {run.integrator}"
    head += f": {run.outcome.message}"
    if run.order:  # some peers report neither
        head += f", {plural(run.steps, 'step')} of order {run.order}"
    parts: list[RenderableType] = [Text(head), *_attitude_at_start(table)]
    parts += _at_each_time(table)
    if not motion.complete:
        reason = f" {run.integrator} says: {printable(run.flags['failure'])}" if "failure" in run.flags else ""
        parts += [Text(), Text(f"Reached t = {motion.to_json()['time_reached']} only.{reason}", style="bold")]
    elif motion.drift:
        quantities = [(metric.quantity, metric) for metric in motion.drift.values()]
        worst = [
            (quantity.component, metric) for quantity, metric in quantities if quantity and quantity.statistic == "max"
        ]
        drifts = ", ".join(f"{integral_text(name)} {short(metric.value, 2)}" for name, metric in worst)
        parts += [Text(), Text(f"Largest drift of the first integrals at these times: {drifts}")]
    if (steady := run.stability) is not None:
        parts += [Text(), Text(f"{steady.text(precision.bits).capitalize()}.")]
    if sentence := run.amplification_text():
        parts += [Text(), Text(f"{sentence[:1].upper()}{sentence[1:]}.")]
    return Group(*parts, *_undefined(table))


def reference_text(reference: Reference, table: MotionTable) -> RenderableType:
    """Proven states and further requested outputs, with the radius of each number."""
    parts: list[RenderableType] = [Text(f"{reference.system}, {plural(reference.digits, 'digit')}; {reference.method}")]
    if reference.attitude_method not in (None, reference.method):
        parts.append(Text(f"attitude: {reference.attitude_method}"))
    parts += [Text(reference.stability.text())] if reference.stability else []
    parts += _attitude_at_start(table)
    derivatives = [] if reference.derivatives is None else derivative_lines(reference.times, reference.derivatives)
    return Group(*parts, *_at_each_time(table), *_undefined(table), *derivatives)


def _attitude_at_start(table: MotionTable) -> list[RenderableType]:
    """ξ(0), where the table has an attitude."""
    facts = dict(table.facts)
    return [Text(f"xi(0) = ({facts['xi']})")] if "xi" in facts else []


def _at_each_time(table: MotionTable) -> list[RenderableType]:
    """A table for each time, a line per number; long numbers continue on further lines."""
    parts: list[RenderableType] = []
    numbers = ((value, radius or "") for line in table.values for value, radius in line)
    two_lines = max((len(value) + len(radius) for value, radius in numbers), default=0) > _BESIDE
    for time, line in zip(table.times, table.values, strict=True):
        lines = Table(box=None, show_header=False)
        lines.add_column(no_wrap=True)
        lines.add_column(overflow="fold")
        lines.add_column(no_wrap=True)
        lines.add_row("t", Text(time, overflow="fold"))
        for column, (value, radius) in zip(table.columns, line, strict=True):
            error = "" if radius is None else f"± {radius}"
            shown = f"{value}\n{error}" if two_lines and error else value
            lines.add_row(column.label, Text(shown, overflow="fold"), "" if two_lines else error)
        parts += [Text(), lines]
    return parts


def _undefined(table: MotionTable) -> list[RenderableType]:
    """A sentence about times at which Euler angles are undefined."""
    times = [
        time
        for time, line in zip(table.times, table.values, strict=True)
        for column, (value, _) in zip(table.columns, line, strict=True)
        if value == "nan" and column.label[:2] in ("a ", "c ")
    ]
    if not times:
        return []
    at = ", ".join(list(dict.fromkeys(times))[:6])
    return [Text(), Text(f"At t = {at} the first and the last Euler angle are not defined (gimbal lock).")]
