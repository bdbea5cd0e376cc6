"""Claimed motions: published formulas, as printed, and what becomes of them."""

from heavytop.feature import Feature

FEATURE = Feature(
    __name__,
    kinds=("kinds.audit:AuditKind", "kinds.claim_model:ClaimModel", "kinds.claim_evaluation:ClaimEvaluation"),
    commands=("command",),
    python={"api": ("Audit", "ClaimLibrary", "audit", "claim_library")},
)
