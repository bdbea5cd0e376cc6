"""Figs 2-8 of the paper as it defines them, and the same motions with the truth beside the claim; SVG and PNG.

matplotlib is drawn without a display and without a date, so that the same program gives the same files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy

from heavytop.claims.ershkov import Branch, PartialCase
from heavytop.measure.parting import parting
from heavytop.report.curves import (
    PAPER_FIGURES,
    Curves,
    PaperFigure,
    claim_curves,
    gyrostat_curves,
    true_curves,
)
from heavytop.report.svg import document
from heavytop.top.equations import GYROSTAT
from heavytop.top.integrals import gyrostat_energy

# Okabe and Ito's colours, told apart by any eye; line styles say the same again
ORANGE, BLUE, VERMILION, GREEN = "#E69F00", "#0072B2", "#D55E00", "#009E73"
_SYMBOLS = {"phi": "φ", "theta": "θ", "psi": "ψ"}
_FORMULAS = {
    "phi": r"$\varphi=\arctan\sqrt{\alpha/u^2-1}$",
    "theta": r"$\theta=\arccos\sqrt{1-u^2/\alpha}$",
    "psi": r"$\psi=(I_1/I_3)\,\alpha t+\frac{1}{2}\ln\frac{\sqrt{\alpha}+u}{\sqrt{\alpha}-u}$",
}
_U = r"$u=\sqrt{\alpha}\,\frac{e^{-A\sqrt{\alpha}\,t}-1}{e^{-A\sqrt{\alpha}\,t}+1}$"
RATIOS = (2, 6)
_BRANCHES: dict[Branch, str] = {"printed": "as printed", "smooth": "smooth branch"}
_LINES: dict[Branch, tuple[str, Any]] = {"printed": (VERMILION, (0, (1, 1))), "smooth": (GREEN, "-.")}


FIGURES = len(PAPER_FIGURES) + len(RATIOS) + 1


def draw_figures(directory: Path, progress: Callable[[], None] = lambda: None) -> list[Path]:
    """The files written into ``directory``: each figure as SVG and as PNG (at least 800 px wide).

    progress: called after each of the :data:`FIGURES` figures.
    """
    directory.mkdir(parents=True, exist_ok=True)
    drawings: list[tuple[str, Callable[[], Any]]] = [
        *((f"fig{figure.number}", partial(_paper_figure, figure)) for figure in PAPER_FIGURES),
        *((f"truth-ratio{ratio}", partial(_comparison, ratio)) for ratio in RATIOS),
        ("momentum-sphere", _portrait),
    ]
    files: list[Path] = []
    with _quiet_style():
        for name, draw in drawings:
            files += _save(draw(), directory / name)
            progress()
    return files


@contextmanager
def _quiet_style() -> Iterator[None]:
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


def _new(width: float, height: float) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Any, stem: Path) -> list[Path]:
    svg, png = stem.with_suffix(".svg"), stem.with_suffix(".png")
    svg.write_text(document(figure), "utf-8")
    figure.savefig(png, dpi=110, metadata={"Software": "heavytop"})
    return [svg, png]


def _paper_figure(spec: PaperFigure) -> Any:
    """One of Figs 2-8: the printed formula, its parameters, and a warning where they contradict each other."""
    figure = _new(8, 5)
    axes = figure.add_subplot()
    # beyond A t = 37 the printed logarithm loses every digit of a double
    span = min(4, 24 / spec.a)
    t = numpy.linspace(-span, span, 801)
    t = t[t != 0] if spec.angle == "phi" else t
    axes.plot(t, spec.values(t), color=BLUE)
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


def _comparison(ratio: int) -> Any:
    """φ, θ, ψ and Ω of the claim, the gyrostat and the true motion from the same data at t = 0."""
    case = PartialCase(Fraction(1), Fraction(1), Fraction(1, ratio))
    span = Fraction(6, ratio - 1) + 2
    times = [span * index / 200 for index in range(-200, 201)]
    truth, method = true_curves(case, times)
    drawn = (
        ("true motion of the heavy top", truth, BLUE, "-", 2.4),
        ("gyrostat: what the formulas solve", gyrostat_curves(case.solves, times), ORANGE, "--", 2.4),
        ("claim as printed", claim_curves(case, times), VERMILION, ":", 2.4),
    )
    parted = {branch: parting(case, times[-1], branch) for branch in _BRANCHES}
    figure = _new(10, 6.2)
    grid = figure.subplots(2, 3, sharex=True)
    names = ("φ (rad)", "θ (rad)", "ψ (rad)", "Ω1", "Ω2", "Ω3")
    for index, (axes, name) in enumerate(zip(grid.flat, names, strict=True)):
        for label, curves, colour, style, width in drawn:
            axes.plot(curves.times, _column(curves, index), style, color=colour, lw=width, label=label)
        for branch, found in parted.items():
            if found:
                colour, dashes = _LINES[branch]
                label = f"{_BRANCHES[branch]}: Ω off by 1 % of α at t = {float(found.time):.4f}"
                axes.axvline(float(found.time), color=colour, lw=1.2, ls=dashes, label=label)
        axes.set_title(name, loc="left")
    for axes in grid[1]:
        axes.set_xlabel("t")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(f"Claim, gyrostat and truth: $I_1=I_2$, $I_1/I_3={ratio}$, $\\alpha=1$; truth: {method}")
    return figure


def _column(curves: Curves, index: int) -> Any:
    return curves.angles[:, index] if index < 3 else curves.states[:, index - 3]


def _portrait() -> Any:
    """The momentum sphere of the gyrostat with its homoclinic orbit, and the true homoclinic orbit beside it."""
    case = PartialCase(Fraction(1), Fraction(1), Fraction(1, 2))
    times = [Fraction(index, 10) for index in range(-140, 141)]
    figure = _new(10, 5.6)
    left, right = (figure.add_subplot(1, 2, place, projection="3d") for place in (1, 2))
    for segment in _levels(case):
        left.plot(*segment, color="#999999", lw=0.7)
    moments = numpy.array([float(moment) for moment in case.solves.top.inertia])
    orbit = gyrostat_curves(case.solves, times).states[:, :3] * moments
    left.plot(*orbit.T, color=ORANGE, lw=2.6, label="homoclinic orbit of the gyrostat")
    true = true_curves(case, times)[0].states[:, :3] * moments
    length = float(case.alpha * case.i1)
    for segment in _sphere(length):
        right.plot(*segment, color="#bbbbbb", lw=0.5)
    right.plot(*true.T, color=BLUE, lw=2.6, label="homoclinic orbit of the heavy top")
    titles = ("gyrostat: |M| = C0, level lines of its energy", "heavy top: |M| is not constant (sphere: C0)")
    for axes, title in zip((left, right), titles, strict=True):
        axes.scatter([0], [length], [0], color=VERMILION, s=40, depthshade=False, label="the saddle M = (0, C0, 0)")
        axes.set_title(title, fontsize=11)
        axes.set(xlabel="M1", ylabel="M2", zlabel="M3")
        axes.set_box_aspect((1, 1, 1))
        axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
        axes.set_xticks([-1, 0, 1])
        axes.set_yticks([-1, 0, 1])
        axes.set_zticks([-1, 0, 1])
        axes.view_init(elev=25, azim=50)
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.2), frameon=False)
    figure.suptitle("$I_1=I_2=2I_3$, $\\alpha=1$, $I_1=1$")
    return figure


def _levels(case: PartialCase) -> list[Any]:
    """Level lines of the gyrostat's energy on the sphere |M| = C0."""
    from contourpy import contour_generator

    motion = case.solves
    parameters = GYROSTAT.parameters(motion.top, motion.start)
    moments = [float(moment) for moment in parameters.inertia]
    p = parameters._replace(inertia=moments, rotor=float(parameters.rotor))
    length = float(case.alpha * case.i1)
    turn, height = numpy.meshgrid(numpy.linspace(-numpy.pi, numpy.pi, 361), numpy.linspace(-1, 1, 241))

    def point(turn: Any, height: Any) -> tuple[Any, Any, Any]:
        across = numpy.sqrt(numpy.maximum(0, 1 - height * height))
        return length * across * numpy.cos(turn), length * height, length * across * numpy.sin(turn)

    state = [m / i for m, i in zip(point(turn, height), moments, strict=True)]
    lines = contour_generator(turn, height, gyrostat_energy(p, state))
    low, high = float(gyrostat_energy(p, state).min()), float(gyrostat_energy(p, state).max())
    found = [line for level in numpy.linspace(low, high, 14)[1:-1] for line in lines.lines(level)]
    return [point(*numpy.asarray(line).T) for line in found]


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
