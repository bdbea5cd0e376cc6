"""Hypotheses about states: other readings of their columns, another top or start, other times, other equations.

Numbers of the top are fitted to the first integrals, which are linear in them: with M = IΩ and n = P r, neither M·γ nor
½ Ω·M + n·γ may change from the start to any sample.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache
from itertools import permutations, product
from math import isfinite
from typing import Any, TypeVar

import numpy

from heavytop.errors import InputError
from heavytop.features.score.diagnose.samples import (
    FARTHEST,
    SHORT,
    SMALL,
    WITH_ATTITUDE,
    Examined,
    floats,
    in_units,
    notable,
    plain_number,
)
from heavytop.features.score.diagnose.search import ALIKE, FITTED_DROP, FLOOR, Array, Hypothesis
from heavytop.precision import cross, decimal_text
from heavytop.top.attitude import rotated, transposed
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, NAMES, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State

# Other readings of the columns: axes renamed or reversed, γ down, M in place of Ω.


_DEGREES = 180 / numpy.pi
_TURNS = 1 / (2 * numpy.pi)
_RPM = 60 * _TURNS
UNITS_OF_OMEGA = {"degrees": _DEGREES, "turns": _TURNS, "rpm": _RPM}
"""Units of angular velocity as multiples of radians per time unit; rpm where times are in seconds."""
_FEWEST = 3
"""Fewest numbers to which a factor is fitted."""
_PRESENT = 1e-6
"""A column of the true states below this part of its vector counts as 0."""
_MEANINGS: dict[str, tuple[float, float, bool]] = {
    "": (1, 1, False),
    "gamma_down": (1, -1, False),
    "omega_reversed": (-1, 1, False),
    "both_reversed": (-1, -1, False),
    "momentum": (1, 1, True),
    "momentum_gamma_down": (1, -1, True),
    "omega_in_degrees": (_DEGREES, 1, False),
    "omega_in_turns": (_TURNS, 1, False),
    "omega_in_rpm": (_RPM, 1, False),
}
"""Factor of Ω, factor of γ, and whether M stands in place of Ω."""


@cache
def _every_reading() -> tuple[tuple[Any, ...], ...]:
    """Every reading of the columns but the plain one, the simplest first: numbers of changes, kinds, numbers.

    Then for each column its indices among Ω, γ and M of a motion, and its factors.  Of renamed axes
    column i of a vector holds ±(axis |axes[i]|), counted from 1, ``of`` both vectors or of one.
    """
    every: list[tuple[Any, ...]] = []
    plain, renamed = (1, 2, 3), list(permutations((1, 2, 3)))
    signs = [sign for sign in product((1, -1), repeat=3) if sign != (-1, -1, -1)]
    kinds: list[tuple[str, tuple[int, ...]]] = [
        ("both", (a * s, b * t, c * u)) for (a, b, c), (s, t, u) in product(renamed, signs)
    ]
    kinds += [(of, axes) for of in ("omega", "gamma") for axes in renamed[1:]]
    for (meaning, (omega, gamma, momentum)), swapped, (of, axes) in product(_MEANINGS.items(), (False, True), kinds):
        moved, reversed_axes = axes != plain, sum(axis < 0 for axis in axes)
        changes = bool(meaning) + ("_gamma_down" in meaning) + swapped + moved + reversed_axes + (of != "both")
        numbers = {"meaning": meaning} if meaning else {}
        numbers |= {"axes": ",".join(map(str, axes)), "of": of} if moved else {}
        numbers |= {"order": "gamma before omega"} if swapped else {}
        kind = "columns" if meaning or swapped else "axes_permuted"
        if len(numbers) == 1 and not moved:
            kind, numbers = meaning or "columns_swapped", {}
        columns = [
            (first + abs(axis) - 1, factor * (axis // abs(axis)))
            for first, factor, other in ((6 * momentum, omega, "gamma"), (3, gamma, "omega"))
            for axis in (plain if of == other else axes)
        ]
        columns = columns[3:] + columns[:3] if swapped else columns
        if changes:
            every.append((changes, kind, numbers, [place for place, _ in columns], [factor for _, factor in columns]))
    return tuple(zip(*sorted(every, key=lambda reading: reading[0]), strict=True))


_LARGEST_UNIT = Fraction(10) ** 300


def readings(run: Examined, truth: Array) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """The readings of the columns with one change, and those with several, the simplest first."""
    if len(run.frame.columns) < 6:
        return [], []
    changes, kinds, numbers, places, factors = _every_reading()
    # no momentum of a larger unit is in double
    time, inertia = float(run.units.time), float(min(run.units.inertia, _LARGEST_UNIT))
    columns = numpy.hstack([truth[:, :6], inertia * truth[:, :3] @ run.tensor])
    place, factor = numpy.array(places), numpy.array(factors)
    # a vector in the place of the other is in the unit of that
    factor[place[:, 0] // 3 == 1] *= numpy.repeat([time, 1 / time], 3)
    errors = run.errors((columns[:, place] * factor).swapaxes(0, 1))
    tried = list(map(Hypothesis, kinds, numbers, errors))
    return tried[: changes.count(1)], tried[changes.count(1) :]


def scaled(run: Examined, truth: Array) -> Iterator[Hypothesis]:
    """Ω, γ or one column times a constant factor: kind, numbers, and the error of the states divided by the factor."""
    groups = [("omega_scaled", slice(0, 3)), ("gamma_scaled", slice(3, 6))]
    groups += [("column_scaled", slice(column, column + 1)) for column in range(6)]
    for kind, columns in groups:
        if not set(range(6)[columns]) <= set(run.frame.columns):
            continue
        true, whole = truth[:, columns], truth[:, :3] if columns.start < 3 else truth[:, 3:]
        if true.size < _FEWEST or numpy.abs(true).max() <= _PRESENT * numpy.abs(whole).max():
            continue
        fitted = float((run.states[:, columns] * true).sum() / (true * true).sum())
        if not numpy.isfinite(fitted) or not fitted:
            continue
        left = float(_divided(run, truth, columns, fitted).max())
        factor = plain_number(fitted, ALIKE * max(left, FLOOR) * abs(fitted))
        if factor and (factor != -1 or true.shape[1] == 1) and notable(factor, Fraction(1)):
            numbers = {"column": NAMES[columns.start]} if kind == "column_scaled" else {}
            numbers["factor"] = decimal_text(factor, 8)
            yield Hypothesis(kind, numbers, _divided(run, truth, columns, float(factor)), FITTED_DROP)


def _divided(run: Examined, truth: Array, columns: slice, factor: float) -> Array:
    states = run.states.copy()
    states[:, columns] /= factor
    return replace(run, states=states).errors(truth)


def constant_column(run: Examined, truth: Array) -> Iterator[Hypothesis]:
    """A column that is constant, with the error of the other five."""
    if len(run.rows) < _FEWEST:
        return
    still = (run.all_states == run.all_states[0]).all(axis=0)
    for column in (column for column in run.frame.columns if still[column]):
        states = run.states.copy()
        states[:, column] = truth[:, column]
        value = Fraction(float(run.states[0, column])) / (run.units.time if column < 3 else 1)
        numbers = {"column": NAMES[column], "value": decimal_text(value, 6)}
        yield Hypothesis("column_constant", numbers, replace(run, states=states).errors(truth), FITTED_DROP)


_SINGULAR = 1e-4
"""The integrals determine one top if the smallest singular value is below this part of the next."""
_PARTS = (1.0, 0.5, 0.25, 0.1)
"""Parts of a step of Gauss-Newton, of which the first that reduces the sum of squares is taken."""
_NEAR = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10)
"""Relative widths within which a fitted number may be rounded; the first that keeps the error small is taken."""
_MOST_CHANGED = 3
_MARGIN = 30.0
"""Factor of the errors of the samples by which a fitted number may be off."""
_BIAS = 0.02
"""A smaller change of the start, relative to its vector, may be the error of a method unless the number is round."""
_SPARSE = 0.05
"""Part of the distance between short decimals within which agreement is not accidental."""
_AT_ONCE = 1e-3
_LATER = 2
"""The last sample must be so many times as late as the first to distinguish a start from the errors of a method."""


def without_numbers(run: Examined) -> Iterator[Hypothesis]:
    """Mistakes of the data without a fitted number, the likeliest first."""
    top, (omega, gamma) = run.top, (run.start.omega, run.start.gamma)
    k = top.rotor or (Fraction(0),) * 3
    inertia_unit = run.units.inertia
    momentum = State([(w / inertia_unit - r) / i for w, i, r in zip(omega, top.inertia, k, strict=True)], gamma)
    for kind, other in (
        ("no_gravity", {"top": replace(top, weight=Fraction(0))}),
        ("weight_sign", {"top": replace(top, weight=-top.weight)}),
        ("start_gamma_sign", {"start": State(omega, [-g for g in gamma])}),
        ("start_omega_sign", {"start": State([-w for w in omega], gamma)}),
        ("start_momentum", {"start": momentum}),
    ):
        supposed = replace(run, **other)
        if (supposed.top.moment, supposed.start) != (top.moment, run.start):
            yield Hypothesis(kind, {}, supposed.motion_errors())
    if inertia_unit <= _LARGEST_UNIT:
        momenta = _restated(run, momentum, lambda omega: float(inertia_unit) * (omega @ run.tensor + run.in_file(k)))
        yield Hypothesis("all_momentum", {}, momenta)
    for unit, factor in UNITS_OF_OMEGA.items():
        yield Hypothesis(f"all_in_{unit}", {}, _all_times(run, factor))
    without = top if top.rotor is None else replace(top, rotor=None)
    other_system = GYROSTAT if run.system is HEAVY_TOP else HEAVY_TOP
    yield Hypothesis("system", {}, replace(run, system=other_system, top=without).motion_errors())
    if any(k):
        turned = HeavyTop(top.inertia, top.weight, top.centre, [-part for part in k])
        yield Hypothesis("rotor_sign", {}, replace(run, top=turned).motion_errors())
    unchanged = run.tensor, run.in_file(top.centre), run.in_file(k)
    for kind, numbers, *body in other_axes(*unchanged):
        if not all(map(numpy.array_equal, body, unchanged)):
            supposed = run.with_body(body[0], float(top.weight) * body[1], body[2])
            yield Hypothesis(kind, numbers, supposed.motion_errors())


def other_axes(tensor: Array, centre: Array, rotor: Array) -> Iterator[tuple[str, dict[str, str], Array, Array, Array]]:
    """Kind, numbers, tensor, centre and rotor: their axes in another order, and other signs of the centre."""
    for order in list(permutations(range(3)))[1:]:
        places, numbers = list(order), {"axes": "".join(str(i + 1) for i in order)}
        turned = tensor[numpy.ix_(places, places)]
        yield "inertia_axes", numbers, turned, centre, rotor
        yield "centre_axes", numbers, tensor, centre[places], rotor
        yield "top_axes", numbers, turned, centre[places], rotor[places]
    for signs in list(product((1, -1), repeat=3))[1:-1]:
        texts = (_text(plain_number(value, 1e-15 * abs(value))) for value in centre * signs)
        yield "centre_signs", {"centre": ", ".join(texts)}, tensor, centre * signs, rotor


def _restated(run: Examined, start: State, omega: Callable[[Array], Array]) -> Array:
    """The error with another start, and states that give another quantity in place of Ω."""
    truth = replace(run, start=start).simulated(run.times)
    return run.errors(None if truth is None else numpy.hstack([omega(truth[:, :3]), truth[:, 3:]]))


def _all_times(run: Examined, factor: float) -> Array:
    """The error where start and states give Ω times ``factor``."""
    start = State([w / Fraction(factor) for w in run.start.omega], run.start.gamma)
    return _restated(run, start, lambda omega: omega * factor)


def all_scaled(run: Examined) -> Iterator[Hypothesis]:
    """A constant factor of Ω in start and states: its square is that of the weight that the energy asks for."""
    square = _weight_ratio(run)
    if square is None or square <= 0:
        return
    fitted = square**0.5
    left = float(_all_times(run, fitted).max())
    factor = plain_number(fitted, _MARGIN * max(left, FLOOR) * fitted)
    if factor and notable(factor, Fraction(1)):
        numbers = {"factor": decimal_text(factor, 8)}
        yield Hypothesis("all_scaled", numbers, _all_times(run, float(factor)), FITTED_DROP)


def _weight_ratio(run: Examined) -> float | None:
    """P over the given one, from the energy: ½ Ω·M changes by what P r·γ loses.  None where neither changes."""
    if not run.is_whole:
        return None
    tensor, start = run.tensor, run.in_file(run.start.flat)
    omega = run.states[:, :3]
    kinetic = 0.5 * (numpy.einsum("ni,ij,nj->n", omega, tensor, omega) - start[:3] @ tensor @ start[:3])
    height = (run.states[:, 3:6] - start[3:]) @ run.in_file(run.top.moment)
    square = float(height @ height)
    ratio = -float(kinetic @ height) / square if square else float("nan")
    return ratio if isfinite(ratio) else None


def another_weight(run: Examined) -> Iterator[Hypothesis]:
    """Another P, from the energy."""
    ratio, old = _weight_ratio(run), run.top.weight
    if ratio is None or not isfinite(ratio * float(old)):
        return
    weights = [plain_number(ratio * float(old), near * abs(float(old))) for near in _NEAR]
    tops = [(other, replace(run.top, weight=other)) for other in weights]
    weight, errors = _roundest([(other, replace(run, top=top).motion_errors()) for other, top in tops])
    if notable(weight, old):
        yield Hypothesis("weight", {"P": _text(weight * run.units.moment)}, errors, FITTED_DROP)


def another_start(run: Examined) -> Iterator[Hypothesis]:
    """The start from the first sample, carried back to t = 0, and checked on samples that are much later.

    The error must fall by more than the motion amplifies it from the start to the first sample: where neighbouring
    motions diverge quickly, the errors of a method look like those of a start.
    """
    times = run.times
    if len(times) < 3 or not times[0] or abs(times[-1]) < _LATER * abs(times[0]) or numpy.isnan(run.states[0]).any():
        return
    back = run.starting(run.states[0]).simulated([-times[0]])
    truth = run.simulated(times[:1])
    if back is None or truth is None:
        return
    # a motion that magnifies the errors of a method may look like one from another start
    early, late = run.at(run.rows[:1]).errors(truth), run.errors(run.simulated(times))
    if early.max() < _AT_ONCE * late.max():
        return
    start = run.in_file(run.start.flat)
    errors = run.starting(back[0]).motion_errors()
    off = numpy.abs(back[0, :6] - start)
    magnified = float(numpy.abs(run.states[0] - truth[0]).max() / (off.max() or 1.0))
    sizes = [max(run.rate, numpy.abs(back[0, :3]).max())] * 3 + [1.0] * 3
    units = [run.units.time] * 3 + [Fraction(1)] * 3
    noise = _MARGIN * max(float(errors.max()), 1e-12)
    changed = [
        (name, plain_number(float(value), noise * size), unit, change > _BIAS * size, noise * size)
        for name, value, change, size, unit in zip(NAMES, back[0], off, sizes, units, strict=False)
        if change > noise * size
    ]

    def is_round(new: Fraction, near: float) -> bool:
        """Whether a number is a short decimal, as none is by accident that is known within ``near``."""
        return new == Fraction(decimal_text(new, SHORT)) and near <= _SPARSE * 10.0**-SHORT * abs(float(new))

    # a method of low order carries an error of its first step along as another start
    if any(large or is_round(new, near) for _, new, _, large, near in changed):
        numbers = {name: _text(new / unit) for name, new, unit, *_ in changed}
        yield Hypothesis("start", numbers, errors, FITTED_DROP * max(1.0, magnified))


def another_top(run: Examined) -> Iterator[Hypothesis]:
    """The moments and n = P r, up to a common factor, that keep both integrals from the start to every sample."""
    entries = _PRODUCTS if _is_full(run) else _PRODUCTS[:3]
    direction = _conserving(run, entries) if run.system is HEAVY_TOP and len(run.rows) >= 3 else None
    before = [Fraction(run.tensor[entry]) for entry in entries] + [*map(Fraction, run.in_file(run.top.moment))]
    if direction is None or not (direction * floats(before)).any():
        return
    scaled = [_scaled(direction, before, near) for near in _NEAR]
    tried = [(numbers, _with(run, numbers[:-3], numbers[-3:])) for numbers in scaled]
    numbers, errors = _roundest(tried)
    units = [run.units.inertia] * len(numbers[3:]) + [run.units.moment] * 3
    names = [f"I{i + 1}{j + 1}" if _is_full(run) else f"I{i + 1}" for i, j in entries] + ["P a", "P b", "P c"]
    entries_of = zip(names, before, numbers, units, strict=True)
    changed = {name: _text(new * unit) for name, old, new, unit in entries_of if new != old}
    told = any(notable(new, old) for old, new in zip(before, numbers, strict=True) if new != old)
    if told and len(changed) <= _MOST_CHANGED:
        yield Hypothesis("top", changed, errors, FITTED_DROP)


_PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Entries of a tensor: three of a diagonal one."""


def _is_full(run: Examined) -> bool:
    return bool((run.frame.axes != numpy.eye(3)).any())


def _conserving(run: Examined, entries: Sequence[tuple[int, int]]) -> Array | None:
    """The only direction of (I, n) in which M·γ and the energy are constant; None unless there is exactly one."""
    if not run.is_whole:
        return None
    start = run.in_file(run.start.flat)

    def products(one: Array, other: Array) -> Array:
        products = [one[..., i] * other[..., j] + (one[..., j] * other[..., i] if i != j else 0) for i, j in entries]
        return numpy.stack(products, axis=-1)

    omega, gamma = run.states[:, :3], run.states[:, 3:6]
    area = products(omega, gamma) - products(start[:3], start[3:])
    turning = 0.5 * (products(omega, omega) - products(start[:3], start[:3]))
    energy = numpy.hstack([turning, gamma - start[3:]])
    size = run.rate or 1.0
    units = numpy.array([size**2] * len(entries) + [1.0] * 3)
    rows = numpy.vstack([numpy.hstack([area * size, numpy.zeros_like(gamma)]), energy]) / units
    if not numpy.isfinite(rows).all():
        return None
    _, values, directions = numpy.linalg.svd(rows)
    if len(values) < len(units) or values[-1] > _SINGULAR * values[-2]:
        return None
    direction: Array = directions[-1] / units
    return direction


def _scaled(direction: Array, before: Sequence[Fraction], near: float) -> list[Fraction]:
    """The direction with the factor that leaves most numbers unchanged, within ``near`` of the largest."""
    old = floats(before)
    largest = [numpy.abs(old[:-3]).max(), numpy.abs(old[-3:]).max() or numpy.abs(old[:-3]).max()]
    sizes = numpy.repeat(largest, [len(old) - 3, 3])
    factors = [o / d for o, d in zip(old, direction, strict=True) if o and d]
    scaled = max((direction * f for f in factors), key=lambda new: int((numpy.abs(new - old) <= near * sizes).sum()))
    return [
        o if abs(value - float(o)) <= near * size else plain_number(float(value), near * size)
        for value, o, size in zip(scaled, before, sizes, strict=True)
    ]


def _with(run: Examined, inertia: Sequence[Fraction], moment: Sequence[Fraction]) -> Array:
    """The error with those entries of the tensor, and P r."""
    tensor = numpy.zeros((3, 3))
    for (i, j), value in zip(_PRODUCTS, floats(inertia), strict=False):
        tensor[i, j] = tensor[j, i] = value
    try:
        return run.with_body(tensor, floats(moment)).motion_errors()
    except InputError:  # a moment that is not positive
        return run.errors(None)


_Numbers = TypeVar("_Numbers")


def _roundest(tried: Sequence[tuple[_Numbers, Array]]) -> tuple[_Numbers, Array]:
    """The first, most rounded of these whose error is about the smallest."""
    best = min(errors.max() for _, errors in tried)
    return next(pair for pair in tried if pair[1].max() <= ALIKE * best)


def _text(value: Fraction) -> str:
    """A short decimal, a small fraction, or eight digits."""
    decimal = decimal_text(value, SHORT + 2)
    if Fraction(decimal) == value or value.denominator > SMALL:
        return decimal if Fraction(decimal) == value else decimal_text(value, 8)
    return str(value)


# States of other equations, in axes of space, or with columns in any order.
#
# These are tried after everything simpler.


_ANOTHER_MOTION = 0.03
"""Relative errors below it are not those of another field."""
_CYCLIC = (1, 2), (2, 0), (0, 1)
_GYROSCOPIC, _TORQUE, _RATE, _GAMMA = (0,), (1, 2), (3,), (4, 5)
"""Rows of the weights: (M + k) × Ω, both products of each component of γ × n, Ω', both products of γ × Ω."""
_PLAIN = numpy.concatenate([numpy.zeros(3), numpy.eye(3).reshape(-1), numpy.ones(18)])
"""No rotor, principal axes, and the equations as they are."""


@dataclass(frozen=True, slots=True)
class _Weighted(System):
    """Equations of a heavy gyrostat with a weight at each term, in the axes of a file.

    numbers: k of the rotor, the rows of A with v_file = A v_principal, six rows of weights; they enter the compiled
    code, which is one for all of them, as a rotor does: systems that differ in them alone are equal.
    """

    enters: tuple[str, ...] = HEAVY_GYROSTAT.enters
    numbers: tuple[float, ...] = field(default=(), compare=False)

    def parameters(self, top: HeavyTop, start: State) -> Parameters:
        """Moments, n and the numbers."""
        return Parameters(top.inertia, top.moment, self.numbers)

    def entering(self, p: Parameters) -> tuple[Any, ...]:
        """Moments, n and the numbers; those of the plain equations where the parameters have none."""
        return (*p.inertia, *p.moment, *_numbers_of(p))


def _numbers_of(p: Parameters) -> Sequence[Any]:
    return p.rotor if isinstance(p.rotor, tuple) else [Fraction(number) for number in _PLAIN.tolist()]


def _weighted(p: Parameters, y: Sequence[Any]) -> tuple[Any, ...]:
    """(Ω', γ') with the weights of :class:`_Weighted`."""
    rotor, first, second, third, gyroscopic, *weights = (_numbers_of(p)[i : i + 3] for i in range(0, 30, 3))
    axes = first, second, third
    momentum = [i * rate + k for i, rate, k in zip(p.inertia, y[:3], rotor, strict=True)]
    omega, gamma, n, whirl = (rotated(axes, v) for v in (y[:3], y[3:6], p.moment, cross(momentum, y[:3])))

    def product(vector: Sequence[Any], left: Sequence[Any], right: Sequence[Any]) -> list[Any]:
        """γ × ``vector``, each of whose two terms has its weight."""
        return [
            a * (gamma[j] * vector[k]) - b * (gamma[k] * vector[j])
            for (j, k), a, b in zip(_CYCLIC, left, right, strict=True)
        ]

    torque = product(n, weights[0], weights[1])
    change = [w * part + own for w, part, own in zip(gyroscopic, whirl, torque, strict=True)]
    rates = [part / i for part, i in zip(rotated(transposed(axes), change), p.inertia, strict=True)]
    rates = [w * part for w, part in zip(weights[2], rotated(axes, rates), strict=True)]
    return (*rotated(transposed(axes), rates), *rotated(transposed(axes), product(omega, weights[3], weights[4])))


def _terms(run: Examined) -> Iterator[Hypothesis]:
    """One equation with the other sign; one term of an equation with the other sign, or left out."""
    for index, name in enumerate(NAMES):
        yield _of_field(run, "component_sign", {"column": name}, _RATE if index < 3 else _GAMMA, [index % 3])
    letters = "abc"
    for (vector, rows, text), i in product(_TERMS, range(3)):
        j, k = _CYCLIC[i]
        numbers = {"column": f"{vector}{i + 1}", "term": text.format(j + 1, k + 1, letters[j], letters[k])}
        for kind, weight in (("term_missing", 0.0), ("term_sign", -1.0)):
            yield _of_field(run, kind, numbers, rows, [i], weight)


_TERMS = (
    ("M", _GYROSCOPIC, "the gyroscopic term"),
    ("M", _TORQUE, "the torque of gravity"),
    ("M", _TORQUE[:1], "γ{0} P {3}"),
    ("M", _TORQUE[1:], "γ{1} P {2}"),
    ("γ", _GAMMA[:1], "γ{0} Ω{1}"),
    ("γ", _GAMMA[1:], "γ{1} Ω{0}"),
)
"""Each term: the vector whose derivative it enters, its rows of weights, and its text from the two other axes."""
_SIGNS = {
    "kinematic_sign": (_GAMMA, -1.0),
    "gyroscopic_sign": (_GYROSCOPIC, -1.0),
    "both_signs": ((*_GYROSCOPIC, *_GAMMA), -1.0),
    "gyroscopic_missing": (_GYROSCOPIC, 0.0),
}
"""Rows of the weights of whole equations, and their weight."""


def _of_field(
    run: Examined,
    kind: str,
    numbers: dict[str, str],
    rows: Sequence[int],
    components: Sequence[int] = (0, 1, 2),
    weight: float = -1.0,
) -> Hypothesis:
    """The hypothesis of equations in which these components of these terms have that weight."""
    weights = numpy.ones((6, 3))
    weights[numpy.ix_(rows, components)] = weight
    rotor = floats(run.top.rotor or (Fraction(0),) * 3)
    values = numpy.concatenate([rotor, run.frame.axes.reshape(-1), weights.reshape(-1)]).tolist()
    system = _Weighted("weighted_heavy_gyrostat", _weighted, HEAVY_TOP.angular_velocity, numbers=tuple(values))
    return Hypothesis(kind, numbers, replace(run, system=system).motion_errors(), FITTED_DROP)


def of_equations(run: Examined, truth: Array) -> Iterator[Hypothesis]:
    """Other equations, axes and orders; one equation or one term that is wrong only where nothing else fits."""
    hypotheses = [*constant_column(run, truth)]
    if len(run.frame.columns) == 6:
        hypotheses += [*_any_order(run, truth), *_axes_of_space(run, truth)]
    error = float(run.errors(truth).max())
    if run.system in WITH_ATTITUDE:
        hypotheses += [_of_field(run, kind, {}, rows, weight=weight) for kind, (rows, weight) in _SIGNS.items()]
    yield from hypotheses
    nothing = all(hypothesis.left() * FITTED_DROP > error for hypothesis in hypotheses)
    if run.system in WITH_ATTITUDE and error > _ANOTHER_MOTION and nothing:
        yield from _terms(run)


def _axes_of_space(run: Examined, truth: Array) -> Iterator[Hypothesis]:
    """Ω, or Ω and γ, in axes fixed in space, one of which is vertical: |Ω| and the vertical part Ω·γ tell."""
    omega, gamma, truth = run.states[:, :3], run.states[:, 3:6], truth[:, :6]
    size = max(numpy.abs(truth[:, :3]).max(), 1e-3 * run.rate)
    length = numpy.abs(numpy.linalg.norm(omega, axis=1) - numpy.linalg.norm(truth[:, :3], axis=1)) / size
    vertical = (truth[:, :3] * truth[:, 3:]).sum(axis=1)
    for axis in range(3):
        up = numpy.eye(3)[axis]
        part = numpy.abs(omega[:, axis] - vertical) / size
        for what, expected in (("omega", truth[:, 3:]), ("both", up)):
            errors = numpy.maximum.reduce([length, part, numpy.abs(gamma - expected).max(axis=1)])
            numbers = {"of": what, "vertical": str(axis + 1)}
            yield Hypothesis("axes_of_space", numbers, errors, FITTED_DROP)


def _any_order(run: Examined, truth: Array) -> Iterator[Hypothesis]:
    """Each column as the component, or its negative, to which it is nearest."""
    unit = float(run.units.time)
    of_file = numpy.repeat([unit, 1.0], 3)
    truth, states = truth[:, :6] / of_file, run.states[:, :6] / of_file
    sizes = numpy.repeat([max(numpy.abs(truth[:, :3]).max(), 1e-3 * run.rate / unit), numpy.abs(truth[:, 3:]).max()], 3)
    both = numpy.hstack([truth, -truth]) / numpy.tile(sizes, 2)
    off = numpy.abs(states[:, :, None] / numpy.tile(sizes, 2) - both[:, None, :])
    nearest = off.max(axis=0).argmin(axis=1)
    if sorted(nearest % 6) == list(range(6)):
        names = ", ".join(("−" if index >= 6 else "") + NAMES[index % 6] for index in nearest)
        yield Hypothesis("column_order", {"columns": names}, off[:, range(6), nearest].max(axis=1), FITTED_DROP)


# Other times: reversed, shifted, in another unit, or off by a row.


_GRID = 1500
_WITHIN = 0.3
"""A time of the grid is tried if the first state is so near to the motion there, relative to its size."""
_TRIED = 12
_REFINED = 6
_NOISE = 1e-6
"""Relative size of singular values that are rounding of difference quotients."""
_FALLS = 1.5
"""Factor by which the sum of squares falls while a number is refined."""
_SPAN = Fraction(1, 10)
"""The samples must spread over this part of their time: the lag of an integrator grows with time and is not a shift."""
_NEAR_ONE = 0.05
"""A smaller error of a clock may be the lag of an integrator, unless the factor is a short decimal."""
_SHORT = 3
_EXACTLY = 1e-9
_MOST_STEPS = 300
"""Most steps of an interval between samples of which one too many or too few is recognised."""
TIME_UNITS = {*map(Fraction, (60, 1000, 3600)), *(Fraction(1, n) for n in (60, 3600, 10**3, 10**6, 10**9))}
_FEWEST_ROWS = 3
_CIRCLE = (2 * numpy.pi, 1 / (2 * numpy.pi), numpy.pi / 180, 180 / numpy.pi)


def clock(run: Examined) -> Iterator[Hypothesis]:
    """Mistakes of the times without a number that is fitted.

    times_shifted by s: the state said to be at t is that of t + s.  time_unit with the factor f: it is that of f·t.
    """
    yield from _of_rows(run)
    for factor in sorted(TIME_UNITS | {Fraction(value) for value in _CIRCLE}):
        if abs(float(factor * run.times[-1])) * run.rate <= FARTHEST:
            errors = run.motion_errors([factor * time for time in run.times])
            yield Hypothesis("time_unit", _unit_numbers(float(factor)), errors)


def _unit_numbers(factor: float) -> dict[str, str]:
    steps = _steps_of_interval(factor)
    return {"factor": f"{factor:.6g}"} | ({} if steps is None else {"steps": str(steps)})


def _of_rows(run: Examined) -> Iterator[Hypothesis]:
    """Rows that belong to other times."""
    every = run.all_times
    yield Hypothesis("time_reversed", {}, run.motion_errors([-time for time in run.times]))
    if len(every) == 1:
        return
    late = [every[row - 1] if row else Fraction(0) for row in run.rows]
    yield Hypothesis("start_row_missing", {}, run.motion_errors(late))
    yield Hypothesis("rows_reversed", {}, run.motion_errors([every[-1 - row] for row in run.rows]))
    yield from _neighbours(run, "rows_off_by_one", (*every[1:], 2 * every[-1] - every[-2]))
    yield from _neighbours(run, "rows_late", (2 * every[0] - every[1], *every[:-1]))


def _neighbours(run: Examined, kind: str, times: Sequence[Fraction]) -> Iterator[Hypothesis]:
    """The states of other ``times``; also without the row at an end whose time is no sample's, where enough rows remain
    and their error is about that of all.
    """
    yield Hypothesis(kind, {}, run.motion_errors([times[row] for row in run.rows]))
    fewer = run.at([row for row in run.rows if times[row] in run.all_times])
    if _FEWEST_ROWS <= len(fewer.rows) < len(run.rows):
        wrong, wrong_of_all = (samples.errors(samples.simulated(samples.times)).max() for samples in (fewer, run))
        if ALIKE * wrong >= wrong_of_all:
            yield Hypothesis(kind, {}, fewer.motion_errors([times[row] for row in fewer.rows]))


def fitted_clock(run: Examined) -> Iterator[Hypothesis]:
    """Shifts and units that bring the first states onto the motion, refined over all samples."""
    times = numpy.array([float(time) for time in run.times])
    if len(times) < 3 or abs(times[-1] - times[0]) < _SPAN * abs(times[0]):
        return
    reach = min(1.5 * abs(times[-1]) + 6 / run.rate, FARTHEST / run.rate)
    grid = numpy.linspace(-reach, reach, _GRID)
    orbit = run.simulated([Fraction(value) for value in grid])
    if orbit is None:
        return
    sizes = numpy.array([max(orbit[:, :3].max(), -orbit[:, :3].min()) or 1.0] * 3 + [1.0] * (orbit.shape[1] - 3))
    # a method's own lag explains the samples of an oscillation as well as any clock
    slower = list(_refined(run, "time_unit", 1.0, times, sizes))
    lag = min((errors.max() for factor, errors in slower if abs(factor - 1) < _NEAR_ONE), default=numpy.inf)
    for factor, errors in slower:
        if abs(factor - 1) >= _NEAR_ONE or _is_short(factor):
            yield Hypothesis("time_unit", _unit_numbers(factor), errors, FITTED_DROP)
    for kind in ("times_shifted", "time_unit"):
        # a shift is the same for every sample, and of a periodic motion the smallest; a unit shows best at the earliest
        # sample away from 0
        tried = [(-1.0, 0.0)] if kind == "times_shifted" else []
        for row in _near(orbit / sizes, run.states[0] / sizes):
            number = grid[row] - times[0] if kind == "times_shifted" else grid[row] / times[0] if times[0] else 1.0
            supposed = numpy.interp(_moved(kind, number, times), grid, numpy.arange(_GRID))
            off = numpy.abs(orbit[numpy.rint(supposed).astype(int)] - run.states) / sizes
            tried.append((float(numpy.median(numpy.fmax.reduce(off, axis=1))), number))
        for _, first in sorted(tried)[: _TRIED // 3]:
            for number, errors in _refined(run, kind, first, times, sizes):
                near_one = kind == "time_unit" and abs(number - 1) < _NEAR_ONE
                if _is_short(number) if near_one else ALIKE * errors.max() < lag:
                    shift = {"shift": in_units(number, run.units.time)}
                    numbers = _unit_numbers(number) if kind == "time_unit" else shift
                    yield Hypothesis(kind, numbers, errors, FITTED_DROP)


def _steps_of_interval(factor: float) -> int | None:
    """n where the factor is (n + 1)/n, as of intervals of n steps that are one too long; −n where it is (n − 1)/n."""
    n = round(1 / (factor - 1)) if abs(factor - 1) > 1 / (2 * _MOST_STEPS) else 0
    return n if 1 < abs(n) <= _MOST_STEPS and abs(factor - 1 - 1 / n) < _EXACTLY else None


def _is_short(factor: float) -> bool:
    """Whether the factor, or its inverse, has three digits or is off 1 by a step, as no lag of an integrator is."""
    if _steps_of_interval(factor) is not None:
        return True
    near = [Fraction(decimal_text(Fraction(value), _SHORT)) for value in (factor, 1 / factor)]
    return any(
        one != 1 and abs(one / Fraction(value) - 1) < _EXACTLY
        for one, value in zip(near, (factor, 1 / factor), strict=True)
    )


def _near(orbit: Array, state: Array) -> list[int]:
    """Indices of the grid where the orbit comes nearest to a state, the nearest first."""
    far = numpy.fmax.reduce(numpy.abs(orbit - state), axis=1)
    lower = (far <= numpy.roll(far, 1)) & (far <= numpy.roll(far, -1)) & (far < _WITHIN)
    places = numpy.flatnonzero(lower)
    return [int(row) for row in places[numpy.argsort(far[places])][:_TRIED]]


def _moved(kind: str, number: float, times: Array) -> Array:
    return times + number if kind == "times_shifted" else times * number


def _refined(run: Examined, kind: str, number: float, times: Array, sizes: Array) -> Iterator[tuple[float, Array]]:
    """The number that fits best, with the errors that remain; none where the motion is not known there."""

    def off(x: Array) -> Array:
        at = _moved(kind, x[0], times)
        known = run.simulated([*map(Fraction, at)]) if numpy.isfinite(at).all() else None
        return numpy.full(1, numpy.inf) if known is None else numpy.nan_to_num((known - run.states) / sizes).reshape(-1)

    small = 1e-6 / run.rate / (1.0 if kind == "times_shifted" else abs(times).max())
    x, here = gauss_newton(off, numpy.array([number]), small, _REFINED)
    if numpy.isfinite(here).all():
        yield float(x[0]), run.motion_errors([Fraction(value) for value in _moved(kind, x[0], times)])


def gauss_newton(off: Callable[[Array], Array], x: Array, slight: float, most: int) -> tuple[Array, Array]:
    """Numbers and residuals ``off`` after at most so many Gauss-Newton steps, each of which reduces the sum of squares.

    slight: the step of a difference quotient.
    """
    here = off(x)
    for _ in range(most):
        slopes = [(off(x + slight * unit) - here) / slight for unit in numpy.eye(len(x))]
        if not all(numpy.isfinite(part).all() for part in (here, *slopes)):
            break
        step = numpy.linalg.lstsq(numpy.stack(slopes, axis=1), here, rcond=_NOISE)[0]
        tried = ((after := x - part * step, off(after)) for part in _PARTS)
        after, there = next((pair for pair in tried if float(pair[1] @ pair[1]) < float(here @ here)), (x, here))
        if there is here:
            break
        falls, x, here = float(here @ here) > _FALLS * float(there @ there), after, there
        if not falls:
            break  # at the minimum
    return x, here
