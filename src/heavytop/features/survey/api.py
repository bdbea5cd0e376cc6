"""The records of a survey, one row a motion, from Python."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from heavytop import arguments
from heavytop.errors import InputError, quoted, refusal
from heavytop.extras import require_extra
from heavytop.features.survey.gathered import COLUMNS, FILE
from heavytop.files import readable
from heavytop.precision import ordered


def read_survey(path: str | os.PathLike[str], *, columns: Sequence[str] | None = None, lazy: bool = False) -> Any:
    """The records of a survey.

    Arguments:
        path: the folder of a run, or its survey.parquet.
        columns: read only these; None for all.
        lazy: a polars LazyFrame, which reads what is asked of it.

    Returns:
        A pandas DataFrame with one row a motion.  Its columns are ``sweep``, ``index`` in it, ``class``, ``outcome``,
        ``digits_right``, ``error_max``, ``steps``, ``drift_*``, the rounded top and start.  What could not be measured
        is missing.

    Raises:
        InputError: without a survey, for a column that is not there, and where pandas (of a lazy one, polars)
            is not installed.
    """
    where = arguments.path(path, "path")
    file = where / FILE if where.is_dir() else where
    known = f"Use {', '.join(COLUMNS)}."
    wanted = None if columns is None else [columns] if isinstance(columns, str) else ordered(columns, "columns", known)
    for name in wanted or ():
        if not isinstance(name, str) or name not in COLUMNS:
            raise refusal("column", "one of a survey", quoted(name), known)
    if not file.is_file():
        raise InputError(f"{where} holds no survey.", f"Give the folder of a run that holds {FILE}.")
    if arguments.flag(lazy, "lazy"):
        try:
            import polars
        except ImportError:
            raise InputError("A lazy survey needs polars.", "Install it with: pip install polars") from None
        frame = polars.scan_parquet(file)
        return frame if wanted is None else frame.select(wanted)
    try:
        import pandas
    except ImportError:
        raise InputError("A table needs pandas.", "Install it with: pip install pandas") from None
    require_extra("parquet")
    import pyarrow

    with readable(file, "Give the folder of a finished run.", pyarrow.ArrowException):
        return pandas.read_parquet(file, columns=wanted, engine="pyarrow")
