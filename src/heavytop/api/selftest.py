"""The suite's own detectors, tried on integrators that are deliberately broken.

Each fault of :mod:`heavytop.integrate.broken` runs the plan `selftest`, and its report is compared with that of the
healthy integrator, as any candidate is with its baseline.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from heavytop.comparison.compare import CONTROL, Trial, compare, trial
from heavytop.comparison.noise import Policy
from heavytop.integrate.broken import FAULTS
from heavytop.kinds import KINDS
from heavytop.records import SCHEMA, Report, Row
from heavytop.suite.plan import expand, load
from heavytop.suite.rows import Task
from heavytop.suite.run import rows


def tasks(plan: str = "selftest") -> list[Task]:
    """The measurements of the plan for every integrator: healthy, healthy with other roundings, each fault."""
    healthy = expand(load(plan, KINDS)[0])
    control = [replace(task, seed=1) for task in healthy]
    return [*healthy, *control, *(replace(task, fault=fault) for fault in FAULTS for task in healthy)]


def trials(tasks: Sequence[Task], workers: int, progress: Callable[[Task], None]) -> list[Trial]:
    """What comes of :func:`tasks`: one trial for the control and one for each fault."""
    found: dict[int, Row] = {}
    for index, row in rows(tasks, KINDS, workers, None):
        found[index] = row
        progress(tasks[index])
    names = (CONTROL, *FAULTS)
    size = len(tasks) // (1 + len(names))
    healthy, *others = ([found[i] for i in range(at, at + size)] for at in range(0, len(tasks), size))
    compared = (compare(_report(healthy), _report(other), Policy(), KINDS) for other in others)
    return [trial(name, comparison) for name, comparison in zip(names, compared, strict=True)]


def _report(measured: Sequence[Row]) -> Report:
    return Report(SCHEMA, {}, {}, list(measured))
