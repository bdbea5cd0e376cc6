"""Names that integrators had before, read as those that they have: in plans, options and reports of then."""

from __future__ import annotations

from typing import Any

import msgspec

from heavytop.records import Row

INTEGRATORS = {"words": "multiword"}
"""What an integrator was called, and is."""


def current(name: str) -> str:
    """The name that an integrator has now, of the one that it was given."""
    return INTEGRATORS.get(name, name)


def notice(name: str) -> str:
    """A sentence for whoever gives a name of before; empty for any other."""
    return f"the integrator {name} is called {INTEGRATORS[name]} now" if name in INTEGRATORS else ""


def in_document(part: Any) -> set[str]:
    """The former names that an ``integrator = "NAME"`` of a plan's document gives, however deep."""
    if isinstance(part, list):
        return set().union(*map(in_document, part))
    if not isinstance(part, dict):
        return set()
    given = part.get("integrator")
    own = {given} if isinstance(given, str) and given in INTEGRATORS else set()
    return own.union(*(in_document(each) for each in part.values()))


def of_document(part: Any) -> Any:
    """A plan's document with the names of now."""
    if isinstance(part, list):
        return [of_document(each) for each in part]
    if not isinstance(part, dict):
        return part
    found = {name: of_document(each) for name, each in part.items()}
    if isinstance(given := part.get("integrator"), str):
        found["integrator"] = current(given)
    return found


def of_plan(plan: dict[str, str]) -> dict[str, str]:
    """The plan block of a report with the name of now of the integrator that was measured beside heyoka."""
    given = plan.get("integrator", "")
    return plan | {"integrator": current(given)} if given in INTEGRATORS else plan


def of_identity(identity: dict[str, str]) -> dict[str, str]:
    """What must be the same for a run to go on, with that name of now."""
    return {key: current(value) if key == "plan integrator" else value for key, value in identity.items()}


def of_row(row: Row) -> Row:
    """The row with the name of now of the integrator that computed it; itself where it is that already."""
    subject = row.key.subject
    if subject.name not in INTEGRATORS or subject.what != "computed":
        return row
    old, new = subject.name, INTEGRATORS[subject.name]
    first, *rest = row.integrator.split(" ")
    computed = f"computed: {old} in "
    measured = row.measured.removeprefix(computed)
    return msgspec.structs.replace(
        row,
        integrator=" ".join([new if first == old else first, *rest]),
        key=msgspec.structs.replace(row.key, subject=msgspec.structs.replace(subject, name=new)),
        measured=row.measured if measured == row.measured else f"computed: {new} in {measured}",
    )
