"""The catalogue finds every class, under every naming of the axes, and falls back to the enclosure."""

import re
from fractions import Fraction
from types import SimpleNamespace

import pytest

from heavytop import GYROSTAT, HEAVY_GYROSTAT, HeavyTop, InputError, OutOfReach, State
from heavytop.errors import NotInClass
from heavytop.exact.cases.bobylev_steklov import BobylevSteklov
from heavytop.exact.cases.delone import Delone, DeloneHomoclinic
from heavytop.exact.cases.dokshevich import Dokshevich
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.cases.euler import Euler
from heavytop.exact.cases.goryachev_chaplygin import GoryachevChaplygin, Sretensky
from heavytop.exact.cases.goryachev_chaplygin_rest import GoryachevChaplyginRest
from heavytop.exact.cases.grioli import Grioli
from heavytop.exact.cases.gyrostat import Gyrostat
from heavytop.exact.cases.hess import Hess, HessPendulum
from heavytop.exact.cases.kovalevskaya import Kovalevskaya
from heavytop.exact.cases.lagrange import Lagrange, SphericalTop
from heavytop.exact.cases.one_interval import Steklov
from heavytop.exact.cases.pendulum import Pendulum
from heavytop.exact.cases.staude import Staude
from heavytop.exact.catalogue import find, matches, table
from heavytop.exact.closed_form import ALL, ClosedForm, Renamed, renamed_state, renamed_top
from heavytop.exact.enclosure.run import Validated
from heavytop.precision import round_to
from rational_motions import bobylev_steklov_motion, grioli_motion, staude_motion, steklov_motion
from support.proofs import assert_overlap, assert_solves

F = Fraction
UNIT = (F(2, 3), F(-1, 3), F(2, 3))
SAMPLES = {
    Staude: staude_motion((F(3), F(2), F(1)), UNIT, F(3, 2), F(1, 2)),
    Grioli: grioli_motion(F(1, 3), F(1, 4), F(2, 7), F(3, 2)),
    DeloneHomoclinic: DeloneHomoclinic(F(3, 2), F(5, 3)),
    Euler: Euler(HeavyTop((3, 2, 1), 1, (0, 0, 0)), State((1, "1/2", "-1/3"), UNIT)),
    Pendulum: Pendulum(HeavyTop((3, 2, 1), 1, (0, 1, "1/2")), State(("1/2", 0, 0), (0, "3/5", "4/5"))),
    Lagrange: Lagrange(HeavyTop(("3/2", "3/2", 1), 2, (0, 0, "3/4")), State(("1/5", "-1/3", 2), ("3/5", 0, "4/5"))),
    BobylevSteklov: bobylev_steklov_motion((F(5, 2), F(1)), F(1), F(1, 2), F(1, 3), F(2)),
    Kovalevskaya: Kovalevskaya(
        HeavyTop((2, 2, 1), "1/2", ("6/5", "2/3", 0)), State(("1/3", "4/5", "-7/10"), ("2/7", "3/7", "6/7"))
    ),
    GoryachevChaplygin: GoryachevChaplygin(
        HeavyTop((2, 2, "1/2"), 1, ("1/2", "3/4", 0)), State((2, "-1/2", -6), ("3/7", "6/7", "2/7"))
    ),
    SphericalTop: SphericalTop(HeavyTop((2, 2, 2), "1/2", (1, 2, 3)), State(("1/5", "-1/3", 2), ("3/5", 0, "4/5"))),
    GoryachevChaplyginRest: GoryachevChaplyginRest(
        HeavyTop((4, 4, 1), "1/2", ("6/5", "2/3", 0)), State((0, 0, 0), ("2/3", "1/3", "2/3"))
    ),
    HessPendulum: HessPendulum(HeavyTop((6, 4, 3), 1, (2, 0, 2)), State(("3/5", "6/5", "-6/5"), ("2/7", "3/7", "6/7"))),
    Steklov: steklov_motion(F(1), F(1, 5), F(6, 5), F(2)),
    Dokshevich: Dokshevich(
        HeavyTop(("4/5", "1/2", "3/10"), 1, ("-25/24", 0, "25/18")),
        State(("-17/14", "6/7", "8/7"), ("24/49", "36/49", "23/49")),
    ),
    Hess: Hess(HeavyTop((6, 4, 3), "1/2", (2, 0, 2)), State(("3/5", "4/5", "-6/5"), UNIT)),
    Delone: Delone(HeavyTop((2, 2, 1), 1, ("3/5", 0, 0)), State(("3/5", 0, 1), ("3/5", 0, "4/5"))),
    Sretensky: Sretensky(
        HeavyTop((4, 4, 1), 1, (1, "1/2", 0), (0, 0, 1)), State(("1/2", "1/3", "-5/2"), ("3/5", 0, "4/5"))
    ),
}


def kind(solution):
    return type(solution.solution if isinstance(solution, Renamed) else solution)


@pytest.mark.slow
@pytest.mark.parametrize("case", SAMPLES, ids=lambda case: case.__name__)
@pytest.mark.parametrize("axes", ALL)
def test_every_class_is_found_under_every_naming_of_the_axes(case, axes):
    sample = SAMPLES[case]
    top, start = renamed_top(sample.top, axes), renamed_state(sample.start, axes)
    found = find(top, start, sample.system)
    assert kind(found) is case
    assert (found.top, found.start) == (top, start)
    assert_solves(found, F(7, 3))


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 1, 0)])
def test_the_gyrostat_is_found(axes):
    partial = ErshkovPartial(F(1), F(2), F(1))
    top, start = renamed_top(partial.top, axes), renamed_state(partial.start, axes)
    found = find(top, start, GYROSTAT)
    assert kind(found) is (ErshkovPartial if axes == (0, 1, 2) else Gyrostat)
    assert_solves(found, F(7, 3))
    moving = Renamed(partial, axes)
    assert_solves(moving, F(-5, 3))
    steady = find(HeavyTop((3, 2, 1), 1, (0, 1, 0)), State((0, 1, 0), (0, 1, 0)), GYROSTAT)
    assert kind(steady) is Staude


@pytest.mark.slow
def test_several_forms_of_one_motion_agree():
    for top, start in (
        (HeavyTop((2, 2, 1), 1, (0, 0, 0)), State((1, "1/2", "-1/3"), UNIT)),
        (HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, "1/2", 0), ("3/5", 0, "4/5"))),
        (HeavyTop((2, 3, 1), 1, (1, 0, 0)), State((0, 0, "1/2"), ("3/5", "4/5", 0))),
        (SAMPLES[DeloneHomoclinic].top, SAMPLES[DeloneHomoclinic].start),
        (HeavyTop((2, 2, 2), 1, (1, 2, 3)), State((0, 3, -2), (2, 4, 6))),
    ):
        forms = list(matches(top, start))
        assert len({type(form) for form in forms}) > 1
        states = [form.state(F(13, 3), 200) for form in [*forms, Validated(top, start)]]
        for other in states[1:]:
            assert_overlap(states[0], other)


def test_a_generic_motion_is_left_to_the_enclosure():
    top, start = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
    assert kind(find(top, start)) is Validated


def test_no_class_is_tried_whose_conditions_fail(monkeypatch):
    """The Kovalevskaya top's own constructor runs, and no other."""
    tried = []
    monkeypatch.setattr(ClosedForm, "__post_init__", lambda found: tried.append(type(found)))
    sample = SAMPLES[Kovalevskaya]
    find(sample.top, sample.start)
    find(HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5")))
    assert tried == [Kovalevskaya]


def test_the_table_of_the_classes_is_readable():
    lines = table()
    assert len({line[:2] for line in lines}) == len(lines) >= 23
    body = "I1 = I2 = 2 I3; P c = 0; P r != 0"
    assert ("heavy_top", "Kovalevskaya", body, "gamma != 0; xi != 0") in lines
    assert ("heavy_top", "Delone", body, "xi = 0") in lines


UNIT_UP = F(2, 3), F(2, 3), F(1, 3)
NOT_DONE = {
    "both tend": ((F(1, 2), F(1, 3), 0), (0, 0, 1), r"Kovalevskaya: .*e = -13/36, e\^2 = k\^2, and both"),
    "one rests": ((F(-5, 6), F(-1, 6), F(-1, 2)), UNIT_UP, r"Kovalevskaya: .*e = -7/18, .* rests at e, and the other"),
    "too near": ((-1, F(1, 4), F(1, 4)), (F(2) / (10**12 + F(1, 10**12)), 0, 1), r"Kovalevskaya: .*to within .*e-1\d"),
}


@pytest.mark.slow
@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 1, 0)])
@pytest.mark.parametrize("name", NOT_DONE)
def test_a_level_that_is_not_done_is_named_by_its_enclosure_and_beyond_its_reach(name, axes):
    omega, gamma, level = NOT_DONE[name]
    top, start = HeavyTop((2, 2, 1), 1, (1, 0, 0)), State(omega, gamma)
    found = find(renamed_top(top, axes), renamed_state(start, axes))
    assert found.method.startswith("validated: Taylor enclosure")
    assert re.search(level, found.method)
    plain = Validated(found.top, found.start).state(F(1), 100)
    assert_overlap(found.state(F(1), 100), plain)
    with pytest.raises(OutOfReach, match=level):
        found.state(F(10**9), 100)


def test_goryachev_chaplygins_degenerate_levels_are_named_too():
    top = HeavyTop((4, 4, 1), 1, (1, 0, 0))
    with pytest.raises(OutOfReach, match=r"GoryachevChaplygin: The level is degenerate"):
        find(top, State((F(1, 10**30), F(1, 4), -3 * F(1, 10**30)), (F(3, 5), 0, F(4, 5)))).state(F(10**9), 60)


def test_what_the_gyrostat_does_not_admit_is_an_input_error():
    with pytest.raises(InputError, match="a = 1"):
        find(HeavyTop((3, 2, 1), 1, (1, 0, 0)), State((1, 0, 0), (1, 0, 0)), GYROSTAT)


def test_data_of_any_length_are_refused_in_words():
    third = round_to(Fraction(1, 3), 20_000)
    top = HeavyTop((3 + third, 2, 1), 1, (third, 0, third))
    assert list(matches(top, State((third, 1, third), (third, third, third)))) == []


@pytest.mark.slow
@pytest.mark.parametrize("case", [case for case in SAMPLES if case is not Sretensky], ids=lambda case: case.__name__)
def test_a_rotor_without_momentum_leaves_the_closed_forms_of_the_heavy_top(case):
    motion = SAMPLES[case]
    data = motion.top.inertia, motion.top.weight, motion.top.centre
    own = find(HeavyTop(*data), motion.start)
    for top in (HeavyTop(*data), HeavyTop(*data, (0, 0, 0))):
        found = find(top, motion.start, HEAVY_GYROSTAT)
        assert not isinstance(found, Validated), found.method
        assert_overlap(found.state(F(7, 3), 100), own.state(F(7, 3), 100))
    turned = HeavyTop(*data, (0, F(1, 10**9), 0))
    kept = {type(each).__name__ for each in matches(turned, motion.start, HEAVY_GYROSTAT)}
    assert kept <= {"ZhukovskyVolterra", "Staude", "LagrangeGyrostat", "Renamed"}


def test_a_renamed_motion_without_attitude_says_so():
    known = SAMPLES[BobylevSteklov]
    alone = SimpleNamespace(method="state alone", top=known.top, start=known.start, system=known.system)
    with pytest.raises(NotInClass, match="has no attitude"):
        Renamed(alone, (1, 2, 0)).attitude(F(1), 50)
