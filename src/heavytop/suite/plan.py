"""Plans: what is run, written in TOML, and the single measurements they expand to."""

from __future__ import annotations

import hashlib
import re
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import msgspec

from heavytop.errors import InputError
from heavytop.measure.luck import MOST_SEEDS
from heavytop.suite.cases import CASES, Case, case
from heavytop.suite.tables import Table
from heavytop.suite.task import Task
from heavytop.top.equations import system
from heavytop.top.heavy_top import HeavyTop, State, require_physical

BUILT_IN = ("smoke", "default", "long", "selftest")


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
    measure: list[Table]
    top: list[Top] = []


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


def expand(plan: Plan, seed: int = 0) -> list[Task]:
    """The plan's measurements in its order, with the roundings of a seed; raises InputError for an unknown case or
    precision, an impossible value, and two measurements that would fill the same row.
    """
    if not 0 <= seed <= MOST_SEEDS:
        raise InputError(f"There is no seed {seed}.", f"Give a number from 0 to {MOST_SEEDS}.")
    own = {top.name: _own_case(top) for top in plan.top}
    tasks = [replace(task, seed=seed) for table in plan.measure for task in table.tasks(lambda name: case(name, own))]
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
