"""The attitude beside a reference: one start for every class and naming, whatever its own formula begins with."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations

import pytest

import heavytop as ht
from heavytop.exact.axes import renamed_state, renamed_top
from heavytop.exact.validated import Validated
from heavytop.measure.reference import Ball
from heavytop.suite.cases import CASES
from heavytop.top.angles import perpendicular

NAMES = (
    "euler",
    "lagrange",
    "pendulum",
    "gyrostat",
    "delone",
    "ershkov-partial-2",
    "kovalevskaya",
    "generic",
    "hess",
    "hess-pendulum",
    "steklov",
    "goryachev",
)


def _holds(value: Fraction, ball: Ball) -> bool:
    return abs(value - Fraction(ball.value)) <= Fraction(ball.radius)


@pytest.mark.parametrize("name", NAMES)
def test_the_attitude_starts_across_gamma_and_is_that_of_the_enclosure(name: str) -> None:
    case = CASES[name]
    known = ht.reference(case.top, case.start, [0, "3/2"], 30, system=case.system, attitude=True)
    assert known.attitude is not None
    for value, ball in zip(perpendicular(case.start.gamma), known.attitude[0], strict=True):
        assert _holds(value, ball)
    enclosed = Validated(case.top, case.start, case.system).attitude(Fraction(3, 2), 140)
    for truth, ball in zip(enclosed, known.attitude[1], strict=True):
        mantissa, exponent = truth.mid().man_exp()
        assert _holds(int(mantissa) * Fraction(2) ** int(exponent), ball)
        assert Fraction(ball.radius) < Fraction(1, 10**30)


@pytest.mark.parametrize("axes", list(permutations(range(3))))
def test_the_attitude_under_every_naming_of_the_axes(axes: tuple[int, int, int]) -> None:
    case = CASES["lagrange"]
    top, start = renamed_top(case.top, axes), renamed_state(case.start, axes)
    known = ht.reference(top, start, [1], 30, attitude=True)
    assert known.attitude_method is not None
    assert "validated" not in known.attitude_method
    assert known.attitude is not None
    for truth, ball in zip(Validated(top, start).attitude(Fraction(1), 140), known.attitude[0], strict=True):
        mantissa, exponent = truth.mid().man_exp()
        assert _holds(int(mantissa) * Fraction(2) ** int(exponent), ball)


def test_no_attitude_is_given_that_nobody_asked_for() -> None:
    case = CASES["euler"]
    known = ht.reference(case.top, case.start, [1], 20)
    assert known.attitude is None
    assert known.attitude_method is None
