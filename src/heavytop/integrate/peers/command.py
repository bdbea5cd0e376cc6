"""Integrators that are programs: text over standard input and output, one item per line, one process for many requests.

The protocol is in docs/gate.md.  A :class:`Command` is the program that a TOML table describes, its
:meth:`Command.integrate` is the call of :mod:`heavytop.integrate.peers`, and a :class:`Session` is its running process.
Whatever the program does becomes a Trajectory that keeps the contract or PeerFailed, and its process group ends with
this process.
"""

from __future__ import annotations

import atexit
import os
import re
import select
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from errno import ENOENT
from fractions import Fraction
from itertools import pairwise
from math import ceil, inf, isfinite
from pathlib import Path
from threading import Lock
from time import monotonic
from typing import Any, Literal

import msgspec
import numpy

from heavytop.errors import InputError, PeerFailed, Unsupported, argument, why
from heavytop.guard import Guard, how_it_ended, stopwatch, waited_for_processor
from heavytop.integrate.peers.contract import DEFAULT_STEP, Declared, of_quaternion, quaternion, require_control, said
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import DOUBLE, Precision, decimal_text, exact, number, rounded, vector
from heavytop.records import UNRESOLVED_SECONDS
from heavytop.top.bodies import Body
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State, check_times
from heavytop.top.inertia_slips import six_of
from heavytop.written_numbers import number as written_number

HELLO = "heavytop-integrator 1"
PYTHON = "{python}"
"""In a command, the Python interpreter of heavytop."""
COMMAND_REMEDY = (
    "Build it, or correct `command`: a program on the PATH or relative to its file, each argument an item of its own."
)
NOT_COUNTED = {"steps": "not counted"}
"""The flag of a run whose program did not report its number of steps."""
_MOST_LINE = 1 << 20
_MOST_ERRORS = 2000
_CHUNK = 1 << 16
_LOOK = 0.1
"""Seconds between two checks that a silent program still runs."""
_AWAKE = 2e-4
"""Seconds of busy waiting for an answer: a wake-up takes 1e-4."""
_FAREWELL = 0.3
"""Seconds that a program has to end after `quit`."""
_MOST_OVERHEAD = 1e-3
"""At most so many seconds of a request without times are subtracted: a program may do anything in it."""
_LEAST_SHARE = 0.1
"""The smallest fraction of the seconds of a request that remains: noise prevents finer measurements."""
_RESOLUTION = 1e-4
"""Scatter in seconds of requests without times on a busy machine; shorter times are not resolved."""
_DECIMAL = rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_STATE_OF_DOUBLES = {width: re.compile(rb"state(?:[ \t]+" + _DECIMAL + rb"){%d}" % (1 + width)) for width in (6, 7, 9)}
_PAIRS = {"steps": int, "evaluations": int, "seconds": float, "joint": float}


class Command(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A program that integrates, described by a table `[[integrator]]`.

    name: in rows.  command: program and arguments, relative to ``folder``.  setting: its control parameter.
    precisions, systems, directions, attitude, one_step, fixed_grid, singular_at: its declared capabilities, as
    :class:`heavytop.integrate.peers.contract.Declared`.  timeout: seconds of one request.
    hex: whether it reads hexadecimal numbers.  bodies: whether it reads a body with mass, gravity and the tensor about
    the centre of mass.  folder: of the file; its working directory.
    """

    name: str
    command: tuple[str, ...]
    setting: Literal["step", "tolerance", "none"] = "tolerance"
    order: int = 0
    precisions: tuple[str, ...] = (DOUBLE.name,)
    language: str = ""
    timeout: str | int | float = "600"
    systems: tuple[str, ...] = (HEAVY_TOP.name,)
    directions: tuple[Literal["forward", "backward"], ...] = ("forward", "backward")
    attitude: bool | Literal["quaternion"] = False
    one_step: bool = True
    fixed_grid: bool = False
    singular_at: tuple[tuple[str | int | float, str | int | float, str | int | float], ...] = ()
    hex: bool = False
    bodies: bool = False
    folder: str = ""

    @property
    def control(self) -> str:
        """Its control parameter: "step", "tolerance", or "" for neither."""
        return "" if self.setting == "none" else self.setting

    @property
    def seconds(self) -> float:
        """The time limit of one request."""
        return float(exact(str(self.timeout)))

    @property
    def declared(self) -> Declared:
        """Its capabilities."""
        singular = tuple(vector(map(str, point), "singular_at") for point in self.singular_at)
        able = self.systems, self.directions, self.precisions, self.attitude
        return Declared(*able, self.one_step, self.fixed_grid, singular)

    def request(self, problem: Problem, times: Sequence[Fraction], setting: Fraction | None) -> ProgramRequest:
        """A request in its declared form; raises Unsupported if it needs a body and none has these moments."""
        top = (problem.given or (problem.top, problem.start))[0]
        body = Body.realising(top) if self.bodies else None
        if self.bodies and body is None:
            raise Unsupported(
                f"{self.name} needs a rigid body, and no rigid body has these moments.",
                "`heavytop list` marks the cases that are rigid bodies.",
            )
        return ProgramRequest(problem, times, setting, self.hex, self.attitude == "quaternion", body)

    def load(self) -> Callable[..., Trajectory]:
        """:meth:`integrate`; nothing is started yet."""
        return self.integrate

    def argv(self) -> list[str]:
        """The program as an absolute path and its arguments; raises PeerFailed if it is missing."""
        program, *arguments = (sys.executable if part == PYTHON else part for part in self.command)
        path = str(Path(self.folder, program)) if "/" in program else shutil.which(program) or ""
        wrong = "is a folder" if os.path.isdir(path) else "does not exist" if not os.path.isfile(path) else ""
        if wrong or not os.access(path, os.X_OK):
            raise PeerFailed(f"{self.name}: the program {said(program)} {wrong or 'is not executable'}", COMMAND_REMEDY)
        return [os.path.abspath(path), *arguments]

    def integrate(
        self,
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        precision: Precision = DOUBLE,
        *,
        system: System = HEAVY_TOP,
        xi: tuple[Fraction, ...] | None = None,
        **control: Fraction,
    ) -> Trajectory:
        """The call of :mod:`heavytop.integrate.peers`; it is timed without the overhead of a request.

        Raises Unsupported for requests outside of the declared capabilities, InputError for a control parameter that
        the program does not have, PeerFailed for any other fault.  If the program reports ``failed``, the result is the
        Trajectory so far with the outcome ``failed``.
        """
        instants = check_times(times)
        declared = self.declared
        declared.require(self.name, start, system, instants[-1], precision, xi)
        value = self._control_value(control, precision)
        if value is not None and self.control == "step":
            value = rounded(declared.step(self.name, value, instants, precision), precision)
        problem = Problem.of(top, start, precision, system, xi)
        grid = [rounded(time, precision) for time in instants]
        request = self.request(problem, grid, value)
        with session(self) as program:
            overhead = program.empty_request(problem, value)
            reply = program.ask(request)
        return self._trajectory(request, reply, max(reply.wall - overhead, _LEAST_SHARE * reply.wall))

    def _control_value(self, settings: dict[str, Fraction], precision: Precision) -> Fraction | None:
        control = self.control
        for name in settings:
            if name != control:
                remedy = f"Leave it out: {argument(control)} sets its accuracy." if control else "Leave it out."
                raise InputError(f"The integrator {self.name} does not support {argument(name)}.", remedy)
        if not control:
            return None
        value = settings.get(control)
        if value is None:
            return self.default(precision)
        require_control(self.name, control, value)
        return rounded(value, precision)

    def default(self, precision: Precision) -> Fraction | None:
        """The default of its control parameter: the step 1/100 rounded to the format, or the eps of the format."""
        if self.control == "step":
            return rounded(DEFAULT_STEP, precision)
        return precision.eps if self.control else None

    def _trajectory(self, request: ProgramRequest, reply: Reply, seconds: float) -> Trajectory:
        problem, reached = request.problem, len(reply.states)
        flags = {self.control: number_text(request.control, problem.precision)} if request.control else {}
        steps = reply.counts.get("steps")
        if steps is None and self.control == "step" and not reply.failure:
            assert request.control is not None
            steps = sum(ceil(abs(b - a) / request.control) for a, b in pairwise([Fraction(0), *request.times]))
        if steps is None:
            flags |= NOT_COUNTED
        if reply.failure:
            flags["failure"] = reply.failure
        states = reply.states
        if request.quaternion:
            states = [of_quaternion(self.name, problem, state) for state in states]
        spent = {"compile": 0.0, "run": seconds} | ({UNRESOLVED_SECONDS: _RESOLUTION} if seconds < _RESOLUTION else {})
        program_seconds = reply.counts.get("seconds")
        return Trajectory(
            problem,
            self.name,
            tuple(request.times[:reached]),
            tuple(states),
            Outcome.FAILED if reply.failure else Outcome.SUCCESS,
            request.times[reached - 1] if reached else Fraction(0),
            int(steps or 0),
            self.order,
            spent if program_seconds is None else spent | {"program": program_seconds},
            flags,
            reply.counts.get("evaluations"),
            joint_violation=reply.counts.get("joint"),
        )


def number_text(value: Fraction, precision: Precision, hexadecimal: bool = False) -> str:
    """Text of a number of the format that reads back as exactly this number."""
    if hexadecimal:
        return f"{'-' if value < 0 else ''}0x{abs(value.numerator):x}p{1 - value.denominator.bit_length()}"
    return f"{float(value):.17g}" if precision == DOUBLE else decimal_text(value, precision.digits)


@dataclass(frozen=True, slots=True)
class ProgramRequest:
    """A problem with its times, as the text sent to a program.

    times: exact numbers of the format; none for an empty request.  control: a number of the format, or None.
    hexadecimal: form of the numbers.  quaternion: whether the program computes with one: it receives that of the start,
    and answers (Ω, w, x, y, z).  body: for a program that reads one.
    """

    problem: Problem
    times: Sequence[Fraction]
    control: Fraction | None
    hexadecimal: bool
    quaternion: bool = False
    body: Body | None = None

    @property
    def width(self) -> int:
        """The components of a state of the answer."""
        return 7 if self.quaternion else 6 if self.problem.xi is None else 9

    def text(self, label: int) -> bytes:
        """The lines of the request."""
        p, precision = self.problem.parameters, self.problem.precision
        rotor = (0, p.rotor, 0) if self.problem.system is GYROSTAT else p.rotors if len(p.rotors) == 3 else (0, 0, 0)
        lines = {
            "run": [str(label)],
            "system": [self.problem.system.name],
            "inertia": self._numbers(p.inertia),
            "moment": self._numbers(p.moment),
            "rotor": self._numbers(rotor),
            "state": self._numbers([*self.problem.start.flat, *(self.problem.xi or ())]),
            "quaternion": self._rounded(quaternion(self.problem)) if self.quaternion else [],
            "precision": [precision.name],
            "setting": self._numbers([] if self.control is None else [self.control]),
            "times": [str(len(self.times)), *self._numbers(self.times)],
        }
        if self.body is not None:
            lines |= {f"body {name}": self._rounded(values) for name, values in self._body(self.body).items()}
        return "".join(f"{name} {' '.join(words)}\n" for name, words in lines.items() if words).encode() + b"go\n"

    def _body(self, body: Body) -> dict[str, Sequence[Fraction]]:
        scalars: dict[str, Sequence[Fraction]] = {"mass": [body.mass], "gravity": [body.gravity]}
        about_centre = {"centre": body.centre, "inertia": six_of(body.central)}
        return scalars | about_centre | {"attitude": quaternion(self.problem)}

    def _rounded(self, values: Sequence[Fraction]) -> list[str]:
        return self._numbers([rounded(value, self.problem.precision) for value in values])

    def _numbers(self, values: Sequence[Any]) -> list[str]:
        return [number_text(Fraction(value), self.problem.precision, self.hexadecimal) for value in values]


class Reply:
    """The answer of a program: states, counts, and a reported failure; wall: its seconds, measured here."""

    def __init__(self, name: str, request: ProgramRequest) -> None:
        self.name, self.request = name, request
        self.precision = request.problem.precision
        self.states: list[Any] = []
        self.counts: dict[str, Any] = {}
        self.failure = ""
        self.wall = 0.0
        self._doubles = [float(time) for time in request.times] if self.precision == DOUBLE else []
        self._pattern = _STATE_OF_DOUBLES[request.width]

    def take(self, line: bytes) -> bool:
        """Read a line; return whether it is the last.  Raises PeerFailed for a line that breaks the protocol."""
        if self._doubles and self._pattern.fullmatch(line):
            time, *values = map(float, line.split()[1:])
            if (
                len(self.states) < len(self._doubles)
                and time == self._doubles[len(self.states)]
                and isfinite(sum(values))
            ):
                self.states.append(numpy.array(values))
                return False
        words = self._words(line)
        if words[0] == "state":
            self._take_state(words[1:])
            return False
        if words[0] == "failed":
            self.failure = said(" ".join(words[1:])) or "without a reason"
            return True
        if words[0] != "done":
            raise PeerFailed(f"{self.name} wrote {said(repr(' '.join(words)))}, which the protocol does not know")
        self._take_counts(words[1:])
        if len(self.states) < len(self.request.times):
            raise PeerFailed(f"{self.name} said done after {len(self.states)} of {len(self.request.times)} states")
        return True

    def _words(self, line: bytes) -> list[str]:
        try:
            return line.decode("utf-8").split() or [""]
        except UnicodeDecodeError:
            raise PeerFailed(f"{self.name} wrote {said(line[:40])}, which is not UTF-8") from None

    def _take_state(self, words: list[str]) -> None:
        index, width = len(self.states), self.request.width
        if index >= len(self.request.times):
            raise PeerFailed(f"{self.name} wrote more states than the {index} times that it was asked for")
        if len(words) != 1 + width:
            raise PeerFailed(f"{self.name} wrote a state of {len(words) - 1} numbers after its time instead of {width}")
        time, *values = (self._number(word) for word in words)
        due = self.request.times[index]
        if time is None or exact(time) != due:
            shown = decimal_text(due, 17)
            raise PeerFailed(f"{self.name} wrote the state at {said(words[0])} where that at {shown} was due")
        if any(value is None or not numpy.isfinite(value) for value in values):
            raise PeerFailed(f"{self.name} wrote a state that is not finite at t = {said(words[0])}", answered=True)
        self.states.append(numpy.array(values))

    def _number(self, word: str) -> Any:
        """A number of the format; None for NaN and infinities."""
        try:
            value = written_number(word, "a number")
            return None if value is None else number(value, self.precision)
        except InputError as error:
            comma = ": write a decimal point, not a comma" if "," in word else ""
            if not comma and "outside the exponent range" in error.cause:
                comma = f": outside the range of {self.precision.name}"
            raise PeerFailed(f"{self.name} wrote {said(repr(word))}, which is not a number{comma}") from None

    def _take_counts(self, words: list[str]) -> None:
        if len(words) % 2:
            raise PeerFailed(f"{self.name} wrote done {said(' '.join(words))}, not names and numbers by turns")
        for name, word in zip(words[::2], words[1::2], strict=True):
            if name not in _PAIRS:
                continue
            try:
                value = _PAIRS[name](word) if word.isascii() and "_" not in word else -1
            except ValueError:
                value = -1
            if not 0 <= value < inf:
                raise PeerFailed(f"{self.name} counts {said(word)} {name}")
            self.counts[name] = value


class Session:
    """A running program, which serves requests one after another.

    After an exception the caller must :meth:`close` it.  greeting: the text after ``ready``.
    """

    def __init__(self, command: Command) -> None:
        self.command, self.name = command, command.name
        self.requests = 0
        self._overhead, self._began_row = _MOST_OVERHEAD, False
        self._unread, self._errors = b"", b""
        argv = command.argv()
        self._guard = Guard()
        try:
            self.process = subprocess.Popen(
                argv,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                cwd=command.folder or None,
                bufsize=0,
                process_group=self._guard.group,
                env={**os.environ, **self._guard.environment},
            )
        except OSError as error:
            self._guard.end()
            cause = "its interpreter does not exist" if error.errno == ENOENT else why(error)
            raise PeerFailed(f"{self.name} cannot be started: {cause}", COMMAND_REMEDY) from None
        self._pipes = [pipe for pipe in (self.process.stdin, self.process.stdout, self.process.stderr) if pipe]
        self._in, self._out, self._err = (pipe.fileno() for pipe in self._pipes)
        for descriptor in (self._in, self._out, self._err):
            os.set_blocking(descriptor, False)
        self._poll = select.poll()
        self._poll.register(self._out, select.POLLIN)
        self._poll.register(self._err, select.POLLIN)
        try:
            self._exchange(f"{HELLO}\n".encode(), self._greet, "ready")
        except BaseException:
            self.close()
            raise

    def _greet(self, line: bytes) -> bool:
        """Read the first line of the program; raises PeerFailed unless it is ``ready NAME VERSION``."""
        text = line.decode("utf-8", "replace")
        if text.split()[:1] != ["ready"]:
            raise PeerFailed(f"{self.name} began with {said(repr(text))} instead of ready NAME VERSION")
        self.greeting = said(text.partition("ready")[2])
        return True

    def empty_request(self, problem: Problem, control: Fraction | None) -> float:
        """Seconds of a request without times, made once per row: the minimum over this process, at most 1 ms."""
        if not self._began_row:
            for _ in range(1 if self.requests else 2):  # the first request of a process is slow
                wall = self.ask(self.command.request(problem, [], control)).wall
                self._overhead = min(self._overhead, wall)
            self._began_row = True
        return self._overhead

    def end_row(self) -> None:
        """Let the next request begin a row."""
        self._began_row = False

    @property
    def lost_between_rows(self) -> bool:
        """Whether the program ended by itself between two rows."""
        return not self._began_row and self.process.poll() is not None

    def ask(self, request: ProgramRequest, limit: float = inf) -> Reply:
        """The answer to a request; raises PeerFailed if it breaks the protocol, or takes longer than the timeout or
        ``limit`` seconds.
        """
        self.requests += 1
        reply = Reply(self.name, request)
        text = request.text(self.requests)
        seconds = stopwatch(self.process.pid)
        awaited = "done" if request.times else "done to a request without times"
        reply.wall = seconds(self._exchange(text, reply.take, awaited, limit))
        return reply

    def _exchange(self, text: bytes, take: Callable[[bytes], bool], awaited: str, seconds: float = inf) -> float:
        """Write ``text``, and pass lines to ``take`` until it returns True; no output may follow.

        Returns the seconds without a processor of this thread since it last found nothing to read.
        """
        began, seconds = monotonic(), min(seconds, self.command.seconds)
        deadline, awake_until, idle_since = began + seconds, began + _AWAKE, waited_for_processor()
        unsent = self._write(memoryview(text))
        if unsent:
            self._poll.register(self._in, select.POLLOUT)
        while True:
            if unsent and not (unsent := self._write(unsent)):
                self._poll.unregister(self._in)
            if self._lines(take):
                return waited_for_processor() - idle_since
            remaining = deadline - monotonic()
            if remaining <= 0:
                raise self._failed(f"did not say {awaited} within {seconds:g} s", answered=True)
            busy_waiting = not unsent and monotonic() < awake_until
            waited = waited_for_processor()
            events = self._poll.poll(0)
            if not events:
                idle_since = waited
                if busy_waiting:
                    continue
                events = self._poll.poll(1000 * min(remaining, _LOOK))
            if not events and self.process.poll() is not None and not self._drained():
                raise self._failed(f"{self._end()} before it said {awaited}")
            self._receive([descriptor for descriptor, _ in events], awaited)

    def _write(self, unsent: memoryview) -> memoryview:
        with suppress(BlockingIOError):
            try:
                unsent = unsent[os.write(self._in, unsent) :]
            except BrokenPipeError:  # it reads no more; what it wrote before is still read
                unsent = memoryview(b"")
        return unsent

    def _lines(self, take: Callable[[bytes], bool]) -> bool:
        """Pass the complete lines received so far to ``take``; whether the last one was among them."""
        if b"\n" not in self._unread:
            if len(self._unread) > _MOST_LINE:
                raise self._failed(f"wrote a line of more than {_MOST_LINE} characters")
            return False
        *lines, self._unread = self._unread.split(b"\n")
        for count, line in enumerate(lines, 1):
            try:
                last = take(line)
            except PeerFailed as error:
                raise self._failed(error.cause.removeprefix(f"{self.name} "), error.answered) from None
            if last:
                if count < len(lines) or self._unread:
                    raise self._failed(f"wrote more after {said(repr(line.decode('utf-8', 'replace')))}")
                return True
        return False

    def _receive(self, readable: list[int], awaited: str) -> None:
        if self._err in readable:
            self._read_errors()
        if self._out in readable:
            data = self._read(self._out)
            if data == b"":
                raise self._failed(f"{self._end()} before it said {awaited}")
            self._unread += data or b""

    def _drained(self) -> bool:
        """Whether a program that has ended left unread output."""
        data = self._read(self._out)
        self._unread += data or b""
        return bool(data)

    def _read(self, descriptor: int) -> bytes | None:
        """The available bytes; empty at the end of the file, None if there are none yet."""
        try:
            return os.read(descriptor, _CHUNK)
        except BlockingIOError:
            return None

    def _read_errors(self) -> None:
        data = self._read(self._err)
        if data == b"":
            with suppress(KeyError):
                self._poll.unregister(self._err)
        self._errors = (self._errors + (data or b""))[-_MOST_ERRORS:]

    def _end(self) -> str:
        with suppress(subprocess.TimeoutExpired):
            code = self.process.wait(_FAREWELL)
            return f"{'ended' if code >= 0 else 'was ended'} {how_it_ended(code)}"
        return "closed its output"

    def _failed(self, what: str, answered: bool = False) -> PeerFailed:
        """The error, with the last lines of the program's standard error."""
        for _ in range(4):
            self._read_errors()
        lines = [said(line) for line in self._errors.decode("utf-8", "replace").splitlines() if line.strip()]
        ending = f"; its standard error ends with: {said(' | '.join(lines[-3:])[-180:])}" if lines else ""
        return PeerFailed(f"{self.name} {what}{ending}", answered=answered)

    def ends_after(self, text: bytes, seconds: float) -> bool:
        """Whether the program ends by itself within ``seconds`` of ``text``; its input is closed if that is empty."""
        with suppress(OSError):
            os.write(self._in, text)
        if not text:
            self._pipes[0].close()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(seconds)
            return True
        return False

    def close(self, farewell: float = 0.0) -> None:
        """End the program: send `quit`, wait ``farewell`` seconds, kill its process group."""
        with suppress(OSError):
            os.write(self._in, b"quit\n")
        for pipe in self._pipes:
            with suppress(OSError):
                pipe.close()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(farewell)
        self._guard.end()
        self.process.wait()


_idle: dict[Command, list[Session]] = {}
_lock = Lock()


@contextmanager
def session(command: Command) -> Iterator[Session]:
    """A running program for this thread alone; closed if the block raises, else kept for the next request."""
    with _lock:
        sessions = _idle.get(command, [])
        program = sessions.pop() if sessions else None
    if program is not None and program.lost_between_rows:
        program.close()
        program = None
    program = program or Session(command)
    try:
        yield program
    except BaseException:
        program.close()
        raise
    with _lock:
        _idle.setdefault(command, []).append(program)


def begin_row() -> None:
    """Let each program serve a request without times before the next one: its seconds are the overhead."""
    with _lock:
        for programs in _idle.values():
            for program in programs:
                program.end_row()


def close_all() -> None:
    """End every idle program."""
    with _lock:
        programs = [program for sessions in _idle.values() for program in sessions]
        _idle.clear()
    for program in programs:
        program.close(_FAREWELL)


atexit.register(close_all)


def greeting(command: Command) -> str:
    """Name and version that the program reports; raises PeerFailed after its timeout."""
    program = Session(command)
    program.close(_FAREWELL)
    return program.greeting
