"""True claims in disguise, and false ones beside them: how many of the true are undecided, and is nothing false held?

Each true claim is a known motion, first integral or invariant relation in which a formula that is 1 under the
assumptions and relations of the claim has been put: denested roots, inverse functions that add up, parameters on a
curve, orders of parameters.  Beside each stands a false neighbour: a sign turned, an assumption left out, an even
power for an odd one, a sum of arcs that is off by π.

    python validation/disguised_claims.py [--family NAME] [--every 1]

Of the 263 claims that are true, or refuted by construction, 259 get that verdict; none of the 138 false neighbours
holds.
"""

from __future__ import annotations

import argparse
import signal
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from heavytop.errors import HeavyTopError
from heavytop.features.claims.audit.audit import audit_claim, claim_from_table
from heavytop.features.claims.audit.guard import SECONDS
from heavytop.top.equations import system


@dataclass(frozen=True)
class Claim:
    """A claim as a TOML table.  expected: ``holds``, ``not holds`` or ``refuted``."""

    family: str
    table: dict[str, Any]
    expected: str
    about: str = "heavy_top"


@dataclass(frozen=True)
class One:
    """Formulas that are 1 where the claim is made, and formulas, with other assumptions or relations, that are not.

    wrong: formulas, or (formula, changes of the assumptions and relations).
    """

    right: tuple[str, ...]
    wrong: tuple[str | tuple[str, dict[str, Any]], ...]
    parameters: dict[str, Any] = field(default_factory=dict)
    assume: tuple[str, ...] = ()
    relations: tuple[str, ...] = ()
    domain: str = "all"


# --- what is 1 ------------------------------------------------------------------------------------------------------

_AB = {"a": ["4", "3"], "b": ["1", "2"]}
_CHAIN = {"a": ["5", "9"], "b": ["4", "7/2"], "c": ["2", "3"], "d": ["1", "1/3"]}
_CIRCLE = {"a": ["3/5", "5/13"], "b": ["4/5", "12/13"]}
_TURNED = {"a": ["3/5", "5/13"], "b": ["-4/5", "-12/13"]}
_DOWN = ("a > b", "b > c", "c > d")

ONES: dict[str, list[One]] = {
    "order": [
        One(
            (
                "sqrt((a - c)^2)/(a - c)",
                "sqrt((d - a)^2)/(a - d)",
                "sqrt((b - a)^2*(d - c)^2)/((a - b)*(c - d))",
                "sqrt(a^2 - 2*a*d + d^2)/(a - d)",
                "(a - d)/sqrt((a - b + c - d)^2 + 2*(b - c)*(a - b + c - d) + (b - c)^2)",
            ),
            (
                "sqrt((a - c)^2)/(c - a)",
                ("sqrt((a - d)^2)/(a - d)", {"assume": ["a > b", "c > d"]}),
                ("sqrt((a - c)^2)/(a - c)", {"assume": ["a > b", "c > b"], "parameters": {"c": ["9/2", "8"]}}),
            ),
            _CHAIN,
            _DOWN,
        ),
        One(
            (
                "sqrt((a*c - b*d)^2)/(a*c - b*d)",
                "sqrt((1/d - 1/a)^2)/(1/d - 1/a)",
                "sqrt((a^2 - c^2)^2)/(a^2 - c^2)",
                "sqrt(a - c)*sqrt(b - d)/sqrt((a - c)*(b - d))",
                "sqrt((a + b - c - d)^2)/(a + b - c - d)",
            ),
            (
                "sqrt((a*d - b*c)^2)/(a*d - b*c)",
                ("sqrt((a^2 - c^2)^2)/(a^2 - c^2)", {"assume": ["a > b", "b > c", "c > d"]}),
            ),
            _CHAIN,
            (*_DOWN, "d > 0"),
        ),
        One(
            (
                "sqrt((1 - k*h)^2)/(1 - k*h)",
                "sqrt((1 - h^2)^2)/(1 - h^2)",
                "sqrt(1 - h^2)/(sqrt(1 - h)*sqrt(1 + h))",
                "sqrt((2 - h - k)^2)/(2 - h - k)",
            ),
            ("sqrt((1 - 2*h)^2)/(1 - 2*h)", ("sqrt((1 - h^2)^2)/(1 - h^2)", {"assume": ["h < k", "k < 1"]})),
            {"h": ["1/3", "3/5"], "k": ["1/2", "4/5"]},
            ("0 < h", "h < k", "k < 1"),
        ),
        One(
            ("sqrt((a - 2*c)^2)/(a - 2*c)", "sqrt((a + b - 3*c)^2)/(a + b - 3*c)"),
            ("sqrt((a - 3*c)^2)/(a - 3*c)",),
            {"a": ["9", "7"], "b": ["3", "4"], "c": ["2", "1"]},
            ("a > b + c", "b > c", "c > 0"),
        ),
        One(
            (
                "sqrt((sqrt(a) - sqrt(c))^2)/(sqrt(a) - sqrt(c))",
                "sqrt((exp(a) - exp(c))^2)/(exp(a) - exp(c))",
                "sqrt((a^3 - c^3)^2)/(a^3 - c^3)",
                "sqrt(log(a/c)^2)/log(a/c)",
            ),
            ("sqrt((sqrt(c) - sqrt(a))^2)/(sqrt(c) - sqrt(a))", "sqrt(log(a/c)^2)/log(c/a)"),
            {"a": ["4", "9"], "b": ["3", "2"], "c": ["1", "1/2"]},
            ("a > b", "b > c", "c > 0"),
        ),
    ],
    "denest": [
        One(
            (
                "sqrt(3 + 2*sqrt(2)) - sqrt(2)",
                "sqrt(3 - 2*sqrt(2)) + 2 - sqrt(2)",
                "sqrt(7 + 4*sqrt(3)) - 1 - sqrt(3)",
                "sqrt(6 - 2*sqrt(5)) + 2 - sqrt(5)",
                "(sqrt(5 + 2*sqrt(6)) - sqrt(3))/sqrt(2)",
                "sqrt(2 + sqrt(3))*2/(sqrt(6) + sqrt(2))",
                "sqrt(17 + 12*sqrt(2)) - 2 - 2*sqrt(2)",
                "sqrt(9 + 4*sqrt(2))/(1 + 2*sqrt(2))",
                "sqrt(11 - 6*sqrt(2)) - 2 + sqrt(2)",
                "sqrt(16 - 6*sqrt(7)) - 2 + sqrt(7)",
                "sqrt(17 - 12*sqrt(2)) - 2 + 2*sqrt(2)",
                "sqrt(10 + 2*sqrt(21)) - sqrt(3) - sqrt(7) + 1",
                "sqrt(6 + 2*sqrt(2) + 2*sqrt(3) + 2*sqrt(6)) - sqrt(2) - sqrt(3)",
                "sqrt(4 - sqrt(15)) - sqrt(10)/2 + sqrt(6)/2 + 1",
                "sqrt(sqrt(2) + 1)*sqrt(sqrt(2) - 1)",
                "sqrt(4 + sqrt(7)) - sqrt(4 - sqrt(7)) - sqrt(2) + 1",
                "sqrt(1 + sqrt(3 + 2*sqrt(2)) - sqrt(2)) - sqrt(2) + 1",
                "cos(pi/8)*2/sqrt(2 + sqrt(2))",
            ),
            (
                "sqrt(3 - 2*sqrt(2)) + sqrt(2)",
                "sqrt(3 + 2*sqrt(2)) + sqrt(2)",
                "sqrt(6 - 2*sqrt(5)) + sqrt(5)",
                "sqrt(11 - 6*sqrt(2)) + 4 - sqrt(2)",
                "sqrt(4 - sqrt(15)) - sqrt(6)/2 + sqrt(10)/2 + 1",
            ),
        ),
        One(
            (
                "sqrt(a + b + 2*sqrt(a*b))/(sqrt(a) + sqrt(b))",
                "sqrt(a + 1 + 2*sqrt(a)) - sqrt(a)",
                "sqrt(2*a + 2*sqrt(a^2 - b^2))/(sqrt(a + b) + sqrt(a - b))",
                "sqrt(a + b - 2*sqrt(a*b))/(sqrt(a) - sqrt(b))",
                "sqrt(a + sqrt(a^2 - b^2))*sqrt(2)/(sqrt(a + b) + sqrt(a - b))",
                "sqrt(a - sqrt(a^2 - b^2))*sqrt(2)/(sqrt(a + b) - sqrt(a - b))",
                "sqrt(2*a^2 + b^2 + 2*a*sqrt(a^2 + b^2)) - a - sqrt(a^2 + b^2) + 1",
                "sqrt(a + 4 + 4*sqrt(a)) - sqrt(a) - 1",
                "sqrt(a^2 + b + 2*a*sqrt(b)) - a - sqrt(b) + 1",
            ),
            (
                ("sqrt(a + b - 2*sqrt(a*b))/(sqrt(a) - sqrt(b))", {"assume": ["a > 0", "b > 0"]}),
                "sqrt(a + b - 2*sqrt(a*b))/(sqrt(b) - sqrt(a))",
                "sqrt(a + 4 - 4*sqrt(a)) - 1 + sqrt(a)",
            ),
            _AB,
            ("a > b", "b > 0"),
        ),
        One(
            (
                "sqrt(2 + t^2 + 2*sqrt(1 + t^2)) - sqrt(1 + t^2)",
                "sqrt(2 + t^2 - 2*sqrt(1 + t^2)) + 2 - sqrt(1 + t^2)",
                "sqrt(1 + 2*t^2 + 2*sqrt(t^2 + t^4)) - sqrt(t^2) + 1 - sqrt(1 + t^2)",
                "sqrt((1 + cosh(2*t))/2)/cosh(t)",
                "sqrt(2*cosh(t)^2 - 1 + 2*sqrt(cosh(t)^4 - cosh(t)^2)) - sqrt(sinh(t)^2) + 1 - cosh(t)",
            ),
            ("sqrt(2 + t^2 - 2*sqrt(1 + t^2)) + sqrt(1 + t^2)",),
        ),
    ],
    "one root": [
        One(
            ("a", "a^2", "1/a", "sqrt(a)"),
            (
                ("a", {"relations": ["a^2 - 1"]}),
                ("a", {"relations": ["a^3 - 3*a^2 + 2*a"]}),
                "2 - a + (a - 1)^2 + t - t*a + a/10",
            ),
            {"a": ["1", "1"]},
            (),
            ("a^3 - 1",),
        ),
        One(
            ("a - 1", "a^2 - 3", "4/a^2"),
            (("a - 1", {"relations": ["a^4 - 16"]}), "3 - a/3"),
            {"a": "2"},
            (),
            ("a^5 - 32",),
        ),
        One(("a - 1", "a^2 - 3"), (("a - 1", {"assume": []}),), {"a": "2"}, ("a > 0",), ("a^4 - 16",)),
        One(("a",), (("a", {"relations": ["a^3 + a^2 - 2*a"]}), "3 - a"), {"a": "1"}, (), ("a^3 + a - 2",)),
        One(
            ("a/b", "a - b + 1", "a^2/b^2"),
            (("a - b + 1", {"relations": ["a^2 - b^2"]}), "a + b"),
            {"a": ["3", "2"], "b": ["3", "2"]},
            ("b > 0",),
            ("a^3 - b^3",),
        ),
        One(
            ("a/b", "a - b + 1"),
            (("a - b + 1", {"assume": ["a > 0"]}),),
            {"a": ["3", "2"], "b": ["3", "2"]},
            ("a > 0", "b > 0"),
            ("a^2 - b^2",),
        ),
        One(("a/b - 1", "a - 2*b + 1"), ("a - b",), {"a": ["4", "2"], "b": ["2", "1"]}, ("b > 0",), ("a^3 - 8*b^3",)),
        One(("a + b + 1",), ("a - b + 1",), {"a": ["3", "-2"], "b": ["-3", "2"]}, (), ("a^5 + b^5",)),
        One(
            ("a - b + 1",),
            (("a - b + 1", {"relations": ["a^3 - a - b^3 + b"]}),),
            {"a": ["3", "-2"], "b": ["3", "-2"]},
            (),
            ("a^3 + a - b^3 - b",),
        ),
        One(("a",), ("1 - a",), {"a": "1"}, (), ("exp(3*a) - exp(3)",)),
        One(("a - 1", "sqrt(a - 1)"), (("a - 1", {"assume": []}), "a"), {"a": "2"}, ("a > 0",), ("a^2 - a - 2",)),
        One(("a - 2", "4 - a"), (("a - 2", {"assume": ["a > 0"]}),), {"a": "3"}, ("a > 1",), ("a^2 - 4*a + 3",)),
        One(
            ("a^2/(b*c)", "b*c/a^2 + b/c - b/c"),
            ("b*c/a",),
            {"a": ["2", "6"], "b": ["1", "4"], "c": ["4", "9"]},
            ("a > 0", "b > 0", "c > 0"),
            ("a^3 - b*c*a",),
        ),
    ],
    "circle": [
        One(
            (
                "sqrt(1 - a^2)/b",
                "sqrt(1 - b^2)/a",
                "b + 1 - sqrt(1 - a^2)",
                "sqrt(4 - 4*a^2)/(2*b)",
                "sqrt(1 - a)*sqrt(1 + a)/b",
                "sqrt((1 - a)/(1 + a))*(1 + a)/b",
                "sqrt(1 + 2*a*b)/(a + b)",
                "sqrt(1/a^2 - 1)*a/b",
                "sqrt(1 + b^2/a^2)*a",
                "(asin(a) + asin(b))*2/pi",
                "asin(a)/acos(b)",
                "atan(b/a)/asin(b)",
                "sqrt(5 - 4*a^2*b^2) + 1 - sqrt((1 - 2*a^2)^2 + 4)",
                "sqrt(a^4 + b^4 + 2*a^2*b^2)",
                "2*atan(b/(1 + a))/asin(b)",
                "sqrt(2 + 2*a)*sqrt(2 - 2*a)/(2*b)",
            ),
            (
                "-sqrt(1 - a^2)/b",
                ("sqrt(1 - a^2)/b", {"assume": ["a > 0"]}),
                (
                    "sqrt(1 - a^2) + 1 - b",
                    {"relations": ["a^2 + b^2 - 1 + a - 3/5"], "parameters": {"a": "3/5", "b": "4/5"}},
                ),
                ("(asin(a) + asin(b))*2/pi", {"assume": ["a > 0"]}),
                "sqrt(1 - 2*a*b)/(a - b)",
                "atan(a/b)/asin(b)",
            ),
            _CIRCLE,
            ("a > 0", "b > 0"),
            ("a^2 + b^2 - 1",),
        ),
        One(
            ("-sqrt(1 - a^2)/b", "sqrt(1 - b^2)/a", "sqrt(1 - a^2) + b + 1", "(asin(a) - asin(b))*2/pi"),
            ("sqrt(1 - a^2)/b", "sqrt(1 - a^2) - b + 1"),
            _TURNED,
            ("a > 0", "b < 0"),
            ("a^2 + b^2 - 1",),
        ),
        One(
            (
                "sqrt(1 + s^2)/c",
                "sqrt(c^2 - 1)/s",
                "sqrt(c - 1)*sqrt(c + 1)/s",
                "exp(log(c + s)) + 1 - c - s",
                "sqrt((c + s)/(c - s)) - c - s + 1",
            ),
            ("sqrt(1 - s^2)/c", ("sqrt(c^2 - 1)/s", {"assume": ["c > 0"]})),
            {"s": ["3/4", "4/3"], "c": ["5/4", "5/3"]},
            ("s > 0", "c > 0"),
            ("c^2 - s^2 - 1",),
        ),
        One(
            ("sqrt(1 - a^2 - b^2)/c", "sqrt(1 - c^2)/sqrt(a^2 + b^2)", "1 + c - sqrt(1 - a^2 - b^2)"),
            ("sqrt(1 - a^2)/c", ("sqrt(1 - a^2 - b^2)/c", {"assume": []})),
            {"a": ["2/3", "1/3"], "b": ["1/3", "2/3"], "c": ["2/3", "2/3"]},
            ("c > 0",),
            ("a^2 + b^2 + c^2 - 1",),
        ),
        One(
            ("sqrt(b)/a", "sqrt(b*c^2)/(a*sqrt(c^2))", "sqrt(a^2 + 3*b)/(2*a)"),
            ("sqrt(b)/a^2", ("sqrt(b) - a + 1", {"assume": ["b > 0"], "parameters": {"a": ["-2", "-3"]}})),
            {"a": ["2", "3"], "b": ["4", "9"], "c": ["-1", "2"]},
            ("a > 0",),
            ("a^2 - b",),
        ),
    ],
    "arcs": [
        One(
            (
                "4*(4*atan(1/5) - atan(1/239))/pi",
                "1 + pi/4 - 4*atan(1/5) + atan(1/239)",
                "4*(atan(1/2) + atan(1/3))/pi",
                "4*(2*atan(1/3) + atan(1/7))/pi",
                "(atan(1) + atan(2) + atan(3))/pi",
                "2*(asin(3/5) + asin(4/5))/pi",
                "asin(3/5)/atan(3/4)",
                "acos(3/5)/(2*atan(1/2))",
                "(acos(1/3) + acos(-1/3))/pi",
                "acos(1/sqrt(3))/atan(sqrt(2))",
                "8*atan(sqrt(2) - 1)/pi",
                "12*atan(2 - sqrt(3))/pi",
                "4*(5*atan(1/7) + 2*atan(3/79))/pi",
                "2*(atan(1/4) + atan(4))/pi",
                "4*(atan(1/2) + atan(1/5) + atan(1/8))/pi",
                "4*(12*atan(1/18) + 8*atan(1/57) - 5*atan(1/239))/pi",
                "asin(1/sqrt(5))/atan(1/2)",
                "4*(asin(1/sqrt(5)) + asin(1/sqrt(10)))/pi",
                "(acos(1/7) + 2*acos(2/sqrt(7)) - acos(1/7))/acos(1/7)",
                "sin(16*atan(1/5) - 4*atan(1/239) - pi/2)",
                "atan2(4, 3)/(2*atan(1/2))",
                "2*asin(1/3)/acos(7/9)",
            ),
            (
                "4*(4*atan(1/5) + atan(1/239))/pi",
                "1 + 5*pi/4 - 4*atan(1/5) + atan(1/239)",
                "(atan(1) + atan(2) + atan(3))*4/pi",
                "2 - 4*(2*atan(2) - atan(4/3))/pi + 1",
                "(acos(-1/3) - acos(1/3))/pi",
                "8*atan(sqrt(2) + 1)/pi",
                "4*(4*atan(1/5) - atan(1/240))/pi",
                "(2*atan(2) + atan(4/3))/pi + 1",
                "asin(3/5)/atan(4/3)",
            ),
        ),
        One(
            (
                "(atan(a) + atan(1/a))*2/pi",
                "(atan(a) + atan(b) - atan((a + b)/(1 - a*b)) + pi)/pi",
                "asin(a/sqrt(1 + a^2))/atan(a)",
                "acos(1/sqrt(1 + a^2))/atan(a)",
                "2*atan(sqrt(1 + a^2) - a)/(pi/2 - atan(a))",
                "acos((1 - a^2)/(1 + a^2))/(2*atan(a))",
                "(atan(a) - atan(b))/atan((a - b)/(1 + a*b))",
                "(atan((1 + b)/(1 - b)) - atan(b))*4/pi",
            ),
            (
                ("(atan(a) + atan(b) - atan((a + b)/(1 - a*b)) + pi)/pi", {"assume": ["a > 0", "b > 0", "a > b"]}),
                "(atan(a) + atan(b) - atan((a + b)/(1 - a*b)) + pi)/(2*pi)",
                ("(atan(a) + atan(1/a))*2/pi", {"assume": []}),
                ("acos((1 - a^2)/(1 + a^2))/(2*atan(a))", {"assume": []}),
                ("1 + (atan((1 + b)/(1 - b)) - atan(b))*4/pi - 1", {"assume": ["a > b"]}),
            ),
            {"a": ["1/2", "3/4"], "b": ["1/3", "1/5"]},
            ("1 > a", "a > b", "b > 0"),
        ),
        One(
            (
                "1 + atan(sinh(t)) - 2*atan(tanh(t/2))",
                "1 + asin(tanh(t)) - atan(sinh(t))",
                "1 + 2*atan(exp(t)) - pi/2 - atan(sinh(t))",
                "2*(atan(exp(t)) + atan(exp(-t)))/pi",
                "1 + atan(t) - asin(t/sqrt(1 + t^2))",
                "1 + 2*atan(t + sqrt(1 + t^2)) - atan(t) - pi/2",
                "(acos(tanh(t)) + asin(tanh(t)))*2/pi",
                "1 + acos(tanh(t)) - 2*atan(exp(-t))",
                "1 + atan(2*t) - atan(t) - atan(t/(1 + 2*t^2))",
                "1 + atan2(t, 1) - atan(t)",
                "cos(4*atan(tanh(t/2)) - 2*atan(sinh(t)))",
            ),
            (
                "1 + atan(sinh(t)) - atan(tanh(t/2))",
                "1 + asin(tanh(t)) - 2*atan(exp(t))",
                "1 + 2*atan(t) - atan(2*t/(1 - t^2))",
                "1 + 2*atan(1/t)/pi + 2*atan(t)/pi - 1",
                "1 + atan(t) - acos(1/sqrt(1 + t^2))",
            ),
        ),
        One(
            (
                "(atan(t) + atan(1/t))*2/pi",
                "1 + atan(t) - acos(1/sqrt(1 + t^2))",
                "1 + atan2(1, t) - atan(1/t)",
                "1 + acos(sech(t)) - atan(sinh(t))",
                "1 + acos((1 - t^2)/(1 + t^2)) - 2*atan(t)",
            ),
            ("1 + 2*atan(t) - atan(2*t/(1 - t^2))", "-(atan(t) + atan(1/t))*2/pi"),
            domain="t>0",
        ),
    ],
    "logarithms": [
        One(
            (
                "-log(sqrt(2) - 1)/log(sqrt(2) + 1)",
                "1 + log(2 + sqrt(3)) + log(2 - sqrt(3))",
                "log(3 + 2*sqrt(2))/(2*log(1 + sqrt(2)))",
                "log(8)/(3*log(2))",
                "2*log(sqrt(6))/(log(2) + log(3))",
            ),
            ("log(sqrt(2) - 1)/log(sqrt(2) + 1)",),
        ),
        One(
            (
                "1 + log(t + sqrt(1 + t^2)) + log(sqrt(1 + t^2) - t)",
                "1 + log((1 + tanh(t))/(1 - tanh(t)))/2 - t",
                "1 + log(sinh(t) + cosh(t)) - t",
                "1 + log(cosh(t) + sqrt(cosh(t)^2 - 1)) - sqrt(t^2)",
                "exp(log(t + sqrt(1 + t^2))) - t - sqrt(1 + t^2) + 1",
            ),
            ("1 + log(t + sqrt(1 + t^2)) - log(sqrt(1 + t^2) - t)", "1 + log(cosh(t) + sqrt(cosh(t)^2 - 1)) - t"),
        ),
    ],
    "definitions": [],
}

# --- hosts: claims that are true where X is 1 -------------------------------------------------------------------------

_H = "((J*Omega1^2 + 2*J*Omega2^2 + 3*J*Omega3^2)/2 + n*gamma1 + n/2*gamma3)"
_SIZES = {"J": ["1", "3/2"], "n": ["2", "1/3"]}
State = tuple[list[str], list[str]]


def _integral(value: str, inertia: list[str], centre: list[str], **said: Any) -> dict[str, Any]:
    top = {"inertia": inertia, "weight": "1", "centre": centre}
    return {"kind": "integral", "parameters": dict(_SIZES), "top": top, "integral": {"value": value, **said}}


def _motion(inertia: list[str], centre: list[str], omega: list[str], gamma: list[str]) -> dict[str, Any]:
    top = {"inertia": inertia, "weight": "1", "centre": centre}
    return {"kind": "motion", "parameters": dict(_SIZES), "top": top, "motion": {"omega": omega, "gamma": gamma}}


def _still_hosts(x: str) -> list[dict[str, Any]]:
    return [
        _integral(
            f"Omega3*J^2 + {_H.replace('2*J*', 'J*').replace('3*J', '3/2*J').replace('n*gamma1 + n/2', 'n')}",
            ["J", f"J*({x})", "3/2*J"],
            ["0", "0", "n"],
        ),
        _integral(f"{_H} + ({x} - 1)*Omega1", ["J", "2*J", "3*J"], ["n", "0", "n/2"]),
        _integral(
            f"(Omega1^2 - Omega2^2 - n/J*({x})*gamma1)^2 + (2*Omega1*Omega2 - n/J*gamma2)^2",
            ["2*J", "2*J", "J"],
            ["n", "0", "0"],
        ),
        _integral(
            f"Omega3*(Omega1^2 + ({x})*Omega2^2) - n/J*Omega1*gamma3",
            ["4*J", "4*J", "J"],
            ["n", "0", "0"],
            where=["4*Omega1*gamma1 + 4*Omega2*gamma2 + Omega3*gamma3"],
        ),
    ]


def _moving_hosts(x: str) -> list[dict[str, Any]]:
    sech, tanh, tilt = "1/cosh(n*t)", "tanh(n*t)", "J*n"
    return [
        _motion(
            ["J", "2", "3"],
            ["0", "0", "J*n^2"],
            [f"2*n*{sech}*({x})", "0", "0"],
            ["0", f"-2*{sech}*{tanh}", f"1 - 2*({sech})^2"],
        ),
        _motion(
            ["J", "J", "3/2*J"],
            ["0", "0", f"{tilt}*(3/2*(2 + n*3/5) - n*3/5)"],
            ["n*4/5*sin(2*t)", f"n*4/5*cos(2*t)*({x})", "2 + n*3/5"],
            ["4/5*sin(2*t)", "4/5*cos(2*t)", "3/5"],
        ),
        _motion(
            ["2*J", "3*J", "J"],
            ["(4*n^2*J + 1)*3/5", "(6*n^2*J + 2)*4/5 - 8/5 + 4/5", "0"],
            ["n*sqrt(2)*3/5", "n*sqrt(2)*4/5", "0"],
            [f"3/5*({x})", "4/5", "0"],
        ),
    ]


def _upright(x: str) -> dict[str, Any]:
    """Holds wherever X is a constant."""
    return _motion(["J", "J", "n"], ["0", "0", "3"], ["0", "0", f"n*({x})"], ["0", "0", "1"])


def renamed(table: dict[str, Any], shift: int) -> dict[str, Any]:
    """The same claim with its axes renamed, an even permutation."""

    def turned(three: list[str]) -> list[str]:
        return [three[(i - shift) % 3] for i in range(3)]

    def words(text: str) -> str:
        for name in ("Omega", "gamma"):
            for i in range(3):
                text = text.replace(f"{name}{i + 1}", f"{name}<{(i + shift) % 3 + 1}>")
        return text.replace("<", "").replace(">", "")

    top = table["top"] | {part: turned(table["top"][part]) for part in ("inertia", "centre")}
    if "motion" in table:
        return table | {"top": top, "motion": {part: turned(texts) for part, texts in table["motion"].items()}}
    said = dict(table["integral"])
    said["value"] = words(said["value"])
    if "where" in said:
        said["where"] = [words(text) for text in said["where"]]
    definitions = {name: words(text) for name, text in table.get("definitions", {}).items()}
    return table | {"top": top, "integral": said} | ({"definitions": definitions} if definitions else {})


def _hosted(family: str, one: One, x: str, expected: str, turn: int, changes: dict[str, Any]) -> Claim:
    moving = "t" in x.replace("sqrt", "").replace("tan", "").replace("cot", "").replace("tanh", "")
    hosts = _moving_hosts(x) if moving or one.domain != "all" else [*_still_hosts(x), *_moving_hosts(x)]
    table = renamed(hosts[turn % len(hosts)], turn % 3)
    said = {"assume": list(one.assume), "relations": list(one.relations)} | changes
    table = table | {"name": family, "domain": one.domain, **said}
    table["assume"] = [*table["assume"], "J > 0", "n > 0"]
    table["parameters"] = _SIZES | one.parameters | changes.get("parameters", {})
    return Claim(family, table, expected)


def hosted_claims() -> Iterator[Claim]:
    """Every formula that is 1 in a host, and every one that is not."""
    turn = 0
    for family, ones in ONES.items():
        for one in ones:
            for x in one.right:
                turn += 1
                yield _hosted(family, one, x, "holds", turn, {})
            for wrong in one.wrong:
                turn += 1
                x, changes = (wrong, {}) if isinstance(wrong, str) else wrong
                yield _hosted(family, one, x, "not holds", turn, changes)


# --- claims that are not hosts --------------------------------------------------------------------------------------


def _claim(family: str, table: dict[str, Any], expected: str, about: str = "heavy_top", **changes: Any) -> Claim:
    table = {"name": family, **table, **{k: v for k, v in changes.items() if k != "parameters"}}
    table["parameters"] = {**table.get("parameters", {}), **changes.get("parameters", {})}
    return Claim(family, table, expected, about)


def defined_claims() -> Iterator[Claim]:
    """First integrals times constants that are defined only in an order of the parameters."""
    energy = "((I1*Omega1^2 + I2*Omega2^2 + I3*Omega3^2)/2 + x*gamma1 + z*gamma3)"
    area = "(I1*Omega1*gamma1 + I2*Omega2*gamma2 + I3*Omega3*gamma3)"
    sizes = {"I1": ["5", "9"], "I2": ["4", "7"], "I3": ["2", "3"], "x": ["1", "-1"], "z": ["1/2", "2"]}
    chains = (["I1 > I2", "I2 > I3"], ["I3 < I2", "I2 < I1"], ["I2 > I3", "I1 > I2"], ["I1 > I2 > I3"])
    right = (
        "sqrt(I1 - I3)",
        "1/(I1 - I3)",
        "log(I1/I3)",
        "sqrt((I1 - I3)/(I1 - I2))",
        "sqrt(I1^2 - I3^2)",
        "acos(I3/I1)",
        "sqrt(1/I3 - 1/I1)",
        "1/sqrt((I1 - I2)*(I2 - I3)*(I1 - I3))",
        "log(I1 - I3)",
        "1/(sqrt(I1) - sqrt(I3))",
        "asin((I2 - I3)/(I1 - I3))",
    )
    for i, x in enumerate(right):
        table = _integral(f"{(energy, area)[i % 2]}*{x}", ["I1", "I2", "I3"], ["x", "0", "z"])
        yield _claim("order", renamed(table, i % 3), "holds", parameters=sizes, assume=chains[i % 4])
    for x, kept in (
        ("sqrt(I1 - I3)", ["I1 > I2"]),
        ("sqrt(I3 - I1)", chains[0]),
        ("1/(I1 - I2 - I3)", chains[0]),
        ("log(I1 - 2*I3)", chains[0]),
        ("1/(I1 - 2*I3)", chains[0]),
        ("acos(I1/I3)", chains[0]),
    ):
        table = _integral(f"{energy}*{x}", ["I1", "I2", "I3"], ["x", "0", "z"])
        yield _claim("order", table, "not holds", parameters=sizes, assume=kept)
    bodies = (["I1 < I2 + I3", "I2 < I1 + I3", "I3 < I1 + I2"], "sqrt((I1 + I2 - I3)*(I1 + I3 - I2)*(I2 + I3 - I1))")
    table = _integral(f"{area}*{bodies[1]}", ["I1", "I2", "I3"], ["x", "0", "z"])
    yield _claim("order", table, "holds", parameters=sizes, assume=bodies[0])
    yield _claim("order", table, "not holds", parameters=sizes, assume=bodies[0][:2])


def saturated_claims() -> Iterator[Claim]:
    """Invariant relations and integrals that need a polynomial divided out that a fact keeps from 0."""
    hess = {"a": "9", "b": "5", "c": "4", "x": "4", "z": "3"}
    section = "a*(b - c)*x^2 - c*(a - b)*z^2"
    for i, (inertia, values, relation, value, assumed) in enumerate(
        [
            (["a", "b", "c"], hess, section, "a*x*Omega1 + c*z*Omega3", []),
            (["a", "b", "c"], hess, section, "a*x*Omega1 + c*z*Omega3", ["z > 0"]),
            (["a", "b", "c"], hess, section, "a*x*Omega1 + c*z*Omega3", ["x*z > 0"]),
            (["a", "b", "c"], hess, section, "a*x*Omega1 + c*z*Omega3", ["a > b", "b > c"]),
            (["a", "b", "c"], hess, section, "a*x/z*Omega1 + c*Omega3", ["z^2 > 0"]),
            (["a", "b", "c"], hess, section, "Omega1 + c*z/(a*x)*Omega3", ["x < 0"])
            if False
            else (["a", "b", "c"], hess | {"x": "-4"}, section, "Omega1 + c*z/(a*x)*Omega3", ["x < 0"]),
            (["2*a", "2*b", "2*c"], hess, section, "a*x*Omega1 + c*z*Omega3", []),
            (
                ["a", "b", "c"],
                hess,
                section,
                "sqrt(a*(b - c))*x*0 + sqrt(a*(a - b))*Omega1 + sqrt(c*(b - c))*Omega3",
                ["a > b", "b > c", "x > 0", "z > 0"],
            ),
            (
                ["1/a", "1/b", "1/c"],
                {"a": "1/9", "b": "1/5", "c": "1/4", "x": "4", "z": "3"},
                "(c - b)*x^2 - (b - a)*z^2",
                "x*Omega1/a + z*Omega3/c",
                ["a > 0", "b > 0", "c > 0"],
            ),
            (
                ["1/a", "1/b", "1/c"],
                {"a": "1/9", "b": "1/5", "c": "1/4", "x": "4", "z": "3"},
                "(c - b)*x^2 - (b - a)*z^2",
                "x*Omega1/a + z*Omega3/c",
                ["a*b > 0"],
            ),
        ]
    ):
        table = _integral(value, inertia, ["x", "0", "z"]) | {"kind": "relation"}
        table["parameters"] = {}
        yield _claim("facts", renamed(table, i % 3), "holds", parameters=values, relations=[relation], assume=assumed)
        wrong = table | {
            "integral": {"value": value.replace("+ c", "- c").replace("+ sqrt(c", "- sqrt(c").replace("+ z", "- z")}
        }
        yield _claim(
            "facts", renamed(wrong, i % 3), "not holds", parameters=values, relations=[relation], assume=assumed
        )
    equal = [
        ("(1 - g^2)*(a - b)", "1 > g^2"),
        ("g*a - g*b", "g < 0"),
        ("(g^2 + g)*(a - b)", "g > 0"),
        ("(a - b)*(g - h)", "g > h"),
        ("(a*g - 1)*(a - b)", "a*g > 1"),
        ("(2 - g)*(g - 3)*(a - b)", "g < 1"),
        ("(1 - g^2)*(a - b)^2", "1 > g^2"),
        ("(a - b)*(g^2 + h^2)", "g^2 + h^2 > 0"),
        ("g*h*(a - b)", "g*h < 0"),
        ("(1 - g^4)*(a^2 - b^2)", "1 > g^2"),
        ("sqrt(g)*(a - b)", "g > 0"),
        ("(exp(g) - 1)*(a - b)", "g > 0"),
        ("(g - 1)*(a - b)", "sqrt(g) > 1"),
        ("(a - b)/(1 - g)", "1 > g"),
    ]
    for i, (relation, fact) in enumerate(equal):
        negative = "g < " in fact or "g*h <" in fact
        g = "-1/2" if negative else "9" if ("*g" in fact or "sqrt" in fact) else "1/2"
        table = _integral("Omega3", ["a", "b", "c"], ["0", "0", "1"])
        table["parameters"] = {}
        values = {"a": ["2", "3"], "b": ["2", "3"], "c": "1", "g": g, "h": "1/3"}
        yield _claim("facts", renamed(table, i % 3), "holds", parameters=values, relations=[relation], assume=[fact])
        if relation not in ("sqrt(g)*(a - b)", "(a - b)/(1 - g)"):
            yield _claim(
                "facts", renamed(table, i % 3), "not holds", parameters=values, relations=[relation], assume=[]
            )
    chaplygin = _integral("(Omega3*(Omega1^2 + Omega2^2) - n/J*Omega1*gamma3)", ["4*J", "4*J", "J"], ["n", "0", "0"])
    for i, (factor, fact) in enumerate(
        [("(1 - g^2)", "1 > g^2"), ("g", "g > 0"), ("(2 + g)", "g > -1"), ("(g^2 - 4)", "g < 1")]
    ):
        for assumed in ([fact, "g > -1"], []):
            table = chaplygin | {
                "integral": chaplygin["integral"]
                | {"where": [f"{factor}*(4*Omega1*gamma1 + 4*Omega2*gamma2 + Omega3*gamma3)"]}
            }
            yield _claim(
                "facts",
                renamed(table, i % 3),
                "holds" if assumed else "not holds",
                parameters={"g": "1/2"},
                assume=assumed,
            )


def side_conditions() -> Iterator[Claim]:
    """Side conditions that the flow keeps, and such that it leaves, with a witness."""
    free, general, lagrange = (
        (["3*J", "2*J", "J"], ["0", "0", "0"]),
        (["3*J", "2*J", "J"], ["n", "0", "n/2"]),
        (["2*J", "2*J", "J"], ["0", "0", "n"]),
    )
    kept = [
        (lagrange, "Omega1*gamma1 + Omega2*gamma2", ["Omega3"]),
        (free, "Omega3", ["Omega1", "Omega2"]),
        (free, "Omega1", ["Omega2", "Omega3"]),
        ((["2*J", "3*J", "J"], ["n", "0", "0"]), "Omega1", ["Omega2", "n*gamma3 - J*Omega1*Omega3"]),
        ((["2*J", "3*J", "J"], ["n", "0", "0"]), "J*Omega3^2/2 + n*gamma1", ["Omega2", "n*gamma3 - J*Omega1*Omega3"]),
        (general, "J*Omega2^2 + n*gamma1 + n/2*gamma3", ["Omega1", "Omega3", "gamma2"]),
        (general, "J*Omega2^2 + n*gamma1 + n/2*gamma3", ["Omega1^2 + Omega3^2", "gamma2^3"]),
        (
            (["2*J", "2*J", "J"], ["n", "0", "0"]),
            "4*Omega1^2 + Omega3^2",
            ["Omega1^2 - Omega2^2 - n/J*gamma1", "2*Omega1*Omega2 - n/J*gamma2"],
        ),
    ]
    for i, ((inertia, centre), value, where) in enumerate(kept):
        yield _claim(
            "where", renamed(_integral(value, inertia, centre, where=where), i % 3), "holds", assume=["J > 0", "n > 0"]
        )
    left = [
        (general, "Omega2", ["Omega1"]),
        (free, "Omega3", ["Omega1"]),
        (general, "gamma1", ["Omega2"]),
        (general, "gamma3", ["gamma1"]),
        (lagrange, "Omega3", ["Omega1"]),
        (lagrange, "Omega3", ["gamma1 - gamma2"]),
        (general, "Omega3^2", ["Omega1", "Omega2"]),
        (free, "Omega2^2", ["Omega1 - Omega3"]),
        (lagrange, "Omega3", ["Omega1^2 + Omega2^2 - 1"]),
        (lagrange, "Omega3", ["3*gamma3 - 1"]),
        (general, "Omega1^2", ["2*Omega2 - 1"]),
        ((["2*J", "2*J", "J"], ["n", "0", "0"]), "Omega3", ["Omega1^2 - Omega2^2 - n/J*gamma1"]),
        (lagrange, f"{_H.replace('2*J*', 'J*').replace('3*J', 'J')}*0 + gamma1^2 + gamma2^2 + gamma3^2", ["gamma2"]),
        (lagrange, "2*Omega1*gamma1 + 2*Omega2*gamma2 + Omega3*gamma3", ["Omega2"]),
        (free, "gamma1^2 + gamma2^2 + gamma3^2", ["exp(Omega1) - 1"]),
        (general, "gamma1^2 + gamma2^2 + gamma3^2", ["Omega1*Omega2*Omega3"]),
    ]
    for i, ((inertia, centre), value, where) in enumerate(left):
        yield _claim(
            "where",
            renamed(_integral(value, inertia, centre, where=where), i % 3),
            "refuted",
            assume=["J > 0", "n > 0"],
        )


def _quaternion_precession() -> dict[str, Any]:
    """A regular precession through the parameters of Euler and Rodrigues: 25 definitions."""
    definitions = {
        "half": "atan(h)",
        "c0": "1/sqrt(1 + h^2)",
        "s0": "h/sqrt(1 + h^2)",
        "u": "(n*t + 2*t)/2",
        "v": "(n*t - 2*t)/2",
        "q0": "c0*cos(u)",
        "q1": "s0*cos(v)",
        "q2": "s0*sin(v)",
        "q3": "c0*sin(u)",
        "n0": "q0^2 + q3^2",
        "n1": "q1^2 + q2^2",
        "norm": "n0 + n1",
        "g1": "2*(q1*q3 - q0*q2)",
        "g2": "2*(q0*q1 + q2*q3)",
        "g3": "(n0 - n1)/norm",
        "p1": "g1/norm",
        "p2": "g2/norm",
        "p3": "g3/1",
        "w1": "n*p1",
        "w2": "n*p2",
        "w3": "n*p3 + 2",
        "size": "sqrt(p1^2 + p2^2 + p3^2)",
        "e1": "p1/size",
        "e2": "p2/size",
        "e3": "p3/size",
    }
    tilt = "(1 - h^2)/(1 + h^2)"
    table = _motion(
        ["J", "J", "3/2*J"], ["0", "0", f"n*J*(3/2*(2 + n*{tilt}) - n*{tilt})"], ["w1", "w2", "w3"], ["e1", "e2", "e3"]
    )
    return table | {
        "definitions": definitions,
        "parameters": _SIZES | {"h": ["1/2", "1/3"]},
        "assume": ["J > 0", "n > 0", "h > 0"],
    }


def defined_in_steps() -> Iterator[Claim]:
    """Formulas through some 25 definitions."""
    steps = 24
    chains = {
        "d0 = 1 + t^2; d = D*(1 + t^2)/(1 + t^2)": (
            "1 + t^2",
            "{0}*(2 + t^2 + sin(t))/(2 + t^2 + sin(t))",
            "{0}/(1 + t^2)",
        ),
        "roots": ("sqrt(1 + t^2)", "sqrt(1 + {0}^2)", f"{{0}}/sqrt({steps} + 1 + t^2)"),
        "mean": (
            "1 + exp(t)",
            "({0} + 1 + exp(t))^2/(2*{0} + 2*(1 + exp(t)))",
            "{0}/(1 + exp(t))",
        ),
        "sums": ("sin(t)^2", "{0} + sin(t)^2 + cos(t)^2", f"{{0}} - sin(t)^2 - {steps - 1}"),
        "quotients": ("exp(t)", "{0}*(1 + exp(t))^2/(1 + 2*exp(t) + exp(2*t))", "{0}*exp(-t)"),
        "tanh": ("tanh(t)", "({0} + tanh(t))*(1 + {0}*tanh(t))/(1 + {0}*tanh(t))/2", "1 + {0} - tanh(t)"),
        "Moebius": ("2 + t^2", "1 + 1/(1 + 1/({0} - 1) - 1)", "{0}/(2 + t^2)"),
        "products": ("sqrt(2)", "{0}*(sqrt(3) + sqrt(2))*(sqrt(3) - sqrt(2))", "{0}/sqrt(2)"),
        "circle": ("cos(t)", "({0}*(2 + sin(t)^2) + cos(t))/(4 - cos(t)^2)", "1 + {0} - cos(t)"),
    }
    for i, (first, step, x) in enumerate(chains.values()):
        definitions = {"d0": first}
        for k in range(1, steps + 1):
            definitions[f"d{k}"] = step.format(f"d{k - 1}")
        x = x.format(f"d{steps}")
        for expected, formula in (("holds", x), ("not holds", f"{x} + {x}/100 - 1/200")):
            hosts = _moving_hosts(f"({formula})")
            table = renamed(hosts[i % 3], i % 3) | {"definitions": definitions, "assume": ["J > 0", "n > 0"]}
            yield _claim("definitions", table, expected)
    links = [
        "{0}*({1}) + {1}",
        "({0})^2/(1 + ({0})^2) + {1}",
        "sqrt(1 + {0}^2) + {1}",
        "sin({0}) + {1}",
        "exp(-{0}^2)*{1}",
        "({0} + {1})*({0} - {1})",
        "{0}^2 + {1}",
    ]
    area = "(J*Omega1*gamma1 + 2*J*Omega2*gamma2 + 3*J*Omega3*gamma3)"
    for i, link in enumerate(links):
        for extra, expected in (("", "holds"), (" + Omega1", "not holds")):
            definitions = {"d0": _H, "C0": area + extra}
            for k in range(1, steps):
                definitions[f"d{k}"] = link.format(f"d{k - 1}", "C0")
            table = _integral(f"d{steps - 1}", ["J", "2*J", "3*J"], ["n", "0", "n/2"]) | {"definitions": definitions}
            yield _claim("definitions", renamed(table, i % 3), expected, assume=["J > 0", "n > 0"])
    table = _quaternion_precession()
    for i in range(3):
        yield _claim("definitions", renamed(table, i), "holds")
    definitions = {"c0": "cos(n*t/64)", "s0": "sin(n*t/64)"}
    for k in range(1, 7):
        definitions |= {f"c{k}": f"c{k - 1}^2 - s{k - 1}^2", f"s{k}": f"2*s{k - 1}*c{k - 1}"}
    for end, expected in (("s6", "holds"), ("-s6", "not holds")):
        table = _motion(["3*J", "3*J", "J"], ["0", "0", "0"], [f"{end}", "c6", "0"], ["0", "0", "1"])
        table = _motion(["J", "J", "2*J"], ["0", "0", "0"], ["c6", end, "n"], ["c6/D", f"{end}/D", "2*n/D"])
        yield _claim(
            "definitions",
            table | {"definitions": definitions | {"D": "sqrt(1 + 4*n^2)"}},
            expected,
            assume=["J > 0", "n > 0"],
        )


def classical_claims() -> Iterator[Claim]:
    """Motions of the classical cases with parameters, disguised."""
    circle = {"p": ["3/5", "5/13"], "q": ["4/5", "12/13"]}
    sizes = {"I1": ["3", "2"], "I3": ["2", "5/2"], "n": ["1", "3/2"]}
    for root in ("sqrt(1 - p^2)", "q"):
        for end, expected in (("", "holds"), (" + 1/10", "not holds")):
            definitions = {
                "r": root,
                "I2": "I1*r^2 + I3*p^2",
                "D": "I1 - I2 + I3",
                "k": f"p*r*(I1 - I3){end}",
                "S": "sqrt(D^2 + k^2)",
                "s": "sin(n*t)",
                "c": "cos(n*t)",
            }
            omega = ["n*(p + r*s)", "n*c", "n*(r - p*s)"]
            gamma = ["(D*r*s - k*c*r*c - k*s*p)/S", "(D*c + k*c*s)/S", "(-D*p*s + k*c*p*c - k*s*r)/S"]
            table = _motion(["I1", "I2", "I3"], ["n^2*S*p", "0", "n^2*S*r"], omega, gamma)
            table |= {"definitions": definitions, "parameters": sizes | circle, "relations": ["p^2 + q^2 - 1"]}
            yield _claim("classical", table, expected, assume=["p > 0", "q > 0", "n > 0", "I1 > 0", "I3 > 0"])
    for h, expected in (("J*(p^2 + n^2/4)", "holds"), ("J*(p^2 - n^2/4)", "not holds")):
        for sech in (
            "1/cosh(n*t/2)",
            "sqrt(1 - tanh(n*t/2)^2)",
            "cos(2*atan(tanh(n*t/4)))",
            "sqrt(2/(1 + cosh(n*t)))",
            "2*exp(n*t/2)/(1 + exp(n*t))",
        ):
            x = f"(n*{sech})"
            omega, gamma = ["p", "0", x], [f"1 - J*{x}^2/(2*N)", f"J*n/2*{x}*tanh(n*t/2)/N", f"J*p*{x}/N"]
            table = _motion(["2*J", "3*J", "J"], ["N", "0", "0"], omega, gamma) | {
                "definitions": {"N": h},
                "parameters": _SIZES | {"p": ["2", "3"]},
            }
            yield _claim(
                "classical", table, expected, assume=["J > 0", "n > 0", "p > n/2" if expected == "holds" else "p > n"]
            )
    table = _motion(
        ["a", "b", "c"],
        ["(m^2*a + k)*x", "(m^2*b + k)*y", "(m^2*c + k)*z"],
        ["m*x", "m*y", "m*sqrt(1 - x^2 - y^2)"],
        ["x", "y", "z"],
    )
    staude = {
        "a": ["3", "2"],
        "b": ["2", "3"],
        "c": ["1", "1"],
        "m": "2",
        "k": "1",
        "x": ["2/3", "1/3"],
        "y": ["1/3", "2/3"],
        "z": ["2/3", "2/3"],
    }
    for sign, expected in (("z > 0", "holds"), ("a > 0", "not holds")):
        yield _claim(
            "classical",
            table | {"parameters": {}},
            expected,
            parameters=staude,
            relations=["x^2 + y^2 + z^2 - 1"],
            assume=[sign],
        )
    for turn, expected in (("(b - a)/a*m*t", "holds"), ("(a - b)/a*m*t", "not holds")):
        for size in (
            "sqrt(a^2*k^2 + b^2*m^2)",
            "sqrt((a*k + b*m)^2 - 2*a*b*k*m)",
            "(sqrt(2)*sqrt((a^2*k^2 + b^2*m^2)/2))",
        ):
            omega = [f"k*cos({turn})", f"k*sin({turn})", "m"]
            gamma = [f"a*k*cos({turn})/{size}", f"a*k*sin({turn})/{size}", f"b*m/{size}"]
            table = _motion(["a", "a", "b"], ["0", "0", "0"], omega, gamma)
            values = {"a": ["1", "2"], "b": ["3/2", "1/2"], "k": ["1", "3/4"], "m": ["2", "5/3"]}
            yield _claim("classical", table | {"parameters": values}, expected, assume=["k > 0", "m > 0"])
    rate = "k*m/b"
    for sech, tanh, expected in (
        ("sech({})", "tanh({})", "holds"),
        ("cos(asin(tanh({0})))", "sin(atan(sinh({0})))", "holds"),
        ("sqrt(1 - tanh({0})^2)", "(2*atan(exp({0})) - atan(sinh({0})))*2/pi*tanh({0})", "holds"),
        ("sech({})", "-tanh({})", "not holds"),
    ):
        s, c = tanh.format(f"({rate}*t/2)"), sech.format(f"({rate}*t/2)")
        top = {"inertia": ["m + b", "m + b", "b"], "weight": "1", "centre": ["0", "1", "0"], "rotor": f"{rate}/2"}
        motion = {"omega": [f"-k*{s}*{c}", f"k*({s})^2", f"k*(m + b)/b*{c}"], "gamma": [f"-{s}*{c}", f"({s})^2", c]}
        values = {"k": ["1", "3/4"], "m": ["2", "5/3"], "b": ["3/2", "1/2"]}
        yield _claim(
            "classical",
            {"kind": "motion", "top": top, "motion": motion, "parameters": values},
            expected,
            "gyrostat",
            assume=["k > 0", "m > 0", "b > 0"],
        )


def claims() -> Iterator[Claim]:
    """All of them."""
    for make in (hosted_claims, defined_claims, saturated_claims, side_conditions, defined_in_steps, classical_claims):
        yield from make()


# --- what is counted ------------------------------------------------------------------------------------------------


class StoppedError(Exception):
    """The time of a claim is over."""


def _stop(*_: object) -> None:
    raise StoppedError


def verdict(claim: Claim) -> tuple[str, str]:
    """(verdict, what leaves it undecided); ``stopped`` after as many seconds as the command gives an audit."""
    before = signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        report = audit_claim(claim_from_table(claim.table, claim.family), system(claim.about))
    except HeavyTopError as error:
        return "refused", error.cause
    except StoppedError:
        return "stopped", f"after {SECONDS} s of the processor"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    texts = [
        f"{c.text} ({c.reason})" for row in report.rows if row.holds is None for c in row.conditions if not c.discharged
    ]
    return report.verdict, "; ".join(
        dict.fromkeys([*texts, *(row.residual for row in report.rows if row.holds is None)])
    )


def is_fault(expected: str, found: str) -> bool:
    """A verdict that is false, not one that is left open."""
    return found == "refuted" if expected == "holds" else found == "holds"


def main() -> None:
    """Prints the counts of each family, each fault, and each claim that is not decided."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--family")
    parser.add_argument("--every", type=int, default=1)
    options = parser.parse_args()
    counts: Counter[tuple[str, str, str]] = Counter()
    slowest, where = 0.0, ""
    for claim in list(claims())[:: options.every]:
        if options.family not in (None, claim.family):
            continue
        begin = time.process_time()
        found, reason = verdict(claim)
        seconds = time.process_time() - begin
        counts[claim.family, claim.expected, found] += 1
        if seconds > slowest:
            slowest, where = seconds, str(claim.table)[:300]
        is_missed = found != claim.expected and claim.expected != "not holds"
        if is_fault(claim.expected, found) or found == "stopped" or is_missed:
            said = claim.table.get("motion") or claim.table["integral"]
            about = {name: claim.table.get(name) for name in ("top", "assume", "relations", "domain")}
            label = "FAULT" if is_fault(claim.expected, found) else "open"
            print(label, found, claim.family, f"{seconds:.1f} s", reason[:300], str(said)[:400], about, flush=True)
    for key, number in sorted(counts.items()):
        print(*key, number)
    true = [(key, number) for key, number in counts.items() if key[1] != "not holds"]
    decided = sum(number for (_, expected, found), number in true if expected == found)
    print(f"decided: {decided} of {sum(number for _, number in true)}; slowest {slowest:.1f} s {where}")


if __name__ == "__main__":
    main()
