"""Edits of a report, each weakening something: `python validation/edited_reports.py [EDITS] [SEED] [REPORT ...]`.

Reports are `results/default`, `results/growth` and `results/peers` where none is given, with as many edits each.  How
often is an edited report the same as the report, or better?  Exit code 1 where it ever is.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from support.edited_reports import trials  # noqa: E402


def main(count: int, seed: int, reports: list[Path]) -> int:
    passed = Counter()
    for report in reports:
        seen = Counter()
        with TemporaryDirectory() as folder:
            for name, verdict in trials(report, Path(folder), seed, count):
                seen[verdict] += 1
                if verdict in ("same", "better"):
                    passed[name] += 1
        print(f"{report.name}: {dict(seen)}", flush=True)
    print(f"passed: {sum(passed.values())} of {count * len(reports)} {dict(passed) or ''}")
    return int(bool(passed))


if __name__ == "__main__":
    count, seed = (int(text) for text in (sys.argv[1:3] + ["500", "1"][len(sys.argv) - 1 :])[:2])
    chosen = [Path(text) for text in sys.argv[3:]]
    sys.exit(main(count, seed, chosen or [ROOT / "results" / name for name in ("default", "growth", "peers")]))
