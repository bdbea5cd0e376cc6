"""What the kinds about the formulas of a claim share."""

from __future__ import annotations

from collections.abc import Iterator

from heavytop.claims.ershkov import PartialCase
from heavytop.errors import InputError
from heavytop.suite.cases import Case
from heavytop.suite.kind import Find
from heavytop.suite.task import Task

CLAIM = "claimed: (4.2)-(4.6)"
MODEL_ERROR, EVALUATION_ERROR, INTEGRATION_ERROR = "claim_model_error", "claim_evaluation_error", "integration_error"
"""The three errors of a claim: of its formulas, of their evaluation in a format, of an integrator on their motion."""


def claimed(find: Find, names: list[str]) -> Iterator[Case]:
    """The cases of these names; raises InputError for one about which nothing is claimed."""
    for case in map(find, names):
        if case.claim is None:
            raise InputError(f"Nothing is claimed about the case {case.name}.", "Use a case such as ershkov-partial-2.")
        yield case


def claim_of(task: Task) -> PartialCase:
    """The claim of a task about one."""
    claim = task.given.claim
    assert claim is not None
    return claim
