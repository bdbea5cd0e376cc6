"""What the chunks of a survey come to together: one row with counts, quantiles and the worst motions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import msgspec
import numpy

from heavytop.integrate.trajectory import Outcome
from heavytop.measure.scalar import of_fraction
from heavytop.precision import parse, time_text
from heavytop.records import CellMap, Metric, Quantity, Row, Spread, Worst, by_name
from heavytop.suite.case_text import forms
from heavytop.suite.cases import Case
from heavytop.suite.rows import data_of
from heavytop.suite.survey.drawn import Chunk
from heavytop.suite.survey.spread import cell_map, histogram, two_of
from heavytop.suite.survey.table import DATA, DRIFT_COLUMNS, read_chunk
from heavytop.suite.task import Task

MOST_WORST = 20
QUANTILES = {"median": 0.5, "q90": 0.9, "q99": 0.99, "max": 1.0}
COUNT = "motions"
_ERROR = "solution_error"
_QUANTITIES = {
    "error_max": (_ERROR, "relative"),
    "error_omega": (_ERROR, "omega"),
    "error_gamma": (_ERROR, "gamma"),
    "error_scaled": (_ERROR, "scaled"),
    **{name: ("drift", name.removeprefix("drift_")) for name in DRIFT_COLUMNS},
}
_NORMAL = 1.959964
"""Standard deviations of a 95 % interval."""


@dataclass(frozen=True, slots=True)
class _Bad:
    index: int
    error: float
    digits: float
    outcome: str

    @property
    def order(self) -> tuple[bool, float, int]:
        """Failed runs first, then the largest errors, then the first drawn."""
        return self.outcome == Outcome.SUCCESS.value, -self.error, self.index


class Gathered:
    """Takes in the chunks of one survey, in order; keeps eight doubles a motion."""

    def __init__(self, first: Row, task: Task) -> None:
        self._row, self._task = first, task
        self._values: dict[str, list[Any]] = {name: [] for name in _QUANTITIES}
        self._outcomes: dict[str, int] = {}
        self._digits: list[Any] = []
        self._steps = 0
        self._worst: list[_Bad] = []
        self._map: dict[str, list[Any]] = {name: [] for name in task.options}

    def take(self, row: Row) -> None:
        """One chunk."""
        assert isinstance(row.chunk, bytes)
        table = read_chunk(row.chunk)
        for name, values in self._values.items():
            values.append(table[name].drop_null().to_numpy())
        if not self._outcomes and not self._map:
            self._map = {name: [] for name in two_of({name: table[name].to_numpy() for name in DATA})}
        for name, values in [*self._map.items(), ("", self._digits)]:
            values.append(table[name or "digits_right"].to_numpy())
        outcomes = table["outcome"].cast("string").to_pylist()
        for outcome in outcomes:
            self._outcomes[outcome] = self._outcomes.get(outcome, 0) + 1
        self._steps += int(sum(table["steps"].to_pylist()))
        error = table["error_max"].to_numpy()
        error = numpy.where(numpy.isnan(error), 0.0, error)
        success = numpy.array([each == Outcome.SUCCESS.value for each in outcomes])
        places = numpy.lexsort((-error, success))[:MOST_WORST].tolist()
        index, digits = table["index"].to_numpy(), table["digits_right"].to_numpy()
        found = [_Bad(int(index[i]), float(error[i]), float(digits[i]), outcomes[i]) for i in places]
        self._worst = sorted([*self._worst, *found], key=lambda each: each.order)[:MOST_WORST]

    def row(self) -> Row:
        """The row of the report."""
        chunk = self._task.case
        assert isinstance(chunk, Chunk)
        assert chunk.sweep is not None
        name, cases = chunk.sweep.name, chunk.sweep.cases()
        motions = sum(self._outcomes.values())
        failed = motions - self._outcomes.get(Outcome.SUCCESS.value, 0)
        counts = {Quantity(COUNT, outcome): n for outcome, n in sorted(self._outcomes.items())}
        metrics = {q: Metric(str(n), math.log10(n), "value") for q, n in counts.items()}
        sorted_values = {column: numpy.sort(numpy.concatenate(values)) for column, values in self._values.items()}
        for column, values in sorted_values.items():
            metrics |= _quantiles(Quantity(*_QUANTITIES[column]), values)
        histograms = {name: found for name, values in sorted_values.items() if (found := histogram(values))}
        return msgspec.structs.replace(
            self._row,
            case=name,
            key=msgspec.structs.replace(self._row.key, case=name),
            chunk=msgspec.UNSET,
            outcome=Outcome.SUCCESS.value,
            metrics=by_name(metrics),
            steps=self._steps,
            measured=f"{motions} motions of the sweep {name}, {failed} of which did not reach the horizon",
            data=None,
            spread=Spread(histograms, self._cells()),
            worst=tuple(_worst(self._task, cases[each.index], each) for each in self._worst),
        )

    def _cells(self) -> CellMap | None:
        """The digits lost over two of the data."""
        if len(self._map) < 2:
            return None
        lost = self._row.bits * math.log10(2) - numpy.concatenate(self._digits)
        x, y = ((name, numpy.concatenate(values)) for name, values in self._map.items())
        return cell_map(x, y, lost)


def _quantiles(quantity: Quantity, values: Any) -> dict[Quantity, Metric]:
    """Order statistics of sorted values, with half the width in decades of the 95 % interval of each by its ranks."""
    found: dict[Quantity, Metric] = {}
    n = len(values)
    for name, p in QUANTILES.items() if n else ():
        rank = min(n - 1, math.ceil(p * n) - 1)
        metric = of_fraction(Fraction(float(values[rank])))
        half = _NORMAL * math.sqrt(n * p * (1 - p))
        low, high = max(0, math.floor(rank - half)), min(n - 1, math.ceil(rank + half))
        if p < 1 and values[low] > 0:
            width = math.log10(values[high]) - math.log10(values[low])
            metric = msgspec.structs.replace(metric, band=round(min(100.0, width / 2), 4))
        found[quantity.over(name)] = metric
    return found


def _worst(task: Task, case: Case, bad: _Bad) -> Worst:
    data = data_of(case)
    assert data is not None
    right = None if math.isnan(bad.digits) else round(bad.digits, 2)
    error = "" if bad.outcome != Outcome.SUCCESS.value else f"{bad.error:.8g}"
    return Worst(case.name, bad.index, bad.outcome, error, right, data, _command(task, case, bad))


def _command(task: Task, case: Case, bad: _Bad) -> str:
    """The command that shows it again: the digits that are right, or how the run ends."""
    line = forms(case)["command"].rpartition(" --times ")[0]
    times = ",".join(map(time_text, task.times))
    precision = "" if parse(task.key.precision).name == "double" else f" --precision {task.key.precision}"
    tolerance = f" --tolerance {task.key.subject.tolerance}" if task.key.subject.tolerance else ""
    line += f" --times {times}{precision} --integrator {task.key.subject.name}{tolerance}"
    return line if bad.outcome != Outcome.SUCCESS.value else f"{line} --json | heavytop score -"


def gathered(rows: Iterator[tuple[Task, Row]]) -> list[Row]:
    """One row for each sweep and integrator, in the order of the plan.

    A survey with a chunk that was not measured ends as the first such chunk does: what the others came to stays in it.
    """
    sums: dict[Any, Gathered | None] = {}
    lost: dict[Any, Row] = {}
    for task, row in rows:
        assert isinstance(task.case, Chunk)
        assert task.case.sweep is not None
        key = msgspec.structs.replace(row.key, case=task.case.sweep.name)
        found = sums.setdefault(key, None)
        if not isinstance(row.chunk, bytes):
            lost.setdefault(key, msgspec.structs.replace(row, case=key.case, key=key))
            continue
        if found is None:
            found = sums[key] = Gathered(row, task)
        found.take(row)
    return [_survey(each, lost.get(key)) for key, each in sums.items()]


def _survey(measured: Gathered | None, lost: Row | None) -> Row:
    """The row of a survey: what its measured chunks came to, with the outcome of a lost one."""
    if measured is None:
        assert lost is not None
        return lost
    row = measured.row()
    if lost is None:
        return row
    ended = {name: getattr(lost, name) for name in ("outcome", "time_reached", "finite", "reference", "against")}
    return msgspec.structs.replace(row, **ended)


def contents(rows: Iterator[Row]) -> Iterator[bytes]:
    """The Parquet bytes of the chunks, in the order of the plan."""
    return (row.chunk for row in rows if isinstance(row.chunk, bytes))


def of_motions(row: Row) -> Sequence[tuple[str, str]]:
    """Counts by outcome of a gathered row."""
    return [(m.quantity.component, m.value) for m in row.metrics.values() if m.quantity and m.quantity.name == COUNT]
