"""The row of a survey: counts, quantiles, distributions and the worst motions of all its chunks."""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

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
from heavytop.records import CellMap, Histogram, Metric, Quantity, Row, RowKey, Spread, Worst, by_name

# The file of a survey: one Parquet row group per chunk, one row per motion.


FILE = "survey.parquet"
SAME = ("sweep", "integrator", "tolerance", "precision", "horizon")
"""Columns that are equal in all motions of a row."""
_TEXTS = (*SAME, "class", "outcome")
_INTEGERS = ("index", "steps")
_ERRORS = ("digits_right", "error_max", "error_time", "error_omega", "error_gamma", "error_scaled", "reference_radius")
DRIFT_COLUMNS = ("drift_gamma_squared", "drift_area", "drift_energy", "drift_further")
DATA = tuple(f"{name}{i}" for name in ("inertia", "moment", "rotor", "omega", "gamma") for i in (1, 2, 3))
COLUMNS = ("sweep", "index", *_TEXTS[1:], *_ERRORS, *DRIFT_COLUMNS, "steps", *DATA)
"""Columns in the order of the file.  inertia1 to gamma3 are the rounded top and start, moment is P r."""


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

    schema = _schema()
    arrays = [pyarrow.array(columns[field.name], field.type, from_pandas=True) for field in schema]
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
    """Write all chunks into one file, a row group each, one at a time in memory, atomically."""
    schema = _schema()
    with atomic_write(path) as file, _writer(file, schema) as writer:
        for content in chunks:
            table = read_chunk(content).cast(schema)
            writer.write_table(table, row_group_size=max(1, table.num_rows))


# Distributions of quantities over the motions, and the digits lost over two of their data.


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
    """The first two data that differ between motions, Ω before γ before the top."""
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
_OF_MOTIONS = ("index", "outcome", "steps", "digits_right", *_QUANTITIES)
"""Columns from which the row of a survey is made."""
_NORMAL = 1.959964
"""Standard deviations of a 95 % interval."""


def gathered(rows: Iterator[tuple[Task, Row]]) -> list[Row]:
    """A row for each sweep and integrator, in the order of the plan.

    A survey with a chunk that was not measured ends as the first such chunk does, and keeps the statistics of the
    others.  A dozen numbers a motion are held in memory.
    """
    tables: dict[RowKey, list[Any]] = {}
    first: dict[RowKey, tuple[Task, Row, tuple[str, ...]]] = {}
    lost: dict[RowKey, Row] = {}
    for task, row in rows:
        key = msgspec.structs.replace(row.key, case=sweep_of(task).name)
        chunks, request = tables.setdefault(key, []), {"tops": sweep_of(task).exact_data, **(task.request or {})}
        of_survey = msgspec.structs.replace(row, case=key.case, key=key, request=request, chunk=msgspec.UNSET)
        if not isinstance(row.chunk, bytes):
            lost.setdefault(key, of_survey)
            continue
        table = read_chunk(row.chunk)
        if key not in first:
            axes = task.options or two_of({name: table[name].to_numpy() for name in DATA})
            first[key] = task, of_survey, axes
        chunks.append(table.select(dict.fromkeys((*_OF_MOTIONS, *first[key][2]))))
    ended = ("outcome", "time_reached", "finite", "reference", "against")
    surveys = []
    for key, chunks in tables.items():
        row = _survey(*first[key], chunks) if chunks else lost[key]
        changes = {name: getattr(lost[key], name) for name in ended} if key in lost else {}
        surveys.append(msgspec.structs.replace(row, **changes))
    return surveys


def _survey(task: Task, row: Row, axes: Sequence[str], chunks: Sequence[Any]) -> Row:
    """The row of the motions in these tables.  row: of the first chunk.  axes: data over which digits are mapped."""
    import pyarrow

    table = pyarrow.concat_tables(chunks)
    outcomes, cases = table["outcome"].cast("string").to_pylist(), sweep_of(task).cases()
    counts = Counter(outcomes)
    metrics = {
        Quantity(COUNT, outcome): Metric(str(n), math.log10(n), "value") for outcome, n in sorted(counts.items())
    }
    sorted_values = {column: numpy.sort(table[column].drop_null().to_numpy()) for column in _QUANTITIES}
    for column, values in sorted_values.items():
        metrics |= _quantiles(Quantity(*_QUANTITIES[column]), values)
    digits, error, index = (table[name].to_numpy() for name in ("digits_right", "error_max", "index"))
    error = numpy.where(numpy.isnan(error), 0.0, error)
    success = numpy.array([outcome == Outcome.SUCCESS.value for outcome in outcomes])
    # failed runs first, then the largest errors, then the first drawn
    order = numpy.lexsort((index, -error, success))[:MOST_WORST].tolist()
    cells = None
    if len(axes) == 2:
        x, y = ((name, table[name].to_numpy()) for name in axes)
        cells = cell_map(x, y, row.bits * math.log10(2) - digits)
    return msgspec.structs.replace(
        row,
        outcome=Outcome.SUCCESS.value,
        metrics=by_name(metrics),
        steps=int(table["steps"].to_numpy().sum()),
        measured=f"{len(outcomes)} motions of the sweep {row.case}, {len(outcomes) - success.sum()} of which did not "
        "reach the horizon",
        data=None,
        spread=Spread(
            {name: bins for name, values in sorted_values.items() if (bins := histogram(values))},
            cells,
        ),
        worst=tuple(
            _worst(task, cases[index[i]], int(index[i]), outcomes[i], float(error[i]), float(digits[i])) for i in order
        ),
    )


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


def _worst(task: Task, case: Case, index: int, outcome: str, error: float, digits: float) -> Worst:
    data, subject, reached = data_of(case), task.key.subject, outcome == Outcome.SUCCESS.value
    assert data is not None
    command = rerun(case, task.times, task.key.precision, subject.name, subject.tolerance, reached)
    right = None if math.isnan(digits) else round(digits, 2)
    return Worst(case.name, index, outcome, f"{error:.8g}" if reached else "", right, data, command)


def sweep_of(task: Task) -> Sweep:
    """The sweep that the motions of a task are of."""
    assert isinstance(task.case, Chunk)
    return task.case.sweep


def of_motions(row: Row) -> Sequence[tuple[str, str]]:
    """Counts by outcome of a gathered row."""
    return [(m.quantity.component, m.value) for m in row.metrics.values() if m.quantity and m.quantity.name == COUNT]
