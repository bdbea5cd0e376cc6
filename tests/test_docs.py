"""Every code block of README and docs runs, and the pages of the site keep to their own rules."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import tomllib
from pathlib import Path
from unittest import mock

import pytest
import typer

import heavytop as ht
from heavytop.cli import app
from heavytop.features.kinds import KINDS
from heavytop.harness import plan
from heavytop.integrate.registry import commands_in
from heavytop.report.compare import noise
from heavytop.report.render.terminal import brief
from support import audits, from_a_wheel, in_process
from support.documents import PAGES, ROOT, Block, blocks, folder_like_a_checkout, run_shell
from support.helpers import named_peers

NOT_CODE = {
    "text",
    "{eval-rst}",
    "{toctree}",
    "{image}",
    "{figure}",
    "{note}",
    "{include} ../CHANGELOG.md",
    *(f"{{include}} _build/{name}.md" for name in ("claims", "commands", "engines", "public")),
    "{thumbnails}",
}
CELL = "{code-cell} ipython3"
MOST_LINES = 10
"""Of a picture in the gallery."""
DOCS = ROOT / "docs"


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=name)
def test_the_code_of_a_page_runs(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    environment = folder_like_a_checkout(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    audits.here(monkeypatch)
    if "--language c\n" in page.read_text("utf-8") and any("make -C" in block.text for block in to_run(page)):
        for program in ("cc", "make"):
            if shutil.which(program) is None:
                pytest.skip(f"there is no {program} here")
    names: dict[str, object] = {"__name__": "page"}
    printed = ""
    for block in to_run(page):
        where = f"{name(page)}:{block.line}"
        if block.printed:
            assert block.text in printed, f"{where}\n{printed}"
            continue
        if block.file:
            (tmp_path / block.file).write_text(block.text, "utf-8")
        if block.language == "python":
            exec(compile(block.text, where, "exec"), names)
        elif block.language == "sh":
            done = run_here(block.text, tmp_path, environment) or run_shell(block.text, tmp_path, environment)
            assert done.returncode == 0, f"{where}\n{done.stdout}\n{done.stderr}"
            printed = "".join(line.rstrip() + "\n" for line in done.stdout.splitlines())
            shorten_gate(tmp_path / "mine" / "gate.toml")
        elif block.language == "toml":
            read_toml(block.text, tmp_path)
        else:
            (tmp_path / f"motion.{block.language}").write_text(block.text, "utf-8")
            done = heavytop_here(f"heavytop score motion.{block.language}", tmp_path, environment)
            assert done.returncode == 0, f"{where}\n{done.stderr}"
    if any(block.language == "python" and "print(" in block.text for block in to_run(page)):
        assert capsys.readouterr().out
    tables = [each._repr_html_() for each in names.values() if isinstance(each, TABLES)]
    assert all(html.count("<table>") == html.count("</table>") == 1 for html in tables)


def shorten_gate(plan: Path) -> None:
    """Leave of the plan of a starter the rows whose numbers a page shows; .ci/run runs all of it, from a wheel."""
    if plan.exists():
        head, *tables = re.split(r"^(?=\[\[)", plan.read_text("utf-8"), flags=re.M)
        shown = "".join(table for table in tables if re.search('kind = "(local_error|work_precision)"', table))
        plan.write_text(head + re.sub(r'"1e-2".*(?="eps")|, "generic"', "", shown), "utf-8")


TABLES = (ht.Trajectory, ht.Reference, ht.Score, ht.Report, ht.Comparison, ht.Audit)


def to_run(page: Path) -> list[Block]:
    """The blocks of code without a reason not to run them.

    Not here: of the README the two commands and the ways in, which .ci/run runs (the latter from a wheel), and
    cells, which run when the site is built.
    """
    found = [
        block
        for block in blocks(page)
        if (block.language not in NOT_CODE | {CELL} or block.printed) and not block.not_run
    ]
    if page != ROOT / "README.md":
        return found
    doors = tuple(f"heavytop {key}" for key in from_a_wheel.LIMITS)
    return [block for block in found if block.language and not any(door in block.text for door in doors)]


HERE = re.compile(
    r"(?:\.venv/bin/)?heavytop (?:audit|body|check-integrator|claims|compare|docs|export|figures|gate|history|list|new"
    r"|power|propagate|reference|score|show)\b"
)
"""Commands that need no process of their own: neither signals nor streams are their point, nor what is installed."""
FOR_A_SHELL = re.compile(r"[|&;<>$`*?~{}()\\]")


def run_here(text: str, folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str] | None:
    """What run_shell returns: each of those commands without a process, all other lines by a shell each.

    None where the block has none of those commands, or lines that belong together.
    """
    lines = [line for line in text.replace("\\\n", " ").splitlines() if line.strip() and not line.startswith("#")]
    if not any(map(is_for_here, lines)) or any(re.match(r" |cd |[A-Za-z_]+=|.*<<", line) for line in lines):
        return None
    out = errors = ""
    for line in lines:
        done = heavytop_here(line, folder, environment) if is_for_here(line) else run_shell(line, folder, environment)
        out, errors = out + done.stdout, errors + done.stderr
        if done.returncode:
            return subprocess.CompletedProcess(line, done.returncode, out, errors)
    return subprocess.CompletedProcess(text, 0, out, errors)


def is_for_here(line: str) -> bool:
    """One of those commands, with nothing for a shell but quotes and a comment."""
    bare = re.sub(r"'[^']*'|\"[^\"$`\\]*\"", "", line).partition(" # ")[0]
    return bool(HERE.match(line)) and not FOR_A_SHELL.search(bare)


def heavytop_here(line: str, folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """The command in this process; its exit code is 0 where it is what its comment says."""
    expected = re.search(r"\s# exit code (\d+)\b", line)
    with mock.patch.dict(os.environ, environment):
        done = in_process.heavytop(*shlex.split(line, comments=True)[1:], cwd=folder)
    as_said = done.returncode == (int(expected[1]) if expected else 0)
    done.returncode = 0 if as_said else done.returncode or 1
    return done


def without_options(cell: str) -> str:
    """A cell of a notebook page without its options, ``:tags: [...]``."""
    return re.sub(r"^:[a-z-]+:.*$", "", cell, flags=re.M)


def read_toml(text: str, folder: Path) -> None:
    """A plan, a policy, a claim or the entry points of a package, read as the program reads it."""
    content, file = tomllib.loads(text), folder / "block.toml"
    file.write_text(text, "utf-8")
    if "measure" in content:
        assert list(plan.expand(plan.load(str(file), KINDS)[0]))
    elif "project" in content:
        points = content["project"]["entry-points"]["heavytop.peers"]
        named_peers(folder, {}, *(f"{key} = {value}" for key, value in points.items()))
    elif "integrator" in content:
        assert commands_in(file)
    elif "kind" in content:
        assert ht.audit(file).verdict in ("holds", "refuted")
    else:
        assert noise.load(file) != noise.Policy()


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_block_says_what_it_is_and_why_it_is_not_run(page: Path) -> None:
    known = {"sh", "python", CELL, "toml", "json", "csv", *NOT_CODE}
    for block in blocks(page):
        two_commands = page.name == "README.md" and "&& .venv/bin/heavytop run\n" in block.text
        assert two_commands or block.language in known, f"{name(page)}:{block.line}: {block.language!r}"
        assert not block.not_run or len(block.not_run) > 15, "a reason"
    for line in page.read_text("utf-8").splitlines():
        assert not re.match(r"    (heavytop|pip|python|\.venv/)", line), f"{line!r} belongs into a fence"


def commands(text: str) -> list[str]:
    """Lines that start with the program, without what belongs to the shell."""
    lines = [line.strip().removeprefix(".venv/bin/") for line in text.splitlines()]
    return [SHELL.split(line)[0].strip() for line in lines if re.match("heavytop [a-z]", line)]


SHELL = re.compile(r"\|\||&&|;|>|&$|\s#\s")
NOT_RUN = [command for page in PAGES for block in blocks(page) if block.not_run for command in commands(block.text)]


@pytest.mark.slow
@pytest.mark.parametrize("command", NOT_RUN)
def test_the_program_understands_what_is_too_long_to_run(command: str) -> None:
    asked, *arguments = shlex.split(command)[1:]
    known = typer.main.get_command(app).commands
    assert asked in known
    known[asked].make_context(asked, arguments)


def test_the_reference_of_the_command_line_has_all_of_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    import command_reference

    first, *sections = command_reference.markdown().split("\n\n## ")
    known = typer.main.get_command(app).commands
    assert "--completion SHELL" in first
    assert [section.partition("\n")[0] for section in sections] == [f"heavytop {name}" for name in known] + [
        "Exit codes"
    ]
    for section, command in zip(sections, known.values(), strict=False):
        assert all(name in section for parameter in command.params for name in parameter.opts)
        assert all(len(re.findall(r"(?<!\\)\|", line)) == 3 for line in section.splitlines() if line.startswith("|"))
    assert "\\[default: default\\]" in sections[0]
    assert "0 good, 1 a finding" in sections[-1]


def test_commands_are_found_and_wrong_ones_refused() -> None:
    assert len(NOT_RUN) > 3
    known = typer.main.get_command(app).commands
    with pytest.raises(Exception, match="No such option"):
        known["compare"].make_context("compare", ["a", "b", "--no-such-option"])


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_page_links_to_what_is_there(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text("utf-8")):
        assert "://" in link or (page.parent / link).exists(), link


def test_every_python_file_that_a_page_names_is_there() -> None:
    there = {file.relative_to(ROOT).as_posix() for file in (*ROOT.glob("*.py"), *ROOT.glob("[!.]*/**/*.py"))}
    of_users_and_others = {"heavyTop.py", "mine.py", "NAME.py"}
    named = {(name(page), file) for page in PAGES for file in re.findall(r"`([\w/]+\.py)`", page.read_text("utf-8"))}
    known = {(page, file) for page, file in named if any(f"/{each}".endswith(f"/{file}") for each in there)}
    assert {each for each in named - known if each[1].split("/")[-1] not in of_users_and_others} == set()


@pytest.mark.slow
def test_a_block_that_fails_is_seen(tmp_path: Path) -> None:
    environment = folder_like_a_checkout(tmp_path)
    assert run_shell("false # exit code 1: as said\ntrue\n", tmp_path, environment).returncode == 0
    assert run_here("heavytop list\nheavytop show nowhere  # exit code 2\n", tmp_path, environment).returncode == 0
    for text in ("heavytop show nowhere\nheavytop list\n", "heavytop list  # exit code 1\n"):
        assert run_here(text, tmp_path, environment).returncode != 0
    for text in ("heavytop list | cat\n", "heavytop list > a\n", "heavytop run --plan smoke\n", "cat a\nfalse\n"):
        assert run_here(text, tmp_path, environment) is None
    for text in ("cd docs\nheavytop list\n", "cat <<X\nheavytop list\nX\n", "a=1\nheavytop list\n"):
        assert run_here(text, tmp_path, environment) is None
    mixed = run_here("echo one > a\nheavytop list\ncat a | tr o 0\n", tmp_path, environment)
    assert mixed is not None
    assert (mixed.returncode, mixed.stdout.endswith("0ne\n"), "kovalevskaya" in mixed.stdout) == (0, True, True)
    for text in ("heavytop list\nfalse\n", "false\nheavytop list\n", "cat none | cat\nheavytop list\n"):
        assert run_here(text, tmp_path, environment).returncode != 0
    for text in ("false\ntrue\n", "true # exit code 1\n", "false | true\n", "heavytop audit none.toml # exit code 3\n"):
        assert run_shell(text, tmp_path, environment).returncode != 0
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- not run: why -->\n~~~sh\na\n```\n~~~\n<!-- file: b.py -->\n\n```python\nc\n```\n```\nd\n```\n"
    )
    assert blocks(page) == [
        Block(2, "sh", "a\n```\n", "why", ""),
        Block(8, "python", "c\n", "", "b.py"),
        Block(11, "", "d\n", "", ""),
    ]


def test_every_public_name_is_in_the_reference_once() -> None:
    told = re.findall(r"^\.\. (?:auto|py:)\w+:: (\w+)$", (DOCS / "api.md").read_text("utf-8"), re.M)
    of_plug_ins = {"double_peer", "check_integrator", "Request", "Solution"}
    assert sorted(told) == sorted([*ht.__all__, *of_plug_ins, *ht.plot.__all__])


def test_a_picture_of_the_gallery_is_a_few_lines_of_code() -> None:
    pictures = [block for block in blocks(DOCS / "gallery.md") if block.language == CELL and "plt.show()" in block.text]
    assert len(pictures) >= 8
    for block in pictures:
        lines = [line for line in without_options(block.text).splitlines() if line.strip()]
        assert len(lines) <= MOST_LINES, f"line {block.line}: {len(lines)} lines"


def test_a_stranger_sees_a_result_in_the_first_lines_of_a_short_readme() -> None:
    lines = (ROOT / "README.md").read_text("utf-8").splitlines()
    assert len(lines) <= 120
    (result,) = [block for block in blocks(ROOT / "README.md") if block.language == "text"]
    assert result.line <= 40
    assert result.text in (DOCS / "score.md").read_text("utf-8"), "which runs the same commands, and compares"


def test_the_page_of_gates_shows_the_example_as_it_is() -> None:
    shown = [block.text for block in blocks(DOCS / "gate.md")]
    for file in ("mine.py", "gate.toml"):
        assert (ROOT / "examples" / "mine" / file).read_text("utf-8") in shown


@pytest.mark.slow
def test_what_several_pages_say_of_the_peers_is_what_the_report_says() -> None:
    report = ht.read_report(ROOT / "results" / "peers")
    said = " ".join(brief(report, report.rows, KINDS).split())
    ratios = re.findall(r"heyoka double is ([\d.]+) × as fast as cyrk:", said)
    assert len(ratios) > 2
    low, high = min(ratios, key=float), max(ratios, key=float)
    pages = {
        each: " ".join((ROOT / each).read_text("utf-8").split()) for each in ("docs/choose.md", "results/README.md")
    }
    assert f"it is {low} to {high} times as fast" in pages["docs/choose.md"]
    assert re.search(rf"heyoka is {low} \([^)]+\) to {high} times \([^)]+\) as fast", pages["results/README.md"])
    minutes = {re.search(r"plan peers\b[^;]*?, (\w+) minutes", text)[1] for text in pages.values()}
    minutes |= {re.search(r"peers\s+(\w+),", typer.main.get_command(app).commands["run"].help)[1]}
    assert len(minutes) == 1


def test_every_page_is_in_a_table_of_contents() -> None:
    listed: set[Path] = {DOCS / "index.md"}
    for page in PAGES:
        for block in blocks(page):
            if block.language == "{toctree}":
                entries = [line for line in block.text.splitlines() if not line.startswith(":")]
                listed |= {found for entry in entries for found in page.parent.glob(f"{entry}.*")}
    there = [*(page for page in PAGES if DOCS in page.parents), *DOCS.glob("notebooks/*.ipynb")]
    assert [page for page in there if page not in listed] == []


def test_the_notebooks_are_without_outputs() -> None:
    notebooks = sorted((DOCS / "notebooks").glob("*.ipynb"))
    assert len(notebooks) >= 3
    for file in notebooks:
        cells = json.loads(file.read_text("utf-8"))["cells"]
        assert cells[0]["cell_type"] == "markdown"
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells), file.name
