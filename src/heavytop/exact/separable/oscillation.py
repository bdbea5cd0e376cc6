"""A variable that oscillates between two simple real roots of a polynomial, and its Abel integrals with error bounds.

    v = m + d cos θ,   m = (lo + hi)/2,   d = (hi − lo)/2,   f(v) = (v − lo)(hi − v) g(v),   g > 0 on [lo, hi]

The phase θ of a motion in the gap is monotone and regular, turning points included.  Abel's integrals

    F_j(θ) = ∫_0^θ v^j/√g dθ = c_0 θ + Σ (2c_n/n) sin nθ

grow by a real period per turn.  Their integrand h is even and 2π-periodic, and analytic on |Im θ| ≤ η as long as
v, which runs through ellipses there, leaves every other root b outside: η < β = |Im arccos z|, z = (b − m)/d, and

    |v − b| ≥ d (cosh β − cosh η),   cosh β = ½ (|z + 1| + |z − 1|),

since cos θ − z is a product of two sines and |sin(x + iy)| ≥ sinh|y|.  That gives a bound W of |h|, and
|c_n| ≤ W e^(−η|n|).  From N equidistant values come c_n, n < N/2, with an error of at most
2W e^(−η(N − n))/(1 − e^(−ηN)) (aliasing); F, cut at n = N/2, is off by at most

    (4/(1 − e^(−ηN)) + 2) W e^(−ηN/2)/(1 − e^(−η)),   the error of c_0 apart.

Sums are products of matrices and vectors of cos jθ, sin jθ: Horner's rule at the ball e^(iθ) would lose a factor √2
with every degree.  Source: Trefethen and Weideman, SIAM Review 56 (2014), theorem 3.1, for the error.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil, isfinite, isqrt, log, pi
from typing import Any

from flint import acb, arb, arb_mat, arb_poly, fmpq

from heavytop.errors import OutOfReach
from heavytop.exact.closed_form import WithXi, cached_per_precision, constant, tanh_sech
from heavytop.exact.flint.balls import Balls, current_precision, working_precision
from heavytop.precision import cross, dot

MOST_TERMS = 1 << 17
_FEW_TERMS = 512
_WIDTH, _FARTHEST, _BOUND_BITS = 0.9, 100, 64


@dataclass(frozen=True, slots=True)
class Roots:
    """g(v) = lead Π |v − b|^multiplicity.

    lead: > 0.  real: (b, multiplicity).  pairs: (Re b, |Im b|, multiplicity), once for b and its conjugate.
    """

    lead: arb
    real: tuple[tuple[arb, int], ...]
    pairs: tuple[tuple[arb, arb, int], ...]

    @classmethod
    def of(cls, lead: arb, roots: Sequence[tuple[acb, int]]) -> Roots:
        """From all roots of a real polynomial; a root is real where its imaginary part is exactly 0."""
        real = tuple((b.real, many) for b, many in roots if b.imag.is_zero())
        return cls(lead, real, tuple((b.real, b.imag, many) for b, many in roots if b.imag > 0))

    def density(self, v: Any) -> Any:
        """1/√g at a number or series v; not finite where g may vanish."""
        product = self.lead
        for b, many in self.real:
            product = product * (v - b) ** many
        for x, y, many in self.pairs:
            product = product * ((v - x) * (v - x) + y * y) ** many
        return (-product if constant(product) < 0 else product).rsqrt()

    def with_line(self, slope: arb) -> Roots:
        """(slope v − 1)² g; not finite where ``slope`` may be 0, and is not."""
        if slope.is_zero():
            return self
        return replace(self, lead=self.lead * slope * slope, real=(*self.real, (1 / slope, 2)))

    def scaled(self, factor: arb) -> Roots:
        """factor · g."""
        return replace(self, lead=self.lead * factor)

    def polynomial(self, point: arb) -> arb_poly:
        """g as a polynomial, with the sign that makes it positive at ``point``."""
        product = arb_poly([self.lead])
        for b, many in self.real:
            product *= arb_poly([-b, 1]) ** many
        for x, y, many in self.pairs:
            product *= arb_poly([x * x + y * y, -2 * x, 1]) ** many
        return -product if product(point) < 0 else product

    def all(self) -> list[tuple[acb, int]]:
        """Every b; of a pair the one above the real axis, with twice its multiplicity."""
        return [(acb(b), many) for b, many in self.real] + [(acb(x, y), 2 * many) for x, y, many in self.pairs]


class SineSums:
    """Σ_n a_n sin nθ, n ≥ 1, for several rows of coefficients at once, cut where the working precision allows."""

    def __init__(self, rows: Sequence[Sequence[arb]]) -> None:
        self.rows = rows
        self.sizes = [max(abs(a).upper() for a in column) for column in zip(*rows, strict=True)]
        self._seen: dict[int, _SeenSums] = {}

    def at(self, angle: arb) -> list[arb]:
        """Each sum at the angle, at the working precision."""
        bits = current_precision()
        if bits not in self._seen:
            smallest = max(self.sizes) * arb(2) ** (-bits - 8)
            count = max((n for n, size in enumerate(self.sizes, 1) if not size < smallest), default=1)
            tails = [arb(0, sum((abs(a).upper() for a in row[count:]), arb(0)).upper()) for row in self.rows]
            self._seen[bits] = _SeenSums([[+a for a in row[:count]] for row in self.rows], tails)
        return self._seen[bits].at(angle)


class _SeenSums:
    """The leading terms of the sums, short sums as polynomials in e^iθ; tails: balls that contain the others."""

    def __init__(self, rows: Sequence[Sequence[arb]], tails: Sequence[arb]) -> None:
        length, self.tails = len(rows[0]) + 1, tails
        self.polynomials = [arb_poly([0, *row]) for row in rows] if length <= _FEW_TERMS else []
        if self.polynomials:
            return
        self.small = max(1, isqrt(length))
        self.large = -(-length // self.small)
        size = self.small * self.large
        padded = [[arb(0), *row, *[arb(0)] * (size - length)] for row in rows]
        self.matrix = arb_mat([row[i : i + self.small] for row in padded for i in range(0, size, self.small)])

    def at(self, angle: arb) -> list[arb]:
        """Each sum at the angle: sin(l + j)θ = sin lθ cos jθ + cos lθ sin jθ."""
        if self.polynomials:
            sine, cosine = angle.sin_cos()
            point = acb(cosine, sine)
            pairs = zip(self.polynomials, self.tails, strict=True)
            return [polynomial(point).imag + tail for polynomial, tail in pairs]
        steps = [(angle * j).sin_cos() for j in range(self.small)]
        inner = self.matrix * arb_mat([[cosine, sine] for sine, cosine in steps])
        leaps = [(angle * (i * self.small)).sin_cos() for i in range(self.large)]
        rows = arb_mat(inner.nrows() // self.large, 2 * self.large, inner.entries())
        sums = (rows * arb_mat(2 * self.large, 1, [part for pair in leaps for part in pair])).entries()
        return [value + tail for value, tail in zip(sums, self.tails, strict=True)]


class Gap:
    """A variable between two simple real roots ``lo`` < ``hi``.

    rest: g.  count: the number of integrals, j = 0 .. count − 1.  most: the largest number of Fourier terms at the
    working precision, beyond which OutOfReach is raised.
    """

    turn = 2 * pi
    periodic = True

    def __init__(self, lo: arb, hi: arb, rest: Roots, count: int = 2, most: int = MOST_TERMS) -> None:
        self.middle, self.reach, self.rest = (lo + hi) / 2, (hi - lo) / 2, rest
        self.density = rest.density
        bound = FourierBound(self.middle, self.reach, rest)
        self.terms = bound.terms(most)
        rows = fourier_rows(self.middle, self.reach, rest, self.terms, count)
        self.means = [row[0] + bound.mean_error(self.terms, j) for j, row in enumerate(rows)]
        self.errors = [bound.sum_error(self.terms, j) for j in range(count)]
        sines = [[2 * c / n for n, c in enumerate(row[1:], 1)] for row in rows]
        self.sums = SineSums(sines)

    @property
    def column(self) -> list[arb]:
        """The real periods."""
        return [2 * arb.pi() * mean for mean in self.means]

    def position(self, phase: Balls) -> Balls:
        return self.middle + self.reach * phase.cos()

    def ends(self, phase: Balls) -> tuple[Balls, Balls]:
        """√(v − lo) and √(hi − v) with signs that make them analytic: √(2d) cos(θ/2), √(2d) sin(θ/2)."""
        sine, cosine = (phase / 2).sin_cos()
        root = (2 * self.reach).sqrt()
        return root * cosine, root * sine

    def bend(self, phase: Balls) -> Balls:
        """−dv/dθ over the product of :meth:`ends`."""
        return phase * 0 + 1

    def phase(self, v: arb, slope: arb) -> arb:
        """θ in (−π/2, 3π/2) from v and dv/dθ."""
        cosine, sine = v - self.middle, -slope
        if cosine > 0:
            return arb.atan2(sine, cosine)
        return arb.pi() + arb.atan2(-sine, -cosine)

    def integrals(self, phase: arb) -> list[arb]:
        sums = self.sums.at(phase)
        return [c * phase + total + e for c, total, e in zip(self.means, sums, self.errors, strict=True)]


class FourierBound:
    """Error bounds of the Fourier series of v^j/√g, as in the head of this file.

    divided: of (v^j/√g − its value at an end)/(1 − y²).
    """

    def __init__(self, middle: arb, reach: arb, rest: Roots, divided: bool = False) -> None:
        self.bits = current_precision()
        with working_precision(_BOUND_BITS):
            heights = [(_cosh((b - middle) / reach), many) for b, many in rest.all()]
            nearest = min((height.lower() for height, _ in heights), default=arb(_FARTHEST))
            self.distance = float(nearest - 1)
            self.width = (nearest.acosh() * _WIDTH).lower()
            square = rest.lead
            for height, many in heights:
                square = square * (reach * (height - self.width.cosh())) ** many
            self.largest = square.rsqrt()
            if divided:
                self.largest *= 4 / (self.width.cosh() - 1)
            self.farthest = abs(middle) + reach * self.width.cosh()
            excess = 7 * self.largest / (rest.density(middle) * (1 - (-self.width).exp()))
            self.wanted = float(2 * (excess.log() + self.bits * log(2)) / self.width)

    def terms(self, most: int) -> int:
        """N, 2^k or 3·2^k, with an error of the sums below the working precision."""
        if not self.wanted <= most:
            many = f"{self.wanted:.3g}" if isfinite(self.wanted) else "infinitely many"
            raise OutOfReach(
                f"Abel's integrals need {many} Fourier terms, more than {most}: the level is degenerate to within "
                f"{abs(self.distance):.2g}, the distance of a root from an oscillation interval.",
                "Request fewer digits, or choose a start farther from the degenerate level.",
            )
        power = max(32, 1 << ceil(self.wanted).bit_length())
        return power // 4 * 3 if power // 4 * 3 >= self.wanted else power

    def mean_error(self, terms: int, order: int) -> arb:
        """A ball around 0 that contains the error of c_0."""
        return self._ball(2 * (-self.width * terms).exp() / (1 - (-self.width * terms).exp()), order)

    def sum_error(self, terms: int, order: int) -> arb:
        """A ball around 0 that contains the error of F, without that of c_0."""
        tail = (-self.width * terms / 2).exp() / (1 - (-self.width).exp())
        return self._ball((4 / (1 - (-self.width * terms).exp()) + 2) * tail, order)

    def _ball(self, factor: arb, order: int) -> arb:
        return arb(0, (factor * self.largest * self.farthest**order).upper())


def distance_of_others(points: Sequence[acb], ends: tuple[int, int]) -> arb:
    """cosh β − 1 of the root nearest to the gap between two of the points; 0 for no gap."""
    low, high = (points[i].real for i in ends)
    if not low < high:
        return arb(0)
    scaled = [(2 * b - low - high) / (high - low) for i, b in enumerate(points) if i not in ends]
    return min((_cosh(z) - 1 for z in scaled), key=arb.mid)


def _cosh(z: acb) -> arb:
    """cosh of |Im arccos z|, at least 1."""
    return (abs(z + 1) + abs(z - 1)) / 2


def fourier_rows(middle: arb, reach: arb, rest: Roots, terms: int, count: int) -> list[list[arb]]:
    """c_n, n < N/2, of v^j/√g, j < count, from ``terms`` = N values; the error of aliasing is not included."""

    def values(cosine: arb) -> list[arb]:
        v = middle + reach * cosine
        values = [rest.density(v)]
        for _ in range(count - 1):
            values.append(v * values[-1])
        return values

    return even_rows(values, terms)


def even_rows(values: Callable[[arb], list[arb]], terms: int) -> list[list[arb]]:
    """c_n, n < N/2, of several functions of cos θ from ``terms`` = N values, 4 | N, without the error of aliasing."""
    half = terms // 2
    cosines = [arb.cos_pi_fmpq(fmpq(i, half)) for i in range(half + 1)]
    samples = list(zip(*map(values, cosines), strict=True))
    rows: list[list[arb]] = []
    for even, odd in zip(samples[::2], [*samples[1::2], samples[-1]], strict=False):
        # all coefficients are real, so two functions fit into one transform
        values_of_both = [acb(a, b) for a, b in zip(even, odd, strict=True)]
        product = acb.dft(values_of_both + values_of_both[-2:0:-1])[:half]
        rows += [[c.real / terms for c in product], [c.imag / terms for c in product]]
    return rows[: len(samples)]


# A variable asymptotic to a double root of a polynomial, and its Abel integrals with error bounds.
#
# Between a simple root o and a double root e of f = |v − o| (v − e)² g, L = e − o,
#
#     v = o + L tanh² X = e − L sech² X,   dv/√f = ± h dX,   h = 2/√(|L| g) > 0
#
# X runs over all real numbers, monotone in t, and v goes from e to o, where X = 0, and back to e.  With y = tanh X
#
#     F_j(X) = ∫_0^X v^j h dX = φ_j X + ∫_0^y (v^j h − φ_j)/(1 − y²) dy,   φ_j = v^j h at v = e,
#
# where the last integrand is q_j = −L times the divided difference of v^j h at v and e: regular, and a function of
# y² alone.  In y = sin χ, v = m − (L/2) cos 2χ is the map above, so with q_j =
# Σ b_n cos 2nχ
#
#     ∫ q_j dy = Σ ½ b_n (sin (2n + 1)χ/(2n + 1) + sin (2n − 1)χ/(2n − 1)),   χ = 2 atan tanh(X/2)
#
# and the error of b_n is that of a Fourier series there.  On |Im 2χ| = η, |e − v| ≥ ½ |L| (cosh η − 1), so that
# |q_j| ≤ 4 W_j/(cosh η − 1) for a bound W_j of |v^j h|, inside too by the maximum principle.


class Approach:
    """A variable between a simple root ``turning`` and a double root ``limit``.

    rest: g.  count: the number of integrals.  most: as in :class:`heavytop.exact.separable.oscillation.Gap`.
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

    def _rows(self, count: int) -> list[list[arb]]:
        """Fourier coefficients of q_j, as means of q_j cos 2nχ."""
        polynomial = self.rest.polynomial(self.limit)
        # (g(v) − g(e))/(v − e)
        quotient = polynomial // arb_poly([-self.limit, 1])
        at_limit = self.column[0]

        def values(v: arb) -> list[arb]:
            density = self.density(v)
            # 1/√a − 1/√b = (b − a)/(√a √b (√a + √b))
            values = [-quotient(v) * density * at_limit / (1 / density + 1 / at_limit)]
            value = at_limit
            for _ in range(count - 1):
                values.append(v * values[-1] + value)
                value = value * self.limit
            return [-self.length * part for part in values]

        return even_rows(lambda cosine: values(self.turning + self.length * (1 - cosine) / 2), self.terms)

    def position(self, phase: Balls) -> Balls:
        ratio, _ = tanh_sech(phase)
        return self.turning + self.length * (ratio * ratio)

    def ends(self, phase: Balls) -> tuple[Balls, Balls]:
        tanh, sech = tanh_sech(phase)
        turning, limit = self.root * tanh, self.root * sech
        return (turning, limit) if self.length > 0 else (limit, turning)

    def bend(self, phase: Balls) -> Balls:
        _, sech = tanh_sech(phase)
        return sech * (-2 if self.length > 0 else 2)

    def phase(self, v: arb, slope: arb) -> arb:
        """X from v and dv/dX = 2L sech² X tanh X."""
        distance = self.limit - v
        return (slope / (2 * distance) * (self.length / distance).sqrt()).asinh()

    def integrals(self, phase: arb) -> list[arb]:
        sums = self.sums.at(2 * (phase / 2).tanh().atan())
        return [c * phase + total + e for c, total, e in zip(self.column, sums, self.errors, strict=True)]


def _sines(means: list[arb]) -> list[arb]:
    """The coefficients of sin χ, sin 2χ, ... of ∫ q dy, from the means of q cos 2nχ."""
    cosines = [means[0], *(2 * mean for mean in means[1:])]
    sums = []
    for k, (cosine, following) in enumerate(zip(cosines, [*cosines[1:], arb(0)], strict=True)):
        sums += [((2 * cosine if k == 0 else cosine) + following) / (2 * (2 * k + 1)), arb(0)]
    return sums


# Attitude of a motion with a variable in one gap: the azimuth of a vector about the vertical is one more integral.
#
# Let h be the level part of a vector with known body components, and Λ its azimuth in space about γ.  Where Λ' = f(v)
# with a rational f of the variable v, Λ is an Abel integral over its phase: a polynomial over √g times the denominator
# of f, which counts as roots of multiplicity two.  It grows by a fixed angle per turn.  The vector fixed in space that
# is along h at t = 0 then makes the angle Λ(0) − Λ with h (:class:`WithBearing`).


@dataclass(frozen=True, slots=True)
class Azimuth:
    """Λ = Σ weights_j F_j of a gap whose roots hold the denominator of Λ'."""

    gap: Gap
    weights: tuple[arb, ...]

    def at(self, phase: arb, turns: int) -> arb:
        """Λ at the phase after whole turns."""
        parts = zip(self.weights, self.gap.integrals(phase), self.gap.column, strict=True)
        return sum((weight * (value + turns * period) for weight, value, period in parts), arb(0))


@dataclass(frozen=True, slots=True)
class Bearing:
    """h and γ × h, unit vectors in body components, and Λ at one time."""

    along: tuple[arb, ...]
    across: tuple[arb, ...]
    azimuth: arb

    @classmethod
    def of(cls, gamma: Sequence[arb], vector: Sequence[arb], azimuth: arb) -> Bearing:
        """The bearing of a vector whose level part is not 0; γ has any length."""
        square = dot(gamma, gamma)
        share = dot(vector, gamma) / square
        level = [v - share * g for v, g in zip(vector, gamma, strict=True)]
        length = dot(level, level).sqrt()
        along = [v / length for v in level]
        return cls(tuple(along), cross([g / square.sqrt() for g in gamma], along), azimuth)

    def carried(self, azimuth: arb) -> list[arb]:
        """Body components of the unit vector fixed in space that was along h when Λ was ``azimuth``."""
        sine, cosine = (self.azimuth - azimuth).sin_cos()
        return [cosine * a - sine * b for a, b in zip(self.along, self.across, strict=True)]


class WithBearing(WithXi):
    """A motion with an attitude from the bearing of one vector.

    A mixin of dataclasses that have ``made``.
    """

    __slots__ = ()

    @abstractmethod
    def bearing(self, time: Fraction) -> Bearing:
        """The bearing at FLINT's working precision.

        Raises Undecided where that does not suffice, OutOfReach where there is no formula of the azimuth.
        """

    def xi_at(self, time: Fraction) -> list[arb]:
        """ξ, along the level part of that vector at t = 0."""
        return self.bearing(time).carried(_began(self))


@cached_per_precision
def _began(case: WithBearing) -> arb:
    return case.bearing(Fraction(0)).azimuth
