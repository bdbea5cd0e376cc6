"""The features, one package each: tables, measurement, document, charts, Python interface and command.

Each package registers its parts in a :class:`heavytop.feature.Feature`; none imports another, and no shared module
imports one.  A new feature is a package and a line here.
"""

from __future__ import annotations

from importlib import import_module

from heavytop.feature import Feature

NAMES = (
    "claims",
    "homoclinic",
    "local_error",
    "drift",
    "score",
    "work_precision",
    "growth",
    "hunt",
    "survey",
    "events",
    "derivatives",
    "body",
    "limits",
    "engines",
)
"""The packages, in the order of the summary of a run."""
FEATURES: tuple[Feature, ...] = tuple(import_module(f"{__name__}.{name}").FEATURE for name in NAMES)
