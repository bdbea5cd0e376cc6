"""The attitude of a body: rotation matrix, quaternion, Euler angles, axis and angle, over any ring.

Conventions, here and nowhere else:

R takes components in body axes to components in space axes, v_space = R v_body.  Space axis e_z points vertically up.
Its rows are ξ, η = γ × ξ and γ, the space axes e_x, e_y, e_z in body components; R' = R [Ω]×.
A quaternion is (w, x, y, z), the scalar first, of length 1: v_space = q v_body q̄, q' = q (0, Ω)/2; q and −q are one
attitude.
Euler angles (a, b, c) of a sequence "IJK" are intrinsic: R = R_I(a) R_J(b) R_K(c).  For "ZXZ" the angles of the paper,
(3.2), are (ψ, θ, φ) in this order: its γ depends on φ, the last.

Rows are three sequences of three numbers.  ``lib`` is a namespace with the elementary functions of the numbers at hand:
``math``, or those of balls.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeVar

from heavytop.errors import InputError, prefixed, quoted, refusal
from heavytop.precision import (
    Given,
    Real,
    Scalar,
    Vector,
    cross,
    decimal_text,
    dot,
    exact,
    exact_text,
    ordered,
    physical,
    round_to,
    square_root,
    vector,
)

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray
    from scipy.spatial.transform import Rotation

Rows = Sequence[Sequence[Scalar]]
Item = TypeVar("Item")
Three = tuple[Item, Item, Item]
Number = Callable[[Fraction], Any]
Library = ModuleType | SimpleNamespace

SEQUENCES = tuple("".join(letters) for letters in product("XYZ", repeat=3) if letters[0] != letters[1] != letters[2])
"""The twelve sequences of Euler angles."""
_SHOWN_BITS = 64
_GUARD_BITS = 16
_DEGREES = "deg"
_NORMALIZE = "Normalize it (--normalize on the command line, normalize=True in Python), or give exact numbers."


def rows_of(gamma: Sequence[Scalar], xi: Sequence[Scalar]) -> Three[Sequence[Scalar]]:
    """The rows of R: ξ, γ × ξ, γ."""
    return tuple(xi), cross(gamma, xi), tuple(gamma)


def rotated(rows: Rows[Scalar], v: Sequence[Scalar]) -> Three[Scalar]:
    """R v: components in space of a vector of the body."""
    return dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)


def transposed(rows: Rows[Scalar]) -> Three[Three[Scalar]]:
    """The columns of R."""
    a, b, c = rows
    return (a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2])


def multiplied(left: Rows[Scalar], right: Rows[Scalar]) -> Three[Three[Scalar]]:
    """The rows of the product of two matrices."""
    one, two, three = transposed(right)
    first, second, third = ((dot(row, one), dot(row, two), dot(row, three)) for row in left)
    return first, second, third


def matrix_of_quaternion(q: Sequence[Scalar]) -> Three[Three[Scalar]]:
    """|q|² R of a quaternion of any length: polynomials, hence exact over the rationals."""
    w, x, y, z = q
    return (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )


def rotation_of(q: Sequence[Fraction]) -> Three[Vector]:
    """R of a rational quaternion of any length but 0, in exact rationals."""
    square = sum(value * value for value in q)
    first, second, third = ((x / square, y / square, z / square) for x, y, z in matrix_of_quaternion(q))
    return first, second, third


def quaternion_products(rows: Rows[Real]) -> tuple[tuple[Real, ...], ...]:
    """4 q qᵀ, row by row: each row is a multiple of q; linear in R, so exact over the rationals."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    return (
        (1 + (a + e + i), h - f, c - g, d - b),
        (h - f, 1 + (a - e - i), b + d, c + g),
        (c - g, b + d, 1 + (e - a - i), f + h),
        (d - b, c + g, f + h, 1 + (i - a - e)),
    )


def multiple_of_quaternion(rows: Rows[Real]) -> tuple[Real, ...]:
    """4 c q with c the largest component of q: c² is at least 1/4, so that no digits are lost."""
    products = quaternion_products(rows)
    return products[max(range(4), key=lambda index: float(products[index][index]))]


def quaternion_of_rows(rows: Rows[Real], lib: Library) -> tuple[Real, Real, Real, Real]:
    """(w, x, y, z) of length 1, of the sign in which its largest component is positive."""
    multiple = multiple_of_quaternion(rows)
    length = lib.sqrt(sum(value * value for value in multiple))
    w, x, y, z = (value / length for value in multiple)
    return w, x, y, z


def near_quaternion(rows: Rows[Fraction], bits: int) -> tuple[Fraction, ...]:
    """The quaternion of rational rows, in rationals, of length 1 to within 2^-bits."""
    multiple = multiple_of_quaternion(rows)
    length = square_root(sum((value * value for value in multiple), Fraction(0)), bits)
    return tuple(value / length for value in multiple)


def _elementary(axis: int, cosine: Any, sine: Any) -> tuple[Any, ...]:
    """The rows of the rotation about one axis."""
    after, last = (axis + 1) % 3, (axis + 2) % 3
    rows = [[0] * 3 for _ in range(3)]
    rows[axis][axis] = 1
    rows[after][after] = rows[last][last] = cosine
    rows[after][last], rows[last][after] = -sine, sine
    return tuple(map(tuple, rows))


def require_sequence(sequence: object) -> str:
    """The sequence in capitals, a member of :data:`SEQUENCES`; raises InputError for any other."""
    if not isinstance(sequence, str) or sequence.upper() not in SEQUENCES:
        raise InputError(
            f"Unknown sequence of Euler angles {quoted(sequence)}.",
            f"Use one of {', '.join(SEQUENCES)}: intrinsic, R = R_I(a) R_J(b) R_K(c).",
        )
    return sequence.upper()


def _axes(sequence: str) -> tuple[int, int, int]:
    first, second, third = ("XYZ".index(letter) for letter in require_sequence(sequence))
    return first, second, third


def rows_of_euler(sequence: str, angles: Sequence[Scalar], lib: Library) -> Three[Three[Scalar]]:
    """R_I(a) R_J(b) R_K(c); raises InputError for an unknown sequence."""
    first, second, third = (
        _elementary(axis, lib.cos(angle), lib.sin(angle)) for axis, angle in zip(_axes(sequence), angles, strict=True)
    )
    return multiplied(multiplied(first, second), third)


def euler_terms(rows: Rows[Real], sequence: str) -> Three[tuple[Real, Real]]:
    """(sin, cos) of a and of c, each times s, and in the middle the two squares and the cosine or sine that give b.

    s is |sin b| for a sequence such as ZXZ and |cos b| for one such as ZYX; where it is 0, a and c are not defined by
    themselves (gimbal lock).  The middle pair is (s², sin b or cos b).
    """
    i, j, k = _axes(sequence)
    rest = 3 - i - j
    sign = 1 if j == (i + 1) % 3 else -1
    if i == k:
        square = rows[i][j] * rows[i][j] + rows[i][rest] * rows[i][rest]
        return (rows[j][i], -sign * rows[rest][i]), (square, rows[i][i]), (rows[i][j], sign * rows[i][rest])
    square = rows[i][i] * rows[i][i] + rows[i][j] * rows[i][j]
    return (-sign * rows[j][k], rows[k][k]), (square, sign * rows[i][k]), (-sign * rows[i][j], rows[i][i])


def euler_of_rows(rows: Rows[Real], sequence: str, lib: Library) -> Three[Real]:
    """(a, b, c) with R = R_I(a) R_J(b) R_K(c): a and c in (−π, π], b in [0, π], of three different axes in [−π/2, π/2].

    At gimbal lock (:func:`euler_terms`) a and c are what atan2(0, 0) of ``lib`` is.
    """
    first, (square, value), third = euler_terms(rows, sequence)
    across = lib.sqrt(square)
    proper = sequence[0].upper() == sequence[2].upper()
    middle = lib.atan2(across, value) if proper else lib.atan2(value, across)
    return lib.atan2(*first), middle, lib.atan2(*third)


@dataclass(frozen=True, slots=True)
class Angle:
    """An exact angle: a number of radians, or of degrees."""

    number: Fraction
    degrees: bool = False

    @classmethod
    def read(cls, value: Given | Angle) -> Angle:
        """Radians, or degrees where it ends with "deg"; raises InputError for what is not a number."""
        if isinstance(value, Angle):
            return value
        if isinstance(value, str) and value.strip().lower().endswith(_DEGREES):
            with prefixed("angle"):
                return cls(exact(value.strip()[: -len(_DEGREES)].strip()), True)
        with prefixed("angle"):
            return cls(exact(value))

    def __str__(self) -> str:
        return exact_text(self.number) + (_DEGREES if self.degrees else "")

    def quarters(self) -> int | None:
        """How many right angles it is; None where its sine or cosine is other than 0 and ±1."""
        if self.number == 0:
            return 0
        turns = self.number / 90
        return int(turns) % 4 if self.degrees and turns.denominator == 1 else None

    def radians(self, lib: Library, number: Number) -> Any:
        """In radians, as a number of the ring."""
        if not self.degrees:
            return number(self.number)
        return number(self.number / 180) * (4 * lib.atan2(number(Fraction(1)), number(Fraction(1))))


@dataclass(frozen=True, slots=True)
class Attitude:
    """An exact attitude, made by one of the constructors.

    kind: quaternion, matrix, euler or axis_angle.  numbers: as given, row by row.  angles: of euler and axis_angle.
    """

    kind: str
    numbers: tuple[Fraction, ...] = ()
    angles: tuple[Angle, ...] = ()
    sequence: str = ""

    @classmethod
    def quaternion(cls, w: Given, x: Given, y: Given, z: Given, *, normalize: bool = False) -> Attitude:
        """From body to space, the scalar first.

        Raises InputError unless |q| = 1 exactly, or, with ``normalize``, for q = 0; R of any rational quaternion is
        rational.
        """
        with prefixed("quaternion"):
            q = tuple(exact(value) for value in (w, x, y, z))
        square = sum(value * value for value in q)
        if square == 0:
            raise InputError("A quaternion must not be zero.", "Give w,x,y,z of length 1.")
        if square != 1 and not normalize:
            raise InputError(f"A quaternion must have length 1; |q|^2 - 1 = {_size(square - 1)}.", _NORMALIZE)
        return cls("quaternion", q)

    @classmethod
    def matrix(cls, rows: Iterable[Any], *, normalize: bool = False) -> Attitude:
        """From R, three rows or nine numbers row by row.

        Raises InputError unless R Rᵀ = 1 and det R = 1 exactly; with ``normalize`` for what is farther than 1e-2 from
        a rotation, in place of which the rotation near it is taken.
        """
        entries = _square(rows)
        off = max(abs(dot(entries[i], entries[j]) - (i == j)) for i in range(3) for j in range(3))
        if dot(entries[0], cross(entries[1], entries[2])) < 0:
            raise InputError(
                "The matrix is a reflection: its determinant is negative.",
                "Give the rotation from body axes to space axes; both systems of axes are right-handed.",
            )
        if off > (Fraction(1, 100) if normalize else 0):
            raise InputError(f"The matrix is not orthogonal: an entry of R R^T - 1 is {_size(off)}.", _NORMALIZE)
        if off:
            return cls.quaternion(*multiple_of_quaternion(entries), normalize=True)
        return cls("matrix", tuple(value for row in entries for value in row))

    @classmethod
    def euler(cls, sequence: str, a: Given | Angle, b: Given | Angle, c: Given | Angle) -> Attitude:
        """R = R_I(a) R_J(b) R_K(c) for ``sequence`` "IJK", intrinsic; radians, or degrees as "30deg".

        Raises InputError for an unknown sequence and for what is not a number.
        """
        return cls("euler", angles=tuple(map(Angle.read, (a, b, c))), sequence=require_sequence(sequence))

    @classmethod
    def axis_angle(cls, axis: Iterable[Any], angle: Given | Angle) -> Attitude:
        """The rotation by ``angle`` (radians, or "30deg") about ``axis``, of any length; raises InputError for 0."""
        direction = vector(axis, "axis")
        if not any(direction):
            raise InputError("The axis of a rotation must not be zero.", "Give its direction.")
        return cls("axis_angle", direction, (Angle.read(angle),))

    @classmethod
    def rotation(cls, rotation: Rotation) -> Attitude:
        """From one ``scipy.spatial.transform.Rotation``, body to space; raises InputError for several."""
        if not getattr(rotation, "single", False):
            raise refusal("rotation", "a single Rotation", quoted(rotation), "Give one of scipy.spatial.transform.")
        x, y, z, w = rotation.as_quat().tolist()
        return cls.quaternion(w, x, y, z, normalize=True)

    def __str__(self) -> str:
        """As on the command line."""
        texts = [exact_text(value) for value in self.numbers]
        if self.kind == "axis_angle":
            texts.append(str(self.angles[0]))
        if self.kind == "euler":
            return f"{self.sequence}:{','.join(map(str, self.angles))}"
        return ",".join(texts)

    def __repr__(self) -> str:
        if self.kind == "euler":
            return f"Attitude.euler({self.sequence!r}, {', '.join(repr(str(angle)) for angle in self.angles)})"
        texts = ", ".join(repr(exact_text(value)) for value in self.numbers)
        if self.kind == "axis_angle":
            return f"Attitude.axis_angle(({texts}), {str(self.angles[0])!r})"
        unit = self.kind == "matrix" or sum(value * value for value in self.numbers) == 1
        values = f"({texts})" if self.kind == "matrix" else texts
        return f"Attitude.{self.kind}({values}{'' if unit else ', normalize=True'})"

    def rational_rows(self, bits: int) -> Three[Vector]:
        """R where it is rational; else a rational rotation, exactly orthogonal, within 2^-bits of it."""
        if (known := self.exact_rows()) is not None:
            return known
        import mpmath

        # mpmath.mp is shared by all threads
        lib = mpmath.MPContext()
        lib.prec = bits + _GUARD_BITS
        rows = self.rows(lib, lambda value: lib.mpf(value.numerator) / value.denominator)
        return rotation_of([exact(value) for value in multiple_of_quaternion(rows)])

    def exact_rows(self) -> Three[Vector] | None:
        """R in exact rationals; None where some entry may be irrational."""
        if self.kind == "quaternion":
            return rotation_of(self.numbers)
        if self.kind == "matrix":
            return self.numbers[:3], self.numbers[3:6], self.numbers[6:]  # type: ignore[return-value]
        quarters = [angle.quarters() for angle in self.angles]
        if self.kind == "axis_angle" and sum(value != 0 for value in self.numbers) > 1 and quarters != [0]:
            return None
        if None in quarters:
            return None
        turns = ((1, 0), (0, 1), (-1, 0), (0, -1))
        right = [(Fraction(cosine), Fraction(sine)) for cosine, sine in (turns[count or 0] for count in quarters)]
        return self._product(right, Fraction, lambda square: square)

    def rows(self, lib: Library, number: Number = lambda value: value) -> tuple[Any, Any, Any]:
        """The rows of R, as numbers of ``lib``.

        number: what makes an exact rational one of them, such as :func:`heavytop.exact.flint.balls.ball`; left as it is
        for math.
        """
        known = self.exact_rows()
        if known is not None:
            first, second, third = (tuple(map(number, row)) for row in known)
            return first, second, third
        turns = [angle.radians(lib, number) for angle in self.angles]
        return self._product([(lib.cos(turn), lib.sin(turn)) for turn in turns], number, lib.sqrt)

    def _product(
        self, turns: list[tuple[Any, Any]], number: Number, root: Callable[[Any], Any]
    ) -> tuple[Any, Any, Any]:
        """R from (cos, sin) of the angles; ``root`` is asked for the length of an axis that has more than one part."""
        if self.kind == "euler":
            first, second, third = (
                _elementary(axis, *turn) for axis, turn in zip(_axes(self.sequence), turns, strict=True)
            )
            return multiplied(multiplied(first, second), third)
        ((cosine, sine),) = turns
        square = dot(self.numbers, self.numbers)
        if sum(value != 0 for value in self.numbers) == 1:
            n = [number(Fraction((value > 0) - (value < 0))) for value in self.numbers]
        elif sine == 0 and cosine == 1:
            n = [number(Fraction(k == 0)) for k in range(3)]
        else:
            length = root(number(square))
            n = [number(value) / length for value in self.numbers]
        skew = ((0, -n[2], n[1]), (n[2], 0, -n[0]), (-n[1], n[0], 0))
        first, second, third = (
            tuple((i == j) * cosine + sine * skew[i][j] + (1 - cosine) * n[i] * n[j] for j in range(3))
            for i in range(3)
        )
        return first, second, third


def _square(rows: Iterable[Any]) -> Three[Vector]:
    """Three rows of three, out of three rows or nine numbers."""
    remedy = "Give R row by row: nine numbers, or three rows of three."
    square = ordered(rows, "matrix", remedy)
    if len(square) == 9:
        square = [square[:3], square[3:6], square[6:]]
    if len(square) != 3:
        raise InputError(f"matrix must have 9 entries; got {len(square)}.", remedy)
    first, second, third = (vector(row, "a row of the matrix") for row in square)
    return first, second, third


def _size(value: Fraction) -> str:
    return decimal_text(round_to(value, _SHOWN_BITS), 6)


# Euler angles (3.2), 3-1-3, and the attitude vector that carries them through the poles.
#
# ξ is a second unit vector fixed in space, ξ ⟂ γ, in body components; η = γ × ξ.  In space γ = e_z, ξ = e_x, η = e_y.
# The functions take ``lib``, a namespace with the elementary functions of the numbers at hand (math, mpmath, numpy,
# sympy, or :data:`heavytop.exact.flint.balls.FUNCTIONS`).


def gamma_from_angles(phi: Real, theta: Real, lib: Library) -> Three[Real]:
    """γ = (sinθ sinφ, sinθ cosφ, cosθ), (3.2)."""
    return lib.sin(theta) * lib.sin(phi), lib.sin(theta) * lib.cos(phi), lib.cos(theta)


def omega_from_angles(gamma: Sequence[Real], phi: Real, rates: Sequence[Real], lib: Library) -> Three[Real]:
    """(3.1): (ψ'γ1 + θ' cosφ, ψ'γ2 − θ' sinφ, ψ'γ3 + φ'), from ``rates`` = (φ', θ', ψ')."""
    phi_rate, theta_rate, psi_rate = rates
    return (
        psi_rate * gamma[0] + theta_rate * lib.cos(phi),
        psi_rate * gamma[1] - theta_rate * lib.sin(phi),
        psi_rate * gamma[2] + phi_rate,
    )


def attitude_from_angles(phi: Real, theta: Real, psi: Real, lib: Library) -> Three[Real]:
    """ξ, the space axis e_x in body components, for any angles (θ of either sign)."""
    sin_psi, cos_psi, cos_theta = lib.sin(psi), lib.cos(psi), lib.cos(theta)
    return (
        cos_psi * lib.cos(phi) - sin_psi * cos_theta * lib.sin(phi),
        -cos_psi * lib.sin(phi) - sin_psi * cos_theta * lib.cos(phi),
        sin_psi * lib.sin(theta),
    )


def euler_angles(gamma: Sequence[Real], xi: Sequence[Real], lib: Library) -> Three[Real]:
    """(φ, θ, ψ) with φ = atan2(γ1, γ2), θ = atan2(√(γ1² + γ2²), γ3) in [0, π], ψ = atan2(ξ3, −η3).

    φ and ψ are undefined at the poles γ3 = ±1.
    """
    psi, theta, phi = euler_of_rows(rows_of(gamma, xi), "ZXZ", lib)
    return phi, theta, psi


def unwrap(angles: Iterable[Any], turn: Any) -> list[Any]:
    """Angles shifted by multiples of ``turn`` (2π) so that neighbours differ by at most half a turn.

    Meaningful only where the samples are dense enough that the true angle moves less than half a turn between them.
    """
    result: list[Any] = []
    for angle in angles:
        if result:
            angle = angle - turn * round(float((angle - result[-1]) / turn))
        result.append(angle)
    return result


def perpendicular(gamma: Vector) -> Vector:
    """An exact rational unit vector ⟂ γ (|γ| = 1 exactly): the initial ξ where no attitude is given.

    The image of e1 under the reflection that takes e3 to γ; e1 itself for γ = e3.
    """
    v = (-gamma[0], -gamma[1], 1 - gamma[2])
    if not any(v):
        return Fraction(1), Fraction(0), Fraction(0)
    factor = 2 * v[0] / (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return 1 - factor * v[0], -factor * v[1], -factor * v[2]


# Outputs of an attitude: quaternion, matrix, Euler angles, the position of a point, Ω in space axes.
#
# Each is a function of a state (Ω, γ) and of ξ over any ring, in the conventions above.  A point p of the body, in body
# axes, is at pivot + R p in space: the fixed point is the origin unless a pivot is given, and p is the centre of mass
# unless a point is given.


SHAPES: dict[str, tuple[int, ...]] = {
    "quaternion": (4,),
    "matrix": (3, 3),
    "euler": (3,),
    "position": (3,),
    "omega-space": (3,),
}
"""The shape of its value at one time."""
_COLUMNS = {
    "quaternion": ("qw", "qx", "qy", "qz"),
    "matrix": tuple(f"R{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)),
    "position": ("x", "y", "z"),
    "omega-space": ("omega_space_x", "omega_space_y", "omega_space_z"),
}
_ORIGIN = (Fraction(0), Fraction(0), Fraction(0))
_REMEDY = "Use quaternion, matrix, euler:ZXZ (or another sequence), position, omega-space."


def key_of(name: str) -> str:
    """The key of an output in a JSON document."""
    return name.replace("-", "_")


@dataclass(frozen=True, slots=True)
class Output:
    """A quantity of :data:`SHAPES`; Euler angles with their sequence, a position with its point and pivot.

    point: in body axes, None for the centre of mass.  pivot: where the fixed point stands in space.
    """

    name: str
    sequence: str = ""
    point: Vector | None = None
    pivot: Vector = _ORIGIN

    @property
    def key(self) -> str:
        """In a JSON document."""
        return key_of(self.name)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the value at one time."""
        return SHAPES[self.name]

    @property
    def columns(self) -> tuple[str, ...]:
        """In a CSV file."""
        return _COLUMNS.get(self.name) or tuple(f"euler{k}" for k in (1, 2, 3))

    def at(
        self,
        omega: Sequence[Real],
        gamma: Sequence[Real],
        xi: Sequence[Real],
        centre: Vector,
        lib: Library,
        number: Callable[[Fraction], Real],
    ) -> tuple[Real, ...]:
        """The value at one time, flat: a matrix row by row; a quaternion of either sign.

        omega, gamma, xi: three numbers of ``lib`` each, |γ| = |ξ| = 1.  centre: of mass, in the same axes.
        number: what makes an exact rational one of them.
        """
        rows = rows_of(gamma, xi)
        if self.name == "quaternion":
            return quaternion_of_rows(rows, lib)
        if self.name == "matrix":
            return tuple(entry for row in rows for entry in row)
        if self.name == "euler":
            return euler_of_rows(rows, self.sequence, lib)
        if self.name == "omega-space":
            return rotated(rows, omega)
        point = [number(value) for value in self.point_of(centre)]
        shift = [number(value) for value in self.pivot]
        return tuple(a + b for a, b in zip(shift, rotated(rows, point), strict=True))

    def point_of(self, centre: Vector) -> Vector:
        """The point whose position is computed."""
        return centre if self.point is None else self.point


def output(text: str | Output, point: Iterable[Any] | None = None, pivot: Iterable[Any] | None = None) -> Output:
    """The output of that name, "euler:ZXZ" with its sequence; one that was read before, as it is.

    point, pivot: three exact numbers each, of a position alone.
    Raises InputError for an unknown name or sequence, and for a point or pivot of another output.
    """
    if isinstance(text, Output) and point is None and pivot is None:
        return text
    name, colon, sequence = (text if isinstance(text, str) else "").strip().partition(":")
    name = name.replace("_", "-").lower()
    if name not in SHAPES or (colon and name != "euler"):
        raise InputError(f"Unknown output {quoted(text)}.", _REMEDY)
    if name == "euler":
        if not sequence:
            raise InputError("Euler angles need a sequence.", "Give one, as in euler:ZXZ.")
        sequence = require_sequence(sequence.strip())
    if name != "position" and (point is not None or pivot is not None):
        raise InputError(f"{name} has no point and no pivot.", "Add position to the outputs, or leave them out.")
    vector_of_point = None if point is None else _place(point, "point")
    return Output(name, sequence, vector_of_point, _ORIGIN if pivot is None else _place(pivot, "pivot"))


def _place(value: Iterable[Any], what: str) -> Vector:
    first, second, third = (physical(part, what) for part in vector(value, what))
    return first, second, third


def outputs(text: str, point: Iterable[Any] | None = None, pivot: Iterable[Any] | None = None) -> tuple[Output, ...]:
    """The outputs of a text such as "quaternion,euler:ZXZ,position", each once.

    Raises InputError as :func:`output`, for one that stands twice (two sequences of Euler angles included), and for a
    point or pivot where no position is asked for.
    """
    parts = [part for part in text.split(",") if part.strip()]
    names = [part.strip().partition(":")[0].replace("_", "-").lower() for part in parts]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"The output {quoted(name)} is given twice.", "Give each once, with one Euler sequence.")
    if "position" not in names and (point is not None or pivot is not None):
        raise InputError("A point or a pivot was given, but no position was requested.", "Add position to the outputs.")
    if not parts:
        raise InputError(f"{quoted(text)} names no output.", _REMEDY)
    return tuple(
        output(part, *((point, pivot) if name == "position" else ())) for part, name in zip(parts, names, strict=True)
    )


def shaped(values: Sequence[Any], shape: tuple[int, ...]) -> list[Any]:
    """A flat list as nested lists of that shape."""
    if len(shape) == 1:
        return list(values)
    size = len(values) // shape[0]
    return [shaped(values[begin : begin + size], shape[1:]) for begin in range(0, len(values), size)]


def first_sign(q: Sequence[Fraction], slack: Fraction = Fraction(0)) -> int:
    """±1, by which a quaternion (or a multiple of it) is multiplied at the start of a motion.

    So that w > 0, or the first of x, y, z that is not 0 is positive where w = 0; what is within ``slack`` of 0 counts
    as 0.  q: exact rationals.
    """
    return next((1 if value > 0 else -1 for value in q if abs(value) > slack), 1)


def signs(start: Sequence[float], quaternions: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
    """±1 for each quaternion, an array: q goes on from ``start`` at t = 0 without a jump.

    Each is the nearer to the one before of q and −q; the motion meant is that of the samples: where the body turns by
    more than half a turn in between, the sign says nothing.
    quaternions: doubles, shape (n, 4), in the order in which the motion passes them.
    """
    import numpy

    chain = numpy.concatenate([[start], quaternions])
    return numpy.cumprod(numpy.where((chain[1:] * chain[:-1]).sum(axis=1) < 0, -1.0, 1.0), dtype=float)


def document_of(outputs: Sequence[Output], values: Callable[[Output], Any]) -> dict[str, object]:
    """The keys of a JSON document for these outputs."""
    document: dict[str, Any] = {}
    for output in outputs:
        document[output.key] = values(output)
        if output.name == "euler":
            document["sequence"] = output.sequence
        if output.point is not None:
            document["point"] = [exact_text(value) for value in output.point]
        if any(output.pivot):
            document["pivot"] = [exact_text(value) for value in output.pivot]
    return document
