"""Claims that a user writes in TOML: a motion, a first integral, an invariant relation, or numbers.

The format is that of docs/claims-in-toml.md.  Formulas go through :mod:`heavytop.claims.expression`; nothing in a
file is ever evaluated as code.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec

from heavytop.claims.audit import Auditable
from heavytop.claims.entry import Entry, split
from heavytop.claims.values import ValueClaim, ValueFile
from heavytop.errors import InputError

_MAX_BYTES = 100_000
_REMEDY = "See docs/claims-in-toml.md; worked examples are in src/heavytop/claims/examples."

Text = Annotated[str, msgspec.Meta(max_length=20_000)]
Name = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,30}$")]
Three = Annotated[list[Text], msgspec.Meta(min_length=3, max_length=3)]
Tensor = Annotated[list[Text | list[Text]], msgspec.Meta(min_length=3, max_length=9)]
Samples = Annotated[list[Text], msgspec.Meta(min_length=1, max_length=8)]


class TopTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[top]: moments of inertia, weight, centre of mass; the rotor, λ where the claim is about `gyrostat`, or k1, k2,
    k3 where it is about `heavy_gyrostat`.

    inertia: three principal moments; or a tensor in other axes: six numbers I11, I22, I33, I12, I13, I23, nine row by
    row, or three rows of three.
    """

    inertia: Tensor
    weight: Text
    centre: Three
    rotor: Text | Three | None = None


class MotionTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[motion]: Ω(t), γ(t), and the angles (φ, θ, ψ); γ may be left out where the angles are given, and so may Ω."""

    omega: Three | None = None
    gamma: Three | None = None
    angles: Three | None = None


class QuadratureTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[quadrature]: the formulas of [motion] hold u, and t = F(u) + constant where u is between bounds.

    time: F(u); or integrand: F'(u).  where: comparisons that bound u.  points: values of u to look for a witness at.
    """

    variable: Name
    time: Text | None = None
    integrand: Text | None = None
    where: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    points: Samples | None = None


class IntegralTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """[integral]: F(Ω, γ), where it is claimed to be constant, and exact states to look for a witness at.

    Without states the audit takes some of its own, on the conditions where it finds such.
    """

    value: Text
    where: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    states: (
        Annotated[
            list[Annotated[list[Text], msgspec.Meta(min_length=6, max_length=6)]],
            msgspec.Meta(min_length=1, max_length=8),
        ]
        | None
    ) = None


class ClaimFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The whole file.

    entry: what it says as an entry of the library, where it is one.
    """

    name: Annotated[str, msgspec.Meta(max_length=80)]
    kind: str
    top: TopTable
    system: str | None = None
    source: Annotated[str, msgspec.Meta(max_length=2_000)] = ""
    domain: str = "all"
    times: Samples | None = None
    assume: Annotated[list[Text], msgspec.Meta(max_length=20)] = []
    parameters: Annotated[dict[Name, Samples | Text], msgspec.Meta(max_length=20)] = {}
    definitions: Annotated[dict[Name, Text], msgspec.Meta(max_length=40)] = {}
    relations: Annotated[list[Text], msgspec.Meta(max_length=6)] = []
    motion: MotionTable | None = None
    quadrature: QuadratureTable | None = None
    integral: IntegralTable | None = None
    entry: Entry | None = None


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
    from heavytop.claims.user_claim import UserMotion
    from heavytop.claims.user_integral import UserIntegral

    return UserMotion(content) if content.kind == "motion" else UserIntegral(content)


def _value_claim(table: Mapping[str, Any], entry: Entry | None, where: str) -> ValueClaim:
    try:
        return ValueClaim(msgspec.convert(table, ValueFile), entry)
    except (msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{where}: {error}.", f"Numbers are text, as they are printed. {_REMEDY}") from None
    except InputError as error:
        raise InputError(f"{where}: {error.cause}", error.remedy) from None


def sample_rows(parameters: Mapping[str, Sequence[str] | str]) -> list[dict[str, str]]:
    """The sample values of the parameters, one dict a sample; a single value serves all samples.

    Raises InputError where the lists differ in length.
    """
    lengths = {len(values) for values in parameters.values() if not isinstance(values, str)}
    if len(lengths) > 1:
        raise InputError(f"The samples of the parameters have lengths {sorted(lengths)}.", "Give as many for each.")
    count = max(lengths, default=1)
    return [
        {name: values if isinstance(values, str) else values[index] for name, values in parameters.items()}
        for index in range(count)
    ]
