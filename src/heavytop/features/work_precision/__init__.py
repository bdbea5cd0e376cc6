"""Seconds against error, over tolerances or steps."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:WorkPrecision",),
)
