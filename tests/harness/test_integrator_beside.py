"""Another integrator beside heyoka: in any plan, in the gate, and in every kind of measurement."""

from __future__ import annotations

from pathlib import Path

import pytest

import heavytop as ht
from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import read
from heavytop.harness.rows import measure as measured
from heavytop.report.render.text import failed
from support.reports import asked, drift, measure, plan_file

LADDERS = [{"integrator": "heyoka", "tolerances": ["1e-6", "eps"]}, {"integrator": "splitting:2", "steps": ["1/9"]}]
OTHERS = (
    asked("homoclinic", "delone", precisions=["double"], directions=["forward"])
    + asked("local_error", "euler", precisions=["double"], horizon="2")
    + asked("work_precision", "euler", horizon="4", samples=4, ladders=LADDERS)
)
GROWTH = asked(
    "growth", "euler", runs=[{"precision": "double", "horizon": "4", "starts": 8, "samples": 4, "decades": 1}]
)


@pytest.fixture
def plan(tmp_path: Path) -> str:
    return plan_file(tmp_path, drift("euler", runs=[("double", "4", 8)]) + OTHERS + GROWTH)


def labels(name: str, integrator: str = "") -> list[tuple[str, str, str]]:
    subjects = [(task.key.kind, task.key.subject) for task in read(name, KINDS, integrator=integrator)[2]]
    return [(kind, subject.name, subject.setting) for kind, subject in subjects]


def test_whatever_heyoka_measures_is_measured_beside_it(plan: str) -> None:
    before, after = labels(plan), labels(plan, "multiword")
    assert after[: len(before)] == before
    assert after[len(before) :] == [
        ("drift", "multiword", ""),
        ("homoclinic", "multiword", ""),
        ("local_error", "multiword", ""),
        *(("work_precision", "multiword", f"tolerance={each}") for each in ("1e-6", "1e-9", "1e-12", "eps")),
        ("growth", "multiword", ""),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["multiword", "splitting:8"])
def test_its_rows_are_scored_like_those_of_heyoka(plan: str, integrator: str) -> None:
    tasks = read(plan, KINDS, integrator=integrator)[2]
    rows = [measure(task) for task in tasks if task.key.subject.name == integrator]
    assert [row.outcome for row in rows] == ["success"] * 8
    assert all(row.finite and row.reference.how == "proven" for row in rows)
    assert all(row.integrator.startswith(integrator) for row in rows)
    kept = float(rows[0].metrics["solution_error_relative_max"])
    assert kept < (1e-15 if integrator == "multiword" else 1e-8)


def test_a_format_that_it_lacks_is_unsupported_and_no_failure(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, drift("euler", runs=[("quad", "1", 100)]))
    _, theirs = read(plan, KINDS, integrator="scipy:DOP853")[2]
    row = measured(KINDS[theirs.key.kind], theirs, Saved())
    assert (row.outcome, row.metrics) == ("unsupported", {})
    assert row.reference.reason.startswith("scipy:DOP853 does not support quad")
    assert not failed(row, KINDS)
    assert ht.Report("heavytop-report/2", {}, {}, [row]).verdict == "complete"


@pytest.mark.parametrize("integrator", ["multiword", "splitting:8"])
def test_an_option_of_heyoka_that_it_lacks_fails_its_own_row(tmp_path: Path, integrator: str) -> None:
    plan = plan_file(tmp_path, GROWTH.replace("starts = 8", "starts = 8, high_accuracy = true"))
    _, theirs = read(plan, KINDS, integrator=integrator)[2]
    row = measure(theirs)
    assert (row.outcome, row.metrics) == ("failed", {})
    assert f"{integrator} does not support high_accuracy" in row.reference.reason


def test_the_gate_measures_every_thing_that_a_gate_asks() -> None:
    kinds = {kind for kind, name, _ in labels("gate", "splitting:4") if name == "splitting:4"}
    assert kinds == {"drift", "homoclinic", "local_error", "work_precision", "growth"}
    settings = {setting for _, name, setting in labels("growth", "splitting:4") if name == "splitting:4"}
    assert settings == {""}  # no tolerance


def test_who_stands_beside_heyoka_is_another_that_is_known(plan: str, tmp_path: Path) -> None:
    audit = '[[measure]]\nkind = "audit"\nclaims = ["ershkov-partial"]\nsystems = ["gyrostat"]\n'
    (tmp_path / "claims").mkdir()
    for name, integrator, cause in (
        (plan, "heyoka", "what others are compared with"),
        (plan, "rk4", "Unknown integrator"),
        (plan_file(tmp_path / "claims", audit), "multiword", "does not measure heyoka"),
    ):
        with pytest.raises(InputError, match=cause) as caught:
            read(name, KINDS, integrator=integrator)
        assert caught.value.remedy
