"""A kind of measurement is one file and one line: this one is a toy, and everything works with it."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import pytest

from heavytop.features.kinds import KINDS
from heavytop.harness.checkpoint import Checkpoint, Saved
from heavytop.harness.plan import expand, load
from heavytop.harness.rows import Find, PlanTable, Task, exact_row
from heavytop.harness.run import run
from heavytop.kind import Kind
from heavytop.measure.scalar import of_fraction
from heavytop.records import Against, Beside, Quantity, Row, RowKey, Subject, by_name
from heavytop.report.compare.compare import compare
from heavytop.report.compare.noise import Policy
from heavytop.report.document.document import Block, Chart, Headline, Section, Sources, Value
from heavytop.report.document.document import Table as Cells
from heavytop.report.render.page import report_page
from heavytop.report.render.terminal import summary
from support.helpers import shown
from support.small_reports import report

WEIGHT = Quantity("toy_weight")
PLAN = """name = "toys"
[[measure]]
kind = "toy"
cases = ["euler", "lagrange"]
factors = ["2", "3"]
"""


class ToyTable(PlanTable, tag="toy"):
    """factors: what the weight is multiplied by."""

    cases: list[str]
    factors: list[str]

    def tasks(self, find: Find) -> list[Task]:
        """One a row."""
        return [
            Task(
                RowKey("toy", case.name, case.system.name, Subject("given", f"times {factor}")),
                "",
                f"times {factor}",
                case,
                options=int(factor),
            )
            for case in map(find, self.cases)
            for factor in self.factors
        ]


def drawn(sources: Sources, first: Iterable[str] = ()) -> Section | None:
    rows = [[row.case, row.metrics[WEIGHT.text].value] for _, report in sources for row in report.rows]
    return Section("toys", "All toys", ["Their weights."], columns=["case", "weight"], rows=rows) if rows else None


class Toy(Kind):
    """The weight of a top times a factor."""

    name = "toy"
    table = ToyTable
    needed = (WEIGHT.text,)
    spoilt = 1

    def cost(self, task: Task) -> float:
        return 0.1

    def measure(self, task: Task, saved: Saved) -> Row:
        weight = of_fraction(task.given.top.weight * task.options * self.spoilt)
        return exact_row(task, "given: a toy", Against("equations", "a balance"), by_name({WEIGHT: weight}))

    def document(self, rows: Sequence[Row], beside: Beside | None = None) -> Iterable[Block]:
        yield Headline(f"{len(rows)} toys are weighed.")
        yield Cells("Toys", ["case", "weight"], [[row.case, Value(row.metrics[WEIGHT.text])] for row in rows])
        yield Chart(drawn)


KINDS_WITH_TOY = {**KINDS, "toy": Toy()}


def measured(folder: Path, workers: int = 1, stop_after: int | None = None, kinds=KINDS_WITH_TOY) -> list[Row]:
    """The rows of the plan, from a run that goes on where an earlier one in the folder stopped."""
    plan = folder / "toys.toml"
    plan.write_text(PLAN)
    tasks, seen = expand(load(str(plan), kinds)[0]), []

    def progress(task: Task) -> None:
        seen.append(task)
        if len(seen) == stop_after:
            raise KeyboardInterrupt

    with Checkpoint(folder / "run", {"plan": "toys"}, lambda: None) as checkpoint:
        assert run(tasks, kinds, checkpoint, progress, workers) == []
        return list(checkpoint.rows(range(len(tasks))))


def test_a_plan_runs_stops_and_goes_on(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        measured(tmp_path, stop_after=2)
    assert len((tmp_path / "run" / "rows.jsonl").read_text().splitlines()) == 3
    rows = measured(tmp_path)
    assert [(row.case, row.integrator) for row in rows] == [
        (case, f"times {factor}") for case in ("euler", "lagrange") for factor in (2, 3)
    ]
    assert [row.metrics["toy_weight"].value for row in rows] == ["3", "4.5", "4", "6"]


@pytest.mark.slow
def test_spawned_workers_know_it_too(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    assert measured(tmp_path / "one") == measured(tmp_path / "two", workers=2)


@pytest.mark.slow
def test_its_rows_have_their_lines_and_their_section(tmp_path: Path) -> None:
    made = report(*measured(tmp_path))
    text = shown(summary(made, KINDS_WITH_TOY), 100)
    assert all(part in text for part in ("4 toys are weighed.", "Toys", "4.5")), text
    page = report_page(made, KINDS_WITH_TOY)
    assert '<section id="toys"' in page
    assert "Their weights." in page
    # a program without the kind lists them all the same
    assert '<section id="toys"' not in report_page(made, KINDS)
    assert "times 3" in report_page(made, KINDS)


def test_its_rows_compare(tmp_path: Path) -> None:
    rows, others = measured(tmp_path), measured(tmp_path)
    assert compare(report(*rows), report(*others), Policy(), KINDS_WITH_TOY).verdict == "same"

    class Heavier(Toy):
        spoilt = 1000

    worse = measured(tmp_path, kinds={**KINDS, "toy": Heavier()})
    result = compare(report(*rows), report(*worse), Policy(), KINDS_WITH_TOY)
    assert (result.verdict, len(result.changed)) == ("worse", 4)
    assert compare(report(*rows), report(*rows[1:]), Policy(), KINDS_WITH_TOY).verdict == "incomparable"
