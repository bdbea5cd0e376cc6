"""Audits in plans: every equation of the paper's claims, for each system, and of the library's."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import log10

from heavytop.display import plural
from heavytop.errors import InputError, quoted
from heavytop.features.claims.library.entry import library
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import Find, PlanTable, Task, exact_row
from heavytop.kind import Kind
from heavytop.measure.scalar import UNRESOLVED
from heavytop.records import Against, Beside, Metric, Quantity, Row, RowKey, Subject, by_name
from heavytop.report.document.document import Block, Card, Cell, Headline, In, Note, Table, Word, clip
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, system

NAME, LIBRARY = "audit", "library"
EXPECTED = Quantity("as_expected")
DIGITS = "digits_right"
_SMOOTH = "smooth"
_SYSTEMS = {HEAVY_TOP.name: "the heavy top", GYROSTAT.name: "the gyrostat"}
_SECONDS = 1.5


class AuditTable(PlanTable, tag=NAME):
    """The claims, and the systems that those of the paper are audited for.

    claims: "ershkov-general", "ershkov-partial", ids of the library, or "library" for every entry of it.
    systems: without them that of each claim, the heavy top of the paper's.  An entry of the library is about its own.
    """

    claims: list[str]
    systems: tuple[str, ...] = ()

    def tasks(self, find: Find) -> list[Task]:
        """A task for each row; raises InputError for an unknown claim or system, and one that a claim is not about."""
        from heavytop.features.claims.audit.audit import PAPER, own_system  # loads SymPy, which no other kind needs

        keys: list[RowKey] = []
        for claim in self.claims:
            systems = self._systems(claim)
            for name in [claim] if claim in PAPER else _entries(claim):
                keys += [RowKey(NAME, name, about or own_system(name), Subject("claimed", name)) for about in systems]
        return [Task(key, "", NAME) for key in keys]

    def _systems(self, claim: str) -> tuple[str, ...]:
        """The systems of a claim's rows, "" for its own."""
        from heavytop.features.claims.audit.audit import PAPER, own_system, paper_claim

        requested = [system(name) for name in self.systems]
        if claim in PAPER:
            return tuple(paper_claim(claim).about(system).name for system in requested) or (HEAVY_TOP.name,)
        for name in _entries(claim) if requested else ():
            if (own := own_system(name)) not in self.systems:
                raise InputError(
                    f"The claim {name} is about {own}, but systems = {quoted(list(self.systems))}.",
                    "Leave systems out: the file of an entry defines its system.",
                )
        return ("",)


def _entries(claim: str) -> list[str]:
    if claim == LIBRARY:
        return list(library())
    if claim not in library():
        from heavytop.features.claims.audit.audit import PAPER

        raise InputError(
            f"Unknown claim {claim[:60]!r} to audit.",
            f'Use {", ".join(PAPER)}, a name of `heavytop claims`, or "{LIBRARY}".',
        )
    return [claim]


class AuditKind(Kind):
    """1 for an equation that holds, 0 for one that is refuted, unresolved for an undecided one."""

    name = NAME
    table = AuditTable
    place = 31

    def cost(self, task: Task) -> float:
        """Seconds, equal for all rows."""
        return _SECONDS

    def measure(self, task: Task, saved: Saved) -> Row:
        """The verdicts on a claim; for the gyrostat on its smooth branch alone, which the formulas solve."""
        from heavytop.features.claims.audit.audit import PAPER, paper_claim
        from heavytop.features.claims.audit.judge import judge

        if task.key.case not in PAPER:
            return _of_entry(task)
        claim, about = paper_claim(task.key.case), system(task.key.system)
        statements = [s for s in claim.statements(about) if about is HEAVY_TOP or s.branch == _SMOOTH]
        metrics = {
            Quantity(f"({row.equation})", str(row.component), "", row.branch, row.domain): _value(row.holds)
            for row in judge(statements, claim.setting)
        }
        against = Against("equations", f"the equations of {task.key.system}")
        return exact_row(task, f"claimed: {claim.source}", against, by_name(metrics))

    def line(self, row: Row) -> str:
        """The verdict, and the numbers of equations that are proven and refuted."""
        return f"{_verdict(row)[0]}: {_counted(row)}"

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        """The verdict on the paper's claims, with the proven equations for each system, and on the library's."""
        entries = [row for row in rows if EXPECTED.text in row.metrics]  # of the library
        paper = [row for row in rows if EXPECTED.text not in row.metrics]
        if any(row.system == HEAVY_TOP.name for row in paper):
            yield _of_paper(paper)
        elif entries:
            values = {row.metrics[EXPECTED.text].value for row in entries}
            word = "failed" if "0" in values else "undecided" if UNRESOLVED in values else ""
            yield Headline(_of_library(entries), Word(word) if word else None, _EVERYWHERE)
        if entries:
            if paper:
                yield Note(_of_library(entries), shown=_EVERYWHERE)
            worst_first = sorted(entries, key=lambda row: ("refuted", "undecided", "holds").index(_verdict(row)[0]))
            yield Table("Library of claims", _COLUMNS, [*map(_entry, worst_first)], shown=In.PAGE)
        if paper:
            lines = [line for claim in sorted({row.case for row in paper}) for line in _equations(claim, paper)]
            yield Card("Equation by equation (heavytop audit)", lines, shown=In.FULL | In.PAGE)


_CLAIM = "Ershkov's motion of the heavy top (γ ∥ M)"
_COLUMNS = ("claim", "system", "verdict", "equations proven", "refuted", "source")


def _of_paper(rows: Sequence[Row]) -> Headline:
    """Whether the claims are motions of the heavy top."""
    verdicts = {_verdict(row)[0] for row in rows if row.system == HEAVY_TOP.name}
    others = [row.system for row in rows if row.system != HEAVY_TOP.name and _verdict(row)[0] == "holds"]
    solved = " and ".join(_SYSTEMS.get(name, name) for name in dict.fromkeys(others))
    if "refuted" in verdicts:
        some = "" if verdicts == {"refuted"} else ", in some cases"
        return Headline(_CLAIM + some + (f"; it holds for {solved}." if others else "."), Word("refuted"), _EVERYWHERE)
    if verdicts == {"holds"}:
        return Headline(_CLAIM + ": every equation is proven.", Word("holds"), _EVERYWHERE)
    return Headline(_CLAIM + ": not refuted, but not every equation is proven.", Word("undecided"), _EVERYWHERE)


_EVERYWHERE = In.SHORT | In.FULL | In.PAGE


def _entry(row: Row) -> list[Cell]:
    """A claim of the library: its system, verdict, how many equations are proven and refuted, and its source."""
    verdict, refuted, held = _verdict(row)
    counts = str(held), str(len(refuted))
    system, source = row.system.replace("_", " "), row.measured.removeprefix("claimed: ")
    return [clip(row.case), system, Word(verdict), *counts, source]


def _equations(claim: str, rows: Sequence[Row]) -> Iterator[Note]:
    """The verdict on one claim of the paper, and for each system how many of its equations are proven and refuted."""
    yield Note(clip(claim), style="soft")
    for row in rows:
        if row.case == claim:
            smooth = " on the smooth branch" if row.system == GYROSTAT.name else ""
            system_name = clip(_SYSTEMS.get(row.system, row.system), 40)
            yield Note(f"for {system_name}{smooth}: {_counted(row)}", Word(_verdict(row)[0]))


def _counted(row: Row) -> str:
    """How many equations are proven, and which are refuted."""
    _, refuted, held = _verdict(row)
    proven = f"{held} of {len(_equations_of(row))} equations proven"
    names = sorted({quantity.name for quantity in refuted})
    return proven + (f", {len(refuted)} refuted: {clip(', '.join(names), 120)}" if refuted else "")


def _of_entry(task: Task) -> Row:
    """The equations of an entry, and whether its verdict is the expected one: unresolved where the audit is stopped.

    For published numbers also their correct digits.
    """
    from heavytop.features.claims.audit.audit import audited

    entry = library()[task.key.case]
    judged, audit = audited(entry)
    metrics: dict[Quantity, Metric] = {}
    for row in () if audit is None else audit.rows:
        where = Quantity(f"({row.equation})", str(row.component), "", row.branch, row.domain)
        metrics[where] = _value(row.holds)
        right = (row.figures or {}).get(DIGITS)
        if right is not None:
            label = f"{row.equation}{row.component}"
            metrics[Quantity(DIGITS, label, "", row.branch, row.domain)] = Metric(
                str(right), log10(right) if right else None, "value"
            )
    metrics[EXPECTED] = _value(
        None if judged.verdict == "undecided" != entry.expects else judged.verdict == entry.expects
    )
    against = Against("equations", f"the equations of {task.key.system}")
    return exact_row(task, f"claimed: {entry.source.text}", against, by_name(metrics))


def _of_library(rows: Sequence[Row]) -> str:
    """The numbers of claims by verdict, and those whose verdict is not the expected one."""
    verdicts = [_verdict(row)[0] for row in rows]
    words = {"holds": "proven", "refuted": "refuted", "undecided": "undecided"}
    counts = [f"{verdicts.count(verdict)} {word}" for verdict, word in words.items() if verdict in verdicts]
    unexpected = [row.case for row in rows if row.metrics[EXPECTED.text].value != "1"]
    expected = f"not as expected: {', '.join(unexpected)}" if unexpected else "every verdict as expected"
    return f"Library of {plural(len(rows), 'claim')}: {', '.join(counts)}; {expected}."


def _value(holds: bool | None) -> Metric:
    return Metric(UNRESOLVED if holds is None else str(int(holds)), 0.0 if holds else None, "value")


def _equations_of(row: Row) -> list[Metric]:
    """The metrics of a row that are verdicts on its equations."""
    return [m for m in row.metrics.values() if m.quantity is None or m.quantity.name not in (EXPECTED.name, DIGITS)]


def _verdict(row: Row) -> tuple[str, list[Quantity], int]:
    """The verdict, the refuted equations, and the number of proven ones."""
    equations = _equations_of(row)
    refuted = [metric.quantity or Quantity("?") for metric in equations if metric.value == "0"]
    held = sum(metric.value == "1" for metric in equations)
    undecided = len(equations) - held - len(refuted)
    return ("refuted" if refuted else "undecided" if undecided or not held else "holds"), refuted, held
