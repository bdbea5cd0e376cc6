"""Errors of integrators on a homoclinic motion, against its closed form, and the times of their escape."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from functools import lru_cache

from msgspec.structs import replace

from heavytop.cases import Case
from heavytop.errors import OutOfReach
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.features.homoclinic.break_away_law import ESCAPE, break_away_law, escape_times
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import samples, signed
from heavytop.harness.rows import Find, PlanTable, Task, computed, computed_row, time_metric
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.kind import Kind
from heavytop.measure.rounding_noise import Reruns, banded, escape_band
from heavytop.measure.scalar import GUARD_BITS
from heavytop.measure.scorer import DRIFT, INTEGRATION_ERROR, SOLUTION_ERROR, Scorer
from heavytop.measure.truth import Truth, certified, states_of
from heavytop.precision import DOUBLE, exact, parse, time_text
from heavytop.records import HEYOKA, Against, Beside, Direction, Metric, Quantity, Row, RowKey, by_name
from heavytop.report.compare.verdicts import size
from heavytop.report.document.document import Block, Cell, Chart, Headline, In, Note, Value, cell_text, clip, short
from heavytop.report.document.document import Table as Cells
from heavytop.report.render.page import in_columns
from heavytop.report.render.text import NOISE_BAND, both, drifts

NAME = "homoclinic"
ESCAPED = Fraction(1, 1000)
"""A computed homoclinic motion has escaped when the error of Ω reaches this, in units of α."""
WINDOW = 10
"""Errors are measured while rate·|t| is below this; later the saddle amplifies rounding."""
_EARLIER, _WORSE = 0.05, 2.0
"""Decades by which an escape is earlier, and an error worse."""
_CERTIFIED_AT = 4
"""The closed form of a homoclinic case is certified at this |t|."""


class HomoclinicTable(PlanTable, tag=NAME):
    """samples: number of samples per unit of 1/rate.  integrator: any that `heavytop list` shows."""

    cases: list[str]
    precisions: list[str]
    samples: int = 8
    directions: tuple[Direction, ...] = ("forward", "backward")
    integrator: str = HEYOKA

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row."""
        tasks = []
        for case in map(find, self.cases):
            spacing = Fraction(round(64 / (samples(self.samples) * case.rate)) or 1, 64)
            for precision in map(parse, self.precisions):
                end = _end(case, precision.bits)
                times = [spacing * i for i in range(1, int(end / spacing) + 1)]
                keep = times[self.samples - 1 :: self.samples]
                for direction in self.directions:
                    signs = signed(times, direction)
                    subject = computed(self.integrator)
                    name, horizon = precision.name, time_text(signs[-1])
                    key = RowKey(NAME, case.name, case.system.name, subject, name, direction, horizon)
                    tasks.append(Task(key, f"/{direction}", self.integrator, case, signs, signed(keep, direction)))
        return tasks


class Homoclinic(Kind):
    """The escape time of a run from a homoclinic motion, and its error and drift before.

    Errors of Ω in 1/time unit, of γ none.
    """

    name = NAME
    table = HomoclinicTable
    needed = (ESCAPE.text,)
    noise_factor = 8.0
    largest_amplification = 10 * math.exp(WINDOW)
    concludes = True
    place = 60

    def carries_band(self, metric: Metric) -> bool:
        """True for every error, and for the escape time."""
        return super().carries_band(metric) or metric.quantity == ESCAPE

    def noise_is_reruns(self, metric: Metric) -> bool:
        """True: every band is that of reruns."""
        return True

    def series_has_more(self, quantity: Quantity | None) -> bool:
        """True for errors: near a saddle they are measured early, and the series continues."""
        return quantity is None or quantity.name != DRIFT

    def conclude(self, rows: Sequence[Row]) -> list[Row]:
        """The growth of the escape time with the bits."""
        return break_away_law(rows)

    def measure(self, task: Task, saved: Saved) -> Row:
        """The row of a case whose data are exact in the format; the times are uniform.

        Raises OutOfReach where the closed form is not certified for the format.
        """
        case, precision = task.given, task.precision
        closed = case.homoclinic
        assert closed is not None
        problem = Problem.of(case.top, case.start, precision, case.system)
        parameters = case.system.parameters(case.top, case.start)
        exactly = parameters.mapped(Fraction)
        if (problem.parameters, problem.start) != (exactly, case.start):
            raise ValueError(f"{case.name} is not exact in {precision.name}: its data must be dyadic")
        early = Fraction(_CERTIFIED_AT if task.times[-1] > 0 else -_CERTIFIED_AT)
        known = certified(closed, early, precision.bits + GUARD_BITS)
        if known is None:
            raise OutOfReach(f"{closed.method} is not certified for {precision.name}.", "Use a format with fewer bits.")
        truth = known.truth
        scorer = _scorer(case, problem, truth, task.keep)
        run = task.integrator.propagate(case.top, case.start, task.times, precision, case.system, scorer)
        error = scorer.error
        assert error is not None
        metrics = by_name({ESCAPE: time_metric(error.escape, "duration")}) | error.metrics() | scorer.drift.metrics()
        metrics = _with_bands(task, run, metrics)
        series = error.series(time_text) | scorer.drift.series(time_text)
        return computed_row(task, run, metrics, series, known.against)

    def contradictions(self, row: Row) -> Iterator[str]:
        """An escape time beyond the horizon."""
        escape = row.metrics.get(ESCAPE.text)
        if escape is not None and escape.log10 is not None and abs(exact(escape.number)) > abs(exact(row.horizon)):
            yield f"{ESCAPE.text}: {escape.value} is beyond the horizon {row.horizon}"

    def line(self, row: Row) -> str:
        """The error of Ω before the escape, and the escape time."""
        (name, error), *_ = _errors(row).items()
        escape = Value(row.metrics.get(ESCAPE.text))
        return f"{name} {cell_text(Value(error))} while rate·|t| <= {WINDOW}; escape at |t| = {cell_text(escape)}"

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The range of escape times; the earlier escape of both directions; losses that it hides; a line per row."""
        known = [row for row in rows if row.outcome == Outcome.SUCCESS.value and ESCAPE.text in row.metrics]
        if known:
            yield _headline(known)
        earlier: dict[tuple[str, str, str], Row] = {}
        for row in (row for row in rows if ESCAPE.text in row.metrics):
            motion = row.key.case, row.key.subject.name, row.precision
            earlier[motion] = min(earlier.get(motion, row), row, key=_log_escape)
        shown = list(earlier.values())
        title = "Escape from a homoclinic motion at |t|"
        yield from in_columns(title, lambda row: short(row.metrics[ESCAPE.text].value), shown)
        yield from (Note(sentence, shown=In.SHORT) for sentence in _hidden(shown))
        yield Cells(
            "Integrators on a homoclinic motion, compared with its closed form",
            ["case", "format", "Ω error", "γ error", "drift", "escape |t|", "outcome"],
            both((row, _cells(row)) for row in rows),
            [
                "Errors of Ω and γ: the largest over the samples with rate·|t| <= 10. Drift: the largest of any first "
                "integral over all samples. Escape: when Ω is first off by 1e-3 α, where α is the angular velocity of "
                "the rotation that the motion tends to, or else the largest |Ωi| at the start.",
                NOISE_BAND,
            ],
        )
        yield Chart(escape_times)


def _headline(known: Sequence[Row]) -> Headline:
    """The escape times of the narrowest and the widest format, of third-party integrators where there are any."""
    third_party = [row for row in known if row.key.subject.name != HEYOKA]
    shown = third_party or known
    name, cases = shown[0].key.subject.name, dict.fromkeys(row.key.case for row in shown)
    motion = "a homoclinic motion" if len(cases) > 1 else clip(next(iter(cases)), 40)
    sentence = f"{clip(name, 40)} stays on {motion} up to |t| = {_escapes(row for row in known if _by(row, name))}"
    ours = [row for row in known if third_party and _by(row, HEYOKA) and row.key.case in cases]
    return Headline(f"{sentence}{f'; {HEYOKA} to {_escapes(ours)}' if ours else ''}.")


def _cells(row: Row) -> list[Cell]:
    error, *others = _errors(row).values()
    escape = Value(row.metrics.get(ESCAPE.text), noise=True)
    return [row.precision, Value(error, noise=True), *map(Value, others), escape, row.outcome]


def _errors(row: Row) -> dict[str, Metric | None]:
    """The errors of Ω and γ and the largest drift of a first integral, by their names in sentences."""
    names = (name for name in (INTEGRATION_ERROR, SOLUTION_ERROR) if row.metric(name, "omega", "max"))
    name = next(names, SOLUTION_ERROR)
    drift = max((metric for _, metric in drifts(row)), key=size, default=None)
    errors = {f"error of {symbol}": row.metric(name, part, "max") for part, symbol in (("omega", "Ω"), ("gamma", "γ"))}
    return errors | {"drift": drift}


def _hidden(rows: Iterable[Row]) -> Iterator[str]:
    """Losses that an escape time does not show: errors worse than heyoka's of a run that escapes as late."""
    ours = {(row.key.case, row.precision): row for row in rows if _by(row, HEYOKA)}
    for row in rows:
        reference = ours.get((row.key.case, row.precision), row)
        if _log_escape(row) < _log_escape(reference) - _EARLIER:
            continue
        pairs = zip(_errors(row).items(), _errors(reference).values(), strict=True)
        worse = [(size(error) - size(known), name, error, known) for (name, error), known in pairs if error and known]
        lost, name, error, known = max(worse, key=lambda entry: entry[0], default=(0.0, "", None, None))
        if lost > _WORSE:
            yield f"{row.key.case}: the {name} of {row.key.subject.name} is {Value(error)}, heyoka's {Value(known)}."


def _log_escape(row: Row) -> float:
    return math.log10(_escape(row))


def _escape(row: Row) -> Fraction:
    """|t| of the escape, or of the horizon without one."""
    time = row.metrics[ESCAPE.text]
    return abs(exact(row.horizon if time.log10 is None else time.value))


def _by(row: Row, name: str) -> bool:
    return row.key.subject.name == name


def _escapes(rows: Iterable[Row]) -> str:
    """``12 to 63 in double, 62 to 321 in real:237``: escape times of the narrowest and the widest format."""
    formats: dict[tuple[int, str], list[Fraction]] = {}
    for row in rows:
        formats.setdefault((row.bits, row.precision), []).append(_escape(row))
    sentences = []
    for _, name in dict.fromkeys((min(formats), max(formats))):
        low, high = (f"{float(pick(formats[_, name])):.3g}" for pick in (min, max))
        sentences.append(f"{low if low == high else f'{low} to {high}'} in {name}")
    return ", ".join(sentences)


def _end(case: Case, bits: int) -> float:
    """|t| at which a run with so many bits has certainly escaped."""
    return (1.1 * bits * math.log(2) + 4) / case.rate


def _scorer(case: Case, problem: Problem, truth: Truth, keep: Sequence[Fraction] = ()) -> Scorer:
    name = INTEGRATION_ERROR if isinstance(case.homoclinic, ErshkovPartial) else SOLUTION_ERROR
    until = WINDOW / case.rate
    return Scorer(problem, truth, keep, threshold=ESCAPED * case.alpha, until=until, name=name)


def _with_bands(task: Task, run: Trajectory, metrics: dict[str, Metric]) -> dict[str, Metric]:
    """``metrics`` of a row with their bands; that of the escape time comes from the escapes of the reruns."""
    case = task.case
    assert case is not None
    reruns = Reruns(Problem.of(case.top, case.start, DOUBLE, case.system), task.integrator, task.seed)
    if run.outcome is not Outcome.SUCCESS or not reruns.possible:
        return metrics
    times = tuple(time for time in task.times[3::4] if float(abs(time)) <= _end(case, DOUBLE.bits))
    # runs of another package's integrator may differ from call to call
    rerun = _reruns if reruns.integrator.ensemble else _reruns.__wrapped__
    measured, escaped = rerun(case, reruns, times)
    metrics = banded(run, metrics, measured)
    escapes = [abs(time) for time in escaped if time is not None]
    escape = metrics[ESCAPE.text]
    if escape.log10 is not None and len(escapes) == len(escaped):
        band = escape_band(exact(escape.value), escapes, case.rate, task.precision.bits)
        metrics = metrics | {ESCAPE.text: replace(escape, band=band)}
    return metrics


@lru_cache(maxsize=16)
def _reruns(
    case: Case, reruns: Reruns, times: tuple[Fraction, ...]
) -> tuple[list[dict[str, Metric]], list[Fraction | None]]:
    """Metrics and escape times of the reruns, shared by all formats that the case is measured in."""
    assert case.homoclinic is not None
    truth = Truth(Against("proven", case.homoclinic.method), states_of(case.homoclinic))
    scorers = reruns.of(times, lambda problem: _scorer(case, problem, truth))
    return [scorer.metrics() for scorer in scorers], [
        scorer.error.escape for scorer in scorers if scorer.error is not None
    ]
