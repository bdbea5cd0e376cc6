"""Rows of drift with the attitude: its error and that of the centre of mass, and bands of tops with a rotor."""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import heavytop as ht
from support.reports import asked, drift, measure, plan_file, table, tasks_of

BODY = {"about": "pivot", "centre": ["0.1", "-0.2", "0.3"], "inertia": ["0.7", "0.7", "0.9", "0.1", "-0.05", "0.02"]}
SPINNER = {"centre": ["0", "0", "0"], "inertia": ["350", "300", "400"], "rotor": ["3500", "0", "0"]}
TOPS = table(
    "top", name="tilted", mass="2", gravity="9.81", **BODY, omega=["1", "2", "-3"], euler="ZYX:30deg,0.2,1"
) + table(
    "top", name="spinner", mass="1", gravity="0", **SPINNER, omega=["61", "1", "1"], quaternion=["1", "0", "0", "0"]
)


def plan(integrator: str = "heyoka", attitude: bool = True) -> str:
    return TOPS + drift("tilted", "spinner", attitude=attitude, integrator=integrator, runs=[("double", "2", 20)])


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., dict[str, Any]]:
    """The row of each case with an integrator, in double; each measured once."""

    @cache
    def measured(integrator: str, attitude: bool) -> dict[str, Any]:
        tasks = tasks_of(tmp_path_factory.mktemp("rows"), plan(integrator, attitude))
        return {task.key.case: measure(task) for task in tasks}

    return measured


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["heyoka", "multiword"])
def test_the_attitude_and_the_position_are_measured_as_far_as_they_are_there(
    rows: Callable[..., dict[str, Any]], integrator: str
) -> None:
    assert rows(integrator, True).keys() == {"tilted", "spinner"}
    for case, row in rows(integrator, True).items():
        assert row.outcome == "success"
        for name in ("attitude_error", *(["position_error"] if case == "tilted" else [])):
            assert 0 < float(row.metrics[f"{name}_max"].value) < 500 * 2.0**-52
        assert ("position_error_max" in row.metrics) == (case == "tilted")
        assert len(row.series["attitude_error"].values) > 3


@pytest.mark.slow
def test_the_states_are_those_of_a_run_without_attitude_to_rounding(rows: Callable[..., dict[str, Any]]) -> None:
    with_it, without = (rows("heyoka", flag) for flag in (True, False))
    assert without.keys() == {"tilted", "spinner"}
    for key, row in without.items():
        assert "attitude_error_max" not in row.metrics
        assert set(row.metrics) < set(with_it[key].metrics)


@pytest.mark.slow
def test_the_band_of_a_body_with_a_rotor_is_rounding_noise(tmp_path: Path) -> None:
    """Reruns scale the rotor with the moments: else they are other motions, with bands of many decades."""
    report = ht.run(plan_file(tmp_path, plan()), out=tmp_path / "out", workers=1)
    (row,) = (each for each in report.rows if each.case == "spinner")
    bands = [
        metric.band for name, metric in row.metrics.items() if name.startswith(("drift", "solution")) and metric.band
    ]
    assert bands
    assert max(bands) < 2
    report = ht.read_report(tmp_path / "out")
    assert ht.compare(report, report).verdict == "same"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('about = "pivot"\n', "", "reference point of the inertia tensor"),
        ('mass = "2"\n', 'mass = "2"\nweight = "3"\n', "weight and mass"),
        ("ZYX:", "ZYY:", "ZYY"),
        ('omega = ["1", "2", "-3"]', 'gamma = ["0", "0", "1"]', "got neither"),
        ('gravity = "9.81"\n', "", "gravity is missing"),
    ],
)
def test_a_body_that_is_none_is_refused_by_the_name_of_its_top(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    file = plan_file(tmp_path, plan().replace(old, new, 1))
    with pytest.raises(ht.InputError, match=message) as refused:
        ht.run(file, out=tmp_path / "out")
    assert "'tilted'" in str(refused.value)
    assert not (tmp_path / "out").exists()


def test_a_plan_reads_the_body_exactly(tmp_path: Path) -> None:
    task = next(iter(tasks_of(tmp_path, plan(attitude=False))))
    assert task.case is not None
    assert task.case.body is not None
    assert task.case.body.tensor[0] == (Fraction(7, 10), Fraction(1, 10), Fraction(-1, 20))
    assert sum(g * g for g in task.case.start.gamma) == 1


LONG = {"precision": "double", "horizon": "1e4", "starts": 8, "samples": 8, "decades": 3, "attitude": True}


@pytest.mark.slow
def test_the_errors_of_attitude_and_position_have_laws(tmp_path: Path) -> None:
    growth = asked("growth", "lagrange", runs=[LONG, LONG | {"bias": "1e-9"}])
    plain, biased = ht.run(plan_file(tmp_path, growth), out=tmp_path / "out", workers=1).rows
    for name in ("attitude_error", "position_error"):
        law = plain.laws[name]
        assert law.low <= 1.5 <= law.high  # rounding noise that adds up to a phase
        assert biased.laws[name].growth == "t"  # a frequency off by a constant
        assert 0 < float(plain.metrics[f"{name}_max"].value) < 1e-9 < float(biased.metrics[f"{name}_max"].value)
