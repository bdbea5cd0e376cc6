"""Tables as other programs write them, cases that fill in what a file leaves out, the format read off the digits."""

import codecs
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from flint import arb

from heavytop.cases import CASES, Case
from heavytop.errors import InputError
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.features.score.trajectories.columns import header
from heavytop.features.score.trajectories.files import read, read_table, require_body, require_case, unread
from heavytop.integrate.heyoka.motions import propagate
from heavytop.precision import DOUBLE, EXTENDED, QUAD, decimal_text, round_to
from heavytop.top.bodies import Body
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, State
from heavytop.written_numbers import format_of, number

CASE = CASES["lagrange"]
TIMES = [Fraction(k, 2) for k in range(5)]
STATES = propagate(CASE.top, CASE.start, TIMES, DOUBLE, system=CASE.system).to_numpy()
HEADER = "t,Ω1,Ω2,Ω3,γ1,γ2,γ3"
EIGHT = (*range(7), 1)
"""Columns of the table, with one twice."""


def table(header: str | None = HEADER, separator: str = ",", form: str = "%r", order=range(7), rows=None) -> str:
    columns = [[float(t), *state] for t, state in zip(TIMES, STATES, strict=True)] if rows is None else rows
    lines = [separator.join(form % float(row[place]) for place in order) for row in columns]
    return "\n".join([*([header] if header is not None else []), *lines]) + "\n"


def scored(tmp_path: Path, text: str | bytes, name: str = "a.csv", case=CASE):
    file = tmp_path / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read(file, case)


@pytest.mark.parametrize(
    "text",
    [
        table(),
        codecs.BOM_UTF8 + table().encode(),
        table().encode("utf-16"),
        table().replace("\n", "\r\n"),
        table("time [s];w_x;w_y;w_z;g_x;g_y;g_z", ";"),
        table("t(1);omega[1] [1/s];omega[2];omega[3];gamma(1);gamma(2);gamma(3)", ";"),
        table("t;Ω[0];Ω[1];Ω[2];γ1 [1];γ2 [1];γ3 [1]", ";"),
        table("T;OMEGA_1;OMEGA_2;OMEGA_3;GAMMA_1;GAMMA_2;GAMMA_3", ";").replace(".", ","),
        table("t\tp\tq\tr\tγ₁\tγ₂\tγ₃", "\t"),
        table('"t" "\\Omega_{1}" "\\Omega_{2}" "\\Omega_{3}" "\\gamma_{1}" "\\gamma_{2}" "\\gamma_{3}"', " "),
        table("# t omega0 omega1 omega2 gamma0 gamma1 gamma2", "   ", "%.18e"),
        table("% by another program\nt gamma1 gamma2 gamma3 omega1 omega2 omega3", " ", order=(0, 4, 5, 6, 1, 2, 3)),
        table(HEADER, ", ", "%.17E").replace("E", "D"),
        table(HEADER + ",energy", order=EIGHT),
        table("// t, omega (rad/s)\n" + HEADER) + "\n\n",
        "#\n# #\n" + table(),
        table("# t omega1 omega2 omega3 gamma1 gamma2 gamma3\n# Time t in seconds; gyro and wx wy wz in rad/s", "\t"),
        "# inertia: [[5/2], [5/2], [3/2]]\n# a_w a_x a_y a_z b_w b_x b_y b_z\n" + table(),
        table("t;w1;w2;w3;g1;g2;g3\n(s);rad/s;1/s;[rad/s];-;1;", ";"),
        "sep=;\n" + table(HEADER.replace(",", ";"), ";"),
        "# weight: 2;;;;\n# centre: 0, 0, 3/4;;;;\n" + table(HEADER.replace(",", ";"), ";").replace(".", ","),
        '# weight: 2,,,,\n"# centre: 0, 0, 3/4",,,,\n# inertia: 5/2,5/2,3/2,,\n' + table("n" + HEADER, ",")[1:],
    ],
    ids=range(22),
)
def test_a_table_of_another_program_is_read_as_it_was_meant(text: str | bytes, tmp_path: Path) -> None:
    given = scored(tmp_path, text)
    assert given.times == TIMES
    assert (given.precision, given.format_guessed, given.name) == (DOUBLE, True, "lagrange")
    np.testing.assert_array_equal(np.array(given.states, float), STATES)
    assert (given.top, given.start) == (CASE.top, CASE.start)


def test_hexadecimal_tables_and_columns_without_a_header_are_read(tmp_path: Path) -> None:
    rows = [[float(t).hex(), *(float(v).hex() for v in s)] for t, s in zip(TIMES, STATES, strict=True)]
    given = scored(tmp_path, "\n".join(["# t w1 ... g3", *map(" ".join, rows)]), "a.dat")
    assert given.notes == ("columns without a header, read as t omega1 omega2 omega3 gamma1 gamma2 gamma3",)
    np.testing.assert_array_equal(np.array(given.states, float), STATES)


def test_the_row_of_time_0_is_the_start_where_nothing_else_says_it(tmp_path: Path) -> None:
    data = "# inertia = 5/2 5/2 3/2\n# weight: 2\n# centre: [0; 0; 3/4]\n"
    given = scored(tmp_path, data + table(), case=None)
    assert given.start.flat == tuple(Fraction(repr(float(value))) for value in STATES[0])
    assert given.top == CASE.top
    rows = [[float(t), *state] for t, state in zip(TIMES, STATES, strict=True)][1:]
    with pytest.raises(InputError, match="attitude at t = 0 is missing") as caught:
        scored(tmp_path, data + table(rows=rows), case=None)
    assert "--case" in caught.value.remedy
    with pytest.raises(InputError, match="No time other than 0"):
        scored(tmp_path, table(rows=[[0.0, *STATES[0]]]))


DEGREES, RPM = np.repeat([180 / np.pi, 1], 3), np.repeat([30 / np.pi, 1], 3)


@pytest.mark.parametrize(
    ("header", "factors", "time"),
    [
        ("t [ms],w1 [deg/s],w2 [deg/s],w3 [°/s],g1,g2,g3", DEGREES, 1000),
        ("time (µs);omega[1] (deg/sec);omega[2] (deg/sec);omega[3] (deg/sec);g1 [-];g2 [-];g3 [-]", DEGREES, 1_000_000),
        ("t / min,wx/(deg s^-1),wy/(deg s⁻¹),wz/deg·s^-1,g1,g2,g3", DEGREES, 1 / 60),
        ("t [s],w1 [rpm],w2 [rev/min],w3 [RPM],g1,g2,g3", RPM, 1),
        ("t [s],w1 [rev/s],w2 [Hz],w3 [rps],g1,g2,g3", np.repeat([1 / (2 * np.pi), 1], 3), 1),
        ("t [s],w1 [°/h],w2 [deg/hr],w3 [deg/hour],g1,g2,g3", np.repeat([648000 / np.pi, 1], 3), 1),
        ("t [s],w1 [mrad/s],w2 [mrad s^-1],w3 [mrad/sec],g1,g2,g3", np.repeat([1000, 1], 3), 1),
        ("t [msec],w1 (dps),w2 (dps),w3 (dps),g1,g2,g3", DEGREES, 1000),
        ("t,w1,w2,w3,g1,g2,g3", np.ones(6), 1),
        ("t [s],w1 [rad/s],w2 [1/s],w3,g1 [1],g2,g3", np.ones(6), 1),
    ],
)
def test_the_units_of_a_header_are_those_of_its_numbers(
    header: str, factors: np.ndarray, time: float, tmp_path: Path
) -> None:
    """With the digits of the numbers: the units of the data are s and rad/s."""
    rows = [[float(t) * time, *(np.array(state) * factors)] for t, state in zip(TIMES, STATES, strict=True)]
    given = scored(tmp_path, table(header, ";" if ";" in header else ",", rows=rows))
    assert [float(t) for t in given.times] == pytest.approx([float(t) for t in TIMES], rel=1e-15)
    np.testing.assert_allclose(np.array(given.states, float), STATES, rtol=2**-51)
    assert given.precision == DOUBLE
    said = [note for note in given.notes if note.startswith("as the header declares")]
    assert len(said) == (time != 1 or factors[0] != 1)


def test_a_number_in_degrees_is_converted_to_the_last_digit(tmp_path: Path) -> None:
    """π to more digits than any number has: 90 of them, and the nearest double of each."""
    values = ["180", "90." + 90 * "0", "1e-30", "36" + 60 * "0" + ".5"]
    lines = "\n".join(f"{t},{value},0,0,0,0,1" for t, value in enumerate(values, 1))
    given = scored(tmp_path, f"# precision: real:400\nt,w1 [deg/s],w2 [deg/s],w3 [deg/s],g1,g2,g3\n{lines}\n")
    with working_precision(500):
        for state, text in zip(given.states, values, strict=True):
            assert state is not None
            off = ball(state[0]) / (arb.pi() * ball(Fraction(text)) / 180) - 1
            assert off.abs_upper() < arb(2) ** -398


@pytest.mark.parametrize(
    ("names", "places"),
    [
        # what stands in brackets is an index or a unit
        ("R[1][1] R[1][2]", {"matrix": "11 12"}),
        ("R(0,0) matrix[0][1]", {"matrix": "00 01"}),
        ("q[0] q[1] q[2] q[3]", {"quaternion": "0 1 2 3"}),
        ("q(w) quat(x)", {"quaternion": "w x"}),
        ("p[rad/s] q[1/s] r", {"omega": "1 2 3"}),  # no index, nor in the next
        ("phi[1] theta[rad] psi[rad]", {"euler": "φ θ ψ"}),
        ("x[1] y[m] z", {"position": "x y z"}),
        ("gx[rad/s] gy[rad/s] gz[1]", {"omega": "x y", "gamma": "z"}),  # of a gyroscope, by the unit
        # w, x, y, z beside each other are a quaternion
        ("t w x y z", {"quaternion": "w x y z"}),
        ("t x y z w", {"quaternion": "x y z w"}),
        ("t e0 e1 e2 e3 x y z", {"quaternion": "0 1 2 3", "position": "x y z"}),
        ("x y z t W X Y Z", {"quaternion": "w x y z", "position": "x y z"}),
        ("t qw qx qy qz x y z w", {"quaternion": "w x y z", "position": "x y z", "others": "w"}),
        ("t w y x z", {"position": "y x z", "others": "w"}),  # not beside each other in either order
        ("t x y z", {"position": "x y z"}),
        ("t e1 e2 e3 x y z", {"position": "x y z", "others": "e1 e2 e3"}),
    ],
)
def test_names_of_a_header_are_components_of_quantities(names: str, places: dict[str, str]) -> None:
    found = header(names.split())
    components = {quantity: " ".join(parts) for quantity, parts in found.places.items()}
    assert components | ({"others": " ".join(found.others)} if found.others else {}) == places


@pytest.mark.parametrize("size", [Fraction(1, 10**6), Fraction(1), Fraction(10**6)])
@pytest.mark.parametrize("changed", ["inertia", "centre", "gravity"])
def test_a_body_is_compared_with_a_case_at_its_own_scale(size: Fraction, changed: str) -> None:
    """One per cent of the moments, of the centre or of the weight is another body, however small the body is."""
    more = Fraction(101, 100)
    centre, inertia = [size, Fraction(0), 2 * size], [value * size**2 for value in (30, 40, 50)]
    top, start = HeavyTop(inertia, 20 * size, centre), State((0, 0, size), (0, 0, 1))
    case = Case("mine", "", HEAVY_TOP, top, start)
    data = {"mass": 2, "gravity": 10 * size, "centre": centre, "inertia": inertia, "about": "pivot"}
    require_body(case, Body(**data))
    value = data[changed]
    data[changed] = [more * part for part in value] if isinstance(value, list) else more * value
    with pytest.raises(InputError, match="but the case mine has"):
        require_body(case, Body(**data))
    with pytest.raises(InputError, match="The file has Ω3"):
        require_case(case, top, State((0, 0, size * more), (0, 0, 1)), HEAVY_TOP, None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# weight: 3\n" + table(), "The file has weight = 3, but the case lagrange has 2"),
        ("# inertia: 3/2, 5/2, 5/2\n" + table(), "The file has I1 = 3/2"),
        ("# system: gyrostat\n" + table(), "The file has system = gyrostat"),
        ("# gamma: 2/7, 3/7, -6/7\n" + table(), "The file has γ3 = -6/7, but the case lagrange has 6/7"),
        (table(order=(0, 4, 5, 6, 1, 2, 3)), "Ω1 of the row t = 0 = 0.285714, but the case lagrange has 1/5"),
        ("# wieght: 3\n" + table(), "Unknown key 'wieght'"),
        (table("t,w1,w2,w3,w3,g2,g3"), "The column omega3 occurs twice"),
        (table("t,imu.wx,w_y,w_z,gx,gy,gz").replace("w_y", "odom.wx"), "'wx' occurs twice, as 'imu.wx' and 'odom.wx'"),
        (table("t,time_ms,w1,w2,w3,g2,g3"), "The column t occurs twice, as 't' and 'time_ms'"),
        (table("n,qw,qx,qy,qz,a,b"), "No column holds the times"),
        ("# step: abc\n" + table(), "step: 'abc' is not a finite number"),
        ("# step: -1/8\n" + table(), "step must be positive; got -1/8"),
        (table("t,w0,w1,w3,g1,g2,g3"), "omega are incomplete: component 2 is missing"),
        (table("t,phi [deg],theta [rad],psi [deg],g1,g2,g3"), "in degrees and in radians"),
        (table("t,w1 [deg/s],w2 [rad/s],w3 [deg/s],g1,g2,g3"), "units of omega differ: in deg/s and in rad/s"),
        (table("t,w1 [rpm],w2,w3,g1,g2,g3"), "units of omega differ: in rpm and without a unit"),
        (
            "# angles: degrees\n" + table("t,phi_rad,theta_rad,psi_rad,g1,g2,g3"),
            "header declares radians, but angles = degrees",
        ),
        (table("t,a,b,c,d,e,f"), "The header is not t,omega1.*: Ω, γ not found"),
        ("Position\n" + table(), "Line 2 has 7 columns, not 1"),
        (table(None, order=range(3)), "without a header row 1 has 3 columns, not 7"),
        (table() + "1,2\n", "Line 7 has 2 columns, not 7"),
        (table() + "2,1,1,1,0,0,1\n", "Lines 6 and 7 have the same time and differ"),
        (table() + "3,1,1,1,0,0,abc\n", "Line 7, column gamma3: 'abc' is not a finite number"),
        (table() + "3,1,1,1,0,0,\n", "Line 7, column gamma3 is empty"),
        ("# centre: 0, 0, 0,5\n" + table(), "centre must be 3 numbers; got '0, 0, 0,5'"),
        ("# inertia: 2,5;2,5;1,5\n" + table(), "inertia must be 3 numbers; got '2,5;2,5;1,5'"),
        (HEADER + "\n" + "1,2,3,4,5,6,7\n" * 300_000, "300001 lines are too many.*"),
        (b"t,\0", "got a zero byte"),
        # a quantity is not passed over for how its unit is written
        (table("t,wx deg/s,wy deg/s,wz deg/s,gamma1,gamma2,gamma3"), "'wx deg/s' looks like a component of angular"),
        (table("t,wx_dps,wy_dps,wz_dps,gamma1,gamma2,gamma3"), "'wx_dps' looks like a component of angular velocity"),
        (table("t,omega1 <rpm>,omega2 <rpm>,omega3 <rpm>,qw,qx,qy,qz", order=EIGHT), "'omega1 <rpm>' looks like"),
        (table("t,omega1,omega2,omega3,gamma1 m,gamma2 m,gamma3 m"), "'gamma1 m' looks like a component of gamma"),
        (table("t,qw,qx,qy,qz,x mm,y mm,z mm", order=EIGHT), "'x mm' looks like a component of position"),
        (table("t,x,y,z,w,x,y,z", order=EIGHT), "more than four may belong to a quaternion"),
    ],
)
def test_a_table_that_cannot_be_meant_is_refused(text: str | bytes, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message) as caught:
        scored(tmp_path, text)
    assert caught.value.remedy
    assert len(caught.value.cause) < 400


@pytest.mark.parametrize("text", ["1.#INF", "-1.#IND", "1.#QNAN0", "nan"])
def test_a_state_without_a_number_is_no_remark(text: str, tmp_path: Path) -> None:
    lines = table().splitlines()
    cells = lines[-1].split(",")
    given = scored(tmp_path, "\n".join([*lines[:-1], ",".join([*cells[:3], text, *cells[4:]]) + " # a remark"]))
    assert [state is None for state in given.states] == [False] * (len(given.states) - 1) + [True]


def test_rounded_data_of_a_case_are_still_that_case(tmp_path: Path) -> None:
    text = "# gamma: 0.2857142857142857, 0.4285714285714286, 0.8571428571428571\n" + table(form="%.6f")
    given = scored(tmp_path, text)
    assert given.top == CASE.top
    assert given.times == TIMES


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5D+00", "3/2"), ("-2.5d-3", "-1/400"), ("1.25Q1", "12.5"), ("1.5-101", "1.5e-101"), ("1.5+101", "1.5e101"),
        ("0x1.8p+1", "3"), ("-0X.8", "-1/2"), ("0xA.8P-2", "21/8"), ("0x0p+0", "0"), (" 7 ", "7"), ("1e5", "100000"),
        ("0x1p-1074", f"1/{2**1074}"), ("0x1.fffffffffffffp+0", f"{2**53 - 1}/{2**52}"),
        *((text, None) for text in ("NaN", "-nan", "nan(ind)", "-nan(0x7)", "Infinity", "-inf")),
        *((text, None) for text in ("1.#INF", "-1.#IND", "1.#QNAN0")),
    ],
)  # fmt: skip
def test_numbers_of_fortran_and_c_and_what_they_write_for_none_are_read(text: str, value: str | None) -> None:
    assert number(text, "it") == (None if value is None else Fraction(value))


@pytest.mark.parametrize("form", [DOUBLE, EXTENDED, QUAD], ids=lambda form: form.name)
@pytest.mark.parametrize("more", [0, 2, 9])
def test_digits_beyond_those_of_a_format_do_not_make_it_wider(form, more: int) -> None:
    values = [round_to(Fraction(k, 7), form.bits) for k in range(1, 40)]
    assert format_of(decimal_text(value, form.digits + more) for value in values) == form


def test_xi_and_radii_that_heavytop_writes_itself_are_not_spoken_of() -> None:
    states = ["t", "omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3"]
    own = ["xi1", "xi2", "xi3", "omega1_radius", "gamma3_radius", "xi2_radius"]
    names = [*states, *own]
    table = "\n".join([",".join(names), ",".join("0" * len(names)), ",".join("1" * len(names))])
    assert read_table(table)[1] == []
    assert unread([*own, "energy", "energies_radius"], names) == ["ignored columns: energy, energies_radius"]


def test_what_is_of_another_quantity_is_left_out() -> None:
    others = ["theta_dot", "omega_x_ref", "x_err", "cpu time", "r_err", "w [-]"]
    found = header(["t", *(f"omega{k}" for k in "123"), *(f"gamma{k}" for k in "123"), *others])
    assert found.others == tuple(others)
    assert set(header(["t", "w [-]", "x [mm]", "y [mm]", "z [mm]"]).places) == {"position"}


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("t [weeks];omega1;omega2;omega3;gamma1;gamma2;gamma3", "t in weeks"),
        ("t [m];omega1;omega2;omega3;gamma1;gamma2;gamma3", "t in m"),
        ("t [s];omega1/(gon/s);omega2/(gon/s);omega3/(gon/s);gamma1;gamma2;gamma3", "omega in gon/s"),
        ("t [s];omega1 [rad/s];omega2 [1/s];omega[3];gamma1;gamma2;gamma3", ""),
    ],
)
def test_a_unit_that_is_not_converted_is_named(header: str, said: str, tmp_path: Path) -> None:
    notes = [note for note in scored(tmp_path, table(header, ";")).notes if "not converted" in note]
    assert notes == ([f"unknown units in the header, not converted: {said}"] if said else [])
