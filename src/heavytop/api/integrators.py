"""Integrators of one's own, from Python: their contract, and a folder to begin with."""

from __future__ import annotations

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

_WORKFLOW = ".github/workflows/heavytop.yml"


def check_integrator(integrator: str | Callable[..., Any]) -> list[Checked]:
    """The answers of an integrator to every request of the contract, odd ones too.

    Arguments:
        integrator: a name that `heavytop list` shows, a file ("mine.toml", "./mine.py:solve") or a callable.

    Returns:
        A list of ``Checked``: ``check``, ``verdict`` ("kept", "violated" or "note") and ``text``, a sentence.

    Raises:
        InputError: for an unknown integrator, and a file that describes none.
    """
    return check(named(integrator))


def new_integrator(folder: Path, language: str) -> list[str]:
    """Write a program that integrates, with its gate, into a new folder; returns the names of the files.

    Raises InputError for an unknown language, a folder that holds anything and one that cannot be written.
    """
    if language not in LANGUAGES:
        raise InputError(f"There is no program in {quoted(language)}.", f"Use {', '.join(LANGUAGES)}.")
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder} already holds other content.", "Give a new folder.")
        about = LANGUAGES[language]
        files = _texts("common") | _texts(language)
        files[_WORKFLOW], files[".gitignore"] = files.pop("workflow.yml"), files.pop("gitignore")
        words = {"COMMAND": about.command, "LANGUAGE": about.title, "BUILD": about.build, "FILE": about.file}
        words["MADE_FROM"] = (commit() or "HEAD").removesuffix("-dirty")
        for name in ("mine.toml", "README.md", _WORKFLOW):
            for word, text in words.items():
                files[name] = files[name].replace(word, text)
        for name, text in sorted(files.items()):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            replace(folder / name, text.encode())
    except OSError as error:
        raise InputError(f"{folder} cannot be written: {error.strerror}.", "Give a folder that can be.") from None
    return sorted(files)


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
