"""When a function of the state changes sign: of computed trajectories, and proven."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    motion="options:EventOptions",
    python={"api": ("events", "poincare"), "functions": ("Events", "ReferenceEvents", "Section")},
)
