"""Figures that stand on two pages are the same."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def test_seconds_to_choose_by_are_those_of_the_table_of_multiword() -> None:
    table = re.search(r"\| bits \|.*\n(?:\|.*\n)+", (DOCS / "multiword.md").read_text("utf-8"))
    assert table is not None
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[0].splitlines()]
    costs = {line[0]: dict(zip(lines[0][1:], line[1:], strict=True)) for line in lines[2:]}
    rows = re.findall(
        r"^\| \w+ \| (\d+) \|.*\| ([\d.]+) with heyoka, ([\d.]+) with `multiword` \|$",
        (DOCS / "choose.md").read_text("utf-8"),
        re.MULTILINE,
    )
    assert [bits for bits, *_ in rows] == ["53", "64", "113"]
    for bits, heyoka, multiword in rows:
        # to T = 1000, from µs a unit of time
        for name, seconds in (("heyoka", heyoka), ("multiword", multiword)):
            assert float(seconds) == pytest.approx(float(costs[name][bits].replace(",", "")) * 1e-3)
