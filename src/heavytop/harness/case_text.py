"""The data of a case, ready to paste: options of the command line, CSV, JSON, TOML of a plan, Python."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from random import Random
from shlex import quote
from typing import Any

from heavytop.cases import Case
from heavytop.errors import refusal
from heavytop.exact.catalogue import matches
from heavytop.measure.motion import motion_texts
from heavytop.measure.rounding_noise import FACTORS, factor, scaled
from heavytop.precision import DOUBLE, dot, exact_text, time_text
from heavytop.top.equations import GYROSTAT, VARIABLES
from heavytop.top.heavy_top import HeavyTop, State, data_texts

_TIMES = ("1", "5", "10")
_PLACES = 18
_DIGITS = 40
"""Digits of a start whose attitude is irrational."""


def case_data(case: Case) -> dict[str, Any]:
    """Exact data as text, by the keys of a trajectory file; a named body in its original axes."""
    head = {"name": case.name, "system": case.system.name}
    if case.body is None or case.given_start is None:
        return head | data_texts(case.top, case.start)
    texts = motion_texts(case.body, case.given_start, _DIGITS)
    return head | {
        key: _in_decimals(value) if isinstance(value, str) else [_in_decimals(item) for item in value]
        for key, value in texts.items()
    }


def _in_decimals(text: str) -> str:
    """The text with each fraction that is a finite decimal written as one, as other programs write their data."""

    def decimal(match: re.Match[str]) -> str:
        denominator = int(match[2])
        places = next((n for n in range(_PLACES) if 10**n % denominator == 0), None)
        return match[0] if places is None else f"{Decimal(int(match[1]) * 10**places // denominator).scaleb(-places):f}"

    return re.sub(r"(?<![\w/.])(-?\d+)/(\d+)(?![\w/.])", decimal, text)


def forms(case: Case) -> dict[str, str]:
    """The data of a case in each form: ``command`` (line), ``csv``, ``json``, ``toml`` and ``python``."""
    data = case_data(case)
    texts = {"csv": _csv(data), "json": _json(data), "toml": _toml(data)}
    if case.body is None:
        return {"command": _command(data)} | texts | {"python": _python(data)}
    command = f"heavytop propagate --case {case.name} --times {','.join(_TIMES)} --show quaternion,position"
    return {"command": command} | texts | {"python": _in_decimals(_python_of_body(case))}


def rerun(
    case: Case, times: Sequence[Fraction], precision: str, integrator: str, tolerance: str = "", reached: bool = True
) -> str:
    """The command that repeats one measurement: digits right, or where it has not ``reached`` the run's outcome."""
    line = f"{forms(case)['command'].rpartition(' --times ')[0]} --times {','.join(map(time_text, times))}"
    line += "" if precision == DOUBLE.name else f" --precision {precision}"
    line += f" --integrator {quote(integrator)}" + (f" --tolerance {tolerance}" if tolerance else "")
    return f"{line} --json | heavytop score -" if reached else line


def _is_default_system(data: dict[str, Any]) -> bool:
    """Whether the system is the default of a top with these data, and is not written."""
    return bool(data["system"] == ("heavy_gyrostat" if "rotor" in data else "heavy_top"))


def _command(data: dict[str, Any]) -> str:
    system = "" if _is_default_system(data) else f" --system {data['system']}"
    keys = ("inertia", "weight", "centre", "rotor", "omega", "gamma")
    options = " ".join(f"--{key} {_joined(data[key])}" for key in keys if key in data)
    return f"heavytop propagate {options}{system} --times {','.join(_TIMES)}"


def _joined(value: str | list[str]) -> str:
    return value if isinstance(value, str) else ",".join(value)


def _csv(data: dict[str, Any]) -> str:
    """The comments above the columns of a table, and the header."""
    return "\n".join([*(f"# {key}: {_joined(value)}" for key, value in data.items()), ",".join(("t", *VARIABLES))])


def _toml(data: dict[str, Any]) -> str:
    # a plan's own top may not have the name of a case
    entries = {key: value for key, value in data.items() if not key.startswith("start_")}
    entries |= {"name": f"my-{data['name']}"}
    kind, _, angles = data.get("start_attitude", "").partition(" ")
    if kind == "axis_angle":
        angles = ":".join(angles.rsplit(",", 1))
    attitude = {key: data.get(f"start_{key}") for key in ("quaternion", "matrix")} if not kind else {kind: angles}
    attitude = {key: value for key, value in attitude.items() if value}
    if attitude:
        entries.pop("gamma")
    entries |= attitude
    return "\n".join(["[[top]]", *(f"{key} = {json.dumps(value)}" for key, value in entries.items())])


def _json(data: dict[str, Any]) -> str:
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in data.items()]
    return "\n".join(["{", ",\n".join(lines), "}"])


def _python(data: dict[str, Any]) -> str:
    def number(value: str) -> str:
        return value if value.lstrip("-").isdigit() else f'"{value}"'

    def numbers(key: str) -> str:
        return f"({', '.join(map(number, data[key]))})"

    weight = number(data["weight"])
    system = "" if _is_default_system(data) else f', system="{data["system"]}"'
    rotor = f", rotor={numbers('rotor')}" if "rotor" in data else ""
    return (
        "import heavytop as ht\n\n"
        f"top = ht.HeavyTop(inertia={numbers('inertia')}, weight={weight}, centre={numbers('centre')}{rotor})\n"
        f"start = ht.State(omega={numbers('omega')}, gamma={numbers('gamma')})\n"
        f"run = ht.propagate(top, start, [{', '.join(_TIMES)}], ht.DOUBLE{system})"
    )


def _python_of_body(case: Case) -> str:
    start = case.given_start or case.start
    spin = ("omega", start.omega) if start.omega_space is None else ("omega_space", start.omega_space)
    parts = [spin, ("gamma", start.gamma)] if start.attitude is None else [spin]
    vectors = [f"{name}=({', '.join(repr(exact_text(value)) for value in vector)})" for name, vector in parts]
    attitude = [] if start.attitude is None else [f"attitude=ht.{start.attitude!r}"]
    return (
        "import heavytop as ht\n\n"
        f"body = ht.{case.body!r}\n"
        f"start = ht.State({', '.join(vectors + attitude)})\n"
        f"run = ht.propagate(body, start, [{', '.join(_TIMES)}], ht.DOUBLE)\n"
        "run.quaternions(), run.positions()"
    )


# The members of an ensemble: random starts of a top, or one motion with perturbed roundings.


_GRID = 1000
_GAMMA_BITS = 24
_SEED_STRIDE = 64
"""Offset between the rounding factors of one seed and of the next."""


Member = tuple[HeavyTop, State]


def ensemble_of(case: Case, count: int, seed: int) -> list[Member]:
    """``count`` tops with starts; growing ``count`` keeps the earlier ones.

    Random starts of the top where their references are of the same class as the case's: the components of Ω are
    uniform up to the largest of the case's Ω, and γ is a rational point of the unit sphere, uniform over it; for the
    gyrostat γ is M/|M|, and |M| is from 1/2 to 3/2 of the case's.
    Else, as for a pendulum, the case itself with ``count`` perturbed roundings
    (:mod:`heavytop.measure.rounding_noise`); raises InputError where there are fewer.
    """
    if one_motion(case, seed):
        if count > FACTORS:
            raise refusal(f"The starts of {case.name}", f"at most {FACTORS}", count, "Give fewer.")
        return [(scaled(case.top, factor(_SEED_STRIDE * seed, index)), case.start) for index in range(count)]
    return [(case.top, _draw(case, seed, index)) for index in range(count)]


def one_motion(case: Case, seed: int) -> bool:
    """Whether the case is a special motion of its top, of a class to which random starts do not belong."""
    return case.homoclinic is not None or _class_of(case, case.start) is not _class_of(case, _draw(case, seed, 0))


def _draw(case: Case, seed: int, index: int) -> State:
    # a text seeds Python's generator by its SHA-512: the same on every platform
    random = Random(f"{case.name} {seed} {index}")
    ball = [Fraction(0)] * 3
    while not _GRID**2 // 4 < dot(ball, ball) <= _GRID**2:
        ball = [Fraction(random.randint(-_GRID, _GRID)) for _ in range(3)]
    gamma = State((0, 0, 0), ball).normalized(_GAMMA_BITS).gamma
    if case.system is GYROSTAT:
        size = dot(case.top.angular_momentum(case.start.omega), case.start.gamma)
        size *= Fraction(random.randint(_GRID // 2, 3 * _GRID // 2), _GRID)
        return State([size * g / i for g, i in zip(gamma, case.top.inertia, strict=True)], gamma)
    size = max(abs(w) for w in case.start.omega)
    return State([size * Fraction(random.randint(-_GRID, _GRID), _GRID) for _ in range(3)], gamma)


def _class_of(case: Case, start: State) -> type | None:
    """The class of the closed form of a start; None without one."""
    solution = next(matches(case.top, start, case.system), None)
    return None if solution is None else type(solution)
