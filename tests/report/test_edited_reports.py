"""A report that was weakened is never the same, or better: a few edits of `validation/edited_reports.py`, and edges."""

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from random import Random

import pytest

from edited_reports import EDITS, document_of, trials
from heavytop.errors import InputError
from heavytop.records import Against, Certified, Law, Metric, Row, Series
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.rows import judge_law, judge_series
from support.reports import compare, contradictions, replace, store
from support.small_reports import all_judged, error, judged, report, row

RESULTS = Path(__file__).parents[2] / "results"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["default", "growth", "peers"])
def test_no_edit_passes(tmp_path: Path, name: str) -> None:
    found = list(trials(RESULTS / name, tmp_path, 5, 16))
    assert {verdict for _, verdict in found} <= {"worse", "incomparable", "refused"}, found
    assert len({edit for edit, _ in found}) > 8


@pytest.mark.slow
def test_every_edit_has_something_to_edit() -> None:
    """An edit of a field that rows no longer have would never be tried, and never be the same."""
    left, random = dict(EDITS), Random(1)
    for name in ("growth", "default", "peers"):
        for each in document_of(RESULTS / name)["rows"]:
            for edit, change in list(left.items()) if each["outcome"] == "success" else ():
                changed = deepcopy(each)
                if change(changed, random):
                    assert changed != each, edit
                    del left[edit]
    assert not left


def one(band: float | None = 0.3, value: str = "1e-12", **changes) -> Row:
    metric = replace(error(value), band=band)
    return row(metrics={"drift_energy_max": metric}, **changes)


NEVER = {"break_away_time": Metric("never", None, "duration")}
SLOPE = {"break_away_slope": "1", "break_away_slope_expected": "1", "break_away_slope_off_by": "0"}


@pytest.mark.parametrize(
    ("measure", "others", "near", "far"),
    [
        ("drift", {}, 0.4995, 0.5005),
        ("growth", {}, 0.5994, 0.6006),
        ("homoclinic", NEVER, 0.7992, 0.8008),
        # the noise is added there
        ("break_away_law", {name: error(value) for name, value in SLOPE.items()}, 0.45, 1.2),
    ],
)
def test_a_candidate_may_be_noisier_by_chance_and_no_more(
    measure: str, others: dict[str, Metric], near: float, far: float
) -> None:
    def noisy(band: float | None) -> Row:
        return row(measure=measure, metrics={**others, "drift_energy_max": replace(error("1e-9"), band=band)})

    assert all_judged(noisy(0.1), noisy(0.1), noisy(near), noisy(far)) == ["same", "same", "worse"]
    if measure != "break_away_law":
        assert judged(noisy(0.1), noisy(far))[1] == f"noise: 0.1 → {far:.1f} decades"
        # a band too narrow to excuse anything is taken as 0.05
        assert all_judged(noisy(0.001), noisy(near / 2), noisy(far / 2)) == ["same", "worse"]
    assert judged(noisy(0.3), noisy(0.1))[0] == "same"
    assert judged(noisy(None), noisy(0.1))[0] == "same"
    assert judged(noisy(0.1), noisy(None)) == ("incomparable", "its noise is not measured (was 0.1 decades)")


def test_the_noise_allowed_for_is_that_of_the_baseline() -> None:
    # 2 · 0.3 · √(1 + 1.4²) = 1.0323 decades, however noisy the candidate is
    for band in (0.42, 0.5, 0.8):
        assert all_judged(one(), one(band, "1.07e-11"), one(band, "1.08e-11")) == ["same", "worse"]
    # a gain must be beyond the noise of both
    assert all_judged(one(), one(1.4, "1.0e-14"), one(0.3, "1.0e-14")) == ["same", "better"]


@pytest.mark.parametrize(
    ("kind", "name", "own", "widest"),
    [
        # 50 · 10^(−2 · 0.05 √2), and √(1 + 1.4²) in the place of √2 where the candidate is noisier
        ("duration", "break_away_time", ("36.2", "36.0"), ("33.7", "33.5")),
        # 50 · (2 − 10^(2 · 0.05 √2)): a part of the larger of the two
        ("value", "break_away_slope", ("30.8", "30.7"), ("25.8", "25.6")),
    ],
)
def test_a_time_moves_within_the_noise_of_the_baseline(kind: str, name: str, own, widest) -> None:
    def at(value: str, band: float) -> Row:
        measure = "homoclinic" if kind == "duration" else "break_away_law"
        return row(metrics={name: replace(error(value), kind=kind, band=band)}, measure=measure)

    old = at("50", 0.05)
    for band, (near, far) in ((0.05, own), (0.2, widest)):
        assert all_judged(old, at(near, band), at(far, band)) == ["same", "worse"]
    assert judged(old, at(own[0], 0.05), noise=0)[0] == "worse"
    if kind == "duration":  # 50 · 10^(2 · 0.05 √2), and with the noise of both 50 · 10^(2 · √(0.05² + 0.1²))
        for band, near, far in ((0.05, "69.2", "69.3"), (0.1, "83.6", "83.8")):
            assert all_judged(old, at(near, band), at(far, band)) == ["same", "better"]


LAW = Law("t^0.5", 64, 0.5, 0.47, 0.53, "100", "1e5", "1e-19", "1e30")


@pytest.mark.parametrize(
    ("field", "near", "far", "verdict"),
    [
        ("starts", 65, 63, "incomparable"),
        ("detects", "7.9e-19", "8.1e-19", "worse"),
        ("detects", "1e-19", None, "incomparable"),
        ("last", "5.1e4", "4.9e4", "incomparable"),
        ("first", "199", "201", "incomparable"),
        ("first", "100", None, "incomparable"),
        ("lost_at", "5.1e29", "4.9e29", "worse"),
        ("lost_at", "1e30", None, "incomparable"),
    ],
)
def test_what_a_law_says_may_change_so_far(field: str, near: object, far: object, verdict: str) -> None:
    old, *new = (one(laws={"drift_area": replace(LAW, **{field: value})}) for value in (getattr(LAW, field), near, far))
    assert all_judged(old, *new) == ["same", verdict]
    if (field, far) == ("lost_at", "4.9e29"):
        # what the noise of the error moves, the time of the last digit follows: 2 · 0.1 · √2 / 0.5 = 0.57 decades
        noisy = [
            row(metrics={"drift_area_final": replace(error("1e-12"), band=0.1)}, laws=r.laws) for r in (old, new[1])
        ]
        assert judged(*noisy)[0] == "same"


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({"exponent": 0.56, "low": 0.53, "high": 0.59}, "same"),
        ({"exponent": 0.57, "low": 0.531, "high": 0.6}, "worse"),
        # an interval twice as wide counts as one of the width of the baseline: 0.54 to 0.6
        ({"exponent": 0.57, "low": 0.51, "high": 0.63}, "worse"),
        ({"low": 0.35, "high": 0.649}, "same"),
        ({"low": 0.35, "high": 0.652}, "worse"),
        ({"exponent": 5.5, "low": -50.0, "high": 50.0}, "incomparable"),
        ({"exponent": 0.76, "low": 0.45, "high": 0.8}, "incomparable"),
        ({"low": 0.51}, "incomparable"),
        # the class may be 0.12 outside of the interval
        ({"exponent": 0.7, "low": 0.619, "high": 0.74}, "worse"),
        ({"exponent": 0.7, "low": 0.621, "high": 0.74}, "incomparable"),
        ({"growth": "exponential", "exponent": 0.1, "low": 0.05, "high": 0.2}, "worse"),
        ({"growth": "exponential", "exponent": -0.1, "low": -0.2, "high": -0.05}, "incomparable"),
        *((change, "incomparable") for change in ({"high": 1.0}, {"growth": "t"}, {"growth": "unresolved"})),
        *((change, "incomparable") for change in ({"low": float("nan")}, {"first": "1e6"})),
    ],
)
def test_a_law_may_change_within_its_noise(change: dict, verdict: str) -> None:
    assert judged(*(one(laws={"drift_area": law}) for law in (LAW, replace(LAW, **change))))[0] == verdict


@pytest.mark.parametrize(
    ("field", "near", "far", "noise"),
    [
        # 0.3 decades, and the noise of the error divided by the power of t
        ("lost_at", "2.05e29", "1.95e29", 0.2),
        # a factor of 8, or the noise where that is more
        ("detects", "7.9e-19", "8.1e-19", 0.5),
        ("detects", "9.9e-19", "1.01e-18", 1.0),
    ],
)
def test_what_a_law_says_follows_the_noise_of_its_error(field: str, near: str, far: str, noise: float) -> None:
    for value, verdict in ((near, "same"), (far, "worse")):
        assert judge_law(LAW, replace(LAW, **{field: value}), noise)[0].value == verdict


STRAIGHT = Law("t^1.5", 16, 1.4, 1.3, 1.5, "100", "1e5", "1e-19", "1e30", (-0.3, 0.2))


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        # of two ensembles of one motion one bends by a little more than a law may, or is between two classes
        ({"bend": (-0.7, -0.251)}, "same"),
        ({"bend": (-0.7, -0.31)}, "better"),
        ({"exponent": 1.25, "low": 1.13, "high": 1.37}, "same"),
        ({"exponent": 1.2, "low": 1.13, "high": 1.29}, "better"),
        ({"exponent": 1.65, "low": 1.501, "high": 2.1}, "worse"),
        # its interval counts as no wider than that of the baseline, and is worse where it is five times as wide
        ({"exponent": 1.58, "low": 1.2, "high": 2.1}, "same"),
        ({"exponent": 1.6, "low": 1.2, "high": 2.1}, "worse"),
        ({"exponent": 1.4, "low": 0.9, "high": 1.91}, "worse"),
        # what the class says needs no number more, all else does
        ({"bend": (0.251, 0.9)}, "worse"),
        ({"bend": (0.26, 0.3)}, "worse"),
        ({"bend": None}, "incomparable"),
        ({"bend": None, "exponent": 1.25, "low": 1.13, "high": 1.37}, "incomparable"),
        ({"bend": (-0.5, -0.249)}, "incomparable"),
        ({"bend": (0.9, 0.251)}, "incomparable"),
        ({"bend": (float("-inf"), -0.3)}, "incomparable"),
        ({"exponent": None, "low": None, "high": None, "bend": None}, "incomparable"),
        ({"exponent": 1.25, "low": 1.13, "high": 1.37, "starts": 15}, "incomparable"),
        ({"exponent": 1.25, "low": 1.13, "high": 1.37, "detects": None}, "incomparable"),
        ({"exponent": 1.25, "low": 1.13, "high": 1.37, "detects": "8.1e-19"}, "worse"),
        ({"exponent": 1.25, "low": 1.13, "high": 1.37, "last": "4.9e4"}, "incomparable"),
        ({"exponent": 1.25, "low": 1.13, "high": 1.37, "lost_at": "4.9e29"}, "worse"),
    ],
)
def test_a_law_that_is_resolved_in_one_report_only_is_judged_by_its_intervals(change: dict, verdict: str) -> None:
    new = replace(STRAIGHT, growth="unresolved", **({"lost_at": None} | change))
    assert judged(one(laws={"drift_area": STRAIGHT}), one(laws={"drift_area": new}))[0] == verdict
    if verdict == "same":
        assert judged(one(laws={"drift_area": new}), one(laws={"drift_area": STRAIGHT}))[0] == "same"


HALF_WAY = Law("t", 16, 1.22, 1.06, 1.38, "100", "1e5", "1e-19", "1e20", (-0.1, 0.4))


@pytest.mark.parametrize(
    ("old", "change", "rerun", "once"),
    [
        # a tenth of the width of the interval, 0.06, between two that do not meet: from 0.53 to 0.536
        (LAW, {"exponent": 0.563, "low": 0.533, "high": 0.593}, "same", "worse"),
        (LAW, {"exponent": 0.5655, "low": 0.5355, "high": 0.5955}, "same", "worse"),
        (LAW, {"exponent": 0.5665, "low": 0.5365, "high": 0.5965}, "worse", "worse"),
        (LAW, {"exponent": 0.4345, "low": 0.4045, "high": 0.4645}, "same", "better"),
        (LAW, {"exponent": 0.4335, "low": 0.4035, "high": 0.4635}, "better", "better"),
        # an interval twice as wide counts as 1.4 times as wide: to 0.042 below the exponent
        (LAW, {"exponent": 0.577, "low": 0.517, "high": 0.637}, "same", "worse"),
        (LAW, {"exponent": 0.579, "low": 0.519, "high": 0.639}, "worse", "worse"),
        # two classes, exponents 0.25 apart at most
        (HALF_WAY, {"growth": "t^1.5", "exponent": 1.3, "low": 1.2, "high": 1.4}, "same", "worse"),
        (HALF_WAY, {"growth": "t^1.5", "exponent": 1.46, "low": 1.3, "high": 1.6}, "same", "worse"),
        (HALF_WAY, {"growth": "t^1.5", "exponent": 1.48, "low": 1.3, "high": 1.6}, "worse", "worse"),
        (HALF_WAY, {"growth": "t^1.5", "exponent": 1.46, "low": 1.44, "high": 1.5}, "worse", "worse"),
        (HALF_WAY, {"growth": "exponential", "exponent": 1.3, "low": 1.2, "high": 1.4, "bend": None}, "worse", "worse"),
        # extrapolated by two powers, the time of the last digit is not compared
        (HALF_WAY, {"growth": "t^1.5", "exponent": 1.3, "low": 1.2, "high": 1.4, "lost_at": "1e15"}, "same", "worse"),
        (HALF_WAY, {"lost_at": "1e15"}, "worse", "worse"),
        # bends: half of the width of the interval, 0.5
        (HALF_WAY, {"growth": "unresolved", "bend": (0.64, 1.14), "lost_at": None}, "same", "worse"),
        (HALF_WAY, {"growth": "unresolved", "bend": (0.66, 1.16), "lost_at": None}, "worse", "worse"),
    ],
)
def test_chance_is_allowed_for_between_two_runs_and_not_in_one_series(old: Law, change, rerun: str, once: str) -> None:
    new = replace(old, **change)
    assert judge_law(old, new, rerun=True)[0].value == rerun
    assert judge_law(old, new)[0].value == once
    one_series = Series(TIMES, ["1e-13", "1e-12", "1e-12"])
    for other, expected in ((one_series, once), (Series(TIMES, ["1.1e-13", "1e-12", "1e-12"]), rerun)):
        two = [
            row(metrics={}, starts=64, laws={"drift_area": law}, series={"drift_area": series}, samples=3)
            for law, series in ((old, one_series), (new, other))
        ]
        assert judged(*two)[0] == expected
        assert judged(*(replace(each, series={}) for each in two))[0] == once


@pytest.mark.parametrize(("starts", "same", "worse"), [(12, "5.4e-12", "5.6e-12"), (64, "3.9e-12", "4.1e-12")])
def test_of_a_few_starts_the_noise_has_a_least(starts: int, same: str, worse: str) -> None:
    # 2 · √(0.2165² + 0.3²) = 0.74 decades, 0.2165 being 0.75/√12; of 64 starts 0.26, less than two bits
    def of(value: str, band: float, count: int) -> Row:
        return row(measure="growth", starts=count, metrics={"drift_area_max": replace(error(value), band=band)})

    assert judged(of("1e-12", 0.06, starts), of(same, 0.3 if starts < 24 else 0.1, starts))[0] == "same"
    assert judged(of("1e-12", 0.06, starts), of(worse, 0.3 if starts < 24 else 0.1, starts))[0] == "worse"


def test_an_exponential_has_a_rate_and_no_power_has_one_to_compare_with_it() -> None:
    chaos = Law("exponential", 16, 0.05, 0.04, 0.06, "1", "1e3", None, "700")
    power = Law("unresolved", 16, 0.05, -0.1, 0.52, "1", "1e3", None, "700", (-0.1, 0.1))
    for two in ((chaos, power), (power, chaos)):
        assert judge_law(*two)[0].value == "incomparable"
    bending = replace(chaos, bend=(-0.1, 0.1))
    assert judge_law(bending, bending)[0].value == "incomparable"


KNOWN = Against("proven", "closed form: Euler", "6.02E-36", (Certified("100", 50, "validated"),))


@pytest.mark.parametrize(
    ("field", "near", "far"),
    [
        ("radius", "6.0E-35", "6.1E-35"),
        ("radius", "1E-36", ""),
        ("digits", 40, 39),
        ("time", "51", "49"),
        ("proven", "proven at both ends", "computed"),
        ("method", "validated: Taylor enclosure", None),
        ("how", "proven", "computed"),
        ("how", "proven", "none"),
    ],
)
def test_a_reference_may_be_another_and_not_a_weaker_one(field: str, near: object, far: object) -> None:
    def known(value: object) -> Row:
        change = {field: value} | ({"reason": "no reference: lost"} if value == "none" else {})
        if field in Certified.__struct_fields__:
            change = {"certificates": tuple(replace(each, **change) for each in KNOWN.certificates)}
        other = replace(KNOWN, **change)
        return one(reference=other, against=other.text)

    old = one(reference=KNOWN, against=KNOWN.text)
    assert judged(old, known(near))[0] == "same"
    if far is not None:
        assert judged(old, known(far))[0] == "incomparable"
        assert field == "how" or judged(known(far), old)[0] == "same"


KNOWN_RUN = {"order": 20, "input_rounding": "1e-17", "evaluations": 100}


@pytest.mark.parametrize(
    ("field", "near", "far"),
    [
        ("steps", 20, (21, 4, 0)),
        ("steps", 5, ()),
        ("evaluations", 200, (201, 49, 0, None)),
        ("starts", 1, (2,)),
        ("order", 20, (19,)),
        ("measured", row().measured, ("claimed: by somebody",)),
        ("input_rounding", "2.2e-16", ("2.3e-16", None)),
        ("bits", 53, (64,)),
    ],
)
def test_what_a_row_says_of_its_run_stays(field: str, near: object, far: tuple[object, ...]) -> None:
    news = [one(**(KNOWN_RUN | {field: value})) for value in (near, *far)]
    assert all_judged(one(**KNOWN_RUN), *news) == ["same", *["incomparable"] * len(far)]


@pytest.mark.parametrize(
    ("measure", "old", "new", "verdict"),
    [
        ("drift", 1000, 1000, "same"),
        ("drift", 1000, 1001, "same"),
        ("drift", 1000, 999, "incomparable"),
        ("drift", 1000, 0, "incomparable"),
        ("drift", 3, 0, "same"),  # its series hold three
        ("drift", 4, 0, "incomparable"),
        # a baseline that does not say: its series hold three
        ("drift", 0, 0, "same"),
        ("drift", 0, 3, "same"),
        ("drift", 0, 2, "incomparable"),
        # samples that are steps
        ("local_error", 101, 51, "same"),
        ("local_error", 101, 50, "incomparable"),
    ],
)
def test_the_largest_of_fewer_samples_is_no_better(tmp_path: Path, measure: str, old: int, new: int, verdict: str):
    series = {"drift_energy": Series(["1", "2", "100"], ["1e-13", "1e-13", "1e-12"])}
    two = [one(None, measure=measure, samples=samples, series=series) for samples in (old, new)]
    assert judged(*two)[0] == verdict
    assert judged(*two, flags="ignore")[0] == verdict
    for name, each in zip(("old", "new"), two, strict=True):
        (tmp_path / name).mkdir()
        store.write(report(each), tmp_path / name)
    briefs = [store.read_brief(tmp_path / name) for name in ("old", "new")]
    if 0 < new < 3:
        with pytest.raises(InputError, match="samples: 2, where drift_energy has 3"):
            compare(*briefs, Policy())
    else:
        assert compare(*briefs, Policy()).verdict == verdict


def test_a_run_without_steps_is_another_whatever_the_flags() -> None:
    assert all_judged(one(steps=10), one(steps=4), one(steps=0), flags="ignore") == ["same", "incomparable"]
    assert judged(one(steps=0), one(steps=10), flags="ignore")[0] == "incomparable"


TIMES = ["1", "50", "100"]


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        (["3.9e-13", "3.9e-13", "1e-12"], "same"),
        (["4.1e-13", "4.1e-13", "1e-12"], "worse"),
        (["nan", "1e-13", "1e-12"], "incomparable"),
        (["1e-13", "1e-13", "9e-13"], "incomparable"),
        (["1e-13", "1.1e-12", "1e-12"], "incomparable"),
        (["1e-13", "1e-13", "unresolved"], "incomparable"),
        (["1e-13", "unresolved", "1e-12"], "same"),
    ],
)
def test_a_series_agrees_with_its_metrics_and_with_its_baseline(values: list[str], verdict: str) -> None:
    metrics = {f"drift_energy_{part}": error("1e-12") for part in ("max", "final")}
    old = row(metrics=metrics, series={"drift_energy": Series(TIMES, ["1e-13", "1e-13", "1e-12"])})
    new = row(metrics=metrics, series={"drift_energy": Series(TIMES, values)})
    assert all_judged(old, new, row(metrics=metrics)) == [verdict, "incomparable"]
    later = Series([*TIMES[:-1], "99"], ["1e-13", "1e-13", "1e-12"])
    assert judged(old, row(metrics=metrics, series={"drift_energy": later}))[0] == "incomparable"


@pytest.mark.parametrize(
    "change",
    [
        {"measure": "local_error", "metrics": {"local_error_ulp_max": replace(error("1"), band=0.1)}},
        {"measure": "growth", "metrics": {"starts_failed": replace(error("0"), band=0.1)}},
        {"metrics": {"drift_energy_max": error("1e-12"), "drift_energy_rms": error("1.001e-12")}},
        {"metrics": {"drift_energy_max": error("1e-12"), "drift_energy_final": error("2e-12")}},
        {"metrics": {"starts_failed": error("1")}},
        {"metrics": {"break_away_time": replace(error("101"), kind="duration")}, "measure": "homoclinic"},
        {"precision": "quad"},
        {"series": {"drift_energy": Series(["1"], ["nan"])}},
        {"series": {"drift_energy": Series(["1"], ["1.001e-12"])}},
    ],
)
def test_a_row_that_contradicts_itself_is_refused(tmp_path: Path, change: dict) -> None:
    bad = row(case="lagrange", **change)
    assert list(contradictions(bad))
    (tmp_path / "bad").mkdir()
    store.write(report(row(), bad), tmp_path / "bad")
    for read in (store.read, lambda path: list(store.read_brief(path).rows)):
        with pytest.raises(InputError, match="lagrange"):
            read(tmp_path / "bad")
    # one that was never on disk is not the same either
    assert judged(bad, bad)[0] == "incomparable"


def test_numbers_that_agree_to_their_digits_are_no_contradiction() -> None:
    metrics = {"drift_energy_max": error("1.00000e-12"), "drift_energy_rms": error("1.00001e-12")}
    assert not list(contradictions(row(metrics=metrics)))
    slope = {
        "break_away_slope": "1.4045707",
        "break_away_slope_expected": "1.3862944",
        "break_away_slope_off_by": "0.013183566",
    }
    law = row(measure="break_away_law", metrics={name: error(value) for name, value in slope.items()})
    assert not list(contradictions(law))
    law.metrics["break_away_slope_off_by"] = error("0.0131")
    assert list(contradictions(law))


@pytest.mark.parametrize(("lost", "verdict"), [(4, "same"), (5, "incomparable")])
def test_so_many_samples_may_no_longer_be_resolved(lost: int, verdict: str) -> None:
    times = [str(time) for time in range(1, 21)]
    two = [Series(times, ["unresolved"] * none + ["1e-13"] * (20 - none)) for none in (0, lost)]
    assert judge_series(*two, 0.6, -16.0, exactly=False)[0].value == verdict
    # those that the baseline did not resolve either are not lost
    assert judge_series(two[1], two[1], 0.6, -16.0, exactly=False)[0].value == "same"


@pytest.mark.parametrize(("word", "verdict"), [("nan", "worse"), ("missing", "incomparable")])
def test_a_sample_that_was_a_number_stays_one(word: str, verdict: str) -> None:
    old, new = (Series(TIMES, ["1e-13", last, "1e-13"]) for last in ("1e-13", word))
    assert judge_series(old, new, 0.6, -16.0, exactly=False)[0].value == verdict
    assert judge_series(new, new, 0.6, -16.0, exactly=False)[0].value == "same"


@pytest.mark.parametrize(("value", "verdict"), [("3.0003", "same"), ("2.9997", "same"), ("3.0005", "worse")])
def test_a_series_that_must_agree_is_off_by_a_part_of_its_largest(value: str, verdict: str) -> None:
    old, new = (Series(["1", "2"], [each, "-4"]) for each in ("3", value))
    assert judge_series(old, new, 1e-4, -16.0, exactly=True)[0].value == verdict


def test_half_of_the_samples_may_grow_by_what_is_allowed_above_the_floor() -> None:
    old = Series(TIMES, ["1e-30", "1e-13", "1e-13"])
    for values, verdict in (
        (["9e-17", "3.9e-13", "3.9e-13"], "same"),
        (["9e-17", "4.1e-13", "4.1e-13"], "worse"),
        (["9e-17", "1e-17", "4.1e-13"], "same"),
        (["9e-14", "1e-13", "4.1e-13"], "worse"),
    ):
        assert judge_series(old, Series(TIMES, values), 0.6055, -16.0, exactly=False)[0].value == verdict, values


@pytest.mark.parametrize(
    ("band", "same", "worse"),
    # two bits; twice 0.3 √2 decades, where that is more
    [(0.2, "3.9e-13", "4.1e-13"), (0.3, "7.0e-13", "7.1e-13")],
)
def test_a_series_may_grow_by_the_noise_of_its_metrics_or_by_two_bits(band: float, same: str, worse: str) -> None:
    metrics = {
        "drift_energy_max": replace(error("1e-12"), band=0.05),
        "drift_energy_final": replace(error("1e-12"), band=band),
    }

    def with_series(value: str) -> Row:
        return row(metrics=metrics, series={"drift_energy": Series(TIMES, [value, value, "1e-12"])})

    assert all_judged(with_series("1e-13"), with_series(same), with_series(worse)) == ["same", "worse"]


@pytest.mark.parametrize(("value", "contradicts"), [("1.02e-12", False), ("1.03e-12", True)])
def test_a_series_is_within_the_bound_of_what_is_unresolved(value: str, contradicts: bool) -> None:
    """A bound has three digits."""
    metrics = {"drift_energy_max": Metric("unresolved", None, "error", "1e-12")}
    made = row(metrics=metrics, series={"drift_energy": Series(TIMES, ["1e-13", value, "unresolved"])})
    assert bool(list(contradictions(made))) is contradicts


PSI = "claim_evaluation_error_psi"
COUNT, FROM = "claim_evaluation_psi_samples_not_finite", "claim_evaluation_psi_not_finite_from"
FORMULA = {
    f"{PSI}_max_finite": error("1e-12"),
    COUNT: Metric("1", 0.0, "value"),
    FROM: Metric("100", 2.0, "duration"),
}
WORK = {"error_max": error("2e-12"), "error_final": error("1e-12")}
OF_FORMULA = {PSI: ["1e-13", "1e-12", "nan"]}
OF_WORK = {
    "solution_error_omega": ["1e-13", "2e-12", "1e-13"],
    "solution_error_gamma": ["1e-13", "1e-13", "1e-12"],
}


@pytest.mark.parametrize(
    ("field", "wrong"),
    [
        *((f"{PSI}_max_finite", error(size)) for size in ("1.001e-12", "0.999e-12")),
        (COUNT, Metric("0", None, "value")),
        (FROM, Metric("never", None, "duration")),
        *(("error_final", error(size)) for size in ("1.001e-12", "0.999e-12")),
        ("error_max", error("1.99e-12")),
    ],
)
def test_the_numbers_of_formulas_and_of_runs_are_those_of_their_series(field: str, wrong: Metric) -> None:
    of_run = field in WORK
    known, values = (WORK, OF_WORK) if of_run else (FORMULA, OF_FORMULA)
    series = {name: Series(TIMES, each) for name, each in values.items()}
    measure = "work_precision" if of_run else "claim_evaluation"

    def wrong_fields(metrics: dict[str, Metric]) -> list[str]:
        made = row(measure=measure, finite=of_run, metrics=dict(metrics), series=dict(series))
        return [problem.partition(":")[0] for problem in contradictions(made)]

    assert wrong_fields(known) == []
    assert wrong_fields(known | {field: wrong}) == [field]


def _compared_both_ways(start: Path, candidate: Path) -> list[object]:
    """The comparison of two reports row by row as they are read, and of both read whole; or that it is refused."""
    results: list[object] = []
    for read in (store.read_brief, store.read):
        try:
            results.append(compare(read(start), read(candidate), Policy()).to_json())
        except InputError:
            results.append("refused")
    return results


def _with_seconds(line: str, seconds: str) -> str:
    head, _, rest = line.partition('"seconds":{')
    return f'{head}"seconds":{seconds}{rest[rest.index("}") + 1 :]}'


@pytest.mark.parametrize(
    "edit",
    [
        lambda line: line,
        lambda line: _with_seconds(line, '{"compile":0.1,"run":9.0,"least":8.0,"band":0.02}'),
        lambda line: _with_seconds(line, '{"compile":0.1,"run":7.0,"least":8.0}'),  # faster than its fastest run
        lambda line: _with_seconds(line, '{"run":-1.0}'),
        lambda line: _with_seconds(line, "{}"),
        lambda line: line.replace('"steps":', '"steps":1', 1),
        lambda line: line.replace('"key":', '"other":{"seconds":{"run":1e9}},"key":', 1),
        lambda line: line.replace('"log10":-', '"log10":-1', 1),
        lambda line: line[:-2] + ',"seconds":{"run":77.0}}' if line.endswith("},") else line,
    ],
)
def test_rows_that_differ_in_their_seconds_alone_are_compared_as_those_that_are_read_whole(
    tmp_path: Path, edit: Callable[[str], str]
) -> None:
    start, candidate = tmp_path / "start", tmp_path / "candidate"
    whole = store.read(RESULTS / "peers")
    timed = [row for row in whole.rows if row.outcome == "success" and "least" in row.seconds][:4]
    start.mkdir()
    store.write(replace(whole, rows=timed), start)
    lines = (start / store.FILE).read_text("utf-8").split("\n")
    candidate.mkdir()
    (candidate / store.FILE).write_text("\n".join([lines[0], *map(edit, lines[1:-2]), *lines[-2:]]), "utf-8")
    in_pieces, at_once = _compared_both_ways(start, candidate)
    assert in_pieces == at_once
