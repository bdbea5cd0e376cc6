"""Motions that got worse, found in the records beside two reports."""

from __future__ import annotations

from typing import Any, Protocol

import msgspec

from heavytop.display import plural
from heavytop.integrate.trajectory import Outcome
from heavytop.records import Identity


class LossLimits(Protocol):
    """The allowance of one metric, in decades: its floor in eps, loss, and the factor of its noise."""

    @property
    def floor(self) -> float: ...
    @property
    def loss(self) -> float: ...
    @property
    def noise(self) -> float: ...


class WorseMotion(msgspec.Struct, frozen=True):
    """A motion by its index in the sweep: digits right before and after, None where the run failed, its new outcome,
    and the command that measures it alone.
    """

    index: int
    before: float | None
    after: float | None
    outcome: str
    command: str

    @property
    def text(self) -> str:
        """``motion 531: digits right 14.2 → 9.1``."""
        digits = ["-" if value is None else f"{value:.1f}" for value in (self.before, self.after)]
        ended = "" if self.outcome == Outcome.SUCCESS.value else f", {self.outcome}"
        return f"motion {self.index}: digits right {digits[0]} → {digits[1]}{ended}"


class WorseMotions(msgspec.Struct, frozen=True):
    """Motions of one survey: the number in both reports, the number that got worse, and those with the largest losses.

    reason: why the reports are not joined by motion; empty where they are.
    """

    row: Identity
    joined: int = 0
    worse: int = 0
    first: tuple[WorseMotion, ...] = ()
    reason: str = ""

    @property
    def sentence(self) -> str:
        """A sentence of the comparison; empty where no motion got worse."""
        name = f"{self.row.case} by {self.row.integrator} {self.row.key.precision}"
        if self.reason:
            return f"The motions of {name} are not compared one by one: {self.reason}."
        if not self.worse:
            return ""
        return f"{self.worse} of {plural(self.joined, 'motion')} of {name} got worse; {self.first[0].text}."

    def to_json(self) -> dict[str, Any]:
        """An entry of the surveys of `compare --json`."""
        document = {"joined": self.joined, "worse": self.worse, "reason": self.reason}
        return self.row.named | document | {"motions": [msgspec.structs.asdict(motion) for motion in self.first]}
