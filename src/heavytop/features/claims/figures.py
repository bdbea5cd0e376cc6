"""Figs 2-8 of the paper as it defines them, and the same motions with the truth beside the claim; SVG and PNG.

matplotlib is drawn without a display and without a date, so that the same program gives the same files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy

from heavytop.extras import require_extra
from heavytop.features.claims.claim_error import Compared, Drawings, PaperCurve, Portrait
from heavytop.features.claims.library.ershkov import Branch
from heavytop.report.document.svg import document, new_figure

# Okabe and Ito's colours, distinguished by any eye; line styles say the same again
ORANGE, BLUE, VERMILION, GREEN = "#E69F00", "#0072B2", "#D55E00", "#009E73"
_SYMBOLS = {"phi": "φ", "theta": "θ", "psi": "ψ"}
_FORMULAS = {
    "phi": r"$\varphi=\arctan\sqrt{\alpha/u^2-1}$",
    "theta": r"$\theta=\arccos\sqrt{1-u^2/\alpha}$",
    "psi": r"$\psi=(I_1/I_3)\,\alpha t+\frac{1}{2}\ln\frac{\sqrt{\alpha}+u}{\sqrt{\alpha}-u}$",
}
_U = r"$u=\sqrt{\alpha}\,\frac{e^{-A\sqrt{\alpha}\,t}-1}{e^{-A\sqrt{\alpha}\,t}+1}$"
_BRANCHES: dict[Branch, str] = {"printed": "as printed", "smooth": "smooth branch"}
_LINES: dict[Branch, tuple[str, Any]] = {"printed": (VERMILION, (0, (1, 1))), "smooth": (GREEN, "-.")}


def draw_figures(drawings: Drawings, directory: Path, progress: Callable[[], None] = lambda: None) -> list[Path]:
    """The files written into ``directory``: each figure as SVG and as PNG (at least 800 px wide).

    progress: called after each figure.
    """
    files: list[Path] = []
    with _quiet_style():
        directory.mkdir(parents=True, exist_ok=True)
        for name, figure in _figures(drawings):
            files += _save(figure, directory / name)
            progress()
    return files


def _figures(drawings: Drawings) -> Iterator[tuple[str, Any]]:
    """The name of each file and what it shows."""
    for paper in drawings.papers:
        yield f"fig{paper.figure.number}", _paper_figure(paper)
    for compared in drawings.comparisons:
        yield f"truth-ratio{compared.ratio}", _comparison(compared)
    for portrait in drawings.portrait:
        yield "momentum-sphere", _portrait(portrait)


@contextmanager
def _quiet_style() -> Iterator[None]:
    require_extra("plots")
    import matplotlib

    settings: Any = {
        "font.size": 11,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.color": "#dddddd",
        "lines.linewidth": 2,
    }
    with matplotlib.rc_context(settings):
        yield


def _save(figure: Any, stem: Path) -> list[Path]:
    svg, png = stem.with_suffix(".svg"), stem.with_suffix(".png")
    svg.write_text(document(figure), "utf-8")
    figure.savefig(png, dpi=110, metadata={"Software": "heavytop"})
    return [svg, png]


def _paper_figure(paper: PaperCurve) -> Any:
    """A figure of the paper, 2 to 8: the formula printed, its parameters, a warning where they disagree."""
    figure = new_figure(8, 5)
    axes = figure.add_subplot()
    spec = paper.figure
    axes.plot(paper.times, paper.values, color=BLUE)
    axes.set_xlabel("t")
    axes.set_ylabel(f"{_SYMBOLS[spec.angle]} (rad)")
    stated = "" if spec.ratio is None else f"$I_1/I_3={spec.ratio}$, "
    axes.set_title(
        f"Fig. {spec.number} of the paper, Eqs. ({spec.equation}): {stated}$A={spec.a}$, $\\alpha=1$", loc="left"
    )
    formula = f"{_FORMULAS[spec.angle]},   {_U}"
    if spec.consistent:
        formula += f"\n$A={spec.a}$ means $I_1/I_3={spec.implied_ratio}$, since $A=\\sqrt{{\\alpha}}\\,(I_1/I_3-1)$"
    else:
        forced = (spec.ratio or 0) - 1
        slope = (spec.ratio or 0) - spec.a / 2
        note = (
            f"Inconsistent parameters: I1/I3 = {spec.ratio} forces A = {forced}, not {spec.a}.\n"
            f"As printed this is the line ψ = {slope:g} t, the motion of no top."
        )
        box = {"facecolor": "white", "edgecolor": VERMILION, "boxstyle": "round"}
        axes.text(0.03, 0.95, note, transform=axes.transAxes, color=VERMILION, va="top", fontsize=10, bbox=box)
        low, high = axes.get_ylim()
        if high - low < 1:
            low, high = -1.0, 1.0
        axes.set_ylim(low, high + 0.35 * max(high - low, 1))
    figure.supxlabel(formula, fontsize=11)
    return figure


def _comparison(compared: Compared) -> Any:
    """φ, θ, ψ and Ω of the claim, the gyrostat and the true motion from the same data at t = 0."""
    drawn = (
        ("true motion of the heavy top", compared.truth, BLUE, "-", 2.4),
        ("gyrostat: what the formulas solve", compared.gyrostat, ORANGE, "--", 2.4),
        ("claim as printed", compared.claim, VERMILION, ":", 2.4),
    )
    figure = new_figure(10, 6.2)
    grid = figure.subplots(2, 3, sharex=True)
    names = ("φ (rad)", "θ (rad)", "ψ (rad)", "Ω1", "Ω2", "Ω3")
    for index, (axes, name) in enumerate(zip(grid.flat, names, strict=True)):
        for label, curves, colour, style, width in drawn:
            column = curves.angles[:, index] if index < 3 else curves.states[:, index - 3]
            axes.plot(curves.times, column, style, color=colour, lw=width, label=label)
        for branch, divergence in compared.parted.items():
            if divergence:
                colour, dashes = _LINES[branch]
                label = f"{_BRANCHES[branch]}: Ω off by 1 % of α at t = {float(divergence.time):.4f}"
                axes.axvline(float(divergence.time), color=colour, lw=1.2, ls=dashes, label=label)
        axes.set_title(name, loc="left")
    for axes in grid[1]:
        axes.set_xlabel("t")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(
        f"Claim, gyrostat and truth: $I_1=I_2$, $I_1/I_3={compared.ratio}$, $\\alpha=1$; truth: {compared.method}"
    )
    return figure


def _portrait(portrait: Portrait) -> Any:
    """The momentum sphere of the gyrostat with its homoclinic orbit, and the true homoclinic orbit beside it."""
    figure = new_figure(10, 5.6)
    left, right = (figure.add_subplot(1, 2, index, projection="3d") for index in (1, 2))
    for segment in portrait.levels:
        left.plot(*segment, color="#999999", lw=0.7)
    left.plot(*portrait.gyrostat.T, color=ORANGE, lw=2.6, label="homoclinic orbit of the gyrostat")
    length = portrait.length
    for segment in _sphere(length):
        right.plot(*segment, color="#bbbbbb", lw=0.5)
    right.plot(*portrait.heavy_top.T, color=BLUE, lw=2.6, label="homoclinic orbit of the heavy top")
    titles = ("gyrostat: |M| = C0, level lines of its energy", "heavy top: |M| is not constant (sphere: C0)")
    for axes, title in zip((left, right), titles, strict=True):
        axes.scatter([0], [length], [0], color=VERMILION, s=40, depthshade=False, label="the saddle M = (0, C0, 0)")
        axes.set_title(title, fontsize=11)
        axes.set(xlabel="M1", ylabel="M2", zlabel="M3")
        axes.set_box_aspect((1, 1, 1))
        axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
        axes.set(xticks=[-1, 0, 1], yticks=[-1, 0, 1], zticks=[-1, 0, 1])
        axes.view_init(elev=25, azim=50)
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.2), frameon=False)
    figure.suptitle("$I_1=I_2=2I_3$, $\\alpha=1$, $I_1=1$")
    return figure


def _sphere(length: float) -> list[Any]:
    """Meridians and parallels about axis 2."""
    angles = numpy.linspace(0, 2 * numpy.pi, 121)
    circles = [
        (
            length * numpy.sin(angles) * numpy.cos(t),
            length * numpy.cos(angles),
            length * numpy.sin(angles) * numpy.sin(t),
        )
        for t in numpy.linspace(0, numpy.pi, 7)[:-1]
    ]
    for height in (-0.5, 0.0, 0.5):
        across = length * numpy.sqrt(1 - height * height)
        circles.append(
            (across * numpy.cos(angles), numpy.full_like(angles, length * height), across * numpy.sin(angles))
        )
    return circles
