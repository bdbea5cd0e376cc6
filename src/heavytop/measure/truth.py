"""The reference of a row: the true motion of its rounded problem, proven where that is in reach, else computed.

Proven: a closed form that a second source certifies, or the validated enclosure: up to |t| = 100 as far as that is in
reach at all, beyond where the model of its cost stays below :data:`CHEAP`.  No clock is asked: the same plan gives the
same bytes.  Computed: two runs in words with 30 bits more than the format, and 30 more again.  On a chaotic motion
these lose what the format loses, so that they know the motion better as long as the format knows anything.  Where it
has lost all significant digits the reference ends, and the time is named.
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
from heavytop.precision import Precision, Vector, decimal_text, number, real, shown, time_text
from heavytop.records import Against, Certified
from heavytop.top.equations import GYROSTAT
from heavytop.top.heavy_top import check_times

# A reference where no proof is at hand: two runs in words of different length, trusted as far as they agree.
#
# Labelled computed, not proven: the radius is the difference of the two runs, which no theorem bounds.  The state is
# that of the longer words, so the radius is the error of the shorter ones, and the state's own is smaller by as many
# bits as the words differ by, on a chaotic motion too: what one loses the other loses.


MORE_BITS = 30
"""The words of the second run have at least so many more bits than those of the first."""
EFFORT = 60.0
"""Seconds of the model of the cost that each run may take; absurd starts and times would never end."""
EFFORT_OF_MANY = 600.0
"""Seconds for all the runs of an ensemble together."""
_PILOT_STEPS = 1000
"""A run that takes more is forecast from so many: what would take longer than its effort is refused at once."""
_SEARCH = 8
_WORD_BITS = 1032
_DIGIT = 10
"""An error leaves a digit where it is below the size of the state over this."""
_STAGES = 6
_PROBES = 12
"""A truth that may end is computed to the horizon over 4^6 first, and then to four times as far, until it has ended;
where that is before the first sample, to the horizon over 4^12, so that nothing runs beyond the loss of all significant
digits."""

Given = Callable[[Precision], Problem]
"""A motion to be computed, in any format."""


def seconds_a_step(bits: int) -> float:
    """A model of the cost of a step in so many bits, not a measurement: no result depends on a clock."""
    return 3e-6 + 4e-12 * bits**3 if bits <= _WORD_BITS else 6e-8 * bits**2


@dataclass(frozen=True, slots=True)
class ComputedReference:
    """States, with an attitude vector where the motion has one, at the times of two runs.

    words: the bits of the words of both.  ends: the first time at which the format that is measured has lost all
    significant digits; None where it keeps one to the last.
    """

    words: tuple[int, int]
    balls: dict[Fraction, list[arb]]
    ends: Fraction | None = None

    @property
    def against(self) -> Against:
        """Its kind, how far the runs agree as long as the format has digits, and how long that is."""
        return agreement([self])

    def state(self, time: Fraction, bits: int = 0) -> list[arb]:
        """Six balls, or nine with the attitude vector, at one of the times; ``bits`` are what they are."""
        return self.balls[time]

    def radius(self, time: Fraction) -> Fraction:
        """The largest radius at one of the times, relative to a value above 1."""
        return max(radius(value) / max(Fraction(1), abs(midpoint(value))) for value in self.balls[time])

    def blur(self, time: Fraction) -> float:
        """How far the state at one of the times may be off, absolute."""
        return float(sum(map(radius, self.balls[time])))

    def beyond(self, part: Fraction) -> set[Fraction]:
        """The times at which Ω or γ is uncertain by more than this part of the largest that it becomes."""
        uncertain: set[Fraction] = set()
        for group in (slice(0, 3), slice(3, 6)):
            largest = max(abs(midpoint(value)) for state in self.balls.values() for value in state[group])
            uncertain |= {t for t, state in self.balls.items() if radius(state[group][0]) > part * largest}
        return uncertain


def agreement(references: Sequence[ComputedReference]) -> Against:
    """The kind of the references of one ensemble, all over the same times."""
    (coarse, fine), ends = references[0].words, references[0].ends
    radii = [motion.radius(t) for motion in references for t in motion.balls if ends is None or abs(t) < abs(ends)]
    agreed = radius_text(max(radii)) if radii else ""
    until = "" if ends is None else time_text(ends)
    return Against("computed", f"words of {coarse} and {fine} bits", agreed, until=until)


def of_rounded(
    problems: Sequence[Problem], times: Sequence[Fraction], least: int = 0, effort: float | None = None
) -> list[ComputedReference]:
    """The motions of problems of one format, from the very numbers that they are, in 30 bits more and 60 more.

    least: bits of the first run at least.  effort: as in :func:`compute`.
    All end where one has lost all significant digits of the format, as laws of growth do.
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
    """The motions at ``times``, from runs in about ``bits`` bits and in at least :data:`MORE_BITS` more.

    times: as for :func:`heavytop.integrate.multiword.motions.propagate_multiword`.
    format_bits: those of the format that is measured, in which the motions may lose all digits; None for no format.
    effort: seconds of the model of the cost that each run may take; None for 60, or the 600 of an ensemble shared out.
    Raises OutOfReach if a run does not reach the last time within the effort.
    """
    first = [_Served.of(problem, bits) for problem in problems]
    finer = _finer(problems, bits, first)
    second = [_Served.of(problem, finer) for problem in problems]
    words = [(one.bits, two.bits) for one, two in zip(first, second, strict=True)]
    balls: list[dict[Fraction, list[arb]]] = [{} for _ in problems]
    seconds = effort or (EFFORT if len(problems) == 1 else EFFORT_OF_MANY / len(problems))
    for early in _stages(times, _STAGES if format_bits is not None else 0):
        # no bit of a run depends on the samples taken: what a shorter stage had is not taken again
        more = [time for time in early if time not in balls[0]]
        for index, pair in enumerate(zip(_states(first, more, seconds), _states(second, more, seconds), strict=True)):
            known = balls[index] | dict(zip(more, _around(*pair, bits), strict=True))
            balls[index] = {time: known[time] for time in early}
        references = [ComputedReference(*pair) for pair in zip(words, balls, strict=True)]
        ends = (
            None
            if format_bits is None
            else _last_digit(references, [served.accuracy - format_bits for served in first])
        )
        if ends is not None and ends not in times:
            # lost on the way to the first sample
            return [ComputedReference(words, {}, times[0]) for words in words]
        if ends is not None:
            break
    return [replace(motion, ends=ends) for motion in references]


@dataclass(frozen=True, slots=True)
class _Served:
    """A motion in a format, and the words that serve it.

    bits: of the words.  accuracy: as in :func:`heavytop.integrate.multiword.engines.accuracy`.
    """

    problem: Problem
    bits: int
    accuracy: int

    @classmethod
    def of(cls, request: Given, bits: int) -> _Served:
        from heavytop.integrate.multiword.engines import accuracy, choose  # a proven reference needs no integrator

        problem = request(real(bits))
        arithmetic, scaled = choose(problem, None)
        return cls(problem, int(arithmetic.flags["bits"]), accuracy(arithmetic, scaled))


def _finer(problems: Sequence[Given], bits: int, first: Sequence[_Served]) -> int:
    """The bits of a second format, whose words have 30 bits more at least.

    Two formats may be served by the same words, and then differ by nothing.
    """
    finer = bits + MORE_BITS
    for problem, one in zip(problems, first, strict=True):
        while _Served.of(problem, finer).bits < one.bits + MORE_BITS:
            finer += _SEARCH
    return finer


def _stages(times: Sequence[Fraction], stages: int) -> list[Sequence[Fraction]]:
    """Times within the horizon over 4^n, each list longer than the one before; without any, its end."""
    ends = {n: times[-1] / 4**n for n in range(_PROBES if stages else 0, -1, -1)}
    counts = {n: sum(abs(time) <= abs(end) for time in times) for n, end in ends.items()}
    before = [[ends[n]] for n, count in counts.items() if not count]
    return [*before, *(times[:count] for count in dict.fromkeys(counts[n] for n in range(stages, -1, -1)) if count)]


def _last_digit(references: Sequence[ComputedReference], fewer: Sequence[int]) -> Fraction | None:
    """The first time at which some motion has lost all significant digits in a format of so many bits ``fewer`` than
    the words have.

    Its error is that of the shorter words, times 2 to as many bits: both are amplified alike.
    """
    lost = [
        reference.beyond(Fraction(1, _DIGIT) / 2 ** max(0, bits))
        for reference, bits in zip(references, fewer, strict=True)
    ]
    return next((time for time in references[0].balls if any(time in reference for reference in lost)), None)


def _states(served: Sequence[_Served], times: Sequence[Fraction], effort: float) -> list[Sequence[Any]]:
    """The states of each motion at ``times``."""
    problems = [served.problem for served in served]
    words = max(served.bits for served in served)
    limit = int(effort / seconds_a_step(words))
    runs = _followed(problems, times, min(limit, _PILOT_STEPS))
    states: list[Sequence[Any]] = [run.states for run in runs]
    if limit > _PILOT_STEPS and any(run.outcome is Outcome.STEP_LIMIT for run in runs):
        reached = min(abs(run.time_reached) for run in runs if run.outcome is Outcome.STEP_LIMIT)
        if abs(times[-1]) * _PILOT_STEPS > limit * reached:
            raise OutOfReach(
                f"A reference run in words of {words} bits to t = {decimal_text(times[-1], 6)} takes too long: its "
                f"first {_PILOT_STEPS} steps end at t = {decimal_text(reached, 3)}.",
                "Ask for an earlier time.",
            )
        done = min(map(len, states))
        runs = _followed(problems, times[done:], limit)
        states = [[*before[:done], *run.states] for before, run in zip(states, runs, strict=True)]
    for run in runs:
        if run.outcome is not Outcome.SUCCESS:
            raise OutOfReach(
                f"A reference run in words of {words} bits {run.outcome.message}.", "Ask for an earlier time."
            )
    return states


def _followed(problems: Sequence[Problem], times: Sequence[Fraction], limit: int) -> list[Trajectory]:
    """In words; one by itself is not put into lanes."""
    from heavytop.integrate.multiword.lanes import propagate_multiword_ensemble
    from heavytop.integrate.multiword.motions import integrate_to_samples

    targets = [number(time, problems[0].precision) for time in check_times(times)]
    if len(problems) == 1:
        return [integrate_to_samples(problems[0], targets, step_limit=limit)]
    return propagate_multiword_ensemble(problems, targets, step_limit=limit)


@whole_evaluation
def _around(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[list[arb]]:
    """The finer values; the radius of Ω, γ and ξ is the largest difference in it, and a rounding of the coarser."""
    with working_precision(bits + 128):
        return [_group_balls(one, two, bits) for one, two in zip(coarse, fine, strict=True)]


def _group_balls(coarse: Sequence[Any], fine: Sequence[Any], bits: int) -> list[arb]:
    one, two = to_balls(coarse), to_balls(fine)
    balls: list[arb] = []
    for k in range(0, len(one), 3):
        group = two[k : k + 3]
        apart = largest([b - a for a, b in zip(one[k : k + 3], group, strict=True)])
        apart += largest(group) * arb(2) ** -bits
        balls += [value + arb(0, apart.abs_upper()) for value in group]
    return balls


CHEAP = 1.0
"""Seconds of the model of the cost that the enclosure of a row may take beyond |t| = 100."""
_ALWAYS_ENCLOSED = 100
_DIGITS_A_BIT = Fraction(30103, 100000)
_SPARE_DIGITS = 3
_EFFORT = 1.0
"""Seconds that a second source at the horizon itself may cost; beyond, it is compared near 0 and near the horizon."""
_SHARED_STATES, _SHARED_BITS = 1024, 64

Evaluate = Callable[[Fraction, int], Sequence[arb]]


@dataclass(frozen=True, slots=True)
class Truth:
    """The states that a run is compared with.

    against: how they are known, for the row.  state: six balls at (time, bits).
    ends: the first time at which the format has lost all significant digits, and from which on there are no states;
    None where it keeps one to the last.
    """

    against: Against
    state: Evaluate = field(repr=False)
    ends: Fraction | None = None

    def covers(self, time: Fraction) -> bool:
        """Whether there is a state at that time."""
        return self.ends is None or abs(time) < abs(self.ends)

    def remembered(self) -> Truth:
        """This truth with each state worked out once: for several runs over the same times."""
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
        """Time, digits and second source."""
        c = self.certificate
        return Certified(
            shown(self.time), None if c.agreed_digits >= EXACTLY else c.agreed_digits, c.second_source, c.kind
        )

    @property
    def against(self) -> Against:
        """Method, radius and certificate, for the row."""
        limit = radius_text(Fraction(1, 2**self.bits))
        return Against("proven", self.certificate.method, limit, (self.certified,))

    @property
    def truth(self) -> Truth:
        """For a scorer."""
        enclosed = isinstance(self.solution, Validated)  # more bits than asked for are another run
        return Truth(self.against, self.solution.state if enclosed else states_of(self.solution))


def truth(problem: Problem, times: Sequence[Fraction], effort: float | None = None) -> Truth | str:
    """The true motion of a rounded problem at ``times``, exact numbers in the order of a run; why not, where it is
    neither proven nor computed.

    Of a problem with ξ nine balls a time: Ω, γ and the ξ that begins at that of the problem.
    effort: of a computed one, :func:`heavytop.measure.truth.compute`.
    Raises Contradiction where a second source excludes a proven one: then something is wrong with this program.
    """
    horizon = max(times, key=abs)
    known = known_motion(replace(problem, xi=None), horizon)
    if isinstance(known, Known):
        if problem.xi is None:
            return known.truth
        if (nine := _nine(known.solution, problem, horizon)) is not None:
            return Truth(known.against, nine)
    computed = _computed(problem, times, effort)
    if isinstance(known, Known):
        return computed
    if isinstance(computed, str):
        return f"{known}; {computed}"
    return replace(computed, against=replace_struct(computed.against, reason=known))


def uncertified(problem: Problem, times: Sequence[Fraction]) -> Truth | str:
    """A truth for the scatter of runs that differ in their roundings alone: no second source is asked."""
    form = closed_form(problem)
    return _computed(problem, times) if form is None else Truth(Against("proven", form.method), states_of(form))


def _computed(problem: Problem, times: Sequence[Fraction], effort: float | None = None) -> Truth | str:
    try:
        (computed,) = of_rounded([problem], times, effort=effort)
    except (InputError, OutOfReach) as error:
        return clause(error)
    if computed.ends == times[0]:
        return f"all significant digits of the format are lost at t = {time_text(computed.ends)}, the first sample"
    return Truth(computed.against, computed.state, computed.ends)


def clause(error: HeavyTopError) -> str:
    """Its cause inside a sentence."""
    return error.cause[:1].lower() + error.cause[1:].removesuffix(".")


def certified(solution: ExactSolution, time: Fraction, bits: int) -> Known | None:
    """``solution`` for references of ``bits`` bits, if it is certified to more digits than its format has at ``time``.

    None if not: a reference below its certified digits scores nothing.  Raises Contradiction where the second source
    excludes it.
    """
    digits = int(bits * _DIGITS_A_BIT)
    certificate = certify(solution, time, digits, enclosure=_enclosure(solution))
    needed = int((bits - GUARD_BITS) * _DIGITS_A_BIT) + _SPARE_DIGITS
    return Known(solution, certificate, time, bits) if certificate.agreed_digits >= needed else None


@lru_cache(maxsize=8)
def _enclosure(solution: ExactSolution) -> Validated:
    """The second source of a motion, whose pilots rows of several formats share."""
    return enclosure_of(solution, effort=_EFFORT)


@lru_cache(maxsize=8)
def closed_form(problem: Problem) -> ExactSolution | None:
    """The closed form of a rounded problem, if it has one here; the same for rows one after another of one problem."""
    if problem.system is GYROSTAT:
        # rounded, γ is no longer parallel to M: the rotor is that of the exact data
        return Gyrostat(problem.top, problem.start, problem.parameters.rotor)
    return next(matches(problem.top, problem.start, problem.system), None)


@lru_cache(maxsize=16)
def states_of(solution: ExactSolution) -> Evaluate:
    """The states of a motion, which rows and reruns share, also of formats between the same multiples of 64 bits."""
    states = lru_cache(maxsize=_SHARED_STATES)(solution.state)
    return lambda time, bits: states(time, -(-bits // _SHARED_BITS) * _SHARED_BITS)


@lru_cache(maxsize=32)
def known_motion(problem: Problem, horizon: Fraction) -> Known | str:
    """The closed form of a rounded problem, or its enclosure where that is cheap; why not, where there is neither.

    Certified at ``horizon`` for the bits of the format and its guard bits.  Raises Contradiction where the second
    source excludes it.
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


# The attitude vector of a known motion, from that which the problem begins with.


def _nine(solution: ExactSolution, problem: Problem, horizon: Fraction) -> Evaluate | None:
    """Ω, γ and ξ of a known motion: ξ by its closed form where that reaches the horizon, else by the enclosure.

    None where neither does.
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


# What the motions of an ensemble are compared with: closed forms, else runs in more bits.


_CERTIFIED_AT = Fraction(2)
"""|t| at which the closed form of every start is certified; that of the first start is at the horizon too."""
_TOO_FEW = "the closed form is certified to too few digits"


@dataclass(frozen=True, slots=True)
class EnsembleReference:
    """The references of an ensemble: the truth of each start, or why it is missing.

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
def reference(problems: tuple[Problem, ...], times: tuple[Fraction, ...], least: int = 0) -> EnsembleReference:
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
    """The data on which the motion depends: inertia and weight times a common factor are the same motion."""
    p = problem.parameters
    own = p.mapped(lambda value: value / p.inertia[0])
    rotor = p.rotors if problem.system is GYROSTAT else own.rotors
    return problem.system.name, *own.inertia, *own.moment, *rotor, problem.start


def _none(starts: int, reason: str) -> EnsembleReference:
    return EnsembleReference(Against("none", reason=reason), [reason] * starts, [])


def _certified(forms: Sequence[ExactSolution], times: Sequence[Fraction], bits: int) -> EnsembleReference:
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
    return EnsembleReference(against, [truths[id(form)] for form in forms], [[2.0**-bits] * len(times)] * len(forms))


def _proof(form: ExactSolution, time: Fraction, bits: int) -> Known | None:
    try:
        return certified(form, time, bits)
    except OutOfReach:
        return None
