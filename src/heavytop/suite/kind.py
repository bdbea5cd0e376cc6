"""What a run needs to know of a kind of measurement.  The kinds are in :mod:`heavytop.kinds`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, Protocol

import msgspec

from heavytop.integrate.peers import name_of
from heavytop.integrate.peers.source import Source
from heavytop.measure.integrator import HEYOKA
from heavytop.records import Row
from heavytop.suite.cases import Case
from heavytop.suite.checkpoint import Saved
from heavytop.suite.task import Task

Find = Callable[[str], Case]
"""The case of a name; raises InputError for an unknown one."""


class Table(msgspec.Struct, forbid_unknown_fields=True, tag_field="kind"):
    """A table `[[measure]]` of a plan; unknown keys are errors.

    chunked: whether its tasks are chunks of a sweep, not single motions.
    """

    chunked: ClassVar[bool] = False

    def tasks(self, find: Find) -> list[Task]:
        """One a row; raises InputError for an impossible value."""
        raise NotImplementedError

    def beside(self, which: str | Source) -> Table | None:
        """The same measurements with that integrator in heyoka's place; None where heyoka is not measured."""
        if getattr(self, "integrator", None) != HEYOKA:
            return None
        return msgspec.structs.replace(self, integrator=name_of(which))


class Kind(Protocol):
    """One kind of measurement, as far as it is run; what it does not say is the usual.

    name: in a plan and in the rows.  table: its table in a plan, tagged with the name; None where no plan asks for it.
    concludes: whether all rows of the kind together come to more rows.
    gathers: whether its rows are parts of one that :mod:`heavytop.suite.survey` makes of them for the report.
    """

    name: str
    table: type[Table] | None = None
    concludes: bool = False
    gathers: bool = False

    def measure(self, task: Task, saved: Saved) -> Row:
        """The row of ``task``; a run that fails is a row with its outcome.

        saved: the place of an earlier, interrupted measurement of this row, and where this one keeps its own.
        Raises OutOfReach, Contradiction and PeerFailed, which are rows too.
        """
        ...

    def cost(self, task: Task) -> float:
        """Seconds it may take, roughly: for the progress bar and for running long ones first.

        Those of one run of heyoka, and a second.
        """
        return 1.0 + task.run_seconds

    def conclude(self, rows: Sequence[Row]) -> list[Row]:
        """What all rows of the kind together come to; called where it :attr:`concludes`."""
        return []


Kinds = Mapping[str, Kind]
