"""Whether the gate finds planted bugs in integrators, how long it takes, and whether its first sentences name them.

`.venv/bin/python validation/buggy_integrators.py [--places] [--only WORD] [--every N] [--folder DIR] [--again]`

Two healthy integrators, the classical Runge-Kutta method with a fixed step and the pair of Dormand and Prince with a
tolerance, are measured once; then each of 60 copies with one bug, or with 1e-9 in one of the 28 places of the tableaus.
A bug is detectable where some error of the plan grows by more than a tenth beside rounding; the others are listed with
how far they moved any.  Each is compared the other way round too: what mends it may not be worse by a slight loss.
Prints a line for each bug: seconds, verdict, its first sentence, and whether the first three name it.

Of 60: 57 worse and named, 3 undetectable, 0 missed; some 6 s each with one other busy process on the machine.  Of the
28 places: 23 worse and named, 5 undetectable.  Named are the sign and its equation, the step too many, the late row,
dense output, an early end; wrong coefficients and lower precision by the order that is observed, or by an error of
lower order than the method's.  Undetectable are, in dp5, a(1, 0) off by 1e-9 and stage 1 in float32, which move no
error of the plan by 1 %, and a(4, 0) to a(4, 3) off by 1e-9: these make one error smaller, the drift of |M|^2 by 31
%, and none larger by 1 %, which no comparison of errors can distinguish from a repair: they are better.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = '''
import numpy
from heavytop.integrate.peers.double import Solved, double_peer
from heavytop.integrate.trajectory import Outcome

BUG = @BUG@

RK4 = [[], [1 / 2], [0, 1 / 2], [0, 0, 1]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]
DP5 = [
    [],
    [1 / 5],
    [3 / 40, 9 / 40],
    [44 / 45, -56 / 15, 32 / 9],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
]
ERRORS = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]


def tableau(name):
    a, b = ([row[:] for row in RK4[0]], RK4[1][:]) if name == "rk4" else ([row[:] for row in DP5], [])
    if BUG.get("where") == "a":
        i, j = BUG["place"]
        a[i][j] += BUG["by"]
    if BUG.get("where") == "b":
        b[BUG["place"]] += BUG["by"]
    return a, b


def field_of(given):
    def field(y):
        found = numpy.array([float(value) for value in given.system.field(given.parameters, y.tolist())])
        if "sign" in BUG:
            found[BUG["sign"]] *= -1
        return found

    return field


def stages(field, a, y, h):
    k = []
    for i, row in enumerate(a):
        slope = field(y + h * sum((c * d for c, d in zip(row, k) if c), numpy.zeros(6)))
        k.append(slope.astype(numpy.float32).astype(float) if BUG.get("single") == i else slope)
    return k


def times_of(given):
    return given.times[: int(BUG["early"] * len(given.times))] if "early" in BUG else given.times


def finish(states, given, steps, evaluations):
    if "shift" in BUG and len(states) > 1:
        states = [given.start, *states[:-1]]
    return Solved(states, given.times[-1], steps, evaluations)


def rk4(given):
    a, b = tableau("rk4")
    field, y, t, steps, states = field_of(given), numpy.array(given.start), 0.0, 0, []
    for end in times_of(given):
        count = max(1, round(abs(end - t) / given.control))
        h = (end - t) / count
        for _ in range(count + BUG.get("further", 0)):
            y = y + h * sum(c * d for c, d in zip(b, stages(field, a, y, h)))
        t, steps = end, steps + count
        states.append(y)
    return finish(states, given, steps, 4 * steps)


def dp5(given):
    a, _ = tableau("dp5")
    tolerance = given.control * BUG.get("looser", 1)
    field, y, t, steps, states = field_of(given), numpy.array(given.start), 0.0, 0, []
    h = numpy.copysign(0.01, given.times[-1])
    wanted = list(times_of(given))
    nodes = [(0.0, y)]
    stops = wanted if BUG.get("dense") is None else wanted[-1:]
    for end in stops:
        while t != end and steps < given.step_limit:
            last = abs(end - t) <= abs(h)
            now = end - t if last else h
            k = stages(field, a, y, now)
            new = y + now * sum(c * d for c, d in zip(a[6], k[:6]))
            wrong = abs(now * sum(e * d for e, d in zip(ERRORS, k))) * BUG.get("estimate", 1)
            size = max((wrong / (tolerance * (1 + numpy.maximum(abs(y), abs(new))))).max(), 1e-10)
            if size <= 1:
                t, y, steps = (end if last else t + now), new, steps + 1
                nodes.append((t, y))
            h = now * min(5, max(0.2, 0.9 * size**-0.2)) if not last or size > 1 else h
        states.append(y)
    if BUG.get("dense") is not None:
        states = [between(nodes, at, field) for at in wanted]
    return finish(states, given, steps, 7 * steps)


def between(nodes, at, field):
    """Linear, or cubic where BUG["dense"] is 3, between two steps."""
    n = next(i for i in range(1, len(nodes)) if abs(nodes[i][0]) >= abs(at))
    (t0, y0), (t1, y1) = nodes[n - 1], nodes[n]
    h = t1 - t0
    s = (at - t0) / h
    if BUG["dense"] == 1:
        return (1 - s) * y0 + s * y1
    f0, f1 = field(y0), field(y1)
    return (1 - s) * y0 + s * y1 + s * (s - 1) * ((1 - 2 * s) * (y1 - y0) + (s - 1) * h * f0 + s * h * f1)


rk4_peer = double_peer("rk4", 4, rk4, "step")
dp5_peer = double_peer("dp5", 5, dp5)
'''
PLAN = """
name = "bugs"
integrators = ["mine.py:{name}_peer"]
[[measure]]
kind = "work_precision"
cases = ["lagrange", "euler"]
horizon = "5"
samples = 7
ladders = [{{ integrator = "mine.py:{name}_peer", {settings} }}]
"""
SETTINGS = {
    "rk4": 'steps = ["1/10", "1/30", "1/100"]',
    "dp5": 'tolerances = ["1e-4", "1e-6", "1e-8"]',
}
_TENTH = 1.1
_ROUNDING = -12.0
"""log10 of errors up to which rounding may have made them, over the steps of the plan."""
SIZES = (1e-9, 1e-7, 1e-5, 1e-3)
MOVED = ("Order observed", "Digits right", "of lower order than the method")
"""What names a wrong coefficient or a lower precision."""


def bugs() -> list[tuple[str, str, dict[str, object], tuple[str, ...]]]:
    """Name, integrator, what is wrong, and words one of which the first three sentences must have."""
    found: list[tuple[str, str, dict[str, object], tuple[str, ...]]] = []
    places = [("a", (1, 0)), ("a", (2, 1)), ("a", (3, 2)), *(("b", j) for j in range(4))]
    for where, place in places:
        found += [
            (f"rk4 {where}{place} + {by:g}", "rk4", {"where": where, "place": place, "by": by}, MOVED)
            for by in (1e-7, 1e-5, 1e-3)
        ]
    entries = [(i, j) for i in range(1, 7) for j in range(i)]
    for n, (i, j) in enumerate(entries):
        by = SIZES[n % len(SIZES)]
        found.append((f"dp5 a({i}, {j}) + {by:g}", "dp5", {"where": "a", "place": (i, j), "by": by}, MOVED))
    for name, stage in (("rk4", 0), ("rk4", 3), ("dp5", 1), ("dp5", 5)):
        found.append((f"{name} stage {stage} in float32", name, {"single": stage}, MOVED))
    signs = {0: "Ω1", 2: "Ω3", 5: "γ3"}
    found += [
        (
            f"rk4 component {sign} of the field negated",
            "rk4",
            {"sign": sign},
            (f"equation of {name} has the opposite sign",),
        )
        for sign, name in signs.items()
    ]
    found += [
        ("dp5 error estimate / 1000", "dp5", {"estimate": 1e-3}, ("Steps",)),
        ("dp5 error estimate * 0.03", "dp5", {"estimate": 0.03}, ("Steps",)),
        ("dp5 tolerance * 10", "dp5", {"looser": 10}, ("Steps",)),
        ("dp5 linear interpolation", "dp5", {"dense": 1}, ("between",)),
        ("dp5 cubic interpolation", "dp5", {"dense": 3}, ("between", "Digits right")),
        ("rk4 ends early", "rk4", {"early": 0.8}, ("failed",)),
        ("dp5 ends early", "dp5", {"early": 0.5}, ("failed",)),
        ("rk4 a step too far", "rk4", {"further": 1}, ("one step too long (72 steps of 1/71",)),
        ("rk4 times off by one", "rk4", {"shift": 1}, ("one row late",)),
        ("dp5 times off by one", "dp5", {"shift": 1}, ("one row late",)),
        ("rk4 b(1) + 1e-9", "rk4", {"where": "b", "place": 1, "by": 1e-9}, MOVED),
    ]
    return found


def places() -> list[tuple[str, str, dict[str, object], tuple[str, ...]]]:
    """1e-9 in each place of the two tableaus."""
    of_rk4 = [("a", (1, 0)), ("a", (2, 1)), ("a", (3, 2)), *(("b", j) for j in range(4))]
    of_dp5 = [("a", (i, j)) for i in range(1, 7) for j in range(i)]
    found = [("rk4", *place) for place in of_rk4] + [("dp5", *place) for place in of_dp5]
    return [
        (f"{name} {where}{place} + 1e-9", name, {"where": where, "place": place, "by": 1e-9}, MOVED)
        for name, where, place in found
    ]


def heavytop(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "heavytop", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=600, check=False)


def measure(folder: Path, name: str, bug: dict[str, object]) -> float:
    """Write the program and its plan into ``folder``, run it; the seconds."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "mine.py").write_text(PROGRAM.replace("@BUG@", repr(bug)))
    (folder / "plan.toml").write_text(PLAN.format(name=name, settings=SETTINGS[name]))
    began = time.perf_counter()
    done = heavytop("run", "--plan", "plan.toml", "--out", "out", "--workers", "1", cwd=folder)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{folder}: {done.returncode}\n{done.stderr}")
    return time.perf_counter() - began


def moves(baseline: Path, candidate: Path) -> tuple[float, float]:
    """The largest and the smallest factor between two errors of the same metric, of those well above rounding."""
    rows = [json.loads((folder / "out" / "report.json").read_text())["rows"] for folder in (baseline, candidate)]
    errors = [
        {(row["case"], row["integrator"], name): m["log10"] for row in each for name, m in row["metrics"].items()}
        for each in rows
    ]
    pairs = [(log, errors[1].get(key)) for key, log in errors[0].items()]
    moved = [b - a for a, b in pairs if a is not None and b is not None and max(a, b) > _ROUNDING]
    return 10 ** max(moved, default=0.0), 10 ** min(moved, default=0.0)


def compared(old: str, new: str, cwd: Path) -> tuple[str, str]:
    """The verdict, and the first three sentences."""
    verdict = json.loads(heavytop("compare", f"{old}/out", f"{new}/out", "--json", cwd=cwd).stdout)
    return verdict["verdict"], " | ".join(verdict["findings"][:3])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--places", action="store_true", help="1e-9 in each place of the tableaus")
    parser.add_argument("--only", default="")
    parser.add_argument("--every", type=int, default=1, help="of the bugs, one in so many")
    parser.add_argument("--folder", type=Path, default=None)
    parser.add_argument("--again", action="store_true", help="compare what the folder holds, measure what it lacks")
    asked = parser.parse_args()
    root = (asked.folder or Path(tempfile.mkdtemp())).absolute()
    chosen = [bug for bug in (places() if asked.places else bugs()) if asked.only in bug[0]][:: asked.every]
    folders = {f"healthy {name}": (name, name, {}) for name in dict.fromkeys(bug[1] for bug in chosen)}
    for title, name, bug, _ in chosen:
        folders[title] = re.sub(r"\W+", "-", title), name, bug
    seconds = {}
    for title, (folder, name, bug) in folders.items():
        known = asked.again and (root / folder / "out" / "report.json").is_file()
        seconds[title] = 0.0 if known else measure(root / folder, name, bug)
        print(f"{seconds[title]:5.1f} s  {title}", flush=True)
    counts = {"worse and named": 0, "worse": 0, "incomparable": 0, "undetectable": 0, "missed": 0}
    back: dict[str, int] = {}
    for title, name, _, words in chosen:
        folder = folders[title][0]
        verdict, first = compared(name, folder, root)
        mended, _ = compared(folder, name, root)
        grown, fell = moves(root / name, root / folder)
        if (what := verdict) in ("same", "better"):
            what = "missed" if grown > _TENTH else "undetectable"
        elif what == "worse" and any(word in first for word in words):
            what = "worse and named"
        counts[what] += 1
        back[mended] = back.get(mended, 0) + 1
        print(
            f"{seconds[title]:5.1f} s  {what:15}  {title}: errors times {fell:.3g} to {grown:.3g}; {verdict}, mended "
            f"{mended}: {first}",
            flush=True,
        )
    print(", ".join(f"{count} {what}" for what, count in counts.items()) + f"; mended: {back}")


if __name__ == "__main__":
    main()
