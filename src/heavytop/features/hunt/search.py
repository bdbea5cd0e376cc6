"""The search itself: random motions, then changes of the worst, until something is found or the budget is used up."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import product
from math import gcd
from pathlib import Path
from statistics import median, quantiles
from time import process_time
from typing import Any

import msgspec
import numpy
from flint import arb

from heavytop.cases import Case
from heavytop.errors import InputError, invalid
from heavytop.exact.flint.balls import rational, whole_evaluation, working_precision
from heavytop.features.hunt.measured import (
    Dice,
    Family,
    IntegratedRun,
    MeasuredMotion,
    Meter,
    Motion,
    changed,
    class_of,
    drawn,
    is_plain,
    possible,
    with_data,
)
from heavytop.files import replace
from heavytop.harness.case_text import forms, rerun
from heavytop.harness.plan import Top, document_of
from heavytop.integrate.registry import Integrator, described
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.scalar import GUARD_BITS, largest, to_ball
from heavytop.measure.truth import Truth, truth
from heavytop.precision import Precision, decimal_text, shown
from heavytop.records import HEYOKA, MULTIWORD, OUT_OF_TIME
from heavytop.top.amplification import rate
from heavytop.top.equations import GYROSTAT, system_of
from heavytop.top.heavy_top import HeavyTop, State, data_texts

# The simplest data that still show what was found: zeros, equal moments, numbers of few digits.


Shows = Callable[[Sequence[Motion]], list[bool]]
"""Which of the motions show it."""
_MOST_ROUNDS = 12
_TOGETHER = 8
_DIRECTION_NORMS = (1, 2, 3, 5, 7, 9, 11, 13, 15, 17, 25, 33, 51, 65, 99, 201, 301, 451, 651, 901, 999)
_MOST_DENOMINATOR = 31


def digits(value: Fraction) -> int:
    """Significant digits of a number as it is written: 0 of 0, 1 of 5000 and of 1e-8, 2 of 3/2."""
    text = shown(value).lstrip("-").partition("e")[0]
    return sum(len(part.replace(".", "").strip("0")) for part in text.split("/"))


def complexity(motion: Motion) -> tuple[int, int, int]:
    """The measure that shrinking lowers: digits, numbers that are neither 0 nor 1, different numbers and signs."""
    top, start = motion
    values = [*top.inertia, top.weight, *top.centre, *(top.rotor or ()), *start.omega, *start.gamma]
    odd = sum(value not in (0, 1) for value in values)
    sizes = sum(len(shown(value)) for value in values) + sum(value < 0 for value in values)
    return sum(map(digits, values)), odd + len(set(top.inertia)), sizes


def shrunk(motion: Motion, shows: Shows) -> Motion:
    """A motion that shows the same and of which no single change that is tried makes a simpler one that does."""
    for _ in range(_MOST_ROUNDS):
        before = complexity(motion)
        for change in _CHANGES:
            motion = _first(motion, change(motion), shows)
        if complexity(motion) >= before:
            break
    return motion


def _first(motion: Motion, simpler: Iterator[Motion], shows: Shows) -> Motion:
    """The first of those, the simplest first, that is simpler and shows it; else the motion itself."""
    here = complexity(motion)
    waiting = sorted((candidate for candidate in simpler if complexity(candidate) < here), key=complexity)
    for begin in range(0, len(waiting), _TOGETHER):
        group = waiting[begin : begin + _TOGETHER]
        for candidate, good in zip(group, shows(group), strict=True):
            if good:
                return candidate
    return motion


def _of_body(motion: Motion) -> Iterator[Motion]:
    """Whole bodies: small integers in place of the moments, no centre, one along an axis, weight 1."""
    top, start = motion
    for inertia in product((1, 2, 3, 4), repeat=3):
        if 2 * max(inertia) <= sum(inertia):
            yield with_data(top, inertia, top.weight, top.centre), start
            yield with_data(top, inertia, 1, (0, 0, 0)), start
    for axis in range(3):
        centre = [value if i == axis else Fraction(0) for i, value in enumerate(top.centre)]
        yield with_data(top, top.inertia, top.weight, centre), start
        yield with_data(top, top.inertia, 1, [top.weight * value for value in centre]), start


def _of_units(motion: Motion) -> Iterator[Motion]:
    """Other units of mass and length for one motion."""
    top, start = motion
    for unit in {value for value in top.inertia if value != 1}:
        inertia = [value / unit for value in top.inertia]
        yield with_data(top, inertia, top.weight / unit, rotor_times=1 / unit), start
        yield with_data(top, inertia, 1, [top.weight / unit * value for value in top.centre], 1 / unit), start
    yield with_data(top, top.inertia, 1, [top.weight * value for value in top.centre]), start


def _of_start(motion: Motion) -> Iterator[Motion]:
    """Ω none, or along one axis, and γ on the poles."""
    top, start = motion
    for axis in range(3):
        omega = [value if i == axis else Fraction(0) for i, value in enumerate(start.omega)]
        yield top, State(omega, start.gamma)
        for sign in (1, -1):
            pole = [Fraction(sign * (i == axis)) for i in range(3)]
            yield top, State(start.omega, pole)
            yield top, State((0, 0, 0), pole)
            yield with_data(top, top.inertia, 1, pole), State((0, 0, 0), pole)
    yield top, State((0, 0, 0), start.gamma)


def _of_inertia(motion: Motion) -> Iterator[Motion]:
    """One moment, or two together."""
    top, start = motion
    for i, value in enumerate(top.inertia):
        for simple in _simpler(value):
            if simple > 0:
                for also in ((i,), (i, (i + 1) % 3), (i, (i + 2) % 3)):
                    inertia = [simple if k in also else moment for k, moment in enumerate(top.inertia)]
                    if 2 * max(inertia) <= sum(inertia):
                        yield with_data(top, inertia, top.weight, top.centre), start


def _of_number(index: int) -> Callable[[Motion], Iterator[Motion]]:
    """The weight, a component of the centre or of Ω."""

    def change(motion: Motion) -> Iterator[Motion]:
        top, start = motion
        numbers = [top.weight, *top.centre, *start.omega]
        for simple in _simpler(numbers[index]):
            weight, *vectors = _replaced(numbers, index, simple)
            yield with_data(top, top.inertia, weight, vectors[:3]), State(vectors[3:], start.gamma)

    return change


def _replaced(values: Sequence[Fraction], index: int, value: Fraction) -> list[Fraction]:
    return [value if i == index else old for i, old in enumerate(values)]


def _of_rotor(motion: Motion) -> Iterator[Motion]:
    """None of it, or one component simpler."""
    top, start = motion
    if top.rotor is not None:
        yield with_data(top, rotor_times=0), start
        for index, value in enumerate(top.rotor):
            for simple in _simpler(value):
                yield HeavyTop(top.inertia, top.weight, top.centre, _replaced(top.rotor, index, simple)), start


def _of_gamma(motion: Motion) -> Iterator[Motion]:
    """The nearest unit vector of each of some denominators, to three digits."""
    top, start = motion
    table = _directions()
    norms = table[:, 0]
    apart = numpy.abs(table[:, 1:] / table[:, :1] - numpy.array([float(value) for value in start.gamma])).max(axis=1)
    nearest = (int(apart[: int((norms <= most).sum())].argmin()) for most in _DIRECTION_NORMS)
    for axis in dict.fromkeys(nearest):
        norm, *parts = table[axis].tolist()
        yield top, State(start.omega, [Fraction(part, norm) for part in parts])


@cache
def _directions() -> Any:
    """Unit vectors with numerators and denominators of at most three digits: integers, shape (n, 4), each the common
    denominator, in order, and three numerators.
    """
    directions: dict[tuple[int, int, int, int], None] = {}
    for n in range(1, _MOST_DENOMINATOR + 1):
        for a, b in product(range(-n, n + 1), repeat=2):
            norm = n * n + a * a + b * b
            if a * a + b * b <= n * n and norm < 1000:
                u, v, w = 2 * a * n, 2 * b * n, n * n - a * a - b * b
                common = gcd(u, v, w, norm)
                u, v, w, norm = u // common, v // common, w // common, norm // common
                for part in (w, -w):
                    directions |= dict.fromkeys([(norm, u, v, part), (norm, v, part, u), (norm, part, u, v)])
    return numpy.array(sorted(directions, key=lambda entry: entry[0]))


def _simpler(value: Fraction) -> list[Fraction]:
    """Simpler numbers: 0, ±1, integers, halves, fractions and decimals of one, two and three digits."""
    candidates = {Fraction(0), Fraction(1), Fraction(-1), abs(value)}
    if abs(value) < 1000:
        candidates |= {Fraction(round(value) + k) for k in (-1, 0, 1)}
        candidates |= {value.limit_denominator(most) for most in (2, 3, 5, 9, 30, 99)}
    if value:
        candidates |= {Fraction(decimal_text(value, n)) for n in (1, 2, 3)}
        power = Fraction(10) ** len(str(int(abs(value)))) if abs(value) >= 1 else Fraction(1)
        candidates |= {power * (1 if value > 0 else -1), power / 10 * (1 if value > 0 else -1)}
    return [candidate for candidate in candidates if digits(candidate) <= digits(value) and candidate != value]


_CHANGES: tuple[Callable[[Motion], Iterator[Motion]], ...] = (
    _of_body,
    _of_start,
    _of_units,
    _of_gamma,
    _of_inertia,
    *map(_of_number, range(7)),
    _of_rotor,
)


# The error of a found motion, proven: against a closed form or the enclosure, whose balls hold the true motion.


@dataclass(frozen=True, slots=True)
class Proof:
    """The proof of a found motion.

    error: at least so large, where the truth is proven; as computed, where it is not.  other: that of the integrator
    that it is shown beside; None where that is unknown.  against: how the true motion is known.
    proven: whether by a theorem.
    """

    error: float
    other: float | None
    against: str
    proven: bool


def proof(meter: Meter, motion: MeasuredMotion, other: Integrator) -> Proof:
    """The error of a found motion and of ``other`` on it, against the best that is known of it.

    Raises Contradiction where two proofs exclude each other.
    """
    problem = Problem.of(*motion.motion, meter.precision, system_of(None, motion.motion[0]))
    known = truth(problem, meter.times)
    runs = [meter.run_of(integrator, motion.motion) for integrator in (meter.integrator, other)]
    if isinstance(known, str):
        return Proof(motion.error, None, f"nothing: {known}", False)
    errors = [_distance(problem, known, meter, run) for run in runs]
    return Proof(errors[0], errors[1], known.against.text, known.against.how == "proven")


@whole_evaluation
def _distance(problem: Problem, known: Truth, meter: Meter, run: IntegratedRun) -> float:
    """max(|δΩ|/rate, |δγ|) over the samples, at least; infinite of a run that was aborted."""
    if run.outcome != Outcome.SUCCESS.value:
        return math.inf
    bits = problem.precision.bits + GUARD_BITS
    unit = rate(problem.system, problem.parameters, problem.start.flat) or 1
    distance = 0.0
    with working_precision(bits):
        for time, state in zip(meter.times, run.states, strict=True):
            if not known.covers(time):
                break
            try:
                apart = [to_ball(a) - b for a, b in zip(state[:6], known.state(time, bits), strict=True)]
            except (ValueError, TypeError, ArithmeticError):
                return math.inf
            if not all(distance.is_finite() for distance in apart):
                return math.inf
            scaled: arb = largest((largest(apart[:3]) / rational(unit), largest(apart[3:])))
            distance = max(distance, float(scaled.abs_lower()))
    return distance


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
"""An error that would be explained up to here says nothing: the format has lost all significant digits."""
_SPARE = 0.8
"""Part of a budget in seconds; the rest is for shrinking and proving."""

Advance = Callable[[int, int], None]
"""Told (motions done, motions in all)."""


@dataclass(frozen=True, slots=True)
class Asked:
    """A search to be made.

    budget: motions, or None for ``seconds`` of processor time.  limit: in eps T^1.5, or the ratio to ``against``; None
    for two decades beyond what is explained.  first: motions that are measured before all others.
    """

    integrator: Integrator
    precision: Precision
    horizon: Fraction
    family: Family = "any"
    against: Integrator | None = None
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
    def other(self) -> Integrator:
        """The integrator shown beside: heyoka, or multiword where heyoka is hunted or lacks the format."""
        if self.against is not None:
            return self.against
        own = self.integrator.name == HEYOKA or self.precision.name == "double-double"
        return described(MULTIWORD if own else HEYOKA)


@dataclass(frozen=True, slots=True)
class Hunted:
    """The result of a search: found motions, shrunk and worst first; the worst that are explained; motions tried.

    law: the error over eps, amplification and √turns that nine tenths of the random tops stay below.
    median: of the errors of random tops.  unknown: motions whose truth was out of reach.  lost: whose amplification
    leaves no digit, so that they say nothing.  proofs: of those found, in their order.
    """

    asked: Asked
    found: tuple[MeasuredMotion, ...]
    worst: tuple[MeasuredMotion, ...]
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
        self.all: list[MeasuredMotion] = []
        self.pool: list[MeasuredMotion] = []
        self.plain: list[MeasuredMotion] = []
        self.hits: list[MeasuredMotion] = []
        self.planned = 0

    def run(self) -> Hunted:
        asked = self.asked
        kept = self.meter.measure(asked.first) if asked.first else []
        self._begin()
        self._take(kept)
        index, batch = FIRST, 0
        while not self.hits and (done := len(self.all)) < self.planned:
            count = min(FIRST, self.planned - done)
            if batch % 4 < (3 if done < self.planned // 4 else 1):
                motions = [drawn(asked.seed, index + i, asked.family, asked.horizon) for i in range(count)]
                index += count
            else:
                motions = [self._changed(batch, i) for i in range(count)]
            self._take(self.meter.measure(motions))
            batch += 1
            self.advance(len(self.all), self.planned)
        return self._ended(len(self.all), self._shrunk())

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

    def _changed(self, batch: int, index: int) -> Motion:
        seed = f"{self.asked.seed}/change/{batch}/{index}"
        dice = Dice(f"{seed}/which")
        # the worse, the oftener
        one = self.pool[min(dice.below(len(self.pool)), dice.below(len(self.pool)))]
        other = dice.pick(self.pool)
        return changed(one.motion, other.motion, seed, self.asked.family, self.asked.horizon)

    def _take(self, measured: Sequence[MeasuredMotion]) -> None:
        self.all += measured
        self.pool = sorted([*self.pool, *measured], key=self._score, reverse=True)[:_POOL]
        for motion in sorted(measured, key=self._score, reverse=True):
            if (
                len(self.hits) < _MOST_HITS
                and self.exceeds(motion)
                and self.exceeds(sharp := self.meter.sharper(motion))
            ):
                self.hits.append(sharp)

    def _is_lost(self, m: MeasuredMotion) -> bool:
        return m.explained(self.eps) * max(self.law, 1.0) > _LOST

    def _score(self, m: MeasuredMotion) -> float:
        """The measure that the search makes large: the error over what is explained, or over that of ``against``."""
        if not m.outcome or (self._is_lost(m) and not math.isinf(m.error)):
            return 0.0
        return m.error / max(self._beside(m), 1e-300)

    def _beside(self, m: MeasuredMotion) -> float:
        explained = m.explained(self.eps)
        if self.asked.against is None:
            return explained
        return max(m.other or 0.0, _LEAST_LAW * explained)

    def exceeds(self, m: MeasuredMotion) -> bool:
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

    def _shrunk(self) -> list[MeasuredMotion]:
        """The worst found, shrunk; of several that shrink to the same one."""
        simplest: dict[object, MeasuredMotion] = {}
        worst = sorted(self.hits, key=self._score, reverse=True)[:_MOST_FOUND]
        for hit in worst:
            simple = hit if hit.outcome == OUT_OF_TIME else self._simple(hit)
            simplest.setdefault(_shape(simple.motion), simple)
        return sorted(simplest.values(), key=self._score, reverse=True)[:_SHOWN]

    def _simple(self, hit: MeasuredMotion) -> MeasuredMotion:
        """The simplest that shows the same; the amplification over all directions is asked at the end, and on the way
        where that did not do.
        """
        for careful in (False, True):
            (again,) = self.meter.measure([shrunk(hit.motion, self._shows(hit, careful))])
            if self._as_bad(again, hit, True):
                return self.meter.sharper(again)
        return hit

    def _shows(self, hit: MeasuredMotion, careful: bool) -> Shows:
        asked = self.asked

        def shows(motions: Sequence[Motion]) -> list[bool]:
            good = [possible(motion, asked.family, asked.horizon) == motion for motion in motions]
            tried = iter(self.meter.measure([m for m, ok in zip(motions, good, strict=True) if ok]))
            return [ok and self._as_bad(next(tried), hit, careful) for ok in good]

        return shows

    def _as_bad(self, m: MeasuredMotion, hit: MeasuredMotion, careful: bool) -> bool:
        """Whether it is found, and in the same way: a failure does not become an error."""
        same = math.isinf(m.error) == math.isinf(hit.error) and self.exceeds(m)
        return same and (not careful or self.exceeds(self.meter.sharper(m)))

    def _ended(self, done: int, motions: list[MeasuredMotion]) -> Hunted:
        good = [m for m in self.all if m.outcome == "success" and not self._is_lost(m)]
        ordered = sorted(good, key=lambda m: m.error, reverse=True)
        sharp = map(self.meter.sharper, list({m.motion: m for m in ordered[:_POOL]}.values())[:_SHARPENED])
        worst = [m for m in sharp if not self._is_lost(m)][:_SHOWN]
        middle = median(m.error for m in self.plain) if self.plain else math.inf
        unknown = sum(not m.outcome for m in self.all)
        lost = sum(bool(m.outcome) and self._is_lost(m) for m in self.all)
        proofs = tuple(proof(self.meter, m, self.asked.other) for m in motions)
        return Hunted(
            self.asked, tuple(motions), tuple(worst), done, self.planned, self.law, middle, unknown, lost, proofs
        )


def _shape(motion: Motion) -> object:
    """A key that motions share which differ in the names and senses of their axes alone, or nearly."""
    top, start = motion
    vectors = (top.moment, top.rotor or (Fraction(0),) * 3, start.omega, start.gamma)
    axes = zip(top.inertia, *(map(abs, vector) for vector in vectors), strict=True)
    return tuple(sorted(axes))


# What a hunt found as texts: data, class, command and table of a plan; and the file that keeps it.


_PASTE = "It holds [[top]] tables, as heavytop hunt prints them."


def documents(hunted: Hunted, integrator: str) -> list[dict[str, Any]]:
    """Each motion found, worst first, by the keys of `hunt --json`; integrator: as the user named it."""
    asked, entries = hunted.asked, []
    eps = float(asked.precision.eps)
    for number, (m, proven) in enumerate(zip(hunted.found, hunted.proofs, strict=True), 1):
        case = case_of(m.motion, number)
        more = {
            "system": case.system.name,
            "digits_lost": digits_lost(proven.error, eps),
            "ratio": ratio(proven.error, proven.other, eps),
            "outcome": m.outcome,
            "class": class_of(*m.motion),
            "command": command_of(asked, m.motion, integrator, math.isinf(m.error)),
            "toml": forms(case)["toml"],
        }
        entries.append({**data_texts(*m.motion), **more})
    return entries


def digits_lost(error: float, eps: float) -> float:
    """Decimal digits of the format that an error costs: all of them without a result."""
    if math.isinf(error):
        return round(-math.log10(eps), 1)
    return round(min(max(math.log10(max(error, eps) / eps), 0.0), -math.log10(eps)), 1)


def ratio(error: float, other: float | None, eps: float) -> float | None:
    """The error over that of another integrator on the same motion, which counts as eps at least; None where one came
    to nothing.
    """
    if other is None or math.isinf(error) or math.isinf(other):
        return None
    return float(f"{error / max(other, eps):.3g}")


def case_of(motion: Motion, number: int) -> Case:
    """The motion as a case."""
    return Case(f"hunted-{number}", "found by a hunt", system_of(None, motion[0]), *motion)


def command_of(asked: Asked, motion: Motion, integrator: str, failed: bool) -> str:
    """The command that shows it again: the digits that are right, or how the run ends."""
    times = [asked.horizon * i / 10 for i in range(1, 11)]
    return rerun(case_of(motion, 1), times, asked.precision.name, integrator, reached=not failed)


def kept(path: Path) -> tuple[Motion, ...]:
    """The motions that a file keeps, none before the file exists; raises InputError for any other file."""
    try:
        document = document_of(path.read_text("utf-8"))
        if document.keys() - {"top"}:
            raise msgspec.ValidationError(f"unknown key {min(document.keys() - {'top'})}")
        cases = [top.case() for top in msgspec.convert(document.get("top", []), list[Top])]
    except FileNotFoundError:
        return ()
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path} cannot be read: {invalid(error)}.", _PASTE) from None
    if any(case.system is GYROSTAT for case in cases):
        raise InputError(
            f"{path} holds a top of the system gyrostat.", "Take it out: heavy tops and heavy gyrostats are hunted."
        )
    return tuple((case.top, case.start) for case in cases)


def keep(path: Path, motions: Sequence[Motion]) -> None:
    """Add motions to the file that are not in it; raises InputError where it cannot be written."""
    before = kept(path)
    every = dict.fromkeys([*map(_plain, before), *map(_plain, motions)])
    if len(every) == len(before):
        return
    tables = [forms(case_of(motion, i))["toml"] for i, motion in enumerate(every, 1)]
    try:
        replace(path, ("\n\n".join(tables) + "\n").encode())
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}.", "Give a file that can be.") from None


def _plain(motion: Motion) -> Motion:
    top, start = motion
    return HeavyTop(top.inertia, top.weight, top.centre, top.rotor), start
