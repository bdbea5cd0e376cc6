"""Reports in the formats of tools that follow numbers over commits."""

import csv
import io
import json
import math
from pathlib import Path
from xml.etree import ElementTree

import pytest
import typer

from heavytop.cli import run_command_line
from heavytop.kinds import KINDS
from heavytop.measure.digits import digits_kept
from heavytop.records import Report
from heavytop.report import exports, store
from report_helpers import HOSTILE, error, full_report
from small_reports import report, row

RESULTS = Path(__file__).parents[2] / "results"


@pytest.fixture(scope="module", params=["growth", "default", "hostile"])
def made(request: pytest.FixtureRequest) -> Report:
    return full_report(HOSTILE) if request.param == "hostile" else store.read(RESULTS / request.param, KINDS)


def test_bencher_has_a_number_for_every_measure_and_its_interval_around_it(made: Report) -> None:
    # https://bencher.dev/docs/reference/bencher-metric-format: names -> measures -> value, lower_value, upper_value
    document = json.loads(exports.bencher(made, KINDS))
    assert len(document) > 3
    for name, measures in document.items():
        assert 0 < len(name) <= 1024 or HOSTILE[:20] in name
        for measure, values in measures.items():
            assert 0 < len(measure) <= 64
            assert {"value"} <= set(values) <= {"value", "lower_value", "upper_value"}
            assert all(isinstance(value, float) and math.isfinite(value) for value in values.values())
            assert values.get("lower_value", -math.inf) <= values["value"] <= values.get("upper_value", math.inf)


def test_github_action_benchmark_has_entries_that_are_told_by_their_names(made: Report) -> None:
    entries = json.loads(exports.github_action_benchmark(made, KINDS))
    assert len({entry["name"] for entry in entries}) == len(entries) > 3
    for entry in entries:
        assert {"name", "unit", "value"} <= set(entry) <= {"name", "unit", "value", "range", "extra"}
        assert isinstance(entry["value"], float)
        assert all(isinstance(entry[key], str) for key in set(entry) - {"value"})


def test_smaller_is_better_in_every_number() -> None:
    better = report(row(metrics={"solution_error_relative_max": error("1e-12"), "drift_energy_max": error("1e-15")}))
    worse = report(row(metrics={"solution_error_relative_max": error("1e-9"), "drift_energy_max": error("1e-13")}))
    found = [[number.value for number in exports.numbers(each, KINDS)] for each in (better, worse)]
    assert len(found[0]) == len(found[1]) >= 2
    assert all(a <= b for a, b in zip(*found, strict=True))
    assert found[0] != found[1]


def test_a_row_that_failed_has_no_number_and_is_a_failure() -> None:
    failed = row(case="lost", outcome="step_limit", time_reached="1")
    made = report(row(), failed)
    assert {number.row.case for number in exports.numbers(made, KINDS)} == {row().case}
    suite = ElementTree.fromstring(exports.junit(made, KINDS).encode())
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
    (message,) = [each.get("message", "") for each in suite.iter("failure")]
    assert "step_limit at t = 1" in message


def test_junit_is_xml_with_a_case_for_each_row(made: Report) -> None:
    suite = ElementTree.fromstring(exports.junit(made, KINDS).encode())
    assert len(suite.findall("testcase")) == len(made.rows)


def test_csv_has_every_metric_and_law(made: Report) -> None:
    head, *body = list(csv.reader(io.StringIO(exports.table(made, KINDS))))
    assert {len(line) for line in body} == {len(head)}
    count = sum(max(1, len(each.metrics) + len(each.laws)) for each in made.rows)
    assert len(body) == count


def test_asv_reads_its_folder(made: Report, tmp_path: Path) -> None:
    results = pytest.importorskip("asv.results")
    util = pytest.importorskip("asv.util")
    for name, text in exports.asv(made, KINDS).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, "utf-8")
    (file,) = (tmp_path / "heavytop").glob("*-heavytop.json")
    loaded = results.Results.load(str(file), "heavytop")
    names = set(loaded.get_all_result_keys())
    assert names == set(util.load_json(str(tmp_path / "benchmarks.json"), 2))
    digits = {-kept for each in made.rows if (kept := digits_kept(each)) is not None and each.outcome == "success"}
    found = {loaded.get_result_value(name, [])[0] for name in names if "minus-digits-right" in name}
    assert found == digits


def test_the_command_prints_or_writes_and_refuses_asv_without_a_folder(tmp_path: Path, capsys, monkeypatch) -> None:
    def heavytop(*arguments: str) -> int:
        monkeypatch.setattr("sys.argv", ["heavytop", "export", str(RESULTS / "growth"), *arguments])
        try:
            return run_command_line()
        except (SystemExit, typer.Exit) as done:
            return int(getattr(done, "code", None) or getattr(done, "exit_code", 0))

    begins = {"bencher": "{", "github-action-benchmark": "[", "junit": "<?xml", "csv": "measure,"}
    for to, first in begins.items():
        assert heavytop("--to", to) == 0
        assert capsys.readouterr().out.startswith(first)
    assert heavytop("--to", "asv") == 2
    assert "asv reads a folder" in capsys.readouterr().err
    assert heavytop("--to", "csv", "--out", str(tmp_path)) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert heavytop("--to", "asv", "--out", str(tmp_path / "results")) == 0
    assert len(list((tmp_path / "results").rglob("*.json"))) == 3
