"""What a motion in many words can be asked, whatever its arithmetic."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import Enum
from fractions import Fraction


class Status(Enum):
    """How an advance ended."""

    FINE = 0
    NON_FINITE = 1
    TOO_SMALL = 2
    CAPACITY = 3


class Steps(ABC):
    """One motion on its way, in scaled units; its time is |τ|.

    steps: taken so far.  forwards: whether time is positive.
    """

    steps: int
    forwards: bool

    @property
    @abstractmethod
    def order(self) -> int:
        """The highest order of a series; of the last step where it varies."""

    @property
    @abstractmethod
    def time(self) -> Fraction:
        """Where the last step ended, exactly."""

    @property
    @abstractmethod
    def state(self) -> tuple[Fraction, ...]:
        """Where the motion is at the end of the last step."""

    @abstractmethod
    def advance(self, target: Fraction, steps: int) -> Status:
        """Take steps, at most so many, until the last covers ``target``."""

    @abstractmethod
    def sample(self, time: Fraction) -> tuple[Fraction, ...] | None:
        """The state at a time inside the last step; changes nothing.  None where the numbers outgrow their words."""

    @abstractmethod
    def coefficients(self, n: int) -> tuple[Fraction, ...]:
        """y_n h^n of the last step, exactly as it was computed."""


class Run(Steps):
    """One that can be taken up again where it was left."""

    @abstractmethod
    def place(self) -> tuple[str, ...]:
        """Where the last step began, as text: all that is needed to go on from there to the same bits."""

    @abstractmethod
    def restore(self, place: tuple[str, ...], steps: int) -> None:
        """Go back to that place, after so many steps."""
