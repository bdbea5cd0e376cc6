"""One proven step of the derivatives: what the state at its end is to the state, and to the data, it began with.

A step of :mod:`heavytop.exact.enclosure` goes over 0 ≤ τ ≤ 1 with y' = h f(y), f = Q(y, y) + L y.  φ is its flow from
the centre c, Φ = Dφ its fundamental matrix, and σ the derivative with respect to a datum θ that enters f,

    Φ' = h Df(y) Φ, Φ(0) = 1,     σ' = h Df(y) σ + h G(y), σ(0) = 0,     G = ∂f/∂θ, again of degree two.

*Difference quotients over one step.*  Column j of Φ is (φ(c + δ e_j) − φ(c))/δ, both ends from Taylor polynomials in
2^-precision, δ = 2^-shift.  Over a single step a second derivative is small and proven so, whatever the motion does
later: nothing of the quotient's error grows with time but by Φ itself.  So the machine code that computes the motion
computes its derivatives too.  For θ the field is f + δ G̃, G̃ = (f(θ + δ) − f(θ))/δ, exactly.

*Theorem.*  Every motion that starts within max(δ, |w0|) of c is within C of the polynomial Σ b_n τⁿ of c, so that
R = Σ |b_n| + C bounds it, and Λ = h (2q (Σ |b_n|/(n + 1) + C) + l) the integral of |h Df| along it.  The end of each
polynomial is within E = D e^Λ of its motion (D: its defect, as in the enclosure).  |D²φ| ≤ M = 2 h q e^Λ B², where
B = Σ |V̂_n| + |V − V̂| + e^Λ 2 h q C (Σ |V̂_n| + |V − V̂|) bounds |Φ|.  So for any start y(0) = c + w, |w| ≤ |w0|,

    |Φ e_j − quotient| ≤ M (δ/2 + |w0|) + (E_j + E_0)/δ.                                                          (a)

Let g = q_G R² + l_G R bound |G̃| and Λ' be Λ with q + δ q_G and l + δ l_G.  Then |σ| ≤ s = e^Λ' h g, its derivative
with respect to the datum is at most M' = e^Λ' h (2 (2 q_G R + l_G) s + 2 (q + δ q_G) s²), that with respect to the
start M'' = e^(2Λ') h (2 q_G R + l_G + 2q s), and

    |σ − quotient| ≤ M' δ/2 + M'' |w0| + (E_j + E_0)/δ + e^Λ' h |G − G̃|.                                           (b)

Proof: the equations of first and second variation, v' = h Df v, S' = h Df S + h D²f(v, v) with |D²f(a, b)| ≤ 2q |a||b|,
and with h DG v beside h D²f where θ varies; Gronwall; Taylor's formula with the second derivative as remainder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import exp, inf
from typing import Any

import numpy as np
from gmpy2 import mpz

from heavytop.exact.enclosure import CAP, Node, Step, defect_bound, horner, taylor_series
from heavytop.exact.quadratic import Quadratic
from heavytop.exact.step_series import StepSeries
from heavytop.words.proven import Carrier

_UP = 1 + 2.0**-32
TINY = 2.0**-190
_LARGEST_GROWTH = 16.0


@dataclass(frozen=True, slots=True)
class Datum:
    """A datum θ of the field, in a unit of its own, and the field with θ + δ.

    field: f + δ G̃.  carrier: of its Taylor coefficients, as for a step.  quotient: (q, l) of G̃.  off: (q, l) of
    G − G̃, in ulps of the derivatives.
    """

    field: Quadratic
    carrier: Carrier | None
    quotient: tuple[float, float]
    off: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Tangent:
    """What derivatives are computed with: ``field`` is f, δ = 2^-shift, on a grid of ``precision`` bits."""

    field: Quadratic
    carrier: Carrier | None
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

    rows: list[list[Any]]
    errors: list[float]
    moved: float


def step_derivatives(tangent: Tangent, step: Step, tau: Fraction) -> StepDerivatives | None:
    """(Φ, σ) of ``step`` at 0 < τ ≤ 1, a column at a time; None where the bounds of the theorem are not finite."""
    bounds = _Bounds.of(tangent, step)
    if bounds is None:
        return None
    centre = list(step.node.centre)
    origin, columns, errors = _end(step.series, tau), [], []
    for j in range(tangent.field.dimension):
        beside = [value + ((k == j) << tangent.bits) for k, value in enumerate(centre)]
        series = taylor_series(tangent.field, _centred(step, beside), tangent.precision, tangent.carrier)
        error = bounds.end_error(tangent.field, series)
        if series is None or error is None:
            return None
        columns.append(_end(series, tau))
        errors.append(error + bounds.own_error + bounds.of_start + _rounding(step, series, tau))
    for datum in tangent.data:
        series = taylor_series(datum.field, _centred(step, centre), tangent.precision, datum.carrier)
        error, of_datum = bounds.end_error(datum.field, series), bounds.of_datum(datum)
        if series is None or error is None or not of_datum < inf:
            return None
        columns.append(_end(series, tau))
        errors.append(error + bounds.own_error + of_datum + _rounding(step, series, tau))
    rows = [
        [value - start for value in values] for start, values in zip(origin, zip(*columns, strict=True), strict=True)
    ]
    return StepDerivatives(rows, [error * _UP for error in errors], bounds.moved)


def _centred(step: Step, centre: Sequence[int]) -> Node:
    """The node of ``step``, with another centre and the step's own length."""
    return replace(step.node, centre=centre)


def _end(series: StepSeries, tau: Fraction) -> Sequence[Any]:
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


def unit_columns(size: int, bits: int, columns: int) -> list[list[Any]]:
    """The derivatives at time 0: the unit matrix, and 0 for the data, in ulps of 2^-bits."""
    return [[mpz((i == j) << bits) for j in range(columns)] for i in range(size)]
