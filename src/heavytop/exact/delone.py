"""The homoclinic Delone motion of the Kovalevskaya top: elementary, from the paper's own data with I1 = I2 = 2 I3.

The heavy-top motion from Ω = (0, 0, 2α), γ = (0, 0, 1) at t = 0 with P b = α² I1/2, on the Delone class ξ = 0:

    q = tanh²(α t/√2),  sinθ = q/(2 − q),  cosφ = 2 sinθ − 1,  sinφ = −sgn(t) 2 √(sinθ (1 − sinθ)),  ψ = α t
    Ω = ( (α/2) sinφ,  α sinθ,  2 α cosθ ),   γ = ( sinθ sinφ, sinθ cosφ, cosθ )

In T = tanh(α t/√2), S = sech(α t/√2) no root is left: with d = 1 + S² (= 2 − q)

    sinθ = T²/d,  cosθ = 2 S/d,  sinφ = −2√2 T S/d

It is homoclinic to Ω = (0, α, 0), γ = (0, 1, 0) with rate α/√2.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from flint import arb

from heavytop.errors import NotInClass
from heavytop.exact.balls import FUNCTIONS, ball, to_bits
from heavytop.top.angles import attitude_from_angles
from heavytop.top.equations import HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State


@dataclass(frozen=True, slots=True)
class DeloneHomoclinic:
    """The heavy-top motion that (4.2)-(4.6) should have been for I1 = I2 = 2 I3.

    alpha: α > 0, 1/time.  i1: I1 = I2 = 2 I3 > 0.  Raises NotInClass outside.
    """

    alpha: Fraction
    i1: Fraction
    method: str = "closed form: Delone homoclinic"
    system: System = HEAVY_TOP

    def __post_init__(self) -> None:
        if self.alpha <= 0 or self.i1 <= 0:
            raise NotInClass(f"alpha = {self.alpha}, I1 = {self.i1}.", "Both must be positive.")

    @property
    def top(self) -> HeavyTop:
        """The Kovalevskaya top with P = 1, centre of mass on axis 2 at b = α² I1/2."""
        return HeavyTop((self.i1, self.i1, self.i1 / 2), 1, (0, self.alpha**2 * self.i1 / 2, 0))

    @property
    def start(self) -> State:
        """The state at t = 0."""
        return State((0, 0, 2 * self.alpha), (0, 0, 1))

    def _sines(self, time: Fraction) -> tuple[arb, arb, arb, arb]:
        """(sinφ, cosφ, sinθ, cosθ)."""
        x = ball(self.alpha * time) / arb(2).sqrt()
        tanh, sech = x.tanh(), x.sech()
        d = 1 + sech * sech
        sin_theta, cos_theta = tanh * tanh / d, 2 * sech / d
        # 1 - sinθ = 2 S²/d, so the root is exact and odd in t
        return -tanh * sech * arb(8).sqrt() / d, 2 * sin_theta - 1, sin_theta, cos_theta

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """See :class:`heavytop.exact.solution.ExactSolution`."""

        def evaluate(_working: int) -> list[arb]:
            alpha = ball(self.alpha)
            sin_phi, cos_phi, sin_theta, cos_theta = self._sines(time)
            omega = [alpha * sin_phi / 2, alpha * sin_theta, 2 * alpha * cos_theta]
            return [*omega, sin_theta * sin_phi, sin_theta * cos_phi, cos_theta]

        return to_bits(evaluate, bits)

    def angles(self, time: Fraction, bits: int) -> list[arb]:
        """(φ, θ, ψ), continuous for all t: θ in [0, π/2), φ rising from 0 through π at t = 0 to 2π."""

        def evaluate(_working: int) -> list[arb]:
            sin_phi, cos_phi, sin_theta, cos_theta = self._sines(time)
            phi = arb.pi() + arb.atan2(-sin_phi, -cos_phi)
            return [phi, arb.atan2(sin_theta, cos_theta), ball(self.alpha * time)]

        return to_bits(evaluate, bits)

    def attitude(self, time: Fraction, bits: int) -> list[arb]:
        """ξ, the space axis ⟂ γ in body components; at t = 0 φ + ψ = π, so ξ = (−1, 0, 0)."""

        def evaluate(working: int) -> list[arb]:
            phi, theta, psi = self.angles(time, working)
            return list(attitude_from_angles(phi, theta, psi, FUNCTIONS))

        return to_bits(evaluate, bits)
