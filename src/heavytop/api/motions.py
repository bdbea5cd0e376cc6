"""Motions from Python: computed ones, many at once, and known ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any, TypeAlias, TypedDict, Unpack, cast

import numpy
from numpy.typing import NDArray

from heavytop import arguments
from heavytop.arguments import Number, Numbers
from heavytop.display import Lazy, Tabular, TitledTable, plural
from heavytop.errors import InputError, meant, prefixed, quoted, refusal
from heavytop.exact.bodies import Finder
from heavytop.exact.catalogue import find
from heavytop.exact.enclosure.run import EFFORT
from heavytop.integrate import registry
from heavytop.integrate.dense import Dense, DenseOutput, dense
from heavytop.integrate.frames import Setup
from heavytop.integrate.heyoka.engines import compiled
from heavytop.integrate.heyoka.motions import states_at
from heavytop.integrate.registry import described, named, require_reach, seconds_of
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.measure.derivatives import which_derivatives
from heavytop.measure.motion import Motion, compute
from heavytop.measure.reference import Reference
from heavytop.measure.reference import reference as proven
from heavytop.precision import (
    DOUBLE,
    LARGEST,
    Array,
    OrderedRing,
    Precision,
    as_integer,
    cache_last_call,
    exact,
    number,
    numbers,
    ordered,
)
from heavytop.top.attitude import Output
from heavytop.top.bodies import Body
from heavytop.top.equations import GYROSTAT, NAMES, System, square_of_rate
from heavytop.top.heavy_top import HeavyTop, State, TimeText, check_times

Observer: TypeAlias = Callable[[Fraction, Any], object]
EnsembleObserver: TypeAlias = Callable[[int, Fraction, Any], object]


class RunOptions(TypedDict, total=False):
    """Options of a run, as :func:`propagate` describes them; None for the default of the integrator."""

    tolerance: Number | None
    high_accuracy: bool | None
    compact_mode: bool | None
    step_limit: int | None
    step: Number | None


_OPTIONS = tuple(RunOptions.__annotations__)


def propagate(
    top: HeavyTop | Body,
    start: State,
    times: Numbers,
    precision: Precision | str = DOUBLE,
    *,
    integrator: str | Callable[..., Any] = "heyoka",
    system: System | str | None = None,
    xi: Numbers | None = None,
    attitude: bool | None = None,
    angles: bool | None = None,
    observer: Observer | None = None,
    **options: Unpack[RunOptions],
) -> Trajectory:
    """The motion from ``start`` at t = 0, computed in a number format.

    Arguments:
        top: principal moments I, weight P, centre of mass r on the principal axes; or a :class:`Body`, in any axes.
        start: Ω in 1/time unit and γ, or an :class:`Attitude`, at t = 0, in the axes of the body.
        times: shape (n,), exact numbers of one sign, strictly monotone away from 0; 0 itself may come first.
        precision: DOUBLE, EXTENDED, QUAD, real(BITS), or the name of one.
        integrator: "heyoka" or another name that `heavytop list` shows; a file, "mine.toml" of a program or
            "./mine.py:solve"; or a callable, a peer or a solver (:func:`heavytop.integrate.peers.double.double_peer`).
        system: "heavy_top", "gyrostat" or "heavy_gyrostat"; None for "heavy_gyrostat" where the top has a rotor, else
            "heavy_top".
        xi: shape (3,), a unit vector ⟂ γ, the space axis x in body components at t = 0, to ride along.
        attitude: True to have ξ ride along beside the states, from the attitude of the start, or else from
            γ by the rule of `heavytop docs outputs`, where no ``xi`` says otherwise: for ``quaternions()``,
            ``matrices()``, ``positions()``, ``omega_space()`` and ``euler("ZXZ")`` of the run; an observer is given
            nine numbers.  None for True where the start has an attitude and the integrator declares that it carries it.
        angles: True for ``angles()`` of the run too, the Euler angles φ, θ, ψ with all turns, followed from t = 0 on
            ``attitude``; not with ``xi``, an ``observer`` or options of heyoka alone.
        tolerance: relative and absolute. heyoka: from the eps of the format (where None) to 1; multiword: from there to
            1e-6, where None finer than the format; splittings have none.
        high_accuracy: compensated summation of heyoka's Taylor series, off where None.
        compact_mode: heyoka's, slower but quick to compile; None for off in double and extended, on elsewhere.
        step_limit: stop after that many steps; the times reached until then are returned.
        step: of an integrator with fixed steps, which is shortened so that it fills each interval; 1/100 where None.
        observer: called with (exact time, native state) at each sample, in place of keeping the states.

    Returns:
        A :class:`Trajectory`: ``outcome``, ``times``, ``states`` as an array (n, 6) of the format's numbers in the
        order Ω1 Ω2 Ω3 γ1 γ2 γ3, or (n, 9) with ``xi``, in the axes in which the body was given; ``to_numpy()`` in
        double, ``texts()`` in full.  A run that fails is an outcome, not an exception.

    Raises:
        InputError: for an invalid motion, time, format or option.
        OutOfReach: where the run would take more than 1e12 steps, unless ``step_limit`` ends it before.

    Source:
        (1.1) and (1.2) of the paper; the Taylor method is heyoka's (Biscani and Izzo, 2021).
    """
    if arguments.flag(angles, "angles"):
        if xi is not None or observer is not None or attitude is False:
            raise InputError("angles go with neither xi, observer nor attitude=False.", "Leave angles or these out.")
        shown = motion(
            top,
            start,
            times,
            precision,
            integrator=integrator,
            system=system,
            angles=True,
            **options,
        )
        states = shown.trajectory.states
        return replace(
            shown.trajectory,
            states=states[:, :6],
            attitude=states[:, 6:],
            angle_texts=shown.angles,
        )
    # mutable arguments are checked in each call
    checked = _checked_names(options)
    checked["step_limit"] = arguments.steps(checked["step_limit"])
    lasting = isinstance(integrator, str) and checked["tolerance"] is None and xi is None and observer is None
    prepare = _kept if lasting and described(cast(str, integrator)).streams else _prepared
    run = prepare(top, start, precision, integrator, system, xi, attitude, observer, *checked.values())
    return run(times)


def _prepared(
    top: HeavyTop | Body,
    start: State,
    precision: Precision | str,
    integrator: str | Callable[..., Any],
    system: System | str | None,
    xi: Numbers | None,
    attitude: bool | None,
    observer: Observer | None,
    *values: Any,
) -> Callable[[Numbers], Trajectory]:
    """:func:`propagate` of times, everything else checked; values: of :class:`RunOptions`, in order."""
    form = arguments.precision(precision)
    body, state = arguments.motion(top, start, form)
    setup = Setup.of(body, state, form, arguments.system(system, body))
    options = _options(form, dict(zip(_OPTIONS, values, strict=True)), setup.watched(observer))
    with_attitude = arguments.flag(attitude, "attitude")
    which = named(integrator)
    if xi is not None and with_attitude is False:
        raise InputError("xi was given with attitude=False.", "Leave one of them out.")
    if with_attitude is None:
        with_attitude = state.attitude is not None and described(which).carries_attitude
    apart = xi is None and with_attitude
    if xi is not None:
        options["xi"] = setup.own(arguments.attitude(xi, state, form))
    elif apart:
        options["xi"] = setup.xi
    run = registry.propagator(which, options)

    def call(times: Numbers) -> Trajectory:
        trajectory: Trajectory = run(setup.top, setup.start, check_times(times), form, system=setup.system)
        if apart:
            trajectory = replace(trajectory, states=trajectory.states[:, :6], attitude=trajectory.states[:, 6:])
        return setup.given(trajectory).with_dense(_dense(setup, which, trajectory.time_reached, options))

    return call


_kept = cache_last_call(_prepared)


def _dense(
    setup: Setup, which: str | Any, until: Fraction, options: Mapping[str, Any]
) -> Callable[[Fraction], Sequence[Any]]:
    """(Ω, γ) of the run at any time, in the axes given."""
    limits = options.get("xi"), options.get("tolerance"), options.get("step_limit")
    return DenseOutput(partial(_run_again, setup, which, until, *limits), setup.in_body_axes)


def _run_again(setup: Setup, which: str | Any, until: Fraction, xi: Any, *limits: Any) -> Dense:
    problem = Problem.of(setup.top, setup.start, setup.precision, setup.system, xi)
    return dense(which, problem, until, *limits)


def motion(
    top: HeavyTop | Body,
    start: State,
    times: Numbers,
    precision: Precision | str = DOUBLE,
    *,
    integrator: str | Callable[..., Any] = "heyoka",
    system: System | str | None = None,
    angles: bool = False,
    outputs: tuple[Output, ...] = (),
    reached: Callable[[Fraction], None] | None = None,
    **options: Unpack[RunOptions],
) -> Motion:
    """Compute a motion as `heavytop propagate` shows it, with the drift of every first integral that holds.

    Arguments:
        top, start, times, precision, integrator, system, options: as in :func:`propagate`.
        angles: ξ rides along, and the Euler angles φ, θ, ψ are followed from t = 0, continuous but for jumps by π at
            the poles.
        outputs: of :func:`heavytop.top.attitude.outputs`, told beside the states.
        reached: called with the times on the way.

    Returns:
        A :class:`heavytop.measure.motion.Motion`: ``trajectory``, ``states``, ``drift``, ``attitude``, ``angles``.

    Raises:
        InputError, OutOfReach: as :func:`propagate`.
    """
    form = arguments.precision(precision)
    body, state = arguments.motion(top, start, form)
    about = arguments.system(system, body)
    checked = _options(form, options, None)
    ordered_times = ordered(times, "times", "Give a list such as [1, 2, 5].")
    instants = check_times(ordered_times)
    written = [str(TimeText.of(time)) for time in ordered_times]
    return compute(body, state, instants, form, about, angles, checked, named(integrator), reached, outputs, written)


def ensemble(
    tops: HeavyTop | Body | Iterable[HeavyTop | Body],
    starts: State | Iterable[State],
    times: Numbers,
    precision: Precision | str = DOUBLE,
    *,
    integrator: str = "heyoka",
    system: System | str | None = None,
    threads: int | None = None,
    observer: EnsembleObserver | None = None,
    **options: Unpack[RunOptions],
) -> list[Trajectory]:
    """Many motions at once, over the same times: in SIMD lanes in double, in threads in every format.

    Arguments:
        tops, starts: as many of one as of the other; a single one serves all of the others.
        times, precision, integrator, system, tolerance, high_accuracy, compact_mode: as in :func:`propagate`.
        threads: None for one per processor that this process may use.
        step_limit: for each motion.
        observer: called with (index of the motion, exact time, native state) in place of keeping the states, by the
            thread that calls this; the times of each motion in order, the motions mixed.

    Returns:
        A list of :class:`Trajectory`, one for each motion in their order, each with an outcome of its own.

    Raises:
        InputError: as :func:`propagate`, naming the motion; for no motions, and for counts that differ.
        OutOfReach: as :func:`propagate`.
    """
    form, bodies = arguments.precision(precision), arguments.bodies(tops, "tops")
    states = arguments.listed(starts, State, "starts")
    setups = _setups(bodies, states, form, arguments.system(system, *bodies))
    checked = _options(form, options, _watching(setups, observer))
    checked |= {} if threads is None else {"threads": arguments.count(threads, "threads")}
    run = registry.ensemble_propagator(named(integrator), checked)
    trajectories = run([setup.problem for setup in setups], check_times(times))
    return [setup.given(member) for setup, member in zip(setups, trajectories, strict=True)]


def reference(
    top: HeavyTop | Body,
    start: State,
    times: Numbers,
    digits: int = 50,
    *,
    system: System | str | None = None,
    attitude: bool | None = None,
    derivatives: str | None = None,
    effort: Number | None = None,
    finder: Finder | None = None,
) -> Reference:
    """The known motion: proven states, from a closed form where there is one, else from a validated enclosure.

    Arguments:
        top, start: as in :func:`propagate`; the motion is that of the exact numbers given.
        times: shape (n,), exact numbers in any order.
        digits: 1 to 20,000; relative above 1, absolute below.
        system: "heavy_top", "gyrostat" or "heavy_gyrostat"; None for "heavy_gyrostat" where the top has a rotor, else
            "heavy_top".
        attitude: give ξ as well, fixed in space and ⟂ γ, in body components; None for True where the start has an
            attitude.
        derivatives: "start" for ∂(Ω, γ)(t)/∂(Ω0, γ0) as well, γ0 as three independent variables; "data" for
            ∂(Ω, γ)(t)/∂(I1, I2, I3, n1, n2, n3), n = P r; "all" for both.
        effort: seconds that an enclosure may take, by a model of its cost and no clock; 900 where None.
        finder: in place of the catalogue's, so that progress may be watched: (top, start, system, effort) -> solution.

    Returns:
        A :class:`Reference`: ``method``, ``states[i][j].value`` and ``.radius`` as decimal text (the true number is
        within the radius of the value), ``texts()``, ``to_numpy()`` and ``radii()``, each of shape (n, 6);
        ``attitude[i][j]``, shape (n, 3), and ``attitude_method``, where asked for, else None; ``derivatives`` with
        balls, ``derivatives_numpy()``, shape (n, 6, 6), and ``lyapunov()``.

    Raises:
        InputError: for an invalid motion or time, and for other digits.
        OutOfReach: where the digits cannot be proven, and for fractions beyond 1e-9000 to 1e9000.
    """
    body, state = arguments.motion(top, start, of_any_size=True)
    about, instants = arguments.system(system, body), ordered(times, "times", "Give a list such as [1, 2, 5].")
    arguments.any_times(instants)
    wanted = arguments.flag(attitude, "attitude")
    told = state.attitude is not None if wanted is None else wanted
    which = which_derivatives(derivatives)
    seconds = EFFORT if effort is None else seconds_of(effort, "effort")
    solution = arguments.callback(finder, "finder") or find
    return proven(body, state, instants, as_integer(digits, "digits"), about, solution, told, which, seconds)


def _setups(tops: Sequence[HeavyTop | Body], starts: Sequence[State], form: Precision, system: System) -> list[Setup]:
    """The motions of an ensemble; a single top or start serves all of the others."""
    size = max(len(tops), len(starts))
    if not tops or not starts:
        raise InputError(f"No {'starts' if tops else 'tops'} were given.", "Give at least one.")
    if {len(tops), len(starts)} - {1, size}:
        remedy = "Give as many of each, or one that all share."
        raise InputError(f"tops and starts must be equally many; got {len(tops)} and {len(starts)}.", remedy)
    setups = []
    for index in range(size):
        with prefixed(f"Motion {index}"):
            body, start = arguments.motion(tops[index % len(tops)], starts[index % len(starts)], form)
            setups.append(Setup.of(body, start, form, system))
    return setups


def _watching(setups: Sequence[Setup], observer: EnsembleObserver | None) -> EnsembleObserver | None:
    """An observer that is given the states in the axes given."""
    if observer is None or not callable(observer) or all(setup.frame is None for setup in setups):
        return observer
    return lambda index, time, state: observer(index, time, setups[index].in_body_axes(state))


def _checked_names(options: Mapping[str, Any]) -> dict[str, Any]:
    """Every option in order, None where it was not given; TypeError for any other name, as Python raises it."""
    for name in options:
        if name not in _OPTIONS:
            raise TypeError(f"unexpected keyword argument {name!r}. {meant(name, _OPTIONS)}Use {', '.join(_OPTIONS)}.")
    return {name: options.get(name) for name in _OPTIONS}


def _options(
    form: Precision, options: Mapping[str, Any], observer: Callable[..., object] | None = None
) -> dict[str, Any]:
    """The options that were asked for, checked: an integrator need not know the others."""
    options_given = _checked_names(options)
    checked = {
        "tolerance": arguments.tolerance(options_given["tolerance"], form),
        "high_accuracy": arguments.flag(options_given["high_accuracy"], "high_accuracy"),
        "compact_mode": arguments.flag(options_given["compact_mode"], "compact_mode"),
        "step_limit": arguments.steps(options_given["step_limit"]),
        "step": arguments.positive(options_given["step"], "step"),
        "observer": arguments.callback(observer, "observer"),
    }
    return {name: value for name, value in checked.items() if value is not None}


# An integrator prepared once, for calls that cost little more than their integration.


_NEAR_STEPS = 1e11
"""A run of fewer expected steps is in reach without looking closer."""
_LARGEST = float(LARGEST)
_SLOWEST, _FASTEST = 2.0**-94, 2.0**76
"""Squares of rates well within those of :func:`heavytop.integrate.heyoka.motions.unit_of`."""
_SLACK = float(arguments.slack_of(DOUBLE))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Propagated(Tabular):
    """Motions of one top at the times asked for, as arrays of the format's numbers.

    times: native, shape (n,), or one number.  states: order Ω1 Ω2 Ω3 γ1 γ2 γ3, shape (m, n, 6) for m starts, (n, 6) for
    one, without n where one time was asked for; ``nan`` at times that were not reached.
    outcome, time_reached, steps: as of a :class:`Trajectory`; of m starts tuples of m.
    """

    times: Any
    states: Any
    outcome: Outcome | tuple[Outcome, ...]
    time_reached: Any
    steps: int | tuple[int, ...]

    @property
    def succeeded(self) -> bool:
        """Whether every motion reached every time."""
        outcomes = self.outcome if isinstance(self.outcome, tuple) else (self.outcome,)
        return all(outcome is Outcome.SUCCESS for outcome in outcomes)

    def to_numpy(self) -> NDArray[numpy.float64]:
        """The states rounded to double, in the same shape."""
        return numpy.array(self.states, dtype=float)

    def _table(self) -> TitledTable:
        flat = self.to_numpy().reshape(-1, 6)
        said = "all reached every time" if self.succeeded else "not all times were reached"
        times = numpy.atleast_1d(self.times)
        lines = Lazy(len(flat), lambda i: (str(float(times[i % len(times)])), *map(str, flat[i])))
        title = f"{plural(len(self.steps) if isinstance(self.steps, tuple) else 1, 'motion')}: {said}"
        return TitledTable(title, ("t", *NAMES), lines)


class Integrator:
    """One top, one format and one integrator, prepared once for many calls.

    Arguments:
        top, precision, integrator, system, tolerance, high_accuracy, compact_mode, step_limit: as in
            :func:`propagate`, whose bits these are.

    Heyoka in double about principal axes is called with a few array operations around it; every other integrator,
    format and body serves too, at the price of :func:`propagate`.  Threads may share one.

    Raises:
        InputError: as :func:`propagate`.
    """

    def __init__(
        self,
        top: HeavyTop | Body,
        precision: Precision | str = DOUBLE,
        *,
        integrator: str | Any = "heyoka",
        system: System | str | None = None,
        **options: Unpack[RunOptions],
    ) -> None:
        self._form = arguments.precision(precision)
        self._top, _ = arguments.motion(top, _SOME_START, self._form)
        self._system = arguments.system(system, self._top)
        self._asked = integrator
        self._options = _options(self._form, options)
        self._limit: int | None = self._options.get("step_limit")
        self._is_plain = (
            self._form == DOUBLE
            and named(integrator) == "heyoka"
            and self._system is not GYROSTAT
            and isinstance(self._top, HeavyTop)
            and "step" not in self._options  # refused by a call
        )
        if self._is_plain:
            self._prepare()

    def __reduce__(self) -> Any:
        """The call that prepares it again, for another process."""
        prepare = partial(Integrator, integrator=self._asked, system=self._system, **self._options)
        return prepare, (self._top, self._form)

    def _prepare(self) -> None:
        options = {name: value for name, value in self._options.items() if name != "step_limit"}
        problem = self._problem(_SOME_START)
        self._tool = compiled(self._system, self._form, **options)
        self._numbers = numpy.array(problem.native(self._system.entering(problem.parameters)))
        # no motion changes faster than at max(|Ω|² turning, driven); no component of γ is beyond 2
        rates = problem.parameters.mapped(float)
        self._driven = square_of_rate(self._system, rates, (0.0, 0.0, 0.0, 2.0, 2.0, 2.0))
        turns = float(rates.rotor_rate)
        self._pull = max(turns * turns, max(map(abs, rates.moment)) / min(rates.inertia))
        still = rates._replace(moment=(0.0, 0.0, 0.0))
        self._turning = square_of_rate(self._system, still, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0))

    def propagate(self, start: State | Numbers, times: Number | Numbers) -> Propagated:
        """The motion, or the motions, from t = 0.

        Arguments:
            start: a :class:`State`; or Ω1 Ω2 Ω3 γ1 γ2 γ3 in one list or array; or an array (m, 6) of m starts.
            times: one time; or several, as in :func:`propagate`.

        Returns:
            A :class:`Propagated`.  A run that fails is an outcome, not an exception.

        Raises:
            InputError: for an invalid start or time.
            OutOfReach: as :func:`propagate`.
        """
        targets, is_one = self._targets(times)
        starts, several = ([start], False) if isinstance(start, State) else self._rows(start)
        trajectories = []
        for index, member in enumerate(starts):
            try:
                trajectories.append(self._one(member, targets))
            except InputError as error:
                if not several:
                    raise
                raise InputError(f"Motion {index}: {error.cause}", error.remedy) from None
        return self._together(trajectories, targets, several, is_one)

    def _targets(self, times: Any) -> tuple[Sequence[Any], bool]:
        """Native times, checked, and whether one was asked for."""
        if type(times) is float and -_LARGEST < times < _LARGEST and self._is_plain:
            return (times,), True
        is_one = isinstance(times, int | float | str | Fraction) or not hasattr(times, "__iter__")
        targets = check_times([times] if is_one else times)
        if not len(targets):
            raise InputError("No times were given.", "Give at least one, such as 1, 2, 5.")
        return numbers(targets, self._form), is_one

    def _rows(self, start: Any) -> tuple[Any, bool]:
        """The starts, a row each, and whether there are several."""
        try:
            if numpy.ma.is_masked(start):
                raise TypeError
            array = start if isinstance(start, numpy.ndarray) else _array(list(start))
            if array.dtype.kind == "f" and array.dtype.itemsize < 8:
                array = array.astype(float)
            if array.ndim == 1 and array.shape == (6,):
                return [array], False
            if array.ndim == 2 and array.shape[1] == 6 and len(array):
                return array, True
        except (TypeError, ValueError):
            raise refusal("start", "a State or an array of numbers", quoted(start), _SHAPES) from None
        raise InputError(f"start must have the shape (6,) or (m, 6); got {array.shape}.", _SHAPES)

    def _one(self, start: Any, targets: Sequence[OrderedRing]) -> tuple[Any, Outcome, Any, int]:
        """As :func:`heavytop.integrate.heyoka.motions.states_at`."""
        if self._is_plain:
            plain = self._plain(start, targets)
            if plain is not None:
                engine = self._tool.take()
                try:
                    return states_at(engine, self._numbers, plain, targets, self._limit, self._form)
                finally:
                    self._tool.spare.append(engine)
        trajectory = propagate(
            self._top,
            start if isinstance(start, State) else State(start[:3], start[3:]),
            [exact(target) for target in targets],
            self._form,
            integrator=self._asked,
            system=self._system,
            attitude=False,
            **self._options,
        )
        return trajectory.states, trajectory.outcome, number(trajectory.time_reached, self._form), trajectory.steps

    def _plain(self, start: Any, targets: Sequence[OrderedRing]) -> Any:
        """The start in doubles, checked; None for an irrational or an invalid one, and for a motion in a unit of time
        of its own, which exact numbers treat.
        """
        if isinstance(start, State):
            if start.attitude is not None:
                return None
            arguments.motion(self._top, start, self._form)
            values = list(map(float, self._problem(start).start.flat))
        elif start.dtype == numpy.float64:
            values = start.tolist()
        else:
            return None
        w1, w2, w3, g1, g2, g3 = values
        fastest = max(abs(w1), abs(w2), abs(w3))
        if not (fastest < _LARGEST and abs(g1 * g1 + g2 * g2 + g3 * g3 - 1) < _SLACK):
            return None
        if not _SLOWEST < max(fastest * fastest, self._pull) < _FASTEST:
            return None
        span = float(targets[-1])
        if not span * span * max(fastest * fastest * self._turning, self._driven) < _NEAR_STEPS**2:
            require_reach(self._problem(State(values[:3], values[3:])), exact(targets[-1]), self._limit)
        return values

    def _problem(self, state: State) -> Problem:
        assert isinstance(self._top, HeavyTop)
        return Problem.of(self._top, state, self._form, self._system)

    def _together(
        self, results: list[tuple[Any, Outcome, Any, int]], targets: Sequence[OrderedRing], several: bool, is_one: bool
    ) -> Propagated:
        blocks = [self._filled(states, len(targets)) for states, *_ in results]
        times = targets[0] if is_one else numpy.array(targets)
        if not several:
            states, (_, outcome, reached, steps) = blocks[0], results[0]
            return Propagated(times, states[0] if is_one else states, outcome, reached, steps)
        states = numpy.array(blocks)
        _, outcomes, ends, counts = zip(*results, strict=True)
        return Propagated(times, states[:, 0] if is_one else states, outcomes, numpy.array(ends), counts)

    def _filled(self, states: Any, count: int) -> Any:
        """States at all times, ``nan`` where they were not reached."""
        missing = count - len(states)
        if not missing:
            if count == 1:
                return states[0].reshape(1, 6)
            return states if isinstance(states, numpy.ndarray) else numpy.array(states)
        nothing = [number(Fraction(0), self._form) * float("nan")] * 6
        return numpy.array([*states, *([nothing] * missing)])


def _array(values: list[Any]) -> Array:
    """Doubles where all are; else numbers of any kind."""
    return numpy.array(values, dtype=float if all(isinstance(value, float) for value in values) else object)


_SOME_START = State((0, 0, 0), (0, 0, 1))
_SHAPES = "Give a State, six numbers Omega1 Omega2 Omega3 gamma1 gamma2 gamma3, or an array of m rows of them."
