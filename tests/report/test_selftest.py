"""The detectors see what they should, and raise no alarm at a healthy run."""

from pathlib import Path

import pytest

from heavytop.api import selftest

pytestmark = pytest.mark.slow

PLAN = """
name = "small"
[[measure]]
kind = "drift"
cases = ["lagrange", "kovalevskaya"]
runs = [{ precision = "double", horizon = "20", samples = 20 }]
[[measure]]
kind = "local_error"
cases = ["kovalevskaya"]
precisions = ["double"]
horizon = "2"
"""


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    file = Path(tmp_path_factory.mktemp("plan") / "small.toml")
    file.write_text(PLAN, "utf-8")
    found = selftest.trials(selftest.tasks(str(file)), 1, lambda _: None)
    return {trial.fault: trial for trial in found}


def test_a_healthy_run_with_other_roundings_is_the_same(trials) -> None:
    control = trials[selftest.CONTROL]
    assert (control.verdict, control.caught_by, control.as_expected) == ("same", [], True)


@pytest.mark.parametrize(
    "fault", ["sign", "coefficient", "tolerance", "order", "axes", "frozen", "nan", "stop", "silent stop"]
)
def test_a_wrong_motion_or_one_that_ends_is_worse(trials, fault) -> None:
    assert trials[fault].verdict == "worse"
    assert trials[fault].as_expected


def test_one_order_less_is_caught_by_the_observed_order(trials) -> None:
    assert "local_error: observed_order" in dict(trials["order"].caught_by)


def test_what_is_not_caught_says_how_far_it_moved(trials) -> None:
    trial = trials["summation"]
    assert (trial.verdict, trial.caught_by, trial.as_expected) == ("same", [], True)
    assert trial.shift is not None
    assert trial.shift[1] > 0
