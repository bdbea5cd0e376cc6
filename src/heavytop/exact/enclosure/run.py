"""Enclosure of any motion of either system, by Taylor series with a proven tail: no closed form is needed.

A motion is enclosed in scaled units, powers of two, in which |ω| ≤ 4 at all times
(:class:`heavytop.multiword.problem.Scaled`).

The step and its theorem are in :mod:`heavytop.exact.enclosure.step`.  Its coefficients are computed in words
(:mod:`heavytop.multiword.fixed_point.certified_series`) up to the largest grid, or in exact integers where few steps
would not pay for the machine code.  This file chooses the working precision that leaves the requested bits: a pilot run
measures the bits that the motion loses, and they are extrapolated linearly to the requested time; where the bits of the
pilot suffice, it is the requested run.  The precision falls as bits are lost (:class:`EnclosureRun`).
Precisions come from a schedule, and steps and falls depend on their node alone, so a ball does not depend on earlier
requests, which only make it faster.

Reach on the generic top of the tests (I = (3, 2, 1), P r = (1/2, 1/3, 1/5)), seconds of one core that was shared:
60 digits at t = 8 in 0.02 s; 30 digits at t = 100 in 0.1 s, at t = 1000 in 1.5 s; about 0.17 bits are lost a unit of
time, so that t = 10,000 takes 1,935 bits at the beginning, the most that words have, and a quarter of an hour.
"""

from __future__ import annotations

import dataclasses
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import ceil, inf, log10
from threading import Lock
from typing import ClassVar, NamedTuple

from flint import arb, arb_series
from gmpy2 import mpq

from heavytop.errors import Contradiction, OutOfReach, argument
from heavytop.exact.closed_form import solved
from heavytop.exact.enclosure.step import (
    Matrix,
    Node,
    Quadratic,
    Step,
    coefficient_bound,
    lacking,
    quadratic,
    start_node,
    step,
)
from heavytop.exact.flint.balls import (
    ball,
    exponent,
    relative_bits,
    require_handy,
    unit_of_time,
    whole_evaluation,
    working_precision,
)
from heavytop.exact.resolved import Uncertainty
from heavytop.extras import has_extra
from heavytop.multiword.codegen.recurrence import rates
from heavytop.multiword.fixed_point import fixed_point_run
from heavytop.multiword.fixed_point.arithmetic import Grid, grid_of
from heavytop.multiword.fixed_point.certified_series import CertifiedSeries
from heavytop.multiword.problem import Scaled
from heavytop.precision import Vector, six_digits
from heavytop.top.attitude import perpendicular
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State

# The sequence of steps of an enclosure, and the pilot that measures how many bits a motion loses.


FAR = Fraction(10**12)
"""A forecast extrapolates at most so many times beyond the pilot."""
_PILOT_STEPS = 1000
_KEPT_NODES = 512
_TRIED, _SETTLED = 25, 100
_one_writer = Lock()


class Fall(NamedTuple):
    """The working precision from the node at ``time`` on."""

    time: Fraction
    precision: int
    certified: CertifiedSeries | None


@dataclass(slots=True)
class EnclosureRun:
    """Nodes of one motion from time 0 up to the latest request, at ``precision`` bits or, later, at fewer.

    The bits of an enclosure more than :data:`_GUARD` below its radius carry no information: they are rounded away where
    that makes the steps cheaper.  The set of errors is widened by the rounding, so that the guard affects the radius
    but no proof.  Errors that are large now need not be those that grow later: on the generic top of the tests, in 528
    bits to t = 2000, 157 bits are left with 48 guard bits or without a fall, 146 with 32.

    Safe in threads: a node depends on its time alone, and cached tuples are replaced, never changed in place.
    """

    motion: ScaledMotion
    precision: int
    nodes: tuple[Node, ...]
    certified: CertifiedSeries | None = None
    falls: tuple[Fall, ...] = ()
    stride: int = 1
    lost_at: Fraction | None = None
    last: Step | None = None
    _skipped: int = 0

    def at(self, time: Fraction) -> tuple[Step, Fraction] | None:
        """The step that covers ``time`` ≥ 0, and τ in it; None if the errors grew too large before it."""
        taken, node = self._nearest(time)
        while True:
            if self.lost_at is not None and node.time >= self.lost_at:
                return None
            if taken is None:
                taken = self.last = self.step(node)
            if taken is None:
                self.lost_at = node.time
                return None
            if node.time + taken.length >= time:
                return taken, (time - node.time) / taken.length
            node, taken = self.after(taken), None

    def step(self, node: Node) -> Step | None:
        """The step from one of its nodes; None where the errors are too large."""
        return step(self.motion.field, node, *self._arithmetic(node.time))

    def lost(self, node: Node) -> float:
        """Bits lost at a node, of those at the beginning."""
        return self.precision - self._arithmetic(node.time)[0] + node.errors.bits

    def _arithmetic(self, time: Fraction) -> tuple[int, CertifiedSeries | None]:
        passed = bisect_right(self.falls, time, key=lambda fall: fall.time)
        return self.falls[passed - 1][1:] if passed else (self.precision, self.certified)

    def after(self, taken: Step, transfer: tuple[Matrix, Matrix, float] | None = None) -> Node:
        """The node at the end of a step, in fewer bits where the last ones carry no information; it is stored."""
        precision = self.motion.fewer(taken.precision, taken.node.errors.bits)
        node = taken.end(transfer, taken.precision - precision)
        if precision < taken.precision and (not self.falls or self.falls[-1].time < node.time):
            self.falls = (*self.falls, Fall(node.time, precision, self.motion.certified(precision)))
        self.keep(node)
        return node

    def _nearest(self, time: Fraction) -> tuple[Step | None, Node]:
        """The last stored node before ``time``, and the step from it where that is stored too."""
        last, nodes = self.last, self.nodes
        node = nodes[bisect_right(nodes, time, key=lambda node: node.time) - 1]
        if last is not None and node.time <= last.node.time <= time:
            return last, last.node
        return None, node

    def keep(self, node: Node) -> None:
        """Store every ``stride``-th node, in constant memory at any horizon."""
        nodes = self.nodes
        if node.time <= nodes[-1].time:
            return
        self._skipped += 1
        if self._skipped >= self.stride:
            self._skipped = 0
            nodes = (*nodes, node)
        if len(nodes) > _KEPT_NODES:
            nodes = nodes[::2]
            self.stride *= 2
        self.nodes = nodes


class Ahead(NamedTuple):
    """The last node of a pilot, and the time and the bits lost after each of its steps."""

    node: Node
    times: tuple[Fraction, ...] = ()
    losses: tuple[float, ...] = ()


@dataclass(slots=True)
class Pilot:
    """A run in few bits that measures how many bits the motion loses and how many steps it takes.

    Where those bits suffice, its nodes are those of the enclosure.  Safe in threads: ``ahead`` is replaced as a whole
    by a longer one, whose values do not depend on the thread.
    """

    run: EnclosureRun
    ahead: Ahead

    def forecast(self, span: Fraction, hopeless: Callable[[float, float], bool]) -> tuple[float, float]:
        """(bits lost, steps taken) up to ``span``, extrapolated linearly beyond the pilot.

        hopeless: whether the pilot shall stop at so many bits lost so far and so many steps in all.  It is called after
        every 25 steps; up to 100 it is called with a share of the steps, a quarter after 25, as the first may be short.
        """
        times, losses = self._ahead(span, hopeless)
        if not times:
            return float(self.run.precision), 64 * float(min(span, FAR))
        index = min(bisect_left(times, span), len(times) - 1)
        return 16 + _carried_on(times, losses, index, span), (index + 1) * _times_as_far(span, times[index])

    def _ahead(
        self, span: Fraction, hopeless: Callable[[float, float], bool]
    ) -> tuple[Sequence[Fraction], Sequence[float]]:
        """The times and the bits lost up to ``span``, or up to the end of the pilot."""
        node, known_times, bits = self.ahead
        if known_times and known_times[-1] >= span:
            return known_times, bits
        times, losses, run = list(known_times), list(bits), self.run
        while (not times or times[-1] < span) and len(times) < _PILOT_STEPS:
            count = len(times)
            part = min(1.0, count / _SETTLED)
            if count and count % _TRIED == 0 and hopeless(losses[-1], part * count * _times_as_far(span, times[-1])):
                break
            proven = run.last = run.step(node)  # it may cover the requested time
            if proven is None:
                break
            node = run.after(proven)
            times.append(node.time)
            losses.append(run.lost(node))
        with _one_writer:
            if len(times) > len(self.ahead.times):
                self.ahead = Ahead(node, tuple(times), tuple(losses))
        return times, losses

    def reaches(self, span: Fraction, bits: int) -> bool:
        """Whether the pilot has reached ``span`` with ``bits`` bits left."""
        _, times, losses = self.ahead
        index = bisect_left(times, span)
        return index < len(times) and self.run.precision - losses[index] >= bits


def _carried_on(times: Sequence[Fraction], losses: Sequence[float], index: int, span: Fraction) -> float:
    """The bits lost at ``span``: those at step ``index``, extrapolated by the later half of the steps before it."""
    later = min(span, FAR * times[index]) - times[index]
    if later <= 0:
        return losses[index]
    middle = index // 2
    slope = (losses[index] - losses[middle]) / float(times[index] - times[middle]) if index else 1.0
    return losses[index] + max(0.0, slope) * float(later)


def _times_as_far(span: Fraction, reached: Fraction) -> float:
    """span/reached, at least 1 and at most 10^12."""
    return max(1.0, float(min(span / reached, FAR)))


# A motion in scaled units, and the arithmetic of its Taylor coefficients.


_GRIDS = tuple(grid_of(words, whole=True) for words in (3, 4, 6, 7, 8, 10, 12, 16, 24, 28, 32, 36, 40, 45))
"""A selection of grids, as each is compiled at its first use."""
_STEPS_A_WORD = 2
"""Fewer steps do not pay for the machine code."""
_GUARD = 64
"""Bits kept below the errors; binary64, which holds their frames, blurs them by 2^-46 or so."""
_FEWEST = 352
"""Bits below which fewer save less than the machine code of another grid costs."""
_PLACES = 8
"""Times at which the model of the cost evaluates the working precision."""
_LARGEST_EXCESS = 8
_seen_right: set[tuple[Grid, str, int]] = set()


@dataclass(slots=True)
class ScaledMotion:
    """A motion from exact data in one direction of time.

    field: of the scaled state, with its sign changed backwards in time.  in_words: whether the lanes of
    :mod:`heavytop.multiword.codegen.recurrence` compute this field, which is proven over the rationals, with
    coefficients of moderate size; a constant state is cheaper in integers.
    """

    scaled: Scaled
    field: Quadratic
    forwards: bool
    in_words: bool
    _certified: dict[int, CertifiedSeries] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, system: System, p: Parameters, y: tuple[Fraction, ...], forwards: bool) -> ScaledMotion:
        """The motion of (Ω, γ), or of (Ω, γ, ξ), from ``y``."""
        scaled, size = Scaled.of(system, p, y, bounded=True), len(y)
        scaled_parameters = own_parameters(scaled, p).mapped(mpq)
        sign = 1 if forwards else -1
        lanes = dataclasses.replace(  # quicker than Fractions, and as exact
            scaled.coefficients,
            vectors=tuple(tuple(tuple(map(mpq, row)) for row in rows) for rows in scaled.coefficients.vectors),
        )

        def as_lane(state: tuple[mpq, ...]) -> list[mpq]:
            values = [*system.field(scaled_parameters, state[:6])]
            if len(state) == 9:
                values += system.attitude(scaled_parameters, state[:6], state[6:])
            return [sign * rate for rate in values]

        def by_lanes(state: tuple[mpq, ...]) -> list[mpq]:
            return [sign * rate for rate in rates(system, lanes, state)]

        motion = quadratic(as_lane, size)
        in_words = has_extra("multiword") and not scaled.rest and fixed_point_run.excess(scaled) <= _LARGEST_EXCESS
        if in_words:
            planned = quadratic(by_lanes, size)
            in_words = (planned.pairs, planned.rows) == (motion.pairs, motion.rows)
        return cls(scaled, motion, forwards, in_words)

    def precision(self, bits: float, steps: float) -> tuple[int, bool]:
        """The working precision at or above ``bits`` for so many steps, and whether it is computed in words."""
        if self.in_words:
            for grid in _GRIDS:
                if grid.total >= bits:
                    if steps < _STEPS_A_WORD * grid.words:
                        break
                    return grid.total, True
        # multiples of an eighth of the power of two below
        needed = max(64, ceil(bits))
        unit = 1 << max(4, needed.bit_length() - 4)
        return -(-needed // unit) * unit, False

    def fewer(self, precision: int, lost: float) -> int:
        """The working precision that suffices where the last ``lost`` bits of ``precision`` are within the errors."""
        needed = precision - lost + _GUARD
        return precision if needed > precision else min(precision, self.precision(max(needed, _FEWEST), inf)[0])

    def grid(self, precision: int) -> Grid | None:
        """The grid of exactly ``precision`` bits, or None."""
        return next((grid for grid in _GRIDS if self.in_words and grid.total == precision), None)

    def seconds(self, planned: tuple[int, bool], lost: float, steps: float) -> float:
        """Seconds by the model of the cost, where ``lost`` bits are lost evenly over the steps."""
        begun, in_words = planned
        precisions = [self.fewer(begun, lost * i / _PLACES) for i in range(_PLACES)]
        words = [in_words if p == begun else self.grid(p) is not None for p in precisions]
        return steps / _PLACES * sum(map(seconds_a_step, precisions, words))

    def seconds_for(self, bits: float, lost: float, steps: float) -> float:
        """Seconds by the model of the cost, where ``bits`` bits are left."""
        return self.seconds(self.precision(bits + lost, steps), lost, steps)

    def certified(self, precision: int) -> CertifiedSeries | None:
        """The Taylor coefficients on the grid of exactly ``precision`` bits, or None."""
        grid = self.grid(precision)
        if grid is not None and precision not in self._certified:
            certified = CertifiedSeries(self.scaled, grid, self.forwards)
            self._require_right(certified)
            self._certified[precision] = certified
        return self._certified.get(precision)

    def _require_right(self, certified: CertifiedSeries) -> None:
        """Compare the first step of machine code in this process with exact integers."""
        grid, size = certified.grid, len(self.scaled.state)
        key = (grid, self.scaled.system.name, size)
        if key in _seen_right:
            return
        centre = [round(value * 2**grid.total) for value in self.scaled.state]
        for halvings in range(2, 64):
            series = certified.series(centre, halvings)
            if series is not None:
                if sum(lacking(self.field, series, grid.total, halvings)) > Fraction(series.rounding):
                    raise Contradiction(
                        f"Machine code in {grid.total} bits gives Taylor coefficients whose error exceeds its bound.",
                        "It is damaged: run again. If the error persists, this machine or LLVM is faulty.",
                    )
                _seen_right.add(key)
                return


def own_parameters(scaled: Scaled, p: Parameters) -> Parameters:
    """``p`` in the units of a scaled motion."""
    unit, gamma = scaled.rate, scaled.sizes[3]
    return p.mapped(lambda value: Fraction(value) / unit)._replace(
        inertia=p.inertia, moment=tuple(gamma * n / unit**2 for n in p.moment)
    )


_PILOT_BITS = 128
_PILOT_ROOM = 72
"""Bits that the generic top of the tests loses to t = 100: up to there the pilot is the enclosure."""
_MOST_PILOT_BITS = 352
_HOPELESS, _SURELY = 8, 1.2
"""Factors of the effort, and of the largest cost, beyond which a pilot is abandoned after a hundred steps; after 25
steps they are four times as large."""
_LARGEST_RATE = 2**100
_ATTEMPTS = 6
EFFORT = 900.0
"""Seconds of the cost model that a request for an enclosure may take."""
MOST_EFFORT = 1e7
"""The largest effort that a caller may give."""


def seconds_a_step(precision: int, in_words: bool) -> float:
    """The model of the cost of a step: a refusal must not depend on the load of the machine."""
    return 4e-4 + 1.2e-11 * precision**3 if in_words else 1e-3 + 6e-8 * precision**2


_METHOD = "validated: Taylor enclosure"


@dataclass(frozen=True, slots=True)
class Validated:
    """The motion from ``start``, enclosed.

    top, start, system: any.  rotor: λ of the gyrostat where the start is rounded and (2.1) no longer holds exactly;
    None for P b/(M·γ).  xi: the attitude vector at time 0; None for :func:`heavytop.top.attitude.perpendicular`.
    uncertainty: bounds of the error of the data, which the enclosure includes.  None for exact data.
    effort: the largest cost of a request, in seconds of the cost model; beyond it the request is refused.
    level: a class that has the motion but not its level, with the level and the distance from it; "" for none.
    unit: the motion changes at about the rate 2^unit (:func:`heavytop.exact.flint.balls.unit_of_time`).
    Raises InputError where the system does not admit the top and start, OutOfReach where they are too large.
    """

    top: HeavyTop
    start: State
    system: System = HEAVY_TOP
    rotor: Fraction | None = None
    xi: Vector | None = None
    effort: float = EFFORT
    method: str = _METHOD
    source: ClassVar[str] = "theorem of a step: exact/enclosure/step.py of the program"
    uncertainty: Uncertainty | None = None
    level: str = ""
    unit: int = field(default=0, init=False, repr=False, compare=False)
    _runs: dict[tuple[int, int, bool, int], EnclosureRun] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _pilots: dict[tuple[int, int, bool, int], Pilot] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    _motions: dict[tuple[int, int], ScaledMotion] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_handy(self.top, self.start)
        if self.level:
            object.__setattr__(self, "method", f"{_METHOD}, as no closed form covers the level ({self.level})")
        object.__setattr__(self, "unit", unit_of_time(self.parameters, self.start.flat))
        motion = self.motion(1)
        rate = coefficient_bound(motion.field, max(map(abs, motion.scaled.state)))
        if rate > _LARGEST_RATE:
            raise OutOfReach(
                f"The rate of change of the motion may be 2^{exponent(rate)} times its angular velocity.",
                "Validated integration needs moments, weight and rates of more similar size.",
            )

    @property
    def parameters(self) -> Parameters:
        """I, P r and the rotor, exactly."""
        if self.rotor is not None and self.system is GYROSTAT:
            return Parameters(self.top.inertia, self.top.moment, self.rotor)
        return self.system.parameters(self.top, self.start)

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """See :class:`heavytop.exact.solution.ExactSolution`; ``time`` of either sign.

        Raises OutOfReach, with the digits that could be reached, where the model of the cost exceeds ``effort``.
        """
        return self._enclosure(time, bits, self.start.flat)

    def cost(
        self,
        time: Fraction,
        bits: int,
        most: float | None = None,
        start: tuple[Fraction, ...] | None = None,
        loss: float = 0.0,
    ) -> float:
        """Seconds of the model of the cost that the state at ``time`` takes: steps times bits, by no clock.

        most: a pilot ends early where the cost exceeds this by a fifth; None for eight times the effort.
        start: as for :meth:`motion`.  loss: bits that are lost at least.
        """
        if time == 0:
            return 0.0
        forecast, steps = self.forecast(time, bits, start, most)
        return self.motion(1 if time > 0 else -1, start).seconds_for(bits, max(loss, forecast), steps)

    def reached(self) -> Fraction:
        """The |t| that the latest enclosure has reached, for displays of progress; safe in threads."""
        latest = next(reversed(list(self._runs.values())), None)
        return Fraction(0) if latest is None else latest.nodes[-1].time / Fraction(2) ** self.unit

    def walk(self, time: Fraction, bits: int) -> tuple[ScaledMotion, Iterator[Step]]:
        """The units of the motion, and its proven steps from t = 0 until one covers ``time``, which is not 0.

        At their working precision ``bits`` bits are expected to be left at ``time``; the steps end before it where the
        errors grow too large.  Raises OutOfReach as :meth:`state` does.
        """
        direction = 1 if time > 0 else -1
        motion = self.motion(direction)
        span = abs(time) * motion.scaled.rate
        loss, steps = self.forecast(time, bits)
        planned = motion.precision(bits + loss, steps)
        if motion.seconds(planned, loss, steps) > self.effort:
            raise self._refusal(time, bits, loss, self.start.flat)
        run = self._run(direction, self.start.flat, *planned)
        return motion, _steps_of(run, span)

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ: three balls.  Raises InputError where |γ| is not 1 exactly and no ``xi`` was given."""
        return self.with_attitude(time, bits)[6:]

    def with_attitude(self, time: Fraction, bits: int) -> list[arb]:
        """Ω, γ and ξ of one enclosure: nine balls; raises as :meth:`attitude`."""
        xi = self.xi
        if xi is None:
            self.start.require_unit_gamma()
            xi = perpendicular(self.start.gamma)
        return self._enclosure(time, bits, (*self.start.flat, *xi))

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        """See :class:`heavytop.exact.solution.ExactSolution`: the field's own series from the enclosure."""
        return self._extended(self.state(time, bits + 4 * length), length, bits)

    @whole_evaluation
    def _extended(self, values: list[arb], length: int, bits: int) -> list[arb_series]:
        with working_precision(bits + 4 * length + 32 + abs(self.unit), length):
            parameters = self.parameters.mapped(ball)
            return solved(values, lambda y: self.system.field(parameters, y))

    def motion(self, direction: int, start: tuple[Fraction, ...] | None = None) -> ScaledMotion:
        """The motion in scaled units, forwards or backwards in time.

        start: (Ω, γ, ξ); None for (Ω, γ).
        """
        start = start or self.start.flat
        key = (direction, len(start))
        if key not in self._motions:
            motion = ScaledMotion.of(self.system, self.parameters, start, direction > 0)
            if self.uncertainty is not None:
                motion.field = replace(motion.field, slack=_rounded_up(self.uncertainty.rate / motion.scaled.rate**2))
            self._motions.setdefault(key, motion)
        return self._motions[key]

    def _run(self, direction: int, start: tuple[Fraction, ...], precision: int, in_words: bool) -> EnclosureRun:
        key = (direction, precision, in_words, len(start))
        if key not in self._runs:
            motion = self.motion(direction, start)
            certified = motion.certified(precision) if in_words else None
            errors = () if self.uncertainty is None else self.uncertainty.start[: len(start)]
            scaled = [error / size for error, size in zip(errors, motion.scaled.sizes[: len(errors)], strict=True)]
            node = start_node(motion.field, motion.scaled.state, precision, scaled)
            self._runs.setdefault(key, EnclosureRun(motion, precision, (node,), certified))
        return self._runs[key]

    def _enclosure(self, time: Fraction, bits: int, start: tuple[Fraction, ...]) -> list[arb]:
        if time == 0:
            return _rounded(start, bits + 8, () if self.uncertainty is None else self.uncertainty.start)
        direction = 1 if time > 0 else -1
        motion = self.motion(direction, start)
        span, sizes = abs(time) * motion.scaled.rate, motion.scaled.sizes
        loss, steps = self.forecast(time, bits, start)
        pilot = self._pilot(direction, start, bits)
        run = pilot.run if pilot.reaches(span, bits) else None
        for _ in range(_ATTEMPTS):
            planned = motion.precision(bits + loss, steps)
            if motion.seconds(planned, loss, steps) > self.effort:
                raise self._refusal(time, bits, loss, start)
            run = run or self._run(direction, start, *planned)
            taken = run.at(span)
            if taken is not None:
                values = _evaluated(*taken, taken[0].radii(taken[1]), taken[0].precision + 64, sizes)
                reached = min(map(relative_bits, values))
                if reached >= bits:
                    return values
                loss = run.precision - reached + 16
            else:
                loss = run.precision * (1.25 * float(min(span / run.lost_at, FAR)) if run.lost_at else 2.0)
            run = None
        raise self._refusal(time, 0, inf, start)

    def forecast(
        self, time: Fraction, bits: int, start: tuple[Fraction, ...] | None = None, most: float | None = None
    ) -> tuple[float, float]:
        """Forecast of (bits lost, steps) up to ``time``, where ``bits`` bits are to be left.

        start: as for :meth:`motion`.  most: as for :meth:`cost`.
        """
        direction, start = 1 if time > 0 else -1, start or self.start.flat
        motion, pilot = self.motion(direction, start), self._pilot(direction, start, bits)
        span = abs(time) * motion.scaled.rate
        if most is None:
            a_step = seconds_a_step(pilot.run.precision, pilot.run.certified is not None)
            return pilot.forecast(span, lambda _, steps: steps * a_step > _HOPELESS * self.effort)
        limit = _SURELY * most
        return pilot.forecast(span, lambda lost, steps: motion.seconds_for(bits, lost, steps) > limit)

    def _pilot(self, direction: int, start: tuple[Fraction, ...], bits: int) -> Pilot:
        """The pilot, in the bits of short motions where these are few."""
        motion = self.motion(direction, start)
        precision, in_words = motion.precision(bits + _PILOT_ROOM, inf)
        if not in_words or precision > _MOST_PILOT_BITS:
            precision, in_words = motion.precision(_PILOT_BITS, inf)
        key = (direction, precision, in_words, len(start))
        if key not in self._pilots:
            run = self._run(direction, start, precision, in_words)
            # threads that come at once take the same one
            self._pilots.setdefault(key, Pilot(run, Ahead(run.nodes[0])))
        return self._pilots[key]

    def _refusal(self, time: Fraction, bits: int, loss: float, start: tuple[Fraction, ...]) -> OutOfReach:
        """The refusal of ``bits`` bits, with digits that are within the effort, or an effort that suffices."""
        seconds = _SURELY * max(self.effort, self.cost(time, bits, MOST_EFFORT, start, loss))
        reachable = bits * 15 // 16
        while reachable > 0 and self.cost(time, reachable, start=start, loss=loss) > self.effort:
            reachable = reachable * 15 // 16
        digits = int((reachable - 5) * log10(2))  # rounded up they take up to 5 bits more
        within, more = larger_effort(self.effort, seconds)
        what = "so many digits" if digits > 0 or within else "a digit"
        remedy = f"About {digits} digits could be proven there: request fewer, or" if digits > 0 else "Give"
        cause = f"Validated integration cannot prove {what} at t = {six_digits(time)}{within}. {self.level}"
        return OutOfReach(cause.strip(), f"{remedy} an earlier time{more}.")


def larger_effort(effort: float, seconds: float) -> tuple[str, str]:
    """The ends of cause and remedy of a refusal by the cost: empty where no effort suffices."""
    if not effort <= seconds <= MOST_EFFORT:
        return "", ""
    cost = f" in {effort:.6g} s: they take about {seconds:.2g} s by the model of its cost"
    return cost, f", or a larger {argument('effort')} of reference"


def _steps_of(run: EnclosureRun, span: Fraction) -> Iterator[Step]:
    node = run.nodes[0]
    while node.time < span:
        taken = run.step(node)
        if taken is None:
            return
        yield taken
        node = run.after(taken)


@whole_evaluation
def _rounded(start: tuple[Fraction, ...], bits: int, errors: tuple[Fraction, ...]) -> list[arb]:
    with working_precision(bits):
        if not errors:
            return [ball(value) for value in start]
        wide = [arb(0, ball(value).abs_upper()) for value in errors[: len(start)]]
        return [ball(value) + more for value, more in zip(start, wide, strict=True)]


def _rounded_up(value: Fraction) -> tuple[float, int]:
    """(a, b) with value ≤ a 2^b, a below 4."""
    if value == 0:
        return 0.0, 0
    power = exponent(value)
    return float(value / Fraction(2) ** power) * (1 + 2.0**-50), power


@whole_evaluation
def _evaluated(taken: Step, tau: Fraction, radii: Matrix, bits: int, sizes: tuple[Fraction, ...]) -> list[arb]:
    """The state at ``tau`` in the units of the problem."""
    # numpy could switch threads between balls: the radii are computed before
    with working_precision(bits):
        values = taken.around(tau, radii)
        return [value * ball(size) for value, size in zip(values, sizes, strict=True)]
