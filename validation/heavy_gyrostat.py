"""Random heavy gyrostats against a Taylor series of (Ω, γ, ξ) in mpmath that knows nothing of this program.

    python validation/heavy_gyrostat.py [MOTIONS] [DIGITS]

prints for each motion the largest distance of the enclosure, of words and of heyoka (double) from it.
"""

import sys
from fractions import Fraction
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import heavytop as ht
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.precision import exact
from heavytop.top.attitude import perpendicular
from support.full_tensor import integrate_top
from support.helpers import fraction, positive, unit_vector, vector


def main(motions: int = 20, digits: int = 50) -> None:
    """Prints a line for each motion, and fails where the enclosure does not hold the independent integration."""
    random = Random(1)
    for number in range(motions):
        size = random.choice([Fraction(1, 100), Fraction(1), Fraction(10)])
        top = ht.HeavyTop([positive(random) for _ in range(3)], 1, vector(random), [size * k for k in vector(random)])
        start = ht.State([w / 10 for w in vector(random)], unit_vector(random))
        rate = max(*map(abs, start.omega), max(map(abs, top.rotor or ())) / min(top.inertia))
        time = random.choice([1, -1]) * (1 + abs(fraction(random))) / (10 * rate)
        xi = [exact(value) for value in perpendicular([float(g) for g in start.gamma])]
        known = integrate_top(top, start, time, xi, digits)
        exactly = Validated(top, start, ht.HEAVY_GYROSTAT, xi=tuple(xi))
        bits = int(3.33 * digits)
        balls = [*exactly.state(time, bits), *exactly.attitude(time, bits)]
        near = [(abs(midpoint(b) - v), radius(b)) for b, v in zip(balls, known, strict=True)]
        scale = max(map(abs, known))
        assert all(off <= reach + scale * Fraction(1, 10**digits) for off, reach in near), (top, start, time)
        line = [f"{float(max(off for off, _ in near) / scale):.1e}"]
        for name in ("words", "heyoka"):
            run = ht.propagate(top, start, [time], integrator=name)
            given = Validated(run.problem.top, run.problem.start, ht.HEAVY_GYROSTAT).state(exact(run.times[0]), 100)
            pairs = zip(run.states[0], given, strict=True)
            line.append(f"{name} {float(max(abs(exact(a) - midpoint(b)) for a, b in pairs) / scale):.1e}")
        print(f"{number}: |k| {float(max(map(abs, top.rotor or ()))):.2g}, t {float(time):.3g}: ", *line, flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
