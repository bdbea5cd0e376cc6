"""Optional packages of the installation, and the error if one is missing."""

from __future__ import annotations

import sys
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from threading import Lock
from typing import Any

from heavytop.errors import MissingExtra

EXTRAS = {
    "claims": ("sympy",),
    "multiword": ("llvmlite",),
    "parquet": ("pyarrow",),
    "plots": ("matplotlib",),
    "peers": ("scipy", "CyRK", "numba", "sksundae", "diffrax"),
    "cluster": ("dask", "distributed"),
    "logs": ("rosbags",),
}
"""The modules of each extra of ``pyproject.toml`` that the program imports."""


def has_extra(name: str) -> bool:
    """Whether every module of an extra is installed."""
    return all(find_spec(module) for module in EXTRAS[name])


def install(name: str) -> str:
    """The command that installs an extra."""
    return f"pip install 'heavytop[{name}]'"


def extra_of(module: str) -> str:
    """The extra that a module belongs to."""
    return next(extra for extra, modules in EXTRAS.items() if module in modules)


def missing(name: str, what: str = "This") -> MissingExtra:
    """The error if an extra that ``what`` needs is not installed."""
    return MissingExtra(f"{what} needs the extra {name}: {install(name)}")


def require_extra(name: str) -> None:
    """Raise MissingExtra if a module of the extra is not installed."""
    if not has_extra(name):
        raise missing(name)


alone = False
"""Whether heyoka is imported without the packages that it converts to and from, as in the process of a command."""
_CONVERTED = "sympy", "mpmath"
_loading = Lock()


@cache
def import_heyoka() -> Any:
    """heyoka, imported when it is used; in a third of the time if :data:`alone`."""
    with _loading:
        hidden = [name for name in _CONVERTED if alone and not {name, "heyoka"} & sys.modules.keys()]
        sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]  # as if they were not installed
        try:
            return import_module("heyoka")
        finally:
            for name in hidden:
                del sys.modules[name]


class Stub:
    """A stand-in for a module that is not installed: any attribute and any call of it is the stand-in itself."""

    def __getattr__(self, _: str) -> Stub:
        return self

    def __call__(self, *_: object) -> Stub:
        return self
