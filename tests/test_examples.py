"""The example workflow: GitHub reads it, the program understands its commands, and its shell does what it says."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from heavytop.cli import app

ROOT = Path(__file__).parents[1]
WORKFLOW = ROOT / "examples" / ".github" / "workflows" / "heavytop.yml"
SHELL = re.compile(r"\|\||&&|;|>")
MARKER = "<!-- heavytop accuracy -->"
HEAVYTOP = """#!/bin/sh
[ "$1" = compare ] && [ -n "$TABLE" ] && echo "$TABLE" > summary.md
exit "$CODE"
"""
GH = '''#!{python}
"""Comments of pull request 7 in a file: GET through the filter that the workflow asks for, POST, PATCH."""
import json, re, sys
from pathlib import Path

store, arguments = Path("comments.json"), sys.argv[1:]
comments = json.loads(store.read_text())
assert arguments.pop(0) == "api"
options = [each for each in arguments if each.startswith("-")]
address = next(each for each in arguments if each.startswith("repos/"))
if "--method" not in arguments:
    assert options == ["--paginate", "--jq"] and address == "repos/us/mine/issues/7/comments"
    login, start = re.findall(r'"([^"]+)"', arguments[-1])
    assert arguments[-1] == f'.[] | select(.user.login == "{{login}}" and (.body | startswith("{{start}}"))) | .id'
    for each in comments:
        if each["user"]["login"] == login and each["body"].startswith(start):
            print(each["id"])
    sys.exit()
assert options == ["--silent", "--method", "-F"] and arguments[-1] == "body=@comment.md"
body = Path("comment.md").read_text()
if arguments[arguments.index("--method") + 1] == "POST":
    assert address == "repos/us/mine/issues/7/comments"
    comments.append({{"id": 100 + len(comments), "user": {{"login": "github-actions[bot]"}}, "body": body}})
else:
    (ours,) = (each for each in comments if address == f"repos/us/mine/issues/comments/{{each['id']}}")
    ours["body"] = body
store.write_text(json.dumps(comments))
'''


def steps() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = yaml.safe_load(WORKFLOW.read_text("utf-8"))["jobs"]["heavytop"]["steps"]
    return found


def test_the_program_understands_the_commands_of_the_workflow() -> None:
    lines = [line.strip() for step in steps() for line in step.get("run", "").splitlines()]
    said = [SHELL.split(line)[0] for line in lines if line.startswith("heavytop ")]
    assert len(said) >= 2
    known = typer.main.get_command(app).commands
    for command in said:
        name, *arguments = shlex.split(command)[1:]
        known[name].make_context(name, arguments)


def test_the_workflow_is_one_that_github_reads() -> None:
    workflow = yaml.safe_load(WORKFLOW.read_text("utf-8"))
    # YAML 1.1 takes the key `on` for a boolean
    assert "pull_request" in workflow[True]
    assert workflow["permissions"] == {"contents": "read", "pull-requests": "write"}
    (job,) = workflow["jobs"].values()
    assert job["runs-on"]
    assert all(("uses" in step) != ("run" in step) for step in steps())
    assert all(re.fullmatch(r"[\w-]+/[\w-]+@v\d+", step["uses"]) for step in steps() if "uses" in step)
    assert "https://" not in WORKFLOW.read_text("utf-8")
    gate = next(step["run"] for step in steps() if "heavytop compare" in step.get("run", ""))
    assert gate.rstrip().endswith("exit $verdict")
    kept = next(step for step in steps() if step.get("uses", "").startswith("actions/upload-artifact"))
    assert kept["if"] == "always()"
    written = re.findall(r"--(?:html|junit) (\S+)", gate)
    assert len(written) == 2
    assert set(written) <= set(kept["with"]["path"].split())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A checkout on a runner: programs named heavytop and gh, and comments of other people, one with the marker."""
    (tmp_path / "bin").mkdir()
    for name, text in (("heavytop", HEAVYTOP), ("gh", GH.format(python=sys.executable))):
        (tmp_path / "bin" / name).write_text(text)
        (tmp_path / "bin" / name).chmod(0o755)
    people = [{"id": n, "user": {"login": "someone"}, "body": body} for n, body in ((1, "Nice."), (2, MARKER))]
    (tmp_path / "comments.json").write_text(json.dumps(people))
    return tmp_path


def on_github(folder: Path, table: str, code: int) -> list[int]:
    """The exit codes of the steps from the measurement on, in the shell that GitHub runs them with."""
    environment = {
        "PATH": f"{folder / 'bin'}:{os.environ['PATH']}",
        "GITHUB_STEP_SUMMARY": "page.md",
        "GITHUB_REPOSITORY": "us/mine",
        "NUMBER": "7",
        "INTEGRATOR": "mine:rk4",
        "TABLE": table,
        "CODE": str(code),
    }
    (folder / "summary.md").unlink(missing_ok=True)
    scripts = [step["run"] for step in steps() if "run" in step][1:]
    return [
        subprocess.run(["bash", "-e", "-c", script], cwd=folder, env=environment, check=False).returncode
        for script in scripts
    ]


def comments(folder: Path) -> list[tuple[int, str]]:
    return [(each["id"], each["body"]) for each in json.loads((folder / "comments.json").read_text())]


def test_one_comment_is_written_and_then_kept_up_to_date(folder: Path) -> None:
    others = comments(folder)
    assert on_github(folder, "### heavytop: same", 0) == [0, 0, 0]
    assert comments(folder) == [*others, (102, f"{MARKER}\n### heavytop: same\n")]
    # something is worse: the step fails, and the same comment says so
    assert on_github(folder, "### heavytop: worse", 1) == [1, 1, 0]
    assert comments(folder) == [*others, (102, f"{MARKER}\n### heavytop: worse\n")]
    assert (folder / "page.md").read_text() == "### heavytop: same\n### heavytop: worse\n"


def test_a_row_that_failed_is_for_the_comparison_to_say_and_none_at_all_is_said(folder: Path) -> None:
    assert on_github(folder, "### heavytop: incomparable", 3) == [0, 3, 0]
    assert on_github(folder, "", 2)[0] != 0
    ((_, said),) = comments(folder)[2:]
    assert said == f"{MARKER}\nheavytop compared nothing: the log of this run says why.\n"
