"""Pictures of motions on axes of matplotlib.

Every function draws on the given ``axes``, or on those of a new figure (``axes.figure``), and returns them; none uses
pyplot or changes settings of the process.  Motions are results of :func:`heavytop.propagate` and
:func:`heavytop.reference`; the denser their times, the smoother the curves.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from heavytop import arguments
from heavytop.api.plot_data import (
    Crossings,
    Motion,
    PoincareSection,
    PowerCurves,
    Samples,
    SpacedErrors,
    axes_of,
    compared,
    every,
    exact_states,
    parameters_of,
    path_in_space,
    principal,
    samples,
)
from heavytop.errors import InputError, quoted, refusal
from heavytop.files import writable
from heavytop.integrate.trajectory import Trajectory
from heavytop.measure.scorer import Logs, sample_drifts, sample_errors
from heavytop.precision import exact, ordered
from heavytop.report.document.document import integral_text
from heavytop.report.document.svg import COLOURS, decades, new_figure
from heavytop.top.bodies import Body
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, NAMES, Parameters, component
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.top.stability import stability as steady_motion

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter, Animation, FuncAnimation
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from mpl_toolkits.mplot3d import Axes3D

__all__ = [
    "animate",
    "between",
    "digits",
    "drift",
    "error",
    "herpolhode",
    "phase",
    "poincare",
    "polhode",
    "power",
    "sphere",
    "stability",
]

_GREY = "#888888"
_LIGHT = "#b8c4d0"
_WIDTH = 1.2
_ELEVATION, _AZIMUTH = 24.0, -50.0
_RATE = "1/time unit"
_TIME = "t (time units)"
_FOLLOWED = {"centre": "centre of mass", "vertical": "vertical in the body"} | {
    f"axis{i}": f"axis {i}" for i in (1, 2, 3)
}
_SPAN = 100
"""The axis of times is logarithmic if the largest is so many times the smallest."""
_DASHES = ("-", "--", "-.", ":", (0, (6, 2)), (0, (1, 2)))


def sphere(
    run: Motion,
    axes: Axes3D | None = None,
    *,
    of: str | None = None,
    top: HeavyTop | None = None,
    colour: str = COLOURS[0],
    label: str | None = None,
) -> Axes3D:
    """The path of an axis of the body on the unit sphere in space: loops, cusps and waves.

    Arguments:
        run: a motion; without attitude a computed one is integrated again with it.
        axes: three-dimensional axes of matplotlib, or None for new ones.
        of: "axis1" to "axis3", a principal axis; "centre", the direction of the centre of mass (where None, if it has
            one); "vertical": γ, the vertical in body axes.
        top: of a reference, for "centre".
        colour, label: of the path.

    Returns:
        The axes; the third component points up, the part behind the sphere is thin, and a dot marks the start of the
        path.

    Raises:
        InputError: for fewer than two samples, states that are not finite, and a reference without attitude.
    """
    name, _, path = path_in_space(run, of, top)
    drawn = _solid(axes, colour)
    _globe(drawn)
    _visible_path(drawn, path, colour, label)
    body = name == "vertical"
    drawn.set(xlabel="γ1" if body else "x", ylabel="γ2" if body else "y", zlabel="γ3" if body else "z, up")
    drawn.set_title(f"{_FOLLOWED[name]} on the unit sphere", fontsize="medium")
    return drawn


def polhode(
    run: Motion,
    axes: Axes3D | None = None,
    *,
    top: HeavyTop | None = None,
    colour: str = COLOURS[0],
    label: str | None = None,
) -> Axes3D:
    """The polhode, the path of Ω in the principal axes; on the energy ellipsoid Ω·IΩ = 2T of a free body, P r = 0.

    Arguments:
        run: a motion.  axes: three-dimensional axes, or None.
        top: of a reference, for the ellipsoid.
        colour, label: of the path.

    Returns:
        The axes, Ω in 1/time unit.

    Raises:
        InputError: as :func:`sphere`.
    """
    omega = principal(run, samples(run).omega)
    drawn = _solid(axes, colour)
    free = _free(run, top)
    if free is not None:
        inertia = np.array([float(value) for value in free.inertia])
        radii = np.sqrt((omega[0] ** 2 * inertia).sum() / inertia)
        _ellipsoid(drawn, radii)
        _visible_path(drawn, omega, colour, label, 1 / radii**2)
        _equal(drawn, radii.max())
    else:
        drawn.plot(*omega.T, color=colour, lw=_WIDTH, label=label)
        drawn.plot(*omega[:1].T, "o", color=colour, ms=4)
        low, high = omega.min(axis=0), omega.max(axis=0)
        _equal(drawn, 0.55 * (high - low).max() or 1.0, (low + high) / 2)
    drawn.set(**{f"{axis}label": f"{name} ({_RATE})" for axis, name in zip("xyz", NAMES, strict=False)})
    drawn.set_title("Ω in the body" if free is None else "polhode on the energy ellipsoid", fontsize="medium")
    return drawn


def _free(run: Motion, top: HeavyTop | None) -> Parameters | None:
    """The parameters of a free body; None if it has weight or a rotor, or they are unknown."""
    p = parameters_of(run, top) if isinstance(run, Trajectory) or top is not None else None
    return None if p is None or any(p.moment) or any(p.rotors) else p


def herpolhode(
    run: Motion,
    axes: Axes3D | None = None,
    *,
    top: HeavyTop | None = None,
    colour: str = COLOURS[0],
    label: str | None = None,
) -> Axes3D:
    """The path of Ω in space, the herpolhode, viewed along the angular momentum of a free body, else from above.

    Arguments:
        run: a motion; without attitude a computed one is integrated again with it.
        axes: plane axes, or None.  top: of a reference.  colour, label: of the path.

    Returns:
        The axes; both in 1/time unit, to the same scale.

    Raises:
        InputError: as :func:`sphere`.
    """
    curves = samples(run)
    rows = curves.rotations()
    omega = np.einsum("nij,nj->ni", rows, curves.omega)
    free, across = _free(run, top), np.eye(3)[:2]
    if free is not None:
        own = principal(run, curves.omega[:1])[0] * np.array([float(value) for value in free.inertia])
        turn = axes_of(run)
        momentum = rows[0] @ (own if turn is None else turn @ own)
        if (size := np.linalg.norm(momentum)) > 0:
            across = _plane_across(momentum / size)
    drawn = _flat(axes, colour)
    x, y = (omega @ across.T).T
    drawn.plot(x, y, color=colour, lw=_WIDTH, label=label)
    drawn.plot(x[:1], y[:1], "o", color=colour, ms=4)
    drawn.plot([0], [0], "+", color=_GREY)
    names = ("across M", "across M, at right angles") if free else ("Ωx", "Ωy")
    drawn.set(xlabel=f"{names[0]} ({_RATE})", ylabel=f"{names[1]} ({_RATE})")
    drawn.set_title("herpolhode in the invariable plane" if free else "Ω in space, from above", fontsize="medium")
    drawn.set_aspect("equal", adjustable="datalim")
    return drawn


def phase(
    run: Motion,
    x: str = "gamma3",
    y: str = "omega3",
    axes: Axes | None = None,
    *,
    colour: str = COLOURS[0],
    label: str | None = None,
) -> Axes:
    """One component of the motion over another, or over time.

    Arguments:
        run: a motion.  x, y: "omega1" to "gamma3", or "t".  axes: plane axes, or None.  colour, label: of the curve.

    Returns:
        The axes; Ω in 1/time unit, t in time units.

    Raises:
        InputError: for another name, and as :func:`sphere`.
    """
    curves = samples(run)
    drawn = _flat(axes, colour)
    values = [_column(curves, name) for name in (x, y)]
    drawn.plot(*values, color=colour, lw=_WIDTH, label=label)
    drawn.plot(*(value[:1] for value in values), "o", color=colour, ms=4)
    drawn.set(xlabel=_named(x), ylabel=_named(y))
    return drawn


def poincare(
    section: PoincareSection | Crossings | Iterable[Crossings],
    x: str = "gamma3",
    y: str = "omega3",
    axes: Axes | None = None,
    *,
    colours: Sequence[str] = COLOURS,
    size: float | None = None,
) -> Axes:
    """A Poincaré section: the states at the events of several motions, one colour per motion.

    Arguments:
        section: a result of :func:`heavytop.poincare` or :func:`heavytop.events`, or several of the latter.
        x, y: "omega1" to "gamma3".  axes: plane axes, or None.
        colours: used cyclically.  size: of a point, in points; None for a size that depends on their number.

    Returns:
        The axes.

    Raises:
        InputError: for another name, and for a section without a point.
    """
    if isinstance(section, PoincareSection):
        section = section.events
    listed = _several(
        section, Crossings, "section", "events", "Give the result of heavytop.poincare or heavytop.events."
    )
    palette = list(colours) if isinstance(colours, str) else ordered(colours, "colours", _COLOURS)
    if not palette:
        raise InputError("No colours were given.", _COLOURS)
    total = sum(map(len, listed))
    if not total:
        raise InputError("The section has no points.", "Give a later until, or another function.")
    drawn = _flat(axes, *palette)
    diameter = size if size is not None else float(np.clip(90 / np.sqrt(total), 2, 5))
    columns = [component(name) for name in (x, y)]
    for index, start in enumerate(listed):
        points = start.to_numpy()[:, columns]
        drawn.plot(*points.T, ".", color=palette[index % len(palette)], ms=diameter, mew=0)
    drawn.set(xlabel=_named(x), ylabel=_named(y))
    drawn.set_title(f"section {listed[0].function}", fontsize="medium")
    return drawn


def drift(run: Trajectory, axes: Axes | None = None) -> Axes:
    """The drift of the first integrals of a computed motion from their values at t = 0, over time.

    Arguments:
        run: a computed motion, in any format.  axes: plane axes, or None.

    Returns:
        The axes, with a curve for each first integral of the motion, interrupted where the drift is exactly 0.  Of more
        than 400 samples a subset is drawn.

    Raises:
        InputError: for a reference, whose integrals do not drift, and as :func:`sphere`.
    """
    if not isinstance(run, Trajectory):
        raise refusal("run", "a computed motion", quoted(run), "Give the result of heavytop.propagate.")
    samples(run)
    indices = every(len(run.states))
    drawn, times = _flat(axes), np.array([float(exact(run.times[index])) for index in indices])
    curves = sample_drifts(run.problem, [exact(run.times[index]) for index in indices], exact_states(run, indices))
    _logarithmic(drawn, times, {integral_text(name): logs for name, logs in curves.items()})
    drawn.set_ylabel("|I(t) − I(0)|")
    drawn.set_title(f"drift in {run.problem.precision.name}, {run.integrator}", fontsize="medium")
    return drawn


def digits(
    run: Trajectory, known: Motion, axes: Axes | None = None, *, colour: str = COLOURS[0], label: str | None = None
) -> Axes:
    """The digits right of a computed motion over time, −log10 of the largest error of a component.

    Arguments:
        run: a computed motion.  known: a reference, or a finer run, at the same times.
        axes: plane axes, or None.  colour, label: of the curve.

    Returns:
        The axes, from 0 to the digits of the format.

    Raises:
        InputError: where the times differ, and as :func:`sphere`.
    """
    problem, times, states, truth = compared(run, known)
    format_digits = problem.precision.bits * np.log10(2)
    logs = sample_errors(problem, times, states, truth)["relative"]
    right = [format_digits if log is None else float(np.clip(-log, 0, format_digits)) for log in logs]
    drawn, instants = _flat(axes, colour), np.array([float(time) for time in times])
    drawn.plot(abs(instants), right, color=colour, lw=_WIDTH, label=label)
    drawn.set_title(f"{problem.precision.name}, {run.integrator}", fontsize="medium")
    _time_axis(drawn, instants)
    drawn.set(ylabel="digits right", ylim=(0, max(format_digits * 1.05, drawn.get_ylim()[1])))
    return drawn


def error(run: Trajectory, known: Motion, axes: Axes | None = None) -> Axes:
    """The error of a computed motion along the flow (its phase) and across it, over time.

    Arguments:
        run: a computed motion.  known: a reference, or a finer run, at the same times.  axes: plane axes, or None.

    Returns:
        The axes, logarithmic.

    Raises:
        InputError: where the times differ, and as :func:`sphere`.
    """
    problem, times, states, truth = compared(run, known)
    errors = sample_errors(problem, times, states, truth)
    drawn = _flat(axes)
    _logarithmic(drawn, np.array([float(time) for time in times]), {name: errors[name] for name in ("along", "across")})
    drawn.set_ylabel("error along and across the flow")
    drawn.set_title(f"{problem.precision.name}, {run.integrator}", fontsize="medium")
    return drawn


def animate(
    run: Motion,
    path: str | os.PathLike[str] | None = None,
    *,
    of: str | None = None,
    top: HeavyTop | None = None,
    frames: int = 120,
    fps: int = 24,
    colour: str = COLOURS[0],
) -> FuncAnimation:
    """An animation of the motion: the principal axes of the body, and the path of one of them on the unit sphere.

    Arguments:
        run, of, top: as in :func:`sphere`.
        path: a file to write, .gif (with Pillow) or .mp4 (with ffmpeg); None for none.
        frames: evenly over the samples, at most one per sample.  fps: frames per second.
        colour: of the path.

    Returns:
        A ``FuncAnimation`` of matplotlib; in a notebook ``HTML(film.to_jshtml())`` shows it.

    Raises:
        InputError: for another kind of file, for .mp4 without ffmpeg, and as :func:`sphere`.
    """
    from matplotlib.animation import FuncAnimation

    count, rate = arguments.count(frames, "frames"), arguments.count(fps, "fps")
    file = None if path is None else arguments.path(path, "path")
    writer = None if file is None else _writer(file.suffix.lower(), rate or 1)
    name, locus, line = path_in_space(run, "axis3" if of == "vertical" else of, top)
    rows, drawn = locus.rotations(), _solid(None, colour)
    _globe(drawn)
    drawn.set(xlabel="x", ylabel="y", zlabel="z, up")
    arms = [drawn.plot([], [], [], color=COLOURS[i + 1], lw=2.2, label=f"axis {i + 1}")[0] for i in range(3)]
    rod = drawn.plot([], [], [], color=colour, lw=2.8, label=_FOLLOWED[name])[0]
    trace = drawn.plot([], [], [], color=colour, lw=_WIDTH)[0]
    clock = drawn.text2D(0.02, 0.02, "", transform=drawn.transAxes)
    drawn.legend(loc="upper left", fontsize="small", frameon=False)
    indices = every(len(line), count or 1)

    def show(frame: int) -> list[Artist]:
        index = indices[frame]
        for axis, arm in enumerate(arms):
            arm.set_data_3d(*np.stack([np.zeros(3), rows[index][:, axis]]).T)
        rod.set_data_3d(*np.stack([np.zeros(3), line[index]]).T)
        trace.set_data_3d(*line[: index + 1].T)
        clock.set_text(f"t = {locus.times[index]:.2f}")
        return [*arms, rod, trace, clock]

    film = FuncAnimation(drawn.figure, show, frames=len(indices), interval=1000 / (rate or 1), blit=False)
    if file is None:
        drawn.figure.canvas.draw()  # the first frame: matplotlib warns of an animation that was never drawn
    else:
        _save(film, file, writer)
    return film


def _save(film: Animation, file: Path, writer: AbstractMovieWriter | None) -> None:
    with writable(file, "Give a file in a writable folder."):
        film.save(file, writer=writer)


def _writer(suffix: str, fps: int) -> AbstractMovieWriter:
    from matplotlib.animation import FFMpegWriter, PillowWriter

    if suffix == ".gif":
        return PillowWriter(fps=fps)
    if suffix != ".mp4":
        raise refusal("A film", ".gif or .mp4", quoted(suffix), "Give a path that ends with .gif or .mp4.")
    if not FFMpegWriter.isAvailable():
        raise InputError("Writing .mp4 needs ffmpeg.", "Install ffmpeg, or give a path that ends with .gif.")
    return FFMpegWriter(fps=fps)


def _several(values: Any, kind: Any, what: str, rule: str, remedy: str) -> list[Any]:
    """One object of type ``kind``, or several, at least one, as a list."""
    listed = [values] if isinstance(values, kind) else ordered(values, what, remedy)
    if not listed or not all(isinstance(value, kind) for value in listed):
        raise refusal(what, rule, quoted(values), remedy)
    return listed


_COLOURS = 'Give one that matplotlib knows, such as "C0" or "#d55e00".'


def _require_colours(colours: Sequence[Any]) -> None:
    from matplotlib.colors import is_color_like

    for colour in colours:
        if colour is not None and not is_color_like(colour):
            raise refusal("colour", "a colour", quoted(colour), _COLOURS)


def _flat(axes: Axes | None, *colours: Any) -> Axes:
    """The given plane axes, or new ones."""
    _require_colours(colours)
    if axes is None:
        axes = new_figure(6.4, 4.0).add_subplot()
    elif not hasattr(axes, "plot") or getattr(axes, "name", "") == "3d":
        raise refusal("axes", "two-dimensional axes of matplotlib", quoted(axes), "Give those of plt.subplots().")
    axes.grid(visible=True, color=_GREY, alpha=0.25, lw=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return axes


def _solid(axes: Axes3D | None, *colours: Any) -> Axes3D:
    """The given three-dimensional axes, or new ones."""
    _require_colours(colours)
    if axes is None:
        axes = new_figure(5.2, 5.0).add_subplot(projection="3d")
    elif getattr(axes, "name", "") != "3d":
        raise refusal("axes", "three-dimensional", quoted(axes), 'Use add_subplot(projection="3d").')
    axes.view_init(_ELEVATION, _AZIMUTH)
    axes.locator_params(nbins=4)
    return axes


def _sight(axes: Axes3D) -> NDArray[np.float64]:
    """The unit vector from the centre of the axes to the viewer."""
    elevation, azimuth = np.radians(axes.elev), np.radians(axes.azim)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def _globe(axes: Axes3D) -> None:
    """Draw the unit sphere, and a vertical line."""
    _ellipsoid(axes, np.ones(3))
    axes.plot([0, 0], [0, 0], [-1, 1.25], color=_GREY, lw=0.8)
    _equal(axes, 1.0)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_ticks((-1, 0, 1))
    axes.zaxis.labelpad = -1


def _ellipsoid(axes: Axes3D, radii: NDArray[np.float64]) -> None:
    """Draw a translucent ellipsoid with circles of latitude and longitude."""
    longitude, latitude = np.linspace(0, 2 * np.pi, 73), np.linspace(-np.pi / 2, np.pi / 2, 37)
    across, up = np.cos(latitude)[:, None], np.sin(latitude)[:, None]
    x, y, z = across * np.cos(longitude) * radii[0], across * np.sin(longitude) * radii[1], up + 0 * longitude
    axes.plot_surface(x, y, z * radii[2], color=_LIGHT, alpha=0.15, lw=0, shade=False)
    axes.plot_wireframe(x, y, z * radii[2], rstride=6, cstride=9, color=_GREY, alpha=0.18, lw=0.5)


def _equal(axes: Axes3D, extent: float, middle: Sequence[float] | NDArray[np.float64] = (0.0, 0.0, 0.0)) -> None:
    """Set equal scales on all three axes, from ``middle`` − ``extent`` to ``middle`` + ``extent``."""
    low, high = np.asarray(middle) - extent, np.asarray(middle) + extent
    for name, ends in zip("xyz", zip(low, high, strict=True), strict=True):
        getattr(axes, f"set_{name}lim")(*ends)
    axes.set_box_aspect((1, 1, 1), zoom=0.86)


def _visible_path(
    axes: Axes3D,
    path: NDArray[np.float64],
    colour: str,
    label: str | None,
    weights: Sequence[float] | NDArray[np.float64] = (1.0, 1.0, 1.0),
) -> None:
    """Draw a path on an ellipsoid Σ weight x² = 1; the part behind the ellipsoid is thin."""
    front = (path * np.asarray(weights)) @ _sight(axes) >= 0
    visible, hidden = path.copy(), path.copy()
    # both parts contain the sample where they meet
    visible[~(front | np.roll(front, 1))] = np.nan
    hidden[front & np.roll(front, 1)] = np.nan
    axes.plot(*hidden.T, color=colour, lw=0.7 * _WIDTH, alpha=0.45)
    axes.plot(*visible.T, color=colour, lw=1.2 * _WIDTH, label=label)
    axes.plot(*path[:1].T, "o", color=colour, ms=4)


def _plane_across(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Two orthogonal unit vectors orthogonal to the unit vector ``normal``, (2, 3)."""
    first = np.cross(normal, np.eye(3)[int(np.argmin(abs(normal)))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _column(drawn: Samples, name: str) -> NDArray[np.float64]:
    if name == "t":
        return drawn.times
    index = component(name)
    values: NDArray[np.float64] = (drawn.omega if index < 3 else drawn.gamma)[:, index % 3]
    return values


def _named(name: str) -> str:
    if name == "t":
        return _TIME
    index = component(name)
    return f"{NAMES[index]} ({_RATE})" if index < 3 else NAMES[index]


def _time_axis(axes: Axes, times: NDArray[np.float64]) -> None:
    """Label the axis of |t|, logarithmic over two decades or more."""
    positive = abs(times[times != 0])
    if len(positive) and positive.max() >= _SPAN * positive.min():
        axes.set_xscale("log")
    axes.set_xlabel(_TIME if (times >= 0).all() else "|t| (time units)")


def _logarithmic(axes: Axes, times: NDArray[np.float64], curves: dict[str, Logs]) -> None:
    """Draw curves over time from decimal logarithms, which may be beyond the range of doubles."""
    for index, (name, logs) in enumerate(curves.items()):
        values = np.array([np.nan if log is None else log for log in logs])
        exact_zero = bool(np.isnan(values).all())
        colour, dash = COLOURS[index % len(COLOURS)], _DASHES[index % len(_DASHES)]
        label, marker = f"{name}: exactly 0" if exact_zero else name, "." if np.isnan(values).any() else ""
        axes.plot(abs(times), values, marker=marker, ms=3, color=colour, lw=_WIDTH, ls=dash, label=label)
    _time_axis(axes, times)
    decades(axes.yaxis)
    axes.legend(frameon=False, fontsize="small")


def stability(top: HeavyTop | Body, axes: Axes3D | None = None, *, speed: float = 1.0) -> Axes3D:
    """Rotation about each principal axis on the unit sphere of the body: stable or unstable, with the rate.

    Arguments:
        top: its principal axes at the fixed point; the rotation axis is vertical if the top has weight.
        axes: three-dimensional axes, or None.
        speed: Ω, 1/time unit.

    Returns:
        The axes; a grey point if the rotation is not steady.

    Raises:
        InputError: for an invalid top.
    """
    body = top.top if isinstance(top, Body) else arguments.is_a(top, HeavyTop, "top")
    drawn = _solid(axes)
    system = HEAVY_GYROSTAT if body.rotor else HEAVY_TOP
    _globe(drawn)
    for axis in range(3):
        for sign in (1, -1):
            direction = [sign * (axis == k) for k in range(3)]
            start = State([exact(speed) * value for value in direction], direction)
            steady = steady_motion(system, system.parameters(body, start), start.flat)
            unstable = steady is not None and steady.verdict == "unstable"
            colour = _GREY if steady is None else COLOURS[1] if unstable else COLOURS[0]
            drawn.plot(*([value] for value in direction), "o", color=colour)
            words = "not steady" if steady is None else steady.verdict + (f" {steady.rate:.3g}" if steady.rate else "")
            drawn.text(
                *(1.2 * value for value in direction), f"{'−' if sign < 0 else ''}{axis + 1}: {words}", fontsize=7
            )
    drawn.set(xlabel="axis 1", ylabel="axis 2", zlabel="axis 3")
    drawn.set_title("rotations about principal axes", fontsize="medium")
    return drawn


def power(test: PowerCurves, axes: Axes | None = None) -> Axes:
    """The largest error of each planted fault up to each time, and the tolerance of the test.

    Arguments:
        test: a result of :func:`heavytop.power`.
        axes: of matplotlib, or None.

    Returns:
        The axes, with logarithmic errors.
    """
    if not isinstance(test, PowerCurves):
        raise refusal("test", "a test", quoted(test), "Give the result of heavytop.power.")
    drawn = _flat(axes)
    times = np.array([float(time) for time in test.times])
    for index, fault in enumerate(test.faults):
        dashes = _DASHES[index // len(COLOURS) % len(_DASHES)]
        largest = np.maximum.accumulate(np.maximum(fault.errors, 1e-17))
        drawn.plot(times, largest, dashes, color=COLOURS[index % len(COLOURS)], lw=_WIDTH, label=fault.name)
    drawn.axhline(test.tolerance, color=_GREY, lw=_WIDTH, ls="--")
    drawn.set(xlabel=_TIME, ylabel="largest error so far", yscale="log")
    drawn.legend(fontsize="x-small", loc="best", framealpha=0.6)
    return drawn


def between(samples: SpacedErrors | Sequence[SpacedErrors], axes: Axes | None = None) -> Axes:
    """The error of each interpolation over the time between samples.

    Arguments:
        samples: a result of :func:`heavytop.between_samples`, or several.
        axes: of matplotlib, or None.

    Returns:
        The axes, both logarithmic.
    """
    several = _several(samples, SpacedErrors, "samples", "errors", "Give the result of heavytop.between_samples.")
    drawn, rows = _flat(axes), sorted(several, key=lambda row: row.spacing)
    for colour, name in zip(COLOURS, rows[0].errors, strict=False):
        points = [(float(row.spacing), error) for row in rows if (error := row.errors[name])]
        if points:
            drawn.plot(*zip(*points, strict=True), "o-", color=colour, lw=_WIDTH, ms=3, label=name)
    drawn.set(xlabel="time between samples", ylabel="largest error", xscale="log", yscale="log")
    drawn.legend(fontsize="x-small", loc="best", framealpha=0.6)
    return drawn
