"""How long does a validated state take, from a cold start?  The digits that came out travel along as text.

Machine code is compiled before: once a process.
"""

from fractions import Fraction
from math import log10

import pytest

from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import relative_bits
from heavytop.top.heavy_top import HeavyTop, State

GENERIC = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))


@pytest.mark.parametrize(
    ("time", "digits", "rounds"),
    [(8, 60, 5), (-3, 60, 5), (8, 200, 2), (100, 30, 1), (100, 100, 1), (300, 30, 1), (1000, 30, 1)],
)
def test_generic_top(benchmark, time, digits, rounds):
    bits = int(digits / log10(2)) + 4

    def solve():
        return Validated(GENERIC, START).state(Fraction(time), bits)

    solve()
    balls = benchmark.pedantic(solve, rounds=rounds, iterations=1)
    benchmark.extra_info["digits"] = str(int(min(map(relative_bits, balls)) * log10(2)))


@pytest.mark.parametrize("time", [10**4, 10**6])
def test_refusal_is_quick(benchmark, time):
    from heavytop.errors import OutOfReach

    def refused():
        with pytest.raises(OutOfReach):
            Validated(GENERIC, START).state(Fraction(time), 104)

    benchmark.pedantic(refused, rounds=1, iterations=1)
