"""The protocol of a kind of measurement for reports.  The kinds are in :mod:`heavytop.features.kinds`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from heavytop.records import UNMEASURED, Beside, Metric, Quantity, Report, Row, Subject
from heavytop.report.document.document import Block, Document, Headline, In
from heavytop.report.document.motions import LossLimits, WorseMotions


class ReportedKind(Protocol):
    """One kind of measurement, for comparing, summarizing and drawing it; attributes and methods are defaults.

    needed: the metrics that its summary requires.
    noise_factor: factor by which the noise band of a rerun may be wider by chance; None where rows carry no bands.
    largest_amplification: of rounding, within the times at which its errors count.
    samples_are_steps: whether the samples may decrease as the steps may.
    may_end_early: the name of its runs, where not reaching the horizon is a result and no failure.
    may_overflow: whether non-finite values are a result and no failure.
    place: sort key of its headlines.
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
        """Whether its rows have a noise band for such a metric."""
        return self.noise_factor is not None and metric.kind == "error"

    def noise_is_added(self, metric: Metric) -> bool:
        """Whether noise is additive, not multiplicative."""
        return metric.kind != "error"

    def noise_is_reruns(self, metric: Metric) -> bool:
        """Whether the noise band of such a metric is measured by reruns with perturbed roundings."""
        return False

    def assumed_band(self, subject: Subject) -> float:
        """Assumed half-width, in decades, of the rounding noise of a row without bands."""
        return 0.0

    def least_band(self, starts: int) -> float:
        """Least half-width, in decades, of the noise of a row of ``starts`` starts: narrower bands are chance."""
        return 0.0

    def roundings(self, quantity: Quantity | None, steps: int) -> float:
        """log10 of the sum, in eps, of the roundings of ``steps`` steps, where the row has no bands."""
        return 0.0

    def series_has_more(self, quantity: Quantity | None) -> bool:
        """Whether a series continues beyond the samples of the metrics of its quantity."""
        return False

    def contradictions(self, row: Row) -> Iterator[str]:
        """Contradictions within a row of this kind that succeeded, as ``FIELD: REASON``."""
        return iter(())

    def line(self, row: Row) -> str:
        """The beginning of a line about a row of this kind; "" for the first error of the row."""
        return ""

    def join(
        self, old: Row, new: Row, folders: tuple[Path, Path], limits: Callable[[str], LossLimits]
    ) -> WorseMotions | None:
        """The motions of a row that got worse, by the records in the folders of both reports; None without records.

        limits: the allowance of a metric.
        """
        return None

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The blocks of its measured rows, at least one.  beside: the further results of `score`."""
        return ()


class Unknown(ReportedKind):
    """A kind unknown to this program: its rows are compared and listed."""

    name = ""


Kinds = Mapping[str, ReportedKind]
_UNKNOWN = Unknown()


def kind_of(row: Row, kinds: Kinds) -> ReportedKind:
    """The kind of a row."""
    return kinds.get(row.key.kind, _UNKNOWN)


def document(report: Report, kinds: Kinds, shown: In) -> dict[str, list[Block]]:
    """The blocks, shown there, of each known kind that has measured rows."""
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
