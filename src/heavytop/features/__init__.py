"""The features, a package each: its tables, measurement, document, charts, Python and command.

Each package says in a :class:`heavytop.feature.Feature` what it adds; none imports another, and no shared room imports
one.  A new feature is a package and a line here.
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
"""In the order of the summary of a run."""
FEATURES: tuple[Feature, ...] = tuple(import_module(f"{__name__}.{name}").FEATURE for name in NAMES)
