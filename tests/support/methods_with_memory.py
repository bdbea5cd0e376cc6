"""Methods in fixed steps that keep a memory, healthy and with a fault each: peers, and a program over the protocol.

As a module it has ``NAME``, and ``NAME_declared`` with ``one_step=False``; with a name as its argument it is a program.
"""

import sys
from math import ceil
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "src"))

AB2, AB4 = [3 / 2, -1 / 2], [55 / 24, -59 / 24, 37 / 24, -9 / 24]


def moved(y, *terms):
    """y + the sum of (factor, vector)."""
    return [a + sum(factor * vector[i] for factor, vector in terms) for i, a in enumerate(y)]


def euler(f, y, h):
    return moved(y, (h, f(y)))


def rk4(f, y, h):
    k1 = f(y)
    k2 = f(moved(y, (h / 2, k1)))
    k3 = f(moved(y, (h / 2, k2)))
    k4 = f(moved(y, (h, k3)))
    return moved(y, (h / 6, k1), (h / 3, k2), (h / 3, k3), (h / 6, k4))


def solved(step, guess):
    """The fixed point of ``step``."""
    for _ in range(80):
        last, guess = guess, step(guess)
        if max(abs(a - b) for a, b in zip(last, guess, strict=True)) < 1e-15:
            break
    return guess


def adams_bashforth(weights, starter):
    def advance(f, y, h):
        past = [f(y)]
        while True:
            short = len(past) < len(weights)
            y = starter(f, y, h) if short else moved(y, *((h * w, k) for w, k in zip(weights, past, strict=True)))
            past = [f(y), *past][: len(weights)]
            yield y

    return advance


def predictor_corrector(last=-5 / 24):
    def advance(f, y, h):
        past = [f(y)]
        while True:
            if len(past) < 4:
                y = rk4(f, y, h)
            else:
                guess = moved(y, *((h * w, k) for w, k in zip(AB4, past, strict=True)))
                weights = (9 / 24, f(guess)), (19 / 24, past[0]), (last, past[1]), (1 / 24, past[2])
                y = moved(y, *((h * w, k) for w, k in weights))
            past = [f(y), *past][:4]
            yield y

    return advance


def bdf2(lead=2 / 3):
    def advance(f, y, h):
        before = None
        while True:
            base, share = (y, h) if before is None else (moved(y, (1 / 3, y), (-1 / 3, before)), lead * h)
            before, y = y, solved(lambda new, base=base, share=share: moved(base, (share, f(new))), y)
            yield y

    return advance


def generalized_alpha(gamma=0.0, radius=0.8):
    """Of Jansen, Whiting and Hulbert, for equations of first order."""
    inner, outer = (3 - radius) / (1 + radius) / 2, 1 / (1 + radius)
    gamma = gamma or 0.5 + inner - outer

    def advance(f, y, h):
        rate = f(y)
        while True:

            def end(new, y=y, rate=rate):
                return moved(y, (h * (1 - gamma), rate), (h * gamma, new))

            def step(new, y=y, rate=rate, end=end):
                between = [(1 - outer) * a + outer * b for a, b in zip(y, end(new), strict=True)]
                return [(a - (1 - inner) * b) / inner for a, b in zip(f(between), rate, strict=True)]

            new = solved(step, rate)
            y, rate = end(new), new
            yield y

    return advance


def leapfrog(first=0.5):
    """Its second state, half a step on, is stored."""

    def advance(f, y, h):
        half = euler(f, y, first * h)
        while True:
            y = moved(y, (h, f(half)))
            half = moved(half, (h, f(y)))
            yield y

    return advance


def extrapolation(weight=4 / 3):
    """Of the modified midpoint rule, of 2 and 4 parts of a step: it keeps no memory."""

    def midpoint(f, y, h, count):
        before, now = y, moved(y, (h / count, f(y)))
        for _ in range(count - 1):
            before, now = now, moved(before, (2 * h / count, f(now)))
        return [(a + b + h / count * c) / 2 for a, b, c in zip(before, now, f(now), strict=True)]

    def advance(f, y, h):
        while True:
            fine, coarse = midpoint(f, y, h, 4), midpoint(f, y, h, 2)
            y = [weight * a + (1 - weight) * b for a, b in zip(fine, coarse, strict=True)]
            yield y

    return advance


def one_step(step):
    """A method without a memory."""

    def advance(f, y, h):
        while True:
            y = step(f, y, h)
            yield y

    return advance


HEALTHY = {
    "ab2": (adams_bashforth(AB2, euler), 2),
    "ab4": (adams_bashforth(AB4, rk4), 4),
    "bdf2": (bdf2(), 2),
    "alpha": (generalized_alpha(), 2),
    "leapfrog": (leapfrog(), 2),
    "extrapolation": (extrapolation(), 4),
    "corrected": (predictor_corrector(), 4),
}
FAULTY = {
    "ab4_first": (adams_bashforth([55.001 / 24, *AB4[1:]], rk4), 4),
    "ab4_second": (adams_bashforth([AB4[0], -59.001 / 24, *AB4[2:]], rk4), 4),
    "ab2_claims_4": (adams_bashforth(AB2, rk4), 4),
    "bdf2_lead": (bdf2(0.667), 2),
    "alpha_gamma": (generalized_alpha(0.7), 2),
    "leapfrog_first": (leapfrog(0.6), 2),
    "extrapolation_weight": (extrapolation(1.3), 4),
    "corrected_last": (predictor_corrector(-5.001 / 24), 4),
}
METHODS = HEALTHY | FAULTY | {"classical": (one_step(rk4), 4)}


def states(advance, f, y, times, step):
    """Each state with the number of steps so far: begun anew at each time."""
    t, count = 0.0, 0
    for end in times:
        n = max(1, ceil(abs(end - t) / step - 1e-9))
        going = advance(f, y, (end - t) / n)
        for _ in range(n if end != t else 0):
            y = next(going)
        t, count = end, count + n
        yield y, count


def solver(advance):
    def solve(given):
        from heavytop.integrate.peers.double import Solved

        found = list(states(advance, given.field, given.start.tolist(), given.times.tolist(), given.setting))
        return Solved([y for y, _ in found], given.times[-1], found[-1][1])

    return solve


def with_quaternion(p, y):
    """(Ω', q') of the heavy top: q' = ½ q (0, Ω)."""
    from heavytop.top.attitude import matrix_of_quaternion
    from heavytop.top.equations import HEAVY_TOP

    (a, b, c), (w, x, y_, z) = y[:3], y[3:]
    rates = HEAVY_TOP.field(p, (a, b, c, *matrix_of_quaternion(y[3:])[2]))[:3]
    turned = (-x * a - y_ * b - z * c, w * a + y_ * c - z * b, w * b + z * a - x * c, w * c + x * b - y_ * a)
    return [*rates, *(part / 2 for part in turned)]


def serve(name):
    from heavytop.top.equations import HEAVY_TOP, Parameters

    print("ready", name, "1", end="\n", flush=True) if next(sys.stdin) else None
    given = {}
    for line in sys.stdin:
        key, *words = line.split()
        given[key] = words
        if key == "quit":
            return
        if key == "go":
            inertia, moment, y, q = (
                [float(word) for word in given.get(part, ())] for part in ("inertia", "moment", "state", "quaternion")
            )
            p = Parameters(inertia, moment, 0.0)
            field, y = (with_quaternion, y[:3] + q) if q else (HEAVY_TOP.field, y)
            times, step = given["times"][1:], float(given.get("setting", ["0.01"])[0])
            counts = [0]
            found = states(METHODS[name][0], lambda y, p=p, field=field: field(p, y), y, map(float, times), step)
            for text, (state, count) in zip(times, found, strict=True):
                print("state", text, *map(repr, state))
                counts.append(count)
            print("done steps", counts[-1], flush=True)


if __name__ == "__main__":
    serve(sys.argv[1])
else:
    from heavytop.integrate.peers.double import double_peer

    for _name, (_advance, _order) in METHODS.items():
        globals()[_name] = double_peer(_name, _order, solver(_advance), "step")
        globals()[f"{_name}_declared"] = double_peer(_name, _order, solver(_advance), "step", one_step=False)
