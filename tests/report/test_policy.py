"""Policies: rules by pattern, first match counts, and what is wrong with one is said."""

from pathlib import Path
from typing import Any

import pytest

from heavytop.errors import InputError
from heavytop.records import Law, Row
from heavytop.report.compare.noise import Policy, adjusted, load
from support.reports import compare, replace
from support.small_reports import error, judged, report, row, verdicts


def policy(tmp_path: Path, text: str) -> Policy:
    file = tmp_path / "policy.toml"
    file.write_text(text)
    return load(file)


def drift(value: str, band: float | None = None, **changes) -> Row:
    metric = replace(error(value), band=band)
    return row(metrics={"drift_energy_max": metric}, **changes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("colour = 3", "unknown field `colour`"),
        ("[[rule]]\nmetrik = 'x'", "unknown field `metrik`"),
        ("floor = -1", "floor must not be negative; got -1"),
        ("noise = 'much'", "is not a finite number"),
        ("duration = 5", "duration must be at most 1; got 5"),
        ("loss_bits = 1\nloss_digits = 1", "loss_bits and loss_digits were given"),
        ("flags = 'sometimes'", "flags must be incomparable or ignore; got 'sometimes'"),
        ("[timings]\ncompare = 'no'", "timings.compare must be never, same-machine or always; got 'no'"),
        ("[timings]\nratio = 0.5", "must be at least 1"),
        ("[timings]\nratio = inf", "must be at least 1"),
        ("[[rule]]\nmetric = ''", "must be a glob"),
        ("[[rule]]\nmetric = 'drift_[ab'", "must be a glob"),
        ("[[rule]]\nmetric = 'seconds *'\nlimit = 1", "limit was given for seconds"),
        ("[[rule]]\nlimit = '-1e-9'", "limit must not be negative; got -1e-9"),
        ("loss_bits = '1e400'", "too large"),
        ("floor = ", "not valid"),
    ],
)
def test_a_wrong_policy_is_refused_with_the_reason(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=r"policy\.toml is not valid") as caught:
        policy(tmp_path, text)
    assert message in str(caught.value)


def test_a_policy_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        load(tmp_path / "none.toml")


def test_the_first_rule_that_matches_counts(tmp_path: Path) -> None:
    given = policy(
        tmp_path,
        """
        loss_digits = 3
        [[rule]]
        case = "lag*"
        metric = "drift_*_max"
        loss_digits = 0.1
        [[rule]]
        metric = "*"
        loss_digits = 1
        """,
    )
    assert verdicts(drift("1e-12"), drift("5e-12"), given)["drift_energy_max"] == "same"
    strict = {"case": "lagrange"}
    found = verdicts(drift("1e-12", **strict), drift("5e-12", **strict), given)
    assert found["drift_energy_max"] == "worse"
    assert verdicts(drift("1e-12"), drift("2e-11"), given)["drift_energy_max"] == "worse"


def test_a_limit_holds_whatever_the_baseline_was(tmp_path: Path) -> None:
    given = policy(tmp_path, "[[rule]]\nmetric = 'drift_*'\nlimit = '1e-10'\n[[rule]]\nmetric = 'break*'\nlimit = 50")
    bad = drift("2e-10")
    assert verdicts(bad, bad, given)["drift_energy_max"] == "worse"
    assert verdicts(drift("1e-12"), drift("2e-12"), given)["drift_energy_max"] == "same"
    assert verdicts(row(), row(), given)["break_away_time"] == "same"
    tight = policy(tmp_path, "[[rule]]\nmetric = 'break*'\nlimit = 70")
    assert verdicts(row(), row(), tight)["break_away_time"] == "worse"


def test_a_limit_of_0_admits_no_error_and_one_below_the_floor_those_below_it(tmp_path: Path) -> None:
    none, tiny = (policy(tmp_path, f"[[rule]]\nmetric = 'drift_*'\nlimit = '{limit}'") for limit in ("0", "1e-30"))
    for value, at_none, at_tiny in (("0", "same", "same"), ("1e-40", "worse", "same"), ("1e-29", "worse", "worse")):
        found = [verdicts(drift(value), drift(value), given)["drift_energy_max"] for given in (none, tiny)]
        assert found == [at_none, at_tiny]


def test_what_is_ignored_is_left_out_even_where_it_is_missing_or_worse(tmp_path: Path) -> None:
    given = policy(tmp_path, "[[rule]]\nmetric = 'drift_*'\nignore = true")
    assert set(verdicts(row(), drift("1"), given)) == {"break_away_time"}
    for old in ([drift("1")], []):  # new rows alone are compared with nothing
        with pytest.raises(InputError, match="nothing to compare"):
            compare(report(*old), report(drift("2")), given if old else Policy())


def test_a_rule_that_matches_nothing_is_said(tmp_path: Path) -> None:
    rules = ("metric = 'drft_*'\nlimit = 1", "case = 'none'", "metric = 'drift_*'", "metric = 'seconds run'")
    given = policy(tmp_path, "".join(f"[[rule]]\n{rule}\n" for rule in rules))
    for new in (drift("1e-12"), drift("1")):
        assert compare(report(drift("1e-12")), report(new), given).sentences[-2:] == [
            'The rule of the policy with metric = "drft_*" matches nothing.',
            'The rule of the policy with case = "none" matches nothing.',
        ]


def test_a_rule_behind_one_that_matches_the_same_is_said(tmp_path: Path) -> None:
    rules = ("metric = 'drift_*'\nloss_bits = 9", "metric = 'drift_energy*'\nlimit = '1e-15'", "measure = 'drift'")
    given = policy(tmp_path, "".join(f"[[rule]]\n{rule}\n" for rule in rules))
    assert compare(report(drift("1e-12")), report(drift("1e-12")), given).sentences[-1] == (
        'The rule of the policy with metric = "drift_energy*" is not applied: earlier rules match the same metrics.'
    )


@pytest.mark.parametrize(
    ("when", "machine", "verdict"),
    [
        ("never", "A", None),
        ("same-machine", "A", "worse"),
        ("same-machine", "B", None),
        ("always", "B", "worse"),
    ],
)
def test_timings_compare_by_their_own_rule(tmp_path: Path, when: str, machine: str, verdict: str | None) -> None:
    given = policy(tmp_path, f"[timings]\ncompare = '{when}'\nratio = 2")
    old, new = (
        report(drift("1e-12", seconds={"run": 2 * seconds, "least": seconds, "compile": 0.01}))
        for seconds in (1.0, 2.5)
    )
    names = ("system", "machine", "processor", "simd_width_double", "cpu_features")
    old.environment.update(dict.fromkeys(names, "A"))
    new.environment.update(dict.fromkeys(names, machine))
    found = {f.metric: f.verdict.value for f in compare(old, new, given).findings}
    assert found.get("seconds run") == verdict
    assert found.get("seconds compile") in (None, "same")
    if verdict:
        back = {f.metric: f.verdict.value for f in compare(new, old, given).findings}
        assert back["seconds run"] == "better"


def test_a_difference_within_both_bands_in_quadrature_is_noise() -> None:
    def found(value: str, old: float, new: float, **given) -> str:
        return verdicts(drift("1e-12", old), drift(value, new), Policy(**given))["drift_energy_max"]

    # 2 hypot(0.3, 0.4) = 1 decade
    assert found("9.9e-12", 0.3, 0.4) == "same"
    assert found("1.01e-11", 0.3, 0.4) == "worse"
    assert found("1.01e-13", 0.3, 0.4) == "same"
    assert found("0.99e-13", 0.3, 0.4) == "better"
    assert found("9.9e-12", 0.3, 0.4, noise=1) == "worse"
    assert found("9.9e-12", 0.3, 0.4, noise=0) == "worse"
    # the allowed loss holds where the band is narrower, a tenth beyond what rounding explains, 2.2e-13 here
    assert found("1.2e-12", 0.01, 0.01) == "same"
    assert found("1.3e-12", 0.01, 0.01) == "worse"
    assert found("3.9e-12", 0.01, 0.01, loss_bits=2) == "same"
    assert found("4.1e-12", 0.01, 0.01, loss_bits=2) == "worse"


def test_a_last_value_below_its_own_root_mean_square_is_luck() -> None:
    def ends(final: str, rms: str = "1e-12") -> Row:
        return row(metrics={"drift_energy_rms": error(rms), "drift_energy_final": error(final)})

    assert verdicts(ends("1e-15"), ends("2e-12"))["drift_energy_final"] == "same"
    assert verdicts(ends("1e-15"), ends("5e-12"))["drift_energy_final"] == "worse"
    for pair, verdict in (
        ((ends("2e-12"), ends("1e-12", "9e-12")), "worse"),
        ((ends("1e-12", "9e-12"), ends("2e-12")), "better"),
    ):
        assert verdicts(*pair) == {"drift_energy_rms": verdict, "drift_energy_final": "same"}


LAWS = ["bounded", "t^0.5", "t", "t^1.5", "t^2", "exponential"]


@pytest.mark.parametrize("old", LAWS)
@pytest.mark.parametrize("new", [*LAWS, "unresolved"])
def test_a_change_of_growth_class_is_never_noise(old: str, new: str) -> None:
    def grows(how: str) -> Row:
        return drift("1e-12", 9.0, laws={"drift_energy": Law(how, 64)})  # type: ignore[arg-type]

    found = verdicts(grows(old), grows(new))["growth drift_energy"]
    if new == "unresolved":
        assert found == "incomparable"
        assert verdicts(grows(new), grows(old))["growth drift_energy"] == "incomparable"
    else:
        order = LAWS.index(new) - LAWS.index(old)
        assert found is ("same" if not order else "worse" if order > 0 else "better")


def test_exponents_differ_where_their_intervals_do_not_meet_and_a_lost_law_is_missing() -> None:
    def grows(low: float, high: float) -> Row:
        return drift("1e-12", laws={"drift_energy": Law("t", 64, (low + high) / 2, low, high)})

    def found(old: Row, new: Row) -> str:
        return verdicts(old, new)["growth drift_energy"]

    assert found(grows(0.9, 1.0), grows(0.95, 1.1)) == "same"
    assert found(grows(0.9, 1.0), grows(1.01, 1.1)) == "worse"
    assert found(grows(0.9, 1.0), grows(0.8, 0.89)) == "better"
    assert found(grows(0.9, 1.0), drift("1e-12")) == "missing"
    assert found(drift("1e-12"), grows(0.9, 1.0)) == "new"


EVALUATION = "claim_evaluation_error"


def measured(measure: str, name: str, value: str, kind: str = "error", band: float | None = None, **more: Any) -> Row:
    needed = {f"{EVALUATION}_{q}_max_finite": error("0") for q in ("omega", "theta", "psi")}
    metrics = needed | {name: replace(error(value), kind=kind, band=band)}
    return row(measure=measure, metrics=metrics, **more)


SLOPE = {"kind": "value", "band": 0.01}
MANY, PEER = {"steps": 10_000}, {"integrator": "peer:A tolerance=1e-9"}


@pytest.mark.parametrize(
    ("measure", "name", "old", "more", "expected"),
    [
        # two bits and no more, without a band
        ("local_error", "local_error_ulp_max", "0.4", {}, "worse 2, same 1.2 0.134, better 0.08"),
        ("local_error", "local_error_ulp_rms", "0.2", {}, "worse 1, same 0.6 0.067, better 0.04"),
        ("claim_evaluation", f"{EVALUATION}_omega_max_finite", "2e-8", {}, "worse 1e-7, same 6e-8 6.7e-9, better 4e-9"),
        ("score", "solution_error_gamma_max", "1e-13", {}, "worse 5e-13, same 3e-13 3.4e-14, better 2e-14"),
        ("score", "drift_energy_max", "1e-14", {}, "worse 5e-14, same 3e-14 3.4e-15, better 2e-15"),
        ("work_precision", "error_max", "1e-10", {}, "worse 5e-10, same 3e-10 3.4e-11, better 2e-11"),
        ("work_precision", "drift_energy_max", "1e-12", {}, "worse 5e-12, same 3e-12 3.4e-13, better 2e-13"),
        # what roundings add up to: eps = 2.2e-16, 4 n eps = 8.9e-12, 4 √n eps = 8.9e-14
        ("work_precision", "error_max", "1e-13", MANY, "same 8e-12, worse 4e-11"),
        ("work_precision", "drift_area_max", "1e-15", MANY, "same 8e-14, worse 4e-13"),
        ("drift", "error_max", "1e-13", MANY, "worse 8e-12"),
        # a decade of an integrator of others
        ("work_precision", "error_max", "1e-9", PEER, "same 1e-8, worse 2e-8, better 5e-11"),
        # a millionth of a model of a claim, whichever way it went; a value with a band
        ("claim_model", "claim_model_error_omega_max", "0.25", {"kind": "value"}, "same 0.250000025, worse 1.25 0.05"),
        ("break_away_law", "break_away_slope", "1", SLOPE, "same 1.06, worse 1.08"),
    ],
)
def test_each_measurement_has_an_allowance_of_its_own(
    measure: str, name: str, old: str, more: dict[str, Any], expected: str
) -> None:
    before = measured(measure, name, old, **more)
    for verdict, *values in (part.split() for part in expected.split(", ")):
        found = [verdicts(before, measured(measure, name, value, **more))[name] for value in values]
        assert found == [verdict] * len(values), values
    if more is PEER:
        assert verdicts(before, measured(measure, name, "5e-9", **more), noise=0)[name] == "worse"


@pytest.mark.parametrize(
    ("old", "new", "verdict"),
    [
        ((0.5,), (0.5,), "same"),
        ((0.5,), (0.7,), "incomparable"),
        ((0.7,), (0.5,), "incomparable"),
        ((0.5, 0.4, 0.6), (0.55,), "same"),
        ((0.5, 0.4, 0.6), (0.61,), "incomparable"),
        ((0.39,), (0.5, 0.4, 0.6), "incomparable"),
        ((0.5, 0.4, 0.6), (), "incomparable"),
        ((), (0.5,), "incomparable"),
        ((), (), "same"),
    ],
)
def test_exponents_without_an_interval_are_never_silently_the_same(old, new, verdict) -> None:
    def grows(numbers: tuple[float, ...]) -> Row:
        return drift("1e-12", laws={"drift_energy": Law("t^0.5", 64, *numbers)})

    found, reason = judged(grows(old), grows(new))
    assert (found, bool(reason)) == (verdict, verdict != "same")


def test_options_count_before_the_policy() -> None:
    given = adjusted(Policy(loss_digits=3), floor="0", loss_bits="1")
    assert (given.floor, given.loss_bits, given.loss_digits) == ("0", "1", None)
    assert verdicts(drift("1e-17"), drift("3e-17"), given)["drift_energy_max"] == "worse"
    with pytest.raises(InputError, match="negative"):
        adjusted(Policy(), loss_bits="-2")


def test_a_row_is_ignored_as_a_whole_by_a_rule_for_all_its_metrics(tmp_path: Path) -> None:
    given = policy(tmp_path, "[[rule]]\ncase = 'gone*'\nignore = true\n[[rule]]\nmetric = 'drift*'\nignore = true")
    failed = row(case="gone-2", outcome="step_limit", time_reached="1")
    old, new = report(row(), row(case="gone-1"), row(case="gone-2")), report(row(), failed, row(case="gone-3"))
    assert {(f.row.case, f.metric, f.verdict.value) for f in compare(old, new, given).findings} == {
        ("euler", "break_away_time", "same")
    }
    # a rule for some metrics leaves no row out
    assert compare(report(row(), row(case="other")), report(row()), given).exit_code == 3
