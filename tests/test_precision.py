"""Rounding at the wall: exact in, exact out, and no false number."""

import time
from decimal import Decimal
from fractions import Fraction
from random import Random

import flint
import gmpy2
import numpy
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heavytop.errors import InputError
from heavytop.precision import (
    DOUBLE,
    EXTENDED,
    QUAD,
    available,
    decimal_text,
    distinct_digits,
    exact,
    log10,
    native_text,
    number,
    parse,
    real,
    round_to,
    rounded,
    shown,
)

FORMATS = [DOUBLE, EXTENDED, QUAD, real(24), real(237), real(1024), real(20000)]


@pytest.mark.parametrize("precision", FORMATS, ids=lambda p: p.name)
def test_a_number_is_the_nearest_of_its_format_and_comes_back_exactly(precision) -> None:
    random = Random(1)
    for _ in range(50):
        value = Fraction(random.getrandbits(3000) - 2**2999, random.getrandbits(2900) + 1) / 10 ** random.randint(0, 60)
        native = number(value, precision)
        back = exact(native)
        ulp = abs(back) * precision.eps
        assert abs(back - value) <= ulp / 2
        assert back == round_to(value, precision.bits)
        assert rounded(back, precision) == back
        assert rounded(exact(native_text(native, precision)), precision) == back


def test_ties_go_to_even() -> None:
    assert round_to(Fraction(2**24 + 1), 24) == 2**24
    assert round_to(Fraction(2**24 + 3), 24) == 2**24 + 4


def test_double_agrees_with_python_s_own_rounding() -> None:
    random = Random(2)
    for _ in range(200):
        value = Fraction(random.getrandbits(200) + 1, random.getrandbits(200) + 1)
        assert float(number(value, DOUBLE)) == float(value)


@pytest.mark.parametrize("text", ["0.1", "-7e-20", "1e4932", "-3.36e-4932", "6.5e-4966", "-6.5e-4966", "0", "-0", "1"])
def test_a_quad_is_the_binary_number_that_its_digits_name(text: str) -> None:
    heyoka = pytest.importorskip("heyoka")
    value = heyoka.real128(text)
    named = Fraction(Decimal(str(value)))
    near = exact(value)
    # 36 digits name it: no other quad is nearer to them, the smallest (subnormal) are 2^-16494 apart
    assert abs(near - named) <= max(abs(named) / 2**114, Fraction(1, 2**16495))
    assert near.denominator.bit_length() - 1 <= 16494
    assert number(near, QUAD) == value


@pytest.mark.parametrize("text", ["nan", "inf", "-inf"])
def test_a_quad_that_is_not_finite_is_no_number(text: str) -> None:
    heyoka = pytest.importorskip("heyoka")
    with pytest.raises(InputError, match="not a finite number"):
        exact(heyoka.real128(text))


def test_extended_and_quad_agree_with_decimal_parsing_of_their_libraries() -> None:
    heyoka = pytest.importorskip("heyoka")
    assert number(Fraction(1, 10), EXTENDED) == numpy.longdouble("0.1")
    assert number(Fraction(1, 10), QUAD) == heyoka.real128("0.1")
    assert number(Fraction(1, 10), real(237)) == heyoka.real("0.1", 237)


THIRD = Fraction(1, 3)


@pytest.mark.parametrize(
    ("odd", "value"),
    [
        ("3", 3), (" -2/5 ", Fraction(-2, 5)), ("0.1", Fraction(1, 10)), ("1e-3", Fraction(1, 1000)), ("-.5e2", -50),
        ("0.5/0.25", 2), ("7.", 7), ("1e0000000002", 100),
        # a float is the binary number that it is
        (0.1, Fraction(3602879701896397, 2**55)), (numpy.float32(0.1), Fraction(13421773, 2**27)),
        (numpy.float32(0.25), Fraction(1, 4)), (numpy.longdouble(2), 2), (numpy.int64(-4), -4), (numpy.int8(-3), -3),
        # of other packages
        (gmpy2.mpz(3), 3), (gmpy2.mpq(1, 3), THIRD), (gmpy2.mpfr("0.5"), Fraction(1, 2)), (gmpy2.mpfr(0), 0),
        (flint.fmpz(3), 3), (flint.fmpq(1, 3), THIRD), (Decimal("0.1"), Fraction(1, 10)),
        (Fraction(gmpy2.mpz(1), gmpy2.mpz(3)), THIRD), (Fraction(numpy.int64(1), numpy.int64(3)), THIRD),
    ],
    ids=repr,
)  # fmt: skip
def test_text_and_numbers_of_any_package_are_exact_and_plain(odd: object, value: Fraction | int) -> None:
    found = exact(odd)
    assert found == value
    assert type(found) is Fraction
    assert type(found.numerator) is int is type(found.denominator)


NO_NUMBERS = ["nan", "inf", "-Infinity", "", "1/0", "abc", "1_000", "0x10", "1/2/3", "--1", "1 2"]
TOO_LARGE = ["1e1234567", "-1e99999999", "1E+100001", f"1e{'9' * 5000}", "1e-99999999", "1e9999999"]


@pytest.mark.parametrize(
    ("bad", "cause"),
    [
        *((text, ".") for text in NO_NUMBERS),
        *((text, "exponent of .* is too large") for text in TOO_LARGE),
        *((text, "not a finite number") for text in ("2,5", "١")),
    ],
    ids=lambda text: text[:12],
)
def test_text_that_is_no_number_is_refused_with_its_reason(bad: str, cause: str) -> None:
    with pytest.raises(InputError, match=cause) as error:
        exact(bad)
    assert bad[:5] in str(error.value)
    assert error.value.remedy
    assert ("Write a decimal point" in error.value.remedy) is ("," in bad)


@pytest.mark.parametrize(
    "bad",
    [
        *(float("nan"), float("inf"), numpy.longdouble("nan"), None, True, [1], 1j, gmpy2.mpc(1)),
        *map(gmpy2.mpfr, ("nan", "inf", "-inf", "1e300000000")),
    ],
    ids=repr,
)
def test_what_is_no_finite_number_is_refused(bad: object) -> None:
    with pytest.raises(InputError):
        exact(bad)


@pytest.mark.parametrize(
    ("power", "precision"), [(400, DOUBLE), (-400, DOUBLE), (5000, EXTENDED), (-5000, EXTENDED), (5000, QUAD)]
)
def test_a_number_outside_the_exponent_range_is_refused(power: int, precision) -> None:
    with pytest.raises(InputError, match="exponent range"):
        number(Fraction(10) ** power, precision)


@pytest.mark.parametrize("name", ["double", "extended", "quad", "real:24", "real:20000"])
def test_formats_are_found_by_name(name: str) -> None:
    assert parse(name).name == name


@pytest.mark.parametrize("name", ["single", "real", "real:23", "real:20001", "real:1e3", "real:-5", "Double", ""])
def test_unknown_formats_are_refused(name: str) -> None:
    with pytest.raises(InputError):
        parse(name)


def test_every_family_is_available_or_says_why_not() -> None:
    answer = available()
    assert set(answer) == {"double", "extended", "double-double", "quad", "real"}
    assert all(reason is None or len(reason) > 10 for reason in answer.values())
    assert answer["double"] is None


def test_a_logarithm_does_not_underflow() -> None:
    assert log10(Fraction(1, 10**997)) == -997
    assert log10(Fraction(-250)) == round(float(numpy.log10(250)), 6)
    assert log10(Fraction(0)) is None


def test_decimal_text_rounds_to_nearest() -> None:
    assert decimal_text(Fraction(2, 3), 5) == "0.66667"
    assert decimal_text(Fraction(1, 3 * 10**1000), 3) == "3.33E-1001"
    assert decimal_text(Fraction(0), 9) == "0"


@pytest.mark.slow
@given(st.fractions(), st.integers(24, 300))
def test_rounding_is_to_nearest_and_idempotent(value: Fraction, bits: int) -> None:
    near = round_to(value, bits)
    assert round_to(near, bits) == near
    assert round_to(-value, bits) == -near
    assert abs(near - value) * 2**bits <= abs(near)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_double_comes_back_from_its_exact_value_and_from_its_text(value: float) -> None:
    assert float(number(exact(value), DOUBLE)) == value
    assert float(exact(native_text(numpy.float64(value), DOUBLE))) == value


@given(st.text(max_size=12))
def test_any_text_is_a_number_or_a_clear_error(text: str) -> None:
    refused: InputError | None = None
    try:
        value: Fraction | None = exact(text)
    except InputError as error:
        value, refused = None, error
    assert isinstance(value, Fraction) or (refused is not None and refused.remedy)


def test_a_root_of_400_bits_keeps_its_bits() -> None:
    with gmpy2.context(precision=400):
        assert 0 < abs(exact(gmpy2.sqrt(gmpy2.mpfr(2))) ** 2 - 2) < Fraction(1, 2**395)


def test_a_message_about_a_fraction_of_many_digits_takes_no_time() -> None:
    began = time.process_time()
    assert shown(1 - Fraction(1, 3**600_000)) == "1"
    assert time.process_time() - began < 1  # a minute if all digits are written first


@pytest.mark.parametrize(
    ("one", "texts"),
    [
        ("3.5", ("3.5", "3")),
        ("3.0000000000000005", ("3.0000000000000005", "3")),
        ("3." + "0" * 20_000 + "1", ("3 + 1E-20001", "3")),
        ("2." + "9" * 20_000, ("3 - 1E-20000", "3")),
    ],
    ids=["six digits", "seventeen", "more than forty", "below"],
)
def test_numbers_that_differ_are_written_differently_in_few_characters(one: str, texts: tuple[str, str]) -> None:
    assert distinct_digits(exact(one), Fraction(3)) == texts
