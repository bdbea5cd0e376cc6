"""Rows of the default plan: what they must show."""

import math
from dataclasses import replace
from fractions import Fraction

import msgspec
import pytest

from heavytop.features.homoclinic.break_away_law import break_away_law
from heavytop.harness.rows import Task
from heavytop.integrate import registry
from heavytop.integrate.heyoka import motions
from support.reports import expand, load, measure

TASKS = expand(load("default")[0])


def task(label: str) -> Task:
    (found,) = [each for each in TASKS if each.label == label]
    return found


@pytest.mark.slow
def test_the_break_away_time_grows_linearly_with_the_bits() -> None:
    rate = 1.25 / math.sqrt(2)
    labels = [f"homoclinic delone/forward {name}" for name in ("double", "extended", "quad", "real:237")]
    rows = [measure(task(label)) for label in labels]
    (law,) = break_away_law(rows)
    slope = float(Fraction(law.metrics["break_away_slope"].value))
    assert slope == pytest.approx(math.log(2) / rate, rel=0.1)
    for row in rows:
        assert row.outcome == "success"
        assert row.against.startswith("known: closed form")
        # pairs of formats lie on one line: no format keeps to the saddle longer than its bits allow
        time = float(Fraction(row.metrics["break_away_time"].value))
        assert row.bits * math.log(2) / rate * 0.6 < time < row.bits * math.log(2) / rate


@pytest.mark.slow
def test_a_failed_member_is_left_out_of_the_law() -> None:
    row = measure(task("homoclinic delone/forward double"))
    failed = msgspec.structs.replace(measure(task("homoclinic delone/forward extended")), outcome="step_limit")
    assert break_away_law([row, failed]) == []


@pytest.mark.slow
def test_the_long_run_of_euler_is_held_against_its_closed_form() -> None:
    row = measure(task("drift euler double"))
    assert row.against.startswith("known: closed form: Euler-Poinsot")
    assert "certified at t = 100000 to" in row.against
    error = Fraction(row.metrics["solution_error_omega_max"].value)
    drift = Fraction(row.metrics["drift_energy_max"].value)
    assert drift < Fraction(1, 10**12) < error < Fraction(1, 10**6)
    assert len(row.series["solution_error_along"].times) == len(row.series["drift_energy"].times) > 20


def test_printed_formulas_that_die_are_said_not_to_be_finite() -> None:
    row = measure(task("claim_evaluation ershkov-partial-2/backward formula:printed double"))
    assert row.finite is False
    assert row.metrics["claim_evaluation_omega_not_finite_from"].value == "710"
    assert int(row.metrics["claim_evaluation_psi_samples_not_finite"].value) > 10
    stable = measure(task("claim_evaluation ershkov-partial-2/backward formula:stable double"))
    assert stable.finite is True
    assert stable.metrics["claim_evaluation_psi_not_finite_from"].value == "never"


@pytest.mark.slow
def test_the_verdict_on_the_claim_is_a_row() -> None:
    row = measure(task("audit ershkov-partial heavy_top"))
    refuted = {name for name, metric in row.metrics.items() if metric.value == "0" and " smooth " in name}
    assert {name.split()[0] for name in refuted} == {"(1.2).1", "(1.2).3", "(3.1).2"}
    row = measure(task("audit ershkov-partial gyrostat"))
    assert {metric.value for metric in row.metrics.values()} == {"1"}


@pytest.mark.slow
def test_a_run_that_fails_is_a_row_with_its_outcome(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "MOST_STEPS", 10**400)  # so that what overflows is tried
    monkeypatch.setattr(motions, "_FASTEST", 10**400)  # and in the unit of time given
    given = task("drift lagrange double")
    assert given.case is not None
    wild = replace(given.case.start, omega=(Fraction(10) ** 140, Fraction(10) ** 140, Fraction(1)))
    row = measure(replace(given, case=replace(given.case, start=wild)))
    assert row.outcome == "non_finite"
    assert row.finite is False
    assert row.time_reached == "0"
    assert {(metric.value, metric.band) for metric in row.metrics.values()} == {("missing", None)}
