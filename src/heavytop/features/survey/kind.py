"""Many motions of a sweep: each a row of survey.parquet, all together a row of the report."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import chain
from pathlib import Path

import msgspec
import numpy

from heavytop.cases import Case
from heavytop.display import Lazy
from heavytop.errors import InputError, quoted, refusal
from heavytop.features.survey.charts import survey_charts
from heavytop.features.survey.gathered import DATA, FILE, SAME, chunk_bytes, gathered, of_motions, write
from heavytop.features.survey.joined import METRIC, worse_motions
from heavytop.features.survey.measured import Chunk, Drawn, chunks, drawn, measured, number_of
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive, uniform
from heavytop.harness.rows import Find, PlanTable, Task, computed, exact_row
from heavytop.harness.sweeps import Sweep
from heavytop.integrate.trajectory import Outcome
from heavytop.kind import Kind
from heavytop.precision import DOUBLE, EXTENDED, exact, parse, rounded
from heavytop.records import HEYOKA, Against, Beside, Metric, Row, Spread
from heavytop.report.document.document import Block, Card, Chart, Headline, In, Note, short
from heavytop.report.document.motions import LossLimits, WorseMotions
from heavytop.report.store.checks import impossible

NAME = "survey"
_SWEEP = "sweep:"
_METHOD = "two runs of multiword in double-double, of different orders"


class SurveyTable(PlanTable, tag=NAME):
    """cases: sweeps, as ``sweep:NAME``.  samples: uniform, to the horizon; precision: double or extended.

    map: two data by the names of their columns, over which digits right are drawn; none for the first two that vary.
    """

    cases: list[str]
    horizon: str
    precision: str = "double"
    samples: int = 10
    integrator: str = HEYOKA
    tolerance: str = ""
    map: list[str] = msgspec.field(default_factory=list)

    def swept(self, sweep: Sweep, cases: Sequence[Case]) -> Sequence[Case]:
        """The chunks of the sweep."""
        return Lazy(number_of(cases), partial(chunks, sweep, cases))

    def tasks(self, find: Find) -> list[Task]:
        """A task for each sweep, of its first motion; a plan makes one of each chunk from it."""
        for name in self.cases:
            if not name.startswith(_SWEEP):
                raise InputError(f"A survey must name a sweep; got {quoted(name)}.", "Name sweeps: sweep:NAME.")
        precision = parse(self.precision)
        if precision not in (DOUBLE, EXTENDED):
            raise refusal("precision", "that of a survey", precision.name, "Use double or extended.")
        (horizon,) = positive([self.horizon], "horizon")
        if self.tolerance:
            positive([self.tolerance], "tolerance")
        if self.map and (len(set(self.map)) != 2 or len(self.map) != 2 or not set(self.map) <= set(DATA)):
            raise InputError(f"A map over {quoted(', '.join(self.map))} needs two axes.", f"Use {', '.join(DATA)}.")
        times, _ = uniform(horizon, self.samples)
        subject, request = computed(self.integrator, tolerance=self.tolerance), {"samples": str(self.samples)}
        more = {"options": tuple(self.map), "request": request}
        return [Task.of_run(NAME, case, subject, precision, times, **more) for case in map(find, self.cases)]


class Survey(Kind):
    """A task is a chunk of motions; its row carries their records as Parquet bytes until the report is written."""

    name = NAME
    table = SurveyTable
    gathers = (FILE,)
    noise_factor = 5.0
    place = 33

    def carries_band(self, metric: Metric) -> bool:
        """All quantiles: the interval that the number of motions leaves to each."""
        return metric.kind == "error"

    def cost(self, task: Task) -> float:
        """Half a millisecond a motion, roughly, for each ten time units."""
        count = task.case.count if isinstance(task.case, Chunk) else 1
        return 0.5 + count * 5e-4 * (1 + float(abs(task.times[-1])) / 10)

    def measure(self, task: Task, saved: Saved) -> Row:
        """The chunk's records.  Raises Contradiction where the computed reference is off the proven one."""
        assert isinstance(task.case, Chunk)
        precision = task.precision
        times = [rounded(time, precision) for time in task.times]
        motions = drawn(task.case, precision, task.seed)
        asked = task.key.subject.tolerance
        options = {"tolerance": exact(asked)} if asked else {}
        figures = measured(motions, task.integrator, times, precision, options)
        radius = float(numpy.nanmax(figures["reference_radius"], initial=0.0))
        row = exact_row(task, f"{task.case.count} motions", Against("computed", _METHOD, f"{radius:.3g}"), {})
        everything = figures | _names(task, motions) | _data(motions)
        return msgspec.structs.replace(row, bits=precision.bits, chunk=chunk_bytes(everything))

    def join(
        self, old: Row, new: Row, folders: tuple[Path, Path], limits: Callable[[str], LossLimits]
    ) -> WorseMotions | None:
        """By the records of survey.parquet, where both folders have it."""
        if not isinstance(new.spread, Spread):
            return None
        return worse_motions(old, new, (folders[0] / FILE, folders[1] / FILE), limits(METRIC))

    def gather(self, rows: Callable[[], Iterator[tuple[Task, Row]]], folder: Path) -> list[Row]:
        """A row for each sweep and integrator; the records of all motions go into survey.parquet."""
        write(folder / FILE, (row.chunk for _, row in rows() if isinstance(row.chunk, bytes)))
        return gathered(rows())

    def contradictions(self, row: Row) -> Iterator[str]:
        """Distributions, a map and worst motions that no survey has.  The row of a chunk has none of these."""
        if not isinstance(row.spread, Spread):
            if not isinstance(row.chunk, bytes):
                yield "spread: missing"
            return
        if not all(map(sum, (bins.counts for bins in row.spread.histograms.values()))):
            yield "spread: a distribution of no motions"
        if (cells := row.spread.map) is not None:
            widths = [len(line) for line in cells.digits_lost]
            fits = widths == [len(cells.x_edges) - 1] * (len(cells.y_edges) - 1)
            if not fits or set(chain(*cells.digits_lost)) <= {None}:
                yield "spread: a map whose cells do not fit its edges, or are empty"
        for motion in row.worst or ():
            if reason := impossible(motion.data, 1):
                yield f"worst: {reason}"

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The median and the worst error of all motions; a line a row."""
        yield from _headline(rows)
        lines = [Note(_line(row)) for row in rows]
        yield Card("Surveys: a record for each motion in survey.parquet", lines, shown=In.SHORT | In.FULL | In.PAGE)
        yield Chart(survey_charts)


def _names(task: Task, motions: Drawn) -> dict[str, object]:
    chunk, key = task.case, task.key
    assert isinstance(chunk, Chunk)
    same = chunk.sweep.name, key.subject.name, key.subject.tolerance, key.precision, key.horizon
    texts: dict[str, object] = {name: [text] * chunk.count for name, text in zip(SAME, same, strict=True)}
    return texts | {"index": numpy.arange(chunk.first, chunk.first + chunk.count), "class": motions.classes}


def _data(motions: Drawn) -> dict[str, object]:
    p = motions.parameters
    columns, zeros = [*p.inertia, *p.moment, *(*p.rotors, 0, 0)[:3], *motions.start], numpy.zeros(len(motions.problems))
    pairs = zip(DATA, columns, strict=True)
    return {name: zeros if isinstance(column, int) else column.high[:, 0] for name, column in pairs}


def _headline(rows: Sequence[Row]) -> Iterator[Headline]:
    """The median and the worst error, of the survey with the worst: ``2,000 tops: median error 7e-16, worst 1.2e-14,
    body many[1489].``
    """
    errors = [(metric, row) for row in rows if (metric := row.metric("solution_error", "relative", "max"))]
    if not errors:
        return
    worst, row = max(errors, key=lambda pair: -math.inf if pair[0].log10 is None else pair[0].log10)
    count = sum(int(number) for _, number in of_motions(row))
    sentence = f"{count:,} tops{f' of {row.case}' if len(rows) > 1 else ''}: "
    if (median := row.metric("solution_error", "relative", "median")) is not None:
        sentence += f"median error {short(median.value, 2)}, "
    which = f", body {row.worst[0].case}" if isinstance(row.worst, tuple) and row.worst else ""
    yield Headline(f"{sentence}worst {short(worst.value, 2)}{which}.")


def _line(row: Row) -> str:
    counts = ", ".join(f"{count} {outcome}" for outcome, count in of_motions(row))
    if row.outcome != Outcome.SUCCESS.value:
        return f"{row.case} {row.integrator} {row.precision}: {row.outcome}"
    metrics = {part: row.metric("solution_error", "relative", part) for part in ("median", "q99", "max")}
    errors = ", ".join(
        f"{name.replace('q99', '99 % below')} {float(metric):.2g}"
        for name, metric in metrics.items()
        if metric is not None
    )
    worst = f"; the worst is {row.worst[0].case}" if isinstance(row.worst, tuple) and row.worst else ""
    return f"{row.case} {row.integrator} {row.precision} to T = {row.horizon}: {counts}; error: {errors}{worst}"
