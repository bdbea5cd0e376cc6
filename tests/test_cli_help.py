"""Help that fits 80 columns, and completion for three shells."""

import os
import subprocess
from unittest import mock

import pytest
import typer

from heavytop.cli import app
from heavytop.cli.app import SHELLS
from heavytop.harness import BUILT_IN
from support import in_process

COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]
MOST = 55


def heavytop(*arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
    with mock.patch.dict(os.environ, more):
        return in_process.heavytop(*arguments)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_first_line_of_each_command_is_a_short_sentence(name: str) -> None:
    first = COMMANDS[name].help.partition("\n\n")[0]
    assert len(first) <= MOST
    assert first.endswith(".")
    assert "\n" not in first


def test_nothing_is_cut_at_80_columns() -> None:
    done = heavytop("--help", COLUMNS="80", TERMINAL_WIDTH="80")
    lines = done.stdout.splitlines()
    assert lines[0].startswith("Usage: heavytop ")
    assert max(map(len, lines)) <= 80
    assert "..." not in done.stdout.partition("Commands:")[2]
    for name in COMMANDS:
        assert COMMANDS[name].help.partition("\n\n")[0] in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_fits_80_columns_and_breaks_no_name(name: str) -> None:
    lines = heavytop(name, "--help", COLUMNS="80", TERMINAL_WIDTH="80").stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert not any(line.rstrip().endswith("-") for line in lines)
    assert not any("list[" in line for line in lines)


LONG = {"run": "minutes", "selftest": "minute"} | dict.fromkeys(("figures", "audit", "reference", "score"), "seconds")


@pytest.mark.parametrize(("name", "words"), list(LONG.items()))
def test_what_takes_long_says_how_long(name: str, words: str) -> None:
    assert words in " ".join(COMMANDS[name].help.split())


@pytest.mark.slow
@pytest.mark.parametrize("shell", SHELLS)
def test_the_completion_script_is_printed_and_completes(shell: str) -> None:
    script = heavytop("--completion", shell)
    assert script.returncode == 0
    assert f"complete_{shell}" in script.stdout
    assert "_HEAVYTOP_COMPLETE" in script.stdout
    asked = {
        "bash": {"COMP_WORDS": "heavytop sco", "COMP_CWORD": "1"},
        "zsh": {"_TYPER_COMPLETE_ARGS": "heavytop sco"},
        "fish": {"_TYPER_COMPLETE_ARGS": "heavytop sco", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
    }[shell]
    done = heavytop(_HEAVYTOP_COMPLETE=f"complete_{shell}", **asked)
    assert "score" in done.stdout
    assert "selftest" not in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "names"),
    [("run --plan g", {"growth", "gate"}), ("list --case eu", {"euler"}), ("score --case eu", {"euler"})],
)
def test_names_of_plans_and_cases_are_completed(line: str, names: set[str]) -> None:
    done = heavytop(_HEAVYTOP_COMPLETE="complete_bash", COMP_WORDS=f"heavytop {line}", COMP_CWORD="3")
    assert set(done.stdout.split()) == names


@pytest.mark.slow
def test_bash_reads_its_script_and_another_shell_is_refused() -> None:
    script = heavytop("--completion", "bash").stdout
    checked = subprocess.run(["bash", "-n"], input=script, text=True, capture_output=True, check=False)
    assert checked.returncode == 0, checked.stderr
    refused = heavytop("--completion", "tcsh")
    assert (refused.returncode, "bash, zsh, fish" in refused.stderr) == (2, True)


def test_the_help_of_run_names_every_plan_that_ships() -> None:
    help_of = {parameter.name: parameter.help for parameter in COMMANDS["run"].params}
    named, _, _ = help_of["plan"].partition(", or a TOML file")
    assert set(BUILT_IN) <= set(named.split(", "))
