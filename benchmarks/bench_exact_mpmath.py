"""How much faster are the balls than the same formula on mpmath?

The whole state of a rotating physical pendulum at t = 10^6: sn, cn, dn with the nome and the period made before, on
both sides; interleaved, medians.  mpmath runs on gmpy2.

Run: python -m pytest benchmarks/bench_exact_mpmath.py --benchmark-enable
"""

from fractions import Fraction
from statistics import median
from time import perf_counter

import mpmath
import pytest

from heavytop.exact.balls import midpoint, radius, radius_text
from heavytop.exact.pendulum import Pendulum
from heavytop.measure.certify import bits_of
from heavytop.suite.cases import CASES

TIME = Fraction(10**6)


class OnMpmath:
    """The formula of exact/pendulum.py for h > N about axis 1, in floating point of mpmath's working precision."""

    def __init__(self, motion: Pendulum) -> None:
        def big(value: Fraction):
            return mpmath.mpf(value.numerator) / value.denominator

        (i1, _, _), (_, n2, n3) = map(big, motion.top.inertia), map(big, motion.top.moment)
        self.gamma = [big(g) for g in motion.start.gamma]
        self.omega = big(motion.start.omega[0])
        size = mpmath.sqrt((n2**2 + n3**2) * (self.gamma[1] ** 2 + self.gamma[2] ** 2))
        height = n2 * self.gamma[1] + n3 * self.gamma[2]
        energy = i1 * self.omega**2 / 2 + height
        m = 2 * size / (energy + size)
        self.rate = mpmath.sqrt((energy + size) / (2 * i1))
        self.period, self.nome = 4 * mpmath.ellipk(m), mpmath.qfrom(m=m)
        self.sign = -1 if self.omega > 0 else 1
        torque = n2 * self.gamma[2] - n3 * self.gamma[1]
        half = mpmath.atan2(-torque, -height) / 2
        self.half = mpmath.cos(half), mpmath.sin(half)
        self.start = mpmath.ellipf(self.sign * half, m)

    def state(self, time):
        u = self.rate * time + self.start
        u -= self.period * mpmath.floor(u / self.period)
        sn, cn, dn = (mpmath.ellipfun(name, u, q=self.nome) for name in ("sn", "cn", "dn"))
        c = cn * self.half[0] + self.sign * sn * self.half[1]
        s = self.sign * sn * self.half[0] - cn * self.half[1]
        cosine, sine = c * c - s * s, 2 * c * s
        _, g2, g3 = self.gamma
        return [-2 * self.sign * self.rate * dn, 0, 0, 0, cosine * g2 - sine * g3, sine * g2 + cosine * g3]


@pytest.mark.parametrize("digits", [50, 1000])
def test_pendulum_against_mpmath(benchmark, digits: int) -> None:
    motion = Pendulum(CASES["pendulum"].top, CASES["pendulum"].start)
    bits = bits_of(digits)
    with mpmath.workdps(digits + 20):
        peer, time = OnMpmath(motion), mpmath.mpf(10**6)

        def seconds(call) -> float:
            began = perf_counter()
            call()
            return perf_counter() - began

        ours, theirs = motion.state(TIME, bits), peer.state(time)
        apart = max(abs(mpmath.mpf(m.numerator) / m.denominator - b) for m, b in zip(map(midpoint, ours), theirs))  # noqa: B905
        assert apart < mpmath.mpf(10) ** (2 - digits)
        pairs = [(seconds(lambda: motion.state(TIME, bits)), seconds(lambda: peer.state(time))) for _ in range(51)]
    benchmark(motion.state, TIME, bits)
    benchmark.extra_info["ours_milliseconds"] = f"{median(a for a, _ in pairs) * 1e3:.3g}"
    benchmark.extra_info["mpmath_milliseconds"] = f"{median(b for _, b in pairs) * 1e3:.3g}"
    benchmark.extra_info["times_faster_than_mpmath"] = f"{median(b / a for a, b in pairs):.2f}"
    benchmark.extra_info["largest_radius"] = radius_text(max(map(radius, ours)))
    benchmark.extra_info["apart"] = mpmath.nstr(apart, 3)
