"""What is outside of a class is refused with the condition that failed, and its value."""

from __future__ import annotations

import pytest

from heavytop.errors import NotInClass
from heavytop.exact import catalogue
from heavytop.top.heavy_top import HeavyTop, State

UNIT, UP, SIDE = ("2/3", "-1/3", "2/3"), (0, 0, 1), (0, 1, 0)
B, G, S = (2, 2, 1), (4, 4, 1), (1, "7/16", "3/4")
"""Moments of Bobylev and Steklov, Delone and Kovalevskaya; of Goryachev and Chaplygin; of a top of Steklov."""
HESS, MOVING = ((8, 6, 3), 1, (1, 0, 2)), (("3/4", "1/2", -1), SIDE)
OUTSIDE = [
    ("BobylevSteklov", (B, 1, (1, 1, 0)), ((1, 0, 1), (0, 1, 1)), "P b = 1, P c = 0"),
    ("BobylevSteklov", ((3, 2, 1), 1, (1, 0, 0)), ((1, 0, 1), (0, 1, 1)), "I1 - 2 I3 = 1"),
    ("BobylevSteklov", (B, 1, (1, 0, 0)), ((1, "1/9", 1), (0, 1, 1)), "Omega2 = 1/9"),
    ("BobylevSteklov", (B, 1, (1, 0, 0)), ((1, 0, 1), (0, 1, 2)), "P a gamma3 - I3 Omega1 Omega3 = 1"),
    ("Delone", ((2, 2, "3/4"), 1, (1, 0, 0)), ((1, 0, 0), (1, 0, 0)), "I1 - 2 I3 = 1/2"),
    ("Delone", (B, 1, (1, 0, "1/9")), ((1, 0, 0), (1, 0, 0)), "1/9"),
    ("Delone", (B, 1, (0, 0, 0)), ((1, 0, 0), (1, 0, 0)), "P r != 0"),
    ("Delone", (B, 1, (1, 0, 0)), ((1, 1, 0), (1, 0, 0)), r"xi = \(-1, 2\)"),
    ("Euler", ((3, 2, 1), 3, (0, "1/2", 0)), ((1, 0, 0), UP), r"P r = \(0, 3/2, 0\)"),
    ("GoryachevChaplygin", ((3, 3, 1), 1, (1, 0, 0)), (("3/4", "1/2", 0), UP), "I1 - 4 I3 = -1"),
    ("GoryachevChaplygin", (G, 1, (1, 0, 1)), (("3/4", "1/2", 0), UP), "P c = 1"),
    ("GoryachevChaplygin", (G, 1, (1, 0, 0)), (("3/4", "1/2", "1/7"), UP), "M·gamma = 1/7"),
    ("GoryachevChaplygin", (G, 1, (1, 0, 0)), (("3/4", "1/2", "1/7"), (0, 0, 0)), r"gamma = \(0, 0, 0\)"),
    ("GoryachevChaplygin", (G, 1, (1, "1/3", 0)), ((0, 0, 0), ("3/5", 0, "4/5")), "both separated variables rest"),
    ("GoryachevChaplygin", (G, 1, (1, 0, 0)), ((0, "1/4", 0), ("3/5", 0, "4/5")), "both separated variables"),
    ("GoryachevChaplyginRest", (G, 1, (1, 0, 0)), ((1, 0, 0), (1, 0, 0)), "M·gamma = 4"),
    ("GoryachevChaplyginRest", (G, 1, (1, 0, 0)), ((1, 0, 1), SIDE), "G = 1"),
    ("GoryachevChaplyginRest", (G, 1, (1, 0, 0)), ((0, 2, 0), ("4/5", 0, "3/5")), r"h\^2 <="),
    ("GoryachevChaplyginRest", (G, 1, (1, 0, 0)), ((0, 0, "1/3"), ("4/5", "3/5", 0)), "off axis 3"),
    ("GoryachevChaplyginRest", (G, 1, (1, 0, 0)), ((0, 0, 0), ("4/5", "3/5", 0)), "off axis 3"),
    ("GoryachevChaplyginRest", (G, 1, (1, 0, 0)), ((0, 0, 0), (1, 0, 0)), "off axis 3"),
    ("GoryachevChaplyginRest", ((4, 4, 2), 1, (1, 0, 0)), ((0, 0, 0), UNIT), "I1 - 4 I3 = -4"),
    *(
        (case, *data)
        for case in ("Hess", "HessPendulum")
        for data in (
            (((8, 6, 3), 1, (1, 1, 2)), MOVING, "P b = 1"),
            (((8, "17/3", 3), 1, (1, 0, 2)), MOVING, "the difference = -20/3"),
            (HESS, (("9/8", "1/2", -1), SIDE), "M·P r = 3"),
            (HESS, (MOVING[0], (0, 0, 0)), r"gamma = \(0, 0, 0\)"),
        )
    ),
    ("HessPendulum", HESS, MOVING, "M·gamma = 3"),
    ("HessPendulum", HESS, ((0, 3, 0), (1, 0, 1)), "off axis 2"),
    ("Hess", HESS, (("3/4", 0, -1), SIDE), "M·gamma = 0"),
    ("Kovalevskaya", ((2, "3/2", 1), 1, (1, 0, 0)), ((1, 2, 3), UP), "I1 - I2 = 1/2, I1 - 2 I3 = 0"),
    ("Kovalevskaya", (("2.1", "2.1", 1), 1, (1, 0, 0)), ((1, 2, 3), UP), "I1 - 2 I3 = 1/10"),
    ("Kovalevskaya", (B, 1, (1, 0, 1)), ((1, 2, 3), UP), "P c = 1"),
    ("Kovalevskaya", (B, 1, (0, 0, 0)), ((1, 2, 3), UP), r"P r = \(0, 0, 0\)"),
    ("Kovalevskaya", (B, 1, (1, 0, 0)), ((1, 2, 3), (0, 0, 0)), r"gamma = \(0, 0, 0\)"),
    ("Kovalevskaya", (B, 1, (1, 0, 0)), ((1, "1/2", "1/3"), ("3/4", 1, "1/5")), "xi != 0"),
    ("Kovalevskaya", (B, 1, (1, 0, 0)), (("-1/2", "1/2", -1), UP), "both separated variables rest at e = -1/2"),
    ("Kovalevskaya", (B, 1, (1, 0, 0)), ((-1, 0, -1), UP), "cubic .* has a double root"),
    ("Lagrange", ((2, 1, 1), 1, UP), (UP, UP), "I1 - I2 = 1"),
    ("Lagrange", (B, 1, (1, 0, 1)), (UP, UP), "P a = 1"),
    ("LagrangeGyrostat", (B, 1, UP, (1, 0, 1)), ((1, 2, 3), ("3/5", 0, "4/5")), "k1 = 1"),
    ("LagrangeGyrostat", ((2, 3, 4), 1, UP, UP), ((1, 2, 3), ("3/5", 0, "4/5")), "I1 - I2"),
    ("LagrangeGyrostat", (B, 1, (1, 0, 1), UP), ((1, 2, 3), ("3/5", 0, "4/5")), "P a = 1"),
    ("Pendulum", ((3, 2, 1), 1, SIDE), ((1, 1, 0), UP), r"along a principal axis, but I e x e = \(0, 0, 1\)"),
    ("Pendulum", ((3, 2, 1), 1, SIDE), ((1, 0, 0), ("3/5", 0, "4/5")), r"P r·e = 0, gamma·e = 3/5"),
    ("Pendulum", ((3, 2, 1), 1, ("1/7", 1, 0)), ((1, 0, 0), UP), r"P r·e = 1/7, "),
    ("Pendulum", ((3, 2, 1), 1, SIDE), ((0, 0, 0), ("3/5", 0, "4/5")), r"at rest, .* but I e x e = \(0, 3/2, 0\)"),
    ("Pendulum", ((3, 2, 1), 1, (0, 0, 0)), ((1, 0, 0), UP), "P r != 0"),
    ("Pendulum", (B, 1, (4, -3, 1)), ((3, 4, "1/9"), (4, -3, 2)), "along a principal axis, but I e x e = "),
    ("Pendulum", (B, 1, (4, -3, 1)), ((3, 4, 0), (4, "-11/4", 2)), "P r·e = 0, gamma·e = 1/4"),
    ("Pendulum", (B, 1, (1, 2, 3)), ((0, 0, 0), UNIT), "the torque at rest, along a principal axis"),
    ("PendulumGyrostat", ((3, 2, 1), 1, SIDE, (1, 0, "1/9")), ((1, 0, 0), UP), "k along this axis"),
    ("SphericalGyrostat", ((2, 2, 2), 1, (1, 2, 3), (2, 4, "25/4")), ((1, 2, 3), UNIT), r"k x P r = \(-1/2, "),
    ("SphericalGyrostat", ((2, 2, "13/7"), 0, (0, 0, 0), (1, 2, 3)), ((1, 2, 3), UNIT), "I2 - I3 = 1/7"),
    ("SphericalTop", ((2, 2, "13/7"), 1, (1, 2, 3)), ((1, 2, 3), UNIT), "I2 - I3 = 1/7"),
    ("SphericalTop", ((2, 2, 2), 0, (1, 2, 3)), ((1, 2, 3), UNIT), "P r != 0"),
    ("Sretensky", (G, 1, (1, 0, 0), (0, 1, 1)), (("3/4", "1/2", -1), UP), "k1 = k2 = 0, but k1 = 0, k2 = 1"),
    ("Sretensky", ((3, 3, 1), 1, (1, 0, 0), UP), (("3/4", "1/2", -1), UP), "I1 - 4 I3 = -1"),
    ("Sretensky", (G, 1, (1, 0, 0), (0, 0, 0)), (("3/4", "1/2", -1), UP), "M·gamma = -1"),
    # Ω1 = Ω2 = γ3 = 0, a pendulum about the axis of the rotor
    ("Sretensky", (G, 1, (1, 0, 0), (0, 0, 2)), (UP, ("3/5", "4/5", 0)), "rests at 0"),
    ("Staude", ((3, 2, 1), 1, (1, 2, 3)), ((1, 0, 0), (1, 0, 0)), r"Omega' = gamma' = 0, but their components = \("),
    ("Steklov", (S, 1, (1, 0, 1)), ((0, 4, 2), (-1, 0, 0)), "P b = 0, P c = 1"),
    ("Steklov", ((1, "1/2", "3/4"), 1, (1, 0, 0)), ((0, 4, 2), (-1, 0, 0)), "I1, I2, I3 different"),
    ("Steklov", (S, 1, ("45/32", 0, 0)), ((0, 4, "5/2"), (-1, 0, 0)), r"Omega3\^2 = .*, but the difference = 9/4"),
    ("Steklov", (S, 1, ("45/32", 0, 0)), ((0, 4, 2), (1, 0, 0)), r"gamma as .*, but the difference = \(2, 0, 0\)"),
    ("Steklov", (S, 1, ("45/32", 0, 0)), ((0, 4, 2), (0, 0, 0)), r"gamma = \(0, 0, 0\)"),
    ("ZhukovskyVolterra", ((3, 2, 1), 1, UP, (1, 0, 0)), ((1, 0, 0), UP), "needs P r = 0"),
]


@pytest.mark.parametrize(("case", "top", "start", "message"), OUTSIDE)
def test_what_is_outside_is_refused_with_the_condition_that_failed(case, top, start, message) -> None:
    with pytest.raises(NotInClass, match=message):
        getattr(catalogue, case)(HeavyTop(*top), State(*start))
