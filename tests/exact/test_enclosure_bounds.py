"""Every bound of a proven step, held against exact arithmetic on the same numbers.

What binary64 gives must be at least what the theorem asks for, and the room left for rounding must be there.
"""

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from math import factorial
from random import Random

import numpy as np
import pytest
from flint import fmpq, fmpq_mat, fmpq_poly

from heavytop import GYROSTAT, HEAVY_TOP, HeavyTop, State
from heavytop.exact.enclosure import step as enclosure
from heavytop.exact.enclosure.run import ScaledMotion, Validated
from heavytop.exact.enclosure.step import CAP, Errors, Node, Whole, quadratic, start_node, step
from heavytop.exact.flint.balls import midpoint, radius, working_precision
from support.helpers import rational
from support.proofs import assert_overlap

TOP = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
PARAMETERS = HEAVY_TOP.parameters(TOP, START)
FIELD = quadratic(lambda y: HEAVY_TOP.field(PARAMETERS, y), 6)
# a rotor so fast that the linear part counts most
ROTOR = PARAMETERS._replace(rotor=Fraction(40))
WITH_ROTOR = quadratic(lambda y: GYROSTAT.field(ROTOR, y), 6)
# the same motions in words, in units of their own
WORDS = [
    ScaledMotion.of(system, p, START.flat, forwards=True) for system, p in ((HEAVY_TOP, PARAMETERS), (GYROSTAT, ROTOR))
]
IN_WORDS = {id(motion.field): motion for motion in WORDS}
FIELDS = {
    "heavy top": FIELD,
    "gyrostat": WITH_ROTOR,
    "heavy top in words": WORDS[0].field,
    "gyrostat in words": WORDS[1].field,
}
SIX = range(6)


def node_with(precision, size, seed=0, field=FIELD, start=START.flat):
    """The start with a set of errors of about ``size`` ulps in a turned frame."""
    rng = np.random.default_rng(seed)
    node = start_node(field, start, precision)
    frame = np.linalg.qr(rng.standard_normal((6, 6)))[0]
    return Node(node.time, node.centre, Errors(frame, size * (0.5 + rng.random(6)), 0), node.halvings)


STEPS = [(64, 0.5), (64, 2.0**34), (128, 1e4), (400, 2.0**370)]


@pytest.fixture(params=FIELDS, scope="module")
def field(request):
    return FIELDS[request.param]


@pytest.fixture(params=STEPS, scope="module", ids=lambda case: f"{case[0]} bits, errors {case[1]:.1g}")
def made(request, field):
    precision, size = request.param
    motion = IN_WORDS.get(id(field))
    if motion is None:
        found = step(field, node_with(precision, size, field=field), precision)
    else:
        grid = {64: 138, 128: 184, 400: 528}[precision]
        node = node_with(grid, size * 2.0 ** (grid - precision), field=field, start=motion.scaled.state)
        found = step(field, node, grid, motion.certified(grid))
    return found


def ulp(found):
    return Fraction(1, 2**found.precision)


def betas(found):
    return [max(abs(int(value)) for value in column) * ulp(found) for column in zip(*found.coefficients, strict=True)]


def exponential(value):
    """e^value from below, to 30 digits."""
    return sum(value**k / factorial(k) for k in range(60))


exact = np.vectorize(lambda value: Fraction(float(value)), otypes=[object])
"""The binary64 numbers of an array, as they are."""


def norm(matrix):
    return abs(matrix).sum(axis=1).max()


def inverse_of(matrix):
    found = fmpq_mat(6, 6, [rational(value) for value in matrix.flat]).inv()
    return np.array([Fraction(int(value.p), int(value.q)) for value in found.entries()]).reshape(6, 6)


def set_size(errors):
    return (abs(exact(errors.frame)) @ exact(errors.radii)).max() * Fraction(2) ** errors.exponent


def theorem(found, field):
    """(D, W, the bound of |v|) of the module's theorem, exactly but for e^Λ from below; as numbers."""
    h, q, slope, beta = found.length, field.q, field.l, betas(found)
    order = found.order
    # half an ulp an order in integers; in words what tests/multiword/test_proven.py attacks
    defect = Fraction(found.series.rounding) * ulp(found)
    for n in range(order, 2 * order + 1):
        pairs = sum(beta[j] * beta[n - j] for j in range(max(0, n - order), min(n, order) + 1))
        defect += h * (q * pairs + (slope * beta[n] if n <= order else 0)) / (n + 1)
    growth = exponential(h * (2 * q * sum(beta) + slope) + h * q * Fraction(CAP))
    widest = (set_size(found.node.errors) * ulp(found) + defect) * growth
    return defect, widest, growth * (defect + h * q * widest**2)


@pytest.mark.parametrize("precision", [64, 400, 1500])
def test_each_coefficient_is_rounded_to_nearest(precision):
    """b_(n+1) is h f_n/(n + 1) within half an ulp, whichever way its products were summed: 1500 bits take blocks."""
    found = step(FIELD, node_with(precision, 0.5), precision)
    series = [[int(value) for value in component] for component in found.coefficients]
    p = PARAMETERS._replace(
        inertia=[rational(i) for i in TOP.inertia], moment=[rational(n) for n in TOP.moment], rotor=fmpq(0)
    )
    rates = HEAVY_TOP.field(p, [fmpq_poly([fmpq(c, 2**precision) for c in component]) for component in series])
    for component, rate in zip(series, rates, strict=True):
        for n in range(found.order):
            exactly = rational(found.length) * rate[n] * 2**precision / (n + 1)
            assert abs(component[n + 1] - exactly) <= fmpq(1, 2)


@pytest.mark.slow
def test_the_defect_is_what_the_coefficients_leave(made, field):
    defect, _, _ = theorem(made, field)
    h = float(made.length)
    bound = enclosure.defect_bound(made.series, made.precision, h * float(field.q), h * float(field.l))
    # β is bounded by a power of two: up to 4 times too large in a product
    assert defect <= Fraction(bound) * ulp(made) <= 16 * defect


@pytest.mark.slow
def test_local_and_widest_errors_are_those_of_the_theorem(made, field):
    defect, widest, local = theorem(made, field)
    scale = Fraction(2) ** made.node.errors.exponent * ulp(made)
    assert widest <= Fraction(made.widest) <= 2 * widest + 32 * defect
    assert local <= Fraction(made.local) * scale <= 4 * local + 64 * defect


def test_a_set_of_errors_is_as_large_as_its_components_say():
    rng = np.random.default_rng(5)
    for _ in range(40):
        errors = Errors(rng.standard_normal((6, 6)), rng.random(6) * 10.0 ** rng.integers(-5, 20), 0)
        matrix, slack = rng.standard_normal((6, 6)), float(rng.random())
        for frame, found, more in ((errors.frame, errors.sizes(), 0.0), (matrix, errors.sizes(matrix, slack), slack)):
            true = abs(exact(frame)) @ exact(errors.radii) + Fraction(more) * exact(errors.radii).max()
            assert (true <= exact(found)).all()
            assert (exact(found) <= true * (1 + Fraction(1, 2**30))).all()


def exact_variation(found, top):
    """V by powers of τ up to ``top``, of the step's polynomial as it is: V' = h J V, exact.

    J v = (f(y + v) − f(y − v))/2, as f is quadratic.
    """
    p, half = PARAMETERS.mapped(rational), rational(found.length) / 2
    y = [fmpq_poly([fmpq(int(c), 2**found.precision) for c in component]) for component in found.coefficients]
    columns = []
    for j in SIX:
        v = [fmpq_poly([int(i == j)]) for i in SIX]
        for n in range(top):
            up, down = (HEAVY_TOP.field(p, [a + s * b for a, b in zip(y, v, strict=True)]) for s in (1, -1))
            v = [x + fmpq_poly([0] * (n + 1) + [half * (a - b)[n] / (n + 1)])
                 for x, a, b in zip(v, up, down, strict=True)]  # fmt: skip
        columns.append(v)
    powers = [[[v[i][n] for v in columns] for i in SIX] for n in range(top + 1)]
    return np.vectorize(lambda value: Fraction(int(value.p), int(value.q)), otypes=[object])(powers)


@pytest.mark.slow
@pytest.mark.parametrize("precision", [64, 128])
def test_the_variation_is_known_within_its_error(precision):
    found = step(FIELD, node_with(precision, 0.5), precision)
    true = exact_variation(found, 40)
    off, error = norm(true.sum(axis=0) - exact(found.variation.sum(axis=0))), Fraction(found.summed_error)
    # beyond τ^40 next to nothing is left at half the radius of convergence
    assert off <= error
    assert error < Fraction(1, 2**40)
    for n, matrix in enumerate(found.variation):
        assert norm(true[n] - exact(matrix)) <= Fraction(found.variation_error)
        assert norm(exact(matrix)) <= Fraction(found.powers)


@pytest.mark.slow
@pytest.mark.parametrize("h", [0.25, 2.0, 16.0])
def test_the_error_of_the_variation_holds_its_defect(h, field):
    """At a state that stays, J is constant: V̂' − J V̂ is what the rounding of V̂ and its last power leave, exactly."""
    node = start_node(field, START.flat, 64)
    series = Whole([[value] for value in node.centre], 64)
    slopes = h * 2 * float(field.q) * np.array([float(max(map(abs, node.centre))) / 2.0**64])
    given, _, error = enclosure._variation(field, series, h, slopes)
    state = np.array([Fraction(int(value), 2**64) for value in node.centre])
    slope = Fraction(h) * (exact(field.jacobian) @ state + exact(field.slope))
    powers = [*map(exact, given), exact(np.zeros((6, 6)))]
    defects = [norm(n * after - slope @ before) / n for n, (before, after) in enumerate(pairwise(powers), 1)]
    assert sum(defects) <= Fraction(error)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("uncertain", "size", "skew"), [(0.0, 1, 0.0), (1e-14, 1, 0.0), (1e-6, 1, 0.0), (0.0, 1e-4, 1e-9), (0.0, 1, 1e-9)]
)
def test_a_new_frame_pays_for_all_that_it_is_not(uncertain, size, skew, monkeypatch):
    """size: of the variation.  skew: how far the factorisation is from orthogonal, which binary64 alone would hide."""
    rng, factorised = np.random.default_rng(8), np.linalg.qr
    for _ in range(6):
        variation = size * (np.eye(6) + 0.7 * rng.standard_normal((6, 6)))
        errors = Errors(factorised(rng.standard_normal((6, 6)))[0], rng.random(6), 0)
        noise = skew * rng.standard_normal((6, 6))
        monkeypatch.setattr(np.linalg, "qr", lambda matrix, noise=noise: (factorised(matrix)[0] + noise, None))
        frame, turned, slack = enclosure._new_frame(variation, uncertain, errors)
        back, bound = inverse_of(exact(frame)), Fraction(slack)
        assert norm(back - exact(frame.T)) <= bound
        # the disturbance that the bound is for: all of it in the row and with the signs that count most
        signs = np.where(errors.frame.sum(axis=1) >= 0, 1, -1)
        for row in SIX:
            moved = exact(np.zeros((6, 6)))
            moved[row] = Fraction(uncertain) / 6 * signs
            assert norm(back @ (exact(variation) + moved) @ exact(errors.frame) - exact(turned)) <= bound
        assert bound <= Fraction(1, 10**11) + 20 * Fraction(uncertain) + 10**4 * Fraction(skew)


def test_the_value_of_the_polynomial_is_within_its_rounding():
    """With all errors but that of Horner's scheme taken away: half an ulp a power is left, and some of it is used."""
    found = step(FIELD, node_with(128, 0.5), 128)
    still = Errors(found.node.errors.frame, np.zeros(6), 0)
    bare = replace(found, node=replace(found.node, errors=still), local=0.0, variation_error=0.0)
    used = Fraction(0)
    for tau in (Fraction(n, 97) for n in range(0, 98, 4)):
        with working_precision(300):
            balls = bare.at(tau)
        for ball, component in zip(balls, found.coefficients, strict=True):
            true = sum((int(c) * tau**n for n, c in enumerate(component)), Fraction(0)) * ulp(found)
            off = abs(midpoint(ball) - true)
            assert off <= radius(ball) <= Fraction(found.order + 1, 2) * ulp(found)
            used = max(used, off / ulp(found))
    assert used > Fraction(1, 2)


@pytest.mark.parametrize("uncertain", [0.0, 1e-9, 1e-3])
def test_what_is_not_known_of_the_variation_widens_the_state(uncertain):
    found = replace(step(FIELD, node_with(128, 1e6), 128), local=0.0, variation_error=uncertain)
    errors, unit = found.node.errors, ulp(found)
    with working_precision(300):
        balls = found.at(Fraction(1))
    moved = abs(exact(found.variation.sum(axis=0)) @ exact(errors.frame)) @ exact(errors.radii)
    for ball, linear in zip(balls, moved, strict=True):
        assert radius(ball) >= (linear + Fraction(uncertain) * set_size(errors)) * unit
    with_it, without = found.end().errors, replace(found, variation_error=0.0).end().errors
    assert all(with_it.radii >= without.radii)
    assert with_it.radii.max() >= without.radii.max() + uncertain * float(errors.radii.max()) / 3


def test_what_a_step_adds_is_carried_into_every_direction_of_the_new_frame():
    """|v| ≤ local in the maximum norm: component i of Q'^-1 v may come to local times the sum of row i."""
    found = step(FIELD, node_with(128, 1e4), 128)
    still = Errors(found.node.errors.frame, np.zeros(6), 0)
    following = replace(found, node=replace(found.node, errors=still), local=1e6).end()
    needed = abs(inverse_of(exact(following.errors.frame))).sum(axis=1) * 10**6
    assert (needed <= exact(following.errors.radii)).all()
    assert (exact(following.errors.radii) <= needed * (1 + Fraction(1, 10**6))).all()


def true_motion(displaced, time, bits=300):
    return Validated(TOP, State(displaced[:3], displaced[3:])).state(time, bits)


@pytest.mark.slow
@pytest.mark.parametrize("size", [2.0**-18, 2.0**-40])
def test_motions_from_the_edge_of_the_set_stay_inside(size):
    """Displaced as far as the set goes, and so that one component moves most: the linear part alone is too small."""
    precision = 128
    node = start_node(FIELD, START.flat, precision)
    centre = [Fraction(int(value), 2**precision) for value in node.centre]
    node = Node(node.time, node.centre, Errors(np.eye(6), np.full(6, size * 2.0**precision), 0), node.halvings)
    found = step(FIELD, node, precision)
    with working_precision(2 * precision):
        sets = {tau: found.at(tau) for tau in (Fraction(1, 3), Fraction(1))}
    following = found.end()
    for component in SIX:
        rows = np.sign(found.variation.sum(axis=0)[component])
        for sign in (1, -1):
            moved = [c + Fraction(size) * int(sign * s) for c, s in zip(centre, rows, strict=True)]
            for tau, balls in sets.items():
                assert_overlap(balls, true_motion(moved, tau * found.length))
            ends = zip(true_motion(moved, found.length), following.centre, strict=True)
            gap = np.array([midpoint(true) - Fraction(int(c), 2**precision) for true, c in ends])
            room = exact(following.errors.radii) * Fraction(2) ** (following.errors.exponent - precision)
            assert (abs(inverse_of(exact(following.errors.frame)) @ gap) <= room + Fraction(1, 2**200)).all()


def test_errors_beyond_what_the_theorem_admits_are_no_step():
    precision = 128
    found = step(FIELD, node_with(precision, 2.0 ** (precision - 20)), precision)
    assert found is None or found.widest < CAP
    assert step(FIELD, node_with(precision, 2.0 ** (precision - 16)), precision) is None


def test_a_start_is_rounded_by_at_most_half_an_ulp_and_off_by_what_is_said_of_it():
    """Half an ulp where that is the rounding, and none of an exact start is paid for."""
    rng = Random(3)
    for _ in range(50):
        start = tuple(Fraction(rng.randint(-99, 99), rng.randint(1, 99)) for _ in SIX)
        start = (Fraction(1, 2**71), *start[1:5], Fraction(3))
        off = tuple(Fraction(rng.randint(1, 99), rng.randint(1, 99) * 2**60) for _ in SIX)
        exactly, within = start_node(FIELD, start, 70), start_node(FIELD, start, 70, off)
        assert exactly.centre == within.centre
        for value, whole, error, more, beyond in zip(
            start, exactly.centre, exactly.errors.radii, within.errors.radii, off, strict=True
        ):
            assert abs(value * 2**70 - int(whole)) <= Fraction(float(error))
            assert Fraction(float(more)) >= Fraction(float(error)) + beyond * 2**70
        assert exactly.errors.radii[-1] == 0


def test_the_roundings_of_horners_scheme_are_paid_for_where_every_one_is_half_an_ulp():
    """Each total is half a denominator, so that each product is rounded up by half: N/2 ulps in all, for tau near 1."""
    order, denominator = 40, 1 << 30
    tau, total, values = Fraction(denominator - 1, denominator), 0, []
    for _ in range(order + 1):
        moved = (2 * total * tau.numerator + denominator) // (2 * denominator)
        values.append((denominator // 2 - moved) % denominator)
        total = moved + values[-1]
    values.reverse()
    found = step(FIELD, node_with(128, 1.0), 128)
    made = replace(found, series=Whole([values] * 6, 128), precision=128)
    (ball, *_) = made.around(tau, np.zeros(6))
    true = sum(value * tau**n for n, value in enumerate(values)) * ulp(made)
    with working_precision(400):
        off = abs(midpoint(ball) - true)
    assert Fraction(order - 2, 2) * ulp(made) < off <= radius(ball)


def test_the_sum_and_the_product_of_the_variation_have_room_for_their_roundings():
    """A row that cancels in binary64, whichever product is rounded first, and not in exact numbers."""
    found = step(FIELD, node_with(128, 1.0), 128)
    terms = enclosure._VARIATIONAL_ORDER + 1
    assert found.summed_error >= found.variation_error + terms * 2.0**-53 * found.powers
    near, off = 1 + 2.0**-30, 1 + 2.0**-29
    variation, frame = np.zeros((1, 6, 6)), np.zeros((6, 6))
    variation[0, 0, :2], variation[0, 1, :2] = (near, -off), (-off, near)
    frame[:2, 0], frame[:2, 1] = (near, 1), (1, near)
    errors = Errors(frame, np.array([1.0, 1.0, 0, 0, 0, 0]), 0)
    made = replace(
        found, node=replace(found.node, errors=errors), variation=variation, powers=2.1, variation_error=0.0, local=0.0
    )
    sizes = abs(exact(variation[0]) @ exact(frame))[:, :2].sum(axis=1)
    assert (sizes <= exact(made.radii(Fraction(1)))).all()


@pytest.mark.parametrize(("quadratic", "linear"), [(0.0, 0.75), (0.75, 0.0), (0.5, 0.25)])
def test_both_parts_of_the_defect_beyond_the_last_order_count(quadratic, linear):
    values = [1 << 127, *[0] * 18, 1 << 101, 1 << 100]
    found, order, unit = Whole([values] * 6, 128), 20, Fraction(1, 2**128)
    products = sum(
        Fraction(values[j] * values[n - j], n + 1) * unit
        for n in range(order, 2 * order + 1)
        for j in range(n - order, order + 1)
    )
    beyond = Fraction(quadratic) * products + Fraction(linear) * Fraction(values[-1], order + 1)
    assert Fraction(order, 2) + beyond <= Fraction(enclosure.defect_bound(found, 128, quadratic, linear))
