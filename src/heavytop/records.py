"""Plain records with a schema: what the suite writes and the report reads.

Numbers that measure something are decimal text with their log10 beside them, so that 1e-997 survives.
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
"""Outcomes of a row that was aborted: it has no metrics, and says why in the place of a reference.

failed: a third-party integrator raised an error, or returned no trajectory.  unsupported: it declares that it
cannot do what was asked: not a failure.  out_of_time: it was stopped at the time limit of its row.
not_asked: it had run out of time in two other rows of that run."""

HEYOKA, MULTIWORD = "heyoka", "multiword"
FINEST = "eps"
"""In the place of a tolerance: the finest that an integrator offers."""
EXACT = "exact"
"""The precision of a row in which no format is involved."""
Direction = Literal["", "forward", "backward"]
Bits = Annotated[int, msgspec.Meta(ge=0, le=100_000)]
Starts = Annotated[int, msgspec.Meta(ge=1)]
Count = Annotated[int, msgspec.Meta(ge=0)]
Seconds = Annotated[float, msgspec.Meta(ge=0)]
UNRESOLVED_SECONDS = "unresolved"
"""Part of the seconds of a row: how many are resolved at least, where its own are fewer."""
MetricKind = Literal["error", "duration", "value"]
"""How two values of a metric compare: a smaller error is better, a longer duration is better, a value must agree."""


class Quantity(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The subject of a number: ``drift`` of the ``energy``, its ``max`` over the samples.

    component: of a vector, or a first integral.  statistic: over the samples; of an equation its branch and domain are
    the quantity's too.
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

    quantity: what it is; its text is the metric's key in the report.
    value: decimal text; or a word: "nan", "missing", "never", "unresolved" (smaller than ten radii
    of the reference, see ``bound``).
    log10: its decimal logarithm; null for 0 and for the words.
    band: half-width in decades of the 95 % interval in which rounding noise alone moves the value, where measured.
    """

    value: str
    log10: float | None
    kind: MetricKind = "error"
    bound: str | None = None
    band: Annotated[float, msgspec.Meta(ge=0, le=100)] | None = None
    quantity: Quantity | None = None

    def __float__(self) -> float:
        """The nearest double, 0 where that is too small; the bound of what is unresolved, nan for the other words."""
        return float(self.number)

    @property
    def number(self) -> Fraction | float:
        """Its value exactly, of what is unresolved the bound; ``never`` is infinite, the other words are nan."""
        return _parsed(self.value if self.bound is None else self.bound)

    @property
    def size(self) -> float | None:
        """log10 of its absolute value, of what is unresolved that of the bound; None for 0 and for the other words."""
        if self.bound is None:
            return self.log10
        return log10_of(self.number) if isinstance(self.number, Fraction) else None

    def __eq__(self, other: object) -> bool:
        """Whether all fields are the same, or of a plain number whether it is that number."""
        if isinstance(other, Metric):
            return super().__eq__(other)
        return isinstance(other, int | float | Fraction) and self.number == other

    def __hash__(self) -> int:
        return hash(self.number)

    @property
    def _rank(self) -> tuple[bool, Fraction | float, bytes]:
        """The key of their order: the number, nan last; among equal ones the fields, as equality is by all."""
        number = self.number
        unknown = number != number
        return unknown, 0 if unknown else number, msgspec.json.encode(self)

    def _is(self, less: Callable[[Any, Any], bool], other: SupportsFloat) -> bool:
        return less(self._rank, other._rank) if isinstance(other, Metric) else less(self.number, float(other))

    def __lt__(self, other: SupportsFloat) -> bool:
        """By the numbers, exactly: 1e-997 is less than 1e-996.  Of two metrics just one is less, or they are equal."""
        return self._is(lt, other)

    def __le__(self, other: SupportsFloat) -> bool:
        return self._is(le, other)

    def __gt__(self, other: SupportsFloat) -> bool:
        return self._is(gt, other)

    def __ge__(self, other: SupportsFloat) -> bool:
        return self._is(ge, other)


@lru_cache(1 << 14)
def _parsed(text: str) -> Fraction | float:
    """The number of a text, which is read once however often it is compared."""
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
    """How a quantity grows with |t|: a fit to its RMS over an ensemble of starts.

    growth: the class; exponent of |t| (or rate of e^(rate |t|) where exponential) with its 95 % bootstrap interval over
    starts, null where there is too little to fit.
    first, last: the span of |t| that was fitted, which ends before saturation.
    detects: decimal text; the smallest relative fault a step that this ensemble would have distinguished from the
    healthy law. lost_at: |t| from which the format holds no digit, reached or extrapolated; null where no law says so.
    bend: 95 % interval of how much larger the exponent of the later half of the span is than that of the earlier half.
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

    name: of the claim or the integrator.  branch, form: of a formula.  tolerance, step: asked of an integrator, "" for
    what it does by itself.  high_accuracy: heyoka's.  bias: of a planted fault.  seed: of random starts.
    version: of a program, as it says it; rows of two versions are one row in two reports.
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
        """The words that set it apart from a plain one, as rows of ensembles name it."""
        parts = {
            "high_accuracy": self.high_accuracy,
            f"tolerance {self.tolerance}": self.tolerance,
            f"I1 off by {self.bias}": self.bias,
            f"seed {self.seed}": self.seed != 1,
        }
        return ", ".join(text for text, said in parts.items() if said)

    @property
    def setting(self) -> str:
        """``tolerance=1e-9`` or ``step=1/50``; "" where neither is asked for."""
        return f"tolerance={self.tolerance}" if self.tolerance else f"step={self.step}" if self.step else ""

    @property
    def asked(self) -> str:
        """The control in words: ``tolerance 1e-9``, ``step 1/50``, or ``finest``."""
        if FINEST in (self.tolerance, self.step):
            return "finest"
        return f"tolerance {self.tolerance}" if self.tolerance else f"step {self.step}" if self.step else ""


class RowKey(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The identity of a row, by which it is found in another report.

    precision: written always: a default is left out where it is the same object, and not where a worker sent it.
    direction: of time, where rows differ in it.  horizon: the last time, as text.
    """

    kind: str
    case: str
    system: str
    subject: Subject
    precision: str = msgspec.field(default_factory=lambda: EXACT)
    direction: Direction = ""
    horizon: str = "0"

    def of_version(self, version: str) -> RowKey:
        """The key of what that version of its program computes."""
        if version == self.subject.version:
            return self
        return msgspec.structs.replace(self, subject=msgspec.structs.replace(self.subject, version=version))


class Certified(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """That two sources of a known motion agree at a time.

    digits: to which they do; None for exactly.  proven: whether both are proofs at that time, at both ends of the way
    there, or one is computed.  starts, of_starts: how many starts of an ensemble are certified so; None for one motion.
    """

    time: str
    digits: Count | None
    source: str
    proven: Literal["proven", "proven at both ends", "computed"] = "proven"
    starts: Count | None = None
    of_starts: Count | None = None

    @property
    def text(self) -> str:
        """In words."""
        agreement = "exactly" if self.digits is None else f"to {self.digits} digits"
        if self.starts is None:
            return f"certified at t = {self.time} {agreement} by {self.source} ({self.proven})"
        at_least = f"{agreement} or more by {self.source} ({self.proven})"
        return f"{self.starts} of {self.of_starts} starts certified at t = {self.time} {at_least}"


_LOST = ", and all significant digits are lost from t = "
_FORMER_LOST = ", and no digit is left from t = "


class Against(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The reference that a row was compared with.

    how: with proven values, with computed ones, with equations, or with none but its own first integrals.
    radius: decimal text, of the proven balls, or within which two computed runs agree.  certificates: the first start's
    before that of all starts.  reason: why it is missing, or none that is proven.
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
        """In a sentence."""
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
        """Text of its certificates: at which time a second source agrees, and to how many digits."""
        return ", for the first start; ".join(certificate.text for certificate in self.certificates)

    @property
    def brief(self) -> str:
        """The method and its proven error alone, where there are both."""
        proven = self.how == "proven" and self.radius
        return f"{self.method}, error < {self.radius.lower()} (proven)" if proven else self.text


class Data(msgspec.Struct, frozen=True, gc=False, omit_defaults=True):
    """The exact data of a motion, as text; omega and gamma are its start, or for an ensemble that by which its random
    starts are drawn, empty in older reports; rotor is k of a top that has one.
    """

    inertia: tuple[str, ...]
    weight: str
    centre: tuple[str, ...]
    omega: tuple[str, ...] = ()
    gamma: tuple[str, ...] = ()
    rotor: tuple[str, ...] = ()


NOISE, NOT_MEASURED = "noise", "not measured"
"""The flag of a row whose plan says ``noise = false``."""
NOT_CARRIED = {"attitude": "not carried"}
"""The flag of a row whose plan asks for the attitude, and whose integrator does not carry it."""


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
    """How many values lie in bins of equal width in decades; first: log10 of the left edge of the first."""

    first: float
    width: float
    counts: tuple[Count, ...]


class CellMap(msgspec.Struct, frozen=True, gc=False):
    """The median of the digits lost in each cell of two data, rows from below; None in a cell without a motion.

    x, y: names of columns of the records; their edges are one more than the cells.
    """

    x: str
    y: str
    x_edges: tuple[float, ...]
    y_edges: tuple[float, ...]
    digits_lost: tuple[tuple[float | None, ...], ...]


class Spread(msgspec.Struct, frozen=True, gc=False):
    """How the quantities of a survey's motions are distributed, by the names of their columns, and over which data."""

    histograms: dict[str, Histogram]
    map: CellMap | None


class Explained(msgspec.Struct, frozen=True, gc=False):
    """A mistake that explains the states of a run: kind, one of those of ``diagnosis`` of a score; text: a sentence."""

    kind: str
    text: str


_DERIVED = "system", "precision", "horizon", "measure", "against"


class Row(msgspec.Struct, frozen=True, gc=False, kw_only=True):
    """One measurement, of one motion compared with one reference.

    key: what is measured, of what, how, over which time; case and integrator are what it is called for other programs.
    reference: what it was compared with; measured says in words what was.
    system, precision, horizon, measure and against are what other programs read of the key and the reference.  They
    follow from these, and stand in a row where none gives them; ValueError where one is given and is another.
    outcome, time_reached, steps, finite travel with every number.  seconds: timings, compared where they have a band.
    evaluations: of the field, where the integrator counts them.
    samples: how many times the largest values are over; 0 where that is not said.
    data: of the top and its start, before any rounding; null where no motion is measured.
    request: what the table of the plan asks that no other field says, such as the sweep of a survey.
    amplification: the largest factor by which the motion itself has amplified a change of its state, whenever that was
    made, up to the horizon, an estimate; null where no single motion is integrated.
    explained: what explains the states of a third-party integrator that are far off, where something does.
    starts: how many starts stand behind the row; laws: how its series grow, by the name of the series.
    worst: of a survey, first the worst; spread: its distributions.  chunk: Parquet bytes of a part of one; no report
    holds it.
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
        """The identity of the row in another report, and what it is called there."""
        return Identity(self.key.of_version(""), self.case, self.integrator)

    def metric(self, name: str, component: str = "", statistic: str = "") -> Metric | None:
        """The metric of that quantity, if it is there."""
        return self.metrics.get(Quantity(name, component, statistic).text)


class Identity(NamedTuple):
    """A row's key without a version, and the names under which other programs know it.

    versions: of its program in two reports that are compared; empty where neither says one.
    """

    key: RowKey
    case: str
    integrator: str
    versions: tuple[str, ...] = ()

    @property
    def named(self) -> dict[str, str]:
        """Its part of JSON documents."""
        key = self.key
        named = {"measure": key.kind, "case": self.case, "system": key.system, "integrator": self.integrator}
        return named | {"precision": key.precision, "horizon": key.horizon}

    @property
    def program(self) -> str:
        """The integrator by name, with its version, or both where they differ."""
        return f"{self.key.subject.name} {' → '.join(dict.fromkeys(self.versions))}".rstrip()

    @property
    def elsewhere(self) -> Identity:
        """The key without its horizon."""
        return self._replace(key=msgspec.structs.replace(self.key, horizon=""))


@dataclass(frozen=True, slots=True)
class Peer:
    """heyoka's run of a motion at the same times in the same format: its digits right."""

    integrator: str
    precision: str
    digits_right: float
    steps: Count


class Beside(msgspec.Struct, frozen=True, gc=False):
    """Findings of `score` beside its row: heyoka's own run, and sentences on the error that nothing reads."""

    peer: Peer | None
    remarks: tuple[str, ...]


class Report(msgspec.Struct, frozen=True, omit_defaults=True):
    """A run of a plan: schema, plan (name and content hash), environment, rows in the plan's order.

    beside: of a report that `score` wrote.
    """

    schema: str
    plan: dict[str, str]
    environment: dict[str, Any]
    rows: list[Row]
    beside: Beside | None = None


# Names that integrators had before, read as those that they have: in plans, options and reports of then.


INTEGRATORS = {"words": "multiword"}
"""Former names of integrators, and those of now."""


def current(name: str) -> str:
    """The name that an integrator has now, of the one that it was given."""
    return INTEGRATORS.get(name, name)


def notice(name: str) -> str:
    """A sentence for whoever gives a name of before; empty for any other."""
    return f"the integrator {name} is called {INTEGRATORS[name]} now" if name in INTEGRATORS else ""


def in_document(part: Any) -> set[str]:
    """The former names that an ``integrator = "NAME"`` of a plan's document gives, however deep."""
    if isinstance(part, list):
        return set().union(*map(in_document, part))
    if not isinstance(part, dict):
        return set()
    integrator = part.get("integrator")
    own = {integrator} if isinstance(integrator, str) and integrator in INTEGRATORS else set()
    return own.union(*(in_document(item) for item in part.values()))


def of_document(part: Any) -> Any:
    """A plan's document with the names of now."""
    if isinstance(part, list):
        return [of_document(item) for item in part]
    if not isinstance(part, dict):
        return part
    plain = {name: of_document(item) for name, item in part.items()}
    if isinstance(integrator := part.get("integrator"), str):
        plain["integrator"] = current(integrator)
    return plain


def of_plan(plan: dict[str, str]) -> dict[str, str]:
    """The plan block of a report with the name of now of the integrator that was measured beside heyoka."""
    integrator = plan.get("integrator", "")
    return plan | {"integrator": current(integrator)} if integrator in INTEGRATORS else plan


def of_identity(identity: dict[str, str]) -> dict[str, str]:
    """The request that must be the same for a run to go on, with that name of now."""
    return {key: current(value) if key == "plan integrator" else value for key, value in identity.items()}


def of_row(row: Row) -> Row:
    """The row with the names of now of its integrator and its arithmetic; itself where it has these already."""
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
