"""What explains a motion that is off: planted mistakes are named, honest methods and near misses are not accused."""

import random
from fractions import Fraction

import numpy as np
import pytest

from heavytop.cases import CASES
from heavytop.features.score.diagnose import hypotheses
from heavytop.features.score.diagnose.diagnosis import diagnose
from heavytop.features.score.diagnose.samples import motion
from heavytop.features.score.diagnose.search import Diagnosis
from heavytop.features.score.text import diagnosis_text, sentence
from heavytop.integrate.heyoka.engines import compiled
from heavytop.measure.scalar import roundings
from heavytop.precision import DOUBLE, QUAD, cross, real
from heavytop.top.attitude import rotation_of
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, Parameters, heavy_top
from heavytop.top.heavy_top import HeavyTop, State

SHIFT = Fraction(1, 7)


def number(source: random.Random, low: int, high: int, denominator: int) -> Fraction:
    return Fraction(source.randint(low * denominator, high * denominator), denominator)


def problem(seed: int) -> tuple[HeavyTop, State, list[Fraction]]:
    """A top without symmetry, a start, and 12 times up to some turns."""
    source = random.Random(seed)
    inertia = source.sample([Fraction(n, 12) for n in range(12, 48, 3)], 3)
    centre = [number(source, 1, 2, 7) * source.choice((1, -1)) / 2 for _ in range(3)]
    omega = [number(source, 1, 3, 10) * source.choice((1, -1)) / 2 for _ in range(3)]
    start = State(omega, [number(source, -1, 1, 9) + Fraction(1, 50) for _ in range(3)]).normalized(16)
    step = source.choice((Fraction(1, 4), Fraction(1, 2), Fraction(3, 4)))
    return HeavyTop(inertia, number(source, 1, 4, 12), centre), start, [step * k for k in range(1, 13)]


def runge_kutta(
    top: HeavyTop,
    start: State,
    times: list[Fraction],
    step: float = 0.02,
    signs: tuple[int, int] = (1, 1),
    further: int = 0,
    negated: int | None = None,
) -> np.ndarray:
    """The states by the classical method of order 4: an honest motion, off by its own error.

    signs: of the products M × Ω and γ × Ω.  further: steps too many in each interval.  negated: the component whose
    derivative has the other sign.
    """
    given = Parameters([float(v) for v in top.inertia], [float(v) for v in top.moment], 0)
    free = Parameters(given.inertia, [0.0] * 3, 0)

    def slope(y: np.ndarray) -> np.ndarray:
        whole, products = np.array(heavy_top(given, y)), np.array(heavy_top(free, y))
        slopes = whole + products * np.repeat(np.subtract(signs, 1), 3)
        return slopes if negated is None else slopes * np.where(np.arange(6) == negated, -1, 1)

    state, at, found = np.array([float(v) for v in start.flat]), 0.0, []
    for time in times:
        count = max(1, round(abs(float(time) - at) / step))
        h = (float(time) - at) / count
        for _ in range(count + further):
            a = slope(state)
            b = slope(state + h / 2 * a)
            c = slope(state + h / 2 * b)
            state = state + h / 6 * (a + 2 * b + 2 * c + slope(state + h * c))
        at = float(time)
        found.append(state)
    return np.array(found)


def midpoint(top: HeavyTop, start: State, times: list[Fraction], step: float) -> np.ndarray:
    """The same by the implicit midpoint rule, which is symplectic: its error is a lag in time."""
    given = Parameters([float(v) for v in top.inertia], [float(v) for v in top.moment], 0)
    state, at, found = np.array([float(v) for v in start.flat]), 0.0, []
    for time in times:
        count = max(1, round((float(time) - at) / step))
        h = (float(time) - at) / count
        for _ in range(count):
            after = state
            for _ in range(15):
                after = state + h * np.array(heavy_top(given, (state + after) / 2))
            state = after
        at = float(time)
        found.append(state)
    return np.array(found)


def found(top: HeavyTop, start: State, times: list[Fraction], states: np.ndarray, error: float | None = None) -> list:
    rows = [tuple(Fraction(value) for value in state) for state in states]
    return diagnose(top, start, HEAVY_TOP, times, rows, DOUBLE, error)


PLANTED = {
    "gamma_down": lambda top, start, times, y: (top, start, times, y * [1, 1, 1, -1, -1, -1]),
    "momentum": lambda top, start, times, y: (top, start, times, y * [*map(float, top.inertia), 1, 1, 1]),
    "weight_sign": lambda top, start, times, y: (HeavyTop(top.inertia, -top.weight, top.centre), start, times, y),
    "start_gamma_sign": lambda top, start, times, y: (top, State(start.omega, [-g for g in start.gamma]), times, y),
    "weight": lambda top, start, times, y: (HeavyTop(top.inertia, top.weight * SHIFT * 6, top.centre), start, times, y),
    "inertia_axes": lambda top, start, times, y: (
        HeavyTop([top.inertia[i] for i in (1, 0, 2)], top.weight, top.centre), start, times, y),
    "start": lambda top, start, times, y: (
        top, State([start.omega[0] + Fraction(1, 10), *start.omega[1:]], start.gamma), times, y),
    "top": lambda top, start, times, y: (
        HeavyTop([*top.inertia[:2], top.inertia[2] + Fraction(1, 2)], top.weight, top.centre), start, times, y),
    "times_shifted": lambda top, start, times, y: (top, start, [t + SHIFT for t in times], y),
    "time_unit": lambda top, start, times, y: (top, start, [t * 1000 for t in times], y),
    "time_reversed": lambda top, start, times, y: (top, start, [-t for t in times], y),
    "start_row_missing": lambda top, start, times, y: (
        top, start, times, np.vstack([[float(v) for v in start.flat], y[:-1]])),
    "rows_reversed": lambda top, start, times, y: (top, start, times, y[::-1]),
    "rows_off_by_one": lambda top, start, times, y: (top, start, times[:-1], y[1:]),
    "rows_late": lambda top, start, times, y: (top, start, times[1:], y[:-1]),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "kind"), list(enumerate(PLANTED, 20)))
def test_a_planted_mistake_is_named(kind: str, seed: int) -> None:
    top, start, times = problem(seed)
    states = runge_kutta(top, start, times)
    (told,) = found(*PLANTED[kind](top, start, times, states))
    assert told.kind == kind
    assert told.left is not None
    assert told.left < 0.01 * told.error
    expected = {
        "weight": {"P": top.weight},
        "start": {"Ω1": start.omega[0]},
        "top": {"I3": top.inertia[2]},
        "times_shifted": {"shift": -SHIFT},
        "time_unit": {"factor": Fraction(1, 1000)},
    }.get(kind, {})
    for name, value in expected.items():
        assert float(Fraction(told.numbers[name])) == pytest.approx(float(value), rel=1e-4)
    assert set(told.numbers) == set(expected) | ({"axes"} if kind == "inertia_axes" else set())
    sentence = diagnosis_text(told)
    assert sentence.endswith(".")
    assert len(sentence) < 240


@pytest.mark.slow
@pytest.mark.parametrize(
    ("signs", "kind"),
    [
        ((1, -1), "kinematic_sign"),
        ((-1, 1), "gyroscopic_sign"),
        ((-1, -1), "both_signs"),
        ((0, 1), "gyroscopic_missing"),
    ],
)
def test_a_sign_in_the_equations_is_told(signs: tuple[int, int], kind: str) -> None:
    top, start, times = problem(41)
    (told,) = found(top, start, times, runge_kutta(top, start, times, signs=signs))
    assert (told.kind, told.numbers) == (kind, {})
    assert told.left < 1e-5 * told.error
    assert ("sign" in diagnosis_text(told)) == (0 not in signs)


@pytest.mark.slow
def test_a_sign_in_the_equations_of_a_symmetric_body_is_told_though_another_body_moves_so() -> None:
    top, start = HeavyTop(("1.3", "1.3", "0.9"), 1, (0, 0, 1)), State(("0.02", "0.01", 4), (0, 0, 1))
    times = [Fraction(k, 20) for k in range(1, 41)]
    (told,) = found(top, start, times, runge_kutta(top, start, times, signs=(-1, 1)))
    assert told.kind == "gyroscopic_sign"


@pytest.mark.slow
def test_one_equation_with_the_other_sign_is_named() -> None:
    top, start, times = problem(45)
    times = [time / 4 for time in times]
    (told,) = found(top, start, times, runge_kutta(top, start, times, 0.01, negated=4))
    assert (told.kind, told.numbers) == ("component_sign", {"column": "γ2"})
    assert "equation of γ2 has the opposite sign" in diagnosis_text(told)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("further", "said"), [(1, "one step too long (51 steps"), (-1, "one step too short (49 steps")]
)
def test_a_step_too_many_in_each_interval_is_named(further: int, said: str) -> None:
    top, start, _ = problem(46)
    times = [Fraction(3, 10) * k for k in range(1, 13)]
    (told,) = found(top, start, times, runge_kutta(top, start, times, 0.006, further=further))
    assert told.kind == "time_unit"
    assert told.numbers["steps"] == str(50 * further)
    assert said in diagnosis_text(told)


@pytest.mark.slow
def test_columns_in_any_order_are_named() -> None:
    top, start, times = problem(42)
    states = runge_kutta(top, start, times)[:, [0, 3, 1, 4, 2, 5]] * [1, 1, 1, -1, 1, 1]
    (told,) = found(top, start, times, states)
    assert told.kind == "column_order"
    assert "in another order: Ω1, γ1, Ω2, −γ2, Ω3, γ3;" in diagnosis_text(told)


@pytest.mark.slow
def test_vectors_in_each_other_s_place_and_in_other_axes_are_put_in_words() -> None:
    top, start, times = problem(42)
    (told,) = found(top, start, times, runge_kutta(top, start, times)[:, [5, 4, 3, 2, 1, 0]] * [1, 1, -1, 1, 1, -1])
    said = "The columns have another meaning: γ precedes Ω; columns 1, 2, 3 of Ω and γ are axes 3, 2, −1;"
    assert diagnosis_text(told).startswith(said)


@pytest.mark.slow
@pytest.mark.parametrize(("of", "axis"), [("omega", 2), ("both", 1)])
def test_vectors_in_axes_of_space_are_told(of: str, axis: int) -> None:
    """Each state turned so that γ is that axis, and about it by any angle."""
    top, start, times = problem(43)
    states = runge_kutta(top, start, times)
    source, turned = np.random.default_rng(5), states.copy()
    for row, state in enumerate(states):
        gamma = state[3:]
        across = np.cross(gamma, source.normal(size=3))
        across /= np.linalg.norm(across)
        frame = np.roll([np.cross(gamma, across), gamma, across][::-1], axis - 1, axis=0)
        turned[row, :3] = frame @ state[:3]
        turned[row, 3:] = frame @ gamma if of == "both" else gamma
    assert np.allclose(frame @ gamma, np.eye(3)[axis])
    (told,) = found(top, start, times, turned)
    assert (told.kind, told.numbers) == ("axes_of_space", {"of": of, "vertical": str(axis + 1)})
    assert "given in space axes" in diagnosis_text(told)


@pytest.mark.slow
def test_a_motion_that_stands_still_from_some_time_on_is_told() -> None:
    top, start, times = problem(44)
    states = runge_kutta(top, start, times)
    states[8:] = states[8]
    (told,) = found(top, start, times, states, 0.5)
    assert (told.kind, told.numbers["states"]) == ("frozen", "4 of 12")
    assert Fraction(told.numbers["t"]) == times[8]
    assert diagnosis_text(told).endswith("the state is constant, in 4 of 12 states.")
    assert found(top, start, times, states, 1e-12) != [told]


SMALL = HeavyTop((3, 2, 1), 1, (0, 0, -1)), State((Fraction(1, 1000), 0, 0), (0, 0, 1))
"""Small oscillations, whose lag is that of a clock."""
HONEST = {
    "Runge-Kutta": (problem(3), runge_kutta, 0.3),
    "midpoint": (problem(4), midpoint, 0.05),
    **{
        name: ((CASES[name].top, CASES[name].start, [Fraction(5, 2) * k for k in range(1, 9)]), midpoint, 0.1)
        for name in ("pendulum", "delone")
    },
    "small, often": ((*SMALL, [Fraction(k, 2) for k in range(1, 31)]), midpoint, 0.1),
    "small, now and then": ((*SMALL, [Fraction(5 * k) for k in range(1, 7)]), midpoint, 0.1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", HONEST)
def test_an_honest_method_a_lag_and_a_saddle_are_not_accused(name: str) -> None:
    given, method, step = HONEST[name]
    assert found(*given, method(*given, step)) == []


@pytest.mark.slow
def test_near_misses_stay_silent() -> None:
    top, start, times = problem(6)
    y = runge_kutta(top, start, times)
    noise = np.random.default_rng(6).normal(size=y.shape)
    # γ down, but with an error that hides it; one vector shifted in time and the other not; states of nothing
    assert found(top, start, times, y * [1, 1, 1, -1, -1, -1] + 0.1 * noise) == []
    later = runge_kutta(top, start, [t + SHIFT for t in times])
    assert found(top, start, times, np.hstack([y[:, :3], later[:, 3:]])) == []
    assert found(top, start, times, noise) == []
    # a drifting mean: the start alone does not explain it
    assert found(top, start, times, y + 0.01 * np.outer([float(t) for t in times], [1, 0, 0, 0, 0, 0])) == []


def test_large_columns_that_a_factor_makes_smaller_are_not_explained_by_it() -> None:
    """M in thousandths of its unit in place of Ω: a thousandth of it has the size of Ω, and is another vector."""
    _, start, times = problem(6)
    top = HeavyTop((Fraction(13, 10), Fraction(6, 5), 1), 1, (Fraction(1, 3), Fraction(1, 5), Fraction(1, 4)))
    states = runge_kutta(top, start, times)
    assert found(top, start, times, states * [1300, 1200, 1000, 1, 1, 1]) == []
    (told,) = found(top, start, times, states * [1000, 1000, 1000, 1, 1, 1])
    assert told.kind == "omega_scaled"


def test_one_state_that_is_off_is_pointed_at() -> None:
    top, start, times = problem(8)
    y = runge_kutta(top, start, times)
    y[4] += 0.1
    (told,) = found(top, start, times, y)
    assert (told.kind, float(told.numbers["t"])) == ("one_state", float(times[4]))


@pytest.mark.slow
@pytest.mark.parametrize("row", [1])
def test_a_row_that_is_missing_or_stands_twice_is_found(row: int) -> None:
    top, start, times = problem(8)
    times = [Fraction(k, 2) for k in range(1, 12)]
    y = motion(top, start, HEAVY_TOP, times)
    (missing,) = found(top, start, times[:-1], np.delete(y, row, axis=0))
    assert (missing.kind, float(missing.numbers["t"])) == ("row_missing", float(times[row]))
    (twice,) = found(top, start, times, np.insert(y, row, y[row], axis=0)[:-1])
    assert (twice.kind, float(twice.numbers["t"])) == ("row_twice", float(times[row + 1]))
    assert diagnosis_text(twice).startswith(f"There is one row too many: from t = {twice.numbers['t']} on")


def test_states_that_do_not_move_are_no_other_clock() -> None:
    top, start, times = problem(8)
    (told,) = found(top, start, times, np.tile([float(value) for value in start.flat], (len(times), 1)))
    assert diagnosis_text(told) == "All states are the same."


@pytest.mark.parametrize("bits", [60, 1100])
def test_states_that_differ_by_less_than_double_tells_are_not_the_same(bits: int) -> None:
    top, start, times = problem(8)
    rows = [(*start.omega, *start.gamma[:2], start.gamma[2] + Fraction(i, 2**bits)) for i in range(len(times))]
    assert not any(told.kind == "constant" for told in diagnose(top, start, HEAVY_TOP, times, rows, QUAD, 1.0))


@pytest.mark.slow
def test_a_sentence_says_of_which_states_it_is_true_where_not_all_were_looked_at() -> None:
    top, start, _ = problem(8)
    times = [Fraction(k) for k in range(1, 101)]
    y = motion(top, start, HEAVY_TOP, times)
    y[:60, 3:] *= -1
    (told,) = found(top, start, times, y)
    assert told.kind == "gamma_down"
    assert told.looked_at is not None
    looked, states, until = told.looked_at
    assert (states, looked < 60, float(until) < 60) == (100, True, True)
    assert diagnosis_text(told).startswith(f"Compared {looked} of 100 states, to t = {until}. In these states γ points")


@pytest.mark.slow
@pytest.mark.parametrize(("digits", "kind"), [(5, "decimals"), (7, "significant"), (24, "single"), (9, "single")])
def test_rounded_states_are_told_where_rounding_is_the_error(digits: int, kind: str) -> None:
    top, start, times = problem(9)
    y = motion(top, start, HEAVY_TOP, times)
    match kind:
        case "decimals":
            spoilt = np.round(y, digits)
        case "significant":
            spoilt = np.array([[float(f"{v:.{digits}g}") for v in row] for row in y])
        case _:
            spoilt = y.astype(np.float32).astype(float)
    if (digits, kind) == (9, "single"):  # as printf writes them
        spoilt, digits = np.array([[float(f"{v:.9g}") for v in row] for row in spoilt]), 24
    error = float((np.abs(spoilt - y) / np.maximum(1, np.abs(y))).max())
    (told,) = found(top, start, times, spoilt, error)
    assert (told.kind, told.numbers) == ("rounded", {"to": kind, "digits": str(digits)})
    if kind == "decimals":  # an error that rounding does not explain
        assert found(top, start, times, spoilt, 100 * error) == []
    upside_down = spoilt * np.repeat([1.0, -1.0], 3)
    for off in (2.0, None):
        told, *_ = found(top, start, times, upside_down, off)
        assert told.kind == "gamma_down"
    rows = [tuple(Fraction(v) for v in row) for row in y]
    assert roundings(rows, DOUBLE) == []


def test_numbers_below_those_of_double_have_no_common_rounding() -> None:
    assert roundings([[Fraction(n, 3 * 10**400) for n in range(1, 20)]], real(237)) == []


IN_UNITS = {
    "": (lambda y, moments: y, {}),
    "axes_permuted": (lambda y, moments: y[:, [1, 2, 0, 4, 5, 3]], {"of": "both", "axes": "2,3,1"}),
    "columns_swapped": (lambda y, moments: y[:, [3, 4, 5, 0, 1, 2]], {}),
    "column_order": (lambda y, moments: y[:, [0, 3, 1, 4, 2, 5]], {"columns": "Ω1, γ1, Ω2, γ2, Ω3, γ3"}),
    "start_momentum": (lambda y, moments: y, {}),
    "all_momentum": (lambda y, moments: y * [*moments, 1, 1, 1], {}),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("time", "inertia", "kinds"),
    [
        *((time, 0, ("columns_swapped",)) for time in (-60, 100)),
        *((power, power, ("", "axes_permuted")) for power in (-60, 60)),
        *((*powers, ("column_order", "start_momentum", "all_momentum")) for powers in ((-30, 30), (30, -30), (0, 30))),
    ],
)
def test_units_of_any_size_do_not_matter(time: int, inertia: int, kinds: tuple[str, ...]) -> None:
    top, start, times = problem(10)
    unit, size = Fraction(10) ** time, Fraction(10) ** inertia
    heavy = HeavyTop([i * size for i in top.inertia], top.weight * size / unit**2, top.centre)
    y = runge_kutta(top, start, times) * ([float(1 / unit)] * 3 + [1] * 3)
    for kind in kinds:
        weights = heavy.inertia if kind.endswith("momentum") else (1, 1, 1)
        begin = State([w * i / unit for w, i in zip(start.omega, weights, strict=True)], start.gamma)
        change, numbers = IN_UNITS[kind]
        told = found(heavy, begin, [t * unit for t in times], change(y, [float(i) for i in heavy.inertia]))
        assert [(each.kind, each.numbers) for each in told] == ([(kind, numbers)] if kind else [])


@pytest.mark.slow
def test_times_and_numbers_that_no_double_holds_are_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heavytop.features.score.diagnose.samples._STEPS", 1000)  # a hundred times on the way to 1e300
    top, start, times = problem(11)
    y = runge_kutta(top, start, times)
    assert found(top, start, [t * 10**300 for t in times], y) == []
    huge = HeavyTop([i * 10**400 for i in top.inertia], top.weight, top.centre)
    (told,) = found(huge, start, times, y)
    assert (told.kind, set(told.numbers)) == ("top", {"P a", "P b", "P c"})
    assert diagnose(top, start, HEAVY_TOP, [], [], DOUBLE, None) == []
    assert found(top, start, times[:1], y[:1]) == []


@pytest.mark.slow
@pytest.mark.parametrize(("again_at", "kind"), [(1, "start_row_missing"), (6, "reset")])
def test_a_motion_that_starts_again_is_told_from_rows_that_are_late(again_at: int, kind: str) -> None:
    top, start, _ = problem(3)
    fast, times = State([8 * value for value in start.omega], start.gamma), [Fraction(k, 2) for k in range(13)]
    states = np.vstack([np.array([float(value) for value in fast.flat]), runge_kutta(top, fast, times[1:], 1e-3)])
    again = np.vstack([states[:again_at], states[: len(states) - again_at]])
    relative = np.abs(again - states).max() / np.abs(states).max()
    exact = [[Fraction(value) for value in row] for row in again]
    (diagnosis,) = diagnose(top, fast, HEAVY_TOP, times, exact, DOUBLE, float(relative))
    assert diagnosis.kind == kind


@pytest.mark.parametrize(
    ("left", "said"),
    [
        (1.19e-15, "to less than 1e-13, and 13.0 digits or more are right."),
        (2e-12, "to 2.00e-12, and 11.7 digits are right."),
    ],
)
def test_the_digits_are_those_of_the_error_that_is_printed_beside_them(left: float, said: str) -> None:
    assert sentence(Diagnosis("gamma_down", error=2.0, left=left)).endswith(said)


def test_moments_that_fit_a_body_say_their_point() -> None:
    assert "I11 = 1.6, moments about the fixed point" in diagnosis_text(Diagnosis("top", {"I11": "1.6"}, 1.0, 1e-9))
    assert "I1 = 1.6;" in diagnosis_text(Diagnosis("top", {"I1": "1.6"}, 1.0, 1e-9))


def test_weights_of_one_are_the_equations_of_the_gyrostat_in_any_axes() -> None:
    """Exactly; and each term with the weight 0 is left out, with -1 it has the other sign."""
    k, y = (Fraction(1, 3), Fraction(-2), Fraction(5)), [Fraction(n, 7) for n in (3, -2, 5, 1, 6, -4)]
    axes = tuple(rotation_of((Fraction(1), Fraction(2), Fraction(-1), Fraction(3))))
    given = Parameters((Fraction(2), Fraction(3), Fraction(4)), (Fraction(1), Fraction(-2), Fraction(1, 2)), k)
    plain = HEAVY_GYROSTAT.field(given, y)

    def weighted(weights: list[int]) -> tuple[Fraction, ...]:
        numbers = (*k, *(entry for row in axes for entry in row), *map(Fraction, weights))
        return hypotheses._weighted(given._replace(rotor=numbers), y)

    assert weighted([1] * 18) == plain
    without_gyroscopic = weighted([0] * 3 + [1] * 15)
    assert without_gyroscopic[:3] == tuple(
        t / i for t, i in zip(cross(y[3:], given.moment), given.inertia, strict=True)
    )
    assert without_gyroscopic[3:] == plain[3:]
    assert weighted([1] * 12 + [-1] * 6) == (*plain[:3], *(-rate for rate in plain[3:]))
    assert weighted([1] * 9 + [-1] * 3 + [1] * 6) == (*(-rate for rate in plain[:3]), *plain[3:])
    assert len(set(map(weighted, ([1] * n + [0] + [1] * (17 - n) for n in range(18))))) == 18


@pytest.mark.slow
def test_equations_that_differ_in_their_weights_are_compiled_once() -> None:
    systems = [
        hypotheses._Weighted("weighted", hypotheses._weighted, HEAVY_TOP.angular_velocity, numbers=(weight,))
        for weight in (-1.0, 0.0)
    ]
    assert compiled(systems[0], DOUBLE) is compiled(systems[1], DOUBLE)
