"""Numbers that other programs store for named bodies, against the proven ones: the table of docs/bodies.md."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import heavytop as ht
from heavytop.cases import named_bodies
from heavytop.top.bodies import motion_of

PAGE = (Path(__file__).parents[1] / "docs" / "bodies.md").read_text("utf-8")
STORED: dict[str, tuple[str, str, str, list[str], str]] = {
    "by its own solver": (
        "terze", "0.2", "quaternion", ["-0.70824157", "0.43878143", "0.54578152", "0.08937154"], "5.3e-5",
    ),
    "by RK4 in MATLAB": ("terze", "0.2", "quaternion", ["-0.70828", "0.43878", "0.54573", "0.0894"], "1.6e-6"),
    "displacement of the centre": (
        "bruels-cardona-arnold", "0.8", "position",
        ["-0.42217802273894345", "0.90541736469949297", "-0.04455460488952848"], "4.0e-3",
    ),
    "| quaternion |": (
        "bruels-cardona-arnold", "0.8", "quaternion",
        ["-0.17919607435565366", "0.21677896640311572", "-0.9594776960853596", "-0.017268392381761217"], "2.0e-3",
    ),
    "quaternion at t = 5": (
        "kynema-precession", "5", "quaternion",
        ["-0.63053045128590757", "0.60556039120583116", "-0.30157681970585326", "-0.38049886257377241"], "1.5e-3",
    ),
}  # fmt: skip


@pytest.mark.parametrize("said", STORED)
def test_a_stored_number_is_as_wrong_as_the_page_says(said: str) -> None:
    name, time, quantity, stored, error = STORED[said]
    case = named_bodies()[name]
    assert case.body is not None
    assert case.given_start is not None
    known = [Fraction(text) for text in ht.reference(case.body, case.given_start, [time], 25).texts(quantity)[0]]
    signs = (1, -1) if quantity == "quaternion" else (1,)
    off = min(max(abs(sign * Fraction(s) - k) for s, k in zip(stored, known, strict=True)) for sign in signs)
    assert f"{float(off):.1e}".replace("e-0", "e-") == error
    assert any(said in line and f"| {error} |" in line for line in PAGE.splitlines())


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


def test_data_of_a_named_body_are_decimals_where_these_end() -> None:
    from heavytop.harness.case_text import case_data, forms

    body = named_bodies()["bruels-cardona-arnold"]
    data = case_data(body)
    assert (data["gravity"], data["inertia"][4], data["omega"][2]) == ("9.81", "0.46875", "-4.61538")
    assert "gravity='9.81'" in forms(body)["python"]
