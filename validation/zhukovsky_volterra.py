"""Zhukovsky and Volterra's gyrostat: proofs at random data, agreement with the enclosure, and what a state costs.

Run: python validation/zhukovsky_volterra.py [COUNT] [SEED]
"""

from __future__ import annotations

import sys
from fractions import Fraction
from random import Random
from statistics import median
from time import process_time

from heavytop.exact.cases.zhukovsky_volterra import ZhukovskyVolterra
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.top.equations import HEAVY_GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State

BITS_60, BITS_50 = 200, 170
LATE = Fraction(10**6)


def drawn(random: Random) -> ZhukovskyVolterra:
    """Any body, rotor and start."""

    def number() -> Fraction:
        return Fraction(random.randint(-40, 40), random.randint(1, 20))

    moments = sorted(abs(number()) + Fraction(1, 10) for _ in range(3))
    moments[2] = min(moments[2], (moments[0] + moments[1]) * Fraction(15, 16))
    random.shuffle(moments)
    top = HeavyTop(moments, 0, (0, 0, 0), [number() for _ in range(3)])
    return ZhukovskyVolterra(top, State([number() for _ in range(3)], [number() for _ in range(3)]))


def residual(motion: ZhukovskyVolterra, time: Fraction) -> float:
    """The largest radius of y' − f(y), relative to |f| above 1; raises AssertionError where a ball does not hold 0."""
    series = motion.series(time, 3, BITS_60)
    with working_precision(2 * BITS_60):
        exact = HEAVY_GYROSTAT.parameters(motion.top, motion.start)
        field = HEAVY_GYROSTAT.field(exact.mapped(lambda value: ball(Fraction(value))), series)
        off = [(y.derivative() - f)[k] for y, f in zip(series, field, strict=True) for k in range(2)]
        sizes = [1 + abs(f[k]) for f in field for k in range(2)]
        assert all(each.contains(0) for each in off)
        return max(float((each / size).rad()) for each, size in zip(off, sizes, strict=True))


def main() -> None:
    """Print the largest radius of a residual, the distance from the enclosure, and times."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    random = Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    radii, apart, first, later = [], [], [], []
    for _ in range(count):
        motion = drawn(random)
        radii.append(residual(motion, Fraction(7, 3)))
        afresh = ZhukovskyVolterra(motion.top, motion.start)
        began = process_time()
        afresh.state(LATE, BITS_50)
        first.append(process_time() - began)
        began = process_time()
        for step in range(1, 101):
            afresh.state(LATE + step, BITS_50)
        later.append((process_time() - began) / 100)
        rate = 1 + max(map(abs, motion.start.omega))
        time = 10 / rate
        enclosed = Validated(motion.top, motion.start, HEAVY_GYROSTAT).state(time, BITS_50)
        pairs = list(zip(motion.state(time, BITS_50), enclosed, strict=True))
        assert all(a.overlaps(b) for a, b in pairs)
        apart.append(max(float(abs(a - b).upper() / (1 + abs(a))) for a, b in pairs))
    print(f"{count} gyrostats of Zhukovsky and Volterra: every residual holds 0, largest radius {max(radii):.1e}")
    print(f"  enclosure after ten radians: farthest {max(apart):.1e}")
    print(
        f"  50 digits at t = 10^6: first state median {1e3 * median(first):.1f} ms, largest {1e3 * max(first):.1f} ms,"
    )
    print(f"  a state {1e3 * median(later):.2f} ms, largest {1e3 * max(later):.2f} ms")


if __name__ == "__main__":
    main()
