"""The free body's precession by theta functions: which choice of signs is right, in 60 digits.

At random bodies and starts the equations of motion are integrated by Taylor series of mpmath, with φ' of the
kinematics beside them; nothing of heavytop is used.  Each of the four choices of signs in

    e^(2iφ1) = θ01(v − i a)/θ01(v + i a),   φ2 = 2πt/T',   1/T' = M/(2πI1) − b (i/(πT)) θ01'(iα)/θ01(iα),   v = 2t/T

with a = ±α, b = ±1 and sn(2iαK) = +i √(I3 (M² − 2EI1)/(I1 (2EI3 − M²))) is compared with it.

    python -m validation.precession_theta [CASES [SEED]]
"""

from __future__ import annotations

import random
import sys
from collections.abc import Sequence
from itertools import product

import mpmath
from mpmath import mpf

DIGITS = 60
SIGNS = tuple(product((1, -1), repeat=2))


def integrated(moments: Sequence[mpf], omega: Sequence[mpf], time: mpf) -> mpf:
    """φ of the body at ``time``, by its rate M (I1Ω1² + I2Ω2²)/(I1²Ω1² + I2²Ω2²) along Euler's equations."""
    i1, i2, i3 = moments
    size = mpmath.sqrt(sum((i * w) ** 2 for i, w in zip(moments, omega, strict=True)))

    def rates(_t: mpf, y: Sequence[mpf]) -> list[mpf]:
        a, b, c, _ = y
        turn = size * (i1 * a * a + i2 * b * b) / ((i1 * a) ** 2 + (i2 * b) ** 2)
        return [(i2 - i3) / i1 * b * c, (i3 - i1) / i2 * c * a, (i1 - i2) / i3 * a * b, turn]

    return mpmath.odefun(rates, 0, [*omega, mpf(0)], tol=mpf(10) ** -(DIGITS + 15))(time)[3]


def by_theta(moments: Sequence[mpf], omega: Sequence[mpf], time: mpf, signs: tuple[int, int]) -> mpf:
    """φ1 + φ2 at ``time`` with these signs, 0 at t = 0; the body starts with Ω2 = 0, Ω1 > 0, Ω3 > 0."""
    i1, i2, i3 = moments
    momentum2 = sum((i * w) ** 2 for i, w in zip(moments, omega, strict=True))
    energy2 = sum(i * w**2 for i, w in zip(moments, omega, strict=True))
    below, above = momentum2 - energy2 * i1, energy2 * i3 - momentum2
    m = (i2 - i1) * above / ((i3 - i2) * below)
    rate = mpmath.sqrt((i3 - i2) * below / (i1 * i2 * i3))
    quarter, nome = mpmath.ellipk(m), mpmath.qfrom(m=m)
    alpha = mpmath.ellipf(mpmath.atan(mpmath.sqrt(i3 * below / (i1 * above))), 1 - m) / (2 * quarter)
    period = 4 * quarter / rate

    def theta(v: mpmath.mpc, order: int = 0) -> mpmath.mpc:
        return mpmath.jtheta(4, mpmath.pi * v, nome, order) * mpmath.pi**order

    v = 2 * time / period
    first = mpmath.arg(theta(v - signs[0] * 1j * alpha) / theta(v + signs[0] * 1j * alpha)) / 2
    slope = theta(1j * alpha, 1) / theta(1j * alpha)
    turns = mpmath.sqrt(momentum2) / (2 * mpmath.pi * i1) - signs[1] * 1j / (mpmath.pi * period) * slope
    return first + 2 * mpmath.pi * turns.real * time


def case(rng: random.Random) -> dict[tuple[int, int], mpf]:
    """The error of each choice of signs at a random body and start with 2EI2 < M²."""
    i1 = mpf(rng.randint(100, 200)) / 100
    i2 = i1 * rng.randint(110, 150) / 100
    i3 = min(i2 * rng.randint(110, 150) / 100, (i1 + i2) * mpf("0.99"))
    if i3 <= i2:
        return case(rng)
    spin = mpf(rng.randint(50, 150)) / 100
    # on the side of the third axis of the separatrix
    most = mpmath.sqrt(i3 * (i3 - i2) / (i1 * (i2 - i1))) * spin
    omega = (most * rng.randint(20, 90) / 100, mpf(0), spin)
    time = mpf(rng.randint(20, 120)) / 100
    true = integrated((i1, i2, i3), omega, time)
    return {signs: abs(by_theta((i1, i2, i3), omega, time, signs) - true) for signs in SIGNS}


def main(count: int = 20, seed: int = 37) -> int:
    """0 if one choice of signs agrees everywhere and each other one nowhere."""
    rng = random.Random(seed)
    with mpmath.workdps(DIGITS + 20):
        errors = [case(rng) for _ in range(count)]
        for signs in SIGNS:
            found = [error[signs] for error in errors]
            low, high = mpmath.nstr(min(found), 3), mpmath.nstr(max(found), 3)
            print(f"a = {'+-'[signs[0] < 0]}alpha, b = {signs[1]:+d}: errors from {low} to {high}")
        right = all(error[-1, -1] < mpf(10) ** -(DIGITS - 2) for error in errors)
        wrong = all(error[signs] > mpf("1e-6") for error in errors for signs in SIGNS if signs != (-1, -1))
    return 0 if right and wrong else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
