"""Kovalevskaya's top by theta functions of two variables: a second closed form, independent of the series of the first.

The curve y² = −2 φ(w) with five distinct roots e_1, ..., e_5, sorted
by real and imaginary part so that the broken line through them does not cross itself.  A_k = 2 ∫ (dw/y, w dw/y) from
e_k to e_(k+1), each with one unknown sign, make the periods a1 = A1, b1 = A2, a2 = A1 + A3, b2 = A4.  Of the eight
choices of signs one gives a τ = a^−1 b that is symmetric with a positive imaginary part, the seven others are excluded
by balls. The image of e_j is the half period with the characteristic η_j, ∞ being 0:

    η_1 = (A2 + A4)/2,   η_(k+1) = η_k + A_k/2   (mod 2),   δ: the odd characteristic with every δ + η_j odd
    θ_0 = θ[δ],   θ_j = θ[δ + η_j],   θ_ij = θ[δ + η_i + η_j]

The motion is the straight line z(t) = z_0 + v t, v = a^−1 (0, 1), z_0 = a^−1 Σ_k ∫_∞^(w_k, y_k) (dw/y, w dw/y).  With
X, Y, Z and P_j as in :mod:`heavytop.exact.cases.kovalevskaya`

    P_j = κ_j θ_j/θ_0,   P_i' P_j − P_i P_j' = κ_i κ_j c_ij θ_ij/θ_0,   D = Σ Z_j κ_j θ_j
    p = Σ Y_j κ_j θ_j/(2D),   q = θ_0/(2iD),   r = (2i/D) Σ_{i<j} (Y_i Z_j − Y_j Z_i) κ_i κ_j c_ij θ_ij

κ_j comes from power series at the start, c_ij from any z.  D has no zero on a real motion.  At large times
z = x + τ y is reduced by whole periods modulo 2, under which all θ take the same factor.
Source: Kötter, Acta Math. 17 (1893) 209; Mumford, Tata Lectures on Theta II; constants derived here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import accumulate, combinations, product
from typing import Any

from flint import acb, acb_mat, acb_series, arb, arb_mat, arb_series, fmpq_poly

from heavytop.exact.cases.lagrange import Reduced, polynomial
from heavytop.exact.closed_form import solved
from heavytop.exact.flint.balls import (
    BallLike,
    Undecided,
    ball,
    coefficient,
    current_length,
    midpoint,
    nearest_integer,
    series_length,
    the_only,
)
from heavytop.top.equations import Parameters, heavy_top, kovalevskaya

# Kovalevskaya's separation of variables: the exact level of a start, its curve, and w1, w2 there.
#
# The top is I = (2, 2, 1), n = (c, 0, 0) (:mod:`heavytop.exact.cases.lagrange`).  With p, q, r the angular velocity,
# x1,2 = p ± iq and s = x1 x2 (Kovalevskaya, Acta Math. 12 (1889) 177; Golubev, Lectures on the Integration of the
# Equations of Motion of a Heavy Rigid Body about a Fixed Point, chapter III):
#
#     h = s + r²/2 + cγ1,   ℓ = 2(pγ1 + qγ2) + rγ3,   k² = |x1² − c(γ1 + iγ2)|²,   C = cℓ,   G = c²|γ|² − k²
#     R(x) = −x⁴ + 2h x² − 2C x + G,   R12 = −s² + 2h s − 2C p + G,   R̂ = 2h s² − 4C s p + 4G p² + C² − 2G h
#     w1 = −(R12 + |R(x1)|)/4q²,   w2 = R̂/(R12 + |R(x1)|),   w1 ≤ w2 the roots of −4q² w² − 2 R12 w + R̂
#
#     φ(w) = ((w + h)(w² + G) − C²/2)(w² − k²),   y_k² = −2 φ(w_k),   w1' = y1/(w1 − w2),   w2' = y2/(w2 − w1)
#
# h, ℓ², c², k² and the polynomials in w are rational.  φ has a multiple root where
# (1) k = 0: Delone's class; (2, 3) e = ℓ²/(2|γ|²) − h is k or −k; (4) the cubic has one (Appelrot's classes).


ORDERS = 5
"""Length of the power series in t at the start that determine phases and signs: zeros there have order 4 at most."""


class KovalevskayaLevel(Reduced):
    """The exact level of a start."""

    __slots__ = ()

    @property
    def energy(self) -> Fraction:
        """h."""
        (n1, n2), (w1, w2, w3), (g1, g2, _) = self.moment, self.omega, self.gamma
        return w1 * w1 + w2 * w2 + w3 * w3 / 2 + n1 * g1 + n2 * g2

    @property
    def area(self) -> Fraction:
        """ℓ."""
        (w1, w2, w3), (g1, g2, g3) = self.omega, self.gamma
        return 2 * (w1 * g1 + w2 * g2) + w3 * g3

    @property
    def fourth(self) -> Fraction:
        """k², Kovalevskaya's integral."""
        parameters = Parameters((2, 2, 1), (*self.moment, 0), 0)
        return Fraction(kovalevskaya(parameters, (*self.omega, *self.gamma), (0, 1, 2)))

    @property
    def weight(self) -> Fraction:
        """G."""
        return self.moment_square * self.gamma_square - self.fourth

    def cubic(self) -> fmpq_poly:
        """(w + h)(w² + G) − C²/2."""
        h, g = self.energy, self.weight
        return polynomial(h * g - self.moment_square * self.area**2 / 2, g, h, Fraction(1))

    def double(self) -> Fraction:
        """e = ℓ²/(2|γ|²) − h, the double root of φ on the levels (2, 3); needs γ ≠ 0."""
        return self.area**2 / (2 * self.gamma_square) - self.energy

    def separated(self, w: Fraction) -> Fraction:
        """c² (−4q² w² − 2 R12 w + R̂): 0 where w is w1 or w2, exactly, and > 0 between them."""
        s, square, constant = self.omega[0] ** 2 + self.omega[1] ** 2, self.moment_square, self.area
        h, g, p = self.energy, self.weight, self.along(self.omega)
        r12 = square * (-s * s + 2 * h * s - 2 * constant * p + g)
        lowest = square * (2 * h * s * s - 4 * constant * s * p + square * constant**2 - 2 * g * h) + 4 * g * p * p
        return -4 * self.across(self.omega) ** 2 * w * w - 2 * r12 * w + lowest


@dataclass(frozen=True, slots=True)
class PhiRoot:
    """A root of φ.  cubic: whether it is one of the cubic."""

    value: acb
    multiplicity: int
    cubic: bool


@dataclass(frozen=True, slots=True)
class WorkingStart:
    """The start at the working precision, in the frame of n = (c, 0, 0); series in t of length :data:`ORDERS`.

    lower: R̂, upper: R12 + |R|.  still: q = 0 exactly.
    """

    moment: arb
    energy: arb
    area: arb
    weight: arb
    motion: tuple[Any, ...]
    lower: Any
    upper: Any
    still: bool

    def state(self, velocity: Sequence[Any], length: int) -> tuple[BallLike, ...]:
        """The six components from series of p, q, r that are one longer than ``length``."""
        p, q, r = velocity
        with series_length(length + 1):
            upward = (2 * q.derivative() + p * r) / self.moment
            across = -r.derivative() / self.moment
        with series_length(length):
            along = (self.energy - p * p - q * q - r * r / 2) / self.moment
        return p, q, r, along, across, upward

    def above(self, variable: int, w: arb) -> arb:
        """w_k − w times something positive; k = 1 for variable 0."""
        if variable == 0:
            q = self.motion[1][0]
            return arb(-(self.upper[0] + 4 * q * q * w))
        return arb(self.lower[0] - w * self.upper[0])

    def inverses(self, mu: arb) -> tuple[Any, Any]:
        """Series of 1/(w1 − μ), 1/(w2 − μ), regular where q = 0."""
        q = self.motion[1]
        return -4 * q * q / (self.upper + 4 * mu * (q * q)), self.upper / (self.lower - mu * self.upper)


def roots(level: KovalevskayaLevel) -> list[PhiRoot]:
    """The roots of φ at the working precision, of multiplicity 1 or, on the levels (2, 3), once 2."""
    cubic, k, double = level.cubic(), ball(level.fourth).sqrt(), level.double()
    if double * double != level.fourth:
        return [*_simple(cubic), PhiRoot(acb(k), 1, False), PhiRoot(acb(-k), 1, False)]
    quadratic = cubic // polynomial(-double, Fraction(1))
    return [PhiRoot(acb(ball(double)), 2, True), *_simple(quadratic), PhiRoot(acb(ball(-double)), 1, False)]


def _simple(factor: fmpq_poly) -> list[PhiRoot]:
    """The roots of a factor of the cubic."""
    pairs: Any = factor.complex_roots()
    return [PhiRoot(acb(value), many, True) for value, many in pairs]


def start_of(level: KovalevskayaLevel) -> WorkingStart:
    """The start at the working precision."""
    c = ball(level.moment_square).sqrt()
    h, area, g = ball(level.energy), c * ball(level.area), ball(level.weight)
    with series_length(ORDERS):
        field = partial(heavy_top, Parameters((2, 2, 1), (c, arb(0), arb(0)), arb(0)))
        motion = tuple(solved(level.turned(), field))
        p, q = motion[:2]
        a, b, s = p * p - q * q, 2 * (p * q), p * p + q * q
        real, imaginary = b * b - a * a + 2 * h * a - 2 * area * p + g, 2 * (h * b - a * b - area * q)
        upper = -s * s + 2 * h * s - 2 * area * p + g + (real * real + imaginary * imaginary).sqrt()
        lower = 2 * h * s * s - 4 * area * (s * p) + 4 * g * (p * p) + (area * area - 2 * g * h)
    return WorkingStart(c, h, area, g, motion, lower, upper, level.across(level.omega) == 0)


def linear(start: WorkingStart, values: Sequence[acb]) -> tuple[list[acb], list[acb], acb_mat]:
    """α_j, β_j and 𝓜^−1, where P_j = α_j (X − e_j Z) + β_j Y and (X, Y, Z) = 𝓜^−1 P.

    values: the roots e_j of the cubic.  Raises Undecided where the working precision does not give the inverse.
    """
    alphas, betas = [], []
    for e in values:
        first, second = 2 * (start.energy + e), start.weight + e * e
        # the larger as a root, the other from α_j β_j = −C
        if abs(first).mid() > abs(second).mid():
            alphas.append(square_root(first))
            betas.append(-start.area / alphas[-1])
        else:
            betas.append(square_root(second))
            alphas.append(-start.area / betas[-1])
    try:
        return alphas, betas, acb_mat([[a, b, -a * e] for a, b, e in zip(alphas, betas, values, strict=True)]).inv()
    except ZeroDivisionError:
        raise Undecided from None


def square_root(value: acb) -> acb:
    """A square root whose ball is finite off 0, also on the negative axis."""
    return acb(0, 1) * (-value).sqrt() if value.real < 0 else value.sqrt()


def real_part(series: BallLike) -> Any:
    """The real part of a complex series."""
    length = current_length()
    return arb_series([coefficient(series, n).real for n in range(length)], prec=length)


Characteristic = tuple[tuple[int, int], tuple[int, int]]
Pair = tuple[acb, acb]

# the classes of A1, ..., A4 modulo 2, as (τ part | whole part)
_CYCLES: tuple[Characteristic, ...] = (((0, 0), (1, 0)), ((1, 0), (0, 0)), ((0, 0), (1, 1)), ((0, 1), (0, 0)))
_I = acb(0, 1)
_ELSEWHERE = 0.4375


def _plus(*characteristics: Characteristic) -> Characteristic:
    (a, b), (c, d) = ([sum(c[part][k] for c in characteristics) % 2 for k in (0, 1)] for part in (0, 1))
    return (a, b), (c, d)


def _number(characteristic: Characteristic) -> int:
    """The index among FLINT's theta functions."""
    (a, b), (c, d) = characteristic
    return 8 * a + 4 * b + 2 * c + d


def _odd(characteristic: Characteristic) -> bool:
    (a, b), (c, d) = characteristic
    return (a * c + b * d) % 2 == 1


_ETA = tuple(accumulate(_CYCLES, _plus, initial=_plus(_CYCLES[1], _CYCLES[3])))
"""η_1, ..., η_5."""
_PAIRS: tuple[tuple[int, int], ...] = ((0, 0), (0, 1), (1, 0), (1, 1))
(_DELTA,) = (d for d in product(_PAIRS, _PAIRS) if _odd(d) and all(_odd(_plus(d, eta)) for eta in _ETA))


@dataclass(frozen=True, slots=True)
class HyperellipticCurve:
    """y² = −2 Π (w − e_j), at one working precision.

    roots: e_j, sorted.  inverse: a^−1.  tau: τ, symmetric.
    """

    roots: tuple[acb, ...]
    inverse: acb_mat
    tau: acb_mat

    @classmethod
    def of(cls, values: Sequence[acb]) -> HyperellipticCurve:
        """Raises Undecided where the working precision does not exclude seven of eight choices of signs."""
        ordered = sorted(values, key=lambda e: (midpoint(e.real), midpoint(e.imag)))
        halves = [_between(ordered, k) for k in range(4)]
        possible = []
        for signs in product((1, -1), repeat=3):
            cycles = [halves[0], *((s * x, s * y) for s, (x, y) in zip(signs, halves[1:], strict=True))]
            (a, b), (c, d), (e, f), (g, h) = cycles
            try:
                inverse = acb_mat([[a, a + e], [b, b + f]]).inv()
            except ZeroDivisionError:
                continue
            tau = inverse * acb_mat([[c, g], [d, h]])
            y = [[tau[i, j].imag for j in (0, 1)] for i in (0, 1)]
            excluded = not (tau[0, 1] - tau[1, 0]).contains(0) or y[0][0] < 0 or y[0][0] * y[1][1] < y[0][1] * y[1][0]
            if not excluded:
                middle = (tau[0, 1] + tau[1, 0]) / 2
                possible.append((inverse, acb_mat([[tau[0, 0], middle], [middle, tau[1, 1]]])))
        return cls(tuple(ordered), *the_only(possible))

    def image(self, w: arb, y: arb) -> acb_mat:
        """∫ (dw/y, w dw/y) from ∞ to (w, y), modulo periods, times a^−1."""
        near = min(range(5), key=lambda j: float(abs(w - self.roots[j])))
        largest = max(float(abs(e)) for e in self.roots)
        if abs(float(w)) > 2 * largest:
            return self.inverse * acb_mat([[part] for part in _from_infinity(self.roots, w, y)])
        (a, b), (c, d) = _ETA[near]
        half = self.tau * acb_mat([[a], [b]]) + acb_mat([[c], [d]])
        return self.inverse * acb_mat([[part] for part in _from_root(self.roots, near, w, y)]) + half / 2


def _integrals(path: Any, others: Sequence[tuple[Any, Any]], factor: Any, lower: Any, upper: Any) -> Pair:
    """factor times the integrals of Π rsqrt and w Π rsqrt over the straight way; rest: (root, value of w − root)."""

    def integrand(weight: int, s: acb, analytic: bool) -> acb:
        w, product = path(s), acb(1)
        for root, scale in others:
            product *= ((w - root) / scale).rsqrt(analytic=analytic)
        return product * w if weight else product

    first, second = (factor * acb.integral(partial(integrand, weight), lower, upper) for weight in (0, 1))
    return first, second


def _between(roots: Sequence[acb], k: int) -> Pair:
    """A_(k+1), up to its sign: w = m + δ sin s."""
    middle, reach = (roots[k] + roots[k + 1]) / 2, (roots[k + 1] - roots[k]) / 2
    others = [(x, middle - x) for i, x in enumerate(roots) if i not in (k, k + 1)]
    factor = -2 * _I / square_root(acb(-2))
    for _, scale in others:
        factor /= square_root(scale)
    quarter = arb.pi() / 2
    return _integrals(lambda s: middle + reach * s.sin(), others, factor, -quarter, quarter)


def _from_root(roots: Sequence[acb], near: int, w: arb, y: arb) -> Pair:
    """∫ from e_near, the root nearest to w: w = e + (w − e) s²."""
    start = roots[near]
    step = w - start
    others = [(x, w - x) for i, x in enumerate(roots) if i != near]
    if y.is_zero() and step.contains(0):
        return acb(0), acb(0)
    factor = 2 * step / y
    if not factor.is_finite():
        # near a turning point: |y|² = 2 |w − e| Π |w − x|
        square = 2 * abs(step)
        for _, scale in others:
            square /= abs(scale)
        factor = acb(arb(0, square.sqrt().upper()), arb(0, square.sqrt().upper()))
    return _integrals(lambda s: start + step * s * s, others, factor, 0, 1)


def _from_infinity(roots: Sequence[acb], w: arb, y: arb) -> Pair:
    """∫ from ∞ for |w| > |e_j|: w/s² in the place of w."""

    def integrand(power: int, s: acb, analytic: bool) -> acb:
        result = s**power
        for root in roots:
            result *= ((w - root * s * s) / (w - root)).rsqrt(analytic=analytic)
        return result

    first, second = (acb.integral(partial(integrand, power), 0, 1) for power in (2, 0))
    return -2 * w * first / y, -2 * w * w * second / y


def separation(values: Sequence[acb]) -> arb:
    """The smallest distance of two roots over the largest root."""
    nearest = min((abs(a - b) for a, b in combinations(values, 2)), key=arb.mid)
    return nearest / max((abs(e) for e in values), key=arb.mid)


@dataclass(frozen=True, slots=True)
class ThetaMotion:
    """The motion of a level with five distinct roots at one working precision.

    origin, rate: z_0 and v.  rows: (number of θ, factor) for N, D and for r.
    """

    level: KovalevskayaLevel
    start: WorkingStart
    curve: HyperellipticCurve
    origin: acb_mat
    rate: acb_mat
    rows: tuple[tuple[tuple[int, acb], ...], ...]

    @classmethod
    def of(cls, level: KovalevskayaLevel) -> ThetaMotion:
        """The motion at the working precision; raises Undecided where that does not suffice, or roots coincide."""
        start, branch_points = start_of(level), roots(level)
        if any(root.multiplicity > 1 for root in branch_points):
            raise Undecided
        curve = HyperellipticCurve.of([root.value for root in branch_points])
        origin = acb_mat(2, 1)
        for w, y in points(start):
            origin += curve.image(w, y)
        rate = curve.inverse * acb_mat([[0], [1]])
        motion = cls(level, start, curve, origin, rate, ())
        cubic = [root.value for root in branch_points if root.cubic]
        indices = [next(i for i, e in enumerate(curve.roots) if e is value) for value in cubic]
        return replace(motion, rows=motion._rows(cubic, indices))

    def at(self, time: Fraction, length: int) -> list[Any]:
        """The six components at ``time``, numbers, or series in t of that length."""
        with series_length(length + 1):
            thetas = self._thetas(self.reduced(self.origin + self.rate * acb(ball(time * self.level.rate))))
            above, below, spin = (
                sum((thetas[number] * factor for number, factor in row), acb_series([0])) for row in self.rows
            )
            half = 1 / (2 * below)
            parts = above * half, thetas[_number(_DELTA)] * half * -_I, spin * half * (4 * _I)
            velocity = [real_part(part) for part in parts]
        with series_length(length):
            return self.level.restored(self.start.state(velocity, length))

    def reduced(self, z: acb_mat) -> acb_mat:
        """z modulo twice the periods."""
        tau = self.curve.tau
        y = arb_mat([[tau[i, j].imag for j in (0, 1)] for i in (0, 1)])
        parts = (y.inv() * arb_mat([[z[0, 0].imag], [z[1, 0].imag]])).entries()
        z = z - tau * acb_mat([[2 * nearest_integer(part / 2)] for part in parts])
        return z - acb_mat([[2 * nearest_integer(z[i, 0].real / 2)] for i in (0, 1)])

    def _thetas(self, z: acb_mat) -> list[Any]:
        """All 16 theta functions as series along v."""
        order = current_length() - 1
        jets, (first, second) = acb_mat.theta_jets(self.curve.tau, z, order), self.rate.entries()
        weights = [(n, first ** (n - i) * second**i) for n in range(order + 1) for i in range(n + 1)]
        thetas = []
        for number in range(jets.nrows()):
            row = [acb(0)] * (order + 1)
            for column, (n, weight) in enumerate(weights):
                row[n] += jets[number, column] * weight
            thetas.append(acb_series(row, prec=current_length()))
        return thetas

    def _rows(self, values: Sequence[acb], indices: Sequence[int]) -> tuple[tuple[tuple[int, acb], ...], ...]:
        """N, D and r as combinations of theta functions."""
        alphas, betas, inverse = linear(self.start, values)
        none = _number(_DELTA)
        single = [_number(_plus(_DELTA, _ETA[k])) for k in indices]
        with series_length(ORDERS):
            thetas = self._thetas(self.origin)
            p, q = (acb_series(x) for x in self.start.motion[:2])
            kappas = []
            for number, a, b, e in zip(single, alphas, betas, values, strict=True):
                numerator = ((p * p + q * q - e) * a + 2 * p * b) * thetas[none] * acb(0, -0.5)
                kappas.append(_ratio(numerator, q * thetas[number]))
        above, below = (
            tuple((number, inverse[row, j] * kappas[j]) for j, number in enumerate(single)) for row in (1, 2)
        )
        spin = []
        with series_length(2):
            # constants may be taken anywhere: off the start, which may be special
            thetas = self._thetas(self.reduced(self.origin + self.rate * acb(arb(_ELSEWHERE))))
            for i, j in combinations(range(3), 2):
                pair_number = _number(_plus(_DELTA, _ETA[indices[i]], _ETA[indices[j]]))
                first, second = thetas[single[i]], thetas[single[j]]
                constant = (first[1] * second[0] - first[0] * second[1]) / (thetas[none][0] * thetas[pair_number][0])
                weight = above[i][1] * below[j][1] - above[j][1] * below[i][1]
                spin.append((pair_number, weight * constant))
        return above, below, tuple(spin)


def points(start: WorkingStart) -> list[tuple[arb, arb]]:
    """(w_k, y_k) at t = 0, omitting an infinite w1."""
    with series_length(ORDERS):
        square = 4 * start.motion[1] * start.motion[1]
        second = start.lower / start.upper
        slope = second.derivative()
        if start.still:
            # w2' goes to 0 like q², to second order in t
            return [(second[0], slope[2] / square[2] * start.upper[0])]
        first = -start.upper / square
        apart = (first - second)[0]
        return [(first[0], first.derivative()[0] * apart), (second[0], -slope[0] * apart)]


def _ratio(left: Any, right: Any) -> acb:
    """left/right of two proportional series, from the largest coefficient."""
    best = max(range(ORDERS), key=lambda n: abs(coefficient(right, n)).lower())
    if right[best].contains(0):
        raise Undecided
    return acb(left[best] / right[best])
