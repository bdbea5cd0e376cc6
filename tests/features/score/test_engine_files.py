"""Files of engines of low order and of rotated bodies: one mistake named, right files not accused, in the axes of the
file; the joint and the clock measured by themselves.
"""

import json
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import engine_files
from engine_files import Log
from heavytop.features.score.measurement import Assessment
from heavytop.features.score.text import to_json

COARSE = replace(engine_files.random_engine(random.Random(5), "semi-implicit Euler"), step=1e-3, every=50, samples=12)
FINE = replace(COARSE, method="Munthe-Kaas", step=0.005, every=40, omega=np.array([0.7, -0.4, 3.0]))
VECTORS, QUATERNION = ("omega", "gamma"), ("quaternion",)


def scored(engine: "engine_files.Engine", log: "engine_files.Log", tmp_path: Path) -> Assessment:
    found = engine_files.scored(engine_files.written(engine, log), tmp_path)
    json.dumps(to_json(found), allow_nan=False)
    return found


def kinds(found: Assessment) -> list[str]:
    return [each.kind for each in found.diagnoses if each.kind != "columns_disagree"]


def test_a_method_of_first_order_is_not_accused(tmp_path: Path) -> None:
    found = scored(COARSE, Log(), tmp_path)
    assert (kinds(found), found.digits_right < 4) == ([], True)


def test_another_unit_of_g_is_no_name_for_moments_that_are_off(tmp_path: Path) -> None:
    engine = replace(FINE, gravity=1.0)
    log = Log(keys={"inertia": engine_files.six(engine.about_pivot() * 0.999), "about": "pivot"})
    assert "gravity_unit" not in kinds(scored(engine, log, tmp_path))


@pytest.mark.parametrize("mistake", ["frame unsaid", "no gravity", "free", "tensor about the other point"])
def test_a_mistake_in_a_file_of_first_order_is_named(mistake: str, tmp_path: Path) -> None:
    named, build = engine_files.MISTAKES[mistake]
    assert set(kinds(scored(*build(COARSE), tmp_path))) & set(named)


def column(place: int, change: "engine_files.Change") -> "engine_files.Log":
    """One component of Ω changed in every row but the start."""

    def spoil(columns: dict, _: object) -> dict:
        rows = [np.array(row) for row in columns["omega"]]
        for row in rows:
            row[place] = change(row[place])
        return columns | {"omega": rows}

    return Log(VECTORS, spoil=spoil)


def of_columns(change: "engine_files.Change", *names: str) -> "engine_files.Log":
    """Ω and γ, or quaternions alone, of which those of these names are changed in every row."""
    return Log(VECTORS if names != QUATERNION else QUATERNION, spoil=engine_files.each(change, *names))


def one_step_late(steps: list[int], h: float) -> list[float]:
    """Times of which the first alone is right."""
    return [0.0, *((n - 1) * h for n in steps[1:])]


def frozen(rows: list[np.ndarray]) -> list[np.ndarray]:
    return rows[:8] + 5 * rows[8:9]


def last_turned(columns: dict, _: object) -> dict:
    """The last quaternion turned by 0.002."""
    w, x, y, z = columns["quaternion"][-1]
    return {
        "quaternion": [*columns["quaternion"][:-1], np.array([w - 1e-3 * x, x + 1e-3 * w, y + 1e-3 * z, z - 1e-3 * y])]
    }


RIGHT = {"inertia": engine_files.six(FINE.tensor)}
"""What a file says of an engine that has another tensor about the centre of mass."""
STEINER = FINE.about_pivot() - FINE.tensor
I12_TURNED = np.array([[1, -1, 1], [-1, 1, 1], [1, 1, 1]])
NED = engine_files.each(lambda position: position * [1, -1, -1], "position")
I11_I22 = FINE.tensor + (FINE.tensor[1, 1] - FINE.tensor[0, 0]) * np.diag([1, -1, 0])
TURNED = FINE.rotation @ engine_files.exponential(np.array([-0.6, 0.2, -0.6]))
START = engine_files.text(engine_files.quaternion(TURNED))
IN_FILE = [
    ("", FINE, Log(), {}),
    ("start", FINE, Log(VECTORS, keys={"omega": "0.701,-0.4,3"}), {"Ω1": "0.7"}),
    ("start", FINE, Log(QUATERNION, keys={"start_quaternion": START}), {}),
    ("start", FINE, Log(("omega",), keys={"omega": "0.71,-0.4,3"}), {"angle": "0"}),  # about the vertical: any fits
    ("", replace(COARSE, step=2e-4, every=2), Log(("position",)), {}),
    ("", replace(COARSE, step=0.01, every=5), of_columns(lambda q: np.round(q, 2), *QUATERNION), {}),
    ("column_constant", FINE, column(1, lambda value: 0.25), {"column": "Ω2", "value": "0.25"}),
    ("column_scaled", FINE, column(1, lambda value: 1.02 * value), {"column": "Ω2", "factor": "1.02"}),
    ("axes_permuted", FINE, of_columns(lambda w: w[[1, 0, 2]], "omega"), {"of": "omega"}),
    ("no_gravity", replace(FINE, gravity=0.0), Log(VECTORS, keys={"gravity": "9.81"}), {}),
    ("gamma_down", FINE, of_columns(np.negative, "gamma"), {"of": "columns"}),
    ("omega_reversed", FINE, of_columns(np.negative, "omega"), {"of": "columns"}),
    ("omega_reversed+gamma_down", FINE, of_columns(np.negative, *VECTORS), {"of": "columns"}),
    ("omega_in_degrees", FINE, of_columns(np.degrees, "omega"), {"of": "columns"}),
    ("omega_scaled", FINE, of_columns(lambda w: 1.1 * w, "omega"), {"factor": "1.1"}),
    ("gamma_scaled", FINE, of_columns(lambda gamma: 1.1 * gamma, "gamma"), {"factor": "1.1"}),
    ("column_order", FINE, of_columns(lambda gamma: gamma[[1, 0, 2]] * [1, -1, 1], "gamma"),
     {"columns": "Ω1, Ω2, Ω3, γ2, −γ1, γ3"}),
    ("momentum", FINE, of_columns(lambda w: FINE.about_pivot() @ w, "omega"), {"of": "columns"}),
    ("columns_swapped", FINE,
     Log(VECTORS, spoil=lambda columns, _: {"omega": columns["gamma"], "gamma": columns["omega"]}), {}),
    ("gyroscopic_sign", replace(FINE, gyroscopic=-np.ones(3), rotor=np.array([0.4, -0.2, 0.3])),
     Log(keys={"rotor": "0.4, -0.2, 0.3"}), {}),
    ("gyroscopic_missing", replace(FINE, gyroscopic=np.zeros(3)), Log(), {}),
    ("term_missing", replace(FINE, gyroscopic=np.array([1, 0, 1])), Log(),
     {"column": "M2", "term": "the gyroscopic term"}),
    ("steiner", replace(FINE, tensor=FINE.tensor + STEINER), Log(keys=RIGHT), {"times": "2"}),
    ("products_of_inertia", replace(FINE, tensor=FINE.tensor * I12_TURNED), Log(keys=RIGHT), {"entries": "I12"}),
    ("mass", replace(FINE, mass=FINE.mass / 2), Log(QUATERNION, keys={"mass": repr(FINE.mass)}), {"factor": "0.5"}),
    ("inertia_unit", FINE, Log(QUATERNION, keys={"mass": repr(1000 * FINE.mass)}), {"factor": "1e3", "or": "mass"}),
    ("gravity", replace(FINE, gravity=9.80665), Log(QUATERNION, keys={"gravity": "9.81"}), {"gravity": "9.80665"}),
    ("inertia_axes", replace(FINE, tensor=I11_I22), Log(QUATERNION, keys=RIGHT), {"entries": "I11, I22, I33"}),
    ("space_axes", FINE, Log((*QUATERNION, "position"), spoil=NED), {"entries": "positions"}),
    ("omega_reversed", FINE, Log(times=lambda steps, h: [-n * h for n in steps]), {"or": "time_reversed"}),
    ("times_shifted", FINE, Log(QUATERNION, keys={"start_quaternion": ""}, times=one_step_late), {"shift": "+ 0.005"}),
    ("omega_scaled", FINE, of_columns(np.radians, "omega"), {"factor": "π/180"}),
    ("times_shifted", FINE, Log(QUATERNION, times=lambda steps, h: [n * h - 0.07 for n in steps]), {"shift": "0.07"}),
    ("frozen", FINE, Log(spoil=lambda columns, _: columns | {"quaternion": frozen(columns["quaternion"])}),
     {"vector": "γ"}),
    ("omega_in_degrees", FINE, Log(QUATERNION, keys={"omega": engine_files.text(np.degrees(FINE.omega))}),
     {"of": "start"}),
    ("time_unit", replace(FINE, every=10),  # a reference of a thousand times its horizon is computed
     Log(("position",), times=lambda steps, h: [1000 * n * h for n in steps]), {"factor": "0.001"}),
    ("time_unit", replace(FINE, samples=8),  # of which the reference reaches the start alone
     Log(QUATERNION, keys={"start_quaternion": ""}, times=lambda steps, h: [1000 * n * h for n in steps]),
     {"factor": "0.001"}),
    ("time_unit", FINE, Log(QUATERNION, times=lambda steps, h: [10**6 * n * h for n in steps]), {"factor": "1e-06"}),
    ("one_state", FINE, Log(QUATERNION, spoil=last_turned), {"state": "12 of 12"}),
    ("column_scaled", FINE, of_columns(lambda q: q * [1, 1, -1, 1], *QUATERNION),
     {"column": "y of the quaternion", "factor": "−1"}),
    ("column_order", FINE, of_columns(lambda q: q[[0, 1, 3, 2]], *QUATERNION),
     {"columns": "y of the quaternion and z of the quaternion"}),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "engine", "log", "numbers"), IN_FILE, ids=[kind for kind, *_ in IN_FILE])
def test_everything_is_said_in_the_axes_of_the_file(kind, engine, log, numbers, tmp_path: Path) -> None:
    told = scored(engine, log, tmp_path).diagnoses
    assert [each.kind for each in told] == ([kind] if kind else [])
    assert all(each.numbers.items() >= numbers.items() for each in told)


def test_the_joint_is_measured_without_a_contradiction(tmp_path: Path) -> None:
    drift = engine_files.each(lambda position: position + 1e-3, "position")
    found = scored(FINE, Log(("quaternion", "position"), spoil=drift), tmp_path)
    assert "columns_disagree" not in [each.kind for each in found.diagnoses]
    assert float(found.row.metrics["joint_violation_max"]) == pytest.approx(1e-3 * 3**0.5, rel=1e-3)


def test_a_clock_that_adds_its_steps_up_is_named_and_the_digits_without_it(tmp_path: Path) -> None:
    fine = replace(FINE, step=0.002, every=100)
    right, found = (scored(fine, Log(times=times), tmp_path) for times in (Log().times, engine_files.sum_of_steps))
    assert found.diagnoses[0].kind == "clock"
    assert found.diagnoses[0].numbers["digits"] == f"{right.digits_right:.1f}"
    assert found.digits_right < right.digits_right - 0.05


@pytest.mark.parametrize("digits", [6, 24])
def test_rounded_quaternions_are_said_to_be_rounded(digits: int, tmp_path: Path) -> None:
    change = (lambda q: np.round(q, digits)) if digits == 6 else (lambda q: np.float32(q).astype(float))
    fine = replace(FINE, step=0.002, every=100)
    found = scored(fine, Log(("quaternion",), spoil=engine_files.each(change, "quaternion")), tmp_path)
    assert [each.kind for each in found.diagnoses] == ["rounded"]


@pytest.mark.parametrize(("engine", "mistake"), [(FINE, "half a step early"), (COARSE, "axes conjugated")])
def test_half_a_step_early_and_conjugated_axes_are_named(
    engine: "engine_files.Engine", mistake: str, tmp_path: Path
) -> None:
    named, build = (engine_files.MISTAKES | engine_files.SECOND)[mistake]
    assert tuple(kinds(scored(*build(engine), tmp_path))) == named


def test_a_rounded_quaternion_of_the_start_leaves_the_error_of_the_attitude_resolved(tmp_path: Path) -> None:
    lines = engine_files.written(FINE, Log()).splitlines()
    start = engine_files.text([0.0, *engine_files.quaternion(FINE.rotation), *FINE.omega])
    lines.insert(1 + next(n for n, line in enumerate(lines) if line.startswith("t,")), start)
    without, found = (
        engine_files.scored(text, tmp_path) for text in (engine_files.written(FINE, Log()), "\n".join(lines))
    )
    for statistic in ("max", "rms"):
        error = found.row.metrics[f"attitude_error_{statistic}"]
        assert error.bound is None
        assert float(error) == pytest.approx(float(without.row.metrics[f"attitude_error_{statistic}"]), rel=0.1)
