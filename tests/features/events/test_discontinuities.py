"""Jumps and poles of sampled functions are no events; steep, flat and small zeros are."""

import math
from collections.abc import Callable
from typing import Any

import pytest

import heavytop as ht
from support.helpers import START, TOP

UNTIL = 8
Sampled = Callable[[Any, Any], Any]
CROSSINGS = list(ht.events(TOP, START, UNTIL, "gamma1").times)


def found(function: Sampled, precision: ht.Precision = ht.DOUBLE) -> ht.Events:
    return ht.events(TOP, START, UNTIL, function, precision=precision)


@pytest.mark.parametrize("scale", [1, 1e-12, 1e12])
@pytest.mark.parametrize(
    "zero",
    [
        lambda x: math.sin(x),
        lambda x: math.sin(x) ** 3,
        lambda x: math.copysign(abs(x) ** (1 / 3), x),
        lambda x: math.copysign(math.sqrt(abs(x)), x),
        lambda x: math.tan(x / 2),
    ],
)
def test_a_zero_is_an_event_however_steep_or_flat(zero: Callable[[float], float], scale: float) -> None:
    events = found(lambda omega, gamma: scale * zero(float(gamma[0])))
    assert events.discontinuities == ()
    assert list(events.times) == pytest.approx(CROSSINGS, abs=1e-4)


@pytest.mark.parametrize(
    ("function", "kind"),
    [
        (lambda x: math.copysign(1, x), "jump"),
        (lambda x: math.copysign(1e-3, x) + 1e-5 * x, "jump"),
        (lambda x: 1e12 * math.copysign(1 + x * x, x), "jump"),
        (lambda x: 1 / math.sin(x), "pole"),
        (lambda x: 1e-9 / math.tan(x), "pole"),
        (lambda x: math.copysign(abs(math.sin(x)) ** -0.5, x), "pole"),
    ],
)
def test_a_jump_and_a_pole_are_said_as_such(function: Callable[[float], float], kind: str) -> None:
    events = found(lambda omega, gamma: function(float(gamma[0])))
    assert len(events) == 0
    assert [name for _, name in events.discontinuities] == [kind] * len(CROSSINGS)
    assert [float(time) for time, _ in events.discontinuities] == pytest.approx(CROSSINGS, abs=1e-9)
    assert events.discontinuity_text() in str(events)
    assert events.to_json()["discontinuities"][0]["kind"] == kind


def test_the_branch_cut_of_atan2_is_no_event_in_any_format() -> None:
    exact_angle = ht.events(TOP, START, UNTIL, "gamma2*5403023058681398/8414709848078965 - gamma1")
    for precision in (ht.DOUBLE, ht.QUAD):
        events = found(lambda omega, gamma: math.atan2(float(gamma[1]), float(gamma[0])) - 1, precision)
        # of tan φ = tan 1 those with φ = 1
        right = [float(t) for t, s in zip(exact_angle.times, exact_angle.states, strict=True) if s[3] > 0]
        assert [float(time) for time in events.times] == pytest.approx(right, abs=1e-6)
        assert {kind for _, kind in events.discontinuities} == {"jump"}
