"""The result of any integrator: problem, trajectory, resume point."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction
from math import inf
from time import perf_counter
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, overload

import numpy
from numpy.typing import NDArray

from heavytop.display import Lazy, Tabular, TitledTable, path_picture, plural
from heavytop.errors import InputError
from heavytop.precision import (
    DOUBLE,
    Precision,
    Vector,
    cache_last_call,
    cross,
    decimal_text,
    exact,
    native,
    native_text,
    number,
    rounded,
    six_digits,
)
from heavytop.top.attitude import (
    Output,
    euler_terms,
    first_sign,
    output,
    quaternion_of_rows,
    quaternion_products,
    rows_of,
    shaped,
    signs,
)
from heavytop.top.bodies import Frame
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, NAMES, Integral, Parameters, System, holding
from heavytop.top.heavy_top import HeavyTop, State

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from heavytop.top.stability import Stability


# The attitude of a computed run: in double for all samples at once, else from the exact native numbers.


_GUARD_BITS = 64
_LOCKED = 16
"""Times the eps of the format: where the sine (or cosine) by which two Euler angles are distinguished is smaller, they
are distinguished from rounding alone."""
_SIGN_BITS = 8
"""A component of the quaternion at the start that is within so many bits of rounding counts as 0."""


def in_double(run: Trajectory, output: Output) -> NDArray[numpy.float64]:
    """The output at every sample, shape (n, 4), (n, 3, 3) or (n, 3); ``nan`` where an Euler angle is not defined."""
    attitude, size = attitude_of(run), math.prod(output.shape)
    if run.problem.precision == DOUBLE:
        values = _columns(run, attitude, output)
    else:
        exact_values = [_exactly(run, index, attitude, output) for index in range(len(run.states))]
        values = numpy.array([[float(value) for value in line] for line in exact_values]).reshape(-1, size)
    if output.name == "quaternion":
        values = values * signs(_start(run), values)[:, None]
    return values.reshape(-1, *output.shape)


def as_texts(run: Trajectory, output: Output) -> list[Any]:
    """The output at every sample as decimal text in the digits of the format, rounded once; lists of that shape."""
    attitude, digits = attitude_of(run), run.problem.precision.digits
    lines = [_exactly(run, index, attitude, output) for index in range(len(run.states))]
    if output.name == "quaternion" and lines:
        turns = signs(_start(run), numpy.array([[float(value) for value in line] for line in lines]))
        lines = [[value * int(turn) for value in line] for line, turn in zip(lines, turns, strict=True)]
    return [
        shaped(["nan" if value != value else decimal_text(exact(value), digits) for value in line], output.shape)
        for line in lines
    ]


def attitude_of(run: Trajectory) -> Any:
    """ξ at every sample, native numbers, shape (n, 3); raises InputError for a run without."""
    if run.problem.xi is None:
        raise InputError(
            "The attitude was not computed: gamma alone does not fix it.",
            "Give attitude=True (`heavytop docs outputs` defines xi at t = 0), or xi.",
        )
    return run.attitude if run.attitude is not None else run.states[:, 6:9]


def _start(run: Trajectory) -> list[float]:
    """The quaternion at t = 0, of the sign of the convention."""
    problem = run.problem
    start, xi = (problem.start, problem.xi) if run.frame is None else (run.frame, run.frame.xi)
    assert xi is not None  # without ξ no attitude was computed
    q = quaternion_of_rows(rows_of(start.gamma, xi), SimpleNamespace(sqrt=lambda value: Fraction(math.sqrt(value))))
    sign = first_sign(q, 2**_SIGN_BITS * problem.precision.eps)
    return [sign * float(value) for value in q]


def _centre(run: Trajectory, output: Output) -> Vector:
    """The centre of mass; a rounded problem has only its product with the weight."""
    if run.frame is not None:
        return run.frame.centre
    if run.problem.given is not None:
        return run.problem.given[0].centre
    if output.name == "position" and output.point is None:
        raise InputError("This run does not contain its centre of mass.", "Give a point.")
    return run.problem.top.centre


def _columns(run: Trajectory, attitude: Any, output: Output) -> NDArray[numpy.float64]:
    """The output of doubles, all samples at once, shape (n, 4, 9 or 3); quaternions of either sign."""
    lib = SimpleNamespace(sqrt=numpy.sqrt, atan2=numpy.arctan2)
    omega, gamma, xi = (
        tuple(part.astype(float).T) for part in (run.states[:, :3], run.states[:, 3:6], attitude[:, :3])
    )
    if output.name == "quaternion":
        products = quaternion_products(rows_of(gamma, xi))
        largest = numpy.argmax([products[k][k] for k in range(4)], axis=0)
        multiples = [numpy.choose(largest, column) for column in products]
        length = numpy.sqrt(sum(part * part for part in multiples))
        return numpy.stack([part / length for part in multiples], axis=1)
    values = output.at(omega, gamma, xi, _centre(run, output), lib, float)
    quaternions = numpy.stack([numpy.broadcast_to(value, omega[0].shape) for value in values], axis=1)
    if output.name == "euler":
        square = euler_terms(rows_of(gamma, xi), output.sequence)[1][0]
        quaternions[numpy.ix_(square < (_LOCKED * float(DOUBLE.eps)) ** 2, [0, 2])] = math.nan
    return quaternions


def _exactly(run: Trajectory, index: int, attitude: Any, output: Output) -> Sequence[Any]:
    """The output at one sample from the exact native numbers: exact, or to more bits than the format has."""
    numbers = [*run.states[index][:6], *attitude[index]]
    try:
        state = [exact(value) for value in numbers]
    except InputError:  # the last state of a run that failed
        return [math.nan] * math.prod(output.shape)
    lib = _functions(run.problem.precision.bits + _GUARD_BITS)
    omega, gamma, xi = state[:3], state[3:6], state[6:]
    values: list[Fraction | float] = list(output.at(omega, gamma, xi, _centre(run, output), lib, Fraction))
    if output.name == "euler":
        square = euler_terms(rows_of(gamma, xi), output.sequence)[1][0]
        if square < (_LOCKED * run.problem.precision.eps) ** 2:
            values[0] = values[2] = math.nan
    return values


def _functions(bits: int) -> SimpleNamespace:
    """Elementary functions of Fractions with so many bits right; a context of its own, which no thread shares."""
    from mpmath import MPContext

    context = MPContext()
    context.prec = bits

    def number(value: Fraction) -> Any:
        return context.mpf(value.numerator) / value.denominator

    def atan2(y: Fraction, x: Fraction) -> Fraction:
        return exact(context.atan2(number(y), number(x)))

    return SimpleNamespace(sqrt=lambda value: exact(context.sqrt(number(value))), atan2=atan2)


_FEW_DIGITS = 3.0
"""An amplification that costs fewer digits is not mentioned."""
_BEYOND = 4
"""Every digit is lost where a rounding has grown to so many bits more than the format has: most are smaller."""
_SHOWN = 15
"""Digits of a number in a table for people; all of them are in :meth:`Trajectory.texts`."""


class Outcome(Enum):
    """How a run ended; the value is the word in reports."""

    SUCCESS = "success"
    STEP_LIMIT = "step_limit"
    NON_FINITE = "non_finite"
    STEP_TOO_SMALL = "step_too_small"
    CAPACITY = "capacity"
    INCOMPLETE = "incomplete"
    FAILED = "failed"

    @property
    def message(self) -> str:
        """The outcome in a sentence for people."""
        return {
            Outcome.SUCCESS: "reached every time asked for",
            Outcome.STEP_LIMIT: "stopped at the step limit before the last time",
            Outcome.NON_FINITE: "stopped: the state was no longer finite",
            Outcome.STEP_TOO_SMALL: "stopped: a step no longer changes the time",
            Outcome.CAPACITY: "stopped: numbers exceeded the range of the words chosen for them",
            Outcome.FAILED: "stopped: the integrator reported a failure",
            Outcome.INCOMPLETE: "reported success, but returned fewer times than requested",
        }[self]


@dataclass(frozen=True, slots=True)
class Problem:
    """A top, a start and a system, rounded to a format: exactly what an integrator of that format is given.

    parameters: inertia, moment of the weight n = P r and rotor λ or k, each component rounded once.
    start: rounded state; γ is in general off the unit sphere by a rounding.
    given: the exact top and start, which decide what holds; None where the rounded ones are all there is.
    """

    system: System
    precision: Precision
    parameters: Parameters
    start: State
    xi: tuple[Fraction, ...] | None
    given: tuple[HeavyTop, State] | None = field(default=None, compare=False)

    def integrals(self) -> tuple[Integral, ...]:
        """Every first integral that holds for the exact top and start."""
        return holding(*(self.given or (self.top, self.start)), self.system)

    @property
    def top(self) -> HeavyTop:
        """The rounded top; its weight is 1 and its centre n."""
        p = self.parameters
        return HeavyTop(p.inertia, 1, p.moment, p.rotor if self.system is HEAVY_GYROSTAT else None)

    @classmethod
    def of(
        cls,
        top: HeavyTop,
        start: State,
        precision: Precision,
        system: System = HEAVY_TOP,
        xi: tuple[Fraction, ...] | None = None,
    ) -> Problem:
        """The problem rounded to ``precision``; the rotor is computed from the exact data first."""
        return _rounded(
            top, start, precision, system, xi
        )  # all arguments: a call with fewer is another call to the cache

    def native(self, values: Any) -> list[Any]:
        """Numbers that are rounded to the format, as numbers of it."""
        if self.precision.family == "double":
            return [float(value) for value in values]
        return [number(exact(value), self.precision) for value in values]


@cache_last_call
def _rounded(
    top: HeavyTop, start: State, precision: Precision, system: System, xi: tuple[Fraction, ...] | None
) -> Problem:
    def nearest(values: Any) -> tuple[Fraction, ...]:
        return tuple(rounded(value, precision) for value in values)

    # of the gyrostat the start is part of them
    parameters = _rounded_parameters(top, start if system is GYROSTAT else None, precision, system)
    rounded_start = State(nearest(start.omega), nearest(start.gamma))
    return Problem(system, precision, parameters, rounded_start, None if xi is None else nearest(xi), (top, start))


@cache_last_call
def _rounded_parameters(top: HeavyTop, start: State | None, precision: Precision, system: System) -> Parameters:
    parameters = system.parameters(top, _ANY_START if start is None else start)
    return parameters.mapped(lambda value: rounded(Fraction(value), precision))


_ANY_START = State((0, 0, 0), (0, 0, 1))


class OtherFlags(InputError):
    """A resume point of a run with other flags; names them."""


@dataclass(frozen=True, slots=True)
class ResumePoint:
    """The state of a run from which it can be resumed with the same bits, in native numbers.

    samples: how many of the times are done.  state: before the step that covers the last of them; time: both words of
    its time; steps: taken before.  seconds: run so far.  flags: all else that can change bits.
    words: in place of state and time, the state of an integrator in multi-word arithmetic, as text.
    """

    samples: int
    state: tuple[Any, ...]
    time: tuple[Any, ...]
    steps: int
    seconds: float
    flags: dict[str, str]
    words: tuple[str, ...] = ()

    def require_same(self, flags: dict[str, str]) -> None:
        """Raises OtherFlags where the run to be resumed has others."""
        names = sorted(self.flags.keys() | flags.keys())
        different = [name for name in names if self.flags.get(name) != flags.get(name)]
        if different:
            raise OtherFlags(
                "The run to be resumed was integrated with "
                + ", ".join(f"{name} = {self.flags.get(name)} (now {flags.get(name)})" for name in different)
                + ".",
                "Resume with the same program and machine, or start a new run in another folder.",
            )

    def content(self, precision: Precision) -> dict[str, Any]:
        """The fields as plain text and integers, exact."""

        def texts(values: tuple[Any, ...]) -> list[str]:
            # a zero keeps its sign
            return ["-0" if v == 0 and str(v).startswith("-") else native_text(v, precision) for v in values]

        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return fields | {"state": texts(self.state), "time": texts(self.time), "words": list(self.words)}

    @classmethod
    def of(cls, content: dict[str, Any], precision: Precision) -> ResumePoint:
        """The resume point with that :meth:`content`."""
        state, time = (tuple(native(text, precision) for text in content[name]) for name in ("state", "time"))
        samples, steps, seconds, flags = (content[name] for name in ("samples", "steps", "seconds", "flags"))
        resume_point = cls(samples, state, time, steps, float(seconds), dict(flags), tuple(content.get("words", ())))
        if not (type(samples) is int is type(steps) and samples > 0 <= steps and 0 <= resume_point.seconds < inf):
            raise ValueError(f"no run was ever at {content!r}")
        return resume_point

    def require_covered(self, steps: int) -> None:
        """Raises ValueError unless one step from here covers the last sample: else the two are not of one run."""
        if steps != self.steps + 1:
            raise ValueError(f"{steps - self.steps} steps from a place to its sample")


class InSpace:
    """A motion with its attitude in space, as arrays in double, one entry per sample.

    Each raises InputError for a motion without attitude.
    """

    __slots__ = ()

    def _in_double(self, what: Output) -> NDArray[numpy.float64]:
        raise NotImplementedError

    def quaternions(self) -> NDArray[numpy.float64]:
        """(w, x, y, z) at every sample, body to space, of length 1, shape (n, 4).

        The sign is continuous from one sample to the next, with w ≥ 0 at t = 0.
        """
        return self._in_double(output("quaternion"))

    def rotations(self) -> Rotation:
        """The attitudes as one ``scipy.spatial.transform.Rotation`` of n rotations, body to space."""
        try:
            from scipy.spatial.transform import Rotation
        except ImportError:
            raise InputError("Rotations need SciPy.", "Install it with: pip install scipy") from None
        return Rotation.from_quat(self.quaternions()[:, [1, 2, 3, 0]])

    def matrices(self) -> NDArray[numpy.float64]:
        """R at every sample, v_space = R v_body, shape (n, 3, 3); its rows are ξ, γ × ξ, γ."""
        return self._in_double(output("matrix"))

    def positions(self, point: Any = None, pivot: Any = None) -> NDArray[numpy.float64]:
        """Where a point of the body stands in space, pivot + R p, shape (n, 3); third component upwards.

        point: three exact numbers in body axes; None for the centre of mass.
        pivot: where the fixed point stands in space; None for the origin.
        """
        return self._in_double(output("position", point, pivot))

    def omega_space(self) -> NDArray[numpy.float64]:
        """R Ω, the angular velocity in space axes, shape (n, 3)."""
        return self._in_double(output("omega-space"))

    def euler(self, sequence: str) -> NDArray[numpy.float64]:
        """(a, b, c) with R = R_I(a) R_J(b) R_K(c) for the sequence "IJK", in radians, shape (n, 3).

        a and c in (−π, π], b in [0, π], or in [−π/2, π/2] for three different letters.  a and c are ``nan`` at gimbal
        lock, where they are not defined: of a computed motion b within 16 eps of an end of its interval.
        Raises InputError for an unknown sequence too.
        """
        return self._in_double(output(f"euler:{sequence}" if isinstance(sequence, str) else sequence))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Trajectory(Tabular, InSpace):
    """A computed motion at the times that were reached.

    times: exact values of the rounded times, shape (n,): a tuple, or of many a sequence that makes each when it is
    asked for.
    states: native numbers, an array of shape (n, 6), order Ω1 Ω2 Ω3 γ1 γ2 γ3; or (n, 9) with the attitude vector ξ
    behind.  It may be given as rows; it has none where an observer took the states.
    time_reached: exact time of the last finite step end, or the last time asked for.
    seconds: ``compile`` and ``run`` apart.
    flags: everything that can change bits, as text.
    evaluations: of the field, where the engine counts them.
    attitude: ξ, native numbers, shape (n, 3), where it was computed beside ``states`` and is not part of them.
    frame: the axes in which the body was given, and which ``states`` and ``attitude`` are in; None for those of the
    problem, the principal axes.  principal: then the run as it was computed.
    angle_texts: φ, θ, ψ, followed from t = 0, as decimal text, shape (n, 3), where they were asked for.
    dense: (Ω, γ) at any exact time up to ``time_reached``, native numbers in the axes of ``states``.
    joint_violation: how far an engine of bodies let the fixed point move, where it says so.
    """

    problem: Problem
    integrator: str
    times: Sequence[Fraction]
    states: Any
    outcome: Outcome
    time_reached: Fraction
    steps: int
    order: int
    seconds: dict[str, float] = field(default_factory=dict)
    flags: dict[str, str] = field(default_factory=dict)
    evaluations: int | None = None
    attitude: Any = None
    frame: Frame | None = None
    principal: Trajectory | None = None
    angle_texts: Sequence[Sequence[str]] | None = None
    dense: Callable[[Fraction], Sequence[Any]] | None = None
    joint_violation: float | None = None

    def __post_init__(self) -> None:
        width = 6 if self.problem.xi is None or self.attitude is not None else 9
        states = numpy.asarray(self.states) if len(self.states) else numpy.empty((0, width))
        object.__setattr__(self, "states", states)

    @overload
    def texts(self, of: None = None) -> list[list[str]]: ...

    @overload
    def texts(self, of: str | Output, *, point: Any = None, pivot: Any = None) -> list[Any]: ...

    def texts(self, of: str | Output | None = None, *, point: Any = None, pivot: Any = None) -> list[Any]:
        """The states as full-precision decimal strings, ``nan`` and ``inf`` where they are, shape (n, 6) or (n, 9).

        Arguments:
            of: "quaternion", "matrix", "euler:ZXZ", "position" or "omega-space" for one of these in place of the
                states, in the shape of its array; each number is rounded once, from exact arithmetic on the native
                numbers.
            point, pivot: as in :meth:`heavytop.integrate.trajectory.Trajectory.positions`.

        Raises InputError for another output, and for a run without attitude.
        """
        if of is not None:
            return as_texts(self, output(of, point, pivot))
        return [[native_text(value, self.problem.precision) for value in state] for state in self.states]

    def angles(self) -> NDArray[numpy.float64]:
        """φ, θ, ψ of (3.2) in radians, shape (n, 3), followed from t = 0 with all turns: ``euler("ZXZ")`` is ψ, θ, φ.

        Continuous but for jumps of φ and ψ by π where the axis goes through a pole; ``nan`` at one.
        Raises InputError for a run that was not asked for angles.
        """
        if self.angle_texts is None:
            raise InputError("The Euler angles were not propagated.", "Propagate with angles=True, or use euler().")
        return numpy.array(self.angle_texts, dtype=float).reshape(-1, 3)

    def _in_double(self, what: Output) -> NDArray[numpy.float64]:
        return in_double(self, what)

    def __call__(self, t: Any) -> Any:
        """(Ω, γ) at a time between samples too, native numbers: shape (6,), or (6, n) of n times, as of an OdeSolution.

        By the polynomials of the integrator's own steps, which are taken again at the first call.
        Raises InputError for a time outside of the run, Unsupported for an integrator that hands over no polynomials.
        """
        if self.dense is None:
            raise InputError("This run has no dense output.", "Use a run of heavytop.propagate.")
        several = numpy.ndim(t) > 0
        states = numpy.array([self.dense(exact(time)) for time in (t if several else [t])])
        return states.reshape(-1, 6).T if several else states[0]

    def with_dense(self, function: Callable[[Fraction], Sequence[Any]]) -> Trajectory:
        """This run, once ``dense`` is that function."""
        object.__setattr__(self, "dense", function)
        return self

    def to_numpy(self) -> NDArray[numpy.float64]:
        """The states rounded to double, shape (n, 6), or (n, 9) with the attitude vector."""
        return numpy.array([[float(value) for value in state] for state in self.states]).reshape(self.states.shape)

    @property
    def amplification(self) -> float:
        """The factor by which the motion itself has amplified a change of its state, between the two times up to
        ``time_reached`` where it is largest.

        The root mean square over the six directions of a change; the worst direction has at most √6 times that.
        An estimate from the variational equation, computed when it is asked for.
        """
        from heavytop.top.amplification import amplification

        return amplification(*self._followed)

    @property
    def digits_lost(self) -> tuple[float, bool]:
        """Decimal digits that a state loses until ``time_reached`` where it is rounded to the format at the worst time
        before; and whether that is followed so far, not a lower estimate.
        """
        from heavytop.top.amplification import digits_eaten, loss

        factor, followed = loss(*self._followed)
        return digits_eaten(factor), followed

    @property
    def _followed(self) -> tuple[System, Parameters, tuple[Fraction, ...], Fraction]:
        problem = self.problem
        return problem.system, problem.parameters, tuple(problem.start.flat), self.time_reached

    @property
    def stability(self) -> Stability | None:
        """Whether the motion from the exact start is stable, where it is an equilibrium, a permanent rotation or a
        regular precession; else None.
        """
        from heavytop.top.stability import stability

        problem = self.problem
        top, start = problem.given or (problem.top, problem.start)
        return stability(problem.system, problem.system.parameters(top, start), start.flat)

    def amplification_text(self) -> str:
        """The digits that the amplification costs, in a sentence; "" where it costs fewer than three digits."""
        (lost, followed), precision = self.digits_lost, self.problem.precision
        if lost < _FEW_DIGITS:
            return ""
        digits, until = round(precision.bits * math.log10(2)), six_digits(self.time_reached)
        state = f"the motion itself amplifies rounding errors: a state rounded to {precision.name} on the way has lost"
        if lost >= (precision.bits + _BEYOND) * math.log10(2):
            return f"{state} all {digits} digits before t = {until}"
        return (
            f"{state} {'' if followed else 'at least '}{min(int(lost), digits - 1)} of {digits} digits by t = {until}"
        )

    def _repr_html_(self) -> str:
        states, carried = self.states, self.states.shape[1:] == (9,)

        def point(index: int) -> Any:
            gamma, xi = states[index][3:6], states[index][6:]
            return (xi[2], cross(gamma, xi)[2], gamma[2]) if carried else gamma

        what = "axis 3 in space" if carried else "γ, the vertical in body axes"
        return self._table().html() + path_picture(len(states), point, f"{what}, on the unit sphere")

    def _table(self) -> TitledTable:
        precision = self.problem.precision
        digits = min(_SHOWN, precision.digits)

        def line(index: int) -> list[str]:
            return [decimal_text(self.times[index], _SHOWN), *(_shown(value, digits) for value in self.states[index])]

        rows = Lazy(min(len(self.times), len(self.states)), line)
        steps = plural(self.steps, "step") + (f" of order {self.order}" if self.order else "")
        title = f"{self.problem.system.name} in {precision.name} by {self.integrator}: {self.outcome.message}, {steps}"
        names = NAMES if self.problem.xi is None or self.attitude is not None else (*NAMES, "ξ1", "ξ2", "ξ3")
        notes = []
        if rows and precision != DOUBLE:
            notes.append(f"shown to {digits} digits; texts() gives all")
        if self.times and not rows:
            notes.append(f"{len(self.times)} states were passed to the observer")
        if self.outcome is not Outcome.SUCCESS:
            reason = f"; {self.integrator} says: {self.flags['failure']}" if "failure" in self.flags else ""
            notes.append(f"reached t = {six_digits(self.time_reached)} only{reason}")
        if (steady := self.stability) is not None:
            notes.append(steady.text(precision.bits))
        if lost := self.amplification_text():
            notes.append(lost)
        return TitledTable(title, ("t", *names), rows, notes)


def _shown(value: object, digits: int) -> str:
    try:
        return decimal_text(exact(value), digits)
    except InputError:
        return str(value)


Observer = Callable[[Fraction, Any], None]
EnsembleObserver = Callable[[int, Fraction, Any], None]
"""Given the index of a motion, the time and the state."""

Ended = tuple[Sequence[Fraction], Any, "Outcome", float]
"""The times that a run reached, the states there, its outcome and its seconds."""


class SampledRun(ABC):
    """A run that is advanced from sample to sample.

    between: called between chunks of steps; it may raise to abort the run.
    """

    step_limit: int | None
    between: Callable[[], None] | None

    @property
    @abstractmethod
    def steps(self) -> int:
        """Taken so far."""

    @property
    @abstractmethod
    def time(self) -> Any:
        """Where the last step ended, exactly or as a native number."""

    def reach(self, target: Any) -> Outcome:
        """Step until the last step covers ``target``."""
        while not self.covers(target):
            left = None if self.step_limit is None else self.step_limit - self.steps
            if left is not None and left <= 0:
                return Outcome.STEP_LIMIT
            if self.between is not None:
                self.between()
            outcome = self.advance(target, left)
            if outcome is not Outcome.SUCCESS:
                return outcome
        return Outcome.SUCCESS

    @abstractmethod
    def covers(self, target: Any) -> bool:
        """Whether there is a state at ``target`` without another step."""

    @abstractmethod
    def advance(self, target: Any, most: int | None) -> Outcome:
        """Some steps towards ``target``, at most so many."""

    @abstractmethod
    def at(self, target: Any, time: Fraction) -> tuple[Outcome, Any]:
        """The outcome and the native state at a time, which is passed as native number and exactly."""

    @abstractmethod
    def take_up(self, resume_point: ResumePoint, covered: Any) -> None:
        """Resume there: repeat the step that covers the last sample."""

    @abstractmethod
    def place(self, samples: int, seconds: float, flags: dict[str, str]) -> ResumePoint:
        """The resume point at the beginning of the last step."""


def sampled(
    run: SampledRun,
    targets: Sequence[Any],
    flags: dict[str, str],
    began: float,
    observer: Observer | None,
    resume_point: ResumePoint | None,
    mark: Callable[[ResumePoint], None] | None,
) -> Ended:
    """The targets reached, the states there unless an observer took them, the outcome and the seconds.

    began: by :func:`time.perf_counter`.  The other arguments: as in
    :func:`heavytop.integrate.heyoka.motions.propagate`.
    """
    times: list[Fraction] = []
    states: list[Any] = []
    outcome = Outcome.SUCCESS
    if resume_point is not None:
        resume_point.require_same(flags)
        began -= resume_point.seconds
        times = [exact(target) for target in targets[: resume_point.samples]]
        run.take_up(resume_point, targets[resume_point.samples - 1])
    for target in targets[len(times) :]:
        time = exact(target)
        outcome, state = run.at(target, time)
        if outcome is not Outcome.SUCCESS:
            break
        times.append(time)
        if observer is None:
            states.append(state)
        else:
            observer(time, state)
        if mark is not None and target != 0:
            mark(run.place(len(times), perf_counter() - began, flags))
    return tuple(times), tuple(states), outcome, perf_counter() - began


def trajectory_of(
    problem: Problem,
    integrator: str,
    run: SampledRun,
    order: int,
    compiling: float,
    flags: dict[str, str],
    *ended: *Ended,
) -> Trajectory:
    """The trajectory of a run that ended so; compiling: seconds."""
    times, states, outcome, seconds = ended
    reached = times[-1] if outcome is Outcome.SUCCESS and times else exact(run.time)
    spent = {"compile": compiling, "run": seconds}
    return Trajectory(problem, integrator, times, states, outcome, reached, run.steps, order, spent, flags)


Finished = Callable[[int, Trajectory], None]
"""Given the index of a motion of an ensemble and the motion, when it ends."""


@dataclass(frozen=True, slots=True)
class TaylorStep:
    """One step of a Taylor method, in native numbers.

    start: state at its beginning, shape (6,).  length: h.  coefficients: of τ^k, shape (6, order + 1); the polynomial
    may be evaluated beyond h.  end: state at its end, from which the integrator continues.
    """

    start: Any
    length: Any
    coefficients: Any
    end: Any
