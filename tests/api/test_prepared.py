"""An integrator that is prepared once gives the bits of `propagate`, and refuses what that refuses."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from itertools import product
from typing import Any

import numpy
import pytest

import heavytop as ht

TOP = ht.HeavyTop(inertia=(3, 2, 1), weight=1, centre=(0, "1/4", "1/3"))
WHEEL = ht.HeavyTop(inertia=(3, 2, 1), weight=1, centre=(0, 0, "1/3"), rotor=(0, "1/2", 2))
PAPER = ht.HeavyTop(inertia=(3, 2, 1), weight=1, centre=(0, "1/4", 0))
BODY = ht.Body(2, 1, (0, 0, "1/2"), ((3, 0, 1), (0, 2, 0), (1, 0, 2)), "pivot")
START = ht.State(omega=(1, "1/2", "1/3"), gamma=("3/5", 0, "4/5"))
PARALLEL = ht.State(omega=("1/5", 0, "4/5"), gamma=("3/5", 0, "4/5"))
ROW = [1.0, 0.5, 1 / 3, 0.6, 0.0, 0.8]
TIMES: dict[str, Any] = {
    "one": [0.1],
    "text": ["1/10", "7/3"],
    "from 0": [0, 1, 2.5],
    "back": [-1, -2, -20],
    "many": [Fraction(k, 16) for k in range(400)],
    "far": [1000],
}


def same(one: ht.Propagated, other: ht.Trajectory) -> bool:
    count = len(other.states)
    return (
        [str(v) for v in one.states[:count].ravel()] == [str(v) for v in other.states.ravel()]
        and one.outcome is other.outcome
        and one.steps == other.steps
    )


@pytest.mark.parametrize("times", TIMES.values(), ids=TIMES)
@pytest.mark.parametrize("top", [TOP, WHEEL], ids=["top", "wheel"])
def test_bits_are_those_of_propagate(top: ht.HeavyTop, times: list[Any]) -> None:
    assert same(ht.Integrator(top).propagate(START, times), ht.propagate(top, START, times))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "start"),
    [
        ({"precision": "extended"}, START),
        ({"precision": "quad"}, START),
        ({"precision": ht.real(100)}, START),
        ({"integrator": "multiword"}, START),
        ({"integrator": "scipy:DOP853"}, START),
        ({"system": "gyrostat", "top": PAPER}, PARALLEL),
        ({"tolerance": "1e-6", "high_accuracy": True}, START),
        ({"step_limit": 3}, START),
        ({"top": BODY}, START),
        ({}, ht.State(omega=(1, 0, 2), attitude=ht.Attitude.euler("ZXZ", 1, "1/2", 0))),
    ],
    ids=str,
)
def test_everything_that_propagate_takes_serves(options: dict[str, Any], start: ht.State) -> None:
    given = {"top": TOP} | options
    if given.get("integrator") == "scipy:DOP853":
        pytest.importorskip("scipy")
    run = ht.propagate(start=start, times=[1, 2], attitude=False, **given)
    assert same(ht.Integrator(**given).propagate(start, [1, 2]), run)


def test_shapes_follow_what_was_asked() -> None:
    prepared = ht.Integrator(TOP)
    rows = numpy.array([ROW, [0.0, 0.0, 9.0, 0.0, 0.6, 0.8], ROW])
    one, single = prepared.propagate(ROW, 0.5), prepared.propagate(rows, 0.5)
    several, path = prepared.propagate(rows, [0.5, 1]), prepared.propagate(ROW, [0.5, 1])
    assert [found.states.shape for found in (one, single, several, path)] == [(6,), (3, 6), (3, 2, 6), (2, 6)]
    assert (several.states[0] == path.states).all()
    assert (several.states[:, 0] == single.states).all()
    assert (single.states[0] == one.states).all()
    assert several.outcome == (ht.Outcome.SUCCESS,) * 3
    assert len(several.steps) == len(several.time_reached) == 3
    assert several.succeeded
    assert "3 motions: all reached every time" in str(several)
    assert "1 motion: all reached every time" in str(prepared.propagate(rows[:1], 0.5))
    path = str(prepared.propagate(ROW, numpy.arange(1, 31) / 10))
    assert "\n  ... 20 more" in path
    assert "\n  3.0 " in path


@pytest.mark.parametrize("options", [{}, {"tolerance": 1e-9}, {"integrator": "multiword"}])
def test_a_copy_for_another_process_gives_the_same_bits(options: dict[str, Any]) -> None:
    prepared = ht.Integrator(TOP, **options)
    copy = pickle.loads(pickle.dumps(prepared))
    assert (copy.propagate(ROW, 2).states == prepared.propagate(ROW, 2).states).all()
    assert copy.propagate(ROW, 2).steps == prepared.propagate(ROW, 2).steps


def test_starts_of_any_kind_of_number_are_the_exact_numbers_they_are() -> None:
    prepared = ht.Integrator(TOP)
    exact = ht.propagate(TOP, ht.State(ROW[:3], ROW[3:]), [2]).states[0]
    gamma = numpy.array([0, 0.6, 0.8])
    short = numpy.array([1, 0.5, 0.25, 1, 0, 0], dtype=numpy.float32)
    mixed = ["1", "1/2", Fraction(1 / 3), 0.6, 0, 0.8]
    for start, time in ((ROW, 2), (tuple(ROW), "2"), (numpy.array(ROW), 2.0), (mixed, 2)):
        assert (prepared.propagate(start, time).states == exact).all()
    assert prepared.propagate(short, 2).succeeded
    assert prepared.propagate([1, 2, 3, *gamma], 2).succeeded


def test_what_is_not_reached_is_no_number_and_said() -> None:
    found = ht.Integrator(TOP, step_limit=3).propagate(numpy.array([ROW, ROW]), [0.1, 1, 1000])
    assert found.outcome == (ht.Outcome.STEP_LIMIT,) * 2
    assert not found.succeeded
    assert numpy.isfinite(found.states[:, 0]).all()
    assert numpy.isnan(found.states[:, 2].astype(float)).all()
    assert (found.time_reached < 1000).all()
    assert "not all times were reached" in str(found)


NAN, INFINITE = float("nan"), float("inf")
BAD_STARTS = (
    *([1, 2, 3, 1, 1, 1], [1.0, 2.0, 3.0, 1.0, 1.0, 1.0], ROW[:5], [ROW, ROW[:5]], numpy.zeros((0, 6))),
    *(numpy.zeros((2, 2, 6)), [NAN, *ROW[1:]], [*ROW[:5], NAN], [INFINITE, *ROW[1:]], [1e151, *ROW[1:]]),
    *("110000", None, 7),
)
BAD_TIMES = (NAN, INFINITE, [], [2, 1], [-1, 1], None, True, "soon", 1e151)


@pytest.mark.parametrize(("start", "times"), [*product(BAD_STARTS, [1]), *product([ROW], BAD_TIMES)], ids=repr)
def test_bad_starts_and_times_are_refused(start: Any, times: Any) -> None:
    with pytest.raises(ht.InputError):
        ht.Integrator(TOP).propagate(start, times)


def test_a_bad_start_of_many_is_named() -> None:
    with pytest.raises(ht.InputError, match="Motion 1: "):
        ht.Integrator(TOP).propagate(numpy.array([ROW, [1.0, 0.0, 0.0, 1.0, 1.0, 1.0]]), 1)


@pytest.mark.parametrize("row", [ROW, [1e9, 0.0, 1e9, 0.0, 0.6, 0.8], [0.0, 0.0, 0.0, 0.6, 0.0, 0.8]])
def test_what_nobody_waits_for_is_refused_as_propagate_refuses_it(row: list[float]) -> None:
    top = ht.HeavyTop(inertia=(3, 2, 1), weight="1e20", centre=(0, "1/4", "1/3"))
    for call in (ht.Integrator(top).propagate, lambda start, t: ht.propagate(top, ht.State(start[:3], start[3:]), [t])):
        with pytest.raises(ht.OutOfReach):
            call(row, 1e16)


@pytest.mark.parametrize(
    "options", [{"precision": "half"}, {"integrator": "none"}, {"tolerance": 2}, {"step_limit": 0}]
)
def test_bad_options_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(ht.InputError):
        ht.Integrator(TOP, **options).propagate(START, 1)


def test_threads_share_one() -> None:
    prepared = ht.Integrator(TOP)
    rows = [[1.0, k / 64, 1 / 3, 0.6, 0.0, 0.8] for k in range(64)]
    alone = [prepared.propagate(row, [1, 30]).states for row in rows]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda row: prepared.propagate(row, [1, 30]).states, rows))
    assert all((a == b).all() for a, b in zip(alone, together, strict=True))


def test_tops_one_after_the_other_do_not_mix() -> None:
    """Answers that are kept for the same objects are those of these objects alone."""
    tops = [ht.HeavyTop(inertia=(3, 2, 1), weight=k, centre=(0, 0, 1)) for k in range(1, 4)]
    starts = [ht.State((k, 1, 0), (0, 0, 1)) for k in range(3)]
    fresh = {}
    for turn in range(2):
        for i, top in enumerate(tops):
            for j, start in enumerate(starts):
                for form in ("double", "extended"):
                    states = [str(v) for v in ht.propagate(top, start, [1], form).states.ravel()]
                    assert fresh.setdefault((i, j, form), states) == states, turn


def test_an_option_that_changes_between_two_calls_is_looked_at_in_each() -> None:
    """An array without dimensions is one object, whatever it holds."""
    xi, tolerance, limit = numpy.array([0.0, 1.0, 0.0]), numpy.array(1e-15), numpy.array(1)
    for integrator in ("heyoka", "multiword"):
        found = []
        for changed in (0, 1):
            xi[1], tolerance[()], limit[()] = (1, -1)[changed], (1e-15, 1e-8)[changed], (1, 1000)[changed]
            runs = [
                ht.propagate(TOP, START, [1, 9], integrator=integrator, **option)
                for option in ({"xi": xi}, {"tolerance": tolerance}, {"step_limit": limit})
            ]
            found.append([(run.steps, run.states.tolist()) for run in runs])
        assert all(before != after for before, after in zip(*found, strict=True)), integrator
