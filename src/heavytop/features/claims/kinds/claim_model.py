"""The claim (4.2)-(4.6), exactly evaluated, against the true motion of the heavy top from its own data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from functools import cache, lru_cache, partial
from typing import Any, cast

from flint import arb

from heavytop.cases import Case
from heavytop.errors import InputError, OutOfReach
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import FUNCTIONS, working_precision
from heavytop.features.claims import claim_error as errors_of
from heavytop.features.claims.claim_error import CLAIM_XI, divergence_time, true_solution
from heavytop.features.claims.library.ershkov import Branch, PartialCase
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import positive, samples, signed
from heavytop.harness.rows import Find, PlanTable, Task, exact_row, time_metric
from heavytop.integrate.trajectory import Problem
from heavytop.kind import Kind
from heavytop.measure.scalar import largest, metric, text
from heavytop.measure.scorer import INTEGRATION_ERROR
from heavytop.measure.truth import certified, compute
from heavytop.precision import exact, time_text
from heavytop.records import HEYOKA, Against, Beside, Direction, Metric, Quantity, Row, RowKey, Series, Subject, by_name
from heavytop.report.document.document import (
    MOST_PLOTS,
    TIME,
    Block,
    Card,
    Cell,
    Chart,
    Headline,
    In,
    Key,
    Note,
    Section,
    Sources,
    Value,
    clip,
    draw,
    left_out,
    logarithm,
    points,
    scientific,
    short,
)
from heavytop.report.document.document import Table as Cells
from heavytop.report.document.svg import COLOURS, decades, finish, new_axes, spoken
from heavytop.report.render.text import both
from heavytop.top.attitude import attitude_from_angles
from heavytop.top.equations import HEAVY_TOP

BRANCHES = "smooth: roots continued through t = 0; printed: all roots positive; -2, -6: I1/I3."

CLAIM = "claimed: (4.2)-(4.6)"
MODEL_ERROR, EVALUATION_ERROR = "claim_model_error", "claim_evaluation_error"
"""Errors of a claim: of its formulas, and of their evaluation in a format."""


def claimed(find: Find, names: list[str]) -> Iterator[Case]:
    """The cases of these names; raises InputError for a case without a claim."""
    for case in map(find, names):
        if not isinstance(case.homoclinic, ErshkovPartial):
            raise InputError(f"Nothing is claimed about the case {case.name}.", "Use a case such as ershkov-partial-2.")
        yield case


def claim_of(case: Case) -> PartialCase:
    """The claim with the data of a case, which is the exact motion that its formulas solve."""
    known = case.homoclinic
    assert isinstance(known, ErshkovPartial)
    return PartialCase(known.alpha, known.i1, known.i3)


# The section of a page about a claim: its error split in three.


def claim_error(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """The error of a claim split in three: its model, its formulas in floating point, and an integrator's."""
    directions: dict[str, list[Direction]] = {}
    for _, report in sources:
        for row in report.rows:
            if _series(row, MODEL_ERROR) or _series(row, EVALUATION_ERROR):
                directions.setdefault(row.key.case, []).append(row.key.direction)
    if not directions:
        return None
    # one direction of time is enough to draw
    bases = [
        (case, "forward" if "forward" in directions_of_case else directions_of_case[0])
        for case, directions_of_case in directions.items()
    ]
    section = Section(
        "claim-error",
        "Error of the claim",
        [
            "Three errors that are easily confused. Model: the formulas, evaluated exactly, compared with the true "
            "motion of the heavy top from the same data. Evaluation: the formulas in floating point, compared with "
            "their exact evaluation. Integration: an integrator on the motion that the formulas do solve, compared "
            "with that motion.",
            "The model’s error of the attitude is the angle between the two attitudes: both motions start at the pole "
            "γ = e3, where φ and ψ are undefined and their differences mean nothing. Next to it is the error of the "
            "formula for ψ, which rotates the attitude by the same angle.",
            "Crosses along the top mark times at which floating point gives NaN or an infinity. Errors below 1e-26, "
            "where Ω itself has decayed, and errors of exactly 0 are not drawn. Only motions forward in time are "
            "drawn; the rows have those backward in time too.",
        ],
        columns=["case", "error", "quantity", "|t| = 1", "largest drawn", "not finite from |t|"],
        across=2,
        place=20,
    )
    left_out(section, len(bases) - MOST_PLOTS // 2, "case")
    for number, (case, direction) in enumerate(bases[: MOST_PLOTS // 2]):
        called = case if direction == "forward" else f"{case}/{direction}"
        for quantity, title, unit in (("omega", "Ω", "1/time unit"), ("attitude", "attitude and of ψ", "rad")):
            axes = new_axes(TIME, f"error of {title} ({unit})")
            decades(axes.xaxis)
            decades(axes.yaxis)
            alternative: list[str] = []
            for source, report in sources:
                rows = [row for row in report.rows if (row.key.case, row.key.direction) == (case, direction)]
                for key, series, scale, symbol in _claim_parts(rows, quantity, source):
                    alternative += _claim_curve(axes, section, section.key(key), series, scale, called, symbol)
            title = f"{clip(called, 40)}: error of {title}"
            if alternative:
                box = axes.dataLim
                if math.isfinite(box.y0):
                    axes.set_ylim(max(box.y0 - 1, _LOWEST), max(box.y1, _LOWEST) + 1)
                section.pictures.append(finish(axes, title, spoken(alternative), f"claim-{number}-{quantity}"))
    return section


_LOWEST = -26
"""log10 of the smallest error that is drawn: where Ω tends to 0, so does its error in floating point."""


def _series(row: Row, name: str) -> dict[str, Series]:
    """The series of the quantity of that name, by their components."""
    series = [(series.quantity, series) for series in row.series.values() if series.quantity and series.times]
    return {quantity.component: series for quantity, series in series if quantity.name == name}


def _claim_parts(rows: Sequence[Row], quantity: str, source: str) -> Iterator[tuple[Key, Series, float, str]]:
    """The curves of one case: label, series, the unit of its times in |t|, and the quantity of the error.

    quantity: omega or attitude; of formulas in floating point the part of the attitude is ψ.
    """
    bits = min((row.bits for row in rows if _series(row, EVALUATION_ERROR)), default=53)
    old, suffix = source == "baseline", f", {source}" if source else ""
    in_format = "psi" if quantity == "attitude" else quantity
    for row in rows:
        subject, precision = row.key.subject, clip(row.precision, 20)
        if subject.branch == "smooth" and (series := _series(row, MODEL_ERROR).get(quantity)):
            yield Key(f"model{suffix}", 1, "s", "", old), series, 1.0, _symbol(quantity)
        if row.bits == bits and (series := _series(row, EVALUATION_ERROR).get(in_format)):
            ends = [logarithm(end) for end in (row.horizon, series.times[-1])]
            scale = 10 ** ((ends[0] or 0.0) - (ends[1] or 0.0))
            colour, marker = (3, "D") if subject.form == "printed" else (2, "^")
            label = f"evaluation, {clip(subject.form, 20)} form, {precision}{suffix}"
            yield Key(label, colour, marker, "", old), series, scale, _symbol(in_format)
        if row.bits == bits and (series := _series(row, INTEGRATION_ERROR).get(quantity)):
            label = f"integration, {clip(row.integrator, 20)}, {precision}{suffix}"
            colour, marker = (0, "o") if subject.name == HEYOKA else (4, "v")
            yield Key(label, colour, marker, "", old), series, 1.0, _symbol(quantity)


def _symbol(quantity: str) -> str:
    return {"omega": "Ω", "psi": "ψ"}.get(quantity, quantity)


def _claim_curve(
    axes: Any, section: Section, key: Key, series: Series, scale: float, case: str, symbol: str
) -> list[str]:
    """Draws one curve, adds its line to the table, and returns its alternative text."""
    x, y = points(series, 0.0, scale)
    undefined = [logarithm(t) for t, v in zip(series.times, series.values, strict=False) if v == "nan"]
    lost = sorted(t + math.log10(scale) for t in undefined if t is not None)
    if lost:
        top, colour = axes.get_xaxis_transform(), COLOURS[key.colour]
        axes.plot(lost, [0.99] * len(lost), "x", transform=top, color=colour, ms=4, clip_on=False)
    if x:
        draw(axes, key, x, y)
    at_one = next((v for t, v in zip(x, y, strict=True) if abs(t) < 1e-6), None)
    exact = bool(series.values) and all(value == "0" for value in series.values)
    largest = scientific(max(y)) if y else "0 (exact)" if exact else "none finite"
    cells = [symbol, "" if at_one is None else scientific(at_one), largest, scientific(lost[0]) if lost else ""]
    section.rows.append([clip(case, 40), key.label, *cells])
    tail = f", not finite from |t| = {scientific(lost[0])}" if lost else ""
    return [f"{key.label}: largest sample {largest}{tail}."]


NAME = "claim_model"
PARTS = Quantity("claim_parts_by_1_percent_at")
_SHOWN = ("0.1", "1", "2", "5")
_SECONDS = 1.0
_BRANCHES: dict[Direction, tuple[Branch, ...]] = {"forward": ("smooth", "printed"), "backward": ("smooth",)}


class ClaimModelTable(PlanTable, tag=NAME):
    """times: of the series, t > 0.  grid: the number of points of a uniform grid up to the last time.

    The largest errors are over both.
    """

    cases: list[str]
    times: list[str]
    grid: int = 200
    directions: tuple[Direction, ...] = ("forward", "backward")

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row."""
        times = positive(self.times, "times")
        grid = sorted({*times, *(times[-1] * i / self.grid for i in range(1, samples(self.grid) + 1))})
        tasks = []
        for case in claimed(find, self.cases):
            for direction in self.directions:
                signs = signed(grid, direction), signed(times, direction)
                for branch in _BRANCHES[direction]:
                    subject = Subject("claimed", "(4.2)-(4.6)", branch=branch)
                    end = time_text(signs[1][-1])
                    key = RowKey(NAME, case.name, HEAVY_TOP.name, subject, direction=direction, horizon=end)
                    request = {"grid": str(self.grid)}
                    tasks.append(Task(key, f"/{direction}", f"claim:{branch}", case, *signs, request=request))
        return tasks


class ClaimModel(Kind):
    """The largest errors of the claim over the times, and the time from which on Ω is off by 1 % of α.

    Errors of Ω in 1/time unit, of γ none, of the angles in rad.
    """

    name = NAME
    table = ClaimModelTable
    needed = (PARTS.text,)
    place = 32

    def cost(self, task: Task) -> float:
        """Seconds, equal for all rows."""
        return _SECONDS

    def measure(self, task: Task, saved: Saved) -> Row:
        """The row of one branch in one direction.  Raises OutOfReach where the true motion is not proven."""
        claim, branch = claim_of(task.given), cast(Branch, task.key.subject.branch)
        truth, against = _shared_motion(claim, task.times)
        errors = {time: errors_of.model_error(claim, time, truth, branch) for time in task.times}
        metrics: dict[Quantity, Metric] = {}
        series = {}
        with working_precision(errors_of.MODEL_BITS):
            for name in errors_of.ModelError._fields:
                quantity = Quantity(MODEL_ERROR, name)
                values = {time: getattr(error, name) for time, error in errors.items()}
                metrics[quantity.over("max")] = metric(largest(values.values()), "value")
                texts = [text(abs(values[time]), 12) for time in task.keep]
                series[quantity.text] = Series([time_text(time) for time in task.keep], texts, quantity)
            divergence = divergence_time(claim, task.times[-1], branch)
            metrics[PARTS] = time_metric(None if divergence is None else divergence.time, "value")
        measured = f"{CLAIM}, {branch} branch, exactly evaluated"
        return exact_row(task, measured, against, by_name(metrics), errors_of.MODEL_BITS, series)

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The divergence times, a table of errors by case and branch, and cards of the motions forward in time.

        A card is about the smooth branch where a case has several.
        """
        measured = [row for row in rows if PARTS.text in row.metrics]
        if measured:
            yield _headline(measured)
        forward = [row for row in measured if row.key.direction != "backward"]
        yield from _divergence_times(forward)
        times = [time for time in _SHOWN if any(exact(time) in _values(row, "omega") for row in rows)]
        heads = (*(f"ΔΩ at |t|={t}" for t in times), *(f"Δγ at |t|={t}" for t in times[:2]))
        yield Cells(
            "Claim compared with the true motion: (4.2)-(4.6) as a motion of the heavy top, from its own data at t = 0",
            ["case", "branch", *heads, "Ω off 1 % of α at |t|"],
            both((row, _cells(row, times)) for row in rows),
            [
                "ΔΩ, Δγ: largest component of claim minus truth, evaluated exactly, without rounding errors.",
                "Off 1 %: the first |t| at which |ΔΩ| is 1 % of α = Ω3(0) I3/I1, proven by bisection.",
                BRANCHES,
            ],
        )
        truths = {row.key.case: row.reference for row in rows}
        for case, known in truths.items():
            text = f"{known.brief}, {known.certified}" if known.certificates else known.text
            yield Note(f"{case}: true motion: {text}", style="soft")
        smooth = {row.case for row in forward if row.key.subject.branch == "smooth"}
        for row in forward:
            if row.case not in smooth or row.key.subject.branch == "smooth":
                yield _card(row, [other for other in forward if other.case == row.case and other is not row])
        yield Chart(claim_error, of_all=True)


def _headline(rows: Sequence[Row]) -> Headline:
    """The first time at which a claimed Ω is off by 1 %."""
    diverged = [(time, row) for row in rows if (time := row.metrics[PARTS.text].log10) is not None]
    if diverged:
        _, row = min(diverged, key=lambda pair: pair[0])
        at, where = f"|t| = {short(row.metrics[PARTS.text].value)}", f"{clip(row.case, 40)}, {row.key.subject.branch}"
        return Headline(f"The claimed Ω is off by 1 % of α = Ω3(0) I3/I1 from {at} on ({where}).")
    horizon = short(max((row.horizon.removeprefix("-") for row in rows), key=exact))
    return Headline(f"The claimed Ω stays within 1 % of α of the true motion up to |t| = {horizon}.")


def _divergence_times(rows: Sequence[Row]) -> Iterator[Cells]:
    by_branch: dict[str, dict[str, str]] = {}
    for row in rows:
        by_branch.setdefault(row.key.case, {})[row.key.subject.branch] = short(row.metrics[PARTS.text].value, 2)
    branches = list(dict.fromkeys(branch for times in by_branch.values() for branch in times))
    cells = [[case, *(times.get(branch, "-") for branch in branches)] for case, times in by_branch.items()]
    heads = [{"printed": "as printed"}.get(branch, f"{branch} branch") for branch in branches]
    if cells:
        yield Cells("Ω off by 1 % of α = Ω3(0) I3/I1 at |t|", ["", *heads], cells, shown=In.SHORT)


def _cells(row: Row, times: Sequence[str]) -> list[Cell]:
    parts = (_values(row, part) for part in ("omega", "gamma"))
    omega, gamma = ([short(values.get(exact(t)) or "-") for t in times] for values in parts)
    return [row.key.subject.branch, *omega, *gamma[:2], Value(row.metrics.get(PARTS.text))]


def true_motion(claim: PartialCase, times: Sequence[Fraction]) -> tuple[errors_of.Truth, Against]:
    """The true heavy-top motion from the claim's data at ``times``: by a closed form, an enclosure, or two runs.

    Raises OutOfReach where it is not known up to the last of the times.
    """
    bits = errors_of.MODEL_BITS
    known = true_solution(claim)
    try:
        proven = certified(known, max(times, key=abs), bits)
    except OutOfReach:
        if isinstance(known, DeloneHomoclinic):
            raise
        (computed,) = compute([partial(Problem.of, known.top, known.start, xi=CLAIM_XI)], times, bits)
        return computed.state, computed.against
    if proven is None:
        raise OutOfReach(f"{known.method} is not certified to {bits} bits.", "Give earlier times.")
    return cache(partial(_state_and_attitude, known)), proven.against


def _state_and_attitude(known: DeloneHomoclinic | Validated, time: Fraction) -> Sequence[arb]:
    bits = errors_of.MODEL_BITS
    if isinstance(known, Validated):
        return known.with_attitude(time, bits)
    phi, theta, psi = known.angles(time, bits)
    with working_precision(bits):
        xi = attitude_from_angles(phi, theta, psi - arb.pi() / 2, FUNCTIONS)
    return [*known.state(time, bits), *xi]


_shared_motion = lru_cache(maxsize=2)(true_motion)
"""The true motion, shared by the branches of a claim."""


def _values(row: Row, component: str) -> dict[Fraction, str]:
    """The errors of a component, by |t|."""
    series = row.series.get(Quantity(MODEL_ERROR, component).text)
    return {abs(exact(t)): value for t, value in zip(series.times, series.values, strict=False)} if series else {}


def _card(row: Row, others: Iterable[Row]) -> Card:
    """The errors of one branch, and the divergence times of the others."""
    horizon, divergence = short(row.horizon.removeprefix("-")), short(row.metrics[PARTS.text].value)
    largest = row.metric(MODEL_ERROR, "omega", "max")
    over = f"over {row.samples} samples" if row.samples else "over the samples"
    if divergence == "never":
        lines = [Note(f"Ω stays within 1 % of α of the true motion up to |t| = {horizon}.")]
    else:
        explanation = "The first time at which the largest component of |ΔΩ| from the true motion is 1 % of α, proven. "
        largest_error = short(largest.value) if largest else "missing"
        explanation += f"The largest error {over} up to |t| = {horizon} is {largest_error}."
        lines = [Note(f"|t| = {divergence}", style="big"), Note(explanation)]
    for other in others:
        at = short(other.metrics[PARTS.text].value)
        when = f"not up to |t| = {horizon}" if at == "never" else f"from |t| = {at}"
        lines.append(Note(f"On the {clip(other.key.subject.branch, 20)} branch: {when}."))
    omega, gamma = (_values(row, component) for component in ("omega", "gamma"))
    shown = {t: exact(t) for t in _SHOWN if exact(t) in omega}
    cells = [(t, short(omega[time]), short(gamma.get(time, "missing"))) for t, time in shown.items()]
    title = f"{clip(row.key.case)}, {clip(row.key.subject.branch, 20)} branch: wrong from"
    table = Cells("Error of Ω (1/time unit) and of γ (|γ| = 1)", ("|t|", "|ΔΩ|", "|Δγ|"), cells)
    return Card(title, lines, table, f"True motion: {row.reference.brief}")
