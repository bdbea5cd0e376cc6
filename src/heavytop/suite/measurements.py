"""One task of a plan in, one row of the report out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from decimal import Decimal
from fractions import Fraction
from typing import Any

from flint import arb

from heavytop.claims.audit import audit
from heavytop.claims.ershkov import Branch, PartialCase
from heavytop.errors import OutOfReach
from heavytop.exact.balls import FUNCTIONS, ball, radius_text, working_precision
from heavytop.exact.delone import DeloneHomoclinic
from heavytop.exact.validated import Validated
from heavytop.integrate.taylor import propagate
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure import claim_error
from heavytop.measure.computed_reference import ComputedReference
from heavytop.measure.drift import Drift
from heavytop.measure.known import certified, known_motion
from heavytop.measure.scalar import GUARD_BITS, largest, metric, of_fraction, text
from heavytop.measure.solution_error import SolutionError
from heavytop.precision import decimal_text, exact, number, parse
from heavytop.records import Metric, Row, Series
from heavytop.suite.cases import Case
from heavytop.suite.plan import Task
from heavytop.top.angles import attitude_from_angles
from heavytop.top.equations import HEAVY_TOP, Parameters
from heavytop.top.integrals import holding

BREAK_AWAY = Fraction(1, 1000)
"""A computed homoclinic motion has broken away when Ω is wrong by this, in units of α."""
PARTED = Fraction(1, 100)
"""Claim and truth have parted when Ω differs by this, in units of α."""
WINDOW = 10
"""The error of a homoclinic run is a number only while rate·|t| is below this; later the saddle amplifies rounding."""
_EFFORT = 20.0
"""Seconds that a validated truth may cost before two runs at different precisions take its place."""
_CERTIFIED_AT = 4
"""The closed form of a homoclinic case is certified at this |t|."""
CLAIM = "claimed: (4.2)-(4.6)"
CLAIM_XI = (Fraction(0), Fraction(-1), Fraction(0))
"""ξ at t = 0 of the claimed attitude, where φ + ψ = π/2 and θ = 0."""


def time_text(time: Fraction) -> str:
    """A time in reports: exact where 20 digits suffice, else 20 digits."""
    value = Decimal(decimal_text(time, 20))
    return format(value.normalize(), "f") if value and abs(time) < 10**15 else str(value)


def measure(task: Task) -> Row:
    """The row of ``task``; a run that fails is a row with its outcome."""
    return _MEASURES[task.kind](task)


def _audit(task: Task) -> Row:
    """1 for an equation that holds, 0 for one that is refuted, unresolved for one that is neither."""
    report = audit(task.name, task.form)
    words = {
        True: Metric("1", 0.0, "value"),
        False: Metric("0", None, "value"),
        None: Metric("unresolved", None, "value"),
    }
    metrics = {
        f"({row.equation}).{row.component} {row.branch} {row.domain}": words[row.holds]
        for row in report.rows
        if row.branch == "smooth" or report.system == HEAVY_TOP.name
    }
    return Row(
        case=task.name,
        system=task.form,
        integrator="audit",
        precision="exact",
        bits=0,
        outcome=Outcome.SUCCESS.value,
        horizon="0",
        time_reached="0",
        steps=0,
        finite=True,
        metrics=metrics,
        measure=task.kind,
        measured=f"claimed: {report.source}",
        against=f"the equations of {task.form}",
    )


def _claim_model(task: Task) -> Row:
    claim, branch = _claim(task), _branch(task)
    truth, against = _truth(claim, task.times)
    errors = {time: claim_error.model_error(claim, time, truth, branch) for time in task.times}
    with working_precision(claim_error.MODEL_BITS):
        names = [each.name for each in fields(claim_error.ModelError)]
        metrics = {
            f"claim_model_error_{name}_max": metric(largest(getattr(e, name) for e in errors.values()), "value")
            for name in names
        }
        limit = claim.alpha * PARTED
        parted = next((time for time in task.times if errors[time].omega > ball(limit)), None)
        metrics["claim_parts_by_1_percent_at"] = _time_metric(parted, "value")
        series = {
            f"claim_model_error_{name}": Series(
                [time_text(t) for t in task.keep], [text(abs(getattr(errors[t], name)), 12) for t in task.keep]
            )
            for name in names
        }
    return Row(
        case=task.name,
        system=HEAVY_TOP.name,
        integrator=f"claim:{branch}",
        precision="exact",
        bits=claim_error.MODEL_BITS,
        outcome=Outcome.SUCCESS.value,
        horizon=time_text(task.times[-1]),
        time_reached=time_text(task.times[-1]),
        steps=0,
        finite=all(m.value != "nan" for m in metrics.values()),
        metrics=metrics,
        measure=task.kind,
        measured=f"{CLAIM}, {branch} branch, exactly evaluated",
        against=against,
        series=series,
    )


def _truth(claim: PartialCase, times: Sequence[Fraction]) -> tuple[claim_error.Truth, str]:
    """The true heavy-top motion from the claim's own data, and what it is."""
    bits = claim_error.MODEL_BITS
    if claim.i1 == 2 * claim.i3:
        known = DeloneHomoclinic(claim.alpha, claim.i1)
        proven = certified(known, max(times, key=abs), bits)
        if proven is None:
            raise OutOfReach(f"{known.method} is not certified to {bits} bits.", "Ask for earlier times.")

        def delone(time: Fraction) -> tuple[list[arb], list[arb]]:
            phi, theta, psi = known.angles(time, bits)
            with working_precision(bits):
                xi = attitude_from_angles(phi, theta, psi - arb.pi() / 2, FUNCTIONS)
            return known.state(time, bits), list(xi)

        return delone, proven.text
    top, start = claim.solves.top, claim.solves.start
    enclosed = Validated(top, start, xi=CLAIM_XI, effort=_EFFORT)
    try:
        enclosed.state(max(times, key=abs), bits)
    except OutOfReach:
        computed = ComputedReference(top, start, times, xi=CLAIM_XI)

        def runs(time: Fraction) -> tuple[list[arb], list[arb]]:
            values = computed.state(time)
            return values[:6], values[6:]

        return runs, computed.method

    def validated(time: Fraction) -> tuple[list[arb], list[arb]]:
        return enclosed.state(time, bits), enclosed.attitude(time, bits)

    return validated, f"known: {enclosed.method}, radius below {radius_text(Fraction(1, 2**bits))}"


def _claim_evaluation(task: Task) -> Row:
    claim = _claim(task)
    precision = parse(task.precision)
    rate = claim.solves.rate
    times = [time / rate for time in task.times]
    errors = [claim_error.evaluation_error(claim, time, precision, task.form) for time in times]
    metrics: dict[str, Metric] = {}
    series: dict[str, Series] = {}
    with working_precision(precision.bits + 64):
        for name in (each.name for each in fields(claim_error.EvaluationError)):
            values = [getattr(error, name) for error in errors]
            finite = [value for value in values if value.is_finite()]
            worst = metric(largest(finite)) if finite else Metric("missing", None)
            metrics[f"claim_evaluation_error_{name}_max_finite"] = worst
            lost = Fraction(len(values) - len(finite))
            metrics[f"claim_evaluation_{name}_samples_not_finite"] = of_fraction(lost, "value", str(lost))
            failure = claim_error.first_failure(times, values)
            metrics[f"claim_evaluation_{name}_not_finite_from"] = _time_metric(failure, "duration")
            series[f"claim_evaluation_error_{name}"] = Series(
                [time_text(time) for time in task.times], [text(value) for value in values]
            )
    return Row(
        case=task.name,
        system="gyrostat",
        integrator=f"formula:{task.form}",
        precision=precision.name,
        bits=precision.bits,
        outcome=Outcome.SUCCESS.value,
        horizon=time_text(times[-1]),
        time_reached=time_text(times[-1]),
        steps=0,
        finite=all(m.value == "0" for k, m in metrics.items() if k.endswith("_not_finite")),
        metrics=metrics,
        measure=task.kind,
        measured=f"{CLAIM}, {task.form} form, evaluated in {precision.name}; times of the series are k t",
        against="the same form exactly evaluated from the same rounded data",
        series=series,
    )


def _homoclinic(task: Task) -> Row:
    case, precision = _case(task), parse(task.precision)
    closed = case.homoclinic
    assert closed is not None
    problem = Problem.of(case.top, case.start, precision, case.system)
    if (problem.parameters, problem.start) != (_as_tuples(case), case.start):
        raise ValueError(f"{case.name} is not exact in {precision.name}: its data must be dyadic")
    sign = 1 if task.times[-1] > 0 else -1
    known = certified(closed, Fraction(sign * _CERTIFIED_AT), precision.bits + GUARD_BITS)
    if known is None:
        raise OutOfReach(f"{closed.method} is not certified for {precision.name}.", "Use a format with fewer bits.")
    drift = Drift(problem, holding(case.top, case.start, case.system), task.keep)
    near = SolutionError(problem, closed, task.keep)
    far = SolutionError(problem, closed, task.keep, threshold=BREAK_AWAY * case.alpha)

    def observe(time: Fraction, state: Any) -> None:
        drift(time, state)
        far(time, state)
        if float(abs(time)) * case.rate <= WINDOW:
            near(time, state)

    run = propagate(case.top, case.start, task.times, precision, system=case.system, observer=observe)
    name = "integration_error" if case.claim else "solution_error"
    metrics = {"break_away_time": _time_metric(far.break_away, "duration")}
    metrics |= near.metrics(name) | drift.metrics()
    return _computed_row(task, run, metrics, far.series(time_text, name) | drift.series(time_text), known.text)


def _as_tuples(case: Any) -> Parameters:
    given = case.system.parameters(case.top, case.start)
    return Parameters(tuple(given.inertia), tuple(given.moment), Fraction(given.rotor))


def _drift(task: Task) -> Row:
    case, precision = _case(task), parse(task.precision)
    problem = Problem.of(case.top, case.start, precision, case.system)
    # samples are taken at the rounded times, so the series must be asked for by these
    keep = [exact(number(time, precision)) for time in task.keep]
    drift = Drift(problem, holding(case.top, case.start, case.system), keep)
    known = known_motion(problem, exact(number(task.times[-1], precision)))
    if isinstance(known, str):
        run = propagate(case.top, case.start, task.times, precision, system=case.system, observer=drift)
        return _computed_row(
            task, run, drift.metrics(), drift.series(time_text), f"its own first integrals; no reference: {known}"
        )
    error = SolutionError(problem, known.solution, keep)

    def observe(time: Fraction, state: Any) -> None:
        drift(time, state)
        error(time, state)

    run = propagate(case.top, case.start, task.times, precision, system=case.system, observer=observe)
    series = drift.series(time_text) | error.series(time_text)
    return _computed_row(task, run, drift.metrics() | error.metrics(), series, known.text)


def _computed_row(
    task: Task, run: Trajectory, metrics: dict[str, Metric], series: dict[str, Series], against: str
) -> Row:
    precision = run.problem.precision
    done = run.outcome is Outcome.SUCCESS
    return Row(
        case=task.name,
        system=run.problem.system.name,
        integrator=run.integrator,
        precision=precision.name,
        bits=precision.bits,
        outcome=run.outcome.value,
        horizon=time_text(task.times[-1]),
        time_reached=time_text(task.times[-1] if done else run.time_reached),
        steps=run.steps,
        finite=done and not any(m.value in ("nan", "missing") for m in metrics.values()),
        metrics=metrics,
        measure=task.kind,
        measured=f"computed: {run.integrator} in {precision.name}",
        against=against,
        order=run.order,
        flags=run.flags,
        input_rounding=decimal_text(input_rounding(task, run.problem), 3),
        series=series,
        seconds=run.seconds,
    )


def input_rounding(task: Task, problem: Problem) -> Fraction:
    """The largest relative rounding of the data that the run was given: not charged to it, but said."""
    case = _case(task)
    given = case.system.parameters(case.top, case.start)
    pairs = zip(
        (*given.inertia, *given.moment, Fraction(given.rotor), *case.start.flat),
        (*problem.parameters.inertia, *problem.parameters.moment, problem.parameters.rotor, *problem.start.flat),
        strict=True,
    )
    return max(abs(b - a) / abs(a) if a else Fraction(0) for a, b in pairs)


def _time_metric(time: Fraction | None, kind: Any) -> Metric:
    return Metric("never", None, kind) if time is None else of_fraction(abs(time), kind, time_text(abs(time)))


def _case(task: Task) -> Case:
    assert task.case is not None
    return task.case


def _claim(task: Task) -> PartialCase:
    claim = _case(task).claim
    assert claim is not None
    return claim


def _branch(task: Task) -> Branch:
    return "printed" if task.form == "printed" else "smooth"


_MEASURES: dict[str, Callable[[Task], Row]] = {
    "audit": _audit,
    "claim_model": _claim_model,
    "claim_evaluation": _claim_evaluation,
    "homoclinic": _homoclinic,
    "drift": _drift,
}


def break_away_law(rows: Sequence[Row], rates: dict[str, float]) -> list[Row]:
    """For each homoclinic case with two formats or more: how the break-away time grows with the bits.

    Least squares over the formats; expected slope ln 2/rate, for the errors of p-bit arithmetic leave the saddle
    like 2^-p e^(rate t).
    """
    import numpy

    found: dict[str, list[Row]] = {}
    for row in rows:
        done = row.measure == "homoclinic" and row.outcome == Outcome.SUCCESS.value
        if done and row.metrics["break_away_time"].log10 is not None:
            found.setdefault(row.case, []).append(row)
    laws = []
    for case, members in found.items():
        if len(members) < 2:
            continue
        bits = [float(row.bits) for row in members]
        times = [float(Fraction(row.metrics["break_away_time"].value)) for row in members]
        slope = float(numpy.polyfit(bits, times, 1)[0])
        expected = float(numpy.log(2)) / rates[case]
        laws.append(_law_row(case, members, Fraction(slope), Fraction(expected)))
    return laws


def _law_row(case: str, members: Sequence[Row], slope: Fraction, expected: Fraction) -> Row:
    return Row(
        case=case,
        system=members[0].system,
        integrator=members[0].integrator,
        precision=",".join(row.precision for row in members),
        bits=max(row.bits for row in members),
        outcome=Outcome.SUCCESS.value,
        horizon=max((row.horizon for row in members), key=lambda t: abs(Fraction(t))),
        time_reached=max((row.time_reached for row in members), key=lambda t: abs(Fraction(t))),
        steps=sum(row.steps for row in members),
        finite=True,
        metrics={
            "break_away_slope": of_fraction(slope, "value"),
            "break_away_slope_expected": of_fraction(expected, "value"),
            "break_away_slope_off_by": of_fraction(abs(slope / expected - 1)),
        },
        measure="break_away_law",
        measured="time units of break-away gained per bit, least squares over the formats",
        against="ln 2 / rate of the saddle",
    )
