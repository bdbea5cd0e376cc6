"""The limits of a motion: when digits end, which faults a test of it detects, how well samples fix what is between."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    commands=("command",),
    motion="options:LimitOptions",
    python={
        "digits_end": ("digits_end",),
        "power": ("power",),
        "between": ("between_samples",),
    },
)
