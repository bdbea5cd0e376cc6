"""Pictures for a page: axes by matplotlib, handed over as inline SVG that takes its colours and its font from the page.

Both axes of a logarithmic plot carry decimal logarithms, because errors such as 1e-997 are no floats.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import StringIO
from typing import Any
from xml.etree import ElementTree

from heavytop.report.printable import printable

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa4499", "#8c6d1f", "#555555")
"""Stand-ins that become the page's --c0, --c1, ..., which differ in light and dark."""
MARKERS = ("o", "s", "^", "D", "v", "P")
LABEL = "axis-label"
_INK, _GRID = "#000000", "#cccccc"
_SVG = "http://www.w3.org/2000/svg"
_LINK = "{http://www.w3.org/1999/xlink}href"
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, slots=True)
class Picture:
    """One plot: ``svg`` is markup; title and description are in it too, for those who do not see it.

    note: what the plot shows, in words under it.
    """

    title: str
    description: str
    svg: str
    note: str = ""


@contextmanager
def quiet_style() -> Iterator[None]:
    """The look of the page's pictures, without a reading of $ and \\ in names."""
    import matplotlib

    settings: Any = {
        "svg.fonttype": "none",
        "text.parse_math": False,
        "font.family": "DejaVu Sans",
        "font.size": 9.5,
        "axes.labelsize": 9.5,
        "xtick.labelsize": 9,
        "ytick.labelsize": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": _GRID,
        "grid.linewidth": 0.6,
        "lines.linewidth": 1.6,
        "lines.markersize": 3.6,
    }
    with matplotlib.rc_context(settings):
        yield


def new_axes(x: str, y: str, height: float = 2.8, left: float = 0.17) -> Any:
    """Axes of their own figure, 4.1 by ``height`` inches, with labels."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.1, height))
    FigureCanvasSVG(figure)
    bottom = 0.5 / height
    axes = figure.add_axes((left, bottom, 0.97 - left, 1 - bottom - 0.12 / height))
    axes.set_xlabel(x, gid=LABEL)
    axes.set_ylabel(y, gid=LABEL)
    axes.yaxis.set_label_coords((0.05 - left) / (0.97 - left), 0.5)
    return axes


def plain(name: str) -> str:
    """A name in which matplotlib reads no formula, and which XML can hold."""
    return printable(name).replace("$", r"\$")


def decades(axis: Any, ticks: int = 7) -> None:
    """Ticks 10⁻⁵, 1, 10, ... on an axis that carries decimal logarithms; 3.2·10⁻⁵ where it is a short one."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    axis.set_major_locator(MaxNLocator(ticks, integer=True, steps=[1, 2, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))


def _power(logarithm: float) -> str:
    exponent = math.floor(logarithm + 1e-6)
    mantissa = f"{10 ** (logarithm - exponent):.1f}"
    return power_of_ten(exponent) if mantissa == "1.0" else f"{mantissa}·{power_of_ten(exponent)}"


def power_of_ten(exponent: int) -> str:
    """10⁻⁵; 1, 10 and 100 as they are."""
    return str(10**exponent) if 0 <= exponent <= 2 else "10" + str(exponent).translate(_SUPERSCRIPT)


def document(figure: Any, **options: Any) -> str:
    """The figure as an SVG document: no date, no random ids, so that the same figure gives the same bytes."""
    import matplotlib

    file = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "heavytop"}):
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": "heavytop"}, **options)
    return file.getvalue()


def finish(axes: Any, title: str, description: str, name: str, note: str = "") -> Picture:
    """The axes as markup.  ``name``: an identifier that no other picture of the page has."""
    root = ElementTree.fromstring(document(axes.figure, transparent=True))
    return Picture(title, description, _inline(root, title, description, name), note)


def _inline(root: Any, title: str, description: str, name: str) -> str:
    ElementTree.register_namespace("", _SVG)
    for parent in list(root.iter()):
        for child in [c for c in parent if c.tag.rpartition("}")[2] in ("metadata", "style")]:
            parent.remove(child)
    used = _references(root)
    for element in root.iter():
        _restyle(element, used, name)
    for key in ("width", "height", "version"):
        root.attrib.pop(key, None)
    root.set("role", "img")
    root.set("aria-labelledby", f"{name}-title {name}-desc")
    for index, (tag, text) in enumerate((("title", title), ("desc", description))):
        child = ElementTree.Element(f"{{{_SVG}}}{tag}", {"id": f"{name}-{tag}"})
        child.text = printable(text)
        root.insert(index, child)
    markup = ElementTree.tostring(root, encoding="unicode")
    return re.sub(r">\s+<", "><", markup)


def _references(root: Any) -> set[str]:
    found: set[str] = set()
    for element in root.iter():
        found |= {value[1:] for key, value in element.items() if key == _LINK}
        found |= {match for value in element.attrib.values() for match in re.findall(r"url\(#([^)]+)\)", value)}
    return found


def _restyle(element: Any, used: set[str], name: str) -> None:
    """Ids of its own and only where needed, short numbers, the page's colours and font."""
    for key, value in list(element.items()):
        if key == "id":
            if value == LABEL:
                del element.attrib[key]
                element.set("class", LABEL)
            elif value in used:
                element.set(key, f"{name}-{value}")
            else:
                del element.attrib[key]
        elif key == _LINK:
            del element.attrib[key]
            element.set("href", f"#{name}-{value[1:]}")
        elif key in ("d", "x", "y", "points", "transform"):
            short = re.sub(r"-?\d+\.\d+", lambda match: f"{float(match[0]):.1f}".removesuffix(".0"), value)
            element.set(key, " ".join(short.split()))
        elif key == "clip-path":
            element.set(key, value.replace("#", f"#{name}-"))
        elif key == "style":
            element.set(key, _colours(re.sub(r"font-family:[^;]+;?\s*", "", value)))


def _colours(style: str) -> str:
    for index, colour in enumerate(COLOURS):
        style = style.replace(colour, f"var(--c{index})")
    return style.replace(_INK, "currentColor").replace(_GRID, "var(--grid)")


def spoken(parts: Sequence[str], most: int = 12) -> str:
    """Sentences of a description, not more than a listener can bear."""
    rest = len(parts) - most
    return " ".join([*parts[:most], *([f"And {rest} more."] if rest > 0 else [])])
