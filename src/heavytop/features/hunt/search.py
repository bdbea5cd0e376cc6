"""The search: random motions, then changes of the worst, until something is found or the budget is used up."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter
from typing import Any

import msgspec
from flint import arb

from heavytop.cases import Case
from heavytop.errors import InputError, invalid, refusal
from heavytop.exact.flint.balls import rational, whole_evaluation, working_precision
from heavytop.features.hunt.measured import (
    FAMILIES,
    ROUNDINGS,
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
from heavytop.integrate.registry import Integrator, described, require
from heavytop.integrate.trajectory import Outcome, Problem
from heavytop.measure.scalar import GUARD_BITS, largest, to_ball
from heavytop.measure.truth import Truth, truth
from heavytop.precision import DOUBLE_DOUBLE, Precision, decimal_text, shown
from heavytop.records import HEYOKA, MULTIWORD, OUT_OF_TIME
from heavytop.top.amplification import rate
from heavytop.top.equations import GYROSTAT, system_of
from heavytop.top.heavy_top import HeavyTop, State, data_texts

# Shrinking: the simplest data that still show the fault, with zeros, equal moments and numbers of few digits.


Shows = Callable[[Sequence[Motion]], list[bool]]
"""Whether each of the motions shows the fault."""
_MOST_ROUNDS = 12
_TOGETHER = 8
_DENOMINATORS = range(1, 28)
_EXACT = 61
"""Characters of a fraction of two numbers below 2^100."""


def digits(value: Fraction) -> int:
    """The significant digits that a number is written with: 0 of 0, 1 of 5000 and of 1e-8, 2 of 3/2."""
    text = shown(value, _EXACT).lstrip("-").partition("e")[0]
    return sum(len(part.replace(".", "").strip("0")) for part in text.split("/"))


def complexity(motion: Motion) -> tuple[int, int, int]:
    """The measure that shrinking lowers: digits; numbers other than 0 and 1, different moments; lengths and signs."""
    top, start = motion
    values = [*top.inertia, top.weight, *top.centre, *(top.rotor or ()), *start.omega, *start.gamma]
    numbers = sum(value not in (0, 1) for value in values)
    lengths = sum(len(shown(value, _EXACT)) for value in values) + sum(value < 0 for value in values)
    return sum(map(digits, values)), numbers + len(set(top.inertia)), lengths


def shrunk(motion: Motion, shows: Shows) -> Motion:
    """A motion that shows the same fault and that no single change makes simpler without losing it."""
    for _ in range(_MOST_ROUNDS):
        before = complexity(motion)
        for change in _CHANGES:
            motion = _first_that_shows(motion, change(motion), shows)
        if complexity(motion) >= before:
            break
    return motion


def _first_that_shows(motion: Motion, candidates: Iterator[Motion], shows: Shows) -> Motion:
    """The simplest candidate that is simpler than the motion and shows the fault; else the motion itself."""
    limit = complexity(motion)
    simpler = sorted((candidate for candidate in candidates if complexity(candidate) < limit), key=complexity)
    for begin in range(0, len(simpler), _TOGETHER):
        group = simpler[begin : begin + _TOGETHER]
        if (shown_by := shows(group)) and any(shown_by):
            return group[shown_by.index(True)]
    return motion


def _simpler_bodies(motion: Motion) -> Iterator[Motion]:
    """Bodies with small integers as moments, without a centre, with one along an axis, with weight 1."""
    top, start = motion
    for inertia in product((1, 2, 3, 4), repeat=3):
        if 2 * max(inertia) <= sum(inertia):
            yield with_data(top, inertia, top.weight, top.centre), start
            yield with_data(top, inertia, 1, (0, 0, 0)), start
    for axis in range(3):
        centre = [value if i == axis else Fraction(0) for i, value in enumerate(top.centre)]
        yield with_data(top, top.inertia, top.weight, centre), start
        yield with_data(top, top.inertia, 1, [top.weight * value for value in centre]), start


def _other_units(motion: Motion) -> Iterator[Motion]:
    """The motion in other units of mass and length."""
    top, start = motion
    for unit in {value for value in top.inertia if value != 1}:
        inertia = [value / unit for value in top.inertia]
        yield with_data(top, inertia, top.weight / unit, rotor_times=1 / unit), start
        yield with_data(top, inertia, 1, [top.weight / unit * value for value in top.centre], 1 / unit), start
    yield with_data(top, top.inertia, 1, [top.weight * value for value in top.centre]), start


def _simpler_starts(motion: Motion) -> Iterator[Motion]:
    """Starts with Ω = 0 or along one axis, and with γ at a pole."""
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


def _simpler_data(places: Sequence[int], motion: Motion) -> Iterator[Motion]:
    """Motions with a simpler number in one of these places of (I, P, r, Ω, rotor), or for two moments at once."""
    top, start = motion
    numbers = [*top.inertia, top.weight, *top.centre, *start.omega, *(top.rotor or ())]
    for place in (place for place in places if place < len(numbers)):
        groups = [(place, (place + k) % 3) for k in range(3)] if place < 3 else [(place,)]
        for simple, group in product(_simpler_numbers(numbers[place]), groups):
            changed = [simple if k in group else value for k, value in enumerate(numbers)]
            inertia, omega = changed[:3], changed[7:10]
            if min(inertia) > 0 and 2 * max(inertia) <= sum(inertia):
                yield HeavyTop(inertia, changed[3], changed[4:7], changed[10:] or None), State(omega, start.gamma)


def _near_directions(motion: Motion) -> Iterator[Motion]:
    """Starts with γ at rational points of the unit sphere, each nearer than all of smaller denominators."""
    top, start = motion
    points: dict[tuple[Fraction, ...], int] = {}
    for n, axis in product(_DENOMINATORS, range(3)):  # stereographic, from the poles of each axis
        w, u, v = start.gamma[axis:] + start.gamma[:axis]
        a, b = (round(n * part / (1 + abs(w))) for part in (u, v))
        norm = n * n + a * a + b * b
        near = [Fraction(part, norm) for part in ((2 * n * n - norm) * (1 if w > 0 else -1), 2 * a * n, 2 * b * n)]
        points[*near[3 - axis :], *near[: 3 - axis]] = max(part.denominator for part in near)
    nearest = Fraction(2)
    for gamma in sorted(points, key=points.__getitem__):
        if (distance := max(abs(a - b) for a, b in zip(gamma, start.gamma, strict=True))) < nearest:
            nearest = distance
            yield top, State(start.omega, gamma)


def _simpler_numbers(value: Fraction) -> list[Fraction]:
    """Simpler numbers near the value: 0, ±1, integers, small fractions, decimals of one, two and three digits."""
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
    _simpler_bodies,
    _simpler_starts,
    _other_units,
    _near_directions,
    partial(_simpler_data, range(3)),
    *(partial(_simpler_data, [place]) for place in range(3, 10)),
    partial(_simpler_data, range(10, 13)),
)


# The proven error of a finding: against a closed form or the enclosure, whose balls contain the true motion.


@dataclass(frozen=True, slots=True)
class Proof:
    """The error of a finding against the best known true motion.

    error: a lower bound where the true motion is proven, else the computed error.  other: the same for the integrator
    shown with it; None where that is unknown.  against: how the true motion is known.  proven: whether by a theorem.
    """

    error: float
    other: float | None
    against: str
    proven: bool


def proof(meter: Meter, motion: MeasuredMotion, other: Integrator) -> Proof:
    """The errors of the hunted integrator and of ``other`` on a finding.

    Raises Contradiction where two proofs exclude each other.
    """
    problem = meter.problem(motion.motion)
    known = truth(problem, meter.times)
    runs = [meter.run_of(integrator, motion.motion) for integrator in (meter.integrator, other)]
    if isinstance(known, str):
        return Proof(motion.error, None, f"nothing: {known}", False)
    errors = [_distance(problem, known, meter, run) for run in runs]
    return Proof(errors[0], errors[1], known.against.text, known.against.how == "proven")


@whole_evaluation
def _distance(problem: Problem, known: Truth, meter: Meter, run: IntegratedRun) -> float:
    """A lower bound of max(|δΩ|/rate, |δγ|) over the samples; infinite for a run that was aborted."""
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
                differences = [to_ball(a) - b for a, b in zip(state[:6], known.state(time, bits), strict=True)]
            except (ValueError, TypeError, ArithmeticError):
                return math.inf
            if not all(difference.is_finite() for difference in differences):
                return math.inf
            scaled: arb = largest((largest(differences[:3]) / rational(unit), largest(differences[3:])))
            distance = max(distance, float(scaled.abs_lower()))
    return distance


FIRST = 64
"""The number of motions that the law of the integrator and the cost of a motion are measured on."""
DECADES = 100.0
"""An error that is so many times what law and amplification explain is a finding."""
_POOL = 24
_MOST, _MOST_SEED = 1_000_000, 10**9
_MOST_FOUND = 3
_MOST_HITS = 16
_SHOWN = 3
_SHARPENED = 6
"""Motions of one class whose amplification is computed over all directions, to show one that is not lost."""
_LEAST_LAW = 0.05
_LOST = 0.01
"""Where an error of this size would be explained, the format has lost all significant digits."""
_SPARE = 0.8
"""The part of a budget in seconds for searching; the rest is for shrinking and proving."""

Advance = Callable[[int, int], None]
"""A function of (motions done, motions in all)."""


@dataclass(frozen=True, slots=True)
class HuntRequest:
    """The settings of a search; raises InputError for impossible ones.

    budget: motions, or None for ``seconds`` of processor time.  limit: in eps T^1.5, or the ratio to ``against``; None
    for two decades above the expected error.  first: motions that are measured before all others.
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

    def __post_init__(self) -> None:
        rules = {
            "family": (self.family, self.family in FAMILIES, f"one of {', '.join(FAMILIES)}", "any"),
            "horizon": (self.horizon, self.horizon != 0, "a time other than 0", 100),
            "budget": (self.budget, self.budget is None or 1 <= self.budget <= _MOST, f"1 to {_MOST} motions", 1000),
            "limit": (self.limit, self.limit is None or self.limit > 0, "positive", 100),
            "seed": (self.seed, 0 <= self.seed <= _MOST_SEED, f"from 0 to {_MOST_SEED}", 1),
        }
        for name, (value, holds, rule, example) in rules.items():
            if not holds:
                raise refusal(name, rule, value, f"Give, for example, {example}.")
        if self.integrator.name == HEYOKA and self.precision == DOUBLE_DOUBLE:
            raise InputError("heyoka does not support double-double.", "Use multiword, or another format.")
        if self.against == self.integrator:
            raise InputError("integrator and against must differ.", "Give another one, or leave out against.")
        if self.against is not None:
            require(self.against)

    @property
    def unit(self) -> float:
        """eps T^1.5."""
        return float(self.precision.eps) * math.pow(max(float(abs(self.horizon)), 1e-3), 1.5)

    @property
    def other(self) -> Integrator:
        """The integrator shown with it: heyoka, or multiword where heyoka is hunted or lacks the format."""
        if self.against is not None:
            return self.against
        no_heyoka = self.integrator.name == HEYOKA or self.precision == DOUBLE_DOUBLE
        return described(MULTIWORD if no_heyoka else HEYOKA)


@dataclass(frozen=True, slots=True)
class Hunted:
    """The result of a search: the findings, shrunk and worst first; of each class the motion nearest to a finding.

    motions: how many were tried, of ``planned``.
    law: the error over eps, amplification and √turns that nine tenths of the random tops stay below.
    median: of the errors of random tops.  unknown: the number of motions whose reference was out of reach.
    lost: the number of motions whose amplification leaves no digit.  proofs: of the findings, in their order.
    """

    request: HuntRequest
    found: tuple[MeasuredMotion, ...]
    worst: tuple[MeasuredMotion, ...]
    motions: int
    planned: int
    law: float
    median: float
    unknown: int
    lost: int
    proofs: tuple[Proof, ...] = ()

    @property
    def law_text(self) -> str:
        """The law of the errors of this integrator."""
        fixed = any(m.order for m in (*self.worst, *self.found))
        truncation = f"({ROUNDINGS} eps T/h + rate T (rate h)^order)"
        return f"{self.law:.2g} A {truncation}" if fixed else f"{self.law:.2g} eps A √(1 + rate T)"


def hunt(request: HuntRequest, advance: Advance | None = None) -> Hunted:
    """Search, and shrink the findings.

    Raises InputError and PeerFailed for an integrator that cannot be used at all.
    """
    meter = Meter(request.integrator, request.precision, request.horizon, request.against)
    try:
        return _Hunt(request, meter, advance or (lambda done, of: None)).run()
    finally:
        meter.close()


class _Hunt:
    """The state of a search: all motions measured, the worst of them (pool), plain random tops, findings (hits)."""

    def __init__(self, request: HuntRequest, meter: Meter, advance: Advance) -> None:
        self.request, self.meter, self.advance = request, meter, advance
        self.eps = float(request.precision.eps)
        self.law = _LEAST_LAW
        self.measured: list[MeasuredMotion] = []
        self.pool: list[MeasuredMotion] = []
        self.plain: list[MeasuredMotion] = []
        self.hits: list[MeasuredMotion] = []
        self.planned = 0

    def run(self) -> Hunted:
        request = self.request
        first = self.meter.measure(request.first)
        self._begin()
        self._add(first)
        index, batch = FIRST, 0
        while not self.hits and (done := len(self.measured)) < self.planned:
            count = min(FIRST, self.planned - done)
            if batch % 4 < (3 if done < self.planned // 4 else 1):
                motions = list(map(self._drawn, range(index, index + count)))
                index += count
            else:
                motions = [self._changed(batch, i) for i in range(count)]
            self._add(self.meter.measure(motions))
            batch += 1
            self.advance(len(self.measured), self.planned)
        done = len(self.measured)
        return self._result(done, self._shrunk())

    def _drawn(self, index: int) -> Motion:
        return drawn(self.request.seed, index, self.request.family, self.request.horizon)

    def _begin(self) -> None:
        """Measures the first 64 motions: their cost, and the law of the integrator."""
        request = self.request
        self.meter.measure([self._drawn(0)] * 2)  # compilation takes no time of a motion
        motions = list(map(self._drawn, range(FIRST)))[: request.budget]
        began = perf_counter()
        first = self.meter.measure(motions)
        cost = max(perf_counter() - began, 1e-6) / len(motions)
        budget = request.budget
        if budget is None:
            assert request.seconds is not None
            budget = max(FIRST, int(_SPARE * request.seconds / cost))
        self.planned = budget + len(request.first)
        plain = [m for i, m in enumerate(first) if is_plain(i) and m.outcome == "success" and not self._is_lost(m)]
        self.plain = plain or [m for m in first if m.outcome == "success"]
        ratios = sorted(m.error / m.explained(self.eps) for m in self.plain)
        if len(ratios) > 1:
            ninth: float = quantiles(ratios, n=10, method="inclusive")[-1]
            self.law = max(_LEAST_LAW, ninth)
        self._add(first)

    def _changed(self, batch: int, index: int) -> Motion:
        """A change of one of the worst motions: the worse it is, the more often it is chosen."""
        seed = f"{self.request.seed}/change/{batch}/{index}"
        dice = Dice(f"{seed}/which")
        parent = self.pool[min(dice.below(len(self.pool)), dice.below(len(self.pool)))]
        donor = dice.pick(self.pool)
        return changed(parent.motion, donor.motion, seed, self.request.family, self.request.horizon)

    def _add(self, measured: Sequence[MeasuredMotion]) -> None:
        self.measured += measured
        self.pool = sorted([*self.pool, *measured], key=self._score, reverse=True)[:_POOL]
        for motion in sorted(measured, key=self._score, reverse=True):
            if (
                len(self.hits) < _MOST_HITS
                and self.exceeds(motion)
                and self.exceeds(sharp := self.meter.sharper(motion))
            ):
                self.hits.append(sharp)

    def _is_lost(self, m: MeasuredMotion) -> bool:
        return m.rounding(self.eps) * max(self.law, 1.0) > _LOST

    def _score(self, m: MeasuredMotion) -> float:
        """The measure that the search increases: the error over the expected one, or over that of ``against``."""
        if not m.outcome or (self._is_lost(m) and not math.isinf(m.error)):
            return 0.0
        return m.error / max(self._compared_error(m), 1e-300)

    def _compared_error(self, m: MeasuredMotion) -> float:
        explained = m.explained(self.eps)
        if self.request.against is None:
            return explained
        return max(m.other or 0.0, _LEAST_LAW * explained)

    def exceeds(self, m: MeasuredMotion) -> bool:
        """Whether the motion is a finding."""
        limit = self.request.limit
        too_long = m.order and m.turns > m.steps  # a step of more than a radian may be unstable
        if not m.outcome or (too_long and limit is None and self.request.against is None):
            return False
        if math.isinf(m.error):
            return m.other is None or not math.isinf(m.other)
        if self.request.against is not None:
            return not self._is_lost(m) and m.error > (limit or DECADES) * self._compared_error(m)
        if limit is not None:
            return m.error > limit * self.request.unit
        return not self._is_lost(m) and m.error > DECADES * self.law * m.explained(self.eps)

    def _shrunk(self) -> list[MeasuredMotion]:
        """The worst findings, shrunk; one of those that shrink to the same motion."""
        simplest: dict[object, MeasuredMotion] = {}
        for hit in sorted(self.hits, key=self._score, reverse=True)[:_MOST_FOUND]:
            simple = hit if hit.outcome == OUT_OF_TIME else self._simple(hit)
            simplest.setdefault(_shape(simple.motion), simple)
        return sorted(simplest.values(), key=self._score, reverse=True)[:_SHOWN]

    def _simple(self, hit: MeasuredMotion) -> MeasuredMotion:
        """The simplest motion that shows the same fault.

        The amplification over all directions is computed for the result alone, and for each step where that fails.
        """
        for careful in (False, True):
            (again,) = self.meter.measure([shrunk(hit.motion, self._shows(hit, careful))])
            if self._as_bad(again, hit, True):
                return self.meter.sharper(again)
        return hit

    def _shows(self, hit: MeasuredMotion, careful: bool) -> Shows:
        request = self.request

        def shows(motions: Sequence[Motion]) -> list[bool]:
            valid = [m for m in motions if possible(m, request.family, request.horizon) == m]
            bad = [m.motion for m in self.meter.measure(valid) if self._as_bad(m, hit, careful)]
            return [motion in bad for motion in motions]

        return shows

    def _as_bad(self, m: MeasuredMotion, hit: MeasuredMotion, careful: bool) -> bool:
        """Whether it is a finding of the same kind: a failure, or an error."""
        same = math.isinf(m.error) == math.isinf(hit.error) and self.exceeds(m)
        return same and (not careful or self.exceeds(self.meter.sharper(m)))

    def _result(self, done: int, motions: list[MeasuredMotion]) -> Hunted:
        good = [m for m in self.measured if m.outcome == "success" and not self._is_lost(m)]
        worst, sharpened = dict[str, MeasuredMotion](), Counter[str]()
        for m in sorted(good, key=self._score, reverse=True):
            if len(worst) == _SHOWN:
                break
            if (kind := class_of(*m.motion)) not in worst and sharpened[kind] < _SHARPENED:
                sharpened[kind] += 1
                if not self._is_lost(sharp := self.meter.sharper(m)):
                    worst[kind] = sharp
        nearest = sorted(worst.values(), key=self._score, reverse=True)
        middle = median(m.error for m in self.plain) if self.plain else math.inf
        unknown = sum(not m.outcome for m in self.measured)
        lost = sum(bool(m.outcome) and self._is_lost(m) for m in self.measured)
        proofs = tuple(proof(self.meter, m, self.request.other) for m in motions)
        return Hunted(
            self.request, tuple(motions), tuple(nearest), done, self.planned, self.law, middle, unknown, lost, proofs
        )


def _shape(motion: Motion) -> object:
    """A key of motions that differ in the order and signs of their axes alone, or nearly."""
    top, start = motion
    vectors = (top.moment, top.rotor or (Fraction(0),) * 3, start.omega, start.gamma)
    axes = zip(top.inertia, *(map(abs, vector) for vector in vectors), strict=True)
    return tuple(sorted(axes))


# The findings of a hunt as texts: data, class, command and table of a plan; and the file of findings.


_PASTE = "Give [[top]] tables, as heavytop hunt prints them."


def documents(hunted: Hunted, integrator: str) -> list[dict[str, Any]]:
    """The findings, worst first, by the keys of `hunt --json`; integrator: as the user named it."""
    request, entries = hunted.request, []
    eps = float(request.precision.eps)
    for number, (m, proven) in enumerate(zip(hunted.found, hunted.proofs, strict=True), 1):
        case = case_of(m.motion, number)
        document = {
            **data_texts(*m.motion),
            "system": case.system.name,
            "digits_lost": digits_lost(proven.error, eps),
            "ratio": ratio(proven.error, proven.other, eps),
            "outcome": m.outcome,
            "class": class_of(*m.motion),
            "command": command_of(request, m.motion, integrator, math.isinf(m.error)),
            "toml": forms(case)["toml"],
        }
        entries.append(document)
    return entries


def digits_lost(error: float, eps: float) -> float:
    """Decimal digits of the format that an error costs: all of them for an infinite one."""
    if math.isinf(error):
        return round(-math.log10(eps), 1)
    return round(min(max(math.log10(max(error, eps) / eps), 0.0), -math.log10(eps)), 1)


def ratio(error: float, other: float | None, eps: float) -> float | None:
    """The error over that of another integrator on the same motion, or over eps where that is larger.

    None where one of them is unknown or infinite.
    """
    if other is None or math.isinf(error) or math.isinf(other):
        return None
    return float(f"{error / max(other, eps):.3g}")


def case_of(motion: Motion, number: int) -> Case:
    """The motion as a case."""
    return Case(f"hunted-{number}", "found by a hunt", system_of(None, motion[0]), *motion)


def command_of(request: HuntRequest, motion: Motion, integrator: str, failed: bool) -> str:
    """The command that shows a finding again: the correct digits, or how the run ends."""
    times = [request.horizon * i / 10 for i in range(1, 11)]
    return rerun(case_of(motion, 1), times, request.precision.name, integrator, reached=not failed)


def kept(path: Path) -> tuple[Motion, ...]:
    """The motions in a file of findings, none before the file exists; raises InputError for any other file."""
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
        raise InputError(f"{path} contains a gyrostat.", "Remove it: only heavy_top and heavy_gyrostat are supported.")
    return tuple((case.top, case.start) for case in cases)


def keep(path: Path, motions: Sequence[Motion]) -> None:
    """Add new motions to a file of findings; raises InputError where it cannot be written."""
    known = kept(path)
    every = dict.fromkeys(map(_without_mass, [*known, *motions]))
    if len(every) == len(known):
        return
    tables = [forms(case_of(motion, i))["toml"] for i, motion in enumerate(every, 1)]
    replace(path, ("\n\n".join(tables) + "\n").encode())


def _without_mass(motion: Motion) -> Motion:
    top, start = motion
    return HeavyTop(top.inertia, top.weight, top.centre, top.rotor), start
