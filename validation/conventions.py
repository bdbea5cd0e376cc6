"""Random bodies in random conventions, written as other programs write them and scored; planted mistakes.

``python validation/conventions.py [bodies] [seed]`` writes each motion as a file of quaternions, matrices, Euler
angles, positions or Ω in space, in random conventions, and as a file of Ω and γ beside it; prints how many digits
`score` finds right in both, whether any right file is accused, and which of the planted mistakes are named.  The
motions are computed here: Taylor series in extended precision on the full tensor in body axes, by no part of heavytop.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from heavytop.errors import InputError
from heavytop.features.score.measurement import Assessment, assess
from heavytop.features.score.trajectories.files import read

REAL = np.longdouble
SEQUENCES = ("XYX", "XYZ", "XZX", "XZY", "YXY", "YXZ", "YZX", "YZY", "ZXY", "ZXZ", "ZYX", "ZYZ")
UPS = {  # canonical rows out of those of the file
    "z": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "x": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    "y": [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
    "-z": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "-x": [[0, -1, 0], [0, 0, 1], [-1, 0, 0]],
    "-y": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]],
}


def turn(axis: str, angle: REAL) -> np.ndarray:
    """The rotation about one axis."""
    i = "XYZ".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    found = np.zeros((3, 3), dtype=REAL)
    found[i, i] = 1
    found[j, j] = found[k, k] = np.cos(angle)
    found[k, j], found[j, k] = np.sin(angle), -np.sin(angle)
    return found


def of_angles(sequence: str, angles: np.ndarray) -> np.ndarray:
    """R = R_a R_b R_c."""
    return turn(sequence[0], angles[0]) @ turn(sequence[1], angles[1]) @ turn(sequence[2], angles[2])


def of_quaternion(q: np.ndarray) -> np.ndarray:
    """R of a unit quaternion w, x, y, z: e -> q e q̄."""
    w, v = q[0], q[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]], dtype=REAL)
    return np.eye(3, dtype=REAL) + 2 * w * skew + 2 * skew @ skew


def quaternion(matrix: np.ndarray) -> np.ndarray:
    """w, x, y, z with the largest component first found."""
    trace = np.trace(matrix)
    square = np.array([1 + trace, *(1 + 2 * matrix[i, i] - trace for i in range(3))]) / 4
    n = int(np.argmax(square))
    m = matrix
    four = {
        0: [0, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
        1: [m[2, 1] - m[1, 2], 0, m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
        2: [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 0, m[1, 2] + m[2, 1]],
        3: [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 0],
    }[n]
    found = np.array(four, dtype=REAL) / (4 * np.sqrt(square[n]))
    found[n] = np.sqrt(square[n])
    return found / np.sqrt((found * found).sum())


def angles(sequence: str, matrix: np.ndarray) -> np.ndarray:
    """Euler angles of a matrix: a, b, c with R = R_a R_b R_c."""
    i, j, k = ("XYZ".index(axis) for axis in sequence)
    if i == k:
        third = 3 - i - j
        sign = REAL(1 if (j - i) % 3 == 1 else -1)
        first = np.arctan2(matrix[j, i], -sign * matrix[third, i])
        last = np.arctan2(matrix[i, j], sign * matrix[i, third])
        middle = np.arctan2(np.hypot(matrix[j, i], matrix[third, i]), matrix[i, i])
    else:
        sign = REAL(1 if (j - i) % 3 == 1 else -1)
        first = np.arctan2(-sign * matrix[j, k], matrix[k, k])
        middle = np.arctan2(sign * matrix[i, k], np.hypot(matrix[i, i], matrix[i, j]))
        last = np.arctan2(-sign * matrix[i, j], matrix[i, i])
    found = np.array([first, middle, last], dtype=REAL)
    assert np.abs(of_angles(sequence, found) - matrix).max() < 1e-15, sequence
    return found


@dataclass
class Motion:
    """A body and its motion.  rotation: R in canonical axes of space at each time; omega: in body axes."""

    mass: float
    gravity: float
    centre: np.ndarray
    inertia: np.ndarray
    about: str
    rotation: np.ndarray
    omega: np.ndarray
    times: list[float]

    @property
    def tensor(self) -> np.ndarray:
        """About the fixed point."""
        c = self.centre.astype(REAL)
        steiner = REAL(self.mass) * ((c @ c) * np.eye(3) - np.outer(c, c))
        return self.inertia.astype(REAL) + (steiner if self.about == "centre of mass" else 0)


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Of a 3 by 3 matrix, by cofactors: numpy has none in extended precision."""
    rows = [np.cross(matrix[(i + 1) % 3], matrix[(i + 2) % 3]) for i in range(3)]
    return np.array(rows).T / (matrix[0] @ rows[0])


def integrate(body: Motion, rotation: np.ndarray, omega: np.ndarray, times: list[float]) -> Motion:
    """The motion by Taylor series in steps of a twelfth of a radian, in extended precision.

    J Ω' = J Ω × Ω + m g γ × c, R' = R [Ω]×: three rows u' = u × Ω.
    """
    tensor, moment = body.tensor, REAL(body.mass) * REAL(body.gravity) * body.centre.astype(REAL)
    solve = inverse(tensor)
    rate = float(max(np.abs(omega).max(), (np.abs(moment).max() / np.abs(tensor).max()) ** 0.5, 1e-3))
    state = [omega.astype(REAL), rotation[0].astype(REAL), rotation[1].astype(REAL), rotation[2].astype(REAL)]
    rotations, omegas, now = [], [], 0.0
    for end in times:
        steps = max(1, int(np.ceil(abs(end - now) * rate * 12)))
        h = REAL(end - now) / steps
        for _ in range(steps):
            state = step(state, tensor, solve, moment, h)
        now = end
        omegas.append(state[0])
        rotations.append(np.array(state[1:]))
    return replace(body, rotation=np.array(rotations), omega=np.array(omegas), times=times)


def step(
    state: list[np.ndarray], tensor: np.ndarray, solve: np.ndarray, moment: np.ndarray, h: REAL
) -> list[np.ndarray]:
    """One step by the Taylor series of Ω and of the three rows of R."""
    order = 22
    omega, rows, momenta = (np.zeros((order + 1, *shape), REAL) for shape in ((3,), (3, 3), (3,)))
    omega[0], rows[0], momenta[0] = state[0], state[1:], tensor @ state[0]
    for n in range(order):
        turned = omega[n::-1]
        change = np.cross(momenta[: n + 1], turned).sum(axis=0) + np.cross(rows[n, 2], moment)
        omega[n + 1] = solve @ change / REAL(n + 1)
        momenta[n + 1] = tensor @ omega[n + 1]
        rows[n + 1] = np.cross(rows[: n + 1], turned[:, None]).sum(axis=0) / REAL(n + 1)
    powers = h ** np.arange(order + 1)[::-1]
    return [powers @ part[::-1] for part in (omega, *rows.transpose(1, 0, 2))]


def random_motion(source: random.Random) -> tuple[Motion, np.ndarray, np.ndarray]:
    """A random body's motion with its start: quaternion and Ω."""
    return followed(*random_body(source))


def followed(body: Motion, q: np.ndarray, omega: np.ndarray) -> tuple[Motion, np.ndarray, np.ndarray]:
    """The motion of a body that has its start alone."""
    return integrate(body, body.rotation, omega, body.times), q, omega


def random_body(source: random.Random, samples: int = 20) -> tuple[Motion, np.ndarray, np.ndarray]:
    """A body of random tensor, half of them about the centre of mass, a third of them diagonal, with its start."""
    rng = np.random.default_rng(source.getrandbits(40))
    moments = np.sort(rng.uniform(0.5, 2, 3))
    moments[2] = min(moments[2], 0.9 * (moments[0] + moments[1]))
    axes = np.eye(3) if source.random() < 0.3 else of_quaternion(unit(rng.normal(size=4))).astype(float)
    inertia = axes @ np.diag(moments) @ axes.T
    inertia = np.round((inertia + inertia.T) / 2, 6)
    mass, gravity = round(rng.uniform(0.5, 3), 3), round(source.choice((9.81, 1.0, rng.uniform(2, 20))), 3)
    centre = np.round(rng.uniform(-0.5, 0.5, 3), 3)
    about = source.choice(("pivot", "centre of mass"))
    if about == "pivot":  # or no body has such moments
        inertia = np.round(inertia + mass * ((centre @ centre) * np.eye(3) - np.outer(centre, centre)), 6)
    q = np.round(unit(rng.normal(size=4)), 17).astype(float)
    rotation = of_quaternion(unit(q.astype(REAL)))
    omega = np.round(rng.normal(size=3) * 1.5, 3)
    times = sorted({k * source.choice((0.125, 0.25)) for k in range(1, samples + 1)})
    return Motion(mass, gravity, centre, inertia, about, rotation, omega, times), q, omega


def unit(q: np.ndarray) -> np.ndarray:
    """q/|q|."""
    return q / np.sqrt((q * q).sum())


@dataclass(frozen=True)
class Written:
    """A file of random columns in random conventions, and what plants a mistake in it."""

    forms: tuple[str, ...] = ("quaternion", "position", "omega")
    order: str = "wxyz"
    direction: str = "body_to_space"
    matrix: str = "body_to_space"
    sequence: str = "ZXZ"
    angles: str = "radians"
    up: str = "z"
    frame: str = "body"
    start: str = "quaternion"
    pivot: tuple[float, float, float] = (0.0, 0.0, 0.0)
    keys: dict[str, str] = field(default_factory=dict)

    def random(self, source: random.Random) -> Written:
        """Any conventions."""
        forms = [f for f in ("quaternion", "matrix", "euler", "position", "omega") if source.random() < 0.45]
        return Written(
            tuple(forms) or (source.choice(("quaternion", "euler", "matrix", "position")),),
            source.choice(("wxyz", "xyzw")),
            source.choice(("body_to_space", "space_to_body")),
            source.choice(("body_to_space", "space_to_body")),
            source.choice(SEQUENCES),
            source.choice(("radians", "degrees")),
            source.choice(tuple(UPS)),
            source.choice(("body", "space")),
            source.choice(("quaternion", "matrix", "euler", "row")),
            source.choice(((0.0, 0.0, 0.0), (0.5, -1.25, 2.0))),
        )

    def attitude(self, form: str, rotation: np.ndarray) -> np.ndarray:
        """The columns of one attitude; rotation: in canonical axes of space."""
        plain = np.array(UPS[self.up], dtype=REAL).T @ rotation
        if form == "quaternion":
            q = quaternion(plain) * ([1, -1, -1, -1] if self.direction == "space_to_body" else 1)
            return q if self.order == "wxyz" else q[[1, 2, 3, 0]]
        if form == "matrix":
            return (plain.T if self.matrix == "space_to_body" else plain).reshape(-1)
        found = angles(self.sequence, plain)
        return found if self.angles == "radians" else degrees(found)

    def columns(self, motion: Motion, row: int | None, start: tuple[np.ndarray, np.ndarray]) -> dict[str, np.ndarray]:
        """All columns of one sample; None for the start."""
        rotation, omega = start if row is None else (motion.rotation[row], motion.omega[row])
        plain = np.array(UPS[self.up], dtype=REAL).T @ rotation
        found = {
            form: self.attitude(form, rotation) for form in self.forms if form in ("quaternion", "matrix", "euler")
        }
        if "position" in self.forms:
            found["position"] = plain @ motion.centre + np.array(self.pivot, dtype=REAL)
        if "omega" in self.forms:
            found["omega"] = plain @ omega if self.frame == "space" else omega
        if "gamma" in self.forms:
            found["gamma"] = rotation[2]
        return found


def degrees(radians: np.ndarray) -> np.ndarray:
    """With π to 64 bits."""
    return radians * 180 / REAL("3.14159265358979323846264338327950288")


NAMES = {
    "quaternion": {"wxyz": "qw,qx,qy,qz", "xyzw": "qx,qy,qz,qw"},
    "matrix": ",".join(f"R{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
    "euler": "euler1,euler2,euler3",
    "position": "x,y,z",
    "omega": "wx,wy,wz",
    "gamma": "gamma1,gamma2,gamma3",
}
Spoil = Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]


def text(values: np.ndarray | list[float]) -> str:
    """Doubles in full."""
    return ",".join(repr(float(value)) for value in np.asarray(values).reshape(-1))


def as_csv(motion: Motion, q: np.ndarray, omega: np.ndarray, how: Written, spoil: Spoil | None = None) -> str:
    """The file."""
    spoil = spoil or (lambda columns: columns)
    # a program in double starts from the doubles that it writes
    start = (of_quaternion(unit(q.astype(REAL))), omega.astype(REAL))
    keys = {
        "precision": "double",
        "mass": repr(motion.mass),
        "gravity": repr(motion.gravity),
        "centre": text(motion.centre),
        "inertia": text([motion.inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]),
        "about": motion.about,
        "quaternion_order": how.order,
        "quaternion": how.direction,
        "matrix": how.matrix,
        "sequence": how.sequence,
        "angles": how.angles,
        "frame": how.frame,
        "up": how.up,
        "pivot": text(list(how.pivot)),
    }
    rows = [(0.0, spoil(how.columns(motion, None, start)))] if how.start == "row" else []
    if how.start != "row" or not set(how.forms) & {"quaternion", "matrix", "euler"}:
        form = how.start if how.start != "row" else "quaternion"
        keys[f"start_{form}"] = text(how.attitude(form, start[0]))
        rows = []
    if not rows or "omega" not in how.forms:
        keys["omega"] = text(start[1])
    rows += [(time, spoil(how.columns(motion, k, start))) for k, time in enumerate(motion.times)]
    header = ["t"]
    for name in rows[0][1]:
        said = NAMES[name]
        header.append(said if isinstance(said, str) else said[how.order])
    lines = [f"# {key}: {value}" for key, value in (keys | how.keys).items()]
    lines.append(",".join(header))
    lines += [",".join([repr(time), *(text(part) for part in columns.values())]) for time, columns in rows]
    return "\n".join(lines) + "\n"


def scored(content: str, folder: Path, **options: bool) -> Assessment:
    """What `score` says of it."""
    file = folder / "motion.csv"
    file.write_text(content, "utf-8")
    return assess(read(file, **options))


def right_files(count: int, seed: int, folder: Path) -> None:
    """Digits right in any conventions and as Ω and γ; nobody may be accused."""
    source, accused, worst, seconds = random.Random(seed), [], [], 0.0
    for number in range(count):
        motion, q, omega = random_motion(source)
        how = Written().random(source)
        began = time.perf_counter()
        found = scored(as_csv(motion, q, omega, how), folder)
        seconds += time.perf_counter() - began
        plain = scored(as_csv(motion, q, omega, Written(forms=("omega", "gamma"))), folder)
        worst.append((plain.digits_right or 0) - (found.digits_right or 0))
        if found.diagnoses:
            accused.append((number, how, found.diagnoses))
        if abs(worst[-1]) > 0.7:
            print(number, how, found.digits_right, plain.digits_right, found.row.against)
    low, middle, high = min(worst), np.median(worst), max(worst)
    print(
        f"{count} right files: {len(accused)} accused; digits of the Ω, γ file less those of this, smallest, median, "
        f"largest: {low:.2f}, {middle:.2f}, {high:.2f}; {seconds / count:.2f} s each"
    )
    for each in accused:
        print("   accused:", *each)


FULL = Written()
EULER = Written(forms=("euler", "omega"), start="euler")
MATRIX = Written(forms=("matrix", "omega"), start="matrix")
WORLD = replace(FULL, frame="space")


def columns(**changes: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    """Some columns changed in every row."""
    return lambda found: {name: changes.get(name, lambda value: value)(value) for name, value in found.items()}


def mirrored(value: np.ndarray) -> np.ndarray:
    """A quaternion (w, x, y, z) in axes whose third is reversed."""
    return value * [1, -1, -1, 1]


def off_diagonal(motion: Motion) -> str:
    """The six numbers with positive products of inertia."""
    i = motion.inertia
    return text([i[0, 0], i[1, 1], i[2, 2], -i[0, 1], -i[0, 2], -i[1, 2]])


def six(tensor: np.ndarray) -> str:
    """Six numbers of a tensor."""
    return text([tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])


def other_about(motion: Motion) -> str:
    """The other point."""
    return "pivot" if motion.about == "centre of mass" else "centre of mass"


Keys = Callable[[Motion], dict[str, str]]


@dataclass
class Planted:
    """A mistake: how the file is written, what its keys say instead, what is done to its columns; the kind.

    also: another body.  refused: words of the refusal, of what no body may have.
    """

    kinds: tuple[str, ...]
    how: Written = FULL
    keys: Keys = lambda motion: {}
    spoil: Spoil | None = None
    also: Callable[[Motion], Motion] | None = None
    refused: str = ""


PLANTED = {
    "scalar last, start and columns": Planted(
        ("scalar_last",), replace(FULL, order="xyzw"), lambda m: {"quaternion_order": "wxyz"}),
    "scalar last, columns": Planted(("scalar_last",), spoil=columns(quaternion=lambda q: q[[1, 2, 3, 0]])),
    "conjugate, start and columns": Planted(
        ("conjugate",), replace(FULL, direction="space_to_body"), lambda m: {"quaternion": "body_to_space"}),
    "conjugate, columns": Planted(("conjugate",), spoil=columns(quaternion=lambda q: q * [1, -1, -1, -1])),
    "left-handed quaternions": Planted(("left_handed",), spoil=columns(
        quaternion=mirrored, position=lambda p: p * [1, 1, -1], omega=lambda w: w * [-1, -1, 1])),
    "world Ω called body Ω": Planted(("omega_frame",), WORLD, lambda m: {"frame": "body"}),
    "body Ω called world Ω": Planted(("omega_frame",), FULL, lambda m: {"frame": "space"}),
    "y up, not said": Planted(("up",), replace(FULL, up="y"), lambda m: {"up": "z"}),
    "x up, not said": Planted(("up",), replace(FULL, up="x"), lambda m: {"up": "z"}),
    "z down, not said": Planted(("up", "gravity_sign"), replace(FULL, up="-z"), lambda m: {"up": "z"}),
    "g with the wrong sign": Planted(
        (), keys=lambda m: {"gravity": repr(-m.gravity)}, refused="gravity must not be negative"),
    "g in cm/s²": Planted(("gravity_unit",), keys=lambda m: {"gravity": repr(m.gravity * 100)}),
    "g of 1": Planted(("gravity_unit",), keys=lambda m: {"gravity": "1"},
        also=lambda m: replace(m, gravity=9.81)),
    "inertia about the other point": Planted(("inertia_about",), keys=lambda m: {"about": other_about(m)}),
    "positive products of inertia": Planted(("products_of_inertia",), keys=lambda m: {"inertia": off_diagonal(m)},
        refused="signs of the products of inertia"),
    "degrees for radians, start and columns": Planted(
        ("degrees",), replace(EULER, angles="degrees"), lambda m: {"angles": "radians"}),
    "degrees for radians, columns": Planted(("degrees",), EULER, spoil=columns(euler=degrees)),
    "matrix transposed, start and columns": Planted(
        ("transposed",), replace(MATRIX, matrix="space_to_body"), lambda m: {"matrix": "body_to_space"}),
    "matrix transposed, columns": Planted(
        ("transposed",), MATRIX, spoil=columns(matrix=lambda r: r.reshape(3, 3).T.reshape(-1))),
    "ZYZ called ZXZ": Planted(("sequence",), replace(EULER, sequence="ZYZ"), lambda m: {"sequence": "ZXZ"}),
    "XYZ called ZYX": Planted(("sequence",), replace(EULER, sequence="XYZ"), lambda m: {"sequence": "ZYX"}),
    "extrinsic angles": Planted(("extrinsic",), replace(EULER, sequence="ZYX", start="row"),
        lambda m: {"sequence": "XYZ"}, spoil=columns(euler=lambda a: a[::-1])),
    "angles negated": Planted(("angles_negated",), EULER, spoil=columns(euler=lambda a: -a)),
    "position of another point": Planted(("point",), keys=lambda m: {}),
    "displacement for position": Planted(("displacement",)),
    "pivot not said": Planted(("pivot",), replace(FULL, pivot=(0.5, -1.0, 2.0)), lambda m: {"pivot": "0,0,0"}),
    "position in mm": Planted(("position_unit",), spoil=columns(position=lambda p: 1000 * p)),
    "position from the centre": Planted(("position_reversed",), spoil=columns(position=lambda p: -p)),
    "γ down": Planted(("gamma_down",), Written(forms=("omega", "gamma", "position")),
        spoil=columns(gamma=lambda g: -g)),
    "Ω in degrees": Planted(("omega_in_degrees",), spoil=columns(omega=degrees)),
    "Ω in rpm": Planted(("omega_in_rpm",), spoil=columns(omega=lambda w: degrees(w) / 6)),
    "Ω with the other sign": Planted(("omega_reversed",), spoil=columns(omega=lambda w: -w)),
    "momentum for Ω": Planted(("momentum",)),
    "axes of the body permuted": Planted(("body_axes",), MATRIX, spoil=columns(
        matrix=lambda r: r.reshape(3, 3)[:, [1, 2, 0]].reshape(-1), omega=lambda w: w[[1, 2, 0]])),
    "axes of space permuted": Planted(("space_axes", "up"), MATRIX, spoil=columns(
        matrix=lambda r: r.reshape(3, 3)[[1, 2, 0]].reshape(-1))),
    "quaternions not of length 1": Planted(("quaternion_length",), spoil=columns(quaternion=lambda q: 1.02 * q)),
    "tensor in the axes of space": Planted(("inertia_in_space_axes",)),
    "inertia in g cm²": Planted(("inertia_unit",), keys=lambda m: {"inertia": six(m.inertia * 1e7)}),
    "centre in mm": Planted(("centre_unit",), keys=lambda m: {"centre": text(m.centre * 1000)}),
    "centre of the opposite side": Planted(("centre_reversed", "gravity_sign"), MATRIX,
        lambda m: {"centre": text(-m.centre)}),
    "one component of the centre": Planted(
        ("top",), keys=lambda m: {"centre": text(m.centre * np.array([1, 1.1, 1], dtype=REAL))}),
    "axes of the tensor permuted": Planted(
        ("inertia_axes",), keys=lambda m: {"inertia": six(m.inertia[np.ix_([1, 2, 0], [1, 2, 0])])}),
}  # fmt: skip


def planted(name: str, motion: Motion, q: np.ndarray, omega: np.ndarray) -> str:
    """The file with that mistake."""
    mistake = PLANTED[name]
    spoil = mistake.spoil
    if mistake.also is not None:
        motion = integrate(mistake.also(motion), of_quaternion(unit(q.astype(REAL))), omega, motion.times)
    start = of_quaternion(unit(q.astype(REAL)))
    if name == "displacement for position":
        spoil = columns(position=lambda p: p - start @ motion.centre)
    if name == "position of another point":
        rows = iter([m @ np.array([0.25, -0.5, 1.0]) for m in motion.rotation])
        spoil = columns(position=lambda p: next(rows))
    if name == "momentum for Ω":
        spoil = columns(omega=lambda w: motion.tensor @ w)
    keys = mistake.keys(motion)
    if name == "tensor in the axes of space":
        keys = {"inertia": six((start @ motion.inertia @ start.T).astype(float))}
    return as_csv(motion, q, omega, replace(mistake.how, keys=keys), spoil)


def general(source: random.Random) -> tuple[Motion, np.ndarray, np.ndarray]:
    """A body in which every mistake shows: full tensor about its centre of mass, centre off all axes, g = 9.81."""
    while True:
        body, q, omega = random_body(source)
        full = np.abs(body.inertia[np.triu_indices(3, 1)]).min() > 0.02 and np.abs(body.centre).min() > 0.05
        if full and body.about == "centre of mass" and body.gravity != 1.0:
            return followed(body, q, omega)


def named(name: str, drawn: tuple[Motion, np.ndarray, np.ndarray], folder: Path) -> list[str]:
    """The kinds that `score` names; "refused" where the file is, in the words that are expected."""
    try:
        return [each.kind for each in scored(planted(name, *drawn), folder).diagnoses]
    except InputError as error:
        if PLANTED[name].refused not in error.cause + error.remedy:
            raise
        return ["refused"]


def mistakes(folder: Path, seed: int, bodies: int) -> None:
    """How many of the planted mistakes are named, on a few bodies each."""
    source = random.Random(seed)
    drawn = [general(source) for _ in range(bodies)]
    for name, mistake in PLANTED.items():
        said = []
        for body in drawn:
            kinds = named(name, body, folder)
            good = any(kind in mistake.kinds or (kind == "refused" and mistake.refused) for kind in kinds)
            said.append("named" if good else f"MISSED {kinds}")
        print(f"{name:42s}", *said)


if __name__ == "__main__":
    bodies = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    with tempfile.TemporaryDirectory() as name:
        mistakes(Path(name), seed, 3)
        right_files(bodies, seed, Path(name))
