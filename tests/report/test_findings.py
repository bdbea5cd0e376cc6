"""The sentences that open a comparison: what is wrong, the most telling first."""

import pytest

from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import Against, Explained, Law, Metric, Row, Subject
from heavytop.report.compare.findings import MOST
from heavytop.report.compare.noise import Policy, Rule
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.render.history import cells
from support.report_helpers import error
from support.reports import compare, history, replace
from support.small_reports import report, row

DIGITS = "solution_error_relative_max"


def rk5(**changes: object) -> Row:
    return row(integrator="mine:rk5", **changes)


def step(**changes: object) -> Row:
    order = of_fraction(exact(changes.pop("seen", "5")), "value")
    return rk5(measure="local_error", metrics={"local_error_ulp_max": error("3"), "observed_order": order}, order=5)


def found(old: list[Row], new: list[Row]) -> list[str]:
    return compare(report(*old), report(*new), Policy()).sentences


def test_an_order_leads_then_failures_digits_laws_and_that_nothing_else_changed() -> None:
    healthy = [
        step(),
        rk5(case="lagrange", metrics={DIGITS: error("1.2e-9")}),
        rk5(case="pendulum", metrics={DIGITS: error("1e-9")}),
        rk5(case="delone"),
        rk5(case="grioli", measure="growth", metrics={}, laws={"solution_error_along": Law("t^0.5", 9, 0.5, 0.4, 0.6)}),
    ]
    faulty = [
        step(seen="2"),
        replace(healthy[1], metrics={DIGITS: error("3e-8")}),
        replace(healthy[2], metrics={DIGITS: error("5e-9")}),
        replace(healthy[3], outcome="failed", metrics={}, reference=Against("none", reason="it returned NaN")),
        replace(healthy[4], laws={"solution_error_along": Law("t", 9, 1.0, 0.9, 1.1)}),
    ]
    said = found(healthy, faulty)
    assert said[0] == "Order observed 5 → 2 in single steps on euler (mine:rk5, double)."
    assert said[1] == "1 row of mine:rk5 failed on delone up to T = 100 (mine:rk5, double): it returned NaN."
    assert said[2] == "Digits right 8.9 → 7.5 on lagrange up to T = 100 (mine:rk5, double), fewer on 1 other row too."
    assert said[3].startswith("The error along the flow grows like t (was t^0.5) on grioli")
    assert said[-1] == "No other row changed."
    assert len(said) == 5


def work(steps: int, size: str, drift: str = "", **changes: object) -> Row:
    subject = Subject("computed", "mine:rk5", step=f"1/{steps}")
    metrics = {"error_max": error(size)} | ({"drift_energy_max": error(drift)} if drift else {})
    made = rk5(case="euler/T=100", measure="work_precision", metrics=metrics, steps=steps, **changes)
    return replace(made, key=replace(made.key, subject=subject))


@pytest.mark.parametrize(
    ("errors", "said"),
    [
        (("1e-4", "1e-8", "1e-9"), "Order observed 4.0 → 1.0 on euler from 100 to 1000 steps"),
        (("1e-4", "1e-6", "1e-8"), "Order observed 4.0 → 2.0 on euler from 10 to 100 steps"),
        (("1e-4", "1e-7", "1e-7"), "Order observed 4.0 → 0.0 on euler from 100 to 1000 steps"),
    ],
)
def test_the_order_of_refined_settings_shows_where_it_falls(errors: tuple[str, ...], said: str) -> None:
    counts = (10, 100, 1000)
    healthy = [work(n, f"1e-{4 * i}") for i, n in enumerate(counts, 1)]
    faulty = [work(n, size) for n, size in zip(counts, errors, strict=True)]
    first = found(healthy, faulty)[0]
    assert first.startswith(said)
    assert first.endswith("(mine:rk5, double).")
    assert found(healthy, healthy)[0].startswith("Nothing changed")


def test_a_limit_alone_is_named_and_is_no_loss_of_order() -> None:
    rows = [work(n, f"1e-{4 * i}", drift=f"1e-{4 * i}") for i, n in enumerate((10, 100, 1000), 1)]
    policy = Policy(rule=(Rule(metric="drift_*", limit="1e-9"),))
    said = compare(report(*rows), report(*rows), policy).sentences
    assert said[0].startswith("Drift of the energy 1e-4 → 1e-4 on euler up to T = 100 (mine:rk5, step 1/10, double)")
    assert said[0].endswith(", above its limit; also on 1 other row.")


def test_a_row_that_no_sentence_names_is_no_other_row() -> None:
    old = rk5(metrics={DIGITS: error("1e-9"), "drift_energy_max": error("1e-9")})
    new = replace(old, metrics={**old.metrics, "drift_area_max": error("1e-9")})
    assert found([old], [new]) == ["1 row changed, euler up to T = 100 (mine:rk5, double): drift_area_max - → 1e-9."]
    lost = "Drift of M·γ 1e-9 → - on euler up to T = 100 (mine:rk5, double), the metric is missing."
    assert found([new], [old]) == [lost, "No other row changed."]
    unseen = replace(step(), metrics={"local_error_ulp_max": error("3")})
    lost = "Observed order 5 → - on euler up to T = 100 (mine:rk5, double), the errors no longer show an order: "
    assert found([step()], [unseen])[0].startswith(lost)
    near = replace(old, metrics={**old.metrics, DIGITS: error("1.1e-9")}, steps=9)
    assert found([old], [near]) == ["No metric of 2 changed beyond its limit; steps changed by up to 10%."]
    old, new = (replace(old, metrics={"drift_spin3_max": metric}) for metric in (Metric("0", None), error("1e-9")))
    assert found([old], [new])[0] == "Drift of Ω3 0 → 1e-9 on euler up to T = 100 (mine:rk5, double)."


def test_rows_of_two_versions_are_one_row_and_both_versions_are_said() -> None:
    plain = {"3.3": [work(10, "1e-4"), work(100, "1e-8")], "4.0": [work(10, "1e-4"), work(100, "1e-6")]}
    old, new = ([replace(row, key=row.key.of_version(v)) for row in rows] for v, rows in plain.items())
    assert "(mine:rk5 3.3 → 4.0, double)" in found(old, new)[0]
    assert "on euler up to T = 100 (mine:rk5 3.3 → 4.0, step 1/100, double)" in found(old, new)[1]
    assert found(old, plain["4.0"]) == found(plain["3.3"], plain["4.0"])
    over = history([report(*old), report(*new)], Policy())
    assert {track.row.versions for track in over} == {("3.3", "4.0")}
    assert len(over) == len(old)
    assert "mine:rk5 double 3.3 → 4.0" in cells(over[0])[0]
    findings = compare(report(*old), report(*new), Policy()).to_json()["rows"]
    assert {each["versions"] for each in findings} == {("3.3", "4.0")}


def test_other_steps_at_the_same_setting_are_said() -> None:
    old, new = rk5(metrics={DIGITS: error("1e-9")}, steps=1000), rk5(metrics={DIGITS: error("1e-8")}, steps=700)
    assert "Steps 1000 → 700 at the same setting on euler up to T = 100 (mine:rk5, double)." in found([old], [new])
    assert not any("Steps" in each for each in found([old], [replace(new, steps=1010)]))
    said = found([old], [replace(new, flags={"step": "0.01"})])
    assert "Steps 1000 → 700 on euler up to T = 100 (mine:rk5, double)." in said


def test_there_are_never_more_than_eight_and_the_rest_is_counted() -> None:
    cases = [f"case-{i}" for i in range(40)]
    old = [row(case=case, integrator=f"mine:{case}", metrics={DIGITS: error("1e-9")}) for case in cases]
    new = [replace(each, metrics={DIGITS: error("1e-5")}) for each in old]
    said = found(old, new)
    assert len(said) == MOST
    assert said[-1] == f"{40 - (MOST - 1)} other rows changed."


@pytest.mark.parametrize(
    ("last", "drift", "between"), [("1e-12", "1e-6", True), ("1e-7", "1e-6", False), ("1e-12", "1e-12", False)]
)
def test_a_last_state_that_is_as_it_was_points_to_the_dense_output(last: str, drift: str, between: bool) -> None:
    names = (DIGITS, "solution_error_omega_final", "drift_energy_max")
    old = rk5(metrics={name: error("1e-12") for name in names})
    new = replace(old, metrics=dict(zip(names, map(error, ("1e-6", last, drift)), strict=True)))
    assert ("as where dense output is wrong" in found([old], [new])[0]) is between
    given = [
        replace(each, key=replace(each.key, subject=replace(each.key.subject, what="given"))) for each in (old, new)
    ]
    assert "between steps" not in str(found(given[:1], given[1:]))  # a file says nothing of steps


def failing(row: Row, outcome: str = "failed", reason: str = "it returned NaN") -> Row:
    return replace(row, outcome=outcome, time_reached="0", metrics={}, reference=Against("none", reason=reason))


def test_rows_that_failed_are_counted_with_the_first_and_its_reason() -> None:
    old = [rk5(case=case) for case in ("euler", "lagrange", "grioli")]
    new = [old[0], failing(old[1], "out_of_time", "not done within 40 s"), failing(old[2], "out_of_time", "later")]
    assert found(old, new) == [
        "2 rows of mine:rk5 failed, first on lagrange up to T = 100 (mine:rk5, double): "
        "out_of_time, not done within 40 s.",
        "No other row changed.",
    ]
    assert found(new, old)[0].startswith("2 rows of mine:rk5 are better, first on lagrange")


def test_a_row_that_failed_in_both_reports_is_the_same_and_said() -> None:
    pair = [rk5(), failing(rk5(case="delone"))]
    said = "1 row of mine:rk5 failed in both reports on delone up to T = 100 (mine:rk5, double): it returned NaN."
    assert found(pair, pair) == ["Nothing changed: 2 metrics are within the limits.", said]
    none = "1 row of mine:rk5 cannot be compared: no row of mine:rk5 has a number."
    assert found(pair[1:], pair[1:])[:2] == [none, said]
    stopped = report(rk5(outcome="step_limit", time_reached="80", metrics={}))
    assert compare(stopped, stopped, Policy(), list_same=False).tally == {Verdict.INCOMPARABLE: 1}
    worse = [replace(pair[0], metrics={"drift_energy_max": error("1")}), pair[1]]
    assert said in found(pair, worse)


def test_a_run_that_stops_earlier_says_where() -> None:
    old = rk5(outcome="step_limit", time_reached="80", finite=False)
    new = replace(old, time_reached="40")
    said = "1 row of mine:rk5 stops earlier on euler up to T = 100 (mine:rk5, double): step_limit, at t = 40 of 100."
    assert found([old], [new])[0] == said


@pytest.mark.parametrize(
    ("errors", "coarser"),
    [
        (("1e-4", "1e-7", "1e-7"), "coarser settings are the same: "),
        (("1e-4", "2e-6", "1e-7"), "coarser settings lost less: "),
        (("1e-4", "1e-5", "1e-7"), ""),
    ],
)
def test_an_error_that_the_finest_setting_shows_most_is_of_lower_order(errors: tuple[str, ...], coarser: str) -> None:
    counts = (10, 100, 1000)
    healthy = [work(n, f"1e-{3 * i + 1}", drift=f"1e-{3 * i + 1}") for i, n in enumerate(counts, 1)]
    faulty = [
        replace(each, metrics={**each.metrics, "drift_energy_max": error(size)})
        for each, size in zip(healthy, errors, strict=True)
    ]
    said = next(each for each in found(healthy, faulty) if each.startswith("Drift of the energy"))
    assert (f"{coarser}the new error is of lower order than the method" in said) is bool(coarser)
    assert ("of lower order" in said) is bool(coarser)


def test_what_explains_the_states_comes_first_and_counts_its_rows() -> None:
    late, other = Explained("start_row_missing", "The states are one row late."), Explained("weight", "Another weight.")
    healthy = [rk5(case=case, metrics={DIGITS: error("1e-9")}) for case in ("euler", "lagrange", "grioli")]
    faulty = [
        replace(each, metrics={DIGITS: error("0.5")}, explained=what)
        for each, what in zip(healthy, (other, late, late), strict=True)
    ]
    first = found(healthy, faulty)[0]
    assert first == "The states are one row late. Seen on lagrange up to T = 100 (mine:rk5, double) and 1 other row."
    long = [replace(each, explained=Explained("start", "x" * 5000)) for each in faulty]
    assert len(found(healthy, long)[0]) <= 300
    assert not any("late" in each for each in found(faulty, [replace(faulty[0], metrics={}), *faulty[1:]]))


def test_heyoka_beside_a_third_party_integrator_is_a_scale_and_no_verdict() -> None:
    law = Law("t^0.5", 9, 0.5, 0.4, 0.6)
    scale, mine = row(case="lagrange", laws={"drift_area": law}), rk5(case="lagrange")
    steeper = replace(law, growth="t", exponent=1.0, low=0.9, high=1.1)
    worse = replace(scale, metrics={**scale.metrics, "drift_energy_max": error("1e-3")}, laws={"drift_area": steeper})
    for new in (worse, failing(scale), rk5(case="euler")):
        result = compare(report(scale, mine), report(new, mine), Policy())
        assert (result.exit_code, [each.verdict for each in result.changed if each.row.key == scale.key]) == (0, [])
        assert result.sentences[0].startswith(("Nothing changed", "No metric of")) == (new.case == "lagrange")
        assert new is not worse or "growth drift_area" in {finding.metric for finding in result.findings}
        assert result.sentences[-1].startswith(
            "heyoka, measured for scale but not judged, changed in 1 row on lagrange"
        )
    assert compare(report(scale), report(worse), Policy()).exit_code == 1
    # a candidate cannot excuse itself: the baseline says what is beside what
    assert compare(report(scale), report(worse, mine), Policy()).exit_code == 1
