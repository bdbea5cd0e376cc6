"""Mistakes of convention in a sentence each: what fits, where it was found, and how many digits are right with it."""

from __future__ import annotations

import math

from heavytop.measure.diagnosis import Diagnosis
from heavytop.measure.suspects import FLOOR

_SENTENCES = {
    "scalar_last": "The quaternions have their scalar part in the other place: quaternion_order = {quaternion_order}",
    "conjugate": "The quaternions are conjugate: quaternion = {quaternion}",
    "scalar_last_conjugate": "The quaternions are conjugate and have their scalar part in the other place",
    "transposed": "The matrices are transposed: matrix = {matrix}",
    "degrees": "The angles are in {unit}",
    "sequence": "The Euler angles are those of the sequence {sequence}",
    "extrinsic": "The Euler angles are about axes of space (extrinsic): those of {sequence}, one after the other",
    "angles_negated": "The Euler angles have the other sign",
    "angles_of_inverse": "The Euler angles are those of the inverse rotation, from space to body",
    "omega_frame": "Ω is in the other axes: those of space where it is said to be in body axes, or the other way round",
    "omega_in_degrees": "Ω is in degrees per time unit, not in radians",
    "omega_in_turns": "Ω is in turns per time unit, not in radians",
    "omega_in_rpm": "Ω is in turns per 60 time units (rpm where times are in s), not in radians",
    "omega_reversed": "Ω has the other sign",
    "omega_scaled": "Ω is {factor} times what fits",
    "momentum": "The columns of Ω are the angular momentum M = I Ω",
    "gamma_down": "γ points down: with −γ it fits",
    "up": "Another axis points up: up = {up}",
    "left_handed": "The axes are left-handed: the {axis} axis is reversed",
    "inertia_about": "The inertia tensor is that about the {about}",
    "gravity_sign": "Gravity pulls the other way: g has the other sign, or the third axis of space points down",
    "gravity_unit": "Gravity has another unit: the weight is {factor} times the one that is given",
    "products_of_inertia": "The products of inertia have the other sign: what is asked for is I12 = −∫xy dm, and so on",
    "centre_reversed": "The centre of mass is on the opposite side: −centre, as from the centre to the fixed point",
    "centre_signs": "The centre of mass is at ({centre})",
    "centre_unit": "The centre of mass has another unit of length: {factor} times the one that is given",
    "inertia_unit": "The moments of inertia have another unit: {factor} times those that are given",
    "inertia_axes": "The axes of the inertia tensor are in another order: those of axes {axes} as 1, 2, 3",
    "centre_axes": "The axes of the centre of mass are in another order: those of axes {axes} as 1, 2, 3",
    "body_data_axes": "Tensor and centre have their axes in another order: those of axes {axes} as 1, 2, 3",
    "inertia_in_space_axes": "The inertia tensor is given in the axes of space at t = 0, not in those of the body",
    "centre_in_space_axes": "The centre of mass is given in the axes of space at t = 0, not in those of the body",
    "data_in_space_axes": "Tensor and centre are given in the axes of space at t = 0, not in those of the body",
    "displacement": "The positions are displacements from the first one",
    "position_reversed": "The positions have the other sign: from the centre of mass to the fixed point",
    "position_unit": "The positions have another unit of length: they are {factor} times what fits",
    "position_of_centre": "The positions are those of the centre of mass, not of the point",
    "point": "The positions are those of another point of the body, ({point}) in its axes",
    "pivot": "The fixed point is elsewhere: the positions are shifted by ({offset}) in axes whose third points up",
    "point_and_pivot": "The positions are those of the point ({point}) of the body, shifted by ({offset})",
    "space_axes": "The axes of space are in another order or reversed: x, y, z are axes {axes}",
    "body_axes": "The axes of the body are in another order or reversed: 1, 2, 3 are axes {axes}",
    "space_turned": "The axes of space are turned by {angle} degrees",
    "body_turned": "The axes of the body are turned by {angle} degrees",
}


def is_convention(found: Diagnosis) -> bool:
    """Whether it is said here."""
    if found.kind in ("quaternion_length", "columns_disagree"):
        return True
    # other files have mistakes of the same names, without a word on where they were found
    return "of" in found.numbers and all(kind in _SENTENCES for kind in found.kind.split("+"))


def sentence(found: Diagnosis) -> str:
    """What fits, in which numbers, how far the error falls, and the digits that are right with it."""
    numbers = found.numbers
    if found.kind == "quaternion_length":
        return (
            f"The quaternions have not length 1: it is off by {numbers['off']} at t = {numbers['t']}. Their directions "
            "are scored, and the length counts as an error; --normalize leaves it out."
        )
    if found.kind == "columns_disagree":
        apart = f"{numbers['columns']} differ by {numbers['by']}, from t = {numbers['t']} on"
        return f"Columns contradict each other: {apart}."
    said = "; ".join(_one(kind, numbers) for kind in found.kind.split("+"))
    where = {"columns": ", in the columns but not in the start", "start": ", in the start but not in the columns"}
    said += where.get(numbers.get("of", ""), "")
    if found.error is None or found.left is None:
        return f"{said}."
    digits = -math.log10(max(found.left, FLOOR))
    more = " or more" if found.left < FLOOR else ""
    fall = f"the largest error relative to the size of each quantity falls from {found.error:.2e} to {found.left:.2e}"
    text = f"{said}. Found by computing the motion that follows: {fall}, so that {digits:.1f} digits{more} are right."
    return text + (f" As well fits: {numbers['or'].replace('_', ' ')}." if "or" in numbers else "")


def _one(kind: str, numbers: dict[str, str]) -> str:
    return _SENTENCES[kind].format(**numbers)
