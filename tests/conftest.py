"""Marks the tests of slow.txt as `slow`: ``FILE`` or ``FILE::FUNCTION``, a third of a second in all its cases.

And unloads the integrators that a test loaded from its own folder.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.in_process import forget_integrators

HERE = Path(__file__).parent
SLOW = frozenset((HERE / "slow.txt").read_text("utf-8").split())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what the list names, in all its parametrizations."""
    for item in items:
        if item.path.is_relative_to(HERE):
            file = item.path.relative_to(HERE).as_posix()
            if not SLOW.isdisjoint((file, f"{file}::{getattr(item, 'originalname', item.name)}")):
                item.add_marker(pytest.mark.slow)


@pytest.fixture(autouse=True)
def integrators_of_a_test_end_with_it() -> Iterator[None]:
    """Two tests may call theirs by one name."""
    loaded = set(sys.modules)
    yield
    forget_integrators(loaded)
