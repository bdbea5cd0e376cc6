"""The simplest data that still show what was found: zeros, equal moments, numbers of few digits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import cache
from itertools import product
from math import gcd
from typing import Any

import numpy

from heavytop.precision import decimal_text, shown
from heavytop.suite.hunt.draw import Motion
from heavytop.top.heavy_top import HeavyTop, State

Shows = Callable[[Sequence[Motion]], list[bool]]
"""Which of the motions show it."""
_MOST_ROUNDS = 12
_TOGETHER = 8
_DIRECTION_NORMS = (1, 2, 3, 5, 7, 9, 11, 13, 15, 17, 25, 33, 51, 65, 99, 201, 301, 451, 651, 901, 999)
_MOST_DENOMINATOR = 31


def digits(value: Fraction) -> int:
    """Significant digits of a number as it is written: 0 of 0, 1 of 5000 and of 1e-8, 2 of 3/2."""
    text = shown(value).lstrip("-").partition("e")[0]
    return sum(len(part.replace(".", "").strip("0")) for part in text.split("/"))


def complexity(motion: Motion) -> tuple[int, int, int]:
    """What shrinking makes smaller: digits, numbers that are neither 0 nor 1, different numbers and signs."""
    top, start = motion
    values = [*top.inertia, top.weight, *top.centre, *start.omega, *start.gamma]
    odd = sum(value not in (0, 1) for value in values)
    sizes = sum(len(shown(value)) for value in values) + sum(value < 0 for value in values)
    return sum(map(digits, values)), odd + len(set(top.inertia)), sizes


def shrunk(motion: Motion, shows: Shows, rounds: int = _MOST_ROUNDS) -> Motion:
    """A motion that shows the same and of which no single change that is tried makes a simpler one that does."""
    for _ in range(rounds):
        before = complexity(motion)
        for change in _CHANGES:
            motion = _first(motion, change(motion), shows)
        if complexity(motion) >= before:
            break
    return motion


def _first(motion: Motion, simpler: Iterator[Motion], shows: Shows) -> Motion:
    """The first of those, the simplest first, that is simpler and shows it; else the motion itself."""
    here = complexity(motion)
    waiting = sorted((each for each in simpler if complexity(each) < here), key=complexity)
    for begin in range(0, len(waiting), _TOGETHER):
        group = waiting[begin : begin + _TOGETHER]
        for each, good in zip(group, shows(group), strict=True):
            if good:
                return each
    return motion


def _of_body(motion: Motion) -> Iterator[Motion]:
    """Whole bodies: small integers in place of the moments, no centre, one along an axis, weight 1."""
    top, start = motion
    for inertia in product((1, 2, 3, 4), repeat=3):
        if 2 * max(inertia) <= sum(inertia):
            yield HeavyTop(inertia, top.weight, top.centre), start
            yield HeavyTop(inertia, 1, (0, 0, 0)), start
    for place in range(3):
        centre = [each if i == place else Fraction(0) for i, each in enumerate(top.centre)]
        yield HeavyTop(top.inertia, top.weight, centre), start
        yield HeavyTop(top.inertia, 1, [top.weight * each for each in centre]), start


def _of_units(motion: Motion) -> Iterator[Motion]:
    """The same motion in other units of mass and length."""
    top, start = motion
    for unit in {value for value in top.inertia if value != 1}:
        inertia = [value / unit for value in top.inertia]
        yield HeavyTop(inertia, top.weight / unit, top.centre), start
        yield HeavyTop(inertia, 1, [top.weight / unit * value for value in top.centre]), start
    yield HeavyTop(top.inertia, 1, [top.weight * value for value in top.centre]), start


def _of_start(motion: Motion) -> Iterator[Motion]:
    """Ω none, or along one axis, and γ on the poles."""
    top, start = motion
    for place in range(3):
        omega = [each if i == place else Fraction(0) for i, each in enumerate(start.omega)]
        yield top, State(omega, start.gamma)
        for sign in (1, -1):
            pole = [Fraction(sign * (i == place)) for i in range(3)]
            yield top, State(start.omega, pole)
            yield top, State((0, 0, 0), pole)
            yield HeavyTop(top.inertia, 1, pole), State((0, 0, 0), pole)
    yield top, State((0, 0, 0), start.gamma)


def _of_inertia(motion: Motion) -> Iterator[Motion]:
    """One moment, or two together."""
    top, start = motion
    for i, value in enumerate(top.inertia):
        for simple in _simpler(value):
            if simple > 0:
                for also in ((i,), (i, (i + 1) % 3), (i, (i + 2) % 3)):
                    inertia = [simple if k in also else each for k, each in enumerate(top.inertia)]
                    if 2 * max(inertia) <= sum(inertia):
                        yield HeavyTop(inertia, top.weight, top.centre), start


def _of_weight(motion: Motion) -> Iterator[Motion]:
    top, start = motion
    for simple in _simpler(top.weight):
        yield HeavyTop(top.inertia, simple, top.centre), start


def _of_centre(place: int) -> Callable[[Motion], Iterator[Motion]]:
    def change(motion: Motion) -> Iterator[Motion]:
        top, start = motion
        for simple in _simpler(top.centre[place]):
            centre = [simple if i == place else each for i, each in enumerate(top.centre)]
            yield HeavyTop(top.inertia, top.weight, centre), start

    return change


def _of_omega(place: int) -> Callable[[Motion], Iterator[Motion]]:
    def change(motion: Motion) -> Iterator[Motion]:
        top, start = motion
        for simple in _simpler(start.omega[place]):
            yield top, State([simple if i == place else each for i, each in enumerate(start.omega)], start.gamma)

    return change


def _of_gamma(motion: Motion) -> Iterator[Motion]:
    """The nearest unit vector of each of some denominators, to three digits."""
    top, start = motion
    table = _directions()
    norms = table[:, 0]
    apart = numpy.abs(table[:, 1:] / table[:, :1] - numpy.array([float(value) for value in start.gamma])).max(axis=1)
    nearest = (int(apart[: int((norms <= most).sum())].argmin()) for most in _DIRECTION_NORMS)
    for place in dict.fromkeys(nearest):
        norm, *parts = table[place].tolist()
        yield top, State(start.omega, [Fraction(part, norm) for part in parts])


@cache
def _directions() -> Any:
    """Unit vectors with numerators and denominators of at most three digits: integers, shape (n, 4), each the common
    denominator, in order, and three numerators.
    """
    found: dict[tuple[int, int, int, int], None] = {}
    for n in range(1, _MOST_DENOMINATOR + 1):
        for a, b in product(range(-n, n + 1), repeat=2):
            norm = n * n + a * a + b * b
            if a * a + b * b <= n * n and norm < 1000:
                u, v, w = 2 * a * n, 2 * b * n, n * n - a * a - b * b
                common = gcd(u, v, w, norm)
                u, v, w, norm = u // common, v // common, w // common, norm // common
                for part in (w, -w):
                    found |= dict.fromkeys([(norm, u, v, part), (norm, v, part, u), (norm, part, u, v)])
    return numpy.array(sorted(found, key=lambda each: each[0]))


def _simpler(value: Fraction) -> list[Fraction]:
    """Simpler numbers: 0, ±1, integers, halves, fractions and decimals of one, two and three digits."""
    found = {Fraction(0), Fraction(1), Fraction(-1), abs(value)}
    if abs(value) < 1000:
        found |= {Fraction(round(value) + k) for k in (-1, 0, 1)}
        found |= {value.limit_denominator(most) for most in (2, 3, 5, 9, 30, 99)}
    if value:
        found |= {Fraction(decimal_text(value, n)) for n in (1, 2, 3)}
        power = Fraction(10) ** len(str(int(abs(value)))) if abs(value) >= 1 else Fraction(1)
        found |= {power * (1 if value > 0 else -1), power / 10 * (1 if value > 0 else -1)}
    return [each for each in found if digits(each) <= digits(value) and each != value]


_CHANGES: tuple[Callable[[Motion], Iterator[Motion]], ...] = (
    _of_body,
    _of_start,
    _of_units,
    _of_gamma,
    _of_inertia,
    _of_weight,
    *(_of_centre(place) for place in range(3)),
    *(_of_omega(place) for place in range(3)),
)
