"""Every call is right whatever other threads, observers and the user's own flint.ctx do at the same time."""

import decimal
import random
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from functools import partial
from itertools import chain
from typing import Any

import numpy
import pytest
from flint import arb, ctx

from heavytop import events
from heavytop.cases import CASES
from heavytop.exact.cases.euler import Euler
from heavytop.exact.cases.lagrange import Lagrange
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import (
    ContextChanged,
    ball_from,
    ball_text,
    midpoint,
    radius,
    series_length,
    to_bits,
    whole_evaluation,
    working_precision,
)
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.heyoka.engines import compiled
from heavytop.integrate.heyoka.motions import first_steps, propagate
from heavytop.integrate.trajectory import Problem
from heavytop.measure.reference import reference
from heavytop.measure.scorer import Drift
from heavytop.precision import DOUBLE, EXTENDED, QUAD, Precision, real, time_text
from heavytop.top.equations import HEAVY_TOP, holding
from heavytop.top.heavy_top import HeavyTop, State
from support.helpers import run_peer

F = Fraction
FORMATS = (DOUBLE, EXTENDED, QUAD, real(100))
TIMES = [F(1, 2), F(2), F(3)]
XI = (F(0), F(1), F(0))


@pytest.fixture(autouse=True)
def _switch_often() -> Iterator[None]:
    """Threads are switched as often as Python can; what flint.ctx was comes back."""
    interval, context = sys.getswitchinterval(), (ctx.prec, ctx.cap)
    sys.setswitchinterval(1e-6)
    try:
        yield
    finally:
        sys.setswitchinterval(interval)
        ctx.prec, ctx.cap = context


def some_top(index: int, free: bool = False) -> tuple[HeavyTop, State]:
    rng = random.Random(index)
    a, b, c = (F(rng.randint(20, 39), rng.randint(7, 13)) for _ in range(3))
    centre = (0, 0, 0) if free else (F(1, rng.randint(2, 9)), 0, F(1, rng.randint(2, 9)))
    omega = [F(rng.randint(-14, 14), rng.randint(7, 13)) for _ in range(3)]
    return HeavyTop((a, b, (a + b) * c / (a + b + c)), 1, centre), State(omega, (F(3, 5), 0, F(4, 5)))


def propagated(index: int, precision: Precision) -> Any:
    return propagate(*some_top(index), TIMES, precision).texts()


def referred(index: int, digits: int) -> Any:
    top, start = some_top(index, free=True)
    return reference(top, start, [F(index + 1, 3), F(index + 7)], digits)


def drifted(index: int, precision: Precision) -> Any:
    top, start = some_top(index)
    drift = Drift(Problem.of(top, start, precision), holding(top, start), TIMES)
    propagate(top, start, TIMES, precision, observer=drift)
    return drift.content(), drift.metrics()


def stepped(index: int) -> Any:
    top, start = some_top(index)
    run, steps = first_steps(top, start, F(1), DOUBLE)
    return run.texts(), [step.coefficients.tobytes() for step in steps]


def carried() -> Any:
    case = CASES["lagrange"]
    motion = Lagrange(case.top, case.start)
    return [(midpoint(x), radius(x)) for x in (*motion.state(F(7, 3), 300), *motion.attitude(F(7, 3), 200))]


def ensemble() -> Any:
    problems = [Problem.of(*some_top(index), DOUBLE) for index in range(20)]
    return [run.texts() for run in propagate_ensemble(problems, TIMES, threads=2)]


MOTIONS = [Euler(*some_top(index, free=True)) for index in range(4)]


def series(index: int) -> Any:
    parts = MOTIONS[index % 4].series(F(1, 2), 2 + index % 3, 100)
    return [[(midpoint(part[n]), radius(part[n])) for n in range(2 + index % 3)] for part in parts]


def words_of_mpmath(index: int) -> Any:
    """Of a peer with settings of the whole process."""
    return run_peer("mpmath:odefun", *some_top(index % 2), [F(1, 4)], real((60, 100, 140)[index % 3])).texts()


def enclosed(index: int) -> Any:
    return [(midpoint(x), radius(x)) for x in Validated(*some_top(1)).state(F(20 + index, 3), 100)]


def varied(index: int) -> Any:
    return reference(*some_top(index), [F(1)], 20, derivatives="start").derivatives


def located(index: int) -> Any:
    """Events on the way, within which others are looked for."""
    inner = partial(events, *some_top(1), 1, "gamma2")
    found = (
        events(*some_top(1), 9, text, digits=20).time_texts() for text in ("gamma3 = 1/2", "omega1*gamma2")[index:]
    )
    return [*found, events(*some_top(1), 2, lambda omega, gamma: omega[0] + 0 * len(inner())).time_texts()]


def calls() -> list[Callable[[], Any]]:
    """Calls of every kind; those that share an engine or a lattice are many, and differ in precision."""
    found: list[Callable[[], Any]] = [carried, *[ensemble] * 2]
    for index in range(2):
        found += [partial(each, index) for each in (enclosed, varied, located)]
    for index in range(24):
        found += [
            partial(propagated, index, FORMATS[index % 4]),
            partial(referred, index, (20, 300, 50)[index % 3]),
            partial(drifted, index, FORMATS[index % 3]),
        ]
        found += [partial(series, index), partial(words_of_mpmath, index)][: 2 if index < 6 else 1]
    return [*found, *(partial(stepped, index) for index in range(4))]


def in_threads(wanted: list[Callable[[], Any]], threads: int = 8) -> list[Any]:
    with ThreadPoolExecutor(threads) as pool:
        return [future.result() for future in [pool.submit(each) for each in wanted]]


@pytest.mark.slow
def test_calls_from_eight_threads_give_the_bits_of_the_same_calls_in_order() -> None:
    wanted = calls()
    assert in_threads(wanted) == [each() for each in wanted]


@pytest.mark.slow
def test_eight_threads_that_ask_one_enclosure_get_the_balls_of_one() -> None:
    top, start = some_top(3)
    shared = Validated(top, start)
    wanted = [(F(i % 7 + 1, 2), (60, 200, 120)[i % 3]) for i in range(32)]
    found = in_threads([partial(shared.state, time, bits) for time, bits in wanted])
    alone = [Validated(top, start).state(time, bits) for time, bits in wanted[:21]]
    for one, other in zip(found, alone, strict=False):
        assert [(midpoint(x), radius(x)) for x in one] == [(midpoint(x), radius(x)) for x in other]


@pytest.mark.slow
@pytest.mark.parametrize(
    "nested",
    [
        partial(propagate, *some_top(1), TIMES, DOUBLE),
        partial(propagate, *some_top(2), TIMES, DOUBLE),
        partial(propagate, *some_top(2), TIMES, DOUBLE, xi=XI),
        partial(propagate, *some_top(2), TIMES, EXTENDED),
        partial(first_steps, *some_top(2), F(1), DOUBLE),
        partial(propagate_ensemble, [Problem.of(*some_top(i), DOUBLE) for i in range(9)], TIMES, threads=2),
        partial(referred, 2, 40),
    ],
    ids=["same top", "other top", "with attitude", "other format", "first steps", "ensemble", "reference"],
)
@pytest.mark.parametrize("xi", [None, XI], ids=["", "attitude"])
def test_what_an_observer_calls_changes_nothing_in_its_own_run(nested: Callable[[], Any], xi: Any) -> None:
    kept = []

    def observer(time: Fraction, state: Any) -> None:
        nested()
        kept.append(tuple(state))

    quiet = propagate(*some_top(1), TIMES, DOUBLE, xi=xi)
    propagate(*some_top(1), TIMES, DOUBLE, xi=xi, observer=observer)
    assert kept == [tuple(state) for state in quiet.states]


def test_an_observer_may_wait_for_a_thread_that_evaluates() -> None:
    def observer(_time: Fraction, _state: Any) -> None:
        thread = threading.Thread(target=referred, args=(1, 30), daemon=True)
        thread.start()
        thread.join(20)
        assert not thread.is_alive()

    propagate(*some_top(1), TIMES, DOUBLE, observer=observer)
    propagate_ensemble([Problem.of(*some_top(1), DOUBLE)] * 2, TIMES[:1], observer=lambda _, *rest: observer(*rest))


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_a_run_that_raises_gives_its_engine_back(error: type[BaseException]) -> None:
    def observer(*_: object) -> None:
        raise error

    before = propagated(1, DOUBLE)
    tool = compiled(HEAVY_TOP, DOUBLE)
    spare = {id(engine) for engine in tool.spare}
    for _ in range(3):
        with pytest.raises(error):
            propagate(*some_top(2), TIMES, DOUBLE, observer=observer)
    assert {id(engine) for engine in tool.spare} == spare
    assert propagated(1, DOUBLE) == before


def set_and_leave(rng: random.Random) -> None:
    ctx.prec, ctx.cap = rng.randint(2, 200), rng.randint(1, 9)


def set_and_put_back(rng: random.Random) -> None:
    with ctx.workprec(rng.randint(2, 200)):
        arb(2).sqrt()


@pytest.mark.parametrize("meddle", [set_and_leave, set_and_put_back])
def test_a_thread_of_the_user_that_keeps_changing_flint_spoils_no_proof(
    meddle: Callable[[random.Random], None],
) -> None:
    wanted = [*(partial(referred, i, (30, 200)[i % 2]) for i in range(6)), *(partial(drifted, i, QUAD) for i in (0, 1))]
    quiet = [each() for each in wanted]
    stop = threading.Event()

    def change() -> None:
        rng = random.Random(1)
        while not stop.is_set():
            meddle(rng)

    thread = threading.Thread(target=change)
    thread.start()
    try:
        found = [each() for each in wanted]
    finally:
        stop.set()
        thread.join()
    for one, other in zip(found[:6], quiet, strict=False):
        assert one.digits == other.digits
        for here, there in zip(chain(*one.states), chain(*other.states), strict=True):
            assert abs(F(here.value) - F(there.value)) <= F(here.radius) + F(there.radius)
            assert F(here.radius) <= F(1, 10 ** (one.digits - 1)) * max(1, abs(F(there.value)))
    if meddle is set_and_leave:  # what is put back cannot be seen: such an evaluation may come out wider, never wrong
        assert found == quiet


@pytest.mark.parametrize("context", [(2, 1), (53, 10), (4000, 100)])
def test_what_flint_was_set_to_changes_nothing_and_comes_back(context: tuple[int, int]) -> None:
    def everything() -> Any:
        return carried(), referred(1, 40), drifted(1, QUAD), Euler(*some_top(1, True)).series(F(1), 3, 90)[0].prec

    expected = everything()
    ctx.prec, ctx.cap = context
    assert everything() == expected
    assert (ctx.prec, ctx.cap) == context


def test_what_a_user_sets_meanwhile_stays_set() -> None:
    attempts = []

    @whole_evaluation
    def evaluation() -> arb:
        attempts.append(ctx.prec)
        with working_precision(300, 5):
            if len(attempts) < 3:
                ctx.prec = 77
            return arb(2).sqrt()

    assert evaluation().rel_accuracy_bits() > 290
    assert attempts == [53, 53, 53]
    assert (ctx.prec, ctx.cap) == (77, 10)


def test_an_evaluation_that_is_disturbed_every_time_is_a_clear_error() -> None:
    attempts = []

    def disturbed(_working: int) -> list[arb]:
        attempts.append(ctx.cap)
        ctx.cap = 3
        return [arb(2).sqrt()]

    with pytest.raises(ContextChanged, match=r"keeps changing flint\.ctx"):
        to_bits(disturbed, 100)
    assert attempts == [1] * 7
    with pytest.raises(ContextChanged), series_length(4):
        ctx.prec = 99
    assert (ctx.prec, ctx.cap) == (99, 3)


def test_an_error_of_a_disturbed_evaluation_is_not_believed() -> None:
    attempts = []

    @whole_evaluation
    def evaluation() -> int:
        attempts.append(1)
        with working_precision(100):
            if len(attempts) == 1:
                ctx.prec = 30
                raise ZeroDivisionError
            return ctx.prec

    assert evaluation() == 100


def test_wrong_precisions_are_refused_and_nothing_stays_locked() -> None:
    for bits in (1, -5, "300", 10**40):
        with pytest.raises((ValueError, TypeError, OverflowError)), working_precision(bits):  # type: ignore[arg-type]
            pass
    assert in_threads([partial(referred, 1, 30)]) == [referred(1, 30)]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="signals are sent to threads on POSIX alone")
def test_ctrl_c_works_while_another_thread_evaluates() -> None:
    main, inside, done = threading.get_ident(), threading.Event(), threading.Event()

    def evaluate_long() -> None:
        with working_precision(100):
            inside.set()
            threading.Timer(0.2, signal.pthread_kill, (main, signal.SIGINT)).start()
            done.wait(20)

    # a process that runs tests may ignore the signal
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    thread = threading.Thread(target=evaluate_long)
    thread.start()
    inside.wait()
    try:
        with pytest.raises(KeyboardInterrupt):
            referred(1, 30)
        assert thread.is_alive()
    finally:
        done.set()
        thread.join()
        signal.signal(signal.SIGINT, before)
    assert in_threads([partial(referred, 1, 30)]) == [referred(1, 30)]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there is no such timer on this platform")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("what", ["closed form", "drift", "blocks"])
def test_ctrl_c_at_any_moment_leaves_the_context_free_and_as_it_was(what: str) -> None:
    """An interrupt within a callback of the garbage collector, such as JAX has, is lost: none is waited for."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    def blocks() -> None:
        with working_precision(100), series_length(5), working_precision(50, 3):
            pass

    motion, (top, start) = Euler(*some_top(1, free=True)), some_top(1)
    drift = partial(Drift(Problem.of(top, start, DOUBLE), holding(top, start)), F(1), [1.0] * 6)
    call = {"closed form": partial(motion.state, F(1, 3), 80), "drift": drift, "blocks": blocks}[what]
    before = signal.signal(signal.SIGALRM, interrupt)
    rng, stopped = random.Random(7), 0
    ctx.prec, ctx.cap = 61, 7
    try:
        for _ in range(100):
            end = time.monotonic() + 1
            try:
                signal.setitimer(signal.ITIMER_REAL, rng.uniform(1e-4, 2e-3))
                while time.monotonic() < end:
                    call()
            except KeyboardInterrupt:
                stopped += 1
            assert (ctx.prec, ctx.cap) == (61, 7)
            other = threading.Thread(target=blocks, daemon=True)
            other.start()
            other.join(20)
            assert not other.is_alive(), "the lock is held for ever"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert stopped > 50
    assert in_threads([partial(referred, 1, 30)]) == [referred(1, 30)]


def test_what_numpy_and_decimal_were_set_to_changes_nothing() -> None:
    def everything() -> Any:
        return [
            f()
            for f in (carried, *(partial(part, 1, QUAD) for part in (propagated, drifted)), partial(referred, 2, 40))
        ]

    def run_texts() -> list[Any]:
        return [run.texts() for run in propagate_ensemble([Problem.of(*some_top(1), DOUBLE)] * 9, TIMES)]

    expected = everything(), run_texts(), time_text(F(10**18 + 1, 10**6))
    default = decimal.DefaultContext
    before = default.prec, default.rounding, default.capitals
    strict = decimal.Context(2, decimal.ROUND_UP, capitals=0, traps=[decimal.Inexact, decimal.Rounded])
    try:
        default.prec, default.rounding, default.capitals = 2, decimal.ROUND_UP, 0
        with numpy.errstate(all="raise"), decimal.localcontext(strict):
            assert (everything(), run_texts(), time_text(F(10**18 + 1, 10**6))) == expected
    finally:
        default.prec, default.rounding, default.capitals = before


def test_a_ball_of_any_size_becomes_text_and_a_ball_again() -> None:
    for bits in (64, 20064):
        with working_precision(bits):
            value = arb(2).sqrt()
        back = ball_from(ball_text(value))
        assert (midpoint(back), radius(back)) == (midpoint(value), radius(value))
