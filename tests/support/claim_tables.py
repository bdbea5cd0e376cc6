"""Tables of claims and their audits, and the shortest claims: a rotation about the vertical, an energy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from heavytop.features.claims.audit.audit import audit_claim, claim_from_table
from heavytop.features.claims.audit.judge import Audit
from heavytop.top.equations import system

Table = dict[str, Any]


def audited(table: Mapping[str, Any], about: str = "") -> Audit:
    """The audit of a claim about its own system, or about the one of that name; a key without a value is left out."""
    claim = {"name": "test"} | {key: part for key, part in table.items() if part is not None}
    return audit_claim(claim_from_table(claim, "test"), system(about) if about else None)


def top(inertia: str = "3 2 1", centre: str = "0 1 0", weight: str = "1", **more: Any) -> Table:
    """The table of a top, whose numbers stand between spaces."""
    return {"inertia": inertia.split(), "weight": weight, "centre": centre.split()} | more


def integral(value: str, of: Table, where: Sequence[str] = (), states: Sequence[str] = (), **parts: Any) -> Table:
    """The claim that a value is constant, or with ``kind="relation"`` that it stays 0; at states between spaces."""
    said = {"value": value, "where": [*where]} | ({"states": [state.split() for state in states]} if states else {})
    return {"kind": "integral", "top": of, "integral": said} | parts


def upright(rate: str, of: Table | None = None, **parts: Any) -> Table:
    """The claim of a top that turns about the vertical at this rate: true where it is constant."""
    motion = {"omega": ["0", "0", rate], "gamma": ["0", "0", "1"]}
    return {"kind": "motion", "top": of or top("2 2 3", "0 0 1"), "motion": motion} | parts


def rotation(rate: str, assume: Sequence[str] = (), **parts: Any) -> Audit:
    """The audit of :func:`upright`."""
    return audited(upright(rate, assume=[*assume], **parts))


def energy(x: str, divisor: str = "1", **parts: Any) -> Audit:
    """The audit of the energy of the top of Euler over a divisor, plus (x − 1) Ω1: true where x is 1."""
    value = f"(3*Omega1^2 + 2*Omega2^2 + Omega3^2)/({divisor}) + ({x} - 1)*Omega1"
    return audited(integral(value, top(weight="0"), **parts))


def open_conditions(report: Audit) -> str:
    """The conditions that are not discharged, with the reasons."""
    return "; ".join(f"{c.text} {c.reason}" for row in report.rows for c in row.conditions if not c.discharged)
