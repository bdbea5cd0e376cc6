"""How an error grows with |t|: a law fitted to its root mean square over an ensemble of starts.

The healthy laws are Brouwer's: rounding errors that are independent from step to step make every integral walk at
random, like √t, and the phase like t^1.5 (D. Brouwer, Astron. J. 46, 1937, 149).  A systematic error a step gives t
and t², a wrong coefficient of the field bounded integrals and a phase like t, a chaotic motion an exponential.
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
"""A class exponent this far outside the interval still names the law: samples see a power only up to a transient."""
BENT = 0.25
"""Half the way from a class to the next: an exponent that surely changes by this within the span is not a law."""
STRAIGHT = 0.1
"""Part of the variance of log |error| that a line over |t| may leave: of a jump it leaves a quarter at least."""
LOST = 0.1
"""An error of this part of the size of a quantity leaves no digit of it."""
RESOLVED = 10
"""Times the error of the reference, below which an error is unresolved."""
_DECIMALS = 6
_RESAMPLES = 1000
_ROUNDS = 3
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
        return numpy.asarray(numpy.isfinite(self.errors).all(axis=1))

    def rms(self) -> Array:
        """Root mean square over the healthy starts, shape (samples,); NaN where it is not resolved or no start is."""
        kept = self.errors[self.healthy]
        if not len(kept):
            return numpy.full(len(self.times), numpy.nan)
        limits = numpy.broadcast_to(self.resolution, self.errors.shape)[self.healthy]
        rms, blur = (root_mean_square(values) for values in (kept, limits))
        return numpy.where(rms >= RESOLVED * blur, rms, numpy.nan)


def root_mean_square(values: Array) -> Array:
    """Root mean square of finite values over axis 0, which is not empty, without underflow of the squares."""
    largest: Array = numpy.abs(values).max(axis=0)
    scaled = numpy.divide(values, largest, out=numpy.zeros_like(values, dtype=float), where=largest > 0)
    root: Array = largest * numpy.sqrt((scaled**2).mean(axis=0))
    return root


@cache
def resampled(starts: int) -> Array:
    """Weights of the bootstrap, shape (resamples, starts); each row sums to 1.  The same for the same ``starts``."""
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
    low, high = _interval(numpy.log10(resampled(len(values)) @ squares) / 2, len(values))
    return float(high - low) / 2


def _interval(estimates: Array, starts: int) -> Interval:
    """The 95 % percentile interval, expanded for few starts (T. Hesterberg, Am. Stat. 69, 2015, 371).

    By √(n/(n − 1)), for resamples scatter about the sample and not the truth, and by the ratio of the 97.5 % points of
    Student's t and the normal distribution, 1 + (z² + 1)/(4 (n − 1)) with z = 1.96.
    """
    low, middle, high = numpy.percentile(estimates, [2.5, 50, 97.5])
    wider = (starts / (starts - 1)) ** 0.5 * (1 + 1.21 / (starts - 1))
    return float(middle + (low - middle) * wider), float(middle + (high - middle) * wider)


def law(ensemble: Ensemble) -> Law:
    """The law of growth, with its interval over starts.

    Only samples with a resolved RMS before the error of any start is a tenth of the size of the quantity are used.

    A power is a least-squares line through log RMS over log |t|, over the last three decades of these: earlier the law
    that wins in the end may hide behind another.  Each start counts by its share of the RMS relative to its own mean
    share, so that the few starts with the largest errors do not make the exponent alone.  Its class is the nearest,
    and must be in the interval (to ±0.12) with its neighbours out of it; and the exponents of its two halves
    must not surely differ by more than a quarter (bend), as they do where one law takes over from another.  Where the
    exponent of the whole surely differs by as much from the mean of those of its halves, the error jumps, and has none.

    An exponential needs three decades of error, a power fit of log RMS steeper than t², and a line over |t|, each
    sample counting as much as the time it stands for, that fits better than the power in 95 % of the resamples, and
    leaves less than a tenth of the variance, as of a jump it does not.  Its number is the median over the starts of
    their finite-time rates, each the slope of log |error| over |t| within the fitted span; its interval is that of the
    median of such rates (:func:`median_interval`).  The few starts with the largest rates, which lead the RMS in the
    end, do not make it.

    Anything else is unresolved, with the exponent and interval of the power fit where there are three decades for one,
    so that it can be compared.  An error that is exactly 0 throughout is bounded, without an exponent.

    detects: the smallest ε, a systematic relative fault a step, that would have been told: its n-th sum f lifts the
    RMS r at the last fitted time to √(r² + f²), and the lower end of that ensemble's 95 % interval, about
    √(r_low² + f²), must be above the upper end r_high of the healthy one: f = √(r_high² − r_low²), with
    f = size ε n for an integral and size ε n²/2 for the phase.
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
    logs = numpy.log(rms[-1]) + numpy.log(resampled(starts) @ shares[:, -1]) / 2
    least, most = numpy.exp(_interval(logs, starts))
    lift, n, order = (most**2 - least**2) ** 0.5, times[-1] / ensemble.step, ensemble.accumulates
    return Law(
        growth,
        starts,
        slope,
        low,
        high,
        first=f"{first:.6g}",
        last=f"{times[-1]:.6g}",
        detects=None if growth == "exponential" else f"{lift * order / n**order / ensemble.size:.3g}",
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
    rest = y - numpy.average(y, axis=-1, weights=w)[..., numpy.newaxis]
    slopes = rest @ (w * centred) / (w @ centred**2)
    return slopes, (rest - slopes[..., numpy.newaxis] * centred) ** 2 @ w


_Found = tuple[Growth, float, float, Interval, Interval | None]
"""The class, the first fitted time, the exponent or rate, its interval; of a power that of its bend."""


def _power(times: Array, rms: Array, shares: Array) -> _Found | None:
    # times are rounded to a few digits
    late = times >= times[-1] / 10**FEWEST_DECADES * 0.999
    x, y, shares = numpy.log(times[late]), numpy.log(rms[late]), shares[:, late]
    if times[late][-1] < times[late][0] * 10**FEWEST_DECADES * 0.9 or len(x) < FEWEST_SAMPLES:
        return None
    starts, half = len(shares), len(x) // 2
    slopes, squares = _fit(x, y + _levelled(shares, numpy.full((1, starts), 1 / starts)))
    slope, scatter = float(slopes[0]), float(squares[0] / (len(x) - 2) / ((x - x.mean()) ** 2).sum()) ** 0.5
    logs = y + _levelled(shares, resampled(starts))
    whole, first, second = (_fit(x[part], logs[:, part])[0] for part in (slice(None), slice(half), slice(half, None)))
    # where the error jumps, the halves do not have the slope of the whole
    if bent(_interval(whole - (first + second) / 2, starts)):
        return None
    begin, end = _interval(second - first, starts)
    low, high = _widened(slope, _interval(whole, starts), scatter)
    # the class is that of the numbers as they are written
    slope, low, high, begin, end = (round(value, _DECIMALS) for value in (slope, low, high, begin, end))
    growth = "unresolved" if bent((begin, end)) else nearest_class(slope, low, high)
    return growth, times[late][0], slope, (low, high), (begin, end)


def bent(bend: Interval) -> bool:
    """Whether the exponents of the two halves surely differ by more than a law may bend."""
    return bend[0] > BENT or bend[1] < -BENT


def nearest_class(exponent: float, low: float, high: float) -> Growth:
    """The class nearest to an exponent, if it alone is in the interval ``low`` to ``high``; else unresolved."""
    growth = min(CLASSES, key=lambda name: abs(CLASSES[name] - exponent))
    others = (value for name, value in CLASSES.items() if name != growth)
    alone = low - NEAR <= CLASSES[growth] <= high + NEAR and not any(low <= value <= high for value in others)
    return growth if alone else "unresolved"


def _widened(slope: float, interval: Interval, scatter: float) -> Interval:
    """The interval of an exponent, such that 95 % hold the truth for every law.

    The bootstrap alone knows nothing of what all starts share: an error that oscillates is seen at a few phases, the
    same in each, which bends the line by its own standard error, ``scatter`` (`validation/law_coverage.py` counts).
    """
    low, high = (math.hypot(max(part, 0.0), 2 * scatter) for part in (slope - interval[0], interval[1] - slope))
    return slope - low, slope + high


def _levelled(shares: Array, weights: Array) -> Array:
    """Half the log of the mean share with each start scaled to its own mean, shape (resamples, samples).

    weights: of the starts, shape (resamples, starts); the shares that the own means refer to are the resample's.
    """
    mean = weights @ shares
    # a start's own mean is taken relative to all: again with the scaled ones, until large ones do not lead
    for _ in range(_ROUNDS):
        own = (1 / mean) @ shares.T
        mean = numpy.divide(weights, own, out=numpy.zeros_like(own), where=own > 0) @ shares
    levelled: Array = numpy.log(mean) / 2
    return levelled


def _exponential(times: Array, rms: Array, shares: Array) -> _Found | None:
    if rms[-1] < rms[0] * 10**FEWEST_DECADES:
        return None
    weights, starts = numpy.gradient(times), len(shares)
    drawn = resampled(starts) @ shares
    # of a few starts some may be exactly 0 together
    logs = numpy.log(rms) + numpy.log(drawn[(drawn > 0).all(axis=1)]) / 2
    powers, off_power = _fit(numpy.log(times), logs, weights)
    _, off_exponential = _fit(times, logs, weights)
    centred = logs - numpy.average(logs, axis=-1, weights=weights)[:, numpy.newaxis]
    better = (off_exponential < off_power) & (off_exponential < STRAIGHT * (centred**2 @ weights))
    if _interval(powers, starts)[0] <= CLASSES["t^2"] or better.mean() < 0.95:
        return None
    rates = finite_time_rates(times, numpy.sqrt(shares) * rms)
    rate, low, high = (round(value, _DECIMALS) for value in (float(numpy.median(rates)), *median_interval(rates)))
    return "exponential", times[0], rate, (low, high), None


def finite_time_rates(times: Array, errors: Array) -> Array:
    """The rate of each start, shape (starts,): the slope of log |error| over |t|, each sample weighing its time.

    Samples where the error is exactly 0 count for nothing; a start with fewer than two others has the rate 0.
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
    """The narrowest pair of order statistics, equally far from both ends, that holds the median in 95 % or more.

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
    """When the RMS is a tenth of the size: the first sample where it is, else by the class, if that says when."""
    beyond = numpy.flatnonzero(ensemble.rms() >= LOST * ensemble.size)
    if len(beyond):
        return f"{ensemble.times[beyond[0]]:.3g}"
    if growth in ("bounded", "unresolved"):
        return None
    # the last quarter of the samples: there the law is nearest
    late = slice(-(len(times) // 4), None)
    missing = numpy.log(LOST * ensemble.size) - numpy.log(rms[late]).mean()
    if growth == "exponential":
        # the root mean square goes with the fastest starts, and faster than the median of the rates
        rate = float(_fit(times, numpy.log(rms), numpy.gradient(times))[0])
        return f"{times[late].mean() + missing / rate:.3g}"
    return f"{numpy.exp(numpy.log(times[late]).mean() + missing / CLASSES[growth]):.3g}"
