"""Files of quaternions, matrices, Euler angles, positions and Ω in space: scored to the digits that they have, mistakes
of convention named, right ones not accused, bad input refused by its place.

The motions are those of validation/conventions.py: Taylor series on the full tensor, in extended precision.
"""

import json
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flint import ctx

import conventions
import heavytop as ht
from conventions import Written
from heavytop.errors import InputError
from heavytop.features.score.measurement import Assessment, assess
from heavytop.features.score.text import to_json
from heavytop.features.score.trajectories.files import read
from heavytop.measure import attitude_error
from heavytop.top.attitude import Attitude
from heavytop.top.bodies import Body

BODY = conventions.general(random.Random(3))
"""A body, its motion at 20 times, its quaternion and Ω at the start."""


def scored(content: str, tmp_path: Path, name: str = "motion.csv", **options: bool) -> Assessment:
    (tmp_path / name).write_text(content, "utf-8")
    found = assess(read(tmp_path / name, **options))
    json.dumps(to_json(found), allow_nan=False)
    return found


def off(size: float) -> "conventions.Motion":
    """The motion off by a turn of that size about a fixed axis of space, and Ω by as much."""
    motion, *_ = BODY
    turn = conventions.turn("X", conventions.REAL(size))
    return replace(motion, rotation=np.array([turn @ r for r in motion.rotation]), omega=motion.omega + size / 2)


@pytest.mark.slow
def test_any_conventions_have_the_digits_of_omega_and_gamma(tmp_path: Path) -> None:
    source, (motion, q, omega) = random.Random(0), BODY
    how = Written().random(source)
    found = scored(conventions.as_csv(motion, q, omega, how), tmp_path)
    assert found.diagnoses == []
    assert found.digits_right > 14.3  # angles of 180 degrees and positions far from the pivot have fewer in a double
    wrong = conventions.as_csv(off(1e-9), q, omega, replace(how, start="quaternion"))
    assert 8.3 < scored(wrong, tmp_path).digits_right < 9.5


def test_the_error_of_the_attitude_is_the_angle_and_that_of_the_position_a_length(tmp_path: Path) -> None:
    _, q, omega = BODY
    motion = off(1e-12)
    row = scored(conventions.as_csv(motion, q, omega, Written(("quaternion", "position"))), tmp_path).row
    np.testing.assert_allclose(float(row.metrics["attitude_error_max"]), 1e-12, rtol=1e-3)
    np.testing.assert_allclose(float(row.metrics["attitude_error_rms"]), 1e-12, rtol=1e-3)
    distance = np.linalg.norm(motion.centre)
    assert float(row.metrics["position_error_max"]) <= 1.001e-12 * distance
    expected = float(row.metrics["position_error_max"]) / distance
    np.testing.assert_allclose(float(row.metrics["position_error_relative_max"]), expected, rtol=1e-6)
    assert set(row.series) >= {"attitude_error", "position_error"}
    assert not any(name.startswith("drift") for name in row.metrics)  # Ω is not there


@pytest.mark.parametrize("part", ["attitude_angle", "root"])
def test_a_sample_counts_once_however_often_it_is_evaluated(monkeypatch, part: str, tmp_path: Path) -> None:
    """Another thread that sets FLINT's context makes an evaluation start again."""
    _, q, omega = BODY
    content = conventions.as_csv(off(1e-12), q, omega, Written(("quaternion", "position", "omega")))
    expected = scored(content, tmp_path).row.metrics
    original, calls = getattr(attitude_error, part), []
    monkeypatch.setattr(ctx, "cap", ctx.cap)

    def disturbed(*args: object) -> object:
        result = original(*args)
        calls.append(part)
        if len(calls) % 5 == 1:
            ctx.cap = 11 + len(calls)
        return result

    monkeypatch.setattr(attitude_error, part, disturbed)
    assert scored(content, tmp_path).row.metrics == expected
    assert len(calls) > 20


def test_the_length_of_a_quaternion_is_off_by_what_is_said(tmp_path: Path) -> None:
    longer = conventions.columns(quaternion=lambda q: q * 1.04)
    (told,) = scored(conventions.as_csv(*BODY, Written(("quaternion",)), longer), tmp_path).diagnoses
    assert (told.kind, told.numbers["off"]) == ("quaternion_length", "0.0400")


def test_an_array_in_the_place_of_a_direction_is_said() -> None:
    start = ht.State((0, 0, 1), attitude=ht.Attitude.quaternion(1, 0, 0, 0))
    with pytest.raises(InputError, match="quaternion must be text"):
        ht.score([1], top=ht.HeavyTop((1, 1, 1), 0, (0, 0, 0)), start=start, quaternion=[[1, 0, 0, 0]])


def test_the_sign_of_a_quaternion_does_not_matter(tmp_path: Path) -> None:
    signs = iter([1, -1] * 40)
    flip = conventions.columns(quaternion=lambda q: q * next(signs))
    assert scored(conventions.as_csv(*BODY, Written(("quaternion",)), flip), tmp_path).digits_right > 15


LIGHT = [
    "conjugate, columns",
    "y up, not said",
    "inertia about the other point",
    "degrees for radians, start and columns",
    "displacement for position",
    "position of another point",
    "one component of the centre",
]


@pytest.mark.slow
@pytest.mark.parametrize("name", LIGHT)
def test_a_planted_mistake_of_convention_is_named(name: str, tmp_path: Path) -> None:
    planted, kinds = conventions.PLANTED[name], conventions.named(name, BODY, tmp_path)
    assert any(kind in planted.kinds or (kind == "refused" and planted.refused) for kind in kinds), kinds


@pytest.mark.slow
def test_the_sentence_says_what_fits_and_the_digits_that_are_right_with_it(tmp_path: Path) -> None:
    content = conventions.planted("scalar last, columns", *BODY)
    found = scored(content, tmp_path)
    (told,) = found.diagnoses
    said = to_json(found)["diagnosis"][0]["sentence"]
    assert said.startswith("The scalar part of the quaternions is at the other end")
    assert "in the columns only" in said
    assert "and 13.0 digits or more are right" in said or told.left > 1e-13


@pytest.mark.slow
def test_what_fits_as_well_is_named_with_its_numbers(tmp_path: Path) -> None:
    conjugate = conventions.columns(quaternion=lambda q: q * np.array([1, -1, -1, -1]))
    found = scored(conventions.as_csv(*BODY, Written(("quaternion",)), conjugate), tmp_path)
    (told,) = found.diagnoses
    assert [other.kind for other in told.others] == told.numbers["or"].split(", ") == ["column_scaled"]
    sentence = to_json(found)["diagnosis"][0]["sentence"]
    assert sentence.endswith("Equally good: w of the quaternion is scaled by −1.")


def lines(**changes: str) -> str:
    """A short right file of a top in principal axes, with some of its lines other."""
    said = {
        "inertia": "2, 2, 1",
        "weight": "1",
        "centre": "0, 0, 1",
        "omega": "0, 0, 3",
        "start_quaternion": "1, 0, 0, 0",
        "header": "t,qw,qx,qy,qz",
        "rows": "1,0.070737201667703,0,0,0.99749498660405\n2,-0.98999249660044,0,0,0.14112000805987",
    } | changes
    header, rows = said.pop("header"), said.pop("rows")
    return "\n".join([*(f"# {key}: {value}" for key, value in said.items() if value), header, rows]) + "\n"


@pytest.mark.parametrize(
    ("unit", "height", "more"),
    [
        ("mm", 1000, {}),
        ("cm", 100, {}),
        ("m", 1, {}),
        ("mm", 1000, {"centre": "0, 0, 1000", "weight": "0.001"}),  # the data are in millimetres too
        ("mm", 3000, {"pivot": "0, 0, 2"}),
        ("mm", 500, {"point": "0, 0, 0.5"}),
    ],
)
def test_positions_in_the_unit_of_the_header_are_those_of_the_data(
    unit: str, height: int, more: dict[str, str], tmp_path: Path
) -> None:
    header = ",".join(["t", *(f"{axis} [{unit}]" for axis in "xyz")])
    found = scored(lines(header=header, rows=f"1,0,0,{height}\n2,0,0,{height}", **more), tmp_path)
    assert found.diagnoses == []
    assert found.digits_right > 15


BEGUN = "0.4 -2.9 2.9", "0.6932312 0.2188238 0.6382831 -0.2532613"
DAMPED = ["-0.5725 -0.1261 0.1518", "-0.5841 -0.1214 -0.1037", "-0.4870 -0.1007 -0.3455", "-0.3022 -0.0662 -0.5206"]
DAMPED += ["-0.0806 -0.0259 -0.5996", "0.1235 0.0112 -0.5927"]


@pytest.mark.parametrize(
    ("omega", "quaternion", "given", "other", "interval"),
    [
        # the centre is reversed, but not Steiner's term; mirrored axes explain the first positions, not how they move
        ("1.95 -2.01 -0.75", "1 -7 -5 4", "2 0.39 0.16 -0.25 0.93 0.91 0.82 -0.03 0.03 0.02",
         "2 0.39 -0.16 -0.25 1.1062 1.3392 1.1754 -0.1548 0.225 0.1", 20),
        # weight and moments are off: a factor of three digits is no accident only if it is known to more
        ("-0.1 -2.4 -3.2", "0.2298506 -0.9574802 0.1129250 0.1328473", "2 0.44 0.07 0.08 0.287 0.211 0.305 0 0 0",
         "2.1777 0.44 0.07 0.08 0.3695 0.7262 0.8348 -0.0730 -0.0835 -0.0133", 50),
        # with air drag: another weight brings the first two to the right place
        (*BEGUN, "1 -0.39 -0.39 -0.25 0.389 0.363 0.3 0.093 0.05 0.109", DAMPED, 10),
    ],
)  # fmt: skip
def test_positions_alone_are_not_explained_by_accident(omega, quaternion, given, other, interval) -> None:
    def body(numbers: str, about: str) -> Body:
        mass, *values = numbers.split()
        return Body(mass, "9.81", values[:3], values[3:], about)

    start = ht.State(omega.split(), attitude=Attitude.quaternion(*quaternion.split(), normalize=True))
    times = [f"{k}/{interval}" for k in range(1, 1 + (len(other) if other is DAMPED else 40))]
    positions = [row.split() for row in DAMPED]
    if other is not DAMPED:
        positions = ht.propagate(body(other, "pivot"), start, times).positions()
    about = body(given, "centre of mass")
    told = ht.score(times, top=about, start=start, positions=positions).diagnosis
    assert len(told) == (given[:6] == other[:6])
    assert all(f"at (0.39, -0.16, -0.25), with inertia = {', '.join(other.split()[4:])}" in text for text in told)


def test_a_sleeping_top_is_right_in_any_columns(tmp_path: Path) -> None:
    assert scored(lines(), tmp_path).digits_right > 13.5
    turned = lines(header="t,x,y,z", rows="1,0,0,1\n2,0,0,1")
    found = scored(turned, tmp_path)
    assert (found.digits_right > 15.9, found.used) == (True, "Scored: position of the centre of mass; z points up.")
    assert scored(lines(header="t,wx,wy,wz", rows="1,0,0,3", frame="space"), tmp_path).digits_right > 15.9


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start_quaternion": "1, 1, 0, 0"}, r"must have length 1; \|q\|\^2 - 1 = 1\."),
        ({"start_quaternion": "0, 0, 0, 0"}, "must have length 1|must not be zero"),
        ({"start_quaternion": "", "start_matrix": "1,0,0,0,1,0,0,0,-1"}, "is a reflection, not a rotation"),
        ({"start_quaternion": "", "start_matrix": "1,0.5,0,0,1,0,0,0,1"}, "is not orthogonal: R R.T differs"),
        ({"start_quaternion": "", "start_matrix": "1,0,0,0,1,0"}, "start_matrix must be 9 numbers; got '1,0,0,0,1,0'"),
        ({"gamma": "0, 0.6, 0.8"}, "gamma and start_quaternion contradict each other"),
        ({"start_matrix": "1,0,0,0,1,0,0,0,1"}, "both give the attitude at t = 0"),
        ({"start_quaternion": ""}, "The attitude at t = 0 is missing"),
        ({"omega": ""}, "The key omega is missing"),
        ({"omega_space": "0,0,3"}, "omega and omega_space both give"),
        (
            {"header": "t,qw,qx,qy", "rows": "1,0,0,1"},
            "columns of quaternion are incomplete: component z is missing",
        ),
        ({"header": "t,a,b,c,d"}, "'a' to 'd' look like an attitude"),
        ({"header": "t,psi,theta,phi,n", "sequence": "ZXZ"}, "ψ, θ, φ do not say which angle of ZXZ is the first"),
        (
            {"header": "t,phi,theta,psi,wx,wy,wz,gx,gy,gz", "sequence": "ZYX", "rows": "1,0,0,3,0,0,3,0,0,1"},
            "φ, θ, ψ do not say which angle of ZYX is the first",
        ),
        ({"header": "t,euler1,euler2,euler3", "rows": "1,0,0,3"}, "Euler angles have no sequence"),
        ({"rows": "1,0.5,0,0,abc"}, "Line 7, column qz: 'abc' is not a finite number"),
        ({"rows": "1,1,0,0,0\n2,0.5,,0,0"}, "Line 8, column qx is empty"),
        ({"rows": "1,1,0,0,0\nx,1,0,0,0"}, "Line 8, column t: 'x' is not a finite number"),
        ({"rows": "1,1,0,0,0\n,1,0,0,0"}, "Line 8, column t is empty"),
        ({"rows": "1,1,0,0"}, "Line 7 has 4 columns, not 5"),
        ({"rows": "1,2,0,0,0"}, r"The quaternion of line 7 must have length 1; \|q\|\^2 - 1 = 3"),
        ({"rows": "1,0,0,0,0"}, "The quaternion of line 7 must not be zero"),
        ({"up": "w"}, "up = 'w' is not known"),
        ({"frame": "moon"}, "frame must be space or body; got 'moon'"),
        ({"quaternion_order": "zyxw"}, "quaternion_order must be wxyz or xyzw; got 'zyxw'"),
        ({"sequence": "ZZX"}, "sequence = 'ZZX' is not known"),
        (
            {"header": "t,euler1,euler2,euler3", "rows": "1,0,0,3", "sequence": "xyz"},
            "sequence = xyz is ambiguous",
        ),
        ({"mass": "1"}, "weight and mass were given"),
        ({"mass": "1", "weight": ""}, "The key gravity is missing"),
        ({"mass": "1", "gravity": "9.81", "weight": ""}, "reference point of the inertia tensor"),
        ({"system": "gyrostat"}, "not scored in the system gyrostat"),
        ({"pivot": "1, 2"}, "pivot must be 3 numbers; got '1, 2'"),
        ({"inertia": "1, 1, nan"}, "nan"),
    ],
)
def test_bad_input_is_refused_with_cause_and_remedy(changes: dict, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(lines(**changes), "utf-8")
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path / "a.csv")
    assert caught.value.remedy
    assert len(caught.value.cause) < 500


def test_normalize_takes_quaternions_and_matrices_of_any_length(tmp_path: Path) -> None:
    doubled = "1,0.141474403335406,0,0,1.9949899732081\n2,-1.97998499320088,0,0,0.28224001611974"
    content = lines(start_quaternion="2, 0, 0, 0", rows=doubled)
    assert scored(content, tmp_path, normalize=True).digits_right > 13


@pytest.mark.parametrize("word", ["nan", "inf", "1e400"])
def test_what_is_not_finite_is_a_verdict(word: str, tmp_path: Path) -> None:
    first = "1,0.070737201667703,0,0,0.99749498660405"
    found = scored(lines(rows=f"{first}\n2,1,0,{word},0\n3,1,0,0,0", precision="double"), tmp_path)
    assert (found.row.outcome, found.row.time_reached) == ("non_finite", "1")
    none = scored(lines(rows=f"1,1,0,{word},0", precision="double"), tmp_path)
    assert (none.row.outcome, none.digits_right) == ("non_finite", None)


def test_json_says_the_same_as_csv(tmp_path: Path) -> None:
    rows = [["0.070737201667703", "0", "0", "0.99749498660405"], ["-0.98999249660044", "0", "0", "0.14112000805987"]]
    document = {
        "inertia": [2, 2, 1], "weight": 1, "centre": [0, 0, 1], "omega": [0, 0, 3], "times": [1, 2],
        "start_quaternion": [1, 0, 0, 0], "quaternions": rows,
    }  # fmt: skip
    one, two = scored(lines(), tmp_path), scored(json.dumps(document), tmp_path, "motion.json")
    assert one.row.metrics == two.row.metrics
    pairs = [(str(np.cos(3.0 * t)), str(np.sin(3.0 * t))) for t in (1, 2)]
    matrix = [[[c, f"-{s}".replace("--", ""), 0], [s, c, 0], [0, 0, 1]] for c, s in pairs]
    del document["quaternions"], document["start_quaternion"]
    as_matrices = document | {"matrix": matrix, "start_matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}
    assert scored(json.dumps(as_matrices), tmp_path, "motion.json").digits_right > 15


@pytest.mark.slow
def test_python_takes_arrays_of_any_kind() -> None:
    pandas = pytest.importorskip("pandas")
    motion, q, omega = BODY
    body = Body(motion.mass, motion.gravity, motion.centre, motion.inertia, motion.about)
    start = ht.State(omega=omega, attitude=Attitude.quaternion(*q, normalize=True))
    how = Written()
    rows = [how.columns(motion, k, (None, None)) for k in range(len(motion.times))]
    quaternions, positions = (np.array([row[name] for row in rows], dtype=float) for name in ("quaternion", "position"))
    given = {"top": body, "start": start}
    score = ht.score(motion.times, quaternions=quaternions, positions=positions, precision=ht.DOUBLE, **given)
    assert score.digits_kept > 15
    assert set(score.distance) == {"gamma", "attitude", "position", "position_relative"}
    frame = pandas.DataFrame(quaternions, columns=[*"wxyz"])
    vector = pytest.importorskip("sympy").Matrix([1, 2, 3])
    assert ht.State(omega=vector, gamma=(0, 0, 1)) == ht.State(omega=(1, 2, 3), gamma=(0, 0, 1))
    for table in (frame, frame.to_records(index=False)):
        assert ht.score(motion.times, quaternions=table, positions=positions, **given).digits_kept == score.digits_kept
    matrices, spins = motion.rotation.astype(float), motion.omega.astype(float)
    whole = ht.score(motion.times, matrices=matrices, omega=spins, require=14, **given)
    assert whole.passed
    assert set(whole.drift) >= {"area", "energy"}
    states = np.hstack([motion.omega, motion.rotation[:, 2]]).astype(float)
    assert ht.score(motion.times, states, **given).digits_kept > 14.5
    for wrong in ({"quaternions": positions}, {}, {"euler": positions}, {"positions": positions[:-1]}, {"omega": 3}):
        with pytest.raises(ht.HeavyTopError):
            ht.score(motion.times, **given, **wrong)


@pytest.mark.parametrize(
    "unused",
    [
        {"angles": "degrees"},
        {"sequence": "ZXZ"},
        {"quaternion_order": "xyzw"},
        {"quaternion": "space_to_body"},
        {"matrix": "space_to_body"},
        {"pivot": (1, 2, 3)},
        {"point": (1, 2, 3)},
        {"up": "y"},
    ],
    ids=lambda unused: next(iter(unused)),
)
def test_a_convention_of_an_array_that_is_not_given_is_refused(unused: dict) -> None:
    top, start = ht.HeavyTop((3, 2, 1), 1, ("1/2", 0, 0)), ht.State((1, 0, 2), ("3/5", 0, "4/5"))
    states = [[*start.omega, *start.gamma]]
    columns = {"omega": [state[:3] for state in states], "gamma": [state[3:] for state in states]}
    for given in ({"states": states}, columns, {"omega": columns["omega"]}):
        with pytest.raises(InputError, match=f"{next(iter(unused))} was given"):
            ht.score([1], top=top, start=start, **given, **unused)


def test_a_convention_of_no_column_is_reported(tmp_path: Path) -> None:
    keys = {"inertia": "3, 2, 1", "weight": "1", "centre": "1/2, 0, 0", "omega": "1, 0, 2", "gamma": "3/5, 0, 4/5"}
    table = "t,omega1,omega2,omega3,gamma1,gamma2,gamma3\n1,1,0,2,0.6,0,0.8\n"
    unused = {"sequence": "zxz", "angles": "degrees", "up": "y", "pivot": "1, 2, 3", "matrix": "space_to_body"}
    file = tmp_path / "motion.csv"
    for key, value in unused.items():
        file.write_text("".join(f"# {key}: {value}\n" for key, value in (keys | {key: value}).items()) + table)
        assert f"ignored keys: {key}" in read(file).warnings()


def test_the_gamma_of_a_start_is_normalized_where_asked() -> None:
    top, start = ht.HeavyTop((3, 2, 1), 1, ("1/2", 0, 0)), ht.State((1, 0, 2), (0.6, 0, 0.81))
    states = ht.propagate(top, start.normalized(), [1]).to_numpy()
    with pytest.raises(InputError, match="gamma is not a unit vector"):
        ht.score([1], states, top=top, start=start)
    assert ht.score([1], states, top=top, start=start, normalize=True, require=14).passed


@pytest.mark.slow
@pytest.mark.parametrize("power", [-60, 40])
def test_units_of_any_size_change_no_diagnosis(power: int, tmp_path: Path) -> None:
    inertia = ", ".join(f"{i}e{power}" for i in (2, 2, 1))
    units = {"omega": f"0, 0, 3e{-power}", "inertia": inertia, "weight": f"1e{-power}"}
    rows = f"1e{power},0.070737201667703,0,0,0.99749498660405\n2e{power},-0.98999249660044,0,0,0.14112000805987"
    right = scored(lines(rows=rows, **units), tmp_path)
    assert (right.digits_right > 13.5, right.diagnoses) == (True, [])
    rows = f"1e{power},0,0,0.99749498660405,0.070737201667703\n2e{power},0,0,0.14112000805987,-0.98999249660044"
    last = scored(lines(rows=rows, **units), tmp_path)
    assert "scalar_last" in str([(e.kind, e.numbers) for e in last.diagnoses])


@pytest.mark.parametrize("about", ["pivot", "centre of mass"])
def test_a_tensor_about_the_other_point_is_told(about: str, tmp_path: Path) -> None:
    keys = {"mass": "15", "gravity": "9.81", "centre": "0,1,0", "inertia": "0.234375,0.46875,0.234375", "about": about}
    rows = "0,1,0,0,0\n0.01,0.73,0,0.68,0"
    file = tmp_path / "motion.csv"
    file.write_text(lines(weight="", start_quaternion="", omega="0,150,-4.61538", rows=rows, **keys), "utf-8")
    told = [text for text in read(file, None, True).warnings() if "not a rigid body's" in text]
    assert len(told) == (about == "pivot")
    assert all("the tensor is about the centre of mass, and was read as about the pivot" in text for text in told)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "factor"), [("omega_in_degrees", 180 / np.pi), ("omega_reversed", -1)])
def test_omega_is_compared_with_the_rate_of_the_attitude_where_the_body_is_another(kind, factor, tmp_path) -> None:
    motion, q, omega = BODY
    near = conventions.integrate(motion, motion.rotation[0], motion.omega[0], [0.02 * i for i in range(1, 41)])
    other = replace(near, inertia=near.inertia * (1 + np.diag([0, 0.2, 0.1])))
    wrong = conventions.columns(omega=lambda value: factor * value)
    (told,) = scored(conventions.as_csv(other, q, omega, Written(("quaternion", "omega")), wrong), tmp_path).diagnoses
    assert (told.kind, told.numbers) == (kind, {"of": "rates"})


def test_columns_that_give_one_attitude_and_differ_are_said(tmp_path: Path) -> None:
    shifted = conventions.columns(matrix=lambda rows: rows + 1e-3)
    (told,) = scored(conventions.as_csv(*BODY, Written(("quaternion", "matrix")), shifted), tmp_path).diagnoses
    assert (told.kind, told.numbers["columns"], told.numbers["by"]) == (
        "columns_disagree",
        "quaternion and matrix",
        "1.00e-03",
    )
