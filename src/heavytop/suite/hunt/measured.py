"""How wrong an integrator is on many motions, and how much of it the motions themselves explain.

The truth is a run in about twice the digits of the format, double-double in lanes for double; a second one from a start
moved by 2^-17 roundings tells how much the motion amplifies, for a hundredth of the cost of
:mod:`heavytop.top.amplification`, which is asked before anything is called found.  Errors are max(|δΩ|/rate, |δγ|)
over the samples, with the :func:`heavytop.top.amplification.rate` of the motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError, OutOfReach
from heavytop.integrate.peers import is_third_party
from heavytop.integrate.peers.command import Command
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.integrate.words_ensemble import propagate_words_ensemble
from heavytop.measure.integrator import ChosenIntegrator
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, Precision, exact, number, real
from heavytop.suite.hunt.apart import SECONDS, Apart, Run, follow
from heavytop.suite.hunt.draw import Motion
from heavytop.top.amplification import FOLLOWED, amplification, rate
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import State

SAMPLES = 10
_MORE_BITS = 17
"""The second start is so many bits nearer than a rounding of the format: its distance stays small on the way."""
_WHERE = tuple(Fraction(n, 1000) for n in (427, -331, 373, 461, -397, 433))
"""The direction of the second start, a unit vector nearly, in no plane that a symmetric body knows."""
_STEP_LIMIT = 1_000_000
_LEAST = 1e-300


@dataclass(frozen=True, slots=True)
class Measured:
    """A motion and what an integrator made of it.

    outcome: of its run; "" where the truth is unknown, and nothing can be said.  error: infinite of a run that did not
    reach its horizon.  amplification: of the motion.  turns: its rate times the horizon.
    other: the error of the integrator that it is compared with, None where there is none.
    """

    motion: Motion
    outcome: str
    error: float
    amplification: float
    turns: float
    other: float | None = None
    said: str = ""

    def explained(self, eps: float) -> float:
        """The error of a stable method whose every radian costs an eps: eps times amplification, times √turns."""
        return eps * self.amplification * math.sqrt(1 + self.turns)


class Meter:
    """Measures motions with one integrator, and with the one that it is compared with."""

    def __init__(
        self, integrator: ChosenIntegrator, precision: Precision, horizon: Fraction, against: ChosenIntegrator | None
    ) -> None:
        self.integrator, self.precision, self.horizon, self.against = integrator, precision, horizon, against
        self.times = [exact(number(horizon * i / SAMPLES, precision)) for i in range(1, SAMPLES + 1)]
        self._fine = DOUBLE_DOUBLE if precision == DOUBLE else real(2 * precision.bits)
        python = is_third_party(integrator.name) and not isinstance(integrator.source, Command)
        self._shift = Fraction(1, 2 ** (precision.bits + _MORE_BITS))
        self._apart = Apart(integrator, SECONDS) if python else None

    def close(self) -> None:
        """End the process of an integrator of others."""
        if self._apart is not None:
            self._apart.end()

    def measure(self, motions: Sequence[Motion]) -> list[Measured]:
        """Each of them, in order; the bits of one do not depend on the others."""
        if not motions:
            return []
        problems = [Problem.of(*motion, self.precision, HEAVY_TOP) for motion in motions]
        rates = [rate(HEAVY_TOP, each.parameters, each.start.flat) for each in problems]
        truths = self._truths(problems, rates)
        runs = self._runs(self.integrator, problems, motions, self._apart)
        others = [] if self.against is None else self._runs(self.against, problems, motions, None)
        found = []
        for i, (motion, unit, (true, grown), run) in enumerate(zip(motions, rates, truths, runs, strict=True)):
            turns = float(unit * abs(self.horizon))
            other = self._error(others[i], true, unit) if others and true else None
            if not true:
                found.append(Measured(motion, "", 0.0, grown, turns))
            else:
                error = self._error(run, true, unit)
                outcome = Outcome.NON_FINITE.value if math.isinf(error) and not _failed(run) else run.outcome
                found.append(Measured(motion, outcome, error, grown, turns, other, run.said))
        return found

    def run_of(self, integrator: ChosenIntegrator, motion: Motion) -> Run:
        """One run of the integrator that is hunted, or of another."""
        if integrator == self.integrator and self._apart is not None:
            return self._apart.follow(*motion, self.times, self.precision)
        return follow(integrator, *motion, self.times, self.precision)

    def sharper(self, found: Measured) -> Measured:
        """The same with the amplification over all directions, from the start on and from each sample on: what is
        rounded on the way may grow by more than what is rounded at the start.
        """
        problem = Problem.of(*found.motion, self.precision, HEAVY_TOP)
        largest = amplification(HEAVY_TOP, problem.parameters, problem.start.flat, self.horizon)
        (states,) = self._finely([replace(problem, precision=self._fine)])
        for time, state in zip(self.times[:-1], states or (), strict=False):
            # of a motion that is lost anyway no more is asked
            if largest > FOLLOWED:
                break
            later = amplification(HEAVY_TOP, problem.parameters, tuple(state), self.horizon - time)
            largest = max(largest, later)
        return replace(found, amplification=max(largest, found.amplification))

    def _runs(
        self, integrator: ChosenIntegrator, problems: Sequence[Problem], motions: Sequence[Motion], apart: Apart | None
    ) -> list[Run]:
        if integrator.supports_ensemble:
            runs = integrator.propagate_many(problems, self.times, threads=1)
            return [Run(run.outcome.value, run.states) for run in runs]
        if apart is not None:
            return [apart.follow(*motion, self.times, self.precision) for motion in motions]
        return [follow(integrator, *motion, self.times, self.precision) for motion in motions]

    def _truths(
        self, problems: Sequence[Problem], rates: Sequence[Fraction]
    ) -> list[tuple[list[list[Fraction]] | None, float]]:
        """The true states and the amplification of each; None where no run reached the horizon."""
        fine = [replace(each, precision=self._fine) for each in problems]
        moved = [
            replace(each, start=_moved(each.start, unit, self._shift)) for each, unit in zip(fine, rates, strict=True)
        ]
        runs = self._finely([*fine, *moved])
        found: list[tuple[list[list[Fraction]] | None, float]] = []
        for i, unit in enumerate(rates):
            one, two = runs[i], runs[len(fine) + i]
            if one is None:
                found.append((None, math.inf))
                continue
            grown = math.inf if two is None else _growth(one, two, unit, self._shift)
            found.append((one, max(1.0, grown)))
        return found

    def _finely(self, problems: Sequence[Problem]) -> list[list[list[Fraction]] | None]:
        times = [number(time, self._fine) for time in self.times]
        try:
            runs = propagate_words_ensemble(problems, times, threads=1, step_limit=_STEP_LIMIT)
        except OutOfReach:
            return [None] * len(problems)
        done = [run.outcome is Outcome.SUCCESS for run in runs]
        return [
            [[exact(value) for value in state] for state in run.states] if reached else None
            for run, reached in zip(runs, done, strict=True)
        ]

    def _error(self, run: Run, true: Sequence[Sequence[Fraction]], unit: Fraction) -> float:
        """The largest over the samples; infinite where the run did not reach the last, or is no number."""
        if _failed(run):
            return math.inf
        try:
            states = [[exact(value) for value in state[:6]] for state in run.states]
        except InputError:  # nan and infinity
            return math.inf
        return max(map(lambda one, two: _distance(one, two, unit), states, true))


def _failed(run: Run) -> bool:
    return run.outcome != Outcome.SUCCESS.value


def _moved(start: State, unit: Fraction, shift: Fraction) -> State:
    scale = [unit or Fraction(1)] * 3 + [Fraction(1)] * 3
    flat = [value + shift * size * by for value, size, by in zip(start.flat, scale, _WHERE, strict=True)]
    return State(flat[:3], flat[3:])


def _growth(
    one: Sequence[Sequence[Fraction]], two: Sequence[Sequence[Fraction]], unit: Fraction, shift: Fraction
) -> float:
    """How many times as far apart the two runs are as at the start, at most over the samples."""
    scale = [float(unit or 1)] * 3 + [1.0] * 3
    largest = 0.0
    for first, second in zip(one, two, strict=True):
        parts = [float(a - b) / size for a, b, size in zip(first, second, scale, strict=True)]
        largest = max(largest, math.hypot(*parts))
    return largest / float(shift) / math.hypot(*map(float, _WHERE))


def _distance(one: Sequence[Any], two: Sequence[Any], unit: Fraction) -> float:
    apart = [abs(a - b) for a, b in zip(one, two, strict=True)]
    return max(float(max(apart[:3]) / (unit or 1)), float(max(apart[3:])), _LEAST)
