"""The reference of a row: the true motion of its rounded problem, proven if in reach, else computed.

Proven: a closed form that a second source certifies, or the validated enclosure; beyond |t| = 100 only if the model of
its cost stays below :data:`CHEAP`.  No clock is read: a plan always gives the same bytes.  Computed: two multi-word
runs with 30 and 60 bits more than the format.  On a chaotic motion they lose as many digits as the format, and so
remain more accurate as long as the format has significant digits.  At the time at which it has lost all of them the
reference ends.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, lru_cache, partial
from typing import Any

from flint import arb
from msgspec.structs import replace as replace_struct

from heavytop.errors import HeavyTopError, InputError, NotInClass, OutOfReach
from heavytop.exact.cases.gyrostat import Gyrostat
from heavytop.exact.catalogue import matches, state_and_attitude
from heavytop.exact.closed_form import starting_at
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.flint.balls import midpoint, radius, radius_text, whole_evaluation, working_precision
from heavytop.exact.solution import ExactSolution
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.certify import EXACTLY, Certificate, certify, enclosure_of
from heavytop.measure.scalar import GUARD_BITS, largest, to_balls
from heavytop.precision import Precision, Vector, decimal_text, number, real, shown, six_digits, time_text
from heavytop.records import Against, Certified
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import check_times

# References without proof: two multi-word runs of different precision, valid to the digits that agree.
#
# Labelled computed, not proven: the radius is the difference of the two runs, not a rigorous bound.  The state is
# that of the finer run, so the radius is the error of the coarser one, and the error of the state is smaller by the
# difference of their bits, on a chaotic motion too: both lose digits alike.


MORE_BITS = 30
"""The second run has at least so many bits more than the first."""
EFFORT = 60.0
"""The most seconds of a run, by the model of its cost; extreme starts and times would never end."""
EFFORT_OF_MANY = 600.0
"""The most seconds of all runs of an ensemble."""
_PILOT_STEPS = 1000
"""The cost of a longer run is extrapolated from so many steps, and one beyond its effort is refused."""
_SEARCH = 8
_WORD_BITS = 1032
_DIGIT = 10
"""A state has a significant digit if its error is below its size over this."""
_STAGES = 6
_PROBES = 12
"""A reference that may end is computed to the horizon over 4^6 first, then four times as far, until it ends; if there
is no sample so early, from the horizon over 4^12 on, so that no run continues far beyond the loss of all significant
digits."""

Given = Callable[[Precision], Problem]
"""The problem of a motion in a format."""


def seconds_a_step(bits: int) -> float:
    """A model of the cost of a step with so many bits; no result depends on a clock."""
    return 3e-6 + 4e-12 * bits**3 if bits <= _WORD_BITS else 6e-8 * bits**2


@dataclass(frozen=True, slots=True)
class ComputedReference:
    """States, with the attitude vector if the motion has one, at the times of two runs.

    words: bits of both runs.  ends: the first time at which the measured format has lost all significant digits; None
    if it has one to the end.
    """

    words: tuple[int, int]
    balls: dict[Fraction, list[arb]]
    ends: Fraction | None = None

    @property
    def against(self) -> Against:
        """The kind of the reference, the agreement of its runs, and its end."""
        return agreement([self])

    def state(self, time: Fraction, bits: int = 0) -> list[arb]:
        """Six balls, or nine with the attitude vector, at one of the times; ``bits`` has no effect."""
        return self.balls[time]

    def radius(self, time: Fraction) -> Fraction:
        """The largest radius at one of the times, relative to a value above 1."""
        return max(radius(value) / max(Fraction(1), abs(midpoint(value))) for value in self.balls[time])

    def blur(self, time: Fraction) -> float:
        """The absolute uncertainty of the state at one of the times."""
        return float(sum(map(radius, self.balls[time])))

    def beyond(self, part: Fraction) -> set[Fraction]:
        """The times at which the radius of Ω or γ exceeds this fraction of its maximum."""
        uncertain: set[Fraction] = set()
        for group in (slice(0, 3), slice(3, 6)):
            largest = max(abs(midpoint(value)) for state in self.balls.values() for value in state[group])
            uncertain |= {t for t, state in self.balls.items() if radius(state[group][0]) > part * largest}
        return uncertain


def agreement(references: Sequence[ComputedReference]) -> Against:
    """The kind, agreement and end of the references of an ensemble, all over the same times."""
    (coarse, fine), ends = references[0].words, references[0].ends
    radii = [motion.radius(t) for motion in references for t in motion.balls if ends is None or abs(t) < abs(ends)]
    agreed = radius_text(max(radii)) if radii else ""
    until = "" if ends is None else time_text(ends)
    return Against("computed", f"words of {coarse} and {fine} bits", agreed, until=until)


def of_rounded(
    problems: Sequence[Problem], times: Sequence[Fraction], least: int = 0, effort: float | None = None
) -> list[ComputedReference]:
    """References of problems of one format, from their rounded data, with 30 and 60 bits more.

    least: the fewest bits of the first run.  effort: as in :func:`compute`.
    All end where one has lost all significant digits of the format, as growth laws do.
    Raises OutOfReach as :func:`compute` does, and InputError for more bits than there are.
    """
    bits = problems[0].precision.bits
    motions = [partial(_in_format, problem) for problem in problems]
    return compute(motions, times, max(least, bits + MORE_BITS), bits, effort)


def _in_format(problem: Problem, precision: Precision) -> Problem:
    return replace(problem, precision=precision)


def compute(
    problems: Sequence[Given],
    times: Sequence[Fraction],
    bits: int,
    format_bits: int | None = None,
    effort: float | None = None,
) -> list[ComputedReference]:
    """References at ``times``, from runs with about ``bits`` bits and with at least :data:`MORE_BITS` more.

    times: as for :func:`heavytop.integrate.multiword.motions.propagate_multiword`.
    format_bits: those of the measured format, in which motions may lose all digits; None for no format.
    effort: seconds of each run, by the model of its cost; None for 60, or an equal share of 600 for an ensemble.
    Raises OutOfReach if a run does not reach the last time within the effort.
    """
    first = [_WithArithmetic.of(problem, bits) for problem in problems]
    finer = _finer(problems, bits, first)
    second = [_WithArithmetic.of(problem, finer) for problem in problems]
    words = [(one.bits, two.bits) for one, two in zip(first, second, strict=True)]
    balls: list[dict[Fraction, list[arb]]] = [{} for _ in problems]
    seconds = effort or (EFFORT if len(problems) == 1 else EFFORT_OF_MANY / len(problems))
    for early in _stages(times, _STAGES if format_bits is not None else 0):
        # no bit of a run depends on its samples: those of shorter stages are not computed again
        more = [time for time in early if time not in balls[0]]
        for index, pair in enumerate(zip(_states(first, more, seconds), _states(second, more, seconds), strict=True)):
            known = balls[index] | dict(zip(more, _balls(*pair, bits), strict=True))
            balls[index] = {time: known[time] for time in early}
        references = [ComputedReference(*pair) for pair in zip(words, balls, strict=True)]
        ends = (
            None
            if format_bits is None
            else _last_digit(references, [served.accuracy - format_bits for served in first])
        )
        if ends is not None and ends not in times:
            # lost before the first sample
            return [ComputedReference(words, {}, times[0]) for words in words]
        if ends is not None:
            break
    return [replace(motion, ends=ends) for motion in references]


@dataclass(frozen=True, slots=True)
class _WithArithmetic:
    """A motion in a format, with its arithmetic.

    bits: of the arithmetic.  accuracy: as in :func:`heavytop.integrate.multiword.engines.accuracy`.
    """

    problem: Problem
    bits: int
    accuracy: int

    @classmethod
    def of(cls, request: Given, bits: int) -> _WithArithmetic:
        from heavytop.integrate.multiword.engines import accuracy, choose  # a proven reference needs no integrator

        problem = request(real(bits))
        arithmetic, scaled = choose(problem, None)
        return cls(problem, int(arithmetic.flags["bits"]), accuracy(arithmetic, scaled))


def _finer(problems: Sequence[Given], bits: int, first: Sequence[_WithArithmetic]) -> int:
    """The bits of a second format, whose arithmetic has at least 30 bits more than that of ``first``.

    Two formats may have the same arithmetic.
    """
    finer = bits + MORE_BITS
    for problem, coarse in zip(problems, first, strict=True):
        while _WithArithmetic.of(problem, finer).bits < coarse.bits + MORE_BITS:
            finer += _SEARCH
    return finer


def _stages(times: Sequence[Fraction], stages: int) -> list[Sequence[Fraction]]:
    """The times within the horizon over 4^n, in lists of increasing length; without any, that end alone."""
    ends = {n: times[-1] / 4**n for n in range(_PROBES if stages else 0, -1, -1)}
    counts = {n: sum(abs(time) <= abs(end) for time in times) for n, end in ends.items()}
    before = [[ends[n]] for n, count in counts.items() if not count]
    return [*before, *(times[:count] for count in dict.fromkeys(counts[n] for n in range(stages, -1, -1)) if count)]


def _last_digit(references: Sequence[ComputedReference], fewer: Sequence[int]) -> Fraction | None:
    """The first time at which some motion has lost all significant digits of the format, with ``fewer`` bits than its
    run.

    The error in the format is that of the coarser run times 2^fewer: both are amplified alike.
    """
    uncertain = [
        reference.beyond(Fraction(1, _DIGIT) / 2 ** max(0, bits))
        for reference, bits in zip(references, fewer, strict=True)
    ]
    return next((time for time in references[0].balls if any(time in reference for reference in uncertain)), None)


def _states(served: Sequence[_WithArithmetic], times: Sequence[Fraction], effort: float) -> list[Sequence[Any]]:
    """The states of each motion at ``times``."""
    problems = [served.problem for served in served]
    words = max(served.bits for served in served)
    limit = int(effort / seconds_a_step(words))
    runs = _trajectories(problems, times, min(limit, _PILOT_STEPS))
    states: list[Sequence[Any]] = [run.states for run in runs]
    if limit > _PILOT_STEPS and any(run.outcome is Outcome.STEP_LIMIT for run in runs):
        reached = min(abs(run.time_reached) for run in runs if run.outcome is Outcome.STEP_LIMIT)
        if abs(times[-1]) * _PILOT_STEPS > limit * reached:
            raise OutOfReach(
                f"A reference run in words of {words} bits to t = {six_digits(times[-1])} takes too long: its "
                f"first {_PILOT_STEPS} steps end at t = {decimal_text(reached, 3)}.",
                "Give an earlier time.",
            )
        done = min(map(len, states))
        runs = _trajectories(problems, times[done:], limit)
        states = [[*before[:done], *run.states] for before, run in zip(states, runs, strict=True)]
    for run in runs:
        if run.outcome is not Outcome.SUCCESS:
            raise OutOfReach(f"A reference run in {words} bits {run.outcome.message}.", "Give an earlier time.")
    return states


def _trajectories(problems: Sequence[Problem], times: Sequence[Fraction], limit: int) -> list[Trajectory]:
    """Multi-word trajectories, in lanes if there are several."""
    from heavytop.integrate.multiword.lanes import propagate_multiword_ensemble
    from heavytop.integrate.multiword.motions import integrate_to_samples

    targets = [number(time, problems[0].precision) for time in check_times(times)]
    if len(problems) == 1:
        return [integrate_to_samples(problems[0], targets, step_limit=limit)]
    return propagate_multiword_ensemble(problems, targets, step_limit=limit)


@whole_evaluation
def _balls(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[list[arb]]:
    """Balls around the finer values; the radius of each vector is its largest difference plus a coarser rounding."""
    with working_precision(bits + 128):
        return [_balls_by_vector(one, two, bits) for one, two in zip(coarse, fine, strict=True)]


def _balls_by_vector(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[arb]:
    low, high = to_balls(coarse), to_balls(fine)
    balls: list[arb] = []
    for k in range(0, len(low), 3):
        group = high[k : k + 3]
        difference = largest([b - a for a, b in zip(low[k : k + 3], group, strict=True)])
        difference += largest(group) * arb(2) ** -bits
        balls += [value + arb(0, difference.abs_upper()) for value in group]
    return balls


CHEAP = 1.0
"""The most seconds of the enclosure of a row beyond |t| = 100, by the model of its cost."""
_ALWAYS_ENCLOSED = 100
_DIGITS_A_BIT = Fraction(30103, 100000)
_SPARE_DIGITS = 3
_EFFORT = 1.0
"""The most seconds of a second source at the horizon; else the sources are compared near 0 and near the horizon."""
_SHARED_STATES, _SHARED_BITS = 1024, 64

Evaluate = Callable[[Fraction, int], Sequence[arb]]


@dataclass(frozen=True, slots=True)
class Truth:
    """The reference states of a run.

    against: their kind, for the row.  state: (time, bits) -> six balls.
    ends: the first time at which the format has lost all significant digits; there are no states from there on.  None
    if it has one to the end.
    """

    against: Against
    state: Evaluate = field(repr=False)
    ends: Fraction | None = None

    def covers(self, time: Fraction) -> bool:
        """Whether there is a state at ``time``."""
        return self.ends is None or abs(time) < abs(self.ends)

    def remembered(self) -> Truth:
        """The reference with a cache of its states, for several runs over the same times."""
        return replace(self, state=cache(self.state))


@dataclass(frozen=True, slots=True)
class Known:
    """A known motion and its certificate at ``time``."""

    solution: ExactSolution
    certificate: Certificate
    time: Fraction
    bits: int

    @property
    def certified(self) -> Certified:
        """The certificate as a record of the row."""
        c = self.certificate
        return Certified(
            shown(self.time), None if c.agreed_digits >= EXACTLY else c.agreed_digits, c.second_source, c.kind
        )

    @property
    def against(self) -> Against:
        """Method, radius and certificate as a record of the row."""
        limit = radius_text(Fraction(1, 2**self.bits))
        return Against("proven", self.certificate.method, limit, (self.certified,))

    @property
    def truth(self) -> Truth:
        """The reference states."""
        enclosed = isinstance(self.solution, Validated)  # further bits need another run
        return Truth(self.against, self.solution.state if enclosed else states_of(self.solution))


def truth(problem: Problem, times: Sequence[Fraction], effort: float | None = None) -> Truth | str:
    """The true motion of a rounded problem at ``times``, exact numbers in the order of a run, or the reason why it is
    neither proven nor computed.

    The states of a problem with ξ are nine balls: Ω, γ, and ξ from the initial ξ of the problem.
    effort: as in :func:`heavytop.measure.truth.compute`.
    Raises Contradiction if a second source excludes a proven one, which is an error of this program.
    """
    horizon = max(times, key=abs)
    known = known_motion(replace(problem, xi=None), horizon)
    if isinstance(known, Known):
        if problem.xi is None:
            return known.truth
        if (with_attitude := _with_attitude(known.solution, problem, horizon)) is not None:
            return Truth(known.against, with_attitude)
    computed = _computed(problem, times, effort)
    if isinstance(known, Known):
        return computed
    if isinstance(computed, str):
        return f"{known}; {computed}"
    return replace(computed, against=replace_struct(computed.against, reason=known))


def uncertified(problem: Problem, times: Sequence[Fraction]) -> Truth | str:
    """A reference for the scatter of runs that differ in their roundings alone, without a second source."""
    form = closed_form(problem)
    return _computed(problem, times) if form is None else Truth(Against("proven", form.method), states_of(form))


def _computed(problem: Problem, times: Sequence[Fraction], effort: float | None = None) -> Truth | str:
    try:
        (computed,) = of_rounded([problem], times, effort=effort)
    except (InputError, OutOfReach) as error:
        return clause(error)
    if computed.ends == times[0]:
        return f"all significant digits of the format are lost at the first sample, t = {time_text(computed.ends)}"
    return Truth(computed.against, computed.state, computed.ends)


def clause(error: HeavyTopError) -> str:
    """The cause of an error as a clause."""
    return error.cause[:1].lower() + error.cause[1:].removesuffix(".")


def certified(solution: ExactSolution, time: Fraction, bits: int) -> Known | None:
    """``solution`` for references of ``bits`` bits, or None unless it is certified to more digits than the format has.

    Raises Contradiction if the second source excludes it.
    """
    digits = int(bits * _DIGITS_A_BIT)
    certificate = certify(solution, time, digits, enclosure=_enclosure(solution))
    needed = int((bits - GUARD_BITS) * _DIGITS_A_BIT) + _SPARE_DIGITS
    return Known(solution, certificate, time, bits) if certificate.agreed_digits >= needed else None


@lru_cache(maxsize=32)
def _enclosure(solution: ExactSolution) -> Validated:
    """The second source of a motion; rows of several formats share its pilots."""
    return enclosure_of(solution, effort=_EFFORT)


@lru_cache(maxsize=32)
def closed_form(problem: Problem) -> ExactSolution | None:
    """The closed form of a rounded problem, or None; consecutive rows of a problem share it."""
    if problem.system is GYROSTAT:
        # rounded γ is not parallel to M: the rotor is that of the exact data
        return Gyrostat(problem.top, problem.start, problem.parameters.rotor)
    return next(matches(problem.top, problem.start, problem.system), None)


@lru_cache(maxsize=32)
def states_of(solution: ExactSolution) -> Evaluate:
    """The states of a motion, cached for rows and reruns; bits are rounded up to a multiple of 64."""
    states = lru_cache(maxsize=_SHARED_STATES)(solution.state)
    return lambda time, bits: states(time, -(-bits // _SHARED_BITS) * _SHARED_BITS)


@lru_cache(maxsize=32)
def known_motion(problem: Problem, horizon: Fraction) -> Known | str:
    """The closed form of a rounded problem, or its enclosure if that is cheap, or the reason why there is neither.

    Certified at ``horizon`` for the bits of the format and its guard bits.  Raises Contradiction if the second source
    excludes it.
    """
    bits = problem.precision.bits + GUARD_BITS
    try:
        solution = closed_form(problem)
        if solution is None:
            solution = Validated(problem.top, problem.start, problem.system)
            if abs(horizon) > _ALWAYS_ENCLOSED and solution.cost(horizon, bits, CHEAP) > CHEAP:
                return f"no closed form, and an enclosure to |t| = {time_text(abs(horizon))} takes too long"
        known = certified(solution, horizon, bits)
    except OutOfReach as error:
        return clause(error)
    return known or "certified to fewer digits than the format has"


# The attitude vector of a known motion, from the initial one of the problem.


def _with_attitude(solution: ExactSolution, problem: Problem, horizon: Fraction) -> Evaluate | None:
    """Ω, γ and ξ of a known motion: ξ by its closed form if that reaches the horizon, else by the enclosure.

    None if neither does.
    """
    bits = problem.precision.bits + GUARD_BITS
    xi = problem.xi
    assert xi is not None
    start: Vector = (xi[0], xi[1], xi[2])
    if isinstance(solution, Validated):
        evaluate: Evaluate = Validated(solution.top, solution.start, solution.system, xi=start).with_attitude
    else:
        evaluate = starting_at(start, solution.start.gamma, state_and_attitude(solution, horizon, bits)[1])
    try:
        evaluate(horizon, bits)
    except (NotInClass, OutOfReach):
        return None
    return evaluate


# References of ensembles: closed forms, else runs with more bits.


_CERTIFIED_AT = Fraction(2)
"""|t| at which the closed form of each start is certified; that of the first also at the horizon."""
_TOO_FEW = "the closed form is certified to too few digits"


@dataclass(frozen=True, slots=True)
class EnsembleReference:
    """The references of an ensemble: that of each start, or the reason why it is missing.

    blur: absolute uncertainties of the states, for each start and covered time; shape (starts, samples).
    """

    against: Against
    motions: list[Truth | str]
    blur: list[list[float]]

    @property
    def samples(self) -> int:
        """The number of covered times."""
        return max(map(len, self.blur), default=0)


@lru_cache(maxsize=2)
def reference(problems: tuple[Problem, ...], times: tuple[Fraction, ...], least: int = 0) -> EnsembleReference:
    """The closed forms if all problems have one, else runs with 30 bits more, or ``least`` bits if that is more.

    Rows of a plan that differ in flags share it with its cached states; so do problems of one motion.
    """
    form_of: dict[Any, ExactSolution | None] = {}
    for problem in problems:
        if (motion := _motion(problem)) not in form_of:
            form_of[motion] = closed_form(problem)
    forms = [form for problem in problems if (form := form_of[_motion(problem)]) is not None]
    if len(forms) == len(problems):
        return _certified(forms, times, problems[0].precision.bits + GUARD_BITS)
    try:
        references = of_rounded(problems, times, least)
    except (InputError, OutOfReach) as error:
        return _none(len(problems), f"no closed form; {error.cause}")
    against = replace_struct(agreement(references), reason="no closed form")
    motions = [Truth(against, reference.state, reference.ends) for reference in references]
    covered = [time for time in times if motions[0].covers(time)]
    if not covered:
        return _none(len(problems), f"no closed form; all significant digits are lost at t = {against.until}")
    return EnsembleReference(against, list(motions), [list(map(reference.blur, covered)) for reference in references])


def _motion(problem: Problem) -> tuple[Any, ...]:
    """The data on which the motion depends, independent of a common factor of inertia and weight."""
    p = problem.parameters
    ratios = p.mapped(lambda value: value / p.inertia[0])
    rotor = p.rotors if problem.system is GYROSTAT else ratios.rotors
    return problem.system.name, *ratios.inertia, *ratios.moment, *rotor, problem.start


def _none(starts: int, reason: str) -> EnsembleReference:
    return EnsembleReference(Against("none", reason=reason), [reason] * starts, [])


def _certified(forms: Sequence[ExactSolution], times: Sequence[Fraction], bits: int) -> EnsembleReference:
    """The closed forms, each certified early, and the first also at the horizon."""
    horizon = times[-1]
    early = min(_CERTIFIED_AT, abs(horizon)) * (1 if horizon > 0 else -1)
    proofs = {id(form): _proof(form, early, bits) for form in forms}
    last = _proof(forms[0], horizon, bits)
    proven = [proof for proof in proofs.values() if proof]
    if not proven or last is None:
        return _none(len(forms), _TOO_FEW)
    least = min(proven, key=lambda proof: proof.certificate.agreed_digits).certified
    by = proven[0].certificate
    starts = sum(proofs[id(form)] is not None for form in forms)
    every = replace_struct(least, source=by.second_source, proven=by.kind, starts=starts, of_starts=len(forms))
    against = replace_struct(last.against, certificates=(last.certified, every))
    truths = {key: _TOO_FEW if proof is None else proof.truth.remembered() for key, proof in proofs.items()}
    return EnsembleReference(against, [truths[id(form)] for form in forms], [[2.0**-bits] * len(times)] * len(forms))


def _proof(form: ExactSolution, time: Fraction, bits: int) -> Known | None:
    try:
        return certified(form, time, bits)
    except OutOfReach:
        return None
