"""Hypotheses about a file, each tried once, and the simplest that explains all samples compared, or the first ones.

A hypothesis is accepted if the error falls by two decades, by three where a number was fitted; of several that fit
about as well the simplest is named.  In the first samples a fall by a factor of 30 makes one without a number likely.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy
from numpy.typing import NDArray

from heavytop.measure.scalar import Rounding, explains
from heavytop.precision import plain_decimal

Array = NDArray[numpy.float64]

WORTH_ASKING = 1e-10
"""Relative errors below it are not diagnosed."""
ALIKE = 30.0
"""Factor within which errors of hypotheses count as equal: the simplest is accepted."""
AS_LIKELY = 3.0
"""The same factor for likely hypotheses."""
FLOOR = 1e-13
"""Relative errors below it are heyoka's own."""
DROP = 100.0
"""Factor by which errors must fall for a hypothesis without a free number, ..."""
FITTED_DROP = 1000.0
"""... and for one whose numbers were fitted; ..."""
LIKELY_DROP = 30.0
"""... by this factor one without a free number is likely."""
_LARGE = 10.0
"""A larger error counts as this one: columns of any large numbers lose as much if something makes them smaller."""
_NOTHING = 0.5
"""A hypothesis that leaves a larger error explains nothing, however large the error is without it."""
FIRST = (6, 2)
"""Numbers of first samples after t = 0 that are judged by themselves: a method of low order is off by little there."""
_MOST_OTHERS = 3


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """A mistake that explains the states.

    kind: which; docs/score.md lists them.  numbers: what fits, as text, by name.
    error: the largest error of the states compared, relative to the size of Ω and of γ; left: the error that remains
    once the mistake is corrected.  Both None where nothing was tried: the states themselves show it.
    looked_at: how many states were compared, of how many, and the time of the last, as text; None for all.
    likely: whether the error falls by less than a definite statement requires.  others: hypotheses that fit as well.
    """

    kind: str
    numbers: dict[str, str] = field(default_factory=dict)
    error: float | None = None
    left: float | None = None
    looked_at: tuple[int, int, str] | None = None
    likely: bool = False
    others: tuple[Diagnosis, ...] = ()


def rounded(written: Sequence[Rounding], error: float | None) -> list[Diagnosis]:
    """The diagnosis that rounding to the digits written explains the error: it is neither larger nor far smaller."""
    explaining = (rounding for rounding in written if error is not None and explains(rounding, error))
    return [Diagnosis("rounded", {"to": each.kind, "digits": str(each.digits)}) for each in explaining][:1]


class Hypothesis(NamedTuple):
    """A mistake that was tried.

    numbers: that fit.  errors: that remain in each sample, or in all but one at an end.
    drop: the factor by which the error must fall.  is_round: whether a fitted number has at most three digits.
    """

    kind: str
    numbers: dict[str, str]
    errors: Array
    drop: float = DROP
    is_round: bool = False

    def left(self, looked: int | None = None) -> float:
        """The largest error that remains in the first so many samples."""
        return float(self.errors[:looked].max())

    def least_fall(self, likely: float) -> float:
        """Factor by which the error must fall; ``likely``, or DROP for a round number, where it need only be likely."""
        return self.drop if not likely else likely if self.drop == DROP else DROP if self.is_round else self.drop


class Search(ABC):
    """The search for the mistake of a file.

    file_errors: of each sample compared, as the file stands.  times: of these, in units of the file.
    states: how many the file has.  names_others: whether a diagnosis names hypotheses that fit as well.
    """

    file_errors: Array
    times: Sequence[Fraction]
    states: int
    names_others = False

    @abstractmethod
    def hypotheses(self) -> Iterable[Hypothesis]:
        """The simplest first, those with a fitted number last."""

    @abstractmethod
    def further(self, diagnosis: Diagnosis | None, error: float) -> Iterator[Hypothesis]:
        """Hypotheses that are tried only where nothing, or nothing better than this, explains the error."""

    def counted(self, error: float, looked: int) -> float:
        """The part of an error of so many first samples whose fall counts."""
        return min(error, _LARGE)

    @cached_property
    def tried(self) -> list[Hypothesis]:
        """All hypotheses, with the errors that they leave."""
        return [*self.hypotheses()]

    def sure(self, first: int | None = None, drop: float = 0.0) -> Diagnosis | None:
        """The simplest mistake among those that explain the samples about as well as the best; None where none does.

        first: of the first samples alone, where no number is fitted.  drop: a smaller one than usual.
        """
        looked = len(self.file_errors) if first is None else first + (not self.times[0])
        if looked > len(self.file_errors):
            return None
        error = float(self.file_errors[:looked].max())
        error = error if numpy.isfinite(error) else 1.0
        if not error > WORTH_ASKING:
            return None
        plain = (hypothesis for hypothesis in self.tried if hypothesis.drop == DROP)
        of_all = (hypothesis for hypothesis in plain if len(hypothesis.errors) == len(self.file_errors))
        tried = self.tried if first is None else [*of_all]
        diagnosis = self.best(tried, error, looked, drop)
        further = [*self.further(diagnosis, error)] if first is None and not drop else []
        return self.best([*further, *tried], error, looked) if further else diagnosis

    def best(
        self, tried: Sequence[Hypothesis], error: float, looked: int | None = None, drop: float = 0.0
    ) -> Diagnosis | None:
        """The simplest of these hypotheses that explains the error of the first so many samples."""
        looked = len(self.file_errors) if looked is None else looked
        lefts = [(hypothesis, hypothesis.left(looked)) for hypothesis in tried]
        lefts = [pair for pair in lefts if pair[1] <= _NOTHING]
        most = self.counted(error, looked)
        explained = [(hypothesis, left) for hypothesis, left in lefts if left * hypothesis.least_fall(drop) <= most]
        if not explained:
            return None
        best = min(max(left, FLOOR) for _, left in explained)
        alike = [(hypothesis, left) for hypothesis, left in explained if left <= (AS_LIKELY if drop else ALIKE) * best]
        first, left = alike[0]
        numbers, others = first.numbers, list[Diagnosis]()
        if self.names_others:
            first, left = _of_kind(first.kind, alike)
            # with a number that was fitted more can be explained
            equal = [pair for pair in alike if pair[0].drop <= first.drop and pair[0].kind != first.kind]
            kinds = list(dict.fromkeys(hypothesis.kind for hypothesis, _ in equal))[:_MOST_OTHERS]
            others = [Diagnosis(kind, _of_kind(kind, equal)[0].numbers) for kind in kinds]
            numbers = first.numbers | ({"or": ", ".join(kinds)} if kinds else {})
        return Diagnosis(
            first.kind, numbers, error, left, scope(self.times[:looked], self.states), bool(drop), (*others,)
        )


def scope(times: Sequence[Fraction], states: int) -> tuple[int, int, str] | None:
    """How many samples, of how many, and the time of the last of them; None for all."""
    return None if len(times) == states else (len(times), states, plain_decimal(times[-1], 6))


def _of_kind(kind: str, tried: Sequence[tuple[Hypothesis, float]]) -> tuple[Hypothesis, float]:
    """The hypothesis of a kind whose number fits best, the first of equal ones, and the error that it leaves."""
    # rounding, which no two machines share, does not decide
    return min((pair for pair in tried if pair[0].kind == kind), key=lambda pair: float(f"{max(pair[1], FLOOR):.5e}"))
