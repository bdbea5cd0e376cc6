"""Random starts: how they are drawn."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from heavytop.errors import InputError
from heavytop.exact.catalogue import matches
from heavytop.suite.cases import Case
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import State, dot

_GRID = 1000
_GAMMA_BITS = 24


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
