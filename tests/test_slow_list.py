"""The list of slow tests names tests that are there."""

import ast
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent


def test_every_slow_test_is_there_and_named_once() -> None:
    names = (HERE / "slow.txt").read_text("utf-8").split()
    assert names == sorted(set(names))
    for name in names:
        file, _, function = name.partition("::")
        assert not function or function in functions(file)
        assert (HERE / file).exists()


@cache
def functions(file: str) -> set[str]:
    """The names of all functions in a file of tests."""
    tree = ast.parse((HERE / file).read_text("utf-8"))
    return {each.name for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)}
