"""How much a motion itself amplifies a rounding error, whatever integrator follows it and whenever it is made.

A change δ of the state at s is Φ(t, s) δ at t, with the variational equation Φ' = J(y) Φ, Φ(s, s) = 1.  A rounding on
the way may grow by far more than one of the start: past a saddle that the motion leaves again, by the square.  Motion
and Φ are computed together by Taylor series in double, and each step multiplies Φ(t, s) of every step's end s at once;
no Φ is inverted.  Components of Ω are measured in units of the motion's :func:`rate`, so that neither the units of the
data nor a renaming of the axes matters.  An estimate, not a bound.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from operator import itemgetter
from threading import Lock
from typing import TYPE_CHECKING

import numpy
from numpy.typing import NDArray

from heavytop.top.equations import Parameters, System

if TYPE_CHECKING:
    from gmpy2 import mpq


Doubles = NDArray[numpy.float64]
_ORDER = 20
_TOLERANCE = 2.0**-52
_STEPS = 1000
"""The number of steps beyond which the amplification is extrapolated."""
FOLLOWED = 1e14
"""Beyond this loss a motion in double is another one, and the loss is extrapolated."""
_STEEPER = 100.0
"""Amplification grows like t along a regular motion; growth so many times larger counts as exponential."""
_LARGEST = 1e300


def rate(system: System, parameters: Parameters, start: Sequence[Fraction]) -> Fraction:
    """The largest of |Ω_i|, |λ| or |k|/I_min, and √(|P r|/I_min), of the start, rounded up to a power of 2;
    0 of a top at rest.

    start: six exact numbers.  One over this is the motion's own unit of time.
    """
    fastest: Fraction = max(*(abs(Fraction(value)) for value in start[:3]), parameters.mapped(Fraction).rotor_rate)
    pull = Fraction(0) if system.name == "gyrostat" else max(abs(Fraction(n)) for n in parameters.moment)
    square = max(fastest**2, pull / min(Fraction(value) for value in parameters.inertia))
    if not square:
        return Fraction(0)
    bits = square.numerator.bit_length() - square.denominator.bit_length()
    return Fraction(2) ** (bits // 2 + 1)


@lru_cache(maxsize=256)
def amplification(
    system: System, parameters: Parameters, start: tuple[Fraction, ...], horizon: Fraction, steps: int = _STEPS
) -> float:
    """The largest factor by which the motion has amplified a change of its state, between any two times up to
    ``horizon``.

    The root mean square over the six directions, with Ω in units of :func:`rate`; at least 1.
    start: six exact numbers.  About (rate·t) on a regular motion, e^(rate t) near a saddle and on a chaotic one.
    After ``steps`` steps, or where all digits of double are lost, it is extrapolated: in proportion to t, or
    exponentially where it has grown 100 times more than that.  At most 1e300; infinite for data beyond double.
    """
    try:
        largest, _, done, span = _followed(system, parameters, start, horizon, steps)
    except OverflowError:
        return math.inf
    if done >= span or not done:
        return min(largest, _LARGEST)
    further = span / done
    if largest <= _STEEPER * (1 + done):
        return min(largest * further, _LARGEST)
    return 10 ** min(math.log10(largest) * further, math.log10(_LARGEST))


def loss(system: System, parameters: Parameters, start: tuple[Fraction, ...], horizon: Fraction) -> tuple[float, bool]:
    """The error of a state at ``horizon`` over a relative rounding error of its components at the worst time; and
    whether it was computed up to there, not a lower estimate.

    A component that stays 0 has no rounding error, and a small one a small error: the loss is 1 for a motion in an
    invariant plane, however unstable that is.  Arguments: as in :func:`amplification`.  Beyond the range of double it
    is computed in the 64 bits of numpy's longdouble, if available; a regular motion after many steps grows like t.
    """
    try:
        _, lost, done, span = _followed(system, parameters, start, horizon, _STEPS)
        if lost > FOLLOWED:
            _, lost, done, span = _followed(system, parameters, start, horizon, _STEPS, wide=True)
    except OverflowError:
        return 1.0, False
    further = span / done if done and lost <= FOLLOWED else 1.0
    return lost * max(1.0, further), done >= span


def _followed(
    system: System,
    parameters: Parameters,
    start: tuple[Fraction, ...],
    horizon: Fraction,
    steps: int,
    wide: bool = False,
) -> tuple[float, float, float, float]:
    """Amplification and loss up to the end of the computation; its time, and the horizon, times the rate."""
    scale = rate(system, parameters, start)
    if not scale or not horizon:
        return 1.0, 1.0, 0.0, 0.0
    span = float(scale * abs(horizon))
    return *_path(system, parameters, start, horizon > 0, wide).largest(span, steps), span


def _units(scale: Fraction) -> list[Fraction]:
    return [abs(scale)] * 3 + [Fraction(1)] * 3


def _taken_apart(system: System, p: Parameters, scale: Fraction) -> tuple[Doubles, Doubles]:
    """L, shape (6, 6), and symmetric B, shape (6, 6, 6), of the field L y + B(y, y) in units of ``scale``."""
    from gmpy2 import mpq

    units = [mpq(unit) for unit in _units(scale)]
    size, exactly = mpq(scale), p.mapped(mpq)

    def field(*axes: int) -> list[tuple[mpq, mpq]]:
        """(even, odd) part of each rate."""
        y = [axes.count(k) * unit for k, unit in enumerate(units)]
        forwards, backwards = system.field(exactly, y), system.field(exactly, [-value for value in y])
        return [
            ((a + b) / (2 * unit * size), (a - b) / (2 * unit * size))
            for a, b, unit in zip(forwards, backwards, units, strict=True)
        ]

    single = [field(j) for j in range(6)]
    linear = numpy.array([[_nearest(part[i][1]) for part in single] for i in range(6)])
    products = numpy.empty((6, 6, 6))
    for j in range(6):
        products[:, j, j] = [_nearest(even) for even, _ in single[j]]
        for k in range(j + 1, 6):
            parts = zip(field(j, k), single[j], single[k], strict=True)
            products[:, j, k] = products[:, k, j] = [_nearest((a[0] - b[0] - c[0]) / 2) for a, b, c in parts]
    return linear, products


def _nearest(value: mpq | Fraction) -> numpy.longdouble:
    """The nearest longdouble; raises OverflowError beyond doubles."""
    exactly = Fraction(int(value.numerator), int(value.denominator))
    first = float(exactly)
    return numpy.longdouble(first) + numpy.longdouble(float(exactly - Fraction(first)))


class _Path:
    """A motion and its Φ, in full steps up to the latest request, shared by all formats and horizons.

    ``_steps``: the time after each step, and the largest amplification and loss up to it.  ``_carried``:
    Φ(t, s), shape (6, steps, 6), from the beginning s of each step; ``_sizes``: |y(s)|, shape (steps, 6).
    """

    def __init__(self, linear: Doubles, products: Doubles, start: Doubles) -> None:
        self._series = _Series(linear, products)
        self._steps = [(0.0, 1.0, 1.0)]
        kind = start.dtype
        self._state, self._carried, self._sizes = start, numpy.empty((6, 0, 6), kind), numpy.empty((0, 6), kind)
        self._most = FOLLOWED * 2.0 ** (numpy.finfo(kind).nmant - 52)
        self._ended = False
        self._lock = Lock()

    def largest(self, span: float, steps: int) -> tuple[float, float, float]:
        """The largest amplification and loss up to ``span``, or up to the end of ``steps`` steps, and that time."""
        with self._lock:
            while not self._ended and self._steps[-1][0] < span and len(self._steps) <= steps:
                self._ended = not self._advance()
        index = bisect_left(self._steps[: steps + 1], span, key=itemgetter(0))
        if index == min(len(self._steps), steps + 1):
            time, largest, lost = self._steps[index - 1]
            return largest, lost, time
        (time, *before), (end, *after) = self._steps[max(index - 1, 0)], self._steps[index]
        part = (span - time) / (end - time) if math.isfinite(end) and end > time else 0.0
        largest, lost = (a ** (1 - part) * b**part for a, b in zip(before, after, strict=True))
        return largest, lost, span

    def _advance(self) -> bool:
        """Take one step; False at the end: where Φ overflows, the time does not advance or all digits are lost."""
        time, largest, lost = self._steps[-1]
        series = self._series(self._state)
        last = max(float(numpy.abs(series[order]).max()) ** (1 / order) for order in (_ORDER - 1, _ORDER))
        if not last:
            self._steps.append((math.inf, largest, lost))
            return False
        step = _TOLERANCE ** (1 / _ORDER) / last
        powers = self._state.dtype.type(step) ** numpy.arange(_ORDER + 1)
        combined = numpy.dot(powers[None], series.reshape(_ORDER + 1, -1)).reshape(6, 7)
        carried = numpy.concatenate([self._carried, numpy.eye(6)[:, None]], 1).reshape(6, -1)
        with numpy.errstate(over="ignore", invalid="ignore"):
            self._carried = (combined[:, 1:] @ carried).reshape(6, -1, 6)
            self._sizes = numpy.concatenate([self._sizes, numpy.abs(self._state)[None]])
            squares = (self._carried**2).sum(axis=0)
            size = math.sqrt(squares.sum(axis=1).max() / 6)
            error = math.sqrt((squares * self._sizes**2).sum(axis=1).max())
        self._state = combined[:, 0]
        if not (math.isfinite(size) and math.isfinite(error)) or time + step == time:
            return False
        self._steps.append((time + step, max(largest, size), max(lost, error)))
        return error <= self._most


@lru_cache(maxsize=64)
def _path(system: System, parameters: Parameters, start: tuple[Fraction, ...], forwards: bool, wide: bool) -> _Path:
    """The path of a motion, in longdouble if wide; backwards in time is forwards with the field reversed."""
    scale = rate(system, parameters, start)
    linear, products = _taken_apart(system, parameters, scale if forwards else -scale)
    state = numpy.array([_nearest(value / unit) for value, unit in zip(start, _units(scale), strict=True)])
    kind = numpy.longdouble if wide else numpy.float64
    return _Path(linear.astype(kind), products.astype(kind), state.astype(kind))


class _Series:
    """Taylor coefficients of (y, Φ) from y and Φ = 1, shape (order + 1, 6, 7), in memory that the next call reuses.

    (n + 1) Φ_(n+1) = Σ_m J_m Φ_(n−m) with J_m = 2 B(y_m, ·), and L in J_0; of y itself half of the products.
    """

    def __init__(self, linear: Doubles, products: Doubles) -> None:
        kind = products.dtype
        self._linear, self._twice = linear if linear.any() else None, 2 * products.reshape(36, 6)
        self._coefficients, self._sums = numpy.empty((_ORDER + 1, 6, 7), kind), numpy.empty((6, 7), kind)
        self._coefficients[0, :, 1:] = numpy.eye(6)
        jacobians, columns = numpy.empty((6, 6 * _ORDER), kind), self._coefficients.reshape(-1, 7)
        latest = range(6 * (_ORDER - 1), -1, -6)  # the latest Jacobian first, in the order of the sum
        self._recurrence = [
            (jacobians[:, first : first + 6], jacobians[:, first:], columns[: 6 * n], current, following)
            for n, (first, (current, following)) in enumerate(zip(latest, pairwise(self._coefficients), strict=True), 1)
        ]

    def __call__(self, state: Doubles) -> Doubles:
        self._coefficients[0, :, 0] = state
        sums, twice, linear = self._sums, self._twice, self._linear
        for n, (jacobian, jacobians, columns, current, following) in enumerate(self._recurrence, 1):
            jacobian[:] = (twice @ current[:, 0]).reshape(6, 6)
            numpy.matmul(jacobians, columns, out=sums)
            sums[:, 0] *= 0.5
            if linear is not None:
                sums += linear @ current
            numpy.divide(sums, n, out=following)
        return self._coefficients


def digits_eaten(factor: float) -> float:
    """Decimal digits that a format loses to an amplification."""
    return math.log10(factor) if factor > 1 else 0.0
