"""Eight motions in lanes: each is right, and none of its bits depends on its neighbours."""

import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from heavytop.multiword.codegen.machine_code import Processor
from heavytop.multiword.double_double.double_double_run import FALL_IN_LANES, Floating, OrderSchedule
from heavytop.multiword.double_double.eight_lane_run import Eight, exact_state
from heavytop.multiword.problem import Scaled, Status
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters
from support.helpers import rotor

FINE = OrderSchedule.of(Fraction(1, 2**105), FALL_IN_LANES)
SPAN = Fraction(20)
COARSE = OrderSchedule.of(Fraction(1, 10**20), FALL_IN_LANES)
PATH = os.pathsep.join(map(str, Path(__file__).parents[:2]))


def problems(system) -> list[Scaled]:
    p = Parameters(tuple(map(Fraction, (3, 2, 1))), tuple(Fraction(1, n) for n in (2, 3, 5)), Fraction(1, 7))
    p = p._replace(rotor=rotor(system, lambda: Fraction(1, 7)))
    rest = (Fraction(3, 5), Fraction(0), Fraction(4, 5))
    return [Scaled.of(system, p, (Fraction(k, 8), Fraction(1, 5), Fraction(k, 3) - 1, *rest)) for k in range(1, 9)]


def in_lanes(system, lanes: list[Scaled | None], schedule=FINE, low_order=33, processor=None, forwards=True) -> Eight:
    eight = Eight(system, schedule, low_order, processor)
    for lane, problem in enumerate(lanes):
        if problem is not None:
            eight.put(lane, problem, forwards, None)
            eight.aim(lane, SPAN)
    eight.advance(10**6)
    return eight


def samples(eight: Eight, lanes=range(8)) -> dict[int, tuple[Fraction, ...]]:
    return {lane: exact_state(words) for lane, words in eight.samples(dict.fromkeys(lanes, SPAN)).items()}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("system", "forwards"),
    [(HEAVY_TOP, True), (GYROSTAT, False), (HEAVY_GYROSTAT, True)],
    ids=lambda v: getattr(v, "name", v),
)
def test_each_lane_is_the_motion_of_a_run_by_itself(system, forwards: bool) -> None:
    given = problems(system)
    found = samples(in_lanes(system, given, forwards=forwards))
    for lane, problem in enumerate(given):
        run = Floating(problem, OrderSchedule.of(Fraction(1, 2**105)), forwards)
        assert run.advance(SPAN, 10**6) is Status.OK
        off = max(abs(a - b) for a, b in zip(found[lane], run.sample(SPAN), strict=True))
        assert off < Fraction(1, 2**94)


def test_no_bit_depends_on_the_neighbours_or_on_the_lane() -> None:
    given = problems(HEAVY_TOP)
    together = samples(in_lanes(HEAVY_TOP, list(given)))
    for lane in (0, 5):
        alone: list[Scaled | None] = [None] * 8
        alone[7 - lane] = given[lane]
        assert samples(in_lanes(HEAVY_TOP, alone), [7 - lane])[7 - lane] == together[lane]


def test_what_a_symmetric_top_spares_changes_no_bit() -> None:
    """Beside another top nothing is spared: neither products with I1 - I2 = 0 nor terms with arms that are 0."""
    weights = (Fraction(0), Fraction(1, 3), Fraction(0))
    p = Parameters((Fraction(2), Fraction(2), Fraction(1)), weights, Fraction(0))
    alike = [Scaled.of(HEAVY_TOP, p, tuple(Fraction(n * k, 7) for n in (1, 2, -3, 4, 5, 3))) for k in range(1, 8)]
    spared = samples(in_lanes(HEAVY_TOP, [None, *alike]), range(1, 8))
    assert spared == samples(in_lanes(HEAVY_TOP, [problems(HEAVY_TOP)[0], *alike]), range(1, 8))
    run = Floating(alike[0], OrderSchedule.of(Fraction(1, 2**105)), True)
    assert run.advance(SPAN, 10**6) is Status.OK
    assert max(abs(a - b) for a, b in zip(spared[1], run.sample(SPAN), strict=True)) < Fraction(1, 2**94)


def test_a_lane_that_waits_for_the_others_keeps_its_polynomial() -> None:
    given = problems(HEAVY_TOP)
    eight = in_lanes(HEAVY_TOP, list(given))
    times = {lane: eight.time(lane) for lane in range(8)}
    assert all(time < SPAN for time in times.values())
    assert eight.advance(100) == 0
    assert {lane: eight.time(lane) for lane in range(8)} == times


def test_a_lane_that_needs_a_larger_n0_says_so_and_stops() -> None:
    given = problems(HEAVY_TOP)
    eight = in_lanes(HEAVY_TOP, list(given), low_order=4)
    assert [eight.status(lane) for lane in range(8)] == [None] * 8
    assert [eight.taken(lane, None) for lane in range(8)] == [0] * 8


def coarse_samples(processor: Processor | None) -> dict[int, tuple[Fraction, ...]]:
    return samples(in_lanes(HEAVY_TOP, list(problems(HEAVY_TOP)), COARSE, 16, processor))


@pytest.mark.slow
def test_the_bits_are_those_without_fused_multiply_add_in_hardware() -> None:
    """glibc masks FMA and AVX2, so that its own fma, which code for x86-64 calls, is computed in software."""
    script = "import test_eight as t; print(*t.coarse_samples(t.Processor('x86-64'))[3])"
    environment = os.environ | {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F", "PYTHONPATH": PATH}
    masked = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert masked.stdout.split() == list(map(str, coarse_samples(None)[3]))
