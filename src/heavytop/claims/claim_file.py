"""What a claim in TOML may hold: a motion, a first integral or an invariant relation, as it is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

import msgspec

from heavytop.claims.entry import Entry
from heavytop.errors import InputError

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
