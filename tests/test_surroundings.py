"""Hostile surroundings: each ends with an answer, or with the cause and its exit code, and never with a traceback.

Every start of the program costs a second, so each is asked several things at once.
"""

import json
import os
import re
import resource
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from support.helpers import options, without_progress
from support.reports import drift, plan_file

pytestmark = pytest.mark.slow

PYTHON = [sys.executable, "-m", "heavytop"]
PROPAGATE = ["propagate", *options(times="1")]
TRAJECTORY = """# inertia: 2, 2, 1
# weight: 1
# centre: 0, 0, 1
# omega: 0, 0, 1
# gamma: 0, 0, 1
t,omega1,omega2,omega3,gamma1,gamma2,gamma3
1,0,0,1,0,0,1
"""


def shell(command: str, *, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[bytes]:
    """The command line by a shell, where ``heavytop`` stands for it."""
    script = re.sub(r"(?<![/\w-])heavytop ", " ".join(PYTHON) + " ", command)
    return subprocess.run(
        ["bash", "-c", script], capture_output=True, cwd=cwd, env=os.environ | environment, timeout=120, check=False
    )


def limited(arguments: list[str], limit: Callable[[], None]) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([*PYTHON, *arguments], capture_output=True, preexec_fn=limit, timeout=120, check=False)


def assert_said(done: subprocess.CompletedProcess[bytes], *codes: int) -> None:
    errors = done.stderr.decode(errors="replace")
    assert done.returncode in codes, errors
    assert "Traceback" not in errors
    assert "Error:" not in errors
    if done.returncode:
        assert "heavytop: " in errors


def test_characters_that_an_encoding_lacks_are_replaced() -> None:
    text = shell("heavytop " + " ".join(PROPAGATE), PYTHONIOENCODING="ascii")
    assert_said(text, 0)
    assert "3  0.96912566428666425" in text.stdout.decode("ascii")


@pytest.mark.parametrize(
    ("what", "where"),
    [([*PROPAGATE, "--json"], ">&-"), (["list"], "> /dev/full"), (["--help"], ">&- 2>&-")],
    ids=["json closed", "lines full", "all closed"],
)
def test_an_output_that_cannot_be_written_is_exit_2_with_its_cause(what: list[str], where: str) -> None:
    done = shell(f"heavytop {' '.join(what)} {where}")
    assert done.returncode == 2
    if "2>" not in where:
        assert_said(done, 2)
        assert b"Standard output cannot be written: " in done.stderr
        assert {">&-": b"closed", "> /dev/full": b"No space"}[where] in done.stderr


def test_an_error_that_cannot_be_said_changes_nothing_else() -> None:
    for where in ("2>&-", "2> /dev/full <&-"):
        done = shell(f"heavytop {' '.join(PROPAGATE)} --inertia 9,2,1 --json {where}")  # no body has these: a warning
        assert done.returncode == 0
        assert json.loads(done.stdout)["outcome"] == "success"
    assert shell("heavytop propagate --nonsense 2> /dev/full").returncode == 2


def test_a_reader_that_went_away_is_silence_and_the_code_of_other_tools() -> None:
    done = shell(f"heavytop {' '.join(PROPAGATE)} --json | true; echo ${{PIPESTATUS[0]}}")
    assert (done.stdout, done.stderr) == (b"141\n", b"")


def test_a_removed_folder_is_an_answer_or_exit_2(tmp_path: Path) -> None:
    outputs = [f"{' '.join(PROPAGATE)} --json", "run --plan smoke --out x", "figures --out x"]
    gone = tmp_path / "gone"

    def tried(which: int) -> subprocess.CompletedProcess[bytes]:
        folder = gone / str(which)
        folder.mkdir(parents=True)
        return shell(f"rmdir {folder}; heavytop {outputs[which]}", cwd=folder)

    with ThreadPoolExecutor(2) as at_once:
        found = list(at_once.map(tried, range(len(outputs))))
    for done, code in zip(found, (0, 2, 2), strict=True):
        assert_said(done, code)


def test_a_home_and_a_cache_that_cannot_be_written_are_no_matter(tmp_path: Path) -> None:
    nowhere = "/proc/nowhere"
    everywhere = {"HOME": nowhere, "XDG_CACHE_HOME": nowhere, "XDG_CONFIG_HOME": nowhere, "NUMBA_CACHE_DIR": nowhere}
    (tmp_path / "mine.csv").write_text(TRAJECTORY + "2,0,1e-9,1,0,0,1\n3,0,1e-8,1,0,0,1\n")  # with errors to draw
    assert_said(shell("heavytop score mine.csv --html page.html", cwd=tmp_path, **everywhere), 0)
    assert "<svg" in (tmp_path / "page.html").read_text("utf-8")


def test_any_name_of_a_path_is_taken(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    from heavytop.cli import app

    folder = tmp_path / "-dash a b\nΩ é 漢 quote'\""
    folder.mkdir()
    (folder / "mine.csv").write_text(TRAJECTORY)
    plan = plan_file(folder, drift("euler"))
    out, page = folder / "out", folder / "page.html"
    for words in (
        ["score", folder / "mine.csv", "--html", page],
        ["score", folder / "mine.csv", "--json"],
        ["run", "--plan", plan, "--out", out, "--workers", "1"],
        ["compare", out, out, "--json"],
        ["compare", out, out, "--html", page],
        ["history", out, out, "--json"],
        ["show", out],
    ):
        done = CliRunner().invoke(app, list(map(str, words)))
        assert done.exit_code == 0, (words, done.output, done.exception)
    assert page.exists()


def test_a_name_that_is_no_text_is_taken_and_json_loses_nothing_in_any_encoding(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"\xff\xfe")
    folder.mkdir()
    (folder / "Ω é.csv").write_text(TRAJECTORY, "utf-8")
    score = "heavytop score 'Ω é.csv' --out out --json"
    done = shell(f'{score} && heavytop history "$PWD/out" "$PWD/out" --json', cwd=folder, PYTHONIOENCODING="ascii")
    assert_said(done, 0)
    assert json.JSONDecoder().raw_decode(done.stdout.decode("ascii"))[0]["case"] == "Ω é"
    assert b"\\udcff" in done.stdout


def test_little_memory_is_an_answer_or_exit_2() -> None:
    for megabytes in (600, 1500):
        limit = partial(resource.setrlimit, resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))
        assert_said(limited([*PROPAGATE, "--json"], limit), 0, 2)


def test_few_file_descriptors_are_an_answer_or_exit_2(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, drift("euler"))

    run = ["run", "--plan", plan, "--out", str(tmp_path / "out"), "--workers", "2"]
    for what in ([*PROPAGATE, "--json"], run):
        assert_said(limited(what, partial(resource.setrlimit, resource.RLIMIT_NOFILE, (12, 12))), 0, 2)


STRICT = """
import json, sys, threading, time, warnings
import numpy
import heavytop as ht

clock = time.time
jumps = iter(range(10**9))
time.time = lambda: clock() + 1e9 * (-1) ** next(jumps)  # the wall clock jumps by decades at every look
top = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
start = ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
expected = ht.propagate(top, start, [1, 2]).to_numpy()
exact = ht.reference(top, start, [1], 20).texts()
wrong = []

def work():
    if not (ht.propagate(top, start, [1, 2]).to_numpy() == expected).all():
        wrong.append("propagate")
    if ht.reference(top, start, [1], 20).texts() != exact:
        wrong.append("reference")

threads = [threading.Thread(target=work) for _ in range(12)]
for each in threads: each.start()
for each in threads: each.join()
many = ht.ensemble(top, [start] * 8, [1, 2], threads=12)
if not all(numpy.allclose(run.to_numpy(), expected, atol=1e-13, rtol=0) for run in many):
    wrong.append("ensemble")
try:
    ht.propagate(top, start, ["x"])
    wrong.append("a text that is not a number")
except ht.InputError:
    pass
if wrong:
    sys.exit(", ".join(wrong))
time.time = clock
from heavytop.__main__ import main

main()
"""


def test_threads_jumps_of_the_clock_and_the_command_line_under_strict_and_stripped_python(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, drift("euler"))
    run = ["run", "--plan", plan, "--out", str(tmp_path / "out"), "--workers", "1"]
    command = [sys.executable, "-W", "error", "-OO", "-c", STRICT, *run]
    done = subprocess.run(command, capture_output=True, timeout=120, check=False)
    assert (done.returncode, without_progress(done.stderr.decode())) == (0, "")
    assert (tmp_path / "out" / "report.json").exists()
