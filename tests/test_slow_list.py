"""The list of slow tests names tests that are there."""

import ast
from pathlib import Path

HERE = Path(__file__).parent


def test_every_slow_test_is_there_and_named_once() -> None:
    names = (HERE / "slow.txt").read_text("utf-8").split()
    assert names == sorted(set(names))
    for name in names:
        file, _, function = name.partition("::")
        tree = ast.parse((HERE / file).read_text("utf-8"))
        assert not function or function in {each.name for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)}
