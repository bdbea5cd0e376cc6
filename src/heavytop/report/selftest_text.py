"""The trials of the detectors in words, for people."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.selftest import Trial

_SHOWN = 3


def selftest_text(trials: Sequence[Trial]) -> RenderableType:
    """A table of the faults: verdict, and what caught each or how far below every alarm it lies."""
    table = Table(box=None, pad_edge=False)
    for name in ("fault", "what is wrong", "verdict", "caught by, strongest first"):
        table.add_column(name, overflow="fold", no_wrap=name in ("fault", "verdict"))
    for trial in trials:
        style = "" if trial.as_expected else "bold red"
        table.add_row(
            Text(trial.fault, style=style), Text(trial.about), Text(trial.verdict, style=style), Text(_words(trial))
        )
    wrong = [trial.fault for trial in trials if not trial.as_expected]
    said = f"Not as expected: {', '.join(wrong)}." if wrong else "Every fault that can be seen was seen, and no other."
    return Group(table, Text(), Text(said, style="bold red" if wrong else "green"))


def _words(trial: Trial) -> str:
    if trial.caught_by:
        lines = [f"{metric} ({', '.join(cases)})" for metric, cases in trial.caught_by[:_SHOWN]]
        more = len(trial.caught_by) - _SHOWN
        return "\n".join(lines + ([f"and {more} more"] if more > 0 else []))
    if trial.shift is None or trial.shift[1] == 0:
        return "nothing moved"
    taken = "read as an improvement" if trial.verdict == "better" else "inside its allowance"
    return f"nothing: {trial.shift[0]} moved most, by {trial.shift[1]:.2f} decades, {taken}"
