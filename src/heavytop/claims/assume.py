"""What a file assumes of its parameters: ``assume = ["alpha > 0", "I1 > I3", "k < 1"]``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import sympy

from heavytop.claims.conditions import Kind, Need
from heavytop.errors import InputError

Bound = tuple[sympy.Expr, sympy.Expr]


@dataclass(frozen=True, slots=True)
class Assumed:
    """The fields of :class:`~heavytop.claims.statement.Setting` of the same names."""

    positive: tuple[sympy.Symbol, ...]
    greater: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    facts: tuple[sympy.Expr, ...]
    ranges: tuple[tuple[sympy.Symbol, tuple[Fraction, Fraction]], ...]
    weak: tuple[sympy.Expr, ...]


def comparisons(text: str, where: str = "assume") -> list[tuple[str, str]]:
    """(larger, smaller) of ``formula > formula``, and of each link of a chain such as ``0 < k < 1``.

    Raises InputError for anything else.
    """
    sign = ">" if ">" in text else "<"
    parts = [part.strip() for part in text.split(sign)]
    if len(parts) < 2 or not all(parts) or {"<", ">", "="} & set("".join(parts)):
        raise InputError(f"{where}: {text[:60]!r} is not understood.", "Write: formula > formula.")
    links = list(pairwise(parts))
    return links if sign == ">" else [(right, left) for left, right in links]


def assume(
    bounds: Sequence[Bound], needs: Iterable[Need], moments: Iterable[sympy.Expr], symbols: Iterable[sympy.Symbol]
) -> Assumed:
    """What follows from left > right of each bound, from what these need to be real, and from positive moments."""
    symbols = list(symbols)
    positive = tuple(symbol for symbol in symbols if symbol.is_positive)
    greater: list[tuple[sympy.Symbol, sympy.Expr]] = []
    facts: list[sympy.Expr] = []
    below: dict[sympy.Symbol, set[sympy.Symbol]] = {}
    for left, right in bounds:
        if left in positive and right == 0:
            continue
        # one bound below becomes a form of the symbol; forms may not go round in a circle
        reached = set(right.free_symbols).union(*(below.get(symbol, set()) for symbol in right.free_symbols))
        if left in symbols and left not in below and left not in reached:
            greater.append((left, right))
            below[left] = reached
            for others in below.values():
                if left in others:
                    others |= reached
        else:
            facts.append(left - right)
    facts += [moment for moment in moments if not moment.is_positive]
    asked = sorted(needs, key=lambda need: need.text)
    facts += [need.expression for need in asked if need.kind is Kind.POSITIVE]
    facts += [need.expression**2 for need in asked if need.kind is Kind.NONZERO]
    weak = tuple(need.expression for need in asked if need.kind is Kind.NONNEGATIVE)
    return Assumed(positive, tuple(greater), tuple(facts), tuple(_ranges(bounds)), weak)


def _ranges(bounds: Sequence[Bound]) -> Iterable[tuple[sympy.Symbol, tuple[Fraction, Fraction]]]:
    """Symbols between two fractions."""
    lower = {left: right for left, right in bounds if left.is_Symbol and right.is_Rational}
    upper = {right: left for left, right in bounds if right.is_Symbol and left.is_Rational}
    for symbol in lower.keys() & upper.keys():
        low, high = lower[symbol], upper[symbol]
        yield symbol, (Fraction(int(low.p), int(low.q)), Fraction(int(high.p), int(high.q)))
