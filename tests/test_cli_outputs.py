"""--show, --csv and --latex of `propagate` and `reference`: shapes, what makes them citable, and reading them back."""

import csv
import json
import re
import resource
import shutil
import subprocess
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

import pytest
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.errors import InputError
from heavytop.features.score.measurement import assess
from heavytop.features.score.trajectories.files import read
from support import in_process
from support.helpers import options

SHOWN = "quaternion,matrix,euler:ZXZ,position,omega-space"
KEYS = {"quaternion": (4,), "matrix": (3, 3), "euler": (3,), "position": (3,), "omega_space": (3,)}
DATA = {
    "inertia": "2,2,1",
    "weight": "1",
    "centre": "1,0,0",
    "omega": "1/2,1/3,1",
    "gamma": "3/5,0,4/5",
    "times": "1/3,2.50",
}


@pytest.fixture(autouse=True)
def _eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def heavytop(command: str, *more: str, data: Mapping[str, str] = DATA, **changes: str) -> str:
    return in_process.printed(command, *options(data, **changes), *more)


def refused(command: str, *more: str, data: Mapping[str, str] = DATA) -> InputError:
    with pytest.raises(InputError) as error:
        CliRunner().invoke(app, [command, *options(data), *more], catch_exceptions=False)
    return error.value


def shape(value: object) -> tuple[int, ...]:
    return (len(value), *shape(value[0])) if isinstance(value, list) else ()


@pytest.mark.parametrize("command", ["propagate", "reference"])
def test_json_has_every_output_in_its_shape_and_says_what_it_is_of(command: str) -> None:
    document = json.loads(heavytop(command, "--show", SHOWN, "--json"))
    for key, expected in KEYS.items():
        assert shape(document[key]) == (2, *expected)
    number = document["matrix"][0][0][0]
    assert (number.keys() == {"value", "radius"}) if command == "reference" else isinstance(number, str)
    assert document["sequence"] == "ZXZ"
    assert document["xi"] == ["-4/5", "0", "3/5"]
    assert (document["inertia"], document["gamma"]) == (["2", "2", "1"], ["3/5", "0", "4/5"])
    assert document["times_given" if command == "propagate" else "times"] == ["1/3", "2.50"]
    assert document["version"]
    assert document["command"].startswith(f"heavytop {command} --inertia 2,2,1 ")
    assert shape(document["states"]) == (2, 6)


def test_json_without_show_has_no_attitude() -> None:
    for command in ("propagate", "reference"):
        assert not ({*KEYS, "xi", "attitude"} & json.loads(heavytop(command, "--json")).keys())


def test_point_and_pivot_are_in_the_document() -> None:
    document = json.loads(
        heavytop("propagate", "--show", "position", "--point", "0,0,1", "--pivot", "1,2,1/2", "--json")
    )
    assert (document["point"], document["pivot"]) == (["0", "0", "1"], ["1", "2", "1/2"])
    # the third column of R, shifted
    matrix = json.loads(heavytop("propagate", "--show", "matrix", "--json"))["matrix"][0]
    for row, place, shift in zip(matrix, document["position"][0], (1, 2, 0.5), strict=True):
        assert abs(float(place) - float(row[2]) - shift) < 1e-15


@pytest.mark.slow
@pytest.mark.parametrize(("command", "more"), [("propagate", []), ("reference", ["--digits", "30"])])
def test_csv_is_the_table_and_score_reads_it(command: str, more: list[str], tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    printed = heavytop(command, "--show", "quaternion,position", "--csv", str(file), *more)
    lines = file.read_text().splitlines()
    comments = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# "))
    assert comments["inertia"] == "2, 2, 1"
    assert comments["xi"] == "-4/5, 0, 3/5"
    assert comments["command"].startswith(f"heavytop {command} --inertia 2,2,1 ")
    assert comments["version"]
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [row["t"] for row in rows] == ["1/3", "2.50"]
    unfolded = re.sub(r"\s+", "", printed)
    for row in rows:
        for name in ("omega1", "gamma3", "qw", "qz", "x", "z"):
            assert row[name] in unfolded
            if command == "reference":
                assert f"±{row[f'{name}_radius']}" in unfolded
    given = read(file)
    assert list(given.times) == [Fraction(1, 3), Fraction(5, 2)]
    assert given.top.inertia == (2, 2, 1)
    assert abs(given.start.gamma[0] - Fraction(3, 5)) <= given.precision.eps
    assert len(given.states) == len(rows)
    assert (assess(given).digits_right or 0) > 14


def test_propagates_json_with_outputs_is_read_by_score(tmp_path: Path) -> None:
    file = tmp_path / "run.json"
    file.write_text(heavytop("propagate", "--json"))
    assert len(read(file).states) == 2


@pytest.mark.slow
def test_latex_is_a_whole_table_of_siunitx_and_booktabs(tmp_path: Path) -> None:
    text = heavytop("reference", "--latex", "--show", "quaternion", "--digits", "80")
    for part in (r"\usepackage{siunitx}", r"\usepackage{booktabs}", r"\toprule", r"\midrule", r"\bottomrule"):
        assert text.count(part) == 1
    assert r"$\num{1}/\num{3}$" in text
    assert r"\num{2.50}" in text
    assert "xi -4" in text
    assert "heavytop" in text
    begun, ended = (re.findall(rf"\\{word}{{(\w+)}}", text) for word in ("begin", "end"))
    assert sorted(begun) == sorted(ended)
    body = [line for line in text.splitlines() if " & " in line]
    assert {line.count("&") for line in body} == {2}
    assert all(line.endswith(r"\\") for line in body)
    assert all(line.count("{") == line.count("}") for line in body)
    # every digit of every number is there
    document = json.loads(heavytop("reference", "--show", "quaternion", "--digits", "80", "--json"))
    digits = re.sub(r"\\num|\\,|\\quad|\\pm|\\\\|[^0-9.e-]", "", "".join(line.split("&")[2] for line in body))
    for ball in (*document["states"][0], *document["quaternion"][1]):
        assert ball["value"].lstrip("-") in digits
    compiler = shutil.which("pdflatex")
    if compiler:
        packages = "\n".join(re.findall(r"\\usepackage{\w+}", text))
        (tmp_path / "t.tex").write_text(
            f"\\documentclass{{article}}\n{packages}\n\\begin{{document}}\n{text}\n\\end{{document}}\n"
        )
        done = subprocess.run([compiler, "-interaction=batchmode", "t.tex"], cwd=tmp_path, check=False, timeout=60)
        assert done.returncode == 0


@pytest.mark.parametrize(("gamma", "source"), [("3/5,0,4/5", "Lagrange"), ("0,0,1", "Staude")])
def test_bibtex_cites_program_command_and_source_and_no_path(tmp_path: Path, gamma: str, source: str) -> None:
    changes = {"centre": "0,0,1", "omega": "0,0,1", "gamma": gamma, "csv": str(tmp_path / "numbers_{.csv")}
    text = heavytop("reference", "--bibtex", **changes)
    head, *lines, end = text.splitlines()
    assert re.fullmatch(r"@misc\{heavytop-[0-9a-f]{12},", head)
    assert end == "}"
    fields = dict(re.fullmatch(r"  (\w+) = \{(.*)\},", line).groups() for line in lines)
    assert list(fields) == ["author", "title", "version", "howpublished", "note"]
    assert all(value.count("{") == value.count("}") for value in fields.values())
    assert text.isascii()
    assert "heavytop reference --inertia 2,2,1" in fields["howpublished"]
    assert source in fields["note"]
    assert str(tmp_path) not in text
    assert "numbers" not in text


@pytest.mark.slow
def test_eighty_digits_are_readable_on_eighty_columns() -> None:
    text = heavytop("reference", "--digits", "80", "--attitude")
    assert max(map(len, text.splitlines())) <= 80
    assert "xi(0) = (-4/5, 0, 3/5)" in text
    value = json.loads(heavytop("reference", "--digits", "80", "--json"))["states"][0][0]["value"]
    lines = text.splitlines()
    place = next(i for i, line in enumerate(lines) if line.startswith(" Ω1"))
    first, second, radius = (line.split() for line in lines[place : place + 3])
    assert first[1] + second[0] == value
    assert radius[0] == "±"


@pytest.mark.slow
def test_gimbal_lock_is_said_in_words() -> None:
    for command in ("propagate", "reference"):
        text = heavytop(command, "--show", "euler:ZXZ", centre="0,0,1", omega="0,0,3", gamma="0,0,1")
        assert "not defined (gimbal lock)" in " ".join(text.split())
        assert "not defined" not in heavytop(command, "--show", "euler:ZXZ")


@pytest.mark.slow
@pytest.mark.parametrize("command", ["propagate", "reference"])
@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--show", "quaternions"], "Unknown output 'quaternions'"),
        (["--show", ""], "names no output"),
        (["--show", "matrix,matrix"], "given twice"),
        (["--show", "euler:ZXZ,euler:ZYX"], "given twice"),
        (["--show", "matrix", "--point", "1,2,3"], "no position was requested"),
        (["--pivot", "1,2,3"], "no position was requested"),
        (["--show", "position", "--pivot", "1,2,1e400"], "too large"),
        (["--json", "--latex", "-"], "both print to standard output"),
        (["--csv", "same", "--latex", "same"], "Give two files"),
        (["--csv", "no/such/folder/file"], "cannot be written"),
    ],
)
def test_what_cannot_be_shown_is_refused_with_a_remedy(command: str, more: list[str], message: str) -> None:
    error = refused(command, *more)
    assert message in f"{error.cause} {error.remedy}"
    assert error.exit_code == 2
    assert error.remedy


@pytest.mark.parametrize("option", ["--csv", "--latex"])
@pytest.mark.parametrize("command", ["propagate", "reference"])
def test_a_full_disk_leaves_the_file_of_before_and_no_part_of_another(
    command: str, option: str, tmp_path: Path
) -> None:
    (tmp_path / "table").write_text("of before")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, limits[1]))
    try:
        error = refused(command, option, str(tmp_path / "table"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert "cannot be written" in error.cause
    assert [each.name for each in tmp_path.iterdir()] == ["table"]
    assert (tmp_path / "table").read_text() == "of before"


@pytest.mark.slow
def test_the_command_itself_prints_latex_and_names_itself(tmp_path: Path) -> None:
    done = in_process.heavytop("reference", *options(DATA), "--csv", "a.csv", "--latex", cwd=tmp_path)
    assert done.stdout.startswith("% command: heavytop reference --inertia 2,2,1 ")
    assert "# command: heavytop reference --inertia 2,2,1 " in (tmp_path / "a.csv").read_text()
    assert done.stderr.endswith("heavytop: wrote a.csv\n")


@pytest.mark.parametrize("command", ["propagate", "reference"])
def test_files_of_a_case_name_it(command: str, tmp_path: Path) -> None:
    files = tmp_path / "a.csv", tmp_path / "a.tex"
    made = in_process.heavytop(
        command, "--case", "kovalevskaya", "--times", "1", "--csv", str(files[0]), "--latex", str(files[1])
    )
    assert made.returncode == 0
    assert "\n# name: kovalevskaya\n" in files[0].read_text("utf-8")
    assert "\\caption{name kovalevskaya; " in files[1].read_text("utf-8")
    assert read(files[0]).name == "kovalevskaya"


@pytest.mark.parametrize("command", ["propagate", "reference"])
def test_axis_and_angle_are_an_attitude_of_both_commands(command: str) -> None:
    """Of an axis of any length, in radians and in degrees."""
    without = {name: value for name, value in DATA.items() if name != "gamma"}

    def turned(*attitude: str) -> dict:
        return json.loads(heavytop(command, *attitude, "--show", "matrix", "--json", data=without))

    found, beside = turned("--axis-angle", "0,0,3:1/20"), turned("--euler", "ZXZ:1/20,0,0")
    assert (found["states"], found["matrix"]) == (beside["states"], beside["matrix"])
    right = turned("--axis-angle", "0,1,0:90deg")
    assert right["states"] == turned("--matrix", "0,0,1,0,1,0,-1,0,0")["states"]
    assert "must be an axis and an angle" in str(refused(command, "--axis-angle", "0,0,3", data=without))
