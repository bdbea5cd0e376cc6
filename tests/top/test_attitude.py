"""Attitudes: matrix, quaternion, Euler angles, axis and angle."""

import math
from fractions import Fraction
from itertools import product
from random import Random
from typing import Any

import numpy
import pytest

from heavytop import Attitude, InputError
from heavytop.exact.flint.balls import FUNCTIONS, ball, working_precision
from heavytop.precision import cross
from heavytop.top.attitude import (
    SEQUENCES,
    euler_of_rows,
    matrix_of_quaternion,
    multiplied,
    quaternion_of_rows,
    rows_of,
    rows_of_euler,
    signs,
    transposed,
)

IDENTITY = tuple(tuple(Fraction(i == j) for j in range(3)) for i in range(3))


def random_quaternion(random: Random) -> tuple[Fraction, ...]:
    parts = [Fraction(random.randint(-50, 50), random.randint(1, 9)) for _ in range(3)]
    return (*parts, Fraction(1, 7))


def flat(rows: Any) -> list[float]:
    return [float(value) for row in rows for value in row]


def test_r_of_a_rational_quaternion_of_any_length_is_a_rational_rotation() -> None:
    random = Random(1)
    for _ in range(30):
        rows = Attitude.quaternion(*random_quaternion(random), normalize=True).exact_rows()
        assert multiplied(rows, transposed(rows)) == IDENTITY
        assert rows[1] == cross(rows[2], rows[0])  # eta = gamma x xi
        assert rows_of(rows[2], rows[0]) == rows


def test_quaternions_come_back_whichever_component_is_the_largest() -> None:
    for place, chosen in product(range(4), product((-1, 1), repeat=4)):
        q = [Fraction(sign, 10) for sign in chosen]
        q[place] *= 30
        length = math.sqrt(sum(value * value for value in q))
        wanted = [float(value) / length * chosen[place] for value in q]
        rows = Attitude.quaternion(*q, normalize=True).rows(math)
        assert quaternion_of_rows(rows, math) == pytest.approx(wanted, abs=1e-15)


def test_half_a_turn_has_w_0() -> None:
    rows = Attitude.axis_angle((0, 3, 0), "180deg").exact_rows()
    assert rows == ((-1, 0, 0), (0, 1, 0), (0, 0, -1))
    assert quaternion_of_rows(rows, math) == (0, 0, 1, 0)


def test_signs_follow_the_motion() -> None:
    turning = [(math.cos(t / 2), 0, math.sin(t / 2), 0) for t in range(14)]
    random = Random(3)
    spoilt = [tuple(random.choice((-1, 1)) * sign for sign in q) for q in turning[:1]]
    spoilt += [tuple(value * sign for value in q) for q, sign in zip(turning[1:], [-1, 1] * 7, strict=False)]
    spoilt[0] = tuple(-value for value in turning[0])
    assert (signs(turning[0], numpy.array(spoilt))[:, None] * spoilt).tolist() == [pytest.approx(q) for q in turning]


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_euler_angles_are_a_product_of_elementary_rotations_and_come_back(sequence: str) -> None:
    def elementary(letter: str, t: float) -> Any:
        c, s = math.cos(t), math.sin(t)
        return {
            "X": ((1, 0, 0), (0, c, -s), (0, s, c)),
            "Y": ((c, 0, s), (0, 1, 0), (-s, 0, c)),
            "Z": ((c, -s, 0), (s, c, 0), (0, 0, 1)),
        }[letter]

    random = Random(sequence)
    proper = sequence[0] == sequence[2]
    for _ in range(20):
        a, c = (random.uniform(-3.1, 3.1) for _ in range(2))
        b = random.uniform(0.01, 3.1) if proper else random.uniform(-1.5, 1.5)
        rows = rows_of_euler(sequence, (a, b, c), math)
        first, second, third = map(elementary, sequence, (a, b, c))
        assert flat(rows) == pytest.approx(flat(multiplied(first, multiplied(second, third))), abs=1e-15)
        assert euler_of_rows(rows, sequence, math) == pytest.approx((a, b, c), abs=1e-13)
        assert flat(Attitude.euler(sequence.lower(), a, b, c).rows(math)) == pytest.approx(flat(rows), abs=1e-15)


def test_axis_and_angle_is_rodrigues_formula() -> None:
    axis, angle = (1, -2, 2), 0.6
    rows = Attitude.axis_angle(axis, angle).rows(math)
    half = math.sin(angle / 2) / 3
    q = (math.cos(angle / 2), *(half * value for value in axis))
    assert flat(rows) == pytest.approx(flat(matrix_of_quaternion(q)), abs=1e-15)
    assert Attitude.axis_angle(axis, 0).exact_rows() == IDENTITY


def test_degrees_are_exact_at_right_angles_and_balls_elsewhere() -> None:
    assert Attitude.euler("ZYX", "90deg", "0deg", "-180 deg").exact_rows() == ((0, 1, 0), (1, 0, 0), (0, 0, -1))
    attitude = Attitude.euler("ZXZ", "30deg", "60deg", "45deg")
    assert attitude.exact_rows() is None
    with working_precision(200):
        (_, _, (first, second, third)) = attitude.rows(FUNCTIONS, ball)
        assert (third - ball(Fraction(1, 2))).contains(0)
        assert (first - second).contains(0)
        assert float(third.rad()) < 1e-55


def test_a_matrix_is_exact_or_refused() -> None:
    rows = ((Fraction(3, 5), Fraction(-4, 5), 0), (Fraction(4, 5), Fraction(3, 5), 0), (0, 0, 1))
    assert Attitude.matrix(rows).exact_rows() == rows
    assert Attitude.matrix([value for row in rows for value in row]) == Attitude.matrix(rows)
    rounded = [[f"{float(value):.6f}" for value in row] for row in Attitude.euler("XYZ", "1", "0.3", "2").rows(math)]
    with pytest.raises(InputError, match="not orthogonal"):
        Attitude.matrix(rounded)
    near = Attitude.matrix(rounded, normalize=True).exact_rows()
    assert multiplied(near, transposed(near)) == IDENTITY
    assert flat(near) == pytest.approx([float(value) for row in rounded for value in row], abs=2e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Attitude.quaternion("0.7", 0, 0, "0.7"), r"have length 1; \|q\|\^2 - 1 = -0.02"),
        (lambda: Attitude.quaternion(0, 0, 0, 0, normalize=True), "must not be zero"),
        (lambda: Attitude.matrix([[1, 0, 0], [0, 1, 0], [0, 0, -1]]), "reflection"),
        (lambda: Attitude.matrix([[1, 0, 0], [0, 2, 0], [0, 0, 1]], normalize=True), "not orthogonal"),
        (lambda: Attitude.matrix([1, 2]), "9 entries; got 2"),
        (lambda: Attitude.euler("ZXX", 0, 0, 0), "ZXX"),
        (lambda: Attitude.euler("ZXZ", 0, "nan", 0), "nan"),
        (lambda: Attitude.axis_angle((0, 0, 0), 1), "must not be zero"),
        (lambda: Attitude.axis_angle((0, 0), 1), "axis must have 3 numbers; got 2"),
        (lambda: Attitude.quaternion("1e400000000", 0, 0, 0), "1e400000000"),
    ],
)
def test_what_is_no_attitude_is_refused(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
