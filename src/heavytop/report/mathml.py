"""Formulas of claims as MathML, as they are written: no term is moved, nothing is put together.

Browsers show MathML by themselves: a page needs no script and fetches nothing.
"""

from __future__ import annotations

import re
from html import escape

_TOKEN = re.compile(r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[A-Za-z]\w*'*|\*\*|[-+*/^(),])", re.ASCII)
_NAME = re.compile(r"([A-Za-z]+?)_?(\d*)('*)")
_GREEK = {
    "alpha": "α",
    "beta": "β",
    "gamma": "γ",
    "delta": "δ",
    "epsilon": "ε",
    "zeta": "ζ",
    "eta": "η",
    "theta": "θ",
    "iota": "ι",
    "kappa": "κ",
    "lambda": "λ",
    "mu": "μ",
    "nu": "ν",
    "xi": "ξ",
    "pi": "π",
    "rho": "ρ",
    "sigma": "σ",
    "tau": "τ",
    "phi": "φ",
    "chi": "χ",
    "psi": "ψ",
    "omega": "ω",
    "Gamma": "Γ",
    "Delta": "Δ",
    "Theta": "Θ",
    "Lambda": "Λ",
    "Xi": "Ξ",
    "Pi": "Π",
    "Sigma": "Σ",
    "Phi": "Φ",
    "Psi": "Ψ",
    "Omega": "Ω",
}
_FUNCTIONS = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}
_DEEPEST = 80
_TIMES, _SPACE = "<mo>&#x2062;</mo>", '<mspace width="0.17em"/>'


class NoFormulaError(ValueError):
    """Text that is no formula, such as a residual in words."""


def mathml(text: str) -> str:
    """A formula, or several joined by "=", as a `<math>` element; raises :class:`NoFormulaError` for other text."""
    sides = [_Writer(side).whole() for side in text.split("=")]
    return f"<math><mrow>{'<mo>=</mo>'.join(sides)}</mrow></math>"


def typeset(text: str) -> str:
    """The formula as MathML, or text that is none as code."""
    try:
        return mathml(text)
    except NoFormulaError:
        return f"<code>{escape(text)}</code>"


def name(text: str) -> str:
    """A name as MathML: Greek letters by their names, digits at the end and what follows _ below the line."""
    stem, _, below = text.partition("_")
    match = _NAME.fullmatch(stem)
    if match is None:
        return f"<mi>{escape(text)}</mi>"
    letters, digits, primes = match.groups()
    base = f"<mi>{_GREEK.get(letters, letters)}</mi>"
    if primes:
        base = f"<msup>{base}<mo>{'′' * len(primes)}</mo></msup>"
    parts = [f"<mn>{digits}</mn>"] * bool(digits)
    if below:
        parts.append(f"<mn>{below}</mn>" if below.isdigit() else name(below))
    return f"<msub>{base}<mrow>{'<mo>,</mo>'.join(parts)}</mrow></msub>" if parts else base


class _Writer:
    """Recursive descent over the grammar of :mod:`heavytop.claims.expression`; each method returns MathML."""

    def __init__(self, text: str) -> None:
        self._tokens = _tokens(text)
        self._place = 0
        self._depth = 0

    def whole(self) -> str:
        """All of the text."""
        found = self._sum()
        if self._next():
            raise NoFormulaError(self._next())
        return found

    def _next(self) -> str:
        return self._tokens[self._place] if self._place < len(self._tokens) else ""

    def _take(self, *expected: str) -> str:
        token = self._next()
        if token and token in expected:
            self._place += 1
            return token
        return ""

    def _require(self, token: str) -> None:
        if not self._take(token):
            raise NoFormulaError(f"{token} expected")

    def _sum(self) -> str:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise NoFormulaError("nested too deeply")
        found = self._term()
        while sign := self._take("+", "-"):
            found += ("<mo>+</mo>" if sign == "+" else "<mo>−</mo>") + self._term()
        self._depth -= 1
        return found

    def _term(self) -> str:
        """Factors beside each other; what is divided stands above the line, with all that stands before it."""
        signs = ""
        while sign := self._take("+", "-"):
            signs += "<mo>−</mo>" if sign == "-" else "<mo>+</mo>"
        done, factors = "", [self._power()]
        while operator := self._take("*", "/"):
            factor = self._signed_power()
            if operator == "*":
                factors.append(factor)
                continue
            above = [*([(done, False)] if done else []), *factors]
            over = above[0][0] if len(above) == 1 else _product(above)
            done, factors = f"<mfrac><mrow>{over}</mrow><mrow>{factor[0]}</mrow></mfrac>", []
        return signs + _product([*([(done, False)] if done else []), *factors])

    def _signed_power(self) -> tuple[str, bool]:
        if not self._take("-"):
            return self._power()
        inside, compound = self._signed_power()
        return f"<mo>−</mo>{_fenced(inside) if compound else inside}", True

    def _power(self) -> tuple[str, bool]:
        """(MathML, whether it is a sum in parentheses)."""
        base, compound = self._atom()
        if not self._take("^", "**"):
            return base, compound
        self._depth += 1
        if self._depth > _DEEPEST:
            raise NoFormulaError("nested too deeply")
        above, _ = self._signed_power()
        self._depth -= 1
        return f"<msup><mrow>{_fenced(base) if compound else base}</mrow><mrow>{above}</mrow></msup>", False

    def _atom(self) -> tuple[str, bool]:
        token = self._next()
        self._place += 1
        if token == "(":
            inside = self._sum()
            self._require(")")
            return inside, True
        if token[:1].isdigit() or token[:1] == ".":
            return _number(token), False
        if not token[:1].isalpha():
            raise NoFormulaError(token)
        return (self._function(token) if self._next() == "(" else name(token)), False

    def _function(self, token: str) -> str:
        self._require("(")
        arguments = [self._sum()]
        while self._take(","):
            arguments.append(self._sum())
        self._require(")")
        inside = "<mo>,</mo>".join(arguments)
        if token == "sqrt":
            return f"<msqrt>{inside}</msqrt>"
        return f"<mi>{_FUNCTIONS.get(token, token)}</mi><mo>&#x2061;</mo>{_fenced(inside)}"


def _tokens(text: str) -> list[str]:
    tokens, place, text = [], 0, text.rstrip()
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            raise NoFormulaError(text[place : place + 20])
        tokens.append(match[1])
        place = match.end()
    return tokens


def _number(token: str) -> str:
    mantissa, mark, power = token.lower().partition("e")
    if not mark:
        return f"<mn>{mantissa}</mn>"
    above = power.lstrip("+").replace("-", "−")
    return f"<mn>{mantissa}</mn><mo>·</mo><msup><mn>10</mn><mn>{above}</mn></msup>"


def _product(factors: list[tuple[str, bool]]) -> str:
    """The factors beside each other; sums in parentheses where there is more than one."""
    if len(factors) == 1:
        return _fenced(factors[0][0]) if factors[0][1] else factors[0][0]
    parts = [_fenced(text) if compound else text for text, compound in factors]
    found = parts[0]
    for part in parts[1:]:
        # 2 3 would be read as 23
        found += ("<mo>·</mo>" if part.startswith("<mn>") else _TIMES + _SPACE) + part
    return found


def _fenced(inside: str) -> str:
    return f"<mrow><mo>(</mo>{inside}<mo>)</mo></mrow>"
