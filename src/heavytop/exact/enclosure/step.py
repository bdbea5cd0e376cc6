"""One proven step of a quadratic field y' = Q(y, y) + L y: Taylor polynomial, defect, and the set of possible errors.

All norms are maximum norms, and time is scaled so that a step goes over 0 ≤ τ ≤ 1: y' = h f(y).

*The polynomial* p(τ) = Σ b_n τⁿ has integers in units of 2^-p ("ulps") as coefficients, exactly: b_{n+1} is
h f_n/(n + 1) within ρ_n, f_n the coefficient of τⁿ in f(p); ρ_n is half an ulp for exact integers, and the bound of
:mod:`heavytop.multiword.fixed_point.certified_series` for words.  Its defect p' − h f(p) = Σ E_n τⁿ is known.  For
n < N, |E_n| ≤ (n + 1) ρ_n; for n ≥ N, E_n = −h f_n with |f_n| ≤ q Σ_{j+k=n} β_j β_k + l β_n, β_j = |b_j|.  Hence the
integral of |defect| from 0 to τ is at most

    D = Σ_{n < N} ρ_n + Σ_{n ≥ N} h (q Σ_{j+k=n} β_j β_k + l β_n)/(n + 1).                                        (a)

*Theorem (tail).*  The motion y that starts at y(0) with w0 = y(0) − p(0) differs from p by w with
w' = J w + h Q(w, w) − defect, J(τ) = h Df(p(τ)).  With |J| ≤ Λ' = h (2q Σ β_j + l), Λ = Λ' + h q c and
W = (|w0| + D) e^Λ < c, it follows that |w| ≤ W on the whole step.  Proof: as long as |w| ≤ c,
|w(τ)| ≤ |w0| + D + ∫ Λ |w|, so |w| ≤ W by Gronwall; W < c and continuity exclude that c is ever reached.  The a priori
form of the same induction, |y_n| ≤ R Kⁿ with K = q R + l for |y(0)| ≤ R, is :func:`coefficient_bound`; it chooses the
first step.  The form with the defect uses the coefficients that are there and allows steps about six times longer.

*The set of errors.*  With V' = J V, V(0) = 1, variation of constants gives w(τ) = V(τ) w0 + v,
|v| ≤ e^Λ (D + h q W²).  Where the field is not known
exactly, y' = f(y) + δ with |δ| ≤ s on the motion (:attr:`heavytop.exact.enclosure.step.Quadratic.slack`), D is h s
more, and all of it holds.  V is computed as a polynomial in binary64; with E its own defect, |V − V̂| ≤ e^Λ ∫|E|.
Errors are kept as w0 ∈ {Q x: |x_i| ≤ r_i} with Q nearly orthogonal; the next Q comes from a QR factorisation of V̂ Q
diag(r) with its columns ordered by length (Lohner), and Q'^T Q' = 1 + F is paid for with |F|. binary64 is used here
with round to nearest; every bound carries the rounding of its own evaluation (``_UP``).

Measured on the generic top of the tests at 400 bits, bits lost by t = 8, 30, 100, 300:

    ordered QR frames          19  28  41  74     kept
    QR frames, not ordered     19  28  41  74
    parallelepipeds (Q = V̂ Q)  18  22  34  lost: the columns become parallel
    boxes (Q = 1)              24  60 186  lost
    balls without V            23  74   –  –      about 2.4 bits a unit of time, and 50 times slower
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from math import exp, inf, isfinite, lcm, log2
from typing import NamedTuple, TypeAlias

import numpy as np
from flint import arb, fmpz, fmpz_poly
from gmpy2 import mpq, mpz
from numpy.typing import NDArray

from heavytop.multiword.fixed_point.certified_series import CertifiedSeries, WordSeries
from heavytop.multiword.integers.integer_series import QuadraticComponent, QuadraticField, coefficients, horner
from heavytop.multiword.problem import variation as variation_of

# The exact coefficients of a vector field of degree two.
#
# All systems have fields f(y) = Q(y, y) + L y without a constant part.  The coefficients are computed from the field,
# by evaluating it at the basis vectors and their pairwise sums.


Matrix = NDArray[np.float64]
Field = Callable[[tuple[mpq, ...]], Sequence[mpq]]


@dataclass(frozen=True, slots=True)
class Quadratic:
    """A field Q(y, y) + L y.

    pairs: the products y_j y_k that occur.  rows: the components.
    q, l: the largest row sums of absolute coefficients of the two parts, so |f(y)| ≤ q |y|² + l |y| and the Jacobian
    has |J(y)| ≤ 2 q |y| + l, in the maximum norm.
    jacobian: J(y)_ij = Σ_k jacobian[i, j, k] y_k + slope[i, j], rounded to binary64; infinite where it has no such.
    slack: (a, b): the true field differs from this one by at most a 2^b, in the maximum norm, wherever its motion goes.
    """

    pairs: tuple[tuple[int, int], ...]
    rows: tuple[QuadraticComponent, ...]
    q: Fraction
    l: Fraction  # noqa: E741 - the letter of the theorem
    jacobian: Matrix
    slope: Matrix
    slack: tuple[float, int] = (0.0, 0)

    @property
    def dimension(self) -> int:
        """The number of components."""
        return len(self.rows)


def quadratic(field: Field, dimension: int) -> Quadratic:
    """The coefficients of ``field``, which must be of degree two without a constant part."""
    size = range(dimension)
    unit = [tuple(mpq(int(i == j)) for i in size) for j in size]
    plus, minus = [field(e) for e in unit], [field(tuple(-x for x in e)) for e in unit]
    squares = [[(x + y) / 2 for x, y in zip(*pair, strict=True)] for pair in zip(plus, minus, strict=True)]
    lines = [[(x - y) / 2 for x, y in zip(*pair, strict=True)] for pair in zip(plus, minus, strict=True)]
    terms = {}
    for j in size:
        terms[j, j] = squares[j]
        for k in range(j + 1, dimension):
            of_sum = field(tuple(x + y for x, y in zip(unit[j], unit[k], strict=True)))
            terms[j, k] = [value - x - y for value, x, y in zip(of_sum, plus[j], plus[k], strict=True)]
    pairs = tuple(pair for pair, values in terms.items() if any(values))
    rows, sums = [], []
    jacobian, slope = np.zeros((dimension,) * 3), np.zeros((dimension,) * 2)
    for i in size:
        products = {index: _fraction(terms[pair][i]) for index, pair in enumerate(pairs) if terms[pair][i]}
        linear = {j: _fraction(lines[j][i]) for j in size if lines[j][i]}
        common = lcm(*(c.denominator for c in (*products.values(), *linear.values())))
        numbered = (tuple((int(c * common), place) for place, c in of.items()) for of in (products, linear))
        rows.append(QuadraticComponent(common, *numbered))
        sums.append([sum(map(abs, of.values()), Fraction(0)) for of in (products, linear)])
        for index, c in products.items():
            j, k = pairs[index]
            jacobian[i, j, k] += _rounded(c)
            jacobian[i, k, j] += _rounded(c)
        for j, c in linear.items():
            slope[i, j] = _rounded(c)
    q, l = map(max, zip(*sums, strict=True))  # noqa: E741
    return Quadratic(pairs, tuple(rows), q, l, jacobian, slope)


def _fraction(value: mpq) -> Fraction:
    return Fraction(int(value.numerator), int(value.denominator))


def _rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return inf if value > 0 else -inf


# The Taylor polynomial of a step: integer coefficients, with the quantities that its proof needs.


@dataclass(frozen=True)
class Whole:
    """Coefficients of :func:`heavytop.multiword.integers.integer_series.coefficients`, each rounded to nearest."""

    values: list[list[int]]
    precision: int

    @property
    def thrifty(self) -> tuple[float, float]:
        """Orders per bit between which a unit of time costs least: 2.1 to 3.8 bits a power of τ, about e^-2."""
        return 0.27, 0.45

    @property
    def order(self) -> int:
        """N."""
        return len(self.values[0]) - 1

    @property
    def rounding(self) -> float:
        """Half an ulp an order."""
        return self.order / 2

    @property
    def total(self) -> tuple[int, ...]:
        """Σ b_n."""
        return tuple(sum(component, mpz(0)) for component in self.values)

    @cached_property
    def _lengths(self) -> Matrix:
        """Bits of β_n, in ulps."""
        return np.array([max(map(abs, column)).bit_length() for column in zip(*self.values, strict=True)])

    @cached_property
    def sizes(self) -> Matrix:
        """The first in binary64, the others by their lengths."""
        bounds = np.ldexp(1.0, np.maximum(self._lengths - self.precision, -200))
        first = np.abs(self.rounded(32)).max(axis=1)
        bounds[: first.size] = first * _UP + _TINY
        return np.asarray(bounds)

    def scaled(self, rate: int) -> Matrix:
        """Powers of two, so that binary64 holds them at any precision."""
        return np.ldexp(1.0, np.maximum(self._lengths - self.precision + rate * np.arange(self.order + 1), -900))

    def rounded(self, orders: int) -> Matrix:
        """Their leading 200 bits, rounded."""
        shift = max(0, self.precision - 200)
        short = [[float(value >> shift) for value in component[: orders + 1]] for component in self.values]
        return np.asarray(np.ldexp(np.array(short).T, shift - self.precision))


StepSeries: TypeAlias = Whole | WordSeries
"""b_0, …, b_N of every component, in whole ulps: of exact integers, or on a grid of words.

thrifty: orders a bit between which a unit of time costs least.  rounding: a bound, in ulps, of
Σ_(n < N) |b_(n+1) − h f_n/(n + 1)|.  total: Σ b_n, exactly.  sizes, scaled: upper bounds of β_n and of 2^(rate n) β_n.
rounded: b_0 to b_orders in binary64, within 2^-50 of ``sizes`` plus 2^-199.
"""


def lacking(motion: QuadraticField, series: StepSeries, precision: int, halvings: int) -> list[Fraction]:
    """|b_(n+1) − h f_n/(n + 1)| in the maximum norm, in ulps, for 0 ≤ n < N: exactly, from integers."""
    polynomials = [fmpz_poly([int(value) for value in component]) for component in series.values]
    products = [polynomials[j] * polynomials[k] for j, k in motion.pairs]
    terms = [Fraction(0)] * series.order
    for component, row in zip(series.values, motion.rows, strict=True):
        quadratic = sum((c * products[pair] for c, pair in row.products), fmpz_poly([]))
        linear = sum((c * polynomials[j] for c, j in row.linear), fmpz_poly([]))
        for n in range(series.order):
            rate = int(quadratic[n]) + (int(linear[n]) << precision)
            step = Fraction(rate, row.denominator * (n + 1) << precision) / Fraction(2) ** halvings
            terms[n] = max(terms[n], abs(int(component[n + 1]) - step))
    return terms


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

    @property
    def bits(self) -> float:
        """log2 of the largest error, in ulps, plus 2^exponent: the bits that are lost."""
        return self.exponent + log2(float(self.sizes().max()) + 1)

    def sizes(self, matrix: Matrix | None = None, slack: float = 0.0) -> Matrix:
        """Upper bounds of the components of (matrix + anything of norm ``slack``) times the set, without 2^exponent."""
        across = self.frame if matrix is None else matrix
        return np.asarray((np.abs(across) @ self.radii + slack * self.radii.max()) * _UP + _TINY)


@dataclass(frozen=True, slots=True)
class Node:
    """The motion at ``time``: centre in ulps plus the set of errors.  halvings: the next step is 2^-halvings."""

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

    def end(self, transfer: tuple[Matrix, Matrix, float] | None = None, dropped: int = 0) -> Node:
        """The node at τ = 1: Σ b_n, and the set of errors in a new frame, that of :meth:`transfer`.

        dropped: the bits that the node has fewer than this step.  The sum is then rounded to nearest, by at most half
        of its ulp in each component, and the set is widened by as much; with 0 the sum is exact.
        """
        errors = self.node.errors
        frame, transformed, slack = transfer or self.transfer()
        radii = Errors(transformed, errors.radii, 0).sizes(slack=slack)
        reach = np.abs(frame.T).sum(axis=1) + slack
        rounding = float(np.ldexp(0.5, dropped - errors.exponent)) if dropped else 0.0
        radii = (radii + reach * (self.local + rounding)) * _UP
        exponent = errors.exponent
        if radii.max() > 2.0**400:
            radii, exponent = np.ldexp(radii, -400), exponent + 400
        centre = rounded_off(self.series.total, dropped) if dropped else self.series.total
        return Node(self.node.time + self.length, centre, Errors(frame, radii, exponent - dropped), self._halvings())

    def _halvings(self) -> int:
        """The next step: doubled where the orders per bit are few, halved where they are many."""
        (few, many), orders_per_bit = self.series.thrifty, self.order / (self.precision + 16)
        if orders_per_bit > many:
            return self.node.halvings + 1
        return self.node.halvings - int(orders_per_bit < few and norm(self.variation[1]) < _LARGEST_SLOPE / 2)


def rounded_off(centre: Sequence[int], dropped: int) -> tuple[mpz, ...]:
    """Each number over 2^dropped, rounded to nearest."""
    half = mpz(1) << (dropped - 1)
    return tuple((value + half) >> dropped for value in centre)


def _new_frame(variation: Matrix, variation_error: float, errors: Errors) -> tuple[Matrix, Matrix, float]:
    """(Q', T, η): the next frame, T = Q'^T V̂ Q and a bound of |Q'^-1 V Q − T|; η also bounds |Q'^-1 − Q'^T|."""
    size = len(variation)
    carried = variation @ errors.frame
    order = np.argsort(-np.sqrt((carried * carried).sum(axis=0)) * errors.radii, kind="stable")
    frame = np.linalg.qr(carried[:, order])[0]
    rounding = 2 * (size + 4) * _UNIT
    transposed, before = norm(frame.T), norm(errors.frame)
    product = (norm(variation) + variation_error) * before
    defect = norm(frame.T @ frame - _identity(size)) + rounding * transposed * size
    # (1 + F)^-1 differs from 1 by at most |F|/(1 − |F|)
    inverse = defect / (1 - defect) * transposed if defect < 1 else inf
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


def start_node(field: Quadratic, start: tuple[Fraction, ...], precision: int, errors: Sequence[Fraction] = ()) -> Node:
    """The node at time 0 of the motion from ``start``, rounded to ulps of 2^-precision.

    errors: bounds of the error of each component; empty for an exact start.
    """
    scaled = [value * 2**precision for value in start]
    centre = tuple(mpz(round(value)) for value in scaled)
    radii = np.array([0.0 if value.denominator == 1 else 0.5 for value in scaled])
    if any(errors):
        radii += np.array([float(min(value * 2**precision, _FAR_OFF)) * _UP + _TINY for value in errors])
    bound = coefficient_bound(field, max(map(abs, start)))
    # the first step has K h < 1/4
    halvings = 2 + int(bound).bit_length() if bound >= 1 else 2 - int(1 / (bound + Fraction(1, 16))).bit_length()
    return Node(Fraction(0), centre, Errors(np.eye(field.dimension), radii, 0), halvings)


def step(field: Quadratic, node: Node, precision: int, certified: CertifiedSeries | None = None) -> Step | None:
    """The proven step from ``node``; None where the errors have grown beyond what the theorem admits.

    certified: of this motion on the grid of ``precision`` bits; None for coefficients in exact integers.
    """
    halvings = node.halvings
    while halvings < node.halvings + 64:
        trial = Node(node.time, node.centre, node.errors, halvings)
        series = taylor_series(field, trial, precision, certified)
        proven = None if series is None else _prove(field, trial, series, precision)
        if proven is not None and isfinite(proven.widest) and proven.variation_error < CAP:
            return proven if proven.widest < CAP else None
        halvings += 1
    return None


def taylor_series(field: Quadratic, node: Node, precision: int, certified: CertifiedSeries | None) -> StepSeries | None:
    """The polynomial from a node, over its own step; None where that is too long for it."""
    if certified is not None:
        return certified.series(node.centre, node.halvings)
    values = coefficients(field, node.centre, precision, node.halvings)
    return None if values is None else Whole(values, precision)


def _prove(field: Quadratic, node: Node, series: StepSeries, precision: int) -> Step | None:
    """The step with its bounds from the theorem; None where they are not finite."""
    tail = _tail(field, node, series, precision)
    if tail is None:
        return None
    h, q, scale = 2.0**-node.halvings, float(field.q) * _UP, node.errors.exponent
    variation, powers, variation_error = _variation(field, series, h, h * 2 * q * series.sizes)
    square = np.ldexp(h * q * tail.bound * tail.bound, max(scale - precision, -2000)) + _TINY
    local = float(tail.factor * (tail.defect + square) * _UP)
    error = tail.factor * variation_error * _UP
    return Step(node, precision, series, variation, powers, error, local, tail.widest, tail.bound)


class _Tail(NamedTuple):
    """e^Λ of the theorem, D and W in ulps 2^errors.exponent, and W as a number."""

    factor: float
    defect: float
    bound: float
    widest: float


def _tail(field: Quadratic, node: Node, series: StepSeries, precision: int) -> _Tail | None:
    """The tail of the polynomial from ``node``; None where it is too long for the theorem."""
    h, q, slope = 2.0**-node.halvings, float(field.q) * _UP, float(field.l) * _UP
    growth = h * (2 * q * float(series.sizes.sum()) + slope + q * CAP) * _UP
    if not growth < 4 * _LARGEST_SLOPE:
        return None
    factor, scale = exp(growth) * _UP, node.errors.exponent
    defect = defect_bound(series, precision, h * q, h * slope)
    # the error of the field: |y' − f(y)| on the true motion
    lacking, exponent = field.slack
    defect = np.ldexp(defect, -scale) + np.ldexp(h * lacking * _UP, exponent + precision - scale) + _TINY
    bound = (float(node.errors.sizes().max()) + defect) * factor * _UP
    return _Tail(factor, defect, bound, float(np.ldexp(bound, min(scale - precision, 900))))


def in_other_bits(field: Quadratic, taken: Step, precision: int, certified: CertifiedSeries | None) -> Step | None:
    """``taken`` with a polynomial in ``precision`` bits, from its rounded centre; None where that is not proven.

    The set of errors is a box around that of ``taken``, widened by the rounding.  V̂ remains that along the polynomial
    of ``taken``: W is the larger of both, so that the motion is within it of either.
    """
    node, shift = taken.node, precision - taken.precision
    if not shift and isinstance(taken.series, Whole) == (certified is None):
        return taken
    centre = rounded_off(node.centre, -shift) if shift < 0 else tuple(mpz(value) << shift for value in node.centre)
    smaller, exponent = min(0, node.errors.exponent + shift), max(0, node.errors.exponent + shift)
    radii = np.ldexp(node.errors.sizes(), smaller) + (np.ldexp(0.5, -exponent) * (shift < 0) + _TINY)
    box = Errors(_identity(len(radii)), radii * _UP, exponent)
    rounded = Node(node.time, centre, box, node.halvings)
    series = taylor_series(field, rounded, precision, certified)
    tail = None if series is None else _tail(field, rounded, series, precision)
    if series is None or tail is None:
        return None
    bound = max(tail.bound, float(np.ldexp(taken.widest_ulps, smaller)) + _TINY)
    widest = max(tail.widest, taken.widest)
    in_bits = replace(taken, node=rounded, precision=precision, series=series, widest=widest, widest_ulps=bound)
    return in_bits if widest < CAP else None


def defect_bound(series: StepSeries, precision: int, quadratic: float, linear: float) -> float:
    """D of (a) in ulps; ``quadratic`` and ``linear`` are h q and h l.

    β_n is multiplied by 2^(rate n), so that binary64 holds it at any precision.
    """
    order = series.order
    rate = precision // order
    scaled = series.scaled(rate)
    products = np.convolve(scaled, scaled)[order:]
    # n ≥ N in the denominators
    beyond = (quadratic * float(products @ falling(rate, order)) + linear * float(scaled[-1])) / (order + 1)
    return (series.rounding + float(np.ldexp(beyond, precision - rate * order))) * _UP


@lru_cache(maxsize=512)
def falling(rate: int, order: int) -> Matrix:
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
