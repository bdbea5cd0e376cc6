"""What the motions of an ensemble are compared with: closed forms, else runs in more bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from msgspec.structs import replace as replace_struct

from heavytop.errors import InputError, OutOfReach
from heavytop.exact.solution import ExactSolution
from heavytop.integrate.trajectory import Problem
from heavytop.measure.computed_reference import agreement, of_rounded
from heavytop.measure.scalar import GUARD_BITS
from heavytop.measure.truth import Known, Truth, certified, closed_form
from heavytop.records import Against
from heavytop.top.equations import GYROSTAT

_CERTIFIED_AT = Fraction(2)
"""|t| at which the closed form of every start is certified; that of the first start is at the horizon too."""
_TOO_FEW = "the closed form is certified to too few digits"


@dataclass(frozen=True, slots=True)
class Reference:
    """What an ensemble is compared with: the truth of each start, or why there is none.

    blur: how far each state may be off, absolute, for each start and time that is covered; shape (starts, samples).
    """

    against: Against
    motions: list[Truth | str]
    blur: list[list[float]]

    @property
    def samples(self) -> int:
        """How many of the times are covered."""
        return max(map(len, self.blur), default=0)


@lru_cache(maxsize=2)
def reference(problems: tuple[Problem, ...], times: tuple[Fraction, ...], least: int = 0) -> Reference:
    """The closed forms where there are any, else runs in 30 bits more, or in ``least`` bits where that is more.

    The rows of a plan that differ in flags share it, and every state that was worked out; so do problems that are one
    motion.
    """
    of: dict[Any, ExactSolution | None] = {}
    for problem in problems:
        if (motion := _motion(problem)) not in of:
            of[motion] = closed_form(problem)
    forms = [form for problem in problems if (form := of[_motion(problem)]) is not None]
    if len(forms) == len(problems):
        return _certified(forms, times, problems[0].precision.bits + GUARD_BITS)
    try:
        found = of_rounded(problems, times, least)
    except (InputError, OutOfReach) as error:
        return _none(len(problems), f"no closed form; {error.cause}")
    against = replace_struct(agreement(found), reason="no closed form")
    motions = [Truth(against, each.state, each.ends) for each in found]
    covered = [time for time in times if motions[0].covers(time)]
    if not covered:
        return _none(len(problems), f"no closed form; no digit of the format is left at t = {against.until}")
    return Reference(against, list(motions), [list(map(each.blur, covered)) for each in found])


def _motion(problem: Problem) -> tuple[Any, ...]:
    """What the motion depends on: inertia and weight times a common factor are the same motion."""
    p = problem.parameters
    own = p.mapped(lambda value: value / p.inertia[0])
    rotor = p.rotors if problem.system is GYROSTAT else own.rotors
    return problem.system.name, *own.inertia, *own.moment, *rotor, problem.start


def _none(starts: int, reason: str) -> Reference:
    return Reference(Against("none", reason=reason), [reason] * starts, [])


def _certified(forms: Sequence[ExactSolution], times: Sequence[Fraction], bits: int) -> Reference:
    """Every closed form certified early, and the first at the horizon too."""
    horizon = times[-1]
    early = min(_CERTIFIED_AT, abs(horizon)) * (1 if horizon > 0 else -1)
    proofs = {id(form): _proof(form, early, bits) for form in forms}
    last = _proof(forms[0], horizon, bits)
    done = [proof for proof in proofs.values() if proof]
    if not done or last is None:
        return _none(len(forms), _TOO_FEW)
    least = min(done, key=lambda proof: proof.certificate.agreed_digits).certified
    by = done[0].certificate
    starts = sum(proofs[id(form)] is not None for form in forms)
    every = replace_struct(least, source=by.second_source, proven=by.kind, starts=starts, of_starts=len(forms))
    against = replace_struct(last.against, certificates=(last.certified, every))
    truths = {key: _TOO_FEW if proof is None else proof.truth.remembered() for key, proof in proofs.items()}
    return Reference(against, [truths[id(form)] for form in forms], [[2.0**-bits] * len(times)] * len(forms))


def _proof(form: ExactSolution, time: Fraction, bits: int) -> Known | None:
    try:
        return certified(form, time, bits)
    except OutOfReach:
        return None
