"""Draw the conventions of attitudes: python tools/attitude_figure.py [--out docs/attitude.svg]

Space axes, body axes turned by R = R_z(a) R_x(b) R_z(c), and the centre of mass, in a parallel projection.
"""

import argparse
import math
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from heavytop.top.attitude import rotated, rows_of_euler

_ANGLES = (math.radians(-15), math.radians(40), math.radians(30))
_SPACE, _BODY, _POINT = "#6e6e6e", "#0072b2", "#d55e00"


def flat(v: Any) -> tuple[float, float]:
    """A point of space on the paper: seen from the front right, a little from above."""
    x, y, z = v
    a, b = math.radians(-50), math.radians(22)
    right = -math.sin(a) * x + math.cos(a) * y
    back = math.cos(a) * x + math.sin(a) * y
    return right, z * math.cos(b) - back * math.sin(b)


def arrow(axes: Any, end: Any, name: str, color: str, shift: tuple[float, float]) -> None:
    """An arrow from the pivot, with its name at the end."""
    x, y = flat(end)
    axes.annotate(
        "", (x, y), (0, 0), arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2, "shrinkA": 0, "shrinkB": 0}
    )
    axes.text(x + shift[0], y + shift[1], name, color=color, fontsize=12, ha="center", va="center")


def draw() -> Figure:
    """The figure."""
    figure = Figure(figsize=(7.2, 3.6))
    axes = figure.add_axes((0.01, 0.01, 0.98, 0.98))
    rows = rows_of_euler("ZXZ", _ANGLES, math)
    for k, (name, shift) in enumerate((("$e_x$", (-0.08, -0.06)), ("$e_y$", (0.1, 0.0)), ("$e_z$  up", (0.16, 0.05)))):
        arrow(axes, [1.15 * (i == k) for i in range(3)], name, _SPACE, shift)
    for k, shift in enumerate(((0.08, -0.07), (0.1, 0.03), (-0.02, 0.09))):
        body = rotated(rows, [float(i == k) for i in range(3)])
        arrow(axes, [1.05 * value for value in body], f"body {k + 1}", _BODY, shift)
    point = rotated(rows, (0.55, 0.55, 0.3))
    x, y = flat(point)
    axes.plot([0, x], [0, y], color=_POINT, lw=1.5, ls="--")
    axes.plot([x], [y], "o", color=_POINT, ms=8)
    axes.text(x + 0.6, y + 0.02, "$R\\,p$: centre of mass", color=_POINT, fontsize=11, ha="center")
    axes.annotate("", (x, y - 0.42), (x, y), arrowprops={"arrowstyle": "-|>", "color": _POINT, "lw": 1.5})
    axes.text(x - 0.02, y - 0.47, "$m\\,g$", color=_POINT, fontsize=11, ha="center", va="top")
    axes.plot([0], [0], "o", color="black", ms=6)
    axes.text(0.06, -0.1, "pivot", fontsize=11)
    said = (
        "$v_{space} = R\\,v_{body}$",
        "rows of $R$:  $\\xi$, $\\gamma\\times\\xi$, $\\gamma$",
        "$= e_x, e_y, e_z$ in body axes",
        "$q = (w, x, y, z)$,  $v_{space} = q\\,v_{body}\\,\\bar q$",
        'Euler "ZXZ":  $R = R_z(a)\\,R_x(b)\\,R_z(c)$',
        "$\\Omega_{space} = R\\,\\Omega$",
    )
    for k, text in enumerate(said):
        axes.text(1.45, 1.1 - 0.17 * k, text, fontsize=11, color="#333333")
    axes.set_xlim(-1.25, 2.95)
    axes.set_ylim(-0.75, 1.3)
    axes.set_aspect("equal")
    axes.axis("off")
    figure.patch.set_facecolor("white")
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/attitude.svg"))
    FigureCanvasSVG(draw()).print_svg(parser.parse_args().out, metadata={"Date": None})


if __name__ == "__main__":
    main()
