"""Many starts at once: each motion as if it were alone, whatever rides along, fails, is asked for, or how many work."""

import os
import signal
from collections import defaultdict
from fractions import Fraction
from threading import get_ident

import numpy
import pytest

from heavytop import DOUBLE, EXTENDED, QUAD, HeavyTop, InputError, Outcome, State, real
from heavytop.cases import CASES
from heavytop.exact.catalogue import find
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.heyoka import lanes
from heavytop.integrate.heyoka.lanes import Lanes
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.multiword.lanes import propagate_multiword_ensemble
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.integrate.trajectory import Problem
from heavytop.top.attitude import perpendicular
from support.helpers import bits

TOP = HeavyTop((3, 3, "3/2"), 2, ("1/3", "3/4", 0))
TIMES = [1, Fraction(5, 2), 20, 60]
HEAVY = ("euler", "lagrange", "kovalevskaya", "generic", "pendulum")
SLEEPING = HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, 0, 3), (0, 0, 1))
OVERFLOWING = TOP, State((10**140, 10**140, 1), (0, 0, 1))


def start(index: int) -> State:
    return State((Fraction(1 + index, 10), Fraction(1, 5), Fraction(9 - index, 10)), ("3/5", 0, "4/5"))


def problems(count: int, precision=DOUBLE, **kind) -> list[Problem]:
    return [Problem.of(TOP, start(index), precision, **kind) for index in range(count)]


def of_case(name: str) -> Problem:
    return Problem.of(CASES[name].top, CASES[name].start, DOUBLE, CASES[name].system)


def same(one, two) -> bool:
    """Whether two runs agree in everything but the seconds."""
    facts = [(run.outcome, run.times, run.time_reached, run.steps, run.order, run.flags) for run in (one, two)]
    return facts[0] == facts[1] and bits(one) == bits(two)


def alone(problem: Problem, times=TIMES, **options):
    return propagate_ensemble([problem], times, **options)[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sign", "options"),
    [
        (1, {}),
        (-1, {}),
        (1, {"high_accuracy": True}),
        (-1, {"compact_mode": True}),
        (1, {"tolerance": Fraction(1, 10**9)}),
    ],
)
def test_together_is_as_alone(sign: int, options) -> None:
    """21 starts: the lanes are refilled, and the last are not all taken."""
    given, times = problems(21), [sign * time for time in TIMES]
    together = propagate_ensemble(given, times, **options)
    assert [run.problem for run in together] == given
    assert all(run.outcome is Outcome.SUCCESS and len(run.states) == len(times) for run in together)
    assert all(same(run, alone(problem, times, **options)) for run, problem in zip(together, given, strict=True))
    assert len({run.steps for run in together}) > 10


def test_several_tops_share_a_batch() -> None:
    given = [of_case(name) for name in HEAVY * 2]
    together = propagate_ensemble(given, TIMES, threads=1)
    assert all(same(run, alone(problem)) for run, problem in zip(together, given, strict=True))


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_threads_change_no_bit(threads: int) -> None:
    given = problems(12)
    assert all(map(same, propagate_ensemble(given, TIMES, threads=threads), propagate_ensemble(given, TIMES)))


@pytest.mark.parametrize("sign", [1, -1])
def test_the_samples_change_no_bit(sign: int) -> None:
    given = problems(9)
    few = propagate_ensemble(given, [sign * 10, sign * 30])
    many = propagate_ensemble(given, [Fraction(sign * i, 8) for i in range(241)])
    for one, two in zip(few, many, strict=True):
        assert [list(state) for state in one.states] == [list(two.states[80]), list(two.states[240])]
        assert one.steps == two.steps


@pytest.mark.parametrize("window", [1, 7, 1000])
def test_the_chunks_change_no_bit(monkeypatch: pytest.MonkeyPatch, window: int) -> None:
    given = problems(10)
    usual = propagate_ensemble(given, TIMES)
    monkeypatch.setattr(lanes, "_WINDOW", window)
    monkeypatch.setattr(lanes, "CHUNK_SECONDS", 1e-9)
    assert all(map(same, propagate_ensemble(given, TIMES), usual))


def test_a_chunk_taken_back_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    """As after a failure on the way: the same ground is gone over by halves."""
    given = problems(8)
    usual = propagate_ensemble(given, TIMES)
    several, doubts = Lanes._several, []

    def doubtful(self: Lanes, count: int) -> bool:
        good = several(self, count)
        doubts.append(count)
        return good and len(doubts) % 7 != 1

    monkeypatch.setattr(Lanes, "_several", doubtful)
    assert all(map(same, propagate_ensemble(given, TIMES, threads=1), usual))
    assert len(doubts) > 7


@pytest.mark.parametrize("sign", [1, -1])
def test_lanes_that_fail_or_rest_spoil_no_other(sign: int) -> None:
    given = problems(20)
    given[3] = given[12] = Problem.of(*OVERFLOWING, DOUBLE)
    given[4] = given[19] = Problem.of(*SLEEPING, DOUBLE)
    times = [0, *(sign * time for time in TIMES)]
    runs = propagate_ensemble(given, times)
    for index, run in enumerate(runs):
        assert same(run, alone(given[index], times))
        if index in (3, 12):
            assert (run.outcome, run.times, run.time_reached, run.steps) == (Outcome.NON_FINITE, (0,), 0, 0)
        else:
            assert run.outcome is Outcome.SUCCESS
    scalar = propagate(*SLEEPING, times, DOUBLE)
    assert [list(state) for state in runs[4].states] == [list(state) for state in scalar.states]
    assert (runs[4].time_reached, runs[4].steps) == (scalar.time_reached, scalar.steps)


@pytest.mark.parametrize(
    ("put", "outcome"),
    [([0, 0, 3, 0, 0, 1], Outcome.SUCCESS), ([1e200, 1e200, 3, 0, 0, 1], Outcome.NON_FINITE)],
    ids=["comes to rest", "overflows"],
)
def test_what_happens_on_the_way_ends_that_lane_alone(monkeypatch: pytest.MonkeyPatch, put, outcome) -> None:
    """A lane is put into another state after its first steps, amid a chunk that is then gone over again by halves."""
    given = problems(10)
    given[2] = Problem.of(SLEEPING[0], State((0, "1/9", 3), (0, 0, 1)), DOUBLE)
    usual, several, calls = propagate_ensemble(given, TIMES, threads=1), Lanes._several, []

    def meddling(self: Lanes, count: int) -> bool:
        good = several(self, count)
        if not calls:
            self.mover.state[:, 2] = put
        calls.append(good)
        return good

    monkeypatch.setattr(lanes, "_WINDOW", 20)
    monkeypatch.setattr(Lanes, "_several", meddling)
    runs = propagate_ensemble(given, TIMES, threads=1)
    assert False in calls
    assert runs[2].outcome is outcome
    assert 0 < runs[2].steps < usual[2].steps
    if outcome is Outcome.SUCCESS:
        assert runs[2].time_reached == TIMES[-1]
        assert list(runs[2].states[-1]) == put
    else:
        assert runs[2].times == tuple(TIMES[: len(runs[2].times)]) != tuple(TIMES)
        assert 0 < runs[2].time_reached < TIMES[-1]
    assert all(same(one, two) for index, (one, two) in enumerate(zip(runs, usual, strict=True)) if index != 2)


@pytest.mark.parametrize("limit", [0, 1, 30, 150, 10**9])
def test_the_step_limit_holds_for_each_by_itself(limit: int) -> None:
    """The same steps and times as the scalar integrator, whose steps are alike to rounding."""
    given = problems(11)
    times = [0, *TIMES]
    for index, run in enumerate(propagate_ensemble(given, times, step_limit=limit)):
        scalar = propagate(TOP, start(index), times, DOUBLE, step_limit=limit)
        assert (run.outcome, run.times, run.steps) == (scalar.outcome, scalar.times, scalar.steps)
        assert float(run.time_reached) == pytest.approx(float(scalar.time_reached), rel=1e-9)


@pytest.mark.parametrize("window", [1, 64])
def test_a_step_that_does_not_move_the_time_ends_the_run(monkeypatch: pytest.MonkeyPatch, window: int) -> None:
    """Where doubles are 1/2 apart, steps of less than 1/4 are lost; the longer ones before them are not."""
    usual, load = propagate_ensemble(problems(2), [2**52], step_limit=100, threads=1), Lanes._load

    def late(self: Lanes, lane: int) -> None:
        load(self, lane)
        if lane == 0 and self.runs[0]:
            high, low = (word.copy() for word in self.mover.dtime)
            high[0] = 2.0**51 + 2.0**50
            self.mover.set_dtime(high, low)

    monkeypatch.setattr(Lanes, "_load", late)
    monkeypatch.setattr(lanes, "_WINDOW", window)
    stuck, free = propagate_ensemble(problems(2), [2**52], step_limit=100, threads=1)
    assert stuck.outcome is Outcome.STEP_TOO_SMALL
    assert stuck.time_reached >= 2**51 + 2**50
    assert same(free, usual[1])
    monkeypatch.setattr(lanes, "_WINDOW", 3)
    assert same(propagate_ensemble(problems(2), [2**52], step_limit=100, threads=1)[0], stuck)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*HEAVY, "gyrostat"])
def test_the_motion_is_the_true_one_to_rounding(name: str) -> None:
    """Against the closed form or the enclosure: within 500 eps for t up to 5 either way, like the scalar integrator."""
    case = CASES[name]
    known = find(case.top, case.start, case.system)
    for times in ([1, 5], [-1, -5]):
        run = alone(of_case(name), times)
        scalar = propagate(case.top, case.start, times, DOUBLE, system=case.system)
        for time, *states in zip(times, run.states, scalar.states, strict=True):
            truth = known.state(Fraction(time), 100)
            for state in states:
                off = max(abs(float(t - float(v))) for v, t in zip(state, truth, strict=True))
                assert off < 500 * float(DOUBLE.eps)


@pytest.mark.slow
@pytest.mark.parametrize("precision", [EXTENDED, QUAD, real(90)], ids=lambda p: p.name)
def test_formats_without_lanes_have_the_bits_of_the_scalar_integrator(precision) -> None:
    given = problems(3, precision)
    given[1] = Problem.of(*SLEEPING, precision)
    runs = propagate_ensemble(given, [-1, -2], threads=2)
    assert all(same(run, as_scalar(propagate, problem, [-1, -2])) for run, problem in zip(runs, given, strict=True))
    assert {run.integrator for run in runs} == {"heyoka"}


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "xi"), [(QUAD, None), (DOUBLE, perpendicular(start(0).gamma))])
def test_words_without_lanes_have_the_bits_of_a_run_by_itself(precision, xi) -> None:
    given = problems(3, precision, xi=xi)
    for run, problem in zip(propagate_multiword_ensemble(given, TIMES, threads=2), given, strict=True):
        assert same(run, as_scalar(propagate_multiword, problem, TIMES))


def as_scalar(integrate, problem: Problem, times):
    return integrate(problem.top, problem.start, times, problem.precision, xi=problem.xi)


@pytest.mark.slow
def test_the_attitude_rides_along() -> None:
    given = problems(9, xi=perpendicular(start(0).gamma))
    with_it, without = propagate_ensemble(given, TIMES), propagate_ensemble(problems(9), TIMES)
    for one, two in zip(with_it, without, strict=True):
        states = numpy.array(one.states)
        assert states[:, :6] == pytest.approx(numpy.array(two.states), abs=1e-11)
        assert numpy.einsum("ij,ij->i", states[:, 3:6], states[:, 6:]) == pytest.approx(0, abs=1e-12)
        assert numpy.einsum("ij,ij->i", states[:, 6:], states[:, 6:]) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("threads", [1, 3])
def test_the_caller_observes_all_samples_in_order_and_nothing_is_kept(
    monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    monkeypatch.setattr(lanes, "_ROOM", 2)
    given, seen, caller, errors = problems(19), defaultdict(list), get_ident(), numpy.geterr()

    def observer(index: int, time: Fraction, state) -> None:
        assert (get_ident(), numpy.geterr()) == (caller, errors)
        seen[index].append((time, list(state)))

    runs = propagate_ensemble(given, [0, *TIMES], observer=observer, threads=threads)
    kept = propagate_ensemble(given, [0, *TIMES])
    for index, (run, full) in enumerate(zip(runs, kept, strict=True)):
        assert (len(run.states), run.times) == (0, full.times)
        assert seen[index] == [(time, list(state)) for time, state in zip(full.times, full.states, strict=True)]


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_of_the_observer_ends_the_ensemble(threads: int) -> None:
    def observer(index: int, time: Fraction, state) -> None:
        raise LookupError(index)

    for ensemble, precision in (
        (propagate_ensemble, DOUBLE),
        (propagate_ensemble, EXTENDED),
        (propagate_multiword_ensemble, DOUBLE),
    ):
        full = ensemble(problems(3, precision), [1, 2], threads=threads)
        with pytest.raises(LookupError):
            ensemble(problems(30, precision), [1, 10**9], observer=observer, threads=threads)
        assert all(map(same, ensemble(problems(3, precision), [1, 2], threads=threads), full))


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="needs timers that send signals")
@pytest.mark.parametrize(("precision", "threads"), [(DOUBLE, 1), (EXTENDED, 2)])
def test_an_interrupt_ends_an_ensemble_that_would_take_years(precision, threads: int) -> None:
    def interrupt(number, frame) -> None:
        raise KeyboardInterrupt

    propagate_ensemble(problems(2, precision), [1])
    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt):
            propagate_ensemble(problems(20, precision), [10**15], threads=threads)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.slow
def test_what_changes_bits_is_in_the_flags() -> None:
    one, two = (alone(problems(1)[0], [1], lanes=n, high_accuracy=h) for n, h in ((8, True), (2, False)))
    assert (one.flags["batch_size"], one.flags["high_accuracy"], one.integrator) == ("8", "true", "heyoka:batch")
    assert two.flags == one.flags | {"batch_size": "2", "high_accuracy": "false"}
    assert "batch_size" not in propagate(TOP, start(0), [1], DOUBLE).flags
    assert one.seconds["compile"] > 0 < one.seconds["run"]


def test_the_start_alone_needs_no_step() -> None:
    runs = propagate_ensemble(problems(3), [0])
    assert [bits(run)[0] for run in runs] == [list(p.start.flat) for p in problems(3)]
    assert {run.steps for run in runs} == {0}


@pytest.mark.parametrize(
    ("given", "times", "options"),
    [
        ([], [1], {}),
        (problems(2), [], {}),
        (problems(2), [1, -1], {}),
        (problems(2), [2, 1], {}),
        (problems(1) + problems(1, QUAD), [1], {}),
        (problems(1) + problems(1, xi=perpendicular(start(0).gamma)), [1], {}),
        ([of_case("generic"), of_case("gyrostat")], [1], {}),
        (problems(2), [1], {"threads": 0}),
    ],
    ids=["none", "no times", "both signs", "not monotone", "formats", "attitudes", "systems", "no threads"],
)
def test_bad_input_is_refused_by_every_ensemble(given, times, options) -> None:
    for ensemble in (propagate_ensemble, propagate_multiword_ensemble):
        with pytest.raises(InputError):
            ensemble(given, times, **options)


def test_one_lane_is_no_ensemble() -> None:
    with pytest.raises(InputError):
        propagate_ensemble(problems(2), [1], lanes=1)
