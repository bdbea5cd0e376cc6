"""Files of unusual methods and motions, right and with one fault each: `validation/fresh_attack.py [COUNT] [SEED]`.

COUNT right files, none of which may be accused, and COUNT with one fault each, none of which may be called right and
85 of 100 must be named, as `heavytop score --json` prints it.  The equations, seven methods and the faults are written
here in double; a right file is right by the order of its method.  Exit code 1 where one is accused or called right.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from heavytop.cli import app

State = np.ndarray
Field = Callable[[State], State]


def cross(a: State, b: State) -> State:
    """a × b: numpy's takes thirty times as long for three numbers."""
    return a[AFTER] * b[BEFORE] - a[BEFORE] * b[AFTER]


AFTER, BEFORE = [1, 2, 0], [2, 0, 1]


def equations(inertia: State, moment: State, gyroscopic: float = 1, kinematic: float = 1, term: float = 1) -> Field:
    """y' of y = (Ω, γ); the last three plant a fault: signs of M × Ω and γ × Ω, a factor of P γ × r."""

    def field(y: State) -> State:
        w, g = y[:3], y[3:]
        torque = gyroscopic * cross(inertia * w, w) + term * cross(g, moment)
        return np.concatenate([torque / inertia, kinematic * cross(g, w)])

    return field


def rk4(f: Field, y: State, h: float) -> State:
    a = f(y)
    b = f(y + h / 2 * a)
    c = f(y + h / 2 * b)
    return y + h / 6 * (a + 2 * b + 2 * c + f(y + h * c))


def heun(f: Field, y: State, h: float) -> State:
    a = f(y)
    return y + h / 4 * (a + 3 * f(y + 2 * h / 3 * f(y + h / 3 * a)))


def gauss(f: Field, y: State, h: float) -> State:
    """Two stages of Gauss and Legendre, by fixed-point iteration."""
    root = np.sqrt(3) / 6
    a = b = f(y)
    for _ in range(40):
        a, b = f(y + h * (a / 4 + (1 / 4 - root) * b)), f(y + h * ((1 / 4 + root) * a + b / 4))
    return y + h / 2 * (a + b)


def midpoint(f: Field, y: State, h: float) -> State:
    z = y + h * f(y)
    for _ in range(60):
        z = y + h * f((y + z) / 2)
    return z


def extrapolated(f: Field, y: State, h: float) -> State:
    """Gragg's rule at 2, 4 and 6 parts of a step, extrapolated."""

    def rule(parts: int) -> State:
        last, now = y, y + h / parts * f(y)
        for _ in range(parts - 1):
            last, now = now, last + 2 * h / parts * f(now)
        return (last + now + h / parts * f(now)) / 2

    first, second, third = map(rule, (2, 4, 6))
    return first / 24 - 16 / 15 * second + 81 / 40 * third


def adams(order: int) -> Callable[[Field, State, float, int], Iterator[State]]:
    """Adams-Bashforth of order 2 or 4, begun by the classical Runge-Kutta method."""
    weights = {2: (3 / 2, -1 / 2), 4: (55 / 24, -59 / 24, 37 / 24, -9 / 24)}[order]

    def run(f: Field, y: State, h: float, count: int) -> Iterator[State]:
        past: list[State] = []
        for _ in range(count):
            past = [f(y), *past[: order - 1]]
            y = y + h * sum(a * k for a, k in zip(weights, past, strict=True)) if len(past) == order else rk4(f, y, h)
            yield y

    return run


def one_step(step: Callable[[Field, State, float], State]) -> Callable[[Field, State, float, int], Iterator[State]]:
    def run(f: Field, y: State, h: float, count: int) -> Iterator[State]:
        for _ in range(count):
            y = step(f, y, h)
            yield y

    return run


METHODS = {each.__name__: one_step(each) for each in (rk4, heun, gauss, midpoint, extrapolated)} | {
    "Adams-Bashforth 2": adams(2),
    "Adams-Bashforth 4": adams(4),
}
MOTIONS: dict[str, Callable[[np.random.Generator], tuple[State, State, State, State]]] = {
    "generic": lambda r: (r.uniform(1, 1.9, 3), r.normal(size=3), r.normal(size=3), r.normal(size=3)),
    "fast": lambda r: (r.uniform(1, 1.9, 3), r.normal(size=3), np.array([0.3, -0.2, 9]), r.normal(size=3)),
    "asleep": lambda r: (np.array([1.3, 1.3, 0.9]), np.array([0, 0, 1.0]), np.array([0.02, 0.01, 4]), np.eye(3)[2]),
    "hanging": lambda r: (r.uniform(1, 1.9, 3), np.array([0.2, 0.1, 1.0]), 0.1 * r.normal(size=3), -np.eye(3)[2]),
    "middle axis": lambda r: (np.array([1, 1.4, 1.9]), 0.3 * r.normal(size=3), np.array([0.05, 3, 0.05]), np.eye(3)[0]),
    "heavy": lambda r: (r.uniform(1, 1.9, 3), 8 * r.normal(size=3), r.normal(size=3), r.normal(size=3)),
    "light": lambda r: (r.uniform(1, 1.9, 3), 0.05 * r.normal(size=3), 2 * r.normal(size=3), r.normal(size=3)),
}


def scale(columns: slice, factor: float) -> Callable[[State], State]:
    def changed(states: State) -> State:
        states[:, columns] *= factor
        return states

    return changed


def late(states: State) -> State:
    return np.vstack([states[:1], states[:-1]])


def spoiled(row: int) -> Callable[[State], State]:
    def changed(states: State) -> State:
        states[row, 1] += 1e-3
        return states

    return changed


STATES: dict[str, tuple[set[str], Callable[[State], State]]] = {
    "γ down": ({"gamma_down"}, scale(slice(3, 6), -1)),
    "Ω reversed": ({"omega_reversed"}, scale(slice(0, 3), -1)),
    "degrees": ({"omega_in_degrees"}, scale(slice(0, 3), 180 / np.pi)),
    "rpm": ({"omega_in_rpm"}, scale(slice(0, 3), 30 / np.pi)),
    "a column scaled": ({"column_scaled"}, scale(slice(1, 2), 1.07)),
    "a column negated": ({"column_scaled", "component_sign", "columns", "axes_permuted"}, scale(slice(2, 3), -1)),
    "axes renamed": ({"axes_permuted"}, lambda y: y[:, [1, 2, 0, 4, 5, 3]]),
    "γ first": ({"columns_swapped"}, lambda y: y[:, [3, 4, 5, 0, 1, 2]]),
    "interleaved": ({"column_order"}, lambda y: y[:, [0, 3, 1, 4, 2, 5]]),
    "a row late": ({"rows_late", "rows_off_by_one", "times_shifted", "start_row_missing"}, late),
    "one row off": ({"one_state", "some_states"}, spoiled(17)),
    "reversed": ({"rows_reversed", "time_reversed"}, lambda y: y[::-1].copy()),
    "frozen": ({"frozen"}, lambda y: np.vstack([y[:20], np.tile(y[19], (len(y) - 20, 1))])),
    "four digits": ({"rounded"}, lambda y: np.round(y, 4)),
}
FIELDS: dict[str, tuple[set[str], dict[str, float]]] = {
    "M′ = Ω × M": ({"gyroscopic_sign"}, {"gyroscopic": -1}),
    "γ′ = Ω × γ": ({"kinematic_sign"}, {"kinematic": -1}),
    "both signs": ({"both_signs", "omega_reversed", "start_omega_sign"}, {"gyroscopic": -1, "kinematic": -1}),
    "weight of the other sign": ({"weight_sign", "weight", "centre_signs", "centre_axes", "gamma_down"}, {"term": -1}),
    "weight 3 % off": ({"weight"}, {"term": 1.03}),
    "no weight": ({"no_gravity", "free_about_centre_of_mass", "weight"}, {"term": 0}),
}


def file_of(rng: np.random.Generator, number: int, fault: str) -> tuple[str, str]:
    """A name and the text of a file, of a motion and a method that take turns; "" for no fault."""
    motion, method = (sorted(each)[number % len(each)] for each in (MOTIONS, METHODS))
    inertia, moment, omega, gamma = (np.round(part, 3) for part in MOTIONS[motion](rng))
    gamma = gamma / np.linalg.norm(gamma)
    field = equations(inertia, moment, **FIELDS[fault][1] if fault in FIELDS else {})
    every, samples = 10, 60
    states = list(METHODS[method](field, np.concatenate([omega, gamma]), 0.005, every * samples))[every - 1 :: every]
    rows = np.array(states) if fault not in STATES else STATES[fault][1](np.array(states))
    lines = [f"# {key}: {numbers(part)}" for key, part in (("inertia", inertia), ("omega", omega), ("gamma", gamma))]
    lines += ["# weight: 1", f"# centre: {numbers(moment)}", "t,omega1,omega2,omega3,gamma1,gamma2,gamma3"]
    lines += [f"{(n + 1) * every * 0.005:.6g},{numbers(row)}" for n, row in enumerate(rows)]
    return f"{motion} by {method}", "\n".join(lines) + "\n"


def numbers(values: State) -> str:
    return ",".join(repr(float(value)) for value in values)


def scored(text: str, file: Path) -> tuple[float, list[str]]:
    """Digits right and the kinds of the diagnoses."""
    file.write_text(text, "utf-8")
    said = json.loads(CliRunner().invoke(app, ["score", str(file), "--json"]).stdout)
    return said["digits_right"] or 0.0, [each["kind"] for each in said["diagnosis"]]


def main(count: int, seed: int) -> int:
    rng, accused, called_right, named = np.random.default_rng(seed), 0, 0, 0
    faults = [*STATES, *FIELDS]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "motion.csv"
        for number in range(count):
            name, text = file_of(rng, number, "")
            digits, kinds = scored(text, file)
            accused += bool(kinds)
            print(f"right: {name}: {digits:.1f} digits {kinds or ''}", flush=True)
            fault = faults[number % len(faults)]
            name, text = file_of(rng, number, fault)
            digits, kinds = scored(text, file)
            known = STATES.get(fault) or FIELDS[fault]
            is_named = bool(known[0] & set(kinds))
            named += is_named
            called_right += digits > 8 and not kinds
            print(
                f"{fault}: {name}: {digits:.1f} digits {kinds}{'' if known[0] & set(kinds) else ' MISSED'}", flush=True
            )
    print(f"{accused} of {count} right files accused; {called_right} of {count} faults called right, {named} named")
    return int(accused > 0 or called_right > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, [*sys.argv[1:], *("100", "1")[len(sys.argv) - 1 :]])))
