"""A variable that leaves and approaches a double root of a polynomial, and its Abel integrals with a proven error.

Between a simple root o and a double root e of f = |v − o| (v − e)² g, L = e − o,

    v = o + L tanh² X = e − L sech² X,   dv/√f = ± h dX,   h = 2/√(|L| g) > 0

X runs over all real numbers, monotone in t, and v goes from e to o, where X = 0, and back to e.  With y = tanh X

    F_j(X) = ∫_0^X v^j h dX = φ_j X + ∫_0^y (v^j h − φ_j)/(1 − y²) dy,   φ_j = v^j h at v = e,

where the last integrand is q_j = −L times the divided difference of v^j h at v and e: regular, and a function of
y² alone.  In y = sin χ, v = m − (L/2) cos 2χ is the map of :mod:`heavytop.exact.gaps`, so with q_j = Σ b_n cos 2nχ

    ∫ q_j dy = Σ ½ b_n (sin (2n + 1)χ/(2n + 1) + sin (2n − 1)χ/(2n − 1)),   χ = 2 atan tanh(X/2)

and the error of b_n is that of a Fourier series there.  On |Im 2χ| = η, |e − v| ≥ ½ |L| (cosh η − 1), so that
|q_j| ≤ 4 W_j/(cosh η − 1) for a bound W_j of |v^j h|, inside too by the maximum principle.
"""

from __future__ import annotations

from math import atan, tanh
from typing import Any

import numpy as np
from flint import arb, arb_poly
from numpy.typing import NDArray

from heavytop.exact.closed_form import tanh_sech
from heavytop.exact.gaps import MOST_TERMS, FourierBound, Roots, SineSums, even_rows, significant


class Approach:
    """A variable between a simple root ``turning`` and a double root ``limit``.

    rest: g.  count: how many integrals.  most: as in :class:`heavytop.exact.gaps.Gap`.
    """

    turn = 1.0
    periodic = False

    def __init__(self, turning: arb, limit: arb, rest: Roots, count: int = 2, most: int = MOST_TERMS) -> None:
        self.turning, self.limit, self.length = turning, limit, limit - turning
        self.root = abs(self.length).sqrt()
        self.rest = rest.scaled(abs(self.length) / 4)
        self.density = self.rest.density
        self.middle = (turning + limit) / 2
        bound = FourierBound(self.middle, abs(self.length) / 2, self.rest, divided=True)
        self.terms = bound.terms(most)
        rates = [self.density(limit)]
        for _ in range(count - 1):
            rates.append(limit * rates[-1])
        self.column = rates
        sines = [_sines(row) for row in self._rows(count)]
        self.errors = [bound.mean_error(self.terms, j) + bound.sum_error(self.terms, j) for j in range(count)]
        self.sums = SineSums(sines)
        self._floats = significant(np.array([[float(a) for a in row] for row in sines]))
        self._orders = np.arange(1, self._floats.shape[1] + 1)
        self._rate_floats = np.array([float(rate) for rate in rates])

    def _rows(self, count: int) -> list[list[arb]]:
        """Fourier coefficients of q_j, as means of q_j cos 2nχ."""
        polynomial = self.rest.polynomial(self.limit)
        quotient = _divided(polynomial, self.limit)
        at_limit = self.column[0]

        def values(v: arb) -> list[arb]:
            here = self.density(v)
            # 1/√a − 1/√b = (b − a)/(√a √b (√a + √b))
            found = [-quotient(v) * here * at_limit / (1 / here + 1 / at_limit)]
            value = at_limit
            for _ in range(count - 1):
                found.append(v * found[-1] + value)
                value = value * self.limit
            return [-self.length * part for part in found]

        return even_rows(lambda cosine: values(self.turning + self.length * (1 - cosine) / 2), self.terms)

    def position(self, phase: Any) -> Any:
        """See :class:`heavytop.exact.abel.Variable`."""
        ratio, _ = tanh_sech(phase)
        return self.turning + self.length * (ratio * ratio)

    def ends(self, phase: Any) -> tuple[Any, Any]:
        """See :class:`heavytop.exact.abel.Variable`."""
        ratio, rest = tanh_sech(phase)
        turning, limit = self.root * ratio, self.root * rest
        return (turning, limit) if self.length > 0 else (limit, turning)

    def bend(self, phase: Any) -> Any:
        """See :class:`heavytop.exact.abel.Variable`."""
        _, rest = tanh_sech(phase)
        return rest * (-2 if self.length > 0 else 2)

    def phase(self, v: arb, slope: arb) -> arb:
        """X from v and dv/dX = 2L sech² X tanh X."""
        left = self.limit - v
        return (slope / (2 * left) * (self.length / left).sqrt()).asinh()

    def integrals(self, phase: arb) -> list[arb]:
        """See :class:`heavytop.exact.abel.Variable`."""
        sums = self.sums.at(2 * (phase / 2).tanh().atan())
        return [c * phase + total + e for c, total, e in zip(self.column, sums, self.errors, strict=True)]

    def estimates(self, phase: float) -> NDArray[np.float64]:
        """See :class:`heavytop.exact.abel.Variable`."""
        angle = 2 * atan(tanh(phase / 2))
        found: NDArray[np.float64] = self._rate_floats * phase + self._floats @ np.sin(self._orders * angle)
        return found


def _sines(means: list[arb]) -> list[arb]:
    """The coefficients of sin χ, sin 2χ, ... of ∫ q dy, from the means of q cos 2nχ."""
    cosines = [means[0], *(2 * mean for mean in means[1:])]
    found = []
    for k, (one, two) in enumerate(zip(cosines, [*cosines[1:], arb(0)], strict=True)):
        found += [((2 * one if k == 0 else one) + two) / (2 * (2 * k + 1)), arb(0)]
    return found


def _divided(polynomial: arb_poly, place: arb) -> arb_poly:
    """(g(v) − g(e))/(v − e) as a polynomial in v, by Horner's scheme."""
    found: list[arb] = []
    value = arb(0)
    for coefficient in reversed(polynomial.coeffs()[1:]):
        value = value * place + coefficient
        found.append(value)
    return arb_poly(found[::-1])
