"""Mass, centre of mass and inertia tensor of bodies in files: URDF, MJCF, SDF, USD, and TOML.

Numbers are exact, to the digits in the file.  A rotation of the inertial axes with irrational entries is rounded to
2^-64.  Units are kg and metres, as these formats have it.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heavytop.display import plural
from heavytop.errors import InputError, nearest, prefixed, quoted, refusal
from heavytop.files import read_whole, readable
from heavytop.precision import Vector, cross, exact, round_to, six_digits, square_root, vector
from heavytop.top import inertia_slips
from heavytop.top.attitude import Attitude, multiplied, rotated, transposed
from heavytop.top.inertia_slips import Six, Tensor, rows, six_of

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_BITS = 64
_UTF8_MARK = b"\xef\xbb\xbf"
_LARGEST_FILE = 50_000_000
_LARGEST = Fraction(10**30)
_MOST_SLACK = Fraction(1, 200)
_COMPARABLE, _MOST_DIGITS = Fraction(1, 1000), Fraction(10**99)
_FROM_DOUBLE = Fraction(1, 10**14)
_ZERO: Vector = (Fraction(0), Fraction(0), Fraction(0))
EARTH: Vector = (Fraction(0), Fraction(0), Fraction("-9.81"))
_IDENTITY: Tensor = rows((Fraction(1), Fraction(1), Fraction(1), *_ZERO))
_SIX_URDF = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_FORMATS = "Give a URDF, MJCF or SDF file, USD as text (.usda), or TOML with mass, centre and inertia."


@dataclass(frozen=True, slots=True)
class BodyInFile:
    """A link or body of a file, in its own axes and units of kg and metres.

    centre: of mass.  six: I11, I22, I33, I12, I13, I23 about the centre of mass, or the origin where ``at_pivot``.
    slack: rounding of the printed digits, of an entry of the second moments.
    geometry, geometry_axes: tensor about its centre of the one shape that the file gives it, uniform and of 1 kg, and
    the rotation of its axes; None where it gives none, several, or a mesh.
    joint: where a ball joint holds it, or None.  gravity: in the axes of the world.  note: what the file leaves out, or
    is not read of it, as a sentence.
    """

    name: str
    mass: Fraction
    centre: Vector
    six: Six
    slack: Fraction
    geometry: Tensor | None = None
    geometry_axes: Tensor | None = None
    joint: Vector | None = None
    gravity: Vector = EARTH
    at_pivot: bool = False
    si: bool = True
    note: str = ""

    @property
    def gravity_down(self) -> Fraction:
        """The acceleration of gravity; raises InputError where it is not along -z."""
        x, y, z = self.gravity
        if x or y or z > 0:
            cause = f"{self.name}: gravity must be along -z; got {', '.join(map(six_digits, self.gravity))}."
            raise InputError(cause, "Give its size, --gravity or gravity in Python: e_z of the start then points up.")
        return -z

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
        remedy = remedy if link is None else "Give each a different name."
        raise InputError(f"{path} holds {len(chosen)} bodies: {names}.", remedy)
    body = chosen[0][1]()
    if body.mass <= 0:
        raise refusal(f"{body.name}: mass", "positive", body.mass, "Give its mass in kg.")
    largest = max(map(abs, body.six))
    farthest = max(map(abs, (Fraction(1), *body.centre)))
    for key, size in (("mass", body.mass), ("inertia", largest or body.mass), ("centre", farthest)):
        if not 1 / _LARGEST <= size <= _LARGEST:
            raise refusal(f"{body.name}: {key}", "of 1e-30 to 1e30", six_digits(size), "Give it in kg and m.")
    return body


Link = tuple[str, Callable[[], BodyInFile]]
"""The name of a link or body, and its reader: a fault of one does not prevent reading another."""


def _links(path: Path) -> Iterator[Link]:
    with readable(path, "Give an existing file."):
        content = read_whole(path)
    if len(content) > _LARGEST_FILE:
        raise InputError(f"{path} has {len(content)} bytes.", f"Give a file of at most {_LARGEST_FILE} bytes.")
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
    raise InputError(f"The format of {path} is not known.", _FORMATS)


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
    for element in root.iter():
        _require_spelt(
            f"<{element.tag}>", [*element.attrib, *(child.tag for child in element)], _READ.get(element.tag, ())
        )
    if root.tag in ("mujoco", "mujocoinclude"):
        return _mjcf(path, root)
    if root.tag not in ("robot", "sdf"):
        raise InputError(f"The root element of {path} is <{root.tag}>.", _FORMATS)
    return _of_links(root, _urdf if root.tag == "robot" else _sdf)


_READ = {
    "mujoco": ("compiler", "option"),
    "compiler": (
        *("angle", "eulerseq", "coordinate", "inertiafromgeom", "fusestatic", "settotalmass"),
        *("boundmass", "boundinertia", "balanceinertia"),
    ),
    "option": ("gravity", "flag"),
    "flag": ("gravity",),
    "body": ("inertial", "gravcomp", "childclass"),
    "world": ("gravity",),
    "link": ("inertial", "gravity"),
}
"""Attributes and parts of elements that change mass properties or gravity; the formats have many others."""
_ALIKE = 0.8
"""Similarity from which a name is a misspelling of another."""


def _require_spelt(where: str, names: Iterable[str], read: Sequence[str]) -> None:
    """Raises InputError for a misspelling of a name that is read."""
    for name in names:
        if name not in read and (near := nearest(name, read, _ALIKE)):
            raise InputError(f"{where}: unknown {name}.", f"Did you mean {near}?")


_Around = Mapping["Element", "Element"]
"""The element around each element of a file."""


def _around(root: Element) -> _Around:
    return {child: element for element in root.iter() for child in element}


def _of_links(root: Element, reader: Callable[[str, Element, Element, _Around], BodyInFile]) -> Iterator[Link]:
    """The links with an inertial element, by their names, after that of the model where several models have links."""
    around = _around(root)
    several = len({around[link] for link in root.findall(".//model/link")}) > 1
    for link in root.iter("link"):
        name, inertial, model = link.get("name", ""), link.find("inertial"), around[link]
        if inertial is not None:
            name = f"{model.get('name', '')}::{name}" if several and model.tag == "model" else name
            yield name, partial(reader, name, link, inertial, around)


class _Numbers:
    """Numbers of one element of a file; of each its size, the unit in its last digit, and whether it is a decimal."""

    def __init__(self, where: str, if_missing: str = "Give it in the file.") -> None:
        self.where, self.if_missing = where, if_missing
        self.units: list[tuple[Fraction, Fraction, bool]] = []

    def read(self, text: str | None, what: str, default: str | None = None) -> list[Fraction]:
        """The numbers of ``text``, separated by spaces or commas."""
        text = text if text is not None else default
        if text is None:
            raise InputError(f"{self.where}: {what} is missing.", self.if_missing)
        if "${" in text or "$(" in text:
            raise InputError(
                f"{self.where}: {what} = {quoted(text)} is an expression of xacro.",
                "Expand the file first: xacro FILE -o FILE.urdf.",
            )
        with prefixed(f"{self.where}: {what} = {quoted(text)}"):
            return [self._parsed(word) for word in text.replace(",", " ").split()]

    def _parsed(self, text: str) -> Fraction:
        value = exact(text)
        _, _, decimals = text.lower().partition("e")[0].partition(".")
        exponent = int(text.lower().partition("e")[2] or 0)
        self.units.append((abs(value), Fraction(10) ** (exponent - len(decimals)), bool(decimals) or exponent < 0))
        return value

    def three(self, text: str | None, what: str, default: str | None = None) -> Vector:
        """Three numbers."""
        return vector(self.some(text, what, 3, default), what)

    def number(self, text: str | None, what: str, default: str | None = None) -> Fraction:
        """One number."""
        return self.some(text, what, 1, default)[0]

    def flag(self, text: str | None, what: str) -> bool:
        """A boolean of SDF or of an extension of URDF, false where it is missing."""
        value = (text or "").strip().lower() or "false"
        if value not in ("true", "1", "false", "0"):
            raise refusal(f"{self.where}: {what}", "true or false", quoted(value), "Give one of them.")
        return value in ("true", "1")

    def some(self, text: str | None, what: str, count: int, default: str | None = None) -> list[Fraction]:
        """``count`` numbers."""
        values = self.read(text, what, default)
        if len(values) != count:
            remedy = "Give one, with a decimal point." if count == 1 else f"Give {count}."
            raise InputError(
                f"{self.where}: {what} must be {plural(count, 'number')}; got {quoted(text or '')}.", remedy
            )
        return values

    def require_known(self, names: Iterable[str], element: Element, known: Sequence[str], what: str) -> None:
        """Raises InputError for a name that is not of the format, unless it is of another namespace."""
        for name in names:
            if name not in known and not name.startswith("{"):
                remedy = f"It has {', '.join(known)}." if known else "It has none."
                raise InputError(f"{self.where}: unknown {what} {name} of <{element.tag}>.", remedy)

    def require_parts(self, element: Element, known: Sequence[str]) -> None:
        """Raises InputError for an element within another that is not of the format, or that occurs twice."""
        self.require_known([child.tag for child in element], element, known, "element")
        self.require_once(element, *known)

    def require_once(self, element: Element, *tags: str) -> None:
        """Raises InputError for an element that occurs twice within another."""
        for tag in tags:
            if len(element.findall(tag)) > 1:
                raise InputError(f"{self.where}: <{element.tag}> has several <{tag}>.", "Leave one.")

    def attributes(self, element: Element | None, *known: str) -> Mapping[str, str]:
        """Attributes of an element, all of them ``known``; none without the element."""
        if element is None:
            return {}
        self.require_known(element.attrib, element, known, "attribute")
        return element.attrib

    def tensor(
        self, texts: Sequence[str | None], what: Sequence[str], products: str | None = None
    ) -> tuple[Six, Fraction]:
        """Six numbers, and the slack of their printed digits: an entry of ½ tr J − J collects four halves of a unit.

        Zeros at the end may have been left out, so that the finest decimal says the unit, but none that is far smaller
        than the largest beside one that is not; and the largest has no more digits than another, or six (%g of C).  At
        most a part of the largest.
        products: what the format takes for a product of inertia that is not there.
        """
        self.units = []
        a, b, c, d, e, f = (
            self.some(text, name, 1, None if index < 3 else products)[0]
            for index, (text, name) in enumerate(zip(texts, what, strict=True))
        )
        largest = max(map(abs, (a, b, c)))
        decimals = [(size, unit) for size, unit, is_decimal in self.units if is_decimal]
        units = [unit for size, unit in decimals if not size or size >= _COMPARABLE * largest]
        unit = min(units or [unit for _, unit in decimals], default=Fraction(0))
        if largest:
            digits = max(len(str(int(min(size / last, _MOST_DIGITS)))) for size, last, _ in self.units)
            exponent = math.floor(math.log10(largest.numerator) - math.log10(largest.denominator))
            unit = max(unit, Fraction(10) ** (exponent + 1 - max(digits, 6)))
        return (a, b, c, d, e, f), min(2 * unit, _MOST_SLACK * largest)


def _rpy(numbers: _Numbers, text: str | None, degrees: bool = False) -> Tensor:
    """Roll, pitch and yaw about fixed axes: R = R_z(yaw) R_y(pitch) R_x(roll)."""
    unit = "deg" if degrees else ""
    roll, pitch, yaw = (f"{angle}{unit}" for angle in numbers.three(text, "rpy", "0 0 0"))
    return Attitude.euler("ZYX", yaw, pitch, roll).rational_rows(2 * _BITS)


def _in_axes(axes: Tensor, six: Six) -> Six:
    """The tensor in the axes of the link, v_link = axes v; rounded where the rotation is."""
    turned = six_of(multiplied(axes, multiplied(rows(six), transposed(axes))))
    if all(value.denominator < 1 << _BITS for row in axes for value in row):
        return turned
    return six_of(rows([round_to(value, _BITS) for value in turned]))


Pose = tuple[Tensor, Vector]
"""Rotation and place of a frame in another."""


def _within(outer: Pose, inner: Pose) -> Pose:
    """A pose in the frame of the outer one, in the frame around that."""
    x, y, z = (a + b for a, b in zip(outer[1], rotated(outer[0], inner[1]), strict=True))
    return multiplied(outer[0], inner[0]), (x, y, z)


def _urdf(name: str, link: Element, inertial: Element, around: _Around) -> BodyInFile:
    numbers = _Numbers(f"link {name}")
    numbers.attributes(inertial)
    numbers.require_once(link, "inertial")
    numbers.require_parts(inertial, ("origin", "mass", "inertia"))
    tensor = numbers.attributes(inertial.find("inertia"), *_SIX_URDF)
    six, slack = numbers.tensor([tensor.get(key) for key in _SIX_URDF], _SIX_URDF)
    value = numbers.number(numbers.attributes(inertial.find("mass"), "value").get("value"), "mass")
    axes, centre = _origin(numbers, inertial)
    shape = _shape_of(_shapes(numbers, link, partial(_origin, numbers)), centre)
    of_gazebo = [child for child, outer in around.items() if outer.tag == "gazebo" and outer.get("reference") == name]
    switches = [child for child in of_gazebo if child.tag in ("gravity", "turnGravityOff")]
    falls = all(numbers.flag(child.text, child.tag) == (child.tag == "gravity") for child in switches)
    six, note = _in_axes(axes, six), _attached([*around], name)
    return BodyInFile(name, value, centre, six, slack, *shape, gravity=EARTH if falls else _ZERO, note=note)


def _attached(elements: Sequence[Element], name: str) -> str:
    """The note on links of URDF with a mass that fixed joints attach to one, directly or one after the other."""
    links = {
        link.get("name", "")
        for link in elements
        if link.tag == "link" and any(_has_mass(mass.get("value", "")) for mass in link.iterfind("inertial/mass"))
    }
    joints = [
        [*joint.iterfind("parent"), *joint.iterfind("child")] for joint in elements if joint.get("type") == "fixed"
    ]
    pairs = [[end.get("link") for end in ends] for ends in joints if len(ends) == 2]
    held: list[str | None] = [name]
    for parent in held:
        held += {child for above, child in pairs if above == parent} - {*held}
    return _not_included(len(links & {*held[1:]}))


def _has_mass(text: str) -> bool:
    """Whether a number has a digit other than 0."""
    return bool(re.search("[1-9]", text.lower().partition("e")[0]))


def _not_included(count: int) -> str:
    return f"Attached without a joint that moves, and not included: {plural(count, 'body', 'bodies')}." if count else ""


def _origin(numbers: _Numbers, element: Element) -> Pose:
    """Rotation and place of an element of a URDF."""
    pose = numbers.attributes(element.find("origin"), "xyz", "rpy", "quat_xyzw")
    centre, quaternion = numbers.three(pose.get("xyz"), "origin xyz", "0 0 0"), pose.get("quat_xyzw")
    if quaternion is None:
        return _rpy(numbers, pose.get("rpy")), centre
    if "rpy" in pose:
        raise InputError(f"{numbers.where}: origin has both rpy and quat_xyzw.", "Give one of them.")
    x, y, z, w = numbers.some(quaternion, "quat_xyzw", 4)
    return _turn(w, x, y, z), centre


Shape = tuple[Tensor, Vector, Vector]
"""Axes and centre of a shape, and its principal moments for unit mass."""


def _shape_of(shapes: Sequence[Shape], centre: Vector) -> tuple[Tensor | None, Tensor | None]:
    """The tensor about its centre of one shape, and its axes; nothing of several or of one elsewhere."""
    if len(set(shapes)) != 1:
        return None, None
    axes, middle, moments = shapes[0]
    if sum((a - b) ** 2 for a, b in zip(middle, centre, strict=True)) > sum(moments) / 100:
        return None, None
    return rows(_in_axes(axes, (*moments, *_ZERO))), axes


_SIZES = {"box": 3, "cylinder": 2, "sphere": 1}
"""Shapes of uniform mass, and how many numbers the edges, radius and length, or radius are."""


def _uniform(kind: str, sizes: Sequence[Fraction]) -> Vector:
    """Principal moments of a shape of unit mass."""
    first, *others = (size * size for size in sizes)
    if kind == "sphere":
        return (2 * first / 5,) * 3
    if kind == "box":
        return (others[0] + others[1]) / 12, (first + others[1]) / 12, (first + others[0]) / 12
    return (3 * first + others[0]) / 12, (3 * first + others[0]) / 12, first / 2


def _shapes(numbers: _Numbers, link: Element, pose: Callable[[Element], Pose]) -> list[Shape]:
    """Its collision shapes, or where there are none its visual ones; [] where a mesh is among them.

    Dimensions are attributes or elements.
    """
    shapes: list[Shape] = []
    for shape in link.findall("collision") or link.findall("visual"):
        solid = next((part for part in shape.iterfind("geometry/*") if part.tag in _SIZES), None)
        if solid is None:
            return []
        size, *lengths = ((solid.get(key, solid.findtext(key)), key) for key in ("size", "radius", "length"))
        lengths = lengths[: _SIZES[solid.tag]]
        sizes = numbers.three(*size) if solid.tag == "box" else [numbers.number(*length) for length in lengths]
        shapes.append((*pose(shape), _uniform(solid.tag, sizes)))
    return shapes


_SDF_INERTIAL = ("mass", "pose", "inertia", "density", "auto_inertia_params")


def _sdf(name: str, link: Element, inertial: Element, around: _Around) -> BodyInFile:
    numbers = _Numbers(f"link {name}", "Give it in the file, also where 1 is meant, the default of SDF.")
    pose, tensor = inertial.find("pose"), inertial.find("inertia")
    if inertial.find("fluid_added_mass") is not None:
        raise InputError(f"{numbers.where}: fluid_added_mass is not supported.", "Leave it out.")
    numbers.require_once(link, "inertial", "gravity")
    numbers.require_parts(inertial, _SDF_INERTIAL)
    if numbers.flag(numbers.attributes(inertial, "auto").get("auto"), "auto"):
        raise InputError(
            f"{numbers.where}: inertial auto is true: Gazebo computes mass and tensor from the shapes.",
            "Write the numbers out: gz sdf --print FILE --expand-auto-inertials > FILE.sdf.",
        )
    if pose is not None and (frame := pose.get("relative_to") or pose.get("frame")):
        raise InputError(f"{numbers.where}: an inertial has relative_to {quoted(frame)}.", "Give its pose in the link.")
    axes, centre = _pose(numbers, pose)
    if tensor is not None:
        numbers.require_parts(tensor, _SIX_URDF)
    texts = [None if tensor is None else tensor.findtext(key) for key in _SIX_URDF]
    six, slack = numbers.tensor(texts, _SIX_URDF, products="0")
    mass, frames = numbers.number(inertial.findtext("mass"), "mass"), _SdfFrames(numbers, link, around)
    shape = _shape_of(_shapes(numbers, link, frames.in_link), centre)
    return BodyInFile(name, mass, centre, _in_axes(axes, six), slack, *shape, frames.ball(), frames.gravity())


@dataclass(frozen=True, slots=True)
class _SdfFrames:
    """Links, joints and frames of the model of a link of SDF, by their names."""

    numbers: _Numbers
    link: Element
    around: _Around

    def named(self, name: str) -> Element:
        """The frame of this name."""
        model = self.around[self.link]
        frames = [frame for frame in model if frame.tag in ("link", "joint", "frame") and frame.get("name") == name]
        if not frames and name != "__model__":
            raise InputError(f"{self.numbers.where}: its model has no frame {quoted(name)}.", "Use one model.")
        return frames[0] if frames else model

    def in_model(self, element: Element, passed: tuple[Element, ...] = ()) -> Pose:
        """The pose of a frame, or of a shape of the link, in the axes of the model."""
        if element is self.around[self.link]:
            return _IDENTITY, _ZERO
        if element in passed:
            raise InputError(
                f"{self.numbers.where}: its frames are defined in a circle.",
                "Define each relative to the model or to an earlier frame.",
            )
        pose, name = element.find("pose"), _base(element)
        if pose is not None:
            name = pose.get("relative_to") or pose.get("frame") or name
        outer = self.named(name) if name else self.around[element]
        return _within(self.in_model(outer, (*passed, element)), _pose(self.numbers, pose))

    def in_link(self, element: Element) -> Pose:
        """The pose of a frame or shape in the axes of the link."""
        turn, (x, y, z) = self.in_model(self.link)
        back = transposed(turn)
        return _within((back, rotated(back, (-x, -y, -z))), self.in_model(element))

    def ball(self) -> Vector | None:
        """The place of the ball joint whose child is the link, or a frame attached to it; None without one."""
        places, model = [], self.around[self.link]
        for joint in [frame for frame in self.around if (frame.tag, frame.get("type")) == ("joint", "ball")]:
            child = _base(joint)
            if child.endswith(f"::{self.link.get('name')}"):
                raise InputError(
                    f"{self.numbers.where}: its ball joint belongs to another model.",
                    "Define the joint in the model of its link.",
                )
            if self.around[joint] is model and "::" not in child and self.held(child) is self.link:
                places.append(self.in_link(joint)[1])
        if len(places) > 1:
            raise InputError(f"{self.numbers.where}: it has {len(places)} ball joints.", "Leave one.")
        return places[0] if places else None

    def held(self, name: str) -> Element:
        """The link that a frame is attached to, or the model."""
        element = self.named(name)
        for _ in self.around[self.link]:
            if element.tag in ("frame", "joint"):
                element = self.named(_base(element) or "__model__")
        return element

    def gravity(self) -> Vector:
        """The gravity of the world around the link, zero where the link is exempt."""
        if not self.numbers.flag(self.link.findtext("gravity") or "true", "gravity"):
            return _ZERO
        world = self.link
        while world.tag != "world":
            if world not in self.around:
                return EARTH
            world = self.around[world]
        self.numbers.require_once(world, "gravity")
        text = world.findtext("gravity", world.findtext("physics/gravity"))  # there up to SDF 1.4
        return self.numbers.three(text, "gravity", "0 0 -9.8")


def _base(element: Element) -> str:
    """Name of the frame to which a joint or a frame of SDF is attached."""
    return (element.findtext("child") or element.get("attached_to") or "").strip()


def _pose(numbers: _Numbers, pose: Element | None) -> Pose:
    """Rotation and place of a pose x y z roll pitch yaw, or with a quaternion x y z w."""
    if pose is None:
        return _IDENTITY, _ZERO
    form = numbers.attributes(pose, "rotation_format", "degrees", "relative_to", "frame")
    kind, degrees = form.get("rotation_format", "euler_rpy"), numbers.flag(form.get("degrees"), "degrees")
    count = {"euler_rpy": 6, "quat_xyzw": 7}.get(kind)
    values = numbers.read(pose.text, "pose", "0 0 0 0 0 0")
    if len(values) != count or (degrees and count == 7):
        raise InputError(
            f"{numbers.where}: pose has {plural(len(values), 'number')}, as {quoted(kind)}"
            f"{' in degrees' if degrees else ''}.",
            "Give x y z roll pitch yaw as euler_rpy, or x y z and a quaternion x y z w as quat_xyzw, without degrees.",
        )
    position = (values[0], values[1], values[2])
    if count == 7:
        x, y, z, w = values[3:]
        return _turn(w, x, y, z), position
    return _rpy(numbers, " ".join(map(str, values[3:])), degrees), position


def _mjcf(path: Path, root: Element) -> Iterator[Link]:
    """Bodies with an inertial element, read exactly; those that MuJoCo computes or includes, read by MuJoCo."""
    settings = {key: value for compiler in root.iter("compiler") for key, value in compiler.attrib.items()}
    for key, value in [*settings.items(), *(pair for flag in root.iter("flag") for pair in flag.items())]:
        if value not in (words := _WORDS.get(key, (value,))):
            raise refusal(key, " or ".join(words), quoted(value), "Correct the file.")
    if not re.fullmatch("[xyzXYZ]{3}", sequence := settings.get("eulerseq", "xyz")):
        raise refusal("eulerseq", "three of the letters x y z X Y Z", quoted(sequence), "Correct the file.")
    if settings.get("coordinate", "local") != "local":
        raise InputError(f"{path} uses global coordinates.", "Load and save it in MuJoCo 2.3.3: they become local.")
    fused = any(settings.get(key, "auto") not in ("auto", "false") for key in ("inertiafromgeom", "fusestatic"))
    if fused or exact(settings.get("settotalmass", "-1")) > 0 or root.find(".//include") is not None:
        yield from _included(path, set())
        return
    frames = _MjcfFrames(root, _around(root), settings, _gravity(root))
    for index, body in enumerate(root.iter("body")):
        name, parts = body.get("name") or f"body{index + 1}", [*_parts(body)]
        tags = [child.tag for child, _ in parts]
        if "inertial" in tags:
            yield name, partial(_mjcf_body, name, body, parts, frames)
        elif "geom" in tags:
            yield name, partial(by_mujoco, path, name, index)
    if root.find(".//attach") is not None:
        yield from _included(path, {body.get("name") for body in root.iter("body")})


_WORDS = {
    "angle": ("degree", "radian"),
    "balanceinertia": ("true", "false"),
    "gravity": ("enable", "disable"),
}
"""Values of settings and flags that are read."""


def _gravity(root: Element) -> Vector:
    """The gravity of an MJCF file, zero where a flag disables it."""
    off = any(flag.get("gravity") == "disable" for flag in root.iterfind("option/flag"))
    texts = [option.get("gravity") for option in root.findall("option[@gravity]")]
    return _ZERO if off else _Numbers("option").three([None, *texts][-1], "gravity", "0 0 -9.81")


_Parts = Sequence[tuple["Element", Sequence["Element"]]]


def _parts(element: Element, frames: tuple[Element, ...] = ()) -> Iterator[tuple[Element, tuple[Element, ...]]]:
    """The elements of a body of MJCF, each with the frames around it in the body, the outermost first."""
    for child in element:
        yield child, frames
        if child.tag == "frame":
            yield from _parts(child, (*frames, child))


def _mjcf_body(name: str, body: Element, parts: _Parts, frames: _MjcfFrames) -> BodyInFile:
    numbers = _Numbers(f"body {name}")
    (inertial, around), *repeated = (pair for pair in parts if pair[0].tag == "inertial")
    if repeated:
        raise InputError(f"{numbers.where}: {len(repeated) + 1} inertials were given.", "Leave one.")
    numbers.attributes(inertial, "pos", "mass", "diaginertia", "fullinertia", *_ORIENTATIONS)
    numbers.three(inertial.get("pos"), "pos")
    six, slack = numbers.tensor(_mjcf_six(numbers, inertial), ("M11", "M22", "M33", "M12", "M13", "M23"))
    least_mass, least = (numbers.number(frames.settings.get(key), key, "0") for key in ("boundmass", "boundinertia"))
    mass = max(numbers.number(inertial.get("mass"), "mass"), least_mass)
    if least and inertia_slips.has_second_moments(rows(six), slack):
        spare = inertia_slips.minus(rows(six), rows((least, least, least, *_ZERO)))
        if any(six[3:]) and not inertia_slips.is_positive(spare):
            raise InputError(f"{numbers.where}: boundinertia raises a principal moment.", "Give diaginertia and quat.")
        if not any(six[3:]):
            six = (max(six[0], least), max(six[1], least), max(six[2], least), *_ZERO)
    no_body = inertia_slips.is_positive(rows(six)) and not inertia_slips.has_second_moments(rows(six))
    if no_body and frames.settings.get("balanceinertia") == "true":  # as MuJoCo does
        mean = (six[0] + six[1] + six[2]) / 3
        six = (mean, mean, mean, *_ZERO)
    axes, centre = frames.pose(numbers, inertial, around)
    balls = [pair for pair in parts if frames.attributes(pair[0]).get("type") == "ball"]
    if any(numbers.number(frames.attributes(ball).get("armature"), "armature", "0") for ball, _ in balls):
        raise InputError(f"{numbers.where}: the armature of its ball joint moves with no rigid body.", "Set it to 0.")
    joint = frames.pose(numbers, *balls[0])[1] if balls else None
    shape = _shape_of(frames.shapes(numbers, parts), centre)
    x, y, z = ((1 - numbers.number(body.get("gravcomp"), "gravcomp", "0")) * value for value in frames.gravity)
    note = _not_included(_welded(parts, frames))
    return BodyInFile(name, mass, centre, _in_axes(axes, six), slack, *shape, joint, (x, y, z), note=note)


def _welded(parts: _Parts, frames: _MjcfFrames) -> int:
    """The number of bodies with a mass within a body of MJCF, and within these, that have no joint."""
    count = 0
    for own in ([part for part, _ in _parts(child)] for child, _ in parts if child.tag == "body"):
        if not {part.tag for part in own} & {"joint", "freejoint"}:
            masses = [frames.attributes(part) for part in own if part.tag in ("inertial", "geom")]
            count += any(_has_mass(values.get("mass", values.get("density", "1"))) for values in masses)
            count += _welded([(part, ()) for part in own], frames)
    return count


def _compiled(path: Path) -> Any:
    """The model that MuJoCo makes of a file; raises InputError without it, and for what it refuses."""
    try:
        import mujoco
    except ImportError:
        raise InputError(
            "MuJoCo computes mass and tensor of these bodies, from their geoms or out of other files.",
            "Install it with: pip install 'heavytop[engines]'; or write them out: mujoco.mj_saveLastXML(FILE, model), "
            "without inertiafromgeom, settotalmass and fusestatic.",
        ) from None
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise InputError(f"MuJoCo refuses {path}: {' '.join(str(error).split())}.", "Correct the file.") from None


def by_mujoco(path: Path, name: str, index: int) -> BodyInFile:
    """The body of that name or index, as MuJoCo computes it in double."""
    model = _compiled(path)
    names = [model.body(i).name for i in range(model.nbody)]
    return _of_model(model, name, names.index(name) if name in names else index + 1)


def _of_model(model: Any, name: str, body: int) -> BodyInFile:
    import mujoco

    values = _of_doubles(model.body_inertia[body])
    six = _in_axes(_turn(*map(float, model.body_iquat[body])), (*values, *_ZERO))
    balls = [j for j in range(model.njnt) if model.jnt_bodyid[j] == body and model.jnt_type[j] == 1]
    joint = _of_doubles(model.jnt_pos[balls[0]]) if balls else None
    weight = 0 if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY else 1 - model.body_gravcomp[body]
    (mass,), centre = _of_doubles([model.body_mass[body]]), _of_doubles(model.body_ipos[body])
    gravity = _of_doubles(weight * model.opt.gravity)
    return BodyInFile(name, mass, centre, six, _FROM_DOUBLE * max(values), None, None, joint, gravity)


def _of_doubles(values: Iterable[Any]) -> Any:
    """The shortest decimals of doubles."""
    return tuple(Fraction(repr(float(value))) for value in values)


def _included(path: Path, known: set[str | None]) -> Iterator[Link]:
    """Bodies that a file includes from others."""
    model = _compiled(path)
    for index in range(1, model.nbody):
        name = model.body(index).name or f"body{index}"
        if name not in known and model.body_mass[index] > 0:
            yield name, partial(_of_model, model, name, index)


def _mjcf_six(numbers: _Numbers, inertial: Element) -> Sequence[str | None]:
    """The six numbers of fullinertia, or the three of diaginertia with zeros."""
    full = inertial.get("fullinertia")
    if full is not None and "diaginertia" in inertial.attrib:
        raise InputError(f"{numbers.where}: fullinertia and diaginertia were given.", "Give one of them.")
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
"""Attributes of MJCF for the orientation of a frame, and their counts of numbers."""


@dataclass(frozen=True, slots=True)
class _MjcfFrames:
    """Elements of an MJCF file and those around them, settings of its compiler, and its gravity."""

    root: Element
    around: _Around
    settings: Mapping[str, str]
    gravity: Vector

    def attributes(self, element: Element) -> dict[str, str]:
        """Attributes of an element and of its class, or the nearest childclass around it, and of the outer classes."""
        name, outer, values = element.get("class"), element, dict(element.attrib)
        while name is None and outer in self.around:
            outer = self.around[outer]
            name = outer.get("childclass")
        classes = [default for default in self.root.iter("default") if name and default.get("class") == name]
        while classes and classes[-1].tag == "default":
            classes.append(self.around[classes[-1]])
        for default in (*classes, *reversed(self.root.findall("default"))):
            template = default.find(element.tag) if default.tag == "default" else None
            values = values if template is None else {**template.attrib, **values}
        return values

    def pose(self, numbers: _Numbers, element: Element, around: Sequence[Element]) -> Pose:
        """Rotation and place of an element of a body, within the frames around it."""
        pose = _IDENTITY, _ZERO
        for frame in (*around, element):
            values = self.attributes(frame)
            pose = _within(pose, (self.rotation(numbers, values), numbers.three(values.get("pos"), "pos", "0 0 0")))
        return pose

    def rotation(self, numbers: _Numbers, frame: Mapping[str, str]) -> Tensor:
        """Rotation of a frame: a quaternion, axisangle, two axes, the third axis, or euler angles.

        Of the sequence of euler angles small letters turn with the frame.
        """
        keys = [key for key in _ORIENTATIONS if key in frame]
        if len(keys) > 1:
            raise InputError(f"{numbers.where}: {' and '.join(keys)} were given.", "Give one orientation.")
        key = keys[0] if keys else "euler"
        values = numbers.some(frame.get(key), key, _ORIENTATIONS[key], "0 0 0")
        unit = "" if self.settings.get("angle") == "radian" else "deg"
        if key == "quat":
            return _turn(*values)
        if key == "axisangle":
            return Attitude.axis_angle(values[:3], f"{values[3]}{unit}").rational_rows(2 * _BITS)
        if key == "xyaxes":
            return _of_axes(values[:3], values[3:])
        if key == "zaxis":  # the least rotation of e_z to it
            x, y, z = _unit(values)
            return _turn(*((1 + z, -y, x, 0) if z > -1 else (0, 1, 0, 0)))
        turns = _IDENTITY
        for letter, angle in zip(self.settings.get("eulerseq", "xyz"), values, strict=True):
            around = [int(letter.lower() == name) for name in "xyz"]
            turn = Attitude.axis_angle(around, f"{angle}{unit}").rational_rows(2 * _BITS)
            turns = multiplied(turns, turn) if letter.islower() else multiplied(turn, turns)
        return turns

    def shapes(self, numbers: _Numbers, parts: _Parts) -> list[Shape]:
        """The geoms of a body; [] where a mesh, or another shape without moments here, is among them."""
        shapes: list[Shape] = []
        for geom, around in parts:
            if geom.tag != "geom":
                continue
            values = self.attributes(geom)
            size, kind = numbers.read(values.get("size"), "size", ""), values.get("type", "sphere")
            if len(size) != _SIZES.get(kind):
                return []
            first, *others = size  # half the edges of a box, and half the length of a cylinder
            sizes = [2 * first if kind == "box" else first, *(2 * value for value in others)]
            shapes.append((*self.pose(numbers, geom, around), _uniform(kind, sizes)))
        return shapes


def _turn(*quaternion: Any) -> Tensor:
    return Attitude.quaternion(*quaternion, normalize=True).rational_rows(2 * _BITS)


def _unit(values: Sequence[Fraction]) -> Vector:
    """The unit vector along a vector, to 2^-128; raises InputError for 0."""
    x, y, z = values
    square = x * x + y * y + z * z
    if not square:
        raise InputError("An axis must not be zero.", "Give the axis of the frame.")
    length = square_root(square, 2 * _BITS)
    return x / length, y / length, z / length


def _of_axes(x: Sequence[Fraction], y: Sequence[Fraction]) -> Tensor:
    """The frame of an axis x and of one that with it spans the plane of x and y."""
    first = _unit(x)
    third = _unit(cross(first, vector(y, "xyaxes")))
    columns = (first, cross(third, first), third)
    return Attitude.matrix(transposed(columns), normalize=True).rational_rows(2 * _BITS)


_PHYSICS = ("mass", "centerOfMass", "diagonalInertia", "principalAxes", "gravityMagnitude", "gravityDirection")
_USD_NAMES = (*_PHYSICS, "disableGravity")
_STAGE = {"metersPerUnit": "0.01", "kilogramsPerUnit": "1", "upAxis": "Z"}
_TOKEN = re.compile(
    r'(?:(def|over|class)\s+(?:\w+\s+)?"([^"]*)")'
    rf"|(?:physics|physxRigidBody):({'|'.join(_USD_NAMES)})\s*=\s*(\([^)]*\)|[^\s]+)"
    r'|"[^"\n]*"|([(){}])'
)
"""A prim of USD, an attribute that is read, text, and a bracket."""


def _usd(text: str) -> Iterator[Link]:
    """Prims of USD as text that have a mass and a diagonal inertia; by their names."""
    text = re.sub(r'(?s)""".*?"""|("[^"\n]*")|#[^\n]*|/\*.*?\*/', r"\1", text)
    named = re.findall(r"(?m)(?:^\s*|\bphysics:|\bphysxRigidBody:)(\w+)\s*=", text)
    _require_spelt("USD", named, (*_USD_NAMES, *_STAGE))
    units = dict(re.findall(rf"\b({'|'.join(_STAGE)})\s*=\s*\"?([-+.\w]+)", text))
    prims: list[tuple[str, dict[str, str]]] = []
    around: list[dict[str, str]] = [{}]
    new: dict[str, str] | None = None
    parentheses = 0
    for kind, name, key, value, bracket in _TOKEN.findall(text):
        if kind:
            new = {}
            prims += [] if kind == "class" else [(name, new)]
        elif key:
            around[-1][key] = value.strip("()")
        elif bracket == "{":
            around.append(around[-1] if new is None or parentheses else new)
            new = new if parentheses else None
        elif bracket == "}":
            around = around[:-1] or [{}]
        else:
            parentheses += {"(": 1, ")": -1}.get(bracket, 0)
    yield from _of_prims(prims, units)


def _of_prims(prims: Sequence[tuple[str, Mapping[str, str]]], units: Mapping[str, str]) -> Iterator[Link]:
    """The bodies among prims, with the gravity of the scene."""
    scene = {key: value for _, values in prims for key, value in values.items() if key.startswith("gravity")}
    for name, values in prims:
        if {"mass", "diagonalInertia"} <= values.keys():
            yield name, partial(_prim, name, {**values, **scene}, {**_STAGE, **units})


def _prim(name: str, values: Mapping[str, str], units: Mapping[str, str]) -> BodyInFile:
    numbers = _Numbers(f"prim {name}")
    length, kilogram = (numbers.number(units[key], key) for key in ("metersPerUnit", "kilogramsPerUnit"))
    parts = [*values["diagonalInertia"].replace(",", " ").split(), "0", "0", "0"]
    diagonal = numbers.some(values["diagonalInertia"], "diagonalInertia", 3)
    if "inf" in values.get("centerOfMass", "") or not any(diagonal):
        raise InputError(
            f"{numbers.where}: an infinite centre of mass or a tensor of zeros has USD compute it from the shapes.",
            "Give physics:centerOfMass and physics:diagonalInertia in numbers.",
        )
    six, slack = numbers.tensor(parts, ("I1", "I2", "I3", "I12", "I13", "I23"))
    axes = numbers.some(values.get("principalAxes"), "principalAxes", 4, "1 0 0 0")
    # a quaternion of zeros says that USD computes the axes
    turn = _turn(*(axes if any(axes) else [1, 0, 0, 0]))
    scale = kilogram * length**2
    a, b, c, d, e, f = (value * scale for value in _in_axes(turn, six))
    x, y, z = (value * length for value in numbers.three(values.get("centerOfMass"), "centerOfMass", "0 0 0"))
    mass = numbers.number(values["mass"], "mass") * kilogram
    free = values.get("disableGravity", "0").lower() in ("1", "1.0", "true")
    magnitude = values.get("gravityMagnitude", "-inf")  # as on Earth
    size = -EARTH[2] if magnitude.startswith("-") else numbers.number(magnitude, "gravityMagnitude") * length
    down = numbers.three(values.get("gravityDirection"), "gravityDirection", "0 0 0")
    if not any(down):
        if units["upAxis"] not in ("X", "Y", "Z"):
            raise refusal("upAxis", "X, Y or Z", quoted(units["upAxis"]), "Give the axis that points up.")
        down = vector([-int(axis == units["upAxis"]) for axis in "XYZ"], "upAxis")
    gx, gy, gz = ((0 if free else size) * component for component in _unit(down))
    return BodyInFile(name, mass, (x, y, z), (a, b, c, d, e, f), slack * scale, gravity=(gx, gy, gz))


_BINARY_USD = (b"PXR-USDC", b"PK\x03\x04")
_COMPOSED = re.compile(rb"\b(references|payload|subLayers|inherits|variantSet|physics:\w+\.timeSamples)\b")
"""Composition of a prim of USD from several layers."""


def composed_usd(path: Path) -> Iterator[Link]:
    """Prims of binary USD, or of several layers, by the package usd-core; their numbers as it prints them."""
    try:
        from pxr import Tf, Usd, UsdGeom, UsdPhysics
    except ImportError:
        raise InputError(
            f"{path} is binary USD, has time samples, or refers to other layers.",
            "Install usd-core: pip install 'heavytop[engines]'; or flatten it: usdcat --flatten FILE -o FILE.usda.",
        ) from None
    try:
        stage = Usd.Stage.Open(str(path))
        faults = [str(fault).rstrip(".") for fault in stage.GetCompositionErrors()]
    except Tf.ErrorException as error:
        faults = [fault.commentary for fault in error.args]
    if faults:
        raise InputError(f"USD refuses {path}: {'; '.join(faults)[:200]}.", "Correct the file or its layers.")
    units = {
        "metersPerUnit": repr(UsdGeom.GetStageMetersPerUnit(stage)),
        "kilogramsPerUnit": repr(UsdPhysics.GetStageKilogramsPerUnit(stage)),
    }
    if stage.HasAuthoredMetadata("upAxis"):
        units["upAxis"] = UsdGeom.GetStageUpAxis(stage)
    prims = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        attributes = {name: prim.GetAttribute(f"physics:{name}") for name in _PHYSICS}
        attributes["disableGravity"] = prim.GetAttribute("physxRigidBody:disableGravity")
        first = {name: attribute.Get(Usd.TimeCode.EarliestTime()) for name, attribute in attributes.items()}
        values = {name: _printed(value) for name, value in first.items() if attributes[name].HasAuthoredValue()}
        prims.append((prim.GetName(), values))
    return _of_prims(prims, units)


def _printed(value: Any) -> str:
    """The shortest decimals of numbers in single precision."""
    import numpy

    parts = [value.real, *value.imaginary] if hasattr(value, "imaginary") else numpy.ravel(value)
    return ", ".join(str(numpy.float32(number)) for number in parts)


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


_KEYS = ("name", "mass", "gravity", "centre", "inertia", "about")
_OF_PLANS = ("rotor", "system", "omega", "omega_space", "gamma", "quaternion", "euler", "matrix", "axis_angle")
"""Further keys of a [[top]], which are of the motion."""


def _toml_table(name: str, table: Mapping[str, Any]) -> BodyInFile:
    numbers = _Numbers(f"top {name}")
    if unknown := sorted(table.keys() - {*_KEYS, *_OF_PLANS}):
        raise InputError(f"{numbers.where}: unknown key {quoted(unknown[0])}.", f"It has {', '.join(_KEYS)}.")
    texts = _texts(table["inertia"])
    if len(texts) == 9:
        with prefixed(numbers.where):
            inertia_slips.six_of_nine([exact(entry) for entry in texts])
        texts = [texts[i] for i in (0, 4, 8, 1, 2, 5)]
    if len(texts) == 3:
        texts += ["0"] * 3
    if len(texts) != 6:
        raise InputError(f"{numbers.where}: inertia must have 3, 6 or 9 numbers; got {len(texts)}.", "Give 3, 6 or 9.")
    six, slack = numbers.tensor(texts, ("I11", "I22", "I33", "I12", "I13", "I23"))
    centre = numbers.three(" ".join(_texts(table.get("centre", ["0", "0", "0"]))), "centre")
    mass = numbers.number(str(table["mass"]), "mass")
    if (about := table.get("about")) not in ("pivot", "centre of mass") and (any(centre) or "about" in table):
        what, got = "about, the reference point of the inertia tensor,", "nothing" if about is None else quoted(about)
        raise refusal(f"{numbers.where}: {what}", '"pivot" or "centre of mass"', got, "Give one of these.")
    if table.get("rotor"):
        raise InputError(f"{numbers.where}: a rotor in a file is not supported.", "Describe the whole body.")
    if (size := numbers.number(str(table.get("gravity", "9.81")), "gravity")) < 0:
        raise refusal(f"{numbers.where}: gravity", "0 or positive", six_digits(size), "Give its size, such as 9.81.")
    gravity = (Fraction(0), Fraction(0), -size)
    note = "" if "centre" in table else "The file has no centre: the centre of mass is taken to be the pivot."
    at_pivot = about == "pivot"
    return BodyInFile(name, mass, centre, six, slack, gravity=gravity, at_pivot=at_pivot, si=False, note=note)


def _texts(values: Any) -> list[str]:
    parts: list[str] = []
    for value in values if isinstance(values, list) else str(values).split(","):
        parts += _texts(value) if isinstance(value, list) else [str(value).strip()]
    return parts
