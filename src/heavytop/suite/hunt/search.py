"""The search itself: random motions, then changes of the worst, until something is found or the budget is used up."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from statistics import median, quantiles
from time import process_time

from heavytop.measure.integrator import HEYOKA, MULTIWORD, ChosenIntegrator
from heavytop.precision import Precision
from heavytop.records import OUT_OF_TIME
from heavytop.suite.hunt.draw import Dice, Family, Motion, changed, drawn, is_plain, possible
from heavytop.suite.hunt.measured import Measured, Meter
from heavytop.suite.hunt.proof import Proof, proof
from heavytop.suite.hunt.shrink import Shows, shrunk

FIRST = 64
"""Motions that tell the law of the integrator and what a motion costs."""
DECADES = 100.0
"""Beyond so many times what law and amplification explain, an error is found."""
_POOL = 24
_MOST_FOUND = 3
_MOST_HITS = 16
_SHOWN = 3
_SHARPENED = 6
_LEAST_LAW = 0.05
_LOST = 0.01
"""An error that would be explained up to here says nothing: the format has no digit left."""
_SPARE = 0.8
"""Of a budget in seconds; the rest is for shrinking and proving."""

Advance = Callable[[int, int], None]
"""Told (motions done, motions in all)."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What is hunted.

    budget: motions, or None for ``seconds`` of processor time.  limit: in eps T^1.5, or the ratio to ``against``; None
    for two decades beyond what is explained.  first: motions that are measured before all others.
    """

    integrator: ChosenIntegrator
    precision: Precision
    horizon: Fraction
    family: Family = "any"
    against: ChosenIntegrator | None = None
    limit: float | None = None
    budget: int | None = None
    seconds: float | None = None
    seed: int = 1
    first: tuple[Motion, ...] = ()

    @property
    def unit(self) -> float:
        """eps T^1.5."""
        return float(self.precision.eps) * math.pow(max(float(abs(self.horizon)), 1e-3), 1.5)

    @property
    def other(self) -> ChosenIntegrator:
        """What the errors are shown beside: heyoka, or multiword where heyoka is hunted or lacks the format."""
        if self.against is not None:
            return self.against
        own = self.integrator.name == HEYOKA or self.precision.name == "double-double"
        return ChosenIntegrator(MULTIWORD if own else HEYOKA)


@dataclass(frozen=True, slots=True)
class Hunted:
    """What came of it: found motions, shrunk and worst first; the worst that are explained; motions that were tried.

    law: the error over eps, amplification and √turns that nine tenths of the random tops stay below.
    median: of the errors of random tops.  unknown: motions whose truth was out of reach.  lost: whose amplification
    leaves no digit, so that they say nothing.  proofs: of those found, in their order.
    """

    asked: Asked
    found: tuple[Measured, ...]
    worst: tuple[Measured, ...]
    motions: int
    planned: int
    law: float
    median: float
    unknown: int
    lost: int
    proofs: tuple[Proof, ...] = ()


def hunt(asked: Asked, advance: Advance | None = None) -> Hunted:
    """Search, and shrink what is found.

    Raises InputError and PeerFailed for an integrator that cannot be used at all.
    """
    meter = Meter(asked.integrator, asked.precision, asked.horizon, asked.against)
    try:
        return _Hunt(asked, meter, advance or (lambda done, of: None)).run()
    finally:
        meter.close()


class _Hunt:
    def __init__(self, asked: Asked, meter: Meter, advance: Advance) -> None:
        self.asked, self.meter, self.advance = asked, meter, advance
        self.eps = float(asked.precision.eps)
        self.law = _LEAST_LAW
        self.all: list[Measured] = []
        self.pool: list[Measured] = []
        self.plain: list[Measured] = []
        self.hits: list[Measured] = []
        self.planned = 0

    def run(self) -> Hunted:
        asked = self.asked
        kept = self.meter.measure(asked.first) if asked.first else []
        self._begin()
        self._take(kept)
        index, batch = FIRST, 0
        while not self.hits and self._done() < self.planned:
            count = min(FIRST, self.planned - self._done())
            if batch % 4 < (3 if self._done() < self.planned // 4 else 1):
                motions = [drawn(asked.seed, index + i, asked.family, asked.horizon) for i in range(count)]
                index += count
            else:
                motions = [self._changed(batch, i) for i in range(count)]
            self._take(self.meter.measure(motions))
            batch += 1
            self.advance(self._done(), self.planned)
        done = self._done()
        return self._ended(done, self._shrunk())

    def _begin(self) -> None:
        """The first 64 motions: what they cost, the law of the integrator, and whether they show anything."""
        asked = self.asked
        self.meter.measure([drawn(asked.seed, 0, asked.family, asked.horizon)] * 2)  # what is compiled, is now
        motions = [drawn(asked.seed, i, asked.family, asked.horizon) for i in range(FIRST)]
        if asked.budget is not None:
            motions = motions[: asked.budget]
        began = process_time()
        first = self.meter.measure(motions)
        cost = max(process_time() - began, 1e-6) / len(motions)
        if asked.budget is None:
            assert asked.seconds is not None
            self.planned = max(FIRST, int(_SPARE * asked.seconds / cost)) + len(asked.first)
        else:
            self.planned = asked.budget + len(asked.first)
        plain = [m for i, m in enumerate(first) if is_plain(i) and m.outcome == "success" and not self._is_lost(m)]
        self.plain = plain or [m for m in first if m.outcome == "success"]
        ratios = sorted(m.error / m.explained(self.eps) for m in self.plain)
        if len(ratios) > 1:
            ninth: float = quantiles(ratios, n=10, method="inclusive")[-1]
            self.law = max(_LEAST_LAW, ninth)
        self._take(first)

    def _done(self) -> int:
        return len(self.all)

    def _changed(self, batch: int, place: int) -> Motion:
        seed = f"{self.asked.seed}/change/{batch}/{place}"
        dice = Dice(f"{seed}/which")
        # the worse, the oftener
        one = self.pool[min(dice.below(len(self.pool)), dice.below(len(self.pool)))]
        other = dice.pick(self.pool)
        return changed(one.motion, other.motion, seed, self.asked.family, self.asked.horizon)

    def _take(self, measured: Sequence[Measured]) -> None:
        self.all += measured
        self.pool = sorted([*self.pool, *measured], key=self._score, reverse=True)[:_POOL]
        for each in sorted(measured, key=self._score, reverse=True):
            if len(self.hits) < _MOST_HITS and self.exceeds(each) and self.exceeds(sharp := self.meter.sharper(each)):
                self.hits.append(sharp)

    def _is_lost(self, m: Measured) -> bool:
        return m.explained(self.eps) * max(self.law, 1.0) > _LOST

    def _score(self, m: Measured) -> float:
        """What the search makes large: the error over what is explained, or over that of ``against``."""
        if not m.outcome or (self._is_lost(m) and not math.isinf(m.error)):
            return 0.0
        return m.error / max(self._beside(m), 1e-300)

    def _beside(self, m: Measured) -> float:
        explained = m.explained(self.eps)
        if self.asked.against is None:
            return explained
        return max(m.other or 0.0, _LEAST_LAW * explained)

    def exceeds(self, m: Measured) -> bool:
        """Whether its error is found."""
        if not m.outcome:
            return False
        if math.isinf(m.error):
            return m.other is None or not math.isinf(m.other)
        limit = self.asked.limit
        if self.asked.against is not None:
            return not self._is_lost(m) and m.error > (limit or DECADES) * self._beside(m)
        if limit is not None:
            return m.error > limit * self.asked.unit
        return not self._is_lost(m) and m.error > DECADES * self.law * m.explained(self.eps)

    def _shrunk(self) -> list[Measured]:
        """The worst found, shrunk; of several that shrink to the same one."""
        found: dict[object, Measured] = {}
        worst = sorted(self.hits, key=self._score, reverse=True)[:_MOST_FOUND]
        for hit in worst:
            simple = hit if hit.outcome == OUT_OF_TIME else self._simple(hit)
            found.setdefault(_shape(simple.motion), simple)
        return sorted(found.values(), key=self._score, reverse=True)[:_SHOWN]

    def _simple(self, hit: Measured) -> Measured:
        """The simplest that shows the same; the amplification over all directions is asked at the end, and on the way
        where that did not do.
        """
        for careful in (False, True):
            (again,) = self.meter.measure([shrunk(hit.motion, self._shows(hit, careful))])
            if self._as_bad(again, hit, True):
                return self.meter.sharper(again)
        return hit

    def _shows(self, hit: Measured, careful: bool) -> Shows:
        asked = self.asked

        def shows(motions: Sequence[Motion]) -> list[bool]:
            good = [possible(each, asked.family, asked.horizon) == each for each in motions]
            tried = iter(self.meter.measure([m for m, ok in zip(motions, good, strict=True) if ok]))
            return [ok and self._as_bad(next(tried), hit, careful) for ok in good]

        return shows

    def _as_bad(self, m: Measured, hit: Measured, careful: bool) -> bool:
        """Whether it is found, and in the same way: a failure does not become an error."""
        same = math.isinf(m.error) == math.isinf(hit.error) and self.exceeds(m)
        return same and (not careful or self.exceeds(self.meter.sharper(m)))

    def _ended(self, done: int, found: list[Measured]) -> Hunted:
        good = [m for m in self.all if m.outcome == "success" and not self._is_lost(m)]
        ordered = sorted(good, key=lambda m: m.error, reverse=True)
        sharp = map(self.meter.sharper, list({m.motion: m for m in ordered[:_POOL]}.values())[:_SHARPENED])
        worst = [m for m in sharp if not self._is_lost(m)][:_SHOWN]
        middle = median(m.error for m in self.plain) if self.plain else math.inf
        unknown = sum(not m.outcome for m in self.all)
        lost = sum(bool(m.outcome) and self._is_lost(m) for m in self.all)
        proofs = tuple(proof(self.meter, m, self.asked.other) for m in found)
        return Hunted(
            self.asked, tuple(found), tuple(worst), done, self.planned, self.law, middle, unknown, lost, proofs
        )


def _shape(motion: Motion) -> object:
    """What is the same of motions that differ in the names and senses of their axes alone, or nearly."""
    top, start = motion
    axes = zip(top.inertia, map(abs, top.moment), map(abs, start.omega), map(abs, start.gamma), strict=True)
    return tuple(sorted(axes))
