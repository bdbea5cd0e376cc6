"""Bodies in any axes, irrational data included: known motions against an independent integration."""

import re
from fractions import Fraction
from itertools import permutations
from random import Random
from typing import Any

import mpmath
import pytest
from flint import arb

import heavytop as ht
from heavytop import HEAVY_GYROSTAT, HEAVY_TOP, Attitude, InputError, OutOfReach
from heavytop.exact.bodies import BodyMotion
from heavytop.exact.closed_form import orientation, permuted
from heavytop.exact.flint.balls import midpoint, radius
from heavytop.exact.resolved import resolve
from heavytop.top.attitude import multiplied, rotated, transposed
from heavytop.top.bodies import IDENTITY, principal_axes
from support.full_tensor import integrate, rotation
from support.proofs import assert_overlap

BITS = 110
TILTED = [["0.5", "0.1", "-0.05"], ["0.1", "0.7", "0.02"], ["-0.05", "0.02", "0.9"]]
TOP = ht.Body("15", "9.81", (0, 1, 0), ("0.234375", "0.46875", "0.234375"), "centre of mass")
SPINNING = ht.State(omega=("0", "150", "-4.61538"), attitude=ht.Attitude.quaternion(1, 0, 0, 0))
MOVING = ht.State((1, 2, -3), attitude=ht.Attitude.quaternion(1, 0, 0, 0))
LOPSIDED = ht.Body("2", "9.81", ("0.1", "-0.2", "0.3"), TILTED, "pivot")


def contains(values: list[arb], others: list[Fraction], slack: Fraction) -> bool:
    return all(abs(midpoint(v) - x) <= radius(v) + slack for v, x in zip(values, others, strict=True))


def independent(body: Any, start: Any, time: Fraction) -> list[Fraction]:
    """(Ω, γ, ξ) at ``time`` by Taylor series of q and Ω in the axes given, no principal axes; to some 1e-40."""
    rows = start.attitude.rational_rows(300)
    return integrate(body.tensor, body.moment, body.rotor or (0, 0, 0), rows, start.omega, time)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "start", "time"),
    [
        (TOP, SPINNING, Fraction(1, 10)),
        (LOPSIDED, ht.State((1, 2, -3), attitude=ht.Attitude.euler("ZYX", "30deg", "0.2", "1")), Fraction(-1, 4)),
        (
            ht.Body(
                2,
                "9.81",
                ("0.1", "-0.2", "0.3"),
                ["0.5", "0.7", "0.9", "-0.1", "0.05", "-0.02"],
                "centre of mass",
                rotor=("0.3", 0, -1),
            ),
            ht.State(omega_space=("1.5", -2, "0.25"), attitude=ht.Attitude.axis_angle((1, 2, -2), "0.7")),
            Fraction(1, 2),
        ),
        (
            ht.Body(1, 0, (0, 0, 0), [[2, 1, 1], [1, 2, 1], [1, 1, 2]]),
            ht.State((1, "1/2", "-1/3"), attitude=ht.Attitude.quaternion(1, 0, 0, 0)),
            Fraction(1),
        ),
    ],
    ids=["bruels-cardona-arnold", "angles, backwards", "rotor, about the centre of mass", "free"],
)
def test_a_body_is_known_as_an_independent_integration_has_it(body: Any, start: Any, time: Fraction) -> None:
    system = HEAVY_TOP if body.rotor is None else HEAVY_GYROSTAT
    found = BodyMotion(body, start, system).with_attitude(time, BITS)
    assert contains(found, independent(body, start, time), Fraction(1, 10**36))
    assert max(map(radius, found)) < Fraction(1, 2) ** (BITS - 10)


def test_the_state_at_t_0_is_what_was_given() -> None:
    start = ht.State(omega_space=(1, 2, 3), attitude=ht.Attitude.euler("XYZ", "0.1", "0.2", "0.3"))
    values = BodyMotion(LOPSIDED, start).with_attitude(Fraction(0), BITS)
    rows = start.attitude.rational_rows(400)
    spin = [sum(rows[i][j] * w for i, w in enumerate((1, 2, 3))) for j in range(3)]
    assert contains(values, [*spin, *rows[2], *rows[0]], Fraction(1, 2**390))


def test_principal_axes_diagonalize_exactly_but_for_what_is_left() -> None:
    random = Random(4)
    for _ in range(10):
        root = [[Fraction(random.randint(-9, 9)) for _ in range(3)] for _ in range(3)]
        tensor = [[x + (i == j) for j, x in enumerate(row)] for i, row in enumerate(multiplied(root, transposed(root)))]
        found = principal_axes(tensor, 200)
        assert multiplied(found.axes, transposed(found.axes)) == IDENTITY
        whole = [[found.left[i][j] + (found.moments[i] if i == j else 0) for j in range(3)] for i in range(3)]
        assert multiplied(found.axes, multiplied(whole, transposed(found.axes))) == tuple(map(tuple, tensor))
        largest = max(abs(x) for row in tensor for x in row)
        assert max(abs(x) for row in found.left for x in row) <= largest / 2**190


@pytest.mark.parametrize("moments", [(3, 2, 1), (3, 3, 1), (1, 4, 4), (3 + Fraction(1, 10**90), 2, 1)])
def test_rational_principal_axes_are_found_exactly(moments: Any) -> None:
    rows = Attitude.quaternion(1, 2, -3, 5, normalize=True).exact_rows()
    diagonal = [[Fraction(moments[i] * (i == j)) for j in range(3)] for i in range(3)]
    found = principal_axes(multiplied(rows, multiplied(diagonal, transposed(rows))), 200)
    assert found.exact
    assert sorted(found.moments) == sorted(moments)


def test_moments_that_are_nearly_equal_are_told_apart_and_huge_ones_scaled() -> None:
    near = Fraction(1, 10**45)
    tensor = [[(1 + (i == 0) * Fraction(1, 10**40)) if i == j else near for j in range(3)] for i in range(3)]
    for size in (Fraction(1), Fraction(10) ** 100, Fraction(1, 10**100)):
        found = principal_axes([[size * x for x in row] for row in tensor], 200)
        assert max(abs(x) for row in found.left for x in row) <= size / 2**190


def test_a_tensor_with_two_negative_moments_has_axes() -> None:
    """Its determinant is positive, and its trace far below its entries."""
    size = Fraction(10**29)
    found = principal_axes([[Fraction(1), size, 0], [size, Fraction(1), 1], [0, 1, Fraction(-3)]], 128)
    assert [moment < 0 for moment in sorted(found.moments)] == [True, True, False]
    assert max(abs(x) for row in found.left for x in row) <= size / 2**120


def thin(small: Fraction) -> list[list[Fraction]]:
    """A tensor with irrational axes, one moment near 14 and two near ``small``."""
    v, rest = (1, 2, -3), ((2, 1, 0), (1, 3, 1), (0, 1, 5))
    return [[v[i] * v[j] + small * rest[i][j] for j in range(3)] for i in range(3)]


@pytest.mark.parametrize("power", [20, 90, 130, 300])
def test_what_is_left_of_a_tensor_is_far_below_its_smallest_moment(power: int) -> None:
    tensor = thin(Fraction(1, 10**power))
    found = principal_axes(tensor, 128)
    rest = max(abs(x) for row in found.left for x in row)
    assert 0 < rest < min(found.moments) / 2**120
    # the small moments scale with what is added to v v^T, up to its square
    scaled = sorted(x * 10**power for x in found.moments)[:2]
    wanted = sorted(x * 10**20 for x in principal_axes(thin(Fraction(1, 10**20)), 128).moments)[:2]
    assert all(abs(a / b - 1) < Fraction(1, 10**18) for a, b in zip(scaled, wanted, strict=True))


def test_a_moment_far_below_the_rounding_is_an_answer_or_a_refusal() -> None:
    body = ht.Body(1, 1, (0, 0, 1), thin(Fraction(1, 10**100)), "pivot")
    found = resolve(body, MOVING, 80)
    assert found.uncertainty.rate > 0
    with pytest.raises(OutOfReach, match="times its angular velocity"):
        ht.reference(body, MOVING, [1], 20)
    with pytest.raises(InputError, match="factor above 1e300"):
        _ = ht.Body(1, 1, (0, 0, 1), thin(Fraction(1, 10**320)), "pivot").top


@pytest.mark.slow
def test_axes_under_every_renaming_give_the_same_motion() -> None:
    """The body with its axes permuted moves as before; Ω is an axial vector."""
    start = ht.State((1, 2, -3), attitude=ht.Attitude.quaternion("1/2", "1/2", "-1/2", "1/2"))
    wanted = BodyMotion(LOPSIDED, start).state(Fraction(1), 80)
    for order in permutations(range(3)):
        tensor = [[LOPSIDED.tensor[i][j] for j in order] for i in order]
        body = ht.Body(LOPSIDED.mass, LOPSIDED.gravity, permuted(LOPSIDED.centre, order), tensor, "pivot")
        side = orientation(order)
        renamed = ht.State([side * w for w in permuted(start.omega, order)], permuted(start.gamma, order))
        moved = [side * w for w in permuted(wanted[:3], order)] + [*permuted(wanted[3:], order)]
        assert_overlap(BodyMotion(body, renamed).state(Fraction(1), 80), moved)


@pytest.mark.parametrize("bits", [80, 400])
def test_what_rounding_moves_is_bounded_and_small(bits: int) -> None:
    found = resolve(LOPSIDED, MOVING, bits)
    assert 0 < found.uncertainty.rate < Fraction(1, 2) ** (bits - 20)
    assert 0 < max(found.uncertainty.start) < Fraction(1, 2) ** (bits - 8)


def in_body_axes(resolved, state):
    """Midpoints of (Ω, γ) in the axes of the body."""
    values = [midpoint(x) for x in state]
    return [value for part in (values[:3], values[3:]) for value in rotated(resolved.axes, part)]


def test_an_enclosure_that_ignores_the_rounding_misses_the_true_motion() -> None:
    """A planted fault: data rounded to 40 bits without their uncertainty give balls that do not hold the truth."""
    from heavytop.exact.enclosure.run import Validated

    true = BodyMotion(LOPSIDED, MOVING).state(Fraction(2), 120)
    coarse = resolve(LOPSIDED, MOVING, 40)
    blind = in_body_axes(coarse, Validated(coarse.top, coarse.start).state(Fraction(2), 120))
    assert not contains(true, blind, Fraction(1, 10**25))
    honest = Validated(coarse.top, coarse.start, xi=coarse.xi, uncertainty=coarse.uncertainty)
    values = honest.state(Fraction(2), 12)
    found = in_body_axes(coarse, values)
    widest = max(map(radius, values)) * 2
    assert all(abs(midpoint(t) - x) <= widest for t, x in zip(true, found, strict=True))


@pytest.mark.slow
def test_a_run_of_a_body_comes_back_in_its_axes() -> None:
    start = ht.State((1, 2, -3), attitude=ht.Attitude.euler("ZYX", "30deg", "0.2", "1"))
    for form, eps in ((ht.DOUBLE, 1e-13), (ht.QUAD, 1e-31)):
        run, known = ht.propagate(LOPSIDED, start, [1, 2], form), ht.reference(LOPSIDED, start, [1, 2], 34)
        off = [
            abs(Fraction(a) - Fraction(b))
            for x, y in zip(run.texts(), known.texts(), strict=True)
            for a, b in zip(x, y, strict=True)
        ]
        assert max(off) < eps
        assert abs(run.quaternions() - known.quaternions()).max() < 1e-13
        assert abs(run.positions() - known.positions()).max() < 1e-13
        assert max(summary.max for summary in ht.drift(run).values()) < 100 * eps
    member = ht.ensemble(LOPSIDED, [start, start], [1, 2])[1]
    assert abs(member.to_numpy() - known.to_numpy()).max() < 1e-13
    seen: list[Any] = []
    ht.propagate(LOPSIDED, start, [1], observer=lambda time, state: seen.append([float(x) for x in state[:6]]))
    assert seen[0] == pytest.approx(list(known.to_numpy()[0]), abs=1e-13)


def test_principal_axes_change_no_bit_and_permutations_round_nothing() -> None:
    top, start = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
    body = ht.Body(1, 1, ("1/2", "1/3", "1/5"), (3, 2, 1), "pivot")
    plain, given = ht.propagate(top, start, [1, 5]), ht.propagate(body, start, [1, 5])
    assert plain.states.tolist() == given.states.tolist()
    assert ht.reference(body, start, [5], 20).method == ht.reference(top, start, [5], 20).method


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ht.Body(0, 1, (0, 0, 0), (1, 1, 1)), "mass must be positive; got 0"),
        (lambda: ht.Body(1, "-9.81", (0, 0, 0), (1, 1, 1)), "negative"),
        (lambda: ht.Body(1, 1, (0, 0, 1), (1, 1, 1)), "reference point of the inertia tensor"),
        (lambda: ht.Body(1, 1, (0, 0, 1), (1, 1, 1), "the end"), "'the end'"),
        (lambda: ht.Body(1, 1, (0, 0, 0), (1, 1)), "3, 6 or 9 numbers; got 2"),
        (lambda: ht.Body(1, 1, (0, 0, 0), [[1, 2, 0], [0, 1, 0], [0, 0, 1]]), "not symmetric: I12 = 2, I21 = 0"),
        (lambda: ht.Body(1, 1, (0, 0, 0), [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]), "not symmetric: I12 = 0.1, I21 = 0"),
        (lambda: ht.Body(1, 1, (0, 0, 0), (1, 1, 1, 2, 0, 0)), "principal moments of inertia must be positive"),
        (lambda: ht.Body(1, 1, (0, 0, 0), (1, -1, 1)), "principal moments of inertia must be positive"),
        (lambda: ht.Body("nan", 1, (0, 0, 0), (1, 1, 1)), "nan"),
        (lambda: ht.State((0, 0, 1)), "Neither gamma"),
        (lambda: ht.State(gamma=(0, 0, 1)), "got neither"),
        (lambda: ht.State((0, 0, 1), (0, 0, 1), omega_space=(0, 0, 1)), "got both"),
        (lambda: ht.State(gamma=(0, 0, 1), omega_space=(0, 0, 1)), "omega_space needs an attitude"),
        (lambda: ht.State((0, 0, 1), (1, 0, 0), attitude=ht.Attitude.quaternion(1, 0, 0, 0)), "contradicts"),
        (lambda: ht.State((0, 0, 1), attitude="up"), "must be an Attitude"),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_body_or_start_is_refused(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def test_rotations_of_the_independent_integration_are_rotations() -> None:
    rows = rotation([Fraction(1), Fraction(2), Fraction(3), Fraction(4)])
    assert multiplied(rows, transposed(rows)) == IDENTITY


@pytest.mark.parametrize("angle", ["1e100", "1e300", "-1e1000"])
@pytest.mark.parametrize("place", [1, 2])
def test_angles_of_many_turns_are_known_at_once(angle: str, place: int) -> None:
    angles = ["0.3", "0.5", "0.2"]
    angles[place] = angle
    start = ht.State(("1/10", "2/5", "9/10"), attitude=ht.Attitude.euler("ZYX", *angles))
    known = ht.reference(ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5")), start, [0], 20)
    with mpmath.workdps(1100):
        b, c = (mpmath.mpf(text) for text in angles[1:])
        gamma = (-mpmath.sin(b), mpmath.cos(b) * mpmath.sin(c), mpmath.cos(b) * mpmath.cos(c))
        for value, ball in zip(gamma, known.states[0][3:], strict=True):
            assert abs(value - mpmath.mpf(ball.value)) <= mpmath.mpf(ball.radius)


@pytest.mark.parametrize(
    ("inertia", "about", "diagonal"),
    [
        (("1/2", "1/2", "1/2"), "pivot", "-0.5, -0.5, 0.5"),
        (("1/2", "1/2", "1/2"), "centre of mass", None),
        (("3/2", "1/2", "3/2"), "pivot", None),
        ((1, "1/1000", 1), "pivot", "0, 0, 0.001"),
        ((1, 1e-30, 1), "pivot", None),  # a rod along its axis, rounded
        ((1, 1, 2, "1/2", 0, 0), "pivot", "-0.207107, 1, 1.20711"),
        ((1, 3, 1), "centre of mass", "1, 1, 3"),
        *(((0.1, 0.3 + off, 0.2), "centre of mass", None) for off in (-4e-8, 4e-8)),  # a plate in seven digits
        ((0.1, 0.3001, 0.2), "centre of mass", "0.1, 0.2, 0.3001"),
        ((0.2, 0.2, 0.2, 0.07, 0.07, 0.07), "centre of mass", "0.13, 0.13, 0.34"),
    ],
)
def test_a_tensor_that_is_none_about_the_centre_of_mass_is_a_warning(inertia, about, diagonal) -> None:
    found = ht.Body(1, 1, (0, 1, 0), inertia, about).warnings()
    if diagonal is None:
        assert found == []
        return
    (text,) = found
    assert f"about the centre of mass, of principal moments {diagonal}, is not a rigid body's" in text
    assert ("Possibly, the tensor is about the centre of mass, and was read as about the pivot." in text) == (
        about == "pivot"
    )
    assert ("Possibly, the tensor was already about the centre of mass when" in text) == (about != "pivot")
    assert ("Possibly, the products of inertia have the opposite sign" in text) == (0.07 in inertia)


def test_what_may_be_0_is_printed_as_0_with_its_radius() -> None:
    body = ht.Body(2, "9.81", ("1/10", "2/10", "3/10"), (1, 2, "5/2"), "pivot")
    start = ht.State(omega=(1, -2, "1/2"), attitude=Attitude.axis_angle((1, 1, 1), "180deg"))
    w, *axis = ht.reference(body, start, [0], digits=12).balls("quaternion")[0]
    assert w.value == "0"
    assert 0 < Fraction(w.radius) < Fraction(1, 10**20)
    assert {component.value for component in axis} == {"0.5773502691896"}


def test_the_warning_names_the_principal_moments_that_break_what_a_diagonal_keeps() -> None:
    # 0.0908 + 0.0415 > 0.118, and the principal moments are no body's
    body = ht.Body(1, 0, (0, 0, 0), (0.0908, 0.0415, 0.118, 0.05, 0.01, 0.0))
    (text,) = body.warnings()
    assert re.search(r"exceeds the sum 0\.\d{1,6}|principal moments", text)
    assert "/" not in text
