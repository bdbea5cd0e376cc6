"""A finished run as a function of the time, and its attitudes as SciPy has them."""

import copy
import pickle
import sys

import numpy as np
import pytest

import heavytop as ht
from support.helpers import START, TOP

TIMES = [0.3, 1.7, 4.0]
BODY = ht.Body("2", "9.81", ("0.1", "0", "0.3"), (1, 2, "1.5", "0.1", "-0.1", "0.2"), "pivot")
SPINNING = ht.State(omega=(1, 2, 3), attitude=ht.Attitude.axis_angle((1, 2, 3), "0.7"))


@pytest.mark.parametrize(
    ("form", "integrator"), [("double", "heyoka"), ("double-double", "multiword"), ("real:150", "multiword")]
)
@pytest.mark.parametrize("sign", [1, -1])
def test_between_samples_a_run_is_what_a_run_to_there_gives(form: str, integrator: str, sign: int) -> None:
    last = ht.propagate(TOP, START, [sign * 5], form, integrator=integrator)
    there = ht.propagate(TOP, START, [sign * time for time in TIMES], form, integrator=integrator)
    eps = float(ht.Precision.eps.fget(last.problem.precision))  # type: ignore[attr-defined]
    assert np.abs(last([sign * time for time in TIMES]).T - there.states).max() <= 4 * eps
    assert list(last(0)) == list(ht.propagate(TOP, START, [0, sign], form, integrator=integrator).states[0])


def test_it_is_in_the_axes_of_the_body_and_of_the_run_with_its_attitude() -> None:
    run = ht.propagate(BODY, SPINNING, TIMES)
    assert np.abs(run(TIMES).T - run.states).max() <= 1e-15 * np.abs(run.states).max() * 4
    assert run(1.7).shape == (6,)


@pytest.mark.parametrize(
    ("time", "integrator", "words"),
    [
        (4.1, "heyoka", "is outside the run"),
        (-1, "heyoka", "outside the run"),
        (1, "scipy:DOP853", "has no dense output"),
    ],
)
def test_it_says_where_it_is_not_defined(time: float, integrator: str, words: str) -> None:
    run = ht.propagate(TOP, START, TIMES, integrator=integrator)
    with pytest.raises(ht.InputError, match=words):
        run(time)


def test_an_equilibrium_stays() -> None:
    run = ht.propagate(ht.HeavyTop((3, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 0), (0, 0, 1)), [5])
    assert list(run(2.5)) == [0, 0, 0, 0, 0, 1]


def test_attitudes_go_to_scipy_and_back(monkeypatch: pytest.MonkeyPatch) -> None:
    run = ht.propagate(BODY, SPINNING, TIMES)
    rotations = run.rotations()
    assert np.abs(rotations.as_matrix() - run.matrices()).max() < 1e-15
    start = ht.State(omega=(1, 2, 3), attitude=ht.Attitude.rotation(rotations[1]))
    assert np.abs(ht.propagate(BODY, start, [0, 1]).matrices()[0] - run.matrices()[1]).max() < 1e-15
    with pytest.raises(ht.InputError, match="must be a single Rotation"):
        ht.Attitude.rotation(rotations)
    monkeypatch.setitem(sys.modules, "scipy.spatial.transform", None)
    with pytest.raises(ht.InputError, match=r"Rotations need SciPy.\s+Install it"):
        run.rotations()


@pytest.mark.parametrize("precision", ["double", "extended", "quad", "real:200"])
@pytest.mark.parametrize("change", [copy.copy, copy.deepcopy, lambda run: pickle.loads(pickle.dumps(run))])
def test_a_run_comes_back_from_another_process_whole(change, precision: str) -> None:
    run = ht.propagate(TOP, START, [1, 2], precision, attitude=True)
    again = change(run)
    assert again.texts() == run.texts()
    assert again.texts("quaternion") == run.texts("quaternion")
    assert (again(0.3) == run(0.3)).all()
    assert change(again).texts() == run.texts()


def test_records_with_arrays_are_equal_only_to_themselves() -> None:
    """As a ``Trajectory`` is: an array has no truth value to compare records by."""
    for record in (ht.Integrator(TOP).propagate(START, [1, 2]), ht.power(TOP, START, 1, "1e-3")):
        assert record == record
        assert record != copy.deepcopy(record)
        assert len({record, copy.deepcopy(record)}) == 2
