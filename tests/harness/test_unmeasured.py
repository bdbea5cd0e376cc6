"""A row that cannot be known: an outcome of its own, never the same as another, and the other rows are there."""

from pathlib import Path

import pytest

from heavytop.errors import Contradiction, InputError, OutOfReach
from heavytop.harness.rows import unmeasured
from heavytop.measure import truth
from heavytop.report.compare.noise import Policy
from support.helpers import without_progress
from support.in_process import heavytop
from support.reports import all_good, asked, compare, drift, plan_file, replace, rows, store, table, tasks_of

PLAN = drift("euler", runs=[("double", "5", 5)])
CASE, TIMES = "ershkov-partial-2", ["1", "1e100"]
FAR = asked("claim_model", CASE, times=TIMES, directions=["backward"], grid=1)
FAR += asked("claim_evaluation", CASE, precisions=["double"], rate_times=TIMES, directions=["forward"])


@pytest.mark.slow
def test_a_plan_with_rows_out_of_reach_ends_with_all_others_and_exit_3(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, PLAN + FAR)
    done = heavytop("run", "--plan", plan, "--out", tmp_path / "out", "--workers", 1)
    assert (done.returncode, without_progress(done.stderr)) == (3, "")
    said = " ".join(done.stdout.split())
    assert "claim_model of ershkov-partial-2/backward, claim:smooth in exact: out_of_reach" in said
    assert "Only 0 of 160 bits could be proven" in said
    report = store.read(tmp_path / "out")
    lost = [row for row in report.rows if row.outcome == "out_of_reach"]
    assert [(row.measure, row.integrator) for row in lost] == [
        ("claim_model", "claim:smooth"),
        ("claim_evaluation", "formula:printed"),
    ]
    assert [row.outcome for row in report.rows if row not in lost] == ["success", "success"]
    assert not any(row.finite or row.metrics for row in lost)
    assert "Only 0 of 160 bits" in (tmp_path / "out" / "report.html").read_text()
    comparison = compare(report, report, Policy())
    assert comparison.exit_code == 3
    assert {finding.row for finding in comparison.changed} == {row.identity for row in lost}
    assert heavytop("show", tmp_path / "out").returncode == 0


@pytest.mark.slow
def test_a_row_out_of_reach_has_the_key_that_it_has_within(tmp_path: Path) -> None:
    far, near = (tasks_of(tmp_path, PLAN + FAR.replace("1e100", end)) for end in ("1e100", "2"))
    keys, others = (
        [row.identity.elsewhere for _, row in sorted(rows(tasks, 1, None), key=lambda pair: pair[0])]
        for tasks in (far, near)
    )
    assert keys == others


def test_a_contradiction_is_the_outcome_of_its_row_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def contradict(*_, **__):
        raise Contradiction("Two sources exclude each other.")

    truth.known_motion.cache_clear()
    monkeypatch.setattr(truth, "certify", contradict)
    ((_, row),) = rows(tasks_of(tmp_path, PLAN), 1, None)
    assert (row.outcome, row.against) == ("contradiction", "nothing: Two sources exclude each other.")
    key = row.key
    named = (key.kind, key.case, key.system, key.subject.name, key.precision)
    assert named == ("drift", "euler", "heavy_top", "heyoka", "double")


def test_steps_of_a_top_at_rest_are_out_of_reach(tmp_path: Path) -> None:
    up = [0, 0, 1]
    rest = table("top", name="rest", inertia=[3, 2, 1], weight=1, centre=up, omega=[0, 0, 0], gamma=up)
    steps = asked("local_error", "rest", precisions=["double"], horizon="1")
    ((_, row),) = rows(tasks_of(tmp_path, rest + steps), 1, None)
    assert (row.outcome, row.metrics) == ("out_of_reach", {})
    assert row.against == "nothing: rest is an equilibrium, which takes no steps."


def test_a_peer_that_gives_up_is_no_failure_but_a_row_that_came_to_nothing_is_one(tmp_path: Path) -> None:
    ladders = [{"integrator": "heyoka", "tolerances": ["eps"]}]
    (task,) = tasks_of(tmp_path, asked("work_precision", "euler", horizon="5", ladders=ladders))
    row = unmeasured(task, OutOfReach("Nothing is known there."))
    assert row.identity[1:] == ("euler/T=5", "heyoka tolerance=eps", ())
    assert (row.measure, row.system, row.precision) == ("work_precision", "heavy_top", "double")
    assert not all_good([row])
    assert all_good([replace(row, outcome="step_limit")])


def test_what_only_measuring_shows_to_be_impossible_names_the_row(tmp_path: Path) -> None:
    upright = {key: ["0", "0", "1"] for key in ("centre", "omega", "gamma")}
    sweep = table("sweep", kind="grid", name="g", inertia=["3", "2", "2"], weight=["1", "1e-400"], **upright)
    tasks = tasks_of(tmp_path, sweep + drift("sweep:g"))
    with pytest.raises(InputError, match=r"^drift g\[1\] double: 1E-400 is outside the exponent range of double"):
        list(rows(tasks, 1, None))
