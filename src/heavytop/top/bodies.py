"""A rigid body as other programs describe it: mass, gravity, centre of mass and inertia tensor in any body axes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.errors import InputError, quoted
from heavytop.precision import exact, exact_text, shown
from heavytop.top.attitude import rotated, transposed
from heavytop.top.heavy_top import HeavyTop
from heavytop.top.principal import PrincipalAxes, principal_axes
from heavytop.top.vectors import Vector, cross, dot, ordered, vector

Tensor = tuple[Vector, Vector, Vector]
PIVOT, CENTRE = "pivot", "centre of mass"
_ROUNDED_BITS = 256
_ROUNDED_DATA = Fraction(1, 2**40)
"""A plate or a rod in rounded numbers is one."""
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
        mass: Any,
        gravity: Any,
        centre: Iterable[Any],
        inertia: Iterable[Any],
        about: str | None = None,
        rotor: Iterable[Any] | None = None,
    ) -> None:
        found = {"mass": _number(mass, "mass"), "gravity": _number(gravity, "gravity")}
        if found["mass"] <= 0:
            raise InputError(f"mass = {shown(found['mass'])} is not positive.", "Give the mass of the body.")
        if found["gravity"] < 0:
            raise InputError(
                f"gravity = {shown(found['gravity'])} is negative.",
                "Give its size, such as 9.81: gravity points down; e_z, or the axis named by up, points up.",
            )
        place = vector(centre, "centre")
        given = _tensor(inertia)
        at_pivot = _at_pivot(given, found["mass"], place, _about(about, place))
        _require_positive(at_pivot)
        whirl = None if rotor is None else vector(rotor, "rotor")
        values = {**found, "centre": place, "tensor": at_pivot, "about": about, "rotor": whirl}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        texts = [[exact_text(value) for value in row] for row in self.tensor]
        extra = "" if self.rotor is None else f", rotor={_texts(self.rotor)}"
        return (
            f"Body(mass='{exact_text(self.mass)}', gravity='{exact_text(self.gravity)}', centre={_texts(self.centre)}, "
            f"inertia={texts}, about='{PIVOT}'{extra})"
        )

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
        """The same body in principal axes, with moments at the pivot, weight m g, centre; exact, or to 256 bits."""
        return self.top_in(self.principal())

    def top_in(self, principal: PrincipalAxes) -> HeavyTop:
        """The heavy top of these principal axes; it lacks what ``principal.left`` says."""
        turn = transposed(principal.axes)
        centre = rotated(turn, self.centre)
        if self.rotor is None:
            return HeavyTop(principal.moments, self.weight, centre)
        return HeavyTop(principal.moments, self.weight, centre, rotor=rotated(turn, self.rotor))

    def warnings(self) -> list[str]:
        """What no rigid body can have, though the equations do not mind."""
        return self.top.warnings() or _warnings_about_centre(self)


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


def _number(value: Any, what: str) -> Fraction:
    try:
        return exact(value)
    except InputError as error:
        raise InputError(f"{what}: {error.cause}", error.remedy) from None


def _about(about: object, centre: Vector) -> str:
    """What the tensor is about; without the word only where both are the same."""
    if about is None:
        if any(centre):
            raise InputError(
                "It is not said which point the inertia tensor is about.",
                f'Give about = "{PIVOT}" or "{CENTRE}": with the centre of mass off the pivot they differ.',
            )
        return PIVOT
    if not isinstance(about, str) or about not in (PIVOT, CENTRE):
        raise InputError(f"about = {quoted(about)} is unknown.", f'Use "{PIVOT}" or "{CENTRE}".')
    return about


def _tensor(inertia: Iterable[Any]) -> Tensor:
    """Three rows out of three, six or nine numbers or three rows; raises InputError where it is not symmetric."""
    values = ordered(inertia, "inertia", _SHAPES)
    if len(values) == 3 and all(isinstance(value, Iterable) and not isinstance(value, str) for value in values):
        values = [part for row in values for part in vector(row, "a row of the inertia tensor")]
    if len(values) not in (3, 6, 9):
        raise InputError(f"inertia has {len(values)} numbers.", _SHAPES)
    n = [_number(value, "inertia") for value in values]
    zero = Fraction(0)
    if len(n) == 3:
        return (n[0], zero, zero), (zero, n[1], zero), (zero, zero, n[2])
    if len(n) == 6:
        return (n[0], n[3], n[4]), (n[3], n[1], n[5]), (n[4], n[5], n[2])
    rows = (n[0], n[1], n[2]), (n[3], n[4], n[5]), (n[6], n[7], n[8])
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if rows[i][j] != rows[j][i]:
            raise InputError(
                f"The inertia tensor is not symmetric: I{i + 1}{j + 1} = {shown(rows[i][j])}, "
                f"I{j + 1}{i + 1} = {shown(rows[j][i])}.",
                "Give the same number in both places.",
            )
    return rows


def _at_pivot(tensor: Tensor, mass: Fraction, centre: Vector, about: str) -> Tensor:
    """Steiner's theorem: J = J_c + m (|c|² 1 − c cᵀ)."""
    if about == PIVOT:
        return tensor
    square = dot(centre, centre)

    def row(i: int) -> Vector:
        x, y, z = (
            tensor[i][j] + mass * ((square if i == j else Fraction(0)) - centre[i] * centre[j]) for j in range(3)
        )
        return x, y, z

    return row(0), row(1), row(2)


def _warnings_about_centre(body: Body) -> list[str]:
    """Whether ∫ x xᵀ dm = ½ tr J − J about the centre of mass can be that of a body: no principal minor is negative."""
    central = _at_pivot(body.tensor, -body.mass, body.centre, CENTRE)
    half = sum(central[i][i] + _ROUNDED_DATA * body.tensor[i][i] for i in range(3)) / 2
    second = [[(half if i == j else 0) - central[i][j] for j in range(3)] for i in range(3)]
    pairs = (second[i][i] * second[j][j] - second[i][j] ** 2 for i, j in ((0, 1), (0, 2), (1, 2)))
    whole = dot(vector(second[0], "row"), cross(vector(second[1], "row"), vector(second[2], "row")))
    if min(second[0][0], second[1][1], second[2][2], *pairs, whole) >= 0:
        return []
    moments = ", ".join(shown(central[i][i]) for i in range(3))
    meant = "" if body.about == CENTRE else f' If it was meant about it, give about = "{CENTRE}".'
    return [f"The inertia tensor about the centre of mass, diagonal {moments}, is not that of a rigid body.{meant}"]


def _require_positive(tensor: Tensor) -> None:
    """Raises InputError unless every moment of inertia is positive, by the leading minors."""
    minors = (
        tensor[0][0],
        tensor[0][0] * tensor[1][1] - tensor[0][1] ** 2,
        dot(tensor[0], cross(tensor[1], tensor[2])),
    )
    for size, minor in enumerate(minors, 1):
        if minor <= 0:
            raise InputError(
                f"The inertia tensor is not that of a body: its leading minor of size {size} is {shown(minor)}, "
                "so that some moment is not positive.",
                "Check its entries, and the signs of the products of inertia: I12 is minus the integral of x y dm.",
            )
