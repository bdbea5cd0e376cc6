"""Which arithmetic serves a format and a tolerance, and its machine code, checked before it is used."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from threading import Lock

from heavytop.errors import InputError
from heavytop.integrate.words_check import check
from heavytop.precision import DOUBLE, EXTENDED, Precision, decimal_text
from heavytop.top.equations import System
from heavytop.words import floating
from heavytop.words.floating import Floating, Ladder
from heavytop.words.run import Run
from heavytop.words.scaled import Scaled

LOOSEST = Fraction(1, 10**6)
_GUARD_BITS = {DOUBLE: 16, EXTENDED: 15}
"""Of the formats that double-double exceeds: a long run adds its local errors up, and the sum shall stay below eps."""


@dataclass(frozen=True, slots=True)
class Setting:
    """The arithmetic of a run: double-double with a ladder of orders.

    tolerance: the local error aimed at.
    """

    tolerance: Fraction
    ladder: Ladder

    @classmethod
    def of(cls, scaled: Scaled, precision: Precision, tolerance: Fraction | None) -> Setting:
        """For a format, or for the tolerance where one is given.

        Raises InputError for a tolerance outside 1e-6 to the format's own, and for a format of too many bits.
        """
        if precision.bits > floating.BITS:
            raise InputError(
                f"The integrator words has {floating.BITS} bits, {precision.name} has more.", "Use heyoka for it."
            )
        finest = precision.eps / 2 ** _GUARD_BITS.get(precision, 0)
        wanted = finest if tolerance is None else tolerance
        if not finest <= wanted <= LOOSEST:
            raise InputError(
                f"The integrator words has no tolerance {decimal_text(wanted, 6)} in {precision.name}.",
                f"Give one from {decimal_text(finest, 6)} to 1e-6, or none.",
            )
        return cls(wanted, Ladder.of(wanted))

    @property
    def flags(self) -> dict[str, str]:
        """Everything that can change bits."""
        return {
            "arithmetic": "double-double",
            "words": "2",
            "bits": str(floating.BITS),
            "tolerance": decimal_text(self.tolerance, 6),
            "order": str(self.ladder.order),
            "step_rule": "Jorba and Zou, ten bits",
            "plain_orders": f"where rounding is below 2^{self.ladder.room - 53:.1f}",
        }

    def run(self, scaled: Scaled, forwards: bool) -> Run:
        """A motion at its beginning."""
        return Floating(scaled, self.ladder, forwards)


# the same machine code with every order in double-double, and with nearly all in plain doubles
_FULL = Ladder(38, -1000.0)
_PLAIN = Ladder(24, 1000.0)
_PLAIN_BITS = 53


@dataclass(frozen=True, slots=True)
class Tool:
    """Machine code that gave the right values in a step that is known.

    seconds: what compiling took, once.
    """

    seconds: float


_tools: dict[tuple[str, bool], Tool] = {}
_making = Lock()


def tool(system: System, attitude: bool, setting: Setting) -> Tool:
    """The machine code for this system and arithmetic, compiled and checked at its first use.

    Raises Contradiction where its first step, which is known, is wrong.
    """
    key = (system.name, attitude)
    with _making:
        if key not in _tools:
            machine, _ = floating.machine(system, attitude)
            check(system, attitude, lambda scaled: Floating(scaled, _FULL, True), floating.BITS)
            check(system, attitude, lambda scaled: Floating(scaled, _PLAIN, True, low_order=3), _PLAIN_BITS)
            _tools[key] = Tool(machine.seconds)
        return _tools[key]
