"""Integrators on homoclinic motions, and how the time of their escape grows with the bits."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:Homoclinic", "break_away_law:BreakAwayLaw"),
)
