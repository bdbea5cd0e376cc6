"""Mistakes of convention and of data in files of any columns, each told by trying it.

A supposition is a reading of the columns, of the start, or of both, or other data of the body: the motion that follows
from it is computed and compared with the columns.  It is told if the error falls by two decades, by three where a
number was fitted; where several do about as well the simplest is told, and the others are named beside it.  The first
samples are judged by themselves as well, and where nothing does better a fall by a factor of 30 makes it likely.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from itertools import combinations, permutations, product
from typing import Any

import numpy

from heavytop.features.score.diagnose.hypotheses import UNITS_OF_OMEGA, gauss_newton, other_axes
from heavytop.features.score.diagnose.readings import (
    Beginning,
    BodyData,
    Course,
    Reading,
    Seen,
    Square,
    errors,
    nearest_rotation,
    rates_off,
    residuals,
    simulate,
    turning,
)
from heavytop.features.score.diagnose.samples import FARTHEST, looked_at, named, notable, principal, refused
from heavytop.features.score.diagnose.search import (
    AS_LIKELY,
    DROP,
    FIRST,
    FITTED_DROP,
    LIKELY_DROP,
    WORTH_ASKING,
    Array,
    Diagnosis,
    Hypothesis,
    Search,
    scope,
)
from heavytop.measure.attitude_error import FORMS
from heavytop.precision import decimal_text
from heavytop.top.attitude import SEQUENCES

_NEIGHBOURS = 60
"""Samples whose attitudes are compared with Ω."""
_TWO_MISTAKES = 0.05
"""Relative errors below it are not those of two mistakes of convention at once."""
_CONTRADICTS = 0.1
"""Ω that is off the rate of the attitude by less, relative to it, may be as right as the method."""
_REFINED = 8
_FEWEST = 4
"""Samples to which the six numbers of a start, or one of the body, are fitted."""
_SLIGHT = 1e-6
"""Of a number relative to its size, in a difference quotient."""
_ROUND = 3
"""Digits of a factor that no method's own error has by accident."""
_START_DROP = 1e5
"""How far the error must fall for a start, whose six numbers may also carry the errors of first steps."""
Row = tuple[str, dict[str, str], dict[str, Any]]
"""A mistake: its kind, numbers, and what is supposed, as in :meth:`Suppositions.errors_if`; ``drop``, ``is_round``."""
_FITTED = {"drop": FITTED_DROP}
_SAME = 1e-9
"""A rotation that was fitted is a renaming of the axes within that."""
_LENGTHS = {"1000": 1e3, "100": 1e2, "1/1000": 1e-3, "1/100": 1e-2, "1/0.3048": 1 / 0.3048, "0.3048": 0.3048}
_STANDARD = ("9.8", "9.80665", "9.81", "10")
"""Values of g that one who writes another of them may have meant."""
_GRAVITIES = {
    "9.81": 9.81,
    "9.80665": 9.80665,
    "1/9.81": 1 / 9.81,
    "1/9.80665": 1 / 9.80665,
    **_LENGTHS,
}
_INERTIAS = {f"1e{power}": 10.0**power for power in (-9, -7, -6, -4, -3, -2, 2, 3, 4, 6, 7, 9)}

BOTH, COLUMNS, START, DATA, RATES = "start and columns", "columns", "start", "data", "rates"


class Suppositions(Search):
    """Mistakes that a file may have, and the error of each of its samples with them.

    step: of the method, where the file says it.
    """

    names_others = True

    def __init__(self, seen: Seen, step: Fraction | None = None) -> None:
        self.step, self.start = step, seen.start.begin(seen.said, seen.body.tensor)
        rate = turning(seen.body, self.start)
        times = list(map(float, seen.times))
        rows = looked_at(times, rate)
        within_reach = [row for row in rows if abs(times[row]) * rate <= FARTHEST]
        self.reaches = bool(within_reach)
        self.every, self.seen = seen, seen.at(within_reach or rows[:1])
        self.times, self.states = self.seen.times, len(seen.times)
        first = FIRST[-1] + (not self.times[0])
        self.early = self.seen.at(list(range(min(len(self.times), first))))
        self.own = self.errors_if(self.seen)

    def hypotheses(self) -> Iterator[Hypothesis]:
        """The simplest first, those with a fitted number last; none of a file whose samples are all out of reach."""
        return map(self._tried, _suppositions(self) if self.reaches else ())

    def further(self, diagnosis: Diagnosis | None, own: float) -> Iterator[Hypothesis]:
        """Two readings at once."""
        if self.reaches and diagnosis is None and own > _TWO_MISTAKES and _forms(self.seen) & set(FORMS):
            yield from map(self._tried, _pairs(self.seen))

    def of_start(self) -> Diagnosis | None:
        """Another start: with its six numbers it also follows what is only early or late, and is tried last."""
        own = float(self.own.max())
        if not self.reaches or not WORTH_ASKING < own < numpy.inf or len(self.own) < _FEWEST:
            return None
        return self.best([*map(self._tried, _start(self))], own)

    def of_rates(self) -> Diagnosis | None:
        """The simplest reading of the columns in which Ω is the rate of the attitude; it needs no motion."""
        seen = self.every.at(list(range(min(_NEIGHBOURS, len(self.every.times)))))
        off = rates_off(seen, seen.said)
        if off is None or not _CONTRADICTS < (own := float(off.max())) < numpy.inf:
            return None
        readings = [(name, numbers, rates_off(seen, reading)) for name, numbers, reading in _readings(seen)]
        left, kind, numbers = min(
            ((float(off.max()), kind, numbers) for kind, numbers, off in readings if off is not None),
            key=lambda entry: entry[0],
            default=(own, "", {}),
        )
        looked = scope(seen.times, self.states)
        return Diagnosis(kind, {**numbers, "of": RATES}, own, left, looked) if left * DROP <= own else None

    @cached_property
    def refused(self) -> float:
        """The error of the first samples beyond which a motion explains nothing."""
        rates = [
            [v for name, v in seen.columns.items() if name.startswith("omega")] for seen in (self.early, self.seen)
        ]
        early, largest = (max((float(numpy.abs(values).max()) for values in part), default=1.0) for part in rates)
        return refused(early, largest, float(self.own.max()))

    def _tried(self, row: Row) -> Hypothesis:
        """The hypothesis; of a motion that has to be computed, errors behind first ones that refuse it are infinite."""
        kind, numbers, supposed = row
        judged = {name: supposed[name] for name in ("drop", "is_round") if name in supposed}
        supposed = {name: value for name, value in supposed.items() if name not in judged}
        left = self.errors_if(self.early, **supposed)
        if supposed.keys() & {"start", "body", "shift", "begin"} and not float(left.max()) <= self.refused:
            left = numpy.append(left, numpy.full(len(self.own) - len(left), numpy.inf))
        else:
            left = self.errors_if(self.seen, **supposed)
        return Hypothesis(kind, {"of": DATA, **numbers}, left, **judged)

    def course(
        self,
        seen: Seen,
        start: Reading | None = None,
        body: BodyData | None = None,
        shift: Fraction = Fraction(0),
        begin: Beginning | None = None,
    ) -> Course | None:
        """The motion of the file with another reading of its start, another body, other times, another start."""
        body = body or seen.body
        begin = begin or seen.start.begin(start or seen.said, body.tensor)
        return simulate(body, begin, tuple(float(time + shift if shift else time) for time in seen.times))

    def errors_if(
        self,
        seen: Seen,
        columns: Reading | None = None,
        body: BodyData | None = None,
        rates: bool = False,
        still: bool = False,
        mixed: tuple[str, Array] | None = None,
        **supposed: Any,
    ) -> Array:
        """The error of each sample where columns and start are read so, or the body is another.

        shift: the columns are those of t + shift; of Ω alone where ``rates``.  still: Ω is not looked at.
        mixed: a quantity, and the matrix by which the rows of its columns are to be multiplied.
        begin: of the motion.
        """
        course, plain = self.course(seen, body=body, **supposed), self.course(seen) if rates else None
        if body is not None and seen.point is seen.body.centre:
            seen = replace(seen, point=body.centre)
        if course is not None and plain is not None:
            in_body = numpy.einsum("nji,nj->ni", plain.rotation, course.omega_space)
            course = Course(plain.rotation, in_body if "omega_space" in seen.columns else course.omega)
        if still:
            seen = replace(seen, columns={k: v for k, v in seen.columns.items() if not k.startswith("omega")})
        if mixed is not None:
            name, matrix = mixed
            seen = replace(seen, columns={**seen.columns, name: seen.columns[name] @ matrix})
        return errors(seen, course, columns or seen.said, body or seen.body)


def _suppositions(suppositions: Suppositions) -> Iterator[Row]:
    """The simplest first, those with a fitted number last."""
    seen = suppositions.seen
    for kind, numbers, reading in _readings(seen):
        yield from _scopes(seen, kind, numbers, reading)
    # before the axis that points up: where both fit, the third axis points down
    for kind, numbers, body in _bodies(seen):
        yield kind, numbers, {"body": body}
        if kind == "gravity_sign":
            for other, more, reading in _axes_of_space(seen):
                yield from _scopes(seen, other, more, reading)
    yield from _steps(suppositions)
    yield from _positions(seen)
    yield from _renamed(seen)
    yield from _columns(seen)
    course = suppositions.course(seen)
    if course is not None:
        yield from _fitted(seen, course)
        yield from _early_rates(suppositions)
        yield from _data(suppositions)


def _steps(suppositions: Suppositions) -> Iterator[Row]:
    """All columns, or Ω alone, half a step or a step of the method early or late; Ω that is 0 throughout."""
    rates = {name: values for name, values in suppositions.seen.columns.items() if name.startswith("omega")}
    has_more = bool(rates) and len(suppositions.seen.columns) > len(rates)
    if has_more and not any(values.any() for values in rates.values()):
        yield "omega_zero", {}, {"still": True}
    for part, sign in product((Fraction(1, 2), Fraction(1)), (-1, 1)) if suppositions.step else ():
        shift = sign * part * (suppositions.step or 0)
        yield "times_shifted", {"shift": _signed(shift)}, {"shift": shift}
        if has_more:
            text = f"{'half a step' if part < 1 else 'one step'} {'early' if sign < 0 else 'late'}"
            yield "omega_shifted", {"shift": _signed(shift), "steps": text}, {"shift": shift, "rates": True}


_WORDS = {
    "omega": ("Ω1", "Ω2", "Ω3"),
    "omega_space": ("Ω1", "Ω2", "Ω3"),
    "gamma": ("γ1", "γ2", "γ3"),
    "position": ("x", "y", "z"),
    "euler": ("Angle 1", "Angle 2", "Angle 3"),
    "quaternion": tuple(f"{part} of the quaternion" for part in "wxyz"),
}
"""The columns of a quantity; rotation vectors and modified Rodrigues parameters are read as quaternions."""
_UNITS = {"−1": -1.0, "180/π": 180 / numpy.pi, "π/180": numpy.pi / 180}


def _columns(seen: Seen) -> Iterator[Row]:
    """One column with the other sign or in another unit of angle, and two columns in each other's place."""
    if seen.columns.keys() <= {"omega", "gamma"}:  # hypotheses of states read these in any order
        return
    for quantity, names in _WORDS.items():
        if quantity not in seen.columns:
            continue
        if quantity == "quaternion" and seen.said.scalar_last:
            names = *names[1:], names[0]
        unit = numpy.eye(len(names))
        for place, name in enumerate(names):
            for factor, value in _UNITS.items():
                if value < 0 or quantity in ("euler", "omega", "omega_space"):
                    matrix = unit / numpy.where(numpy.arange(len(names)) == place, value, 1.0)
                    yield "column_scaled", {"column": name, "factor": factor}, {"mixed": (quantity, matrix)}
        for i, j in combinations(range(len(names)), 2):
            order = [{i: j, j: i}.get(place, place) for place in range(len(names))]
            numbers = {"columns": f"{names[i]} and {names[j]}"}
            yield "column_order", numbers, {"mixed": (quantity, unit[:, order])}


def _data(suppositions: Suppositions) -> Iterator[Row]:
    """One number of the body that is another."""
    seen = suppositions.seen
    for kind, numbers, key, part in _scalable(seen.body) if len(seen.times) >= _FEWEST else ():

        def body_of(x: Array, key: str = key, part: Any = part) -> dict[str, Any]:
            scaled: dict[str, Any] = {key: getattr(seen.body, key) * (1.0 + part * x[0])}
            return {"body": replace(seen.body, **scaled)}

        x, left = _refined(suppositions, body_of, 1, DROP)
        factor = named(1.0 + float(x[0]), max(AS_LIKELY * left, _SAME)) if abs(x[0]) < numpy.inf else Fraction(1)
        if notable(factor, Fraction(1)):
            is_round = Fraction(decimal_text(factor, _ROUND)) == factor and factor != 1
            numbers = {**numbers, "factor": decimal_text(factor, 8)}
            if key == "rotor" and factor == -1:
                kind, numbers = "rotor_sign", {}
            yield kind, numbers, {**body_of(numpy.array([float(factor) - 1])), **_FITTED, "is_round": is_round}


def _start(suppositions: Suppositions) -> Iterator[Row]:
    """Another attitude and another Ω at t = 0."""
    seen, begin = suppositions.seen, suppositions.start
    size = float(numpy.linalg.norm(begin.omega)) or turning(seen.body, begin)

    def start_of(x: Array) -> dict[str, Any]:
        return {"begin": Beginning(begin.rotation @ _turn(x[:3]), begin.omega + size * x[3:])}

    x, _ = _refined(suppositions, start_of, 6, _START_DROP)
    if _SAME < (off := float(numpy.abs(x).max())) < numpy.inf:
        supposed = start_of(x)
        numbers = {"angle": _angle(_turn(x[:3])), "omega": _list(supposed["begin"].omega)}
        yield "start", numbers, {**supposed, "drop": _START_DROP * max(1.0, float(suppositions.own.max()) / off)}


def _scalable(body: BodyData) -> Iterator[tuple[str, dict[str, str], str, Any]]:
    """Kind and numbers of a mistake, the field of the body that it is in, and the part of that which has a factor."""
    if body.force and body.centre.any():
        yield "weight", {}, "gravity", 1.0
    if body.mass and body.about_centre:
        yield "mass", {}, "mass", 1.0
    if body.rotor is not None:
        yield "top", {"number": "The rotor"}, "rotor", 1.0
    for i, unit in enumerate(numpy.eye(3)):
        yield "top", {"number": f"I{i + 1}{i + 1}"}, "inertia", numpy.diag(unit)
        if body.centre[i]:
            yield "top", {"number": f"Number {i + 1} of the centre"}, "centre", unit


def _refined(
    suppositions: Suppositions, supposed: Callable[[Array], dict[str, Any]], count: int, drop: float
) -> tuple[Array, float]:
    """The numbers that fit best, 0 for those of the file, and the error that they leave.

    drop: how far the error must fall at least; numbers that do not do that to the first samples are refined no more.
    """
    refused = suppositions.refused * LIKELY_DROP / drop
    x = numpy.zeros(count)
    for seen in (suppositions.early, suppositions.seen):

        def off(x: Array, seen: Seen = seen) -> Array:
            changes = supposed(x)
            course = suppositions.course(seen, **changes)
            body = changes.get("body", seen.body)
            return numpy.full(1, numpy.inf) if course is None else residuals(seen, course, seen.said, body)

        x, here = gauss_newton(off, x, _SLIGHT, _REFINED)
        if float(numpy.linalg.norm(here)) > refused * len(here) ** 0.5:
            break
    return x, float(numpy.abs(here).max())


def _turn(vector: Array) -> Array:
    """The rotation by a small vector, to its second order a rotation."""
    a, b, c = vector
    return nearest_rotation(numpy.eye(3) + numpy.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]]))


def _early_rates(suppositions: Suppositions) -> Iterator[Row]:
    """Ω alone of other times, by as much as fits."""
    seen, small = suppositions.seen, 1e-6 / turning(suppositions.seen.body, suppositions.start)
    name = next((name for name in ("omega", "omega_space") if name in seen.columns), None)
    if name is None or len(seen.columns) < 2 or len(seen.times) < 3:
        return
    values = seen.said.vectors(seen.columns[name], True) if name == "omega_space" else seen.columns[name]

    def off(x: Array) -> Array:
        within = abs(x[0]) <= abs(seen.times[-1])
        course = suppositions.course(seen, shift=Fraction(x[0])) if within else None
        return numpy.full(1, numpy.inf) if course is None else (getattr(course, name) - values).reshape(-1)

    x, here = gauss_newton(off, numpy.zeros(1), small, _REFINED)
    if numpy.isfinite(here).all():
        shift = Fraction(x[0])
        numbers = {"shift": _signed(Fraction(decimal_text(shift, 6)))}
        yield "omega_shifted", numbers, {"shift": shift, "rates": True, **_FITTED}


def _signed(shift: Fraction) -> str:
    return f"{'−' if shift < 0 else '+'} {decimal_text(abs(shift), 6)}"


def _scopes(seen: Seen, kind: str, numbers: dict[str, str], reading: Reading) -> Iterator[Row]:
    """The reading of start and columns, of the columns, of the start: as far as each is another than was said."""
    inertia = seen.body.tensor
    before, after = (seen.start.begin(columns, inertia) for columns in (seen.said, reading))
    moved = not (numpy.array_equal(before.rotation, after.rotation) and numpy.array_equal(before.omega, after.omega))
    if moved:
        yield kind, {**numbers, "of": BOTH}, {"columns": reading, "start": reading}
    yield kind, {**numbers, "of": COLUMNS}, {"columns": reading}
    if moved:
        if kind == "omega_frame":
            space = not seen.start.in_space
            numbers = {"frame": "space" if space else "body", "key": f"omega{'_space' if space else ''} at t = 0"}
        yield kind, {**numbers, "of": START}, {"start": reading}


def _forms(seen: Seen) -> set[str]:
    return {*seen.columns, seen.start.form}


Named = tuple[str, dict[str, str], Reading]


def _readings(seen: Seen) -> Iterator[Named]:
    """Readings without a number, the likeliest first."""
    said, forms = seen.said, _forms(seen)
    scalar, conjugate = {"scalar_last": not said.scalar_last}, {"conjugate": not said.conjugate}
    frame = "body" if "omega_space" in forms else "space"
    sequences = [{"sequence": sequence} for sequence in SEQUENCES if sequence != said.sequence]
    rows: list[tuple[str, str, dict[str, str], dict[str, Any]]] = [
        ("quaternion", "scalar_last", {"quaternion_order": "wxyz" if said.scalar_last else "xyzw"}, scalar),
        ("quaternion", "conjugate", {"quaternion": _other(said.conjugate)}, conjugate),
        ("matrix", "transposed", {"matrix": _other(said.transposed)}, {"transposed": not said.transposed}),
        ("euler", "degrees", {"unit": "radians" if said.degrees else "degrees"}, {"degrees": not said.degrees}),
        ("euler", "extrinsic", {"sequence": said.sequence}, {"extrinsic": True}),
        ("euler", "angles_negated", {}, {"negated": True}),
        *(("euler", "sequence", other, other) for other in sequences),
        *(("euler", "extrinsic", other, {**other, "extrinsic": True}) for other in sequences),
        ("euler", "angles_of_inverse", {}, {"negated": True, "extrinsic": True}),
        ("omega", "omega_frame", {"frame": frame, "key": f"frame = {frame}"}, {"swapped": True}),
        *(("omega", f"omega_in_{unit}", {}, {"omega": factor}) for unit, factor in UNITS_OF_OMEGA.items()),
        ("omega", "omega_reversed", {}, {"omega": -1.0}),
        ("omega", "momentum", {}, {"momentum": True}),
        ("gamma", "gamma_down", {}, {"gamma": -1.0}),
        ("quaternion", "scalar_last_conjugate", {}, {**scalar, **conjugate}),
    ]
    named_so = {"omega_space": "omega", "rows": "gamma"}
    given = {named_so.get(form, form) for form in forms}
    yield from ((kind, numbers, replace(said, **changes)) for form, kind, numbers, changes in rows if form in given)


def _other(inverse: bool) -> str:
    """The direction that is not said."""
    return "body_to_space" if inverse else "space_to_body"


def _axes_of_space(seen: Seen) -> Iterator[Named]:
    """Another axis points up, or one is reversed."""
    said = seen.said
    for up in ("y", "z", "x", "-z", "-y", "-x"):
        if up != said.up:
            yield "up", {"up": up}, replace(said, up=up)
    for axis in range(3):
        for pseudo in (True, False):
            numbers = {"axis": "xyz"[axis]}
            yield "left_handed", numbers, replace(said, mirror=axis, pseudo=pseudo)


def _bodies(seen: Seen) -> Iterator[tuple[str, dict[str, str], BodyData]]:
    """Other data of the body."""
    body = seen.body
    yield "gravity_sign", {}, replace(body, gravity=-body.gravity)
    if body.force and body.centre.any():
        yield "no_gravity", {}, replace(body, gravity=0.0)
    at_centre = body if body.about_centre else replace(body, inertia=body.inertia - body.steiner)
    if body.mass and body.centre.any():
        yield "free_about_centre_of_mass", {}, replace(at_centre, gravity=0.0, about_centre=False, mass=None)
    if body.mass and body.steiner.any():
        where = "fixed point" if body.about_centre else "centre of mass"
        yield "inertia_about", {"about": where}, replace(body, about_centre=not body.about_centre)
        for times in (-1, 2):
            inertia = body.inertia + times * body.steiner
            yield "steiner", {"times": str(times)}, replace(body, inertia=inertia, about_centre=False)
    off = body.inertia - numpy.diag(numpy.diag(body.inertia))
    if off.any():
        pairs = [pair for pair in combinations(range(3), 2) if off[pair]]
        for which in (some for count in range(len(pairs), 0, -1) for some in combinations(pairs, count)):
            signs = numpy.ones((3, 3))
            for i, j in which:
                signs[i, j] = signs[j, i] = -1.0
            entries = {} if len(which) == len(pairs) else {"entries": ", ".join(f"I{i + 1}{j + 1}" for i, j in which)}
            yield "products_of_inertia", entries, replace(body, inertia=body.inertia * signs)
        moments, axes = principal(body.inertia)
        for turn in (numpy.eye(3), *(numpy.array(matrix) for matrix, _ in _rotations())):
            named_so, again = axes @ turn, turn.T * moments @ turn
            yield "tensor_axes_conjugated", {}, replace(body, inertia=named_so.T @ again @ named_so)
    here = next((name for name in _STANDARD if float(name) == body.gravity), None)
    standard = {f"{name}/{here}": float(name) / body.gravity for name in _STANDARD if here not in (None, name)}
    for name, factor in (_GRAVITIES | standard).items():
        yield "gravity_unit", {"factor": name}, replace(body, gravity=body.gravity * factor)
    yield "centre_reversed", {}, replace(body, centre=-body.centre)
    yield from _in_space_axes(seen)
    for name, factor in _INERTIAS.items():
        yield "inertia_unit", {"factor": name}, replace(body, inertia=body.inertia * factor)
    for name, factor in _LENGTHS.items():
        yield "centre_unit", {"factor": name}, replace(body, centre=body.centre * factor)
    rotor = numpy.zeros(3) if body.rotor is None else body.rotor
    for kind, numbers, inertia, centre, turned in other_axes(body.inertia, body.centre, rotor):
        other = replace(body, inertia=inertia, centre=centre, rotor=None if body.rotor is None else turned)
        yield "body_data_axes" if kind == "top_axes" else kind, numbers, other


def _in_space_axes(seen: Seen) -> Iterator[tuple[str, dict[str, str], BodyData]]:
    """Tensor, centre or both given in the axes of space at the start, or turned the other way."""
    body = seen.body
    plain = seen.start.begin(replace(seen.said, up="z"), body.tensor).rotation
    for turn in (plain, plain.T):
        turned, centre = turn.T @ body.inertia @ turn, turn.T @ body.centre
        yield "inertia_in_space_axes", {}, replace(body, inertia=turned)
        yield "centre_in_space_axes", {}, replace(body, centre=centre)
        yield "data_in_space_axes", {}, replace(body, inertia=turned, centre=centre)


def _positions(seen: Seen) -> Iterator[Row]:
    """Positions that are displacements, of another unit or sign."""
    if "position" not in seen.columns:
        return
    rows: list[tuple[str, dict[str, str], dict[str, Any]]] = [
        ("displacement", {}, {"displaced": True}),
        ("position_reversed", {}, {"scale": -1.0}),
    ]
    for name, factor in _LENGTHS.items():
        rows += [("position_unit", {"factor": name}, {"scale": factor, "displaced": moved}) for moved in (False, True)]
    if seen.body.centre.any() and not numpy.array_equal(seen.point, seen.body.centre):
        rows.append(("position_of_centre", {}, {"point": tuple(seen.body.centre)}))
    yield from ((kind, numbers, {"columns": replace(seen.said, **changes)}) for kind, numbers, changes in rows)


def _renamed(seen: Seen) -> Iterator[Row]:
    """Axes of the body or of space in another order or reversed, without a mirror image."""
    for matrix, axes in _rotations():
        for part, kind in (("space", "space_axes"), ("body", "body_axes")):
            reading = replace(seen.said, space=matrix) if part == "space" else replace(seen.said, body=matrix)
            yield from _scopes(seen, kind, {"axes": axes}, reading)


def _rotations() -> Iterator[tuple[Square, str]]:
    """The 23 renamings of determinant 1, with their names: component k of the file is ±(axis of that number)."""
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = numpy.zeros((3, 3))
            matrix[range(3), order] = signs
            if numpy.linalg.det(matrix) > 0 and not numpy.array_equal(matrix, numpy.eye(3)):
                names = ",".join(("-" if s < 0 else "") + str(i + 1) for i, s in zip(order, signs, strict=True))
                yield _square(matrix), names


def _square(matrix: Array) -> Square:
    return tuple(map(tuple, matrix.tolist()))


def _fitted(seen: Seen, course: Course) -> Iterator[Row]:
    """Constant rotations of space and body axes, another point, another place of the pivot, factors."""
    if len(seen.times) < 3:
        return
    yield from _turned(seen, course)
    yield from _scaled(seen, course)
    if "position" not in seen.columns:
        return
    said, point = seen.said, seen.point
    positions = said.vectors(seen.columns["position"] - seen.pivot)
    true = course.rotation @ point
    size = float((true * true).sum())
    if size:
        yield from _near("position_unit", float((positions * true).sum()) / size, said, "scale")
    offset = (positions - true).mean(axis=0)
    yield "pivot", {"offset": _list(offset)}, {"columns": replace(said, offset=tuple(offset)), **_FITTED}
    own = numpy.einsum("nji,nj->ni", course.rotation, positions).mean(axis=0)
    yield "point", {"point": _list(own)}, {"columns": replace(said, point=tuple(own)), **_FITTED}
    design = numpy.concatenate([course.rotation, numpy.tile(numpy.eye(3), (len(positions), 1, 1))], axis=2)
    if len(positions) >= _FEWEST and numpy.isfinite(design).all() and numpy.isfinite(positions).all():
        both = numpy.linalg.lstsq(design.reshape(-1, 6), positions.reshape(-1), rcond=None)[0]
        reading = replace(said, point=tuple(both[:3]), offset=tuple(both[3:]))
        numbers = {"point": _list(both[:3]), "offset": _list(both[3:])}
        yield "point_and_pivot", numbers, {"columns": reading, **_FITTED}


def _turned(seen: Seen, course: Course) -> Iterator[Row]:
    """A rotation of the axes of space, or of the body, that is the same in every sample."""
    for form in ("quaternion", "matrix", "euler"):
        if form not in seen.columns:
            continue
        rotations = seen.said.rotation(form, seen.columns[form])
        if not numpy.isfinite(rotations).all():
            return
        space = nearest_rotation((rotations @ course.rotation.transpose(0, 2, 1)).mean(axis=0))
        body = nearest_rotation((course.rotation.transpose(0, 2, 1) @ rotations).mean(axis=0))
        plain = replace(seen.said, up="z")
        if seen.said.up == "z":
            turned = replace(plain, space=_square(space))
            yield "space_turned", {"angle": _angle(space)}, {"columns": turned, **_FITTED}
        turned = replace(seen.said, body=_square(body.T))
        yield "body_turned", {"angle": _angle(body)}, {"columns": turned, **_FITTED}
        return


def _angle(matrix: Array) -> str:
    cosine = max(-1.0, min(1.0, (float(numpy.trace(matrix)) - 1) / 2))
    return f"{numpy.degrees(numpy.arccos(cosine)):.6g}"


def _scaled(seen: Seen, course: Course) -> Iterator[Row]:
    for name in ("omega", "omega_space"):
        if name not in seen.columns:
            continue
        true = course.omega_space if name == "omega_space" else course.omega
        vectors = seen.said.vectors(seen.columns[name], True) if name == "omega_space" else seen.columns[name]
        size = float((true * true).sum())
        if size:
            yield from _near("omega_scaled", float((vectors * true).sum()) / size, seen.said, "omega")


def _near(kind: str, fitted: float, said: Reading, name: str) -> Iterator[Row]:
    """The fitted factor of a reading, rounded as far as that does no harm."""
    if not numpy.isfinite(fitted) or not fitted:
        return
    factor = named(fitted, 1e-9 * abs(fitted))
    if factor and notable(factor, Fraction(1)):
        changes: dict[str, Any] = {name: float(factor)}
        yield kind, {"factor": decimal_text(factor, 8)}, {"columns": replace(said, **changes), **_FITTED}


def _list(values: Array) -> str:
    return ", ".join(decimal_text(named(float(v), 1e-9 * max(1e-3, float(numpy.abs(values).max()))), 8) for v in values)


def _pairs(seen: Seen) -> Iterator[Row]:
    """Two readings at once."""
    singles = [reading for reading in _readings(seen) if reading[0] != "extrinsic"] + list(_axes_of_space(seen))
    for i, (kind, numbers, one) in enumerate(singles):
        for other, more, two in singles[i + 1 :]:
            if kind == other:
                continue
            both = _merged(seen.said, one, two)
            if both is not None:
                yield from _scopes(seen, f"{kind}+{other}", {**numbers, **more}, both)


def _merged(said: Reading, one: Reading, two: Reading) -> Reading | None:
    """Both changes; None where they are of the same thing."""
    changes = {}
    for name in Reading.__dataclass_fields__:
        values = [getattr(attempt, name) for attempt in (one, two) if getattr(attempt, name) != getattr(said, name)]
        if len(values) > 1:
            return None
        if values:
            changes[name] = values[0]
    return replace(said, **changes)
