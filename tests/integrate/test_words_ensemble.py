"""Many motions in multi-word arithmetic: each is the true one, and none of its bits depends on the others, on threads
or order.
"""

from fractions import Fraction
from random import Random

import pytest

from heavytop import DOUBLE, DOUBLE_DOUBLE, QUAD, HeavyTop, Outcome, State
from heavytop.integrate.multiword import lanes
from heavytop.integrate.multiword.lanes import propagate_multiword_ensemble
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.integrate.trajectory import Problem
from support.helpers import bits, distance

TOP = HeavyTop((2, 2, 1), 1, (0, 1, 0))
SLEEPING = HeavyTop((2, 2, 1), 1, (0, 0, 1))
FAST = HeavyTop((1, 1, "1/2"), 1, (0, 0, 1))
TIMES = [0, 1, "5/2", 10]


def problems(precision=DOUBLE, count: int = 19) -> list[Problem]:
    """Starts of one top, among them a motion at rest and one of fast spin."""
    random = Random(8)
    found = [
        Problem.of(TOP, State([Fraction(random.randint(-1000, 1000), 1024) for _ in range(3)], (1, 0, 0)), precision)
        for _ in range(count)
    ]
    found[3] = Problem.of(SLEEPING, State((0, 0, 3), (0, 0, 1)), precision)
    found[5] = Problem.of(FAST, State((1, 2, 30), ("3/5", 0, "4/5")), precision)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("precision", [DOUBLE, DOUBLE_DOUBLE], ids=lambda p: p.name)
@pytest.mark.parametrize("sign", [1, -1], ids=["forwards", "backwards"])
def test_each_motion_is_that_of_a_run_by_itself(precision, sign: int) -> None:
    times = [sign * Fraction(t) for t in TIMES]
    given = problems(precision)
    for problem, run in zip(given, propagate_multiword_ensemble(given, times), strict=True):
        alone = propagate_multiword(problem.top, problem.start, times, precision)
        assert run.outcome is Outcome.SUCCESS
        assert run.problem == problem
        assert run.times == alone.times
        assert distance(run, alone) <= (precision.eps if precision is DOUBLE else 3000 * precision.eps)
        assert (run.steps == 0) == (alone.steps == 0)


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [6, 9, 13])
def test_every_tolerance_is_kept_in_lanes(exponent: int) -> None:
    """Loose ones ask for fewer orders in double-double than there can be."""
    tolerance = Fraction(1, 10**exponent)
    for precision in (DOUBLE, DOUBLE_DOUBLE, QUAD):
        given = problems(precision, 10)
        runs = propagate_multiword_ensemble(given, TIMES, tolerance=tolerance)
        for run, exact_run in zip(runs, propagate_multiword_ensemble(given, TIMES), strict=True):
            assert run.outcome is Outcome.SUCCESS
            assert distance(run, exact_run) <= 1000 * tolerance
            assert (run.steps == 0) == (exact_run.steps == 0)


def test_no_bit_depends_on_order_threads_chunks_or_company(monkeypatch: pytest.MonkeyPatch) -> None:
    given = problems()
    runs = propagate_multiword_ensemble(given, TIMES, threads=1)
    monkeypatch.setattr(lanes, "_FIRST_CHUNK", 3)
    monkeypatch.setattr(lanes, "CHUNK_SECONDS", 0.0)
    turned = propagate_multiword_ensemble(given[::-1], TIMES, threads=3)[::-1]
    alone = [propagate_multiword_ensemble([problem], TIMES)[0] for problem in given[:7]]
    few = propagate_multiword_ensemble(given, TIMES[-1:])
    for first, second in [*zip(runs, turned, strict=True), *zip(runs, alone, strict=False)]:
        assert bits(first) == bits(second)
        assert first.steps == second.steps
        assert first.time_reached == second.time_reached
    assert [bits(run)[-1] for run in few] == [bits(run)[-1] for run in runs]


def test_motions_that_outgrow_n0_go_on_where_they_were_and_are_right(monkeypatch: pytest.MonkeyPatch) -> None:
    given = problems()
    runs = propagate_multiword_ensemble(given, TIMES)
    monkeypatch.setattr(lanes, "first_low_order", lambda arithmetic: 2)
    raised = propagate_multiword_ensemble(given, TIMES, threads=2)
    for a, b in zip(runs, raised, strict=True):
        assert a.times == b.times
        assert distance(a, b) <= DOUBLE.eps


def test_each_motion_has_the_outcome_it_has() -> None:
    given = problems()
    whole = propagate_multiword_ensemble(given, TIMES)
    runs = propagate_multiword_ensemble(given, TIMES, step_limit=38)
    assert {run.outcome for run in runs} == {Outcome.SUCCESS, Outcome.STEP_LIMIT}
    for run, long in zip(runs, whole, strict=True):
        assert (run.outcome is Outcome.SUCCESS) == (long.steps <= 38)
        assert bits(run) == bits(long)[: len(run.times)]
        if run.outcome is Outcome.STEP_LIMIT:
            assert run.steps == 38
            assert run.times[-1] < run.time_reached < 10


def test_observer_and_finished_are_called_in_order() -> None:
    given = problems(count=9)
    seen: dict[int, list[Fraction]] = {}
    over: list[int] = []

    def observer(index: int, time: Fraction, state: object) -> None:
        assert index not in over
        seen.setdefault(index, []).append(time)

    runs = propagate_multiword_ensemble(
        given, TIMES, observer=observer, finished=lambda index, run: over.append(index), threads=2
    )
    assert sorted(over) == list(range(9))
    assert all(times == [Fraction(t) for t in TIMES] for times in seen.values())
    assert all(len(run.states) == 0 and len(run.times) == 4 for run in runs)
