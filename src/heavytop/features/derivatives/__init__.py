"""Jacobians computed elsewhere, scored against proven ones."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    python={"api": ("DerivativeScore", "score_derivatives")},
)
