"""Real Abel inversion: the phases of one or two variables at any time, from their integrals, proven.

Variables v_k that swing in gaps (:mod:`heavytop.exact.separable.oscillation`), with phases θ_k and integrals F_kj, j =
0 .. n − 1, move along a straight line in

    G_j(θ) = Σ_k ε_k F_kj(θ_k),   ε_k = ±1.

G is one-to-one from R^n onto R^n: its Jacobian is ε1 ε2 (v2 − v1)/√(g1 g2) ≠ 0 for disjoint gaps, and it differs from
a linear map by periodic functions (Hadamard's theorem).  :meth:`Inversion.phases` subtracts whole turns, and proves
the result of Newton's iteration by Krawczyk's operator (Neumaier, Interval Methods for Systems of Equations, 5.1).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, expm1, log
from typing import Any, NamedTuple, NoReturn, Self, TypeAlias

from flint import acb, arb, arb_mat, fmpq

from heavytop.errors import LevelNotDone, OutOfReach
from heavytop.exact.closed_form import solved
from heavytop.exact.flint.balls import (
    Balls,
    Undecided,
    current_precision,
    midpoint,
    nearest_integer,
    whole_evaluation,
    working_precision,
)
from heavytop.exact.separable.oscillation import Approach, Gap, Roots

_FEW_BITS = 53
_ITERATIONS, _SHORTEST, _SETTLED = 100, 1e-4, 1e-6
_REPEATED = 6


@dataclass(frozen=True, slots=True)
class Inversion:
    """G of one or two variables; signs: ε."""

    variables: tuple[Moving, ...]
    signs: tuple[int, ...]

    def values(self, phases: Sequence[arb]) -> list[arb]:
        """G."""
        shares = [v.integrals(phase) for v, phase in zip(self.variables, phases, strict=True)]
        return [
            sum((sign * part for sign, part in zip(self.signs, parts, strict=True)), arb(0))
            for parts in zip(*shares, strict=True)
        ]

    def slopes(self, phases: Sequence[arb]) -> arb_mat:
        """The Jacobian of G: a row for each j."""
        columns = []
        for variable, sign, phase in zip(self.variables, self.signs, phases, strict=True):
            v = variable.position(phase)
            columns.append([sign * variable.density(v)])
            for _ in self.variables[1:]:
                columns[-1].append(columns[-1][-1] * v)
        return arb_mat(columns).transpose()

    def _periods(self) -> arb_mat:
        """The growth of G per turn of each phase (per unit of a phase that is not periodic), a column for each."""
        columns = [[sign * c for c in v.column] for v, sign in zip(self.variables, self.signs, strict=True)]
        return arb_mat(columns).transpose()

    def mean_rates(self, slopes: Sequence[arb]) -> list[arb]:
        """Turns (or units) of each phase per unit of time, where G grows by ``slopes``."""
        return self._periods().solve(arb_mat([[slope] for slope in slopes])).entries()

    def phases(self, target: Sequence[arb]) -> tuple[list[arb], list[int]]:
        """(θ in the first turns, whole turns n) with G(θ + 2πn) = target: balls that contain the unique solution.

        Not finite where the working precision does not prove it.
        """
        count, periods = len(self.variables), self._periods()
        aim = arb_mat([[value] for value in target])
        unproven = [arb("nan")] * count, [0] * count
        try:
            cells = periods.solve(aim).entries()
        except ZeroDivisionError:
            return unproven
        if not all(cell.is_finite() for cell in cells):
            return unproven
        turns = [nearest_integer(cell) if v.periodic else 0 for v, cell in zip(self.variables, cells, strict=True)]
        remainder = aim - periods * arb_mat([[n] for n in turns])
        first = [(c - n) * v.turn for v, c, n in zip(self.variables, cells, turns, strict=True)]
        try:
            return self._refined(self._estimated(first, remainder), remainder), turns
        except ZeroDivisionError:
            return unproven

    def _defect(self, phases: Sequence[arb], target: arb_mat) -> arb_mat:
        return arb_mat([[value] for value in self.values(phases)]) - target

    def _estimated(self, phases: list[arb], target: arb_mat) -> list[arb]:
        """Newton's iteration in few bits, damped so that every step reduces the defect."""
        with working_precision(_FEW_BITS):
            now = [phase.mid() for phase in phases]
            defect = self._defect(now, target)
            for _ in range(_ITERATIONS):
                step, share, error = (self._inverse(now) * defect).entries(), arb(1), _size(defect)
                while True:
                    candidate = [(x - share * s).mid() for x, s in zip(now, step, strict=True)]
                    defect = self._defect(candidate, target)
                    if not _size(defect) > error or share < _SHORTEST:
                        break
                    share /= 2
                now = candidate
                if all(abs(s * share) < _SETTLED * (1 + abs(x)) for s, x in zip(step, now, strict=True)):
                    break
        return now

    def _refined(self, near: list[arb], target: arb_mat) -> list[arb]:
        """Newton's iteration at growing precision, and the proof at the last one."""
        needed, precisions = current_precision() // 2 + 8, []
        while needed > _FEW_BITS:
            precisions.append(needed)
            needed = needed // 2 + 8
        for precision in reversed(precisions):
            with working_precision(precision):
                for _ in range(_REPEATED):
                    step = (self._inverse(near) * self._defect(near, target)).entries()
                    near = [(x - s).mid() for x, s in zip(near, step, strict=True)]
                    # the next step would have the size of its square
                    if all(abs(s) < arb(2) ** (8 - precision // 2) for s in step):
                        break
        return self._proven(near, target)

    def _inverse(self, phases: list[arb]) -> arb_mat:
        return self.slopes(phases).inv().mid()

    def _proven(self, near: list[arb], target: arb_mat) -> list[arb]:
        """Krawczyk's image of a box around the phases, where it lies inside the box."""
        inverse = self._inverse(near)
        step = (inverse * self._defect(near, target)).entries()
        floor = arb(2) ** (-current_precision())
        for widening in (2, 16, 256):
            radii = [arb(0, (widening * (abs(s).upper() + floor)).upper()) for s in step]
            box = [x + o for x, o in zip(near, radii, strict=True)]
            spread = -(inverse * self.slopes(box))
            for i in range(len(near)):
                spread[i, i] += 1
            moved = (spread * arb_mat([[o] for o in radii])).entries()
            image = [x - s + m for x, s, m in zip(near, step, moved, strict=True)]
            if all(wide.contains_interior(narrow) for wide, narrow in zip(box, image, strict=True)):
                return image
        return [arb("nan")] * len(near)


def _size(column: arb_mat) -> arb:
    return sum((abs(value).mid() for value in column.entries()), arb(0))


def phase_at(variable: Moving, moment: arb) -> tuple[arb, int]:
    """θ and whole turns of a single variable whose G is ``moment``; raises Undecided where that is not proven."""
    (phase,), (turns,) = Inversion((variable,), (1,)).phases([moment])
    if not phase.is_finite():
        raise Undecided
    return phase, turns


# Abel's integrals where one of two variables rests at a double root of the polynomial.
#
# Where v_o rests at a double root e the integrand v^j/√g of the other has a pole at e, and with G_j = ε F_j + (...)
# above only the combination without it moves,
#
#     H(θ) = F_1(θ) − e F_0(θ),   dH/dθ = (v − e)/√g,
#
# which is of one sign: an integral of a lower genus.


class Rest:
    """A variable at rest at ``middle``; its phase is 0."""

    def __init__(self, middle: arb) -> None:
        self.middle = middle

    def position(self, phase: Balls) -> Balls:
        return phase * 0 + self.middle

    def density(self, v: Balls) -> Balls:
        """1, as no phase depends on it."""
        return v * 0 + 1

    def ends(self, phase: Balls) -> tuple[Balls, Balls]:
        """√(v − e) at both ends, which coincide."""
        return phase * 0, phase * 0

    def bend(self, phase: Balls) -> Balls:
        return phase * 0

    def phase(self, v: arb, slope: arb) -> arb:
        """0."""
        return arb(0)


class RestingVariable:
    """``variable`` with the integral H, beside a variable at rest at ``place``, outside its gap."""

    def __init__(self, variable: Gap | Approach, place: arb) -> None:
        self.variable, self.place = variable, place
        self.turn, self.periodic, self.position = variable.turn, variable.periodic, variable.position

    def _combined(self, first: arb, second: arb) -> list[arb]:
        return [second - first * self.place]

    @property
    def column(self) -> list[arb]:
        return self._combined(*self.variable.column)

    def density(self, v: Balls) -> Balls:
        """dH by dphase, of either sign."""
        slope: Balls = (v - self.place) * self.variable.density(v)
        return slope

    def integrals(self, phase: arb) -> list[arb]:
        return self._combined(*self.variable.integrals(phase))


Moving: TypeAlias = Gap | Approach | RestingVariable
"""A variable of an :class:`Inversion`.

turn: its phase grows by this and its integrals by ``column`` with every turn; without a period, ``column`` is the
asymptotic growth of its integrals per unit of the phase.  periodic: which of both.
position: v at a phase.  density: dF_0 by dphase at v, > 0.  integrals: F_j at a phase.
"""
Variable: TypeAlias = Gap | Approach | Rest
"""A separated variable.  middle: of its gap.  phase: that where it is v and dv/dphase is ``slope``.

ends: √(v − lo) and √(hi − v), each with a sign that makes it analytic; bend: −dv/dphase over their product.
"""


# Two separated variables on a straight line, for Kovalevskaya's and Goryachev and Chaplygin's tops.
#
# Both have I1 = I2, the centre of mass in that plane and two variables whose integrals G_0, G_1 above grow linearly
# with time.  One of the two may rest; then one integral of the other remains, and grows linearly too.


REMEDY = "Use the enclosure, which covers every motion."
_DECISIONS, _RIGHT = (64, 256, 1024, 4096), 10


@whole_evaluation
def decide(
    test: Callable[[], object], name: str = "The level is degenerate to within about 1e-300", least: int = 64
) -> None:
    """Run ``test`` at the first working precision that suffices for it, at least ``least`` bits.

    Raises LevelNotDone where none does, and where the test raises OutOfReach.
    """
    for bits in _DECISIONS:
        if bits < least:
            continue
        with working_precision(bits):
            try:
                test()
            except Undecided:
                continue
            except OutOfReach as error:
                raise LevelNotDone(f"{name}: {error.cause}", REMEDY) from error
        return
    raise LevelNotDone(f"{name}: {_DECISIONS[-1]} bits do not resolve the distance.", REMEDY)


def refuse(name: str, apart: arb, of: str) -> NoReturn:
    """Raise LevelNotDone with the distance, or Undecided where the working precision does not determine it."""
    if apart.rel_accuracy_bits() < _RIGHT:
        raise Undecided
    raise LevelNotDone(f"{name} to within {apart.str(2, radius=False)}, the distance of {of}.", REMEDY)


def ordered(roots: Sequence[acb]) -> list[int]:
    """The indices of the real roots in ascending order; raises Undecided where two balls overlap."""
    real = sorted((i for i, root in enumerate(roots) if root.imag.is_zero()), key=lambda i: midpoint(roots[i].real))
    if any(roots[i].overlaps(roots[j]) for i, j in pairwise(real)):
        raise Undecided
    return real


def alternate(real: Sequence[int], multiplicities: Sequence[int], positive: bool) -> list[tuple[int, int]]:
    """Pairs of successive real roots between which a polynomial is positive.

    real: their indices, ascending.  multiplicities: of all roots.  positive: whether it is below the lowest.
    """
    intervals = []
    for low, high in pairwise(real):
        positive ^= multiplicities[low] % 2 == 1
        if positive:
            intervals.append((low, high))
    return intervals


def variable_between(ends: tuple[int, int], roots: Sequence[tuple[acb, int]], lead: arb, most: int) -> Variable:
    """A variable between two simple roots, between a simple and a double one, or at rest on a root.

    ends: the indices of the lower and the upper root.  roots: with multiplicities.  Raises Undecided where the working
    precision does not separate the ends, OutOfReach for Fourier series of more than ``most`` terms.
    """
    low, high = (roots[number][0].real for number in ends)
    if ends[0] == ends[1]:
        return Rest(low)
    if not low < high:
        raise Undecided
    others = Roots.of(lead, [root for number, root in enumerate(roots) if number not in ends])
    if roots[ends[0]][1] > 1:
        return Approach(high, low, others, most=most)
    return Approach(low, high, others, most=most) if roots[ends[1]][1] > 1 else Gap(low, high, others, most=most)


@dataclass(frozen=True, slots=True)
class Line:
    """Two variables whose integrals grow linearly, from ``origin`` at the rates ``slopes``.

    moving: the indices of the variables that do not rest.
    """

    variables: tuple[Variable, ...]
    moving: tuple[int, ...]
    inversion: Inversion
    origin: tuple[arb, ...]
    slopes: tuple[arb, ...]

    @classmethod
    def of(
        cls, variables: tuple[Variable, ...], signs: tuple[int, int], slopes: tuple[int, int], phases: Sequence[arb]
    ) -> Line:
        """The line through the phases at t = 0; signs: ε, slopes: of G_0 and G_1."""
        moving = {k: variable for k, variable in enumerate(variables) if not isinstance(variable, Rest)}
        inversion, rates = Inversion(tuple(moving.values()), signs), tuple(map(arb, slopes))
        if len(moving) == 1:
            # of ε (G_1 − e G_0), one number
            ((k, variable),) = moving.items()
            double_root = variables[1 - k].middle
            inversion = Inversion((RestingVariable(variable, double_root),), (1,))
            rates = (signs[k] * (slopes[1] - double_root * slopes[0]),)
        origin = inversion.values([phases[k] for k in moving])
        return cls(variables, tuple(moving), inversion, tuple(origin), rates)

    def phases(self, time: arb) -> tuple[list[arb], list[int]]:
        """The phases in the first turns, 0 for a variable at rest, and whole turns.

        Raises Undecided where the working precision does not prove them.
        """
        target = [value + slope * time for value, slope in zip(self.origin, self.slopes, strict=True)]
        angles, counts = self.inversion.phases(target)
        if not all(phase.is_finite() for phase in angles):
            raise Undecided
        phases, turns = [arb(0)] * 2, [0] * 2
        for k, phase, count in zip(self.moving, angles, counts, strict=True):
            phases[k], turns[k] = phase, count
        return phases, turns

    def mean_rates(self) -> list[arb]:
        """:meth:`Inversion.mean_rates` of the variables that move."""
        return self.inversion.mean_rates(self.slopes)

    def series(self, phases: Sequence[arb], rates: Callable[[Any, Any], Sequence[Any]]) -> list[Any]:
        """The phases as power series in t, from their differential equations: rates of both at (v1, v2)."""

        def slopes(moving: Sequence[Any]) -> Sequence[Any]:
            return rates(*(variable.position(x) for variable, x in zip(self.variables, moving, strict=True)))

        return solved(phases, slopes)


# The integral of a function on a torus along a straight line: Fourier series of two frequencies with a proven error.
#
# On the angles φ1, φ2, which grow at the rates ω1, ω2, let K = Σ a(φ1) D(φ1, φ2) b(φ2), where D is even in both angles
# and a and b are even or odd, 2π-periodic or turned into their negatives by 2π.  With f, g of cos νφ and sin νφ, ν
# whole or half whole, K is a sum of c f(φ1) g(φ2), and along the line
#
#     c f g = d/ds [c (f ġ − ḟ g)/(ω1²ν1² − ω2²ν2²)],   ḟ = ω1 df/dφ1,  ġ = ω2 dg/dφ2.
#
# Terms near a resonance, ω1ν1 = ω2ν2 but for 10^-7 of it, are integrated from the start of the line as they stand:
#
#     ∫_0^s cos(χ + xs') ds' = s cos(χ + xs/2) sin(xs/2)/(xs/2),   x = ω1ν1 ± ω2ν2,
#
# so that no divisor is small.  c follows from n1 × n2 values at φ = (i + ½) π/n.  Where |K| ≤ W on |Im φ_k| ≤ η_k, the
# coefficients of e^(i(ν1φ1 + ν2φ2)) are at most W e^(−η1|ν1| − η2|ν2|); at these points every ν ≥ n takes the values of
# one below, or vanishes, so that K is off by at most twice the sum of those left out,
#
#     4W Σ_k e^(−η_k n_k) (1 + e^(−η_o))/((1 − e^(−η1)) (1 − e^(−η2))),   o the other angle,
#
# and its integral by |s| times that, resonances or not.


_RESONANT, _NARROWEST = 1e-7, 1e-9
_MOST_WORK = 1 << 27
"""Multiplications of the two transforms, n1 n2 (n1 + n2): some seconds."""


class Symmetry(NamedTuple):
    """The symmetry of a function of one angle: odd, and turned into its negative by 2π."""

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
        """The matrix from the values of D at the points to the coefficients of the product."""
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

    Raises OutOfReach where they are too large.
    """
    floats = [None if width is None else max(float(width), _NARROWEST) for width in widths]
    decay = (current_precision() + 6) * log(2) - sum(log(-expm1(-width)) for width in floats if width)
    first, second = (1 if width is None else max(4, ceil(decay / width)) for width in floats)
    if first * second * (first + second) > _MOST_WORK:
        raise OutOfReach(
            f"The azimuth needs {first} x {second} Fourier terms: the level is nearly degenerate.",
            "Request fewer digits, or choose a start farther from the degenerate level.",
        )
    return first, second


def error_of(largest: arb, widths: Sequence[arb | None], terms: Sequence[int]) -> arb:
    """The bound of the error of K; largest: W."""
    sums, tails = [], []
    for width, count in zip(widths, terms, strict=True):
        decay = arb(0) if width is None else (-width).exp()
        sums.append((1 + decay) / (1 - decay))
        tails.append(arb(0) if width is None else 2 * (-width * count).exp() / (1 - decay))
    return 2 * largest * (tails[0] * sums[1] + sums[0] * tails[1])


class Resonance(NamedTuple):
    """A term c f(φ1) g(φ2) that is integrated from the start of the line; twice: 2ν of both."""

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
        """The product, and a bound of the terms omitted as too small; largest: W, rates: ω1, ω2."""
        table = (first.transform() * kernel * second.transform().transpose()).tolist()
        smallest, dropped = largest * arb(2) ** (8 - current_precision()), arb(0)
        sizes = [[abs(c).upper() for c in row] for row in table]
        tall = max((m for m, row in enumerate(sizes, 1) if any(size > smallest for size in row)), default=1)
        wide = max((n for row in sizes for n, size in enumerate(row, 1) if size > smallest), default=1)
        for m, row in enumerate(sizes):
            dropped += sum(row[wide:] if m < tall else row, arb(0))
        symmetries = first.symmetry, second.symmetry
        orders = symmetries[0].orders(tall), symmetries[1].orders(wide)
        speeds = [[rate * twice / 2 for twice in row] for rate, row in zip(rates, orders, strict=True)]
        squares, floats = [[x * x for x in row] for row in speeds], [[float(x) for x in row] for row in speeds]
        rows, resonances = [], []
        for m, (square, size) in enumerate(zip(squares[0], floats[0], strict=True)):
            row = []
            for n, (second_square, length) in enumerate(zip(squares[1], floats[1], strict=True)):
                if abs(size - length) > _RESONANT * (size + length):
                    row.append(table[m][n] / (square - second_square))
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
        """The integral of the resonances over a line of that length from the angles ``began``."""
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

    error: a bound of the error of K.
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
        """The integral from the pairs (a, b) and D at the points, W and the error of each pair."""
        products = [Product.of(first, kernel, second, rates, largest) for first, second in pairs]
        dropped = sum((part for _, part in products), arb(0))
        return cls(tuple(product for product, _ in products), rates, began, dropped + len(products) * error)

    def at(self, angles: Sequence[arb], length: arb) -> arb:
        """The integral up to the angles at ``length``, up to a constant."""
        total = arb(0, (self.error * abs(length)).upper())
        for product in self.products:
            total += product.primitive(angles, self.rates) + product.resonant(self.began, self.rates, length)
        return total
