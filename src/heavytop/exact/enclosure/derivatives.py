"""Derivatives of a motion with respect to its start and its data, enclosed.

J(t) = ∂(Ω, γ)(t)/∂(Ω0, γ0) and S(t) = ∂(Ω, γ)(t)/∂(I1, I2, I3, n1, n2, n3), n = P r: plain partial derivatives of the
field as it stands.  γ0 counts as three independent variables, and the rotor (λ, or k) is held.

Each step of the enclosure of the motion gives its own Φ and σ, and

    J(t + h) = Φ J(t),     S(t + h) = Φ S(t) + σ.

The centres are multiplied exactly and rounded once.  The errors of each column of (J, S) are kept in the frames that
carry the errors of the motion, {Q x: |x_i| ≤ r_i}: with Q'^-1 Φ Q within η of T = Q'^T V̂ Q,

    r' = |T| r + η max r + |Q'^-1| e,     e = (|Φ − Φ̂| |J|_1 + |σ − σ̂| + ½ ulp),

so a column of errors is carried by Lohner's method as one more set of errors of the motion.  The working precision is
chosen so that the digits come out: it is raised by what was lacking, up to six times.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import exp, inf
from typing import TypeAlias

import numpy as np
from flint import arb, fmpz
from gmpy2 import mpq, mpz

from heavytop.errors import OutOfReach
from heavytop.exact.enclosure.run import ScaledMotion, Validated, own_parameters, seconds_a_step
from heavytop.exact.enclosure.step import (
    CAP,
    Matrix,
    Node,
    Quadratic,
    Step,
    StepSeries,
    defect_bound,
    horner,
    norm,
    quadratic,
    start_node,
    step,
    taylor_series,
)
from heavytop.exact.flint.balls import ball, relative_bits, whole_evaluation, working_precision
from heavytop.multiword.fixed_point.certified_series import CertifiedSeries, Total
from heavytop.precision import decimal_text
from heavytop.top.equations import Parameters, System

# One proven step of the derivatives: what the state at its end is to the state, and to the data, it began with.
#
# A step of :mod:`heavytop.exact.enclosure.step` goes over 0 ≤ τ ≤ 1 with y' = h f(y), f = Q(y, y) + L y.  φ is its flow
# from the centre c, Φ = Dφ its fundamental matrix, and σ the derivative with respect to a datum θ that enters f,
#
#     Φ' = h Df(y) Φ, Φ(0) = 1,     σ' = h Df(y) σ + h G(y), σ(0) = 0,     G = ∂f/∂θ, again of degree two.
#
# *Difference quotients over one step.*  Column j of Φ is (φ(c + δ e_j) − φ(c))/δ, both ends from Taylor polynomials in
# 2^-precision, δ = 2^-shift.  Over a single step a second derivative is small and proven so, whatever the motion does
# later: nothing of the quotient's error grows with time but by Φ itself.  So the machine code that computes the motion
# computes its derivatives too.  For θ the field is f + δ G̃, G̃ = (f(θ + δ) − f(θ))/δ, exactly.
#
# *Theorem.*  Every motion that starts within max(δ, |w0|) of c is within C of the polynomial Σ b_n τⁿ of c, so that
# R = Σ |b_n| + C bounds it, and Λ = h (2q (Σ |b_n|/(n + 1) + C) + l) the integral of |h Df| along it.  The end of each
# polynomial is within E = D e^Λ of its motion (D: its defect, as in the enclosure).  |D²φ| ≤ M = 2 h q e^Λ B², where
# B = Σ |V̂_n| + |V − V̂| + e^Λ 2 h q C (Σ |V̂_n| + |V − V̂|) bounds |Φ|.  So for any start y(0) = c + w, |w| ≤ |w0|,
#
#     |Φ e_j − quotient| ≤ M (δ/2 + |w0|) + (E_j + E_0)/δ.                                                          (a)
#
# Let g = q_G R² + l_G R bound |G̃| and Λ' be Λ with q + δ q_G and l + δ l_G.  Then |σ| ≤ s = e^Λ' h g, its derivative
# with respect to the datum is at most M' = e^Λ' h (2 (2 q_G R + l_G) s + 2 (q + δ q_G) s²), that with respect to the
# start M'' = e^(2Λ') h (2 q_G R + l_G + 2q s), and
#
#     |σ − quotient| ≤ M' δ/2 + M'' |w0| + (E_j + E_0)/δ + e^Λ' h |G − G̃|.                                           (b)
#
# Proof: the equations of first and second variation, v' = h Df v, S' = h Df S + h D²f(v, v) with |D²f(a, b)| ≤ 2q
# |a||b|, and with h DG v beside h D²f where θ varies; Gronwall; Taylor's formula with the second derivative as
# remainder.


TINY = 2.0**-190
_LARGEST_GROWTH = 16.0


@dataclass(frozen=True, slots=True)
class Datum:
    """A datum θ of the field, in a unit of its own, and the field with θ + δ.

    field: f + δ G̃.  certified: of its Taylor coefficients, as for a step.  quotient: (q, l) of G̃.  off: (q, l) of
    G − G̃, in ulps of the derivatives.
    """

    field: Quadratic
    certified: CertifiedSeries | None
    quotient: tuple[float, float]
    off: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Tangent:
    """What derivatives are computed with: ``field`` is f, δ = 2^-shift, on a grid of ``precision`` bits."""

    field: Quadratic
    certified: CertifiedSeries | None
    precision: int
    shift: int
    data: tuple[Datum, ...] = ()

    @property
    def bits(self) -> int:
        """Those of an ulp of the derivatives: an ulp of the motion over δ."""
        return self.precision - self.shift

    @property
    def columns(self) -> int:
        """Those of Φ and of σ together."""
        return self.field.dimension + len(self.data)


@dataclass(frozen=True, slots=True)
class StepDerivatives:
    """(Φ, σ) at τ: ``rows[i][column]`` in ulps of 2^-bits, within ``errors[column]`` ulps.

    moved: a bound of |Φ − V| as an operator, V the fundamental matrix along the step's own polynomial.
    """

    rows: list[list[mpz]]
    errors: list[float]
    moved: float


def step_derivatives(tangent: Tangent, step: Step, tau: Fraction) -> StepDerivatives | None:
    """(Φ, σ) of ``step`` at 0 < τ ≤ 1, a column at a time; None where the bounds of the theorem are not finite."""
    bounds = _Bounds.of(tangent, step)
    if bounds is None:
        return None
    centre = step.node.centre
    origin, columns, errors = _end(step.series, tau), [], []
    for j in range(tangent.field.dimension):
        series = taylor_series(
            tangent.field, _centred(step, _beside(centre, j, 1 << tangent.bits)), tangent.precision, tangent.certified
        )
        error = bounds.end_error(tangent.field, series)
        if series is None or error is None:
            return None
        columns.append(_end(series, tau))
        errors.append(error + bounds.own_error + bounds.of_start + _rounding(step, series, tau))
    for datum in tangent.data:
        series = taylor_series(datum.field, _centred(step, centre), tangent.precision, datum.certified)
        error, of_datum = bounds.end_error(datum.field, series), bounds.of_datum(datum)
        if series is None or error is None or not of_datum < inf:
            return None
        columns.append(_end(series, tau))
        errors.append(error + bounds.own_error + of_datum + _rounding(step, series, tau))
    rows = [
        [value - start for value in values] for start, values in zip(origin, zip(*columns, strict=True), strict=True)
    ]
    return StepDerivatives(rows, [error * _UP for error in errors], bounds.moved)


def _beside(centre: Sequence[int], component: int, by: int) -> Sequence[int]:
    """The centre with ``by`` ulps added to a component."""
    if isinstance(centre, Total):
        return centre.beside(component, by)
    return [value + by * (k == component) for k, value in enumerate(centre)]


def _centred(step: Step, centre: Sequence[int]) -> Node:
    """The node of ``step``, with another centre and the step's own length."""
    return replace(step.node, centre=centre)


def _end(series: StepSeries, tau: Fraction) -> Sequence[mpz]:
    """The polynomials at τ, in ulps."""
    return list(series.total) if tau == 1 else [horner(component, tau) for component in series.values]


def _rounding(step: Step, series: StepSeries, tau: Fraction) -> float:
    """Of the two sums of a quotient, in ulps: they are exact at τ = 1."""
    return 0.0 if tau == 1 else (step.order + series.order) / 2 + 1


@dataclass(frozen=True, slots=True)
class _Bounds:
    """The numbers of the theorem for one step; errors in ulps of the motion, which are those of the derivatives.

    reach: R.  mean: Σ |b_n|/(n + 1) + C.  widest: C of the motions of Φ.  away_ulps: |w0| in ulps of the derivatives.
    own_error: E_0.  of_start: M (δ/2 + |w0|).
    """

    tangent: Tangent
    length: float
    reach: float
    mean: float
    widest: float
    away_ulps: float
    own_error: float
    of_start: float
    moved: float

    @classmethod
    def of(cls, tangent: Tangent, step: Step) -> _Bounds | None:
        """None where the theorem does not apply."""
        field, precision = tangent.field, tangent.precision
        h, q, slope = 2.0**-step.node.halvings, float(field.q) * _UP, float(field.l) * _UP
        away = _ldexp(float(step.node.errors.sizes().max()), step.node.errors.exponent - precision)
        reach, mean = (float(step.series.sizes.sum()) + CAP) * _UP, _mean(step.series)
        growth = h * (2 * q * mean + slope) * _UP
        if not growth < _LARGEST_GROWTH:
            return None
        factor = exp(growth) * _UP
        # every motion within max(δ, |w0|) of the centre stays so near to the polynomial
        widest = (step.widest + _ldexp(1.0, -tangent.shift) * factor) * _UP
        if not widest < CAP:
            return None
        own = (defect_bound(step.series, precision, h * q, h * slope) + TINY) * factor * _UP
        first = (step.powers + step.summed_error) * (1 + 2 * h * q * widest * factor) * _UP
        second = 2 * h * q * factor * first**2 * _UP
        away_ulps = _ldexp(float(step.node.errors.sizes().max()), step.node.errors.exponent - tangent.shift)
        of_start = second * (_ldexp(0.5, tangent.bits - tangent.shift) + away_ulps) * _UP
        moved = second * (away + _ldexp(own, -precision)) * _UP
        if not of_start < inf:
            return None
        return cls(tangent, h, reach, mean, widest, away_ulps, own, of_start, moved)

    def end_error(self, field: Quadratic, series: StepSeries | None) -> float | None:
        """E of the polynomial that another motion of the step has, in ulps; None where it is too large."""
        if series is None:
            return None
        h, q, slope = self.length, float(field.q) * _UP, float(field.l) * _UP
        growth = h * (2 * q * _mean(series) + slope) * _UP
        if not growth < _LARGEST_GROWTH:
            return None
        precision = self.tangent.precision
        found = (defect_bound(series, precision, h * q, h * slope) + TINY) * exp(growth) * _UP
        return found if _ldexp(found, -precision) < CAP else None

    def of_datum(self, datum: Datum) -> float:
        """What (b) adds to the errors of the two ends, in ulps of the derivatives; infinite where it does not apply."""
        tangent, h, reach = self.tangent, self.length, self.reach
        delta = _ldexp(1.0, -tangent.shift)
        (gq, gl), (oq, ol) = datum.quotient, datum.off
        q, slope = float(tangent.field.q) * _UP + delta * gq, float(tangent.field.l) * _UP + delta * gl
        growth = h * (2 * q * self.mean + slope) * _UP
        if not growth < _LARGEST_GROWTH:
            return inf
        factor = exp(growth) * _UP
        size = factor * h * (gq * reach + gl) * reach * _UP
        turning = 2 * gq * reach + gl
        if not self.widest + delta * size < CAP:
            return inf
        by_datum = factor * h * (2 * turning * size + 2 * q * size**2) * _UP
        by_start = factor**2 * h * (turning + 2 * q * size) * _UP
        off = factor * h * (oq * reach + ol) * reach * _UP
        by_both = by_datum * _ldexp(0.5, tangent.bits - tangent.shift) + by_start * self.away_ulps
        return (by_both + off) * _UP


def _mean(series: StepSeries) -> float:
    """Σ |b_n|/(n + 1) + C, which bounds the integral of |y| over the step."""
    sizes = series.sizes
    return (float(sizes @ (1 / np.arange(1.0, len(sizes) + 1))) + CAP) * _UP


def _ldexp(value: float, exponent: int) -> float:
    """value 2^exponent, upwards where that is too small, and infinite where it is too large."""
    if exponent > 1000:
        return inf
    return float(np.ldexp(value, max(-1000, exponent))) + 2.0**-1000


def unit_columns(size: int, bits: int, columns: int) -> list[list[mpz]]:
    """The derivatives at time 0: the unit matrix, and 0 for the data, in ulps of 2^-bits."""
    return [[mpz((i == j) << bits) for j in range(columns)] for i in range(size)]


# The derivatives of a vector field with respect to the data that enter it, from the field itself.
#
# A field of :mod:`heavytop.top.equations` is evaluated over numbers a + b ε with ε² = 0: the coefficient of ε is its
# derivative, exactly.  No derivative is written down a second time.


DATA = ("I1", "I2", "I3", "n1", "n2", "n3")
"""The data that motions are differentiated with respect to: principal moments, and n = P r."""


Exact: TypeAlias = int | Fraction | mpq


@dataclass(frozen=True, slots=True)
class Dual:
    """value + slope ε with ε² = 0, over exact numbers."""

    value: Exact
    slope: Exact = 0

    @classmethod
    def of(cls, number: Dual | Exact) -> Dual:
        """A number, as one without slope."""
        return number if isinstance(number, Dual) else cls(number)

    def __add__(self, other: Dual | Exact) -> Dual:
        b = Dual.of(other)
        return Dual(self.value + b.value, self.slope + b.slope)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Dual | Exact) -> Dual:
        return self + -Dual.of(other)

    def __rsub__(self, other: Dual | Exact) -> Dual:
        return Dual.of(other) + -self

    def __mul__(self, other: Dual | Exact) -> Dual:
        b = Dual.of(other)
        return Dual(self.value * b.value, self.slope * b.value + self.value * b.slope)

    __rmul__ = __mul__

    def __truediv__(self, other: Dual | Exact) -> Dual:
        b = Dual.of(other)
        return Dual(self.value / b.value, (self.slope * b.value - self.value * b.slope) / (b.value * b.value))

    def __rtruediv__(self, other: Dual | Exact) -> Dual:
        return Dual.of(other) / self


def moved(p: Parameters, datum: int, by: Dual | Exact) -> Parameters:
    """The parameters with ``by`` added to one of :data:`DATA`."""
    numbers = [*p.inertia, *p.moment]
    numbers[datum] = numbers[datum] + by
    return p._replace(inertia=tuple(numbers[:3]), moment=tuple(numbers[3:]))


def quotient(system: System, p: Parameters, datum: int, by: Fraction, over: Fraction) -> Quadratic:
    """(f(θ + by) − f(θ))/over for one of :data:`DATA`."""
    varied = moved(p, datum, by)

    def field(y: tuple[mpq, ...]) -> list[mpq]:
        pairs = zip(system.field(varied, y), system.field(p, y), strict=True)
        return [(a - b) / over for a, b in pairs]

    return quadratic(field, 6)


def difference(system: System, p: Parameters, datum: int, by: Fraction, over: Fraction, factor: Fraction) -> Quadratic:
    """``factor`` ∂f/∂θ − (f(θ + by) − f(θ))/over: what a quotient lacks."""
    varied, slope = moved(p, datum, by), moved(p, datum, Dual(mpq(0), factor))

    def field(y: tuple[mpq, ...]) -> list[mpq]:
        rates = zip(system.field(varied, y), system.field(p, y), system.field(slope, y), strict=True)
        return [Dual.of(exact).slope - (a - b) / over for a, b, exact in rates]

    return quadratic(field, 6)


METHOD = "validated: variational equation on the Taylor enclosure"
_UP = 1 + 2.0**-32
Centre: TypeAlias = tuple[list[list[mpz]], Matrix, int]
"""(J, S) in ulps, bounds of its errors in ulps 2^exponent, and the exponent."""
_UNIT = 2.0**-53
_ATTEMPTS = 6
_GUARD = 18
"""Bits beyond those asked for: what bounds lose, and what a motion loses that loses little."""
_OF_DATA = 8
"""Bits that S has fewer than J: a second run costs more than they do."""
_COARSER = 4
"""δ is 2^4 times the root of an ulp: the ends of a step are known less well than its second derivative is small."""
_FEW = 4
_SMALLER = 4
_SHORTENED = 4

Balls = list[list[arb]]


@dataclass(frozen=True, slots=True)
class EnclosedDerivatives:
    """start: J, 6 × 6, [i][j] = ∂y_i(t)/∂y_j(0).  data: S, 6 × 6, by :data:`DATA`; None where not asked for."""

    start: Balls
    data: Balls | None


@dataclass(frozen=True, slots=True)
class _Columns:
    """(J, S) at a node: centre in ulps of 2^-bits, a row a component; errors {Q x: |x_i| ≤ radii_i 2^exponent}."""

    rows: list[list[mpz]]
    radii: Matrix
    exponent: int

    def sizes(self, bits: int) -> Matrix:
        """Upper bounds of the sum of |entries| of each column, as numbers; infinite where binary64 has none."""
        shift = max(0, bits - 64)
        sums = [int(sum(map(abs, column)) >> shift) + 1 for column in zip(*self.rows, strict=True)]
        return np.array(
            [np.ldexp(float(total) * _UP, shift - bits) if total.bit_length() < 1000 else np.inf for total in sums]
        )


def derivatives(known: Validated, times: Sequence[Fraction], bits: int, data: bool) -> list[EnclosedDerivatives]:
    """J, and S where asked for, at each of ``times`` in their order: ``bits`` right, relative above 1, absolute below.

    Raises OutOfReach where the digits cannot be proven, or would take longer than ``known.effort``.
    """
    found: dict[Fraction, EnclosedDerivatives] = {}
    for direction in (1, -1):
        spans = sorted({abs(time) for time in times if time * direction > 0})
        if spans:
            found |= _one_way(known, direction, spans, bits, data)
    if any(time == 0 for time in times):
        found[Fraction(0)] = _at_rest(bits, data)
    return [found[time] for time in times]


@whole_evaluation
def _at_rest(bits: int, data: bool) -> EnclosedDerivatives:
    with working_precision(bits + 8):
        start = [[arb(int(i == j)) for j in range(6)] for i in range(6)]
        return EnclosedDerivatives(start, [[arb(0)] * 6 for _ in range(6)] if data else None)


def _one_way(
    known: Validated, direction: int, spans: list[Fraction], bits: int, data: bool
) -> dict[Fraction, EnclosedDerivatives]:
    """Those at ``spans`` > 0 from time 0 on, in increasing order, in one direction."""
    motion = known.motion(direction)
    time = direction * spans[-1]
    forecast, steps = known.forecast(time, bits)
    loss, wanted = forecast, bits + _GUARD + _OF_DATA * data + int(min(forecast, _FEW * bits) / 4)
    for _ in range(_ATTEMPTS):
        columns = 7 + 6 * data
        planned = motion.precision(max(2 * wanted, wanted + loss), steps * columns)
        if not steps * columns * seconds_a_step(*planned) < known.effort:
            break
        tangent = _tangent(known, motion, *planned, data)
        found, lacking = {}, 0
        for span, values in _run(tangent, motion, spans):
            at = _in_units(known, motion, tangent, values) if values else None
            lacking = bits - (
                min(relative_bits(v) for m in (at.start, at.data or []) for r in m for v in r) if at else 0
            )
            if at is None or lacking > 0:
                break
            found[direction * span] = at
        else:
            return found
        wanted += lacking + _GUARD // 2
        loss += lacking
    raise OutOfReach(
        f"Derivatives at t = {decimal_text(time, 6)} to so many digits are out of reach of a validated integration.",
        "Ask for fewer digits, or for an earlier time.",
    )


def _tangent(known: Validated, motion: ScaledMotion, precision: int, in_words: bool, data: bool) -> Tangent:
    certified = motion.certified(precision) if in_words else None
    tangent = Tangent(motion.field, certified, precision, precision // 2 - _COARSER)
    if not data:
        return tangent
    return replace(tangent, data=tuple(_datum(known, motion, tangent, k) for k in range(len(DATA))))


def _datum(known: Validated, motion: ScaledMotion, tangent: Tangent, datum: int) -> Datum:
    """The field with one of the data larger by δ times :func:`unit_of`."""
    given, size = known.parameters, unit_of(known, datum)
    own = own_parameters(motion.scaled, given).mapped(mpq)
    delta = mpq(1, 2**tangent.shift)
    # the same change, in the units of the motion
    unit = size if datum < 3 else size * motion.scaled.sizes[3] / motion.scaled.rate**2
    varied = motion.with_parameters(moved(given, datum, size / 2**tangent.shift))
    system = motion.scaled.system
    direct = quotient(system, own, datum, delta * unit, delta)
    off = difference(system, own, datum, delta * unit, delta, unit)
    in_words = tangent.certified is not None and varied.in_words
    certified = varied.certified(tangent.precision) if in_words else None
    return Datum(varied.field, certified, _bounds(direct, 0), _bounds(off, tangent.bits))


def _bounds(field: Quadratic, bits: int) -> tuple[float, float]:
    """Upper bounds of 2^bits q and 2^bits l."""
    return float(field.q * 2**bits) * _UP + TINY, float(field.l * 2**bits) * _UP + TINY


def unit_of(known: Validated, datum: int) -> Fraction:
    """A power of two, about a sixteenth of what is varied: of I_i itself, or of the largest |n_i|.

    By that much more the ends of a step are in error than its second derivative with respect to a datum is bounded.
    """
    given = known.parameters
    size = given.inertia[datum] if datum < 3 else max(map(abs, given.moment))
    if size == 0:  # no weight: that which would turn the body as fast as it turns
        size = max(*(i * max(1, w * w) for i, w in zip(given.inertia, known.start.omega, strict=True)))
    value = Fraction(size)
    return Fraction(2) ** (value.numerator.bit_length() - value.denominator.bit_length() - _SMALLER)


def _run(tangent: Tangent, motion: ScaledMotion, spans: list[Fraction]) -> Iterator[tuple[Fraction, Centre | None]]:
    """(span, centre and radii there) for each; None in place of them, and an end, where the errors are too large."""
    node = start_node(motion.field, motion.scaled.state, tangent.precision)
    size = motion.field.dimension
    columns = _Columns(unit_columns(size, tangent.bits, tangent.columns), np.zeros((size, tangent.columns)), 0)
    rest = [(span * motion.scaled.rate, span) for span in spans]
    while rest:
        found, own = _step(tangent, node)
        while found is not None and rest and node.time + found.length >= rest[0][0]:
            scaled, span = rest.pop(0)
            at = step_derivatives(tangent, found, (scaled - node.time) / found.length)
            yield span, None if at is None else _at(tangent, found, at, columns, (scaled - node.time) / found.length)
        if found is None or own is None:
            yield from [(span, None) for _, span in rest[:1]]
            return
        if rest:
            transfer = found.transfer()
            columns = _carried(tangent, found, own, columns, transfer)
            node = found.end(transfer)
            if not np.isfinite(columns.radii).all():
                yield rest[0][1], None
                return


def _step(tangent: Tangent, node: Node) -> tuple[Step, StepDerivatives] | tuple[None, None]:
    """The step from a node with its derivatives; shorter where they need it."""
    for shorter in range(_SHORTENED):
        trial = replace(node, halvings=node.halvings + shorter)
        found = step(tangent.field, trial, tangent.precision, tangent.certified)
        if found is None:
            return None, None
        own = step_derivatives(tangent, found, Fraction(1))
        if own is not None:
            return found, own
    return None, None


def _product(tangent: Tangent, own: StepDerivatives, rows: list[list[mpz]]) -> list[list[mpz]]:
    """Φ (J, S) + (0, σ), each entry within half an ulp of that of the centres."""
    size, bits = len(rows), tangent.bits
    half = mpz(1) << (bits - 1)
    columns = list(zip(*rows, strict=True))
    found = []
    for row in own.rows:
        phi = row[:size]
        line = [(sum(map(_times, phi, column), half)) >> bits for column in columns]
        for place, value in enumerate(row[size:], size):
            line[place] += value
        found.append(line)
    return found


def _times(a: mpz, b: mpz) -> mpz:
    return mpz(a) * b


def _local(tangent: Tangent, own: StepDerivatives, columns: _Columns) -> Matrix:
    """Bounds of the errors that a step itself makes in each column, in ulps 2^exponent."""
    size = len(columns.rows)
    of_phi = max(own.errors[:size])
    found = of_phi * columns.sizes(tangent.bits) + 1.0
    found[size:] += own.errors[size:]
    return np.asarray(np.ldexp(found * _UP, -columns.exponent) + TINY)


def _carried(
    tangent: Tangent, found: Step, own: StepDerivatives, columns: _Columns, transfer: tuple[Matrix, Matrix, float]
) -> _Columns:
    """(J, S) at the end of a step, in its new frame."""
    frame, turned, slack = transfer
    inverse = (norm(frame.T) + slack) * _UP
    slack = (slack + inverse * own.moved * norm(found.node.errors.frame)) * _UP
    radii = np.abs(turned) @ columns.radii + slack * columns.radii.max(axis=0)
    reach = (np.abs(frame.T).sum(axis=1) + slack) * _UP
    radii = (radii + np.outer(reach, _local(tangent, own, columns))) * _UP
    exponent = columns.exponent
    if radii.max() > 2.0**400:
        radii, exponent = np.ldexp(radii, -400), exponent + 400
    return _Columns(_product(tangent, own, columns.rows), radii, exponent)


def _at(tangent: Tangent, found: Step, own: StepDerivatives, columns: _Columns, tau: Fraction) -> Centre:
    """(J, S) within a step: the centre, and bounds of the errors in ulps 2^exponent."""
    variation = sum(float(tau) ** n * matrix for n, matrix in enumerate(found.variation))
    frame = found.node.errors.frame
    spread = (found.summed_error + 64 * _UNIT * found.powers + own.moved) * norm(frame) * _UP
    radii = np.abs(variation @ frame) @ columns.radii + spread * columns.radii.max(axis=0)
    return (
        _product(tangent, own, columns.rows),
        np.asarray((radii + _local(tangent, own, columns)) * _UP),
        columns.exponent,
    )


@whole_evaluation
def _in_units(known: Validated, motion: ScaledMotion, tangent: Tangent, values: Centre) -> EnclosedDerivatives:
    """As balls, in the units given."""
    rows, radii, exponent = values
    sizes = motion.scaled.sizes
    scales = [*sizes, *(unit_of(known, k) for k in range(tangent.columns - len(rows)))]
    limits = [[float(r) for r in row] for row in radii]
    longest = max(max(abs(v) for v in row).bit_length() for row in rows)
    with working_precision(longest + 64):
        unit, scale = arb(2) ** -tangent.bits, arb(2) ** exponent
        table = [
            [
                arb(fmpz(int(value)) * unit, (arb(limit) * scale).upper() * unit) * ball(size / of)
                for value, limit, of in zip(line, bounds, scales, strict=True)
            ]
            for line, bounds, size in zip(rows, limits, sizes, strict=True)
        ]
    start, data = [line[: len(rows)] for line in table], [line[len(rows) :] for line in table]
    return EnclosedDerivatives(start, data if tangent.data else None)
