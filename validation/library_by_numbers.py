"""The library of claims in numbers of its own: does what holds stay constant, and does what is refuted move?

Nothing of `heavytop.features.claims` is used: the files are read here, their formulas evaluated in doubles, and the
equations of motion written again.  A motion is put into them by differences; a first integral or relation is
followed by SciPy's DOP853 from states at random on its conditions, which are found by least squares.  Published
numbers are compared with the attitude that it gives, as far as its digits go.

    python validation/library_by_numbers.py [--seed 1] [--starts 4]

Every entry is confirmed.
"""

from __future__ import annotations

import argparse
import ast
import math
import operator
import re
import sys
import tomllib
from collections.abc import Callable, Iterator
from fractions import Fraction
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.special import ellipj

LIBRARY = Path(str(files("heavytop.features.claims"))) / "library"
STATE = ("Omega1", "Omega2", "Omega3", "gamma1", "gamma2", "gamma3")
FUNCTIONS: dict[str, Callable[..., float]] = {
    name: getattr(math, name)
    for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "asin", "acos", "atan", "atan2")
} | {"sech": lambda x: 1 / math.cosh(x)}
FUNCTIONS |= {
    name: lambda u, m, index=index: float(ellipj(u, m)[index]) for index, name in enumerate(("sn", "cn", "dn"))
}
OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}  # fmt: skip
STEP = 1e-4
"""Of the differences: their error is some 1e-12 with five points."""
Vector = NDArray[np.float64]


def value_of(text: str, names: dict[str, float]) -> float:
    """A formula in doubles."""

    def at(node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=number):
                return float(number)  # type: ignore[arg-type]
            case ast.Name(id=name):
                return names["lambda" if name == "lambda_" else name]
            case ast.UnaryOp(op=ast.USub(), operand=part):
                return -at(part)
            case ast.BinOp(left=left, op=op, right=right):
                return OPERATORS[type(op)](at(left), at(right))
            case ast.Call(func=ast.Name(id=name), args=parts):
                return FUNCTIONS[name](*(at(part) for part in parts))
        raise ValueError(ast.dump(node))

    # `lambda` is a word of Python's
    said = re.sub(r"\blambda\b", "lambda_", " ".join(text.split()).replace("^", "**"))
    return float(at(ast.parse(said, mode="eval").body))


class Numbers:
    """One entry at one sample of its parameters."""

    def __init__(self, table: dict[str, Any], index: int) -> None:
        self.table = table
        self.given = {"pi": math.pi}
        for name, texts in table.get("parameters", {}).items():
            self.given[name] = value_of(texts if isinstance(texts, str) else texts[min(index, len(texts) - 1)], {})
        fixed = self.names(0.0, np.ones(6))  # no datum of a top holds t or the state
        top = table["top"]
        self.inertia = np.array([value_of(text, fixed) for text in top["inertia"]])
        centre = np.array([value_of(text, fixed) for text in top["centre"]])
        self.moment = value_of(top["weight"], fixed) * centre
        self.rotor = np.array([value_of(text, fixed) for text in top.get("rotor", ["0", "0", "0"])])

    def names(self, time: float, state: Vector) -> dict[str, float]:
        """Every name with its number."""
        found = {**self.given, "t": time, **dict(zip(STATE, map(float, state), strict=True))}
        for name, text in self.table.get("definitions", {}).items():
            found[name] = value_of(text, found)
        return found

    def field(self, _: float, state: Vector) -> Vector:
        """(Ω', γ') of a heavy top with a rotor."""
        omega, gamma = state[:3], state[3:]
        torque = np.cross(self.inertia * omega + self.rotor, omega) + np.cross(gamma, self.moment)
        return np.concatenate([torque / self.inertia, np.cross(gamma, omega)])

    # --- motions ---

    def state(self, time: float) -> Vector:
        """(Ω, γ) of a claimed motion."""
        motion, names = self.table["motion"], self.names(time, np.ones(6))
        if "angles" not in motion:
            return np.array([value_of(text, names) for text in (*motion["omega"], *motion["gamma"])])
        phi, theta, _ = self.angles(time)
        d_phi, d_theta, d_psi = slope(self.angles, time)
        s, gamma = math.sin(theta), np.array([math.sin(phi), math.cos(phi), 0.0]) * math.sin(theta)
        gamma[2] = math.cos(theta)
        omega = d_psi * gamma + d_theta * np.array([math.cos(phi), -math.sin(phi), 0.0]) + [0, 0, d_phi]
        assert abs(s) > 0
        return np.concatenate([omega, gamma])

    def angles(self, time: float) -> Vector:
        """(φ, θ, ψ)."""
        names = self.names(time, np.ones(6))
        return np.array([value_of(text, names) for text in self.table["motion"]["angles"]])

    def motion_is_off(self) -> float:
        """The largest residual of the six equations and of |γ| = 1 at some times."""
        off = 0.0
        for time in (-0.7, 0.3, 1.1):
            state = self.state(time)
            off = max(off, float(np.abs(slope(self.state, time) - self.field(time, state)).max()))
            off = max(off, abs(float(state[3:] @ state[3:]) - 1))
        return off

    # --- first integrals and relations ---

    def conditions(self, state: Vector) -> Vector:
        """What is 0 where the claim is made: γ is a unit vector, `where`, and F where it is a relation."""
        names, integral = self.names(0.0, state), self.table["integral"]
        texts = [*integral.get("where", []), *([integral["value"]] if self.table["kind"] == "relation" else [])]
        return np.array([state[3:] @ state[3:] - 1, *(value_of(text, names) for text in texts)])

    def starts(self, rng: np.random.Generator, count: int) -> Iterator[Vector]:
        """States at random on the conditions."""
        for _ in range(400):
            found = least_squares(self.conditions, rng.normal(size=6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
            if np.abs(found.fun).max() < 1e-13:
                yield found.x
                count -= 1
            if count == 0:
                return

    def drift(self, start: Vector) -> float:
        """How far F goes from its value at the start within two units of time."""
        text = self.table["integral"]["value"]
        path = solve_ivp(self.field, (0.0, 2.0), start, method="DOP853", rtol=1e-13, atol=1e-13)
        values = [value_of(text, self.names(0.0, state)) for state in path.y.T]
        return max(abs(value - values[0]) for value in values) / max(1.0, abs(values[0]))


# --- published numbers ---


def misses(table: dict[str, Any]) -> tuple[float, float]:
    """How far the numbers are off, and by how much they may be: both of the number that is worst."""
    body, start = table["body"], table["start"]
    mass, centre = float(body["mass"]), np.array([float(Fraction(x)) for x in body["centre"]])
    inertia = np.diag([float(Fraction(x)) for x in body["inertia"]])
    if body["about"] == "centre of mass":
        inertia += mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    torque = mass * float(body["gravity"]) * centre

    def field(_: float, y: Vector) -> Vector:
        w, x, omega = y[0], y[1:4], y[4:]
        up = 2 * (x[2] * x + w * np.cross([0, 0, 1.0], x)) + (w * w - x @ x) * np.array([0, 0, 1.0])
        rate = np.linalg.solve(inertia, np.cross(inertia @ omega, omega) + np.cross(up, torque))
        return np.concatenate([[-x @ omega / 2], (w * omega + np.cross(x, omega)) / 2, rate])

    at = np.array([float(Fraction(x)) for x in (*start["quaternion"], *start["omega"])])
    time, found = 0.0, (0.0, math.inf)
    for given in sorted(table["value"], key=lambda given: float(given["time"])):
        if float(given["time"]) > time:
            path = solve_ivp(field, (time, float(given["time"])), at, method="DOP853", rtol=1e-13, atol=1e-13)
            at, time = path.y[:, -1], float(given["time"])
        w, x = at[0], at[1:4]
        place = centre + 2 * np.cross(x, np.cross(x, centre) + w * centre)
        known = {"quaternion": at[:4], "position": place, "omega": at[4:]}[given["quantity"]][given["component"] - 1]
        number = float(given["number"])
        digits = len(given["number"].partition(".")[2])
        off = abs(number - known) if given["quantity"] != "quaternion" else abs(abs(number) - abs(known))
        allowed = float(given.get("tolerance", 0.5 * 10.0**-digits))
        if off / allowed > found[0] / found[1]:
            found = (off, allowed)
    return found


def slope(function: Callable[[float], Vector], time: float) -> Vector:
    """The derivative by five points."""
    near = function(time + STEP) - function(time - STEP)
    far = function(time + 2 * STEP) - function(time - 2 * STEP)
    return np.asarray((8 * near - far) / (12 * STEP))


def largest(table: dict[str, Any], rng: np.random.Generator, starts: int) -> float:
    """The largest residual or drift over samples and starts; nan where no start was found."""
    found = [math.nan]
    for index in range(2):
        numbers = Numbers(table, index)
        if table["kind"] == "motion":
            found.append(numbers.motion_is_off())
        else:
            found += [numbers.drift(start) for start in numbers.starts(rng, starts)]
    return float(np.nanmax(found)) if len(found) > 1 else math.nan


def main() -> int:
    """Print a line for each entry that is not confirmed, and how many are; 1 unless there are entries and all are."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--starts", type=int, default=4)
    parser.add_argument("--folder", type=Path, default=LIBRARY)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    confirmed = {"holds": 0, "refuted": 0}
    entries = sorted(options.folder.glob("*.toml"))
    for path in entries:
        table = tomllib.loads(path.read_text("utf-8"))
        expects = table["expects"]
        if table["kind"] == "value":
            off, allowed = misses(table)
            right = off < max(allowed, 1e-7) if expects == "holds" else off > allowed
        else:
            off = largest(table, rng, options.starts)
            right = off < 1e-8 if expects == "holds" else off > 1e-5
        confirmed[expects] += right
        if not right:
            print(f"{path.stem}: expected to be {expects}, off by {off:.1e}", flush=True)
    print(f"confirmed: {confirmed['holds']} that hold, {confirmed['refuted']} that are refuted")
    return 0 if entries and sum(confirmed.values()) == len(entries) else 1


if __name__ == "__main__":
    sys.exit(main())
