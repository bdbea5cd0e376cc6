"""Ensembles of errors whose law of growth is known."""

import numpy

STEP = 0.5
EPS = 2.0**-52
TIMES = 10 ** (numpy.arange(8 * 5 + 1) / 8)
NAMES = {"walk": "t^0.5", "linear": "t", "integrated": "t^1.5", "quadratic": "t^2", "bounded": "bounded"}
EXPONENT = {"walk": 0.5, "linear": 1, "integrated": 1.5, "quadratic": 2, "bounded": 0}


def walks(rng, starts: int, times=TIMES):
    """A random walk of EPS a step and its sum, exactly at the times: shape (2, starts, samples)."""
    walk, total, done = numpy.zeros(starts), numpy.zeros(starts), 0
    found = []
    for steps in numpy.round(times / STEP):
        n = steps - done
        rise, bridge = rng.normal(size=(2, starts))
        # n steps at once: the sum of a walk given its end has mean n/2 of it and variance n³/12
        total = total + n * walk + n**1.5 * (rise / 2 + bridge / 12**0.5)
        walk, done = walk + rise * n**0.5, steps
        found.append((walk, total))
    return EPS * numpy.moveaxis(numpy.array(found), 0, 2)


def synthetic(kind: str, rng, starts: int = 64, times=TIMES):
    """|error|, shape (starts, samples), with amplitudes that scatter over the starts by a factor 2."""
    amplitude = numpy.exp(0.7 * rng.normal(size=(starts, 1)))
    phase = rng.uniform(0, 6.28, size=(starts, 1))
    if kind in ("walk", "integrated"):
        values = walks(rng, starts, times)[int(kind == "integrated")] * amplitude
    elif kind == "bounded":
        values = 1e-12 * amplitude * numpy.sin(1.3 * times + phase)
    else:
        values = EPS * amplitude * (times / STEP) ** EXPONENT[kind] * (1 + 0.3 * numpy.sin(1.7 * times + phase))
    # the sample is rounded to a number of the format
    return numpy.abs(numpy.round(values / EPS) * EPS)


def chaotic(rng, starts: int, rate: float = 0.15, times=TIMES, spread: float = 0.0):
    """Rates that scatter over the starts by the relative ``spread``, about their median; errors saturate at 1."""
    rates = rate * (1 + spread * rng.normal(size=(starts, 1))) if spread else rate
    grown = EPS * numpy.abs(rng.normal(size=(starts, 1))) * numpy.exp(numpy.minimum(rates * times, 60))
    return numpy.where(grown < 1, grown, 1) * numpy.exp(0.5 * rng.normal(size=(starts, len(times))))
