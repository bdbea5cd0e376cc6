"""What asking a program costs: requests for one time, and the requests of a growth row, of a C program.

Run: python benchmarks/bench_commands.py

The program is that of `heavytop new --language c`, RK4 with fixed steps; `cc` and `make` are needed.
"""

from __future__ import annotations

import subprocess
import tempfile
from fractions import Fraction
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median
from time import perf_counter, process_time

from heavytop.api.integrators import new_integrator
from heavytop.cases import CASES
from heavytop.harness.case_text import ensemble_of
from heavytop.integrate.peers.command import Command, ProgramRequest, Session
from heavytop.integrate.registry import commands_in
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE, exact, number

REQUESTS, STARTS = 10_000, 64
STEP = exact(number(Fraction(1, 100), DOUBLE))


def bare(program: Path, requests: list[ProgramRequest]) -> float:
    """Seconds of the program for all requests, read from a file and answered into nothing."""
    script = program.parent / "requests"
    script.write_bytes(b"heavytop-integrator 1\n" + b"".join(each.text(1) for each in requests) + b"quit\n")
    with script.open("rb") as given:
        began = perf_counter()
        subprocess.run([program], stdin=given, stdout=subprocess.DEVNULL, check=True)
        return perf_counter() - began


def asked(session: Session, requests: list[ProgramRequest]) -> list[float]:
    """Seconds of each request here."""
    spent = []
    for each in requests:
        began = perf_counter()
        session.ask(each)
        spent.append(perf_counter() - began)
    return spent


def main() -> None:
    """Print both figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name, "c")
        new_integrator(folder, "c")
        subprocess.run(["make", "-s"], cwd=folder, check=True)
        (command,) = commands_in(folder / "mine.toml")
        session = Session(command)
        case = CASES["lagrange"]
        problem = Problem.of(case.top, case.start, DOUBLE)
        one = [ProgramRequest(problem, [Fraction(1)], STEP, False)] * REQUESTS
        own = bare(folder / "mine", one) / REQUESTS
        spent = median(asked(session, one))
        print(f"a request for one time: {1e6 * spent:.1f} us, the program's own {1e6 * own:.1f} us,")
        print(f"  above it {1e6 * (spent - own):.1f} us (median of {REQUESTS})")
        integrate, whole = command.integrate, []
        for _ in range(2000):
            began = perf_counter()
            integrate(case.top, case.start, [Fraction(1)], DOUBLE, step=STEP)
            whole.append(perf_counter() - began)
        print(f"the whole call of the integrator: {1e6 * median(whole):.1f} us")
        times = [exact(number(Fraction(300) * Fraction(f"{10 ** (k / 16):.4g}"), DOUBLE)) for k in range(-80, 1)]
        members = [Problem.of(*member, DOUBLE) for member in ensemble_of(case, STARTS, 1)]
        row = [ProgramRequest(member, times, STEP, False) for member in members]
        session.close(1.0)
        rounds = [_growth(folder / "mine", command, row) for _ in range(8)]
        own, here, busy, behind, reader = map(min, zip(*rounds, strict=True))
        print(f"a growth row of {STARTS} starts to t = 300: {here:.3f} s, the program alone {own:.3f} s;")
        print(
            f"  processor time of the program {behind:.3f} s, alone {busy:.3f} s, {100 * (behind / busy - 1):+.1f} %;"
        )
        print(f"  that of the reader, beside it on another core, {reader:.3f} s")


def _growth(program: Path, command: Command, row: list[ProgramRequest]) -> tuple[float, ...]:
    """Wall time alone and here; processor time of the program alone and behind pipes, and of the reader."""
    before = _children()
    own, busy = bare(program, row), _children() - before
    session, before, began = Session(command), _children(), process_time()
    here, reader = sum(asked(session, row)), process_time() - began
    session.close(1.0)
    return own, here, busy, _children() - before, reader


def _children() -> float:
    usage = getrusage(RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    main()
