"""Membership in the ideal of a few polynomial relations: the proof that they force another polynomial to be 0."""

from __future__ import annotations

from collections.abc import Sequence
from math import lcm
from typing import Any

from flint import Ordering, fmpz_mpoly_ctx, fmpz_mpoly_vec

from heavytop.claims.rational import used

# elements of the basis, terms and bits of each: more is given up, which leaves the verdict undecided
_LIMITS = (60, 2_000, 4_096)


def forces_zero(relations: Sequence[Any], p: Any) -> bool:
    """True only where ``p`` is a combination of ``relations`` with polynomial factors, so 0 where they all are."""
    if not p:
        return True
    names = sorted(set().union(used(p), *(used(relation) for relation in relations)))
    context = fmpz_mpoly_ctx.get([f"x{index}" for index in names], Ordering.degrevlex)

    def integral(q: Any) -> Any:
        terms = {tuple(monomial[index] for index in names): c for monomial, c in q.to_dict().items()}
        common = lcm(*(int(coefficient.q) for coefficient in terms.values()))
        return context.from_dict({monomial: int(c.p) * (common // int(c.q)) for monomial, c in terms.items()})

    basis, _complete = fmpz_mpoly_vec([integral(r) for r in relations], context).buchberger_naive(limits=_LIMITS)
    # whatever the limits left out, what reduces to 0 is in the ideal
    return not integral(p).reduction_primitive_part(basis)
