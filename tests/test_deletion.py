"""Each feature can be deleted: one a run, chosen by the commit; all of them by ``python -m validation.deletion``."""

import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from heavytop.features import NAMES
from heavytop.version import commit

ROOT = Path(__file__).parents[1]
CHOSEN = NAMES[zlib.crc32((commit() or "").encode()) % len(NAMES)]


def deletion(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "validation.deletion", *arguments, "--few"], cwd=ROOT, capture_output=True, text=True
    )


@pytest.mark.slow
def test_a_feature_can_be_deleted() -> None:
    done = deletion(CHOSEN)
    assert done.returncode == 0, done.stdout


@pytest.mark.slow
def test_a_shared_room_that_imports_a_feature_is_found() -> None:
    done = deletion("events", "--plant")
    assert done.returncode == 1
    assert "without events: imports" in done.stdout
