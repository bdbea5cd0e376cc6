"""Claims written by hand where a proof or a witness is easily wrong: is what holds true, and what is refuted false?

``subtle_claims.jsonl`` has one a line: a label, its truth, and the table as a file would have it, without its name.

    true   a motion, an integral, a relation or numbers, for all parameters that ``assume`` admits
    false  for some of them none
    open   true at the samples alone, or nowhere defined, or of data that are none: it must not hold

They are about signs of a parameter, parameters that may vanish, terms of 1e-30, branches of roots, log and atan2,
removable singularities, moduli 0, 1 and beyond, imaginary intermediate values, assumptions that exclude each other,
ranges of t and of the variable of a quadrature, angles modulo 2 pi, conditions that the flow leaves, full tensors,
rotors, and half units of a printed digit.

    python validation/subtle_claims.py [LABEL ...]
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

from heavytop.errors import InputError
from heavytop.features.claims.audit.audit import audit_claim, claim_from_table

CLAIMS = Path(__file__).with_suffix(".jsonl")


def verdict_on(table: dict[str, object]) -> str:
    """The verdict, or "refused"."""
    try:
        return audit_claim(claim_from_table({"name": "subtle"} | table, "subtle")).verdict
    except InputError:
        return "refused"


def main() -> int:
    """Prints the counts; 1 where what is not true holds, or what is true is refuted."""
    counts: Counter[tuple[str, str]] = Counter()
    wrong = 0
    for line in CLAIMS.read_text("utf-8").splitlines():
        claim = json.loads(line)
        if sys.argv[1:] and claim["label"] not in sys.argv[1:]:
            continue
        verdict, truth = verdict_on(claim["table"]), claim["truth"]
        counts[truth, verdict] += 1
        if (verdict == "holds" and truth != "true") or (verdict == "refuted" and truth == "true"):
            wrong += 1
            print("wrong:", claim["label"], verdict)
        elif (truth, verdict) not in (("true", "holds"), ("false", "refuted")) and truth != "open":
            print(f"not decided, {truth}:", claim["label"], verdict)
    for (truth, verdict), count in sorted(counts.items()):
        print(f"{truth:6} {verdict:10} {count}")
    print(f"{wrong} wrong of {sum(counts.values())}")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
