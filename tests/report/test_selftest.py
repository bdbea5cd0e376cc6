"""The detectors see what they should, and raise no alarm at a healthy run."""

import pickle

import pytest

from heavytop.api import selftest
from support.reports import drift, plan_file

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    steps = '[[measure]]\nkind = "local_error"\ncases = ["kovalevskaya"]\nprecisions = ["double"]\nhorizon = "2"\n'
    text = drift("lagrange", "kovalevskaya", runs=[("double", "20", 20)]) + steps
    found = selftest.trials(selftest.tasks(plan_file(tmp_path_factory.mktemp("plan"), text)), 1, lambda _: None)
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
    assert fault != "order" or "local_error: observed_order" in dict(trials[fault].caught_by)


def test_what_is_not_caught_says_how_far_it_moved(trials) -> None:
    trial = trials["summation"]
    assert (trial.verdict, trial.caught_by, trial.as_expected) == ("same", [], True)
    assert trial.shift is not None
    assert trial.shift[1] > 0


def test_every_task_reaches_a_worker() -> None:
    tasks = selftest.tasks()
    for task, sent in zip(tasks, pickle.loads(pickle.dumps(tasks)), strict=True):
        assert sent.source == task.source
        assert sent.key == task.key
