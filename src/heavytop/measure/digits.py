"""How many digits of a motion are right: one definition, for every table, page and document."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from flint import arb

from heavytop.measure.scalar import largest
from heavytop.precision import exact, log10
from heavytop.records import Against, Metric, Quantity

RELATIVE = Quantity("solution_error", "relative", "max")
"""The metric behind the digits right: the largest |error|/max(1, |true value|) of a component of Ω or γ over the
samples."""

_ONE = arb(1)


def relative_error(errors: Sequence[arb], truth: Sequence[arb]) -> arb:
    """The largest |error|/max(1, |true value|) over the components of one state, at the working precision."""
    sizes = map(abs, truth)
    return largest(error if size < _ONE else error / size.max(_ONE) for error, size in zip(errors, sizes, strict=True))


class Measured(Protocol):
    """A row, as far as its digits are concerned."""

    @property
    def bits(self) -> int: ...

    @property
    def metrics(self) -> dict[str, Metric]: ...

    @property
    def reference(self) -> Against: ...


def digits_kept(row: Measured) -> float | None:
    """−log10 of the largest |error|/max(1, |true value|) over the samples and the components of Ω and γ.

    Rounded to two places; :func:`digits_right` has all.
    """
    found = digits_right(row)
    return None if found is None else round(found, 2)


def digits_right(row: Measured) -> float | None:
    """−log10 of the largest |error|/max(1, |true value|) over the samples and the components of Ω and γ.

    At most the digits that the format has.  Where the reference does not resolve the error, the digits that are proven.
    Of an ensemble: from the root mean square over its starts of each start's largest.
    0 where the format has no digit left before the end.
    None without a reference, without a sample, and for a value that is not finite.
    """
    metric = row.metrics.get(RELATIVE.text)
    if metric is None or (metric.log10 is None and metric.bound is None and metric.value != "0"):
        return None
    if row.reference.until:
        return 0.0
    size = metric.log10 if metric.bound is None else log10(exact(metric.bound))
    most = row.bits * math.log10(2)
    return most if size is None else min(most, -size)


def digits_text(kept: float) -> str:
    """Digits right, for people: to one place, and none where the error is larger than the value."""
    return f"{max(0.0, kept):.1f}"


def digits_of(bits: int) -> int:
    """Decimal digits of a format with so many bits: 16 in double, 34 in quad."""
    return round(bits * math.log10(2))
