"""Random exact data and residuals for the elliptic motions."""

from fractions import Fraction

from flint import arb

from heavytop.exact.flint.balls import ball, radius, working_precision
from heavytop.top.equations import Parameters


def rational(rng, size=3, denominator=6):
    bottom = rng.randint(1, denominator)
    return Fraction(rng.randint(-size * bottom, size * bottom), bottom)


def positive(rng):
    return Fraction(rng.randint(2, 20), rng.randint(2, 7))


def vector(rng):
    return rational(rng), rational(rng), rational(rng)


def in_balls(parameters):
    return Parameters(
        [ball(i) for i in parameters.inertia], [ball(n) for n in parameters.moment], ball(Fraction(parameters.rotor))
    )


def assert_solves_its_equations(motion, parameters, time, bits=230, limit=Fraction(1, 10**40)):
    """The ε^0 coefficient of derivative minus field holds 0 in a ball narrower than ``limit``, in all six equations."""
    series = motion.series(time, 2, bits)
    with working_precision(2 * bits):
        field = motion.system.field(in_balls(parameters), series)
        for component, value in zip(series, field, strict=True):
            residual = component[1] - value[0]
            assert residual.contains(0), (motion, time, residual)
            assert radius(residual) < limit, (motion, time, residual)


def assert_starts_there(motion):
    with working_precision(300):
        for value, exact in zip(motion.state(Fraction(0), 200), motion.start.flat, strict=True):
            assert value.overlaps(ball(exact))


def assert_same(values, others, limit=Fraction(1, 10**50)):
    with working_precision(600):
        for value, other in zip(values, others, strict=True):
            assert value.overlaps(other if isinstance(other, arb) else ball(other)), (value, other)
            assert radius(value) < limit
