"""Many motions of a sweep: a record each, and what they come to together."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:Survey",),
    python={"api": ("read_survey",)},
)
