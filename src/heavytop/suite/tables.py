"""The tables `[[measure]]` of a plan: one kind of measurement each, and the tasks it expands to."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Literal

import msgspec

from heavytop.errors import InputError
from heavytop.integrate import peers
from heavytop.precision import exact, parse, physical, usable_tolerance
from heavytop.suite.cases import Case
from heavytop.suite.starts import GrowthRun, growth_task
from heavytop.suite.task import Task

_MAX_SAMPLES = 1_000_000
Find = Callable[[str], Case]
"""The case of a name; raises InputError for an unknown one."""


class Strict(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind"):
    """A table of a plan; unknown keys are errors.  ``tasks`` raises InputError for an impossible value."""


class ClaimModel(Strict, tag="claim_model"):
    """The claim, exactly evaluated, against the true motion from its own data.

    times: where the series is taken, t > 0; directions: forward, backward.  grid: the parting time is found on a
    uniform grid of that many points up to the last time.
    """

    cases: list[str]
    times: list[str]
    grid: int = 200
    directions: tuple[Literal["forward", "backward"], ...] = ("forward", "backward")

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        times = _positive(self.times, "times")
        grid = [times[-1] * i / self.grid for i in range(1, _samples(self.grid) + 1)]
        every = sorted({*times, *grid})
        return [
            Task(
                "claim_model",
                f"{each.name}/{direction}",
                each,
                "",
                form,
                _signed(every, direction),
                _signed(times, direction),
            )
            for each in map(_claimed, map(find, self.cases))
            for direction in self.directions
            for form in (("smooth", "printed") if direction == "forward" else ("smooth",))
        ]


class ClaimEvaluation(Strict, tag="claim_evaluation"):
    """The printed and the stable formulas, evaluated in a format, against themselves exactly evaluated.

    rate_times: the values of k |t| at which they are evaluated.
    """

    cases: list[str]
    precisions: list[str]
    rate_times: list[str]
    directions: tuple[Literal["forward", "backward"], ...] = ("forward", "backward")

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        times = _positive(self.rate_times, "rate_times")
        return [
            Task(
                "claim_evaluation",
                f"{each.name}/{direction}",
                each,
                parse(name).name,
                form,
                _signed(times, direction),
                _signed(times, direction),
            )
            for each in map(_claimed, map(find, self.cases))
            for name in self.precisions
            for direction in self.directions
            for form in ("printed", "stable")
        ]


class Homoclinic(Strict, tag="homoclinic"):
    """Integrators on a homoclinic motion, against its closed form, until they break away from it.

    samples: samples in one unit of 1/rate.
    """

    cases: list[str]
    precisions: list[str]
    samples: int = 8
    directions: tuple[Literal["forward", "backward"], ...] = ("forward", "backward")

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        tasks = []
        for each in map(find, self.cases):
            spacing = Fraction(round(64 / (_samples(self.samples) * each.rate)) or 1, 64)
            for name in self.precisions:
                precision = parse(name)
                end = (1.1 * precision.bits * math.log(2) + 4) / each.rate
                times = [spacing * i for i in range(1, int(end / spacing) + 1)]
                keep = times[self.samples - 1 :: self.samples]
                tasks += [
                    Task("homoclinic", f"{each.name}/{d}", each, name, "", _signed(times, d), _signed(keep, d))
                    for d in self.directions
                ]
        return tasks


class Audit(Strict, tag="audit"):
    """Every equation of a claim of the paper, proven or refuted, as a motion of each system."""

    claims: list[Literal["ershkov-general", "ershkov-partial"]]
    systems: list[Literal["heavy_top", "gyrostat"]]

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        return [Task("audit", claim, None, "", about) for claim in self.claims for about in self.systems]


class Run(msgspec.Struct, forbid_unknown_fields=True):
    """One format with its horizon; ``samples`` uniform samples."""

    precision: str
    horizon: str
    samples: int = 1000


class Drift(Strict, tag="drift"):
    """Drift of every first integral that holds, over a horizon."""

    cases: list[str]
    runs: list[Run]

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        runs = []
        for run in self.runs:
            (horizon,) = _positive([run.horizon], "horizon")
            count = _samples(run.samples)
            times = tuple(horizon * i / count for i in range(1, count + 1))
            runs.append((parse(run.precision).name, times, tuple(times[i - 1] for i in log_spaced(count))))
        return [
            Task("drift", each.name, each, precision, "", times, keep)
            for each in map(find, self.cases)
            for precision, times, keep in runs
        ]


class LocalError(Strict, tag="local_error"):
    """Error of the single steps that begin before the horizon, and the order of the method as it shows beyond them."""

    cases: list[str]
    precisions: list[str]
    horizon: str

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        times = tuple(_positive([self.horizon], "horizon"))
        return [
            Task("local_error", each.name, each, parse(name).name, "", times)
            for each in map(find, self.cases)
            for name in self.precisions
        ]


class Ladder(msgspec.Struct, forbid_unknown_fields=True):
    """One integrator in one format; ``tolerances``, of which "eps" is the finest it offers, or ``steps`` if fixed."""

    integrator: str
    precision: str = "double"
    tolerances: list[str] = []
    steps: list[str] = []


class WorkPrecision(Strict, tag="work_precision"):
    """Seconds against error: each rung of each ladder over the same horizon; ``samples`` uniform samples."""

    cases: list[str]
    horizon: str
    ladders: list[Ladder]
    samples: int = 100

    def tasks(self, find: Find) -> list[Task]:
        """One a row; raises InputError also for an integrator that is unknown, or built in and not installed."""
        (horizon,) = _positive([self.horizon], "horizon")
        count = _samples(self.samples)
        times = tuple(horizon * i / count for i in range(1, count + 1))
        keep = tuple(times[i - 1] for i in log_spaced(count))
        for ladder in self.ladders:
            peers.require(ladder.integrator)
            if not ladder.tolerances and not ladder.steps:
                raise InputError(f"The ladder of {ladder.integrator} is empty.", "Give it tolerances, or steps.")
            for text in ladder.tolerances + ladder.steps:
                if text != "eps" and not 0 < exact(text) <= 1:
                    raise InputError(f"A tolerance or step of {text[:60]!r}.", "Give numbers above 0, up to 1.")
            if ladder.integrator.partition(":")[0] == "heyoka":
                for text in ladder.tolerances:
                    if text != "eps":
                        usable_tolerance(text, parse(ladder.precision))
        return [
            Task(
                "work_precision",
                f"{each.name}/T={self.horizon}",
                each,
                parse(ladder.precision).name,
                form,
                times,
                keep,
            )
            for each in map(find, self.cases)
            for ladder in self.ladders
            for form in (
                *(f"{ladder.integrator} tolerance={text}" for text in ladder.tolerances),
                *(f"{ladder.integrator} step={text}" for text in ladder.steps),
            )
        ]


class Growth(Strict, tag="growth"):
    """How drift and solution error grow over an ensemble of random starts of each case."""

    cases: list[str]
    runs: list[GrowthRun]

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        return [growth_task(each, run) for each in map(find, self.cases) for run in self.runs]


def log_spaced(count: int, per_decade: int = 8) -> list[int]:
    """About ``per_decade`` whole numbers a decade from 1 to ``count``, both included."""
    wanted = {count}
    i = 0
    while (value := round(10 ** (i / per_decade))) < count:
        wanted.add(value)
        i += 1
    return sorted(wanted)


def _claimed(case: Case) -> Case:
    if case.claim is None:
        raise InputError(f"Nothing is claimed about the case {case.name}.", "Use a case such as ershkov-partial-2.")
    return case


def _positive(texts: list[str], what: str) -> list[Fraction]:
    values = [physical(exact(text), what) for text in texts]
    if not values or values != sorted(set(values)) or values[0] <= 0:
        raise InputError(f"{what} = {texts}", "Give positive numbers in growing order, each once.")
    return values


def _samples(count: int) -> int:
    if not 1 <= count <= _MAX_SAMPLES:
        raise InputError(f"{count} samples cannot be taken.", f"Give a number from 1 to {_MAX_SAMPLES}.")
    return count


def _signed(times: list[Fraction], direction: str) -> tuple[Fraction, ...]:
    return tuple(-time for time in times) if direction == "backward" else tuple(times)


Table = Audit | ClaimModel | ClaimEvaluation | Homoclinic | Drift | LocalError | WorkPrecision | Growth
