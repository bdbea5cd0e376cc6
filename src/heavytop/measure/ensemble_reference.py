"""What the motions of an ensemble are compared with: closed forms, else runs in a wider format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy
from flint import arb
from msgspec.structs import replace as replace_struct

from heavytop.errors import OutOfReach
from heavytop.exact.balls import ball, working_precision
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.growth import RESOLVED, root_mean_square
from heavytop.measure.known import Known, certified, closed_form
from heavytop.measure.scalar import GUARD_BITS
from heavytop.precision import QUAD, Precision, exact, native, parse, real
from heavytop.records import Against, Checked

_CERTIFIED_AT = Fraction(2)
"""|t| at which the closed form of every start is certified; that of the first start is at the horizon too."""
_CHECKED_UNTIL = 100
_CHECKED_STARTS = 8

Texts = list[list[str]]
"""States of one motion at its samples, in decimals that name each number; empty where it did not come to the end."""


@dataclass(frozen=True, slots=True)
class Reference:
    """What a run is compared with.

    motions: one a start, None where there is none fit to score with.  radius: its error, absolute.  part: its error as
    a part of the error that it measures.
    """

    against: Against
    motions: list[Any]
    radius: float = 0.0
    part: float = 0.0


@dataclass(slots=True)
class Wider:
    """The motions in a wider format that are done, by the index of their start.

    changed: called as each is added.
    """

    done: dict[int, Texts]
    changed: Callable[[], None]


class _Sampled:
    """Computed states at the times they were computed for, as the motion that a run is compared with."""

    def __init__(self, times: Sequence[Fraction], states: Texts, precision: Precision) -> None:
        self.states = dict(zip(times, states, strict=True))
        self.precision = precision

    def state(self, time: Fraction, bits: int) -> list[arb]:
        """Six balls of radius 0."""
        with working_precision(bits):
            return [ball(exact(native(value, self.precision))) for value in self.states[time]]


def reference(
    true: list[Problem],
    given: list[Problem],
    times: list[Fraction],
    name: str | None,
    measured: Callable[[Sequence[Problem], Sequence[Fraction]], Sequence[Trajectory]],
    wider: Wider,
) -> Reference:
    """The closed forms where there are any, else runs in the wider format of that ``name``; ``wider`` takes these.

    true, given: what the motions are compared with and what is integrated; they differ where a fault is planted.
    measured: propagates with the integrator that is measured.
    """
    forms = [closed_form(problem) for problem in true]
    if all(forms):
        return _certified(forms, times[-1], true[0].precision.bits + GUARD_BITS)
    nothing: list[Any] = [None] * len(true)
    if name is None:
        return Reference(Against("none", reason="no closed form, and no wider format was asked for"), nothing)
    precision = parse(name)
    part, checked = _own_error(true[:_CHECKED_STARTS], given[:_CHECKED_STARTS], times, precision, measured)
    method = f"heyoka in {precision.name} from the same rounded data"
    against = Against("computed", method, checked=checked)
    if not part <= 1 / RESOLVED:
        why = against.text if checked else f"{against.text}; not checked: no sample up to |t| = {_CHECKED_UNTIL}"
        return Reference(Against("none", reason=f"no closed form, and not fit to score with: {why}"), nothing)
    motions = _propagated([replace(problem, precision=precision) for problem in true], times, wider)
    fit = [_Sampled(times, states, precision) if states else None for states in motions]
    return Reference(against, list(fit), part=part)


def _certified(forms: Sequence[Any], horizon: Fraction, bits: int) -> Reference:
    """Every closed form certified early, and the first at the horizon too."""
    sign = 1 if horizon > 0 else -1
    early = sign * min(_CERTIFIED_AT, abs(horizon))
    proofs = [_proof(form, early, bits) for form in forms]
    last = _proof(forms[0], horizon, bits)
    motions = [form if proof and last else None for form, proof in zip(forms, proofs, strict=True)]
    done = [proof for proof in proofs if proof]
    if not done or last is None:
        return Reference(Against("none", reason="the closed form is certified to too few digits"), motions)
    least = min(done, key=lambda proof: proof.certificate.agreed_digits).certified
    by = done[0].certificate
    every = replace_struct(least, source=by.second_source, proven=by.kind, starts=len(done), of_starts=len(forms))
    against = replace_struct(last.against, certificates=(last.certified, every))
    return Reference(against, motions, radius=2.0**-bits)


def _proof(form: Any, time: Fraction, bits: int) -> Known | None:
    try:
        return certified(form, time, bits)
    except OutOfReach:
        return None


@lru_cache(maxsize=1)
def _shared(problems: tuple[Problem, ...], times: tuple[Fraction, ...]) -> dict[int, Texts]:
    """The motions that this process has done: the runs of a plan that differ in flags share them."""
    return {}


def _propagated(problems: list[Problem], times: list[Fraction], wider: Wider) -> list[Texts]:
    """The states of every problem at ``times``; those that are done are not computed again."""
    shared = _shared(tuple(problems), tuple(times))
    # a copy: another thread may add to what is shared while this one saves its own
    wider.done = done = shared.copy() | wider.done
    missing = [index for index in range(len(problems)) if index not in done]

    def finished(place: int, run: Trajectory) -> None:
        done[missing[place]] = shared[missing[place]] = run.texts() if run.outcome is Outcome.SUCCESS else []
        wider.changed()

    if missing:
        propagate_ensemble([problems[index] for index in missing], times, finished=finished)
    return [done[index] for index in range(len(problems))]


def _own_error(
    true: list[Problem],
    given: list[Problem],
    times: list[Fraction],
    wider: Precision,
    measured: Callable[[Sequence[Problem], Sequence[Fraction]], Sequence[Trajectory]],
) -> tuple[float, Checked | None]:
    """The error of a reference in ``wider`` as a part of the error of the run, both against a wider format still, over
    a few starts and an early time; how it was checked, None where no sample is early enough.
    """
    widest = QUAD if wider.bits < QUAD.bits else real(2 * wider.bits)
    early = [time for time in times if abs(time) <= _CHECKED_UNTIL]
    if not early:
        return float("inf"), None
    truth, reference = (
        propagate_ensemble([replace(problem, precision=p) for problem in true], early) for p in (widest, wider)
    )
    off = _distance(measured(given, early), truth)
    part = _distance(reference, truth) / off if off else float("inf")
    return part, Checked(widest.name, len(true), f"{float(early[-1]):.3g}", f"{part:.1e}")


def _distance(runs: Sequence[Trajectory], truth: Sequence[Trajectory]) -> float:
    """The root mean square over starts of the largest distance of any component; NaN if none came to the end."""
    gaps = [
        max(_gap(a, b) for a, b in zip(run.states, other.states, strict=True))
        for run, other in zip(runs, truth, strict=True)
        if run.outcome is other.outcome is Outcome.SUCCESS
    ]
    return float(root_mean_square(numpy.array(gaps))) if gaps else float("nan")


def _gap(one: Any, other: Any) -> float:
    return float(max(abs(exact(a) - exact(b)) for a, b in zip(one, other, strict=True)))
