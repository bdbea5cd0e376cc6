"""Events of bodies in axes of their own: the function and the states are of the axes given."""

from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from support.helpers import START, TOP

pytestmark = pytest.mark.slow

ROWS = [[Fraction(n, 3) for n in row] for row in ((2, -1, 2), (2, 2, -1), (-1, 2, 2))]
SKEW = ht.Body(1, 1, ("1/2", "1/3", "1/5"), (3, 2, 1, "1/5", 0, "1/7"), about="pivot")
TILTED = ht.State(omega=("1/10", "2/5", "9/10"), attitude=ht.Attitude.euler("ZXZ", "1/3", "1/2", "1"))


def rotated(vector) -> list[Fraction]:
    return [sum((a * x for a, x in zip(row, vector, strict=True)), Fraction(0)) for row in ROWS]


def body() -> ht.Body:
    tensor = [[sum(ROWS[i][k] * TOP.inertia[k] * ROWS[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    return ht.Body(1, 1, rotated(TOP.centre), tensor, about="pivot")


@pytest.mark.parametrize("options", [{}, {"integrator": "multiword"}, {"digits": 25}], ids=str)
def test_turned_axes_have_the_same_events(options) -> None:
    start = ht.State(rotated(START.omega), rotated(START.gamma))
    plain = ht.events(TOP, START, 20, "-gamma1/3 + 2*gamma2/3 + 2*gamma3/3 = 1/4", **options)
    turned = ht.events(body(), start, 20, "gamma3 = 1/4", **options)
    assert list(turned.directions) == list(plain.directions)
    assert len(plain) == 4
    gap = [float(Fraction(a) - Fraction(b)) for a, b in zip(plain.time_texts(), turned.time_texts(), strict=True)]
    assert np.abs(gap).max() < (1e-24 if "digits" in options else 1e-13)
    rows = np.array(ROWS, dtype=float)
    states = plain.to_numpy()
    expected = np.hstack([states[:, :3] @ rows.T, states[:, 3:] @ rows.T])
    assert abs(turned.to_numpy() - expected).max() < 1e-13


def test_irrational_axes_and_attitudes_are_proven_and_agree_with_the_reference() -> None:
    known = ht.events(SKEW, TILTED, 10, "gamma3 = 1/4", digits=30)
    assert known.method == "validated: Taylor enclosure of irrational data"
    found = ht.events(SKEW, TILTED, 10, "gamma3 = 1/4")
    assert list(found.directions) == known.directions
    assert len(known) > 0
    assert abs(found.times - known.times_numpy()).max() < 1e-12
    states = ht.reference(SKEW, TILTED, known.time_texts(), 30).states
    for mine, theirs in zip(known.states, states, strict=True):
        for a, b in zip(mine, theirs, strict=True):
            # the time itself is rounded to 30 digits
            assert abs(Fraction(a.value) - Fraction(b.value)) < Fraction(1, 10**27)
        assert abs(Fraction(theirs[5].value) - Fraction(1, 4)) < Fraction(1, 10**27)
    sampled = ht.events(SKEW, TILTED, 10, lambda omega, gamma: float(gamma[2]) - 0.25)
    assert abs(sampled.times - found.times).max() < 1e-12


def test_a_section_and_pictures_of_a_body() -> None:
    assert ht.poincare(SKEW, TILTED, 5, "gamma3 = 1/4", 0).on_one_level
    times = np.arange(1, 21) / 4
    run = ht.propagate(SKEW, TILTED, times)
    known = ht.reference(SKEW, TILTED, times, 20)
    assert float(np.nanmax([line.get_ydata().max() for line in ht.plot.error(run, known).lines])) < -13
    assert np.nanmax(np.concatenate([line.get_ydata() for line in ht.plot.drift(run).lines])) < -13
    path = [np.array(line.get_data_3d()).T for line in ht.plot.sphere(run, of="centre").lines]
    along = run.positions() / np.linalg.norm([1 / 2, 1 / 3, 1 / 5])
    drawn = [each for each in path if len(each) == len(along)]
    assert abs(np.where(np.isnan(drawn[0]), drawn[1], drawn[0]) - along).max() < 1e-12


@pytest.mark.parametrize("system", ["gyrostat", "heavy_gyrostat"])
def test_rotors_are_followed(system) -> None:
    if system == "gyrostat":
        top, start = ht.HeavyTop((2, 3, 1), 1, (0, "1/2", 0)), ht.State((0, "4/15", "3/5"), (0, "4/5", "3/5"))
        function = "omega1"
    else:
        function = "gamma2 = 1/4"
        top, start = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"), rotor=("1/2", "-1/3", "1")), START
    for until in (10, -10):
        found = ht.events(top, start, until, function, system=system)
        known = ht.events(top, start, until, function, system=system, digits=20)
        words = ht.events(top, start, until, function, system=system, integrator="multiword")
        assert len(known) > 0
        assert list(found.directions) == list(words.directions) == known.directions
        assert abs(found.times - known.times_numpy()).max() < 1e-12
        assert abs(words.times - known.times_numpy()).max() < 1e-12
