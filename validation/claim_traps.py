"""Claims that invite a false ``holds``: a family for each way in which a proof can be about less than the claim.

Conditions that the flow leaves, divisors of rates, states off |γ| = 1, data of a top that move, assumptions that leave
a sign open, branches of inverse functions, roots that denest with another sign.  What a claim is worth is known by its
construction, or found by :func:`contradiction`: formulas evaluated as written, in floats, at random parameters and
times, and along orbits that start on the conditions, special starts included.

    python validation/random_claims.py --traps --claims 420 --seed 5

0 false verdicts of 420: 64 hold, 67 refuted, 96 refused, 193 undecided.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Sequence
from typing import Any

STATE = ("Omega1", "Omega2", "Omega3", "gamma1", "gamma2", "gamma3")
_TRUE, _FALSE, _OPEN, _REFUSED = "true", "false", "open", "refused"
"""What is known of a claim: it is true, false, to be found out by numbers, or no claim about a body."""
Trap = tuple[dict[str, Any], str, str, str]
"""(table, what is known, family, system)."""

_MOMENTS = [("2", "3", "4"), ("3", "3", "2"), ("4", "4", "1"), ("2", "2", "1"), ("3", "4", "5"), ("2", "2", "2")]
_CENTRES = [("1", "2", "3"), ("0", "0", "1"), ("1", "0", "0"), ("0", "0", "0"), ("0", "1", "2"), ("-1", "0", "2")]
_SOME = [["1/2", "-2/3", "3/4", "2/3", "-1/3", "2/3"], ["1", "2", "-1", "3/5", "0", "4/5"]]


def _integrals(inertia: Sequence[str], centre: Sequence[str]) -> list[str]:
    """Energy, area and |γ|² of a top of weight 1."""
    w, g = STATE[:3], STATE[3:]
    energy = " + ".join(f"({i})*{x}^2/2" for i, x in zip(inertia, w, strict=True))
    energy += " + " + " + ".join(f"({c})*{x}" for c, x in zip(centre, g, strict=True))
    area = " + ".join(f"({i})*{x}*{y}" for i, x, y in zip(inertia, w, g, strict=True))
    return [f"({energy})", f"({area})", "(gamma1^2 + gamma2^2 + gamma3^2)"]


def _integral(
    value: str, where: Sequence[str] = (), inertia: Any = None, centre: Any = None, **parts: Any
) -> dict[str, Any]:
    top = {"inertia": list(inertia or _MOMENTS[0]), "weight": "1", "centre": list(centre or _CENTRES[0])}
    said: dict[str, Any] = {"value": value, "where": list(where)}
    if "states" in parts:
        said["states"] = parts.pop("states")
    return {"name": "trap", "kind": "integral", "top": top | parts.pop("top", {}), "integral": said} | parts


def _upright(spin: str, domain: str = "all", **parts: Any) -> dict[str, Any]:
    """True where ``spin`` is constant."""
    top = {"inertia": ["2", "2", "3"], "weight": "1", "centre": ["0", "0", "1"]}
    motion = {"omega": ["0", "0", spin], "gamma": ["0", "0", "1"]}
    return {"name": "trap", "kind": "motion", "domain": domain, "top": top | parts.pop("top", {}), "motion": motion} | (
        parts
    )


def _renamed(texts: Sequence[str], turn: int) -> list[str]:
    """The axes renamed 1, 2, 3 → 2, 3, 1, ``turn`` times."""

    def one(match: re.Match[str]) -> str:
        return f"{match[1]}{(int(match[2]) - 1 + turn) % 3 + 1}"

    return [re.sub(r"(Omega|gamma)([123])", one, text) for text in texts]


# --- conditions that the flow leaves ---------------------------------------------------------------------------------


def one_sided(draw: random.Random) -> Trap:
    """An invariant plane of pendulum motions, and half of it: the rate of the half is divided by what is 0 at its edge.

    Where |u| = u the rate is 0, and at u = 0 it has none: the motion crosses.
    """
    turn = draw.randrange(3)
    u = draw.choice(["Omega1", "gamma2", "gamma3", "(Omega1*gamma3)", "(gamma2 + gamma3)"])
    half = draw.choice(
        [
            "sqrt({0}^2) - {0}",
            "sqrt({0}^2 + Omega2^2) - {0}",
            "sqrt({0}^2) + {0}",
            "sqrt({0}^2 + gamma1^2)*3 - 3*{0}",
            "{0}*sqrt({0}^2) - {0}^2",
            "sqrt({0}^4 + Omega3^2) - {0}*sqrt({0}^2)",
            "({0}^2)^(3/2) - {0}^3",
        ]
    ).format(u)
    value = draw.choice(["Omega2", "gamma1^2", "1", "Omega3*gamma2 + 5", "sqrt(1 + gamma1^2)"])
    where = _renamed(["Omega2", "Omega3", "gamma1", half], turn)
    moments, centre = ["2", "3", "4"], ["0", "0", "1"]
    inertia = moments[-turn:] + moments[:-turn]
    table = _integral(_renamed([value], turn)[0], where, inertia, centre[-turn:] + centre[:-turn])
    return table, _FALSE, "one-sided", "heavy_top"


def not_kept(draw: random.Random) -> Trap:
    """A constant at each point of a set that most motions leave; now and then it is true."""
    x, y = draw.sample(STATE, 2)
    inertia, centre = draw.choice(_MOMENTS), draw.choice(_CENTRES)
    energy, area, _ = _integrals(inertia, centre)
    condition = draw.choice(
        [
            "{0}",
            "{0}*{1}",
            "{0}^2",
            "{0}^2 + {1}^2",
            "{0} - {1}",
            "{2}*{0}",
            "{2} - 1",
            "sin({2})",
            "{2}^2 + {0}^2",
            "exp({0}*{1}) - 1",
            "sqrt({0}^2 + {1}^2) - 1",
            "atan({0})",
            "cos({0}) - 1",
            "{3} - {0}^2",
            "{0}/(1 + {1}^2)",
        ]
    ).format(x, y, area, energy)
    value = draw.choice(["{0}", "{1}", "{0}^2*{1}", "{2} + {0}", "{2}", "{3}*{0} + {2}", "sqrt({0}^2) + {1}"])
    kind = draw.choice(["integral", "integral", "relation"])
    table = _integral(value.format(x, y, area, energy), [condition], inertia, centre, kind=kind)
    return table, _OPEN, "not kept", "heavy_top"


def needs_left(draw: random.Random) -> Trap:
    """A first integral, as a formula that is not defined wherever the motion goes."""
    inertia, centre = draw.choice(_MOMENTS[:5]), draw.choice(_CENTRES)
    energy, area, square = _integrals(inertia, centre)
    k = draw.choice([energy, area, f"({energy} + {area})", f"({energy} + {square})"])
    u = draw.choice(["Omega1", "gamma2", "Omega3", "(Omega1 + gamma2)", "(gamma1 - 1/2)", "(Omega1*gamma2)"])
    value = draw.choice(
        [
            "sqrt({0}/{1})^2*{1}",
            "{0} + 0*sqrt({1})",
            "{0} + 0*log({1})",
            "{0} + 0*asin({1})",
            "exp(log({1}*{0}))/{1}",
            "sqrt({1}*{0})^2/{1}",
            "sqrt({0}*{1}^2)^2/{1}^2 + 0*sqrt({1} + 3)",
            "{0} + sqrt({1}^3)^2/{1}^3",
            "sqrt({1})^4/{1}^2 + {0}",
            "log({0}/{1}) + log({1}/2)",
            "{0}*sqrt({1} + 1/2)^2/({1} + 1/2)",
        ]
    ).format(k, u)
    spin_is_constant = "Omega3" in u and inertia[0] == inertia[1] and centre[:2] == ("0", "0")
    is_defined = u == "gamma2" and "asin" in value  # |γ2| is at most 1
    # a free body's energy is positive and so is γi + 3: the roots are real, and where the divisor is 0 there is a limit
    limit = "gamma" in u and "Omega" not in u and value.endswith("+ 3)") and centre == ("0", "0", "0") and area not in k
    if spin_is_constant or is_defined or limit:
        return _integral(value, (), inertia, centre), _OPEN, "needs", "heavy_top"
    return _integral(value, (), inertia, centre, states=_SOME), _FALSE, "needs", "heavy_top"


def thin_domain(draw: random.Random) -> Trap:
    """A radicand with a square factor: it is ≥ 0 also where that is 0, and the other factor negative."""
    inertia, centre = draw.choice(_MOMENTS[:4]), draw.choice(_CENTRES[:2])
    energy, area, _ = _integrals(inertia, centre)
    c, turn = draw.choice(["2", "3", "5", "1/2"]), draw.choice(["Omega1", "gamma2", "Omega1*gamma3"])
    q = f"({area}^2 - {c})"
    value = draw.choice(
        [
            "{1} + 0*sqrt({0}^2*{2}) + {3}*(1 - sqrt({2}^2)/{2})",
            "sqrt({0}^2*{2})*0 + {3}*(sqrt({2}^2) - {2})",
            "{3}*(sqrt({2}^2) - {2}) + sqrt({0}^4*{2})",
            "{3}*(sqrt({2}^2) - {2})*(1 + sqrt({0}^2*{1}^2*{2}))",
        ]
    ).format(area, energy, q, turn)
    return _integral(value, (), inertia, centre, states=_SOME), _FALSE, "thin domain", "heavy_top"


# --- bodies ---------------------------------------------------------------------------------------------------------


def off_sphere(draw: random.Random) -> Trap:
    """What is defined, or 0, only where |γ| is not 1; and what is constant only where it is."""
    inertia, centre = draw.choice(_MOMENTS), draw.choice(_CENTRES)
    energy, area, square = _integrals(inertia, centre)
    c = draw.choice(["2", "4", "1/2", "3"])
    k = draw.choice([energy, area])
    constant = inertia[1] == inertia[2] and centre[1:] == ("0", "0")  # Ω1
    value, kind, known = draw.choice(
        [
            (f"{k}/({square} - 1)", "integral", _FALSE),
            (f"sqrt({square} - {c} - 1) + {k}", "integral", _FALSE),
            (f"log(1/2 - {square}) + {k}", "integral", _FALSE),
            (f"{k} + 0*asin({square} + {c})", "integral", _FALSE),
            (f"{square} - {c}", "relation", _FALSE),
            (f"sqrt({square}) - {c}", "relation", _FALSE),
            (f"{k}^2 + {square} + {c}", "relation", _FALSE),
            (f"{k} + Omega1*({square} - 1)", "integral", _TRUE),
            (f"{k}*{square}^2 + ({square} - 1)^2*gamma2", "integral", _TRUE),
            (f"exp({k}) + Omega2*(sqrt({square}) - 1)", "integral", _TRUE),
            (f"{k} + Omega1*({square} - {c})", "integral", _OPEN if constant else _FALSE),
        ]
    )
    return _integral(value, (), inertia, centre, kind=kind), known, "off the sphere", "heavy_top"


def moving_top(draw: random.Random) -> Trap:
    """A weight, a moment, a centre or a rotor with the time or the state in it, directly or by definitions."""
    moving = draw.random() < 0.5
    hidden = draw.choice(["t", "sin(t)^2", "1 + t^2", "t/t", "exp(-t)"] if moving else [*STATE, "1 + Omega1^2"])
    definitions = {}
    for index in range(draw.choice([0, 0, 1, 2, 3])):
        definitions[f"d{index}"] = draw.choice(["{0}", "2*({0})", "({0})^2", "1/(2 + ({0})^2)"]).format(hidden)
        hidden = f"d{index}"
    part = draw.choice(["centre", "weight", "inertia", "rotor"])
    top = {
        "centre": {"centre": ["0", "0", hidden]},
        "weight": {"weight": f"1 + {hidden}"},
        "inertia": {"inertia": ["2", "2", f"3 + ({hidden})^2"]},
        "rotor": {"rotor": f"1 + ({hidden}) + ({'t' if moving else 'Omega1'})"},
    }[part]
    about = draw.choice(["heavy_top", "gyrostat"]) if part == "rotor" else "heavy_top"
    if moving:
        return _upright("1", definitions=definitions, top=top), _REFUSED, "moving top", about
    return _integral("1", definitions=definitions, top=top), _REFUSED, "moving top", about


def names(draw: random.Random) -> Trap:
    """A parameter or definition named as a variable, a number or a function; relations between what moves."""
    name = draw.choice(["t", "Omega1", "gamma3", "pi", "sin", "sqrt", "atan2"])
    kind = draw.randrange(4)
    if kind == 0:
        return _upright("1", parameters={name: "1"}), _REFUSED, "names", "heavy_top"
    if kind == 1:
        return _integral("Omega1", definitions={name: "1"}), _REFUSED, "names", "heavy_top"
    formula = draw.choice(["{0}", "{0}^2 - 1", "a*{0}", "{0} - a", "d", "sqrt({0})"])
    variable = draw.choice(["t"] if kind == 2 else STATE)
    parts = {"parameters": {"a": "1"}, "definitions": {"d": f"2*{variable}"}, "relations": [formula.format(variable)]}
    table = _upright("1", **parts) if kind == 2 else _integral("Omega1", **parts)
    return table, _REFUSED, "names", "heavy_top"


def contradictory(draw: random.Random) -> Trap:
    """Assumptions or relations that nothing meets."""
    c = draw.choice(["1", "2", "1/3"])
    assume, relations = draw.choice(
        [
            ([f"a > {c}", "a < 0"], []),
            (["a > b", "b > c", "c > a"], []),
            (["a^2 < 0"], []),
            (["0 > 1"], []),
            ([f"a > {c}"], [f"a + {c}"]),
            ([], ["a^2 + 1"]),
            ([], ["a - 1", "a - 2"]),
            ([], ["a - b", "a - b - 1"]),
            (["a > 0"], ["a^2 + b^2"]),
        ]
    )
    parameters = {"a": draw.choice(["1", "2", "-1", "0"]), "b": draw.choice(["1", "0"]), "c": "0"}
    table = _integral("Omega1", assume=assume, relations=relations, parameters=parameters)
    return table, _REFUSED, "contradictory", "heavy_top"


# --- signs and branches ---------------------------------------------------------------------------------------------

_PARAMETERS = {"a": ["2", "3"], "b": ["1", "2"], "c": ["1/2", "1"], "d": ["1/4", "1/3"]}
_ASSUMED = ["a > b", "b > c", "c > d", "d > 0", "a > 0", "b > 0", "c > 0", "a > 1", "a + b > c", "a*b > c*d", "c < 2"]
_ASSUMED += ["a^2 > b^2", "a > b + c", "d < 1", "a - b > 0", "a > d", "b > d", "a > c", "b + c > d"]


def assumed_sign(draw: random.Random) -> Trap:
    """|p| = p for a polynomial of the parameters, under random assumptions."""
    assume = draw.sample(_ASSUMED, draw.choice([1, 2, 3, 4, 5]))
    terms = []
    for _ in range(draw.choice([1, 2, 2, 3, 4])):
        product = "*".join(draw.choices("abcd", k=draw.choice([1, 1, 2, 2, 3])))
        terms.append(draw.choice(["", "", "2*", "3*", "-", "-2*"]) + product)
    p = "(" + " + ".join(terms).replace("+ -", "- ") + ")"
    value = draw.choice(
        [
            "Omega1*(sqrt({0}^2) - {0})",
            "Omega1*(1 - sqrt({0}^2)/{0})",
            "Omega1*0*sqrt({0})",
            "Omega1*0/{0}",
            "Omega1*0*log({0})",
            "Omega1*(sqrt({0})^2 - {0})",
            "Omega1*(exp(log({0})) - {0})",
        ]
    ).format(p)
    # what is assumed of a moment is that it is positive, and more is not known of it
    inertia = draw.choice([("2", "3", "4"), ("2", "3", "4"), ("a", "a", "a")])
    table = _integral(value, inertia=inertia, assume=assume, parameters=_PARAMETERS)
    return table, _OPEN, "assumed sign", "heavy_top"


def sign_in_time(draw: random.Random) -> Trap:
    """|q| = q for a function of the time."""
    domain = draw.choice(["all", "t<=0", "t>0"])
    u = draw.choice(["t", "a*t", "t/2", "-t", "t - 1", "t + a"])
    functions = ["sin({0})", "cos({0})", "tanh({0})", "exp({0})", "atan({0})", "sech({0})", "({0})", "({0})^2", "{0}^3"]
    functions += ["cosh({0})", "sinh({0})", "sqrt(1 + {0}^2)", "log(1 + {0}^2)", "asin(tanh({0}))", "acos(sech({0}))"]
    terms = [
        f"{draw.choice(['', '2*', '-', '-2*', '1/2*'])}{draw.choice(functions).format(f'({u})')}"
        for _ in range(draw.choice([1, 1, 2, 2]))
    ]
    constant = draw.choice(["0", "1", "2", "3", "-1", "11/7", "pi/2", "1/2", "22/7", "a"])
    q = f"({constant} + {' + '.join(terms)})".replace("+ -", "- ")
    spin = draw.choice(
        [
            "1 + sqrt({0}^2) - {0}",
            "sqrt({0}^2)/{0}",
            "1 + 0*sqrt({0})",
            "1 + 0*log({0})",
            "1 + sqrt({0})^2 - {0}",
            "exp(log({0}))/{0}",
            "{0}/{0}",
            "sqrt({0}^4)/{0}^2",
        ]
    ).format(q)
    table = _upright(spin, domain, parameters={"a": ["1", "2"]}, assume=["a > 0"])
    return table, _OPEN, "sign in time", "heavy_top"


def branches(draw: random.Random) -> Trap:
    """Inverse functions of their functions, inside and outside the range where they are the angle."""
    domain = draw.choice(["all", "t<=0", "t>0"])
    c = draw.choice(["1", "3/2", "11/7", "8/5", "2", "3", "22/7", "4", "1/2", "2*a"])
    w = draw.choice(
        ["{0}*tanh(t)", "{0}*sin(t)", "t*{0}", "{0}*atan(t)", "{0}*sech(t)", "{0} + sech(t)", "{0}*cos(t)^2"]
    )
    w = "(" + w.format(c) + ")"
    x = draw.choice(["t", "sinh(t)", "(t - 1)", "(1 + t^2)", "exp(t)", "(2 + sin(t))", "(a*t)"])
    spin = draw.choice(
        [
            "1 + asin(sin({0})) - {0}",
            "1 + acos(cos({0})) - {0}",
            "1 + atan(tan({0})) - {0}",
            "1 + log(exp({0})) - {0}",
            "1 + atan2(sin({0}), cos({0})) - {0}",
            "1 + acos(cos({0}))^2 - {0}^2",
            "cos(asin({0}))/sqrt(1 - {0}^2)",
            "atan({1}) + atan(1/{1})",
            "1 + atan2({1}, 1) - atan({1})",
            "asin({1}/sqrt(1 + {1}^2)) - atan({1}) + 1",
            "1 + acos(1/sqrt(1 + {1}^2)) - atan({1})",
            "1 + 2*atan({1}) - atan2(2*{1}, 1 - {1}^2)",
            "1 + sqrt({1}^2) - {1}",
            "1 + atan2({1}, -1) - pi + atan({1})",
            "1 + log({1}^2) - 2*log({1})",
            "1 + atan(sinh(t)) - 2*atan(tanh(t/2))",
            "1 + sqrt(cos({0})^2) - cos({0})",
            "1 + atan2(0*t, {1})",
            "1 + sqrt({1}*exp({0})) - sqrt({1})*exp({0}/2)",
        ]
    ).format(w, x)
    table = _upright(spin, domain, parameters={"a": ["1/2", "3/4"]}, assume=["a > 0"])
    return table, _OPEN, "branches", "heavy_top"


def numbers(draw: random.Random) -> Trap:
    """Sums of arcs, nested roots and roots of relations: equal, or equal but for a sign or a multiple of π."""
    p, q = draw.randrange(2, 9), draw.randrange(2, 9)
    r, s = draw.choice([(2, 3), (3, 2), (5, 2), (2, 7), (6, 5), (7, 3)])
    turn = draw.choice(["0", "0", "pi", "-pi", "pi/2", "pi/4", "1e-30"])
    value = draw.choice(
        [
            f"atan(1/{p}) + atan(1/{q}) - atan2({p + q}, {p * q - 1}) + {turn}",
            f"atan({p}) + atan({q}) - atan({p + q}/(1 - {p * q})) + {turn}",
            f"4*atan(1/5) - atan(1/239) - pi/4 + {turn}",
            f"atan(1/2) + atan(1/3) - pi/4 + {turn}",
            f"2*atan(1/{p}) - atan({2 * p}/({p}^2 - 1)) + {turn}",
            f"asin({p}/{p + q}) + acos({p}/{p + q}) - pi/2 + {turn}",
            f"sqrt({r + s} + 2*sqrt({r * s})) - sqrt({r}) - sqrt({s}) + {turn}",
            f"sqrt({r + s} - 2*sqrt({r * s})) - sqrt({r}) + sqrt({s}) + {turn}",
            f"sqrt({r + s} - 2*sqrt({r * s})) - sqrt({s}) + sqrt({r}) + {turn}",
            f"sqrt({r * r + s} + 2*{r}*sqrt({s})) - {r} - sqrt({s}) + {turn}",
            f"sqrt({r * r + s} - 2*{r}*sqrt({s})) - {r} + sqrt({s}) + {turn}",
            f"log({p}*{q}) - log({p}) - log({q}) + {turn}",
            f"sqrt({p})*sqrt({q}) - sqrt({p * q}) + {turn}",
        ]
    )
    return _integral(f"Omega1*({value})"), _OPEN, "numbers", "heavy_top"


def real_roots(draw: random.Random) -> Trap:
    """A relation between parameters that has, or has not, further real roots than the sample."""
    relation, known = draw.choice(
        [
            ("a^3 - 1", _TRUE),
            ("a^2 - 1", _FALSE),
            ("a^3 - a", _FALSE),
            ("a^5 - 1", _TRUE),
            ("a^4 - 1", _FALSE),
            ("(a - 1)*(a^2 + a + 2)", _TRUE),
            ("(a - 1)*(a^2 + a - 2)", _FALSE),
            ("(a - 1)^2 + b^2", _TRUE),
            ("(a - 1)^2 - b^2", _FALSE),
            ("a^2 + b^2 - 1", _FALSE),
            ("exp(a) - exp(1)", _OPEN),
            ("a^3 + a - 2", _TRUE),
            ("sqrt(a) - 1", _TRUE),
            ("sqrt(a^2) - 1", _FALSE),
            ("sin(a - 1)", _FALSE),
        ]
    )
    value = draw.choice(["Omega1*(a - 1)", "Omega1*(a^2 - a)", "Omega1*sin(a - 1)", "Omega1*(exp(a) - exp(1))"])
    known = _TRUE if value == f"Omega1*{relation}" else known
    table = _integral(value, parameters={"a": "1", "b": "0"}, relations=[relation])
    return table, known, "real roots", "heavy_top"


def gyrostats(draw: random.Random) -> Trap:
    """Integrals of the gyrostat with a rotor that is a first integral of it, and with their mistakes."""
    area = "(2*Omega1*gamma1 + 3*Omega2*gamma2 + 4*Omega3*gamma3)"
    square = "(4*Omega1^2 + 9*Omega2^2 + 16*Omega3^2)"
    rotor, known = draw.choice(
        [
            (f"1/{area}", _OPEN),
            (f"{square}", _OPEN),
            ("2", _OPEN),
            (f"sqrt({square})", _OPEN),
            ("sqrt(Omega1^2)/Omega1", _OPEN),
            ("sqrt(gamma2^2)/gamma2*2", _OPEN),
            ("Omega2", _REFUSED),
        ]
    )
    value = draw.choice([square, area, f"{square} + {area}", f"{square}/{area}", "Omega2", f"{square} + Omega1"])
    table = _integral(value, top={"rotor": rotor, "weight": "0"}, states=_SOME)
    return table, known, "gyrostats", "gyrostat"


FAMILIES: list[Callable[[random.Random], Trap]] = [
    one_sided,
    not_kept,
    needs_left,
    thin_domain,
    off_sphere,
    moving_top,
    names,
    contradictory,
    assumed_sign,
    sign_in_time,
    branches,
    numbers,
    real_roots,
    gyrostats,
]


# --- numbers of its own ---------------------------------------------------------------------------------------------


class Undefined(Exception):
    """A formula without a real value at a point."""


def _real(function: Callable[..., float], accepts: Callable[..., bool]) -> Callable[..., float]:
    def inside(*values: float) -> float:
        if not accepts(*values):
            raise Undefined
        return function(*values)

    return inside


_ROUNDING = 1e-12
_FUNCTIONS: dict[str, Any] = {
    **{
        name: getattr(math, name)
        for name in ("exp", "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan", "atan2", "pi")
    },
    "sqrt": _real(lambda x: math.sqrt(max(x, 0.0)), lambda x: x >= -_ROUNDING),
    "log": _real(math.log, lambda x: x > 0),
    "asin": _real(lambda x: math.asin(max(-1.0, min(1.0, x))), lambda x: abs(x) <= 1 + _ROUNDING),
    "acos": _real(lambda x: math.acos(max(-1.0, min(1.0, x))), lambda x: abs(x) <= 1 + _ROUNDING),
    "sech": lambda x: 1 / math.cosh(x),
}
Formula = Callable[[dict[str, float]], float]


def formula(text: str) -> Formula:
    """A formula in floats; raises Undefined where it has no finite real value."""
    code = compile(text.strip().replace("^", "**"), "formula", "eval")

    def value(names: dict[str, float]) -> float:
        try:
            found = eval(code, {**_FUNCTIONS, **names})
        except (ZeroDivisionError, ValueError, OverflowError):
            raise Undefined from None
        if isinstance(found, complex) or not math.isfinite(found):
            raise Undefined
        return float(found)

    return value


def _parameters(table: dict[str, Any], draw: random.Random) -> dict[str, float] | None:
    """Random parameters that meet what is assumed, or the samples where there are relations."""
    given = table.get("parameters", {})
    if table.get("relations"):
        return {name: formula(text if isinstance(text, str) else text[0])({}) for name, text in given.items()}
    bounds = [text.replace("<", ">-").split(">") for text in table.get("assume", [])]
    sides = [
        (formula(left), formula(right.strip().removeprefix("-")), -1 if right.strip()[:1] == "-" else 1)
        for left, right in bounds
    ]
    for _ in range(400):
        found = {name: draw.choice([draw.uniform(-3, 3), draw.uniform(0, 1), draw.uniform(0, 4)]) for name in given}
        try:
            if all(sign * (left(found) - right(found)) > 0 for left, right, sign in sides):
                return found
        except Undefined:
            continue
    return None


def contradiction(table: dict[str, Any], about: str, draw: random.Random, tries: int = 60) -> str:
    """What shows in numbers that the claim does not hold, or ""."""
    for _ in range(tries):
        parameters = _parameters(table, draw)
        if parameters is None:
            return ""
        found = (
            _spin_varies(table, parameters, draw)
            if table["kind"] == "motion"
            else _orbit(table, parameters, draw, about)
        )
        if found:
            return f"{found} at {parameters}"
    return ""


def _spin_varies(table: dict[str, Any], parameters: dict[str, float], draw: random.Random) -> str:
    """Of a top that spins upright."""
    spin, values = formula(table["motion"]["omega"][2]), []
    undefined = 0
    for _ in range(12):
        size = draw.choice([draw.uniform(0.001, 8), draw.uniform(0.001, 1.5)])
        sign = {"t<=0": -1, "t>0": 1, "all": draw.choice([-1, 1])}[table["domain"]]
        try:
            values.append(spin({**parameters, "t": sign * size}))
        except Undefined:
            undefined += 1
    if undefined > 1:
        return "no value at some times"
    return f"spin from {min(values)} to {max(values)}" if max(values) - min(values) > 1e-7 else ""


def _orbit(table: dict[str, Any], parameters: dict[str, float], draw: random.Random, about: str) -> str:
    """Along a motion that starts on the conditions: what changes, leaves or ends."""
    value = formula(table["integral"]["value"])
    where = [formula(text) for text in table["integral"]["where"]]
    is_relation = table["kind"] == "relation"
    zero = [*where, value] if is_relation else where
    field = _field(table, parameters, about)

    def at(y: list[float]) -> dict[str, float]:
        return {**parameters, **dict(zip(STATE, y, strict=True))}

    y = _start(zero, at, draw)
    if y is None:
        return ""
    try:
        if max(map(abs, field(y))) > 30:  # too fast for these steps
            return ""
        first = value(at(y))
        for direction in (0.01, -0.01):
            z, undefined = y, 0
            for _ in range(150):
                z = _step(field, z, direction / (1 + max(map(abs, field(z))) / 5))
                try:
                    off = max((abs(f(at(z))) for f in zero), default=0.0)
                    change = abs(value(at(z)) - first)
                except Undefined:
                    undefined += 1
                    if undefined > 3:
                        return f"no value along the orbit from {y}"
                    continue
                if off > 1e-4:
                    return f"a condition is left along the orbit from {y}"
                if change > 1e-5 * max(1.0, abs(first)):
                    return f"the value changes along the orbit from {y}"
    except (Undefined, OverflowError):
        return ""
    return ""


def _field(table: dict[str, Any], parameters: dict[str, float], about: str) -> Callable[[list[float]], list[float]]:
    top = table["top"]
    inertia = [formula(text)(parameters) for text in top["inertia"]]
    moment = [formula(top["weight"])(parameters) * formula(text)(parameters) for text in top["centre"]]
    rotor = formula(top.get("rotor", "0"))

    def cross(p: Sequence[float], q: Sequence[float]) -> list[float]:
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    def rate(y: list[float]) -> list[float]:
        omega, gamma = y[:3], y[3:]
        momentum = [i * w for i, w in zip(inertia, omega, strict=True)]
        if about == "gyrostat":
            omega = [omega[0], omega[1] + rotor({**parameters, **dict(zip(STATE, y, strict=True))}), omega[2]]
        torque = [0.0] * 3 if about == "gyrostat" else cross(gamma, moment)
        turned = [(m + n) / i for m, n, i in zip(cross(momentum, omega), torque, inertia, strict=True)]
        return [*turned, *cross(gamma, omega)]

    return rate


def _step(field: Callable[[list[float]], list[float]], y: list[float], h: float) -> list[float]:
    """Of Runge and Kutta, of order 4."""

    def moved(k: list[float], part: float) -> list[float]:
        return [a + part * h * b for a, b in zip(y, k, strict=True)]

    k1 = field(y)
    k2 = field(moved(k1, 0.5))
    k3 = field(moved(k2, 0.5))
    k4 = field(moved(k3, 1.0))
    return [a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(y, k1, k2, k3, k4, strict=True)]


def _start(zero: Sequence[Formula], at: Callable[[list[float]], dict[str, float]], draw: random.Random) -> Any:
    """A state with |γ| = 1 where all of ``zero`` are 0, by Newton's method; some of its components may be 0."""
    import numpy

    fixed = [draw.random() < 0.3 for _ in STATE]
    y = numpy.array([0.0 if rest else draw.uniform(-2, 2) for rest in fixed])

    def residual(z: Any) -> Any:
        return numpy.array([sum(z[3:] ** 2) - 1, *(f(at([float(x) for x in z])) for f in zero)])

    free = [index for index, rest in enumerate(fixed) if not rest]
    try:
        for _ in range(60):
            r = residual(y)
            if max(abs(r)) < 1e-13:
                return [float(x) for x in y]
            columns = []
            for index in free:
                moved = y.copy()
                moved[index] += 1e-7
                columns.append((residual(moved) - r) / 1e-7)
            if not columns:
                return None
            y[free] -= numpy.linalg.lstsq(numpy.array(columns).T, r, rcond=None)[0]
    except (Undefined, numpy.linalg.LinAlgError, OverflowError):
        return None
    return None
