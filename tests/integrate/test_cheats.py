"""Integrators of another package that cheat: what they say of themselves is measured, and their row fails with why.

Their rows are measured in this process, as the process of a row measures them; that each has one of its own is tested
in tests/harness/test_limited.py.
"""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Any

import pytest

from heavytop.cases import CASES
from heavytop.features.kinds import KINDS
from heavytop.features.work_precision import kind as work_precision
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import measure
from heavytop.measure.integrator import Repeats
from heavytop.records import Row
from support.helpers import named_peers
from support.reports import expand, plan_of

MODULE = '''
import os
from dataclasses import replace
from fractions import Fraction
from time import perf_counter, sleep

import numpy
from heavytop.integrate.peers.double import Solved, double_peer
from heavytop.integrate.peers.splitting import _solver
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Trajectory

COARSE, FINE = Fraction(1, 10**4), Fraction(1, 10**10)


def run(top, start, times, precision, system, tolerance=FINE):
    return propagate(top, start, times, precision, system=system, tolerance=tolerance)


def honest(top, start, times, precision, *, system, tolerance=None):
    return run(top, start, times, precision, system)


def changed(**changes):
    def peer(top, start, times, precision, *, system, tolerance=None):
        found = run(top, start, times, precision, system)
        return replace(found, **{name: change(found) for name, change in changes.items()})
    return peer


# the clock
no_time = changed(seconds=lambda found: {"compile": 0.0, "run": 1e-12})
all_compiling = changed(seconds=lambda found: {"compile": sum(found.seconds.values()), "run": 0.0})


def slow(top, start, times, precision, *, system, tolerance=None):
    sleep(0.02)
    return replace(run(top, start, times, precision, system), seconds={"compile": 0.0, "run": 1e-9})


def _solve_slowly(given):
    sleep(0.02)
    found = _solver(8)(replace(given, control=1 / 32))
    return Solved(found.states, found.reached, found.steps, None, 0.02)


slow_compiling = double_peer("mine:slow_compiling", 8, _solve_slowly)


def quick_alone(top, start, times, precision, *, system, tolerance=None):
    """Of longer steps where no sample shortens them, as of an adaptive method to a loose tolerance."""
    if len(times) == 1:
        return run(top, start, times, precision, system, COARSE)
    sleep(0.02)
    return run(top, start, times, precision, system)


made = []


class Later(Trajectory):
    """Computed when it is looked at, behind the back of a clock around the call."""

    __slots__ = ()

    def __getattribute__(self, name):
        if name == "states" and made:
            sleep(0.02)
        return Trajectory.__getattribute__(self, name)


def later(top, start, times, precision, *, system, tolerance=None):
    made.clear()
    found = run(top, start, times, precision, system)
    found = Later(**{name: getattr(found, name) for name in Trajectory.__slots__})
    made.append(found)
    return found


# the coarse run's seconds with the fine run's states
counts = {}


def counted(name):
    counts[name] = counts.get(name, 0) + 1
    return counts[name]


def coarse(where):
    def peer(top, start, times, precision, *, system, tolerance=None):
        return run(top, start, times, precision, system, COARSE if where(start, times) else FINE)
    return peer




# from memory
def remembering(key_of):
    seen = {}

    def peer(top, start, times, precision, *, system, tolerance=None):
        key = key_of(start), tuple(times)
        if key not in seen:
            sleep(0.04)
            seen[key] = run(top, start, times, precision, system)
        return seen[key]
    return peer




# two equal calls


def random_samples(top, start, times, precision, *, system, tolerance=None):
    return (random if len(times) > 1 else honest)(top, start, times, precision, system=system)


def last_bit(top, start, times, precision, *, system, tolerance=None):
    found = run(top, start, times, precision, system)
    states = found.states.copy()
    if counted("bit") % 2:
        states[0, 4] = numpy.nextafter(states[0, 4], 9)
    return replace(found, states=states)


def sometimes(top, start, times, precision, *, system, tolerance=None):
    found = run(top, start, times, precision, system)
    if counted("sometimes") == 2:
        raise ValueError("not today")
    return found


# counts


def _fixed(factor):
    def solve(given):
        found = _solver(2)(given)
        return Solved(found.states, found.reached, found.steps if found.steps < 9 else int(found.steps * factor), None)
    return solve


fixed = double_peer("mine:fixed", 2, _fixed(1), "step")
fixed_many = double_peer("mine:fixed_many", 2, _fixed(50), "step")


# its arguments
def field_of_its_own(top, start, times, precision, *, system, tolerance=None):
    object.__setattr__(system, "field", lambda p, y: (0, 0, 0, 0, 0, 0))
    return run(top, start, times, precision, system)


def fractions(top, start, times, precision, *, system, tolerance=None):
    found = run(top, start, times, precision, system)
    for value in (*top.inertia, *start.flat, *times, *([tolerance] if tolerance else [])):
        value._numerator = 17
    return found


somebody = changed(integrator=lambda found: "heyoka")
'''
CHEATS = {
    "many_times_coarse": ("coarse(lambda start, times: len(times) > 1)", ""),
    "every_other_coarse": ('coarse(lambda *_: counted("other") % 2)', " two equal calls as success at t = 20 in "),
    "first_fine": ('coarse(lambda *_: counted("first") >= 4)', "the seconds are those of another run"),
    "known_start_fine": (
        "coarse(lambda start, times: start.omega[0].denominator >= 1000)",
        "from a start that differs in the last place, ends ",
    ),
    "memory": ("remembering(lambda start: start)", "it keeps results between calls"),
    "rough_memory": (
        "remembering(lambda start: tuple(round(float(value), 9) for value in start.flat))",
        "it keeps results between calls",
    ),
    "random": (
        'changed(states=lambda found: found.states * (1 + 1e-15 * numpy.frombuffer(os.urandom(6), "u1")))',
        " in two equal calls",
    ),
    "random_samples": (None, " in two equal calls"),
    "last_bit": (None, " in two equal calls"),
    "other_steps": (
        'changed(steps=lambda found: found.steps + counted("steps"))',
        "ended two equal calls as success at t = 20 in ",
    ),
    "sometimes": (None, "raised ValueError: not today"),
    "no_step": ("changed(steps=lambda found: 0)", "counts its steps wrongly: it moved, but reports 0 steps"),
    "fixed_few": ('double_peer("mine:fixed_few", 2, _fixed(1 / 50), "step")', "where each is 0.01"),
    "field_of_its_own": (None, "changed the field of the system heavy_top"),
}
"""Each one, None where it is in the module, and what its row says, or "" where nothing is hidden by it: its error and
seconds are the ones of such a run.
"""
DOUBTED = {
    "one_step": ("changed(steps=lambda found: 1)", "It counts 1 steps of "),
    "few_steps": (
        "changed(steps=lambda found: max(1, found.steps // 30), order=lambda found: 8)",
        "or it takes more steps than it counts.",
    ),
    "few_evaluations": ("changed(evaluations=lambda found: 1)", " steps, and 1 evaluations of the field."),
}
"""What is said of counts that are no proof: there are motions on which a method is exact."""
TIMED = (
    "no_time",
    "all_compiling",
    "slow",
    "slow_compiling",
    "quick_alone",
    "later",
    "fractions",
    "somebody",
    "honest",
)
STEPPED = ("fixed", "fixed_few", "fixed_many")


@pytest.fixture(autouse=True)
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another package with all of them."""
    lines = [f"{name} = {code}" for name, (code, _) in (CHEATS | DOUBTED).items() if code]
    (tmp_path / "cheats.py").write_text("\n".join([MODULE, *lines]))
    named_peers(tmp_path, {name: f"cheats:{name}" for name in (*CHEATS, *DOUBTED, *TIMED, *STEPPED)})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(work_precision, "_USUAL", Repeats(3, 3, 0.0))


def rows(*names: str, case: str = "euler") -> list[Row]:
    controls = [{"steps": ["1/100"]} if name in STEPPED else {"tolerances": ["1e-9"]} for name in names]
    ladders = [{"integrator": f"mine:{name}"} | control for name, control in zip(names, controls, strict=True)]
    return measured(kind="work_precision", cases=[case], horizon="20", samples=5, ladders=ladders)


def measured(**table: Any) -> list[Row]:
    tasks = expand(plan_of({"name": "p", "measure": [table]}))
    return [measure(KINDS[task.key.kind], task, Saved()) for task in tasks]


def single_steps(name: str) -> list[Row]:
    data = {"cases": ["lagrange"], "precisions": ["double"], "horizon": "4", "integrator": f"mine:{name}"}
    return measured(kind="local_error", **data)


@pytest.mark.slow
def test_a_cheat_is_a_row_that_fails_with_what_was_observed_and_the_others_go_on() -> None:
    *cheats, honest = rows(*CHEATS, "honest")
    assert honest.outcome == "success"
    for name, cheat in zip(CHEATS, cheats, strict=True):
        if not CHEATS[name][1]:
            assert float(cheat.metrics["error_max"].value) > 1e3 * float(honest.metrics["error_max"].value)
            continue
        assert (name, cheat.outcome, cheat.metrics, cheat.seconds) == (name, "failed", {}, {})
        assert CHEATS[name][1] in cheat.reference.reason
        assert cheat.reference.reason.startswith(f"mine:{name}")
        assert cheat.reference.reason.isprintable()
        assert len(cheat.reference.reason) < 400


@pytest.mark.slow
def test_seconds_are_those_of_the_clock_here_and_of_a_run_with_the_error_that_is_reported() -> None:
    began = perf_counter()
    found = dict(zip(TIMED, rows(*TIMED), strict=True))
    passed = perf_counter() - began
    assert {name: row.reference.reason for name, row in found.items() if row.outcome != "success"} == {}
    for name, row in found.items():
        # half of what it slept: the clock leaves out time without a processor, some of it before and after the sleep
        least = 0.01 if name in ("slow", "slow_compiling", "quick_alone", "later") else 1e-5
        assert least <= row.seconds["least"] <= row.seconds["run"], name
    assert sum(row.seconds["compile"] + row.seconds["run"] for row in found.values()) <= passed


def test_whatever_is_done_to_the_arguments_and_whoever_it_says_it_is_the_row_is_its_own() -> None:
    before = repr(CASES["euler"])
    honest, *others = rows("honest", "fractions", "somebody")
    assert repr(CASES["euler"]) == before
    for row in others:
        assert row.metrics["error_max"] == honest.metrics["error_max"]
        assert row.measured.startswith("computed: mine:")


@pytest.mark.slow
@pytest.mark.parametrize("case", ["lagrange", "generic", "gyrostat"])
def test_an_honest_one_is_measured_on_every_kind_of_motion(case: str) -> None:
    assert [row.outcome for row in rows("honest", "fixed", case=case)] == ["success"] * 2


@pytest.mark.slow
def test_a_doubtful_count_is_said_and_no_failure() -> None:
    for name, row in zip(DOUBTED, rows(*DOUBTED), strict=True):
        assert row.outcome == "success"
        assert (row.explained.kind, DOUBTED[name][1] in row.explained.text) == ("steps", True)


@pytest.mark.slow
def test_a_count_of_steps_makes_no_step_shorter_that_has_its_length_given() -> None:
    (honest,), (many,) = (single_steps(name) for name in ("fixed", "fixed_many"))
    assert (honest.outcome, honest.metrics, honest.steps) == ("success", many.metrics, many.steps / 50)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("random", "drift"),
        ("last_bit", "local_error"),
        ("other_steps", "growth"),
    ],
)
def test_two_equal_calls_that_differ_are_said_so_in_every_kind(name: str, kind: str) -> None:
    more = {"decades": 1, "starts": 8} if kind == "growth" else {}
    runs = [{"precision": "double", "horizon": "2", "samples": 4} | more]
    data = {"cases": ["lagrange"], "integrator": f"mine:{name}", "runs": runs}
    (row,) = single_steps(name) if kind == "local_error" else measured(kind=kind, **data)
    assert row.outcome == "failed"
    assert "two equal calls" in row.reference.reason
