"""The attitude of third-party integrators: measured where they declare it, with planted errors that a gate sees."""

from fractions import Fraction
from math import isclose
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.features.kinds import KINDS
from heavytop.harness import rows as suite_rows
from heavytop.harness.checkpoint import Saved
from heavytop.integrate.registry import described
from heavytop.precision import exact
from heavytop.records import NOT_CARRIED, Row
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.verdicts import Verdict
from support.helpers import shown
from support.reports import asked, compare, drift, summary, tasks_of
from support.small_reports import report

pytestmark = pytest.mark.slow

PEER = '''
from dataclasses import replace

import numpy as np

from heavytop.integrate.heyoka.motions import propagate

RATE, NUMBERS = {rate}, {numbers}


def solve(top, start, times, precision, *, system, xi=None):
    """heyoka, whose xi turns about gamma at the rate RATE beside what it should."""
    run = propagate(top, start, times, precision, system=system, xi=xi)
    if xi is None:
        return run
    states = np.array(run.states)
    for t, y in zip(map(float, run.times), states):
        y[6:] = np.cos(RATE * t) * y[6:] + np.sin(RATE * t) * np.cross(y[3:6], y[6:])
    return replace(run, states=states[:, :NUMBERS])


def plain(top, start, times, precision, *, system):
    return propagate(top, start, times, precision, system=system)
'''


def measured(folder: Path, function: str = "solve", rate: float = 0.0, numbers: int = 9) -> list[Row]:
    """The rows of the plan with an integrator of that rate."""
    folder.mkdir(exist_ok=True)
    (folder / "mine.py").write_text(PEER.format(rate=rate, numbers=numbers), "utf-8")
    theirs = {"integrator": f"mine.py:{function}"}
    many = {"precision": "double", "horizon": "2", "starts": 2, "samples": 4, "decades": 1, "attitude": True}
    cases = "bruels-cardona-arnold", "gyrostat", "heavy-gyrostat"
    tables = drift(*cases, attitude=True, noise=False, runs=[("double", "2", 4)], **theirs)
    tables += asked("growth", "lagrange", runs=[many], **theirs)
    tasks = tasks_of(folder, f'integrators = ["mine.py:{function}"]\n{tables}')
    return [suite_rows.measure(KINDS[task.key.kind], task, Saved()) for task in tasks]


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    return measured(tmp_path_factory.mktemp("healthy"))


@pytest.mark.parametrize("rate", [1e-9, 1e-3])
def test_an_attitude_that_turns_slowly_is_measured_and_a_gate_sees_it(
    rate: float, healthy: list[Row], tmp_path: Path
) -> None:
    turned = measured(tmp_path / "turned", rate=rate)
    for good, bad in zip(healthy, turned, strict=True):
        assert {good.outcome, bad.outcome} == {"success"}
        assert float(exact(good.metrics["attitude_error_max"].value)) < 1e-12
        # the angle between the two attitudes is that by which ξ is turned
        assert isclose(float(exact(bad.metrics["attitude_error_final"].value)), 2 * rate, rel_tol=1e-3)
        assert bad.metrics["solution_error_gamma_max"] == good.metrics["solution_error_gamma_max"]
    body, growth = turned[0], turned[-1]
    # the centre of mass is turned about the vertical, at its distance from it
    assert 0 < float(exact(body.metrics["position_error_max"].value)) <= 2 * rate * (1 + 1e-9)
    assert {"attitude_error", "position_error"} <= growth.laws.keys()
    gate = compare(report(*healthy), report(*turned), Policy())
    assert gate.verdict == "worse"
    worse = {finding.name.partition("_error")[0] for finding in gate.changed if finding.verdict is Verdict.WORSE}
    assert worse == {"attitude", "position"}


def test_of_others_omega_and_gamma_are_measured_and_the_row_says_so(healthy: list[Row], tmp_path: Path) -> None:
    alone = measured(tmp_path, "plain")
    for row, other in zip(alone, healthy, strict=True):
        assert row.outcome == "success"
        assert NOT_CARRIED.items() <= row.flags.items()
        assert "attitude" not in other.flags
        assert "solution_error_omega_max" in row.metrics
        assert not [name for name in row.metrics if "attitude" in name or "position" in name]
    assert "not carried" in shown(summary(report(*alone[:-1])), 120)
    assert "not carried" not in shown(summary(report(*healthy)), 120)


def test_who_declares_it_and_gives_six_numbers_has_failed_rows(tmp_path: Path) -> None:
    for row in measured(tmp_path, numbers=6):
        assert row.outcome == "failed"
        assert "a state of 6 components instead of 9, Ω, γ and ξ" in str(row.reference.reason)


def test_who_carries_it_is_known_by_what_it_declares(tmp_path: Path) -> None:
    """And a run from an attitude has it then, without being asked."""
    (tmp_path / "mine.py").write_text(
        "from heavytop.integrate.peers.double import Solved, double_peer\n"
        "def solve(given):\n"
        "    y, k = given.start, given.field(given.start)\n"
        "    return Solved([[a + t * b for a, b in zip(y, k, strict=True)] for t in given.times], given.times[-1], 1)\n"
        "six = double_peer('six', 1, solve)\n"
        "nine = double_peer('nine', 1, solve, attitude=True)\n"
        "broken = 1\n"
    )
    (tmp_path / "mine.toml").write_text('[[integrator]]\nname = "p"\ncommand = ["./p"]\nattitude = true\n')
    carries = {"mine.py:six": False, "mine.py:solve": False, "mine.py:nine": True, "mine.toml": True}
    carries |= {"mine.py:broken": False, "mine.py:absent": False}
    from heavytop.integrate.registry import named

    for name, known in carries.items():
        assert described(named(name, tmp_path)).carries_attitude == known, name
    top, start = ht.HeavyTop((1, 2, 2), 1, (1, 0, 0)), ht.State((1, 1, 0), attitude=ht.Attitude.quaternion(1, 0, 0, 0))
    for name in ("six", "nine"):
        run = ht.propagate(top, start, ["1/1024"], integrator=f"{tmp_path}/mine.py:{name}")
        assert (run.attitude is not None) == (name == "nine")
    with pytest.raises(ht.HeavyTopError, match="does not carry the attitude"):
        ht.propagate(top, start, [1], integrator=f"{tmp_path}/mine.py:six", attitude=True)
    assert Fraction(run.attitude[0][1]) == Fraction(0)
