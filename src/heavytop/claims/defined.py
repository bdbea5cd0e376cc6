"""Definitions kept as names, so that a chain of them is not expanded: symbols with a meaning, and their rates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import sympy


class Defined(sympy.Dummy):  # type: ignore[misc]
    """A symbol that stands for a formula, of which it depends on the symbols.  meaning: that formula."""

    meaning: sympy.Expr

    def __new__(cls, name: str, meaning: sympy.Expr) -> Defined:
        """A new symbol, equal to no other."""
        symbol: Defined = sympy.Dummy.__new__(cls, name, real=True)
        symbol.meaning = meaning
        symbol._inner = frozenset(meaning.free_symbols)
        return symbol

    @property
    def free_symbols(self) -> set[sympy.Basic]:
        """Itself, and what its formula holds."""
        return {self, *self._inner}

    def _sympystr(self, _printer: Any) -> str:
        return str(self.name)


def rate_along(rates: Mapping[sympy.Symbol, sympy.Expr]) -> Callable[[sympy.Expr], sympy.Expr]:
    """The derivative along a motion, given the rates of the variables; a definition has a rate that is defined too."""
    known: dict[Defined, sympy.Expr] = {}

    def rate(value: sympy.Expr) -> sympy.Expr:
        names = {symbol: sympy.Dummy(real=True) for symbol in value.atoms(Defined)}
        plain = value.xreplace(names)
        moving = {**rates, **{name: rate_of(symbol) for symbol, name in names.items()}}
        total = sum((sympy.diff(plain, x) * dx for x, dx in moving.items()), sympy.Integer(0))
        return total.xreplace({name: symbol for symbol, name in names.items()})

    def rate_of(symbol: Defined) -> sympy.Expr:
        if symbol not in known:
            inner = rate(symbol.meaning)
            known[symbol] = inner if inner.is_number else Defined(f"{symbol.name}'", inner)
        return known[symbol]

    return rate


def at_values(expression: sympy.Expr, values: Mapping[sympy.Symbol, sympy.Expr]) -> sympy.Expr:
    """The expression with these values, inside of definitions too."""
    known: dict[Defined, sympy.Expr] = {}

    def put_in(e: sympy.Expr) -> sympy.Expr:
        for symbol in e.atoms(Defined):
            if symbol not in known:
                known[symbol] = put_in(symbol.meaning)
        e = e.xreplace(known)
        return e.subs(values, simultaneous=True) if e.free_symbols else e

    return put_in(expression)
