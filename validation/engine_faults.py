"""One fault each in the adapters of engines: whether the row of a gate that is off names it, and accuses no right one.

    python -m validation.engine_faults ENVIRONMENTS [--only INTEGRATOR ...] [--faults WORDS ...]

ENVIRONMENTS as of `python -m validation.engines`.  The plan is that of `heavytop new --engine`, its finest step; a line
for each fault: the largest error, and what a row of the gate says of it.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

from heavytop.api.integrators import new_integrator
from heavytop.features.kinds import KINDS
from heavytop.features.score.explanation import explanation
from heavytop.harness.plan import read
from heavytop.harness.rows import Task, run_with_attitude
from heavytop.kind import FAR

FAULTY = """
import numpy as np
from heavytop_engine import matrix, quaternion


class Faulty(Engine):
{fault}


serve(f"""
ANSWER = """    def read(self):
        attitude, omega = super().read()
        q = attitude if len(attitude) == 4 else quaternion(attitude)
        return {answer}"""
STEP = """    taken = 0

    def advance(self, step, count):
        {taken}"""
BODY = """    def __init__(self, body):
        self.given = body
        body.{change}
        moments, axes = np.linalg.eigh(body.inertia)
        body.principal = moments, axes * np.sign(np.linalg.det(axes))
        super().__init__(body)"""
FAULTS = {
    "none": "    pass",
    "frame unsaid": ANSWER.format(answer="q, matrix(q) @ omega"),
    "conjugate": ANSWER.format(answer="np.array(q) * [1, -1, -1, -1], omega"),
    "w last": ANSWER.format(answer="np.roll(q, -1), omega"),
    "half a step": STEP.format(taken="super().advance(step, count - 1)")
    + """
        self.before = np.array(super().read()[1])
        super().advance(step, 1)

    def read(self):
        attitude, omega = super().read()
        return attitude, (omega + self.before) / 2""",
    "clock": STEP.format(taken="super().advance(0.8 * step, count)"),
    "one step too many": STEP.format(taken="super().advance(step, count + (not self.taken))\n        self.taken = 1"),
    "reset": BODY.format(change="mass *= 1")
    + "\n\n"
    + STEP.format(taken="self.taken += count\n        if 1.3 < self.taken * step < 1.5:")
    + """
            super().__init__(self.given)
        super().advance(step, count)""",
    "no gravity": BODY.format(change="gravity = 0.0"),
    "gravity reversed": BODY.format(change="gravity *= -1"),
    "weight 2 % off": BODY.format(change="gravity *= 1.02"),
    "centre reversed": BODY.format(change="centre = -body.centre"),
    "tensor about the other point": BODY.format(change="inertia = body.about_pivot"),
    "axes conjugated": BODY.format(change="inertia = body.principal[1].T * body.principal[0] @ body.principal[1]"),
    "a moment 1 % off": BODY.format(change="inertia[1, 1] *= 1.01"),
}
INTEGRATORS = ("mujoco:RK4", "mujoco:Euler", "exudyn:generalized-alpha", "exudyn:RK44", "pybullet")


def planted(folder: Path, integrator: str, faults: list[str], environments: Path) -> Iterator[tuple[str, Task]]:
    """The finest task of the gate of an integrator, its adapter with one fault after the other."""
    engine = integrator.partition(":")[0]
    new_integrator(folder, "python", engine=engine)
    adapter, table = folder / f"{engine}_top.py", folder / "engine.toml"
    program, declared = adapter.read_text("utf-8"), table.read_text("utf-8")
    python = str((environments / engine / "bin" / "python").absolute())
    for place, fault in enumerate(faults):
        text = program.replace("serve(f", FAULTY.format(fault=FAULTS[fault]), 1).replace(", Engine)", ", Faulty)")
        adapter.write_text(text, "utf-8")
        # another time limit is another program: it is started anew
        again = declared.replace("{python}", python).replace('timeout = "60"', f'timeout = "{60 + place}"')
        table.write_text(again, "utf-8")
        _, _, tasks = read(str(folder / "gate.toml"), KINDS)
        own = [task for task in tasks if task.key.kind == "work_precision" and task.key.subject.name == integrator]
        yield fault, own[-1]


def named(task: Task) -> tuple[float, str]:
    """The largest error of a run, and what explains it; empty where nothing does, or no row asks."""
    run, scorer = run_with_attitude(task)
    assert scorer.error is not None
    error = max(float(scorer.error.running[part].maximum) for part in ("omega", "gamma"))
    found = explanation(task.given, run, error) if error > FAR else None
    return error, "" if found is None else f"{found.kind}: {found.text}"


def main() -> int:
    """Returns 1 where a fault is not named, or an adapter as it is accused."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("environments", type=Path)
    parser.add_argument("--only", nargs="*", default=INTEGRATORS)
    parser.add_argument("--faults", nargs="*", default=list(FAULTS))
    given, wrong, count = parser.parse_args(), 0, 0
    for integrator in given.only:
        with tempfile.TemporaryDirectory() as name:
            for fault, task in planted(Path(name) / "top", integrator, given.faults, given.environments):
                error, said = named(task)
                wrong, count = wrong + ((fault == "none") == bool(said)), count + 1
                print(f"{integrator:25s} {fault:29s} {error:.1e} {said[:120]}", flush=True)
    print(f"{wrong} of {count} not as they should be")
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
