"""Work against precision: the errors are true, a run that aborts is a failure, bad ladders are refused."""

from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import pytest

from heavytop.cases import CASES
from heavytop.errors import InputError
from heavytop.exact.catalogue import find
from heavytop.exact.flint.balls import midpoint
from heavytop.features.work_precision import kind as work_precision
from heavytop.features.work_precision.curves import panels
from heavytop.integrate.peers.scipy_ivp import dop853
from heavytop.integrate.trajectory import Problem
from heavytop.measure.integrator import Repeats
from heavytop.precision import DOUBLE, exact
from heavytop.report.compare.noise import Policy
from support.reports import compare, measure, tasks_of
from support.small_reports import report

HEAD = '[[measure]]\nkind = "work_precision"\n'


@pytest.fixture(autouse=True)
def few_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work_precision, "_USUAL", Repeats(2, 2, 0.0))


def rows(tmp_path: Path, case: str, horizon: str, *ladders: str, samples: int = 10) -> list:
    text = f'cases = ["{case}"]\nhorizon = "{horizon}"\nsamples = {samples}\nladders = [{", ".join(ladders)}]\n'
    return [measure(task) for task in tasks_of(tmp_path, HEAD + text)]


def error(row, name: str) -> float:
    return float(row.metrics[name].value)


@pytest.mark.slow
def test_the_error_is_the_distance_from_the_closed_form(tmp_path: Path) -> None:
    (row,) = rows(tmp_path, "lagrange", "20", '{ integrator = "scipy:DOP853", tolerances = ["1e-6"] }')
    case = CASES["lagrange"]
    problem = Problem.of(case.top, case.start, DOUBLE)
    known = find(problem.top, problem.start)
    times = [Fraction(2 * i) for i in range(1, 11)]
    run = dop853(case.top, case.start, times, tolerance=Fraction(1, 10**6))
    off = [
        max(abs(exact(value) - midpoint(true)) for value, true in zip(state, known.state(time, 120), strict=True))
        for time, state in zip(run.times, run.states, strict=True)
    ]
    assert error(row, "error_final") == pytest.approx(float(off[-1]), rel=1e-6)
    assert error(row, "error_max") == pytest.approx(float(max(off)), rel=1e-6)
    assert row.against.startswith("known: closed form: Lagrange")
    assert (row.case, row.integrator) == ("lagrange/T=20", "scipy:DOP853 tolerance=1e-6")
    assert row.steps > 10
    assert row.evaluations > 12 * row.steps
    assert row.seconds.keys() == {"compile", "run", "least", "repeats"}
    assert row.seconds["least"] <= row.seconds["run"]


@pytest.mark.slow
def test_finer_rungs_err_less_and_every_format_has_its_floor(tmp_path: Path) -> None:
    ladders = [
        '{ integrator = "heyoka", tolerances = ["1e-6", "1e-9", "eps"] }',
        '{ integrator = "heyoka", precision = "quad", tolerances = ["1e-20", "eps"] }',
    ]
    found = rows(tmp_path, "pendulum", "10", *ladders)
    errors = [error(row, "error_max") for row in found]
    assert all(fine < coarse / 100 for coarse, fine in pairwise(errors))
    assert errors[2] < 1e-13
    assert errors[4] < 1e-30
    assert len({row.key for row in found}) == len(found)
    for row in found:
        assert error(row, "return_error") < 1000 * error(row, "error_max")
    assert compare(report(*found), report(*found), Policy()).verdict == "same"


@pytest.mark.slow
def test_the_way_back_of_a_symmetric_method_says_nothing_about_its_error(tmp_path: Path) -> None:
    ladders = [
        '{ integrator = "splitting:4", steps = ["1/4"] }',
        '{ integrator = "scipy:LSODA", tolerances = ["1e-6"] }',
    ]
    splitting, lsoda = rows(tmp_path, "generic", "20", *ladders)
    assert error(splitting, "error_max") > 1e-6
    assert error(splitting, "return_error") < 1e-12
    assert error(lsoda, "error_max") / 100 < error(lsoda, "return_error") < error(lsoda, "error_max") * 100


def test_a_run_that_gives_up_is_a_failure_and_no_point(tmp_path: Path) -> None:
    pytest.importorskip("sksundae")
    (row,) = found = rows(tmp_path, "lagrange", "20", '{ integrator = "sundials:CVODE", tolerances = ["1e-16"] }')
    assert row.outcome == "step_too_small"
    assert not row.finite
    assert 5 < float(row.time_reached) < 10
    assert row.metrics["error_final"].value == row.metrics["return_error"].value == "missing"
    assert error(row, "error_max") < 1e-10
    (line,) = panels(found)["lagrange/T=20"]
    assert (line.points, len(line.failures)) == ([], 1)


@pytest.mark.slow
def test_without_a_reference_there_is_no_error(tmp_path: Path) -> None:
    (row,) = found = rows(tmp_path, "generic", "3000", '{ integrator = "heyoka", tolerances = ["1e-6"] }', samples=1)
    assert "no reference" in row.against
    assert {"drift_energy_max", "return_error"} <= row.metrics.keys()
    assert not {"error_final", "error_max"} & row.metrics.keys()
    assert not panels(found)["generic/T=3000"][0].points


@pytest.mark.slow
def test_a_rotor_has_no_way_back(tmp_path: Path) -> None:
    (row,) = rows(tmp_path, "gyrostat", "5", '{ integrator = "splitting:2", steps = ["1/50"] }')
    assert "return_error" not in row.metrics
    assert 1e-6 < error(row, "error_max") < 1e-2


@pytest.mark.parametrize(
    ("ladder", "message"),
    [
        ('{ integrator = "rk4", tolerances = ["1e-6"] }', "Unknown integrator 'rk4'"),
        ('{ integrator = "heyoka" }', "The list of points of heyoka is empty"),
        ('{ integrator = "heyoka", tolerances = ["0"] }', "tolerances must be above 0, up to 1; got '0'"),
        ('{ integrator = "heyoka", tolerances = ["small"] }', "'small' is not a finite number"),
        ('{ integrator = "heyoka", precision = "half", tolerances = ["1e-3"] }', "Unknown precision 'half'"),
        ('{ integrator = "heyoka", tolerances = ["1e-6", "1e-6"] }', "twice"),
        ('{ integrator = "heyoka", tolerance = "1e-6" }', "unknown field"),
    ],
)
def test_a_ladder_that_leads_nowhere_is_refused(ladder: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        tasks_of(tmp_path, HEAD + f'cases = ["euler"]\nhorizon = "10"\nladders = [{ladder}]\n')
