"""Derivatives from Python and from the command line: shapes, guards, what a Jacobian is worth, and its conventions."""

import json
from fractions import Fraction
from functools import partial

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import InputError, OutOfReach
from support.helpers import DATA, START, TOP
from support.in_process import heavytop

TIMES = [1, "3/2"]
OPTIONS = [part for name, value in DATA.items() for part in (f"--{name}", value)]
COMMAND = ["reference", *OPTIONS, "--times", "0,1", "--digits", "20"]


@pytest.fixture(scope="module")
def known():
    return ht.reference(TOP, START, TIMES, 25, derivatives="all")


@pytest.mark.slow
def test_arrays_have_the_shapes_that_were_asked_for(known):
    found = known.derivatives_numpy()
    assert {name: part.shape for name, part in found.items()} == {"start": (2, 6, 6), "data": (2, 6, 6)}
    alone = ht.reference(TOP, START, TIMES, 25, derivatives="start")
    assert alone.derivatives_numpy().shape == (2, 6, 6)
    assert np.array_equal(alone.derivatives_numpy(), found["start"])
    data = ht.reference(TOP, START, TIMES, 25, derivatives="data")
    assert list(data.derivatives_numpy()) == ["data"]
    with pytest.raises(InputError, match="no derivatives by the start"):
        data.lyapunov()


@pytest.mark.slow
def test_the_lyapunov_exponent_is_that_of_the_matrix(known):
    for time, exponent, matrix in zip((1, 1.5), known.lyapunov(), known.derivatives_numpy()["start"], strict=True):
        assert abs(float(exponent.value) - np.log(np.linalg.svd(matrix)[1][0]) / time) < 1e-14
        assert float(exponent.radius) < 1e-23
    assert ht.reference(TOP, START, [0], 25, derivatives="start").lyapunov() == [None]


def test_digits_of_a_jacobian_are_counted_where_it_is_wrong(known):
    right = known.derivatives_numpy()["start"]
    assert ht.score_derivatives(TIMES, right, top=TOP, start=START, require=15).passed
    wrong = right.copy()
    wrong[1, 2, 4] += 1e-9
    score = ht.score_derivatives(TIMES, wrong, top=TOP, start=START, require=12)
    assert score.passed is False
    assert score.worst[1] == "∂Ω3/∂γ2(0)"
    assert abs(score.digits_right - 9) < 0.01
    assert score.digits[0] > 15
    assert "∂Ω3/∂γ2(0)" in repr(score)


@pytest.mark.slow
def test_text_of_many_digits_is_scored_to_its_last(known):
    texts = [[[ball.value for ball in row] for row in rows] for rows in known.derivatives.start]
    score = ht.score_derivatives(TIMES, texts, top=TOP, start=START)
    assert 24 < score.digits_right <= score.of_digits < 35


def test_data_derivatives_are_scored_by_their_names(known):
    data = known.derivatives_numpy()["data"]
    data[0, 4, 1] *= -1
    score = ht.score_derivatives(TIMES, data, top=TOP, start=START, derivatives="data")
    assert score.worst[0] == "∂γ2/∂I2"


def test_a_jacobian_transposed_or_projected_is_told(known):
    right = known.derivatives_numpy()["start"]
    transposed = ht.score_derivatives(TIMES, right.transpose(0, 2, 1), top=TOP, start=START)
    assert "transposed" in transposed.diagnosis[0]
    gamma = np.array([0, 0, 0, 0.6, 0, 0.8])
    held = ht.score_derivatives(TIMES, right @ (np.eye(6) - np.outer(gamma, gamma)), top=TOP, start=START)
    assert "unit sphere" in held.diagnosis[0]
    assert not ht.score_derivatives(TIMES, right, top=TOP, start=START).diagnosis


def test_an_entry_that_is_not_finite_is_an_outcome(known):
    wrong = known.derivatives_numpy()["start"]
    wrong[1, 0, 0] = np.nan
    score = ht.score_derivatives(TIMES, wrong, top=TOP, start=START, require=3)
    assert (score.outcome, score.passed, len(score.digits)) == ("non_finite", None, 1)
    wrong[0] = np.inf
    score = ht.score_derivatives(TIMES, wrong, top=TOP, start=START, require=3)
    assert (score.outcome, score.passed, score.digits_right) == ("non_finite", None, None)


IRRATIONAL = [["3", "1/7", 0], ["1/7", "2", 0], [0, 0, "3/2"]]
SYMMETRIC = ht.HeavyTop((2, 2, 1), 1, (0, 0, 1))


def reference(top=TOP, times=TIMES, **options):
    return partial(ht.reference, top, START, times, 20, **options)


def scored(jacobians, **options):
    return partial(ht.score_derivatives, TIMES, jacobians, top=TOP, start=START, **options)


@pytest.mark.parametrize(
    ("call", "error", "why"),
    [
        (lambda: reference()().derivatives_numpy(), InputError, "has no derivatives"),
        *(
            (reference(derivatives=which), InputError, "derivatives must be")
            for which in ("", "Start", "both", 1, True, ["start"])
        ),
        (reference(SYMMETRIC, ["1e9"], derivatives="start"), OutOfReach, "derivatives at t = 1"),
        (
            reference(ht.Body(1, 1, ("1/2", 0, 0), IRRATIONAL, "pivot"), [1], derivatives="start"),
            InputError,
            "Derivatives need exact data",
        ),
        (scored(np.zeros((2, 6, 6)), derivatives="all"), InputError, "cannot be scored"),
        (scored(np.zeros((2, 6))), InputError, "shape"),
        (scored(np.zeros((2, 5, 6))), InputError, "shape"),
        (scored(np.zeros((3, 6, 6))), InputError, "equally many; got 2 and 3"),
        (scored([np.zeros((6, 6)), np.zeros((6, 5))]), InputError, r"jacobians\[1\]"),
        (scored([[["x"] * 6] * 6] * 2), InputError, "x"),
        (scored(None), InputError, "jacobians"),
        (scored([]), InputError, "equally many; got 2 and 0"),
    ],
)
def test_what_has_no_derivatives_or_is_none_is_refused(call, error, why):
    with pytest.raises(error, match=why):
        call()


@pytest.mark.slow
def test_the_command_line_prints_every_entry_at_80_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    shown = heavytop(*COMMAND, "--derivatives", "all")
    assert shown.returncode == 0, shown.stderr
    assert max(map(len, shown.stdout.splitlines())) <= 80
    for entry in ("∂Ω1/∂Ω1(0)", "∂γ3/∂γ3(0)", "∂Ω1/∂I1", "∂γ3/∂n3", "finite-time Lyapunov exponent"):
        assert entry in shown.stdout


def test_the_json_has_the_key_and_no_other():
    found = json.loads(heavytop(*COMMAND, "--derivatives", "start", "--json").stdout)
    assert set(found["derivatives"]) == {"method", "start", "lyapunov"}
    assert found["derivatives"]["method"].startswith("validated")
    assert np.array(found["derivatives"]["start"]).shape == (2, 6, 6)
    assert found["derivatives"]["lyapunov"][0] is None
    assert "derivatives" not in json.loads(heavytop(*COMMAND, "--json").stdout)


def test_a_word_that_is_none_ends_with_cause_and_remedy():
    shown = heavytop(*COMMAND, "--derivatives", "gamma")
    assert (shown.returncode, '"start", "data" or "all"' in shown.stderr) == (2, True)


def _tilted(centre=("1/2", "1/3", "1/5"), omega=("1/10", "2/5", "9/10")):
    """A body whose tensor A diag(3, 2, 1) Aᵀ is not diagonal in the axes given; A is rational."""
    axes = [[Fraction(a, 3) for a in row] for row in ((1, 2, 2), (2, 1, -2), (2, -2, 1))]
    moments = list(enumerate((3, 2, 1)))
    tensor = [[sum(a[k] * m * b[k] for k, m in moments) for b in axes] for a in axes]
    body = ht.Body(mass=1, gravity=1, centre=centre, inertia=tensor, about="pivot")
    return body, ht.State(omega=omega, gamma=("3/5", 0, "4/5"))


@pytest.mark.slow
@pytest.mark.parametrize("place", [0, 2])
def test_derivatives_of_a_body_are_in_the_axes_given(place):
    step = Fraction(1, 10**15)

    def ends(**varied):
        found = []
        for sign in (1, -1):
            moved = {name: [*map(Fraction, value)] for name, value in varied.items()}
            for value in moved.values():
                value[place] += sign * step
            found.append(ht.reference(*_tilted(**moved), [2], 50).states[0])
        return [(Fraction(a.value) - Fraction(b.value)) / (2 * step) for a, b in zip(*found, strict=True)]

    known = ht.reference(*_tilted(), [2], 25, derivatives="all").derivatives
    for values, matrix, column in (
        (ends(omega=("1/10", "2/5", "9/10")), known.start, place),
        (ends(centre=("1/2", "1/3", "1/5")), known.data, 3 + place),
    ):
        for value, row in zip(values, matrix[0], strict=True):
            assert abs(value - Fraction(row[column].value)) < Fraction(1, 10**22)
