"""Rows carry the noise of their metrics, and a rerun with other roundings is the same within it."""

import pytest

from heavytop.errors import InputError
from heavytop.measure.scalar import UNRESOLVED, of_fraction
from heavytop.precision import decimal_text, exact
from heavytop.records import SCHEMA, Report, Row, Series
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.verdicts import Verdict
from support.reports import compare, contradictions, expand, measure, plan_of, replace

pytestmark = pytest.mark.slow

RUN, LONG = (
    {"precision": name, "horizon": end, "samples": 50} for name, end in (("double", "50"), ("extended", "150"))
)
ESCAPE = {"kind": "homoclinic", "cases": ["delone"], "precisions": ["double"], "directions": ["forward"]}
SHORT = {"kind": "drift", "cases": ["lagrange", "gyrostat"], "runs": [RUN]}
PLAN = plan_of({"name": "tiny", "measure": [ESCAPE, SHORT, {"kind": "drift", "cases": ["generic"], "runs": [LONG]}]})


@pytest.fixture(scope="module")
def reports() -> list[Report]:
    return [Report(SCHEMA, {"name": "tiny"}, {}, [measure(t) for t in expand(PLAN, seed)]) for seed in range(2)]


def test_every_error_and_break_away_has_a_band(reports: list[Report]) -> None:
    for row in reports[0].rows:
        for name, metric in row.metrics.items():
            assert metric.band is not None, (row.case, name)
            assert 0 <= metric.band < 3
        wide = [metric.band for name, metric in row.metrics.items() if name.endswith("_max")]
        assert max(band for band in wide if band is not None) > 0.05


def test_other_seeds_are_other_numbers_and_the_same_verdict(reports: list[Report]) -> None:
    one, other = reports
    assert compare(one, other, Policy()).verdict == "same"
    assert all(a.metrics != b.metrics for a, b in zip(one.rows, other.rows, strict=True))


def test_the_same_seed_is_the_same_row(reports: list[Report]) -> None:
    again = measure(expand(PLAN, 1)[-1])
    assert again.metrics == reports[1].rows[-1].metrics


STEPS = {"kind": "local_error", "cases": ["euler"], "precisions": ["double"], "horizon": "3"}
FORMULAS = {"kind": "claim_evaluation", "cases": ["ershkov-partial-2"], "precisions": ["double"]}
CURVE = {"kind": "work_precision", "cases": ["euler"], "horizon": "100", "samples": 4}
LADDERS = [{"integrator": "heyoka", "tolerances": ["1e-8", "eps"]}]
UNBANDED = plan_of(
    {
        "name": "unbanded",
        "measure": [STEPS, FORMULAS | {"rate_times": ["1", "8", "40"]}, CURVE | {"ladders": LADDERS}],
    }
)


def test_rows_without_a_band_are_the_same_with_other_roundings_too() -> None:
    made = [Report(SCHEMA, {"name": "unbanded"}, {}, [measure(t) for t in expand(UNBANDED, s)]) for s in range(2)]
    assert all(metric.band is None for row in made[0].rows for metric in row.metrics.values())
    assert compare(*made, Policy()).verdict == "same"
    for one, two in zip(*(report.rows for report in made), strict=True):
        # the formulas of a claim are evaluated from its own data: no rounding of theirs changes
        assert (one.metrics == two.metrics) == (one.measure == "claim_evaluation")


def planted(row: Row, factor: int) -> Row:
    """All errors of a row ``factor`` times as large: those of its metrics, and those that its series hold."""
    metrics = {
        name: replace(of_fraction(exact(m.value) * factor), band=m.band)
        if m.kind == "error" and m.log10 is not None
        else m
        for name, m in row.metrics.items()
    }
    series = {
        name: Series(each.times, [decimal_text(exact(v) * factor, 8) if v != UNRESOLVED else v for v in each.values])
        for name, each in row.series.items()
    }
    made = replace(row, metrics=metrics, series=series)
    assert not list(contradictions(made))
    return made


def test_errors_a_thousand_times_larger_are_worse_in_every_row(reports: list[Report]) -> None:
    one, other = reports
    bad = replace(other, rows=[planted(row, 1000) for row in other.rows])
    result = compare(one, bad, Policy())
    worse = {finding.row for finding in result.findings if finding.verdict is Verdict.WORSE}
    assert worse == {row.identity for row in other.rows}


@pytest.mark.parametrize("seed", [-1, 1001])
def test_a_seed_out_of_range_is_refused(seed: int) -> None:
    with pytest.raises(InputError, match=f"seed must be from 0 to .*; got {seed}"):
        expand(PLAN, seed)
