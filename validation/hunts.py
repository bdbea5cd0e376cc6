"""How long a hunt takes to find each planted fault, and what it shrinks it to.

    python validation/hunts.py [SEED ...]

Each fault is heyoka with an error in a small part of the space alone.  It is hunted as a file, in a process of its own,
over T = 100 with a budget of 120 s; processor seconds of this process and its children are what is reported.  The
healthy one comes last.
"""

from __future__ import annotations

import math
import resource
import sys
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from time import perf_counter
from typing import Any

import numpy

import heavytop as ht
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Trajectory
from heavytop.precision import Precision
from heavytop.top.equations import System
from heavytop.top.heavy_top import HeavyTop, State

Times = Sequence[Any]


def healthy(top: HeavyTop, start: State, times: Times, precision: Precision, *, system: System) -> Trajectory:
    """heyoka."""
    return propagate(top, start, times, precision, system=system)


def ratio(top: HeavyTop, start: State, times: Times, precision: Precision, *, system: System) -> Trajectory:
    """An error of 1e-9 when I2/I3 is within 1 % of 2."""
    run = propagate(top, start, times, precision, system=system)
    off = abs(top.inertia[1] / top.inertia[2] - 2) <= Fraction(2, 100)
    return replace(run, states=[state * (1 + 1e-9) for state in run.states]) if off else run


def branch(top: HeavyTop, start: State, times: Times, precision: Precision, *, system: System) -> Trajectory:
    """A wrong branch when Ω3 < 0 and γ1 > 0.9 at the start: the motion of Ω3 > 0."""
    if start.omega[2] < 0 and start.gamma[0] > Fraction(9, 10):
        omega = (start.omega[0], start.omega[1], -start.omega[2])
        return propagate(top, State(omega, start.gamma), times, precision, system=system)
    return propagate(top, start, times, precision, system=system)


def spin(top: HeavyTop, start: State, times: Times, precision: Precision, *, system: System) -> Trajectory:
    """Four digits lost above a spin of 50: the start is that much off."""
    if sum(value * value for value in start.omega) > 50**2:
        omega = [value * (1 + 10**4 * precision.eps) for value in start.omega]
        return propagate(top, State(omega, start.gamma), times, precision, system=system)
    return propagate(top, start, times, precision, system=system)


def rotor(top: HeavyTop, start: State, times: Times, precision: Precision, *, system: System) -> Trajectory:
    """A rotor counted with the wrong sign along axis 3 when its momentum there is negative and Ω1 too."""
    if top.rotor is not None and top.rotor[2] < 0 and start.omega[0] < 0:
        top = HeavyTop(top.inertia, top.weight, top.centre, (*top.rotor[:2], -top.rotor[2]))
    return propagate(top, start, times, precision, system=system)


def rest(top: HeavyTop, start: State, times: Times, precision: Precision, *, system: System) -> Trajectory:
    """NaN within 1e-6 of an equilibrium: where the field is below that."""
    field = system.field(system.parameters(top, start).mapped(Fraction), start.flat)
    run = propagate(top, start, times, precision, system=system)
    if math.hypot(*map(float, field)) < 1e-6:
        return replace(run, states=[numpy.full(6, math.nan) for _ in run.states])
    return run


def corner(top: HeavyTop, start: State, times: Times, precision: Precision, *, system: System) -> Trajectory:
    """An error that grows towards one ratio of moments and one direction of Ω, as 1/distance²."""
    run = propagate(top, start, times, precision, system=system)
    speed = math.hypot(*map(float, start.omega)) or 1.0
    apart = abs(float(top.inertia[0] / top.inertia[1]) - 1.4) + abs(float(start.omega[0]) / speed - 0.6)
    size = min(1e-4, float(precision.eps) / max(apart, 1e-12) ** 2)
    return replace(run, states=[state * (1 + size) for state in run.states])


def processor_seconds() -> float:
    """Of this process and of children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def measure(integrator: str, budget: str, seed: int) -> None:
    """A line about one hunt."""
    began, used = perf_counter(), processor_seconds()
    hunt = ht.hunt(integrator, budget=budget, seed=seed)
    seconds, used = perf_counter() - began, processor_seconds() - used
    taken = f"{hunt.motions:6} motions, {seconds:5.1f} s ({used:5.1f} s of processor)"
    head = f"{integrator.rpartition(':')[2]:8} seed {seed}: {taken}"
    if not hunt.found:
        print(f"{head}: nothing found")
    for each in hunt.found[:1]:
        data = "; ".join(f"{key} {each[key]}" for key in ("inertia", "weight", "centre", "omega", "gamma"))
        print(f"{head}: {each['outcome']}, {each['digits_lost']} digits lost: {data}")
    sys.stdout.flush()


if __name__ == "__main__":
    for seed in map(int, sys.argv[1:] or ["1", "2", "3"]):
        for fault in ("ratio", "branch", "spin", "rest", "corner"):
            measure(f"{__file__}:{fault}", "120s", seed)
        measure("heyoka", "2000", seed)
