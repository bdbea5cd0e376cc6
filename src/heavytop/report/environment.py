"""The environment block of a report: everything outside the plan that can change bits."""

from __future__ import annotations

import platform
import re
from importlib import metadata
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

from heavytop.precision import available
from heavytop.suite.workers import versions
from heavytop.version import commit


def environment() -> dict[str, Any]:
    """Versions, processor, formats; ``commit`` of the checkout or of the wheel, where one is known."""
    import flint
    import heyoka
    import numpy

    return {
        "packages": versions(),
        "flint": str(flint.__FLINT_VERSION__),
        "commit": commit(),
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        **_target(),
        "llvm": _llvm_version(),
        "simd_width_double": int(heyoka.recommended_simd_size()),
        "extended_bits": int(numpy.finfo(numpy.longdouble).nmant) + 1,
        "formats": {name: reason or "available" for name, reason in available().items()},
        "code_cache": "none: every integrator was compiled in this run",
    }


def _target() -> dict[str, Any]:
    """The processor and its features that heyoka compiles for."""
    import heyoka

    x = heyoka.make_vars("x")
    said = str(heyoka.cfunc([x], [x]).llvm_states[0])
    cpu = re.search(r"^Target CPU *: (.+)$", said, re.M)
    features = re.search(r"^Target features *: (.+)$", said, re.M)
    return {
        "cpu_target": cpu[1] if cpu else "unknown",
        "cpu_features": sorted(re.findall(r"\+([^,]+)", features[1])) if features else [],
    }


def _llvm_version() -> str:
    """The version of the compiler inside heyoka's library, which says it nowhere else."""
    for file in metadata.files("heyoka") or ():
        if file.name.startswith("libheyoka"):
            with open(file.locate(), "rb") as library, mmap(library.fileno(), 0, access=ACCESS_READ) as content:
                at = content.find(b"LLVM_VERSION=")
                found = re.match(rb"LLVM_VERSION=([0-9.]+)", content[at : at + 40]) if at >= 0 else None
                return found[1].decode() if found else "unknown"
    return "unknown"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"
