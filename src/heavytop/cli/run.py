"""`run`."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heavytop.cli.app import command, show_on_terminal
from heavytop.cli.progress import Progress
from heavytop.errors import InputError

if TYPE_CHECKING:
    from heavytop.records import Report, Row

_PAGE = "report.html"
_MOST_ON_A_PAGE = 5000
"""Beyond so many rows a run makes no page: it would hold them all."""


@command
def run(
    plan: Annotated[str, typer.Option(help="smoke, default, growth, long, peers, or a TOML file.")] = "default",
    out: Annotated[Path | None, typer.Option(help="New folder for the report.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the rows that --out already holds.")] = False,
    workers: Annotated[int | None, typer.Option(help="Local processes; as many as there are processors.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to run on instead.")] = None,
    parquet: Annotated[bool, typer.Option("--parquet", help="Write DIR/rows.parquet too.")] = False,
    seed: Annotated[int, typer.Option(help="Measure the same motions with other roundings: 0 to 1000.")] = 0,
    save_every: Annotated[float, typer.Option(help="Seconds after which a long row saves its place.", min=0)] = 10.0,
) -> int:
    """Run a plan of measurements; write DIR/report.json and DIR/report.html."""
    from heavytop.report.parquet import require_pyarrow
    from heavytop.suite.plan import expand, load

    if parquet:
        require_pyarrow()

    loaded, digest = load(plan)
    tasks = expand(loaded, seed)
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers} cannot run anything.", "Give 1 or more.")
    if workers is not None and scheduler is not None:
        raise InputError("--workers are processes here, --scheduler has its own.", "Give one of them.")
    if resume and out is None:
        raise InputError("--resume needs to know what to resume.", "Give the folder with --out.")
    identity = {"name": loaded.name, "sha256": digest, "seed": str(seed)}
    directory = out or _new_folder(loaded.name)
    if resume and _is_finished(directory):
        return _show_finished(directory, identity, parquet)
    _require_fit(directory, resume)
    where = {"workers": workers or os.cpu_count() or 1, "scheduler": scheduler}
    return _run(tasks, identity, directory, resume, save_every, where, parquet)


def _run(
    tasks: Any,
    plan: dict[str, str],
    directory: Path,
    resume: bool,
    save_every: float,
    where: dict[str, Any],
    parquet: bool,
) -> int:
    """Measure what is not there yet, write the report and show it."""
    from heavytop.records import SCHEMA, Report
    from heavytop.report.environment import environment
    from heavytop.report.store import FILE as REPORT
    from heavytop.suite.checkpoint import Checkpoint, identity_of
    from heavytop.suite.run import run as run_tasks

    if where["workers"] == 1 and where["scheduler"] is None:
        import heavytop.suite.measurements  # noqa: F401 - loads heyoka, while Ctrl-C still leaves at once
    report = Report(SCHEMA, plan, environment(), [])
    fit = partial(_require_fit, directory, resume)
    try:
        with (
            _stopped_by_signals(),
            Checkpoint(directory, identity_of(report), fit, save_every) as checkpoint,
            Progress(tasks) as advance,
        ):
            laws = run_tasks(tasks, checkpoint, advance, **where)
            summary, good = _write(
                report,
                directory,
                lambda: chain(checkpoint.rows(range(len(tasks))), laws),
                len(tasks) <= _MOST_ON_A_PAGE,
                parquet,
            )
    except OSError as error:
        raise InputError(
            f"{directory} cannot be written: {error}.",
            "Make space, or choose a writable --out; finished rows are kept for --resume.",
        ) from None
    except KeyboardInterrupt as stop:
        print(f"heavytop: interrupted; finished rows are kept: --out {directory} --resume goes on", file=sys.stderr)
        return 143 if isinstance(stop, _Terminated) else 130
    show_on_terminal(summary)
    page = directory / _PAGE
    print(f"\nReport: {directory / REPORT}")
    print(f"Page:   {page if page.exists() else f'none for so many rows; `heavytop show {directory} --html FILE`'}")
    return 0 if good else 3


def _write(
    report: Report, directory: Path, rows: Callable[[], Iterator[Row]], page: bool, parquet: bool
) -> tuple[Any, bool]:
    """Write all that a finished run leaves; returns its summary, and whether no row failed.

    rows: a new stream of all rows at each call.  page: whether to make one.
    """
    from msgspec.structs import replace

    from heavytop.report import html, overview, store
    from heavytop.report import parquet as tables

    if parquet:
        tables.write(directory / tables.FILE, rows(), report.plan)
    store.write(report, directory, rows())
    if page:
        html.write_report(replace(report, rows=list(rows())), directory / _PAGE)
    return overview.overview(report, rows()), overview.all_good(rows())


class _Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a run like Ctrl-C."""


@contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """SIGINT and SIGTERM are exceptions, so that what is finished is kept and said."""

    def terminate(*_: object) -> None:
        raise _Terminated

    handlers: dict[signal.Signals, Any] = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: terminate}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _new_folder(plan: str) -> Path:
    from datetime import UTC, datetime

    return Path("heavytop-results") / f"{plan}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}"


def _is_finished(directory: Path) -> bool:
    from heavytop.report.store import FILE as REPORT
    from heavytop.suite.checkpoint import FILE

    return (directory / REPORT).exists() and not (directory / FILE).exists()


def _show_finished(directory: Path, plan: dict[str, str], parquet: bool) -> int:
    from heavytop.report import overview, store
    from heavytop.report import parquet as tables
    from heavytop.suite.checkpoint import require_same

    report = store.read(directory)
    require_same(report.plan, plan, directory)
    if parquet:
        tables.write(directory / tables.FILE, report.rows, report.plan)
    show_on_terminal(overview.overview(report, report.rows))
    print(f"\nReport: {directory / store.FILE} (was finished already)")
    return 0 if overview.all_good(report.rows) else 3


def _require_fit(directory: Path, resume: bool) -> None:
    """Raises InputError where the folder holds anything that a run did not put there, or all of it without --resume."""
    from heavytop.report.parquet import FILE as PARQUET
    from heavytop.report.store import DIGEST
    from heavytop.report.store import FILE as REPORT
    from heavytop.suite.checkpoint import FILE, OURS

    if not directory.exists():
        return
    if not directory.is_dir():
        raise InputError(f"{directory} is a file.", "Give a new folder with --out.")
    content = {path.name for path in directory.iterdir()}
    begun = FILE in content
    content -= {name for name in content if OURS.fullmatch(name) and (resume or name != FILE)}
    if resume and begun:
        content -= {REPORT, DIGEST, _PAGE, PARQUET}  # written, but not yet cleared up after
    if content:
        remedy = "Give a new folder with --out." + (" Or go on with --resume." if begun else "")
        raise InputError(f"{directory} already holds {', '.join(sorted(content)[:5])}.", remedy)
