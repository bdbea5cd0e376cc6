"""Motions that a hunt tries: drawn at random in ways that integrators find hard, and changed from the worst so far.

Everything is exact and depends on the seeds of :class:`Dice` alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from random import Random as Generator
from typing import Literal, TypeVar

from heavytop.precision import round_to
from heavytop.suite.sweeps import Random
from heavytop.top.amplification import rate
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.vectors import Vector

Family = Literal["any", "euler", "lagrange", "kovalevskaya"]
FAMILIES: tuple[Family, ...] = ("any", "euler", "lagrange", "kovalevskaya")
Motion = tuple[HeavyTop, State]
MOST_TURNS = 20_000
"""Motions of more radians, the rate times the horizon, are not tried: they cost what thousands of others do."""
_MOST_RATIO = 10**6
_LARGEST = 10**30
_BITS = 40
_UNIT_BITS = 60
_PLAIN_EVERY = 2
"""Of the first motions every second is a plain random top: the law of the integrator is measured on them."""
_POLES = [tuple(Fraction(sign * (i == j)) for j in range(3)) for i in range(3) for sign in (1, -1)]
_T = TypeVar("_T")


class Dice:
    """Draws of one seed; the same on every machine, as of Python's generator random() alone is promised to stay."""

    def __init__(self, seed: str) -> None:
        self._random = Generator(seed).random

    def below(self, count: int) -> int:
        """An integer from 0 to count − 1."""
        return int(count * self._random())

    def pick(self, things: Sequence[_T]) -> _T:
        """One of them."""
        return things[self.below(len(things))]

    def part(self) -> Fraction:
        """Of (−1, 1), in thousandths."""
        return Fraction(2 * self.below(1000) - 999, 1000)

    def power(self, least: int, most: int) -> Fraction:
        """1 to 9.9 times a power of ten from 10^least to 10^most."""
        return Fraction(10 + self.below(90), 10) * Fraction(10) ** (least + self.below(most - least + 1))

    def direction(self) -> Vector:
        """A rational unit vector, uniform on the sphere but for rounding."""
        while True:
            p, q, r = (self.part() for _ in range(3))
            if 0 < p * p + q * q + r * r <= 1:
                return unit((p, q, r))


def unit(values: Sequence[Fraction]) -> Vector:
    """A rational point of the unit sphere within 2^-58 of the direction of ``values``, which are not all 0."""
    return State((0, 0, 0), values).normalized(_UNIT_BITS).gamma


def drawn(seed: int, index: int, family: Family, horizon: Fraction) -> Motion:
    """Number ``index`` of the random motions: every second one of the first 64 and every eighth beyond are plain."""
    plain = Random("random", seed, index + 1, family).cases()[index]
    if is_plain(index):
        return plain.top, plain.start
    dice = Dice(f"{seed}/hunt/{index}")
    found = dice.pick(_WAYS)((plain.top, plain.start), dice)
    return possible(found, family, horizon) or (plain.top, plain.start)


def is_plain(index: int) -> bool:
    """Whether that random motion is one of a sweep of random tops."""
    return index % (_PLAIN_EVERY if index < 64 else 8) == 0


def changed(one: Motion, other: Motion, seed: str, family: Family, horizon: Fraction) -> Motion:
    """``one`` with one to three changes; ``other`` may give it its body or its start."""
    dice = Dice(seed)
    found = one
    for _ in range(1 + dice.below(3)):
        found = _crossed(found, other, dice) if dice.below(8) == 0 else dice.pick(_CHANGES)(found, dice)
    return possible(found, family, horizon) or one


def possible(motion: Motion, family: Family, horizon: Fraction) -> Motion | None:
    """The motion in that family with numbers of 40 bits; None where no body has its moments, its data are beyond
    1e30, or it turns more than :data:`MOST_TURNS` radians.
    """
    top, start = motion
    inertia, centre = list(top.inertia), list(top.centre)
    if family == "euler":
        centre = [Fraction(0)] * 3
    elif family == "lagrange":
        inertia[1], centre[:2] = inertia[0], [Fraction(0)] * 2
    elif family == "kovalevskaya":
        inertia[:2], centre[2] = [2 * inertia[2]] * 2, Fraction(0)
    inertia, centre, omega = (list(map(_short, each)) for each in (inertia, centre, start.omega))
    weight = _short(top.weight)
    if min(inertia) <= 0 or 2 * max(inertia) > sum(inertia) or max(inertia) > _MOST_RATIO * min(inertia):
        return None
    sizes = [abs(value) for value in (*inertia, weight, *centre, *omega) if value]
    if max(sizes) > _LARGEST or min(sizes) * _LARGEST < 1:
        return None
    found = HeavyTop(inertia, weight, centre), State(omega, start.gamma)
    return found if turns(found, horizon) <= MOST_TURNS else None


def turns(motion: Motion, horizon: Fraction) -> float:
    """How many radians the motion turns until the horizon, at most: its rate times the time."""
    top, start = motion
    return float(rate(HEAVY_TOP, HEAVY_TOP.parameters(top, start), start.flat) * abs(horizon))


def _short(value: Fraction) -> Fraction:
    """The value, or the nearest of 40 bits where it needs more than twice as many."""
    long = value.numerator.bit_length() + value.denominator.bit_length() > 2 * _BITS
    return round_to(value, _BITS) if long else value


def _simple(motion: Motion, dice: Dice) -> Motion:
    """Small numbers, zeros and equal moments."""
    moments = dice.pick([(1, 1, 1), (2, 2, 1), (2, 1, 1), (3, 2, 1), (1, 1, 2), (4, 4, 1), (4, 3, 2), (3, 4, 2)])
    by = dice.below(3)
    inertia = moments[by:] + moments[:by]
    centre = [Fraction(dice.below(5) - 2, 2) for _ in range(3)]
    omega = [Fraction(dice.below(9) - 4, 2) for _ in range(3)]
    return HeavyTop(inertia, 1 + dice.below(3), centre), State(omega, dice.pick([*_POLES, motion[1].gamma]))


def _edge(motion: Motion, dice: Dice) -> Motion:
    """Moments at the edge of the triangle inequality: almost a rod or a disc, or exactly."""
    second = [1 + abs(dice.part()) for _ in range(3)]
    for place in range(1 + dice.below(2)):
        second[(place + dice.below(3)) % 3] *= dice.pick([Fraction(0), dice.power(-5, -2)])
    x, y, z = second
    inertia = (y + z, z + x, x + y)
    return (_with(motion[0], inertia=inertia) if min(inertia) else motion[0]), motion[1]


def _equal(motion: Motion, dice: Dice) -> Motion:
    """Two moments in a small ratio, exactly or nearly."""
    inertia = list(motion[0].inertia)
    i, j = dice.pick([(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)])
    near = dice.pick([Fraction(0), dice.power(-9, -3)])
    inertia[i] = inertia[j] * dice.pick([Fraction(1), Fraction(1), Fraction(2), Fraction(3, 2)]) * (1 + near)
    inertia[3 - i - j] = (inertia[i] + inertia[j]) * (2 + dice.part()) / 3
    return _with(motion[0], inertia=inertia), motion[1]


def _spun(motion: Motion, dice: Dice) -> Motion:
    """One component of Ω many times as large, or small; or alone."""
    top, start = motion
    omega = [Fraction(0)] * 3 if dice.below(3) == 0 else list(start.omega)
    place = dice.below(3)
    omega[place] = (start.omega[place] or Fraction(1)) * dice.power(-4, 2)
    return top, State(omega, start.gamma)


def _slow(motion: Motion, dice: Dice) -> Motion:
    """Ω of any smallness, or none."""
    top, start = motion
    factor = dice.pick([Fraction(0), dice.power(-14, -1)])
    return top, State([value * factor for value in start.omega], start.gamma)


def _weighed(motion: Motion, dice: Dice) -> Motion:
    """A tiny or huge weight."""
    return _with(motion[0], weight=motion[0].weight * dice.power(-12, 4)), motion[1]


def _scaled(motion: Motion, dice: Dice) -> Motion:
    """Other units of mass, and the centre as far as it has to be."""
    top, start = motion
    mass, length = dice.power(-12, 11), dice.power(-6, 5)
    return HeavyTop(
        [mass * value for value in top.inertia], top.weight * mass / length, [length * value for value in top.centre]
    ), start


def _faster(motion: Motion, dice: Dice) -> Motion:
    """The same path at another pace: Ω times s, the weight times s²."""
    top, start = motion
    pace = dice.power(-6, 1)
    return _with(top, weight=top.weight * pace**2), State([pace * value for value in start.omega], start.gamma)


def _poled(motion: Motion, dice: Dice) -> Motion:
    """γ along an axis of the body, or near it."""
    top, start = motion
    near, pole = dice.pick([Fraction(0), dice.power(-12, -1)]), dice.pick(_POLES)
    return top, State(start.omega, unit([a + near * dice.part() for a in pole]))


def _balanced(motion: Motion, dice: Dice) -> Motion:
    """Near an equilibrium: Ω = w γ is a permanent rotation, w = 0 rest, where P r = w² I γ + c γ; which of them are
    saddles, and have separatrices near them, chance decides.
    """
    top, start = motion
    gamma = dice.pick([dice.pick(_POLES), start.gamma])
    speed = dice.pick([Fraction(0), Fraction(0), Fraction(1), dice.power(-2, 1)])
    along = dice.pick([Fraction(1), Fraction(-1), Fraction(0), dice.part()])
    near = dice.pick([Fraction(0), dice.power(-14, -2)])
    centre = [(speed**2 * i * g + along * g) / (top.weight or 1) for i, g in zip(top.inertia, gamma, strict=True)]
    return _with(top, centre=centre), State([speed * g + near * dice.part() for g in gamma], gamma)


def _pendulum(motion: Motion, dice: Dice) -> Motion:
    """A plane pendulum near its separatrix: from below, Ω² = 4 P|r|/I."""
    i, j, k = dice.pick([(0, 1, 2), (1, 2, 0), (2, 0, 1)])
    near = dice.pick([Fraction(0), dice.power(-14, -2)]) * dice.pick([1, -1])
    across = dice.pick([Fraction(0), dice.power(-14, -4)])
    centre, omega, gamma = ([Fraction(0)] * 3 for _ in range(3))
    centre[i], gamma[i], omega[j], omega[k] = Fraction(1), Fraction(-1), 2 + near, across
    return HeavyTop(motion[0].inertia, motion[0].inertia[j], centre), State(omega, gamma)


def _nudged(motion: Motion, dice: Dice) -> Motion:
    """Every number a little other."""
    top, start = motion
    size = dice.power(-8, -1) / 10

    def near(values: Sequence[Fraction]) -> list[Fraction]:
        return [value * (1 + size * dice.part()) for value in values]

    gamma = unit([value + size * dice.part() for value in start.gamma])
    (weight,) = near([top.weight])
    return HeavyTop(near(top.inertia), weight, near(top.centre)), State(near(start.omega), gamma)


def _without(motion: Motion, dice: Dice) -> Motion:
    """A component of the centre or of Ω is 0, or has the other sign."""
    top, start = motion
    centre, omega = list(top.centre), list(start.omega)
    dice.pick([centre, omega])[dice.below(3)] *= dice.pick([0, -1])
    return _with(top, centre=centre), State(omega, start.gamma)


def _turned(motion: Motion, dice: Dice) -> Motion:
    """The axes of the body or of the start called otherwise."""
    top, start = motion
    by = 1 + dice.below(2)

    def cycled(values: Vector) -> list[Fraction]:
        return [values[(i + by) % 3] for i in range(3)]

    if dice.below(2):
        return HeavyTop(cycled(top.inertia), top.weight, cycled(top.centre)), start
    return top, State(cycled(start.omega), cycled(start.gamma))


def _crossed(one: Motion, other: Motion, dice: Dice) -> Motion:
    return (one[0], other[1]) if dice.below(2) else (other[0], one[1])


def _with(
    top: HeavyTop,
    inertia: Sequence[Fraction] | None = None,
    weight: Fraction | None = None,
    centre: Sequence[Fraction] | None = None,
) -> HeavyTop:
    return HeavyTop(inertia or top.inertia, top.weight if weight is None else weight, centre or top.centre)


Way = Callable[[Motion, Dice], Motion]
_WAYS: tuple[Way, ...] = (
    _simple, _edge, _equal, _spun, _slow, _weighed, _scaled, _faster, _poled, _balanced, _balanced, _pendulum,
)  # fmt: skip
_CHANGES: tuple[Way, ...] = (
    _edge, _equal, _spun, _slow, _weighed, _scaled, _faster, _poled, _balanced, _nudged, _nudged, _without, _turned,
)  # fmt: skip
