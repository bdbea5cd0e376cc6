"""Body files of robots and logs of every kind, by own code: slips that must be named, right files that must be read.

``python validation/bodies_and_logs.py bodies [seed]`` writes 40 body files with one slip each and 40 right ones, of
random boxes, in URDF, MJCF, SDF, USD and TOML; it prints each slip that `heavytop body` does not name, and each right
file that it refuses or reads as another tensor.  ``python validation/bodies_and_logs.py logs [seed]`` writes 40 logs of
random motions, integrated here by Runge-Kutta in double: each must be read to ten digits, or be refused with the line
that would help.  Exit code 1 where one is not.
"""

from __future__ import annotations

import random
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from heavytop.features.body.document import assess
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
    return wrong


if __name__ == "__main__":
    missed = bodies(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    print(f"bodies: {missed} of 80 missed")
    sys.exit(1 if missed else 0)
