"""A kind of measurement as reports need it.  The kinds are in :mod:`heavytop.features.kinds`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from heavytop.records import UNMEASURED, Beside, Metric, Quantity, Report, Row, Subject
from heavytop.report.document.document import Block, Document, Headline, In
from heavytop.report.document.motions import LossLimits, WorseMotions


class ReportedKind(Protocol):
    """One kind of measurement, as far as it is compared, summed up and drawn; what it does not say is the usual.

    needed: the metrics that its summary cannot do without.
    noise_factor: by how much the noise band of a rerun may be wider by chance; None where its rows carry none.
    largest_amplification: of rounding, within the times at which its errors count.
    samples_are_steps: so these may be fewer as the steps may.
    may_end_early: what its runs are called, where the rows are there to show that one does not reach its horizon.
    may_overflow: the same of values that are not finite.
    place: the headlines stand in the order of their places.
    """

    name: str
    needed: tuple[str, ...] = ()
    noise_factor: float | None = None
    largest_amplification: float = math.inf
    samples_are_steps: bool = False
    may_end_early: str = ""
    may_overflow: bool = False
    place: int = 0

    def carries_band(self, metric: Metric) -> bool:
        """Whether its rows have a noise band at such a metric."""
        return self.noise_factor is not None and metric.kind == "error"

    def noise_is_added(self, metric: Metric) -> bool:
        """Whether noise is added to the number, and does not multiply it."""
        return metric.kind != "error"

    def noise_is_reruns(self, metric: Metric) -> bool:
        """Whether the noise band of such a metric comes from runs of one motion with other roundings."""
        return False

    def assumed_band(self, subject: Subject) -> float:
        """Half-width in decades of the rounding noise of a row that has no bands."""
        return 0.0

    def least_band(self, starts: int) -> float:
        """Half-width in decades of the noise of a row of so many starts, where its band is narrower by chance."""
        return 0.0

    def roundings(self, quantity: Quantity | None, steps: int) -> float:
        """log10 of how many eps the roundings of ``steps`` steps add up to, where the row has no bands."""
        return 0.0

    def series_has_more(self, quantity: Quantity | None) -> bool:
        """Whether a series goes on where the metrics of its quantity have stopped."""
        return False

    def contradictions(self, row: Row) -> Iterator[str]:
        """Contradictions within a row of this kind that succeeded, as ``FIELD: REASON``."""
        return iter(())

    def line(self, row: Row) -> str:
        """Beginning of a line about a row of this kind; "" for its first error."""
        return ""

    def join(
        self, old: Row, new: Row, folders: tuple[Path, Path], limits: Callable[[str], LossLimits]
    ) -> WorseMotions | None:
        """The motions of a row of both reports that got worse, by records in their folders; None where it keeps none.

        limits: what is allowed of a metric.
        """
        return None

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The blocks of its measured rows, one at least.  beside: what `score` wrote beside its row."""
        return ()


class Unknown(ReportedKind):
    """A kind that this program does not have: its rows are compared and listed."""

    name = ""


Kinds = Mapping[str, ReportedKind]
_UNKNOWN = Unknown()


def kind_of(row: Row, kinds: Kinds) -> ReportedKind:
    """The kind of a row."""
    return kinds.get(row.key.kind, _UNKNOWN)


def document(report: Report, kinds: Kinds, shown: In) -> dict[str, list[Block]]:
    """The blocks of each kind that has measured rows, shown there; the kinds that are not known say nothing."""
    measured: dict[str, list[Row]] = {}
    for row in report.rows:
        if row.outcome not in UNMEASURED:
            measured.setdefault(row.key.kind, []).append(row)
    return {
        name: [block for block in kind.document(measured[name], report.beside) if block.shown & shown]
        for name, kind in kinds.items()
        if name in measured
    }


def headlines(blocks: Document, kinds: Kinds) -> list[Headline]:
    """The headlines of a document, in the order of the places of their kinds."""
    order = sorted(blocks, key=lambda name: kinds[name].place)
    return [block for name in order for block in blocks[name] if isinstance(block, Headline)]
