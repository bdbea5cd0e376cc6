"""The gate: the report of a plan, compared with a committed baseline, which --bless replaces."""

from __future__ import annotations

import shutil
from pathlib import Path

from heavytop.api.reports import Comparison
from heavytop.api.run_folder import PAGE, is_written
from heavytop.errors import InputError, PeerFailed
from heavytop.features.kinds import KINDS
from heavytop.files import replace, writable
from heavytop.integrate.registry import is_third_party
from heavytop.records import UNSUPPORTED, Row
from heavytop.report.compare.findings import line
from heavytop.report.document.document import row_name
from heavytop.report.render.comparison import headline
from heavytop.report.store.store import FILE, read_brief

MESSAGE = "message.txt"


def require_baseline(baseline: Path, remedy: str) -> None:
    """Raise InputError if the folder has no report, or a changed one; remedy: the command that makes it."""
    if not any((baseline / name).exists() for name in (FILE, f"{FILE}.gz")):
        raise InputError(f"{baseline} contains no baseline.", f"Make one, and commit it: {remedy}")
    read_brief(baseline, KINDS)


def clear(folder: Path) -> None:
    """Remove a former report from its folder if that contains nothing else."""
    content = list(folder.iterdir()) if folder.is_dir() else []
    if all(is_written(path.name) or path.name in (MESSAGE, f"{FILE}.gz") for path in content):
        for path in content:
            path.unlink()


def policy_of(plan: str, policy: Path | None) -> Path | None:
    """The given policy, else ``policy.toml`` in the folder of the plan if it exists."""
    default = Path(plan).parent / "policy.toml"
    return policy or (default if Path(plan).suffix == ".toml" and default.exists() else None)


def bless(measured: Path, baseline: Path, summary: str, comparison: Comparison | None) -> str:
    """Make the report in ``measured`` the baseline, without its page; returns the text of a commit message.

    The text, with the old and the new numbers of each row that changed, is written to ``measured`` too.  summary: of
    the report.  comparison: with the former baseline; None if that is missing or unreadable.  Raises InputError if
    a folder cannot be written, and PeerFailed if no row of a third-party integrator has a number.
    """
    rows_of: dict[str, list[Row]] = {}
    for row in read_brief(measured, KINDS).rows:
        subject = row.key.subject
        if subject.what == "computed" and is_third_party(subject.name) and row.outcome != UNSUPPORTED:
            rows_of.setdefault(subject.name, []).append(row)
    for name, rows in rows_of.items():
        if not any(row.metrics for row in rows):
            reason = rows[0].reference.reason or rows[0].outcome
            raise PeerFailed(f"No row of {name} has a number, so no baseline is made: {reason}.")
    text = f"Begin the baseline of accuracy\n\n{summary}\n" if comparison is None else _moved(comparison)
    replace(measured / MESSAGE, text.encode())
    with writable(baseline, "Give a writable --baseline."):
        clear(baseline)
        shutil.copytree(measured, baseline, dirs_exist_ok=True, ignore=shutil.ignore_patterns(MESSAGE, PAGE))
    return text


def _moved(comparison: Comparison) -> str:
    """The commit message of a new baseline: verdict, findings, and a line for each changed row."""
    lines = [f"Move the baseline of accuracy: {comparison.verdict}", "", f"{headline(comparison)}."]
    lines += [f"- {sentence}" for sentence in comparison.sentences]
    rows = [f"{change.verdict.value}: {row_name(change.identity)}: {line(change)}" for change in comparison.rows]
    return "\n".join([*lines, *(["", *rows] if rows else [])]) + "\n"
