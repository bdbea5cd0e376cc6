"""Motions so slow or fast that Taylor coefficients leave the exponents of double: the same in another unit of time."""

import math
from fractions import Fraction

import pytest

import heavytop as ht
from heavytop.precision import exact


@pytest.mark.parametrize("rate", ["2e-16", "1e-50", "1e-140", "1e17", "1e140"])
@pytest.mark.parametrize(("inertia", "omega"), [((1, 1, 1), (0, 0, 1)), ((3, 2, "3/2"), (1, "-1/2", 2))])
def test_a_finite_motion_is_computed_at_every_rate(rate: str, inertia: tuple, omega: tuple) -> None:
    unit = exact(rate)
    top = ht.HeavyTop(inertia, 0, (0, 0, 0))
    start = ht.State([exact(w) * unit for w in omega], ("3/5", 0, "4/5"))
    times = [sign * Fraction(k, 2) / unit for sign in (1,) for k in range(6)]
    seen = []
    run = ht.propagate(top, start, times)
    ht.propagate(top, start, times, observer=lambda time, state: seen.append((time, list(state))))
    assert run.outcome.value == "success"
    assert "unit" in run.flags
    known = ht.reference(top, start, [exact(t) for t in run.times], digits=25)
    for state, proven in zip(run.states, known.states, strict=True):
        for place, (value, ball) in enumerate(zip(state, proven, strict=True)):
            size = float(unit) if place < 3 else 1.0
            assert float(value) / size == pytest.approx(float(ball.value) / size, abs=1e-13)
    assert [list(state) for state in run.states] == [state for _, state in seen]
    assert [time for time, _ in seen] == list(run.times)
    (member,), prepared = ht.ensemble(top, [start], times), ht.Integrator(top).propagate(start, times)
    assert member.states.tolist() == prepared.states.tolist() == run.states.tolist()
    found, plain = (
        ht.events(top, start, -5 / unit, "gamma1"),
        ht.events(top, ht.State(omega, start.gamma), -5, "gamma1"),
    )
    assert found.directions.tolist() == plain.directions.tolist() != []
    assert found.times * float(unit) == pytest.approx(plain.times, abs=1e-13)


def test_the_attitude_of_a_slow_permanent_rotation_moves() -> None:
    run = ht.propagate(
        ht.HeavyTop((3, 2, 1), 2, (0, 0, 1)), ht.State((0, 0, "1e-20"), (0, 0, 1)), [2e20], attitude=True
    )
    assert run.matrices()[0, 0] == pytest.approx([math.cos(2), -math.sin(2), 0], abs=1e-14)


@pytest.mark.parametrize("scale", [-60, 51, 58])
def test_a_power_of_two_of_the_time_changes_no_bit_of_gamma(scale: int) -> None:
    unit = Fraction(2) ** scale
    start = ("1/2", "-1/4", 2)
    plain, other = (
        ht.propagate(
            ht.HeavyTop((3, 2, "3/2"), u**2, ("1/2", "1/4", 1)),
            ht.State([exact(w) * u for w in start], ("3/5", 0, "4/5")),
            [-Fraction(k) / u for k in range(1, 5)],
        )
        for u in (Fraction(1), unit)
    )
    assert plain.flags.get("unit") is None
    assert other.steps == plain.steps
    for one, two in zip(plain.states, other.states, strict=True):
        assert [float(a) for a in two[3:]] == pytest.approx([float(a) for a in one[3:]], abs=1e-14)
        assert [float(a) / float(unit) for a in two[:3]] == pytest.approx([float(a) for a in one[:3]], abs=1e-13)
