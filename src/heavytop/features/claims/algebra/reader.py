"""A parser of untrusted formulas: from text to SymPy expressions, without evaluation of code.

    expression := term (("+" | "-") term)*          term  := factor (("*" | "/") factor)*
    factor     := ("+" | "-") factor | power        power := atom (("^" | "**") factor)?
    atom       := number | name | function "(" expression ("," expression)* ")" | "(" expression ")"

Length, depth, number of nodes, size of numbers, degree and number of terms when expanded are bounded before an
expression is built, so that no formula takes much time or memory.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from math import comb
from typing import Any, NamedTuple, TypeVar

import sympy
from flint import arb, fmpq

from heavytop.errors import InputError, nearest, quoted
from heavytop.features.claims.algebra import elliptic
from heavytop.features.claims.algebra.conditions import ConditionKind, Need, condition
from heavytop.features.claims.algebra.elliptic import FORMULAS
from heavytop.features.claims.algebra.ring import as_fraction
from heavytop.features.claims.algebra.statement import TIME, Setting
from heavytop.features.claims.algebra.structure import Defined
from heavytop.precision import exact

_OF_ONE = ("sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "sech", "asin", "acos", "atan")
FUNCTIONS: dict[str, tuple[Any, int]] = {
    **{name: (getattr(sympy, name), 1) for name in _OF_ONE},
    "atan2": (sympy.atan2, 2),
    **{name: (getattr(elliptic, name), 2) for name in elliptic.JACOBI},
    **FORMULAS,
}
_SYNONYMS = {"ln": "log", **{f"arc{name}": f"a{name}" for name in ("sin", "cos", "tan", "tan2")}}
_SHORT = {
    "abs": "sqrt(x^2)",
    "cot": "cos(x)/sin(x)",
    "sec": "1/cos(x)",
    "csc": "1/sin(x)",
    "coth": "cosh(x)/sinh(x)",
    "csch": "1/sinh(x)",
    **dict.fromkeys(("asinh", "arsinh", "arcsinh"), "log(x + sqrt(x^2 + 1))"),
    **dict.fromkeys(("acosh", "arcosh", "arccosh"), "log(x + sqrt(x^2 - 1))"),
    **dict.fromkeys(("atanh", "artanh", "arctanh"), "log((1 + x)/(1 - x))/2"),
}
"""Functions of x by their formulas.  A parameter may have the name of one, or of a synonym."""
_ASCII = str.maketrans(dict(zip("−·⋅×≥≤≠₀₁₂₃₄₅₆₇₈₉", ("-", *"***", ">=", "<=", "!=", *"0123456789"), strict=True)))
_CONSTANT = ("top.inertia", "top.centre", "top.weight", "relations", "assume")
"""The formulas that hold neither t nor the state."""
_VARIABLE = re.compile(r"t|(?:Omega|gamma)[1-3]")
_NOTATIONS = (
    (r"^([^=]*[^<>!=\s])\s*==?\s*0$", r"\1"),
    (r"^([^=]*[^<>!=\s])\s*==?\s*([\w./]+)$", r"\1 - \2"),
    (r"^([^=]*[^<>!=\s])\s*==?\s*([^=]+)$", r"\1 - (\2)"),
    (r"\bsign(\([^()]*\))", r"\1/abs\1"),
    (r"\bcbrt(\([^()]*\))", r"exp(log\1/3)"),
    (r"\b(\w+)\^\(1/3\)", r"exp(log(\1)/3)"),
    (r"\b[LM]_?([1-3])\b", r"(I\1*Omega\1)"),
    (r"\|([^|]*)\|", r"abs(\1)"),
    (r"\b([a-z]+)(?:\^|\*\*)\(?(\d)\)?\(([^()]*)\)", r"\1(\3)^\2"),
    (r"\be\^(?=\()", "exp"),
    (r"\be\^(\w+)", r"exp(\1)"),
    (r"(?<![A-Za-z_])((?:Omega|gamma|I)[1-3])\s*(?=\()", r"\1*"),
    (r"\b[wW](?=[1-3]\b)|\bomega_?(?=[1-3]\b)", "Omega"),
    (r"\b([A-Za-z]+)(?:\[|_\{?)(\d)[]}]?", r"\1\2"),
    (r"(?<![\w.])(\d+(?:\.\d+)?)\s*(?=[A-Za-z(])|(?<=\))()\s*(?=[\w(])", r"\1*"),
)
"""Usual notations, and what a file has in their place."""
_LONGEST_HINT = 200
_MAX_LENGTH = 10_000
_MAX_NODES = 2_000
_MAX_BITS = 4_096
_MAX_EXPONENT = 64
_MAX_DEGREE = 1_024
_MAX_TERMS = 10**15
NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"


class ExpressionBounds(NamedTuple):
    """Bounds on the size of an expression: nodes, bits of its numbers, degree, terms when expanded."""

    nodes: int
    bits: int
    degree: int
    terms: int


@dataclass(frozen=True, slots=True)
class Formula:
    """A parsed formula with bounds on its size, and its needs to be defined and real as it is written."""

    expression: sympy.Expr
    size: ExpressionBounds
    needs: frozenset[Need] = frozenset()


def symbol(expression: sympy.Expr) -> Formula:
    """The formula of a name."""
    return Formula(expression, ExpressionBounds(1, 0, 1, 1))


class TooLarge(InputError):
    """A formula beyond the bounds on its size."""


def parse(text: str, names: Mapping[str, Formula], where: str) -> Formula:
    """The formula of ``text`` in ``names``; where: its name in error texts.

    Definitions are substituted; where the formula becomes too large, they stay symbols with a meaning.
    Raises InputError for a text outside the grammar above, and beyond the bounds on its size.
    """
    try:
        return _parse(text, names, where)
    except TooLarge:
        symbols = {
            name: _defined(name, formula) if formula.size.nodes > 1 else formula for name, formula in names.items()
        }
        return _parse(text, symbols, where)
    except InputError as error:
        raise InputError(error.cause, _meant(text, names) + error.remedy) from None


def _meant(text: str, names: Mapping[str, Formula]) -> str:
    """``Did you mean FORMULA? `` where another notation gives a formula in these names; else ""."""
    meant = text[:_LONGEST_HINT]
    for notation, formula in _NOTATIONS:
        meant = re.sub(notation, formula, meant)
    known = [*names, *FUNCTIONS, *_SYNONYMS, *_SHORT]
    meant = re.sub(
        r"[A-Za-z]\w*", lambda word: word[0] if word[0] in known else nearest(word[0], known) or word[0], meant
    )
    try:
        _parse(meant, names, "")
    except InputError:
        return ""
    return f"Did you mean {meant}? " if meant != text else ""


def plain(text: str) -> str:
    """A text with ASCII characters for Greek letters, subscripts, exponents and signs: Omega3^(2) for Ω₃².

    A letter beside another one stays, as a product would become one name; so does the root of a power or function.
    """
    if text.isascii():
        return text
    text = re.sub("[⁰¹²³⁴-⁹⁻]+", lambda power: f"^({unicodedata.normalize('NFKC', power[0])})", text)
    text = re.sub(r"√\s*(\d+(?:\.\d+)?|[^\W\d]\w*)(?!\s*(?:[\w.^([]|\*\*))", r"sqrt(\1)", text.translate(_ASCII))
    return re.sub(r"(?<![^\W\d_])[^\W\d_](?![^\W\d_])", _ascii, re.sub(r"√\s*(?=\()", "sqrt", text))


def _ascii(match: re.Match[str]) -> str:
    character = match[0]
    if not unicodedata.decomposition(character).startswith("<su"):  # an exponent or a subscript
        character = unicodedata.normalize("NFKC", character)
    greek = re.fullmatch(r"GREEK (SMALL|CAPITAL) LETTER (\w+)", unicodedata.name(character[0], ""))
    if greek is None:
        return character
    name = str(greek[2]).lower().replace("lamda", "lambda")
    return name if greek[1] == "SMALL" else name.capitalize()


@lru_cache(maxsize=1_000)
def _defined(name: str, formula: Formula) -> Formula:
    """A definition as a symbol, the same one for the same formula."""
    return replace(symbol(Defined(name, formula.expression)), needs=formula.needs)


def _parse(text: str, names: Mapping[str, Formula], where: str) -> Formula:
    if len(text) > _MAX_LENGTH:
        raise InputError(f"{where}: {len(text)} characters.", f"Use at most {_MAX_LENGTH} characters.")
    parser = _Parser(text, names, where)
    result = parser.sum()
    parser.end()
    return result


Part = TypeVar("Part")


class Descent:
    """The base of recursive-descent parsers: the tokens of a text, and the depth of nesting.

    token: the pattern of a token with white space before it.  deepest: the limit of nested parentheses and powers.
    """

    token = re.compile(rf"\s*(?:{NUMBER}|[A-Za-z]\w*|\*\*|[-+*/^(),])", re.ASCII)
    deepest = 60

    def __init__(self, text: str) -> None:
        self._tokens: list[str] = []
        self._position = self._depth = 0
        position, text = 0, text.rstrip()
        while position < len(text):
            match = self.token.match(text, position)
            if match is None:
                raise self._no_token(text[position : position + 20])
            self._tokens.append(match[0].strip())
            position = match.end()

    def _next(self) -> str:
        return self._tokens[self._position] if self._position < len(self._tokens) else ""

    def _take(self, *expected: str) -> str:
        token = self._next()
        if token and token in expected:
            self._position += 1
            return token
        return ""

    def _require(self, token: str) -> None:
        if not self._take(token):
            following = self._next()[:20]
            raise self._error(f"{token!r} expected {f'before {following!r}' if following else 'at the end'}")

    @contextmanager
    def _deeper(self, what: str) -> Iterator[None]:
        self._depth += 1
        if self._depth > self.deepest:
            raise self._error(f"{what} nested deeper than {self.deepest}")
        yield
        self._depth -= 1

    def _arguments(self, parse_argument: Callable[[], Part]) -> list[Part]:
        """The arguments in parentheses, separated by commas."""
        self._require("(")
        arguments = [parse_argument()]
        while self._take(","):
            arguments.append(parse_argument())
        self._require(")")
        return arguments

    def end(self) -> None:
        """Raises an error for remaining tokens."""
        if self._next():
            raise self._error(f"unexpected {self._next()[:20]!r}")

    def _no_token(self, text: str) -> Exception:
        return self._error(f"{text.strip()!r} is not part of a formula")

    def _error(self, what: str) -> Exception:
        raise NotImplementedError


class _Parser(Descent):
    """The parser of :func:`parse`."""

    def __init__(self, text: str, names: Mapping[str, Formula], where: str) -> None:
        self._names = names
        self._where = f"{where} = {quoted(text)}"
        super().__init__(text)

    def _no_token(self, text: str) -> InputError:
        return InputError(
            f"{self._where}: {text.strip()!r} is not part of a formula.",
            "Use numbers, names, + - * / ^ ( ) and the functions " + ", ".join(FUNCTIONS) + ".",
        )

    def _error(self, what: str) -> InputError:
        return InputError(f"{self._where}: {what}.", "`heavytop docs claims-in-toml` lists what a formula may contain.")

    def sum(self) -> Formula:
        """Parses a sum."""
        with self._deeper("parentheses"):
            total = self._term()
            while sign := self._take("+", "-"):
                part = self._term()
                total = self._checked(
                    total.expression + part.expression if sign == "+" else total.expression - part.expression,
                    _added(total.size, part.size),
                    total.needs | part.needs,
                )
        return total

    def _term(self) -> Formula:
        total = self._factor()
        while operator := self._take("*", "/"):
            part = self._factor()
            if operator == "/":
                if part.expression == 0:
                    raise self._error("a division by 0")
                needs = part.needs | condition("/", (part.expression,))
                part = Formula(1 / part.expression, part.size, needs)
            a, b = total.size, part.size
            size = ExpressionBounds(a.nodes + b.nodes + 1, a.bits + b.bits, a.degree + b.degree, a.terms * b.terms)
            self._check(size)
            total = Formula(total.expression * part.expression, size, total.needs | part.needs)
        return total

    def _factor(self) -> Formula:
        negative = False
        while sign := self._take("+", "-"):
            negative ^= sign == "-"
        value = self._power()
        return Formula(-value.expression, value.size, value.needs) if negative else value

    def _power(self) -> Formula:
        base = self._atom()
        if not self._take("^", "**"):
            return base
        with self._deeper("powers"):
            power = self._factor()
        exponent, needs = power.expression, base.needs | power.needs
        is_number = base.expression.is_Rational and exponent.is_Integer and base.size.bits * abs(exponent) <= _MAX_BITS
        if not is_number and (not exponent.is_Rational or exponent.q > 2 or abs(exponent.p) > _MAX_EXPONENT):
            rule = f"an integer or half-integer up to {_MAX_EXPONENT}"
            raise self._error(f"the exponent must be {rule}; where x > 0, x^y is exp(y*log(x))")
        if base.expression == 0 and exponent < 0:
            raise self._error("a division by 0")
        factors = (abs(int(exponent.p)) + 1) // int(exponent.q) or 1
        n = base.size
        size = ExpressionBounds(
            n.nodes + 1, n.bits * factors, n.degree * factors, comb(min(n.terms, _MAX_TERMS) + factors - 1, factors)
        )
        self._check(size)
        if exponent.q == 2:
            needs |= condition("sqrt", (base.expression,))
        if exponent < 0:
            needs |= condition("/", (base.expression,))
        return self._checked(base.expression**exponent, size, needs)

    def _atom(self) -> Formula:
        token = self._next()
        self._position += 1
        if token == "(":
            inside = self.sum()
            self._require(")")
            return inside
        if token[:1].isdigit() or token[:1] == ".":
            return self._number(token)
        if token[:1].isalpha():
            is_function = token in FUNCTIONS or token in _SYNONYMS or token in _SHORT
            is_call = is_function and (token not in self._names or self._next() == "(")
            return self._function(token) if is_call else self._name(token)
        raise self._error(f"a number, a name or '(' expected{f', not {token[:20]!r}' if token else ' at its end'}")

    def _number(self, token: str) -> Formula:
        exponent = re.search(r"[eE]([+-]?\d+)$", token)
        if exponent and (len(exponent[1]) > 6 or abs(int(exponent[1])) > _MAX_BITS // 4):
            raise self._error(f"the number {token[:20]!r} is too large or too small")
        value = exact(token)
        bits = value.numerator.bit_length() + value.denominator.bit_length()
        return self._checked(sympy.Rational(value), ExpressionBounds(1, bits, 0, 1))

    def _name(self, token: str) -> Formula:
        if token not in self._names:
            is_constant = self._where.startswith(_CONSTANT)
            known = ", ".join(sorted(n for n in self._names if not (is_constant and _VARIABLE.fullmatch(n))))
            remedy = f"Known here: {known[:400]}; functions: {', '.join(FUNCTIONS)}."
            raise InputError(f"{self._where}: unknown name {token[:40]!r}.", remedy)
        return self._names[token]

    def _function(self, token: str) -> Formula:
        token = _SYNONYMS.get(token, token)
        function, count = FUNCTIONS.get(token, (None, 1))
        arguments = self._arguments(self.sum)
        if len(arguments) != count:
            raise self._error(f"{token} takes {count} argument{'s' if count > 1 else ''}, not {len(arguments)}")
        if token in _SHORT:
            return _parse(_SHORT[token], {"x": arguments[0]}, self._where)
        size = arguments[0].size
        for argument in arguments[1:]:
            size = _added(size, argument.size)
        size = size._replace(nodes=size.nodes + 1)
        inside = tuple(argument.expression for argument in arguments)
        needs = condition(token, inside)
        for need in needs:
            if not need.expression.free_symbols and need.is_met({}) is False:
                raise self._error(f"{token} needs {need.text}, which is false")
        needs = needs.union(*(argument.needs for argument in arguments))
        return self._checked(function(*inside), size, needs)

    def _checked(self, expression: sympy.Expr, size: ExpressionBounds, needs: frozenset[Need] = frozenset()) -> Formula:
        self._check(size)
        if expression.has(sympy.zoo, sympy.oo, -sympy.oo, sympy.nan, sympy.I):
            raise self._error(f"a formula must be real; got {expression}")
        return Formula(expression, size, needs)

    def _check(self, size: ExpressionBounds) -> None:
        limits = ExpressionBounds(_MAX_NODES, _MAX_BITS, _MAX_DEGREE, _MAX_TERMS)
        for what, value, limit in zip(ExpressionBounds._fields, size, limits, strict=True):
            if value > limit:
                raise TooLarge(f"{self._where}: the formula grows beyond {limit} {what}.", "Use [definitions].")


def _added(a: ExpressionBounds, b: ExpressionBounds) -> ExpressionBounds:
    return ExpressionBounds(a.nodes + b.nodes + 1, max(a.bits, b.bits) + 1, max(a.degree, b.degree), a.terms + b.terms)


# The assumptions of a file on its parameters: ``assume = ["alpha > 0", "I1 > I3", "k < 1", "g != 0"]``.


Bound = tuple[sympy.Expr, sympy.Expr]
Comparison = tuple[sympy.Expr, sympy.Expr, ConditionKind]
"""left, right, and the condition on left − right."""
SIGNS = {">": ConditionKind.POSITIVE, ">=": ConditionKind.NONNEGATIVE, "!=": ConditionKind.NONZERO}
_COMPARISON = (
    "Write: formula < formula, formula > formula, or a chain such as 0 < k < 1{}; each comparison is a text of its own."
)
_OR = {"assume": ", with <= and >= too, or formula != formula; an equation left = right is left - right in relations"}


def comparisons(text: str, where: str) -> list[tuple[str, str, ConditionKind]]:
    """(larger, smaller, kind) of ``formula > formula``, and of each link of a chain such as ``0 < k <= 1``.

    Raises InputError for any other text.
    """
    parts = [part.strip() for part in re.split(r"([<>]=?)", text)]
    sides, signs = parts[::2], parts[1::2]
    if len({sign[0] for sign in signs}) != 1 or re.search(r"\band\b", text) or not all(sides) or "=" in "".join(sides):
        raise InputError(f"{where}: {text[:60]!r} cannot be parsed.", _COMPARISON.format(_OR.get(where, "")))
    pairs = [pair if signs[0][0] == ">" else pair[::-1] for pair in pairwise(sides)]
    return [(*pair, SIGNS[sign.replace("<", ">")]) for pair, sign in zip(pairs, signs, strict=True)]


def assumptions(texts: Iterable[str]) -> Iterator[tuple[str, str, ConditionKind]]:
    """(left, right, kind) of the comparisons of ``assume``; raises InputError for any other text."""
    for text in texts:
        left, sign, right = (part.strip() for part in text.partition("!="))
        if not sign:
            yield from comparisons(text, "assume")
        elif left and right and not set("<>=!") & {*left, *right}:
            yield left, right, SIGNS[sign]
        else:
            raise InputError(f"assume: {text[:60]!r} cannot be parsed.", "Write: formula != formula.")


def assume(
    compared: Iterable[Comparison],
    needs: Iterable[Need],
    moments: Iterable[sympy.Expr],
    symbols: Iterable[sympy.Symbol],
) -> Setting:
    """The setting of comparisons, of the needs of their formulas, and of positive moments."""
    sides: dict[ConditionKind, list[Bound]] = {kind: [] for kind in ConditionKind}
    for left, right, kind in compared:
        sides[kind].append((left, right))
    strict, weak = sides[ConditionKind.POSITIVE], sides[ConditionKind.NONNEGATIVE]
    for pairs in (strict, weak):
        pairs += [implied for pair in pairs for implied in _through_monotone(pair)]
    symbols = list(symbols)
    positive = tuple(symbol for symbol in symbols if symbol.is_positive)
    greater: list[tuple[sympy.Symbol, sympy.Expr]] = []
    facts: list[sympy.Expr] = []
    below: dict[sympy.Symbol, set[sympy.Symbol]] = {}
    for left, right in strict:
        if left in positive and right == 0:
            continue
        # one lower bound becomes a form of the symbol; no form may depend on itself
        reached = set(right.free_symbols).union(*(below.get(symbol, set()) for symbol in right.free_symbols))
        if left in symbols and left not in below and left not in reached:
            greater.append((left, right))
            below[left] = reached
            for symbols_below in below.values():
                if left in symbols_below:
                    symbols_below |= reached
        else:
            facts.append(left - right)
    facts += [moment for moment in moments if not moment.is_positive]
    needed: dict[ConditionKind, list[sympy.Expr]] = {kind: [] for kind in ConditionKind}
    for need in sorted(needs, key=lambda need: need.text):
        needed[need.kind].append(need.expression)
    facts += [*needed[ConditionKind.POSITIVE], *(e**2 for e in needed[ConditionKind.NONZERO])]
    facts += [(left - right) ** 2 for left, right in sides[ConditionKind.NONZERO]]
    nonnegative = (*needed[ConditionKind.NONNEGATIVE], *(left - right for left, right in weak))
    ranges = tuple(_ranges([*strict, *weak]))
    return Setting(TIME, positive, tuple(greater), facts=tuple(facts), ranges=ranges, weak=nonnegative)


_MONOTONE: dict[Any, tuple[int, Callable[[arb], arb], Callable[[arb], bool]]] = {
    sympy.exp: (1, arb.log, lambda c: c > 0),
    sympy.log: (1, arb.exp, lambda c: True),
    sympy.sinh: (1, arb.asinh, lambda c: True),
    sympy.tanh: (1, arb.atanh, lambda c: abs(c) < 1),
    sympy.atan: (1, arb.tan, lambda c: abs(c) < arb.pi() / 2),
    sympy.asin: (1, arb.sin, lambda c: abs(c) < arb.pi() / 2),
    sympy.acos: (-1, arb.cos, lambda c: c > 0 and c < arb.pi()),
    sympy.sqrt: (1, lambda c: c * c, lambda c: c >= 0),
}
"""Functions strictly monotone where they are real: 1 or −1, the inverse, and whether a number is a value."""


def _through_monotone(bound: Bound) -> Iterator[Bound]:
    """Consequences of left > right for arguments of monotone functions: the same on both sides, or one and a fraction.

    The inverse of a fraction is rounded outwards to a fraction.
    """
    (left, left_argument), (right, right_argument) = map(_monotone_argument, bound)
    if left is None and right is None:
        return
    if left is right:
        implied = (left_argument, right_argument)
        sign = _MONOTONE[left][0]
    else:
        argument, number = (left_argument, bound[1]) if right is None else (right_argument, bound[0])
        if not number.is_Rational:
            return
        sign, inverse, is_value = _MONOTONE[left if right is None else right]
        value = arb(fmpq(int(number.p), int(number.q)))
        if not is_value(value):
            return
        enclosure = inverse(value)
        is_lower = (right is None) == (sign > 0)  # whether the inverse is a lower bound of the argument
        end = sympy.Rational(as_fraction((enclosure.lower() if is_lower else enclosure.upper()).fmpq()))
        implied = (argument, end) if right is None else (end, argument)
    implied = implied if sign > 0 else implied[::-1]
    yield implied
    yield from _through_monotone(implied)


def _monotone_argument(e: sympy.Expr) -> tuple[Any, sympy.Expr]:
    """A monotone function and its argument; None and the expression of any other."""
    if e.is_Pow and e.exp == sympy.Rational(1, 2):
        return sympy.sqrt, e.base
    return (e.func, e.args[0]) if e.func in _MONOTONE and len(e.args) == 1 else (None, e)


def _ranges(bounds: Sequence[Bound]) -> Iterable[tuple[sympy.Symbol, tuple[Fraction, Fraction]]]:
    """Symbols between two fractions."""
    lower = {left: right for left, right in bounds if left.is_Symbol and right.is_Rational}
    upper = {right: left for left, right in bounds if right.is_Symbol and left.is_Rational}
    for symbol in lower.keys() & upper.keys():
        yield symbol, (Fraction(lower[symbol]), Fraction(upper[symbol]))
