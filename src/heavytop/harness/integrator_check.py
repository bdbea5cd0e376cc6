"""Checks of the contract of an integrator by ordinary and unusual requests, reported in sentences.

Nothing is scored here: of accuracy only agreement to 5 % is required.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from math import ceil, inf, log
from typing import Any, Literal, NamedTuple

import msgspec

from heavytop.cases import CASES
from heavytop.errors import HeavyTopError, InputError, NoSuchIntegrator, PeerFailed, Unsupported
from heavytop.integrate import registry
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.peers.command import (
    COMMAND_REMEDY,
    Command,
    ProgramRequest,
    Session,
    begin_row,
    close_all,
    session,
)
from heavytop.integrate.peers.contract import Declared, said
from heavytop.integrate.registry import IntegratorSource, described
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import (
    DOUBLE,
    Precision,
    Vector,
    decimal_text,
    exact,
    parse,
    real,
    round_to,
    rounded,
    six_digits,
    vector,
)
from heavytop.processes import GuardedProcess
from heavytop.top.attitude import perpendicular
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

_PATIENCE = 60
"""Largest seconds of one request, unless the timeout of the integrator is shorter."""
_FAREWELL = 2.0
_LARGEST_ERROR = 0.05
"""Largest error of a state at |t| <= 10, relative to its largest component; beyond it the motion is another one."""
_ATTITUDE_TIMES = (Fraction(1, 4), Fraction(1), Fraction(3, 2), Fraction(2))
_BACKWARD_RATIO = 100
"""Largest ratio of the error of a motion backward in time to that of its mirror image."""
_RESTART_EPS = 1000
"""Allowed difference, in eps, of a run that is restarted half way, whatever its error."""
_ERROR_MULTIPLE = 10
"""Allowed difference in units of the error of the run: for multistep methods, and those that choose steps anew."""
_REPRESENTATION_EPS = 16
"""Allowed difference, in eps, of a start that is represented otherwise, for example by a quaternion."""
_HUGE = 10**150
_HUGE_REQUEST = "At |Ω| = 1e150, t = 1"
_MANY = [Fraction(i, 500) for i in range(1, 1001)]
_BETWEEN = [Fraction(2 * i, 41) for i in range(1, 42)]
"""Times at which no step is likely to end."""
_CONTROLS = {
    "tolerance": (Fraction(1, 10**6), Fraction(1, 10**9), Fraction(1, 10**12)),
    "step": (Fraction(1, 10), Fraction(1, 20), Fraction(1, 500)),
}
"""Two values of a control, and one for an integrator whose steps have a limit."""
_DENSE_RATIO = 30
"""Largest ratio of the error between steps to that at the ends of runs."""
_LINEAR_ORDER, _LEAST_DENSE_ORDER, _ORDER_MARGIN = 1.5, 2.5, 0.5
"""Least order of linear interpolation, which has 2, and of other dense output; its allowed gap below the method's."""
NOT_TRIED = (
    "Not tested here: accuracy, order, run time, and states kept from earlier calls. A plan measures these: "
    "heavytop run --plan gate --integrator NAME."
)
_READING = "check the order of the components, the signs and how the parameters are read"
_SAMPLING = "without other samples a run to t = 1 is right, so check the last step before each sample"
_HEAVY_TOP = ("heavy_top",)
_CASES = {"heavy_top": "generic", "gyrostat": "gyrostat", "heavy_gyrostat": "heavy-gyrostat"}

Verdict = Literal["kept", "violated", "note"]


class _Between(NamedTuple):
    """The largest errors between steps and at the ends of runs; the steps of the longest run; the declared order."""

    between: Fraction
    ends: Fraction
    steps: int
    order: int


@dataclass(frozen=True, slots=True)
class Checked:
    """One part of the contract: its name, the verdict, and the observation in a sentence."""

    check: str
    verdict: Verdict
    text: str


def check(which: str | IntegratorSource) -> list[Checked]:
    """Checks every part of the contract of an integrator, given by its name or its source.

    A Python integrator runs in a process of its own, which is killed where one part takes more than a minute.
    Raises InputError for an unknown integrator.
    """
    registry.require(which)
    process = None
    if isinstance(which, Command):
        which = msgspec.structs.replace(which, timeout=str(min(which.seconds, _PATIENCE)))
    else:
        process = GuardedProcess()
    try:
        return list(_checks(which, process))
    finally:
        close_all() if process is None else process.end()


def _checks(which: str | IntegratorSource, process: GuardedProcess | None) -> Iterator[Checked]:
    """Each part in turn, up to a violation of one of the first or one that ended the process."""
    systems = _HEAVY_TOP if process is None else _declared_systems(process, which)
    for index, (name, _) in enumerate(_Contract(which, systems).parts()):
        part = partial(_part, which, systems, index)
        checked, ended = (part(), False) if process is None else _in_child(process, part, name)
        yield checked
        if checked.verdict == "violated" and (ended or index < _FIRST):
            yield Checked("rest of the contract", "note", "Not tested, because of the violation above.")
            return


def _declared_systems(process: GuardedProcess, which: str | IntegratorSource) -> Sequence[str]:
    """The systems that a Python integrator supports; where it cannot be read its parts say why."""
    future = process.submit(_systems, which)
    with suppress(TimeoutError):
        if future.exception(timeout=_PATIENCE) is None:
            return future.result()
    return _HEAVY_TOP


def _systems(which: str | IntegratorSource) -> Sequence[str]:
    return described(which).declared.systems or _HEAVY_TOP


def _in_child(process: GuardedProcess, part: Callable[[], Checked], name: str) -> tuple[Checked, bool]:
    """One part, checked in the process, and whether that ended the process."""
    seconds = _PATIENCE_OF.get(name, _PATIENCE)
    try:
        future = process.submit(part)
        # an interrupt from the child was raised by the integrator
        error = future.exception(timeout=seconds)
        if error is None:
            return future.result(), False
        if isinstance(error, HeavyTopError | BrokenProcessPool):
            raise error
        cause = ": ".join(filter(None, (type(error).__name__, said(error))))
        return Checked(name, "violated", f"It left its process: {cause}."), True
    except TimeoutError:
        process.kill()
        text = f"No answer within {seconds:g} s; the process was stopped."
        if name == _TOO_FAST:
            return Checked(name, "note", f"{_HUGE_REQUEST}: {text}"), True
        return Checked(name, "violated", text), True
    except BrokenProcessPool:
        return Checked(name, "violated", "It ended its whole process."), True


def _part(which: str | IntegratorSource, systems: Sequence[str], index: int) -> Checked:
    """The part of the contract with that index."""
    begin_row()
    return _judged(*_Contract(which, systems).parts()[index])


_FIRST = 2
"""Number of parts that all others require."""
_TOO_FAST = "huge"
_HUGE_SECONDS = 2.0
_PATIENCE_OF = {_TOO_FAST: _HUGE_SECONDS}
"""Seconds of particular parts: for a motion too fast to follow, on which no program answers in time."""


class _Violated(Exception):
    """A violation, as a sentence."""


class _Note(Exception):
    """A remark that is not a violation."""


class _Contract:
    """The checks of one integrator: each method returns an observation, or raises a violation or a note.

    systems: those that a Python integrator supports; a program declares its own.
    """

    def __init__(self, which: str | IntegratorSource, systems: Sequence[str] = _HEAVY_TOP) -> None:
        self.which = which
        self.program = which if isinstance(which, Command) else None
        names = [name for name in self.program.precisions if name != "real:BITS"] if self.program else []
        self.precisions = [parse(name) for name in names] or [DOUBLE]
        if self.program and "real:BITS" in self.program.precisions:
            self.precisions = [*(self.precisions if names else []), real(237)]
        self.precision = self.precisions[0]
        self.systems = [name for name in (self.program.systems if self.program else systems) if name in _CASES]
        self.backward_only = bool(self.program) and "forward" not in (self.program.directions if self.program else ())
        case = CASES[_CASES[self.systems[0]] if self.systems else "generic"]
        self.top, self.start, self.system = case.top, case.start, case.system

    @cached_property
    def declared(self) -> Declared:
        """Its declaration, read where the integrator runs, since that imports it."""
        return described(self.which).declared

    @cached_property
    def axis(self) -> Vector:
        """A vertical along a principal axis, preferably e3, at which its coordinates are not singular."""
        axes = [vector([sign * (k == i) for i in range(3)], "γ") for sign in (1, -1) for k in (2, 1, 0)]
        return next((axis for axis in axes if not self.declared.is_singular(axis)), axes[0])

    def parts(self) -> list[tuple[str, Callable[[], str]]]:
        """The name of each part, and its check."""
        parts: list[tuple[str, Callable[[], str]]] = [
            ("start", self._starts),
            ("one time", self._plain),
            ("times [0]", self._start_alone),
            ("times [0, 1]", self._start_and_one),
            ("many times", partial(self._plain, " with 1000 samples", _MANY, hint=_SAMPLING)),
            ("digits", self._digits),
            ("determinism", self._same_twice),
            ("restart", self._restart),
            ("backwards", self._backwards),
            ("rest", self._rest),
            ("steps", self._steps),
            ("between steps", self._between_steps),
            ("attitude", self._attitude),
            *((f"format {p.name}", partial(self._plain, f" in {p.name}", precision=p)) for p in self.precisions[1:]),
            *(
                (f"system {name}", partial(self._plain, f" of the {name}", case=CASES[_CASES[name]]))
                for name in self.systems[1:]
            ),
        ]
        if self.program:
            parts += [("unknown lines", self._unknown_lines), ("two processes", self._two_at_once)]
        parts.append((_TOO_FAST, self._huge))
        ends = {"quit": (b"quit\n", "quit"), "end of input": (b"", "the end of input")} if self.program else {}
        return parts + [(name, partial(self._ended_by, *how)) for name, how in ends.items()]

    def _run(
        self,
        times: Sequence[int | Fraction],
        start: State | None = None,
        top: HeavyTop | None = None,
        precision: Precision | None = None,
        system: System | None = None,
        **more: Any,
    ) -> Trajectory:
        sign = -1 if self.backward_only else 1
        instants = [sign * Fraction(time) for time in times]
        problem = (top or self.top, start or self.start, instants, precision or self.precision)
        run = registry.ready(self.which)(*problem, system=system or self.system, **more)
        if run.outcome is not Outcome.SUCCESS:
            raise _Violated(f"The run ended as {run.outcome.value} at t = {six_digits(run.time_reached)}.")
        return run

    def _starts(self) -> str:
        if self.program is None:
            registry.peer(self.which)
            return "It can be called."
        try:
            with session(self.program) as program:
                greeting = program.greeting
        except PeerFailed as error:
            if error.remedy == COMMAND_REMEDY:
                raise NoSuchIntegrator(f"{error.cause}.", COMMAND_REMEDY) from None
            raise
        if len(greeting.split()) < 2:
            raise _Note(f"The greeting must be ready NAME VERSION; got ready {greeting}".rstrip() + ".")
        return f"Name and version: {greeting}."

    def _plain(
        self,
        where: str = "",
        times: Sequence[int | Fraction] = (1,),
        case: Any = None,
        hint: str = _READING,
        **more: Any,
    ) -> str:
        """Checks a run of a case against the reference."""
        problem = {} if case is None else {"start": case.start, "top": case.top, "system": case.system}
        return self._right(self._run(times, **problem, **more), where, case, hint)

    def _start_alone(self) -> str:
        try:
            run = self._run([0])
        except PeerFailed as error:
            if self.program and not error.answered:
                raise
            raise _Note(f"A run to t = 0 is refused, which is allowed: {_cause(error)}.") from None
        return f"A run to t = 0 returns the start{self._off_start(run.states[0])}."

    def _start_and_one(self) -> str:
        run = self._run([0, 1])
        self._off_start(run.states[0])
        return self._right(run, " with samples at t = 0 and 1", hint=_SAMPLING)

    def _digits(self) -> str:
        values = [exact(value) for state in self._run([1, 2, 3]).states for value in state]
        for digits in range(1, self.precision.digits - 1):
            if all(rounded(Fraction(decimal_text(v, digits)), self.precision) == v for v in values):
                needed = self.precision.digits
                raise _Violated(f"States have {digits} significant digits; {self.precision.name} has {needed}.")
        for bits in (24, 53, 64):
            if bits < self.precision.bits and all(round_to(value, bits) == value for value in values):
                raise _Violated(f"States have {bits} bits; {self.precision.name} has {self.precision.bits}.")
        return "States have all digits of the format."

    def _same_twice(self) -> str:
        first, second = (self._run([1, 2]).texts() for _ in range(2))
        if first != second:
            raise _Violated(
                "Equal requests give different states: it keeps something between calls, or depends on the clock, "
                "random numbers or the order of threads."
            )
        return "Equal requests give equal bits."

    def _restart(self) -> str:
        if self.system is GYROSTAT:
            raise _Note(f"Not tested: a {self.system.name} cannot be restarted from rounded data.")
        uninterrupted, first_half = self._run([2]), self._run([1])
        values = [exact(value) for value in first_half.states[-1]]
        second_half = self._run([1], State(values[:3], values[3:]), first_half.problem.top, system=self.system)
        gap, eps = _distance(uninterrupted.states[-1], second_half.states[-1]), self.precision.eps
        if gap <= _RESTART_EPS * eps:
            return f"A restart at t = 1 changes the run by at most {_RESTART_EPS} eps."
        differ = f"A restart at t = 1 changes the state at t = 2 by {float(gap / eps):.2g} eps"
        error = self._error(uninterrupted)
        if gap > _ERROR_MULTIPLE * error:
            raise _Violated(f"{differ}, {float(gap / error if error else gap):.2g} times the error without it.")
        if self.declared.one_step and registry.control_name(self.which) == "step":
            with suppress(_Violated):  # few digits explain it as well
                self._digits()
                raise _Note(f"{differ}, which the error explains. A multistep method should declare one_step = false.")
        return f"{differ}, which the error explains."

    def _error(self, run: Trajectory) -> Fraction:
        """The largest error of the states of a run, in units of their largest component."""
        p = run.problem
        reference = propagate(self.top, self.start, list(run.times), DOUBLE, system=p.system)
        return max(_distance(a, b) for a, b in zip(run.states, reference.states, strict=True))

    def _backwards(self) -> str:
        if self.program and set(self.program.directions) != {"forward", "backward"}:
            return f"It declares direction {self.program.directions[0]} only."
        back = self._run([-1])
        sentence = self._right(back, hint="check the sign of the step")
        if self.system is HEAVY_TOP:
            self._require_as_right(back)
        return sentence

    def _require_as_right(self, back: Trajectory) -> None:
        """Compares with the reversed motion: forward from (−Ω, γ) a method should have about the same error."""
        forward = self._run([1], State([-w for w in self.start.omega], self.start.gamma))
        (reference,) = propagate(self.top, self.start, list(back.times), DOUBLE, system=self.system).states
        mirrored = [sign * exact(value) for sign, value in zip((-1, -1, -1, 1, 1, 1), forward.states[-1], strict=True)]
        error, mirror_error = _distance(back.states[-1], reference), _distance(mirrored, reference)
        if error > _RESTART_EPS * self.precision.eps + _BACKWARD_RATIO * mirror_error:
            raise _Violated(
                f"The error at t = -1 is {float(error):.2g}, and that of the same motion forward in time, from "
                f"(−Ω, γ), is {float(mirror_error):.2g}: steps backward in time are wrong."
            )

    def _rest(self) -> str:
        top = HeavyTop((3, 2, 1), 1, [-part / 2 for part in self.axis])  # hanging: an upright top amplifies noise
        run = self._run([1, 10], State((0, 0, 0), self.axis), top, system=HEAVY_TOP)
        displacement = max(_distance(state, (0, 0, 0, *self.axis)) for state in run.states)
        if displacement <= _RESTART_EPS * self.precision.eps:
            return "A top at rest stays at rest."
        moved = f"A top at rest moves by {float(displacement):.2g} until t = 10"
        if displacement > _ERROR_MULTIPLE * self._error(self._run([10])):
            raise _Violated(f"{moved}.")
        raise _Note(f"{moved}, which the error on a motion explains.")

    def _steps(self) -> str:
        run = self._run([Fraction(1, 2), 2])
        if run.flags.get("steps") == "not counted":
            return "Steps are not counted, so single steps are not measured."
        if run.steps == 0:
            raise _Violated("The state changes, and the step count is 0.")
        step = run.flags.get("step")
        if step is not None and self.program:
            size = exact(step) if "x" not in step else Fraction(1, 100)
            expected = ceil(Fraction(1, 2) / size) + ceil(Fraction(3, 2) / size)
            text = f"{run.steps} steps counted to t = 2; the step size {step} needs {expected}."
            if 2 * run.steps < expected:
                raise _Violated(text)
            if run.steps > expected + 2:
                raise _Note(f"{text} Perhaps stages or steps of a starting method are counted.")
        return f"{run.steps} steps counted to t = 2."

    def _between_steps(self) -> str:
        """Compares the errors between steps with those at the ends of runs, and measures their order in the step."""
        if (control := registry.control_name(self.which)) not in _CONTROLS:
            raise _Note("Not tested: it has neither step nor tolerance.")
        *values, finest = _CONTROLS[control]
        coarse, fine = (self._between(control, value) for value in values)
        kept = "Samples between steps are as accurate as the ends of runs."
        if fine.between <= _RESTART_EPS * self.precision.eps:
            return kept
        if coarse == fine and self._between(control, finest) == fine:
            text = f"The errors with a {control} of {float(values[0]):.2g} and {float(finest):.2g} are equal: "
            if self.program:
                raise _Violated(f'{text}the {control} is ignored. Use it, or declare setting = "none"')
            raise _Note(f"{text}perhaps the {control} is ignored.")
        as_at_ends = fine.between <= _DENSE_RATIO * fine.ends
        errors = (
            f"At a {control} of {float(values[1]):.2g} the error is {float(fine.between):.2g} between steps, and "
            f"{float(fine.ends):.2g} at the ends of runs"
        )
        falls = fine.steps > coarse.steps and coarse.between > fine.between
        power = log(float(coarse.between / fine.between)) / log(fine.steps / coarse.steps) if falls else inf
        text = f"{errors}: between steps it falls like the power {power:.1f} of the step size"
        low = power < min(_LEAST_DENSE_ORDER, fine.order - _ORDER_MARGIN)
        if low and (power > _LINEAR_ORDER or not as_at_ends):
            how = "linear interpolation" if power > _LINEAR_ORDER else "the nearest or the previous state"
            raise _Violated(f"{text}, as for {how}, and the order is {fine.order}.")
        if as_at_ends:
            return kept
        raise _Note(f"{text if falls else errors}.")

    def _between(self, control: str, value: Fraction) -> _Between:
        propagate_at, sign = registry.ready(self.which, (control, value)), -1 if self.backward_only else 1
        runs = [
            propagate_at(self.top, self.start, [sign * time for time in times], self.precision, system=self.system)
            for times in (_BETWEEN, [Fraction(1)], _BETWEEN[-1:])
        ]
        for run in runs:
            if run.outcome is not Outcome.SUCCESS:
                raise _Note(f"At a {control} of {float(value):.2g} the run ended as {run.outcome.value}.")
        dense, *ends = runs
        return _Between(self._error(dense), max(map(self._error, ends)), ends[-1].steps, dense.order)

    def _attitude(self) -> str:
        if not described(self.which).carries_attitude:
            return "The attitude is not declared, and was not requested."
        xi = perpendicular(self.start.gamma)
        run = self._run(_ATTITUDE_TIMES, xi=xi)
        reference = propagate(self.top, self.start, list(run.times), DOUBLE, system=self.system, xi=xi)
        for time, state, expected in zip(run.times, run.states, reference.states, strict=True):
            error = _distance(state, expected)
            if error > _LARGEST_ERROR:
                raise _Violated(f"The error with the attitude is {float(error):.2g} at t = {six_digits(time)}.")
        return "The attitude agrees with the reference."

    def _unknown_lines(self) -> str:
        assert self.program is not None
        plain = self.program.request(self._problem(), [exact(Fraction(1))], self._default())
        request = _Extended(plain.problem, plain.times, plain.control, plain.hexadecimal, plain.quaternion, plain.body)
        try:
            self._answer(request)
        except PeerFailed as error:
            close_all()
            try:
                self._answer(request)
            except PeerFailed:
                raise _Violated(f"An unknown line is not ignored: {error.cause}.") from None
            raise  # a new process takes the line: another request ended the last one
        return "Unknown lines are ignored."

    def _answer(self, request: ProgramRequest, seconds: float = inf) -> list[list[Any]]:
        """The states with which the program answers; raises PeerFailed also where it says that it failed."""
        assert self.program is not None
        with session(self.program) as program:
            reply = program.ask(request, seconds)
        if reply.failure:
            raise PeerFailed(f"{self.program.name} failed: {reply.failure}", answered=True)
        return [list(state) for state in reply.states]

    def _two_at_once(self) -> str:
        assert self.program is not None
        sign = -1 if self.backward_only else 1
        request = self.program.request(self._problem(), [Fraction(sign), Fraction(2 * sign)], self._default())
        alone, again = (self._answer(request) for _ in range(2))
        if alone != again:
            raise _Note("Not tested: one process answers equal requests with different states.")
        sessions = [Session(self.program) for _ in range(2)]
        try:
            with ThreadPoolExecutor(2) as threads:
                replies = list(threads.map(lambda program: program.ask(request), sessions))
        finally:
            for opened in sessions:
                opened.close()
        first, second = ([list(state) for state in reply.states] for reply in replies)
        if first != second:
            raise _Violated("Two processes at once answer differently: they share something, or depend on the process.")
        if first != alone:
            raise _Violated("A new process answers otherwise than one in use: it keeps something between requests.")
        return "Two processes at once answer as one alone."

    def _huge(self) -> str:
        across = (0, _HUGE, 0) if self.axis[0] else (_HUGE, 0, 0)
        start = State(across, self.axis)
        top = HeavyTop((3, 2, 1), 1, [part / 2 for part in self.axis])
        try:
            if self.program is None:
                self._run([1], start, top, system=HEAVY_TOP)
            else:
                problem, time = Problem.of(top, start, self.precision, HEAVY_TOP), -1 if self.backward_only else 1
                self.declared.require(self.program.name, start, HEAVY_TOP, Fraction(time), self.precision, None)
                self._answer(self.program.request(problem, [Fraction(time)], self._default()), _HUGE_SECONDS)
        except Unsupported:
            raise
        except (_Violated, PeerFailed, InputError) as error:
            if self.program and isinstance(error, PeerFailed) and not error.answered:
                raise PeerFailed(f"{_HUGE_REQUEST}: {error.cause}") from None
            raise _Note(f"{_HUGE_REQUEST}: no finite state ({_cause(error)}).") from None
        return f"{_HUGE_REQUEST}: finite states."

    def _ended_by(self, text: bytes, trigger: str) -> str:
        assert self.program is not None
        program = Session(self.program)
        try:
            ended = program.ends_after(text, _FAREWELL)
        finally:
            program.close()
        if not ended:
            raise _Violated(f"The program does not exit within {_FAREWELL:g} s of {trigger}; its process was killed.")
        return f"The program exits at {trigger}."

    def _problem(self) -> Problem:
        return Problem.of(self.top, self.start, self.precision, self.system)

    def _default(self) -> Fraction | None:
        assert self.program is not None
        return self.program.default(self.precision)

    def _off_start(self, state: Sequence[Any]) -> str:
        """The difference of a state from the start, in words; "" where they are equal bit for bit."""
        difference = _distance(state, self._problem().start.flat) / self.precision.eps
        if difference > _REPRESENTATION_EPS:
            raise _Violated("The state at t = 0 is not the start.")
        return f", within {float(difference):.2g} eps as its representation rounds it" if difference else ""

    def _right(self, run: Trajectory, where: str = "", case: Any = None, hint: str = _READING) -> str:
        top, start = (self.top, self.start) if case is None else (case.top, case.start)
        reference = propagate(top, start, list(run.times), DOUBLE, system=run.problem.system)
        pairs = zip(run.times, run.states, reference.states, strict=True)
        time, error = max(((t, _distance(a, b)) for t, a, b in pairs), key=lambda entry: entry[1])
        text = f"The error{where} is {float(error):.2g} at t = {six_digits(time)}"
        if error > _LARGEST_ERROR:
            raise _Violated(f"{text}: {hint}.")
        return f"{text}."


class _Extended(ProgramRequest):
    """A request with a line unknown to every program."""

    def text(self, label: int) -> bytes:
        return super().text(label).replace(b"\ngo\n", b"\nunknown-to-version-1 1 2 3\ngo\n")


def _distance(state: Sequence[Any], other: Sequence[Any]) -> Fraction:
    """The largest component of the difference, in units of the largest component."""
    pairs = [(exact(a), exact(b)) for a, b in zip(state, other, strict=False)]
    size = max(max(abs(b) for _, b in pairs), Fraction(1, 10**300))
    return max(abs(a - b) for a, b in pairs) / size


def _cause(error: Exception) -> str:
    return error.cause if isinstance(error, HeavyTopError) else str(error)


def _judged(name: str, part: Callable[[], str]) -> Checked:
    try:
        return Checked(name, "kept", part())
    except _Note as note:
        return Checked(name, "note", str(note))
    except Unsupported as error:
        return Checked(name, "note", error.cause)
    except NoSuchIntegrator:
        raise
    except (_Violated, HeavyTopError) as error:
        return Checked(name, "violated", f"{_cause(error).removesuffix('.')}.")
