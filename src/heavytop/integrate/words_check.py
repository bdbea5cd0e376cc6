"""Machine code in many words takes one step that is known before it takes any other."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import factorial

from heavytop.errors import Contradiction
from heavytop.integrate.selfcheck import GAMMA, OMEGA, XI, derivatives, known_parameters
from heavytop.top.equations import System
from heavytop.words.run import Status, Steps
from heavytop.words.scaled import Scaled

_MOST_ORDERS = 100
_GUARD_BITS = 8
_LATER = Fraction(7, 11)


def check(system: System, attitude: bool, begin: Callable[[Scaled], Steps], bits: int, bounded: bool = False) -> None:
    """One step against the exact series of a known motion: coefficients, the new state, and a sample inside the step.

    begin: a run of a problem at its start.  bits: of its arithmetic.  bounded: the units it wants.
    Raises Contradiction.
    """
    given = known_parameters(system).mapped(Fraction)
    start = tuple(map(Fraction, (*OMEGA, *GAMMA, *(XI if attitude else ()))))
    scaled = Scaled.of(system, given, start, bounded)
    run = begin(scaled)
    _require(run.advance(Fraction(1, 2**40), 1) is Status.FINE, "the outcome of a step", bits)
    exact = list(derivatives(system, attitude, min(run.order, _MOST_ORDERS) + 1, given))
    step, largest = run.time / scaled.rate, max(map(abs, scaled.state))
    terms = [
        [Fraction(value) * step**n / (factorial(n) * size) for value, size in zip(row, scaled.sizes, strict=True)]
        for n, row in enumerate(exact)
    ]
    for n, row in enumerate(terms):
        off = max(abs(a - b) for a, b in zip(run.coefficients(n), row, strict=True))
        _require(off <= largest * Fraction(2) ** (_GUARD_BITS - bits), f"Taylor coefficient {n}", bits)
    tail = 4 * max(map(abs, terms[-1])) + largest * Fraction(2) ** (_GUARD_BITS - bits)
    later = run.time * _LATER
    for found, part, what in (
        (run.state, Fraction(1), "the new state"),
        (run.sample(later), _LATER, "a state inside the step"),
    ):
        sums = [sum(row[i] * part**n for n, row in enumerate(terms)) for i in range(len(start))]
        fine = found is not None and max(abs(a - b) for a, b in zip(found, sums, strict=True)) <= tail
        _require(fine, what, bits)


def _require(fine: bool, what: str, bits: int) -> None:
    if not fine:
        raise Contradiction(
            f"Machine code in {bits} bits gives a wrong value in a step that is known: {what}.",
            "It is damaged: run again; if it stays, this machine or LLVM is faulty.",
        )
