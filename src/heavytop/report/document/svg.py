"""Pictures for a page: axes by matplotlib as inline SVG with the colours and the font of the page.

Both axes of a logarithmic plot carry decimal logarithms, because errors such as 1e-997 are below the range of double.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import StringIO
from statistics import fmean
from typing import TYPE_CHECKING, Any, NamedTuple

from heavytop.display import printable
from heavytop.extras import require_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#aa4499", "#8c6d1f", "#555555")
"""Placeholders, replaced by --c0, --c1, ... of the page, which differ in light and dark mode."""
MARKERS = ("o", "s", "^", "D", "v", "P")
LABEL = "axis-label"
_GRID = "#cccccc"
_LABEL_SIZE = 8.5
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LEFT, _BOTTOM, _TOP = 0.7, 0.5, 0.12
"""Margins of the axes in inches."""
_WIDTH = 3.28
"""Width of the axes in inches, unless names beside them require a narrower one."""


@dataclass(frozen=True, slots=True)
class Picture:
    """One plot; title and description are its alternative text.

    name: an identifier unique on the page.  note: a description below the plot.
    svg: markup of the picture without its title.  wide: whether names stand beside its curves.
    """

    title: str
    description: str
    name: str
    axes: Any
    svg: str
    note: str = ""
    wide: bool = False


@contextmanager
def quiet_style() -> Iterator[None]:
    """The style of the page's pictures; $ and \\ in names are not parsed as mathematics."""
    require_extra("plots")
    import matplotlib

    settings: Any = {
        "svg.fonttype": "none",
        "pdf.fonttype": 42,
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


def new_figure(width: float, height: float) -> Figure:
    """A figure of ``width`` by ``height`` inches, without pyplot."""
    require_extra("plots")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def new_axes(x: str, y: str, height: float = 2.8, right: float = 0.22) -> Any:
    """Axes with labels in a new figure, ``height`` inches high.  right: inches for names of curves."""
    from matplotlib.figure import Figure

    axes_width = max(_WIDTH - right + 0.12, 2.2)
    width = _LEFT + axes_width + right
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((_LEFT / width, _BOTTOM / height, axes_width / width, 1 - (_BOTTOM + _TOP) / height))
    axes.set_xlabel(x, gid=LABEL)
    axes.set_ylabel(y, gid=LABEL)
    axes.yaxis.set_label_coords((0.2 - _LEFT) / axes_width, 0.5)
    return axes


def decades(axis: Axis, ticks: int = 7) -> None:
    """Ticks 10⁻⁵, 1, 10, ... on an axis of decimal logarithms; :func:`finish` makes it at least two decades long."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    axis.set_major_locator(MaxNLocator(ticks, integer=True, steps=[1, 2, 5, 10]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(round(value))))


def _two_decades(axes: Axes) -> None:
    """Widens the axes with ticks by :func:`decades` to at least two decades."""
    from matplotlib.ticker import FuncFormatter

    for name in ("x", "y"):
        low, high = getattr(axes, f"get_{name}lim")()
        logarithmic = isinstance(getattr(axes, f"{name}axis").get_major_formatter(), FuncFormatter)
        if logarithmic and high - low < 2:
            getattr(axes, f"set_{name}lim")((low + high) / 2 - 1, (low + high) / 2 + 1)


def power_of_ten(exponent: int) -> str:
    """10⁻⁵; 1, 10 and 100 without an exponent."""
    return str(10**exponent) if 0 <= exponent <= 2 else "10" + str(exponent).translate(_SUPERSCRIPT)


class End(NamedTuple):
    """The end of a curve on the axes, and its label: its name or its law."""

    text: str
    colour: str
    x: float
    y: float


def room(labels: Iterable[str]) -> float:
    """Inches needed for names beside the axes, for :func:`new_axes`."""
    return 0.25 + max(map(len, labels), default=0) * _LABEL_SIZE * 0.64 / 72


def _label_ends(axes: Any, ends: Sequence[End]) -> None:
    """Labels each curve at the right edge, with a thin line to its end; labels are moved so that none overlap."""
    low, high = sorted(axes.get_ylim())
    points = axes.get_position().height * axes.figure.get_figheight() * 72
    gap = 1.35 * _LABEL_SIZE * (high - low) / points
    leader = {"arrowstyle": "-", "lw": 0.6, "alpha": 0.6, "shrinkA": 0, "shrinkB": 3, "relpos": (0, 0.5)}
    ordered = sorted(ends, key=lambda end: end.y)
    for end, height in zip(ordered, apart([end.y for end in ordered], gap, low, high), strict=True):
        axes.annotate(
            printable(end.text),
            (end.x, end.y),
            (1.05, height),
            textcoords=axes.get_yaxis_transform(),
            color=end.colour,
            size=_LABEL_SIZE,
            va="center",
            annotation_clip=False,
            arrowprops=leader | {"color": end.colour},
        )


def apart(heights: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """``heights``, ascending, moved by the least amounts that make them ``gap`` apart; touching ones move as a block.

    They lie between ``low`` and ``high``, as far as there is room.
    """
    blocks: list[list[float]] = []
    for index, height in enumerate(heights):
        blocks.append([height - index * gap])
        while len(blocks) > 1 and fmean(blocks[-2]) > fmean(blocks[-1]):
            last = blocks.pop()
            blocks[-1] += last
    highest = high - gap * (len(heights) - 1)
    level = [min(max(fmean(block), low), highest) for block in blocks for _ in block]
    return [height + index * gap for index, height in enumerate(level)]


def document(figure: Any, salt: str = "heavytop", **options: Any) -> str:
    """The figure as an SVG document, without date and random ids, so that equal figures give equal bytes."""
    import matplotlib

    file = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": salt}):
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": "heavytop"}, **options)
    return file.getvalue()


def finish(axes: Any, title: str, description: str, name: str, note: str = "", ends: Sequence[End] = ()) -> Picture:
    """The axes as a picture.  name: an identifier unique on the page.  ends: of its curves."""
    _two_decades(axes)
    _label_ends(axes, ends)
    wide = bool(axes.figure.get_figwidth() > _WIDE)
    return Picture(title, printable(description), name, axes, _inline(axes.figure, name), note, wide)


_WIDE = 4.5
"""Inches beyond which a picture is wide."""


def _inline(figure: Any, name: str) -> str:
    """The content of the <svg> of a page: unique ids and only where needed, short numbers, the page's colours.

    The ids of clip paths and markers are hashes with ``name``; the others are numbered alike in every figure.
    """
    text = document(figure, salt=name, transparent=True)
    text = text[text.index(">", text.index("<svg ")) + 1 : text.rindex("</svg>")]
    text = re.sub(r"<metadata>.*?</metadata>|<style .*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(f'<g id="{LABEL}"', f'<g class="{LABEL}"', text)
    text = re.sub(r'<g id="[A-Za-z][\w.]*_\d+"', "<g", text)
    text = re.sub(r' (d|x|y|points|transform)="([^"]*)"', _shorter, text)
    text = re.sub(r"font-family: [^;\"]+; ", "", text)
    for index, colour in enumerate(COLOURS):
        text = text.replace(colour, f"var(--c{index})")
    text = text.replace("#000000", "currentColor").replace(_GRID, "var(--grid)")
    return re.sub(r">\s+<", "><", text).strip()


def _shorter(match: re.Match[str]) -> str:
    short = re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.1f}".removesuffix(".0"), match[2])
    return f' {match[1]}="{" ".join(short.split())}"'


def spoken(parts: Sequence[str], most: int = 12) -> str:
    """The first sentences of a description, and the number of the others."""
    remaining = len(parts) - most
    return " ".join([*parts[:most], *([f"And {remaining} more."] if remaining > 0 else [])])
