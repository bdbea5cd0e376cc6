"""`list`."""

from __future__ import annotations

from textwrap import fill
from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, cases, command, print_json

_FORMS = {
    "command": "Command line",
    "csv": "CSV, above the states of a trajectory",
    "json": "JSON, in a trajectory",
    "toml": "TOML, in a plan",
    "python": "Python",
}


@command
def list_(
    case: Annotated[
        str | None, typer.Option(help="Show the data of that case, ready to paste.", autocompletion=cases)
    ] = None,
    json: Json = False,
) -> int:
    """List cases, plans, formats and integrators."""
    if case is not None:
        return _one_case(case, json)
    listed = _everything()
    if json:
        print_json(listed)
        return 0
    print("Cases (--case NAME shows the data)")
    _lines({each["name"]: f"{each['system']:14} {each['about']}" for each in listed["cases"]}, indent=15)
    print("Bodies (cases too: the standard tests of other programs)")
    _lines({each["name"]: f"{each['system']:14} {each['about']}" for each in listed["bodies"]}, indent=15)
    plans = f"{', '.join(listed['plans'])}, or a TOML file"
    print("Plans")
    print(fill(plans, 80, initial_indent="  ", subsequent_indent="  "))
    print(f"Systems\n  {', '.join(listed['systems'])}")
    print("Number formats")
    _lines(listed["formats"])
    print("Integrators")
    _lines(listed["integrators"])
    return 0


def _lines(notes: dict[str, str], indent: int = 0) -> None:
    """A name and its note a line, folded at 80 columns."""
    width = max(map(len, notes))
    for name, note in notes.items():
        print(fill(note, 80, initial_indent=f"  {name:{width}} ", subsequent_indent=" " * (width + 3 + indent)))


def _everything() -> dict[str, Any]:
    from heavytop.integrate import peers
    from heavytop.precision import FORMATS, available
    from heavytop.suite.cases import CASES, named_bodies
    from heavytop.suite.plan import BUILT_IN
    from heavytop.top.equations import SYSTEMS

    notes = {form.name: f"{form.bits} bits" for form in FORMATS} | {"real": "24 to 20000 bits"}
    known, reasons = peers.known(), peers.available()
    integrators = {
        name: reasons[name] or (each.formats_text if each.streams else "") or "installed"
        for name, each in sorted(known.items(), key=lambda item: not item[1].streams)
    }
    return {
        "cases": [{"name": case.name, "system": case.system.name, "about": case.about} for case in CASES.values()],
        "bodies": [
            {"name": case.name, "system": case.system.name, "about": case.about} for case in named_bodies().values()
        ],
        "plans": list(BUILT_IN),
        "systems": [system.name for system in SYSTEMS],
        "formats": {
            "real:BITS" if name == "real" else name: notes[name] if reason is None else f"not available: {reason}"
            for name, reason in available().items()
        },
        "integrators": integrators,
        "capabilities": {name: each.capabilities() for name, each in known.items()},
    }


def _one_case(name: str, json: bool) -> int:
    from heavytop.suite.case_text import case_data, forms
    from heavytop.suite.cases import case as case_named

    found = case_named(name)
    if json:
        print_json(
            case_data(found)
            | {"about": found.about, "source": found.source, "units": found.units}
            | {key: forms(found)[key] for key in ("command", "csv", "toml", "python")}
        )
        return 0
    print(fill(f"{found.name}: {found.about}", 80))
    if found.source:
        print(fill(f"Source: {found.source}. Units: {found.units}.", 80))
    for form, text in forms(found).items():
        print(f"\n{_FORMS[form]}\n{text}")
    return 0
