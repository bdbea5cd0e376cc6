"""Integrators: what each is to this program and can do, found by name or source, and called with the options asked for.

heyoka, multiword and the peers are records of the table :data:`INTEGRATORS`, where a new one is a line; what an entry
point of another package names is one too.  A record that is in no table is its own source.
"""

from __future__ import annotations

import inspect
import math
import re
import sys
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any, Protocol

import msgspec

from heavytop.errors import HeavyTopError, InputError, OutOfReach, PeerFailed, invalid, quoted
from heavytop.exact.bodies import resolve
from heavytop.extras import extra_of, missing
from heavytop.integrate.frames import framed, one_in_frame
from heavytop.integrate.peers.command import Command, CommandIntegrator
from heavytop.integrate.peers.contract import CheckedPlugin, Declared, contained, quiet, said
from heavytop.integrate.peers.source import PythonFile, PythonObject, place_of
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import (
    DOUBLE,
    FORMATS,
    OrderedRing,
    Precision,
    Vector,
    cache_last_call,
    decimal_text,
    exact,
    log10,
    parse,
)
from heavytop.records import INTEGRATORS as FORMER
from heavytop.top.attitude import perpendicular, rotated, transposed
from heavytop.top.bodies import Body, Frame
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, SYSTEMS, System, square_of_rate, system
from heavytop.top.heavy_top import DoubleTimes, HeavyTop, State

GROUP = "heavytop.peers"
"""The entry point under which other packages name theirs."""
STEP_LIMIT = 10**7
"""Steps that are handed to a third-party integrator as a limit, where it takes one."""
Peer = Callable[..., Trajectory]
_YOURS = f"Yours is FILE.py:FUNCTION, FILE.toml, or an entry point {GROUP} (`heavytop docs gate`)."
_PATIENCE = 60
"""Seconds that a third-party package has to say what it is set by."""
_NAME = r"[A-Za-z0-9][A-Za-z0-9._:+-]{0,63}"
_PYTHON = re.compile(r"(?s)(.+\.py):([A-Za-z_][\w.]*)")
_TOML = re.compile(r"(?s)(.+\.toml)(?::(.*))?")
_SHOWN = "`heavytop docs gate` shows every key."
_MOST_SECONDS = 10**7
_EVERY = (*(form.name for form in FORMATS), "real")
_SYSTEMS = tuple(system.name for system in SYSTEMS)
_HERE = "heavytop.integrate"


class IntegratorSource(Protocol):
    """An integrator that is defined outside this program and every package."""

    @property
    def name(self) -> str:
        """In rows and messages."""
        ...

    def load(self) -> Callable[..., Any]:
        """The peer; raises InputError where there is none."""
        ...


@dataclass(frozen=True, slots=True)
class Integrator:
    """An integrator and its capabilities; places are ``module:name``, or the functions themselves.

    propagate: called as :func:`heavytop.integrate.heyoka.motions.propagate`, or as a peer
    (:mod:`heavytop.integrate.peers`).
    formats, systems: their names; None where nothing is declared.
    control: the option that sets its error, "tolerance" or "step"; "" where only its signature says.
    ensemble: called as :func:`heavytop.integrate.ensemble.propagate_ensemble`; "" for one motion at a time.
    steps: called as :func:`heavytop.integrate.heyoka.motions.first_steps`; "" where single steps are not exposed.
    attitude: whether ξ rides along.
    streams: whether it calls an observer at each sample, takes a step limit and resumes.
    needs: modules of extras.
    own: whether it is this program's, and so believed.
    """

    name: str
    propagate: str | Callable[..., Any]
    formats: tuple[str, ...] | None = ("double",)
    systems: tuple[str, ...] | None = _SYSTEMS
    control: str = "tolerance"
    ensemble: str = ""
    steps: str | Callable[..., Any] = ""
    attitude: bool = False
    streams: bool = False
    needs: tuple[str, ...] = ()
    own: bool = True

    @property
    def lacks(self) -> str:
        """The first module of an extra that is not installed; "" where none lacks."""
        return next((module for module in self.needs if find_spec(module) is None), "")

    @property
    def formats_text(self) -> str:
        """The formats in words; "" where these are few or not declared."""
        missing = [name for name in _EVERY if name not in (self.formats or ())]
        return "" if len(missing) > 1 else "every format" + (f" but {missing[0]}" if missing else "")

    def load(self) -> Callable[..., Any]:
        """The function that propagates, imported."""
        return load(self.propagate)  # type: ignore[no-any-return]

    def capabilities(self) -> dict[str, Any]:
        """As `list --json` shows them; None for what is not declared."""
        return {
            "formats": self.formats,
            "systems": self.systems,
            "control": self.control or None,
            "ensemble": bool(self.ensemble),
            "steps": bool(self.steps),
            "attitude": self.attitude,
        }


def foreign(name: str, place: str | Callable[..., Any] = "") -> Integrator:
    """An integrator of another package, or of a source: nothing is known of what it can do."""
    return Integrator(name, place, None, None, "", own=False)


def name_of(which: str | IntegratorSource) -> str:
    """The name in rows of an integrator that is named or defined by its source."""
    return which if isinstance(which, str) else which.name


def described(which: str | IntegratorSource) -> Integrator:
    """Capabilities, without a look at the integrator: a record's own; of another package's or a file's, nothing."""
    if isinstance(which, str):
        return INTEGRATORS.get(which) or foreign(which)
    return which if isinstance(which, Integrator) else foreign(which.name)


def load(place: str | Callable[..., Any]) -> Any:
    """The object at ``module:name``, imported; a function itself."""
    return EntryPoint("", place, "").load() if isinstance(place, str) else place


loaded = lru_cache(maxsize=64)(load)  # for this program's own, looked up once


def _peer(name: str, place: str, *needs: str, **capabilities: Any) -> Integrator:
    return Integrator(name, f"{_HERE}.peers.{place}", needs=needs, attitude=True, **capabilities)


INTEGRATORS = {
    each.name: each
    for each in (
        Integrator(
            "heyoka",
            f"{_HERE}.heyoka.motions:propagate",
            tuple(name for name in _EVERY if name != "double-double"),
            ensemble=f"{_HERE}.ensemble:propagate_ensemble",
            steps=f"{_HERE}.heyoka.motions:first_steps",
            attitude=True,
            streams=True,
        ),
        _peer("heyoka:constants", "heyoka_taylor:constants"),
        _peer("heyoka:lanes", "heyoka_taylor:lanes"),
        Integrator(
            "multiword",
            f"{_HERE}.multiword.motions:propagate_multiword",
            _EVERY,
            ensemble=f"{_HERE}.multiword.lanes:propagate_multiword_ensemble",
            attitude=True,
            streams=True,
            needs=("llvmlite",),
        ),
        _peer("scipy:DOP853", "scipy_ivp:dop853", "scipy"),
        _peer("scipy:LSODA", "scipy_ivp:lsoda", "scipy"),
        _peer("scipy:Radau", "scipy_ivp:radau", "scipy"),
        _peer("cyrk:DOP853", "cyrk:dop853", "CyRK", "numba"),
        _peer("cyrk:Vern8", "cyrk:vern8", "CyRK", "numba"),
        _peer("sundials:CVODE", "sundials:cvode", "sksundae"),
        _peer("diffrax:Dopri8", "diffrax_dopri8:dopri8", "diffrax"),
        _peer("mpmath:odefun", "mpmath_taylor:odefun", formats=_EVERY),
        _peer("splitting:2", "splitting:order2", control="step"),
        _peer("splitting:4", "splitting:order4", control="step"),
        _peer("splitting:8", "splitting:order8", control="step"),
    )
}


# Those of other packages, and what a user writes: `mine.toml`, `./mine.py:solve` or a callable.


def named(integrator: Any, folder: Path | None = None) -> str | IntegratorSource:
    """The integrator that a user names: its name of now where it is the name of one, else its source.

    folder: what paths are relative to; None for the working directory.
    Raises InputError for a file that describes none, or several.
    """
    if not isinstance(integrator, str):
        return of_callable(integrator)
    python, toml = _PYTHON.fullmatch(integrator), _TOML.fullmatch(integrator)
    if python is None and toml is None:
        return FORMER.get(integrator, integrator)  # the working directory may be gone
    base = (folder or Path()).absolute()
    if python is not None:
        return PythonFile(str((base / python[1]).resolve()), python[2])
    assert toml is not None
    match, path, wanted = toml, base / toml[1], toml[2]
    found = [each for each in commands_in(path) if wanted in (None, each.name)]
    if len(found) != 1:
        known = ", ".join(each.name for each in commands_in(path))
        raise InputError(f"{integrator} is not one integrator: {path.name} has {known}.", f"Give {match[1]}:NAME.")
    return found[0]


def of_callable(call: Any) -> IntegratorSource:
    """A callable under the name that it gives itself, or of its file and function."""
    if isinstance(call, Command | PythonFile | PythonObject):
        return call
    if not callable(call):
        raise InputError(f"integrator = {quoted(call)} is none.", "Give a name, a file or a callable.")
    own = getattr(call, "integrator_name", None)
    file, function = place_of(call)
    plain = PythonFile(file, function).name if file else re.sub(r"[^\w.:+-]", "", function)[:64]
    return PythonObject(own if isinstance(own, str) and own else plain or "callable", call)


def commands_in(path: Path) -> list[Command]:
    """The programs that a TOML file describes; raises InputError for anything else in it."""
    try:
        text = path.read_text("utf-8")
        document = tomllib.loads(text)
    except (OSError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path} cannot be read: {error}.", "Give a readable TOML file.") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path} is not valid: {error}.", _SHOWN) from None
    tables = document.get("integrator")
    if document.keys() - {"integrator"} or not isinstance(tables, list) or not tables:
        raise InputError(f"{path} does not hold [[integrator]] tables alone.", _SHOWN)
    found = [command_of(table, path.parent, str(path)) for table in tables]
    if len({each.name for each in found}) < len(found):
        raise InputError(f"{path} gives one name to two integrators.", "Give each a name of its own.")
    return found


def command_of(table: Any, folder: Path, where: str) -> Command:
    """The program of a table `[[integrator]]`; raises InputError for an impossible value, with ``where`` it stands."""
    try:
        if isinstance(table, dict) and "folder" in table:
            raise msgspec.ValidationError("Object contains unknown field `folder`")
        command = msgspec.structs.replace(msgspec.convert(table, Command), folder=str(folder.absolute()))
        _require_possible(command)
    except (msgspec.ValidationError, HeavyTopError) as error:
        cause = error.cause if isinstance(error, HeavyTopError) else f"{invalid(error)}."
        raise InputError(f"{where}: [[integrator]] is not valid: {cause}", _SHOWN) from None
    return command


def _require_possible(command: Command) -> None:
    if not re.fullmatch(_NAME, command.name):
        raise InputError(f"the name {quoted(command.name)} is not letters, digits and ._:+- alone.")
    if command.name in INTEGRATORS or command.name in FORMER:
        raise InputError(f"the name {command.name} is that of a built-in integrator.")
    if not command.command or not all(part and "\0" not in part for part in command.command[:1]):
        raise InputError("command is empty.")
    if any("\0" in part for part in command.command):
        raise InputError("command holds a NUL character.")
    if not isinstance(command.timeout, str) and command.timeout != command.timeout:
        raise InputError("timeout is not a number.")
    if not 0 < exact(str(command.timeout)) <= _MOST_SECONDS:
        raise InputError(f"timeout = {quoted(command.timeout)} is not above 0 and up to {_MOST_SECONDS} seconds.")
    if command.order < 0:
        raise InputError(f"order = {command.order} is below 0.")
    for name, values in (("systems", command.declared.systems), ("directions", command.directions)):
        if not values:
            raise InputError(f"{name} is empty.")
    for each in command.systems:
        system(each)
    for each in command.precisions:
        if each != "real:BITS":
            parse(each)
    if not command.precisions:
        raise InputError("precisions is empty.")


def seconds_of(value: Any, what: str) -> float:
    """A time limit in seconds; raises InputError unless it is above 0."""
    seconds: Fraction = exact(value)
    if not 0 < seconds <= _MOST_SECONDS:
        raise InputError(f"{what} = {quoted(value)} is not a time limit.", f"Give seconds, up to {_MOST_SECONDS}.")
    return float(seconds)


def known() -> dict[str, Integrator]:
    """Every integrator by name, not yet imported: its own, then those of other packages, which replace none."""
    return INTEGRATORS | _of_packages(tuple(sys.path)) | INTEGRATORS


@lru_cache(maxsize=4)
def _of_packages(path: tuple[str, ...]) -> dict[str, Integrator]:
    """Integrators of the packages on ``sys.path``, looked through once."""
    entries = entry_points(group=GROUP)
    return {each.name: foreign(each.name, each.value) for each in entries if each.name not in FORMER}


def is_third_party(name: str) -> bool:
    """Whether an integrator of that name is not one of this program's."""
    return name not in INTEGRATORS and name not in FORMER


def peer(which: str | IntegratorSource) -> Peer:
    """The peer, imported; raises InputError for an unknown one and for one that cannot be imported."""
    if not isinstance(which, str):
        return which.load()
    name = which
    if name not in known():
        _of_packages.cache_clear()  # it may have been installed since
    entry = known().get(name)
    if entry is None:
        raise InputError(f"Unknown integrator {quoted(name)}.", f"Known: {', '.join(known())}. {_YOURS}")
    if entry.lacks:
        raise missing(extra_of(entry.lacks), f"The integrator {name}")
    try:
        with quiet():
            found = load(entry.propagate)
    except ImportError as error:
        raise InputError(f"The integrator {name} is not available: {said(error)}.", _remedy(entry)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever another package's module does when it is imported
        why = f"{type(error).__name__}: {said(error)}"
        raise InputError(f"The integrator {name} is broken: {why}.", _remedy(entry)) from error
    if not callable(found):
        raise InputError(f"The integrator {name} is broken: {entry.propagate} is not callable.", _remedy(entry))
    return found  # type: ignore[no-any-return]


def require(which: str | IntegratorSource) -> None:
    """Raises InputError for an unknown integrator, and for one of this program's that cannot be imported.

    One of another package is not imported: how that goes is for the rows to say.  A Python file has to be there.
    """
    if isinstance(which, PythonFile) and not Path(which.path).is_file():
        raise InputError(f"There is no file {which.path}.", "Give FILE.py:FUNCTION.")
    if isinstance(which, str) and (which not in known() or which in INTEGRATORS):
        peer(which)


def ready(which: str | IntegratorSource, control: tuple[str, Fraction] | None = None) -> Peer:
    """The peer with ``control``, ("tolerance", 1e-9) or ("step", 1/50): nothing is looked up in its calls.

    Its calls raise PeerFailed for whatever others do wrong (:mod:`heavytop.integrate.peers.contract`).
    Raises InputError for an unknown integrator and for a control that one of this program's does not have; PeerFailed
    where another package's cannot be used.
    """
    name, own = name_of(which), described(which).own
    if isinstance(which, Command):
        return _program(which, control)
    try:
        chosen = peer(which)
    except InputError as error:
        if own or (isinstance(which, str) and which not in known()):
            raise
        raise PeerFailed(error.cause.removesuffix(".")) from None
    declared = found if isinstance(found := getattr(chosen, "declared", None), Declared) else None
    given: dict[str, Any] = dict([control] if control else [])
    if control is not None or not own:
        with contained(name, " when its arguments were looked at"):
            arguments = inspect.signature(chosen).parameters
            takes_any = any(each.kind is each.VAR_KEYWORD for each in arguments.values())
        for option in given:
            if option not in arguments and not takes_any and own:
                raise InputError(
                    f"The integrator {name} has no {option}.", "Fixed steps take a step, others a tolerance."
                )
            if option not in arguments and not takes_any:
                raise PeerFailed(f"{name} has no {option}")
        if "step_limit" in arguments and not own:
            given["step_limit"] = STEP_LIMIT
    return CheckedPlugin(name, chosen, own, declared, given)


def _program(command: Command, control: tuple[str, Fraction] | None) -> Peer:
    """The program with that control; one that says that it failed raises PeerFailed with what it said."""
    if control is not None and control[0] != command.control:
        raise PeerFailed(f"{command.name} has no {control[0]}")
    integrate: Peer = CommandIntegrator(command)

    def call(*arguments: Any, **options: Any) -> Trajectory:
        run = integrate(*arguments, **options, **dict([control] if control else []))
        if run.outcome is Outcome.FAILED:
            raise PeerFailed(f"{command.name} failed: {run.flags['failure']}", answered=True)
        return run

    return call


def control_name(which: str | IntegratorSource) -> str:
    """The control of a peer: "step", "tolerance", or "" for neither, as for one that cannot be used."""
    if isinstance(which, Command):
        return which.control
    if control := described(which).control:
        return control
    for each in ("step", "tolerance"):
        try:
            ready(which, (each, Fraction(1, 100)))
        except (InputError, PeerFailed):
            continue
        return each
    return ""


def control_apart(which: str | IntegratorSource) -> str:
    """:func:`control_name`; a third-party one is looked at in a process of its own, which it may end or hold."""
    if isinstance(which, Command) or described(which).own:
        return control_name(which)
    from concurrent.futures.process import BrokenProcessPool, ProcessPoolExecutor

    from heavytop.processes import ChildContext

    context = ChildContext()
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        try:
            return pool.submit(control_name, which).result(timeout=_PATIENCE)
        except BrokenProcessPool:
            return ""
        except TimeoutError:
            context.kill()
            return ""


def available() -> dict[str, str | None]:
    """For each peer: None if it can be used, else why not, and the remedy.

    One of this program's is not imported: the packages that it needs are looked for.  One of another package is.
    """
    found: dict[str, str | None] = {}
    for name, each in known().items():
        found[name] = None
        if not each.own or each.lacks:
            try:
                peer(name)
            except InputError as error:
                found[name] = f"{error.cause} {error.remedy}"
    return found


def _remedy(entry: Integrator) -> str:
    return "" if entry.own else f"It comes from {entry.propagate}: repair or remove that package."


# Which runs are tried at all: those of no more steps than anyone waits for, whatever the units of the data.


MOST_STEPS = 10**12
"""In double a step takes a microsecond: these take days."""
_FAR_BELOW = 1e11


def expected_steps(problem: Problem, end: Fraction, step: Fraction | None = None) -> int:
    """How many steps a run to the time ``end`` takes, within a factor of ten; 0 for a motion that rests.

    The time over the step: over the fixed ``step`` of the method, else over the time in which the motion changes.
    """
    p, start = problem.parameters, problem.start.flat
    if not any(problem.system.field(p, start)):
        return 0
    square = end**2 * (square_of_rate(problem.system, p, start) if step is None else 1 / step**2)
    return math.isqrt(square.numerator // square.denominator)


@cache_last_call
def _square_in_doubles(problem: Problem) -> float:
    """The square of the rate at which the motion changes; inf where doubles do not hold it."""
    try:
        p, start = problem.parameters.mapped(float), tuple(map(float, problem.start.flat))
        return float(square_of_rate(problem.system, p, start))
    except (OverflowError, ZeroDivisionError):
        return math.inf


def _is_near(problem: Problem, end: OrderedRing) -> bool:
    """True only where the end is in reach by far; in doubles."""
    try:
        return float(end) ** 2 * _square_in_doubles(problem) < _FAR_BELOW**2
    except OverflowError:
        return False


def require_reach(
    problem: Problem, end: OrderedRing, step_limit: int | None = None, step: Fraction | None = None
) -> None:
    """Raises OutOfReach where a run to the time ``end`` takes more than :data:`MOST_STEPS` :func:`expected_steps`.

    A run that ``step_limit`` ends early is in reach.
    """
    if (step_limit is not None and step_limit <= MOST_STEPS) or (step is None and _is_near(problem, end)):
        return
    end = exact(end)
    steps = expected_steps(problem, end, step)
    if steps > MOST_STEPS:
        raise OutOfReach(
            f"A run to t = {decimal_text(end, 6)} takes some 1e{math.floor(log10(Fraction(steps)) or 0.0)} steps.",
            f"Up to {MOST_STEPS:.0e} are tried: ask for an earlier time, or for a proven state, which needs no steps "
            "where there is a closed form (`heavytop reference`).",
        )


# Integrators by name or source, as callables that take the options asked for, and no others.
#
# An option that an integrator does not have is refused where it is asked for, so none needs to take options that mean
# nothing to it.  What each can do: :class:`Integrator`.


def propagator(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    """A callable that propagates one motion with that integrator; raises InputError for an unknown name or option.

    Its calls raise OutOfReach as :func:`require_reach` does.
    """
    run = _unguarded(which, options)

    def call(
        top: HeavyTop,
        start: State,
        times: Sequence[OrderedRing],
        precision: Precision = DOUBLE,
        *,
        system: System = HEAVY_TOP,
        **more: Any,
    ) -> Any:
        if len(times):  # what is wrong with times is for the integrator to say
            end = times.doubles[-1] if type(times) is DoubleTimes else exact(times[-1])
            require_reach(Problem.of(top, start, precision, system), end, options.get("step_limit"))
        return run(top, start, times, precision, system=system, **more)

    return call


def _unguarded(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    name = name_of(which)
    if isinstance(which, Command):
        return _with(CommandIntegrator(which), name, options)
    found = described(which)
    if found.streams:
        return _with(loaded(found.propagate), name, options)
    _with(peer(which), name, options)
    return _with(ready(which), name, options)


def watched(
    which: str | IntegratorSource, options: dict[str, Any], observer: Callable[[Fraction, Any], None]
) -> Callable[..., Any]:
    """:func:`propagator`, with every state given to ``observer``: by a peer at the end of its run."""
    if described(which).streams:
        return propagator(which, {**options, "observer": observer})
    run = propagator(which, options)

    def call(*arguments: Any, **more: Any) -> Any:
        found = run(*arguments, **more)
        for time, state in zip(found.times, found.states, strict=True):
            observer(time, state)
        return found

    return call


def ensemble_propagator(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    """A callable that propagates many motions; raises InputError also for an integrator that runs one at a time.

    Its calls raise OutOfReach as those of :func:`propagator`.
    """
    found, name = described(which), name_of(which)
    if not found.ensemble:
        require(which)
        raise InputError(f"The integrator {name} runs one motion at a time.", "Call propagate for each.")
    run = _with(loaded(found.ensemble), name, options)

    def call(problems: Sequence[Problem], times: Sequence[OrderedRing], **more: Any) -> Any:
        for problem in problems if len(times) else ():
            require_reach(problem, exact(times[-1]), options.get("step_limit"))
        return run(problems, times, **more)

    return call


@lru_cache(maxsize=64)
def _names(function: Callable[..., Any]) -> frozenset[str] | None:
    """The arguments that it takes by name; None where that is anything."""
    parameters = inspect.signature(function).parameters
    if any(each.kind is inspect.Parameter.VAR_KEYWORD for each in parameters.values()):
        return None
    return frozenset(parameters)


def _with(function: Callable[..., Any], name: str, options: dict[str, Any]) -> Callable[..., Any]:
    """``function`` with these options; raises InputError for one that it does not have."""
    # other callables may have no hash
    names = (_names if isinstance(function, FunctionType) else _names.__wrapped__)(function)
    for option in options:
        if names is not None and option not in names:
            raise InputError(f"The integrator {name} has no {option}.", f"Leave it out, or use another than {name}.")

    def call(*arguments: Any, **more: Any) -> Any:
        return function(*arguments, **more, **options)

    return call


# A motion as it is handed to an integrator, in principal axes, and what comes back in the axes given.


_SPARE_BITS = 160
"""Irrational data of a run are rounded to so many bits more than its format has, of what it is told itself."""

Observer = Callable[[Fraction, Any], object]


@dataclass(frozen=True, slots=True)
class Setup:
    """A motion in principal axes.

    top, start: exact, of irrational data to many bits more than the format has.
    carried: ξ at t = 0, where the data say it.
    frame: the axes given; None where they are the principal ones.
    """

    top: HeavyTop
    start: State
    carried: Vector | None
    system: System
    precision: Precision
    frame: Frame | None

    @property
    def xi(self) -> Vector:
        """ξ at t = 0: of the attitude, else :func:`heavytop.top.attitude.perpendicular` of γ."""
        return perpendicular(self.start.gamma) if self.carried is None else self.carried

    @classmethod
    def of(cls, body: HeavyTop | Body, start: State, precision: Precision, system: System) -> Setup:
        """The motion of a body from ``start``."""
        if isinstance(body, HeavyTop) and start.attitude is None:
            return cls(body, start, None, system, precision, None)
        found = resolve(body, start, precision.bits + _SPARE_BITS)
        xi = perpendicular(found.start.gamma) if found.xi is None else found.xi
        if not found.is_rotated:
            return cls(found.top, found.start, xi, system, precision, None)
        if system is GYROSTAT:
            raise InputError(
                "The gyrostat has its rotor along a principal axis, but the axes given are not principal.",
                "Give principal axes, or a rotor in any axes: the heavy_gyrostat.",
            )
        frame = Frame(found.axes, body.centre, start.gamma, rotated(found.axes, xi))
        return cls(found.top, found.start, xi, system, precision, frame)

    def own(self, vector: Sequence[Fraction] | None) -> Sequence[Fraction] | None:
        """A vector of the axes given, in principal axes."""
        if vector is None or self.frame is None:
            return vector
        return rotated(transposed(self.frame.axes), vector)

    @property
    def problem(self) -> Problem:
        """The problem, as ensembles take it."""
        return Problem.of(self.top, self.start, self.precision, self.system)

    def in_body_axes(self, state: Any) -> Any:
        """A state of an observer in the axes given."""
        return state if self.frame is None else one_in_frame(state, self.frame, self.precision)

    def exactly_in_body_axes(self, state: Sequence[Fraction]) -> Sequence[Fraction]:
        """Vectors in principal axes, in the axes given, in exact rationals."""
        if self.frame is None:
            return state
        axes = self.frame.axes
        return [value for place in range(0, len(state), 3) for value in rotated(axes, state[place : place + 3])]

    def watched(self, observer: Observer | None) -> Observer | None:
        """An observer that is given the states in the axes given."""
        if observer is None or self.frame is None or not callable(observer):
            return observer
        return lambda time, state: observer(time, self.in_body_axes(state))

    def given(self, run: Trajectory) -> Trajectory:
        """The run in the axes given."""
        return run if self.frame is None else framed(run, self.frame)
