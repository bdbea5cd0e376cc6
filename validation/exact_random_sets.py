"""Motions from random exact data: proofs, agreement with the enclosure and speed, printed.

    python validation/exact_random_sets.py [COUNT] [SEED] [PART OF A NAME]

For COUNT (50) starts of each class with Abel integrals, and COUNT/5 on and beside the degenerate levels: the residual
of all six equations at 60 digits, the enclosure at |t| = 10 to 50 digits, and seconds of this process for 50 digits at
t = 10^6.  Goryachev's, N. Kowalewski's and Chaplygin's starts are algebraic: their enclosure is that of data rounded to
280 bits.  Then both forms of Kovalevskaya's motion at nine tops and four times to 10^9, and the attitude of both
hyperelliptic tops ("attitude" as PART OF A NAME).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from random import Random
from statistics import median
from time import process_time
from typing import Any

from flint import arb

from heavytop.errors import HeavyTopError
from heavytop.exact.cases.algebraic_starts import AlgebraicMotion, chaplygin_motion, goryachev_motion, kowalewski_motion
from heavytop.exact.cases.dokshevich import AlgebraicDokshevich, dokshevich_motion
from heavytop.exact.cases.goryachev_chaplygin import GoryachevChaplygin, Sretensky
from heavytop.exact.cases.hess import Hess, HessPendulum
from heavytop.exact.cases.kovalevskaya import AbelMotion, Kovalevskaya
from heavytop.exact.cases.kovalevskaya_theta import KovalevskayaLevel, ThetaMotion
from heavytop.exact.cases.one_interval import gaps
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import ball, working_precision
from heavytop.top.equations import HEAVY_TOP, Parameters
from heavytop.top.heavy_top import HeavyTop, State

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
from rational_motions import steklov_motion

F = Fraction
LATE = F(10**6)
BITS_40, BITS_50, BITS_60 = 134, 168, 200
FAMILY = Callable[[Random], Any]
NOT_EXACT = 280


def rational(random: Random, size: int = 4, finest: int = 12) -> Fraction:
    bottom = random.randint(1, finest)
    return F(random.randint(-size * bottom, size * bottom), bottom)


def positive(random: Random) -> Fraction:
    return abs(rational(random)) + F(1, 3)


def kovalevskaya(random: Random) -> Kovalevskaya:
    i3 = positive(random)
    top = HeavyTop((2 * i3, 2 * i3, i3), 1, (positive(random), rational(random), 0))
    return Kovalevskaya(top, State([rational(random) for _ in range(3)], [rational(random) for _ in range(3)]))


def on_a_level(random: Random) -> Kovalevskaya:
    """γ on axis 3: outside the gaps, or asymptotic; those where both variables tend to the root are refused."""
    top = HeavyTop((2, 2, 1), 1, (positive(random), rational(random), 0))
    return Kovalevskaya(top, State([rational(random) for _ in range(3)], (0, 0, rational(random))))


def beside(exponent: int) -> FAMILY:
    def family(random: Random) -> Kovalevskaya:
        t = F(1, 10**exponent)
        top = HeavyTop((2, 2, 1), 1, (positive(random), rational(random), 0))
        gamma = (2 * t / (1 + t * t), 0, (1 - t * t) / (1 + t * t))
        return Kovalevskaya(top, State([rational(random) for _ in range(3)], gamma))

    return family


def goryachev_chaplygin(random: Random) -> GoryachevChaplygin:
    # no fast spin, which M·γ = 0 makes of a small γ3: the enclosure would take minutes
    i3, (g1, g2, g3) = positive(random), (rational(random, 1), rational(random, 1), 1 + positive(random))
    top = HeavyTop((4 * i3, 4 * i3, i3), 1, (positive(random), rational(random), 0))
    w1, w2 = rational(random, 2), rational(random, 2)
    return GoryachevChaplygin(top, State((w1, w2, -4 * (w1 * g1 + w2 * g2) / g3), (g1, g2, g3)))


def sretensky(random: Random) -> Sretensky:
    plain, rotor = goryachev_chaplygin(random), rational(random, 1)
    top, (w1, w2, w3) = plain.top, plain.start.omega
    carrying = HeavyTop(top.inertia, top.weight, top.centre, (0, 0, rotor * top.inertia[2]))
    return Sretensky(carrying, State((w1, w2, w3 - rotor), plain.start.gamma))


def with_a_common_root(random: Random) -> GoryachevChaplygin:
    """G = 0: p = r = 0."""
    top = HeavyTop((4, 4, 1), 1, (positive(random), 0, 0))
    return GoryachevChaplygin(top, State((0, rational(random), 0), (rational(random), 0, positive(random))))


def near_a_common_root(exponent: int) -> FAMILY:
    def family(random: Random) -> GoryachevChaplygin:
        w1, w2, g1, g3 = F(1, 10**exponent), rational(random), rational(random), positive(random)
        top = HeavyTop((4, 4, 1), 1, (positive(random), 0, 0))
        return GoryachevChaplygin(top, State((w1, w2, -4 * w1 * g1 / g3), (g1, 0, g3)))

    return family


def hess_data(random: Random) -> tuple[HeavyTop, list[Fraction], list[Fraction]]:
    i1, i3, a, c = (positive(random) for _ in range(4))
    share = (a / c) ** 2
    top = HeavyTop((i1, i1 * i3 * (1 + share) / (i1 * share + i3), i3), 1, (a, 0, c))
    w1 = rational(random, 2)
    gamma = [rational(random, 1), 1 + positive(random), rational(random, 1)]
    return top, [w1, rational(random, 2), -i1 * a * w1 / (i3 * c)], gamma


def hess(random: Random) -> Hess:
    top, omega, gamma = hess_data(random)
    return Hess(top, State(omega, gamma))


def hess_beside(area: Fraction) -> FAMILY:
    def family(random: Random) -> Hess | HessPendulum:
        top, omega, gamma = hess_data(random)
        (i1, i2, i3), (w1, _, w3) = top.inertia, omega
        omega[1] = (area - i1 * w1 * gamma[0] - i3 * w3 * gamma[2]) / (i2 * gamma[1])
        return (Hess if area else HessPendulum)(top, State(omega, gamma))

    return family


def dokshevich(random: Random) -> Any:
    low, high = sorted(positive(random) for _ in range(2))
    middle = low + (high - low) * F(random.randint(1, 15), 16)
    return dokshevich_motion((low, middle, high), F(random.choice((1, -1)) * random.randint(1, 15), 16))


def steklov(random: Random) -> Any:
    return steklov_motion(*(positive(random) / 2 for _ in range(4)), random.choice((1, -1)), positive(random))


def algebraic(build: Callable[..., AlgebraicMotion], low: Fraction, high: Fraction, side: int) -> FAMILY:
    def family(random: Random) -> AlgebraicMotion:
        second, other = low + (high - low) * F(random.randint(0, 64), 64), side * (positive(random) + 1)
        first, last = gaps(build(second, other).curve)[0]
        place = F(first) + (F(last) - F(first)) * F(random.randint(1, 31), 32)
        return build(second, other, place, (random.choice((1, -1)), random.choice((1, -1))))

    family.__qualname__ = build.__name__
    return family


def data(motion: Any) -> tuple[HeavyTop, State]:
    is_algebraic = isinstance(motion, AlgebraicMotion | AlgebraicDokshevich)
    return motion.rounded(NOT_EXACT) if is_algebraic else (motion.top, motion.start)


def afresh(motion: Any) -> Any:
    """The motion without what was made for it."""
    if isinstance(motion, AlgebraicDokshevich):
        return AlgebraicDokshevich(motion.inertia, motion.place)
    if isinstance(motion, AlgebraicMotion):
        return AlgebraicMotion(motion.curve, motion.place, motion.signs, motion.method)
    return type(motion)(motion.top, motion.start)


def residual(motion: Any, time: Fraction) -> float:
    """The largest radius of y' − f(y); raises AssertionError where a ball does not hold 0."""
    series = motion.series(time, 3, BITS_60)
    with working_precision(2 * BITS_60):
        if isinstance(motion, AlgebraicMotion | AlgebraicDokshevich):
            p = Parameters([ball(i) for i in motion.inertia], motion.moment(2 * BITS_60), arb(0))
        else:
            p = motion.system.parameters(motion.top, motion.start).mapped(lambda value: ball(F(value)))
        rates = getattr(motion, "system", HEAVY_TOP).field(p, series)
        values = [(y.derivative() - rate)[k] for y, rate in zip(series, rates, strict=True) for k in (0, 1)]
    assert all(value.contains(0) for value in values)
    return max(float(value.rad()) for value in values)


def drawn(family: FAMILY, count: int, seed: int) -> Iterator[Any]:
    random, refused = Random(f"{family.__qualname__} {seed}"), 0
    while count:
        try:
            yield family(random)
            count -= 1
        except HeavyTopError:
            refused += 1
    print(f"    ({refused} drawn starts refused)")


def survey(name: str, family: FAMILY, count: int, seed: int) -> None:
    print(f"{name}, {count} starts", flush=True)
    radii, apart, made, states, compared = [], [], [], [], 0
    for motion in drawn(family, count, seed):
        radii.append(residual(motion, F(7, 3)))
        motion = afresh(motion)
        began = process_time()
        motion.state(LATE, BITS_50)
        made.append(process_time() - began)
        began = process_time()
        for step in range(1, 4):
            motion.state(LATE + step, BITS_50)
        states.append((process_time() - began) / 3)
        enclosure = Validated(*data(motion), getattr(motion, "system", HEAVY_TOP), effort=10.0)
        try:
            for time in (F(10), F(-10)):
                pairs = list(zip(motion.state(time, BITS_50), enclosure.state(time, BITS_50), strict=True))
                off = max(float(abs(a - b).upper() / (1 + abs(a))) for a, b in pairs)
                exact = not isinstance(motion, AlgebraicMotion | AlgebraicDokshevich)
                assert off < 1e-50, data(motion)
                assert not exact or all(one.overlaps(other) for one, other in pairs), data(motion)
                apart.append(off)
            compared += 1
        except HeavyTopError as error:
            print("   ", error.cause)
    print(f"    residual: all hold 0, largest radius {max(radii):.1e}")
    print(f"    enclosure at |t| = 10: {compared} compared, farthest {max(apart):.1e}")
    print(f"    first state at t = 10^6: median {median(made):.3f} s, largest {max(made):.3f} s")
    print(f"    a state at t = 10^6: median {1e3 * median(states):.2f} ms, largest {1e3 * max(states):.1f} ms")


def attitudes(name: str, family: FAMILY, count: int, seed: int) -> None:
    """In how many motions the attitude has a closed form to 40 digits, and its seconds at t = 10^6."""
    made, states = [], []
    for motion in drawn(family, count, seed):
        motion.state(LATE, BITS_40)
        began = process_time()
        try:
            motion.attitude(LATE, BITS_40)
        except HeavyTopError as error:
            print("   ", error.cause)
            continue
        made.append(process_time() - began)
        began = process_time()
        for step in range(1, 4):
            motion.attitude(LATE + step, BITS_40)
        states.append((process_time() - began) / 3)
    print(f"attitude of {name}: {len(made)} of {count} by the closed form")
    print(f"    first at t = 10^6: median {median(made):.2f} s, largest {max(made):.2f} s")
    print(f"    one at t = 10^6: median {1e3 * median(states):.1f} ms, largest {1e3 * max(states):.1f} ms")


def meeting(seed: int) -> None:
    farthest, count = 0.0, 0
    for motion in drawn(kovalevskaya, 9, seed):
        level = KovalevskayaLevel.of(motion.top, motion.start)
        with working_precision(256):
            forms = AbelMotion.of(level, 1 << 17), ThetaMotion.of(level)
            for time in (F(0), F(100), LATE, F(10**9)):
                one, two = (form.at(time, 1) for form in forms)
                assert all(a.overlaps(b) for a, b in zip(one, two, strict=True))
                farthest = max(farthest, *(float(abs(a - b).upper()) for a, b in zip(one, two, strict=True)))
                count += 1
    print(f"both forms of Kovalevskaya's motion meet in {count} of {count} pairs, farthest {farthest:.1e}")


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    only = sys.argv[3] if len(sys.argv) > 3 else ""
    surveys: list[tuple[str, FAMILY, int]] = [
        ("Kovalevskaya", kovalevskaya, count),
        ("Goryachev-Chaplygin", goryachev_chaplygin, count),
        ("Sretensky", sretensky, count),
        ("Kovalevskaya on a degenerate level", on_a_level, count // 5),
        ("Goryachev-Chaplygin with G = 0", with_a_common_root, count // 5),
        ("Hess", hess, count),
        ("Hess, M·gamma = 0", hess_beside(F(0)), count),
        ("Steklov", steklov, count),
        ("Dokshevich", dokshevich, count),
        ("Goryachev", algebraic(goryachev_motion, F(601, 1000), F(624, 1000), -1), count),
        ("N. Kowalewski", algebraic(kowalewski_motion, F(589, 1000), F(644, 1000), 1), count),
        ("Chaplygin", algebraic(chaplygin_motion, F(1501, 1000), F(1596, 1000), 1), count),
        *((f"Goryachev-Chaplygin at 1e-{k} of G = 0", near_a_common_root(k), count // 5) for k in (1, 2, 3)),
        *((f"Hess at 1e-{k} of M·gamma = 0", hess_beside(F(1, 10**k)), count // 5) for k in (1, 2, 3)),
        *((f"Kovalevskaya at 1e-{k} of a degenerate level", beside(k), count // 5) for k in (1, 2, 3)),
    ]
    if not only:
        meeting(seed)
    for name, family in (
        ("Kovalevskaya", kovalevskaya),
        ("Goryachev-Chaplygin", goryachev_chaplygin),
        ("Sretensky", sretensky),
    ):
        if only in f"attitude of {name}":
            attitudes(name, family, count, seed)
    for name, family, number in surveys:
        if only in name:
            survey(name, family, number, seed)


if __name__ == "__main__":
    main()
