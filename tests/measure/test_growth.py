"""Laws of growth on synthetic ensembles whose law is known: what is recognised, how sure it is, what is refused."""

import collections
import math
from time import process_time, thread_time

import numpy
import pytest

from heavytop.measure.growth import BENT, FEWEST_STARTS, Ensemble, band, finite_time_rates, law, median_interval
from heavytop.report.store.checks import inconsistent
from law_coverage import EPS, EXPONENT, NAMES, STEP, TIMES, chaotic, synthetic, walks


@pytest.mark.slow
@pytest.mark.parametrize("kind", NAMES)
def test_every_power_is_recognised(kind: str) -> None:
    rng = numpy.random.default_rng(5)
    found = collections.Counter(law(Ensemble(TIMES, synthetic(kind, rng), STEP)).growth for _ in range(10))
    assert found[NAMES[kind]] >= 9, found


@pytest.mark.slow
def test_the_interval_holds_the_exponent_in_95_of_100_trials() -> None:
    """Of every law, and in more trials: `validation/law_coverage.py`."""
    rng, other_threads = numpy.random.default_rng(11), process_time() - thread_time()
    laws = [law(Ensemble(TIMES, synthetic("walk", rng, 24), STEP)) for _ in range(60)]
    assert process_time() - thread_time() - other_threads < 0.1  # those of BLAS wait for busy processors
    inside = sum(each.low <= EXPONENT["walk"] <= each.high for each in laws)
    assert 54 <= inside <= 59
    assert sum(each.growth == "t^0.5" for each in laws) >= 57
    # and it is not wide for nothing
    assert numpy.mean([each.high - each.low for each in laws]) / 2 < 0.06 * (64 / 24) ** 0.5


@pytest.mark.slow
def test_chaos_is_exponential_though_it_saturates_early_and_its_rate_is_covered() -> None:
    rng = numpy.random.default_rng(3)
    laws = [law(Ensemble(TIMES, chaotic(rng, 64), STEP)) for _ in range(60)]
    assert sum(each.growth == "exponential" for each in laws) >= 57
    inside = sum(each.low <= 0.15 <= each.high for each in laws)
    assert 54 <= inside <= 59
    # 0.1 = EPS e^(0.15 t)
    reached = numpy.log(0.1 / EPS) / 0.15
    for each in laws:
        assert float(each.last) < 300
        assert float(each.lost_at) == pytest.approx(reached, rel=0.2)
        assert each.detects is None


def test_a_law_is_independent_of_the_format_and_of_the_horizon() -> None:
    rng = numpy.random.default_rng(7)
    errors = synthetic("integrated", rng)
    double, quad = (law(Ensemble(TIMES, errors * scale, STEP)) for scale in (1.0, 2.0**-60))
    assert (double.growth, double.exponent, double.low) == (quad.growth, quad.exponent, quad.low)
    early = law(Ensemble(TIMES[:33], errors[:, :33], STEP))
    assert early.growth == "t^1.5"
    # the same law, extrapolated over one decade more
    assert float(early.lost_at) == pytest.approx(float(double.lost_at), rel=1)
    tiny = law(Ensemble(TIMES, errors * 1e-280, STEP))
    assert (tiny.growth, tiny.exponent) == (double.growth, pytest.approx(double.exponent, abs=1e-6))


def test_the_fit_ends_before_saturation_and_says_when_the_format_is_lost() -> None:
    rng = numpy.random.default_rng(2)
    # t² from 1e-12: 0.1 is reached at t = STEP √(0.1/1e-12 ...)
    errors = 1e-10 * (TIMES / STEP) ** 2 * numpy.exp(0.1 * rng.normal(size=(32, 1)))
    wrapped = numpy.abs(numpy.sin(errors))
    found = law(Ensemble(TIMES, wrapped, STEP))
    assert found.growth == "t^2"
    assert float(found.last) < STEP * (0.1 / 1e-10) ** 0.5
    assert float(found.lost_at) == pytest.approx(STEP * (0.1 / 1e-10) ** 0.5, rel=0.2)
    small = law(Ensemble(TIMES, wrapped / 1000, STEP, size=1 / 1000))
    assert (small.growth, small.last, small.lost_at) == (found.growth, found.last, found.lost_at)


def test_a_bounded_error_has_no_horizon() -> None:
    found = law(Ensemble(TIMES, synthetic("bounded", numpy.random.default_rng(1)), STEP))
    assert found.growth == "bounded"
    assert found.lost_at is None


@pytest.mark.slow
@pytest.mark.parametrize("power", [0.25, 0.75, 1.25, 1.75, 3.0])
def test_a_power_between_the_classes_is_unresolved(power: float) -> None:
    rng = numpy.random.default_rng(4)
    errors = EPS * TIMES**power * numpy.exp(0.5 * rng.normal(size=(64, 1)) + 0.2 * rng.normal(size=(64, len(TIMES))))
    found = law(Ensemble(TIMES, errors, STEP))
    assert found.growth == "unresolved"
    # what a comparison needs of it
    assert found.low <= found.exponent <= found.high
    assert power == pytest.approx(found.exponent, abs=0.05)
    assert found.bend[0] <= 0.05
    assert found.bend[1] >= -0.05
    assert power == 3 or (found.first, found.last, found.lost_at) == ("100", "100000", None)
    assert inconsistent(found) == ""


@pytest.mark.slow
@pytest.mark.parametrize("second", ["linear", "integrated", "quadratic"])
def test_two_laws_that_cross_are_not_taken_for_one(second: str) -> None:
    rng = numpy.random.default_rng(6)
    walk, later = synthetic("walk", rng), synthetic(second, rng)
    middle = numpy.searchsorted(TIMES, 10**3.5)
    crossing = walk + later * (_rms(walk[:, middle]) / _rms(later[:, middle]))
    found = law(Ensemble(TIMES, crossing, STEP))
    assert found.growth == "unresolved"
    assert found.bend[1] > BENT  # steeper towards the end
    assert inconsistent(found) == ""
    # a second law that is far below the first throughout leaves it alone
    hidden = walk + later * (_rms(walk[:, -1]) / _rms(later[:, -1]) / 30)
    assert law(Ensemble(TIMES, hidden, STEP)).growth == "t^0.5"


@pytest.mark.parametrize(
    ("starts", "samples"),
    [(FEWEST_STARTS - 1, slice(None)), (64, slice(24)), (64, slice(None, None, 8)), (0, slice(None))],
    ids=["few starts", "few decades", "few samples", "no start"],
)
def test_too_little_is_unresolved_and_no_number(starts: int, samples: slice) -> None:
    times = TIMES[samples]
    errors = synthetic("walk", numpy.random.default_rng(1), 64, times)[:starts]
    found = law(Ensemble(times, errors, STEP))
    assert found.growth == "unresolved"
    assert (found.exponent, found.low, found.high, found.detects, found.lost_at) == (None,) * 5
    assert found.starts == starts


def test_failed_starts_are_left_out_and_counted() -> None:
    errors = synthetic("walk", numpy.random.default_rng(9))
    alone = law(Ensemble(TIMES, errors[4:], STEP))
    spoilt = errors.copy()
    spoilt[:4, 25:] = [[numpy.nan], [numpy.inf], [numpy.nan], [numpy.nan]]
    found = law(Ensemble(TIMES, spoilt, STEP))
    assert found == alone
    assert found.starts == 60
    assert law(Ensemble(TIMES, numpy.full((64, len(TIMES)), numpy.nan), STEP)).growth == "unresolved"


def test_what_the_reference_does_not_resolve_is_not_fitted() -> None:
    errors = synthetic("integrated", numpy.random.default_rng(9))
    ensemble = Ensemble(TIMES, errors, STEP, resolution=1e-12)
    rms = ensemble.rms()
    assert numpy.isnan(rms[0])
    assert (rms[numpy.isfinite(rms)] >= 1e-11).all()
    found = law(ensemble)
    assert found.growth == "unresolved" or rms[numpy.searchsorted(TIMES, float(found.first))] >= 1e-11
    assert law(Ensemble(TIMES, errors, STEP, resolution=1.0)).growth == "unresolved"


def test_zeros_are_not_growth() -> None:
    errors = synthetic("walk", numpy.random.default_rng(9))
    errors[:, TIMES < 40] = 0
    found = law(Ensemble(TIMES, errors, STEP))
    assert found.growth == "t^0.5"
    assert float(found.first) >= 40
    never = law(Ensemble(TIMES, errors * 0, STEP))
    assert (never.growth, never.exponent, never.lost_at) == ("bounded", None, None)


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2], ids=["walk", "integrated"])
def test_a_fault_above_the_detection_power_is_told_and_one_well_below_is_not(order: int) -> None:
    rng = numpy.random.default_rng(8)
    n = TIMES[-1] / STEP
    told = {3.0: 0, 0.2: 0}
    for _ in range(20):
        healthy, *others = (walks(rng, 64)[order - 1, :, -1] for _ in range(3))
        errors = numpy.abs(numpy.tile(healthy[:, None], len(TIMES)) * (TIMES / TIMES[-1]) ** (order - 0.5))
        power = float(law(Ensemble(TIMES, errors, STEP, accumulates=order)).detects)
        for factor, other in zip(told, others, strict=True):
            faulty = numpy.abs(other + factor * power * n**order / order)
            apart = numpy.log10(_rms(faulty) / _rms(healthy))
            told[factor] += apart > band(numpy.abs(healthy)) + band(faulty)
    assert told[3.0] >= 18, told
    assert told[0.2] <= 2, told


def _rms(values) -> float:
    return float((values**2).mean() ** 0.5)


def test_the_band_holds_the_rms_of_other_starts() -> None:
    rng = numpy.random.default_rng(1)
    inside = 0
    for _ in range(200):
        values = numpy.abs(rng.normal(size=64))
        inside += abs(numpy.log10(_rms(values))) <= band(values)
    assert 180 <= inside <= 198
    # 64 squares of normal numbers: the RMS is known to 1.96/√128
    assert band(values) == pytest.approx(1.96 / 128**0.5 / numpy.log(10), rel=0.3)
    assert band(values[:3]) is None
    assert band(values * 0) is None
    assert band(numpy.where(values > 1, values, numpy.nan)) is None


@pytest.mark.slow
@pytest.mark.parametrize(("starts", "spread"), [(16, 0.12), (64, 0.05)])
def test_the_interval_of_a_rate_holds_the_median_of_rates_that_scatter(starts: int, spread: float) -> None:
    rng, times = numpy.random.default_rng(31), 10 ** (numpy.arange(32 * 4 + 1) / 32)
    laws = [law(Ensemble(times, chaotic(rng, starts, 0.15, times, spread), STEP)) for _ in range(40)]
    assert all(each.growth == "exponential" for each in laws)
    assert sum(each.low <= 0.15 <= each.high for each in laws) >= 36
    assert all(each.low <= each.exponent <= each.high for each in laws)


@pytest.mark.parametrize(("count", "last", "outside"), [(8, 0, 2), (16, 3, 1394), (64, 23, None)])
def test_the_interval_of_a_median_is_the_narrowest_that_is_exact(count: int, last: int, outside: int | None) -> None:
    values = numpy.arange(count)[::-1].astype(float)
    assert median_interval(values) == (last, count - 1 - last)
    below = sum(math.comb(count, k) for k in range(last + 1))
    assert 2 * below <= 0.05 * 2**count < 2 * (below + math.comb(count, last + 1))
    assert outside in (None, 2 * below)


def test_a_rate_is_that_of_each_start_and_zeros_count_for_nothing() -> None:
    times = numpy.array([1.0, 2, 4, 8, 16])
    errors = numpy.exp(numpy.array([[0.1], [0.5], [2.0]]) * times)
    assert finite_time_rates(times, errors) == pytest.approx([0.1, 0.5, 2.0], rel=1e-12)
    errors[1, 2] = 0
    errors[2, 1:] = 0
    assert finite_time_rates(times, errors) == pytest.approx([0.1, 0.5, 0.0], rel=1e-12)


def test_what_all_starts_share_widens_the_interval_of_a_power() -> None:
    rng = numpy.random.default_rng(12)
    errors = synthetic("linear", rng)
    wiggly = errors * numpy.exp(0.3 * numpy.sin(3 * numpy.arange(len(TIMES))))
    plain, shared = (law(Ensemble(TIMES, each, STEP)) for each in (errors, wiggly))
    x = numpy.log(TIMES[TIMES >= 100 * 0.999])
    expected = 2 * 0.3 / 2**0.5 / ((x - x.mean()) ** 2).sum() ** 0.5
    assert (shared.high - shared.low) / 2 == pytest.approx(expected, rel=0.25)
    assert (plain.high - plain.low) / 2 < expected / 2


@pytest.mark.slow
@pytest.mark.parametrize("decades", [1, 3, 8])
@pytest.mark.parametrize("kind", ["bounded", "walk"])
def test_an_error_that_jumps_has_no_law(kind: str, decades: int) -> None:
    """In the middle of the span a jump of 3 decades has the slope of t^1.5, and one of 8 rises like an exponential."""
    # the law is fitted to the last three decades
    late = (0.1, 0.3, 0.5, 0.7, 0.9) if decades == 8 else ()
    for share in (*(10 ** (3 * (part - 1)) for part in (0.25, 0.5, 0.8, 0.95)), *late):
        errors = synthetic(kind, numpy.random.default_rng(23))
        errors[:, share * TIMES[-1] < TIMES] *= 10**decades
        found = law(Ensemble(TIMES, errors, STEP))
        assert found.growth == "unresolved"
        assert not inconsistent(found)
