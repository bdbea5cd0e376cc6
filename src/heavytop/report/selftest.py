"""What a comparison says of a deliberately broken integrator: which metric catches which fault."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from heavytop.errors import InputError
from heavytop.integrate.broken import FAULTS
from heavytop.precision import exact, log10
from heavytop.report.compare import Comparison, Finding
from heavytop.report.verdicts import Verdict

CONTROL = "control"
_ALARMS = (Verdict.WORSE, Verdict.INCOMPARABLE, Verdict.MISSING)


@dataclass(frozen=True, slots=True)
class Trial:
    """What the comparison said of one fault.

    caught_by: measures and metrics that raised an alarm, with the cases where they did, strongest first.
    shift: the metric that moved most without an alarm, improvements first, and by how many decades; None where one was
    caught.
    """

    fault: str
    about: str
    detectable: bool
    verdict: str
    caught_by: list[tuple[str, list[str]]]
    shift: tuple[str, float] | None

    @property
    def as_expected(self) -> bool:
        """Whether the alarm is raised just where it should be."""
        return self.detectable == bool(self.caught_by)

    def to_json(self) -> dict[str, Any]:
        """One entry of `selftest --json`."""
        return {
            "fault": self.fault,
            "about": self.about,
            "detectable": self.detectable,
            "verdict": self.verdict,
            "caught_by": [{"metric": metric, "cases": cases} for metric, cases in self.caught_by],
            "largest_shift": None if self.shift is None else {"metric": self.shift[0], "decades": self.shift[1]},
        }


def trial(name: str, comparison: Comparison) -> Trial:
    """What came of the control, or of the fault of that name."""
    alarms: dict[str, list[tuple[float, str]]] = {}
    quiet: list[tuple[bool, float, str]] = []
    for finding in comparison.findings:
        case = finding.row.case
        label = f"{finding.row.key.kind}: {finding.metric or finding.reason}"
        moved = _decades(finding)
        if finding.verdict in _ALARMS:
            alarms.setdefault(label, []).append((moved, case))
        else:
            quiet.append((finding.verdict is Verdict.BETTER, moved, f"{label} of {case}"))
    strongest = sorted(alarms.items(), key=lambda item: -max(item[1])[0])
    shift = max(quiet) if quiet and not alarms else None
    if name == CONTROL:
        about, detectable = "nothing; other roundings", False
    else:
        about, detectable = FAULTS[name].about, FAULTS[name].detectable
    return Trial(
        name,
        about,
        detectable,
        comparison.verdict,
        [(label, [case for _, case in cases]) for label, cases in strongest],
        None if shift is None else (shift[2], shift[1]),
    )


def _decades(finding: Finding) -> float:
    """How far the value moved; infinite where one of the two is no number, or only one of them is 0."""
    try:
        old, new = (log10(exact(value or "")) for value in (finding.baseline, finding.candidate))
    except InputError:
        return 0.0 if finding.baseline == finding.candidate else float("inf")
    if old is None or new is None:
        return 0.0 if old == new else float("inf")
    return abs(new - old)
