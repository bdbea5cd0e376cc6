"""The contract of every class: random motions solve the equations, are narrow far out, and meet the enclosure."""

from importlib import import_module
from typing import Any, NamedTuple

import pytest

from support.proofs import assert_enclosed, assert_exact


class Family(NamedTuple):
    """The file that makes a motion for each seed, how many, and by what; attitude: whether it is known far out too."""

    file: str
    seeds: int
    maker: str = "random_motion"
    attitude: bool = True

    def motion(self, seed: int) -> Any:
        return getattr(import_module(f"exact.test_{self.file}"), self.maker)(seed)


FAMILIES = {
    "bobylev-steklov": Family("bobylev_steklov", 20),
    "delone": Family("delone", 12),
    "dokshevich": Family("dokshevich", 8),
    "euler": Family("euler", 20),
    "goryachev, from rest": Family("goryachev_rest", 12, "from_rest"),
    "goryachev, moving": Family("goryachev_rest", 12, "moving"),
    "goryachev-chaplygin": Family("goryachev_chaplygin", 12, attitude=False),
    "grioli": Family("grioli_and_staude", 30, "random_grioli"),
    "gyrostat": Family("elliptic_motions", 20, "random_gyrostat"),
    "gyrostat of the paper": Family("elliptic_motions", 20, "paper_gyrostat"),
    "hess": Family("hess", 4, "random_hess"),
    "hess pendulum": Family("hess", 5, "random_pendulum"),
    "kovalevskaya": Family("kovalevskaya", 6, attitude=False),
    "lagrange": Family("elliptic_motions", 20, "random_lagrange"),
    "lagrange's gyrostat": Family("elliptic_motions", 9, "random_lagrange_gyrostat"),
    "pendulum": Family("pendulum", 20),
    "pendulum with a rotor": Family("pendulum", 9, "random_gyrostat"),
    "spherical": Family("spherical_and_tilted", 16, "random_spherical"),
    "spherical gyrostat": Family("spherical_and_tilted", 9, "random_spherical_gyrostat"),
    "pendulum about a tilted axis": Family("spherical_and_tilted", 12, "random_tilted"),
    "pendulum of a spherical body": Family("spherical_and_tilted", 12, "random_spherical_pendulum"),
    "sretensky": Family("sretensky", 5, attitude=False),
    "staude": Family("grioli_and_staude", 30, "random_staude"),
    "steklov": Family("steklov", 12),
    "zhukovsky-volterra": Family("zhukovsky_volterra", 12),
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), [(name, seed) for name, f in FAMILIES.items() for seed in range(f.seeds)])
def test_a_random_motion_solves_all_six_equations(name: str, seed: int) -> None:
    family = FAMILIES[name]
    assert_exact(family.motion(seed), seed, family.attitude)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", FAMILIES)
def test_the_enclosure_holds_the_closed_form(name: str, seed: int) -> None:
    assert_enclosed(FAMILIES[name].motion(seed))
