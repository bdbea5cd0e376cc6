"""`check-integrator` and `new`."""

from __future__ import annotations

import os
from pathlib import Path
from shlex import quote
from textwrap import fill
from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, cases, command, print_json, show_on_terminal
from heavytop.cli.output import Progress
from heavytop.errors import ExitCode, InputError

_WHOLE_WORDS: Any = {"break_long_words": False, "break_on_hyphens": False}


@command
def check_integrator(
    integrator: Annotated[str, typer.Argument(help="A name of `heavytop list`, mine.toml or mine.py:solve.")],
    json: Json = False,
) -> int:
    """Check an integrator against its contract.

    Prints each requirement, kept or violated.  Exit code 0 if nothing is violated, 1 if something is, 2 if there is no
    such integrator or file.
    """
    from dataclasses import asdict

    from heavytop.api.integrators import check_integrator as check
    from heavytop.cli.output import say_former, waiting
    from heavytop.harness.integrator_check import NOT_TRIED
    from heavytop.records import current

    say_former([integrator])
    with waiting("each part of the contract", 60):
        results = check(integrator)
    violated = [check for check in results if check.verdict == "violated"]
    if json:
        verdict = "violated" if violated else "kept"
        checks = [asdict(check) for check in results]
        about = {"integrator": current(integrator), "verdict": verdict, "not_tried": NOT_TRIED}
        print_json(about | {"checks": checks})
    else:
        width = max(len(check.check) for check in results)
        for result in results:
            head = f"{result.verdict:8}  {result.check:{width}}  "
            print(fill(result.text, 80, initial_indent=head, subsequent_indent=" " * len(head), **_WHOLE_WORDS))
        print(f"\n{len(violated)} of {len(results)} violated." if violated else "\nNothing is violated.")
        print(fill(NOT_TRIED, 80, **_WHOLE_WORDS))
    return ExitCode.FINDING if violated else ExitCode.GOOD


@command
def new(
    folder: Annotated[Path | None, typer.Argument(metavar="DIR", help="A new folder; with --into, heavytop.")] = None,
    language: Annotated[str, typer.Option(help="python, c, cpp, rust, julia or fortran.")] = "python",
    method: Annotated[str, typer.Option(help="step, adaptive or multistep.")] = "step",
    engine: Annotated[str, typer.Option(help="An adapter of that engine: mujoco, drake, ...; '?' lists all.")] = "",
    into: Annotated[Path | None, typer.Option(help="A repository: it gets the workflow, and DIR lies in it.")] = None,
) -> int:
    """Make a new folder with an integrator and its gate.

    It holds a program that integrates the heavy top, in the language asked for: by RK4 in fixed steps, by the pair of
    Dormand and Prince to a tolerance, or by Adams-Bashforth 4; or the adapter of an engine of rigid bodies.  It works
    at once: mine.toml (engine.toml) describes the program, gate.toml is the plan that measures it, and a workflow runs
    `heavytop gate` on GitHub.
    """
    from heavytop.api.integrators import LANGUAGES, engines, new_integrator

    if engine == "?":
        print("\n".join(engines()))
        return ExitCode.GOOD
    if folder is None and into is None:
        raise InputError("DIR is missing.", "Give DIR, or --into a repository.")
    made = (into or Path()) / (folder or "heavytop")
    files = new_integrator(made, language, method, into, engine)
    print(fill(f"{made}: {', '.join(files)}", 80, subsequent_indent="  ", **_WHOLE_WORDS))
    build = "" if language == "python" else f"{LANGUAGES[language].build}; "
    first = "cat README.md" if engine else f"{build}heavytop check-integrator mine.toml"
    folder_name = f"./{made}" if str(made).startswith("-") else str(made)
    print(f"Next: cd {quote(folder_name)}; {first}; heavytop gate --bless")
    return ExitCode.GOOD


# `list`.


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
    from heavytop.api.integrators import listing

    if json:
        print_json(listing())
        return ExitCode.GOOD
    listed = listing(checked=False)
    print("Cases (--case NAME shows the data)")
    _lines({entry["name"]: _about(entry) for entry in listed["cases"]}, indent=15)
    print("Bodies (cases too: the standard tests of other programs)")
    _lines({entry["name"]: _about(entry) for entry in listed["bodies"]}, indent=15)
    plans = f"{', '.join(listed['plans'])}, or a TOML file"
    print("Plans")
    print(fill(plans, 80, initial_indent="  ", subsequent_indent="  "))
    print(f"Systems\n  {', '.join(listed['systems'])}")
    print("Number formats")
    _lines(listed["formats"])
    print("Integrators")
    _lines(listed["integrators"])
    return ExitCode.GOOD


def _about(case: dict[str, Any]) -> str:
    return f"{case['system']:14} {case['about']}" + ("" if case["realisable"] else " (no rigid body has these moments)")


def _lines(notes: dict[str, str], indent: int = 0) -> None:
    """Print a name and its note per line, folded at 80 columns."""
    width = max(map(len, notes))
    for name, note in notes.items():
        print(fill(note, 80, initial_indent=f"  {name:{width}} ", subsequent_indent=" " * (width + 3 + indent)))


def _one_case(name: str, json: bool) -> int:
    from heavytop.api.integrators import case_document

    document = case_document(name)
    if json:
        print_json({key: value for key, value in document.items() if key != "json"})  # it would contain itself
        return ExitCode.GOOD
    print(fill(f"{document['name']}: {document['about']}", 80))
    if document["source"]:
        print(fill(f"Source: {document['source']}. Units: {document['units']}.", 80))
    for form, title in _FORMS.items():
        if form in document:
            print(f"\n{title}\n{document[form]}")
    return ExitCode.GOOD


# `selftest`.


@command
def selftest(
    workers: Annotated[int | None, typer.Option(help="Local processes; default: the number of processors.")] = None,
    json: Json = False,
) -> int:
    """Try the detectors on integrators with planted faults.

    Exit 1 if one that they should detect is missed.  Takes two minutes on two cores; its part in
    `heavytop run --plan selftest` takes 15 seconds.
    """
    from heavytop import arguments
    from heavytop.api import selftest as detectors
    from heavytop.features.kinds import KINDS

    at_once = arguments.count(workers, "workers") or os.cpu_count() or 1
    tasks = detectors.tasks()
    with Progress(tasks, KINDS, at_once) as advance:
        trials = detectors.trials(tasks, at_once, advance)
    if json:
        print_json({"trials": [trial.to_json() for trial in trials]})
    else:
        show_on_terminal(detectors.in_words(trials))
    return ExitCode.GOOD if all(trial.as_expected for trial in trials) else ExitCode.FINDING
