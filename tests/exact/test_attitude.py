"""The attitude beside a reference, and the vector that Kovalevskaya's is built on."""

from __future__ import annotations

from flint import fmpq_mpoly_ctx

import heavytop as ht
from heavytop.cases import CASES


def test_no_attitude_is_given_that_nobody_asked_for() -> None:
    case = CASES["euler"]
    known = ht.reference(case.top, case.start, [1], 20)
    assert known.attitude is None
    assert known.attitude_method is None


def test_the_level_vector_of_kovalevskayas_top_is_proven_by_polynomials() -> None:
    """v·γ = 0, v² = −4q² (w1 − e)(w2 − e) and v² Λ' = γ·(v × (v' + Ω × v)) = (l/2)(v² + 4q² (e² − k²)), on |γ| = 1."""
    context = fmpq_mpoly_ctx.get(["p", "q", "r", "g1", "g2", "g3", "a"], "lex")
    p, q, r, *gamma, a = context.gens()
    omega, up = (p, q, r), tuple(gamma)
    momentum = (2 * p, 2 * q, r)

    def cross(x, y):
        return tuple(x[i - 2] * y[i - 1] - x[i - 1] * y[i - 2] for i in range(3))

    def dot(x, y):
        return sum((one * other for one, other in zip(x, y, strict=True)), context.from_dict({}))

    def on_sphere(f):
        """The remainder with γ3² = 1 − γ1² − γ2²."""
        return divmod(f, gamma[2] ** 2 + gamma[0] ** 2 + gamma[1] ** 2 - 1)[1]

    moved = [one + other for one, other in zip(cross(momentum, omega), cross(up, (a, 0 * a, 0 * a)), strict=True)]
    rates = (moved[0] / 2, moved[1] / 2, moved[2], *cross(up, omega))

    def rate(f):
        return dot([f.derivative(i) for i in range(6)], rates)

    s, h, l = p**2 + q**2, p**2 + q**2 + r**2 / 2 + a * gamma[0], dot(momentum, up)  # noqa: E741
    e, (real, imaginary) = l**2 / 2 - h, (p**2 - q**2 - a * gamma[0], 2 * p * q - a * gamma[1])
    k2 = real**2 + imaginary**2
    v = (
        r * (l**2 / 2 - 2 * p**2) + gamma[2] * (2 * a * p - l * (h + q**2 - p**2)),
        -2 * p * q * r - a * l * gamma[1] * gamma[2] + 2 * l * p * q * gamma[2] + l * r * (p * gamma[1] - q * gamma[0]),
        l * ((k2 - s**2) / a) + 2 * p * (s + e),
    )
    assert on_sphere(dot(v, up)) == 0
    c, g = a * l, a**2 - k2
    r12, hat = -(s**2) + 2 * h * s - 2 * c * p + g, 2 * h * s**2 - 4 * c * s * p + 4 * g * p**2 + c**2 - 2 * g * h
    square = dot(v, v)
    assert on_sphere(square - (-4 * q**2 * e**2 - 2 * r12 * e + hat)) == 0
    turned = [rate(one) + other for one, other in zip(v, cross(omega, v), strict=True)]
    assert on_sphere(dot(up, cross(v, turned)) - l / 2 * (square + 4 * q**2 * (e**2 - k2))) == 0
    assert on_sphere(rate(k2)) == 0
    assert on_sphere(dot(up, cross(v, turned)) - l / 2 * (square + 4 * q**2 * (e**2 + k2))) != 0
