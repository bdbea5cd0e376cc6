"""What Hess' top with M·γ ≠ 0 costs at many digits: the matrix over a period once, then states at any time.

    python benchmarks/bench_hess.py [DIGITS ...]

The case `hess`; seconds of processor time, of a first state (t = 10) and of another (t = 1000).
"""

from __future__ import annotations

import sys
from fractions import Fraction
from math import ceil, log2
from time import process_time

from heavytop.cases import CASES
from heavytop.exact.cases.hess import Hess


def main() -> None:
    """A line for each number of digits."""
    for digits in [int(text) for text in sys.argv[1:]] or [50, 200, 1000]:
        case = CASES["hess"]
        motion, bits = Hess(case.top, case.start), ceil(digits * log2(10))
        seconds = []
        for time in (10, 1000):
            began = process_time()
            motion.state(Fraction(time), bits)
            seconds.append(process_time() - began)
        print(f"{digits:5} digits   first {seconds[0]:8.3f} s   another {seconds[1]:8.4f} s")


if __name__ == "__main__":
    main()
