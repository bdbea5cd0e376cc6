"""The integrators that compute a motion from any start in every format, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from heavytop.errors import InputError
from heavytop.integrate.trajectory import Trajectory


def named(name: str) -> Callable[..., Trajectory]:
    """``propagate`` of heyoka or of words, which take the same arguments; raises InputError for any other name."""
    choices: dict[str, Callable[..., Trajectory]] = {"heyoka": _heyoka, "words": _words}
    if name not in choices:
        raise InputError(f"Unknown integrator {name[:60]!r}.", "Use heyoka or words.")
    return choices[name]


def _heyoka(*arguments: Any, **options: Any) -> Trajectory:
    from heavytop.integrate.taylor import propagate

    return propagate(*arguments, **options)


def _words(*arguments: Any, **options: Any) -> Trajectory:
    from heavytop.integrate.words import propagate_words

    return propagate_words(*arguments, **options)
