"""Growth laws of drift and error."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:Growth",),
)
