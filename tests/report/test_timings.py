"""Seconds of a plan with `timings = true`: compared on one machine with one set of versions, beyond their scatter."""

from pathlib import Path

import pytest

from heavytop.errors import InputError
from heavytop.features.work_precision import kind as work_precision
from heavytop.measure.integrator import Repeats
from heavytop.records import Row
from heavytop.report.compare.noise import Policy, Timings
from support.reports import asked, compare, measure, replace, tasks_of
from support.small_reports import report, row

ENVIRONMENT = {
    "packages": {"heavytop": "1", "heyoka": "7"},
    "flint": "3",
    "python": "3.12",
    "implementation": "CPython",
    "system": "Linux",
    "machine": "x86_64",
    "processor": "A",
    "simd_width_double": 4,
    "cpu_features": ["avx"],
    "cpu_target": "a",
    "llvm": "20",
}
SECONDS = {"compile": 0.1, "run": 1.1e-4, "least": 1e-4, "repeats": 11.0, "band": 0.02}


def judged(new: dict, old: dict = SECONDS, environment: dict = ENVIRONMENT, **policy) -> tuple[str, str]:
    before = replace(report(row(seconds=old)), environment=ENVIRONMENT)
    after = replace(report(row(seconds=new)), environment=environment)
    result = compare(before, after, Policy(**policy))
    return result.verdict, "; ".join(f"{finding.metric}: {finding.reason}" for finding in result.changed)


def slower(factor: float, *names: str) -> dict:
    return SECONDS | {name: SECONDS[name] * factor for name in names or ("run", "least")}


def test_a_hundred_times_slower_is_worse_however_short_and_five_per_cent_are_the_same() -> None:
    assert judged(slower(100))[0] == "worse"
    assert "seconds run: 100 times as long; 1.5 is allowed" in judged(slower(100))[1]
    for factor in (1.05, 1.49, 0.95, 0.68):
        assert judged(slower(factor)) == ("same", "")
    assert judged(slower(1.51))[0] == "worse"
    assert judged(slower(0.66))[0] == "better"
    assert judged(slower(1.51), timings=Timings(ratio=2.0))[0] == "same"


def test_what_runs_of_the_baseline_scatter_by_is_allowed_and_what_the_candidate_s_do_is_not() -> None:
    # twice √2 · 0.1 decades: 1.918
    assert judged(slower(1.90), SECONDS | {"band": 0.1})[0] == "same"
    assert judged(slower(1.94), SECONDS | {"band": 0.1})[0] == "worse"
    assert judged(slower(1.90) | {"band": 0.1})[0] == "worse"
    assert judged(slower(1.94), SECONDS | {"band": 0.1}, noise=2.1)[0] == "same"


@pytest.mark.parametrize(("band", "verdict"), [(0.249, "same"), (0.251, "incomparable")])
def test_runs_that_scatter_widely_say_nothing(band: float, verdict: str) -> None:
    assert judged(SECONDS, SECONDS | {"band": band})[0] == verdict
    assert judged(SECONDS | {"band": band})[0] == verdict


@pytest.mark.parametrize("name", ["run", "least", "band"])
def test_what_is_no_longer_measured_is_incomparable(name: str) -> None:
    without = {key: value for key, value in SECONDS.items() if key != name}
    assert judged(without) == ("incomparable", f"seconds {name}: its runs are no longer repeated")
    assert judged({})[0] == "incomparable"
    # those of a baseline that was not timed for it say nothing
    assert judged(slower(100), {key: value for key, value in SECONDS.items() if key != "band"})[0] == "same"


@pytest.mark.parametrize("value", [0.0, float("inf"), float("nan")])
def test_a_run_that_took_no_time_is_none(value: float) -> None:
    assert judged(SECONDS | {"least": value})[0] == "incomparable"


LADDERS = [{"integrator": "heyoka", "tolerances": ["1e-6"]}]
PLAN = asked("work_precision", "euler", horizon="20", samples=4, ladders=LADDERS)


def ran(folder: Path, more: str) -> Row:
    (task,) = tasks_of(folder, PLAN + more)
    return measure(task)


@pytest.mark.slow
def test_a_plan_asks_for_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work_precision, "_USUAL", Repeats(3, 100, 0.0))
    monkeypatch.setattr(work_precision, "_FOR_COMPARISON", Repeats(11, 20, 0.0, 3, band=True))
    plain, timed = ran(tmp_path, ""), ran(tmp_path, "timings = true\n")
    assert plain.seconds.keys() == {"compile", "run", "least", "repeats"}
    assert timed.seconds.keys() == {*plain.seconds, "band"}
    assert timed.seconds["repeats"] == 11
    assert 0 <= timed.seconds["band"] < 2
    with pytest.raises(InputError, match="true or false"):
        ran(tmp_path, "timings = 1\n")


def test_the_band_holds_the_middle_of_the_runs() -> None:
    class Run:
        outcome = work_precision.Outcome.SUCCESS

        def __init__(self, seconds: float) -> None:
            self.seconds = {"run": seconds}

    def spent(how: Repeats, *seconds: float) -> dict[str, float]:
        return work_precision.timed(lambda number: Run(seconds[number - 1]), how)[0]

    ten = spent(Repeats(11, 11, 0.0, 3, band=True), 1e-3, *[2e-3] * 9, 4e-3)
    assert (ten["run"], ten["least"], ten["repeats"]) == (2e-3, 1e-3, 11)
    assert ten["band"] == pytest.approx(0.2258, abs=1e-4)
    # a run that takes long is timed once, or three times where it is for a comparison
    assert spent(Repeats(11, 11, 0.0), 3.1)["repeats"] == 1
    assert spent(Repeats(11, 11, 0.0, 3, band=True), 3.1, 3.2, 3.3)["repeats"] == 3
    assert "band" not in spent(Repeats(11, 11, 0.0), *[1.0] * 11)


ALWAYS = {"timings": Timings("always", ratio=2, floor=0.0)}
PLAIN = {"compile": 0.1, "run": 2.0, "least": 1.0, "repeats": 34.0, "reference": 0.5, "program": 0.9}


def plainly(**seconds: float) -> tuple[str, str]:
    return judged(PLAIN | seconds, PLAIN, **ALWAYS)


def test_the_fastest_run_counts_since_other_work_only_adds() -> None:
    assert plainly(run=2.0 * 71 / 34) == ("same", "")
    assert plainly(least=2.1, run=2.1) == ("worse", "seconds run: 2.1 times as long")
    alone = {"compile": 0.1, "run": 1.0}  # a single run, beside whatever else ran then
    assert judged({"compile": 9.0, "run": 210.0}, alone, **ALWAYS) == ("same", "")


def test_seconds_below_the_floor_are_equal_and_the_ratio_said_is_theirs() -> None:
    floor = {"timings": Timings("always", ratio=2, floor=0.01)}
    assert judged(PLAIN | {"least": 0.009}, PLAIN | {"least": 0.001}, **floor) == ("same", "")
    slow = judged(PLAIN | {"least": 2.95}, PLAIN | {"least": 0.001}, **floor)
    assert slow == ("worse", "seconds run: 2950 times as long")


def test_seconds_that_are_not_resolved_are_as_many_as_are() -> None:
    quick = SECONDS | {"run": 3e-5, "least": 1.4e-5, "unresolved": 1e-4, "band": 0.4}
    other = quick | {"run": 9e-5, "least": 6e-5}
    assert judged(other, quick) == judged(quick, other) == ("same", "")
    assert judged(SECONDS | {"run": 1.4e-4, "least": 1.2e-4}, quick) == ("same", "")
    slower = judged(SECONDS | {"run": 1.4e-3, "least": 1.2e-3}, quick)
    assert (slower[0], "at least 14 times as long" in slower[1]) == ("worse", True)
    assert judged(quick, SECONDS | {"run": 1.4e-3, "least": 1.2e-3})[0] == "better"
    assert judged(other, quick, **ALWAYS) == ("same", "")
