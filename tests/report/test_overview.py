"""What is shown of a report with more rows than anybody reads."""

from io import StringIO

from rich.console import Console

from heavytop.records import SCHEMA, Metric, Report, Row
from heavytop.report.render.text import worst
from support import small_reports


def row(index: int, value: str, log10: float | None, outcome: str = "success") -> Row:
    metrics = {"drift_energy_max": Metric(value, log10), "count": Metric("7", 0.845098, "value")}
    return small_reports.row(case=f"top[{index}]", outcome=outcome, metrics=metrics)


def shown(rows) -> str:
    console = Console(width=120, record=True, file=StringIO())
    console.print(worst(Report(SCHEMA, {"name": "many"}, {}, []), rows, "hint"))
    return console.export_text()


def test_many_rows_are_summed_up_with_the_worst_of_each_metric() -> None:
    rows = [row(i, "1e-14", -14.0) for i in range(300)]
    rows[250] = row(250, "3e-9", -8.5)
    rows[7] = row(7, "unresolved", None)
    rows[8] = row(8, "1", 0.0, "step_limit")
    text = shown(iter(rows))
    assert "300 measurements" in text
    assert "drift in double: 1 step_limit, 299 success" in text
    assert "top[8]" in text
    assert "1 unresolved" in text
    assert "count" not in text
    assert len(text.splitlines()) < 12
    rows[9] = row(9, "nan", None)
    again = shown(iter(rows))
    assert "top[9]" in again
    assert "1 nan" in again
