"""What the closed forms share: one formula over power series serves the state, its series and the attitude.

A closed form is written once, over power series in ε at t + ε.  Its coefficients of ε^0 are the state; more of them
are the series whose residual proves the form.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import Any, ClassVar

from flint import acb, acb_series, arb, arb_series

from heavytop.exact.balls import FUNCTIONS, ball, to_bits
from heavytop.exact.conditions import Conditions, require
from heavytop.exact.flint_context import coefficient, current_length
from heavytop.exact.flint_context import series_length as series_length
from heavytop.exact.motion import initial_xi
from heavytop.top.angles import attitude_from_angles
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State, Vector, cross, dot

Carry = Callable[[Sequence[Any]], list[Any]]
"""Takes the body components at t = 0 of a vector fixed in space to those at the time in question."""


def instant(time: Fraction) -> Any:
    """The power series t + ε, of the length set by :func:`series_length`; the number t for length 1."""
    return ball(time) if current_length() == 1 else arb_series([ball(time), 1], prec=current_length())


def unit(angle: Any) -> Any:
    """e^(i angle) of a number or series."""
    sine, cosine = angle.sin_cos()
    if isinstance(angle, arb):
        return acb(cosine, sine)
    return acb_series(cosine, prec=current_length()) + acb(0, 1) * acb_series(sine, prec=current_length())


def balls(vector: Sequence[Fraction]) -> list[arb]:
    """The components of an exact vector as balls."""
    return [ball(component) for component in vector]


def sign(value: Fraction) -> int:
    """+1, −1, or +1 for 0: the factor that keeps a root on the side where the start lies."""
    return -1 if value < 0 else 1


def half_angle(tangent: Fraction) -> tuple[Fraction, Fraction]:
    """(cos, sin) of the angle with this tangent of its half: a rational point of the circle."""
    square = Fraction(tangent) ** 2
    return (1 - square) / (1 + square), 2 * Fraction(tangent) / (1 + square)


def rotate(vector: Sequence[Any], omega: Vector, time: Any) -> list[Any]:
    """The solution of v' = v × Ω for a constant Ω at ``time``, a number or series."""
    if not any(omega):
        return list(vector)
    rate = ball(dot(omega, omega)).sqrt()
    sine, cosine = (rate * time).sin_cos()
    axis = [component / rate for component in balls(omega)]
    along = dot(axis, vector)
    across = cross(vector, axis)
    return [along * n + cosine * (v - along * n) + sine * w for n, v, w in zip(axis, vector, across, strict=True)]


def tanh_sech(argument: Any) -> tuple[Any, Any]:
    """(tanh, sech) of a number or series; nothing grows, whatever its sign and size."""
    side = -1 if constant(argument) < 0 else 1
    decay = (-side * argument).exp()
    total = 1 + decay * decay
    return side * (1 - decay * decay) / total, 2 * decay / total


class Evaluated(ABC):
    """A motion given by one formula, :meth:`evaluate`, over power series."""

    __slots__ = ()

    @abstractmethod
    def evaluate(self, time: Fraction) -> list[Any]:
        """The six components at ``time`` + ε, at FLINT's working precision and length of series.

        Raises Undecided where that precision does not suffice.
        """

    def own_time(self, time: Fraction) -> Fraction:
        """``time`` in the unit whose size costs working bits: that of a form which works in units of its own."""
        return time

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """See :class:`heavytop.exact.solution.ExactSolution`."""
        return to_bits(lambda _working: self.evaluate(time), bits, self.own_time(time))

    def series(self, time: Fraction, length: int, bits: int) -> list[arb_series]:
        """See :class:`heavytop.exact.solution.ExactSolution`."""
        found: list[arb_series] = []

        def evaluate(_working: int) -> list[arb]:
            found[:] = [whole_series(part, length) for part in self.evaluate(time)]
            return [part[0] for part in found]

        to_bits(evaluate, bits, self.own_time(time), length)
        return found


@dataclass(frozen=True, slots=True)
class ClosedForm(Evaluated):
    """The motion of ``top`` from ``start``; the dataclass of each case brings ``method`` and its conditions.

    body, starts: exact conditions on the top and on the start; the constructor raises NotInClass where one fails.
    made: what :func:`heavytop.exact.motion.kept` keeps.
    """

    top: HeavyTop
    start: State
    method: ClassVar[str]
    body: ClassVar[Conditions] = ()
    starts: ClassVar[Conditions] = ()
    made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require(type(self).__name__, (*self.body, *self.starts), self.top, self.start)

    @property
    def system(self) -> System:
        """The heavy top, but for the cases that say otherwise."""
        return HEAVY_TOP

    def __reduce__(self) -> tuple[Any, ...]:
        """Without what was made: balls do not go from process to process."""
        return type(self), tuple(getattr(self, given.name) for given in fields(self) if given.init)


class WithAttitude(ClosedForm):
    """A closed form that carries all vectors fixed in space, and so γ, by one formula: :meth:`motion`."""

    __slots__ = ()

    @abstractmethod
    def motion(self, time: Any) -> tuple[list[Any], Carry]:
        """Ω at the number or series ``time``, and what carries vectors fixed in space there."""

    def evaluate(self, time: Fraction) -> list[Any]:
        """See :class:`ClosedForm`."""
        omega, carry = self.motion(instant(time))
        return [*omega, *carry(balls(self.start.gamma))]

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ, a unit vector fixed in space and ⟂ γ, in body components."""

        def evaluate(_working: int) -> list[arb]:
            return self.motion(instant(time))[1](initial_xi(self.start.gamma))

        return to_bits(evaluate, bits, time)


class WithAngles(Evaluated):
    """A motion whose Euler angles are given by formulas too."""

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
