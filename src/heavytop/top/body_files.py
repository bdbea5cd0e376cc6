"""Mass, centre of mass and inertia tensor out of files of robots: URDF, MJCF, SDF, USD, and TOML.

Numbers are exact, to the digits in the file.  A rotation of the inertial axes with irrational entries is rounded to
2^-64.  Units are kg and metres, as these formats have it.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import isqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heavytop.errors import InputError, prefixed, quoted
from heavytop.files import read_whole
from heavytop.precision import Vector, cross, exact, round_to, vector
from heavytop.top import inertia_slips
from heavytop.top.attitude import Attitude, multiplied, transposed
from heavytop.top.inertia_slips import Six, Tensor, rows, six_of

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_BITS = 64
_UTF8_MARK = b"\xef\xbb\xbf"
_LARGEST_FILE = 50_000_000
_LARGEST = Fraction(10**30)
_MOST_SLACK = Fraction(1, 200)
_FROM_DOUBLE = Fraction(1, 10**14)
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
    links = list(_links(path))
    chosen = [(name, read) for name, read in links if link in (None, name)]
    names = ", ".join(name for name, _ in links[:20]) or "none"
    if link is not None and not chosen:
        raise InputError(f"{path} has no link {quoted(link)} with an inertia.", f"It has {names}.")
    if not chosen:
        raise InputError(f"{path} holds no mass properties.", "A body needs its mass and its inertia tensor.")
    if len(chosen) > 1:
        remedy = f'Choose one: --link NAME, or link="{links[0][0]}" in Python.'
        remedy = remedy if link is None else "Give each of them another name."
        raise InputError(f"{path} holds {len(chosen)} bodies: {names}.", remedy)
    body = chosen[0][1]()
    if body.mass <= 0:
        raise InputError(f"{body.name}: mass must be positive; got {body.mass}.", "Give its mass in kg.")
    largest = max(map(abs, body.six))
    extremes = max(body.mass, largest, *map(abs, body.centre)), min(body.mass, largest or body.mass)
    if extremes[0] > _LARGEST or extremes[1] < 1 / _LARGEST:
        raise InputError(f"{body.name}: mass, centre and moments must be of 1e-30 to 1e30.", "Give them in kg and m.")
    return body


Link = tuple[str, Callable[[], BodyInFile]]
"""The name of a link or body, and what reads it: a fault of one does not keep another from being read."""


def _links(path: Path) -> Iterator[Link]:
    try:
        content = read_whole(path)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.", "Give a file that is there.") from None
    if len(content) > _LARGEST_FILE:
        raise InputError(f"{path} has {len(content)} bytes.", f"A body is read from at most {_LARGEST_FILE}.")
    if content.startswith(_BINARY_USD) or (content.startswith(b"#usda") and _COMPOSED.search(content)):
        return composed_usd(path)
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


def _xml(path: Path, content: bytes) -> Iterator[Link]:
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
    if root.tag in ("mujoco", "mujocoinclude"):
        return _mjcf(path, root)
    if root.tag not in ("robot", "sdf"):
        raise InputError(f"{path} is XML with the root <{root.tag}>.", _FORMATS)
    return _of_links(root, _urdf if root.tag == "robot" else _sdf)


def _of_links(root: Element, reader: Callable[[str, Element, Element], BodyInFile]) -> Iterator[Link]:
    """The links with an inertial element, by their names; where several models have links, behind the model's."""
    models = root.findall(".//model")
    owners = {link: model.get("name", "") for model in models for link in model.findall("link")}
    several = len(set(owners.values())) > 1
    for link in root.iter("link"):
        name, inertial = link.get("name", ""), link.find("inertial")
        if inertial is not None:
            name = f"{owners[link]}::{name}" if several and link in owners else name
            yield name, partial(reader, name, link, inertial)


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

    def four(self, text: str, what: str) -> list[Fraction]:
        """Four numbers."""
        return self._of(text, what, 4, None)

    def one(self, text: str | None, what: str) -> Fraction:
        """One number."""
        return self._of(text, what, 1, None)[0]

    def _of(self, text: str | None, what: str, count: int, default: str | None) -> list[Fraction]:
        values = self.read(text, what, default)
        if len(values) != count:
            raise InputError(f"{self.where}: {what} has {len(values)} numbers.", f"Give {count}.")
        return values

    def require_known(self, names: Iterable[str], element: Element, known: Sequence[str], what: str) -> None:
        """Raises InputError for a name that is not of the format, unless it is of another namespace."""
        for name in names:
            if name not in known and not name.startswith("{"):
                remedy = f"It has {', '.join(known)}." if known else "It has none."
                raise InputError(f"{self.where}: unknown {what} {name} of <{element.tag}>.", remedy)

    def attributes(self, element: Element | None, *known: str) -> Mapping[str, str]:
        """Those of an element, all of them ``known``; none where it is not there."""
        if element is None:
            return {}
        self.require_known(element.attrib, element, known, "attribute")
        return element.attrib

    def tensor(
        self, texts: Sequence[str | None], what: Sequence[str], products: str | None = None
    ) -> tuple[Six, Fraction]:
        """Six numbers, and the slack of their printed digits: an entry of ½ tr J − J collects four halves of a unit.

        Zeros at the end may have been left out, so that the finest number says the unit; at most a part of the largest.
        products: what the format takes for a product of inertia that is not there.
        """
        self.units = []
        a, b, c, d, e, f = (
            self._of(text, name, 1, None if index < 3 else products)[0]
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


def _urdf(name: str, link: Element, inertial: Element) -> BodyInFile:
    numbers = _Numbers(f"link {name}")
    numbers.attributes(inertial)
    numbers.require_known([part.tag for part in inertial], inertial, ("origin", "mass", "inertia"), "element")
    tensor = numbers.attributes(inertial.find("inertia"), *_SIX_URDF)
    six, slack = numbers.tensor([tensor.get(key) for key in _SIX_URDF], _SIX_URDF)
    value = numbers.one(numbers.attributes(inertial.find("mass"), "value").get("value"), "mass")
    axes, centre = _origin(numbers, inertial)
    shape = _shape_of(numbers, _shapes_of_urdf(numbers, link), value, centre)
    return BodyInFile(name, value, centre, _in_axes(axes, six), slack, False, None, *shape)


def _origin(numbers: _Numbers, element: Element) -> tuple[Tensor, Vector]:
    """Rotation and place of an element of a URDF."""
    pose = numbers.attributes(element.find("origin"), "xyz", "rpy", "quat_xyzw")
    centre, quaternion = numbers.three(pose.get("xyz"), "origin xyz", "0 0 0"), pose.get("quat_xyzw")
    if quaternion is None:
        return _rpy(numbers, pose.get("rpy")), centre
    if "rpy" in pose:
        raise InputError(f"{numbers.where}: origin has rpy and quat_xyzw.", "Give one of them.")
    x, y, z, w = numbers.four(quaternion, "quat_xyzw")
    return _turn(w, x, y, z), centre


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
            geometry = part.find("geometry")
            moments = None if geometry is None else _primitive(numbers, geometry, lambda shape, key: shape.get(key))
            if moments is None:
                return []
            shapes.append((*_origin(numbers, part), moments))
        if shapes:
            return shapes
    return []


_SDF_INERTIAL = ("mass", "pose", "inertia", "density", "auto_inertia_params", "fluid_added_mass")


def _sdf(name: str, link: Element, inertial: Element) -> BodyInFile:
    numbers = _Numbers(f"link {name}")
    numbers.require_known([part.tag for part in inertial], inertial, _SDF_INERTIAL, "element")
    if numbers.attributes(inertial, "auto").get("auto") == "true":
        raise InputError(
            f'{numbers.where}: inertial auto="true" has Gazebo compute mass and tensor from the shapes.',
            "Write the numbers out: gz sdf --print FILE --expand-auto-inertials > FILE.sdf.",
        )
    axes, centre = _pose(numbers, inertial.find("pose"))
    tensor = inertial.find("inertia")
    if tensor is not None:
        numbers.require_known([part.tag for part in tensor], tensor, _SIX_URDF, "element")
    texts = [None if tensor is None else tensor.findtext(key) for key in _SIX_URDF]
    six, slack = numbers.tensor(texts, _SIX_URDF, products="0")
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
    return BodyInFile(name, mass, centre, _in_axes(axes, six), slack, False, None, *shape)


def _pose(numbers: _Numbers, pose: Element | None) -> tuple[Tensor, Vector]:
    """Rotation and place of a pose x y z roll pitch yaw, or with a quaternion x y z w."""
    if pose is None:
        return _rpy(numbers, None), _ZERO
    values = numbers.read(pose.text, "pose", "0 0 0 0 0 0")
    form = numbers.attributes(pose, "rotation_format", "degrees", "relative_to", "frame")
    quaternion = form.get("rotation_format") == "quat_xyzw"
    if len(values) != (7 if quaternion else 6):
        raise InputError(f"{numbers.where}: pose has {len(values)} numbers.", "Give x y z roll pitch yaw.")
    position = (values[0], values[1], values[2])
    if quaternion:
        x, y, z, w = values[3:]
        return _turn(w, x, y, z), position
    text = " ".join(str(value) for value in values[3:])
    return _rpy(numbers, text, form.get("degrees") == "true"), position


def _mjcf(path: Path, root: Element) -> Iterator[Link]:
    """The bodies with an inertial element, exactly; those without, with geoms or of other files, by MuJoCo itself."""
    settings = {key: value for compiler in root.iter("compiler") for key, value in compiler.attrib.items()}
    frames = _MjcfFrames(settings.get("angle") == "radian", settings.get("eulerseq", "xyz"))
    defaults = _Defaults.of(root)
    computed = settings.get("inertiafromgeom") == "true" or "settotalmass" in settings
    for index, body in enumerate(root.iter("body")):
        name, inertial = body.get("name") or f"body{index + 1}", body.find("inertial")
        if computed or (inertial is None and body.find("geom") is not None):
            yield name, partial(by_mujoco, path, name, index)
        elif inertial is not None:
            yield name, partial(_mjcf_body, name, body, inertial, frames, defaults)
    if root.find(".//include") is not None or root.find(".//attach") is not None:
        yield from _included(path, {body.get("name") for body in root.iter("body")})


def _mjcf_body(name: str, body: Element, inertial: Element, frames: _MjcfFrames, defaults: _Defaults) -> BodyInFile:
    numbers = _Numbers(f"body {name}")
    known = ("pos", "mass", "diaginertia", "fullinertia", *_ORIENTATIONS)
    axes = frames.rotation(numbers, numbers.attributes(inertial, *known))
    six, slack = numbers.tensor(_mjcf_six(numbers, inertial), ("M11", "M22", "M33", "M12", "M13", "M23"))
    centre, mass = numbers.three(inertial.get("pos"), "pos"), numbers.one(inertial.get("mass"), "mass")
    joints = [defaults.attributes(joint) for joint in body.findall("joint")]
    ball = next((joint for joint in joints if joint.get("type", "hinge") == "ball"), None)
    joint = None if ball is None else numbers.three(ball.get("pos"), "pos", "0 0 0")
    geoms = [defaults.attributes(geom) for geom in body.findall("geom")]
    shape = _shape_of(numbers, _geoms(numbers, geoms, frames), mass, centre)
    return BodyInFile(name, mass, centre, _in_axes(axes, six), slack, False, joint, *shape)


def _compiled(path: Path) -> Any:
    """The model that MuJoCo makes of a file; raises InputError without it, and for what it refuses."""
    try:
        import mujoco
    except ImportError:
        raise InputError(
            "MuJoCo computes mass and tensor of these bodies, from their geoms or out of other files.",
            "Install it with: pip install 'heavytop[engines]'; or write them out: mujoco.mj_saveLastXML(FILE, model), "
            "without inertiafromgeom.",
        ) from None
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"MuJoCo refuses {path}: {' '.join(str(error).split())}.", "Mend the file.") from None


def by_mujoco(path: Path, name: str, index: int) -> BodyInFile:
    """The body of this place in the file, as MuJoCo computes it in double."""
    model = _compiled(path)
    names = [model.body(i).name for i in range(model.nbody)]
    return _of_model(model, name, names.index(name) if name in names else index + 1)


def _of_model(model: Any, name: str, body: int) -> BodyInFile:
    values = [Fraction(repr(float(value))) for value in model.body_inertia[body]]
    six = _in_axes(_turn(*map(float, model.body_iquat[body])), (*values, *_ZERO))  # type: ignore[arg-type]
    x, y, z = (Fraction(repr(float(value))) for value in model.body_ipos[body])
    balls = [j for j in range(model.njnt) if model.jnt_bodyid[j] == body and model.jnt_type[j] == 1]
    joint = vector([float(value) for value in model.jnt_pos[balls[0]]], "pos") if balls else None
    mass = Fraction(repr(float(model.body_mass[body])))
    return BodyInFile(name, mass, (x, y, z), six, _FROM_DOUBLE * max(values), False, joint)


def _included(path: Path, known: set[str | None]) -> Iterator[Link]:
    """The bodies that a file takes from others."""
    model = _compiled(path)
    for index in range(1, model.nbody):
        name = model.body(index).name or f"body{index}"
        if name not in known and model.body_mass[index] > 0:
            yield name, partial(_of_model, model, name, index)


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


_ORIENTATIONS = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}
"""What gives the orientation of a frame in MJCF, and how many numbers that has."""


@dataclass(frozen=True, slots=True)
class _Defaults:
    """Attributes of each default class by tag, from the classes around it too; and the element around each element."""

    classes: dict[str, dict[str, dict[str, str]]]
    parents: dict[Element, Element]

    @classmethod
    def of(cls, root: Element) -> _Defaults:
        """Those of a file."""
        classes: dict[str, dict[str, dict[str, str]]] = {}

        def collect(default: Element, inherited: dict[str, dict[str, str]]) -> None:
            own = {part.tag: part.attrib for part in default if part.tag != "default"}
            merged = {tag: inherited.get(tag, {}) | own.get(tag, {}) for tag in inherited.keys() | own.keys()}
            classes[default.get("class", "main")] = merged
            for nested in default.findall("default"):
                collect(nested, merged)

        for default in root.findall("default"):
            collect(default, {})
        return cls(classes, {child: parent for parent in root.iter() for child in parent})

    def attributes(self, element: Element) -> dict[str, str]:
        """Those of an element and of its class, or of the childclass of the nearest body around it."""
        name, around = element.get("class"), element
        while name is None and around in self.parents:
            around = self.parents[around]
            name = around.get("childclass")
        return self.classes.get(name or "main", {}).get(element.tag, {}) | element.attrib


@dataclass(frozen=True, slots=True)
class _MjcfFrames:
    """Units and sequence of angles in an MJCF file; of the sequence small letters turn with the frame."""

    radians: bool
    sequence: str

    def rotation(self, numbers: _Numbers, frame: Mapping[str, str]) -> Tensor:
        """Rotation of a frame: a quaternion, axisangle, two axes, the third axis, or euler angles."""
        key = next((key for key in _ORIENTATIONS if key in frame), "euler")
        values = numbers.read(frame.get(key), key, "0 0 0")
        if len(values) != _ORIENTATIONS[key]:
            raise InputError(f"{numbers.where}: {key} has {len(values)} numbers.", f"Give {_ORIENTATIONS[key]}.")
        unit = "" if self.radians else "deg"
        if key == "quat":
            return _turn(*values)
        if key == "axisangle":
            return _rotation(Attitude.axis_angle(values[:3], f"{values[3]}{unit}"))
        if key == "xyaxes":
            return _of_axes(values[:3], values[3:])
        if key == "zaxis":  # the least rotation of e_z to it
            x, y, z = _unit(values)
            return _turn(*((1 + z, -y, x, 0) if z > -1 else (0, 1, 0, 0)))
        turns = _IDENTITY
        for letter, angle in zip(self.sequence, values, strict=True):
            around = [int(letter.lower() == name) for name in "xyz"]
            turn = _rotation(Attitude.axis_angle(around, f"{angle}{unit}"))
            turns = multiplied(turns, turn) if letter.islower() else multiplied(turn, turns)
        return turns


def _turn(*quaternion: Any) -> Tensor:
    return _rotation(Attitude.quaternion(*quaternion, normalize=True))


def _unit(values: Sequence[Fraction]) -> Vector:
    """The unit vector along a vector, to 2^-128; raises InputError for 0."""
    x, y, z = values
    square = x * x + y * y + z * z
    if not square:
        raise InputError("An axis must not be zero.", "Give the axis of the frame.")
    shift = max(0, square.denominator.bit_length() - square.numerator.bit_length()) // 2 + 2 * _BITS
    length = Fraction(isqrt((square.numerator << 2 * shift) // square.denominator), 1 << shift)
    return x / length, y / length, z / length


def _of_axes(x: Sequence[Fraction], y: Sequence[Fraction]) -> Tensor:
    """The frame of an axis x and of one that with it spans the plane of x and y."""
    first = _unit(x)
    third = _unit(cross(first, vector(y, "xyaxes")))
    columns = (first, cross(third, first), third)
    return _rotation(Attitude.matrix(transposed(columns), normalize=True))


def _geoms(numbers: _Numbers, geoms: Sequence[Mapping[str, str]], frames: _MjcfFrames) -> list[Shape]:
    shapes: list[Shape] = []
    for geom in geoms:
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
_USD_NAMES = ("mass", "centerOfMass", "diagonalInertia", "principalAxes")
_USD = re.compile(rf"physics:({'|'.join(_USD_NAMES)})\s*=\s*(\([^)]*\)|[^\s]+)")


def _usd(text: str) -> Iterator[Link]:
    """Prims of USD as text that have a mass and a diagonal inertia; by their names."""
    units = {
        key: exact(value) for key, value in re.findall(r"\b(metersPerUnit|kilogramsPerUnit)\s*=\s*([-+.\deE]+)", text)
    }
    text = re.sub(r"(?m)#.*$", "", text)
    starts = [*_PRIM.finditer(text)]
    for index, prim in enumerate(starts):
        end = starts[index + 1].start() if index + 1 < len(starts) else len(text)
        values = {key: value.strip("()") for key, value in _USD.findall(text[prim.end() : end])}
        if {"mass", "diagonalInertia"} <= values.keys():
            yield prim[1], partial(_prim, prim[1], values, units)


def _prim(name: str, values: Mapping[str, str], units: Mapping[str, Fraction]) -> BodyInFile:
    length, kilogram = units.get("metersPerUnit", Fraction(1, 100)), units.get("kilogramsPerUnit", Fraction(1))
    numbers = _Numbers(f"prim {name}")
    parts = [*values["diagonalInertia"].replace(",", " ").split(), "0", "0", "0"]
    if len(parts) != 6:
        raise InputError(f"{numbers.where}: diagonalInertia has {len(parts) - 3} numbers.", "Give 3.")
    if "inf" in values.get("centerOfMass", "") or not any(numbers.read(values["diagonalInertia"], "diagonalInertia")):
        raise InputError(
            f"{numbers.where}: an infinite centre of mass or a tensor of zeros has USD compute it from the shapes.",
            "Give physics:centerOfMass and physics:diagonalInertia in numbers.",
        )
    six, slack = numbers.tensor(parts, ("I1", "I2", "I3", "I12", "I13", "I23"))
    axes = numbers.read(values.get("principalAxes"), "principalAxes", "1 0 0 0")
    if len(axes) != 4:
        raise InputError(f"{numbers.where}: principalAxes has {len(axes)} numbers.", "Give a quaternion w, x, y, z.")
    # a quaternion of zeros says that USD computes the axes
    turn = _turn(*(axes if any(axes) else [1, 0, 0, 0]))
    scale = kilogram * length**2
    a, b, c, d, e, f = (value * scale for value in _in_axes(turn, six))
    x, y, z = (value * length for value in numbers.three(values.get("centerOfMass"), "centerOfMass", "0 0 0"))
    mass = numbers.one(values["mass"], "mass") * kilogram
    return BodyInFile(name, mass, (x, y, z), (a, b, c, d, e, f), slack * scale)


_BINARY_USD = (b"PXR-USDC", b"PK\x03\x04")
_COMPOSED = re.compile(rb"\b(references|payload|subLayers|inherits|variantSet)\b")
"""What takes a prim of USD together from several places."""


def composed_usd(path: Path) -> Iterator[Link]:
    """Prims of binary USD, or of several layers, by the package usd-core; their numbers as it prints them."""
    try:
        from pxr import Tf, Usd, UsdGeom, UsdPhysics
    except ImportError:
        raise InputError(
            f"{path} is binary USD, or refers to other layers.",
            "Install usd-core: pip install 'heavytop[engines]'; or flatten it: usdcat --flatten FILE -o FILE.usda.",
        ) from None
    try:
        stage = Usd.Stage.Open(str(path))
        faults = [str(fault).rstrip(".") for fault in stage.GetCompositionErrors()]
    except Tf.ErrorException as error:
        faults = [part.commentary for part in error.args]
    if faults:
        raise InputError(f"USD refuses {path}: {'; '.join(faults)[:200]}.", "Mend the file, or its layers.")
    units = {
        "metersPerUnit": exact(repr(UsdGeom.GetStageMetersPerUnit(stage))),
        "kilogramsPerUnit": exact(repr(UsdPhysics.GetStageKilogramsPerUnit(stage))),
    }
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        attributes = {name: prim.GetAttribute(f"physics:{name}") for name in _USD_NAMES}
        first = {name: part.Get(Usd.TimeCode.EarliestTime()) for name, part in attributes.items()}
        values = {name: _printed(value) for name, value in first.items() if attributes[name].HasAuthoredValue()}
        if {"mass", "diagonalInertia"} <= values.keys():
            yield prim.GetName(), partial(_prim, prim.GetName(), values, units)


def _printed(value: Any) -> str:
    """The shortest decimals of numbers in single precision."""
    import numpy

    parts = [value.real, *value.imaginary] if hasattr(value, "imaginary") else numpy.ravel(value)
    return ", ".join(str(numpy.float32(part)) for part in parts)


def _toml(path: Path, text: str) -> Iterator[Link]:
    """Tables with mass, centre, inertia and about, as a plan has them in [[top]]; at the top of the file as one."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path} is not TOML: {error}.", _FORMATS) from None
    tables = document.get("top", [document])
    for index, table in enumerate(tables if isinstance(tables, list) else [tables]):
        if isinstance(table, dict) and {"mass", "inertia"} <= table.keys():
            name = str(table.get("name", f"top{index + 1}"))
            yield name, partial(_toml_table, name, table)


def _toml_table(name: str, table: Mapping[str, Any]) -> BodyInFile:
    numbers = _Numbers(f"top {name}")
    texts = _texts(table["inertia"])
    if len(texts) == 9:
        with prefixed(numbers.where):
            inertia_slips.six_of_nine([exact(entry) for entry in texts])
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
    return BodyInFile(name, mass, centre, six, slack, table.get("about") == "pivot", si=False)


def _texts(values: Any) -> list[str]:
    parts: list[str] = []
    for value in values if isinstance(values, list) else str(values).split(","):
        parts += _texts(value) if isinstance(value, list) else [str(value).strip()]
    return parts
