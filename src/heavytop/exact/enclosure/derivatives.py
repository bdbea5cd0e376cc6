"""Derivatives of a motion with respect to its start and its data, enclosed.

J(t) = ∂(Ω, γ)(t)/∂(Ω0, γ0) and S(t) = ∂(Ω, γ)(t)/∂(I1, I2, I3, n1, n2, n3), n = P r: plain partial derivatives of the
field as it stands.  γ0 counts as three independent variables, and the rotor (λ, or k) is held.

Each step of the enclosure of the motion gives its own Φ and σ, and

    J(t + h) = Φ J(t),     S(t + h) = Φ S(t) + σ.

The centres are multiplied exactly and rounded once.  The errors of each column of (J, S) are kept in the frames that
carry the errors of the motion, {Q x: |x_i| ≤ r_i}: with Q'^-1 Φ Q within η of T = Q'^T V̂ Q,

    r' = |T| r + η max r + |Q'^-1| e,     e = (|Φ − Φ̂| |J|_1 + |σ − σ̂| + ½ ulp),

so a column of errors is carried by Lohner's method as one more set of errors of the motion.

Φ and σ need fewer bits than the motion: their errors at t_n are multiplied by ∂y(t)/∂y(t_n) and J(t_n), seldom by much
more than J(t), to which digits are relative, while W, also an error of Φ, has grown by ∂y(t_n)/∂y(0) before.  They are
computed beside each step of the motion, along a polynomial in their own bits
(:func:`heavytop.exact.enclosure.step.in_other_bits`).  Both precisions are chosen so as to leave the
requested digits, and raised by the missing bits, up to six times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import exp, inf, lcm
from typing import Any, TypeAlias

import numpy as np
from flint import arb, fmpq, fmpq_series, fmpz, fmpz_mat
from gmpy2 import mpq, mpz

from heavytop.errors import Contradiction, OutOfReach
from heavytop.exact.enclosure.run import (
    MOST_EFFORT,
    EnclosureRun,
    ScaledMotion,
    Validated,
    larger_effort,
    own_parameters,
    seconds_a_step,
)
from heavytop.exact.enclosure.step import (
    Matrix,
    Node,
    Quadratic,
    Step,
    StepSeries,
    Whole,
    falling,
    in_other_bits,
    lacking,
    norm,
    quadratic,
    start_node,
)
from heavytop.exact.flint.balls import (
    ball,
    coefficient,
    rational,
    relative_bits,
    series_length,
    whole_evaluation,
    working_precision,
)
from heavytop.multiword.codegen.recurrence import Coefficients, coefficients_of
from heavytop.multiword.codegen.recurrence import rates as lane_rates
from heavytop.multiword.fixed_point.arithmetic import Grid
from heavytop.multiword.fixed_point.certified_series import CertifiedSeries, WordSeries
from heavytop.multiword.fixed_point.first_variation import CertifiedColumns, WordColumns
from heavytop.multiword.fixed_point.fixed_point_run import excess
from heavytop.multiword.integers.integer_series import QuadraticComponent, coefficients, horner
from heavytop.precision import six_digits
from heavytop.top.equations import Parameters, System

# One proven step of the derivatives of the state at its end with respect to the state at its beginning and to the data.
#
# A step of :mod:`heavytop.exact.enclosure.step` goes over 0 ≤ τ ≤ 1 with y' = h f(y), f = Q(y, y) + L y.  Φ is its
# fundamental matrix and σ the derivative with respect to a datum θ that enters f, along the motion itself,
#
#     Φ' = h Df(y) Φ, Φ(0) = 1,     σ' = h Df(y) σ + h G(y), σ(0) = 0,     G = ∂f/∂θ, again of degree two.
#
# Their columns are computed along the polynomial p = Σ b_n τⁿ of the step, as polynomials v = Σ v_n τⁿ of its order N
# or, where the remainder is too large, of a larger one: in words
# (:mod:`heavytop.multiword.fixed_point.first_variation`) or in exact integers, where the columns and the motion are one
# field of degree two.  The defect of v is E = v' − h Df(p) v − h G(p).  Below N it is the rounding error ρ_n; from N on
# it is known.  With β_n = |b_n|, ν_n = |v_n| and |G(y)| ≤ q_G |y|² + l_G |y|, the integral of |E| is at most
#
#     Δ = Σ_{n < N} ρ_n + Σ_{n ≥ N} h (2q Σ_{j+k=n} β_j ν_k + l ν_n + q_G Σ_{j+k=n} β_j β_k + l_G β_n)/(n + 1).      (a)
#
# *Theorem.*  A motion y of the step stays within W of p (integers have further b_n until the columns are small too: W
# is larger by the sum of those), so that R = Σ β_n + W bounds both, and Λ = h (2q (Σ β_n/(n + 1) + W) + l) the integral
# of |h Df(y)|.  For the column u along y that v approximates,
#
#     |u − v| ≤ e^Λ (Δ + h W (2q Σ ν_n + 2 q_G R + l_G)),                                                           (b)
#
# without q_G and l_G for a column of Φ.  Proof: (u − v)' = h Df(y) (u − v) + h (Df(y) − Df(p)) v + h (G(y) − G(p)) − E;
# Df and G are of degree one and two, |Df(y) − Df(p)| ≤ 2q W and |G(y) − G(p)| ≤ (2 q_G R + l_G) W; Gronwall.  The same
# without E, for all columns at once: |Φ − V| ≤ e^Λ 2 h q W (Σ |V̂_n| + |V − V̂|), V the fundamental matrix along p.


_LARGEST_GROWTH = 16.0


@dataclass(frozen=True, slots=True)
class Datum:
    """A datum θ of the field.  field: G, for a unit of θ in which it is near 1; unit: that unit in the input units."""

    field: Quadratic
    unit: Fraction


@dataclass(frozen=True, slots=True)
class Together:
    """The motion and its columns as one field of degree two."""

    pairs: tuple[tuple[int, int], ...]
    rows: tuple[QuadraticComponent, ...]

    @classmethod
    def of(cls, field: Quadratic, data: Sequence[Quadratic]) -> Together:
        """y, then a column of Φ for each component of y, then one of σ for each of the data."""
        size, indices = field.dimension, {pair: k for k, pair in enumerate(field.pairs)}
        rows = [*field.rows]
        for number, slope in enumerate([None] * size + [*data], 1):
            for i, row in enumerate(field.rows):
                common = lcm(row.denominator, slope.rows[i].denominator if slope else 1)
                factor, offset = common // row.denominator, size * number
                terms = [(c * factor, *field.pairs[pair]) for c, pair in row.products]
                products = [(c, at) for c, j, k in terms for at in ((j, offset + k), (k, offset + j))]
                linear = [(c * factor, offset + j) for c, j in row.linear]
                if slope:
                    factor = common // slope.rows[i].denominator
                    products += [(c * factor, slope.pairs[pair]) for c, pair in slope.rows[i].products]
                    linear += [(c * factor, j) for c, j in slope.rows[i].linear]
                numbered = tuple((c, indices.setdefault(at, len(indices))) for c, at in products)
                rows.append(QuadraticComponent(common, numbered, tuple(linear)))
        return cls(tuple(indices), tuple(rows))


@dataclass(frozen=True, slots=True)
class Tangent:
    """The data that derivatives are computed with, in ulps of 2^-precision, along the motion of ``field``.

    certified, columns: Taylor coefficients of the motion, and of its derivatives, in words; None in integers.
    data: those of :data:`DATA`, or none.
    """

    field: Quadratic
    precision: int
    together: Together
    certified: CertifiedSeries | None
    columns: CertifiedColumns | None
    data: tuple[Datum, ...] = ()

    @property
    def width(self) -> int:
        """The columns of Φ and of σ together."""
        return self.field.dimension + len(self.data)


@dataclass(frozen=True)
class _WholeColumns:
    """Columns in exact integers, each rounded once.

    motion: the polynomial that they were computed along, of their own order.  beyond: Σ |b_n| in ulps of the orders
    that it has more than the step.
    """

    values: list[list[list[int]]]
    precision: int
    motion: Whole
    beyond: float

    @property
    def total(self) -> list[list[int]]:
        return [[*Whole(column, self.precision).total] for column in self.values]

    @property
    def sizes(self) -> Matrix:
        return np.array([Whole(column, self.precision).sizes for column in self.values])

    @property
    def rounding(self) -> tuple[float, float]:
        half = (len(self.values[0][0]) - 1) / 2
        return half, half

    def scaled(self, rate: int) -> Matrix:
        return np.array([Whole(column, self.precision).scaled(rate) for column in self.values])


Columns: TypeAlias = _WholeColumns | WordColumns


@dataclass(frozen=True, slots=True)
class StepDerivatives:
    """(Φ, σ) at τ: ``rows[i][column]`` in ulps, within ``errors[column]`` ulps.

    moved: a bound of |Φ − V| as an operator, V the fundamental matrix along the step's own polynomial.
    """

    rows: list[list[mpz]]
    errors: list[float]
    moved: float


def step_derivatives(tangent: Tangent, step: Step, tau: Fraction) -> StepDerivatives | None:
    """(Φ, σ) of ``step`` at 0 < τ ≤ 1; None where there are none, or the bounds of the theorem are not finite."""
    result = _columns(tangent, step, tau != 1)
    if result is None:
        return None
    errors = _errors(tangent, step, result)
    if errors is None:
        return None
    of_phi, of_sigma, moved = errors
    rounding, ends = 0.0, result.total
    if result.values is not None:
        rounding = len(result.values[0][0]) / 2 + 1
        ends = [[horner(component, tau) for component in column] for column in result.values]
    size = tangent.field.dimension
    bounds = [(of_phi if k < size else of_sigma) + rounding for k in range(tangent.width)]
    return StepDerivatives([list(row) for row in zip(*ends, strict=True)], bounds, moved)


def _columns(tangent: Tangent, step: Step, values: bool) -> Columns | None:
    """The columns of a step; values: with all their coefficients."""
    if isinstance(step.series, WordSeries):
        words = tangent.columns
        return None if words is None else words.columns(step.node.centre, step.node.halvings, values)
    size, unit_ulps = tangent.field.dimension, 1 << tangent.precision
    unit = [unit_ulps * (i == j) for j in range(tangent.width) for i in range(size)]
    start = [*map(int, step.node.centre), *unit]
    table = coefficients(tangent.together, start, tangent.precision, step.node.halvings)
    if table is None:
        return None
    motion, after = table[:size], table[size:]
    beyond = sum(max(map(abs, together)) for together in [*zip(*motion, strict=True)][step.order + 1 :])
    columns = [after[k : k + size] for k in range(0, len(after), size)]
    return _WholeColumns(columns, tangent.precision, Whole(motion, tangent.precision), float(beyond) * _UP)


def _along(step: Step, columns: Columns) -> tuple[StepSeries, float]:
    """The polynomial along which columns were computed, and its distance from that of the step, in ulps."""
    return (columns.motion, columns.beyond) if isinstance(columns, _WholeColumns) else (step.series, 0.0)


def _errors(tangent: Tangent, step: Step, columns: Columns) -> tuple[float, float, float] | None:
    """(b) for Φ and for σ in ulps, and the bound of |Φ − V|; None where they are not finite."""
    h, q, slope = 2.0**-step.node.halvings, float(tangent.field.q) * _UP, float(tangent.field.l) * _UP
    series, beyond = _along(step, columns)
    beta, size = series.sizes, tangent.field.dimension
    wide = (step.widest + _ldexp(beyond, -tangent.precision)) * _UP
    mean = (float(beta @ (1 / np.arange(1.0, len(beta) + 1))) + wide) * _UP
    growth = h * (2 * q * mean + slope) * _UP
    if not growth < _LARGEST_GROWTH:
        return None
    factor, reach = exp(growth) * _UP, (float(beta.sum()) + wide) * _UP
    widest = (_ldexp(step.widest_ulps, step.node.errors.exponent) + beyond) * _UP
    sums = np.add.reduce(columns.sizes, 1)
    lag = h * widest * 2 * q * float(sums[:size].max()) * _UP
    of_phi = factor * (_defect(tangent, step, columns, h) + lag) * _UP
    moved = factor * 2 * h * q * _ldexp(widest, -tangent.precision) * (step.powers + step.summed_error) * _UP
    of_sigma = 0.0
    if tangent.data:
        slopes = [(datum.field.q, datum.field.l) for datum in tangent.data]
        gq, gl = (max(float(value) for value in bounds) * _UP for bounds in zip(*slopes, strict=True))
        lag = h * widest * (2 * q * float(sums[size:].max()) + 2 * gq * reach + gl) * _UP
        of_sigma = factor * (_defect(tangent, step, columns, h, (gq, gl)) + lag) * _UP
    bounds = (of_phi * _UP, of_sigma * _UP, moved * _UP)
    return bounds if all(value < inf for value in bounds) else None


def _defect(
    tangent: Tangent, step: Step, columns: Columns, h: float, slopes: tuple[float, float] | None = None
) -> float:
    """Δ of (a) in ulps, of any column of Φ, or of any of σ where ``slopes`` are (q_G, l_G).

    β_n and ν_n are multiplied by 2^(rate n), so that binary64 holds them at any precision.
    """
    size, order, precision = tangent.field.dimension, columns.sizes.shape[1] - 1, tangent.precision
    rate = precision // order
    beta, sizes = _along(step, columns)[0].scaled(rate), columns.scaled(rate)
    beta = np.concatenate([beta, np.zeros(order + 1 - len(beta))])
    nu = (sizes[:size] if slopes is None else sizes[size:]).max(axis=0)
    rates = 2 * float(tangent.field.q) * np.convolve(beta, nu)[order:]
    last = float(tangent.field.l) * float(nu[-1])
    if slopes is not None:
        rates = rates + slopes[0] * np.convolve(beta, beta)[order:]
        last += slopes[1] * float(beta[-1])
    # n ≥ N in the denominators
    beyond = h * (float(rates @ falling(rate, order)) + last) / (order + 1) * _UP
    return (columns.rounding[slopes is not None] + _ldexp(beyond, precision - rate * order)) * _UP


def _ldexp(value: float, exponent: int) -> float:
    """value 2^exponent, rounded up where that is too small, and infinite where it is too large."""
    if exponent > 1000:
        return inf
    return float(np.ldexp(value, max(-1000, exponent))) + 2.0**-1000


# The derivatives of a vector field with respect to its data, computed from the field.
#
# A field of :mod:`heavytop.top.equations` is evaluated over power series a + b ε + ...: the coefficient of ε is its
# exact derivative.


DATA = ("I1", "I2", "I3", "n1", "n2", "n3")
"""The data that motions are differentiated with respect to: principal moments, and n = P r."""


def moved(p: Parameters, datum: int, by: Any) -> Parameters:
    """The parameters with ``by`` added to one of :data:`DATA`."""
    numbers = [*p.inertia, *p.moment]
    numbers[datum] = numbers[datum] + by
    return p._replace(inertia=tuple(numbers[:3]), moment=tuple(numbers[3:]))


def slope(system: System, p: Parameters, datum: int, unit: Fraction) -> Callable[[Sequence[mpq]], list[mpq]]:
    """``unit`` ∂f/∂θ for one of :data:`DATA`, within :class:`series_length` of 2."""
    varied = moved(p.mapped(rational), datum, fmpq_series([0, rational(unit)]))

    def rates(y: Sequence[mpq]) -> list[mpq]:
        state = [fmpq(int(value.numerator), int(value.denominator)) for value in y]
        slopes = [coefficient(fmpq_series(rate), 1) for rate in system.field(varied, state)]
        return [mpq(int(slope.p), int(slope.q)) for slope in slopes]

    return rates


METHOD = "validated: variational equation on the Taylor enclosure"
_UP = 1 + 2.0**-32
Centre: TypeAlias = tuple[list[list[mpz]], Matrix, int]
"""(J, S) in ulps, bounds of its errors in ulps 2^exponent, the exponent."""
_UNIT = 2.0**-53
_ATTEMPTS = 6
_GUARD = 18
"""Bits beyond the requested ones, for the losses of bounds and of short motions."""
_OF_COLUMNS, _MOST_OF_COLUMNS = 13, 60
"""Bits that Φ and σ lose where the motion loses few; and the loss of a motion beyond which they lose no more."""
_OF_DATA = 12
"""Spare bits for S, which has fewer than J: they cost less than a second run."""
_FEW = 4
_SMALLER = 2
_SHORTENED = 4
_TINY = 2.0**-190
_seen_right: set[tuple[Grid, str, bool]] = set()

Balls = list[list[arb]]


@dataclass(frozen=True, slots=True)
class EnclosedDerivatives:
    """Derivatives of a state.  start: J, 6 × 6, [i][j] = ∂y_i(t)/∂y_j(0).  data: S, 6 × 6, by :data:`DATA`, or None."""

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
    """J, and S with ``data``, at each of ``times``, to ``bits`` bits: relative above 1, absolute below.

    Raises OutOfReach where the digits cannot be proven, or would take longer than ``known.effort``.
    """
    enclosed: dict[Fraction, EnclosedDerivatives] = {}
    for direction in (1, -1):
        spans = sorted({abs(time) for time in times if time * direction > 0})
        if spans:
            enclosed |= _one_way(known, direction, spans, bits, data)
    if any(time == 0 for time in times):
        enclosed[Fraction(0)] = _at_rest(bits, data)
    return [enclosed[time] for time in times]


@whole_evaluation
def _at_rest(bits: int, data: bool) -> EnclosedDerivatives:
    with working_precision(bits + 8):
        start = [[arb(int(i == j)) for j in range(6)] for i in range(6)]
        return EnclosedDerivatives(start, [[arb(0)] * 6 for _ in range(6)] if data else None)


def _one_way(
    known: Validated, direction: int, spans: list[Fraction], bits: int, data: bool
) -> dict[Fraction, EnclosedDerivatives]:
    """The derivatives at ``spans`` > 0, in increasing order, in one direction."""
    motion = known.motion(direction)
    time = direction * spans[-1]
    loss, steps = known.forecast(time, bits, most=MOST_EFFORT)
    bits_of_motion = bits + loss + _GUARD + _OF_DATA * data + int(min(loss, _FEW * bits) / 4)
    bits_of_columns = bits + _OF_COLUMNS + 0.9 * min(loss, _MOST_OF_COLUMNS)
    for _ in range(_ATTEMPTS):
        columns = steps * (7 + len(DATA) * data)
        of_columns = motion.precision(bits_of_columns, columns)
        planned = max(motion.precision(bits_of_motion, steps), of_columns)
        seconds = motion.seconds(planned, loss, steps) + columns * seconds_a_step(*of_columns)
        if not seconds < known.effort:
            break
        tangent = _tangent(known, motion, *of_columns, data)
        start = start_node(motion.field, motion.scaled.state, planned[0])
        run = EnclosureRun(motion, planned[0], (start,), motion.certified(planned[0]) if planned[1] else None)
        enclosed, lacking = {}, 0
        for span, values in _run(tangent, run, spans):
            at = _in_units(motion, tangent, values) if values else None
            lacking = bits - (
                min(relative_bits(v) for m in (at.start, at.data or []) for r in m for v in r) if at else 0
            )
            if at is None or lacking > 0:
                break
            enclosed[direction * span] = at
        else:
            return enclosed
        bits_of_motion, bits_of_columns = (before[0] + lacking + _GUARD // 2 for before in (planned, of_columns))
    within, more = larger_effort(known.effort, seconds)
    raise OutOfReach(
        f"Validated integration cannot prove so many digits of the derivatives at t = {six_digits(time)}{within}.",
        f"Request fewer digits, or an earlier time{more}.",
    )


def _tangent(known: Validated, motion: ScaledMotion, precision: int, in_words: bool, with_data: bool) -> Tangent:
    data = _data(known, motion) if with_data else []
    data_of = tuple(datum for datum, _ in data)
    together = Together.of(motion.field, [datum.field for datum in data_of])
    lanes = [lanes_of_datum for _, lanes_of_datum in data if lanes_of_datum is not None]
    certified = columns = None
    grid = motion.grid(precision) if in_words else None
    if grid is not None and not grid.relative and len(lanes) == len(data):
        certified = motion.certified(precision)
        columns = CertifiedColumns(certified, lanes) if certified else None
    tangent = Tangent(motion.field, precision, together, certified, columns, data_of)
    _require_right(tangent, motion)
    return tangent


@whole_evaluation
def _data(known: Validated, motion: ScaledMotion) -> list[tuple[Datum, Coefficients | None]]:
    with series_length(2):
        return [_datum(known, motion, k) for k in range(len(DATA))]


def _datum(known: Validated, motion: ScaledMotion, datum: int) -> tuple[Datum, Coefficients | None]:
    """A datum, and its G over the lanes of the motion; None where they do not compute it."""
    scaled = motion.scaled
    parameters, sign = own_parameters(scaled, known.parameters).mapped(Fraction), 1 if motion.forwards else -1
    largest = coefficients_of(scaled.system, slope(scaled.system, parameters, datum, Fraction(1)), mpq(0)).largest
    unit = Fraction(2) ** (excess(scaled) - _SMALLER)
    if largest:
        unit /= Fraction(2) ** (largest.numerator.bit_length() - largest.denominator.bit_length() + 1)
    rates = slope(scaled.system, parameters, datum, unit)
    lanes = coefficients_of(scaled.system, rates, mpq(0))
    field = quadratic(lambda y: [sign * rate for rate in rates(y)], 6)
    by_lanes = quadratic(lambda y: [sign * rate for rate in lane_rates(scaled.system, lanes, y)], 6)
    datum_vector = unit if datum < 3 else unit * scaled.rate**2 / scaled.sizes[3]
    return Datum(field, datum_vector), lanes if (field.pairs, field.rows) == (by_lanes.pairs, by_lanes.rows) else None


def _require_right(tangent: Tangent, motion: ScaledMotion) -> None:
    """Compare the first columns of machine code in this process with exact integers."""
    certified, columns = tangent.certified, tangent.columns
    if certified is None or columns is None:
        return
    key = (certified.grid, motion.scaled.system.name, bool(tangent.data))
    if key in _seen_right:
        return
    centre = [round(value * 2**tangent.precision) for value in motion.scaled.state]
    for halvings in range(2, 64):
        along, computed = certified.series(centre, halvings), columns.columns(centre, halvings, values=True)
        if along is None or computed is None or computed.values is None:
            continue
        after = [0] * (computed.sizes.shape[1] - 1 - along.order)
        values = [
            *(component + after for component in along.values),
            *(v for column in computed.values for v in column),
        ]
        together = Whole(values, tangent.precision)
        lack = sum(lacking(tangent.together, together, tangent.precision, halvings)[: along.order])
        if lack > Fraction(max(along.rounding, *computed.rounding)):
            raise Contradiction(
                f"Machine code in {tangent.precision} bits gives derivatives whose error exceeds its proven bound.",
                "It is damaged: run again. If the error persists, this machine or LLVM is faulty.",
            )
        _seen_right.add(key)
        return


def _run(tangent: Tangent, run: EnclosureRun, spans: list[Fraction]) -> Iterator[tuple[Fraction, Centre | None]]:
    """(span, centre and radii) for each span; it ends with (span, None) where the errors are too large."""
    node, size, rate = run.nodes[0], tangent.field.dimension, run.motion.scaled.rate
    unit = [[mpz((i == j) << tangent.precision) for j in range(tangent.width)] for i in range(size)]
    columns = _Columns(unit, np.zeros((size, tangent.width)), 0)
    remaining = list(spans)
    while remaining:
        made = _step(tangent, run, node)
        if made is None:
            yield remaining[0], None
            return
        motion_step, along, of_step = made
        while remaining and node.time + motion_step.length >= remaining[0] * rate:
            tau = (remaining[0] * rate - node.time) / motion_step.length
            at = of_step if tau == 1 else step_derivatives(tangent, along, tau)
            yield remaining.pop(0), None if at is None else _at(tangent, motion_step, at, columns, tau)
        if remaining:
            transfer = motion_step.transfer()
            columns = _carried(tangent, motion_step, of_step, columns, transfer)
            node = run.after(motion_step, transfer)
            if not np.isfinite(columns.radii).all():
                yield remaining[0], None
                return


def _step(tangent: Tangent, run: EnclosureRun, node: Node) -> tuple[Step, Step, StepDerivatives] | None:
    """A step, the same step in the bits of the derivatives, and these; in integers or shorter where words fail."""
    for certified in (tangent.certified, None) if tangent.certified else (None,):
        for shorter in range(_SHORTENED):
            motion_step = run.step(replace(node, halvings=node.halvings + shorter))
            if motion_step is None:
                return None
            along = in_other_bits(tangent.field, motion_step, tangent.precision, certified)
            of_step = None if along is None else step_derivatives(tangent, along, Fraction(1))
            if along is not None and of_step is not None:
                return motion_step, along, of_step
    return None


def _product(tangent: Tangent, own: StepDerivatives, rows: list[list[mpz]]) -> list[list[mpz]]:
    """Φ (J, S) + (0, σ) of the centres, each entry within half an ulp."""
    size, width, bits = len(rows), tangent.width, tangent.precision
    phi = fmpz_mat(size, size, [int(value) for row in own.rows for value in row[:size]])
    product = (phi * fmpz_mat(size, width, [int(value) for row in rows for value in row])).entries()
    half = fmpz(1) << (bits - 1)
    lines = [[mpz(int((value + half) >> bits)) for value in product[width * i : width * (i + 1)]] for i in range(size)]
    for line, row in zip(lines, own.rows, strict=True):
        line[size:] = [value + int(of) for value, of in zip(line[size:], row[size:], strict=True)]
    return lines


def _local(tangent: Tangent, own: StepDerivatives, columns: _Columns) -> Matrix:
    """Bounds of the errors that a step adds to each column, in ulps 2^exponent."""
    size = len(columns.rows)
    of_phi = max(own.errors[:size])
    sizes = of_phi * columns.sizes(tangent.precision) + 1.0
    sizes[size:] += own.errors[size:]
    return np.asarray(np.ldexp(sizes * _UP, -columns.exponent) + _TINY)


def _carried(
    tangent: Tangent, taken: Step, own: StepDerivatives, columns: _Columns, transfer: tuple[Matrix, Matrix, float]
) -> _Columns:
    """(J, S) at the end of a step, in its new frame."""
    frame, transformed, slack = transfer
    inverse = (norm(frame.T) + slack) * _UP
    slack = (slack + inverse * own.moved * norm(taken.node.errors.frame)) * _UP
    radii = np.abs(transformed) @ columns.radii + slack * columns.radii.max(axis=0)
    reach = (np.abs(frame.T).sum(axis=1) + slack) * _UP
    radii = (radii + np.outer(reach, _local(tangent, own, columns))) * _UP
    exponent = columns.exponent
    if radii.max() > 2.0**400:
        radii, exponent = np.ldexp(radii, -400), exponent + 400
    return _Columns(_product(tangent, own, columns.rows), radii, exponent)


def _at(tangent: Tangent, taken: Step, own: StepDerivatives, columns: _Columns, tau: Fraction) -> Centre:
    """(J, S) within a step: the centre, and bounds of the errors in ulps 2^exponent."""
    variation = sum(float(tau) ** n * matrix for n, matrix in enumerate(taken.variation))
    frame = taken.node.errors.frame
    spread = (taken.summed_error + 64 * _UNIT * taken.powers + own.moved) * norm(frame) * _UP
    radii = np.abs(variation @ frame) @ columns.radii + spread * columns.radii.max(axis=0)
    return (
        _product(tangent, own, columns.rows),
        np.asarray((radii + _local(tangent, own, columns)) * _UP),
        columns.exponent,
    )


@whole_evaluation
def _in_units(motion: ScaledMotion, tangent: Tangent, values: Centre) -> EnclosedDerivatives:
    """The derivatives as balls, in the input units."""
    rows, radii, exponent = values
    sizes = motion.scaled.sizes
    scales = [*sizes, *(datum.unit for datum in tangent.data)]
    limits = [[float(r) for r in row] for row in radii]
    longest = max(max(abs(int(v)) for v in row).bit_length() for row in rows)
    with working_precision(longest + 64):
        unit, scale = arb(2) ** -tangent.precision, arb(2) ** exponent
        table = [
            [
                arb(fmpz(int(value)) * unit, (arb(limit) * scale).upper() * unit) * ball(size / of)
                for value, limit, of in zip(line, bounds, scales, strict=True)
            ]
            for line, bounds, size in zip(rows, limits, sizes, strict=True)
        ]
        start, data = [line[: len(rows)] for line in table], [line[len(rows) :] for line in table]
        return EnclosedDerivatives(start, data if tangent.data else None)
