"""The heavy gyrostat: its field, its integrals, and its places between the heavy top and the gyrostat, all exactly."""

from fractions import Fraction
from itertools import permutations
from random import Random

import pytest
from flint import fmpq_mpoly_ctx

from heavytop import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, HeavyTop, InputError, State, holding
from heavytop.exact.closed_form import orientation
from heavytop.precision import dot
from heavytop.top.amplification import rate
from heavytop.top.equations import (
    Parameters,
    area,
    heavy_gyrostat,
    kovalevskaya_yehia,
    largest,
    square_of_rate,
    sretensky,
    system,
    system_of,
)
from heavytop.top.heavy_top import data_texts, require_physical
from support.helpers import fraction, moments, positive, rational, renamed, unit_vector, vector

STARTS = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))


RING = fmpq_mpoly_ctx.get(("w1", "w2", "w3", "g1", "g2", "g3"), "degrevlex")
Y = RING.gens()


def rate_of(value, p: Parameters, field=heavy_gyrostat):
    """The derivative of a polynomial along the field, a polynomial."""
    rates = field(p.mapped(lambda part: RING.constant(rational(part))), Y)
    return sum((value.derivative(j) * rates[j] for j in range(6)), RING.constant(0))


def body(random: Random, axes, inertia, centre, rotor) -> HeavyTop:
    """A top on the canonical axes, renamed; its rotor is an axial vector, as M is."""
    turned = [orientation(axes) * k for k in renamed(rotor, axes)]
    return HeavyTop(renamed(inertia, axes), positive(random), renamed(centre, axes), turned)


def of_every_class(random: Random, axes):
    """(name of an integral that must be offered, top)."""
    i1, i2, i3 = moments(random)
    a, b, c, spin = positive(random), fraction(random), fraction(random), positive(random)
    rotor = vector(random)
    yield "energy", body(random, axes, (i1, i2, i3), (a, b, c), rotor)
    yield "momentum_squared", body(random, axes, (i1, i2, i3), (0, 0, 0), rotor)
    yield f"spin{axes[2] + 1}", body(random, axes, (i1, i1, i3), (0, 0, c), (0, 0, spin))
    yield "moment_along_centre", body(random, axes, (i1, i1, i1), (a, b, c), (spin * a, spin * b, spin * c))
    yield "kovalevskaya_yehia", body(random, axes, (2 * i3, 2 * i3, i3), (a, b, 0), (0, 0, spin))


@pytest.mark.parametrize("axes", list(permutations(range(3))))
def test_the_derivative_of_every_integral_along_the_field_is_the_zero_polynomial(axes) -> None:
    random = Random(str(axes))
    for _ in range(3):
        start = State(vector(random), unit_vector(random))
        for name, top in of_every_class(random, axes):
            found = {each.name: each for each in holding(top, start, HEAVY_GYROSTAT)}
            assert {name, "gamma_squared", "area", "energy"} <= found.keys()
            p = HEAVY_GYROSTAT.parameters(top, start)
            for each in found.values():
                assert rate_of(each.value(p.mapped(rational), Y), p) == 0, (each.name, top)


@pytest.mark.parametrize("axes", list(permutations(range(3))))
def test_sretenskys_integral_changes_in_proportion_to_the_area_and_is_offered_on_its_zero_alone(axes) -> None:
    """F' = −(n·e1 Ω2 − n·e2 Ω1) (M·γ)/(4 I3), in names of an even renaming."""
    random = Random(str(axes))
    for _ in range(4):
        i3, a, b, spin = positive(random), positive(random), fraction(random), positive(random)
        top = body(random, axes, (4 * i3, 4 * i3, i3), (a, b, 0), (0, 0, spin))
        gamma = unit_vector(random)
        start = State(vector(random), gamma)
        p = HEAVY_GYROSTAT.parameters(top, start)
        k = axes[2]
        i, j = (k + 1) % 3, (k + 2) % 3
        change = rate_of(sretensky(p.mapped(rational), Y, (i, j, k)), p)
        about_gamma = area(p.mapped(rational), Y)
        n = p.mapped(rational).moment
        assert change == (n[j] * Y[i] - n[i] * Y[j]) * about_gamma / (4 * rational(i3 * i3))
        assert "sretensky" not in {each.name for each in holding(top, start, HEAVY_GYROSTAT)}
        off = dot(top.angular_momentum(start.omega), gamma)
        omega = [w - off * g / m for w, g, m in zip(start.omega, gamma, top.inertia, strict=True)]
        assert "sretensky" in {each.name for each in holding(top, State(omega, gamma), HEAVY_GYROSTAT)}


def test_the_integrals_are_those_of_their_sources_in_the_sources_units() -> None:
    """Yehia: I = (2, 2, 1), n = (c, 0, 0); Sretensky: I = (4, 4, 1)."""
    spin, c = rational("3/7"), rational("5/3")
    w1, w2, w3, g1, g2, g3 = Y
    p = Parameters((2, 2, 1), (c, 0, 0), (0, 0, spin))
    assert kovalevskaya_yehia(p, Y, (0, 1, 2)) == (
        (w1**2 - w2**2 - c * g1) ** 2
        + (2 * w1 * w2 - c * g2) ** 2
        + 2 * spin * (w3 - spin) * (w1**2 + w2**2)
        - 4 * spin * c * w1 * g3
    )
    p = Parameters((4, 4, 1), (c, 0, 0), (0, 0, spin))
    assert sretensky(p, Y, (0, 1, 2)) == (w3 - spin) * (w1**2 + w2**2) - c * w1 * g3


@pytest.mark.parametrize(
    ("name", "inertia", "right", "broken"),
    [
        ("momentum_squared", (3, 2, 1), ((0, 0, 0), (1, 2, 3)), ((0, 0, 1), (1, 2, 3))),
        ("spin3", (2, 2, 1), ((0, 0, 1), (0, 0, 3)), ((0, 0, 1), (1, 0, 3))),
        ("moment_along_centre", (2, 2, 2), ((0, 0, 1), (0, 0, 3)), ((0, 0, 1), (1, 0, 3))),
        ("kovalevskaya_yehia", (2, 2, 1), ((1, 0, 0), (0, 0, 3)), ((1, 0, 0), (1, 0, 3))),
        ("kovalevskaya", (2, 2, 1), ((1, 0, 0),), ((1, 0, 0), (0, 0, 3))),
    ],
)
def test_an_integral_is_not_offered_where_its_derivative_is_not_zero(name, inertia, right, broken) -> None:
    """Each condition broken alone: the function changes, and is not offered."""
    random = Random(5)
    start, top = State(vector(random), unit_vector(random)), HeavyTop(inertia, 1, *broken)
    offered = next(each for each in holding(HeavyTop(inertia, 1, *right), start) if each.name == name)
    p = HEAVY_GYROSTAT.parameters(top, start)
    assert rate_of(offered.value(p.mapped(rational), Y), p) != 0
    assert name not in {each.name for each in holding(top, start, HEAVY_GYROSTAT)}


def test_a_top_says_its_rotor_and_differs_by_it() -> None:
    plain = HeavyTop((3, 2, 1), 1, (0, 0, 1))
    top = HeavyTop((3, 2, 1), 1, (0, 0, 1), rotor=(0, "1/3", -2))
    assert repr(top) == "HeavyTop(inertia=(3, 2, 1), weight=1, centre=(0, 0, 1), rotor=(0, '1/3', -2))"
    assert "rotor" not in repr(plain)
    assert eval(repr(top)) == top != plain
    assert hash(top) == hash(eval(repr(top)))
    assert plain == HeavyTop((3, 2, 1), 1, (0, 0, 1)) != HeavyTop((3, 2, 1), 1, (0, 0, 1), (0, 0, 0))
    assert data_texts(top, STARTS)["rotor"] == ["0", "1/3", "-2"]
    assert "rotor" not in data_texts(plain, STARTS)
    assert top.angular_momentum((1, 1, 1)) == (3, Fraction(7, 3), -1)


def test_what_no_rotor_can_be_is_refused_with_its_name() -> None:
    for bad in ((1, 2), "123", ("nan", 0, 0), (1, 2, 3, 4), 5):
        with pytest.raises(InputError) as error:
            HeavyTop((3, 2, 1), 1, (0, 0, 1), rotor=bad)
        assert "rotor" in error.value.cause
    with pytest.raises(InputError):
        require_physical(HeavyTop((3, 2, 1), 1, (0, 0, 1), rotor=("1e200", 0, 0)), STARTS)


def test_the_system_follows_from_the_data_where_none_is_named() -> None:
    plain, top = HeavyTop((3, 2, 1), 1, (0, 0, 1)), HeavyTop((3, 2, 1), 1, (0, 0, 1), (1, 2, 3))
    assert system_of(None, plain) is HEAVY_TOP
    assert system_of(None, top) is system_of(None, plain, top) is HEAVY_GYROSTAT
    assert system_of("heavy_gyrostat", plain) is system("heavy_gyrostat") is HEAVY_GYROSTAT
    for name in ("heavy_top", "gyrostat", HEAVY_TOP, GYROSTAT):
        with pytest.raises(InputError) as error:
            system_of(name, top)
        assert "rotor" in error.value.cause
        with pytest.raises(InputError):
            system(getattr(name, "name", name)).parameters(top, STARTS)
    with pytest.raises(InputError):
        system_of("heavy", plain)


def test_rates_have_the_units_of_the_motion_whatever_those_of_the_data() -> None:
    """Moments, weight and rotor times a factor are the same motion; time in another unit changes every rate alike."""
    top, start = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"), (40, -7, "1/9")), STARTS
    p = HEAVY_GYROSTAT.parameters(top, start)
    larger = p.mapped(lambda value: Fraction(10**40) * value)
    assert square_of_rate(HEAVY_GYROSTAT, larger, start.flat) == square_of_rate(HEAVY_GYROSTAT, p, start.flat)
    assert rate(HEAVY_GYROSTAT, larger, start.flat) == rate(HEAVY_GYROSTAT, p, start.flat) == 64
    assert p.rotor_rate == 40
    fast = 2**20
    own = p.mapped(lambda value: fast * value)._replace(inertia=p.inertia, moment=tuple(fast**2 * n for n in p.moment))
    y = (*(fast * w for w in start.omega), *start.gamma)
    assert square_of_rate(HEAVY_GYROSTAT, own, y) == fast**2 * square_of_rate(HEAVY_GYROSTAT, p, start.flat)


def test_the_bound_of_an_integral_bounds_it() -> None:
    random = Random(6)
    top = HeavyTop((2, 2, 1), 1, (1, 0, 0), (0, 0, "3/2"))
    start = State(vector(random), unit_vector(random))
    p, speed = HEAVY_GYROSTAT.parameters(top, start), max(map(abs, start.omega))
    for integral in holding(top, start, HEAVY_GYROSTAT):
        assert abs(integral.value(p, start.flat)) <= largest(integral, p, speed)
