"""Audits of claims from Python, and the library of published ones."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from heavytop import arguments
from heavytop.display import Tabular, TitledTable
from heavytop.errors import ExitCode
from heavytop.features.claims.audit.audit import PAPER, Judged, judged, only_branch, require_branch
from heavytop.features.claims.audit.audit import audit as audit_named
from heavytop.features.claims.audit.judge import Audit
from heavytop.features.claims.library.entry import Entry, library, require_tag
from heavytop.top.equations import System


def audit(claim: str | os.PathLike[str], system: System | str | None = None, *, branch: str | None = None) -> Audit:
    """Prove or refute a claim, equation by equation.

    Arguments:
        claim: "ershkov-general", "ershkov-partial", the id of an entry of :func:`claim_library`, or the path of a claim
            in TOML (`heavytop docs claims-in-toml`).
        system: "heavy_top", "gyrostat" or "heavy_gyrostat": the system whose motion it is claimed to be; None for the
            file's, else "heavy_gyrostat" where its rotor is a list of three, else "heavy_top".
        branch: "smooth" or "printed": the rows of that branch alone.

    Returns:
        An :class:`Audit`; ``verdict`` is "holds" only where every equation is proven on its whole domain.

    Raises:
        InputError: for an unknown claim, system or branch, a file without a claim, and one whose audit takes too long.
    """
    if branch is not None:
        require_branch(arguments.text(branch, "branch"))
    name = claim if isinstance(claim, str) and claim in PAPER else str(arguments.path(claim, "claim"))
    audited = audit_named(name, None if system is None else arguments.system(system).name)
    return audited if branch is None else only_branch(audited, branch)


@dataclass(frozen=True, slots=True, repr=False)
class ClaimLibrary(Tabular, Sequence[Entry]):
    """Entries of the library with their verdicts, by id.

    entries: the contents of each file.  verdicts: of each entry, by id.
    """

    entries: tuple[Entry, ...]
    verdicts: dict[str, Judged]

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, index: Any) -> Any:
        return self.entries[index]

    @property
    def changed(self) -> tuple[str, ...]:
        """Ids of the entries whose verdict is not the expected one, nor undecided."""
        return tuple(e.id for e in self.entries if self.verdicts[e.id].verdict not in (e.expects, _OPEN))

    @property
    def undecided(self) -> tuple[str, ...]:
        """Ids of the entries that are undecided where a verdict is expected."""
        return tuple(e.id for e in self.entries if self.verdicts[e.id].verdict == _OPEN != e.expects)

    @property
    def exit_code(self) -> ExitCode:
        """0 where every verdict is the expected one, 1 where one is different, else 3 where one is undecided."""
        return ExitCode.FINDING if self.changed else ExitCode.INCOMPLETE if self.undecided else ExitCode.GOOD

    def to_json(self) -> dict[str, Any]:
        """The document of ``heavytop claims --json``."""
        return {"claims": [self._document(entry) for entry in self.entries]}

    def _document(self, entry: Entry) -> dict[str, Any]:
        judged = self.verdicts[entry.id]
        document = {
            "id": entry.id,
            "title": entry.title,
            "year": entry.source.year,
            "source": entry.source.text,
            "status": entry.status,
            "read": entry.read,
            "tags": entry.tags,
            "verdict": judged.verdict,
            "expects": entry.expects,
            "seconds": round(judged.seconds, 3),
        }
        return document | ({"reason": judged.reason} if judged.reason else {})

    def _table(self) -> TitledTable:
        counts = [sum(verdict.verdict == name for verdict in self.verdicts.values()) for name in _VERDICTS]
        counted = ", ".join(f"{count} {_VERBS[name]}" for name, count in zip(_VERDICTS, counts, strict=True) if count)
        rows = [(entry.id, str(entry.source.year), self.verdicts[entry.id].verdict) for entry in self.entries]
        return TitledTable(f"{len(self.entries)} claims: {counted}", ("claim", "year", "verdict"), rows)


_OPEN = "undecided"
_VERDICTS = ("holds", "refuted", _OPEN)
_VERBS = {"holds": "hold", "refuted": "are refuted", _OPEN: "are undecided"}


def claim_library(
    tag: str | None = None, *, anew: bool = False, done: Callable[[], None] | None = None
) -> ClaimLibrary:
    """The library of published claims with the verdict on each.

    Arguments:
        tag: the entries with that tag alone.
        anew: audit every entry; else the cache of the user gives the verdict of an earlier audit of the same entry by
            the same program.
        done: called after each verdict.

    Returns:
        A :class:`ClaimLibrary`: a sequence of entries, ``verdicts[id].verdict``, ``to_json()``.

    Raises:
        InputError: for a tag that no entry has.
    """
    known = None if tag is None else require_tag(arguments.text(tag, "tag"))
    callback = arguments.callback(done, "done") or (lambda: None)
    entries = tuple(entry for entry in library().values() if known is None or known in entry.tags)
    return ClaimLibrary(entries, judged(entries, anew=bool(arguments.flag(anew, "anew")), done=callback))
