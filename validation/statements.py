"""Statements on motions, against own computations: stability, the end of digits, the power of a test.

``python validation/statements.py stability|digits|power [count] [seed]``: of random steady motions the verdict and the
rate against eigenvalues in 60 digits; of random motions near an unstable rotation the time at which all digits are
lost against runs of three integrators in double, extended and quad, none of which may have digits then; of random
bodies the time from which a planted fault is detected, against the classical Runge-Kutta method written here.
Exit code 1 where a statement is contradicted.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Callable
from fractions import Fraction

import mpmath
import numpy as np

import heavytop as ht
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP
from heavytop.top.stability import stability

FORMATS = ("double", "extended", "quad")
INTEGRATORS = ("heyoka", "splitting:8", "scipy:DOP853")
"""Their state is rounded to the format after each step; multiword carries more bits and rounds what it returns."""


def rational(draw: random.Random, least: int = -12, most: int = 12) -> Fraction:
    return Fraction(draw.randint(least, most), draw.randint(1, 6))


def steady(draw: random.Random) -> tuple[ht.HeavyTop, ht.State]:
    """A top, free, heavy or with a rotor, that turns steadily about a principal axis, or about a tilted vertical."""
    inertia = [rational(draw, 6, 24) for _ in range(3)]
    spin, axis = rational(draw) * draw.choice((0, 1, 3)), draw.randrange(3)
    unit = [int(k == axis) for k in range(3)]
    kind = draw.choice(("free", "heavy", "rotor", "tilted"))
    if kind == "tilted":
        gamma = [Fraction(2, 7), Fraction(-6, 7), Fraction(3, 7)]
        lever = rational(draw)
        moment = [spin**2 * i * g + lever * g for i, g in zip(inertia, gamma, strict=True)]
        return ht.HeavyTop(inertia, 1, moment), ht.State([spin * g for g in gamma], gamma)
    omega, sign = [spin * u for u in unit], draw.choice((-1, 1))
    if kind == "free":
        return ht.HeavyTop(inertia, 0, (0, 0, 0)), ht.State(omega, ("2/7", "3/7", "6/7"))
    rotor = [rational(draw) * u for u in unit] if kind == "rotor" else None
    return ht.HeavyTop(inertia, 1, [rational(draw) * u for u in unit], rotor), ht.State(omega, [sign * u for u in unit])


def skew(v: list[Fraction]) -> mpmath.matrix:
    """[v]×."""
    a, b, c = (mpmath.mpf(x.numerator) / x.denominator for x in v)
    return mpmath.matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])


def growth(top: ht.HeavyTop, start: ht.State) -> mpmath.mpf:
    """max Re λ of I Ω' = (I Ω + k) × Ω + γ × n, γ' = γ × Ω, linearised by hand; of Ω alone for a free body."""
    tensor = mpmath.diag([mpmath.mpf(i.numerator) / i.denominator for i in top.inertia])
    moment = [top.weight * c for c in top.centre]
    momentum = [i * w + k for i, w, k in zip(top.inertia, start.omega, top.rotor or (0, 0, 0), strict=True)]
    spinning = tensor**-1 * (skew(momentum) - skew(list(start.omega)) * tensor)
    if not any(moment):
        return max(mpmath.re(value) for value in mpmath.eig(spinning, left=False, right=False))
    full = mpmath.zeros(6)
    full[:3, :3], full[:3, 3:] = spinning, -(tensor**-1) * skew(moment)
    full[3:, :3], full[3:, 3:] = skew(list(start.gamma)), -skew(list(start.omega))
    return max(mpmath.re(value) for value in mpmath.eig(full, left=False, right=False))


def of_stability(count: int, seed: int) -> int:
    draw, wrong, unstable = random.Random(seed), 0, 0
    for _ in range(count):
        top, start = steady(draw)
        system = HEAVY_TOP if top.rotor is None else HEAVY_GYROSTAT
        verdict = stability(system, system.parameters(top, start), start.flat)
        with mpmath.workdps(60):
            rate = growth(top, start)
            # a double eigenvalue 0 is split by rounding to the power 1/2, one of order four to the power 1/4
            said_unstable, is_unstable = verdict is not None and verdict.verdict == "unstable", rate > 1e-12
            unstable += is_unstable
            if (
                verdict is None
                or said_unstable != is_unstable
                or (is_unstable and abs(verdict.rate / rate - 1) > 1e-12)
            ):
                wrong += 1
                print(f"{verdict}, eigenvalues {mpmath.nstr(rate, 10)}: {top}, {start}")
    print(f"stability: {wrong} of {count} contradicted, {unstable} unstable")
    return wrong


def of_digits(count: int, seed: int) -> int:
    draw, wrong, runs = random.Random(seed), 0, 0
    for _ in range(count):
        small = Fraction(draw.randint(8, 12), 100)
        moments = [small, Fraction(1), 1 + small * Fraction(draw.randint(4, 7), 10)]
        top = ht.HeavyTop(moments, 0, (0, 0, 0))
        start, until = ht.State([0, draw.randint(9, 12), Fraction(draw.randint(1, 9), 10**10)], (0, 1, 0)), 12
        for name in FORMATS:
            lost = ht.digits_end(top, start, until, name).last
            if lost is None or not lost.proven:
                continue
            times = [lost.time * k / 8 for k in range(1, 10)]
            known = ht.reference(top, start, times, 60)
            true = np.array([[mpmath.mpf(text) for text in row[:6]] for row in known.texts()])
            for integrator in INTEGRATORS:
                try:
                    run = ht.propagate(top, start, times, name, integrator=integrator)
                except ht.HeavyTopError:
                    continue
                rows = np.array([[mpmath.mpf(str(value)) for value in row[:6]] for row in run.states])
                runs += 1
                error = max(abs(a - b) for a, b in zip(rows.ravel(), true[: len(rows)].ravel(), strict=True))
                if error < 0.05:
                    wrong += 1
                    end = f"{mpmath.nstr(error, 3)} at t = {float(lost.time):.4g}"
                    print(f"{integrator} in {name}: error {end}: {top}, {start}")
    print(f"digits: {wrong} of {runs} runs contradict a proven end")
    return wrong


def runge_kutta(rate: Callable[[np.ndarray], np.ndarray], state: np.ndarray, count: int, step: float) -> np.ndarray:
    """Samples behind each step, by 50 steps of the classical method in each."""
    samples, h = [], step / 50
    for _ in range(count):
        for _ in range(50):
            a = rate(state)
            b = rate(state + h / 2 * a)
            c = rate(state + h / 2 * b)
            state = state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))
        samples.append(state)
    return np.array(samples)


def rates(tensor: np.ndarray, moment: np.ndarray, gyroscopic: bool = True) -> Callable[[np.ndarray], np.ndarray]:
    """Of Ω and the rows of R."""
    inverse = np.linalg.inv(tensor)

    def rate(state: np.ndarray) -> np.ndarray:
        omega, rows = state[:3], state[3:].reshape(3, 3)
        torque = np.cross(rows[2], moment) + (np.cross(tensor @ omega, omega) if gyroscopic else 0)
        return np.concatenate([inverse @ torque, np.cross(rows, omega).ravel()])

    return rate


def of_power(count: int, seed: int) -> int:
    draw, wrong, faults = random.Random(seed), 0, 0
    for _ in range(count):
        mass, gravity = draw.uniform(1, 3), 9.81
        centre = np.array([draw.uniform(-0.3, 0.3) for _ in range(3)])
        central = np.diag([draw.uniform(0.9, 1.1), draw.uniform(0.7, 0.9), draw.uniform(0.5, 0.7)])
        steiner = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        omega = [draw.uniform(-2, 2) for _ in range(3)]
        body = ht.Body(mass, gravity, centre, central.ravel(), "centre of mass")
        start = ht.State(omega=omega, attitude=ht.Attitude.quaternion(1, 0, 0, 0))
        limit, step, samples = 10 ** draw.uniform(-4, -1), 0.1, 30
        begin = np.array([*omega, *np.eye(3).ravel()])
        moment = mass * gravity * centre
        true = runge_kutta(rates(central + steiner, moment), begin, samples, step)
        planted = {
            "no_gyroscopic_term": runge_kutta(rates(central + steiner, moment, False), begin, samples, step),
            "gravity_9.8": runge_kutta(rates(central + steiner, moment * (9.8 / 9.81)), begin, samples, step),
            "steiner_forgotten": runge_kutta(rates(central, moment), begin, samples, step),
            "steiner_twice": runge_kutta(rates(central + 2 * steiner, moment), begin, samples, step),
            "transposed": np.c_[true[:, :3], true[:, 3:].reshape(-1, 3, 3).swapaxes(1, 2).reshape(-1, 9)],
        }
        made = ht.power(body, start, "3", f"{limit!r}", "0.1", [*planted])
        for fault in made.faults:
            faults += 1
            errors = (np.abs(planted[fault.name] - true) / np.maximum(1, np.abs(true))).max(axis=1)
            first = int(np.argmax(errors > limit)) if (errors > limit).any() else None
            said = None if fault.detected_from is None else round(float(fault.detected_from) / step) - 1
            if said != first or abs(fault.tolerance / errors.max() - 1) > 1e-6:
                wrong += 1
                print(
                    f"{fault.name}: from {said}, by own code {first}; widest {fault.tolerance:.6g}, {errors.max():.6g}"
                )
    print(f"power: {wrong} of {faults} faults in {count} tests contradicted")
    return wrong


if __name__ == "__main__":
    what = {"stability": (of_stability, 200), "digits": (of_digits, 4), "power": (of_power, 30)}
    run, usual = what[sys.argv[1]]
    numbers = [int(text) for text in sys.argv[2:]]
    sys.exit(1 if run(*(numbers + [usual, 1][len(numbers) :])) else 0)
