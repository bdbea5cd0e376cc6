"""Every picture of a report as a file of its own, as SVG and as PDF: the title above it, the legend below it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

from heavytop.errors import InputError
from heavytop.records import Report
from heavytop.report.html import sections
from heavytop.report.kind import Kinds
from heavytop.report.section import Key, Section
from heavytop.report.svg import COLOURS, Picture, document, quiet_style


def draw_report(report: Report, directory: Path, kinds: Kinds) -> list[Path]:
    """The files written into ``directory``, two a picture of the page; raises InputError where it has none."""
    found = [(section, picture) for section in sections([("", report)], kinds) for picture in section.pictures]
    if not found:
        raise InputError("The report has no row that is drawn.", "`heavytop run --plan smoke` makes some.")
    directory.mkdir(parents=True, exist_ok=True)
    return [file for section, picture in found for file in _save(section, picture, directory / picture.name)]


def _save(section: Section, picture: Picture, stem: Path) -> list[Path]:
    axes = picture.axes
    with quiet_style():
        axes.set_title(fill(picture.title, 60), loc="left", pad=10, size=10)
        drawn = axes.get_legend_handles_labels()[1]
        _legend(picture, [key for key in section.legend.values() if key.label in drawn])
        svg, pdf = stem.with_suffix(".svg"), stem.with_suffix(".pdf")
        svg.write_text(document(axes.figure, bbox_inches="tight"), "utf-8")
        axes.figure.savefig(pdf, metadata={"CreationDate": None, "Creator": "heavytop"}, bbox_inches="tight")
    return [svg, pdf]


def _legend(picture: Picture, keys: Sequence[Key]) -> None:
    from matplotlib.lines import Line2D

    if not keys:
        return
    handles = [
        Line2D([], [], color=COLOURS[key.colour], marker=key.marker, ms=5, ls=_dash(key), label=key.label)
        for key in keys
    ]
    place = {"loc": "upper left", "bbox_to_anchor": (0, 0), "borderaxespad": 0}
    picture.axes.figure.legend(handles=handles, ncols=2, fontsize=8.5, frameon=False, **place)


def _dash(key: Key) -> str:
    return "--" if key.dash else "-" if key.line else ""
