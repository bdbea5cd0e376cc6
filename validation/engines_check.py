"""The figures of `python -m validation.engines` once more, by an integration that shares nothing with this program.

    python -m validation.engines_check ENVIRONMENTS REPORT ... [--only NAME ...]

Each adapter runs again, spoken to from here; the motion is scipy's DOP853 at 1e-13 of Newton and Euler's equations
with a quaternion, of the bodies as they are written below, in the principal axes about the pivot, in which components
of Ω and γ are compared.  Prints the digits right of both, and how far they differ;
beside these the digits by components in the axes of the plan, which an error turns in.
"""

from __future__ import annotations

import argparse
import subprocess
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import heavytop as ht

ADAPTERS = Path(ht.__file__).parent / "features" / "engines" / "adapters"
LEAST, MOST = 1e-10, 1.0
"""Errors that are compared: smaller ones are near those of this integration."""
APART = 0.1
"""Digits by which the two may differ."""
SINGLE = "-single"
"""The end of the name of an integrator in single precision, whose roundings are those of one request."""


@dataclass(frozen=True)
class Body:
    """A body about its centre of mass, its start, and the end of its run; axes: as columns in those of the plan."""

    mass: float
    gravity: float
    centre: Any
    inertia: Any
    omega: Any
    quaternion: Any
    end: float
    axes: Any

    @classmethod
    def of(
        cls, mass: float, gravity: float, centre: Any, moments: Any, omega: Any, quaternion: Any, end: float
    ) -> Body:
        """The body of a plan, in its principal axes about the pivot."""
        given = ht.Body(mass, gravity, list(map(str, centre)), list(map(str, moments)), "centre of mass")
        axes = np.array(given.axes, float)
        turned = Rotation.from_quat(quaternion, scalar_first=True) * Rotation.from_matrix(axes)
        inertia = axes.T @ np.diag(moments) @ axes
        return cls(mass, gravity, centre @ axes, inertia, omega @ axes, turned.as_quat(scalar_first=True), end, axes)

    @cached_property
    def about_pivot(self) -> Any:
        """The tensor about the pivot."""
        c = np.array(self.centre)
        return self.inertia + self.mass * (c @ c * np.eye(3) - np.outer(c, c))

    def rate(self, _time: float, state: Any) -> Any:
        """The rates of (w, x, y, z) and Ω."""
        q, omega = state[:4], state[4:]
        w, v = q[0], q[1:]
        torque = np.cross(self.centre, -self.mass * self.gravity * vertical(q))
        turn = np.linalg.solve(self.about_pivot, torque - np.cross(omega, self.about_pivot @ omega))
        return np.concatenate([[-v @ omega / 2], (w * omega + np.cross(v, omega)) / 2, turn])

    @cached_property
    def motion(self) -> Any:
        """Ω and γ at 20 times, one a row."""
        start = np.concatenate([self.quaternion, self.omega])
        times = self.end * np.arange(1, 21) / 20
        run = solve_ivp(
            self.rate, (0, self.end), start, "DOP853", times, rtol=1e-13, atol=1e-14, max_step=self.end / 500
        )
        return np.array([[*state[4:], *vertical(state[:4])] for state in run.y.T])

    def lines(self) -> str:
        """What an adapter is told of it."""
        numbers = {
            "body mass": [self.mass],
            "body gravity": [self.gravity],
            "body centre": self.centre,
            "body inertia": self.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
            "body attitude": self.quaternion,
            "state": [*self.omega, *vertical(self.quaternion)],
            "times": [20, *(self.end * k / 20 for k in range(1, 21))],
        }
        return "".join(f"{name} {' '.join(map(repr, map(float, each)))}\n" for name, each in numbers.items())


def vertical(q: Any) -> Any:
    """The vertical in body axes."""
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])


NONE = (0.0, 0.0, 0.0)
BODIES = {
    "generic-body": Body.of(2, 9.81, (0.3, -0.2, 0.4), (1.2, 0.9, 0.6), (1, 2, 6), (0.8, 0, 0.6, 0), 10),
    "middle-axis": Body.of(1, 0, NONE, (1, 2, 2.8), (0.01, 5, 0.02), (1, 0, 0, 0), 10),
    "slow-lagrange": Body.of(1, 9.81, (0, 0, 0.1), (0.02, 0.02, 0.03), (0, 1, 5), (0.8, 0.6, 0, 0), 10),
}


def adapters(environments: Path, only: list[str]) -> Iterator[tuple[str, list[str]]]:
    """The integrators, each with its command."""
    for entry in only:
        engine, _, environment = entry.partition("=")
        python = str((environments / (environment or engine) / "bin" / "python").absolute())
        for table in tomllib.loads((ADAPTERS / f"{engine}.toml").read_text("utf-8"))["integrator"]:
            yield table["name"], [python if part == "{python}" else part for part in table["command"]]


def states(command: list[str], request: str) -> Any:
    """Ω and γ that an adapter answers, which is not asked for a quaternion."""
    text = f"heavytop-integrator 1\n{request}go\nquit\n"
    done = subprocess.run(command, input=text, capture_output=True, text=True, cwd=ADAPTERS, timeout=300, check=True)
    return np.array([line.split()[2:] for line in done.stdout.splitlines() if line.startswith("state ")], float)


def digits(body: Body, states: Any, axes: Any) -> float:
    """Digits right of Ω and γ at the worst sample, by components along the columns of a rotation."""
    found, true = (np.hstack([part @ axes for part in np.split(each, 2, axis=1)]) for each in (states, body.motion))
    return float(-np.log10((abs(found - true) / np.maximum(1, abs(true))).max()))


def compared(rows: list[ht.Row], name: str, run: Callable[[str], Any]) -> Iterator[tuple[str, float, float, float]]:
    """Each figure of an integrator: what it is, the digits of the report, those from here, and in the plan's axes."""
    for row in rows:
        body, metric = BODIES.get(row.key.case), row.metrics.get("solution_error_relative_max")
        own = row.key.kind == "work_precision" and row.key.subject.name == name and not name.endswith(SINGLE)
        if not own or body is None or metric is None or not LEAST < float(metric) < MOST:
            continue
        control = ht.precision.exact(row.key.subject.step or row.key.subject.tolerance)
        found = run(f"{body.lines()}setting {float(control)!r}\n")
        both = (digits(body, found, axes) for axes in (np.eye(3), body.axes.T))
        yield (f"{row.case} {row.integrator}", -np.log10(float(metric)), *both)


def main() -> int:
    """Returns 1 where a figure differs by more than 0.1 digits, or none was compared."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("environments", type=Path)
    parser.add_argument("reports", nargs="+", type=Path)
    parser.add_argument("--only", nargs="+", required=True)
    given = parser.parse_args()
    rows = [row for path in given.reports for row in ht.read_report(path).rows]
    differences = []
    for name, command in adapters(given.environments, given.only):
        for what, theirs, own, turned in compared(
            rows, name, lambda request, command=command: states(command, request)
        ):
            differences.append(abs(theirs - own))
            print(
                f"{what}: {theirs:.3f} in the report, {own:.3f} here, {turned:.3f} in the axes of the plan", flush=True
            )
    if differences:
        print(f"{len(differences)} figures, at most {max(differences):.4f} digits apart")
    return int(not differences or max(differences) > APART)


if __name__ == "__main__":
    raise SystemExit(main())
