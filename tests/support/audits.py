"""Audits in the process of the tests: `tests/features/claims/test_guard.py` has the one that they have otherwise."""

import pytest

from heavytop.errors import HeavyTopError, InputError
from heavytop.features.claims.audit import audit as auditing
from heavytop.features.claims.audit.judge import Audit
from heavytop.top.equations import system


def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every audit of a file run in this process, one after the other: it starts no interpreter and no sympy."""

    def in_time(path: str, system_name: str, seconds: float = 0) -> Audit:
        try:
            return auditing.audit_claim(auditing.find_claim(path), system(system_name) if system_name else None)
        except HeavyTopError as error:
            raise InputError(error.cause, error.remedy) from None

    monkeypatch.setattr(auditing, "in_time", in_time)
    monkeypatch.setattr(auditing, "processors", lambda: 1)
