"""Integrators that no package installs: a program described in TOML, a function in a Python file, a callable.

Each is an :class:`IntegratorSource`: it has a name, which rows bear, and what it needs to be called in another process
travels with it.  :func:`named` makes one from what a user writes, ``mine.toml``, ``./mine.py:solve`` or a callable.
"""

from __future__ import annotations

import importlib.util
import inspect
import re
import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import msgspec

from heavytop.errors import HeavyTopError, InputError, PeerFailed, quoted
from heavytop.integrate.integrator import INTEGRATORS, IntegratorSource
from heavytop.integrate.peers.command import Command
from heavytop.integrate.peers.contract import contained, quiet, said
from heavytop.precision import exact, parse
from heavytop.records import INTEGRATORS as FORMER
from heavytop.records import current
from heavytop.top.equations import system

_NAME = r"[A-Za-z0-9][A-Za-z0-9._:+-]{0,63}"
_PYTHON = re.compile(r"(?s)(.+\.py):([A-Za-z_][\w.]*)")
_TOML = re.compile(r"(?s)(.+\.toml)(?::(.*))?")
_SHOWN = "`heavytop docs programs` shows every key."
_FORMS = "A peer takes (top, start, times, precision, *, system, tolerance), a solver takes what is given alone."
_MOST_SECONDS = 10**7


@dataclass(frozen=True, slots=True)
class PythonFile:
    """A function of a Python file: a peer, or a solver as :func:`double_peer` takes it."""

    path: str
    function: str

    @property
    def name(self) -> str:
        """``mine.py:solve``."""
        return f"{Path(self.path).name}:{self.function}"

    def load(self) -> Callable[..., Any]:
        """The peer; the file is run anew where it has changed."""
        path = Path(self.path)
        try:
            status = path.stat()
        except OSError as error:
            raise InputError(f"{self.path} cannot be read: {error.strerror}.", "Give FILE.py:FUNCTION.") from None
        found: Any = _module(path, (status.st_mtime_ns, status.st_size))
        for part in self.function.split("."):
            try:
                found = getattr(found, part)
            except AttributeError:
                raise InputError(f"{self.path} has no {self.function}.", "Give FILE.py:FUNCTION.") from None
        return as_peer(found, self.name)


@dataclass(frozen=True, slots=True)
class PythonObject:
    """A callable of this process.

    To another process it goes by its file, where it stands at the top of a module, else by cloudpickle.
    """

    name: str
    call: Callable[..., Any]

    def load(self) -> Callable[..., Any]:
        """The peer."""
        return as_peer(self.call, self.name)

    def __reduce__(self) -> tuple[Any, ...]:
        file, function = _place(self.call)
        if file and self.name == PythonFile(file, function).name:
            return PythonFile, (file, function)
        try:
            import cloudpickle
        except ImportError:
            raise InputError(
                f"The integrator {self.name} cannot be sent to another process.",
                "Define it at the top of a module, give it as FILE.py:FUNCTION, or install cloudpickle.",
            ) from None
        return _unpickled, (self.name, cloudpickle.dumps(self.call))


def _place(call: Any) -> tuple[str, str]:
    """File and name of what stands at the top of a module other than the main script; else the name behind ""."""
    function = getattr(call, "__qualname__", type(call).__name__)
    module = sys.modules.get(getattr(call, "__module__", None) or "")
    file = getattr(module, "__file__", None) or ""
    at_top = file.endswith(".py") and module is not sys.modules.get("__main__")
    return (str(Path(file).resolve()) if at_top and getattr(module, function, None) is call else ""), function


def _unpickled(name: str, content: bytes) -> PythonObject:
    import cloudpickle

    return PythonObject(name, cloudpickle.loads(content))


_modules: dict[Path, tuple[tuple[int, int], Any]] = {}


def _module(path: Path, state: tuple[int, int]) -> Any:
    """The module in that file, run once as long as it does not change; its folder can be imported from."""
    known = _modules.get(path)
    if known is not None and known[0] == state:
        return known[1]
    spec = importlib.util.spec_from_file_location(f"heavytop_integrator_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module.__name__] = module
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    try:
        with quiet():
            spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever a user's file does when it is run
        raise InputError(f"{path} is broken: {type(error).__name__}: {said(error)}.", "Mend it.") from error
    _modules[path] = state, module
    return module


def as_peer(call: Any, name: str) -> Callable[..., Any]:
    """``call`` as a peer: itself, or around a solver, which takes one argument."""
    if isinstance(call, type) or not callable(call):
        raise InputError(f"The integrator {name} is a {type(call).__name__}, not a function.", _FORMS)
    if inspect.iscoroutinefunction(call):
        raise InputError(f"The integrator {name} is a coroutine, not a function.", "Define it without async.")
    try:
        with contained(name, " when its arguments were looked at"):
            arguments = inspect.signature(call).parameters.values()
    except PeerFailed as error:
        raise InputError(f"{error.cause}.", _FORMS) from None
    positional = [each for each in arguments if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD)]
    several = any(each.kind is each.VAR_POSITIONAL for each in arguments) or len(positional) >= 4
    if several:
        return call  # type: ignore[no-any-return]
    if len(positional) == 1 or (positional and all(each.default is not each.empty for each in positional[1:])):
        from heavytop.integrate.peers.double import double_peer

        return double_peer(name, 0, call)
    raise InputError(f"The integrator {name} takes {len(positional)} arguments.", _FORMS)


def named(integrator: Any, folder: Path | None = None) -> str | IntegratorSource:
    """The integrator that a user names: its name of now where it is the name of one, else its source.

    folder: what paths are relative to; None for the working directory.
    Raises InputError for a file that describes none, or several.
    """
    if not isinstance(integrator, str):
        return of_callable(integrator)
    python, toml = _PYTHON.fullmatch(integrator), _TOML.fullmatch(integrator)
    if python is None and toml is None:
        return current(integrator)  # the working directory may be gone
    base = (folder or Path()).absolute()
    if python is not None:
        return PythonFile(str((base / python[1]).resolve()), python[2])
    assert toml is not None
    match, path, wanted = toml, base / toml[1], toml[2]
    found = [each for each in commands_in(path) if wanted in (None, each.name)]
    if len(found) != 1:
        known = ", ".join(each.name for each in commands_in(path))
        raise InputError(f"{integrator} is not one integrator: {path.name} has {known}.", f"Give {match[1]}:NAME.")
    return found[0]


def of_callable(call: Any) -> IntegratorSource:
    """A callable under the name that it gives itself, or of its file and function."""
    if isinstance(call, Command | PythonFile | PythonObject):
        return call
    if not callable(call):
        raise InputError(f"integrator = {quoted(call)} is none.", "Give a name, a file or a callable.")
    own = getattr(call, "integrator_name", None)
    file, function = _place(call)
    plain = PythonFile(file, function).name if file else re.sub(r"[^\w.:+-]", "", function)[:64]
    return PythonObject(own if isinstance(own, str) and own else plain or "callable", call)


def commands_in(path: Path) -> list[Command]:
    """The programs that a TOML file describes; raises InputError for anything else in it."""
    try:
        text = path.read_text("utf-8")
        document = tomllib.loads(text)
    except (OSError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path} cannot be read: {error}.", "Give a readable TOML file.") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path} is not valid: {error}.", _SHOWN) from None
    tables = document.get("integrator")
    if document.keys() - {"integrator"} or not isinstance(tables, list) or not tables:
        raise InputError(f"{path} does not hold [[integrator]] tables alone.", _SHOWN)
    found = [command_of(table, path.parent, str(path)) for table in tables]
    if len({each.name for each in found}) < len(found):
        raise InputError(f"{path} gives one name to two integrators.", "Give each a name of its own.")
    return found


def command_of(table: Any, folder: Path, where: str) -> Command:
    """The program of a table `[[integrator]]`; raises InputError for an impossible value, with ``where`` it stands."""
    try:
        if isinstance(table, dict) and "folder" in table:
            raise msgspec.ValidationError("Object contains unknown field `folder`")
        command = msgspec.structs.replace(msgspec.convert(table, Command), folder=str(folder.absolute()))
        _require_possible(command)
    except (msgspec.ValidationError, HeavyTopError) as error:
        cause = error.cause if isinstance(error, HeavyTopError) else f"{error}."
        raise InputError(f"{where}: [[integrator]] is not valid: {cause}", _SHOWN) from None
    return command


def _require_possible(command: Command) -> None:
    if not re.fullmatch(_NAME, command.name):
        raise InputError(f"the name {quoted(command.name)} is not letters, digits and ._:+- alone.")
    if command.name in INTEGRATORS or command.name in FORMER:
        raise InputError(f"the name {command.name} is that of a built-in integrator.")
    if not command.command or not all(part and "\0" not in part for part in command.command[:1]):
        raise InputError("command is empty.")
    if any("\0" in part for part in command.command):
        raise InputError("command holds a NUL character.")
    if not isinstance(command.timeout, str) and command.timeout != command.timeout:
        raise InputError("timeout is not a number.")
    if not 0 < exact(str(command.timeout)) <= _MOST_SECONDS:
        raise InputError(f"timeout = {quoted(command.timeout)} is not above 0 and up to {_MOST_SECONDS} seconds.")
    if command.order < 0:
        raise InputError(f"order = {command.order} is below 0.")
    for name, values in (("systems", command.systems), ("directions", command.directions)):
        if not values:
            raise InputError(f"{name} is empty.")
    for each in command.systems:
        system(each)
    for each in command.precisions:
        if each != "real:BITS":
            parse(each)
    if not command.precisions:
        raise InputError("precisions is empty.")


def seconds_of(value: Any, what: str) -> float:
    """A time limit in seconds; raises InputError unless it is above 0."""
    seconds: Fraction = exact(value)
    if not 0 < seconds <= _MOST_SECONDS:
        raise InputError(f"{what} = {quoted(value)} is not a time limit.", f"Give seconds, up to {_MOST_SECONDS}.")
    return float(seconds)
