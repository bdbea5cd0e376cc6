"""A rigid body as other programs describe it: mass, gravity, centre of mass and inertia tensor in any body axes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import permutations
from math import lcm
from pathlib import Path
from typing import Any

from heavytop.errors import InputError, argument, prefixed, quoted, refusal
from heavytop.precision import (
    Given,
    Vector,
    cross,
    dot,
    exact,
    exact_text,
    ordered,
    rational_root,
    round_to,
    shown,
    six_digits,
    square_root,
    vector,
)
from heavytop.top.attitude import Attitude, Rows, Three, multiplied, perpendicular, rotated, rotation_of, transposed
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.inertia_slips import (
    MassProperties,
    Tensor,
    determinant,
    has_second_moments,
    is_positive,
    mending,
    minus,
    plus,
    rows,
    six_of,
    six_of_nine,
    steiner,
)

# Principal axes of a symmetric tensor: exact where they are rational, else a rational rotation near them.
#
# A is a rotation in exact rationals whose columns are the principal axes, v_given = A v_principal.  Where the axes are
# irrational Aᵀ J A keeps entries off its diagonal, of some 2^-bits relative to the largest: this remainder is known
# exactly, and so is the error of a motion in these axes.


IDENTITY: tuple[Vector, Vector, Vector] = tuple(tuple(Fraction(i == j) for j in range(3)) for i in range(3))  # type: ignore[assignment]
_GUARD_BITS = 64
_MOST_SWEEPS = 60
_MOST_SPREAD = 2048
"""Bits; beyond it two moments differ by a factor of 2^1021 at least, more than any data may."""


@dataclass(frozen=True, slots=True)
class PrincipalAxes:
    """axes: the rows of A, a rotation, v_given = A v_principal.  moments: the diagonal.

    left: Aᵀ J A − diag(moments), exact; all 0 where the axes are exact.
    """

    axes: tuple[Vector, Vector, Vector]
    moments: Vector
    left: tuple[Vector, Vector, Vector]

    @property
    def exact(self) -> bool:
        """Whether these are the principal axes, without a remainder."""
        return not any(value for row in self.left for value in row)


def principal_axes(tensor: Rows[Fraction], bits: int) -> PrincipalAxes:
    """The principal axes of a symmetric tensor of exact rationals.

    A diagonal tensor keeps its axes.  bits: where they are irrational, what is left is within some 2^-bits of the
    smallest moment.  Raises InputError where moments of a tensor that is not diagonal differ by a factor above 1e300.
    """
    if not any(tensor[i][j] for i in range(3) for j in range(i)):
        return _with_remainder(tensor, IDENTITY)
    bits += _spread(tensor)
    near = _near(tensor, bits)
    turned = multiplied(transposed(near), multiplied(tensor, near))
    moments = [_exact_moment(tensor, turned[i][i], bits + _GUARD_BITS) for i in range(3)]
    is_exact = not any(determinant(_less(tensor, [moment] * 3)) for moment in moments)
    vectors = _unit_vectors(tensor, moments) if is_exact else None
    return _with_remainder(tensor, near, moments) if vectors is None else _with_remainder(tensor, _along(vectors, near))


def _with_remainder(tensor: Rows[Fraction], axes: Tensor, moments: Sequence[Fraction] | None = None) -> PrincipalAxes:
    """The principal axes with their remainder; moments: None for the diagonal in these axes."""
    rotated_tensor = multiplied(transposed(axes), multiplied(tensor, axes))
    first, second, third = moments or (rotated_tensor[i][i] for i in range(3))
    return PrincipalAxes(axes, (first, second, third), _less(rotated_tensor, (first, second, third)))


def _spread(tensor: Rows[Fraction]) -> int:
    """Bits by which the smallest moment may be below the largest entry, in whole words: det/trace² is a bound of it.

    0 for ordinary bodies, whose guard bits do, and for a tensor that has a moment below 0.
    """
    trace, product = tensor[0][0] + tensor[1][1] + tensor[2][2], determinant(tensor)
    if product <= 0:
        return 0
    ratio = Fraction(trace**3 / product)
    spread = ratio.numerator.bit_length() - ratio.denominator.bit_length()
    if spread > _MOST_SPREAD:
        raise InputError(
            "Two principal moments of the inertia tensor differ by a factor above 1e300.",
            "Check its entries and their units.",
        )
    return max(0, spread // _GUARD_BITS * _GUARD_BITS)


def _less(tensor: Rows[Fraction], moments: Sequence[Fraction]) -> Three[Vector]:
    """J − diag(moments)."""
    (a, b, c), (d, e, f), (g, h, i) = tensor
    return (a - moments[0], b, c), (d, e - moments[1], f), (g, h, i - moments[2])


def _exact_moment(tensor: Rows[Fraction], near: Fraction, bits: int) -> Fraction:
    """The rational moment near a number: over the common denominator it is an integer; else the number rounded."""
    common = lcm(*(value.denominator for row in tensor for value in row))
    candidate = Fraction(round(near * common), common)
    return round_to(near, bits) if determinant(_less(tensor, [candidate] * 3)) else candidate


def _along(vectors: Sequence[Vector], near: Rows[Fraction]) -> Three[Vector]:
    """The rotation whose columns are principal unit vectors, in the order and directions of the axes near them."""
    order = max(
        permutations(range(3)),
        key=lambda chosen: sum(abs(dot(vectors[chosen[i]], transposed(near)[i])) for i in range(3)),
    )
    columns = [vectors[index] for index in order]
    columns = [v if dot(v, u) >= 0 else (-v[0], -v[1], -v[2]) for v, u in zip(columns, transposed(near), strict=True)]
    if determinant(columns) < 0:
        columns[2] = (-columns[2][0], -columns[2][1], -columns[2][2])
    return transposed(columns)


def _unit_vectors(tensor: Rows[Fraction], moments: Sequence[Fraction]) -> list[Vector] | None:
    """Three rational unit vectors along principal axes; None where there are none."""
    single = [moment for moment in moments if moments.count(moment) == 1]
    vectors = []
    for moment in single:
        rows = _less(tensor, [moment] * 3)
        v = max((cross(rows[i], rows[j]) for i, j in ((0, 1), (1, 2), (2, 0))), key=lambda v: dot(v, v))
        length = rational_root(dot(v, v))
        if length is None:
            return None
        vectors.append((v[0] / length, v[1] / length, v[2] / length))
    if len(vectors) == 1:  # the other two moments are equal: any axes across
        across = perpendicular(vectors[0])
        vectors += [across, cross(vectors[0], across)]
    return vectors


def _near(tensor: Rows[Fraction], bits: int) -> tuple[Vector, Vector, Vector]:
    """A rotation that all but diagonalizes the tensor: Jacobi's method, each of its rotations a rational one.

    A sweep squares what is off the diagonal; it is computed from the tensor itself again after each.
    """
    size = max(abs(value) for row in tensor for value in row)
    working = bits + _GUARD_BITS
    q: tuple[Fraction, ...] = (Fraction(1), Fraction(0), Fraction(0), Fraction(0))
    for _ in range(_MOST_SWEEPS):
        axes = rotation_of(q)
        turned = multiplied(transposed(axes), multiplied(tensor, axes))
        off = max(abs(turned[i][j]) for i in range(3) for j in range(i))
        if off <= size / 2**working:
            break
        present = [[round_to(value / size, working + _GUARD_BITS) for value in row] for row in turned]
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            u = _half_angle(present, i, j, working + _GUARD_BITS)
            turn = [Fraction(1), Fraction(0), Fraction(0), Fraction(0)]
            turn[1 + axis] = u
            step = rotation_of(turn)
            present = [
                [round_to(value, working + _GUARD_BITS) for value in row]
                for row in multiplied(transposed(step), multiplied(present, step))
            ]
            q = tuple(round_to(value, working + _GUARD_BITS) for value in _product(q, turn))
    return rotation_of(q)


def _half_angle(rows: Sequence[Sequence[Fraction]], i: int, j: int, bits: int) -> Fraction:
    """tan of half the angle about the third axis by which the entry (i, j) vanishes, in [−tan π/8, tan π/8]."""
    if rows[i][j] == 0:
        return Fraction(0)
    # tan 2φ = −2 J_ij/(J_jj − J_ii) for the rotation R_k(φ), i j k cyclic, of Jᵢⱼ' = 0
    theta = (rows[j][j] - rows[i][i]) / (2 * rows[i][j])
    t = -1 / (abs(theta) + square_root(theta * theta + 1, bits)) * (1 if theta >= 0 else -1)
    return round_to(t / (1 + square_root(1 + t * t, bits)), bits)


def _product(p: Sequence[Fraction], q: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """The product of two quaternions: the rotation of q first."""
    w = cross(p[1:], q[1:])
    return (p[0] * q[0] - dot(p[1:], q[1:]), *(p[0] * q[i + 1] + q[0] * p[i + 1] + w[i] for i in range(3)))


PIVOT, CENTRE = "pivot", "centre of mass"
_ROUNDED_BITS = 256
_ROUNDED_DATA = Fraction(1, 2**40)
"""Tolerance of a plate or a rod in rounded numbers."""
_PRINTED_DATA = Fraction(1, 10**6)
"""Tolerance, as a part of the tensor, of a plate or a rod in seven digits."""
_SHAPES = "Give 3 numbers (a diagonal tensor), 6 (I11, I22, I33, I12, I13, I23) or 9 (row by row)."


@dataclass(frozen=True, slots=True, init=False)
class Body:
    """A rigid body that turns about a fixed point, the pivot; all vectors in one set of body axes of any direction.

    mass: positive.  gravity: the acceleration of gravity, 0 or positive; it points down.
    centre: the centre of mass, from the pivot.
    tensor: the inertia tensor about the pivot, three rows.  about: what it was given about.
    rotor: k, the constant angular momentum of a rotor relative to the body, or None (a heavy gyrostat with one).
    Units are the user's, any that fit together, such as SI.

    Raises InputError for what no body has, and where ``about`` is missing though the centre is not the pivot.
    """

    mass: Fraction
    gravity: Fraction
    centre: Vector
    tensor: Tensor
    about: str | None
    rotor: Vector | None

    def __init__(
        self,
        mass: Given,
        gravity: Given,
        centre: Iterable[Any],
        inertia: Iterable[Any],
        about: str | None = None,
        rotor: Iterable[Any] | None = None,
    ) -> None:
        data = {"mass": _number(mass, "mass"), "gravity": magnitude_of_gravity(gravity)}
        if data["mass"] <= 0:
            raise refusal("mass", "positive", shown(data["mass"]), "Give the mass of the body.")
        centre_vector = vector(centre, "centre")
        inertia_tensor = _tensor(inertia)
        to_pivot = _about(about, centre_vector) == CENTRE
        at_pivot = plus(inertia_tensor, steiner(data["mass"], centre_vector)) if to_pivot else inertia_tensor
        _require_positive(at_pivot, MassProperties(six_of(inertia_tensor), data["mass"], centre_vector, not to_pivot))
        whirl = None if rotor is None else vector(rotor, "rotor")
        values = {**data, "centre": centre_vector, "tensor": at_pivot, "about": about, "rotor": whirl}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_file(
        cls, path: str | Path, link: str | None = None, pivot: Iterable[Any] | None = None, gravity: Given | None = None
    ) -> Body:
        """The body of a URDF, MJCF, SDF, USD (text) or TOML file, or its link of that name, in the axes of the link.

        pivot: the fixed point there; without it the ball joint of the body, or the origin.  gravity: without it that
        of the file, or 9.81.
        Raises InputError for a file that cannot be read, for several bodies without ``link``, and for a tensor that no
        body has, with the slip that makes it one.
        """
        from heavytop.top.body_files import read_body

        if not isinstance(path, (str, Path)):
            raise refusal("path", "a path", quoted(path), "Give text or a pathlib.Path.")
        link_or_body = read_body(Path(path), link)
        body = link_or_body.about(None if pivot is None else vector(pivot, "pivot"))
        gravity = link_or_body.gravity_down if gravity is None else gravity
        return cls(body.mass, gravity, body.centre, body.six, PIVOT if body.at_pivot else CENTRE)

    def __repr__(self) -> str:
        texts = [[exact_text(value) for value in row] for row in self.tensor]
        extra = "" if self.rotor is None else f", rotor={_texts(self.rotor)}"
        return (
            f"Body(mass='{exact_text(self.mass)}', gravity='{exact_text(self.gravity)}', centre={_texts(self.centre)}, "
            f"inertia={texts}, about='{PIVOT}'{extra})"
        )

    @classmethod
    def realising(cls, top: HeavyTop) -> Body | None:
        """A body that moves as the top does, in its axes; None where the triangle inequality forbids it.

        Where the top has no mass it is a power of two so small that Steiner's part is at most 1/64 of every moment.
        """
        up = -1 if top.weight < 0 else 1
        centre, square = vector([up * part for part in top.centre], "centre"), dot(top.centre, top.centre)
        mass = top.mass
        if mass is None:
            most = min(top.inertia) / (64 * square) if top.weight * square else Fraction(1)
            mass = Fraction(2) ** (most.numerator.bit_length() - most.denominator.bit_length() - 1)
        body = cls(mass, abs(top.weight) / mass, centre, top.inertia, PIVOT)
        slack = _ROUNDED_DATA * sum(top.inertia) / 2
        return body if is_positive(body.central) and has_second_moments(body.central, slack) else None

    @property
    def central(self) -> Tensor:
        """The inertia tensor about the centre of mass."""
        return minus(self.tensor, steiner(self.mass, self.centre))

    @property
    def weight(self) -> Fraction:
        """P = m g."""
        return self.mass * self.gravity

    @property
    def moment(self) -> Vector:
        """n = m g c, in the axes given."""
        x, y, z = self.centre
        return self.weight * x, self.weight * y, self.weight * z

    def principal(self, bits: int = _ROUNDED_BITS) -> PrincipalAxes:
        """Its principal axes, to that many bits where they are irrational."""
        return principal_axes(self.tensor, bits)

    @property
    def axes(self) -> Tensor:
        """Rows of A with v_given = A v_principal; exact where the principal axes are rational, else to 256 bits."""
        return self.principal().axes

    @property
    def top(self) -> HeavyTop:
        """The body in principal axes, with moments at the pivot, weight m g, centre; exact, or to 256 bits."""
        return self.top_in(self.principal())

    def top_in(self, principal: PrincipalAxes) -> HeavyTop:
        """The heavy top of these principal axes; it lacks what ``principal.left`` says."""
        turn = transposed(principal.axes)
        centre = rotated(turn, self.centre)
        rotor = None if self.rotor is None else rotated(turn, self.rotor)
        return HeavyTop(principal.moments, self.weight, centre, rotor, self.mass)

    def warnings(self) -> list[str]:
        """Data that no rigid body has, though the equations do not mind."""
        return _warnings_about_centre(self) or self.top.warnings()


@dataclass(frozen=True, slots=True)
class Frame:
    """The axes in which a motion was given, where they are not the principal axes.

    axes: the rows of A, v_given = A v_principal.  centre: of mass; gamma, xi: γ and ξ at t = 0; all in the axes given.
    """

    axes: Tensor
    centre: Vector
    gamma: Vector
    xi: Vector | None


def _texts(values: Vector) -> str:
    return f"({', '.join(repr(exact_text(value)) for value in values)})"


def magnitude_of_gravity(value: Given) -> Fraction:
    """The acceleration of gravity; raises InputError for a negative one."""
    magnitude = _number(value, "gravity")
    if magnitude < 0:
        raise InputError(
            f"gravity must not be negative; got {shown(magnitude)}.",
            "Give its magnitude, such as 9.81. Gravity points down: along -e_z, or against the axis that up names.",
        )
    return magnitude


def _number(value: Given, what: str) -> Fraction:
    with prefixed(what):
        return exact(value)


def _about(about: object, centre: Vector) -> str:
    """The point that the tensor is about; without the word only where both are the same."""
    if about is None:
        if any(centre):
            raise InputError(
                "The reference point of the inertia tensor (about) is missing.",
                f'Give about = "{PIVOT}" or "{CENTRE}": with the centre of mass off the pivot they differ.',
            )
        return PIVOT
    if not isinstance(about, str) or about not in (PIVOT, CENTRE):
        raise refusal("about", f'"{PIVOT}" or "{CENTRE}"', quoted(about), "Give one of these.")
    return about


def _tensor(inertia: Iterable[Any]) -> Tensor:
    """Three rows out of three, six or nine numbers or three rows; raises InputError where it is not symmetric."""
    values = ordered(inertia, "inertia", _SHAPES)
    if len(values) == 3 and all(isinstance(value, Iterable) and not isinstance(value, str) for value in values):
        values = [part for row in values for part in vector(row, "a row of the inertia tensor")]
    if len(values) not in (3, 6, 9):
        raise InputError(f"inertia must have 3, 6 or 9 numbers; got {len(values)}.", _SHAPES)
    n = [_number(value, "inertia") for value in values]
    return rows(six_of_nine(n) if len(n) == 9 else [*n, *[Fraction(0)] * (6 - len(n))])


def _warnings_about_centre(body: Body) -> list[str]:
    """Whether the tensor about the centre of mass can be that of a body; where not, with the slip that mends it."""
    slack = _PRINTED_DATA * sum(body.tensor[i][i] for i in range(3)) / 2
    if has_second_moments(body.central, slack):
        return []
    moments = ", ".join(six_digits(value) for value in _principal_moments(body.central))
    six, at_pivot = six_of(body.central if body.about == CENTRE else body.tensor), body.about != CENTRE
    slip = mending(MassProperties(six, body.mass, body.centre, at_pivot, slack))
    sentence = f"The inertia tensor about the centre of mass, of principal moments {moments}, is not a rigid body's."
    return [f"{sentence} {slip}".rstrip()]


def _principal_moments(tensor: Tensor) -> list[Fraction]:
    """In increasing order, to the digits of double; exact of a diagonal tensor."""
    import numpy

    if not any(tensor[i][j] for i, j in ((0, 1), (0, 2), (1, 2))):
        return sorted(tensor[i][i] for i in range(3))
    size = max(abs(value) for row in tensor for value in row)
    values = numpy.linalg.eigvalsh([[float(value / size) for value in row] for row in tensor])
    return [Fraction(value) * size for value in values.tolist()]


def _require_positive(tensor: Tensor, body: MassProperties) -> None:
    """Raises InputError unless every principal moment about the pivot is positive; names the slip that mends it."""
    if is_positive(tensor):
        return
    least = six_digits(_principal_moments(tensor)[0])
    remedy = "Check its entries, and the signs of the products of inertia: I12 is minus the integral of x y dm."
    cause = f"The principal moments of inertia must be positive; the smallest is {least}."
    raise InputError(cause, mending(body) or remedy)


# A body and its start from texts: options of the command line, tables of a plan.


BODY = ("inertia", "weight", "centre", "mass", "gravity", "about", "rotor")
START = ("omega", "omega_space", "gamma", "quaternion", "euler", "matrix", "axis_angle")
"""The keys of a body and of a start."""
_ATTITUDES = ("gamma", "quaternion", "euler", "matrix", "axis_angle")


def motion_of(values: Mapping[str, Any], normalize: bool = False) -> tuple[HeavyTop | Body, State]:
    """The top, or the body, and the start that these texts give; what is None or missing was not given.

    values: by the keys of :data:`BODY` and :data:`START`; lists of texts, or one text for a number.  With mass and
    gravity it is a body in any axes, with weight a top in principal axes.
    normalize: move γ, or a quaternion or matrix, to a rotation in exact rationals near it.
    Raises InputError for what is missing, contradicts another, or describes an invalid body or start.
    """
    data = {key: value for key, value in values.items() if value is not None and value != []}
    if "file" in data:
        return body_of(data), _start(data, normalize)
    if "link" in data:
        raise InputError(f"{argument('link')} was given without {argument('file')}.", "Give the file of the link.")
    for key in ("inertia", "centre"):
        _require(data, key)
    return _body(data), _start(data, normalize)


def body_of(data: Mapping[str, Any]) -> Body:
    """The body of a ``file``, and ``link``, with the gravity that stands beside it; raises InputError for more keys."""
    twice = [key for key in BODY if key in data and key != "gravity"]
    if twice:
        given = argument(twice[0])
        raise InputError(f"{argument('file')} and {given} were given.", f"The file defines {twice[0]}: omit {given}.")
    return Body.from_file(data["file"], data.get("link"), gravity=data.get("gravity"))


def _require(data: Mapping[str, Any], key: str) -> Any:
    if key not in data:
        raise InputError(f"{argument(key)} is missing.", "Give it, or the name of a case that defines it.")
    return data[key]


def _body(data: Mapping[str, Any]) -> HeavyTop | Body:
    described = [key for key in ("mass", "gravity", "about") if key in data]
    rotor = data.get("rotor")
    if "weight" in data:
        if described:
            raise InputError(
                f"{argument('weight')} and {argument(described[0])} were given.",
                "Give weight with principal moments about the pivot, or mass and gravity with a tensor in any axes.",
            )
        if len(data["inertia"]) in (6, 9):
            raise InputError(
                f"{argument('inertia')} has {len(data['inertia'])} numbers, and a weight was given.",
                "A tensor in any axes needs mass and gravity in place of weight; with weight give 3 principal moments.",
            )
        return HeavyTop(data["inertia"], data["weight"], data["centre"], rotor)
    if not described:
        raise InputError("Neither weight nor mass and gravity were given.", "Give weight, or mass and gravity.")
    for key in ("mass", "gravity"):
        _require(data, key)
    return Body(data["mass"], data["gravity"], data["centre"], data["inertia"], data.get("about"), rotor)


def _start(data: Mapping[str, Any], normalize: bool) -> State:
    named = [key for key in _ATTITUDES[1:] if key in data]
    if len(named) > 1:
        raise InputError(f"{argument(named[0])} and {argument(named[1])} were given.", "Give the attitude once.")
    if not named and "gamma" not in data:
        raise InputError("No attitude was given.", f"Give one of {', '.join(map(argument, _ATTITUDES))}.")
    spin = {key: data.get(key) for key in ("omega", "omega_space")}
    if not named:
        start = State(gamma=data["gamma"], **spin)
        return start.normalized() if normalize else start
    return State(gamma=data.get("gamma"), attitude=_attitude(named[0], data[named[0]], normalize), **spin)


def _attitude(kind: str, value: Any, normalize: bool) -> Attitude:
    if kind == "matrix":
        return Attitude.matrix(value, normalize=normalize)
    if kind == "quaternion":
        if len(value) != 4:
            raise InputError(f"quaternion must have 4 numbers; got {len(value)}.", "Give w,x,y,z, the scalar first.")
        return Attitude.quaternion(*value, normalize=normalize)
    if kind == "axis_angle":
        axis, colon, angle = value.partition(":") if isinstance(value, str) else ("", "", "")
        if not colon:
            raise refusal("axis_angle", "an axis and an angle", quoted(value), "Give x,y,z:angle.")
        return Attitude.axis_angle(axis.split(","), angle)
    sequence, colon, angles = value.partition(":") if isinstance(value, str) else ("", "", "")
    parts = angles.split(",")
    if not colon or len(parts) != 3:
        raise refusal("euler", "a sequence and three angles", quoted(value), "Give ZXZ:a,b,c or another sequence.")
    return Attitude.euler(sequence.strip(), *parts)
