"""Audits here look for assumptions that would decide a claim for a moment alone: test_conditions.py has that search."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def a_short_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of a second in place of six: the verdict stands before it."""
    monkeypatch.setattr("heavytop.features.claims.audit.audit._SEARCH", 0.1)
