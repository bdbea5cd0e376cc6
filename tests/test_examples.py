"""What README, documents and the example workflow tell people to type is understood by the program."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer
import yaml

from heavytop.cli import app

ROOT = Path(__file__).parents[1]
WORKFLOW = ROOT / "examples" / ".github" / "workflows" / "heavytop.yml"
SHELL = re.compile(r"\|\||&&|;|>|&$|\s#\s")


def commands(path: Path) -> list[str]:
    """Lines of code that start with the program, without what belongs to the shell."""
    found, fenced = [], False
    for line in path.read_text("utf-8").splitlines():
        fenced ^= line.startswith("```")
        command = line.strip().removeprefix(".venv/bin/")
        if (fenced or line.startswith("    ")) and command.startswith("heavytop "):
            found.append(SHELL.split(command)[0].strip())
    return found


SAID = [
    pytest.param(command, id=f"{path.name}: {command[:60]}")
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), WORKFLOW)
    for command in commands(path)
]


@pytest.mark.parametrize("command", SAID)
def test_the_program_understands_what_the_documents_say(command: str) -> None:
    name, *arguments = shlex.split(command)[1:]
    known = typer.main.get_command(app).commands
    assert name in known
    known[name].make_context(name, arguments)


def test_commands_are_found_and_wrong_ones_refused() -> None:
    assert len(SAID) > 10
    known = typer.main.get_command(app).commands
    with pytest.raises(Exception, match="No such option"):
        known["compare"].make_context("compare", ["a", "b", "--no-such-option"])


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


def test_the_readme_links_to_what_is_there() -> None:
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for link in re.findall(r"\]\(([^)#]+)\)", path.read_text("utf-8")):
            assert "://" in link or (path.parent / link).exists(), f"{path.name}: {link}"
