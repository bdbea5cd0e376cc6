"""States at many times in few calls: the bits of one after the other, exact times, and costs that do not grow."""

import copy
import cProfile
import pstats
import random
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import pytest

from heavytop.cases import CASES
from heavytop.display import Lazy, TitledTable
from heavytop.integrate.heyoka import motions
from heavytop.integrate.heyoka.motions import first_steps, propagate
from heavytop.integrate.multiword import motions as multiword_motions
from heavytop.integrate.multiword.motions import propagate_multiword
from heavytop.integrate.trajectory import Outcome, Trajectory
from heavytop.multiword.double_double import double_double_run
from heavytop.multiword.fixed_point import fixed_point_run, steps
from heavytop.multiword.fixed_point.fixed_point_run import Fixed
from heavytop.precision import DOUBLE, EXTENDED, QUAD, exact, number, parse
from heavytop.top.heavy_top import HeavyTop, RoundedTimes, State
from support.helpers import distance

CASE = CASES["kovalevskaya"]
INTEGRATORS = {"heyoka": propagate, "multiword": propagate_multiword}


def irregular(count: int, last: int, seed: int) -> list[Fraction]:
    source = random.Random(seed)
    early = [Fraction(source.randint(1, 10**9), 10**12) for _ in range(20)]
    return sorted({*early, *(Fraction(source.randint(1, 10**9), 10**9) * last for _ in range(count)), Fraction(last)})


def regular(count: int, last: int) -> list[Fraction]:
    return [Fraction(last * k, count) for k in range(count + 1)]


def run_of(name: str, times, precision=DOUBLE, case=CASE, **options) -> Trajectory:
    return INTEGRATORS[name](case.top, case.start, times, precision, system=case.system, **options)


def assert_as_one_by_one(name: str, given, precision=DOUBLE, case=CASE, many=None, **options) -> Trajectory:
    """The run has the bits of one with resume points, which takes one sample after the other, observed or not."""
    one_by_one = run_of(name, given, precision, case, mark=lambda _: None, **options)
    seen: list = []
    run = run_of(name, given, precision, case, observer=lambda *sample: seen.append(sample), **options)
    assert not len(run.states)
    times, states = [time for time, _ in seen], [state for _, state in seen]
    assert tuple(one_by_one.times) == tuple(times)
    assert all((a == b).all() for a, b in zip(one_by_one.states, states, strict=True))
    many = many or run_of(name, given, precision, case, **options)
    assert tuple(many.times) == tuple(times)
    assert (many.outcome, many.steps, many.time_reached, many.order) == (
        run.outcome, run.steps, run.time_reached, run.order)  # fmt: skip
    assert len(many.states) == len(states)
    assert all((a == b).all() for a, b in zip(many.states, states, strict=True))
    return many


@pytest.mark.slow
@pytest.mark.parametrize(("times", "sign"), [(regular(800, 60), 1), (irregular(800, 60, 1), -1)], ids=["on", "back"])
@pytest.mark.parametrize(
    ("name", "precision", "part"),
    [
        ("heyoka", DOUBLE, 1),
        ("heyoka", EXTENDED, 1),
        ("heyoka", QUAD, 20),
        ("heyoka", parse("real:150"), 20),
        ("multiword", DOUBLE, 1),
        ("multiword", EXTENDED, 5),
        ("multiword", parse("double-double"), 5),
        ("multiword", parse("real:70"), 5),
        ("multiword", QUAD, 20),
        ("multiword", parse("real:150"), 20),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_many_states_have_the_bits_of_single_ones(name, precision, part, times, sign) -> None:
    assert_as_one_by_one(name, [sign * time / part for time in times[: len(times) if part == 1 else 300]], precision)


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "sign"), [(QUAD, 1), (parse("real:150"), -1)])
def test_times_that_are_doubles_take_arrays_on_a_grid_too(precision, sign: int) -> None:
    assert_as_one_by_one("multiword", [sign * float(time) / 20 for time in irregular(200, 60, 3)], precision)


def test_samples_whose_sums_leave_their_range_are_taken_by_series(monkeypatch: pytest.MonkeyPatch) -> None:
    times = [float(time) / 20 for time in irregular(100, 60, 5)]
    usual = run_of("multiword", times, QUAD)
    for module in (steps, fixed_point_run):
        monkeypatch.setattr(module, "most_of", lambda _: 1.0)  # what sums of this motion now and then exceed
    monkeypatch.setattr(fixed_point_run, "machine", lru_cache(steps.build))
    moved: list[Fraction] = []
    move = Fixed._moved
    monkeypatch.setattr(
        Fixed, "_moved", lambda run, words, span, left: moved.append(span) or move(run, words, span, left)
    )
    found = run_of("multiword", times, QUAD)
    assert 0 < len(moved) < len(times)
    assert_as_one_by_one("multiword", times, QUAD, many=found)
    assert distance(found, usual) <= 4 * QUAD.eps


@pytest.mark.slow
@pytest.mark.parametrize("name", INTEGRATORS)
@pytest.mark.parametrize("case", ["lagrange", "ershkov-partial-6", "hess-pendulum"])
def test_other_tops_and_systems_too(name: str, case: str) -> None:
    assert_as_one_by_one(name, irregular(400, 20, 2), case=CASES[case])


@pytest.mark.slow
@pytest.mark.parametrize("name", INTEGRATORS)
def test_dense_times_within_the_first_steps(name: str) -> None:
    assert_as_one_by_one(name, [Fraction(k, 3000) for k in range(1, 3001)])


def test_a_time_where_a_step_ends_belongs_to_that_step() -> None:
    run, _ = first_steps(CASE.top, CASE.start, Fraction(40), DOUBLE)
    ends = {Fraction(float(time)) for time in run.times}
    assert_as_one_by_one("heyoka", sorted({*ends, *regular(600, 40)[1:]}))


@pytest.mark.slow
@pytest.mark.parametrize("name", INTEGRATORS)
@pytest.mark.parametrize("limit", [1, 5, 90])
def test_a_run_that_stops_early_gives_the_same_states(name: str, limit: int) -> None:
    assert assert_as_one_by_one(name, regular(1000, 50), step_limit=limit).outcome is Outcome.STEP_LIMIT


@pytest.mark.slow
@pytest.mark.parametrize("name", INTEGRATORS)
def test_an_equilibrium_and_units_of_any_size(name: str) -> None:
    times = regular(500, 20)
    rest = replace(CASE, top=HeavyTop((2, 2, 1), 1, (0, 0, 1)), start=State((0, 0, 0), (0, 0, 1)))
    run = assert_as_one_by_one(name, times, case=rest)
    assert (run.outcome, run.steps) == (Outcome.SUCCESS, 0)
    assert (run.states == [0, 0, 0, 0, 0, 1]).all()
    for size in (Fraction(10) ** 100, Fraction(10) ** -100):
        top = HeavyTop([i * size for i in CASE.top.inertia], CASE.top.weight / size, CASE.top.centre)
        start, late = State([w / size for w in CASE.start.omega], CASE.start.gamma), [time * size for time in times]
        assert_as_one_by_one(name, late, case=replace(CASE, top=top, start=start))


@pytest.mark.parametrize(
    ("last", "case", "precision", "short", "close"),
    [
        (50, "kovalevskaya", DOUBLE, 0.97, 200),
        (-10_000, "kovalevskaya", DOUBLE, 0.97, 200),
        (20_000, "kovalevskaya", DOUBLE, 0.97, 200),
        (-20_000, "kovalevskaya", DOUBLE, 5, 200),  # strides end beyond a sample and are taken back
        (24_000, "kovalevskaya-asymptotic", DOUBLE, 0.97, 200),
        (1_000, "generic", EXTENDED, 0.97, 10),
    ],
    ids=str,
)
def test_many_samples_are_one_call_of_the_same_bits(last, case, precision, short, close, monkeypatch) -> None:
    times, top = regular(300, last), CASES[case]
    monkeypatch.setattr(motions, "_SHORT", short)
    monkeypatch.setattr(motions, "_CLOSE", close)
    assert_as_one_by_one("heyoka", times, precision, top)
    monkeypatch.setattr(motions.Stepper, "sample", lambda *_: pytest.fail("a sample of its own"))
    assert len(run_of("heyoka", times, precision, top).states) == 301


@pytest.mark.parametrize(("name", "most"), [("heyoka", 5), ("multiword", 8)])
def test_a_sample_costs_few_calls_of_python(name: str, most: int) -> None:
    times = regular(2000, 100)
    run_of(name, times)
    profile = cProfile.Profile()
    profile.runcall(run_of, name, times)
    assert pstats.Stats(profile).total_calls < most * len(times)


def test_rounded_times_are_exact_when_asked_for() -> None:
    times = regular(300, 7)
    run = run_of("heyoka", times)
    assert isinstance(run.times, RoundedTimes)
    expected = tuple(exact(number(time, DOUBLE)) for time in times)
    assert run.times == expected == tuple(run.times)
    assert run.times[-1] == expected[-1]
    assert run.times[5:7] == expected[5:7]
    assert hash(run.times) == hash(expected)
    assert run.times != expected[1:]


def test_the_first_and_last_rows_alone_are_formatted() -> None:
    asked: list[int] = []

    def line(place: int) -> list[str]:
        asked.append(place)
        return [str(place)]

    text = TitledTable("many", ["n"], Lazy(10**6, line)).text()
    assert asked == [*range(5), *range(10**6 - 5, 10**6)]
    assert "999990 more" in text
    calls = []
    for count in (30, 3000):
        run = run_of("heyoka", regular(count, 100))
        profile = cProfile.Profile()
        profile.runcall(repr, run)
        calls.append(pstats.Stats(profile).total_calls)
    assert calls[1] - calls[0] < 3000  # beside what is said of the whole motion
    assert repr(run).count("\n") == 12


@pytest.mark.slow
@pytest.mark.parametrize("name", ["extended", "double-double", "real:70"])
def test_states_out_of_two_words_have_the_bits_of_exact_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    precision, times = parse(name), [-time for time in irregular(60, 9, 4)]
    asked = {"xi": (Fraction(1), Fraction(0), Fraction(0))}
    start = State(CASE.start.omega, (0, 0, 1))

    def observed() -> list:
        seen: list = []
        propagate_multiword(CASE.top, start, times, precision, observer=lambda _, state: seen.append(state), **asked)
        return seen

    found = [propagate_multiword(CASE.top, start, times, precision, **asked).states, observed()]
    monkeypatch.setattr(multiword_motions, "sums_of_two", lambda *_: None)
    found.append(observed())
    columns, quick, exactly = ([[exact(value) for value in state] for state in states] for states in found)
    assert columns == quick == exactly
    assert len(quick) == len(times)


@pytest.mark.parametrize("name", ["double", "double-double"])
def test_samples_of_one_call_end_anywhere(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(double_double_run, "_SAMPLES_AT_ONCE", 7)
    assert_as_one_by_one("multiword", irregular(50, 2, 7), parse(name))


@pytest.mark.parametrize("name", ["double", "extended", "double-double", "quad", "real:70", "real:150"])
def test_states_are_made_once_whoever_asks_for_them_first(name: str) -> None:
    def run() -> Trajectory:
        return run_of("multiword", regular(80, 2), parse(name))

    first, copied, replaced = run(), copy.copy(run()), replace(run(), integrator="another")
    assert first.states is first.states
    with ThreadPoolExecutor(4) as pool:
        asked = run()
        together = list(pool.map(lambda _: asked.states, range(4)))
    for states in (copied.states, replaced.states, *together):
        assert (states.dtype, states.shape) == (first.states.dtype, (81, 6))
        assert (states == first.states).all()
    assert not hasattr(run(), "anything_else")
