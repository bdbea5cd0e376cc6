"""The directive ``{thumbnails}``: links to the sections of the page that have pictures, with the first in small."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective


class Thumbnails(SphinxDirective):
    """Marks where they stand: pictures of cells are there once the page is whole."""

    def run(self) -> list[nodes.Node]:
        """Called by Sphinx."""
        return [nodes.container(classes=["thumbnails"])]


def fill(app: Any, page: nodes.document, name: str) -> None:
    """Put the links into each place that is marked on the page."""
    for place in [each for each in page.findall(nodes.container) if "thumbnails" in each["classes"]]:
        for section in page.findall(nodes.section):
            # a section with sections of its own shows pictures there
            picture = next((each for each in section.findall(nodes.image) if _section(each) is section), None)
            if picture is not None:
                title = nodes.inline(text=section[0].astext())
                small = nodes.image(uri=picture["uri"], candidates=picture["candidates"], alt="")
                link = nodes.reference("", "", small, title, refid=section["ids"][0], internal=True)
                place += nodes.paragraph("", "", link)


def _section(node: nodes.Node) -> nodes.Node | None:
    while node is not None and not isinstance(node, nodes.section):
        node = node.parent
    return node


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_directive("thumbnails", Thumbnails)
    app.connect("doctree-resolved", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
