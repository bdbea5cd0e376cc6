"""Body files of robots and logs of every kind, by own code: slips that must be named, right files that must be read.

``python validation/bodies_and_logs.py bodies [seed]`` writes 40 body files with one slip each and 40 right ones, of
random boxes, in URDF, MJCF, SDF, USD and TOML; it prints each slip that `heavytop body` does not name, and each right
file that it refuses or reads as another tensor.  ``python validation/bodies_and_logs.py logs [seed]`` writes 40 logs of
random motions, integrated here by Runge-Kutta in double: each must be read to ten digits, or be refused with the line
that would help.  ``packages`` compares 88 MJCF and USD files with what MuJoCo and usd-core read, where installed.
Exit code 1 where one is not.
"""

from __future__ import annotations

import random
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from heavytop.errors import InputError
from heavytop.features.body.document import assess
from heavytop.features.score.api import read_trajectory, scored
from heavytop.top import body_files
from heavytop.top.body_files import read_body

Array = np.ndarray
DIGITS = 9
"""Significant digits of a number in a body file."""


def rotation(draw: random.Random) -> tuple[Array, Array]:
    """A random rotation, and its quaternion w, x, y, z."""
    q = np.array([draw.gauss(0, 1) for _ in range(4)])
    q /= np.linalg.norm(q)
    w, x, y, z = q
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return turn, q


def rpy(turn: Array) -> Array:
    """Roll, pitch, yaw of R_z(yaw) R_y(pitch) R_x(roll)."""
    return np.array([np.arctan2(turn[2, 1], turn[2, 2]), np.arcsin(-turn[2, 0]), np.arctan2(turn[1, 0], turn[0, 0])])


def text(values: object) -> str:
    """Numbers in so many digits, separated by spaces."""
    return " ".join(f"{value:.{DIGITS}g}" for value in np.ravel(np.asarray(values)))


@dataclass(frozen=True)
class Box:
    """A uniform box in the axes of its link.  tensor: about the centre of mass; size: its edges along ``axes``."""

    mass: float
    size: Array
    centre: Array
    axes: Array
    quaternion: Array
    tensor: Array

    @property
    def six(self) -> Array:
        """I11, I22, I33, I12, I13, I23."""
        t = self.tensor
        return np.array([t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]])

    @property
    def moments(self) -> Array:
        """About the edges."""
        squares = self.size**2
        return self.mass * (squares.sum() - squares) / 12

    @property
    def steiner(self) -> Array:
        """What the tensor about the origin of the link has more."""
        c = self.centre
        return self.mass * (c @ c * np.eye(3) - np.outer(c, c))


def box(draw: random.Random) -> Box:
    """A random box of which the slips of the axes and of the signs change the tensor by a tenth."""
    while True:
        given = any_box(draw)
        others = (conjugated(given), given.six * [1, 1, 1, -1, -1, -1])
        if min(np.abs(other - given.six).max() for other in others) > 0.1 * np.abs(given.six).max():
            return given


def any_box(draw: random.Random) -> Box:
    """A random box of 1 cm to 2 m, of a density between wood and steel."""
    scale = 10 ** draw.uniform(-1.5, 0)
    size = scale * np.array([1.0, draw.uniform(1.5, 2.2), draw.uniform(2.5, 3.5)])
    axes, quaternion = rotation(draw)
    mass = draw.uniform(400, 8000) * float(size.prod())
    squares = size**2
    moments = mass * (squares.sum() - squares) / 12
    centre = scale * np.array([draw.uniform(0.5, 2) * draw.choice((-1, 1)) for _ in range(3)])
    return Box(mass, size, centre, axes, quaternion, axes @ np.diag(moments) @ axes.T)


KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
URDF_ORDER = (0, 3, 4, 1, 5, 2)
"""Places in I11 I22 I33 I12 I13 I23 of ixx ixy ixz iyy iyz izz."""


def urdf(given: Box, six: Array | None = None, geometry: bool = False, turned: bool = False) -> str:
    """``turned``: the tensor in the axes of the box, with their roll, pitch and yaw."""
    values = given.six if six is None else six
    angles = np.zeros(3)
    if turned:
        values, angles = np.array([*given.moments, 0, 0, 0]), rpy(given.axes)
    tensor = " ".join(f'{key}="{text(value)}"' for key, value in zip(KEYS, values, strict=True))
    shape = (
        f'<collision><origin xyz="{text(given.centre)}" rpy="{text(rpy(given.axes))}"/><geometry>'
        f'<box size="{text(given.size)}"/></geometry></collision>'
    )
    return (
        f'<?xml version="1.0"?><robot name="r"><link name="arm"><inertial><!-- kg, m -->'
        f'<origin xyz="{text(given.centre)}" rpy="{text(angles)}"/><mass value="{text(given.mass)}"/>'
        f"<inertia {tensor}/></inertial>{shape if geometry else ''}</link></robot>"
    )


def mjcf(given: Box, six: Array | None = None, geometry: bool = False, turned: bool = False) -> str:
    """``turned``: by diaginertia and quat."""
    values = given.six if six is None else six
    tensor = f'fullinertia="{text(values)}"'
    if turned:
        tensor = f'diaginertia="{text(given.moments)}" quat="{text(given.quaternion)}"'
    shape = (
        f'<geom type="box" size="{text(given.size / 2)}" pos="{text(given.centre)}" quat="{text(given.quaternion)}"/>'
    )
    return (
        '<mujoco><compiler angle="radian"/><worldbody><body name="arm"><joint type="ball"/>'
        f'<inertial pos="{text(given.centre)}" mass="{text(given.mass)}" {tensor}/>{shape if geometry else ""}'
        "</body></worldbody></mujoco>"
    )


def sdf(given: Box, six: Array | None = None, geometry: bool = False, turned: bool = False) -> str:
    """``turned``: by the pose of the inertial."""
    values, angles = (given.six if six is None else six), np.zeros(3)
    if turned:
        values, angles = np.array([*given.moments, 0, 0, 0]), rpy(given.axes)
    tensor = "".join(f"<{key}>{text(value)}</{key}>" for key, value in zip(KEYS, values, strict=True))
    pose = f"<pose>{text(given.centre)} {text(rpy(given.axes))}</pose>"
    shape = f'<collision name="c">{pose}<geometry><box><size>{text(given.size)}</size></box></geometry></collision>'
    return (
        f'<sdf version="1.9"><model name="m"><link name="arm"><inertial><pose>{text(given.centre)} {text(angles)}'
        f"</pose><mass>{text(given.mass)}</mass><inertia>{tensor}</inertia></inertial>{shape if geometry else ''}"
        "</link></model></sdf>"
    )


def usd(given: Box, six: Array | None = None, geometry: bool = False, turned: bool = True) -> str:
    """By principal moments and axes, the quaternion w first."""
    tuples = [", ".join(text(part) for part in values) for values in (given.centre, given.moments, given.quaternion)]
    return (
        "#usda 1.0\n(\n    metersPerUnit = 1\n)\n\n"
        'def Xform "arm" (\n    prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]\n)\n{\n'
        f"    point3f physics:centerOfMass = ({tuples[0]})\n    float3 physics:diagonalInertia = ({tuples[1]})\n"
        f"    float physics:mass = {text(given.mass)}\n    quatf physics:principalAxes = ({tuples[2]})\n}}\n"
    )


def toml(given: Box, six: Array | None = None, about: str = "centre of mass") -> str:
    """As a plan has it."""
    numbers = ", ".join(f'"{text(value)}"' for value in (given.six if six is None else six))
    centre = ", ".join(f'"{text(value)}"' for value in given.centre)
    return f'mass = "{text(given.mass)}"\ncentre = [{centre}]\ninertia = [{numbers}]\nabout = "{about}"\n'


RIGHT: tuple[tuple[str, Callable[[Box], str]], ...] = (
    ("urdf", urdf),
    ("urdf", lambda given: urdf(given, geometry=True)),
    ("urdf", lambda given: urdf(given, turned=True, geometry=True)),
    ("xml", mjcf),
    ("xml", lambda given: mjcf(given, turned=True)),
    ("xml", lambda given: mjcf(given, geometry=True)),
    ("sdf", sdf),
    ("sdf", lambda given: sdf(given, turned=True, geometry=True)),
    ("usda", usd),
    ("toml", toml),
)


def six(tensor: Array) -> Array:
    """I11, I22, I33, I12, I13, I23 of a matrix."""
    return np.array([tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]])


def conjugated(given: Box) -> Array:
    """Vᵀ D V for V D Vᵀ."""
    return six(given.axes.T @ np.diag(given.moments) @ given.axes)


def slipped() -> Iterator[tuple[str, str, Callable[[Box], str]]]:
    """The name of a slip, the suffix of its file, and what writes it."""
    inverse = np.argsort(URDF_ORDER)
    for suffix, write in (("urdf", urdf), ("xml", mjcf), ("sdf", sdf)):
        yield "order_urdf", suffix, lambda g, write=write: write(g, g.six[list(URDF_ORDER)], True)
        yield "conjugate_axes", suffix, lambda g, write=write: write(g, conjugated(g), True)
        yield "signs_of_products", suffix, lambda g, write=write: write(g, g.six * [1, 1, 1, -1, -1, -1], True)
        yield "about_pivot", suffix, lambda g, write=write: write(g, six(g.tensor + g.steiner), True)
        yield "millimetres", suffix, lambda g, write=write: write(g, g.six * 1e6, True)
        yield "negative_moment", suffix, lambda g, write=write: write(g, g.six * [1, -1, 1, 1, 1, 1])
        yield "rod", suffix, lambda g, write=write: write(rod(g))
        yield "row_major", suffix, lambda g, write=write: write(g, g.tensor.ravel()[:6])
        yield "grams", suffix, lambda g, write=write: write(replace(g, mass=g.mass * 1000), g.six * 1000)
        yield "order_urdf", suffix, lambda g, write=write: write(g, g.six[inverse], True)
    yield "about_centre", "toml", lambda g: toml(g, about="pivot")
    yield "order_urdf", "toml", lambda g: toml(g, g.six[list(URDF_ORDER)])
    yield "row_major", "toml", lambda g: toml(g, g.tensor.ravel()[:6])
    yield "negative_moment", "toml", lambda g: toml(g, g.six * [1, -1, 1, 1, 1, 1])
    yield "millimetres", "usda", lambda g: usd(replace(g, size=g.size * 1000))
    yield "grams", "usda", lambda g: usd(replace(g, mass=g.mass * 1000))
    yield "rod", "usda", lambda g: usd(rod(g))
    yield "rod", "toml", lambda g: toml(rod(g))
    yield "negative_moment", "xml", lambda g: mjcf(g, g.six * [-1, 1, 1, 1, 1, 1])
    yield "grams", "urdf", lambda g: urdf(replace(g, mass=g.mass * 1000), g.six * 1e9, True)


def rod(given: Box) -> Box:
    """A line along the first axis, without thickness."""
    size = np.array([given.size[2], 0.0, 0.0])
    moment = given.mass * size[0] ** 2 / 12
    return replace(given, size=size, axes=np.eye(3), quaternion=np.eye(4)[0], tensor=np.diag([0, moment, moment]))


def bodies(seed: int) -> int:
    """Prints what is not named or refused; returns how many."""
    draw, wrong = random.Random(seed), 0
    with tempfile.TemporaryDirectory() as folder:
        for index in range(40):
            given = box(draw)
            suffix, write = RIGHT[index % len(RIGHT)]
            path = Path(folder) / f"right{index}.{suffix}"
            path.write_text(write(given))
            found = read_body(path)
            judged = assess(found)
            error = max(abs(float(a) - b) for a, b in zip(found.six, given.six, strict=True)) / np.abs(given.six).max()
            if not judged.sound or error > 10 ** (2 - DIGITS):
                wrong += 1
                print(f"right, {suffix}: {[slip.name for slip in judged.slips]}, off by {error:.1e}")
        for index, (name, suffix, write) in enumerate(slipped()):
            path = Path(folder) / f"slip{index}.{suffix}"
            path.write_text(write(box(draw)))
            names = [slip.name for slip in assess(read_body(path)).slips]
            if name not in names:
                wrong += 1
                print(f"{name}, {suffix}: {names}")
    print(f"bodies: {wrong} of 80 missed")
    return wrong


def frames(given: Box) -> dict[str, str]:
    """The rotation of the axes of a box as each kind of frame of MJCF."""
    (x, y, z), q = given.axes.T, given.quaternion
    half = np.arctan2(np.linalg.norm(q[1:]), q[0])
    roll, pitch, yaw = np.degrees(rpy(given.axes))
    return {
        f'quat="{text(3 * q)}"': "xyz",
        f'axisangle="{text([*(5 * q[1:]), np.degrees(2 * half)])}"': "xyz",
        f'xyaxes="{text([*(2 * x), *(3 * y + x)])}"': "xyz",
        f'euler="{text([roll, pitch, yaw])}"': "XYZ",
        f'euler="{text([yaw, pitch, roll])}"': "zyx",
        f'zaxis="{text(z)}"': "xyz",
    }


def by_usd(path: Path, suffix: str) -> Path:
    """The file as usd-core writes it: as text, in binary, as a package."""
    from pxr import Usd, UsdUtils

    binary, package = path.with_name("binary.usdc"), path.with_name("package.usdz")
    Usd.Stage.Open(str(path)).Export(str(binary if suffix != "usda" else path.with_name("text.usda")))
    if suffix == "usdz":
        UsdUtils.CreateNewUsdzPackage(str(binary), str(package))
    return {"usda": path.with_name("text.usda"), "usdc": binary, "usdz": package}[suffix]


def packages(seed: int) -> int:
    """Prints each right MJCF and USD file, and each frame, that MuJoCo or usd-core reads as another tensor."""
    draw, wrong, count = random.Random(seed), 0, 0
    written: list[tuple[str, str]] = []
    for _ in range(8):
        given = box(draw)
        written += [("xml", mjcf(given)), ("xml", mjcf(given, geometry=True, turned=True))]
        written += [(suffix, usd(given)) for suffix in ("usda", "usdc", "usdz")]
        inertial = f'pos="{text(given.centre)}" mass="{text(given.mass)}" diaginertia="{text(given.moments)}"'
        written += [
            (
                "xml",
                f'<mujoco><compiler eulerseq="{sequence}"/><default><joint type="ball"/></default><worldbody>'
                f'<body name="arm"><joint pos="1 2 3"/><inertial {inertial} {frame}/></body></worldbody></mujoco>',
            )
            for frame, sequence in frames(given).items()
        ]
    with tempfile.TemporaryDirectory() as folder:
        for suffix, content in written:
            (path := Path(folder) / f"arm.{'xml' if suffix == 'xml' else 'usda'}").write_text(content)
            own = read_body(path)
            other = body_files.by_mujoco(path, "arm", 0) if suffix == "xml" else read_body(by_usd(path, suffix))
            count += 1
            pairs = zip((own.mass, *own.centre, *own.six), (other.mass, *other.centre, *other.six), strict=True)
            error = max(abs(float((a - b) / (abs(a) + max(own.six)))) for a, b in pairs)
            if error > (1e-12 if suffix == "xml" else 1e-5) or own.joint != other.joint:
                wrong += 1
                print(f"{error:.1e}, {own.joint}, {other.joint}: {content}")
    print(f"packages: {wrong} of {count} files read as another body")
    return wrong


# Logs.


SAMPLES = 21
"""At intervals of 0.1 s."""
BODY = "2", "9.81", (0.3, -0.2, 0.4), (1.2, 0.9, 0.6)
FREE = "2", "0", (0.0, 0.0, 0.0), (1.2, 0.9, 0.6)


@dataclass(frozen=True)
class Motion:
    """Samples of a motion.  omega: in body axes; turns: R, body to space; q: (w, x, y, z), continuous."""

    body: tuple[str, str, tuple[float, ...], tuple[float, ...]]
    times: Array
    omega: Array
    q: Array

    @property
    def turns(self) -> Array:
        """R of each sample."""
        w, x, y, z = self.q.T
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return np.moveaxis(np.array(rows), 2, 0)

    @property
    def head(self) -> str:
        """The body and the start of Ω, as comments; the attitude starts at the first row."""
        mass, gravity, centre, tensor = self.body
        lines = [f"mass: {mass}", f"gravity: {gravity}", f"centre: {csv(centre)}", f"inertia: {csv(tensor)}"]
        return "".join(f"# {line}\n" for line in [*lines, "about: centre of mass", f"omega: {csv(self.omega[0])}"])


def csv(values: object) -> str:
    """Numbers with all digits, separated by commas."""
    return ",".join(repr(float(value)) for value in np.ravel(np.asarray(values)))


def motion(draw: random.Random, body: tuple[str, str, tuple[float, ...], tuple[float, ...]] = BODY) -> Motion:
    """A random start, by Runge-Kutta of fourth order: an error of 1e-13 at 2 s."""
    mass, gravity = float(body[0]), float(body[1])
    c = np.array(body[2])
    tensor = np.diag(body[3]) + mass * (c @ c * np.eye(3) - np.outer(c, c))
    inverse = np.linalg.inv(tensor)

    def rate(state: Array) -> Array:
        w, q = state[:3], state[3:]
        gamma = np.array(
            [
                2 * (q[1] * q[3] - q[0] * q[2]),
                2 * (q[2] * q[3] + q[0] * q[1]),
                q[0] ** 2 - q[1] ** 2 - q[2] ** 2 + q[3] ** 2,
            ]
        )
        turning = np.cross(tensor @ w, w) + mass * gravity * np.cross(gamma, c)
        spin = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.array([*(inverse @ turning), *spin])

    _, q = rotation(draw)
    state = np.array([*(round(draw.uniform(-3, 3), 3) for _ in range(3)), *(q if q[0] > 0 else -q)])
    samples, h = [state], 0.1 / 100
    for _ in range(SAMPLES - 1):
        for _ in range(100):
            a = rate(state)
            b = rate(state + h / 2 * a)
            d = rate(state + h / 2 * b)
            state = state + h / 6 * (a + 2 * b + 2 * d + rate(state + h * d))
        samples.append(state)
    found = np.array(samples)
    return Motion(body, np.arange(SAMPLES) / 10, found[:, :3], found[:, 3:])


def table(
    given: Motion, names: str, *columns: Array, head: str = "", separator: str = ",", times: object = None
) -> str:
    """A log of these columns behind that of the times."""
    instants = given.times if times is None else times
    cells = [[repr(float(t)) if not isinstance(t, str) else t] for t in instants]  # type: ignore[attr-defined]
    for index, line in enumerate(cells):
        line += [repr(float(v)) for column in columns for v in np.ravel(column[index])]
    body = "\n".join(separator.join(line) for line in cells)
    return given.head + head + (names + "\n" if names else "") + body + "\n"


def mrp(given: Motion) -> Array:
    """Of the shadow set where |σ| > 1."""
    sigma = given.q[:, 1:] / (1 + given.q[:, :1])
    square = (sigma**2).sum(axis=1, keepdims=True)
    return np.where(square > 1, -sigma / square, sigma)


def vectors(given: Motion) -> Array:
    """Rotation vectors, of angles up to 2π."""
    length = np.linalg.norm(given.q[:, 1:], axis=1, keepdims=True)
    return 2 * np.arctan2(length, given.q[:, :1]) * given.q[:, 1:] / length


def ephemeris(
    given: Motion, kind: str = "QUATERNION", order: str = "LAST", direction: str = "A2B", stamp: str = "%j"
) -> str:
    """A CCSDS AEM in UTC, with META blocks and comments."""
    last = [1, 2, 3, 0] if order == "LAST" else [0, 1, 2, 3]
    sign = np.array([1.0, 1, 1, 1]) if direction == "A2B" else np.array([1.0, -1, -1, -1])
    columns = [(given.q * sign)[:, last]]
    if kind.endswith("RATE"):
        columns.append(np.degrees(given.omega))
    day = "2026-001" if stamp == "%j" else "2026-01-01"
    lines = [
        f"{day}T23:59:{58 + int(t * 10) // 10:02d}.{round(t * 10) % 10}" if t < 2 else f"{day[:-1]}2T00:00:00.0"
        for t in given.times
    ]
    data = [" ".join([line, *(repr(float(v)) for c in columns for v in c[i])]) for i, line in enumerate(lines)]
    meta = [
        "META_START", "COMMENT a segment", "OBJECT_NAME = TOP", "OBJECT_ID = 2026-001A", "REF_FRAME_A = EME2000",
        "REF_FRAME_B = SC_BODY_1", f"ATTITUDE_DIR = {direction}", "TIME_SYSTEM = UTC", f"ATTITUDE_TYPE = {kind}",
        f"QUATERNION_TYPE = {order}", "META_STOP",
    ]  # fmt: skip
    top = ["CCSDS_AEM_VERS = 1.0", "CREATION_DATE = 2026-01-01T00:00:00", "ORIGINATOR = X"]
    comments = [f"COMMENT {line[2:]}" for line in given.head.splitlines()]
    return "\n".join([*top, *comments, *meta, "DATA_START", *data, "DATA_STOP", ""])


XYZW = [1, 2, 3, 0]


def logs_of(g: Motion, f: Motion) -> Iterator[tuple[str, str, str | bytes, str]]:
    """Name, suffix, text, and what a refusal has to say; "" where the log has to be read.  f: of a free body."""
    p = np.einsum("nij,j->ni", g.turns, np.array(g.body[2]))
    tum = "timestamp tx ty tz qx qy qz qw"
    epoch = 1_700_000_000 + g.times
    stamps = [f"{1_700_000_000 + round(t * 10) // 10}.{round(t * 10) % 10}00000000" for t in g.times]
    seconds = [f"{1_700_000_000 + round(t * 10) // 10},{round(t * 10) % 10 * 100_000_000}" for t in g.times]
    nano = [f"{1_700_000_000 + round(t * 10) // 10}{round(t * 10) % 10}00000000" for t in g.times]
    o, q, xyzw = g.omega, g.q, g.q[:, XYZW]
    stamp = "header.stamp.sec,header.stamp.nanosec"
    mark = b"\xef\xbb\xbf"
    yield "plain", "csv", table(g, "t,qw,qx,qy,qz,omega1,omega2,omega3", q, o), ""
    yield "TUM", "txt", table(g, f"# {tum}", p, xyzw, separator=" ", times=stamps), ""
    yield "TUM, no header", "tum", table(g, "", p, xyzw, separator=" ", times=stamps), ""
    yield "TUM, commas", "txt", table(g, f"#{tum.replace(' ', ',')}", p, xyzw, times=stamps), ""
    yield "TUM, commas and blanks", "txt", table(g, "", p, xyzw, separator=", ", times=stamps), ""
    yield "TUM, tabs", "txt", table(g, f"# {tum}", p, xyzw, separator="\t", times=stamps), ""
    text = table(g, f"# {tum}", p, xyzw, separator=" ", times=stamps)
    yield "TUM, CRLF", "txt", text.replace("\n", "\r\n").encode(), ""
    yield "TUM, mark", "txt", mark + text.encode(), ""
    yield (
        "plain, mark and CRLF",
        "csv",
        mark + table(g, "t,qw,qx,qy,qz", q).replace("\n", "\r\n").encode(),
        "",
    )
    kitti = "\n".join(
        " ".join(csv(part).replace(",", " ") for part in np.c_[r, t]) for r, t in zip(g.turns, p, strict=True)
    )
    yield "KITTI", "txt", g.head + kitti + "\n", "KITTI"
    ros = ",".join(f"pose.orientation.{a}" for a in "xyzw") + "," + ",".join(f"twist.angular.{a}" for a in "xyz")
    yield "ROS 2", "csv", table(g, f"{stamp},{ros}", xyzw, o, times=seconds), ""
    odometry = ros.replace("pose.", "pose.pose.").replace("twist.", "twist.twist.")
    yield (
        "ROS odometry",
        "csv",
        table(g, f"{stamp},{odometry}", xyzw, o, times=seconds),
        "",
    )
    field = (
        ",".join(f"field.orientation.{a}" for a in "xyzw")
        + ","
        + ",".join(f"field.angular_velocity.{a}" for a in "xyz")
    )
    yield "rostopic echo -p", "csv", table(g, f"%time,{field}", xyzw, o, times=nano), ""
    slash = field.replace("field.", "/imu/").replace("orientation.", "orientation/").replace("velocity.", "velocity/")
    yield "PlotJuggler", "csv", table(g, f"__time,{slash}", xyzw, o, times=stamps), ""
    yield (
        "Foxglove",
        "csv",
        table(g, "timestamp,orientation.x,orientation.y,orientation.z,orientation.w", xyzw, times=stamps),
        "",
    )
    yield "ROS 1", "csv", table(g, f"header.stamp.secs,header.stamp.nsecs,{ros}", xyzw, o, times=seconds), ""
    yield (
        "stamp_sec",
        "csv",
        table(g, f"stamp_sec,stamp_nanosec,{ros.replace('.', '_')}", xyzw, o, times=seconds),
        "",
    )
    free = ",".join(f"qpos[{k}]" for k in range(3, 7)) + "," + ",".join(f"qvel[{k}]" for k in range(3, 6))
    yield "MuJoCo, free", "csv", table(g, f"time,{free}", q, o, head="# joint: free\n"), ""
    ball = ",".join(f"qpos_{k}" for k in range(4)) + "," + ",".join(f"qvel_{k}" for k in range(3))
    yield "MuJoCo, ball", "csv", table(g, f"time,{ball}", q, o, head="# joint: ball\n"), ""
    yield "MuJoCo, no joint", "csv", table(g, f"time,{free}", q, o), "joint"
    yield "quat_w", "csv", table(g, "sim_time,quat_w,quat_x,quat_y,quat_z,angvel_x,angvel_y,angvel_z", q, o), ""
    yield "orientation.w", "csv", table(g, "t,orientation.w,orientation.x,orientation.y,orientation.z", q), ""
    yield "sigma", "csv", table(g, "t,sigma1,sigma2,sigma3,omega1,omega2,omega3", mrp(g), o), ""
    yield "sigma_BN", "csv", table(g, "time,sigma_BN[0],sigma_BN[1],sigma_BN[2]", mrp(g)), ""
    yield "rotation vector", "csv", table(g, "t,rx,ry,rz", vectors(g), head="# attitude: rotation vector\n"), ""
    yield "rx without a word", "csv", table(g, "t,rx,ry,rz", vectors(g)), "rotation vector"
    nine = ",".join(f"R{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3))
    yield "matrix", "csv", table(g, f"t,{nine}", g.turns), ""
    yield (
        "matrix, space to body",
        "csv",
        table(g, f"t,{nine}", g.turns.swapaxes(1, 2), head="# matrix: space_to_body\n"),
        "",
    )
    yield "AEM", "aem", ephemeris(g), ""
    yield "AEM, first", "aem", ephemeris(g, order="FIRST", stamp="%m"), ""
    yield "AEM, B2A", "aem", ephemeris(g, direction="B2A"), ""
    yield "AEM, rates", "aem", ephemeris(g, kind="QUATERNION/RATE"), ""
    yield "AEM, spin", "aem", ephemeris(g, kind="SPIN"), "QUATERNION"
    yield "degrees", "csv", table(g, "t,qw,qx,qy,qz,wx [deg/s],wy [deg/s],wz [deg/s]", q, np.degrees(o)), ""
    yield "semicolons", "csv", table(g, "t;qw;qx;qy;qz;omega1;omega2;omega3", q, o, separator=";"), ""
    yield "quaternion xyzw", "csv", table(g, "t,qx,qy,qz,qw", xyzw), ""
    lines = table(g, "t,qw,qx,qy,qz", q).splitlines()
    yield "a row twice", "csv", "\n".join([*lines[:12], lines[11], *lines[12:]]), ""
    yield (
        "two rows at one time",
        "csv",
        "\n".join([*lines[:12], lines[11][:-9] + "000000000", *lines[12:]]),
        "the same time and differ",
    )
    yield "a reset", "csv", "\n".join([*lines, *lines[-20:]]), ""
    yield "free, omega alone", "csv", table(f, "t,omega1,omega2,omega3", f.omega), ""
    falling = np.c_[f.times, 2 - f.times, -4.905 * f.times**2]
    yield "free, falling", "csv", table(f, "t,px,py,pz,qw,qx,qy,qz", falling, f.q), ""
    yield "a quaternion without w", "csv", table(g, "t,qx,qy,qz", q[:, 1:]), "component w is missing"
    yield "euler without a sequence", "csv", table(g, "t,roll,pitch,yaw", vectors(g)), "sequence"
    yield "milliseconds", "csv", table(g, "time_ms,qw,qx,qy,qz", q, times=1000 * g.times), ""
    yield "epoch in double", "csv", table(g, "timestamp,qw,qx,qy,qz", q, times=epoch), ""


def logs(seed: int) -> int:
    """Prints what is not read to ten digits, or refused without the line that helps; returns how many."""
    draw, wrong = random.Random(seed), 0
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, suffix, content, remedy in logs_of(motion(draw), motion(draw, FREE)):
            count += 1
            path = Path(folder) / f"log{count}.{suffix}"
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
            try:
                digits = scored(*read_trajectory(path)).digits_right or 0.0
                said = ""
            except InputError as error:
                digits, said = 0.0, f"{error.cause} {error.remedy}"
            least = 5 if name == "epoch in double" else 10
            if (remedy not in said or not said) if remedy else digits < least:
                wrong += 1
                print(f"{name}: {digits:.1f} digits; {said[:300]}")
    print(f"logs: {wrong} of {count} missed")
    return wrong


if __name__ == "__main__":
    number = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    missed = {"bodies": bodies, "logs": logs, "packages": packages}[sys.argv[1]](number)
    sys.exit(1 if missed else 0)
