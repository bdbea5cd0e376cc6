"""Errors of an integrator on many motions, and the part of them that the motions themselves explain.

The reference is a run in about twice the digits of the format, double-double in lanes for double.  A second run from a
start moved by 2^-17 roundings measures the amplification of the motion, at a hundredth of the cost of
:mod:`heavytop.top.amplification`, which every finding is checked with.  Errors are max(|δΩ|/rate, |δγ|) over the
samples, with the :func:`heavytop.top.amplification.rate` of the motion.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from random import Random as Generator
from typing import Any, Literal, NamedTuple, TypeVar

from heavytop.errors import HeavyTopError, InputError, OutOfReach, PeerFailed
from heavytop.exact.catalogue import matches
from heavytop.harness.sweeps import Random
from heavytop.integrate import registry
from heavytop.integrate.multiword.lanes import propagate_multiword_ensemble
from heavytop.integrate.peers.command import Command, begin_row
from heavytop.integrate.peers.contract import DEFAULT_STEP
from heavytop.integrate.registry import Integrator, is_third_party
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, Precision, Vector, dot, exact, number, real, round_to, rounded
from heavytop.processes import GuardedProcess
from heavytop.records import FAILED, OUT_OF_TIME
from heavytop.top.amplification import amplification, digits_eaten, rate
from heavytop.top.equations import system_of
from heavytop.top.heavy_top import HeavyTop, State

# Runs of an integrator of any kind; a Python third-party one in a process of its own.


_SECONDS = 10.0
"""Time limit of one motion, as of a row of a gate whose integrator keeps running out of time."""
_BEGIN = 60.0


class IntegratedRun(NamedTuple):
    """The outcome of a run and its states, one per time, in native numbers; reason: why it was aborted.

    order: of a method with fixed steps; 0 of others.
    """

    outcome: str
    states: Sequence[Any]
    reason: str = ""
    order: int = 0


def integrated(
    integrator: Integrator, top: HeavyTop, start: State, times: Sequence[Fraction], precision: Precision
) -> IntegratedRun:
    """A run of an integrator of any kind, whose failure is an outcome.

    Raises InputError for a format or system that the integrator does not support.
    """
    try:
        if integrator.ensemble or isinstance(integrator.source, Command):
            run = integrator.propagate(top, start, times, precision, system_of(None, top), again=False)
        else:
            run = _loaded(integrator)(top, start, times, precision, system=system_of(None, top))
    except InputError:
        raise
    except HeavyTopError as error:
        return IntegratedRun(FAILED, (), error.cause)
    short = run.outcome is Outcome.SUCCESS and len(run.states) < len(times)
    order = run.order if _control(integrator) == "step" else 0
    return IntegratedRun((Outcome.INCOMPLETE if short else run.outcome).value, run.states, order=order)


_loaded, _control = lru_cache(maxsize=4)(registry.ready), lru_cache(maxsize=4)(registry.control_name)


class IsolatedIntegrator:
    """An integrator in a process of its own, which is killed when one motion exceeds its time limit.

    The next motion starts another process.  What the integrator started ends with its process.
    """

    def __init__(self, integrator: Integrator) -> None:
        self._integrator = integrator
        self._process: GuardedProcess | None = None

    def run(self, top: HeavyTop, start: State, times: Sequence[Fraction], precision: Precision) -> IntegratedRun:
        """The run of one motion; the end of the process and the time limit are outcomes."""
        try:
            process = self._process or self._begin()
            future = process.submit(integrated, self._integrator, top, start, times, precision)
            if isinstance(future.exception(timeout=_SECONDS), KeyboardInterrupt):  # of the integrator, not of a user
                return IntegratedRun(FAILED, (), f"{self._integrator.name} raised KeyboardInterrupt")
            return future.result()
        except TimeoutError:
            self.end()
            return IntegratedRun(OUT_OF_TIME, (), f"{self._integrator.name} was stopped after {_SECONDS:.3g} s")
        except BrokenProcessPool:
            self.end()
            return IntegratedRun(FAILED, (), f"{self._integrator.name} ended its whole process")

    def _begin(self) -> GuardedProcess:
        self._process = process = GuardedProcess()
        try:
            process.guard(process.submit(_warmed_up, self._integrator).result(timeout=_BEGIN))
        except TimeoutError:
            self.end()
            raise PeerFailed(f"{self._integrator.name} cannot be loaded within {_BEGIN:.3g} s") from None
        return process

    def end(self) -> None:
        """Kill the process and whatever it started."""
        process, self._process = self._process, None
        if process is not None:
            process.end()


def _warmed_up(integrator: Integrator) -> int:
    """The number of this process, after a first run: imports and compilation take no time of a motion."""
    begin_row()
    with suppress(HeavyTopError, KeyboardInterrupt):  # the run of a motion reports what it raises
        integrated(integrator, HeavyTop((3, 2, 1), 1, (0, 0, 1)), State((0, 0, 1), (0, 0, 1)), [Fraction(1)], DOUBLE)
    return os.getpid()


# Candidate motions of a hunt: drawn at random in ways that integrators find hard, or changed from the worst so far.
#
# All data are exact and depend on the seeds of :class:`Dice` alone.


Family = Literal["any", "euler", "lagrange", "kovalevskaya", "heavy_gyrostat"]
FAMILIES: tuple[Family, ...] = ("any", "euler", "lagrange", "kovalevskaya", "heavy_gyrostat")
Motion = tuple[HeavyTop, State]
MOST_TURNS = 20_000
"""Motions with a larger rate T are not tried: one costs as much as thousands of others."""
_MOST_RATIO = 10**6
_LARGEST = 10**30
_BITS = 40
_UNIT_BITS = 60
_PLAIN_EVERY = 2
"""Every second of the first motions is a plain random top: the law of the integrator is measured on them."""
_POLES = [tuple(Fraction(sign * (i == j)) for j in range(3)) for i in range(3) for sign in (1, -1)]
_T = TypeVar("_T")


class Dice:
    """Random draws of one seed, the same on every machine: Python promises this of ``random()`` alone."""

    def __init__(self, seed: str) -> None:
        self._random = Generator(seed).random

    def below(self, count: int) -> int:
        """An integer from 0 to count − 1."""
        return int(count * self._random())

    def pick(self, choices: Sequence[_T]) -> _T:
        """A random element."""
        return choices[self.below(len(choices))]

    def part(self) -> Fraction:
        """A number of (−1, 1), in thousandths."""
        return Fraction(2 * self.below(1000) - 999, 1000)

    def power(self, least: int, most: int) -> Fraction:
        """1 to 9.9 times a power of ten from 10^least to 10^most."""
        return Fraction(10 + self.below(90), 10) * Fraction(10) ** (least + self.below(most - least + 1))


def unit(values: Sequence[Fraction]) -> Vector:
    """A rational point of the unit sphere within 2^-58 of the direction of ``values``, which are not all 0."""
    return State((0, 0, 0), values).normalized(_UNIT_BITS).gamma


def drawn(seed: int, index: int, family: Family, horizon: Fraction) -> Motion:
    """Random motion number ``index``: every second of the first 64 and every eighth beyond is a plain random top."""
    case = Random("random", seed, index + 1, "any" if family == "heavy_gyrostat" else family).cases()[index]
    plain = case.top, case.start
    if family == "heavy_gyrostat":
        plain = _rotored(plain, Dice(f"{seed}/rotor/{index}"))
    if is_plain(index):
        return plain
    dice = Dice(f"{seed}/hunt/{index}")
    return possible(dice.pick(_DRAWS)(plain, dice), family, horizon) or plain


def is_plain(index: int) -> bool:
    """Whether random motion number ``index`` is a plain random top."""
    return index % (_PLAIN_EVERY if index < 64 else 8) == 0


def changed(parent: Motion, donor: Motion, seed: str, family: Family, horizon: Fraction) -> Motion:
    """``parent`` with one to three changes; ``donor`` may give it its body or its start."""
    dice = Dice(seed)
    motion = parent
    for _ in range(1 + dice.below(3)):
        if dice.below(8) == 0:
            motion = (motion[0], donor[1]) if dice.below(2) else (donor[0], motion[1])
        else:
            motion = dice.pick(_CHANGES)(motion, dice)
    if motion[0].rotor is not None and dice.below(3) == 0:
        motion = _rotored(motion, dice)
    return possible(motion, family, horizon) or parent


def possible(motion: Motion, family: Family, horizon: Fraction) -> Motion | None:
    """The motion moved into the family, with numbers of 40 bits.

    None where no body has its moments, where data lie beyond 1e30, or where rate T exceeds :data:`MOST_TURNS`.
    """
    top, start = motion
    inertia, centre = list(top.inertia), list(top.centre)
    if family == "euler":
        centre = [Fraction(0)] * 3
    elif family == "lagrange":
        inertia[1], centre[:2] = inertia[0], [Fraction(0)] * 2
    elif family == "kovalevskaya":
        inertia[:2], centre[2] = [2 * inertia[2]] * 2, Fraction(0)
    rotor = list(map(_shortened, top.rotor or (Fraction(0),) * 3)) if family == "heavy_gyrostat" else None
    inertia, centre, omega = (list(map(_shortened, vector)) for vector in (inertia, centre, start.omega))
    weight = _shortened(top.weight)
    if min(inertia) <= 0 or 2 * max(inertia) > sum(inertia) or max(inertia) > _MOST_RATIO * min(inertia):
        return None
    sizes = [abs(value) for value in (*inertia, weight, *centre, *omega, *(rotor or ())) if value]
    if max(sizes) > _LARGEST or min(sizes) * _LARGEST < 1:
        return None
    rounded = HeavyTop(inertia, weight, centre, rotor), State(omega, start.gamma)
    system = system_of(None, rounded[0])
    turns = rate(system, system.parameters(*rounded), rounded[1].flat) * abs(horizon)
    return rounded if turns <= MOST_TURNS else None


def _shortened(value: Fraction) -> Fraction:
    """The value, or the nearest of 40 bits where it needs more than twice as many."""
    is_long = value.numerator.bit_length() + value.denominator.bit_length() > 2 * _BITS
    return round_to(value, _BITS) if is_long else value


def _simple(motion: Motion, dice: Dice) -> Motion:
    """Small numbers, zeros and equal moments."""
    moments = dice.pick([(1, 1, 1), (2, 2, 1), (2, 1, 1), (3, 2, 1), (1, 1, 2), (4, 4, 1), (4, 3, 2), (3, 4, 2)])
    shift = dice.below(3)
    inertia = moments[shift:] + moments[:shift]
    centre = [Fraction(dice.below(5) - 2, 2) for _ in range(3)]
    omega = [Fraction(dice.below(9) - 4, 2) for _ in range(3)]
    top = with_data(motion[0], inertia, 1 + dice.below(3), centre)
    return top, State(omega, dice.pick([*_POLES, motion[1].gamma]))


def _edge(motion: Motion, dice: Dice) -> Motion:
    """Moments at the edge of the triangle inequality: a rod or a disc, exactly or almost."""
    second = [1 + abs(dice.part()) for _ in range(3)]
    for k in range(1 + dice.below(2)):
        second[(k + dice.below(3)) % 3] *= dice.pick([Fraction(0), dice.power(-5, -2)])
    x, y, z = second
    inertia = (y + z, z + x, x + y)
    return (with_data(motion[0], inertia=inertia) if min(inertia) else motion[0]), motion[1]


def _equal(motion: Motion, dice: Dice) -> Motion:
    """Two moments in a small ratio, exactly or nearly."""
    inertia = list(motion[0].inertia)
    i, j = dice.pick([(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)])
    excess = dice.pick([Fraction(0), dice.power(-9, -3)])
    inertia[i] = inertia[j] * dice.pick([Fraction(1), Fraction(1), Fraction(2), Fraction(3, 2)]) * (1 + excess)
    inertia[3 - i - j] = (inertia[i] + inertia[j]) * (2 + dice.part()) / 3
    return with_data(motion[0], inertia=inertia), motion[1]


def _spun(motion: Motion, dice: Dice) -> Motion:
    """One component of Ω scaled by a power of ten, with the others or alone."""
    top, start = motion
    omega = [Fraction(0)] * 3 if dice.below(3) == 0 else list(start.omega)
    axis = dice.below(3)
    omega[axis] = (start.omega[axis] or Fraction(1)) * dice.power(-4, 2)
    return top, State(omega, start.gamma)


def _slow(motion: Motion, dice: Dice) -> Motion:
    """A small Ω, down to 0."""
    top, start = motion
    factor = dice.pick([Fraction(0), dice.power(-14, -1)])
    return top, State([value * factor for value in start.omega], start.gamma)


def _weighed(motion: Motion, dice: Dice) -> Motion:
    """A tiny or huge weight."""
    return with_data(motion[0], weight=motion[0].weight * dice.power(-12, 4)), motion[1]


def _scaled(motion: Motion, dice: Dice) -> Motion:
    """Other units of mass and of the centre of mass, for one motion."""
    top, start = motion
    mass, length = dice.power(-12, 11), dice.power(-6, 5)
    inertia, centre = [mass * value for value in top.inertia], [length * value for value in top.centre]
    return with_data(top, inertia, top.weight * mass / length, centre, rotor_times=mass), start


def _poled(motion: Motion, dice: Dice) -> Motion:
    """γ along an axis of the body, or near it."""
    top, start = motion
    distance, pole = dice.pick([Fraction(0), dice.power(-12, -1)]), dice.pick(_POLES)
    return top, State(start.omega, unit([a + distance * dice.part() for a in pole]))


def _balanced(motion: Motion, dice: Dice) -> Motion:
    """A start near an equilibrium, some of which are saddles with separatrices.

    Ω = w γ is a permanent rotation, or rest for w = 0, where P r = w² I γ + c γ.
    """
    top, start = motion
    gamma = dice.pick([dice.pick(_POLES), start.gamma])
    speed = dice.pick([Fraction(0), Fraction(0), Fraction(1), dice.power(-2, 1)])
    along = dice.pick([Fraction(1), Fraction(-1), Fraction(0), dice.part()])
    distance = dice.pick([Fraction(0), dice.power(-14, -2)])
    centre = [(speed**2 * i * g + along * g) / (top.weight or 1) for i, g in zip(top.inertia, gamma, strict=True)]
    return with_data(top, centre=centre), State([speed * g + distance * dice.part() for g in gamma], gamma)


def _pendulum(motion: Motion, dice: Dice) -> Motion:
    """A plane pendulum near its separatrix: from below, Ω² = 4 P|r|/I."""
    i, j, k = dice.pick([(0, 1, 2), (1, 2, 0), (2, 0, 1)])
    excess = dice.pick([Fraction(0), dice.power(-14, -2)]) * dice.pick([1, -1])
    across = dice.pick([Fraction(0), dice.power(-14, -4)])
    centre, omega, gamma = ([Fraction(0)] * 3 for _ in range(3))
    centre[i], gamma[i], omega[j], omega[k] = Fraction(1), Fraction(-1), 2 + excess, across
    return with_data(motion[0], weight=motion[0].inertia[j], centre=centre), State(omega, gamma)


def _nudged(motion: Motion, dice: Dice) -> Motion:
    """A small relative change of every number."""
    top, start = motion
    size = dice.power(-8, -1) / 10

    def perturbed(values: Sequence[Fraction]) -> list[Fraction]:
        return [value * (1 + size * dice.part()) for value in values]

    gamma = unit([value + size * dice.part() for value in start.gamma])
    (weight,) = perturbed([top.weight])
    return with_data(top, perturbed(top.inertia), weight, perturbed(top.centre)), State(perturbed(start.omega), gamma)


def _rotored(motion: Motion, dice: Dice) -> Motion:
    """A rotor with random components, down to 0."""
    top, start = motion
    size = max(top.inertia) * dice.pick([Fraction(0), Fraction(1), Fraction(1), Fraction(1), dice.power(-12, 1)])
    rotor = [size * dice.pick([Fraction(0), dice.part(), dice.part()]) for _ in range(3)]
    return HeavyTop(top.inertia, top.weight, top.centre, rotor), start


def with_data(
    top: HeavyTop,
    inertia: Sequence[Any] | None = None,
    weight: Fraction | int | None = None,
    centre: Sequence[Any] | None = None,
    rotor_times: Fraction | int = 1,
) -> HeavyTop:
    """The top with other data, its rotor times a number."""
    rotor = None if top.rotor is None else [rotor_times * value for value in top.rotor]
    return HeavyTop(inertia or top.inertia, top.weight if weight is None else weight, centre or top.centre, rotor)


Change = Callable[[Motion, Dice], Motion]
_DRAWS: tuple[Change, ...] = (
    _simple, _edge, _equal, _spun, _slow, _weighed, _scaled, _poled, _balanced, _balanced, _pendulum,
)  # fmt: skip
_CHANGES: tuple[Change, ...] = (
    _edge, _equal, _spun, _slow, _weighed, _scaled, _poled, _balanced, _nudged, _nudged,
)  # fmt: skip


SAMPLES = 10
_MORE_BITS = 17
"""Bits by which the second start is nearer than a rounding of the format: its distance stays small on the way."""
_DIRECTION = tuple(Fraction(n, 1000) for n in (427, -331, 373, 461, -397, 433))
"""The direction of the second start: nearly a unit vector, in no plane of symmetry of a body."""
_STEP_LIMIT = 1_000_000
_LEAST = 1e-300
_MOST_ORDER = 60
"""A higher declared order leaves the range of doubles where a step is of many radians."""
ROUNDINGS = 20
"""Roundings of a fixed step, all in one direction."""


@dataclass(frozen=True, slots=True)
class MeasuredMotion:
    """A motion with the error of an integrator on it.

    outcome: of its run; "" where the true motion is unknown, so that nothing is measured.  error: infinite for a run
    that did not reach its horizon.  amplification: of the motion.  turns: its rate times the horizon.
    other: the error of the integrator that it is compared with, None without one.  reason: why the run was aborted.
    steps: of the default length, at least one, to the horizon.  order: of a method with fixed steps; 0 of others.
    """

    motion: Motion
    outcome: str
    error: float
    amplification: float
    turns: float
    other: float | None = None
    reason: str = ""
    steps: float = 0.0
    order: int = 0

    def rounding(self, eps: float) -> float:
        """The error of a stable method that makes an error of eps in each radian: eps · amplification · √turns."""
        return eps * self.amplification * math.sqrt(1 + self.turns)

    def explained(self, eps: float) -> float:
        """That error; of a method with fixed steps one of 20 eps in each step, and of (rate h)^order in each radian."""
        if not self.order:
            return self.rounding(eps)
        truncation = (self.turns / self.steps) ** min(self.order, _MOST_ORDER)
        return self.amplification * (ROUNDINGS * eps * self.steps + self.turns * truncation)


class Meter:
    """The measurement of motions with one integrator, and with the one that it is compared with."""

    def __init__(
        self, integrator: Integrator, precision: Precision, horizon: Fraction, against: Integrator | None
    ) -> None:
        self.integrator, self.precision, self.horizon, self.against = integrator, precision, horizon, against
        self.times = [rounded(horizon * i / SAMPLES, precision) for i in range(1, SAMPLES + 1)]
        self._fine = DOUBLE_DOUBLE if precision == DOUBLE else real(2 * precision.bits)
        python = is_third_party(integrator.name) and not isinstance(integrator.source, Command)
        self._shift = Fraction(1, 2 ** (precision.bits + _MORE_BITS))
        self._isolated = IsolatedIntegrator(integrator) if python else None
        self._order = 0

    def close(self) -> None:
        """End the process of a third-party integrator."""
        if self._isolated is not None:
            self._isolated.end()

    def problem(self, motion: Motion) -> Problem:
        """The motion in the format."""
        return Problem.of(*motion, self.precision, system_of(None, motion[0]))

    def measure(self, motions: Sequence[Motion]) -> list[MeasuredMotion]:
        """The measurements, in the order of the motions; none depends on the others."""
        if not motions:
            return []
        problems = list(map(self.problem, motions))
        rates = [rate(problem.system, problem.parameters, problem.start.flat) for problem in problems]
        references = self._references(problems, rates)
        runs = self._runs(self.integrator, problems, motions)
        self._order = max(self._order, *(run.order for run in runs))  # a failed run has none
        others = [] if self.against is None else self._runs(self.against, problems, motions)
        measured = []
        for i, (motion, unit, (true, growth), run) in enumerate(zip(motions, rates, references, runs, strict=True)):
            turns = float(unit * abs(self.horizon))
            if true is None:
                measured.append(MeasuredMotion(motion, "", 0.0, growth, turns))
                continue
            error = _error(run, true, unit)
            outcome = Outcome.NON_FINITE.value if math.isinf(error) and not _failed(run) else run.outcome
            other = _error(others[i], true, unit) if others else None
            how = run.reason, max(1.0, float(abs(self.horizon) / DEFAULT_STEP)), self._order
            measured.append(MeasuredMotion(motion, outcome, error, growth, turns, other, *how))
        return measured

    def run_of(self, integrator: Integrator, motion: Motion) -> IntegratedRun:
        """One run of the integrator that is hunted, or of another."""
        if integrator == self.integrator and self._isolated is not None:
            return self._isolated.run(*motion, self.times, self.precision)
        return integrated(integrator, *motion, self.times, self.precision)

    def sharper(self, motion: MeasuredMotion) -> MeasuredMotion:
        """The motion with its amplification over all directions, between any two times."""
        problem = self.problem(motion.motion)
        largest = amplification(problem.system, problem.parameters, problem.start.flat, self.horizon)
        return replace(motion, amplification=max(largest, motion.amplification))

    def _runs(
        self, integrator: Integrator, problems: Sequence[Problem], motions: Sequence[Motion]
    ) -> list[IntegratedRun]:
        if integrator.ensemble:
            runs = integrator.propagate_many(problems, self.times, threads=1)
            return [IntegratedRun(run.outcome.value, run.states) for run in runs]
        return [self.run_of(integrator, motion) for motion in motions]

    def _references(
        self, problems: Sequence[Problem], rates: Sequence[Fraction]
    ) -> list[tuple[list[list[Fraction]] | None, float]]:
        """The true states and the amplification of each motion; None where no run reached the horizon."""
        fine = [replace(problem, precision=self._fine) for problem in problems]
        moved = [
            replace(problem, start=_moved(problem.start, unit, self._shift))
            for problem, unit in zip(fine, rates, strict=True)
        ]
        times = [number(time, self._fine) for time in self.times]
        states: list[list[list[Fraction]] | None] = [None] * len(fine + moved)
        with suppress(OutOfReach):
            runs = propagate_multiword_ensemble(fine + moved, times, threads=1, step_limit=_STEP_LIMIT)
            good = [run.outcome is Outcome.SUCCESS for run in runs]
            states = [
                [list(map(exact, state)) for state in run.states] if good[i] else None for i, run in enumerate(runs)
            ]
        references = []
        for unit, true, other in zip(rates, states, states[len(fine) :], strict=False):
            growth = math.inf if true is None or other is None else _growth(true, other, unit, self._shift)
            references.append((true, max(1.0, growth)))
        return references


def _error(run: IntegratedRun, true: Sequence[Sequence[Fraction]], unit: Fraction) -> float:
    """The largest error over the samples; infinite where the run did not reach the last, or is not finite."""
    if _failed(run):
        return math.inf
    try:
        states = [[exact(value) for value in state[:6]] for state in run.states]
    except InputError:  # nan and infinity
        return math.inf
    distances = ([abs(a - b) for a, b in zip(*pair, strict=False)] for pair in zip(states, true, strict=False))
    return max(max(float(max(d[:3]) / (unit or 1)), float(max(d[3:])), _LEAST) for d in distances)


def _failed(run: IntegratedRun) -> bool:
    return run.outcome != Outcome.SUCCESS.value


def _moved(start: State, unit: Fraction, shift: Fraction) -> State:
    scale = [unit or Fraction(1)] * 3 + [Fraction(1)] * 3
    flat = [value + shift * size * part for value, size, part in zip(start.flat, scale, _DIRECTION, strict=True)]
    return State(flat[:3], flat[3:])


def _growth(
    states: Sequence[Sequence[Fraction]], others: Sequence[Sequence[Fraction]], unit: Fraction, shift: Fraction
) -> float:
    """The largest distance of two runs over the samples, divided by that of their starts."""
    scale = [float(unit or 1)] * 3 + [1.0] * 3
    largest = 0.0
    for state, other in zip(states, others, strict=True):
        parts = [float(a - b) / size for a, b, size in zip(state, other, scale, strict=True)]
        largest = max(largest, math.hypot(*parts))
    return largest / float(shift) / math.hypot(*map(float, _DIRECTION))


# The special features of a motion in sentences, and the name of its class.


NO_CLASS = "no closed form"
_NEAR = 1e-3
_FEW = 3.0
_FAST = 20.0


def class_of(top: HeavyTop, start: State) -> str:
    """The method of the motion's closed form."""
    try:
        solution = next(matches(top, start, system_of(None, top)), None)
    except HeavyTopError:
        return NO_CLASS
    return NO_CLASS if solution is None else solution.method


def special(motion: MeasuredMotion) -> list[str]:
    """Sentences on moments, spin, equilibrium, separatrix, energy and amplification, where these are special."""
    top, start = motion.motion
    system = system_of(None, top)
    field = [abs(value) for value in system.field(system.parameters(top, start).mapped(Fraction), start.flat)]
    slack, stiff = float(sum(top.inertia) / max(top.inertia) - 2), float(max(top.inertia) / min(top.inertia))
    height, spin = (math.sqrt(dot(vector, vector)) for vector in (top.moment, start.omega))
    swing = math.sqrt(height / float(min(top.inertia)))
    unit, part = spin + swing or 1.0, spin / (swing or 1.0)
    speed = max(float(max(field[:3])) / unit**2, float(max(field[3:])) / unit)
    energy = float(dot(top.angular_momentum(start.omega), start.omega) / 2 + dot(top.moment, start.gamma))
    chaotic = motion.amplification > 100 * (1 + motion.turns)
    kind = ", more than a regular motion does: near a separatrix, or chaotic" if chaotic else ""
    facts = {
        "at the edge of the triangle inequality" + (f", {slack:.1g} from it" if slack else ""): slack < _NEAR * 20,
        f"moments of very different size, 1 : {stiff:.3g}": stiff > _FAST,
        "Ω = 0": not spin,
        "no gravitational torque": spin and not swing,
        f"spin rate {part:.3g} times the pendulum rate": 0 < _FAST * swing < spin,
        f"slow: Ω is {part:.2g} of the pendulum rate": 0 < _FAST * spin < swing,
        "an equilibrium": not any(field),
        f"near an equilibrium: the field is {speed:.1g} of its bound": any(field) and speed < _NEAR,
        "near a separatrix: its energy is that of the upright equilibrium": abs(energy - height) < _NEAR * height,
        f"energy {energy:.4g}, P|r| = {height:.4g}": True,
        f"rate T at most {motion.turns:.3g}": True,
        f"the motion itself amplifies by {motion.amplification:.2g}{kind}": chaotic
        or digits_eaten(motion.amplification) >= _FEW,
    }
    return [*_ratios(top), *(text for text, holds in facts.items() if holds)]


def _ratios(top: HeavyTop) -> Iterator[str]:
    """Two moments of inertia nearly in a ratio up to 3, in words."""
    for i, j in ((0, 1), (1, 2), (0, 2)):
        larger, smaller = (i, j) if top.inertia[i] >= top.inertia[j] else (j, i)
        quotient = top.inertia[larger] / top.inertia[smaller]
        excess = float(quotient / round(quotient) - 1)
        if round(quotient) <= 3 and abs(excess) < _NEAR * 20:
            difference = f" to within {abs(excess):.1g}" if excess else ""
            yield f"I{larger + 1}/I{smaller + 1} = {round(quotient)}{difference}"
