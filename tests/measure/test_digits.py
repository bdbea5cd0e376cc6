"""Digits right: one definition, recomputed here exactly from the samples, and the same on every surface."""

import json
import math
from fractions import Fraction
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from heavytop.cases import CASES
from heavytop.exact.catalogue import find
from heavytop.exact.flint.balls import midpoint
from heavytop.features.score.measurement import measured
from heavytop.features.score.trajectories.observed import GivenTrajectory
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.scalar import RELATIVE, digits_kept, digits_text
from heavytop.measure.truth import known_motion
from heavytop.precision import DOUBLE, QUAD
from heavytop.records import SCHEMA, Metric, Report
from heavytop.report.render import plots
from heavytop.report.render.text import worst
from support import in_process
from support.report_helpers import error, row
from support.reports import html, replace, summary

FULL = 53 * math.log10(2)
TIMES = [Fraction(i) for i in range(1, 5)]
CASE = CASES["lagrange"]


def given(errors: dict[tuple[int, int], Fraction], precision=DOUBLE, omega_scale: int = 1) -> GivenTrajectory:
    """The known motion of a Lagrange top, spoilt at (sample, component); ``omega_scale``: how much faster it turns."""
    top = type(CASE.top)(CASE.top.inertia, CASE.top.weight, CASE.top.centre)
    start = type(CASE.start)([omega_scale * w for w in CASE.start.omega], CASE.start.gamma)
    problem = Problem.of(top, start, precision)
    solution = find(problem.top, problem.start)
    states = []
    for index, time in enumerate(TIMES):
        middles = map(midpoint, solution.state(time, 300))
        states.append(tuple(value + errors.get((index, i), Fraction(0)) for i, value in enumerate(middles)))
    return GivenTrajectory(
        "mine", "rk4", top, start, problem.system, precision, TIMES, states, Outcome.SUCCESS, 4, {}, "0" * 64
    )


def recomputed(given: GivenTrajectory) -> float:
    """−log10 of the largest |error|/max(1, |true value|), exactly, from the states and 300-bit truth."""
    problem = Problem.of(given.top, given.start, given.precision)
    solution = known_motion(problem, given.times[-1]).solution
    worst = Fraction(0)
    for time, state in zip(given.times, given.states, strict=True):
        for value, true in zip(state, map(midpoint, solution.state(time, 300)), strict=True):
            worst = max(worst, abs(value - true) / max(1, abs(true)))
    return -math.log10(worst)


@pytest.mark.parametrize(
    "errors",
    [
        {(0, 3): Fraction(1, 10**9)},
        {(3, 2): Fraction(1, 10**6), (1, 4): Fraction(1, 10**9)},
        {(2, 2): Fraction(1, 10**6), (1, 4): Fraction(9, 10**7)},
        {(i, j): Fraction((-1) ** j, 10 ** (5 + i + j)) for i in range(4) for j in range(6)},
    ],
)
@pytest.mark.parametrize("omega_scale", [1, 20])
def test_digits_kept_are_what_the_samples_say(errors, omega_scale) -> None:
    motion = given(errors, QUAD, omega_scale)
    assert digits_kept(measured(motion).row) == pytest.approx(recomputed(motion), abs=0.006)


def test_a_fast_component_counts_relative_and_a_slow_one_absolute() -> None:
    fast = given({(0, 2): Fraction(1, 10**6)}, QUAD, 20)
    speed = abs(fast.states[0][2])
    assert digits_kept(measured(fast).row) == pytest.approx(6 + math.log10(speed), abs=0.006)
    assert digits_kept(measured(given({(0, 5): Fraction(1, 10**6)}, QUAD, 20)).row) == pytest.approx(6, abs=0.006)


def test_numbers_bounds_and_words() -> None:
    def kept(metric: Metric) -> float | None:
        return digits_kept(row(metrics={RELATIVE.text: metric}))

    assert kept(error("1e-10")) == 10
    assert kept(error("1e2")) == 0
    assert kept(Metric("unresolved", None, "error", "1e-12")) == 12
    assert kept(Metric("unresolved", None, "error", "1e-18")) == pytest.approx(FULL, abs=0.005)
    assert kept(error("1e-18")) == kept(Metric("0", None)) == pytest.approx(FULL, abs=0.005)
    for word in ("nan", "missing", "unresolved"):
        assert kept(Metric(word, None)) is None
    assert digits_kept(row(metrics={})) is None
    assert [digits_text(value) for value in (9.96, 8.94, 0.0)] == ["10.0", "8.9", "0.0"]


def command(*arguments: object) -> str:
    done = in_process.heavytop(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_every_surface_says_the_same(tmp_path: Path) -> None:
    motion = given({(1, 2): Fraction(13, 10**10), (3, 4): Fraction(1, 10**11)}, DOUBLE)
    said = digits_text(digits_kept(measured(motion).row))
    document = {
        "precision": "double",
        "inertia": [str(v) for v in motion.top.inertia],
        "weight": str(motion.top.weight),
        "centre": [str(v) for v in motion.top.centre],
        "omega": [str(v) for v in motion.start.omega],
        "gamma": [str(v) for v in motion.start.gamma],
        "times": [str(t) for t in motion.times],
        "states": [[float(v).hex() for v in state] for state in motion.states],
    }
    file = tmp_path / "motion.json"
    file.write_text(json.dumps(document), "utf-8")
    assert command("score", file, "--out", tmp_path / "out").startswith(f"{said} of 16 digits right at every sample")
    document = json.loads(command("score", file, "--json"))
    assert digits_text(document["digits_kept"]) == digits_text(document["digits_right"]) == said
    lines = [line.split() for line in command("show", tmp_path / "out").splitlines()]
    assert [said in line for line in lines if line[:1] == ["motion"]] == [True]
    report = Report(SCHEMA, {"name": "one"}, {}, [measured(motion).row])
    (drawn,) = plots.digits([("", report)]).rows
    assert said in drawn
    assert f"{said} of 16 digits right to T = 4" in html.report_page(report)


def printed(block: object) -> str:
    console = Console(width=200, record=True, file=StringIO())
    console.print(block)
    return console.export_text()


def test_the_summary_of_many_rows_names_the_fewest() -> None:
    rows = [
        row(case=f"top[{i}]", metrics={RELATIVE.text: error(value)}) for i, value in enumerate(("1e-9", "3e-5", "1e-7"))
    ]
    text = printed(worst(Report(SCHEMA, {"name": "many"}, {}, []), rows, "hint"))
    (line,) = [line for line in text.splitlines() if "digits right, fewest" in line]
    assert line.split()[-2:] == ["4.5", "top[1]"]


def test_rounding_noise_stands_beside_the_number_it_belongs_to() -> None:
    metrics = {
        "drift_energy_max": replace(error("3e-15"), band=0.21),
        "solution_error_along_max": replace(error("2e-13"), band=0.34),
        "solution_error_across_max": error("1e-14"),
    }
    homoclinic = {"break_away_time": replace(error("35"), kind="duration", band=0.02)}
    homoclinic |= {"solution_error_omega_max": replace(error("1e-13"), band=0.9)}
    rows = [row(metrics=metrics, samples=100), row(case="saddle", measure="homoclinic", metrics=homoclinic)]
    text = printed(summary(Report(SCHEMA, {"name": "two"}, {}, rows)))
    for said in ("energy 3e-15 ± 0.21", "2e-13 ± 0.34", "35 ± 0.02", "1e-13 ± 0.90", "largest over 100 samples"):
        assert said in text, said
    assert "1e-14 ±" not in text
