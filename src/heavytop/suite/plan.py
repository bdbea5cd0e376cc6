"""Plans: what is run, written in TOML, and the single measurements they expand to."""

from __future__ import annotations

import hashlib
import math
import re
import tomllib
from dataclasses import dataclass
from fractions import Fraction
from importlib import resources
from pathlib import Path
from typing import Literal

import msgspec

from heavytop.errors import InputError
from heavytop.precision import exact, parse, physical
from heavytop.suite.cases import CASES, Case, case
from heavytop.top.equations import system
from heavytop.top.heavy_top import HeavyTop, State, require_physical

BUILT_IN = ("smoke", "default", "long")
_MAX_SAMPLES = 1_000_000


class Strict(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind"):
    """A table of a plan; unknown keys are errors."""


class ClaimModel(Strict, tag="claim_model"):
    """The claim, exactly evaluated, against the true motion from its own data.

    times: where the series is taken, t > 0; directions: forward, backward.  grid: the parting time is found on a
    uniform grid of that many points up to the last time.
    """

    cases: list[str]
    times: list[str]
    grid: int = 200
    directions: tuple[Literal["forward", "backward"], ...] = ("forward", "backward")


class ClaimEvaluation(Strict, tag="claim_evaluation"):
    """The printed and the stable formulas, evaluated in a format, against themselves exactly evaluated.

    rate_times: the values of k |t| at which they are evaluated.
    """

    cases: list[str]
    precisions: list[str]
    rate_times: list[str]
    directions: tuple[Literal["forward", "backward"], ...] = ("forward", "backward")


class Homoclinic(Strict, tag="homoclinic"):
    """Integrators on a homoclinic motion, against its closed form, until they break away from it.

    samples: samples in one unit of 1/rate.
    """

    cases: list[str]
    precisions: list[str]
    samples: int = 8
    directions: tuple[Literal["forward", "backward"], ...] = ("forward", "backward")


class Audit(Strict, tag="audit"):
    """Every equation of a claim of the paper, proven or refuted, as a motion of each system."""

    claims: list[Literal["ershkov-general", "ershkov-partial"]]
    systems: list[Literal["heavy_top", "gyrostat"]]


class Run(msgspec.Struct, forbid_unknown_fields=True):
    """One format with its horizon; ``samples`` uniform samples."""

    precision: str
    horizon: str
    samples: int = 1000


class Drift(Strict, tag="drift"):
    """Drift of every first integral that holds, over a horizon."""

    cases: list[str]
    runs: list[Run]


class Top(msgspec.Struct, forbid_unknown_fields=True):
    """A top of the plan's own; numbers as exact text."""

    name: str
    inertia: list[str]
    weight: str
    centre: list[str]
    omega: list[str]
    gamma: list[str]
    system: str = "heavy_top"


class Plan(msgspec.Struct, forbid_unknown_fields=True):
    """A whole plan."""

    name: str
    measure: list[Audit | ClaimModel | ClaimEvaluation | Homoclinic | Drift]
    top: list[Top] = []


@dataclass(frozen=True, slots=True)
class Task:
    """One measurement, and the row it will fill.

    name: as the row names its case.  case: None for an audit, whose ``form`` is the system.
    times: exact, of the sign of the direction; for claim_evaluation they are values of k |t| with that sign.
    keep: the times that go into the series.  precision: "" where no format is involved.
    """

    kind: str
    name: str
    case: Case | None
    precision: str
    form: str
    times: tuple[Fraction, ...] = ()
    keep: tuple[Fraction, ...] = ()

    @property
    def label(self) -> str:
        """For progress and messages."""
        return " ".join(part for part in (self.kind, self.name, self.form, self.precision) if part)

    @property
    def cost(self) -> float:
        """Seconds it may take, roughly: for the progress bar and for running long ones first."""
        if not self.precision:
            return 5.0
        bits = parse(self.precision).bits
        per_step = 1e-6 if bits <= 53 else 5e-6 if bits <= 64 else 5e-4 * (bits / 113) ** 2.5
        return (
            (3.0 if self.kind == "drift" else 1.0) + float(abs(self.times[-1])) * 4 * per_step + len(self.times) * 1e-4
        )


def load(name: str) -> tuple[Plan, str]:
    """The built-in plan of that name, or the one in that TOML file, and the hash of its text.

    Raises InputError with the place in the file for an unknown key or an impossible value.
    """
    if name in BUILT_IN:
        text = (resources.files("heavytop.suite") / "plans" / f"{name}.toml").read_text("utf-8")
    elif Path(name).suffix == ".toml":
        try:
            text = Path(name).read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"The plan {name} cannot be read: {error}.", "Give a readable TOML file.") from None
    else:
        raise InputError(f"Unknown plan {name[:60]!r}.", f"Use {', '.join(BUILT_IN)} or a file ending in .toml.")
    try:
        plan = msgspec.convert(tomllib.loads(text), Plan)
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", plan.name):
            raise msgspec.ValidationError(f"name {plan.name[:40]!r} is not letters, digits, '.', '_' and '-'")
    except RecursionError:
        raise InputError(f"The plan {name} is nested too deeply.", "The plans that ship show every key.") from None
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise InputError(f"The plan {name} is not valid: {error}.", "The plans that ship show every key.") from None
    return plan, hashlib.sha256(text.encode()).hexdigest()


def expand(plan: Plan) -> list[Task]:
    """The plan's measurements in its order; raises InputError for an unknown case or precision, an impossible value,
    and two measurements that would fill the same row.
    """
    own = {top.name: _own_case(top) for top in plan.top}
    tasks: list[Task] = []
    for table in plan.measure:
        cases = [] if isinstance(table, Audit) else [case(name, own) for name in table.cases]
        match table:
            case Audit():
                tasks += [Task("audit", claim, None, "", about) for claim in table.claims for about in table.systems]
            case ClaimModel():
                tasks += _claim_model(table, cases)
            case ClaimEvaluation():
                tasks += _claim_evaluation(table, cases)
            case Homoclinic():
                tasks += _homoclinic(table, cases)
            case Drift():
                tasks += _drift(table, cases)
    seen: set[str] = set()
    for task in tasks:
        if task.label in seen:
            raise InputError(f"The plan {plan.name} measures {task.label} twice.", "Name each measurement once.")
        seen.add(task.label)
    if not tasks:
        raise InputError(f"The plan {plan.name} measures nothing.", "Give it at least one [[measure]] with cases.")
    return tasks


def _own_case(top: Top) -> Case:
    if top.name in CASES:
        raise InputError(f"The plan's top {top.name!r} has the name of a built-in case.", "Give it another name.")
    body = HeavyTop(top.inertia, top.weight, top.centre)
    start = State(top.omega, top.gamma).require_unit_gamma()
    require_physical(body, start)
    which = system(top.system)
    which.parameters(body, start)
    return Case(top.name, "from the plan", which, body, start)


def _claim_model(table: ClaimModel, cases: list[Case]) -> list[Task]:
    times = _positive(table.times, "times")
    grid = [times[-1] * i / table.grid for i in range(1, _samples(table.grid) + 1)]
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
        for each in map(_claimed, cases)
        for direction in table.directions
        for form in (("smooth", "printed") if direction == "forward" else ("smooth",))
    ]


def _claim_evaluation(table: ClaimEvaluation, cases: list[Case]) -> list[Task]:
    times = _positive(table.rate_times, "rate_times")
    return [
        Task(
            "claim_evaluation",
            f"{each.name}/{direction}",
            each,
            parse(name).name,
            form,
            *[_signed(times, direction)] * 2,
        )
        for each in map(_claimed, cases)
        for name in table.precisions
        for direction in table.directions
        for form in ("printed", "stable")
    ]


def _homoclinic(table: Homoclinic, cases: list[Case]) -> list[Task]:
    tasks = []
    for each in cases:
        spacing = Fraction(round(64 / (_samples(table.samples) * each.rate)) or 1, 64)
        for name in table.precisions:
            precision = parse(name)
            end = (1.1 * precision.bits * math.log(2) + 4) / each.rate
            times = [spacing * i for i in range(1, int(end / spacing) + 1)]
            keep = times[table.samples - 1 :: table.samples]
            tasks += [
                Task("homoclinic", f"{each.name}/{d}", each, name, "", _signed(times, d), _signed(keep, d))
                for d in table.directions
            ]
    return tasks


def _drift(table: Drift, cases: list[Case]) -> list[Task]:
    tasks = []
    for each in cases:
        for run in table.runs:
            (horizon,) = _positive([run.horizon], "horizon")
            count = _samples(run.samples)
            times = tuple(horizon * i / count for i in range(1, count + 1))
            keep = tuple(times[i - 1] for i in log_spaced(count))
            tasks.append(Task("drift", each.name, each, parse(run.precision).name, "", times, keep))
    return tasks


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
