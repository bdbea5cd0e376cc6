"""Errors of single steps: a healthy step is right to an ulp, and a method's order shows beyond its step."""

from dataclasses import replace
from fractions import Fraction
from itertools import accumulate, pairwise

import numpy
import pytest

from heavytop.api.faulty_integrators import FAULTS
from heavytop.cases import CASES
from heavytop.errors import PeerFailed
from heavytop.features.local_error.measurement import LocalError, single_calls
from heavytop.integrate.heyoka.motions import first_steps, propagate
from heavytop.integrate.registry import Integrator, described
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import DOUBLE, EXTENDED, QUAD, exact
from heavytop.top.heavy_top import HeavyTop, State


def examined(run, steps):
    """The metrics of (time, step) pairs."""
    error = LocalError(run.problem)
    for time, step in steps:
        error(time, step)
    return error.metrics()


def stepped(name, until, precision=DOUBLE, by=first_steps, **options):
    """A run of a case and its (time, step) pairs."""
    case = CASES[name]
    run, steps = by(case.top, case.start, until, precision, system=case.system, **options)
    return run, list(zip(run.times, steps, strict=True))


def called(integrator, name, until, precision=DOUBLE):
    """A run of a case by an integrator of that name, and its single calls."""
    case = CASES[name]
    return single_calls(described(integrator), case.top, case.start, Fraction(until), precision, case.system)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "precision"), [("kovalevskaya", DOUBLE), ("gyrostat", EXTENDED), ("euler", QUAD)])
def test_a_step_is_right_to_an_ulp_and_of_the_order_that_heyoka_says(name, precision) -> None:
    run, steps = stepped(name, 2, precision)
    found = examined(run, steps)
    assert run.outcome is Outcome.SUCCESS
    assert 0 < float(found["local_error_ulp_rms"].value) <= float(found["local_error_ulp_max"].value) < 2
    assert found["observed_order"].value == str(run.order)


@pytest.mark.slow
@pytest.mark.parametrize(("digits", "order"), [(6, 8), (12, 15)])
def test_the_order_is_that_of_the_tolerance(digits, order) -> None:
    run, steps = stepped("lagrange", 2, tolerance=Fraction(1, 10**digits))
    assert run.order == order
    assert examined(run, steps)["observed_order"].value == str(order)


def test_a_step_that_is_off_by_ten_ulps_is_seen_as_that() -> None:
    run, ((time, step),) = stepped("kovalevskaya", Fraction(1, 100))
    off = step.end.copy()
    off[4] += 10 * numpy.finfo(float).eps * abs(step.start).max()
    good, bad = (
        float(examined(run, [(time, replace(step, end=end))])["local_error_ulp_max"].value) for end in (step.end, off)
    )
    assert 10 - good <= bad <= 10 + good


@pytest.mark.slow
def test_one_order_less_shows_in_the_order_alone() -> None:
    asked = (first_steps, FAULTS["order"].first_steps)
    healthy, broken = (examined(*stepped("generic", 4, by=steps)) for steps in asked)
    assert (healthy["observed_order"].value, broken["observed_order"].value) == ("20", "19")


def test_steps_are_those_of_a_run() -> None:
    run, pairs = stepped("euler", 2)
    steps = [step for _, step in pairs]
    assert float(run.times[-2]) < 2 <= float(run.times[-1])
    lengths = [exact(step.length) for step in steps]
    assert [float(time) for time in run.times] == pytest.approx([float(time) for time in accumulate(lengths)])
    for before, after in pairwise(steps):
        assert (before.end == after.start).all()


def test_an_equilibrium_has_no_steps() -> None:
    top = HeavyTop((3, 2, 1), 1, (0, 0, 1))
    run, steps = first_steps(top, State((0, 0, 0), (0, 0, 1)), 5, DOUBLE)
    assert (run.outcome, steps) == (Outcome.SUCCESS, [])
    assert LocalError(run.problem).metrics()["observed_order"].value == "missing"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "order"), [("splitting:2", 2), ("splitting:8", 8)])
def test_a_method_with_fixed_steps_shows_its_order_in_longer_ones(name, order) -> None:
    run, calls = called(name, "generic", 4)
    found = examined(run, calls)
    assert found["observed_order"].value == str(order)
    assert all(call.length == Fraction(1 / 100) for _, call in calls)
    assert [time - call.length for time, call in calls] == [Fraction(i, 4) for i in range(16)]


@pytest.mark.slow
def test_an_error_of_a_call_is_that_of_one_step_from_where_it_starts() -> None:
    run, calls = called("splitting:2", "euler", 1)
    size, worst = Fraction(0), Fraction(0)
    for _, call in calls:
        begin = State(*(tuple(map(exact, call.start[i : i + 3])) for i in (0, 3)))
        (there,) = propagate(run.problem.top, begin, [call.length], QUAD).states
        size = max(map(abs, (exact(value) for value in call.start)))
        gap = max(abs(exact(a) - exact(b)) for a, b in zip(call.end, there, strict=True))
        worst = max(worst, gap / size / DOUBLE.eps)
    assert float(examined(run, calls)["local_error_ulp_max"].value) == pytest.approx(float(worst), rel=1e-7)


@pytest.mark.slow
def test_an_integrator_with_a_tolerance_is_called_over_its_mean_step_and_shows_no_order() -> None:
    run, calls = called("multiword", "lagrange", 4, EXTENDED)
    found = examined(run, calls)
    assert float(calls[0][1].length) == pytest.approx(4 / run.steps)
    assert found.keys() == {"local_error_ulp_max", "local_error_ulp_rms"}
    assert 0 < float(found["local_error_ulp_max"].value) < 2


@pytest.mark.slow
@pytest.mark.parametrize(("name", "times"), [("splitting:2", 1000), ("splitting:2", 2), ("multiword", 0)])
def test_a_count_of_steps_makes_no_step_of_a_given_length_shorter_and_none_at_all_is_refused(
    name, times, monkeypatch
) -> None:
    propagate = Integrator.propagate
    _, honest = called(name, "lagrange", 1)

    def miscounted(self, *given, **options):
        run = propagate(self, *given, **options)
        return replace(run, steps=run.steps * times)

    monkeypatch.setattr(Integrator, "propagate", miscounted)
    if not times:
        with pytest.raises(PeerFailed, match=f"{name} moved, but reports 0 steps"):
            called(name, "lagrange", 1)
        return
    _, calls = called(name, "lagrange", 1)
    assert [(call.length, *call.end) for _, call in calls] == [(call.length, *call.end) for _, call in honest]


@pytest.mark.slow
def test_longer_steps_do_not_depend_on_the_unit_of_time() -> None:
    """Ω → s Ω, t → t/s, P → s² P is the same motion."""
    case = CASES["generic"]
    asked = []
    for scale in (Fraction(1), Fraction(10) ** 30, Fraction(3, 10**20)):
        top = HeavyTop(case.top.inertia, scale**2 * case.top.weight, case.top.centre)
        start = State([scale * omega for omega in case.start.omega], case.start.gamma)
        integrator = described("splitting:4", ("step", Fraction(1, 10) / scale))
        _, calls = single_calls(integrator, top, start, 2 / scale, DOUBLE, case.system)
        asked.append([tuple(call.further) for _, call in calls])
    assert asked == [[(2, 4, 8, 16)] * 16] * 3
