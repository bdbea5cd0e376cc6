"""Tops and starts with rational data on which a closed form holds, made from free parameters."""

from __future__ import annotations

from fractions import Fraction

from heavytop.errors import InputError
from heavytop.exact.cases.bobylev_steklov import BobylevSteklov
from heavytop.exact.cases.grioli import Grioli, gamma_of
from heavytop.exact.cases.one_interval import Steklov, quadratics
from heavytop.exact.cases.staude import Staude
from heavytop.precision import Vector, shown
from heavytop.top.equations import HEAVY_GYROSTAT
from heavytop.top.heavy_top import HeavyTop, State


def half_angle(tangent: Fraction) -> tuple[Fraction, Fraction]:
    """(cos, sin) of the angle with this tangent of its half: a rational point of the circle."""
    square = Fraction(tangent) ** 2
    return (1 - square) / (1 + square), 2 * Fraction(tangent) / (1 + square)


def staude_motion(
    inertia: Vector, gamma: Vector, rate: Fraction, along: Fraction = Fraction(0), rotor: Vector | None = None
) -> Staude:
    """The permanent rotation Ω = ω γ of the top of weight 1 with r = ω² I γ + κ γ, κ = ``along``: all there are.

    rotor: k of a heavy gyrostat, for which r = ω² I γ + ω k + κ γ.
    """
    start = State([rate * g for g in gamma], gamma)
    centre = [(rate**2 * i + along) * g for i, g in zip(inertia, gamma, strict=True)]
    if rotor is None:
        return Staude(HeavyTop(inertia, 1, centre), start)
    carried = [n + rate * k for n, k in zip(centre, rotor, strict=True)]
    return Staude(HeavyTop(inertia, 1, carried, rotor), start, HEAVY_GYROSTAT)


def grioli_motion(
    direction: Fraction, shape: Fraction, phase: Fraction, rate: Fraction, size: Fraction = Fraction(1)
) -> Grioli:
    """A top of weight 1 with a Grioli precession, and a start on it with |γ| = 1, all rational.

    direction, shape, phase: tangents of half the angles (r̂1, r̂3) = (cos, sin), (I1 r̂1, I3 r̂3) = size (cos, sin) and
    u = e2 cos + (r̂ × e2) sin.  rate: ν.  size: √(D² + κ²), a moment of inertia.
    Raises InputError where a moment would not be positive, or I1 = I3, or ν = 0.
    """
    (a, c), (p1, p3), (u2, uz) = half_angle(direction), half_angle(shape), half_angle(phase)
    if rate == 0 or size <= 0 or p1 * a <= 0 or p3 * c <= 0 or p1 * c == p3 * a:
        raise InputError(
            f"No Grioli top has direction {direction}, shape {shape}, rate {rate} and size {size}.",
            "Give different direction and shape of one sign, both between 0 and 1, say; rate != 0, size > 0.",
        )
    i1, i3 = size * p1 / a, size * p3 / c
    top = HeavyTop((i1, i1 * c * c + i3 * a * a, i3), 1, (rate**2 * size * a, 0, rate**2 * size * c))
    # r̂ × e2 = (−c, 0, a)
    omega = (rate * (a - uz * c), rate * u2, rate * (c + uz * a))
    gamma = gamma_of(top, State(omega, (0, 0, 0)).omega)
    return Grioli(top, State(omega, gamma))


def bobylev_steklov_motion(
    inertia: tuple[Fraction, Fraction], moment: Fraction, rate: Fraction, tilt: Fraction, azimuth: Fraction
) -> BobylevSteklov:
    """A top of weight 1 with a Bobylev-Steklov motion and a start on it with |γ| = 1, all rational.

    inertia: (I2, I3); I1 = 2 I3.  moment: a ≠ 0.  rate: Ω1 = p ≠ 0.  tilt, azimuth: tangents of half the angles in
    γ = (cos tilt cos azimuth, cos tilt sin azimuth, sin tilt).  Raises InputError for a or p = 0.
    """
    if moment == 0 or rate == 0:
        raise InputError(f"a = {shown(moment)}, p = {shown(rate)}.", "Give a centre of mass and a rate that are not 0.")
    i2, i3 = inertia
    (across, up), (cosine, sine) = half_angle(tilt), half_angle(azimuth)
    gamma: Vector = (across * cosine, across * sine, up)
    top = HeavyTop((2 * i3, i2, i3), 1, (moment, 0, 0))
    return BobylevSteklov(top, State((rate, 0, moment * up / (i3 * rate)), gamma))


def steklov_motion(
    first: Fraction, second: Fraction, ratio: Fraction, rate: Fraction, upwards: int = 1, size: Fraction = Fraction(1)
) -> Steklov:
    """A top with a Steklov motion, and a start on it with Ω1 = 0 and γ = ±e1, all rational.

    first, second: I1 and I2 over ``size``.  ratio: s = Ω2/Ω3 at the start, I3 = ½ (I1 + s² (I1 − 2 I2)).  rate: Ω3
    there.  upwards: −1 turns γ and r round.  Raises InputError where a moment would not be positive or two are equal.
    """
    a, b = size * first, size * second
    c = (a + ratio**2 * (a - 2 * b)) / 2
    if min(a, b, c) <= 0 or 0 in ((a - b) * (a - c) * (b - c), (a - 2 * b) * (a - 2 * c), rate):
        raise InputError(
            f"No Steklov top has moments ({shown(a)}, {shown(b)}, {shown(c)}) and rate {shown(rate)}.",
            "Give three different positive moments, I1 not twice another one, and a rate other than 0.",
        )
    _, _, _, c0 = quadratics(a, b, c)
    height = rate**2 / c0
    top = HeavyTop((a, b, c), 1, (upwards * height, 0, 0))
    return Steklov(top, State((0, ratio * rate, rate), (upwards, 0, 0)))
