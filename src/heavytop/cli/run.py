"""`run`."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer

from heavytop.cli.app import absolute, command, plans
from heavytop.cli.output import say, say_former
from heavytop.cli.progress import Progress


@command
def run(
    plan: Annotated[
        str, typer.Option(help="smoke, default, growth, long, peers, gate, or a TOML file.", autocompletion=plans)
    ] = "default",
    integrator: Annotated[str, typer.Option(help="Measure it beside heyoka: a name, mine.toml, mine.py:solve.")] = "",
    out: Annotated[Path | None, typer.Option(help="New folder for the report.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the rows that --out already holds.")] = False,
    workers: Annotated[int | None, typer.Option(help="Local processes; as many as there are processors.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to run on instead.")] = None,
    parquet: Annotated[bool, typer.Option("--parquet", help="Write DIR/rows.parquet too.")] = False,
    seed: Annotated[int, typer.Option(help="Measure the same motions with other roundings: 0 to 1000.")] = 0,
    row_timeout: Annotated[
        str | None, typer.Option(help="Seconds of a row of a third-party integrator, at most.", metavar="SECONDS")
    ] = None,
    save_every: Annotated[float, typer.Option(help="Seconds after which a long row saves its place.", min=0)] = 10.0,
) -> int:
    """Run a plan of measurements and write its report.

    It goes to DIR/report.json and DIR/report.html.  On two cores smoke takes about 10 seconds, default a minute,
    gate two minutes, peers five, growth ten, long half an hour.
    """
    from heavytop.api.run_folder import PAGE, prepare
    from heavytop.kinds import KINDS
    from heavytop.report.store import FILE as REPORT
    from heavytop.suite.checkpoint import FILE as ROWS
    from heavytop.suite.plan import former

    asked = prepare(
        plan,
        # whatever an integrator does to the working directory
        None if out is None else absolute(out),
        resume=resume,
        workers=workers,
        scheduler=scheduler,
        seed=seed,
        integrator=integrator,
        save_every=save_every,
        with_parquet=parquet,
        row_timeout=row_timeout,
    )
    directory = asked.directory
    say_former({integrator} | former(plan))
    for warning in asked.warnings:
        say(f"warning: {warning}")
    if asked.is_finished:
        ended = asked.finished()
        print(ended.summary)
        print(f"\nReport: {directory / REPORT} (was finished already)")
        return 0 if ended.good else 3
    began = perf_counter()
    try:
        with _stopped_by_signals(), Progress(asked.tasks, KINDS, asked.workers) as advance:
            ended = asked.measure(advance, advance.begin)
    except KeyboardInterrupt as stop:
        kept = f"finished rows are kept: --out {directory} --resume goes on"
        said = kept if (directory / ROWS).exists() else "no row was finished"
        say(f"interrupted; {said}")
        return 143 if isinstance(stop, _Terminated) else 130
    print(ended.summary)
    page = directory / PAGE
    print(f"\nMade in {perf_counter() - began:.0f} s. Every row: heavytop show {directory} --full")
    print(f"Report: {directory / REPORT}")
    print(f"Page:   {page if page.exists() else f'none for so many rows; `heavytop show {directory} --html FILE`'}")
    return 0 if ended.good else 3


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
