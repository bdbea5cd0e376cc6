"""Claims: their equations, their distance from the truth, and their formulas evaluated in a format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from fractions import Fraction

from flint import arb

from heavytop.claims.audit import audit as audit_of
from heavytop.claims.ershkov import PartialCase
from heavytop.errors import OutOfReach
from heavytop.exact.balls import FUNCTIONS, working_precision
from heavytop.exact.delone import DeloneHomoclinic
from heavytop.integrate.trajectory import Outcome
from heavytop.measure import claim_error
from heavytop.measure.computed_reference import ComputedReference
from heavytop.measure.known import certified
from heavytop.measure.parting import CLAIM_XI, parting, true_solution
from heavytop.measure.scalar import largest, metric, of_fraction, text
from heavytop.precision import parse
from heavytop.records import Metric, Row, Series
from heavytop.suite.measurements.shared import branch_of, claim_of, integrator_text, time_metric, time_text
from heavytop.suite.task import Task
from heavytop.top.angles import attitude_from_angles
from heavytop.top.equations import HEAVY_TOP

CLAIM = "claimed: (4.2)-(4.6)"


def audit(task: Task) -> Row:
    """1 for an equation that holds, 0 for one that is refuted, unresolved for one that is neither."""
    report = audit_of(task.name, task.form)
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
        integrator=integrator_text(task),
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


def claim_model(task: Task) -> Row:
    """The largest errors of the claim (4.2)-(4.6) over the times, exactly evaluated, as a motion of the heavy top, and
    from when on Ω is off by 1 % of α (:mod:`heavytop.measure.parting`).

    The task: a case with a claim, its ``form`` the branch, smooth or printed; exact times of one sign, t ≠ 0.
    Errors of Ω in 1/time unit, of γ none, of the angles in rad.  Raises OutOfReach where the true motion is not proven.
    """
    claim, branch = claim_of(task), branch_of(task)
    truth, against = true_motion(claim, task.times)
    errors = {time: claim_error.model_error(claim, time, truth, branch) for time in task.times}
    with working_precision(claim_error.MODEL_BITS):
        names = [each.name for each in fields(claim_error.ModelError)]
        metrics = {
            f"claim_model_error_{name}_max": metric(largest(getattr(e, name) for e in errors.values()), "value")
            for name in names
        }
        parted = parting(claim, task.times[-1], branch)
        metrics["claim_parts_by_1_percent_at"] = time_metric(None if parted is None else parted.time, "value")
        series = {
            f"claim_model_error_{name}": Series(
                [time_text(t) for t in task.keep], [text(abs(getattr(errors[t], name)), 12) for t in task.keep]
            )
            for name in names
        }
    return Row(
        case=task.name,
        system=HEAVY_TOP.name,
        integrator=integrator_text(task),
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
        samples=len(task.times),
    )


def true_motion(claim: PartialCase, times: Sequence[Fraction]) -> tuple[claim_error.Truth, str]:
    """The true heavy-top motion from the claim's own data, and what it is: a closed form, an enclosure, or two runs.

    times: those at which it will be asked for.  Raises OutOfReach where it is not known up to the last of them.
    """
    bits = claim_error.MODEL_BITS
    known = true_solution(claim)
    try:
        proven = certified(known, max(times, key=abs), bits)
    except OutOfReach:
        if isinstance(known, DeloneHomoclinic):
            raise
        computed = ComputedReference(known.top, known.start, times, xi=CLAIM_XI)

        def runs(time: Fraction) -> tuple[list[arb], list[arb]]:
            values = computed.state(time)
            return values[:6], values[6:]

        return runs, computed.method
    if proven is None:
        raise OutOfReach(f"{known.method} is not certified to {bits} bits.", "Ask for earlier times.")
    if not isinstance(known, DeloneHomoclinic):
        return lambda time: (known.state(time, bits), known.attitude(time, bits)), proven.text

    def delone(time: Fraction) -> tuple[list[arb], list[arb]]:
        phi, theta, psi = known.angles(time, bits)
        with working_precision(bits):
            xi = attitude_from_angles(phi, theta, psi - arb.pi() / 2, FUNCTIONS)
        return known.state(time, bits), list(xi)

    return delone, proven.text


def claim_evaluation(task: Task) -> Row:
    """The largest errors of the formulas (4.2)-(4.6) in a format, and from when on they give no number.

    The task: a case with a claim, its ``form`` printed or stable, its times values of k t of one sign.  Errors of Ω in
    1/time unit, of the angles in rad.  Raises OutOfReach where the formulas cannot be evaluated exactly.
    """
    claim = claim_of(task)
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
            metrics[f"claim_evaluation_{name}_not_finite_from"] = time_metric(failure, "duration")
            series[f"claim_evaluation_error_{name}"] = Series(
                [time_text(time) for time in task.times], [text(value) for value in values]
            )
    return Row(
        case=task.name,
        system="gyrostat",
        integrator=integrator_text(task),
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
        samples=len(times),
    )
