"""Scores of spoilt trajectories: never a traceback, outliers named in any row, factors told, right ones not accused."""

import json
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from heavytop.cases import CASES
from heavytop.features.score.diagnose.samples import motion, turning_rate
from heavytop.features.score.measurement import Assessment, assess
from heavytop.features.score.text import diagnosis_text, to_json
from heavytop.features.score.trajectories.observed import of_arrays
from heavytop.measure.reference import reference
from heavytop.precision import DOUBLE, QUAD, Precision, decimal_text
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State
from support.helpers import START, TOP

TIMES = [Fraction(k, 2) for k in range(1, 21)]
RIGHT = motion(TOP, START, HEAVY_TOP, TIMES)
OMEGA, GAMMA = np.array([1.0] * 3 + [0.0] * 3), np.array([0.0] * 3 + [1.0] * 3)


def scored(states, times=TIMES, top=TOP, start=START, precision: Precision | None = DOUBLE) -> Assessment:
    found = assess(of_arrays(top, start, HEAVY_TOP, list(times), [list(row) for row in states], precision, "a", "b"))
    json.dumps(to_json(found), allow_nan=False)
    return found


def kinds(found: Assessment) -> list[str]:
    return [each.kind for each in found.diagnoses]


@pytest.mark.slow
@pytest.mark.parametrize("value", ["-1e154", "1e155", "1e308", "1e400", "nan", "-inf", "0", "1e-400"])
def test_a_number_of_any_size_is_scored_in_any_place(value: str) -> None:
    row, column = ((0, 0), (7, 4), (19, 2))[len(value) % 3]
    states = RIGHT.tolist()
    states[row][column] = value
    found = scored(states)
    if value in ("1e400", "nan", "-inf"):
        assert (found.row.outcome, kinds(found)) == ("non_finite", [])
    else:
        assert kinds(found) == ["one_state"]
        assert found.diagnoses[0].numbers["state"] == f"{row + 1} of 20"


def _from(row: int, change) -> np.ndarray:
    states = RIGHT.copy()
    states[row:] = change(states[row:])
    return states


DEGENERATE = {
    "all 0": RIGHT * 0,
    "constant": np.tile(RIGHT[3], (20, 1)),
    "Ω 0": RIGHT * GAMMA,
    "γ 0": RIGHT * OMEGA,
    "γ constant": np.hstack([RIGHT[:, :3], np.tile(RIGHT[0, 3:], (20, 1))]),
    "rows twice": np.repeat(RIGHT[:10], 2, axis=0),
    "diverges": _from(9, lambda tail: tail * 10.0 ** np.linspace(1, 300, len(tail))[:, None]),
    "two columns 1e200": RIGHT * [0, 1, 1, 1, 0, 1] + [1e200, 0, 0, 0, 1e200, 0],
}


@pytest.mark.slow
@pytest.mark.parametrize("rows", [1, 12])
def test_degenerate_trajectories_are_scored(rows: int) -> None:
    for name, states in list(DEGENERATE.items())[:: 1 if rows > 1 else 4]:
        found = scored(states[:rows], TIMES[:rows])
        still = {"omega_zero"} if name == "Ω 0" else {"constant", "frozen", "integrals_off", "one_state", "some_states"}
        assert set(kinds(found)) <= still, name


@pytest.mark.slow
def test_centres_on_an_axis_and_constant_gamma_leave_nothing_to_fit() -> None:
    for centre in ((0, 0, 1), (0, 0, 0)):
        top, start = HeavyTop((2, 2, 1), 1, centre), State((Fraction(1, 10), 0, 3), (0, 0, 1))
        y = motion(top, start, HEAVY_TOP, TIMES[:8])
        for states in (np.hstack([y[:, :3], np.tile([0, 0, 1.0], (8, 1))]), y * OMEGA):
            scored(states, TIMES[:8], top=top, start=start)


@pytest.mark.parametrize(("kind", "off"), [("rows_late", 1), ("rows_off_by_one", -1)])
def test_states_a_row_late_or_early_are_named_where_times_are_uneven(kind: str, off: int) -> None:
    times = [Fraction(k * k + 3 * k, 40) for k in range(1, 17)]
    states = np.roll(motion(TOP, START, HEAVY_TOP, times), off, axis=0)
    states[0 if off > 0 else -1] = states[off if off > 0 else -2]  # the end has no neighbour
    assert kinds(scored(states, times))[0] == kind


@pytest.mark.slow
@pytest.mark.parametrize("row", [0, 41, 99])
def test_one_state_among_a_hundred_is_named(row: int) -> None:
    times = [Fraction(k, 2) for k in range(1, 101)]
    states = motion(TOP, START, HEAVY_TOP, times)
    states[row, row % 6] += 0.01
    (told,) = scored(states, times).diagnoses
    assert (told.kind, told.numbers["state"]) == ("one_state", f"{row + 1} of 100")
    assert Fraction(told.numbers["t"]) == times[row]
    assert told.left < 1e-11
    assert diagnosis_text(told).startswith(
        f"Only the state at t = {told.numbers['t']} is wrong (state {row + 1} of 100)"
    )


@pytest.mark.slow
def test_several_states_are_named_and_a_tail_is_not() -> None:
    times = [Fraction(k, 2) for k in range(1, 41)]
    right = motion(TOP, START, HEAVY_TOP, times)
    for rows in ((5, 6, 7, 20, 38), (0, 39)):
        states = right.copy()
        states[list(rows), 4] += [10.0 ** -(n % 3) for n in range(len(rows))]
        told = scored(states, times).diagnoses
        if rows == (0, 39):
            assert told == []  # a state that is off at both ends
            continue
        assert (told[0].kind, told[0].numbers["state"]) == (
            "some_states", f"{', '.join(str(row + 1) for row in rows)} of 40")  # fmt: skip
        assert "are wrong (states" in diagnosis_text(told[0])
    states = right.copy()
    states[-3:, 0] += 0.1
    assert kinds(scored(states, times)) == []


COLUMNS = ("Ω1", "Ω2", "Ω3", "γ1", "γ2", "γ3")
SCALED: dict[str, tuple[np.ndarray, str, dict[str, float]]] = {
    "degrees": (180 / np.pi * OMEGA + GAMMA, "omega_in_degrees", {}),
    "turns": (0.5 / np.pi * OMEGA + GAMMA, "omega_in_turns", {}),
    "rpm": (30 / np.pi * OMEGA + GAMMA, "omega_in_rpm", {}),
    "Ω, reversed": (-1.02 * OMEGA + GAMMA, "omega_scaled", {"factor": -1.02}),
    "Ω, small": (0.001 * OMEGA + GAMMA, "omega_scaled", {"factor": 0.001}),
    **{
        COLUMNS[column]: (np.where(np.arange(6) == column, factor, 1.0), "column_scaled", {"factor": factor})
        for column, factor in ((0, 1.02), (4, 0.5), (2, -1.0))
    },
    COLUMNS[5]: (np.where(np.arange(6) == 5, 0.0, 1.0), "column_constant", {}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCALED)
def test_columns_that_are_scaled_are_named_with_their_factor(name: str) -> None:
    factors, kind, numbers = SCALED[name]
    (told,) = scored(RIGHT * factors).diagnoses
    assert (told.kind, told.numbers.get("column")) == (kind, name if name in COLUMNS else None)
    assert all(float(told.numbers[key]) == pytest.approx(value, rel=1e-7) for key, value in numbers.items())
    text = diagnosis_text(told)
    assert kind != "omega_scaled" or f"Ω is scaled by {told.numbers['factor']}" in text
    assert ("has the opposite sign in these states" in text) == (numbers.get("factor") == -1)
    if "_in_" in kind:
        assert kinds(scored(RIGHT[:1] * factors, TIMES[:1])) == [kind]


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "kind"), [(30 / np.pi, "all_in_rpm"), (3, "all_scaled")])
def test_a_factor_of_omega_in_start_and_states_is_told(factor: float, kind: str) -> None:
    start = State([w * Fraction(factor) for w in START.omega], START.gamma)
    (told,) = scored(RIGHT * (factor * OMEGA + GAMMA), start=start).diagnoses
    assert told.kind == kind
    assert kind == "all_in_rpm" or float(told.numbers["factor"]) == pytest.approx(factor, rel=1e-7)


@pytest.mark.slow
def test_a_factor_of_time_is_told() -> None:
    (told,) = scored(RIGHT, [time * Fraction("1.02") for time in TIMES]).diagnoses
    assert told.kind == "time_unit"
    assert float(told.numbers["factor"]) == pytest.approx(1 / 1.02, rel=1e-5)


@pytest.mark.slow
def test_the_sentence_about_first_integrals_says_of_which_it_is_true() -> None:
    noise = np.random.default_rng(1).normal(size=(20, 3))
    turned = RIGHT[:, 3:] + 0.1 * noise
    turned *= 1.1 / np.linalg.norm(turned, axis=1)[:, None]
    (told,) = scored(np.hstack([RIGHT[:, :3], turned])).diagnoses
    assert told.kind == "integrals_off"
    assert told.numbers == {"gamma_squared": "1.21, not 1", "area": "varies", "energy": "varies"}
    text = diagnosis_text(told)
    assert "from the first sample on gamma_squared (1.21, not 1) keeps another value than at the start" in text
    assert "area and energy vary" in text


@pytest.mark.slow
@pytest.mark.parametrize("omega", ["0.1", "0"])
@pytest.mark.parametrize("precision", [DOUBLE, QUAD, None], ids=lambda form: getattr(form, "name", "guessed"))
def test_a_permanent_rotation_in_few_digits_is_not_accused(omega: str, precision: Precision | None) -> None:
    top, start = HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, 0, Fraction(omega)), (0, 0, 1))
    for rows in (1, 3, 15):
        states = [["0", "0", omega, "0", "0", "1"]] * rows
        found = scored(states, [Fraction(k) for k in range(1, rows + 1)], top, start, precision)
        assert kinds(found) == []
    if omega != "0":
        states = [["0", "0", str(Decimal(omega) * Decimal("1.02")), "0", "0", "1"]] * 6
        assert kinds(scored(states, TIMES[:6], top, start)) == ["omega_scaled"]


@pytest.mark.slow
@pytest.mark.parametrize("case", ["delone", "ershkov-partial-6", "generic", "pendulum"])
@pytest.mark.parametrize("digits", [3, 17, 50])
def test_a_right_trajectory_of_any_digits_is_not_accused(case: str, digits: int) -> None:
    given, times = CASES[case], [Fraction(10 * k, 3) for k in (1, 2, 3)]
    texts = reference(given.top, given.start, times, digits + 5, given.system).texts()
    states = [[decimal_text(Fraction(Decimal(text)), digits) for text in row] for row in texts]
    found = assess(of_arrays(given.top, given.start, given.system, times, states, None, "a", "b"))
    assert set(kinds(found)) <= {"rounded"}
    assert found.digits_right > min(digits, 15) - 1.5


@pytest.mark.slow
@pytest.mark.parametrize("power", [-100, 60])
def test_units_of_any_size_change_no_diagnosis(power: int) -> None:
    size = Fraction(10) ** power
    top = HeavyTop([i * size for i in TOP.inertia], TOP.weight / size, TOP.centre)
    start, times = State([w / size for w in START.omega], START.gamma), [time * size for time in TIMES]
    assert float(turning_rate(top, start) * size) == pytest.approx(float(turning_rate(TOP, START)), rel=0.02)
    in_units = RIGHT * (OMEGA / float(size) + GAMMA)
    off = in_units.copy()
    off[6, 1] *= 1.5
    (told,) = scored(off, times, top, start).diagnoses
    assert (told.kind, told.numbers["state"]) == ("one_state", "7 of 20")
    assert kinds(scored(in_units * (1.02 * OMEGA + GAMMA), times, top, start)) == ["omega_scaled"]
    assert kinds(scored(in_units, times, top, start)) == []


def test_decimals_of_small_numbers_are_named_though_the_digits_written_are_as_many() -> None:
    start = State(("0.05", "-0.035", "0.001"), (0, 0, -1))
    top, times = HeavyTop(("1.8", "1.2", "1.1"), 1, ("0.2", "0.1", 1)), TIMES[:8]
    states = np.round(motion(top, start, HEAVY_TOP, times), 4)
    (told,) = scored(states, times, top, start).diagnoses
    assert (told.kind, told.numbers) == ("rounded", {"to": "decimals", "digits": "4"})
