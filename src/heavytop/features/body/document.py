"""Answer of `heavytop body` on the mass properties in a file: as JSON, as text, as the table of a plan."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any

from heavytop.precision import Vector, decimal_text, distinct_digits
from heavytop.report.render.text import wrapped
from heavytop.top.bodies import CENTRE, PrincipalAxes, magnitude_of_gravity, principal_axes
from heavytop.top.body_files import BodyInFile
from heavytop.top.equations import HEAVY_TOP, Parameters
from heavytop.top.inertia_slips import MassProperties, Slip, realisable, six_of, slips
from heavytop.top.stability import Stability, stability

_NAMES = ("I11", "I22", "I33", "I12", "I13", "I23")
_DIGITS, _PRINTED = 17, 6
_BITS = 64
_EQUAL = Fraction(1, 10**9)


@dataclass(frozen=True)
class BodyAssessment:
    """A body in a file, judged.

    name: of the link.  given: its mass properties about the pivot.  realisable: whether a body has them.
    slips: of which one makes it a body, or explains what is implausible.  gravity: text, of the table for a plan.
    note: what the file leaves out, or is not read of it.
    """

    name: str
    given: MassProperties
    realisable: bool
    slips: tuple[Slip, ...]
    gravity: str
    note: str

    @property
    def principal(self) -> PrincipalAxes:
        """Principal axes and moments about the centre of mass, to 64 bits."""
        return principal_axes(self.given.central, _BITS)

    @property
    def rotations(self) -> list[Stability]:
        """Stability of the free rotation about each principal axis, in the order of the moments, at Ω = 1.

        Moments that differ by the rounding of printed digits are taken as equal.
        """
        moments = self.principal.moments
        apart = max(4 * self.given.slack, _EQUAL * max(moments))
        alike = [next(value for value in moments if abs(value - moment) <= apart) for moment in moments]
        parameters = Parameters(alike, (Fraction(0),) * 3, Fraction(0))
        rows = [[Fraction(k == axis) for k in range(6)] for axis in range(3)]
        return [steady for row in rows if (steady := stability(HEAVY_TOP, parameters, row)) is not None]

    @property
    def sound(self) -> bool:
        """Whether it is a body and nothing about it is implausible."""
        return self.realisable and not self.slips

    def data(self, free: bool = False) -> dict[str, str | list[str]]:
        """The keys of a body in a plan; ``free``: turning about its centre of mass, without gravity."""
        centre = (Fraction(0),) * 3 if free else self.given.centre
        return {
            "mass": _decimal(self.given.mass),
            "gravity": "0" if free else self.gravity,
            "centre": [*map(_decimal, centre)],
            "inertia": [*map(_decimal, six_of(self.given.central))],
            "about": CENTRE,
        }

    @property
    def toml(self) -> str:
        """The table of a plan, with a start at rest in the axes of the file."""
        start = {"omega": ["0", "0", "0"], "quaternion": ["1", "0", "0", "0"]}
        values = {"name": self.name, **self.data(), **start}
        return "\n".join(["[[top]]", *(f"{key} = {json.dumps(value)}" for key, value in values.items())]) + "\n"

    @property
    def command(self) -> str:
        """The command for a free tumble about its centre of mass."""
        data = {key: value if isinstance(value, str) else ",".join(value) for key, value in self.data(True).items()}
        options = " ".join(f'--{key} "{value}"' if " " in value else f"--{key} {value}" for key, value in data.items())
        return f"heavytop propagate {options} --omega 1,0.01,0.01 --quaternion 1,0,0,0 --times 1,5,10"

    def document(self) -> dict[str, Any]:
        """The JSON of `heavytop body`."""
        return {
            "name": self.name,
            "mass": _decimal(self.given.mass),
            "centre": [*map(_decimal, self.given.centre)],
            "inertia": [*map(_decimal, self.given.six)],
            "about": "pivot" if self.given.at_pivot else CENTRE,
            "principal": [decimal_text(value, _DIGITS) for value in self.principal.moments],
            "realisable": self.realisable,
            "slips": [
                {"name": slip.name, "sentence": slip.sentence, "inertia": _mended(slip.inertia)} for slip in self.slips
            ],
            "note": self.note,
            "rotations": [asdict(rotation) for rotation in self.rotations] if self.realisable else [],
            "toml": self.toml,
        }

    def lines(self) -> Iterator[str]:
        """Lines of the mass properties for the terminal."""
        principal = self.principal
        moments = ", ".join(decimal_text(value, _PRINTED) for value in principal.moments)
        if self.sound:
            yield f"{self.name}: a rigid body."
        elif self.realisable:
            yield f"{self.name}: a body has this tensor, but it is implausible."
        else:
            yield from wrapped(f"{self.name}: no rigid body has this tensor: {_reason(principal.moments)}")
        for slip in self.slips:
            yield from wrapped(f"{slip.name}: {slip.sentence}", "    ", "  ")
            for numbers in _corrected(slip, self.given):
                yield from wrapped(f"corrected: {numbers}", " " * 6, "    ")
        yield from wrapped(self.note)
        yield ""
        yield f"mass                {_decimal(self.given.mass)}"
        yield from _labelled("centre of mass", f"{', '.join(map(_decimal, self.given.centre))}   from the pivot")
        six = zip(_NAMES, self.given.six, strict=True)
        about = "the pivot" if self.given.at_pivot else "the centre of mass"
        yield from _labelled("inertia", ", ".join(f"{n} {decimal_text(v, _PRINTED)}" for n, v in six))
        yield f"                    about {about}"
        yield f"principal moments   {moments}" + "   about the centre of mass" * self.given.at_pivot
        for axis, direction in enumerate(zip(*principal.axes, strict=True)):
            label = "principal axes" if not axis else ""
            yield f"{label:<20}{', '.join(decimal_text(value, _PRINTED) for value in direction)}"
        if self.realisable:
            for axis, rotation in enumerate(self.rotations):
                rate = f", rate {rotation.rate:.4g} of the angular velocity" if rotation.rate else rotation.why
                label = "" if axis else "free rotation"
                yield from _labelled(label, f"about axis {axis + 1}: {rotation.verdict}{rate}")
            as_given = () if self.sound else ("", "With the numbers of the file, not corrected:")
            yield from (*as_given, "", self.toml, "Its free tumble:")
            yield "  " + re.sub(r" (?=--(inertia|omega))", " \\\n    ", self.command)


def _labelled(label: str, text: str) -> list[str]:
    """Lines of a label, and the text beside it."""
    return wrapped(text, " " * 20, f"{label:<20}")


def assess(body: BodyInFile, pivot: Vector | None = None, gravity: str | None = None) -> BodyAssessment:
    """The assessment of a body about a pivot in the axes of its link; None: its ball joint, or the origin.

    gravity: of the table of a plan; None: that of the file.
    """
    about_pivot = body.about(pivot)
    if gravity is None:
        gravity = _decimal(body.gravity_down)
    else:
        magnitude_of_gravity(gravity)
    possible = realisable(about_pivot.central, about_pivot.slack)
    return BodyAssessment(body.name, about_pivot, possible, tuple(slips(about_pivot)), gravity, body.note)


def _reason(moments: Vector) -> str:
    """Which condition the principal moments break."""
    low, middle, high = sorted(moments)
    if low <= 0 or high <= low + middle:
        return f"its smallest principal moment is {decimal_text(low, _PRINTED)}, and must be positive beyond rounding."
    largest, total = distinct_digits(high, low + middle)
    return f"its largest principal moment, {largest}, exceeds the sum of the others, {total}."


def _decimal(value: Fraction) -> str:
    """An exact decimal where at most 20 digits do, else 17 digits."""
    text = decimal_text(value, 20)
    return text if Fraction(text) == value else decimal_text(value, _DIGITS)


def _corrected(slip: Slip, given: MassProperties) -> Iterator[str]:
    """The numbers that a slip changes."""
    if None in slip.inertia:
        pairs = zip(_NAMES, slip.inertia, strict=True)
        yield ", ".join(f"{name} = {_decimal(value)}" for name, value in pairs if value is not None)
    elif slip.inertia != given.six:
        yield f"inertia = {json.dumps(_mended(slip.inertia))}"
    elif slip.name == "about_centre":
        yield f'about = "{CENTRE}"'
    if slip.mass is not None:
        yield f"mass = {json.dumps(_decimal(slip.mass))}"
    if slip.centre is not None:
        yield f"centre = {json.dumps([*map(_decimal, slip.centre)])}"


def _mended(inertia: Sequence[Fraction | None]) -> list[str | None]:
    return [None if value is None else _decimal(value) for value in inertia]
