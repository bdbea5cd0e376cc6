"""`run` and `list`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from heavytop.cli.app import command, show_on_terminal
from heavytop.errors import InputError


@command
def run(
    plan: Annotated[str, typer.Option(help="smoke, default, long, peers, or a TOML file.")] = "default",
    out: Annotated[Path | None, typer.Option(help="New folder for the report.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the rows that --out already holds.")] = False,
    workers: Annotated[int | None, typer.Option(help="Local processes; as many as there are processors.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to run on instead.")] = None,
    parquet: Annotated[bool, typer.Option("--parquet", help="Write DIR/rows.parquet too.")] = False,
    seed: Annotated[int, typer.Option(help="Measure the same motions with other roundings: 0 to 1000.")] = 0,
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
    if resume and out is None:
        raise InputError("--resume needs to know what to resume.", "Give the folder with --out.")
    directory = _fresh(out, loaded.name, resume)
    identity = {"name": loaded.name, "sha256": digest, "seed": str(seed)}
    return _run(tasks, identity, directory, workers or os.cpu_count() or 1, scheduler, parquet)


def _run(tasks: Any, plan: dict[str, str], directory: Path, workers: int, scheduler: str | None, parquet: bool) -> int:
    from heavytop.precision import available, parse

    missing = {name for name in {task.precision for task in tasks} - {""} if available()[parse(name).family]}
    if missing:
        raise InputError(
            f"The plan needs {', '.join(sorted(missing))}, which this platform lacks.", "`heavytop list` says why."
        )

    from heavytop.records import SCHEMA, Report
    from heavytop.report import html, store, text
    from heavytop.report.environment import environment
    from heavytop.report.parquet import FILE as PARQUET
    from heavytop.report.parquet import write as write_parquet
    from heavytop.suite.checkpoint import Checkpoint
    from heavytop.suite.run import run as run_tasks

    surroundings = environment()
    identity = {**plan, **surroundings["packages"]}
    identity |= {key: str(surroundings[key]) for key in ("commit", "processor", "simd_width_double")}
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with Checkpoint(directory, identity) as checkpoint, _progress(tasks) as advance:
            rows = run_tasks(tasks, checkpoint, advance, min(workers, len(tasks)), scheduler)
            report = Report(SCHEMA, plan, surroundings, rows)
            if parquet:
                write_parquet(directory / PARQUET, report.rows, plan)
            path = store.write(report, directory)
            html.write_report(report, path.with_suffix(".html"))
    except OSError as error:
        raise InputError(f"{directory} cannot be written: {error}.", "Choose a writable --out with space.") from None
    except KeyboardInterrupt:
        print(f"heavytop: interrupted; finished rows are kept: --out {directory} --resume goes on", file=sys.stderr)
        return 130
    show_on_terminal(text.summary(report))
    print(f"\nReport: {path}\nPage:   {path.with_suffix('.html')}")
    # that a peer gives up is what the work-precision rows are there to show
    return 0 if all(row.outcome == "success" for row in rows if row.measure != "work_precision") else 3


def _fresh(out: Path | None, plan: str, resume: bool) -> Path:
    """The folder to write to; raises InputError where it holds anything that this run did not put there."""
    from datetime import UTC, datetime

    from heavytop.suite.checkpoint import FILE

    if out is None:
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
        return Path("heavytop-results") / f"{plan}-{stamp}"
    if not out.exists():
        return out
    if not out.is_dir():
        raise InputError(f"{out} is a file.", "Give a new folder with --out.")
    content = {path.name for path in out.iterdir()} - {".lock"}
    if not content or (resume and FILE in content):
        return out
    remedy = "Give a new folder with --out." + (" Or go on with --resume." if FILE in content else "")
    raise InputError(f"{out} already holds {', '.join(sorted(content)[:5])}.", remedy)


class _progress:  # noqa: N801 - a context manager used like a function
    """A bar with ETA on a terminal, nothing elsewhere; called with each finished task."""

    def __init__(self, tasks: Any) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        console = Console(stderr=True)
        self.bar = Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self.id = self.bar.add_task("starting", total=sum(task.cost for task in tasks))

    def __enter__(self) -> _progress:
        self.bar.start()
        return self

    def __call__(self, task: Any) -> None:
        self.bar.update(self.id, advance=task.cost, description=task.label[:48])

    def __exit__(self, *_: object) -> None:
        self.bar.stop()


@command
def list_() -> int:
    """List the cases, plans, systems, number formats and integrators that are there."""
    from heavytop.integrate import peers
    from heavytop.precision import available
    from heavytop.suite.cases import CASES
    from heavytop.suite.plan import BUILT_IN

    print("Cases")
    for case in CASES.values():
        print(f"  {case.name:20} {case.system.name:10} {case.about}")
    print(f"Plans\n  {', '.join(BUILT_IN)}, or a TOML file")
    print("Systems\n  heavy_top, gyrostat")
    print("Number formats")
    for name, reason in available().items():
        label = "real:BITS" if name == "real" else name
        note = {"real": "24 to 20000 bits", "double": "53 bits", "extended": "64 bits", "quad": "113 bits"}[name]
        print(f"  {label:10} {note if reason is None else f'not available: {reason}'}")
    print("Integrators")
    for name, reason in peers.available().items():
        print(f"  {name:15} {'installed' if reason is None else reason}")
    return 0
