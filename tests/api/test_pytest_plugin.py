"""The fixture heavytop_gate in a test session of somebody else."""

from pathlib import Path

import pytest

import heavytop as ht
from heavytop.cases import case
from heavytop.errors import InputError
from heavytop.pytest_plugin import gate
from support.helpers import python
from support.midpoint import MIDPOINT

TESTS = (
    MIDPOINT.format(name="solve")
    + """
import sys


def Solved(*given):
    from heavytop.integrate.peers.double import Solved

    return Solved(*given)


def test_nothing_is_loaded_before_it_is_used():
    assert "heavytop.api" not in sys.modules
    assert "heyoka" not in sys.modules


def test_a_good_integrator_passes(heavytop_gate):
    assert heavytop_gate(solve, case="lagrange", times=[1, 2]).digits_right >= 2


def test_a_bad_one_fails(heavytop_gate):
    assert heavytop_gate(solve, case="lagrange", times=[1, 2]).digits_right >= 5
"""
)


@pytest.mark.slow
def test_a_session_passes_and_fails_and_says_what_went_wrong(tmp_path: Path) -> None:
    (tmp_path / "test_gate.py").write_text(TESTS)
    done = python("-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", tmp_path, cwd=tmp_path)
    assert "1 failed, 2 passed" in done.stdout, done.stdout + done.stderr
    assert ">= 5 digits right" in done.stdout
    assert "largest drift: " in done.stdout
    assert "Full diff" not in done.stdout


def test_states_are_scored_with_their_times_and_not_without() -> None:
    known = case("euler")
    run = ht.propagate(known.top, known.start, [1, 2, 3])
    assert gate(run.states, "euler", times=[1, 2, 3]).digits_right > 14
    assert gate(run, "euler").digits_right > 14
    with pytest.raises(InputError, match="without their times"):
        gate(run.states, "euler")


def test_arguments_that_states_do_not_need_are_refused() -> None:
    known = case("euler")
    run = ht.propagate(known.top, known.start, [1, 2])
    for states, times, unused in (
        (run, None, {"tolerance": "1e-9"}),
        (run.states, [1, 2], {"step": 1}),
        (run, [3], {}),
    ):
        with pytest.raises(ht.InputError, match="given with"):
            gate(states, "euler", times=times, **unused)


def test_a_trajectory_is_scored_in_its_own_format() -> None:
    lagrange = case("lagrange")
    run = ht.propagate(lagrange.top, lagrange.start, [1, 2], "quad")
    assert gate(run).digits_right > 30
    with pytest.raises(InputError, match="precision was given with a Trajectory"):
        gate(run, precision="double")


def test_states_that_are_not_finite_have_no_digits() -> None:
    known = case("euler")
    states = ht.propagate(known.top, known.start, [1, 2, 3]).to_numpy()
    states[1, 2] = float("nan")
    found = gate(states, "euler", times=[1, 2, 3])
    assert not found.digits_right >= 0
    assert "non_finite" in repr(found)
