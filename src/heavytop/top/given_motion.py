"""A body and its start out of texts: options of the command line, the tables of a plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from heavytop.errors import InputError, quoted
from heavytop.top.attitude import Attitude
from heavytop.top.bodies import Body
from heavytop.top.heavy_top import HeavyTop, State

BODY = ("inertia", "weight", "centre", "mass", "gravity", "about", "rotor")
START = ("omega", "omega_space", "gamma", "quaternion", "euler", "matrix", "axis_angle")
"""The keys of a body and of a start."""
_ATTITUDES = ("gamma", "quaternion", "euler", "matrix", "axis_angle")


def motion_of(values: Mapping[str, Any], normalize: bool = False) -> tuple[HeavyTop | Body, State]:
    """The top, or the body, and the start that these texts give; what is None or missing was not given.

    values: by the keys of :data:`BODY` and :data:`START`; lists of texts, or one text for a number.  With mass and
    gravity it is a body in any axes, with weight a top in principal axes.
    normalize: move γ, or a quaternion or matrix, to a rotation in exact rationals near it.
    Raises InputError for what is missing, contradicts another, or is no body or start.
    """
    given = {key: value for key, value in values.items() if value is not None and value != []}
    for key in ("inertia", "centre"):
        _require(given, key)
    return _body(given), _start(given, normalize)


def _require(given: Mapping[str, Any], key: str) -> Any:
    if key not in given:
        raise InputError(f"{key} is missing.", f"Give {key}, or the name of a case that has it.")
    return given[key]


def _body(given: Mapping[str, Any]) -> HeavyTop | Body:
    described = [key for key in ("mass", "gravity", "about") if key in given]
    rotor = given.get("rotor")
    if "weight" in given:
        if described:
            raise InputError(
                f"weight and {described[0]} were given.",
                "Give weight with principal moments about the pivot, or mass and gravity with a tensor in any axes.",
            )
        if len(given["inertia"]) in (6, 9):
            raise InputError(
                f"inertia has {len(given['inertia'])} numbers, and a weight stands beside it.",
                "A tensor in any axes needs mass and gravity in place of weight; with weight give 3 principal moments.",
            )
        return HeavyTop(given["inertia"], given["weight"], given["centre"], rotor)
    if not described:
        raise InputError("Neither weight nor mass and gravity were given.", "Give weight, or mass and gravity.")
    for key in ("mass", "gravity"):
        _require(given, key)
    return Body(given["mass"], given["gravity"], given["centre"], given["inertia"], given.get("about"), rotor)


def _start(given: Mapping[str, Any], normalize: bool) -> State:
    named = [key for key in _ATTITUDES[1:] if key in given]
    if len(named) > 1:
        raise InputError(f"{named[0]} and {named[1]} were given.", "Give the attitude once.")
    if not named and "gamma" not in given:
        raise InputError("No attitude was given.", f"Give one of {', '.join(_ATTITUDES)}.")
    spin = {key: given.get(key) for key in ("omega", "omega_space")}
    if not named:
        start = State(gamma=given["gamma"], **spin)
        return start.normalized() if normalize else start
    return State(gamma=given.get("gamma"), attitude=_attitude(named[0], given[named[0]], normalize), **spin)


def _attitude(kind: str, value: Any, normalize: bool) -> Attitude:
    if kind == "matrix":
        return Attitude.matrix(value, normalize=normalize)
    if kind == "quaternion":
        if len(value) != 4:
            raise InputError(f"quaternion has {len(value)} numbers.", "Give four, the scalar first: w,x,y,z.")
        return Attitude.quaternion(*value, normalize=normalize)
    if kind == "axis_angle":
        axis, colon, angle = value.partition(":") if isinstance(value, str) else ("", "", "")
        if not colon:
            raise InputError(f"axis_angle = {quoted(value)} is not an axis and an angle.", "Give it as x,y,z:angle.")
        return Attitude.axis_angle(axis.split(","), angle)
    sequence, colon, angles = value.partition(":") if isinstance(value, str) else ("", "", "")
    parts = angles.split(",")
    if not colon or len(parts) != 3:
        raise InputError(f"euler = {quoted(value)} is not a sequence and three angles.", "Give it as ZXZ:a,b,c.")
    return Attitude.euler(sequence.strip(), *parts)
