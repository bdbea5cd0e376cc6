"""Whatever a third-party integrator does, its row says so and the others go on."""

import json
import signal
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
from support.reports import all_good, compare, expand, html, load, measure, plan_of

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


class Rude(BaseException):
    pass


class Mute(Exception):
    def __str__(self):
        raise RuntimeError("no message")


def honest(top, start, times, precision, *, system, tolerance=None):
    return propagate(top, start, times, precision, system=system)


def raises(error):
    def peer(*_, **__):
        raise error
    return peer


zero = lambda *_, tolerance=None, **__: 1 / 0
rude, mute, refuses = raises(Rude("stop")), raises(Mute()), raises(InputError("No.", "Never."))
told = raises(ValueError("two\\nlines \\x1b[31m" + 5000 * "x"))
deep = lambda *a, **k: deep(*a, **k)
leaves = lambda *_, **__: sys.exit("goodbye")
dies = lambda *_, **__: os.kill(os.getpid(), 11)


def changed(**changes):
    def peer(*arguments, **options):
        run = honest(*arguments, **options)
        return replace(run, **{name: change(run) for name, change in changes.items()})
    return peer


nothing = lambda *_, **__: None
words = lambda *_, **__: "a string"
states_alone = lambda *a, **k: honest(*a, **k).states
few = changed(states=lambda run: run.states[:-1], times=lambda run: run.times[:-1])
fewer_times = changed(times=lambda run: run.times[:-1])
many = changed(states=lambda run: (*run.states, run.states[-1]))
elsewhere = changed(times=lambda run: tuple(t + 1 for t in run.times))
short = changed(states=lambda run: tuple(s[:5] for s in run.states))
flat = changed(states=lambda run: tuple(x for s in run.states for x in s))
imaginary = changed(states=lambda run: tuple(numpy.asarray(s) + 0j for s in run.states))
objects = changed(states=lambda run: tuple(numpy.array(s, dtype=object) for s in run.states))
texts = changed(states=lambda run: tuple([str(x) for x in s] for s in run.states))
one_text = changed(states=lambda run: tuple("123456" for s in run.states))
truths = changed(states=lambda run: tuple([True] * 6 for s in run.states))
nan = changed(states=lambda run: tuple(s * numpy.nan for s in run.states))
inf = changed(states=lambda run: tuple(s / 0 for s in run.states))
diverged = changed(states=lambda run: (), times=lambda run: (), outcome=lambda run: Outcome.NON_FINITE)
liar = changed(outcome=lambda run: Outcome.STEP_LIMIT)
worded = changed(outcome=lambda run: "success")
beyond = changed(
    states=lambda run: (), times=lambda run: (), outcome=lambda run: Outcome.STEP_LIMIT,
    time_reached=lambda run: 2 * run.time_reached,
)
overtaken = changed(
    states=lambda run: run.states[:1], times=lambda run: run.times[:1], outcome=lambda run: Outcome.STEP_LIMIT,
)
behind = changed(
    states=lambda run: run.states[:1], times=lambda run: run.times[:1], outcome=lambda run: Outcome.STEP_LIMIT,
    time_reached=lambda run: run.times[0] / 2,
)
negative = changed(steps=lambda run: -1)
half = changed(steps=lambda run: 1.5)
untimed = changed(seconds=lambda run: {})
instant = changed(seconds=lambda run: {"compile": 0.0, "run": float("nan")})
flagged = changed(flags=lambda run: {"a": "b" * 10_000})
nameless = changed(integrator=lambda run: None)


def solved(states):
    return double_peer("mine", 1, lambda given: Solved(states(given), 0.5, 1))


double_nan = solved(lambda given: [[float("nan")] * 6] * len(given.times))
double_text = solved(lambda given: [["1"] * 6] * len(given.times))
double_complex = solved(lambda given: [[1j] * 6] * len(given.times))
double_turned = solved(lambda given: numpy.zeros((6, 6))[:, : len(given.times)])
double_flat = solved(lambda given: [0.0] * 6 * len(given.times))
double_ragged = solved(lambda given: [[0.0] * 6, [0.0]])
double_many = solved(lambda given: [[0.0] * 6] * (len(given.times) + 1))
double_dict = double_peer("mine", 1, lambda given: {"states": []})


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


def rude_to_the_process(top, start, times, precision, *, system, tolerance=None):
    import signal, tempfile
    os.write(1, b"from C")
    os.write(2, b"from C")
    os.chdir(tempfile.gettempdir())
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    return honest(top, start, times, precision, system=system)


def vandal(top, start, times, precision, *, system, tolerance=None):
    run = honest(top, start, times, precision, system=system)
    object.__setattr__(top, "weight", Fraction(17))
    object.__setattr__(start, "omega", (Fraction(0),) * 3)
    object.__setattr__(precision, "bits", 3)
    return run


def spoil(given):
    import heavytop.integrate.peers.scipy_ivp as scipy_ivp
    found = scipy_ivp._solver("DOP853")(given)
    given.times[:] *= 2
    given.start[:] = 0
    return found


double_vandal = double_peer("mine", 8, spoil)
"""
FAILURES = {
    "zero": "raised ZeroDivisionError: division by zero",
    "rude": "raised Rude: stop",
    "mute": "raised Mute",
    "refuses": "raised InputError: No.",
    "told": "raised ValueError: two lines",
    "deep": "raised RecursionError",
    "leaves": "called sys.exit(goodbye)",
    "nothing": "returned a NoneType instead of a Trajectory",
    "words": "returned a str instead of a Trajectory",
    "states_alone": "returned a ndarray instead of a Trajectory",
    "few": "1 of 2 states, and the outcome success",
    "fewer_times": "returned other times",
    "many": "returned 3 states for 2 times",
    "elsewhere": "returned other times",
    "short": "a state of 5 components",
    "flat": "float64' object is not iterable",
    "imaginary": "a complex128 in a state",
    "objects": "an array of objects",
    "texts": "a str_ in a state",
    "one_text": "a str_ as a state",
    "truths": "a bool in a state",
    "nan": "a state that is not finite",
    "inf": "a state that is not finite",
    "diverged": "a state that is not finite after 0 of 2 times",
    "liar": "2 of 2 states, and the outcome step_limit",
    "worded": "the outcome 'success' instead of a member of Outcome",
    "beyond": "as reached",
    "overtaken": "states, and said that it reached t = ",
    "behind": "states, and said that it reached t = ",
    "negative": "a negative count of steps",
    "half": "steps that are no count",
    "untimed": "raised KeyError: 'compile' in what it returned",
    "instant": "seconds that are none",
    "flagged": "flags that are not short texts",
    "nameless": "no name of an integrator",
    "double_nan": "a state that is not finite",
    "double_text": "returned states of <U1",
    "double_complex": "returned states of complex128",
    "double_turned": "of the shape (6, 2)",
    "double_flat": "of the shape (12,)",
    "double_ragged": "raised ValueError",
    "double_many": "of the shape (3, 6) for 2 times",
    "double_dict": "returned a dict instead of Solution",
}
HARMLESS = ("honest", "chatty", "rude_to_the_process", "vandal", "double_vandal")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Another package with one peer of every kind."""
    (tmp_path / "others.py").write_text(MODULE)
    (tmp_path / "others_broken.py").write_text("print('hello')\nimport sys\nsys.exit(3)")
    peers = {name: f"others:{name}" for name in (*FAILURES, *HARMLESS, "dies")}
    named_peers(tmp_path, peers | {"exits": "others_broken:x", "absent": "nowhere:x", "lacks": "others:not_there"})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(work_precision, "_USUAL", Repeats(1, 1, 0.0))
    return tmp_path


def plan(folder: Path, *names: str) -> Path:
    ladders = ", ".join(f'{{ integrator = "{name}", tolerances = ["1e-9"] }}' for name in names)
    text = 'name = "p"\n[[measure]]\nkind = "work_precision"\ncases = ["euler"]\nhorizon = "2"\nsamples = 2\n'
    (folder / "plan.toml").write_text(f"{text}ladders = [{ladders}]\n", "utf-8")
    return folder / "plan.toml"


@pytest.mark.slow
@pytest.mark.parametrize("name", FAILURES)
def test_a_peer_that_fails_says_what_it_did(package: Path, name: str, capfd) -> None:
    peer = registry.ready(f"mine:{name}")
    with pytest.raises(PeerFailed) as caught:
        peer(CASE.top, CASE.start, TIMES, DOUBLE)
    assert caught.value.cause.startswith(f"mine:{name} ") or name.startswith("double")
    assert FAILURES[name] in caught.value.cause
    assert len(caught.value.cause) < 350
    assert caught.value.cause.isprintable()
    assert capfd.readouterr() == ("", "")


NOISY = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")


@pytest.mark.slow
@NOISY
@pytest.mark.parametrize("name", HARMLESS)
def test_a_peer_that_is_only_rude_is_measured_like_a_polite_one(package: Path, name: str, capfd) -> None:
    def state() -> tuple[object, ...]:
        handlers = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
        return np.geterr(), sys.stdout, (CASE.top, CASE.start), DOUBLE.bits, Path.cwd(), handlers

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
    assert 'failures="0" errors="0"' in comparison_junit(compare(report, report, Policy()))  # failed in both
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
    with pytest.raises(InputError, match="has no quad"):
        registry.ready("scipy:DOP853")(CASE.top, CASE.start, TIMES, QUAD)
    with pytest.raises(PeerFailed, match="mine:honest has no step"):
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
