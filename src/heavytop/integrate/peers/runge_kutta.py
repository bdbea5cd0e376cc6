"""Explicit Runge-Kutta methods with fixed steps: a peer is its coefficients.

W. Kutta, Z. Math. Phys. 46 (1901) 435; J. C. Butcher, Numerical Methods for Ordinary Differential Equations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numpy

from heavytop.errors import InputError
from heavytop.integrate.peers.double import (
    Request,
    Solution,
    compiler,
    count,
    double_peer,
    fill,
    fixed_steps,
    timed,
)
from heavytop.integrate.trajectory import Trajectory
from heavytop.multiword.codegen.machine_code import Doubles
from heavytop.precision import OncePerArguments
from heavytop.top.equations import System

Coefficient = Fraction | float | int


@dataclass(frozen=True, slots=True)
class Tableau:
    """Butcher's coefficients of an explicit method; c is not needed: the field is autonomous.

    order: of the method.  a: a row for each stage after the first, with as many coefficients as stages before it.
    b: the weights, one for each stage.
    Raises InputError for rows of another length, and for weights that do not add up to 1.
    """

    order: int
    a: tuple[tuple[Coefficient, ...], ...]
    b: tuple[Coefficient, ...]

    def __post_init__(self) -> None:
        lengths, wanted = [len(row) for row in self.a], list(range(1, len(self.b)))
        if lengths != wanted:
            raise InputError(
                f"The rows of a have wrong lengths: {lengths}.", f"Give {wanted}: as many stages as weights."
            )
        total = sum(map(float, self.b))
        if abs(total - 1) > len(self.b) * 2.0**-52:
            raise InputError(f"The weights b must sum to 1; got {total}.", "Correct the weights.")

    def peer(self, name: str) -> Callable[..., Trajectory]:
        """The method as a peer, which carries the attitude."""
        return double_peer(name, self.order, partial(_solve, self), "step", attitude=True)


@OncePerArguments
def _stepper(system: System, width: int) -> Callable[..., None]:
    """(y, numbers, h, count, a, b): ``count`` steps of size h."""
    jit = compiler()
    write = jit(fill(system, width))

    def advance(y: Doubles, numbers: Doubles, h: float, count: int, a: Doubles, b: Doubles) -> None:
        rates, stage = numpy.empty((len(b), len(y))), numpy.empty(len(y))
        for _ in range(count):
            for i in range(len(b)):
                stage[:] = y
                for j in range(i):
                    stage += h * a[i, j] * rates[j]
                write(rates[i], 0.0, stage, numbers)
            for i in range(len(b)):
                y += h * b[i] * rates[i]

    compiled = jit(advance)
    compiled(numpy.ones(width), numpy.ones(count(system)), 0.0, 1, numpy.zeros((1, 1)), numpy.ones(1))
    return compiled  # type: ignore[no-any-return]


def _solve(tableau: Tableau, request: Request) -> Solution:
    advance, seconds = timed(_stepper, request.system, request.width)
    b = numpy.array([float(weight) for weight in tableau.b])
    a = numpy.zeros((len(b), len(b)))
    for i, row in enumerate(tableau.a, 1):
        a[i, :i] = [float(value) for value in row]

    def steps(y: Any, h: float, number: int) -> None:
        advance(y, request.numbers, h, number, a, b)

    solution = fixed_steps(request, request.start.copy(), steps, compile=seconds)
    return Solution(solution.states, solution.reached, solution.steps, len(b) * solution.steps, seconds)
