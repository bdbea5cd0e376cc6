"""Motions computed elsewhere: their files, their digits, and what explains their errors."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kind:ScoreKind",),
    commands=("command",),
    python={"api": ("Score", "Summary", "drift", "score")},
    explain="explanation:explanation",
)
