"""The power of a regression test: the planted faults that a comparison with the true motion detects, and when.

A test compares Ω and the attitude of a run at equal steps with the true motion, each component relative above 1, and
fails where one is off by more than its tolerance.  Every fault is computed in double, by heyoka.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_DOWN, Context
from fractions import Fraction
from functools import partial
from math import isfinite
from typing import Any

import numpy

from heavytop import arguments
from heavytop.arguments import Number
from heavytop.display import Tabular, TitledTable, plural
from heavytop.errors import InputError, OutOfReach, quoted, refusal
from heavytop.integrate.frames import Setup
from heavytop.integrate.registry import control_name, expected_steps, named, propagator
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE, QUAD, Array, Precision, Scalar, cross, exact_text, physical, real, six_digits
from heavytop.top.bodies import PIVOT, Body
from heavytop.top.equations import GYROSTAT, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.inertia_slips import minus, plus, six_of, steiner

Motion = tuple[HeavyTop | Body, State, System]
_MOST = 100_000
_MOST_STEPS, _STEP_SECONDS = 10**7, 2e-4
"""Expected steps of a motion, and seconds of one for the fault ``float32``."""
_G = Fraction("9.8") / Fraction("9.81")


@dataclass(frozen=True, slots=True, eq=False)
class PlantedFault:
    """A planted fault and its detection.

    errors: the largest of a component at each time.  detected_from: the first time at which they exceed the tolerance;
    None where the test passes.  tolerance: the largest error, which a tolerance must stay below: printed rounded down.
    """

    name: str
    errors: Array
    detected_from: Fraction | None
    tolerance: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Power(Tabular):
    """The faults that a test detects.

    times: of its samples.  tolerance: of it.  error: the largest of a right run; passes: whether that is within it.
    faults: planted, a :class:`PlantedFault` each.  left_out: why a fault is not planted, by its name.
    """

    times: tuple[Fraction, ...]
    tolerance: float
    error: float
    faults: tuple[PlantedFault, ...]
    left_out: dict[str, str]

    @property
    def passes(self) -> bool:
        """Whether a right run passes the test."""
        return self.error <= self.tolerance

    @property
    def detects_all(self) -> bool:
        """Whether a right run passes the test and no planted fault does."""
        return self.passes and all(fault.detected_from is not None for fault in self.faults)

    def to_json(self) -> dict[str, Any]:
        """The document of `heavytop power`."""
        faults = [
            {
                "name": fault.name,
                "detected_from": None if fault.detected_from is None else exact_text(fault.detected_from),
                "tolerance": fault.tolerance,
            }
            for fault in self.faults
        ]
        right = {"tolerance": self.tolerance, "error": self.error, "passes": self.passes}
        return {"faults": faults, "right": right, "left_out": self.left_out}

    def _table(self) -> TitledTable:
        rows = [
            (
                fault.name,
                "not detected" if fault.detected_from is None else six_digits(fault.detected_from),
                _rounded_down(fault.tolerance),
            )
            for fault in self.faults
        ]
        end = six_digits(self.times[-1])
        said = f"{'passes' if self.passes else 'fails'}: its largest error is {self.error:.2g}"
        notes = [f"a correct run {said if isfinite(self.error) else f'fails: it does not reach t = {end}'}"]
        notes += [f"{name} is not planted: {why}" for name, why in self.left_out.items()]
        detected = sum(fault.detected_from is not None for fault in self.faults)
        test = f"A test up to t = {end} with tolerance {self.tolerance:.2g}"
        title = f"{test} detects {detected} of {plural(len(self.faults), 'planted fault')}"
        return TitledTable(title, ("planted fault", "detected from t", "widest tolerance"), rows, notes)


def power(
    top: HeavyTop | Body,
    start: State,
    until: Number,
    tolerance: Number,
    step: Number | None = None,
    planted: str | Sequence[str] = "all",
    *,
    integrator: str | Any = "heyoka",
    control: Number | None = None,
    system: System | str | None = None,
) -> Power:
    """The time from which a regression test of a motion detects each planted fault, and the widest tolerance for that.

    Arguments:
        top, start, system: as in :func:`heavytop.propagate`.
        until: where the test ends.  tolerance: of the test, relative above 1.
        step: between samples, a hundredth of ``until`` where None; of the fault ``late`` the step.
        planted: names of faults, or "all"; the error of an unknown one lists them.
        integrator, control: of a right run in double, and its tolerance or step.

    Returns:
        A ``Power``: ``faults`` with ``name``, ``detected_from`` and ``tolerance``; ``error``, ``passes``.

    Raises:
        InputError: for an invalid motion, an unknown fault, more than 100,000 samples, and for other numbers.
        OutOfReach: for a test of more than some ten million steps, which takes hours.
    """
    motion = _motion(top, start, system)
    end, limit = physical(until, "until"), float(physical(tolerance, "tolerance"))
    spacing = end / 100 if step is None else physical(step, "step")
    if not (0 < spacing <= end and limit > 0):
        values = f"until = {until}, step = {spacing}, tolerance = {tolerance}"
        raise InputError(f"{values}: these must be positive, and step at most until.", "Give, say, 10, 0.1, 1e-6.")
    count = int(end // spacing)
    if count > _MOST:
        raise InputError(f"At most {_MOST} samples; got {count}.", "Give a larger step, or an earlier end.")
    times = [spacing * k for k in range(1, count + 1)]
    expected_seconds(*motion[:2], times[-1], motion[2])
    true, method = _rows(motion, times), named(integrator)
    options = {} if control is None else {control_name(method) or "tolerance": physical(control, "control")}
    error = float(_errors(_states(motion, times, DOUBLE, method, options), _states(motion, times, QUAD)).max())
    faults, left_out = [], {}
    for name in _names(planted):
        rows = FAULTS[name](motion, times)
        if isinstance(rows, str):
            left_out[name] = rows
            continue
        errors = _errors(rows, true).max(axis=1)
        detected_from = next((time for time, error in zip(times, errors, strict=True) if error > limit), None)
        faults.append(PlantedFault(name, errors, detected_from, float(errors.max())))
    return Power(tuple(times), limit, error, tuple(faults), left_out)


def expected_seconds(top: Any, start: Any, until: Number, system: System | str | None = None) -> float:
    """The seconds of a test to the time ``until``, nearly all for ``float32``; raises OutOfReach for hours."""
    body, state, system = _motion(top, start, system)
    end, setup = physical(until, "until"), Setup.of(body, state, DOUBLE, system)
    steps = expected_steps(Problem.of(setup.top, setup.start, DOUBLE, system), end)
    if steps > _MOST_STEPS:
        earlier = _rounded_down(float(end * _MOST_STEPS / steps))
        raise OutOfReach(
            f"A test up to t = {six_digits(end)} takes about {six_digits(Fraction(steps))} steps for each fault.",
            f"At most {six_digits(Fraction(_MOST_STEPS))} are supported: give an end up to {earlier}.",
        )
    return 1 + _STEP_SECONDS * steps


def _motion(top: Any, start: Any, system: System | str | None) -> Motion:
    body, state = arguments.motion(top, start)
    chosen = arguments.system(system, body)
    if chosen is GYROSTAT:
        raise InputError("power does not support the system gyrostat.", "Use heavy_gyrostat, with a rotor.")
    return body, state, chosen


def _rounded_down(value: float) -> str:
    """Two digits, so that a tolerance as printed detects the error."""
    return f"{float(Context(2, ROUND_DOWN).create_decimal(value)):.2g}"


def _names(planted: str | Sequence[str]) -> list[str]:
    names, remedy = planted.split(",") if isinstance(planted, str) else planted, f"Use {', '.join(FAULTS)}, or all."
    if not isinstance(names, list | tuple) or not names or not all(isinstance(name, str) for name in names):
        raise refusal("planted", "names of faults", quoted(planted), remedy)
    if list(names) == ["all"]:
        return list(FAULTS)
    if unknown := [name for name in names if name not in FAULTS]:
        raise InputError(f"Unknown fault {quoted(unknown[0])}.", remedy)
    return list(names)


def _errors(rows: Array, true: Array) -> Array:
    errors: Array = abs(rows - true) / numpy.maximum(1, abs(true))
    return numpy.where(numpy.isfinite(errors), errors, numpy.inf)


def _states(
    motion: Motion, times: Sequence[Fraction], form: Precision, which: Any = "multiword", options: Any = None
) -> Array:
    """(Ω, γ), shape (n, 6), in the given axes; infinite after the end of an aborted run."""
    body, start, system = motion
    setup = Setup.of(body, start, form, system)
    run = setup.given(propagator(which, options or {})(setup.top, setup.start, times, form, system=system))
    states = numpy.full((len(times), 6), numpy.inf)
    states[: len(run.states)] = run.to_numpy()[:, :6]
    return states


def _rows(motion: Motion, times: Sequence[Fraction], form: Precision = DOUBLE, field: System | None = None) -> Array:
    """Ω and R row by row, shape (n, 12), in the given axes; field: of other equations of motion."""
    body, start, system = motion
    setup = Setup.of(body, start, form, system)
    top = setup.top if field is None else replace(setup.top, rotor=None)
    run = propagator("heyoka", {"xi": setup.xi})(top, setup.start, times, form, system=field or system)
    run = setup.given(replace(run, states=run.states[:, :6], attitude=run.states[:, 6:]))
    return numpy.hstack([run.to_numpy()[:, :3], run.matrices().reshape(-1, 9)])


def _torque_alone(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """J Ω' = P γ × r and γ' = γ × Ω."""
    torque = cross(y[3:6], p.moment)
    return (*(part / moment for part, moment in zip(torque, p.inertia, strict=True)), *cross(y[3:6], y[:3]))


_NO_GYROSCOPIC_TERM = System("no_gyroscopic_term", _torque_alone, lambda _, y: tuple(y[:3]))


def _transposed(motion: Motion, times: Sequence[Fraction]) -> Array:
    rows = _rows(motion, times)
    matrices = rows[:, 3:].reshape(-1, 3, 3).transpose(0, 2, 1).reshape(-1, 9)
    return numpy.hstack([rows[:, :3], matrices])


def _steiner(motion: Motion, times: Sequence[Fraction], changed: Any) -> Array | str:
    """The motion with the Steiner term forgotten, or added twice."""
    body = motion[0]
    if not isinstance(body, Body) or not any(body.centre):
        return "the mass is unknown, or its centre is the pivot"
    return _of_tensor(motion, times, changed(body.tensor, steiner(body.mass, body.centre)))


def _of_tensor(motion: Motion, times: Sequence[Fraction], tensor: Any) -> Array | str:
    """The motion with another tensor about the pivot."""
    body, start, system = motion
    assert isinstance(body, Body)
    try:
        other = Body(body.mass, body.gravity, body.centre, six_of(tensor), PIVOT, body.rotor)
    except InputError:
        return "no rigid body has the tensor"
    return _rows((other, start, system), times)


_EQUAL = "the entries that it exchanges are equal"


def _order(motion: Motion, times: Sequence[Fraction]) -> Array | str:
    """I12 and I23 exchanged, as in the order 11, 22, 33, 23, 13, 12; of a diagonal tensor the last two moments."""
    body, start, system = motion
    if isinstance(body, HeavyTop):
        a, b, c = body.inertia
        if b == c:
            return _EQUAL
        return _rows((HeavyTop((a, c, b), body.weight, body.centre, body.rotor), start, system), times)
    a, b, c, d, e, f = six_of(body.tensor)
    six = (a, b, c, f, e, d) if any((d, e, f)) else (a, c, b, d, e, f)
    if six == six_of(body.tensor):
        return _EQUAL
    return _of_tensor(motion, times, ((six[0], six[3], six[4]), (six[3], six[1], six[5]), (six[4], six[5], six[2])))


def _gravity(motion: Motion, times: Sequence[Fraction]) -> Array | str:
    body, start, system = motion
    if not any(body.moment):
        return "the weight exerts no torque"
    if isinstance(body, Body):
        other: HeavyTop | Body = Body(body.mass, body.gravity * _G, body.centre, six_of(body.tensor), PIVOT, body.rotor)
    else:
        other = HeavyTop(body.inertia, body.weight * _G, body.centre, body.rotor)
    return _rows((other, start, system), times)


FAULTS: dict[str, Callable[[Motion, Sequence[Fraction]], Array | str]] = {
    "no_gyroscopic_term": lambda motion, times: _rows(motion, times, field=_NO_GYROSCOPIC_TERM),
    "transposed": _transposed,
    "steiner_forgotten": partial(_steiner, changed=minus),
    "steiner_twice": partial(_steiner, changed=plus),
    "late": lambda motion, times: _rows(motion, [time - times[0] / 2 for time in times]),
    "float32": lambda motion, times: _rows(motion, times, real(24)),
    "tensor_order": _order,
    "gravity_9.8": _gravity,
}
"""transposed: Rᵀ in place of R.  late: by half a step.  gravity_9.8: in place of 9.81."""
