"""Why a claim of the paper fails about the heavy top, and what it solves instead: each step checked by the audit."""

from __future__ import annotations

from heavytop.claims.judge import Finding, judge, verdict_of
from heavytop.claims.statement import Setting
from heavytop.claims.statements import SYSTEMS, Motion, determinant, motion_statements, why_not_equivalent
from heavytop.top.equations import GYROSTAT, Parameters, System

_HOLDS = {"holds": True, "refuted": False, "undecided": None}


def explain(motion: Motion, parameters: Parameters, setting: Setting) -> tuple[list[Finding], tuple[str, ...]]:
    """The steps of the explanation for a motion with γ ∥ M, and the systems whose (1.1), (1.2) it satisfies."""
    row = judge([determinant(motion, parameters)], setting)[0]
    steps = [*why_not_equivalent(), Finding("along the claim det(gamma, M, P*r) = 0 identically", row.holds)]
    solves = []
    for system in SYSTEMS:
        verdicts = _by_equation(motion, parameters, system, setting)
        if verdicts["1.1"] == verdicts["1.2"] == "holds":
            solves.append(system.name)
        if system is GYROSTAT:
            told = {
                "1.1": "M' = M x (Omega + lambda*e2), lambda = P*b/C0: the free gyrostat with a rotor on axis 2",
                "1.2": "gamma' = gamma x (Omega + lambda*e2)",
                "3.1": "(3.1) with omega = Omega + lambda*e2 in the place of Omega",
            }
            steps += [Finding(f"it solves {told[name]}", _HOLDS[verdicts[name]]) for name in told if name in verdicts]
    return steps, tuple(solves)


def _by_equation(motion: Motion, parameters: Parameters, system: System, setting: Setting) -> dict[str, str]:
    rows = judge(list(motion_statements(motion, parameters, system)), setting)
    names = {row.equation for row in rows}
    return {name: verdict_of([row for row in rows if row.equation == name]) for name in names}
