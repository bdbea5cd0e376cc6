"""Assumptions on monotone functions say what they imply of the arguments, and no more."""

import pytest

from support.claim_tables import rotation


def verdict(root: str, assume: tuple[str, ...]) -> str:
    """The verdict on a rate that is real where ``root`` is not negative."""
    return rotation(f"sqrt({root})", assume, parameters={"a": ["3/4", "7/8"], "b": ["1/2", "5/8"]}).verdict


@pytest.mark.slow
@pytest.mark.parametrize(
    ("root", "assume", "holds"),
    [
        ("a - b", ("a > b",), True),
        ("a - 1/2", ("tanh(a) > 1/2",), True),
        ("a - b", ("tanh(a) > tanh(b)",), True),
        ("a - b", ("a > 0", "b > 0", "log(a) > log(b)"), True),
        ("a - b", ("exp(a) > exp(b)",), True),
        ("a - b", ("sqrt(a) > sqrt(b)",), True),
        ("a - 1/4", ("sqrt(a) > 1/2",), True),
        ("a - b", ("atan(a) > atan(b)",), True),
        ("a - b", ("acos(b) > acos(a)",), True),
        ("1 - a", ("log(a) < 0",), True),
        ("a", ("exp(a) > 1",), True),
        ("7/10 - b", ("tanh(b) < 6/10",), True),
        ("a - 1/10", ("log(tanh(a)) > -1",), True),
        ("a - 11/20", ("tanh(a) > 1/2",), False),  # atanh(1/2) = 0.5493
        ("b - a", ("acos(b) > acos(a)",), False),
        ("a - b", ("tanh(a) > 1/2", "tanh(b) > 2/5"), False),
        ("a - 1/2", ("sqrt(a) > 1/2",), False),
        ("a - b", ("cosh(a) > cosh(b)",), False),  # even
        ("1/2 - a", ("atan(a) < 2",), False),  # says nothing
        ("a", ("exp(a) > 1/2",), False),
    ],
)
def test_what_they_imply_is_decided_and_no_more(root: str, assume: tuple[str, ...], holds: bool) -> None:
    assert (verdict(root, assume) == "holds") is holds
