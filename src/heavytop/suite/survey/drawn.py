"""A chunk of a sweep as arrays: the tops and starts that the sweep's cases have, rounded to the format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy

from heavytop.integrate.pair_arrays import Pairs
from heavytop.integrate.trajectory import Problem
from heavytop.measure.rounding_noise import factor, scaled
from heavytop.precision import DOUBLE, Precision
from heavytop.suite.cases import Case
from heavytop.suite.sweeps import Lazy, Random, Sweep
from heavytop.top.equations import HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.integrals import Integral, holding

CHUNK = 4096
"""Motions in a chunk, a row group of the file."""
GENERAL = "general"
_CLASSES = {
    "momentum_squared": "euler",
    "moment_along_centre": "spherical",
    "spin": "lagrange",
    "kovalevskaya": "kovalevskaya",
    "goryachev_chaplygin": "goryachev-chaplygin",
    "hess": "hess",
}


@dataclass(frozen=True, slots=True)
class Chunk(Case):
    """Motions ``first`` to before ``first + count`` of a sweep, as a case; its own top and start are those of the
    first.
    """

    sweep: Sweep | None = None
    first: int = 0
    count: int = 0


def chunks(sweep: Sweep, cases: Sequence[Case], index: int) -> Chunk:
    """The chunk of that index."""
    first = index * CHUNK
    case = cases[first]
    own = {name: getattr(case, name) for name in Case.__dataclass_fields__}
    return Chunk(**own, sweep=sweep, first=first, count=min(CHUNK, len(cases) - first))


def number_of(cases: Sequence[Case]) -> int:
    """How many chunks a sweep has."""
    return -(-len(cases) // CHUNK)


@dataclass(frozen=True, slots=True)
class Drawn:
    """Rounded motions: exactly what an integrator of the format is given.

    numbers: what enters the field, and the start, (motions, k + 6).
    """

    problems: Sequence[Problem]
    integrals: list[tuple[Integral, ...]]
    numbers: Pairs

    @property
    def system(self) -> System:
        """The same of all."""
        return self.problems[0].system

    @property
    def parameters(self) -> Parameters:
        """Each a column, (motions, 1)."""
        columns = [self.numbers[:, k : k + 1] for k in range(self.numbers.high.shape[1] - 6)]
        found = self.system.taken_in(columns)
        nothing = Pairs.of(numpy.zeros((len(self.problems), 1)))
        moment = found.moment or (nothing,) * 3
        return found._replace(moment=moment, rotor=nothing if found.rotor is None else found.rotor)

    @property
    def start(self) -> list[Pairs]:
        """The six components, (motions, 1) each."""
        width = self.numbers.high.shape[1]
        return [self.numbers[:, k : k + 1] for k in range(width - 6, width)]

    @property
    def classes(self) -> list[str]:
        """Of each motion, by the further integrals that it has."""
        return [_class(each) for each in self.integrals]


def drawn(chunk: Chunk, precision: Precision, seed: int = 0) -> Drawn:
    """The motions of a chunk, bit for bit those of the sweep's cases; seed: of other roundings."""
    assert chunk.sweep is not None
    cases = chunk.sweep.cases()
    places = range(chunk.first, chunk.first + chunk.count)
    if isinstance(chunk.sweep, Random) and precision == DOUBLE and not seed:
        numbers = _rounded(numpy.array([chunk.sweep.integers(index) for index in places]))
        further = _may_have_more(numbers)
        integrals = [_integrals(cases[index]) if more else _ALWAYS for index, more in zip(places, further, strict=True)]
        return Drawn(
            Lazy(chunk.count, lambda place: _problem(numbers[place])),
            integrals,
            Pairs.of(numbers),
        )
    given = [cases[index] for index in places]
    if seed:
        given = [replace(case, top=scaled(case.top, factor(seed))) for case in given]
    problems = [Problem.of(case.top, case.start, precision, case.system) for case in given]
    return Drawn(problems, [_integrals(case) for case in given], _pairs(problems))


def _pairs(problems: Sequence[Problem]) -> Pairs:
    """Their numbers, which two doubles hold: of formats of 106 bits at most."""
    rows = [[*each.system.entering(each.parameters), *each.start.flat] for each in problems]
    high = numpy.array(rows, float)
    low = [
        [float(v - Fraction(h)) for v, h in zip(*pair, strict=True)] for pair in zip(rows, high.tolist(), strict=True)
    ]
    return Pairs(high, numpy.array(low))


def _integrals(case: Case) -> tuple[Integral, ...]:
    return holding(case.top, case.start, case.system)


def _rounded(numbers: Any) -> Any:
    """I, n and the start, (motions, 12), of the integers of :meth:`Random.integers`.

    All of them are below 2^53, so that each quotient is the exact number rounded once.
    """
    thousandths, weight, centre = numbers[:, :3] / 1000.0, numbers[:, 3:4], numbers[:, 4:7]
    moment = (weight * centre) / 1e6
    return numpy.hstack([thousandths, moment, numbers[:, 7:10] / 1000.0, numbers[:, 10:13] / numbers[:, 13:14]])


def _problem(numbers: Any) -> Problem:
    i1, i2, i3, n1, n2, n3, w1, w2, w3, g1, g2, g3 = map(Fraction, numbers.tolist())
    given = Parameters((i1, i2, i3), (n1, n2, n3), 0)
    return Problem(HEAVY_TOP, DOUBLE, given, State((w1, w2, w3), (g1, g2, g3)), None)


def _may_have_more(p: Any) -> Any:
    """Where two moments of inertia are equal or a component of the centre is 0: else no further integral is known."""
    equal = (p[:, 0] == p[:, 1]) | (p[:, 1] == p[:, 2]) | (p[:, 0] == p[:, 2])
    return (equal | (p[:, 3:6] == 0).any(axis=1)).tolist()


def _class(integrals: Sequence[Integral]) -> str:
    found = [kind for each in integrals for name, kind in _CLASSES.items() if each.name.rstrip("123") == name]
    return found[-1] if found else GENERAL


_ALWAYS = holding(HeavyTop((4, 5, 6), 1, (1, 1, 1)), State((1, 0, 0), (0, 0, 1)))
"""The three integrals of every heavy top."""
