"""Files as simulation engines write them: first and second order, with one mistake each or with none.

``python validation/engine_files.py [seed]`` writes 40 files with one mistake each and the right file beside each, of
four methods, at 0.5 to 5 digits right; it prints which mistakes `score` names and which right files it accuses.  The
methods are written here, in double and by no part of heavytop.
"""

from __future__ import annotations

import random
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from heavytop.features.score.measurement import Assessment, assess
from heavytop.features.score.text import diagnosis_text
from heavytop.features.score.trajectories.files import read


def skew(v: np.ndarray) -> np.ndarray:
    """[v]× of a vector."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a × b: numpy's takes thirty times as long for three numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def exponential(v: np.ndarray) -> np.ndarray:
    """The rotation of a rotation vector (Rodrigues)."""
    angle = np.linalg.norm(v)
    if angle < 1e-12:
        return np.eye(3) + skew(v)
    k = skew(v / angle)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def quaternion(rows: np.ndarray) -> np.ndarray:
    """w, x, y, z of a rotation."""
    trace = np.trace(rows)
    squares = np.array([1 + trace, *(1 + 2 * rows[i, i] - trace for i in range(3))]) / 4
    m, n = rows, int(np.argmax(squares))
    found = {
        0: [4 * squares[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
        1: [m[2, 1] - m[1, 2], 4 * squares[1], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
        2: [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 4 * squares[2], m[1, 2] + m[2, 1]],
        3: [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 4 * squares[3]],
    }[n]
    q = np.array(found) / (4 * np.sqrt(squares[n]))
    return q / np.linalg.norm(q)


@dataclass
class Engine:
    """A body held at a point, and how an engine moves it.  tensor: about the centre of mass, in body axes."""

    mass: float = 2.0
    gravity: float = 9.81
    centre: np.ndarray = field(default_factory=lambda: np.array([0.3, -0.2, 0.4]))
    tensor: np.ndarray = field(default_factory=lambda: np.diag([1.2, 0.9, 0.6]))
    rotation: np.ndarray = field(default_factory=lambda: exponential(np.array([0, 1.2, 0])))
    omega: np.ndarray = field(default_factory=lambda: np.array([1.0, 2.0, 6.0]))
    method: str = "semi-implicit Euler"
    step: float = 1e-3
    every: int = 50
    samples: int = 40
    about: str = "pivot"
    reset: int = 0
    rotor: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gyroscopic: np.ndarray = field(default_factory=lambda: np.ones(3))
    """Factors of the gyroscopic moment: 1, but for a fault."""

    def about_pivot(self) -> np.ndarray:
        """The tensor that the motion has."""
        c = self.centre
        return self.tensor + (self.mass * (c @ c * np.eye(3) - np.outer(c, c)) if self.about == "pivot" else 0)

    def run(self) -> tuple[list[int], list[np.ndarray], list[np.ndarray]]:
        """Numbers of steps, R and Ω at each sample, the start first.  reset: the step behind which it starts again."""
        tensor = self.about_pivot()
        inverse, moment = np.linalg.inv(tensor), self.mass * self.gravity * self.centre

        def change(r: np.ndarray, w: np.ndarray) -> np.ndarray:
            return inverse @ (self.gyroscopic * cross(tensor @ w + self.rotor, w) + cross(r[2], moment))

        r, w, h = self.rotation, self.omega, self.step
        steps, rotations, omegas = [0], [r], [w]
        for n in range(1, self.every * self.samples + 1):
            if self.method == "semi-implicit Euler":
                w = w + h * change(r, w)
                r = r @ exponential(h * w)
            elif self.method == "explicit Euler":
                r, w = r @ exponential(h * w), w + h * change(r, w)
            elif self.method == "midpoint":
                half = w + h / 2 * change(r, w)
                w = w + h * change(r @ exponential(h / 2 * w), half)
                r = r @ exponential(h * half)
            else:  # Runge-Kutta-Munthe-Kaas of order 4 with one commutator
                a, ka = w, change(r, w)
                b = w + h / 2 * ka
                kb = change(r @ exponential(h / 2 * a), b)
                c = w + h / 2 * kb
                kc = change(r @ exponential(h / 2 * b + h * h / 8 * cross(a, b)), c)
                d = w + h * kc
                kd = change(r @ exponential(h * c), d)
                turn = h / 6 * (a + 2 * b + 2 * c + d) + h * h / 12 * cross(a, d)
                r, w = r @ exponential(turn), w + h / 6 * (ka + 2 * kb + 2 * kc + kd)
            if self.reset and n == self.reset:
                r, w = self.rotation, self.omega
            if n % self.every == 0:
                steps.append(n)
                rotations.append(r)
                omegas.append(w)
        return steps, rotations, omegas


Columns = dict[str, list[np.ndarray]]


@dataclass
class Log:
    """What an engine writes.  keys: of the comments, instead of the right ones.  spoil: done to the columns."""

    forms: tuple[str, ...] = ("quaternion", "omega")
    keys: dict[str, str] = field(default_factory=dict)
    spoil: Callable[[Columns, Engine], Columns] | None = None
    times: Callable[[list[int], float], list[float]] = lambda steps, h: [n * h for n in steps]


HEADERS = {
    "quaternion": "qw,qx,qy,qz",
    "matrix": ",".join(f"R{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
    "omega": "wx,wy,wz",
    "gamma": "gamma1,gamma2,gamma3",
    "position": "x,y,z",
}


def text(values: object) -> str:
    """Doubles in full."""
    return ",".join(repr(float(v)) for v in np.asarray(values, dtype=float).reshape(-1))


def six(tensor: np.ndarray) -> str:
    """Six entries of a tensor."""
    return text([tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])


def written(engine: Engine, log: Log) -> str:
    """The file."""
    steps, rotations, omegas = engine.run()
    columns: Columns = {
        "quaternion": [quaternion(r) for r in rotations],
        "matrix": [r.reshape(-1) for r in rotations],
        "omega": omegas,
        "gamma": [r[2] for r in rotations],
        "position": [r @ engine.centre for r in rotations],
    }
    columns = {name: columns[name] for name in log.forms}
    if log.spoil is not None:
        columns = log.spoil(columns, engine)
    keys = {
        "precision": "double",
        "step": repr(engine.step),
        "mass": repr(engine.mass),
        "gravity": repr(engine.gravity),
        "centre": text(engine.centre),
        "inertia": six(engine.tensor),
        "about": "centre of mass",
        "omega": text(engine.omega),
        "start_quaternion": text(quaternion(engine.rotation)),
    } | log.keys
    lines = [f"# {key}: {value}" for key, value in keys.items() if value]
    lines.append(",".join(["t", *(HEADERS[name] for name in columns)]))
    for n, time in enumerate(log.times(steps, engine.step)):
        if n or not keys["start_quaternion"]:
            lines.append(",".join([repr(time), *(text(part[n]) for part in columns.values())]))
    return "\n".join(lines) + "\n"


def each(change: Callable[[np.ndarray], np.ndarray], *names: str) -> Callable[[Columns, Engine], Columns]:
    """Some columns changed in every row."""
    return lambda columns, engine: {
        name: [change(row) for row in rows] if name in names else rows for name, rows in columns.items()
    }


def in_space(columns: Columns, engine: Engine) -> Columns:
    """Ω in the axes of space."""
    _, rotations, omegas = engine.run()
    return columns | {"omega": [r @ w for r, w in zip(rotations, omegas, strict=True)]}


def half_a_step(sign: int) -> Callable[[Columns, Engine], Columns]:
    """Ω of half a step before or behind: of a run that starts there."""

    def spoil(columns: Columns, engine: Engine) -> Columns:
        fine = replace(engine, step=engine.step / 2, every=1, samples=2 * engine.every * engine.samples + 1)
        _, _, omegas = fine.run()
        places = [max(0, 2 * engine.every * n + sign) for n in range(engine.samples + 1)]
        return columns | {"omega": [omegas[place] for place in places]}

    return spoil


def conjugated(engine: Engine) -> dict[str, str]:
    """The tensor with its principal axes turned the other way."""
    moments, axes = np.linalg.eigh(engine.tensor)
    return {"inertia": six(axes.T @ np.diag(moments) @ axes)}


def rotated(engine: Engine, turn: np.ndarray) -> Engine:
    """The same motion in body axes that are turned."""
    return replace(
        engine,
        centre=np.round(turn.T @ engine.centre, 6),
        tensor=np.round(turn.T @ engine.tensor @ turn, 6),
        rotation=engine.rotation @ turn,
        omega=np.round(turn.T @ engine.omega, 6),
    )


def sum_of_steps(steps: list[int], h: float) -> list[float]:
    """Times as a clock has them that adds the step up in single precision now and then."""
    now, found = 0.0, [0.0]
    for n in range(1, steps[-1] + 1):
        now += h * (1 + 3e-8)
        if n in steps:
            found.append(now)
    return found


Body = tuple[Engine, dict[str, str]]
"""What the engine moves, and keys of the file that say something else."""
MISTAKES: dict[str, tuple[tuple[str, ...], Callable[[Engine], tuple[Engine, Log]]]] = {
    "frame unsaid": (("omega_frame",), lambda e: (e, Log(spoil=in_space))),
    "tensor about the other point": (
        ("inertia_about",), lambda e: (e, Log(keys={"inertia": six(e.about_pivot()), "about": "centre of mass"}))),
    "w last": (("scalar_last",), lambda e: (e, Log(spoil=each(lambda q: q[[1, 2, 3, 0]], "quaternion")))),
    "no gravity": (("no_gravity",), lambda e: (replace(e, gravity=0.0), Log(keys={"gravity": "9.81"}))),
    "free": (("free_about_centre_of_mass",), lambda e: (
        replace(e, gravity=0.0, about="centre of mass"), Log(keys={"gravity": "9.81"}))),
    "conjugate": (("conjugate",), lambda e: (e, Log(spoil=each(lambda q: q * [1, -1, -1, -1], "quaternion")))),
    "axes conjugated": (("tensor_axes_conjugated",), lambda e: (e, Log(keys=conjugated(e)))),
    "Ω never written": (("omega_zero",), lambda e: (e, Log(spoil=each(lambda w: 0 * w, "omega")))),
    "reset": (("reset",), lambda e: (replace(e, reset=int(e.every * e.samples * 0.6) + 7), Log())),
    "degrees": (("omega_in_degrees",), lambda e: (e, Log(spoil=each(np.degrees, "omega")))),
    "y up": (("up", "space_axes"), lambda e: (e, Log(
        keys={"start_quaternion": text(quaternion(np.eye(3)[[1, 2, 0]] @ e.rotation))},
        spoil=each(lambda q: quaternion(np.eye(3)[[1, 2, 0]] @ matrix(q)), "quaternion")))),
    "centre reversed": (("centre_reversed", "gravity_sign"), lambda e: (e, Log(keys={"centre": text(-e.centre)}))),
}  # fmt: skip
SECOND = {
    "half a step early": (("omega_shifted",), lambda e: (e, Log(spoil=half_a_step(-1)))),
    "half a step late": (("omega_shifted",), lambda e: (e, Log(spoil=half_a_step(1)))),
    "clock": (("clock",), lambda e: (e, Log(times=sum_of_steps))),
}
"""Mistakes as small as the error of a method of first order: of methods of higher order alone."""


def matrix(q: np.ndarray) -> np.ndarray:
    """R of a quaternion w, x, y, z."""
    w, v = q[0], q[1:]
    return np.eye(3) + 2 * w * skew(v) + 2 * skew(v) @ skew(v)


def random_engine(source: random.Random, method: str) -> Engine:
    """A body of full tensor, its start, and a step that leaves 0.5 to 4 digits."""
    rng = np.random.default_rng(source.getrandbits(40))
    turn = exponential(rng.normal(size=3))
    moments = rng.uniform(0.6, 1.3, 3)
    step, every = source.choice(((1e-3, 50), (5e-4, 100), (2e-3, 25), (1e-4, 1000), (1e-3, 200)))
    if method not in ("semi-implicit Euler", "explicit Euler"):
        step, every = 10 * step, every // 10 or 1
    return Engine(
        mass=round(rng.uniform(1, 3), 2),
        centre=np.round(rng.uniform(0.15, 0.5, 3) * rng.choice([-1, 1], 3), 3),
        tensor=np.round(turn @ np.diag(moments) @ turn.T, 6),
        rotation=exponential(rng.normal(size=3)),
        omega=np.round(rng.normal(size=3) * source.choice((1.0, 3.0)), 3),
        method=method,
        step=step,
        every=every,
        samples=20 if every >= 100 else 40,
    )


def scored(content: str, folder: Path) -> Assessment:
    """What `score` says of it."""
    (folder / "log.csv").write_text(content, "utf-8")
    return assess(read(folder / "log.csv"))


def planted(name: str, source: random.Random, method: str) -> tuple[str, tuple[str, ...], str]:
    """A file with that mistake, the kinds that name it, and the right file beside it."""
    kinds, build = (MISTAKES | SECOND)[name]
    engine = random_engine(source, method)
    moved, log = build(engine)
    return written(moved, log), kinds, written(engine, Log())


FIRST_ORDER = ("semi-implicit Euler", "explicit Euler", "midpoint")


def main(seed: int) -> None:
    """All mistakes by methods of several orders, and the right files beside them."""
    source, named, count, accused = random.Random(seed), 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plans = [(mistake, method) for mistake in MISTAKES for method in FIRST_ORDER]
        plans += [(mistake, method) for mistake in SECOND for method in ("midpoint", "Munthe-Kaas")][:4]
        for mistake, method in plans:
            content, kinds, right = planted(mistake, source, method)
            found, beside = scored(content, folder), scored(right, folder)
            said = [each.kind for each in found.diagnoses if each.kind != "columns_disagree"]
            good = any(kind in kinds for kind in said)
            named, count, accused = named + good, count + 1, accused + bool(beside.diagnoses)
            print(
                f"{mistake:30s} {method:20s} {beside.digits_right:5.2f}", "named" if good else f"MISSED {said}", end=" "
            )
            print("likely" if any(each.likely for each in found.diagnoses) else "", flush=True)
            for each_said in beside.diagnoses:
                print("   ACCUSED:", diagnosis_text(each_said))
    print(f"{named} of {count} named, {accused} of {count} right files accused")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
