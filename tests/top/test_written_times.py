"""Times as they were given, in text, and times given as doubles."""

from decimal import Decimal
from fractions import Fraction

import gmpy2
import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import InputError
from heavytop.top.heavy_top import DoubleTimes, TimeText, check_times

TINY = Fraction(1, 10**30)
TOP = ht.HeavyTop((2, 2, 1), 1, (0, 0, "1/2"))
START = ht.State(("1/5", "-1/3", "7/4"), ("2/7", "3/7", "6/7"))


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("12345.678", "12345.678"),
        (" 1e3 ", "1e3"),
        ("1/3", "1/3"),
        ("-0.50", "-0.50"),
        (Fraction(1, 3), "1/3"),
        (Fraction(1, 2), "1/2"),
        (Fraction(gmpy2.mpz(1), gmpy2.mpz(3)), "1/3"),
        (Decimal("0.10"), "0.10"),
        (7, "7"),
        (np.int32(-7), "-7"),
        (0.5, "0.5"),
        (-0.375, "-0.375"),
        (0.1, "0.1000000000000000055511151231257827021181583404541015625"),
        (np.float32(0.25), "0.25"),
        (1e22, "10000000000000000000000"),
        (2.0**-70, f"1/{2**70}"),
        (0.0, "0"),
    ],
)
def test_a_time_is_written_as_it_was_given_and_is_the_same_number(given: object, text: str) -> None:
    found = TimeText.of(given)
    assert found == text
    exact = Fraction(given) if not isinstance(given, np.generic) else Fraction(given.item())
    assert Fraction(str(found)) == Fraction(found) == exact
    assert float(found) == float(exact)


def test_what_is_no_number_is_no_time() -> None:
    for given in ("", "nan", float("inf"), None, "1/0", "twelve"):
        with pytest.raises(InputError):
            TimeText.of(given)


def test_a_reference_names_its_times_as_they_were_given() -> None:
    found = ht.reference(TOP, START, ["12345.678", "-1/3", 0.5, 2], 12)
    assert found.times == ["12345.678", "-1/3", "0.5", "2"]
    assert [float(time) for time in found.times] == [12345.678, -1 / 3, 0.5, 2.0]
    assert "12345.678" in repr(found)
    assert ht.reference(TOP, START, (str(k) for k in range(2)), 12).times == ["0", "1"]


@pytest.mark.parametrize("make", [np.array, list, tuple])
def test_doubles_in_order_are_checked_as_an_array_and_give_the_same_bits(make: object) -> None:
    doubles = [0.0, 0.1, 0.25, 1.75]
    found = check_times(make(doubles))
    assert isinstance(found, DoubleTimes)
    assert check_times(found) is found
    assert list(found) == [Fraction(value) for value in doubles]
    exact = [Fraction(value) for value in doubles]
    for precision in ("double", "extended", "quad"):
        one, other = (ht.propagate(TOP, START, times, precision) for times in (make(doubles), exact))
        assert one.texts() == other.texts()
        assert tuple(one.times) == tuple(other.times)


def test_times_are_exact_and_checked_once() -> None:
    found = check_times([0, "1/3", 0.5, Fraction(2, 3), np.float64(0.75), 1])
    assert found == [Fraction(0), Fraction(1, 3), Fraction(1, 2), Fraction(2, 3), Fraction(3, 4), Fraction(1)]
    assert check_times(found) is found
    close = check_times([1, 1 + TINY, 1 + 2 * TINY])
    assert close[2] - close[1] == TINY
    assert close.doubles == []


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ([], "No times"),
        ([1.0, 0.5], "must move strictly away from 0"),
        ([1, 1 + TINY, 1], "must move strictly away from 0"),  # what doubles do not tell apart
        ([1 + TINY, 1], "must move strictly away from 0"),
        ([-1.0, 1.0], "different signs"),
        ([-Fraction(1, 10**400), 1], "different signs"),
        ([0.0, 0.0], "more than once"),
        ([1.0, float("nan")], "not a finite number"),
        ([1.0, float("inf")], "not a finite number"),
        ([1.0, 1e200], "too large"),
        ([1, 10**400], "too large"),
        ([float("nan")], "not a finite number"),
    ],
)
def test_what_are_no_times_is_refused(times: list, message: str) -> None:
    for given in (times, np.array(times)) if all(isinstance(time, float) for time in times) else (times,):
        with pytest.raises(InputError, match=message):
            check_times(given)
    with pytest.raises(InputError, match=r"must be a list|not a number|A ndarray"):
        check_times(np.ones((2, 2)))
