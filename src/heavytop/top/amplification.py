"""How much a motion itself amplifies a rounding error, whatever integrator follows it.

A change δ of the start is Φ(t) δ at t, with the variational equation Φ' = J(y) Φ, Φ(0) = 1.  Motion and Φ are computed
together by Taylor series in double; components of Ω are measured in units of the motion's :func:`rate`, so that neither
the units of the data nor a renaming of the axes matters.  An estimate, not a bound.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from operator import itemgetter
from threading import Lock
from typing import TYPE_CHECKING, TypeAlias

from heavytop.top.equations import Parameters, System

if TYPE_CHECKING:
    import numpy
    from gmpy2 import mpq
    from numpy.typing import NDArray


Doubles: TypeAlias = "NDArray[numpy.float64]"
_ORDER = 20
_TOLERANCE = 2.0**-52
_STEPS = 1000
"""Beyond so many steps the amplification is extrapolated."""
FOLLOWED = 1e14
"""Beyond this amplification a motion computed in double is another one: it goes on as it has grown until there."""
_STEEPER = 100.0
"""Amplification grows like t along a regular motion; so many times more than that is taken as exponential growth."""
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
    """The largest factor, up to the time ``horizon``, by which the motion has amplified a change of its start.

    The root mean square over the six directions, with Ω in units of :func:`rate`; 1 at t = 0, at least 1.
    start: six exact numbers.  About (rate·t) on a regular motion, e^(rate t) near a saddle and on a chaotic one.
    After ``steps`` steps, or where all digits of double are lost, it is extrapolated: in proportion to t, or
    exponentially where it has grown 100 times more than that.  At most 1e300; infinite for data beyond double.
    """
    scale = rate(system, parameters, start)
    if not scale or not horizon:
        return 1.0
    try:
        span = float(scale * abs(horizon))
        path = _path(system, parameters, start, horizon > 0)
    except OverflowError:
        return math.inf
    largest, done = path.largest(span, steps)
    if done >= span or not done:
        return min(largest, _LARGEST)
    further = span / done
    if largest <= _STEEPER * (1 + done):
        return min(largest * further, _LARGEST)
    return 10 ** min(math.log10(largest) * further, math.log10(_LARGEST))


def _units(scale: Fraction) -> list[Fraction]:
    return [abs(scale)] * 3 + [Fraction(1)] * 3


def _taken_apart(system: System, p: Parameters, scale: Fraction) -> tuple[Doubles, Doubles]:
    """L, shape (6, 6), and symmetric B, shape (6, 6, 6), of the field L y + B(y, y) in units of ``scale``."""
    import numpy
    from gmpy2 import mpq

    units = [mpq(unit) for unit in _units(scale)]
    size, exactly = mpq(scale), p.mapped(mpq)

    def field(*places: int) -> list[tuple[mpq, mpq]]:
        """(even, odd) part of each rate."""
        y = [places.count(k) * unit for k, unit in enumerate(units)]
        there, opposite = system.field(exactly, y), system.field(exactly, [-value for value in y])
        return [
            ((a + b) / (2 * unit * size), (a - b) / (2 * unit * size))
            for a, b, unit in zip(there, opposite, units, strict=True)
        ]

    single = [field(j) for j in range(6)]
    linear = numpy.array([[_nearest(part[i][1]) for part in single] for i in range(6)])
    products = numpy.empty((6, 6, 6))
    for j in range(6):
        products[:, j, j] = [_nearest(even) for even, _ in single[j]]
        for k in range(j + 1, 6):
            both = zip(field(j, k), single[j], single[k], strict=True)
            products[:, j, k] = products[:, k, j] = [_nearest((a[0] - b[0] - c[0]) / 2) for a, b, c in both]
    return linear, products


def _nearest(value: mpq) -> float:
    """The nearest double; raises OverflowError beyond them."""
    return float(Fraction(int(value.numerator), int(value.denominator))) if value else 0.0


class _Path:
    """A motion and its Φ, followed by full steps as far as anyone asked; every format and horizon shares it.

    Each entry of ``steps``: the time after a step, the state, Φ, the largest amplification up to it.
    """

    def __init__(self, linear: Doubles, products: Doubles, start: Sequence[float]) -> None:
        import numpy

        self._linear, self._twice = linear if linear.any() else None, 2 * products.reshape(36, 6)
        self._steps = [(0.0, numpy.array(start), numpy.eye(6), 1.0)]
        self._ended = False
        self._lock = Lock()

    def largest(self, span: float, steps: int) -> tuple[float, float]:
        """The largest amplification up to ``span``, or as far as ``steps`` steps go, and how far that is."""
        with self._lock:
            while not self._ended and self._steps[-1][0] < span and len(self._steps) <= steps:
                self._advance()
        place = bisect_left(self._steps[: steps + 1], span, key=itemgetter(0))
        if place == min(len(self._steps), steps + 1):
            time, *_, largest = self._steps[place - 1]
            return largest, time
        before = self._steps[max(place - 1, 0)]
        time, *_, largest = self._step(before, span - before[0]) or before
        return largest, time

    def _advance(self) -> None:
        found = self._step(self._steps[-1], math.inf)
        if found is not None:
            self._steps.append(found)
        self._ended = found is None or found[3] > FOLLOWED or found[0] == math.inf

    def _step(self, before: _Step, most: float) -> _Step | None:
        """One step, no longer than ``most``; None where Φ is beyond double or time stands still."""
        import numpy

        time, state, carried, largest = before
        series = _series(self._linear, self._twice, state)
        last = max(float(numpy.abs(series[order]).max()) ** (1 / order) for order in (_ORDER - 1, _ORDER))
        step = min(most, _TOLERANCE ** (1 / _ORDER) / last if last else most)
        if step == math.inf:
            return math.inf, state, carried, largest
        there = numpy.tensordot(step ** numpy.arange(_ORDER + 1), series, 1)
        state, carried = there[:, 0], there[:, 1:] @ carried
        size = math.sqrt(float((carried * carried).sum()) / 6)
        if not math.isfinite(size) or time + step == time:
            return None
        return time + step, state, carried, max(largest, size)


_Step: TypeAlias = "tuple[float, Doubles, Doubles, float]"


@lru_cache(maxsize=64)
def _path(system: System, parameters: Parameters, start: tuple[Fraction, ...], forwards: bool) -> _Path:
    """The path of a motion; backwards in time is forwards with the field reversed."""
    scale = rate(system, parameters, start)
    linear, products = _taken_apart(system, parameters, scale if forwards else -scale)
    return _Path(linear, products, [float(value / unit) for value, unit in zip(start, _units(scale), strict=True)])


def _series(linear: Doubles | None, twice: Doubles, state: Doubles) -> Doubles:
    """Taylor coefficients of (y, Φ) from y and Φ = 1, shape (order + 1, 6, 7).

    (n + 1) Φ_(n+1) = Σ_m J_m Φ_(n−m) with J_m = 2 B(y_m, ·), and L in J_0; of y itself half of the products.

    linear: L; None where it is 0.  twice: 2 B, shape (36, 6).
    """
    import numpy

    found, jacobians = numpy.empty((_ORDER + 1, 6, 7)), numpy.empty((6, 6 * _ORDER))
    found[0, :, 0], found[0, :, 1:] = state, numpy.eye(6)
    columns, shares = found.reshape(-1, 7), numpy.array([0.5, 1, 1, 1, 1, 1, 1])
    for n in range(_ORDER):
        place = 6 * (_ORDER - 1 - n)  # the latest first, as the sum takes them
        jacobians[:, place : place + 6] = (twice @ found[n, :, 0]).reshape(6, 6)
        sums = shares * (jacobians[:, place:] @ columns[: 6 * n + 6])
        if linear is not None:
            sums += linear @ found[n]
        numpy.divide(sums, n + 1, out=found[n + 1])
    return found


def digits_eaten(factor: float) -> float:
    """Decimal digits that a format loses to an amplification."""
    return math.log10(factor) if factor > 1 else 0.0
