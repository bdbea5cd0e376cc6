"""The members of an ensemble: random starts of a top, or one motion with other roundings."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from heavytop.errors import InputError
from heavytop.exact.catalogue import matches
from heavytop.measure.rounding_noise import FACTORS, factor, scaled
from heavytop.suite.cases import Case
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State, dot

_GRID = 1000
_GAMMA_BITS = 24
_APART = 64
"""Roundings of one seed are so many rows of a report apart from those of the next."""


Member = tuple[HeavyTop, State]


def ensemble_of(case: Case, count: int, seed: int) -> list[Member]:
    """``count`` tops with starts; growing ``count`` keeps the earlier ones.

    Where random starts of the top are known in the same way as the case, these, of the one top: Ω has components
    uniform up to the largest of the case's Ω, and γ is a rational point of the unit sphere, uniform over it; for the
    gyrostat γ is M/|M| and |M| is half to three halves of the case's.
    A case that is one motion of its top, such as a pendulum, is taken with as many other roundings
    (:mod:`heavytop.measure.rounding_noise`); raises InputError where there are not as many.
    """
    if one_motion(case, seed):
        if count > FACTORS:
            raise InputError(f"{count} starts of {case.name}, which is one motion.", f"Give up to {FACTORS}.")
        return [(scaled(case.top, factor(_APART * seed, index)), case.start) for index in range(count)]
    return [(case.top, _draw(case, seed, index)) for index in range(count)]


def one_motion(case: Case, seed: int) -> bool:
    """Whether the case is one special motion of its top, not of a class that random starts are of."""
    return case.homoclinic is not None or _kind(case, case.start) is not _kind(case, _draw(case, seed, 0))


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
