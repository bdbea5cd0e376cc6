"""Claims as papers state them, true and with one planted mistake: components, quadratures, theta functions, attitudes.

Each family is a known solution in one of several equal forms; a mistake is a sign, k for k², another theta function,
a factor 2, n for −n in Π, sn for cn, a constant, a branch.  Whether a claim is true is found without heavytop: mpmath
evaluates its formulas at random parameters that its assumptions admit, motions by differences in time, components and
their angles by an integration of the equations of motion.  A mistake that changes nothing is true by that.

    python validation/stated_claims.py [--claims 300] [--first 0] [--family NAME]

Prints each verdict that is false, each that is undecided with what is missing, and the counts of each family.
"""

from __future__ import annotations

import argparse
import copy
import random
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import mpmath
from mpmath import mpf

from heavytop.errors import InputError
from heavytop.features.claims.audit.audit import audit_claim, claim_from_table
from random_claims import _FUNCTIONS, Undefined, _field, compiled

DIGITS, CLOSE = 30, mpf("1e-9")
_compiled = lru_cache(maxsize=None)(compiled)
Table = dict[str, Any]
Draw = Callable[[random.Random], dict[str, mpf]]
Swap = tuple[str, str, str]
"""A part of the table such as "component.value", a text in it, and the text in its place; "" is the whole part."""


@dataclass(frozen=True)
class Family:
    """A true claim, its equal forms, mistakes, and random parameters that its assumptions admit."""

    table: Table
    same: Sequence[Swap]
    wrong: Sequence[Swap]
    draw: Draw


def _between(rng: random.Random, low: Any, high: Any) -> mpf:
    return low + (high - low) * mpf(rng.uniform(0.1, 0.9))


# --- functions -------------------------------------------------------------------------------------------------------


def _am(u: mpf, m: mpf) -> mpf:
    if m == 1:
        return 2 * mpmath.atan(mpmath.tanh(u / 2))
    quarter = mpmath.ellipk(m)
    turns = mpmath.nint(u / (2 * quarter))
    return turns * mpmath.pi + mpmath.asin(mpmath.ellipfun("sn", u - 2 * turns * quarter, m=m).real)


def _zeta(u: mpf, m: mpf) -> mpf:
    return mpmath.ellipe(_am(u, m), m) - u * mpmath.ellipe(m) / mpmath.ellipk(m)


def _jacobi_theta(index: int) -> Callable[[mpf, mpf], mpf]:
    return lambda u, m: mpmath.jtheta(index, mpmath.pi * u / (2 * mpmath.ellipk(m)), mpmath.qfrom(m=m)).real


def _roots(g2: mpf, g3: mpf) -> tuple[mpf, mpf, mpf]:
    e1, e2, e3 = sorted((mpmath.re(e) for e in mpmath.polyroots([4, 0, -g2, -g3], extraprec=200)), reverse=True)
    if g2**3 <= 27 * g3**2:
        raise Undefined
    return e1, e2, e3


def _wp(u: mpf, g2: mpf, g3: mpf) -> mpf:
    e1, e2, e3 = _roots(g2, g3)
    return e3 + (e1 - e3) / mpmath.ellipfun("sn", mpmath.sqrt(e1 - e3) * u, m=(e2 - e3) / (e1 - e3)).real ** 2


def _wp3(u: mpf, g2: mpf, g3: mpf) -> mpf:
    e1, e2, e3 = _roots(g2, g3)
    return e3 + (e2 - e3) * mpmath.ellipfun("sn", mpmath.sqrt(e1 - e3) * u, m=(e2 - e3) / (e1 - e3)).real ** 2


def _of_lattice(index: int, u: mpf, g2: mpf, g3: mpf) -> tuple[mpf, mpf, mpf, mpf]:
    """η1/ω1, θ'/θ by u, θ and π/(2ω1) of theta 1, or of theta 4 for the argument u + ω3."""
    e1, e2, e3 = _roots(g2, g3)
    m = (e2 - e3) / (e1 - e3)
    half, q = mpmath.ellipk(m) / mpmath.sqrt(e1 - e3), mpmath.qfrom(m=m)
    scale = mpmath.pi / (2 * half)
    theta, slope = (mpmath.jtheta(index, scale * u, q, order).real for order in (0, 1))
    mean = -(scale**2) * (mpmath.jtheta(1, 0, q, 3) / mpmath.jtheta(1, 0, q, 1)).real / 3
    if theta == 0:
        raise Undefined
    return mean, scale * slope / theta, theta, scale


def _wzeta(index: int) -> Callable[[mpf, mpf, mpf], mpf]:
    def value(u: mpf, g2: mpf, g3: mpf) -> mpf:
        mean, slope, _, _ = _of_lattice(index, u, g2, g3)
        return mean * u + slope

    return value


def _wsigma(u: mpf, g2: mpf, g3: mpf) -> mpf:
    if u == 0:
        return u
    mean, _, theta, scale = _of_lattice(1, u, g2, g3)
    q = mpmath.exp(-mpmath.pi * _ratio(g2, g3))
    return mpmath.exp(mean * u**2 / 2) * theta / (scale * mpmath.jtheta(1, 0, q, 1).real)


def _wsigma3(u: mpf, g2: mpf, g3: mpf) -> mpf:
    mean, _, theta, _ = _of_lattice(4, u, g2, g3)
    return mpmath.exp(mean * u**2 / 2) * theta / mpmath.jtheta(4, 0, mpmath.exp(-mpmath.pi * _ratio(g2, g3))).real


def _ratio(g2: mpf, g3: mpf) -> mpf:
    """K'/K."""
    e1, e2, e3 = _roots(g2, g3)
    m = (e2 - e3) / (e1 - e3)
    return mpmath.ellipk(1 - m) / mpmath.ellipk(m)


def _shifted(s: mpf, m: mpf) -> tuple[Any, mpf, mpf]:
    """i a with sn(i a) = i s, K, and the nome."""
    return 1j * mpmath.ellipf(mpmath.atan(s), 1 - m), mpmath.ellipk(m), mpmath.qfrom(m=m)


def _theta_argument(u: mpf, s: mpf, m: mpf) -> mpf:
    a, quarter, q = _shifted(s, m)
    return mpmath.arg(mpmath.jtheta(4, mpmath.pi * (u + a) / (2 * quarter), q))


def _theta_rate(s: mpf, m: mpf) -> mpf:
    a, quarter, q = _shifted(s, m)
    z = mpmath.pi * a / (2 * quarter)
    return (mpmath.pi / (2 * quarter) * mpmath.jtheta(4, z, q, 1) / mpmath.jtheta(4, z, q) / 1j).real


_FUNCTIONS |= {
    "am": _am,
    "ellipticF": lambda phi, m: mpmath.ellipf(phi, m),
    "ellipticE": lambda phi, m: mpmath.ellipe(phi, m),
    "ellipticPi": lambda n, phi, m: mpmath.ellippi(n, phi, m),
    "ellipticK": mpmath.ellipk,
    **{f"theta{i}": lambda z, q, i=i: mpmath.jtheta(i, z, q).real for i in (1, 2, 3, 4)},
    "Theta": _jacobi_theta(4),
    "Eta": _jacobi_theta(1),
    "jacobiZeta": _zeta,
    "modulus": lambda q: mpmath.mfrom(q=q),
    "nome": lambda m: mpmath.qfrom(m=m),
    "wp": _wp,
    "wp3": _wp3,
    "wzeta": _wzeta(1),
    "wzeta3": _wzeta(4),
    "wsigma": _wsigma,
    "wsigma3": _wsigma3,
    "thetaArgument": _theta_argument,
    "thetaRate": _theta_rate,
}


# --- families --------------------------------------------------------------------------------------------------------


def _top(inertia: Sequence[str], weight: str, centre: Sequence[str], **parts: Any) -> Table:
    return {"top": {"inertia": list(inertia), "weight": weight, "centre": list(centre)}, **parts}


_CUBIC = "2*w/A*(u - u1)*(u - u2)*(u - u3)"
_LAGRANGE = {
    "S": "sqrt(2*w*A*(1 + u1)*(1 + u2)*(1 + u3))",
    "D": "sqrt(2*w*A*(1 - u1)*(1 - u2)*(u3 - 1))",
    "a": "(S - D)/2",
    "b": "(S + D)/2",
    "m": "(u2 - u1)/(u3 - u1)",
    "p": "sqrt(w*(u3 - u1)/(2*A))",
    "n1": "-(u2 - u1)/(1 + u1)",
    "n2": "(u2 - u1)/(1 - u1)",
}
_PSI = "((b - a)/(1 - u1)*ellipticPi(n2, am(p*t, m), m) + (b + a)/(1 + u1)*ellipticPi(n1, am(p*t, m), m))/(2*A*p)"
_PHI = (
    "(a/C - a/A)*t - ((b - a)/(1 - u1)*ellipticPi(n2, am(p*t, m), m)"
    " - (b + a)/(1 + u1)*ellipticPi(n1, am(p*t, m), m))/(2*A*p)"
)


def _lagrange_base(component: Table, quadrature: Table | None = None) -> Table:
    # 2wA(1 ± u1)(1 ± u2)(1 ± u3) are squares at the samples
    table = _top(
        ("A", "A", "C"),
        "1",
        ("0", "0", "w"),
        kind="component",
        assume=["A > 0", "C > 0", "w > 0", "-1 < u1 < u2 < 1", "u3 > 1"],
        parameters={
            "A": ["1", "2"],
            "C": ["3/2", "1"],
            "w": ["35/24", "105/52"],
            "u1": ["-3/5", "3/5"],
            "u2": ["1/3", "5/8"],
            "u3": ["11/7", "20/7"],
        },
        definitions=dict(_LAGRANGE),
        start={"omega": ["0", "(b - a*u1)/(A*sqrt(1 - u1^2))", "a/C"], "gamma": ["0", "sqrt(1 - u1^2)", "u1"]},
        component={"quantity": "gamma3", "constants": ["Omega3"], **component},
    )
    return table | ({} if quadrature is None else {"quadrature": {"variable": "u", **quadrature}})


def _lagrange_draw(rng: random.Random) -> dict[str, mpf]:
    u1 = _between(rng, mpf(-1), mpf(1))
    return {
        **{name: mpf(rng.uniform(0.4, 2)) for name in "ACw"},
        "u1": u1,
        "u2": _between(rng, u1, mpf(1)),
        "u3": 1 + mpf(rng.uniform(0.05, 1)),
    }


def lagrange_sn() -> Family:
    """γ3 of Lagrange's top by sn², with its reduced equation."""
    value = "u1 + (u2 - u1)*sn(p*t, m)^2"
    return Family(
        _lagrange_base({"reduced": _CUBIC, "value": value}),
        [
            ("component.value", "", "u2 - (u2 - u1)*cn(p*t, m)^2"),
            ("component.value", "", "u3 - (u3 - u1)*dn(p*t, m)^2"),
            ("component.value", "", "u1*cn(p*t, m)^2 + u2*sn(p*t, m)^2"),
            ("component.value", "", "u1 + (u2 - u1)*sin(am(p*t, m))^2"),
            ("component.value", "", "u1 + (u2 - u1)*Eta(p*t, m)^2/(sqrt(m)*Theta(p*t, m)^2)"),
            ("component.reduced", "", "((1 - u^2)*(2*w/A*(u1 + u2 + u3) - a^2/A^2 - 2*w*u/A) - (b - a*u)^2/A^2)"),
        ],
        [
            ("component.value", "m)", "m^2)"),
            ("component.value", "m)", "1 - m)"),
            ("component.value", "p*t", "2*p*t"),
            ("component.value", "sn(", "cn("),
            ("component.value", "+ (u2", "- (u2"),
            ("component.reduced", "2*w/A", "w/A"),
            ("component.reduced", "- u3", "+ u3"),
            ("definitions.p", "2*A", "A"),
            ("definitions.m", "(u3 - u1)", "(u3 - u2)"),
            ("definitions.a", "S - D", "S + D"),
            ("start.omega.1", "a*u1", "a*u2"),
        ],
        _lagrange_draw,
    )


def lagrange_angles() -> Family:
    """ψ and φ of Lagrange's top by integrals of the third kind."""
    psi, phi = "(b - a*u)/(A*(1 - u^2))", "a/C - u*(b - a*u)/(A*(1 - u^2))"
    value = {"reduced": _CUBIC, "value": "u1 + (u2 - u1)*sn(p*t, m)^2", "psi": _PSI, "phi": _PHI}
    return Family(
        _lagrange_base(value, {"psi": psi, "phi": phi}),
        [
            ("quadrature.psi", "", "((b - a)/(1 - u) + (b + a)/(1 + u))/(2*A)"),
            ("quadrature.phi", "", "Omega3 - gamma3*(b - a*gamma3)/(A*(1 - gamma3^2))"),
            ("component.psi", "+ (b + a)/(1 + u1)", "- (b + a)/(-1 - u1)"),
        ],
        [
            ("component.psi", "ellipticPi(n2", "ellipticPi(-n2"),
            ("component.psi", "ellipticPi(n1", "ellipticPi(-n1"),
            ("component.psi", "(b + a)", "(b - a)"),
            ("component.psi", "2*A*p", "A*p"),
            ("component.phi", "a/C - a/A", "a/C + a/A"),
            ("component.phi", "- (b + a)", "+ (b + a)"),
            ("component.phi", "(a/C - a/A)*t", "(a/C)*t"),
            ("component.psi", ", m)", ", m^2)"),
            ("component.psi", "am(p*t, m)", "p*t"),
            ("quadrature.psi", "b - a*u", "b + a*u"),
            ("quadrature.phi", "a/C -", "a/A -"),
        ],
        _lagrange_draw,
    )


def lagrange_wp() -> Family:
    """γ3 of Lagrange's top by ℘."""
    table = _lagrange_base({"reduced": _CUBIC, "value": "d + k*wp3(t, g2, g3)"})
    table["definitions"] |= {
        "k": "2*A/w",
        "d": "(u1 + u2 + u3)/3",
        "g2": "4*((u1 - d)^2 + (u1 - d)*(u2 - d) + (u2 - d)^2)/k^2",
        "g3": "4*(u1 - d)*(u2 - d)*(u3 - d)/k^3",
    }
    return Family(
        table,
        [
            ("definitions.g2", "", "-4*((u1 - d)*(u2 - d) + (u1 - d)*(u3 - d) + (u2 - d)*(u3 - d))/k^2"),
            ("component.value", "", "k*(d/k + wp3(-t, g2, g3))"),
        ],
        [
            ("component.value", "wp3(", "wp("),
            ("component.value", "d +", "-d +"),
            ("component.value", "k*wp3(t", "2*k*wp3(t"),
            ("definitions.g2", "4*", "2*"),
            ("definitions.g3", "4*", "-4*"),
            ("definitions.k", "2*A/w", "A/w"),
            ("definitions.d", "/3", "/2"),
            ("component.value", "g2, g3", "g3, g2"),
        ],
        _lagrange_draw,
    )


def lagrange_quadrature() -> Family:
    """t and the angles of Lagrange's top by quadratures in u = γ3."""
    psi, phi = "(b - a*u)/(A*(1 - u^2))", "a/C - u*(b - a*u)/(A*(1 - u^2))"
    return Family(
        _lagrange_base({}, {"integrand": f"1/sqrt({_CUBIC})", "psi": psi, "phi": phi}),
        [
            ("quadrature.integrand", "", "sqrt(A/(2*w))/sqrt((u - u1)*(u2 - u)*(u3 - u))"),
            ("quadrature.integrand", "", "sqrt(A/(2*w))/(sqrt(u - u1)*sqrt(u2 - u)*sqrt(u3 - u))"),
            ("quadrature.psi", "", "(b/A - a*u/A)/(1 - u^2)"),
            ("quadrature.phi", "", "Omega3 - u*(Omega1*gamma1 + Omega2*gamma2)/(gamma1^2 + gamma2^2)"),
        ],
        [
            ("quadrature.integrand", "2*w", "w"),
            ("quadrature.integrand", "u2", "u3"),
            ("quadrature.integrand", "", "sqrt(A/(2*w))/(sqrt(u1 - u)*sqrt(u - u2)*sqrt(u3 - u))"),
            ("quadrature.psi", "b - a*u", "b"),
            ("quadrature.psi", "1 - u^2", "1 - u"),
            ("quadrature.phi", "a/C", "a/A"),
            ("quadrature.phi", "- u*", "+ u*"),
            ("definitions.b", "S + D", "S - D"),
        ],
        _lagrange_draw,
    )


_FREE = {
    "p": "z*sqrt((I3 - I2)*(I3 - I1)/(I1*I2))",
    "y": "(I3 - I1)*z*x/(I2*p)",
    "m": "(I2 - I1)*I1*x^2/((I3 - I2)*I3*z^2)",
}
_FREE_ASSUMED = ["I1 > 0", "I2 > I1", "I3 > I2", "x > 0", "z > 0", "(I2 - I1)*I1*x^2 < (I3 - I2)*I3*z^2"]
_FREE_PARAMETERS = {"I1": ["1", "2"], "I2": ["2", "5/2"], "I3": ["5/2", "4"], "x": ["1/2", "1"], "z": ["1", "3/4"]}


def _free_draw(rng: random.Random) -> dict[str, mpf]:
    i1 = mpf(rng.uniform(1, 2))
    i2 = i1 * mpf(rng.uniform(1.05, 1.4))
    i3 = i2 * mpf(rng.uniform(1.05, 1.4))
    z = mpf(rng.uniform(0.4, 1.5))
    most = mpmath.sqrt((i3 - i2) * i3 * z**2 / ((i2 - i1) * i1))
    return {"I1": i1, "I2": i2, "I3": i3, "x": _between(rng, 0, most), "z": z}


def euler_component(axis: int) -> Callable[[], Family]:
    """A component of Ω of a free body, with its reduced equation."""
    first = "(x^2 - I2*(I3 - I2)/(I1*(I3 - I1))*u^2)"
    third = "(z^2 - I2*(I2 - I1)/(I3*(I3 - I1))*u^2)"
    across = {
        0: "((I3 - I2)/I1)^2*(I1*(I3 - I1)/(I2*(I3 - I2))*(x^2 - u^2))*(z^2 - I1*(I2 - I1)/(I3*(I3 - I2))*(x^2 - u^2))",
        1: f"((I3 - I1)/I2)^2*{first}*{third}",
        2: "((I2 - I1)/I3)^2*(I3*(I3 - I1)/(I2*(I2 - I1))*(z^2 - u^2))*(x^2 - I3*(I3 - I2)/(I1*(I2 - I1))*(z^2 - u^2))",
    }[axis]
    value = ("x*cn(p*t, m)", "y*sn(p*t, m)", "z*dn(p*t, m)")[axis]
    name, other = ("cn", "sn", "dn")[axis], ("dn", "cn", "cn")[axis]
    same = {
        0: "x*cos(am(p*t, m))",
        1: "y*Eta(p*t, m)/(m^(1/4)*Theta(p*t, m))".replace("m^(1/4)", "sqrt(sqrt(m))"),
        2: "z*sqrt(1 - m*sn(p*t, m)^2)",
    }[axis]

    def family() -> Family:
        table = _top(
            ("I1", "I2", "I3"),
            "0",
            ("0", "0", "0"),
            kind="component",
            assume=list(_FREE_ASSUMED),
            parameters=dict(_FREE_PARAMETERS),
            definitions=dict(_FREE),
            start={"omega": ["x", "0", "z"], "gamma": ["0", "3/5", "4/5"]},
            component={
                "quantity": f"Omega{axis + 1}",
                "constants": ["(I1*Omega1)^2 + (I2*Omega2)^2 + (I3*Omega3)^2"],
                "reduced": across,
                "value": value,
            },
        )
        wrong = [
            ("component.value", f"{name}(", f"{other}("),
            ("component.value", ", m)", ", m^2)"),
            ("component.value", ", m)", ", sqrt(m))"),
            ("component.value", "p*t", "p*t/2"),
            ("component.value", "p*t", "-p*t"),
            ("component.reduced", "I3 - I2", "I2 - I3"),
            ("component.reduced", ")^2*", ")*"),
            ("definitions.m", "I1*x^2", "I3*x^2"),
            ("definitions.p", "I1*I2", "I2*I3"),
            ("component.constants.0", "(I2*Omega2)^2", "I2*Omega2^2"),
        ]
        return Family(table, [("component.value", "", same)], wrong, _free_draw)

    return family


def euler_theta() -> Family:
    """The attitude of a free body: γ along M, ψ by the argument of a theta function."""
    table = _top(
        ("I1", "I2", "I3"),
        "0",
        ("0", "0", "0"),
        kind="motion",
        assume=["x > 0", "z > 0", "4*x^2 < 5*z^2"],
        parameters={"x": ["1/2", "3/4"], "z": ["1", "5/4"]},
        definitions={
            "I1": "1",
            "I2": "2",
            "I3": "5/2",
            **_FREE,
            "G": "sqrt(I1^2*x^2 + I3^2*z^2)",
            "s": "I3*z/(I1*x)",
            "M1": "I1*x*cn(p*t, m)",
            "M2": "I2*y*sn(p*t, m)",
            "M3": "I3*z*dn(p*t, m)",
        },
        motion={
            "omega": ["M1/I1", "M2/I2", "M3/I3"],
            "gamma": ["M1/G", "M2/G", "M3/G"],
            "angles": [
                "atan2(M1, M2)",
                "acos(M3/G)",
                "(G/I1 - p*thetaRate(s, m))*t + thetaArgument(p*t, s, m)",
            ],
        },
    )
    third = "G/I3*t + G*(I3 - I2)*(I3 - I1)/(I3*I1*(I3 - I2)*p)*ellipticPi(-I3*(I2 - I1)/(I1*(I3 - I2)), am(p*t, m), m)"
    return Family(
        table,
        [("motion.angles.2", "", third)],
        [
            ("motion.angles.2", "- p*thetaRate", "+ p*thetaRate"),
            ("motion.angles.2", "+ thetaArgument", "- thetaArgument"),
            ("motion.angles.2", "G/I1", "G/I2"),
            ("definitions.s", "I3*z/(I1*x)", "I1*x/(I3*z)"),
            ("motion.angles.2", "", third.replace("(-I3", "(I3")),
            ("motion.angles.2", "", third.replace("G/I3*t +", "G/I3*t -")),
            ("motion.angles.2", "", third.replace("am(p*t, m)", "p*t")),
            ("motion.angles.0", "atan2(M1, M2)", "atan2(M2, M1)"),
            ("motion.angles.0", "atan2(M1, M2)", "atan(M1/M2)"),
            ("motion.omega.1", "M2/I2", "-M2/I2"),
            ("definitions.M2", "sn", "cn"),
        ],
        lambda rng: {"x": mpf(rng.uniform(0.1, 1)), "z": mpf(rng.uniform(1, 2))},
    )


def _pendulum(definitions: Table, motion: Table, weight: str, parameters: Table, assume: list[str]) -> Table:
    return _top(
        ("I", "2", "3"),
        weight,
        ("0", "0", "1"),
        kind="motion",
        assume=["I > 0", *assume],
        parameters={"I": ["2", "3/2"], **parameters},
        definitions=definitions,
        motion=motion,
    )


def _unit_draw(*names: str) -> Draw:
    """Parameters of (0, 1) by these names, positive ones I and p."""

    def draw(rng: random.Random) -> dict[str, mpf]:
        return {"I": mpf(rng.uniform(1, 4)), "p": mpf(rng.uniform(0.4, 2))} | {
            name: mpf(rng.uniform(0.05, 0.6)) for name in names
        }

    return draw


def swinging() -> Family:
    """The pendulum between two turns, modulus k."""
    table = _pendulum(
        {"s": "sn(p*t, k^2)"},
        {"omega": ["2*k*p*cn(p*t, k^2)", "0", "0"], "gamma": ["0", "-2*k*s*dn(p*t, k^2)", "2*k^2*s^2 - 1"]},
        "I*p^2",
        {"p": ["1", "3/4"], "k": ["1/2", "3/5"]},
        ["p > 0", "0 < k < 1"],
    )
    return Family(
        table,
        [
            ("definitions.s", "", "Eta(p*t, k^2)/(sqrt(k)*Theta(p*t, k^2))"),
            ("definitions.s", "", "sin(am(p*t, k^2))"),
            ("motion.gamma.2", "", "-cos(2*asin(k*s))"),
            ("motion.gamma.1", "", "-2*k*s*sqrt(1 - k^2*s^2)"),
            ("motion.gamma.1", "", "-sin(2*asin(k*s))"),
            ("motion.omega.0", "", "2*k*p*cos(am(p*t, k^2))"),
            ("motion.gamma.2", "", "1 - 2*dn(p*t, k^2)^2"),
            (
                "motion.gamma.0",
                "",
                "ellipticE(am(p*t, k^2), k^2) - p*t*ellipticE(pi/2, k^2)/ellipticK(k^2) - jacobiZeta(p*t, k^2)",
            ),
        ],
        [
            ("definitions.s", "k^2", "k"),
            ("motion.omega.0", "k^2)", "k)"),
            ("motion.omega.0", "cn", "dn"),
            ("motion.omega.0", "2*k*p", "k*p"),
            ("motion.gamma.1", "-2", "2"),
            ("motion.gamma.1", "dn", "cn"),
            ("motion.gamma.2", "k^2*", "k*"),
            ("top.weight", "I*p^2", "2*I*p^2"),
            ("top.weight", "I*p^2", "I*p^2*k^2"),
            ("motion.gamma.0", "", "ellipticE(am(p*t, k^2), k^2) - jacobiZeta(p*t, k^2)"),
        ],
        _unit_draw("k"),
    )


def rotating() -> Family:
    """The pendulum that turns over, by am."""
    table = _pendulum(
        {"f": "2*am(p*t, k^2)"},
        {"omega": ["2*p*dn(p*t, k^2)", "0", "0"], "gamma": ["0", "-sin(f)", "-cos(f)"]},
        "I*p^2*k^2",
        {"p": ["1", "3/4"], "k": ["1/2", "3/5"]},
        ["p > 0", "0 < k < 1"],
    )
    return Family(
        table,
        [
            ("motion.gamma.1", "", "-2*sn(p*t, k^2)*cn(p*t, k^2)"),
            ("motion.gamma.2", "", "2*sn(p*t, k^2)^2 - 1"),
            ("motion.omega.0", "", "2*p*sqrt(1 - k^2*sin(f/2)^2)"),
            ("motion.gamma.2", "", "1 - 2*cos(am(p*t, k^2))^2"),
        ],
        [
            ("definitions.f", "2*am", "am"),
            ("definitions.f", "k^2", "k"),
            ("definitions.f", "am(p*t, k^2)", "p*t"),
            ("motion.omega.0", "dn", "cn"),
            ("motion.omega.0", "2*p", "p"),
            ("motion.gamma.1", "-sin", "sin"),
            ("motion.gamma.2", "-cos", "cos"),
            ("top.weight", "k^2", "k"),
            ("motion.gamma.1", "sin(f)", "sin(asin(sin(f)/2)*2)"),
        ],
        _unit_draw("k"),
    )


def theta_pendulum() -> Family:
    """The pendulum in theta functions of a nome."""
    sn, cn, dn = (
        "theta3(0, q)/theta2(0, q)*theta1(z, q)/theta4(z, q)",
        "theta4(0, q)/theta2(0, q)*theta2(z, q)/theta4(z, q)",
        "theta4(0, q)/theta3(0, q)*theta3(z, q)/theta4(z, q)",
    )
    table = _pendulum(
        {"z": "p*t/theta3(0, q)^2", "k": "theta2(0, q)^2/theta3(0, q)^2", "s": sn, "c": cn, "d": dn},
        {"omega": ["2*k*p*c", "0", "0"], "gamma": ["0", "-2*k*s*d", "2*k^2*s^2 - 1"]},
        "I*p^2",
        {"p": ["1", "3/4"], "q": ["1/10", "1/5"]},
        ["p > 0", "0 < q < 1"],
    )
    return Family(
        table,
        [
            ("definitions.k", "", "sqrt(modulus(q))"),
            ("motion.gamma.2", "", "1 - 2*d^2"),
            ("definitions.s", "", "sn(p*t, k^2)"),
            ("definitions.c", "", "cos(am(p*t, modulus(q)))"),
        ],
        [
            ("definitions.s", "theta1(z", "theta2(z"),
            ("definitions.c", "theta4(0", "theta3(0"),
            ("definitions.d", "theta3(z", "theta2(z"),
            ("definitions.z", "theta3", "theta2"),
            ("definitions.k", "^2/theta3(0, q)^2", "/theta3(0, q)"),
            ("definitions.s", "/theta4(z", "/theta3(z"),
            ("motion.gamma.1", "s*d", "s*c"),
            ("definitions.z", "p*t", "2*p*t"),
        ],
        _unit_draw("q"),
    )


def pendulum_clock() -> Family:
    """The pendulum by t = F of half its angle."""
    table = _pendulum(
        {"s": "sin(u)"},
        {"omega": ["2*p*sqrt(1 - k^2*s^2)", "0", "0"], "gamma": ["0", "-2*s*cos(u)", "2*s^2 - 1"]},
        "I*p^2*k^2",
        {"p": ["1", "3/4"], "k": ["1/2", "3/5"]},
        ["p > 0", "0 < k < 1"],
    )
    table["quadrature"] = {"variable": "u", "time": "ellipticF(u, k^2)/p"}
    return Family(
        table,
        [
            ("motion.gamma.1", "", "-sin(2*u)"),
            ("motion.gamma.2", "", "-cos(2*u)"),
            ("quadrature.time", "", "(ellipticF(u, k^2) + ellipticF(2, k^2))/p"),
        ],
        [
            ("quadrature.time", "k^2", "k"),
            ("quadrature.time", "/p", "*p"),
            ("quadrature.time", "ellipticF", "ellipticE"),
            ("quadrature.time", "ellipticF(", "ellipticPi(k/2, "),
            ("motion.omega.0", "2*p", "p"),
            ("motion.gamma.2", "2*s^2 - 1", "1 - 2*s^2"),
            ("top.weight", "*k^2", ""),
        ],
        _unit_draw("k"),
    )


def bounded() -> Family:
    """The pendulum with an equality allowed: k = 0 is rest, k = 1 the separatrix."""
    family = swinging()
    family.table["assume"][1:] = ["p > 0", "0 <= k", "k <= 1"]
    same = [swap for swap in family.same if "Eta" not in swap[2] and "elliptic" not in swap[2]]

    def draw(rng: random.Random) -> dict[str, mpf]:
        return _unit_draw("k")(rng) | {"k": rng.choice([mpf(0), mpf(1), *[mpf(rng.uniform(0, 1))] * 4])}

    return Family(family.table, same, [*family.wrong[:-1], ("motion.omega.0", "2*k*p", "2*k^2*p/k")], draw)


def free_quaternion() -> Family:
    """The attitude of a free symmetric body as a quaternion: a turn about M after one about its axis."""
    table = _top(
        ("A", "A", "C"),
        "0",
        ("0", "0", "0"),
        kind="motion",
        assume=["A > 0", "C > 0", "g > 0", "0 < h < 1"],
        parameters={"A": ["1", "2"], "C": ["3/2", "1"], "g": ["1", "3/4"], "h": ["3/5", "5/13"]},
        definitions={"c": "sqrt((1 + h)/2)", "s": "sqrt((1 - h)/2)", "a": "g*t/(2*A)", "b": "g*h*(1/C - 1/A)*t/2"},
        motion={"quaternion": ["c*cos(a + b)", "s*cos(a - b)", "s*sin(a - b)", "c*sin(a + b)"]},
    )
    return Family(
        table,
        [
            ("motion.quaternion", "", ["-c*cos(a + b)", "-s*cos(a - b)", "-s*sin(a - b)", "-c*sin(a + b)"]),
            ("motion.quaternion.0", "", "c*(cos(a)*cos(b) - sin(a)*sin(b))"),
            ("motion", "", {"matrix": _rows_of_quaternion()}),
        ],
        [
            ("motion.quaternion.1", "s*", "c*"),
            ("motion.quaternion.2", "a - b", "a + b"),
            ("motion.quaternion.3", "c*sin", "-c*sin"),
            ("definitions.b", "1/C - 1/A", "1/A - 1/C"),
            ("definitions.b", "/2", ""),
            ("definitions.a", "2*A", "2*C"),
            ("definitions.s", "1 - h", "1 - h^2"),
            ("motion", "", {"matrix": _rows_of_quaternion(sign="+")}),
            ("motion.quaternion", "", ["c*cos(a + b)", "-s*cos(a - b)", "-s*sin(a - b)", "-c*sin(a + b)"]),
        ],
        lambda rng: {name: mpf(rng.uniform(0.1, 0.9) if name == "h" else rng.uniform(0.5, 2)) for name in "ACgh"},
    )


def _rows_of_quaternion(sign: str = "-") -> list[list[str]]:
    """The matrix of the quaternion above: turns by 2a about e_z, θ about the node, 2b about the axis."""
    u, v, s, h = "2*a", "2*b", "2*c*s", "h"
    return [
        [
            f"cos({u})*cos({v}) {sign} sin({u})*{h}*sin({v})",
            f"-cos({u})*sin({v}) - sin({u})*{h}*cos({v})",
            f"sin({u})*{s}",
        ],
        [
            f"sin({u})*cos({v}) + cos({u})*{h}*sin({v})",
            f"-sin({u})*sin({v}) + cos({u})*{h}*cos({v})",
            f"-cos({u})*{s}",
        ],
        [f"{s}*sin({v})", f"{s}*cos({v})", h],
    ]


def weierstrass_clock(clock: str, other: str, slope: str) -> Callable[[], Family]:
    """The regular precession of a free body by t = F of u, with ζ or σ in F."""
    level = [f"h*{turn}((C - A)*s/A*({clock}))" for turn in ("cos", "sin")]

    def family() -> Family:
        table = _top(
            ("A", "A", "C"),
            "0",
            ("0", "0", "0"),
            kind="motion",
            assume=["A > 0", "C > 0", "h > 0", "s > 0", "e > 0", "e < 1"],
            parameters={"A": ["1", "2"], "C": ["3/2", "1"], "h": ["1", "3/4"], "s": ["1/2", "1"], "e": ["1/2", "1/4"]},
            definitions={
                # e1 = 1 + e, e2 = -e, e3 = -1
                "g2": "4*(1 + e + e^2)",
                "g3": "4*e*(1 + e)",
                "G": "sqrt(A^2*h^2 + C^2*s^2)",
            },
            motion={"omega": [*level, "s"], "gamma": [f"A/G*{level[0]}", f"A/G*{level[1]}", "C*s/G"]},
            quadrature={"variable": "u", "time": clock, "where": ["0 < u < 1", slope], "points": ["1/2"]},
        )
        return Family(
            table,
            [
                ("quadrature.time", "", f"0*u + {clock}"),
                ("quadrature", "", {**table["quadrature"], "time": f"{clock} + 2*s"}),
                ("definitions.g2", "", "4*((1 + e)^2 - e)"),
            ],
            [
                ("quadrature.time", "u, g2, g3", "u, g2, g3/2"),
                ("quadrature.time", "u, g2, g3", "2*u, g2, g3"),
                ("quadrature.time", clock, other),
                ("motion.omega.0", "(C - A)", "(A - C)"),
                ("motion.omega.1", "u, g2", "-u, g2"),
                ("motion.omega.2", "s", "2*s"),
                ("motion.gamma.2", "C*s", "A*s"),
                ("motion.gamma.0", "g2, g3", "g2, -g3"),
            ],
            lambda rng: {n: mpf(rng.uniform(0.1, 0.9) if n == "e" else rng.uniform(0.5, 2)) for n in "AChse"},
        )

    return family


def swinging_sigma() -> Family:
    """The swinging pendulum, with a component that is 0 as σ and ζ are odd, σ of u + ω3 is even."""
    family = swinging()
    family.table["definitions"] |= {"g2": "3 + k", "g3": "k/2", "x": "p*t"}
    odd, even = "wsigma(x, g2, g3) + wsigma(-x, g2, g3)", "log(wsigma3(x, g2, g3)/wsigma3(-x, g2, g3))"
    third = "wzeta3(x, g2, g3) + wzeta3(-x, g2, g3)"
    forms = (odd, even, third, f"({odd})*{third}", f"wsigma(x, g2, g3)*({third})")
    wrong = (
        odd.replace("+", "-"),
        odd.replace("wsigma(-x, g2, g3)", "wsigma(-x, g3, g2)"),
        odd.replace("wsigma(-x", "wsigma3(-x"),
        even.replace("/", "*"),
        even.replace("log(", "wsigma(x, g2, g3)*("),
        third.replace("+", "-"),
        third.replace("wzeta3(-x", "wzeta3(-2*x"),
    )
    return Family(
        family.table,
        [("motion.gamma.0", "", form) for form in forms],
        [*(("motion.gamma.0", "", form) for form in wrong), *family.wrong[:3]],
        family.draw,
    )


FAMILIES: dict[str, Callable[[], Family]] = {
    "lagrange sn": lagrange_sn,
    "lagrange angles": lagrange_angles,
    "lagrange wp": lagrange_wp,
    "lagrange quadrature": lagrange_quadrature,
    "euler 1": euler_component(0),
    "euler 2": euler_component(1),
    "euler 3": euler_component(2),
    "euler theta": euler_theta,
    "swinging": swinging,
    "rotating": rotating,
    "theta pendulum": theta_pendulum,
    "pendulum clock": pendulum_clock,
    "bounded": bounded,
    "quaternion": free_quaternion,
    "zeta 3": weierstrass_clock("2*u - wzeta3(u, g2, g3)", "2*u + wzeta3(u, g2, g3)", "wp3(u, g2, g3) > -2"),
    "sigma 3": weierstrass_clock("log(wsigma3(u, g2, g3))", "log(wsigma(u, g2, g3))", "wzeta3(u, g2, g3) > 0"),
    "sigma": swinging_sigma,
}


# --- truth -----------------------------------------------------------------------------------------------------------


class Solution:
    """The formulas of a claim at one set of parameters."""

    def __init__(self, table: Table, names: Mapping[str, mpf]) -> None:
        self.table = table
        self.names, self.moving = dict(names), {}
        for name, text in table.get("definitions", {}).items():
            try:
                self.names[name] = _compiled(text)(self.names)
            except NameError:
                self.moving[name] = _compiled(text)
        top = table["top"]
        weight = self(top["weight"])
        self.moment = [weight * self(part) for part in top["centre"]]
        self.inertia = [self(part) for part in top["inertia"]]

    def __call__(self, text: str, **moving: Any) -> Any:
        names = self.names | moving
        for name, formula in self.moving.items() if moving else ():
            names[name] = formula(names)
        return _compiled(text)(names)

    def field(self, y: Sequence[Any]) -> list[Any]:
        """The equations of motion."""
        return _field(self.inertia, self.moment, None, list(y), "heavy_top")


def _rates_of_angles(y: Sequence[Any]) -> dict[str, Any]:
    """φ', ψ' of the kinematics (3.1), where γ is not vertical."""
    w, g = y[:3], y[3:]
    psi = (w[0] * g[0] + w[1] * g[1]) / (g[0] ** 2 + g[1] ** 2)
    return {"psi": psi, "phi": w[2] - psi * g[2]}


def _omega_of(rows: Sequence[Sequence[Any]], rates: Sequence[Sequence[Any]]) -> list[Any]:
    """Ω of R and R', by R' = R [Ω]×."""
    product = lambda i, j: sum(rows[k][i] * rates[k][j] for k in range(3))  # noqa: E731
    return [product(2, 1), product(0, 2), product(1, 0)]


def _matrix(q: Sequence[Any]) -> list[list[Any]]:
    w, x, y, z = q
    return [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]


def _off_motion(solution: Solution, at: mpf) -> mpf:
    """The largest residual of a claimed motion at a time, or value of the variable of its quadrature."""
    motion, quadrature = solution.table["motion"], solution.table.get("quadrature")
    variable = "t" if quadrature is None else quadrature["variable"]
    step = mpf(10) ** (-DIGITS // 3)

    def rows(x: mpf) -> list[list[Any]] | None:
        if "quaternion" in motion:
            return _matrix([solution(text, **{variable: x}) for text in motion["quaternion"]])
        if "matrix" in motion:
            return [[solution(text, **{variable: x}) for text in row] for row in motion["matrix"]]
        return None

    def rate(f: Callable[[mpf], Any]) -> Any:
        clock = 1 if quadrature is None else rate_of_time
        return (f(at + step) - f(at - step)) / (2 * step) / clock

    if quadrature is not None:
        times = [solution(quadrature["time"], **{variable: at + sign * step}) for sign in (1, -1)]
        rate_of_time = (times[0] - times[1]) / (2 * step)
    matrix = rows(at)
    if matrix is not None:
        off = max(
            abs(sum(matrix[i][k] * matrix[j][k] for k in range(3)) - (i == j)) for i in range(3) for j in range(3)
        )
        off = max(off, abs(mpmath.det(mpmath.matrix(matrix)) - 1))

        def state(x: mpf) -> list[Any]:
            near = [rows(x + sign * step) for sign in (1, -1)]
            slopes = [[(a - b) / (2 * step) for a, b in zip(*pair, strict=True)] for pair in zip(*near, strict=True)]
            return [*_omega_of(rows(x), slopes), *rows(x)[2]]

    else:
        off = mpf(0)

        def state(x: mpf) -> list[Any]:
            return [solution(text, **{variable: x}) for part in ("omega", "gamma") for text in motion[part]]

    y = state(at)
    ends = [state(at + sign * step) for sign in (1, -1)]
    clock = 1 if quadrature is None else rate_of_time
    slopes = [(a - b) / (2 * step) / clock for a, b in zip(*ends, strict=True)]
    off = max(
        [off, abs(sum(g * g for g in y[3:]) - 1), *(abs(a - b) for a, b in zip(slopes, solution.field(y), strict=True))]
    )
    if "angles" in motion:
        phi, theta, _ = (solution(text, t=at) for text in motion["angles"])
        sine = mpmath.sin(theta)
        gamma = [sine * mpmath.sin(phi), sine * mpmath.cos(phi), mpmath.cos(theta)]
        rates = _rates_of_angles(y)
        slope = {
            name: rate(lambda x, text=text: solution(text, t=x))
            for name, text in zip(("phi", "theta", "psi"), motion["angles"], strict=True)
        }
        off = max(
            [off, *(abs(a - b) for a, b in zip(gamma, y[3:], strict=True)), *(abs(slope[n] - rates[n]) for n in rates)]
        )
    return off


def _off_component(solution: Solution, time: mpf) -> mpf:
    """The largest error of a component, its reduced equation and angles at a time, beside an integration."""
    table = solution.table
    component, quadrature, start = table["component"], table.get("quadrature", {}), table["start"]
    y0 = [solution(text) for part in ("omega", "gamma") for text in start[part]]
    states = [f"Omega{i}" for i in (1, 2, 3)] + [f"gamma{i}" for i in (1, 2, 3)]
    names = [name for name in ("phi", "psi") if name in quadrature]

    def along(_t: Any, y: Sequence[Any]) -> list[Any]:
        return [*solution.field(y[:6]), *_rates_of_angles(y[:6]).values()]

    with mpmath.workdps(18):
        y = mpmath.odefun(along, 0, [*y0, mpf(0), mpf(0)])(abs(time))
    moving = dict(zip(states, y[:6], strict=True))
    u = solution(component["quantity"], **moving)
    step = mpf("1e-8")
    ends = [[a + sign * step * b for a, b in zip(y[:6], solution.field(y[:6]), strict=True)] for sign in (1, -1)]
    rate = [solution(component["quantity"], **dict(zip(states, end, strict=True))) for end in ends]
    square = ((rate[0] - rate[1]) / (2 * step)) ** 2
    offs = [mpf(0)]
    if "reduced" in component:
        offs.append(solution(component["reduced"], u=u) - square)
    if "integrand" in quadrature:
        offs.append(1 / solution(quadrature["integrand"], u=u) ** 2 - square)
    if "value" in component:
        offs.append(solution(component["value"], t=abs(time)) - u)
    rates = _rates_of_angles(y[:6])
    offs += [solution(quadrature[name], u=u, **moving) - rates[name] for name in names]
    for text in component.get("constants", []):
        begin = solution(text, **dict(zip(states, y0, strict=True)))
        offs.append(solution(text, **moving) - begin)
    turned = dict(zip(rates, y[6:], strict=True))
    for name in names:
        if name in component:
            change = solution(component[name], t=abs(time)) - solution(component[name], t=mpf(0))
            offs.append(change - turned[name])
    return max(map(abs, offs))


def is_true(table: Table, draw: Draw, rng: random.Random) -> bool:
    """Whether nothing is off at random parameters and times; what has no value there is not true."""
    off = _off_motion if table["kind"] == "motion" else _off_component
    with mpmath.workdps(DIGITS):
        for number in range(8 if off is _off_motion else 3):
            solution = Solution(table, draw(rng))
            at = mpf(rng.uniform(0.2, 1.5 + number)) * rng.choice((1, -1))
            try:
                if not off(solution, at) < CLOSE:
                    return False
            except (Undefined, ZeroDivisionError):
                return False
    return True


# --- claims ----------------------------------------------------------------------------------------------------------


def _swapped(table: Table, swap: Swap) -> bool:
    """Puts it into the table; False where its text does not occur there."""
    where, old, new = swap
    *path, last = where.split(".")
    inner: Any = table
    for key in path:
        if isinstance(inner, dict) and key not in inner:
            return False
        inner = inner[int(key)] if isinstance(inner, list) else inner[key]
    key = int(last) if isinstance(inner, list) else last
    text = inner[key] if isinstance(inner, list) or key in inner else None
    if text is None or (old and (not isinstance(text, str) or old not in text)):
        return False
    inner[key] = text.replace(old, new, 1) if old else new
    return True


def claim(rng: random.Random, family: Family) -> tuple[Table, str]:
    """A table, and the mistake in it, or ""."""
    while True:
        table, mistake = copy.deepcopy(family.table), ""
        for swap in rng.sample(list(family.same), min(rng.randint(0, 2), len(family.same))):
            _swapped(table, swap)
        if rng.random() < 0.5:
            swap = rng.choice(list(family.wrong))
            if not _swapped(table, swap):
                continue
            mistake = " ".join(map(str, swap))
        return table, mistake


@dataclass(frozen=True)
class Outcome:
    """A claim, what is true of it, and its verdict with what leaves it open."""

    family: str
    table: Table
    mistake: str
    truth: bool
    verdict: str
    reason: str
    seconds: float

    @property
    def is_false(self) -> bool:
        """Whether the verdict contradicts the truth."""
        return self.verdict == ("refuted" if self.truth else "holds")


def outcomes(count: int, first: int = 0, name: str | None = None) -> Iterator[Outcome]:
    """The audits of claims number ``first`` to ``first + count``, each with a seed of its own."""
    chosen = [name] if name else list(FAMILIES)
    for number in range(first, first + count):
        rng = random.Random(number)
        key = chosen[number % len(chosen)]
        family = FAMILIES[key]()
        table, mistake = claim(rng, family)
        truth = is_true(table, family.draw, rng)
        begin = time.process_time()
        verdict, reason = _verdict(table)
        yield Outcome(key, table, mistake, truth, verdict, reason, time.process_time() - begin)


def _verdict(table: Table) -> tuple[str, str]:
    try:
        report = audit_claim(claim_from_table({"name": "stated"} | table, "stated"))
    except InputError as error:
        return "refused", error.cause
    open_rows = [row for row in report.rows if row.holds is None]
    texts = [f"{c.text} ({c.reason})" for row in open_rows for c in row.conditions if not c.discharged]
    return report.verdict, "; ".join(dict.fromkeys([*texts, *(f"{r.equation} {r.residual}" for r in open_rows)]))


def main() -> int:
    """1 where a verdict is false."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--claims", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--family", choices=FAMILIES)
    options = parser.parse_args()
    counts: Counter[tuple[str, bool, str]] = Counter()
    wrong = 0
    for outcome in outcomes(options.claims, options.first, options.family):
        counts[outcome.family, outcome.truth, outcome.verdict] += 1
        wrong += outcome.is_false
        if outcome.is_false or outcome.verdict not in ("holds", "refuted"):
            mark = "FALSE" if outcome.is_false else "open"
            print(
                f"{mark} {outcome.family} {outcome.truth} {outcome.verdict} [{outcome.mistake}]: {outcome.reason[:400]}"
            )
            print(
                "   ", outcome.table.get("component") or outcome.table["motion"], f"{outcome.seconds:.1f} s", flush=True
            )
    for (family, truth, verdict), number in sorted(counts.items()):
        print(f"{family:20} {'true' if truth else 'false':6} {verdict:10} {number}")
    undecided = sum(n for (_, _, verdict), n in counts.items() if verdict not in ("holds", "refuted"))
    print(f"{wrong} false, {undecided} undecided or refused of {sum(counts.values())}")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
