"""The motion of a body in the axes in which it was given: principal axes, attitudes and what is irrational of them.

Everything is computed in principal axes, from exact rationals.  Where the principal axes of a tensor, or an attitude
given by angles, are irrational, rational data stand for them: a rational rotation A near the principal axes, a rational
rotation near the attitude.  What they lack is known and bounded (:class:`heavytop.exact.enclosure.run.Uncertainty`):

the true tensor in the axes A is D + E with D diagonal and E = Aᵀ J A − D, exactly, so that with X = (D + E)⁻¹

    Ω' = D⁻¹ ((D Ω + k) × Ω + γ × n) + δ,
    |δ| ≤ |X| |E| |D⁻¹| ((|J| |Ω| + |k|) |Ω| + |n|) + |D⁻¹| ((|E| |Ω| + |δk|) |Ω| + |δn|),

and |Ω| is bounded for all times by the energy, |Ω|² ≤ 2 (½ Ω·JΩ + 2 |n|)/min J.  The enclosure takes δ as a part of its
defect and the error of the start as the radii of its first node, so that its balls hold the *true* motion.  Algebraic
motions (:mod:`heavytop.exact.cases.algebraic_starts`) are known in themselves, and need none of this.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import isqrt, log2
from typing import Any, cast

from flint import arb

from heavytop.errors import OutOfReach
from heavytop.exact.catalogue import find
from heavytop.exact.closed_form import state_and_attitude
from heavytop.exact.enclosure.run import EFFORT, Uncertainty, Validated
from heavytop.exact.flint.balls import (
    FUNCTIONS,
    BallLike,
    ball,
    midpoint,
    radius,
    relative_bits,
    to_bits,
    whole_evaluation,
    working_precision,
)
from heavytop.exact.solution import ExactSolution
from heavytop.precision import Vector, cross, dot, round_to
from heavytop.top.amplification import amplification
from heavytop.top.attitude import Attitude, Rows, perpendicular, rotated, transposed
from heavytop.top.bodies import IDENTITY, Body, PrincipalAxes
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State

Finder = Callable[[HeavyTop, State, System, float], ExactSolution]
_DATA_BITS = 256
_GUARD_BITS = 96
_MORE_BITS, _NEAR = (0, 512, 2048, 8192, 32768), 8
"""Tried for angles of many turns, and how many units of the last bit a rotation may be off."""
_ATTEMPTS = 4
_MOST_BITS = 1 << 15
_FOLLOWED_BITS = 512
"""An amplification beyond it is out of reach anyway, or nearly."""
_MARGIN = Fraction(1, 2**200)


@dataclass(frozen=True, slots=True)
class Resolved:
    """A motion in principal axes, in exact rationals.

    top, start: in principal axes.  xi: ξ at t = 0 in these; None where γ is no unit vector and no attitude was given.
    axes: the rows of A, v_given = A v_principal.  uncertainty: what the data lack; None where they are exact.
    """

    top: HeavyTop
    start: State
    xi: Vector | None
    axes: tuple[Vector, Vector, Vector]
    uncertainty: Uncertainty | None

    @property
    def is_rotated(self) -> bool:
        """Whether the axes given are not these."""
        return self.axes != IDENTITY

    def given(self, state: Any) -> list[BallLike]:
        """A state, (Ω, γ) or (Ω, γ, ξ), in the axes given, over any ring that rationals act on."""
        return [value for begin in range(0, len(state), 3) for value in rotated(self.axes, state[begin : begin + 3])]


def resolve(body: Body | HeavyTop, start: State, bits: int = 256) -> Resolved:
    """The motion of a body, or of a top, from ``start``, in principal axes.

    bits: to which what is irrational is rounded: a tensor relative to its smallest moment, the rest to the largest of
    its kind.
    """
    spin, rows, off = _start(start, bits)
    up = rows[2] if rows is not None else start.gamma
    if isinstance(body, HeavyTop):
        return _resolved(body, IDENTITY, None, (spin, up, rows), off, bits)
    principal = body.principal(bits)
    return _resolved(body.top_in(principal), principal.axes, (body, principal), (spin, up, rows), off, bits)


def _start(start: State, bits: int) -> tuple[Vector, tuple[Vector, Vector, Vector] | None, tuple[Fraction, Fraction]]:
    """Ω, the rows of R (None where only γ is known), and how far Ω and each row may be off."""
    attitude = start.attitude
    if attitude is None:
        return start.omega, None, (Fraction(0), Fraction(0))
    known = attitude.exact_rows()
    rows, off = (known, Fraction(0)) if known else _near(attitude, bits)
    if start.omega_space is None:
        return start.omega, rows, (Fraction(0), off)
    turned = rotated(transposed(rows), start.omega_space)
    return turned, rows, (off * sum(map(abs, start.omega_space), Fraction(0)), off)


def _near(attitude: Attitude, bits: int) -> tuple[tuple[Vector, Vector, Vector], Fraction]:
    """A rational rotation, and how far its entries are off: about 2^-bits, of large angles by more working bits."""
    for more in _MORE_BITS:
        rows = attitude.rational_rows(bits + more)
        off = _distance(attitude, rows, bits + more)
        if off * 2**bits <= _NEAR:
            break
    return rows, off


@whole_evaluation
def _distance(attitude: Attitude, near: Rows[Fraction], bits: int) -> Fraction:
    """A bound of every entry of R − ``near``."""
    with working_precision(bits + _GUARD_BITS):
        rows = attitude.rows(FUNCTIONS, ball)
        gaps = [rows[i][j] - ball(near[i][j]) for i in range(3) for j in range(3)]
        return max(abs(midpoint(gap)) + radius(gap) for gap in gaps)


def _resolved(
    top: HeavyTop,
    axes: tuple[Vector, Vector, Vector],
    body_and_axes: tuple[Body, PrincipalAxes] | None,
    start: tuple[Vector, Vector, Any],
    off: tuple[Fraction, Fraction],
    bits: int,
) -> Resolved:
    spin, up, rows = start
    back = transposed(axes)
    unit = dot(up, up) == 1
    xi = rows[0] if rows is not None else perpendicular(up) if unit else None
    exact = body_and_axes is None or body_and_axes[1].exact
    if exact and not any(off):
        state = State(rotated(back, spin), rotated(back, up))
        return Resolved(top, state, None if xi is None else rotated(back, xi), axes, None)
    # short numbers in place of long ones, where they are not exact anyway
    rounding = Fraction(1, 2**bits)
    omega, speed = _shortened(rotated(back, spin), bits)
    rounded, lacks = (top, None) if exact else _rounded_top(top, bits)
    rate = Fraction(0)
    if body_and_axes is not None and not exact:
        fastest = _root(dot(spin, spin)) + 2 * (off[0] + speed)
        rate = _field_error(body_and_axes, rounded, lacks, fastest)
    # a vector turned by A moves by at most √3 times the largest of its components
    errors = (*[2 * off[0] + speed] * 3, *[2 * off[1] + rounding] * 6)
    state = State(omega, rotated(back, up))
    return Resolved(rounded, state, None if xi is None else rotated(back, xi), axes, Uncertainty(errors, rate))


def _shortened(values: Vector, bits: int) -> tuple[Vector, Fraction]:
    """The vector with components of ``bits`` bits, and a bound of how far each has moved."""
    first, second, third = (round_to(value, bits) for value in values)
    return (first, second, third), max(abs(a - b) for a, b in zip((first, second, third), values, strict=True))


def _rounded_top(top: HeavyTop, bits: int) -> tuple[HeavyTop, tuple[Vector, Vector]]:
    """The top with short numbers, and what its n and k lack."""
    centre = tuple(round_to(value, bits) for value in top.centre)
    rotor = None if top.rotor is None else tuple(round_to(value, bits) for value in top.rotor)
    short = HeavyTop(top.inertia, top.weight, centre, rotor=rotor)
    missing = [
        tuple(a - b for a, b in zip(one or (Fraction(0),) * 3, other or (Fraction(0),) * 3, strict=True))
        for one, other in ((top.moment, short.moment), (top.rotor, short.rotor))
    ]
    return short, (missing[0], missing[1])  # type: ignore[return-value]


def _field_error(
    body_and_axes: tuple[Body, PrincipalAxes], top: HeavyTop, lacks: tuple[Vector, Vector] | None, start_speed: Fraction
) -> Fraction:
    """A bound of every component of δ: see the head of this file.  Norms are Frobenius' and Euclid's, rounded up."""
    body, principal = body_and_axes
    rest = _root(sum(value * value for row in principal.left for value in row))
    tensor = _root(sum(value * value for row in body.tensor for value in row))
    none = (Fraction(0), Fraction(0), Fraction(0))
    rotor = body.rotor or none
    pull, whirl = _root(dot(body.moment, body.moment)), _root(dot(rotor, rotor))
    short, slow = (_root(dot(vector, vector)) for vector in lacks or (none, none))
    # |D⁻¹| and |X| as norms of matrices; |γ| is 1 within _MARGIN
    least = min(principal.moments) - rest
    inverse = 1 / least
    square = 2 * (tensor * start_speed**2 / 2 + (2 + _MARGIN) * pull) / least
    fastest = _root(square)
    torque = (tensor * fastest + whirl) * fastest + (1 + _MARGIN) * pull
    return inverse**2 * rest * torque + inverse * ((rest * fastest + slow) * fastest + (1 + _MARGIN) * short)


def _root(square: Any) -> Fraction:
    """Not less than the root of a rational, and at most 2^-30 larger relatively; 0 for 0."""
    value = Fraction(square)
    if value == 0:
        return value
    shift = max(0, 64 - (value.numerator.bit_length() - value.denominator.bit_length()))
    shift += shift % 2
    return Fraction(isqrt((value.numerator << shift) // value.denominator) + 1, 1 << (shift // 2))


Whole = Callable[[Fraction, int], Sequence[arb]]
Evaluate = Callable[[tuple[Resolved, ExactSolution], int], Sequence[arb]]


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """The known motion of a body or a top, in the axes in which it was given.

    body, start: as given, any attitude included.  system: of the motion.  finder: of the motion in principal axes.
    effort: of its enclosure, :class:`heavytop.exact.enclosure.run.Validated`.
    Its balls hold the true motion, irrational data included: proven, not assumed.
    """

    body: Body | HeavyTop
    start: State
    system: System = HEAVY_TOP
    finder: Finder = find
    effort: float = EFFORT
    _made: dict[int, tuple[Resolved, ExactSolution]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def method(self) -> str:
        """How it is known."""
        return self.solution.method

    @property
    def source(self) -> str:
        """Where its formulas are published."""
        return self.solution.source

    @property
    def resolved(self) -> Resolved:
        """The motion in principal axes; irrational data to 256 bits."""
        return self._known(_DATA_BITS)[0]

    @property
    def solution(self) -> ExactSolution:
        """The motion in principal axes; with its uncertainty where the data are irrational."""
        return self._known(_DATA_BITS)[1]

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """(Ω, γ) at ``time`` in the axes given: six balls of ``bits`` bits.

        Raises OutOfReach where they cannot be proven.
        """
        return self._evaluated(time, bits, lambda known, working: known[1].state(time, working))

    def with_attitude(self, time: Fraction, bits: int) -> list[arb]:
        """Ω, γ and ξ at ``time`` in the axes given: nine balls.

        ξ starts at the first row of the attitude given, or at :func:`heavytop.top.attitude.perpendicular` of γ.
        Raises OutOfReach where it cannot be proven, InputError for |γ| ≠ 1 where no attitude was given.
        """
        return list(self.whole(time, bits)[1](time, bits))

    def whole(self, latest: Fraction, bits: int) -> tuple[str, Whole]:
        """How the attitude is known, and Ω, γ, ξ at (time, bits) as :meth:`with_attitude` gives them.

        The closed form of the attitude is taken where it gives so many bits at the time ``latest``.
        """
        known = self._known(_DATA_BITS)
        if known[0].uncertainty is not None:
            return self.method, self._enclosed
        method, inner = state_and_attitude(known[1], latest, bits, self.effort)
        inner = _from_start(known, inner)
        if not known[0].is_rotated:
            return method, inner
        return method, lambda time, bits: _turned(known, bits, lambda _known, working: inner(time, working))

    def _enclosed(self, time: Fraction, bits: int) -> list[arb]:
        def evaluate(known: tuple[Resolved, ExactSolution], working: int) -> Sequence[arb]:
            return cast(Validated, known[1]).with_attitude(time, working)

        return self._evaluated(time, bits, evaluate)

    def _evaluated(self, time: Fraction, bits: int, evaluate: Evaluate) -> list[arb]:
        """The vectors of ``evaluate`` in the axes given, with so many bits."""
        known = self._known(_DATA_BITS)
        resolved = known[0]
        if resolved.uncertainty is None:
            return _turned(known, bits, evaluate)
        parameters = self.system.parameters(resolved.top, resolved.start)
        lost = log2(max(1.0, amplification(self.system, parameters, resolved.start.flat, time)))
        data_bits = 64 * -(-(bits + _GUARD_BITS + int(2 * lost)) // 64)
        try:
            return _turned(self._known(data_bits), bits, evaluate)
        except OutOfReach:
            if lost > _FOLLOWED_BITS or 4 * data_bits > _MOST_BITS:
                raise
            return _turned(self._known(4 * data_bits), bits, evaluate)  # the amplification is an estimate

    def _known(self, bits: int) -> tuple[Resolved, ExactSolution]:
        if bits not in self._made:
            resolved = resolve(self.body, self.start, bits)
            if resolved.uncertainty is None:
                solution = self.finder(resolved.top, resolved.start, self.system, self.effort)
            else:
                solution = Validated(
                    resolved.top,
                    resolved.start,
                    self.system,
                    xi=resolved.xi,
                    effort=self.effort,
                    method="validated: Taylor enclosure of irrational data",
                    uncertainty=resolved.uncertainty,
                )
            self._made.setdefault(bits, (resolved, solution))
        return self._made[bits]


def _turned(known: tuple[Resolved, ExactSolution], bits: int, evaluate: Evaluate) -> list[arb]:
    """Evaluated vectors, in the axes given, with ``bits`` bits."""
    if not known[0].is_rotated:
        return list(evaluate(known, bits))
    working = bits + 4
    for _ in range(_ATTEMPTS):
        values = _given(known[0], evaluate(known, working), working + _GUARD_BITS)
        reached = min(map(relative_bits, values))
        if reached >= bits:
            return values
        working += bits - reached + 4
    raise OutOfReach(f"Only {reached} of {bits} bits could be proven in the axes given.", "Ask for fewer digits.")


@whole_evaluation
def _given(resolved: Resolved, values: Sequence[arb], bits: int) -> list[arb]:
    with working_precision(bits):
        return [
            sum((ball(a) * x for a, x in zip(row, values[begin : begin + 3], strict=True)), arb(0))
            for begin in range(0, len(values), 3)
            for row in resolved.axes
        ]


def _from_start(known: tuple[Resolved, ExactSolution], whole: Whole) -> Whole:
    """Ω, γ and ξ in principal axes, ξ from the start that was given, out of ξ from :func:`perpendicular` of γ."""
    resolved, solution = known
    gamma = solution.start.gamma
    if resolved.xi is None or resolved.xi == (began := perpendicular(gamma)):
        return whole
    cosine, sine = dot(resolved.xi, began), dot(resolved.xi, cross(gamma, began))
    # turned about γ by the constant angle between the two starts, whose cosine and sine are rational
    return lambda time, bits: to_bits(lambda working: _about_gamma(whole(time, working), cosine, sine), bits)


def _about_gamma(values: Sequence[arb], cosine: Fraction, sine: Fraction) -> list[arb]:
    gamma, xi = values[3:6], values[6:]
    return [*values[:6], *(ball(cosine) * x + ball(sine) * y for x, y in zip(xi, cross(gamma, xi), strict=True))]
