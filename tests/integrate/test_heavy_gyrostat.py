"""The heavy gyrostat in every arithmetic: enclosure, heyoka, multi-word, ensembles, attitude, odd scales.

The computation that is independent of all of them is a Taylor series of (Ω, γ, ξ) in mpmath.
"""

import json
from fractions import Fraction
from functools import cache
from itertools import permutations
from random import Random

import numpy as np
import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop import DOUBLE, HEAVY_GYROSTAT, HeavyTop, InputError, Outcome, State
from heavytop.cases import CASES
from heavytop.cli import app
from heavytop.exact.cases.staude import Staude
from heavytop.exact.catalogue import find
from heavytop.exact.closed_form import orientation, permuted, renamed_state, renamed_top
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.integrate import registry
from heavytop.integrate.peers.command import ProgramRequest
from heavytop.integrate.trajectory import Problem
from heavytop.precision import exact, parse
from integrate.test_words import worst
from support.full_tensor import integrate_top
from support.helpers import unit_vector, vector

F = Fraction
CASE = CASES["heavy-gyrostat"]
XI = (F(4, 5), F(0), F(-3, 5))


def contains(ball, value: Fraction) -> bool:
    """Whether the ball holds the number, which is right to 30 digits."""
    return abs(midpoint(ball) - value) <= radius(ball) + F(1, 10**30) * max(1, abs(value))


@cache
def integrated(time: Fraction) -> list[Fraction]:
    """The case's motion with its attitude, at one time."""
    return integrate_top(CASE.top, CASE.start, time, XI)


@pytest.mark.slow
@pytest.mark.parametrize("axes", list(permutations(range(3))))
def test_the_enclosure_holds_an_independent_integration_on_any_axes(axes) -> None:
    """The motion is integrated as it is; the enclosure takes it on renamed axes, both ways in time.

    ``validation/heavy_gyrostat.py`` has random motions, to 50 digits.
    """
    top, start, d = CASE.top, CASE.start, orientation(axes)
    for time in (F(3, 4), F(-1, 2)):
        known = integrated(time)
        renamed = [d * w for w in permuted(known[:3], axes)] + [*permuted(known[3:6], axes)]
        enclosed = Validated(renamed_top(top, axes), renamed_state(start, axes), HEAVY_GYROSTAT).state(time, 110)
        assert all(map(contains, enclosed, renamed))
        assert max(map(radius, enclosed)) < F(1, 10**30)


@pytest.mark.slow
def test_the_enclosed_attitude_is_that_of_an_independent_integration() -> None:
    time = F(3, 4)
    enclosed = Validated(CASE.top, CASE.start, HEAVY_GYROSTAT, xi=XI).attitude(time, 160)
    known = integrated(time)
    assert all(map(contains, enclosed, known[6:]))
    found = ht.reference(CASE.top, CASE.start, [time], 40, attitude=True)
    assert found.method.startswith("validated")
    assert found.attitude is not None


FORMATS = {
    "heyoka": ["double", "extended", "quad", "real:160"],
    "words": ["double", "extended", "double-double", "quad", "real:1100"],
}
EVERY = [(name, form) for name, forms in FORMATS.items() for form in forms]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "form"), EVERY, ids=lambda part: str(part))
def test_every_format_is_right_to_its_rounding_with_the_attitude_and_without(name, form) -> None:
    precision = parse(form)
    if ht.available()[precision.family] is not None:
        pytest.skip(f"{form} is not available")
    for time in (F(1), F(-3, 4)) if form in ("double", "double-double") else (F(-3, 4),):
        for xi in (None, XI) if form in ("double", "quad") else (None,):
            run = ht.propagate(CASE.top, CASE.start, [time], precision, integrator=name, xi=xi)
            assert run.outcome is Outcome.SUCCESS
            assert run.problem.system is HEAVY_GYROSTAT
            assert worst(run) <= 4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["heyoka", "words"])
def test_a_motion_of_an_ensemble_is_right_whatever_runs_beside_it(name) -> None:
    """Also beside one without a rotor, whose k is 0 there."""
    random = Random(name)
    starts = [State([w / 30 for w in vector(random)], unit_vector(random)) for _ in range(10)]
    tops = [HeavyTop((3, 2, 1), 1, (0, "1/2", "1/3"), [k / 30 for k in vector(random)]) for _ in range(9)]
    tops.append(HeavyTop((3, 2, 1), 1, (0, "1/2", "1/3")))
    runs = ht.ensemble(tops, starts, [1], integrator=name)
    for run, top, start in zip(runs, tops, starts, strict=True):
        assert run.problem.system is HEAVY_GYROSTAT
        alone = ht.propagate(top, start, [1], system="heavy_gyrostat", integrator="words")
        np.testing.assert_allclose(run.to_numpy(), alone.to_numpy(), rtol=0, atol=1e-14)
    plain = ht.propagate(tops[-1], starts[-1], [1], integrator="words")
    np.testing.assert_allclose(runs[-1].to_numpy(), plain.to_numpy(), rtol=0, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("power", [-100, 100])
def test_a_rotor_of_any_size_is_enclosed_and_integrated(power) -> None:
    """Tiny beside the body it changes nothing that shows; huge it turns M fast, over a time that is as short.

    Ω is as huge there.
    """
    size = F(10) ** power
    k = [size * part for part in (F(1, 2), F(-1, 3), F(3, 4))]
    top = HeavyTop(CASE.top.inertia, CASE.top.weight, CASE.top.centre, k)
    time = F(1) if power < 0 else 1 / size
    start = CASE.start if power < 0 else State([size * w for w in CASE.start.omega], CASE.start.gamma)
    truth = [midpoint(ball) for ball in Validated(top, start, HEAVY_GYROSTAT).state(time, 100)]
    known = integrate_top(top, start, time, XI)[:6]
    units = [max(map(abs, known[:3]))] * 3 + [F(1)] * 3
    assert max(abs(a - b) / unit for a, b, unit in zip(truth, known, units, strict=True)) < F(1, 10**30)
    for name in ("words", "heyoka") if power < 0 else ("words",):  # heyoka's derivatives of order 20 overflow
        run = ht.propagate(top, start, [time], integrator=name)
        found = [exact(value) for value in run.states[0]]
        assert max(abs(a - b) / unit for a, b, unit in zip(found, truth, units, strict=True)) < F(1, 10**14)


@pytest.mark.slow
def test_a_body_at_rest_is_set_turning_by_its_weight_alone_and_a_rotor_alone_leaves_it_at_rest() -> None:
    top = HeavyTop((3, 2, 1), 0, (0, 0, 1), (1, 2, 3))
    still = State((0, 0, 0), (0, 0, -1))
    assert isinstance(find(top, still, HEAVY_GYROSTAT), Staude)
    for name in ("words", "heyoka"):
        run = ht.propagate(top, still, [1, 50], integrator=name)
        assert [[exact(v) for v in state] for state in run.states] == [list(still.flat)] * 2
    falling = HeavyTop((3, 2, 1), 1, (0, 1, 0), (1, 2, 3))
    assert find(falling, still, HEAVY_GYROSTAT).method.startswith("validated")


def test_a_motion_that_turns_by_its_rotor_alone_is_refused_beyond_reach() -> None:
    """1e13 turns: the rotor's rate counts, though Ω is small."""
    top = HeavyTop((1, 1, 2), 0, (0, 0, 0), ("1e13", 0, 0))
    problem = Problem.of(top, State((0, "1e-3", 0), (0, 0, 1)), DOUBLE, HEAVY_GYROSTAT)
    assert registry.expected_steps(problem, F(1)) > 10**12
    with pytest.raises(ht.OutOfReach):
        ht.propagate(top, State((0, "1e-3", 0), (0, 0, 1)), [1])


def test_a_program_is_given_k_and_one_that_declares_the_heavy_top_alone_is_asked_nothing(tmp_path) -> None:
    problem = Problem.of(CASE.top, CASE.start, DOUBLE, HEAVY_GYROSTAT)
    lines = ProgramRequest(problem, [F(1)], None, False).text(1).decode().splitlines()
    assert "system heavy_gyrostat" in lines
    assert "rotor 0.5 -0.33333333333333331 0.75" in lines
    file = tmp_path / "mine.toml"
    file.write_text('[[integrator]]\nname = "mine"\ncommand = ["true"]\n')
    with pytest.raises(ht.HeavyTopError, match="does not support the system heavy_gyrostat"):
        ht.propagate(CASE.top, CASE.start, [1], integrator=str(file))


@pytest.mark.slow
def test_what_is_computed_is_scored_with_the_rotor_of_the_file(tmp_path) -> None:
    """A file that says k is scored as it is; with the sign of k turned over the diagnosis names it."""
    times = [F(1, 4), F(1, 2), F(1), F(2), F(3)]
    run = ht.propagate(CASE.top, CASE.start, times)
    file = tmp_path / "t.json"
    data = {"inertia": ["3", "2", "1"], "weight": "1", "centre": ["1/2", "1/3", "1/5"]}
    data |= {"omega": ["1/10", "2/5", "9/10"], "gamma": ["3/5", "0", "4/5"], "times": [str(t) for t in times]}
    data |= {"states": run.texts(), "precision": "double"}
    for rotor, said in ((["1/2", "-1/3", "3/4"], "15"), (["-1/2", "1/3", "-3/4"], "rotor −k")):
        file.write_text(json.dumps(data | {"rotor": rotor}))
        answer = CliRunner().invoke(app, ["score", str(file)], catch_exceptions=False)
        assert said in answer.output
        assert "heavy gyrostat" in answer.output
    score = ht.score(times, run.to_numpy(), top=CASE.top, start=CASE.start)
    assert score.row.system == "heavy_gyrostat"
    assert score.row.data.rotor == ("1/2", "-1/3", "3/4")
    assert {"gamma_squared", "area", "energy"} <= score.drift.keys()
    for bad in ({"rotor": ["1", "2"]}, {"rotor": "1"}, {"rotor": ["1", "2", "3"], "system": "heavy_top"}):
        file.write_text(json.dumps(data | bad))
        with pytest.raises(InputError, match="rotor"):
            CliRunner().invoke(app, ["score", str(file)], catch_exceptions=False)
