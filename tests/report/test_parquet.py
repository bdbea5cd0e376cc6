"""Rows as Parquet: every line is there, as pandas and duckdb read it; written whole or not at all."""

import sys
import tracemalloc
from pathlib import Path

import pytest

from heavytop.errors import InputError
from heavytop.records import Data, Law, Metric
from heavytop.report.store import parquet
from heavytop.report.store.parquet import COLUMNS, check_name, write
from support.small_reports import row

pytest.importorskip("pyarrow")
PLAN = {"name": "p", "sha256": "0" * 64}
REAL = {"precision": "real:3400", "bits": 3400}
TOP = Data(("3", "2", "1"), "1e-400", ("0", "0", "1/3"), ("1/10", "0", "1e400"), ("0", "0", "-1"))
METRICS = {
    "drift_energy_max": Metric("1.25E-997", -996.90309, band=0.25),
    "solution_error_max": Metric("unresolved", None, bound="1E-1000"),
    "solution_parts_at": Metric("never", None, "duration"),
}
LAWS = {"energy": Law("t^0.5", 63, 0.497, 0.46, 0.53, "1", "1000", "1e-19", None)}
ROWS = [
    row(**REAL, metrics=METRICS),
    row(**REAL, measure="growth", starts=64, metrics={}, laws=LAWS),
    row(**REAL, case="top", data=TOP, metrics={}),
    row(**REAL, case="generic", outcome="time_limit", time_reached="3", finite=False, metrics={}),
]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "rows.parquet"
    write(path, iter(ROWS), PLAN)
    assert [each.name for each in tmp_path.iterdir()] == ["rows.parquet"]
    return path


def test_pandas_reads_values_as_text_and_logarithms_as_numbers(file: Path) -> None:
    import pandas

    table = pandas.read_parquet(file)
    assert list(table.columns) == list(COLUMNS)
    assert len(table) == 6
    tiny = table.iloc[0]
    assert (tiny["value"], tiny["log10"], tiny["band"]) == ("1.25E-997", -996.90309, 0.25)
    assert table["log10"].dtype == "float64"
    assert table["log10"].isna().tolist() == [False, True, True, True, True, True]
    assert table["bits"].tolist() == [3400] * 6
    assert table["bound"][1] == "1E-1000"
    assert table["metric"].isna().tolist() == [False] * 4 + [True, True]


@pytest.mark.slow
def test_duckdb_reads_laws_and_rows_without_any_number(file: Path) -> None:
    import duckdb

    with duckdb.connect() as base:
        law = base.sql(
            f"select metric, value, starts, exponent, low, high, first, last, detects, lost_at from '{file}' "
            "where kind = 'law'"
        ).fetchall()
        assert law == [("energy", "t^0.5", 63, 0.497, 0.46, 0.53, "1", "1000", "1e-19", None)]
        stopped = base.sql(f"select \"case\", time_reached, value from '{file}' where not finite").fetchall()
        assert stopped == [("generic", "3", None)]
        worst = base.sql(f"select max(log10) from '{file}' where kind = 'error'").fetchall()
        assert worst == [(-996.90309,)]


def test_the_plan_is_in_the_metadata_and_the_bytes_are_the_same_twice(file: Path, tmp_path: Path) -> None:
    from pyarrow.parquet import ParquetFile

    with ParquetFile(file) as whole:
        assert whole.schema_arrow.metadata[b"heavytop.plan.name"] == b"p"
        assert whole.schema_arrow.metadata[b"heavytop.schema"] == b"heavytop-report/2"
    write(tmp_path / "again.parquet", ROWS, PLAN)
    assert (tmp_path / "again.parquet").read_bytes() == file.read_bytes()


@pytest.mark.slow
def test_rows_stream_through_in_row_groups(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parquet, "_GROUP", 600)
    from pyarrow.parquet import ParquetFile

    def peak(count: int) -> int:
        tracemalloc.start()
        try:
            write(tmp_path / "many.parquet", (ROWS[0] for _ in range(count)), PLAN)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(1000)
    few = peak(1000)
    assert peak(6000) < 1.1 * few
    with ParquetFile(tmp_path / "many.parquet") as whole:
        assert whole.metadata.num_rows == 18_000
        assert whole.metadata.num_row_groups == 30


def test_a_failure_half_way_leaves_the_old_file_and_nothing_else(file: Path) -> None:
    before = file.read_bytes()

    def broken():
        yield ROWS[0]
        raise InputError("no more")

    with pytest.raises(InputError, match="no more"):
        write(file, broken(), PLAN)
    assert file.read_bytes() == before
    assert [each.name for each in file.parent.iterdir()] == ["rows.parquet"]
    for nowhere in (file.parent / "nowhere", file):
        with pytest.raises(InputError, match="cannot be written"):
            write(nowhere / "rows.parquet", ROWS, PLAN)


def test_without_pyarrow_and_under_another_name_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"report\.json is not named as Parquet"):
        check_name(Path("report.json"))
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"heavytop\[parquet\]"):
        check_name(Path("rows.parquet"))


def test_the_top_and_the_start_stand_beside_every_number(file: Path) -> None:
    import pandas

    table = pandas.read_parquet(file)
    (top,) = table[table.case == "top"].to_dict("records")
    assert [top[f"inertia{i}"] for i in (1, 2, 3)] == [3.0, 2.0, 1.0]
    assert [top[name] for name in ("weight", "centre3", "omega1", "gamma3")] == [0.0, 1 / 3, 0.1, -1]
    assert top["omega3"] == float("inf")
    assert (top["weight_exact"], top["centre_exact"], top["omega_exact"]) == ("1e-400", "0,0,1/3", "1/10,0,1e400")
    assert table[table.case == "euler"][["inertia1", "gamma_exact"]].isna().all(axis=None)
    vectors = ("inertia", "centre", "omega", "gamma")
    assert len([name for name in COLUMNS if name[:-1] in vectors or name == "weight"]) == 13
