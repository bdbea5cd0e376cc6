"""The file of a survey: one Parquet row group a chunk, one row a motion."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from heavytop.suite.files import whole

FILE = "survey.parquet"
_TEXTS = ("sweep", "integrator", "precision", "horizon", "class", "outcome")
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
    from pyarrow.parquet import read_table

    return read_table(io.BytesIO(content))


def write(path: Path, chunks: Iterable[bytes]) -> None:
    """All chunks into one file, a row group each, one at a time in memory; whole or not at all."""
    schema = _schema()
    with whole(path) as file, _writer(file, schema) as writer:
        for content in chunks:
            table = read_chunk(content).cast(schema)
            writer.write_table(table, row_group_size=max(1, table.num_rows))
