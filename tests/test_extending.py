"""What is registered stands in the page where a user looks for it; each message says what to write where."""

from __future__ import annotations

import inspect
from pathlib import Path
from pkgutil import resolve_name

import pytest

from heavytop.exact import cases
from heavytop.features.kinds import KINDS
from heavytop.integrate.registry import INTEGRATORS
from heavytop.report.render import FORMATS
from support import in_process

DOCS = Path(__file__).parents[1] / "docs"
PLANNED = [name for name, kind in KINDS.items() if kind.table is not None]
MOTIONS = [file.name for file in Path(cases.__path__[0]).glob("*.py") if file.name != "__init__.py"]


def first_cells(page: str) -> str:
    """The first column of the tables of a page."""
    lines = (DOCS / page).read_text("utf-8").splitlines()
    return "\n".join(line.split("|")[1] for line in lines if line.startswith("| "))


@pytest.mark.parametrize("name", PLANNED)
def test_a_kind_is_in_the_page_of_plans_with_all_its_keys(name: str) -> None:
    table = KINDS[name].table
    lines = [line for line in (DOCS / "plans.md").read_text("utf-8").splitlines() if line.startswith(f"| `{name}` |")]
    assert len(lines) == 1, f"docs/plans.md: write a row `{name}` in the table of kinds"
    assert table is not None
    missing = [key for key in table.__struct_fields__ if f"`{key}" not in lines[0]]
    assert missing == [], f"docs/plans.md: the row of `{name}` lacks keys"


@pytest.mark.parametrize("name", [name for name in INTEGRATORS if name != "multiword"])
def test_an_integrator_is_in_the_page_of_gates(name: str) -> None:
    assert f"`{name}`" in first_cells("gate.md"), f"docs/gate.md: write a row `{name}` in the last table"


@pytest.mark.parametrize("file", MOTIONS)
def test_a_class_of_exact_motions_is_in_the_page_of_cases(file: str) -> None:
    page = (DOCS / "cases.md").read_text("utf-8")
    assert f"`{file}`" in page, f"docs/cases.md: write a row with `{file}`"


@pytest.mark.parametrize("name", FORMATS)
def test_a_format_is_a_function_and_is_in_help_and_docs(name: str) -> None:
    assert list(inspect.signature(resolve_name(FORMATS[name])).parameters) == ["report", "kinds"]
    assert name in (DOCS / "gate.md").read_text("utf-8"), f"docs/gate.md: write what `--to {name}` is for"
    assert name in in_process.heavytop("export", "--help").stdout
