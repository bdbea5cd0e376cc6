"""Tests of the detectors of the suite on deliberately faulty integrators.

Each plug-in of :mod:`heavytop.api.faulty_integrators` runs the plan `selftest`, and its report is compared with that of
the healthy integrator, like any candidate with its baseline.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.api.faulty_integrators import FAULTS, Fault
from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.harness.plan import expand, load
from heavytop.harness.rows import Task
from heavytop.harness.run import rows
from heavytop.precision import exact, log10
from heavytop.records import SCHEMA, Report, Row
from heavytop.report.compare.compare import Differences, compare
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.rows import Finding
from heavytop.report.compare.verdicts import Verdict

CONTROL = "control"
_HEALTHY = Fault("nothing; other roundings", detectable=False)
_ALARMS = (Verdict.WORSE, Verdict.INCOMPARABLE, Verdict.MISSING)
_SHOWN = 3


@dataclass(frozen=True, slots=True)
class Trial:
    """The verdict of the comparison on one fault.

    caught_by: measures and metrics that raised an alarm, with their cases, strongest first.
    shift: without an alarm, the metric that changed most, improvements first, and its change in decades.
    """

    fault: str
    about: str
    detectable: bool
    verdict: str
    caught_by: list[tuple[str, list[str]]]
    shift: tuple[str, float] | None

    @property
    def as_expected(self) -> bool:
        """Whether an alarm is raised if and only if the fault is detectable."""
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


def trial(name: str, comparison: Differences) -> Trial:
    """The trial of the control, or of the fault of that name."""
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
    fault = FAULTS.get(name, _HEALTHY)
    return Trial(
        name,
        fault.about,
        fault.detectable,
        comparison.verdict,
        [(label, [case for _, case in cases]) for label, cases in strongest],
        None if shift is None else (shift[2], shift[1]),
    )


def _decades(finding: Finding) -> float:
    """The change of the value in decades; infinite if one of the two is not a number, or only one is 0."""
    try:
        old, new = (log10(exact(value or "")) for value in (finding.baseline, finding.candidate))
    except InputError:
        return 0.0 if finding.baseline == finding.candidate else float("inf")
    if old is None or new is None:
        return 0.0 if old == new else float("inf")
    return abs(new - old)


def tasks(plan: str = "selftest") -> list[Task]:
    """The tasks of the plan for each integrator: healthy, healthy with other roundings, each fault."""
    healthy = expand(load(plan, KINDS)[0])
    control = [replace(task, seed=1) for task in healthy]
    plug_ins = [fault.integrator for fault in FAULTS.values()]
    return [*healthy, *control, *(replace(task, source=faulty) for faulty in plug_ins for task in healthy)]


def trials(tasks: Sequence[Task], workers: int, progress: Callable[[Task], None]) -> list[Trial]:
    """The trials of :func:`tasks`: one for the control and one for each fault."""
    rows_by_index: dict[int, Row] = {}
    for index, row in rows(tasks, KINDS, workers, None):
        rows_by_index[index] = row
        progress(tasks[index])
    names = (CONTROL, *FAULTS)
    size = len(tasks) // (1 + len(names))
    healthy, *candidates = (
        Report(SCHEMA, {}, {}, [rows_by_index[i] for i in range(k, k + size)]) for k in range(0, len(tasks), size)
    )
    compared = (compare(healthy, faulty, Policy(), KINDS) for faulty in candidates)
    return [trial(name, comparison) for name, comparison in zip(names, compared, strict=True)]


def in_words(trials: Sequence[Trial]) -> RenderableType:
    """A table of the faults: verdict, and detectors or the largest change without an alarm."""
    table = Table(box=None, pad_edge=False)
    for name in ("fault", "what is wrong", "verdict", "caught by, strongest first"):
        table.add_column(name, overflow="fold", no_wrap=name in ("fault", "verdict"))
    for trial in trials:
        style = "" if trial.as_expected else "bold red"
        table.add_row(
            Text(trial.fault, style=style), Text(trial.about), Text(trial.verdict, style=style), Text(_words(trial))
        )
    wrong = [trial.fault for trial in trials if not trial.as_expected]
    note = f"Not as expected: {', '.join(wrong)}." if wrong else "Every detectable fault was detected, and no other."
    return Group(table, Text(), Text(note, style="bold red" if wrong else "green"))


def _words(trial: Trial) -> str:
    if trial.caught_by:
        lines = [f"{metric} ({', '.join(cases)})" for metric, cases in trial.caught_by[:_SHOWN]]
        more = len(trial.caught_by) - _SHOWN
        return "\n".join(lines + ([f"and {more} more"] if more > 0 else []))
    if trial.shift is None or trial.shift[1] == 0:
        return "no metric changed"
    taken = "read as an improvement" if trial.verdict == "better" else "inside its allowance"
    return f"nothing: {trial.shift[0]} moved most, by {trial.shift[1]:.2f} decades, {taken}"
