"""Derivatives of a motion with respect to its start and its data, enclosed.

J(t) = ∂(Ω, γ)(t)/∂(Ω0, γ0) and S(t) = ∂(Ω, γ)(t)/∂(I1, I2, I3, n1, n2, n3), n = P r: plain partial derivatives of the
field as it stands.  γ0 counts as three independent variables, and the rotor (λ, or k) is held.

Each step of the enclosure of the motion gives its own Φ and σ (:mod:`heavytop.exact.step_derivatives`), and

    J(t + h) = Φ J(t),     S(t + h) = Φ S(t) + σ.

The centres are multiplied exactly and rounded once.  The errors of each column of (J, S) are kept in the frames that
carry the errors of the motion, {Q x: |x_i| ≤ r_i}: with Q'^-1 Φ Q within η of T = Q'^T V̂ Q,

    r' = |T| r + η max r + |Q'^-1| e,     e = (|Φ − Φ̂| |J|_1 + |σ − σ̂| + ½ ulp),

so a column of errors is carried by Lohner's method as one more set of errors of the motion.  The working precision is
chosen so that the digits come out: it is raised by what was lacking, up to six times.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, fmpz
from gmpy2 import mpz

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, relative_bits, working_precision
from heavytop.exact.enclosure import Node, Step, norm, start_node, step
from heavytop.exact.field_derivatives import DATA, difference, moved, quotient
from heavytop.exact.flint_context import whole_evaluation
from heavytop.exact.quadratic import Matrix, Quadratic
from heavytop.exact.scaled_motion import ScaledMotion, own_parameters
from heavytop.exact.step_derivatives import TINY, Datum, StepDerivatives, Tangent, step_derivatives, unit_columns
from heavytop.exact.validated import Validated, seconds_a_step
from heavytop.precision import decimal_text

METHOD = "validated: variational equation on the Taylor enclosure"
_UP = 1 + 2.0**-32
_UNIT = 2.0**-53
_ATTEMPTS = 6
_GUARD = 18
"""Bits beyond those asked for: what bounds lose, and what a motion loses that loses little."""
_COARSER = 4
"""δ is 2^4 times the root of an ulp: the ends of a step are known less well than its second derivative is small."""
_FEW = 4
_SHORTENED = 4

Balls = list[list[arb]]


@dataclass(frozen=True, slots=True)
class Derivatives:
    """start: J, 6 × 6, [i][j] = ∂y_i(t)/∂y_j(0).  data: S, 6 × 6, by :data:`DATA`; None where not asked for."""

    start: Balls
    data: Balls | None


@dataclass(frozen=True, slots=True)
class _Columns:
    """(J, S) at a node: centre in ulps of 2^-bits, a row a component; errors {Q x: |x_i| ≤ radii_i 2^exponent}."""

    rows: list[list[Any]]
    radii: Matrix
    exponent: int

    def sizes(self, bits: int) -> Matrix:
        """Upper bounds of the sum of |entries| of each column, as numbers; infinite where binary64 has none."""
        shift = max(0, bits - 64)
        sums = [int(sum(map(abs, column)) >> shift) + 1 for column in zip(*self.rows, strict=True)]
        return np.array(
            [np.ldexp(float(total) * _UP, shift - bits) if total.bit_length() < 1000 else np.inf for total in sums]
        )


def derivatives(known: Validated, times: Sequence[Fraction], bits: int, data: bool) -> list[Derivatives]:
    """J, and S where asked for, at each of ``times`` in their order: ``bits`` right, relative above 1, absolute below.

    Raises OutOfReach where the digits cannot be proven, or would take longer than ``known.effort``.
    """
    found: dict[Fraction, Derivatives] = {}
    for direction in (1, -1):
        spans = sorted({abs(time) for time in times if time * direction > 0})
        if spans:
            found |= _one_way(known, direction, spans, bits, data)
    if any(time == 0 for time in times):
        found[Fraction(0)] = _at_rest(bits, data)
    return [found[time] for time in times]


@whole_evaluation
def _at_rest(bits: int, data: bool) -> Derivatives:
    with working_precision(bits + 8):
        start = [[arb(int(i == j)) for j in range(6)] for i in range(6)]
        return Derivatives(start, [[arb(0)] * 6 for _ in range(6)] if data else None)


def _one_way(
    known: Validated, direction: int, spans: list[Fraction], bits: int, data: bool
) -> dict[Fraction, Derivatives]:
    """Those at ``spans`` > 0 from time 0 on, in increasing order, in one direction."""
    motion = known.motion(direction)
    time = direction * spans[-1]
    forecast, steps = known.forecast(time, bits)
    loss, wanted = forecast, bits + _GUARD + int(min(forecast, _FEW * bits) / 4)
    for _ in range(_ATTEMPTS):
        columns = 7 + 6 * data
        planned = motion.precision(max(2 * wanted, wanted + loss), steps * columns)
        if not steps * columns * seconds_a_step(*planned) < known.effort:
            break
        tangent = _tangent(known, motion, *planned, data)
        found, lacking = {}, 0
        for span, values in _run(tangent, motion, spans):
            at = _in_units(known, motion, tangent, values) if values else None
            lacking = bits - (
                min(relative_bits(v) for m in (at.start, at.data or []) for r in m for v in r) if at else 0
            )
            if at is None or lacking > 0:
                break
            found[direction * span] = at
        else:
            return found
        wanted += lacking + _GUARD // 2
        loss += lacking
    raise OutOfReach(
        f"Derivatives at t = {decimal_text(time, 6)} to so many digits are out of reach of a validated integration.",
        "Ask for fewer digits, or for an earlier time.",
    )


def _tangent(known: Validated, motion: ScaledMotion, precision: int, in_words: bool, data: bool) -> Tangent:
    carrier = motion.carrier(precision) if in_words else None
    tangent = Tangent(motion.field, carrier, precision, precision // 2 - _COARSER)
    if not data:
        return tangent
    return replace(tangent, data=tuple(_datum(known, motion, tangent, k) for k in range(len(DATA))))


def _datum(known: Validated, motion: ScaledMotion, tangent: Tangent, datum: int) -> Datum:
    """The field with one of the data larger by δ times :func:`unit_of`."""
    given, size = known.parameters, unit_of(known, datum)
    own = own_parameters(motion.scaled, given)
    delta = Fraction(1, 2**tangent.shift)
    # the same change, in the units of the motion
    unit = size if datum < 3 else size * motion.scaled.sizes[3] / motion.scaled.rate**2
    varied = motion.with_parameters(moved(given, datum, delta * size))
    system = motion.scaled.system
    direct = quotient(system, own, datum, delta * unit, delta)
    off = difference(system, own, datum, delta * unit, delta, unit)
    in_words = tangent.carrier is not None and varied.in_words
    carrier = varied.carrier(tangent.precision) if in_words else None
    return Datum(varied.field, carrier, _bounds(direct, 0), _bounds(off, tangent.bits))


def _bounds(field: Quadratic, bits: int) -> tuple[float, float]:
    """Upper bounds of 2^bits q and 2^bits l."""
    return float(field.q * 2**bits) * _UP + TINY, float(field.l * 2**bits) * _UP + TINY


def unit_of(known: Validated, datum: int) -> Fraction:
    """A power of two about as large as what is varied: I_i itself, or the largest |n_i|."""
    given = known.parameters
    size = given.inertia[datum] if datum < 3 else max(map(abs, given.moment))
    if size == 0:  # no weight: that which would turn the body as fast as it turns
        size = max(*(i * max(1, w * w) for i, w in zip(given.inertia, known.start.omega, strict=True)))
    value = Fraction(size)
    return Fraction(2) ** (value.numerator.bit_length() - value.denominator.bit_length())


def _run(tangent: Tangent, motion: ScaledMotion, spans: list[Fraction]) -> Iterator[tuple[Fraction, Any]]:
    """(span, centre and radii there) for each; None in place of them, and an end, where the errors are too large."""
    node = start_node(motion.field, motion.scaled.state, tangent.precision)
    size = motion.field.dimension
    columns = _Columns(unit_columns(size, tangent.bits, tangent.columns), np.zeros((size, tangent.columns)), 0)
    rest = [(span * motion.scaled.rate, span) for span in spans]
    while rest:
        found, own = _step(tangent, node)
        while found is not None and rest and node.time + found.length >= rest[0][0]:
            scaled, span = rest.pop(0)
            at = step_derivatives(tangent, found, (scaled - node.time) / found.length)
            yield span, None if at is None else _at(tangent, found, at, columns, (scaled - node.time) / found.length)
        if found is None or own is None:
            yield from [(span, None) for _, span in rest[:1]]
            return
        if rest:
            transfer = found.transfer()
            columns = _carried(tangent, found, own, columns, transfer)
            node = found.end(transfer)
            if not np.isfinite(columns.radii).all():
                yield rest[0][1], None
                return


def _step(tangent: Tangent, node: Node) -> tuple[Step, StepDerivatives] | tuple[None, None]:
    """The step from a node with its derivatives; shorter where they need it."""
    for shorter in range(_SHORTENED):
        trial = replace(node, halvings=node.halvings + shorter)
        found = step(tangent.field, trial, tangent.precision, tangent.carrier)
        if found is None:
            return None, None
        own = step_derivatives(tangent, found, Fraction(1))
        if own is not None:
            return found, own
    return None, None


def _product(tangent: Tangent, own: StepDerivatives, rows: list[list[Any]]) -> list[list[Any]]:
    """Φ (J, S) + (0, σ), each entry within half an ulp of that of the centres."""
    size, bits = len(rows), tangent.bits
    half = mpz(1) << (bits - 1)
    columns = list(zip(*rows, strict=True))
    found = []
    for row in own.rows:
        phi = row[:size]
        line = [(sum(map(_times, phi, column), half)) >> bits for column in columns]
        for place, value in enumerate(row[size:], size):
            line[place] += value
        found.append(line)
    return found


def _times(a: Any, b: Any) -> Any:
    return mpz(a) * b


def _local(tangent: Tangent, own: StepDerivatives, columns: _Columns) -> Matrix:
    """Bounds of the errors that a step itself makes in each column, in ulps 2^exponent."""
    size = len(columns.rows)
    of_phi = max(own.errors[:size])
    found = of_phi * columns.sizes(tangent.bits) + 1.0
    found[size:] += own.errors[size:]
    return np.asarray(np.ldexp(found * _UP, -columns.exponent) + TINY)


def _carried(
    tangent: Tangent, found: Step, own: StepDerivatives, columns: _Columns, transfer: tuple[Matrix, Matrix, float]
) -> _Columns:
    """(J, S) at the end of a step, in its new frame."""
    frame, turned, slack = transfer
    inverse = (norm(frame.T) + slack) * _UP
    slack = (slack + inverse * own.moved * norm(found.node.errors.frame)) * _UP
    radii = np.abs(turned) @ columns.radii + slack * columns.radii.max(axis=0)
    reach = (np.abs(frame.T).sum(axis=1) + slack) * _UP
    radii = (radii + np.outer(reach, _local(tangent, own, columns))) * _UP
    exponent = columns.exponent
    if radii.max() > 2.0**400:
        radii, exponent = np.ldexp(radii, -400), exponent + 400
    return _Columns(_product(tangent, own, columns.rows), radii, exponent)


def _at(
    tangent: Tangent, found: Step, own: StepDerivatives, columns: _Columns, tau: Fraction
) -> tuple[list[list[Any]], Matrix, int]:
    """(J, S) within a step: the centre, and bounds of the errors in ulps 2^exponent."""
    variation = sum(float(tau) ** n * matrix for n, matrix in enumerate(found.variation))
    frame = found.node.errors.frame
    spread = (found.summed_error + 64 * _UNIT * found.powers + own.moved) * norm(frame) * _UP
    radii = np.abs(variation @ frame) @ columns.radii + spread * columns.radii.max(axis=0)
    return (
        _product(tangent, own, columns.rows),
        np.asarray((radii + _local(tangent, own, columns)) * _UP),
        columns.exponent,
    )


@whole_evaluation
def _in_units(known: Validated, motion: ScaledMotion, tangent: Tangent, values: tuple[Any, Matrix, int]) -> Derivatives:
    """As balls, in the units given."""
    rows, radii, exponent = values
    sizes = motion.scaled.sizes
    scales = [*sizes, *(unit_of(known, k) for k in range(tangent.columns - len(rows)))]
    limits = [[float(r) for r in row] for row in radii]
    longest = max(max(abs(v) for v in row).bit_length() for row in rows)
    with working_precision(longest + 64):
        unit, scale = arb(2) ** -tangent.bits, arb(2) ** exponent
        table = [
            [
                arb(fmpz(int(value)) * unit, (arb(limit) * scale).upper() * unit) * ball(size / of)
                for value, limit, of in zip(line, bounds, scales, strict=True)
            ]
            for line, bounds, size in zip(rows, limits, sizes, strict=True)
        ]
    start, data = [line[: len(rows)] for line in table], [line[len(rows) :] for line in table]
    return Derivatives(start, data if tangent.data else None)
