"""The suite's own detectors, tried on integrators that are deliberately broken: which metric catches which fault.

Each fault of :mod:`heavytop.integrate.broken` runs the plan `selftest`, and its report is compared with that of the
healthy integrator, as any candidate is with its baseline.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from heavytop.errors import InputError
from heavytop.integrate.broken import FAULTS
from heavytop.precision import exact, log10
from heavytop.records import SCHEMA, Report, Row
from heavytop.report.compare import Comparison, Finding, compare
from heavytop.report.policy import Policy
from heavytop.report.verdicts import Verdict
from heavytop.suite.plan import expand, load
from heavytop.suite.task import Task
from heavytop.suite.workers import rows

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


def tasks(plan: str = "selftest") -> list[Task]:
    """The measurements of the plan for every integrator: healthy, healthy with other roundings, each fault."""
    healthy = expand(load(plan)[0])
    control = [replace(task, seed=1) for task in healthy]
    return [*healthy, *control, *(replace(task, integrator=fault) for fault in FAULTS for task in healthy)]


def trials(tasks: Sequence[Task], workers: int, progress: Callable[[Task], None]) -> list[Trial]:
    """What comes of :func:`tasks`: one trial for the control and one for each fault."""
    found: dict[int, Row] = {}
    for index, row in rows(tasks, workers, None):
        found[index] = row
        progress(tasks[index])
    names = (CONTROL, *FAULTS)
    size = len(tasks) // (1 + len(names))
    healthy, *others = ([found[i] for i in range(at, at + size)] for at in range(0, len(tasks), size))
    compared = (compare(_report(healthy), _report(other), Policy()) for other in others)
    return [_trial(name, comparison) for name, comparison in zip(names, compared, strict=True)]


def _report(measured: Sequence[Row]) -> Report:
    return Report(SCHEMA, {}, {}, list(measured))


def _trial(name: str, comparison: Comparison) -> Trial:
    alarms: dict[str, list[tuple[float, str]]] = {}
    quiet: list[tuple[bool, float, str]] = []
    for finding in comparison.findings:
        measure, case = finding.key[:2]
        label = f"{measure}: {finding.metric or finding.reason}"
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
