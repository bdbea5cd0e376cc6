"""Proven derivatives on random data of every class: contained differences, laws of the flow, radii and cost.

    python validation/derivatives.py [--count 100] [--case NAME] [--records FILE [--seconds 240]]
    python validation/derivatives.py --cost [DIGITS,TIME ...]

For each built-in case and named body, COUNT random starts of its top, each at a random time (of a special motion COUNT
times, in other units of mass and time and with other names of its axes):
one random column of ∂y/∂y0 and one of ∂y/∂(I, n) against a central difference of references, every law of the flow, and
the seconds of this process against those of the enclosure without derivatives.  A line a case.  With --records a line
of JSON a motion goes to FILE, those that stand there are not measured again, and no motion begins after --seconds.
With --cost: seconds of references of a generic top without derivatives, with respect to the start, and to start and
data.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

from flint import arb, arb_mat, arb_series

import heavytop as ht
from heavytop.cases import CASES, Case, named_bodies
from heavytop.errors import HeavyTopError
from heavytop.exact.enclosure.derivatives import derivatives, moved
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, midpoint, radius, working_precision
from heavytop.harness.case_text import ensemble_of, one_motion
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, holding
from heavytop.top.heavy_top import HeavyTop, State

BITS = 100
NARROW = Fraction(1, 10**20)
SIX = range(6)


def known(top, start, system=HEAVY_TOP):
    """The enclosure of a motion; λ of the gyrostat is held."""
    rotor = system.parameters(top, start).rotor if system is GYROSTAT else None
    return Validated(top, start, system, rotor=rotor)


def of(motion, time, bits=BITS, data=False):
    """The derivatives at one time."""
    return derivatives(motion, [Fraction(time)], bits, data)[0]


def as_balls(p):
    """Parameters as balls."""
    return p.mapped(lambda value: ball(Fraction(value)))


def laws(motion, time, found, bits=BITS):
    """By name, balls that contain 0 where J is right: determinant, the flow's own direction, first integrals, scale."""
    time = Fraction(time)
    state = motion.state(time, bits + 64)
    with working_precision(bits + 160):
        j, p = arb_mat(found.start), as_balls(motion.parameters)
        begun = [ball(value) for value in motion.start.flat]
        rate, later = motion.system.field(p, begun), motion.system.field(p, state)
        given = {"determinant": [j.det() - 1]}
        given["flow"] = _off(j, rate, later)
        for integral in _integrals(motion):
            gradient = arb_mat([_gradient(integral, p, state)]) * j
            at_start = _gradient(integral, p, begun)
            given[f"gradient of {integral.name}"] = [gradient[0, k] - at_start[k] for k in SIX]
        if motion.system is HEAVY_TOP:
            weights = (1, 1, 1, 2, 2, 2)
            scaled = [w * y + ball(time) * f for w, y, f in zip(weights, state, later, strict=True)]
            given["scale"] = _off(j, [w * y for w, y in zip(weights, begun, strict=True)], scaled)
        if found.data is not None and motion.system is not GYROSTAT:
            given |= _data_laws(motion, found, p, begun, state)
        return given


def _data_laws(motion, found, p, begun, state):
    """∂/∂θ F(y(t), θ) = ∂/∂θ F(y0, θ) for the energy and the area integral, θ the six data."""
    s = arb_mat(found.data)
    given = {}
    for integral in _integrals(motion):
        gradient = arb_mat([_gradient(integral, p, state)]) * s
        own, first = ([_datum(integral, p, y, k) for k in SIX] for y in (state, begun))
        given[f"data of {integral.name}"] = [gradient[0, k] + own[k] - first[k] for k in SIX]
    return given


def _integrals(motion):
    """Those that hold for every top, with every datum."""
    general = HeavyTop((5, 7, 9), 1, (1, 2, 3), rotor=motion.top.rotor) if motion.system is not GYROSTAT else motion.top
    return holding(general, motion.start, motion.system)


def _gradient(integral, p, y):
    return [_slope(integral.value(p, [arb_series([v, int(i == k)], 2) for i, v in enumerate(y)])) for k in SIX]


def _datum(integral, p, y, k):
    return _slope(integral.value(moved(p, k, arb_series([0, 1], 2)), y))


def _slope(value):
    return arb_series(value, 2)[1]


def _off(matrix, vector, wanted):
    product = matrix * arb_mat([[v] for v in vector])
    return [product[k, 0] - wanted[k] for k in SIX]


def chain(motion, between, until, bits=BITS):
    """J(0 → until) − J(between → until) J(0 → between); the later motion begins at a rational state nearby.

    J of the later motion is taken at that state, and moves by at most its difference from the true one times a bound
    of the second derivative: 1e-40 against 1e-20.
    """
    first, whole = of(motion, between, bits).start, of(motion, until, bits).start
    state = [midpoint(value) for value in motion.state(Fraction(between), 256)]
    later = Validated(
        motion.top, State(state[:3], state[3:]), motion.system, rotor=getattr(motion.parameters, "rotor", None)
    )
    second = of(later, Fraction(until) - Fraction(between), bits).start
    with working_precision(bits + 160):
        product = arb_mat(second) * arb_mat(first)
        return [product[i, k] - whole[i][k] for i in SIX for k in SIX]


def difference(motion, time, column, bits=140, step_bits=100, datum=False):
    """Column of J or S from references alone: a central quotient, widened by twice what half the step changes.

    Its remainder is h² y'''/6 and more; with twice the step it is four times that.
    """
    quotients = [
        _quotient(motion, Fraction(time), column, Fraction(1, 2 ** (step_bits - k)), bits + step_bits, datum)
        for k in (0, 1)
    ]
    with working_precision(bits + 2 * step_bits):
        return [a + arb(0, 2 * abs(a - b).upper()) for a, b in zip(*quotients, strict=True)]


def _quotient(motion, time, column, step, bits, datum):
    ends = [_varied(motion, column, sign * step, datum).state(time, bits) for sign in (1, -1)]
    with working_precision(bits + 64):
        return [(a - b) / (2 * ball(step)) for a, b in zip(*ends, strict=True)]


def _varied(motion, column, by, datum):
    """The motion from data beside: one component of the start, or one moment, or one component of n = P r."""
    top, start, rotor = motion.top, list(motion.start.flat), motion.parameters.rotor
    if not datum:
        start[column] += by
    else:
        p = moved(motion.parameters, column, by)
        kept = {} if motion.system is GYROSTAT else {"rotor": top.rotor}
        top = HeavyTop(p.inertia, 1, p.moment, **kept)
    held = rotor if motion.system is GYROSTAT else None
    return Validated(top, State(start[:3], start[3:]), motion.system, rotor=held)


def holds(values, narrow=NARROW):
    """Whether each ball contains 0 and is narrow."""
    return all(value.contains(0) and radius(value) < narrow for value in values)


def largest_radius(values):
    """Of a matrix or a list of balls."""
    flat = [v for row in values for v in (row if isinstance(row, list) else [row])]
    return max(radius(v) for v in flat)


def main() -> int:
    """A line a case; 1 where a difference or a law is not held."""
    options = argparse.ArgumentParser()
    options.add_argument("--count", type=int, default=100)
    options.add_argument("--case")
    options.add_argument("--records", type=Path)
    options.add_argument("--seconds", type=float, default=float("inf"))
    options.add_argument("--cost", nargs="*")
    given = options.parse_args()
    if given.cost is not None:
        _cost([(int(digits), int(until)) for digits, until in (each.split(",") for each in given.cost)] or _COSTS)
        return 0
    lines = given.records.read_text().splitlines() if given.records and given.records.exists() else []
    known = {(record["case"], record["motion"]): record for record in map(json.loads, lines)}
    end = time.monotonic() + given.seconds
    cases = [case for name, case in (CASES | named_bodies()).items() if given.case in (None, name)]
    wrong = [_case(case, given.count, known, given.records, end) for case in cases]
    return int(any(wrong))


_COSTS = [(20, 8), (30, 8), (40, 8), (60, 8), (25, 30), (30, 100)]


def _cost(motions: list[tuple[int, int]]) -> None:
    top = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
    start = ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
    for digits, until in motions:
        found: dict[str | None, list[float]] = {None: [], "start": [], "all": []}
        for _ in range(4):
            for which, seconds in found.items():
                began = time.process_time()
                ht.reference(top, start, [until], digits, attitude=False, derivatives=which)
                seconds.append(time.process_time() - began)
        plain, *others = (min(seconds) for seconds in found.values())
        ratios = "".join(f"{seconds:9.3f} ({seconds / plain:4.1f})" for seconds in others)
        print(f"{digits:4} digits at t = {until:<5}{plain:9.4f}{ratios}", flush=True)


def _case(
    case: Case, count: int, known: dict[tuple[str, int], dict[str, Any]], records: Path | None, end: float
) -> bool:
    """Measure what is not known yet, and print a line; whether anything is wrong."""
    members, special = ensemble_of(case, count, 28), one_motion(case, 0)
    for number, (top, start) in enumerate(members):
        if (case.name, number) in known or time.monotonic() > end:
            continue
        random = Random(f"{case.name} {number}")
        rate = Fraction(random.randint(1, 99), random.randint(1, 99)) if special else Fraction(1)
        # a gyrostat of (2.1) has its centre of mass on axis 2
        top, start = _in_other_units(top, start, rate, number % 3 if special and case.system is not GYROSTAT else 0)
        record = {"case": case.name, "motion": number, **_motion(top, start, case, rate, random)}
        known[case.name, number] = record
        if records:
            with records.open("a") as file:
                file.write(json.dumps(record) + "\n")
    found = [record for (name, number), record in known.items() if name == case.name and number < len(members)]
    if not found:
        return False
    wrong, refused = (sum(record[key] for record in found) for key in ("wrong", "refused"))
    plain, derived = (sum(record[key] for record in found) for key in ("plain", "derived"))
    widest = max(record["radius"] for record in found)
    print(
        f"{case.name:28} {len(found):4} of {len(members)} motions  {wrong} wrong  {refused} refused  "
        f"widest radius {widest:.1e}  {derived / max(plain, 1e-9):5.1f} times the enclosure",
        flush=True,
    )
    return bool(wrong)


def _in_other_units(top: ht.HeavyTop, start: ht.State, rate: Fraction, turn: int) -> tuple[ht.HeavyTop, ht.State]:
    """The motion ``rate`` times as fast, with axis 1 + turn called 1, and so on."""

    def renamed(values: Sequence[Fraction], factor: Fraction = Fraction(1)) -> list[Fraction]:
        return [factor * value for value in (*values[turn:], *values[:turn])]

    rotor = None if top.rotor is None else renamed(top.rotor, rate)
    faster = ht.HeavyTop(renamed(top.inertia), rate**2 * top.weight, renamed(top.centre), rotor)
    return faster, ht.State(renamed(start.omega, rate), renamed(start.gamma))


def _motion(top: ht.HeavyTop, start: ht.State, case: Case, rate: Fraction, random: Random) -> dict[str, Any]:
    """Whether a difference or a law fails, or the derivatives are refused; the widest radius; seconds."""
    # up to 4, or a fifth of what a named body is used for
    latest = min(Fraction(4), Fraction(case.horizon or 20, 5))
    at = Fraction(random.choice((-1, 1)) * random.randint(1, 400), 400) * latest / rate
    try:
        began = time.process_time()
        known(top, start, case.system).state(at, BITS)
        plain = time.process_time() - began
        motion = known(top, start, case.system)
        began = time.process_time()
        of(motion, at)
        derived = time.process_time() - began
        found = of(motion, at, data=True)
    except HeavyTopError:
        return {"wrong": False, "refused": True, "radius": 0.0, "plain": 0.0, "derived": 0.0}
    size = max(1, *(abs(v).upper().__float__() for row in found.start + found.data for v in row))
    held = [holds(values, Fraction(size) ** 6 / 10**20) for values in laws(motion, at, found).values()]
    for matrix, datum in ((found.start, False), (found.data, True)):
        column = random.randrange(6)
        values = difference(motion, at, column, datum=datum)
        with working_precision(400):
            pairs = zip(matrix, values, strict=True)
            held.append(holds([row[column] - value for row, value in pairs], Fraction(size) / 10**20))
    widest = max(largest_radius(found.start), largest_radius(found.data))
    seconds = {"plain": plain, "derived": derived}
    return {"wrong": not all(held), "refused": False, "radius": float(widest), **seconds}


if __name__ == "__main__":
    raise SystemExit(main())
