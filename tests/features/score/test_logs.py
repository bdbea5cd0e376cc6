"""Logs of robots, spacecraft and simulators: one motion in every form is scored as the plain file of it."""

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path

import numpy
import pytest
from scipy.spatial.transform import Rotation

import heavytop as ht
from heavytop.errors import InputError
from heavytop.features.score.trajectories.bags import of_bag, storage
from heavytop.features.score.trajectories.columns import header
from heavytop.features.score.trajectories.files import read
from support.in_process import heavytop, printed

BODY = ht.Body("2", "9.81", ("0.3", "-0.2", "0.4"), ("1.2", "0.9", "0.6"), "centre of mass")
HEAD = """# mass: 2
# gravity: 9.81
# centre: 0.3, -0.2, 0.4
# inertia: 1.2, 0.9, 0.6
# about: centre of mass
# omega: 1, 2, 6
"""
TIMES = [k / 10 for k in range(11)]


@cache
def run() -> ht.Trajectory:
    start = ht.State(omega=(1, 2, 6), attitude=ht.Attitude.quaternion("0.8", 0, "0.6", 0))
    return ht.propagate(BODY, start, [str(time) for time in TIMES], ht.DOUBLE)


def quaternions() -> numpy.ndarray:
    return run().quaternions()


def scalar_last() -> numpy.ndarray:
    return quaternions()[:, [1, 2, 3, 0]]


def matrices() -> numpy.ndarray:
    return Rotation.from_quat(scalar_last()).as_matrix()


def omegas() -> numpy.ndarray:
    return run().to_numpy()[:, :3]


def rows(*columns: Iterable[object], separator: str = ",") -> str:
    flat = [numpy.asarray(column).reshape(len(TIMES), -1) for column in columns]
    return "\n".join(separator.join(repr(float(v)) for part in flat for v in part[i]) for i in range(len(TIMES)))


def mrp() -> numpy.ndarray:
    """σ = v/(1 + w), of the shadow set where |σ| > 1."""
    q = quaternions()
    sigma = q[:, 1:] / (1 + q[:, :1])
    square = (sigma**2).sum(axis=1, keepdims=True)
    return numpy.where(square > 1, -sigma / square, sigma)


def vectors() -> numpy.ndarray:
    q = quaternions()
    length = numpy.linalg.norm(q[:, 1:], axis=1, keepdims=True)
    return 2 * numpy.arctan2(length, q[:, :1]) * q[:, 1:] / length


def exported(stamp: str, times: Sequence[str], attitude: str, rate: str) -> str:
    """Rows of a program that names its columns by paths, which end in x, y, z, w."""
    names = [attitude + a for a in "xyzw"] + [rate + a for a in "xyz"]
    body = rows(scalar_last(), omegas()).splitlines()
    return HEAD + "\n".join([",".join([stamp, *names]), *map(",".join, zip(times, body, strict=True))])


def mujoco(joint: str, off: float = 1e-15) -> str:
    """A free joint is held at the origin of the body, by a constraint that is off by so much."""
    shift = 3 if joint == "free" else 0
    names = [f"qpos[{k}]" for k in range(4 + shift)] + [f"qvel[{k + shift}]" for k in range(3)]
    origin = off * numpy.sin(numpy.outer(TIMES, numpy.arange(1, shift + 1)))
    parts = TIMES, numpy.hstack([origin, quaternions()]), omegas()
    return HEAD + f"# joint: {joint}\n" + ",".join(["time", *names]) + "\n" + rows(*parts)


def tum(header: bool) -> str:
    shifted = [1.5e9 + time for time in TIMES]
    positions = numpy.zeros((len(TIMES), 3)) + run().positions()
    comment = "# timestamp tx ty tz qx qy qz qw\n" if header else ""
    return HEAD + comment + rows(shifted, positions, scalar_last(), separator=" ")


def ephemeris() -> str:
    meta = "ATTITUDE_TYPE = QUATERNION\nQUATERNION_TYPE = LAST\nATTITUDE_DIR = A2B"
    body = rows(scalar_last(), separator=" ").splitlines()
    lines = [f"2026-001T00:00:{time:04.1f} {line}" for time, line in zip(TIMES, body, strict=True)]
    comments = HEAD.replace("# ", "COMMENT ")
    parts = ("CCSDS_AEM_VERS = 1.0", comments, "META_START", meta, "META_STOP", "DATA_START", *lines, "DATA_STOP")
    return "\n".join(parts)


def over_a_leap_second(first: int) -> str:
    """The ephemeris from that tenth of the last minute of 2016 on, which has 61 seconds."""
    lines = []
    for k, line in enumerate(line for line in ephemeris().splitlines() if line.startswith("2026-001")):
        tenth = first + k
        day = f"2016-12-31T23:59:{tenth / 10:04.1f}" if tenth < 610 else f"2017-001T00:00:{(tenth - 610) / 10:04.1f}Z"
        lines.append(f"{day} {line.split(maxsplit=1)[1]}")
    begin, end = ephemeris().split("DATA_START")[0], "DATA_STOP"
    return "\n".join([begin.replace("META_STOP", "TIME_SYSTEM = UTC\nMETA_STOP") + "DATA_START", *lines, end])


def later_ephemeris() -> str:
    """An ephemeris whose first row is behind its START_TIME, of which the comments give the attitude."""
    q = ", ".join(map(str, quaternions()[0]))
    begin = f"START_TIME = 2026-01-01T00:00:00.0\nMETA_STOP\nCOMMENT start_quaternion: {q}"
    lines = ephemeris().replace("META_STOP", begin).splitlines()
    return "\n".join(line for line in lines if not line.startswith("2026-001T00:00:00.0"))


FORMS: dict[str, tuple[str, Callable[[], str]]] = {
    "modified Rodrigues parameters": ("csv", lambda: HEAD + "t,sigma1,sigma2,sigma3\n" + rows(TIMES, mrp())),
    "rotation vector": (
        "csv",
        lambda: HEAD + "# attitude: rotation vector\nt,rx,ry,rz\n" + rows(TIMES, vectors()),
    ),
    "MuJoCo, free joint": ("csv", lambda: mujoco("free")),
    "MuJoCo, ball joint": ("csv", lambda: mujoco("ball")),
    "TUM": ("txt", lambda: tum(True)),
    "TUM without a header": ("tum", lambda: tum(False)),
    "ephemeris": ("aem", ephemeris),
    "ephemeris of a later row": ("aem", later_ephemeris),
    "ephemeris into a leap second": ("aem", lambda: over_a_leap_second(595)),
    "ephemeris over a leap second": ("aem", lambda: over_a_leap_second(605)),
    "ephemeris below its comments": ("aem", lambda: HEAD + ephemeris().replace(HEAD.replace("# ", "COMMENT "), "")),
    "underscores": (
        "csv",
        lambda: (
            HEAD
            + "sim_time,quat_w,quat_x,quat_y,quat_z,angvel_x,angvel_y,angvel_z\n"
            + rows(TIMES, quaternions(), omegas())
        ),
    ),
}


def rated(kind: str, more: str) -> str:
    """The message with rates in deg/s, in the axes that ``more`` names."""
    lines = ephemeris().replace("ATTITUDE_TYPE = QUATERNION", f"ATTITUDE_TYPE = {kind}\n{more}").splitlines()
    first = lines.index("DATA_START") + 1
    for index, omega in enumerate(numpy.degrees(omegas())):
        lines[first + index] += "".join(f" {value!r}" for value in omega.tolist())
    return "\n".join(lines)


def optitrack(unit: float, name: str) -> str:
    """Of a rigid body, with a marker behind it."""
    numbers = numpy.arange(11.0), TIMES, scalar_last(), unit * run().positions(), numpy.ones((11, 3))
    columns = [("", "", "Frame"), ("", "", "Time (Seconds)"), *(("Rigid Body", "Rotation", axis) for axis in "XYZW")]
    columns += [(kind, "Position", axis) for kind in ("Rigid Body", "Marker") for axis in "XYZ"]
    kinds, quantities, axes = map(",".join, zip(*columns, strict=True))
    begin = f"# quaternion_order: xyzw\nFormat Version,1.23,Rotation Type,Quaternion,Length Units,{name}\n\n"
    return f"{HEAD}{begin}{kinds}\n{quantities}\n{axes}\n{rows(*numbers)}"


def timetable() -> str:
    lines = [line.replace(",", " sec,", 1) for line in rows(TIMES, quaternions()).splitlines()]
    return "\n".join([f"{HEAD}Time,q_1,q_2,q_3,q_4", *lines])


NANO = [f"{17 * 10**17 + k * 10**8}" for k in range(11)]
SPLIT = [f"{1700000000 + k // 10},{k % 10 * 100000000}" for k in range(11)]
BASILISK = ",".join(f"{name}[{k}]" for name in ("sigma_BN", "omega_BN_B") for k in range(3))
BASILISK_1 = "sigma_BN_1,sigma_BN_2,sigma_BN_3,omega_BN_B1,omega_BN_B2,omega_BN_B3"
TO_BODY = "REF_FRAME_A = EME2000\nREF_FRAME_B = SC_BODY_1\nRATE_FRAME = REF_FRAME_B"
FROM_BODY = "ATTITUDE_DIR = B2A\nREF_FRAME_A = SC_BODY_1\nREF_FRAME_B = ICRF"
TRICK = ",".join(
    ["out.time {s}", *(f"b.quat[{k}] {{--}}" for k in range(4)), *(f"b.omega[{k}] {{rad/s}}" for k in range(3))]
)
FORMS |= {
    "Trick": ("csv", lambda: f"{HEAD}{TRICK}\n{rows(TIMES, quaternions(), omegas())}"),
    "OpenSim": (
        "sto",
        lambda: (
            f"{HEAD}motion\nnRows=11\nendheader\ntime\tqw\tqx\tqy\tqz\n{rows(TIMES, quaternions(), separator=chr(9))}"
        ),
    ),
    "OptiTrack": ("csv", lambda: optitrack(1.0, "Meters")),
    "OptiTrack in millimetres": ("csv", lambda: optitrack(1000.0, "Millimeters")),
    "timetable of MATLAB": ("csv", timetable),
    "typeset minus": ("csv", lambda: (HEAD + "t,qw,qx,qy,qz\n" + rows(TIMES, quaternions())).replace("-", "−")),
    "ROS": ("csv", lambda: exported("stamp.sec,stamp.nanosec", SPLIT, "pose.orientation.", "twist.angular.")),
    "ROS as pandas writes it": (
        "csv",
        lambda: exported(
            "stamp.sec,stamp.nanosec", [f"{text}.0" for text in SPLIT], "pose.orientation.", "twist.angular."
        ),
    ),
    "nanoseconds of several seconds": (
        "csv",
        lambda: exported("sec,nsec", [f"17,{k}00000000" for k in range(11)], "orientation.", "angular."),
    ),
    **{
        f"seconds beside {name}": (
            "csv",
            lambda name=name: f"{HEAD}{name},sec,nsec,qw,qx,qy,qz\n{rows(TIMES, numpy.ones((11, 2)), quaternions())}",
        )
        for name in ("t", "header.stamp", "timestamp")
    },
    "rostopic with two stamps": (
        "csv",
        lambda: exported(
            "%time,field.header.stamp",
            [f"{int(time) + 7 * k * k},{time}" for k, time in enumerate(NANO)],
            "field.orientation.",
            "field.angular_velocity.",
        ),
    ),
    "rostopic": ("csv", lambda: exported("%time", NANO, "field.orientation.", "field.angular_velocity.")),
    "PlotJuggler": (
        "csv",
        lambda: exported("__time", list(map(str, TIMES)), "/imu/orientation/", "/imu/angular_velocity/"),
    ),
    "milliseconds": (
        "csv",
        lambda: exported("time_ms", [str(100 * k) for k in range(11)], "pose_orientation_", "pose_angular_"),
    ),
    "rosbag2 with two stamps": (
        "csv",
        lambda: exported(
            "timestamp,.header.stamp.sec,.header.stamp.nanosec",
            [f"{int(time) + 7 * k * k},{split}" for k, (time, split) in enumerate(zip(NANO, SPLIT, strict=True))],
            ".orientation.",
            "body.omega.",
        ),
    ),
    "milliseconds since 1970": (
        "csv",
        lambda: exported("TIME", [time[:-6] for time in NANO], "orientation.", "angular_velocity."),
    ),
    "nanoseconds since 1970": ("csv", lambda: exported("time_ns", NANO, "orientation.", "angular_velocity.")),
    "local time": (
        "csv",
        lambda: exported("Time", [f"2026-01-31 12:00:0{k / 10:.1f}" for k in range(11)], "orientation.", "gyro_"),
    ),
    "brackets with commas": (
        "csv",
        lambda: "\n".join(
            [f"{HEAD}t," + ",".join(f'"R({i},{j})"' for i in (1, 2, 3) for j in (1, 2, 3)), rows(TIMES, matrices())]
        ),
    ),
    "OpenSim in degrees": (
        "sto",
        lambda: (
            f"# sequence: ZYX\n{HEAD}motion\ninDegrees=yes\nendheader\ntime yaw pitch roll\n"
            + rows(TIMES, Rotation.from_matrix(matrices()).as_euler("ZYX", degrees=True), separator=" ")
        ),
    ),
    "a link of ROS, positions in inches": (
        "csv",
        lambda: (
            f"# link: base\n{HEAD}t [days],qw,qx,qy,qz,x [in],y [in],z [in]\n"
            + rows([time / 86400 for time in TIMES], quaternions(), run().positions() / 0.0254)
        ),
    ),
    "Basilisk": ("csv", lambda: f"{HEAD}time,{BASILISK}\n{rows(TIMES, mrp(), omegas())}"),
    "Basilisk from 1": ("csv", lambda: f"{HEAD}time,{BASILISK_1}\n{rows(TIMES, mrp(), omegas())}"),
    "ephemeris with rates": ("aem", lambda: rated("QUATERNION/RATE", TO_BODY)),
    "ephemeris from the body": ("aem", lambda: ephemeris().replace("ATTITUDE_DIR = A2B", FROM_BODY)),
}


def digits(path: Path, text: str = "", *options: str) -> float:
    """The right digits of a file, of which this is the text if it is not there."""
    if text:
        path.write_text(text)
    done = heavytop("score", path, "--json", *options)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)["digits_right"]


def refusal(path: Path, text: str) -> str:
    path.write_text(text)
    done = heavytop("score", path)
    assert done.returncode == 2
    return done.stderr


@pytest.mark.parametrize("name", FORMS)
def test_every_form_of_one_motion_is_right(name: str, tmp_path: Path) -> None:
    suffix, text = FORMS[name]
    # epochs of 1.5e9 s in double have 2e-7 s
    assert digits(tmp_path / f"log.{suffix}", text()) > (6 if name.startswith("TUM") else 13)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("ATTITUDE_DIR = A2C", "ATTITUDE_DIR must be A2B or B2A; got 'A2C'"),
        ("ATTITUDE_DIR = A2B\nATTITUDE_DIR = B2A", "The key ATTITUDE_DIR occurs twice"),
        ("ATTITUDE_DIRECTION = B2A", "Unknown key 'ATTITUDE_DIRECTION'.*Did you mean ATTITUDE_DIR?"),
    ],
)
def test_a_key_of_an_ephemeris_that_is_not_understood_is_refused(line: str, said: str, tmp_path: Path) -> None:
    (file := tmp_path / "log.aem").write_text(ephemeris().replace("ATTITUDE_DIR = A2B", line))
    with pytest.raises(InputError, match=f"(?s){said}"):
        read(file)


def test_arrays_of_numpy_are_a_table(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    comments = {"mass": "2", "gravity": "9.81", "about": "centre of mass"}
    lists = {"centre": [0.3, -0.2, 0.4], "inertia": [1.2, 0.9, 0.6], "omega": [1, 2, 6]}
    texts = {key: numpy.array(", ".join(map(str, value))) for key, value in lists.items()}
    whole = {"mass": 2, "gravity": 9.81, "about": "centre of mass", **lists, "inertia": numpy.diag(lists["inertia"])}
    for arrays in (
        {"t": TIMES, "quaternions": quaternions(), **comments, **texts},
        {"t": TIMES, "q": scalar_last(), "quaternion_order": "xyzw", **comments, **texts},
        {"t": TIMES, "quaternions": scalar_last(), "quaternion_order": "scalar last", **comments, **texts},
        {"time": TIMES, "R": run().matrices(), **whole},
        {"time": TIMES, "qpos": quaternions(), "qvel": omegas(), "joint": "ball", **whole},
        {"time": TIMES, "root_quat_xyzw": scalar_last(), "target_quat_wxyz": scalar_last(), **whole},
    ):
        numpy.savez(path, **arrays)
        assert digits(path) > 13


@pytest.mark.parametrize(
    "name", ["empty.npz", "zero.npy", "cut.npz", "spoilt.npz", "none.npy", "cut.parquet", "ragged.parquet"]
)
def test_arrays_without_rows_or_cut_short_are_refused(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    if name == "empty.npz":
        numpy.savez(path)
    elif name == "spoilt.npz":
        numpy.savez_compressed(path, t=TIMES, omega=omegas())
        content = bytearray(path.read_bytes())
        content[55] = 7  # no kind of block
        path.write_bytes(content)
    elif name == "zero.npy":
        numpy.save(path, numpy.zeros((0, 7)))
    elif name == "ragged.parquet":
        pyarrow = pytest.importorskip("pyarrow")
        from pyarrow import parquet

        parquet.write_table(pyarrow.table({"t": [1.0, 2.0], "orientation": [[1.0, 0.0], [1.0]]}), path)
    else:
        path.write_bytes({"cut.npz": b"PK\x03\x04", "none.npy": b"", "cut.parquet": b"PAR1"}[name])
    refused = heavytop("score", path)
    assert refused.returncode == 2
    assert "A log must be" in refused.stderr or "got none" in refused.stderr


def test_a_parquet_table_may_hold_instants_lists_and_the_body(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    said = dict(line[2:].split(": ") for line in HEAD.splitlines())
    stamps = pyarrow.array(map(int, NANO), pyarrow.timestamp("ns"))
    table = pyarrow.table({"header_stamp": stamps, "orientation": quaternions().tolist()})
    parquet.write_table(table.replace_schema_metadata(said), path := tmp_path / "log.parquet")
    assert digits(path) > 13


def plain(lines: Sequence[str]) -> str:
    return HEAD + "t,qw,qx,qy,qz\n" + "\n".join(lines)


def test_repeated_times_are_one_row_or_an_error_and_a_reset_ends_the_log(tmp_path: Path) -> None:
    lines = rows(TIMES, quaternions()).splitlines()
    path = tmp_path / "log.csv"
    assert digits(path, plain([*lines[:5], lines[4], *lines[5:]])) > 13
    other = lines[4].replace(",0.", ",-0.", 1)
    assert "Lines 12 and 13 have the same time and differ" in refusal(path, plain([*lines[:5], other, *lines[5:]]))
    stamps = [f"{1700000000 + time:.1f},{line.split(',', 1)[1]}" for time, line in zip(TIMES, lines, strict=True)]
    stamped = plain([*stamps[:5], stamps[4], *stamps[5:8], *stamps[:3]]).replace("t,qw", "timestamp,qw")
    assert digits(path, stamped) > 13
    path.write_text(plain([*lines[:8], *lines[:3]]))
    shown = heavytop("score", path)
    assert shown.returncode == 0
    assert "the time goes back at line 16" in shown.stdout + shown.stderr
    for require, code, says in (("9", 3, "unknown, because the time goes back at line 16"), ("17", 1, " are right.")):
        shown = heavytop("score", path, "--require", require)
        assert (shown.returncode, says in shown.stdout) == (code, True)
    assert json.loads(heavytop("score", path, "--json", "--require", "9").stdout)["passed"] is None


def test_stamps_in_double_say_how_many_digits_of_the_time_they_keep(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    off = [time * (1 + time * 1e-6) for time in TIMES]
    for name, places, kept in (
        ("timestamp", 7, True),
        ("timestamp", 9, True),
        ("time", 7, True),
        ("t", 2, False),
        ("time_ns", 0, True),
        ("time_ns", -4, False),
    ):
        scale = 1 if places > 0 else 10**9
        stamps = [f"{round(1.7e9 * scale + scale * time, places):.{max(places, 0)}f}" for time in off]
        lines = [f"{stamp},{line}" for stamp, line in zip(stamps, rows(quaternions()).splitlines(), strict=True)]
        path.write_text(plain(lines).replace("t,qw", f"{name},qw"))
        shown = heavytop("score", path)
        assert "counted from the first row" in shown.stderr
        assert ("keep 6 digits of the time" in shown.stderr) == kept


@pytest.mark.parametrize(
    ("names", "quantities"),
    [
        ("t,q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []", "quaternion"),
        ("t,body_qw,body_qx,body_qy,body_qz,body_wx,body_wy,body_wz", "quaternion framed"),
        ("t,w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],b_w_RS_S_x", "framed"),
        ("t,framequat_w,framequat_x,framequat_y,framequat_z,gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)",
         "quaternion framed"),
        ("elapsed,rot_x,rot_y,rot_z,rot_w,root_ang_vel_b_x,root_ang_vel_b_y,root_ang_vel_b_z", "quaternion framed"),
        ("TimeUS,Q1,Q2,Q3,Q4", "quaternion"),
        ("TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "framed"),
        ("Time (s),Gyroscope x (rad/s),Gyroscope y (rad/s),Gyroscope z (rad/s)", "framed"),
        ("Elapsed Time,root_pos_w_x,root_pos_w_y,root_pos_w_z,root_lin_vel_w_x,root_lin_vel_w_y,root_lin_vel_w_z",
         "position"),
        ("t,imu_w_x,imu_w_y,imu_w_z,v_w_x,v_w_y,v_w_z,goal_q_w,goal_q_x,goal_q_y,goal_q_z", "framed"),
        ("t,root_quat_w_w,root_quat_w_x,root_quat_w_y,root_quat_w_z,root_ang_vel_w_x,root_ang_vel_w_y,root_ang_vel_w_z",
         "quaternion omega_space"),
        ("t_sec,dcm_11,dcm_12,dcm_13,dcm_21,dcm_22,dcm_23,dcm_31,dcm_32,dcm_33", "matrix"),
        ("seconds,C00,C01,C02,C10,C11,C12,C20,C21,C22", "matrix"),
        ("t,desired_q_w,desired_q_x,desired_q_y,desired_q_z,q_w,q_x,q_y,q_z", "quaternion"),
        ("time_usec,Quat_q0,Quat_q1,Quat_q2,Quat_q3,qdot_w,qdot_x,qdot_y,qdot_z", "quaternion"),
        ("t,qw,qx,qy,qz,qdot_w,qdot_x,qdot_y,qdot_z,Tx,Ty,Tz,sigma_x,sigma_y,sigma_z", "quaternion"),
        ("t,wx_body,wy_body,wz_body,omega_x_world,omega_y_world,omega_z_world", "omega omega_space"),
        ("t,wx,wy,wz,rx [deg],ry [deg],rz [deg]", "framed"),
        ("Time,Body.Angular Velocity.X,Body.Angular Velocity.Y,Body.Angular Velocity.Z", "framed"),
        ("t,Sat.AngularVelocityX,Sat.AngularVelocityY,Sat.AngularVelocityZ", "framed"),
        ("time,body.w_a[1],body.w_a[2],body.w_a[3]", "omega"),
    ],
)  # fmt: skip
def test_names_of_other_programs_are_understood(names: str, quantities: str) -> None:
    meaning = header(names.split(","))
    assert set(meaning.places) == set(quantities.split())
    assert meaning.time == 0


def test_a_table_without_a_header_and_one_of_a_longer_comment(tmp_path: Path) -> None:
    """Of EuRoC: nanoseconds since 1970, units in brackets, columns beside; and `ros2 topic echo --csv`."""
    named = "#timestamp [ns],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],v_RS_R_x [m s^-1]\n"
    body = [f"{time},{line},0" for time, line in zip(NANO, rows(quaternions()).splitlines(), strict=True)]
    path = tmp_path / "log.csv"
    assert digits(path, HEAD + named + "\n".join(body)) > 13
    unnamed = HEAD + "\n".join(f"{k},imu,0,0,0,0,1" for k in range(11))
    assert "must be a header or numbers; got 'imu'" in refusal(path, unnamed)


def test_rows_of_one_time_are_one_where_they_agree_to_the_digits_printed(tmp_path: Path) -> None:
    lines = rows(TIMES, quaternions()).splitlines()
    short = ",".join([lines[4].partition(",")[0], *(f"{float(text):.8f}" for text in lines[4].split(",")[1:])])
    path = tmp_path / "log.csv"
    assert digits(path, plain([*lines[:4], short, *lines[4:]])) > 13
    assert "the same time and differ" in refusal(path, plain([*lines[:5], short[:-1] + "99", *lines[5:]]))


@pytest.mark.parametrize(
    ("names", "says"),
    [
        ("t,quatA,quatB,quatC,quatD", "looks like an attitude"),
        ("t,a_w,a_x,a_y,a_z,b_w,b_x,b_y,b_z", "Several columns are quaternions"),
        ("t,qpos[3],qpos[4],qpos[5],qpos[6]", "is not declared"),
        ("t,qw,qx,qy,qz,qvel.0,qvel.1,qvel.2,n", "'qvel.0' is not declared"),
        ("t,omega1,omega2,omega3,px,a,b,c,d", "'a' to 'd' look like an attitude"),
        ("t,RX,RY,RZ,TX,TY,TZ,n,m", "# attitude: rotation vector"),
        ("t,b.Q[1],b.Q[2],b.Q[3],b.Q[4]", "'b.Q[1]' looks like an attitude"),
        ("t,y[0],y[1],y[2],y[3]", "'y[0]' and 'y[1]' name no quantity"),
        ("t,rx,ry,rz,n", "# attitude: rotation vector"),
        ("t,rpy1,rpy2,rpy3,n", "'rpy1' looks like an attitude"),
        ("t,angular rate 1,angular rate 2,angular rate 3,n", "looks like an angular velocity"),
        ("t,gx,gy,gz,n", "Ω of a gyroscope, or γ"),
        ("sec,nsec,a,b,c", "have 0.1, 0."),
        ("t,cmd_orientation_w,cmd_orientation_x,cmd_orientation_y,cmd_orientation_z", "not found"),
    ],
)
def test_half_a_file_is_never_scored(names: str, says: str, tmp_path: Path) -> None:
    columns = [quaternions()] * (1 + (names.count(",") > 4))
    assert says in refusal(tmp_path / "log.csv", HEAD + names + "\n" + rows(TIMES, *columns))


@pytest.mark.parametrize("first", [12_345_678, 0])
@pytest.mark.parametrize(("unit", "code"), [("", 2), (" [us]", 0)])
def test_times_in_whole_numbers_far_apart_need_a_unit(unit: str, code: int, first: int, tmp_path: Path) -> None:
    """As those of PX4, in microseconds since the start."""
    path = tmp_path / "log.csv"
    ticks = [first + int(time * 1_000_000) for time in TIMES]
    path.write_text(HEAD + f"timestamp{unit},qw,qx,qy,qz\n" + rows(ticks, quaternions()))
    done = heavytop("score", path)
    assert (done.returncode, "Name the column timestamp [us]" in done.stderr) == (code, code == 2)


def test_without_a_reference_and_omega_nothing_is_measured(tmp_path: Path) -> None:
    """Nanoseconds in a column that is called time: no reference reaches so far, and an attitude has no energy."""
    path = tmp_path / "log.csv"
    path.write_text(HEAD + "time,qw,qx,qy,qz\n" + rows([int(time * 10**9) for time in TIMES], quaternions()))
    done = heavytop("score", path)
    assert "there is no reference.\n\nlog: given" in done.stdout, done.stdout + done.stderr


def test_of_a_free_body_omega_alone_is_scored_and_its_fall_is_left_out(tmp_path: Path) -> None:
    body = ht.Body("2", "0", (0, 0, 0), ("1.2", "0.9", "0.6"))
    start = ht.State(omega=(1, 2, 6), attitude=ht.Attitude.quaternion("0.8", 0, "0.6", 0))
    free = ht.propagate(body, start, [str(time) for time in TIMES], ht.DOUBLE)
    head = HEAD.replace("9.81", "0").replace("# centre: 0.3, -0.2, 0.4\n", "")
    falling = numpy.outer(TIMES, (1, 2, 3))
    for text in (
        "t,omega1,omega2,omega3\n" + rows(TIMES, free.to_numpy()[:, :3]),
        "t,px,py,pz,qw,qx,qy,qz\n" + rows(TIMES, falling, free.quaternions()),
    ):
        assert digits(tmp_path / "log.csv", head + text) > 13


def test_stamps_of_a_start_that_is_given_are_counted_from_it(tmp_path: Path) -> None:
    """The first row of a log is later than the attitude at t = 0 of its comments; an epoch is the first row's."""
    said = HEAD + f"# start_quaternion: {', '.join(map(str, quaternions()[0]))}\nstamp.sec,stamp.nanosec,qw,qx,qy,qz\n"
    lines = rows(quaternions()).splitlines()
    path = tmp_path / "log.csv"
    of_px4 = said.replace("stamp.sec,stamp.nanosec", "timestamp [us]")
    path.write_text(of_px4 + "\n".join(f"{10**5 * k},{lines[k]}" for k in range(1, len(lines))))
    assert digits(path) > 13
    # the clock of a computer that began 112 s before the start
    assert digits(path, of_px4 + "\n".join(f"{112_345_678 + 10**5 * k},{line}" for k, line in enumerate(lines))) > 13
    for first, begin in ((0, 1), (15 * 10**8, 0)):
        stamps = [f"{first + int(time)},{round(time % 1 * 10**9)}" for time in TIMES]
        path.write_text(said + "\n".join(map(",".join, [*zip(stamps, lines, strict=True)][begin:])))
        shown = heavytop("score", path, "--json")
        assert json.loads(shown.stdout)["digits_right"] > 13
        assert ("counted from the first row" in shown.stderr) == (begin == 0)
        assert "nanosec" not in shown.stderr


def test_instants_of_a_calendar_are_times_over_a_leap_second(tmp_path: Path) -> None:
    stamps = [*(f"59.{tenth}" for tenth in range(5, 10)), *(f"60.{tenth}" for tenth in range(6))]
    lines = [f"2016-12-31 23:59:{s}Z,{row}" for s, row in zip(stamps, rows(quaternions()).splitlines(), strict=True)]
    path, names = tmp_path / "log.csv", "timestamp [ms],qw,qx,qy,qz\n"
    assert digits(path, HEAD + names + "\n".join(lines)) > 13
    lines[2:] = [line.replace("2016-12-31 23", "2017-01-01 00").replace("Z", "+01:00") for line in lines[2:]]
    assert digits(path, HEAD + names + "\n".join(lines)) > 13
    lines[3] = lines[3].replace("+01:00", "+1h")
    assert "is not an epoch" in refusal(path, HEAD + names + "\n".join(lines))


def test_the_data_of_a_body_are_no_columns_where_there_are_as_many_rows(tmp_path: Path) -> None:
    keys = dict(line[2:].split(": ") for line in HEAD.splitlines() if line.startswith("#") and ": " in line)
    data = {key: [float(v) for v in text.split(",")] if "," in text else text for key, text in keys.items()}
    for count in (3, 6):
        path = tmp_path / f"log{count}.npz"
        numpy.savez(path, t=TIMES[:count], quaternions=quaternions()[:count], **data)
        assert digits(path) > 13


def test_a_joint_that_slips_is_in_no_other_unit_of_length(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(mujoco("free", 1e-5))
    score = json.loads(printed("score", path, "--json"))
    assert (score["diagnosis"], 4 < score["digits_right"] < 5.1) == ([], True)


def test_rows_of_kitti_are_refused_with_the_line_that_names_them(tmp_path: Path) -> None:
    assert "t R11 R12 R13 px R21" in refusal(tmp_path / "poses.txt", HEAD + "1 0 0 0 0 1 0 0 0 0 1 0\n")


def test_without_the_package_one_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(InputError, match=r"needs the extra logs: pip install"):
        of_bag(tmp_path / "log.mcap")


def test_a_folder_is_the_bag_in_it(tmp_path: Path) -> None:
    assert storage(tmp_path) == tmp_path
    (tmp_path / "metadata.yaml").touch()
    (tmp_path / "log_0.mcap").touch()
    assert storage(tmp_path) == tmp_path / "log_0.mcap"
    (tmp_path / "log_1.mcap").touch()
    assert storage(tmp_path) == tmp_path
