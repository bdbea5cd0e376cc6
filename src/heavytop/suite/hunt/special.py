"""What is special about a motion, in sentences, and the name of its class."""

from __future__ import annotations

import math
from fractions import Fraction

from heavytop.errors import HeavyTopError
from heavytop.exact.catalogue import matches
from heavytop.suite.hunt.measured import Measured
from heavytop.top.amplification import digits_eaten
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State, dot

NO_CLASS = "no closed form"
_NEAR = 1e-3
_FEW = 3.0
_FAST = 20.0


def class_of(top: HeavyTop, start: State) -> str:
    """The closed form that the motion has."""
    try:
        found = next(matches(top, start, HEAVY_TOP), None)
    except HeavyTopError:
        return NO_CLASS
    return NO_CLASS if found is None else found.method


def special(found: Measured) -> list[str]:
    """Sentences: moments, spin, equilibrium, separatrix, energy, what the motion amplifies; the telling ones alone."""
    top, start = found.motion
    return [each for each in (*_moments(top), *_start(top, start), *_growth(found)) if each]


def _moments(top: HeavyTop) -> list[str]:
    said = []
    for i, j in ((0, 1), (1, 2), (0, 2)):
        a, b = sorted((top.inertia[i], top.inertia[j]), reverse=True)
        ratio = round(a / b)
        off = float(a / b / ratio - 1)
        if ratio <= 3 and abs(off) < _NEAR * 20:
            names = (i, j) if top.inertia[i] == a else (j, i)
            near = "" if off == 0 else f" but for {abs(off):.1g}"
            said.append(f"I{names[0] + 1}/I{names[1] + 1} = {ratio}{near}")
    slack = float((sum(top.inertia) - 2 * max(top.inertia)) / max(top.inertia))
    if slack < _NEAR * 20:
        said.append("at the edge of the triangle inequality" + (f", {slack:.1g} from it" if slack else ""))
    stiff = float(max(top.inertia) / min(top.inertia))
    if stiff > _FAST:
        said.append(f"moments of very different size, 1 : {stiff:.3g}")
    return said


def _start(top: HeavyTop, start: State) -> list[str]:
    parameters = HEAVY_TOP.parameters(top, start)
    pull = dot(top.moment, top.moment)
    spin = math.sqrt(dot(start.omega, start.omega))
    own = math.sqrt(math.sqrt(pull) / float(min(top.inertia)))
    said = []
    if spin == 0 or own == 0:
        said.append("Ω = 0" if spin == 0 else "no torque of the weight")
    elif spin > _FAST * own:
        said.append(f"spins {spin / own:.3g} times as fast as its weight swings it")
    elif own > _FAST * spin:
        said.append(f"slow: Ω is {spin / own:.2g} of what its weight makes of it")
    field = [abs(value) for value in HEAVY_TOP.field(parameters.mapped(Fraction), start.flat)]
    unit = spin + own or 1.0
    speed = max(float(max(field[:3])) / unit**2, float(max(field[3:])) / unit)
    if not any(field):
        said.append("an equilibrium")
    elif speed < _NEAR:
        said.append(f"near an equilibrium: the field is {speed:.1g} of what it could be")
    energy = dot(top.angular_momentum(start.omega), start.omega) / 2 + dot(top.moment, start.gamma)
    height = math.sqrt(pull)
    if height and abs(float(energy) / height - 1) < _NEAR:
        said.append("near a separatrix: its energy is that of rest with the centre of mass above")
    return [*said, f"energy {float(energy):.4g}, P|r| = {height:.4g}"]


def _growth(found: Measured) -> list[str]:
    eaten = digits_eaten(found.amplification)
    chaotic = found.amplification > 100 * (1 + found.turns)
    kind = ", more than a regular motion does: near a separatrix, or chaotic" if chaotic else ""
    said = [f"{found.turns:.3g} radians until the horizon"]
    return (
        [*said, f"the motion itself amplifies by {found.amplification:.2g}{kind}"] if eaten >= _FEW or chaotic else said
    )
