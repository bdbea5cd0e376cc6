"""The reference pack: certified trajectories that other projects can vendor without this program.

``python tools/reference_pack.py --out results/reference`` makes it again: ``pack.json``, its schema,
and a CSV for each motion.
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import msgspec

from heavytop.cases import CASES, Case, named_bodies
from heavytop.files import replace
from heavytop.measure.motion import motion_texts
from heavytop.measure.reference import Ball, Reference, reference
from heavytop.precision import exact, exact_text
from heavytop.top.attitude import Attitude
from heavytop.top.bodies import PIVOT, Body
from heavytop.top.heavy_top import State
from reference_table import cases as table_cases

VERSION = "1.1.0"
"""Of the format and the numbers: a changed number raises the second place, a changed key the first."""
DIGITS = 40
TIMES = 50
_CLASSICAL = {
    "euler": "100",
    "lagrange": "100",
    "lagrange, looping": "100",
    "spherical pendulum": "100",
    "pendulum, libration": "100",
    "gyrostat": "20",
    "staude": "100",
    "grioli": "100",
    "bobylev-steklov": "100",
    "generic asymmetric": "20",
    "kovalevskaya": "100",
    "goryachev-chaplygin": "20",
    "hess": "20",
    "steklov": "100",
    "dokshevich": "100",
}
"""Motions of the table of certified states, by the time up to which they are here."""
_QUANTITIES = (("omega", 3), ("gamma", 3), ("quaternion", 4), ("position", 3))
_CONVENTIONS = {
    "axes": "body axes as the data are given; space axes e_x, e_y, e_z, e_z vertically up",
    "omega": "angular velocity in body axes",
    "gamma": "e_z in body axes",
    "quaternion": "(w, x, y, z), length 1, body to space: v_space = q v_body conj(q); continuous, w >= 0 at t = 0",
    "position": "of the centre of mass in space axes, the fixed point at the origin",
    "equations": "J Omega' = (J Omega + rotor) x Omega + gamma x (weight centre), gamma' = gamma x Omega; "
    "gyrostat: M' = M x w, gamma' = gamma x w, w = Omega + lambda e2, lambda = weight b/(M.gamma)",
    "numbers": "the true number is within radius of value; exact data are integers, decimals or fractions, as text",
}


def motions() -> Iterator[tuple[Case, Fraction]]:
    """The motions of the pack, each with its last time."""
    yield from ((case, Fraction(case.horizon)) for case in named_bodies().values() if case.horizon)
    tensor = [["0.5", "0.1", "-0.05"], ["0.1", "0.7", "0.02"], ["-0.05", "0.02", "0.9"]]
    body = Body(2, "9.81", ("0.1", "-0.2", "0.3"), tensor, PIVOT)
    start = State((1, 2, -3), attitude=Attitude.euler("ZYX", "30deg", "0.2", "1"))
    about = "a body by its full tensor, its principal axes irrational, from Euler angles"
    yield (
        Case("full-tensor", about, CASES["generic"].system, body.top, start, body=body, given_start=start),
        Fraction(5),
    )
    gyrostat = CASES["heavy-gyrostat"]
    yield gyrostat, Fraction(20)
    for found in table_cases():
        if found.name in _CLASSICAL:
            name = found.name.replace(", ", "-").replace(" ", "-")
            yield Case(name, found.name, found.system, found.top, found.start), Fraction(_CLASSICAL[found.name])


def entry(case: Case, last: Fraction, times: int = TIMES, digits: int = DIGITS) -> tuple[dict[str, Any], Reference]:
    """One motion of the pack, and the reference it is made of."""
    body, start = case.body or case.top, case.given_start or case.start
    instants = [exact_text(last * place / times) for place in range(1, times + 1)]
    known = reference(body, start, instants, digits, case.system, attitude=True)
    found: dict[str, Any] = {
        "name": case.name,
        "about": case.about,
        "source": case.source or "a classical motion, data of this pack",
        "units": case.units or "none",
        "system": case.system.name,
        "data": motion_texts(body, start, digits) | {"xi": known.xi},
        "digits": digits,
        "method": known.method,
        "attitude_method": known.attitude_method,
        "times": instants,
        "omega": [state[:3] for state in known.states],
        "gamma": [state[3:] for state in known.states],
        "quaternion": known.balls("quaternion"),
        "position": known.balls("position"),
    }
    return found, known


def table(motion: dict[str, Any]) -> str:
    """The CSV of a motion: the double nearest to each number, as decimal and as hexadecimal text of C99."""
    names = [
        f"{'q' if name == 'quaternion' else name}{mark}"
        for name, size in _QUANTITIES
        for mark in ("wxyz" if size == 4 else "xyz" if name == "position" else "123")
    ]
    names = [name.removeprefix("position") for name in names]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["t", "t_hex", *(part for name in names for part in (name, f"{name}_hex"))])
    for place, time in enumerate(motion["times"]):
        balls: list[Ball] = [ball for name, _ in _QUANTITIES for ball in motion[name][place]]
        values = [float(exact(time)), *(float(exact(ball.value)) for ball in balls)]
        writer.writerow([part for value in values for part in (repr(value), value.hex())])
    return text.getvalue()


def write(out: Path, times: int = TIMES, digits: int = DIGITS) -> list[Path]:
    """Writes the pack to a folder, which is made where it is missing; returns its files."""
    (out / "csv").mkdir(parents=True, exist_ok=True)
    found, files = [], [out / "pack.json", out / "pack.schema.json"]
    for case, last in motions():
        motion, _ = entry(case, last, times, digits)
        found.append(motion)
        files.append(out / "csv" / f"{motion['name']}.csv")
        replace(files[-1], table(motion).encode())
    document = {"pack": "heavytop reference pack", "version": VERSION, "conventions": _CONVENTIONS, "motions": found}
    replace(files[0], msgspec.json.encode(document).replace(b'{"name":', b'\n{"name":') + b"\n")
    replace(files[1], msgspec.json.format(msgspec.json.encode(schema()), indent=1) + b"\n")
    return files


def schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of pack.json."""
    number = {"type": "string", "pattern": r"^-?[0-9.]+([eE][+-]?[0-9]+)?$"}
    ball = {"type": "object", "required": ["value", "radius"], "properties": {"value": number, "radius": number}}
    text, texts = {"type": "string"}, {"type": "array", "items": {"type": "string"}}

    def rows(size: int) -> dict[str, Any]:
        return {"type": "array", "items": {"type": "array", "items": ball, "minItems": size, "maxItems": size}}

    data: dict[str, Any] = dict.fromkeys(("inertia", "centre", "rotor", "omega", "gamma", "xi"), texts)
    data |= {f"start_{key}": texts for key in ("quaternion", "matrix")}
    data |= dict.fromkeys(("weight", "mass", "gravity", "about", "start_attitude"), text)
    properties: dict[str, Any] = {
        **dict.fromkeys(("name", "about", "source", "units", "system", "method", "attitude_method"), text),
        "data": {
            "type": "object",
            "required": ["inertia", "centre", "omega", "gamma", "xi"],
            "properties": data,
            "additionalProperties": False,
        },
        "digits": {"type": "integer"},
        "times": texts,
        **{name: rows(size) for name, size in _QUANTITIES},
    }
    motion = {
        "type": "object",
        "required": list(properties),
        "properties": properties,
        "additionalProperties": False,
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "heavytop reference pack",
        "type": "object",
        "required": ["pack", "version", "conventions", "motions"],
        "properties": {
            "pack": {"const": "heavytop reference pack"},
            "version": {"type": "string", "pattern": r"^1\."},
            "conventions": {"type": "object"},
            "motions": {"type": "array", "items": motion, "minItems": 20},
        },
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Make the reference pack again.")
    parser.add_argument("--out", type=Path, default=Path("results/reference"))
    write(parser.parse_args().out)
