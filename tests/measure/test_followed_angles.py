"""Euler angles followed through whole turns, against motions whose angles are known at any time."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from heavytop import DOUBLE, HEAVY_TOP, HeavyTop, State
from heavytop.measure.motion import compute

TIMES = [Fraction(1), Fraction(10)]


@pytest.mark.slow
@pytest.mark.parametrize(("tilt", "sign"), [("1/2", -1), ("1/1000", 1), ("100", -1)])
@pytest.mark.parametrize(("unit", "integrator"), [(Fraction(1), "heyoka"), (Fraction(2) ** 300, "multiword")])
def test_precession_of_a_free_symmetric_top(tilt: str, sign: int, unit: Fraction, integrator: str) -> None:
    # I = (2, 2, 1) with M = 10 γ: ψ' = |M|/2 = 5 and φ' = Ω3 - cos θ ψ' = 5 cos θ, however near the pole γ is
    m = Fraction(tilt)
    gamma = (2 * m / (1 + m * m), Fraction(0), (1 - m * m) / (1 + m * m))
    start = State(tuple(10 * sign * unit * g / i for g, i in zip(gamma, (2, 2, 1), strict=True)), gamma)
    times = [time / unit for time in TIMES]
    top = HeavyTop((2, 2, 1), 0, (0, 0, 1))
    motion = compute(top, start, times, DOUBLE, HEAVY_TOP, True, integrator=integrator)
    (phi, _, psi), (phi_end, theta, psi_end) = ([float(value) for value in angles] for angles in motion.angles)
    assert psi_end - psi == pytest.approx(sign * 5 * 9, abs=1e-6)
    assert phi_end - phi == pytest.approx(sign * 5 * 9 * float(gamma[2]), abs=1e-6)
    assert theta == pytest.approx(2 * math.atan(m), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["heyoka", "multiword"])
def test_turns_through_a_swing_beside_the_pole_are_told_apart(integrator: str) -> None:
    # a pendulum pushed a little aside passes the poles of θ on one side: half a turn of φ, not three halves or none
    top = HeavyTop((1, 1, 1), 1, (0, 0, -1))
    turns = {}
    for push in (Fraction(1, 1000), Fraction(-1, 1000)):
        start = State((Fraction(3), push, Fraction(0)), (Fraction(0), Fraction(1), Fraction(0)))
        motion = compute(top, start, [Fraction(1, 10), Fraction(30)], DOUBLE, HEAVY_TOP, True, integrator=integrator)
        turns[push] = float(motion.angles[1][2]) - float(motion.angles[0][2])
    first, second = turns.values()
    assert first == pytest.approx(-second, abs=1e-3)
    assert abs(first) > math.pi


@pytest.mark.slow
def test_at_a_pole_there_is_nothing_to_follow() -> None:
    top, start = HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, 0, 9), (0, 0, 1))
    motion = compute(top, start, [Fraction(50)], DOUBLE, HEAVY_TOP, attitude=True)
    assert motion.complete
    assert motion.angles[0][1] == "0"
