"""Lists of times in a plan, checked."""

from __future__ import annotations

from fractions import Fraction

from heavytop.errors import InputError
from heavytop.precision import exact, physical

_MAX_SAMPLES = 1_000_000


def log_spaced(count: int, per_decade: int = 8) -> list[int]:
    """About ``per_decade`` whole numbers a decade from 1 to ``count``, both included."""
    wanted = {count}
    i = 0
    while (value := round(10 ** (i / per_decade))) < count:
        wanted.add(value)
        i += 1
    return sorted(wanted)


def positive(texts: list[str], what: str) -> list[Fraction]:
    """Exact numbers; raises InputError unless they are positive and grow."""
    values = [physical(exact(text), what) for text in texts]
    if not values or values != sorted(set(values)) or values[0] <= 0:
        raise InputError(f"{what} = {texts}", "Give positive numbers in growing order, each once.")
    return values


def samples(count: int) -> int:
    """The count; raises InputError where it cannot be."""
    if not 1 <= count <= _MAX_SAMPLES:
        raise InputError(f"{count} samples cannot be taken.", f"Give a number from 1 to {_MAX_SAMPLES}.")
    return count


def signed(times: list[Fraction], direction: str) -> tuple[Fraction, ...]:
    """The times forward or backward."""
    return tuple(-time for time in times) if direction == "backward" else tuple(times)


def uniform(horizon: Fraction, count: int) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
    """``count`` uniform samples up to the horizon, and those of them that go into a series, about eight a decade."""
    times = tuple(horizon * i / count for i in range(1, samples(count) + 1))
    return times, tuple(times[i - 1] for i in log_spaced(count))
