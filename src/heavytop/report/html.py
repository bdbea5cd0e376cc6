"""A report, or a comparison of two, as one self-contained page: no script, nothing loaded from elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from heavytop.measure.digits import digits_kept
from heavytop.records import Report, Row
from heavytop.report import claim_plots, claim_verdict, method_growth, plots, work_plots
from heavytop.report.compare import Comparison
from heavytop.report.comparison_text import row_name
from heavytop.report.section import Section, Sources, clip
from heavytop.report.svg import quiet_style
from heavytop.report.text import failed, short
from heavytop.suite.files import replace
from heavytop.suite.plan import BUILT_IN

MOST_ROWS = 500
MOST_WORST = 50
MOST_FAILURES = 50
MOST_METRICS = 100
MOST_FINDINGS = 500


def write_report(report: Report, path: Path) -> None:
    """Write the page of ``report`` to ``path``; raises InputError where it cannot be written."""
    replace(path, report_page(report).encode())


def report_page(report: Report) -> str:
    """The page of ``report``; the same report gives the same bytes."""
    rows, left_out = detailed(report.rows)
    found = claim_verdict.audited(report)
    failures = [row for row in report.rows if failed(row)]
    word, sentence = claim_verdict.headline(found)
    return render(
        "report.html.j2",
        report=report,
        word=word,
        sentence=sentence,
        audited=found,
        systems=claim_verdict.SYSTEMS,
        wrongness=claim_verdict.wrongness(report),
        failures=failures[:MOST_FAILURES],
        failed=len(failures),
        gave_up=work_plots.gave_up(report),
        not_finite=[row for row in report.rows if row.outcome == "success" and not row.finite],
        sections=sections([("", report)]),
        measures=_by_measure(rows),
        left_out=left_out,
        environment=report.environment,
        commands=commands(report),
        dirty=str(report.environment.get("commit")).endswith("-dirty"),
    )


def comparison_page(baseline: Report, candidate: Report, comparison: Comparison) -> str:
    """The page of a comparison: verdict, changed rows, both reports on the same axes."""
    changed = comparison.changed
    sources = [("baseline", baseline), ("candidate", candidate)]
    return render(
        "comparison.html.j2",
        report=candidate,
        baseline=baseline,
        comparison=comparison,
        tally={verdict.value: count for verdict, count in comparison.tally.items()},
        changed=changed[:MOST_FINDINGS],
        left_out=max(0, len(changed) - MOST_FINDINGS),
        sections=sections(sources, dict.fromkeys(finding.key[1] for finding in changed)),
        differences=[[clip(part, 200) for part in each] for each in comparison.environment],
        environment=candidate.environment,
    )


def sections(sources: Sources, first: Sequence[str] | dict[str, None] = ()) -> list[Section]:
    """The parts of the page that have pictures; those without a row are left out."""
    with quiet_style():
        made = [
            plots.digits(sources, first),
            claim_plots.claim_error(sources),
            plots.growth(sources, first),
            claim_plots.break_away(sources),
            work_plots.work_precision(sources),
            method_growth.method_growth(sources),
        ]
    found = [section for section in made if section]
    for section in found:
        section.drop_empty_columns()
    return found


def detailed(rows: Sequence[Row]) -> tuple[list[Row], int]:
    """The rows shown one by one, the first and the worst of the others, and how many are left out."""
    rest = sorted(rows[MOST_ROWS:], key=_badness)[:MOST_WORST]
    return [*rows[:MOST_ROWS], *rest], max(0, len(rows) - MOST_ROWS - len(rest))


def _by_measure(rows: Sequence[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.measure or "other", []).append(row)
    return found


def _badness(row: Row) -> tuple[bool, bool, float]:
    kept = digits_kept(row)
    return row.outcome == "success", row.finite, float("inf") if kept is None else kept


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


def render(template: str, **context: Any) -> str:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("heavytop.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"clip": clip, "short": short, "row_name": row_name}
    environment.globals |= {"most_metrics": MOST_METRICS}
    return environment.get_template(template).render(**context)
