"""A table of certified states that other projects can test with, without installing this one.

``python tools/reference_table.py --out results/reference`` remakes it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import msgspec

from heavytop.exact.cases.algebraic_starts import chaplygin_motion, goryachev_motion, kowalewski_motion
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.catalogue import find
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.solution import ExactSolution
from heavytop.files import replace
from heavytop.measure.certify import Certificate, bits_of, certify, enclosure_of
from heavytop.measure.reference import Ball, known_texts
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, System
from heavytop.top.heavy_top import HeavyTop, State
from rational_motions import bobylev_steklov_motion, grioli_motion, staude_motion

_DIGITS = 100
# what the second source may cost at one time, in seconds of its model
_EFFORT = 2.0
_TIMES = tuple(map(Fraction, ("1", "10", "-1000", "10000", "1000000")))
_TIMES_IN_REACH = tuple(map(Fraction, ("1", "10", "-20")))
# of the chaotic motion: a thousand units of time take some 50 digits, so that far beyond fewer are asked for
_FAR = tuple(map(Fraction, ("100", "1000", "2000", "3000")))
_FARTHER, _FARTHEST = (Fraction(4000), Fraction(5000)), (Fraction(10000),)
_FEWER_DIGITS = 30
_FARTHEST_DIGITS = 70
"""At less the first of its precisions would not be enough."""


class CertifiedState(msgspec.Struct, frozen=True):
    """A certified state at one time; ``state``: Ω1 Ω2 Ω3 γ1 γ2 γ3."""

    time: str
    state: list[Ball]
    certificate: Certificate


class CertifiedMotion(msgspec.Struct, frozen=True):
    """A top, a start at t = 0 and certified states; exact numbers are integers or fractions, as text.

    rotor: λ of the gyrostat, k1,k2,k3 of the heavy gyrostat, 0 for the heavy top.
    """

    case: str
    system: str
    inertia: list[str]
    weight: str
    centre: list[str]
    rotor: str
    omega: list[str]
    gamma: list[str]
    method: str
    digits: int
    states: list[CertifiedState]


@dataclass(frozen=True, slots=True)
class TableCase:
    """A named motion of the table.  beyond: times besides those that all have.  digits: at most."""

    name: str
    top: HeavyTop
    start: State
    system: System = HEAVY_TOP
    beyond: tuple[Fraction, ...] = ()
    digits: int = _DIGITS


def _of(name: str, known: ExactSolution) -> TableCase:
    return TableCase(name, known.top, known.start, known.system)


def cases() -> Iterator[TableCase]:
    """The motions of the table: each class of the catalogue, and five that have no closed form in it."""
    f, tilted, upright = Fraction, ("3/5", 0, "4/5"), (0, 0, 1)
    free = (0, 0, 0)
    yield TableCase("euler", HeavyTop((1, 2, 3), 1, free), State(("1/10", 1, "1/5"), tilted))
    yield TableCase("euler, about the largest moment", HeavyTop((3, 2, 1), 1, free), State((1, "1/10", "1/5"), tilted))
    yield TableCase("euler, separatrix", HeavyTop((4, 5, 9), 0, free), State(("3/2", "1/2", "1/2"), tilted))
    yield TableCase("euler, symmetric", HeavyTop((2, 2, 1), 0, free), State((1, "1/2", "1/3"), tilted))
    yield TableCase("lagrange", HeavyTop(("3/2", "3/2", 1), 2, (0, 0, "3/4")), State(("1/5", "-1/3", 2), tilted))
    yield TableCase("lagrange, sleeping", HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((0, 0, 3), upright))
    yield TableCase(
        "lagrange, looping", HeavyTop((1, 1, 2), 1, (0, 0, "1/2")), State(("1/3", 2, "1/2"), ("4/5", 0, "-3/5"))
    )
    yield TableCase(
        "spherical pendulum", HeavyTop((1, 1, 1), 1, (0, 0, 1)), State(("1/2", "1/3", 0), ("4/5", 0, "-3/5"))
    )
    yield TableCase("pendulum, libration", HeavyTop((3, 2, 1), 1, (0, 1, 0)), State(("1/2", 0, 0), (0, "-4/5", "3/5")))
    yield TableCase("pendulum, rotation", HeavyTop((3, 2, 1), 1, (0, 1, "1/2")), State((2, 0, 0), (0, "3/5", "4/5")))
    yield TableCase("pendulum, separatrix", HeavyTop((1, 2, 3), 1, (0, 0, 1)), State((2, 0, 0), (0, 0, -1)))
    # Ω = I⁻¹ γ, so that M = γ
    turning = State(("1/6", "-1/6", "2/3"), ("2/3", "-1/3", "2/3"))
    yield TableCase("gyrostat", HeavyTop((4, 2, 1), 1, (0, 1, 0)), turning, GYROSTAT)
    turning = State(("2/3", "2/3", "2/9"), ("2/3", "1/3", "2/3"))
    yield TableCase("gyrostat, b < 0", HeavyTop((1, "1/2", 3), 1, (0, -2, 0)), turning, GYROSTAT)
    yield _of("gyrostat, homoclinic (4.2)-(4.6)", ErshkovPartial(f(1), f(6), f(1)))
    yield _of("staude", staude_motion((f(3), f(2), f(1)), (f(2, 3), f(-1, 3), f(2, 3)), f(3, 2), f(1, 2)))
    yield _of("grioli", grioli_motion(f(1, 3), f(1, 4), f(2, 7), f(3, 2)))
    yield _of("bobylev-steklov", bobylev_steklov_motion((f(5, 2), f(1)), f(1), f(1, 2), f(1, 3), f(2)))
    yield TableCase(
        "delone", HeavyTop((2, 2, 1), 1, (1, 0, 0)), State(("4/5", "2/5", "1/3"), ("12/25", "16/25", "3/5"))
    )
    yield _of("delone, homoclinic", DeloneHomoclinic(f(1), f(1)))
    generic = HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
    chaotic = State(("1/10", "2/5", "9/10"), tilted)
    yield TableCase("generic asymmetric", generic, chaotic, beyond=_FAR)
    yield TableCase("generic asymmetric, far", generic, chaotic, beyond=_FARTHER, digits=_FEWER_DIGITS)
    yield TableCase("generic asymmetric, farthest", generic, chaotic, beyond=_FARTHEST, digits=_FARTHEST_DIGITS)
    yield TableCase("kovalevskaya", HeavyTop((2, 2, 1), 1, (0, 1, 0)), State(("1/10", "1/5", "9/10"), tilted))
    kovalevskaya = HeavyTop((2, 2, 1), 1, (1, 0, 0))
    yield TableCase("kovalevskaya, asymptotic", kovalevskaya, State((-1, "1/4", "1/4"), upright))
    yield TableCase("kovalevskaya, one variable at rest", kovalevskaya, State(("-1/2", 0, "-4/3"), tilted))
    goryachev = HeavyTop((4, 4, 1), 1, (1, 0, 0))
    yield TableCase("goryachev-chaplygin", goryachev, State(("1/2", "1/4", "-3/4"), (0, "3/5", "4/5")))
    hess = HeavyTop((8, 6, 3), 1, (1, 0, 2))
    yield TableCase("hess", hess, State(("3/4", "1/2", -1), (0, 1, 0)))
    yield TableCase("hess, M·gamma = 0", hess, State(("3/4", 0, -1), (0, 1, 0)))
    yield TableCase("steklov", HeavyTop((1, "7/16", "3/4"), 1, ("45/32", 0, 0)), State((0, 4, 2), (-1, 0, 0)))
    top = HeavyTop(("3/10", "4/5", "1/2"), 1, ("25/18", "-25/24", 0))
    yield TableCase("dokshevich", top, State(("8/7", "-17/14", "6/7"), ("23/49", "24/49", "36/49")))
    # rational data beside motions whose starts are algebraic, rounded to 53 bits
    for name, beside in (
        ("goryachev", goryachev_motion(f(39, 64), f(-1), f(1, 4))),
        ("kowalewski", kowalewski_motion(f(5, 8), f(1))),
        ("chaplygin", chaplygin_motion(f(49, 32), f(1), f(1, 2))),
    ):
        yield TableCase(f"beside {name}", *beside.rounded(53))
    yield TableCase("paper data, I1/I3 = 6", HeavyTop((6, 6, 1), 1, (0, 15, 0)), State((0, 0, 6), upright))


def motion(case: TableCase, digits: int) -> CertifiedMotion:
    """The entries of one case: times up to 10^6 where there is a closed form, where there is none up to 20 and those
    ``beyond``.
    """
    solution, digits = find(case.top, case.start, case.system), min(digits, case.digits)
    times = _TIMES_IN_REACH if isinstance(solution, Validated) else _TIMES
    enclosure = enclosure_of(solution, effort=_EFFORT)
    entries = [
        CertifiedState(
            str(time),
            known_texts(solution.state(time, bits_of(digits)), solution.method, time, digits),
            certify(solution, time, digits, enclosure=enclosure),
        )
        for time in (*times, *case.beyond)
    ]
    p = case.system.parameters(case.top, case.start)
    return CertifiedMotion(
        case.name,
        case.system.name,
        [str(i) for i in case.top.inertia],
        str(case.top.weight),
        [str(r) for r in case.top.centre],
        ",".join(map(str, p.rotors)),
        [str(w) for w in case.start.omega],
        [str(g) for g in case.start.gamma],
        solution.method,
        digits,
        entries,
    )


def write(out: Path, digits: int = _DIGITS) -> Path:
    """Writes the table to ``out``/states.json, which is returned; the folder is made where it is missing."""
    out.mkdir(parents=True, exist_ok=True)
    target = out / "states.json"
    document = msgspec.json.encode([motion(case, digits) for case in cases()])
    replace(target, msgspec.json.format(document, indent=1) + b"\n")
    return target


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Remake the table of certified states.")
    parser.add_argument("--out", type=Path, default=Path("results/reference"))
    parser.add_argument("--digits", type=int, default=_DIGITS)
    chosen = parser.parse_args()
    write(chosen.out, chosen.digits)
