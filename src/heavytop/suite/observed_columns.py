"""Columns of attitudes, positions and Ω in any axes in tables of other programs: their names, places and cells."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from heavytop import written_numbers
from heavytop.errors import InputError, quoted

REMEDY = "docs/score.md lists the columns that are understood."
_DEGREES = re.compile(r"[\[(/]?\s*(deg|degrees?|°)\s*[\])]?$", re.IGNORECASE)
_POSITION = re.compile(r"(?:p|pos|position|com|centre|center|centreofmass|r|point)?([xyz])")
_MATRIX = re.compile(r"(?:r|m|rot|rotation|matrix)([0-3])([0-3])")
_SPACE = re.compile(r"(?:w|omega|om|ω)(?:space|world|global|inertial|s)([xyz123])")
_FRAMED = re.compile(r"w([xyz])")
_BODY = re.compile(r"(?:omega|om|ω|angularvelocity|w)(?:body|local|b)?([xyz0-3])")
_GAMMA = re.compile(r"(?:gamma|gam|g|γ)([xyz0-3])")
_EULER = {
    **{f"euler{k}": k for k in (1, 2, 3)},
    **{f"angle{k}": k for k in (1, 2, 3)},
    **dict.fromkeys(("phi", "φ", "alpha", "α"), 1),
    **dict.fromkeys(("theta", "θ", "beta", "β"), 2),
    **dict.fromkeys(("psi", "ψ"), 3),
}
_TAIT_BRYAN = {"roll": "X", "pitch": "Y", "yaw": "Z", "heading": "Z"}
_AXES = {"x": "1", "y": "2", "z": "3"}
_CLASSIC = {"p": "1", "q": "2", "r": "3"}


@dataclass(frozen=True, slots=True)
class Header:
    """What the columns of a table are.

    time: the place of t; None where there is none.  places: by the name of the quantity, those of its components, by
    their names, in the order in which they stand.  degrees: whether the header says so of angles.  others: not read.
    """

    time: int | None
    places: Mapping[str, Mapping[str, int]]
    degrees: bool
    others: tuple[str, ...]


def header(names: Sequence[str]) -> Header:
    """The meaning of every column; raises InputError for one that stands twice."""
    found: dict[str, dict[str, int]] = {}
    time, degrees, others = None, False, []
    for place, name in enumerate(names):
        plain = _plain(name)
        if plain in ("t", "time"):
            if time is not None:
                raise InputError("The column t stands twice.", "Give each column once.")
            time = place
            continue
        meaning = _meaning(plain)
        if meaning is None:
            others.append(name)
            continue
        quantity, component = meaning
        if component in found.setdefault(quantity, {}):
            plainly = quantity in ("omega", "gamma")
            said = f"{quantity}{_AXES.get(component, component)}" if plainly else quoted(name)
            raise InputError(f"The column {said} stands twice.", "Give each column once.")
        found[quantity][component] = place
        degrees = degrees or (quantity == "euler" and bool(_DEGREES.search(name.strip())))
    return Header(time, found, degrees, tuple(others))


def _plain(name: str) -> str:
    text = unicodedata.normalize("NFKC", re.sub(r"\s*[\[(/].*$", "", name)).lower()
    text = re.sub(r"_deg(rees)?$", "", text.strip())
    return re.sub(r"[\s_{}\\.^-]", "", text)


def _meaning(plain: str) -> tuple[str, str] | None:
    """The quantity and the component of a name; None where it is not understood."""
    if plain in _EULER:
        return "euler", str(_EULER[plain])
    if plain in _CLASSIC:
        return "omega", _CLASSIC[plain]
    if plain in _TAIT_BRYAN:
        return "euler", _TAIT_BRYAN[plain]
    if match := re.fullmatch(r"(?:q|quat|quaternion)([wxyz0-4])", plain):
        return "quaternion", match[1]
    if match := _MATRIX.fullmatch(plain):
        return "matrix", match[1] + match[2]
    if match := _FRAMED.fullmatch(plain):
        return "framed", match[1]
    for quantity, pattern in (("omega_space", _SPACE), ("omega", _BODY), ("gamma", _GAMMA), ("position", _POSITION)):
        if match := pattern.fullmatch(plain):
            return quantity, match[1]
    return None


def is_more_than_states(found: Header) -> bool:
    """Whether there are other columns than Ω and γ, or one of these vectors alone."""
    names = set(found.places)
    given = {"omega" if name == "framed" else name for name in names}
    return bool(given - {"omega", "gamma"}) or (len(given) == 1 and _complete(found))


def _complete(found: Header) -> bool:
    return all(len(components) == 3 for components in found.places.values())


def ordered_places(
    quantity: str, components: Mapping[str, int], scalar_last: bool, sequence: str
) -> list[tuple[str, int]]:
    """Name and place of each component in the order of the quantity; raises InputError for one that is missing."""
    wanted = _wanted(quantity, set(components), scalar_last, sequence)
    missing = [name for name in wanted if name not in components]
    extra = [name for name in components if name not in wanted]
    if missing or extra:
        said = f"component {missing[0]} is missing" if missing else f"component {extra[0]} belongs to no other"
        raise InputError(f"The columns of the {_words(quantity)} are not complete: {said}.", REMEDY)
    return [(name, components[name]) for name in wanted]


def _wanted(quantity: str, there: set[str], scalar_last: bool, sequence: str) -> list[str]:
    if quantity == "quaternion":
        if there & set("wxyz"):
            return list("xyzw" if scalar_last else "wxyz")
        return list("1234" if "4" in there else "0123")
    if quantity == "matrix":
        first = 0 if any("0" in name for name in there) else 1
        return [f"{i}{j}" for i in range(first, first + 3) for j in range(first, first + 3)]
    if quantity == "euler" and there & set("XYZ"):
        if sorted(sequence) != ["X", "Y", "Z"]:
            raise InputError(
                f"roll, pitch and yaw are of a sequence about three axes, not of {sequence or 'none that is said'}.",
                'Give sequence, such as "ZYX", or call the columns euler1, euler2, euler3.',
            )
        return list(sequence)
    if there & set("xyz"):
        return list("xyz")
    return list("012" if "0" in there else "123")


def _words(quantity: str) -> str:
    return {"omega_space": "angular velocity in space axes", "framed": "angular velocity", "euler": "Euler angles"}.get(
        quantity, quantity
    )


def cell(text: str, where: str) -> Fraction | None:
    """An exact number; None for NaN and infinities; InputError that names the place for everything else."""
    if not text.strip():
        raise InputError(f"{where} is empty.", "Give every row all of its columns.")
    try:
        return written_numbers.number(text, where)
    except InputError as error:
        cause = error.cause if error.cause.startswith(where) else f"{where}: {error.cause}"
        raise InputError(cause, error.remedy) from None
