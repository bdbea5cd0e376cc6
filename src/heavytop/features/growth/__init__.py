"""How drift and error grow with the horizon."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:Growth",),
)
