"""Where Kovalevskaya's two variables move on the curve of a level, and the pole of v = 1/(w − μ).

w1 starts in (−∞, lowest root], or like w2 between two roots where φ ≤ 0.  Which it is, the exact start decides, in
balls that meet one closed interval only.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from flint import acb, arb

from heavytop.exact.balls import Undecided, midpoint
from heavytop.exact.gaps import distance_of_others
from heavytop.exact.kovalevskaya_level import Level, Root, Start

_SHARES = (0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98)
_BEYOND = (0.05, 0.3, 1.0, 3.0, 10.0)
Interval = tuple[int, int]
"""Numbers of the branch points at the lower and upper end in v; 0 is v = 0, j is root number j − 1."""


def intervals(level: Level, curve: Sequence[Root], start: Start) -> tuple[Interval, Interval]:
    """Where w1 and w2 move: pairs of numbers of branch points, (lower, upper) in v and so (upper, lower) in w.

    Twice the same number for a variable that rests at a double root for ever.
    Raises Undecided where the balls do not tell.
    """
    resting = _resting(level, curve, start)
    real = [i for i in ordered(curve) if i not in resting.values()]
    allowed, inside = [(real[0] + 1, 0)], True
    for low, high in pairwise(real):
        inside ^= curve[low].multiplicity % 2 == 1
        if inside:
            allowed.append((high + 1, low + 1))

    def possible(variable: int, interval: Interval) -> bool:
        upper, lower = interval
        below = lower > 0 and start.above(variable, curve[lower - 1].value.real) < 0
        return not below and not start.above(variable, curve[upper - 1].value.real) > 0

    found = [
        [(resting[k] + 1, resting[k] + 1)]
        if k in resting
        else [interval for interval in allowed if possible(k, interval)]
        for k in (0, 1)
    ]
    if any(len(choice) != 1 for choice in found):
        raise Undecided
    return found[0][0], found[1][0]


def _resting(level: Level, curve: Sequence[Root], start: Start) -> dict[int, int]:
    """The variable that rests at a double root, if any, and the number of that root."""
    double = [i for i, root in enumerate(curve) if root.multiplicity > 1]
    if not double or level.separated(level.double()) != 0:
        return {}
    found = {k: double[0] for k in (0, 1) if start.above(k, curve[double[0]].value.real).contains(0)}
    if len(found) != 1:
        raise Undecided
    return found


def ordered(curve: Sequence[Root]) -> list[int]:
    """The numbers of the real roots, rising; raises Undecided where two balls meet."""
    real = [i for i, root in enumerate(curve) if root.value.imag.is_zero()]
    real.sort(key=lambda i: midpoint(curve[i].value.real))
    if any(curve[i].value.overlaps(curve[j].value) for i, j in pairwise(real)):
        raise Undecided
    return real


def pole(curve: Sequence[Root], occupied: Sequence[Interval]) -> tuple[arb, float]:
    """μ, outside both gaps, where the branch points in v come to lie as far from the gaps as possible; and how far."""
    real = ordered(curve)
    taken = {(upper - 1, lower - 1) for upper, lower in occupied}
    lowest, highest = (curve[i].value.real.mid() for i in (real[0], real[-1]))
    candidates = [highest + share * (highest - lowest) for share in _BEYOND]
    for low, high in pairwise(real):
        if (high, low) not in taken:
            start, width = curve[low].value.real.mid(), (curve[high].value.real - curve[low].value.real).mid()
            candidates += [start + share * width for share in _SHARES]

    def distance(mu: arb) -> float:
        points = [acb(0), *(1 / (root.value - mu) for root in curve)]
        return min(float(distance_of_others(points, (low, high))) for low, high in occupied if low != high)

    distances = [distance(mu.mid()) for mu in candidates]
    best = max(range(len(candidates)), key=distances.__getitem__)
    return candidates[best].mid(), distances[best]
