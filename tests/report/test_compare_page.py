"""The ten examples of docs/compare.md are what `compare` says."""

from __future__ import annotations

from pathlib import Path

import pytest

from heavytop.harness.rows import computed
from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import Metric, Row
from heavytop.report.compare.noise import Policy
from support.reports import compare, replace, store
from support.small_reports import report, row

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "compare.md").read_text("utf-8")
EXAMPLES = [
    [cell.strip(" `") for cell in line.split("|")[1:-1]]
    for line in PAGE.splitlines()
    if line.startswith("| ") and line[2].isdigit()
]
NAMES = {"error": "solution_error_relative_max", "duration": "break_away_time", "value": "as_expected"}


def side(measure: str, kind: str, cell: str) -> Row:
    """The row of one side: a number, with its band; nan; or how the run ended."""
    setting = {"key": replace(row().key, kind=measure, subject=computed("mine:rk4", step="1/100")), "measure": measure}
    base = row(**setting, integrator="mine:rk4", metrics={})
    number, _, band = cell.partition(" ± ")
    if number == "nan":
        return replace(base, metrics={NAMES[kind]: Metric("nan", None)}, finite=False)
    if number[0].isalpha():
        return replace(base, outcome=number, time_reached="7", finite=False)
    metric = replace(of_fraction(exact(number), kind), band=float(band) if band else None)
    return replace(base, metrics={NAMES[kind]: metric})


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example[0])
def test_an_example_of_the_page_is_judged_as_it_says(example: list[str]) -> None:
    _, measure, kind, baseline, candidate, verdict, _ = example
    assert (
        compare(report(side(measure, kind, baseline)), report(side(measure, kind, candidate)), Policy()).verdict
        == verdict
    )


def test_there_are_ten() -> None:
    assert len(EXAMPLES) == 10


def test_one_amplified_start_on_another_processor_is_no_alarm() -> None:
    """Kovalevskaya's top in extended, 11.9 and 10.8 digits with the same drifts; with drifts as large it is one."""
    report_of = store.read(ROOT / "results" / "long")
    (old,) = (r for r in report_of.rows if (r.case, r.precision, r.key.kind) == ("kovalevskaya", "extended", "growth"))

    def larger(*names: str) -> Row:
        metrics = {
            name: replace(of_fraction(exact(m.value) * exact("12.6")), band=m.band, quantity=m.quantity)
            if name.startswith(names) and m.log10 is not None
            else m
            for name, m in old.metrics.items()
        }
        return replace(old, metrics=metrics, series={})

    before = replace(old, series={})
    assert compare(report(before), report(larger("solution_error")), Policy()).verdict == "same"
    assert compare(report(before), report(larger("solution_error", "drift")), Policy()).verdict == "worse"
