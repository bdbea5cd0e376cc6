"""The contract of a Python integrator: a part that does not come back takes nothing from what was found before it."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from heavytop.errors import NoSuchIntegrator
from heavytop.harness import integrator_check
from heavytop.harness.integrator_check import check
from heavytop.integrate.registry import named
from support.helpers import is_running, wait_until

INTEGRATOR = '''
import os, time
from math import ceil
from heavytop.integrate.peers.double import Solved


def solve(given):
    """Runge-Kutta of order 4."""
    FAULT
    parameters = given.parameters
    def field(y):
        return given.system.field(parameters, y)
    y, t, count = given.start.tolist(), 0.0, 0
    states = []
    for end in given.times:
        n = max(1, ceil(abs(end - t) * 50))
        h = (end - t) / n
        for _ in range(n):
            k, total = [0.0] * 6, [0.0] * 6
            for at, weight in ((0, 1), (0.5, 2), (0.5, 2), (1, 1)):
                k = field([a + at * h * b for a, b in zip(y, k)])
                total = [a + weight * b for a, b in zip(total, k)]
            y = [a + h / 6 * b for a, b in zip(y, total)]
        t, count = end, count + n
        states.append(list(y))
    return Solved(states, t, count, 4 * count)
'''


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "part", "verdict", "said"),
    [
        ("while abs(given.start[0]) > 1e9: time.sleep(0.1)", "huge", "note", "within 1 s; the process was stopped"),
        ("if len(given.times) > 100: time.sleep(600)", "many times", "violated", "within 1 s; the process was stopped"),
        ("if len(given.times) > 100: os._exit(1)", "many times", "violated", "It ended its whole process."),
        ("if len(given.times) > 100: raise KeyboardInterrupt", "many times", "violated", ": KeyboardInterrupt."),
    ],
)
def test_what_was_found_before_a_part_that_hangs_stands(
    fault: str, part: str, verdict: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "the process was stopped" in said:  # the other parts have their minute
        monkeypatch.setitem(integrator_check._PATIENCE_OF, part, 1)
    (tmp_path / "mine.py").write_text(INTEGRATOR.replace("FAULT", fault))
    found = check(named(f"{tmp_path / 'mine.py'}:solve"))
    place = [each.check for each in found].index(part)
    notes = [each.text for each in found[:place] if each.verdict != "kept"]
    assert all("perhaps the tolerance is ignored" in note for note in notes)  # as it is
    assert place >= 3
    assert (found[place].verdict, said in found[place].text) == (verdict, True)
    rest = [each.check for each in found[place + 1 :]]
    assert rest == ([] if verdict == "note" else ["rest of the contract"])


@pytest.mark.parametrize(
    ("fault", "step", "verdict"),
    [
        ("import random; random.seed(1)", "[random.gauss(a, 0.1 * abs(h) ** 4.5) + h / 6 * b", "note"),
        ("", "[a + (0 if abs(a) > 1e-3 else 1e-9) + h / 6 * b", "violated"),
    ],
)
def test_noise_of_the_size_of_the_error_moves_a_top_at_rest(
    fault: str, step: str, verdict: str, tmp_path: Path
) -> None:
    """As of a probabilistic integrator, which perturbs each step."""
    program = INTEGRATOR.replace("FAULT", fault).replace("[a + h / 6 * b", step)
    (tmp_path / "mine.py").write_text(program)
    contract = integrator_check._Contract(named(f"{tmp_path / 'mine.py'}:solve"))
    found = integrator_check._judged("rest", contract._rest)
    assert (found.verdict, "the error on a motion explains" in found.text) == (verdict, verdict == "note")


@pytest.mark.slow
def test_the_check_ends_where_a_forked_process_is_left_behind(tmp_path: Path) -> None:
    """It holds the pipes of the process that forked it."""
    fault = f"os.fork() or (open({str(tmp_path / 'left')!r}, 'a').write(f'{{os.getpid()}} '), time.sleep(600))"
    (tmp_path / "mine.py").write_text(INTEGRATOR.replace("FAULT", fault))
    found = check(named(f"{tmp_path / 'mine.py'}:solve"))
    assert not [each for each in found if each.verdict == "violated"]
    left = [int(each) for each in (tmp_path / "left").read_text().split()]
    assert wait_until(lambda: not any(map(is_running, left)))


@pytest.mark.slow
def test_a_check_that_is_stopped_says_nothing_and_leaves_no_process(tmp_path: Path) -> None:
    """The processes that clean up behind others hold standard error until they end."""
    fault = f"open({str(tmp_path / 'began')!r}, 'w').write(str(os.getpid())); time.sleep(600)"
    (tmp_path / "mine.py").write_text(INTEGRATOR.replace("FAULT", fault))
    command = [sys.executable, "-m", "heavytop", "check-integrator", str(tmp_path / "mine.py:solve")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    began = tmp_path / "began"
    wait_until(lambda: began.exists() and began.read_text(), 60)
    process.terminate()
    assert process.communicate(timeout=60) == ("", "")
    assert process.returncode in (-signal.SIGTERM, 128 + signal.SIGTERM)
    assert wait_until(lambda: not is_running(int(began.read_text())))


@pytest.mark.slow
def test_an_integrator_of_gyrostats_alone_is_checked_on_one(tmp_path: Path) -> None:
    made = (
        "from heavytop.integrate.peers.double import double_peer\nm = double_peer('it', 4, solve, systems=['gyrostat'])"
    )
    (tmp_path / "mine.py").write_text(INTEGRATOR.replace("FAULT", "") + made)
    found = {each.check: each.verdict for each in check(named(f"{tmp_path / 'mine.py'}:m"))}
    assert {found[part] for part in ("one time", "many times", "determinism", "backwards")} == {"kept"}


CARRIED = """
import numpy as np
from dataclasses import replace
from heavytop.integrate.heyoka.motions import propagate

def solve(top, start, times, precision, *, system, xi=None):
    run = propagate(top, start, times, precision, system=system, xi=xi)
    turned = [[1] * 6 + [-1 if LATE else 1] * 3 for t in run.times]
    return run if xi is None else replace(run, states=np.array(run.states) * turned)
"""


def test_an_attitude_that_is_lost_later_is_seen(tmp_path: Path) -> None:
    """And so is one of every second sample alone."""
    for late in ("float(t) > 1", "float(t) == 1"):
        (tmp_path / "mine.py").write_text(CARRIED.replace("LATE", late), "utf-8")
        contract = integrator_check._Contract(named(f"{tmp_path / 'mine.py'}:solve"))
        part = integrator_check._judged("attitude", contract._attitude)
        assert part.verdict == "violated"
        assert "The error with the attitude is " in part.text


def test_a_function_that_a_file_does_not_have_is_no_violation(tmp_path: Path) -> None:
    made = "from heavytop.integrate.peers.double import double_peer\nm = double_peer('it', 4, solve)\n"
    (tmp_path / "mine.py").write_text(f"def solve(request): pass\n{made}")
    solve = named(f"{tmp_path}/mine.py:solv")
    with pytest.raises(NoSuchIntegrator, match=r"does not define solv\.\n  Did you mean solve\? It defines solve, m\."):
        integrator_check._judged("start", solve.load)
