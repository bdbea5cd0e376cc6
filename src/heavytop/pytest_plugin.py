"""The pytest fixture ``heavytop_gate``, which measures the digits right of an integrator, or of its states.

pytest imports this module in every session if heavytop is installed; heavytop itself is imported when a test uses it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from heavytop import Score

_COMPARISONS = ("<", "<=", "==", "!=", ">", ">=")


class DigitsRight(float):
    """Digits right at every sample; if unknown nan, for which every comparison fails.

    explanation: lines for the message of a failed assertion.
    """

    explanation: tuple[str, ...] = ()


class Gated:
    """The result of ``heavytop_gate``.  score: as :func:`heavytop.score` returns it.

    digits_right: a number, or nan if the run did not reach its last time or has no reference.
    """

    def __init__(self, score: Score) -> None:
        self.score = score
        known = score.digits_right if score.outcome == "success" else None
        self.digits_right = DigitsRight(math.nan if known is None else known)
        self.digits_right.explanation = tuple(_explained(score))

    def __repr__(self) -> str:
        return repr(self.score)


Gate = Callable[..., Gated]


@pytest.fixture(scope="session")
def heavytop_gate() -> Gate:
    """A function ``heavytop_gate(integrator_or_states, case="lagrange")``; see :func:`gate`."""
    return gate


def gate(
    integrator_or_states: Any,
    case: str = "lagrange",
    *,
    times: Sequence[Any] | None = None,
    precision: str | None = None,
    **options: Any,
) -> Gated:
    """The digits right of an integrator on a built-in case, or of states computed by any program.

    Arguments:
        integrator_or_states: a name of `heavytop list`, "mine.toml", "./mine.py:solve", a callable, a Trajectory, or
            states of shape (n, 6) in the order Ω1 Ω2 Ω3 γ1 γ2 γ3 at ``times``.
        case: a name of `heavytop list`.
        times: exact numbers, strictly monotone away from 0; None for 1, 2, ..., 10; required with states.
        precision: the format; None for that of a Trajectory, else double.
        options: of :func:`heavytop.propagate`, such as ``tolerance``.

    Raises:
        InputError: for an invalid case, integrator, time or state.
        PeerFailed: if the integrator breaks its contract.
    """
    import heavytop as ht
    from heavytop.cases import case as case_named
    from heavytop.errors import InputError

    known = case_named(case)
    trajectory = integrator_or_states
    if isinstance(trajectory, str) or (callable(trajectory) and not isinstance(trajectory, ht.Trajectory)):
        requested = list(range(1, 11)) if times is None else times, precision or "double"
        system = known.system
        trajectory = ht.propagate(known.top, known.start, *requested, integrator=trajectory, system=system, **options)
    elif options:
        raise InputError(f"{next(iter(options))} was given with states.", "Leave it out, or give an integrator.")
    elif times is not None and isinstance(trajectory, ht.Trajectory):
        raise InputError("times were given with a Trajectory.", "Leave them out: it has its own.")
    elif precision is not None and isinstance(trajectory, ht.Trajectory):
        raise InputError("precision was given with a Trajectory.", "Leave it out: it has its own.")
    name, form = "given", precision or "double"
    if isinstance(trajectory, ht.Trajectory):
        form = trajectory.problem.precision.name
        if trajectory.outcome is not ht.Outcome.SUCCESS:
            pytest.fail(f"{case}: {trajectory!r}", pytrace=False)
        times, trajectory, name = trajectory.times, trajectory.states, trajectory.integrator
    if times is None:
        raise InputError("States come without their times.", "Give heavytop_gate(states, times=[...]).")
    return Gated(
        ht.score(
            times,
            trajectory,
            top=known.top,
            start=known.start,
            precision=form,
            system=known.system,
            name=case,
            integrator=name,
        )
    )


def pytest_assertrepr_compare(op: str, left: object, right: object) -> list[str] | None:
    """The message of a failed comparison of digits: the numbers, then the findings of the score."""
    digits = next((side for side in (left, right) if isinstance(side, DigitsRight)), None)
    if digits is None or op not in _COMPARISONS:
        return None
    return [f"{_shown(left)} {op} {_shown(right)} digits right", *digits.explanation]


def _explained(score: Score) -> Iterator[str]:
    """At most five lines, for pytest shows eight: the score, its diagnosis, the largest errors and drifts."""
    yield repr(score).splitlines()[0]
    yield from score.diagnosis[:2]
    for label, sizes in (("largest error", score.distance), ("largest drift", score.drift)):
        if sizes:
            yield f"{label}: " + ", ".join(f"{name} {float(size.max):.2g}" for name, size in sizes.items())


def _shown(side: object) -> str:
    return f"{side:.1f}" if isinstance(side, DigitsRight) else repr(side)
