"""Weierstrass' functions of a real lattice, from its invariants or roots, as balls.

℘'² = 4℘³ − g2 ℘ − g3 = 4 (℘ − e1)(℘ − e2)(℘ − e3), e1 + e2 + e3 = 0, real g2, g3 (DLMF 23.3.10).  With half-periods
ω (real) and ω', τ = ω'/ω where all roots are real (e1 > e2 > e3), and the basis ω, (ω + ω')/2, τ = (1 + ω'/ω)/2, where
two are complex, z = u/(2ω) and T(u) = 2ω θ1(z)/θ1'(0), everything is a theta quotient (DLMF 23.6.5-23.6.9):

    ℘ = e1 + (θ2(z)/(θ2(0) T))²,   ℘' = −2 θ2(z)θ3(z)θ4(z)/(θ2(0)θ3(0)θ4(0) T³),   σ = T exp(η u²/(2ω))

:class:`Point` holds T, ℘ T² and ℘' T³, which stay finite at the poles of ℘, so that formulas built on it hold at t = 0
and at whole periods.  On discriminant 0 (a double root d) T is sinh(κu)/κ with κ² = 3d, or its trigonometric or
rational form, without theta functions.  Near it theta functions converge faster, after FLINT's modular
transformation, and only the difference of the roots costs working precision.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import chain, cycle, repeat
from typing import Any

from flint import acb, acb_poly, acb_series, arb, arb_poly, arb_series, fmpz_poly

from heavytop.errors import OutOfReach
from heavytop.exact.flint.balls import BallLike, Balls, ball, current_precision, midpoint, working_precision

# Theta functions of one nome at many real or imaginary arguments: polynomials made once, with a proven tail.
#
# With x = πz and c = cos 2x, Chebyshev's polynomials take every angle to one variable (DLMF 18.5(i)):
#
#     cos 2nx = T_n(c),   sin (2n+1)x = (U_n + U_(n−1))(c) sin x,   cos (2n+1)x = (U_n − U_(n−1))(c) cos x
#
# so the Fourier series of the thetas (DLMF 20.2.1-20.2.4) are polynomials in c times 1, sin x or cos x.  On the
# imaginary axis sin, cos become i sinh, cosh and nothing else changes.  Their coefficients fall like q^(n²): few terms
# suffice.
#
# Tail: |U_n ± U_(n−1)|, |T_n| ≤ (2n + 1) g^n where |e^(2ix)| ≤ g, 1/g ≤ |e^(2ix)|.  If the weights are at most
# q^(n²) w^n, the terms from n = N on are below b_N = (2N + 1) q^(N²) (g w)^N and fall at least by the factor
# 3 q^(2N+1) g w; where that is below 1/2 they add up to less than 2 b_N.


_MOST = 2000


@dataclass(frozen=True, slots=True)
class Theta:
    """The series of one nome, at a working precision.

    square: q², of either sign (q imaginary where the half-periods' ratio has the real part 1/2).
    rate: x = rate · u at the real argument u, and x = i rate · u where ``hyperbolic``.
    growth: g, an upper bound of |e^(±2ix)| for all arguments.
    """

    square: arb
    rate: arb
    hyperbolic: bool
    growth: arb

    def angles(self, u: arb) -> tuple[arb, arb, arb]:
        """(sin x, cos x, cos 2x), or (sinh, cosh, cosh 2·)."""
        if self.hyperbolic:
            sine, cosine = (self.rate * u).sinh_cosh()
            return sine, cosine, 1 + 2 * (sine * sine)
        sine, cosine = (self.rate * u).sin_cos()
        return sine, cosine, 1 - 2 * (sine * sine)

    def odd(self, shift: acb | None = None) -> tuple[Any, Any]:
        """(S, C): θ1 and θ2 over 2q^(1/4) are S(c) sin x and C(c) cos x; sin x is without its i.

        With a shift v, θ1(v − z) over 2q^(1/4) is C(c) cos x − S(c) sin x, with S times i where ``hyperbolic``.
        """
        if shift is None:
            return self._sum(self.square, 1, cycle((1, -1)), 1, 1), self._sum(self.square, 1, repeat(1), -1, 1)
        angle = shift * arb.pi()
        wide, turn = (2 * abs(angle.imag)).exp().upper(), -2 * (2 * angle).cos()
        sine, cosine = angle.sin_cos()
        unit = acb(0, 1) if self.hyperbolic else acb(1)
        # (−1)^n times the cosines and sines of (2n + 1) angle
        cosines, sines = _recurrent(turn, -unit * cosine, unit * cosine), _recurrent(turn, sine, sine)
        return self._sum(self.square, 1, cosines, 1, wide), self._sum(self.square, 1, sines, -1, wide)

    def even(self, sign: int) -> Any:
        """θ3 (sign +1) or θ4 (−1), as a polynomial in c; q² > 0."""
        return self._sum(self.square.sqrt(), 2, _doubled(sign), 0, 2)

    def both(self) -> Any:
        """θ3 θ4/θ4(0|2τ) = θ4(2z|2τ), DLMF 20.7.11, as a polynomial in c."""
        double = Theta(self.square * self.square, self.rate, self.hyperbolic, self.growth * self.growth)
        return double._sum(self.square, 2, _doubled(-1), 0, 2)(arb_poly([-1, 0, 2]))

    def _sum(self, base: arb, step: int, factors: Iterator[Any], kind: int, wide: Any) -> Any:
        """Σ base^(n + step n (n − 1)/2) factor_n C_n with C_n = T_n (kind 0) or U_n + kind U_(n−1)."""
        count, tail = self._enough(wide)
        total, power, ratio = next(factors) * arb_poly([1]), arb(1), base
        for n in range(1, count):
            power, ratio = power * ratio, ratio * base**step
            total += power * next(factors) * arb_poly(_chebyshev(n, kind))
        return total + (acb_poly([acb(tail, tail)]) if isinstance(total, acb_poly) else arb_poly([tail]))

    def _enough(self, wide: Any) -> tuple[int, arb]:
        """N, and a ball around 0 that contains the sum of all terms from n = N on; not finite without a bound."""
        smallest = arb(2) ** (-current_precision() - 8)
        with working_precision(64):
            nome, growth = abs(self.square).sqrt(), self.growth * wide
            for n in range(1, _MOST):
                term = (2 * n + 1) * nome ** (n * n) * growth**n
                if term < smallest and nome ** (2 * n + 1) * growth < arb(1) / 6:
                    return n, arb(0, (2 * wide * term).upper())
                if not term.is_finite():
                    break
        return 1, arb(0, "inf")


def _doubled(sign: int) -> Iterator[int]:
    return chain((1,), (2 * s for s in cycle((sign, 1))))


def _recurrent(turn: acb, before: acb, first: acb) -> Iterator[acb]:
    """x_(n+1) = turn x_n − x_(n−1)."""
    while True:
        yield first
        before, first = first, turn * first - before


def _chebyshev(n: int, kind: int) -> Any:
    if kind == 0:
        return fmpz_poly.chebyshev_t(n)
    return fmpz_poly.chebyshev_u(n) + kind * fmpz_poly.chebyshev_u(n - 1)


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
    time, z: u and u/(2ω) reduced, or sin, cos and cos 2· of πz without a reduction.
    """

    scale: BallLike
    square: BallLike
    raised: BallLike
    high: BallLike
    slope: BallLike
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

    roots: the values e of ℘ at z = 1/2, (1 + τ)/2, τ/2; at 1/2, τ/2, (1 + τ)/2 where two are complex.
    half_period: ω, the smallest positive real one.  ratio: τ.
    zero: θ1'(0), θ2(0), θ3(0), θ4(0).
    theta: the series for numbers, None where the nome is large (a long real period, near a double root).
    parts: their polynomials, of T, raised and the last two thetas of :class:`Point`.
    """

    roots: tuple[acb, acb, acb]
    half_period: arb
    ratio: acb
    zero: tuple[acb, ...]
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

    def functions(self, u: Balls) -> tuple[Balls, Balls]:
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
        """:class:`Point` at a real time, as :meth:`Lattice.point` returns it."""
        u: BallLike = arb_series([ball(time), 1], length) if length else ball(time)
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


def imag(value: Any) -> BallLike:
    """The imaginary part of a ball or of a power series in a real variable."""
    if isinstance(value, acb_series):
        return arb_series([value[i].imag for i in range(value.prec)], value.prec)
    return value * 0 if isinstance(value, arb) else value.imag


def from_invariants(g2: Scalar, g3: Scalar) -> AnyLattice:
    """The lattice of ℘'² = 4℘³ − g2 ℘ − g3 at the working precision.

    The sign of the discriminant g2³ − 27 g3² of exact invariants is decided exactly; raises OutOfReach for balls that
    do not decide it.
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
    e1, e2, e3 = (_enclose(root, g2, g3) for root in near.values)
    gaps = ((e1 - e2).real, (e2 - e3).real) if near.gaps else None
    return _from_roots(_Roots((e1, e2, e3), gaps))


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
        angle, supplement = arb.atan2(sine, cosine) / 3, arb.atan2(sine, -cosine) / 3
        size, wide = ball(g2 / 3).sqrt(), ball(g2).sqrt()
        e1, e2, e3 = (acb(size * (angle + turn).cos()) for turn in (0, -third, third))
        return _Roots((e1, e2, e3), (wide * supplement.sin(), wide * angle.sin()))
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
    size = (apart.real * apart.real + apart.imag * apart.imag).sqrt()
    larger = ((size + abs(apart.real)) / 2).sqrt()
    smaller = apart.imag / (2 * larger)
    along, across = (larger, smaller) if apart.real > 0 else (smaller, larger)
    half, imaginary = (arb.pi() / (2 * acb(size.sqrt()).agm(part).real) for part in (along, across))
    return _with_thetas(roots.values, half, acb(arb(1) / 2, imaginary / (2 * half)))


def _with_thetas(roots: tuple[acb, acb, acb], half: arb, ratio: acb) -> Lattice:
    zero = thetas(acb(0), ratio, 1)[0], *thetas(acb(0), ratio)[1:]
    nome = (-arb.pi() * ratio.imag).exp()
    if not nome < _LARGE:
        return Lattice(roots, half, ratio, zero, None, ())
    square = nome * nome if ratio.real == 0 else -nome * nome
    theta = Theta(square, arb.pi() / (2 * half), False, arb(1))
    one, (odd, even) = arb(1), theta.odd()
    rest = (theta.even(1), theta.even(-1)) if ratio.real == 0 else (theta.both(), arb_poly([1]))
    parts = odd * (1 / (odd(one) * theta.rate)), *(poly * (1 / poly(one)) for poly in (even, *rest))
    return Lattice(roots, half, ratio, zero, theta, parts)


# e^(iκt) Φ(t), Φ(t) = σ(V − t) e^(ζ(V) t)/(σ(V) σ(t)), as balls.
#
# A doubly periodic function of the second kind (Hermite): over the periods it takes constant factors.  Lamé's equation
# is Φ'' = (2℘ + ℘(V)) Φ, and Φ'/Φ = ½ (℘' + ℘'(V))/(℘ − ℘(V)).


@dataclass(frozen=True, slots=True)
class Winding:
    """A function of the second kind: ℘(V) = value, ℘'(V) = i slope √square, and a factor with κ = rate √square.

    All exact.  value is real and slope real, so that V is imaginary, or imaginary plus a real half-period; slope 0
    means that V is a half-period.
    """

    value: Fraction
    slope: Fraction
    rate: Fraction
    square: Fraction


@dataclass(frozen=True, slots=True)
class SecondKind:
    """e^(iκt) Φ(t) prepared for evaluation.

    winding: its V and κ.  shift: V/(2ω).  unit: θ1(shift).  rate: θ1'/θ1(shift)/(2ω) + iκ, the whole exponent.
    index: of the half-period that V is, in the order of the lattice's roots, or None.
    parts: the polynomials of θ1(shift − z)/unit for numbers, its real part over cos πz, its imaginary over sin πz.
    """

    lattice: AnyLattice
    value: Scalar
    slope: acb
    shift: acb
    unit: acb
    rate: acb
    index: int | None
    parts: tuple[arb_poly, ...] = ()

    def at(self, point: Point) -> tuple[BallLike, BallLike]:
        """(Φ T, Φ' T²) e^(iκt), complex."""
        factor: Any = 1 if self.rate.is_zero() else exponential(point.time, self.rate)
        if not isinstance(self.lattice, Lattice):
            return self._degenerate(point, factor)
        if self.index is not None:
            sign, *others = point.thetas
            phi = others.pop(self.index) * (sign if self.index else 1)
            return factor * phi, factor * (others[0] * others[1] * (-sign if self.index else -1))
        above = point.above(self.value) * 2
        if isinstance(point.z, tuple):
            sine, cosine, c = point.z
            even, odd = self.parts
            phi = acb(even(c) * cosine, odd(c) * sine) * factor
            return phi, phi * acb(point.slope / above, point.scale * point.square * self.slope.imag / above)
        theta = thetas(self.shift - point.z, self.lattice.ratio)[0]
        phi = theta * (1 / self.unit) * factor
        return phi, phi * ((point.scale * point.square) * self.slope + point.slope) / above

    def _degenerate(self, point: Point, factor: Balls) -> tuple[Balls, Balls]:
        """Φ = e^(Kt) (κ coth κt − K), or κ/sinh κt where V is at infinity."""
        cosine = point.slope / -2
        if self.index is not None:
            return factor, -(factor * cosine)
        phi = factor * (cosine - point.scale * self.shift)
        return phi, phi * point.scale * self.shift - factor


def exponential(time: Any, rate: acb) -> BallLike:
    """e^(rate·time) of a number or a series."""
    return (acb_series(time) * rate).exp() if not isinstance(time, arb) else (rate * time).exp()


def second_kind(lattice: AnyLattice, winding: Winding) -> SecondKind:
    """:class:`SecondKind` at the working precision."""
    root = ball(winding.square).sqrt()
    slope, turning = acb(0, ball(winding.slope) * root), acb(0, ball(winding.rate) * root)
    if not isinstance(lattice, Lattice):
        apart = ball(winding.value) - as_ball(lattice.double)
        if winding.value == lattice.double:
            return SecondKind(lattice, winding.value, slope, acb(0), acb(1), turning, 0)
        rate = -slope / (2 * apart)
        return SecondKind(lattice, winding.value, slope, rate, acb(1), rate + turning, None)
    if winding.slope == 0:
        value = ball(winding.value)
        index = min(range(3), key=lambda j: midpoint(abs(lattice.roots[j] - value).upper()))
        return SecondKind(lattice, winding.value, slope, acb(0), acb(1), turning, index)
    shift = _imaginary_argument(lattice, winding) / (2 * lattice.half_period)
    unit = thetas(shift, lattice.ratio)[0]
    log_slope = thetas(shift, lattice.ratio, 1)[0] / unit / (2 * lattice.half_period)
    # θ1'/θ1 is imaginary there
    rate = acb(0, log_slope.imag) + turning
    return SecondKind(lattice, ball(winding.value), slope, shift, unit, rate, None, _wave_parts(lattice, shift))


def _wave_parts(lattice: Lattice, shift: acb) -> tuple[arb_poly, ...]:
    if lattice.theta is None:
        return ()
    sine, cosine = lattice.theta.odd(shift)
    first = 1 / cosine(acb(1))
    # cosine/first is real and sine/first imaginary
    return tuple(arb_poly([c.real for c in (p * w).coeffs()]) for p, w in ((cosine, first), (sine, first * acb(0, 1))))


def _imaginary_argument(lattice: Lattice, winding: Winding) -> acb:
    """V with ℘(V) = value on the imaginary axis, or on that axis shifted by ω; the sign of Im V follows ℘'(V).

    ℘(iy; g2, g3) = −℘(y; g2, −g3) (DLMF 23.10(iv)), and y is Carlson's R_F (DLMF 19.25.35).  Beyond e3 the
    addition theorem, DLMF 23.10.1, gives ℘(V − ω).
    """
    value, (e1, e2, e3) = acb(ball(winding.value)), lattice.roots
    shifted = e2.imag == 0 and (value - e3).real > 0
    if shifted:
        value = e1 + (e1 - e2) * (e1 - e3) / (value - e1)
    height = acb.elliptic_rf(e1 - value, e2 - value, e3 - value).real
    if (winding.slope > 0) != shifted:
        height = -height
    return acb(lattice.half_period if shifted else 0, height)
