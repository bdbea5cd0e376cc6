"""What proven derivatives of a motion must satisfy: laws as balls around 0, and differences of references.

Each law knows nothing of how the derivatives were computed: it takes them, and the states of the motion.
"""

from __future__ import annotations

from fractions import Fraction

from flint import arb, arb_mat

from heavytop.exact.enclosure.derivatives import Dual, derivatives, moved
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, midpoint, radius, working_precision
from heavytop.top.equations import GYROSTAT, HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

BITS = 100
NARROW = Fraction(1, 10**20)
SIX = range(6)


def known(top, start, system=HEAVY_TOP):
    """The enclosure of a motion; λ of the gyrostat is held."""
    rotor = system.parameters(top, start).rotor if system is GYROSTAT else None
    return Validated(top, start, system, rotor=rotor)


def of(motion, time, bits=BITS, data=False):
    """The derivatives at one time."""
    return derivatives(motion, [Fraction(time)], bits, data)[0]


def as_balls(p):
    """Parameters as balls."""
    return p.mapped(lambda value: ball(Fraction(value)))


def laws(motion, time, found, bits=BITS):
    """By name, balls that contain 0 where J is right: determinant, the flow's own direction, first integrals, scale."""
    time = Fraction(time)
    state = motion.state(time, bits + 64)
    with working_precision(bits + 160):
        j, p = arb_mat(found.start), as_balls(motion.parameters)
        begun = [ball(value) for value in motion.start.flat]
        rate, later = motion.system.field(p, begun), motion.system.field(p, state)
        given = {"determinant": [j.det() - 1]}
        given["flow"] = _off(j, rate, later)
        for integral in _integrals(motion):
            gradient = arb_mat([_gradient(integral, p, state)]) * j
            at_start = _gradient(integral, p, begun)
            given[f"gradient of {integral.name}"] = [gradient[0, k] - at_start[k] for k in SIX]
        if motion.system is HEAVY_TOP:
            weights = (1, 1, 1, 2, 2, 2)
            scaled = [w * y + ball(time) * f for w, y, f in zip(weights, state, later, strict=True)]
            given["scale"] = _off(j, [w * y for w, y in zip(weights, begun, strict=True)], scaled)
        if found.data is not None and motion.system is not GYROSTAT:
            given |= _data_laws(motion, found, p, begun, state)
        return given


def _data_laws(motion, found, p, begun, state):
    """∂/∂θ F(y(t), θ) = ∂/∂θ F(y0, θ) for the energy and the area integral, θ the six data."""
    s = arb_mat(found.data)
    given = {}
    for integral in _integrals(motion):
        gradient = arb_mat([_gradient(integral, p, state)]) * s
        own, first = ([_datum(integral, p, y, k) for k in SIX] for y in (state, begun))
        given[f"data of {integral.name}"] = [gradient[0, k] + own[k] - first[k] for k in SIX]
    return given


def _integrals(motion):
    """Those that hold for every top, with every datum."""
    from heavytop.top.equations import holding

    general = HeavyTop((5, 7, 9), 1, (1, 2, 3), rotor=motion.top.rotor) if motion.system is not GYROSTAT else motion.top
    return holding(general, motion.start, motion.system)


def _gradient(integral, p, y):
    return [
        Dual.of(integral.value(p, [Dual(v, arb(int(i == k))) for i, v in enumerate(y)])).slope + arb(0) for k in SIX
    ]


def _datum(integral, p, y, k):
    return Dual.of(integral.value(moved(p, k, Dual(arb(0), arb(1))), y)).slope + arb(0)


def _off(matrix, vector, wanted):
    product = matrix * arb_mat([[v] for v in vector])
    return [product[k, 0] - wanted[k] for k in SIX]


def chain(motion, between, until, bits=BITS):
    """J(0 → until) − J(between → until) J(0 → between); the later motion begins at a rational state nearby.

    J of the later motion is taken at that state, and moves by at most its difference from the true one times a bound
    of the second derivative: 1e-40 against 1e-20.
    """
    first, whole = of(motion, between, bits).start, of(motion, until, bits).start
    state = [midpoint(value) for value in motion.state(Fraction(between), 256)]
    later = Validated(
        motion.top, State(state[:3], state[3:]), motion.system, rotor=getattr(motion.parameters, "rotor", None)
    )
    second = of(later, Fraction(until) - Fraction(between), bits).start
    with working_precision(bits + 160):
        product = arb_mat(second) * arb_mat(first)
        return [product[i, k] - whole[i][k] for i in SIX for k in SIX]


def difference(motion, time, column, bits=140, step_bits=100, datum=False):
    """Column of J or S from references alone: a central quotient, widened by twice what half the step changes.

    Its remainder is h² y'''/6 and more; with twice the step it is four times that.
    """
    quotients = [
        _quotient(motion, Fraction(time), column, Fraction(1, 2 ** (step_bits - k)), bits + step_bits, datum)
        for k in (0, 1)
    ]
    with working_precision(bits + 2 * step_bits):
        return [a + arb(0, 2 * abs(a - b).upper()) for a, b in zip(*quotients, strict=True)]


def _quotient(motion, time, column, step, bits, datum):
    ends = [_varied(motion, column, sign * step, datum).state(time, bits) for sign in (1, -1)]
    with working_precision(bits + 64):
        return [(a - b) / (2 * ball(step)) for a, b in zip(*ends, strict=True)]


def _varied(motion, column, by, datum):
    """The motion from data beside: one component of the start, or one moment, or one component of n = P r."""
    top, start, rotor = motion.top, list(motion.start.flat), motion.parameters.rotor
    if not datum:
        start[column] += by
    else:
        p = moved(motion.parameters, column, by)
        kept = {} if motion.system is GYROSTAT else {"rotor": top.rotor}
        top = HeavyTop(p.inertia, 1, p.moment, **kept)
    held = rotor if motion.system is GYROSTAT else None
    return Validated(top, State(start[:3], start[3:]), motion.system, rotor=held)


def holds(values, narrow=NARROW):
    """Whether each ball contains 0 and is narrow."""
    return all(value.contains(0) and radius(value) < narrow for value in values)


def largest_radius(values):
    """Of a matrix or a list of balls."""
    flat = [v for row in values for v in (row if isinstance(row, list) else [row])]
    return max(radius(v) for v in flat)
