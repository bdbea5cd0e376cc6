"""The gyrostat motion behind the paper's partial case (4.1)-(4.6): I1 = I2 > I3, homoclinic.

With ρ = I1/I3, k = α (ρ − 1), s = k t/2 and I1, I3, α > 0 (MATH: the smooth branch, all t):

    Ω = α ( −tanh s sech s,  tanh² s,  ρ sech s ),   γ = ( −tanh s sech s,  tanh² s,  sech s )

It solves M' = M × ω, γ' = γ × ω with ω = Ω + λ e2, λ = k/2 = P b/(M·γ), and tends to the permanent rotation
Ω = (0, α, 0), γ = (0, 1, 0), a saddle with exponents ±k/2.  Attitude: θ = −gd(s), φ = π/2 + gd(s),
ψ = α t (I1 + I3)/(2 I3), continued through the pole at t = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from flint import arb, arb_series

from heavytop.errors import NotInClass
from heavytop.exact.closed_form import WithAngles, instant, tanh_sech
from heavytop.exact.flint.balls import FUNCTIONS, ball, to_bits
from heavytop.exact.solution import SPIN_UPWARDS, ExactRelation, apart, positive
from heavytop.precision import Real, shown
from heavytop.top.attitude import Library
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State


def hyperbolic(
    alpha: Real, ratio: Real, tanh: Real, sech: Real
) -> tuple[tuple[Real, Real, Real], tuple[Real, Real, Real]]:
    """(Ω, γ) from tanh s and sech s, s = k t/2, over any ring."""
    gamma = (-tanh * sech, tanh * tanh, sech)
    return (alpha * gamma[0], alpha * gamma[1], alpha * ratio * gamma[2]), gamma


def hyperbolic_angles(s: Real, lib: Library) -> tuple[Real, Real]:
    """(φ, θ) at s = k t/2: φ = π/2 + gd(s) = 2 arctan e^s, θ = −gd(s); no digits are lost at either end."""
    return 2 * lib.arctan(lib.exp(s)), -2 * lib.arctan(lib.tanh(s / 2))


@dataclass(frozen=True, slots=True)
class ErshkovPartial(WithAngles):
    """The homoclinic gyrostat motion from Ω = (0, 0, ρ α), γ = (0, 0, 1) at t = 0.

    alpha: α > 0, 1/time.  i1, i3: I1 = I2 > I3 > 0.  Raises NotInClass outside.
    """

    alpha: Fraction
    i1: Fraction
    i3: Fraction
    method = "closed form: gyrostat, hyperbolic (4.2)-(4.6)"
    source = "S. V. Ershkov, On the invariant motions of rigid body rotation, (4.2)-(4.6)"
    system = GYROSTAT
    body = (
        ExactRelation("I1 = I2", "I1 - I2", lambda top, _: (top.inertia[0] - top.inertia[1],)),
        ExactRelation("I1 > I3", "I1 - I3", lambda top, _: (top.inertia[0] - top.inertia[2],), positive),
    )
    starts = (
        SPIN_UPWARDS,
        ExactRelation(
            "the top and start of alpha = I3 Omega3/I1",
            "the difference",
            lambda top, start: apart(ErshkovPartial.of(top, start), top, start),
        ),
    )

    def __post_init__(self) -> None:
        if self.alpha <= 0:
            raise NotInClass(f"alpha = {shown(self.alpha)} is not positive.", "The partial case needs alpha > 0.")
        if not self.i1 > self.i3 > 0:
            raise NotInClass(f"I1 = {shown(self.i1)}, I3 = {shown(self.i3)}.", "(4.1) needs I1 = I2 > I3 > 0.")

    @classmethod
    def of(cls, top: HeavyTop, start: State) -> ErshkovPartial:
        """The motion with these moments and Ω3."""
        i1, _, i3 = top.inertia
        return cls(start.omega[2] * i3 / i1, i1, i3)

    @property
    def rate(self) -> Fraction:
        """k = α (I1 − I3)/I3; the motion approaches the saddle like e^(−k|t|/2)."""
        return self.alpha * (self.i1 - self.i3) / self.i3

    @property
    def top(self) -> HeavyTop:
        """The top of (4.1), with P = 1: P b = α² I1 (I1 − I3)/(2 I3)."""
        b = self.alpha**2 * self.i1 * (self.i1 - self.i3) / (2 * self.i3)
        return HeavyTop((self.i1, self.i1, self.i3), 1, (0, b, 0))

    @property
    def start(self) -> State:
        """The state at t = 0."""
        return State((0, 0, self.alpha * self.i1 / self.i3), (0, 0, 1))

    def evaluate(self, time: Fraction) -> list[arb_series]:
        tanh, sech = tanh_sech(ball(self.rate / 2) * instant(time))
        omega, gamma = hyperbolic(ball(self.alpha), ball(self.i1 / self.i3), tanh, sech)
        return [*omega, *gamma]

    def angles(self, time: Fraction, bits: int) -> list[arb]:
        """(φ, θ, ψ), continuous for all t; θ takes the sign of −t."""

        def evaluate(_working: int) -> list[arb]:
            s = ball(self.rate * time / 2)
            psi = ball(self.alpha * time * (self.i1 + self.i3) / (2 * self.i3))
            return [*hyperbolic_angles(s, FUNCTIONS), psi]

        return to_bits(evaluate, bits)
