"""The errors of single steps, and the order that they show."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:LocalErrorKind",),
)
