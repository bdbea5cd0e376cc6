"""Integrals of functions of two angles along straight lines: every symmetry, resonant or not, and the bound."""

from itertools import product

import pytest
from flint import acb, arb, arb_mat

from heavytop.errors import OutOfReach
from heavytop.exact.flint.balls import working_precision
from heavytop.exact.separable.abel import Factor, LineIntegral, Symmetry, counts, error_of, points

BITS = 120
SYMMETRIES = [Symmetry(*pair) for pair in product((False, True), repeat=2)]
WIDTH = 1.2
RATES = (1, 2), (3, "1.7"), (1, "1.00000000001")
"""Resonant, not, and nearly."""


def factor(symmetry, angle):
    """(1 + cos φ/2) times the first function of that symmetry."""
    half = angle / 2 if symmetry.half else angle
    return (1 + angle.cos() / 2) * (half.sin() if symmetry.odd else half.cos() if symmetry.half else 1)


def kernel(one, other):
    return 1 / (4 - one.cos() - other.cos())


def bound():
    """W: on |Im φ| ≤ 1.2 each cosine is at most cosh 1.2 = 1.8107 in size, and each factor below 2.85 · 1.82."""
    return arb(2.85 * 1.82) ** 2 / (4 - 2 * arb(WIDTH).cosh())


def integral_of(pair, rates, began):
    widths = [arb(WIDTH)] * 2
    sizes = counts(widths)
    angles = [points(size) for size in sizes]
    factors = [Factor(symmetry, [factor(symmetry, x) for x in xs]) for symmetry, xs in zip(pair, angles, strict=True)]
    values = arb_mat([[kernel(x, y) for y in angles[1]] for x in angles[0]])
    error = error_of(bound(), widths, sizes)
    return LineIntegral.of([(factors[0], factors[1])], values, rates, began, bound(), error)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pair", "rates"),
    [(pair, RATES[place % 3]) for place, pair in enumerate(product(SYMMETRIES, repeat=2))]
    + [((SYMMETRIES[-1], SYMMETRIES[-1]), rates) for rates in RATES[1:]],
)
def test_the_integral_is_that_of_the_function(pair, rates):
    with working_precision(BITS):
        rates, began, length = [arb(rate) for rate in rates], [arb(0.3), arb(-1.1)], arb(4.5)
        found = integral_of(pair, rates, began)

        def along(s, _analytic):
            x, y = (angle + rate * s for angle, rate in zip(began, rates, strict=True))
            return factor(pair[0], x) * kernel(x, y) * factor(pair[1], y)

        ends = [angle + rate * length for angle, rate in zip(began, rates, strict=True)]
        value = found.at(ends, length) - found.at(began, arb(0))
        wanted = acb.integral(along, 0, length).real
        assert value.overlaps(wanted)
        assert value.rad() < arb("1e-28")


def test_an_angle_at_rest_has_one_point():
    with working_precision(BITS):
        sizes = counts([arb(WIDTH), None])
        assert sizes[1] == 1
        assert error_of(arb(1), [arb(WIDTH), None], sizes) < arb(2) ** -BITS


@pytest.mark.parametrize("terms", [(4, 40), (40, 5), (6, 6)])
def test_the_bound_holds_and_is_not_far_off(terms):
    """Of Σ e^(−η(|m| + |n|)) cos mφ1 cos nφ2, which is W at 0 in the strips, summed as the points alone know it."""
    with working_precision(BITS):
        width = arb("0.9")
        decay = (-width).exp()

        def whole(angle):
            return (1 - decay**2) / (1 - 2 * decay * angle.cos() + decay**2)

        ones = [Factor(Symmetry(False, False), [whole(x) for x in points(size)]) for size in terms]
        rows = [(one.transform() * arb_mat([[arb(1)]] * size)).entries() for one, size in zip(ones, terms, strict=True)]
        sums = [sum(row) for row in rows]
        off = abs(sums[0] * sums[1] - whole(arb(0)) ** 2)
        # every coefficient of Σ e^(−η|n|) e^(inφ) is e^(−η|n|): W = 1
        limit = error_of(arb(1), [width] * 2, terms)
        assert off < limit
        assert off * 8 > limit


def test_the_bound_is_twice_what_is_left_out():
    """4W times the sum of e^(−η1|m| − η2|n|) over all |m| ≥ n1 or, counted again, |n| ≥ n2."""
    with working_precision(BITS):
        widths, terms = (arb("0.9"), arb("0.4")), (5, 9)
        first, second = ([(-width * abs(n)).exp() for n in range(-400, 401)] for width in widths)
        tails = [sum(row[: 401 - n]) + sum(row[400 + n :]) for row, n in zip((first, second), terms, strict=True)]
        wanted = 2 * (tails[0] * sum(second) + sum(first) * tails[1])
        assert abs(error_of(arb(1), widths, terms) / wanted - 1) < arb("1e-30")


def test_every_pair_adds_its_own_error():
    with working_precision(BITS):
        one = Factor(Symmetry(False, False), [arb(1)] * 4)
        flat = arb_mat([[arb(1)] * 4] * 4)
        for count in (1, 3):
            found = LineIntegral.of([(one, one)] * count, flat, [arb(1), arb(2)], [arb(0)] * 2, arb(1), arb(1) / 8)
            assert abs(found.error - arb(count) / 8) < arb(2) ** (10 - BITS)


def test_too_many_terms_are_out_of_reach():
    with working_precision(BITS), pytest.raises(OutOfReach, match=r"\d+ x \d+ Fourier terms"):
        counts([arb(0.01), arb(0.02)])
    with working_precision(BITS), pytest.raises(OutOfReach):
        counts([arb(0), arb(1)])
