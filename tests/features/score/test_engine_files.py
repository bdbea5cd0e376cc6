"""Files of engines of low order and of rotated bodies: one mistake named, right files not accused, in the axes of the
file; the joint and the clock measured by themselves.
"""

import importlib.util
import json
import random
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from heavytop.features.score.measurement import Assessment
from heavytop.features.score.text import to_json

FILE = Path(__file__).parents[3] / "validation" / "engine_files.py"
SPEC = importlib.util.spec_from_file_location("engine_files", FILE)
engine_files = importlib.util.module_from_spec(SPEC)
sys.modules["engine_files"] = engine_files
SPEC.loader.exec_module(engine_files)
Log = engine_files.Log

COARSE = replace(engine_files.random_engine(random.Random(5), "semi-implicit Euler"), step=1e-3, every=50, samples=12)
FINE = replace(COARSE, method="Munthe-Kaas", step=0.005, every=40, omega=np.array([0.7, -0.4, 3.0]))
VECTORS = ("omega", "gamma")


def scored(engine: "engine_files.Engine", log: "engine_files.Log", tmp_path: Path) -> Assessment:
    found = engine_files.scored(engine_files.written(engine, log), tmp_path)
    json.dumps(to_json(found), allow_nan=False)
    return found


def kinds(found: Assessment) -> list[str]:
    return [each.kind for each in found.diagnoses if each.kind != "columns_disagree"]


def test_a_method_of_first_order_is_not_accused(tmp_path: Path) -> None:
    found = scored(COARSE, Log(), tmp_path)
    assert (kinds(found), found.digits_right < 4) == ([], True)


@pytest.mark.parametrize("mistake", ["frame unsaid", "no gravity", "tensor about the other point"])
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


FRAMES = {
    "principal": replace(FINE, tensor=np.diag([1.2, 0.9, 0.6]), centre=np.array([0.0, 0.0, 0.4])),
    "rotated": FINE,
}
IN_FILE = {
    "start": (Log(VECTORS, keys={"omega": "0.701,-0.4,3"}), {"Ω1": "0.7"}),
    "column_constant": (column(1, lambda value: 0.25), {"column": "Ω2", "value": "0.25"}),
    "column_scaled": (column(1, lambda value: 1.02 * value), {"column": "Ω2", "factor": "1.02"}),
    "axes_permuted": (Log(VECTORS, spoil=engine_files.each(lambda w: w[[1, 0, 2]], "omega")), {"of": "omega"}),
    "no_gravity": (Log(VECTORS, keys={"gravity": "0.001"}), None),
}


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("kind", IN_FILE)
def test_everything_is_said_in_the_axes_of_the_file(kind: str, frame: str, tmp_path: Path) -> None:
    log, numbers = IN_FILE[kind]
    engine = FRAMES[frame]
    if kind == "no_gravity":
        engine, log = replace(engine, gravity=0.0), Log(VECTORS, keys={"gravity": "9.81"})
    (told,) = scored(engine, log, tmp_path).diagnoses
    assert told.kind == kind
    for name, value in (numbers or {}).items():
        assert told.numbers[name] == value or float(told.numbers[name]) == pytest.approx(float(value), rel=1e-6)


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
