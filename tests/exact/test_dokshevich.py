"""Dokshevich's motions: random ones, a turning point, moments on the edge, what is refused, algebraic starts."""

import random
from fractions import Fraction
from math import isqrt

import pytest
from flint import arb

from heavytop.errors import InputError, NotInClass, OutOfReach
from heavytop.exact.cases.dokshevich import Dokshevich, dokshevich_motion
from heavytop.exact.enclosure.run import Validated
from heavytop.precision import dot
from heavytop.top.heavy_top import HeavyTop, State
from support.proofs import AsRounded, assert_algebraic_solves, assert_attitude, positive, rational

F = Fraction
# (tangent u, S - b, w, z/x) with rational S and axes: found by a search over small fractions
SHAPES = (
    (F(3, 4), F(-1, 12), F(5), F(5, 12)),
    (F(4, 3), F(11, 12), F(25, 36), F(0)),
    (F(4, 3), F(7, 12), F(89, 28), F(5, 12)),
)


def root(square):
    found = F(isqrt(square.numerator), isqrt(square.denominator))
    assert found * found == square
    return found


def shape(place, slope=None):
    """Constants by their definitions, and a point (w, z/x) of z²/x² = C2 + K w − w², another one for a slope."""
    u, excess, w, ratio = SHAPES[place]
    d = u - 1 / u
    b = (d * d + 3 - excess * excess) / (2 * excess - d)
    a = b + d
    s = root(a * a - a * b + b * b + 3)
    first = (b - 2 * a - s) / 3
    size = (a + b + 2 * s) / 3
    p = (a * b + 3 * b * first + 2) / (b * b + 4)
    sigma = (2 * p - b * first - 1) / b
    middle = sigma - first - 1 / b
    lead = first**2 + (a - b) * first - 1 - size * sigma
    if slope is not None:  # the second point of the line through (w, ratio)
        step = (middle - 2 * w - 2 * slope * ratio) / (1 + slope * slope)
        w, ratio = w + step, ratio + slope * step
    assert ratio * ratio == lead + middle * w - w * w
    return u, (a, b, first, size, p, sigma), w, ratio


def motion(place, slope=None, x=F(1), beta=F(1), moment=F(1), side=1):
    """The exact motion with x = M·e1 and the units β and |n|; e1 = (cos, 0, sin) on the principal axes."""
    u, (a, b, first, size, p, sigma), w, ratio = shape(place, slope)
    cosine = u / root(1 + u * u)
    sine = cosine / u
    unit = w * x * x  # B
    y, z = first * x + unit / x, ratio * x * side
    minus_gamma = (size * (p * x * x + unit / b), size * (unit - sigma * x * x), size * x * z)
    high, low = (a + b + u + 1 / u) / 2 * beta, (a + b - u - 1 / u) / 2 * beta
    inertia = (1 / high, 1 / (b * beta), 1 / low)
    # e3 = axis 2, e2 = e3 × e1 = (sin, 0, −cos): e1·I⁻¹e2 = β (u + 1/u) cos sin = β
    momentum = (cosine * x + sine * y, z, sine * x - cosine * y)
    gamma = tuple(beta / moment * g for g in minus_gamma)
    up = (cosine * gamma[0] + sine * gamma[1], gamma[2], sine * gamma[0] - cosine * gamma[1])
    omega = tuple(m / i for m, i in zip(momentum, inertia, strict=True))
    return Dokshevich(HeavyTop(inertia, 1, (moment * cosine, 0, moment * sine)), State(omega, up))


def random_motion(seed):
    rng = random.Random(seed)
    slope = None if seed < 3 else rational(rng, size=4)
    sizes = positive(rng) * rng.choice((1, -1)), positive(rng), positive(rng)
    return motion(seed % 3, slope, *sizes, rng.choice((1, -1)))


STARTS = {"turning point": (1,)}


def test_moments_on_the_edge_of_what_a_body_has_are_no_harder():
    tiny = F(1, 10**30)
    for inertia in ((1, 1 - tiny / 3, tiny), (1, F(1, 2) + tiny, F(1, 2)), (1, 1 - tiny, 1 - 2 * tiny)):
        state = dokshevich_motion(inertia).state(F(10**6), 170)
        assert all(x.rad() < arb("1e-35") * (1 + abs(x)) for x in state)


def test_moments_that_no_body_has_may_be_too_far_apart_and_the_refusal_names_the_level():
    with pytest.raises(OutOfReach, match="degenerate to within"):
        dokshevich_motion((1, F(1, 10**10), F(1, 10**20))).state(F(1), 170)


def test_what_is_outside_is_refused_with_the_equality_that_failed():
    top, start = motion(0).top, motion(0).start
    other = top.inertia[0], top.inertia[1] + F(1, 10**30), top.inertia[2]
    with pytest.raises(NotInClass, match=r"I1 \(I2 - I3\) a\^2"):
        Dokshevich(HeavyTop(other, 1, top.centre), start)
    with pytest.raises(NotInClass, match="P b = 0"):
        Dokshevich(HeavyTop(top.inertia, 1, (top.centre[0], 1, top.centre[2])), start)
    for place, what in ((0, r"z\^2|gamma|B = "), (1, r"z\^2"), (2, r"z\^2|gamma")):
        omega = list(start.omega)
        omega[place] += F(1, 10**30)
        with pytest.raises(NotInClass, match=what):
            Dokshevich(top, State(omega, start.gamma))
    for place in range(3):
        gamma = list(start.gamma)
        gamma[place] += F(1, 10**30)
        with pytest.raises(NotInClass, match="gamma"):
            Dokshevich(top, State(start.omega, gamma))
    x, z = top.centre[0], top.centre[2]
    with pytest.raises(NotInClass, match="M·P r != 0"):
        Dokshevich(top, State((z / top.inertia[0], 1, -x / top.inertia[2]), start.gamma))
    with pytest.raises(NotInClass, match="the square of a rational number"):
        Dokshevich(HeavyTop((6, 4, 3), 1, (2, 0, 2)), State((1, 1, 1), (0, 1, 0)))


@pytest.mark.parametrize("data", [((8, 6, 3), F(1, 3)), ((3, 4, 5), F(-9, 10)), (("1/2", 1, "11/10"), F(1, 1000))])
def test_every_hess_top_has_one_with_an_algebraic_start(data):
    case = dokshevich_motion(tuple(map(F, data[0])), data[1])
    for time in (F(0), F(7, 3), F(-(10**6))):
        assert_algebraic_solves(case, time)
    assert_attitude(AsRounded(case), F(7, 3))
    top, start = case.rounded(220)
    assert dot(start.gamma, start.gamma) == 1
    enclosed = Validated(top, start).state(F(10), 170)
    assert max(abs(a - b) for a, b in zip(case.state(F(10), 170), enclosed, strict=True)) < arb("1e-50")


@pytest.mark.parametrize(
    ("inertia", "place", "what"),
    [
        (("nan", 1, 2), F(1, 2), "inertia"),
        ((8, 6), F(1, 2), "inertia must have 3"),
        ("863", F(1, 2), "inertia"),
        ((8, 6, 3), "nan", "place"),
        ((8, 6, 3), float("inf"), "place"),
        ((8, 6, 3), "", "place"),
        ((8, 6, 3), "1e400", "place"),
    ],
)
def test_what_is_no_number_is_refused_by_the_name_of_the_argument(inertia, place, what):
    with pytest.raises(InputError, match=what):
        dokshevich_motion(inertia, place)


@pytest.mark.parametrize("data", [((8, 3, 6), F(1, 2)), ((0, 1, 2), F(1, 2)), ((8, 6, 3), F(1)), ((8, 6, 3), F(0))])
def test_numbers_of_no_such_top_are_refused(data):
    with pytest.raises(InputError):
        dokshevich_motion(tuple(map(F, data[0])), data[1])
