"""The contract of every class: random motions solve the equations, are narrow far out, and meet the enclosure."""

from fractions import Fraction
from importlib import import_module
from typing import Any, NamedTuple

import pytest

from heavytop.errors import HeavyTopError
from heavytop.exact.closed_form import initial_xi
from support.proofs import (
    DIGITS_60,
    assert_attitude,
    assert_enclosed,
    assert_every_digit,
    assert_exact,
    assert_narrow,
    assert_overlap,
    attitude_of,
)


class Family(NamedTuple):
    """The file that makes a motion for each seed, how many, and by what.

    attitude: whether it is known far out too.  at: what makes the motions of the special starts of the file, "" where
    they are motions.
    """

    file: str
    seeds: int
    maker: str = "random_motion"
    attitude: bool = True
    at: str | None = None

    def motion(self, seed: int) -> Any:
        return getattr(self.module, self.maker)(seed)

    @property
    def module(self) -> Any:
        return import_module(f"exact.test_{self.file}")


FAMILIES = {
    "bobylev-steklov": Family("bobylev_steklov", 20, at="motion_from"),
    "delone": Family("delone", 12, at="delone"),
    "delone, homoclinic": Family("homoclinic", 4, "random_delone", at=""),
    "dokshevich": Family("dokshevich", 8, at="motion"),
    "ershkov, partial": Family("homoclinic", 4, "random_partial"),
    "euler": Family("euler", 20, at="euler"),
    "goryachev, from rest": Family("goryachev_rest", 12, "from_rest"),
    "goryachev, moving": Family("goryachev_rest", 12, "moving"),
    "goryachev-chaplygin": Family("goryachev_chaplygin", 12, attitude=False, at="motion_from"),
    "grioli": Family("grioli_and_staude", 30, "random_grioli", at=""),
    "gyrostat": Family("elliptic_motions", 20, "random_gyrostat", at=""),
    "gyrostat of the paper": Family("elliptic_motions", 20, "paper_gyrostat"),
    "hess": Family("hess", 4, "random_hess"),
    "hess pendulum": Family("hess", 5, "random_pendulum", at="HessPendulum"),
    "kovalevskaya": Family("kovalevskaya", 6, attitude=False, at="motion_from"),
    "lagrange": Family("elliptic_motions", 20, "random_lagrange"),
    "lagrange's gyrostat": Family("elliptic_motions", 9, "random_lagrange_gyrostat"),
    "pendulum": Family("pendulum", 20, at="pendulum"),
    "pendulum with a rotor": Family("pendulum", 9, "random_gyrostat"),
    "spherical": Family("spherical_and_tilted", 16, "random_spherical", at="SphericalTop"),
    "spherical gyrostat": Family("spherical_and_tilted", 9, "random_spherical_gyrostat"),
    "pendulum about a tilted axis": Family("spherical_and_tilted", 12, "random_tilted"),
    "pendulum of a spherical body": Family("spherical_and_tilted", 12, "random_spherical_pendulum"),
    "sretensky": Family("sretensky", 5, attitude=False, at="motion_from"),
    "staude": Family("grioli_and_staude", 30, "random_staude"),
    "steklov": Family("steklov", 12, at=""),
    "zhukovsky-volterra": Family("zhukovsky_volterra", 12, at="ZhukovskyVolterra"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), [(name, seed) for name, f in FAMILIES.items() for seed in range(f.seeds)])
def test_a_random_motion_solves_all_six_equations(name: str, seed: int) -> None:
    family = FAMILIES[name]
    assert_exact(family.motion(seed), seed, family.attitude)


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_a_thousand_digits_come_out_far_out(name: str) -> None:
    assert_narrow(FAMILIES[name].motion(3), Fraction(10**6), 1000)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", FAMILIES)
def test_the_enclosure_holds_the_closed_form(name: str, seed: int) -> None:
    assert_enclosed(FAMILIES[name].motion(seed))


STARTS = [(name, start) for name, family in FAMILIES.items() if family.at is not None for start in family.module.STARTS]


def special(name: str, start: str) -> Any:
    family = FAMILIES[name]
    data = family.module.STARTS[start]
    return getattr(family.module, family.at)(*data) if family.at else data


@pytest.mark.parametrize(("name", "start"), STARTS)
def test_a_special_start_is_a_start_like_any_other(name: str, start: str) -> None:
    """Turning points, separatrices, double roots, equilibria, and what is beside them.

    Where the time is that of Abel's integrals, the equations hold at a wrong time too: there the enclosure is asked.
    """
    motion = special(name, start)
    assert_every_digit(motion, Fraction(7, 3), Fraction(-40), Fraction(10**6))
    if not FAMILIES[name].attitude:
        assert_enclosed(motion)


@pytest.mark.parametrize(
    ("name", "start"),
    [pytest.param(*each, marks=[] if FAMILIES[each[0]].attitude else pytest.mark.slow) for each in STARTS],
)
def test_the_attitude_has_no_exceptional_state_but_those_without_azimuth(name: str, start: str) -> None:
    motion = special(name, start)
    if start.startswith("no azimuth"):
        with pytest.raises(HeavyTopError, match=r"degenerate|must not be zero|asymptotic|constant separated"):
            motion.attitude(Fraction(1), 100)
        return
    assert_attitude(motion, Fraction(0), Fraction(7, 3), Fraction(-40))
    # 32 bits less: the working precision, and with it what is made once for each, is that of the balls above
    _, attitude = attitude_of(motion, Fraction(0), DIGITS_60 - 32)
    assert_overlap(attitude(Fraction(0), DIGITS_60 - 32), initial_xi(motion.start.gamma))
