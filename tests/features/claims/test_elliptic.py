"""Euler's free body in Jacobi's functions: proven for every body, refuted with a fault, undecided out of range."""

import json
import re
from typing import Any

import pytest

from support.claim_tables import audited, open_conditions, top

# Euler's free body, I1 > I2 > I3 and 2 T I2 < G²: the parameter lies between 0 and 1
EULER: dict[str, Any] = {
    "kind": "motion",
    "assume": ["A > B", "B > C", "C > 0", "E > 0", "H > 0", "H > E*B", "E*A > H"],
    "parameters": {"A": ["3", "5"], "B": ["2", "3"], "C": ["1", "2"], "E": ["1", "3/2"], "H": ["5/2", "6"]},
    "definitions": {
        "m": "(A*E - H)*(B - C)/((A - B)*(H - C*E))",
        "rate": "sqrt((H - C*E)*(A - B)/(A*B*C))",
        "m1": "sqrt(A*(H - C*E)/(A - C))*dn(rate*t, m)",
        "m2": "-sqrt(B*(A*E - H)/(A - B))*sn(rate*t, m)",
        "m3": "sqrt(C*(A*E - H)/(A - C))*cn(rate*t, m)",
    },
    "top": top("A B C", "0 0 0", "0"),
    "motion": {"omega": ["m1/A", "m2/B", "m3/C"], "gamma": ["m1/sqrt(H)", "m2/sqrt(H)", "m3/sqrt(H)"]},
}


NUMBERS = {"A": "3", "B": "2", "C": "1", "E": "1", "H": "(5/2)"}
"""One such body and motion, of which an audit takes a tenth of the time."""


def verdict(table: dict[str, Any]) -> str:
    return audited(table).verdict


def changed(**definitions: str) -> dict[str, Any]:
    return EULER | {"definitions": EULER["definitions"] | definitions}


def in_numbers(table: dict[str, Any], letters: str = "ABCEH") -> dict[str, Any]:
    """The claim with numbers for these letters, and without assumptions and parameters."""
    text = json.dumps({key: part for key, part in table.items() if key not in ("assume", "parameters")})
    numbers: dict[str, Any] = json.loads(re.sub(rf"\b[{letters}]\b", lambda letter: NUMBERS[letter[0]], text))
    return numbers


@pytest.mark.slow
def test_eulers_motion_holds_for_every_body() -> None:
    assert verdict(EULER) == verdict(in_numbers(EULER)) == "holds"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("definitions", "verdicts"),
    [
        ({"m2": "sqrt(B*(A*E - H)/(A - B))*sn(rate*t, m)"}, {"refuted"}),
        ({"m": "(A*E - H)*(B - C)/((A - B)*(H - C*E))*99/100"}, {"refuted"}),
        ({"m3": "sqrt(C*(A*E - H)/(A - C))*dn(rate*t, m)"}, {"refuted"}),
        ({"m": "sin(t)^2"}, {"refuted", "undecided"}),  # a parameter that moves
    ],
)
def test_a_planted_fault_is_refuted(definitions: dict[str, str], verdicts: set[str]) -> None:
    assert verdict(in_numbers(changed(**definitions))) in verdicts


@pytest.mark.slow
def test_a_fault_planted_in_the_motion_of_every_body_is_refuted() -> None:
    assert verdict(changed(rate="sqrt((H - C*E)*(A - B)/(A*B*C))*101/100")) == "refuted"


@pytest.mark.slow
def test_without_the_range_of_the_parameter_it_is_undecided_and_says_so() -> None:
    loose = in_numbers(EULER, "ABCE") | {"parameters": {"H": "5/2"}}
    assert verdict(loose | {"assume": ["2 < H < 3"]}) == "holds"
    report = audited(loose | {"assume": ["1 < H < 3"]})
    assert report.verdict == "undecided"
    assert "≤ 1" in open_conditions(report)
