"""Ensembles of a plan: how many starts, how they are drawn, how they are run."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import msgspec

from heavytop.errors import InputError
from heavytop.exact.catalogue import matches
from heavytop.precision import exact, parse, physical, usable_tolerance
from heavytop.suite.cases import Case
from heavytop.suite.task import Task
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import State, dot

_MOST_BITS = 900
"""Errors of more bits underflow in the floats that laws of growth are fitted with."""
_GRID = 1000
_GAMMA_BITS = 24


class GrowthRun(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One format with its horizon, and how its ensemble is made.

    samples: a decade, over ``decades`` decades before the horizon.  starts: random ones, the same for the same seed.
    tolerance, high_accuracy: heyoka's.  bias: a relative error of I1 in the field that is integrated and not in the
    reference: a planted fault.  reference: the wider format whose runs stand for the truth where no closed form is
    known; None for none.
    """

    precision: str
    horizon: str
    starts: int = 64
    seed: int = 1
    samples: int = 16
    decades: int = 5
    tolerance: str | None = None
    high_accuracy: bool = False
    bias: str | None = None
    reference: str | None = None

    @property
    def variant(self) -> str:
        """What sets this run apart from a plain one of the same case and format, as its row names it."""
        parts = {
            "high_accuracy": self.high_accuracy,
            f"tolerance {self.tolerance}": self.tolerance,
            f"I1 off by {self.bias}": self.bias,
            f"seed {self.seed}": self.seed != 1,
        }
        return ", ".join(text for text, said in parts.items() if said)


def growth_task(case: Case, run: GrowthRun) -> Task:
    """One row; raises InputError for an impossible value, and for a case without random starts."""
    precision = parse(run.precision)
    if precision.bits > _MOST_BITS:
        raise InputError(f"An ensemble in {precision.name}.", f"Laws of growth are fitted up to real:{_MOST_BITS}.")
    for name, value, limits in (
        ("starts", run.starts, range(1, 100_001)),
        ("samples", run.samples, range(4, 1001)),
        ("decades", run.decades, range(1, 13)),
    ):
        if value not in limits:
            raise InputError(f"{name} = {value} in a growth run.", f"Give {limits[0]} to {limits[-1]}.")
    horizon = physical(exact(run.horizon), "horizon")
    if horizon <= 0:
        raise InputError(f"horizon = {run.horizon} in a growth run.", "Give a positive number.")
    if run.tolerance is not None:
        usable_tolerance(run.tolerance, precision)
    if run.bias is not None and abs(exact(run.bias)) >= 1:
        raise InputError(f"bias = {run.bias} in a growth run.", "Give a relative error between -1 and 1.")
    if run.reference is not None and parse(run.reference).bits <= precision.bits:
        raise InputError(f"{run.reference} is no reference for {run.precision}.", "Name a format with more bits.")
    random_starts(case, 1, run.seed)
    steps = range(-run.samples * run.decades, 1)
    times = tuple(horizon * Fraction(f"{10 ** (step / run.samples):.4g}") for step in steps)
    return Task("growth", case.name, case, precision.name, run.variant, times, times, ensemble=run)


def random_starts(case: Case, count: int, seed: int) -> list[State]:
    """``count`` rational starts of the top of ``case`` whose motion is known in the same way; growing ``count`` keeps
    the earlier ones.

    Ω has components uniform up to the largest of the case's Ω, and γ is a rational point of the unit sphere, uniform
    over it; for the gyrostat γ is M/|M| and |M| is half to three halves of the case's.
    Raises InputError for a case that is one special motion of its top, such as a pendulum.
    """
    if _kind(case, case.start) is not _kind(case, _draw(case, seed, 0)):
        raise InputError(
            f"The case {case.name} is one motion, not a class with random starts.",
            "Use a case such as euler, lagrange, kovalevskaya, generic or gyrostat.",
        )
    return [_draw(case, seed, index) for index in range(count)]


def _draw(case: Case, seed: int, index: int) -> State:
    # a text seeds Python's generator by its SHA-512: the same on every platform
    random = Random(f"{case.name} {seed} {index}")
    ball = [Fraction(0)] * 3
    while not _GRID**2 // 4 < dot(ball, ball) <= _GRID**2:
        ball = [Fraction(random.randint(-_GRID, _GRID)) for _ in range(3)]
    gamma = State((0, 0, 0), ball).normalized(_GAMMA_BITS).gamma
    if case.system is GYROSTAT:
        size = dot(case.top.angular_momentum(case.start.omega), case.start.gamma)
        size *= Fraction(random.randint(_GRID // 2, 3 * _GRID // 2), _GRID)
        return State([size * g / i for g, i in zip(gamma, case.top.inertia, strict=True)], gamma)
    size = max(abs(w) for w in case.start.omega)
    return State([size * Fraction(random.randint(-_GRID, _GRID), _GRID) for _ in range(3)], gamma)


def _kind(case: Case, start: State) -> type | None:
    """The closed form that a random start of the top has as well, or the special one it has not."""
    found = next(matches(case.top, start, case.system), None)
    return None if found is None else type(found)
