"""Other integrators behind the same call: they agree with heyoka, from whose code they take nothing."""

from fractions import Fraction

import pytest

from heavytop.errors import InputError
from heavytop.integrate.peers import mpmath_odefun, scipy_dop853
from heavytop.integrate.taylor import propagate
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import DOUBLE, QUAD, exact, real
from heavytop.suite.cases import CASES

TIMES = [Fraction(1, 3), Fraction(5)]


def distance(one, other) -> Fraction:
    pairs = zip(one.states, other.states, strict=True)
    return max(abs(exact(a) - exact(b)) for first, second in pairs for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("name", ["euler", "lagrange", "kovalevskaya", "generic", "gyrostat"])
def test_dop853_and_heyoka_agree_to_the_tolerance(name: str) -> None:
    case = CASES[name]
    peer = scipy_dop853(case.top, case.start, TIMES, system=case.system)
    assert peer.outcome is Outcome.SUCCESS
    assert distance(peer, propagate(case.top, case.start, TIMES, DOUBLE, system=case.system)) < Fraction(1, 10**11)


@pytest.mark.parametrize("name", ["kovalevskaya", "gyrostat"])
@pytest.mark.parametrize("precision", [QUAD, real(160)], ids=lambda p: p.name)
def test_odefun_and_heyoka_agree_to_the_format(name: str, precision) -> None:
    case = CASES[name]
    times = [Fraction(1, 2), Fraction(2)]
    peer = mpmath_odefun(case.top, case.start, times, precision, system=case.system)
    ours = propagate(case.top, case.start, times, precision, system=case.system)
    assert distance(peer, ours) < 1000 * precision.eps


def test_what_a_peer_cannot_do_is_refused() -> None:
    case = CASES["euler"]
    with pytest.raises(InputError, match="no quad"):
        scipy_dop853(case.top, case.start, TIMES, QUAD)
    with pytest.raises(InputError, match="forwards only"):
        mpmath_odefun(case.top, case.start, [Fraction(-1)], QUAD)
