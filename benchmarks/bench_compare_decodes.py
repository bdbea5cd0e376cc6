"""How long does a comparison take in units of decoding both reports, which it cannot undercut?

Run: python -m pytest benchmarks/bench_compare_decodes.py --benchmark-enable
Rows of results/ under other names: of drift and of growth as they are, and of drift with four metrics and no series.
rerun: the candidate differs in its seconds alone.  noise: every error of it is another.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from random import Random
from time import process_time

import msgspec
import pytest
from msgspec.structs import replace

from heavytop.features.kinds import KINDS
from heavytop.records import Metric, Report, Row, Series
from heavytop.report.compare.compare import compare
from heavytop.report.compare.noise import Policy
from heavytop.report.store import store

RESULTS = Path(__file__).parents[1] / "results"
FEW = ("drift_energy_max", "drift_energy_rms", "solution_error_relative_max", "solution_error_relative_final")
SHAPES = {"drift": ("default", 1500), "few": ("default", 6000), "growth": ("growth", 300)}


def rows_of(shape: str) -> tuple[Report, Iterator[Row]]:
    plan, count = SHAPES[shape]
    report = store.read(RESULTS / plan, KINDS)
    kind = "growth" if shape == "growth" else "drift"
    rows = [row for row in report.rows if row.key.kind == kind and row.outcome == "success"]
    if shape == "few":
        rows = [replace(row, metrics={k: m for k, m in row.metrics.items() if k in FEW}, series={}) for row in rows]
    names = ((rows[i % len(rows)], f"-{i // len(rows)}") for i in range(count))
    renamed = (replace(row, case=row.case + end, key=replace(row.key, case=row.key.case + end)) for row, end in names)
    return report, renamed


def scaled(text: str, factor: float) -> str:
    try:
        return f"{float(text) * factor:.7E}"
    except ValueError:
        return text


def metric(old: Metric, factor: float) -> Metric:
    if old.kind != "error" or old.log10 is None or abs(old.log10) > 300:
        return old
    value = scaled(old.value, factor)
    return replace(old, value=value, log10=round(math.log10(float(value)), 6))


def candidate(rows: Iterator[Row], noise: bool) -> Iterator[Row]:
    random = Random(1)
    for row in rows:
        factor = random.uniform(0.9, 1.1)
        timed = replace(row, seconds={name: seconds * factor for name, seconds in row.seconds.items()})
        if noise:
            series = {
                k: Series(s.times, [scaled(v, factor) for v in s.values], s.quantity) for k, s in row.series.items()
            }
            timed = replace(timed, metrics={k: metric(m, factor) for k, m in row.metrics.items()}, series=series)
        yield timed


@pytest.mark.parametrize("what", ["rerun", "noise"])
@pytest.mark.parametrize("shape", SHAPES)
def test_compare(benchmark, tmp_path: Path, shape: str, what: str) -> None:
    report, rows = rows_of(shape)
    for name in ("old", "new"):
        (tmp_path / name).mkdir()
    store.write(report, tmp_path / "old", rows)
    store.write(report, tmp_path / "new", candidate(rows_of(shape)[1], what == "noise"))
    texts = [(tmp_path / name / store.FILE).read_bytes() for name in ("old", "new")]
    begin = process_time()
    for text in texts:
        msgspec.json.decode(text, type=Report)
    decoding = process_time() - begin

    def judge() -> str:
        old, new = (store.read_brief(tmp_path / name, KINDS) for name in ("old", "new"))
        return compare(old, new, Policy(), KINDS, list_same=False).verdict

    begin = process_time()
    verdict = benchmark.pedantic(judge, rounds=1)
    benchmark.extra_info["decodes"] = round((process_time() - begin) / decoding, 2)
    benchmark.extra_info["microseconds_a_row"] = round(1e6 * (process_time() - begin) / SHAPES[shape][1])
    assert verdict == "same"
