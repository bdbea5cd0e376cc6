"""The reference pack: its schema, its numbers made again, and its readers in other languages."""

import json
import re
import shutil
import subprocess
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import reference_pack
from heavytop.precision import exact

PACK = Path(__file__).parents[2] / "results" / "reference"
EXAMPLES = Path(__file__).parents[2] / "examples"
DOCUMENT = json.loads((PACK / "pack.json").read_text("utf-8"))
SCHEMA = json.loads((PACK / "pack.schema.json").read_text("utf-8"))
KINDS = {"object": dict, "array": list, "string": str, "integer": int}


def faults(value: Any, schema: dict[str, Any], where: str = "$") -> list[str]:
    """Where a document breaks a schema, as far as the words of this one go."""
    known = {"$schema", "title", "type", "required", "properties", "additionalProperties", "items", "minItems"}
    assert schema.keys() <= known | {"maxItems", "pattern", "const"}
    found = []
    if "const" in schema and value != schema["const"]:
        found.append(f"{where} is {value!r}")
    if "type" in schema and not isinstance(value, KINDS[schema["type"]]):
        return [f"{where} is no {schema['type']}"]
    if "pattern" in schema and not re.search(schema["pattern"], value):
        found.append(f"{where} = {value!r}")
    if isinstance(value, dict):
        found += [f"{where} lacks {key}" for key in schema.get("required", ()) if key not in value]
        for key, part in value.items():
            if key in schema.get("properties", {}):
                found += faults(part, schema["properties"][key], f"{where}.{key}")
            elif schema.get("additionalProperties") is False:
                found.append(f"{where} has {key}")
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            found.append(f"{where} has {len(value)} items")
        for place, part in enumerate(value):
            found += faults(part, schema.get("items", {}), f"{where}[{place}]")
    return found


def test_the_pack_keeps_its_schema() -> None:
    assert json.loads(json.dumps(reference_pack.schema())) == SCHEMA
    assert faults(DOCUMENT, SCHEMA) == []


@pytest.mark.slow
def test_a_spoilt_pack_breaks_the_schema() -> None:
    for spoil in (
        lambda document, motion: document.update(version="2.0.0"),
        lambda document, motion: motion["omega"][4][1].update(value="nan"),
        lambda document, motion: motion["data"].pop("xi"),
        lambda document, motion: motion["quaternion"][7].pop(),
        lambda document, motion: document.update(motions=document["motions"][:19]),
    ):
        document = json.loads(json.dumps(DOCUMENT))
        spoil(document, document["motions"][3])
        assert len(faults(document, SCHEMA)) == 1


def test_the_pack_has_every_motion_at_fifty_times_to_forty_digits() -> None:
    assert [motion["name"] for motion in DOCUMENT["motions"]] == [case.name for case, _ in reference_pack.motions()]
    assert len(DOCUMENT["motions"]) >= 20
    for motion in DOCUMENT["motions"]:
        for name in ("times", "omega", "gamma", "quaternion", "position"):
            assert len(motion[name]) == reference_pack.TIMES
        for name in ("omega", "gamma", "quaternion"):
            balls = [(Fraction(ball["value"]), Fraction(ball["radius"])) for row in motion[name] for ball in row]
            assert all(radius <= Fraction(1, 10**40) * max(1, abs(value)) for value, radius in balls)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["bruels-cardona-arnold", "full-tensor", "flywheel-gyroscope", "lagrange", "steklov", "dokshevich"]
)
def test_what_is_committed_is_what_the_command_makes(name: str) -> None:
    """Two times of a motion, made again: the same text."""
    case, last = next((case, last) for case, last in reference_pack.motions() if case.name == name)
    kept = next(motion for motion in DOCUMENT["motions"] if motion["name"] == name)
    made, _ = reference_pack.entry(case, last, times=2)
    assert made["data"] == kept["data"]
    assert made["method"] == kept["method"]
    for place, other in enumerate((24, 49)):
        assert made["times"][place] == kept["times"][other]
        for quantity in ("omega", "gamma", "position"):
            assert [[ball.value, ball.radius] for ball in made[quantity][place]] == [
                [ball["value"], ball["radius"]] for ball in kept[quantity][other]
            ]
        signs = {
            float(a.value) * float(b["value"]) >= 0
            for a, b in zip(made["quaternion"][place], kept["quaternion"][other], strict=True)
        }
        assert len(signs) == 1  # of two times alone the sign may go on otherwise


def test_a_table_holds_the_nearest_doubles_as_decimal_and_as_hexadecimal_text() -> None:
    for motion in DOCUMENT["motions"]:
        lines = (PACK / "csv" / f"{motion['name']}.csv").read_text("utf-8").splitlines()
        assert lines[0].startswith("t,t_hex,omega1,omega1_hex")
        for place in (0, 49):
            cells = lines[1 + place].split(",")
            balls = [ball for key in ("omega", "gamma", "quaternion", "position") for ball in motion[key][place]]
            wanted = [float(exact(motion["times"][place])), *(float(Fraction(ball["value"])) for ball in balls)]
            assert [float(cell) for cell in cells[::2]] == wanted
            assert [float.fromhex(cell) for cell in cells[1::2]] == wanted


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_twenty_lines_of_c_read_a_table(tmp_path: Path) -> None:
    subprocess.run(["cc", "-o", tmp_path / "read", EXAMPLES / "read_pack.c"], check=True)
    table = PACK / "csv" / "full-tensor.csv"
    done = subprocess.run([tmp_path / "read", table], check=True, capture_output=True, text=True)
    motion = next(motion for motion in DOCUMENT["motions"] if motion["name"] == "full-tensor")
    assert len(done.stdout.splitlines()) == reference_pack.TIMES
    told = [float(part) for part in done.stdout.splitlines()[-1].split("q = ")[1].split()]
    assert told == [float(Fraction(ball["value"])) for ball in motion["quaternion"][-1]]


@pytest.mark.skipif(shutil.which("node") is None, reason="needs Node.js")
def test_a_dozen_lines_of_javascript_read_the_pack() -> None:
    command = ["node", EXAMPLES / "read_pack.js", PACK / "pack.json", "bruels-cardona-arnold"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    last = [float(part) for part in done.stdout.splitlines()[-1].split()]
    assert last[0] == 2
    motion = next(motion for motion in DOCUMENT["motions"] if motion["name"] == "bruels-cardona-arnold")
    assert last[-3:] == [float(Fraction(ball["value"])) for ball in motion["position"][-1]]
