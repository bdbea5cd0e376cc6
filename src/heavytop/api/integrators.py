"""Integrators of one's own, from Python: their contract, and a folder to begin with."""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from heavytop.errors import InputError, quoted
from heavytop.files import replace
from heavytop.harness.integrator_check import NOT_TRIED as NOT_TRIED
from heavytop.harness.integrator_check import Checked, check
from heavytop.integrate.registry import named
from heavytop.version import commit


class Language(NamedTuple):
    """A language of `heavytop new`: what the program is called and started by, and what is done to build it."""

    title: str
    file: str
    command: str
    build: str = "make"


LANGUAGES = {
    "python": Language("Python", "mine.py", '["python3", "mine.py"]', "python3 --version"),
    "c": Language("C", "mine.c", '["./mine"]'),
    "cpp": Language("C++", "mine.cpp", '["./mine"]'),
    "rust": Language("Rust", "mine.rs", '["./mine"]'),
    "julia": Language("Julia", "mine.jl", '["julia", "--startup-file=no", "mine.jl"]', "julia --version"),
    "fortran": Language("Fortran", "mine.f90", '["./mine"]'),
}


class Method(NamedTuple):
    """A method of `heavytop new`: what it is called, the keys of its table, and its control and ladder in the plan."""

    title: str
    keys: str
    control: str
    ladder: str


_STEPS = 'steps = ["1/10", "1/30", "1/100", "1/300"]'
METHODS = {
    "step": Method("the classical Runge-Kutta method", 'setting = "step"\norder = 4', "0.01", _STEPS),
    "adaptive": Method(
        "the method of Dormand and Prince",
        'setting = "tolerance"\norder = 5',
        "1e-9",
        'tolerances = ["1e-4", "1e-6", "1e-8", "1e-10"]',
    ),
    "multistep": Method(
        "the method of Adams and Bashforth",
        'setting = "step"\norder = 4\none_step = false  # it keeps a memory',
        "0.01",
        _STEPS,
    ),
}

_WORKFLOW = ".github/workflows/heavytop.yml"


def check_integrator(integrator: str | Callable[..., Any]) -> list[Checked]:
    """What an integrator answers to every request of the contract, odd ones too.

    Arguments:
        integrator: a name that `heavytop list` shows, a file ("mine.toml", "./mine.py:solve") or a callable.

    Returns:
        A list of ``Checked``: ``check``, ``verdict`` ("kept", "violated" or "note") and ``text``, a sentence.

    Raises:
        InputError: for an unknown integrator, and a file that describes none.
    """
    return check(named(integrator))


def new_integrator(folder: Path, language: str, method: str = "step", into: Path | None = None) -> list[str]:
    """Write a program that integrates, with its gate, into a new folder; returns the names of the files in it.

    method: a fixed step, an adaptive one, or a multistep method.  into: a repository that ``folder`` lies in, which is
    given the workflow.  Raises InputError for an unknown language or method, a folder that holds anything, a workflow
    that exists, and what cannot be written.
    """
    for name, choices, noun in ((language, LANGUAGES, "program in"), (method, METHODS, "method")):
        if name not in choices:
            raise InputError(f"There is no {noun} {quoted(name)}.", f"Use {', '.join(choices)}.")
    files = _starter(LANGUAGES[language], METHODS[method], _texts(language), method)
    workflow = (into or folder) / _WORKFLOW
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder} already holds other content.", "Give a new folder.")
        if workflow.exists():
            raise InputError(f"{workflow} exists already.", "Move it away, or give another --into.")
        place = "." if into is None else folder.resolve().relative_to(into.resolve()).as_posix()
        files[_WORKFLOW] = files[_WORKFLOW].replace("WHERE", place)
        for name, text in sorted(files.items()):
            path = workflow if name == _WORKFLOW else folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            replace(path, text.encode())
    except ValueError:
        raise InputError(f"{folder} is not in {into}.", "Give a folder of that repository.") from None
    except OSError as error:
        raise InputError(f"{folder} cannot be written: {error.strerror}.", "Give a folder that can be.") from None
    return sorted(files)


def _starter(about: Language, method: Method, program: dict[str, str], name: str) -> dict[str, str]:
    """The files of a starter by their names, with the workflow under its own."""
    parts = {part: program.pop(part) for part in METHODS}
    files = _texts("common") | program
    files[_WORKFLOW], files[".gitignore"] = files.pop("workflow.yml"), files.pop("gitignore")
    files[about.file] = re.sub(r"^.*\bMETHOD\b.*\n", lambda _: parts[name], files[about.file], flags=re.MULTILINE)
    words = {"COMMAND": about.command, "LANGUAGE": about.title, "BUILD": about.build, "FILE": about.file}
    words |= {"TITLE": method.title, "KEYS": method.keys, "CONTROL": method.control, "LADDER": method.ladder}
    words["MADE_FROM"] = (commit() or "HEAD").removesuffix("-dirty")
    pattern = re.compile(rf"\b({'|'.join(words)})(?=_dp\b|\b)")
    texts = {"mine.toml", "gate.toml", "README.md", _WORKFLOW, about.file}
    return {file: pattern.sub(lambda m: words[m[1]], text) if file in texts else text for file, text in files.items()}


def _texts(part: str) -> dict[str, str]:
    """The files of that part, by name."""
    place = resources.files("heavytop.api") / "starters" / part
    return {each.name.removesuffix(".txt"): each.read_text("utf-8") for each in place.iterdir() if each.is_file()}


# What there is to choose from.


def listing() -> dict[str, Any]:
    """Cases, bodies, plans, systems, formats, integrators and what these can do, as `list --json` prints them."""
    from heavytop.cases import CASES, named_bodies
    from heavytop.harness.plan import BUILT_IN
    from heavytop.integrate import registry
    from heavytop.precision import FORMATS, available
    from heavytop.top.equations import SYSTEMS

    notes = {form.name: f"{form.bits} bits" for form in FORMATS} | {"real": "24 to 20000 bits"}
    known, reasons = registry.known(), registry.available()
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


def case_document(name: str) -> dict[str, Any]:
    """The data of a case, and the text of them in every form that is read, as `list --case NAME --json` prints them.

    Raises InputError for an unknown name.
    """
    from heavytop.cases import case
    from heavytop.harness.case_text import case_data, forms

    found = case(name)
    return case_data(found) | {"about": found.about, "source": found.source, "units": found.units} | forms(found)
