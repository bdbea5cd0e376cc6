"""Claims that a user writes in TOML: a motion, a first integral, an invariant relation, or numbers.

The format is that of docs/claims-in-toml.md.  Formulas go through :mod:`heavytop.claims.expression`; nothing in a
file is ever evaluated as code.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from heavytop.claims.auditable import Auditable
from heavytop.claims.claim_file import ClaimFile
from heavytop.claims.entry import Entry, split
from heavytop.claims.user_claim import UserMotion
from heavytop.claims.user_integral import UserIntegral
from heavytop.claims.values import ValueClaim, ValueFile
from heavytop.errors import InputError

_MAX_BYTES = 100_000
_REMEDY = "See docs/claims-in-toml.md; worked examples are in src/heavytop/claims/examples."


def read_claim(path: Path) -> Auditable | ValueClaim:
    """The claim in a TOML file; raises InputError, with the reason, for anything that is not one."""
    try:
        with path.open("rb") as stream:
            raw = stream.read(_MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.", "Give the path of a claim in TOML.") from None
    if len(raw) > _MAX_BYTES:
        raise InputError(f"{path} is longer than {_MAX_BYTES} bytes.", "A claim is a page of formulas.")
    try:
        table = tomllib.loads(raw.decode())
    except (ValueError, RecursionError) as error:  # an integer of too many digits is a ValueError of its own
        raise InputError(f"{path} is not TOML: {str(error)[:200]}.", _REMEDY) from None
    return claim_from_table(table, str(path))


def claim_from_table(table: Mapping[str, Any], where: str) -> Auditable | ValueClaim:
    """The claim in a TOML table that has been read; raises InputError for anything that is not one."""
    entry, rest = split(table, where)
    if "entry" in rest:
        raise InputError(f"{where}: entry is no key of a claim.", _REMEDY)
    if rest.get("kind") == "value":
        return _value_claim(rest, entry, where)
    try:
        content = msgspec.convert(rest, ClaimFile)
    except (msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{where}: {error}.", _REMEDY) from None
    tables = {"motion": content.motion, "integral": content.integral, "relation": content.integral}
    if content.kind not in tables:
        raise InputError(f"{where}: kind = {content.kind[:40]!r}.", "Use motion, integral, relation or value.")
    wanted = "motion" if content.kind == "motion" else "integral"
    if tables[content.kind] is None or (content.motion is not None and content.integral is not None):
        raise InputError(f"{where}: kind {content.kind!r} needs the table [{wanted}], and no other claim.", _REMEDY)
    if content.quadrature is not None and content.kind != "motion":
        raise InputError(f"{where}: [quadrature] is about a motion, and kind = {content.kind!r}.", _REMEDY)
    if content.domain not in ("all", "t<=0", "t>0"):
        raise InputError(f"{where}: domain = {content.domain[:40]!r}.", 'Use "all", "t<=0" or "t>0".')
    content = msgspec.structs.replace(content, entry=entry)
    return UserMotion(content) if content.kind == "motion" else UserIntegral(content)


def _value_claim(table: Mapping[str, Any], entry: Entry | None, where: str) -> ValueClaim:
    try:
        return ValueClaim(msgspec.convert(table, ValueFile), entry)
    except (msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{where}: {error}.", f"Numbers are text, as they are printed. {_REMEDY}") from None
    except InputError as error:
        raise InputError(f"{where}: {error.cause}", error.remedy) from None
