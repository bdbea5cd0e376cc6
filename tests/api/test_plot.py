"""Pictures of motions: what is drawn is the motion, and what cannot be drawn is refused by name."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import heavytop as ht
from heavytop.display import path_picture
from heavytop.errors import InputError
from heavytop.report.document.document import integral_text
from support.helpers import START as TUMBLING
from support.helpers import TOP as GENERIC

LAGRANGE = ht.HeavyTop((1, 1, "1/2"), 1, (0, 0, 1))
START = ht.State((0, "-1/2", 5), (0, "3/5", "4/5"))
FREE = ht.HeavyTop((3, 2, 1), 0, (0, 0, 0))
TIMES = np.arange(1, 201) / 20


@pytest.fixture(scope="module")
def run() -> ht.Trajectory:
    return ht.propagate(LAGRANGE, START, TIMES)


@pytest.fixture(scope="module")
def known() -> ht.Reference:
    return ht.reference(LAGRANGE, START, TIMES, 25, attitude=True)


def lines(axes) -> list[np.ndarray]:
    """The data of each line, (n, 2) or (n, 3)."""
    solid = axes.name == "3d"
    return [np.array(line.get_data_3d() if solid else line.get_data()).T for line in axes.lines]


def drawn(axes) -> np.ndarray:
    """The longest line; of a path in front and behind both halves together."""
    found = [line for line in lines(axes) if len(line) > 50]
    return np.where(np.isnan(found[0]), found[-1], found[0])


def rendered(axes) -> None:
    axes.figure.canvas.draw()


@pytest.mark.slow
def test_the_axis_in_space_is_that_of_the_reference(run, known) -> None:
    mine, theirs = drawn(ht.plot.sphere(run)), drawn(ht.plot.sphere(known, of="axis3"))
    assert abs(mine - theirs).max() < 1e-11
    assert abs(np.linalg.norm(mine, axis=1) - 1).max() < 1e-12
    assert abs(mine[:, 2] - run.to_numpy()[:, 5]).max() == 0  # its height is γ3
    # an attitude that is given is followed, not the one taken where none is
    turned = ht.propagate(LAGRANGE, START, TIMES, xi=(0, "4/5", "-3/5"))
    other = drawn(ht.plot.sphere(turned))
    angle = np.arctan2(other[:, 1], other[:, 0]) - np.arctan2(mine[:, 1], mine[:, 0])
    assert np.ptp(np.unwrap(angle)) < 1e-10
    assert abs(angle[0]) > 0.1
    vertical = drawn(ht.plot.sphere(run, of="vertical"))
    assert (vertical == run.to_numpy()[:, 3:]).all()


@pytest.mark.slow
def test_the_polhode_lies_on_the_ellipsoid_and_the_herpolhode_in_its_plane() -> None:
    free = ht.propagate(FREE, ht.State(("1/5", 1, "1/10"), (0, 0, 1)), TIMES)
    omega = drawn(ht.plot.polhode(free))
    energy = (omega**2 * [3, 2, 1]).sum(axis=1)
    assert np.ptp(energy) < 1e-13
    assert ht.plot.polhode(free).collections  # the ellipsoid
    assert not ht.plot.polhode(ht.propagate(LAGRANGE, START, TIMES)).collections
    flat = drawn(ht.plot.herpolhode(free))
    # |Ω|² less the square of its constant part along M
    momentum = np.linalg.norm(omega[0] * [3, 2, 1])
    assert abs((flat**2).sum(axis=1) - ((omega**2).sum(axis=1) - (energy[0] / momentum) ** 2)).max() < 1e-12
    above = drawn(ht.plot.herpolhode(ht.propagate(GENERIC, TUMBLING, TIMES)))
    assert above.shape == (200, 2)


def test_phase_planes_and_sections(run) -> None:
    axes = ht.plot.phase(run, "t", "γ3")
    assert (drawn(axes)[:, 0] == TIMES).all()
    assert axes.get_xlabel() == "t (time units)"
    assert ht.plot.phase(run, "omega1", "omega2").get_ylabel() == "Ω2 (1/time unit)"
    section = ht.poincare(GENERIC, [TUMBLING, ht.State((0, 1, 0), (1, 0, 0))], 40, "gamma2")
    axes = ht.plot.poincare(section, "gamma3", "omega3")
    for line, points in zip(lines(axes), section.points("gamma3", "omega3"), strict=True):
        assert (line == points).all()
    assert len({line.get_color() for line in axes.lines}) == 2
    one = ht.events(GENERIC, TUMBLING, 10, "gamma2", digits=15)
    assert len(lines(ht.plot.poincare(one, colours="rgb"))[0]) == len(one)


def test_the_axis_of_a_run_backwards_is_that_of_the_size_of_its_times() -> None:
    back, times = ht.propagate(GENERIC, TUMBLING, [-1, -2]), ["-1", "-2"]
    for axes in (ht.plot.digits(back, ht.reference(GENERIC, TUMBLING, times, 25)), ht.plot.drift(back)):
        assert axes.get_xlabel() == "|t| (time units)"
        assert list(axes.lines[0].get_xdata()) == [1, 2]


@pytest.mark.slow
def test_drift_digits_and_error_are_those_of_the_score(run, known) -> None:
    score = ht.score(TIMES, run.states, top=LAGRANGE, start=START, precision=ht.DOUBLE)
    digits = drawn(ht.plot.digits(run, known))[:, 1]
    assert abs(digits.min() - score.digits_kept) < 0.3
    axes = ht.plot.error(run, known)
    found = {line.get_label(): np.nanmax(line.get_ydata()) for line in axes.lines}
    for part in ("along", "across"):
        assert abs(found[part] - np.log10(float(score.distance[part].max))) < 0.3
    drifts = {integral_text(name): drift for name, drift in ht.drift(run).items()}
    axes = ht.plot.drift(run)
    for line in axes.lines:
        name, _, zero = line.get_label().partition(":")
        largest = float(drifts[name].max.value)
        assert (largest == 0) == bool(zero)
        assert zero or abs(np.nanmax(line.get_ydata()) - np.log10(largest)) < 1e-3
    quad = ht.propagate(LAGRANGE, START, TIMES, ht.QUAD)
    assert drawn(ht.plot.digits(quad, ht.reference(LAGRANGE, START, TIMES, 45)))[:, 1].min() > 31


@pytest.mark.slow
def test_axes_go_in_and_come_out_and_nothing_else_is_touched(run, known) -> None:
    before = dict(matplotlib.rcParams)
    figure = Figure()
    plane, solid = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="3d")
    for draw in (ht.plot.phase, ht.plot.herpolhode, ht.plot.drift):
        assert draw(run, axes=plane) is plane
    assert ht.plot.digits(run, known, plane) is plane
    assert ht.plot.error(run, known, plane) is plane
    for draw in (ht.plot.sphere, ht.plot.polhode):
        assert draw(run, axes=solid) is solid
        with pytest.raises(InputError, match="three-dimensional"):
            draw(run, axes=plane)
    with pytest.raises(InputError, match="two-dimensional axes"):
        ht.plot.phase(run, axes=solid)
    rendered(plane)
    assert dict(matplotlib.rcParams) == before
    import matplotlib.pyplot as plt

    assert plt.get_fignums() == []


@pytest.mark.slow
def test_a_film_is_saved_as_gif(run, tmp_path) -> None:
    file = tmp_path / "top.gif"
    ht.plot.animate(run, file, frames=3)
    with Image.open(file) as film:
        assert film.n_frames == 3
    ht.plot.animate(run, frames=2)
    with pytest.raises(InputError, match=r"must be .gif or .mp4; got '.png'"):
        ht.plot.animate(run, tmp_path / "top.png")
    with pytest.raises(InputError, match="cannot be written"):
        ht.plot.animate(run, tmp_path / "none" / "top.gif", frames=1)
    with pytest.raises(InputError, match="must be at least 1"):
        ht.plot.animate(run, frames=0)


def test_mp4_without_ffmpeg_is_refused(run, tmp_path, monkeypatch) -> None:
    from matplotlib.animation import FFMpegWriter

    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(InputError, match="needs ffmpeg"):
        ht.plot.animate(run, tmp_path / "top.mp4")


def test_what_has_no_picture_is_refused(run, known) -> None:
    single = ht.propagate(LAGRANGE, START, [1])
    seen: list[object] = []
    observed = ht.propagate(LAGRANGE, START, TIMES, observer=lambda time, state: seen.append(time))
    for bad, match in (
        (single, "at least two samples; got 1"),
        (observed, "at least two samples; got 0"),
        (3, "must be a motion"),
        (None, "must be a motion"),
    ):
        for draw in (ht.plot.sphere, ht.plot.polhode, ht.plot.herpolhode, ht.plot.phase, ht.plot.animate):
            with pytest.raises(InputError, match=match):
                draw(bad)
    states = run.states.copy()
    states[7, 2] = np.nan
    broken = ht.Trajectory(run.problem, "x", run.times, states, run.outcome, run.time_reached, 1, 1)
    with pytest.raises(InputError, match="sample 7 is not finite"):
        ht.plot.phase(broken)
    short, later = ht.reference(LAGRANGE, START, [1, 2], 10), ht.reference(LAGRANGE, START, TIMES + 1, 10)
    for draw, match in (
        (lambda: ht.plot.sphere(short), "no attitude"),
        (lambda: ht.plot.sphere(known, of="centre"), "its top"),
        (lambda: ht.plot.sphere(known, top=FREE), "top is another than that of the reference"),
        (lambda: ht.plot.sphere(run, of="nose"), "got 'nose'"),
        (lambda: ht.plot.sphere(ht.propagate(FREE, TUMBLING, TIMES), of="centre"), "fixed point"),
        (lambda: ht.plot.phase(run, "gamma4"), "not a component"),
        (lambda: ht.plot.drift(known), "must be a computed motion"),
        (lambda: ht.plot.digits(run, short), "must have the same times"),
        (lambda: ht.plot.error(run, later), "Give the same times"),
        (lambda: ht.plot.error(run, ht.propagate(FREE, START, TIMES)), "same top and start"),
        (lambda: ht.plot.digits(run, ht.reference(LAGRANGE, TUMBLING, TIMES, 10)), "same top and start"),
        (lambda: ht.plot.poincare(ht.events(LAGRANGE, START, 1, "omega3 = 7")), "no point"),
        (lambda: ht.plot.poincare([3]), r"section must be events; got \[3\]"),
        (lambda: ht.plot.poincare(None), "section must be a list; got None"),
        (lambda: ht.plot.poincare(ht.events(LAGRANGE, START, 1, "gamma1"), colours=()), "No colours were given"),
        (lambda: ht.plot.phase(run, colour="nocolour"), "colour must be a colour; got 'nocolour'"),
        (lambda: ht.plot.sphere(run, colour="nocolour"), "colour must be a colour; got 'nocolour'"),
        (lambda: ht.plot.power(run), "test must be a test; got heavy_top in double"),
        (lambda: ht.plot.between([]), r"samples must be errors; got \[\]"),
    ):
        with pytest.raises(InputError, match=match):
            draw()
    assert ht.plot.sphere(known, of="centre", top=LAGRANGE) is not None


def test_a_run_in_a_notebook_shows_its_path_in_a_few_kilobytes(run, known) -> None:
    many = ht.propagate(LAGRANGE, START, np.arange(1, 20001) / 1000)
    sizes = [len(each._repr_html_()) for each in (run, known, many)]
    assert max(sizes) < 12000
    for each in (run, many):
        assert each._repr_html_().count("<svg") == 1
        assert "axis 3" not in each._repr_html_()
    assert "axis 3 in space" in ht.propagate(LAGRANGE, START, TIMES, xi=(1, 0, 0))._repr_html_()
    assert "<svg" not in ht.propagate(LAGRANGE, START, [1])._repr_html_()
    assert path_picture(3, lambda n: (float("nan"), 0, 0), "x") == ""
    assert path_picture(3, lambda n: (1e300, 0, 0), "x") == ""
    assert "&lt;" in path_picture(3, lambda n: (0, 0, 1), "<")
