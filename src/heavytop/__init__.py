"""heavytop measures how wrong computed and claimed motions of a heavy top are, against references that are proven.

The public names; each is imported when it is first used, so that ``import heavytop`` loads nothing heavy.
"""

from importlib import import_module
from typing import Any

_PUBLIC = {
    "HeavyTop": "heavytop.top.heavy_top",
    "State": "heavytop.top.heavy_top",
    "HEAVY_TOP": "heavytop.top.equations",
    "GYROSTAT": "heavytop.top.equations",
    "holding": "heavytop.top.integrals",
    "DOUBLE": "heavytop.precision",
    "EXTENDED": "heavytop.precision",
    "QUAD": "heavytop.precision",
    "real": "heavytop.precision",
    "available": "heavytop.precision",
    "propagate": "heavytop.integrate.taylor",
    "Trajectory": "heavytop.integrate.trajectory",
    "Outcome": "heavytop.integrate.trajectory",
    "HeavyTopError": "heavytop.errors",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'heavytop' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)
