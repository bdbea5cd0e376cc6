"""The contract of a third-party integrator, and the one place that checks it.

Whatever third-party code does, short of ending the process, becomes a Trajectory that keeps the contract or PeerFailed,
whose text describes the failure.
"""

from __future__ import annotations

import inspect
import io
import os
import pickle
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, gcd, isfinite, lcm
from numbers import Real
from threading import RLock
from time import perf_counter
from types import SimpleNamespace
from typing import Any, Literal

import numpy

from heavytop import precision as formats
from heavytop.errors import HeavyTopError, InputError, PeerFailed, Unsupported, quoted, refusal
from heavytop.guard import stopwatch
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import DOUBLE, Precision, Vector, cross, decimal_text, dot, exact, number, rounded, six_digits
from heavytop.top.attitude import near_quaternion, perpendicular, rotation_of, rows_of
from heavytop.top.equations import HEAVY_TOP, NAMES, System, system
from heavytop.top.heavy_top import HeavyTop, State

_MOST_SAID = 200
_MOST_FLAGS = 20
DEFAULT_STEP = Fraction(1, 100)
_OFF_SPHERE = Fraction(1, 10**6)
"""By which |γ|² may differ from 1 where a quaternion stands for it, and radians between directions that are one."""
_FINER = 16
"""A step may be shortened so many times at most, so that all times are multiples of it."""
_DENOMINATOR = 10**6
_ALONE = RLock()
"""Standard output and warnings belong to the process, not to a thread: third-party code runs alone."""


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress output and warnings of third-party code, from C too, and restore the state of the process afterwards:

    NumPy's error state, the working directory, and the handlers of SIGINT and SIGTERM.
    """
    with (
        _ALONE,
        _process_as_it_was(),
        _descriptors_silenced(),
        redirect_stdout(io.StringIO()),
        redirect_stderr(io.StringIO()),
        warnings.catch_warnings(),
        numpy.errstate(all="ignore"),
    ):
        warnings.simplefilter("ignore")
        yield


@contextmanager
def _process_as_it_was() -> Iterator[None]:
    """Restore the working directory and, in the main thread, the handlers of SIGINT and SIGTERM."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    handlers = (
        {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)} if in_main_thread else {}
    )
    directory = None
    with suppress(OSError):  # it may have been removed
        directory = os.getcwd()
    try:
        yield
    finally:
        for number, handler in handlers.items():
            if handler is not None and signal.getsignal(number) is not handler:
                signal.signal(number, handler)
        if directory is not None:
            with suppress(OSError):
                os.chdir(directory)


@contextmanager
def _descriptors_silenced() -> Iterator[None]:
    """Redirect the descriptors of standard output and error, to which code in C writes, to the null device."""
    saved: dict[int, int] = {}
    try:
        with suppress(OSError):  # one that is closed needs no silence
            for descriptor in (1, 2):
                saved[descriptor] = os.dup(descriptor)
        if saved:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            for descriptor in saved:
                os.dup2(nowhere, descriptor)
            os.close(nowhere)
        yield
    finally:
        for descriptor, original in saved.items():
            os.dup2(original, descriptor)
            os.close(original)


@contextmanager
def contained(name: str, when: str = "", own: bool = False) -> Iterator[None]:
    """Run third-party code: output and warnings are suppressed, what it raises, ``sys.exit`` too, becomes PeerFailed.

    when: the action, for the message.  own: whether it is code of this program, whose own errors pass.
    KeyboardInterrupt passes.
    """
    try:
        with quiet():
            yield
    except (KeyboardInterrupt, PeerFailed):
        raise
    except BaseException as error:
        if own and isinstance(error, HeavyTopError):
            raise
        raise PeerFailed(f"{name} {_did(error)}{when}") from None


def _did(error: BaseException) -> str:
    if isinstance(error, SystemExit):
        return f"called sys.exit({said(error.code)})"
    message = said(error.cause if isinstance(error, HeavyTopError) else error)
    return f"raised {type(error).__name__}" + (f": {message}" if message else "")


def said(value: object) -> str:
    """Third-party text as one printable line of at most 200 characters."""
    try:
        text = str(value)
    except Exception:  # no message can be made
        return ""
    line = " ".join("".join(c if c.isprintable() else " " for c in text[: 4 * _MOST_SAID]).split())
    return line if len(line) <= _MOST_SAID else f"{line[: _MOST_SAID - 1]}…"


@dataclass(frozen=True, slots=True)
class Declared:
    """The declared capabilities of an integrator; None where it declares nothing.

    systems: names such as "heavy_top".  directions: "forward", "backward".  precisions: names of formats, "real:BITS"
    for any number of bits.  attitude: whether ξ rides along, or "quaternion": it computes with one in the place of γ.
    one_step: whether a step depends on the state where it begins alone.  fixed_grid: whether all steps of a run are of
    one length.  singular_at: vertical directions in body axes, γ, where its coordinates are singular.
    """

    systems: tuple[str, ...] | None = None
    directions: tuple[str, ...] | None = None
    precisions: tuple[str, ...] | None = None
    attitude: bool | Literal["quaternion"] = False
    one_step: bool = True
    fixed_grid: bool = False
    singular_at: tuple[Vector, ...] = ()

    def __post_init__(self) -> None:
        for name in ("systems", "directions", "precisions"):
            if getattr(self, name) == ():
                raise InputError(f"{name} is empty.", "List at least one.")
        for item in self.systems or ():
            system(item)
        for item in self.directions or ():
            if item not in ("forward", "backward"):
                raise refusal("directions", "forward or backward", quoted(item), "Correct it.")
        for item in self.precisions or ():
            if item != "real:BITS":
                formats.parse(item)
        if not all(map(any, self.singular_at)):
            raise InputError("A γ in singular_at must not be zero.", "Give γ, such as 0, 0, 1.")

    def require(
        self,
        name: str,
        start: State,
        system: System,
        end: Fraction,
        precision: Precision,
        xi: Sequence[Fraction] | None,
    ) -> None:
        """Raises Unsupported for a motion of ``system`` to the time ``end`` outside of the declared capabilities."""
        if self.is_singular(start.gamma):
            raise Unsupported(f"{name} declares that its coordinates are singular at this start.", "Give another γ.")
        if self.attitude == "quaternion" and abs(dot(start.gamma, start.gamma) - 1) > _OFF_SPHERE:
            raise Unsupported(f"{name} computes with a quaternion, which needs |γ| = 1.", "Give a γ of length 1.")
        if xi is not None and not self.attitude:
            raise Unsupported(f"{name} declares that it does not carry the attitude.", "Do not request the attitude.")
        direction = "backward" if end < 0 else "forward"
        generic = f"{precision.family}:BITS"
        requirements = (
            ("the system", system.name, self.systems, (system.name,)),
            ("the direction", direction, self.directions, (direction,)),
            ("the format", precision.name, self.precisions, (precision.name, generic)),
        )
        for aspect, value, declared, names in requirements:
            if declared is not None and not set(names) & set(declared):
                can = ", ".join(declared) or "none"
                raise Unsupported(f"{name} declares that it does not support {aspect} {value}.", f"It supports: {can}.")

    def is_singular(self, gamma: Vector) -> bool:
        """Whether its coordinates are singular at that γ."""
        return any(_along(gamma, direction) for direction in self.singular_at)

    def step(self, name: str, step: Fraction, times: Sequence[Fraction], precision: Precision) -> Fraction:
        """The step to request: on a fixed grid the largest up to ``step`` of which all times, before they were rounded
        to the format, are multiples.

        Raises Unsupported where that is a small part of ``step``.
        """
        times = [_before_rounding(time, precision) for time in times] if self.fixed_grid else times
        scale = lcm(*(time.denominator for time in times))
        spacing = Fraction(gcd(*(int(time * scale) for time in times)), scale)
        if not (self.fixed_grid and spacing):
            return step
        fitted = spacing / ceil(spacing / step)
        if _FINER * fitted < step:
            raise Unsupported(
                f"{name} declares equal steps, and these times are not multiples of a step near {six_digits(step)}.",
                "Give equally spaced times.",
            )
        return fitted


def _before_rounding(time: Fraction, precision: Precision) -> Fraction:
    """The fraction with a denominator of at most six digits that rounds to ``time``; ``time`` if none does."""
    near = time.limit_denominator(_DENOMINATOR)
    return near if rounded(near, precision) == rounded(time, precision) else time


def _along(gamma: Vector, direction: Vector) -> bool:
    """Whether two directions are equal to within 1e-6 rad."""
    across, along = cross(gamma, direction), dot(gamma, direction)
    return along > 0 and dot(across, across) <= _OFF_SPHERE**2 * along**2


def quaternion(problem: Problem) -> tuple[Fraction, ...]:
    """(w, x, y, z) of the start, to many digits more than the format; the rotation about the vertical is that of ξ."""
    gamma = problem.start.gamma
    xi = perpendicular(gamma) if problem.xi is None else problem.xi
    return near_quaternion(rows_of(gamma, xi), 2 * problem.precision.bits)


def of_quaternion(name: str, problem: Problem, state: Sequence[Any]) -> Any:
    """(Ω, γ), or (Ω, γ, ξ) of a problem with ξ, as numbers of the format, from (Ω, w, x, y, z), q of any length."""
    omega, q = state[:3], [exact(value) for value in state[3:]]
    if not any(q):
        raise PeerFailed(f"{name} returned a quaternion that is zero")
    rows = rotation_of(q)
    vectors = rows[2] if problem.xi is None else (*rows[2], *rows[0])
    return numpy.array([*omega, *(number(value, problem.precision) for value in vectors)])


Run = Callable[[Problem, Sequence[Fraction], Fraction | None], Trajectory]
"""A problem in its format, times, and a tolerance or None for the peer's own."""


def require_control(name: str, control: str, value: Fraction) -> None:
    """Raise InputError for a step or tolerance that is not positive, and for a tolerance above 1."""
    if value <= 0 or (control == "tolerance" and value > 1):
        rule = "above 0" if control == "step" else "above 0, up to 1"
        raise refusal(f"The {control} of {name}", rule, six_digits(value), f"Give one {rule}.")


def with_tolerance(run: Run) -> Callable[..., Trajectory]:
    """The call of :mod:`heavytop.integrate.peers` for a peer that has a tolerance."""

    def propagate(
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        precision: Precision = DOUBLE,
        *,
        system: System = HEAVY_TOP,
        tolerance: Fraction | None = None,
        xi: tuple[Fraction, ...] | None = None,
    ) -> Trajectory:
        return run(Problem.of(top, start, precision, system, xi), times, tolerance)

    return propagate


class CheckedPlugin:
    """A peer that keeps the contract: the call of :mod:`heavytop.integrate.peers`, or PeerFailed.

    own: whether it is one of this program's, whose errors pass, whose non-finite states are an outcome and no failure,
    and whose seconds are its own.  declared: its capabilities.  options: of every call, such as a tolerance.
    """

    def __init__(
        self,
        name: str,
        call: Any,
        own: bool,
        declared: Declared | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        self.name, self.call, self.own, self.declared, self.options = name, call, own, declared, dict(options or {})

    @property
    def carries_attitude(self) -> bool:
        """Whether ξ rides along: what is declared, and of a peer that declares nothing whether it takes ``xi``."""
        if self.declared is not None:
            return bool(self.declared.attitude)
        with contained(self.name, " when its arguments were looked at"):
            return "xi" in inspect.signature(self.call).parameters

    def __call__(
        self,
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        precision: Precision = DOUBLE,
        *,
        system: System = HEAVY_TOP,
        xi: tuple[Fraction, ...] | None = None,
        **options: Any,
    ) -> Trajectory:
        """The run; raises PeerFailed for one that breaks the contract, and what an own peer raises for bad input.

        ``run`` of the seconds of one that is not own is that of the call and of reading its states, by the clock here.
        Raises Unsupported, and calls nothing, for what the peer declares that it cannot do.
        """
        problem = Problem.of(top, start, precision, system, xi)
        beside = self.options | options if xi is None else {"xi": xi, **self.options, **options}
        requested = [rounded(time, precision) for time in times]
        if self.declared is not None and requested:
            self.declared.require(self.name, start, system, requested[-1], precision, xi)
            if self.declared.fixed_grid:
                beside["step"] = self.declared.step(self.name, beside.get("step", DEFAULT_STEP), times, precision)
        # copies, which a peer may change; fractions are shared by deepcopy
        arguments: list[Any]
        keywords: dict[str, Any]
        try:
            *arguments, keywords = pickle.loads(pickle.dumps((top, start, tuple(times), precision, beside)))
        except pickle.PicklingError as error:
            raise PeerFailed(f"{self.name} replaced modules of heavytop: {said(error)}") from None
        attributes = {name: getattr(system, name) for name in system.__slots__}
        with contained(self.name, own=self.own):
            seconds = stopwatch()
            try:
                run = self.call(*arguments, system=system, **keywords)
                spent = seconds()
            finally:
                changed = [name for name, attribute in attributes.items() if getattr(system, name) is not attribute]
                for name in changed:
                    object.__setattr__(system, name, attributes[name])
                if changed:  # whatever else it raised follows from that
                    raise PeerFailed(f"{self.name} changed the {', '.join(changed)} of the system {system.name}")
        with contained(self.name, " in what it returned"):
            return self._checked(run, problem, requested, spent)

    def _checked(self, returned: Any, problem: Problem, requested: list[Fraction], spent: float) -> Trajectory:
        """The returned trajectory as a plain one, checked; each attribute is read once.  spent: seconds of the call."""
        self._require(issubclass(type(returned), Trajectory), f"a {type(returned).__name__} instead of a Trajectory")
        began = perf_counter()
        run = SimpleNamespace(**{name: getattr(returned, name) for name in Trajectory.__slots__ if name != "problem"})
        self._require(
            isinstance(run.outcome, Outcome), f"the outcome {said(repr(run.outcome))} instead of a member of Outcome"
        )
        states = tuple(self._state(state, problem) for state in run.states)
        spent += perf_counter() - began
        self._require(len(states) <= len(requested), f"{len(states)} states for {len(requested)} times")
        done = len(states) == len(requested)
        self._require(
            done == (run.outcome is Outcome.SUCCESS),
            f"{len(states)} of {len(requested)} states, and the outcome {run.outcome.value}",
        )
        times = tuple(exact(time) for time in run.times)
        self._require(times == tuple(requested[: len(states)]), "other times than it was asked for")
        diverged = run.outcome is Outcome.NON_FINITE and not self.own
        self._require(not diverged, f"a state that is not finite after {len(states)} of {len(requested)} times")
        reached = requested[-1] if done else exact(run.time_reached)
        within = reached == 0 if requested[-1] == 0 else 0 <= reached / requested[-1] <= 1
        self._require(within, f"the time {said(run.time_reached)} as reached")
        if not (done or self.own):
            last, following = abs(times[-1]) if times else 0, abs(requested[len(states)])
            ended = f"{len(states)} of {len(requested)} states, and said that it reached t = {said(run.time_reached)}"
            self._require(last <= abs(reached) < following, ended)
        named = type(run.integrator) is str and 0 < len(run.integrator) <= _MOST_SAID and run.integrator.isprintable()
        self._require(named, "no integrator name")
        seconds = {name: self._seconds(run.seconds[name]) for name in ("compile", "run")}
        return Trajectory(
            problem,
            run.integrator if self.own else self.name,
            times,
            states,
            run.outcome,
            reached,
            self._count(run.steps, "steps"),
            self._count(run.order, "order"),
            seconds if self.own else {"compile": 0.0, "run": spent},
            self._flags(run.flags),
            None if run.evaluations is None else self._count(run.evaluations, "evaluations"),
        )

    def _require(self, condition: bool, what: str) -> None:
        if not condition:
            raise PeerFailed(f"{self.name} returned {what}")

    def _state(self, state: Any, problem: Problem) -> Any:
        """Six numbers of the format, as it holds them; nine with ξ."""
        precision, width = problem.precision, 6 if problem.xi is None else 9
        self._require(not isinstance(state, str | bytes | dict | set), f"a {type(state).__name__} as a state")
        dtype = getattr(state, "dtype", None)
        self._require(dtype is None or dtype != numpy.dtype(object), "an array of objects as a state")
        values = list(state)
        expected = "6" if width == 6 else "9, Ω, γ and ξ: it carries the attitude"
        self._require(len(values) == width, f"a state of {len(values)} components instead of {expected}")
        native = type(number(Fraction(1), precision))
        for value in values:
            plain = isinstance(value, native | Real) and not isinstance(value, bool | numpy.bool_)
            self._require(plain, f"a {type(value).__name__} in a state, not a number of {precision.name}")
            self._require(bool(numpy.isfinite(value)), "a state that is not finite")
        return numpy.array([number(exact(value), precision) for value in values])

    def _count(self, value: Any, what: str) -> int:
        self._require(hasattr(value, "__index__") and not isinstance(value, bool), f"{what} that are not a count")
        self._require(value >= 0, f"a negative count of {what}")
        return int(value)

    def _seconds(self, value: Any) -> float:
        seconds = float(value)
        self._require(isfinite(seconds) and seconds >= 0, "invalid seconds")
        return seconds

    def _flags(self, flags: Any) -> dict[str, str]:
        words = [part for pair in dict(flags).items() for part in pair]
        plain = all(type(word) is str and len(word) <= _MOST_SAID and word.isprintable() for word in words)
        self._require(plain and len(words) <= 2 * _MOST_FLAGS, "flags that are not short texts")
        return dict(flags)


def require_equal(name: str, first: Trajectory, second: Trajectory) -> None:
    """Raises PeerFailed where two runs of one and the same call are not the same, bit for bit."""
    if (first.outcome, first.time_reached, first.steps) != (second.outcome, second.time_reached, second.steps):
        ends = (f"{run.outcome.value} at t = {said(run.time_reached)} in {run.steps} steps" for run in (first, second))
        raise PeerFailed(f"{name} ended two equal calls as {' and as '.join(ends)}")
    for time, *states in zip(first.times, first.states, second.states, strict=True):
        for component, *values in zip(
            (*NAMES, "ξ1", "ξ2", "ξ3"), *(map(exact, state) for state in states), strict=False
        ):
            if values[0] != values[1]:
                texts = " and ".join(decimal_text(value, 17) for value in values)
                raise PeerFailed(f"{name} returned {texts} as {component} at t = {six_digits(time)} in two equal calls")
