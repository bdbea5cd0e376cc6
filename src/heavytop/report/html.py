"""A report, or a comparison of two, as one self-contained page: no script, nothing loaded from elsewhere."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Container, Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape
from msgspec.structs import replace as replace_struct

from heavytop.measure.digits import RELATIVE, digits_kept
from heavytop.records import UNMEASURED, UNSUPPORTED, Report, Row
from heavytop.report.compare import Comparison, Finding
from heavytop.report.document import Card, Chart, Document, Headline, In, Make, Note, Table, cell_text
from heavytop.report.findings import Change, folded, line, statistics
from heavytop.report.kind import Kinds, document, headlines, kind_of
from heavytop.report.names import row_name, with_source
from heavytop.report.printable import short
from heavytop.report.section import Section, Sources, clip
from heavytop.report.svg import quiet_style
from heavytop.report.text import failed, unsupported
from heavytop.report.work_precision import ERRORS
from heavytop.suite.files import replace
from heavytop.suite.plan import BUILT_IN

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
    found = document(report, kinds, In.PAGE)
    blocks = [block for blocks in found.values() for block in blocks]
    not_finite = [row for row in report.rows if row.outcome == "success" and not row.finite]
    return render(
        "report.html.j2",
        report=report,
        headlines=_headlines(found, kinds)
        or [Headline(f"{len(report.rows)} measurements, {len(failures)} of which failed.")],
        notes=[block for block in blocks if isinstance(block, Note)],
        cards=[block for block in blocks if isinstance(block, Card)],
        failures=failures[:MOST_FAILURES],
        failed=len(failures),
        not_supported=unsupported(report.rows),
        lacking=sum(row.outcome == UNSUPPORTED for row in report.rows),
        gave_up=Counter(kind_of(row, kinds).may_give_up for row in report.rows if _gave_up(row, kinds)),
        not_finite=not_finite,
        overflowed=all(kind_of(row, kinds).may_overflow for row in not_finite),
        sections=sections([("", report)], kinds),
        groups=_by_kind(rows),
        left_out=left_out,
        environment=report.environment,
        commands=[] if report.beside else commands(report),
        dirty=str(report.environment.get("commit")).endswith("-dirty"),
    )


def _headlines(found: Document, kinds: Kinds) -> list[Headline]:
    """The answer of each kind; one that has cards is heard once, so in a sentence where it opens the page alone."""
    said = headlines(found, kinds)
    with_cards = [blocks for blocks in found.values() if any(isinstance(block, Card) for block in blocks)]
    return [each for number, each in enumerate(said) if not number or not any(each in blocks for blocks in with_cards)]


def _gave_up(row: Row, kinds: Kinds) -> bool:
    """Whether a run ended early that may: a finding about its integrator, in its chart."""
    return bool(kind_of(row, kinds).may_give_up) and row.outcome not in ("success", *UNMEASURED)


def comparison_page(baseline: Report, candidate: Report, comparison: Comparison, kinds: Kinds) -> str:
    """The page of a comparison: verdict, changed rows, both reports on the same axes."""
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
        differences=[[clip(part, 200) for part in each] for each in comparison.environment],
        environment=candidate.environment,
    )


def sections(sources: Sources, kinds: Kinds, first: Iterable[str] = ()) -> list[Section]:
    """The parts of the page that have pictures, each from the rows of the kinds that ask for it, and the tables."""
    asked: dict[Make, set[str]] = {}
    tables: dict[str, Section] = {}
    for source, report in sources:
        for name, blocks in document(report, kinds, In.PAGE).items():
            for block in blocks:
                if isinstance(block, Chart):
                    asked.setdefault(block.make, set()).add(name)
                elif isinstance(block, Table):
                    _add(tables, block, source)
    with quiet_style():
        made = [make(_only(sources, names), first) for make, names in asked.items()]
    found = [*sorted((section for section in made if section), key=lambda section: section.place), *tables.values()]
    for section in found:
        section.drop_empty_columns()
    return found


def _only(sources: Sources, names: Container[str]) -> Sources:
    """The sources with the rows of these kinds alone."""
    return [
        (source, replace_struct(report, rows=[row for row in report.rows if row.key.kind in names]))
        for source, report in sources
    ]


def _add(tables: dict[str, Section], table: Table, source: str) -> None:
    """Take the rows of a table of a report into the section of that title."""
    new = Section(f"table-{len(tables)}", table.title, list(table.notes), columns=list(table.columns))
    rows = ([clip(cell_text(cell), 120) for cell in row] for row in table.rows)
    tables.setdefault(table.title, new).rows += [[with_source(name, source), *cells] for name, *cells in rows]


def detailed(rows: Sequence[Row]) -> tuple[list[Row], int]:
    """The rows shown one by one, the first and the worst of the others, and how many are left out."""
    rest = sorted(rows[MOST_ROWS:], key=_badness)[:MOST_WORST]
    return [*rows[:MOST_ROWS], *rest], max(0, len(rows) - MOST_ROWS - len(rest))


def _by_kind(rows: Sequence[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.key.kind or "other", []).append(row)
    return found


def _badness(row: Row) -> tuple[bool, bool, float]:
    kept = digits_kept(row)
    return row.outcome == "success", row.finite, float("inf") if kept is None else kept


def main_metric(row: Row) -> str:
    """What a line about a row says first: an error if it has one that is a number, else what its kind is about."""
    errors = [name for name in (RELATIVE.text, ERRORS[0].text) if name in row.metrics]
    errors += [name for name, metric in row.metrics.items() if metric.kind == "error" and metric.log10 is not None]
    name = next(iter(errors or row.metrics), None)
    if name is None:
        return "no metric"
    return f"{_MAIN.get(name, clip(name.replace('_', ' '), 60))} {short(row.metrics[name].value)}"


_MAIN = {RELATIVE.text: "relative error", ERRORS[0].text: "error"}


def metric_cells(row: Row) -> list[list[str]]:
    """Name, value, and rounding noise in decades of the first metrics."""
    return [
        [
            clip(name, 80),
            clip(metric.value, 40) + (f" (below {short(metric.bound)})" if metric.bound else ""),
            f"{metric.band:.2f}" if metric.band else "",
        ]
        for name, metric in islice(row.metrics.items(), MOST_METRICS)
    ]


def quantities(changed: Change) -> list[tuple[str, Finding]]:
    """Each quantity of a row that changed with the statistics of it that did, and the worst finding about it."""
    return [(statistics(changed, name, found), found[0]) for name, found in folded(changed)]


def commands(report: Report) -> list[str]:
    """How to make the report again, as far as the report knows."""
    name = report.plan.get("name", "")
    version = report.environment.get("packages", {}).get("heavytop", "")
    commit = str(report.environment.get("commit") or "").removesuffix("-dirty")
    lines = [f"git checkout {clip(commit)}"] if commit else [f"# heavytop {clip(str(version))}"]
    lines += [
        "python3 -m venv .venv && .venv/bin/pip install --require-hashes -r constraints/run.txt",
        ".venv/bin/pip install --no-deps --no-build-isolation .",
        f".venv/bin/heavytop run --plan {name if name in BUILT_IN else 'FILE.toml'} --out again",
        ".venv/bin/heavytop compare report.json again",
    ]
    return lines


def unbroken(text: str) -> Markup:
    """The text escaped, each number such as 6.85E-49 in one piece, which browsers would break behind its sign."""
    return Markup(re.sub(r"[\d.]+[eE]-\d+", r'<span class="number">\g<0></span>', str(escape(text))))


def render(template: str, **context: Any) -> str:
    """A template of this room as text, everything escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("heavytop.report"),
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
    }
    environment.globals |= {"most_metrics": MOST_METRICS}
    return environment.get_template(template).render(**context)
