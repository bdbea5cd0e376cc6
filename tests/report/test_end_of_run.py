"""What a run says when it is over: 25 lines of 80 columns, whatever the report."""

from __future__ import annotations

from pathlib import Path

import pytest

from heavytop.kinds import KINDS
from heavytop.records import SCHEMA, Report
from heavytop.report import store
from heavytop.report.brief import LINES, MOST_ROWS, WIDTH, brief, fitted
from small_reports import error, row

RESULTS = Path(__file__).parents[2] / "results"


def said(*rows) -> list[str]:
    return brief(Report(SCHEMA, {"name": "p"}, {}, []), iter(rows), KINDS).splitlines()


@pytest.mark.parametrize("name", ["default", "growth", "long", "peers"])
def test_every_plan_ends_in_few_lines_that_are_not_cut(name: str) -> None:
    report = store.read(RESULTS / name, KINDS)
    lines = brief(report, report.rows, KINDS).splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= WIDTH
    assert lines[0] == f"Plan {name}: {len(report.rows)} measurements, all finished."
    assert not any("lines more" in line for line in lines)


def test_the_digits_of_each_motion_and_format_stand_in_a_table() -> None:
    digits = {"solution_error_relative_max": error("1e-9")}
    rows = [
        row(metrics=digits, horizon="1000"),
        row(metrics=digits | {"solution_error_relative_max": error("1e-7")}, horizon="100000"),
        row(case="a" * 99, precision="quad", bits=113, metrics=digits | {"x": error("1")}, horizon="20"),
    ]
    assert said(*rows) == [
        "Plan p: 3 measurements, all finished.",
        f"{'Digits right, to |t|':40}        double          quad",
        f"  {'euler':38}    7.0 to 1e5             -",
        f"  {'a' * 37}…             -     9.0 to 20",
    ]


def test_what_failed_is_named_and_counted() -> None:
    rows = [row(case=f"top-{i}", outcome="step_limit", time_reached="7.5", metrics={}) for i in range(9)]
    lines = said(*rows)
    assert lines[0] == "Plan p: 9 measurements, 9 did not reach their horizon:"
    assert lines[1] == "  top-0 in double: step_limit at t = 7.5 of 100"
    assert lines[3] == "  and 7 more"


def test_many_rows_are_counted() -> None:
    lines = said(*(row(case=f"top-{i}") for i in range(MOST_ROWS + 1)))
    assert lines[1] == f"drift in double: {MOST_ROWS + 1} success"


def test_parts_that_are_too_long_are_cut_where_they_are_longest_and_say_so() -> None:
    parts = [["a"], [f"b{i}" for i in range(30)], [f"c{i}" for i in range(4)], []]
    found = fitted(parts, 12)
    assert len(found) == 12
    assert found[0] == "a"
    assert found[-4:] == ["c0", "c1", "c2", "c3"]
    assert found[7] == "  and 24 lines more"
    assert fitted(parts, 100) == [line for part in parts for line in part]
