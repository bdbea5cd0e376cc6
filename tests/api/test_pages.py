"""The pages that `heavytop docs` prints, and the texts of the program that name them."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer

from heavytop.api import pages
from heavytop.cli import app
from heavytop.errors import InputError
from support import in_process

ROOT = Path(__file__).parents[2]
NAMED = re.compile(r"`heavytop docs ([a-z-]+)`")
FILE = re.compile(r"docs/[\w/-]+\.md")


def texts(path: Path) -> Iterator[str]:
    """The strings of a module that are no docstrings, nor notes under a name."""
    tree = ast.parse(path.read_text("utf-8"))
    notes = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in notes:
            yield node.value


def test_messages_and_help_name_pages_that_an_installation_has() -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    said = [str(command.help) for command in commands.values()]
    named: set[str] = set()
    for path in (path for path in (ROOT / "src").rglob("*") if path.suffix in (".py", ".toml")):
        text = path.read_text("utf-8")
        named |= set(NAMED.findall(text))
        if path.suffix == ".py" and FILE.search(text):
            said += texts(path)
    assert [text for text in said if FILE.search(text)] == []
    assert len(named) > 5
    assert named <= set(pages.topics())


def test_a_page_is_what_its_file_says_and_has_nothing_that_only_the_site_can_show() -> None:
    assert in_process.printed("docs", "score") == (ROOT / "docs" / "score.md").read_text("utf-8")
    listed = in_process.printed("docs").splitlines()
    assert [line.split()[0] for line in listed] == list(pages.topics())
    for name, title in pages.topics().items():
        assert title
        assert set(re.findall(r"^```(\{.*)", pages.page(name), re.M)) <= {"{image}", "{figure}", "{note}", "{math}"}, (
            name
        )
    assert pages.page("docs/score.md") == pages.page("score")
    for name in ("", "../README", "no such page"):
        with pytest.raises(InputError, match="topic must name a page"):
            pages.page(name)
    with pytest.raises(InputError) as caught:
        pages.page("Compere")
    assert caught.value.remedy == "Did you mean compare? `heavytop docs` lists the topics."


def test_a_page_has_formulas_as_text() -> None:
    for name in pages.topics():
        prose = re.sub(r"^(```|~~~)(?!text).*?^\1$", "", pages.page(name), flags=re.MULTILINE | re.DOTALL)
        assert not re.findall(r"\$\$|\\[A-Za-z]+|[\^_]\{", prose), name
    assert "q = tanh²(α t/√2),\nsin θ = q/(2 − q)," in pages.page("claim")
    assert "Ω = (α/2 sin φ, α sin θ, 2α cos θ)," in pages.page("claim")
    assert "ε = 2^(1 − bits)" in pages.page("choose")
    assert "ξ(0) = e₁ − 2 (v·e₁/(v·v)) v\n= (1 − γ₁²/(1 − γ₃), −γ₁γ₂/(1 − γ₃), γ₁)" in pages.page("outputs")
    assert "Sₖ₊₁ += l" in pages.page("multiword")


def test_without_pages_the_cause_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "_INSTALLED", tmp_path)
    with pytest.raises(InputError, match="not installed"):
        pages.topics()


def test_on_a_terminal_a_page_is_laid_out(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    with pytest.raises(typer.Exit):
        typer.main.get_command(app).commands["docs"].callback(topic="compare")  # type: ignore[attr-defined]
    printed = capsys.readouterr().out
    assert "Compare reports" in printed
    assert "| verdict |" not in printed


def test_a_page_names_the_command_that_prints_a_table_of_the_site() -> None:
    for name in pages.topics():
        before, *rest = pages.page(name).split("(The site has a table here; the command above prints its numbers.)")
        assert not rest or before.rstrip().splitlines()[-1].startswith("`heavytop "), name
