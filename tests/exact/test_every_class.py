"""The contract of every class: random motions solve the equations, are narrow far out, and meet the enclosure."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import pytest

from exact import (
    test_bobylev_steklov,
    test_delone,
    test_dokshevich,
    test_elliptic_motions,
    test_euler,
    test_goryachev_chaplygin,
    test_goryachev_rest,
    test_grioli_and_staude,
    test_hess,
    test_kovalevskaya,
    test_pendulum,
    test_spherical_and_tilted,
    test_sretensky,
    test_steklov,
    test_zhukovsky_volterra,
)
from support.proofs import assert_enclosed, assert_exact


class Family(NamedTuple):
    """A motion for each seed, and how many; attitude: whether it is known far out too."""

    make: Callable[[int], Any]
    seeds: int
    attitude: bool = True


FAMILIES = {
    "bobylev-steklov": Family(test_bobylev_steklov.random_motion, 20),
    "delone": Family(test_delone.random_motion, 12),
    "dokshevich": Family(test_dokshevich.random_motion, 8),
    "euler": Family(test_euler.random_motion, 20),
    "goryachev, from rest": Family(test_goryachev_rest.from_rest, 12),
    "goryachev, moving": Family(test_goryachev_rest.moving, 12),
    "goryachev-chaplygin": Family(test_goryachev_chaplygin.random_motion, 12, attitude=False),
    "grioli": Family(test_grioli_and_staude.random_grioli, 30),
    "gyrostat": Family(test_elliptic_motions.random_gyrostat, 20),
    "gyrostat of the paper": Family(test_elliptic_motions.paper_gyrostat, 20),
    "hess": Family(test_hess.random_hess, 4),
    "hess pendulum": Family(test_hess.random_pendulum, 5),
    "kovalevskaya": Family(test_kovalevskaya.random_motion, 6, attitude=False),
    "lagrange": Family(test_elliptic_motions.random_lagrange, 20),
    "lagrange's gyrostat": Family(test_elliptic_motions.random_lagrange_gyrostat, 9),
    "pendulum": Family(test_pendulum.random_motion, 20),
    "spherical": Family(test_spherical_and_tilted.random_spherical, 16),
    "pendulum about a tilted axis": Family(test_spherical_and_tilted.random_tilted, 12),
    "pendulum of a spherical body": Family(partial(test_spherical_and_tilted.random_tilted, spherical=True), 12),
    "sretensky": Family(test_sretensky.random_motion, 5, attitude=False),
    "staude": Family(test_grioli_and_staude.random_staude, 30),
    "steklov": Family(test_steklov.random_motion, 12),
    "zhukovsky-volterra": Family(test_zhukovsky_volterra.random_motion, 12),
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), [(name, seed) for name, f in FAMILIES.items() for seed in range(f.seeds)])
def test_a_random_motion_solves_all_six_equations(name: str, seed: int) -> None:
    family = FAMILIES[name]
    assert_exact(family.make(seed), seed, family.attitude)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", FAMILIES)
def test_the_enclosure_holds_the_closed_form(name: str, seed: int) -> None:
    assert_enclosed(FAMILIES[name].make(seed))
