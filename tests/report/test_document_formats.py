"""A document as JSON and as Markdown: the blocks of the full summary, with their cells typed."""

from __future__ import annotations

import json
import re
from pathlib import Path

from heavytop.features.kinds import KINDS
from heavytop.records import SCHEMA, Report
from heavytop.report.render.export import to_json, to_markdown
from support.report_helpers import claim_rows
from support.reports import store
from support.small_reports import error, row

MADE = Report(
    SCHEMA,
    {"name": "p|q"},
    {},
    [
        *claim_rows("refuted"),
        row(measure="local_error", metrics={"local_error_ulp_max": error("3.25e-997")}, order=4),
        row(measure="of a later version"),
    ],
)


def test_json_has_numbers_and_verdicts_and_no_words_to_take_apart() -> None:
    found = json.loads(json.dumps(to_json(MADE, KINDS)))
    kinds = {each["kind"]: each["blocks"] for each in found["kinds"]}
    assert list(kinds) == [name for name in KINDS if name in {each.key.kind for each in MADE.rows}]
    headline, card = kinds["audit"]
    assert (headline["block"], headline["verdict"], card["block"]) == ("headline", "refuted", "card")
    table = kinds["local_error"][-1]
    (cells,) = table["rows"]
    said = dict(zip(table["columns"], cells, strict=True))
    assert said["largest"] == {"value": "3.25E-997", "log10": error("3.25e-997").log10, "band": None, "kind": "error"}
    assert (said["case"], said["rms"]) == ("euler", None)


def test_markdown_is_escaped_and_every_row_has_all_cells() -> None:
    text = to_markdown(MADE, KINDS)
    assert text.startswith("### Plan p\\|q: ")
    assert "- **refuted** Ershkov's motion of the heavy top" in text
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    place = rows.index(next(line for line in rows if "largest" in line))
    assert "3.25e-997" in rows[place + 2]


def test_every_row_of_a_markdown_table_has_the_cells_of_its_head() -> None:
    report = store.read(Path(__file__).parents[2] / "results" / "default")
    tables = re.findall(r"(?:^\| .*\n)+", to_markdown(report, KINDS), re.MULTILINE)
    assert len(tables) >= 5
    for table in tables:
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in table.splitlines()}) == 1
