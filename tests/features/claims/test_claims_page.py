"""The page of audited claims: what stands in an entry is shown, none of it is read as markup."""

import copy
import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import msgspec
import pytest

import claim_library
import heavytop as ht
from claim_library import Equation, Library, Published, is_current
from claims_page import page
from heavytop.features.claims.audit.audit import audit_claim, claim_from_table
from heavytop.features.claims.library.entry import Entry
from support.claim_tables import top, upright

ENTRY: dict[str, Any] = {
    "id": "spin",
    "title": "Spin of a *symmetric* top",
    "language": "en",
    "read": "the text",
    "status": "as published",
    "expects": "holds",
    "note": "Where | two_moments are <b>equal</b>.",
    "source": {"authors": ["L. & Co"], "year": 1788, "title": "On `tops`", "doi": "10.1/a_b"},
}
SPIN: dict[str, Any] = {
    "kind": "integral",
    "parameters": {"A": "2", "C": "1"},
    "top": top("A A C", "0 0 1/2"),
    "integral": {"value": "Omega3"},
}
NUMBERS: dict[str, Any] = {
    "kind": "value",
    "top": top("3 2 1", "0 0 1/2"),
    "start": {"omega": ["1/10", "2/5", "9/10"], "gamma": ["3/5", "0", "4/5"]},
    "value": [
        {"time": "0", "quantity": "omega", "component": 2, "number": "0.40"},
        {"time": "0", "quantity": "energy", "number": "9.99"},
    ],
}


def published(claim: dict[str, Any], **changes: Any) -> Published:
    entry = msgspec.convert(copy.deepcopy(ENTRY) | changes, Entry)
    found = audit_claim(claim_from_table(ENTRY | changes | claim, "x"))
    rows = [msgspec.convert(row.to_json(), Equation) for row in found.rows]
    said = {"system": found.system, "kind": found.kind, "verdict": found.verdict, "reason": "", "solves": []}
    return Published(entry=entry, claim=claim, equations=rows, **said)


@pytest.fixture(scope="module")
def shown() -> str:
    misprint = SPIN | {"integral": {"value": "Omega3 + Omega1^2/2"}}
    motion = upright("A", SPIN["top"], parameters=SPIN["parameters"])
    wrong = published(misprint, id="misprint", title="Wrong", expects="refuted")
    claims = [published(SPIN, corrects="misprint"), wrong, published(NUMBERS, id="numbers"), published(motion, id="m")]
    return page(Library(library="heavytop library of claims", version="1.0.0", claims=claims))


def test_every_claim_stands_under_its_verdict_and_in_the_table(shown: str) -> None:
    heads = re.findall(r"^## (.+)$", shown, re.M)
    assert heads == ["Refuted", "Proven"]
    proven = shown[shown.index("## Proven") :]
    assert [name for name in ("spin", "m", "misprint", "numbers") if f"({name})=" in proven] == ["spin", "m"]
    assert "4 claims: 2 proven, 2 refuted." in shown
    assert shown.count("](#spin)") == 2  # the table, and the misprint that it corrects
    assert "Corrects [Wrong](#misprint)." in proven


def test_formulas_conditions_witness_and_numbers_are_there(shown: str) -> None:
    refuted = shown[shown.index("(misprint)=") : shown.index("(numbers)=")]
    assert "<mfrac>" in refuted
    assert "<mi>Ω</mi>" in refuted
    for part in (
        "<details><summary>Conditions of the proofs</summary>",
        "Witness: ",
        "±",
        "<td>0.40</td><td>2 of 2</td>",
        "<td>energy</td>",
        "<td>9.99</td><td>0 of 3</td>",
        "[doi:10.1/a\\_b](<https://doi.org/10.1/a_b>)",
    ):
        assert part in shown


def test_nothing_of_an_entry_becomes_markup(shown: str) -> None:
    assert "\\*symmetric\\*" in shown
    assert "\\<b\\>equal\\</b\\>" in shown
    for block in re.findall(r'<div class="claim">\n.*?\n</div>', shown, re.S):
        assert "\n\n" not in block
        ElementTree.fromstring(block.replace("&#x2062;", "").replace("&#x2061;", ""))


def test_a_document_is_current_only_of_the_entries_as_they_stand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = published(SPIN, note="a")
    document = Library(library="x", version="1.0.0", claims=[found])
    stated = {"spin": found.entry}
    monkeypatch.setattr(claim_library, "library", lambda: stated)
    monkeypatch.setattr(claim_library, "_claim", lambda entry: SPIN)
    assert is_current(document)
    monkeypatch.setattr(claim_library, "_claim", lambda entry: SPIN | {"integral": {"value": "Omega1"}})
    assert not is_current(document)
    monkeypatch.setattr(claim_library, "_claim", lambda entry: SPIN)
    stated["spin"] = msgspec.structs.replace(found.entry, note="b")
    assert not is_current(document)
    unexpected = msgspec.structs.replace(found, verdict="undecided")
    stated["spin"] = found.entry
    assert not is_current(Library(library="x", version="1.0.0", claims=[unexpected]))
    stated["more"] = msgspec.structs.replace(found.entry, id="more")
    assert not is_current(document)


@pytest.mark.slow
def test_the_results_are_of_the_entries_as_they_stand() -> None:
    """Else: remake them, as results/README.md says."""
    folder = Path(__file__).parents[3] / "results" / "claims"
    document = json.loads((folder / "library.json").read_bytes())
    assert msgspec.to_builtins(msgspec.convert(document, Library)) == document
    assert json.loads((folder / "library.schema.json").read_bytes())["$ref"] == "#/$defs/Library"
    assert is_current(msgspec.convert(document, Library, strict=True))
    assert {row.case for row in ht.read_report(folder).rows} == {each["entry"]["id"] for each in document["claims"]}
