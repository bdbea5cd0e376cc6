"""How many files a flow goes through: whoever follows one reads no more of them than before."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

HOPS = Path(__file__).parents[1] / "benchmarks" / "hops.py"
MOST = {"drift": 64, "propagate": 10, "compare": 16, "reference": 25}


@pytest.fixture(scope="module")
def printed() -> str:
    return subprocess.run([sys.executable, HOPS], capture_output=True, text=True, check=True, timeout=300).stdout


@pytest.mark.parametrize("flow", MOST)
def test_a_flow_goes_through_no_more_files_than_before(printed: str, flow: str) -> None:
    said = re.search(rf"^{flow}: (\d+) files, (\d+) without the mathematics$", printed, re.M)
    assert said, printed
    assert int(said[2]) <= int(said[1]) <= MOST[flow]
