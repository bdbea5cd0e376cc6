"""A run that is killed goes on to the report of a run left alone."""

from pathlib import Path

import pytest

from kills import TINY, kill_and_resume


@pytest.mark.slow
def test_kills_change_nothing(tmp_path: Path) -> None:
    """Two of them; ``python validation/kills.py PLAN KILLS`` makes as many as one likes."""
    plan = tmp_path / "kills.toml"
    plan.write_text(TINY)
    runs = kill_and_resume(str(plan), 2)
    assert sum(killed for killed, _ in runs) == 2
    assert all(same for _, same in runs)
