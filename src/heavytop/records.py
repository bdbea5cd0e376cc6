"""Records of measurements, with a schema: rows, metrics, references and reports.

Measured numbers are decimal text with their log10, so that 1e-997 does not underflow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from operator import ge, gt, le, lt
from typing import Annotated, Any, Literal, NamedTuple, SupportsFloat

import msgspec

from heavytop.errors import quoted
from heavytop.precision import log10 as log10_of

SCHEMA = "heavytop-report/2"

OUT_OF_REACH, CONTRADICTION, FAILED = "out_of_reach", "contradiction", "failed"
UNSUPPORTED, OUT_OF_TIME, NOT_ASKED = "unsupported", "out_of_time", "not_asked"
UNMEASURED = OUT_OF_REACH, CONTRADICTION, FAILED, UNSUPPORTED, OUT_OF_TIME, NOT_ASKED
"""Outcomes of a row that was aborted: it has no metrics, and a reason instead of a reference.

failed: a third-party integrator raised an error, or returned no trajectory.  unsupported: the request is beyond its
declared capabilities; not a failure.  out_of_time: it was stopped at the time limit of its row.
not_asked: it ran out of time in two other rows of that run."""

HEYOKA, MULTIWORD = "heyoka", "multiword"
FINEST = "eps"
"""The tolerance that stands for the finest one of an integrator."""
EXACT = "exact"
"""The precision of a row without a format."""
Direction = Literal["", "forward", "backward"]
Bits = Annotated[int, msgspec.Meta(ge=0, le=100_000)]
Starts = Annotated[int, msgspec.Meta(ge=1)]
Count = Annotated[int, msgspec.Meta(ge=0)]
Seconds = Annotated[float, msgspec.Meta(ge=0)]
UNRESOLVED_SECONDS = "unresolved"
"""Key of the seconds of a row: the resolution, if its own are shorter."""
MetricKind = Literal["error", "duration", "value"]
"""The comparison of two values: a smaller error and a longer duration are better, other values must agree."""


class Quantity(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The quantity of a number, such as the ``max`` over the samples of the ``drift`` of the ``energy``.

    component: of a vector, or a first integral.  statistic: over the samples.  branch, domain: of an equation.
    """

    name: str
    component: str = ""
    statistic: str = ""
    branch: str = ""
    domain: str = ""

    @property
    def text(self) -> str:
        """The key of a report: ``drift_energy_max``, or ``(1.1).2 smooth all`` for an equation."""
        if self.branch:
            return f"{self.name}.{self.component} {self.branch} {self.domain}"
        return "_".join(part for part in (self.name, self.component, self.statistic) if part)

    def over(self, statistic: str) -> Quantity:
        """This quantity with another statistic; "" for its series."""
        return Quantity(self.name, self.component, statistic, self.branch, self.domain)


class Metric(msgspec.Struct, frozen=True, gc=False):
    """One measured number.

    quantity: its text is the key of the metric in the report.
    value: decimal text, or a word: "nan", "missing", "never", "unresolved" (smaller than ten radii of the reference;
    see ``bound``).
    log10: its decimal logarithm; null for 0 and for words.
    band: half-width in decades of the 95 % interval in which rounding noise alone moves the value, where measured.
    """

    value: str
    log10: float | None
    kind: MetricKind = "error"
    bound: str | None = None
    band: Annotated[float, msgspec.Meta(ge=0, le=100)] | None = None
    quantity: Quantity | None = None

    def __float__(self) -> float:
        """The double nearest to :attr:`number`; infinity beyond them."""
        try:
            return float(self.number)
        except OverflowError:
            return math.inf if self.number > 0 else -math.inf

    @property
    def number(self) -> Fraction | float:
        """The exact value, or the bound of an unresolved one; infinity for ``never``, nan for other words."""
        return _parsed(self.value if self.bound is None else self.bound)

    @property
    def size(self) -> float | None:
        """log10 of the absolute value, or of the bound of an unresolved one; None for 0 and for other words."""
        if self.bound is None:
            return self.log10
        return log10_of(self.number) if isinstance(self.number, Fraction) else None

    def __eq__(self, other: object) -> bool:
        """Whether all fields of two metrics are equal; whether the number is equal to a plain number."""
        if isinstance(other, Metric):
            return super().__eq__(other)
        return isinstance(other, int | float | Fraction) and self.number == other

    def __hash__(self) -> int:
        return hash(self.number)

    @property
    def _rank(self) -> tuple[bool, Fraction | float, bytes]:
        """The sort key: the number, nan last, then all fields, as in equality."""
        number = self.number
        unknown = number != number
        return unknown, 0 if unknown else number, msgspec.json.encode(self)

    def _is(self, less: Callable[[Any, Any], bool], other: SupportsFloat) -> bool:
        return less(self._rank, other._rank) if isinstance(other, Metric) else less(self.number, float(other))

    def __lt__(self, other: SupportsFloat) -> bool:
        """The exact order of numbers, 1e-997 < 1e-996, which is total on metrics."""
        return self._is(lt, other)

    def __le__(self, other: SupportsFloat) -> bool:
        return self._is(le, other)

    def __gt__(self, other: SupportsFloat) -> bool:
        return self._is(gt, other)

    def __ge__(self, other: SupportsFloat) -> bool:
        return self._is(ge, other)


@lru_cache(1 << 14)
def _parsed(text: str) -> Fraction | float:
    """The number of a text, cached for repeated comparisons."""
    try:
        return Fraction(text)
    except ValueError:
        return math.inf if text == "never" else math.nan


def by_name(metrics: Mapping[Quantity, Metric]) -> dict[str, Metric]:
    """Metrics under their keys, each with its quantity."""
    return {q.text: msgspec.structs.replace(metric, quantity=q) for q, metric in metrics.items()}


class Series(msgspec.Struct, frozen=True, gc=False):
    """A measured quantity over time.  values: decimal text or the words of :class:`Metric`, one for each time."""

    times: list[str]
    values: list[str]
    quantity: Quantity | None = None


Growth = Literal["bounded", "t^0.5", "t", "t^1.5", "t^2", "exponential", "unresolved"]


class Law(msgspec.Struct, frozen=True, gc=False):
    """A growth law: a fit in |t| to the RMS of a quantity over an ensemble of starts.

    growth: the class.  exponent: of |t| (the rate of e^(rate |t|) if exponential), with its 95 % bootstrap interval
    over starts; null if there are too few data.
    first, last: the fitted span of |t|, which ends before saturation.
    detects: decimal text; the smallest relative fault per step that this ensemble distinguishes from the healthy law.
    lost_at: |t| from which all significant digits are lost, reached or extrapolated; null if no law determines it.
    bend: 95 % interval of the exponent of the later half of the span minus that of the earlier half.
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
    bend: tuple[float, float] | None = None
    quantity: Quantity | None = None


class Subject(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The object of a measurement.

    name: of the claim or the integrator.  branch, form: of a formula.  tolerance, step: of an integrator, "" for its
    default.  high_accuracy: heyoka's.  bias: of a planted fault.  seed: of random starts.
    version: reported by a program; it does not distinguish rows of two reports.
    """

    what: Literal["claimed", "computed", "given"]
    name: str
    branch: str = ""
    form: str = ""
    tolerance: str = ""
    step: str = ""
    high_accuracy: bool = False
    bias: str = ""
    seed: int = 1
    version: str = ""

    @property
    def variant(self) -> str:
        """The options that differ from the defaults, as text in rows of ensembles."""
        parts = {
            "high_accuracy": self.high_accuracy,
            f"tolerance {self.tolerance}": self.tolerance,
            f"I1 off by {self.bias}": self.bias,
            f"seed {self.seed}": self.seed != 1,
        }
        return ", ".join(text for text, shown in parts.items() if shown)

    @property
    def setting(self) -> str:
        """``tolerance=1e-9`` or ``step=1/50``; "" without either."""
        return f"tolerance={self.tolerance}" if self.tolerance else f"step={self.step}" if self.step else ""

    @property
    def asked(self) -> str:
        """The control parameter as text: ``tolerance 1e-9``, ``step 1/50``, or ``finest``."""
        if FINEST in (self.tolerance, self.step):
            return "finest"
        return f"tolerance {self.tolerance}" if self.tolerance else f"step {self.step}" if self.step else ""


class RowKey(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The key of a row, which identifies it in another report.

    precision: always written: msgspec omits a default by object identity, which a transfer from a worker changes.
    direction: of time, if rows differ in it.  horizon: the last time, as text.
    """

    kind: str
    case: str
    system: str
    subject: Subject
    precision: str = msgspec.field(default_factory=lambda: EXACT)
    direction: Direction = ""
    horizon: str = "0"

    def of_version(self, version: str) -> RowKey:
        """The key with this version of the program."""
        if version == self.subject.version:
            return self
        return msgspec.structs.replace(self, subject=msgspec.structs.replace(self.subject, version=version))


class Certified(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The agreement of two sources of a known motion at a time.

    digits: that agree; None if equal.  proven: whether both are proofs at that time, or at both ends of the interval,
    or one is computed.  starts, of_starts: the number of certified starts of an ensemble; None for one motion.
    """

    time: str
    digits: Count | None
    source: str
    proven: Literal["proven", "proven at both ends", "computed"] = "proven"
    starts: Count | None = None
    of_starts: Count | None = None

    @property
    def text(self) -> str:
        """The certificate as text."""
        agreement = "exactly" if self.digits is None else f"to {self.digits} digits"
        if self.starts is None:
            return f"certified at t = {self.time} {agreement} by {self.source} ({self.proven})"
        at_least = f"{agreement} or more by {self.source} ({self.proven})"
        return f"{self.starts} of {self.of_starts} starts certified at t = {self.time} {at_least}"


_LOST = ", and all significant digits are lost from t = "
_FORMER_LOST = ", and no digit is left from t = "


class Against(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The reference that a row was compared with.

    how: proven values, computed ones, equations, or none but its own first integrals.
    radius: decimal text, of the proven balls, or of the agreement of two computed runs.  certificates: that of the
    first start before that of all starts.  reason: of a reference that is missing or not proven.
    until: decimal text; the time from which all significant digits of the format are lost.
    """

    how: Literal["proven", "computed", "equations", "none"]
    method: str = ""
    radius: str = ""
    certificates: tuple[Certified, ...] = ()
    reason: str = ""
    until: str = ""

    @property
    def text(self) -> str:
        """The reference as text."""
        if self.how == "none":
            return f"its own first integrals; {self.reason}"
        if self.how == "equations" or (self.how == "proven" and not self.radius):
            return self.method
        if self.how == "computed":
            agreed = f" agree within {self.radius}" if self.radius else ""
            ends = f"{_LOST}{self.until} on" if self.until else ""
            why = f" ({self.reason})" if self.reason else ""
            return f"computed, not proven: {self.method}{agreed}{ends}{why}"
        return f"known: {self.method}, radius below {self.radius}; {self.certified}"

    @property
    def certified(self) -> str:
        """The text of its certificates."""
        return ", for the first start; ".join(certificate.text for certificate in self.certificates)

    @property
    def brief(self) -> str:
        """The method and its proven error alone, if there are both."""
        proven = self.how == "proven" and self.radius
        return f"{self.method}, error < {self.radius.lower()} (proven)" if proven else self.text


class Data(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The exact data of a motion, as text; omega and gamma are its start, or that from which the random starts of an
    ensemble are drawn, empty in older reports; rotor is k of a top that has one.
    """

    inertia: tuple[str, ...]
    weight: str
    centre: tuple[str, ...]
    omega: tuple[str, ...] = ()
    gamma: tuple[str, ...] = ()
    rotor: tuple[str, ...] = ()


NOISE, NOT_MEASURED = "noise", "not measured"
"""The flag of a row with ``noise = false`` in the plan."""
NOT_CARRIED = {"attitude": "not carried"}
"""The flag of a row whose plan requests the attitude, and whose integrator does not carry it."""


class Worst(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """A motion among the worst of a survey: its case, index in the sweep, outcome, error and digits right (none where
    the run failed), exact data, and the command that measures it alone.
    """

    case: str
    index: Count
    outcome: str
    error: str
    digits_right: float | None
    data: Data
    command: str


class Histogram(msgspec.Struct, frozen=True, gc=False):
    """Counts in bins of equal width in decades; first: log10 of the left edge of the first bin."""

    first: float
    width: float
    counts: tuple[Count, ...]


class CellMap(msgspec.Struct, frozen=True, gc=False):
    """The median of the digits lost in each cell of a plane of two data, rows from below; None in an empty cell.

    x, y: names of columns of the records, with the edges of the cells.
    """

    x: str
    y: str
    x_edges: tuple[float, ...]
    y_edges: tuple[float, ...]
    digits_lost: tuple[tuple[float | None, ...], ...]


class Spread(msgspec.Struct, frozen=True, gc=False):
    """The distributions of the quantities of a survey, by column, and a map over two data."""

    histograms: dict[str, Histogram]
    map: CellMap | None


class Explained(msgspec.Struct, frozen=True, gc=False):
    """A mistake that explains the states of a run.  kind: as in ``diagnosis`` of a score.  text: a sentence."""

    kind: str
    text: str


_DERIVED = "system", "precision", "horizon", "measure", "against"


class Row(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """One measurement, of one motion compared with one reference.

    key: kind, subject and span of the measurement; case and integrator are the names for other programs.
    reference: of the comparison; measured: a description of the measured motion.
    system, precision, horizon, measure and against repeat the key and the reference for other programs.  They are
    filled in if left out; ValueError for another value.
    seconds: timings, compared if they have a band.  evaluations: of the field, if the integrator counts them.
    samples: the number of times of the statistics; 0 if unknown.
    data: of the top and its start, before any rounding; null if no motion is measured.
    request: settings of the plan that no other field has, such as the sweep of a survey.
    amplification: an estimate of the largest factor by which the motion amplifies a change of its state, made at any
    time, up to the horizon; null unless a single motion is integrated.
    explained: a mistake that explains large errors of a third-party integrator, if one is found.
    starts: the number of starts of the row; laws: growth laws by the name of the series.
    worst: of a survey, the worst first; spread: its distributions.  chunk: Parquet bytes of a part of one, in no
    report.
    """

    case: str
    system: str = ""
    integrator: str
    precision: str = ""
    bits: Bits
    outcome: str
    horizon: str = ""
    time_reached: str
    steps: Count
    finite: bool
    metrics: dict[str, Metric]
    key: RowKey
    reference: Against
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
    data: Data | None = None
    request: dict[str, str] | msgspec.UnsetType = msgspec.UNSET
    amplification: Annotated[float, msgspec.Meta(ge=1)] | None = None
    worst: tuple[Worst, ...] | msgspec.UnsetType = msgspec.UNSET
    spread: Spread | msgspec.UnsetType = msgspec.UNSET
    chunk: bytes | msgspec.UnsetType = msgspec.UNSET
    explained: Explained | msgspec.UnsetType = msgspec.UNSET

    def __post_init__(self) -> None:
        key, reference = self.key, self.reference
        against = f"nothing: {reference.reason}" if self.outcome in UNMEASURED else reference.text
        identity = self.system, self.precision, self.horizon, self.measure, self.against
        derived = key.system, key.precision, key.horizon, key.kind, against
        if identity != derived:
            for name, old, new in zip(_DERIVED, identity, derived, strict=True):
                if old.replace(_FORMER_LOST, _LOST) not in ("", new):
                    raise ValueError(f"{name} = {quoted(old)} is not what follows from the key and the reference")
                msgspec.structs.force_setattr(self, name, new)

    @property
    def identity(self) -> Identity:
        """The key of the row without version, and its names."""
        return Identity(self.key.of_version(""), self.case, self.integrator)

    def has_identity_of(self, other: Row) -> bool:
        """Whether both have the same identity, which need not be made."""
        names, others = (self.case, self.integrator), (other.case, other.integrator)
        return names == others and self.key.of_version("") == other.key.of_version("")

    def metric(self, name: str, component: str = "", statistic: str = "") -> Metric | None:
        """The metric of that quantity, or None."""
        return self.metrics.get(Quantity(name, component, statistic).text)


class Identity(NamedTuple):
    """The key of a row without version, and its names for other programs.

    versions: of its program in two compared reports; empty if neither has one.
    """

    key: RowKey
    case: str
    integrator: str
    versions: tuple[str, ...] = ()

    @property
    def named(self) -> dict[str, str]:
        """The entries of JSON documents."""
        key = self.key
        named = {"measure": key.kind, "case": self.case, "system": key.system, "integrator": self.integrator}
        return named | {"precision": key.precision, "horizon": key.horizon}

    @property
    def program(self) -> str:
        """The name of the integrator with its version, or both versions if they differ."""
        return f"{self.key.subject.name} {' → '.join(dict.fromkeys(self.versions))}".rstrip()

    @property
    def elsewhere(self) -> Identity:
        """The identity without horizon."""
        return self._replace(key=msgspec.structs.replace(self.key, horizon=""))


@dataclass(frozen=True, slots=True)
class Peer:
    """heyoka's run of a motion at the same times in the same format: its digits right."""

    integrator: str
    precision: str
    digits_right: float
    steps: Count


class Beside(msgspec.Struct, frozen=True, gc=False):
    """Further findings of `score`: heyoka's run, and remarks on the error, for people only."""

    peer: Peer | None
    remarks: tuple[str, ...]


class Report(msgspec.Struct, frozen=True, omit_defaults=True):
    """A run of a plan: schema, plan (name and content hash), environment, rows in the plan's order.

    beside: of a report by `score`.
    """

    schema: str
    plan: dict[str, str]
    environment: dict[str, Any]
    rows: list[Row]
    beside: Beside | None = None


# Former names of integrators, in plans, options and reports.


INTEGRATORS = {"words": "multiword"}
"""Current names of integrators by their former names."""


def current(name: str) -> str:
    """The current name of an integrator."""
    return INTEGRATORS.get(name, name)


def notice(name: str) -> str:
    """A notice for a former name; empty for any other."""
    return f"the integrator {name} is called {INTEGRATORS[name]} now" if name in INTEGRATORS else ""


def take_former(part: Any) -> set[str]:
    """Replace the former names in ``integrator = "NAME"`` of a plan's document, at any depth; returns them."""
    parts = part if isinstance(part, list) else part.values() if isinstance(part, dict) else ()
    names: set[str] = set().union(*map(take_former, parts))
    integrator = part.get("integrator") if isinstance(part, dict) else None
    if isinstance(integrator, str) and integrator in INTEGRATORS:
        part["integrator"] = current(integrator)
        names.add(integrator)
    return names


def of_plan(plan: dict[str, str]) -> dict[str, str]:
    """The plan block of a report with the current name of its integrator."""
    integrator = plan.get("integrator", "")
    return plan | {"integrator": current(integrator)} if integrator in INTEGRATORS else plan


def of_identity(identity: dict[str, str]) -> dict[str, str]:
    """The identity of a run, which must match on resume, with the current name of its integrator."""
    return {key: current(value) if key == "plan integrator" else value for key, value in identity.items()}


def of_row(row: Row) -> Row:
    """The row with the current names of its integrator and arithmetic."""
    if row.flags.get("arithmetic") == "whole numbers":
        row = msgspec.structs.replace(row, flags=row.flags | {"arithmetic": "integers"})
    subject = row.key.subject
    if subject.name not in INTEGRATORS or subject.what != "computed":
        return row
    old, new = subject.name, INTEGRATORS[subject.name]
    first, *rest = row.integrator.split(" ")
    computed = f"computed: {old} in "
    measured = row.measured.removeprefix(computed)
    return msgspec.structs.replace(
        row,
        integrator=" ".join([new if first == old else first, *rest]),
        key=msgspec.structs.replace(row.key, subject=msgspec.structs.replace(subject, name=new)),
        measured=row.measured if measured == row.measured else f"computed: {new} in {measured}",
    )
