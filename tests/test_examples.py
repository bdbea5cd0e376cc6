"""The example workflow: GitHub reads it, and the program understands its commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import typer
import yaml

from heavytop.cli import app

ROOT = Path(__file__).parents[1]
WORKFLOW = ROOT / "examples" / ".github" / "workflows" / "heavytop.yml"
SHELL = re.compile(r"\|\||&&|;|>")


def test_the_program_understands_the_commands_of_the_workflow() -> None:
    steps = yaml.safe_load(WORKFLOW.read_text("utf-8"))["jobs"]["heavytop"]["steps"]
    lines = [line.strip() for step in steps for line in step.get("run", "").splitlines()]
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
    assert workflow["permissions"] == {"contents": "read"}
    (job,) = workflow["jobs"].values()
    assert job["runs-on"]
    steps = job["steps"]
    assert all(("uses" in step) != ("run" in step) for step in steps)
    assert all(re.fullmatch(r"[\w-]+/[\w-]+@v\d+", step["uses"]) for step in steps if "uses" in step)
    gate = next(step["run"] for step in steps if "heavytop compare" in step.get("run", ""))
    assert gate.rstrip().endswith("exit $verdict")
    kept = next(step for step in steps if step.get("uses", "").startswith("actions/upload-artifact"))
    assert kept["if"] == "always()"
    written = re.findall(r"--(?:html|junit) (\S+)", gate)
    assert len(written) == 2
    assert set(written) <= set(kept["with"]["path"].split())
