"""Goryachev's motions, which pass through rest: I1 = I2 = 4 I3, c = 0, M·γ = 0 and G = 0, by Jacobi functions.

In the notation of :mod:`heavytop.exact.cases.goryachev_chaplygin`, with G = 0, |h| < a and κ² = a² − h²,

    f(u) = u² (a + h − u²/2)(a − h + u²/2):   both variables leave the double root 0 at one time, the body at rest

In the time τ, dτ = dt/(u1 − u2), each moves by itself and log u grows by ± κτ there.  With p_k = tan(φ_k/2) of

    u1 = (2κ/√a) p1/w1,   u2 = −(2κ/√a) p2/w2,   w_k² = 1 + p_k⁴ − 2 (h/a) p_k² = (p_k² − h/a)² + κ²/a²

p_k ∝ e^(κτ), so that p1/p2 is constant, and t = ∫ (u1 − u2) dτ = (F(φ1|m) + F(φ2|m))/√a, m = (a + h)/(2a).  Euler's
addition theorem solves these two equations: with γ = (·, γ2, γ3) at rest in the turned frame, e² = γ2² + γ3² = (κ/c)²
and s, k, δ = sn, cn, dn of √a t/2, t from the rest,

    p1 = (e − γ2) sδ/(B + A),   p2 = (e + γ2) sδ/(B + A),   A = k √(γ2² + γ3²δ²),   B = √(e²k² + (1 − m) γ3²s²)

B² − A² = γ3²s²δ².  Where k < 0, 1/p1 and 1/p2 are the numbers (e + γ2) sδ/(B − A), (e − γ2) sδ/(B − A): with these the
same formulas hold but for the sign of Ω1, γ2 and γ3.  With x = sδ/(B ± A), V = (w1w2)^(3/2) and o = (e − γ2)/w1 +
(e + γ2)/w2

    p = −κ² γ3 x (p2² − p1²)/(a^(3/2) V)      q = κ γ3 x (a (1 + p1²p2²) − h (p1² + p2²))/(a^(3/2) V)     r = u1 + u2
    γ1 = (2h − u1² − u1u2 − u2²)/(2c)         γ2 = −κ ((e − γ2)(1 − p1⁴)/w1³ − (e + γ2)(1 − p2⁴)/w2³)/(c o)
    γ3 = 2 κ γ3 (1 − p1²p2²)/(c V o)

The body comes to rest again at √a t = 4 K(m) and retraces its path.  A start that is not at rest is some
time after the rest: two elliptic integrals, from u1 and u2.

*Attitude.*  M is level, and its azimuth Λ about γ has Λ' = |γ| n·M/|M|².  With y = x²

    dΛ/dy = −4 e γ2 γ3/(√(w1w2) ((e − γ2) w2 + (e + γ2) w1))

which is integrated as it stands, from the rest on, by FLINT's validated quadrature; γ3² y runs from 0 to 1 and back.

*h = a.*  Then rest is reached at the upright equilibrium only, in infinite time, and all of it is elementary:
u1 = 2√a sech v1, u2 = −2√a sech v2, with s_k = sech v_k, v1 + v2 = √a t + const and a constant

    Δ = sinh v1 − sinh v2 = 2 cosh ½(v1 + v2) sinh ½(v1 − v2)
    p = −σ√a (s1s2)^(3/2) Δ      q = −σ√a (s1s2)^(3/2) (1 + sinh v1 sinh v2)      r = 2√a (s1 − s2)
    cγ1 = a − 2a (s1² − s1s2 + s2²)      cγ2 = 2a (s1³ sinh v1 − s2³ sinh v2)/(s1 + s2)
    cγ3 = 2aσ (s1s2)^(3/2) (sinh v1 + sinh v2)/(s1 + s2)

Source: D. N. Goryachev, Mat. sbornik 21 (1900) 431; derived here from the separated variables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import count
from typing import Any, TypeVar

from flint import acb, arb

from heavytop.errors import OutOfReach
from heavytop.exact.cases.goryachev_chaplygin import GoryachevLevel, separated_start, size_of
from heavytop.exact.closed_form import ClosedForm, cached_per_precision, constant, instant
from heavytop.exact.elliptic.jacobi import Jacobi, jacobi, legendre_f
from heavytop.exact.flint.balls import BallLike, Balls, ball, series_length, the_only
from heavytop.exact.separable.oscillation import Bearing, WithBearing
from heavytop.exact.solution import GAMMA, LEVEL_MOMENTUM, ExactRelation, plane_top
from heavytop.top.heavy_top import HeavyTop, State

_MOST_VALUES = 1 << 14


def _off_axis(_top: HeavyTop, start: State) -> Sequence[Fraction]:
    """Ω1, Ω2, and γ3 at rest."""
    return (*start.omega[:2], Fraction(0) if start.omega[2] else start.gamma[2])


@dataclass(frozen=True, slots=True)
class GoryachevChaplyginRest(WithBearing, ClosedForm):
    """A motion of the Goryachev-Chaplygin top, the small moment on axis 3, that is at rest at some time or tends to it.

    Raises NotInClass unless I1 = I2 = 4 I3, P c = 0, P r ≠ 0, M·γ = 0, G = 0 and h² ≤ a², all exactly, and for
    rotations about axis 3 and equilibria.
    """

    method = "closed form: Goryachev, through rest, Jacobi functions"
    source = "D. N. Goryachev, Mat. sbornik 21 (1900) 431"
    body = plane_top(4)
    starts = (
        GAMMA,
        LEVEL_MOMENTUM,
        ExactRelation("G = 0", "G", lambda top, start: (GoryachevLevel.of(top, start).third,)),
        ExactRelation(
            "h^2 <= |P r|^2 |gamma|^2",
            "the right side less the left",
            lambda top, start: (_room(GoryachevLevel.of(top, start)),),
            lambda values: values[0] >= 0,
        ),
        ExactRelation("M or the torque off axis 3", "one of these", _off_axis, any),
    )

    def own_time(self, time: Fraction) -> Fraction:
        """``time`` in the unit of the level."""
        return GoryachevLevel.of(self.top, self.start).rate * time

    def evaluate(self, time: Fraction) -> list[BallLike]:
        motion = _motion(self)
        level = motion.level
        return level.restored(motion.state(instant(level.rate * time)))

    def bearing(self, time: Fraction) -> Bearing:
        """The bearing of M, along γ × n at rest; raises OutOfReach for h = a."""
        motion = _motion(self)
        if isinstance(motion, UprightMotion):
            raise OutOfReach("The azimuth of M is not known for h = a.", "Integrate the attitude with the motion.")
        with series_length(1):
            pair = motion.at(ball(motion.level.rate * time))
            gamma, momentum = (motion.level.in_body(v) for v in (pair.state()[3:], pair.momentum()))
        return Bearing.of(gamma, momentum, pair.azimuth())


@cached_per_precision
def _motion(case: GoryachevChaplyginRest) -> RestMotion | UprightMotion:
    level = GoryachevLevel.of(case.top, case.start)
    return RestMotion.of(level) if _room(level) else UprightMotion.of(level)


def _room(level: GoryachevLevel) -> Fraction:
    """κ² = a² − h²."""
    return level.moment_square * level.gamma_square - level.energy**2


def _speeds(level: GoryachevLevel) -> list[tuple[arb, arb]]:
    """(|u_k|, y_k) at the start."""
    (_, w2, _, _, g2, g3), c = level.turned(), ball(level.moment_square).sqrt()
    return [(abs(u), c * (2 * w2 * g3 - g2 * u)) for u in separated_start(level)]


def _the_one(level: GoryachevLevel, possible: Sequence[Signed]) -> Signed:
    """The motion, of two that differ in σ, with the start of the level; raises Undecided where balls do not decide."""
    with series_length(1):
        start = level.turned()
        return the_only(
            [
                motion
                for motion in possible
                if all(a.overlaps(b) for a, b in zip(motion.state(arb(0)), start, strict=True))
            ]
        )


@dataclass(frozen=True, slots=True)
class RestMotion:
    """A level at one working precision.

    energy, size, moment: h, a and c.  speed: κ.  tilt, across, upright: e, γ2 and γ3 at rest.  shares: e − γ2, e + γ2.
    functions: of parameter m.  origin: √a t/2 at the start.
    """

    level: GoryachevLevel
    energy: arb
    size: arb
    moment: arb
    speed: arb
    tilt: arb
    across: arb
    upright: arb
    shares: tuple[arb, arb]
    functions: Jacobi
    origin: arb

    @classmethod
    def of(cls, level: GoryachevLevel) -> RestMotion:
        """At the working precision; raises Undecided where it does not suffice."""
        a, c, h = size_of(level), ball(level.moment_square).sqrt(), ball(level.energy)
        room = ball(_room(level))
        speed = room.sqrt()
        # a − h or a + h, whichever cancels, from their product
        above, below = (a + h, room / (a + h)) if level.energy > 0 else (room / (a - h), a - h)
        functions = jacobi(above / (2 * a), below / (2 * a))
        tilt, start = speed / c, level.turned()
        at_rest = cls(level, h, a, c, speed, tilt, start[4], start[5], (tilt, tilt), functions, arb(0))
        if not any(level.omega):
            # e − γ2 and e + γ2 of e² = γ2² + γ3², without cancellation
            larger = tilt + abs(start[4])
            smaller = start[5] * start[5] / larger
            return replace(at_rest, shares=(larger, smaller) if start[4] < 0 else (smaller, larger))
        tangents, origin = at_rest._passed(above, below)
        first, second = (2 * tilt * p / (tangents[0] + tangents[1]) for p in tangents)
        upright = (first * second).sqrt()
        moving = replace(at_rest, across=(second - first) / 2, origin=origin, shares=(first, second))
        return _the_one(level, [replace(moving, upright=sign * upright) for sign in (1, -1)])

    def _passed(self, above: arb, below: arb) -> tuple[list[arb], arb]:
        """p1 and p2 at the start, and √a t/2 since the rest; above, below: a + h and a − h."""
        tangents, origin = [], arb(0)
        for u, slope in _speeds(self.level):
            # (a − h + u²/2)(a + h), sin²φ and cos φ
            scale = (below + u * u / 2) * above
            square = self.size * u * u / scale
            cosine = slope * self.speed / (u * scale)
            delta = (below * above / scale).sqrt()
            if cosine > 0:
                less, more = square / (1 + cosine), 1 + cosine
                sum_of_both = delta + cosine
            else:
                less = 1 - cosine
                more = square / less
                sum_of_both = below / (2 * self.size) * square / (delta - cosine)
            tangents.append((less / more).sqrt())
            # half of F(φ|m) has sn² = (1 − cos φ)/(1 + Δ), Δ² = 1 − m sin²φ
            origin += legendre_f(less / (1 + delta), sum_of_both / (1 + delta), sum_of_both / more)
        return tangents, origin

    def state(self, time: Balls) -> list[Balls]:
        """The six components in the turned frame at a number or series."""
        return self.at(time).state()

    def at(self, time: BallLike) -> PathPoint:
        """The point of the path at a number or series."""
        root = self.size.sqrt()
        s, k, delta = self.functions.functions(time * (root / 2) + self.origin)
        g2, g3 = self.across * self.across, self.upright * self.upright
        far = (self.tilt * self.tilt * k * k + self.functions.complement * g3 * s * s).sqrt()
        near = (g2 + g3 * delta * delta).sqrt() * k
        side = -1 if constant(k) < 0 else 1
        return PathPoint(self, s * delta / (far + side * near), side, root)

    def swept(self, end: arb) -> arb:
        """The integral of dΛ/dy from 0 to ``end``; raises OutOfReach where the quadrature takes too long."""
        (share1, share2), cosine, sine = self.shares, self.energy / self.size, self.speed / self.size

        def width(square: acb, analytic: bool) -> acb:
            return ((square - cosine) ** 2 + sine * sine).sqrt(analytic=analytic)

        evaluations = count()

        def slope(y: acb, analytic: bool) -> acb:
            if next(evaluations) > _MOST_VALUES:
                return acb("nan")
            w1, w2 = width(y * share1 * share1, analytic), width(y * share2 * share2, analytic)
            return 1 / (w1.sqrt(analytic=analytic) * w2.sqrt(analytic=analytic) * (share1 * w2 + share2 * w1))

        middle = acb(end.mid())
        # FLINT integrates to exact ends; the mean value theorem covers the radius
        total = (acb(end) - middle) * slope(acb(end), False) + acb.integral(slope, acb(0), middle)
        if next(evaluations) > _MOST_VALUES:
            raise OutOfReach(
                f"The azimuth of M takes more than {_MOST_VALUES} values of its integrand: gamma at rest is nearly "
                "parallel or perpendicular to the centre of mass.",
                "Integrate the attitude with the motion.",
            )
        return -4 * self.tilt * self.across * self.upright * total.real


@dataclass(frozen=True, slots=True)
class PathPoint:
    """A point of the path of a motion, with numbers or series.

    lift: x.  side: −1 where 1/p1 and 1/p2 replace p1 and p2.
    """

    motion: RestMotion
    lift: Any
    side: int
    root: arb

    def _tangents(self) -> tuple[list[BallLike], list[BallLike], list[arb]]:
        """p_k, w_k and e ∓ γ2."""
        shares = list(self.motion.shares[:: self.side])
        tangents = [share * self.lift for share in shares]
        return tangents, [self._width(p * p) for p in tangents], shares

    def _width(self, square: Balls) -> Balls:
        excess, sine = square - self.motion.energy / self.motion.size, self.motion.speed / self.motion.size
        return (excess * excess + sine * sine).sqrt()

    def state(self) -> list[Any]:
        """The six components in the turned frame."""
        motion, side = self.motion, self.side
        (p1, p2), (w1, w2), shares = self._tangents()
        lead = 2 * motion.speed / self.root
        u1, u2 = p1 * (lead / w1), p2 * (-lead / w2)
        o1, o2 = shares[0] / w1, shares[1] / w2
        product = w1 * w2
        across = motion.speed / (motion.moment * (o1 + o2))
        squares = u1 * u1 + u1 * u2 + u2 * u2
        gamma = [
            (2 * motion.energy - squares) / (2 * motion.moment),
            -side * across * (o1 * (1 - p1**4) / (w1 * w1) - o2 * (1 - p2**4) / (w2 * w2)),
            2 * side * motion.upright * across * (1 - p1 * p1 * p2 * p2) / (product * product.sqrt()),
        ]
        return [*(self.lift * m / i for m, i in zip(self.momentum(), (4, 4, 1), strict=True)), *gamma]

    def momentum(self) -> list[BallLike]:
        """M/x, not 0, in the turned frame."""
        motion = self.motion
        (p1, p2), (w1, w2), shares = self._tangents()
        product, speed = w1 * w2, motion.speed
        square1, square2 = p1 * p1, p2 * p2
        share = 4 * speed * motion.upright / (motion.size * self.root * product * product.sqrt())
        return [
            -self.side * speed * share * (square2 - square1),
            share * (motion.size * (1 + square1 * square2) - motion.energy * (square1 + square2)),
            (shares[0] / w1 - shares[1] / w2) * (2 * speed / self.root),
        ]

    def azimuth(self) -> arb:
        """Λ."""
        motion = self.motion
        swept = motion.swept(self.lift * self.lift)
        return swept if self.side > 0 else 2 * motion.swept(1 / (motion.upright * motion.upright)) - swept


@dataclass(frozen=True, slots=True)
class UprightMotion:
    """A level with h = a at one working precision.

    size, moment: a and c.  sum, difference: v1 + v2 at the start, and Δ.  sign: σ.
    """

    level: GoryachevLevel
    size: arb
    moment: arb
    sum: arb
    difference: arb
    sign: int

    @classmethod
    def of(cls, level: GoryachevLevel) -> UprightMotion:
        """At the working precision; raises Undecided where it does not suffice."""
        # sinh v = −2y/|u|³
        sinh1, sinh2 = (-2 * y / u**3 for u, y in _speeds(level))
        c, total = ball(level.moment_square).sqrt(), sinh1.asinh() + sinh2.asinh()
        return _the_one(level, [cls(level, size_of(level), c, total, sinh1 - sinh2, sign) for sign in (1, -1)])

    def state(self, time: Balls) -> list[Balls]:
        """The six components in the turned frame at a number or series."""
        a, root = self.size, self.size.sqrt()
        half = (time * root + self.sum) / 2
        up, down = half.exp(), (-half).exp()
        # sinh and cosh of (v1 − v2)/2
        sine = self.difference / (up + down)
        cosine = (sine * sine + 1).sqrt()
        sinh, cosh = (up - down) / 2, (up + down) / 2
        sinh1, sinh2 = sinh * cosine + cosh * sine, sinh * cosine - cosh * sine
        s1, s2 = (1 / (x * x + 1).sqrt() for x in (sinh1, sinh2))
        product = s1 * s2
        power, across = self.sign * product * product.sqrt(), 2 * a / (self.moment * (s1 + s2))
        return [
            -root * power * self.difference,
            -root * power * (1 + sinh1 * sinh2),
            2 * root * (s1 - s2),
            (a - 2 * a * (s1 * s1 - product + s2 * s2)) / self.moment,
            across * (s1**3 * sinh1 - s2**3 * sinh2),
            across * power * (sinh1 + sinh2),
        ]


Signed = TypeVar("Signed", RestMotion, UprightMotion)
