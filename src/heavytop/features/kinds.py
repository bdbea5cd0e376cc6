"""The kinds of measurement of all features, in the order of the summary of a run."""

from __future__ import annotations

from heavytop.features import FEATURES
from heavytop.kind import Kind

_ALL: list[Kind] = [feature.load(name)() for feature in FEATURES for name in feature.kinds]
KINDS = {kind.name: kind for kind in _ALL}
"""Each kind by its name in plans and rows."""
