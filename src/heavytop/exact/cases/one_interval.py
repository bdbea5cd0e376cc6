"""Motions of a top with r on axis 1 in which Ω2² and Ω3² are polynomials, all on one variable in one gap.

With I = (A, B, C), n = P r = (N, 0, 0), polynomials Q and R of x, k = 1 or 3 and w = x^((k − 1)/2) put

    Ω1 = x^k,   Ω2 = w √Q,   Ω3 = w √R,   x' = K √Q √R,   K = (B − C)/(kA)
    Nγ1 = S,   Nγ2 = √Q T,   Nγ3 = √R U
    T = (A − B) w x^k − C K (w' R + ½ w R'),   U = B K (w' Q + ½ w Q') − (C − A) w x^k

This satisfies the equations for Ω.  Those for γ are three identities between polynomials, tested exactly:

    K S' = w (T − U),   K (T' Q + ½ T Q') = U x^k − w S,   K (U' R + ½ U R') = w S − T x^k

x swings between two simple roots of QR, x = m + d cos θ (:mod:`heavytop.exact.separable.oscillation`), θ' = √g > 0 and
t is one Abel integral of θ.  √Q and √R are products of √(2d) cos(θ/2), √(2d) sin(θ/2) and roots that never vanish:
turning points need no special case.  The four motions of this form: Steklov's below,
:mod:`heavytop.exact.cases.algebraic_starts`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from typing import Any

from flint import acb, arb, fmpq, fmpq_poly

from heavytop.errors import NotInClass
from heavytop.exact.cases.lagrange import polynomial
from heavytop.exact.closed_form import ClosedForm, cached_per_precision, in_units, solved
from heavytop.exact.flint.balls import (
    BallLike,
    Balls,
    Undecided,
    ball,
    current_precision,
    rational,
    the_only,
    unit_of_time,
    whole_evaluation,
    working_precision,
)
from heavytop.exact.separable.abel import alternate, decide, ordered, phase_at
from heavytop.exact.separable.oscillation import MOST_TERMS, Azimuth, Bearing, Gap, Roots, WithBearing
from heavytop.exact.solution import GAMMA, ON_AXIS_1, ExactRelation
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

_X = fmpq_poly([0, 1])
_HALF = fmpq(1, 2)
_SEARCH_BITS = 64


@dataclass(frozen=True, slots=True)
class IntervalCurve:
    """Q, R and the polynomials that follow from them; made by :meth:`of`.

    inertia: (A, B, C).  power: k.  speed: K.  heights: S, T, U.
    """

    inertia: tuple[Fraction, Fraction, Fraction]
    power: int
    second: fmpq_poly
    third: fmpq_poly
    speed: Fraction
    heights: tuple[fmpq_poly, fmpq_poly, fmpq_poly]

    @classmethod
    def of(
        cls, inertia: tuple[Fraction, Fraction, Fraction], second: fmpq_poly, third: fmpq_poly, power: int = 1
    ) -> IntervalCurve:
        """The motions with these Q and R; raises NotInClass where an identity fails."""
        a, b, c = (rational(moment) for moment in inertia)
        speed, shift, factor = (b - c) / (power * a), _X**power, _X ** (power // 2)
        turning = factor.derivative()
        t = (a - b) * factor * shift - c * speed * (turning * third + _HALF * factor * third.derivative())
        u = b * speed * (turning * second + _HALF * factor * second.derivative()) - (c - a) * factor * shift
        second_rate = speed * (t.derivative() * second + _HALF * t * second.derivative())
        third_rate = speed * (u.derivative() * third + _HALF * u * third.derivative())
        s, remainder = divmod(u * shift - second_rate, factor)
        defects = speed * s.derivative() - factor * (t - u), remainder, third_rate - factor * s + t * shift
        for defect in defects:
            if defect.degree() >= 0:
                raise NotInClass(
                    f"Omega2^2 and Omega3^2 are not these polynomials of Omega1: {defect} is not 0.",
                    "The coefficients follow from the moments of inertia.",
                )
        product = second * third
        if product.gcd(product.derivative()).degree() > 0:
            raise NotInClass("Omega2^2 Omega3^2 has a multiple root.", "Choose other moments of inertia.")
        return cls(inertia, power, second, third, Fraction(int(speed.p), int(speed.q)), (s, t, u))

    def turning(self) -> tuple[fmpq_poly, fmpq_poly]:
        """(numerator, denominator) of f/|Nγ| in lowest terms, f = |γ| n·M_h/|M_h|².

        f is the rate at which M_h, the level part of M, turns about γ:
        M' = γ × n in space.  Where w is not 1, M·γ = 0, and M/w turns as M does.
        """
        a, b, c = (rational(moment) for moment in self.inertia)
        s, t, u = self.heights
        shift, factor = _X**self.power, _X ** (self.power // 2)
        square = rational(self.gamma_square())
        area = a * shift * s + factor * (b * self.second * t + c * self.third * u)
        numerator = a * shift - area * s / square
        denominator = a * a * shift * shift + factor * factor * (b * b * self.second + c * c * self.third)
        denominator -= area * area / square
        shared = numerator.gcd(denominator)
        return divmod(numerator, shared)[0], divmod(denominator, shared)[0]

    def squares(self, x: Fraction) -> tuple[Fraction, Fraction]:
        """Q and R at x."""
        return value(self.second, x), value(self.third, x)

    def gamma_square(self) -> Fraction:
        """N²|γ|², a constant."""
        s, t, u = self.heights
        return value(s * s + self.second * t * t + self.third * u * u, Fraction(0))


def value(polynomial: fmpq_poly, x: Fraction) -> Fraction:
    """The value of the polynomial at a rational number."""
    ball_of_value = polynomial(rational(x))
    return Fraction(int(ball_of_value.p), int(ball_of_value.q))


@dataclass(frozen=True, slots=True)
class _End:
    """A root of QR.  of: 0 for a root of Q, 1 for one of R."""

    place: acb
    of: int


@dataclass(frozen=True, slots=True)
class OneGapMotion:
    """A motion on a curve at one working precision.

    rests: Q and R without the ends of the gap.  stops: the lower end and the upper end.  others: the other roots of QR.
    origin: Abel's integral at t = 0.  signs: of √Q and √R with their half angles.
    """

    curve: IntervalCurve
    gap: Gap
    rests: tuple[Roots, Roots]
    stops: tuple[_End, _End]
    others: tuple[_End, ...]
    origin: arb
    signs: tuple[int, int]
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, curve: IntervalCurve, x: Fraction, signs: tuple[int, int], most: int = MOST_TERMS) -> OneGapMotion:
        """The motion at the working precision from x and the signs of √Q and √R there, 0 where they vanish.

        Raises Undecided where that does not suffice, OutOfReach for a Fourier series of more than ``most`` terms.
        """
        roots, leads = _roots(curve), [_lead(part) for part in (curve.second, curve.third)]
        low, high = _gap_ends(roots, leads[0] * leads[1], ball(x))
        others = [root for root in roots if root not in (low, high)]
        of = [[(root.place, 1) for root in others if root.of == which] for which in (0, 1)]
        lead = ball(curve.speed) ** 2 * abs(leads[0] * leads[1])
        gap = Gap(low.place.real, high.place.real, Roots.of(lead, of[0] + of[1]), count=1, most=most)
        rests = Roots.of(abs(leads[0]), of[0]), Roots.of(abs(leads[1]), of[1])
        q, r = (sign * ball(square).sqrt() for sign, square in zip(signs, curve.squares(x), strict=True))
        slope = ball(curve.speed) * q * r * gap.density(ball(x))
        phase = gap.phase(ball(x), slope)
        # x' = K √Q √R and dx/dθ < 0 for 0 < θ < π: one sign gives the other
        side = -1 if curve.speed > 0 else 1
        motion = cls(curve, gap, rests, (low, high), tuple(others), gap.integrals(phase)[0], (1, side))
        roots_at_start = motion._square_roots(phase, 0)
        which = next((k for k in (0, 1) if signs[k] and not roots_at_start[k].contains(0)), None)
        if which is None:
            raise Undecided
        if (roots_at_start[which] > 0) != (signs[which] > 0):
            motion = cls(curve, gap, rests, motion.stops, motion.others, motion.origin, (-1, -side))
        return motion

    def at(self, time: arb) -> list[BallLike]:
        """Ω and Nγ at ``time``, numbers or series of the length set by :func:`series_length`.

        Raises Undecided where the working precision does not prove the phase.
        """
        phase, turns = phase_at(self.gap, self.origin + time)
        (moving,) = solved([phase], lambda now: [1 / self.gap.density(self.gap.position(now[0]))])
        return self._state(moving, turns)

    @cached_per_precision
    def azimuth(self) -> Azimuth:
        """The azimuth of the level part of M about γ, by :meth:`IntervalCurve.turning`."""
        numerator, denominator = self.curve.turning()
        poles: Any = denominator.complex_roots()
        doubled = [(acb(root), 2 * many) for root, many in poles]
        lead = ball(self.curve.speed) ** 2 * abs(_lead(self.curve.second) * _lead(self.curve.third))
        roots = Roots.of(lead * _lead(denominator) ** 2, [(root.place, 1) for root in self.others] + doubled)
        low, high = (end.place.real for end in self.stops)
        weights = [ball(self.curve.gamma_square()).sqrt() * arb(c) for c in numerator.coeffs()]
        return Azimuth(Gap(low, high, roots, count=len(weights)), tuple(weights))

    def bearing(self, time: arb) -> Bearing:
        """M/w, level, and its azimuth at ``time``."""
        phase, turns = phase_at(self.gap, self.origin + time)
        x, (q, r) = self.gap.position(phase), self._square_roots(phase, turns)
        s, t, u = (horner(height, x) for height in self.curve.heights)
        a, b, c = map(ball, self.curve.inertia)
        vector = [a * x ** (self.curve.power - self.curve.power // 2), b * q, c * r]
        return Bearing.of([s, q * t, r * u], vector, self.azimuth().at(phase, turns))

    def _square_roots(self, phase: Balls, turns: int) -> tuple[Balls, Balls]:
        """√Q and √R."""
        x, halves = self.gap.position(phase), self.gap.ends(phase)
        roots = [sign / others.density(x) for sign, others in zip(self.signs, self.rests, strict=True)]
        for stop, half in zip(self.stops, halves, strict=True):
            roots[stop.of] *= -half if turns % 2 else half
        return roots[0], roots[1]

    def _state(self, phase: Balls, turns: int) -> list[Balls]:
        x = self.gap.position(phase)
        q, r = self._square_roots(phase, turns)
        s, t, u = (horner(height, x) for height in self.curve.heights)
        factor = x ** (self.curve.power // 2)
        return [x**self.curve.power, factor * q, factor * r, s, q * t, r * u]


def horner(polynomial: fmpq_poly, x: Balls) -> Balls:
    """A rational polynomial at a ball or series."""
    total = x * 0
    for coefficient in reversed(polynomial.coeffs()):
        total = total * x + arb(coefficient)
    return total


@whole_evaluation
def gaps(curve: IntervalCurve) -> list[tuple[float, float]]:
    """The intervals between two roots on which Q and R are both positive."""
    with working_precision(_SEARCH_BITS):
        real = sorted(float(root.place.real) for root in _roots(curve) if root.place.imag.is_zero())
        return [ends for ends in pairwise(real) if min(curve.squares(Fraction(sum(ends) / 2))) > 0]


def _lead(polynomial: fmpq_poly) -> arb:
    return arb(polynomial[polynomial.degree()])


def _roots(curve: IntervalCurve) -> list[_End]:
    roots: Any = [part.complex_roots() for part in (curve.second, curve.third)]
    return [_End(acb(root), which) for which in (0, 1) for root, _ in roots[which]]


def _gap_ends(roots: Sequence[_End], lead: arb, x: arb) -> tuple[_End, _End]:
    """The two real roots of QR around x; raises Undecided where the balls do not determine them."""
    between = alternate(
        ordered([root.place for root in roots]), [1] * len(roots), bool(lead > 0) == (len(roots) % 2 == 0)
    )
    holding = [(low, high) for low, high in between if not (x < roots[low].place.real or x > roots[high].place.real)]
    low, high = the_only(holding)
    return roots[low], roots[high]


# Steklov's motions: r on axis 1, any moments of inertia, M·γ = 0, Ω2² and Ω3² quadratic in Ω1.
#
# With I = (A, B, C), n = P r = (N, 0, 0), Δ = (A − B)(A − C)(B − C) and E0 = ±N|γ|
#
#     Ω2² = b0 + b2 Ω1²,   b2 =  A (A − C)/((A − 2B)(B − C)),   b0 = −A E0 (A − 2C)/Δ
#     Ω3² = c0 + c2 Ω1²,   c2 = −A (A − B)/((A − 2C)(B − C)),   c0 =  A E0 (A − 2B)/Δ
#     Ω1' = ((B − C)/A) Ω2 Ω3,   Nγ2 = Ω2 T(Ω1),   Nγ3 = Ω3 U(Ω1),   Nγ1 = S(Ω1)
#
# with S, T, U above, where Ω1 is evaluated; it is a quotient of Jacobi's
# functions.  The roots of both quadratics are simple and different, so that there are no degenerate motions, equilibria
# or asymptotic ones. b0 and c0 of a start are rational, so that membership is an exact test. Source: V. A. Steklov,
# Trudy otd. fiz. nauk 10 (1899) 1; coefficients derived here from the equations.


_LEAST = 256
_TERMS_A_BIT = 64
"""The most terms of the Fourier series per bit of the working precision: 2^14 terms at 256 bits."""


def _moments(top: HeavyTop, _start: State) -> Sequence[Fraction]:
    a, b, c = top.inertia
    return a - b, a - c, b - c, a - 2 * b, a - 2 * c


def _height(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    """E0 of Ω2² = b0 + b2 Ω1², for A = 1 in the units of :func:`_units`, and the defect of Ω3² for it."""
    rate, _ = _units(top, start)
    p, q, r = (w / rate for w in start.omega)
    b2, b0, c2, c0 = quadratics(Fraction(1), top.inertia[1] / top.inertia[0], top.inertia[2] / top.inertia[0])
    height = (q * q - b2 * p * p) / b0
    return height, rate**2 * (r * r - c2 * p * p - height * c0)


def _gamma_off(top: HeavyTop, start: State) -> list[Fraction]:
    rate, torque = _units(top, start)
    p, q, r = (w / rate for w in start.omega)
    heights = _curve(top, start).heights
    expected = [factor * value(part, p) for factor, part in zip((Fraction(1), q, r), heights, strict=True)]
    return [g - w / torque for g, w in zip(start.gamma, expected, strict=True)]


@dataclass(frozen=True, slots=True)
class Steklov(WithBearing, ClosedForm):
    """A Steklov motion of a top with its centre of mass on axis 1.

    Raises NotInClass unless P b = P c = 0, P r ≠ 0, γ ≠ 0, no two moments are equal, A ≠ 2B, A ≠ 2C, and the start
    satisfies the equalities above exactly.
    """

    method = "closed form: Steklov, inversion of an elliptic integral"
    source = "V. A. Steklov (1899); formulas derived in the program"
    body = *ON_AXIS_1, ExactRelation("I1, I2, I3 different, I1 != 2 I2, 2 I3", "the differences", _moments, all)
    starts = (
        GAMMA,
        ExactRelation("Omega3^2 = c0 + c2 Omega1^2", "the difference", lambda top, start: (_height(top, start)[1],)),
        ExactRelation("E0 != 0", "E0", lambda top, start: (_height(top, start)[0],), any),
        ExactRelation("gamma as it follows from Omega", "the difference", _gamma_off),
    )

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        # the Fourier series of Abel's integral may be too long, or the start too near to a turning point
        name = "Two moments of inertia nearly satisfy an equality, or the start is nearly a turning point"
        decide(lambda: _motion(self), name, _LEAST)

    def evaluate(self, time: Fraction) -> list[BallLike]:
        rate, torque = _units(self.top, self.start)
        return in_units(_motion(self).at(ball(rate * time)), rate, 1 / torque)

    def bearing(self, time: Fraction) -> Bearing:
        rate, _ = _units(self.top, self.start)
        return _motion(self).bearing(ball(rate * time))


@cached_per_precision
def _motion(case: Steklov) -> OneGapMotion:
    rate, _ = _units(case.top, case.start)
    p, q, r = (w / rate for w in case.start.omega)
    signs = (q > 0) - (q < 0), (r > 0) - (r < 0)
    return OneGapMotion.of(_curve(case.top, case.start), p, signs, max(current_precision(), _LEAST) * _TERMS_A_BIT)


def _units(top: HeavyTop, start: State) -> tuple[Fraction, Fraction]:
    """(σ, N/(A σ²)): Ω/σ and γ N/(A σ²) are of ordinary size."""
    rate = Fraction(2) ** unit_of_time(HEAVY_TOP.parameters(top, start), start.flat)
    return rate, top.moment[0] / (top.inertia[0] * rate**2)


def quadratics(a: Fraction, b: Fraction, c: Fraction) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """(b2, b0/E0, c2, c0/E0)."""
    product = (a - b) * (a - c) * (b - c)
    return (
        a * (a - c) / ((a - 2 * b) * (b - c)),
        -a * (a - 2 * c) / product,
        -a * (a - b) / ((a - 2 * c) * (b - c)),
        a * (a - 2 * b) / product,
    )


def _curve(top: HeavyTop, start: State) -> IntervalCurve:
    """The curve of a start with A = 1, in the units of :func:`_units`."""
    height, zero = _height(top, start)[0], Fraction(0)
    b, c = top.inertia[1] / top.inertia[0], top.inertia[2] / top.inertia[0]
    b2, b0, c2, c0 = quadratics(Fraction(1), b, c)
    return IntervalCurve.of((Fraction(1), b, c), polynomial(b0 * height, zero, b2), polynomial(c0 * height, zero, c2))
