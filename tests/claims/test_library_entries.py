"""The library of audited claims: the form of its entries, their twins, and the verdicts of the quick ones."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import heavytop.claims
from heavytop.claims.from_file import claim_from_table
from heavytop.claims.judge import judge, verdict_of

LIBRARY = Path(heavytop.claims.__file__).parent / "library"
ABOUT = {
    "id": str, "title": str, "language": str, "read": str, "status": str, "tags": list, "expects": str, "note": str,
    "source": dict,
}  # fmt: skip
MAY_HAVE = {"aliases", "corrects"}
QUICK = (
    "area-integral", "energy", "energy-gamma-down", "free-body-delta", "gyrostat-area", "gyrostat-area-without-rotor",
    "hess-relation", "kovalevskaya-1889", "kovalevskaya-1889-gamma-up", "kovalevskaya-momenta",
    "kovalevskaya-momenta-encyclopedia", "kovalevskaya-yehia-gyrostat", "kovalevskaya-yehia-plus", "lagrange-gyrostat",
    "lagrange-spin", "lagrange-spin-of-three-moments", "lagrange-steady-precession", "fast-top-precession",
    "plotnikov-nutation-any-vertical", "silva-free-symmetric-body", "sretensky-any-area", "steklov-1899",
    "steklov-1899-b2-sign", "zhukovsky-volterra-momentum", "zhukovsky-volterra-body-momentum",
)  # fmt: skip
"""Each takes less than 0.2 s; `heavytop audit --library` audits them all."""


def _tables() -> dict[str, dict[str, Any]]:
    return {path.stem: tomllib.loads(path.read_text("utf-8")) for path in sorted(LIBRARY.glob("*.toml"))}


TABLES = _tables()


def _corrects(table: dict[str, Any]) -> list[str]:
    found = table.get("corrects", [])
    return [found] if isinstance(found, str) else list(found)


def test_there_are_entries_of_both_kinds() -> None:
    verdicts = [table["expects"] for table in TABLES.values()]
    assert len(verdicts) >= 45
    assert verdicts.count("refuted") >= 15
    assert verdicts.count("holds") >= 20


@pytest.mark.parametrize("name", TABLES)
def test_an_entry_has_the_form(name: str) -> None:
    table = TABLES[name]
    assert table["id"] == name
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name)
    for key, kind in ABOUT.items():
        assert isinstance(table[key], kind), key
        assert table[key], key
    assert table["expects"] in ("holds", "refuted", "undecided")
    assert re.fullmatch(r"the text|an abstract|restated .+", table["read"])
    assert re.fullmatch(r"as published|corrected here|superseded by [a-z0-9-]+", table["status"])
    source = table["source"]
    assert source["authors"]
    assert all(isinstance(author, str) and author for author in source["authors"])
    assert isinstance(source["year"], int)
    assert 1700 <= source["year"] <= 2100
    assert source["title"]
    assert len(table["title"]) <= 80 or table["kind"] == "value"


def test_titles_and_aliases_name_one_entry_each() -> None:
    names = [text for table in TABLES.values() for text in (table["title"], *table.get("aliases", []))]
    assert len(names) == len(set(names))


def test_every_refuted_entry_is_corrected_by_one_that_holds() -> None:
    corrected = {wrong for table in TABLES.values() for wrong in _corrects(table)}
    assert corrected == {name for name, table in TABLES.items() if table["expects"] == "refuted"}
    assert all(table["expects"] == "holds" for table in TABLES.values() if _corrects(table))


def test_a_usual_misprint_is_not_laid_at_an_authors_door() -> None:
    for name, table in TABLES.items():
        if "usual misprint" in table["tags"]:
            assert table["source"]["authors"] == ["unattributed"], name


@pytest.mark.parametrize("name", QUICK)
def test_the_verdict_is_the_expected_one(name: str) -> None:
    table = {key: value for key, value in TABLES[name].items() if key not in ABOUT and key not in MAY_HAVE}
    claim = claim_from_table({**table, "name": name}, name)
    rows = judge(claim.statements(claim.about(None)), claim.setting)
    assert verdict_of(rows) == TABLES[name]["expects"]
    if TABLES[name]["expects"] == "refuted":
        assert any(row.witness for row in rows if row.holds is False)
