"""Data of pictures: times, states and attitude of motions as arrays, checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from heavytop.api.motions import propagate
from heavytop.arguments import slack_of
from heavytop.errors import InputError, quoted, refusal
from heavytop.integrate.frames import framed
from heavytop.integrate.trajectory import Problem, Trajectory
from heavytop.measure.reference import Reference
from heavytop.precision import Vector, exact
from heavytop.top.attitude import perpendicular, rotated, transposed
from heavytop.top.equations import Parameters
from heavytop.top.heavy_top import HeavyTop, State

Motion = Trajectory | Reference
"""A computed motion (:func:`heavytop.propagate`) or a known one (:func:`heavytop.reference`)."""

_FEWEST = 2
AXES = {"axis1": (1.0, 0.0, 0.0), "axis2": (0.0, 1.0, 0.0), "axis3": (0.0, 0.0, 1.0)}
OF = (*AXES, "centre", "vertical")
MOST_EXACT = 400
"""The most samples whose exact errors or integrals are drawn; of more, a subset is."""


@runtime_checkable
class Crossings(Protocol):
    """States of a motion at which a function changes sign, as from :func:`heavytop.events`."""

    @property
    def function(self) -> str: ...
    def __len__(self) -> int: ...
    def to_numpy(self) -> NDArray[np.float64]: ...


@runtime_checkable
class PoincareSection(Protocol):
    """Crossings of several motions, as from :func:`heavytop.poincare`."""

    @property
    def events(self) -> Sequence[Crossings]: ...


class FaultCurve(Protocol):
    """The errors of one planted fault."""

    @property
    def name(self) -> str: ...
    @property
    def errors(self) -> NDArray[np.float64]: ...


@runtime_checkable
class PowerCurves(Protocol):
    """A test with its planted faults, as from :func:`heavytop.power`."""

    @property
    def times(self) -> Sequence[Fraction]: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def faults(self) -> Sequence[FaultCurve]: ...


@runtime_checkable
class SpacedErrors(Protocol):
    """Errors between samples, as from :func:`heavytop.between_samples`."""

    @property
    def spacing(self) -> Fraction: ...
    @property
    def errors(self) -> Mapping[str, float | None]: ...


@dataclass(frozen=True, slots=True)
class Samples:
    """The samples of a motion in double.  times: (n,).  omega, gamma: (n, 3), in body axes."""

    run: Motion
    times: NDArray[np.float64]
    omega: NDArray[np.float64]
    gamma: NDArray[np.float64]

    def rotations(self) -> NDArray[np.float64]:
        """R at every sample, (n, 3, 3), v_space = R v_body.

        A computed motion without attitude is integrated again with it; raises InputError for a known one without it.
        """
        run = self.run
        if isinstance(run, Reference):
            if run.attitude is None:
                raise InputError("This reference has no attitude.", "Use heavytop.reference(..., attitude=True).")
            return run.matrices()
        return (_with_attitude(run) if run.problem.xi is None else run).matrices()


def samples(run: Any) -> Samples:
    """A motion in double; raises InputError unless it has two samples or more, all finite."""
    if not isinstance(run, Trajectory | Reference):
        raise refusal("run", "a motion", quoted(run), "Give the result of heavytop.propagate or heavytop.reference.")
    count = len(run.states)
    if count < _FEWEST:
        raise InputError(
            f"A path needs at least two samples; got {count}.",
            "Give many times, such as numpy.arange(1, 1001) / 50, and no observer.",
        )
    states = run.to_numpy()
    if not np.isfinite(states).all():
        first = int(np.flatnonzero(~np.isfinite(states).all(axis=1))[0])
        raise InputError(f"The state of sample {first} is not finite.", "Draw the samples before it.")
    times = np.array([float(exact(time)) for time in run.times])[:count]
    return Samples(run, times, states[:, :3], states[:, 3:6])


def _with_attitude(run: Trajectory) -> Trajectory:
    """The motion integrated again, with its attitude."""
    problem = run.problem
    top, start = problem.given or (problem.top, problem.start)
    start = start.normalized()
    again = propagate(
        top,
        start,
        list(run.times),
        problem.precision,
        integrator=run.integrator,
        system=problem.system,
        xi=perpendicular(start.gamma),
    )
    if len(again.states) < len(run.states):
        raise InputError(f"The attitude could not be integrated: {again.outcome.message}.", "Call propagate with xi=.")
    carried = again if run.frame is None else framed(again, run.frame)
    return replace(run, problem=again.problem, attitude=carried.states[: len(run.states), 6:])


def axes_of(run: Motion) -> NDArray[np.float64] | None:
    """A, v_given = A v_principal, of a run with states in other axes than the principal ones, else None."""
    frame = getattr(run, "frame", None)
    return None if frame is None else np.array([[float(value) for value in row] for row in frame.axes])


def principal(run: Motion, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (n, 3) of a run in its principal axes."""
    rotation = axes_of(run)
    return vectors if rotation is None else vectors @ rotation


def parameters_of(run: Motion, top: HeavyTop | None) -> Parameters:
    """I, P r and the rotor of a motion, in principal axes; raises InputError for a known one without its ``top``."""
    if isinstance(run, Trajectory):
        return run.problem.parameters
    if not isinstance(top, HeavyTop):
        raise InputError("A reference does not contain its top.", "Give top=.")
    if (own := _vectors(run)) and own[:3] != _vectors(top):
        raise InputError("top is another than that of the reference.", "Give the one of heavytop.reference.")
    return Parameters(top.inertia, top.moment, top.rotor or 0)


def _vectors(of: Motion | HeavyTop) -> list[Vector]:
    """I, P r and the rotor of a top; of a motion Ω and γ at t = 0 as well, or none, where they are not known."""
    if isinstance(of, HeavyTop):
        return [of.inertia, of.moment, of.rotor or (Fraction(0),) * 3]
    if isinstance(of, Trajectory):
        top, start = of.problem.given or (of.problem.top, of.problem.start)
    elif of.mass is None and of.inertia and of.weight and of.centre and of.omega and of.gamma:
        top, start = HeavyTop(of.inertia, of.weight, of.centre, of.rotor), State(of.omega, of.gamma)
    else:
        return []
    return [*_vectors(top), start.omega, start.gamma]


def direction(run: Motion, of: str | None, top: HeavyTop | None) -> tuple[str, NDArray[np.float64]]:
    """(name, unit vector in body axes) of the body direction ``of``; None for the centre of mass, else axis 3."""
    if of is None:
        known = isinstance(run, Trajectory) or top is not None
        of = "centre" if known and any(parameters_of(run, top).moment) else "axis3"
    if of in AXES:
        return of, np.array(AXES[of])
    if of != "centre":
        raise InputError(f"of must name a vector; got {quoted(of)}.", f"Use {', '.join(OF)}.")
    moment = parameters_of(run, top).moment
    if not any(moment):
        raise InputError("The centre of mass is at the fixed point, or the weight is 0.", "Use axis1, axis2 or axis3.")
    largest = max(map(abs, moment))
    vector = np.array([float(value / largest) for value in moment])
    rotation = axes_of(run)
    return of, (vector if rotation is None else rotation @ vector) / np.linalg.norm(vector)


def path_in_space(run: Any, of: str | None, top: HeavyTop | None) -> tuple[str, Samples, NDArray[np.float64]]:
    """The name of the axis, the samples, and its path on the unit sphere, (n, 3), third component upwards.

    "vertical" is γ, the vertical in body axes.
    """
    drawn = samples(run)
    if of == "vertical":
        return of, drawn, drawn.gamma
    name, vector = direction(run, of, top)
    return name, drawn, drawn.rotations() @ vector


def compared(run: Any, known: Any) -> tuple[Problem, list[Fraction], list[list[Fraction]], list[list[Fraction]]]:
    """(problem, times, states, known states), exact, of a subset of many; raises InputError where these differ."""
    if not isinstance(run, Trajectory):
        raise refusal("run", "a computed motion", quoted(run), "Give the result of heavytop.propagate.")
    samples(run)
    samples(known)
    count = len(run.states)
    if count != len(known.states):
        raise InputError(f"Both runs must have the same times; got {count} and {len(known.states)}.", "Change one.")
    for one, two in zip(_vectors(run), _vectors(known), strict=False):
        if max(abs(a - b) for a, b in zip(one, two, strict=True)) > slack_of(run.problem.precision) * max(
            map(abs, one)
        ):
            raise InputError("Both runs must be of the same top and start.", "Change one.")
    indices = every(count)
    times = [exact(run.times[index]) for index in indices]
    slack = 4 * run.problem.precision.eps
    for time, index in zip(times, indices, strict=True):
        known_time = exact(known.times[index])
        if abs(time - known_time) > slack * abs(time):
            raise InputError(
                f"Sample {index} is at t = {float(time)!r} of one and {float(known_time)!r} of the other.",
                "Give the same times.",
            )
    return run.problem, times, exact_states(run, indices), exact_states(known, indices, run)


def every(count: int, most: int = MOST_EXACT) -> list[int]:
    """Indices of at most ``most`` of ``count`` samples, evenly distributed, with the first and the last."""
    if count <= most:
        return list(range(count))
    if most == 1:
        return [count - 1]
    return [round(n * (count - 1) / (most - 1)) for n in range(most)]


def exact_states(run: Motion, indices: Sequence[int], framed_by: Motion | None = None) -> list[list[Fraction]]:
    """(Ω, γ) at these indices, exact values of the printed numbers, in principal axes of the run, or ``framed_by``."""
    if isinstance(run, Reference):
        exact_values = [[exact(ball.value) for ball in run.states[index]][:6] for index in indices]
    else:
        exact_values = [[exact(value) for value in run.states[index][:6]] for index in indices]
    frame = getattr(framed_by or run, "frame", None)
    if frame is None:
        return exact_values
    back = transposed(frame.axes)
    return [[*rotated(back, state[:3]), *rotated(back, state[3:])] for state in exact_values]
