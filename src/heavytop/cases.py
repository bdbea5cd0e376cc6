"""The built-in cases: a top, a start, and what is known or claimed about the motion."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from importlib import resources
from typing import Any

from heavytop.errors import InputError, meant
from heavytop.exact.cases.algebraic_starts import AlgebraicMotion, chaplygin_motion, goryachev_motion, kowalewski_motion
from heavytop.exact.cases.delone import DeloneHomoclinic
from heavytop.exact.cases.ershkov_partial import ErshkovPartial
from heavytop.exact.cases.kovalevskaya import Kovalevskaya
from heavytop.exact.resolved import resolve
from heavytop.top.bodies import PIVOT, Body, motion_of
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, System, system_of
from heavytop.top.heavy_top import HeavyTop, State, require_physical


@dataclass(frozen=True, slots=True)
class Case:
    """A top with a start.

    homoclinic: the closed form if the motion tends to a saddle, a permanent rotation or a periodic motion; its data are
    dyadic, and so exact in every format.
    body, given_start: the original body and start, in other axes or with an attitude; ``top`` and ``start`` are in
    principal axes, to 256 bits if these are irrational.
    source, units, horizon: of a named body, the source and units of its data, and the usual time span.
    """

    name: str
    about: str
    system: System
    top: HeavyTop
    start: State
    homoclinic: ErshkovPartial | DeloneHomoclinic | Kovalevskaya | None = None
    body: Body | None = None
    given_start: State | None = None
    source: str = ""
    units: str = ""
    horizon: int = 0

    @property
    def alpha(self) -> Fraction:
        """The unit of errors of Ω: the angular velocity α of the permanent rotation that a homoclinic case tends to.

        If it tends to a periodic motion, the largest component of Ω at the start.
        """
        if self.homoclinic is None:
            raise InputError(f"The case {self.name} is not homoclinic.", "Use a case such as ershkov-partial-2.")
        if isinstance(self.homoclinic, Kovalevskaya):
            return max(map(abs, self.start.omega))
        return self.homoclinic.alpha

    @property
    def rate(self) -> float:
        """The rate at which a homoclinic case approaches its saddle, and errors grow near it."""
        if isinstance(self.homoclinic, ErshkovPartial):
            return float(self.homoclinic.rate) / 2
        if isinstance(self.homoclinic, Kovalevskaya):
            return float(self.homoclinic.exponent(64))
        return float(self.alpha) / 2**0.5


def _partial(ratio: int) -> Case:
    known = ErshkovPartial(Fraction(1), Fraction(ratio), Fraction(1))
    about = f"Ershkov's partial case (4.1)-(4.6), alpha = 1, I1/I3 = {ratio}"
    return Case(f"ershkov-partial-{ratio}", about, GYROSTAT, known.top, known.start, known)


def _delone() -> Case:
    known = DeloneHomoclinic(Fraction(5, 4), Fraction(3))
    return Case(
        "delone",
        "homoclinic Delone motion of the Kovalevskaya top, alpha = 5/4",
        HEAVY_TOP,
        known.top,
        known.start,
        homoclinic=known,
    )


def _asymptotic() -> Case:
    known = Kovalevskaya(HeavyTop((2, 2, 1), 1, (1, 0, 0)), State((-1, "1/4", "1/4"), (0, 0, 1)))
    return Case(
        "kovalevskaya-asymptotic",
        "Kovalevskaya's top on a degenerate level: it tends to a periodic motion, a saddle",
        HEAVY_TOP,
        known.top,
        known.start,
        homoclinic=known,
    )


def _near(name: str, who: str, known: AlgebraicMotion) -> Case:
    """Rational data within 2^-253 of a motion with an algebraic start; their reference is the enclosure."""
    return Case(name, f"rational data near {who}'s motion", HEAVY_TOP, *known.rounded())


CASES: dict[str, Case] = {
    case.name: case
    for case in (
        _partial(2),
        _partial(6),
        _delone(),
        Case(
            "euler",
            "torque-free asymmetric top",
            HEAVY_TOP,
            HeavyTop((2, 3, "9/2"), "3/2", (0, 0, 0)),
            State(("2/5", "7/10", "-3/10"), ("2/7", "3/7", "6/7")),
        ),
        Case(
            "lagrange",
            "symmetric top, centre of mass on its axis",
            HEAVY_TOP,
            HeavyTop(("5/2", "5/2", "3/2"), 2, (0, 0, "3/4")),
            State(("1/5", "-1/3", "7/4"), ("2/7", "3/7", "6/7")),
        ),
        Case(
            "kovalevskaya",
            "I1 = I2 = 2 I3, centre of mass in the equatorial plane",
            HEAVY_TOP,
            HeavyTop((3, 3, "3/2"), 2, ("1/3", "3/4", 0)),
            State(("1/10", "1/5", "9/10"), ("3/5", 0, "4/5")),
        ),
        _asymptotic(),
        Case(
            "generic",
            "asymmetric top without a further integral",
            HEAVY_TOP,
            HeavyTop((3, "5/2", "3/2"), "3/2", ("1/2", "1/3", "1/5")),
            State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5")),
        ),
        Case(
            "pendulum",
            "physical pendulum about axis 1, turning over",
            HEAVY_TOP,
            HeavyTop((3, "5/2", "3/2"), "3/2", (0, "1/2", "1/5")),
            State(("9/7", 0, 0), (0, "3/5", "4/5")),
        ),
        Case(
            "goryachev-chaplygin",
            "I1 = I2 = 4 I3, centre of mass in the equatorial plane, M·gamma = 0",
            HEAVY_TOP,
            HeavyTop((4, 4, 1), 1, (1, 0, 0)),
            State(("3/4", "1/2", 0), (0, 0, 1)),
        ),
        Case(
            "hess",
            "Hess' top, M·gamma = 3: a hyperbolic linear system with elliptic coefficients",
            HEAVY_TOP,
            HeavyTop((8, 6, 3), 1, (1, 0, 2)),
            State(("3/4", "1/2", -1), (0, 1, 0)),
        ),
        Case(
            "hess-pendulum",
            "Hess' top, M·gamma = 0: a pendulum that tends to a rotation about axis 2",
            HEAVY_TOP,
            HeavyTop((8, 6, 3), 1, (1, 0, 2)),
            State(("3/4", 0, -1), (0, 1, 0)),
        ),
        Case(
            "steklov",
            "Steklov's motion, periodic: Omega2^2 and Omega3^2 quadratic in Omega1",
            HEAVY_TOP,
            HeavyTop((1, "7/16", "3/4"), 1, ("45/32", 0, 0)),
            State((0, 4, 2), (-1, 0, 0)),
        ),
        Case(
            "dokshevich",
            "Dokshevich's motion of a Hess top, periodic: M·gamma = 0, M·r not 0",
            HEAVY_TOP,
            HeavyTop(("3/10", "4/5", "1/2"), 1, ("25/18", "-25/24", 0)),
            State(("8/7", "-17/14", "6/7"), ("23/49", "24/49", "36/49")),
        ),
        _near("goryachev", "Goryachev", goryachev_motion(Fraction(39, 64), Fraction(-1), Fraction(1, 4))),
        _near("kowalewski", "N. Kowalewski", kowalewski_motion(Fraction(5, 8), Fraction(1))),
        _near("chaplygin", "Chaplygin", chaplygin_motion(Fraction(49, 32), Fraction(1), Fraction(1, 2))),
        Case(
            "gyrostat",
            "asymmetric gyrostat of (2.1)-(2.4), gamma = M/|M|",
            GYROSTAT,
            HeavyTop((2, 3, "5/2"), "3/2", (0, "2/3", 0)),
            State(("3/10", "4/15", "24/25"), ("3/13", "4/13", "12/13")),
        ),
        Case(
            "wheel",
            "a spacecraft with a reaction wheel: no weight, any axis of the rotor",
            HEAVY_GYROSTAT,
            HeavyTop((350, 300, 400), 0, (0, 0, 0), (30, "-20", 60)),
            State(("1/5", "-1/10", "3/20"), ("3/5", 0, "4/5")),
        ),
        Case(
            "heavy-gyrostat",
            "the generic top with a rotor: no closed form",
            HEAVY_GYROSTAT,
            HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"), ("1/2", "-1/3", "3/4")),
            State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5")),
        ),
    )
}


_FREE = {"mass": 1, "gravity": 0, "centre": (0, 0, 0), "about": PIVOT}
_UPRIGHT = {"quaternion": (1, 0, 0, 0)}
"""Default data of a named body, and the default attitude of its start."""


_BODY = ("mass", "gravity", "centre", "inertia", "about", "rotor")


@cache
def _tables() -> dict[str, dict[str, Any]]:
    return tomllib.loads(resources.files("heavytop").joinpath("bodies.toml").read_text("utf-8"))


def described_bodies() -> dict[str, tuple[str, Body]]:
    """Description and body by name; without starts, which take longer."""
    tables: dict[str, dict[str, Any]] = {name: _FREE | table for name, table in _tables().items()}
    return {
        name: (table["summary"], Body(**{key: table[key] for key in _BODY if key in table}))
        for name, table in tables.items()
    }


def _named(name: str, table: dict[str, Any]) -> Case:
    summary, source, units, horizon = (table.get(key, 0) for key in ("summary", "source", "units", "horizon"))
    body, start = motion_of(_FREE | ({} if {"matrix", "axis_angle"} & set(table) else _UPRIGHT) | table)
    assert isinstance(body, Body)
    resolved = resolve(body, start)
    case = Case(name, summary, system_of(None, body), resolved.top, resolved.start, body=body, given_start=start)
    return replace(case, source=source, units=units, horizon=horizon)


@cache
def named_bodies() -> dict[str, Case]:
    """The bodies of bodies.toml by name: standard tests of multibody codes and of integrators."""
    return {name: _named(name, table) for name, table in _tables().items()}


def case(name: str, more: dict[str, Case] | None = None) -> Case:
    """The built-in case or named body of that name, or one of ``more``; raises InputError for any other."""
    if name in CASES:
        return CASES[name]
    known = CASES | named_bodies() | (more or {})
    if name not in known:
        raise InputError(f"Unknown case {name[:60]!r}.", meant(name, known) + "`heavytop list` shows the cases.")
    return known[name]


def require_possible(case: Case) -> Case:
    """The case; raises InputError for too large data, |gamma| ≠ 1, and a start that the system does not admit."""
    require_physical(case.top, case.start)
    case.start.require_unit_gamma(remedy=case.start.unit_gamma_nearby())
    case.system.parameters(case.top, case.start)
    return case
