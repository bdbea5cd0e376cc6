"""Mass, centre of mass and inertia tensor out of files of robots: URDF, MJCF, SDF, USD (text), and TOML.

Numbers are exact, to the digits in the file.  A rotation of the inertial axes with irrational entries is rounded to
2^-64.  Units are kg and metres, as these formats have it.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heavytop.errors import InputError, prefixed, quoted
from heavytop.files import read_whole
from heavytop.precision import Vector, exact, round_to, vector
from heavytop.top import inertia_slips
from heavytop.top.attitude import Attitude, multiplied, transposed
from heavytop.top.inertia_slips import Six, Tensor, rows, six_of

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_BITS = 64
_UTF8_MARK = b"\xef\xbb\xbf"
_LARGEST_FILE = 50_000_000
_MOST_SLACK = Fraction(1, 200)
_ZERO: Vector = (Fraction(0), Fraction(0), Fraction(0))
_IDENTITY: Tensor = rows((Fraction(1), Fraction(1), Fraction(1), *_ZERO))
_SIX_URDF = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_FORMATS = "Give a URDF, MJCF or SDF file, USD as text (.usda), or TOML with mass, centre and inertia."


@dataclass(frozen=True, slots=True)
class BodyInFile:
    """A link or body of a file, in its own axes and units of kg and metres.

    centre: of mass.  six: I11, I22, I33, I12, I13, I23 about the centre of mass, or the origin where ``at_pivot``.
    joint: where a ball joint holds it, or None.  slack: rounding of the printed digits,
    of an entry of the second moments.
    geometry, geometry_axes: tensor about the centre of mass of the one shape that the file gives it, as a uniform body,
    and the rotation of its axes; None where it gives none, several, or a mesh.
    """

    name: str
    mass: Fraction
    centre: Vector
    six: Six
    slack: Fraction
    at_pivot: bool = False
    joint: Vector | None = None
    geometry: Tensor | None = None
    geometry_axes: Tensor | None = None
    si: bool = True

    def about(self, pivot: Vector | None) -> inertia_slips.MassProperties:
        """Its mass properties, with the centre of mass from the pivot: the ball joint, or the origin, where None."""
        origin = pivot or self.joint or _ZERO
        x, y, z = (value - start for value, start in zip(self.centre, origin, strict=True))
        extra = (self.slack, self.si, self.geometry, self.geometry_axes)
        return inertia_slips.MassProperties(self.six, self.mass, (x, y, z), self.at_pivot, *extra)


def read_body(path: Path, link: str | None = None) -> BodyInFile:
    """The body of a file, or of its link of that name.

    Raises InputError for a file that cannot be read, that holds no mass properties or several without ``link``, and
    for numbers that are none.
    """
    bodies = list(_bodies(path))
    if link is not None:
        bodies = [body for body in bodies if body.name == link] or _no_link(path, link, bodies)
    if len(bodies) != 1:
        names = ", ".join(body.name for body in bodies[:20])
        if not bodies:
            raise InputError(f"{path} holds no mass properties.", "A body needs its mass and its inertia tensor.")
        raise InputError(f"{path} holds {len(bodies)} bodies: {names}.", "Choose one with --link NAME.")
    if bodies[0].mass <= 0:
        raise InputError(f"{bodies[0].name}: mass must be positive; got {bodies[0].mass}.", "Give its mass in kg.")
    return bodies[0]


def _no_link(path: Path, link: str, bodies: Sequence[BodyInFile]) -> list[BodyInFile]:
    names = ", ".join(body.name for body in bodies[:20]) or "none"
    raise InputError(f"{path} has no link {quoted(link)} with an inertia.", f"It has {names}.")


def _bodies(path: Path) -> Iterator[BodyInFile]:
    try:
        content = read_whole(path)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.", "Give a file that is there.") from None
    if len(content) > _LARGEST_FILE:
        raise InputError(f"{path} has {len(content)} bytes.", f"A body is read from at most {_LARGEST_FILE}.")
    if content.startswith(b"PXR-USDC"):
        raise InputError(f"{path} is binary USD.", "Convert it to text: usdcat FILE -o FILE.usda.")
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or content.removeprefix(_UTF8_MARK).lstrip().startswith(b"<"):
        return _xml(path, content.strip())
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not text.", _FORMATS) from None
    if text.lstrip().startswith("#usda"):
        return _usd(text)
    if path.suffix.lower() == ".toml":
        return _toml(path, text)
    raise InputError(f"{path} is in no format that is known.", _FORMATS)


def _xml(path: Path, content: bytes) -> Iterator[BodyInFile]:
    from xml.etree.ElementTree import ParseError

    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    try:
        root = fromstring(content)
    except (ParseError, ValueError) as error:
        refused = isinstance(error, DefusedXmlException)
        cause = "declares entities, which are refused" if refused else f"is not XML: {error}"
        raise InputError(f"{path} {cause}.", "Write it out without them." if refused else _FORMATS) from None
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]  # a namespace changes no meaning
    readers: dict[str, Callable[[Element], Iterator[BodyInFile]]] = {
        "robot": _urdf,
        "mujoco": _mjcf,
        "mujocoinclude": _mjcf,
        "sdf": _sdf,
    }
    if root.tag not in readers:
        raise InputError(f"{path} is XML with the root <{root.tag}>.", _FORMATS)
    return readers[root.tag](root)


class _Numbers:
    """Numbers of one element of a file, with the unit in the last digit of each decimal."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.units: list[Fraction] = []

    def read(self, text: str | None, what: str, default: str | None = None) -> list[Fraction]:
        """The numbers of ``text``, separated by spaces or commas."""
        text = text if text is not None else default
        if text is None:
            raise InputError(f"{self.where}: {what} is missing.", "Give it in the file.")
        if "${" in text or "$(" in text:
            raise InputError(
                f"{self.where}: {what} = {quoted(text)} is an expression of xacro.",
                "Expand the file first: xacro FILE -o FILE.urdf.",
            )
        with prefixed(f"{self.where}: {what} = {quoted(text)}"):
            return [self._one(part) for part in text.replace(",", " ").split()]

    def _one(self, text: str) -> Fraction:
        value = exact(text)
        _, _, decimals = text.lower().partition("e")[0].partition(".")
        exponent = int(text.lower().partition("e")[2] or 0)
        if decimals or exponent < 0:
            self.units.append(Fraction(10) ** (exponent - len(decimals)))
        return value

    def three(self, text: str | None, what: str, default: str | None = None) -> Vector:
        """Three numbers."""
        return vector(self._of(text, what, 3, default), what)

    def one(self, text: str | None, what: str) -> Fraction:
        """One number."""
        return self._of(text, what, 1, None)[0]

    def _of(self, text: str | None, what: str, count: int, default: str | None) -> list[Fraction]:
        values = self.read(text, what, default)
        if len(values) != count:
            raise InputError(f"{self.where}: {what} has {len(values)} numbers.", f"Give {count}.")
        return values

    def tensor(self, texts: Sequence[str | None], what: Sequence[str]) -> tuple[Six, Fraction]:
        """Six numbers, and the slack of their printed digits: an entry of ½ tr J − J collects four halves of a unit.

        Zeros at the end may have been left out, so that the finest number says the unit; at most a part of the largest.
        """
        self.units = []
        a, b, c, d, e, f = (
            self._of(text, name, 1, None if index < 3 else "0")[0]
            for index, (text, name) in enumerate(zip(texts, what, strict=True))
        )
        return (a, b, c, d, e, f), min(2 * min(self.units, default=Fraction(0)), _MOST_SLACK * max(map(abs, (a, b, c))))


def _rotation(attitude: Attitude) -> Tensor:
    first, second, third = attitude.exact_rows() or attitude.rational_rows(2 * _BITS)
    return first, second, third


def _rpy(numbers: _Numbers, text: str | None, degrees: bool = False) -> Tensor:
    """Roll, pitch and yaw about fixed axes: R = R_z(yaw) R_y(pitch) R_x(roll)."""
    unit = "deg" if degrees else ""
    roll, pitch, yaw = (f"{angle}{unit}" for angle in numbers.three(text, "rpy", "0 0 0"))
    return _rotation(Attitude.euler("ZYX", yaw, pitch, roll))


def _in_axes(axes: Tensor, six: Six) -> Six:
    """The tensor in the axes of the link, v_link = axes v; rounded where the rotation is."""
    turned = six_of(multiplied(axes, multiplied(rows(six), transposed(axes))))
    if all(value.denominator < 1 << _BITS for row in axes for value in row):
        return turned
    a, b, c, d, e, f = (round_to(value, _BITS) for value in turned)
    return a, b, c, d, e, f


def _urdf(root: Element) -> Iterator[BodyInFile]:
    for link in root.iter("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        name = link.get("name", "")
        numbers = _Numbers(f"link {name}")
        origin, tensor, mass = inertial.find("origin"), inertial.find("inertia"), inertial.find("mass")
        pose = {} if origin is None else origin.attrib
        six, slack = numbers.tensor(
            [(tensor.attrib if tensor is not None else {}).get(k) for k in _SIX_URDF], _SIX_URDF
        )
        axes, value = _rpy(numbers, pose.get("rpy")), numbers.one(None if mass is None else mass.get("value"), "mass")
        centre = numbers.three(pose.get("xyz"), "origin xyz", "0 0 0")
        shape = _shape_of(numbers, _shapes_of_urdf(numbers, link), value, centre)
        yield BodyInFile(name, value, centre, _in_axes(axes, six), slack, False, None, *shape)


Shape = tuple[Tensor, Vector, Vector]
"""Axes and centre of a shape, and its principal moments for unit mass."""


def _shape_of(
    numbers: _Numbers, shapes: Sequence[Shape], mass: Fraction, centre: Vector
) -> tuple[Tensor | None, Tensor | None]:
    """The tensor about the centre of mass of one shape, and its axes; nothing of several or of one elsewhere."""
    distinct = {shape[1:]: shape for shape in shapes}
    if len(distinct) != 1:
        return None, None
    axes, middle, moments = shapes[0]
    size = sum(moments)
    if sum((a - b) ** 2 for a, b in zip(middle, centre, strict=True)) > size / 100:
        return None, None
    six = _in_axes(axes, (*(mass * value for value in moments), Fraction(0), Fraction(0), Fraction(0)))  # type: ignore[arg-type]
    return rows(six), axes


def _box(a: Fraction, b: Fraction, c: Fraction) -> Vector:
    return (b * b + c * c) / 12, (a * a + c * c) / 12, (a * a + b * b) / 12


def _cylinder(radius: Fraction, length: Fraction) -> Vector:
    across = (3 * radius * radius + length * length) / 12
    return across, across, radius * radius / 2


def _sphere(radius: Fraction) -> Vector:
    moment = Fraction(2, 5) * radius * radius
    return moment, moment, moment


def _primitive(numbers: _Numbers, geometry: Element, of: Callable[[Element, str], str | None]) -> Vector | None:
    """Moments of a box, cylinder or sphere of unit mass; ``of`` reads a dimension of its element."""
    for kind in ("box", "cylinder", "sphere"):
        shape = geometry.find(kind)
        if shape is None:
            continue
        if kind == "box":
            return _box(*numbers.three(of(shape, "size"), "size"))
        radius = numbers.one(of(shape, "radius"), "radius")
        return _sphere(radius) if kind == "sphere" else _cylinder(radius, numbers.one(of(shape, "length"), "length"))
    return None


def _shapes_of_urdf(numbers: _Numbers, link: Element) -> list[Shape]:
    """Its collision shapes, or where there are none its visual ones; [] where a mesh is among them."""
    for tag in ("collision", "visual"):
        shapes = []
        for part in link.findall(tag):
            geometry, origin = part.find("geometry"), part.find("origin")
            pose = {} if origin is None else origin.attrib
            moments = None if geometry is None else _primitive(numbers, geometry, lambda shape, key: shape.get(key))
            if moments is None:
                return []
            middle = numbers.three(pose.get("xyz"), "origin xyz", "0 0 0")
            shapes.append((_rpy(numbers, pose.get("rpy")), middle, moments))
        if shapes:
            return shapes
    return []


def _sdf(root: Element) -> Iterator[BodyInFile]:
    for link in root.iter("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        name = link.get("name", "")
        numbers = _Numbers(f"link {name}")
        if inertial.get("auto") == "true":
            raise InputError(
                f'{numbers.where}: inertial auto="true" has Gazebo compute mass and tensor from the shapes.',
                "Write the numbers out: gz sdf --print FILE --expand-auto-inertials > FILE.sdf.",
            )
        axes, centre = _pose(numbers, inertial.find("pose"))
        tensor = inertial.find("inertia")
        texts = [None if tensor is None else tensor.findtext(key) for key in _SIX_URDF]
        six, slack = numbers.tensor(texts, _SIX_URDF)
        mass = numbers.one(inertial.findtext("mass"), "mass")
        shapes: list[Shape] = []
        for part in link.findall("collision") or link.findall("visual"):
            geometry = part.find("geometry")
            moments = None if geometry is None else _primitive(numbers, geometry, lambda e, key: e.findtext(key))
            if moments is None:
                shapes = []
                break
            turn, middle = _pose(numbers, part.find("pose"))
            shapes.append((turn, middle, moments))
        shape = _shape_of(numbers, shapes, mass, centre)
        yield BodyInFile(name, mass, centre, _in_axes(axes, six), slack, False, None, *shape)


def _pose(numbers: _Numbers, pose: Element | None) -> tuple[Tensor, Vector]:
    """Rotation and place of a pose x y z roll pitch yaw, or with a quaternion x y z w."""
    if pose is None:
        return _rpy(numbers, None), _ZERO
    values = numbers.read(pose.text, "pose", "0 0 0 0 0 0")
    quaternion = pose.get("rotation_format") == "quat_xyzw"
    if len(values) != (7 if quaternion else 6):
        raise InputError(f"{numbers.where}: pose has {len(values)} numbers.", "Give x y z roll pitch yaw.")
    position = (values[0], values[1], values[2])
    if quaternion:
        x, y, z, w = values[3:]
        return _rotation(Attitude.quaternion(w, x, y, z, normalize=True)), position
    text = " ".join(str(value) for value in values[3:])
    return _rpy(numbers, text, pose.get("degrees") == "true"), position


def _mjcf(root: Element) -> Iterator[BodyInFile]:
    settings = {key: value for compiler in root.iter("compiler") for key, value in compiler.attrib.items()}
    frames = _MjcfFrames(settings.get("angle") == "radian", settings.get("eulerseq", "xyz"))
    classes = _joint_types(root)
    parents = {child: parent for parent in root.iter() for child in parent}
    if settings.get("inertiafromgeom") == "true" or (
        root.find(".//inertial") is None and root.find(".//body/geom") is not None
    ):
        raise InputError(
            "MuJoCo computes mass and tensor of these bodies from their geoms.",
            "Write them out: mujoco.mj_saveLastXML(FILE, model), without inertiafromgeom.",
        )
    for index, body in enumerate(root.iter("body")):
        inertial = body.find("inertial")
        if inertial is None:
            continue
        name = body.get("name") or f"body{index + 1}"
        numbers = _Numbers(f"body {name}")
        axes = frames.rotation(numbers, inertial)
        six, slack = numbers.tensor(_mjcf_six(numbers, inertial), ("M11", "M22", "M33", "M12", "M13", "M23"))
        centre, mass = numbers.three(inertial.get("pos"), "pos"), numbers.one(inertial.get("mass"), "mass")
        joints = (joint for joint in body.findall("joint") if _joint_type(joint, classes, parents) == "ball")
        ball = next(joints, None)
        joint = None if ball is None else numbers.three(ball.get("pos"), "pos", "0 0 0")
        shape = _shape_of(numbers, _geoms(numbers, body, frames), mass, centre)
        yield BodyInFile(name, mass, centre, _in_axes(axes, six), slack, False, joint, *shape)


def _mjcf_six(numbers: _Numbers, inertial: Element) -> Sequence[str | None]:
    """The six numbers of fullinertia, or the three of diaginertia with zeros."""
    full = inertial.get("fullinertia")
    parts = [*(inertial.get("diaginertia") or "").split(), "0", "0", "0"] if full is None else full.split()
    if full is not None and len(parts) == 9:
        raise InputError(
            f"{numbers.where}: fullinertia has 9 numbers, a matrix row by row.",
            "Give M11 M22 M33 M12 M13 M23: " + " ".join(parts[i] for i in (0, 4, 8, 1, 2, 5)) + ".",
        )
    if full is not None and any(inertial.get(key) is not None for key in _ORIENTATIONS):
        raise InputError(
            f"{numbers.where}: fullinertia and an orientation of the inertial frame contradict each other.",
            "Give fullinertia in the axes of the body alone, or diaginertia with quat.",
        )
    if len(parts) != 6:
        raise InputError(f"{numbers.where}: diaginertia or fullinertia is missing.", "Give 3 or 6 numbers.")
    return parts


_ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")


def _joint_types(root: Element) -> dict[str, str]:
    """The type of joint of each default class, which it has from the class around it unless it says another."""
    types: dict[str, str] = {}

    def collect(default: Element, inherited: str) -> None:
        joint = default.find("joint")
        own = inherited if joint is None else joint.get("type", inherited)
        types[default.get("class", "main")] = own
        for nested in default.findall("default"):
            collect(nested, own)

    for default in root.findall("default"):
        collect(default, "hinge")
    return types


def _joint_type(joint: Element, types: dict[str, str], parents: dict[Element, Element]) -> str:
    """The type that a joint says, or that of its class, or of the childclass of the nearest body around it."""
    name, around = joint.get("class"), joint
    while name is None and around in parents:
        around = parents[around]
        name = around.get("childclass")
    return joint.get("type") or types.get(name or "main", "hinge")


@dataclass(frozen=True, slots=True)
class _MjcfFrames:
    """Units and sequence of angles in an MJCF file; of the sequence small letters turn with the frame."""

    radians: bool
    sequence: str

    def rotation(self, numbers: _Numbers, element: Element) -> Tensor:
        """Rotation of a frame: a quaternion, axisangle, or euler angles."""
        for key in ("xyaxes", "zaxis"):
            if element.get(key) is not None:
                raise InputError(f"{numbers.where}: {key} is not read.", "Give the frame by quat.")
        if element.get("quat") is not None:
            quaternion = numbers.read(element.get("quat"), "quat")
            if len(quaternion) != 4:
                raise InputError(f"{numbers.where}: quat has {len(quaternion)} numbers.", "Give w x y z.")
            return _rotation(Attitude.quaternion(*quaternion, normalize=True))
        unit = "" if self.radians else "deg"
        if element.get("axisangle") is not None:
            *axis, angle = numbers.read(element.get("axisangle"), "axisangle")
            return _rotation(Attitude.axis_angle(axis, f"{angle}{unit}"))
        turns = _IDENTITY
        angles = numbers.three(element.get("euler"), "euler", "0 0 0")
        for letter, angle in zip(self.sequence, angles, strict=True):
            around = [int(letter.lower() == name) for name in "xyz"]
            turn = _rotation(Attitude.axis_angle(around, f"{angle}{unit}"))
            turns = multiplied(turns, turn) if letter.islower() else multiplied(turn, turns)
        return turns


def _geoms(numbers: _Numbers, body: Element, frames: _MjcfFrames) -> list[Shape]:
    shapes: list[Shape] = []
    for geom in body.findall("geom"):
        size = numbers.read(geom.get("size"), "size", "")
        kind = geom.get("type", "sphere")
        if (kind, len(size)) == ("box", 3):
            moments = _box(*(2 * value for value in size))
        elif (kind, len(size)) == ("cylinder", 2):
            moments = _cylinder(size[0], 2 * size[1])
        elif (kind, len(size)) == ("sphere", 1):
            moments = _sphere(size[0])
        else:
            return []
        shapes.append((frames.rotation(numbers, geom), numbers.three(geom.get("pos"), "pos", "0 0 0"), moments))
    return shapes


_PRIM = re.compile(r'(?:def|over)\s+(?:\w+\s+)?"([^"]*)"')
_USD = re.compile(r"physics:(mass|centerOfMass|diagonalInertia|principalAxes)\s*=\s*(\([^)]*\)|[^\s]+)")


def _usd(text: str) -> Iterator[BodyInFile]:
    """Prims of USD as text that have a mass and a diagonal inertia; by their names."""
    units = {
        key: exact(value) for key, value in re.findall(r"\b(metersPerUnit|kilogramsPerUnit)\s*=\s*([-+.\deE]+)", text)
    }
    length, kilogram = units.get("metersPerUnit", Fraction(1, 100)), units.get("kilogramsPerUnit", Fraction(1))
    text = re.sub(r"(?m)#.*$", "", text)
    starts = [*_PRIM.finditer(text)]
    for index, prim in enumerate(starts):
        end = starts[index + 1].start() if index + 1 < len(starts) else len(text)
        values = {key: value.strip("()") for key, value in _USD.findall(text[prim.end() : end])}
        if not {"mass", "diagonalInertia"} <= values.keys():
            continue
        numbers = _Numbers(f"prim {prim[1]}")
        parts = [*values["diagonalInertia"].replace(",", " ").split(), "0", "0", "0"]
        if len(parts) != 6:
            raise InputError(f"{numbers.where}: diagonalInertia has {len(parts) - 3} numbers.", "Give 3.")
        if "inf" in values.get("centerOfMass", "") or not any(
            numbers.read(values["diagonalInertia"], "diagonalInertia")
        ):
            raise InputError(
                f"{numbers.where}: an infinite centre of mass or a tensor of zeros has USD compute it from the shapes.",
                "Give physics:centerOfMass and physics:diagonalInertia in numbers.",
            )
        six, slack = numbers.tensor(parts, ("I1", "I2", "I3", "I12", "I13", "I23"))
        axes = numbers.read(values.get("principalAxes"), "principalAxes", "1 0 0 0")
        if len(axes) != 4:
            raise InputError(
                f"{numbers.where}: principalAxes has {len(axes)} numbers.", "Give a quaternion w, x, y, z."
            )
        # a quaternion of zeros says that USD computes the axes
        turn = _rotation(Attitude.quaternion(*(axes if any(axes) else [1, 0, 0, 0]), normalize=True))
        scale = kilogram * length**2
        a, b, c, d, e, f = (value * scale for value in _in_axes(turn, six))
        x, y, z = (value * length for value in numbers.three(values.get("centerOfMass"), "centerOfMass", "0 0 0"))
        mass = numbers.one(values["mass"], "mass") * kilogram
        yield BodyInFile(prim[1], mass, (x, y, z), (a, b, c, d, e, f), slack * scale)


def _toml(path: Path, text: str) -> Iterator[BodyInFile]:
    """Tables with mass, centre, inertia and about, as a plan has them in [[top]]; at the top of the file as one."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path} is not TOML: {error}.", _FORMATS) from None
    tables = document.get("top", [document])
    for index, table in enumerate(tables if isinstance(tables, list) else [tables]):
        if not isinstance(table, dict) or not {"mass", "inertia"} <= table.keys():
            continue
        name = str(table.get("name", f"top{index + 1}"))
        numbers = _Numbers(f"top {name}")
        texts = _texts(table["inertia"])
        if len(texts) == 9:
            if any(exact(texts[i]) != exact(texts[j]) for i, j in ((1, 3), (2, 6), (5, 7))):
                raise InputError(f"{numbers.where}: the inertia tensor is not symmetric.", "Give each product once.")
            texts = [texts[i] for i in (0, 4, 8, 1, 2, 5)]
        if len(texts) == 3:
            texts += ["0"] * 3
        if len(texts) != 6:
            raise InputError(f"{numbers.where}: inertia has {len(texts)} numbers.", "Give 3, 6 or 9.")
        six, slack = numbers.tensor(texts, ("I11", "I22", "I33", "I12", "I13", "I23"))
        centre = numbers.three(" ".join(_texts(table.get("centre", ["0", "0", "0"]))), "centre")
        mass = numbers.one(str(table["mass"]), "mass")
        if table.get("about") not in ("pivot", "centre of mass") and (any(centre) or "about" in table):
            raise InputError(
                f"{numbers.where}: it is not said which point the inertia tensor is about.",
                'Give about = "pivot" or about = "centre of mass".',
            )
        yield BodyInFile(name, mass, centre, six, slack, table.get("about") == "pivot", si=False)


def _texts(values: Any) -> list[str]:
    parts: list[str] = []
    for value in values if isinstance(values, list) else str(values).split(","):
        parts += _texts(value) if isinstance(value, list) else [str(value).strip()]
    return parts
