"""Audits of the shortest claims, which are true where one formula is: a rotation about the vertical, an energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from heavytop.features.claims.audit.audit import audit_claim, claim_from_table
from heavytop.features.claims.audit.judge import Audit


def rotation(rate: str, assume: Sequence[str] = (), **parts: Any) -> Audit:
    """The audit of a top that turns about the vertical at this rate: true where it is constant."""
    table = {
        "name": "rotation",
        "kind": "motion",
        "assume": list(assume),
        "top": {"inertia": ["2", "2", "3"], "weight": "1", "centre": ["0", "0", "1"]},
        "motion": {"omega": ["0", "0", rate], "gamma": ["0", "0", "1"]},
    }
    return audit_claim(claim_from_table(table | parts, "test"))


def energy(x: str, divisor: str = "1", **parts: Any) -> Audit:
    """The audit of the energy of the top of Euler over a divisor, plus (x − 1) Ω1: true where x is 1."""
    table = {
        "name": "energy",
        "kind": "integral",
        "top": {"inertia": ["3", "2", "1"], "weight": "0", "centre": ["0", "1", "0"]},
        "integral": {"value": f"(3*Omega1^2 + 2*Omega2^2 + Omega3^2)/({divisor}) + ({x} - 1)*Omega1"},
    }
    return audit_claim(claim_from_table(table | parts, "test"))


def open_conditions(report: Audit) -> str:
    """The conditions that are not discharged, with the reasons."""
    return "; ".join(f"{c.text} {c.reason}" for row in report.rows for c in row.conditions if not c.discharged)
