"""The field's own terms: docs/glossary.txt says which phrases are refused, and what to say in their place."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RULES = [
    line.split(" => ")
    for line in (ROOT / "docs" / "glossary.txt").read_text("utf-8").splitlines()
    if not line.startswith("#")
]
REFUSED = re.compile("|".join(rf"\b(?:{phrase})\b" for phrase, _ in RULES), re.IGNORECASE)
QUOTED = ("one might suspect", '"arithmetic") == "whole numbers"', ", and no digit is left from t = ")
"""What a source says in its own words, and two texts in the rows of former reports, which stay readable."""
TEXTS = [
    *(
        path
        for folder in ("src", "docs", "examples")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".md", ".toml", ".html", ".j2") and "_build" not in path.parts
    ),
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "results/README.md")),
]


def refused(text: str) -> list[str]:
    return [found[0] for found in REFUSED.finditer(text)]


@pytest.mark.slow
def test_no_refused_phrase_stands_in_code_docs_or_messages() -> None:
    found = {}
    for path in TEXTS:
        text = path.read_text("utf-8")
        for quoted in QUOTED:
            text = text.replace(quoted, "")
        if wrong := refused(text):
            found[str(path.relative_to(ROOT))] = wrong
    assert not found, "docs/glossary.txt says what to write"


@pytest.mark.parametrize("text", ["Integrators of others", "no digit is left", "gave up", "a whole number", "was lent"])
def test_the_rules_find_a_refused_phrase(text: str) -> None:
    assert refused(text)


@pytest.mark.parametrize("text", ["ladders = [", "talent", "gives upper bounds", "excellent"])
def test_the_rules_leave_other_words_and_documented_keys(text: str) -> None:
    assert not refused(text)
