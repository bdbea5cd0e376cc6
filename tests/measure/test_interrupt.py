"""Ctrl-C ends a long enclosure and a hard closed form: no single call of a library is long."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

GENERIC = ["--inertia", "3,2,1", "--weight", "1", "--centre", "1/2,1/3,1/5", "--omega", "1/10,2/5,9/10"]
LAGRANGE = ["--inertia", "2,2,1", "--weight", "1e-1000", "--centre", "0,0,1", "--omega", "1/5,1/3,2"]
FAR = ",".join(str(t) for t in range(1, 20_000))
TICKS = os.sysconf("SC_CLK_TCK")


def processor_seconds(process):
    return sum(map(int, Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11:13])) / TICKS


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks into /proc for the time a process has taken")
@pytest.mark.parametrize(
    ("motion", "times", "digits"),
    [(GENERIC, "3000", "50"), (GENERIC, "40", "1500"), (LAGRANGE, FAR, "50")],
    ids=["far away", "many digits", "a hard closed form"],
)
def test_an_interrupt_is_heard_within_seconds(motion, times, digits):
    process = subprocess.Popen(
        [sys.executable, "-m", "heavytop", "reference", *motion, "--gamma", "3/5,0,4/5", "--times", times, "--digits",
         digits],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while process.poll() is None and processor_seconds(process) < 1.2:
        time.sleep(0.02)
    assert process.poll() is None
    before = processor_seconds(process)
    process.send_signal(signal.SIGINT)
    while process.poll() is None and processor_seconds(process) < before + 3:
        time.sleep(0.01)
    running = process.poll() is None
    process.kill()
    output, errors = process.communicate(timeout=60)
    assert not running, "still running after three seconds of processor time"
    assert process.returncode == 130
    assert not output
    assert "Traceback" not in errors
