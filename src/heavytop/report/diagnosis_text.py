"""What explains the error of a motion, in a sentence each."""

from __future__ import annotations

from heavytop.measure.diagnosis import AS_AT_START, VARIES, Diagnosis
from heavytop.measure.suspects import FLOOR
from heavytop.report.convention_text import is_convention, sentence
from heavytop.report.printable import short

_MEANINGS = {
    "gamma_down": ("γ points down", ": with −γ they fit"),
    "omega_reversed": ("Ω has the other sign", ": with −Ω they fit"),
    "both_reversed": ("Ω and γ both have the other sign", ": with −Ω and −γ they fit"),
    "omega_in_degrees": ("Ω is in degrees per time unit", ", not in radians"),
    "omega_in_turns": ("Ω is in turns per time unit", ", not in radians"),
    "omega_in_rpm": ("Ω is in turns per 60 time units", " (rpm where times are in s), not in radians"),
}
"""What the columns mean in these states, and what that comes to."""
_SENTENCES = {
    "momentum": "The first three columns are the angular momentum M = (I1Ω1, I2Ω2, I3Ω3), not Ω",
    "momentum_gamma_down": "The first three columns are the angular momentum M, not Ω, and γ points down",
    "columns_swapped": "γ stands before Ω in these states",
    "weight_sign": "The states fit a top whose weight P has the other sign, as where γ points down in start and states",
    "rotor_sign": "The states fit a rotor of −k: the momentum of the rotor has the other sign",
    "start_gamma_sign": "The states fit a start with −γ: γ of the start has the other sign",
    "start_omega_sign": "The states fit a start with −Ω: Ω of the start has the other sign",
    "start_momentum": "The start gives the angular momentum M in place of Ω",
    "all_momentum": "Start and states give the angular momentum M in place of Ω",
    "all_in_degrees": "Start and states give Ω in degrees per time unit, not in radians",
    "all_in_turns": "Start and states give Ω in turns per time unit, not in radians",
    "all_in_rpm": "Start and states give Ω in turns per 60 time units (rpm where times are in s), not in radians",
    "time_reversed": "The states are those of the times with the other sign",
    "start_row_missing": "The first state is the start: the states are one row late, and the row t = 0 is missing",
    "rows_off_by_one": "Each state is that of the next time: the states are one row early",
    "kinematic_sign": "The states solve γ' = Ω × γ: the equation of γ has the other sign",
    "gyroscopic_sign": "The states solve M' = Ω × M + P γ × r: the product of M and Ω has the other sign",
    "both_signs": "The states solve M' = Ω × M + P γ × r and γ' = Ω × γ: both products with Ω have the other sign",
    "rows_reversed": "The states are listed from the last time to the first",
}
"""Of the kinds that need no number."""
_SYSTEM = {"heavy_top": "gyrostat", "gyrostat": "heavy_top", "heavy_gyrostat": "heavy_top"}
_OWNERS = {"inertia_axes": "moments of inertia", "centre_axes": "centre of mass", "top_axes": "top"}


def diagnosis_text(found: Diagnosis, system: str = "heavy_top") -> str:
    """One or two sentences: what fits, and how far the error falls with it."""
    if is_convention(found):
        return _scope(found) + sentence(found)
    said = _scope(found) + _said(found, system)
    if found.left is None or found.error is None:
        return said
    if found.kind in ("one_state", "some_states"):
        without = "it" if found.kind == "one_state" else "them"
        return f"{said}; without {without} the largest error relative to the size of Ω and γ is {_size(found.left)}."
    fall = f"the largest error relative to the size of Ω and γ falls from {_size(found.error)} to {_size(found.left)}"
    return f"{said}; {fall}."


def _scope(found: Diagnosis) -> str:
    """Of which states the sentence is true, where not all were looked at."""
    if found.looked_at is None:
        return ""
    looked, states, until = found.looked_at
    return f"Looked at {looked} of the {states} states, to t = {until}. "


def _size(value: float) -> str:
    return short(f"{value:.2e}", 2) if value >= FLOOR else f"less than {FLOOR:.0e}"


def _said(found: Diagnosis, system: str) -> str:
    numbers = found.numbers
    if found.kind in _MEANINGS:
        return " in these states".join(_MEANINGS[found.kind])
    if found.kind in _SENTENCES:
        return _SENTENCES[found.kind]
    named = ", ".join(f"{name} = {value}" for name, value in numbers.items())
    match found.kind:
        case "axes_permuted":
            return f"The axes are in another order or reversed: {_columns(numbers)}"
        case "columns":
            return f"The columns mean something else: {_columns(numbers)}"
        case "inertia_axes" | "centre_axes" | "top_axes":
            what = _OWNERS[found.kind]
            order = ", ".join(numbers["axes"])
            return f"The axes of the {what} are in another order: the states fit with those of axes {order} as 1, 2, 3"
        case "centre_signs":
            return f"The states fit a centre of mass at ({numbers['centre']})"
        case "system":
            return f"The states fit the system {_SYSTEM[system]}, not {system}"
        case "times_shifted":
            return f"The times are shifted: the state given at t is that at t {_signed(numbers['shift'])}"
        case "time_unit":
            return f"The time has another unit: the state given at t is that at {numbers['factor']}·t"
        case "weight":
            return f"The states fit another weight: {named}"
        case "start":
            return f"The states fit another start: {named}"
        case "top":
            return f"The states fit another top: {named}"
        case "one_state":
            return f"Only the state at t = {numbers['t']} is off (state {numbers['state']})"
        case "some_states":
            return f"Only the states at t = {numbers['t']} are off (states {numbers['state']})"
        case "omega_scaled":
            return f"Ω is {numbers['factor']} times what fits in these states: divided by it they fit"
        case "gamma_scaled":
            return f"γ is {numbers['factor']} times what fits in these states: divided by it they fit"
        case "column_scaled":
            return f"{numbers['column']} is {numbers['factor']} times what fits in these states: divided by it they fit"
        case "column_constant":
            return f"{numbers['column']} is {numbers['value']} in every state: the other five columns fit"
        case "all_scaled":
            return f"Start and states give {numbers['factor']}·Ω: with both divided by it they fit"
        case "row_missing":
            return f"A row is missing: from t = {numbers['t']} on, the states are those of the next times"
        case "row_twice":
            return f"A row too many: from t = {numbers['t']} on, the states are those of the times before"
        case "column_order":
            return f"The columns stand in another order: they are {numbers['columns']}"
        case "axes_of_space":
            whose = {"omega": "Ω is", "both": "Ω and γ are"}[numbers["of"]]
            return f"{whose} given in axes fixed in space, of which axis {numbers['vertical']} is vertical"
        case "frozen":
            return f"From t = {numbers['t']} on nothing moves: {numbers['states']} states are the same."
        case "constant":
            return "Every state is the same: nothing moves."
        case "rounded":
            return _rounded(numbers)
    return _integrals_off(numbers)


def _signed(shift: str) -> str:
    return f"− {shift[1:]}" if shift.startswith("-") else f"+ {shift}"


def _columns(numbers: dict[str, str]) -> str:
    parts = []
    if "meaning" in numbers:
        meaning = numbers["meaning"]
        parts.append(_MEANINGS[meaning][0] if meaning in _MEANINGS else _SENTENCES[meaning])
    if "order" in numbers:
        parts.append("γ stands before Ω")
    if "axes" in numbers:
        vectors = {"both": "Ω and γ", "omega": "Ω", "gamma": "γ"}[numbers["of"]]
        axes = ", ".join(axis.replace("-", "−") for axis in numbers["axes"].split(","))
        parts.append(f"columns 1, 2, 3 of {vectors} are axes {axes}")
    return "; ".join(parts)


def _rounded(numbers: dict[str, str]) -> str:
    to = {
        "significant": f"{numbers['digits']} significant digits",
        "decimals": f"{numbers['digits']} decimals",
        "single": "single precision (24 bits)",
    }[numbers["to"]]
    return f"The states are rounded to {to}, which explains the error: written in full they may be better."


def _integrals_off(numbers: dict[str, str]) -> str:
    """What each first integral does, those first that keep another value."""
    off = [f"{name} ({value})" for name, value in numbers.items() if value not in (VARIES, AS_AT_START)]
    said = [f"from the first sample on {_listed(off)} {_keep(off)} another value than at the start"]
    for text, verb in ((AS_AT_START, "{} the value of the start"), (VARIES, "")):
        names = [name for name, value in numbers.items() if value == text]
        if names:
            does = verb.format(_keep(names)) if verb else "vary" if len(names) > 1 else "varies"
            said.append(f"{_listed(names)} {does}")
    return f"Of the first integrals, {'; '.join(said)}. Nothing that was tried explains it."


def _listed(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _keep(names: list[str]) -> str:
    return "keep" if len(names) > 1 else "keeps"
