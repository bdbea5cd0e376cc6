"""One proven step of a quadratic field y' = Q(y, y) + L y: Taylor polynomial, defect, and the set of possible errors.

All norms are maximum norms, and time is scaled so that a step goes over 0 ≤ τ ≤ 1: y' = h f(y).

*The polynomial* p(τ) = Σ b_n τⁿ has whole numbers in units of 2^-p ("ulps") as coefficients, exactly:
b_{n+1} is h f_n/(n + 1) within ρ_n, f_n the coefficient of τⁿ in f(p): ρ_n is half an ulp where they are made of
exact integers, and what :mod:`heavytop.words.proven` proves where they are made of words.  What p lacks to be a motion
is its defect p' − h f(p) = Σ E_n τⁿ, and that is known.  For n < N, |E_n| ≤ (n + 1) ρ_n; for n ≥ N, E_n = −h f_n with
|f_n| ≤ q Σ_{j+k=n} β_j β_k + l β_n, β_j = |b_j|.  Hence the integral of |defect| from 0 to τ is at most

    D = Σ_{n < N} ρ_n + Σ_{n ≥ N} h (q Σ_{j+k=n} β_j β_k + l β_n)/(n + 1).                                        (a)

*Theorem (tail).*  The motion y that starts at y(0) with w0 = y(0) − p(0) differs from p by w with
w' = J w + h Q(w, w) − defect, J(τ) = h Df(p(τ)).  With |J| ≤ Λ' = h (2q Σ β_j + l), Λ = Λ' + h q c and
W = (|w0| + D) e^Λ < c, it follows that |w| ≤ W on the whole step.  Proof: as long as |w| ≤ c,
|w(τ)| ≤ |w0| + D + ∫ Λ |w|, so |w| ≤ W by Gronwall; W < c and continuity exclude that c is ever reached.  The a priori
form of the same induction, |y_n| ≤ R Kⁿ with K = q R + l for |y(0)| ≤ R, is :func:`coefficient_bound`; it chooses the
first step.  The form with the defect uses the coefficients that are there and allows steps about six times longer.

*The set of errors.*  With V' = J V, V(0) = 1, variation of constants gives w(τ) = V(τ) w0 + v,
|v| ≤ e^Λ (D + h q W²).  Where the field is not known
exactly, y' = f(y) + δ with |δ| ≤ s on the motion (:attr:`heavytop.exact.quadratic.Quadratic.slack`), D is h s more, and
all of it holds.  V is computed as a polynomial in binary64; with E its own defect, |V − V̂| ≤ e^Λ ∫|E|.  Errors are kept
as w0 ∈ {Q x: |x_i| ≤ r_i} with Q nearly orthogonal; the next Q comes from a QR factorisation of V̂ Q diag(r) with its
columns ordered by length (Lohner), and Q'^T Q' = 1 + F is paid for with |F|.
binary64 is used here with round to nearest; every bound carries the rounding of its own evaluation (``_UP``).

Measured on the generic top of the tests at 400 bits, bits lost by t = 8, 30, 100, 300:

    ordered QR frames          19  28  41  74     kept
    QR frames, not ordered     19  28  41  74
    parallelepipeds (Q = V̂ Q)  18  22  34  lost: the columns become parallel
    boxes (Q = 1)              24  60 186  lost
    balls without V            23  74   –  –      about 2.4 bits a unit of time, and 50 times slower

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import exp, inf, isfinite

import numpy as np
from flint import arb, fmpz
from gmpy2 import mpz

from heavytop.exact.quadratic import Matrix, Quadratic
from heavytop.exact.step_series import StepSeries, Whole
from heavytop.words.proven import Carrier
from heavytop.words.variation import variation as variation_of
from heavytop.words.whole_series import coefficients

_UNIT = 2.0**-53
# relative room for the rounding of every bound below: each is a sum or product of a few hundred terms of one sign
_UP = 1 + 2.0**-32
_TINY = 2.0**-190
_VARIATIONAL_ORDER = 32
# the size c of an error beyond which an enclosure counts as lost
CAP = 2.0**-16
_LARGEST_SLOPE = 2.0
_FAR_OFF = 2**900
"""Ulps that no start may be off by: such an enclosure is lost at once."""


@dataclass(frozen=True, slots=True)
class Errors:
    """The set {Q x 2^exponent: |x_i| ≤ radii_i}, in ulps."""

    frame: Matrix
    radii: Matrix
    exponent: int

    def sizes(self, matrix: Matrix | None = None, slack: float = 0.0) -> Matrix:
        """Upper bounds of the components of (matrix + anything of norm ``slack``) times the set, without 2^exponent."""
        across = self.frame if matrix is None else matrix
        return np.asarray((np.abs(across) @ self.radii + slack * self.radii.max()) * _UP + _TINY)


@dataclass(frozen=True, slots=True)
class Node:
    """The motion at ``time``: centre in ulps plus the set of errors; ``halvings``: the next step is 2^-halvings."""

    time: Fraction
    centre: Sequence[int]
    errors: Errors
    halvings: int


@dataclass(frozen=True, slots=True)
class Step:
    """The motion from a node on, for 0 ≤ τ ≤ 1.

    series: the polynomial, in whole ulps of 2^-precision.  variation: V̂ by powers of τ.
    powers: an upper bound of Σ |V̂_n|.
    variation_error: bound of |V − V̂|.  local: bound of |v| in ulps 2^errors.exponent.  widest: W, as a number;
    widest_ulps: the same in ulps 2^errors.exponent.
    """

    node: Node
    precision: int
    series: StepSeries
    variation: Matrix
    powers: float
    variation_error: float
    local: float
    widest: float
    widest_ulps: float

    @property
    def length(self) -> Fraction:
        """h."""
        return Fraction(1, 2) ** self.node.halvings if self.node.halvings >= 0 else Fraction(2**-self.node.halvings)

    @property
    def order(self) -> int:
        """N."""
        return self.series.order

    @property
    def coefficients(self) -> list[list[int]]:
        """b_n of each component."""
        return self.series.values

    @property
    def summed_error(self) -> float:
        """|V − V̂| with the rounding of the sum that V̂ is evaluated by."""
        return self.variation_error + 8 * _VARIATIONAL_ORDER * _UNIT * self.powers

    def at(self, tau: Fraction) -> list[arb]:
        """The state at 0 ≤ τ ≤ 1, as balls."""
        return self.around(tau, self.radii(tau))

    def radii(self, tau: Fraction) -> Matrix:
        """Bounds of the errors at 0 ≤ τ ≤ 1, in ulps 2^errors.exponent; in binary64, without FLINT."""
        slack = self.summed_error
        variation = sum(float(tau) ** n * matrix for n, matrix in enumerate(self.variation))
        errors = self.node.errors
        # the second term: the rounding of the product below
        spread = (slack + 64 * _UNIT * self.powers) * norm(errors.frame) * _UP
        return np.asarray(errors.sizes(variation @ errors.frame, spread) + self.local)

    def around(self, tau: Fraction, radii: Matrix) -> list[arb]:
        """The state at 0 ≤ τ ≤ 1 as balls, from its :meth:`radii`."""
        # each of the N roundings of Horner's scheme is at most half an ulp
        rounding = arb(self.order) / 2
        unit = arb(2) ** -self.precision
        scale = arb(2) ** self.node.errors.exponent
        return [
            arb(fmpz(int(horner(component, tau))) * unit, (arb(float(r * _UP)) * scale + rounding).upper() * unit)
            for component, r in zip(self.coefficients, radii, strict=True)
        ]

    def transfer(self) -> tuple[Matrix, Matrix, float]:
        """(Q', T, η): the frame at τ = 1, T = Q'^T V̂ Q and a bound of |Q'^-1 V Q − T|; η also bounds |Q'^-1 − Q'^T|."""
        return _new_frame(self.variation.sum(axis=0), self.summed_error, self.node.errors)

    def end(self, transfer: tuple[Matrix, Matrix, float] | None = None) -> Node:
        """The node at τ = 1: Σ b_n exactly, and the set of errors in a new frame, that of :meth:`transfer`."""
        errors = self.node.errors
        frame, turned, slack = transfer or self.transfer()
        radii = Errors(turned, errors.radii, 0).sizes(slack=slack)
        reach = np.abs(frame.T).sum(axis=1) + slack
        radii = (radii + reach * self.local) * _UP
        exponent = errors.exponent
        if radii.max() > 2.0**400:
            radii, exponent = np.ldexp(radii, -400), exponent + 400
        return Node(self.node.time + self.length, self.series.total, Errors(frame, radii, exponent), self._halvings())

    def _halvings(self) -> int:
        """The next step: where the orders a bit are few it is doubled, where they are many it is halved."""
        (few, many), wanted = self.series.thrifty, self.order / (self.precision + 16)
        if wanted > many:
            return self.node.halvings + 1
        return self.node.halvings - int(wanted < few and norm(self.variation[1]) < _LARGEST_SLOPE / 2)


def horner(coefficients: list[int], tau: Fraction) -> mpz:
    """The polynomial at 0 ≤ τ ≤ 1, within half a unit an order; exactly at 1."""
    if tau == 1:
        return mpz(sum(coefficients))
    total = mpz(0)
    numerator, denominator = mpz(tau.numerator), mpz(tau.denominator)
    for value in reversed(coefficients):
        total = value + (2 * total * numerator + denominator) // (2 * denominator)
    return total


def _new_frame(variation: Matrix, variation_error: float, errors: Errors) -> tuple[Matrix, Matrix, float]:
    """(Q', T, η): the next frame, T = Q'^T V̂ Q and a bound of |Q'^-1 V Q − T|; η also bounds |Q'^-1 − Q'^T|."""
    size = len(variation)
    carried = variation @ errors.frame
    order = np.argsort(-np.sqrt((carried * carried).sum(axis=0)) * errors.radii, kind="stable")
    frame = np.linalg.qr(carried[:, order])[0]
    rounding = 2 * (size + 4) * _UNIT
    transposed, before = norm(frame.T), norm(errors.frame)
    product = (norm(variation) + variation_error) * before
    off = norm(frame.T @ frame - _identity(size)) + rounding * transposed * size
    # (1 + F)^-1 differs from 1 by at most |F|/(1 − |F|)
    inverse = off / (1 - off) * transposed if off < 1 else inf
    slack = inverse * product + transposed * before * variation_error + 3 * rounding * transposed * product
    return frame, frame.T @ carried, max(slack, inverse) * _UP


@lru_cache(maxsize=4)
def _identity(size: int) -> Matrix:
    return np.eye(size)


def norm(matrix: Matrix) -> float:
    """The largest row sum of absolute values."""
    return float(max(np.add.reduce(np.abs(matrix), 1).tolist()))


def coefficient_bound(field: Quadratic, size: Fraction) -> Fraction:
    """K = q R + l for R = ``size`` ≥ |y|: every Taylor coefficient of the motion has |y_n| ≤ R Kⁿ.

    Induction: (n + 1) |y_{n+1}| ≤ q Σ_{j=0..n} R K^j R K^(n−j) + l R Kⁿ ≤ (n + 1) R Kⁿ (q R + l).
    Hence the part beyond order N at a step h < 1/K is at most R (K h)^(N+1)/(1 − K h).
    """
    return field.q * size + field.l


def start_node(field: Quadratic, start: tuple[Fraction, ...], precision: int, off: Sequence[Fraction] = ()) -> Node:
    """The node at time 0 of the motion from ``start``, rounded to ulps of 2^-precision.

    off: how far each component of the true start may be from it; none where it is exact.
    """
    scaled = [value * 2**precision for value in start]
    centre = tuple(mpz(round(value)) for value in scaled)
    radii = np.array([0.0 if value.denominator == 1 else 0.5 for value in scaled])
    if any(off):
        radii += np.array([float(min(value * 2**precision, _FAR_OFF)) * _UP + _TINY for value in off])
    bound = coefficient_bound(field, max(map(abs, start)))
    # the first step has K h < 1/4
    halvings = 2 + int(bound).bit_length() if bound >= 1 else 2 - int(1 / (bound + Fraction(1, 16))).bit_length()
    return Node(Fraction(0), centre, Errors(np.eye(field.dimension), radii, 0), halvings)


def step(field: Quadratic, node: Node, precision: int, carrier: Carrier | None = None) -> Step | None:
    """The proven step from ``node``; None where the errors have grown beyond what the theorem admits.

    carrier: of this motion on the grid of ``precision`` bits; None for coefficients in exact integers.
    """
    halvings = node.halvings
    while halvings < node.halvings + 64:
        trial = Node(node.time, node.centre, node.errors, halvings)
        series = taylor_series(field, trial, precision, carrier)
        found = None if series is None else _prove(field, trial, series, precision)
        if found is not None and isfinite(found.widest) and found.variation_error < CAP:
            return found if found.widest < CAP else None
        halvings += 1
    return None


def taylor_series(field: Quadratic, node: Node, precision: int, carrier: Carrier | None) -> StepSeries | None:
    """The polynomial from a node, over its own step; None where that is too long for it."""
    if carrier is not None:
        return carrier.series(node.centre, node.halvings)
    values = coefficients(field, node.centre, precision, node.halvings)
    return None if values is None else Whole(values, precision)


def _prove(field: Quadratic, node: Node, series: StepSeries, precision: int) -> Step | None:
    """The step with its bounds from the theorem; None where they are not finite."""
    h, q, slope = 2.0**-node.halvings, float(field.q) * _UP, float(field.l) * _UP
    sizes = series.sizes
    growth = h * (2 * q * float(sizes.sum()) + slope + q * CAP) * _UP
    if not growth < 4 * _LARGEST_SLOPE:
        return None
    factor = exp(growth) * _UP
    scale = node.errors.exponent
    defect = defect_bound(series, precision, h * q, h * slope)
    # what the field itself lacks: |y' − f(y)| on the true motion
    lacking, exponent = field.slack
    defect = np.ldexp(defect, -scale) + np.ldexp(h * lacking * _UP, exponent + precision - scale) + _TINY
    variation, powers, variation_error = _variation(field, series, h, h * 2 * q * sizes)
    bound = (float(node.errors.sizes().max()) + defect) * factor * _UP
    square = np.ldexp(h * q * bound * bound, max(scale - precision, -2000)) + _TINY
    local = float(factor * (defect + square) * _UP)
    widest = float(np.ldexp(bound, min(scale - precision, 900)))
    return Step(node, precision, series, variation, powers, factor * variation_error * _UP, local, widest, bound)


def defect_bound(series: StepSeries, precision: int, quadratic: float, linear: float) -> float:
    """D of (a) in ulps; ``quadratic`` and ``linear`` are h q and h l.

    β_n is multiplied by 2^(rate n), so that binary64 holds it at any precision.
    """
    order = series.order
    rate = precision // order
    scaled = series.scaled(rate)
    products = np.convolve(scaled, scaled)[order:]
    # n ≥ N in the denominators
    beyond = (quadratic * float(products @ _falling(rate, order)) + linear * float(scaled[-1])) / (order + 1)
    return (series.rounding + float(np.ldexp(beyond, precision - rate * order))) * _UP


@lru_cache(maxsize=512)
def _falling(rate: int, order: int) -> Matrix:
    """2^(−rate n) for n = 0 to ``order``."""
    return np.ldexp(1.0, np.maximum(-rate * np.arange(order + 1), -1000))


def _variation(field: Quadratic, series: StepSeries, h: float, slopes: Matrix) -> tuple[Matrix, float, float]:
    """V̂ by powers of τ, a bound of Σ |V̂_n|, and one of the integral of its own defect over the step.

    V̂_{n+1} = Σ_j J_j V̂_{n−j}/(n + 1), each a scalar product of at most ``terms`` numbers, wrong by at most terms
    units in the last place of the sum of the absolute values.  ``slopes``: upper bounds of |J_n| without l.
    """
    size, top = field.dimension, _VARIATIONAL_ORDER
    values = series.rounded(top - 1)
    jacobians = np.zeros((top, size, size))
    jacobians[: len(values)] = (values @ field.jacobian.reshape(size * size, size).T).reshape(-1, size, size)
    jacobians[0] += field.slope
    variation = variation_of(h * jacobians)
    norms = np.maximum.reduce(np.add.reduce(np.abs(variation), 2), 1)
    rates = slopes.copy()
    rates[0] += h * float(field.l)
    terms = size * (top + 2) + 16
    rounding = (4 * terms * _UNIT * float(rates.sum()) + _TINY) * float(norms.sum())
    # n ≥ top in the denominators
    beyond = float(np.add.reduce(np.convolve(rates, norms)[top:])) / (top + 1)
    return variation, float(norms.sum()) * _UP, (rounding + beyond) * _UP
