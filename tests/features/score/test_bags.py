"""ROS bags and MCAP: a motion in a bag is scored as the plain file of it."""

import sys
from pathlib import Path

import pytest

from heavytop.errors import InputError
from heavytop.features.score.trajectories.bags import of_bag, storage


def test_without_the_package_one_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(InputError, match=r"needs the extra logs: pip install"):
        of_bag(tmp_path / "log.mcap")


def test_a_folder_is_the_bag_in_it(tmp_path: Path) -> None:
    assert storage(tmp_path) == tmp_path
    (tmp_path / "metadata.yaml").touch()
    (tmp_path / "log_0.mcap").touch()
    assert storage(tmp_path) == tmp_path / "log_0.mcap"
    (tmp_path / "log_1.mcap").touch()
    assert storage(tmp_path) == tmp_path
