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


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3", Fraction(3)),
        (" -2/5 ", Fraction(-2, 5)),
        ("0.1", Fraction(1, 10)),
        ("1e-3", Fraction(1, 1000)),
        ("-.5e2", Fraction(-50)),
        ("0.5/0.25", Fraction(2)),
        ("7.", Fraction(7)),
    ],
)
def test_text_is_read_exactly(text: str, value: Fraction) -> None:
    assert exact(text) == value


def test_a_float_is_the_binary_number_that_it_is() -> None:
    assert exact(0.1) == Fraction(3602879701896397, 36028797018963968)
    assert exact(numpy.float32(0.1)) == Fraction(13421773, 134217728)
    assert exact(numpy.int64(-4)) == -4


@pytest.mark.parametrize(
    "bad", ["nan", "inf", "-Infinity", "", "1/0", "abc", "1_000", "١", "1e9999999", "0x10", "1/2/3", "--1", "1 2"]
)
def test_text_that_is_no_number_is_refused_with_the_offending_text(bad: str) -> None:
    with pytest.raises(InputError) as error:
        exact(bad)
    assert bad[:5] in str(error.value)
    assert error.value.remedy


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), numpy.longdouble("nan"), None, True, [1], 1j])
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


@pytest.mark.parametrize("text", ["1e1234567", "-1e99999999", "1E+100001", f"1e{'9' * 5000}", "1e-99999999"])
def test_a_number_with_too_large_an_exponent_is_called_that(text: str) -> None:
    with pytest.raises(InputError, match=r"exponent of .* is too large"):
        exact(text)
    assert exact("1e0000000002") == 100


def test_numbers_of_other_packages_are_exact_and_plain() -> None:
    third = Fraction(1, 3)
    numbers = [
        (gmpy2.mpz(3), Fraction(3)),
        (gmpy2.mpq(1, 3), third),
        (gmpy2.mpfr("0.5"), Fraction(1, 2)),
        (flint.fmpz(3), Fraction(3)),
        (flint.fmpq(1, 3), third),
        (Fraction(gmpy2.mpz(1), gmpy2.mpz(3)), third),
        (Fraction(numpy.int64(1), numpy.int64(3)), third),
        (numpy.int8(-3), Fraction(-3)),
        (numpy.float32(0.25), Fraction(1, 4)),
        (numpy.longdouble(2), Fraction(2)),
        (Decimal("0.1"), Fraction(1, 10)),
        (gmpy2.mpfr(0), Fraction(0)),
    ]
    for odd, value in numbers:
        found = exact(odd)
        assert found == value
        assert type(found) is Fraction
        assert type(found.numerator) is int is type(found.denominator)
    with gmpy2.context(precision=400):
        assert exact(gmpy2.sqrt(gmpy2.mpfr(2))) ** 2 != 2
        assert abs(exact(gmpy2.sqrt(gmpy2.mpfr(2))) ** 2 - 2) < Fraction(1, 2**395)
    for odd in (gmpy2.mpfr("nan"), gmpy2.mpfr("inf"), gmpy2.mpfr("-inf"), gmpy2.mpc(1), gmpy2.mpfr("1e300000000")):
        with pytest.raises(InputError):
            exact(odd)


def test_a_message_about_a_fraction_of_many_digits_takes_no_time() -> None:
    began = time.process_time()
    assert shown(1 - Fraction(1, 3**600_000)) == "1"
    assert time.process_time() - began < 1  # a minute if all digits are written first


def test_a_decimal_point_is_asked_for_where_a_comma_stands() -> None:
    for text, asked in (("2,5", True), ("٣", False)):
        with pytest.raises(InputError, match="not a finite number") as refused:
            exact(text)
        assert ("Write a decimal point" in refused.value.remedy) is asked


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
