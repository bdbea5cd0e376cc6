"""Rows of drift with ``noise = false``: the same values without bands, and what comparisons make of them."""

import json
import math
import shutil
from pathlib import Path

import pytest

import heavytop as ht
from support.reports import drift, plan_file, table

SWEEP = table("sweep", kind="random", name="many", count=3, seed=5)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("noise")
    for noise in (True, False):
        plan = plan_file(folder, SWEEP + drift("sweep:many", runs=[("double", "10", 10)], noise=noise))
        ht.run(plan, out=folder / str(noise).lower(), workers=1)
    return folder


def changed(folder: Path, out: Path, factor: float = 1.0, value: str = "") -> Path:
    """The report without noise with every error of its first row multiplied, or given a value."""
    shutil.copytree(folder / "false", out)
    document = json.loads((out / "report.json").read_text("utf-8"))
    row = document["rows"][0]
    for metric in row["metrics"].values():
        if metric["kind"] == "error" and float(metric["value"]):
            size = float(metric["value"]) * factor
            metric["value"] = value or f"{size:.8E}"
            found = float(metric["value"])
            metric["log10"] = math.log10(found) if math.isfinite(found) else None
    for series in row["series"].values():
        series["values"] = [value or f"{float(each) * factor:.8E}" for each in series["values"]]
    (out / "report.json").write_text(json.dumps(document), "utf-8")
    (out / "report.json.sha256").unlink()
    return out


@pytest.mark.slow
def test_values_are_the_same_and_there_are_no_bands(made: Path) -> None:
    with_noise, without = (ht.read_report(made / noise).rows for noise in ("true", "false"))
    assert len(without) == 3
    for one, other in zip(with_noise, without, strict=True):
        assert {name: m.value for name, m in one.metrics.items()} == {
            name: m.value for name, m in other.metrics.items()
        }
        assert any(m.band for m in one.metrics.values())
        assert all(m.band is None for m in other.metrics.values())
        assert other.flags == one.flags | {"noise": "not measured"}


@pytest.mark.slow
def test_what_rounding_explains_is_the_same_and_what_it_does_not_is_worse(made: Path, tmp_path: Path) -> None:
    baseline = made / "false"
    assert ht.compare(baseline, baseline).verdict == "same"
    verdicts = {
        factor: ht.compare(baseline, changed(made, tmp_path / f"x{i}", factor=factor)).verdict
        for i, factor in enumerate((8.0, 0.1, 1e6))
    }
    assert verdicts == {8.0: "same", 0.1: "same", 1e6: "worse"}


@pytest.mark.slow
def test_what_is_beyond_rounding_is_worse(made: Path, tmp_path: Path) -> None:
    assert ht.compare(made / "false", changed(made, tmp_path / "x", value="0.25")).verdict == "worse"


def test_a_row_with_bands_is_not_compared_with_one_without(made: Path) -> None:
    assert ht.compare(made / "true", made / "false").verdict == "incomparable"
    assert ht.compare(made / "false", made / "true").verdict == "incomparable"
