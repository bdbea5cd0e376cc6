"""Plain records with a schema: what the suite writes and the report reads.

Numbers that measure something are decimal text with their log10 beside them, so that 1e-997 survives.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, SupportsFloat

import msgspec

SCHEMA = "heavytop-report/1"

UNMEASURED = OUT_OF_REACH, CONTRADICTION, FAILED = "out_of_reach", "contradiction", "failed"
"""Outcomes of a row that came to nothing: it has no metrics, and says why in the place of a reference.

failed: an integrator of others raised an error, or gave back what is no motion."""

Bits = Annotated[int, msgspec.Meta(ge=0, le=100_000)]
Starts = Annotated[int, msgspec.Meta(ge=1)]
Count = Annotated[int, msgspec.Meta(ge=0)]
Seconds = Annotated[float, msgspec.Meta(ge=0)]
Kind = Literal["error", "duration", "value"]
"""How two values of a metric compare: a smaller error is better, a longer duration is better, a value must agree."""


class Metric(msgspec.Struct, gc=False):
    """One measured number.

    value: decimal text; or a word that is no number: "nan", "missing", "never", "unresolved" (smaller than ten radii
    of the reference, see ``bound``).
    log10: its decimal logarithm; null for 0 and for the words.
    band: half-width in decades of the 95 % interval in which rounding luck alone moves the value, where measured.
    """

    value: str
    log10: float | None
    kind: Kind = "error"
    bound: str | None = None
    band: Annotated[float, msgspec.Meta(ge=0, le=100)] | None = None

    def __float__(self) -> float:
        """The nearest double, 0 where that is too small; the bound of what is unresolved, nan for the other words."""
        try:
            return float(self.bound if self.bound is not None else self.value)
        except ValueError:
            return math.inf if self.value == "never" else math.nan

    def __lt__(self, other: SupportsFloat) -> bool:
        return float(self) < float(other)

    def __le__(self, other: SupportsFloat) -> bool:
        return float(self) <= float(other)

    def __gt__(self, other: SupportsFloat) -> bool:
        return float(self) > float(other)

    def __ge__(self, other: SupportsFloat) -> bool:
        return float(self) >= float(other)


class Series(msgspec.Struct):
    """A measured quantity over time.  values: decimal text or the words of :class:`Metric`, one for each time."""

    times: list[str]
    values: list[str]


Growth = Literal["bounded", "t^0.5", "t", "t^1.5", "t^2", "exponential", "unresolved"]


class Law(msgspec.Struct):
    """How a quantity grows with |t|: a fit to its RMS over an ensemble of starts.

    growth: the class; exponent of |t| (or rate of e^(rate |t|) where exponential) with its 95 % bootstrap interval over
    starts, null where unresolved.
    first, last: the span of |t| that was fitted, which ends before saturation.
    detects: decimal text; the smallest relative fault a step that this ensemble would have told from the healthy law.
    lost_at: |t| from which the format holds no digit, reached or extrapolated; null where no law says so.
    """

    growth: Growth
    starts: Count
    exponent: float | None = None
    low: float | None = None
    high: float | None = None
    first: str | None = None
    last: str | None = None
    detects: str | None = None
    lost_at: str | None = None


class Row(msgspec.Struct):
    """One measurement, of one motion held against one reference.

    measured: what is held (known, claimed or computed); against: what it is held against, with method and radius.
    outcome, time_reached, steps, finite travel with every number.  seconds: timings, not compared.
    evaluations: of the field, where the integrator counts them.
    samples: how many times the largest values are over; 0 where that is not said.
    starts: how many starts stand behind the row; laws: how its series grow, by the name of the series.
    """

    case: str
    system: str
    integrator: str
    precision: str
    bits: Bits
    outcome: str
    horizon: str
    time_reached: str
    steps: Count
    finite: bool
    metrics: dict[str, Metric]
    measure: str = ""
    measured: str = ""
    against: str = ""
    order: Count | None = None
    flags: dict[str, str] = {}
    input_rounding: str | None = None
    series: dict[str, Series] = {}
    samples: Count = 0
    starts: Starts = 1
    laws: dict[str, Law] = {}
    seconds: dict[str, Seconds] = {}
    evaluations: Count | None = None

    @property
    def key(self) -> tuple[str, ...]:
        """What makes a row the same row in another report."""
        return self.measure, self.case, self.system, self.integrator, self.precision


class Report(msgspec.Struct):
    """A run of a plan: schema, plan (name and content hash), environment, rows in the plan's order."""

    schema: str
    plan: dict[str, str]
    environment: dict[str, Any]
    rows: list[Row]
