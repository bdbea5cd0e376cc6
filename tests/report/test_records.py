"""Records are values: nothing changes one, and equality and order of metrics agree."""

from __future__ import annotations

import gzip
import pickle
from fractions import Fraction
from itertools import product
from operator import ge, gt, le, lt
from pathlib import Path
from random import Random

import msgspec
import pytest

import heavytop as ht
from heavytop.records import Against, Law, Metric, Row, RowKey, Series, Subject, of_row
from support.small_reports import row

METRICS = [
    Metric("1e-997", -997.0),
    Metric("1e-996", -996.0),
    Metric("0", None),
    Metric("2.5", 0.4),
    Metric("2.5", 0.4, band=0.5),
    Metric("never", None, "duration"),
    Metric("missing", None),
    Metric("unresolved", None, bound="1e-20"),
]


@pytest.mark.parametrize("record", [METRICS[0], Series(["1"], ["2"]), Law("t", 3), row()])
def test_no_field_of_a_record_can_be_set(record: object) -> None:
    for name in record.__struct_fields__:
        with pytest.raises(AttributeError):
            setattr(record, name, getattr(record, name))


@pytest.mark.parametrize("precision", [{}, {"precision": "double"}])
def test_a_key_that_a_worker_sent_is_written_alike(precision: dict[str, str]) -> None:
    """The same bytes from one process and from several."""
    key = RowKey("audit", "c", "heavy_top", Subject("claimed", "x"), **precision)
    assert msgspec.json.encode(pickle.loads(pickle.dumps(key))) == msgspec.json.encode(key)


@pytest.mark.parametrize(("a", "b"), list(product(METRICS, METRICS)))
def test_equality_and_order_of_metrics_agree(a: Metric, b: Metric) -> None:
    assert (a == b) + (a < b) + (a > b) == 1
    assert (a < b) == (b > a)
    assert (a <= b) == (b >= a) == (a < b or a == b)
    assert a != b or hash(a) == hash(b)


@pytest.mark.parametrize("order", range(4))
def test_metrics_have_one_order_however_they_came(order: int) -> None:
    found = list(METRICS)
    Random(order).shuffle(found)
    assert sorted(found) == sorted(METRICS)
    assert sorted(found)[-1].value == "missing"


@pytest.mark.parametrize("number", [0, 2.5, Fraction(5, 2), 3, float("inf"), float("nan")])
@pytest.mark.parametrize("metric", METRICS)
def test_a_metric_compares_with_a_number_as_its_value_does(metric: Metric, number: float) -> None:
    assert (metric == number) == (metric.number == number)
    assert metric != number or hash(metric) == hash(number)
    for compares in (lt, le, gt, ge):
        assert compares(metric, number) == compares(metric.number, number)


def test_the_size_of_what_is_unresolved_is_that_of_its_bound() -> None:
    assert [metric.size for metric in METRICS] == [-997.0, -996.0, None, 0.4, 0.4, None, None, -20.0]


def test_a_report_is_a_value_too(tmp_path: Path) -> None:
    """Comparing it, and every document of it, leave each of its rows as it was."""
    report = ht.read_report(Path(__file__).parents[2] / "results/claims")
    before = msgspec.json.encode(report)
    report.to_html()
    report.to_markdown()
    report.export("asv")
    ht.compare(report, report).to_html()
    assert msgspec.json.encode(report) == before
    with pytest.raises(AttributeError):
        report.rows = []  # type: ignore[misc]


@pytest.mark.parametrize("name", ["system", "precision", "horizon", "measure", "against"])
def test_what_follows_from_the_key_of_a_row_is_never_another(name: str) -> None:
    known = row()
    with pytest.raises(ValueError, match=f"{name} = 'another' is not what follows"):
        msgspec.structs.replace(known, **{name: "another"})
    assert msgspec.structs.replace(known, **{name: ""}) == known
    document = msgspec.to_builtins(known)
    assert msgspec.convert(document, Row) == known
    with pytest.raises(msgspec.ValidationError, match=name):
        msgspec.convert(document | {name: "another"}, Row)


def test_a_stored_row_is_written_as_it_was_read() -> None:
    lines = (Path(__file__).parents[2] / "results/default/report.json").read_bytes().split(b"\n")
    rows = [line.rstrip(b",") for line in lines if line.startswith(b'{"case"')]
    assert len(rows) > 10
    assert [msgspec.json.encode(msgspec.json.decode(each, type=Row)) for each in rows] == rows


def test_former_texts_of_a_row_are_read_as_those_of_now() -> None:
    lost = Against("computed", "words of 106 and 138 bits", "1e-13", until="700")
    now = msgspec.structs.replace(row(), reference=lost, against="", flags={"arithmetic": "integers"})
    former = msgspec.json.encode(now).replace(b"all significant digits are lost from", b"no digit is left from")
    former = former.replace(b'"integers"', b'"whole numbers"')
    assert former != msgspec.json.encode(now)
    assert of_row(msgspec.json.decode(former, type=Row)) == now


def test_errors_smaller_than_any_float_have_an_order() -> None:
    assert METRICS[2] < METRICS[0] < METRICS[1] < 1e-300
    assert min(METRICS[:4]) is METRICS[2]
    assert not METRICS[6] < 1
    assert not METRICS[6] > 1


def test_a_compressed_report_is_read_as_it_was_and_a_damaged_one_refused(tmp_path: Path) -> None:
    original = Path(__file__).parents[2] / "results" / "growth"
    for name in ("report.json", "report.json.sha256"):
        (tmp_path / name).write_bytes((original / name).read_bytes())
    content = (tmp_path / "report.json").read_bytes()
    (tmp_path / "report.json").unlink()
    packed = tmp_path / "report.json.gz"
    packed.write_bytes(gzip.compress(content))
    assert ht.read_report(tmp_path) == ht.read_report(packed) == ht.read_report(original)
    edited = gzip.compress(content.replace(b"gyrostat", b"gyrostax", 1))
    for damaged in (packed.read_bytes()[:-20], b"not gzip", edited):
        packed.write_bytes(damaged)
        with pytest.raises(ht.InputError, match=r"contains no report|its checksum differs"):
            ht.read_report(tmp_path)
