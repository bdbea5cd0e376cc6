"""The library of audited claims: its entries, their twins, and the verdicts of the quick ones."""

import re
import tomllib

import pytest

from heavytop.features.claims.audit.audit import audit_claim, claim_from_table, own_system
from heavytop.features.claims.audit.judge import verdict_of
from heavytop.features.claims.library.entry import FOLDER, library, split

QUICK = (
    "area-integral", "energy", "energy-gamma-down", "free-body-delta", "gyrostat-area", "gyrostat-area-without-rotor",
    "hess-relation", "kovalevskaya-1889", "kovalevskaya-1889-gamma-up", "kovalevskaya-momenta",
    "kovalevskaya-momenta-encyclopedia", "kovalevskaya-yehia-gyrostat", "kovalevskaya-yehia-plus", "lagrange-gyrostat",
    "lagrange-spin", "lagrange-spin-of-three-moments", "lagrange-steady-precession", "fast-top-precession",
    "plotnikov-nutation-any-vertical", "silva-free-symmetric-body", "sretensky-any-area", "steklov-1899",
    "steklov-1899-b2-sign", "value-exudyn-heavy-top-rk4", "value-kynema-precession", "zhukovsky-volterra-momentum",
    "zhukovsky-volterra-body-momentum",
)  # fmt: skip
"""Each takes less than 0.2 s; `heavytop audit --library` audits them all."""


@pytest.mark.parametrize("name", library())
def test_an_entry_says_where_it_was_published_and_what_to_learn(name: str) -> None:
    entry = library()[name]
    assert entry.tags
    assert len(entry.note) >= 15
    assert len(entry.title) <= 80  # it is the name of the claim in reports, where no more is printed
    assert 1700 <= entry.source.year <= 2100


def test_titles_name_one_entry_each() -> None:
    titles = [entry.title for entry in library().values()]
    assert len(titles) == len(set(titles))


def test_every_refuted_entry_is_corrected_by_one_that_holds() -> None:
    entries = library().values()
    corrected = {wrong for entry in entries for wrong in entry.corrected}
    assert corrected == {entry.id for entry in entries if entry.expects == "refuted"}
    assert all(entry.expects == "holds" for entry in entries if entry.corrected)


def test_a_usual_misprint_is_not_laid_at_an_authors_door() -> None:
    for entry in library().values():
        if "usual misprint" in entry.tags:
            assert entry.source.authors == ["unattributed"], entry.id


def test_what_could_not_be_read_is_listed_and_has_no_entry() -> None:
    """A doi of the list is no entry's own, unless the entry says that it was restated or read in part."""
    wanted = set(re.findall(r"10\.\d{4,}/\S+?(?=[,\s|])", (FOLDER / "WANTED.md").read_text("utf-8")))
    assert wanted
    for entry in library().values():
        if entry.source.doi in wanted:
            assert entry.read != "the text", entry.id


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_the_verdict_is_the_expected_one(name: str) -> None:
    entry, table = split(tomllib.loads((FOLDER / f"{name}.toml").read_text("utf-8")), name)
    assert entry is not None
    report = audit_claim(claim_from_table(table, name))
    assert report.system == own_system(name)
    rows = report.rows
    assert verdict_of(rows) == entry.expects
    if entry.expects == "refuted":
        assert any(row.witness for row in rows if row.holds is False)
