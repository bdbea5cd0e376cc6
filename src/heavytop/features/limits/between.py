"""The error of slerp, linear, Hermite and Lagrange interpolation between samples of a motion at equal steps."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, partial
from typing import Any

import numpy

from heavytop import arguments
from heavytop.arguments import Number
from heavytop.display import Tabular, TitledTable
from heavytop.errors import InputError, argument, refusal
from heavytop.integrate.frames import Setup
from heavytop.integrate.registry import propagator
from heavytop.precision import Array, exact_text, physical, six_digits
from heavytop.top.bodies import Body
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State, check_times

METHODS = ("slerp", "linear", "hermite", "lagrange")
"""slerp: of the attitude, an angle in radians.  The others: of (Ω, γ), relative above 1; hermite: cubic, by states and
their derivatives; lagrange: cubic, by four samples."""
_ORDERS = {"slerp": 2, "linear": 2, "hermite": 4, "lagrange": 4}
_PARTS = 8
_MOST = 20_000
"""Intervals at most."""


@dataclass(frozen=True, slots=True, repr=False)
class BetweenSamples(Tabular):
    """The largest error of each of :data:`METHODS` between samples.

    spacing: Δt, of which the last time is a multiple.  errors: by method; None where there are too few samples.
    within: the target error.  largest: by method the largest Δt, a divisor of the last time, that meets it; None where
    20,000 intervals do not.
    """

    until: Fraction
    spacing: Fraction
    errors: dict[str, float | None]
    within: float | None
    largest: dict[str, Fraction | None]
    asked: Fraction

    def to_json(self) -> dict[str, Any]:
        """The entry ``between`` of a document."""
        largest = {name: None if value is None else exact_text(value) for name, value in self.largest.items()}
        return {"spacing": exact_text(self.spacing), "errors": self.errors, "within": self.within, "largest": largest}

    def _table(self) -> TitledTable:
        def row(name: str) -> tuple[str, ...]:
            error, best = self.errors[name], self.largest.get(name)
            cells = (name, "too few samples" if error is None else f"{error:.2e}")
            return cells if self.within is None else (*cells, "none" if best is None else six_digits(best))

        head = ("method", "largest error")
        spacings = () if self.within is None else (f"largest Δt for {self.within:.1e}",)
        title = f"Between samples {six_digits(self.spacing)} apart"
        if self.asked != self.spacing:
            title += f" ({six_digits(self.asked)}, reduced to a divisor of the last time)"
        return TitledTable(title, (*head, *spacings), [row(name) for name in METHODS])


def between_samples(
    top: HeavyTop | Body,
    start: State,
    until: Number,
    spacing: Number,
    within: Number | None = None,
    *,
    system: System | str | None = None,
) -> BetweenSamples:
    """How far interpolation between samples is from the motion, and how dense samples must be.

    Arguments:
        top, start, system: as in :func:`heavytop.propagate`.
        until, spacing: exact, positive; of samples, ``spacing`` being reduced to a divisor of ``until``.
        within: the target error, above 1e-12.

    Returns:
        A ``BetweenSamples``: ``errors`` and ``largest`` by "slerp" (of the attitude, radians), "linear", "hermite"
        and "lagrange" (of Ω and γ), measured at seven points of each interval.

    Raises:
        InputError: for an invalid motion, for more than 20,000 intervals, and for other numbers.
    """
    body, state = arguments.motion(top, start)
    about, end, step = arguments.system(system, body), physical(until, "until"), physical(spacing, "between")
    target = None if within is None else float(physical(within, "within"))
    if not 0 < step <= end:
        rule = f"above 0 and at most {argument('until')}"
        raise refusal("spacing", rule, spacing, f"Give, for example, {six_digits(abs(end) / 100)}.")
    if target is not None and not 1e-12 < target < 1:
        raise refusal("within", "between 1e-12 and 1", within, "Give, for example, 1e-6.")
    count = int(-(-end // step))
    if count > _MOST:
        raise InputError(f"At most {_MOST} intervals; got {count}.", "Give a larger spacing or an earlier time.")
    errors = cache(partial(_errors, body, state, about, end))
    largest = {} if target is None else {name: _largest(errors, name, target, end, count) for name in METHODS}
    return BetweenSamples(end, end / count, errors(count), target, largest, step)


def _errors(
    body: HeavyTop | Body, start: State, system: System, until: Fraction, count: int
) -> dict[str, float | None]:
    """The errors by method over ``count`` intervals of a motion in principal axes, sampled in double."""
    setup = Setup.of(body, start, arguments.precision("double"), system)
    run = propagator("heyoka", {"xi": setup.xi})
    times = check_times(numpy.arange(count * _PARTS + 1) * float(until / (count * _PARTS)))
    trajectory = run(setup.top, setup.start, times, system=system)
    trajectory = replace(trajectory, states=trajectory.states[:, :6], attitude=trajectory.states[:, 6:])
    y, q = trajectory.states.T, trajectory.quaternions().T
    rates = numpy.array(numpy.broadcast_arrays(*system.field(trajectory.problem.parameters.mapped(float), y)))
    return _compared(y, q, rates[:, ::_PARTS] * float(until / count))


def _compared(y: Array, q: Array, slopes: Array) -> dict[str, float | None]:
    """The largest errors by method.

    y, q: states and quaternions at each eighth of an interval, shape (6 or 4, 8 n + 1).  slopes: y' Δt at the samples.
    """
    nodes, turns = y[:, ::_PARTS], q[:, ::_PARTS]
    a, b, da, db = nodes[:, :-1], nodes[:, 1:], slopes[:, :-1], slopes[:, 1:]
    largest: dict[str, float | None] = dict.fromkeys(METHODS, 0.0)
    for part in range(1, _PARTS):
        u, true = part / _PARTS, y[:, part::_PARTS]
        hermite = (1 - u) ** 2 * ((1 + 2 * u) * a + u * da) + u**2 * ((3 - 2 * u) * b - (1 - u) * db)
        candidates = {"linear": (1 - u) * a + u * b, "hermite": hermite}
        errors = {name: _relative(value, true) for name, value in candidates.items()}
        errors["slerp"] = float(_angles(_slerp(turns[:, :-1], turns[:, 1:], u), q[:, part::_PARTS]).max())
        if nodes.shape[1] > 3:
            stencils = (
                (nodes, u, slice(1, -1)),
                (nodes[:, :4], u - 1, slice(1)),
                (nodes[:, -4:], u + 1, slice(-1, None)),
            )
            errors["lagrange"] = max(_relative(_lagrange(four, v), true[:, at]) for four, v, at in stencils)
        largest |= {name: max(largest[name] or 0.0, error) for name, error in errors.items()}
    return largest if nodes.shape[1] > 3 else largest | {"lagrange": None}


def _relative(value: Array, true: Array) -> float:
    return float((abs(value - true) / numpy.maximum(1, abs(true))).max())


def _lagrange(nodes: Array, u: float) -> Array:
    """Interpolation by four successive samples at u from the second, in Δt: inner intervals have u from 0 to 1."""
    w, x, y, z = (nodes[:, k : nodes.shape[1] - 3 + k] for k in range(4))
    weights = (-u * (u - 1) * (u - 2) / 6, (u + 1) * (u - 1) * (u - 2) / 2, -(u + 1) * u * (u - 2) / 2)
    return weights[0] * w + weights[1] * x + weights[2] * y + (u + 1) * u * (u - 1) / 6 * z


def _slerp(a: Array, b: Array, u: float) -> Array:
    b = numpy.where((a * b).sum(axis=0) < 0, -b, b)
    half = 2 * numpy.arcsin(numpy.clip(numpy.linalg.norm(a - b, axis=0) / 2, 0, 1))
    small = half < 1e-9
    sine = numpy.where(small, 1, numpy.sin(half))
    return numpy.where(small, (1 - u) * a + u * b, (numpy.sin((1 - u) * half) * a + numpy.sin(u * half) * b) / sine)


def _angles(a: Array, b: Array) -> Array:
    """The angles between attitudes, radians."""
    chord = numpy.minimum(numpy.linalg.norm(a - b, axis=0), numpy.linalg.norm(a + b, axis=0))
    angles: Array = 4 * numpy.arcsin(numpy.clip(chord / 2, 0, 1))
    return angles


def _largest(errors: Any, name: str, target: float, end: Fraction, count: int) -> Fraction | None:
    """The largest spacing that meets the error, by a search around the prediction of the method's order."""

    def within(count: int) -> bool:
        error = errors(count)[name]
        return error is not None and error <= target

    high = low = min(_MOST, max(1, math.ceil(count * ((errors(count)[name] or 1) / target) ** (1 / _ORDERS[name]))))
    while not within(high):
        if high == _MOST:
            return None
        low, high = high, min(high + max(1, high // 16), _MOST)
    while low and within(low):
        low, high = low - max(1, low // 16), low
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if within(middle) else (middle, high)
    return Fraction(end, high)
