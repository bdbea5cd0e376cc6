"""The time left: right within 2 after a fifth of the way, on synthetic schedules; bars on terminals alone."""

import os
import pty
import random
import re
import subprocess
import sys
import time
from dataclasses import dataclass
from fractions import Fraction
from io import StringIO
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console
from typer.testing import CliRunner

from heavytop.cli import app, output
from heavytop.cli.output import Bar, Estimator, Progress, counted, duration, reaching, told_when_slow, waiting, watched
from heavytop.measure.motion import compute
from heavytop.precision import DOUBLE
from heavytop.records import SCHEMA, Report
from heavytop.report.store import store
from heavytop.top.equations import HEAVY_TOP
from support.helpers import START, TOP, options, python


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def ratios(weights: list[float], seconds: list[float], workers: int, expected: float) -> list[float]:
    """Estimated over true time left, at each end of a part, from a fifth to nine tenths of the way on."""
    free, order = [0.0] * workers, []
    for weight, took in sorted(zip(weights, seconds, strict=True), key=lambda pair: -pair[0]):
        first = free.index(min(free))
        free[first] += took
        order.append((free[first], weight))
    clock, end, found = Clock(), max(free), []
    estimator = Estimator(sum(weights), expected, clock)
    for at, weight in sorted(order):
        clock.now = 100 + at
        estimator.advance(weight)
        if 0.2 * end <= at <= 0.9 * end:
            found.append(estimator.seconds_left() / (end - at))
    return found


@pytest.mark.parametrize("workers", [1, 2, 8])
@pytest.mark.parametrize("speed", [0.1, 1.0, 20.0])
def test_the_time_left_is_right_within_2_after_a_fifth(workers: int, speed: float) -> None:
    source = random.Random(workers)
    for _ in range(40):
        count = source.randint(20 * workers, 200)
        weights = [source.choice((1.0, 3.0, 10.0)) * source.uniform(0.5, 2) for _ in range(count)]
        # each part takes as long as its weight says within a third, on a machine of any speed
        seconds = [weight * speed * source.uniform(0.75, 1.33) for weight in weights]
        found = ratios(weights, seconds, workers, 1 / workers)
        assert found
        assert all(0.5 < ratio < 2 for ratio in found)


def test_an_even_schedule_is_told_exactly_and_the_end_is_0() -> None:
    clock = Clock()
    estimator = Estimator(10, 2.0, clock)
    assert estimator.seconds_left() == 20
    for k in range(1, 11):
        clock.now = 100 + 2 * k
        estimator.advance(1)
        assert estimator.seconds_left() == pytest.approx(2 * (10 - k))
        assert estimator.fraction == k / 10
    estimator.advance(5)
    assert (estimator.done, estimator.seconds_left()) == (10, 0)


def test_waiting_between_two_parts_counts_and_never_below_0() -> None:
    clock = Clock()
    estimator = Estimator(2, 10.0, clock)
    clock.now += 10
    estimator.advance(1)
    clock.now += 4
    assert estimator.seconds_left() == pytest.approx(6)
    clock.now += 40
    assert estimator.seconds_left() == 0
    assert Bar(estimator, 2).said() == "0/2 rows, 50 %, longer than expected"
    estimator.reach(0.5)
    assert estimator.done == 1
    estimator.reach(2)
    assert Bar(estimator).said() == "100 %, about 0 s left"


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.2, "1 s"), (59, "59 s"), (61, "1:01"), (3661.5, "1:01:02"), (0, "0 s")]
)
def test_durations_are_short(seconds: float, text: str) -> None:
    assert duration(seconds) == text


@dataclass
class Part:
    label: str
    weight: float

    @property
    def key(self) -> SimpleNamespace:
        return SimpleNamespace(kind="part")


KINDS = {"part": SimpleNamespace(cost=lambda part: part.weight)}


def test_a_bar_says_rows_per_cent_and_time_left() -> None:
    console = Console(file=StringIO(), force_terminal=True, width=100)
    clock = Clock()
    bar = Bar(Estimator(4, 1.0, clock), 4, "rows", "", console)
    with bar:
        clock.now += 30
        assert bar.said() == "0/4 rows"  # nothing is measured yet that tells how long
        bar.estimator.advance(1)
        bar.finished = 1
        bar.label = "drift lagrange"
        assert bar.said() == "1/4 rows, 25 %, about 1:30 left"
    assert re.search("drift lagrange .* 1/4 rows, 25 %", console.file.getvalue())


def test_nothing_is_written_where_there_is_no_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    with Progress([Part("a", 1.0), Part("b", 2.0)], KINDS, 2) as advance:
        advance(Part("a", 1.0))
    with counted("figures", 2, "figures", 1.0) as step:
        step()
    with watched("reference", lambda: 0.5, 1.0):
        pass
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_a_reference_reports_on_a_terminal_and_its_output_stays_clean() -> None:
    master, slave = pty.openpty()
    # drawn a hundred times a second: a fast machine is through in less than the half second between two draws
    script = "from heavytop.cli import output; from heavytop.__main__ import main; output._EVERY = 0.01; main()"
    asked = options(inertia="3,5/2,3/2", weight="3/2", times="300", digits="60")
    line = [sys.executable, "-c", script, "reference", *asked, "--json"]
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "100"}

    def read() -> bytes:
        try:
            return os.read(master, 65536)
        except OSError:  # nobody holds the other end
            return b""

    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=slave, env=environment) as process:
        os.close(slave)
        written = b"".join(iter(read, b""))
        printed = process.stdout.read()
    os.close(master)
    assert printed.lstrip().startswith(b"{")
    assert b" %" in written
    assert b"left" in written


@pytest.mark.slow
def test_every_command_says_once_where_it_is_when_it_takes_long(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(output, "SILENCE", 0.0)
    said = set()
    folder = tmp_path / "report"
    report = Report(SCHEMA, {"name": "empty"}, {"packages": {}}, [])
    folder.mkdir()
    store.write(report, folder)
    for words in (
        ["propagate", *options(times="3e3")],
        ["reference", *options(times="3", digits="60")],
        ["list"],
        ["show", folder],
    ):
        done = CliRunner().invoke(app, list(map(str, words)))
        assert done.exit_code == 0, done.output
        (line,) = done.stderr.splitlines()
        assert re.match(rf"heavytop: {words[0]}: \d+ s so far, ", line)
        said.add(words[0])
    assert said <= {each.name for each in app.registered_commands}
    for each in app.registered_commands:  # and all the others pass the same door
        assert each.callback.__code__ is app.registered_commands[0].callback.__code__


@pytest.mark.slow
def test_the_line_says_what_is_done_and_how_far(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setattr(output, "SILENCE", 0.1)
    with told_when_slow("score"), counted("comparison", 8, "states", 1.0) as advance:
        advance()
        advance()
        time.sleep(0.4)
    (line,) = capsys.readouterr().err.splitlines()
    assert re.fullmatch(
        r"heavytop: score: 1 s so far, comparison: 2/8 states, 25 %, (about \d+ s left|longer than expected)", line
    )
    with told_when_slow("audit"), waiting("audit of x", 0.4):
        time.sleep(0.2)
    assert re.search(r"so far, audit of x, 1 s at most: [2-9]\d %", capsys.readouterr().err)
    with told_when_slow("propagate"), reaching("integration", 1.0) as reach:
        reach(0.004)
        time.sleep(0.2)
    assert re.search(r"integration: 0\.4 %, (about \d+ s left|longer than expected)", capsys.readouterr().err)
    with told_when_slow("propagate"), reaching("integration", 0.01):
        time.sleep(0.2)
    assert "integration: how far is not known" in capsys.readouterr().err
    with told_when_slow("compare"):
        pass
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_a_third_party_integrator_cannot_silence_it() -> None:
    """Its descriptors are shut while it runs: the line goes out all the same."""
    script = """if True:
        import time
        from heavytop.cli import output
        from heavytop.integrate.peers.contract import quiet
        output.prepare()
        output.SILENCE = 0.1
        with output.told_when_slow("run"), quiet():
            time.sleep(0.5)
    """
    assert python("-c", script).stderr == "heavytop: run: 1 s so far, going on\n"


def test_an_integration_reports_often_enough_and_its_states_stay_the_same() -> None:
    for integrator in ("heyoka", "multiword"):
        heard: list[Fraction] = []
        times = [Fraction(7), Fraction(2000)]
        plain, told = (
            compute(TOP, START, times, DOUBLE, HEAVY_TOP, integrator=integrator, reached=each)
            for each in (None, heard.append)
        )
        assert (told.states, told.drift, told.trajectory.steps) == (plain.states, plain.drift, plain.trajectory.steps)
        assert told.trajectory.times == plain.trajectory.times
        assert heard == sorted(heard)
        assert heard[0] <= 2
        assert max(b / a for a, b in pairwise(heard)) <= 2
