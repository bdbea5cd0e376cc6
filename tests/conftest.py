"""Unloads the integrators that a test loaded from its own folder."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

from support.in_process import forget_integrators


@pytest.fixture(autouse=True)
def integrators_of_a_test_end_with_it() -> Iterator[None]:
    """Two tests may call theirs by one name."""
    loaded = set(sys.modules)
    yield
    forget_integrators(loaded)
