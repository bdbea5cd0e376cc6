"""Named bodies: the data of their sources, and their motion by other means."""

from fractions import Fraction
from typing import Any

import numpy
import pytest
from scipy.integrate import solve_ivp

import heavytop as ht
from heavytop.cases import named_bodies
from heavytop.top.bodies import motion_of


def test_detest_b5_at_20_is_what_an_integration_of_its_own_equations_gives() -> None:
    """y' = (y2 y3, −y1 y3, −0.51 y1 y2) by Taylor series in mpmath at 50 digits: an own computation."""
    case = named_bodies()["detest-b5"]
    state = ht.reference(case.body, case.given_start, [20], 30).texts()[0]
    scale = (Fraction(33, 32), Fraction(141, 160), Fraction(5, 4))
    y = [Fraction(text) / factor for text, factor in zip(state[:3], scale, strict=True)]
    own = (
        "-0.939657079872920396188436231591",
        "-0.342117775400074906534822116696",
        "0.741412659619995300782558677874",
    )
    assert max(abs(a - Fraction(b)) for a, b in zip(y, own, strict=True)) < Fraction(1, 10**29)


def test_its_equations_are_those_of_detest() -> None:
    """y' = (y2 y3, −y1 y3, −0.51 y1 y2) is the field of the body, scaled; exactly."""
    case = named_bodies()["detest-b5"]
    scale = (Fraction(33, 32), Fraction(141, 160), Fraction(5, 4))
    y = (Fraction(2, 3), Fraction(-5, 7), Fraction(11, 13))
    omega = [a * b for a, b in zip(scale, y, strict=True)]
    parameters = case.system.parameters(case.top, case.start)
    rates = case.system.field(parameters, [*omega, *case.start.gamma])[:3]
    wanted = (y[1] * y[2], -y[0] * y[2], Fraction(-51, 100) * y[0] * y[1])
    assert [rate / factor for rate, factor in zip(rates, scale, strict=True)] == list(wanted)


@pytest.mark.parametrize("name", named_bodies())
def test_a_named_body_says_its_source_and_its_toml_is_the_same_body(name: str) -> None:
    from heavytop.harness.case_text import forms

    case = named_bodies()[name]
    assert case.source
    assert case.units
    table: dict[str, Any] = {}
    for line in forms(case)["toml"].splitlines()[1:]:
        key, _, text = line.partition(" = ")
        table[key] = eval(text)
    body, start = motion_of({key: value for key, value in table.items() if key not in ("name", "system")})
    assert (body.centre, body.rotor) == (case.body.centre, case.body.rotor)
    assert body.tensor == case.body.tensor
    assert (start.omega, start.gamma) == (case.given_start.omega, case.given_start.gamma)


@pytest.mark.parametrize("name", ["van-zon-schofield", "gazebo-box", "mujoco-free-box", "rigidode-hairer"])
def test_a_free_body_turns_as_dop853_turns_it(name: str) -> None:
    case = named_bodies()[name]
    moments = numpy.array([float(case.body.tensor[i][i]) for i in range(3)])
    begin = [float(part) for part in case.given_start.omega]
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12}
    other = solve_ivp(lambda _t, w: numpy.cross(moments * w, w) / moments, (0, 10), begin, **options).y[:, -1]
    known = [float(text) for text in ht.reference(case.body, case.given_start, [10], 20).texts()[0][:3]]
    assert numpy.abs(other - known).max() < 1e-8 * numpy.abs(begin).max()


def test_data_of_a_named_body_are_decimals_where_these_end() -> None:
    from heavytop.harness.case_text import case_data, forms

    body = named_bodies()["bruels-cardona-arnold"]
    data = case_data(body)
    assert (data["gravity"], data["inertia"][4], data["omega"][2]) == ("9.81", "0.46875", "-4.61538")
    assert "gravity='9.81'" in forms(body)["python"]
