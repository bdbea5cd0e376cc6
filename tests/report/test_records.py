"""Records are values: nothing changes one, and equality and order of metrics agree."""

from __future__ import annotations

from itertools import product

import pytest

from heavytop.records import Law, Metric, Quantity, Series, by_name
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


@pytest.mark.parametrize(("a", "b"), list(product(METRICS, METRICS)))
def test_equality_and_order_of_metrics_agree(a: Metric, b: Metric) -> None:
    if a == b:
        assert a <= b
        assert a >= b
    assert (a == b) + (a < b) + (a > b) <= 1
    assert (a < b) == (b > a)
    assert (a <= b) == (b >= a)


def test_errors_smaller_than_any_float_have_an_order() -> None:
    assert METRICS[2] < METRICS[0] < METRICS[1] < 1e-300
    assert min(METRICS[:4]) is METRICS[2]
    assert not METRICS[6] < 1
    assert not METRICS[6] > 1


def test_metrics_under_their_names_are_others_than_those_given() -> None:
    quantity, given = Quantity("drift", "energy", "max"), METRICS[0]
    named = by_name({quantity: given})
    assert named["drift_energy_max"].quantity == quantity
    assert given.quantity is None
