"""Statements on motions, against own computations: stability, the end of digits, the power of a test.

``python validation/statements.py stability|digits|power [count] [seed]``: of random steady motions the verdict and the
rate against eigenvalues in 60 digits; of random motions near an unstable rotation the time at which all digits are
lost against runs of three integrators in double, extended and quad, none of which may have digits then; of random
bodies the time from which a planted fault is detected, against the classical Runge-Kutta method written here.
``float32`` is left out, whose bits no other code repeats.
Exit code 1 where a statement is contradicted.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from itertools import pairwise
from time import process_time

import mpmath
import numpy as np

import heavytop as ht
from heavytop import arguments
from heavytop.integrate.frames import Setup
from heavytop.integrate.registry import control_name, propagator
from heavytop.precision import DOUBLE, Precision, exact
from heavytop.top.equations import HEAVY_GYROSTAT, HEAVY_TOP
from heavytop.top.stability import stability

FORMATS = ("double", "extended", "quad")
INTEGRATORS = ("heyoka", "multiword", "splitting:8", "scipy:DOP853")
"""Their state is rounded to the format after each step, that of multiword once, where it is begun anew."""
IN_DOUBLE = INTEGRATORS[2:]


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


def dyadic(*values: float) -> list[Fraction]:
    """Exact in every format, so that no run is charged with the rounding of its data."""
    return [Fraction(float(value)) for value in values]


def sensitive(draw: random.Random, kind: str, bits: int) -> tuple[ht.HeavyTop, ht.State, int]:
    """A motion that passes a saddle again and again, or a chaotic one; a time by which it may have lost its bits."""
    small, rotor = 2 ** (bits * draw.uniform(-0.9, -0.5)), None
    omega, gamma, until = [small, 0.0, small / 3], (0, 1, 0), 150
    inertia, moment = [draw.uniform(1, 2) for _ in range(3)], [0.0, 0.0, 0.0]
    if kind == "thin":
        thin = draw.uniform(0.08, 0.12)
        inertia, omega, until = [thin, 1, 1 + thin * draw.uniform(0.4, 0.7)], [0, draw.uniform(9, 12), small], 30
    elif kind == "middle axis":
        low, middle = sorted(draw.uniform(0.5, 3) for _ in range(2))
        inertia, omega[1], until = [low, middle, draw.uniform(middle, low + middle)], draw.uniform(1, 4), 300
    elif kind in ("upright", "sleeping"):
        gamma, moment[2] = (0, 0, 1), draw.uniform(1, 3)
        if kind == "sleeping":  # Lagrange's top on its axis, too slow
            inertia[1] = inertia[0]
            omega[2] = draw.uniform(0.1, 0.9) * 2 * (inertia[0] * moment[2]) ** 0.5 / inertia[2]
    else:
        moment, omega = [draw.uniform(-1, 1) for _ in range(3)], [draw.uniform(-1, 1) for _ in range(3)]
        rotor, until = dyadic(*(draw.uniform(-0.3, 0.3) for _ in range(3))) if kind == "rotor" else None, 1000
    return ht.HeavyTop(dyadic(*inertia), 1, dyadic(*moment), rotor), ht.State(dyadic(*omega), gamma), until


SENSITIVE = ("thin", "middle axis", "upright", "sleeping", "chaotic", "rotor")


def computed(
    integrator: str, top: ht.HeavyTop, start: ht.State, times: list[Fraction], form: Precision
) -> list[list[Fraction]]:
    """Exact values of the states; multiword starts anew from each rounded state, and rounds nowhere else."""
    run = propagator(integrator, {})
    system = HEAVY_TOP if top.rotor is None else HEAVY_GYROSTAT
    if integrator != "multiword":
        return [[exact(v) for v in row[:6]] for row in run(top, start, times, form, system=system).states]
    states = []
    for begin, end in pairwise([Fraction(0), *times]):
        (row,) = run(top, start, [end - begin], form, system=system).states
        states.append([exact(v) for v in row[:6]])
        start = ht.State(states[-1][:3], states[-1][3:])
    return states


def of_digits(count: int, seed: int) -> int:
    draw, wrong, runs, slowest = random.Random(seed), 0, 0, 0.0
    ends: Counter[str] = Counter()
    for index in range(count):
        kind = SENSITIVE[index % len(SENSITIVE)]
        for name in FORMATS:
            form = arguments.precision(name)
            top, start, until = sensitive(draw, kind, form.bits)
            began = process_time()
            lost = ht.digits_end(top, start, until * form.bits // 53, name).last
            slowest = max(slowest, process_time() - began)
            ends["later" if lost is None else "proven" if lost.proven else "computed"] += 1
            if lost is None:
                continue
            times = [lost.time * k / 32 for k in range(1, 37)]
            known = ht.reference(top, start, times, 10).to_numpy()
            for integrator in INTEGRATORS:
                if name != "double" and integrator in IN_DOUBLE:
                    continue
                rows = np.array([[float(v) for v in row] for row in computed(integrator, top, start, times, form)])
                runs += 1
                error = (np.abs(rows - known) / np.maximum(1, np.abs(known))).max()
                if error < 0.1:
                    wrong += 1
                    print(f"{integrator} in {name}: error {error:.3g} by t = {float(times[-1]):.4g}: {top}, {start}")
    print(f"digits: {wrong} of {runs} runs contradict an end of digits; ends {dict(ends)}; slowest {slowest:.1f} s")
    return wrong


def runge_kutta(rate: Callable[[np.ndarray], np.ndarray], state: np.ndarray, count: int, step: float) -> np.ndarray:
    """Samples at every half step, by the classical method."""
    parts = 2 * max(5, round(step / 0.008))
    samples, h = [], step / parts
    for index in range(parts * count):
        a = rate(state)
        b = rate(state + h / 2 * a)
        c = rate(state + h / 2 * b)
        state = state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))
        if (index + 1) % (parts // 2) == 0:
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


def sampled(
    begin: np.ndarray, count: int, step: float, tensor: np.ndarray, moment: np.ndarray, gyroscopic: bool = True
) -> np.ndarray:
    """Samples of this body at every half step."""
    return runge_kutta(rates(tensor, moment, gyroscopic), begin, count, step)


METHODS = (("heyoka", None), ("scipy:DOP853", "1e-6"), ("scipy:DOP853", "1e-10"), ("splitting:4", "1/64"))


def of_power(count: int, seed: int) -> int:
    draw, wrong, faults = random.Random(seed), 0, 0
    for _ in range(count):
        mass, gravity = draw.uniform(1, 3), 9.81
        centre = np.array([draw.uniform(-0.3, 0.3) for _ in range(3)])
        central = np.diag([draw.uniform(0.9, 1.1), draw.uniform(0.7, 0.9), draw.uniform(0.5, 0.7)])
        tensor = central + (steiner := mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)))
        exchanged = tensor[[0, 0, 0, 0, 1, 1, 0, 1, 2], [0, 1, 2, 1, 1, 2, 2, 2, 2]].reshape(3, 3)
        exchanged[0, 1] = exchanged[1, 0] = tensor[1, 2]
        exchanged[1, 2] = exchanged[2, 1] = tensor[0, 1]
        omega = [draw.uniform(-2, 2) for _ in range(3)]
        body = ht.Body(mass, gravity, centre, central.ravel(), "centre of mass")
        start = ht.State(omega=omega, attitude=ht.Attitude.quaternion(1, 0, 0, 0))
        limit, step, samples = 10 ** draw.uniform(-5, -1), draw.choice(("1/20", "1/10", "1/5")), draw.randint(5, 25)
        integrator, control = draw.choice(METHODS)
        begin, apart = np.array([*omega, *np.eye(3).ravel()]), float(Fraction(step))
        moment = mass * gravity * centre

        samples_of = partial(sampled, begin, samples, apart)

        halves = samples_of(tensor, moment)
        true = halves[1::2]
        planted = {
            "no_gyroscopic_term": samples_of(tensor, moment, False)[1::2],
            "gravity_9.8": samples_of(tensor, moment * (9.8 / 9.81))[1::2],
            "steiner_forgotten": samples_of(central, moment)[1::2],
            "steiner_twice": samples_of(tensor + steiner, moment)[1::2],
            "tensor_order": samples_of(exchanged, moment)[1::2],
            "late": halves[::2],
            "transposed": np.c_[true[:, :3], true[:, 3:].reshape(-1, 3, 3).swapaxes(1, 2).reshape(-1, 9)],
        }
        until = Fraction(step) * samples
        settings = {"integrator": integrator, "control": control}
        made = ht.power(body, start, until, f"{limit!r}", step, [*planted], **settings)
        options = {} if control is None else {control_name(integrator): Fraction(control)}
        setup = Setup.of(body, start, DOUBLE, HEAVY_TOP)
        run = setup.given(propagator(integrator, options)(setup.top, setup.start, made.times))
        of_state = true[:, [0, 1, 2, 9, 10, 11]]
        right = (np.abs(run.to_numpy()[:, :6] - of_state) / np.maximum(1, np.abs(of_state))).max()
        if abs(made.error - right) > 0.01 * right + 1e-8 or made.left_out:
            wrong += 1
            print(f"right run of {integrator}: {made.error:.3g}, by own code {right:.3g}; {made.left_out}")
        for fault in made.faults:
            faults += 1
            errors = (np.abs(planted[fault.name] - true) / np.maximum(1, np.abs(true))).max(axis=1)
            first = int(np.argmax(errors > limit)) if (errors > limit).any() else None
            said = None if fault.detected_from is None else round(float(fault.detected_from) / apart) - 1
            if said != first or abs(fault.tolerance / errors.max() - 1) > 1e-5:
                wrong += 1
                print(
                    f"{fault.name}: from {said}, by own code {first}; widest {fault.tolerance:.6g}, {errors.max():.6g}"
                )
    print(f"power: {wrong} of {faults} faults and {count} right runs contradicted")
    return wrong


if __name__ == "__main__":
    what = {"stability": (of_stability, 200), "digits": (of_digits, 24), "power": (of_power, 30)}
    run, usual = what[sys.argv[1]]
    numbers = [int(text) for text in sys.argv[2:]]
    sys.exit(1 if run(*(numbers + [usual, 1][len(numbers) :])) else 0)
