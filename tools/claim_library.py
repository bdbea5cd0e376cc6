"""The library of claims as one JSON document, for other catalogues: each claim as it is written, with its verdict.

``python tools/claim_library.py --out results/claims`` makes it again, ``library.json`` and its schema.
"""

from __future__ import annotations

import argparse
import tomllib
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from pathlib import Path
from typing import Any

import msgspec

from heavytop.features.claims.audit.audit import audited
from heavytop.features.claims.audit.judge import StatementVerdict
from heavytop.features.claims.library.entry import FOLDER, Entry, Verdict, library
from heavytop.files import replace

VERSION = "1.0.0"
"""Of the form: a key that is added raises the second place, one that changes the first."""


class Equation(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The verdict on one equation, or on one published number; as in `heavytop audit --json`.

    printed, tolerance, digits_printed, digits_right, proven: of a number.
    """

    equation: str
    component: int
    branch: str
    domain: str
    holds: bool | None
    residual: str
    statement: str
    conditions: list[dict[str, Any]]
    witness: dict[str, Any] | None = None
    where: str | None = None
    printed: str | None = None
    tolerance: str | None = None
    digits_printed: int | None = None
    digits_right: int | None = None
    proven: dict[str, str] | None = None


class Published(msgspec.Struct, frozen=True, kw_only=True):
    """An entry: what it says of itself, the claim as its file has it, and what the audit found.

    solves: the systems that the claim is proven of.
    """

    entry: Entry
    claim: dict[str, Any]
    system: str
    kind: str
    verdict: Verdict
    reason: str
    equations: list[Equation]
    solves: list[str]


class Library(msgspec.Struct, frozen=True, kw_only=True):
    """Every entry, by id."""

    library: str
    version: str
    claims: list[Published]


def document() -> Library:
    """All entries, audited now."""
    with ThreadPoolExecutor(max_workers=cpu_count()) as pool:
        claims = list(pool.map(_published, library().values()))
    return Library(library="heavytop library of claims", version=VERSION, claims=claims)


def is_current(found: Library) -> bool:
    """Whether a document is of the entries as they stand in their files, with the verdicts that they expect."""
    stated = {each.entry.id: (each.entry, each.claim) for each in found.claims}
    as_expected = all(each.verdict == each.entry.expects for each in found.claims)
    return as_expected and stated == {entry.id: (entry, _claim(entry)) for entry in library().values()}


def _claim(entry: Entry) -> dict[str, Any]:
    """The claim in the file of an entry, without what it says as an entry."""
    table = tomllib.loads((FOLDER / f"{entry.id}.toml").read_text("utf-8"))
    own = set(msgspec.to_builtins(entry)) | {"corrects"}
    return {key: value for key, value in table.items() if key not in own}


def _published(entry: Entry) -> Published:
    claim = _claim(entry)
    judged, found = audited(entry)
    return Published(
        entry=entry,
        claim=claim,
        system="" if found is None else found.system,
        kind=str(claim.get("kind", "")),
        verdict=judged.verdict,
        reason=judged.reason,
        equations=[] if found is None else [_equation(row) for row in found.rows],
        solves=[] if found is None else list(found.solves),
    )


def _equation(row: StatementVerdict) -> Equation:
    return msgspec.convert(row.to_json(), Equation)


def write(out: Path) -> list[Path]:
    """Writes the document and its schema to a folder, which is made where it is missing; returns both files."""
    out.mkdir(parents=True, exist_ok=True)
    files = [out / "library.json", out / "library.schema.json"]
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **msgspec.json.schema(Library)}
    for path, content in zip(files, (document(), schema), strict=True):
        replace(path, msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n")
    return files


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the JSON document of the library of claims again.")
    parser.add_argument("--out", type=Path, default=Path("results/claims"))
    write(parser.parse_args().out)
