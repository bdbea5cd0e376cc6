"""A run of more steps than anyone waits for is refused, by every door and in every unit; any other is taken."""

from fractions import Fraction
from time import perf_counter

import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.integrate.multiword.engines import choose
from heavytop.integrate.multiword.motions import _require_reach
from heavytop.integrate.registry import INTEGRATORS, MOST_STEPS, require_reach
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.multiword.fixed_point.fixed_point_run import LONGEST_STEP
from heavytop.top.equations import square_of_rate
from support.helpers import in_units
from support.reports import expand, plan_of, rows

TOP = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
LEANING = ("3/5", 0, "4/5")
DATA = ["--inertia", "3,2,1", "--weight", "1", "--centre", "1/2,1/3,1/5", "--gamma", "3/5,0,4/5"]
FAST = {
    "spin": (ht.HeavyTop((2, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 1), LEANING)),
    "weight": (ht.HeavyTop((2, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 0), LEANING)),
    "pendulum about a short axis": (ht.HeavyTop((1, 1, "1e-8"), "1e-8", (1, 0, 0)), ht.State((0, 0, 0), LEANING[::-1])),
    "precession of unequal moments": (ht.HeavyTop((2, "1e-8", 1), 0, (0, 0, 0)), ht.State((0, 0, "1.4e-4"), LEANING)),
}
"""Motions that change at a rate of about 1 in units of time of 1, each for another reason."""


def given(top: ht.HeavyTop, start: ht.State) -> Problem:
    return Problem.of(top, start, ht.DOUBLE)


@pytest.mark.parametrize("name", FAST)
@pytest.mark.parametrize("decades", [-70, -12, 0, 12, 70])
def test_what_counts_is_time_by_rate_in_any_unit(name: str, decades: int) -> None:
    rate = Fraction(10) ** decades
    problem = given(*in_units(*FAST[name], rate))
    far = MOST_STEPS / rate
    assert 0.3 < float(square_of_rate(problem.system, problem.parameters, problem.start.flat) / rate**2) < 3
    for direction in (1, -1):
        require_reach(problem, direction * far / 2)
        with pytest.raises(ht.OutOfReach, match=r"takes about 1e12 steps"):
            require_reach(problem, direction * far * 4)


@pytest.mark.slow
def test_the_bound_is_the_time_by_the_rate_or_over_the_step_exactly() -> None:
    problem = given(*FAST["spin"])
    require_reach(problem, Fraction(MOST_STEPS))
    require_reach(problem, Fraction(MOST_STEPS), step=Fraction(1))
    for step in (None, Fraction(1)):
        with pytest.raises(ht.OutOfReach):
            require_reach(problem, Fraction(MOST_STEPS + 1), step=step)
    with pytest.raises(ht.OutOfReach, match="1e100000 steps"):
        require_reach(problem, Fraction(1), step=Fraction(1, 10**100_000))
    require_reach(problem, Fraction(10) ** 30, step=Fraction(10) ** 20)


def test_the_rate_is_that_of_the_steps_that_are_taken() -> None:
    for name in ("spin", "weight"):
        top, start = FAST[name]
        run = ht.propagate(top, start, [2000])
        assert 1 < run.steps / 2000 < 10


def test_a_gyrostat_is_not_driven_by_its_weight_but_by_its_rotor() -> None:
    heavy = ht.HeavyTop((2, 2, 1), 10**6, (0, 1, 0)), ht.State((0, 1, 0), (0, 1, 0))
    p = ht.GYROSTAT.parameters(*heavy)
    assert square_of_rate(ht.GYROSTAT, p, heavy[1].flat) == Fraction(10**6, 2) ** 2
    light = ht.HeavyTop((2, 2, 1), 10**6, (0, 0, 0)), heavy[1]
    assert square_of_rate(ht.GYROSTAT, ht.GYROSTAT.parameters(*light), heavy[1].flat) == 1


@pytest.mark.parametrize("name", ["heyoka", "multiword", "splitting:4", "mpmath:odefun"])
def test_every_integrator_is_refused_from_python(name: str) -> None:
    with pytest.raises(ht.OutOfReach, match="takes about 1e16 steps"):
        ht.propagate(TOP, START, [1, "2e16"], integrator=name)
    if INTEGRATORS[name].streams:
        with pytest.raises(ht.OutOfReach):
            ht.ensemble([FAST["spin"][0], TOP], [ht.State((0, 0, 0), (0, 0, 1)), START], ["2e16"], integrator=name)


def test_what_rests_and_what_a_limit_ends_is_taken() -> None:
    still = ht.propagate(ht.HeavyTop((2, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 5), (0, 0, 1)), ["1e140"])
    assert still.outcome is Outcome.SUCCESS
    limited = ht.propagate(TOP, START, ["1e140"], step_limit=7)
    assert (limited.outcome, limited.steps) == (Outcome.STEP_LIMIT, 7)
    with pytest.raises(ht.OutOfReach):
        ht.propagate(TOP, START, ["1e140"], step_limit=10**15)
    slow = in_units(TOP, START, Fraction(1, 10**20))
    assert ht.propagate(*slow, ["2e20"], integrator="multiword").outcome is Outcome.SUCCESS


@pytest.mark.parametrize(("omega", "time"), [("1/10,2/5,9/10", "9e18"), ("1e-6,1,0", "-9e12"), ("0,0,1e150", "10")])
def test_the_command_line_says_so_with_exit_3(omega: str, time: str) -> None:
    began = perf_counter()
    done = CliRunner().invoke(app, ["propagate", *DATA, "--omega", omega, "--times", time])
    assert isinstance(done.exception, ht.OutOfReach)
    assert done.exception.exit_code == 3
    assert perf_counter() - began < 5


def test_rows_of_every_kind_that_integrates_are_out_of_reach() -> None:
    top = {"name": "fast", "inertia": ["2", "2", "1"], "weight": "1", "centre": ["0", "0", "1"]}
    top |= {"omega": ["0", "0", "1e150"], "gamma": ["3/5", "0", "4/5"]}
    run, at_once = {"precision": "double", "horizon": "10"}, {"cases": ["fast"], "horizon": "10"}
    kinds = [
        {"kind": "drift", "cases": ["fast"], "runs": [run | {"samples": 5}]},
        {"kind": "growth", "cases": ["fast"], "runs": [run | {"starts": 8}]},
        at_once | {"kind": "local_error", "precisions": ["double"]},
        *(
            at_once | {"kind": "work_precision", "cases": [case], "ladders": [{"integrator": "splitting:2"} | control]}
            for case, control in (("fast", {"tolerances": ["eps"]}), ("euler", {"steps": ["1e-100"]}))
        ),
    ]
    began = perf_counter()
    found = list(rows(expand(plan_of({"name": "far", "top": [top], "measure": kinds})), 1, None))
    assert perf_counter() - began < 5
    assert len(found) == 5
    assert {row.outcome for _, row in found} == {"out_of_reach"}
    assert all("steps" in row.against and not row.metrics and not row.finite for _, row in found)


def test_a_reference_of_any_size_is_answered_from_python_as_from_the_command_line() -> None:
    size = Fraction(3) * 10**160
    top, start = ht.HeavyTop((2, 2, 1), size**2, (0, 0, 1)), ht.State((0, 0, size), LEANING)
    time = str(1 / size)
    known = ht.reference(top, start, [time], 20)
    unit = ht.reference(ht.HeavyTop((2, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 1), LEANING), [1], 20)
    assert [ball.value for ball in known.states[0][3:]] == [ball.value for ball in unit.states[0][3:]]
    options = ["--inertia", "2,2,1", "--weight", str(size**2), "--centre", "0,0,1", "--omega", f"0,0,{size}"]
    done = CliRunner().invoke(
        app, ["reference", *options, "--gamma", "3/5,0,4/5", "--times", time, "--digits", "20", "--json"]
    )
    assert done.exit_code == 0
    assert known.states[0][0].value in done.stdout
    with pytest.raises(ht.InputError, match="too large"):
        ht.propagate(top, start, [time])


THIN = ht.State(("1/2", "1/3", "1/4"), (0, "3/5", "4/5"))


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "system"), [("quad", "heavy_top"), ("quad", "heavy_gyrostat")])
def test_a_grid_that_follows_a_rod_in_far_too_short_steps_is_refused(precision: str, system: str) -> None:
    """Just inside and just beyond: a thousand times the steps that the motion asks for, and 1e9."""
    refused, taken = (ht.HeavyTop((1, 1, least), 1, (0, 0, "1/2")) for least in ("1e-30", "1e-12"))
    for time in (1, -1):
        with pytest.raises(ht.OutOfReach, match=r"takes at least 3.5E\+13 steps: .* least inertia") as caught:
            ht.propagate(refused, THIN, [time], precision, integrator="multiword", system=system)
        assert "limit the steps" in caught.value.remedy
    limited = ht.propagate(refused, THIN, [1], precision, integrator="multiword", system=system, step_limit=10)
    assert (limited.outcome, limited.steps) == (Outcome.STEP_LIMIT, 10)
    run = ht.propagate(taken, THIN, ["1/8"], precision, integrator="multiword", system=system)
    assert run.outcome is Outcome.SUCCESS
    with pytest.raises(ht.OutOfReach):
        ht.propagate(taken, THIN, [32000], precision, integrator="multiword", system=system)
    problem = Problem.of(taken, THIN, ht.QUAD)
    scaled = choose(problem, None)[1]
    longest = LONGEST_STEP * 10**9 / scaled.rate
    _require_reach(problem, scaled, longest)
    with pytest.raises(ht.OutOfReach):
        _require_reach(problem, scaled, longest * Fraction(11, 10))
    floating = ht.propagate(refused, THIN, [1], "double-double", integrator="multiword", system=system)
    assert floating.outcome is Outcome.SUCCESS
