"""A single measurement of a plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from heavytop.precision import parse
from heavytop.suite.cases import Case

if TYPE_CHECKING:
    from heavytop.suite.starts import GrowthRun


@dataclass(frozen=True, slots=True)
class Task:
    """One measurement, and the row it will fill.

    name: as the row names its case.  case: None for an audit, whose ``form`` is the system.
    times: exact, of the sign of the direction; for claim_evaluation they are values of k |t| with that sign.
    keep: the times that go into the series.  precision: "" where no format is involved.
    integrator: heyoka, or a fault of :mod:`heavytop.integrate.broken`.
    seed: which roundings; 0 for those of the data as given.
    ensemble: of a growth measurement.
    """

    kind: str
    name: str
    case: Case | None
    precision: str
    form: str
    times: tuple[Fraction, ...] = ()
    keep: tuple[Fraction, ...] = ()
    integrator: str = "heyoka"
    seed: int = 0
    ensemble: GrowthRun | None = None

    def of(self, case: Case) -> Task:
        """The same measurement of another case."""
        assert self.case is not None
        return replace(self, name=case.name + self.name.removeprefix(self.case.name), case=case)

    @property
    def label(self) -> str:
        """For progress and messages."""
        return " ".join(part for part in (self.kind, self.name, self.form, self.precision) if part)

    @property
    def cost(self) -> float:
        """Seconds it may take, roughly: for the progress bar and for running long ones first."""
        if not self.precision:
            return 5.0
        per_step = seconds_a_step(parse(self.precision).bits)
        if self.kind == "local_error":
            return 1.0 + 0.2 * float(self.times[-1])
        seconds = float(abs(self.times[-1])) * 4 * per_step + len(self.times) * 1e-4
        if self.ensemble is not None:
            return 5.0 + self.ensemble.starts * seconds / 2
        return (3.0 if self.kind == "drift" else 1.0) + seconds


def seconds_a_step(bits: int) -> float:
    """Seconds that one step of heyoka takes in a format of so many bits, roughly."""
    return 1e-6 if bits <= 53 else 5e-6 if bits <= 64 else 5e-4 * (bits / 113) ** 2.5
