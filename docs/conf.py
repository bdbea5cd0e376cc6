"""How Sphinx builds the site; ``python docs/build.py`` calls it, with every warning an error."""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

from docutils import nodes
from pygments.lexers.special import TextLexer

import heavytop

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tools")]
# MathJax with its fonts in one file; the extension that the package is would copy 20 MB
_MATHJAX = distribution("sphinx-mathjax-offline").locate_file("sphinx-mathjax-offline/static/mathjax/tex-svg.js")
URLS = tomllib.loads((HERE.parent / "pyproject.toml").read_text("utf-8"))["project"]["urls"]

project = "heavytop"
author = copyright = "The heavytop authors"
version = release = heavytop.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "myst_nb",
    "sphinx_copybutton",
    "thumbnails",
]
exclude_patterns = ["_build", "**.ipynb_checkpoints"]
toc_object_entries = False
html_theme = "furo"
html_title = "heavytop"
html_theme_options: dict[str, Any] = {"navigation_with_keys": True}
html_theme_options["footer_icons"] = [{"name": name, "url": URLS[name], "html": name, "class": ""} for name in URLS]
if re.match(r"https://(github|gitlab|bitbucket)\.", URLS.get("Source", "")):  # hosts whose pages the theme knows
    html_theme_options |= {"source_repository": URLS["Source"], "source_branch": "main", "source_directory": "docs/"}
html_static_path = ["_static", str(_MATHJAX)]
mathjax_path = "tex-svg.js"
# what a page prints is not for pasting
copybutton_selector = "div.highlight:not(.highlight-text .highlight, .output .highlight) pre"
html_css_files = ["site.css"]
html_show_copyright = False
html_copy_source = False
default_role = "code"
smartquotes = False
pygments_style = "default"

myst_enable_extensions = ["deflist", "dollarmath", "colon_fence", "attrs_block"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_cache_path = str(HERE / "_build" / "notebooks")
nb_execution_timeout = 60
nb_execution_raise_on_error = True
nb_merge_streams = True
nb_execution_show_tb = True

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Source", "notes_style")]

nitpicky = True
# of other packages no inventory is at hand offline; of the inner rooms the pages show none
nitpick_ignore_regex = [
    ("py:.*", r"(fractions|decimal|collections|os|pathlib|typing|enum|numpy|np|pandas|msgspec|NDArray)\b.*"),
    ("py:.*", r"(Any|Callable|Iterable|Sequence|Fraction|Decimal|Path|PathLike|Enum|TypeAlias|SupportsIndex)"),
    ("py:.*", r"(Struct|Numbers?|Motion|Crossings|PoincareSection|PowerCurves|SpacedErrors|Rotation)"),
    ("py:.*", r"(Axes(3D)?|FuncAnimation)"),
    ("py:.*", r"heavytop\.[a-z_]+\..*"),
]

_MARKUP = re.compile(r"(``.*?``|`[^`]*`)")
_CONSTRUCTED = {"HeavyTop", "State", "Body", "Attitude", "Integrator", "Precision", "Request", "Solution"}
"""Classes whose objects a user makes."""


def plain_bars(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """The bars of |γ| are no markup."""
    for place, line in enumerate(lines):
        parts = _MARKUP.split(line)
        lines[place] = "".join(part if part.startswith("`") else part.replace("|", "\\|") for part in parts)


def without_constructor(app: Any, what: str, name: str, *rest: Any) -> tuple[str, None] | None:
    """No arguments of a class that only the program makes objects of."""
    return ("", None) if what == "class" and name.rpartition(".")[2] not in _CONSTRUCTED else None


def public_name(app: Any, env: Any, node: Any, shown: Any) -> Any:
    """A link to what stands in a room of the program, by its public name."""
    parts = node["reftarget"].split(".")
    for name in (".".join(["heavytop", *parts[-length:]]) for length in (1, 2)):
        if parts[0] == "heavytop" and name in env.domains.python_domain.objects:
            text = name.removeprefix("heavytop.") + ("()" if node["reftype"] in ("func", "meth") else "")
            shown = nodes.literal("", text) if isinstance(shown, nodes.literal) else nodes.Text(text)
            return env.domains.python_domain.resolve_xref(env, node["refdoc"], app.builder, "obj", name, node, shown)
    return None


def setup(app: Any) -> None:
    """Called by Sphinx; before napoleon, whose own markup has bars."""
    app.connect("autodoc-process-docstring", plain_bars, priority=100)
    app.connect("autodoc-process-signature", without_constructor)
    app.connect("missing-reference", public_name)
    app.add_lexer("csv", TextLexer)
