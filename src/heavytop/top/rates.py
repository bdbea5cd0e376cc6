"""How fast a motion changes, from its parameters and start, in exact rationals."""

from __future__ import annotations

from typing import Any

from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, Parameters, System

_AXES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def square_of_rate(system: System, p: Parameters, y: tuple[Any, ...]) -> Any:
    """The square of the largest rate at which the motion through ``y`` changes, in 1/time unit².

    The rates are those of the rotation, |Ω_k| and |λ| or |k_k|/√(I_i I_j); of the precession of Ω about axis k,
    Ω_k² (I_k − I_i)(I_k − I_j)/(I_i I_j); and of the pendulum about axis i that the weight drives, with the parts of
    P r and γ across that axis: |P r||γ|/I_i.  Largest components stand for lengths.  Rational for rational data; of
    doubles a double.
    """
    inertia, omega, gamma = p.inertia, y[:3], y[3:6]
    by_rotor = () if system is HEAVY_GYROSTAT else p.rotors
    found = [max(map(abs, (*omega, *by_rotor))) ** 2]
    for i, j, k in _AXES:
        apart = (inertia[i] - inertia[j]) * (inertia[i] - inertia[k])
        found.append(abs(omega[i] ** 2 * apart / (inertia[j] * inertia[k])))
        if system is HEAVY_GYROSTAT:
            found.append(p.rotor[k] ** 2 / (inertia[i] * inertia[j]))
        if system is not GYROSTAT:
            across = [max(abs(vector[j]), abs(vector[k])) for vector in (p.moment, gamma)]
            found.append(across[0] * across[1] / inertia[i])
    return max(found)
