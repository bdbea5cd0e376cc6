"""The Delone class of the Kovalevskaya top, I1 = I2 = 2 I3, c = 0: the motions with ξ = 0, all of them elliptic.

With n = P r = (n1, n2, 0), w = Ω1 + iΩ2, g = γ1 + iγ2, the class is w² = (n1 + i n2) g/I3, two exact equations.  On it
the integrals read, with A = Ω·n/|n| (Ω along r) and N = |n|/I3,

    (2A)² + Ω3² = const,   |g|² + γ3² = |γ|²,   2A|g| + Ω3 γ3 = const,   N|g| = |w|²

so that the plane vectors (2A, Ω3) and (|g|, γ3) keep their lengths and their angle and turn together, through b(t):

    b' = −(n × Ω)_3/|n|,   b'² = |w|² − A² = |w0|² cos b − N γ3(0) sin b − (A0 cos b − ½ Ω3(0) sin b)²

With y = tan(b/2)/|n| y'² is a quartic with rational coefficients, y(0) = 0, which Biermann and Weierstrass solve
(:mod:`heavytop.exact.elliptic.quartic`), and cos b, sin b/|n| follow from numerator and denominator of y, b' from their
series.  r may lie anywhere in the plane, and γ have any length.  A double root of the quartic means hyperbolic or
circular functions.

The homoclinic one of them starts at Ω = (0, 0, 2α), γ = (0, 0, 1) with P b = α² I1/2, the paper's own data:

    q = tanh²(α t/√2),  sinθ = q/(2 − q),  cosφ = 2 sinθ − 1,  sinφ = −sgn(t) 2 √(sinθ (1 − sinθ)),  ψ = α t
    Ω = ( (α/2) sinφ,  α sinθ,  2 α cosθ ),   γ = ( sinθ sinφ, sinθ cosφ, cosθ )

In T = tanh(α t/√2), S = sech(α t/√2) no root is left: with d = 1 + S² (= 2 − q)

    sinθ = T²/d,  cosθ = 2 S/d,  sinφ = −2√2 T S/d

It is homoclinic to Ω = (0, α, 0), γ = (0, 1, 0) with rate α/√2.
Source: Delone's class is Kovalevskaya's of the first degenerate kind, Appelrot; derived here from ξ = 0 and (1.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import acb, arb

from heavytop.errors import NotInClass, OutOfReach
from heavytop.exact.cases.kovalevskaya import Interval, along_gamma, branch_points, interval_of, level_vector, pole
from heavytop.exact.cases.kovalevskaya_theta import KovalevskayaLevel, PhiRoot, start_of
from heavytop.exact.closed_form import (
    ClosedForm,
    WithAngles,
    balls,
    cached_per_precision,
    constant,
    initial_xi,
    instant,
    tanh_sech,
)
from heavytop.exact.elliptic.quartic import PreparedMotion, QuarticMotion
from heavytop.exact.flint.balls import BallLike, ball, coefficient, current_length, series_length, to_bits
from heavytop.exact.separable.abel import phase_at
from heavytop.exact.separable.oscillation import Azimuth, Bearing, Gap, Roots, WithBearing
from heavytop.exact.solution import SPIN_UPWARDS, XI, ExactRelation, apart, plane_top
from heavytop.precision import shown
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State

# Attitude of Delone's motions: the azimuth of :mod:`heavytop.exact.cases.kovalevskaya` where w2 = 0.
#
# In its units, and with k = 0, one separated variable is 0 and the other, w ≤ 0, has w'² = −2 ((w + h)(w² + G) − C²/2).
# The level vector v has v² = 4e (q² w − e q²) and the azimuth Λ' = (l/2) (1 + e/(w − e)), e = l²/2 − h.  As
# 2p, r and s/c, γ^3 are plane vectors of lengths √(2h) and 1 with the product l, e ≤ 0; e = 0 (they are parallel) is
# refused: v = 0 there.  In V = 1/(w − μ), V = m + d cos θ in its gap, θ' = √g and
#
#     t = ∫ dθ/√g,    Λ = (l/2) (t + e ∫ V/((1 − εV) √g) dθ),    ε = e − μ
#
# φ(e) ≥ 0 keeps e out of the gap.  A double root of the cubic leaves no period: refused.


_REMEDY = "Request the state alone, or the attitude of the enclosure."
MOST_TERMS = 1 << 16


@dataclass(frozen=True, slots=True)
class DeloneAzimuth:
    """The azimuth Λ of a motion of Delone's at one working precision.

    gap: of V.  origin: its integral at t' = 0.  integral: Λ − (l/2) t'; None where l = 0 and Λ is constant.
    """

    level: KovalevskayaLevel
    gap: Gap
    origin: arb
    integral: Azimuth | None

    @classmethod
    def of(cls, level: KovalevskayaLevel) -> DeloneAzimuth:
        """The azimuth at the working precision.

        Raises Undecided where that does not suffice, OutOfReach for e = 0, a double root of the cubic, and Fourier
        series of too many terms.
        """
        cubic, e = level.cubic(), level.double()
        if e == 0 or cubic.gcd(cubic.derivative()).degree() > 0:
            raise OutOfReach(f"Delone's level is degenerate: e = {e}, or a double root of its cubic.", _REMEDY)
        roots: Any = cubic.complex_roots()
        curve = [PhiRoot(acb(value), 1, True) for value, _ in roots]
        start = start_of(level)
        interval = interval_of(0, curve, start)
        # beyond the roots of the cubic, or between them and 0, where the other variable rests
        mu, _ = pole([*curve, PhiRoot(acb(0), 2, False)], [interval])
        gap, offset = _gap(curve, interval, mu), ball(e) - mu
        with series_length(2):
            inverse = start.inverses(mu)[0]
            value, slope = arb(coefficient(inverse, 0)), arb(coefficient(inverse, 1))
        phase = gap.phase(value, slope * gap.density(value))
        if level.area == 0:
            return cls(level, gap, gap.integrals(phase)[0], None)
        low, high = gap.middle - gap.reach, gap.middle + gap.reach
        with_pole = Gap(low, high, gap.rest.with_line(offset), count=2, most=MOST_TERMS)
        side = -1 if offset * gap.middle > 1 else 1
        weight = side * ball(e) * along_gamma(level) / 2
        return cls(level, gap, gap.integrals(phase)[0], Azimuth(with_pole, (arb(0), weight)))

    def bearing(self, time: Fraction, state: Sequence[arb]) -> Bearing:
        """v in the top's own axes, and Λ; state: Ω and γ at ``time``."""
        level, moment = self.level, ball(time * self.level.rate)
        state = _turned(level, state)
        azimuth = along_gamma(level) * moment / 2
        if self.integral is not None:
            phase, turns = phase_at(self.gap, self.origin + moment)
            azimuth += self.integral.at(phase, turns)
        return Bearing.of(level.in_body(state[3:]), level.in_body(level_vector(level, state)), azimuth)


def _turned(level: KovalevskayaLevel, state: Sequence[arb]) -> list[arb]:
    """Ω and γ in the level's units and turned frame."""
    (n1, n2), c = (ball(n) for n in level.moment), ball(level.moment_square).sqrt()
    vectors = []
    for unit, (x, y, z) in ((level.rate, state[:3]), (level.size, state[3:])):
        vectors += [part / ball(unit) for part in ((n1 * x + n2 * y) / c, (n1 * y - n2 * x) / c, z)]
    return vectors


def _gap(curve: list[PhiRoot], interval: Interval, mu: arb) -> Gap:
    """The gap of V with the integral of the time."""
    branch, lead = branch_points(curve, mu)
    low, high = (branch[number].real for number in interval)
    others = [(b, 1) for number, b in enumerate(branch) if number not in interval]
    return Gap(low, high, Roots.of(lead, others), count=1, most=MOST_TERMS)


@dataclass(frozen=True, slots=True)
class Delone(WithBearing, ClosedForm):
    """Every motion of the Delone class with the small moment on axis 3.

    Raises NotInClass unless I1 = I2 = 2 I3, P c = 0, P r ≠ 0 and ξ = 0, exactly.
    """

    method = "closed form: Delone class of the Kovalevskaya top, Weierstrass functions"
    source = "Delone's class of Kovalevskaya's top; formulas derived in the program"
    body = plane_top(2)
    starts = (XI,)

    def evaluate(self, time: Fraction) -> list[Any]:
        length = current_length()
        with series_length(length + 1):
            cosine, sine = self._turn(time)
            square, along, _, weight = _prepared(self)[1]
            # the component across r is −b': one more coefficient, then one less
            across = -square * (cosine * sine.derivative() - sine * cosine.derivative())
        n1, n2, _ = balls(self.top.moment)
        w3, g3, i3 = (ball(v) for v in (self.start.omega[2], self.start.gamma[2], self.top.inertia[2]))
        forward = along * cosine - w3 * square / 2 * sine
        first, second = (n1 * forward - n2 * across) / square, (n2 * forward + n1 * across) / square
        real, imaginary = first * first - second * second, 2 * first * second
        state = [
            first,
            second,
            w3 * cosine + 2 * along * sine,
            i3 / square * (n1 * real + n2 * imaginary),
            i3 / square * (n1 * imaginary - n2 * real),
            g3 * cosine + i3 * weight * sine,
        ]
        return state if length > 1 else [constant(part) for part in state]

    def bearing(self, time: Fraction) -> Bearing:
        """The bearing of v; raises OutOfReach on the degenerate levels and very near them."""
        azimuth = _azimuth(self)
        with series_length(1):
            return azimuth.bearing(time, self.evaluate(time))

    def _turn(self, time: Fraction) -> tuple[Any, Any]:
        """cos b and sin b/|n|."""
        motion, (square, *_) = _prepared(self)
        point = motion.lattice.point(time, current_length())
        below, above = motion.denominator(point), motion.numerator(point)
        total = below * below + square * (above * above)
        return (below * below - square * (above * above)) / total, 2 * (above * below) / total


def _constants(case: Delone) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """|n|², Ω·n, (n × Ω)_3 and |w|² at t = 0."""
    n1, n2, _ = case.top.moment
    w1, w2, _ = case.start.omega
    return n1 * n1 + n2 * n2, n1 * w1 + n2 * w2, n1 * w2 - n2 * w1, w1 * w1 + w2 * w2


@cached_per_precision
def _prepared(case: Delone) -> tuple[PreparedMotion, list[arb]]:
    square, along, across, weight = _constants(case)
    spin, lift = case.start.omega[2], case.start.gamma[2] / case.top.inertia[2]
    # (weight − 2 s lift y − s weight y²)(1 + s y²) − (along − spin s y − s along y²)²/s with s = |n|², over 4 s
    coefficients = (
        weight - along**2 / square,
        2 * along * spin - 2 * square * lift,
        2 * along**2 - square * spin**2,
        -2 * square**2 * lift - 2 * along * spin * square,
        -(square**2) * weight - square * along**2,
    )
    quartic = tuple(c / (4 * square) for c in coefficients)
    return QuarticMotion(quartic, Fraction(0), -across / (2 * square)).prepared(), balls(_constants(case))


@cached_per_precision
def _azimuth(case: Delone) -> DeloneAzimuth:
    initial_xi(case.start.gamma)  # raises InputError for γ = 0
    return DeloneAzimuth.of(KovalevskayaLevel.of(case.top, case.start))


@dataclass(frozen=True, slots=True)
class DeloneHomoclinic(WithAngles):
    """The heavy-top motion that (4.2)-(4.6) should have been for I1 = I2 = 2 I3.

    alpha: α > 0, 1/time.  i1: I1 = I2 = 2 I3 > 0.  Raises NotInClass outside.
    """

    alpha: Fraction
    i1: Fraction
    method = "closed form: Delone homoclinic"
    source = "Delone's class of Kovalevskaya's top; formulas derived in the program"
    system = HEAVY_TOP
    body = plane_top(2)
    starts = (
        SPIN_UPWARDS,
        ExactRelation(
            "the top and start of alpha = Omega3/2",
            "the difference",
            lambda top, start: apart(DeloneHomoclinic.of(top, start), top, start),
        ),
    )

    def __post_init__(self) -> None:
        if self.alpha <= 0 or self.i1 <= 0:
            raise NotInClass(f"alpha = {shown(self.alpha)}, I1 = {shown(self.i1)}.", "Both must be positive.")

    @classmethod
    def of(cls, top: HeavyTop, start: State) -> DeloneHomoclinic:
        """The motion with this I1 and Ω3."""
        return cls(start.omega[2] / 2, top.inertia[0])

    @property
    def top(self) -> HeavyTop:
        """The Kovalevskaya top with P = 1, centre of mass on axis 2 at b = α² I1/2."""
        return HeavyTop((self.i1, self.i1, self.i1 / 2), 1, (0, self.alpha**2 * self.i1 / 2, 0))

    @property
    def start(self) -> State:
        """The state at t = 0."""
        return State((0, 0, 2 * self.alpha), (0, 0, 1))

    def _sines(self, time: Fraction) -> tuple[Any, Any, Any, Any]:
        """(sinφ, cosφ, sinθ, cosθ) as power series."""
        tanh, sech = tanh_sech(ball(self.alpha) / arb(2).sqrt() * instant(time))
        d = 1 + sech * sech
        sin_theta, cos_theta = tanh * tanh / d, 2 * sech / d
        # 1 - sinθ = 2 S²/d, so the root is exact and odd in t
        return -arb(8).sqrt() * (tanh * sech) / d, 2 * sin_theta - 1, sin_theta, cos_theta

    def evaluate(self, time: Fraction) -> list[BallLike]:
        alpha = ball(self.alpha)
        sin_phi, cos_phi, sin_theta, cos_theta = self._sines(time)
        omega = [alpha / 2 * sin_phi, alpha * sin_theta, 2 * alpha * cos_theta]
        return [*omega, sin_theta * sin_phi, sin_theta * cos_phi, cos_theta]

    def angles(self, time: Fraction, bits: int) -> list[arb]:
        """(φ, θ, ψ), continuous for all t: θ in [0, π/2), φ rising from 0 through π at t = 0, where ψ = 0, to 2π."""

        def evaluate(_working: int) -> list[arb]:
            with series_length(1):
                sin_phi, cos_phi, sin_theta, cos_theta = self._sines(time)
            phi = arb.pi() + arb.atan2(-sin_phi, -cos_phi)
            return [phi, arb.atan2(sin_theta, cos_theta), ball(self.alpha * time)]

        return to_bits(evaluate, bits)
