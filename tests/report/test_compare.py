"""Comparison: planted changes are found, and nothing that failed counts as the same."""

import math
from pathlib import Path

import msgspec
import pytest

import heavytop as ht
from heavytop.errors import InputError
from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import Against, Data, Law, Metric, Quantity, Row, Series
from heavytop.report.compare.noise import Policy, Rule, Timings, load
from heavytop.report.compare.verdicts import judge_seconds
from support.reports import compare, replace, store
from support.small_reports import all_judged, error, judged, report, row, verdicts

RESULTS = Path(__file__).parents[2] / "results"


def with_metric(value: Metric, name: str = "drift_energy_max") -> Row:
    return row(metrics={**row().metrics, name: value})


def metric(text: str, kind: str = "error") -> Metric:
    """A number, one of its words, or ``<`` and the bound of an unresolved error."""
    if text.startswith("<"):
        return Metric("unresolved", None, kind, text[1:])
    return Metric(text, None, kind) if text in WORDS else of_fraction(exact(text), kind)


WORDS = {"nan", "missing", "never", "unresolved"}


@pytest.mark.parametrize(
    ("kind", "old", "same", "worse", "better", "incomparable"),
    [
        # two bits and no more; the bound of an unresolved error moves by a factor of 11 beside
        ("error", "1e-12", "3.9e-12 2.6e-13", "4.1e-12 1 nan", "2.4e-13 0", "missing unresolved"),
        ("error", "1e-12", "<3.99e-12 <2.28e-14", "", "", "<4.01e-12 <2.27e-14"),
        ("error", "<1e-12", "<3.99e-12 <2.28e-14", "4.1e-12", "", "<4.01e-12 <2.27e-14"),
        # below the floor all errors are the same; two bounds there are those of two references
        ("error", "1e-25", "8e-16 <1e-30", "1e-14", "", ""),
        ("error", "0", "0 8e-16", "1e-14", "", ""),
        ("error", "<1e-30", "<4.3e-29", "", "", "<4.5e-29 <1e-35"),
        # what is no number is worse than any, and never the same, not even as itself
        ("error", "nan", "", "", "1e-12", "nan missing"),
        ("error", "missing", "", "", "", "1e-12 missing nan"),
        # durations are better when longer, and never is the longest
        ("duration", "60", "58 62.9", "50", "63.1 never", ""),
        ("duration", "never", "never", "60", "", ""),
        ("duration", "0", "0", "", "60", ""),
        # a value that must agree is worse in either direction
        ("value", "0.25", "0.2500000001", "0.26 0.24", "", ""),
        # but an order is better when higher
        ("order", "4", "4", "3 0", "5 8", "missing"),
    ],
)
def test_a_metric_is_judged_by_its_kind_and_its_size(
    kind: str, old: str, same: str, worse: str, better: str, incomparable: str
) -> None:
    names = {"error": "drift_energy_max", "duration": "break_away_time", "value": "claim", "order": "observed_order"}
    name, kind = names[kind], kind.replace("order", "value")
    expected = {"same": same, "worse": worse, "better": better, "incomparable": incomparable}
    wanted = {new: verdict for verdict, texts in expected.items() for new in texts.split()}
    before = with_metric(metric(old, kind), name)
    assert {new: verdicts(before, with_metric(metric(new, kind), name))[name] for new in wanted} == wanted


def test_without_a_floor_errors_below_it_are_compared() -> None:
    tiny, small = with_metric(error("1e-25")), with_metric(error("8e-16"))
    assert verdicts(tiny, small, floor="0")["drift_energy_max"] == "worse"


def test_a_number_in_the_place_of_nan_is_not_better_beyond_its_limit() -> None:
    rule = [Rule(metric="drift_energy_max", limit="1e-11")]
    for old in (with_metric(metric("nan")), ended("failed")):
        for size, verdict in (("1e-12", "better"), ("1e-10", "worse")):
            assert judged(old, with_metric(error(size)), rule=rule)[0] == verdict


@pytest.mark.parametrize(
    "change",
    [
        {"horizon": "200", "time_reached": "200"},
        {"bits": 64},
        {"flags": {"tolerance": "1e-9"}},
        {"flags": {}},
        {"reference": Against("computed", "somebody"), "against": "computed, not proven: somebody"},
        {"measured": "computed: something else"},
    ],
)
def test_another_horizon_format_flag_or_reference_is_incomparable(change) -> None:
    for old, new in ((row(), row(**change)), (row(**change), row())):
        result = compare(report(old), report(new), Policy())
        assert ({f.verdict.value for f in result.findings}, result.exit_code) == ({"incomparable"}, 3)


MEASURED_IN_PART = ("non_finite", "step_limit", "step_too_small", "capacity", "incomplete")


def ended(outcome: str, **changes: object) -> Row:
    """A row that did not reach its horizon."""
    if outcome in MEASURED_IN_PART:
        return row(**({"outcome": outcome, "time_reached": "30", "finite": False} | changes))
    nothing = {"time_reached": "0", "finite": False, "metrics": {}, "bits": 53, "flags": {}, "steps": 0}
    return row(**(nothing | {"outcome": outcome, "reference": Against("none", reason="it hangs")} | changes))


@pytest.mark.parametrize("outcome", [*MEASURED_IN_PART, "failed", "out_of_time"])
def test_a_run_that_no_longer_reaches_its_horizon_is_worse_and_says_why(outcome: str) -> None:
    result = compare(report(row()), report(ended(outcome)), Policy())
    assert (result.verdict, result.exit_code) == ("worse", 1)
    (finding,) = result.findings
    how = " at t = 30" if outcome in MEASURED_IN_PART else ": it hangs"
    assert finding.reason == f"the candidate ended as {outcome}{how}"
    assert all_judged(ended(outcome), row(), ended(outcome)) == ["better", "same"]
    others = row(case="grioli"), ended(outcome)
    ignored = compare(report(others[0], row()), report(*others), Policy(rule=[Rule(case="euler", ignore=True)]))
    assert ignored.verdict == "same"


@pytest.mark.parametrize("outcome", ["out_of_reach", "contradiction", "unsupported"])
def test_what_is_not_measured_for_another_reason_proves_no_failure(outcome: str) -> None:
    for other in ("failed", "out_of_time", "non_finite"):
        for pair in ((ended(outcome), ended(other)), (ended(other), ended(outcome))):
            assert compare(*map(report, pair), Policy()).exit_code == 3
    if outcome != "unsupported":
        for pair in ((row(), ended(outcome)), (ended(outcome), row()), (ended(outcome), ended(outcome))):
            assert compare(*map(report, pair), Policy()).exit_code == 3


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        *((old, new, 0) for old in ("out_of_time", "not_asked") for new in ("out_of_time", "not_asked")),
        *(("unsupported", new, code) for new, code in (("unsupported", 0), ("success", 0), ("failed", 3))),
        *(("success", new, code) for new, code in (("unsupported", 1), ("not_asked", 3))),
        ("not_asked", "success", 0),
    ],
)
def test_what_was_not_asked_and_what_is_not_supported_are_no_failures(old: str, new: str, code: int) -> None:
    two = (row() if outcome == "success" else ended(outcome) for outcome in (old, new))
    assert compare(*map(report, two), Policy()).exit_code == code


def test_two_failures_of_different_kinds_are_incomparable() -> None:
    for pair in (("failed", "out_of_time"), ("non_finite", "failed"), ("step_limit", "non_finite")):
        for old, new in (pair, pair[::-1]):
            assert judged(ended(old), ended(new))[0] == "incomparable"


@pytest.mark.parametrize(
    ("reached", "verdict"), [("30", "same"), ("28.6", "same"), ("28.4", "worse"), ("15", "worse"), ("60", "same")]
)
def test_a_run_that_stops_earlier_than_it_did_is_worse(reached: str, verdict: str) -> None:
    old, new = ended("step_limit"), ended("step_limit", time_reached=reached)
    assert judged(old, new)[0] == verdict


@pytest.mark.parametrize("word", ["nan", "missing"])
def test_what_neither_of_two_runs_that_stopped_reached_is_no_difference(word: str) -> None:
    metrics = {"drift_energy_max": error("1e-12"), "drift_energy_final": Metric(word, None)}
    stopped = ended("step_limit", metrics=metrics)
    result = compare(report(stopped), report(stopped), Policy())
    assert result.verdict == "same"
    assert result.sentences[1].startswith("1 row of heyoka failed in both reports on euler")
    assert judged(ended("step_limit"), stopped)[0] == "incomparable"


def test_rows_that_are_supported_in_neither_report_are_no_metrics() -> None:
    lacking, measured = report(ended("unsupported", metrics={})), row(metrics={"drift_energy_max": error("1e-12")})
    assert compare(lacking, lacking, Policy()).sentences == [
        "Nothing is compared: 1 row is not supported in either report."
    ]
    both = report(*lacking.rows, replace(measured, case="other"))
    assert compare(both, both, Policy()).sentences == ["Nothing changed: 1 metric is within the limits."]


def test_a_failure_of_another_motion_says_nothing_of_this_one() -> None:
    data = Data(("2", "2", "1"), "1", ("0", "0", "1"), ("0", "0", "1"), ("1", "0", "0"))
    other = msgspec.structs.replace(data, weight="2")
    assert compare(report(row(data=data)), report(ended("non_finite", data=other)), Policy()).exit_code == 3
    assert compare(report(row(data=data)), report(ended("non_finite", data=data)), Policy()).exit_code == 1
    assert compare(report(row(data=data)), report(ended("failed")), Policy()).exit_code == 1


def test_missing_and_new_rows_and_metrics() -> None:
    other = row(case="lagrange")
    result = compare(report(row(), other), report(row()), Policy())
    assert result.exit_code == 3
    assert [f.verdict.value for f in result.findings].count("missing") == 1
    result = compare(report(row()), report(row(), other), Policy())
    assert result.exit_code == 0
    assert result.verdict == "same"
    less = row(metrics={"break_away_time": row().metrics["break_away_time"]})
    assert verdicts(row(), less)["drift_energy_max"] == "missing"
    assert verdicts(less, row())["drift_energy_max"] == "new"
    # another case is not the same row
    found = compare(report(row()), report(other), Policy()).findings
    assert {f.verdict.value for f in found} == {"missing", "new"}


def test_seconds_may_change_by_their_ratio_and_below_their_floor() -> None:
    starter = load(Path(ht.__file__).parent / "api/starters/common/policy.toml").timings
    for old, new, verdict in ((0.36e-3, 2.6e-3, "worse"), (0.14e-3, 0.94e-3, "same"), (0.7e-3, 1.3e-3, "same")):
        assert judge_seconds(old, new, starter)[0].value == verdict
    for old, new, verdict in (
        *((1, 1.49, "same"), (1, 1.51, "worse"), (1.5, 1.01, "same"), (1.5, 0.99, "better")),
        *((0.001, 0.149, "same"), (0.001, 0.151, "worse")),
        *((1, math.inf, "incomparable"), (math.nan, 1, "incomparable")),
    ):
        assert judge_seconds(old, new, Timings())[0].value == verdict


@pytest.mark.parametrize("text", ["1_0", "\u0967", "much", "inf", "nan"])
@pytest.mark.parametrize("place", ["bound", "times"])
def test_a_number_that_is_none_is_refused_wherever_it_stands(tmp_path: Path, place: str, text: str) -> None:
    """Also beside a value that is plainly a number, and what Python's own float reads."""
    metric = error("1E-12")
    series = {"drift_energy": Series([text if place == "times" else "1", "100"], ["1E-13", "1E-12"])}
    edit = replace(metric, bound=text) if place == "bound" else metric
    store.write(report(row(metrics={"drift_energy_max": edit}, series=series)), tmp_path)
    with pytest.raises(InputError, match=f"drift_energy.*{text}.*not a finite number"):
        store.read(tmp_path)


@pytest.mark.parametrize("content", [b"", b"[]", b'{"schema": 3}', b"\xff\xfe", b"null", b'{"rows": []}'])
def test_a_foreign_file_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "x.json"
    file.write_bytes(content)
    with pytest.raises(InputError):
        store.read(file)


def test_bytes_that_are_no_text_in_a_row_are_refused(tmp_path: Path) -> None:
    path = store.write(report(row()), tmp_path)
    other = tmp_path / "other.json"
    other.write_bytes(path.read_bytes().replace(b'"steps":10', b'"steps":10,"note":"\xff"'))
    with pytest.raises(InputError, match="is not a whole report"):
        ht.compare(path, other)


def test_a_missing_report_and_a_row_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no report"):
        store.read(tmp_path)
    store.write(report(row(), row()), tmp_path)
    with pytest.raises(InputError, match="twice"):
        store.read(tmp_path)
    twice = report(with_metric(error("1E-12")), with_metric(error("1E-3")))
    with pytest.raises(InputError, match=r"candidate contains the row .* twice"):
        ht.compare(report(row()), twice)
    with pytest.raises(InputError, match=r"contains the row .* twice"):
        ht.history([report(row()), twice])


@pytest.mark.parametrize(
    "change",
    [
        *({"bits": bits} for bits in (10**12, -1, 0)),
        *({name: -1} for name in ("steps", "order", "evaluations")),
        *({"seconds": {"run": seconds}} for seconds in (-0.5, float("inf"))),
        {"measure": "homoclinic", "metrics": {}},
        {"measure": "claim_evaluation"},
        {"outcome": "fine"},
        {"horizon": "x"},
        {"time_reached": "101"},
        *({"outcome": "step_limit", "time_reached": time} for time in ("101", "-1")),
        {"metrics": {"break_away_time": Metric("unresolved", None, "duration")}},
        *({"metrics": {"drift_energy_max": metric}} for metric in (Metric("never", None), Metric("-1e-12", -12.0))),
        {"metrics": {"drift_energy_max": Metric("unresolved", None, "error", "-1e-12")}},
        *({"series": {"drift_energy": Series(times, ["1e-12"])}} for times in (["1", "2"], ["soon"])),
        {"series": {"drift_energy": Series(["1"], ["little"])}},
        {"series": {"drift_energy": Series(["1"], ["-1e-13"], Quantity("drift", "energy"))}},
        *({"laws": {"energy": Law("t", 8, *numbers)}} for numbers in ((1.0, 1.1, 0.9), (1.0, 0.9), (None, 0.9, 1.1))),
        *({"laws": {"energy": Law("t", 8, 1.0, **said)}} for said in ({"detects": "-1e-19"}, {"lost_at": "soon"})),
        {"laws": {"energy": Law("t", -8, 1.0)}},
    ],
)
def test_rows_that_cannot_be_are_refused_with_row_and_field(tmp_path: Path, change) -> None:
    file = store.write(report(row(), row(case="lagrange", **change)), tmp_path)
    (tmp_path / "report.json.sha256").unlink()
    inner = {"drift_energy_max", "break_away_time", "drift_energy", "energy", "homoclinic", "claim_evaluation"}
    fields = "|".join({*change, *inner, "null"})
    with pytest.raises(InputError, match=rf"(lagrange|rows\[1\]).*({fields})"):
        store.read(file)
    if not change.keys() & {"series", "order", "evaluations"}:  # a comparison looks at none of these
        with pytest.raises(InputError, match=rf"(lagrange|row 2).*({fields})"):
            list(store.read_brief(file).rows)


@pytest.mark.slow
@pytest.mark.parametrize("folder", sorted(path.parent.name for path in RESULTS.glob("*/report.json")))
def test_what_the_program_wrote_is_read(folder: str) -> None:
    found = store.read(RESULTS / folder)
    assert [row.key for row in store.read_brief(RESULTS / folder).rows] == [row.key for row in found.rows]


def test_a_run_that_failed_on_rounded_times_is_read(tmp_path: Path) -> None:
    third = str(float(1 / 3))
    made = row(horizon="0.33333333333333333333", outcome="incomplete", time_reached="0.33333333333333337034")
    file = store.write(report(made, row(case="b", horizon="-1e-3", outcome="non_finite", time_reached="0")), tmp_path)
    assert store.read(file).rows[0].time_reached > third


def test_a_list_in_the_environment_differs_by_what_one_of_the_two_lacks() -> None:
    def differences(*environments):
        two = [replace(report(row()), environment=each) for each in environments]
        return compare(*two, Policy()).environment

    old, new = {"cpu": {"features": ["a", "b"]}}, {"cpu": {"features": ["b", "c", "d"]}}
    assert differences(old, new) == [("cpu.features", "a", "c d")]
    assert differences({}, new) == [("cpu.features", "absent", "3 known")]
    assert differences(new, new) == []
