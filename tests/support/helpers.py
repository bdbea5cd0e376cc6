"""Random exact tops and starts for tests, and the reference states that no code of this project made."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from random import Random
from time import monotonic, sleep
from typing import Any

from flint import fmpq
from rich.console import Console, RenderableType

from heavytop.harness import integrator_check
from heavytop.integrate import registry
from heavytop.integrate.registry import IntegratorSource
from heavytop.integrate.trajectory import Trajectory
from heavytop.precision import exact
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State

TOP = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
DATA = {
    "inertia": "3,2,1",
    "weight": "1",
    "centre": "1/2,1/3,1/5",
    "omega": "1/10,2/5,9/10",
    "gamma": "3/5,0,4/5",
    "times": "8",
}
"""The same motion in the words of the command line."""
VECTORS = json.loads((Path(__file__).parents[1] / "data" / "vectors.json").read_text("utf-8"))


PAPER = (
    HeavyTop((3, 5, 7), "1/3", (0, "1/7", 0)),
    State([Fraction(2, 7) * 11 / 3, Fraction(3, 7) * 11 / 5, Fraction(6, 7) * 11 / 7], ("2/7", "3/7", "6/7")),
)
"""A gyrostat of the paper, with γ along M and |M| = 11."""


def flipped_gamma(p: Parameters, y: Sequence[Any]) -> tuple[Any, ...]:
    """The field of the heavy top with γ' = Ω × γ."""
    rates = HEAVY_TOP.field(p, y)
    return (*rates[:3], *(-rate for rate in rates[3:]))


FLIPPED = System("heavy_top", flipped_gamma, HEAVY_TOP.angular_velocity)
"""A system that calls itself the heavy top, with a wrong sign."""


def fraction(random: Random, low: int = -30, high: int = 30) -> Fraction:
    """A rational that is not 0, with a small denominator."""
    return Fraction(random.choice([n for n in range(low, high + 1) if n]), random.randint(1, 13))


def positive(random: Random) -> Fraction:
    return fraction(random, 1, 30)


def vector(random: Random) -> tuple[Fraction, Fraction, Fraction]:
    return fraction(random), fraction(random), fraction(random)


def moments(random: Random) -> tuple[Fraction, Fraction, Fraction]:
    """Three positive numbers."""
    return positive(random), positive(random), positive(random)


def moments_of_a_body(random: Random) -> tuple[Fraction, ...]:
    """Three of which none exceeds the sum of the others, within a factor of nine."""
    while True:
        found = tuple(Fraction(random.randint(32, 288), 96) for _ in range(3))
        if 2 * max(found) <= sum(found):
            return found


def random_parameters(random: Random, system: System, unit: Fraction = Fraction(1)) -> Parameters:
    return Parameters(
        moments(random), tuple(unit * v for v in vector(random)), rotor(system, lambda: unit * fraction(random))
    )


def in_units(top: HeavyTop, start: State, rate: Fraction) -> tuple[HeavyTop, State]:
    """The same motion in a unit of time in which all of it is ``rate`` times as fast."""
    rotor = top.rotor and [rate * k for k in top.rotor]
    other = HeavyTop(top.inertia, top.weight * rate**2, top.centre, rotor)
    return other, State([rate * w for w in start.omega], start.gamma)


def renamed(values: Sequence[Any], axes: Sequence[int]) -> list[Any]:
    """Canonical values put on the axes (i, j, k)."""
    found: list[Any] = [0, 0, 0]
    for value, axis in zip(values, axes, strict=True):
        found[axis] = value
    return found


def rational(value: Any) -> fmpq:
    """The number of FLINT."""
    return fmpq(Fraction(value).numerator, Fraction(value).denominator)


def unit_vector(random: Random) -> tuple[Fraction, Fraction, Fraction]:
    """A rational point of the unit sphere, by stereographic projection."""
    u, v = fraction(random), fraction(random)
    norm = 1 + u * u + v * v
    return 2 * u / norm, 2 * v / norm, (1 - u * u - v * v) / norm


def top_of(given: dict) -> HeavyTop:
    return HeavyTop(given["inertia"], given["weight"], given["centre"])


def start_of(given: dict) -> State:
    return State(given["omega"], given["gamma"])


def run_peer(name: str, *problem: Any, setting: tuple[str, Fraction] | None = None, **options: Any) -> Trajectory:
    """One run of a peer, as the rows of a report make it."""
    return registry.ready(name, setting)(*problem, **options)


def bits(run: Trajectory) -> list[list[Fraction]]:
    """The exact values of all states."""
    return [[exact(value) for value in state] for state in run.states]


def distance(one: Trajectory, other: Trajectory) -> Fraction:
    """The largest difference of two components, exactly."""
    pairs = zip(bits(one), bits(other), strict=True)
    return max(abs(a - b) for first, second in pairs for a, b in zip(first, second, strict=True))


def judged(which: IntegratorSource, part: str) -> integrator_check.Checked:
    """One part of the contract alone."""
    return integrator_check._judged(part, dict(integrator_check._Contract(which).parts())[part])


def shown(document: RenderableType, width: int = 80) -> str:
    """The text of a document of the terminal."""
    console = Console(width=width, force_terminal=False)
    with console.capture() as captured:
        console.print(document)
    return captured.get()


def without_progress(errors: str) -> str:
    """Standard error without the line that says after ten seconds how far a command is."""
    return re.sub(r"(?m)^heavytop: [\w-]+: \d+ s so far.*\n", "", errors)


def rotor(system: System, draw: Callable[[], Fraction]) -> Any:
    """λ, or k in its place for the heavy gyrostat."""
    return (draw(), draw(), draw()) if system is HEAVY_GYROSTAT else draw()


def named_peers(folder: Path, peers: Mapping[str, str], *lines: str) -> None:
    """The metadata of an installed package whose entry points are these integrators, ``mine:`` before their names."""
    info = folder / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    named = (f"mine:{name} = {target}" for name, target in peers.items())
    (info / "entry_points.txt").write_text("\n".join(["[heavytop.peers]", *named, *lines]))


def options(data: Mapping[str, str] = DATA, **changes: str) -> list[str]:
    """These words of the command line as its options."""
    return [part for name, value in {**data, **changes}.items() for part in (f"--{name}", value)]


def python(*words: object, **more: Any) -> subprocess.CompletedProcess[str]:
    """Python with these arguments in a process of its own, and what it printed."""
    line = [sys.executable, *map(str, words)]
    return subprocess.run(line, capture_output=True, text=True, timeout=300, check=False, **more)


def wait_until(condition: Callable[[], object], seconds: float = 20, nap: float = 0.05) -> bool:
    """Whether a condition came true within so many seconds."""
    end = monotonic() + seconds
    while not (met := condition()) and monotonic() < end:
        sleep(nap)
    return bool(met)


def running(*words: str) -> list[str]:
    """The processes whose command lines hold all of these words."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            line = (folder / "cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if all(word in line for word in words):
            found.append(folder.name)
    return found


def gone(*words: str) -> bool:
    """Whether there is no such process any more, soon."""
    return wait_until(lambda: not running(*words))


def is_running(process: int) -> bool:
    """Whether a process runs: one that was killed may wait for its parent to notice."""
    try:
        return " Z " not in Path(f"/proc/{process}/stat").read_text("utf-8")
    except OSError:
        return False
