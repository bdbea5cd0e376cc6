"""Degradations and repairs of an integrator as a comparison sees them: `validation/degraded_integrators.py [SEED]`.

200 pairs of reports, a better one and a worse one: 140 are measured, of an integrator that has one of a dozen faults or
none (`tests/support/degraded_integrators.py`), 60 are rows of `results/default` with edited errors and bands.  From the
better to the worse, no verdict may be same or better.  100 of them the other way round: no verdict, and no step of a
history, may be worse.  What makes some error larger, or is given a wide band, is no repair.  Exit code 1 where one
fails.
"""

from __future__ import annotations

import sys
from collections import Counter
from itertools import islice
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from support.degraded_integrators import WIDE, edited_pairs, installed, marked_worse, pairs, repaired, verdict  # noqa: E402
from support.reports import store  # noqa: E402

MEASURED, EDITED, REPAIRS = 140, 60, 100


def main(seed: int) -> int:
    with TemporaryDirectory() as folder, installed(Path(folder)):
        found = list(islice(pairs(seed), MEASURED))
    found += islice(edited_pairs(store.read(ROOT / "results" / "default"), seed), EDITED)
    seen, passed = Counter(), Counter()
    for name, better, worse in found:
        said = verdict(better, worse)
        seen[said] += 1
        if said in ("same", "better"):
            passed[name] += 1
    print(f"{len(found)} degradations: {dict(seen)}; passed: {sum(passed.values())} {dict(passed) or ''}")
    repairs, accused = Counter(), Counter()
    mended = [each for each in found if each[0] != WIDE and repaired(each[1], each[2])]
    for name, better, worse in Random(seed).sample(mended, REPAIRS):
        said = verdict(worse, better)
        repairs[said] += 1
        if said == "worse" or marked_worse(worse, better):
            accused[name] += 1
    print(f"{sum(repairs.values())} repairs: {dict(repairs)}; worse: {sum(accused.values())} {dict(accused) or ''}")
    return int(bool(passed or accused))


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1))
