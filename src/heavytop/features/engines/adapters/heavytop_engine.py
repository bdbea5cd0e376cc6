"""The protocol of heavytop for an engine of rigid bodies: what its adapters share.

An adapter gives `serve` its name with version, and a class.  `Engine(body)` builds the model at the start;
`advance(h, n)` takes n steps of size h; `read()` returns the attitude, a quaternion (w, x, y, z) or the matrix R from
body to space, and Ω in body axes.  An engine that chooses its own steps has `reach(time, tolerance)` in the place of
`advance`.  Where it has `pivot()`, the place in space of the point that is held, the largest distance from the origin
is reported.
"""

import math
import os
import sys
import time
from typing import Any, TextIO

import numpy as np

ANSWERS: TextIO = os.fdopen(os.dup(1), "w", encoding="utf-8")
os.dup2(2, 1)  # what engines print, when they are imported or from C++, goes to standard error


class RigidBody:
    """The body of an engine, in body axes, SI or any units that fit together.

    mass, gravity (it points down, −z of space), centre (from the pivot), inertia (3 × 3, about the centre of mass),
    quaternion (w, x, y, z) and rotation (3 × 3, body to space), omega (in body axes), omega_space.
    principal: moments about the centre of mass, and their axes as the columns of a rotation.
    """

    def __init__(self, request: dict[str, list[str]]) -> None:
        self.mass, self.gravity = float(request["body mass"][0]), float(request["body gravity"][0])
        self.centre = np.array(request["body centre"], float)
        a, b, c, d, e, f = map(float, request["body inertia"])
        self.inertia = np.array([[a, d, e], [d, b, f], [e, f, c]])
        self.quaternion = np.array(request["body attitude"], float)
        self.rotation = matrix(self.quaternion)
        self.omega = np.array(request["state"][:3], float)
        self.omega_space = self.rotation @ self.omega
        moments, axes = np.linalg.eigh(self.inertia)
        self.principal = moments, axes * np.sign(np.linalg.det(axes))

    @property
    def about_pivot(self) -> Any:
        """The inertia tensor about the pivot."""
        square = self.centre @ self.centre
        return self.inertia + self.mass * (square * np.eye(3) - np.outer(self.centre, self.centre))


def matrix(quaternion: Any) -> Any:
    """R of (w, x, y, z), of any length."""
    w, x, y, z = np.array(quaternion, float) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion(rotation: Any) -> Any:
    """(w, x, y, z) of a rotation, the largest component positive."""
    r = np.asarray(rotation)
    off = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    both = np.empty((4, 4))  # 4 q qᵀ
    both[0, 0], both[0, 1:], both[1:, 0] = 1 + np.trace(r), off, off
    both[1:, 1:] = r + r.T + (1 - np.trace(r)) * np.eye(3)
    column = both[:, np.argmax(np.diag(both))]
    return column / np.linalg.norm(column)


MUJOCO = """
<mujoco>
  <option gravity="0 0 {down}" integrator="{method}"><flag contact="disable"/></option>
  <worldbody><body>
    <joint type="ball"/><inertial pos="{centre}" mass="{mass}" fullinertia="{inertia}"/>
  </body></worldbody>
</mujoco>"""


def mujoco_model(body: RigidBody, method: str) -> Any:
    """Model and data of MuJoCo, which MJX takes over: a ball joint and a body, every number exactly."""
    import mujoco

    six = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    centre, inertia = (" ".join(repr(float(value)) for value in values) for values in (body.centre, six))
    text = MUJOCO.format(method=method, centre=centre, inertia=inertia, mass=body.mass, down=-body.gravity)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = body.quaternion, body.omega
    return model, data


def serve(name: str, engine: Any) -> None:
    """Answers requests until `quit` or the end of input."""
    request: dict[str, list[str]] = {}
    for line in sys.stdin:
        key, *words = line.split()
        if key == "heavytop-integrator":
            _say("ready", name)
        elif key == "body":
            request[f"body {words[0]}"] = words[1:]
        elif key == "go":
            try:
                _say("\n".join(_answers(engine, request)))
            except (ArithmeticError, RuntimeError, ValueError) as error:
                _say("failed", *str(error).split()[:40])
            request = {}
        elif key == "quit":
            break
        else:
            request[key] = words


def _say(*words: str) -> None:
    ANSWERS.write(" ".join(words) + "\n")
    ANSWERS.flush()


def _answers(engine: Any, request: dict[str, list[str]]) -> list[str]:
    control, times = float(request.get("setting", ["0"])[0]), [float(text) for text in request["times"][1:]]
    if not times:
        return ["done steps 0"]
    run, now, steps, off, lines = engine(RigidBody(request)), 0.0, 0, 0.0, []
    began = time.perf_counter()
    for end in times:
        if hasattr(run, "reach"):
            run.reach(end, control)
        elif end > now:
            count = max(1, math.ceil((end - now) / control * (1 - 1e-12)))
            run.advance((end - now) / count, count)
            steps += count
        now = end
        lines.append(_state(end, *run.read(), request))
        if hasattr(run, "pivot"):
            off = max(off, float(np.linalg.norm(run.pivot())))
    ending = [f"seconds {time.perf_counter() - began!r}"]
    steps = steps or getattr(run, "steps", 0)
    ending += [f"steps {steps}"] if steps else []
    ending += [f"joint {off!r}"] if hasattr(run, "pivot") else []
    return [*lines, f"done {' '.join(ending)}"]


def _state(end: float, attitude: Any, omega: Any, request: dict[str, list[str]]) -> str:
    """A quaternion where one is asked for; else γ, the vertical in body axes, and ξ where nine numbers are."""
    values = np.array(attitude, float)
    if "quaternion" not in request:
        rows = matrix(values) if values.shape == (4,) else values
        values = rows[[2, 0] if len(request["state"]) == 9 else [2]].ravel()
    return " ".join(["state", repr(end), *(repr(float(value)) for value in (*omega, *values))])
