"""Every engine of rigid bodies that is installed, on four bodies: what results/engines holds.

    python -m validation.engines ENVIRONMENTS --out DIR [--only NAME ...]

ENVIRONMENTS holds a virtual environment for each engine, by its name: ENVIRONMENTS/mujoco, made by ``python3 -m venv``
and the ``pip install`` that the head of its table names.  Siconos is the system's.  Engines that are not there are left
out; one that is named ``mujoco=mujoco-3.3.0`` is taken from that environment.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import tempfile
from pathlib import Path

import heavytop
from heavytop.__main__ import main as command_line
from heavytop.integrate.peers.command import Command
from heavytop.integrate.registry import commands_in

ADAPTERS = Path(heavytop.__file__).parent / "features" / "engines"
FOURTH, SECOND, FIRST, FINER, FINEST = (
    [f"1/{n}" for n in counts]
    for counts in (
        (50, 100, 200, 1000),
        (100, 250, 500, 1000),
        (250, 500, 1000, 2000),
        (250, 500, 1000, 10000),
        (1000, 2000, 4000, 8000),
    )
)
STEPS = {
    "mujoco:RK4": FOURTH,
    "mujoco": FINER,
    "mjx:RK4": FOURTH,
    "drake:RK2": SECOND,
    "drake:discrete": FINER,
    "drake:Radau3": FOURTH,
    "pinocchio:R": FOURTH,
    "exudyn:RK": FOURTH,
    "exudyn": SECOND,
    "basilisk": ["1/10", "1/20", "1/50", "1/100"],
    "pybullet": ["1/240", *FINER[1:]],
    "siconos": SECOND,
}
"""By the beginning of an integrator's name; of all others FIRST.  Steps of FINEST are for the fast top."""
TOLERANCES = ["1e-3", "1e-5", "1e-7", "1e-9"]
BODIES = {"generic-body": "10", "middle-axis": "10", "slow-lagrange": "10", "bruels-cardona-arnold": "2"}
"""Bodies and their horizons."""
ON = {
    "generic-body": ("mujoco", "mjx", "pinocchio", "exudyn", "drake", "dart", "pybullet", "siconos"),
    "middle-axis": ("mujoco", "pinocchio:RKMK4", "exudyn:RK44", "drake:RK3", "dart", "basilisk", "siconos"),
    "slow-lagrange": ("mujoco", "pinocchio:RKMK4", "exudyn:generalized", "drake:RK3", "pybullet"),
    "bruels-cardona-arnold": ("mujoco", "exudyn:generalized"),
}
"""The beginnings of the names that are measured on a body: all that have a joint on one, some on the others."""
FREE = "middle-axis"
HEYOKA = '  { integrator = "heyoka", tolerances = ["1e-3", "1e-6", "1e-9", "1e-12"] },'


def curve(name: str, setting: str, body: str) -> str:
    """The points of an integrator on a body."""
    steps = next((steps for head, steps in STEPS.items() if name.startswith(head)), FIRST)
    points = TOLERANCES if setting == "tolerance" else FINEST if body == "bruels-cardona-arnold" else steps
    return f'  {{ integrator = "{name}", {setting}s = {points} }},'.replace("'", '"')


def curves(body: str, horizon: str, commands: list[Command]) -> str:
    """Work against precision of those that are measured on a body, heyoka beside them; empty where there is none."""
    lines = [curve(each.name, each.setting, body) for each in commands if each.name.startswith(ON[body])]
    ladders = "\n".join([*lines, HEYOKA])
    table = f'[[measure]]\nkind = "work_precision"\ncases = ["{body}"]\nattitude = true\nhorizon = "{horizon}"\n'
    return f"{table}samples = 20\nladders = [\n{ladders}\n]\n" if lines else ""


def long(command: Command) -> str:
    """How the energy drifts, in a longer run at the step 1/100."""
    case = FREE if command.name.startswith("basilisk") else "slow-lagrange"
    return (
        f'[[measure]]\nkind = "drift"\ncases = ["{case}"]\nintegrator = "{command.name}"\nnoise = false\n'
        'step = "1/100"\nruns = [{ precision = "double", horizon = "100", samples = 100 }]\n'
    )


def plan(folder: Path, environments: dict[str, Path]) -> Path:
    """The plan, beside the adapters and their tables, in which each engine has its interpreter."""
    shutil.copytree(ADAPTERS / "adapters", folder, dirs_exist_ok=True)
    _, *tables = (ADAPTERS / "engines.toml").read_text("utf-8").split("\n[[")
    tops = ["[[" + table for table in tables if table.startswith("top]]")]
    commands = []
    for engine, environment in environments.items():
        table = folder / f"{engine}.toml"
        table.write_text(table.read_text("utf-8").replace("{python}", str(environment / "bin" / "python")), "utf-8")
        commands += commands_in(table)
    measures = [curves(body, horizon, commands) for body, horizon in BODIES.items()]
    measures += [long(each) for each in commands if each.setting == "step"]
    used = [top for top in tops if re.search(r'name = "(.*)"', top)[1] in "".join(measures)]  # type: ignore[index]
    files = ", ".join(f'"{engine}.toml"' for engine in environments)
    path = folder / "plan.toml"
    path.write_text("\n".join([f'name = "engines"\nintegrators = [{files}]\n', *used, *measures]), "utf-8")
    return path


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("environments", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--workers", default="1")
    parser.add_argument("--row-timeout", default="600", help="MJX compiles for minutes")
    asked = parser.parse_args()
    found = {}
    for each in asked.only or sorted(path.stem for path in (ADAPTERS / "adapters").glob("*.toml")):
        engine, _, environment = each.partition("=")
        if engine == "siconos" or (asked.environments / (environment or engine)).is_dir():
            found[engine] = (asked.environments / (environment or engine)).absolute()
    with tempfile.TemporaryDirectory() as folder:
        path = plan(Path(folder), found)
        sys.argv = ["heavytop", "run", "--plan", str(path), "--out", str(asked.out), "--workers", asked.workers]
        sys.argv += ["--row-timeout", asked.row_timeout]
        return int(command_line() or 0)


if __name__ == "__main__":
    raise SystemExit(main())
