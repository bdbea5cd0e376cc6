"""Lattices: containment both ways, the value is inside and the ball is narrow."""

import random
from fractions import Fraction

import pytest
from flint import acb, arb

from heavytop.errors import OutOfReach
from heavytop.exact.elliptic.quartic import QuarticMotion
from heavytop.exact.elliptic.weierstrass import DegenerateLattice, Lattice, _cubic_roots, from_invariants
from heavytop.exact.flint.balls import ball, radius, working_precision

NARROW = Fraction(1, 10**35)
TINY = Fraction(1, 10**30)
EDGES = [(Fraction(12), Fraction(sign * 8) + off) for sign in (1, -1) for off in (-TINY, Fraction(0), TINY)] + [
    (Fraction(0), Fraction(0)),
    (Fraction(0), Fraction(-1)),
    (Fraction(-1), Fraction(0)),
]


def lattices():
    rng = random.Random(20)
    return [(Fraction(rng.randint(-40, 60), 7), Fraction(rng.randint(-40, 40), 9)) for _ in range(20)] + EDGES


def is_zero(value, limit=NARROW):
    value = acb(value)
    assert value.contains(0), value
    assert radius(value.real) < limit
    assert radius(value.imag) < limit


@pytest.fixture(autouse=True)
def _digits():
    with working_precision(320):
        yield


@pytest.mark.parametrize(("g2", "g3"), lattices())
def test_points_are_those_of_p_by_its_differential_equation_and_its_pole(g2, g3):
    """℘ = P/T² and ℘' = D/T³ with P, T and D of a point; T is as u, P as 1 and D as −2 where u is 0."""
    lattice = from_invariants(g2, g3)
    start = lattice.point(Fraction(0))
    is_zero(start.scale)
    is_zero(start.above(0) - 1)
    is_zero(start.slope + 2)
    is_zero(lattice.point(Fraction(0), 2).scale[1] - 1)
    for time in (Fraction(1, 3), Fraction(5), Fraction(-7, 2)):
        point, series = lattice.point(time), lattice.point(time, 3)
        value, slope = point.above(0) / point.scale**2, point.slope / point.scale**3
        is_zero(slope * slope - (4 * value**3 - ball(g2) * value - ball(g3)), Fraction(1, 10**12))
        is_zero((series.above(0) / (series.scale * series.scale))[0] - value, Fraction(1, 10**12))
        is_zero((series.above(0) / (series.scale * series.scale))[1] - slope, Fraction(1, 10**12))


@pytest.mark.parametrize(("g2", "g3"), [pair for pair in lattices() if pair[0] ** 3 != 27 * pair[1] ** 2])
def test_roots_are_the_values_of_p_at_its_half_periods(g2, g3):
    """With FLINT's ℘: at 1/2, (1 + τ)/2 and τ/2 of real periods, the last two by turns where τ is complex."""
    lattice = from_invariants(g2, g3)
    is_zero(sum(lattice.roots, acb(0)))
    others = lattice.roots[1:] if lattice.ratio.real == 0 else lattice.roots[:0:-1]
    places = acb(0.5), (1 + lattice.ratio) / 2, lattice.ratio / 2
    for z, root in zip(places, (lattice.roots[0], *others), strict=True):
        is_zero(z.elliptic_p(lattice.ratio) / (2 * lattice.half_period) ** 2 - root)


def test_the_sign_of_the_discriminant_is_decided_exactly():
    assert isinstance(from_invariants(Fraction(12), Fraction(8)), DegenerateLattice)
    assert isinstance(from_invariants(Fraction(12), 8 + Fraction(1, 10**500)), Lattice)
    with pytest.raises(OutOfReach, match="no certain sign"):
        from_invariants(arb(12), arb(8, 1e-9))


def test_balls_give_the_same_lattice_as_exact_invariants_and_as_the_roots():
    exact, near = from_invariants(Fraction(28), Fraction(-24)), from_invariants(arb(28), arb(-24))
    is_zero(near.half_period - exact.half_period)
    is_zero(near.ratio - exact.ratio)
    # 4x³ − 28x + 24 = 4 (x − 1)(x − 2)(x + 3)
    for root, known in zip(exact.roots, (2, 1, -3), strict=True):
        is_zero(root - known)
    rhombic = from_invariants(Fraction(1), Fraction(5))
    is_zero(from_invariants(arb(1), arb(5)).half_period - rhombic.half_period)


def quartics():
    """(1 − x²)-like quartics with rational starts: f(x0) a square; turning points and double roots among them."""
    rng = random.Random(9)
    for _ in range(20):
        x0, speed = Fraction(rng.randint(-9, 9), 5), Fraction(rng.randint(-9, 9), 4)
        rest = [Fraction(rng.randint(-8, 8), 3) for _ in range(3)] + [Fraction(-rng.randint(1, 5))]
        constant = speed**2 - sum(c * x0 ** (k + 1) for k, c in enumerate(rest))
        yield (constant, *rest), x0, speed
    yield (Fraction(1), Fraction(0), Fraction(-1)), Fraction(0), Fraction(1)
    yield (Fraction(1), Fraction(0), Fraction(-1)), Fraction(1), Fraction(0)
    yield (Fraction(1), Fraction(0), Fraction(-2), Fraction(0), Fraction(1)), Fraction(0), Fraction(1)
    yield (Fraction(0), Fraction(0), Fraction(1)), Fraction(0), Fraction(0)
    yield (Fraction(0), Fraction(0), Fraction(1), Fraction(0), Fraction(-1)), Fraction(1), Fraction(0)


@pytest.mark.parametrize(("coefficients", "x0", "speed"), list(quartics()))
def test_biermann_weierstrass_solves_any_quartic_from_any_start(coefficients, x0, speed):
    motion = QuarticMotion(coefficients, x0, speed).prepared()
    for time in (Fraction(0), Fraction(1, 3), Fraction(-17, 2)):
        point = motion.lattice.point(time, 3)
        x = motion.position(point, 1 / motion.denominator(point))
        f = sum((ball(c) * x[0] ** k for k, c in enumerate(coefficients)), arb(0))
        slope = sum((k * ball(c) * x[0] ** (k - 1) for k, c in enumerate(coefficients) if k), arb(0))
        is_zero(x[1] ** 2 - f)
        is_zero(2 * x[2] - slope / 2)
        if time == 0:
            is_zero(x[0] - ball(x0))
            is_zero(x[1] - ball(speed))


CLOSE = [Fraction(1, 10**3000), Fraction(1, 7), Fraction(10**3000)]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("off", [*(s * d for d in CLOSE for s in (1, -1)), Fraction(-15)])
def test_roots_and_gaps_are_right_however_close_they_are(sign, off):
    """g2 = 12, g3 = ±(8 + off): a double root where off = 0.  16 (e1 − e2)²(e1 − e3)²(e2 − e3)² = g2³ − 27 g3²."""
    g2, g3 = Fraction(12), sign * (8 + off)
    found = _cubic_roots(g2, g3)
    discriminant, (one, two, three) = g2**3 - 27 * g3**2, found.values
    size = max(abs(g3), 1)
    for root in found.values:
        residual = 4 * root**3 - ball(g2) * root - ball(g3)
        assert residual.contains(0)
        assert radius(residual.real) < size * NARROW
    assert (one + two + three).contains(0)
    assert (found.gaps is not None) == (discriminant > 0)
    if found.gaps is None:
        assert two.imag < 0 < three.imag
        across = (one - two) * (one - three) * acb(0, (two - three).imag)
    else:
        upper, lower = found.gaps
        assert upper > 0
        assert lower > 0
        assert upper.overlaps((one - two).real)
        assert lower.overlaps((two - three).real)
        across = acb(upper * lower * (upper + lower))
    quotient = 16 * across**2 / ball(discriminant)
    is_zero(quotient - 1)


def test_the_roots_of_invariants_as_balls_hold_those_of_their_middles():
    wide = from_invariants(arb(12, 1e-30), arb(7, 1e-30))
    for root, exact in zip(wide.roots, from_invariants(Fraction(12), Fraction(7)).roots, strict=True):
        assert root.contains(exact)
        assert 1e-33 < float(root.real.rad()) < 1e-28
