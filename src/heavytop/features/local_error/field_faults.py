"""The wrong number of a field that explains the errors of single steps.

A fault of the right-hand side causes errors of order 0: h times the difference of the fields.  Candidates are the field
of the system with one factor s, which is 1 in the right field: at a term of the expanded Ω' or γ', at the terms of one
monomial of the state, at a component, at a parameter, or at all of it.  Both fields are followed over the step from
every state at which a call starts, in double, so that their difference is free of truncation; s is fitted to all calls
at once, and what it leaves must be a hundredth.  Of a method with fixed steps the calls over h, 2 h and 4 h are
combined so that its own error of order p, and the next, drops out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy

from heavytop.extras import has_extra, install
from heavytop.features.local_error.measurement import Call
from heavytop.integrate.trajectory import Problem
from heavytop.precision import Array, decimal_text, exact, plain_decimal, two_digits
from heavytop.records import Explained
from heavytop.report.document.document import short
from heavytop.top.equations import NAMES, Parameters, System

_DROP, _ALIKE = 100.0, 30.0
"""The error must fall by the first; of factors whose errors differ by less than the second the roundest is chosen."""
_ROUNDINGS = 1e4
"""Multiple of eps and the size of the state below which errors of a step are not examined."""
_RADIANS = 1 / 32
"""Radians that the body turns in a substep, whose relative error of order 4 is 1e-10."""
_ACTIVE = 1e-4
"""Part of the motion that a factor must change to be fitted."""
_SMALL = 1e-3
_REFINED = 4
_NEAR = 30.0
"""Multiple of the remaining error within which a fitted factor is rounded."""
_DIGITS = range(1, 12)
_NEAR_ONE = 1e-6
"""Factors closer to 1 are said by their difference from it."""
_LENGTHS = 1, 2, 4
"""Steps of the calls that are combined."""


@dataclass(frozen=True, slots=True)
class _Terms:
    """The expanded field of a system.

    values: of (numbers of the parameters, state), an array of (terms, motions).  components: whose derivative each term
    is a part of.  monomials: of the state, in each term.  texts: each in words.
    """

    values: Any
    components: tuple[int, ...]
    monomials: tuple[str, ...]
    texts: tuple[str, ...]


@lru_cache(maxsize=3)
def _terms(system: System) -> _Terms:
    import sympy

    parts = [sympy.symbols(" ".join(f"{letter}{i}" for i in (1, 2, 3))) for letter in "Ink"]
    p = Parameters(parts[0], parts[1], parts[2] if len(_rotors(system)) == 3 else sympy.Symbol("λ"))
    y = sympy.symbols(" ".join(NAMES))
    terms = [
        (index, term)
        for index, derivative in enumerate(system.field(p, y))
        for term in sympy.Add.make_args(sympy.expand(derivative))
    ]
    values = sympy.lambdify([[*p.numbers], [*y]], [term for _, term in terms], "numpy")
    texts = [str(term).replace("*", " ").removeprefix("-") for _, term in terms]
    monomials = [str(sympy.Mul(*(f for f in sympy.Mul.make_args(t) if f.free_symbols & {*y}))) for _, t in terms]
    return _Terms(values, tuple(index for index, _ in terms), tuple(monomials), tuple(texts))


def _rotors(system: System) -> tuple[int, ...]:
    return (0, 1, 2) if system.name == "heavy_gyrostat" else (0,)


@dataclass(frozen=True, slots=True)
class _Factor:
    """A factor of the field: at which terms, or at which numbers of the parameters; said in words."""

    text: str
    terms: tuple[int, ...] = ()
    numbers: tuple[int, ...] = ()


def _factors(system: System) -> Iterator[_Factor]:
    terms = _terms(system)
    every = range(len(terms.texts))
    letters = [*(f"I{i}" for i in (1, 2, 3)), *(f"r{i}" for i in (1, 2, 3))]
    yield from (_Factor(letter, numbers=(index,)) for index, letter in enumerate(letters))
    yield _Factor("the weight P", numbers=(3, 4, 5))
    yield from (_Factor(f"number {i + 1} of the rotor", numbers=(6 + i,)) for i in _rotors(system))
    for index, name in enumerate(NAMES):
        own = tuple(i for i in every if terms.components[i] == index)
        yield _Factor(f"{name}'", own)
        yield from (_Factor(f"the term {terms.texts[i]} of {name}'", (i,)) for i in own)
        groups = {m: tuple(i for i in own if terms.monomials[i] == m) for m in (terms.monomials[i] for i in own)}
        for monomial, group in groups.items():
            if len(group) > 1:
                yield _Factor(f"the term with {monomial.replace('*', ' ')} of {name}'", group)
    yield _Factor("Ω'", tuple(i for i in every if terms.components[i] < 3))
    yield _Factor("γ'", tuple(i for i in every if terms.components[i] >= 3))
    yield _Factor("the length of each step", tuple(every))


class _Steps:
    """Calls of an integrator: where they end, combined over their lengths, and where those of another field do."""

    def __init__(self, problem: Problem, calls: Sequence[Call], order: int) -> None:
        self.terms, p = _terms(problem.system), problem.parameters.mapped(float)
        self.numbers = numpy.array(p.numbers, dtype=float)
        self.starts = _floats([call.start for call in calls])
        self.length = float(calls[0].length)
        self.sums = numpy.eye(len(NAMES))[:, list(self.terms.components)]
        ends = {n: [call.end if n == 1 else call.further.get(n) for call in calls] for n in _LENGTHS}
        whole = all(end is not None for many in ends.values() for end in many) and order > 0
        self.weights = _weights(order) if whole else {1: 1.0}
        self.ends = sum((weight * _floats(ends[n]) for n, weight in self.weights.items()), numpy.zeros(()))
        size = numpy.abs(self.starts).max()
        rates = numpy.abs(self._field(self.numbers, numpy.ones(len(self.terms.texts)), self.starts)).max()
        self.rate = float(max(rates / size, size)) or 1.0
        self.moved = self.length * float(rates)
        self.noise = _ROUNDINGS * float(problem.precision.eps) * float(size)
        self.right = self.of(None, 1.0)

    def _field(self, numbers: Array, weights: Array, y: Array) -> Array:
        values = numpy.array(numpy.broadcast_arrays(*self.terms.values(numbers, y.T)))
        field: Array = (self.sums * weights @ values).T
        return field

    def of(self, factor: _Factor | None, s: float) -> Array:
        """The combined ends of motions of the field with that factor, by the classical Runge-Kutta method."""
        numbers, weights = self.numbers.copy(), numpy.ones(len(self.terms.texts))
        if factor is not None:
            numbers[list(factor.numbers)] *= s
            weights[list(factor.terms)] = s
        y, ends = self.starts, numpy.zeros_like(self.starts)
        count = max(1, math.ceil(self.length * self.rate / _RADIANS))
        h = self.length / count
        for n in range(1, max(self.weights) + 1):
            for _ in range(count):
                k1 = self._field(numbers, weights, y)
                k2 = self._field(numbers, weights, y + h / 2 * k1)
                k3 = self._field(numbers, weights, y + h / 2 * k2)
                k4 = self._field(numbers, weights, y + h * k3)
                y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            ends = ends + self.weights.get(n, 0.0) * y
        return ends

    def left(self, factor: _Factor, s: float) -> float:
        """The largest error that remains with that factor; infinite where a motion is not finite."""
        worst = float(numpy.abs(self.ends - self.of(factor, s)).max())
        return worst if worst == worst else math.inf

    def fitted(self, factor: _Factor, times: int) -> tuple[float, float]:
        """The factor by some Gauss-Newton iterations, and what it leaves: infinite where it moves next to nothing."""
        s = 1.0
        for _ in range(times):
            here = self.of(factor, s)
            slope = (self.of(factor, s + _SMALL) - here) / _SMALL
            square = float((slope * slope).sum())
            if not (square > 0 and numpy.abs(slope).max() > _ACTIVE * self.moved):
                return s, math.inf
            s += float((slope * (self.ends - here)).sum()) / square
        return s, self.left(factor, s)


def _weights(order: int) -> dict[int, float]:
    """Weights of the ends after h, 2 h and 4 h: 1 of what is linear in the length, 0 of its powers p + 1 and p + 2."""
    n = numpy.array(_LENGTHS, dtype=float)
    weights = numpy.linalg.solve(numpy.array([n, n ** (order + 1), n ** (order + 2)]), [1.0, 0.0, 0.0])
    return dict(zip(_LENGTHS, weights.tolist(), strict=True))


def _floats(states: Sequence[Any]) -> Array:
    return numpy.array([[float(exact(value)) for value in state[:6]] for state in states])


def field_fault(problem: Problem, calls: Sequence[Call], order: int) -> Explained | None:
    """The factor of the field that explains the errors of the calls, in a sentence; None where no single one does.

    order: that the integrator declares; 0 where it has none.
    """
    if not has_extra("claims"):
        return Explained("field", f"To look for a wrong term of the field: {install('claims')}.")
    with numpy.errstate(all="ignore"):
        steps = _Steps(problem, calls, order)
        error = float(numpy.abs(steps.ends - steps.right).max())
        if not error > steps.noise or not numpy.isfinite(error):
            return None
        likely = sorted(_factors(problem.system), key=lambda factor: steps.fitted(factor, 1)[1])[: 2 * len(NAMES)]
        fits = [(factor, *steps.fitted(factor, _REFINED)) for factor in likely]
        best = max(min(left for *_, left in fits), steps.noise / _ROUNDINGS)
        if best * _DROP > error:
            return None
        named_fits = [(factor, *_rounded(steps, factor, s, left)) for factor, s, left in fits if left <= _ALIKE * best]
    least = min(map(_plainness, named_fits))
    said = dict.fromkeys(_said(fit[0], fit[1]) for fit in named_fits if _plainness(fit) == least)
    fall = f"the largest error of a step falls from {short(f'{error:.1e}', 2)} to {short(f'{best:.1e}', 2)}"
    return Explained("field", f"Single steps fit another field: {', or '.join(said)}; {fall}.")


def _plainness(fit: tuple[_Factor, Fraction, float]) -> tuple[bool, int]:
    """Smaller of a simpler explanation: what is left out or negated before what is multiplied, few digits first."""
    return fit[1] not in (0, -1), len(plain_decimal(fit[1], 12))


def _rounded(steps: _Steps, factor: _Factor, s: float, left: float) -> tuple[Fraction, float]:
    """The roundest number that explains the calls about as well."""
    near = _NEAR * left / (steps.moved or 1.0)
    decimals = (Fraction(decimal_text(Fraction(s), digits)) for digits in _DIGITS)
    number = Fraction(0) if abs(s) <= near else next((d for d in decimals if abs(d - Fraction(s)) <= near), Fraction(s))
    rounded = steps.left(factor, float(number))
    return (number, rounded) if rounded <= _ALIKE * left else (Fraction(s), left)


def _said(factor: _Factor, number: Fraction) -> str:
    if number == 0:
        return f"{factor.text} is left out"
    if number == -1:
        return f"{factor.text} has the opposite sign"
    near = abs(number - 1) < _NEAR_ONE
    times = f"1 {'+' if number > 1 else '-'} {two_digits(abs(number - 1))}" if near else plain_decimal(number, 8)
    return f"{factor.text} is {times} times what it should be"
