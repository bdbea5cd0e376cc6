"""Samples of a motion in double, and their errors relative to a simulated one: the test of every hypothesis.

Motions are simulated by heyoka in double.  Errors are relative to the size of Ω and of γ along the simulated motion, so
that units do not matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from math import floor

import numpy

from heavytop.errors import HeavyTopError
from heavytop.features.score.diagnose.search import FIRST, LIKELY_DROP, Array
from heavytop.integrate.heyoka.engines import compiled
from heavytop.integrate.heyoka.motions import states_at
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import DOUBLE, decimal_text, dot, log10, plain_decimal
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, SYSTEMS, System
from heavytop.top.heavy_top import HeavyTop, State

WITH_ATTITUDE = (HEAVY_TOP, HEAVY_GYROSTAT)
"""Systems with which an attitude is integrated."""

VARIES, AS_AT_START = "varies", "that of the start"
"""Texts for first integrals that vary, or keep the value of the start."""
MOST_SAMPLES = 24
_TURNS = 60.0
"""Radians that the body turns until the last sample compared, if there are a few samples before."""
_FEW = 6
_FEWEST = 3
_STEPS = 50_000
"""Most steps of heyoka in one simulated motion: they take a tenth of a second."""
_LONGEST = 1e5
"""Radians that a body may turn in so many steps, roughly."""
FARTHEST = 3000.0
"""Radians that the body may turn until the last simulated time."""
_OTHER_UNIT = Fraction(11, 10)
"""Another unit of time and of moments, in which all data round differently."""
_TRUSTED = 1e-11
"""heyoka's states are trusted while those in other units agree to that, relative to their size."""
_USUAL = 3.0
"""Decades by which data may differ from 1 before they are rescaled."""
MOST_AT_ONCE = 2000
_NOTABLE = 0.02
"""A fitted number must differ by this part or be a short decimal: methods have small biases."""
SHORT = 4
_DIGITS = range(1, SHORT + 1), range(SHORT + 1, 13)
"""Digits of a short decimal, and of a longer one."""
SMALL = 100
"""Denominators of small fractions."""
_ANISOTROPY = 3.0
"""Factor by which M may grow more than Ω."""


@dataclass(frozen=True, slots=True)
class Units:
    """Powers of ten, units in which times and moments of inertia are neither large nor small."""

    time: Fraction = Fraction(1)
    inertia: Fraction = Fraction(1)

    @property
    def moment(self) -> Fraction:
        """The unit of P r and of energies."""
        return self.inertia / self.time**2


@dataclass(frozen=True, slots=True)
class FileAxes:
    """Axes of the body in which a file gives its vectors, and its columns.

    axes: A with v_file = A v_principal.  xi: the attitude vector at t = 0 in principal axes; None where no attitude is
    given.  columns: the places of those of Ω1 Ω2 Ω3 γ1 γ2 γ3 that are columns of the file.
    """

    axes: Array = field(default_factory=lambda: numpy.eye(3))
    xi: tuple[Fraction, ...] | None = None
    columns: tuple[int, ...] = tuple(range(6))


@dataclass(frozen=True, slots=True)
class Examined:
    """The motion of a file at the samples that are compared.

    top, start: in principal axes; everything else in the axes of the file.
    all_times, all_states: of the whole file.  rows: the indices of the compared samples in it.
    states: of these rows, shape (n, 6), in double, or (n, 9) with ξ where there is an attitude; nan where the file does
    not give a vector.
    units: everything is in these.  rate: radians per time unit, roughly, at which the motion turns.
    refused: the error of the first samples beyond which a motion is refuted.
    """

    top: HeavyTop
    start: State
    system: System
    all_times: tuple[Fraction, ...]
    all_states: Array
    rows: tuple[int, ...]
    states: Array
    rate: float
    units: Units
    frame: FileAxes
    refused: float = float("inf")

    @property
    def times(self) -> list[Fraction]:
        """Times of the compared rows."""
        return [self.all_times[row] for row in self.rows]

    @property
    def given_times(self) -> list[Fraction]:
        """Times of these rows in the unit of the file."""
        return [time * self.units.time for time in self.times]

    @property
    def is_whole(self) -> bool:
        """Whether Ω and γ are known in every sample."""
        return not numpy.isnan(self.states[:, :6]).any()

    @property
    def tensor(self) -> Array:
        """The inertia tensor in the axes of the file."""
        tensor: Array = self.frame.axes * floats(self.top.inertia) @ self.frame.axes.T
        return tensor

    def in_file(self, vector: Sequence[Fraction]) -> Array:
        """A vector in principal axes, or several one after the other, in the axes of the file."""
        products: Array = (floats(vector).reshape(-1, 3) @ self.frame.axes.T).reshape(-1)
        return products

    def starting(self, values: Array) -> Examined:
        """This motion with that start, in the axes of the file."""
        parts = [tuple(map(Fraction, part)) for part in values.reshape(-1, 3) @ self.frame.axes]
        return replace(self, start=State(*parts[:2]), frame=replace(self.frame, xi=parts[2] if parts[2:] else None))

    def with_body(self, tensor: Array, moment: Array, rotor: Array | None = None) -> Examined:
        """This motion with another body, in the axes of the file.

        Raises InputError for moments of inertia that are not positive.
        """
        moments, axes = principal(tensor)
        start = self.in_file((*self.start.flat, *(self.frame.xi or ())))
        carried = None if self.top.rotor is None else self.in_file(self.top.rotor) if rotor is None else rotor
        top = HeavyTop(
            [Fraction(m) for m in moments],
            1,
            [Fraction(n) for n in axes.T @ moment],
            rotor=None if carried is None else [Fraction(k) for k in axes.T @ carried],
        )
        return replace(self, top=top, frame=replace(self.frame, axes=axes)).starting(start)

    def simulated(self, times: Sequence[Fraction]) -> Array | None:
        """The motion at any times, of both signs and in any order.

        None where it cannot be computed, and beyond :data:`FARTHEST` radians.
        """
        if any(abs(float(time)) * self.rate > FARTHEST for time in times):
            return None
        xi = self.frame.xi if self.system in WITH_ATTITUDE else None
        states = motion(self.top, self.start, self.system, times, xi)
        if states is None:
            return None
        return (states.reshape(len(states), -1, 3) @ self.frame.axes.T).reshape(len(states), -1)

    def at(self, rows: Sequence[int]) -> Examined:
        """This motion at other samples."""
        return replace(self, rows=tuple(rows), states=self.all_states[list(rows)])

    def widened(self) -> Examined:
        """This motion with as many as :data:`MOST_AT_ONCE` samples, which heyoka reaches and is trusted at."""
        reached = [abs(float(time)) * self.rate <= FARTHEST for time in self.all_times[:MOST_AT_ONCE]]
        return self.at(range(sum(reached))).trusted()

    def trusted(self) -> Examined:
        """This motion up to where rounding errors grow beyond the errors that are diagnosed."""
        truth, unit = self.simulated(self.times) if self.rows else None, _OTHER_UNIT
        if truth is None:
            return self
        top = HeavyTop([i * unit for i in self.top.inertia], self.top.weight / unit, self.top.centre, self.top.rotor)
        start = State([w / unit for w in self.start.omega], self.start.gamma)
        slower = replace(self, rate=self.rate / float(unit), top=top, start=start)
        other = slower.simulated([time * unit for time in self.times])
        if other is None:
            return self
        states = other * numpy.array([float(unit)] * 3 + [1.0] * (other.shape[1] - 3))
        far = replace(self, states=states).errors(truth) > _TRUSTED
        return self.at(self.rows[: int(numpy.argmax(far))]) if far.any() else self

    def follows(self, row: int) -> Array | None:
        """The state at the sample after ``row`` of the motion through the given state of ``row``; None without one."""
        span = self.all_times[row + 1] - self.all_times[row]
        if abs(float(span)) * self.rate > FARTHEST:
            return None
        if numpy.isnan(self.all_states[row]).any():
            return None
        try:
            states = self.starting(self.all_states[row]).simulated([span])
        except HeavyTopError:  # beyond the numbers that a start may have
            return None
        return None if states is None else states[0]

    def errors(self, supposed: Array | None) -> Array:
        """The error of each state relative to the size of Ω and γ in the simulated ones; infinite without any.

        supposed: shape (..., n, 6 or more), of as many motions as the axes before say.
        """
        if supposed is None:
            return numpy.full(len(self.rows), numpy.inf)
        width = min(self.states.shape[1], supposed.shape[-1])
        off = numpy.abs(self.states[:, :width] - supposed[..., :width])
        omega, gamma = (numpy.abs(part).max(axis=(-2, -1)) for part in (supposed[..., :3], supposed[..., 3:]))
        omega = numpy.maximum(omega, 1e-3 * self.rate)[..., None]
        gamma = numpy.where(gamma == 0, 1.0, gamma)[..., None]
        # of what the file gives
        of_omega, of_gamma = (numpy.fmax.reduce(part, axis=-1) for part in (off[..., :3], off[..., 3:]))
        errors: Array = numpy.fmax(of_omega / omega, of_gamma / gamma)
        return numpy.nan_to_num(errors, nan=numpy.inf, posinf=numpy.inf)

    def refusing(self, error: float) -> Examined:
        """This motion, whose error is ``error``, with the error of its first samples that refutes a hypothesis."""
        omega = numpy.nan_to_num(numpy.abs(self.states[:, :3]), nan=1.0)
        return replace(self, refused=refused(float(omega[: self._first].max()), float(omega.max()), error))

    @property
    def _first(self) -> int:
        return FIRST[0] + (not self.times[0])

    def motion_errors(self, times: Sequence[Fraction] | None = None) -> Array:
        """The error of each sample relative to the motion, or to that at other times; infinite after a refutation."""
        times = self.times if times is None else times
        early = self.at(self.rows[: self._first])
        errors = early.errors(early.simulated(times[: self._first]))
        if len(errors) == len(self.rows):
            return errors
        if not errors.max() <= self.refused:
            return numpy.append(errors, numpy.full(len(self.rows) - len(errors), numpy.inf))
        return self.errors(self.simulated(times))


def refused(early: float, largest: float, error: float) -> float:
    """The error of the first samples beyond which a motion is refuted, also relative to the largest Ω.

    early, largest: |Ω| of the first samples and of all.  error: the error of the file as it stands.
    """
    growth = _ANISOTROPY * largest / early if early else numpy.inf
    return float(growth * (error if numpy.isfinite(error) else 1.0) / LIKELY_DROP)


def examined(
    top: HeavyTop,
    start: State,
    system: System,
    times: Sequence[Fraction],
    states: Sequence[Sequence[Fraction | None]],
    worst: int | None = None,
    frame: FileAxes | None = None,
) -> Examined | None:
    """At most :data:`MOST_SAMPLES` samples, over the first turns of the body, and ``worst`` where it is among these.

    Those where roundings of the start hide the motion are left out if enough remain.  None for numbers that no double
    holds.  states: in the axes of ``frame``, principal ones without it; None for numbers that are not given.
    """
    turning = start
    if any(times) and abs(next(filter(None, times))) * turning_rate(top, start) > FARTHEST:
        # no sample is within reach: the start may give the angular momentum
        turning = State([w / i for w, i in zip(start.omega, top.inertia, strict=True)], start.gamma)
    units = _units(top, turning)
    inertia, force = [i / units.inertia for i in top.inertia], units.inertia / units.time**2
    rotor = None if top.rotor is None else [k * units.time / units.inertia for k in top.rotor]
    top = HeavyTop(inertia, top.weight / force, top.centre, rotor)
    start = State([w * units.time for w in start.omega], start.gamma)
    times = [time / units.time for time in times]
    scaled = [(*(None if w is None else w * units.time for w in state[:3]), *state[3:]) for state in states]
    try:
        array = numpy.array([[numpy.nan if value is None else float(value) for value in state] for state in scaled])
        spin = numpy.linalg.norm(floats([w * units.time for w in turning.omega]))
        ends = [float(time) for time in times]
        moment = [float(value) for value in top.moment]
    except OverflowError:
        return None
    if not len(states) or numpy.isinf(array).any() or numpy.isnan(array).all():
        return None
    fall = (numpy.linalg.norm(moment) / float(max(inertia))) ** 0.5
    carried = numpy.linalg.norm([float(k) for k in top.rotor or ()]) / float(max(inertia))
    rate = float(max(spin, fall, carried)) or 1.0
    rows = chosen_rows(ends, rate)
    if worst is not None and worst < rows[-1]:
        rows = sorted({*rows, worst})
    samples = Examined(
        top, start, system, tuple(times), array, tuple(rows), array[rows], rate, units, frame or FileAxes()
    )
    trusted = samples.trusted()
    return trusted if len(trusted.rows) >= min(_FEWEST, len(rows)) else samples


def chosen_rows(times: Sequence[float], rate: float) -> list[int]:
    """At most :data:`MOST_SAMPLES` samples over the first turns of the body, or a few where they lie far apart."""
    early = sum(abs(time) * rate <= _TURNS for time in times)
    last = max(early, min(len(times), _FEW))
    return sorted({round(i) for i in numpy.linspace(0, last - 1, min(last, MOST_SAMPLES))} | {*range(min(last, _FEW))})


def turning_rate(top: HeavyTop, start: State) -> Fraction:
    """Radians per time unit at which the motion turns, roughly, to two digits: |Ω| at the start, or that of a fall."""
    squares = Fraction(dot(start.omega, start.omega)), Fraction(dot(top.moment, top.moment)) / max(top.inertia) ** 2
    powers = [
        power / over for square, over in zip(squares, (2, 4), strict=True) if (power := log10(square)) is not None
    ]
    if not powers:
        return Fraction(1)
    whole = floor(max(powers))
    return Fraction(round(100 * 10 ** (max(powers) - whole)), 100) * Fraction(10) ** whole


def _units(top: HeavyTop, start: State) -> Units:
    """1 where the numbers are of a usual size."""
    largest = max(top.inertia)
    squares = [w * w for w in start.omega] + [abs(n) / largest for n in top.moment]
    squares += [(k / largest) ** 2 for k in top.rotor or ()]
    rate, size = (log10(max(squares)) or 0.0) / 2, log10(largest) or 0.0
    return Units(*(Fraction(10) ** round(power) if abs(power) > _USUAL else Fraction(1) for power in (-rate, size)))


def motion(
    top: HeavyTop,
    start: State,
    system: System,
    times: Sequence[Fraction],
    xi: tuple[Fraction, ...] | None = None,
) -> Array | None:
    """States of heyoka in double at ``times``, shape (n, 6), or (n, 9) with ξ; None where it does not get there."""
    try:
        numbers = floats(system.entering(system.parameters(top, start)))
        first, ends = floats((*start.flat, *(xi or ()))), floats(times)
    except (HeavyTopError, OverflowError):  # beyond the range of double, or a start that the system does not admit
        return None
    return motion_in_double(system, numbers, first, ends)


def motion_in_double(system: System, numbers: Array, first: Array, times: Array) -> Array | None:
    """:func:`motion` of the numbers that enter the field, of a start and of times in double."""
    if numpy.abs(first[:3]).max() * numpy.abs(times).max(initial=0.0) > _LONGEST:
        return None
    known, wanted = _states_by_time(system, numbers.tobytes(), first.tobytes()), times.tolist()
    for sign in (1.0, -1.0):
        targets = sorted({time for time in wanted if sign * time > 0 and time not in known}, key=abs)
        if not targets:
            continue
        attitude = len(first) > 6
        # a third of the seconds to compile, for some hundred motions that take twice as long
        compact = attitude or system not in SYSTEMS
        with compiled(system, DOUBLE, attitude=attitude, compact_mode=compact).borrowed() as engine:
            states, outcome, *_ = states_at(engine, numbers, first, targets, _STEPS, DOUBLE)
        if outcome is not Outcome.SUCCESS:
            return None
        known.update(zip(targets, states, strict=True))
    return numpy.array([known[time] if time else first for time in wanted])


@lru_cache(maxsize=512)
def _states_by_time(system: System, numbers: bytes, first: bytes) -> dict[float, Array]:
    """Computed states of a motion by time: hypotheses are tried on the first samples, and again on all."""
    return {}


def principal(tensor: Array) -> tuple[Array, Array]:
    """Moments, and principal axes as the columns of a rotation: the axes given where the tensor is diagonal."""
    if not (tensor - numpy.diag(numpy.diag(tensor))).any():
        return numpy.diag(tensor), numpy.eye(3)
    moments, axes = numpy.linalg.eigh((tensor + tensor.T) / 2)
    if numpy.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return moments, axes


def floats(values: Sequence[Fraction]) -> Array:
    """Exact numbers in double."""
    return numpy.array([float(value) for value in values])


def plain_number(value: float, near: float) -> Fraction:
    """0, a short decimal, a small fraction or the shortest decimal within ``near``, or the value itself."""
    if abs(value) <= near:
        return Fraction(0)
    short, longer = ([Fraction(decimal_text(Fraction(value), digits)) for digits in some] for some in _DIGITS)
    for candidate in (*short, Fraction(value).limit_denominator(SMALL), *longer):
        if abs(float(candidate) - value) <= near:
            return candidate
    return Fraction(value)


def notable(new: Fraction, old: Fraction) -> bool:
    """Whether a number is off by much, or is a short decimal or a small fraction: neither is the bias of a method."""
    off = abs(new - old) > Fraction(_NOTABLE) * max(abs(new), abs(old))
    return off or new.denominator <= SMALL or new == Fraction(decimal_text(new, SHORT))


def in_units(value: float | Fraction, unit: Fraction) -> str:
    """A number of the data's own units, to six digits."""
    return plain_decimal(Fraction(value) * unit, 6)
