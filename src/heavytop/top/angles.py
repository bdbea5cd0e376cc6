"""Euler angles (3.2), 3-1-3, and the attitude vector that carries them through the poles.

ξ is a second unit vector fixed in space, ξ ⟂ γ, in body components; η = γ × ξ.  In space γ = e_z, ξ = e_x, η = e_y.
The functions take ``lib``, a namespace with the elementary functions of the numbers at hand (math, mpmath, numpy,
sympy, or :data:`heavytop.exact.balls.FUNCTIONS`).
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from heavytop.top.vectors import Vector, cross


def gamma_from_angles(phi: Any, theta: Any, lib: Any) -> tuple[Any, Any, Any]:
    """γ = (sinθ sinφ, sinθ cosφ, cosθ), (3.2)."""
    return lib.sin(theta) * lib.sin(phi), lib.sin(theta) * lib.cos(phi), lib.cos(theta)


def omega_from_angles(gamma: Any, phi: Any, rates: Any, lib: Any) -> tuple[Any, Any, Any]:
    """(3.1): (ψ'γ1 + θ' cosφ, ψ'γ2 − θ' sinφ, ψ'γ3 + φ'), from ``rates`` = (φ', θ', ψ')."""
    phi_rate, theta_rate, psi_rate = rates
    return (
        psi_rate * gamma[0] + theta_rate * lib.cos(phi),
        psi_rate * gamma[1] - theta_rate * lib.sin(phi),
        psi_rate * gamma[2] + phi_rate,
    )


def attitude_from_angles(phi: Any, theta: Any, psi: Any, lib: Any) -> tuple[Any, Any, Any]:
    """ξ, the space axis e_x in body components, for any angles (θ of either sign)."""
    sin_psi, cos_psi, cos_theta = lib.sin(psi), lib.cos(psi), lib.cos(theta)
    return (
        cos_psi * lib.cos(phi) - sin_psi * cos_theta * lib.sin(phi),
        -cos_psi * lib.sin(phi) - sin_psi * cos_theta * lib.cos(phi),
        sin_psi * lib.sin(theta),
    )


def euler_angles(gamma: Any, xi: Any, lib: Any) -> tuple[Any, Any, Any]:
    """(φ, θ, ψ) with φ = atan2(γ1, γ2), θ = atan2(√(γ1² + γ2²), γ3) in [0, π], ψ = atan2(ξ3, −η3).

    φ and ψ are undefined at the poles γ3 = ±1.
    """
    eta = cross(gamma, xi)
    across = lib.sqrt(gamma[0] * gamma[0] + gamma[1] * gamma[1])
    return lib.atan2(gamma[0], gamma[1]), lib.atan2(across, gamma[2]), lib.atan2(xi[2], -eta[2])


def rotation_angle(first: tuple[Any, Any], second: tuple[Any, Any], lib: Any) -> Any:
    """The angle in [0, π] of the rotation between two attitudes (γ, ξ), each of unit vectors.

    Twice atan2(s, c) with s = |R − 1|/(2√2) and c² = 1 − s²: no digits are lost near 0.
    """
    (gamma, xi), (other_gamma, other_xi) = first, second
    pairs = ((gamma, other_gamma), (xi, other_xi), (cross(gamma, xi), cross(other_gamma, other_xi)))
    square = sum((a - b) * (a - b) for u, v in pairs for a, b in zip(u, v, strict=True)) / 8
    cosine_squared = 1 - square
    return 2 * lib.atan2(lib.sqrt(square), lib.sqrt(cosine_squared))


def unwrap(angles: Iterable[Any], turn: Any) -> list[Any]:
    """The same angles shifted by multiples of ``turn`` (2π) so that neighbours differ by at most half a turn.

    Meaningful only where the samples are dense enough that the true angle moves less than half a turn between them.
    """
    result: list[Any] = []
    for angle in angles:
        if result:
            angle = angle - turn * round(float((angle - result[-1]) / turn))
        result.append(angle)
    return result


def perpendicular(gamma: Vector) -> Vector:
    """An exact rational unit vector ⟂ γ (|γ| = 1 exactly): where an attitude that nobody gave starts.

    The image of e1 under the reflection that takes e3 to γ; e1 itself for γ = e3.
    """
    v = (-gamma[0], -gamma[1], 1 - gamma[2])
    if not any(v):
        return Fraction(1), Fraction(0), Fraction(0)
    factor = 2 * v[0] / (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return 1 - factor * v[0], -factor * v[1], -factor * v[2]
