"""Quaternions, matrices, Euler angles, positions and Ω in space axes, of references and of runs."""

import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from itertools import product

import mpmath
import msgspec
import numpy as np
import pytest

import heavytop as ht
from heavytop import InputError, Reference
from heavytop.precision import cross, dot
from heavytop.top.attitude import SEQUENCES, rows_of_euler
from support.full_tensor import integrate_top, rotation

TOP = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
SLEEPING = ht.HeavyTop((2, 2, 1), 1, (0, 0, 1)), ht.State((0, 0, 3), (0, 0, 1))
NAMES = ("quaternion", "matrix", "euler:ZXZ", "position", "omega-space")
DIGITS = 40


def flat(value: object) -> list:
    return [part for each in value for part in flat(each)] if isinstance(value, list) else [value]


@pytest.fixture(scope="module")
def known() -> Reference:
    return ht.reference(TOP, START, [2, "-1/2", 0], DIGITS, attitude=True)


@pytest.mark.slow
@pytest.mark.parametrize(("place", "time"), [(0, Fraction(2)), (1, Fraction(-1, 2))])
def test_a_reference_agrees_with_an_independent_integration(known: Reference, place: int, time: Fraction) -> None:
    found = integrate_top(TOP, START, time, (Fraction(-4, 5), 0, Fraction(3, 5)), DIGITS + 8)
    omega, gamma, xi = found[:3], found[3:6], found[6:]
    rows = [xi, [*cross(gamma, xi)], gamma]
    expected = {"matrix": rows} | {
        name: [dot(row, vector) for row in rows] for name, vector in (("position", TOP.centre), ("omega-space", omega))
    }
    for name, values in expected.items():
        for ball, value in zip(flat(known.balls(name)[place]), flat(values), strict=True):
            assert Fraction(ball.radius) <= Fraction(1, 10**DIGITS)
            assert abs(Fraction(ball.value) - value) <= Fraction(ball.radius) + Fraction(1, 10 ** (DIGITS + 4))


def test_a_matrix_is_orthogonal_as_balls_and_belongs_to_the_quaternion(known: Reference) -> None:
    from flint import arb, ctx

    def balls(value: object) -> object:
        return [balls(v) for v in value] if isinstance(value, list) else arb(value.value, value.radius)

    before, ctx.dps = ctx.dps, DIGITS + 10
    try:
        for matrix, q in zip(known.balls("matrix"), known.balls("quaternion"), strict=True):
            rows, parts = balls(matrix), balls(q)
            for i, j in product(range(3), repeat=2):
                entry = sum((rows[i][k] * rows[j][k] for k in range(3)), arb(0))
                assert entry.contains(int(i == j))
                assert float(entry.rad()) < 10.0 ** -(DIGITS - 1)
                assert rotation(parts)[i][j].overlaps(rows[i][j])
            assert sum((part * part for part in parts), arb(0)).contains(1)
    finally:
        ctx.dps = before


def test_every_output_comes_to_the_digits_asked_whatever_the_scale(known: Reference) -> None:
    for scale in ("1e-100", "1", "1e100"):
        point = [Fraction(scale), 0, Fraction(scale) / 7]
        size = abs(point[0])
        for ball in flat(known.balls("position", point=point)):
            assert Fraction(ball.radius) <= size / 10**DIGITS
    fast = ht.reference(
        ht.HeavyTop((3, 2, 1), 1, (0, 0, 1)),
        ht.State((Fraction(10) ** 30, 1, 1), START.gamma),
        [Fraction(1, 10**30)],
        25,
        attitude=True,
    )
    for name in NAMES:
        for ball in flat(fast.balls(name)):
            assert Fraction(ball.radius) <= max(1, abs(Fraction(ball.value))) / Fraction(10**25)


def test_arrays_have_their_shapes_and_agree_with_texts_and_balls(known: Reference) -> None:
    run = ht.propagate(TOP, START, [Fraction(1, 4), 2], attitude=True)
    for found, count in ((known, 3), (run, 2)):
        arrays = found.quaternions(), found.matrices(), found.euler("ZXZ"), found.positions(), found.omega_space()
        assert [array.shape for array in arrays] == [(count, *s) for s in ((4,), (3, 3), (3,), (3,), (3,))]
        for name, array in zip(NAMES, arrays, strict=True):
            texts = np.array(found.texts(name), dtype=float)
            assert texts.shape == array.shape
            assert abs(texts - array).max() < 2e-15
    assert abs(run.quaternions()[1] - known.quaternions()[0]).max() < 1e-14


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["extended", "quad"])
def test_texts_of_a_run_are_exact_functions_of_its_native_numbers(precision: str) -> None:
    run = ht.propagate(TOP, START, [1], precision, attitude=True)
    digits = run.problem.precision.digits
    with mpmath.workdps(digits + 20):
        gamma, xi = ([mpmath.mpf(text) for text in part] for part in (run.texts()[0][3:], run.texts("matrix")[0][0]))
        eta = [gamma[(i + 1) % 3] * xi[(i + 2) % 3] - gamma[(i + 2) % 3] * xi[(i + 1) % 3] for i in range(3)]
        q = [mpmath.mpf(text) for text in run.texts("quaternion")[0]]
        assert abs(mpmath.norm(q) - 1) < 4 * mpmath.mpf(10) ** -digits
        for row, expected in zip(rotation(q), (xi, eta, gamma), strict=True):
            assert max(abs(a - b) for a, b in zip(row, expected, strict=True)) < 20 * mpmath.mpf(10) ** -(digits - 1)
    assert abs(run.quaternions() - np.array(run.texts("quaternion"), dtype=float)).max() < 1e-16


def test_the_attitude_beside_a_run_leaves_its_shape_and_nearly_its_bits() -> None:
    plain, beside = (ht.propagate(TOP, START, [1, 2], attitude=attitude) for attitude in (None, True))
    assert plain.states.shape == beside.states.shape == (2, 6)
    assert abs(plain.to_numpy() - beside.to_numpy()).max() < 1e-14
    assert np.array_equal(
        beside.matrices()[:, 0], ht.propagate(TOP, START, [1, 2], xi=("-4/5", 0, "3/5")).to_numpy()[:, 6:]
    )
    assert "ξ" not in repr(beside)


def test_the_sign_goes_on_through_w_0_forwards_and_backwards_in_any_order() -> None:
    times = [Fraction(k, 10) for k in range(-40, 41)]
    sleeping = ht.reference(*SLEEPING, times[::-1], 20, attitude=True).quaternions()[::-1]
    half = np.array([3 * float(time) / 2 for time in times])
    assert abs(sleeping - np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)).max() < 1e-15
    run = ht.propagate(*SLEEPING, times[41:], attitude=True).quaternions()
    assert abs(run - sleeping[41:]).max() < 1e-13


def test_a_start_of_w_0_has_its_first_component_positive() -> None:
    hanging = ht.State((0, 0, 1), (0, 0, -1))
    for found in (
        ht.reference(SLEEPING[0], hanging, [0], 20, attitude=True),
        ht.propagate(TOP, hanging, [0], attitude=True),
    ):
        assert abs(found.quaternions()[0] - [0, 1, 0, 0]).max() < 1e-15
    given = ht.State((0, 0, 1), attitude=ht.Attitude.quaternion(0, "-3/5", "-4/5", 0))
    for found in (ht.reference(TOP, given, [0], 20), ht.propagate(TOP, given, [0])):
        assert abs(found.quaternions()[0] - [0, 0.6, 0.8, 0]).max() < 1e-15


@pytest.mark.parametrize("form", ["double", "extended"])
def test_components_of_one_size_have_the_sign_of_the_convention(form: str) -> None:
    """Which of them is the largest hangs on the rounding of the matrix."""
    free = ht.HeavyTop((3, 2, 1), 0, (0, 0, 0))
    for q in product((-1, 0, 1), repeat=4):
        if any(q):
            still = ht.State((0, 0, 0), attitude=ht.Attitude.quaternion(*q, normalize=True))
            run = ht.propagate(free, still, [1], form)
            expected = np.array(q) / np.linalg.norm(q) * next(part for part in q if part)
            assert abs(run.quaternions()[0] - expected).max() < 1e-15
            assert abs(np.array(run.texts("quaternion")[0], dtype=float) - expected).max() < 1e-15


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_euler_angles_of_every_sequence_rebuild_the_matrix(sequence: str, known: Reference) -> None:
    run = ht.propagate(TOP, START, [Fraction(k, 3) for k in range(1, 20)], attitude=True)
    for found in (known, run):
        # at t = 0 R22 = -1, which is gimbal lock of YXY and YZY
        for angles, matrix in zip(found.euler(sequence.lower())[:-1], found.matrices()[:-1], strict=True):
            assert abs(np.array(rows_of_euler(sequence, angles, math)) - matrix).max() < 1e-13
            low, high = (0, np.pi) if sequence[0] == sequence[2] else (-np.pi / 2, np.pi / 2)
            assert low <= angles[1] <= high


@pytest.mark.slow
@pytest.mark.parametrize("up", [1, -1])
def test_gimbal_lock_is_said_and_the_middle_angle_is_right(up: int) -> None:
    start = ht.State((0, 0, 3), (0, 0, up))
    known = ht.reference(SLEEPING[0], start, [1, 2], 30, attitude=True)
    run = ht.propagate(SLEEPING[0], start, [1, 2], attitude=True)
    for found in (known, run):
        angles = found.euler("ZXZ")
        assert np.isnan(angles[:, [0, 2]]).all()
        assert abs(angles[:, 1] - (0 if up > 0 else np.pi)).max() < 1e-15
        assert np.isfinite(found.euler("ZYX")).all()
    assert [known.balls("euler:ZXZ")[0][place].radius for place in (0, 2)] == ["inf", "inf"]
    assert run.texts("euler:ZXZ")[0][0] == "nan"
    locked = ht.State((1, 0, 0), attitude=ht.Attitude.euler("ZYX", "30deg", "90deg", 0))
    found = ht.reference(ht.HeavyTop((3, 2, 1), 0, (0, 0, 0)), locked, [0, 1], 20)
    assert np.isnan(found.euler("ZYX")[:, [0, 2]]).all()
    assert abs(found.euler("ZYX")[:, 1] - np.pi / 2).max() < 1e-12


def test_near_gimbal_lock_a_reference_takes_more_bits() -> None:
    tilt = ht.Attitude.euler("ZXZ", "1/3", Fraction(1, 10**12), "1/7")
    angles = ht.reference(TOP, ht.State((0, 0, 0), attitude=tilt), [0], 30).balls("euler:ZXZ")[0]
    for ball, expected in zip(angles, (Fraction(1, 3), Fraction(1, 10**12), Fraction(1, 7)), strict=True):
        assert abs(Fraction(ball.value) - expected) <= Fraction(ball.radius) <= Fraction(1, 10**30)


def test_angles_at_the_cut_are_about_pi() -> None:
    half_turn = ht.State((0, 0, 0), attitude=ht.Attitude.euler("ZYX", "180deg", 0, 0))
    free = ht.HeavyTop((3, 2, 1), 0, (0, 0, 0))
    for found in (ht.reference(free, half_turn, [0, 1], 30), ht.propagate(free, half_turn, [0, 1])):
        assert abs(abs(found.euler("ZYX")[:, 0]) - np.pi).max() < 1e-15


def test_a_copy_and_a_reading_of_a_reference_give_its_outputs(known: Reference) -> None:
    read = msgspec.json.decode(msgspec.json.encode(known), type=Reference)
    for copy in (read, pickle.loads(pickle.dumps(known))):
        assert copy == known
        for name in NAMES:
            for ball, other in zip(flat(copy.balls(name)), flat(known.balls(name)), strict=True):
                assert (
                    abs(Fraction(ball.value) - Fraction(other.value))
                    <= Fraction(ball.radius) + Fraction(other.radius)
                    <= Fraction(1, 10**DIGITS)
                )


def test_outputs_are_right_from_any_thread(known: Reference) -> None:
    fresh = msgspec.json.decode(msgspec.json.encode(known), type=Reference)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda name: fresh.balls(name), [*NAMES, *NAMES]))
    assert found[:5] == found[5:] == [fresh.balls(name) for name in NAMES]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("quaternions", {}, "Unknown output"),
        ("euler", {}, "need a sequence"),
        ("euler:ABC", {}, "Unknown sequence"),
        ("matrix:ZXZ", {}, "Unknown output"),
        ("", {}, "Unknown output"),
        ("position", {"point": (1, 2)}, "point must have 3 numbers; got 2"),
        ("position", {"point": (1, 2, "nan")}, "not a finite number"),
        ("position", {"pivot": (1, 2, "1e400")}, "too large"),
        ("matrix", {"point": (1, 2, 3)}, "no point"),
    ],
)
def test_what_is_no_output_is_refused(known: Reference, name: str, options: dict, message: str) -> None:
    run = ht.propagate(TOP, START, [1], attitude=True)
    for ask in (known.texts, known.balls, run.texts):
        with pytest.raises(InputError, match=message):
            ask(name, **options)


def test_without_an_attitude_the_remedy_is_told() -> None:
    for found in (ht.reference(TOP, START, [1], 10), ht.propagate(TOP, START, [1])):
        for ask in (found.quaternions, found.matrices, found.positions, found.omega_space):
            with pytest.raises(InputError, match="attitude=True"):
                ask()
        with pytest.raises(InputError, match="attitude=True"):
            found.euler("ZXZ")


def test_a_point_and_a_pivot_shift_the_position(known: Reference) -> None:
    run = ht.propagate(TOP, START, [2], attitude=True)
    for found, place in ((known, 0), (run, 0)):
        matrix = found.matrices()[place]
        assert abs(found.positions(("1", "2", "-1/2"))[place] - matrix @ [1, 2, -0.5]).max() < 1e-14
        shifted = found.positions(pivot=(1, 0, "-7")) - found.positions()
        assert abs(shifted - [1, 0, -7]).max() < 1e-14


def test_no_sample_and_a_run_that_stopped_have_empty_or_finite_outputs() -> None:
    stopped = ht.propagate(TOP, START, [1], attitude=True, step_limit=1)
    assert stopped.quaternions().shape == (0, 4)
    assert stopped.matrices().shape == (0, 3, 3)
    assert stopped.texts("quaternion") == []
    assert stopped.euler("ZXZ").shape == (0, 3)
