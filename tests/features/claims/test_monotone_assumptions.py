"""Assumptions on monotone functions say what they imply of the arguments, and no more."""

import pytest

from support.claim_tables import rotation


def verdict(root: str, assume: tuple[str, ...]) -> str:
    """The verdict on a rate that is real where ``root`` is not negative."""
    return rotation(f"sqrt({root})", assume, parameters={"a": ["3/4", "7/8"], "b": ["1/2", "5/8"]}).verdict


@pytest.mark.slow
@pytest.mark.parametrize(
    ("root", "assume"),
    [
        ("a - b", ("a > b",)),
        ("a - 1/2", ("tanh(a) > 1/2",)),
        ("a - b", ("tanh(a) > tanh(b)",)),
        ("a - b", ("a > 0", "b > 0", "log(a) > log(b)")),
        ("a - b", ("exp(a) > exp(b)",)),
        ("a - b", ("sqrt(a) > sqrt(b)",)),
        ("a - 1/4", ("sqrt(a) > 1/2",)),
        ("a - b", ("atan(a) > atan(b)",)),
        ("a - b", ("acos(b) > acos(a)",)),
        ("1 - a", ("log(a) < 0",)),
        ("a", ("exp(a) > 1",)),
        ("7/10 - b", ("tanh(b) < 6/10",)),
        ("a - 1/10", ("log(tanh(a)) > -1",)),
    ],
)
def test_what_they_imply_is_decided(root: str, assume: tuple[str, ...]) -> None:
    assert verdict(root, assume) == "holds"


@pytest.mark.parametrize(
    ("root", "assume"),
    [
        ("a - 11/20", ("tanh(a) > 1/2",)),  # atanh(1/2) = 0.5493
        ("b - a", ("acos(b) > acos(a)",)),
        ("a - b", ("tanh(a) > 1/2", "tanh(b) > 2/5")),
        ("a - 1/2", ("sqrt(a) > 1/2",)),
        ("a - b", ("cosh(a) > cosh(b)",)),  # even
        ("1/2 - a", ("atan(a) < 2",)),  # says nothing
        ("a", ("exp(a) > 1/2",)),
    ],
)
def test_what_they_do_not_imply_is_not(root: str, assume: tuple[str, ...]) -> None:
    assert verdict(root, assume) != "holds"
