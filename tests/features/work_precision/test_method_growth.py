"""The law of growth of each method, on series whose laws are known and on runs."""

import numpy
import pytest

from heavytop.features.work_precision.charts import alike, method_growth, trend
from heavytop.records import Series
from heavytop.report.document.svg import quiet_style
from support.report_helpers import GROWTH, LONG, WORK, law, method
from support.small_reports import report

pytestmark = pytest.mark.pictures

T = numpy.array([float(time) for time in LONG])


def series(values) -> Series:
    return Series(LONG, [f"{value:.6e}" for value in values])


@pytest.mark.parametrize(
    ("exponent", "name"),
    [(0, "bounded"), (0.5, "t^0.5"), (1, "t"), (1.5, "t^1.5"), (2, "t^2"), (0.25, "unresolved"), (2.5, "unresolved")],
)
def test_an_exact_power_has_its_exponent_and_the_law_it_is(exponent: float, name: str) -> None:
    found = trend(law(exponent, 1e-9))
    assert found.exponent == pytest.approx(exponent, abs=1e-5)
    assert found.halves == pytest.approx((exponent, exponent), abs=1e-5)
    assert found.law == name
    assert found.height + found.exponent * 4 == pytest.approx(-9, abs=1e-5)
    assert found.span == pytest.approx((2, 4), abs=1e-3)


def test_only_the_last_two_decades_count() -> None:
    found = trend(series(numpy.where(T < 99, 1e-4, 1e-9 * T)))
    assert found.law == "bounded"
    found = trend(series(numpy.where(T < 99, 1e-12 * T**3, 1e-8 * T)))
    assert found.exponent == pytest.approx(1, abs=1e-5)


def test_a_law_that_another_takes_over_from_is_not_named() -> None:
    found = trend(series(1e-12 * T + 1e-15 * T**2))
    assert found.halves[0] < 1.3 < 1.6 < found.halves[1]
    assert found.law == "unresolved"


@pytest.mark.slow
def test_one_walk_of_rounding_errors_is_given_no_law() -> None:
    """Its exponent is luck: without the size of rounding some would be given one."""
    random = numpy.random.default_rng(3)
    times = T.round().astype(int)
    called = []
    for _ in range(100):
        walk = 2.0**-52 * abs(random.standard_normal(times[-1]).cumsum())[times - 1]
        called.append(trend(series(walk)).law)
        assert trend(series(walk), 2.0**-52 * times[-1] ** 0.5).law == "unresolved"
    assert set(called) != {"unresolved"}


@pytest.mark.parametrize(
    "held",
    [
        Series([], []),
        Series(LONG[:5], ["1"] * 5),
        Series(LONG, ["unresolved"] * len(LONG)),
        Series(LONG, ["nan", "0"] * 12 + ["1e-9"]),
        Series(LONG[-10:], ["1e-9"] * 10),
    ],
)
def test_too_little_to_tell_a_law_from(held: Series) -> None:
    assert trend(held) is None


def test_the_rungs_nearest_to_the_same_error_on_the_longest_run_that_has_all() -> None:
    other = [
        method("heyoka tolerance=1e-7", law(1, 1), law(2, 1), "1e-3"),
        method("splitting:4 step=1/80", law(1, 1), law(2, 1), "1e-6"),
        method("cyrk:DOP853 tolerance=1e-12", law(1, 1), law(2, 1), "1e-5", outcome="step_limit"),
        method("cyrk:DOP853 tolerance=1e-15", law(1, 1), law(2, 1), "missing"),
    ]
    short = [method(row.integrator, law(1, 1), law(2, 1), case="x/T=9", horizon="9") for row in GROWTH]
    longer = [method(row.integrator, law(1, 1), law(2, 1), case="y/T=1e5", horizon="1e5") for row in GROWTH[:2]]
    assert alike([*other, *short, *WORK, *longer, *GROWTH]) == GROWTH
    assert alike(GROWTH[:2]) == []
    assert method_growth([("", report(*WORK, *GROWTH[1:]))]) is None


def test_the_section_says_each_law_to_eye_and_ear() -> None:
    with quiet_style():
        section = method_growth([("", report(*GROWTH))])
    energy, phase = section.pictures
    assert "splitting:4 step=1/40: bounded, exponent 0.00 (0.00, then 0.00)." in energy.description
    assert "heyoka tolerance=1e-9: like t, exponent 1.00 (1.00, then 1.00)." in energy.description
    assert "splitting:4 step=1/40: like t, exponent 1.00 (1.00, then 1.00)." in phase.description
    assert "cyrk:DOP853 tolerance=1e-11: like t^2, exponent 2.00 (2.00, then 2.00)." in phase.description
    assert [phase.svg.count(f">{law}</text>") for law in ("t^2 (2.00)", "t (1.00)")] == [2, 1]
    assert "heyoka tolerance=1e-9: 1e-9 at |t| = 10000." in energy.description
    assert len(section.rows) == 6
    assert [*section.legend][-1] == "fitted power of t"
    assert "lagrange/T=10000" in section.text[0]


def test_methods_that_cannot_be_fitted_are_drawn_without_a_law() -> None:
    words = [method(r.integrator, Series(["1", "2"], ["1e-9", "nan"]), Series([], [])) for r in GROWTH]
    section = method_growth([("", report(*words))])
    assert section.pictures[0].description.count("too few samples for a law") == 3
