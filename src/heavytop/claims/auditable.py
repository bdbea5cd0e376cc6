"""What can be audited: a claim as statements, and one of which more may be assumed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from heavytop.claims.entry import Entry
from heavytop.claims.judge import Finding, Row
from heavytop.claims.statement import Setting, Statement
from heavytop.top.equations import System


class Auditable(Protocol):
    """A claim whose formulas can be put into equations."""

    @property
    def name(self) -> str: ...

    @property
    def source(self) -> str: ...

    @property
    def kind(self) -> str: ...

    @property
    def entry(self) -> Entry | None: ...

    @property
    def setting(self) -> Setting: ...

    def about(self, asked: System | None) -> System:
        """The system that it is judged about, where that one is asked for, or none; raises InputError for another."""
        ...

    def statements(self, system: System) -> list[Statement]:
        """Every equation that the claim should satisfy as a motion of ``system``, and its own steps."""
        ...

    def explain(self, about: System, rows: Sequence[Row]) -> tuple[list[Finding], tuple[str, ...]]:
        """The steps that explain the verdict, and the names of the systems whose motions the claim is.

        rows: the verdicts about the system ``about``, so that they need not be found again.
        """
        ...


@runtime_checkable
class Assuming(Auditable, Protocol):
    """A claim with parameters, of which more may be assumed."""

    @property
    def unassumed(self) -> list[str]:
        """Parameters of which the claim assumes nothing."""
        ...

    def assuming(self, bound: str) -> Auditable:
        """The same claim with one assumption more; raises InputError where a sample breaks it."""
        ...
