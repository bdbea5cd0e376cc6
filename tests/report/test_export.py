"""Reports in the formats of other tools, read as these read them."""

from __future__ import annotations

import csv
import json
import math
import re
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import msgspec
import pytest

from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.records import Report
from heavytop.report.document.document import row_name
from heavytop.report.render import FORMATS
from heavytop.report.render.export import LOST, export
from heavytop.version import version
from support import in_process
from support.reports import store

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def report() -> Report:
    """The report that ships, with a row of each end that a row can have."""
    found = store.read(ROOT / "results" / "growth")
    drift = store.read(ROOT / "results" / "default")
    rows = [row for row in (*found.rows, *drift.rows) if row.outcome == "success"]
    first = next(row for row in rows if row.key.kind == "drift")
    for outcome in ("failed", "out_of_time", "unsupported", "out_of_reach"):
        key = msgspec.structs.replace(first.key, case=f"{outcome}-case")
        ended = {"key": key, "case": key.case, "outcome": outcome, "metrics": {}, "against": ""}
        rows.append(msgspec.structs.replace(first, **ended))
    return Report(found.schema, found.plan, found.environment, rows)


@pytest.mark.slow
def test_every_format_holds_the_same_numbers(report: Report) -> None:
    bencher = json.loads(export(report, "bencher", KINDS))
    github = json.loads(export(report, "github-action-benchmark", KINDS))
    asv = json.loads(export(report, "asv", KINDS))["results"]
    count = sum(len(each) for each in bencher.values())
    assert count == len(github) == sum(value != [None] for value, *_ in asv.values()) > 100
    assert sorted(each["value"] for each in github) == sorted(n["value"] for b in bencher.values() for n in b.values())
    assert {each["name"]: each["value"] for each in github} == {
        name: value[0] for name, (value, *_) in asv.items() if value != [None]
    }
    assert bencher["heavytop"] == {"rows-without-a-number": {"value": 3.0}}
    assert f"heavytop: {LOST}" in asv
    assert not any("failed-case" in each["name"] for each in github)


def test_numbers_are_those_of_the_report_and_smaller_is_better(report: Report) -> None:
    github = {each["name"]: each for each in json.loads(export(report, "github-action-benchmark", KINDS))}
    row = next(row for row in report.rows if row.key.kind == "drift" and row.precision == "double" and row.metrics)
    name = row_name(row.identity)
    error = row.metrics["solution_error_relative_max"].log10
    assert abs(github[f"{name}: log10 of the error"]["value"] - error) < 0.006
    energy = row.metrics["drift_energy_max"].log10
    assert github[f"{name}: log10 of the drift of energy"]["value"] == max(energy, -52 * math.log10(2))
    law_row, law_name = next((r, n) for r in report.rows for n, law in r.laws.items() if law.exponent and law.low)
    law = law_row.laws[law_name]
    entry = github[f"{row_name(law_row.identity)}: exponent of {law_name}"]
    assert (entry["value"], entry["unit"]) == (law.exponent, "exponent")
    assert entry["range"] == f"{law.low:.3f} to {law.high:.3f}"
    eps = {row_name(row.identity): (1 - row.bits) * math.log10(2) for row in report.rows}
    drifts = {name: entry["value"] for name, entry in github.items() if "drift of" in name}
    assert all(value >= eps[name.rpartition(":")[0]] for name, value in drifts.items())


def test_bencher_and_github_take_their_keys(report: Report) -> None:
    for name, found in json.loads(export(report, "bencher", KINDS)).items():
        assert 0 < len(name) <= 1024
        for slug, entry in found.items():
            assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", slug)
            assert len(slug) <= 64
            assert {"value"} <= entry.keys() <= {"value", "lower_value", "upper_value"}
            assert all(isinstance(each, float) and math.isfinite(each) for each in entry.values())
            assert entry.get("lower_value", -math.inf) <= entry["value"] <= entry.get("upper_value", math.inf)
    names = [each["name"] for each in json.loads(export(report, "github-action-benchmark", KINDS))]
    assert len(set(names)) == len(names)
    for each in json.loads(export(report, "github-action-benchmark", KINDS)):
        assert {"name", "unit", "value"} <= each.keys() <= {"name", "unit", "value", "range", "extra"}


def test_asv_gets_its_results_of_version_2(report: Report) -> None:
    """The keys of a results file of airspeed velocity, and of each result the columns that it names."""
    document = json.loads(export(report, "asv", KINDS))
    texts = {"commit_hash", "env_name", "python"}
    mappings = {"params", "requirements", "env_vars", "results", "durations"}
    assert document.keys() == {"version", "date", "result_columns"} | texts | mappings
    assert (document["version"], document["env_name"]) == (2, "heavytop")
    assert all(isinstance(document[name], str) for name in texts)
    assert all(isinstance(document[name], dict) for name in mappings)
    assert document["params"].keys() == {"machine", "os", "cpu", "python"}
    assert {type(value) for value in (document["params"] | document["requirements"]).values()} == {str}
    assert not document["commit_hash"].endswith("-dirty")
    assert document["result_columns"] == ["result", "params", "version"]
    results = document["results"]
    assert len(results) > 100
    assert {(len(value), tuple(params), code) for value, params, code in results.values()} == {(1, (), version())}
    assert sum(value == [None] for value, *_ in results.values()) == 3
    assert results[f"heavytop: {LOST}"][0] == [3.0]


def test_junit_has_a_case_a_row(report: Report) -> None:
    suite = ElementTree.fromstring(export(report, "junit", KINDS).encode())
    assert len(suite.findall("testcase")) == len(report.rows) == int(suite.get("tests"))
    assert (suite.get("errors"), suite.get("skipped")) == ("3", "1")
    assert [each.get("type") for each in suite.iter("error")] == ["failed", "out_of_time", "out_of_reach"]
    assert len(list(suite.iter("skipped"))) == 1


def test_csv_has_a_line_a_metric(report: Report) -> None:
    lines = list(csv.DictReader(export(report, "csv", KINDS).splitlines()))
    assert len(lines) == sum(len(row.metrics) + len(row.laws) or 1 for row in report.rows)
    assert {line["outcome"] for line in lines} == {"success", "failed", "out_of_time", "unsupported", "out_of_reach"}


@pytest.mark.slow
def test_the_command_writes_a_file_or_standard_output_and_refuses_another_format(tmp_path: Path) -> None:
    heavytop = partial(in_process.heavytop, "export", ROOT / "results" / "growth")
    done = heavytop("--to", "csv", "--out", tmp_path / "rows.csv")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (tmp_path / "rows.csv").stat().st_size > 1000
    said = in_process.refused("export", ROOT / "results" / "growth", "--to", "excel")
    assert ", ".join(FORMATS) in said
    with pytest.raises(InputError):
        export(Report("heavytop-report/2", {}, {}, []), "", KINDS)
    assert json.loads(export(Report("heavytop-report/2", {}, {}, []), "bencher", KINDS))
    assert {"bencher", "github-action-benchmark", "asv", "junit", "csv"} <= FORMATS.keys()
