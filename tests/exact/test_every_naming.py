"""Digits promised are delivered: by every class, under every naming of the axes, whatever FLINT's settings are.

FLINT's working precision and length of power series are settings of the whole process.  Nobody's ball may be touched at
those that happen to stand there, so each test runs at 53 bits, as a program starts, and at settings that spoil at once
whatever is touched.
"""

from fractions import Fraction

import pytest
from flint import ctx

from exact.test_catalogue import SAMPLES
from heavytop import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, HeavyTop, State
from heavytop.exact import catalogue
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.catalogue import find
from heavytop.exact.closed_form import ALL, renamed_state, renamed_top
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import radius, relative_bits
from heavytop.exact.solution import hold
from heavytop.measure.reference import reference
from support.helpers import in_units
from support.proofs import assert_overlap, attitude_of

DIGITS, BITS, LENGTH = 40, 140, 14
TIME = Fraction(7, 3)
GENERIC = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
PARTIAL = ErshkovPartial(Fraction(1), Fraction(2), Fraction(1))
# Ω = I⁻¹ γ, so that M = γ; and a permanent rotation
GYROSTATS = {
    "partial": (PARTIAL.top, PARTIAL.start),
    "general": (HeavyTop((4, 2, 1), 1, (0, 1, 0)), State(("1/6", "-1/6", "2/3"), ("2/3", "-1/3", "2/3"))),
    "permanent": (HeavyTop((3, 2, 1), 1, (0, 1, 0)), State((0, 1, 0), (0, 1, 0))),
}
MOTIONS = [(case.__name__, sample.top, sample.start, sample.system) for case, sample in SAMPLES.items()]
MOTIONS += [("generic", *GENERIC, HEAVY_TOP)]
MOTIONS += [(name, top, start, GYROSTAT) for name, (top, start) in GYROSTATS.items()]
HEAVY_GYROSTATS = {
    "ZhukovskyVolterra": HeavyTop((3, 2, 1), 0, (0, 0, 0), ("1/2", "-1/3", "3/4")),
    "SphericalGyrostat": HeavyTop((2, 2, 2), 1, (1, 2, 2), ("1/2", 1, 1)),
    "LagrangeGyrostat": HeavyTop((3, 3, 1), 1, (0, 0, "2/3"), (0, 0, "-1/2")),
}
MOTIONS += [(name, top, GENERIC[1], HEAVY_GYROSTAT) for name, top in HEAVY_GYROSTATS.items()]
WHEEL = HeavyTop((3, 2, 1), 1, ("1/2", 0, "1/3"), (0, "2/7", 0))
MOTIONS += [("PendulumGyrostat", WHEEL, State((0, "5/4", 0), ("3/5", 0, "4/5")), HEAVY_GYROSTAT)]
SETTINGS = {"spoiling": (2, 1), "as a program starts": (53, 10)}
AS_IT_STARTS, SPOILING = ((0, 1, 2),), ((2, 1, 0),)
"""Namings for the settings of a program that starts: that of the class; for spoiling ones an odd one."""
NAMED = {
    reach: [
        pytest.param(settings, top, start, system, axes, id=f"{said}-{name}-{''.join(str(axis + 1) for axis in axes)}")
        for said, settings in SETTINGS.items()
        for name, top, start, system in MOTIONS
        for axes in (AS_IT_STARTS if said != "spoiling" else ALL if reach == "all" else SPOILING)
        # the gyrostat's rotor lies along axis 2
        if system is not GYROSTAT or axes[1] == 1
    ]
    for reach in ("all", "odd")
}


@pytest.fixture
def settings(request):
    before = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = request.param
    yield request.param
    assert (ctx.prec, ctx.cap) == request.param
    ctx.prec, ctx.cap = before


def test_the_samples_have_every_class_of_the_catalogue():
    for system in (HEAVY_TOP, GYROSTAT):
        for case in catalogue._CLASSES[system.name]:
            assert any(admits(case, top, start) for _, top, start, which in MOTIONS if which is system), case.name


def admits(case, top, start):
    return hold(case.body, top, start) and hold(case.starts, top, start)


@pytest.mark.slow
@pytest.mark.parametrize(("settings", "top", "start", "system", "axes"), NAMED["all"], indirect=["settings"])
def test_a_reference_gives_the_digits_it_promises(settings, top, start, system, axes):
    record = reference(renamed_top(top, axes), renamed_state(start, axes), [TIME, -TIME], DIGITS, system)
    for state in record.states:
        for ball in state:
            assert Fraction(ball.radius) <= Fraction(1, 10**DIGITS) * max(1, abs(Fraction(ball.value)))


@pytest.mark.slow
@pytest.mark.parametrize(("settings", "top", "start", "system", "axes"), NAMED["odd"], indirect=["settings"])
def test_state_series_and_attitude_do_not_see_the_settings(settings, top, start, system, axes):
    solution = find(renamed_top(top, axes), renamed_state(start, axes), system)
    state, series = solution.state(TIME, BITS), solution.series(TIME, LENGTH, BITS)
    assert min(map(relative_bits, [*state, *solution.attitude(TIME, BITS)])) >= BITS
    assert [part.prec for part in series] == [LENGTH] * 6
    for value, part in zip(state, series, strict=True):
        assert part[0].overlaps(value)
        assert max(radius(part[n]) for n in range(LENGTH)) < Fraction(1, 10**30)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "top", "start", "system"), MOTIONS, ids=[motion[0] for motion in MOTIONS])
def test_the_attitude_is_that_of_the_enclosure_under_an_odd_naming_and_in_any_units(name, top, start, system):
    """Far out its balls are narrow; of a motion without a closed form the enclosure is all there is."""
    rate = Fraction(10) ** 100 if name != "generic" else Fraction(1)
    solution = find(renamed_top(top, (2, 1, 0)), renamed_state(start, (2, 1, 0)), system)
    other = find(*in_other_units(top, start, rate, 1 / rate), system)
    known = Validated(solution.top, solution.start, system).attitude(TIME, BITS)
    found, plain, same = (
        attitude_of(one, time, BITS)[1](time, BITS)
        for one, time in ((solution, TIME), (find(top, start, system), TIME), (other, TIME / rate))
    )
    assert_overlap(found, known)
    assert_overlap(plain, same)
    if name != "generic":
        method, attitude = attitude_of(other, 10**6 / rate, BITS)
        assert method.startswith("closed form")
        assert max(map(radius, attitude(10**6 / rate, BITS))) < Fraction(1, 10**40)


def in_other_units(top, start, rate, size):
    """The same motion with time in another unit, moments and weight in another, and weight against centre."""
    inertia, centre = [size * i for i in top.inertia], [r / size for r in top.centre]
    other = HeavyTop(inertia, top.weight * size * size, centre, top.rotor and [size * k for k in top.rotor])
    return in_units(other, start, rate)
