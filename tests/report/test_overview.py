"""What a run of very many rows prints."""

from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from heavytop.cli.reports import show
from heavytop.errors import InputError
from heavytop.records import SCHEMA, Metric, Report, Row
from heavytop.report import store
from heavytop.report.overview import MOST_ROWS, overview


def row(index: int, value: str, log10: float | None, outcome: str = "success") -> Row:
    metrics = {"drift_energy_max": Metric(value, log10), "count": Metric("7", 0.845098, "value")}
    return Row(f"top[{index}]", "heavy_top", "heyoka", "double", 53, outcome, "1", "1", 3, True, metrics, "drift")


def shown(rows) -> str:
    console = Console(width=120, record=True, file=StringIO())
    console.print(overview(Report(SCHEMA, {"name": "many"}, {}, []), rows))
    return console.export_text()


def test_many_rows_are_summed_up_with_the_worst_of_each_metric() -> None:
    rows = [row(i, "1e-14", -14.0) for i in range(MOST_ROWS + 100)]
    rows[250] = row(250, "3e-9", -8.5)
    rows[7] = row(7, "unresolved", None)
    rows[8] = row(8, "1", 0.0, "step_limit")
    text = shown(iter(rows))
    assert f"{MOST_ROWS + 100} measurements" in text
    assert f"drift in double: 1 step_limit, {MOST_ROWS + 99} success" in text
    assert "top[8]" in text
    assert "1 unresolved" in text
    assert "count" not in text
    assert len(text.splitlines()) < 12
    rows[9] = row(9, "nan", None)
    worst = shown(iter(rows))
    assert "top[9]" in worst
    assert "1 nan" in worst


def test_a_report_of_very_many_rows_is_shown_by_its_worst(tmp_path: Path, monkeypatch, capsys) -> None:
    store.write(Report(SCHEMA, {"name": "many"}, {}, []), tmp_path, (row(i, "1e-14", -14.0) for i in range(30)))
    for most, count in ((30, 30), (29, 1)):
        monkeypatch.setattr("heavytop.report.overview.MOST_LISTED", most)
        assert show(tmp_path) == 0
        text = capsys.readouterr().out
        assert "30 measurements" in text
        assert text.count("top[") == count
    assert "--parquet" in text
    broken = (tmp_path / "report.json").read_text().replace('"top[7]"', '"top[8]"')
    (tmp_path / "report.json").write_text(broken)
    (tmp_path / "report.json.sha256").unlink()
    with pytest.raises(InputError, match="twice"):
        show(tmp_path)


def test_few_rows_are_listed() -> None:
    assert "top[3]" in shown(row(i, "1e-14", -14.0) for i in range(5))
