"""The printed and the stable formulas (4.2)-(4.6) evaluated in a format, against their exact evaluation."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

from msgspec.structs import replace

from heavytop.exact.flint.balls import working_precision
from heavytop.features.claims import claim_error as errors_of
from heavytop.features.claims.kinds.claim_model import CLAIM, EVALUATION_ERROR, claim_error, claim_of, claimed
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive, signed
from heavytop.harness.rows import Find, PlanTable, Task, exact_row, time_metric
from heavytop.kind import Kind
from heavytop.measure.scalar import largest, metric, of_fraction, text
from heavytop.precision import parse, time_text
from heavytop.records import Against, Beside, Direction, Metric, Quantity, Row, RowKey, Series, Subject, by_name
from heavytop.report.document.document import Block, Cell, Chart, Headline, Value, short
from heavytop.report.document.document import Table as Cells
from heavytop.report.render.text import both, largest_over
from heavytop.report.store.checks import CLOSE, peak
from heavytop.top.equations import GYROSTAT

NAME = "claim_evaluation"
_COUNT = "claim_evaluation"
_WORST, _LOST, _SINCE = "max_finite", "samples_not_finite", "not_finite_from"
_SECONDS = 0.02
_SYMBOLS = {"omega": "Ω", "theta": "θ", "psi": "ψ"}


class ClaimEvaluationTable(PlanTable, tag=NAME):
    """rate_times: the values of k |t| at which the formulas are evaluated."""

    cases: list[str]
    precisions: list[str]
    rate_times: list[str]
    directions: tuple[Direction, ...] = ("forward", "backward")

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row."""
        times = positive(self.rate_times, "rate_times")
        tasks = []
        for case in claimed(find, self.cases):
            for precision in map(parse, self.precisions):
                for direction in self.directions:
                    signs = signed(times, direction)
                    end = time_text(signs[-1] / claim_of(case).solves.rate)
                    for form in ("printed", "stable"):
                        subject = Subject("claimed", "(4.2)-(4.6)", form=form)
                        key = RowKey(NAME, case.name, GYROSTAT.name, subject, precision.name, direction, end)
                        tasks.append(Task(key, f"/{direction}", f"formula:{form}", case, signs, signs))
        return tasks


class ClaimEvaluation(Kind):
    """The largest errors of a form in a format, and the time from which on its values are not finite.

    The times of a task are values of k t of one sign.  Errors of Ω in 1/time unit, of the angles in rad.
    """

    name = NAME
    table = ClaimEvaluationTable
    needed = tuple(
        quantity.text
        for what in _SYMBOLS
        for quantity in (Quantity(EVALUATION_ERROR, what, _WORST), Quantity(_COUNT, what, _SINCE))
    )
    may_overflow = True
    place = 90

    def cost(self, task: Task) -> float:
        """Seconds, equal for all rows."""
        return _SECONDS

    def measure(self, task: Task, saved: Saved) -> Row:
        """The row of one form.  Raises OutOfReach where the formulas cannot be evaluated exactly."""
        claim, precision, form = claim_of(task.given), task.precision, task.key.subject.form
        times = [time / claim.solves.rate for time in task.times]
        errors = [errors_of.evaluation_error(claim, time, precision, form) for time in times]
        metrics: dict[Quantity, Metric] = {}
        series: dict[str, Series] = {}
        with working_precision(precision.bits + 64):
            for name in errors_of.EvaluationError._fields:
                values = [getattr(error, name) for error in errors]
                finite = [value for value in values if value.is_finite()]
                worst = metric(largest(finite)) if finite else Metric("missing", None)
                metrics[Quantity(EVALUATION_ERROR, name, _WORST)] = worst
                lost = Fraction(len(values) - len(finite))
                metrics[Quantity(_COUNT, name, _LOST)] = of_fraction(lost, "value", str(lost))
                failure = errors_of.first_failure(times, values)
                metrics[Quantity(_COUNT, name, _SINCE)] = time_metric(failure, "duration")
                quantity = Quantity(EVALUATION_ERROR, name)
                texts = [text(value) for value in values]
                series[quantity.text] = Series([time_text(time) for time in task.times], texts, quantity)
        measured = f"{CLAIM}, {form} form, evaluated in {precision.name}; times of the series are k t"
        against = Against("proven", "the same form exactly evaluated from the same rounded data")
        row = exact_row(task, measured, against, by_name(metrics), precision.bits, series)
        is_finite = all(m.value == "0" for quantity, m in metrics.items() if quantity.statistic == _LOST)
        return replace(row, finite=is_finite)

    def contradictions(self, row: Row) -> Iterator[str]:
        """Counts, times and largest errors other than those of the series, which holds every sample."""
        for series in row.series.values():
            component = series.quantity.component if series.quantity else ""
            count, since = row.metric(_COUNT, component, _LOST), row.metric(_COUNT, component, _SINCE)
            worst = row.metric(EVALUATION_ERROR, component, _WORST)
            lost = sum(value == "nan" for value in series.values)
            if count is not None and count.value != str(lost):
                yield f"{Quantity(_COUNT, component, _LOST).text}: {count.value}, where the series has {lost}"
            if since is not None and series.values and (since.value == "never") == (series.values[-1] == "nan"):
                yield f"{Quantity(_COUNT, component, _SINCE).text}: {since.value}, where the series says otherwise"
            largest = None if worst is None or worst.log10 is None else peak(series)
            if worst is not None and largest is not None and abs(largest - (worst.log10 or 0.0)) > CLOSE:
                yield f"{Quantity(EVALUATION_ERROR, component, _WORST).text}: not the largest of its series"

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The errors of each form in the narrowest format, the time up to which it is finite; a line for each row."""
        bits = min(row.bits for row in rows)
        forms: dict[str, list[Row]] = {}
        for row in rows:
            if row.bits == bits and row.metrics:
                forms.setdefault(row.key.subject.form, []).append(row)
        sentences = "; ".join(f"the {form} form {_summary(members)}" for form, members in sorted(forms.items()))
        if sentences:
            yield Headline(f"In {next(iter(forms.values()))[0].precision} {sentences}.")
        yield Cells(
            "Formulas in floating point, printed and stable form, each compared with its exact evaluation",
            ["case", "format", "form", "Ω error", "θ error", "ψ error", "ψ NaN/inf from |t|", "Ω NaN/inf from |t|"],
            both((row, _cells(row)) for row in rows),
            [f"Errors are the {largest_over(rows)}."],
        )
        yield Chart(claim_error, of_all=True)


def _cells(row: Row) -> list[Cell]:
    errors = (row.metric(EVALUATION_ERROR, quantity, _WORST) for quantity in _SYMBOLS)
    times = (row.metric(_COUNT, quantity, _SINCE) for quantity in ("psi", "omega"))
    return [row.precision, row.key.subject.form, *map(Value, errors), *map(Value, times)]


def _summary(rows: Sequence[Row]) -> str:
    """``is off by up to 6.7e-8 in Ω (ershkov-partial-6/forward), ψ not finite from |t| = 7.4``."""

    def known(name: str, component: str, statistic: str) -> list[tuple[float, str, str, str]]:
        pairs = ((row.metrics[Quantity(name, component, statistic).text], row.case) for row in rows)
        return [(m.log10, m.value, component, case) for m, case in pairs if m.log10 is not None]

    worst = max(known(EVALUATION_ERROR, "omega", _WORST), default=None)
    since = min([time for name in _SYMBOLS for time in known(_COUNT, name, _SINCE)], default=None)
    off = "has no finite error of Ω" if worst is None else f"is off by up to {short(worst[1])} in Ω ({worst[3]})"
    if since is None:
        return f"{off}, finite throughout"
    finite = min(known(_COUNT, "omega", _SINCE), default=None)
    if finite is not None and worst is not None:
        off += f" while Ω is finite, before |t| = {short(finite[1])}"
    return f"{off}, {_SYMBOLS[since[2]]} not finite from |t| = {short(since[1])}"
