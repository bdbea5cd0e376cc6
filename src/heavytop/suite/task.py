"""A single measurement of a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import msgspec

from heavytop.integrate.peers import is_third_party
from heavytop.integrate.peers.source import Source
from heavytop.integrate.reach import require_reach
from heavytop.integrate.trajectory import Problem
from heavytop.measure.computed_reference import seconds_a_step as words_seconds
from heavytop.measure.integrator import HEYOKA, MULTIWORD, ChosenIntegrator
from heavytop.measure.rounding_noise import factor, scaled
from heavytop.precision import Precision, exact, parse
from heavytop.records import EXACT, FINEST, RowKey, Subject
from heavytop.suite.cases import Case


@dataclass(frozen=True, slots=True)
class Task:
    """One measurement, and the row it will fill.

    key: of the row.  suffix: behind the case in what the row calls it: a direction, a horizon.  subject: what is
    measured.
    case: None where no motion is measured.
    times: exact, of the sign of the direction; keep: those that go into the series.
    options: what else the kind of measurement needs to know, and it alone.
    seed: which roundings; 0 for those of the data as given.
    fault: of :mod:`heavytop.integrate.broken`, which runs in the place of the integrator.
    source: of an integrator that is neither built in nor a package's.
    """

    key: RowKey
    suffix: str
    subject: str
    case: Case | None = None
    times: tuple[Fraction, ...] = ()
    keep: tuple[Fraction, ...] = ()
    options: Any = None
    seed: int = 0
    fault: str = ""
    source: Source | None = None

    def of(self, case: Case) -> Task:
        """The same measurement of another case of the same system."""
        key = msgspec.structs.replace(self.key, case=case.name, system=case.system.name)
        return replace(self, key=key, case=case)

    @property
    def title(self) -> str:
        """What the row calls its case."""
        return self.key.case + self.suffix

    @property
    def precision(self) -> Precision:
        """The format; raises InputError where none is involved."""
        return parse(self.key.precision)

    @property
    def has_precision(self) -> bool:
        """Whether a format is involved."""
        return self.key.precision != EXACT

    @property
    def integrator(self) -> ChosenIntegrator:
        """What computes the motion."""
        return ChosenIntegrator(self.key.subject.name, self.fault, source=self.source)

    @property
    def is_third_party(self) -> bool:
        """Whether code or a program of others computes the motion."""
        return self.key.subject.what == "computed" and not self.fault and is_third_party(self.key.subject.name)

    @property
    def given(self) -> Case:
        """The case, with the roundings of the seed."""
        assert self.case is not None
        return replace(self.case, top=scaled(self.case.top, factor(self.seed))) if self.seed else self.case

    def require_reach(self) -> None:
        """Raises OutOfReach where what is measured is a run of too many steps."""
        subject, case = self.key.subject, self.case
        if subject.what == "computed" and case is not None and self.times:
            problem = Problem.of(case.top, case.start, self.precision, case.system)
            step = exact(subject.step) if subject.step not in ("", FINEST) else None
            require_reach(problem, self.times[-1], step=step)

    @property
    def label(self) -> str:
        """For progress and messages."""
        plain = self.subject in (HEYOKA, self.key.kind)
        system = self.key.system if self.case is None else ""
        precision = self.key.precision if self.has_precision else ""
        parts = (self.key.kind, self.title, "" if plain else self.subject, system, precision)
        return " ".join(part for part in parts if part)

    @property
    def run_seconds(self) -> float:
        """Seconds that multiword, or heyoka for all others, take for such a motion, roughly."""
        step = (words_seconds if self.key.subject.name == MULTIWORD else seconds_a_step)(self.precision.bits)
        return float(abs(self.times[-1])) * 4 * step + len(self.times) * 1e-4


def computed(name: str, **setting: Any) -> Subject:
    """The integrator of that name with a setting as a subject."""
    return Subject("computed", name, **setting)


def seconds_a_step(bits: int) -> float:
    """Seconds that one step of heyoka takes in a format of so many bits, roughly."""
    return 1e-6 if bits <= 53 else 5e-6 if bits <= 64 else 5e-4 * (bits / 113) ** 2.5
