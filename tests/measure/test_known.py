"""References come from the catalogue, from the rounded data, and are certified before they score anything."""

from fractions import Fraction
from typing import Any

import pytest

import heavytop as ht
from heavytop import DOUBLE, QUAD, HeavyTop, State
from heavytop.cases import CASES
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.integrate.trajectory import Problem
from heavytop.measure.truth import known_motion
from support.helpers import in_units
from support.in_process import heavytop


def problem(name: str, precision=DOUBLE) -> Problem:
    case = CASES[name]
    return Problem.of(case.top, case.start, precision, case.system)


@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("euler", "Euler-Poinsot"),
        ("lagrange", "Lagrange"),
        ("pendulum", "pendulum"),
        ("gyrostat", "gyrostat"),
        ("kovalevskaya", "Kovalevskaya"),
    ],
)
def test_every_case_finds_its_reference_from_the_rounded_data(name: str, method: str) -> None:
    given = problem(name)
    known = known_motion(given, Fraction(5))
    assert method in known.solution.method
    assert known.certificate.agreed_digits >= 19
    assert f"certified at t = 5 to {known.certificate.agreed_digits} digits" in known.against.text
    assert "radius below" in known.against.text
    for value, start in zip(known.solution.state(Fraction(0), 117), given.start.flat, strict=True):
        assert abs(midpoint(value) - start) <= radius(value)


def test_a_motion_without_a_closed_form_has_no_reference_over_a_long_horizon() -> None:
    why = known_motion(problem("generic"), Fraction(10**5))
    assert why == "no closed form, and an enclosure to |t| = 100000 takes too long"


def test_the_rounded_gyrostat_keeps_the_rotor_of_the_exact_data() -> None:
    given = problem("gyrostat", QUAD)
    known = known_motion(given, Fraction(3))
    assert known.solution.parameters.rotor == given.parameters.rotor


@pytest.mark.parametrize(
    ("top", "start"),
    [
        (HeavyTop((3, 2, 1), 1, ("1/2", "1/4", "1/8")), State((1, 2, 3), (0, 0, 1))),
        (HeavyTop((3, 2, 1), 1, (0, 0, 1)), State((0, 0, 0), (0, 0, -1))),
        (HeavyTop((2, 2, 2), 0, (0, 0, 0)), State((0, 0, 0), (0, 1, 0))),
    ],
)
def test_values_that_are_exact_are_said_to_agree_exactly(top: HeavyTop, start: State) -> None:
    at_start, later = (known_motion(Problem.of(top, start, DOUBLE), Fraction(time)) for time in (0, 7))
    assert "certified at t = 0 exactly by " in at_start.against.text
    assert f"certified at t = 7 to {later.certificate.agreed_digits} digits by " in later.against.text
    assert later.certificate.agreed_digits < 100


@pytest.mark.parametrize("power", [-90, -30, 30, 90])
def test_no_unit_of_time_costs_a_motion_its_reference(power) -> None:
    case, rate = CASES["delone"], Fraction(2) ** power
    known = known_motion(Problem.of(*in_units(case.top, case.start, rate), QUAD, case.system), 10**4 / rate)
    assert known.certificate.kind == "proven at both ends"
    assert known.certificate.agreed_digits >= 37


TILTED = ht.Body(1, "9.81", (0, "1/3", 1), ("2", "3", "3", "1/10", "1/20", "1/5"), "pivot")
MOVED = ht.State((1, 2, 3), attitude=ht.Attitude.euler("ZXZ", "30deg", "1/2", 1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "start", "more"),
    [
        (CASES["generic"].top, CASES["generic"].start, {}),
        (CASES["generic"].top, CASES["generic"].start, {"attitude": True}),
        (CASES["generic"].top, CASES["generic"].start, {"derivatives": "start"}),
        (TILTED, MOVED, {}),  # irrational axes and angles
    ],
)
def test_an_enclosure_takes_the_effort_that_it_is_given(body: Any, start: State, more: dict[str, Any]) -> None:
    with pytest.raises(ht.OutOfReach):
        ht.reference(body, start, [4], 20, effort="1/10000", **more)
    states = ht.reference(body, start, [4], 20, effort=10, **more).states
    assert states == ht.reference(body, start, [4], 20, **more).states


def test_the_command_line_has_the_same_effort() -> None:
    command = ("reference", "--case", "generic", "--times", "4", "--digits", "20", "--effort")
    assert [heavytop(*command, seconds).returncode for seconds in ("0.0001", "10", "0", "-1", "nan")] == [3, 0, 2, 2, 2]
