"""Python integrators outside of any package: a function in a file, and a callable.

Each is a :class:`heavytop.integrate.registry.IntegratorSource`: it has the name shown in rows, and can be sent to
another process.
"""

from __future__ import annotations

import importlib.util
import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

from heavytop.errors import InputError, NoSuchIntegrator, PeerFailed, meant
from heavytop.files import readable
from heavytop.integrate.peers.contract import contained, quiet, said

_FORMS = "A peer takes (top, start, times, precision, *, system, tolerance), a solver takes what is given alone."


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
        """The peer; the file is run again if it has changed."""
        path = Path(self.path)
        with readable(path, "Give FILE.py:FUNCTION."):
            status = path.stat()
        module: Any = _module(path, (status.st_mtime_ns, status.st_size))
        try:
            call = attrgetter(self.function)(module)
        except AttributeError:
            functions = {name: item for name, item in vars(module).items() if inspect.isfunction(item)}
            own = (name for name, item in functions.items() if item.__module__ == module.__name__)
            defined = [*own, *(name for name, item in functions.items() if hasattr(item, "integrator_name"))]
            remedy = f"{meant(self.function, defined)}It defines {', '.join(defined) or 'no function'}."
            raise NoSuchIntegrator(f"{self.path} does not define {self.function}.", remedy) from None
        return as_peer(call, self.name)


@dataclass(frozen=True, slots=True)
class PythonObject:
    """A callable of this process.

    It is sent to another process as its file and name if it is defined at module level, else by cloudpickle.
    """

    name: str
    call: Callable[..., Any]

    def load(self) -> Callable[..., Any]:
        """The peer."""
        return as_peer(self.call, self.name)

    def __reduce__(self) -> tuple[Any, ...]:
        file, function = place_of(self.call)
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


def place_of(call: Any) -> tuple[str, str]:
    """(file, name) of an object at module level, outside of the main script; ("", name) for any other."""
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
    """The module in that file, run again only if ``state`` has changed; its folder is added to ``sys.path``."""
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
        raise InputError(f"{path} is broken: {type(error).__name__}: {said(error)}.", "Correct it.") from error
    _modules[path] = state, module
    return module


def as_peer(call: Any, name: str) -> Callable[..., Any]:
    """``call`` as a peer: itself, or an adapter around a solver, which takes one argument."""
    if isinstance(call, type) or not callable(call):
        raise InputError(f"The integrator {name} is a {type(call).__name__}, not a function.", _FORMS)
    if inspect.iscoroutinefunction(call):
        raise InputError(f"The integrator {name} is a coroutine, not a function.", "Define it without async.")
    try:
        with contained(name, " when its arguments were looked at"):
            arguments = inspect.signature(call).parameters.values()
    except PeerFailed as error:
        raise InputError(f"{error.cause}.", _FORMS) from None
    positional = [arg for arg in arguments if arg.kind in (arg.POSITIONAL_ONLY, arg.POSITIONAL_OR_KEYWORD)]
    several = any(arg.kind is arg.VAR_POSITIONAL for arg in arguments) or len(positional) >= 4
    if several:
        return call  # type: ignore[no-any-return]
    if len(positional) == 1 or (positional and all(arg.default is not arg.empty for arg in positional[1:])):
        from heavytop.integrate.peers.double import double_peer

        return double_peer(name, 0, call)
    raise InputError(f"The integrator {name} takes {len(positional)} arguments.", _FORMS)
