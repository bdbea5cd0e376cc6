"""A report, or a comparison of two, as one self-contained page, without scripts and external resources."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Container, Iterable, Sequence
from itertools import islice, takewhile
from pathlib import Path
from shlex import quote
from typing import Any

from markupsafe import Markup, escape
from msgspec.structs import replace as replace_struct

from heavytop.display import plural
from heavytop.extras import has_extra, install
from heavytop.files import replace
from heavytop.harness import BUILT_IN
from heavytop.measure.attitude_error import ATTITUDE_ERROR, POSITION_ERROR
from heavytop.measure.scalar import RELATIVE, digits_kept, digits_of, digits_text
from heavytop.measure.scorer import DRIFT, ERRORS, SOLUTION_ERROR
from heavytop.precision import exact
from heavytop.records import HEYOKA, MULTIWORD, NOT_CARRIED, UNMEASURED, UNSUPPORTED, Law, Quantity, Report, Row, Series
from heavytop.report.compare.compare import Differences
from heavytop.report.compare.findings import Change, folded, line, statistics
from heavytop.report.document.document import (
    Card,
    Cell,
    Chart,
    Headline,
    In,
    Make,
    Note,
    Section,
    Sources,
    Table,
    Value,
    Word,
    cell_text,
    clip,
    computed_by,
    integral_text,
    logarithm,
    row_name,
    short,
    with_source,
)
from heavytop.report.document.kind import Kinds, document, headlines, kind_of
from heavytop.report.document.svg import quiet_style
from heavytop.report.render.text import COMPUTED, drifts, failed, unsupported

MOST_ROWS = 500
MOST_WORST = 50
MOST_FAILURES = 50
MOST_METRICS = 100
MOST_CHANGED = 200


def write_report(report: Report, path: Path, kinds: Kinds) -> None:
    """Write the page of ``report`` to ``path``; raises InputError where it cannot be written."""
    replace(path, report_page(report, kinds).encode())


def report_page(report: Report, kinds: Kinds) -> str:
    """The page of ``report``; the same report gives the same bytes."""
    rows, left_out = detailed(report.rows)
    failures = [row for row in report.rows if failed(row, kinds)]
    blocks_by_kind = document(report, kinds, In.PAGE)
    blocks = [block for blocks in blocks_by_kind.values() for block in blocks]
    not_finite = [row for row in report.rows if row.outcome == "success" and not row.finite]
    # for some kinds a result about the integrator, shown in a chart
    aborted = (row for row in report.rows if row.outcome not in ("success", *UNMEASURED))
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row.key.kind or "other", []).append(row)
    return render(
        "report.html.j2",
        report=report,
        headlines=headlines(blocks_by_kind, kinds)
        or [Headline(f"{plural(len(report.rows), 'measurement')}, {len(failures)} of which failed.")],
        notes=[block for block in blocks if isinstance(block, Note)],
        cards=[block for block in blocks if isinstance(block, Card)],
        failures=[_failure(row) for row in failures[:MOST_FAILURES]],
        failed_columns=_FAILED,
        failed=len(failures),
        not_supported=unsupported(report.rows),
        lacking=sum(row.outcome == UNSUPPORTED for row in report.rows),
        gave_up=Counter(filter(None, (kind_of(row, kinds).may_end_early for row in aborted))),
        not_finite=not_finite,
        overflowed=all(kind_of(row, kinds).may_overflow for row in not_finite),
        sections=sections([("", report)], kinds),
        groups=groups,
        kinds=kinds,
        left_out=left_out,
        environment=report.environment,
        commands=[] if report.beside else commands(report),
        dirty=str(report.environment.get("commit")).endswith("-dirty"),
    )


_FAILED = ("case", "measure", "integrator", "format", "outcome", "reached |t|", "of", "steps", "why")


def _failure(row: Row) -> list[Cell]:
    """A failed measurement: the time reached, and the reason where nothing was measured."""
    names = (row.case, row.measure.replace("_", " "), row.integrator, row.precision)
    reached = (Word(clip(row.outcome, 30)), short(row.time_reached), short(row.horizon), str(row.steps or "-"))
    return [*map(clip, names), *reached, "" if row.metrics else clip(row.against, 200)]


def comparison_page(baseline: Report, candidate: Report, comparison: Differences, kinds: Kinds) -> str:
    """The page of a comparison: verdict, changed rows, and both reports on the same axes."""
    sources = [("baseline", baseline), ("candidate", candidate)]
    return render(
        "comparison.html.j2",
        report=candidate,
        baseline=baseline,
        comparison=comparison,
        tally={verdict.value: count for verdict, count in comparison.tally.items()},
        changed=comparison.rows[:MOST_CHANGED],
        left_out=max(0, len(comparison.rows) - MOST_CHANGED),
        sections=sections(sources, kinds, dict.fromkeys(change.identity.case for change in comparison.rows)),
        differences=[[clip(part, 200) for part in line] for line in comparison.environment],
        environment=candidate.environment,
    )


def sections(sources: Sources, kinds: Kinds, first: Iterable[str] = ()) -> list[Section]:
    """The sections of the page: those with pictures, each from the rows of the kinds that show it, and the tables."""
    names_by_make: dict[Make, set[str]] = {}
    tables: dict[str, Section] = {}
    for source, report in sources:
        for name, blocks in document(report, kinds, In.PAGE).items():
            for block in blocks:
                if isinstance(block, Chart):
                    names_by_make.setdefault(block.make, set()).update(kinds if block.of_all else {name})
                elif isinstance(block, Table):
                    _add(tables, block, source)
    made: list[Section | None] = []
    if has_extra("plots"):
        with quiet_style():
            made = [make(_only(sources, names), first) for make, names in names_by_make.items()]
    elif names_by_make:
        made = [Section("charts", "Charts", [f"Charts need the extra plots: {install('plots')}"])]
    ordered = [*sorted((section for section in made if section), key=lambda section: section.place), *tables.values()]
    for section in ordered:
        section.drop_empty_columns()
    return ordered


def _only(sources: Sources, names: Container[str]) -> Sources:
    """The sources, restricted to rows of these kinds."""
    return [
        (source, replace_struct(report, rows=[row for row in report.rows if row.key.kind in names]))
        for source, report in sources
    ]


def _add(tables: dict[str, Section], table: Table, source: str) -> None:
    """Adds the rows of a table of a report to the section with its title."""
    new = Section(f"table-{len(tables)}", table.title, list(table.notes), columns=list(table.columns))
    for name, *cells in table.rows:
        shown = [cell if isinstance(cell, Word) else clip(cell_text(cell), 180) for cell in cells]
        tables.setdefault(table.title, new).rows.append([with_source(clip(cell_text(name), 120), source), *shown])


def detailed(rows: Sequence[Row]) -> tuple[list[Row], int]:
    """The rows shown one by one, the first and the worst of the others, and the number left out."""

    def goodness(row: Row) -> tuple[bool, bool, float]:
        digits = digits_kept(row)
        return row.outcome == "success", row.finite, math.inf if digits is None else digits

    worst = sorted(rows[MOST_ROWS:], key=goodness)[:MOST_WORST]
    return [*rows[:MOST_ROWS], *worst], max(0, len(rows) - MOST_ROWS - len(worst))


def main_metric(row: Row, kinds: Kinds) -> str:
    """The beginning of a line about a row: that of its kind, else its first error that is a number."""
    if row.metrics and (beginning := kind_of(row, kinds).line(row)):
        return beginning
    errors = [name for name in (RELATIVE.text, ERRORS[0].text) if name in row.metrics]
    errors += [name for name, metric in row.metrics.items() if metric.kind == "error" and metric.log10 is not None]
    name = next(iter(errors or row.metrics), None)
    if name is None:
        return "no metric"
    return f"{_MAIN.get(name, clip(name.replace('_', ' '), 60))} {short(row.metrics[name].value)}"


_MAIN = {RELATIVE.text: "relative error", ERRORS[0].text: "error"}


def metric_cells(row: Row) -> list[list[str]]:
    """Name, value, and rounding noise in decades where known, of the first metrics."""
    metrics = list(islice(row.metrics.items(), MOST_METRICS))
    columns = 3 if any(metric.band for _, metric in metrics) else 2
    return [
        [
            clip(name.replace("_", " "), 80),
            clip(metric.value, 40) + (f" (below {short(metric.bound)})" if metric.bound else ""),
            f"{metric.band:.2f}" if metric.band else "",
        ][:columns]
        for name, metric in metrics
    ]


def quantities(changed: Change) -> list[list[Cell]]:
    """Each changed quantity of a row with its changed statistics and its worst finding."""
    return [
        [
            clip(statistics(changed, name, metrics) or "whole row", 80),
            Word(metrics[0].verdict.value),
            *(clip(short(value or "–"), 40) for value in (metrics[0].baseline, metrics[0].candidate)),
            clip(metrics[0].reason, 200),
        ]
        for name, metrics in folded(changed)
    ]


def commands(report: Report) -> list[str]:
    """The commands that reproduce the report, as far as it determines them."""
    plan = {"file": report.plan["name"]} if report.plan.get("name", "") in BUILT_IN else report.plan
    version = report.environment.get("packages", {}).get("heavytop", "")
    commit = str(report.environment.get("commit") or "").removesuffix("-dirty")
    lines = [f"git checkout {clip(commit)}"] if commit else [f"# heavytop {clip(str(version))}"]
    lines += [
        "python3 -m venv .venv && .venv/bin/pip install --require-hashes -r constraints/run.txt",
        ".venv/bin/pip install --no-deps --no-build-isolation .",
        f".venv/bin/heavytop run --plan {quote(clip(plan.get('file', 'FILE.toml')))} --out again",
        ".venv/bin/heavytop compare report.json again",
    ]
    return lines


def unbroken(text: str) -> Markup:
    """The text escaped, with numbers such as 6.85E-49 unbreakable: browsers would break them after the sign."""
    return Markup(re.sub(r"[\d.]+[eE]-\d+", r'<span class="number">\g<0></span>', str(escape(text))))


def render(template: str, **context: Any) -> str:
    """A template of this package rendered as text, everything escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("heavytop.report.render"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "clip": clip,
        "said": cell_text,
        "unbroken": unbroken,
        "short": short,
        "row_name": row_name,
        "main_metric": main_metric,
        "metric_cells": metric_cells,
        "change": line,
        "folded": quantities,
        "plural": plural,
    }
    environment.tests["verdict"] = lambda cell: isinstance(cell, Word)
    environment.globals |= {"most_metrics": MOST_METRICS}
    return environment.get_template(template).render(**context)


# Conclusions from rows: the headlines of kinds of measurement, and the tables that several kinds share.


_ERROR_ALONG = Quantity(SOLUTION_ERROR, "along")
_LOST = 3
"""Most motions that a headline names as having lost all digits."""
_HOW = {"exponential": "exponentially", "bounded": "within a bound", "unresolved": "by no resolved law"}


def digits_headline(rows: Sequence[Row]) -> Headline | None:
    """The fewest digits right at the longest horizon: of a third-party integrator with heyoka's, else of heyoka with
    those of multiword.  A motion whose reference ends before the horizon, where the format has lost all significant
    digits, is the last choice.
    """
    finished = [row for row in rows if row.outcome == "success"]
    with_digits = [(row, digits) for row in finished if (digits := digits_kept(row)) is not None]
    at_least = "" if with_digits else "at least "
    with_digits = with_digits or [(row, digits) for row in finished if (digits := _at_least(row)) is not None]
    with_digits = [pair for pair in with_digits if not pair[0].reference.until] or with_digits
    theirs = [pair for pair in with_digits if pair[0].key.subject.name not in (HEYOKA, MULTIWORD)]
    ours = [pair for pair in with_digits if pair[0].key.subject.name == HEYOKA]
    compared_with = HEYOKA if theirs else MULTIWORD
    peers = {_motion_key(row): digits for row, digits in with_digits if row.key.subject.name == compared_with}
    candidates = theirs or ours or with_digits
    chosen = [pair for pair in candidates if theirs and _motion_key(pair[0]) in peers] or candidates
    if not chosen:
        return None
    last = max(abs(exact(row.horizon)) for row, _ in chosen)
    longest = [pair for pair in chosen if abs(exact(pair[0].horizon)) == last]
    row, digits = min(longest, key=lambda pair: pair[1])
    sentence = f"{clip(row.key.subject.name, 40)} in {clip(row.precision, 20)}: {at_least}{digits_text(digits)} of "
    sentence += f"{digits_of(row.bits)} digits right to T = {short(row.horizon)} ({clip(row.case, 40)}"
    cases = {row.case for row, _ in longest}
    lost = [
        clip(other_row.case, 40)
        for other_row in finished
        if other_row.case not in cases
        and (other_row.key.subject, other_row.precision) == (row.key.subject, row.precision)
        and other_row.reference.until
        and abs(exact(other_row.reference.until)) <= last
    ]
    sentence += f", worst of {len(cases)})" if len(cases) > 1 and not lost else ")"
    sentence += f", none on {', '.join(lost[:_LOST])}" if lost else ""
    sentence += f"; {compared_with}: {digits_text(peers[_motion_key(row)])}." if _motion_key(row) in peers else "."
    return Headline(sentence, shown=In.SHORT | In.FULL | In.PAGE)


def _at_least(row: Row) -> float | None:
    """A lower bound of the digits right from the absolute error of Ω and γ, which is at least the relative one."""
    errors = [row.metric(SOLUTION_ERROR, part, "max") for part in ("omega", "gamma")]
    sizes = [error.log10 for error in errors if error is not None and error.log10 is not None]
    return -max(sizes) if len(sizes) == len(errors) else None


def _motion_key(row: Row) -> tuple[str, int, str]:
    return row.case, row.bits, row.horizon


def named(rows: Sequence[Row]) -> Callable[[Row], str]:
    """A function for the name of a row: its case, and its integrator unless it is heyoka or that of all rows."""
    several = len({row.key.subject.name for row in rows}) > 1
    return lambda row: row.key.case + (f",{name}" if several and (name := computed_by(row)) else "")


def in_columns(
    title: str, cell: Callable[[Row], str], rows: Sequence[Row], shown: In = In.SHORT, notes: Sequence[str] = ()
) -> list[Table]:
    """A table with a line per motion and a column per format, or per integrator where all rows have one format; of two
    rows for one cell the later.  No table without rows.
    """
    names, one_format = named(rows), len({row.precision for row in rows}) == 1
    lines: dict[str, dict[str, str]] = {}
    for row in rows:
        name, column = (row.key.case, row.key.subject.name) if one_format else (names(row), row.precision)
        lines.setdefault(name, {})[column] = cell(row)
    if not lines:
        return []
    in_order = sorted(rows, key=lambda row: (0, "") if one_format else (row.bits, row.precision))
    columns = list(dict.fromkeys(row.key.subject.name if one_format else row.precision for row in in_order))
    cells = [[line.get(column, "-") for column in columns] for line in lines.values()]
    widest = max(13, min(39, 62 // len(columns) - 2))
    columns = [clip(column, widest) for column in columns]
    room = 78 - sum(2 + max(map(len, column)) for column in zip(columns, *cells, strict=True))
    room = min(max(room, 16), 39)
    named_cells = [line for name, parts in zip(lines, cells, strict=True) for line in _in_lines(name, parts, room)]
    return [Table(title, ["", *columns], named_cells, notes, shown=shown)]


def _in_lines(name: str, cells: list[str], room: int) -> list[list[str]]:
    """The line of a motion; two lines where case and integrator do not fit on one."""
    case, comma, integrator = name.partition(", ")
    if len(name) <= room or not comma:
        return [[clip(name, room), *cells]]
    return [[clip(f"{case},", room), *("" for _ in cells)], ["  " + clip(integrator, room - 2), *cells]]


def digits_columns(rows: Sequence[Row]) -> list[Table]:
    """Digits right over all samples, each with its last time; of two horizons the longer."""
    known: dict[tuple[str, str, str], Row] = {}
    for row in rows:
        column = row.key.case, row.key.subject.name, row.precision
        if digits_kept(row) is not None and (column not in known or _end(row) >= _end(known[column])):
            known[column] = row
    columns = list(known.values())
    more = "; of the attitude" if any(map(_requests_attitude, columns)) else ""
    notes = [COMPUTED] if any(row.reference.how == "computed" for row in columns) else []
    return in_columns(f"Digits right, to |t|{more}", digits_until, columns, notes=notes)


def attitude_columns(rows: Sequence[Row]) -> list[Table]:
    """The largest errors of attitude and position, for rows that request them."""
    title = "Largest error of the attitude (rad), of the position"
    return in_columns(title, _attitude_errors, list(filter(_requests_attitude, rows)), In.FULL | In.PAGE)


def _requests_attitude(row: Row) -> bool:
    return row.metric(*_ATTITUDE) is not None or NOT_CARRIED.items() <= row.flags.items()


_ATTITUDE, _POSITION = (ATTITUDE_ERROR, "", "max"), (POSITION_ERROR, "", "max")


def _attitude_errors(row: Row) -> str:
    errors = [str(Value(metric, 2)) for quantity in (_ATTITUDE, _POSITION) if (metric := row.metric(*quantity))]
    return ", ".join(errors) or NOT_CARRIED["attitude"]


def _until(row: Row) -> str:
    return (row.reference.until or (row.horizon if row.outcome == "success" else row.time_reached)).removeprefix("-")


def _end(row: Row) -> float:
    end = logarithm(_until(row))
    return -math.inf if end is None else end


def digits_until(row: Row) -> str:
    """``9.2 to 1e5``; ``lost by 80`` where all are lost; ``lost 400–600`` where all are lost between these samples; *
    where the reference is not proven.
    """
    kept, end = digits_kept(row), _end(row)
    assert kept is not None
    exponent = math.floor(end + 1e-9) if math.isfinite(end) else 0
    time = f"{10**end:.3g}" if exponent < 3 else f"{10 ** (end - exponent):.2g}e{exponent}"
    right = digits_text(kept)
    digits = f"lost by {time}" if right == "0.0" else f"{right} to {time}"
    digits = _lost(row) if row.reference.until else digits + _unproven(row)
    return digits + _digits_of_attitude(row)


def _unproven(row: Row) -> str:
    return "*" if row.reference.how == "computed" else ""


def _lost(row: Row) -> str:
    """``lost 400–600``: of the samples in the row the last with errors of Ω and γ below 1, and the first with an error
    of γ of at least 1; without the latter, the time from which all significant digits are lost.
    """
    omega, gamma = (row.series.get(f"{SOLUTION_ERROR}_{part}", Series([], [])) for part in ("omega", "gamma"))
    end = next(iter(_times_of_large(gamma)), row.reference.until)
    small = [time for time in takewhile(end.__ne__, gamma.times) if time not in _times_of_large(omega)]
    return f"lost {'–'.join(short(time.removeprefix('-')) for time in (*small[-1:], end))}"


def _times_of_large(errors: Series) -> list[str]:
    """The times at which an error is at least 1 or NaN."""
    sizes = ((time, value, logarithm(value)) for time, value in zip(errors.times, errors.values, strict=True))
    return [time for time, value, size in sizes if value == "nan" or (size is not None and size >= 0)]


def _digits_of_attitude(row: Row) -> str:
    """−log10 of the largest angle in radians, at most the digits of the format, for rows that request the attitude."""
    error = row.metric(*_ATTITUDE)
    if error is None:
        return f"; {NOT_CARRIED['attitude']}" if _requests_attitude(row) else ""
    digits = row.bits * math.log10(2)
    return f"; {digits_text(digits if error.log10 is None else min(digits, max(0.0, -error.log10)))}"


def motions(title: str, rows: Sequence[Row], notes: Sequence[str]) -> Table:
    """Digits right, distance from the true motion and drift of every integral, one line per row."""
    columns = ["case", "format", "T", "steps", "outcome", "digits right", "error along", "across"]
    columns.append("drift of each integral")
    return Table(title, columns, [_motion(row) for row in rows], notes, left=True)


def _motion(row: Row) -> list[Cell]:
    errors = (row.metric(SOLUTION_ERROR, part, "max") for part in ("along", "across"))
    kept = digits_kept(row)
    digits = "-" if kept is None else digits_text(kept)
    return [
        row.case + computed_by(row),
        row.precision,
        row.horizon,
        str(row.steps or "-"),
        row.outcome,
        _lost(row) if row.reference.until else digits + _unproven(row),
        *("no reference" if error is None else Value(error, 2, noise=True) for error in errors),
        "  ".join(f"{integral_text(name)} {Value(metric, 2, noise=True)}" for name, metric in drifts(row)),
    ]


def laws_headlines(rows: Sequence[Row]) -> list[Headline]:
    """The commonest laws of runs without planted faults, of third-party integrators if any: of errors along the flow,
    then of first integrals, with the number of planted faults that show another law.
    """
    theirs = [row for row in rows if row.key.subject.name not in (HEYOKA, MULTIWORD)]
    healthy = theirs or [row for row in rows if not row.key.subject.variant] or rows
    condition = " with default options" if not theirs and len(healthy) < len(rows) else ""
    sentences = [text for text in (_followed(healthy, False, ""), _followed(healthy, True, condition)) if text]
    faults = [row for row in rows if row.key.subject.bias]
    distinguished = sum(_shows_other_law(row, healthy) for row in faults)
    if faults and sentences:
        bias = " and ".join(dict.fromkeys(f"I1 off by {row.key.subject.bias}" for row in faults))
        sentences[-1] += f"; {distinguished} of {len(faults)} with {bias} show another law"
    return [Headline(f"{text[0].upper()}{text[1:]}.") for text in sentences]


def _followed(rows: Sequence[Row], drifts: bool, condition: str) -> str:
    """``errors along the flow grow like t^1.5 (4 of 5 ensembles)``, and a second law that at least a third follow."""
    laws = Counter(growth for row in rows for growth in {law.growth for law in _laws(row, drifts)})
    total = sum(bool(_laws(row, drifts)) for row in rows)
    if not laws:
        return ""
    commonest, *runner_up = laws.most_common(2)
    shown = [commonest, *(pair for pair in runner_up if 3 * pair[1] >= total > 1)]
    # regular motions before those that amplify every error
    (growth, count), *others = sorted(shown, key=lambda pair: pair[0] == "exponential")
    law = _HOW.get(growth, f"like {growth}") + (f" ({count} of {total} ensembles{condition})" if total > 1 else "")
    law += "".join(f" or {_HOW.get(other, f'like {other}')} ({times})" for other, times in others)
    name = rows[0].key.subject.name
    whose = "" if name in (HEYOKA, MULTIWORD) else f" of {clip(name, 40)}"
    return f"first integrals drift {law}" if drifts else f"errors{whose} along the flow grow {law}"


def _laws(row: Row, drifts: bool) -> list[Law]:
    """Laws of the error along the flow, or of the first integrals; quantities that are exactly 0 have none."""
    laws = [(law, law.quantity) for law in row.laws.values() if law.exponent is not None or law.growth != "bounded"]
    if drifts:
        return [law for law, quantity in laws if quantity and quantity.name == DRIFT]
    return [law for law, quantity in laws if quantity == _ERROR_ALONG]


def _shows_other_law(row: Row, healthy: Sequence[Row]) -> bool:
    """Whether a law of the faulty ensemble differs from that of the same motion without fault."""
    same = [peer for peer in healthy if (peer.case, peer.precision) == (row.case, row.precision)]
    expected = {law.growth for row in same for law in _laws(row, drifts=False)}
    return any(law.growth not in {*expected, "unresolved"} for law in _laws(row, drifts=False)) if expected else False
