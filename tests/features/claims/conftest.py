"""Audits here run in this process, and look for assumptions that would decide a claim for a moment alone.

test_guard.py has the process of its own, test_conditions.py that search.
"""

import pytest

from support import audits


@pytest.fixture(autouse=True)
def short_audits(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of a second of search in place of six: the verdict stands before it."""
    monkeypatch.setattr("heavytop.features.claims.audit.user_claims._SEARCH", 0.1)
    if request.path.name != "test_guard.py":
        audits.here(monkeypatch)
