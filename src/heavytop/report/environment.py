"""The environment block of a report: everything outside the plan that can change bits."""

from __future__ import annotations

import platform
import subprocess
from pathlib import Path
from typing import Any

from heavytop.precision import available
from heavytop.suite.workers import versions


def environment() -> dict[str, Any]:
    """Versions, processor, formats; ``commit`` where the program runs from a git checkout."""
    import flint
    import heyoka
    import numpy

    return {
        "packages": versions(),
        "flint": str(flint.__FLINT_VERSION__),
        "commit": _commit(),
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        "simd_width_double": int(heyoka.recommended_simd_size()),
        "extended_bits": int(numpy.finfo(numpy.longdouble).nmant) + 1,
        "formats": {name: reason or "available" for name, reason in available().items()},
        "code_cache": "none: every integrator was compiled in this run",
    }


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"


def _commit() -> str | None:
    here = Path(__file__).resolve().parent
    try:
        done = subprocess.run(
            ["git", "-C", str(here), "describe", "--always", "--dirty", "--abbrev=40", "--match="],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    # an installed copy may lie inside somebody else's repository
    tracked = (here.parents[2] / "pyproject.toml").exists() and done.returncode == 0
    return done.stdout.strip() if tracked else None
