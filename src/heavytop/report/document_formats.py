"""What a report says, for programs and for pull requests: its document as JSON and as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from heavytop.records import Quantity, Report
from heavytop.report.document import Block, Card, Cell, Headline, In, Note, Table, Value, Word, cell_text
from heavytop.report.kind import Kinds, document, headlines
from heavytop.report.markdown import escaped, escaped_cell


def to_json(report: Report, kinds: Kinds) -> dict[str, Any]:
    """The blocks of each kind, without charts: a cell is text, or an object that says what it is."""
    found = document(report, kinds, In.FULL)
    said = [{"kind": name, "blocks": [_block(block) for block in blocks]} for name, blocks in found.items()]
    return {"plan": report.plan, "measurements": len(report.rows), "kinds": said}


def _block(block: Block) -> dict[str, Any]:
    name = {"block": type(block).__name__.lower()}
    match block:
        case Headline() | Note():
            return name | {"verdict": block.word and block.word.text, "text": block.text}
        case Table():
            rows = [[_cell(cell) for cell in row] for row in block.rows]
            return name | {
                "title": block.title,
                "notes": list(block.notes),
                "columns": list(block.columns),
                "rows": rows,
            }
        case Card():
            inside: list[Block] = [*block.lines, *([block.table] if block.table else [])]
            return name | {"title": block.title, "note": block.note, "blocks": [_block(each) for each in inside]}
    raise TypeError(block)


def _cell(cell: Cell) -> Any:
    match cell:
        case Value():
            known = cell.metric
            said = None if known is None else (known.value, known.log10, known.band, known.kind)
            return said and dict(zip(("value", "log10", "band", "kind"), said, strict=True))
        case Word():
            return {"verdict": cell.text}
        case Quantity():
            return {"quantity": cell.text}
    return cell


def to_markdown(report: Report, kinds: Kinds) -> str:
    """GitHub-flavoured Markdown: the headlines, then the notes, tables and cards of each kind."""
    found = document(report, kinds, In.FULL)
    plan = f"### Plan {escaped(report.plan.get('name', '?'))}: {len(report.rows)} measurements"
    lines = [plan, "", *(f"- {_said(each)}" for each in headlines(found, kinds)), ""]
    for blocks in found.values():
        lines += [line for block in blocks if not isinstance(block, Headline) for line in _markdown(block)]
    return "\n".join(lines) + "\n"


def _said(block: Headline | Note) -> str:
    return (f"**{block.word.text}** " if block.word else "") + escaped(block.text)


def _markdown(block: Block) -> Iterator[str]:
    match block:
        case Note():
            yield from (_said(block), "")
        case Card():
            yield from (f"#### {escaped(block.title)}", "", *(f"- {_said(each)}" for each in block.lines), "")
            if block.table:
                yield from _markdown(block.table)
        case Table():
            if block.title:
                yield from (f"#### {escaped(block.title)}", "")
            yield from (line for note in block.notes for line in (escaped(note), ""))
            yield _row([escaped_cell(column) for column in block.columns])
            yield _row(["---" if place < block.words else "---:" for place in range(len(block.columns))])
            yield from (_row([escaped_cell(cell_text(cell)) for cell in row]) for row in block.rows)
            yield ""


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
