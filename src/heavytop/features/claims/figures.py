"""Figs 2-8 of the paper as it defines them, and the same motions with the true motion; SVG and PNG.

matplotlib draws without a display and without a date, so that the same program gives the same files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import NDArray

from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.enclosure.run import Validated
from heavytop.extras import require_extra
from heavytop.features.claims.claim_error import divergence_time
from heavytop.features.claims.library import ershkov
from heavytop.features.claims.library.ershkov import Branch, PartialCase
from heavytop.precision import Array
from heavytop.report.document.svg import document, new_figure
from heavytop.top.attitude import euler_angles, perpendicular, unwrap
from heavytop.top.equations import GYROSTAT, gyrostat_energy

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
_CURVE_BITS = 64


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """A figure of the paper, 2 to 8: ``a`` is A, ``ratio`` is I1/I3 where the paper states it; α = 1 throughout."""

    number: int
    angle: str
    equation: str
    a: int
    ratio: int | None = None

    @property
    def implied_ratio(self) -> int:
        """I1/I3 = 1 + A/√α, which (6.2) forces."""
        return 1 + self.a

    @property
    def consistent(self) -> bool:
        """False where the paper states an I1/I3 that its A excludes."""
        return self.ratio in (None, self.implied_ratio)

    @property
    def times(self) -> Any:
        """Times of the curve, where the printed formula has a value."""
        # beyond A t = 37 the printed logarithm loses every digit of a double
        span = min(4, 24 / self.a)
        t = numpy.linspace(-span, span, 801)
        return t[t != 0] if self.angle == "phi" else t

    def values(self, t: Any) -> Any:
        """The angle at the times ``t``, with u of (4.2) for ψ and u = √Ω2 for φ and θ, as printed."""
        u = ershkov.u(self.a, 1.0, t, numpy)
        with numpy.errstate(divide="ignore"):
            if self.angle == "phi":
                return ershkov.phi_of_6_1(1.0, numpy.sqrt(u * u), numpy)
            if self.angle == "theta":
                return ershkov.theta_of_6_1(1.0, numpy.sqrt(u * u), numpy)
        return ershkov.psi(float(self.ratio or self.implied_ratio), 1.0, 1.0, u, t, numpy)


PAPER_FIGURES = (
    PaperFigure(2, "phi", "6.1", 5),
    PaperFigure(3, "phi", "6.1", 1),
    PaperFigure(4, "theta", "6.1", 5),
    PaperFigure(5, "theta", "6.1", 1),
    PaperFigure(6, "psi", "6.2", 1, 5),
    PaperFigure(7, "psi", "6.2", 9, 5),
    PaperFigure(8, "psi", "6.2", 10, 5),
)


@dataclass(frozen=True, slots=True)
class Curves:
    """One motion in time: states (n, 6) and angles (n, 3) = (φ, θ, ψ), continuous."""

    times: Array
    states: NDArray[numpy.float64]
    angles: NDArray[numpy.float64]


def draw_figures(directory: Path, progress: Callable[[], None] = lambda: None) -> list[Path]:
    """The files written into ``directory``: each figure as SVG and as PNG (at least 800 px wide).

    progress: called after each figure.
    """
    files: list[Path] = []
    with _quiet_style():
        directory.mkdir(parents=True, exist_ok=True)
        for name, drawn in FIGURES.items():
            figure, (svg, png) = drawn(), (directory / f"{name}.{kind}" for kind in ("svg", "png"))
            svg.write_text(document(figure), "utf-8")
            figure.savefig(png, dpi=110, metadata={"Software": "heavytop"})
            files += [svg, png]
            progress()
    return files


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


def _paper_figure(spec: PaperFigure) -> Any:
    """A figure of the paper, 2 to 8: the formula printed, its parameters, a warning where they disagree."""
    figure = new_figure(8, 5)
    axes = figure.add_subplot()
    axes.plot(spec.times, spec.values(spec.times), color=BLUE)
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
    """φ, θ, ψ and Ω of claim, gyrostat and true motion from the same data at t = 0, for I1/I3 = ``ratio``."""
    case = PartialCase(Fraction(1), Fraction(1), Fraction(1, ratio))
    span = Fraction(6, ratio - 1) + 2
    times = [span * index / 200 for index in range(-200, 201)]
    truth, method = true_curves(case, times)
    drawn = (
        ("true motion of the heavy top", truth, BLUE, "-", 2.4),
        ("gyrostat: what the formulas solve", exact_curves(case.solves, times), ORANGE, "--", 2.4),
        ("claim as printed", claim_curves(case, times), VERMILION, ":", 2.4),
    )
    divergences = {branch: divergence_time(case, times[-1], branch) for branch in _BRANCHES}
    figure = new_figure(10, 6.2)
    grid = figure.subplots(2, 3, sharex=True)
    names = ("φ (rad)", "θ (rad)", "ψ (rad)", "Ω1", "Ω2", "Ω3")
    for index, (axes, name) in enumerate(zip(grid.flat, names, strict=True)):
        for label, curves, colour, style, width in drawn:
            column = curves.angles[:, index] if index < 3 else curves.states[:, index - 3]
            axes.plot(curves.times, column, style, color=colour, lw=width, label=label)
        for branch, divergence in divergences.items():
            if divergence:
                colour, dashes = _LINES[branch]
                label = f"{_BRANCHES[branch]}: Ω off by 1 % of α at t = {float(divergence.time):.4f}"
                axes.axvline(float(divergence.time), color=colour, lw=1.2, ls=dashes, label=label)
        axes.set_title(name, loc="left")
    for axes in grid[1]:
        axes.set_xlabel("t")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle(f"Claim, gyrostat and truth: $I_1=I_2$, $I_1/I_3={ratio}$, $\\alpha=1$; truth: {method}")
    return figure


def _portrait() -> Any:
    """The momentum sphere of the gyrostat with its homoclinic orbit, and the homoclinic orbit of the heavy top."""
    case = PartialCase(Fraction(1), Fraction(1), Fraction(1, 2))
    times = [Fraction(index, 10) for index in range(-140, 141)]
    moments = numpy.array([float(moment) for moment in case.solves.top.inertia])
    gyrostat, heavy_top = exact_curves(case.solves, times), true_curves(case, times)[0]
    figure = new_figure(10, 5.6)
    left, right = (figure.add_subplot(1, 2, index, projection="3d") for index in (1, 2))
    for segment in _levels(case):
        left.plot(*segment, color="#999999", lw=0.7)
    left.plot(*(gyrostat.states[:, :3] * moments).T, color=ORANGE, lw=2.6, label="homoclinic orbit of the gyrostat")
    length = float(case.alpha * case.i1)
    for segment in _sphere(length):
        right.plot(*segment, color="#bbbbbb", lw=0.5)
    right.plot(*(heavy_top.states[:, :3] * moments).T, color=BLUE, lw=2.6, label="homoclinic orbit of the heavy top")
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


def _levels(case: PartialCase) -> list[tuple[Array, Array, Array]]:
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
    line = [line for level in numpy.linspace(low, high, 14)[1:-1] for line in lines.lines(level)]
    return [point(*numpy.asarray(line).T) for line in line]


def claim_curves(case: PartialCase, times: list[Fraction]) -> Curves:
    """The claim as printed: u = √Ω2, positive roots and arctan."""
    t: Any = numpy.array([float(time) for time in times])
    i1, i3, c1 = float(case.i1), float(case.i3), float(case.c1)
    with numpy.errstate(divide="ignore"):
        v = ershkov.partial_case(i1, i3, c1, t, numpy, "printed")
    # at t = 0 (4.5) divides by 0 and arctan takes it to π/2; the radicand of θ can fall below 0 by rounding
    return Curves(t, numpy.stack([*v.omega, *v.gamma], axis=1), numpy.stack([v.phi, v.theta, v.psi], axis=1))


def true_curves(case: PartialCase, times: list[Fraction]) -> tuple[Curves, str]:
    """The heavy top from the claim's own data at t = 0, and the method: closed form for I1 = 2 I3, else enclosed."""
    if case.i1 == 2 * case.i3:
        return exact_curves(DeloneHomoclinic(case.alpha, case.i1), times), "closed form"
    gyrostat = case.solves
    # the γ of the true motion leaves the pole towards φ = π: with this ξ, ψ is 0 there
    first, second, third = (-part for part in perpendicular(gyrostat.start.gamma))
    known = Validated(gyrostat.top, gyrostat.start, xi=(first, second, third))
    ordered = sorted({*times, Fraction(0)})
    balls = [[*known.state(time, _CURVE_BITS), *known.attitude(time, _CURVE_BITS)] for time in ordered]
    states = numpy.array([[float(value.mid()) for value in row] for row in balls])
    angles = numpy.array([euler_angles(row[3:6], row[6:9], numpy) for row in states])
    t = numpy.array([float(time) for time in ordered])
    return Curves(t, states[:, :6], _continuous(angles, states)), "proven enclosure"


def _continuous(angles: NDArray[numpy.float64], states: NDArray[numpy.float64]) -> Any:
    """Angles unwrapped; at the pole itself (t = 0) φ and ψ are the mean of their neighbours: γ only touches it.

    Whole turns are taken off until φ and ψ lie within a turn of 0 there.
    """
    pole = int(numpy.argmax(states[:, 5]))
    columns = [angles[:, 1]]
    for index in (0, 2):
        away = numpy.delete(angles[:, index], pole)
        turned = numpy.array(unwrap(list(away), 2 * numpy.pi))
        column = numpy.insert(turned, pole, (turned[pole - 1] + turned[pole]) / 2)
        columns.append(column - 2 * numpy.pi * numpy.floor(column[pole] / (2 * numpy.pi) + 0.25))
    return numpy.stack([columns[1], columns[0], columns[2]], axis=1)


def exact_curves(motion: ErshkovPartial | DeloneHomoclinic, times: list[Fraction]) -> Curves:
    """A motion in closed form; that of the gyrostat on its smooth branch: θ takes the sign of −t."""
    t = numpy.array([float(time) for time in times])
    states = numpy.array([[float(value.mid()) for value in motion.state(time, _CURVE_BITS)] for time in times])
    angles = numpy.array([[float(value.mid()) for value in motion.angles(time, _CURVE_BITS)] for time in times])
    return Curves(t, states, angles)


FIGURES: dict[str, Callable[[], Any]] = {
    **{f"fig{figure.number}": partial(_paper_figure, figure) for figure in PAPER_FIGURES},
    **{f"truth-ratio{ratio}": partial(_comparison, ratio) for ratio in (2, 6)},
    "momentum-sphere": _portrait,
}
"""The functions that draw Figs 2-8, the comparisons for I1/I3 = 2 and 6, and the momentum sphere, by file name."""
