"""Theta functions of one nome at many real or imaginary arguments: polynomials made once, with a proven tail.

With x = πz and c = cos 2x, Chebyshev's polynomials take every angle to one variable (DLMF 18.5(i)):

    cos 2nx = T_n(c),   sin (2n+1)x = (U_n + U_(n−1))(c) sin x,   cos (2n+1)x = (U_n − U_(n−1))(c) cos x

so the Fourier series of the thetas (DLMF 20.2.1-20.2.4) are polynomials in c times 1, sin x or cos x.  On the
imaginary axis sin, cos become i sinh, cosh and nothing else changes.  Their coefficients fall like q^(n²): few terms
are left.

Tail: |U_n ± U_(n−1)|, |T_n| ≤ (2n + 1) g^n where |e^(2ix)| ≤ g, 1/g ≤ |e^(2ix)|.  If the weights are at most
q^(n²) w^n, the terms from n = N on are below b_N = (2N + 1) q^(N²) (g w)^N and fall at least by the factor
3 q^(2N+1) g w; where that is below 1/2 they add up to less than 2 b_N.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, cycle, repeat
from typing import Any

from flint import acb, acb_poly, arb, arb_poly, fmpz_poly

from heavytop.exact.balls import working_precision
from heavytop.exact.flint_context import current_precision

_MOST = 2000


@dataclass(frozen=True, slots=True)
class Theta:
    """The series of one nome, at a working precision.

    square: q², of either sign (q imaginary where the half-periods' ratio has the real part 1/2).
    rate: x = rate · u at the real argument u, and x = i rate · u where ``hyperbolic``.
    growth: g, an upper bound of |e^(±2ix)|, for all arguments that will be asked for.
    """

    square: arb
    rate: arb
    hyperbolic: bool
    growth: arb

    def angles(self, u: arb) -> tuple[arb, arb, arb]:
        """(sin x, cos x, cos 2x), or (sinh, cosh, cosh 2·)."""
        if self.hyperbolic:
            sine, cosine = (self.rate * u).sinh_cosh()
            return sine, cosine, 1 + 2 * (sine * sine)
        sine, cosine = (self.rate * u).sin_cos()
        return sine, cosine, 1 - 2 * (sine * sine)

    def odd(self, shift: acb | None = None) -> tuple[Any, Any]:
        """(S, C): θ1 and θ2 over 2q^(1/4) are S(c) sin x and C(c) cos x; sin x is without its i.

        With a shift v, θ1(v − z) over 2q^(1/4) is C(c) cos x − S(c) sin x, with S times i where ``hyperbolic``.
        """
        if shift is None:
            return self._sum(self.square, 1, _signs(-1), 1, 1), self._sum(self.square, 1, repeat(1), -1, 1)
        angle = shift * arb.pi()
        wide, turn = (2 * abs(angle.imag)).exp().upper(), -2 * (2 * angle).cos()
        sine, cosine = angle.sin_cos()
        unit = acb(0, 1) if self.hyperbolic else acb(1)
        # (−1)^n times the cosines and sines of (2n + 1) angle
        cosines, sines = _recurrent(turn, -unit * cosine, unit * cosine), _recurrent(turn, sine, sine)
        return self._sum(self.square, 1, cosines, 1, wide), self._sum(self.square, 1, sines, -1, wide)

    def even(self, sign: int) -> Any:
        """θ3 (sign +1) or θ4 (−1), as a polynomial in c; q² > 0."""
        return self._sum(self.square.sqrt(), 2, _doubled(sign), 0, 2)

    def both(self) -> Any:
        """θ3 θ4/θ4(0|2τ) = θ4(2z|2τ), DLMF 20.7.11, as a polynomial in c."""
        double = Theta(self.square * self.square, self.rate, self.hyperbolic, self.growth * self.growth)
        return double._sum(self.square, 2, _doubled(-1), 0, 2)(arb_poly([-1, 0, 2]))

    def _sum(self, base: arb, step: int, factors: Iterator[Any], kind: int, wide: Any) -> Any:
        """Σ base^(n + step n (n − 1)/2) factor_n C_n with C_n = T_n (kind 0) or U_n + kind U_(n−1)."""
        taken, tail = self._enough(wide)
        total, power, ratio = next(factors) * arb_poly([1]), arb(1), base
        for n in range(1, taken):
            power, ratio = power * ratio, ratio * base**step
            total += power * next(factors) * arb_poly(_chebyshev(n, kind))
        return total + (acb_poly([acb(tail, tail)]) if isinstance(total, acb_poly) else arb_poly([tail]))

    def _enough(self, wide: Any) -> tuple[int, arb]:
        """N, and the ball around 0 with the sum of all terms from n = N on; not finite where nothing is known."""
        smallest = arb(2) ** (-current_precision() - 8)
        with working_precision(64):
            nome, growth = abs(self.square).sqrt(), self.growth * wide
            for n in range(1, _MOST):
                term = (2 * n + 1) * nome ** (n * n) * growth**n
                if term < smallest and nome ** (2 * n + 1) * growth < arb(1) / 6:
                    return n, arb(0, (2 * wide * term).upper())
                if not term.is_finite():
                    break
        return 1, arb(0, "inf")


def _signs(sign: int) -> Iterator[int]:
    return cycle((1, sign))


def _doubled(sign: int) -> Iterator[int]:
    return chain((1,), (2 * s for s in cycle((sign, 1))))


def _recurrent(turn: acb, before: acb, first: acb) -> Iterator[acb]:
    """x_(n+1) = turn x_n − x_(n−1)."""
    while True:
        yield first
        before, first = first, turn * first - before


def _chebyshev(n: int, kind: int) -> Any:
    if kind == 0:
        return fmpz_poly.chebyshev_t(n)
    return fmpz_poly.chebyshev_u(n) + kind * fmpz_poly.chebyshev_u(n - 1)
