"""Enclosure of any motion of either system, by Taylor series with a proven tail: no closed form is needed.

A motion of very fast or slow rates is enclosed in its own unit of time, a power of two: with Ω = s ω, τ = s t and
P r = s² n the equations of ω, γ, n are the same (:func:`unit_of_time`).

The step and its theorem are in :mod:`heavytop.exact.enclosure`.  Here the working precision is chosen so that the asked
bits come out: the bits that the motion loses are measured on a short pilot run, and carried on linearly to the time
asked for.  Precisions come from a ladder and steps depend on the node that they start from alone, so a ball does not
depend on what was asked before; what was computed before is only found faster.

Reach on the generic top of the tests (I = (3, 2, 1), P r = (1/2, 1/3, 1/5)), seconds of one core:
60 digits at t = 8 in 0.1 s; 30 digits at t = 100 in 1.5 s, t = 300 in 6 s, t = 1000 in 31 s; about 0.17 bits are lost
a unit of time, so that t = 10,000 would need some 1,900 bits and is refused by default.

"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, log2, log10
from typing import NamedTuple

from flint import arb, arb_series

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, relative_bits, working_precision
from heavytop.exact.enclosure import Node, Step, coefficient_bound, start_node, step
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.quadratic import Matrix, Quadratic, quadratic
from heavytop.exact.scales import exponent, require_handy, unit_of_time
from heavytop.precision import decimal_text
from heavytop.top.angles import perpendicular
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State, Vector

_PILOT_BITS = 128
_PILOT_STEPS = 1000
_KEPT_NODES = 512
_LARGEST_RATE = 2**100
_ATTEMPTS = 6
_FAR = Fraction(10**12)
_HOPELESS = 100


@dataclass(slots=True)
class Run:
    """Nodes of one motion at one working precision, from time 0 on as far as they were asked for.

    Any thread may ask: a node depends on its time alone, and what is remembered is replaced, never changed in place.
    """

    motion: Quadratic
    precision: int
    nodes: tuple[Node, ...]
    stride: int = 1
    lost_at: Fraction | None = None
    _last: Step | None = None
    _skipped: int = 0

    def at(self, time: Fraction) -> tuple[Step, Fraction] | None:
        """The step that covers ``time`` ≥ 0, and τ in it; None if the errors grew too large before it."""
        found, node = self._nearest(time)
        while True:
            if self.lost_at is not None and node.time >= self.lost_at:
                return None
            if found is None:
                found = self._last = step(self.motion, node, self.precision)
            if found is None:
                self.lost_at = node.time
                return None
            if node.time + found.length >= time:
                return found, (time - node.time) / found.length
            node, found = found.end(), None
            self._keep(node)

    def _nearest(self, time: Fraction) -> tuple[Step | None, Node]:
        """The last node known before ``time``, and the step from it where that is known too."""
        last, nodes = self._last, self.nodes
        node = nodes[bisect_right(nodes, time, key=lambda node: node.time) - 1]
        if last is not None and node.time <= last.node.time <= time:
            return last, last.node
        return None, node

    def _keep(self, node: Node) -> None:
        """Remember every ``stride``-th node: constant memory at any horizon."""
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


def _ladder(bits: float) -> int:
    """The working precision at or above ``bits``: multiples of an eighth of the power of two below."""
    whole = max(64, ceil(bits))
    unit = 1 << max(4, whole.bit_length() - 4)
    return -(-whole // unit) * unit


def _seconds_a_step(precision: int) -> float:
    """A model of the cost, not a measurement: what is refused must not depend on how busy the machine is."""
    return 1e-3 + 6e-8 * precision**2


class _Ahead(NamedTuple):
    """How far a pilot came: the node at its end, and the time and the bits lost after each of its steps."""

    node: Node
    times: tuple[Fraction, ...] = ()
    losses: tuple[float, ...] = ()


@dataclass(slots=True)
class Pilot:
    """A cheap run that tells how many bits the motion loses and how many steps it takes, by time.

    Any thread may ask: ``ahead`` is replaced as a whole, and does not depend on who came how far.
    """

    motion: Quadratic
    ahead: _Ahead

    def forecast(self, span: Fraction, effort: float) -> tuple[float, float]:
        """(bits lost, steps taken) up to ``span``, carried on linearly where the pilot does not go.

        The pilot is given up early where a hundred times ``effort`` seconds of the model of the cost would not do.
        """
        node, known, bits = self.ahead
        times, losses = list(known), list(bits)
        while (not times or times[-1] < span) and len(times) < _PILOT_STEPS:
            forecast = len(times) * _times_as_far(span, times[-1]) * _seconds_a_step(_PILOT_BITS) if times else 0.0
            if len(times) >= _HOPELESS and forecast > _HOPELESS * effort:
                break
            found = step(self.motion, node, _PILOT_BITS)
            if found is None:
                break
            node = found.end()
            times.append(node.time)
            losses.append(node.errors.exponent + log2(float(node.errors.sizes().max()) + 1))
        if len(times) > len(known):
            self.ahead = _Ahead(node, tuple(times), tuple(losses))
        if not times:
            return float(_PILOT_BITS), 64 * float(min(span, _FAR))
        index = min(bisect_left(times, span), len(times) - 1)
        more = _times_as_far(span, times[index])
        return 16 + losses[index] * more, (index + 1) * more


def _times_as_far(span: Fraction, reached: Fraction) -> float:
    """span/reached, at least 1 and at most 10^12."""
    return max(1.0, float(min(span / reached, _FAR)))


@dataclass(frozen=True, slots=True)
class Validated:
    """The motion from ``start``, enclosed.

    top, start, system: any.  rotor: λ of the gyrostat where the start is rounded and (2.1) no longer holds exactly;
    None for P b/(M·γ).  xi: the attitude vector at time 0; None for :func:`heavytop.top.angles.perpendicular`.
    effort: what a request may cost, in seconds of the cost model; beyond it the request is refused.
    unit: the unit of time of the enclosure is 2^-unit (:func:`heavytop.exact.scales.unit_of_time`).
    Raises InputError where the system does not admit the top and start, OutOfReach where they are too large.
    """

    top: HeavyTop
    start: State
    system: System = HEAVY_TOP
    rotor: Fraction | None = None
    xi: Vector | None = None
    effort: float = 900.0
    method: str = "validated: Taylor enclosure"
    unit: int = field(default=0, init=False, repr=False, compare=False)
    _runs: dict[tuple[int, int, int], Run] = field(default_factory=dict, init=False, repr=False, compare=False)
    _pilots: dict[tuple[int, int], Pilot] = field(default_factory=dict, init=False, repr=False, compare=False)
    _fields: dict[tuple[int, int], Quadratic] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_handy(self.top, self.start)
        object.__setattr__(self, "unit", unit_of_time(self.parameters, self.start.flat))
        rate = coefficient_bound(self._field(1, 6), max(map(abs, self._scaled(self.start.flat))))
        if rate > _LARGEST_RATE:
            raise OutOfReach(
                f"The motion may change 2^{exponent(rate)} times as fast as it turns.",
                "Validated integration needs moments, weight and rates of less different size.",
            )

    @property
    def parameters(self) -> Parameters:
        """I, P r and λ, exactly."""
        if self.rotor is not None and self.system is GYROSTAT:
            return Parameters(self.top.inertia, self.top.moment, self.rotor)
        return self.system.parameters(self.top, self.start)

    def _scaled(self, start: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
        """Ω and whatever follows it, with Ω in the motion's own unit of time."""
        factor = Fraction(2) ** -self.unit
        return (*(factor * w for w in start[:3]), *start[3:])

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """See :class:`heavytop.exact.solution.ExactSolution`; ``time`` of either sign.

        Raises OutOfReach, with the digits that could be reached, where the model of the cost exceeds ``effort``.
        """
        return self._enclosure(time, bits, self.start.flat)

    def reached(self) -> Fraction:
        """The |t| up to which the latest enclosure has come, for those who wait; any thread may ask."""
        latest = next(reversed(list(self._runs.values())), None)
        return Fraction(0) if latest is None else latest.nodes[-1].time / Fraction(2) ** self.unit

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ: three balls.  Raises InputError where |γ| is not 1 exactly and no ``xi`` was given."""
        xi = self.xi
        if xi is None:
            self.start.require_unit_gamma()
            xi = perpendicular(self.start.gamma)
        return self._enclosure(time, bits, (*self.start.flat, *xi))[6:]

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        """See :class:`heavytop.exact.solution.ExactSolution`: the recurrence of Taylor's series on the enclosure."""
        return self._extended(self.state(time, bits + 4 * length), length, bits)

    @whole_evaluation
    def _extended(self, values: list[arb], length: int, bits: int) -> list[arb_series]:
        motion = self._field(1, 6)
        with working_precision(bits + 4 * length + 32 + abs(self.unit), length):
            unit = arb(2) ** self.unit
            y = [[value / unit] for value in values[:3]] + [[value] for value in values[3:]]
            for n in range(length - 1):
                sums = [sum((y[j][m] * y[k][n - m] for m in range(n + 1)), arb(0)) for j, k in motion.pairs]
                last = [component[n] for component in y]
                for component, row in zip(y, motion.rows, strict=True):
                    total = sum((c * sums[pair] for c, pair in row.products), arb(0))
                    total += sum((c * last[j] for c, j in row.linear), arb(0))
                    component.append(total / (row.denominator * (n + 1)))
            # in the unit of time given, ε^n counts unit^n, and Ω once more
            return [
                arb_series([c * unit ** (n + (axis < 3)) for n, c in enumerate(component)], prec=length)
                for axis, component in enumerate(y)
            ]

    def _field(self, direction: int, dimension: int) -> Quadratic:
        """The field of y, or of y and ξ; backwards in time with its sign changed."""
        if (direction, dimension) not in self._fields:
            given, factor = self.parameters, Fraction(2) ** -self.unit
            p = Parameters(given.inertia, [factor * factor * n for n in given.moment], factor * Fraction(given.rotor))

            def rates(y: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
                found = self.system.field(p, y[:6])
                if dimension > 6:
                    found = (*found, *self.system.attitude(p, y[:6], y[6:]))
                return tuple(direction * rate for rate in found)

            self._fields[direction, dimension] = quadratic(rates, dimension)
        return self._fields[direction, dimension]

    def _run(self, direction: int, precision: int, start: tuple[Fraction, ...]) -> Run:
        key = (direction, precision, len(start))
        if key not in self._runs:
            motion = self._field(direction, len(start))
            self._runs[key] = Run(motion, precision, (start_node(motion, start, precision),))
        return self._runs[key]

    def _enclosure(self, time: Fraction, bits: int, start: tuple[Fraction, ...]) -> list[arb]:
        if time == 0:
            return _rounded(start, bits + 8)
        unit = Fraction(2) ** self.unit
        direction, span, scaled = (1 if time > 0 else -1), abs(time) * unit, self._scaled(start)
        loss, steps = self._forecast(direction, span, scaled)
        for _ in range(_ATTEMPTS):
            precision = _ladder(bits + loss + 8)
            self._require_reach(time, bits, loss, steps, precision)
            run = self._run(direction, precision, scaled)
            found = run.at(span)
            if found is not None:
                values = _evaluated(*found, found[0].radii(found[1]), precision + 64, unit)
                reached = min(map(relative_bits, values))
                if reached >= bits:
                    return values
                loss = precision - reached + 16
            else:
                loss = 1.25 * precision * float(min(span / run.lost_at, _FAR)) if run.lost_at else 2.0 * precision
        raise self._refusal(time, 0)

    def _forecast(self, direction: int, span: Fraction, start: tuple[Fraction, ...]) -> tuple[float, float]:
        """(bits that will be lost, steps that will be taken) up to ``span``."""
        key = (direction, len(start))
        if key not in self._pilots:
            motion = self._field(*key)
            self._pilots[key] = Pilot(motion, _Ahead(start_node(motion, start, _PILOT_BITS)))
        return self._pilots[key].forecast(span, self.effort)

    def _require_reach(self, time: Fraction, bits: int, loss: float, steps: float, precision: int) -> None:
        if steps * _seconds_a_step(precision) <= self.effort:
            return
        affordable = precision
        while affordable > 0 and steps * _seconds_a_step(affordable) > self.effort:
            affordable = affordable * 15 // 16
        raise self._refusal(time, max(0, affordable - loss))

    def _refusal(self, time: Fraction, reachable: float) -> OutOfReach:
        at, digits = decimal_text(time, 6), int(reachable * log10(2))
        if digits < 1:
            return OutOfReach(
                f"No digit at t = {at} is within reach of a validated integration.", "Ask for an earlier time."
            )
        return OutOfReach(
            f"So many digits at t = {at} are out of reach of a validated integration.",
            f"About {digits} digits could be proven there: ask for fewer, or for an earlier time.",
        )


@whole_evaluation
def _rounded(start: tuple[Fraction, ...], bits: int) -> list[arb]:
    with working_precision(bits):
        return [ball(value) for value in start]


@whole_evaluation
def _evaluated(found: Step, tau: Fraction, radii: Matrix, bits: int, unit: Fraction) -> list[arb]:
    """The state at ``tau`` with Ω in the unit of time given."""
    # numpy would let other threads in amid the balls: the radii are there already
    with working_precision(bits):
        values = found.around(tau, radii)
        return [value * ball(unit) for value in values[:3]] + values[3:]
