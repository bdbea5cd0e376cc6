"""Motions computed elsewhere: scored like our own, read with suspicion."""

import io
import json
import math
import os
import re
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.cases import CASES
from heavytop.errors import InputError
from heavytop.features.score import measurement
from heavytop.features.score.diagnose import samples
from heavytop.features.score.measurement import assess, measured
from heavytop.features.score.trajectories.files import read
from heavytop.measure.motion import compute
from heavytop.measure.scalar import digits_kept
from heavytop.precision import DOUBLE, EXTENDED, QUAD, exact, real
from support.in_process import heavytop

DOCS = Path(__file__).parents[3] / "docs"
LAGRANGE = CASES["lagrange"]
TIMES = [Fraction(1, 3), Fraction(2), Fraction(7)]
HEADER = "t,omega1,omega2,omega3,gamma1,gamma2,gamma3"


def document(precision=DOUBLE, case=LAGRANGE, times=TIMES) -> dict:
    return json.loads(json.dumps(compute(case.top, case.start, times, precision, case.system).to_json()))


def written(tmp_path: Path, given: dict, name: str = "motion.json") -> Path:
    file = tmp_path / name
    file.write_text(json.dumps(given), "utf-8")
    return file


def as_csv(given: dict, number=str) -> str:
    keys = ("precision", "system", "integrator", "weight", "steps")
    lines = [f"# {key}: {given[key]}" for key in keys if key in given]
    lines += [f"# {key}: {', '.join(given[key])}" for key in ("inertia", "centre", "omega", "gamma")]
    rows = zip(given["times"], given["states"], strict=True)
    return "\n".join([*lines, HEADER, *(",".join([t, *map(number, state)]) for t, state in rows)]) + "\n"


def row_of(tmp_path: Path, given: dict):
    return measured(read(written(tmp_path, given))).row


@pytest.mark.slow
@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, QUAD, real(160)], ids=lambda p: p.name)
def test_our_own_motion_scores_as_it_scored_itself(precision, tmp_path: Path) -> None:
    given = document(precision)
    row = row_of(tmp_path, given)
    ours = {name: metric["value"] for name, metric in given["metrics"].items()}
    assert ours == {name: m.value for name, m in row.metrics.items() if name.startswith("drift_")}
    assert (row.outcome, row.precision, row.steps) == ("success", precision.name, given["steps"])
    error = exact(row.metrics["solution_error_omega_max"].value)
    assert precision.eps / 100 < error < 100 * precision.eps
    assert "Lagrange" in row.against
    assert digits_kept(row) > 0.9 * precision.bits * 0.301 - 1


@pytest.mark.slow
def test_times_beyond_the_reach_of_heyoka_take_few_of_its_steps(monkeypatch, tmp_path: Path) -> None:
    limits, motions = [], []
    propagate, states_at = measurement.propagate, samples.states_at
    watched = lambda *given, **options: limits.append(options["step_limit"]) or propagate(*given, **options)  # noqa: E731
    monkeypatch.setattr(measurement, "propagate", watched)
    monkeypatch.setattr(samples, "states_at", lambda *given: motions.append(1) or states_at(*given))
    given = document()
    given["times"] = [f"{time}e140" for time in ("1.3", "2", "7.1")]
    given["states"] = [[row[i] for i in (0, 3, 1, 4, 2, 5)] for row in given["states"]]
    scored = assess(read(written(tmp_path, given)))
    assert (scored.digits_right, scored.peer, scored.diagnoses) == (0, None, [])
    assert max(limits) < measurement._EFFORT / 1e-6 / 40
    assert len(motions) < 20


def test_a_known_mistake_is_measured(tmp_path: Path) -> None:
    given = document(QUAD)
    off = exact(given["states"][1][3]) + Fraction(1, 10**9)
    given["states"][1][3] = str(float(off))
    row = row_of(tmp_path, given)
    np.testing.assert_allclose(float(row.metrics["solution_error_gamma_max"].value), 1e-9, rtol=1e-5)
    assert float(row.metrics["solution_error_gamma_final"].value) < 1e-30
    assert digits_kept(row) == 9


@pytest.mark.parametrize("number", [str, lambda text: float(text).hex(), lambda text: repr(float(text))])
def test_csv_and_json_decimal_and_hexadecimal_say_the_same(number, tmp_path: Path) -> None:
    given = document()
    (tmp_path / "motion.csv").write_text(as_csv(given, number), "utf-8")
    assert measured(read(tmp_path / "motion.csv")).row == row_of(tmp_path, given)


@pytest.mark.slow
@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, QUAD, real(237)], ids=lambda p: p.name)
def test_the_format_is_inferred_from_what_is_written(precision, tmp_path: Path) -> None:
    given = document(precision)
    del given["precision"], given["bits"]
    inferred = read(written(tmp_path, given)).precision
    assert inferred.digits == precision.digits
    assert inferred.bits == precision.bits or precision.family == "real"
    assert read(written(tmp_path, given | {"bits": precision.bits})).precision.bits == precision.bits


@pytest.mark.parametrize("word", ["nan", "NaN", "inf", "-Infinity"])
def test_what_is_not_finite_is_a_verdict(word: str, tmp_path: Path) -> None:
    given = document()
    given["states"][1][4] = word
    row = row_of(tmp_path, given)
    first = row_of(tmp_path, given | {"times": given["times"][:1], "states": given["states"][:1]})
    assert (row.outcome, row.finite) == ("non_finite", False)
    assert (row.time_reached, row.horizon) == (first.horizon, "7")
    assert row.metrics["solution_error_omega_max"] == first.metrics["solution_error_omega_max"]
    given["states"][0][0] = word
    none = row_of(tmp_path, given)
    assert none.time_reached == "0"
    assert {metric.value for metric in none.metrics.values()} == {"missing"}
    assert digits_kept(none) is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"times": None}, "The key times is missing"),
        ({"gamma": None}, "The attitude at t = 0 is missing"),
        ({"weight": None}, "The key weight is missing"),
        ({"times": []}, "No times were given"),
        ({"times": ["1", "2"]}, "equally many; got 2 and 3"),
        ({"times": ["2", "1", "3"]}, "must move strictly away from 0"),
        ({"times": ["1", "-2", "3"]}, "different signs"),
        ({"times": ["1", "nan", "3"]}, "Row 2, t must be finite; got nan"),
        ({"times": "1,2,3"}, "times is not a list"),
        ({"states": [["1"] * 5] * 3}, "states[0] has 5 numbers, not 6"),
        ({"states": [["1"] * 6, "x", ["1"] * 6]}, "states[1] must be a list; got 'x'"),
        ({"states": [["1", "2", "three", "4", "5", "6"]] * 3}, "states[0][2]: 'three' is not a finite number"),
        ({"states": [[None] * 6] * 3}, "states[0][0] must be a number; got a NoneType"),
        ({"states": [[True] * 6] * 3}, "states[0][0] must be a number; got a bool"),
        ({"states": [["0x"] * 6] * 3}, "'0x' is not a finite number"),
        ({"inertia": ["1", "2"]}, "inertia has 2 numbers"),
        ({"inertia": ["1", "2", "-3"]}, "must be positive"),
        ({"inertia": ["1", "2", "nan"]}, "not a finite number"),
        ({"omega": [["1"], "2", "3"]}, "omega must be a number; got a list"),
        ({"gamma": ["1", "1", "1"]}, "not a unit vector"),
        ({"system": "pendulum"}, "Unknown system"),
        ({"system": "gyrostat"}, "gyrostat needs"),
        ({"precision": "single"}, "Unknown precision"),
        ({"precision": 53}, "Unknown precision"),
        ({"precision": None, "bits": "1.5"}, "an integer from 0 to 2"),
        ({"precision": "double", "bits": 113}, "bits = 113, but double has 53"),
        ({"precision": None, "bits": 10**6}, "must be from 24 to 20000"),
        ({"outcome": "fine"}, "Unknown outcome"),
        ({"steps": -1}, "must be an integer from 0 to 2^63 - 1"),
        ({"steps": "1e30"}, "must be an integer from 0 to 2^63 - 1"),
        ({"states": [["0x1p999999"] * 6] * 3}, "got '0x1p999999'"),
        ({"states": [["1e-99999"] * 6] * 3}, "got '1e-99999'"),
        ({"name": ""}, "The name has 0 characters"),
        ({"name": "x" * 10_000}, "The name has 10000 characters"),
        ({"integrator": "a\x1b[31m"}, "The integrator has 6 characters"),
        ({"name": {}}, "name must be text or a number; got a dict"),
        ({"tolerence": "1e-9"}, "Unknown key 'tolerence'"),
        ({"Weight": "1"}, "Unknown key 'Weight'"),
        ({"mass": "1"}, "weight and mass were given"),
        ({"about": "centre"}, "about = centre was given without mass and gravity"),
    ],
)
def test_a_file_that_cannot_be_scored_is_refused_in_words(change: dict, message: str, tmp_path: Path) -> None:
    given = {key: value for key, value in (document() | change).items() if value is not None}
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        read(written(tmp_path, given))
    assert caught.value.remedy
    assert len(caught.value.cause) < 1000


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", "{", "This is not JSON"),
        ("a.json", "[1]", "must be an object"),
        ("a.json", "[" * 100_000, "This is not JSON"),
        ("a.json", '{"a": "\xff"}'.encode("latin-1"), "cannot be read"),
        ("a.csv", "", "The header is not t,omega1"),
        ("a.csv", "t,omega1\n1,2\n", "The header is not t,omega1"),
        ("a.csv", f"{HEADER}\n1,2,3\n", "Line 2 has 3 columns, not 7"),
        ("a.csv", f"{HEADER}\n1,2,3,4,5,6,7\n", "The key inertia is missing"),
        ("a.doc", "", "must end in one of"),
        ("x" * 100 + ".json", None, "cannot be read"),
    ],
)
def test_a_file_that_is_none_is_refused_in_words(name: str, content, message: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError, match=message):
        read(tmp_path / name)


def test_a_misspelt_key_is_named_with_the_nearest_and_comments_stay_free(tmp_path: Path) -> None:
    given = document()
    for key, remedy in (("presicion", "Did you mean precision?"), ("colour", "`heavytop docs score`")):
        with pytest.raises(InputError, match=f"Unknown key '{key}'") as caught:
            read(written(tmp_path, given | {key: "1"}))
        assert remedy in caught.value.remedy
    text = as_csv(given)
    plain, commented = tmp_path / "plain.csv", tmp_path / "commented.csv"
    plain.write_text(text, "utf-8")
    commented.write_text(f"# made on a Sunday\n# author: A. N. Other\n{text}", "utf-8")
    assert read(commented).states == read(plain).states
    commented.write_text(f"# tolerence: 1e-9\n{text}", "utf-8")
    with pytest.raises(InputError, match="Unknown key 'tolerence'"):
        read(commented)


@pytest.mark.slow
def test_what_no_body_has_and_states_in_another_order_are_warnings(tmp_path: Path) -> None:
    given = document()
    assert read(written(tmp_path, given)).warnings() == []
    odd = given | {"inertia": ["1", "1", "3"], "centre": ["0", "0", "1"]}
    (warning,) = read(written(tmp_path, odd)).warnings()
    assert "I3 = 3 exceeds the sum 2" in warning
    swapped = given | {"states": [[*state[3:], *state[:3]] for state in given["states"]]}
    (warning,) = read(written(tmp_path, swapped)).warnings()
    assert "are the states in the order omega1" in warning
    said = heavytop("score", str(written(tmp_path, swapped)), "--json")
    assert said.stderr == f"heavytop: warning: {warning}\n"
    assert json.loads(said.stdout)["measure"] == "score"
    huge = given | {"states": [[*state[:3], "1e200", *state[4:]] for state in given["states"]]}
    (warning,) = read(written(tmp_path, huge)).warnings()
    assert "differs from 1 by 1.00E+400 at t" in warning
    of_body = {**given, "mass": given["weight"], "gravity": 1, "about": "pivot", "states": huge["states"]}
    del of_body["weight"]
    (warning,) = read(written(tmp_path, of_body)).warnings()
    assert warning.endswith("are these columns γ?")


@pytest.mark.slow
def test_the_command_scores_writes_a_report_and_pipes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = heavytop("propagate", "--case", "lagrange", "--times", "1,5", "--json")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(made.stdout.encode())))
    piped = heavytop("score", "-", "--json")
    assert piped.returncode == 0, piped.stderr
    assert json.loads(piped.stdout)["digits_kept"] > 14
    file = tmp_path / "motion.json"
    file.write_text(made.stdout)
    done = heavytop("score", file, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    said = " ".join(done.stdout.split())
    assert re.match(r"1[45]\.\d of 16 digits right at every sample up to T = 5; heyoka in double: 1", said)
    assert heavytop("compare", tmp_path / "out", tmp_path / "out").returncode == 0
    spoilt = json.loads(made.stdout)
    spoilt["states"][1][0] = str(exact(spoilt["states"][1][0]) * (1 + Fraction(1, 10**9)) * 10**20 // 1) + "e-20"
    file.write_text(json.dumps(spoilt))
    assert heavytop("score", file, "--out", tmp_path / "worse").returncode == 0
    assert heavytop("compare", tmp_path / "out", tmp_path / "worse").returncode == 1
    again = heavytop("score", file, "--out", tmp_path / "worse")
    assert again.returncode == 2
    assert "not an empty folder" in again.stderr
    file.write_text(made.stdout.replace('"0.', '"nan0.', 1))
    assert heavytop("score", file).returncode == 2
    spoilt["states"][1][0] = "nan"
    file.write_text(json.dumps(spoilt))
    lost = heavytop("score", file)
    assert (lost.returncode, "non_finite" in lost.stdout) == (3, True)


@pytest.mark.parametrize("kind", ["json", "csv"])
def test_the_examples_of_the_documentation_can_be_scored(kind: str, tmp_path: Path) -> None:
    text = (DOCS / "score.md").read_text("utf-8")
    (tmp_path / f"motion.{kind}").write_text(re.search(rf"```{kind}\n(.*?)```", text, re.S)[1], "utf-8")
    given = read(tmp_path / f"motion.{kind}")
    assert (given.name, given.integrator, given.flags) == ("mine", "rk4.f90", {"step": "0.001"})
    row = measured(given).row
    assert row.outcome == "success"
    assert digits_kept(row) > 15


@pytest.mark.parametrize(("precision", "size"), [("double", "1e309"), ("extended", "-1e4933"), ("quad", "1e4933")])
def test_a_state_too_large_for_its_format_is_not_finite(precision: str, size: str, tmp_path: Path) -> None:
    given = document() | {"precision": precision}
    del given["bits"]
    given["states"][1] = [size, *given["states"][1][1:]]
    row = row_of(tmp_path, given)
    assert (row.outcome, row.samples) == ("non_finite", 1)
    given["states"][1] = ["1e308", *given["states"][1][1:]]
    assert measured(read(written(tmp_path, given))).row.outcome == "success"


def test_an_error_beyond_double_is_scored() -> None:
    given, case = document(), LAGRANGE
    given["states"][1] = [*given["states"][1][:5], "1e400"]
    score = ht.score(TIMES, given["states"], top=case.top, start=case.start, precision=QUAD)
    assert float(score.row.metric("solution_error", "gamma", "max")) == math.inf
    assert score.digits_kept == 0


def test_what_has_no_end_is_refused_before_it_is_read(tmp_path: Path) -> None:
    (tmp_path / "endless.json").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe.csv")
    for file in (tmp_path / "endless.json", tmp_path / "pipe.csv"):
        with pytest.raises(InputError, match="a device or a pipe"):
            read(file)
    with pytest.raises(InputError, match=r"must end in one of"):
        read(Path("/dev/zero"))


def test_states_of_an_iterator_are_read_once() -> None:
    given, case = document(), LAGRANGE
    scores = [
        str(ht.score(TIMES, states, top=case.top, start=case.start, precision=DOUBLE))
        for states in (given["states"], iter(given["states"]), (iter(state) for state in given["states"]))
    ]
    assert scores == scores[:1] * 3
    with pytest.raises(InputError, match="normalize must be a bool; got 'yes'"):
        ht.score(TIMES, given["states"], top=case.top, start=case.start, normalize="yes")


@pytest.mark.parametrize("key", ["weight", "inertia", "rotor"])
def test_a_key_that_is_null_is_not_said_to_be_missing(key: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"The key {key} is null"):
        row_of(tmp_path, document() | {key: None})
