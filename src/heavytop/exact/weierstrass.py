"""Weierstrass' functions of a real lattice, from its invariants or roots, as balls.

℘'² = 4℘³ − g2 ℘ − g3 = 4 (℘ − e1)(℘ − e2)(℘ − e3), e1 + e2 + e3 = 0, real g2, g3 (DLMF 23.3.10).  With half-periods
ω (real) and ω', τ = ω'/ω where all roots are real (e1 > e2 > e3), and the basis ω, (ω + ω')/2, τ = (1 + ω'/ω)/2, where
two are complex, z = u/(2ω) and T(u) = 2ω θ1(z)/θ1'(0), everything is a theta quotient (DLMF 23.6.5-23.6.9):

    ℘ = e1 + (θ2(z)/(θ2(0) T))²,   ℘' = −2 θ2(z)θ3(z)θ4(z)/(θ2(0)θ3(0)θ4(0) T³),   σ = T exp(η u²/(2ω))

:class:`Point` holds T, ℘ T² and ℘' T³, which stay finite at the poles of ℘, so that no formula built on it breaks down
at t = 0 or at a whole period.  On discriminant 0 (a double root d) T is sinh(κu)/κ with κ² = 3d, or its trigonometric
or rational form, and nothing is left of theta functions.  Near it they converge all the faster, after the modular
transformation that FLINT makes, and only the roots' difference costs working precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from flint import acb, acb_series, arb, arb_poly, arb_series

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, midpoint, working_precision
from heavytop.exact.flint_context import current_precision
from heavytop.exact.theta import Theta

Exact = Fraction | int
Scalar = Fraction | int | arb
_LARGE = 0.6  # the largest nome whose series are short and lose no more than a few bits


@dataclass(slots=True)  # frozen ones take ten times as long to make
class Point:
    """A lattice's functions at a real time, without poles; numbers or power series in the time.

    scale: T, odd, ~ u.  square: T².  raised: √((℘ − e) T²) for the root e = ``root`` of the lattice.  high: its square.
    slope: ℘' T³.
    thetas: (−1)^(whole periods) and θ_j(z)/θ_j(0), j = 2, 3, 4 (none on discriminant 0); where two roots are complex
    and z is not reduced, the product of the last two and 1.
    time, z: u and u/(2ω) reduced, or sin, cos and cos 2· of πz where nothing was reduced.
    """

    scale: Any
    square: Any
    raised: Any
    high: Any
    slope: Any
    root: Scalar
    thetas: tuple[Any, ...]
    time: Any
    z: Any

    def above(self, value: Scalar) -> Any:
        """(℘ − value) T²; the difference of exact roots and values is exact."""
        if isinstance(value, arb) and isinstance(self.root, arb):
            return self.high + (self.root - value) * self.square
        return self.high + as_ball(difference(self.root, value)) * self.square


@dataclass(frozen=True, slots=True)
class Lattice:
    """A lattice of discriminant other than 0, at one working precision.

    roots: the values e of ℘ at z = 1/2, (1 + τ)/2, τ/2.  half_period: ω, the smallest positive real one.  ratio: τ.
    zero: θ1'(0), θ2(0), θ3(0), θ4(0).  quasi_period: η = ζ(ω).
    theta: the series for numbers, None where the nome is large (a long real period: beside a double root).
    parts: their polynomials, of T, raised and the last two thetas of :class:`Point`.
    """

    roots: tuple[acb, acb, acb]
    half_period: arb
    ratio: acb
    zero: tuple[acb, ...]
    quasi_period: arb
    theta: Theta | None
    parts: tuple[arb_poly, ...]

    def reduced(self, u: acb) -> tuple[acb, int]:
        """(z − n, n): z = u/(2ω) moved by n whole real periods into |Re z| <= 1/2 (or just above)."""
        z = u / (2 * self.half_period)
        turns = round(midpoint(z.real)) if z.is_finite() else 0
        return z - turns, turns

    def point(self, time: Exact, length: int = 0) -> Point:
        """:class:`Point` at a real time; with ``length``, power series in ε at time + ε, up to ε^(length − 1)."""
        if self.theta is not None and not length:
            return self._number(self.theta, ball(time))
        z, turns = self.reduced(acb(ball(time)))
        u: Any = ball(time)
        argument: Any = z
        if length:
            argument = acb_series([z, 1 / (2 * self.half_period)], length)
            u = arb_series([u, 1], length)
        theta = thetas(argument, self.ratio)
        theta1, *others = theta
        scale = real(theta1 * (2 * self.half_period / self.zero[0]))
        ratios = tuple(value * (1 / start) for value, start in zip(others, self.zero[1:], strict=True))
        slope = real(ratios[0] * ratios[1] * ratios[2]) * -2
        sign = -1 if turns % 2 else 1
        raised = real(ratios[0])
        root, thetas_there = self.roots[0].real, (sign, *ratios)
        return Point(scale, scale * scale, raised, raised * raised, slope, root, thetas_there, u, argument)

    def _number(self, theta: Theta, u: arb) -> Point:
        angles = theta.angles(u)
        sine, cosine, c = angles
        first, second, third, fourth = self.parts
        scale, raised, three, four = sine * first(c), cosine * second(c), third(c), fourth(c)
        slope = raised * three * four * -2
        root, ratios = self.roots[0].real, (1, raised, three, four)
        return Point(scale, scale * scale, raised, raised * raised, slope, root, ratios, u, angles)


@dataclass(frozen=True, slots=True)
class DegenerateLattice:
    """Discriminant 0: ℘ = d + κ²/sinh²(κu), κ² = 3d, double root d and simple root −2d.

    ℘, ζ and σ are the limits of DLMF 23.12.1-23.12.3 for nome 0, with κ = iπ/(2ω).
    """

    double: Scalar

    @property
    def half_period(self) -> arb:
        """π/(2√(−3d)) where d < 0; infinite otherwise."""
        square = -3 * as_ball(self.double)
        return arb.pi() / (2 * square.sqrt()) if square > 0 else arb("inf")

    def functions(self, u: Any) -> tuple[Any, Any]:
        """(T, C) = (sinh(κu)/κ, cosh(κu)), or sin and cos, or (u, 1), of a number or a power series."""
        if self.double == 0:
            return u, u * 0 + 1
        square = 3 * as_ball(self.double)
        if square > 0:
            rate = square.sqrt()
            up, down = (u * rate).exp(), (u * -rate).exp()
            return (up - down) * (1 / (2 * rate)), (up + down) * (arb(1) / 2)
        rate = (-square).sqrt()
        sine, cosine = (u * rate).sin_cos()
        return sine * (1 / rate), cosine

    def point(self, time: Exact, length: int = 0) -> Point:
        """As :meth:`Lattice.point`."""
        u: Any = arb_series([ball(time), 1], length) if length else ball(time)
        scale, cosine = self.functions(u)
        one = u * 0 + 1
        return Point(scale, scale * scale, one, one, cosine * -2, self.double, (), u, u)


AnyLattice = Lattice | DegenerateLattice


def thetas(z: Any, ratio: acb, order: int = 0) -> Any:
    """(θ1, θ2, θ3, θ4) at z of a number or a power series, or their derivatives in z of a number."""
    return z.modular_theta(ratio, order) if order else z.modular_theta(ratio)


def as_ball(value: Scalar) -> arb:
    """An exact number or a ball as a ball."""
    return value if isinstance(value, arb) else ball(value)


def difference(a: Scalar, b: Scalar) -> Scalar:
    """a − b, exact where both are."""
    return as_ball(a) - as_ball(b) if isinstance(a, arb) or isinstance(b, arb) else a - b


def real(value: Any) -> Any:
    """The real part of a ball or of a power series in a real variable."""
    if isinstance(value, acb_series):
        return arb_series([value[i].real for i in range(value.prec)], value.prec)
    return value if isinstance(value, arb) else value.real


def imag(value: Any) -> Any:
    """The imaginary part of a ball or of a power series in a real variable."""
    if isinstance(value, acb_series):
        return arb_series([value[i].imag for i in range(value.prec)], value.prec)
    return value * 0 if isinstance(value, arb) else value.imag


def from_invariants(g2: Scalar, g3: Scalar) -> AnyLattice:
    """The lattice of ℘'² = 4℘³ − g2 ℘ − g3 at the working precision.

    Exact invariants: any, the sign of the discriminant g2³ − 27 g3² is decided exactly.  Balls: raises OutOfReach where
    they do not decide it.
    """
    if not isinstance(g2, arb) and not isinstance(g3, arb):
        return exact_lattice(Fraction(g2), Fraction(g3), current_precision())
    g2, g3 = as_ball(g2), as_ball(g3)
    discriminant = g2**3 - 27 * g3**2
    if not (discriminant > 0 or discriminant < 0):
        raise OutOfReach(
            f"The discriminant g2^3 - 27 g3^2 = {discriminant.str(10)} has no certain sign.",
            "Give the invariants exactly, or as narrower balls.",
        )
    near = _cubic_roots(*(Fraction(midpoint(g)) for g in (g2, g3)))
    one, two, three = (_enclose(root, g2, g3) for root in near.values)
    gaps = ((one - two).real, (two - three).real) if near.gaps else None
    return _from_roots(_Roots((one, two, three), gaps))


@lru_cache(maxsize=64)
def exact_lattice(g2: Fraction, g3: Fraction, bits: int) -> AnyLattice:
    """:func:`from_invariants` of exact ones, once for each working precision."""
    with working_precision(bits):
        if g2**3 == 27 * g3**2:
            return DegenerateLattice(Fraction(-3, 2) * g3 / g2 if g2 else Fraction(0))
        return _from_roots(_cubic_roots(g2, g3))


@dataclass(frozen=True, slots=True)
class _Roots:
    """e1, e2, e3 as in :class:`Lattice`.  gaps: e1 − e2 and e2 − e3 where all are real, e1 > e2 > e3; else None."""

    values: tuple[acb, acb, acb]
    gaps: tuple[arb, arb] | None


def _cubic_roots(g2: Fraction, g3: Fraction) -> _Roots:
    """The roots of 4x³ − g2 x − g3, discriminant not 0, by the formulas of Viète and Cardano.

    Nothing cancels but the exact g2³ − 27 g3²: roots and gaps are right to about the working precision however close
    roots are, after a number of operations that does not depend on it.
    """
    discriminant = g2**3 - 27 * g3**2
    if discriminant > 0:
        # e = √(g2/3) cos(θ/3 + 2kπ/3) with cos θ = g3 √27/g2^(3/2)
        sine, cosine, third = ball(discriminant).sqrt(), ball(g3) * arb(27).sqrt(), arb.pi() * 2 / 3
        angle, beside = arb.atan2(sine, cosine) / 3, arb.atan2(sine, -cosine) / 3
        size, wide = ball(g2 / 3).sqrt(), ball(g2).sqrt()
        one, two, three = (acb(size * (angle + turn).cos()) for turn in (0, -third, third))
        return _Roots((one, two, three), (wide * beside.sin(), wide * angle.sin()))
    # u³, v³ = |g3|/8 ± half, uv = g2/12, e = u + v, and the others −e/2 ± (u − v) i√3/2
    half, product = ball(-discriminant / 1728).sqrt(), ball(g2 / 12)
    first = (ball(abs(g3) / 8) + half).root(3)
    second = product / first
    squares = first * first + second * second
    if g2 < 0:
        root, apart = ball(abs(g3) / 4) / (squares - product), first - second
    else:
        root, apart = first + second, 2 * half / (squares + product)
    root = -root if g3 < 0 else root
    pair = acb(-root / 2, apart * arb(3).sqrt() / 2)
    return _Roots((acb(root), pair.conjugate(), pair), None)


def _enclose(near: acb, g2: arb, g3: arb) -> acb:
    """The ball around ``near`` that holds a root of 4x³ − g2 x − g3: a contracting interval Newton step."""
    middle = near.mid() if not near.imag.contains(0) else acb(near.real.mid())
    value = 4 * middle**3 - g2 * middle - g3
    spread = abs(value / (12 * middle**2 - g2)).upper() * 2 + arb(2) ** (-current_precision())
    wide = middle + (acb(arb(0, spread)) if middle.imag == 0 else acb(arb(0, spread), arb(0, spread)))
    narrow = middle - value / (12 * wide**2 - g2)
    if not wide.contains(narrow):
        raise OutOfReach(f"A root near {near.str(10)} is not certain.", "Give the invariants as narrower balls.")
    return narrow


def _from_roots(roots: _Roots) -> Lattice:
    """The lattice of three different roots; real half-periods by the arithmetic-geometric mean (DLMF 23.22(ii))."""
    if roots.gaps is not None:
        upper, lower = roots.gaps
        side = acb((upper + lower).sqrt())
        half = arb.pi() / (2 * side.agm(upper.sqrt()).real)
        imaginary = arb.pi() / (2 * side.agm(lower.sqrt()).real)
        return _with_thetas(roots.values, half, acb(0, imaginary / half))
    e, _, pair = roots.values
    apart = acb(e.real - pair.real, pair.imag)
    # √(e − pair) has these real and imaginary parts; each from the sum that does not cancel
    size = (apart.real**2 + apart.imag**2).sqrt()
    larger = ((size + abs(apart.real)) / 2).sqrt()
    smaller = apart.imag / (2 * larger)
    along, across = (larger, smaller) if apart.real > 0 else (smaller, larger)
    half, imaginary = (arb.pi() / (2 * acb(size.sqrt()).agm(part).real) for part in (along, across))
    return _with_thetas(roots.values, half, acb(arb(1) / 2, imaginary / (2 * half)))


def _with_thetas(roots: tuple[acb, acb, acb], half: arb, ratio: acb) -> Lattice:
    _, two, three, four = thetas(acb(0), ratio)
    first, third = (thetas(acb(0), ratio, order)[0] for order in (1, 3))
    zero, quasi_period = (first, two, three, four), (-third / (12 * half * first)).real
    nome = (-arb.pi() * ratio.imag).exp()
    if not nome < _LARGE:
        return Lattice(roots, half, ratio, zero, quasi_period, None, ())
    square = nome * nome if ratio.real == 0 else -nome * nome
    theta = Theta(square, arb.pi() / (2 * half), False, arb(1))
    one, (odd, even) = arb(1), theta.odd()
    rest = (theta.even(1), theta.even(-1)) if ratio.real == 0 else (theta.both(), arb_poly([1]))
    parts = odd * (1 / (odd(one) * theta.rate)), *(poly * (1 / poly(one)) for poly in (even, *rest))
    return Lattice(roots, half, ratio, zero, quasi_period, theta, parts)
