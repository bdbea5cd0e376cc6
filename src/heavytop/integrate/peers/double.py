"""Adapters for libraries in double: the problem as arrays, the field as compiled code, the result as a Trajectory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from importlib.util import find_spec
from time import perf_counter
from typing import Any, Literal

import numpy

from heavytop import precision as vectors
from heavytop.arguments import flag, text
from heavytop.display import plural
from heavytop.errors import InputError, PeerFailed, Unsupported, quoted, refusal
from heavytop.integrate.peers.contract import (
    DEFAULT_STEP,
    Declared,
    of_quaternion,
    quaternion,
    require_control,
    said,
    with_tolerance,
)
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.multiword.codegen.machine_code import Doubles
from heavytop.precision import DOUBLE, OncePerArguments, Precision, as_integer, exact, number
from heavytop.top.attitude import matrix_of_quaternion
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State, check_times

_WIDE = {6: "Ω and γ", 7: "Ω and a quaternion", 9: "Ω, γ and ξ"}
FINEST = Fraction(1, 10**15)
"""The default tolerance of a peer: below about 4 eps most refuse."""


@dataclass(frozen=True, slots=True)
class Request:
    """A problem in double.

    start: shape (6,), or (9,) with ξ if the attitude is requested, or (7,), Ω and a quaternion, if that is declared.
    times: shape (n,), strictly monotone away from 0.  numbers: the parameters I, n and the rotor: shape (7,) with λ, 0
    for the heavy top, or (9,) with k for the heavy gyrostat.
    control: the tolerance, or the step of a method with fixed steps; ``setting`` is its former name.
    step_limit: steps after which an adaptive method
    should stop, with the states so far and ``Outcome.STEP_LIMIT``.
    """

    system: System
    start: Doubles
    times: Doubles
    numbers: Doubles
    control: float
    step_limit: int = 10**7

    @property
    def setting(self) -> float:
        """The control, by its former name."""
        return self.control

    @property
    def parameters(self) -> Parameters:
        """The arguments of ``system.field``, as Python floats: as scalars faster than elements of an array."""
        return reader(self.system)(self.numbers.tolist())

    @property
    def field(self) -> Callable[[Sequence[float]], tuple[float, ...]]:
        """y -> y' of the shape of ``start``: (Ω', γ'), (Ω', γ', ξ') or (Ω', q')."""
        if self.width == 7:
            return self._with_quaternion
        return partial(self.system.with_attitude, self.parameters)

    def _with_quaternion(self, y: Sequence[float]) -> tuple[float, ...]:
        """The field of (Ω, q) with |q| = 1: q' = q (0, Ω)/2."""
        omega, (w, *v) = y[:3], y[3:]
        state = (*omega, *matrix_of_quaternion(y[3:])[2])
        turning = self.system.angular_velocity(self.parameters, state)
        across = vectors.cross(v, turning)
        rates = (-vectors.dot(v, turning), *(w * a + b for a, b in zip(turning, across, strict=True)))
        return (*self.system.field(self.parameters, state)[:3], *(rate / 2 for rate in rates))

    @property
    def width(self) -> int:
        """The components of a state: 6, 9 with ξ, or 7 with a quaternion."""
        return len(self.start)


@dataclass(frozen=True, slots=True)
class Solution:
    """The result of a library.

    states: as wide as the start, shape (m, 6), (m, 9) or (m, 7), one for each of the first m <= n times.  reached: the
    last time reached.  evaluations: of the field.  compile: seconds of the run spent on compiling.
    outcome: how a run that did not reach the end failed; :func:`double_peer` determines every other outcome.
    tolerance: in force, as text, where the library does not take the requested one.
    """

    states: Any
    reached: float
    steps: int
    evaluations: int | None = None
    compile: float = 0.0
    outcome: Outcome = Outcome.INCOMPLETE
    tolerance: str = ""


Solve = Callable[[Request], Solution]
Given, Solved = Request, Solution
"""Former names, which third-party packages import."""


def double_peer(
    name: str,
    order: int,
    solve: Solve,
    control: str = "tolerance",
    *,
    systems: Sequence[str] | None = None,
    directions: Sequence[str] | None = None,
    precisions: Sequence[str] | None = None,
    attitude: bool | Literal["quaternion"] = False,
    one_step: bool = True,
    fixed_grid: bool = False,
    singular_at: Sequence[Sequence[Any]] = (),
) -> Callable[..., Trajectory]:
    """``solve`` as a peer, a callable that ``integrator`` takes wherever it takes a name.

    Arguments:
        name: in rows and messages.
        order: of the method; 0 where it has none to declare.
        solve: takes a :class:`Request` and returns a :class:`Solution`.
        control: "tolerance", or "step" for a method with fixed steps.
        systems, directions, precisions: what it declares that it can do, such as ["heavy_top"], ["forward"],
            ["double"]: the rows of a plan that ask for anything else are ``unsupported``, and no failures.  None
            declares nothing: a row that it cannot do is then ``failed``.
        attitude: declares that it carries ξ: if that is requested, states have nine numbers, and so has ``start``.
            "quaternion" declares that it computes with one: states have seven numbers then, Ω and (w, x, y, z).
        one_step: False declares that a step depends on more than the state where it begins: of a multistep method,
            say.  Its single steps and restarts are not judged then, and its order is that of whole runs.
        fixed_grid: declares that all steps of a run are equal: all times are then multiples of the step.
        singular_at: directions of the vertical in body axes, such as (0, 0, 1), where its coordinates are singular.

    Returns:
        The peer, called as ``peer(top, start, times, precision, *, system, tolerance, xi)`` (or ``step``).  It raises
        InputError for a format other than double, for times out of order and for a control out of range.

    Raises:
        InputError: for a name, an order, a control or a declaration that none can have.
    """
    if control not in ("tolerance", "step"):
        raise refusal("control", '"tolerance" or "step"', quoted(control), "Give one of these.")
    if as_integer(order, "order") < 0:
        raise refusal("order", "0 or more", order, "Give 0 for a method without an order.")
    name, control = str(text(name, "name")), str(control)
    if not name or said(name) != name:
        raise refusal("name", "1 to 200 printable characters", quoted(name), "Give such a name.")
    one_step, fixed_grid = bool(flag(one_step, "one_step")), bool(flag(fixed_grid, "fixed_grid"))
    singular = tuple(vectors.vector(point, "singular_at") for point in singular_at)
    if attitude not in (False, True, "quaternion"):
        raise refusal("attitude", 'True, False or "quaternion"', quoted(attitude), "Give one of these.")
    if fixed_grid and control != "step":
        raise InputError('fixed_grid needs control = "step".', "Give both, or neither.")
    able = (_declared(systems), _declared(directions), _declared(precisions))
    declared = Declared(*able, attitude, one_step, fixed_grid, singular)

    def integrate(problem: Problem, times: Sequence[Fraction], value: Fraction) -> Trajectory:
        request = _request(name, control, problem, times, value)
        if declared.attitude == "quaternion":
            q = problem.native(quaternion(problem))
            request = replace(request, start=numpy.array([*request.start[:3], *q], dtype=float))
        began = perf_counter()
        solved = _solution_with_start(name, request, solve)
        seconds = {"compile": solved.compile, "run": perf_counter() - began - solved.compile}
        flags = {
            control: solved.tolerance or repr(request.control),
            "field": "numba" if find_spec("numba") else "python",  # without importing it
        }
        return _trajectory(problem, name, order, request, solved, seconds, flags)

    def with_step(
        top: HeavyTop,
        start: State,
        times: Sequence[Fraction],
        precision: Precision = DOUBLE,
        *,
        system: System = HEAVY_TOP,
        step: Fraction = DEFAULT_STEP,
        xi: tuple[Fraction, ...] | None = None,
    ) -> Trajectory:
        return integrate(Problem.of(top, start, precision, system, xi), times, step)

    def by_tolerance(problem: Problem, times: Sequence[Fraction], tolerance: Fraction | None) -> Trajectory:
        return integrate(problem, times, FINEST if tolerance is None else tolerance)

    peer: Any = with_step if control == "step" else with_tolerance(by_tolerance)
    peer.integrator_name, peer.declared = name, declared
    return peer  # type: ignore[no-any-return]


def fixed_steps(
    request: Request,
    y: Doubles,
    advance: Callable[[Doubles, float, int], None],
    state: Callable[[Doubles], Doubles] = numpy.copy,
    compile: float = 0.0,
) -> Solution:
    """The solution by equal steps between two times, no longer than the step of the request.

    y: the initial value; ``advance(y, h, count)`` advances it in place by ``count`` steps.  state: y as a new state.
    """
    states, time, steps = [], 0.0, 0
    for end in request.times:
        more = math.ceil((1 - 1e-9) * abs(end - time) / request.control)  # the rounding of end - time adds no step
        if more:
            advance(y, (end - time) / more, more)
        time, steps = end, steps + more
        states.append(state(y))
    return Solution(states, time, steps, None, compile)


def _declared(names: Sequence[str] | None) -> tuple[str, ...] | None:
    if names is None:
        return None
    members = tuple(names) if isinstance(names, Iterable) and not isinstance(names, str) else (None,)
    if not all(isinstance(name, str) for name in members):
        raise refusal("Declared capabilities", "lists of names", quoted(names), 'Give, for example, ["heavy_top"].')
    return tuple(map(str, members))


def _request(name: str, control: str, problem: Problem, times: Sequence[Fraction], value: Fraction) -> Request:
    if problem.precision != DOUBLE:
        raise Unsupported(f"{name} does not support {problem.precision.name}.", "Use double.")
    require_control(name, control, value)
    grid = numpy.array([number(time, DOUBLE) for time in check_times(times)])
    numbers = numpy.array(problem.native(problem.parameters.numbers), dtype=float)
    start = numpy.array(problem.native((*problem.start.flat, *(problem.xi or ()))))
    return Request(problem.system, start, grid, numbers, float(value))


def _solution_with_start(name: str, request: Request, solve: Solve) -> Solution:
    """The solution of ``solve`` at the times after 0, which most libraries refuse, behind the start itself."""
    at_start = int(request.times[0] == 0)
    # copies: a solver may change its argument, and the result is judged by these times and this start
    later = replace(request, start=request.start.copy(), times=request.times[at_start:].copy())
    solved = solve(later) if len(later.times) else Solution(numpy.empty((0, request.width)), 0.0, 0, 0)
    if not isinstance(solved, Solution):
        raise PeerFailed(
            f"{name} returned a {type(solved).__name__} instead of Solution",
            "from heavytop.integrate.peers.double import Solution; return Solution(states, reached, steps): a state of "
            f"{request.width} numbers for each time, the last time reached, and the number of steps.",
        )
    if not at_start:
        return solved
    states = _states(name, solved.states, len(later.times), request.width)
    return replace(solved, states=numpy.concatenate([[request.start], states]))


def _trajectory(
    problem: Problem,
    name: str,
    order: int,
    request: Request,
    solved: Solution,
    seconds: dict[str, float],
    flags: dict[str, str],
) -> Trajectory:
    """The trajectory of a solution, up to the first state that is not finite."""
    times = request.times
    states = _states(name, solved.states, len(times), request.width)
    finite = numpy.isfinite(states).all(axis=1)
    count = len(states) if finite.all() else int(finite.argmin())
    end = abs(times[count]) if count < len(states) else math.inf
    known, last = abs(solved.reached) < end, times[count - 1] if count else 0.0
    outcome = solved.outcome if known and count == len(states) else Outcome.NON_FINITE
    return Trajectory(
        problem,
        name,
        tuple(exact(time) for time in times[:count]),
        tuple(of_quaternion(name, problem, state) if request.width == 7 else state for state in states[:count]),
        Outcome.SUCCESS if count == len(times) else outcome,
        exact(solved.reached if known and count < len(times) else last),
        solved.steps,
        order,
        seconds,
        flags,
        solved.evaluations,
    )


def _states(name: str, returned: Any, count: int, width: int) -> Any:
    """The states as an array of doubles, shape (m, width) with m <= count; raises PeerFailed for anything else."""
    states = numpy.asarray(returned)
    if not states.size:
        return numpy.zeros((0, width))
    if states.dtype.kind not in "fiu":
        raise PeerFailed(f"{name} returned states of {states.dtype}, not numbers of double")
    if states.ndim != 2 or states.shape[1] != width or len(states) > count:
        raise PeerFailed(
            f"{name} returned states of the shape {states.shape} for {plural(count, 'time')} where states have {width} "
            f"numbers, {_WIDE[width]}"
        )
    return states.astype(float)


@OncePerArguments
def compiler() -> Callable[[Any], Any]:
    """numba's ``njit`` with the cross product of this program; the identity if numba is not installed."""
    try:
        import numba
        from numba.extending import overload
    except ImportError:
        return lambda function: function
    product = vectors.cross
    overload(product, strict=False)(lambda a, b: product)
    return numba.njit


def reader(system: System) -> Callable[[Any], Parameters]:
    """A function that numba compiles, from the numbers of :class:`Request` to the parameters of the field."""
    if system is HEAVY_GYROSTAT:
        return lambda n: Parameters((n[0], n[1], n[2]), (n[3], n[4], n[5]), (n[6], n[7], n[8]))
    return lambda n: Parameters((n[0], n[1], n[2]), (n[3], n[4], n[5]), n[6])


def count(system: System) -> int:
    """The length of ``numbers`` of a :class:`Request` for a system."""
    return 9 if system is HEAVY_GYROSTAT else 7


@OncePerArguments
def fill(system: System, width: int = 6) -> Callable[..., None]:
    """A function (rates, t, y, numbers) that writes the field at y into ``rates``; width: of y, 6, or 9 with ξ.

    Its arguments except ``t`` are arrays, or pointers in machine code.
    """
    jit = compiler()
    field, velocity, read = jit(system.field), jit(system.angular_velocity), jit(reader(system))

    def write(rates: Any, _time: float, y: Any, numbers: Any) -> None:
        values = field(read(numbers), (y[0], y[1], y[2], y[3], y[4], y[5]))
        for i in range(6):
            rates[i] = values[i]

    if width == 6:
        return write
    write, product = jit(write), vectors.cross

    def write_with_attitude(rates: Any, time: float, y: Any, numbers: Any) -> None:
        write(rates, time, y, numbers)
        turning = velocity(read(numbers), (y[0], y[1], y[2], y[3], y[4], y[5]))
        values = product((y[6], y[7], y[8]), turning)
        for i in range(3):
            rates[6 + i] = values[i]

    return write_with_attitude


@OncePerArguments
def rates(system: System, width: int = 6) -> Callable[..., Any]:
    """(t, y, numbers) -> the field at y as a new array; machine code if numba is installed."""
    write = compiler()(fill(system, width))

    def rates(time: float, y: Any, numbers: Any) -> Any:
        result = numpy.empty(width)
        write(result, time, y, numbers)
        return result

    compiled = compiler()(rates)
    compiled(0.0, numpy.zeros(width), numpy.ones(count(system)))
    return compiled  # type: ignore[no-any-return]


def timed(make: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    """``make(*arguments)`` and its seconds, for a function that compiles at its first call."""
    began = perf_counter()
    result = make(*arguments)
    return result, perf_counter() - began
