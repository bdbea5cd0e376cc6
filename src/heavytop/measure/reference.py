"""References: proven states, and outputs of the attitude, as decimal text with radii."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast, overload

import msgspec
import numpy
from flint import arb
from numpy.typing import NDArray

from heavytop.display import Tabular, TitledTable, path_picture
from heavytop.errors import InputError, OutOfReach, quoted, refusal
from heavytop.exact.bodies import BodyMotion, Finder
from heavytop.exact.catalogue import find
from heavytop.exact.closed_form import initial_xi
from heavytop.exact.enclosure.run import EFFORT
from heavytop.exact.flint.balls import (
    FUNCTIONS,
    ball,
    midpoint,
    radius,
    radius_text,
    require_handy,
    value_text,
    whole_evaluation,
    working_precision,
)
from heavytop.integrate.trajectory import InSpace
from heavytop.measure.certify import bits_of
from heavytop.measure.derivatives import Ball as Ball
from heavytop.measure.derivatives import Derivatives, known_derivatives
from heavytop.measure.motion import motion_texts, xi_texts
from heavytop.measure.scalar import root
from heavytop.precision import Vector, decimal_text, dot, exact, shown, vector
from heavytop.top.attitude import Output, document_of, euler_terms, first_sign, output, rows_of, shaped, signs
from heavytop.top.bodies import Body
from heavytop.top.equations import HEAVY_TOP, NAMES, System
from heavytop.top.heavy_top import HeavyTop, State, TimeText
from heavytop.top.stability import Stability, stability

# Outputs of the attitude as balls, each to the requested digits, from states of more bits.


Evaluate = Callable[[Fraction, int], Sequence[Any]]
"""(time, bits) -> nine balls: Ω, γ and ξ."""
GUARD_BITS = 32
"""Bits of a state beyond those requested; only Euler angles near gimbal lock lose more."""
_WORKING_BITS = 32
_ATTEMPTS = 5
UNDEFINED = "nan", "inf"
"""Value and radius of an Euler angle at gimbal lock."""


class KnownMotion:
    """A known motion at the times of a reference, and its outputs; evaluated balls are cached.

    evaluate: Ω, γ, ξ.  times: exact.  digits: of each output.  centre: of mass.  gamma: at t = 0.  method: for errors.
    as_written: the balls are the printed ones, which cannot be refined; outputs have the width that follows from them.
    """

    def __init__(
        self,
        evaluate: Evaluate,
        times: Sequence[Fraction],
        digits: int,
        centre: Vector,
        gamma: Vector,
        method: str,
        as_written: bool = False,
    ) -> None:
        self.evaluate, self.times, self.digits, self.method = evaluate, times, digits, method
        self.centre, self.gamma, self.as_written = centre, gamma, as_written
        self._unit = dot(gamma, gamma) == 1
        self._cached: dict[int, Sequence[arb]] = {}
        self._signs: list[int] | None = None

    def at(self, index: int, extra: int = GUARD_BITS) -> Sequence[arb]:
        """Ω, γ and ξ at the time of that index, with ``extra`` bits more than the digits need."""
        if extra != GUARD_BITS:
            return self.evaluate(self.times[index], bits_of(self.digits) + extra)
        if index not in self._cached:
            self._cached[index] = self.evaluate(self.times[index], bits_of(self.digits) + extra)
        return self._cached[index]

    def balls(self, output: Output) -> list[list[arb | None]]:
        """The output at every time, flat, to the requested digits; None for an undefined Euler angle.

        A position is accurate to the digits relative to |p|, any other number relative to a size above 1.
        Raises OutOfReach if the digits cannot be proven.
        """
        scale = Fraction(1)
        if output.name == "position":
            scale = max(abs(part) for part in (*output.point_of(self.centre), *output.pivot))
        outputs = [self._value(index, output, scale) for index in range(len(self.times))]
        if output.name == "quaternion" and outputs:
            turns = self.signs(outputs)
            # negated exactly: the minus sign would round to FLINT's current precision
            return [
                [part.neg(exact=True) if part is not None and sign < 0 else part for part in q]
                for q, sign in zip(outputs, turns, strict=True)
            ]
        return outputs

    def signs(self, quaternions: Sequence[Sequence[Any]]) -> list[int]:
        """±1 for each quaternion, in the order of the times: continuous from t = 0 forwards and backwards."""
        if self._signs is None:
            start, factors = self._start(), [1] * len(self.times)
            floats = numpy.array([[float(part) for part in q] for q in quaternions])
            for side in (1, -1):
                indices = [i for i, time in enumerate(self.times) if (time >= 0) == (side > 0)]
                indices.sort(key=lambda i: abs(self.times[i]))
                for index, sign in zip(indices, signs(start, floats[indices]) if indices else (), strict=True):
                    factors[index] = int(sign)
            self._signs = factors
        return self._signs

    @whole_evaluation
    def _start(self) -> list[float]:
        bits = bits_of(self.digits) + GUARD_BITS
        q = [midpoint(part) for part in self._evaluated(self.evaluate(Fraction(0), bits), bits, Output("quaternion"))]
        sign = first_sign(q, Fraction(1, 1 << bits_of(self.digits)))
        return [sign * float(part) for part in q]

    def _value(self, index: int, output: Output, scale: Fraction) -> list[arb | None]:
        bits, extra = bits_of(self.digits), GUARD_BITS
        most_extra = 2 * bits + 2 * GUARD_BITS if output.name == "euler" else math.inf
        state = self.at(index)
        for _ in range(_ATTEMPTS):
            values = self._evaluated(state, bits + extra, output)
            lacking = max(self._lacking(value, output, scale) for value in values)
            if lacking <= 0:
                return list(values)
            if extra >= most_extra or (output.name == "euler" and self._locked(state, output)):
                break
            extra += int(lacking) + GUARD_BITS if lacking < math.inf else bits + GUARD_BITS
            try:
                state = self.at(index, extra)
            except OutOfReach:
                if output.name != "euler":
                    raise
                break
        if output.name == "euler":
            return [None if self._lacking(value, output, scale) > 0 else value for value in values]
        raise OutOfReach(
            f"The {output.name} at t = {shown(self.times[index])} is not known to {self.digits} digits, by "
            f"{self.method}.",
            "Request fewer digits.",
        )

    @whole_evaluation
    def _locked(self, state: Sequence[arb], output: Output) -> bool:
        """Whether the gimbal lock is exact: two Euler angles turn about one axis."""
        return bool(euler_terms(rows_of(state[3:6], state[6:]), output.sequence)[1][0].is_zero())

    @whole_evaluation
    def _evaluated(self, state: Sequence[arb], bits: int, output: Output) -> list[arb]:
        with working_precision(bits + _WORKING_BITS):
            omega, gamma, xi = state[:3], state[3:6], state[6:]
            if not self._unit:
                length = ball(dot(self.gamma, self.gamma)).sqrt()
                gamma = [part / length for part in gamma]
            return list(output.at(omega, gamma, xi, self.centre, _BALLS, ball))

    def _lacking(self, value: arb, output: Output, scale: Fraction) -> float:
        """Bits by which a ball is too wide; inf if it is not finite.  scale: of a position, and the least of others."""
        if not value.is_finite():
            return math.inf
        if self.as_written or value.is_exact():
            return 0
        if output.name != "position":
            if value.rel_one_accuracy_bits() >= bits_of(self.digits):
                return 0
            scale = max(scale, abs(midpoint(value)))
        # the printed value is rounded to one digit more than requested, by at most half a unit of it
        allowed, width = scale * Fraction(9, 10 ** (self.digits + 1)), radius(value)
        if width <= allowed:
            return 0
        return (width / allowed).__ceil__().bit_length() if allowed else math.inf


def _atan2(y: arb, x: arb) -> arb:
    """atan2 in (−π, π]; a ball that crosses the branch cut encloses π."""
    if x < 0 and not (y > 0 or y < 0):
        return arb.pi() + arb.atan2(-y, -x)
    return arb.atan2(y, x) if not (y.contains(0) and x.contains(0)) else arb("nan")


_BALLS = SimpleNamespace(**vars(FUNCTIONS) | {"sqrt": root, "atan2": _atan2})


def text(value: arb | None, digits: int) -> tuple[str, str]:
    """(value, radius) as decimal text, with one digit more than is proven; ``nan`` and ``inf`` for None."""
    return UNDEFINED if value is None else value_text(value, digits + 1)


def nearest(value: arb | None) -> float:
    """The double nearest to the midpoint of a ball; nan for None."""
    return math.nan if value is None else float(midpoint(value))


@whole_evaluation
def as_written(
    states: Sequence[Sequence[Any]],
    attitude: Sequence[Sequence[Any]],
    times: Sequence[str],
    digits: int,
    centre: Sequence[str],
    gamma: Sequence[str],
    start_xi: Sequence[str],
) -> KnownMotion:
    """A known motion from printed balls: objects with a ``value`` and a ``radius`` as text."""
    with working_precision(bits_of(digits) + 2 * GUARD_BITS):
        lines = [
            [ball(exact(component.value)) + arb(0, ball(exact(component.radius))) for component in (*y, *xi)]
            for y, xi in zip(states, attitude, strict=True)
        ]
        start = vector(gamma, "gamma")
        at_start = [ball(value) for value in (*start, *start, *vector(start_xi, "xi"))]
    instants = [exact(str(time)) for time in times]
    states_at = {Fraction(0): at_start, **dict(zip(instants, lines, strict=True))}

    def known(time: Fraction, bits: int) -> Sequence[Any]:
        return states_at[time]

    return KnownMotion(known, instants, digits, vector(centre, "centre"), start, "the printed balls", as_written=True)


DIGITS = range(1, 20001)
_SHOWN = 15
"""The most digits of a table with one state per row."""
_WIDE, _ENDS = 58, 2
"""Characters of a number per row, and the number of first and last times shown of many."""


class Reference(Tabular, InSpace, msgspec.Struct, frozen=True, omit_defaults=True, dict=True, kw_only=True):
    """Proven states; its JSON is that of ``heavytop reference``.

    written_times: ``times`` in JSON, as written in the request.  states: Ω1 Ω2 Ω3 γ1 γ2 γ3 at each.
    attitude: on request, ξ1 ξ2 ξ3 at each; a unit vector fixed in space and ⟂ γ, in body components, which starts at
    the ξ(0) of `heavytop docs outputs`; attitude_method: its source; xi: ξ at t = 0.
    inertia, weight, centre, rotor, omega, gamma: the data, exactly.
    source: the publication of the formulas of the method.
    derivatives: on request, with respect to the start and the data.  stability: of a steady motion.
    """

    method: str
    source: str = ""
    digits: int
    written_times: list[str] = msgspec.field(name="times")
    states: list[list[Ball]]
    system: str
    attitude: list[list[Ball]] | None = None
    attitude_method: str | None = None
    derivatives: Derivatives | None = None
    inertia: list[str] | None = None
    weight: str | None = None
    centre: list[str] | None = None
    rotor: list[str] | None = None
    omega: list[str] | None = None
    gamma: list[str] | None = None
    xi: list[str] | None = None
    mass: str | None = None
    gravity: str | None = None
    about: str | None = None
    start_quaternion: list[str] | None = None
    start_matrix: list[str] | None = None
    start_attitude: str | None = None
    stability: Stability | None = None

    @property
    def times(self) -> list[TimeText]:
        """Exact text, as written in the request; ``float`` and ``Fraction`` read it."""
        return [TimeText(time) for time in self.written_times]

    @overload
    def texts(self, of: None = None) -> list[list[str]]: ...

    @overload
    def texts(self, of: str | Output, *, point: Any = None, pivot: Any = None) -> list[Any]: ...

    def texts(self, of: str | Output | None = None, *, point: Any = None, pivot: Any = None) -> list[Any]:
        """The values as decimal text, shape (n, 6).

        Arguments:
            of: "quaternion", "matrix", "euler:ZXZ", "position" or "omega-space" for the values of that output instead
                of the states, in the shape of its array.
            point, pivot: as in :meth:`heavytop.measure.reference.Reference.positions`.

        Raises InputError for another output, and for a reference without attitude.
        """
        if of is not None:
            return self._outputs(output(of, point, pivot), lambda value: text(value, self.digits)[0])
        return [[ball.value for ball in state] for state in self.states]

    def balls(self, of: str | Output, *, point: Any = None, pivot: Any = None) -> list[Any]:
        """An output as balls in the shape of its array; value "nan" and radius "inf" if undefined.

        of, point, pivot: as in :meth:`texts`.  Each number is proven to ``digits``, relative to a size above 1; a
        position relative to |p|.
        """
        return self._outputs(output(of, point, pivot), lambda value: Ball(*text(value, self.digits)))

    def document(self, outputs: Sequence[Output] = ()) -> dict[str, Any]:
        """The document of `reference --json`, with these outputs in it."""
        values = document_of(outputs, lambda what: msgspec.to_builtins(self.balls(what)))
        return cast("dict[str, Any]", msgspec.to_builtins(self)) | values

    def require_outputs(self, outputs: Sequence[Output]) -> None:
        """Raise OutOfReach as :meth:`balls` does; the evaluated balls are cached for later requests."""
        for what in outputs:
            self._known().balls(what)

    def _in_double(self, what: Output) -> NDArray[numpy.float64]:
        values = numpy.array(self._outputs(what, nearest), dtype=float)
        return values.reshape(-1, *what.shape)

    def _outputs(self, what: Output, write: Callable[[Any], Any]) -> list[Any]:
        """The output at every time in its shape; ``write`` converts each ball, or None."""
        balls = self._known().balls(what)
        return [shaped([write(value) for value in line], what.shape) for line in balls]

    def _known(self) -> KnownMotion:
        """The motion of the states; for a reference that was read or copied, its printed balls."""
        motion: KnownMotion | None = self.__dict__.get("_motion")
        if motion is None:
            if self.attitude is None or self.centre is None or self.gamma is None or self.xi is None:
                raise InputError(
                    "The attitude was not computed: gamma alone does not fix it.",
                    "Give attitude=True (`heavytop docs outputs` defines xi at t = 0), or xi.",
                )
            start = self.centre, self.gamma, self.xi
            motion = as_written(self.states, self.attitude, self.times, self.digits, *start)
            self.__dict__["_motion"] = motion
        return motion

    def to_numpy(self) -> NDArray[numpy.float64]:
        """The values rounded to double, shape (n, 6)."""
        return numpy.array([[float(ball.value) for ball in state] for state in self.states])

    def radii(self) -> NDArray[numpy.float64]:
        """The radii rounded up to double, shape (n, 6): still upper bounds, and 0 only for 0."""
        return numpy.array([[rounded_up(ball.radius) for ball in state] for state in self.states])

    def _repr_html_(self) -> str:
        states, caption = self.states, "γ, the vertical in body axes, on the unit sphere"
        picture = path_picture(len(states), lambda index: [ball.value for ball in states[index][3:6]], caption)
        return self._table().html() + picture

    def derivatives_numpy(self) -> NDArray[numpy.float64] | dict[str, NDArray[numpy.float64]]:
        """∂y_i(t)/∂y_j(0) in double, shape (n, 6, 6); with data, a dict of "start" and "data".

        Raises InputError if no derivatives were requested.
        """
        return self._derivatives().numpy()

    def lyapunov(self) -> list[Ball | None]:
        """The finite-time Lyapunov exponent at each time, in 1/time unit, with its radius; None at t = 0.

        It is the logarithm of the largest singular value of ∂y(t)/∂y(0) over |t|.  Raises InputError if the
        derivatives with respect to the start were not requested.
        """
        exponents = self._derivatives().lyapunov
        if exponents is None:
            raise InputError("The reference has no derivatives by the start.", 'Give derivatives="start" or "all".')
        return exponents

    def _derivatives(self) -> Derivatives:
        if self.derivatives is None:
            raise InputError("This reference has no derivatives.", 'Give derivatives="start", "data" or "all".')
        return self.derivatives

    def _table(self) -> TitledTable:
        worst = max((Fraction(ball.radius) for state in self.states for ball in state), default=Fraction(0))
        title = f"{self.system}, known to {self.digits} digits: {self.method}"
        notes = [f"largest radius {radius_text(worst)}", *([self.stability.text()] if self.stability else [])]
        if self.xi is not None:
            notes.append(f"xi(0) = ({', '.join(self.xi)})")
        if self.digits > _SHOWN:
            return TitledTable(title, ("t", "", "value", "radius"), self._long_rows(), notes, whole=True)
        rows = [
            [time, *(decimal_text(Fraction(ball.value), self.digits) for ball in state)]
            for time, state in zip(self.times, self.states, strict=True)
        ]
        return TitledTable(title, ("t", *NAMES), rows, notes)

    def _long_rows(self) -> list[list[str]]:
        """All digits, one number per row, a long one continued below; of many times only the first and the last."""
        rows: list[list[str]] = []
        count = len(self.times)
        for index, (time, state) in enumerate(zip(self.times, self.states, strict=True)):
            if count > 2 * _ENDS and _ENDS <= index < count - _ENDS:
                rows += [[f"... {count - 2 * _ENDS} more", "", "", ""]] if index == _ENDS else []
                continue
            for name, value in zip(NAMES, state, strict=True):
                parts = [value.value[i : i + _WIDE] for i in range(0, len(value.value), _WIDE)]
                rows.append(
                    [time if name == NAMES[0] else "", name, parts[0].ljust(_WIDE * (len(parts) > 1)), value.radius]
                )
                rows += [["", "", part.ljust(_WIDE), ""] for part in parts[1:]]
        return rows


def rounded_up(text: str) -> float:
    """The smallest double not below a decimal text."""
    value = float(text)
    return value if Fraction(value) >= Fraction(text) else math.nextafter(value, math.inf)


def reference(
    top: HeavyTop | Body,
    start: State,
    times: Sequence[Any],
    digits: int,
    system: System = HEAVY_TOP,
    finder: Finder = find,
    attitude: bool = False,
    derivatives: str | None = None,
    effort: float = EFFORT,
) -> Reference:
    """The states at ``times`` to ``digits`` digits: each within 10^-digits, relative above 1 and absolute below.

    times: exact numbers in any order.  digits: 1 to 20,000.  attitude: with ξ.  derivatives: "start", "data" or "all"
    for these too.  effort: of an enclosure, :class:`heavytop.exact.enclosure.run.Validated`.
    Raises InputError for other digits, for a time that is not a finite rational, and if the system does not admit the
    start; OutOfReach if the digits cannot be proven, and for numbers of more than 9,000 digits.
    """
    if digits not in DIGITS:
        raise refusal("digits", "from 1 to 20000", quoted(digits), "Give, for example, 50.")
    instants = [exact(time) for time in times]
    known = BodyMotion(top, start, system, finder, effort)
    require_handy(known.resolved.top, known.resolved.start, instants)
    resolved, steady, derived = known.resolved, None, None
    if resolved.uncertainty is None:
        steady = stability(system, system.parameters(resolved.top, resolved.start), resolved.start.flat)
    if derivatives is not None:
        derived = known_derivatives(top, start, instants, digits, system, derivatives, effort)
    result = Reference(
        method=known.method,
        source=known.source,
        digits=digits,
        written_times=[str(TimeText.of(time)) for time in times],
        states=[],
        system=system.name,
        **motion_texts(top, start, digits),
        derivatives=derived,
        stability=steady,
    )
    if not attitude:
        bits = bits_of(digits)
        states = [known_texts(known.state(time, bits), known.method, time, digits) for time in instants]
        return msgspec.structs.replace(result, states=states)
    latest = max(instants, key=abs, default=Fraction(0))
    method, evaluate = known.known_attitude(latest, bits_of(digits) + GUARD_BITS)
    motion = KnownMotion(evaluate, instants, digits, top.centre, start.gamma, method)
    parts = [known_texts(motion.at(index), method, time, digits) for index, time in enumerate(instants)]
    result = msgspec.structs.replace(
        result,
        states=[part[:6] for part in parts],
        attitude=[part[6:] for part in parts],
        attitude_method=method,
        xi=xi_texts(start, digits) or start_texts(start.gamma, digits),
    )
    result.__dict__["_motion"] = motion
    return result


@whole_evaluation
def start_texts(gamma: Vector, digits: int) -> list[str]:
    """ξ at t = 0 for a γ of length other than 1, as rounded text."""
    with working_precision(bits_of(digits) + GUARD_BITS):
        return [value_text(value, digits + 1)[0] for value in initial_xi(gamma)]


def known_texts(values: Sequence[Any], method: str, time: Fraction, digits: int) -> list[Ball]:
    """The balls of a state as text; raises OutOfReach as :meth:`Ball.proven` does."""
    source = f", by {method}"
    return [Ball.proven(value, digits, f"Component {i}", time, source) for i, value in enumerate(values, 1)]
