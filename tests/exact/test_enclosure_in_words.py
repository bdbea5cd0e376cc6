"""Enclosures in words hold the motion: against exact integers of more bits, over systems, scales and threads."""

from fractions import Fraction
from functools import partial
from random import Random

import pytest

from heavytop import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Contradiction, HeavyTop, State
from heavytop.exact.enclosure import run
from heavytop.exact.enclosure.run import ScaledMotion, Validated
from heavytop.exact.enclosure.step import start_node, step
from heavytop.exact.flint.balls import relative_bits
from heavytop.multiword.fixed_point import fixed_point_run
from heavytop.multiword.fixed_point.certified_series import CertifiedSeries, WordSeries
from heavytop.top.equations import Parameters
from support.helpers import FLIPPED
from support.proofs import assert_overlap

TOP = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
XI = (Fraction(0), Fraction(1), Fraction(0))


def solved(system, unit=Fraction(1), moments=(3, 2, 1), omega=START.omega, moment=("1/2", "1/3", "1/5")):
    """A motion whose rates are ``unit`` times as fast."""
    rotor = [Fraction(k) * unit for k in ("1/2", "-2", "1/3")] if system is HEAVY_GYROSTAT else None
    top = HeavyTop(moments, 1, [Fraction(r) * unit**2 for r in moment], rotor)
    start = State([Fraction(w) * unit for w in omega], START.gamma)
    return Validated(top, start, system, rotor=Fraction(2, 3) * unit if system is GYROSTAT else None)


def near_an_equilibrium(digits):
    """Coefficients are smaller than the state by several words at once."""
    return Validated(HeavyTop((3, 2, 1), 1, (1, 0, 0)), State((0, Fraction(1, 10**digits), 0), (1, 0, 0)))


DEGENERATE = {
    "sphere": {"moments": (1, 1, 1)},
    "two equal": {"moments": (2, 2, 1), "moment": (0, 1, 0)},
    "no weight": {"moment": (0, 0, 0)},
    "flat": {"moments": (3, 2, 1), "omega": (0, 0, 0)},
    "next to an unstable axis": {"omega": (Fraction(1, 2**90), 1, 0), "moment": (0, 0, 0)},
    "a fast spin": {"omega": (Fraction(1, 10), 0, 6)},
    "nearly equal": {"moments": (1, 1 + Fraction(1, 2**60), 1)},
    "renamed": {"moments": (1, 3, 2)},
}
SLOW, FAST = Fraction(1, 10**100), Fraction(10**100)
HELD = {
    "slow": (partial(solved, HEAVY_TOP, SLOW), -5 / SLOW, 360),  # Ω is absolute below 1: it has its own bits
    "fast": (partial(solved, GYROSTAT, FAST), Fraction(37, 6) / FAST, 120),
    "fast and back": (partial(solved, GYROSTAT, FAST), -5 / FAST, 120),
    "heavy gyrostat": (partial(solved, HEAVY_GYROSTAT), Fraction(37, 6), 120),
    "heavy gyrostat and back": (partial(solved, HEAVY_GYROSTAT), Fraction(-5), 120),
    **{name: (partial(solved, HEAVY_TOP, **data), Fraction(5, 2), 110) for name, data in DEGENERATE.items()},
    **{f"1e-{n} off rest": (partial(near_an_equilibrium, n), Fraction(40), 120) for n in (20, 40, 70)},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", HELD)
def test_balls_hold_what_exact_integers_find(name, monkeypatch):
    make, time, bits = HELD[name]
    assert_held(monkeypatch, make, "state", time, bits)


@pytest.mark.slow
def test_random_motions_with_their_attitude_are_held(monkeypatch):
    random = Random(15)
    for _ in range(2):
        top = HeavyTop([random.randint(20, 30) for _ in range(3)], 1, [random.randint(-9, 9) for _ in range(3)])
        omega, gamma = ([Fraction(random.randint(-9, 9), 7) for _ in range(3)] for _ in range(2))
        time = Fraction(random.randint(30, 50), 7)
        assert_held(monkeypatch, partial(Validated, top, State(omega, gamma), xi=XI), "attitude", time, 100)


def assert_held(monkeypatch, make, what, time, bits):
    """In words, against exact integers of more bits, which have a pilot, steps and roundings of their own."""
    one, other = make(), make()
    balls = getattr(one, what)(time, bits)
    with monkeypatch.context() as patch:
        patch.setattr(run, "_GRIDS", ())
        assert_overlap(balls, getattr(other, what)(time, bits + 64))
    assert min(map(relative_bits, balls)) >= bits
    for solution, in_words in ((one, True), (other, False)):
        assert any(words for _, _, words, _ in solution._runs) is in_words


def test_a_field_that_the_lanes_do_not_compute_goes_to_integers():
    """The plan of lanes is compared with the field itself, coefficient by coefficient."""
    p = HEAVY_TOP.parameters(TOP, START)
    assert ScaledMotion.of(HEAVY_TOP, p, START.flat, forwards=True).in_words
    assert not ScaledMotion.of(FLIPPED, p, START.flat, forwards=True).in_words


def test_moments_of_no_body_go_to_integers_where_their_ratio_is_large():
    p = Parameters((Fraction(1), Fraction(1, 2**20), Fraction(3)), (Fraction(0),) * 3, Fraction(0))
    assert not ScaledMotion.of(HEAVY_TOP, p, START.flat, forwards=True).in_words


def test_machine_code_that_is_wrong_is_caught_before_it_is_used(monkeypatch):
    """Constants that are off in the last word by 2^20 units: nothing but the exact comparison could tell."""
    true = fixed_point_run.constants

    def damaged(problem, grid, over, factor=Fraction(1)):
        found = true(problem, grid, over, factor)
        found[8 * (grid.words - 1)] += 2.0**20 * grid.unit(grid.words - 1)
        return found

    monkeypatch.setattr(run, "_seen_right", set())
    monkeypatch.setattr(fixed_point_run, "constants", damaged)
    with pytest.raises(Contradiction, match="Machine code in 138 bits"):
        Validated(TOP, START).state(Fraction(8), 60)


def test_a_step_that_words_cannot_hold_is_shortened():
    """Where the series does not converge or a sum leaves its range there is a shorter step, never a wrong one."""
    motion = ScaledMotion.of(HEAVY_TOP, HEAVY_TOP.parameters(TOP, START), START.flat, forwards=True)
    certified = motion.certified(138)
    node = start_node(motion.field, motion.scaled.state, 138)
    assert certified.series(node.centre, -3) is None
    found = step(motion.field, type(node)(node.time, node.centre, node.errors, -3), 138, certified)
    assert found.node.halvings > -3
    assert isinstance(found.series, WordSeries)
    assert isinstance(certified, CertifiedSeries)
