"""The entries of the library of claims.

Each entry is a TOML file `library/ID.toml`: a claim in the form of docs/claims-in-toml.md, with its publication, how it
was read, the expected verdict and a note.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from heavytop.errors import InputError, invalid, meant, quoted

FOLDER = Path(__file__).parent
_REMEDY = "See `heavytop docs library` for the keys of an entry."
_KEYS = ("id", "title", "source", "language", "read", "status", "aliases", "tags", "expects", "note", "corrects")
_ID = r"^[a-z0-9]+(-[a-z0-9]+)*$"
_LANGUAGE = r"^[a-z]{2,3}$"
_READ = r"^(the text|an abstract|restated .+)$"
_STATUS = r"^(as published|corrected here|superseded by [a-z0-9]+(-[a-z0-9]+)*)$"

Verdict = Literal["holds", "refuted", "undecided"]
Id = Annotated[str, msgspec.Meta(pattern=_ID, max_length=80, description="lower-case words joined by hyphens")]
Line = Annotated[str, msgspec.Meta(min_length=1, max_length=400, pattern=r"\S", description="text that is not blank")]


class Source(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[source]: where the claim was published.

    equations: their numbers there, a section or a page.
    """

    authors: Annotated[list[Line], msgspec.Meta(min_length=1, max_length=40)]
    year: Annotated[int, msgspec.Meta(ge=1600, le=2200)]
    title: Line
    journal: str = ""
    doi: str = ""
    equations: str = ""

    @property
    def text(self) -> str:
        """The citation in one line."""
        doi = f"doi:{self.doi}" if self.doi else ""
        authors = ", ".join(self.authors)
        who = authors if authors == "unattributed" else f"{authors} ({self.year})"  # the year is the original's
        parts = (who, self.title, self.journal, self.equations, doi)
        return ", ".join(part for part in parts if part)


class Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The keys of an entry about its claim.

    id: never used for another entry.  read: the part of the source that was read.  expects: the expected verdict.
    note: for readers.  corrects: the entries that this one is the right form of.
    """

    id: Id
    title: Line
    source: Source
    language: Annotated[str, msgspec.Meta(pattern=_LANGUAGE, description="a code such as en, ru or de")]
    read: Annotated[
        str, msgspec.Meta(pattern=_READ, max_length=600, description="'the text', 'an abstract' or 'restated ...'")
    ]
    status: Annotated[
        str, msgspec.Meta(pattern=_STATUS, description="'as published', 'corrected here' or 'superseded by ID'")
    ]
    expects: Verdict
    note: Annotated[str, msgspec.Meta(min_length=1, max_length=4_000)]
    aliases: Annotated[list[Line], msgspec.Meta(max_length=20)] = []
    tags: Annotated[list[Line], msgspec.Meta(max_length=20)] = []
    corrects: Id | Annotated[list[Id], msgspec.Meta(max_length=20)] = []

    @property
    def corrected(self) -> list[str]:
        """The ids in ``corrects``."""
        return [self.corrects] if isinstance(self.corrects, str) else list(self.corrects)


def split(table: Mapping[str, Any], where: str) -> tuple[Entry | None, dict[str, Any]]:
    """(entry, claim): the entry in a TOML table, None without an id, and the table of its claim.

    Raises InputError for wrong or missing keys of an entry.
    """
    if "id" not in table:
        return None, dict(table)
    if "name" in table:
        raise InputError(f"{where}: name and id were given.", "Give id and title, and no name.")
    try:
        entry = msgspec.convert({key: table[key] for key in _KEYS if key in table}, Entry)
    except (msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{where}: {invalid(error, Entry)}.", _REMEDY) from None
    claim = {key: value for key, value in table.items() if key not in _KEYS}
    return entry, claim | {"name": entry.title[:80], "source": entry.source.text[:2_000]}


def read_entry(path: Path) -> Entry:
    """The entry in a file of the library."""
    entry, _ = split(tomllib.loads(path.read_text("utf-8")), path.name)
    if entry is None or entry.id != path.stem:
        raise InputError(f"{path.name}: id must be the name of the file.", _REMEDY)
    return entry


@cache
def library() -> dict[str, Entry]:
    """The entries by id, in order of the ids; raises InputError where two claim one name."""
    entries = {entry.id: entry for entry in map(read_entry, sorted(FOLDER.glob("*.toml")))}
    names: dict[str, str] = {}
    for entry in entries.values():
        for name in (entry.id, *entry.aliases):
            if names.setdefault(name, entry.id) != entry.id:
                raise InputError(f"{name} is the name of {names[name]} and of {entry.id}.", _REMEDY)
        for name in entry.corrected:
            if name not in entries or entries[name].expects == "holds":
                raise InputError(f"{entry.id} must correct an entry that fails; got {name}.", _REMEDY)
    return entries


def file_of(name: str) -> Path | None:
    """The file of the entry with that id or alias; None where absent."""
    named = (entry.id for entry in library().values() if name in (entry.id, *entry.aliases))
    return next((FOLDER / f"{name}.toml" for name in named), None)


def require_tag(tag: str) -> str:
    """The tag; raises InputError for one that no entry has."""
    known = sorted({tag for entry in library().values() for tag in entry.tags})
    if tag not in known:
        raise InputError(f"No claim has the tag {quoted(tag)}.", f"{meant(tag, known)}Tags: {', '.join(known)}.")
    return tag
