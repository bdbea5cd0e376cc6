"""How much faster are the balls than the same formulas on mpmath?

Whole states at t = 10^6 of the pendulum, Euler's, Lagrange's top and the gyrostat, everything that does not depend on
the time made before; our states are proven balls, mpmath's plain numbers.  Three users of mpmath:

- parameters: what the manual offers.  ellipfun(kind, u, m=m) for sn, cn, dn, ellippi for the angles; no nome, no period
  is kept, for mpmath has no notion of a lattice already made.  The gyrostat, whose quartic has no Legendre form at
  hand, computes its periods and null values anew and goes on as below.
- nome_made: ellipfun(kind, u, q=q), nome and period made before, where there are Jacobi functions; angles as above.
- thetas: the formulas of exact/ as theta quotients, nome and null values made before, each theta function called once;
  the least that mpmath can do, and more than its users are likely to.

CPU time, blocks of states of all of them in turn, medians over the blocks; mpmath has 12 digits more than are asked
for, which t = 10^6 costs.  It runs on gmpy2 where that is installed, see ``mpmath_backend``.  All agree with our balls
to all digits asked for but five.

How many times faster the balls were (two busy cores; 50 digits, 1000 digits):

    pendulum   15 µs,  0.21 ms    parameters  32,  18    nome_made  22,  15    thetas 11,  8
    euler      23 µs,  0.41 ms    parameters 198, 380    nome_made 191, 374    thetas 15,  8
    lagrange   28 µs,  0.43 ms    parameters 302, 707                          thetas 15,  8
    gyrostat   39 µs,  0.57 ms    parameters  23,  12                          thetas 14,  7

Run: python -m pytest benchmarks/bench_exact_mpmath.py --benchmark-enable
"""

from fractions import Fraction
from statistics import median
from time import process_time

import pytest
from flint import acb, arb
from mpmath import mp
from mpmath.libmp import BACKEND

from heavytop.cases import CASES
from heavytop.exact.cases import euler, gyrostat, lagrange, pendulum
from heavytop.exact.cases.euler import Euler
from heavytop.exact.cases.gyrostat import Gyrostat
from heavytop.exact.cases.lagrange import Lagrange
from heavytop.exact.cases.pendulum import Pendulum
from heavytop.exact.closed_form import balls
from heavytop.exact.flint.balls import midpoint, radius, radius_text, working_precision
from heavytop.measure.certify import bits_of
from heavytop.precision import dot
from heavytop.top.heavy_top import HeavyTop, State

F = Fraction
TIME = F(10**6)
START = State((F(1, 3), 1, 2), (F(3, 5), 0, F(4, 5)))
MOTIONS = {
    "pendulum": Pendulum(CASES["pendulum"].top, CASES["pendulum"].start),
    "euler": Euler(HeavyTop((3, 2, 1), 1, (0, 0, 0)), START),
    "lagrange": Lagrange(HeavyTop((2, 2, 1), 1, (0, 0, 1)), State((F(1, 3), 1, 3), START.gamma)),
    "gyrostat": Gyrostat(HeavyTop((3, 2, 1), 1, (0, 1, 0)), START, F(1, 3)),
}


def number(value):
    """An exact number, or the middle of a ball, in mpmath's working precision."""
    if isinstance(value, acb):
        return mp.mpc(number(value.real), number(value.imag))
    exact = midpoint(value) if isinstance(value, arb) else Fraction(value)
    return mp.mpf(exact.numerator) / exact.denominator


def amplitude(u, quarter, sn, cn):
    """am u, from sn and cn."""
    near = mp.atan2(sn, cn)
    return near + 2 * mp.pi * mp.nint((mp.pi * u / (2 * quarter) - near) / (2 * mp.pi))


class Functions:
    """sn, cn, dn of one parameter as the three users would have them."""

    def __init__(self, user, m):
        self.m, self.quarter, self.nome = m, mp.ellipk(m), mp.qfrom(m=m)
        null = [mp.jtheta(j, 0, self.nome) for j in (2, 3, 4)]
        self.factors = null[1] / null[0], null[2] / null[0], null[2] / null[1]
        self.all = getattr(self, user)

    def parameters(self, u):
        return [mp.ellipfun(kind, u, m=self.m) for kind in ("sn", "cn", "dn")]

    def nome_made(self, u):
        u -= 4 * self.quarter * mp.nint(u / (4 * self.quarter))
        return [mp.ellipfun(kind, u, q=self.nome) for kind in ("sn", "cn", "dn")]

    def thetas(self, u):
        z = mp.pi * u / (2 * self.quarter)
        t1, t2, t3, self.below = (mp.jtheta(j, z, self.nome) for j in (1, 2, 3, 4))
        return [f * t / self.below for f, t in zip(self.factors, (t1, t2, t3), strict=True)]


class OnPendulum:
    def __init__(self, motion, user, bits):
        with working_precision(bits):
            made = pendulum._lattice.__wrapped__(motion)
        swing = made.swing
        self.functions = Functions(user, number(swing.functions.parameter))
        self.rate, self.origin, self.amplitude = map(number, (swing.rate, swing.origin, swing.amplitude))
        self.half, self.rotating = [number(h) for h in made.half], swing.rotating
        (self.axis,) = (k for k, component in enumerate(made.axis) if not component.is_zero())
        self.direction = number(made.axis[self.axis])
        self.gamma = [number(g) for g in motion.start.gamma]

    def state(self, time):
        sn, cn, dn = self.functions.all(self.rate * time + self.origin)
        cosine, speed = (cn, dn) if self.rotating else (dn, cn)
        sine = self.amplitude * sn
        c = cosine * self.half[0] + sine * self.half[1]
        s = sine * self.half[0] - cosine * self.half[1]
        cosine, sine = c * c - s * s, 2 * c * s * self.direction
        k = self.axis
        i, j = (k + 1) % 3, (k + 2) % 3
        omega, gamma = [mp.zero] * 3, list(self.gamma)
        omega[k] = -2 * self.rate * self.amplitude * speed * self.direction
        gamma[i], gamma[j] = cosine * gamma[i] - sine * gamma[j], sine * gamma[i] + cosine * gamma[j]
        return [*omega, *gamma]


class OnEuler:
    def __init__(self, motion, user, bits):
        with working_precision(bits):
            made = euler._lattice.__wrapped__(motion)
            wave, angle = made.wave.at(made.origin)
            share, projection, across = (dot(balls(motion.start.gamma), axis) for axis in made.frame)
            began = number(acb(projection, -across) * made.turn * wave) * mp.expj(number(angle))
        self.axes, self.user = made.axes, user
        self.functions = Functions(user, number(made.functions.parameter))
        constants = made.rate, made.origin, made.drift, made.wave.shift, share
        self.rate, self.origin, self.drift, self.shift, self.share = map(number, constants)
        self.amplitudes = {axis: number(a) for axis, a in made.amplitudes.items()}
        self.shares = [number(share) for share in made.shares]
        momentum = motion.top.angular_momentum(motion.start.omega)
        square, energy = (number(sum(m * x for m, x in zip(momentum, v))) for v in (momentum, motion.start.omega))  # noqa: B905
        inertia = number(motion.top.inertia[self.axes[1]])
        lost = square - (inertia * self.amplitudes[self.axes[1]]) ** 2
        self.linear, self.characteristic = mp.sqrt(square) / inertia, 1 - square / lost
        self.third = mp.sqrt(square) * (energy - square / inertia) / (self.rate * lost)
        self.factor = began / self._turning(mp.zero, self.origin, *self.functions.all(self.origin))
        if user != "thetas":
            self.factor /= mp.sqrt(
                sum(self.shares[k] ** 2 * number(motion.start.omega[k]) ** 2 for k in self._others())
            )

    def _others(self):
        return (self.axes[1] + 1) % 3, (self.axes[1] + 2) % 3

    def _turning(self, time, u, sn, cn, _dn):
        """e^(i psi), and in the theta form its length too, up to a constant."""
        if self.user == "thetas":
            z = mp.pi * (u + 1j * self.shift) / (2 * self.functions.quarter)
            return mp.jtheta(1, z, self.functions.nome) / self.functions.below * mp.expj(self.drift * time)
        phi = amplitude(u, self.functions.quarter, sn, cn)
        return mp.expj(self.linear * time + self.third * mp.ellippi(self.characteristic, phi, self.functions.m))

    def state(self, time):
        a, b, c = self.axes
        u = self.rate * time + self.origin
        sn, cn, dn = self.functions.all(u)
        values = {a: self.amplitudes[a] * dn, b: self.amplitudes[b] * cn, c: self.amplitudes[c] * sn}
        omega = [values[axis] for axis in range(3)]
        i, j = self._others()
        along = [share * w for share, w in zip(self.shares, omega, strict=True)]
        square = along[i] ** 2 + along[j] ** 2
        turned = self.factor * self._turning(time, u, sn, cn, dn)
        if self.user != "thetas":
            turned *= mp.sqrt(square)
        x, y = turned.real, turned.imag / square
        rest = self.share - x * along[b] / square
        gamma = [x + self.share * along[b]] * 3
        gamma[i], gamma[j] = along[i] * rest - along[j] * y, along[j] * rest + along[i] * y
        return [*omega, *gamma]


class Wave:
    """Functions of the second kind with one winding, as in exact/elliptic/weierstrass.py."""

    def __init__(self, companions):
        wave = companions.wave
        self.index, self.shift, self.rate = wave.index, number(wave.shift), number(wave.rate)
        self.value, self.slope = number(wave.value), number(wave.slope)
        self.members = [[number(f) for f in factors] for factors in companions.factors]

    def at(self, lattice, time, point, below):
        scale, ratios, slope, z = point
        square, high = scale * scale, ratios[0] ** 2
        factor = mp.exp(self.rate * time)
        if self.index is not None:
            others = list(ratios)
            phi = others.pop(self.index) * factor
            turn = -others[0] * others[1] * factor
        else:
            unit = mp.jtheta(1, mp.pi * self.shift, lattice.nome) if lattice.anew else lattice.units[self]
            phi = mp.jtheta(1, mp.pi * self.shift - z, lattice.nome) / unit * factor
            above = high + (lattice.root - self.value) * square
            turn = phi * (scale * square * self.slope + slope) / (2 * above)
        p = high + lattice.root * square
        parts = scale * square * phi, scale * p * phi, slope * phi, square * turn, p * turn
        return [sum(a * f for a, f in zip(parts, member, strict=True)) / below for member in self.members]


class OnLattice:
    """Lagrange's top and the gyrostat by theta quotients of a lattice with real roots."""

    def __init__(self, prepared, waves, user):
        motion = prepared.motion
        self.roots = [number(root).real for root in motion.lattice.roots]
        self.root, self.anew = self.roots[0], user == "parameters"
        self.waves = [Wave(companions) for companions in waves]
        self.centre, self.offset, self.start = map(number, (motion.centre, motion.offset, motion.start))
        self.numerators = [number(n) for n in motion.numerators]
        self.units = {}
        self._periods()
        self.units = {w: mp.jtheta(1, mp.pi * w.shift, self.nome) for w in self.waves}

    def _periods(self):
        e1, e2, e3 = self.roots
        m = (e2 - e3) / (e1 - e3)
        self.half, self.nome = mp.ellipk(m) / mp.sqrt(e1 - e3), mp.qfrom(m=m)
        self.zero = [mp.jtheta(1, 0, self.nome, 1) * mp.pi, *(mp.jtheta(j, 0, self.nome) for j in (2, 3, 4))]

    def at(self, time):
        """x, and each wave's functions."""
        if self.anew:
            self._periods()
        z = mp.pi * time / (2 * self.half)
        first, *rest = (mp.jtheta(j, z, self.nome) for j in (1, 2, 3, 4))
        scale = 2 * self.half * first / self.zero[0]
        ratios = [value / null for value, null in zip(rest, self.zero[1:], strict=True)]
        slope = -2 * ratios[0] * ratios[1] * ratios[2]
        square = scale * scale
        above = ratios[0] ** 2 + (self.root - self.centre) * square
        below = 2 * above * above - self.offset * square * square
        constant, even, odd = self.numerators
        x = ((square * constant + above * even) * scale + slope * odd) * scale / below + self.start
        return x, [wave.at(self, time, (scale, ratios, slope, z), below) for wave in self.waves]


class OnLagrange:
    def __init__(self, motion, user, bits):
        with working_precision(bits):
            made = lagrange._prepared.__wrapped__(motion)
        self.lattice, self.spin, self.user = OnLattice(made, [made.horizontal], user), number(made.spin), user
        n, self.momentum, self.area, _, square = map(number, motion.constants)
        i1 = self.i1 = number(motion.top.inertia[0])
        self.size = s = mp.sqrt(square)
        cubic = [number(c) for c in reversed(motion.quartic().coefficients)]
        low, high, far = sorted(mp.polyroots(cubic, maxsteps=500, extraprec=400), key=lambda root: root.real)
        self.low, self.span = low, high - low
        self.rate, m = mp.sqrt(n * (far - low) / (2 * i1)), (high - low) / (far - low)
        self.functions = Functions("parameters", m)
        o, g = ([number(x) for x in v] for v in (motion.start.omega, motion.start.gamma))
        phi = mp.asin(mp.sqrt((g[2] - low) / self.span)) * (1 if o[1] * g[0] > o[0] * g[1] else -1)
        self.origin = mp.ellipf(phi, m)
        plus, minus = (self.area - self.momentum * s) / 2, -(self.area + self.momentum * s) / 2
        self.linear = self.momentum / i1 - self.spin
        self.thirds = [
            (self.span / (s - low), plus / ((s - low) * i1 * self.rate)),
            (-self.span / (s + low), minus / ((s + low) * i1 * self.rate)),
        ]
        self.before = mp.arg(mp.mpc(*g[:2])) - self._angle(mp.zero, phi)

    def _angle(self, time, phi):
        return self.linear * time + sum(f * mp.ellippi(k, phi, self.functions.m) for k, f in self.thirds)

    def state(self, time):
        if self.user == "thetas":
            x, ((g, w),) = self.lattice.at(time)
            return [w.real, w.imag, self.spin, g.real, g.imag, x]
        u = self.rate * time + self.origin
        sn, cn, dn = self.functions.all(u)
        x, slope = self.low + self.span * sn**2, 2 * self.rate * self.span * sn * cn * dn
        phi = amplitude(u, self.functions.quarter, sn, cn)
        square = self.size**2 - x * x
        g = mp.sqrt(square) * mp.expj(self._angle(time, phi) + self.before)
        w = mp.mpc((self.area - self.momentum * x) / self.i1, slope) * g / square
        return [w.real, w.imag, self.spin, g.real, g.imag, x]


class OnGyrostat:
    def __init__(self, motion, user, bits):
        with working_precision(bits):
            made = gyrostat._prepared.__wrapped__(motion)
        self.lattice = OnLattice(made, [made.momentum, made.gamma.waves], user)
        self.inertia = [number(i) for i in motion.top.inertia]
        self.share, self.turn, self.square = map(number, (made.gamma.share, made.gamma.turn, made.gamma.square))

    def state(self, time):
        x, ((m1, m3), (z1, z3)) = self.lattice.at(time)
        momentum = [m1.real, x, m3.real]
        across = z1.imag * self.turn, (z1.real * momentum[2] - z3.real * momentum[0]) * self.square, z3.imag * self.turn
        gamma = [m * self.share + c for m, c in zip(momentum, across, strict=True)]
        return [*(m / i for m, i in zip(momentum, self.inertia, strict=True)), *gamma]


PEERS = {"pendulum": OnPendulum, "euler": OnEuler, "lagrange": OnLagrange, "gyrostat": OnGyrostat}
USERS = {
    "pendulum": ("parameters", "nome_made", "thetas"),
    "euler": ("parameters", "nome_made", "thetas"),
    "lagrange": ("parameters", "thetas"),
    "gyrostat": ("parameters", "thetas"),
}


def seconds(call, count):
    began = process_time()
    for _ in range(count):
        call()
    return (process_time() - began) / count


@pytest.mark.parametrize("digits", [50, 1000])
@pytest.mark.parametrize("name", list(MOTIONS))
def test_a_state_against_mpmath(benchmark, name, digits):
    motion, bits = MOTIONS[name], bits_of(digits)
    ours = motion.state(TIME, bits)
    with mp.workdps(digits + 40):
        wide = int(3.33 * digits) + 400
        peers = {user: PEERS[name](motion, user, wide) for user in USERS[name]}
    with mp.workdps(digits + 12):
        time = mp.mpf(10**6)
        for user, peer in peers.items():
            apart = max(abs(number(ball) - value) for ball, value in zip(ours, peer.state(time), strict=True))
            assert apart < mp.mpf(10) ** (5 - digits), (user, apart)
            benchmark.extra_info[f"apart_{user}"] = mp.nstr(apart, 3)
        found = {user: [] for user in ("balls", *peers)}
        for _ in range(15 if digits == 50 else 5):
            found["balls"].append(seconds(lambda: motion.state(TIME, bits), 100))
            for user, peer in peers.items():
                found[user].append(seconds(lambda: peer.state(time), 10 if digits == 50 else 1))  # noqa: B023
    benchmark(motion.state, TIME, bits)
    for user, values in found.items():
        benchmark.extra_info[f"{user}_microseconds"] = f"{median(values) * 1e6:.4g}"
        if user != "balls":
            benchmark.extra_info[f"times_faster_than_{user}"] = f"{median(values) / median(found['balls']):.1f}"
    benchmark.extra_info["largest_radius"] = radius_text(max(map(radius, ours)))
    benchmark.extra_info["mpmath_backend"] = BACKEND
