"""A structure-preserving method with fixed steps: the energy split into parts whose flows are elementary.

½ M1²/I1, ½ M2²/I2, ½ M3²/I3 rotate M, γ and ξ about one axis each, n·γ adds a multiple of γ × n to M.  A rotor rotates
with the body; k of a heavy gyrostat changes the parts to ½ (M1 − k1)²/I1 and so on.  Each flow conserves |γ|² and M·γ,
and is exact up to rounding.  Their symmetric composition has order 2 (Touma and Wisdom,
1994; McLachlan and Quispel, Acta Numerica 2002); symmetric compositions of that have the orders 4 (Suzuki 1990) and
8 (Kahan and Li, Math. Comp. 66, 1997, 17 stages).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy

from heavytop.integrate.peers.double import (
    Request,
    Solution,
    Solve,
    compiler,
    count,
    double_peer,
    fixed_steps,
    reader,
    timed,
)
from heavytop.multiword.codegen.machine_code import Doubles
from heavytop.precision import OncePerArguments
from heavytop.top.equations import HEAVY_GYROSTAT, Parameters, System

_SUZUKI = 1 / (4 - 4 ** (1 / 3))
_KAHAN_LI = (
    0.13020248308889008087881763,
    0.56116298177510838456196441,
    -0.38947496264484728640807860,
    0.15884190655515560089621075,
    -0.39590389413323757733623154,
    0.18453964097831570709183254,
    0.25837438768632204729397911,
    0.29501172360931029887096624,
)
STAGES = {
    2: (1.0,),
    4: (_SUZUKI, _SUZUKI, 1 - 4 * _SUZUKI, _SUZUKI, _SUZUKI),
    8: (*_KAHAN_LI, 1 - 2 * math.fsum(_KAHAN_LI), *reversed(_KAHAN_LI)),
}


@OncePerArguments
def _stepper(system: System) -> Callable[..., None]:
    """A function (v, numbers, k, h, count, stages): ``count`` steps of size h of v = (M, γ) or (M, γ, ξ)."""
    jit = compiler()
    field, velocity, read = jit(system.field), jit(system.angular_velocity), jit(reader(system))
    cos, sin = math.cos, math.sin

    def kick(v: Doubles, p: Parameters, h: float) -> None:
        rates = field(p, (0.0, 0.0, 0.0, v[3], v[4], v[5]))
        for i in range(3):
            v[i] += h * p.inertia[i] * rates[i]

    def turn(v: Doubles, p: Parameters, k: Doubles, axis: int, h: float) -> None:
        i1, i2, i3 = p.inertia
        omega = velocity(p, ((v[0] - k[0]) / i1, (v[1] - k[1]) / i2, (v[2] - k[2]) / i3))
        c, s = cos(h * omega[axis]), sin(h * omega[axis])
        for vector in range(0, len(v), 3):
            a, b = vector + (axis + 1) % 3, vector + (axis + 2) % 3
            v[a], v[b] = v[a] * c + v[b] * s, v[b] * c - v[a] * s

    kick, turn = jit(kick), jit(turn)

    def advance(v: Doubles, n: Doubles, k: Doubles, h: float, count: int, stages: Doubles) -> None:
        p = read(n)
        for _ in range(count):
            for weight in stages:
                half = weight * h / 2
                kick(v, p, half)
                turn(v, p, k, 0, half)
                turn(v, p, k, 1, half)
                turn(v, p, k, 2, 2 * half)
                turn(v, p, k, 1, half)
                turn(v, p, k, 0, half)
                kick(v, p, half)

    compiled = jit(advance)
    compiled(numpy.ones(6), numpy.ones(count(system)), numpy.zeros(3), 0.0, 1, numpy.ones(1))
    return compiled  # type: ignore[no-any-return]


def _solver(order: int) -> Solve:
    def solve(request: Request) -> Solution:
        advance, seconds = timed(_stepper, request.system)
        stages = numpy.array(STAGES[order])
        inertia = request.numbers[:3]
        k = request.numbers[6:] if request.system is HEAVY_GYROSTAT else numpy.zeros(3)
        v = numpy.concatenate([inertia * request.start[:3] + k, request.start[3:]])

        def steps(v: Doubles, h: float, number: int) -> None:
            advance(v, request.numbers, k, h, number, stages)

        def state(v: Doubles) -> Doubles:
            return numpy.concatenate([(v[:3] - k) / inertia, v[3:]])

        return fixed_steps(request, v, steps, state, seconds)

    return solve


order2, order4, order8 = (
    double_peer(f"splitting:{order}", order, _solver(order), "step", attitude=True) for order in (2, 4, 8)
)
