"""What was done to a report on disk is never "the same"; read for a comparison it is the report it is."""

import json
import os
import signal
import sys
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from random import Random
from time import sleep
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heavytop.errors import InputError
from heavytop.processes import forked
from heavytop.records import Law, Metric, Row
from heavytop.report.compare import compare as comparing
from heavytop.report.compare.noise import Policy, Rule
from support.reports import compare, replace, store
from support.small_reports import error, report, row

GOOD = report(
    row(laws={"drift_energy": Law("t^0.5", 64, 0.5, 0.4, 0.6)}),
    row(case="lagrange"),
    row(case="delone", metrics={"solution_error_omega_max": Metric("unresolved", None, "error", "1E-20")}),
    row(case="gyrostat", metrics={"drift_area_max": Metric("1E-997", -997.0), "drift_area_rms": error("0")}),
)


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every place in the rows of a document where something stands that a comparison looks at."""
    if isinstance(value, dict):
        return [
            p for k, v in value.items() for p in ((*path, k), *places(v, (*path, k))) if k not in ("seconds", "series")
        ]
    if isinstance(value, list):
        return [p for i, v in enumerate(value) for p in ((*path, i), *places(v, (*path, i)))]
    return []


DOCUMENT = json.loads(msgspec.json.encode(GOOD))
COMPARED = ("horizon", "outcome", "bits", "metrics", "flags", "case", "measure", "integrator", "precision", "system")
FOLLOWING = [(name,) for name in ("system", "precision", "horizon", "measure")]
"""Keys that follow from that of the row: it is the same without them."""
# a place, and what it is made into; a lone band or bound only widens or narrows what counts as the same
PLACES = [
    ("rows", *p)
    for p in places(DOCUMENT["rows"])
    if (len(p) == 1 or p[1] in COMPARED) and p[-1] not in ("band", "bound", "kind")
]


def changed(path: tuple[Any, ...], how: str) -> Any:
    document = deepcopy(DOCUMENT)
    inner = document
    for part in path[:-1]:
        inner = inner[part]
    if how == "remove":
        del inner[path[-1]]
    else:
        inner[path[-1]] = {"null": None, "nan": "nan", "missing": "missing", "text": "x", "number": 12345}[how]
    return document


def on_disk(folder: Path, document: Any) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "report.json").write_text(json.dumps(document))
    return folder


@pytest.mark.slow
@given(st.sampled_from(PLACES), st.sampled_from(["remove", "null", "nan", "missing", "text", "number"]))
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_mutated_report_is_refused_or_not_the_same(tmp_path: Path, path: tuple[Any, ...], how: str) -> None:
    document = changed(path, how)
    if document == DOCUMENT or (how == "remove" and path[2:] in FOLLOWING):
        return
    good, bad = on_disk(tmp_path / "good", DOCUMENT), on_disk(tmp_path / "bad", document)
    for old, new in ((good, bad), (bad, good)):
        try:
            result = compare(store.read_brief(old), store.read_brief(new), Policy())
        except InputError:
            continue
        assert result.changed, (path, how)
        if new is bad:
            assert result.verdict != "same" or all(f.verdict.value == "new" for f in result.changed)


@pytest.mark.parametrize("indent", [None, 1])
def test_brief_and_whole_reports_compare_alike_however_they_are_laid_out(tmp_path: Path, indent: int | None) -> None:
    other = deepcopy(DOCUMENT)
    other["rows"][1]["metrics"]["drift_energy_max"] = {"value": "1E-9", "log10": -9.0}
    other["rows"].reverse()
    for name, document in (("a", DOCUMENT), ("b", other)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "report.json").write_text(json.dumps(document, indent=indent))
    old, new = tmp_path / "a", tmp_path / "b"
    whole = compare(store.read(old), store.read(new), Policy())
    brief = compare(store.read_brief(old), store.read_brief(new), Policy())
    assert whole == brief
    assert [(f.row.case, f.verdict.value) for f in brief.changed] == [("lagrange", "worse")]
    counted = compare(store.read_brief(old), store.read_brief(new), Policy(), list_same=False)
    assert (counted.tally, counted.changed, counted.verdict) == (whole.tally, whole.changed, whole.verdict)
    assert len(counted.findings) < len(whole.findings)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b'"1E-12"', b'"1E-13"', "disagree"),
        (b'"case":"lagrange"', b'"case":"euler"', "twice"),
        (b'"bits":53', b'"bits":-1', "not a whole report"),
        (b'"starts":1', b'"starts":0', "not a whole report"),
        (b'"band":null', b'"band":-0.5', "not a whole report"),
        (b'"1E-20"', b'"tiny"', "not a finite number"),
        (b'"steps":10', b'"steps":"ten"', "not a whole report"),
        (b'"metrics"', b'"metric"', "not a whole report"),
        (b"heavytop-report/2", b"other-report/7", "schema"),
        (b'"log10":-12.0', b'"log10":null', "disagree"),
        (b'"1E-12"', b'"much"', "not a finite number"),
        (b'"1E-12","log10":-12.0,"kind":"error","bound":null', b'"1","log10":0.0,"bound":"1E-12"', "1 with a bound"),
        (b'"time_reached":"100"', b'"time_reached":"99"', "a success that reached only 99"),
        (b'"value":"1E-12","log10":-12.0', b'"value":"nan","log10":null', "said to be finite"),
    ],
)
def test_an_edited_report_is_refused_where_it_is_read_and_while_comparing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: bytes, new: bytes, message: str
) -> None:
    monkeypatch.setattr(comparing, "_MANY", 0)
    path = store.write(GOOD, tmp_path)
    content = path.read_bytes()
    assert old in content
    (tmp_path / "report.json.sha256").unlink()
    path.write_bytes(content.replace(old, new))
    for read in (store.read, store.read_brief):
        with pytest.raises(InputError, match=message):
            compare(read(tmp_path), read(tmp_path), Policy(), list_same=False)


RULES = [Rule(case="top1*", metric="drift_*", loss_bits="9"), Rule(case="new", ignore=True), Rule(case="x")]


def edited(rows: list[Row], random: Random) -> list[Row]:
    """Rows with some removed, new, moved, repeated, larger, with more steps, without numbers, or contradictory."""
    rows = list(rows)
    for _ in range(random.choice([0, 1, 2, 5])):
        at, other = random.sample(range(len(rows)), 2)
        old = rows[at]
        larger = {name: error("1E-9") for name in old.metrics}
        rows[at : at + 1] = random.choice(
            [
                [],
                [old, row(case="new")],
                [rows[other]],
                [replace(old, metrics=larger)],
                [replace(old, steps=100)],
                [replace(old, metrics={})],
                [replace(old, metrics={"drift_energy_max": Metric("1E-3", -9.0)})],
            ]
        )
    return rows


@pytest.mark.skipif(sys.platform != "linux", reason="a process is copied on Linux alone")
def test_halves_that_two_processes_compare_make_the_same_comparison(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    halves, join = [], comparing._Part.extend
    monkeypatch.setattr(comparing._Part, "extend", lambda part, later: (halves.append(later), join(part, later)))
    for seed in range(60):
        random = Random(seed)
        empty = {"metrics": {}, "integrator": "mine"}
        policy = Policy(rule=random.choice([[], RULES]))
        rows = [row(case=f"top{i}", **random.choice([{}, {}, {}, empty])) for i in range(random.randrange(8, 20))]
        for name, some in (("a", rows), ("b", edited(rows, random))):
            (tmp_path / name).mkdir(exist_ok=True)
            store.write(report(*some), tmp_path / name)
        results: list[Any] = []
        for many in (10_000, 2):
            monkeypatch.setattr(comparing, "_MANY", many)
            try:
                briefs = [store.read_brief(tmp_path / name) for name in ("a", "b")]
                results.append(compare(*briefs, policy, list_same=False))
            except InputError as refused:
                results.append(str(refused))
        assert results[0] == results[1], seed
    assert 15 < len(halves) < 60


@pytest.mark.skipif(sys.platform != "linux", reason="a process is copied on Linux alone")
def test_a_copied_process_gives_its_result_or_none_and_ends() -> None:
    def ends() -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def raises() -> None:
        raise KeyboardInterrupt

    expected: list[tuple[Callable[[], Any], Any]] = [(lambda: "x" * 10**6, "x" * 10**6), (raises, None), (ends, None)]
    for work, result in expected:
        with forked(work) as answer:
            assert answer is not None
            assert answer() == result
    children = Path(f"/proc/self/task/{os.getpid()}/children")
    before = children.read_text()
    with forked(lambda: sleep(1000)):
        assert children.read_text() != before
    assert children.read_text() == before


def test_no_process_to_be_had_is_no_copy(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails() -> int:
        raise BlockingIOError

    monkeypatch.setattr(os, "fork", fails)
    with forked(int) as answer:
        assert answer is None
