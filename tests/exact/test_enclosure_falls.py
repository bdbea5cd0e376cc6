"""Enclosures whose working precision falls on the way hold the motion, and lose nothing by it."""

from dataclasses import replace
from fractions import Fraction
from math import inf, log10
from random import Random

import numpy as np
import pytest

from heavytop import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, HeavyTop, State
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.catalogue import find
from heavytop.exact.enclosure import run
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.enclosure.step import Errors, rounded_off, start_node, step
from heavytop.exact.flint.balls import midpoint, radius, relative_bits, working_precision
from support.proofs import assert_overlap

TOP = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
TILTED = ("3/5", 0, "4/5")
START = State(("1/10", "2/5", "9/10"), TILTED)


@pytest.fixture
def early(monkeypatch):
    """Falls of a few bits, as soon as bits are lost, by exact integers: many in a short time."""

    def falling(guard):
        monkeypatch.setattr(run, "_GRIDS", ())
        monkeypatch.setattr(run, "_FEWEST", 64)
        monkeypatch.setattr(run, "_GUARD", guard)

    return falling


def falls_of(solution):
    return [fall.precision for known in solution._runs.values() for fall in known.falls]


def test_a_number_is_rounded_to_nearest_whatever_its_sign():
    rng = Random(4)
    for dropped in (1, 2, 7, 130):
        ties = [(2 * n + 1) << (dropped - 1) for n in (-3, -1, 0, 5)]
        values = [*ties, *(rng.randrange(-(2**200), 2**200) for _ in range(40)), 0, -1, 1]
        off = [
            abs(value - (int(kept) << dropped))
            for value, kept in zip(values, rounded_off(values, dropped), strict=True)
        ]
        assert max(off) == 1 << (dropped - 1)


@pytest.mark.parametrize("dropped", [1, 30, 90])
@pytest.mark.parametrize("size", [0.0, 0.3, 2.0**80])
def test_what_is_rounded_away_is_in_the_wider_set(dropped, size):
    """Exactly: the set in fewer bits holds all that the theorem asks for, and the rounding of its centre."""
    solution = Validated(TOP, START)
    field = solution.motion(1).field
    node = start_node(field, solution.motion(1).scaled.state, 160)
    found = step(field, replace(node, errors=Errors(np.eye(6), np.full(6, size), 0)), 160)
    kept, fewer = found.end(), found.end(dropped=dropped)
    moved = [Fraction(int(a)) - (int(b) << dropped) for a, b in zip(kept.centre, fewer.centre, strict=True)]
    most = max(map(abs, moved))
    assert most <= 2 ** (dropped - 1)
    frame, turned, slack = found.transfer()
    # |Q^-1 - Q^T| <= slack
    off = Fraction(slack) * (most + Fraction(found.local) + Fraction(size))
    for i, radius_there in enumerate(fewer.errors.radii):
        of_set = sum(abs(Fraction(float(x))) * Fraction(size) for x in turned[i])
        of_step = sum(abs(Fraction(float(x))) for x in frame[:, i]) * Fraction(found.local)
        of_rounding = abs(sum(Fraction(float(x)) * m for x, m in zip(frame[:, i], moved, strict=True)))
        room = Fraction(float(radius_there)) * Fraction(2) ** (fewer.errors.exponent + dropped)
        assert of_set + of_step + of_rounding + off <= room


CASES = {
    "chaotic": (TOP, START, HEAVY_TOP),
    "gyrostat": (TOP, START, GYROSTAT),
    "heavy gyrostat": (replace(TOP, rotor=("1/2", "-2", "1/3")), START, HEAVY_GYROSTAT),
    "next to an unstable axis": (HeavyTop((3, 2, 1), 1, (0, 0, 0)), State(("1/1000", 1, 0), TILTED), HEAVY_TOP),
    "next to a separatrix": (HeavyTop((3, 2, 1), 1, (0, 1, 0)), State(("1/1000", 0, "1/500"), (0, 1, 0)), HEAVY_TOP),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_balls_hold_the_motion_however_early_the_precision_falls(name, early):
    """Errors that grow, shrink and grow again, in both directions of time; many times of one run."""
    top, start, system = CASES[name]
    rotor = Fraction(2, 3) if system is GYROSTAT else None
    times = [Fraction(t) for t in (12, 5, -8)]
    true = [Validated(top, start, system, rotor=rotor).state(t, 200) for t in times]
    early(2)
    falling = Validated(top, start, system, rotor=rotor)
    for time, values in zip(times, true, strict=True):
        balls = falling.state(time, 90)
        assert min(map(relative_bits, balls)) >= 90
        assert_overlap(balls, values)
    assert falls_of(falling)


def test_a_homoclinic_motion_is_held_by_its_closed_form(early):
    """Errors shrink towards the saddle and grow away from it."""
    early(8)
    known = DeloneHomoclinic(Fraction(1), Fraction(1))
    falling = Validated(known.top, known.start)
    for time in (Fraction(30), Fraction(-25)):
        assert_overlap(falling.state(time, 100), known.state(time, 200))
    assert falls_of(falling)


@pytest.mark.slow
def test_attitude_and_uncertain_data_fall_too(early):
    off = (Fraction(1, 2**200),) * 9
    exact = Validated(TOP, START).with_attitude(Fraction(10), 200)
    early(2)
    falling = Validated(TOP, START, uncertainty=run.Uncertainty(off, Fraction(0)))
    balls = falling.with_attitude(Fraction(10), 90)
    assert_overlap(balls, exact)
    assert falls_of(falling)


@pytest.mark.slow
def test_no_bit_is_lost_by_the_falls(monkeypatch):
    """In words, beside an enclosure that keeps all its bits: the same radius, but for a tenth of a bit."""

    def left(guard, least=184):
        monkeypatch.setattr(run, "_GUARD", guard)
        monkeypatch.setattr(run, "_FEWEST", least)
        solution = Validated(TOP, START)
        known = solution._run(1, START.flat, 308, True)
        found, tau = known.at(Fraction(250))
        return [fall.precision for fall in known.falls], [log10(r) for r in radii_of(found, tau)]

    def radii_of(found, tau):
        with working_precision(400):
            return [float(radius(ball)) for ball in found.at(tau)]

    (none, kept), (falls, fallen) = left(inf), left(64)
    assert not none
    assert falls == [270]
    assert max(b - a for a, b in zip(kept, fallen, strict=True)) < 0.03


@pytest.mark.slow
def test_the_model_of_the_cost_counts_the_falls(monkeypatch):
    solution = Validated(TOP, START)
    falling = solution.cost(Fraction(5000), 104)
    monkeypatch.setattr(run, "_GUARD", inf)
    assert 0.5 < falling / solution.cost(Fraction(5000), 104) < 0.8


@pytest.mark.slow
def test_steps_and_falls_depend_on_the_node_alone(early):
    early(4)
    used = Validated(TOP, START)
    for time in map(Fraction, (12, 5, 12)):
        one, other = used.state(time, 90), Validated(TOP, START).state(time, 90)
        for a, b in zip(one, other, strict=True):
            assert (midpoint(a), radius(a)) == (midpoint(b), radius(b))
    assert falls_of(used)


def test_proven_steps_in_a_row_hold_the_motion(early):
    """Events are proven from the steps of a walk: each covers its own time in its own bits."""
    true = [find(TOP, START).state(Fraction(t), 200) for t in (10, 20, 30)]
    early(2)
    solution = Validated(TOP, START)
    motion, steps = solution.walk(Fraction(30), 90)
    asked = dict(zip((Fraction(t) * motion.scaled.rate for t in (10, 20, 30)), true, strict=True))
    precisions = set()
    for found in steps:
        precisions.add(found.precision)
        for time, values in list(asked.items()):
            if found.node.time <= time <= found.node.time + found.length:
                with working_precision(300):
                    scaled = found.at((time - found.node.time) / found.length)
                    balls = [value * run.ball(size) for value, size in zip(scaled, motion.scaled.sizes, strict=True)]
                assert_overlap(balls, values)
                del asked[time]
    assert not asked
    assert len(precisions) > 1
