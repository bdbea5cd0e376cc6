"""Files with a key twice: JSON readers differ in which of the two they take, so neither is taken."""

import json
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.features.score.trajectories.files import read
from heavytop.records import SCHEMA, Report
from support.reports import store

MOTION = """{"inertia": ["2", "2", "1"], "weight": "1", "centre": [0, 0, 1], "omega": [0, 0, 1], "gamma": [0, 0, 1],
 "times": ["1"], "states": [["0", "0", "1", "0", "0", "1"]]}"""


@pytest.mark.parametrize("again", ['"weight": "1"', '"weight": "2"', '"times": ["1"]', '"flags": {"a": 1, "a": 2}'])
def test_a_trajectory_with_a_key_twice_is_refused(again: str, tmp_path: Path) -> None:
    file = tmp_path / "motion.json"
    file.write_text(MOTION)
    assert read(file).top.weight == 1
    file.write_text(MOTION[:-1] + f", {again}}}")
    with pytest.raises(ht.InputError, match=r"motion.json: The key '\w+' occurs twice"):
        read(file)


def test_a_comment_of_a_table_that_stands_twice_is_refused(tmp_path: Path) -> None:
    head = "# inertia: 2, 2, 1\n# weight: 1\n# centre: 0, 0, 1\n# omega: 0, 0, 1\n# gamma: 0, 0, 1\n# made: today\n"
    body = "t,omega1,omega2,omega3,gamma1,gamma2,gamma3\n1,0,0,1,0,0,1\n"
    file = tmp_path / "motion.csv"
    file.write_text(f"{head}# made: again\n{body}")
    assert read(file).top.weight == 1
    file.write_text(f"{head}# weight: 2\n{body}")
    with pytest.raises(ht.InputError, match="The key weight occurs twice"):
        read(file)


@pytest.mark.parametrize("place", ['"schema":', '"case":', '"value":'])
def test_a_report_with_a_key_twice_is_refused(place: str, tmp_path: Path) -> None:
    top, start = ht.HeavyTop((2, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 1), (0, 0, 1))
    score = ht.score([1], [start.flat], top=top, start=start)
    written = store.write(Report(SCHEMA, {"name": "score"}, {}, [score.row]), tmp_path)
    assert ht.read_report(tmp_path).rows[0].case == "given"
    text = written.read_text()
    value = json.JSONDecoder().raw_decode(text[text.index(place) + len(place) :])[0]
    other = tmp_path / "other.json"
    other.write_text(text.replace(place, f"{place}{json.dumps(value)},{place}", 1))
    json.loads(other.read_text())
    for reader in (store.read, store.read_brief):
        with pytest.raises(ht.InputError, match="occurs twice in one object"):
            reader(other)
