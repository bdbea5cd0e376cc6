"""Published numbers of other programs, each with the digits of it that are right, and the command that says so.

``python tools/public_verdicts.py`` makes ``results/public/verdicts.json`` again, in ten seconds: the entries of the
library of claims that have the tag ``published``, by their audit, and the logs beside it, by ``score``.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from heavytop.features.claims.audit.audit import audit_claim, claim_from_table
from heavytop.features.claims.library.entry import FOLDER, Entry, library, split
from heavytop.features.score.api import read_trajectory, scored
from heavytop.files import replace

OUT = Path(__file__).resolve().parents[1] / "results" / "public"
TAG = "published"


def entries() -> list[Entry]:
    """The entries of published numbers, by id."""
    return sorted((entry for entry in library().values() if TAG in entry.tags), key=lambda entry: entry.id)


def verdict(entry: Entry) -> dict[str, Any]:
    """An entry, and of each of its numbers the digits that are right and the proven value."""
    _, table = split(tomllib.loads((FOLDER / f"{entry.id}.toml").read_text("utf-8")), entry.id)
    rows = [row.to_json() for row in audit_claim(claim_from_table(table, entry.id)).rows]
    names = ("printed", "digits_printed", "digits_right")
    numbers = [
        {"quantity": row["equation"], "component": row["component"], "at": row["domain"]}
        | {name: row[name] for name in names}
        | {"proven": row["proven"]["value"]}
        for row in rows
    ]
    return {
        "name": entry.id,
        "what": entry.title,
        "source": ", ".join((*entry.source.authors, str(entry.source.year))),
        "read": f"{entry.source.journal}; {entry.source.equations}",
        "digits_right": min(number["digits_right"] for number in numbers),
        "command": f"heavytop audit {entry.id}",
        "numbers": numbers,
    }


def log(path: Path) -> dict[str, Any]:
    """A log of rows that a program published: the digits right at the worst row, and what score names as wrong."""
    found = scored(*read_trajectory(path)).to_json()
    return {
        "name": path.stem,
        "rows": found["samples"],
        "digits_right": round(found["digits_right"], 1),
        "explained_by": [each["kind"] for each in found["diagnosis"] or ()],
        "command": f"heavytop score results/public/logs/{path.name}",
    }


def document() -> dict[str, Any]:
    """All of them, judged now."""
    return {
        "figures": [verdict(entry) for entry in entries()],
        "logs": [log(path) for path in sorted((OUT / "logs").glob("*.csv"))],
    }


def page(found: dict[str, Any]) -> str:
    """The tables of the page of the site."""
    figures = [
        f"| {each['what']} | {each['read'].replace('/', '/<wbr>')} | {each['digits_right']} | {each['name']} |"
        for each in found["figures"]
    ]
    logs = [
        f"| {each['name']}.csv | {each['rows']} | {each['digits_right']} | {', '.join(each['explained_by'])} |"
        for each in found["logs"]
    ]
    first = ["| published number | source | digits right | `heavytop audit` |", "|---|---|---|---|"]
    second = ["", "| log in `results/public/logs` | rows | digits right | explained by |", "|---|---|---|---|"]
    return "\n".join([*first, *figures, *second, *logs]) + "\n"


if __name__ == "__main__":
    replace(OUT / "verdicts.json", json.dumps(document(), indent=1, ensure_ascii=False).encode() + b"\n")
