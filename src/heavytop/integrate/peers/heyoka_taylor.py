"""Variants of heyoka's Taylor method as peers: compiled for one top, and with eight motions in SIMD lanes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from time import perf_counter

from heavytop.errors import Unsupported
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.peers.contract import with_tolerance
from heavytop.integrate.trajectory import Problem, Trajectory
from heavytop.precision import DOUBLE


@with_tolerance
def constants(problem: Problem, times: Sequence[Fraction], tolerance: Fraction | None) -> Trajectory:
    """heyoka with the parameters as constants of its code, compiled for each top; peers take them at run time."""
    assert problem.given is not None
    run = propagate(
        *problem.given,
        times,
        problem.precision,
        system=problem.system,
        xi=problem.xi,
        tolerance=tolerance,
        constants=True,
    )
    return replace(run, integrator="heyoka:constants")


LANES = 8


@with_tolerance
def lanes(problem: Problem, times: Sequence[Fraction], tolerance: Fraction | None) -> Trajectory:
    """The motion in one of eight SIMD lanes of one thread, the same in each; ``run`` is an eighth of their seconds."""
    if problem.precision != DOUBLE:
        raise Unsupported(f"heyoka:lanes does not support {problem.precision.name}.", "Use double.")
    began = perf_counter()
    run = propagate_ensemble([problem] * LANES, times, threads=1, lanes=LANES, tolerance=tolerance)[0]
    share = (perf_counter() - began) / LANES
    return replace(run, integrator="heyoka:lanes", seconds=run.seconds | {"run": share})
