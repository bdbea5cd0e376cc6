"""The figures: their data against independent values, and the files themselves."""

from fractions import Fraction
from xml.etree import ElementTree

import numpy
import pytest

from heavytop.features.claims.figures import FIGURES, PAPER_FIGURES, draw_figures, exact_curves, true_curves
from heavytop.features.claims.library.ershkov import PartialCase
from support.in_process import heavytop


def case(ratio: int) -> PartialCase:
    return PartialCase(Fraction(1), Fraction(1), Fraction(1, ratio))


@pytest.mark.parametrize(("number", "slope"), [(6, 4.5), (7, 0.5), (8, 0.0)])
def test_figs_6_to_8_are_lines_of_no_top(number, slope):
    figure = next(figure for figure in PAPER_FIGURES if figure.number == number)
    t = numpy.linspace(-1, 1, 9)
    assert not figure.consistent
    assert numpy.allclose(figure.values(t), slope * t, atol=1e-10)


def test_figs_2_to_5_are_those_of_a_top():
    assert [figure.number for figure in PAPER_FIGURES if figure.consistent] == [2, 3, 4, 5]
    assert [figure.implied_ratio for figure in PAPER_FIGURES if figure.consistent] == [6, 2, 6, 2]


@pytest.mark.parametrize(
    ("ratio", "time", "distance"),
    [(2, "1/10", 0.0024912), (2, "1", 0.173905), (6, "1/10", 0.181054), (6, "1", 2.920776)],
)
def test_the_drawn_truth_and_claim_are_as_far_apart_as_they_are(ratio, time, distance):
    # distances computed to 50 digits by an independent integration
    times = [-Fraction(time), Fraction(0), Fraction(time)]
    truth, _ = true_curves(case(ratio), times)
    ours = exact_curves(case(ratio).solves, times)
    found = numpy.abs(truth.states[-1, :3] - ours.states[-1, :3]).max()
    assert abs(found - distance) < 1e-6


def test_angles_of_the_truth_satisfy_3_2():
    for ratio in (2, 6):
        curves, _ = true_curves(case(ratio), [Fraction(index, 10) for index in range(-20, 21)])
        phi, theta, _ = curves.angles.T
        away = numpy.arange(len(phi)) != 20
        gamma = numpy.stack([numpy.sin(theta) * numpy.sin(phi), numpy.sin(theta) * numpy.cos(phi), numpy.cos(theta)], 1)
        assert numpy.allclose(gamma[away], curves.states[away, 3:6], atol=1e-12)
        assert numpy.abs(numpy.diff(curves.angles, axis=0)).max() < 1.5


@pytest.mark.slow
def test_the_files_of_the_command_are_complete_and_the_same_every_time(tmp_path, monkeypatch):
    one_of_each = {name: FIGURES[name] for name in ("fig2", "truth-ratio2", "momentum-sphere")}
    monkeypatch.setattr("heavytop.features.claims.figures.FIGURES", one_of_each)
    assert heavytop("figures", "--out", "one", cwd=tmp_path).returncode == 0
    second = draw_figures(tmp_path / "two")
    names = [file.name for file in second]
    assert names[:2] == ["fig2.svg", "fig2.png"]
    assert {"truth-ratio2.svg", "momentum-sphere.svg"} <= set(names)
    assert {file.name for file in (tmp_path / "one").iterdir()} == set(names)
    for two in second:
        one = tmp_path / "one" / two.name
        assert one.read_bytes() == two.read_bytes()
        if one.name == "truth-ratio2.svg":
            for branch, time in (("as printed", "0.0100"), ("smooth branch", "0.2014")):
                assert f"{branch}: Ω off by 1 % of α at t = {time}" in one.read_text("utf-8")
        if one.suffix == ".svg":
            assert ElementTree.parse(one).getroot().tag.endswith("svg")
        else:
            assert int.from_bytes(one.read_bytes()[16:20], "big") >= 800
