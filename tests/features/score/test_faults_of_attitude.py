"""Files of quaternions, Ω and angles by a method of its own for a body in axes of its own, with one fault each."""

from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from heavytop.features.score.diagnose import hypotheses
from heavytop.features.score.measurement import assess
from heavytop.features.score.trajectories.files import read
from heavytop.integrate.heyoka.engines import compiled
from heavytop.precision import DOUBLE, cross
from heavytop.top.attitude import rotation_of
from heavytop.top.bodies import Body
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP, Parameters

CENTRAL = np.array([[0.9, 0.05, -0.1], [0.05, 0.7, 0.08], [-0.1, 0.08, 0.6]])
CENTRE, ROTOR, START = np.array([0.2, -0.3, 0.5]), np.array([0.4, -0.2, 0.3]), np.array([0.8, -0.2, 0.4, 0.4])
STEINER = CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE)
TIMES = [0.15 * k for k in range(1, 15)]
KEEP = np.ones(3)


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    vector = p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *vector])


def motion(
    tensor: np.ndarray = CENTRAL + STEINER,
    mass: float = 1.0,
    gyroscopic: np.ndarray = KEEP,
    rotor: np.ndarray = np.zeros(3),
    begin: np.ndarray = START,
    shift: float = 0.0,
) -> np.ndarray:
    """Ω and q at each time by the classical Runge-Kutta method; factors of the gyroscopic moment."""

    def rates(y: np.ndarray) -> np.ndarray:
        w, (a, b, c, d) = y[:3], y[3:]
        up = np.array([2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d])
        moment = gyroscopic * np.cross(tensor @ w + rotor, w) + mass * 9.81 * np.cross(up, CENTRE)
        return np.concatenate([np.linalg.solve(tensor, moment), product(y[3:], np.array([0, *w])) / 2])

    y, t, rows = np.concatenate([[0.7, -0.4, 3.0], begin]), 0.0, []
    for end in (time + shift for time in TIMES):
        h = (end - t) / 40
        for _ in range(40):
            k1 = rates(y)
            k2 = rates(y + h / 2 * k1)
            k3 = rates(y + h / 2 * k2)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(y + h * k3))
        t = end
        rows.append(y)
    return np.array(rows)


def column(rows: np.ndarray, place: int, change: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    rows = rows.copy()
    rows[:, place] = change(rows[:, place])
    return rows


I12_TURNED = [[1, -1, 1], [-1, 1, 1], [1, 1, 1]]
TURNED = product(START, np.array([0.9, 0.3, -0.1, 0.3]))
FAULTS: Mapping[str, tuple[Callable[[], np.ndarray], Mapping[str, str]]] = {
    "": (motion, {}),
    "gyroscopic_sign": (lambda: motion(gyroscopic=-KEEP, rotor=ROTOR), {}),
    "term_missing": (
        lambda: motion(gyroscopic=np.array([1.0, 0.0, 1.0])),
        {"column": "M2", "term": "the gyroscopic term"},
    ),
    "steiner": (lambda: motion(CENTRAL + 2 * STEINER), {"times": "2"}),
    "products_of_inertia": (lambda: motion(CENTRAL * I12_TURNED + STEINER), {"entries": "I12"}),
    "mass": (lambda: motion(CENTRAL + 1.3 * STEINER, 1.3), {"factor": "1.3"}),
    "start": (lambda: motion(begin=TURNED), {}),
    "times_shifted": (lambda: motion(shift=0.07), {"shift": "0.07"}),
    "frozen": (
        lambda: np.vstack([motion()[:8], np.hstack([motion()[8:, :3], [motion()[8, 3:]] * 6])]),
        {"vector": "γ"},
    ),
    "column_scaled": (lambda: column(motion(), 5, np.negative), {"column": "y of the quaternion", "factor": "−1"}),
    "column_order": (
        lambda: motion()[:, [0, 1, 2, 3, 4, 6, 5]],
        {"columns": "y of the quaternion and z of the quaternion"},
    ),
}
SILENT_OF_OMEGA = {"times_shifted", "start", "mass", "column_order", "column_scaled"}


@pytest.mark.slow
@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_of_a_file_of_quaternions_is_named(kind: str, tmp_path: Path) -> None:
    rows, numbers = FAULTS[kind][0](), FAULTS[kind][1]
    if kind in SILENT_OF_OMEGA:
        rows[:, :3] = 0
    six = [CENTRAL[place] for place in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    rotor = f"\n# rotor: {', '.join(map(repr, ROTOR.tolist()))}" if kind == "gyroscopic_sign" else ""
    header = f"""# mass: 1
# gravity: 9.81
# centre: {", ".join(map(str, CENTRE))}
# inertia: {", ".join(map(str, six))}
# about: centre of mass{rotor}
# omega: 0.7, -0.4, 3
# start_quaternion: {", ".join(map(str, START))}
t,{"" if kind in SILENT_OF_OMEGA else "wx,wy,wz,"}qw,qx,qy,qz
"""
    shown = rows[:, 3:] if kind in SILENT_OF_OMEGA else rows
    lines = [",".join(map(repr, [time, *row])) for time, row in zip(TIMES, shown.tolist(), strict=True)]
    file = tmp_path / "log.csv"
    file.write_text(header + "\n".join(lines) + "\n")
    told = assess(read(file)).diagnoses
    assert [one.kind for one in told] == ([kind] if kind else [])
    assert all(one.numbers.items() >= numbers.items() for one in told)


@pytest.mark.parametrize("off", [-4e-8, 4e-8])
def test_a_plate_in_seven_digits_is_a_body(off: float) -> None:
    plate = {"mass": 1, "gravity": 1, "centre": (0, 0, 1), "about": "centre of mass"}
    assert not Body(inertia=(0.1, 0.2, 0.3 + off), **plate).warnings()
    assert Body(inertia=(0.1, 0.2, 0.3001), **plate).warnings()


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
