"""The workflows for GitHub, step by step: GitHub reads them, their shell does what they say, with a real heavytop once.

What cannot run here are the steps that are GitHub's own: ``checkout`` and ``setup-python`` (a fresh environment is made
in their place), ``upload-artifact`` and ``download-artifact`` (a folder stands in), and the program ``gh`` (as below).
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
import yaml

from heavytop.api.integrators import LANGUAGES, new_integrator

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / ".github" / "workflows" / "heavytop.yml"
ACTION = ROOT / "action.yml"
STARTER = ROOT / "src" / "heavytop" / "api" / "starters" / "common" / "workflow.yml"
BOTH = pytest.mark.parametrize("workflow", [EXAMPLE, STARTER], ids=("package", "program"))
MARKER = "<!-- heavytop accuracy -->"
RUN = "https://forge.example/us/mine/actions/runs/17"
HEAVYTOP = """#!/bin/sh
case $1 in
check-integrator) echo "$CONTRACT" ; exit 0 ;;
gate) echo "said by gate" ; [ -n "$TABLE" ] && echo "$TABLE" > result/comparison.md ; exit "$GATE" ;;
esac
"""
GH = '''#!{python}
"""Comments of pull request 7 in a file: GET through the filter that the workflow asks for, POST, PATCH; gh pr."""
import json, os, re, sys
from pathlib import Path

store, arguments = Path(os.environ["COMMENTS"]), sys.argv[1:]
comments = json.loads(store.read_text())
if arguments[0] == "pr":
    assert arguments[2 : 4] == ["--head", "heavytop-baseline"] and "--base" in arguments
    comments.append({{"id": 0, "user": {{"login": "gh pr"}}, "body": Path(arguments[-1]).read_text()}})
    store.write_text(json.dumps(comments))
    sys.exit()
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


def read(workflow: Path) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(workflow.read_text("utf-8"))
    return found


def steps(workflow: Path) -> list[dict[str, Any]]:
    found = [step for job in read(workflow)["jobs"].values() for step in job["steps"]]
    return [each for step in found for each in (of_action() if is_action(step) else [step])]


def is_action(step: dict[str, Any]) -> bool:
    """Whether it is the action at the root of this repository, from its checkout."""
    return bool(step.get("uses") == "./.heavytop/source")


def of_action() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = read(ACTION)["runs"]["steps"]
    return found


@BOTH
def test_the_workflow_is_one_that_github_reads(workflow: Path) -> None:
    content = read(workflow)
    # YAML 1.1 takes the key `on` for a boolean
    assert set(content[True]) == {"pull_request", "workflow_dispatch"}
    # what runs the code of a pull request may only read; GitHub's default without `permissions` is more
    assert content["permissions"] == {"contents": "read"}
    assert "permissions" not in content["jobs"]["measure"]
    assert content["jobs"]["comment"]["permissions"] == {"pull-requests": "write"}
    assert all(job["runs-on"] for job in content["jobs"].values())
    assert all(("uses" in step) != ("run" in step) for step in steps(workflow))
    assert all(re.fullmatch(r"[\w-]+/[\w-]+@v\d+", step["uses"]) for step in steps(workflow) if "uses" in step)
    assert "https://" not in workflow.read_text("utf-8") + ACTION.read_text("utf-8")
    # GitHub asks for the shell of each step of an action, and for inputs that it has
    assert all(step["shell"] == "bash" for step in of_action() if "run" in step)
    assert set(content["jobs"]["measure"]["steps"][-1]["with"]) <= set(read(ACTION)["inputs"])
    # a job that was cancelled says what it has: its last steps, and the job that writes the comment
    say, keep = of_action()[-2:]
    assert say["if"] == keep["if"] == "always()"
    assert "always()" in content["jobs"]["comment"]["if"]
    assert keep["uses"].startswith("actions/upload-artifact")


def test_both_workflows_are_one_but_for_the_project() -> None:
    """Apart from the pinned commit, what is measured, and how the project is installed."""
    two = [read(file) for file in (EXAMPLE, STARTER)]
    for content in two:
        del content["env"]["FOLDER"], content["env"]["HEAVYTOP_COMMIT"]
        assert set(content["jobs"]["measure"]["steps"].pop()["with"]) == {"folder", "integrator", "build"}
    assert two[0] == two[1]
    assert (ROOT / "examples" / "mine" / "policy.toml").read_text() == (STARTER.parent / "policy.toml").read_text()


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_starter_brings_a_workflow_pinned_to_this_commit(
    language: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for made_from, pinned in (("f00-dirty", "f00"), (None, "HEAD")):
        monkeypatch.setattr("heavytop.api.integrators.commit", lambda known=made_from: known)
        folder = tmp_path / str(pinned)
        new_integrator(folder, language)
        content = read(folder / ".github" / "workflows" / "heavytop.yml")
        assert content["env"]["HEAVYTOP_COMMIT"] == pinned
        assert LANGUAGES[language].build in content["jobs"]["measure"]["steps"][-1]["with"]["build"]
        assert (folder / ".gitignore").exists()


class Runner:
    """A machine that runs the jobs of a workflow in a checkout; artefacts are kept in a folder."""

    def __init__(self, workflow: Path, folder: Path, event: str, **more: str) -> None:
        self.folder, self.content = folder, read(workflow)
        self.kept = folder.parent / "kept"
        github = {
            **{"STEP_SUMMARY": folder.parent / "summary.md", "OUTPUT": folder.parent / "outputs"},
            **{"SERVER_URL": "https://forge.example", "REPOSITORY": "us/mine", "RUN_ID": 17, "EVENT_NAME": event},
            **{"REF_NAME": "main", "SHA": "f00", "ACTION_PATH": folder / ".heavytop" / "source"},
        }
        known = {f"GITHUB_{name}": str(value) for name, value in github.items()} | self.content["env"] | more
        comments = {"COMMENTS": str(folder.parent / "comments.json"), "NUMBER": "7"}
        self.environment = os.environ | comments | known
        self.environment["PATH"] = f"{folder.parent / 'bin'}:{self.environment['PATH']}"

    def job(self, name: str, skip: str = "", cancelled_in: str = "") -> dict[str, int]:
        """Run a job; the exit code of each step that ran.  skip: a pattern of steps that count as done."""
        done: dict[str, int] = {}
        cancelled = False
        for step in self._steps(name):
            when = step.get("if", "success()")
            if (cancelled and when != "always()") or (any(done.values()) and when == "success()"):
                continue
            if "uses" in step:
                self._artefact(step)
            elif not skip or not re.match(skip, step["name"]):
                done[step["name"]] = self._shell(step["run"], step.get("env", {}))
            cancelled = cancelled or step.get("name") == cancelled_in
        return done

    def _steps(self, name: str) -> list[dict[str, Any]]:
        """The steps of a job; those of the action with its inputs filled in."""
        found: list[dict[str, Any]] = []
        for step in self.content["jobs"][name]["steps"]:
            found += self._of_action(step["with"]) if is_action(step) else [step]
        return found

    def _of_action(self, given: dict[str, str]) -> list[dict[str, Any]]:
        values = {name: about["default"] for name, about in read(ACTION)["inputs"].items()} | given
        values["folder"] = self.environment["FOLDER"]
        inputs = re.compile(r"\$\{\{ inputs\.([\w-]+) \}\}")
        found: list[dict[str, Any]] = json.loads(
            inputs.sub(lambda m: json.dumps(values[m[1]])[1:-1], json.dumps(of_action()))
        )
        return found

    def _artefact(self, step: dict[str, Any]) -> None:
        result = self.folder / "result"
        if "upload" in step["uses"] and result.exists():
            shutil.copytree(result, self.kept, dirs_exist_ok=True)
        if "download" in step["uses"] and self.kept.exists():
            shutil.copytree(self.kept, result, dirs_exist_ok=True)

    def _shell(self, script: str, more: dict[str, str]) -> int:
        # what GitHub makes of `shell: bash`
        line = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script]
        known = self.environment | {name: value for name, value in more.items() if "${{" not in value}
        found = subprocess.run(line, cwd=self.folder, env=known, capture_output=True, text=True, timeout=300)
        self.said = found.stdout + found.stderr
        return found.returncode


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A checkout on a runner: programs named heavytop and gh, and comments of other people, one with the marker."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "mine").mkdir()
    for name, text in (("heavytop", HEAVYTOP), ("gh", GH.format(python=sys.executable))):
        (tmp_path / "bin" / name).write_text(text)
        (tmp_path / "bin" / name).chmod(0o755)
    people = [{"id": n, "user": {"login": "someone"}, "body": body} for n, body in ((1, "Nice."), (2, MARKER))]
    (tmp_path / "comments.json").write_text(json.dumps(people))
    return tmp_path / "mine"


def on_github(folder: Path, table: str, gate: int, **more: Any) -> list[int]:
    """The exit codes of the steps from the measurement on, and of the comment, with a heavytop that says this."""
    shutil.rmtree(folder / "result", ignore_errors=True)
    shutil.rmtree(folder.parent / "kept", ignore_errors=True)
    values = {"TABLE": table, "GATE": str(gate), "CONTRACT": more.pop("contract", "kept  one")}
    runner = Runner(EXAMPLE, folder, more.pop("event", "pull_request"), **values)
    done = runner.job("measure", skip="Fetch|Name|Install|Build", **more)
    shutil.rmtree(folder / "result", ignore_errors=True)  # another machine
    return [*done.values(), *runner.job("comment").values()]


def comments(folder: Path) -> list[tuple[int, str]]:
    return [(each["id"], each["body"]) for each in json.loads((folder.parent / "comments.json").read_text())]


@pytest.mark.slow
def test_one_comment_is_written_and_then_kept_up_to_date(folder: Path) -> None:
    others = comments(folder)
    end = f"[The run, with pages and reports]({RUN})\n"
    assert on_github(folder, "### heavytop: same", 0) == [0, 0, 0, 0]
    assert comments(folder) == [*others, (102, f"{MARKER}\n### heavytop: same\n{end}")]
    # something is worse: the step fails, and the same comment says so
    assert on_github(folder, "### heavytop: worse", 1) == [1, 0, 0, 0]
    assert comments(folder) == [*others, (102, f"{MARKER}\n### heavytop: worse\n{end}")]
    assert (folder.parent / "summary.md").read_text() == f"### heavytop: same\n{end}### heavytop: worse\n{end}"


@pytest.mark.slow
def test_the_comment_is_there_whatever_became_of_the_job(folder: Path) -> None:
    # bad input: what the program said of it
    assert on_github(folder, "", 2) == [2, 0, 0, 0]
    assert "nothing was compared\n```text\nsaid by gate\n```" in comments(folder)[-1][1]
    # cancelled while it measures, or before anything was kept
    assert on_github(folder, "", 0, cancelled_in="Measure, and compare with the baseline") == [0, 0, 0]
    assert "nothing was compared\n```text\nsaid by gate\n```" in comments(folder)[-1][1]
    runner = Runner(EXAMPLE, folder, "pull_request")
    shutil.rmtree(folder / "result", ignore_errors=True)
    shutil.rmtree(folder.parent / "kept")
    assert runner.job("comment") == {"Write the comment": 0}
    assert comments(folder)[-1][1] == f"{MARKER}\nheavytop compared nothing: [the run]({RUN}) ended before that.\n"
    # what is violated stands below the findings, and fences stay closed
    said = "kept      a  fine\nviolated  b  It says ```\n             twice.\nkept      c  fine"
    assert on_github(folder, "### heavytop: worse", 1, contract=said)[0] == 1
    body = comments(folder)[-1][1]
    assert "### heavytop: worse\n```text\nviolated  b  It says \n             twice.\n```\n" in body
    # a comment takes 65,536 characters, whatever anyone writes
    assert on_github(folder, "x" * 60_000, 1, contract=("violated " + "y" * 4000 + "\n") * 30)[0] == 1
    assert len(comments(folder)[-1][1]) < 65_536


def packages() -> str:
    """Where the other packages are, but not this project's own sources."""
    sources = str(ROOT / "src")
    return "\n".join(path for path in sys.path if path.endswith("site-packages") and path != sources) + "\n"


def git(folder: Path, *words: str) -> str:
    line = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false", *words]
    return subprocess.run(line, cwd=folder, check=True, capture_output=True, text=True).stdout


def heavytop_repository(folder: Path) -> Path:
    """This project as it stands, to be cloned; of the pins those that hold here, so that nothing is fetched."""
    files = ("hatch_build.py", "pyproject.toml", "README.md", "LICENSE", "action.yml")
    folder.mkdir()
    for name in files:
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("__pycache__"))
    pins = re.findall(
        r"^(([\w.-]+)==(\S+) \\\n(?: +--hash=\S+(?: \\)?\n)+)", (ROOT / "constraints/run.txt").read_text(), re.M
    )
    here = {re.sub("[-_.]+", "-", each.name).lower(): each.version for each in metadata.distributions()}
    held = [text for text, name, version in pins if here.get(name) == version]
    assert len(held) > 20
    (folder / "constraints").mkdir()
    (folder / "constraints" / "run.txt").write_text("".join(held))
    git(folder, "init", "--quiet")
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "-m", "heavytop")
    return folder


def project(folder: Path) -> str:
    """The example as a project of somebody else that depends on a package of theirs; returns where that is found."""
    place = folder.parent
    shutil.copytree(ROOT / "examples" / "mine", folder, dirs_exist_ok=True)
    toml = folder / "pyproject.toml"
    toml.write_text(toml.read_text().replace('version = "1.0"', 'version = "1.0"\ndependencies = ["weights==2.0"]'))
    code = (folder / "mine.py").read_text()
    (folder / "mine.py").write_text(
        code.replace("2 * q", "weights.TWO * q").replace("\n\nfrom", "\n\nimport weights\nfrom", 1)
    )
    plan = 'name = "tiny"\n[[measure]]\nkind = "work_precision"\ncases = ["euler"]\nhorizon = "1"\nsamples = 2\n'
    (folder / "gate.toml").write_text(plan + 'ladders = [{ integrator = "mine:rk4", steps = ["1/20"] }]\n')
    with zipfile.ZipFile(place / "weights-2.0-py3-none-any.whl", "w") as wheel:
        wheel.writestr("weights.py", "TWO = 2\n")
        info = "weights-2.0.dist-info"
        wheel.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: weights\nVersion: 2.0\n")
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        wheel.writestr(f"{info}/RECORD", "")
    git(folder, "init", "--quiet", "--initial-branch", "main")
    git(place, "init", "--quiet", "--bare", "origin.git")
    git(folder, "remote", "add", "origin", str(place / "origin.git"))
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "-m", "mine")
    return str(place)


@pytest.mark.slow
def test_a_baseline_is_proposed_and_a_mistake_found_in_a_fresh_environment(folder: Path) -> None:
    """Every step of shell as it stands, with heavytop installed from its repository, offline."""
    pytest.importorskip("hatchling")
    place = folder.parent
    (place / "bin" / "heavytop").unlink()
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place / "env"], check=True)
    (place / "env" / "lib" / version / "site-packages" / "others.pth").write_text(packages())
    more = {
        "HEAVYTOP": str(heavytop_repository(place / "heavytop")),
        "PATH": f"{place / 'env' / 'bin'}:{os.environ['PATH']}",
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": project(folder),
        "PIP_NO_BUILD_ISOLATION": "0",  # pip reads it the other way round
        "PYTHONPATH": "",
    }
    # by hand: a baseline on a branch of its own, and a pull request
    runner = Runner(EXAMPLE, folder, "workflow_dispatch", **more)
    done = runner.job("measure")
    assert set(done.values()) == {0}, (done, runner.said)
    assert len(done) == 7
    shutil.rmtree(folder / "result")
    assert runner.job("baseline") == {"Propose the baseline": 0}, runner.said
    assert "nothing was compared" in comments(folder)[-1][1]
    git(folder, "fetch", "--quiet", "origin", "heavytop-baseline")
    proposed = git(folder, "diff", "--name-only", "FETCH_HEAD~1", "FETCH_HEAD").split()
    assert ".heavytop/baseline/report.json" in proposed
    assert all(name.startswith(".heavytop/baseline/report.") for name in proposed)
    assert not any(b"\0" in (folder / name).read_bytes() for name in proposed)  # text
    # a pull request with a wrong coefficient, in the environment that the last job left
    code = (folder / "mine.py").read_text()
    (folder / "mine.py").write_text(code.replace("weights.TWO * q", "(weights.TWO + 1e-3) * q"))
    shutil.rmtree(folder / "result")
    runner = Runner(EXAMPLE, folder, "pull_request", **more)
    worse = runner.job("measure", skip="Fetch|Install heavytop|Go through")
    assert [name for name, code in worse.items() if code] == ["Measure, and compare with the baseline"], runner.said
    shutil.rmtree(folder / "result")
    assert runner.job("comment") == {"Write the comment": 0}
    body = comments(folder)[-1][1]
    assert body.startswith(f"{MARKER}\n### heavytop: Verdict: worse")
    assert "- Digits right" in body.splitlines()[3]
    # its only links go to the run: nothing in a comment lies beside a file
    assert set(re.findall(r"\]\(([^)]*)\)", body)) == {RUN}
