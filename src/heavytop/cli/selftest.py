"""`selftest`."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from heavytop.cli.app import Json, command, print_json, show_on_terminal
from heavytop.cli.progress import Progress


@command
def selftest(
    workers: Annotated[int | None, typer.Option(help="Local processes; as many as there are processors.")] = None,
    json: Json = False,
) -> int:
    """Try the detectors on integrators broken on purpose.

    Exit 1 if a fault they should see slips through.  Takes two minutes on two cores.
    """
    from heavytop.api import arguments
    from heavytop.api import selftest as detectors
    from heavytop.kinds import KINDS

    at_once = arguments.count(workers, "workers") or os.cpu_count() or 1
    tasks = detectors.tasks()
    with Progress(tasks, KINDS, at_once) as advance:
        trials = detectors.trials(tasks, at_once, advance)
    if json:
        print_json({"trials": [trial.to_json() for trial in trials]})
    else:
        from heavytop.report.selftest_text import selftest_text

        show_on_terminal(selftest_text(trials))
    return 0 if all(trial.as_expected for trial in trials) else 1
