"""Membership in the ideal of a few polynomial relations: the proof that they force another polynomial to be 0."""

from __future__ import annotations

from collections.abc import Sequence
from math import lcm
from typing import Any

from flint import Ordering, fmpz_mpoly_ctx, fmpz_mpoly_vec

from heavytop.claims.sign import used

# elements of the basis, terms and bits of each: more is given up, which leaves the verdict undecided
_LIMITS = (60, 2_000, 4_096)


def forces_zero(relations: Sequence[Any], p: Any, *, radical: bool, never_zero: Sequence[Any] = ()) -> bool:
    """True only where ``p`` is a combination of ``relations`` with polynomial factors, so 0 where they all are.

    radical: also where a power of ``p`` is (Rabinowitsch: the relations and 1 − y p = 0 exclude each other).
    never_zero: also where ``p`` times powers of these is (saturation: 1 − z Π never_zero joins the relations).
    """
    if not p:
        return True
    names = sorted(set().union(used(p), *(used(relation) for relation in (*relations, *never_zero))))
    context = fmpz_mpoly_ctx.get([*(f"x{index}" for index in names), "y", "z"], Ordering.degrevlex)

    def integral(q: Any) -> Any:
        terms = {(*(monomial[index] for index in names), 0, 0): c for monomial, c in q.to_dict().items()}
        common = lcm(*(int(coefficient.q) for coefficient in terms.values()))
        return context.from_dict({monomial: int(c.p) * (common // int(c.q)) for monomial, c in terms.items()})

    # whatever the limits leave out of a basis, what reduces to 0 is in the ideal
    generators = [integral(relation) for relation in relations]
    if never_zero:
        product = context.gens()[-1]
        for q in never_zero:
            product *= integral(q)
        generators.append(1 - product)
    if not integral(p).reduction_primitive_part(_basis(generators, context)):
        return True
    if not radical:
        return False
    off = 1 - context.gens()[-2] * integral(p)
    return any(element.is_constant() and element for element in _basis([*generators, off], context))


def _basis(generators: Sequence[Any], context: Any) -> Any:
    basis, _complete = fmpz_mpoly_vec(generators, context).buchberger_naive(limits=_LIMITS)
    return basis
