"""What a report says about a claim: refuted or not, of which system, how wrong and from when on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from heavytop.records import Report, Row, Series
from heavytop.report.text import short

_PARTS = "claim_parts_by_1_percent_at"
SYSTEMS = {"heavy_top": "the heavy top", "gyrostat": "the gyrostat"}


@dataclass(frozen=True, slots=True)
class Audited:
    """One claim held against the equations of one system; ``refuted`` names equations on the smooth branch, or all
    that are refuted where the smooth branch has none.
    """

    claim: str
    system: str
    verdict: str
    proven: int
    equations: int
    refuted: list[str]
    source: str


@dataclass(frozen=True, slots=True)
class Wrongness:
    """How far a claim is from the true motion, forward in time.

    branch: the one that the figures below are of.  parts_at: |t| at which Ω is off by 1 % of α there; other_branches:
    the same on the others, (branch, |t|).  largest: error of Ω over that many ``samples`` up to ``horizon``.
    Rows of ``at``: |t|, error of Ω, error of γ.
    """

    case: str
    branch: str
    parts_at: str
    other_branches: list[tuple[str, str]]
    samples: int
    largest: str
    horizon: str
    at: list[tuple[str, str, str]]
    against: str


def audited(report: Report) -> list[Audited]:
    """Every audit of the report, in its order."""
    return [_audited(row) for row in report.rows if row.measure == "audit"]


def _audited(row: Row) -> Audited:
    refuted = [name for name, metric in row.metrics.items() if metric.value == "0"]
    undecided = [name for name, metric in row.metrics.items() if metric.value not in ("0", "1")]
    smooth = [name for name in refuted if " smooth " in name] or refuted
    return Audited(
        claim=row.case,
        system=row.system,
        verdict="refuted" if refuted else "undecided" if undecided or not row.metrics else "holds",
        proven=len(row.metrics) - len(refuted) - len(undecided),
        equations=len(row.metrics),
        refuted=list(dict.fromkeys(name.split()[0].rpartition(".")[0] for name in smooth)),
        source=row.measured,
    )


def wrongness(report: Report, times: Sequence[str] = ("0.1", "1", "2", "5")) -> list[Wrongness]:
    """How wrong a claim is, per case; forward in time, and in full on the smooth branch, where there are several."""
    rows = [
        row
        for row in report.rows
        if row.measure == "claim_model" and _PARTS in row.metrics and not row.case.endswith("/backward")
    ]
    smooth = {row.case for row in rows if row.integrator == "claim:smooth"}
    return [
        _wrongness(row, [other for other in rows if other.case == row.case and other is not row], times)
        for row in rows
        if row.case not in smooth or row.integrator == "claim:smooth"
    ]


def _wrongness(row: Row, others: Sequence[Row], times: Sequence[str]) -> Wrongness:
    omega, gamma = (_values(row.series.get(f"claim_model_error_{name}")) for name in ("omega", "gamma"))
    largest = row.metrics.get("claim_model_error_omega_max")
    return Wrongness(
        case=row.case.removesuffix("/forward"),
        branch=_branch(row),
        parts_at=short(row.metrics[_PARTS].value),
        other_branches=[(_branch(other), short(other.metrics[_PARTS].value)) for other in others],
        samples=row.samples,
        largest=short(largest.value) if largest else "missing",
        horizon=short(row.horizon.removeprefix("-")),
        at=[(t, short(omega[t]), short(gamma.get(t, "missing"))) for t in times if t in omega],
        against=row.against,
    )


def _branch(row: Row) -> str:
    return row.integrator.partition(":")[2]


def _values(series: Series | None) -> dict[str, str]:
    return dict(zip(series.times, series.values, strict=False)) if series else {}


def headline(found: Sequence[Audited], systems: dict[str, str] = SYSTEMS) -> tuple[str, str]:
    """A word (refuted, holds, undecided, nothing) and the sentence that opens the page."""
    top = [each for each in found if each.system == "heavy_top"]
    verdicts = {each.verdict for each in top}
    if not top:
        return "nothing", "No claim about the heavy top is audited in this plan."
    holds = [each.system for each in found if each.verdict == "holds" and each.system != "heavy_top"]
    solved = " and ".join(systems.get(name, name) for name in dict.fromkeys(holds))
    instead = f" It solves {solved} instead." if holds else ""
    if verdicts == {"refuted"}:
        return "refuted", f"The claimed solution is not a motion of the heavy top.{instead}"
    if "refuted" in verdicts:
        return "refuted", f"Some of the claimed solutions are not motions of the heavy top.{instead}"
    if verdicts == {"holds"}:
        return "holds", "Every equation of the claim is proven for the heavy top."
    return "undecided", "No equation of the claim is refuted, but not all are proven."
