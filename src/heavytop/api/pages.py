"""The pages of the documentation as text, from an installed wheel or a checkout."""

from __future__ import annotations

import re
from pathlib import Path

from heavytop.api.formulas import plain_formula
from heavytop.errors import InputError, meant, quoted

_INSTALLED = Path(__file__).parents[1] / "docs"
"""The folder in which hatch_build.py stores the pages of a wheel."""
_CHECKOUT = Path(__file__).parents[3] / "docs"
_OF_THE_SITE = frozenset({"api", "audited-claims", "command-line", "contributing", "gallery", "index"})
"""Pages generated with the site."""
_TABLE = "(The site has a table here; the command above prints its numbers.)\n"


def topics() -> dict[str, str]:
    """The title of each page by the name of its file; raises InputError if no page is installed."""
    return {name: _title(path.read_text("utf-8")) for name, path in sorted(_files().items())}


def page(topic: str) -> str:
    """A page in Markdown, with formulas as text and without tables of the site; raises InputError for another topic."""
    files, name = _files(), topic.removeprefix("docs/").removesuffix(".md")
    if name not in files:
        remedy = meant(name, files) + "`heavytop docs` lists the topics."
        raise InputError(f"topic must name a page; got {quoted(topic)}.", remedy)
    return re.sub(
        r"\$\$\n(.*?)\$\$",
        lambda formula: f"```text\n{plain_formula(formula[1])}\n```",
        re.sub(r"```\{include\} .*\n```\n", _TABLE, files[name].read_text("utf-8")),
        flags=re.DOTALL,
    )


def _files() -> dict[str, Path]:
    folder = _INSTALLED if _INSTALLED.is_dir() else _CHECKOUT
    paths = {path.stem: path for part in (folder, folder / "tutorials") for path in part.glob("*.md")}
    if not paths:
        raise InputError("The documentation is not installed.", "Install heavytop from a wheel or from its checkout.")
    return {name: path for name, path in paths.items() if name not in _OF_THE_SITE}


def _title(text: str) -> str:
    return next(line.removeprefix("# ") for line in text.splitlines() if line.startswith("# "))
