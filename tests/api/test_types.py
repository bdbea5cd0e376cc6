"""What a type checker sees of ``import heavytop`` in a user's file."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

USER = """\
import numpy as np
import heavytop as ht

top = ht.HeavyTop(inertia=(3, 2, 1), weight=1, centre=("1/2", "1/3", "1/5"))
start = ht.State(omega=np.array([0.1, 0.4, 0.9]), gamma=("3/5", 0, "4/5"))
times = [1, "3/2", 2.0]
run = ht.propagate(top, start, times, ht.QUAD, integrator="heyoka", observer=None)
reveal_type(run)  # Trajectory
reveal_type(run.outcome)  # Outcome
reveal_type(run.times)  # Sequence[Fraction]
reveal_type(run.to_numpy())  # ndarray[...float64...]
reveal_type(run.texts())  # list[list[str]]
known = ht.reference(top, start, np.array([1.0, 2.0]), digits=40)
reveal_type(known.method)  # str
reveal_type(known.states[0][1].value)  # str
reveal_type(known.to_numpy())  # ndarray[...float64...]
reveal_type(known.radii())  # ndarray[...float64...]
score = ht.score(times, run.to_numpy(), top=top, start=start, precision=ht.DOUBLE)
reveal_type(score.digits_kept)  # float | None
reveal_type(ht.drift(run)["energy"].max)  # Metric
reveal_type(ht.audit("ershkov-partial").verdict)  # str
reveal_type(ht.ensemble([top], [start], times, ht.DOUBLE, threads=2))  # list[Trajectory]
report = ht.run("smoke", out="DIR")
reveal_type(report)  # Report
reveal_type(ht.compare(report, ht.read_report("OTHER")).verdict)  # str
reveal_type(ht.real(237).bits)  # int
reveal_type(ht.__version__)  # str
ht.propagate(top, start, times, ht.DOUBLE, stepping=None)  # error: Unexpected keyword argument "stepping"
ht.propagate(top, start, times, 53)  # error: Argument 4 to "propagate" has incompatible type "int"
ht.ensemble([top], [start], times, threads="2")  # error: Argument "threads" to "ensemble" has incompatible type "str"
ht.nonsense  # error: Module has no attribute "nonsense"
"""


@pytest.mark.slow
def test_a_type_checker_sees_the_types_of_every_public_function(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "user.py").write_text(USER)
    # by the project's settings, and in its cache: what is read here is not read again where the project is checked
    command = [sys.executable, "-m", "mypy", str(tmp_path / "user.py")]
    folder = Path(__file__).parents[2]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    said: dict[int, str] = {}
    for line in done.stdout.splitlines():
        if match := re.search(r"user\.py:(\d+): (.*)", line):
            said.setdefault(int(match[1]), match[2])
    for number, line in enumerate(USER.splitlines(), 1):
        _, _, expected = line.partition("  # ")
        if expected.startswith("error: "):
            assert expected in said.get(number, ""), done.stdout
        elif expected:
            begin, *rest = re.sub(r"(\w+\.)+", "", expected.replace("...", "\0")).split("\0")
            revealed = re.sub(r"(\w+\.)+(?=\w)", "", said.get(number, "")).replace("Union[float, None]", "float | None")
            assert revealed.startswith(f'note: Revealed type is "{begin}'), (line, said.get(number), done.stdout)
            assert all(part in revealed for part in rest), (line, said.get(number))
        else:
            assert number not in said, done.stdout
