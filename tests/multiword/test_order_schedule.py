"""The picture of docs/multiword.md can be drawn anew."""

from pathlib import Path

import pytest

import words_ladder


@pytest.mark.slow
def test_the_picture_of_cost_against_bits_is_drawn(tmp_path: Path) -> None:
    ours, theirs = words_ladder.measured(106, 1)
    assert theirs is None
    assert 0.1 < ours < 1e4
    rows = [(53, 1.0, 1.5), (106, ours, None), (528, 1000.0, 40000.0)]
    for name in ("one.svg", "two.svg"):
        words_ladder.draw(rows, tmp_path / name)
    text = (tmp_path / "one.svg").read_text("utf-8")
    assert text.startswith("<?xml")
    assert text == (tmp_path / "two.svg").read_text("utf-8")
