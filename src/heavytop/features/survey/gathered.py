"""The chunks of a survey together: one row with counts, quantiles and the worst motions."""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy
from numpy.typing import NDArray

from heavytop.cases import Case
from heavytop.features.survey.measured import Chunk
from heavytop.files import atomic_write
from heavytop.harness.case_text import rerun
from heavytop.harness.rows import Task, data_of
from heavytop.harness.sweeps import Sweep
from heavytop.integrate.trajectory import Outcome
from heavytop.measure.scalar import of_fraction
from heavytop.records import CellMap, Histogram, Metric, Quantity, Row, Spread, Worst, by_name

# The file of a survey: one Parquet row group a chunk, one row a motion.


FILE = "survey.parquet"
_TEXTS = ("sweep", "integrator", "tolerance", "precision", "horizon", "class", "outcome")
_INTEGERS = ("index", "steps")
_ERRORS = ("digits_right", "error_max", "error_time", "error_omega", "error_gamma", "error_scaled", "reference_radius")
DRIFT_COLUMNS = ("drift_gamma_squared", "drift_area", "drift_energy", "drift_further")
DATA = tuple(f"{name}{i}" for name in ("inertia", "moment", "rotor", "omega", "gamma") for i in (1, 2, 3))
COLUMNS = ("sweep", "index", *_TEXTS[1:], *_ERRORS, *DRIFT_COLUMNS, "steps", *DATA)
"""In the order of the file.  inertia1 to gamma3 are the rounded top and start, moment that of the weight, P r."""


def _schema() -> Any:
    import pyarrow

    def kind(name: str) -> Any:
        if name in _TEXTS:
            return pyarrow.dictionary(pyarrow.int32(), pyarrow.string())
        return pyarrow.int64() if name in _INTEGERS else pyarrow.float64()

    return pyarrow.schema([(name, kind(name)) for name in COLUMNS])


def chunk_bytes(columns: dict[str, Any]) -> bytes:
    """A Parquet file of one row group; NaN becomes null."""
    import pyarrow

    schema, arrays = _schema(), []
    for field in schema:
        values = columns[field.name]
        if field.name in _TEXTS:
            arrays.append(pyarrow.array(values, pyarrow.string()).dictionary_encode())
        else:
            arrays.append(pyarrow.array(values, field.type, from_pandas=True))
    stream = io.BytesIO()
    with _writer(stream, schema) as writer:
        writer.write_table(pyarrow.Table.from_arrays(arrays, schema=schema))
    return stream.getvalue()


def _writer(where: Any, schema: Any) -> Any:
    from pyarrow.parquet import ParquetWriter

    return ParquetWriter(where, schema, compression="zstd")


def read_chunk(content: bytes) -> Any:
    """The table of :func:`chunk_bytes`."""
    from pyarrow.parquet import ParquetFile

    return ParquetFile(io.BytesIO(content)).read(use_threads=False)


def write(path: Path, chunks: Iterable[bytes]) -> None:
    """All chunks into one file, a row group each, one at a time in memory; whole or not at all."""
    schema = _schema()
    with atomic_write(path) as file, _writer(file, schema) as writer:
        for content in chunks:
            table = read_chunk(content).cast(schema)
            writer.write_table(table, row_group_size=max(1, table.num_rows))


# Distributions of the quantities of many motions, and the digits lost over two of their data.


WIDTH = 0.25
"""Width of a bin, in decades."""
_CELLS = 24
_MOST_BINS = 2000
_FIRST = ("omega", "gamma", "inertia", "moment", "rotor")


def histogram(values: NDArray[numpy.float64]) -> Histogram | None:
    """The histogram of the values above 0; None without any."""
    positive = values[values > 0]
    if not len(positive):
        return None
    bins = numpy.floor(numpy.log10(positive) / WIDTH).astype(int)
    bins = numpy.maximum(bins, bins.max() - _MOST_BINS + 1)
    counts = numpy.bincount(bins - bins.min())
    return Histogram(float(bins.min() * WIDTH), WIDTH, tuple(counts.tolist()))


def two_of(columns: Mapping[str, Any]) -> tuple[str, ...]:
    """The first two data that are not the same in all motions, Ω before γ before the top."""
    ordered = sorted(DATA, key=lambda name: (_FIRST.index(name[:-1]), name))
    return tuple(name for name in ordered if len(numpy.unique(columns[name])) > 1)[:2]


def cell_map(
    x: tuple[str, NDArray[numpy.float64]], y: tuple[str, NDArray[numpy.float64]], lost: NDArray[numpy.float64]
) -> CellMap | None:
    """Medians over at most 24 by 24 cells; cells of single values where there are no more of them.  NaN is left out."""
    kept = numpy.isfinite(lost) & numpy.isfinite(x[1]) & numpy.isfinite(y[1])
    if not kept.any():
        return None
    edges = [_edges(values[kept]) for _, values in (x, y)]
    across, up = (
        numpy.clip(numpy.searchsorted(e, v[kept], "right") - 1, 0, len(e) - 2)
        for e, (_, v) in zip(edges, (x, y), strict=True)
    )
    width, height = (len(e) - 1 for e in edges)
    cell = up * width + across
    order = numpy.lexsort((lost[kept], cell))
    medians: list[float | None] = [None] * (width * height)
    counts = numpy.bincount(cell, minlength=width * height)
    ends = numpy.cumsum(counts)
    ordered = lost[kept][order]
    for index in numpy.flatnonzero(counts).tolist():
        medians[index] = round(float(ordered[ends[index] - 1 - counts[index] // 2]), 3)
    rows = tuple(tuple(medians[k * width : (k + 1) * width]) for k in range(height))
    return CellMap(x[0], y[0], tuple(edges[0].tolist()), tuple(edges[1].tolist()), rows)


def _edges(values: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
    single = numpy.unique(values)
    if len(single) > _CELLS:
        return numpy.linspace(single[0], single[-1], _CELLS + 1)
    middle = (single[1:] + single[:-1]) / 2
    room = (single[1] - single[0]) / 2 if len(single) > 1 else math.ulp(1.0) + abs(single[0]) / 2
    last = (single[-1] - single[-2]) / 2 if len(single) > 1 else room
    return numpy.array([single[0] - room, *middle, single[-1] + last])


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


class _Bad(NamedTuple):
    """A motion, the worst the smallest: failed runs first, then the largest errors, then the first drawn."""

    reached: bool
    minus_error: float
    motion: int
    digits: float
    outcome: str


class Gathered:
    """Takes in the chunks of one survey, in order; keeps eight doubles a motion."""

    def __init__(self, first: Row, task: Task) -> None:
        self._row, self._task = first, task
        self._values: dict[str, list[Any]] = {name: [] for name in _QUANTITIES}
        self._outcomes: Counter[str] = Counter()
        self._digits: list[Any] = []
        self._steps = 0
        self._worst: list[_Bad] = []
        self._map: dict[str, list[Any]] = {name: [] for name in task.options}

    def take(self, row: Row) -> None:
        """Add a chunk."""
        assert isinstance(row.chunk, bytes)
        table = read_chunk(row.chunk)
        for name, values in self._values.items():
            values.append(table[name].drop_null().to_numpy())
        if not self._outcomes and not self._map:
            self._map = {name: [] for name in two_of({name: table[name].to_numpy() for name in DATA})}
        for name, values in [*self._map.items(), ("", self._digits)]:
            values.append(table[name or "digits_right"].to_numpy())
        outcomes = table["outcome"].cast("string").to_pylist()
        self._outcomes.update(outcomes)
        self._steps += int(sum(table["steps"].to_pylist()))
        error = table["error_max"].to_numpy()
        error = numpy.where(numpy.isnan(error), 0.0, error)
        success = numpy.array([outcome == Outcome.SUCCESS.value for outcome in outcomes])
        places = numpy.lexsort((-error, success))[:MOST_WORST].tolist()
        index, digits = table["index"].to_numpy(), table["digits_right"].to_numpy()
        worst = [_Bad(bool(success[i]), -error[i], int(index[i]), float(digits[i]), outcomes[i]) for i in places]
        self._worst = sorted([*self._worst, *worst])[:MOST_WORST]

    def row(self) -> Row:
        """The row of the report."""
        sweep = sweep_of(self._task)
        name, cases = sweep.name, sweep.cases()
        motions = self._outcomes.total()
        failed = motions - self._outcomes[Outcome.SUCCESS.value]
        counts = {Quantity(COUNT, outcome): n for outcome, n in sorted(self._outcomes.items())}
        metrics = {q: Metric(str(n), math.log10(n), "value") for q, n in counts.items()}
        sorted_values = {column: numpy.sort(numpy.concatenate(values)) for column, values in self._values.items()}
        for column, values in sorted_values.items():
            metrics |= _quantiles(Quantity(*_QUANTITIES[column]), values)
        histograms = {name: bins for name, values in sorted_values.items() if (bins := histogram(values))}
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
            request=_request(self._task),
            spread=Spread(histograms, self._cells()),
            worst=tuple(_worst(self._task, cases[motion.motion], motion) for motion in self._worst),
        )

    def _cells(self) -> CellMap | None:
        """The digits lost over two of the data."""
        if len(self._map) < 2:
            return None
        lost = self._row.bits * math.log10(2) - numpy.concatenate(self._digits)
        x, y = ((name, numpy.concatenate(values)) for name, values in self._map.items())
        return cell_map(x, y, lost)


def _quantiles(quantity: Quantity, values: NDArray[numpy.float64]) -> dict[Quantity, Metric]:
    """Order statistics of sorted values, with half the width in decades of the 95 % interval of each by its ranks."""
    quantiles: dict[Quantity, Metric] = {}
    n = len(values)
    for name, p in QUANTILES.items() if n else ():
        rank = min(n - 1, math.ceil(p * n) - 1)
        metric = of_fraction(Fraction(float(values[rank])))
        half = _NORMAL * math.sqrt(n * p * (1 - p))
        low, high = max(0, math.floor(rank - half)), min(n - 1, math.ceil(rank + half))
        if p < 1 and values[low] > 0:
            width = math.log10(values[high]) - math.log10(values[low])
            metric = msgspec.structs.replace(metric, band=round(min(100.0, width / 2), 4))
        quantiles[quantity.over(name)] = metric
    return quantiles


def _worst(task: Task, case: Case, bad: _Bad) -> Worst:
    data = data_of(case)
    assert data is not None
    right = None if math.isnan(bad.digits) else round(bad.digits, 2)
    error = f"{-bad.minus_error:.8g}" if bad.reached else ""
    subject = task.key.subject
    command = rerun(case, task.times, task.key.precision, subject.name, subject.tolerance, bad.reached)
    return Worst(case.name, bad.motion, bad.outcome, error, right, data, command)


def gathered(rows: Iterator[tuple[Task, Row]]) -> list[Row]:
    """A row for each sweep and integrator, in the order of the plan.

    A survey with a chunk that was not measured ends as the first such chunk does: what the others came to stays in it.
    """
    sums: dict[Any, Gathered | None] = {}
    lost: dict[Any, Row] = {}
    for task, row in rows:
        key = msgspec.structs.replace(row.key, case=sweep_of(task).name)
        entry = sums.setdefault(key, None)
        if not isinstance(row.chunk, bytes):
            lost.setdefault(key, msgspec.structs.replace(row, case=key.case, key=key, request=_request(task)))
            continue
        if entry is None:
            entry = sums[key] = Gathered(row, task)
        entry.take(row)
    return [_survey(entry, lost.get(key)) for key, entry in sums.items()]


def _request(task: Task) -> dict[str, str]:
    """The request of a survey: which tops, and what its table says."""
    return {"tops": sweep_of(task).exact_data, **(task.request or {})}


def sweep_of(task: Task) -> Sweep:
    """The sweep that the motions of a task are of."""
    assert isinstance(task.case, Chunk)
    return task.case.sweep


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


def of_motions(row: Row) -> Sequence[tuple[str, str]]:
    """Counts by outcome of a gathered row."""
    return [(m.quantity.component, m.value) for m in row.metrics.values() if m.quantity and m.quantity.name == COUNT]
