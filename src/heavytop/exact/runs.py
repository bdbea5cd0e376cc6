"""Steps of an enclosure one after another, and the pilot that tells how many bits a motion loses."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import log2
from threading import Lock
from typing import NamedTuple

from heavytop.exact.enclosure import Node, Step, step
from heavytop.exact.quadratic import Quadratic
from heavytop.words.proven import Carrier

FAR = Fraction(10**12)
"""More times as far is not asked of a forecast."""
_PILOT_STEPS = 1000
_KEPT_NODES = 512
_TRIED = 100
_one_writer = Lock()


@dataclass(slots=True)
class Run:
    """Nodes of one motion at one working precision, from time 0 on as far as they were asked for.

    Any thread may ask: a node depends on its time alone, and what is remembered is replaced, never changed in place.
    """

    motion: Quadratic
    precision: int
    nodes: tuple[Node, ...]
    carrier: Carrier | None = None
    stride: int = 1
    lost_at: Fraction | None = None
    _last: Step | None = None
    _skipped: int = 0

    def at(self, time: Fraction) -> tuple[Step, Fraction] | None:
        """The step that covers ``time`` ≥ 0, and τ in it; None if the errors grew too large before it."""
        found, node = self._nearest(time)
        while True:
            if self.lost_at is not None and node.time >= self.lost_at:
                return None
            if found is None:
                found = self._last = step(self.motion, node, self.precision, self.carrier)
            if found is None:
                self.lost_at = node.time
                return None
            if node.time + found.length >= time:
                return found, (time - node.time) / found.length
            node, found = found.end(), None
            self.keep(node)

    def _nearest(self, time: Fraction) -> tuple[Step | None, Node]:
        """The last node known before ``time``, and the step from it where that is known too."""
        last, nodes = self._last, self.nodes
        node = nodes[bisect_right(nodes, time, key=lambda node: node.time) - 1]
        if last is not None and node.time <= last.node.time <= time:
            return last, last.node
        return None, node

    def keep(self, node: Node) -> None:
        """Remember every ``stride``-th node: constant memory at any horizon."""
        nodes = self.nodes
        if node.time <= nodes[-1].time:
            return
        self._skipped += 1
        if self._skipped >= self.stride:
            self._skipped = 0
            nodes = (*nodes, node)
        if len(nodes) > _KEPT_NODES:
            nodes = nodes[::2]
            self.stride *= 2
        self.nodes = nodes


class Ahead(NamedTuple):
    """How far a pilot came: the node at its end, and the time and the bits lost after each of its steps."""

    node: Node
    times: tuple[Fraction, ...] = ()
    losses: tuple[float, ...] = ()


@dataclass(slots=True)
class Pilot:
    """The run in the fewest bits that may do: it tells how many bits the motion loses and how many steps it takes.

    Where those bits do, its nodes are those of the enclosure.  Any thread may ask: ``ahead`` is replaced as a whole by
    one that goes further, and does not depend on who came how far.
    """

    run: Run
    ahead: Ahead

    def forecast(self, span: Fraction, most_steps: float) -> tuple[float, float]:
        """(bits lost, steps taken) up to ``span``, carried on linearly where the pilot does not go.

        The pilot is given up after a hundred steps where, steps as long as these, ``most_steps`` would not do.
        """
        times, losses = self._ahead(span, most_steps)
        if not times:
            return float(self.run.precision), 64 * float(min(span, FAR))
        index = min(bisect_left(times, span), len(times) - 1)
        return 16 + _carried_on(times, losses, index, span), (index + 1) * _times_as_far(span, times[index])

    def _ahead(self, span: Fraction, most_steps: float) -> tuple[Sequence[Fraction], Sequence[float]]:
        """The times and the bits lost as far as ``span``, where the pilot comes so far."""
        node, known, bits = self.ahead
        if known and known[-1] >= span:
            return known, bits
        times, losses, run = list(known), list(bits), self.run
        while (not times or times[-1] < span) and len(times) < _PILOT_STEPS:
            if len(times) >= _TRIED and len(times) * _times_as_far(span, times[-1]) > most_steps:
                break
            found = step(run.motion, node, run.precision, run.carrier)
            if found is None:
                break
            node = found.end()
            run.keep(node)
            times.append(node.time)
            losses.append(node.errors.exponent + log2(float(node.errors.sizes().max()) + 1))
        with _one_writer:
            if len(times) > len(self.ahead.times):
                self.ahead = Ahead(node, tuple(times), tuple(losses))
        return times, losses

    def reaches(self, span: Fraction, bits: int) -> bool:
        """Whether it has come as far and has as many bits left there."""
        _, times, losses = self.ahead
        index = bisect_left(times, span)
        return index < len(times) and self.run.precision - losses[index] >= bits


def _carried_on(times: Sequence[Fraction], losses: Sequence[float], index: int, span: Fraction) -> float:
    """The bits lost by ``span``: by the step ``index``, and from there as by the later half of the steps before it."""
    later = min(span, FAR * times[index]) - times[index]
    if later <= 0:
        return losses[index]
    middle = index // 2
    slope = (losses[index] - losses[middle]) / float(times[index] - times[middle]) if index else 1.0
    return losses[index] + max(0.0, slope) * float(later)


def _times_as_far(span: Fraction, reached: Fraction) -> float:
    """span/reached, at least 1 and at most 10^12."""
    return max(1.0, float(min(span / reached, FAR)))
