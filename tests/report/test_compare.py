"""Comparison: planted changes are found, and nothing that failed counts as the same."""

import math
from pathlib import Path

import msgspec
import pytest

import heavytop as ht
from heavytop.errors import InputError
from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import Against, Data, Law, Metric, Row, Series
from heavytop.report.compare.noise import Policy, Rule, Timings
from heavytop.report.compare.verdicts import Verdict, judge_seconds
from heavytop.report.document.document import short
from support.reports import compare, replace, store
from support.small_reports import error, report, row

RESULTS = Path(__file__).parents[2] / "results"


def verdicts(old: Row, new: Row, **policy) -> dict[str, Verdict]:
    return {f.metric: f.verdict for f in compare(report(old), report(new), Policy(**policy)).findings}


def with_metric(value: Metric, name: str = "drift_energy_max") -> Row:
    return row(metrics={**row().metrics, name: value})


def test_a_report_is_the_same_as_itself() -> None:
    result = compare(report(row()), report(row()), Policy())
    assert result.verdict == "same"
    assert result.exit_code == 0


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        ("3.9e-12", Verdict.SAME),
        ("4.1e-12", Verdict.WORSE),
        ("1", Verdict.WORSE),
        ("2.6e-13", Verdict.SAME),
        ("2.4e-13", Verdict.BETTER),
        ("0", Verdict.BETTER),
    ],
)
def test_an_error_may_grow_by_two_bits_and_no_more(value: str, verdict: Verdict) -> None:
    assert verdicts(row(), with_metric(error(value)))["drift_energy_max"] is verdict


def test_errors_below_the_floor_are_rounding_luck() -> None:
    tiny, small = with_metric(error("1e-25")), with_metric(error("8e-16"))
    assert verdicts(tiny, small)["drift_energy_max"] is Verdict.SAME
    assert verdicts(tiny, small, floor="0")["drift_energy_max"] is Verdict.WORSE
    assert verdicts(with_metric(error("0")), small)["drift_energy_max"] is Verdict.SAME
    assert verdicts(with_metric(error("0")), with_metric(error("1e-14")))["drift_energy_max"] is Verdict.WORSE


def test_what_is_no_number_is_worse_than_any_and_never_the_same_not_even_as_itself() -> None:
    bad, unmeasured = (with_metric(Metric(value, None)) for value in ("nan", "missing"))
    name = "drift_energy_max"
    assert verdicts(row(), bad)[name] is Verdict.WORSE
    assert verdicts(bad, row())[name] is Verdict.BETTER
    for old, new in ((bad, bad), (row(), unmeasured), (unmeasured, row()), (bad, unmeasured), (unmeasured, unmeasured)):
        assert verdicts(old, new)[name] is Verdict.INCOMPARABLE


def test_a_number_in_the_place_of_nan_is_not_better_beyond_its_limit() -> None:
    policy = Policy(rule=[Rule(metric="drift_energy_max", limit="1e-11")])
    for old in (with_metric(Metric("nan", None)), ended("failed")):
        for size, verdict in (("1e-12", "better"), ("1e-10", "worse")):
            assert compare(report(old), report(with_metric(error(size))), policy).verdict == verdict


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
        assert {f.verdict for f in result.findings} == {Verdict.INCOMPARABLE}
        assert result.exit_code == 3


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
    assert finding.reason.startswith(f"the candidate ended as {outcome} at t = ")
    assert ("it hangs" in finding.reason) == (outcome not in MEASURED_IN_PART)
    assert compare(report(ended(outcome)), report(row()), Policy()).verdict == "better"
    assert compare(report(ended(outcome)), report(ended(outcome)), Policy()).verdict == "same"
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


def test_two_failures_of_different_kinds_are_incomparable() -> None:
    for pair in (("failed", "out_of_time"), ("non_finite", "failed"), ("step_limit", "non_finite")):
        for old, new in (pair, pair[::-1]):
            assert compare(report(ended(old)), report(ended(new)), Policy()).verdict == "incomparable"


@pytest.mark.parametrize(
    ("reached", "verdict"), [("30", "same"), ("28.6", "same"), ("28.4", "worse"), ("15", "worse"), ("60", "same")]
)
def test_a_run_that_stops_earlier_than_it_did_is_worse(reached: str, verdict: str) -> None:
    old, new = ended("step_limit"), ended("step_limit", time_reached=reached)
    assert compare(report(old), report(new), Policy()).verdict == verdict


def test_numbers_of_runs_that_stopped_alike_are_compared() -> None:
    old, new = (ended("step_limit", metrics={"drift_energy_max": error(size)}) for size in ("1e-12", "1e-10"))
    assert compare(report(old), report(new), Policy()).verdict == "worse"
    assert compare(report(new), report(old), Policy()).verdict == "better"


@pytest.mark.parametrize("word", ["nan", "missing"])
def test_what_neither_of_two_runs_that_stopped_reached_is_no_difference(word: str) -> None:
    metrics = {"drift_energy_max": error("1e-12"), "drift_energy_final": Metric(word, None)}
    stopped = ended("step_limit", metrics=metrics)
    result = compare(report(stopped), report(stopped), Policy())
    assert result.verdict == "same"
    assert result.sentences[1].startswith("1 row of heyoka failed in both reports on euler")
    assert compare(report(ended("step_limit")), report(stopped), Policy()).verdict == "incomparable"


def test_a_failure_of_another_motion_says_nothing_of_this_one() -> None:
    data = Data(("2", "2", "1"), "1", ("0", "0", "1"), ("0", "0", "1"), ("1", "0", "0"))
    other = msgspec.structs.replace(data, weight="2")
    assert compare(report(row(data=data)), report(ended("non_finite", data=other)), Policy()).exit_code == 3
    assert compare(report(row(data=data)), report(ended("non_finite", data=data)), Policy()).exit_code == 1
    assert compare(report(row(data=data)), report(ended("failed")), Policy()).exit_code == 1


def test_a_row_that_is_no_longer_finite_is_worse() -> None:
    assert compare(report(row()), report(row(finite=False)), Policy()).verdict == "worse"
    assert compare(report(row(finite=False)), report(row()), Policy()).verdict == "same"


def test_missing_and_new_rows_and_metrics() -> None:
    other = row(case="lagrange")
    result = compare(report(row(), other), report(row()), Policy())
    assert result.exit_code == 3
    assert [f.verdict for f in result.findings].count(Verdict.MISSING) == 1
    result = compare(report(row()), report(row(), other), Policy())
    assert result.exit_code == 0
    assert result.verdict == "same"
    less = row(metrics={"break_away_time": row().metrics["break_away_time"]})
    assert verdicts(row(), less)["drift_energy_max"] is Verdict.MISSING
    assert verdicts(less, row())["drift_energy_max"] is Verdict.NEW
    # another case is not the same row
    assert {f.verdict for f in compare(report(row()), report(other), Policy()).findings} == {
        Verdict.MISSING,
        Verdict.NEW,
    }


def test_durations_are_better_when_longer_and_never_is_longest() -> None:
    def at(value: str) -> Row:
        metric = Metric(value, None, "duration") if value == "never" else of_fraction(exact(value), "duration")
        return with_metric(metric, "break_away_time")

    name = "break_away_time"
    assert verdicts(row(), at("58"))[name] is Verdict.SAME
    assert verdicts(row(), at("50"))[name] is Verdict.WORSE
    assert verdicts(row(), at("62.9"))[name] is Verdict.SAME
    assert verdicts(row(), at("63.1"))[name] is Verdict.BETTER
    assert verdicts(row(), at("never"))[name] is Verdict.BETTER
    assert verdicts(at("never"), row())[name] is Verdict.WORSE
    assert verdicts(at("never"), at("never"))[name] is Verdict.SAME


def test_seconds_may_change_by_their_ratio_and_below_their_floor() -> None:
    def judged(old: float, new: float) -> Verdict:
        return judge_seconds(old, new, Timings())[0]

    assert [judged(1, new) for new in (1.49, 1.51)] == [Verdict.SAME, Verdict.WORSE]
    assert [judged(1.5, new) for new in (1.01, 0.99)] == [Verdict.SAME, Verdict.BETTER]
    assert [judged(0.001, new) for new in (0.149, 0.151)] == [Verdict.SAME, Verdict.WORSE]
    assert [judged(*pair) for pair in ((1, math.inf), (math.nan, 1))] == [Verdict.INCOMPARABLE] * 2


def test_a_value_that_must_agree_is_worse_in_either_direction() -> None:
    def value(text: str) -> Row:
        return with_metric(of_fraction(exact(text), "value"), "claim")

    assert verdicts(value("0.25"), value("0.2500000001"))["claim"] is Verdict.SAME
    assert verdicts(value("0.25"), value("0.26"))["claim"] is Verdict.WORSE
    assert verdicts(value("0.26"), value("0.25"))["claim"] is Verdict.WORSE


def test_worse_outranks_incomparable_and_environments_are_shown() -> None:
    old = report(row(), row(case="lagrange"))
    new = report(with_metric(error("1")), row(case="lagrange", outcome="step_limit", time_reached="1"))
    new.environment["packages"]["heyoka"] = "8"
    result = compare(old, new, Policy())
    assert result.exit_code == 1
    assert result.environment == [("packages.heyoka", "7", "8")]


def test_two_empty_reports_are_refused() -> None:
    with pytest.raises(InputError, match="nothing to compare"):
        compare(report(), report(), Policy())


def test_a_report_comes_back_from_disk_as_it_was(tmp_path: Path) -> None:
    store.write(report(row()), tmp_path)
    assert store.read(tmp_path) == report(row())
    assert store.read(tmp_path / "report.json") == report(row())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.json", "report.json.sha256"]


def edited(tmp_path: Path, old: bytes, new: bytes, *, keep_digest: bool = False) -> Path:
    path = store.write(report(row()), tmp_path)
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))
    if not keep_digest:
        (tmp_path / "report.json.sha256").unlink()
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b'"1E-12"', b'"1E-13"', "disagree"),
        (b'"log10":-12.0', b'"log10":null', "disagree"),
        (b'"time_reached":"100"', b'"time_reached":"99"', "a success that reached only 99"),
        (b'"1E-12"', b'"much"', "not a finite number"),
        (b'"value":"1E-12","log10":-12.0', b'"value":"nan","log10":null', "said to be finite"),
        (b"heavytop-report/2", b"other-report/7", "schema"),
        (b'"steps":10', b'"steps":"ten"', "not a whole report"),
        (b'"metrics"', b'"metric"', "not a whole report"),
    ],
)
def test_an_edited_report_is_refused(tmp_path: Path, old: bytes, new: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        store.read(edited(tmp_path, old, new))


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


def test_any_edit_is_refused_while_the_checksum_lies_beside_the_report(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="was changed since it was written"):
        store.read(edited(tmp_path, b'"steps":10', b'"steps":11', keep_digest=True))


@pytest.mark.parametrize("share", [0, 0.1, 0.5, 0.99])
def test_a_truncated_report_is_refused(tmp_path: Path, share: float) -> None:
    path = store.write(report(row()), tmp_path)
    (tmp_path / "report.json.sha256").unlink()
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    with pytest.raises(InputError, match="not a whole report"):
        store.read(path)


@pytest.mark.parametrize("content", [b"", b"[]", b'{"schema": 3}', b"\xff\xfe", b"null", b'{"rows": []}'])
def test_a_foreign_file_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "x.json"
    file.write_bytes(content)
    with pytest.raises(InputError):
        store.read(file)


def test_a_missing_report_and_a_row_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no report"):
        store.read(tmp_path)
    store.write(report(row(), row()), tmp_path)
    with pytest.raises(InputError, match="twice"):
        store.read(tmp_path)
    twice = report(with_metric(error("1E-12")), with_metric(error("1E-3")))
    with pytest.raises(InputError, match=r"candidate holds the row .* twice"):
        ht.compare(report(row()), twice)
    with pytest.raises(InputError, match=r"holds the row .* twice"):
        ht.history([report(row()), twice])


@pytest.mark.parametrize(
    ("value", "expected"),
    [("1.2345e-997", "1.23e-997"), ("0", "0"), ("nan", "nan"), ("0.1739", "0.1739"), ("-5", "-5")],
)
def test_short_numbers_for_tables(value: str, expected: str) -> None:
    assert short(value) == expected


def test_an_unresolved_error_is_at_most_its_bound_and_never_better() -> None:
    def unresolved(bound: str | None) -> Row:
        return with_metric(Metric("unresolved", None, "error", bound))

    name = "drift_energy_max"
    assert verdicts(row(), unresolved("1e-13"))[name] is Verdict.SAME
    assert verdicts(row(), unresolved("1"))[name] is Verdict.INCOMPARABLE
    assert verdicts(row(), unresolved(None))[name] is Verdict.INCOMPARABLE
    assert verdicts(unresolved("1e-13"), row())[name] is Verdict.WORSE
    assert verdicts(unresolved("1e-11"), row())[name] is Verdict.SAME


def test_a_duration_may_start_from_0() -> None:
    zero = with_metric(of_fraction(exact("0"), "duration"), "break_away_time")
    assert verdicts(zero, row())["break_away_time"] is Verdict.BETTER
    assert verdicts(zero, zero)["break_away_time"] is Verdict.SAME


@pytest.mark.parametrize(
    "change",
    [
        {"bits": 10**12},
        {"bits": -1},
        {"measure": "homoclinic", "metrics": {}},
        {"measure": "claim_evaluation"},
        {"series": {"drift_energy": Series(["1", "2"], ["1e-12"])}},
        {"metrics": {"drift_energy_max": Metric("never", None)}},
        {"metrics": {"break_away_time": Metric("unresolved", None, "duration")}},
        {"steps": -1},
        {"seconds": {"run": -0.5}},
        {"seconds": {"run": float("inf")}},
        {"order": -1},
        {"evaluations": -1},
        {"outcome": "fine"},
        {"bits": 0},
        {"time_reached": "101"},
        {"outcome": "step_limit", "time_reached": "101"},
        {"outcome": "step_limit", "time_reached": "-1"},
        {"horizon": "x"},
        {"laws": {"energy": Law("t", 8, 1.0, 1.1, 0.9)}},
        {"laws": {"energy": Law("t", 8, 1.0, 0.9)}},
        {"laws": {"energy": Law("t", 8, None, 0.9, 1.1)}},
        {"laws": {"energy": Law("t", 8, 1.0, detects="-1e-19")}},
        {"laws": {"energy": Law("t", 8, 1.0, lost_at="soon")}},
        {"laws": {"energy": Law("t", -8, 1.0)}},
        {"metrics": {"drift_energy_max": Metric("-1e-12", -12.0)}},
        {"metrics": {"drift_energy_max": Metric("unresolved", None, "error", "-1e-12")}},
        {"series": {"drift_energy": Series(["soon"], ["1e-12"])}},
        {"series": {"drift_energy": Series(["1"], ["little"])}},
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
