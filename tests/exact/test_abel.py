"""Real Abel inversion: its integrals, their errors, balls that hold every solution; the contract has its motions."""

from itertools import pairwise

import pytest
from flint import acb, arb

from heavytop.errors import OutOfReach
from heavytop.exact.flint.balls import working_precision
from heavytop.exact.separable.abel import Inversion
from heavytop.exact.separable.oscillation import Approach, FourierBound, Gap, Roots, SineSums, fourier_rows

BITS = 256


def gap_between(roots, lo, hi, count=2, **options):
    rest = [(acb(b), 1) for b in roots if b not in (lo, hi)]
    return Gap(arb(lo), arb(hi), Roots.of(arb(1), rest), count, **options)


def two_gaps(roots=(-1, 0, 1, 3, 4, 6)):
    return Inversion((gap_between(roots, 0, 1), gap_between(roots, 3, 4)), (1, -1))


def integral(gap, phase, order):
    """F_j by FLINT's own rigorous integration."""
    roots = gap.rest.all()

    def density(theta, analytic):
        v = gap.middle + gap.reach * theta.cos()
        product = acb(1)
        for b, many in roots:
            side = 1 if b.real < gap.middle else -1
            for _ in range(many):
                product = product * (side * (v - b)).rsqrt(analytic=analytic)
        return product * v**order

    return acb.integral(density, 0, phase).real


def test_integrals_are_those_of_rigorous_integration():
    with working_precision(BITS):
        gap = gap_between((-1, 0, 1, 3, 4, 6), 3, 4)
        for phase in (arb(1) / 3, arb(-5)):
            for order, value in enumerate(gap.integrals(phase)):
                assert value.overlaps(integral(gap, phase, order))
                assert value.rad() < arb(2) ** (20 - BITS)


@pytest.mark.parametrize(("turning", "limit"), [(0, 1), (1, 0)])
def test_integrals_towards_a_double_root_are_those_of_rigorous_integration(turning, limit):
    with working_precision(BITS):
        rest = Roots.of(arb(3), [(acb(-0.5), 1), (acb(0.75, 1), 2), (acb(0.75, -1), 2)])
        variable = Approach(arb(turning), arb(limit), rest)
        length = limit - turning

        def density(x, order):
            v = turning + length * x.tanh() ** 2
            return 2 * v**order * (3 * (v + 0.5)).rsqrt() / ((v - 0.75) ** 2 + 1)

        for phase in (arb(1) / 3, arb(-2)):
            for order, value in enumerate(variable.integrals(phase)):
                assert value.overlaps(acb.integral(lambda x, _, j=order: density(x, j), 0, phase).real)
                assert value.rad() < arb(2) ** (20 - BITS)
        # F has the slope h at any X, near and far
        for phase in (arb(1) / 5, arb(30)):
            step = arb(2) ** -40
            slopes = zip(variable.integrals(phase + step), variable.integrals(phase - step), strict=True)
            v = variable.position(phase)
            for order, (above, below) in enumerate(slopes):
                assert abs((above - below) / (2 * step) - v**order * variable.density(v)) < arb(2) ** -70


@pytest.mark.parametrize("bits", [60, 120])
def test_the_error_towards_a_double_root_is_bounded(bits):
    rest = Roots.of(arb(1), [(acb(1.25), 1)])
    with working_precision(bits):
        rough = Approach(arb(-1), arb(1), rest)
    with working_precision(400):
        true = Approach(arb(-1), arb(1), rest)
        for phase in (arb(k) / 3 for k in range(-20, 20)):
            for one, other, error in zip(rough.integrals(phase), true.integrals(phase), rough.errors, strict=True):
                assert one.overlaps(other)
                assert error.rad() < arb(2) ** (8 - bits)


@pytest.mark.slow
@pytest.mark.parametrize("other", [acb(1.25), acb(-3), acb(0.5, 0.25), acb(0, 2)])
def test_the_fourier_error_is_bounded_and_the_bound_is_not_idle(other):
    # few terms beside many: the difference is below the bound, and not far below it
    with working_precision(1000):
        others = [(other, 1)] if other.imag.is_zero() else [(other, 1), (other.conjugate(), 1)]
        true, few, errors, bounds = Gap(arb(-1), arb(1), Roots.of(arb(1), others)), 256, [], []
        rows = fourier_rows(true.middle, true.reach, true.rest, few, 2)
        bound = FourierBound(true.middle, true.reach, true.rest)
        sums = SineSums([[2 * c / n for n, c in enumerate(row[1:], 1)] for row in rows])
        for order in range(2):
            assert abs(rows[order][0] - true.means[order]) < bound.mean_error(few, order).rad()
            bounds.append(bound.sum_error(few, order).rad())
            errors.append(
                max(abs(sums.at(x)[order] - true.sums.at(x)[order]) for x in (arb(k) / 5 for k in range(1, 15)))
            )
        for error, limit in zip(errors, bounds, strict=True):
            assert error < limit
            # η is 0.9 of what is possible, and no bound of this kind sees cancellation
            assert error > limit**2


def test_a_target_known_too_roughly_is_not_solved():
    with working_precision(BITS):
        inversion = two_gaps()
        target = inversion.values([arb(1), arb(2)])
        wide = [value + arb(0, 3) for value in target]
        assert not any(phase.is_finite() for phase in inversion.phases(wide)[0])
        assert not any(phase.is_finite() for phase in inversion.phases([arb("nan"), arb(1)])[0])


def test_a_wide_target_gives_balls_that_hold_every_solution():
    with working_precision(BITS):
        inversion = two_gaps()
        phases = [arb(1), arb(2)]
        middle, width = inversion.values(phases), arb(2) ** -20
        found, _ = inversion.phases([value + arb(0, width) for value in middle])
        for corner in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            exact, _ = inversion.phases([m + c * width for m, c in zip(middle, corner, strict=True)])
            assert all(wide.contains(narrow) for wide, narrow in zip(found, exact, strict=True))


def test_roots_that_all_but_coincide_are_refused_with_the_number_of_terms():
    with working_precision(BITS):
        counts = [gap_between((-1, 0, 1, 1 + distance), 0, 1).terms for distance in (0.5, 0.125, 0.03125)]
        assert all(1 < b / a < 4 for a, b in pairwise(counts))
        with pytest.raises(OutOfReach, match="Fourier terms, more than 4096"):
            gap_between((-1, 0, 1, 1 + 2.0**-20), 0, 1, most=4096)
