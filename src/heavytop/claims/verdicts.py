"""The verdicts on the library of claims: audited now, or found in the cache by what they follow from."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from pathlib import Path
from time import perf_counter

import msgspec

from heavytop.claims.entry import FOLDER, Entry, Verdict
from heavytop.claims.guard import AuditEnded, in_time
from heavytop.claims.judge import Audit
from heavytop.errors import HeavyTopError

SECONDS = 60.0
"""An audit of an entry that takes longer is undecided."""
_PACKAGE = Path(__file__).parents[1]
_ROOMS = ("claims", "top", "exact")


class Judged(msgspec.Struct, frozen=True):
    """The verdict on an entry, and the seconds that its audit took when it was made.

    reason: why there is no verdict, where the audit was stopped or the file cannot be judged.
    """

    verdict: Verdict
    seconds: float
    reason: str = ""


Done = Callable[[], None]


def audited(entry: Entry, system: str = "") -> tuple[Judged, Audit | None]:
    """The audit of an entry; undecided, with None, where it is stopped or its file cannot be judged."""
    began = perf_counter()
    try:
        found = in_time(str(FOLDER / f"{entry.id}.toml"), system, SECONDS)
    except AuditEnded:
        raise
    except HeavyTopError as error:
        return Judged("undecided", perf_counter() - began, error.cause), None
    return Judged(_verdict(found), perf_counter() - began), found


def _verdict(found: Audit) -> Verdict:
    return "holds" if found.verdict == "holds" else "refuted" if found.verdict == "refuted" else "undecided"


@cache
def own_system(name: str) -> str:
    """The system that an entry is about, by its file."""
    from heavytop.claims.from_file import read_claim

    return read_claim(FOLDER / f"{name}.toml").about(None).name


def judged(entries: Iterable[Entry], *, anew: bool = False, done: Done = lambda: None) -> dict[str, Judged]:
    """The verdict on each entry by its id, as many audits at once as there are processors.

    anew: whatever the cache holds.  done: called after each.
    Raises AuditEnded where the process of an audit ends without an answer.
    """
    todo = list(entries)

    def one(entry: Entry) -> Judged:
        found = None if anew else _kept(entry)
        if found is None:
            found, _ = audited(entry)
            _keep(entry, found)
        done()
        return found

    with ThreadPoolExecutor(max_workers=_processors()) as pool:
        return dict(zip((entry.id for entry in todo), pool.map(one, todo), strict=True))


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _kept(entry: Entry) -> Judged | None:
    """What the cache holds of exactly this entry and this program."""
    try:
        return msgspec.json.decode(_place(entry).read_bytes(), type=Judged)
    except (OSError, msgspec.DecodeError, msgspec.ValidationError):
        return None


def _keep(entry: Entry, found: Judged) -> None:
    """Beside others that write the same at once; a cache that cannot be written is none."""
    place = _place(entry)
    part = place.with_suffix(f".{os.getpid()}.part")
    with suppress(OSError):
        place.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(msgspec.json.encode(found))
        part.replace(place)


def _place(entry: Entry) -> Path:
    content = (FOLDER / f"{entry.id}.toml").read_bytes()
    return _cache_folder() / f"{hashlib.sha256(_program() + content).hexdigest()}.json"


@cache
def _program() -> bytes:
    """A digest of what a verdict follows from: the versions of Python and its algebra, and the source of the rooms."""
    digest = hashlib.sha256(sys.version.encode())
    for name in ("sympy", "flint"):
        digest.update(str(__import__(name).__version__).encode())
    for path in sorted(path for room in _ROOMS for path in (_PACKAGE / room).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()


def _cache_folder() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    with suppress(RuntimeError):
        return (Path(home) if home else Path.home() / ".cache") / "heavytop" / "claims"
    return Path(os.devnull) / "none"
