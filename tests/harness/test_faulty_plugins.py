"""Faults of Python integrators in files: each is an error in words or a failed row, and harms no other."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from pathlib import Path

import numpy
import pytest

import heavytop as ht
from heavytop.cases import CASES
from heavytop.errors import HeavyTopError
from heavytop.features.kinds import KINDS
from heavytop.harness.plan import read
from support.midpoint import MIDPOINT
from support.reports import drift, plan_file, rows

CASE = CASES["euler"]
HEAD = """
import os, signal, sys, threading, warnings
import numpy
from heavytop.integrate.peers.double import Solved

class Mute(Exception):
    def __str__(self):
        raise RuntimeError
"""
HEAD += MIDPOINT.format(name="right") + "\n"
SOLVE = HEAD + "def solve(given):\n    {}\n"
AT_IMPORT = {
    "raise ValueError('no licence')": "is broken: ValueError: no licence",
    "sys.exit(4)": "is broken: SystemExit: 4",
    "raise MemoryError": "is broken: MemoryError",
    "raise Mute": "is broken: Mute",
    "def (:": "is broken: SyntaxError",
    "import not_there_at_all": "is broken: ModuleNotFoundError: No module named 'not_there_at_all'",
    "solver = right": "does not define solve",
    "solve = 7": "is a int, not a function",
    "class solve: pass": "is a type, not a function",
    "def solve(a, b): return right(a)": "takes 2 arguments",
    "async def solve(given): return right(given)": "is a coroutine, not a function",
}
IN_SOLVE = {
    "raise Mute": "raised Mute",
    "raise MemoryError": "raised MemoryError",
    "raise StopIteration": "raised StopIteration",
    "raise GeneratorExit": "raised GeneratorExit",
    "raise ValueError(lambda: 0)": "raised ValueError",
    "sys.exit(0)": "called sys.exit(0)",
    "numpy.zeros(10**14)": "raised MemoryError",
    "yield [0.0] * 6": "returned a generator instead of Solution",
    "return right(given).states": "returned a list instead of Solution",
    "return Solved((x for x in right(given).states), 2.0, 5)": "returned states of object",
    "return Solved([[0.0] * 5] * 2, 2.0, 5)": "of the shape (2, 5) for 2 times where states have 6 numbers, Ω and γ",
    "return Solved(numpy.zeros((6, 2)), 2.0, 5)": "of the shape (6, 2) for 2 times",
    "return Solved(right(given).states[:1], 2.0, 5)": "returned 1 of 2 states",
    "return Solved(numpy.ones((2, 6), bool), 2.0, 5)": "returned states of bool",
    "return Solved(right(given).states, 2.0, None)": "returned steps that are not a count",
    "return Solved(right(given).states, 2.0, -5)": "returned a negative count of steps",
    "return Solved(right(given).states, 2.0, 10.5)": "returned steps that are not a count",
}
HARMLESS = (
    "given.start[:] = 0; given.times[:] *= 2; given = None; return RIGHT",
    "print('x' * 100_000); os.write(1, b'y' * 1000); os.write(2, b'z' * 1000); return right(given)",
    "warnings.simplefilter('error'); numpy.seterr(all='raise'); return right(given)",
    "warnings.warn('careful'); numpy.float64(1) / numpy.float64(0); return right(given)",
    "threading.Thread(target=len, args=('',)).start(); return right(given)",
    "os.chdir('/'); return right(given)",
    "[signal.signal(each, signal.SIG_IGN) for each in (signal.SIGINT, signal.SIGTERM)]; return right(given)",
    "s = right(given); return Solved(numpy.array(s.states, numpy.float32), float('nan'), 10**30)",
)
TEARS = "[sys.modules.pop(name) for name in list(sys.modules) if name.startswith('heavytop')]\n"


def propagated(folder: Path, text: str) -> ht.Trajectory:
    (folder / "mine.py").write_text(text)
    return ht.propagate(CASE.top, CASE.start, ["1/2", 2], integrator=f"{folder}/mine.py:solve")


@pytest.mark.parametrize("line", AT_IMPORT)
def test_what_a_file_does_when_it_is_imported_is_an_error_in_words(line: str, tmp_path: Path) -> None:
    with pytest.raises(HeavyTopError) as raised:
        propagated(tmp_path, HEAD + line)
    assert AT_IMPORT[line] in str(raised.value)


@pytest.mark.parametrize("line", IN_SOLVE)
def test_what_a_solver_does_is_an_error_in_words(line: str, tmp_path: Path) -> None:
    with pytest.raises(HeavyTopError) as raised:
        propagated(tmp_path, SOLVE.format(line))
    assert str(raised.value).startswith("mine.py:solve ")
    assert IN_SOLVE[line] in str(raised.value)


@pytest.mark.parametrize("line", HARMLESS)
def test_a_solver_that_is_only_rude_leaves_nothing_behind(
    line: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    def state() -> tuple[object, ...]:
        handlers = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
        return os.getcwd(), numpy.geterr(), warnings.filters[:], sys.getrecursionlimit(), handlers

    before = state()
    text = SOLVE.format(line).replace("RIGHT", "Solved([[0.5] * 6] * 2, 2.0, 5)")
    try:
        assert propagated(tmp_path, text).outcome is ht.Outcome.SUCCESS
        assert state() == before
    finally:
        os.chdir(str(before[0]))
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_what_destroys_modules_is_a_failed_row_and_the_others_have_a_process_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "tears.py").write_text(HEAD + TEARS + "solve = right\n")
    (tmp_path / "mine.py").write_text(HEAD + "solve = right\n")
    names = [f"{name}.py:solve" for name in ("tears", "mine")]
    tables = "".join(drift("euler", integrator=name, noise=False) for name in (*names, "heyoka"))
    plan = plan_file(tmp_path, f'row_timeout = "60"\nintegrators = {names}\n{tables}')
    found = {row.integrator: row for _, row in rows(read(plan, KINDS)[2], 1)}
    assert [found[name].outcome for name in (*names, "heyoka")] == ["failed", "success", "success"]
    assert "measuring tears.py:solve failed: PicklingError" in found["tears.py:solve"].reference.reason
