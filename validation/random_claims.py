"""Claims at random against an evaluation of their own: is what is called ``holds`` true, and what is refuted false?

Every claim is made of a known true motion or first integral, in which parts are replaced by equal ones (roots,
inverse functions, quotients, half angles, exponentials), and of mistakes: a wrong term, a jump, a formula that is
nowhere real, a divisor that a parameter makes 0, a side condition that the flow does not keep.  mpmath evaluates the
formulas as written, in real numbers, at random points, and takes the derivatives by differences: nothing of heavytop's
algebra is used for it.

    python validation/random_claims.py [--claims 2000] [--points 200] [--seed 1] [--traps]

--traps: the families of claim_traps.py instead, each of which invites a false ``holds`` in a way of its own.
"""

from __future__ import annotations

import argparse
import random
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import mpmath

from heavytop.errors import InputError
from heavytop.features.claims.audit.audit import audit_claim, claim_from_table
from heavytop.top.equations import system

STATE = ("Omega1", "Omega2", "Omega3", "gamma1", "gamma2", "gamma3")
DIGITS = 40
_SMALL = mpmath.mpf(10) ** -14


@dataclass
class Claim:
    """A claim as a TOML table, with what is known of it.

    truth: ``true`` (by construction, and provable), ``false``, or ``trap`` (0 where it is defined, and yet no motion
    or integral).
    """

    table: dict[str, Any]
    truth: str
    family: str
    system: str = "heavy_top"


# --- parts that are equal to another -------------------------------------------------------------------------------


class Rewriter:
    """Texts equal to a function of an argument, drawn at random."""

    def __init__(self, draw: random.Random, domain: str) -> None:
        self.draw = draw
        self.domain = domain

    def sech(self, u: str) -> str:
        """1/cosh u."""
        return self.draw.choice(
            [
                f"sech({u})",
                f"(1/cosh({u}))",
                f"(2/(exp({u}) + exp(-({u}))))",
                f"sqrt(1 - tanh({u})^2)",
                f"(2*exp({u})/(exp(2*({u})) + 1))",
                f"cos(asin(tanh({u})))",
                f"(sech(({u})/2)^2/(2 - sech(({u})/2)^2))",
            ]
        )

    def tanh(self, u: str) -> str:
        """tanh u."""
        return self.draw.choice(
            [
                f"tanh({u})",
                f"(sinh({u})/cosh({u}))",
                f"((exp({u}) - exp(-({u})))/(exp({u}) + exp(-({u}))))",
                f"(1 - 2/(exp(2*({u})) + 1))",
                f"(2*tanh(({u})/2)/(1 + tanh(({u})/2)^2))",
                f"(sinh({u})/sqrt(1 + sinh({u})^2))",
                f"sin(atan(sinh({u})))",
            ]
        )

    def cos(self, u: str) -> str:
        """cos u."""
        return self.draw.choice(
            [f"cos({u})", f"(1 - 2*sin(({u})/2)^2)", f"(cos(({u})/2)^2 - sin(({u})/2)^2)", f"sin({u} + pi/2)"]
        )

    def sin(self, u: str) -> str:
        """sin u."""
        return self.draw.choice([f"sin({u})", f"(2*sin(({u})/2)*cos(({u})/2))", f"(-cos({u} + pi/2))"])

    def one(self) -> str:
        """1, as a formula that is defined all over the domain, but for zeros of a denominator that are removable."""
        u = self.draw.choice(["t", "k*t", "2*t", "t/2", "t/3", "-k*t"])
        x = self.draw.choice(["t", "k*t", "sinh(t)", "(t^2 + 1)", "sin(t)", "exp(-t)"])
        e = f"(2 + ({x})^2)"
        return self.draw.choice(
            [
                f"(sin({u})^2 + cos({u})^2)",
                f"(cosh({u})^2 - sinh({u})^2)",
                f"(sqrt(1 + ({x})^2)^2/(1 + ({x})^2))",
                f"(exp(log(1 + ({x})^2))/(1 + ({x})^2))",
                f"(sqrt(cosh({u})^2)/cosh({u}))",
                f"sqrt(sech({u})^2 + tanh({u})^2)",
                f"(cos(atan({x}))*sqrt(1 + ({x})^2))",
                f"(cos(2*atan({x}))*(1 + ({x})^2) + ({x})^2)",
                f"(sqrt(1 - tanh({u})^2)*cosh({u}))",
                f"(exp({u})*exp(-({u})))",
                f"((2 + cos({u}))/(2 + cos({u})))",
                f"(sqrt(2 + sin({u}))^2/(2 + sin({u})))",
                f"(exp(log(2 + cos({u}))/2)^2/(2 + cos({u})))",
                f"(tanh(log({e}))*({e}^2 + 1)/({e}^2 - 1))",
                "(sqrt(k)*sqrt(m)/sqrt(k*m))",
                "(sqrt(5 + 2*sqrt(6))/(sqrt(2) + sqrt(3)))^2",
                f"(sqrt(exp(2*({u})) + 2 + exp(-2*({u})))/(2*cosh({u})))",
                f"(sqrt(({x})^2 + 2*({x}) + 2)^2/((({x}) + 1)^2 + 1))",
                f"(sin({u})/sin({u}))",
                "(t/t)",
                f"((1 - cos({u}))/(2*sin(({u})/2)^2))",
                "((t^2 - k^2)/((t - k)*(t + k)))",
                f"(tan(atan({x}) + 0*t)/({x}))",
                "(exp(k*t + m)/(exp(k*t)*exp(m)))",
                *self._on_half(u),
            ]
        )

    def _on_half(self, u: str) -> list[str]:
        if self.domain == "t>0":
            return [
                "(sqrt(t^2)/t)",
                "(sqrt(t)^2/t)",
                "(exp(log(t))/t)",
                f"(sqrt(sinh({u})^2)/sqrt(sinh({u})^2))",
                "(sqrt(cosh(t)^2 - 1)/sinh(t))",
            ]
        if self.domain == "t<=0":
            return ["(-sqrt(t^2)/t)", "(sqrt(-t)^2/(-t))", "(sqrt(1 - t)^2/(1 - t))", "(-sqrt(cosh(t)^2 - 1)/sinh(t))"]
        return []

    def same(self, text: str) -> str:
        """The text, changed without changing its value."""
        for _ in range(self.draw.choice([0, 0, 1, 1, 2])):
            one = self.one()
            text = self.draw.choice([f"({text})*{one}", f"({text})/{one}", f"({text}) + {one} - 1"])
        return text


# --- motions -------------------------------------------------------------------------------------------------------


def _table(domain: str, parameters: dict[str, list[str]], **parts: Any) -> dict[str, Any]:
    return {
        "name": "random",
        "kind": "motion",
        "domain": domain,
        "assume": [f"{name} > 0" for name in parameters],
        "parameters": parameters,
        **parts,
    }


_KM = {"k": ["1", "3/4"], "m": ["2", "5/3"]}


def _upright(r: Rewriter) -> dict[str, Any]:
    top = {"inertia": ["m", "m", "k"], "weight": "1", "centre": ["0", "0", "3"]}
    return _table(r.domain, _KM, top=top, motion={"omega": ["0", "0", "m"], "gamma": ["0", "0", "1"]})


def _precession(r: Rewriter) -> dict[str, Any]:
    """Regular precession at the inclination 2 atan h, rates: spin k, precession m."""
    sine, cosine = "2*h/(1 + h^2)", "(1 - h^2)/(1 + h^2)"
    phi = "k*t"
    top = {"inertia": ["a", "a", "b"], "weight": "1", "centre": ["0", "0", f"m*(b*(k + m*{cosine}) - a*m*{cosine})"]}
    gamma = [f"{sine}*{r.sin(phi)}", f"{sine}*{r.cos(phi)}", cosine]
    omega = [f"m*{gamma[0]}", f"m*{sine}*{r.cos(phi)}", f"k + m*{cosine}"]
    parameters = {**_KM, "h": ["1/2", "1/3"], "a": ["1", "2"], "b": ["3/2", "1/2"]}
    return _table(r.domain, parameters, top=top, motion={"omega": omega, "gamma": gamma})


def _pendulum(r: Rewriter) -> dict[str, Any]:
    """The separatrix of the pendulum about axis 1."""
    u = "k*t"
    top = {"inertia": ["m", "2", "3"], "weight": "m", "centre": ["0", "0", "k^2"]}
    omega = [f"2*k*{r.sech(u)}", "0", "0"]
    gamma = ["0", f"-2*{r.sech(u)}*{r.tanh(u)}", f"1 - 2*{r.sech(u)}^2"]
    return _table(r.domain, _KM, top=top, motion={"omega": omega, "gamma": gamma})


def _free(r: Rewriter) -> dict[str, Any]:
    """The free symmetric top with γ along M."""
    turn, size = "(b - a)/a*m*t", "sqrt(a^2*k^2 + b^2*m^2)"
    omega = [f"k*{r.cos(turn)}", f"k*{r.sin(turn)}", "m"]
    gamma = [f"a*{omega[0]}/{size}", f"a*k*{r.sin(turn)}/{size}", f"b*m/{size}"]
    top = {"inertia": ["a", "a", "b"], "weight": "0", "centre": ["0", "0", "1"]}
    parameters = {**_KM, "a": ["1", "2"], "b": ["3/2", "1/2"]}
    return _table(r.domain, parameters, top=top, motion={"omega": omega, "gamma": gamma})


def _staude(r: Rewriter) -> dict[str, Any]:
    """A permanent rotation about a vertical in the plane of two principal axes."""
    x, y = "2*h/(1 + h^2)", "(1 - h^2)/(1 + h^2)"
    top = {"inertia": ["a", "b", "1"], "weight": "1", "centre": [f"(m^2*a + k)*{x}", f"(m^2*b + k)*{y}", "0"]}
    parameters = {**_KM, "h": ["1/2", "1/3"], "a": ["1", "2"], "b": ["3/2", "3/2"]}
    motion = {"omega": [f"m*{x}", f"m*{y}", "0"], "gamma": [x, y, "0"]}
    return _table(r.domain, parameters, top=top, motion=motion)


def _delone(r: Rewriter) -> dict[str, Any]:
    u = "k*t/sqrt(2)"
    definitions = {
        "T": r.tanh(u),
        "S": r.sech(u),
        "d": "1 + S^2",
        "st": "T^2/d",
        "ct": "2*S/d",
        "sp": "-2*sqrt(2)*T*S/d",
        "cp": "2*st - 1",
    }
    top = {"inertia": ["m", "m", "m/2"], "weight": "1", "centre": ["0", "k^2*m/2", "0"]}
    motion = {"omega": ["k*sp/2", "k*st", "2*k*ct"], "gamma": ["st*sp", "st*cp", "ct"]}
    return _table(r.domain, _KM, definitions=definitions, top=top, motion=motion)


def _gyrostat(r: Rewriter) -> dict[str, Any]:
    """The partial case of the paper, α = k, I1 = m + b, I3 = b."""
    rate = "k*m/b"
    s = f"({rate}*t/2)"
    omega = [f"-k*{r.tanh(s)}*{r.sech(s)}", f"k*{r.tanh(s)}^2", f"k*(m + b)/b*{r.sech(s)}"]
    gamma = [f"-{r.tanh(s)}*{r.sech(s)}", f"{r.tanh(s)}^2", r.sech(s)]
    top = {"inertia": ["m + b", "m + b", "b"], "weight": "1", "centre": ["0", "1", "0"], "rotor": f"{rate}/2"}
    parameters = {**_KM, "b": ["3/2", "1/2"]}
    return _table(r.domain, parameters, top=top, motion={"omega": omega, "gamma": gamma})


_MOTIONS: list[Callable[[Rewriter], dict[str, Any]]] = [
    _upright,
    _precession,
    _pendulum,
    _free,
    _staude,
    _delone,
    _gyrostat,
]
_NEVER = ["0*log(-1 - t^2)", "exp(log(-2 - t^2)) + 2 + t^2", "sqrt(-1 - t^2) - sqrt(-1 - t^2)", "0*asin(2 + t^2)"]
_JUMPS = [
    "sqrt(t^2)/t",
    "2*(atan(t) + atan(1/t))/pi",
    "1 + atan(tan(t)) - t",
    "sqrt(sin(k*t)^2)/sin(k*t)",
    "2 + (t^2)^(1/2)/t",
    "1 + atan2(sin(t), cos(t)) - t",
    "1 + acos(cos(t))^2 - acos(cos(t))*acos(cos(t)) + atan(1/sin(t)) + atan(sin(t))",
]
_WRONG = ["1e-25*t", "1e-9", "sin(t)/10", "k/1000", "atan(1/t)/50", "sqrt(1 + t^2)/9"]


def motion_claim(draw: random.Random) -> Claim:
    """A motion: true, false, nowhere real, or with a jump."""
    domain = draw.choice(["all", "all", "t<=0", "t>0"])
    r = Rewriter(draw, domain)
    make = draw.choice(_MOTIONS)
    table = make(r)
    about = "gyrostat" if make is _gyrostat else "heavy_top"
    motion = {part: [r.same(text) for text in texts] for part, texts in table["motion"].items()}
    table["motion"] = motion
    kind = draw.random()
    part, index = draw.choice(["omega", "gamma"]), draw.randrange(3)
    if kind < 0.5:
        return Claim(table, "true", make.__name__, about)
    if kind < 0.75:
        wrong = draw.choice(_WRONG)
        motion[part][index] = f"{motion[part][index]} + {wrong}"
        # an upright top spins at any constant rate
        spins = make is _upright and (part, index) == ("omega", 2) and "t" not in wrong
        return Claim(table, "true" if spins else "false", make.__name__, about)
    if kind < 0.85:
        motion[part][index] = f"{motion[part][index]} + {draw.choice(_NEVER)}"
        return Claim(table, "trap", "nowhere", about)
    table = _upright(Rewriter(draw, "all"))
    table["motion"]["omega"][2] = f"m*({draw.choice(_JUMPS)})"
    return Claim(table, "trap", "jump")


# --- first integrals -----------------------------------------------------------------------------------------------

_H = "((a*Omega1^2 + b*Omega2^2 + c*Omega3^2)/2 + P*(x*gamma1 + y*gamma2 + z*gamma3))"
_C0 = "(a*Omega1*gamma1 + b*Omega2*gamma2 + c*Omega3*gamma3)"
_G = "(gamma1^2 + gamma2^2 + gamma3^2)"
_COMPOSED = [
    "{0}",
    "{0}^2 + {1}",
    "{0}*{1}",
    "exp({0})",
    "sqrt(1 + {0}^2)",
    "{0}/{1}",
    "sqrt({0})",
    "log(1 + {0}^2)",
    "atan({0})*{1}",
    "sin({0}) + cosh({1})",
    "({0}^2 - {1}^2)/({0} - {1})",
    "tanh(log(1 + {0}^2))",
    "asin({0}/sqrt(1 + {0}^2))",
    "sqrt({0}^2)",
    "{0}*Omega1/Omega1",
    "sqrt(2 + sin({0}))",
    "log({0})",
    "exp(log({0})/2)",
    "{0}/sqrt({1}^2 + {0}^2)",
]
_STATES = [
    ["1/2", "2/3", "3/4", "2/3", "1/3", "2/3"],
    ["1", "2", "1", "3/5", "0", "4/5"],
    ["1/3", "-1/2", "2", "2/7", "3/7", "6/7"],
]
_FALSE_INTEGRALS = ["{0} + Omega1", "{0}*Omega2", "Omega1^2 + Omega2^2", "{0} + 1e-25*Omega3*gamma1", "Omega3"]
_TRAPS = [
    "sqrt(Omega1^2)/Omega1",
    "sqrt(gamma2^2)/gamma2 + {0}",
    "{0} + 0*log(-1 - Omega1^2)",
    "atan(Omega1) + atan(1/Omega1)",
]


def _integral(value: str, states: list[list[str]], **parts: Any) -> dict[str, Any]:
    parameters = {"a": ["2", "1"], "b": ["3", "3/2"], "c": ["5", "2"], "P": ["1", "2"]}
    parameters |= {"x": ["1/2", "0"], "y": ["1/3", "-1"], "z": ["-1/5", "1/2"]}
    table = {
        "name": "random",
        "kind": "integral",
        "assume": ["a > 0", "b > 0", "c > 0", "P > 0"],
        "parameters": parameters,
        "top": {"inertia": ["a", "b", "c"], "weight": "P", "centre": ["x", "y", "z"]},
        "integral": {"value": value, "states": states},
    }
    return table | parts


def integral_claim(draw: random.Random) -> Claim:
    """A first integral or an invariant relation: true, false, with a jump, nowhere real, or on what is not kept."""
    pair = draw.sample([_H, _C0, _G], 2)
    kind = draw.random()
    if kind < 0.5:
        return Claim(_integral(draw.choice(_COMPOSED).format(*pair), _STATES), "true", "integral")
    if kind < 0.7:
        return Claim(_integral(draw.choice(_FALSE_INTEGRALS).format(*pair), _STATES), "false", "integral")
    if kind < 0.8:
        return Claim(_integral(draw.choice(_TRAPS).format(*pair), _STATES), "trap", "integral")
    if kind < 0.87:
        return _conditional(draw)
    return _not_kept(draw) if kind < 0.95 else _with_open_parameter(draw, pair)


def _with_open_parameter(draw: random.Random, pair: list[str]) -> Claim:
    """A first integral, divided and multiplied by what is 0 everywhere where u is 0: a trap unless that is excluded."""
    divisor = draw.choice(["u", "u*Omega1", "sin(u*Omega2)", f"u*{pair[1]}", "(u^3 - 2*u^2)", "u*gamma3"])
    table = _integral(f"{pair[0]}*{divisor}/({divisor})", _STATES)
    table["parameters"] |= {"u": ["1/2", "3"]}
    is_excluded = draw.random() < 0.5
    if is_excluded:
        table["assume"] = [*table["assume"], "u != 0", *(["u != 2"] if "u^3" in divisor else [])]
    return Claim(table, "true" if is_excluded else "trap", "open parameter")


def _conditional(draw: random.Random) -> Claim:
    """Goryachev and Chaplygin's integral on C0 = 0, or Hess' relation."""
    if draw.random() < 0.5:
        base = "(Omega3*(Omega1^2 + Omega2^2) - n/c*Omega1*gamma3)"
        value = draw.choice(["{0}", "{0}^2", "exp({0})", "sqrt(1 + {0}^2)", "atan({0})"]).format(base)
        table = _integral(value, [["4", "-3", "5", "3/5", "4/5", "0"], ["1", "0", "0", "0", "1", "0"]])
        table |= {"assume": ["c > 0"], "parameters": {"c": "1", "n": "3/2"}}
        table["top"] = {"inertia": ["4*c", "4*c", "c"], "weight": "1", "centre": ["n", "0", "0"]}
        table["integral"]["where"] = [draw.choice(["", "2*"]) + "(4*Omega1*gamma1 + 4*Omega2*gamma2 + Omega3*gamma3)"]
        return Claim(table, "true", "where")
    table = _integral("a*x*Omega1 + c*z*Omega3", [["1", "1/2", "-3", "2/3", "1/3", "2/3"]], kind="relation")
    table |= {"assume": ["a > 0", "b > 0", "c > 0", "z > 0"], "relations": ["a*(b - c)*x^2 - c*(a - b)*z^2"]}
    table["parameters"] = {"a": "9", "b": "5", "c": "4", "x": "4", "z": "3"}
    table["top"] = {"inertia": ["a", "b", "c"], "weight": "1", "centre": ["x", "0", "z"]}
    return Claim(table, "true", "where")


def _not_kept(draw: random.Random) -> Claim:
    """Constant at each point of a set that the flow leaves, or a relation without a real point."""
    free = {"weight": "0", "inertia": ["2", "3", "5"], "centre": ["0", "0", "0"]}
    value, where, kind, state = draw.choice(
        [
            ("Omega3", ["Omega1"], "integral", ["0", "1", "2", "1", "0", "0"]),
            ("Omega1", ["Omega2"], "integral", ["1", "0", "2", "1", "0", "0"]),
            ("sqrt(Omega1)", [], "relation", ["0", "1", "2", "1", "0", "0"]),
            ("Omega1^2", [], "relation", ["0", "1", "2", "1", "0", "0"]),
            ("Omega1^2 + 1", [], "relation", ["0", "1", "2", "1", "0", "0"]),
            ("Omega1^2 + Omega2^2 + 2", [], "relation", ["0", "1", "2", "1", "0", "0"]),
            ("Omega3/Omega1", ["Omega1*Omega2"], "integral", ["0", "1", "2", "1", "0", "0"]),
        ]
    )
    table = _integral(value, [state], kind=kind)
    table |= {"assume": [], "parameters": {}, "top": free}
    table["integral"]["where"] = where
    return Claim(table, "trap", "not kept")


# --- Jacobi's functions, and tops that carry a rotor -----------------------------------------------------------------


def _swing(r: Rewriter) -> dict[str, Any]:
    """A pendulum that swings, about axis 1: sin of half the angle is h sn(k t, h²)."""
    u = "k*t, h^2"
    top = {"inertia": ["m", "2", "3"], "weight": "m", "centre": ["0", "0", "k^2"]}
    gamma = ["0", f"-2*h*sn({u})*dn({u})", f"2*h^2*sn({u})^2 - 1"]
    motion = {"omega": [f"2*h*k*cn({u})", "0", "0"], "gamma": gamma}
    table = _table(r.domain, {**_KM, "h": ["1/2", "3/5"]}, top=top, motion=motion)
    return table | {"assume": [*table["assume"], "h < 1"]}


def _turning(r: Rewriter) -> dict[str, Any]:
    """The free body A > B > C with 2 T B < G², by A = C + p + q, B = C + q, G² − 2TB = e."""
    definitions = {
        "A": "c + p + q",
        "B": "c + q",
        "m": "(A*E - H)*(B - c)/((A - B)*(H - c*E))",
        "rate": "sqrt((H - c*E)*(A - B)/(A*B*c))",
        "E": "1",
        "H": "B + p*e",
    }
    order = ("A", "B", "E", "H", "m", "rate")
    parts = [
        "sqrt(A*(H - c*E)/(A - c))*dn(rate*t, m)",
        "-sqrt(B*(A*E - H)/(A - B))*sn(rate*t, m)",
        "sqrt(c*(A*E - H)/(A - c))*cn(rate*t, m)",
    ]
    motion = {
        "omega": [f"{part}/{moment}" for part, moment in zip(parts, "ABc", strict=True)],
        "gamma": [f"{part}/sqrt(H)" for part in parts],
    }
    parameters = {"c": ["1", "1/2"], "p": ["1/2", "1/3"], "q": ["1/3", "1/4"], "e": ["1/2", "2/3"]}
    top = {"inertia": ["A", "B", "c"], "weight": "0", "centre": ["0", "0", "0"]}
    given = {name: definitions[name] for name in order}
    table = _table(r.domain, parameters, definitions=given, top=top, motion=motion)
    return table | {"assume": [*table["assume"], "e < 1", "p < c"]}


_ELLIPTIC_FAULTS = ["1e-20*sn(t, 1/2)", "sn(t, 1/3)/50", "cn(2*t, 1/2)/9", "dn(t, 1/2) - 1", "1e-9"]


def elliptic_claim(draw: random.Random) -> Claim:
    """A motion in Jacobi's functions: true, or with a fault in one component or in a parameter."""
    r = Rewriter(draw, draw.choice(["all", "t<=0", "t>0"]))
    make = draw.choice([_swing, _turning])
    table = make(r)
    if draw.random() < 0.5:
        return Claim(table, "true", make.__name__)
    part, index = draw.choice(["omega", "gamma"]), draw.randrange(3)
    if draw.random() < 0.5:
        table["motion"][part][index] += f" + {draw.choice(_ELLIPTIC_FAULTS)}"
    elif make is _swing:
        table["motion"]["gamma"][1] = table["motion"]["gamma"][1].replace("dn", draw.choice(["cn", "sn"]))
    else:
        table["definitions"]["m"] += draw.choice(["*99/100", "^2", "/(1 + p)"])
    return Claim(table, "false", make.__name__)


_K0 = "((a*Omega1 + u)*gamma1 + (b*Omega2 + v)*gamma2 + (c*Omega3 + w)*gamma3)"
_CARRIED_FALSE = [_C0, f"{_H} + u*Omega1", "{0} + 1e-20*Omega2", f"{_C0} - u*gamma1", "c*Omega3 + w"]


def gyrostat_claim(draw: random.Random) -> Claim:
    """A first integral of a heavy gyrostat: energy and area in any combination, Lagrange's, Yehia's, or a false one."""
    pair = draw.sample([_H, _K0, _G], 2)
    states = _STATES
    kind = draw.random()
    value = draw.choice(_COMPOSED if kind < 0.5 else _CARRIED_FALSE).format(*pair)
    table = _integral(value, states)
    table["parameters"] |= {"u": ["1/2", "1/3"], "v": ["-1/3", "1"], "w": ["3/4", "2"]}
    table["top"]["rotor"] = ["u", "v", "w"]
    if kind >= 0.8:
        table["top"] |= {"inertia": ["a", "a", "c"], "centre": ["0", "0", "z"], "rotor": ["0", "0", "w"]}
        table["integral"]["value"] = draw.choice(["c*Omega3 + w", "exp(Omega3)", "(Omega3 - w)^2"])
    truth = "true" if kind < 0.5 or kind >= 0.8 else "false"
    return Claim(table, truth, "gyrostat's integral", "heavy_gyrostat")


def carried_motion_claim(draw: random.Random) -> Claim:
    """A motion of a heavy gyrostat: Lagrange's precession, or a pendulum with k along its axis; or with a fault."""
    r = Rewriter(draw, draw.choice(["all", "t<=0", "t>0"]))
    make, place = draw.choice([(_precession, 2), (_pendulum, 0), (_swing, 0)])
    table = make(r)
    table["parameters"] = table["parameters"] | {"w": ["1/2", "-2"]}
    top = table["top"]
    top["rotor"] = ["w" if axis == place else "0" for axis in range(3)]
    if make is _precession:
        top["centre"][2] += " + m*w"
    if draw.random() < 0.5:
        return Claim(table, "true", f"carried{make.__name__}", "heavy_gyrostat")
    if draw.random() < 0.5:
        part, index = draw.choice(["omega", "gamma"]), draw.randrange(3)
        table["motion"][part][index] += f" + {draw.choice(_WRONG)}"
    else:
        top["rotor"][(place + 1) % 3] = draw.choice(["1e-20", "w", "k"])
    return Claim(table, "false", f"carried{make.__name__}", "heavy_gyrostat")


def value_claim(draw: random.Random) -> Claim:
    """Numbers of a motion, with a rotor in every third, printed right, or with errors, by an integration of its own."""
    import random_values

    table, expected = random_values.claim_of(draw)
    about = "heavy_gyrostat" if "rotor" in table["body"] else "heavy_top"
    if draw.random() < 0.5:
        right = [value for value, (is_right, _) in zip(table["value"], expected, strict=True) if is_right]
        return Claim(table | {"value": right or table["value"]}, "true" if right else "false", "values", about)
    return Claim(table, "true" if all(is_right for is_right, _ in expected) else "false", "values", about)


def random_claim(draw: random.Random) -> Claim:
    """Any of them."""
    if (kind := draw.random()) < 0.1:
        return value_claim(draw) if kind < 0.03 else carried_motion_claim(draw)
    kind = draw.random()
    if kind < 0.2:
        return elliptic_claim(draw)
    if kind < 0.35:
        return gyrostat_claim(draw)
    return motion_claim(draw) if kind < 0.75 else integral_claim(draw)


# --- the evaluation of its own -------------------------------------------------------------------------------------


class Undefined(Exception):
    """A formula that is not defined or not real at a point."""


def _real(function: Callable[..., Any], accepts: Callable[..., bool] = lambda *_: True) -> Callable[..., Any]:
    def inside(*values: Any) -> Any:
        if not accepts(*values):
            raise Undefined
        return function(*values)

    return inside


_FUNCTIONS = {
    "sqrt": _real(mpmath.sqrt, lambda x: x >= 0),
    "log": _real(mpmath.log, lambda x: x > 0),
    "asin": _real(mpmath.asin, lambda x: abs(x) <= 1),
    "acos": _real(mpmath.acos, lambda x: abs(x) <= 1),
    "sech": _real(mpmath.sech),
    **{name: getattr(mpmath, name) for name in ("exp", "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan", "atan2")},
    **{
        name: _real(lambda u, m, name=name: mpmath.ellipfun(name, u, m=m), lambda u, m: 0 <= m <= 1)
        for name in ("sn", "cn", "dn")
    },
    "mpf": mpmath.mpf,
    "pi": mpmath.mp.pi,
}


def compiled(text: str) -> Callable[[dict[str, Any]], Any]:
    """A formula as a function of its names, in real numbers of mpmath; raises Undefined where it has no value."""
    text = re.sub(r"\^\(1/2\)", "^half", text).replace("^", "**")
    code = compile(re.sub(r"(?<![\w.])(\d+\.?\d*(?:e[+-]?\d+)?)", r"mpf('\1')", text), "formula", "eval")

    def value(names: dict[str, Any]) -> Any:
        try:
            found = eval(code, {**_FUNCTIONS, "half": mpmath.mpf(1) / 2}, names)
        except ZeroDivisionError:
            raise Undefined from None
        if not mpmath.isfinite(found) or mpmath.im(found) != 0:
            raise Undefined
        return found

    return value


def _field(inertia: list[Any], moment: list[Any], rotor: Any, y: list[Any], about: str) -> list[Any]:
    """M' = M × Ω + P γ × r, γ' = γ × Ω; for the gyrostat M' = M × ω, γ' = γ × ω, ω = Ω + λ e2."""

    def cross(p: list[Any], q: list[Any]) -> list[Any]:
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    omega, gamma = list(y[:3]), list(y[3:])
    momentum = [i * w for i, w in zip(inertia, omega, strict=True)]
    if about == "heavy_gyrostat":
        momentum = [m + k for m, k in zip(momentum, rotor, strict=True)]
    if about == "gyrostat":
        omega[1] += rotor
        torque = [0, 0, 0]
    else:
        torque = cross(gamma, moment)
    rates = [(m + n) / i for m, n, i in zip(cross(momentum, omega), torque, inertia, strict=True)]
    return [*rates, *cross(gamma, omega)]


class Numbers:
    """The residuals of a claim at random points."""

    def __init__(self, claim: Claim) -> None:
        table = claim.table
        self.claim = claim
        self.definitions = {name: compiled(text) for name, text in table.get("definitions", {}).items()}
        top = table["top"]
        self.top = {name: [compiled(text) for text in top[name]] for name in ("inertia", "centre")}
        self.weight, rotor = compiled(top["weight"]), top.get("rotor", "0")
        self.rotor = [compiled(part) for part in rotor] if isinstance(rotor, list) else compiled(rotor)
        if table["kind"] == "motion":
            self.formulas = [compiled(text) for part in ("omega", "gamma") for text in table["motion"][part]]
        else:
            self.formulas = [compiled(table["integral"]["value"])]

    def residuals(self, draw: random.Random) -> list[Any]:
        """At one random point; raises Undefined where a formula has no value."""
        names = self._parameters(draw)
        for name, formula in self.definitions.items():
            if self.claim.table["kind"] != "motion":
                names[name] = formula(names)
        moving = self.claim.table["kind"] == "motion"
        return self._of_motion(names, draw) if moving else self._of_integral(names, draw)

    def _parameters(self, draw: random.Random) -> dict[str, Any]:
        names = self.claim.table["parameters"]
        positive = {text.split()[0] for text in self.claim.table["assume"]}
        below_one = {"h", "e"} if {"h < 1", "e < 1"} & set(self.claim.table["assume"]) else set()
        found = {
            name: mpmath.mpf(draw.uniform(0.3, 0.95 if name in below_one else 2.5))
            * (1 if name in positive or draw.random() < 0.5 else -1)
            for name in names
        }
        if "p < c" in self.claim.table["assume"]:
            found["p"] = found["c"] * mpmath.mpf(draw.uniform(0.1, 0.9))
        return found

    def _at(self, names: dict[str, Any]) -> list[Any]:
        for name, formula in self.definitions.items():
            names[name] = formula(names)
        return [formula(names) for formula in self.formulas]

    def _of_motion(self, names: dict[str, Any], draw: random.Random) -> list[Any]:
        sign = {"t<=0": -1, "t>0": 1, "all": draw.choice([-1, 1])}[self.claim.table["domain"]]
        t, step = sign * mpmath.mpf(draw.uniform(0.02, 3)), mpmath.mpf(10) ** (-DIGITS // 3)
        near = [self._at({**names, "t": t + shift * step}) for shift in (-1, 0, 1)]
        rates = [(after - before) / (2 * step) for before, _, after in zip(*near, strict=True)]
        field = self._field(names, near[1])
        return [*(r - f for r, f in zip(rates, field, strict=True)), sum(g * g for g in near[1][3:]) - 1]

    def _field(self, names: dict[str, Any], y: list[Any]) -> list[Any]:
        for name, formula in self.definitions.items():
            with suppress(NameError):  # of the time: a top does not change
                names = {**names, name: formula(names)}
        inertia = [part(names) for part in self.top["inertia"]]
        weight = self.weight(names)
        moment = [weight * part(names) for part in self.top["centre"]]
        rotor = [part(names) for part in self.rotor] if isinstance(self.rotor, list) else self.rotor(names)
        return _field(inertia, moment, rotor, y, self.claim.system)

    def _of_integral(self, names: dict[str, Any], draw: random.Random) -> list[Any]:
        y = [mpmath.mpf(draw.uniform(-2, 2)) for _ in STATE]
        size = mpmath.sqrt(sum(part**2 for part in y[3:]))
        y[3:] = [part / size for part in y[3:]]
        field, step = self._field(names, y), mpmath.mpf(10) ** (-DIGITS // 3)

        def value(shift: int) -> Any:
            moved = {name: a + shift * step * b for name, a, b in zip(STATE, y, field, strict=True)}
            return self.formulas[0]({**names, **moved})

        return [(value(1) - value(-1)) / (2 * step)]


def passes(claim: Claim, points: int, draw: random.Random) -> bool | None:
    """Whether the equations hold at every point where all is defined; None where it is nowhere defined."""
    if claim.table["kind"] in ("relation", "value") or claim.table.get("integral", {}).get("where"):
        return claim.truth == "true"  # on a set that random points miss: known by construction
    with mpmath.workdps(DIGITS):
        numbers, defined = Numbers(claim), 0
        for _ in range(points):
            try:
                residuals = numbers.residuals(draw)
            except Undefined:
                continue
            defined += 1
            if any(abs(r) > _SMALL for r in residuals):
                return False
    return True if defined else None


# --- what is counted -----------------------------------------------------------------------------------------------


@dataclass
class Outcome:
    """A claim, its verdict, the fault of that verdict, if it has one, and what leaves it undecided."""

    claim: Claim
    verdict: str
    fault: str
    seconds: float
    reason: str


def trap_outcomes(count: int, seed: int) -> Iterator[Outcome]:
    """The audits of ``count`` claims of the families of claim_traps.py, in turn.

    A claim that is no claim about a body must be refused, or undecided.
    """
    import claim_traps

    draw = random.Random(seed)
    for number in range(count):
        table, known, family, about = claim_traps.FAMILIES[number % len(claim_traps.FAMILIES)](draw)
        claim = Claim(table, known, family, about)
        begin = time.process_time()
        verdict, reason = _verdict(claim)
        spent = time.process_time() - begin
        fault = ""
        if verdict == "holds":
            fault = "false holds" if known in ("false", "refused") else ""
            if found := claim_traps.contradiction(table, about, draw):
                fault, reason = "false holds", found
        if verdict == "refuted" and known in ("true", "refused"):
            fault = "false refuted"
        yield Outcome(claim, verdict, fault, spent, reason)


def _verdict(claim: Claim) -> tuple[str, str]:
    """(verdict, what leaves it undecided)."""
    try:
        report = audit_claim(claim_from_table(claim.table, "random"), system(claim.system))
    except InputError as error:
        return f"refused: {error.cause}", ""
    open_rows = [row for row in report.rows if row.holds is None]
    texts = [f"{c.text} ({c.reason})" for row in open_rows for c in row.conditions if not c.discharged]
    return report.verdict, "; ".join(dict.fromkeys([*texts, *(row.residual for row in open_rows)]))


def outcomes(count: int, points: int, seed: int) -> Iterator[Outcome]:
    """The audits of ``count`` random claims."""
    draw = random.Random(seed)
    for _ in range(count):
        claim = random_claim(draw)
        begin = time.process_time()
        verdict, reason = _verdict(claim)
        seconds = time.process_time() - begin
        passed = passes(claim, points, draw)
        yield Outcome(claim, verdict, _fault(claim.truth, verdict, passed), seconds, reason)


def _fault(truth: str, verdict: str, passed: bool | None) -> str:
    """What is wrong with a verdict.

    Numbers below ``_SMALL`` excuse no false claim, and points at which a true one is nowhere defined (the logarithm
    of an integral that was negative at each) accuse none.
    """
    if verdict == "holds" and (truth != "true" or passed is False):
        return "false holds"
    return "false refuted" if verdict == "refuted" and truth == "true" else ""


def main() -> None:
    """Prints the counts, each fault, and each true claim that is not called so."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, value in (("claims", 2000), ("points", 200), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--traps", action="store_true")
    options = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    seconds = []
    traps = trap_outcomes(options.claims, options.seed)
    for outcome in traps if options.traps else outcomes(options.claims, options.points, options.seed):
        counts[outcome.claim.truth, outcome.verdict.partition(":")[0]] += 1
        seconds.append(outcome.seconds)
        if outcome.fault or (outcome.claim.truth == "true" and outcome.verdict != "holds"):
            table = outcome.claim.table
            shown = table.get("motion") or table.get("integral") or table["value"]
            print(outcome.fault or "missed", outcome.verdict, outcome.claim.family, outcome.reason, shown, flush=True)
    for (truth, verdict), number in sorted(counts.items()):
        print(f"{truth:6} {verdict:10} {number}")
    true = sum(number for (truth, _), number in counts.items() if truth == "true")
    print(f"true claims that hold: {100 * counts['true', 'holds'] / max(true, 1):.1f} %")
    print(f"seconds an audit: median {sorted(seconds)[len(seconds) // 2]:.2f}, largest {max(seconds):.2f}")


if __name__ == "__main__":
    main()
