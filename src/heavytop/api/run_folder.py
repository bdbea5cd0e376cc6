"""Runs of plans into folders: their tasks, checks of the folder, and the report."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from heavytop import arguments
from heavytop.display import printable
from heavytop.errors import InputError, PeerFailed, refusal
from heavytop.extras import require_extra
from heavytop.features.kinds import KINDS
from heavytop.files import writable
from heavytop.harness import BUILT_IN, checkpoint
from heavytop.harness.checkpoint import Checkpoint, identity_of
from heavytop.harness.plan import read, warnings
from heavytop.harness.rows import Task
from heavytop.harness.run import Progress, unheard
from heavytop.harness.run import run as run_tasks
from heavytop.integrate.peers.command import Command, greeting
from heavytop.integrate.registry import name_of, named, seconds_of
from heavytop.records import SCHEMA, Report, Row
from heavytop.report.document.document import row_name
from heavytop.report.render import page, text
from heavytop.report.render.terminal import brief
from heavytop.report.store import parquet, store
from heavytop.report.store.checks import check_rows
from heavytop.report.store.store import environment

PAGE = "report.html"
_ANOTHER = "Give another --out."
MOST_ON_A_PAGE = 5000
"""A run with more rows makes no page, which would contain them all."""


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """A finished run: its summary and whether no row failed."""

    summary: str
    good: bool

    @classmethod
    def of(cls, report: Report, rows: Callable[[], Iterable[Row]]) -> FinishedRun:
        """The run with that report; rows: returns its rows at each call."""
        return cls(brief(report, rows(), KINDS), text.all_good(rows(), KINDS))


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """A run of a plan, ready to start.

    identity: name, hash and seed of the plan.  warnings: of the tops defined in the plan.
    resume: continue with the rows in ``directory``.  save_every: seconds between checkpoints of a long row.
    row_timeout: seconds of a row of a third-party integrator; None for limits by its other rows.
    """

    identity: dict[str, str]
    tasks: Sequence[Task]
    warnings: list[str]
    directory: Path
    resume: bool
    workers: int
    scheduler: str | None
    save_every: float
    parquet: bool
    row_timeout: float | None = None

    @property
    def is_finished(self) -> bool:
        """Whether nothing remains to be done: all rows are measured and the report is written."""
        report, rows = self.directory / store.FILE, self.directory / checkpoint.FILE
        return self.resume and report.exists() and not rows.exists()

    def finished(self) -> FinishedRun:
        """The result of a run that is finished already; raises InputError if it was of another plan."""
        report = store.read(self.directory, KINDS)
        checkpoint.require_same(report.plan, self.identity, self.directory)
        if self.parquet:
            parquet.write(self.directory / parquet.FILE, report.rows, report.plan)
        return FinishedRun.of(report, lambda: report.rows)

    def measure(self, progress: Progress = unheard, begun: Progress = unheard) -> FinishedRun:
        """Measure the remaining rows, write the report and summarise it.

        progress, begun: called with each task that is finished, and that begins.
        Raises InputError if the folder has other content or cannot be written; finished rows are kept for --resume.
        """
        greetings = _greetings(self.tasks)
        reported = {"integrators": {name: text for name, (text, _) in greetings.items()}} if greetings else {}
        report = Report(SCHEMA, self.identity, environment() | reported, [])
        versions = {name: version for name, (_, version) in greetings.items()}
        tasks = [
            dataclasses.replace(task, key=task.key.of_version(versions.get(task.key.subject.name, "")))
            for task in self.tasks
        ]
        return dataclasses.replace(self, tasks=tasks if greetings else self.tasks)._measure(report, progress, begun)

    def _measure(self, report: Report, progress: Progress, begun: Progress) -> FinishedRun:
        """Measure, with the versions of programs in the keys."""
        fit = partial(require_fit, self.directory, self.resume)
        with (
            writable(self.directory),
            Checkpoint(self.directory, identity_of(report), fit, self.save_every) as rows,
        ):
            self._require_own(rows)
            laws = run_tasks(self.tasks, KINDS, rows, progress, self.workers, self.scheduler, begun, self.row_timeout)
            return self._write(report, self._reported(rows, laws))

    def _require_own(self, rows: Checkpoint) -> None:
        """Raise InputError if the checkpoint has a row that no run of this plan has written."""
        indices = sorted(rows.offsets)
        for index, row in zip(indices, rows.rows(indices), strict=True):
            if index not in range(len(self.tasks)) or row.key != self.tasks[index].key:
                name = printable(row_name(row.identity))[:60]
                raise InputError(f"{rows.path} holds the row {name}, which is not row {index} of this plan.", _ANOTHER)
            check_rows(rows.path, [row], KINDS)

    def _reported(self, rows: Checkpoint, laws: Sequence[Row]) -> Callable[[], Iterable[Row]]:
        """A function that returns the rows of the report, read once unless they are too many; rows of kinds that gather
        them are combined, and the files of these kinds are written.
        """
        indices = range(len(self.tasks))
        parts: dict[str, list[int]] = {}
        for index in indices:
            if KINDS[kind := self.tasks[index].key.kind].gathers:
                parts.setdefault(kind, []).append(index)
        rows_of_kinds = [row for kind, gathered in parts.items() for row in self._gathered(kind, rows, gathered)]
        others = sorted(set(indices).difference(*parts.values()))
        if len(self.tasks) > MOST_ON_A_PAGE:
            return lambda: chain(rows.rows(others), rows_of_kinds, laws)
        loaded = [*rows.rows(others), *rows_of_kinds, *laws]
        return lambda: loaded

    def _gathered(self, kind: str, rows: Checkpoint, indices: list[int]) -> list[Row]:
        """The rows of the report combined from those at these indices, of a kind that gathers them."""
        tasks = [self.tasks[index] for index in indices]
        return KINDS[kind].gather(lambda: zip(tasks, rows.rows(indices), strict=True), self.directory)

    def _write(self, report: Report, rows: Callable[[], Iterable[Row]]) -> FinishedRun:
        """Write all files of a finished run.  rows: returns all rows at each call."""
        if self.parquet:
            parquet.write(self.directory / parquet.FILE, rows(), report.plan)
        store.write(report, self.directory, rows())
        if len(self.tasks) <= MOST_ON_A_PAGE:
            page.write_report(replace(report, rows=list(rows())), self.directory / PAGE, KINDS)
        return FinishedRun.of(report, rows)


def prepare(
    plan: str,
    out: Path | None,
    *,
    resume: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    seed: int = 0,
    save_every: float = checkpoint.EVERY,
    with_parquet: bool = False,
    integrator: Any = "",
    row_timeout: Any = None,
    clear: Callable[[Path], object] | None = None,
) -> PlannedRun:
    """The run of a plan into the folder ``out``, by default a new one under heavytop-results; nothing is written yet.

    clear: called with that folder once all other checks have passed.

    Raises InputError for an impossible plan, a folder with other content, and contradictory options.
    """
    if with_parquet:
        require_extra("parquet")
    which = named(integrator)
    loaded, digest, tasks = read(plan, KINDS, seed, which)
    of_plan = None if loaded.row_timeout == "" else loaded.row_timeout
    timeout = of_plan if row_timeout is None else row_timeout
    workers = arguments.count(workers, "workers")
    if workers is not None and scheduler is not None:
        raise InputError("--workers and --scheduler were given: a scheduler has its own.", "Give one of them.")
    if not save_every >= 0:
        raise refusal("save_every", "0 or more", save_every, "Give seconds, such as 10.")
    if resume and out is None:
        raise InputError("--resume needs --out.", "Give the folder of the run that was interrupted.")
    identity = {"name": loaded.name, "sha256": digest, "seed": str(seed)}
    identity |= {} if plan in BUILT_IN else {"file": printable(Path(plan).name)}
    run = PlannedRun(
        identity | ({"integrator": name_of(which)} if which else {}),
        tasks,
        warnings(loaded),
        out or Path("heavytop-results") / f"{loaded.name}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}",
        resume,
        workers or os.cpu_count() or 1,
        scheduler,
        save_every,
        with_parquet,
        None if timeout is None else seconds_of(timeout, "--row-timeout" if row_timeout is not None else "row_timeout"),
    )
    if clear is not None:
        clear(run.directory)
    if not run.is_finished:
        require_fit(run.directory, resume)
    return run


def _greetings(tasks: Sequence[Task]) -> dict[str, tuple[str, str]]:
    """(greeting, version) of each integrating program, by its name."""
    sources = {task.source for task in tasks if task.source is not None} if len(tasks) <= MOST_ON_A_PAGE else set()
    programs = sorted((source for source in sources if isinstance(source, Command)), key=lambda source: source.name)
    return {program.name: _greeting(program) for program in programs}


def _greeting(command: Command) -> tuple[str, str]:
    try:
        answer = greeting(command)
    except PeerFailed as error:
        return f"not started: {error.cause}", ""
    return answer, answer.partition(" ")[2]


def is_written(name: str) -> bool:
    """Whether a run writes a file of that name into its folder."""
    gathered = {file for kind in KINDS.values() for file in kind.gathers}
    return name in {store.FILE, store.DIGEST, PAGE, parquet.FILE, *gathered} or bool(checkpoint.OURS.fullmatch(name))


def require_fit(directory: Path, resume: bool) -> None:
    """Raise InputError if the folder has other content than files of a run, or without --resume any content."""
    if not directory.exists():
        return
    if not directory.is_dir():
        raise InputError(f"{directory} is a file.", "Give a new folder with --out.")
    content = {path.name for path in directory.iterdir()}
    begun = checkpoint.FILE in content
    content -= {name for name in content if checkpoint.OURS.fullmatch(name) and (resume or name != checkpoint.FILE)}
    if resume and begun:
        content -= {name for name in content if is_written(name)}  # written, but the checkpoint is not yet removed
    if content:
        remedy = "Give a new folder with --out." + (" Or continue that run with --resume." if begun else "")
        raise InputError(f"{directory} already contains {', '.join(sorted(content)[:5])}.", remedy)
