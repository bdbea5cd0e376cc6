"""A noise band is rounding noise or it is no band, and a repair is never worse."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

import pytest

import degraded_integrators as degraded
from degraded_integrators import HEALTHY, Method, marked_worse, report_of, verdict
from heavytop.features.kinds import KINDS
from heavytop.harness.rows import computed
from heavytop.measure.rounding_bound import RoundingBound
from heavytop.measure.rounding_noise import some_of
from heavytop.records import Against, Data, Metric, Quantity, Row, Series
from heavytop.report.compare.noise import (
    Policy,
    Rule,
    apart,
    noisier,
    of_starts,
    reaches_further,
)
from heavytop.top.amplification import FOLLOWED, amplification
from heavytop.top.equations import HEAVY_TOP, Parameters
from support.reports import compare, replace
from support.small_reports import all_judged, error, judged, report, row

FREE = Data(("4", "2", "1"), "0", ("0", "0", "0"), ("3", "1/2", "1/3"), ("3/5", "0", "4/5"))
UPRIGHT = Data(("1", "1", "1/2"), "1", ("0", "0", "1"), ("0", "0", "0"), ("0", "0", "1"))
EPS = math.log10(2.0**-52)
NAMES = ("drift_energy_max", "solution_error_omega_max")


def bound(kind: str = "drift", **changes) -> RoundingBound:
    return RoundingBound(row(**{"data": FREE, "steps": 10, **changes}), KINDS[kind].largest_amplification)


def edge(found: RoundingBound, name: str, component: str) -> float:
    """log10 of the largest error that is explained."""
    quantity, low, high = Quantity(name, component, "max"), -400.0, 400.0
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if found.explains(quantity, middle) else (low, middle)
    return low


@pytest.mark.slow
def test_the_bound_is_what_it_says_in_the_units_of_each_quantity() -> None:
    # the rate of FREE is 4, over 100 units of time
    turns, log = 401, math.log10
    drift, turned = 2 + EPS + log(turns) / 2, 2 + EPS + log(turns) * 1.5
    amplified = max(0.0, log(amplified_by(FREE, 100) / turns))
    assert edge(bound(), "drift", "gamma_squared") == pytest.approx(drift + log(3), abs=1e-6)
    assert edge(bound(), "drift", "energy") == pytest.approx(drift + log((4 + 2 + 1) * 16 / 2), abs=1e-6)
    assert edge(bound(), "drift", "area") == pytest.approx(drift + log((4 + 2 + 1) * 4), abs=1e-6)
    for component, unit in (("omega", 4), ("gamma", 1), ("along", 4), ("relative", 4)):
        assert edge(bound(), "solution_error", component) == pytest.approx(turned + log(unit) + amplified, abs=1e-5)
    # an invariant relation is amplified as a state is
    assert edge(bound(), "drift", "hess") == pytest.approx(turned + amplified, abs=1e-5)
    # more steps than turns round more often
    assert edge(bound(steps=40100), "drift", "gamma_squared") == pytest.approx(drift + 1 + log(3), abs=1e-6)
    assert edge(bound(bits=113), "drift", "gamma_squared") == pytest.approx(drift + log(3) - 60 * log(2), abs=1e-6)
    backwards = bound(horizon="-100", time_reached="-100")
    assert edge(backwards, "drift", "energy") == edge(bound(), "drift", "energy")


def amplified_by(data: Data, time: int) -> float:
    """The largest factor of an error up to the time, of a top of weight 0 or 1."""
    inertia, centre = (tuple(map(Fraction, each)) for each in (data.inertia, data.centre))
    start = tuple(map(Fraction, (*data.omega, *data.gamma)))
    return amplification(HEAVY_TOP, Parameters(inertia, centre, Fraction(0)), start, Fraction(time))


@pytest.mark.slow
def test_a_row_without_body_and_start_has_the_rate_1_and_the_amplification_that_it_says() -> None:
    for data in (None, replace(FREE, omega=()), replace(FREE, inertia=("0", "1", "x"))):
        assert edge(bound(data=data), "drift", "energy") == pytest.approx(2 + EPS + math.log10(101) / 2, abs=1e-6)
        expected = 2 + EPS + math.log10(101) * 1.5
        assert edge(bound(data=data), "solution_error", "gamma") == pytest.approx(expected, abs=1e-6)
        said = bound(data=data, amplification=101e3)
        assert edge(said, "solution_error", "gamma") == pytest.approx(expected + 3, abs=1e-6)
        assert edge(said, "drift", "energy") == edge(bound(data=data), "drift", "energy")
    # with both, what the row says of itself counts for nothing
    assert edge(bound(amplification=1e9), "solution_error", "gamma") == edge(bound(), "solution_error", "gamma")


def test_a_saddle_explains_errors_as_far_as_they_count_but_no_drift() -> None:
    near = bound(data=UPRIGHT, horizon="10", time_reached="10")
    plain = 2 + EPS + 1.5 * math.log10(21)
    # 1 + rate t = 21, and e^10 = 22026 beyond that
    assert edge(near, "solution_error", "gamma") == pytest.approx(plain + math.log10(math.exp(10) / 21), abs=0.5)
    assert edge(near, "drift", "gamma_squared") == pytest.approx(plain - math.log10(21) + math.log10(3), abs=1e-6)
    far = {"data": UPRIGHT, "horizon": "30", "time_reached": "30"}
    assert edge(bound(**far), "solution_error", "gamma") > edge(near, "solution_error", "gamma") + 8
    counted = 2 + EPS + 0.5 * math.log10(61) + math.log10(10 * math.exp(10))
    assert edge(bound("homoclinic", **far), "solution_error", "gamma") == pytest.approx(counted, abs=1e-6)


def test_beyond_what_double_follows_a_chaotic_motion_may_be_amplified_faster_by_half() -> None:
    far = {"data": UPRIGHT, "horizon": "60", "time_reached": "60", "bits": 237}
    found = math.log10(amplified_by(UPRIGHT, 60))
    expected = 2 + EPS - 184 * math.log10(2) + math.log10(121) / 2 + found + 0.5 * (found - math.log10(FOLLOWED))
    assert found > 25
    assert edge(bound(**far), "solution_error", "gamma") == pytest.approx(expected, abs=1e-5)


@pytest.mark.slow
def test_slow_turning_has_small_errors_of_omega() -> None:
    slow = replace(FREE, omega=("1/300", "1/400", "1/500"))
    apart_by = edge(bound(data=slow), "solution_error", "gamma") - edge(bound(data=slow), "solution_error", "omega")
    assert apart_by == pytest.approx(math.log10(128), abs=1e-5)


def test_an_escape_time_moves_by_two_decades_of_noise_either_way() -> None:
    saddle = bound("homoclinic", data=UPRIGHT, horizon="40", time_reached="40")
    # at t = 30 errors have grown by e^30: 4 decades of them are 4 ln(10)/30 of the time
    part = 4 * math.log(10) / 30
    assert saddle.explains_times("30", 0.9 * part)
    assert not saddle.explains_times("30", 1.1 * part)


def one(value: str, band: float | None, name: str = "solution_error_gamma_max", **changes) -> Row:
    metric = replace(error(value), band=band)
    return row(metrics={name: metric}, **{"data": FREE, **changes})


def test_a_baseline_whose_reruns_part_excuses_nothing_that_rounding_does_not_explain() -> None:
    wide = one("1.6e-14", 7.1)
    assert all_judged(wide, one("1.3e-6", 0.1), one("1.3e-6", 7.1)) == ["worse", "worse"]
    assert judged(wide, one("1e-8", 0.1), rule=(Rule(limit="1e-9"),)) == ("worse", "above its limit")
    assert judged(wide, wide)[0] == "same"


def test_a_candidate_whose_reruns_part_is_worse_where_it_reaches_further() -> None:
    assert judged(one("1.6e-14", 0.3), one("1.6e-14", 7.1)) == ("worse", "noise: 0.3 → 7.1 decades")
    assert all_judged(one("1e-3", 0.0), one("1e-14", 7.1), one("1e-14", 4.0)) == ["same", "better"]


def test_reruns_within_what_step_control_does_are_reproducible_and_excuse_no_more() -> None:
    # 1.2 decades apart, at an error far above rounding
    assert all_judged(one("1e-6", 0.848), one("1e-6", 0.848), one("1.58e-5", 0.848)) == ["same", "same"]
    assert judged(one("1e-6", 0.848), one("1.59e-5", 0.848))[0] == "worse"
    # below the bound of rounding, about 1.9e-10 here, all of the band is allowed
    assert judged(one("1e-14", 0.848), one("1e-12", 0.848))[0] == "same"


@pytest.mark.parametrize(
    ("value", "changes", "expected"),
    [
        ("1.09e-8", {}, "same"),  # a tenth
        ("1.11e-8", {}, "worse"),  # beyond it, by no rounding of these steps
        ("9.2e-9", {}, "same"),
        ("9.0e-9", {}, "better"),
        ("5e-8", {"evaluations": 6401}, "same"),  # a step was tried again: what step control does
        ("2e-7", {"evaluations": 6401}, "worse"),  # and no more
    ],
)
def test_where_every_step_is_the_same_one_an_error_may_grow_by_a_tenth(value, changes, expected) -> None:
    assert judged(third_party("1e-8"), third_party(value, **changes))[0] == expected
    # two errors that the roundings of the steps bring apart
    assert judged(third_party("1e-12"), third_party("8e-12"))[0] == "same"


def third_party(value: str, name: str = "drift_energy_max", **changes) -> Row:
    same = {"measure": "work_precision", "integrator": "mine:rk4", "data": FREE, "evaluations": 6400}
    return one(value, None, name, **same | changes)


def test_a_loss_that_a_policy_gives_is_that_of_truncation_too() -> None:
    for given in ({"loss_bits": 2}, {"loss_digits": "0.6"}, {"rule": (Rule(metric="drift_*", loss_bits=2),)}):
        assert all_judged(third_party("1e-8"), third_party("3e-8"), third_party("5e-8"), **given) == ["same", "worse"]
    assert judged(third_party("1e-8"), third_party("1.07e-8"), loss_bits="0.05")[0] == "worse"


def test_of_a_fixed_step_nothing_need_be_counted_and_of_others_reruns_tell() -> None:
    def stepped(value: str) -> Row:
        subject = computed("mine:rk4", step="1/100")
        return replace(third_party(value, evaluations=None), key=replace(third_party(value).key, subject=subject))

    assert judged(stepped("1e-8"), stepped("1.11e-8"))[0] == "worse"
    uncounted = [third_party(value, evaluations=None) for value in ("1e-8", "1.11e-8")]
    assert judged(*uncounted)[0] == "same"
    # reruns that are 1 % apart, and such that are a third
    assert judged(one("1e-6", 0.003), one("1.11e-6", 0.003))[0] == "worse"
    assert judged(one("1e-6", 0.1), one("1.11e-6", 0.1))[0] == "same"


def test_slight_losses_are_no_loss_where_the_integrator_gained_more() -> None:
    names = "drift_energy_max", "drift_area_max"

    def two(first: str, second: str, case: str) -> Row:
        metrics = {
            name: third_party(value, name).metrics[name] for name, value in zip(names, (first, second), strict=True)
        }
        return replace(third_party(first, case=case), metrics=metrics)

    faulty = report(two("1e-8", "5e-8", "euler"), two("1e-8", "1e-8", "lagrange"))
    mended = report(two("1e-8", "2e-8", "euler"), two("1.5e-8", "1e-8", "lagrange"))
    better, worse = compare(faulty, mended, Policy()), compare(mended, faulty, Policy())
    assert (better.verdict, worse.verdict) == ("better", "worse")
    assert [finding.verdict.value for finding in better.changed] == ["better"]
    assert [change.identity.case for change in better.rows] == ["euler"]
    assert not any("lagrange" in sentence for sentence in better.sentences)
    # a loss beyond what any error is allowed, or beyond a limit, is one whatever was gained
    spoiled = report(two("1e-8", "1e-9", "euler"), two("5e-8", "1e-8", "lagrange"))
    assert compare(faulty, spoiled, Policy()).verdict == "worse"
    assert compare(faulty, mended, Policy(rule=(Rule(case="lagrange", limit="1.2e-8"),))).verdict == "worse"


def test_an_escape_whose_reruns_part_excuses_nothing() -> None:
    def at(value: str, band: float) -> Row:
        metric = replace(error(value), kind="duration", band=band)
        common = {"measure": "homoclinic", "data": UPRIGHT, "horizon": "40", "time_reached": "40"}
        return row(metrics={"break_away_time": metric}, **common)

    assert judged(at("30", 0.02), at("29", 0.02))[0] == "same"
    assert all_judged(at("30", 0.2), at("30", 0.2), at("15", 0.2)) == ["same", "worse"]
    # within twice its band, but by more than noise moves an escape
    assert all_judged(at("30", 0.07), at("20.9", 0.07), at("20.6", 0.07)) == ["same", "worse"]
    # later, and noisier by as much as it is longer
    assert judged(at("10", 0.0001), at("30", 0.02))[0] == "better"


@pytest.mark.parametrize("name", NAMES)
def test_a_repair_is_not_worse_for_its_noise(name: str) -> None:
    """A truncation error is the same with all roundings; what is left without it is noise."""
    for old, new in (("6.3e-12", "1.3e-14"), ("2e-14", "1e-14"), ("1e-3", "1e-15"), ("6.3e-12", "1.4e-12")):
        before, after = one(old, 0.0022, name), one(new, 0.47, name)
        assert judged(before, after)[0] in ("same", "better")
        assert not marked_worse(report(before), report(after))
    # where value and band together exceed those of the baseline it is noisier
    assert judged(one("6.3e-12", 0.0022, name), one("6.2e-12", 0.47, name)) == (
        "worse",
        "noise: 0.0022 → 0.47 decades",
    )


def test_what_a_value_gained_its_noise_may_take_up_to_the_allowed_loss() -> None:
    def reach(gained: float, band: float) -> bool:
        old, new = Metric("1e-9", -9.0, band=0.1), Metric("x", -9.0 - gained, band=band)
        return reaches_further(old, new, (-math.inf, -math.inf), 0.6)

    assert [reach(0.0, band) for band in (0.1, 0.1001)] == [False, True]
    assert [reach(0.3, band) for band in (0.699, 0.701)] == [False, True]
    assert [reach(2.0, band) for band in (2.699, 2.701)] == [False, True]
    # a last value counts as its RMS
    low = Metric("x", -20.0, band=3.0)
    assert reaches_further(Metric("x", -9.0, band=0.1), low, (-math.inf, -9.0), 0.6)
    assert not reaches_further(Metric("x", -9.0, band=0.1), low, (-math.inf, -math.inf), 0.6)


def test_the_starts_of_an_ensemble_widen_a_band_by_no_more_than_one_of_them_can() -> None:
    for starts, widest in ((1, 7.1), (16, math.log10(16) / 2), (64, math.log10(64) / 2)):
        assert of_starts(Metric("x", -3.0, band=7.1), row(starts=starts)).band == pytest.approx(widest)
    assert of_starts(Metric("x", -3.0, band=0.3), row(starts=16)).band == 0.3
    few = {"measure": "growth", "starts": 16, "data": None}
    # 2 · 0.602 · √2 decades where both are as wide
    assert judged(one("1e-6", 5.0, **few), one("4.9e-5", 5.0, **few))[0] == "same"
    assert judged(one("1e-6", 5.0, **few), one("5.1e-5", 5.0, **few))[0] == "worse"


def test_the_series_of_an_ensemble_may_move_by_no_more_than_its_metrics() -> None:
    def sampled(size: str) -> Row:
        series = {"solution_error_gamma": Series(["1", "2"], [size, size])}
        return one("1e-5", 5.0, measure="growth", starts=16, series=series)

    # 2 · 0.602 · √2 decades
    assert all_judged(sampled("1e-9"), sampled("4.9e-8"), sampled("5.1e-8")) == ["same", "worse"]


def test_where_all_digits_are_lost_a_narrow_band_is_chance() -> None:
    lost = Against("computed", "words", until="90")
    for reference, near, far in ((lost, 1.49, 1.51), (Against("computed", "words"), 0.24, 0.26)):
        said = {"reference": reference, "against": reference.text, "data": UPRIGHT}
        old, name = one("0.5", 0.041, **said), "noise: 0.041 → {:.2g} decades"
        assert judged(old, one("0.5", near, **said))[0] == "same"
        assert judged(old, one("0.5", far, **said)) == ("worse", name.format(far))


@pytest.mark.parametrize(
    ("count", "end", "most", "expected"),
    [
        (100, 100, 32, [100 * i // 32 for i in range(1, 33)]),
        (5, 5, 32, [1, 2, 3, 4, 5]),
        (100, 10, 4, [2, 5, 7, 10]),
        (3, Fraction(1, 2), 32, [Fraction(1, 6), Fraction(1, 3), Fraction(1, 2)]),
    ],
)
def test_reruns_are_sampled_at_times_of_the_row(count: int, end, most: int, expected: list) -> None:
    for sign in (1, -1):
        times = [Fraction(sign * i) for i in range(1, count + 1)]
        assert some_of(times, sign * Fraction(end), most) == [sign * Fraction(time) for time in expected]


def test_a_distance_of_two_sizes() -> None:
    assert apart(-6, math.log10(3)) == pytest.approx(math.log10(2e-6))
    assert apart(-6, 400) == 394
    assert apart(-6, 1e-9) == pytest.approx(-6 + math.log10(1e-9 * math.log(10)))
    assert apart(-6, 0.0) == -math.inf
    assert not noisier(KINDS["drift"], Metric("1", 0.0), Metric("1", 0.0, band=9.0))


@pytest.fixture(scope="module")
def _package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with degraded.installed(tmp_path_factory.mktemp("package")):
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("_package")
@pytest.mark.parametrize(
    ("better", "worse"),
    [
        # exact where its samples are nodes, which those of its row are; then off them, and coarser
        (Method(dense=4), Method(dense=4, step=0.13)),
        (Method(between=1e-6), Method(between=1e-6, order=6)),
        (HEALTHY, Method(single=3)),
        (HEALTHY, Method(noise=1e-9)),
        (HEALTHY, Method(tolerance=1e-6)),
    ],
    ids=str,
)
def test_an_integrator_made_worse_and_mended(better: Method, worse: Method) -> None:
    good, bad = report_of(better, "euler"), report_of(worse, "euler")
    assert degraded.error(bad) > 100 * degraded.error(good)
    assert all((metric.band or 0.0) < 1.5 for metric in good.rows[0].metrics.values())
    assert verdict(good, bad) in ("worse", "incomparable")
    assert verdict(bad, good) in ("better", "incomparable")
    assert not marked_worse(bad, good)
    assert verdict(good, good) == "same"
