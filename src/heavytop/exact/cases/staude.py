"""Staude's permanent rotations: Ω ∥ γ, both constant in the body; and every other equilibrium of the equations.

γ' = 0 means Ω = ω γ, and M' = 0 then means γ × (P r − ω² I γ) = 0.  So γ lies on Staude's cone, r·(I γ × γ) = 0, and

    ω² = P (I γ × γ)·(r × γ) / |I γ × γ|²     where γ is not a principal axis; it must not be negative.

On a principal axis through r every ω is possible; on another one, none.  Conversely P r = ω² I γ + κ γ gives
every top that turns about γ at the rate ω; with a rotor of momentum k, P r = ω² I γ + ω k + κ γ.  Space turns about Ω
in the body at the rate |Ω|.
Source: O. Staude, J. reine angew. Math. 113 (1894) 318.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from heavytop.exact.closed_form import Carry, WithAttitude, balls, rotate
from heavytop.exact.flint.balls import BallLike
from heavytop.exact.solution import equilibrium, require
from heavytop.top.equations import HEAVY_TOP, System


@dataclass(frozen=True, slots=True)
class Staude(WithAttitude):
    """A start that is an equilibrium of all six equations.  Raises NotInClass where the field is not exactly 0."""

    system: System = HEAVY_TOP
    method = "closed form: permanent rotation"
    source = "O. Staude, J. reine angew. Math. 113 (1894) 318"

    def __post_init__(self) -> None:
        require("A permanent rotation", (equilibrium(self.system),), self.top, self.start)

    def motion(self, time: BallLike) -> tuple[list[Any], Carry]:
        parameters = self.system.parameters(self.top, self.start)
        omega = self.system.angular_velocity(parameters, self.start.flat)
        return balls(self.start.omega), lambda fixed: rotate(fixed, omega, time)

    def evaluate(self, _time: Fraction) -> list[Any]:
        """The start, at every time."""
        return balls(self.start.flat)
