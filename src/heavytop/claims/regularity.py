"""Is a quotient of a field real and continuous, or analytic, all over the domain: by the rules of composition."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from heavytop.claims.algebra import Field
from heavytop.claims.rational import Quotient
from heavytop.claims.sign import Unprovable, used

_SHOWN = 100


class Regularity:
    """Continuity over ``field``.  is_nonzero: whether a polynomial is known to be 0 nowhere on the domain."""

    def __init__(self, field: Field, is_nonzero: Callable[[Any], bool] | None = None) -> None:
        self._field = field
        self._is_nonzero = is_nonzero or (lambda p: field.tower.signs.of(p).strict)
        self._known: dict[tuple[int, bool], str] = {}

    def obstacle(self, value: Quotient, *, analytic: bool = False) -> str:
        """What stands against it being real and continuous (analytic) all over the domain; "" where nothing does."""
        _, factors = self._field.tower.signs.factors(value.denominator)
        for factor, _ in factors:
            if not self._is_nonzero(factor):
                return f"{self._text(factor)} may be 0"
        return self.obstacle_of_generators(used(value.numerator) | used(value.denominator), analytic=analytic)

    def obstacle_of_generators(self, indices: set[int], *, analytic: bool) -> str:
        """The same of generators."""
        for index in sorted(indices):
            if (index, analytic) not in self._known:
                self._known[index, analytic] = self._obstacle_of(index, analytic)
            if self._known[index, analytic]:
                return self._known[index, analytic]
        return ""

    def _obstacle_of(self, index: int, analytic: bool) -> str:
        tower = self._field.tower
        g = tower.generators[index]
        if index in tower.signs.numbers:
            return "" if tower.signs.numbers[index].is_finite() else f"{g.meaning} is no real number"
        for argument in g.arguments:
            if found := self.obstacle(argument, analytic=analytic):
                return found
        if g.kind == "defined":
            return f"the definition of {g.meaning} is too large for the algebra"
        if g.kind in ("wp", "wpinverse"):
            return f"{g.meaning} has poles"
        wanted = "> 0" if analytic else "≥ 0"
        if g.kind == "root":
            return self._unless_positive(g.arguments[0], analytic, wanted)
        if g.kind == "log":
            return self._unless_positive(g.arguments[0], True, "> 0")
        if g.kind in ("asin", "acos"):
            square = tower.product((tower.number(-1), g.arguments[0], g.arguments[0]))
            return self._unless_positive(tower.sum((tower.number(1), square)), analytic, wanted)
        if g.kind == "atan2":
            y, x = g.arguments
            right = tower.sign(x)
            off_the_cut = (right.value > 0 and right.strict) or self._is_nonzero(y.numerator)
            return "" if off_the_cut else f"{g.meaning} may jump"
        return ""

    def _unless_positive(self, value: Quotient, strict: bool, wanted: str) -> str:
        sign = self._field.tower.sign(value)
        if sign.value > 0 and (sign.strict or not strict):
            return ""
        return f"{self._text(value.numerator, value.denominator)} {wanted} is not shown"

    def _text(self, numerator: Any, denominator: Any = None) -> str:
        try:
            below = self._field.tower.one if denominator is None else denominator
            text = str(self._field.expression(Quotient(numerator, below)))
        except Unprovable:
            text = "an intermediate value"
        return text if len(text) <= _SHOWN else text[: _SHOWN - 1] + "…"
