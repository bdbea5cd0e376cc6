"""Plans in TOML, and the single measurements to which they expand."""

from __future__ import annotations

import hashlib
import re
import tomllib
from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from functools import reduce
from importlib import resources
from importlib.resources.abc import Traversable
from itertools import accumulate
from operator import or_
from pathlib import Path
from typing import Any, cast, get_args

import msgspec

from heavytop import records
from heavytop.cases import CASES, Case, case, named_bodies, require_possible
from heavytop.display import Lazy
from heavytop.errors import InputError, invalid, meant, nearest, prefixed, quoted, refusal
from heavytop.exact.resolved import resolve
from heavytop.files import read_whole, readable
from heavytop.harness import BUILT_IN, OF_FEATURES
from heavytop.harness.rows import Kinds, PlanTable, Task
from heavytop.harness.sweeps import Sweep
from heavytop.integrate.peers.command import Command
from heavytop.integrate.registry import (
    IntegratorSource,
    command_of,
    commands_in,
    control_name,
    is_third_party,
    named,
    no_option,
    seconds_of,
)
from heavytop.integrate.registry import known as known_integrators
from heavytop.integrate.registry import require as require_integrator
from heavytop.integrate.trajectory import Problem
from heavytop.measure.rounding_noise import MOST_SEEDS
from heavytop.precision import exact, number, physical, require
from heavytop.records import FINEST, HEYOKA, RowKey
from heavytop.top.bodies import Body, motion_of
from heavytop.top.equations import system_of
from heavytop.top.heavy_top import HeavyTop

_KEYS = "`heavytop docs plans` lists kinds and keys; the built-in plans are examples."
_NAME = r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
_RENAME = "Give it another name."
_READABLE = "Give a readable TOML file or a built-in plan, as --plan gate; `heavytop new` makes one of your own."
QUANTITIES = frozenset(
    (
        *("inertia", "weight", "mass", "gravity", "centre", "rotor"),
        *("omega", "omega_space", "gamma", "quaternion", "matrix"),
        *("horizon", "times", "rate_times", "tolerance", "tolerances", "steps", "limit"),
    )
)
"""Keys whose values are exact numbers: an integer, a decimal, or text with a decimal or a fraction."""


class Top(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """A top of the plan's own, or a body in any axes; numbers as exact text, or as they are written in TOML.

    With ``weight`` a top: inertia its principal moments.  With ``mass`` and ``gravity`` a body: inertia 3, 6 or 9
    numbers of its tensor, about "pivot" or "centre of mass".  With ``file``, and ``link`` where it has several, the
    body of a URDF, MJCF, SDF, USD or TOML file; a relative path is from the working directory.  The start has ``omega``
    or ``omega_space``, and one of ``gamma``, ``quaternion``, ``matrix``, ``euler`` ("ZXZ:a,b,c") and ``axis_angle``
    ("x,y,z:angle").
    """

    name: str
    inertia: list[str] | None = None
    centre: list[str] | None = None
    file: str | None = None
    link: str | None = None
    weight: str | None = None
    mass: str | None = None
    gravity: str | None = None
    about: str | None = None
    omega: list[str] | None = None
    omega_space: list[str] | None = None
    gamma: list[str] | None = None
    quaternion: list[str] | None = None
    matrix: list[str] | None = None
    euler: str | None = None
    axis_angle: str | None = None
    rotor: list[str] | None = None
    system: str | None = None

    def case(self) -> Case:
        """The case; raises InputError for an invalid body or start, and one that cannot be measured."""
        body, start = motion_of(msgspec.structs.asdict(self))
        about, system = "from the plan", system_of(self.system, body)
        if isinstance(body, HeavyTop) and start.attitude is None:
            return require_possible(Case(self.name, about, system, body, start))
        resolved = resolve(body, start)
        case = Case(self.name, about, system, resolved.top, resolved.start)
        return require_possible(replace(case, body=body if isinstance(body, Body) else None, given_start=start))


class Plan(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """A plan; each table in ``measure`` has the type of its kind.

    integrator: tables of programs.  integrators: files beside that of the plan, ``mine.toml`` or ``mine.py:solve``.
    row_timeout: largest seconds of a row of a third-party integrator.
    """

    name: str
    measure: list[PlanTable]
    top: list[Top] = []
    sweep: list[Sweep] = []
    integrator: list[dict[str, Any]] = []
    integrators: list[str] = []
    row_timeout: str | int | float = ""


def read(
    name: str, kinds: Kinds, seed: int = 0, integrator: str | IntegratorSource = ""
) -> tuple[Plan, str, Sequence[Task]]:
    """The plan of that name or file, the hash of its text, and its measurements with the roundings of a seed.

    integrator: measured as heyoka is, in addition.  Integrators of the plan's own are defined in it or beside its file.
    Raises InputError, which names the file, where :func:`load`, :func:`expand` or :func:`with_integrator` does.
    """
    plan, digest = load(name, kinds)
    try:
        folder = Path(str(_built_in(name))).parent if name in BUILT_IN else Path(name).parent
        plan, defined = _by_name(plan, definitions(plan, folder), folder)
        if integrator:
            integrator = defined.get(integrator, integrator) if isinstance(integrator, str) else integrator
            plan = with_integrator(plan, integrator)
        elif unused := ", ".join(sorted(defined.keys() - _integrators(plan))):
            cause = f"The plan {plan.name} defines integrators that it does not measure: {unused}."
            raise InputError(cause, "Name each in a [[measure]]; FILE.toml:NAME defines one of several in a file.")
        if not isinstance(integrator, str):
            defined = defined | {integrator.name: integrator}
        return plan, digest, expand(plan, seed, defined)
    except InputError as error:
        if name in BUILT_IN:
            raise
        raise InputError(f"{name}: {error.cause}", error.remedy) from None


def load(name: str, kinds: Kinds) -> tuple[Plan, str]:
    """The built-in plan of that name, or the one in that TOML file, and the hash of its text.

    Raises InputError with the place in the file for an unknown key or kind or an impossible value.
    """
    if name in BUILT_IN:
        text = _built_in(name).read_text("utf-8")
    elif Path(name).suffix == ".toml":
        with readable(f"The plan {name}", _READABLE):
            text = read_whole(Path(name)).decode("utf-8")
    else:
        remedy = meant(name, BUILT_IN) + "`heavytop list` shows the plans; your own is a file ending in .toml."
        raise InputError(f"Unknown plan {name[:60]!r}.", remedy)
    try:
        plan = of_document(document_of(text), kinds)
        if not re.fullmatch(_NAME, plan.name):
            raise msgspec.ValidationError(f"name {plan.name[:40]!r} is not letters, digits, '.', '_' and '-'")
    except RecursionError:
        raise InputError(f"The plan {name} is nested too deeply.", _KEYS) from None
    except ValueError as error:  # of TOML, of an integer with too many digits, of msgspec
        cause = f"The plan {name} is not valid: {invalid(error, Plan)}."
        raise InputError(cause, _KEYS) from None
    return plan, hashlib.sha256(text.encode()).hexdigest()


def _built_in(name: str) -> Traversable:
    shared = resources.files("heavytop.harness") / "plans"
    return (resources.files(OF_FEATURES[name]) if name in OF_FEATURES else shared) / f"{name}.toml"


def document_of(text: str) -> dict[str, Any]:
    """The TOML document; the numbers of :data:`QUANTITIES`, and all that are not integers, as text.

    Raises ValueError for text that is not TOML.
    """
    return {key: _as_written(key, value) for key, value in tomllib.loads(text, parse_float=str).items()}


def _as_written(key: str, value: object) -> Any:
    if isinstance(value, dict):
        return {name: _as_written(name, item) for name, item in value.items()}
    if isinstance(value, list):
        return [_as_written(key, item) for item in value]
    return str(value) if key in QUANTITIES and type(value) is int else value


def former(name: str) -> set[str]:
    """The former names of integrators in the plan of that file; none where it cannot be read a second time."""
    try:
        return records.take_former(document_of(Path(name).read_text("utf-8"))) if Path(name).is_file() else set()
    except (OSError, ValueError, RecursionError):
        return set()


def definitions(plan: Plan, folder: Path) -> dict[str, IntegratorSource]:
    """The integrators that a plan in that folder defines, by name; raises InputError for an invalid or repeated one."""
    sources: list[IntegratorSource] = [command_of(table, folder, f"The plan {plan.name}") for table in plan.integrator]
    for text in plan.integrators:
        if text.endswith(".toml"):
            sources += commands_in(folder / text)
        elif isinstance(source := named(text, folder), str):
            raise InputError(f"integrators must name files; got {quoted(text)}.", "Give FILE.toml or FILE.py:FUNCTION.")
        else:
            sources.append(source)
    defined = {source.name: source for source in sources}
    for name in (name for name in defined if name in known_integrators()):
        raise InputError(f"The plan {plan.name} defines the integrator {name}, which already exists.", _RENAME)
    if len(defined) < len(sources):
        raise InputError(f"The plan {plan.name} gives two integrators the same name.", _RENAME)
    if plan.row_timeout != "":
        seconds_of(plan.row_timeout, "row_timeout")
    return defined


def _by_name(
    plan: Plan, defined: Mapping[str, IntegratorSource], folder: Path
) -> tuple[Plan, dict[str, IntegratorSource]]:
    """The plan with integrators by name in place of files in that folder, and all integrators so defined.

    Raises InputError for a file that describes none, and where another integrator has the same name.
    """
    sources = dict(defined)

    def by_name(table: Any) -> Any:
        changes: dict[str, Any] = {}
        if getattr(table, "ladders", None):
            changes["ladders"] = list(map(by_name, table.ladders))
        text = getattr(table, "integrator", "")
        source = text if text in sources else named(text, folder)
        if not isinstance(source, str):
            if sources.setdefault(source.name, source) != source:
                raise InputError(f"The plan {plan.name} gives two integrators the name {source.name}.", _RENAME)
            changes["integrator"] = source.name
        return msgspec.structs.replace(table, **changes)

    return msgspec.structs.replace(plan, measure=list(map(by_name, plan.measure))), sources


def _integrators(plan: Plan) -> set[str]:
    """The names of the integrators that the tables of a plan measure."""
    tables = [part for table in plan.measure for part in (table, *getattr(table, "ladders", ()))]
    return {getattr(part, "integrator", "") for part in tables}


def with_integrator(plan: Plan, integrator: str | IntegratorSource) -> Plan:
    """The plan with heyoka's measurements repeated for another integrator.

    Raises InputError for an unknown integrator, for heyoka itself and for a plan that measures no integrator.
    """
    if integrator == HEYOKA:
        raise InputError(f"{HEYOKA} is what others are compared with.", "Give another --integrator.")
    if not isinstance(integrator, str) and not is_third_party(integrator.name):
        raise InputError(f"The integrator {integrator.name} has the name of a built-in one.", _RENAME)
    require_integrator(integrator)
    added = [extended for table in plan.measure if (extended := table.with_integrator(integrator)) is not None]
    if not added:
        raise InputError(f"The plan {plan.name} does not measure {HEYOKA}.", "Use --plan gate.")
    return msgspec.structs.replace(plan, measure=[*plan.measure, *added])


def of_document(document: dict[str, Any], kinds: Kinds) -> Plan:
    """The plan in a TOML document; raises ValidationError with the place of an unknown key, kind or impossible type."""
    document = deepcopy(document)
    records.take_former(document)
    tables = {kind.name: kind.table for kind in kinds.values() if kind.table is not None}
    _require_kinds(document, "measure", tables)
    _require_kinds(document, "sweep", {str(sweep_class.__struct_config__.tag) for sweep_class in get_args(Sweep)})
    _require_keys(document, tables)
    any_table = reduce(or_, tables.values())
    measure = ("measure", list[any_table])  # type: ignore[valid-type]
    plan_type = msgspec.defstruct("Plan", [measure], bases=(Plan,), kw_only=True)
    plan: Plan = msgspec.convert(document, cast(type[Plan], plan_type))
    return plan


def _require_kinds(table: dict[str, Any], section: str, known: Collection[str]) -> None:
    """Raises ValidationError for a table of an unknown kind, with the known kinds and the nearest of them."""
    entries = table.get(section)
    for index, entry in enumerate(entries if isinstance(entries, list) else []):
        kind = entry.get("kind") if isinstance(entry, dict) else None
        if isinstance(kind, str) and kind not in known:
            near = nearest(kind, known)
            meant = f"; did you mean {near}" if near else ""
            raise msgspec.ValidationError(
                f"kind in {section}[{index}] must be one of {', '.join(sorted(known))}; got {quoted(kind)}{meant}"
            )


def _require_keys(document: dict[str, Any], tables: Mapping[str, type[PlanTable]]) -> None:
    """Raises ValidationError for a [[measure]] with a key unknown to its kind, with the known keys."""
    entries = document.get("measure")
    for index, entry in enumerate(entries if isinstance(entries, list) else []):
        table = tables.get(entry.get("kind", "")) if isinstance(entry, dict) else None
        keys = {"kind"} if table is None else {"kind", *table.__struct_encode_fields__}
        if table is not None and (unknown := min(entry.keys() - keys, default="")):
            raise msgspec.ValidationError(
                f"unknown field `{unknown[:40]}` in measure[{index}]; kind = {quoted(entry['kind'])} has "
                + ", ".join(sorted(keys - {"kind"}))
            )


def expand(plan: Plan, seed: int = 0, defined: Mapping[str, IntegratorSource] | None = None) -> Sequence[Task]:
    """The plan's measurements in its order, with the roundings of a seed; those over a sweep are made on demand.

    defined: integrators of the plan's own, by name.
    Raises InputError for an unknown case, integrator or precision, an impossible value or seed, data that a format
    cannot represent, a repeated measurement, and a top or sweep that nothing measures.
    """
    if not 0 <= seed <= MOST_SEEDS:
        raise refusal("seed", f"from 0 to {MOST_SEEDS}", seed, f"Give a number from 0 to {MOST_SEEDS}.")
    own_cases, swept = _own_tops(plan), _swept(plan)
    sweeps = list(zip(plan.sweep, swept.values(), strict=True))
    known = own_cases | {name: cases[0] for name, cases in swept.items()}
    measured = {name for table in plan.measure for name in getattr(table, "cases", [])}
    if unused := known.keys() - measured:
        raise InputError(
            f"The plan {plan.name} does not measure {', '.join(sorted(unused))}.",
            "Add it to the cases of a [[measure]], or remove it.",
        )
    parts = [
        ([replace(task, seed=seed) for task in table.tasks(lambda name: case(name, known))], cases)
        for entry in plan.measure
        for table, cases in _parts(
            entry, {name: entry.swept(*sweep) for name, sweep in zip(swept, sweeps, strict=True)}
        )
    ]
    sources: dict[str, IntegratorSource | None] = {}
    labels: dict[RowKey, str] = {}
    for templates, _ in parts:
        for index, task in enumerate(templates):
            subject = task.key.subject
            if subject.what == "computed" and subject.name not in sources:
                sources[subject.name] = (defined or {}).get(subject.name)
                require_integrator(sources[subject.name] or subject.name)
            task = templates[index] = replace(task, source=sources.get(subject.name))
            work = _with_exact_control(task.key)
            if work in labels:
                other = "" if labels[work] == task.label else f", also as {labels[work]}"
                raise InputError(f"The plan {plan.name} measures {task.label} twice{other}.", "List each once.")
            if task.label in labels.values():  # one case at several horizons
                templates[index] = replace(task, suffix=f"{task.suffix}/T={task.key.horizon}")
            labels[work] = templates[index].label
            _require_fit(task)
    if not labels:
        raise InputError(f"The plan {plan.name} measures nothing.", "Give it at least one [[measure]] with cases.")
    if not all(templates for templates, _ in parts):
        remedy = "Fill its lists of cases, claims, precisions, runs, ladders, directions, or remove it."
        raise InputError(f"A [[measure]] of the plan {plan.name} measures nothing.", remedy)
    ends = list(accumulate(len(templates) * len(cases or (None,)) for templates, cases in parts))

    def task_at(index: int) -> Task:
        part = bisect_right(ends, index)
        templates, cases = parts[part]
        case_index, template = divmod(index - (ends[part - 1] if part else 0), len(templates))
        return templates[template].of(cases[case_index]) if cases else templates[template]

    return Lazy(ends[-1], task_at)


def _own_tops(plan: Plan) -> dict[str, Case]:
    """The plan's own tops by name."""
    tops: dict[str, Case] = {}
    for top in plan.top:
        _require_name(top.name, "top")
        if top.name in tops:
            raise InputError(f"The plan {plan.name} has two tops {top.name!r}.", _RENAME)
        if top.name in CASES or top.name in named_bodies():
            raise InputError(f"The plan's top {top.name!r} has the name of a built-in case.", _RENAME)
        with prefixed(f"The plan's top {top.name!r}"):
            tops[top.name] = top.case()
    return tops


def warnings(plan: Plan) -> list[str]:
    """Warnings about the plan's own tops: data that no rigid body has, though the equations admit them."""
    return [
        f"top {name}: {text}" for name, case in _own_tops(plan).items() for text in (case.body or case.top).warnings()
    ]


def _swept(plan: Plan) -> dict[str, Sequence[Case]]:
    """The cases of each sweep, by its name in tables."""
    swept: dict[str, Sequence[Case]] = {}
    for index, sweep in enumerate(plan.sweep):
        _require_name(sweep.name, "sweep")
        for earlier in plan.sweep[:index]:
            if sweep.name == earlier.name:
                raise InputError(f"The plan {plan.name} has two sweeps {sweep.name!r}.", _RENAME)
            if sweep == msgspec.structs.replace(earlier, name=sweep.name):
                raise InputError(f"The sweeps {earlier.name} and {sweep.name} are the same.", "Remove one of them.")
        swept[f"sweep:{sweep.name}"] = sweep.cases()
    return swept


def _require_name(name: str, what: str) -> None:
    if not re.fullmatch(_NAME, name):
        raise InputError(f"The {what}'s name {name[:40]!r} is not letters, digits, '.', '_' and '-'.", _RENAME)


def _with_exact_control(key: RowKey) -> RowKey:
    """The key with its control parameter as a fraction: 1e-3 and 0.001 are the same measurement."""
    controls = {name: getattr(key.subject, name) for name in ("tolerance", "step", "bias")}
    exactly = {name: text if text in ("", FINEST) else str(exact(text)) for name, text in controls.items()}
    return msgspec.structs.replace(key, subject=msgspec.structs.replace(key.subject, **exactly))


def _require_fit(task: Task) -> None:
    """Raises InputError, with the name of the task, where its format is unavailable or cannot represent its data, and
    where its integrator, if that is known without running it, has no such control parameter.
    """
    if task.case is None or not task.has_precision:
        return
    with prefixed(f"{task.label}"):
        subject, which = task.key.subject, task.source or task.key.subject.name
        if subject.what == "computed" and (isinstance(which, Command) or not is_third_party(subject.name)):
            for option in {"step", "tolerance"} - {control_name(which)}:
                if getattr(subject, option) not in ("", FINEST):
                    raise no_option(which, option)
        precision = require(task.precision)
        Problem.of(task.case.top, task.case.start, precision, task.case.system)
        for time in task.times[:1] + task.times[-1:]:
            number(time, precision)


def _parts(table: PlanTable, swept: dict[str, Sequence[Case]]) -> list[tuple[PlanTable, Sequence[Case] | None]]:
    """The table itself, or where a case is a sweep one table for each case, with the cases of the sweep."""
    names: list[str] = getattr(table, "cases", [])
    if not swept.keys() & set(names):
        return [(table, None)]
    return [(msgspec.structs.replace(table, cases=[name]), swept.get(name)) for name in names]


# Lists of times in a plan, checked.


_MAX_SAMPLES = 1_000_000


def log_spaced(count: int) -> list[int]:
    """About eight integers per decade from 1 to ``count``, both included."""
    selected = {count}
    i = 0
    while (value := round(10 ** (i / 8))) < count:
        selected.add(value)
        i += 1
    return sorted(selected)


def positive(texts: list[str], what: str) -> list[Fraction]:
    """Exact numbers; raises InputError unless they are positive and grow."""
    values = [physical(text, what) for text in texts]
    if not values or values != sorted(set(values)) or values[0] <= 0:
        if len(texts) == 1:
            raise refusal(what, "positive", texts[0], "Give a number above 0.")
        raise refusal(what, "positive and increasing", ", ".join(texts) or "nothing", "Give each number once.")
    return values


def samples(count: int) -> int:
    """The count; raises InputError unless it is valid."""
    if not 1 <= count <= _MAX_SAMPLES:
        raise refusal("samples", f"from 1 to {_MAX_SAMPLES}", count, "Give, for example, 100.")
    return count


def signed(times: list[Fraction], direction: str) -> tuple[Fraction, ...]:
    """The times forward or backward."""
    return tuple(-time for time in times) if direction == "backward" else tuple(times)


def uniform(horizon: Fraction, count: int) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
    """``count`` uniform samples up to the horizon, and those of them for a series, about eight per decade."""
    times = tuple(horizon * i / count for i in range(1, samples(count) + 1))
    return times, tuple(times[i - 1] for i in log_spaced(count))
