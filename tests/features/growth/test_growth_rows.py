"""Rows of growth measurements, with small ensembles: what they hold, what they are held against, what is refused."""

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import msgspec
import numpy
import pytest

from heavytop.cases import CASES
from heavytop.errors import InputError
from heavytop.exact.catalogue import matches
from heavytop.features.growth import kind as growth
from heavytop.harness.case_text import ensemble_of
from heavytop.harness.checkpoint import Saved
from heavytop.integrate import registry
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.registry import Integrator
from heavytop.integrate.trajectory import Problem
from heavytop.measure import truth
from heavytop.measure.truth import reference
from heavytop.precision import DOUBLE, cross
from heavytop.report.compare.noise import Policy
from heavytop.top.equations import GYROSTAT, holding
from support.helpers import shown
from support.reports import compare, expand, load, measure, summary, tasks_of
from support.small_reports import report

CLASSES = ("euler", "lagrange", "kovalevskaya", "generic", "gyrostat")


def tasks(tmp_path: Path, cases: str, run: str):
    return tasks_of(tmp_path, f'name = "own"\n[[measure]]\nkind = "growth"\ncases = [{cases}]\nruns = [{{ {run} }}]\n')


def row(tmp_path: Path, case: str, run: str):
    (task,) = tasks(tmp_path, f'"{case}"', f'precision = "double", {run}')
    return measure(task)


@pytest.mark.slow
@pytest.mark.parametrize("name", CLASSES)
def test_random_starts_are_exact_of_the_class_and_the_same_for_the_same_seed(name: str) -> None:
    case = CASES[name]
    members = ensemble_of(case, 20, 3)
    assert members == ensemble_of(case, 30, 3)[:20]
    assert len({start.flat for _, start in (*members, *ensemble_of(case, 20, 4))}) == 40
    known = [type(form) for form in matches(case.top, case.start, case.system)]
    for top, start in members:
        assert top == case.top
        start.require_unit_gamma()
        assert max(abs(w) for w in start.omega) <= 3 * max(abs(w) for w in case.start.omega)
        assert [type(form) for form in matches(case.top, start, case.system)] == known
        assert [i.name for i in holding(case.top, start, case.system)] == [
            i.name for i in holding(case.top, case.start, case.system)
        ]
        if case.system is GYROSTAT:
            assert not any(cross(case.top.angular_momentum(start.omega), start.gamma))


@pytest.mark.parametrize(
    "name",
    ["pendulum", "delone", "ershkov-partial-2", "hess", "steklov", "goryachev-chaplygin", "kovalevskaya-asymptotic"],
)
def test_a_special_motion_is_taken_with_other_roundings(name: str) -> None:
    case = CASES[name]
    members = ensemble_of(case, 20, 3)
    assert len({top for top, _ in (*members, *ensemble_of(case, 20, 4))}) == 40
    p = case.system.parameters(case.top, case.start)
    for top, start in members:
        assert start == case.start
        assert case.system.field(case.system.parameters(top, start), start.flat) == case.system.field(p, start.flat)
    with pytest.raises(InputError, match="must be at most 16384; got 16385"):
        ensemble_of(case, 2**14 + 1, 1)


@pytest.mark.slow
def test_the_roundings_of_one_motion_have_one_reference(tmp_path: Path) -> None:
    found = row(tmp_path, "hess-pendulum", 'horizon = "60", starts = 9, samples = 8, decades = 2')
    assert found.measured.endswith("9 roundings of one motion, root mean square over them")
    assert "9 of 9 starts certified at t = 2" in found.against
    law = found.laws["solution_error_across"]
    assert law.growth == "exponential"
    assert None not in (law.low, law.exponent)
    (task,) = tasks(tmp_path, '"hess-pendulum"', 'precision = "double", horizon = "60", starts = 9')
    problems = tuple(Problem.of(*member, DOUBLE) for member in ensemble_of(task.given, 9, 1))
    truths = reference(problems, (Fraction(1), Fraction(2))).motions
    assert len(set(map(id, truths))) == 1


@pytest.mark.slow
def test_integrals_walk_and_the_phase_grows_faster(tmp_path: Path) -> None:
    found = row(tmp_path, "gyrostat", 'horizon = "1e4", starts = 24, samples = 8')
    assert (found.outcome, found.finite, found.starts) == ("success", True, 24)
    assert found.metrics["starts_failed"].value == "0"
    assert "24 of 24 starts certified at t = 2" in found.against
    assert found.against.startswith("known: closed form: gyrostat")
    assert (
        set(found.laws)
        == set(found.series)
        == {
            *(f"drift_{name}" for name in ("gamma_squared", "area", "momentum_squared", "gyrostat_energy")),
            *(f"solution_error_{name}" for name in ("along", "across", "omega", "gamma")),
        }
    )
    for name in ("drift_area", "drift_momentum_squared", "solution_error_across"):
        law = found.laws[name]
        assert law.growth == "t^0.5"
        assert law.low < law.exponent < law.high
        # one rounding is 1e-16; over 20000 steps a thousandth of it each time would have been told
        assert Fraction(1, 10**22) < Fraction(law.detects) < Fraction(1, 10**17)
    assert found.laws["solution_error_along"].growth == "t^1.5"
    final = found.metrics["drift_area_final"]
    assert Fraction(final.value) <= Fraction(found.metrics["drift_area_max"].value) < Fraction(1, 10**12)
    assert 0 < final.band < 0.5
    assert found.series["drift_area"].values[-1] == final.value
    assert found.series["drift_area"].times[-1] == found.horizon == "10000"


@pytest.mark.slow
def test_other_roundings_of_the_same_starts_are_the_same_law_and_no_alarm(tmp_path: Path) -> None:
    text = 'horizon = "2e3", starts = 16'
    (task,) = tasks(tmp_path, '"lagrange"', f'precision = "double", {text}')
    rows = [measure(replace(task, seed=seed)) for seed in (0, 5)]
    assert rows[0].metrics != rows[1].metrics
    assert rows[0].key == rows[1].key
    assert compare(*map(report, rows), Policy()).verdict == "same"


@pytest.mark.slow
def test_an_integrator_that_truncates_makes_integrals_grow_like_t(tmp_path: Path) -> None:
    found = row(tmp_path, "lagrange", 'horizon = "1e5", starts = 12, samples = 8, decades = 4, tolerance = "1e-9"')
    assert found.integrator.endswith(" tolerance 1e-9")
    assert found.laws["drift_energy"].growth == "t"
    assert found.laws["solution_error_along"].growth == "t^2"


@pytest.mark.slow
def test_a_wrong_coefficient_is_seen_as_bounded_integrals_and_a_phase_like_t(tmp_path: Path) -> None:
    found = row(tmp_path, "euler", 'horizon = "2e3", starts = 12, samples = 8, decades = 4, bias = "1e-12"')
    assert found.flags["bias"] == "1e-12"
    law = found.laws["drift_energy"]
    assert law.growth == "bounded"
    assert law.lost_at is None
    assert Fraction(1, 10**14) < Fraction(found.metrics["drift_energy_max"].value) < Fraction(1, 10**11)
    assert found.laws["solution_error_along"].growth == "t"


@pytest.mark.slow
def test_chaos_is_exponential_and_takes_every_digit(tmp_path: Path) -> None:
    found = row(tmp_path, "generic", 'horizon = "600", starts = 12, samples = 24, reference = "extended"')
    assert "computed, not proven: words of 106 and 176 bits agree within" in found.against
    ends = found.reference.until
    assert f"all significant digits are lost from t = {ends} on" in found.against
    assert 200 < Fraction(ends) < 600
    assert Fraction(found.series["solution_error_along"].times[-1]) < Fraction(ends)
    assert found.series["drift_energy"].times[-1] == "600"
    law = found.laws["solution_error_along"]
    assert law.growth == "exponential"
    assert 0.02 < law.low < law.exponent < law.high < 0.3
    assert 100 < float(law.lost_at) < 600
    assert found.laws["drift_energy"].growth in ("t^0.5", "unresolved")


@pytest.mark.slow
def test_what_takes_too_long_to_compute_has_drift_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(truth, "EFFORT_OF_MANY", 1e-3)
    found = row(tmp_path, "generic", 'horizon = "20", starts = 8, decades = 2')
    assert set(found.laws) == {f"drift_{name}" for name in ("gamma_squared", "area", "energy")}
    assert {law.growth for law in found.laws.values()} == {"unresolved"}
    assert "no closed form" in found.against


@pytest.mark.slow
def test_failed_starts_are_counted_and_never_averaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def with_a_wild_one(case, count, seed):
        (top, first), *rest = ensemble_of(case, count, seed)
        return [(top, type(first)([Fraction(10) ** 140, Fraction(10) ** 140, 1], first.gamma)), *rest]

    plain = row(tmp_path, "lagrange", 'horizon = "20", starts = 10, decades = 2')
    monkeypatch.setattr(registry, "MOST_STEPS", 10**400)  # so that what overflows is tried
    monkeypatch.setattr(growth, "ensemble_of", with_a_wild_one)
    found = row(tmp_path, "lagrange", 'horizon = "20", starts = 10, decades = 2')
    assert plain.metrics["starts_failed"].value == "0"
    assert found.metrics["starts_failed"].value == "1"
    assert (found.outcome, found.finite, found.time_reached) == ("non_finite", False, "0")
    assert found.laws["drift_energy"].starts == 9
    assert Fraction(found.metrics["drift_energy_max"].value) < Fraction(1, 10**13)


@pytest.mark.slow
def test_the_laws_are_said_in_words(tmp_path: Path) -> None:
    (task,) = tasks(tmp_path, '"kovalevskaya"', 'precision = "double", horizon = "5e2", starts = 9, decades = 3')
    text = shown(summary(report(measure(task.of(replace(task.case, name="mine"))))), 160)
    assert "Growth laws" in text
    (line,) = [line for line in text.splitlines() if "energy" in line]
    assert line.split()[:5] == ["mine", "double", "energy", "9", "t^0.5"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"horizon": "0"}, "horizon"),
        ({"starts": 0}, "starts must be from 1 to 100000; got 0"),
        ({"samples": 1}, "samples must be from 4 to 1000; got 1"),
        ({"decades": 99}, "decades must be from 1 to 12; got 99"),
        ({"tolerance": "-1"}, "tolerance"),
        ({"bias": "x"}, "not a finite number"),
        ({"precision": "extended", "reference": "double"}, "reference must have more bits; got double"),
        ({"precision": "real:2000"}, "up to real:900"),
        ({"wrong": 1}, "wrong"),
    ],
)
def test_an_impossible_ensemble_is_refused(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    run = {"precision": "double", "horizon": "10"} | changes
    with pytest.raises(InputError, match=message):
        tasks(tmp_path, '"generic"', ", ".join(f"{key} = {json.dumps(value)}" for key, value in run.items()))


@pytest.mark.slow
def test_the_plan_growth_plants_its_faults() -> None:
    runs = [task.options for task in expand(load("growth")[0])]
    assert {run.tolerance for run in runs} == {None, "1e-9"}
    assert {run.bias for run in runs} == {None, "1e-12"}
    assert {run.high_accuracy for run in runs} == {False, True}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "run"),
    [
        ("euler", 'precision = "double", horizon = "20", starts = 9, samples = 4'),
        ("generic", 'precision = "double", horizon = "10", starts = 6, samples = 4, reference = "extended"'),
    ],
)
def test_a_row_goes_on_behind_the_starts_that_are_done(tmp_path: Path, monkeypatch, case: str, run: str) -> None:
    (task,) = tasks(tmp_path, f'"{case}"', run)
    whole = measure(task)

    class Killed(Exception):
        pass

    class Dying(Saved):
        """Dies as a kill would, behind its third save and behind each third one after."""

        saves = 0

        def save(self, content: dict) -> None:
            super().save(content)
            self.saves += 1
            if self.saves == 3:
                raise Killed

    asked = []

    def watched(_, problems, times, observer=None, finished=None, **options):
        if finished:
            asked.append(len(problems))
        return propagate_ensemble(problems, times, observer=observer, finished=finished, **options)

    monkeypatch.setattr(Integrator, "propagate_many", watched)
    path = tmp_path / "row-0.partial"
    deaths = 0
    while True:
        try:
            row = measure(task, Dying(path, "this plan", every=0))
            break
        except Killed:
            deaths += 1
    assert deaths == task.options.starts // 3
    assert asked[0] == task.options.starts
    # what was done is not done again
    assert asked[-1] <= 3
    assert msgspec.structs.replace(row, seconds={}) == msgspec.structs.replace(whole, seconds={})


def _with_a_nan(_, problems, times, observer, finished, **options):
    def spoilt(index, time, state):
        observer(index, time, state * numpy.nan if (index, time) == (0, times[-1]) else state)

    return propagate_ensemble(problems, times, observer=spoilt, finished=finished, **options)


@pytest.mark.slow
def test_a_start_that_is_not_finite_is_kept_as_it_is(tmp_path: Path, monkeypatch) -> None:
    (task,) = tasks(tmp_path, '"euler"', 'precision = "double", horizon = "20", starts = 9, samples = 4')
    monkeypatch.setattr(Integrator, "propagate_many", _with_a_nan)
    saved = Saved(tmp_path / "row-0.partial", "this plan", every=0)
    one = measure(task, saved)
    again = measure(task, saved)
    assert msgspec.structs.replace(one, seconds={}) == msgspec.structs.replace(again, seconds={})
    assert (one.outcome, one.finite, one.metrics["starts_failed"].value) == ("non_finite", False, "1")
    assert one.laws["drift_energy"].starts == 8
