"""How an error grows with |t|: a law fitted to its root mean square over an ensemble of starts.

The healthy laws are Brouwer's: rounding errors that are independent from step to step make every integral walk at
random, like √t, and the phase like t^1.5 (D. Brouwer, Astron. J. 46, 1937, 149).  A systematic error a step gives t
and t², a wrong coefficient of the field bounded integrals and a phase like t, a chaotic motion an exponential.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, get_args

from heavytop.records import Growth, Law

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[Any]

CLASSES: dict[Growth, float] = dict(zip(get_args(Growth)[:5], (0.0, 0.5, 1.0, 1.5, 2.0), strict=True))
FEWEST_STARTS = 8
FEWEST_DECADES = 3.0
FEWEST_SAMPLES = 8
NEAR = 0.12
"""A class exponent this far outside the interval still names the law: samples see a power only up to a transient."""
LOST = 0.1
"""An error of this part of the size of a quantity leaves no digit of it."""
RESOLVED = 10
"""Times the error of the reference, below which an error is unresolved."""
SETTLED = 10
"""Steps in which the first roundings are forgotten."""
_RESAMPLES = 1000
_SEED = 20261121


@dataclass(frozen=True, slots=True)
class Ensemble:
    """One quantity along many motions of one kind.

    times: |t| > 0, growing, shape (samples,).
    errors: |error|, above 1e-300 or 0, shape (starts, samples); a start with a NaN has failed and is left out.
    step: the mean |t| of a step.
    size: the largest that the error can be, roughly.
    resolution: the error of the reference, broadcast to the shape of ``errors``.
    accumulates: 1 where a systematic fault of ε a step becomes size · ε · n after n steps (an integral), 2 where it
    becomes size · ε · n²/2 (the phase, whose rate is what drifts).
    """

    times: Array
    errors: Array
    step: float
    size: float = 1.0
    resolution: Array | float = 0.0
    accumulates: int = 1

    @property
    def healthy(self) -> Array:
        """Which starts are finite at every time, shape (starts,)."""
        import numpy

        return numpy.asarray(numpy.isfinite(self.errors).all(axis=1))

    def rms(self) -> Array:
        """Root mean square over the healthy starts, shape (samples,); NaN where it is not resolved or no start is."""
        import numpy

        kept = self.errors[self.healthy]
        if not len(kept):
            return numpy.full(len(self.times), numpy.nan)
        limits = numpy.broadcast_to(self.resolution, self.errors.shape)[self.healthy]
        rms, blur = (_root_mean_square(values) for values in (kept, limits))
        return numpy.where(rms >= RESOLVED * blur, rms, numpy.nan)


def _root_mean_square(values: Array) -> Array:
    """Over axis 0, without underflow of the squares."""
    import numpy

    largest: Array = numpy.abs(values).max(axis=0)
    scaled = numpy.divide(values, largest, out=numpy.zeros_like(values, dtype=float), where=largest > 0)
    root: Array = largest * numpy.sqrt((scaled**2).mean(axis=0))
    return root


@cache
def resampled(starts: int) -> Array:
    """Weights of the bootstrap, shape (resamples, starts); each row sums to 1.  The same for the same ``starts``."""
    import numpy

    draws = numpy.random.default_rng(_SEED).multinomial(starts, numpy.full(starts, 1 / starts), _RESAMPLES)
    weights: Array = draws / starts
    return weights


def band(values: Array) -> float | None:
    """Half-width in decades of the 95 % bootstrap interval of the RMS of ``values``, shape (starts,).

    None with fewer than eight values, where one is not finite, and where most are 0.
    """
    import numpy

    if len(values) < FEWEST_STARTS or not numpy.isfinite(values).all() or numpy.count_nonzero(values) < len(values) / 2:
        return None
    squares = (values / values.max()) ** 2
    low, high = _interval(numpy.log10(resampled(len(values)) @ squares) / 2, len(values))
    return float(high - low) / 2


def _interval(estimates: Array, starts: int) -> tuple[float, float]:
    """The 95 % percentile interval, expanded for few starts (T. Hesterberg, Am. Stat. 69, 2015, 371).

    By √(n/(n − 1)), for resamples scatter about the sample and not the truth, and by the ratio of the 97.5 % points of
    Student's t and the normal distribution, 1 + (z² + 1)/(4 (n − 1)) with z = 1.96.
    """
    import numpy

    low, middle, high = numpy.percentile(estimates, [2.5, 50, 97.5])
    wider = (starts / (starts - 1)) ** 0.5 * (1 + 1.21 / (starts - 1))
    return float(middle + (low - middle) * wider), float(middle + (high - middle) * wider)


def law(ensemble: Ensemble) -> Law:
    """The law of growth, by least squares of log RMS on log |t| (or on |t|), with its interval over starts.

    The span begins when ten steps are behind, or three decades before its end where that is earlier; it ends before
    the error of any start reaches a tenth of the size of the quantity.  Samples with no resolved RMS are not used.
    A power needs three decades of |t|; its class is the nearest, and must be in the interval (to ±0.12) with its
    neighbours out of it.  An exponential needs three decades of error, a power fit steeper than t², and must fit
    better than the power in 95 % of the resamples.  Otherwise the law is unresolved.
    An error that is exactly 0 throughout is bounded, without an exponent.

    detects: the smallest ε, a systematic relative fault a step, that would have been told: its n-th sum f lifts the
    RMS r at the last fitted time to √(r² + f²), and the lower end of that ensemble's 95 % interval, about
    √(r_low² + f²), must be above the upper end r_high of the healthy one: f = √(r_high² − r_low²), with
    f = size ε n for an integral and size ε n²/2 for the phase.
    """
    import numpy

    starts = int(ensemble.healthy.sum())
    unresolved = Law("unresolved", starts)
    if starts < FEWEST_STARTS:
        return unresolved
    errors = ensemble.errors[ensemble.healthy]
    if not errors.any():
        ends = [f"{ensemble.times[i]:.6g}" for i in (0, -1)]
        return Law("bounded", starts, first=ends[0], last=ends[1])
    span = _span(ensemble, errors)
    if len(span) < FEWEST_SAMPLES:
        return unresolved
    times, rms = ensemble.times[span], ensemble.rms()[span]
    squares = (errors[:, span] / rms) ** 2
    logs = numpy.log(rms) + numpy.log(resampled(starts) @ squares) / 2
    found = _exponential(times, rms, logs, starts) or _power(times, rms, logs, starts)
    if found is None:
        return unresolved
    growth, slope, (low, high) = found
    return Law(
        growth,
        starts,
        round(slope, 6),
        round(low, 6),
        round(high, 6),
        first=f"{times[0]:.6g}",
        last=f"{times[-1]:.6g}",
        detects=None if growth == "exponential" else _detects(ensemble, times[-1], _interval(logs[:, -1], starts)),
        lost_at=_lost(ensemble, growth, slope, times, rms),
    )


def _detects(ensemble: Ensemble, last: float, logs: tuple[float, float]) -> str:
    """As :func:`law` says, from the interval of log RMS at the ``last`` time."""
    import numpy

    low, high = numpy.exp(logs)
    n, order = last / ensemble.step, ensemble.accumulates
    return f"{(high**2 - low**2) ** 0.5 * order / n**order / ensemble.size:.3g}"


def _span(ensemble: Ensemble, errors: Array) -> Array:
    """Indices of the samples to fit."""
    import numpy

    saturated = numpy.flatnonzero(errors.max(axis=0) >= LOST * ensemble.size)
    end = int(saturated[0]) if len(saturated) else len(ensemble.times)
    if not end:
        return numpy.array([], dtype=int)
    last = ensemble.times[end - 1]
    begin = max(ensemble.step, min(SETTLED * ensemble.step, last / 10**FEWEST_DECADES))
    index = numpy.arange(end)
    usable = (ensemble.times[:end] >= begin * (1 - 1e-9)) & (ensemble.rms()[:end] > 0)
    found: Array = index[usable]
    return found


def _fit(x: Array, y: Array, weights: Array | None = None) -> tuple[Any, Any]:
    """Slopes and sums of squared residuals of least-squares lines through (x, y), y of shape (..., samples)."""
    import numpy

    w = numpy.ones_like(x) if weights is None else weights
    centred = x - numpy.average(x, weights=w)
    rest = y - numpy.average(y, axis=-1, weights=w)[..., numpy.newaxis]
    slopes = rest @ (w * centred) / (w @ centred**2)
    return slopes, (rest - slopes[..., numpy.newaxis] * centred) ** 2 @ w


_Fit = tuple[Growth, float, tuple[float, float]]


def _power(times: Array, rms: Array, logs: Array, starts: int) -> _Fit | None:
    import numpy

    if times[-1] < times[0] * 10**FEWEST_DECADES * 0.999:
        return None
    x = numpy.log(times)
    slope = float(_fit(x, numpy.log(rms))[0])
    low, high = _interval(_fit(x, logs)[0], starts)
    growth = min(CLASSES, key=lambda name: abs(CLASSES[name] - slope))
    others = (value for name, value in CLASSES.items() if name != growth)
    if not low - NEAR <= CLASSES[growth] <= high + NEAR or any(low <= value <= high for value in others):
        return None
    return growth, slope, (low, high)


def _exponential(times: Array, rms: Array, logs: Array, starts: int) -> _Fit | None:
    """Samples count as much as the time they stand for: spaced in log |t|, the first of them would hide the rate."""
    import numpy

    if rms[-1] < rms[0] * 10**FEWEST_DECADES:
        return None
    weights = numpy.gradient(times)
    powers, off_power = _fit(numpy.log(times), logs, weights)
    rates, off_exponential = _fit(times, logs, weights)
    if _interval(powers, starts)[0] <= CLASSES["t^2"] or (off_exponential < off_power).mean() < 0.95:
        return None
    return "exponential", float(_fit(times, numpy.log(rms), weights)[0]), _interval(rates, starts)


def _lost(ensemble: Ensemble, growth: Growth, slope: float, times: Array, rms: Array) -> str | None:
    """When the RMS is a tenth of the size: the first sample where it is, else by the class from the last samples on."""
    import numpy

    beyond = numpy.flatnonzero(ensemble.rms() >= LOST * ensemble.size)
    if len(beyond):
        return f"{ensemble.times[beyond[0]]:.3g}"
    if growth == "bounded":
        return None
    # the last quarter of the samples: there the law is nearest
    late = slice(-(len(times) // 4), None)
    missing = numpy.log(LOST * ensemble.size) - numpy.log(rms[late]).mean()
    if growth == "exponential":
        return f"{times[late].mean() + missing / slope:.3g}"
    return f"{numpy.exp(numpy.log(times[late]).mean() + missing / CLASSES[growth]):.3g}"
