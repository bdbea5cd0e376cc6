"""New integrators, from Python: checks of their contract, and a starter folder."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from heavytop.errors import InputError, quoted
from heavytop.features import FEATURES
from heavytop.files import replace, require_new, writable
from heavytop.integrate.registry import named
from heavytop.top.bodies import Body
from heavytop.version import commit

if TYPE_CHECKING:
    from heavytop.harness.integrator_check import Checked
    from heavytop.top.equations import System
    from heavytop.top.heavy_top import HeavyTop


class Language(NamedTuple):
    """A language of `heavytop new`: title, source file, command and build command of the program."""

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
    """A method of `heavytop new`: title, keys of its table, control parameter, and points of the plan."""

    title: str
    keys: str
    control: str
    points: str


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
    """Check an integrator with every request of the contract, including edge cases.

    Arguments:
        integrator: a name that `heavytop list` shows, a file ("mine.toml", "./mine.py:solve") or a callable.

    Returns:
        A list of ``Checked``: ``check``, ``verdict`` ("kept", "violated" or "note") and ``text``, a sentence.

    Raises:
        InputError: for an unknown integrator, and a file without one.
    """
    from heavytop.harness.integrator_check import check

    return check(named(integrator))


def new_integrator(
    folder: Path, language: str, method: str = "step", into: Path | None = None, engine: str = ""
) -> list[str]:
    """Write a program that integrates, with its gate, into a new folder; returns the names of the files in it.

    method: a fixed step, an adaptive one, or a multistep method.  into: a repository that contains ``folder`` and
    gets the workflow.  engine: write the adapter of that rigid-body engine instead of a program.
    Raises InputError for an unknown language, method or engine, a folder that is not empty, an existing workflow, and
    files that cannot be written.
    """
    for name, choices, noun in ((language, LANGUAGES, "language"), (method, METHODS, "method")):
        if name not in choices:
            raise InputError(f"Unknown {noun} {quoted(name)}.", f"Use {', '.join(choices)}.")
    if engine and engine not in (known := engines()):
        raise InputError(f"engine must have an adapter; got {quoted(engine)}.", f"Use {', '.join(known)}.")
    if engine and (language, method) != ("python", "step"):
        raise InputError(f"An adapter is in Python, without a method; got {language}, {method}.", "Leave them out.")
    workflow = (into or folder) / _WORKFLOW
    with writable(folder, "Give a writable folder."):
        require_new(folder, "Give a new folder.")
        if workflow.exists():
            raise InputError(f"{workflow} already exists.", "Move it away, or give another --into.")
        if into is not None and not folder.resolve().is_relative_to(into.resolve()):
            raise InputError(f"{folder} is not in {into}.", "Give a folder of that repository.")
        home = "." if into is None else folder.resolve().relative_to(into.resolve()).as_posix()
        files = _adapter(engine, home) if engine else _program(language, method, home)
        for name, text in sorted(files.items()):
            path = workflow if name == _WORKFLOW else folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            replace(path, text.encode())
    return sorted(files)


def _program(language: str, method: str, folder: str) -> dict[str, str]:
    """The files of a program by their names."""
    about, chosen = LANGUAGES[language], METHODS[method]
    files = _texts("common") | _texts(language)
    parts = {name: files.pop(name) for name in METHODS}
    files[".gitignore"], files[_WORKFLOW] = files.pop("gitignore"), files.pop("workflow.yml")
    files[about.file] = re.sub(r"^.*\bMETHOD\b.*\n", lambda _: parts[method], files[about.file], flags=re.MULTILINE)
    words = {"COMMAND": about.command, "LANGUAGE": about.title, "BUILD": about.build, "FILE": about.file}
    words |= {"TITLE": chosen.title, "KEYS": chosen.keys, "CONTROL": chosen.control, "POINTS": chosen.points}
    return {
        name: text if name in (".gitignore", "Makefile", "policy.toml") else _filled(text, words, folder)
        for name, text in files.items()
    }


def _filled(text: str, words: dict[str, str], folder: str) -> str:
    """A text with its words in capitals replaced.  folder: of the program in the repository."""
    words = words | {"MADE_FROM": (commit() or "HEAD").removesuffix("-dirty"), "WHERE": folder}
    return re.sub(rf"(?<![A-Za-z])({'|'.join(words)})(?![A-Za-z])", lambda match: words[match[1]], text)


# Adapters of rigid-body engines in features: NAME.toml, NAME_top.py, and a shared module.


def engines() -> list[str]:
    """The names of `heavytop new --engine`."""
    return sorted(path.name.removesuffix(".toml") for path in _adapters() if path.name.endswith(".toml"))


def _adapters() -> list[Traversable]:
    folders = (resources.files(feature.package) / feature.starters for feature in FEATURES if feature.starters)
    return [path for folder in folders for path in folder.iterdir() if path.is_file()]


def _adapter(engine: str, folder: str) -> dict[str, str]:
    """The files of an engine, with a gate for each of its integrators."""
    sources = {"engine.toml": f"{engine}.toml", **{name: name for name in (f"{engine}_top.py", "heavytop_engine.py")}}
    texts = {path.name: path.read_text("utf-8") for path in _adapters()}
    files = {name: texts[source] for name, source in sources.items()}
    tables = tomllib.loads(files["engine.toml"])["integrator"]
    line = '    {{ integrator = "{name}", {setting}s = {points} }},'
    points = (_POINTS["first order" if table.get("order") == 1 else table["setting"]] for table in tables)
    curves = (line.format(**table, points=json.dumps(values)) for table, values in zip(tables, points, strict=True))
    runs = "\n".join(_DRIFT.format(name=table["name"]) for table in tables)
    words = {"ENGINE": engine, "LADDERS": "\n".join(curves), "DRIFTS": runs, "FIRST": tables[-1]["name"]}
    words["INSTALL"] = files["engine.toml"].partition(": ")[2].partition("\n")[0]
    words |= {"BUILD": words["INSTALL"].replace("pip", "python -m pip"), "mine.toml": f"engine.toml:{words['FIRST']}"}
    texts[f"{_WORKFLOW}.txt"] = _texts("common")["workflow.yml"]
    return files | {
        name: _filled(texts[f"{name}.txt"], words, folder) for name in ("gate.toml", "README.md", _WORKFLOW)
    }


_POINTS = {
    "step": ["1/50", "1/100", "1/200", "1/400"],
    "first order": ["1/500", "1/1000", "1/2000", "1/4000"],  # a mistake can be identified from two digits on
    "tolerance": ["1e-4", "1e-6", "1e-8", "1e-10"],
}
_DRIFT = """
[[measure]]
kind = "drift"
cases = ["lagrange"]
integrator = "{name}"
attitude = true
noise = false
runs = [{{ precision = "double", horizon = "10", samples = 50 }}]"""


def _texts(part: str) -> dict[str, str]:
    """The texts of the starter files of a part, by name."""
    folder = resources.files("heavytop.api") / "starters" / part
    return {file.name.removesuffix(".txt"): file.read_text("utf-8") for file in folder.iterdir() if file.is_file()}


# Lists of cases, formats and integrators.


def listing(checked: bool = True) -> dict[str, Any]:
    """Cases, bodies, plans, systems, formats, and integrators with their capabilities, as `list --json` prints them.

    checked: whether the formats are checked with the installed heyoka, which is imported.
    """
    from heavytop.cases import CASES, described_bodies
    from heavytop.harness import BUILT_IN
    from heavytop.integrate import registry
    from heavytop.precision import FORMATS, available
    from heavytop.top.equations import SYSTEMS, system_of

    notes = {form.name: f"{form.bits} bits" for form in FORMATS} | {"real": "24 to 20000 bits"}
    lacking = available() if checked else dict.fromkeys(notes)
    known, reasons = registry.known(), registry.available()
    integrators = {
        name: reasons[name] or (entry.formats_text if entry.streams else "") or "installed"
        for name, entry in sorted(known.items(), key=lambda item: not item[1].streams)
    }
    return {
        "cases": [_listed(case.name, case.system, case.about, case.top) for case in CASES.values()],
        "bodies": [
            _listed(name, system_of(None, body), about, body.top) for name, (about, body) in described_bodies().items()
        ],
        "plans": list(BUILT_IN),
        "systems": [system.name for system in SYSTEMS],
        "formats": {
            "real:BITS" if name == "real" else name: notes[name] if reason is None else f"not available: {reason}"
            for name, reason in lacking.items()
        },
        "integrators": integrators,
        "capabilities": {name: entry.capabilities() for name, entry in known.items()},
    }


def _listed(name: str, system: System, about: str, top: HeavyTop) -> dict[str, Any]:
    return {
        "name": name,
        "system": system.name,
        "about": about,
        "realisable": Body.realising(top) is not None,
    }


def case_document(name: str) -> dict[str, Any]:
    """The data of a case, and their text in every input format, as `list --case NAME --json` prints them.

    Raises InputError for an unknown name.
    """
    from heavytop.cases import case
    from heavytop.harness.case_text import case_data, forms

    named = case(name)
    return case_data(named) | {"about": named.about, "source": named.source, "units": named.units} | forms(named)
