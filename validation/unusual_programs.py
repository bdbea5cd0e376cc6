"""Integrators of unusual methods at the gate, right and with one fault each: `validation/unusual_programs.py [NAME]`.

Each method is declared as it is.  A right one may be accused of nothing: `check-integrator` and a short plan end with 0
and doubt neither its order nor its steps.  One with a fault may not compare as same or better with the right one.
Exit code 1 where either happens.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.integrate.peers.double import Solution, double_peer

Step = Callable[..., Any]
FAULT = 0.0
"""Relative error of one coefficient."""


def rk4(f: Step, y: Any, h: float, _: dict[str, Any]) -> Any:
    a = f(y)
    b = f(y + h / 2 * a)
    c = f(y + h / 2 * b)
    return y + h / 6 * (a + 2 * (1 + FAULT) * b + 2 * c + f(y + h * c))


def exact_start(f: Step, y: Any, h: float) -> Any:
    """One step by four of the classical method."""
    for _ in range(4):
        a = f(y)
        b = f(y + h / 8 * a)
        c = f(y + h / 8 * b)
        y = y + h / 24 * (a + 2 * b + 2 * c + f(y + h / 4 * c))
    return y


def leapfrog(f: Step, y: Any, h: float, memory: dict[str, Any]) -> Any:
    before = memory.get("y")
    memory["y"] = y
    return exact_start(f, y, h) if before is None else before + 2 * h * (1 + FAULT) * f(y)


def adams(weights: tuple[float, ...]) -> Step:
    def step(f: Step, y: Any, h: float, memory: dict[str, Any]) -> Any:
        past = memory["past"] = [f(y), *memory.get("past", [])][: len(weights)]
        if len(past) < len(weights):
            return exact_start(f, y, h)
        return y + h * (sum(a * k for a, k in zip(weights, past, strict=True)) + FAULT * past[-1])

    return step


def solved(residual: Step, y: Any, tolerance: float = 1e-13) -> Any:
    """A root by Newton's method with differences."""
    for _ in range(8):
        r = residual(y)
        if np.abs(r).max() < tolerance:
            break
        slopes = np.array([(residual(y + 1e-7 * unit) - r) / 1e-7 for unit in np.eye(len(y))]).T
        y = y - np.linalg.solve(slopes, r)
    return y


def bdf2(f: Step, y: Any, h: float, memory: dict[str, Any]) -> Any:
    before = memory.get("y")
    memory["y"] = y
    if before is None:
        return exact_start(f, y, h)
    return solved(lambda z: z - (4 * y - before) / 3 - 2 * h / 3 * (1 + FAULT) * f(z), 2 * y - before)


def generalized_alpha(f: Step, y: Any, h: float, memory: dict[str, Any]) -> Any:
    """Of Jansen, Whiting and Hulbert with spectral radius 0.8; its memory is the rate."""
    m, a = (3 - 0.8) / (2 * 1.8), 1 / 1.8
    g = (0.5 + m - a) * (1 + FAULT)
    rate = memory.get("rate")
    rate = f(y) if rate is None else rate

    def after(new: Any) -> Any:
        return y + h * rate + h * g * (new - rate)

    new = solved(lambda v: rate + m * (v - rate) - f(y + a * (after(v) - y)), rate)
    memory["rate"] = new
    return after(new)


def extrapolated(f: Step, y: Any, h: float, _: dict[str, Any]) -> Any:
    """Gragg's rule at 2, 4 and 6 parts of a step."""

    def rule(parts: int) -> Any:
        last, now = y, y + h / parts * f(y)
        for _ in range(parts - 1):
            last, now = now, last + 2 * h / parts * f(now)
        return (last + now + h / parts * f(now)) / 2

    return rule(2) / 24 * (1 + FAULT) - 16 / 15 * rule(4) + 81 / 40 * rule(6)


def predictor_corrector(f: Step, y: Any, h: float, memory: dict[str, Any]) -> Any:
    """Adams-Bashforth 2 and Adams-Moulton 3, evaluated after each."""
    before, now = memory.get("rate"), f(y)
    memory["rate"] = now
    if before is None:
        return exact_start(f, y, h)
    return y + h / 12 * (5 * (1 + FAULT) * f(y + h / 2 * (3 * now - before)) + 8 * now - before)


def turned(v: Any, w: Any) -> Any:
    """v fixed in space after the body has turned by w, in its axes (Rodrigues)."""
    angle = float(np.linalg.norm(w))
    if angle < 1e-14:
        return v - np.cross(w, v)
    k = -w / angle
    return v * np.cos(angle) + np.cross(k, v) * np.sin(angle) + k * (k @ v) * (1 - np.cos(angle))


def lie(f: Step, y: Any, h: float, _: dict[str, Any]) -> Any:
    """The midpoint rule on the group: γ turns by h Ω of the middle."""
    middle = y[:3] + h / 2 * f(y)[:3]
    half = np.concatenate([middle, turned(y[3:], h / 2 * y[:3])])
    return np.concatenate([y[:3] + h * (1 + FAULT) * f(half)[:3], turned(y[3:], h * middle)])


def loose_midpoint(f: Step, y: Any, h: float, _: dict[str, Any]) -> Any:
    return solved(lambda z: z - y - h * (1 + FAULT) * f((y + z) / 2), y + h * f(y), 1e-6 * h)


def composed(f: Step, y: Any, h: float, _: dict[str, Any]) -> Any:
    """Ω by half of its rate, γ turned with it, Ω by the other half: a splitting for each of the two."""
    for part in (1 / (2 - 2 ** (1 / 3)), None, 1 / (2 - 2 ** (1 / 3))):
        k = h * (-(2 ** (1 / 3)) / (2 - 2 ** (1 / 3)) * (1 + FAULT) if part is None else part)
        y = solved(lambda z, y=y, k=k: z - y - k * f((y + z) / 2), y + k * f(y))
    return y


def single(f: Step, y: Any, h: float, memory: dict[str, Any]) -> Any:
    """The classical method with a state of single precision."""
    return rk4(f, y, h, memory).astype(np.float32).astype(float)


METHODS: dict[str, tuple[Step, int, bool]] = {
    "leapfrog": (leapfrog, 2, False),
    "ab2": (adams((3 / 2, -1 / 2)), 2, False),
    "ab4": (adams((55 / 24, -59 / 24, 37 / 24, -9 / 24)), 4, False),
    "bdf2": (bdf2, 2, False),
    "generalized-alpha": (generalized_alpha, 2, False),
    "extrapolated": (extrapolated, 6, True),
    "predictor-corrector": (predictor_corrector, 3, False),
    "lie": (lie, 2, True),
    "loose-midpoint": (loose_midpoint, 2, True),
    "composed": (composed, 4, True),
    "single": (single, 4, True),
    "aligned": (rk4, 4, True),
}


def spans(start: float, end: float, h: float, is_aligned: bool) -> Iterator[float]:
    """Equal steps from start to end; aligned ones end at multiples of h and at the end."""
    count = max(1, round(abs(end - start) / h)) if not is_aligned else 0
    yield from [(end - start) / (count or 1)] * count
    sign, t = (1 if end > start else -1), start
    while is_aligned and t != end:
        after = sign * h * (np.floor(abs(t) / h * (1 + 1e-12)) + 1)
        after = end if abs(after) > abs(end) - 1e-9 * h else after
        yield after - t
        t = after


def solve_with(name: str) -> Step:
    step, _, one_step = METHODS[name]

    def solve(given: Any) -> Solution:
        memory: dict[str, Any] = {}
        y, time, steps, states = np.array(given.start, dtype=float), 0.0, 0, []
        for end in given.times.tolist():
            last = None
            for h in spans(time, end, given.control, name == "aligned"):
                if not one_step and abs(h - memory.get("h", h)) > 1e-9 * abs(h):
                    memory.clear()
                memory["h"] = last = h
                y, steps = step(lambda y: np.array(given.field(list(y))), y, h, memory), steps + 1
            time = end if last is not None else time
            states.append([float(value) for value in y])
        return Solution(states, time, steps, 4 * steps)

    return solve


PLAN = """
name = "unusual"
[[measure]]
kind = "local_error"
cases = ["lagrange", "generic"]
precisions = ["double"]
horizon = "4"
integrator = "{0}"
[[measure]]
kind = "work_precision"
cases = ["lagrange"]
horizon = "5"
samples = 10
ladders = [{{ integrator = "{0}", steps = ["1/10", "1/20", "1/40"] }}]
"""
FILE = """
import sys
sys.path.append({here!r})
import unusual_programs
unusual_programs.FAULT = {fault}
peer = unusual_programs.peer({name!r})
"""
DOUBTS = re.compile(r"not the \d|wrongly|violated|miscount|no order|suspicious|too few|order .* not", re.IGNORECASE)


def peer(name: str) -> Any:
    """The integrator of that name, declared as it is."""
    _, order, one_step = METHODS[name]
    return double_peer(f"mine:{name}", order, solve_with(name), "step", one_step=one_step)


def said(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, list(words))
    return done.exit_code, done.output


def measured(folder: Path, name: str, fault: float) -> tuple[Path, int, str]:
    """The report of a method, the exit code of its measurement, and what was said of it."""
    folder = folder / str(fault)
    folder.mkdir()
    file, plan = folder / "m.py", folder / "p.toml"
    file.write_text(FILE.format(name=name, fault=fault, here=str(Path(__file__).parent)), "utf-8")
    plan.write_text(PLAN.format("./m.py:peer"), "utf-8")
    code, text = said("run", "--plan", str(plan), "--out", str(folder / "report"))
    return folder / "report", code, text


def main(only: str = "") -> int:
    wrong = 0
    for name in METHODS:
        if only not in name:
            continue
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            right, code, text = measured(folder, name, 0.0)
            checked, contract = said("check-integrator", f"{folder}/0.0/m.py:peer")
            doubts = [line for line in (text + contract).splitlines() if DOUBTS.search(line.replace("is violated", ""))]
            accused = bool(code or checked or doubts)
            print(f"{name}: {'ACCUSED' if accused else 'not accused'} {doubts or ''}", flush=True)
            if code or checked:
                print(text, contract)
            faulty, _, text = measured(folder, name, 1e-3)
            verdict, found = said("compare", str(right), str(faulty), "--full")
            print(f"{name} with a fault: exit {verdict}: {' '.join(found.split())[:300]}", flush=True)
            wrong += accused + (verdict == 0)
    print(f"{wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
