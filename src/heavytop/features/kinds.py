"""The kinds of measurement, one a file, in the order of the summary.  A new one is a file and a line here."""

from __future__ import annotations

from heavytop.features.claims.kinds.audit import AuditKind
from heavytop.features.claims.kinds.claim_evaluation import ClaimEvaluation
from heavytop.features.claims.kinds.claim_model import ClaimModel
from heavytop.features.drift.kind import DriftKind
from heavytop.features.growth.kind import Growth
from heavytop.features.homoclinic.break_away_law import BreakAwayLaw
from heavytop.features.homoclinic.kind import Homoclinic
from heavytop.features.hunt.kind import HuntKind
from heavytop.features.local_error.kind import LocalErrorKind
from heavytop.features.score.kind import ScoreKind
from heavytop.features.survey.kind import Survey
from heavytop.features.work_precision.kind import WorkPrecision
from heavytop.kind import Kind

_ALL: tuple[Kind, ...] = (
    AuditKind(),
    ClaimModel(),
    ClaimEvaluation(),
    Homoclinic(),
    BreakAwayLaw(),
    LocalErrorKind(),
    DriftKind(),
    ScoreKind(),
    WorkPrecision(),
    Growth(),
    HuntKind(),
    Survey(),
)
KINDS: dict[str, Kind] = {kind.name: kind for kind in _ALL}
"""Each kind by its name in plans and rows."""
