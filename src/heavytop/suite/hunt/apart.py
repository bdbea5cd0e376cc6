"""A Python integrator of others in a process of its own, which is ended where a motion takes too long."""

from __future__ import annotations

import os
import signal
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from heavytop.errors import HeavyTopError, InputError, PeerFailed
from heavytop.integrate import peers
from heavytop.integrate.peers.command import Command, begin_row
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.integrator import ChosenIntegrator
from heavytop.precision import Precision
from heavytop.processes import ChildContext, Guard, lead_group, new_mark
from heavytop.records import FAILED, OUT_OF_TIME
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

SECONDS = 10.0
"""Of one motion, as of a row of a gate whose integrator keeps running out of time."""
_BEGIN = 60.0


class Run(NamedTuple):
    """How a run ended, and its states, one a time, in native numbers; said: why it came to nothing."""

    outcome: str
    states: Sequence[Any]
    said: str = ""


def follow(
    integrator: ChosenIntegrator, top: HeavyTop, start: State, times: Sequence[Fraction], precision: Precision
) -> Run:
    """One motion by an integrator of any kind, contained; raises InputError for what it cannot do at all."""
    try:
        if integrator.supports_ensemble or isinstance(integrator.source, Command):
            run = integrator.propagate(top, start, times, precision, HEAVY_TOP, again=False)
        else:
            which: Any = integrator.which
            run = _ready(which)(top, start, times, precision, system=HEAVY_TOP)
    except InputError:
        raise
    except HeavyTopError as error:
        return Run(FAILED, (), error.cause)
    short = run.outcome is Outcome.SUCCESS and len(run.states) < len(times)
    return Run((Outcome.INCOMPLETE if short else run.outcome).value, run.states)


@lru_cache(maxsize=4)
def _ready(which: Any) -> peers.Peer:
    """The integrator, looked up once."""
    return peers.ready(which)


class Apart:
    """A process with that integrator; a motion that it does not finish within ``seconds`` ends it, and another begins.

    What the integrator started ends with its process.
    """

    def __init__(self, integrator: ChosenIntegrator, seconds: float = SECONDS) -> None:
        self._integrator, self._seconds = integrator, seconds
        self._pool: ProcessPoolExecutor | None = None
        self._guard: Guard | None = None

    def follow(self, top: HeavyTop, start: State, times: Sequence[Fraction], precision: Precision) -> Run:
        """One motion; one that ends its process or takes too long is an outcome."""
        try:
            if self._pool is None:
                self._begin()
            assert self._pool is not None
            asked = self._pool.submit(follow, self._integrator, top, start, times, precision)
            return asked.result(timeout=self._seconds)
        except TimeoutError:
            self.end()
            return Run(OUT_OF_TIME, (), f"{self._integrator.name} was stopped after {self._seconds:.3g} s")
        except BrokenProcessPool:
            self.end()
            return Run(FAILED, (), f"{self._integrator.name} ended its whole process")

    def _begin(self) -> None:
        mark = new_mark()
        self._pool = ProcessPoolExecutor(1, mp_context=ChildContext(), initializer=lead_group, initargs=(mark,))
        try:
            process = self._pool.submit(_hello, self._integrator).result(timeout=_BEGIN)
        except TimeoutError:
            self.end()
            raise PeerFailed(f"{self._integrator.name} cannot be loaded within {_BEGIN:.3g} s") from None
        with suppress(OSError):
            self._guard = Guard(process, mark)

    def end(self) -> None:
        """Kill the process and whatever it started."""
        pool, guard, self._pool, self._guard = self._pool, self._guard, None, None
        if pool is not None:
            for process in list((pool._processes or {}).values()):
                if process.pid is not None:
                    with suppress(ProcessLookupError, PermissionError):
                        os.killpg(process.pid, signal.SIGKILL)
                process.kill()
        if guard is not None:
            guard.end()
        if pool is not None:
            pool.shutdown(wait=True, cancel_futures=True)


def _hello(integrator: ChosenIntegrator) -> int:
    """The number of the process; what the integrator imports is imported now, and not in the time of a motion."""
    begin_row()
    with suppress(HeavyTopError):
        follow(integrator, HeavyTop((3, 2, 1), 1, (0, 0, 1)), State((0, 0, 1), (0, 0, 1)), [Fraction(1)], _double())
    return os.getpid()


def _double() -> Precision:
    from heavytop.precision import DOUBLE

    return DOUBLE
