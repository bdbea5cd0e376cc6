"""Drift of the first integrals, and distance to the true motion."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:DriftKind",),
)
