"""Adapters of engines of rigid bodies: what they are given, what `heavytop new --engine` writes, the real packages."""

import tomllib
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.api.integrators import engines, listing, new_integrator
from heavytop.cases import case
from heavytop.errors import InputError, Unsupported
from heavytop.exact.resolved import resolve
from heavytop.features.kinds import KINDS
from heavytop.features.score.diagnose.readings import of_states, simulate
from heavytop.features.score.explanation import explanation
from heavytop.harness.plan import read
from heavytop.integrate.peers.command import Command
from heavytop.integrate.registry import commands_in, ready
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import DOUBLE
from heavytop.top.bodies import CENTRE, Body
from heavytop.top.inertia_slips import MassProperties
from support.in_process import heavytop
from support.reports import asked, drift, plan_file, table

ADAPTERS = Path(ht.__file__).parent / "features" / "engines" / "adapters"
PACKAGES = {"mujoco": "mujoco", "pinocchio": "pinocchio", "exudyn": "exudyn"}
ASKED = Command(name="engine", command=("x",), setting="step", bodies=True, attitude="quaternion")
STAND_IN = """
import numpy as np
from heavytop_engine import serve

class Engine:
    def __init__(self, body):
        self.body, self.q, self.w = body, body.quaternion, body.omega

    def slope(self, q, w):
        b, up = self.body, 2 * np.array([q[1] * q[3] - q[0] * q[2], q[2] * q[3] + q[0] * q[1], q[0]**2 / 2 + q[3]**2 / 2
            - q[1]**2 / 2 - q[2]**2 / 2])
        torque = np.cross(b.about_pivot @ w, w) + b.mass * b.gravity * np.cross(up, b.centre)
        rate = np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]) / 2
        return np.concatenate([rate, np.linalg.solve(b.about_pivot, torque)])

    def advance(self, h, n):
        y = np.concatenate([self.q, self.w])
        for _ in range(n):
            k1 = self.slope(y[:4], y[4:])
            k2 = self.slope(*np.split(y + h / 2 * k1, [4]))
            k3 = self.slope(*np.split(y + h / 2 * k2, [4]))
            k4 = self.slope(*np.split(y + h * k3, [4]))
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.q, self.w = np.split(y, [4])

    def read(self):
        print("an engine that prints")
        return self.q, self.w

    def pivot(self):
        return 3e-7, 0, 4e-7

serve("Stand-in 1", Engine)
"""


def body_lines(top: ht.HeavyTop, start: ht.State) -> dict[str, list[Fraction]]:
    text = ASKED.request(Problem.of(top, start, DOUBLE), [Fraction(1)], Fraction(1, 100)).text(1).decode()
    words = [line.split()[1:] for line in text.splitlines() if line.startswith("body ")]
    return {name: list(map(Fraction, values)) for name, *values in words}


@pytest.mark.parametrize("name", ["bruels-cardona-arnold", "lagrange", "generic", "euler", "t-handle", "kowalewski"])
def test_the_body_of_a_request_has_the_moments_and_the_weight_of_the_top(name: str) -> None:
    top, body = case(name).top, body_lines(case(name).top, case(name).start)
    central = MassProperties(tuple(body["inertia"]), body["mass"][0], tuple(body["centre"])).central
    found = Body(body["mass"][0], body["gravity"][0], body["centre"], [v for row in central for v in row], CENTRE)
    scale = max(top.inertia)
    expected = [[top.inertia[i] if i == j else 0 for j in range(3)] for i in range(3)]
    off = [abs(a - b) for one, two in zip(found.tensor, expected, strict=True) for a, b in zip(one, two, strict=True)]
    assert max(off) <= 8 * DOUBLE.eps * scale
    assert max(abs(a - b) for a, b in zip(found.moment, top.moment, strict=True)) <= 8 * DOUBLE.eps * (abs(top.weight))


def test_the_mass_of_a_body_is_its_own_and_a_top_without_one_gets_a_light_body() -> None:
    assert body_lines(case("bruels-cardona-arnold").top, case("bruels-cardona-arnold").start)["mass"] == [15]
    top = ht.HeavyTop((1, 1, "1/4"), 10**6, (0, 0, 3))
    body = Body.realising(top)
    assert body is not None
    assert body.mass * 9 <= Fraction(1, 4) / 64
    assert body.weight == 10**6


GENERIC = next(task.given for task in read("engines", KINDS)[2] if task.given.name == "generic-body")


def test_a_body_in_other_axes_keeps_its_mass() -> None:
    lines = body_lines(GENERIC.top, GENERIC.start)
    assert (lines["mass"], float(lines["gravity"][0])) == ([2], 9.81)


FAULTS = {
    "steiner": lambda data: replace(data, inertia=data.tensor),
    "top": lambda data: replace(data, inertia=data.inertia * (1 + np.diag([0, 0.01, 0]))),
}


def faulty(fault: str) -> Trajectory:
    """The run of an adapter with that fault, without an error of its own."""
    times = [Fraction(k, 5) for k in range(1, 11)]
    xi = resolve(GENERIC.body, GENERIC.given_start).xi
    problem = Problem.of(GENERIC.top, GENERIC.start, DOUBLE, xi=xi)
    seen = of_states(GENERIC.top, GENERIC.start, times, [[Fraction(1)] * 9], xi)
    course = simulate(
        FAULTS.get(fault, lambda data: data)(seen.body),
        seen.start.begin(seen.declared, seen.body.tensor),
        tuple(map(float, times)),
    )
    rotation = course.rotation.transpose(0, 2, 1) if fault == "conjugate" else course.rotation
    states = np.hstack([course.omega, rotation[:, 2], rotation[:, 0]])
    return Trajectory(
        problem, "engine", times, states, Outcome.SUCCESS, times[-1], 800, 4, {"run": 1.0}, {"step": "1/400"}
    )


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["conjugate", *FAULTS])
def test_a_fault_of_an_adapter_is_named_in_its_row(fault: str) -> None:
    assert explanation(GENERIC, faulty(fault), 1.0).kind == fault


@pytest.mark.parametrize(
    "top", [ht.HeavyTop((5, 2, 1), 1, (0, 0, 1)), case("simo-wong").top, ht.HeavyTop((1, 1, 2), 1, (0, 0, 1))]
)
def test_moments_that_no_body_has_are_unsupported(top: ht.HeavyTop) -> None:
    with pytest.raises(Unsupported, match="needs a rigid body"):
        body_lines(top, ht.State((1, 0, 0), (0, 0, 1)))


def test_programs_that_declare_no_bodies_are_sent_none() -> None:
    plain = Command(name="plain", command=("x",), setting="step")
    text = plain.request(Problem.of(case("lagrange").top, case("lagrange").start, DOUBLE), [], None).text(1)
    assert b"body" not in text


def test_list_says_which_cases_a_body_has() -> None:
    listed = {each["name"]: each["realisable"] for part in ("cases", "bodies") for each in listing()[part]}
    assert (listed["lagrange"], listed["simo-wong"], listed["t-handle"]) == (True, False, True)
    assert "no rigid body has these moments" in " ".join(heavytop("list").stdout.split())


WORKFLOW = ".github/workflows/heavytop.yml"


@pytest.mark.parametrize("engine", engines())
def test_the_folder_of_an_engine_is_a_gate(engine: str, tmp_path: Path) -> None:
    files = new_integrator(tmp_path / "new", "python", engine=engine)
    adapter = f"{engine}_top.py"
    assert {adapter, "heavytop_engine.py", "engine.toml", "gate.toml", "README.md", WORKFLOW} == set(files)
    assert "integrator: engine.toml:" in (tmp_path / "new" / WORKFLOW).read_text()
    lines = (tmp_path / "new" / adapter).read_text().splitlines()
    code = [line for line in lines if line.strip() and not line.strip().startswith('"""')]
    assert len(code) <= 50
    assert len((tmp_path / "new" / "README.md").read_text().splitlines()) <= 10
    assert "pip install" in (tmp_path / "new" / "README.md").read_text() or engine == "siconos"
    _, _, tasks = read(str(tmp_path / "new" / "gate.toml"), KINDS)
    asked = {task.key.subject.name for task in tasks}
    assert asked == {table["name"] for table in tomllib.loads((ADAPTERS / f"{engine}.toml").read_text())["integrator"]}


def test_an_unknown_engine_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must have an adapter"):
        new_integrator(tmp_path / "new", "python", engine="unity")


@pytest.mark.slow
def test_an_adapter_is_measured_as_its_engine_is(tmp_path: Path) -> None:
    (tmp_path / "engine.py").write_text(STAND_IN)
    (tmp_path / "heavytop_engine.py").write_text((ADAPTERS / "heavytop_engine.py").read_text())
    made = {"name": "stand-in", "command": ["{python}", "engine.py"], "setting": "step", "order": 4}
    made |= {"directions": ["forward"], "bodies": True, "attitude": "quaternion"}
    (tmp_path / "engine.toml").write_text(table("integrator", **made))
    body = {"name": "body", "mass": "2", "gravity": "9.81", "centre": ["0.3", "-0.2", "0.4"]}
    body |= {"inertia": ["1.2", "0.9", "0.6"], "about": "centre of mass", "omega": ["1", "2", "6"]}
    ladders = [{"integrator": "stand-in", "steps": ["1/50", "1/100"]}]
    work = asked("work_precision", "body", attitude=True, horizon="1", samples=4, ladders=ladders)
    runs = {"noise": False, "step": "1/100", "integrator": "stand-in", "runs": [("double", "1", 4)]}
    tables = table("top", **body, quaternion=["0.8", "0", "0.6", "0"]) + work + drift("body", attitude=True, **runs)
    plan = plan_file(tmp_path, f'integrators = ["engine.toml"]\n{tables}')
    done = heavytop("run", "--plan", plan, "--out", str(tmp_path / "out"), "--workers", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    coarse, fine, drifting = ht.read_report(tmp_path / "out").rows
    errors = [float(row.metrics["error_max"]) for row in (coarse, fine)]
    assert 12 < errors[0] / errors[1] < 20
    assert float(fine.metrics["joint_violation_max"]) == pytest.approx(5e-7, rel=1e-6)
    for name in ("attitude_error_max", "position_error_max"):
        assert 0 < float(fine.metrics[name]) < 1e-5
        assert float(drifting.metrics[name]) == pytest.approx(float(fine.metrics[name]), rel=0.1)
    assert drifting.key.subject.step == "1/100"
    assert drifting.key.subject.version == "1"


@pytest.mark.slow
@pytest.mark.parametrize("engine", PACKAGES)
def test_the_real_engine_keeps_the_motion(engine: str, tmp_path: Path) -> None:
    pytest.importorskip(PACKAGES[engine])
    top = case("lagrange").top
    for command in commands_in(ADAPTERS / f"{engine}.toml"):
        integrate = ready(command, ("step", Fraction(1, 1000)))
        run = integrate(top, case("lagrange").start, [Fraction(1)], DOUBLE)
        known = ht.reference(top, case("lagrange").start, [1], digits=20).to_numpy()
        assert abs(run.states[-1] - known[-1]).max() < (0.05 if command.order == 1 else 1e-3)
