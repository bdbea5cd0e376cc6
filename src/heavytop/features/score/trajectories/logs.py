"""Logs of robots, spacecraft and simulators, converted to the tables that this package reads.

TUM trajectories, exports of ROS, Foxglove and MuJoCo, attitude ephemeris messages (CCSDS 504.0-B, KVN), arrays of NumPy
and Parquet.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from fractions import Fraction
from io import BytesIO
from itertools import zip_longest
from typing import Any

from flint import arb, fmpq

from heavytop.errors import InputError, nearest, quoted, refusal
from heavytop.exact.flint.balls import midpoint, working_precision
from heavytop.extras import require_extra
from heavytop.precision import decimal_text

NAMES = "Call quaternions qw,qx,qy,qz, Ω omega1,omega2,omega3, matrices R11 to R33, times t."
TUM = ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
VECTORS = ("inertia", "centre", "omega", "gamma", "rotor")
LISTS = (*VECTORS, "omega_space", "pivot", "point", "start_quaternion", "start_matrix", "start_euler")
"""Keys whose values are lists of numbers."""
KITTI = ("R11", "R12", "R13", "px", "R21", "R22", "R23", "py", "R31", "R32", "R33", "pz")
_STAMP = re.compile(r"(?:.*[./_])?(?:stamp|time|clock)[./_](secs?|n(?:ano)?secs?)", re.IGNORECASE)
_INSTANT = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:")
_EPOCHS = ("timestamp", "stamp", "epoch")
"""Names of columns of times that are counted from their first row."""
_COUNTED = (*_EPOCHS, "t", "time")
_OF_BODY = r"(?:_(?:rs|s|b|ib|bn|body|local|imu))*"
"""Suffixes of an angular velocity in body axes."""
_ALIASES = tuple(
    (re.compile(rf"(?:.*[./_])?{pattern}", re.IGNORECASE), name)
    for pattern, name in (
        (r"(?:quat(?:ernion)?|orientation|rotation|attitude)(?:_w)?[./_]([wxyz])", "q{}"),
        (r"(?:position|translation|pos)(?:_w)?[./_]([xyz])|(?-i:t([xyz])|T([XYZ]))", "p{}"),  # Tx is a torque
        (r"ang_?vel_w_([xyz])", "omega_space_{}"),  # of Isaac: _w_ is the world
        (rf"(?:angular(?:[_ ]?velocity)?|ang_?vel){_OF_BODY}[./_ ]?([xyz])", "w{}"),
        (rf"gyr(?:o(?:scope)?)?{_OF_BODY}[./_ ]?([xyz])", "w{}"),
        # of v_w_x the w is the world
        (rf"(?:(?:(?<!_)|(?<=imu_))w{_OF_BODY}[./_]?([xyz])|w([xyz]))", "w{}"),
        (r"(?:(?:out\.|sim_?)time|time_?s(?:ec(?:onds?)?)?|t_s(?:ec)?|seconds)", "t"),
        (r"elapsed(?:[_ ]?(?:s|secs?|seconds?|time))?", "t"),
        (r"(?:timestamp|stamp|__time)", "timestamp"),
        (r"(?:receive|publish|log|record)_?time", "epoch"),
        (r"(?:timestamp|stamp)_?(ns|us|ms)", "timestamp [{}]"),
        (r"(?:time|t)_?([num]s(?:ec)?)", "t [{}]"),
        (r"%time", "epoch [ns]"),
        (r"sigma_BN[\[_(]?([0-3])[\])]?", "sigma{}"),
        (r"omega_BN_B[\[_(]?([0-3])[\])]?", "omega{}"),
        (r"(?<!_)quat(?:ernion)?[\[(]([0-4])[\])]", "quat{}"),
        # w_a of Modelica
        (r"(?<!_)(?:omega|ang_?vel|angular_?velocity|w_a)(?:[\[(]([0-3])[\])]|\.([xyz]))", "omega{}"),
    )
)
_JOINTS = {"free": (3, 3), "ball": (0, 0)}
"""Index of the quaternion in qpos of MuJoCo, and of the angular velocity in body axes in qvel."""
_INDEX = re.compile(r"(qpos|qvel)[\[_(.]?(\d+)[\])]?", re.IGNORECASE)
_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")
_LOOKS = {
    "an attitude": re.compile(
        r"quat|orient|attitude|(^|[^a-z])att[^a-z]|[._]q[\[(]\d|rodrigues|gibbs|euler|dcm|rpy|ypr|(rot|angle|theta)_?[xyz]$",
        re.I,
    ),
    "an angular velocity": re.compile(
        r"omega|ang(ular)?[ _.-]?(vel|rate)|gyro|body[ _.-]?rate|(roll|pitch|yaw)_?(speed|rate)|\b(rot|a|w)_?vel"
        r"|(^|[._])rates?[._]?[xyz1-3]$|^av[xyz1-3]$|^w_[a-z]{2}_[xyz]$",
        re.IGNORECASE,
    ),
}
_GIVES = {
    "an attitude": ("quaternion", "matrix", "euler", "rodrigues", "rotation_vector", "gamma"),
    "an angular velocity": ("omega", "omega_space", "framed"),
}
_OTHER = re.compile(
    r"(?:.*[._])?(?:cov|err|std|sigma_(?!BN)|des_|desired|setpoint|goal|target|cmd|ref|bias)|b_[wa]_", re.IGNORECASE
)
_WITH_UNIT = re.compile(r"(.*?)\s*([\[(](?!\s*[wxyz]\s*[\])])\s*(?:[^\[\]()\d][^\[\]()]*)?[\])])?")
"""The name of a column, and its unit in brackets, which may be empty."""
_OF_FOUR = re.compile(r"(.*[^\s])([wxyz])", re.IGNORECASE)
_EPOCH_UNITS = ((10**17, "ns"), (10**14, "us"), (10**11, "ms"))
"""Sizes of times since 1970 from which they are in these units."""


def canonical(name: str, joint: str = "") -> str:
    """The name of a column as this program writes it; the name itself unless it is an alias.

    joint: "free" or "ball", of the columns qpos and qvel of MuJoCo.
    """
    name = re.sub(r"\s\{(.*)\}$", r" [\1]", name.strip())  # units of Trick
    base, unit = _WITH_UNIT.fullmatch(name).groups()  # type: ignore[union-attr]
    plain = _alias(base, joint)
    return name if plain == base and unit != "[]" else f"{plain} {(unit or '').strip('[]()') and unit}".strip()


def _alias(text: str, joint: str) -> str:
    if _OTHER.match(text):
        return text
    if (match := _INDEX.fullmatch(text)) and joint in _JOINTS:
        number = int(match[2]) - _JOINTS[joint][match[1].lower() == "qvel"]
        if match[1].lower() == "qpos":
            return f"q{'wxyz'[number]}" if 0 <= number < 4 else f"p{'xyz'[number + 3]}" if -3 <= number < 0 else text
        return f"omega{number + 1}" if 0 <= number < 3 else text
    for pattern, plain in _ALIASES:
        if match := pattern.fullmatch(text):
            return plain.format(next((group.lower() for group in match.groups() if group), ""))
    return text


def require_understood(
    names: Sequence[str], others: Sequence[str], quantities: Sequence[str], cells: Sequence[Sequence[str]]
) -> None:
    """Raises InputError for a column that looks like an attitude or Ω and is not read, where no other gives one.

    names: of all columns; others: of those that are not read.  cells: of each row, in which four or nine neighbours
    look like a quaternion or a matrix.
    """
    missing = [quantity for quantity, givers in _GIVES.items() if not set(givers) & set(quantities)]
    if "an attitude" in missing and {"rx", "ry", "rz"} <= {re.sub(r"\W.*", "", name.strip().lower()) for name in names}:
        raise InputError(
            "The columns rx, ry, rz are ambiguous: a rotation vector, angles, or a position.",
            "Add the line `# attitude: rotation vector` above the columns, or call a position px, py, pz.",
        )
    if "an angular velocity" in missing and {"gx", "gy", "gz"} <= {name.strip().lower() for name in names}:
        raise InputError(
            "The columns gx, gy, gz are ambiguous: Ω of a gyroscope, or γ.",
            "Call them omega1, omega2, omega3, or gamma1, gamma2, gamma3.",
        )
    unread = [name for name in others if not _OTHER.match(name)]
    for name in unread:
        if looks := next((quantity for quantity in missing if _LOOKS[quantity].search(name)), None):
            raise InputError(f"The column {quoted(name)} looks like {looks}, but the name is unknown.", NAMES)
        index = _INDEX.fullmatch(name)
        if index and ("an attitude" if index[1].lower() == "qpos" else "an angular velocity") in missing:
            raise InputError(
                f"The joint of the column {quoted(name)} is not declared.",
                "Add the line `# joint: free` or `# joint: ball` above the columns.",
            )
    for width in (4, 9) if "an attitude" in missing else ():
        for first in range(len(names) - width + 1):
            window = slice(first, first + width)
            if {*names[window]} <= {*unread} and _are_attitudes([row[window] for row in cells]):
                columns = f"{quoted(names[first])} to {quoted(names[window][-1])}"
                raise InputError(f"The columns {columns} look like an attitude, but the names are unknown.", NAMES)


_OF_1970 = 10**9, 4 * 10**9
"""Seconds since 1970 in the years 2001 to 2096: no motion begins so long before its first row."""
_LONG = 500
"""Integers so far apart are not taken for seconds: those of PX4 are microseconds since the start."""


def with_one_time(
    names: Sequence[str], cells: list[list[str]], started: bool
) -> tuple[list[str], list[list[str]], list[str]]:
    """Names, cells and a note: stamps of seconds and nanoseconds are one column t; epochs begin at their first row.

    started: the attitude at t = 0 is given, from which stamps are counted, unless the first is beyond the length of the
    log: then the clock began with the computer.
    """
    names = list(names)
    around = "" if {*_COUNTED} & {canonical(name).partition(" ")[0].lower() for name in names} else "stamp."
    stamps = [_STAMP.fullmatch(f"{around}{name.strip()}") for name in names]
    parts = {match[1].lower()[0]: index for index, match in enumerate(stamps) if match}
    if parts.keys() == {"s", "n"}:
        seconds, nano = parts["s"], parts["n"]
        for row in cells:
            integer, nanoseconds = number(row[seconds]), number(row[nano])
            if integer is not None and nanoseconds is not None:
                if around and (integer.denominator > 1 or 0 < integer == nanoseconds // 10**9):
                    raise InputError(
                        f"The columns {names[seconds]}, {names[nano]} have {row[seconds]}, {row[nano]}: two times.",
                        f"Keep one, as t; or give whole seconds, and in {names[nano]} the nanoseconds since then.",
                    )
                row[seconds] = decimal_text(integer + nanoseconds / 10**9, 40)
            del row[nano]
        names = [re.sub(r"^timestamp\b", "epoch", name) for name in names]  # of the log, not of the message
        names[seconds] = "timestamp [s]"
        del names[nano]
    plain, instant = [canonical(name) for name in names], ""
    words = [name.partition(" ")[0].lower() for name in plain]
    for position, word in enumerate(words):
        if word in _COUNTED and _INSTANT.match(cells[0][position]):
            plain[position], instant = word, cells[0][position]  # whatever the unit
            for row in cells:
                row[position] = decimal_text(_epoch(row[position].replace(" ", "T")), 40)
        if word in _COUNTED:
            for row in cells:
                row[position] = row[position].removesuffix(" sec")  # of a timetable of MATLAB
    index = next((index for word in _COUNTED for index in _places(word, words, cells)), None)
    if index is None or (words[index] == "epoch" and {"t", "time"} & set(words)):
        return names, cells, []
    names[index] = re.sub(r"^\w+", "t", plain[index])
    first = number(cells[0][index])
    if first is None:
        return names, cells, []
    if names[index] == "t":
        names[index] += next((f" [{unit}]" for least, unit in _EPOCH_UNITS if first >= least), "")
    second = number(cells[1][index]) if len(cells) > 1 else None
    if names[index] == "t" and second and second - first >= _LONG and first.denominator == second.denominator == 1:
        apart = f"The column {plain[index]} has integers {decimal_text(second - first, 12)} apart, and no unit."
        raise InputError(apart, f"Name the column {plain[index]} [us], [ms] or [ns], or [s] for seconds.")
    last = number(cells[-1][index]) if len(cells) > 1 else Fraction(0)
    if first == 0 or (started and last is not None and abs(first) <= abs(last - first)):
        return names, cells, []
    loss = _loss([row[index] for row in cells])
    note = f"times are counted from the first row, {instant or decimal_text(first, 20)}{loss}"
    for row in cells:
        if (value := number(row[index])) is not None:
            row[index] = decimal_text(value - first, 40)
    return names, cells, [note]


def _places(word: str, words: Sequence[str], cells: Sequence[Sequence[str]]) -> list[int]:
    """The index of a column of that name whose times are counted from the first row; t and time only if since 1970."""
    if word not in words:
        return []
    index = words.index(word)
    first, last = (number(row[index]) or 0 for row in (cells[0], cells[-1]))
    since_1970 = any(_OF_1970[0] < first / size < _OF_1970[1] for size in (1, 10**3, 10**6, 10**9))
    return [index] if word in _EPOCHS or (since_1970 and last - first < first / 1000) else []


def _loss(stamps: Sequence[str]) -> str:
    """The note on the digits lost to the epoch where all stamps are doubles; empty where none are.

    Zeros at the end of all integers show a larger unit.
    """
    values = [(value, _last_unit(text)) for text in stamps if (value := number(text)) is not None]
    unit, (first, _), (last, _) = min(unit for _, unit in values), values[0], values[-1]
    spacing = Fraction(math.ulp(float(first)))
    while unit >= 1 and last > first and all(value % (10 * unit) == 0 for value, _ in values):
        unit *= 10
    if spacing < unit or not last > first or any(abs(value - Fraction(float(value))) > unit / 2 for value, _ in values):
        return ""
    digits = int(math.log10((last - first) / spacing))
    return f"; as doubles the stamps keep {digits} digits of the time since then: write nanoseconds as integers"


def number(text: str) -> Fraction | None:
    """A decimal number; None for any other text, which is refused where the column is read."""
    return Fraction(text.strip()) if _DECIMAL.fullmatch(text.strip()) else None


def is_unit(texts: Sequence[str]) -> bool:
    """Whether numbers have length 1 to 1 %, as those of a quaternion."""
    values = [number(text) for text in texts]
    return None not in values and abs(sum(float(value or 0) ** 2 for value in values) - 1) < 0.02


def _are_attitudes(rows: Sequence[Sequence[str]]) -> bool:
    """Whether four numbers that vary have length 1 in every row, or nine, as a matrix, in its rows and columns."""
    of_matrix = [entries for i in range(3) for entries in (slice(3 * i, 3 * i + 3), slice(i, 9, 3))]
    parts = [slice(4)] if len(rows[0]) == 4 else of_matrix
    return rows[0] != rows[-1] and all(is_unit(row[entries]) for row in rows for entries in parts)


def without_repeats(
    times: Sequence[Fraction], rows: list[list[str]], lines: Sequence[int]
) -> tuple[list[int], list[str], str]:
    """Indices of the rows to keep, notes, and where the time goes back: repeated rows and all later ones are dropped.

    Raises InputError for two rows at one time that differ.
    """
    kept: list[int] = []
    repeated = 0
    for index, time in enumerate(times):
        if kept and time == times[kept[-1]]:
            if not all(map(_agree, rows[index], rows[kept[-1]])):
                raise InputError(
                    f"Lines {lines[kept[-1]]} and {lines[index]} have the same time and differ.",
                    "Keep one of them; at an impact, the state before or after it.",
                )
            repeated += 1
            kept[-1] = max(kept[-1], index, key=lambda row: sum(map(len, rows[row])))  # more digits
            continue
        if len(kept) > 1 and (time - times[kept[-1]]) * (times[kept[1]] - times[kept[0]]) < 0:
            cut = f"the time goes back at line {lines[index]}"
            return kept, [*_repeats(repeated), f"{cut}: the {len(kept)} rows before it are scored"], cut
        kept.append(index)
    return kept, _repeats(repeated), ""


def _agree(first: str, second: str) -> bool:
    """Whether two texts are one number to the digits of the shorter."""
    a, b = number(first), number(second)
    if first == second or a is None or b is None:
        return first == second
    return abs(a - b) < max(map(_last_unit, (first, second)))


def _last_unit(text: str) -> Fraction:
    digits, _, exponent = text.strip().lower().partition("e")
    return Fraction(10) ** (int(exponent or 0) - len(digits.partition(".")[2]))


def with_quaternion(names: Sequence[str]) -> list[str]:
    """The names, with four columns of one prefix that end in w, x, y and z called a quaternion.

    Raises InputError where there are two such prefixes.
    """
    prefixes: dict[str, dict[str, int]] = {}
    for index, name in enumerate(names):
        match = _OF_FOUR.fullmatch(name.partition(" ")[0])
        if match and not _OTHER.match(name):
            prefixes.setdefault(match[1].lower(), {})[match[2].lower()] = index
    fours = {prefix: places for prefix, places in prefixes.items() if places.keys() == set("wxyz")}
    fours = {"q": fours["q"]} if "q" in fours else fours
    if len(fours) > 1:
        raise InputError(f"Several columns are quaternions: {', '.join(fours)}.", "Call that of the body qw,qx,qy,qz.")
    places = {index: f"q{axis}" for columns in fours.values() for axis, index in columns.items()}
    return [places.get(index, name) for index, name in enumerate(names)]


def _repeats(count: int) -> list[str]:
    return [f"ignored repetitions of the row before: {count}"] if count else []


def of_rodrigues(s: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """The quaternion of modified Rodrigues parameters σ: ((1 − σ²), 2σ)/(1 + σ²); the shadow set is the same."""
    square = sum((value * value for value in s), Fraction(0))
    return ((1 - square) / (1 + square), *(2 * value / (1 + square) for value in s))


def of_rotation_vector(v: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """The quaternion of a rotation vector v, the axis times the angle: (cos |v|/2, sin(|v|/2) v/|v|), to 50 digits."""
    if not any(v):
        return Fraction(1), Fraction(0), Fraction(0), Fraction(0)
    with working_precision(240):
        half = arb(sum(fmpq(x.numerator, x.denominator) ** 2 for x in v)).sqrt() / 2
        sine = midpoint(half.sin() / (2 * half))
        return midpoint(half.cos()), *(sine * x for x in v)


def as_table(text: str) -> str:
    """An attitude ephemeris message as a table.

    A table of OpenSim, or of a rigid body by OptiTrack's Motive, with the lines above it as comments.
    """
    if re.match(r"(\s|#.*\n)*CCSDS_AEM_VERS", text):
        return of_ephemeris(text)
    lines = text.splitlines()
    begin = next((n for n, line in enumerate(lines) if line.startswith("Format Version,")), len(lines))
    end = next((n for n in range(begin, len(lines)) if lines[n].startswith("Frame,")), 0)
    if end > begin + 2:
        kinds = next(line for line in lines[begin + 1 : end] if line.strip(",; "))
        columns = zip_longest(*(line.split(",") for line in (kinds, *lines[end - 1 : end + 1])), fillvalue="")
        named = {"Rotation": "q{}", "Position": f"p{{}} [{'mm' if 'Millimeters' in lines[begin] else 'm'}]"}
        lines[end] = ",".join(
            named[what].format(axis.lower()) if kind == "Rigid Body" and what in named else f"{kind} {what} {axis}"
            for kind, what, axis in columns
        )
    elif "endheader" in lines:
        end = lines.index("endheader")
        if "inDegrees=yes" in lines[:end] and "# angles" not in text:
            lines[end] = "# angles: degrees"
        end += 1
    else:
        return text
    return "\n".join([*(line if line.startswith("#") else f"# | {line}" for line in lines[:end]), *lines[end:]])


_KINDS = ("QUATERNION", "QUATERNION/RATE", "QUATERNION/ANGVEL")
_VALUES = {"QUATERNION_TYPE": ("FIRST", "LAST"), "ATTITUDE_DIR": ("A2B", "B2A")}
_USED = ("ATTITUDE_TYPE", "REF_FRAME_A", "REF_FRAME_B", "RATE_FRAME", "ANGVEL_FRAME", "TIME_SYSTEM", *_VALUES)
_LIKE = 0.8
"""Similarity from which a key is a misspelling of one that is used."""
_SPACECRAFT = re.compile(r"SC_|SPACECRAFT|.*BODY|ACTUATOR|INSTRUMENT|CSS|DSS|GYRO|IMU|STARTRACKER", re.IGNORECASE)
"""Frames of a message that turn with the spacecraft."""


def of_ephemeris(text: str) -> str:
    """An attitude ephemeris message of quaternions as a table; lines of COMMENT or # are comments.

    Raises InputError for several segments, another kind of attitude, and an invalid epoch.
    """
    if text.count("META_START") != 1:
        raise InputError(f"The message must have one segment; got {text.count('META_START')}.", "Give one segment.")
    meta: dict[str, str] = {}
    for key, value in re.findall(r"^\s*([A-Z_]+)\s*=\s*(.*?)\s*$", text, re.MULTILINE):
        if key not in _USED and (near := nearest(key, _USED, _LIKE)):
            raise InputError(f"Unknown key {quoted(key)}.", f"Did you mean {near}?")
        if meta.setdefault(key, value) != value:
            raise InputError(f"The key {key} occurs twice.", "Give each key once.")
        if value.upper() not in (known := _VALUES.get(key, (value.upper(),))):
            raise refusal(key, " or ".join(known), quoted(value), "Give one of these.")
    kind = meta.get("ATTITUDE_TYPE", "").upper()
    if kind not in _KINDS:
        raise InputError(f"ATTITUDE_TYPE = {quoted(kind)} is not supported.", f"Use one of {', '.join(_KINDS)}.")
    first = meta.get("QUATERNION_TYPE", "LAST").upper() == "FIRST"
    order = ["qw", "qx", "qy", "qz"] if first else ["qx", "qy", "qz", "qw"]
    of_spacecraft = {letter: bool(_SPACECRAFT.match(meta.get(f"REF_FRAME_{letter}", ""))) for letter in "AB"}
    body_first = of_spacecraft["A"] and not of_spacecraft["B"]
    if kind in _KINDS[1:]:
        frame = (meta.get("RATE_FRAME") or meta.get("ANGVEL_FRAME") or "").upper()
        of_a = frame.endswith("FRAME_A") or (frame and frame == meta.get("REF_FRAME_A", "").upper())
        axes = "omega_space" if frame and bool(of_a) != body_first else "omega"
        order += [f"{axes}_{axis} [deg/s]" for axis in "xyz"]
    inertial_first = (meta.get("ATTITUDE_DIR", "A2B").upper() == "A2B") != body_first
    lines = [f"# {line}" for line in re.findall(r"^\s*(?:COMMENT|#)[ \t]*(.*?)\s*$", text, re.MULTILINE)]
    if not inertial_first:
        lines.append("# quaternion: space_to_body")
    data = text.partition("DATA_START")[2].partition("DATA_STOP")[0].splitlines()
    rows = [line.split() for line in data if line.strip() and not line.lstrip().startswith(("COMMENT", "#"))]
    system = meta.get("TIME_SYSTEM", "UTC").upper()
    start = _epoch(meta.get("START_TIME") or rows[0][0], system) if rows else Fraction(0)
    lines.append(",".join(["timestamp", *order]))
    lines += [",".join([decimal_text(_epoch(row[0], system) - start, 40), *row[1 : len(order) + 1]]) for row in rows]
    return "\n".join(lines)


_LEAPS = [(year, 1) for year in (*range(1973, 1981), 1988, 1990, 1991, 1996, 1999, 2006, 2009, 2017)]
_LEAPS += [(year, 7) for year in (1972, 1981, 1982, 1983, 1985, 1992, 1993, 1994, 1997, 2012, 2015)]
"""Months before which UTC had a leap second."""


def _epoch(text: str, system: str = "UTC") -> Fraction:
    """Seconds of an epoch, calendar date or day of the year, exactly; in UTC with the leap seconds before it."""
    clock, zone = re.fullmatch(r"(.*?)(Z|[+-]\d\d:\d\d)?", text).groups("Z")  # type: ignore[union-attr]
    seconds, _, decimals = clock.partition(".")
    is_leap = system == "UTC" and seconds.endswith(":59:60")
    for pattern in ("%Y-%m-%dT%H:%M:%S", "%Y-%jT%H:%M:%S"):
        try:
            second = seconds[:-2] + "59" if is_leap else seconds
            moment = datetime.strptime(second + zone, f"{pattern}%z").astimezone(UTC)
            fraction = Fraction(int(decimals or 0), 10 ** len(decimals))
        except ValueError:
            continue
        leaps = sum(month <= (moment.year, moment.month) for month in _LEAPS) if system == "UTC" else 0
        return int(moment.timestamp()) + leaps + is_leap + fraction
    raise InputError(f"{quoted(text)} is not an epoch.", "Write it as 2026-01-31T12:00:00.5.")


ORDERS = {
    **dict.fromkeys(("wxyz", "scalar first", "scalar_first"), "wxyz"),
    **dict.fromkeys(("xyzw", "scalar last", "scalar_last"), "xyzw"),
}
"""Words for the order of quaternions."""


def of_arrays(content: bytes, suffix: str) -> str:
    """A .npy of seven columns or of named ones, a .npz of arrays by their names, or a Parquet table, as CSV.

    Numbers are written so that they are read back the same.  Arrays that have not a row for each time, and what a
    Parquet table says of itself, stand for comments.  Raises InputError for other shapes.
    """
    import numpy

    columns = _of_parquet(content) if suffix == ".parquet" else _of_numpy(content)
    lengths = {canonical(name).partition(" ")[0]: len(array) for name, array in columns.items() if array.ndim}
    count = next((lengths[name] for name in _TIMES if name in lengths), max(lengths.values(), default=0))
    last = ORDERS.get(str(columns.get("quaternion_order", "")).strip().lower()) == "xyzw"
    names: list[str] = []
    parts: list[Any] = []
    comments = []
    for name, array in columns.items():
        is_key = name in LISTS and (array.ndim == 1 or name not in ("omega", "gamma", "omega_space"))
        if array.ndim == 0 or (array.size <= 9 and (array.dtype.kind in "US" or is_key or len(array) != count)):
            comments.append(f"# {name}: {', '.join(map(str, array.ravel().tolist()))}")
        elif array.ndim <= 3 and array.size and array.dtype.kind in "fiu":
            parts.append(array.reshape(len(array), -1))
            names += _names_of(name, parts[-1].shape[1], last)
        elif array.ndim == 1 and len(array) == count:  # a cell of text has no separators
            parts.append(numpy.array([[re.sub(r"[^\w.+/-]+|^/+", " ", str(value))] for value in array]))
            names.append(name)
    if not parts or len({len(part) for part in parts}) != 1:
        counts = ", ".join(str(len(part)) for part in parts) or "none"
        raise InputError(
            f"The arrays must have equally many rows, at least 1; got {counts}.", "Give one row for each time."
        )
    rows = [",".join(repr(value) for part in parts for value in part[i].tolist()) for i in range(len(parts[0]))]
    return "\n".join([*comments, ",".join(names), *rows])


def _of_numpy(content: bytes) -> dict[str, Any]:
    import zlib
    from tokenize import TokenError
    from zipfile import BadZipFile

    import numpy

    try:
        loaded = numpy.load(BytesIO(content), allow_pickle=False)
        names = loaded.files if hasattr(loaded, "files") else loaded.dtype.names
        return {"": loaded} if names is None else {name: loaded[name] for name in names}
    except (ValueError, EOFError, BadZipFile, zlib.error, TokenError, RuntimeError, MemoryError) as error:
        reason = str(error).partition(" If you trust")[0].rstrip(".")
        raise InputError(f"A log must be an array: {reason}.", "Save plain numbers, without pickle.") from None


def _of_parquet(content: bytes) -> dict[str, Any]:
    """Columns of a Parquet file, also of lists and of instants, and its metadata."""
    require_extra("parquet")
    import pyarrow
    import pyarrow.parquet

    try:
        # in this thread: one that still holds the file while Python ends aborts the process
        return _columns_of(pyarrow.parquet.ParquetFile(BytesIO(content)).read(use_threads=False))
    except (pyarrow.ArrowException, ValueError) as error:
        reason = str(error).rstrip(".")
        raise InputError(f"A log must be a Parquet table: {reason}.", "Give one number or list per time.") from None


def _columns_of(table: Any) -> dict[str, Any]:
    """The columns of a table of pyarrow, and its metadata."""
    import numpy
    import pyarrow

    columns = {
        key.decode(): numpy.array(value.decode())
        for key, value in (table.schema.metadata or {}).items()
        if key not in (b"pandas", b"ARROW:schema")
    }
    for name in table.column_names:
        kind = table[name].type
        if pyarrow.types.is_timestamp(kind) or pyarrow.types.is_duration(kind):
            columns[f"timestamp [{kind.unit}]"] = numpy.asarray(table[name].cast(pyarrow.int64()))
        else:
            nested = hasattr(kind, "value_type")
            columns[name] = numpy.array(table[name].to_pylist()) if nested else numpy.asarray(table[name])
    return columns


_TIMES = ("t", "time", "times", *_EPOCHS)
_WIDE = {
    "matrix": tuple(f"R{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
    "omega": ("omega1", "omega2", "omega3"),
    "state": ("omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3"),
    "": ("t", "omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3"),
}
_ARRAYS = {
    **dict.fromkeys(("quaternions", "quat", "quats", "q", "orientation", "orientations"), "quaternion"),
    **dict.fromkeys(("matrices", "r", "rotation", "rotations", "dcm"), "matrix"),
    **dict.fromkeys(("w", "omegas", "gyro", "angular_velocity", "angvel"), "omega"),
    "states": "state",
}
"""Names of arrays, in lower case, for those of :data:`_WIDE`."""


def _names_of(name: str, width: int, scalar_last: bool) -> list[str]:
    """The names of the columns of one array."""
    base = _ARRAYS.get(name.lower(), name)
    if width == 4 and name.lower().endswith(("wxyz", "xyzw")):
        return [f"{name[:-4]}{axis}" for axis in name[-4:].lower()]
    if width == 4 and base == "quaternion":
        return [f"q{axis}" for axis in ("xyzw" if scalar_last else "wxyz")]
    if name.lower() in ("qpos", "qvel"):
        return [f"{name}[{i}]" for i in range(width)]
    if len(_WIDE.get(base, ())) == width:
        return list(_WIDE[base])
    if width == 1:
        return [{"times": "t", "time": "t"}.get(name, name)]
    plain = {"positions": "p", "position": "p", "pos": "p", "gammas": "gamma"}.get(name, name)
    if not name:
        raise InputError(f"The array must have 7 columns; got {width}.", "Give t, omega1 to omega3, gamma1 to gamma3.")
    return [f"{plain}{'xyz'[i] if plain == 'p' else i + 1}" for i in range(width)]
