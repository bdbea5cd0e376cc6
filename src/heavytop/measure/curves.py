"""What the figures draw: the paper's curves in its own formulas, and claim, gyrostat and true motion in time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy

from heavytop.claims import ershkov
from heavytop.claims.ershkov import Branch, PartialCase
from heavytop.exact.delone import DeloneHomoclinic
from heavytop.exact.ershkov_partial import ErshkovPartial
from heavytop.exact.validated import Validated
from heavytop.measure.parting import Parting, parting
from heavytop.top.angles import euler_angles, perpendicular, unwrap
from heavytop.top.equations import GYROSTAT
from heavytop.top.integrals import gyrostat_energy

_BITS = 64
RATIOS = (2, 6)


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """One of Figs 2-8: ``a`` is A, ``ratio`` is I1/I3 where the paper states it; α = 1 throughout."""

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

    times: Any
    states: Any
    angles: Any


@dataclass(frozen=True, slots=True)
class PaperCurve:
    """A figure of the paper over time, shapes (n,)."""

    figure: PaperFigure
    times: Any
    values: Any


@dataclass(frozen=True, slots=True)
class Compared:
    """Truth, gyrostat and claim from the same data at t = 0, for one I1/I3, and when claim and truth part."""

    ratio: int
    truth: Curves
    method: str
    gyrostat: Curves
    claim: Curves
    parted: dict[Branch, Parting | None]


@dataclass(frozen=True, slots=True)
class Portrait:
    """M along the homoclinic motions of the gyrostat and of the heavy top, shape (n, 3).

    levels: level lines of the gyrostat's energy on the sphere |M| = ``length``, each a triple of arrays.
    """

    gyrostat: Any
    heavy_top: Any
    levels: list[Any]
    length: float


@dataclass(frozen=True, slots=True)
class Drawings:
    """All that the figures draw."""

    papers: Iterator[PaperCurve]
    comparisons: Iterator[Compared]
    portrait: Iterator[Portrait]


FIGURES = len(PAPER_FIGURES) + len(RATIOS) + 1


def drawings() -> Drawings:
    """Figs 2-8, the comparisons for I1/I3 = 2 and 6, the momentum sphere; each is worked out when it is asked for."""
    return Drawings(map(_paper, PAPER_FIGURES), map(_compared, RATIOS), (_portrait() for _ in range(1)))


def _paper(figure: PaperFigure) -> PaperCurve:
    # beyond A t = 37 the printed logarithm loses every digit of a double
    span = min(4, 24 / figure.a)
    t = numpy.linspace(-span, span, 801)
    t = t[t != 0] if figure.angle == "phi" else t
    return PaperCurve(figure, t, figure.values(t))


def _compared(ratio: int) -> Compared:
    case = PartialCase(Fraction(1), Fraction(1), Fraction(1, ratio))
    span = Fraction(6, ratio - 1) + 2
    times = [span * index / 200 for index in range(-200, 201)]
    truth, method = true_curves(case, times)
    branches: tuple[Branch, ...] = ("printed", "smooth")
    parted = {branch: parting(case, times[-1], branch) for branch in branches}
    return Compared(ratio, truth, method, exact_curves(case.solves, times), claim_curves(case, times), parted)


def _portrait() -> Portrait:
    case = PartialCase(Fraction(1), Fraction(1), Fraction(1, 2))
    times = [Fraction(index, 10) for index in range(-140, 141)]
    moments = numpy.array([float(moment) for moment in case.solves.top.inertia])
    gyrostat, heavy_top = exact_curves(case.solves, times), true_curves(case, times)[0]
    orbits = [curves.states[:, :3] * moments for curves in (gyrostat, heavy_top)]
    return Portrait(orbits[0], orbits[1], _levels(case), float(case.alpha * case.i1))


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


def claim_curves(case: PartialCase, times: list[Fraction]) -> Curves:
    """The claim as printed: u = √Ω2, positive roots and arctan."""
    t = numpy.array([float(time) for time in times])
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
    balls = [[*known.state(time, _BITS), *known.attitude(time, _BITS)] for time in ordered]
    states = numpy.array([[float(value.mid()) for value in row] for row in balls])
    angles = numpy.array([euler_angles(row[3:6], row[6:9], numpy) for row in states])
    t = numpy.array([float(time) for time in ordered])
    return Curves(t, states[:, :6], _continuous(angles, states)), "proven enclosure"


def _continuous(angles: Any, states: Any) -> Any:
    """Angles unwrapped; at the pole itself (t = 0) φ and ψ are the mean of their neighbours: γ only touches it.

    Whole turns are taken off until φ and ψ lie within a turn of 0 there.
    """
    pole = int(numpy.argmax(states[:, 5]))
    columns = [angles[:, 1]]
    for index in (0, 2):
        away = numpy.delete(angles[:, index], pole)
        turned = numpy.array(unwrap(list(away), 2 * numpy.pi))
        whole = numpy.insert(turned, pole, (turned[pole - 1] + turned[pole]) / 2)
        columns.append(whole - 2 * numpy.pi * numpy.floor(whole[pole] / (2 * numpy.pi) + 0.25))
    return numpy.stack([columns[1], columns[0], columns[2]], axis=1)


def exact_curves(motion: ErshkovPartial | DeloneHomoclinic, times: list[Fraction]) -> Curves:
    """A motion in closed form; that of the gyrostat on its smooth branch: θ takes the sign of −t."""
    t = numpy.array([float(time) for time in times])
    states = numpy.array([[float(value.mid()) for value in motion.state(time, _BITS)] for time in times])
    angles = numpy.array([[float(value.mid()) for value in motion.angles(time, _BITS)] for time in times])
    return Curves(t, states, angles)
