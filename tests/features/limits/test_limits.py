"""When digits end, what a test detects, and what lies between samples: against brute force and exact cases."""

import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.cases import CASES
from heavytop.features.limits.power import _MOST_STEPS, _STEP_SECONDS, FAULTS, expected_seconds
from heavytop.integrate.peers.double import Solution, double_peer
from support.helpers import START, TOP
from support.in_process import heavytop

FLIP = ht.HeavyTop(("919/15000", "967/15000", "83/15000"), 0, (0, 0, 0)), ht.State((10, 0, "1e-10"), (0, 0, 1))
LAGRANGE = CASES["lagrange"].top, CASES["lagrange"].start
BODY = ht.Body("2", "9.81", ("0.1", "0", "0.3"), (1, 2, "1.5", "0.1", "-0.1", "0.2"), "pivot")
SLOW = ht.State((0, 0, 1), (1, 0, 0))
SPINNING = ht.State(omega=(1, 2, 3), attitude=ht.Attitude.quaternion(1, 0, 0, 0))


@pytest.mark.slow
def test_digits_of_a_flip_end_where_those_of_runs_do() -> None:
    ends = ht.digits_end(*FLIP, 12)
    assert ends.first is not None
    assert ends.last is not None
    assert ends.first.proven
    assert ends.last.proven
    assert 0 < ends.first.rounded_at < ends.first.time < ends.last.time <= 10
    assert list(ends.digits) == sorted(ends.digits, reverse=True)
    time = [ends.last.time]
    known = ht.reference(*FLIP, time, 20).to_numpy()
    for integrator in ("heyoka", "scipy:DOP853"):
        assert np.abs(ht.propagate(*FLIP, time, integrator=integrator).to_numpy() - known).max() > 0.1


@pytest.mark.slow
def test_digits_of_a_regular_motion_stay_and_an_equilibrium_loses_none() -> None:
    ends = ht.digits_end(*LAGRANGE, 5, "extended")
    assert ends.first is ends.last is None
    assert ends.digits[-1] > 18
    rest = ht.digits_end(ht.HeavyTop((3, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 0), (0, 0, 1)), 5)
    assert min(rest.digits) == rest.of_digits


def test_interpolation_of_a_steady_rotation_is_known_in_closed_form() -> None:
    """γ = (cos t, −sin t, 0): linear 1 − cos(Δ/2), Hermite Δ⁴/384, Lagrange Δ⁴/24 in the end intervals, slerp 0."""
    turning = ht.HeavyTop((2, 2, 1), 0, (0, 0, 0)), SLOW
    found = ht.between_samples(*turning, 10, "1/10", "1e-3")
    assert found.errors["linear"] == pytest.approx(1 - math.cos(0.05), rel=0.01)
    assert found.errors["hermite"] == pytest.approx(0.1**4 / 384, rel=0.01)
    assert found.errors["lagrange"] == pytest.approx(0.1**4 / 24, rel=0.02)
    assert (found.errors["slerp"] or 0) < 1e-14
    assert float(found.largest["linear"] or 0) == pytest.approx(2 * math.acos(1 - 1e-3), rel=0.01)


def test_a_slow_motion_needs_no_sample_but_its_ends() -> None:
    """γ = (cos t, −sin t, 0) up to 1/10: linear 1.3e-3, Hermite 2.6e-7, Lagrange with three intervals 5.2e-8."""
    largest = ht.between_samples(ht.HeavyTop((2, 2, 1), 0, (0, 0, 0)), SLOW, "1/10", "1/10", "1e-2").largest
    whole, third = Fraction(1, 10), Fraction(1, 30)
    assert largest == {"slerp": whole, "linear": whole, "hermite": whole, "lagrange": third}


def test_the_largest_spacing_keeps_to_the_error_and_the_next_does_not() -> None:
    largest = ht.between_samples(TOP, START, 4, "1/10", "1e-4").largest
    for method, spacing in largest.items():
        assert spacing is not None
        count = int(4 / spacing)
        assert (ht.between_samples(TOP, START, 4, Fraction(4, count)).errors[method] or 0) <= 1e-4
        assert (ht.between_samples(TOP, START, 4, Fraction(4, count - 1)).errors[method] or 1) > 1e-4


def test_faults_are_detected_when_brute_force_detects_them() -> None:
    found = ht.power(BODY, SPINNING, 2, "1e-2", "1/20")
    times = [Fraction(k, 20) for k in range(1, 41)]
    right = ht.propagate(BODY, SPINNING, times)
    light = ht.Body("2", "9.8", ("0.1", "0", "0.3"), (1, 2, "1.5", "0.1", "-0.1", "0.2"), "pivot")
    wrong = ht.propagate(light, SPINNING, times)
    values = [np.hstack([run.to_numpy()[:, :3], run.matrices().reshape(-1, 9)]) for run in (right, wrong)]
    errors = (np.abs(values[1] - values[0]) / np.maximum(1, np.abs(values[0]))).max(axis=1)
    by_name = {fault.name: fault for fault in found.faults}
    fault = by_name["gravity_9.8"]
    assert fault.tolerance == pytest.approx(errors.max(), rel=1e-6)
    late = next((time for time, error in zip(times, errors, strict=True) if error > 1e-2), None)
    assert fault.detected_from == late
    assert found.passes
    assert found.error < 1e-12
    assert set(by_name) == set(FAULTS)
    assert by_name["no_gyroscopic_term"].detected_from == times[0]
    assert by_name["float32"].detected_from is None
    assert not found.detects_all
    coarse = ht.power(BODY, SPINNING, 2, "1e-2", "1/20", ["late"], integrator="splitting:2", control="1/64")
    assert 1e-6 < coarse.error < 1e-1, "the control of a method of fixed step is its step"


@pytest.mark.parametrize("moments", [(1, 1, 1), (2, 2, 1)])
def test_a_gyroscopic_term_that_is_0_all_along_is_not_detected(moments: tuple[int, ...]) -> None:
    (fault,) = ht.power(
        ht.HeavyTop(moments, 1, (0, 0, 1)), ht.State((0, 0, 5), (0, 0, 1)), 1, "1e-13", "1/4", ["no_gyroscopic_term"]
    ).faults
    assert fault.detected_from is None


def test_what_changes_nothing_is_not_planted_and_what_is_unknown_is_refused() -> None:
    free = ht.power(*FLIP, 1, "1e-3", "1/4")
    assert set(free.left_out) == {"steiner_forgotten", "steiner_twice", "gravity_9.8"}
    for call, words in (
        (lambda: ht.power(TOP, START, 1, "1e-3", planted="typo"), "Unknown fault 'typo'"),
        (lambda: ht.power(TOP, START, 1, "1e-3", planted=[]), "planted must be names of faults"),
        (lambda: ht.power(TOP, START, 0, "1e-3"), "must be positive"),
        (lambda: ht.power(TOP, START, 1, "1e-3", "1e-7"), "At most 100000 samples"),
        (lambda: ht.between_samples(TOP, START, 1, 2), "at most until"),
        (lambda: ht.between_samples(TOP, START, 1, "1/10", 0), "between 1e-12 and 1"),
        (lambda: ht.between_samples(TOP, START, 1, "1e-6"), "At most 20000 intervals"),
        (lambda: ht.digits_end(TOP, START, 0), "until must be a time other than 0; got 0"),
    ):
        with pytest.raises(ht.InputError, match=words):
            call()


def test_a_tolerance_as_printed_detects_the_fault() -> None:
    test = ht.power(TOP, START, 1, "1e-3", "1/4")
    for name, _, printed in test._table().rows:
        assert ht.power(TOP, START, 1, printed, "1/4", name).detects_all


def test_a_test_of_hours_is_refused_with_an_end_in_reach() -> None:
    with pytest.raises(ht.OutOfReach, match="take about 1e"):
        ht.digits_end(TOP, START, 1e9)
    with pytest.raises(ht.OutOfReach, match=r"up to t = 1e.09 takes about .* steps") as caught:
        ht.power(*LAGRANGE, 10**9, "1e-3")
    earlier = caught.value.remedy.removesuffix(".").split()[-1]
    assert 0.9 * _MOST_STEPS < (expected_seconds(*LAGRANGE, earlier) - 1) / _STEP_SECONDS <= _MOST_STEPS


def test_a_right_run_that_ends_early_has_no_error_but_an_end() -> None:
    stuck = double_peer("stuck", 4, lambda given: Solution([], 0.0, 0, 0), "step")
    test = ht.power(TOP, START, 1, "1e-3", "1/4", "late", integrator=stuck)
    assert not test.passes
    assert "a correct run fails: it does not reach t = 1" in str(test)


def test_the_command_line_says_the_same(tmp_path: Path) -> None:
    done = heavytop("power", "--case", "lagrange", "--until", "1", "--tolerance", "1e-3", "--step", "1/4", "--json")
    case = ht.power(*LAGRANGE, 1, "1e-3", "1/4")
    assert json.loads(done.stdout) == json.loads(json.dumps(case.to_json()))
    assert done.returncode == 1
    asked = ("propagate", "--case", "lagrange", "--times", "1")
    known = heavytop(*asked, "--between", "1/10", "--within", "1e-3", "--json")
    assert set(json.loads(known.stdout)["between"]["errors"]) == {"slerp", "linear", "hermite", "lagrange"}
    assert heavytop(*asked, "--within", "1").returncode == 2
    assert heavytop("power", "--until", "1", "--tolerance", "1").returncode == 2
    for of_file in (("--gravity", "3"), ("--omega", "1,2,3"), ("--quaternion", "0,1,0,0"), ("--link", "arm")):
        assert heavytop("power", "--case", "lagrange", "--until", "1", "--tolerance", "1", *of_file).returncode == 2


def test_pictures_show_each_fault_each_method_and_each_axis() -> None:
    test = ht.power(*FLIP, 1, "1e-3", "1/4")
    assert len(ht.plot.power(test).lines) == len(test.faults) + 1
    samples = [ht.between_samples(*FLIP, 1, spacing) for spacing in ("1/10", "1/20")]
    assert {line.get_label() for line in ht.plot.between(samples).lines} == {"slerp", "linear", "hermite", "lagrange"}
    assert len(ht.plot.between(samples[0]).lines) == 4
    tensor = ("1.72", "2.28", 2, "0.96", 0, 0)  # moments 1, 2, 3 in turned axes
    for body in (ht.HeavyTop((1, 2, 3), 0, (0, 0, 0)), ht.Body(1, 0, (0, 0, 0), tensor)):
        words = [text.get_text() for text in ht.plot.stability(body).texts]
        assert len(words) == 6
        assert sum(word.endswith(": unstable 0.577") for word in words) == 2
    shown = [text.get_text() for text in ht.plot.stability(ht.HeavyTop((2, 2, 3), 0, (0, 0, 0))).texts]
    assert sum(word.endswith(": unstable") for word in shown) == 4  # it turns away in proportion to t: no rate


def test_a_spacing_that_is_reduced_is_said_to_be() -> None:
    words = ("propagate", "--case", "generic", "--times", "1", "--between")
    assert "0.25 apart (0.3, reduced to a divisor of the last time)" in heavytop(*words, "0.3").stdout
    assert "reduced" not in heavytop(*words, "0.25").stdout


@pytest.mark.parametrize(
    "body",
    [
        ht.HeavyTop((1, 2, 2), 1, (1, 0, 0)),
        ht.Body("2", "9.81", ("0.1", "0", "0.3"), (1, 2, "1.5", 0, "-0.1", 0), "pivot"),
    ],
)
def test_a_tensor_whose_exchanged_entries_are_equal_has_no_such_fault(body: ht.HeavyTop | ht.Body) -> None:
    found = ht.power(body, SPINNING, 1, "1e-3", planted=["tensor_order"])
    assert (found.faults, found.left_out) == ((), {"tensor_order": "the entries that it exchanges are equal"})
