"""What a cold call costs: processor time of whole commands in units of `import heyoka, numpy`, in turns.

    python benchmarks/bench_cold.py [ROUNDS] [SRC ...]

SRC: folders such as ../before/src whose heavytop takes its turn beside this one.  Medians of ROUNDS (default 5) rounds,
after one that is not counted: it compiles modules, and machine code for the cache.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median

ROOT = Path(__file__).resolve().parents[1]
MOTION = [
    "--inertia",
    "3,2,1",
    "--weight",
    "1",
    "--centre",
    "1/2,1/3,1/5",
    "--omega",
    "1/10,2/5,9/10",
    "--gamma",
    "3/5,0,4/5",
    "--times",
    "1,8",
]
REPORT = str(ROOT / "results" / "default")
COMMANDS = {
    "list": ["list"],
    "propagate": ["propagate", *MOTION],
    "propagate, multiword": ["propagate", *MOTION, "--precision", "quad", "--integrator", "multiword"],
    "reference": ["reference", *MOTION, "--digits", "30"],
    "score": ["score", "motion.csv"],
    "compare": ["compare", REPORT, REPORT],
    "audit": ["audit", "ershkov-partial"],
}


def seconds(arguments: list[str], source: str, folder: str) -> float:
    """Processor time of a Python process."""
    before = getrusage(RUSAGE_CHILDREN)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    line = [sys.executable, *arguments]
    subprocess.run(line, env=environment | {"PYTHONPATH": source}, cwd=folder, capture_output=True, check=False)
    after = getrusage(RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """A line a command."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    sources = [str(ROOT / "src"), *(str(Path(name).resolve()) for name in sys.argv[2:])]
    with tempfile.TemporaryDirectory() as folder:
        script = ["awk", "-f", str(ROOT / "examples" / "rk4.awk")]
        Path(folder, "motion.csv").write_bytes(subprocess.run(script, capture_output=True, check=True).stdout)
        for name, arguments in COMMANDS.items():
            ratios: list[list[float]] = [[] for _ in sources]
            for _ in range(rounds + 1):
                unit = seconds(["-c", "import heyoka, numpy"], "", folder)
                for found, source in zip(ratios, sources, strict=True):
                    found.append(seconds(["-m", "heavytop", *arguments], source, folder) / unit)
            print(f"{name:22}", *(f"{median(found[1:]):6.2f}" for found in ratios), flush=True)


if __name__ == "__main__":
    main()
