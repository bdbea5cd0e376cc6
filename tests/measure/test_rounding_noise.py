"""The same motion with other roundings, and the spread that these make."""

import math
from fractions import Fraction
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heavytop.cases import CASES
from heavytop.measure.rounding_noise import MOST_SEEDS, RERUNS, bands, duration_band, factor, least, scaled
from heavytop.measure.scalar import of_fraction
from heavytop.precision import DOUBLE, exact, rounded
from heavytop.records import Metric, Quantity, by_name
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP


def error(size: float) -> Metric:
    return of_fraction(Fraction(size))


@given(st.sampled_from(sorted(CASES)), st.integers(0, MOST_SEEDS))
def test_another_seed_is_the_same_motion_exactly(name: str, seed: int) -> None:
    case = CASES[name]
    other = scaled(case.top, factor(seed))
    p, q = (case.system.parameters(top, case.start) for top in (case.top, other))
    y = case.start.flat
    assert case.system.field(p, y) == case.system.field(q, y)
    assert (other == case.top) == (seed == 0)


def test_dyadic_data_stay_exact_in_double() -> None:
    for name in ("ershkov-partial-2", "ershkov-partial-6", "delone"):
        case = CASES[name]
        for seed in (1, 37, MOST_SEEDS):
            p = case.system.parameters(scaled(case.top, factor(seed)), case.start)
            assert all(rounded(Fraction(value), DOUBLE) == value for value in (*p.inertia, *p.moment, p.rotor))


def test_no_two_runs_have_the_same_factor() -> None:
    factors = {factor(seed, rerun) for seed in range(MOST_SEEDS + 1) for rerun in range(RERUNS + 1)}
    assert len(factors) == (MOST_SEEDS + 1) * (RERUNS + 1)
    assert 1 <= min(factors) < max(factors) < Fraction(102, 100)
    assert factor(0) == 1
    assert {HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT} >= {case.system for case in CASES.values()}


def test_the_band_of_a_known_spread() -> None:
    """log10 of the runs normal with deviation s: the ratio of two is within 1.96 √2 s in 95 % of all pairs."""
    random = Random(1)
    runs = [{"x_max": error(10 ** random.gauss(-10, 0.1))} for _ in range(300)]
    assert bands(runs, -20, {})["x_max"] == pytest.approx(1.96 * 0.1, rel=0.1)


def test_good_luck_of_the_own_run_widens_its_band_and_a_fault_does_not() -> None:
    random = Random(2)
    runs = [{"x_max": error(10 ** random.gauss(-10, 0.1))} for _ in range(RERUNS)]
    plain = bands(runs, -20, {})["x_max"]
    assert bands(runs, -20, {"x_max": error(1e-12)})["x_max"] > 1
    assert bands(runs, -20, {"x_max": error(1e-7)})["x_max"] == plain


def test_what_is_below_the_floor_or_zero_has_no_spread_and_words_have_no_band() -> None:
    runs = [{"x_max": error(size)} for size in (1e-18, 1e-19, 0)]
    assert bands(runs, -16, {})["x_max"] == 0
    assert bands([*runs, {"x_max": Metric("nan", None)}], -16, {}) == {}
    assert bands([*runs, {}], -16, {}) == {}
    assert bands([{"x": of_fraction(exact("1"), "value")}] * 3, -16, {}) == {}


def test_a_last_value_counts_as_its_rms_at_least() -> None:
    x, y = Quantity("x"), Quantity("y")
    metrics = by_name({x.over("rms"): error(1e-10), x.over("final"): error(1e-14), y.over("final"): error(1e-14)})
    assert least(metrics, metrics["x_final"]) == pytest.approx(-10)
    assert least(metrics, metrics["x_rms"]) == least(metrics, metrics["y_final"]) == -math.inf
    runs = [by_name({x.over("rms"): error(1e-10), x.over("final"): error(s)}) for s in (1e-14, 1e-12, 1e-10)]
    assert bands(runs, -20, {})["x_final"] == 0


def test_noise_that_is_added_to_a_duration() -> None:
    times = [100 + (-1) ** i for i in range(16)]
    plain = duration_band(times, 100, 50)
    assert plain == pytest.approx(math.log10(1 + 2 / 100 / math.sqrt(2)), abs=1e-4)
    assert duration_band(times, 400, 50) < plain
    # a run that held out longer than all others was lucky
    assert duration_band(times, 100, 120) > 5 * plain
