"""Claims that an equilibrium or a permanent rotation is stable, or unstable, in Ω and γ.

Stability is Lyapunov's.  First the claimed Ω and γ are proven to be a constant solution, and then the criteria of
:mod:`heavytop.top.stability` on the whole domain.  A proof of the opposite at a sample refutes the claim.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import sympy

from heavytop.errors import InputError, refusal
from heavytop.features.claims.algebra.fields import Assumptions, Field
from heavytop.features.claims.algebra.prover import Condition
from heavytop.features.claims.algebra.ring import where_provable
from heavytop.features.claims.algebra.statement import ALL, TIME, Statement
from heavytop.features.claims.algebra.structure import rational_values
from heavytop.features.claims.audit.context import ClaimFile
from heavytop.features.claims.audit.judge import Progress, StatementVerdict, silent, verdict_of
from heavytop.features.claims.audit.user_claims import UserMotion
from heavytop.top.equations import HEAVY_TOP, Parameters, System
from heavytop.top.stability import drifts, is_stable, quadratic_of_squares, stability

_CRITERIA = {
    True: "the second variation of a combination of first integrals is definite on their level",
    False: "an eigenvalue has a positive real part, or a free body drifts: at rest, or with two equal moments",
}


class UserStability(UserMotion):
    """A steady motion claimed in a file to be stable or unstable."""

    def __init__(self, content: ClaimFile) -> None:
        super().__init__(content)
        moves = TIME in sympy.Tuple(*self.motion.state).free_symbols
        if moves or self.table.omega is None or self.table.gamma is None or self.motion.attitude:
            cause = "A claim of stability needs omega and gamma in [motion], constant in time, and no attitude."
            raise InputError(cause, "State the equilibrium or permanent rotation in parameters.")
        if content.quadrature is not None or content.times is not None or content.domain != "all":
            raise InputError("A claim of stability is about all times.", "Leave out quadrature, times and domain.")
        if isinstance(self.context.top.inertia[0], tuple):
            raise InputError("A claim of stability needs principal axes.", "Give the three principal moments.")

    def about(self, requested: System | None) -> System:
        """The heavy top; raises InputError where the file or the caller names another."""
        about = UserMotion.about(self, requested)
        if about is not HEAVY_TOP:
            raise refusal("A claim of stability", "about heavy_top", about.name, "Leave out the rotor.")
        return about

    def rows(self, about: System, progress: Progress = silent) -> tuple[StatementVerdict, ...]:
        """The verdicts on the equations of motion, and on the stability."""
        rows = super().rows(about, progress)
        return (*rows, self._stability(about, rows))

    def _stability(self, about: System, rows: Sequence[StatementVerdict]) -> StatementVerdict:
        claimed = bool(self.content.stable)
        is_steady = verdict_of(rows) == "holds"
        opposite = next(self._opposites(about), None) if is_steady else None
        settings = (self.setting, self.setting.with_solutions())
        proven = is_steady and opposite is None and any(self._is_proven(about, s.assumptions(0)) for s in settings)
        conditions = (
            Condition("Omega and gamma are a constant solution", is_steady, "by the rows of the equations of motion"),
            Condition(_CRITERIA[claimed], proven, "proven on the whole domain" if proven else "not shown"),
        )
        residual, witness = opposite or ("none: proven" if proven else "not known", None)
        text = f"the constant solution is {'stable' if claimed else 'unstable'} (Lyapunov), in Omega and gamma"
        holds = False if witness else True if proven else None
        return StatementVerdict("stability", 1, "smooth", "all", holds, residual, text, witness, "", conditions)

    def _opposites(self, about: System) -> Iterator[tuple[str, dict[str, Any]]]:
        """Samples at which the opposite is proven in exact rationals."""
        p, y = self.context.parameters(about), self.motion.state
        at_once = Statement("", 1, "", replace(ALL, points=(Fraction(0),)), sympy.Integer(0), "")
        for sample in self.setting.sample_points(at_once):
            values = rational_values((*p.inertia, *p.moment, *y), sample)
            if values is None:
                continue
            top = Parameters(tuple(values[:3]), tuple(values[3:6]), Fraction(0))
            steady = stability(about, top, values[6:])
            at_rest = _is_at_rest(top, values[6:])
            verdict = "unstable" if at_rest else steady.verdict if steady is not None else ""
            if verdict == ("unstable" if self.content.stable else "stable"):
                why = ": however small its Ω, γ drifts away linearly" if at_rest else steady.why if steady else ""
                rate = f", at the rate {steady.rate:.6g}" if steady and steady.rate else ""
                parameters = {str(s): str(value) for s, value in sample.items() if s != TIME}
                yield f"{verdict}{rate}{why}", {"parameters": parameters}

    def _is_proven(self, about: System, assumptions: Assumptions) -> bool:
        p, y, sign = self.context.parameters(about), self.motion.state, partial(_sign, assumptions)
        if self.content.stable:
            return is_stable(p, y, sign)
        if _is_at_rest(p, y) or (not any(p.moment) and any(sign(square) == 1 for square, _ in drifts(about, p, y))):
            return True
        a, b = quadratic_of_squares(about, p, y)
        # where b < 0 the root is not real, and the motion unstable
        return any(sign(e) == 1 for e in (-a, -b, 4 * b - a**2, 2 * sympy.sqrt(sympy.factor(b)) - a))


def _is_at_rest(p: Parameters, y: Sequence[Any]) -> bool:
    """Whether a free body is at rest: with the least Ω, γ turns away."""
    return not any(p.moment) and not any(y[:3])


@where_provable(None)
def _sign(assumptions: Assumptions, e: sympy.Expr) -> int | None:
    """0 or 1 where the expression is proven to be 0, or positive, and defined on the whole domain; else None."""
    field = Field(assumptions, [sympy.sympify(e)])
    value = field.enter(sympy.sympify(e))
    sign, signs = field.tower.sign(value), field.tower.signs
    if not all(signs.of(p).strict for p in (value.denominator, *field.tower.divisors.values())):
        return None
    return 0 if not value.numerator else 1 if sign.value > 0 and sign.strict else None
