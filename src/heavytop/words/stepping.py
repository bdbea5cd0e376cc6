"""The loop of steps, in machine code: until the time covers a target, a step fails or there were enough."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from heavytop.words.vector import INT, Code, Index


class Stepping(ABC):
    """Writes a function that takes steps.

    clock, counts: arrays of doubles and of integers that live between calls.  most: the steps of a call at most.
    status: the place among the counts of how the last step ended; 0 if well.
    """

    def __init__(self, code: Code, clock: Any, counts: Any, most: Any, status: int) -> None:
        self.code, self.clock, self.counts, self.most, self.status = code, clock, counts, most, status

    @abstractmethod
    def covered(self) -> Any:
        """Whether the time is the target or behind it, a bit."""

    @abstractmethod
    def write_step(self) -> Any:
        """Write one step; gives the bit that says whether it stands."""

    def time(self, place: int) -> Any:
        """A double of the clock."""
        return self.code.builder.load(self.code.address(self.clock, place))

    def count(self, place: int) -> Any:
        """One of the counts."""
        return self.code.builder.load(self.code.address(self.counts, place))

    def set_count(self, value: Index, place: int) -> None:
        """Put one of the counts."""
        self.code.builder.store(self.code.integer(value), self.code.address(self.counts, place))

    def write(self) -> None:
        """The loop; the function gives the number of steps that stand."""
        code, b = self.code, self.code.builder
        head, body, out = (b.append_basic_block(name) for name in ("steps", "step", "out"))
        entry = b.block
        b.branch(head)
        b.position_at_end(head)
        taken = b.phi(INT)
        taken.add_incoming(code.integer(0), entry)
        running = b.icmp_signed("==", self.count(self.status), code.integer(0))
        wanted = b.and_(b.icmp_signed("<", taken, self.most), b.not_(self.covered()))
        b.cbranch(b.and_(running, wanted), body, out)
        b.position_at_end(body)
        good = self.write_step()
        taken.add_incoming(b.add(taken, b.zext(good, INT)), b.block)
        b.branch(head)
        b.position_at_end(out)
        b.ret(taken)
