"""The base of the closed forms: one formula over power series serves the state, its series and the attitude.

A closed form is written once, over power series in ε at t + ε.  Its coefficients of ε^0 are the state; more of them
are the series whose residual proves the form.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from fractions import Fraction
from functools import wraps
from itertools import permutations
from math import factorial
from typing import Any, ClassVar, TypeVar

from flint import acb, acb_series, arb, arb_series, fmpq_series

from heavytop.errors import InputError, NotInClass, OutOfReach
from heavytop.exact.elliptic.quartic import Pair
from heavytop.exact.elliptic.weierstrass import Winding
from heavytop.exact.flint.balls import (
    FUNCTIONS,
    BallLike,
    Balls,
    ball,
    coefficient,
    current_length,
    current_precision,
    rational,
    require_undisturbed,
    series_length,
    to_bits,
)
from heavytop.exact.solution import Conditions, ExactSolution, require
from heavytop.precision import Vector, cross, dot, rational_root
from heavytop.top.attitude import attitude_from_angles, perpendicular
from heavytop.top.equations import HEAVY_TOP, Parameters, System, heavy_top
from heavytop.top.heavy_top import HeavyTop, State

# Shared by elliptic motions: caches per working precision, exact Taylor coefficients at the start, rotation in space.


Made = TypeVar("Made")


def cached_per_precision(make: Callable[[Any], Made]) -> Callable[[Any], Made]:
    """Cache ``make(motion)`` for each motion and working precision, in the motion's ``made``.

    A cache of functools would hash a dozen Fractions at each look-up, which takes longer than many states.
    """

    @wraps(make)
    def look_up(motion: Any) -> Made:
        made: dict[Any, Made] = motion.made
        key = make, current_precision()
        try:
            return made[key]
        except KeyError:
            value = make(motion)
            require_undisturbed()
            made[key] = value
            return value

    return look_up


def once(make: Callable[[Any], Made]) -> Callable[[Any], Made]:
    """Cache ``make(motion)`` for each motion: for exact results, which depend on no working precision."""

    @wraps(make)
    def look_up(motion: Any) -> Made:
        if make not in motion.made:
            motion.made[make] = make(motion)
        value: Made = motion.made[make]
        return value

    return look_up


def taylor(
    field: Callable[[Parameters, Any], tuple[Any, ...]], parameters: Parameters, start: Sequence[Fraction], length: int
) -> list[list[Fraction]]:
    """The exact Taylor coefficients of each component at the start, computed from the field."""
    exact = parameters.mapped(rational)
    rows = [[rational(value)] for value in start]
    with series_length(length):
        for order in range(1, length):
            y = [fmpq_series(row, prec=length) for row in rows]
            for row, slope in zip(rows, field(exact, y), strict=True):
                row.append(coefficient(fmpq_series(slope), order - 1) / order)
    return [[Fraction(int(c.p), int(c.q)) for c in row] for row in rows]


def unwound(real: Sequence[Fraction], imaginary: Sequence[Fraction], winding: Winding) -> list[Pair]:
    """Taylor coefficients of e^(−iκt) (u + i √square v), κ = rate √square, as pairs (real, imaginary/√square).

    real, imaginary: the coefficients of u and v.
    """
    factors = []
    for k in range(len(real)):
        a = b = Fraction(0)
        for n in range(k + 1):
            # (−iκ)^n = (−rate)^n (i√square)^n, and (i√square)² = −square
            weight = (-winding.rate) ** n * (-winding.square) ** (n // 2) / factorial(n)
            u, v = real[k - n], imaginary[k - n]
            a, b = (a + weight * u, b + weight * v) if n % 2 == 0 else (a - weight * winding.square * v, b + weight * u)
        factors.append((a, b))
    return factors


def initial_xi(gamma: Vector) -> list[arb]:
    """The default ξ at t = 0: :func:`perpendicular` of γ/|γ|; raises InputError for γ = 0."""
    square = dot(gamma, gamma)
    if square == 0:
        raise InputError("gamma must not be zero.", "Give the direction that points vertically up.")
    root = rational_root(square)
    if root is not None:
        return [ball(x) for x in perpendicular((gamma[0] / root, gamma[1] / root, gamma[2] / root))]
    size: BallLike = ball(square).sqrt()
    return list(perpendicular((ball(gamma[0]) / size, ball(gamma[1]) / size, ball(gamma[2]) / size)))  # type: ignore[arg-type]


Carry = Callable[[Sequence[Any]], list[Any]]
"""Maps the body components at t = 0 of a vector fixed in space to those at another time."""


def instant(time: Fraction) -> Any:
    """The power series t + ε, of the length set by :func:`series_length`; the number t for length 1."""
    return ball(time) if current_length() == 1 else arb_series([ball(time), 1], prec=current_length())


def solved(start: Sequence[arb], rates: Callable[[list[Any]], Sequence[Any]]) -> list[Any]:
    """The power series with y' = rates(y) from ``start``, of the length set by :func:`series_length`; numbers for 1.

    Each step of Picard's iteration adds one coefficient.
    """
    length = current_length()
    if length == 1:
        return list(start)
    series = [arb_series([value], prec=length) for value in start]
    for _ in range(length - 1):
        series = [value + arb_series(rate).integral() for value, rate in zip(start, rates(series), strict=True)]
    return series


def in_units(motion: Sequence[Any], rate: Fraction, size: Fraction) -> list[Any]:
    """Ω times ``rate`` and γ times ``size`` as series in t = t'/rate, from series in t' or numbers.

    The result has the length set by :func:`series_length`; numbers for 1.
    """
    units, length = [ball(rate)] * 3 + [ball(size)] * 3, current_length()
    if length == 1:
        return [unit * constant(component) for unit, component in zip(units, motion, strict=True)]
    factors = [ball(rate**n) for n in range(length)]
    return [
        arb_series([unit * factor * component[n] for n, factor in enumerate(factors)], prec=length)
        for unit, component in zip(units, motion, strict=True)
    ]


def unit(angle: Any) -> BallLike:
    """e^(i angle) of a number or series."""
    sine, cosine = angle.sin_cos()
    if isinstance(angle, arb):
        return acb(cosine, sine)
    return acb_series(cosine, prec=current_length()) + acb(0, 1) * acb_series(sine, prec=current_length())


def balls(vector: Sequence[Fraction]) -> list[arb]:
    """The components of an exact vector as balls."""
    return [ball(component) for component in vector]


def sign(value: Fraction) -> int:
    """+1 or −1, and +1 for 0: the sign of a root at the start."""
    return -1 if value < 0 else 1


def rotate(vector: Sequence[Balls], omega: Sequence[Fraction], time: Balls) -> list[Balls]:
    """The solution of v' = v × Ω for a constant Ω at ``time``, a number or series."""
    if not any(omega):
        return list(vector)
    rate = ball(dot(omega, omega)).sqrt()
    sine, cosine = (rate * time).sin_cos()
    return about([component / rate for component in balls(omega)], cosine, sine, vector)


def about(axis: Sequence[BallLike], cosine: BallLike, sine: BallLike, vector: Sequence[BallLike]) -> list[Any]:
    """The vector rotated about a unit vector, axis 2 towards axis 1 about axis 3, by an angle."""
    along, across = dot(axis, vector), cross(vector, axis)
    return [along * n + cosine * (v - along * n) + sine * w for n, v, w in zip(axis, vector, across, strict=True)]


def between(before: Sequence[Sequence[BallLike]], now: Sequence[Sequence[BallLike]]) -> Carry:
    """The rotation that takes one frame of three unit vectors to another."""

    def carry(vector: Sequence[BallLike]) -> list[Any]:
        parts = [dot(vector, direction) for direction in before]
        return [sum(part * e[k] for part, e in zip(parts, now, strict=True)) for k in range(3)]

    return carry


def across(gamma: Vector) -> Vector:
    """An exact vector ⟂ γ, not 0."""
    zero = Fraction(0)
    candidates = ((zero, gamma[2], -gamma[1]), (-gamma[2], zero, gamma[0]))
    return candidates[0] if any(candidates[0]) else candidates[1]


def taylor_of_fixed(parameters: Parameters, start: State, vector: Sequence[Fraction]) -> list[list[Fraction]]:
    """The first four Taylor coefficients, exact, of the body components of a vector fixed in space, of a heavy top."""

    def field(p: Parameters, y: Any) -> tuple[Any, ...]:
        return (*heavy_top(p, y[:6]), *HEAVY_TOP.attitude(p, y[:6], y[6:]))

    return taylor(field, parameters, (*start.flat, *vector), 4)[6:]


def carried_xi(gamma: Vector, carried: Callable[[Vector], tuple[Sequence[Any], Sequence[Any]]]) -> list[Any]:
    """The image of :func:`initial_xi` of γ, which need not be rational.

    carried: returns the images of b and of γ × b/|γ| for an exact vector b ⟂ γ fixed in space.
    """
    xi, size, basis = initial_xi(gamma), ball(dot(gamma, gamma)).sqrt(), across(gamma)
    exact, norm = balls(basis), ball(dot(basis, basis))
    cosine, sine = dot(xi, exact) / norm, dot(xi, cross([g / size for g in balls(gamma)], exact)) / norm
    return [cosine * a + sine * b for a, b in zip(*carried(basis), strict=True)]


def tanh_sech(argument: Balls) -> tuple[Balls, Balls]:
    """(tanh, sech) of a number or series, by decaying exponentials only."""
    side = -1 if constant(argument) < 0 else 1
    decay = (-side * argument).exp()
    total = 1 + decay * decay
    return side * (1 - decay * decay) / total, 2 * decay / total


class Evaluated(ABC):
    """A motion with one formula over power series, :meth:`evaluate`."""

    __slots__ = ()

    @abstractmethod
    def evaluate(self, time: Fraction) -> list[Any]:
        """The six components at ``time`` + ε, at FLINT's working precision and length of series.

        Raises Undecided where that precision does not suffice.
        """

    def own_time(self, time: Fraction) -> Fraction:
        """``time`` in the units in which the form computes: its size costs working bits."""
        return time

    def state(self, time: Fraction, bits: int) -> list[arb]:
        return to_bits(lambda _working: self.evaluate(time), bits, self.own_time(time))

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        series: list[arb_series] = []

        def evaluate(_working: int) -> list[arb]:
            series[:] = [whole_series(part, length) for part in self.evaluate(time)]
            return [part[0] for part in series]

        to_bits(evaluate, bits, self.own_time(time), length)
        return series


class WithXi(Evaluated):
    """A motion with a formula for its attitude, :meth:`xi_at`."""

    __slots__ = ()

    @abstractmethod
    def xi_at(self, time: Fraction) -> list[Any]:
        """ξ at ``time``, at FLINT's working precision; raises Undecided where that does not suffice."""

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ, a unit vector fixed in space and ⟂ γ, in body components; raises OutOfReach where it cannot be proven."""
        return to_bits(lambda _working: self.xi_at(time), bits, self.own_time(time))


@dataclass(frozen=True, slots=True)
class ClosedForm(WithXi):
    """The motion of ``top`` from ``start``; each case defines ``method``, ``source`` and its conditions.

    body, starts: exact conditions on the top and on the start; the constructor raises NotInClass where one fails.
    made: the cache of :func:`once` and :func:`cached_per_precision`.
    """

    top: HeavyTop
    start: State
    method: ClassVar[str]
    source: ClassVar[str]
    body: ClassVar[Conditions] = ()
    starts: ClassVar[Conditions] = ()
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require(type(self).__name__, (*self.body, *self.starts), self.top, self.start)

    @property
    def system(self) -> System:
        """The heavy top, unless a case overrides it."""
        return HEAVY_TOP

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle without caches: balls cannot be pickled."""
        return type(self), tuple(getattr(self, field.name) for field in fields(self) if field.init)


class WithAttitude(ClosedForm):
    """A closed form that moves all vectors fixed in space, γ among them, by one formula: :meth:`motion`."""

    __slots__ = ()

    @abstractmethod
    def motion(self, time: BallLike) -> tuple[list[BallLike], Carry]:
        """Ω at the number or series ``time``, and the map of vectors fixed in space."""

    def evaluate(self, time: Fraction) -> list[BallLike]:
        omega, carry = self.motion(instant(time))
        return [*omega, *carry(balls(self.start.gamma))]

    def xi_at(self, time: Fraction) -> list[Any]:
        return self.motion(instant(time))[1](initial_xi(self.start.gamma))


class WithAngles(Evaluated):
    """A motion with formulas for its Euler angles."""

    __slots__ = ()

    @abstractmethod
    def angles(self, time: Fraction, bits: int) -> list[arb]:
        """(φ, θ, ψ), continuous for all t."""

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ, the space axis ⟂ γ in body components."""

        def evaluate(working: int) -> list[arb]:
            phi, theta, psi = self.angles(time, working)
            return list(attitude_from_angles(phi, theta, psi, FUNCTIONS))

        return to_bits(evaluate, bits)


def whole_series(value: Any, length: int) -> arb_series:
    """A number or a series as the series of ``length`` coefficients; raises ContextChanged where it was cut off."""
    if isinstance(value, arb_series):
        coefficient(value, length - 1)
    return arb_series(value, prec=length)


def constant(value: Any) -> arb:
    """The coefficient of ε^0 of a series, or the ball itself."""
    return value[0] if isinstance(value, arb_series) else arb(value)


# The attitude of any exact motion: ξ, a unit vector fixed in space and ⟂ γ, in body components.
#
# The ξ of a closed form starts where its formula says.  A rotation about γ by a constant angle makes it start at
# :func:`heavytop.exact.closed_form.initial_xi`, for ξ and η = γ × ξ/|γ| are both fixed in space.


Attitude = Callable[[Fraction, int], Sequence[Any]]
"""ξ at (time, bits): three balls; or Ω, γ, ξ: nine."""


@dataclass(frozen=True, slots=True)
class Turned:
    """Ω, γ and ξ of a motion from an attitude ``own``, rotated so that ξ(0) is ``initial_xi`` of its γ.

    A call with (time, bits) returns nine balls of ``bits`` bits, Ω and γ of the same evaluation as ξ.
    It raises OutOfReach where they cannot be proven, InputError for γ = 0.
    """

    solution: ExactSolution
    own: Attitude
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __call__(self, time: Fraction, bits: int) -> list[arb]:
        def evaluate(working: int) -> list[arb]:
            cosine, sine, length = _turn(self)
            state, xi = self.solution.state(time, working), self.own(time, working)
            eta = cross([g / length for g in state[3:]], xi)
            return [*state, *(cosine * x + sine * y for x, y in zip(xi, eta, strict=True))]

        return to_bits(evaluate, bits)


@cached_per_precision
def _turn(turned: Turned) -> tuple[arb, arb, arb]:
    """Cosine and sine of the constant angle from the form's ξ(0), and |γ|."""
    gamma = turned.solution.start.gamma
    xi, own_xi = initial_xi(gamma), turned.own(Fraction(0), current_precision())
    length = ball(dot(gamma, gamma)).sqrt()
    return dot(xi, own_xi), dot(xi, cross([ball(g) / length for g in gamma], own_xi)), length


def starting_at(xi: Vector, gamma: Vector, known: Attitude) -> Attitude:
    """Ω, γ, ξ with ξ(0) = ``xi`` from those with ξ(0) = :func:`perpendicular` of γ(0) = ``gamma``, of length 1.

    The constant angle between the two has a rational cosine and sine.
    """
    began = perpendicular(gamma)
    if xi == began:
        return known
    cosine, sine = dot(xi, began), dot(xi, cross(gamma, began))

    def turned(working: int, time: Fraction) -> list[arb]:
        values = known(time, working)
        across = cross(values[3:6], values[6:])
        return [*values[:6], *(ball(cosine) * x + ball(sine) * y for x, y in zip(values[6:], across, strict=True))]

    return lambda time, bits: to_bits(lambda working: turned(working, time), bits)


# Renaming of the principal axes, once for all cases.
#
# With Q a permutation of the axes and d = det Q = ±1, Q (u × v) = d Qu × Qv.  So if (Ω, γ) solves the equations of
# the top (I, r), then
#
#     Ω~ = d QΩ,   γ~ = Qγ    solve those of the top (QI, Qr):
#     M~' = d QM' = QM × QΩ + P Qγ × Qr = M~ × Ω~ + P γ~ × r~,    γ~' = d Qγ × QΩ = γ~ × Ω~
#
# without a reversal of the time.  Likewise the gyrostat, where Q keeps axis 2 and λ = P b/(M·γ) goes to d λ, and the
# heavy gyrostat, whose k goes to d Qk as M does.  A vector fixed in space goes to its image under Q.


Axes = tuple[int, int, int]
CYCLIC: tuple[Axes, ...] = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
ALL: tuple[Axes, ...] = tuple((i, j, k) for i, j, k in permutations(range(3)))


def orientation(axes: Axes) -> int:
    """det Q: +1 for an even renaming, −1 for an odd one."""
    return 1 if axes in CYCLIC else -1


def inverse(axes: Axes) -> Axes:
    """The renaming that undoes this one."""
    i, j, k = (axes.index(axis) for axis in range(3))
    return i, j, k


def permuted(vector: Sequence[Any], axes: Axes) -> tuple[Any, Any, Any]:
    """Qv: component ``axes[k]`` of v becomes component k."""
    return vector[axes[0]], vector[axes[1]], vector[axes[2]]


def renamed_top(top: HeavyTop, axes: Axes) -> HeavyTop:
    """The top with its axis ``axes[k]`` called k."""
    d = orientation(axes)
    rotor = None if top.rotor is None else [d * k for k in permuted(top.rotor, axes)]
    return HeavyTop(permuted(top.inertia, axes), top.weight, permuted(top.centre, axes), rotor)


def renamed_state(state: State, axes: Axes) -> State:
    """(d QΩ, Qγ)."""
    d = orientation(axes)
    return State([d * w for w in permuted(state.omega, axes)], permuted(state.gamma, axes))


@dataclass(frozen=True, slots=True)
class Renamed:
    """A motion of the top whose axis k is axis ``axes[k]`` of the solution's top."""

    solution: ExactSolution
    axes: Axes
    top: HeavyTop = field(init=False)
    start: State = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "top", renamed_top(self.solution.top, self.axes))
        object.__setattr__(self, "start", renamed_state(self.solution.start, self.axes))

    @property
    def method(self) -> str:
        """The method of the solution, and the new names of its axes."""
        axes = inverse(self.axes)
        return f"{self.solution.method}, axes renamed {axes[0] + 1}, {axes[1] + 1}, {axes[2] + 1}"

    @property
    def source(self) -> str:
        """The source of the solution."""
        return self.solution.source

    @property
    def system(self) -> System:
        """The system of the solution."""
        return self.solution.system

    def _renamed(self, values: Sequence[Balls]) -> list[Balls]:
        omega: tuple[BallLike, ...] = permuted(values[:3], self.axes)
        if orientation(self.axes) < 0:
            # negated exactly: a minus sign would round to FLINT's current precision
            omega = tuple(w.neg(exact=True) if isinstance(w, arb) else -w for w in omega)
        return [*omega, *permuted(values[3:6], self.axes)]

    def state(self, time: Fraction, bits: int) -> list[arb]:
        return self._renamed(self.solution.state(time, bits))

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        with series_length(length):
            return self._renamed(self.solution.series(time, length, bits))

    def second_state(self, time: Fraction, bits: int) -> list[arb]:
        """The state by the solution's second closed form.  Raises OutOfReach where it has none."""
        second = getattr(self.solution, "second_state", None)
        if second is None:
            raise OutOfReach("This motion has only one closed form.", "Certify it by the enclosure.")
        return self._renamed(second(time, bits))

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ from :func:`heavytop.exact.closed_form.initial_xi` in the new names.

        Raises NotInClass where the solution has no attitude.
        """
        return Turned(self, self.own_attitude)(time, bits)[6:]

    def own_attitude(self, time: Fraction, bits: int) -> Sequence[arb]:
        """ξ of the solution in the new names.  Raises NotInClass where it has no attitude."""
        attitude = getattr(self.solution, "attitude", None)
        if attitude is None:
            raise NotInClass(f"{self.method} has no attitude in closed form.", "Integrate it with the motion.")
        return permuted(attitude(time, bits), self.axes)
