"""Dokshevich's motions of 1966: a periodic motion of every Hess top, with M·γ = 0 and M·r not 0.

The top is Hess': P b = 0, I1 (I2 − I3) a² = I3 (I1 − I2) c², so that one circular section of M·I⁻¹M holds axis 2 and is
across r.  In axes e1 along n = P r, e3 along ± axis 2, e2 = e3 × e1

    I⁻¹ = β [[a, 1, 0], [1, b, 0], [0, 0, b]],   β > 0 by the choice of e3

and with S = √(a² − ab + b² + 3), A = (b − 2a − S)/3, κ = (a + b + 2S)/3, p = (ab + 3bA + 2)/(b² + 4),
σ = (2p − bA − 1)/b, K = σ − A − 1/b, C2 = A² + (a − b)A − 1 − κσ and any B > 0, in units of momentum √B and of time
1/(β√B), x = M·e1 and so on, Γ = −|n| γ/(β B):

    y = A x + 1/x,   z² = C2 x² + K − 1/x²,   Γ = (−κ (p x² + 1/b), κ (σ x² − 1), −κ x z),   |Γ| = κ/b
    x' = −z x:   v = |x| swings between the roots of f(v) = C2 v⁴ + K v² − 1 = v'²
    v = √s1 dn(√(−C2 s1) t | (s1 − s2)/s1), s1 > s2 the roots of C2 s² + K s − 1:   Ω, γ have the period 2K/√(−C2 s1)

M is level, |M|² = (1 + A² + C2) x² + 2A + K, and turns about γ at the rate |Γ| x/|M|².
Source: A. I. Dokshevich (1966) has the frame; the formulas are derived here: the residuals of all six equations vanish.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import acb, arb

from heavytop.errors import InputError, prefixed, refusal
from heavytop.exact.cases.algebraic_starts import Algebraic
from heavytop.exact.closed_form import ClosedForm, balls, cached_per_precision, once, sign, solved
from heavytop.exact.flint.balls import (
    BallLike,
    Balls,
    Undecided,
    ball,
    exponent,
    to_bits,
)
from heavytop.exact.separable.abel import decide, phase_at
from heavytop.exact.separable.oscillation import Azimuth, Bearing, Gap, Roots, WithBearing
from heavytop.exact.solution import (
    HESS,
    IN_PLANE_13,
    MOMENTS_1_3,
    NOT_ACROSS_CENTRE,
    OFF_AXES_13,
    ExactRelation,
    positive,
)
from heavytop.precision import Vector, dot, exact, rational_root, shown, vector
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

_TERMS = 1 << 14
_LEAST = 128


@dataclass(frozen=True, slots=True)
class _Constants:
    """a, b and the constants that follow from them: Fractions, or balls."""

    a: Any
    b: Any
    root: Any

    @property
    def slope(self) -> Any:
        """A."""
        return (self.b - 2 * self.a - self.root) / 3

    @property
    def size(self) -> Any:
        """κ."""
        return (self.a + self.b + 2 * self.root) / 3

    @property
    def first(self) -> Any:
        """p."""
        return (self.a * self.b + 3 * self.b * self.slope + 2) / (self.b * self.b + 4)

    @property
    def second(self) -> Any:
        """σ."""
        return (2 * self.first - self.b * self.slope - 1) / self.b

    @property
    def lead(self) -> Any:
        """C2."""
        return self.slope * self.slope + (self.a - self.b) * self.slope - 1 - self.size * self.second

    @property
    def middle(self) -> Any:
        """K."""
        return self.second - self.slope - 1 / self.b

    def ends(self) -> tuple[arb, arb]:
        """The range of v; the product of both squares is −1/C2, so that neither cancels."""
        larger = self.middle / 2 + (self.middle * self.middle / 4 + self.lead).sqrt()
        return (1 / larger).sqrt(), (larger / -self.lead).sqrt()

    def square(self, v: Any) -> Any:
        """z² at v, in units of B."""
        return self.lead * v * v + self.middle - 1 / (v * v)


class _Swing:
    """The motion in x, in units of √B and 1/(β√B), at one working precision, from v and z at t = 0.

    side: the sign of x.
    """

    def __init__(self, constants: _Constants, v: arb, z: arb, side: int) -> None:
        self.constants, self.side, self.made = constants, side, dict[Any, Any]()
        low, high = constants.ends()
        if not (low.is_finite() and high.is_finite() and low < high):
            raise Undecided
        self.ends = [(acb(-low), 1), (acb(-high), 1)]
        self.gap = Gap(low, high, Roots.of(-constants.lead, self.ends), count=1, most=_TERMS)
        self.origin = self.gap.integrals(self.gap.phase(v, -z * v * self.gap.density(v)))[0]

    def phase(self, time: arb) -> tuple[arb, int]:
        """θ and whole turns at a time in these units; raises Undecided where the working precision is too low."""
        return phase_at(self.gap, self.origin + time)

    def state(self, phase: Balls) -> tuple[list[Balls], list[Balls]]:
        """M and −Γ along e1, e2, e3."""
        c = self.constants
        v = self.gap.position(phase)
        x, z = self.side * v, self.gap.reach * phase.sin() / (self.gap.density(v) * v)
        momentum = [x, c.slope * x + 1 / x, z]
        return momentum, [c.size * (c.first * v * v + 1 / c.b), c.size * (1 - c.second * v * v), c.size * x * z]

    @cached_per_precision
    def azimuth(self) -> Azimuth:
        """The azimuth of M about γ."""
        c = self.constants
        lead, constant = 1 + c.slope * c.slope + c.lead, 2 * c.slope + c.middle
        roots, scale = list(self.ends), -c.lead
        if not lead.is_zero():
            far = acb(-constant / lead).sqrt()
            if far.imag.contains(0) and far.real.contains(0):
                raise Undecided
            far = acb(0, far.imag) if constant / lead > 0 else acb(far.real)
            roots, scale = [*roots, (far, 2), (-far, 2)], scale * lead * lead
        stops = self.gap.middle - self.gap.reach, self.gap.middle + self.gap.reach
        gap = Gap(*stops, Roots.of(scale, roots), count=2, most=_TERMS)
        return Azimuth(gap, (arb(0), self.side * sign_of(lead * self.gap.middle**2 + constant) * c.size / c.b))


def sign_of(value: arb) -> int:
    """The sign of a ball; raises Undecided where it holds 0."""
    if value.contains(0):
        raise Undecided
    return 1 if value > 0 else -1


@dataclass(frozen=True, slots=True)
class _Frame:
    """I, then e1, e2, e3 and the units, as balls: columns of the rotation, β√B, √B, and β B/|n|."""

    moments: list[arb]
    axes: tuple[tuple[arb, arb, arb], ...]
    rate: arb
    momentum: arb
    gamma: arb

    def body(self, along: Sequence[BallLike]) -> list[Any]:
        """Components along e1, e2, e3 in body axes."""
        return [sum((a * e[i] for a, e in zip(along, self.axes, strict=True)), arb(0)) for i in range(3)]


def _axes(cosine: arb, sine: arb, side: arb) -> tuple[tuple[arb, arb, arb], ...]:
    """e1, e2 and e3 with n along (cosine, 0, sine); side: ε of e3 = ε times axis 2."""
    zero = arb(0)
    return (cosine, zero, sine), (side * sine, zero, -side * cosine), (zero, side, zero)


class _Moving(WithBearing):
    """The base of the exact and the algebraic motions."""

    __slots__ = ()

    @abstractmethod
    def rate_square(self) -> Fraction:
        """β² B."""

    @abstractmethod
    def swing(self) -> _Swing:
        """The motion in x at the working precision."""

    @abstractmethod
    def frame(self) -> _Frame:
        """The axes and units at the working precision."""

    def evaluate(self, time: Fraction) -> list[BallLike]:
        swing, frame = self.swing(), self.frame()
        gap, (start, _) = swing.gap, swing.phase(frame.rate * ball(time))
        (phase,) = solved([start], lambda now: [frame.rate / gap.density(gap.position(now[0]))])
        momentum, up = swing.state(phase)
        omega = zip(frame.body(momentum), frame.moments, strict=True)
        return [*(m * frame.momentum / moment for m, moment in omega), *(g * frame.gamma for g in frame.body(up))]

    def bearing(self, time: Fraction) -> Bearing:
        """M, level, and its azimuth."""
        swing, frame = self.swing(), self.frame()
        phase, turns = swing.phase(frame.rate * ball(time))
        momentum, up = swing.state(phase)
        return Bearing.of(frame.body(up), frame.body(momentum), swing.azimuth().at(phase, turns))

    def own_time(self, time: Fraction) -> Fraction:
        """``time`` in units of about 1/(β√B)."""
        return time * Fraction(2) ** (exponent(self.rate_square()) // 2)


def _numbers(top: HeavyTop) -> tuple[Fraction, Fraction, Fraction, Fraction, Fraction]:
    """(|n|², β, a, b, ε): e3 = ε times axis 2."""
    (i1, i2, i3), (n1, _, n3) = top.inertia, top.moment
    square = n1 * n1 + n3 * n3
    skew = n1 * n3 * (1 / i1 - 1 / i3) / square
    along = (n1 * n1 / i1 + n3 * n3 / i3) / square
    return square, abs(skew), along / abs(skew), 1 / (i2 * abs(skew)), Fraction(sign(skew))


def _root_square(top: HeavyTop, _start: State) -> tuple[Fraction]:
    """S²."""
    _, _, a, b, _ = _numbers(top)
    return (a * a - a * b + b * b + 3,)


def _constants(top: HeavyTop) -> _Constants:
    """The constants of a top with rational S."""
    _, _, a, b, _ = _numbers(top)
    return _Constants(a, b, rational_root(_root_square(top, State((0, 0, 0), (0, 0, 0)))[0]))


def _components(top: HeavyTop, start: State) -> tuple[Fraction, Fraction, Fraction]:
    """B, and M·n and M·e3 at the start."""
    square, _, _, _, side = _numbers(top)
    momentum, n = top.angular_momentum(start.omega), top.moment
    x, y, z = dot(momentum, n), side * (momentum[0] * n[2] - momentum[2] * n[0]), side * momentum[1]
    return (x * y - _constants(top).slope * x * x) / square, x, z


def _levels_off(top: HeavyTop, start: State) -> list[Fraction]:
    """The defects of z² and the three components of γ, in units of B."""
    square, skew, _, b, side = _numbers(top)
    (unit, x, z), c, n, gamma = _components(top, start), _constants(top), top.moment, start.gamma
    v2 = x * x / (square * unit)
    return [
        z * z / unit - (c.lead * v2 + c.middle - 1 / v2),
        dot(gamma, n) / (skew * unit) - c.size * (c.first * v2 + 1 / b),
        side * (gamma[0] * n[2] - gamma[2] * n[0]) / (skew * unit) - c.size * (1 - c.second * v2),
        side * gamma[1] * square / skew - c.size * x * z,
    ]


@dataclass(frozen=True, slots=True)
class Dokshevich(_Moving, ClosedForm):
    """A motion of Dokshevich with exact data; S is rational then.

    Raises NotInClass unless top and start satisfy the equalities above exactly.
    """

    method = "closed form: Dokshevich, inversion of an elliptic integral"
    source = "A. I. Dokshevich, Doklady 167 (1966) 1251; formulas derived in the program"
    body = (
        IN_PLANE_13,
        OFF_AXES_13,
        MOMENTS_1_3,
        HESS,
        ExactRelation(
            "S^2 = a^2 - ab + b^2 + 3 the square of a rational number",
            "S^2",
            _root_square,
            lambda values: rational_root(values[0]) is not None,
        ),
        ExactRelation("C2 < 0", "-C2", lambda top, _: (-_constants(top).lead,), positive),
    )
    starts = (
        NOT_ACROSS_CENTRE,
        ExactRelation("B = x y - A x^2 > 0", "B", lambda top, start: (_components(top, start)[0],), positive),
        ExactRelation("z^2 and gamma as they follow from x", "z^2, gamma along r, across r, gamma2", _levels_off),
    )

    def __post_init__(self) -> None:
        ClosedForm.__post_init__(self)
        # the range of x may be so small that the Fourier series of the integral is too long
        decide(self.swing, "The range of M·r is a point", _LEAST)

    @once
    def components(self) -> tuple[Fraction, Fraction, Fraction]:
        """B, and M·n and M·e3 at the start."""
        return _components(self.top, self.start)

    @once
    def rate_square(self) -> Fraction:
        return _numbers(self.top)[1] ** 2 * self.components()[0]

    @cached_per_precision
    def swing(self) -> _Swing:
        (square, *_), (unit, x, z), c = _numbers(self.top), self.components(), _constants(self.top)
        constants = _Constants(ball(c.a), ball(c.b), ball(c.root))
        return _Swing(constants, ball(x * x / (square * unit)).sqrt(), ball(z) / ball(unit).sqrt(), sign(x))

    @cached_per_precision
    def frame(self) -> _Frame:
        square, beta, _, _, side = _numbers(self.top)
        size, skew, unit = ball(square).sqrt(), ball(beta), ball(self.components()[0])
        n1, _, n3 = (ball(part) / size for part in self.top.moment)
        axes = _axes(n1, n3, ball(side))
        return _Frame(balls(self.top.inertia), axes, skew * unit.sqrt(), unit.sqrt(), skew * unit / size)


@dataclass(frozen=True, slots=True)
class AlgebraicDokshevich(_Moving, Algebraic):
    """A motion of Dokshevich of a top with given moments: n and the start are algebraic numbers, B = 1, |γ| = 1.

    inertia: I1, I2, I3, I2 between the others.  place: of M·r/|r| at t = 0 in its range, from 0 to 1; negative in the
    range of negative M·r.  Raises InputError for moments that no such body has.
    """

    inertia: Vector
    place: Fraction
    method: str = "algebraic: Dokshevich's motion, inversion of an elliptic integral"
    system: System = HEAVY_TOP
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        i1, i2, i3 = self.inertia
        if min(self.inertia) <= 0 or not (i1 - i2) * (i2 - i3) > 0:
            raise InputError(
                f"No Hess top has the moments {', '.join(map(shown, self.inertia))}.",
                "Give positive moments, the second between the others.",
            )
        if not 0 < abs(self.place) < 1:
            raise refusal("place", "between 0 and 1, or between -1 and 0", shown(self.place), "Give 1/2, say.")

    @property
    def share(self) -> Fraction:
        """n1²/|n|²."""
        i1, i2, i3 = self.inertia
        return i3 * (i1 - i2) / (i3 * (i1 - i2) + i1 * (i2 - i3))

    def rate_square(self) -> Fraction:
        i1, _, i3 = self.inertia
        return self.share * (1 - self.share) * (1 / i1 - 1 / i3) ** 2

    @cached_per_precision
    def frame(self) -> _Frame:
        (i1, _, i3), c = self.inertia, self._constants()
        up = ball(Fraction(sign(1 / i1 - 1 / i3)))
        axes = _axes(ball(self.share).sqrt(), ball(1 - self.share).sqrt(), up)
        return _Frame(balls(self.inertia), axes, ball(self.rate_square()).sqrt(), arb(1), c.b / c.size)

    def _constants(self) -> _Constants:
        (i1, i2, i3), first = self.inertia, self.share
        skew = ball(self.rate_square()).sqrt()
        a, b = ball(first / i1 + (1 - first) / i3) / skew, ball(1 / i2) / skew
        return _Constants(a, b, (a * a - a * b + b * b + 3).sqrt())

    @cached_per_precision
    def swing(self) -> _Swing:
        c = self._constants()
        low, high = c.ends()
        v = low + (high - low) * ball(abs(self.place))
        return _Swing(c, v, c.square(v).sqrt(), sign(self.place))

    def moment(self, bits: int) -> list[arb]:
        """P r = |n| e1 with |n| = β κ/b, to at least ``bits`` bits."""

        def evaluate(_working: int) -> list[arb]:
            frame, c = self.frame(), self._constants()
            return [part * frame.rate * c.size / c.b for part in frame.axes[0]]

        return to_bits(evaluate, bits)

    def start(self, bits: int) -> list[arb]:
        """The state at t = 0."""
        return self.state(Fraction(0), bits)


def dokshevich_motion(inertia: Iterable[Any], place: Any = Fraction(1, 2)) -> AlgebraicDokshevich:
    """Dokshevich's motion of the Hess top with these moments, I2 between I1 and I3.

    place: of M·r/|r| at t = 0, as in :class:`AlgebraicDokshevich`.  Both are read by :func:`heavytop.precision.exact`.
    Raises InputError without such a top, and for a place out of range.
    """
    with prefixed("place"):
        where = exact(place)
    return AlgebraicDokshevich(vector(inertia, "inertia"), where)
