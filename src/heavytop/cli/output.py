"""Standard output and standard error as the caller left them: closed, full, read by nobody, in any encoding."""

from __future__ import annotations

import errno
import io
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Timer
from time import perf_counter
from typing import Any, Self, TextIO

from heavytop import records
from heavytop.errors import HeavyTopError

_LOSSY = {"strict": "replace", "surrogateescape": "replace"}
_own: TextIO | None = None
_CAUSES = {errno.EBADF: "it is closed"}


class OutputError(HeavyTopError):
    """Standard output that cannot be written: the result is lost, and nobody may take the exit code for a result."""


class ReaderGone(Exception):
    """The program that reads standard output has ended, as `head` does: no error, and no more output."""


class _Output(io.FileIO):
    """Standard output, whose failures are distinguished from those of files."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            raise ReaderGone from None
        except OSError as error:
            cause = _CAUSES.get(error.errno or 0, str(error.strerror))
            raise OutputError(f"Standard output cannot be written: {cause}.", "Redirect it to a file.") from None


class _Messages(io.FileIO):
    """Standard error: messages that cannot be written are dropped, with no other effect."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except OSError:
            return len(data)


def prepare() -> None:
    """Replace the streams of this process by those of this module, where they are its own and not a caller's."""
    # a file opened later must not get the number of a closed stream; from a null device opened the wrong way round
    # reading or writing fails as it would from the closed one
    for number, flags in ((0, os.O_WRONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, flags)
            if null != number:
                os.dup2(null, number)
                os.close(null)
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115
    if sys.stdout is sys.__stdout__:
        sys.stdout = _stream(_Output(1, "w", closefd=False), sys.stdout, "strict")
    if sys.stderr is sys.__stderr__:
        global _own
        _own = _stream(_Messages(os.dup(2), "w"), sys.stderr, "backslashreplace")
        sys.stderr = _stream(_Messages(2, "w", closefd=False), sys.stderr, "backslashreplace")


def _stream(raw: io.FileIO, before: Any, errors: str) -> io.TextIOWrapper:
    """Text into ``raw``, as ``before`` encoded it, but that a character which the encoding lacks is replaced."""
    encoding = "utf-8" if before is None else before.encoding
    errors = errors if before is None else before.errors
    if before is not None:
        before.flush()
    by_line = isinstance(raw, _Messages) or raw.isatty()
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding, _LOSSY.get(errors, errors), line_buffering=by_line)


def drop_output() -> None:
    """Discard what is still buffered, so that the end of the process does not try to write it again."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)


def messages() -> TextIO:
    """The stream of messages to people: standard error, also while a third-party integrator is silenced."""
    return _own or sys.stderr


def say(text: str) -> None:
    """A message for people."""
    print(f"heavytop: {text}", file=messages(), flush=True)


def say_former(names: Iterable[str]) -> None:
    """Print a note for each former name of an integrator among these."""
    for name in sorted(set(names)):
        if text := records.notice(name):
            say(f"note: {text}")


def printable(document: str) -> str:
    """A JSON document in the encoding of standard output: characters that it lacks are escaped."""
    try:
        document.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        import json

        return json.dumps(json.loads(document), indent=1)
    return document


# How far a command has come, on standard error: a bar on a terminal, and everywhere a line when it takes long.


_TRUST, _MEASURED = 0.05, 0.1
"""The expected speed counts at first as much as a twentieth of the work, and no more when a tenth of it is done."""
_EVEN = 1e-12
"""The trust of work that proceeds evenly, whose speed shows at once."""
_EVERY = 0.5
"""Seconds between two drawings of a bar."""
SILENCE = 10.0
"""Seconds after which a command says what it is doing."""
_open: list[Bar] = []
"""The bars of the work under way in this process, the innermost last."""


class Estimator:
    """How long work of known weight will still take.

    total: the sum of the weights of its parts.  expected: seconds for a weight of 1, before anything was measured.
    clock: seconds from any moment on.  trust: how much of the work the expected speed counts as at first.

    When a tenth is done, its speed alone counts.  Then the estimate is right within a factor of 2 if the weights of
    what is done and of what is left are wrong by factors that differ by less than 2.
    """

    def __init__(
        self, total: float, expected: float = 1.0, clock: Callable[[], float] = perf_counter, trust: float = _TRUST
    ) -> None:
        self._trust = trust
        self.total = max(total, 0.0)
        self.done = 0.0
        self._expected = expected
        self._clock = clock
        self._began = self._last = clock()

    def advance(self, weight: float) -> None:
        """A part is done, now."""
        self.done = min(self.total, self.done + weight)
        self._last = self._clock()

    def reach(self, done: float) -> None:
        """So much in all is done, now; never less than before."""
        if done > self.done:
            self.advance(done - self.done)

    @property
    def fraction(self) -> float:
        """How much of the work is done, 0 to 1."""
        return self.done / self.total if self.total else 1.0

    def seconds_left(self) -> float:
        """An estimate; 0 when all is done."""
        if self.done >= self.total:
            return 0.0
        trust = self._trust * self.total * max(0.0, 1 - self.fraction / _MEASURED)
        speed = (self._last - self._began + trust * self._expected) / (self.done + trust)
        # since the last part ended, work went on that has not been counted
        return max((self.total - self.done) * speed - (self._clock() - self._last), 0.0)


def duration(seconds: float) -> str:
    """A time to wait in short: 8 s, 1:05, 2:03:00."""
    minutes, seconds = divmod(math.ceil(seconds), 60)
    if not minutes:
        return f"{seconds} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


@contextmanager
def told_when_slow(command: str) -> Iterator[None]:
    """Say once, after :data:`SILENCE`, what the command is doing and how far it has come."""
    began = perf_counter()

    def tell() -> None:
        so_far = f"{command}: {duration(perf_counter() - began)} so far"
        if not _open:
            say(f"{so_far}, going on")
        elif (bar := _open[-1]).live:
            bar.console.print(f"heavytop: {so_far}, {bar.state()}", markup=False, highlight=False, soft_wrap=True)
        else:
            say(f"{so_far}, {bar.state()}")

    timer = Timer(SILENCE, tell)
    timer.daemon = True
    with suppress(RuntimeError):  # no thread to be had
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


class Bar:
    """A line that a terminal draws twice a second: parts done, of how many, per cent, time left.

    count: how many parts there are, named by ``unit``; 0 where they are not counted.  label: the work under way.
    """

    look: Callable[[], None] | None = None
    """Called before the state is read, for work that does not report by itself."""

    def __init__(
        self, estimator: Estimator, count: int = 0, unit: str = "rows", label: str = "", console: Any = None
    ) -> None:
        from rich.console import Console
        from rich.live import Live

        self.estimator, self.count, self.unit, self.label, self.finished = estimator, count, unit, label, 0
        self.console = console or Console(file=messages())
        self.live = bool(self.console.is_terminal)
        self._drawing = Live(
            console=self.console, get_renderable=self._drawn, refresh_per_second=1 / _EVERY, transient=True
        )

    def _drawn(self) -> Any:
        from rich.progress_bar import ProgressBar
        from rich.table import Column, Table
        from rich.text import Text

        self.state()
        line = Table.grid(Column(no_wrap=True), Column(), Column(no_wrap=True), padding=(0, 1))
        fraction = ProgressBar(1.0, self.estimator.fraction, width=40)
        line.add_row(Text(self.label[:40] or "starting"), fraction, Text(self.said()))
        return line

    def said(self) -> str:
        """Parts done of all, per cent, time left."""
        counted = f"{self.finished}/{self.count} {self.unit}" if self.count else ""
        percent, left = 100 * self.estimator.fraction, self.estimator.seconds_left()
        if not percent:  # the seconds expected of a row say nothing of what nobody has measured
            return counted or "how far is not known"
        percent_text = f"{percent:.1g} %" if 0 < percent < 1 else f"{percent:.0f} %"
        time_left = f"about {duration(left)} left" if left or percent == 100 else "longer than expected"
        return ", ".join(filter(None, (counted, percent_text, time_left)))

    def state(self) -> str:
        """The work under way and how far it is, in a line."""
        if self.look is not None:
            self.look()
        return ": ".join(filter(None, (self.label, self.said())))

    def __enter__(self) -> Self:
        if self.live:
            self._drawing.start(refresh=True)
        _open.append(self)
        return self

    def __exit__(self, *_: object) -> None:
        _open.remove(self)
        self._drawing.stop()


class Progress(Bar):
    """The bar of a run, called with each finished task.

    kinds: of measurement, by name, which know what a task costs.  workers: how many tasks run at once.
    """

    def __init__(self, tasks: Sequence[Any], kinds: Any, workers: int = 1) -> None:
        self.kinds = kinds
        super().__init__(Estimator(sum(map(self._cost, tasks)), 1 / max(workers, 1)), len(tasks))

    def begin(self, task: Any) -> None:
        """Name the task that is running."""
        self.label = task.label

    def __call__(self, task: Any) -> None:
        self.finished += 1
        self.estimator.advance(self._cost(task))

    def _cost(self, task: Any) -> float:
        cost: float = self.kinds[task.key.kind].cost(task)
        return cost


@contextmanager
def counted(label: str, count: int, unit: str, expected: float) -> Iterator[Callable[[], None]]:
    """A bar over ``count`` parts of equal weight; yields a function to call after each.  expected: seconds of one."""
    with Bar(Estimator(count, expected), count, unit, label) as bar:

        def advance() -> None:
            bar.finished += 1
            bar.estimator.advance(1)

        yield advance


@contextmanager
def followed(label: str, unit: str, expected: float) -> Iterator[Callable[[int, int], None]]:
    """A bar over parts whose number is found on the way; yields a function of how many are done, of how many."""
    with Bar(Estimator(1.0, expected), 0, unit, label) as bar:

        def advance(done: int, of: int) -> None:
            bar.finished, bar.count = done, of
            bar.estimator.reach(done / of)

        yield advance


@contextmanager
def reaching(label: str, expected: float) -> Iterator[Callable[[float], None]]:
    """A bar over work that proceeds evenly; yields a function of the fraction that is done."""
    with Bar(Estimator(1.0, expected, trust=_EVEN), label=label) as bar:
        yield bar.estimator.reach


@contextmanager
def waiting(label: str, most: float) -> Iterator[None]:
    """A bar over work that cannot report and is stopped after ``most`` seconds: the fraction of these that is over."""
    began = perf_counter()
    with watched(f"{label}, {duration(most)} at most", lambda: (perf_counter() - began) / most, most):
        yield


@contextmanager
def watched(label: str, fraction: Callable[[], float], expected: float) -> Iterator[None]:
    """A bar over work that does not report: ``fraction`` is called for the part done, from another thread."""
    with Bar(Estimator(1.0, expected), label=label) as bar:
        bar.look = lambda: bar.estimator.reach(fraction())
        yield
