"""Growth laws of errors: fits in |t| to the root mean square over an ensemble of starts.

Brouwer's laws hold for a correct integrator: rounding errors that are independent from step to step make each integral
a random walk, which grows like √t, and the phase error like t^1.5 (D. Brouwer, Astron. J. 46, 1937, 149).  A systematic
error per step gives t and t², a wrong coefficient of the field bounded integrals and a phase error like t, chaos an
exponential.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import get_args

import numpy

from heavytop.precision import Array
from heavytop.records import Growth, Law

Interval = tuple[float, float]
CLASSES: dict[Growth, float] = dict(zip(get_args(Growth)[:5], (0.0, 0.5, 1.0, 1.5, 2.0), strict=True))
FEWEST_STARTS = 8
FEWEST_DECADES = 3.0
FEWEST_SAMPLES = 8
NEAR = 0.12
"""The class exponent may lie this far outside the interval: samples show a power only up to a transient."""
BENT = 0.25
"""Half the distance of neighbouring classes: an exponent that significantly changes by this in the span is no law."""
STRAIGHT = 0.1
"""Largest fraction of the variance of log |error| left by a line over |t|; for a jump it is at least a quarter."""
LOST = 0.1
"""All significant digits of a quantity are lost at an error of this fraction of its size."""
RESOLVED = 10
"""An error below so many times that of the reference is unresolved."""
_DECIMALS = 6
_RESAMPLES = 1000
_ROUNDS = 3
_SEED = 20261121
_ONE_THREAD = 1 << 18
"""Multiplications from which OpenBLAS uses several threads, which wait for busy processors."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """The errors of one quantity along the motions of an ensemble.

    times: |t| > 0, increasing, shape (samples,).
    errors: |error|, above 1e-300 or 0, shape (starts, samples); a start with a NaN has failed and is left out.
    step: the mean step size.
    size: the order of magnitude of the largest possible error.
    resolution: the error of the reference, broadcast to the shape of ``errors``.
    accumulates: 1 if a systematic fault of ε per step grows to size · ε · n after n steps (an integral), 2 if it grows
    to size · ε · n²/2 (the phase, whose rate drifts).
    """

    times: Array
    errors: Array
    step: float
    size: float = 1.0
    resolution: Array | float = 0.0
    accumulates: int = 1

    @property
    def healthy(self) -> Array:
        """Mask of the starts that are finite at every time, shape (starts,)."""
        return numpy.asarray(numpy.isfinite(self.errors).all(axis=1))

    def rms(self) -> Array:
        """Root mean square over the healthy starts, shape (samples,); NaN if unresolved or without a start."""
        healthy = self.errors[self.healthy]
        if not len(healthy):
            return numpy.full(len(self.times), numpy.nan)
        limits = numpy.broadcast_to(self.resolution, self.errors.shape)[self.healthy]
        rms, blur = (root_mean_square(values) for values in (healthy, limits))
        return numpy.where(rms >= RESOLVED * blur, rms, numpy.nan)


def root_mean_square(values: Array) -> Array:
    """Root mean square of finite values over axis 0 (not empty), without underflow of the squares."""
    largest: Array = numpy.abs(values).max(axis=0)
    scaled = numpy.divide(values, largest, out=numpy.zeros_like(values, dtype=float), where=largest > 0)
    root: Array = largest * numpy.sqrt((scaled**2).mean(axis=0))
    return root


def _product(rows: Array, columns: Array) -> Array:
    """``rows @ columns``, for a vector or a matrix of columns, in this thread alone."""
    if columns.ndim == 1:
        return numpy.asarray(numpy.einsum("...i,i", rows, columns))
    block = max(1, _ONE_THREAD // columns.size)
    return numpy.concatenate([rows[i : i + block] @ columns for i in range(0, len(rows), block)])


@cache
def resampled(starts: int) -> Array:
    """Weights of the bootstrap, shape (resamples, starts); each row sums to 1.  Deterministic."""
    draws = numpy.random.default_rng(_SEED).multinomial(starts, numpy.full(starts, 1 / starts), _RESAMPLES)
    weights: Array = draws / starts
    return weights


def band(values: Array) -> float | None:
    """Half-width in decades of the 95 % bootstrap interval of the RMS of ``values``, shape (starts,).

    None with fewer than eight values, where one is not finite, and where most are 0.
    """
    if len(values) < FEWEST_STARTS or not numpy.isfinite(values).all() or numpy.count_nonzero(values) < len(values) / 2:
        return None
    squares = (values / values.max()) ** 2
    low, high = _interval(numpy.log10(_product(resampled(len(values)), squares)) / 2, len(values))
    return float(high - low) / 2


def _interval(estimates: Array, starts: int) -> Interval:
    """The 95 % percentile interval, expanded for few starts (T. Hesterberg, Am. Stat. 69, 2015, 371).

    The factors are √(n/(n − 1)), for resamples scatter about the sample mean and not the true one, and the ratio of the
    97.5 % points of Student's t and the normal distribution, 1 + (z² + 1)/(4 (n − 1)) with z = 1.96.
    """
    low, middle, high = numpy.percentile(estimates, [2.5, 50, 97.5])
    wider = (starts / (starts - 1)) ** 0.5 * (1 + 1.21 / (starts - 1))
    return float(middle + (low - middle) * wider), float(middle + (high - middle) * wider)


def law(ensemble: Ensemble) -> Law:
    """The law of growth, with its interval over starts.

    Only samples are used whose RMS is resolved, before the error of any start reaches a tenth of the size of the
    quantity.

    A power is a least-squares line through log RMS over log |t|, over the last three decades: earlier another law may
    dominate.  Each start is weighted by its share of the RMS relative to its own mean share, so that a few starts with
    large errors do not determine the exponent.  The class is the nearest one; it must be in the interval (to ±0.12),
    and its neighbours outside.  The exponents of the two halves of the span must not significantly differ by more than
    a quarter (bend), as they do at a transition between laws.  If the exponent of the span significantly differs by as
    much from the mean of those of its halves, the error jumps, and there is no law.

    An exponential needs three decades of error, a power fit of log RMS steeper than t², and a line over |t| (samples
    weighted by their spacing) that fits better than the power in 95 % of the resamples and leaves less than a tenth of
    the variance, which excludes jumps.  Its rate is the median over the starts of their finite-time rates, each the
    slope of log |error| over |t| within the fitted span; its interval is that of this median (:func:`median_interval`).
    The few starts with the largest rates, which dominate the RMS at late times, do not determine it.

    Anything else is unresolved; if the span has three decades, the exponent and interval of the power fit are reported
    for comparison.  An error that is exactly 0 throughout is bounded, without an exponent.

    detects: the smallest detectable relative bias ε per step.  Its sum f over n steps raises the RMS r at the last
    fitted time to √(r² + f²).  The lower end of that ensemble's 95 % interval, about √(r_low² + f²), must be above the
    upper end
    r_high of the healthy one: f = √(r_high² − r_low²), with f = size ε n for an integral and size ε n²/2 for the phase.
    """
    starts = int(ensemble.healthy.sum())
    unresolved = Law("unresolved", starts)
    if starts < FEWEST_STARTS:
        return unresolved
    errors = ensemble.errors[ensemble.healthy]
    if not errors.any():
        return Law("bounded", starts, first=f"{ensemble.times[0]:.6g}", last=f"{ensemble.times[-1]:.6g}")
    used = _usable(ensemble, errors)
    if len(used) < FEWEST_SAMPLES:
        return unresolved
    times, rms = ensemble.times[used], ensemble.rms()[used]
    shares = (errors[:, used] / rms) ** 2
    fit = _exponential(times, rms, shares) or _power(times, rms, shares)
    if fit is None:
        return unresolved
    growth, first, slope, (low, high), bend = fit
    logs = numpy.log(rms[-1]) + numpy.log(_product(resampled(starts), shares[:, -1])) / 2
    lower, upper = numpy.exp(_interval(logs, starts))
    bias, n, order = (upper**2 - lower**2) ** 0.5, times[-1] / ensemble.step, ensemble.accumulates
    return Law(
        growth,
        starts,
        slope,
        low,
        high,
        first=f"{first:.6g}",
        last=f"{times[-1]:.6g}",
        detects=None if growth == "exponential" else f"{bias * order / n**order / ensemble.size:.3g}",
        lost_at=_lost(ensemble, growth, times, rms),
        bend=bend,
    )


def _usable(ensemble: Ensemble, errors: Array) -> Array:
    """Indices of the samples from the first step on, with a resolved RMS, before saturation."""
    saturated = numpy.flatnonzero(errors.max(axis=0) >= LOST * ensemble.size)
    end = int(saturated[0]) if len(saturated) else len(ensemble.times)
    known = (ensemble.rms() > 0) & (ensemble.times >= ensemble.step)
    return numpy.flatnonzero(known[:end])


def _fit(x: Array, y: Array, weights: Array | None = None) -> tuple[Array, Array]:
    """Slopes and sums of squared residuals of least-squares lines through (x, y), y of shape (..., samples)."""
    w = numpy.ones_like(x) if weights is None else weights
    centred = x - numpy.average(x, weights=w)
    deviations = y - numpy.average(y, axis=-1, weights=w)[..., numpy.newaxis]
    slopes = _product(deviations, w * centred) / (w @ centred**2)
    return slopes, _product((deviations - slopes[..., numpy.newaxis] * centred) ** 2, w)


_Fit = tuple[Growth, float, float, Interval, Interval | None]
"""Class, first fitted time, exponent or rate, its interval, and for a power the interval of its bend."""


def _power(times: Array, rms: Array, shares: Array) -> _Fit | None:
    # times are rounded to a few digits
    late = times >= times[-1] / 10**FEWEST_DECADES * 0.999
    x, y, shares = numpy.log(times[late]), numpy.log(rms[late]), shares[:, late]
    if times[late][-1] < times[late][0] * 10**FEWEST_DECADES * 0.9 or len(x) < FEWEST_SAMPLES:
        return None
    starts, half = len(shares), len(x) // 2
    slopes, squares = _fit(x, y + _balanced(shares, numpy.full((1, starts), 1 / starts)))
    slope, scatter = float(slopes[0]), float(squares[0] / (len(x) - 2) / ((x - x.mean()) ** 2).sum()) ** 0.5
    logs = y + _balanced(shares, resampled(starts))
    overall, first, second = (_fit(x[part], logs[:, part])[0] for part in (slice(None), slice(half), slice(half, None)))
    # if the error jumps, the slope of the span is not the mean of those of its halves
    if bent(_interval(overall - (first + second) / 2, starts)):
        return None
    begin, end = _interval(second - first, starts)
    low, high = _widened(slope, _interval(overall, starts), scatter)
    # the class follows from the rounded numbers, as they are printed
    slope, low, high, begin, end = (round(value, _DECIMALS) for value in (slope, low, high, begin, end))
    growth = "unresolved" if bent((begin, end)) else nearest_class(slope, low, high)
    return growth, times[late][0], slope, (low, high), (begin, end)


def bent(bend: Interval) -> bool:
    """Whether the exponents of the two halves significantly differ by more than :data:`BENT`."""
    return bend[0] > BENT or bend[1] < -BENT


def nearest_class(exponent: float, low: float, high: float) -> Growth:
    """The class nearest to an exponent if it is the only one in the interval ``low`` to ``high``, else unresolved."""
    growth = min(CLASSES, key=lambda name: abs(CLASSES[name] - exponent))
    others = (value for name, value in CLASSES.items() if name != growth)
    alone = low - NEAR <= CLASSES[growth] <= high + NEAR and not any(low <= value <= high for value in others)
    return growth if alone else "unresolved"


def _widened(slope: float, interval: Interval, scatter: float) -> Interval:
    """The interval of an exponent, widened to a coverage of 95 % for every law.

    The bootstrap does not see errors common to all starts: an oscillation is sampled at the same few phases in each,
    which changes the slope by the standard error of the fit, ``scatter`` (`validation/law_coverage.py` counts).
    """
    low, high = (math.hypot(max(part, 0.0), 2 * scatter) for part in (slope - interval[0], interval[1] - slope))
    return slope - low, slope + high


def _balanced(shares: Array, weights: Array) -> Array:
    """Half the log of the mean share with each start scaled to its own mean, shape (resamples, samples).

    weights: of the starts, shape (resamples, starts); each mean refers to the shares of its resample.
    """
    mean = _product(weights, shares)
    # the mean of a start is relative to all: iterated with scaled starts, until large ones do not dominate
    for _ in range(_ROUNDS):
        means = _product(1 / mean, shares.T)
        scaled = numpy.divide(weights, means, out=numpy.zeros_like(means), where=means > 0)
        mean = _product(scaled, shares)
    logs: Array = numpy.log(mean) / 2
    return logs


def _exponential(times: Array, rms: Array, shares: Array) -> _Fit | None:
    if rms[-1] < rms[0] * 10**FEWEST_DECADES:
        return None
    weights, starts = numpy.gradient(times), len(shares)
    drawn = _product(resampled(starts), shares)
    # a resample of few starts may be exactly 0
    logs = numpy.log(rms) + numpy.log(drawn[(drawn > 0).all(axis=1)]) / 2
    powers, power_residuals = _fit(numpy.log(times), logs, weights)
    _, exponential_residuals = _fit(times, logs, weights)
    centred = logs - numpy.average(logs, axis=-1, weights=weights)[:, numpy.newaxis]
    limits = numpy.minimum(power_residuals, STRAIGHT * _product(centred**2, weights))
    better = exponential_residuals < limits
    if _interval(powers, starts)[0] <= CLASSES["t^2"] or better.mean() < 0.95:
        return None
    rates = finite_time_rates(times, numpy.sqrt(shares) * rms)
    rate, low, high = (round(value, _DECIMALS) for value in (float(numpy.median(rates)), *median_interval(rates)))
    return "exponential", times[0], rate, (low, high), None


def finite_time_rates(times: Array, errors: Array) -> Array:
    """The rate of each start, shape (starts,): the slope of log |error| over |t|, samples weighted by their spacing.

    Samples with an error of exactly 0 have no weight; a start with fewer than two others has the rate 0.
    """
    weights = numpy.where(errors > 0, numpy.gradient(times), 0.0)
    logs = numpy.log(numpy.where(errors > 0, errors, 1.0))
    total = numpy.maximum(weights.sum(axis=1, keepdims=True), numpy.finfo(float).tiny)
    centred = times - (weights * times).sum(axis=1, keepdims=True) / total
    spread = (weights * centred**2).sum(axis=1)
    moment = (weights * centred * logs).sum(axis=1)
    rates: Array = numpy.divide(moment, spread, out=numpy.zeros_like(moment), where=spread > 0)
    return rates


def median_interval(values: Array) -> Interval:
    """The narrowest symmetric pair of order statistics that encloses the median with a probability of at least 95 %.

    Each value is above the median of its distribution with probability 1/2, whatever the distribution is: so the
    number of those below is binomial, and the interval is exact for any number of starts, where a percentile bootstrap
    of the median is too narrow (W. J. Conover, Practical Nonparametric Statistics, 1999, §3.2).
    """
    ordered, count = numpy.sort(values), len(values)
    outside, last = 0, 0
    for k in range(count // 2):
        outside += math.comb(count, k)
        if 2 * outside > 0.05 * 2**count:
            break
        last = k
    return float(ordered[last]), float(ordered[count - 1 - last])


def _lost(ensemble: Ensemble, growth: Growth, times: Array, rms: Array) -> str | None:
    """The time at which the RMS reaches a tenth of the size, in a sample, else by the law; None if unknown."""
    beyond = numpy.flatnonzero(ensemble.rms() >= LOST * ensemble.size)
    if len(beyond):
        return f"{ensemble.times[beyond[0]]:.3g}"
    if growth in ("bounded", "unresolved"):
        return None
    # the last quarter of the samples follows the law best
    late = slice(-(len(times) // 4), None)
    missing = numpy.log(LOST * ensemble.size) - numpy.log(rms[late]).mean()
    if growth == "exponential":
        # the root mean square grows with the fastest starts, faster than the median of the rates
        rate = float(_fit(times, numpy.log(rms), numpy.gradient(times))[0])
        return f"{times[late].mean() + missing / rate:.3g}"
    return f"{numpy.exp(numpy.log(times[late]).mean() + missing / CLASSES[growth]):.3g}"
