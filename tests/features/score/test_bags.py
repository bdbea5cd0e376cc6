"""ROS bags and MCAP: a motion in a bag is scored as the plain file of it."""

import sys
from pathlib import Path

import pytest

from heavytop.errors import InputError
from heavytop.features.score.trajectories.bags import of_bag


def test_without_the_package_one_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(InputError, match=r"needs the extra logs: pip install"):
        of_bag(tmp_path / "log.mcap")
