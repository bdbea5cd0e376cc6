"""Programs as integrators: whatever a program does wrong is a failure with its reason, and no process is left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from time import monotonic, sleep

import msgspec
import numpy as np
import pytest

import heavytop as ht
from heavytop import DOUBLE, EXTENDED, GYROSTAT, QUAD, InputError, Outcome, real
from heavytop.cases import CASES
from heavytop.errors import NoSuchIntegrator, PeerFailed, Unsupported
from heavytop.harness import integrator_check
from heavytop.integrate import registry
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.peers import command as commands
from heavytop.integrate.peers.command import Command, number_text
from heavytop.integrate.peers.double import double_peer
from heavytop.integrate.registry import commands_in, named, of_callable
from heavytop.precision import exact, number
from heavytop.written_numbers import number as written
from support import methods_with_memory as memory
from support.helpers import gone, judged, running, wait_until

PROGRAM = Path(__file__).parents[1] / "support" / "faulty_program.py"
CASE = CASES["generic"]
TIMES = [Fraction(1, 2), Fraction(1)]
SLOW = "1"

FAILURES = {
    "silent at the start": "did not say ready within 1 s",
    "errors only": "did not say ready within 1 s; its standard error ends with: ready on the wrong stream",
    "dies at the start": "ended with exit code 1 before it said ready; its standard error ends with: no licence found",
    "killed at the start": "was ended by SIGKILL before it said ready",
    "another greeting": "began with 'Welcome to my integrator' instead of ready NAME VERSION",
    "silent": "did not say done within 1 s",
    "leaves its group": "did not say done within 1 s",
    "busy": "did not say done within 1 s",
    "no done": "did not say done within 1 s",
    "crashes": "was ended by SIGSEGV before it said done",
    "leaves a child behind": "ended with exit code 5 before it said done",
    "ends in the middle": "ended with exit code 1 before it said done",
    "no line end": "ended with exit code 0 before it said done",
    "dies at the third request": "ended with exit code 1 before it said done; its standard error ends with: out of",
    "needs a time": "ended with exit code 1 before it said done to a request without times; its standard error",
    "not utf-8": "which is not UTF-8",
    "closes its output": "closed its output before it said done",
    "a line without an end": "wrote a line of more than 1048576 characters",
    "1 GB": "wrote the state at 0.5 where that at 1",
    "aborts": "failed: no convergence at t = 1.3",
    "only done": "said done after 0 of 2 states",
    "prompts": "wrote '> state 0.5 1 2 3 4 5 6', which the protocol does not know",
    "an empty line": "wrote '', which the protocol does not know",
    "nan": "wrote a state that is not finite at t = 1",
    "overflow": "wrote '1e999', which is not a number: outside the range of double",
    "comma": "which is not a number: write a decimal point, not a comma",
    "a word": "wrote 'zero', which is not a number",
    "five numbers": "wrote a state of 5 numbers after its time instead of 6",
    "underscores": "wrote '1_0.5', which is not a number",
    "seven numbers": "wrote a state of 7 numbers after its time instead of 6",
    "wrong order": "wrote the state at 1 where that at 0.5",
    "times off by one": "wrote the state at 0 where that at 0.5",
    "one state short": "said done after 1 of 2 states",
    "one state more": "wrote more states than the 2 times",
    "two states in a line": "wrote done steps, not names and numbers by turns",
    "negative steps": "counts -5 steps",
    "steps in words": "counts many steps",
    "seconds that are none": "counts nan seconds",
    "talks on": "wrote more after 'done steps",
}
DIAGNOSED = {
    "ignores its step": ("between steps", 'the step is ignored. Use it, or declare setting = "none".'),
    "six digits": ("digits", "States have 6 significant digits; double has 17."),
    "single precision": ("digits", "States have 24 bits; double has 53."),
    "wrong backwards": ("backwards", "steps backward in time are wrong"),
    "swapped": ("one time", "check the order of the components"),
    "other each time": ("determinism", "Equal requests give different states"),
    "whole last steps": ("many times", "without other samples a run to t = 1 is right, so check the last step"),
    "knows too little": ("unknown lines", "An unknown line is not ignored"),
    "ignores quit": ("quit", "The program does not exit within 0.2 s of quit"),
    "outlives its input": ("end of input", "The program does not exit within 0.2 s of the end of input"),
}
SILENT = {name for name, text in FAILURES.items() if "within 1 s" in text}


def program(fault: str = "", **changes: object) -> Command:
    line = (sys.executable, "-S", "-E", str(PROGRAM), *fault.split())
    return Command(**{"name": "rk4", "command": line, "setting": "step", "order": 4} | changes)


@pytest.fixture(autouse=True)
def _nothing_is_left() -> Iterator[None]:
    yield
    commands.close_all()
    assert gone(str(PROGRAM))


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAILURES)
def test_a_faulty_program_fails_with_its_reason_and_leaves_no_process(fault: str) -> None:
    given = program(fault, timeout=SLOW if fault in SILENT else "60")
    began = monotonic()
    integrate = registry.ready(given, ("step", Fraction(1, 4)))
    with pytest.raises(PeerFailed) as caught:
        [integrate(CASE.top, CASE.start, TIMES, DOUBLE) for _ in range(2)]
    assert caught.value.cause.startswith("rk4 ")
    assert FAILURES[fault] in caught.value.cause
    assert len(caught.value.cause) < 500
    assert caught.value.cause.isprintable()
    commands.close_all()
    assert gone(str(PROGRAM))
    assert fault not in SILENT or monotonic() - began < 10


def test_a_request_without_times_has_the_step_too() -> None:
    integrate = registry.ready(program("needs a setting"), ("step", Fraction(1, 4)))
    assert integrate(CASE.top, CASE.start, TIMES, DOUBLE).steps == 4


@pytest.mark.slow
@pytest.mark.parametrize("fault", DIAGNOSED)
def test_what_no_row_can_see_the_check_of_the_contract_names(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(integrator_check, "_FAREWELL", 0.2)
    part, text = DIAGNOSED[fault]
    found = judged(program(fault), part)
    assert (found.verdict, text in found.text) == ("violated", True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "part", "verdict", "text"),
    [
        ("dies at the fourth request", "unknown lines", "violated", "rk4 ended with exit code 1 before it said done"),
        ("begins otherwise", "two processes", "violated", "A new process answers otherwise than one in use"),
        ("other each time", "two processes", "note", "Not tested: one process answers equal requests with different"),
        ("six digits", "restart", "kept", "A restart at t = 1 changes the state at t = 2 by "),
        ("has small steps", "between steps", "kept", "Samples between steps are as accurate as the ends of runs."),
    ],
)
def test_what_follows_from_an_earlier_request_is_not_charged_to_the_next(fault, part, verdict, text) -> None:
    judged(program(fault), "one time")
    found = judged(program(fault), part)
    assert (found.verdict, found.text[: len(text)]) == (verdict, text)


@pytest.mark.slow
def test_a_right_program_keeps_the_contract_and_one_process_serves_it() -> None:
    found = integrator_check.check(program())
    assert {each.verdict for each in found} == {"kept", "note"}
    assert [each.check for each in found if each.verdict == "note"] == ["huge"]
    assert len(found) == 18


@pytest.mark.parametrize(
    ("fault", "part", "text"),
    [
        ("begins badly", "restart", "which the error explains. A multistep method should declare one_step = false."),
        ("counts wrongly", "steps", "2000 steps counted to t = 2; the step size 0.01 needs 200. Perhaps"),
    ],
)
def test_what_a_right_program_may_do_is_a_note(fault: str, part: str, text: str) -> None:
    found = judged(program(fault), part)
    assert (found.verdict, text in found.text) == ("note", True)


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["", "forks", "becomes a daemon", "chatty errors", "counts none"])
def test_a_program_integrates_whatever_else_it_does(fault: str) -> None:
    run = registry.ready(program(fault), ("step", Fraction(1, 50)))(CASE.top, CASE.start, TIMES, DOUBLE)
    known = propagate(CASE.top, CASE.start, TIMES, DOUBLE)
    assert run.times == known.times
    assert np.abs(run.to_numpy() - known.to_numpy()).max() < 1e-7
    assert (run.steps, run.order, run.outcome) == (50, 4, Outcome.SUCCESS)
    assert run.flags == {"step": f"{0.02:.17g}"}
    assert run.seconds["run"] > 0
    commands.close_all()
    assert gone(str(PROGRAM))


@pytest.mark.slow
def test_one_process_serves_many_requests_and_the_next_row_begins_with_an_empty_one() -> None:
    given, texts = program(), []
    integrate = registry.ready(given)
    first = commands._idle.get(given, [])
    assert not first
    for _ in range(3):
        integrate(CASE.top, CASE.start, TIMES, DOUBLE)
    (session,) = commands._idle[given]
    assert session.requests == 5  # two without times, as the first of a process is slow
    pid = session.process.pid
    commands.begin_row()
    integrate(CASE.top, CASE.start, TIMES, DOUBLE)
    (session,) = commands._idle[given]
    assert (session.requests, session.process.pid) == (7, pid)
    session.process.kill()
    session.process.wait()
    with pytest.raises(PeerFailed, match="was ended by SIGKILL"):  # within a row
        integrate(CASE.top, CASE.start, TIMES, DOUBLE)
    texts.append(integrate(CASE.top, CASE.start, TIMES, DOUBLE).texts())
    commands._idle[given][0].process.kill()
    commands._idle[given][0].process.wait()
    commands.begin_row()
    texts.append(integrate(CASE.top, CASE.start, TIMES, DOUBLE).texts())
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("arguments", "options", "cause"),
    [
        (("mine", 4, print, "stepp"), {}, 'control must be "tolerance" or "step"; got \'stepp\''),
        (("mine", -1, print), {}, "order must be 0 or more; got -1"),
        (("mine", 4.5, print), {}, "order must be an integer"),
        ((5, 4, print), {}, "name must be text"),
        (("mine", 4, print), {"one_step": "no"}, "one_step must be a bool; got 'no'"),
        (("mine", 4, print), {"directions": ["up"]}, "directions must be forward or backward; got 'up'"),
        (("mine", 4, print), {"systems": ["moon"]}, "Unknown system 'moon'"),
        (("mine", 4, print), {"precisions": ["doubel"]}, "Unknown precision 'doubel'"),
        (("mine", 4, print), {"systems": []}, "systems is empty"),
        (("mine", 4, print), {"systems": 3}, "must be lists of names; got 3"),
        (("", 4, print), {}, "name must be 1 to 200 printable characters; got ''"),
    ],
)
def test_what_a_callable_declares_is_read(arguments, options, cause: str) -> None:
    with pytest.raises(InputError, match=cause):
        double_peer(*arguments, **options)


def test_what_a_callable_declares_may_be_numpys() -> None:
    names = (name for name in np.array(["heavy_top"]))
    solve = memory.solver(memory.METHODS["ab4"][0])
    peer = double_peer(np.str_("mine"), 4, solve, np.str_("step"), systems=names, one_step=np.False_)
    assert not peer.declared.one_step
    assert registry.ready(of_callable(peer))(CASE.top, CASE.start, TIMES, DOUBLE).integrator == "mine"


def test_what_a_program_declares_that_it_cannot_do_is_never_sent() -> None:
    forward = program("dies at the start", directions=("forward",), precisions=("double", "real:BITS"))
    integrate = registry.ready(forward)
    peer = of_callable(double_peer("rk4", 4, print, directions=["forward"], precisions=["double"]))
    for which, options, what in (
        (integrate, ([Fraction(-1)], DOUBLE), "direction backward"),
        (registry.ready(peer), ([Fraction(-1)], DOUBLE), "direction backward"),
        (registry.ready(peer), ([Fraction(1)], QUAD), "format quad"),
        (integrate, ([Fraction(1)], QUAD), "format quad"),
        (integrate, ([Fraction(1)], EXTENDED), "format extended"),
    ):
        with pytest.raises(Unsupported, match=what):
            which(CASE.top, CASE.start, *options)
    gyrostat = CASES["gyrostat"]
    with pytest.raises(Unsupported, match="system gyrostat"):
        integrate(gyrostat.top, gyrostat.start, TIMES, DOUBLE, system=GYROSTAT)
    with pytest.raises(Unsupported, match="does not carry the attitude"):
        ht.propagate(CASE.top, CASE.start, [1], integrator=forward, xi=(0, 1, 0))
    with pytest.raises(Unsupported, match="The integrator rk4 has no dense output"):
        ht.events(CASE.top, CASE.start, 1, "omega1", integrator=forward)
    with pytest.raises(PeerFailed, match="exit code 1"):  # any number of bits is sent
        integrate(CASE.top, CASE.start, TIMES, real(100))


def test_a_program_that_says_that_it_failed_keeps_the_states_so_far() -> None:
    run = ht.propagate(CASE.top, CASE.start, TIMES, integrator=program("aborts"))
    assert (run.outcome, run.flags["failure"]) == (Outcome.FAILED, "no convergence at t = 1.3")
    assert len(run.states) == 0
    assert repr(run).endswith("reached t = 0 only; rk4 says: no convergence at t = 1.3")
    for option in ("high_accuracy", "compact_mode"):
        with pytest.raises(InputError, match=f"does not support {option}"):
            ht.propagate(CASE.top, CASE.start, TIMES, integrator=program(), **{option: True})


@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, QUAD, real(237)], ids=lambda p: p.name)
def test_numbers_go_out_so_that_they_are_those_of_the_format(precision) -> None:
    rng = np.random.default_rng(1)
    values = [Fraction(int(n), int(d)) * Fraction(2) ** int(e) for n, d, e in rng.integers(1, 10**9, (40, 3)) % 900 + 1]
    values += [Fraction(1), Fraction(-1, 3), Fraction(10) ** -150, Fraction(0), Fraction(3, 4)]
    for value in values:
        held = exact(number(value, precision))
        for hexadecimal in (False, True):
            text = number_text(held, precision, hexadecimal)
            back = written(text, "a number")
            assert exact(number(back, precision)) == held
            assert not hexadecimal or back == held
        if precision == DOUBLE:
            assert float(number_text(held, precision)) == held
            assert float.fromhex(number_text(held, precision, True)) == held


def test_states_come_back_as_decimal_hexadecimal_fortran_or_fraction() -> None:
    request = commands.ProgramRequest(commands.Problem.of(CASE.top, CASE.start, DOUBLE), [Fraction(1, 2)], None, False)
    lines = [
        b"state 0.5 0.5 0.25 1.5 -2 3 0",
        b"state 1/2 1/2 1/4 3/2 -2/1 3 0",
        b"state 0x1p-1 0x1p-1 0x.4p0 0x1.8p+0 -0x2 0x3p0 0x0",
        b"state 5D-1 0.5D0 2.5d-01 1.5Q+00 -2.0D+00 0.3D+001 0D0\r",
        b"state\t.5   5e-1 25E-2 +1.5 -2. 3 -0",
    ]
    for line in lines:
        reply = commands.Reply("p", request)
        assert reply.take(line) is False
        assert list(reply.states[0]) == [0.5, 0.25, 1.5, -2, 3, 0], line


@pytest.mark.slow
def test_the_seconds_of_a_request_are_of_this_clock_and_not_what_the_program_says() -> None:
    run = registry.ready(program(), ("step", Fraction(1, 200)))(CASE.top, CASE.start, [Fraction(10)], DOUBLE)
    assert run.seconds["program"] == 0.001
    assert 0.01 < run.seconds["run"] < 5
    # what it takes for a request without times is its own affair: no more than 1 ms of that is taken off
    asked = registry.ready(program("naps"))
    assert max(asked(CASE.top, CASE.start, TIMES, DOUBLE).seconds["run"] for _ in range(3)) > 0.029
    trivial = registry.ready(program())
    found = [trivial(CASE.top, CASE.start, [Fraction(1, 100)], DOUBLE).seconds["run"] for _ in range(50)]
    assert min(found) > 1e-6


TABLE = """[[integrator]]
name = "rk4-py"
command = ["{python}", "{program}"]
setting = "step"
order = 4
"""


def toml(folder: Path, extra: str = "", table: str = TABLE) -> Path:
    (folder / "mine.toml").write_text(table.format(python=sys.executable, program=PROGRAM) + extra)
    return folder / "mine.toml"


@pytest.mark.parametrize(
    ("extra", "cause"),
    [
        ('colour = "red"', "unknown field `colour`"),
        ("folder = 'x'", "unknown field `folder`"),
        ('setting = "speed"', "setting must be step, tolerance or none; got 'speed'"),
        ("singular_at = [[0, 1]]", "singular_at[0] must be a list of length 3; got 2"),
        ('setting = "none"\nfixed_grid = true', 'fixed_grid needs setting = "step"'),
        ("timeout = 0", "timeout must be positive and at most 10000000 seconds; got 0"),
        ("timeout = nan", "timeout"),
        ('timeout = "soon"', "soon"),
        ('precisions = ["single"]', "Unknown precision 'single'"),
        ("precisions = []", "precisions is empty"),
        ('systems = ["pendulum"]', "Unknown system 'pendulum'"),
        ("directions = []", "directions is empty"),
        ('directions = ["up"]', "directions"),
        ("order = -1", "order must not be negative"),
        ("order = 1.5", "order"),
        ("command = []", "command is empty"),
        ("command = 'rk4 --fast'", "command"),
        ('name = "heyoka"', "built-in"),
        ('name = "a b"', "is not letters"),
        ("attitude = 1", "attitude"),
    ],
)
def test_a_table_that_cannot_be_is_an_error_with_its_reason(tmp_path: Path, extra: str, cause: str) -> None:
    key = extra.partition(" ")[0]
    kept = "".join(f"{line}\n" for line in TABLE.splitlines() if not line.startswith(f"{key} "))
    with pytest.raises(InputError) as caught:
        commands_in(toml(tmp_path, extra + "\n", kept))
    assert cause in caught.value.cause
    assert "mine.toml" in caught.value.cause
    assert caught.value.remedy


def test_a_file_is_named_by_itself_or_with_the_name_of_one_of_its_programs(tmp_path: Path) -> None:
    path = toml(tmp_path)
    assert named(str(path)).name == "rk4-py"
    path = toml(tmp_path, TABLE.replace("rk4-py", "other").format(python=sys.executable, program=PROGRAM))
    with pytest.raises(InputError, match=r"mine.toml defines rk4-py, other"):
        named(str(path))
    assert named(f"{path}:other").name == "other"
    assert named("heyoka") == "heyoka"
    (tmp_path / "not.toml").write_text("name = 3")
    for bad in (f"{path}:third", str(tmp_path / "absent.toml"), str(tmp_path / "not.toml")):
        with pytest.raises(InputError):
            named(bad)


@pytest.mark.parametrize(
    ("line", "cause"),
    [
        (["./absent"], "the program ./absent does not exist"),
        (["./mine.toml"], "the program ./mine.toml is not executable"),
        (["surely-no-such-program"], "the program surely-no-such-program does not exist"),
        ([f"{Path(sys.executable).name} -S"], "does not exist"),
        (["./"], "the program ./ is a folder"),
        (["./script"], "cannot be started: its interpreter does not exist"),
    ],
)
def test_a_program_that_is_not_there_is_a_failure_of_its_rows(tmp_path: Path, line: list[str], cause: str) -> None:
    toml(tmp_path)
    (tmp_path / "script").write_text("#!/surely/no/such/interpreter\n")
    (tmp_path / "script").chmod(0o755)
    given = msgspec.structs.replace(program(), command=tuple(line), folder=str(tmp_path))
    with pytest.raises(PeerFailed, match=cause) as caught:
        registry.ready(given)(CASE.top, CASE.start, TIMES, DOUBLE)
    assert caught.value.remedy == commands.COMMAND_REMEDY
    with pytest.raises(NoSuchIntegrator, match=cause):
        judged(given, "start")


@pytest.mark.slow
@pytest.mark.parametrize(("end", "fault"), [(signal.SIGINT, "silent"), (signal.SIGKILL, "leaves its group")])
def test_the_program_ends_with_this_process_however_that_ends(tmp_path: Path, end: int, fault: str) -> None:
    words = '", "'.join(["{program}", *fault.split()])
    path = toml(tmp_path, table=TABLE.replace("{program}", words))
    data = ["--inertia", "3,2,1", "--weight", "1", "--centre", "0,0,1/2", "--omega", "1,0,1", "--gamma", "0,0,1"]
    line = [sys.executable, "-m", "heavytop", "propagate", *data, "--times", "1", "--integrator", str(path)]
    with subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as parent:
        wait_until(lambda: running(str(PROGRAM), fault.split()[-1]), 60)
        sleep(0.2)
        os.kill(parent.pid, end)
        parent.wait(30)
    assert gone(str(PROGRAM))


@pytest.mark.slow
def test_a_session_is_one_thread_s_alone() -> None:
    given = program()
    with commands.session(given) as one, commands.session(given) as other:
        assert one.process.pid != other.process.pid
    assert len(commands._idle[given]) == 2
