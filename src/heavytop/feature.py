"""The record by which a feature registers its parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any


@dataclass(frozen=True, slots=True)
class Feature:
    """A package of ``features/`` and its parts, each a ``MODULE:NAME`` in the package, imported when used.

    kinds: its kinds of measurement, classes of :class:`heavytop.kind.Kind`.
    commands: modules that add commands to the command line when they are imported.
    python: the names that it adds to :mod:`heavytop`, by module.
    motion: options of `propagate` and `reference`, a class of :class:`heavytop.cli.motions.MotionOptions`.
    plans: built-in plans, each a file NAME.toml of the package.
    starters: a folder of the package, with adapters that `heavytop new --engine` copies.
    explain: a function of a case, its run and the largest error of that, which returns an explanation of the error.
    """

    package: str
    kinds: tuple[str, ...] = ()
    commands: tuple[str, ...] = ()
    python: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    motion: str = ""
    plans: tuple[str, ...] = ()
    starters: str = ""
    explain: str = ""

    def load(self, name: str) -> Any:
        """The module ``MODULE``, or its attribute ``NAME``."""
        module, _, attribute = name.partition(":")
        part = import_module(f"{self.package}.{module}")
        return getattr(part, attribute) if attribute else part
