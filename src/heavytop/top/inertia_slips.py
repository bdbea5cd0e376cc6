"""Inertia tensors that no body has, or that are implausible, and the slip that explains them.

A tensor J about the centre of mass is that of a body where ∫ x xᵀ dm = ½ tr J − J is positive semidefinite (the
triangle inequality of the principal moments) and J itself is positive definite.  All tests are exact, with a slack
for the rounding of the printed numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain, combinations, permutations, product

from heavytop.errors import InputError
from heavytop.precision import Vector, cross, decimal_text, distinct_digits, dot, round_to, six_digits
from heavytop.top.attitude import Rows, multiplied, transposed

Tensor = tuple[Vector, Vector, Vector]
Six = tuple[Fraction, Fraction, Fraction, Fraction, Fraction, Fraction]
"""I11, I22, I33, I12, I13, I23."""

_DENSEST = 25_000
"""kg/m³; osmium has 22,590."""
_THINNEST = Fraction(1, 10_000)
"""kg/m³ of the cube around a body; a rod of 1 kg and 10 m has 1e-3."""
_PLAUSIBLE = (0.05, _DENSEST)
_FAR_CENTRE = 100
"""Sizes of the body between its axes and its centre of mass."""
_ROUND = 10
"""The least factor by which the products of inertia shrink without Steiner's part of a tensor about the pivot."""
_APART = Fraction(1, 20)
"""The relative distance from which on a tensor differs from that of the geometry in the file."""
_HULL, _END = 3, 5
"""Largest second moments of a body within a box, a cylinder or a sphere, in those of the uniform shape: their trace, as
with all mass in the corners of a box; along an axis, as in two poles of a sphere."""
_DENSE_CORE = Fraction(1, 30)
"""Their least trace that a unit may leave."""
_TYPICAL = 300
"""kg/m³ of a fifth of the cube around a body."""
_SMALL = Fraction(1, 10**9)
_ROUNDINGS = Fraction(1, 2**48)
"""Largest asymmetry of a tensor computed in double, relative to its largest entry."""
_SHOWN_BITS = 56


@dataclass(frozen=True, slots=True)
class MassProperties:
    """Mass properties as in the file.

    six: the tensor in the order of :data:`Six`, about the centre of mass, or about the pivot where ``at_pivot``.
    centre: of mass, from the pivot.  slack: rounding of the printed numbers, of any entry.  si: kg and metres.
    geometry: the tensor of the shape in the same file, about its centre, uniform and of 1 kg; and the rotation of its
    axes.
    """

    six: Six
    mass: Fraction
    centre: Vector
    at_pivot: bool = False
    slack: Fraction = Fraction(0)
    si: bool = False
    geometry: Tensor | None = None
    geometry_axes: Tensor | None = None

    @property
    def central(self) -> Tensor:
        """The tensor about the centre of mass."""
        tensor = rows(self.six)
        return minus(tensor, steiner(self.mass, self.centre)) if self.at_pivot else tensor


@dataclass(frozen=True, slots=True)
class Slip:
    """A slip that explains a tensor.

    inertia: the corrected six numbers, None for one that the file lacks.  mass, centre: corrected, None if correct.
    """

    name: str
    sentence: str
    inertia: tuple[Fraction | None, ...]
    mass: Fraction | None = None
    centre: Vector | None = None


def rows(six: Sequence[Fraction]) -> Tensor:
    """The symmetric tensor of six numbers."""
    a, b, c, d, e, f = six
    return (a, d, e), (d, b, f), (e, f, c)


def six_of(tensor: Tensor) -> Six:
    """The six numbers of a symmetric tensor."""
    return tensor[0][0], tensor[1][1], tensor[2][2], tensor[0][1], tensor[0][2], tensor[1][2]


def six_of_nine(n: Sequence[Fraction]) -> Six:
    """The six numbers of a tensor row by row, the upper ones where two differ by roundings of double.

    Raises InputError where it is not symmetric.
    """
    for i, j in ((0, 1), (0, 2), (1, 2)):
        upper, lower = n[3 * i + j], n[3 * j + i]
        if abs(upper - lower) > _ROUNDINGS * max(map(abs, n)):
            one, other = distinct_digits(upper, lower)
            raise InputError(
                f"The inertia tensor is not symmetric: I{i + 1}{j + 1} = {one}, I{j + 1}{i + 1} = {other}.",
                "Give the same number in both places.",
            )
    return n[0], n[4], n[8], n[1], n[2], n[5]


def steiner(mass: Fraction, centre: Vector) -> Tensor:
    """m (|c|² 1 − c cᵀ), the tensor about the pivot less the one about the centre of mass."""
    square = dot(centre, centre)
    x, y, z = (mass * (square - value * value) for value in centre)
    a, b, c = centre
    return rows((x, y, z, -mass * a * b, -mass * a * c, -mass * b * c))


def minus(left: Tensor, right: Tensor) -> Tensor:
    """The difference of two symmetric tensors."""
    return rows([a - b for a, b in zip(six_of(left), six_of(right), strict=True)])


def plus(left: Tensor, right: Tensor) -> Tensor:
    """The sum of two symmetric tensors."""
    return rows([a + b for a, b in zip(six_of(left), six_of(right), strict=True)])


def second_moments(central: Tensor) -> Tensor:
    """∫ x xᵀ dm = ½ tr J − J about the centre of mass."""
    half = (central[0][0] + central[1][1] + central[2][2]) / 2
    return minus(rows((half, half, half, *[Fraction(0)] * 3)), central)


def _semidefinite(tensor: Tensor, slack: Fraction) -> bool:
    """Whether tensor + slack is positive semidefinite: all principal minors are 0 or positive."""
    t = minus(tensor, rows((-slack, -slack, -slack, *[Fraction(0)] * 3)))
    minors = [t[i][i] for i in range(3)] + [t[i][i] * t[j][j] - t[i][j] ** 2 for i, j in combinations(range(3), 2)]
    return min(*minors, determinant(t)) >= 0


def determinant(tensor: Rows[Fraction]) -> Fraction:
    """det J."""
    return dot(tensor[0], cross(tensor[1], tensor[2]))


def has_second_moments(central: Tensor, slack: Fraction = Fraction(0)) -> bool:
    """Whether a body, a plate, a rod or a point has this tensor about its centre of mass: the triangle inequality."""
    return _semidefinite(second_moments(central), slack)


def is_positive(tensor: Tensor) -> bool:
    """Whether every principal moment is positive, by the leading minors."""
    return min(tensor[0][0], tensor[0][0] * tensor[1][1] - tensor[0][1] ** 2, determinant(tensor)) > 0


def mending(body: MassProperties) -> str:
    """The slips as sentences with the corrected numbers; empty where none makes the tensor that of a body."""
    told = []
    for slip in slips(body):
        numbers = ", ".join(six_digits(value) for value in slip.inertia if value is not None)
        is_same = None in slip.inertia or slip.inertia == body.six
        told += [slip.sentence] if is_same else [f"{slip.sentence} Corrected: inertia = [{numbers}]."]
    return " ".join(told)


def realisable(central: Tensor, slack: Fraction = Fraction(0)) -> bool:
    """Whether a body has this tensor about its centre of mass: positive moments, triangle inequality."""
    six = six_of(central)
    # a moment that is 0 but for roundings, of which a diagonal tensor has none: all mass is on a line
    largest, products = max(map(abs, six)), max(map(abs, six[3:]))
    floor = max(_ROUNDINGS * largest, min(slack, 2 * slack * products / largest)) if products else Fraction(0)
    return has_second_moments(central, slack) and is_positive(central) and _semidefinite(central, -floor)


def slips(body: MassProperties) -> list[Slip]:
    """The slips of which one makes the tensor that of a body, the likeliest first; [] where nothing is implausible.

    A realisable tensor is implausible where no material is so dense or so thin, where the centre of mass lies a hundred
    sizes away, where Steiner's part explains its products of inertia, or where the geometry of the file has another.
    No slip contradicts that geometry.
    """
    possible = realisable(body.central, body.slack)
    if not possible and has_second_moments(body.central, body.slack):
        return [_rod(body)]
    if slip := next(_against_geometry(body), None):
        return [slip]
    if not possible:
        mends = [pair for pair in _mends(body) if realisable(pair[1].central, body.slack) and _in_shape(pair[1])]
        mends.sort(key=lambda pair: _ROUND * _products(pair[1]) > _products(body))
        return [_possible(slip) if len(mends) > 1 or slip.name in _MEND_NEARLY_ALL else slip for slip, _ in mends]
    return [*_of_units(body), *_of_products(body)][:3] or [*_beyond_shape(body)]


_MEND_NEARLY_ALL = ("about_centre", "millimetres")
"""Slips that explain nearly every tensor beyond the triangle inequality."""


def _possible(slip: Slip) -> Slip:
    """A slip that others may explain as well."""
    return replace(slip, sentence=f"Possibly, {slip.sentence[0].lower()}{slip.sentence[1:]}")


def _rod(body: MassProperties) -> Slip:
    if not any(six_of(body.central)):
        sentence = (
            "All moments are 0, as of a point mass, whose rotation has no equation of motion. Give positive moments."
        )
        return Slip("point_mass", sentence, body.six)
    return Slip(
        "rod",
        "A principal moment is 0, as of a rod without thickness: the rotation about its axis has no equation of "
        "motion. Give the rod a radius r: the moment is m r^2/2.",
        body.six,
    )


def _mends(body: MassProperties) -> Iterator[tuple[Slip, MassProperties]]:
    """Each slip, with the mass properties that it implies."""
    n = body.six
    for six, which in (
        (
            (n[0], n[3], n[5], n[1], n[2], n[4]),
            "ixx ixy ixz iyy iyz izz, and they were read as I11 I22 I33 I12 I13 I23",
        ),
        (
            (n[0], n[3], n[4], n[1], n[5], n[2]),
            "I11 I22 I33 I12 I13 I23, and they were read as ixx ixy ixz iyy iyz izz",
        ),
    ):
        yield _mend(body, "order_urdf", f"The six numbers are in the order {which}.", six)
    yield from _row_major(body)
    flipped = (*n[:3], -n[3], -n[4], -n[5])
    sentence = "The products of inertia have the opposite sign: I12 is minus the integral of x y dm."
    if flipped != n:
        yield _mend(body, "signs_of_products", sentence, flipped)
    if not body.at_pivot and any(body.centre):
        sentence = "The tensor was already about the centre of mass when the Steiner term was subtracted."
        yield _mend(body, "about_centre", sentence, six_of(plus(rows(n), steiner(body.mass, body.centre))))
    if negative := sum(value < 0 for value in n[:3]):
        cause = "A moment of inertia is negative: its sign is" if negative == 1 else "Signs of moments of inertia are"
        yield _mend(body, "negative_moment", f"{cause} wrong.", (abs(n[0]), abs(n[1]), abs(n[2]), *n[3:]))
    if body.at_pivot:
        slip = Slip("about_centre", "The tensor is about the centre of mass, and was read as about the pivot.", n)
        yield slip, replace(body, at_pivot=False)
        centre = _metres(body.centre)
        sentence = "The centre of mass is in millimetres, and the tensor in metres."
        yield Slip("millimetres", sentence, n, centre=centre), replace(body, centre=centre)


def _metres(centre: Vector) -> Vector:
    x, y, z = (value / 1000 for value in centre)
    return x, y, z


def _mend(body: MassProperties, name: str, sentence: str, six: Sequence[Fraction]) -> tuple[Slip, MassProperties]:
    a, b, c, d, e, f = six
    return Slip(name, sentence, (a, b, c, d, e, f)), replace(body, six=(a, b, c, d, e, f))


def _row_major(body: MassProperties) -> Iterator[tuple[Slip, MassProperties]]:
    """The slip of the first six of the nine numbers of a matrix in place of the six; its last one is missing."""
    n = body.six
    if abs(n[1] - n[3]) > _SMALL * max(map(abs, n)):
        return
    for first, second, products in ((n[0], n[4], (n[1], n[2], n[5])), (n[0], n[5], (n[3], n[4], n[2]))):
        if first <= 0 or second <= 0:
            continue
        sentence = "These are the first six numbers of the matrix row by row; I33 is not among them."
        parts = (Fraction(part, 64) * (first + second) for part in range(64, 0, -1))  # of what the inequality allows
        for third in parts if body.geometry is None else (body.mass * body.geometry[2][2],):
            mended = replace(body, six=(first, second, third, *products))
            if realisable(mended.central, body.slack):
                yield Slip("row_major", sentence, (first, second, None, *products)), mended
                break


def _size(body: MassProperties) -> float:
    """Diagonal of the uniform box with these moments, √(12 tr S/m)."""
    trace = sum(second_moments(body.central)[i][i] for i in range(3))
    return math.sqrt(12 * trace / body.mass)


_INCH, _POUND = Fraction("0.0254"), Fraction("0.45359237")
_UNITS: tuple[tuple[str, str, Fraction | int], ...] = (
    ("millimetres", "kg mm^2", 10**6),
    ("centimetres", "kg cm^2", 10**4),
    ("grams", "g m^2", 10**3),
    ("grams", "g cm^2", 10**7),
    ("grams", "g mm^2", 10**9),
    ("inches", "kg in^2, or lb in^2 beside a mass in lb", 1 / _INCH**2),
    ("inches", "lb in^2", 1 / _POUND / _INCH**2),
)
"""Names of units of length or mass, units of a tensor, and their number in a kg m^2."""


def _of_units(body: MassProperties) -> Iterator[Slip]:
    if not body.si or body.mass <= 0:
        return
    size = _size(body)
    if not size:
        return
    if dot(body.centre, body.centre) > (_FAR_CENTRE * size) ** 2:
        sentence = "The centre of mass is in millimetres: it lies more than 100 times the size of the body away."
        yield Slip("millimetres", sentence, body.six, centre=_metres(body.centre))
    density = float(body.mass) / size**3
    if 5 * density > _DENSEST:  # the box of this diagonal has at most its cube / 3√3
        only_mass = replace(body, mass=body.mass / 1000)
        if _PLAUSIBLE[0] < 5 * float(only_mass.mass) / _size(only_mass) ** 3 < _PLAUSIBLE[1]:
            sentence = "The mass is in grams: no material is as dense as this body."
            yield Slip("grams", sentence, body.six, only_mass.mass)
            return
    likely = []
    for (name, unit, number), (slip, mended) in zip(_UNITS, _in_units(body), strict=True):
        mended = replace(mended, mass=body.mass / 1000) if name == "grams" else mended
        wrong = 5 * density > _DENSEST if number == 1000 else density < _THINNEST and name != "inches"
        reason = "no material is as dense as this body" if number == 1000 else "a body this large is thinner than air"
        slip = replace(slip, sentence=f"The tensor is in {unit}: {reason}.")
        ratio = 5 * float(mended.mass) / _size(mended) ** 3
        if wrong and _PLAUSIBLE[0] < ratio < _PLAUSIBLE[1] and _DENSE_CORE < _trace_ratio(mended) < _HULL:
            likely.append((abs(math.log(ratio / _TYPICAL)) + abs(math.log(mended.mass)), _of_mass(slip, mended, body)))
    yield from (slip for _, slip in sorted(likely, key=lambda pair: pair[0]))


def _of_mass(slip: Slip, mended: MassProperties, body: MassProperties) -> Slip:
    return slip if mended.mass == body.mass else replace(slip, mass=mended.mass)


def _products(body: MassProperties) -> Fraction:
    """The largest product of inertia."""
    return max(map(abs, body.six[3:]))


def _of_products(body: MassProperties) -> Iterator[Slip]:
    """The slip of a tensor that without Steiner's part is that of a body, and nearly diagonal."""
    if body.at_pivot or body.geometry is not None:
        return
    less = six_of(minus(rows(body.six), steiner(body.mass, body.centre)))
    with_part, without = _products(body), max(map(abs, less[3:]))
    if with_part > body.slack and without * _ROUND <= with_part and realisable(rows(less), body.slack):
        sentence = "The tensor is about the pivot, and was read as about the centre of mass: its products of inertia "
        sentence += "are those of the Steiner term."
        yield Slip("about_pivot", sentence, less)


def _trace_ratio(body: MassProperties) -> Fraction:
    """Square of the radius of gyration about the centre of mass, in that of the uniform shape; 1 without a shape."""
    if body.geometry is None:
        return Fraction(1)
    return sum(body.central[i][i] for i in range(3)) / (body.mass * sum(body.geometry[i][i] for i in range(3)))


def _in_shape(body: MassProperties) -> bool:
    """Whether a body within the shape in its file can have this tensor, by the second moments along its axes."""
    if body.geometry is None or (axes := body.geometry_axes) is None:
        return True
    moments = (second_moments(tensor) for tensor in (body.central, body.geometry))
    body_moments, uniform = (multiplied(transposed(axes), multiplied(tensor, axes)) for tensor in moments)
    return all(body_moments[i][i] <= _END * body.mass * uniform[i][i] + body.slack for i in range(3))


def _beyond_shape(body: MassProperties) -> Iterator[Slip]:
    """The finding that the radius of gyration exceeds that of all bodies within the shape of the file."""
    if body.geometry is not None and (ratio := _trace_ratio(body)) > _HULL:
        half = sum(body.geometry[i][i] for i in range(3)) / 2
        radius, limit = (decimal_text(Fraction(math.sqrt(factor * half)), 3) for factor in (ratio, _HULL))
        sentence = f"The radius of gyration is {radius} m; within the shape in the file it is at most {limit} m."
        yield Slip("beyond_shape", sentence, body.six)


def _against_geometry(body: MassProperties) -> Iterator[Slip]:
    """The slips by which the tensor becomes that of the shape in the file."""
    if body.geometry is None or (apart := _from_shape(body)) < _APART:
        return
    lighter, size = body, _size(replace(body, six=six_of(body.geometry), mass=Fraction(1), at_pivot=False))
    if 5 * float(body.mass) / size**3 > _DENSEST:
        lighter = replace(body, mass=body.mass / 1000)
    less = six_of(minus(rows(body.six), steiner(body.mass, body.centre)))
    pivot = _mend(body, "about_pivot", "The tensor is about the pivot, and was read as about the centre of mass.", less)
    for slip, mended in chain(_conjugated(body), _mends(body), [pivot], _in_units(lighter), _of_axes(body)):
        if _from_shape(mended) * _ROUND < min(apart, Fraction(1, 5)):
            yield _of_mass(slip, mended, body)


def _conjugated(body: MassProperties) -> Iterator[tuple[Slip, MassProperties]]:
    """The tensor of principal axes V written as Vᵀ D V."""
    if body.geometry_axes is None:
        return
    axes = body.geometry_axes
    twice = multiplied(multiplied(axes, multiplied(axes, rows(body.six))), transposed(multiplied(axes, axes)))
    six = [round_to(value, _SHOWN_BITS) for value in six_of(twice)]
    yield _mend(body, "conjugate_axes", "The rotation of the principal axes is the inverse of what was meant.", six)


def _in_units(body: MassProperties) -> Iterator[tuple[Slip, MassProperties]]:
    for name, unit, number in _UNITS:
        yield _mend(body, name, f"The tensor is in {unit}.", [value / number for value in body.six])


def _of_axes(body: MassProperties) -> Iterator[tuple[Slip, MassProperties]]:
    """Signs of single products of inertia, and axes taken for one another."""
    tensor = rows(body.six)
    for order in permutations(range(3)):
        name, sentence = "signs_of_products", "Some products of inertia have the opposite sign."
        if order != (0, 1, 2):
            axes = ", ".join(f"I{i + 1}{i + 1}" for i in order)
            name, sentence = "exchanged_axes", f"The axes are exchanged: {axes} were meant as I11, I22, I33."
        moments = [tensor[i][i] for i in order]
        products = [tensor[order[i]][order[j]] for i, j in combinations(range(3), 2)]
        for signs in product((1, -1), repeat=3):
            yield _mend(body, name, sentence, [*moments, *(a * b for a, b in zip(signs, products, strict=True))])


def _from_shape(body: MassProperties) -> Fraction:
    """Largest difference from the uniform shape in the file, relative to its largest entry."""
    shape = [body.mass * value for value in six_of(body.geometry or body.central)]
    return max(abs(a - b) for a, b in zip(six_of(body.central), shape, strict=True)) / max(map(abs, shape))
