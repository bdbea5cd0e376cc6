"""Properties of an expression from its tree, without expansion: its rate, and the first integrals in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any

import sympy

# Definitions as symbols with a meaning, so that a chain of them is not expanded, and their rates.


class Defined(sympy.Dummy):  # type: ignore[misc]
    """A symbol for a formula, which depends on the formula's symbols.  meaning: that formula."""

    meaning: sympy.Expr

    def __new__(cls, name: str, meaning: sympy.Expr) -> Defined:
        """A new symbol, different from all others."""
        symbol: Defined = sympy.Dummy.__new__(cls, name, real=True)
        symbol.meaning = meaning
        symbol._inner = frozenset(meaning.free_symbols)
        return symbol

    @property
    def free_symbols(self) -> set[sympy.Basic]:
        """Itself and the symbols of its formula."""
        return {self, *self._inner}

    def _sympystr(self, _printer: Any) -> str:
        return str(self.name)


def rate_along(rates: Mapping[sympy.Symbol, sympy.Expr]) -> Callable[[sympy.Expr], sympy.Expr]:
    """The derivative along a motion with these rates of the variables; the rate of a definition is a definition."""
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


def rationals(values: Mapping[sympy.Symbol, Fraction | sympy.Expr]) -> dict[sympy.Symbol, sympy.Expr]:
    """Exact values for SymPy."""
    return {symbol: sympy.sympify(value) for symbol, value in values.items()}


def rational_values(
    expressions: Iterable[sympy.Expr], sample: Mapping[sympy.Symbol, Fraction]
) -> list[Fraction] | None:
    """The values of expressions at a sample; None where one of them is no rational number."""
    numbers = rationals(sample)
    values = [e.xreplace(numbers) for e in expressions]
    return list(map(Fraction, values)) if all(value.is_Rational for value in values) else None


def at_values(expression: sympy.Expr, values: Mapping[sympy.Symbol, sympy.Expr]) -> sympy.Expr:
    """The expression with these values, in definitions too."""
    known: dict[Defined, sympy.Expr] = {}

    def substituted(e: sympy.Expr) -> sympy.Expr:
        for symbol in e.atoms(Defined):
            if symbol not in known:
                known[symbol] = substituted(symbol.meaning)
        e = e.xreplace(known)
        return e.subs(values, simultaneous=True) if e.free_symbols else e

    return substituted(expression)


class Names:
    """Symbols for the smallest polynomials of the state that are constant in time."""

    def __init__(self, state: frozenset[sympy.Symbol], is_constant: Callable[[sympy.Expr], bool]) -> None:
        self._state = state
        self._is_constant = is_constant
        self._names: dict[sympy.Expr, sympy.Symbol | None] = {}

    @property
    def meanings(self) -> dict[sympy.Symbol, sympy.Expr]:
        """The symbols so far, with their meanings."""
        return {name: e for e, name in self._names.items() if name is not None}

    def put_into(self, e: sympy.Expr) -> sympy.Expr:
        """``e`` with its first integrals replaced by their symbols."""
        if not e.free_symbols & self._state:
            return e
        if isinstance(e, Defined):
            return self._definition(e)
        if not e.args:
            return self._name(e)
        if e.is_Add:
            return self._into_sum(e)
        named = e.func(*(self.put_into(part) for part in e.args))
        return self._name(e) if e.is_Mul and named.free_symbols & self._state else named

    def _definition(self, e: Defined) -> sympy.Expr:
        if e not in self._names:
            is_constant = not self.put_into(e.meaning).free_symbols & self._state
            self._names[e] = sympy.Symbol(f"({e})", real=True) if is_constant else None
        return self._names[e] or e

    def _into_sum(self, e: sympy.Expr) -> sympy.Expr:
        parts = {part: self.put_into(part) for part in e.args}
        moving = [part for part, named in parts.items() if named.free_symbols & self._state]
        constant = [named for part, named in parts.items() if part not in moving]
        total = sympy.Add(*moving)
        name = self._name(total) if moving else total
        return sympy.Add(*constant, name) if name != total else sympy.Add(*parts.values())

    def _name(self, e: sympy.Expr) -> sympy.Expr:
        if e not in self._names:
            constant = e.is_polynomial(*self._state) and self._is_constant(e)
            # names in files have no parentheses
            self._names[e] = sympy.Symbol(f"({e})", real=True) if constant else None
        return self._names[e] or e
