"""The library of claims: form of an entry, verdicts against the expected ones, the cache, the document for others."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

import claim_library
import heavytop as ht
from heavytop.features.claims import command
from heavytop.features.claims.audit import audit as auditing
from heavytop.features.claims.audit.audit import claim_from_table
from heavytop.features.claims.library import entry as entries
from heavytop.files import cache_folder
from support import in_process

HEAD: dict[str, Any] = {
    "id": "spin-of-a-symmetric-top",
    "title": "Lagrange's integral",
    "language": "en",
    "read": "the text",
    "status": "as published",
    "expects": "holds",
    "note": "Constant where two moments are equal and the centre of mass is on the third axis.",
    "tags": ["lagrange"],
    "source": {"authors": ["J.-L. Lagrange"], "year": 1788, "title": "Mécanique analytique"},
}
CLAIM: dict[str, Any] = {
    "kind": "integral",
    "parameters": {"A": ["2", "3"], "C": ["1", "4"]},
    "top": {"inertia": ["A", "A", "C"], "weight": "1", "centre": ["0", "0", "1"]},
    "integral": {"value": "Omega3"},
}
MISPRINT = {"id": "spin-of-the-wrong-axis", "expects": "refuted", "title": "The spin about another axis"}


def toml(table: dict[str, Any]) -> str:
    """Enough of TOML for an entry."""

    def value(item: Any) -> str:
        if isinstance(item, dict):
            return "{" + ", ".join(f"{key} = {value(each)}" for key, each in item.items()) + "}"
        return json.dumps(item, ensure_ascii=False)

    return "".join(f"{key} = {value(item)}\n" for key, item in table.items())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A library of two entries, one refuted, and an empty cache."""
    library = tmp_path / "library"
    library.mkdir()
    for module in (entries, auditing, claim_library):
        monkeypatch.setattr(module, "FOLDER", library)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    put(library, HEAD | CLAIM | {"corrects": MISPRINT["id"], "aliases": ["Lagrange's spin"]})
    put(library, HEAD | CLAIM | MISPRINT | {"integral": {"value": "Omega1"}})
    entries.library.cache_clear()
    yield library
    entries.library.cache_clear()


def put(library: Path, table: dict[str, Any]) -> None:
    (library / f"{table['id']}.toml").write_text(toml(table), "utf-8")
    entries.library.cache_clear()


@pytest.mark.slow
def test_the_list_has_every_key_and_says_the_verdict(folder: Path) -> None:
    found = json.loads(in_process.heavytop("claims", "--json").stdout)["claims"]
    assert {each["id"]: each["verdict"] for each in found} == {HEAD["id"]: "holds", MISPRINT["id"]: "refuted"}
    for each in found:
        keys = "id title year source status read tags verdict expects seconds"
        assert set(each) == {*keys.split()}
        assert each["verdict"] == each["expects"]
        assert each["source"] == "J.-L. Lagrange (1788), Mécanique analytique"
        assert each["seconds"] > 0


@pytest.mark.slow
def test_an_entry_is_audited_by_its_id_and_its_other_names(folder: Path) -> None:
    for name in (HEAD["id"], "Lagrange's spin"):
        found = ht.audit(name)
        assert (found.verdict, found.claim) == ("holds", HEAD["title"])
        assert found.entry is not None
        assert found.entry.note == HEAD["note"]
    assert in_process.heavytop("audit", MISPRINT["id"]).returncode == 1
    unknown = in_process.heavytop("audit", "nobody")
    assert unknown.returncode == 2
    assert "heavytop claims" in unknown.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "code", "said"),
    [
        ({}, 0, "2 of 2 verdicts are as expected."),
        ({"expects": "refuted"}, 1, f"{HEAD['id']}: holds, expected: refuted"),
        ({"integral": {"value": "Omega3*sqrt(A - 5)/sqrt(A - 5)"}}, 3, f"{HEAD['id']}: undecided, expected: holds"),
        ({"integral": {"value": "Omega3 +"}}, 3, f"{HEAD['id']}: undecided, expected: holds;"),
    ],
)
def test_the_exit_code_tells_whether_verdicts_are_the_expected_ones(
    folder: Path, change: dict[str, Any], code: int, said: str
) -> None:
    put(folder, HEAD | CLAIM | change)
    done = in_process.heavytop("audit", "--library")
    assert done.returncode == code, done.stdout + done.stderr
    assert said in " ".join(done.stdout.split())


@pytest.mark.slow
def test_a_verdict_is_kept_for_the_same_entry_alone(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = ht.claim_library().verdicts
    calls: list[str] = []
    audited = auditing.audited

    def counted(entry: entries.Entry) -> Any:
        calls.append(entry.id)
        return audited(entry)

    monkeypatch.setattr(auditing, "audited", counted)
    assert ht.claim_library().verdicts == first
    assert calls == []
    put(folder, HEAD | CLAIM | {"note": "Another note."})
    assert ht.claim_library().verdicts[HEAD["id"]].verdict == "holds"
    assert calls == [HEAD["id"]]
    for kept in cache_folder("claims").glob("*.json"):  # damaged: read as nothing
        kept.write_bytes(kept.read_bytes()[:-7])
    assert ht.claim_library("lagrange").verdicts[MISPRINT["id"]].verdict == "refuted"
    assert sorted(calls[1:]) == sorted([HEAD["id"], MISPRINT["id"]])
    ht.claim_library(anew=True)
    assert len(calls) == 5


def test_an_audit_that_was_stopped_is_tried_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for reason, verdict in (("It took longer than 60 s.", "undecided"), ("", "holds"), ("not called", "holds")):
        judged = auditing.Judged(verdict, 1.0, reason)
        monkeypatch.setattr(auditing, "audited", lambda entry, judged=judged: (judged, None))
        assert ht.claim_library().verdicts[HEAD["id"]].verdict == verdict


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"id": "Not A Name"}, "id"),
        ({"expects": "true"}, "expects"),
        ({"read": ""}, "read"),
        ({"read": "somebody said so"}, "read"),
        ({"status": "as I like it"}, "status"),
        ({"note": ""}, "note"),
        ({"source": "a book"}, "source"),
        ({"source": {"authors": [], "year": 1788, "title": "x"}}, "authors"),
        ({"source": {"authors": ["x"], "year": 17, "title": "x"}}, "year"),
        ({"source": {"authors": ["x"], "year": 1788, "title": " "}}, "title"),
        ({"tags": "one"}, "tags"),
        ({"name": "both"}, "name and id"),
        ({"entry": {}}, "a claim has no key entry"),
    ],
)
def test_what_is_no_entry_is_named(change: dict[str, Any], cause: str) -> None:
    with pytest.raises(ht.InputError, match=re.escape(cause)):
        claim_from_table(HEAD | CLAIM | change, "file.toml")


def test_names_and_twins_are_checked(folder: Path) -> None:
    put(folder, HEAD | CLAIM | {"aliases": [MISPRINT["id"]]})
    with pytest.raises(ht.InputError, match="is the name of"):
        entries.library()
    put(folder, HEAD | CLAIM | {"corrects": "nothing"})
    with pytest.raises(ht.InputError, match="must correct an entry that fails; got nothing"):
        entries.library()


@pytest.mark.slow
def test_an_unknown_tag_is_refused_and_a_known_one_selects(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(folder, HEAD | CLAIM | {"tags": ["spinning"]})
    counts: list[int] = []

    @contextmanager
    def counted(_: str, count: int, *__: object) -> Iterator[Callable[[], None]]:
        counts.append(count)
        yield lambda: counts.append(counts.pop() - 1)

    monkeypatch.setattr(command, "counted", counted)
    listed = in_process.heavytop("claims", "--tag", "spinning", "--json")
    assert [each["id"] for each in json.loads(listed.stdout)["claims"]] == [HEAD["id"]]
    assert counts == [0]
    refused = in_process.heavytop("claims", "--tag", "euler")
    assert refused.returncode == 2
    assert "lagrange" in refused.stderr
    assert in_process.heavytop("audit", HEAD["id"], "--library").returncode == 2
    assert in_process.heavytop("audit").returncode == 2


@pytest.mark.slow
def test_the_document_for_others_fits_its_schema_and_is_the_audit(folder: Path, tmp_path: Path) -> None:
    files = claim_library.write(tmp_path / "out")
    document, schema = (json.loads(file.read_text("utf-8")) for file in files)
    assert schema["$ref"] == "#/$defs/Library"
    assert msgspec.to_builtins(msgspec.convert(document, claim_library.Library)) == document
    by_id = {each["entry"]["id"]: each for each in document["claims"]}
    wrong = by_id[MISPRINT["id"]]
    assert wrong["claim"] == json.loads(json.dumps(CLAIM | {"integral": {"value": "Omega1"}}))
    assert wrong["equations"][0]["holds"] is False
    assert wrong["equations"][0]["witness"]["parameters"]["A"] in ("2", "3")
    assert by_id[HEAD["id"]]["verdict"] == "holds"
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(document | {"claims": [wrong | {"verdict": "perhaps"}]}, claim_library.Library)


@pytest.mark.slow
def test_the_plan_measures_every_entry_and_an_unexpected_verdict_is_worse(folder: Path, tmp_path: Path) -> None:
    before = ht.run("claims", out=tmp_path / "before", workers=1)
    assert {row.case: row.metrics["as_expected"].value for row in before.rows} == {HEAD["id"]: "1", MISPRINT["id"]: "1"}
    put(folder, HEAD | CLAIM | {"integral": {"value": "Omega3 + Omega1"}})
    after = ht.run("claims", out=tmp_path / "after", workers=1)
    assert ht.compare(before, after).verdict == "worse"
    assert ht.compare(before, before).verdict == "same"
