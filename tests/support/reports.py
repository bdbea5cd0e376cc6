"""Reports as the command line joins them, with every kind of measurement; and rows made from their flat names."""

from __future__ import annotations

import json
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec

from heavytop import records
from heavytop.errors import PeerFailed
from heavytop.features.kinds import KINDS
from heavytop.harness import plan as _plan
from heavytop.harness import run as _workers
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import Task
from heavytop.harness.rows import failed as failed_row
from heavytop.records import Against, Metric, Quantity, RowKey, Series, Subject
from heavytop.report.compare import compare as _compare
from heavytop.report.document.kind import kind_of
from heavytop.report.render import history as _history
from heavytop.report.render import page as _html
from heavytop.report.render import terminal as _terminal
from heavytop.report.render import text as _overview
from heavytop.report.render import text as _text
from heavytop.report.store import checks as _consistency
from heavytop.report.store import store as _store

compare = partial(_compare.compare, kinds=KINDS)
history = partial(_history.history, kinds=KINDS)
summary = partial(_terminal.summary, kinds=KINDS)
failed = partial(_text.failed, kinds=KINDS)
all_good = partial(_overview.all_good, kinds=KINDS)
report_page = partial(_html.report_page, kinds=KINDS)
comparison_page = partial(_html.comparison_page, kinds=KINDS)
write_report = partial(_html.write_report, kinds=KINDS)
load = partial(_plan.load, kinds=KINDS)
expand = _plan.expand
plan_of = partial(_plan.of_document, kinds=KINDS)
read_plan = partial(_plan.read, kinds=KINDS)


def plan_file(folder: Path, text: str) -> str:
    """The path of a plan of this text, written into a folder; its name is tiny unless the text begins with one."""
    (folder / "plan.toml").write_text(text if text.startswith("name") else f'name = "tiny"\n{text}', "utf-8")
    return str(folder / "plan.toml")


def tasks_of(folder: Path, text: str) -> Any:
    """The tasks of a plan of this text, written into a folder."""
    return read_plan(plan_file(folder, text))[2]


def drift(*cases: str, runs: Iterable[tuple[str, str, int]] = (("double", "2", 3),), **more: object) -> str:
    """A table of a plan in TOML: the drift of cases in runs of a precision, a horizon and so many samples each."""
    each = [{"precision": p, "horizon": end, "samples": count} for p, end, count in runs]
    return asked("drift", *cases, **more, runs=each)


def asked(kind: str, /, *cases: str, **keys: object) -> str:
    """A table of a plan in TOML: what is measured of cases."""
    return table("measure", kind=kind, cases=cases, **keys)


def table(name: str, /, **keys: object) -> str:
    """A table of an array of tables in TOML, each key on a line."""
    return "".join([f"[[{name}]]\n", *(f"{key} = {in_toml(value)}\n" for key, value in keys.items())])


def in_toml(value: object) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {in_toml(part)}' for key, part in value.items())} }}"
    return f"[{', '.join(map(in_toml, value))}]" if isinstance(value, list | tuple) else json.dumps(value)


store = SimpleNamespace(
    read=partial(_store.read, kinds=KINDS),
    read_brief=partial(_store.read_brief, kinds=KINDS),
    write=_store.write,
    FILE=_store.FILE,
    DIGEST=_store.DIGEST,
)
html = SimpleNamespace(
    report_page=report_page,
    comparison_page=comparison_page,
    write_report=write_report,
    sections=lambda sources, first=(): _html.sections(sources, KINDS, first),
    detailed=_html.detailed,
    commands=_html.commands,
)


def rows(tasks: Any, workers: int, scheduler: str | None = None, *more: Any, **others: Any) -> Any:
    return _workers.rows(tasks, KINDS, workers, scheduler, *more, **others)


def measure(task: Task, saved: Saved | None = None) -> records.Row:
    try:
        return KINDS[task.key.kind].measure(task, saved or Saved())
    except PeerFailed as error:
        return failed_row(task, error.cause)


def contradictions(row: records.Row) -> Any:
    return _consistency.contradictions(row, kind_of(row, KINDS))


_STATISTICS = ("max_finite", "samples_not_finite", "not_finite_from", "max", "rms", "final", "expected", "off_by")
_NAMES = (
    "drift",
    "solution_error",
    "integration_error",
    "claim_model_error",
    "claim_evaluation_error",
    "claim_evaluation",
    "local_error_ulp",
    "break_away_slope",
    "observed_order",
    "error",
)


def quantity(text: str) -> Quantity:
    """What the key of a metric or a series stands for."""
    if text.startswith("("):
        equation, branch, domain = text.split()
        name, _, component = equation.rpartition(".")
        return Quantity(name, component, "", branch, domain)
    name = next((n for n in _NAMES if text == n or text.startswith(n + "_")), None)
    if name is None:
        return Quantity(text)
    rest = text[len(name) + 1 :]
    statistic = next((s for s in _STATISTICS if rest == s or rest.endswith("_" + s)), "")
    component = rest.removesuffix(statistic).strip("_")
    found = Quantity(name, component, statistic)
    assert found.text == text
    return found


def subject(integrator: str, measure: str = "") -> Subject:
    """What the text of a row says is measured."""
    name, _, rest = integrator.partition(" ")
    if measure == "score":
        return Subject("given", integrator)
    if name.startswith("claim:"):
        return Subject("claimed", "(4.2)-(4.6)", branch=name.removeprefix("claim:"))
    if name.startswith("formula:"):
        return Subject("claimed", "(4.2)-(4.6)", form=name.removeprefix("formula:"))
    if name == "audit":
        return Subject("claimed", "audit")
    for setting in ("tolerance", "step"):
        if rest.startswith(setting):
            return Subject("computed", name, **{setting: rest.removeprefix(setting).lstrip("= ")})
    return Subject("computed", integrator)


def Row(**given: Any) -> records.Row:  # noqa: N802 - in the place of the record
    """A row from the keys that a report documents; the typed ones follow from them, unless they are given."""
    measure = given.setdefault("measure", "")
    case, slash, direction = given["case"].rpartition("/")
    if not slash or direction not in ("forward", "backward"):
        case, direction = given["case"].partition("/T=")[0], ""
    given["key"] = given.get("key") or RowKey(
        measure,
        case,
        given["system"],
        subject(given["integrator"], measure),
        given["precision"],
        direction,
        given["horizon"],
    )
    text = given.pop("against", "")
    given["reference"] = given.get("reference") or Against("proven", text)
    for name, metric in given["metrics"].items():
        if metric.quantity is None or metric.quantity.text != name:
            given["metrics"][name] = msgspec.structs.replace(metric, quantity=quantity(name))
    for part in ("series", "laws"):
        for name, each in given.get(part, {}).items():
            if each.quantity is None:
                given[part][name] = msgspec.structs.replace(each, quantity=quantity(name))
    return records.Row(**given)


def replace(record: Any, **changes: Any) -> Any:
    """`msgspec.structs.replace`, with the key of a row following its flat names."""
    if not isinstance(record, records.Row):
        return msgspec.structs.replace(record, **changes)
    flat = {name: getattr(record, name) for name in record.__struct_fields__} | changes
    if {"case", "system", "integrator", "precision", "horizon", "measure"} & changes.keys() and "key" not in changes:
        flat["key"] = None
    if "against" in changes and "reference" not in changes:
        flat["reference"] = None
    flat |= {part: dict(flat[part]) for part in ("metrics", "series", "laws")}
    return Row(**flat)


__all__ = ["Metric", "Series"]
