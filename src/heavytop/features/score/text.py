"""How good one trajectory is, for people: the answer in its first lines."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from fractions import Fraction
from typing import Any

import msgspec
from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.display import plural
from heavytop.features.score.diagnose.samples import AS_AT_START, VARIES
from heavytop.features.score.diagnose.search import FLOOR, Diagnosis
from heavytop.features.score.measurement import Assessment, direction, passed
from heavytop.measure.attitude_error import ATTITUDE_ERROR, JOINT_VIOLATION, POSITION_ERROR
from heavytop.measure.scalar import digits_kept, digits_of, digits_right, digits_text
from heavytop.measure.scorer import DRIFT, SOLUTION_ERROR
from heavytop.records import SCHEMA, Beside, Peer, Quantity, Report, Row, Series
from heavytop.report.document.document import (
    DASHED,
    TIME,
    Block,
    Card,
    Cell,
    Chart,
    Headline,
    In,
    Note,
    Section,
    Sources,
    Table,
    Value,
    draw,
    integral_text,
    logarithm,
    numbered,
    points,
    scientific,
    short,
)
from heavytop.report.document.svg import COLOURS, decades, finish, new_axes, spoken
from heavytop.report.render.text import Lines, wrapped

# Sentences of mistakes of convention: what fits, where it was found, and how many digits are right with it.


_MEANINGS = {
    "gamma_down": "γ points down",
    "omega_reversed": "Ω has the opposite sign",
    "both_reversed": "Ω and γ have the opposite sign",
    "omega_in_degrees": "Ω is in degrees per time unit, not in radians",
    "omega_in_turns": "Ω is in turns per time unit, not in radians",
    "omega_in_rpm": "Ω is in turns per 60 time units (rpm if times are in s), not in radians",
}
"""Readings of the columns."""
_CONVENTION_SENTENCES = {
    **_MEANINGS,
    "scalar_last": "The scalar part of the quaternions is at the other end: quaternion_order = {quaternion_order}",
    "conjugate": "The quaternions are conjugate: quaternion = {quaternion}",
    "scalar_last_conjugate": "The quaternions are conjugate, and their scalar part is at the other end",
    "transposed": "The matrices are transposed: matrix = {matrix}",
    "degrees": "The angles are in {unit}",
    "sequence": "The Euler angles have the sequence {sequence}",
    "extrinsic": "The Euler angles are extrinsic, about space axes: {sequence}",
    "angles_negated": "The Euler angles have the opposite sign",
    "angles_of_inverse": "The Euler angles are those of the inverse rotation, from space to body",
    "omega_frame": "Ω is in {frame} axes: {key}",
    "omega_scaled": "Ω is scaled by {factor}",
    "momentum": "The angular momentum M = I Ω stands in place of Ω",
    "up": "Another axis points up: up = {up}",
    "left_handed": "The axes are left-handed: the {axis} axis is reversed",
    "inertia_about": "The inertia tensor is about the {about}",
    "steiner": "The tensor given plus {times} times its Steiner term m (r² 1 − r rᵀ) fits: its reference point is not "
    "the one given",
    "weight": "The weight is {factor} times the weight given",
    "mass": "The mass is {factor} times the mass given",
    "top": "{number} is {factor} times the value given",
    "start": "The start differs: {turned}Ω = ({omega}) in body axes",
    "column_scaled": "{column} is scaled by {factor}",
    "column_order": "The columns of {columns} are interchanged",
    "no_gravity": "The motion is without gravity: gravity = 0 fits",
    "free_about_centre_of_mass": "The body rotates freely about its centre of mass: it is not held at the fixed point",
    "tensor_axes_conjugated": "The rotation of the principal axes is inverted: Qᵀ D Q in place of Q D Qᵀ",
    "omega_zero": "Ω is 0 in every sample, and the other columns fit: Ω was not written",
    "omega_shifted": "Ω is shifted in time: Ω given at t belongs to t {shift}",
    "times_shifted": "The times are shifted: the state given at t belongs to t {shift}",
    "time_reversed": "The states are those at −t",
    "time_unit": "The times are in another unit: the state given at t belongs to {factor}·t",
    "gravity_sign": "Gravity is reversed: g has the opposite sign, or the third space axis points down",
    "gravity": "The acceleration of gravity is {gravity}, not that given",
    "gravity_unit": "Gravity is in another unit: the weight is {factor} times the weight given",
    "products_of_inertia": "The products of inertia have the opposite sign: the definition is I12 = −∫xy dm",
    "centre_reversed": "The centre of mass is on the opposite side: −centre, as measured from the centre of mass",
    "centre_signs": "The centre of mass is at ({centre})",
    "centre_unit": "The centre of mass is in another unit of length: {factor} times the vector given",
    "inertia_unit": "The moments of inertia are in another unit: {factor} times those given",
    "inertia_axes": "The axes of the inertia tensor are permuted: axes {axes} as 1, 2, 3",
    "centre_axes": "The axes of the centre of mass are permuted: axes {axes} as 1, 2, 3",
    "body_data_axes": "The axes of tensor and centre of mass are permuted: axes {axes} as 1, 2, 3",
    "inertia_in_space_axes": "The inertia tensor is in space axes at t = 0, not in body axes",
    "centre_in_space_axes": "The centre of mass is in space axes at t = 0, not in body axes",
    "data_in_space_axes": "Tensor and centre of mass are in space axes at t = 0, not in body axes",
    "displacement": "The positions are displacements from the first position",
    "position_reversed": "The positions have the opposite sign: from the centre of mass to the fixed point",
    "position_unit": "The positions are in another unit of length: they are scaled by {factor}",
    "position_of_centre": "The positions are those of the centre of mass, not of the point",
    "point": "The positions are those of another point of the body: ({point}) in its axes",
    "pivot": "The fixed point is elsewhere: the positions are shifted by ({offset}) in axes whose third points up",
    "point_and_pivot": "The positions are those of the point ({point}) of the body, shifted by ({offset})",
    "space_axes": "The space axes are permuted or reversed: x, y, z are axes {axes}",
    "body_axes": "The body axes are permuted or reversed: 1, 2, 3 are axes {axes}",
    "space_turned": "The space axes are rotated by {angle} degrees",
    "body_turned": "The body axes are rotated by {angle} degrees",
    "quaternion_length": "The quaternions do not have length 1: it is off by {off} at t = {t}. Their directions "
    "are scored, and the length counts as an error, unless --normalize is given",
    "columns_disagree": "Columns contradict each other: {columns} differ by {by}, from t = {t} on",
}


def is_convention(fit: Diagnosis) -> bool:
    """Whether the diagnosis is one of convention."""
    # other files have mistakes of the same names, without a word on where they were found
    is_ours = fit.left is None or "of" in fit.numbers
    return is_ours and all(kind in _CONVENTION_SENTENCES for kind in fit.kind.split("+"))


def sentence(fit: Diagnosis) -> str:
    """The mistake with its numbers, how far the error falls, and the digits that are right with it."""
    mistake = _mistake(fit)
    if fit.error is None or fit.left is None:
        return f"{mistake}."
    if fit.numbers.get("of") == "rates":
        return f"{mistake}: the relative difference is {fit.left:.2e} if so, and {fit.error:.2e} if not."
    digits = -math.log10(max(fit.left, FLOOR))
    more = " or more" if fit.left < FLOOR else ""
    left = f"less than {FLOOR:.0e}" if more else f"{fit.left:.2e}"
    fall = f"the largest error relative to the size of each quantity falls from {fit.error:.2e} to {left}"
    text = f"{mistake}. With this corrected, {fall}, and {digits:.1f} digits{more} are right."
    return text + (f" Equally good: {'. Or: '.join(map(_mistake, fit.others))}." if fit.others else "")


def _mistake(fit: Diagnosis) -> str:
    numbers, angle = fit.numbers, fit.numbers.get("angle", "0")
    turned = "" if angle == "0" else f"rotated by {angle} degrees, with "
    mistake = "; ".join(_CONVENTION_SENTENCES[kind].format(**numbers, turned=turned) for kind in fit.kind.split("+"))
    mistake += f" ({numbers['entries']} only)" if "entries" in numbers else ""
    mistake += f" ({numbers['steps']})" if "steps" in numbers else ""
    mistake += f", with inertia = {numbers['inertia']} about the pivot" if "inertia" in numbers else ""
    where = {
        "columns": ", in the columns only",
        "start": ", in the start only",
        "rates": ". Ω was compared with the rate of the attitude, without a reference",
    }
    return mistake + where.get(numbers.get("of", ""), "")


# Sentences of the other diagnoses.


_SENTENCES = {
    "no_gravity": "The states fit a motion without gravity, P = 0",
    "momentum": "The first three columns are the angular momentum M = (I1Ω1, I2Ω2, I3Ω3), not Ω",
    "momentum_gamma_down": "The first three columns are the angular momentum M, not Ω, and γ points down",
    "columns_swapped": "γ precedes Ω in these states",
    "weight_sign": "The states fit the weight −P, as when γ points down in start and states",
    "rotor_sign": "The states fit the rotor −k",
    "start_gamma_sign": "The states fit the start with −γ",
    "start_omega_sign": "The states fit the start with −Ω",
    "start_momentum": "The start gives the angular momentum M in place of Ω",
    "all_momentum": "Start and states give the angular momentum M in place of Ω",
    "all_in_degrees": "Start and states give Ω in degrees per time unit, not in radians",
    "all_in_turns": "Start and states give Ω in turns per time unit, not in radians",
    "all_in_rpm": "Start and states give Ω in turns per 60 time units (rpm if times are in s), not in radians",
    "time_reversed": "The states are those at −t",
    "start_row_missing": "The first state is the start: the states are one row late, and the row t = 0 is missing",
    "rows_off_by_one": "Each state belongs to the next time: the states are one row early",
    "rows_late": "Each state belongs to the previous time: the states are one row late",
    "kinematic_sign": "The states solve γ' = Ω × γ, with the opposite sign",
    "gyroscopic_sign": "The states solve M' = Ω × M + P γ × r, with the opposite sign of M × Ω",
    "gyroscopic_missing": "The states solve M' = P γ × r, without the gyroscopic term M × Ω",
    "both_signs": "The states solve M' = Ω × M + P γ × r and γ' = Ω × γ, with opposite signs of M × Ω and γ × Ω",
    "rows_reversed": "The states are listed from the last time to the first",
    "axes_permuted": "The axes are permuted or reversed: {columns_said}",
    "columns": "The columns have another meaning: {columns_said}",
    "inertia_axes": "The moments of inertia are permuted: the states fit {order}",
    "centre_axes": "The axes of the centre of mass are permuted: the states fit {order}",
    "top_axes": "The axes of the top are permuted: the states fit {order}",
    "centre_signs": "The states fit a centre of mass at ({centre})",
    "system": "The states fit the system {other_system}, not {system}",
    "times_shifted": "The times are shifted: the state given at t belongs to t {signed}",
    "component_sign": "The equation of {column} has the opposite sign",
    "term_missing": "The equation of {column} lacks {term}",
    "term_sign": "In the equation of {column}, {term} has the opposite sign",
    "weight": "The states fit another weight: {named}",
    "start": "The states fit another start: {named}",
    "top": "The states fit another top: {named}{about}",
    "one_state": "Only the state at t = {t} is wrong (state {state})",
    "some_states": "Only the states at t = {t} are wrong (states {state})",
    "omega_scaled": "Ω is scaled by {factor} in these states",
    "gamma_scaled": "γ is scaled by {factor} in these states",
    "column_scaled": "{column} is scaled by {factor} in these states",
    "column_negated": "{column} has the opposite sign in these states",
    "column_constant": "{column} is {value} in every state; the other five columns fit",
    "all_scaled": "Start and states give {factor}·Ω in place of Ω",
    "row_missing": "A row is missing: from t = {t} on, each state belongs to the next time",
    "row_twice": "There is one row too many: from t = {t} on, each state belongs to the previous time",
    "column_order": "The columns are in another order: {columns}",
    "axes_of_space": "{whose} given in space axes, of which axis {vertical} is vertical",
    "frozen": "From t = {t} on, {still}.",
    "constant": "All states are the same.",
    "reset": "At t = {t} the motion starts again from its start",
    "clock": "The times differ by up to {off} from multiples of the step {step}, like a sum of steps: at the multiples "
    "{digits} digits are right",
    "significant": "The states are rounded to {digits} significant digits, which explains the error.",
    "decimals": "The states are rounded to {digits} decimals, which explains the error.",
    "single": "The states are rounded to single precision (24 bits), which explains the error.",
}
"""The sentences of the other kinds, of ``rounded`` by what the states are rounded to."""
_SYSTEM = {"heavy_top": "gyrostat", "gyrostat": "heavy_top", "heavy_gyrostat": "heavy_top"}
_WHOSE = {"omega": "Ω is", "both": "Ω and γ are"}


def cause(fit: Diagnosis, system: str) -> str:
    """The mistake in words, without the fall of the error."""
    return _mistake(fit) if is_convention(fit) else _other_mistake(fit, system)


def diagnosis_text(fit: Diagnosis, system: str = "heavy_top") -> str:
    """One or two sentences: what fits, and how far the error falls with it."""
    likely = "Likely: " if fit.likely else ""
    if is_convention(fit):
        return _scope(fit) + likely + sentence(fit)
    mistake = _scope(fit) + likely + _other_mistake(fit, system)
    if fit.left is None or fit.error is None:
        return mistake
    if fit.kind in ("one_state", "some_states"):
        without = "it" if fit.kind == "one_state" else "them"
        return f"{mistake}; without {without} the largest error relative to the size of Ω and γ is {_size(fit.left)}."
    fall = f"the largest error relative to the size of Ω and γ falls from {_size(fit.error)} to {_size(fit.left)}"
    return f"{mistake}; {fall}."


def _scope(fit: Diagnosis) -> str:
    """The states for which the sentence holds, where not all were compared."""
    if fit.looked_at is None:
        return ""
    looked, states, until = fit.looked_at
    return f"Compared {looked} of {states} states, to t = {until}. "


def _size(value: float) -> str:
    return short(f"{value:.2e}", 2) if value >= FLOOR else f"less than {FLOOR:.0e}"


def _other_mistake(fit: Diagnosis, system: str) -> str:
    numbers = fit.numbers
    if fit.kind in _MEANINGS:
        return f"In these states {_MEANINGS[fit.kind]}"
    if fit.kind == "time_unit":
        return _time_unit(**numbers)
    kind = "column_negated" if (fit.kind, numbers.get("factor")) == ("column_scaled", "-1") else fit.kind
    if (text := _SENTENCES.get(numbers.get("to", kind))) is None:
        return _integrals_off(numbers)
    shift = numbers.get("shift", "")
    derived = {
        "columns_said": _columns(numbers),
        "order": f"axes {', '.join(numbers.get('axes', ''))} as 1, 2, 3",
        "named": ", ".join(f"{name} = {value}" for name, value in numbers.items()),
        "about": ", moments about the fixed point" if re.search(r"\bI\d\d", " ".join(numbers)) else "",
        "system": system,
        "other_system": _SYSTEM.get(system, ""),
        "signed": f"− {shift[1:]}" if shift.startswith("-") else f"+ {shift}",
        "whose": _WHOSE.get(numbers.get("of", ""), ""),
        "still": f"{numbers.get('vector', 'the state')} is constant, in {numbers.get('states')} states",
    }
    return text.format(**numbers | derived)


def _time_unit(factor: str, steps: str = "") -> str:
    where = f"the state given at t belongs to {factor}·t"
    if not steps:
        return f"The times are in another unit: {where}"
    n, off = abs(int(steps)), "long" if int(steps) > 0 else "short"
    taken = n + (1 if int(steps) > 0 else -1)
    return (
        f"Each interval is one step too {off} ({taken} steps of 1/{n} of it), or the times are in another unit: {where}"
    )


def _columns(numbers: dict[str, str]) -> str:
    parts = []
    if "meaning" in numbers:
        meaning = numbers["meaning"]
        parts.append(_MEANINGS.get(meaning) or _SENTENCES[meaning])
    if "order" in numbers:
        parts.append("γ precedes Ω")
    if "axes" in numbers:
        vectors = {"both": "Ω and γ", "omega": "Ω", "gamma": "γ"}.get(numbers.get("of", ""), "")
        axes = ", ".join(axis.replace("-", "−") for axis in numbers["axes"].split(","))
        parts.append(f"columns 1, 2, 3 of {vectors} are axes {axes}")
    return "; ".join(parts)


def _integrals_off(numbers: dict[str, str]) -> str:
    """The behaviour of each first integral, those first that keep another value."""
    off = [f"{name} ({value})" for name, value in numbers.items() if value not in (VARIES, AS_AT_START)]
    parts = [f"from the first sample on {_listed(off)} {_keep(off)} another value than at the start"]
    for text, verb in ((AS_AT_START, "{} the value of the start"), (VARIES, "")):
        names = [name for name, value in numbers.items() if value == text]
        if names:
            does = verb.format(_keep(names)) if verb else "vary" if len(names) > 1 else "varies"
            parts.append(f"{_listed(names)} {does}")
    return f"Of the first integrals, {'; '.join(parts)}. Nothing that was tried explains it."


def _listed(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _keep(names: list[str]) -> str:
    return "keep" if len(names) > 1 else "keeps"


_PARTS = {"omega": "Ω", "gamma": "γ", "along": "along the flow", "across": "across the flow"}
_OBSERVED = {
    "attitude_error": "attitude (rad)",
    "position_error": "position",
    "position_error_relative": "position, relative",
}
_DIRECTIONS = {
    "along": "The error is mostly along the flow (phase error).",
    "across": "The error is mostly across the flow.",
    "both": "The errors along and across the flow are similar.",
}


def answer(row: Row, peer: Peer | None) -> list[str]:
    """The sentences that say how good it is; the first may be longer than a line, and can be broken behind its ";"."""
    digits = digits_kept(row)
    lines = []
    if row.outcome != "success":
        lines.append(f"The run ended early ({row.outcome}), at t = {short(row.time_reached)} of {short(row.horizon)}.")
    if digits is None:
        drifts = any(metric.quantity and metric.quantity.name == DRIFT for metric in row.metrics.values())
        unknown = "The number of digits right is unknown: there is no reference." + " Drift is measured." * drifts
        return [
            *lines,
            unknown if row.samples else "The number of digits right is unknown: the first state is not finite.",
        ]
    where = "every sample up to" if row.samples > 1 else "its one sample,"
    text = f"{digits_text(digits)} of {digits_of(row.bits)} digits right at {where} T = {short(row.time_reached)}"
    if peer is not None:
        text += f"; {peer.integrator} in {peer.precision}: {digits_text(peer.digits_right)}"
    lines.append(f"{text}.")
    mostly = direction(row)
    if mostly is not None:
        lines.append(_DIRECTIONS[mostly])
    return lines


def requirement(row: Row, needed: Fraction, cut: str = "") -> str:
    """Whether as many digits are right as are required, in a sentence; ``cut`` as in :func:`passed`."""
    required = f"{float(needed):g} digits required"
    kept, good = digits_right(row), passed(row, needed, cut)
    # rounded down, so that what is not enough does not look so
    shown = "" if kept is None else f"{math.floor(kept * 1000) / 1000:g}"
    if good is not None:
        return f"{required}: " + ("satisfied." if good else f"only {shown} are right.")
    if row.outcome != "success":
        return f"{required}: unknown, because the run ended early."
    if cut:
        return f"{required}: unknown, because {cut}, and later rows are not scored."
    reason = "there is no reference" if kept is None else f"only {shown} are resolved"
    return f"{required}: unknown, because {reason}."


def guessed(assessment: Assessment) -> str | None:
    """The sentence that names the format inferred from the digits; None where the file names it."""
    if not assessment.format_guessed:
        return None
    name = assessment.row.precision
    text = f"The format is not declared; {name} is the narrowest, from double on, that holds the digits written."
    single = " All numbers of the states are in single precision (24 bits), in which they may have been computed."
    return text + (single if assessment.single else "")


def explanations(assessment: Assessment) -> list[str]:
    """Explanations of the error, and what was guessed."""
    sentences = [diagnosis_text(fit, assessment.row.system) for fit in assessment.diagnoses]
    note = guessed(assessment)
    return [*([assessment.used] if assessment.used else []), *sentences, *([note] if note else [])]


def to_json(assessment: Assessment) -> dict[str, Any]:
    """The document of `score --json`: the row, the digits, the peer and the diagnosis."""
    peer = None if assessment.peer is None else asdict(assessment.peer)
    diagnoses = [asdict(fit) | {"sentence": diagnosis_text(fit, assessment.row.system)} for fit in assessment.diagnoses]
    answers = {
        "digits_kept": assessment.digits_right,
        "digits_right": assessment.digits_right,
        "of_digits": assessment.of_digits,
    }
    further: dict[str, Any] = {"scored": assessment.used} if assessment.used else {}
    further |= {
        "peer": peer,
        "mostly": direction(assessment.row),
        "format_guessed": assessment.format_guessed,
        "diagnosis": diagnoses,
    }
    row: dict[str, Any] = msgspec.to_builtins(assessment.row)
    return row | answers | further


def sizes(row: Row) -> list[list[Cell]]:
    """Label, largest, root mean square and final value of each error and of the drift of each first integral."""
    until = f" before t = {short(row.reference.until)}" if row.reference.until else ""
    names = {Quantity(SOLUTION_ERROR, part): f"error{until}, {label}" for part, label in _PARTS.items()}
    names |= {Quantity(name): f"error{until}, {label}" for name, label in _OBSERVED.items()}
    names[Quantity(JOINT_VIOLATION)] = "distance of the joint"
    quantities = [metric.quantity for metric in row.metrics.values() if metric.quantity]
    names |= {
        Quantity(DRIFT, q.component): f"drift, {integral_text(q.component)}" for q in quantities if q.name == DRIFT
    }
    return [
        [label, *(Value(row.metrics.get(statistic.over(part).text)) for part in ("max", "rms", "final"))]
        for statistic, label in names.items()
        if statistic.over("max").text in row.metrics
    ]


def score_text(assessment: Assessment) -> RenderableType:
    """Digits right, distance from the known motion, drift of every first integral, what explains the error."""
    row = assessment.row
    lines = sizes(row)
    table: list[RenderableType] = [
        Lines(["", f"largest over {plural(row.samples, 'sample')}", "rms", "final"], lines),
        Text(),
    ]
    about = f"{row.case}: {row.integrator}, {row.system.replace('_', ' ')} in {row.precision} ({row.bits} bits)"
    parts: list[RenderableType] = [Text(line) for line in answer(row, assessment.peer)]
    parts += [Text(), *(table if lines else []), *_wrapped(about), *_wrapped(f"Reference: {row.reference.brief}.")]
    sentences = explanations(assessment)
    if sentences:
        parts += [Text(), *(line for text in sentences for line in _wrapped(text))]
    return Group(*parts)


def _wrapped(text: str) -> list[Text]:
    return [Text(line) for line in wrapped(text, "")]


# Page of one scored trajectory: digits right, at the end and over time.


_SIZES = "", "largest", "rms", "final"
_MOST = 50
"""Sentences beside the answer."""
_CURVES = {
    Quantity(SOLUTION_ERROR, "along"): "along the flow (phase)",
    Quantity(SOLUTION_ERROR, "across"): "across the flow",
    Quantity(ATTITUDE_ERROR): "attitude",
    Quantity(POSITION_ERROR): "position",
}


def score_report(assessment: Assessment, environment: dict[str, Any], sha256: str = "") -> Report:
    """A report of this row alone, which `compare` reads, with the remarks of its page."""
    beside = Beside(assessment.peer, tuple(explanations(assessment)))
    return Report(SCHEMA, {"name": "score", "sha256": sha256}, environment, [assessment.row], beside)


def one_motion(row: Row, beside: Beside) -> Iterator[Block]:
    """Digits right, explanations of the error, digits over time, and the table of errors and drifts."""
    first, *others = answer(row, beside.peer)
    yield Headline(first)
    compared = f"Reference: {row.reference.brief}."
    yield from (Note(text, shown=In.FULL | In.PAGE) for text in (*others, *([] if beside.remarks else [compared])))
    if beside.remarks:
        remarks = [Note(text) for text in beside.remarks[:_MOST]]
        yield Card("Remarks", remarks, note=compared, shown=In.FULL | In.PAGE)
    yield Chart(digits_over_time)
    units = (
        "Errors of Ω are in 1/time unit, of γ in units of |γ|. Those along and across the flow are of all six "
        "components, and depend on the unit of time. The drift of each first integral is in its own units."
    )
    yield Table("Errors and drift", _SIZES, sizes(row), [units], shown=In.FULL | In.PAGE)


def _not_drawn(row: Row, held: Iterable[Series], right: Callable[[float], float]) -> list[str]:
    """A sentence where the largest error of a curve lies between the samples that are drawn."""
    lacking = []
    for series in held:
        most, drawn = series.quantity and row.metrics.get(series.quantity.over("max").text), points(series)[1]
        if most and most.log10 is not None and drawn and most.log10 > max(drawn) + _BETWEEN:
            lacking.append(right(most.log10))
    return [f"Between these samples the fewest digits right are {min(lacking):.1f}."] if lacking else []


_BETWEEN = 0.1
"""Decades by which an error between the samples drawn exceeds theirs, for it to be mentioned."""


def digits_over_time(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    """Digits right over |t|, of each error that has a series; None for several motions, without a reference, and
    without a sample away from 0.
    """
    rows = [row for _, report in sources for row in report.rows]
    held = {label: rows[0].series[q.text] for q, label in _CURVES.items() if rows and q.text in rows[0].series}
    if len(rows) != 1 or not any(points(series)[0] for series in held.values()):
        return None
    (row,) = rows
    most = row.bits * math.log10(2)

    def right(size: float) -> float:
        return min(most, max(0.0, -size))

    section = Section(
        "over-time",
        "Digits right over time",
        [
            f"−log10 of the error: {', '.join(held)}; the verdict counts the worst component of Ω and γ. "
            f"Dashed: all {most:.0f} digits of {row.precision}."
        ],
        columns=["t", *held],
    )
    axes = new_axes(TIME, "digits right", 3.2)
    alternative = []
    for index, (label, series) in enumerate(held.items()):
        x, sizes_ = points(series)
        if x:
            y = [right(size) for size in sizes_]
            draw(axes, section.key(numbered(label, index)), x, y)
            alternative.append(f"{label}: {y[-1]:.1f} digits right at |t| = {scientific(x[-1])}.")
    axes.set_ylim(0, most * 1.04)
    axes.axhline(most, color=COLOURS[-1], lw=0.9, ls=DASHED)
    decades(axes.xaxis)

    def cell(value: str) -> str:
        size = logarithm(value)
        return f"{most:.1f}" if value == "0" else value if size is None else f"{right(size):.1f}"

    at = [dict(zip(series.times, series.values, strict=True)) for series in held.values()]
    times = dict.fromkeys(time for values in at for time in values)
    if row.samples > len(times):
        section.notes.append(f"{len(times)} of {row.samples} samples, evenly in log |t|; the verdict counts all.")
        section.notes += _not_drawn(row, held.values(), right)
    section.rows = [[short(time), *(cell(values.get(time, "")) for values in at)] for time in times]
    section.pictures.append(finish(axes, section.title, spoken(alternative), section.id))
    return section
