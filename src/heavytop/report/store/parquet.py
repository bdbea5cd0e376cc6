"""Rows as Parquet, one line per metric, for pandas, duckdb and other readers of tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from heavytop.errors import InputError
from heavytop.extras import require_extra
from heavytop.files import atomic_write
from heavytop.precision import exact
from heavytop.records import SCHEMA, Row

FILE = "rows.parquet"
_GROUP = 1 << 15
"""Lines of a row group, the part held in memory."""

_OF_ROW = {
    **dict.fromkeys(("measure", "case", "system", "integrator", "precision"), "string"),
    "bits": "int32",
    **dict.fromkeys(("outcome", "horizon", "time_reached"), "string"),
    "steps": "int64",
    "finite": "bool_",
    **dict.fromkeys(("measured", "against"), "string"),
    "starts": "int32",
}
_OF_METRIC = {"kind": "string", "value": "string", "log10": "float64", "bound": "string", "band": "float64"}
_OF_LAW = dict.fromkeys(("exponent", "low", "high"), "float64") | dict.fromkeys(
    ("first", "last", "detects", "lost_at"), "string"
)
_OF_DATA = {"inertia": 3, "weight": 0, "centre": 3, "omega": 3, "gamma": 3, "rotor": 3}
"""Number of components of each; 0 for a scalar."""
_DATA = [f"{name}{i}" for name, count in _OF_DATA.items() for i in (range(1, count + 1) if count else ("",))]
COLUMNS = (
    _OF_ROW
    | {"metric": "string"}
    | _OF_METRIC
    | _OF_LAW
    | dict.fromkeys(_DATA, "float64")
    | {f"{name}_exact": "string" for name in _OF_DATA}
)
"""Column -> type.  Measured numbers are text, as in the report, with log10 beside them.

inertia1 to rotor3 are the top and the start as floats, and inertia_exact to rotor_exact the same as exact text.
A growth law is a line of kind "law" whose metric is the name of its series and whose value is its class; a row with
neither metric nor law is one line without them.
"""


def check_name(path: Path) -> None:
    """Raises InputError unless the file has the suffix of Parquet, and pyarrow is installed."""
    require_extra("parquet")
    if path.suffix != ".parquet":
        raise InputError(f"{path} is not named as Parquet.", "Give a file that ends in .parquet.")


def write(path: Path, rows: Iterable[Row], plan: dict[str, str]) -> None:
    """Writes the file atomically, one row group in memory at a time; the plan goes into its metadata.

    Raises InputError where it cannot be written.
    """
    import pyarrow
    from pyarrow.parquet import ParquetWriter

    metadata = {"heavytop.schema": SCHEMA} | {f"heavytop.plan.{key}": value for key, value in plan.items()}
    schema = pyarrow.schema([(name, getattr(pyarrow, kind)()) for name, kind in COLUMNS.items()], metadata)
    stream = lines(rows)
    with atomic_write(path) as file, ParquetWriter(file, schema, compression="zstd") as writer:
        while group := list(islice(stream, _GROUP)):
            columns = [pyarrow.array(c, f.type) for c, f in zip(zip(*group, strict=True), schema, strict=True)]
            writer.write_batch(pyarrow.record_batch(columns, schema=schema))


def lines(rows: Iterable[Row]) -> Iterator[tuple[Any, ...]]:
    """One tuple per metric or growth law, in the order of :data:`COLUMNS`."""
    no_metric, no_law = [None] * len(_OF_METRIC), [None] * len(_OF_LAW)
    for row in rows:
        *same, starts = (getattr(row, name) for name in _OF_ROW)
        data = _data(row)
        for name, metric in row.metrics.items():
            yield *same, starts, name, *(getattr(metric, field) for field in _OF_METRIC), *no_law, *data
        for name, law in row.laws.items():
            as_metric = "law", law.growth, None, None, None
            yield *same, law.starts, name, *as_metric, *(getattr(law, field) for field in _OF_LAW), *data
        if not (row.metrics or row.laws):
            yield *same, starts, None, *no_metric, *no_law, *data


def _float(text: str) -> float:
    """The nearest double of exact text, infinite beyond the range of double."""
    number = exact(text)
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


def _data(row: Row) -> list[float | str | None]:
    """The top and the start as doubles, infinite beyond their range, then as text; None for missing data."""
    floats: list[float | None] = []
    texts: list[str | None] = []
    for name, count in _OF_DATA.items():
        numbers: Any = None if row.data is None else getattr(row.data, name)
        parts = [] if not numbers else list(numbers) if count else [numbers]
        floats += [_float(part) for part in parts] or [None] * max(count, 1)
        texts.append(",".join(parts) or None)
    return [*floats, *texts]
