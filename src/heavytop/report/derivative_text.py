"""Proven derivatives of a motion as lines for people: one a derivative, so that nothing is cut at 80 columns."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.measure.derivatives import PARAMETERS, STARTS, DerivativeBall, Derivatives
from heavytop.top.equations import NAMES


def derivative_lines(times: Sequence[str], found: Derivatives) -> list[RenderableType]:
    """The method, then the derivatives at each time, each with its radius, and the Lyapunov exponent."""
    parts: list[RenderableType] = [Text(), Text(f"derivatives: {found.method}")]
    for index, time in enumerate(times):
        for matrices, columns in ((found.start, STARTS), (found.data, PARAMETERS)):
            if matrices is not None:
                parts += [Text(), _entries(time, matrices[index], columns)]
        exponent = None if found.lyapunov is None else found.lyapunov[index]
        if exponent is not None:
            parts += [Text(), Text(f"finite-time Lyapunov exponent {exponent.value} ± {exponent.radius}")]
    return parts


def _entries(time: str, matrix: Sequence[Sequence[DerivativeBall]], columns: Sequence[str]) -> Table:
    table = Table(box=None, show_header=False)
    table.add_row("t", Text(time, overflow="fold"))
    for name, row in zip(NAMES, matrix, strict=True):
        for column, entry in zip(columns, row, strict=True):
            table.add_row(f"∂{name}/∂{column}", Text(f"{entry.value} ± {entry.radius}", overflow="fold"))
    return table
