"""A top or a start other than the ones that were given: the sign of γ or P, axes of the top renamed, another P, another
start, another top.

Numbers are fitted to the first integrals, which are linear in them: with M = IΩ and n = P r, neither M·γ nor
½ Ω·M + n·γ may change from the start to any sample.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import permutations, product
from math import isfinite
from typing import TypeVar

import numpy

from heavytop.errors import InputError
from heavytop.measure.mistaken_states import UNITS_OF_OMEGA
from heavytop.measure.suspects import ALIKE, FLOOR, SHORT, SMALL, Array, Suspect, motion, named, notable
from heavytop.precision import decimal_text
from heavytop.top.equations import GYROSTAT, HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

_SINGULAR = 1e-4
"""The integrals name one top if the smallest singular value is smaller than this part of the next."""
_NEAR = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10)
"""Widths, relative to the data, within which a fitted number may be rounded; the first that does no harm is taken."""
_MOST_CHANGED = 3
_MARGIN = 30.0
"""How many errors of the samples a fitted number may be off."""
_AT_ONCE = 1e-3
_LATER = 2
"""The last sample must be so many times as late as the first for a start to be told from the method's own errors."""


@dataclass(frozen=True, slots=True)
class Data:
    """What the data may be: the kind of mistake, and the numbers that fit by the name of what they replace.

    fitted: whether they were fitted.  required: how far the error must fall, where more than usual.
    """

    kind: str
    numbers: tuple[tuple[str, str], ...] = ()
    fitted: bool = False
    required: float = 0.0


Found = tuple[Data, float]


def without_numbers(given: Suspect) -> Iterator[Found]:
    """Suppositions that need no fitted number, the likeliest first."""
    top, start = given.top, given.start
    yield _tried(given, "weight_sign", replace(top, weight=-top.weight))
    yield _tried(given, "start_gamma_sign", start=State(start.omega, [-g for g in start.gamma]))
    yield _tried(given, "start_omega_sign", start=State([-w for w in start.omega], start.gamma))
    k = top.rotor or (Fraction(0),) * 3
    momentum = State([(w - r) / i for w, i, r in zip(start.omega, top.inertia, k, strict=True)], start.gamma)
    yield _tried(given, "start_momentum", start=momentum)
    yield _as_momentum(given, momentum)
    for unit, factor in UNITS_OF_OMEGA.items():
        yield Data(f"all_in_{unit}"), _all_times(given, factor)
    other = GYROSTAT if given.system is HEAVY_TOP else HEAVY_TOP
    yield _tried(replace(given, system=other), "system", None if top.rotor is None else replace(top, rotor=None))
    if top.rotor is not None:
        yield _tried(given, "rotor_sign", HeavyTop(top.inertia, top.weight, top.centre, [-part for part in top.rotor]))
    for a, b, c in list(permutations(range(3)))[1:]:
        axes = (("axes", f"{a + 1}{b + 1}{c + 1}"),)
        inertia = [top.inertia[i] for i in (a, b, c)]
        centre = [top.centre[i] for i in (a, b, c)]
        rotor = None if top.rotor is None else [top.rotor[i] for i in (a, b, c)]
        yield _tried(given, "inertia_axes", HeavyTop(inertia, top.weight, top.centre, top.rotor), numbers=axes)
        yield _tried(given, "centre_axes", HeavyTop(top.inertia, top.weight, centre, top.rotor), numbers=axes)
        yield _tried(given, "top_axes", HeavyTop(inertia, top.weight, centre, rotor), numbers=axes)
    for signs in list(product((1, -1), repeat=3))[1:-1]:
        centre = [s * r for s, r in zip(signs, top.centre, strict=True)]
        numbers = (("centre", ", ".join(map(str, centre))),)
        yield _tried(given, "centre_signs", HeavyTop(top.inertia, top.weight, centre, top.rotor), numbers=numbers)


def _tried(
    given: Suspect,
    kind: str,
    top: HeavyTop | None = None,
    start: State | None = None,
    numbers: tuple[tuple[str, str], ...] = (),
) -> Found:
    tops = (top or given.top, given.top)
    same = all(getattr(tops[0], part) == getattr(tops[1], part) for part in ("moment", "inertia", "rotor"))
    if same and (start is None or start == given.start) and kind != "system":
        return Data(kind), float("inf")
    return Data(kind, numbers), given.error(given.supposed(given.times, top, start))


def _as_momentum(given: Suspect, start: State) -> Found:
    """Start and states give M in place of Ω."""
    truth = given.supposed(given.times, start=start)
    if truth is not None:
        rotor = numpy.array([*map(float, given.top.rotor or (0, 0, 0)), 0, 0, 0])
        truth = truth * numpy.array([*map(float, given.top.inertia), 1, 1, 1]) + rotor
    return Data("all_momentum"), given.error(truth)


def _all_times(given: Suspect, factor: float) -> float:
    """The error where start and states give Ω times ``factor``."""
    start = State([w / Fraction(factor) for w in given.start.omega], given.start.gamma)
    truth = given.supposed(given.times, start=start)
    return given.error(None if truth is None else truth * ([factor] * 3 + [1.0] * 3))


def all_scaled(given: Suspect) -> Found | None:
    """A constant factor of Ω in start and states: its square is that of the weight that the energy asks for."""
    square = _weight_ratio(given)
    if square is None or square <= 0:
        return None
    fitted = square**0.5
    left = _all_times(given, fitted)
    factor = named(fitted, _MARGIN * max(left, FLOOR) * fitted)
    if not factor or not notable(factor, Fraction(1)):
        return None
    return Data("all_scaled", (("factor", decimal_text(factor, 8)),), fitted=True), _all_times(given, float(factor))


def _weight_ratio(given: Suspect) -> float | None:
    """P over the given one, from the energy: ½ Ω·M may change only by what P r·γ loses.  None where neither moves."""
    inertia, moment = _floats(given.top.inertia), _floats(given.top.moment)
    start = _floats(given.start.flat)
    kinetic = 0.5 * ((given.states[:, :3] ** 2 - start[:3] ** 2) @ inertia)
    height = (given.states[:, 3:] - start[3:]) @ moment
    square = float(height @ height)
    ratio = -float(kinetic @ height) / square if square else float("nan")
    return ratio if isfinite(ratio) else None


def another_weight(given: Suspect) -> Found | None:
    """P from the energy."""
    ratio, old = _weight_ratio(given), given.top.weight
    if ratio is None or not isfinite(ratio * float(old)):
        return None
    fitted = ratio * float(old)
    candidates = [named(fitted, near * abs(float(old))) for near in _NEAR]
    tried = [(weight, _with(given, given.top.inertia, [weight * r for r in given.top.centre])) for weight in candidates]
    weight, error = _roundest(tried)
    if not notable(weight, old):
        return None
    return Data("weight", (("P", _text(weight * given.units.moment)),), fitted=True), error


def another_start(given: Suspect) -> Found | None:
    """The start from the first sample, carried back to t = 0, and checked on samples that are much later.

    The error must fall by more than the motion itself magnifies it from the start to the first sample: where
    neighbouring motions part quickly, the errors of a method look like those of a start.
    """
    times = given.times
    if len(times) < 3 or not times[0] or abs(times[-1]) < _LATER * abs(times[0]):
        return None
    first = _as_state(given.states[0])
    back = motion(given.top, first, given.system, [-times[0]])
    truth = given.supposed(times[:1])
    if back is None or truth is None or not _shows_at_once(given, truth):
        return None
    start = _as_state(back[0])
    error = given.error(given.supposed(times, start=start))
    off = numpy.abs(back[0] - _floats(given.start.flat))
    magnified = float(numpy.abs(given.states[0] - truth[0]).max() / (off.max() or 1.0))
    names = ("Ω1", "Ω2", "Ω3", "γ1", "γ2", "γ3")
    sizes = [max(given.rate, numpy.abs(back[0, :3]).max())] * 3 + [1.0] * 3
    units = [given.units.time] * 3 + [Fraction(1)] * 3
    noise = _MARGIN * max(error, 1e-12)
    numbers = tuple(
        (name, _text(named(float(value), noise * size) / unit))
        for name, value, change, size, unit in zip(names, back[0], off, sizes, units, strict=True)
        if change > noise * size
    )
    return (Data("start", numbers, fitted=True, required=1000 * max(1.0, magnified)), error) if numbers else None


def _shows_at_once(given: Suspect, first: Array) -> bool:
    """Whether the first sample is off by a notable part of the largest error: a motion that magnifies the errors of a
    method may look like one from another start.
    """
    early, largest = given.at(given.rows[:1]).error(first), given.error(given.supposed(given.times))
    return early >= _AT_ONCE * largest


def another_top(given: Suspect) -> Found | None:
    """The moments and n = P r, up to a common factor, that keep both integrals from the start to every sample."""
    direction = _conserving(given) if given.system is HEAVY_TOP and len(given.rows) >= 3 else None
    before = [*given.top.inertia, *given.top.moment]
    if direction is None or not (direction * _floats(before)).any():
        return None
    scaled = [_scaled(direction, before, near) for near in _NEAR]
    tried = [(numbers, _with(given, numbers[:3], numbers[3:])) for numbers in scaled]
    numbers, error = _roundest(tried)
    units = [given.units.inertia] * 3 + [given.units.moment] * 3
    entries = zip(_NAMES, before, numbers, units, strict=True)
    changed = [(name, _text(new * unit)) for name, old, new, unit in entries if new != old]
    told = any(notable(new, old) for old, new in zip(before, numbers, strict=True) if new != old)
    if not told or len(changed) > _MOST_CHANGED:
        return None
    return Data("top", tuple(changed), fitted=True), error


_NAMES = ("I1", "I2", "I3", "P a", "P b", "P c")


def _conserving(given: Suspect) -> Array | None:
    """The one direction of (I, n) along which M·γ and the energy keep their values; None where there is not one."""
    start = _floats(given.start.flat)
    omega, gamma = given.states[:, :3], given.states[:, 3:]
    area = omega * gamma - start[:3] * start[3:]
    energy = numpy.hstack([0.5 * (omega**2 - start[:3] ** 2), gamma - start[3:]])
    size = given.rate or 1.0
    units = numpy.array([size**2] * 3 + [1.0] * 3)
    rows = numpy.vstack([numpy.hstack([area * size, numpy.zeros_like(area)]), energy]) / units
    if not numpy.isfinite(rows).all():
        return None
    _, values, directions = numpy.linalg.svd(rows)
    if len(values) < 6 or values[5] > _SINGULAR * values[4]:
        return None
    found: Array = directions[5] / units
    return found


def _scaled(direction: Array, before: Sequence[Fraction], near: float) -> list[Fraction]:
    """The direction with the factor by which most numbers stay what they are, within ``near`` of the largest."""
    old = _floats(before)
    sizes = numpy.repeat([numpy.abs(old[:3]).max(), numpy.abs(old[3:]).max() or numpy.abs(old[:3]).max()], 3)
    factors = [o / d for o, d in zip(old, direction, strict=True) if o and d]
    scaled = max((direction * f for f in factors), key=lambda new: int((numpy.abs(new - old) <= near * sizes).sum()))
    return [
        o if abs(value - float(o)) <= near * size else named(float(value), near * size)
        for value, o, size in zip(scaled, before, sizes, strict=True)
    ]


def _with(given: Suspect, inertia: Sequence[Fraction], moment: Sequence[Fraction]) -> float:
    """The error with that top."""
    try:
        top = HeavyTop(inertia, 1, moment, given.top.rotor)
    except InputError:  # a moment that is not positive
        return float("inf")
    return given.error(given.supposed(given.times, top))


_Numbers = TypeVar("_Numbers")


def _roundest(tried: Sequence[tuple[_Numbers, float]]) -> tuple[_Numbers, float]:
    """The first, that is the most rounded, whose error is about as small as any."""
    best = min(error for _, error in tried)
    return next(pair for pair in tried if pair[1] <= ALIKE * best)


def _as_state(values: Array) -> State:
    return State([Fraction(v) for v in values[:3]], [Fraction(v) for v in values[3:]])


def _floats(values: object) -> Array:
    return numpy.array([float(value) for value in values])  # type: ignore[attr-defined]


def _text(value: Fraction) -> str:
    """A short decimal, a small fraction, or eight digits."""
    decimal = decimal_text(value, SHORT + 2)
    if Fraction(decimal) == value or value.denominator > SMALL:
        return decimal if Fraction(decimal) == value else decimal_text(value, 8)
    return str(value)
