"""The same bits on every processor that code can be made for here."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache, partial
from random import Random

import pytest

from heavytop.multiword.codegen.machine_code import Processor
from heavytop.multiword.double_double.double_double_run import Floating, OrderSchedule
from heavytop.multiword.fixed_point.arithmetic import grid_of
from heavytop.multiword.fixed_point.certified_series import CertifiedSeries
from heavytop.multiword.fixed_point.fixed_point_run import Fixed
from heavytop.multiword.problem import Status
from multiword.test_eight import coarse_samples
from multiword.test_proven import rounded, some_motion
from support.words_helpers import LEVELS, problem

FINEST, COARSE = Fraction(1, 2**105), Fraction(1, 10**16)


def at_the_end(run: Floating | Fixed, time: Fraction) -> tuple[object, ...]:
    """All that a run knows at that time."""
    assert run.advance(time, 10**6) is Status.OK
    return run.state, run.time, run.steps, run.resume_words(), run.sample(time)


def fixed(words: int, time: int, processor: Processor | None) -> object:
    return at_the_end(Fixed(problem(), grid_of(words), True, processor=processor), Fraction(time))


def floating(attitude: bool, tolerance: Fraction, processor: Processor | None) -> object:
    run = Floating(problem(1, attitude), OrderSchedule.of(tolerance), True, processor=processor)
    return at_the_end(run, Fraction(30))


def certified(processor: Processor | None) -> object:
    motion, grid = some_motion(Random(5), attitude=True), grid_of(4, whole=True)
    found = CertifiedSeries(motion.scaled, grid, True, processor=processor).series(rounded(motion, grid), 3)
    return found.values, found.rounding


# of double-double without FMA code takes ten seconds to compile: that of eight lanes, of the same operations, stands
# for it
COMPUTED: dict[str, tuple[Callable[[Processor | None], object], list]] = {
    "three words": (partial(fixed, 3, 8), LEVELS),
    "digits of eight words": (partial(fixed, 8, 2), LEVELS),
    "certified series": (certified, LEVELS),
    "eight lanes": (coarse_samples, LEVELS),
    "double-double": (partial(floating, False, FINEST), LEVELS[1:]),
    "loose double-double": (partial(floating, False, COARSE), LEVELS[1:]),
    "double-double with an attitude": (partial(floating, True, COARSE), LEVELS[1:2]),
}


@cache
def here(name: str) -> object:
    return COMPUTED[name][0](None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "processor"),
    [
        pytest.param(name, *level.values, marks=level.marks, id=f"{name}-{level.id}")
        for name, (_, levels) in COMPUTED.items()
        for level in levels
    ],
)
def test_the_bits_are_those_of_every_processor(name: str, processor: Processor) -> None:
    assert COMPUTED[name][0](processor) == here(name)
