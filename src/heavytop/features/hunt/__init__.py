"""The search for the motion that breaks an integrator: drawing, measuring, searching, shrinking, proving."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:HuntKind",),
    commands=("command",),
    python={"api": ("Hunt", "hunt")},
)
