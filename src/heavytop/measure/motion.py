"""A computed motion with its drift, attitude and Euler angles."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

from flint import arb

from heavytop.exact.flint.balls import FUNCTIONS, whole_evaluation, working_precision
from heavytop.integrate import registry
from heavytop.integrate.frames import Setup
from heavytop.integrate.registry import IntegratorSource, described, expected_steps
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.scalar import GUARD_BITS, text, to_balls
from heavytop.measure.scorer import Drift
from heavytop.precision import Precision, cross, decimal_text, dot, exact_text, rounded
from heavytop.records import Metric
from heavytop.top.attitude import Output, document_of, euler_angles, perpendicular, unwrap
from heavytop.top.bodies import PIVOT, Body
from heavytop.top.equations import GYROSTAT, Integral, System, holding
from heavytop.top.heavy_top import HeavyTop, State


def motion_texts(body: HeavyTop | Body, start: State, digits: int) -> dict[str, Any]:
    """A body and its start as exact text, by the keys of every file and document.

    digits: of γ, and of Ω given in space axes, if the attitude is irrational.
    """
    texts: dict[str, Any] = {}
    if isinstance(body, HeavyTop):
        texts |= {"inertia": _texts(body.inertia), "weight": exact_text(body.weight)}
    else:
        tensor = [value for row in body.tensor for value in row]
        texts |= {"mass": exact_text(body.mass), "gravity": exact_text(body.gravity)}
        texts |= {"inertia": _texts(tensor), "about": PIVOT}
    texts["centre"] = _texts(body.centre)
    if body.rotor is not None:
        texts["rotor"] = _texts(body.rotor)
    attitude = start.attitude
    exact = attitude is None or attitude.exact_rows() is not None

    def rounded(values: Sequence[Fraction], known: bool) -> list[str]:
        return _texts(values) if known else [decimal_text(value, digits + 1) for value in values]

    texts["omega"] = rounded(start.omega, exact or start.omega_space is None)
    texts["gamma"] = rounded(start.gamma, exact)
    if attitude is not None and attitude.kind in ("quaternion", "matrix"):
        texts[f"start_{attitude.kind}"] = _texts(attitude.numbers)
    elif attitude is not None:
        # read back by score, which takes the nearest rotation
        rows = attitude.rational_rows(8 * digits + 128)
        texts["start_matrix"] = [decimal_text(value, 2 * digits + 20) for row in rows for value in row]
        texts["start_attitude"] = f"{attitude.kind} {attitude}"
    return texts


def _texts(values: Sequence[Fraction]) -> list[str]:
    return [exact_text(value) for value in values]


def xi_texts(start: State, digits: int) -> list[str] | None:
    """ξ at t = 0 in the axes given, from the attitude, else from γ; exact if rational.  None for |γ| ≠ 1 without an
    attitude.
    """
    if start.attitude is not None:
        rows = start.attitude.exact_rows()
        if rows is not None:
            return _texts(rows[0])
        rational = start.attitude.rational_rows(4 * digits + 64)
        return [decimal_text(value, digits + 1) for value in rational[0]]
    if dot(start.gamma, start.gamma) != 1:
        return None
    return _texts(perpendicular(start.gamma))


# Euler angles φ and ψ without jumps by 2π, from additional samples of the attitude.
#
# φ is an azimuth about e3 in the body, ψ one in space; both are singular at the poles of θ.  Between two samples the
# azimuth along a path of length L changes by less than π if L < d1 + d2 for the distances d1, d2 of both ends from
# either pole, for a path around the other side of the pole is not shorter.  With the speeds v1, v2 at the ends and a
# bound a of the acceleration, L <= τ (v1 + v2)/2 + a τ²/4.  Intervals where this is too long are divided until
# |ω| τ < 2^-14, or there are 50,000 samples in all: then the path is taken to pass through a pole.


Angles = tuple[float, float, float]

_LONGEST = Fraction(1, 2)
_SHORTEST = Fraction(1, 1 << 14)
_ANGLE_PARTS = 16
_MOST = 50_000


class _Sample(NamedTuple):
    """(φ, θ, ψ) of one sample in rad, and the larger speed of γ in the body and of e3 in space, in rad/time unit."""

    angles: Angles
    speed: float


class FollowedAngles:
    """(φ, θ, ψ) in rad at samples, which are added in any order.

    problem: of the run.  start: (Ω, γ, ξ) at t = 0; it and all states are in the axes of the angles.
    """

    def __init__(self, problem: Problem, start: Sequence[Fraction]) -> None:
        self._problem = problem
        self._rate = _fastest(problem)
        inertia = problem.parameters.inertia
        self._bend = 2 + max(inertia) / min(inertia)
        self._samples: dict[Fraction, _Sample] = {}
        self.see(Fraction(0), start)

    def see(self, time: Fraction, state: Any) -> None:
        """Add the angles of a state (Ω, γ, ξ)."""
        values = [float(value) for value in state]
        omega, gamma = self._problem.system.angular_velocity(self._problem.parameters, values[:6]), values[3:6]
        turning = [math.hypot(*map(float, cross(fixed, omega))) for fixed in (gamma, (0, 0, 1))]
        self._samples[time] = _Sample(euler_angles(gamma, values[6:9], math), max(turning))

    def samples(self, times: Sequence[Fraction]) -> list[Fraction]:
        """``times`` with others in between, such that the body turns by at most 1/2 rad from one to the next.

        If more than 50,000 were needed, none are added, and angles may jump by 2π.
        """
        count = math.ceil(self._rate * abs(times[-1]) / _LONGEST)
        between = set(self._parts(Fraction(0), times[-1], count) if count <= _MOST else ())
        return sorted({*times, *between.difference(map(self._rounded, times))}, key=abs)

    def complete(self, follow: Callable[[Sequence[Fraction]], Any]) -> dict[Fraction, Angles]:
        """The angles at every sample, by time.  follow: integrates to further times in order, and calls :meth:`see`."""
        while more := [time for pair in pairwise(self._times()) for time in self._missing(*pair)]:
            if len(more) + len(self._samples) > _MOST:
                break
            follow(more)
        times = self._times()
        phi, theta, psi = zip(*(self._samples[time].angles for time in times), strict=True)
        followed = zip(unwrap(phi, math.tau), theta, unwrap(psi, math.tau), strict=True)
        return dict(zip(times, followed, strict=True))

    def _times(self) -> list[Fraction]:
        return sorted(self._samples, key=abs)

    def _missing(self, first: Fraction, last: Fraction) -> Iterable[Fraction]:
        """Times needed in between; none if both ends are at a pole, where the azimuth is undefined."""
        turn = self._rate * abs(last - first)
        ends = self._samples[first], self._samples[last]
        apart = sum(end.angles[1] for end in ends)
        if turn < _SHORTEST or turn > _LONGEST + 1 or apart in (0, math.tau):
            return ()
        speed = sum(Fraction(end.speed) for end in ends) / (2 * self._rate)
        length = min(turn, turn * speed + self._bend * turn**2 / 4)
        return () if length < min(apart, math.tau - apart) else self._parts(first, last, _ANGLE_PARTS)

    def _parts(self, first: Fraction, last: Fraction, count: int) -> Iterable[Fraction]:
        """The inner times of ``count`` equal parts, rounded to the format."""
        inner = {self._rounded(first + (last - first) * i / count) for i in range(1, count)}
        return sorted(inner - {first, last}, key=abs)

    def _rounded(self, time: Fraction) -> Fraction:
        return rounded(time, self._problem.precision)


def _fastest(problem: Problem) -> Fraction:
    """An upper bound of |ω|: |Ω|² <= (Ω·IΩ + 4 |P r|)/min I by the energy (heavy top and heavy gyrostat), or by |M|
    (gyrostat).  The rotor adds |λ|, or |k|/min I.
    """
    p, omega = problem.parameters, problem.start.omega
    smallest, largest = min(p.inertia), max(p.inertia)
    twice = sum((i * w * w for i, w in zip(p.inertia, omega, strict=True)), Fraction(0))
    square = (twice + 4 * sum(map(abs, p.moment))) * largest / smallest**2
    root = Fraction(math.isqrt(square.numerator * square.denominator << 40) + 1, square.denominator << 20)
    rotor = sum(abs(Fraction(part)) for part in p.rotors)
    return root + (rotor if problem.system is GYROSTAT else rotor / smallest)


Reached = Callable[[Fraction], None]
_PARTS = 50
_STEPS_A_PART = 100


@dataclass(frozen=True, slots=True)
class Motion:
    """A trajectory from an exact start, with drift, and on request ξ and continuous Euler angles as text.

    written_times: the times reached, as written in the request.  outputs: further ones, for :meth:`output_texts`.
    """

    top: HeavyTop | Body
    start: State
    trajectory: Trajectory
    states: list[list[str]]
    drift: dict[str, Metric]
    attitude: list[list[str]] | None
    angles: list[list[str]] | None
    written_times: list[str]
    outputs: tuple[Output, ...] = ()

    def output_texts(self, output: Output) -> list[Any]:
        """An output at every time, in its shape, each number rounded once to the digits of the format."""
        return self.trajectory.texts(output)

    @property
    def complete(self) -> bool:
        """Whether every requested time was reached."""
        return self.trajectory.outcome is Outcome.SUCCESS

    def to_json(self) -> dict[str, Any]:
        """The document of `propagate --json`."""
        run, precision = self.trajectory, self.trajectory.problem.precision
        document: dict[str, Any] = {
            "precision": precision.name,
            "bits": precision.bits,
            "system": run.problem.system.name,
            "outcome": run.outcome.value,
            "steps": run.steps,
            "times": [decimal_text(time, precision.digits) for time in run.times],
            "states": self.states,
            "time_reached": decimal_text(run.time_reached, precision.digits),
            "order": run.order,
            **motion_texts(self.top, self.start, precision.digits),
            "integrator": run.integrator,
            "flags": run.flags,
            "seconds": run.seconds,
            "amplification": run.amplification if math.isfinite(run.amplification) else None,
            "digits_lost": dict(zip(("value", "followed"), run.digits_lost, strict=True)),
            "stability": None if run.stability is None else asdict(run.stability),
            "metrics": {name: {"value": m.value, "log10": m.log10} for name, m in self.drift.items()},
        }
        if run.problem.xi is not None:
            document["xi"] = xi_texts(self.start, precision.digits)
        if self.attitude is not None:
            document["attitude"] = self.attitude
            document["angles"] = self.angles
        return document | {"times_given": self.written_times} | document_of(self.outputs, self.output_texts)


class _Watcher:
    """Observer that stores the states at the requested times, their drift, and the angles at every sample; it passes
    each time to ``reached``.
    """

    def __init__(
        self,
        problem: Problem,
        integrals: Sequence[Integral],
        requested: frozenset[Fraction],
        reached: Reached,
        with_angles: bool,
        setup: Setup,
    ) -> None:
        self.reached, self.setup = reached, setup
        self.drift = Drift(problem, integrals)
        self.requested = requested
        self.samples: list[tuple[Fraction, Any]] = []
        start = (*problem.start.flat, *(problem.xi or ()))
        self.angles = FollowedAngles(problem, setup.exactly_in_body_axes(start)) if with_angles else None

    def __call__(self, time: Fraction, state: Any) -> None:
        self.reached(time)
        if self.angles is not None:
            self.angles.see(time, self.setup.in_body_axes(state))
        if time in self.requested:
            self.samples.append((time, state))
            self.drift(time, state)


def compute(
    top: HeavyTop | Body,
    start: State,
    times: Sequence[Fraction],
    precision: Precision,
    system: System,
    attitude: bool = False,
    options: dict[str, Any] | None = None,
    integrator: str | IntegratorSource = "heyoka",
    reached: Reached | None = None,
    outputs: tuple[Output, ...] = (),
    written: Sequence[str] = (),
) -> Motion:
    """The motion at ``times`` (exact, checked), with the drift of every first integral.

    attitude: ξ starts at the exact vector of :func:`heavytop.top.attitude.perpendicular`; φ, θ, ψ are unwrapped with
    additional samples, which change no bit of the states: they are continuous except for jumps by π at the poles.
    integrator: a name that `heavytop list` shows, or a source; options: of it, checked.
    outputs: computed with the states; written: the text of the times, empty for exact text.
    reached: called with times for progress, some fifty and one for each doubling; only at the end for integrators other
    than heyoka and multiword.

    Raises InputError for another integrator, OutOfReach if the run would take too many steps.
    """
    setup = Setup.of(top, start, precision, system)
    xi = setup.xi if attitude or outputs else None
    problem = Problem.of(setup.top, setup.start, precision, system, xi)
    texts_of = written or [exact_text(time) for time in times]
    requested = {rounded(time, precision): text for time, text in zip(times, texts_of, strict=True)}
    integrals = holding(setup.top, setup.start, system)
    watcher = _Watcher(problem, integrals, frozenset(requested), reached or (lambda time: None), attitude, setup)
    samples = times if watcher.angles is None else watcher.angles.samples(times)
    if reached is not None and described(integrator).streams:
        # samples change no bit of a run, and are far fewer than steps
        steps, end = expected_steps(problem, times[-1]), times[-1]
        evenly = [end * i / _PARTS for i in range(1, _PARTS)] if steps > _STEPS_A_PART * _PARTS else []
        early = [end / 2**n for n in range(1, steps.bit_length())]
        intermediate = {rounded(time, precision) for time in (*evenly, *early)}
        samples = sorted({*samples, *(intermediate - requested.keys())}, key=abs)
    options = (options or {}) | ({} if xi is None else {"xi": xi})
    propagate = registry.watched(integrator, options, watcher)
    run = propagate(setup.top, setup.start, samples, precision, system=system)
    run = replace(run, times=tuple(t for t, _ in watcher.samples), states=tuple(y for _, y in watcher.samples))
    run = setup.given(run)
    texts = run.texts()
    attitudes = angles = None
    if watcher.angles is not None:
        angles_of = watcher.angles
        again = registry.watched(
            integrator, options, lambda time, state: angles_of.see(time, setup.in_body_axes(state))
        )
        followed = watcher.angles.complete(lambda more: again(setup.top, setup.start, more, precision, system=system))
        attitudes = [line[6:] for line in texts]
        angles = [_angles(state, followed[time], precision) for time, state in zip(run.times, run.states, strict=True)]
    reached_times = [str(requested[time]) for time, _ in watcher.samples]
    states, drift = [line[:6] for line in texts], watcher.drift.metrics()
    return Motion(top, start, run, states, drift, attitudes, angles, reached_times, outputs)


@whole_evaluation
def _angles(state: Any, followed: Sequence[float], precision: Precision) -> list[str]:
    """(φ, θ, ψ) of one state, shifted by multiples of 2π to ``followed``; ``nan`` at a pole."""
    with working_precision(precision.bits + GUARD_BITS):
        values = to_balls(state)
        angles = euler_angles(values[3:6], values[6:9], FUNCTIONS)
        shifted = [a + 2 * arb.pi() * round((f - float(a)) / math.tau) for a, f in zip(angles, followed, strict=True)]
        return [text(angle, precision.digits) for angle in shifted]
