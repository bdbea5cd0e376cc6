"""Mistakes of convention and of data in files of any columns, each found by trying it.

A hypothesis is another reading of the columns, of the start, or of both, or other data of the body: the motion that
follows from it is computed and compared with the columns.  It is accepted if the error falls by two decades, by three
where a number was fitted; of several that fit about as well the simplest is named first, and the others after it.  The
first samples are judged by themselves as well; where nothing fits better, a fall by a factor of 30 makes it likely.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from itertools import combinations, permutations, product
from math import floor, log10
from typing import Any

import numpy

from heavytop.features.score.diagnose.hypotheses import TIME_UNITS, UNITS_OF_OMEGA, gauss_newton, other_axes
from heavytop.features.score.diagnose.readings import (
    BodyData,
    InitialState,
    Observations,
    Reading,
    SimulatedMotion,
    Square,
    nearest_rotation,
    rates_off,
    residuals,
    simulate,
    turning,
)
from heavytop.features.score.diagnose.samples import FARTHEST, chosen_rows, notable, plain_number, principal, refused
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
from heavytop.measure.attitude_error import ANGLES, DIRECTIONS, FORMS, ORDERS
from heavytop.precision import decimal_text
from heavytop.top.attitude import SEQUENCES

_NEIGHBOURS = 60
"""Samples whose attitudes are compared with Ω."""
_TWO_MISTAKES = 0.05
"""Relative errors below it are not those of two mistakes of convention at once."""
_CONTRADICTS = 0.1
"""Relative distance of Ω from the rate of the attitude, below which the error of the method may explain it."""
_REFINED = 8
_FEWEST = 4
"""Fewest samples to which the six numbers of a start, or one of the body, are fitted."""
_TURNED = 0.5
"""Radians within which the six numbers of a start fit the errors of a method."""
_SLIGHT = 1e-6
"""Step of a difference quotient, relative to the number."""
_ROUND = 3
"""Most digits of a factor that is round."""
_START_DROP = 1e5
"""Factor by which the error must fall for another start: its six numbers may also absorb the errors of first steps."""
Row = tuple[str, dict[str, str], dict[str, Any]]
"""A mistake: its kind, its numbers, and the changes of :meth:`ConventionSearch.errors_if`; ``drop``, ``is_round``."""
_FITTED = {"drop": FITTED_DROP}
_SAME = 1e-9
"""A fitted number is that of the file within that."""
_LENGTHS = {"1000": 1e3, "100": 1e2, "1/1000": 1e-3, "1/100": 1e-2, "1/0.3048": 1 / 0.3048, "0.3048": 0.3048}
_STANDARD = ("9.8", "9.80665", "9.81", "10")
"""Common values of g, of which one may stand for another."""
_GRAVITIES = {
    "9.81": 9.81,
    "9.80665": 9.80665,
    "1/9.81": 1 / 9.81,
    "1/9.80665": 1 / 9.80665,
    **_LENGTHS,
}
_INERTIAS = {f"1e{power}": 10.0**power for power in (-9, -7, -6, -4, -3, -2, 2, 3, 4, 6, 7, 9)}

BOTH, COLUMNS, START, DATA, RATES = "start and columns", "columns", "start", "data", "rates"


class ConventionSearch(Search):
    """The search for a mistake of convention or of data.  step: of the method, where the file states it."""

    names_others = True

    def __init__(self, samples: Observations, step: Fraction | None = None) -> None:
        self.step, self.start = step, samples.start.begin(samples.declared, samples.body.tensor)
        rate = turning(samples.body, self.start)
        times = list(map(float, samples.times))
        rows = chosen_rows(times, rate)
        within_reach = [row for row in rows if abs(times[row]) * rate <= FARTHEST]
        self.reaches = bool(within_reach)
        self.every, self.samples = samples, samples.at(within_reach or rows[:1])
        self.times, self.states = self.samples.times, len(samples.times)
        first = FIRST[-1] + (not self.times[0])
        self.early = self.samples.at(list(range(min(len(self.times), first))))
        self.file_errors = self.errors_if(self.samples)

    def hypotheses(self) -> Iterator[Hypothesis]:
        """All hypotheses, the simplest first, those with a fitted number last; none if every sample is out of reach."""
        return map(self._tried, _hypotheses(self) if self.reaches else ())

    def further(self, diagnosis: Diagnosis | None, error: float) -> Iterator[Hypothesis]:
        """Hypotheses of two readings at once."""
        if self.reaches and diagnosis is None and error > _TWO_MISTAKES and _forms(self.samples) & set(FORMS):
            yield from map(self._tried, _pairs(self.samples))

    def counted(self, error: float, looked: int) -> float:
        """As for all searches; of the first positions alone at most the distance that they move, of two none.

        Many readings explain where positions begin.
        """
        most = super().counted(error, looked)
        if looked == len(self.file_errors) or self.samples.columns.keys() != {"position"}:
            return most
        if looked <= len(self.early.times):
            return 0.0
        moved = numpy.ptp(self.samples.columns["position"][:looked], axis=0).max()
        return min(most, float(moved / (numpy.linalg.norm(self.samples.point) or 1.0)))

    def of_start(self) -> Diagnosis | None:
        """Another start, tried last: its six numbers also fit a motion that is early or late, or turns by little."""
        error = float(self.file_errors.max())
        angle = turning(self.samples.body, self.start) * abs(float(self.times[-1]))
        if not self.reaches or not WORTH_ASKING < error < numpy.inf or angle < _TURNED or len(self.times) < _FEWEST:
            return None
        return self.best([*map(self._tried, _start(self))], error)

    def of_rates(self) -> Diagnosis | None:
        """The simplest reading of the columns in which Ω is the rate of the attitude; no motion is computed."""
        samples = self.every.at(list(range(min(_NEIGHBOURS, len(self.every.times)))))
        off = rates_off(samples, samples.declared)
        if off is None or not _CONTRADICTS < (error := float(off.max())) < numpy.inf:
            return None
        readings = [(name, numbers, rates_off(samples, reading)) for name, numbers, reading in _readings(samples)]
        left, kind, numbers = min(
            ((float(off.max()), kind, numbers) for kind, numbers, off in readings if off is not None),
            key=lambda entry: entry[0],
            default=(error, "", {}),
        )
        looked = scope(samples.times, self.states)
        return Diagnosis(kind, {**numbers, "of": RATES}, error, left, looked) if left * DROP <= error else None

    @cached_property
    def refused(self) -> float:
        """The error of the first samples beyond which a motion explains nothing."""
        rates = [
            [v for k, v in samples.columns.items() if k.startswith("omega")] for samples in (self.early, self.samples)
        ]
        early, largest = (max((float(numpy.abs(values).max()) for values in samples), default=1.0) for samples in rates)
        return refused(early, largest, float(self.file_errors.max()))

    def _tried(self, row: Row) -> Hypothesis:
        """The hypothesis; later errors are infinite where those of the first samples refute a motion."""
        kind, numbers, supposed = row
        judged = {name: supposed[name] for name in ("drop", "is_round") if name in supposed}
        supposed = {name: value for name, value in supposed.items() if name not in judged}
        # a row t = 0 may be right where all later ones are late
        late = slice(int("shift" in supposed and "rates" not in supposed and not self.times[0]), None)
        left = self.errors_if(self.early, **supposed)[late]
        if supposed.keys() & {"start", "body", "shift", "unit", "begin"} and not float(left.max()) <= self.refused:
            left = numpy.append(left, numpy.full(len(self.file_errors) - len(left), numpy.inf))[late]
        else:
            left = self.errors_if(self.samples, **supposed)[late]
        return Hypothesis(kind, {"of": DATA, **numbers}, left, **judged)

    def simulated(
        self,
        samples: Observations,
        start: Reading | None = None,
        body: BodyData | None = None,
        shift: Fraction = Fraction(0),
        unit: Fraction = Fraction(1),
        begin: InitialState | None = None,
    ) -> SimulatedMotion | None:
        """The motion of the file with another reading of its start, another body, other times, another start."""
        body = body or samples.body
        begin = begin or samples.start.begin(start or samples.declared, body.tensor)
        return simulate(body, begin, tuple(float(unit * time + shift) for time in samples.times))

    def errors_if(self, samples: Observations, **supposed: Any) -> Array:
        """The largest of :meth:`residuals_if` in each sample; infinite where a number is not finite."""
        off = numpy.abs(self.residuals_if(samples, **supposed)).reshape(len(samples.times), -1).max(axis=1)
        largest: Array = numpy.nan_to_num(off, nan=numpy.inf, posinf=numpy.inf)
        return largest

    def residuals_if(
        self,
        samples: Observations,
        columns: Reading | None = None,
        body: BodyData | None = None,
        rates: bool = False,
        still: bool = False,
        mixed: tuple[str, Array] | None = None,
        **supposed: Any,
    ) -> Array:
        """Columns less the motion, with another reading of columns and start, or another body; infinite without one.

        shift: the columns are those of t + shift; of Ω alone where ``rates``.  unit: they are those of unit·t.
        still: Ω is not compared.
        mixed: a quantity, and the matrix by which the rows of its columns are multiplied.
        begin: the start of the motion.
        """
        simulated, plain = self.simulated(samples, body=body, **supposed), self.simulated(samples) if rates else None
        if simulated is None:
            return numpy.full(len(samples.times), numpy.inf)
        if body is not None and samples.point is samples.body.centre:
            samples = replace(samples, point=body.centre)
        if plain is not None:
            in_body = numpy.einsum("nji,nj->ni", plain.rotation, simulated.omega_space)
            simulated = SimulatedMotion(
                plain.rotation, in_body if "omega_space" in samples.columns else simulated.omega
            )
        if still:
            samples = replace(samples, columns={k: v for k, v in samples.columns.items() if not k.startswith("omega")})
        if mixed is not None:
            name, matrix = mixed
            samples = replace(samples, columns={**samples.columns, name: samples.columns[name] @ matrix})
        return residuals(samples, simulated, columns or samples.declared, body or samples.body)


def _hypotheses(search: ConventionSearch) -> Iterator[Row]:
    """All hypotheses, the simplest first, those with a fitted number last."""
    samples = search.samples
    for kind, numbers, reading in _readings(samples):
        yield from _scopes(samples, kind, numbers, reading)
    # before the axis that points up: where both fit, the third axis points down
    for kind, numbers, body in _bodies(samples):
        yield kind, numbers, {"body": body}
        if kind == "gravity_sign":
            for other_kind, other_numbers, reading in _axes_of_space(samples):
                yield from _scopes(samples, other_kind, other_numbers, reading)
    yield from _steps(search)
    yield from _positions(samples)
    yield from _renamed(samples)
    yield from _columns(samples)
    simulated = search.simulated(samples)
    if simulated is not None:
        yield from _fitted(samples, simulated)
        yield from _early_rates(search)
        yield from _data(search)


def _steps(search: ConventionSearch) -> Iterator[Row]:
    """All columns, or Ω alone, early or late by half a step or one step of the method; Ω that is 0 in every sample."""
    rates = {name: values for name, values in search.samples.columns.items() if name.startswith("omega")}
    has_more = bool(rates) and len(search.samples.columns) > len(rates)
    if has_more and not any(values.any() for values in rates.values()):
        yield "omega_zero", {}, {"still": True}
    yield "time_reversed", {}, {"unit": Fraction(-1)}
    if search.samples.columns.keys() <= {"omega_space", "position"}:  # of which the other search knows nothing
        turns = turning(search.samples.body, search.start) * abs(float(search.samples.times[-1]))
        for factor in sorted(factor for factor in TIME_UNITS if factor * turns <= FARTHEST):
            yield "time_unit", {"factor": f"{float(factor):.6g}"}, {"unit": factor}
    for fraction, sign in product((Fraction(1, 2), Fraction(1)), (-1, 1)) if search.step else ():
        shift = sign * fraction * (search.step or 0)
        yield "times_shifted", {"shift": _signed(shift)}, {"shift": shift}
        if has_more:
            text = f"{'half a step' if fraction < 1 else 'one step'} {'early' if sign < 0 else 'late'}"
            yield "omega_shifted", {"shift": _signed(shift), "steps": text}, {"shift": shift, "rates": True}


_WORDS = {
    "omega": ("Ω1", "Ω2", "Ω3"),
    "omega_space": ("Ω1", "Ω2", "Ω3"),
    "gamma": ("γ1", "γ2", "γ3"),
    "position": ("x", "y", "z"),
    "euler": ("Angle 1", "Angle 2", "Angle 3"),
    "quaternion": tuple(f"{part} of the quaternion" for part in "wxyz"),
}
"""Names of the columns of each quantity; rotation vectors and Rodrigues parameters are read as quaternions."""
_UNITS = {"−1": -1.0, "180/π": 180 / numpy.pi, "π/180": numpy.pi / 180}


def _columns(samples: Observations) -> Iterator[Row]:
    """One column with the other sign or in another unit of angle; two columns exchanged."""
    if samples.columns.keys() <= {"omega", "gamma"}:  # hypotheses of states read these in any order
        return
    for quantity, names in _WORDS.items():
        if quantity not in samples.columns:
            continue
        if quantity == "quaternion" and samples.declared.quaternion_order == "xyzw":
            names = *names[1:], names[0]
        unit = numpy.eye(len(names))
        for index, name in enumerate(names):
            for factor, value in _UNITS.items():
                if value < 0 or quantity in ("euler", "omega", "omega_space"):
                    matrix = unit / numpy.where(numpy.arange(len(names)) == index, value, 1.0)
                    yield "column_scaled", {"column": name, "factor": factor}, {"mixed": (quantity, matrix)}
        for i, j in combinations(range(len(names)), 2):
            order = [{i: j, j: i}.get(index, index) for index in range(len(names))]
            numbers = {"columns": f"{names[i]} and {names[j]}"}
            yield "column_order", numbers, {"mixed": (quantity, unit[:, order])}


def _data(search: ConventionSearch) -> Iterator[Row]:
    """Another value of one number of the body."""
    samples = search.samples
    for kind, numbers, key, direction in _scalable(samples.body) if len(samples.times) >= _FEWEST else ():

        def body_of(x: Array, key: str = key, direction: Any = direction) -> dict[str, Any]:
            scaled: dict[str, Any] = {key: getattr(samples.body, key) * (1.0 + direction * x[0])}
            return {"body": replace(samples.body, **scaled)}

        x, left = _refined(search, body_of, 1, DROP)
        near = max(AS_LIKELY * left, _SAME)
        factor = plain_number(1.0 + float(x[0]), near) if abs(x[0]) < numpy.inf else Fraction(1)
        if notable(factor, Fraction(1)):
            is_round, numbers = _is_round(factor, near), {**numbers, "factor": decimal_text(factor, 8)}
            if key == "rotor" and factor == -1:
                kind, numbers = "rotor_sign", {}
            yield kind, numbers, {**body_of(numpy.array([float(factor) - 1])), **_FITTED, "is_round": is_round}


def _is_round(factor: Fraction, near: float) -> bool:
    """Whether a factor has few digits, as one that is known within ``near`` has by accident in one case of ten."""
    digits = next((n for n in range(1, _ROUND + 1) if Fraction(decimal_text(factor, n)) == factor), 0)
    return factor not in (0, 1) and digits > 0 and 20 * near <= 10.0 ** (floor(log10(abs(factor))) - digits + 1)


def _start(search: ConventionSearch) -> Iterator[Row]:
    """Another attitude and another Ω at t = 0."""
    samples, begin = search.samples, search.start
    size = float(numpy.linalg.norm(begin.omega)) or turning(samples.body, begin)

    def start_of(x: Array) -> dict[str, Any]:
        return {"begin": InitialState(begin.rotation @ _turn(x[:3]), begin.omega + size * x[3:])}

    x, _ = _refined(search, start_of, 6, _START_DROP)
    if _SAME < (off := float(numpy.abs(x).max())) < numpy.inf:
        supposed = start_of(x)
        numbers = {"angle": _angle(_turn(x[:3])), "omega": _list(supposed["begin"].omega)}
        yield "start", numbers, {**supposed, "drop": _START_DROP * max(1.0, float(search.file_errors.max()) / off)}


def _scalable(body: BodyData) -> Iterator[tuple[str, dict[str, str], str, Any]]:
    """Kind and numbers of a mistake, the field of the body concerned, and the part of it that is scaled."""
    if body.force and body.centre.any():
        yield "weight", {}, "gravity", 1.0
    if body.mass and body.about_centre:
        yield "mass", {}, "mass", 1.0
    if body.rotor is not None:
        yield "top", {"number": "The rotor"}, "rotor", 1.0
    for i, unit in enumerate(numpy.eye(3)):
        yield "top", {"number": f"I{i + 1}{i + 1}"}, "inertia", numpy.diag(unit)
        if body.centre[i]:
            yield "top", {"number": f"Component {i + 1} of the centre of mass"}, "centre", unit


def _refined(
    search: ConventionSearch, supposed: Callable[[Array], dict[str, Any]], count: int, drop: float
) -> tuple[Array, float]:
    """Changes of the numbers of the file that fit best, and the error that remains.

    drop: the factor by which the error must fall; the fit ends where it does not in the first samples.
    """
    refused = search.refused * LIKELY_DROP / drop
    x = numpy.zeros(count)
    for samples in (search.early, search.samples):

        def off(x: Array, samples: Observations = samples) -> Array:
            return search.residuals_if(samples, **supposed(x))

        x, here = gauss_newton(off, x, _SLIGHT, _REFINED)
        if float(numpy.linalg.norm(here)) > refused * len(here) ** 0.5:
            break
    return x, float(numpy.abs(here).max())


def _turn(vector: Array) -> Array:
    """The rotation by a small vector."""
    a, b, c = vector
    return nearest_rotation(numpy.eye(3) + numpy.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]]))


def _early_rates(search: ConventionSearch) -> Iterator[Row]:
    """Ω alone at times that are shifted by a fitted number."""
    samples, rate = search.samples, turning(search.samples.body, search.start)
    if not {"omega", "omega_space"} & samples.columns.keys() or len(samples.columns) < 2 or len(samples.times) < 3:
        return
    last = float(abs(samples.times[-1]))

    def shifted(x: Array) -> dict[str, Any]:
        return {"shift": Fraction(float(numpy.clip(x[0] / rate, -last, last))), "rates": True}

    x, _ = _refined(search, shifted, 1, FITTED_DROP)
    numbers = {"shift": _signed(Fraction(decimal_text(shifted(x)["shift"], 6)))}
    yield "omega_shifted", numbers, {**shifted(x), **_FITTED}


def _signed(shift: Fraction) -> str:
    return f"{'−' if shift < 0 else '+'} {decimal_text(abs(shift), 6)}"


def _scopes(samples: Observations, kind: str, numbers: dict[str, str], reading: Reading) -> Iterator[Row]:
    """The reading of start and columns, of the columns, and of the start, as far as each differs from the file's."""
    inertia = samples.body.tensor
    before, after = (samples.start.begin(columns, inertia) for columns in (samples.declared, reading))
    moved = not (numpy.array_equal(before.rotation, after.rotation) and numpy.array_equal(before.omega, after.omega))
    omega = {name: getattr(reading, name) for name in ("swapped", "omega", "momentum")}
    of_omega = replace(samples.declared, **omega) == reading
    read = not of_omega or any(name.startswith("omega") for name in samples.columns)
    if moved and read:
        yield kind, {**numbers, "of": BOTH}, {"columns": reading, "start": reading}
    if read:
        yield kind, {**numbers, "of": COLUMNS}, {"columns": reading}
    if moved:
        if kind == "omega_frame":
            space = not samples.start.in_space
            numbers = {"frame": "space" if space else "body", "key": f"omega{'_space' if space else ''} at t = 0"}
        yield kind, {**numbers, "of": START}, {"start": reading}


def _forms(samples: Observations) -> set[str]:
    return {*samples.columns, samples.start.form}


Named = tuple[str, dict[str, str], Reading]


def _readings(samples: Observations) -> Iterator[Named]:
    """Readings without a fitted number, the likeliest first."""
    declared, forms = samples.declared, _forms(samples)
    words = {"quaternion_order": ORDERS, "quaternion": DIRECTIONS, "matrix": DIRECTIONS, "angles": ANGLES}
    order, conjugate, transposed, unit = (
        {key: next(word for word in pair if word != getattr(declared, key))} for key, pair in words.items()
    )
    frame = "body" if "omega_space" in forms else "space"
    sequences = [{"sequence": sequence} for sequence in SEQUENCES if sequence != declared.sequence]
    rows: list[tuple[str, str, dict[str, str], dict[str, Any]]] = [
        ("quaternion", "scalar_last", order, order),
        ("quaternion", "conjugate", conjugate, conjugate),
        ("matrix", "transposed", transposed, transposed),
        ("euler", "degrees", {"unit": unit["angles"]}, unit),
        ("euler", "extrinsic", {"sequence": declared.sequence}, {"extrinsic": True}),
        ("euler", "angles_negated", {}, {"negated": True}),
        *(("euler", "sequence", changed, changed) for changed in sequences),
        *(("euler", "extrinsic", changed, {**changed, "extrinsic": True}) for changed in sequences),
        ("euler", "angles_of_inverse", {}, {"negated": True, "extrinsic": True}),
        ("omega", "omega_frame", {"frame": frame, "key": f"frame = {frame}"}, {"swapped": True}),
        *(("omega", f"omega_in_{unit}", {}, {"omega": factor}) for unit, factor in UNITS_OF_OMEGA.items()),
        ("omega", "omega_scaled", {"factor": "π/180"}, {"omega": _UNITS["π/180"]}),
        ("omega", "omega_reversed", {}, {"omega": -1.0}),
        ("omega", "momentum", {}, {"momentum": True}),
        ("gamma", "gamma_down", {}, {"gamma": -1.0}),
        ("quaternion", "scalar_last_conjugate", {}, order | conjugate),
    ]
    named_so = {"omega_space": "omega", "rows": "gamma"}
    in_file = {"omega", *(named_so.get(form, form) for form in forms)}  # Ω at the start
    yield from ((kind, data, replace(declared, **changes)) for form, kind, data, changes in rows if form in in_file)


def _axes_of_space(samples: Observations) -> Iterator[Named]:
    """Readings in which another axis points up, or one is reversed."""
    declared = samples.declared
    for up in ("y", "z", "x", "-z", "-y", "-x"):
        if up != declared.up:
            yield "up", {"up": up}, replace(declared, up=up)
    for axis in range(3):
        for pseudo in (True, False):
            numbers = {"axis": "xyz"[axis]}
            yield "left_handed", numbers, replace(declared, mirror=axis, pseudo=pseudo)


def _bodies(samples: Observations) -> Iterator[tuple[str, dict[str, str], BodyData]]:
    """Other data of the body."""
    body = samples.body
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
        for order in list(permutations(range(3)))[1:]:
            inertia, numbers = off + numpy.diag(numpy.diag(body.inertia)[list(order)]), {"entries": "I11, I22, I33"}
            yield (
                "inertia_axes",
                {"axes": "".join(str(i + 1) for i in order), **numbers},
                replace(body, inertia=inertia),
            )
        moments, axes = principal(body.inertia)
        for turn in (numpy.eye(3), *(numpy.array(matrix) for matrix, _ in _rotations())):
            named_so, reordered = axes @ turn, turn.T * moments @ turn
            yield "tensor_axes_conjugated", {}, replace(body, inertia=named_so.T @ reordered @ named_so)
    if body.gravity in map(float, _STANDARD):
        for name in _STANDARD:
            yield "gravity", {"gravity": name}, replace(body, gravity=float(name))
    for name, factor in _GRAVITIES.items():
        yield "gravity_unit", {"factor": name}, replace(body, gravity=body.gravity * factor)
    yield "centre_reversed", {}, replace(body, centre=-body.centre)
    yield from _in_space_axes(samples)
    for name, factor in _INERTIAS.items():
        yield "inertia_unit", {"factor": name}, replace(body, inertia=body.inertia * factor)
    for name in ("1000", "1/1000") if body.mass else ():
        yield "mass", {"factor": name}, replace(body, mass=(body.mass or 0.0) * _LENGTHS[name])
    for name, factor in _LENGTHS.items():
        yield "centre_unit", {"factor": name}, replace(body, centre=body.centre * factor)
    rotor = numpy.zeros(3) if body.rotor is None else body.rotor
    for kind, numbers, inertia, centre, turned in other_axes(body.inertia, body.centre, rotor):
        renamed = replace(body, inertia=inertia, centre=centre, rotor=None if body.rotor is None else turned)
        yield "body_data_axes" if kind == "top_axes" else kind, numbers, renamed
    for kind, numbers, tensor, centre, _ in other_axes(body.tensor, body.centre, rotor):
        if kind in ("centre_axes", "centre_signs") and body.about_centre and body.steiner.any():
            numbers["inertia"] = _list(tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
            yield kind, numbers, replace(body, inertia=tensor, centre=centre, about_centre=False)


def _in_space_axes(samples: Observations) -> Iterator[tuple[str, dict[str, str], BodyData]]:
    """Tensor, centre or both in the axes of space at the start, by either direction of the rotation."""
    body = samples.body
    plain = samples.start.begin(replace(samples.declared, up="z"), body.tensor).rotation
    for turn in (plain, plain.T):
        turned, centre = turn.T @ body.inertia @ turn, turn.T @ body.centre
        yield "inertia_in_space_axes", {}, replace(body, inertia=turned)
        yield "centre_in_space_axes", {}, replace(body, centre=centre)
        yield "data_in_space_axes", {}, replace(body, inertia=turned, centre=centre)


def _positions(samples: Observations) -> Iterator[Row]:
    """Positions in another unit, of the other sign, or counted from the first."""
    if "position" not in samples.columns:
        return
    rows: list[tuple[str, dict[str, str], dict[str, Any]]] = [
        ("displacement", {}, {"displaced": True}),
        ("position_reversed", {}, {"scale": -1.0}),
    ]
    for name, factor in _LENGTHS.items() if samples.point.any() else ():  # 0 has no unit
        rows += [("position_unit", {"factor": name}, {"scale": factor, "displaced": moved}) for moved in (False, True)]
    if samples.body.centre.any() and not numpy.array_equal(samples.point, samples.body.centre):
        rows.append(("position_of_centre", {}, {"of_point": tuple(samples.body.centre)}))
    yield from ((kind, numbers, {"columns": replace(samples.declared, **changes)}) for kind, numbers, changes in rows)


def _renamed(samples: Observations) -> Iterator[Row]:
    """Axes of the body or of space in another order or reversed, without a mirror image."""
    is_enough = len(samples.times) >= _FEWEST
    beside = is_enough and {"position"} < samples.columns.keys() and bool(_forms(samples) & set(FORMS))
    for matrix, axes in _rotations():
        if beside:
            mixed = {"mixed": ("position", numpy.array(matrix))}
            yield "space_axes", {"axes": axes, "entries": "positions"}, mixed
        space, body = replace(samples.declared, space=matrix), replace(samples.declared, body=matrix)
        for kind, reading in (("space_axes", space), ("body_axes", body)):
            yield from _scopes(samples, kind, {"axes": axes}, reading)


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


def _fitted(samples: Observations, simulated: SimulatedMotion) -> Iterator[Row]:
    """Fitted rotations of space and body axes, another point, another pivot, factors."""
    if len(samples.times) < 3:
        return
    yield from _turned(samples, simulated)
    yield from _scaled(samples, simulated)
    if "position" not in samples.columns:
        return
    declared, point = samples.declared, samples.point
    positions = declared.vectors(samples.columns["position"] - samples.pivot)
    true = simulated.rotation @ point
    size = float((true * true).sum())
    if size:
        yield from _near("position_unit", float((positions * true).sum()) / size, declared, "scale")
    offset = (positions - true).mean(axis=0)
    yield "pivot", {"offset": _list(offset)}, {"columns": replace(declared, offset=tuple(offset)), **_FITTED}
    in_body = numpy.einsum("nji,nj->ni", simulated.rotation, positions).mean(axis=0)
    yield "point", {"point": _list(in_body)}, {"columns": replace(declared, of_point=tuple(in_body)), **_FITTED}
    design = numpy.concatenate([simulated.rotation, numpy.tile(numpy.eye(3), (len(positions), 1, 1))], axis=2)
    if len(positions) >= _FEWEST and numpy.isfinite(design).all() and numpy.isfinite(positions).all():
        fitted = numpy.linalg.lstsq(design.reshape(-1, 6), positions.reshape(-1), rcond=None)[0]
        reading = replace(declared, of_point=tuple(fitted[:3]), offset=tuple(fitted[3:]))
        numbers = {"point": _list(fitted[:3]), "offset": _list(fitted[3:])}
        # a point or a pivot alone is the simpler mistake
        least = min(numpy.abs(shift).max() for shift in (fitted[:3] - point, fitted[3:]))
        if least > _SLIGHT * numpy.abs(fitted).max():
            yield "point_and_pivot", numbers, {"columns": reading, **_FITTED}


def _turned(samples: Observations, simulated: SimulatedMotion) -> Iterator[Row]:
    """A constant rotation of the axes of space, or of the body."""
    declared = samples.declared
    form = next((form for form in FORMS if form in samples.columns), None)
    rotations = None if form is None else declared.rotations(form, samples.columns[form])
    if rotations is None or not numpy.isfinite(rotations).all():
        return
    space = nearest_rotation((rotations @ simulated.rotation.transpose(0, 2, 1)).mean(axis=0))
    body = nearest_rotation((simulated.rotation.transpose(0, 2, 1) @ rotations).mean(axis=0))
    if declared.up == "z":
        yield "space_turned", {"angle": _angle(space)}, {"columns": replace(declared, space=_square(space)), **_FITTED}
    yield "body_turned", {"angle": _angle(body)}, {"columns": replace(declared, body=_square(body.T)), **_FITTED}


def _angle(matrix: Array) -> str:
    sine = numpy.linalg.norm(matrix - matrix.T) / 8**0.5  # of which the cosine knows half the digits
    angle = numpy.degrees(numpy.arctan2(sine, (numpy.trace(matrix) - 1) / 2))
    return f"{round(float(angle), 6):.6g}"


def _scaled(samples: Observations, simulated: SimulatedMotion) -> Iterator[Row]:
    for name in ("omega", "omega_space"):
        if name not in samples.columns:
            continue
        true = simulated.omega_space if name == "omega_space" else simulated.omega
        vectors, _ = samples.declared.angular_velocity(name, samples.columns[name])
        size = float((true * true).sum())
        if size:
            yield from _near("omega_scaled", float((vectors * true).sum()) / size, samples.declared, "omega")


def _near(kind: str, fitted: float, declared: Reading, name: str) -> Iterator[Row]:
    """The fitted factor of a reading, as the roundest number within 1e-9."""
    if not numpy.isfinite(fitted) or not fitted:
        return
    factor = plain_number(fitted, 1e-9 * abs(fitted))
    if factor and notable(factor, Fraction(1)):
        changes: dict[str, Any] = {name: float(factor)}
        yield kind, {"factor": decimal_text(factor, 8)}, {"columns": replace(declared, **changes), **_FITTED}


def _list(values: Array) -> str:
    return ", ".join(
        decimal_text(plain_number(float(v), 1e-9 * max(1e-3, float(numpy.abs(values).max()))), 8) for v in values
    )


def _pairs(samples: Observations) -> Iterator[Row]:
    """Two readings at once."""
    singles = [reading for reading in _readings(samples) if reading[0] != "extrinsic"] + list(_axes_of_space(samples))
    for i, (kind, numbers, first) in enumerate(singles):
        for second_kind, second_numbers, second in singles[i + 1 :]:
            if kind == second_kind:
                continue
            merged = _merged(samples.declared, first, second)
            if merged is not None:
                yield from _scopes(samples, f"{kind}+{second_kind}", {**numbers, **second_numbers}, merged)


def _merged(declared: Reading, first: Reading, second: Reading) -> Reading | None:
    """A reading with both changes; None where both change one property."""
    changes = {}
    for name in Reading.__dataclass_fields__:
        values = [value for value in (getattr(first, name), getattr(second, name)) if value != getattr(declared, name)]
        if len(values) > 1:
            return None
        if values:
            changes[name] = values[0]
    return replace(declared, **changes)
