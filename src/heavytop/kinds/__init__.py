"""The kinds of measurement, one a file, in the order of the summary.  A new one is a file and a line here."""

from __future__ import annotations

from heavytop.kinds.audit import AuditKind
from heavytop.kinds.base import Kind
from heavytop.kinds.break_away_law import BreakAwayLaw
from heavytop.kinds.claim_evaluation import ClaimEvaluation
from heavytop.kinds.claim_model import ClaimModel
from heavytop.kinds.drift import DriftKind
from heavytop.kinds.growth import Growth
from heavytop.kinds.homoclinic import Homoclinic
from heavytop.kinds.hunt import HuntKind
from heavytop.kinds.local_error import LocalErrorKind
from heavytop.kinds.score import ScoreKind
from heavytop.kinds.survey import Survey
from heavytop.kinds.work_precision import WorkPrecision

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
