"""Derivatives of a motion: references beside, the laws of the flow, planted faults."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from flint import arb

from derivatives import BITS, SIX, chain, difference, holds, known, largest_radius, laws, of
from heavytop import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, HeavyTop, State
from heavytop.exact.enclosure import derivatives as module
from heavytop.exact.enclosure.derivatives import EnclosedDerivatives, derivatives, step_derivatives
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.enclosure.step import Errors, Node, in_other_bits, start_node, step
from heavytop.exact.flint.balls import largest_singular_value, radius, working_precision
from support.helpers import in_units

GENERIC = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
WITH_ROTOR = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"), rotor=("1/4", "-1/3", "2"))
START = State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
PARALLEL = HeavyTop((3, 2, 1), 1, (0, "1/3", 0)), State(("1/5", "0", "4/5"), ("3/5", 0, "4/5"))

MOTIONS = {
    "generic": (GENERIC, START, HEAVY_TOP),
    "euler": (HeavyTop((3, 2, 1), 0, (0, 0, 0)), START, HEAVY_TOP),
    "lagrange": (HeavyTop((2, 2, 1), 1, (0, 0, 1)), START, HEAVY_TOP),
    "kovalevskaya": (HeavyTop((2, 2, 1), 1, (1, 0, 0)), START, HEAVY_TOP),
    "spherical": (HeavyTop((1, 1, 1), 1, ("1/3", 0, 1)), START, HEAVY_TOP),
    "hanging": (HeavyTop((3, 2, 1), 1, (0, 0, -1)), State((0, 0, 0), (0, 0, 1)), HEAVY_TOP),
    "gyrostat": (*PARALLEL, GYROSTAT),
    "heavy gyrostat": (WITH_ROTOR, START, HEAVY_GYROSTAT),
}


def motion_of(name):
    return known(*MOTIONS[name])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "time"),
    [(name, Fraction(-1) if place % 2 else Fraction(7, 3)) for place, name in enumerate(MOTIONS)],
)
def test_the_laws_of_the_flow_hold_as_narrow_balls(name, time):
    motion = motion_of(name)
    for law, values in laws(motion, time, of(motion, time, data=True)).items():
        assert holds(values), law


@pytest.mark.slow
@pytest.mark.parametrize("name", ["generic", "heavy gyrostat"])
def test_central_differences_of_references_are_inside(name):
    motion, time = motion_of(name), Fraction(7, 3)
    found = of(motion, time, data=True)
    for matrix, datum, columns in ((found.start, False, (1, 3, 4)), (found.data, True, range(5))):
        for column in columns:
            values = difference(motion, time, column, datum=datum)
            for row, value in zip(matrix, values, strict=True):
                with working_precision(400):
                    assert holds([row[column] - value])


@pytest.mark.slow
def test_derivatives_over_two_parts_of_a_motion_make_those_over_the_whole():
    assert holds(chain(motion_of("generic"), Fraction(3, 2), Fraction(4)))


@pytest.mark.parametrize("entry", [(0, 1), (4, 3)])
def test_a_sign_in_one_entry_fails_the_laws(entry):
    motion, time = motion_of("generic"), Fraction(7, 3)
    right = of(motion, time)
    rows = [list(row) for row in right.start]
    rows[entry[0]][entry[1]] = -rows[entry[0]][entry[1]]
    failed = [law for law, values in laws(motion, time, EnclosedDerivatives(rows, None)).items() if not holds(values)]
    assert {"determinant", "flow", "scale"} <= set(failed)
    assert sum("gradient" in law for law in failed) >= 1
    values = difference(motion, time, entry[1])
    with working_precision(400):
        assert not holds([row[entry[1]] - value for row, value in zip(rows, values, strict=True)])


def test_a_sign_in_every_step_is_seen_by_the_laws(monkeypatch):
    """The planted fault is in the code that computes: one column of each step has its sign changed."""
    motion, time = motion_of("generic"), Fraction(7, 3)
    true_step = module.step_derivatives

    def faulty(*given):
        found = true_step(*given)
        for row in found.rows:
            row[2] = -row[2]
        return found

    monkeypatch.setattr(module, "step_derivatives", faulty)
    wrong = of(motion, time)
    failed = {law for law, values in laws(motion, time, wrong).items() if not holds(values)}
    # the determinant of an even number of steps stays, and so does |γ|², which Ω3 does not enter
    assert {"flow", "scale"} <= failed
    assert sum("gradient" in law for law in failed) >= 2


@pytest.mark.slow
def test_balls_of_few_digits_hold_those_of_many():
    rng = random.Random(28)
    for name in ("generic", "heavy gyrostat"):
        motion = motion_of(name)
        time = Fraction(rng.choice((-1, 1)) * rng.randint(1, 8), 7)
        coarse, fine = of(motion, time, 40, True), of(motion, time, 110, True)
        for few, many in zip((*coarse.start, *coarse.data), (*fine.start, *fine.data), strict=True):
            for a, b in zip(few, many, strict=True):
                assert a.overlaps(b)
                assert radius(b) * 2**90 < 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "precision", "of_motion"),
    [
        (2.0**20, 256, 256),
        (2.0**90, 270, 270),
        (2.0**-120, 184, 440),
        (2.0**100, 270, 184),
    ],
)
def test_the_bound_of_a_step_holds_at_every_corner_of_its_set_of_errors(size, precision, of_motion):
    """Φ and σ at c + w, in more bits, against those of c, in integers and (184 and 270 bits) in words.

    The motion has ``of_motion`` bits; size: of its errors, in ulps of 2^-precision.
    """
    motion = motion_of("generic")
    scaled = motion.motion(1)
    tangent = module._tangent(motion, scaled, precision, precision in (184, 270), tuple(SIX))
    assert (tangent.columns is not None) == (precision in (184, 270))
    node = start_node(scaled.field, scaled.scaled.state, of_motion)
    radius = round(size * 2.0 ** (of_motion - precision))
    node = replace(node, errors=replace(node.errors, radii=np.full(6, float(radius))))
    found = step(scaled.field, node, of_motion, scaled.certified(of_motion))
    along = in_other_bits(scaled.field, found, precision, tangent.certified)
    assert (along is found) == (of_motion == precision)
    box = [
        Fraction(float(r)) * Fraction(2) ** (along.node.errors.exponent - precision) for r in along.node.errors.sizes()
    ]
    for mine, own_centre, reach in zip(node.centre, along.node.centre, box, strict=True):
        apart = abs(Fraction(int(mine), 2**of_motion) - Fraction(int(own_centre), 2**precision))
        assert apart + Fraction(radius, 2**of_motion) <= reach
    assert along.widest >= found.widest
    own = step_derivatives(tangent, along, Fraction(1))
    fine = module._tangent(motion, scaled, 512, False, tuple(SIX))
    rng, worst, shift = random.Random(1), Fraction(0), 512 - of_motion
    for _ in range(2):
        centre = [(int(c) + rng.choice((-1, 1)) * radius) << shift for c in node.centre]
        beside = Node(Fraction(0), centre, Errors(np.eye(6), np.zeros(6), 0), along.node.halvings)
        true = step_derivatives(fine, step(scaled.field, beside, 512), Fraction(1))
        for row, exact in zip(own.rows, true.rows, strict=True):
            for value, other, bound in zip(row, exact, own.errors, strict=True):
                off = abs(Fraction(int(value)) - Fraction(int(other), 2 ** (512 - precision)))
                worst = max(worst, off / Fraction(bound))
    assert Fraction(1, 2**16) < worst <= 1


def test_what_a_motion_loses_does_not_raise_the_bits_of_its_derivatives(monkeypatch):
    """Lagrange's top: the motion is begun in more bits, J and S are not."""
    taken, true = [], module._tangent

    def noted(known, motion, precision, in_words, places):
        taken.append(precision)
        return true(known, motion, precision, in_words, places)

    monkeypatch.setattr(module, "_tangent", noted)
    for time in (4, 100):
        of(motion_of("lagrange"), time, 60, True)
    assert taken[0] == taken[1]


@pytest.mark.slow
def test_units_of_any_size_change_no_digit():
    """Ω = s ω, t = τ/s, n = s² ν: the derivatives are those of ω with powers of s, exactly."""
    scale, time = Fraction(2) ** 300, Fraction(3, 2)
    plain, data = of(motion_of("generic"), time, data=True), True
    found = of(Validated(*in_units(GENERIC, START, scale)), time / scale, data=data)
    for i in SIX:
        for j in SIX:
            power = (i < 3) - (j < 3)
            with working_precision(400):
                assert found.start[i][j].overlaps(plain.start[i][j] * arb(2) ** (300 * power))
                assert found.data[i][j].overlaps(plain.data[i][j] * arb(2) ** (300 * ((i < 3) - 2 * (j > 2))))


def test_many_times_in_any_order_with_both_signs_and_zero():
    motion = motion_of("generic")
    times = [Fraction(t) for t in (2, 0, -1, 1, 2)]
    found = derivatives(motion, times, BITS, False)
    for time, each in zip(times, found, strict=True):
        alone = of(motion, time)
        assert all(
            a.overlaps(b) for x, y in zip(each.start, alone.start, strict=True) for a, b in zip(x, y, strict=True)
        )
    assert all(found[1].start[i][j] == int(i == j) for i in SIX for j in SIX)


@pytest.mark.slow
def test_regular_motions_have_20_digits_far_out():
    """Lagrange's top at t = 100: the enclosure with derivatives reaches what regular motions ask for."""
    motion = motion_of("lagrange")
    found = of(motion, 100, 70)
    assert largest_radius(found.start) < Fraction(1, 10**15)
    assert all(holds(values, Fraction(1, 10**12)) for values in laws(motion, 100, found, 70).values())


def test_the_largest_singular_value_is_enclosed():
    with working_precision(200):
        rotation = [[arb("0.6"), arb("-0.8")], [arb("0.8"), arb("0.6")]]
        both_equal = largest_singular_value(rotation, 60)
        stretched = largest_singular_value([[arb(3), arb(0)], [arb(4), arb(5)]], 60)
        assert both_equal.contains(1)
        assert radius(both_equal) < Fraction(1, 10**15)
        near = largest_singular_value([[arb(1), arb(2) ** -110], [arb(2) ** -100, arb(1, 2.0**-120)]], 60)
        assert near.overlaps(arb(1))
        assert radius(near) < Fraction(1, 10**15)
        assert stretched.overlaps(arb(45).sqrt())
        assert radius(stretched) < Fraction(1, 10**15)
        vague = largest_singular_value([[arb(3, "1e-3"), arb(0)], [arb(4), arb(5)]], 60)
        assert vague.contains(arb(45).sqrt())
        assert Fraction(1, 10**5) < radius(vague) < Fraction(1, 10)
