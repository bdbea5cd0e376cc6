"""Whatever a third-party integrator does, its row says so and the others go on."""

import json
import subprocess
import sys
import threading
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from heavytop.cases import CASES
from heavytop.errors import InputError, PeerFailed
from heavytop.features.work_precision import kind as work_precision
from heavytop.integrate import registry
from heavytop.integrate.peers import contract
from heavytop.measure.integrator import Repeats
from heavytop.precision import DOUBLE, QUAD
from heavytop.records import Report
from heavytop.report.compare.noise import Policy
from heavytop.report.render.export import comparison_junit
from support.helpers import named_peers, run_peer, without_progress
from support.reports import all_good, asked, compare, expand, html, load, measure, plan_file, plan_of

CASE = CASES["euler"]
TIMES = [Fraction(1, 2), Fraction(2)]

MODULE = """
import os, sys, threading, warnings
from dataclasses import replace
from fractions import Fraction
import numpy
from heavytop.errors import InputError
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Outcome, Trajectory
from heavytop.integrate.peers.double import Solved, double_peer


def honest(top, start, times, precision, *, system, tolerance=None):
    return propagate(top, start, times, precision, system=system)


def raises(error):
    def peer(*_, **__):
        raise error
    return peer


def changed(**changes):
    def peer(*arguments, **options):
        run = honest(*arguments, **options)
        return replace(run, **{name: change(run) for name, change in changes.items()})
    return peer


def each(change):
    return changed(states=lambda run: tuple(map(change, run.states)))


def ended(count, reached):
    return changed(
        states=lambda run: run.states[:count], times=lambda run: run.times[:count],
        outcome=lambda run: Outcome.STEP_LIMIT, time_reached=reached,
    )


def solved(states):
    return double_peer("mine", 1, lambda given: Solved(states(given), 0.5, 1))


dies = lambda *_, **__: os.kill(os.getpid(), 11)


def chatty(top, start, times, precision, *, system, tolerance=None):
    print("so much to say")
    print("and more", file=sys.stderr)
    warnings.warn("careful")
    numpy.float64(1) / numpy.float64(0)
    numpy.seterr(all="raise")
    thread = threading.Thread(target=lambda: 1 / 0)
    thread.start()
    thread.join()
    return honest(top, start, times, precision, system=system)


def vandal(top, start, times, precision, *, system, tolerance=None):
    run = honest(top, start, times, precision, system=system)
    object.__setattr__(top, "weight", Fraction(17))
    object.__setattr__(start, "omega", (Fraction(0),) * 3)
    object.__setattr__(precision, "bits", 3)
    return run
"""
FAILURES = {
    "zero": ("lambda *_, tolerance=None, **__: 1 / 0", "raised ZeroDivisionError: division by zero"),
    "refuses": ('raises(InputError("No.", "Never."))', "raised InputError: No."),
    "told": ('raises(ValueError("two\\nlines \\x1b[31m" + 5000 * "x"))', "raised ValueError: two lines"),
    "deep": ("lambda *a, **k: deep(*a, **k)", "raised RecursionError"),
    "nothing": ("lambda *_, **__: None", "returned a NoneType instead of a Trajectory"),
    "few": (
        "changed(states=lambda run: run.states[:-1], times=lambda run: run.times[:-1])",
        "1 of 2 states, and the outcome success",
    ),
    "fewer_times": ("changed(times=lambda run: run.times[:-1])", "returned other times"),
    "many": ("changed(states=lambda run: (*run.states, run.states[-1]))", "returned 3 states for 2 times"),
    "elsewhere": ("changed(times=lambda run: tuple(t + 1 for t in run.times))", "returned other times"),
    "short": ("each(lambda s: s[:5])", "a state of 5 components"),
    "flat": ("changed(states=lambda run: tuple(x for s in run.states for x in s))", "float64' object is not iterable"),
    "imaginary": ("each(lambda s: numpy.asarray(s) + 0j)", "a complex128 in a state"),
    "objects": ("each(lambda s: numpy.array(s, dtype=object))", "an array of objects"),
    "texts": ("each(lambda s: [str(x) for x in s])", "a str_ in a state"),
    "one_text": ('each(lambda s: "123456")', "a str_ as a state"),
    "truths": ("each(lambda s: [True] * 6)", "a bool in a state"),
    "nan": ("each(lambda s: s * numpy.nan)", "a state that is not finite"),
    "inf": ("each(lambda s: s / 0)", "a state that is not finite"),
    "diverged": (
        "changed(states=lambda run: (), times=lambda run: (), outcome=lambda run: Outcome.NON_FINITE)",
        "a state that is not finite after 0 of 2 times",
    ),
    "liar": ("changed(outcome=lambda run: Outcome.STEP_LIMIT)", "2 of 2 states, and the outcome step_limit"),
    "worded": ('changed(outcome=lambda run: "success")', "the outcome 'success' instead of a member of Outcome"),
    "beyond": ("ended(0, lambda run: 2 * run.time_reached)", "as reached"),
    "overtaken": ("ended(1, lambda run: run.time_reached)", "states, and said that it reached t = "),
    "behind": ("ended(1, lambda run: run.times[0] / 2)", "states, and said that it reached t = "),
    "untimed": ("changed(seconds=lambda run: {})", "raised KeyError: 'compile' in what it returned"),
    "instant": ('changed(seconds=lambda run: {"compile": 0.0, "run": float("nan")})', "invalid seconds"),
    "flagged": ('changed(flags=lambda run: {"a": "b" * 10_000})', "flags that are not short texts"),
    "nameless": ("changed(integrator=lambda run: None)", "no integrator name"),
    "double_nan": ('solved(lambda given: [[float("nan")] * 6] * len(given.times))', "a state that is not finite"),
    "double_ragged": ("solved(lambda given: [[0.0] * 6, [0.0]])", "raised ValueError"),
    "double_many": ("solved(lambda given: [[0.0] * 6] * (len(given.times) + 1))", "of the shape (3, 6) for 2 times"),
}
"""Each peer, and what is said of it."""
HARMLESS = ("honest", "chatty", "vandal")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Another package with one peer of every kind."""
    failing = "".join(f"{name} = {code}\n" for name, (code, _) in FAILURES.items())
    (tmp_path / "others.py").write_text(MODULE + failing)
    (tmp_path / "others_broken.py").write_text("print('hello')\nimport sys\nsys.exit(3)")
    peers = {name: f"others:{name}" for name in (*FAILURES, *HARMLESS, "dies")}
    named_peers(tmp_path, peers | {"exits": "others_broken:x", "absent": "nowhere:x", "lacks": "others:not_there"})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(work_precision, "_USUAL", Repeats(1, 1, 0.0))
    return tmp_path


def plan(folder: Path, *names: str) -> Path:
    ladders = [{"integrator": name, "tolerances": ["1e-9"]} for name in names]
    return Path(plan_file(folder, asked("work_precision", "euler", horizon="2", samples=2, ladders=ladders)))


@pytest.mark.slow
@pytest.mark.parametrize("name", FAILURES)
def test_a_peer_that_fails_says_what_it_did(package: Path, name: str, capfd) -> None:
    peer = registry.ready(f"mine:{name}")
    with pytest.raises(PeerFailed) as caught:
        peer(CASE.top, CASE.start, TIMES, DOUBLE)
    assert caught.value.cause.startswith(f"mine:{name} ") or name.startswith("double")
    assert FAILURES[name][1] in caught.value.cause
    assert len(caught.value.cause) < 350
    assert caught.value.cause.isprintable()
    assert capfd.readouterr() == ("", "")


NOISY = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")


@pytest.mark.slow
@NOISY
@pytest.mark.parametrize("name", HARMLESS)
def test_a_peer_that_is_only_rude_is_measured_like_a_polite_one(package: Path, name: str, capfd) -> None:
    def state() -> tuple[object, ...]:
        return np.geterr(), sys.stdout, (CASE.top, CASE.start), DOUBLE.bits

    before = state()
    found = registry.ready(f"mine:{name}")(CASE.top, CASE.start, TIMES, DOUBLE)
    assert state() == before
    ours = run_peer("heyoka", CASE.top, CASE.start, TIMES, DOUBLE)
    assert found.times == ours.times
    np.testing.assert_allclose(found.states, ours.states, rtol=0, atol=1e-11)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_the_rows_of_others_go_on_and_every_surface_has_the_reason(package: Path) -> None:
    file = plan(package, "heyoka", "mine:zero", "mine:exits", "mine:absent", "mine:lacks", "mine:double_nan")
    rows = [measure(task) for task in expand(load(str(file))[0])]
    assert [row.outcome for row in rows] == ["success"] + ["failed"] * 5
    said = [row.against for row in rows]
    assert said[1] == "nothing: mine:zero raised ZeroDivisionError: division by zero, in euler/T=2 tolerance=1e-9"
    for text, part in zip(said[2:], ("SystemExit: 3", "No module named 'nowhere'", "not_there", "finite"), strict=True):
        assert part in text
        assert text.endswith(", in euler/T=2 tolerance=1e-9")
    assert not any(row.metrics or row.finite for row in rows[1:])
    assert not all_good(rows)
    report = Report("heavytop-report/2", {"name": "p"}, {}, rows)
    assert 'failures="0" errors="5"' in comparison_junit(compare(report, report, Policy()))  # five without a number
    assert "mine:zero raised ZeroDivisionError: division by zero, in euler/T=2 tolerance=" in html.report_page(report)
    assert "aborted" not in html.report_page(report).split("</section>")[0]


@pytest.mark.slow
def test_the_command_ends_with_exit_3_no_traceback_and_all_rows_though_one_ends_its_process(package: Path) -> None:
    file = plan(package, "mine:dies", "heyoka", "mine:zero", "mine:chatty")
    line = [sys.executable, "-m", "heavytop", "run", "--plan", file, "--out", package / "out", "--workers", "2"]
    done = subprocess.run(
        line, capture_output=True, text=True, timeout=240, check=False, env={"PYTHONPATH": str(package), "PATH": ""}
    )
    assert (done.returncode, without_progress(done.stderr)) == (3, "")
    assert "mine:zero raised ZeroDivisionError: division by zero, in euler/T=2 tolerance=1e-9" in " ".join(
        done.stdout.split()
    )
    assert "so much to say" not in done.stdout
    document = json.loads((package / "out" / "report.json").read_text("utf-8"))
    assert [row["outcome"] for row in document["rows"]] == ["failed", "success", "failed", "success"]
    said = "nothing: mine:dies ended its process 3 times, by SIGSEGV, in euler/T=2 tolerance=1e-9"
    assert document["rows"][0]["against"] == said


def test_what_is_a_mistake_of_the_plan_stays_an_error(package: Path) -> None:
    for name in ("mine:unheard", "rk4"):
        with pytest.raises(InputError, match="Unknown integrator"):
            expand(load(str(plan(package, name)))[0])
    with pytest.raises(InputError, match="does not support quad"):
        registry.ready("scipy:DOP853")(CASE.top, CASE.start, TIMES, QUAD)
    with pytest.raises(PeerFailed, match="mine:honest does not support step"):
        registry.ready("mine:honest", ("step", Fraction(1, 2)))


def test_an_interrupt_passes(package: Path) -> None:
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        contract.CheckedPlugin("mine", interrupted, own=False)(CASE.top, CASE.start, TIMES, DOUBLE)


@pytest.mark.slow
@NOISY
def test_peers_in_many_threads_leave_standard_output_as_it_was(package: Path) -> None:
    before, found = (sys.stdout, sys.stderr), []

    def work() -> None:
        found.append(registry.ready("mine:chatty")(CASE.top, CASE.start, TIMES, DOUBLE).states[-1])

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (sys.stdout, sys.stderr) == before
    assert len(found) == 8
    assert all((state == found[0]).all() for state in found)


@pytest.mark.parametrize("precision", [DOUBLE, QUAD], ids=lambda p: p.name)
def test_the_states_that_pass_are_the_bits_that_were_returned(precision) -> None:
    kept = run_peer("heyoka", CASE.top, CASE.start, TIMES, precision)
    raw = registry.peer("heyoka")(CASE.top, CASE.start, TIMES, precision)
    assert kept.texts() == raw.texts()
    assert (kept.times, kept.steps, kept.flags, kept.outcome) == (raw.times, raw.steps, raw.flags, raw.outcome)


def test_every_kind_that_propagates_has_a_failed_row_for_an_integrator_that_fails(package: Path) -> None:
    run = {"precision": "double", "horizon": "2", "samples": 4}
    mine = {"cases": ["euler"], "integrator": "mine:zero"}
    tables = [
        mine | {"kind": "drift", "runs": [run]},
        mine | {"kind": "growth", "runs": [run | {"starts": 8}]},
        mine | {"kind": "homoclinic", "cases": ["delone"], "precisions": ["double"], "directions": ["forward"]},
    ]
    found = [measure(task) for task in expand(plan_of({"name": "mine", "measure": tables}))]
    assert [(row.outcome, row.metrics) for row in found] == [("failed", {})] * 3
    for row in found:
        assert row.against.startswith("nothing: mine:zero raised ZeroDivisionError: division by zero, in ")
        assert row.key.subject.name == "mine:zero"
