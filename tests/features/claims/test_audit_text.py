"""A residual in the lines of a narrow column."""

import re
from random import Random

import pytest

from heavytop.features.claims.text import _RESIDUAL, _in_lines

NAMES = ("alpha", "gamma1", "omega1'", "Omega3", "I1", "t", "exp", "3", "0.25", "gamma_squared_long")


@pytest.mark.parametrize("seed", range(20))
def test_a_residual_is_broken_between_names_alone(seed: int) -> None:
    random = Random(seed)
    text = random.choice(NAMES)
    for _ in range(12):
        text = random.choice(["{} + {}", "{}*{}", "({} - {})", "exp({}/{})", "({})**{}"]).format(
            text, random.choice(NAMES)
        )
    lines = _in_lines(text).split("\n")
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert len(lines) > 1
    parts = re.findall(r"[\w.]+'*\)*", text)
    # what is longer than a line is a name alone with the brackets that it ends
    assert all(len(line) <= _RESIDUAL or line in parts for line in lines)
    names = re.findall(r"[\w.]+'*", text)
    assert sorted(name for line in lines for name in re.findall(r"[\w.]+'*", line)) == sorted(names)


def test_a_short_residual_stays_as_it_is() -> None:
    assert _in_lines("2*I3*C1") == "2*I3*C1"
    assert _in_lines("") == ""
