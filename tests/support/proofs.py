"""What proves a closed form: its series in the equations, its start, and the enclosure, which mpmath judges."""

from __future__ import annotations

import random
from fractions import Fraction

from flint import arb

from heavytop.exact.catalogue import state_and_attitude
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, midpoint, radius, working_precision
from heavytop.top.equations import HEAVY_TOP, Parameters

DIGITS_60 = 200


def parameters(solution):
    """The parameters of the solution's field as balls at the working precision."""
    exact = getattr(solution, "parameters", None) or solution.system.parameters(solution.top, solution.start)
    return exact.mapped(lambda value: ball(Fraction(value)))


def residual(solution, time, bits=DIGITS_60, length=3):
    """y' - f(y) at the time, all coefficients that a series of that length has."""
    series = solution.series(time, length, bits)
    with working_precision(2 * bits):
        field = solution.system.field(parameters(solution), series)
        return [(y.derivative() - f)[k] for y, f in zip(series, field, strict=True) for k in range(length - 1)]


def assert_solves(solution, *times, length=3):
    """The residual of all six equations contains 0 with radius below 1e-40 at 60 digits; t = 0 gives the start.

    A state is the first coefficient of its series: numbers and series may be computed in different ways.
    """
    for time in times:
        assert_overlap(solution.state(time, DIGITS_60), [y[0] for y in solution.series(time, 2, DIGITS_60)])
        for number, value in enumerate(residual(solution, time, length=length)):
            assert value.contains(0), f"equation {number // (length - 1) + 1} of 6 at t = {time}: residual {value}"
            assert value.rad() < arb("1e-40")
    for value, exact in zip(solution.state(Fraction(0), DIGITS_60), solution.start.flat, strict=True):
        assert abs(midpoint(value) - exact) <= 2 * radius(value) + Fraction(1, 10**70) * abs(exact)


def assert_attitude(solution, *times, step=Fraction(1, 10**12)):
    """ξ is a unit vector across γ that turns with the body: a difference quotient against ξ × ω."""
    bits = DIGITS_60
    for time in times:
        xi, later, earlier = (solution.attitude(t, bits) for t in (time, time + step, time - step))
        state = solution.state(time, bits)
        with working_precision(2 * bits):
            omega = solution.system.angular_velocity(parameters(solution), state)
            one = sum(x * x for x in xi)
            across = sum(x * g for x, g in zip(xi, state[3:], strict=True))
            assert abs(one - 1).abs_upper() < arb("1e-55")
            assert across.abs_upper() < arb("1e-50")
            wanted = (
                xi[1] * omega[2] - xi[2] * omega[1],
                xi[2] * omega[0] - xi[0] * omega[2],
                xi[0] * omega[1] - xi[1] * omega[0],
            )
            size = (1 + sum(abs(w) for w in omega) + sum(abs(s) for s in state)) ** 3
            for a, b, w in zip(later, earlier, wanted, strict=True):
                # the error of the central difference is step²/6 times a third derivative
                assert abs((a - b) / (2 * ball(step)) - w).abs_upper() < size.abs_upper() ** 2 * arb("1e-20")


def attitude_of(solution, latest, bits):
    """How the attitude of ``solution`` is known, and ξ alone."""
    method, both = state_and_attitude(solution, latest, bits)
    return method, lambda time, bits: both(time, bits)[6:]


def assert_meets(solution, times, bits=170):
    """The attitude is that of the enclosure, both from the exact start."""
    enclosure = Validated(solution.top, solution.start)
    _, attitude = attitude_of(solution, max(times, key=abs), bits)
    for time in times:
        pairs = list(zip(attitude(time, bits), enclosure.attitude(time, bits), strict=True))
        with working_precision(2 * bits):
            assert all(a.overlaps(b) for a, b in pairs)
            assert max(abs(a - b).upper() for a, b in pairs) < arb("1e-40")


def assert_every_digit(solution, *times):
    """It solves the equations at these times, and the digits asked for come out."""
    for time in times:
        assert_solves(solution, time)
        assert_narrow(solution, time)


def assert_narrow(solution, time, digits=50):
    """The digits asked for come out at that time."""
    bits = int(digits * 3.33) + 8
    for value in solution.state(time, bits):
        assert value.is_finite()
        assert value.rad() < arb(10) ** -digits * (1 + abs(value).abs_upper())


def rational(rng: random.Random, size=4, denominator=12):
    """A random rational number of about that size, at most 1/denominator fine."""
    bottom = rng.randint(1, denominator)
    return Fraction(rng.randint(-size * bottom, size * bottom), bottom)


def positive(rng: random.Random, size=4, denominator=9):
    """A random positive rational number."""
    bottom = rng.randint(1, denominator)
    return Fraction(rng.randint(1, size * bottom), bottom)


def triple(rng, draw=rational):
    """Three random numbers."""
    return tuple(draw(rng) for _ in range(3))


def assert_algebraic_solves(motion, time, bits=200):
    """Of an algebraic start: the residual of all six equations contains 0 within 1e-40 at 60 digits; |γ| = 1."""
    series, moment = motion.series(time, 3, bits), motion.moment(2 * bits)
    with working_precision(2 * bits):
        field = HEAVY_TOP.field(Parameters([ball(i) for i in motion.inertia], moment, arb(0)), series)
        for y, f in zip(series, field, strict=True):
            for k in range(2):
                off = (y.derivative() - f)[k]
                assert off.contains(0)
                assert off.rad() < arb("1e-40")
        assert abs(sum(g[0] * g[0] for g in series[3:]) - 1) < arb("1e-55")


class Changed:
    """A motion of which ``change`` makes other balls or series, from the right ones and the time."""

    def __init__(self, known, change, method="changed"):
        self.known, self.change = known, change
        self.method, self.source, self.system, self.top, self.start = method, "", known.system, known.top, known.start

    def state(self, time, bits):
        values = self.known.state(time, bits)
        with working_precision(bits + 200):
            return self.change(values, time)

    def series(self, time, length, bits):
        values = self.known.series(time, length, bits)
        with working_precision(bits + 200):
            return self.change(values, time)


class AsRounded:
    """The motion as if it were that of a top whose data agree with it to 280 bits."""

    system = HEAVY_TOP

    def __init__(self, motion):
        self.top, self.start = motion.rounded(280)
        self.state, self.attitude = motion.state, motion.attitude


def assert_exact(motion, seed, attitude=False):
    """The contract of a random motion of a class: equations at a random time, balls narrow far out, attitude."""
    assert_solves(motion, rational(random.Random(seed), size=30))
    assert_narrow(motion, Fraction(10**6))
    if attitude:
        assert_attitude(motion, rational(random.Random(seed + 50), size=30))


def assert_enclosed(motion):
    """The validated enclosure meets the closed form on both sides of the start."""
    enclosure = Validated(motion.top, motion.start, motion.system, rotor=getattr(motion, "rotor", None))
    for time in (Fraction(3, 2), Fraction(-2)):
        assert_overlap(motion.state(time, 180), enclosure.state(time, 180))


def assert_overlap(balls, others, limit=None):
    """As many balls, each of which meets its counterpart and has a radius below the limit."""
    assert all(ball.overlaps(other) for ball, other in zip(balls, others, strict=True))
    assert limit is None or max(map(radius, balls)) < limit
