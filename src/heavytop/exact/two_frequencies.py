"""The integral of a function on a torus along a straight line: Fourier series of two frequencies with a proven error.

On the angles φ1, φ2, which grow at the rates ω1, ω2, let K = Σ a(φ1) D(φ1, φ2) b(φ2), where D is even in both angles
and a and b are even or odd, 2π-periodic or turned into their negatives by 2π.  With f, g of cos νφ and sin νφ, ν whole
or half whole, K is a sum of c f(φ1) g(φ2), and along the line

    c f g = d/ds [c (f ġ − ḟ g)/(ω1²ν1² − ω2²ν2²)],   ḟ = ω1 df/dφ1,  ġ = ω2 dg/dφ2.

Terms near a resonance, ω1ν1 = ω2ν2 but for 10^-7 of it, are integrated from the start of the line as they stand:

    ∫_0^s cos(χ + xs') ds' = s cos(χ + xs/2) sin(xs/2)/(xs/2),   x = ω1ν1 ± ω2ν2,

so that no divisor is small.  c comes from n1 × n2 values at φ = (i + ½) π/n.  Where |K| ≤ W on |Im φ_k| ≤ η_k, the
coefficients of e^(i(ν1φ1 + ν2φ2)) are at most W e^(−η1|ν1| − η2|ν2|); at these points every ν ≥ n takes the values of
one below, or vanishes, so that K is off by at most twice the sum of those left out,

    4W Σ_k e^(−η_k n_k) (1 + e^(−η_o))/((1 − e^(−η1)) (1 − e^(−η2))),   o the other angle,

and its integral by |s| times that, resonances or not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, expm1, log
from typing import NamedTuple, Self

from flint import arb, arb_mat, fmpq

from heavytop.errors import OutOfReach
from heavytop.exact.flint_context import current_precision

_RESONANT, _NARROWEST = 1e-7, 1e-9
_MOST_WORK = 1 << 27
"""Multiplications of the two transforms, n1 n2 (n1 + n2): some seconds."""


class Symmetry(NamedTuple):
    """Of a function of one angle: odd, and turned into its negative by 2π."""

    odd: bool
    half: bool

    def orders(self, count: int) -> list[int]:
        """The first 2ν."""
        return [2 * m + (1 if self.half else 2 if self.odd else 0) for m in range(count)]

    def values(self, twice: int, angle: arb) -> tuple[arb, arb]:
        """f and df/dφ of the order ``twice``/2."""
        sine, cosine = (angle * twice / 2).sin_cos()
        return (sine, cosine * twice / 2) if self.odd else (cosine, -sine * twice / 2)


class Factor(NamedTuple):
    """a or b at the points."""

    symmetry: Symmetry
    values: Sequence[arb]

    def transform(self) -> arb_mat:
        """Takes the values of D at the points to the coefficients of the product."""
        count = len(self.values)
        cosines = [arb.cos_pi_fmpq(fmpq(k, 4 * count)) for k in range(8 * count)]
        shift, rows = 2 * count if self.symmetry.odd else 0, []
        for twice in self.symmetry.orders(count):
            weight = arb(1 if twice in (0, 2 * count) else 2) / count
            weights = [weight * value for value in self.values]
            rows.append([w * cosines[(twice * (2 * i + 1) - shift) % (8 * count)] for i, w in enumerate(weights)])
        return arb_mat(rows)


def points(count: int) -> list[arb]:
    """φ in (0, π)."""
    return [arb.pi() * (2 * i + 1) / (2 * count) for i in range(count)]


def counts(widths: Sequence[arb | None]) -> tuple[int, int]:
    """n1, n2 with an error of K below W times the working precision; widths: η, None for an angle at rest.

    Raises OutOfReach where they are too many.
    """
    floats = [None if width is None else max(float(width), _NARROWEST) for width in widths]
    wanted = (current_precision() + 6) * log(2) - sum(log(-expm1(-width)) for width in floats if width)
    first, second = (1 if width is None else max(4, ceil(wanted / width)) for width in floats)
    if first * second * (first + second) > _MOST_WORK:
        raise OutOfReach(
            f"The azimuth needs {first} x {second} Fourier terms: the level is nearly degenerate.",
            "Ask for fewer digits, or take a start farther from the degenerate motion.",
        )
    return first, second


def error_of(largest: arb, widths: Sequence[arb | None], terms: Sequence[int]) -> arb:
    """The bound on what K is off by; largest: W."""
    sums, tails = [], []
    for width, count in zip(widths, terms, strict=True):
        decay = arb(0) if width is None else (-width).exp()
        sums.append((1 + decay) / (1 - decay))
        tails.append(arb(0) if width is None else 2 * (-width * count).exp() / (1 - decay))
    return 2 * largest * (tails[0] * sums[1] + sums[0] * tails[1])


class Resonance(NamedTuple):
    """A term c f(φ1) g(φ2) that is integrated as it stands; twice: 2ν of both."""

    coefficient: arb
    twice: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Product:
    """One a(φ1) D b(φ2).

    matrix: c over ω1²ν1² − ω2²ν2², and 0 for ``resonances``.
    """

    symmetries: tuple[Symmetry, Symmetry]
    matrix: arb_mat
    resonances: tuple[Resonance, ...]

    @classmethod
    def of(cls, first: Factor, kernel: arb_mat, second: Factor, rates: Sequence[arb], largest: arb) -> tuple[Self, arb]:
        """With a bound on the terms that are left out as too small; largest: W, rates: ω1, ω2."""
        table = (first.transform() * kernel * second.transform().transpose()).tolist()
        smallest, dropped = largest * arb(2) ** (8 - current_precision()), arb(0)
        sizes = [[abs(c).upper() for c in row] for row in table]
        tall = max((m for m, row in enumerate(sizes, 1) if any(size > smallest for size in row)), default=1)
        wide = max((n for row in sizes for n, size in enumerate(row, 1) if size > smallest), default=1)
        for m, row in enumerate(sizes):
            dropped += sum(row[wide:] if m < tall else row, arb(0))
        symmetries = first.symmetry, second.symmetry
        orders = symmetries[0].orders(tall), symmetries[1].orders(wide)
        speeds = [[rate * twice / 2 for twice in own] for rate, own in zip(rates, orders, strict=True)]
        squares, floats = [[x * x for x in own] for own in speeds], [[float(x) for x in own] for own in speeds]
        rows, resonances = [], []
        for m, (square, size) in enumerate(zip(squares[0], floats[0], strict=True)):
            row = []
            for n, (other, length) in enumerate(zip(squares[1], floats[1], strict=True)):
                if abs(size - length) > _RESONANT * (size + length):
                    row.append(table[m][n] / (square - other))
                else:
                    row.append(arb(0))
                    resonances.append(Resonance(table[m][n], (orders[0][m], orders[1][n])))
            rows.append(row)
        return cls(symmetries, arb_mat(rows), tuple(resonances)), dropped

    def primitive(self, angles: Sequence[arb], rates: Sequence[arb]) -> arb:
        """Σ c (f ġ − ḟ g)/(ω1²ν1² − ω2²ν2²)."""
        pairs = []
        for symmetry, angle, rate, count in zip(
            self.symmetries, angles, rates, (self.matrix.nrows(), self.matrix.ncols()), strict=True
        ):
            values = [symmetry.values(twice, angle) for twice in symmetry.orders(count)]
            pairs.append(([f for f, _ in values], [rate * slope for _, slope in values]))
        (f, f_rate), (g, g_rate) = pairs
        along = arb_mat([f, f_rate]) * self.matrix * arb_mat([g, g_rate]).transpose()
        return along[0, 1] - along[1, 0]

    def resonant(self, began: Sequence[arb], rates: Sequence[arb], length: arb) -> arb:
        """The integral of the resonances over a line of that length that begins at the angles ``began``."""
        total = arb(0)
        for coefficient, twice in self.resonances:
            phases = [
                n * angle / 2 - (arb.pi() / 2 if symmetry.odd else 0)
                for n, angle, symmetry in zip(twice, began, self.symmetries, strict=True)
            ]
            for side in (1, -1):
                half = (rates[0] * twice[0] + side * rates[1] * twice[1]) * length / 4
                total += coefficient / 2 * (phases[0] + side * phases[1] + half).cos() * half.sinc()
        return total * length


@dataclass(frozen=True, slots=True)
class LineIntegral:
    """∫ K along φ_k = φ_k(0) + ω_k s.

    error: a bound on what K is off by.
    """

    products: tuple[Product, ...]
    rates: Sequence[arb]
    began: Sequence[arb]
    error: arb

    @classmethod
    def of(
        cls,
        pairs: Sequence[tuple[Factor, Factor]],
        kernel: arb_mat,
        rates: Sequence[arb],
        began: Sequence[arb],
        largest: arb,
        error: arb,
    ) -> Self:
        """From the pairs (a, b) and D at the points, W and the error of each pair."""
        found = [Product.of(first, kernel, second, rates, largest) for first, second in pairs]
        dropped = sum((part for _, part in found), arb(0))
        return cls(tuple(product for product, _ in found), rates, began, dropped + len(found) * error)

    def at(self, angles: Sequence[arb], length: arb) -> arb:
        """The integral to the angles, which the line reaches after ``length``, but for a constant."""
        total = arb(0, (self.error * abs(length)).upper())
        for product in self.products:
            total += product.primitive(angles, self.rates) + product.resonant(self.began, self.rates, length)
        return total
