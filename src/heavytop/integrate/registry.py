"""Integrators: their records and capabilities, found by name or source, and called with the requested options.

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
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache, partial
from importlib.util import find_spec
from pathlib import Path
from pkgutil import resolve_name
from types import FunctionType
from typing import Any, TypeAlias, TypeVar

import msgspec

from heavytop.errors import (
    HeavyTopError,
    InputError,
    OutOfReach,
    PeerFailed,
    Unsupported,
    argument,
    invalid,
    meant,
    quoted,
    refusal,
)
from heavytop.extras import extra_of, missing
from heavytop.files import readable
from heavytop.integrate.peers.command import Command
from heavytop.integrate.peers.contract import CheckedPlugin, Declared, contained, quiet, require_equal, said
from heavytop.integrate.peers.source import PythonFile, PythonObject, place_of
from heavytop.integrate.trajectory import EnsembleObserver, Finished, Observer, Outcome, Problem, Trajectory
from heavytop.precision import (
    DOUBLE,
    FORMATS,
    OrderedRing,
    Precision,
    cache_last_call,
    exact,
    log10,
    physical,
    six_digits,
)
from heavytop.records import INTEGRATORS as FORMER
from heavytop.top.equations import GYROSTAT, HEAVY_TOP, SYSTEMS, System, square_of_rate
from heavytop.top.heavy_top import DoubleTimes, HeavyTop, State

GROUP = "heavytop.peers"
"""The entry point under which other packages name theirs."""
STEP_LIMIT = 10**7
"""Steps that are handed to a third-party integrator as a limit, where it takes one."""
Peer = Callable[..., Trajectory]
T = TypeVar("T")
_YOURS = f"Yours is FILE.py:FUNCTION, FILE.toml, or an entry point {GROUP} (`heavytop docs gate`)."
_PATIENCE = 60
"""Seconds within which a third-party package must tell its control."""
_NAME = r"[A-Za-z0-9][A-Za-z0-9._:+-]{0,63}"
_PYTHON = re.compile(r"(?s)(.+\.py):([A-Za-z_][\w.]*)")
_TOML = re.compile(r"(?s)(.+\.toml)(?::(.*))?")
_SHOWN = "`heavytop docs gate` shows every key."
_MOST_SECONDS = 10**7
_EVERY = (*(form.name for form in FORMATS), "real")
_SYSTEMS = tuple(system.name for system in SYSTEMS)
_HERE = "heavytop.integrate"
_CONTROLS = ("step", "tolerance")
_AGAIN_SECONDS = 1.0
"""A longer call of an integrator of another package is made once."""


IntegratorSource: TypeAlias = "Command | PythonFile | PythonObject | Integrator"
"""Where an integrator is defined that is neither this program's nor a package's; a record in no table is its own."""


@dataclass(frozen=True, slots=True)
class Integrator:
    """An integrator, its capabilities, and how it is run; functions are ``module:name``, or themselves.

    function: called as :func:`heavytop.integrate.heyoka.motions.propagate`, or as a peer
    (:mod:`heavytop.integrate.peers`).
    formats, systems: their names; None where nothing is declared.
    control: the option that sets its error, "tolerance" or "step"; "" where only its signature says.
    ensemble: called as :func:`heavytop.integrate.ensemble.propagate_ensemble`; "" for one motion at a time.
    steps: called as :func:`heavytop.integrate.heyoka.motions.first_steps`; "" where single steps are not exposed.
    attitude: whether ξ rides along.
    streams: whether it calls an observer at each sample, takes a step limit and resumes.
    needs: modules of extras.
    own: whether it is this program's, and so believed.
    source: where it is defined, if it is neither built in nor a package's.
    set_to: ("tolerance", 1e-9) or ("step", 1/50); None for what it does by itself.
    """

    name: str
    function: str | Callable[..., Any] = ""
    formats: tuple[str, ...] | None = ("double",)
    systems: tuple[str, ...] | None = _SYSTEMS
    control: str = "tolerance"
    ensemble: str = ""
    steps: str | Callable[..., Any] = ""
    attitude: bool = False
    streams: bool = False
    needs: tuple[str, ...] = ()
    own: bool = True
    source: IntegratorSource | None = None
    set_to: tuple[str, Fraction] | None = None

    @property
    def is_known(self) -> bool:
        """Whether its source or its name defines it."""
        return self.source is not None or bool(self.function) or self.name in known()

    @property
    def lacks(self) -> str:
        """The first module of an extra that is not installed; "" where all are."""
        return next((module for module in self.needs if find_spec(module) is None), "")

    @property
    def formats_text(self) -> str:
        """The formats in words; "" where these are few or not declared."""
        missing = [name for name in _EVERY if name not in (self.formats or ())]
        return "" if len(missing) > 1 else "every format" + (f" but {missing[0]}" if missing else "")

    def load(self) -> Peer:
        """The function that propagates, imported; raises InputError for an unknown one and for one that cannot be."""
        if self.source is not None:
            return self.source.load()
        if callable(self.function):
            return self.function
        if not (self.function or self.name in known()):
            _of_packages.cache_clear()  # it may have been installed since
            if self.name not in known():
                remedy = f"{meant(self.name, known())}`heavytop list` shows the integrators. {_YOURS}"
                raise InputError(f"Unknown integrator {quoted(self.name)}.", remedy)
        entry = self if self.function else known()[self.name]
        if entry.lacks:
            raise missing(extra_of(entry.lacks), f"The integrator {self.name}")
        try:
            with quiet():
                function = load(entry.function)
        except ImportError as error:
            cause = f"is not available: {said(error)}."
            raise InputError(f"The integrator {self.name} {cause}", entry.remedy) from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever another package's module does when it is imported
            reason = f"{type(error).__name__}: {said(error)}"
            raise InputError(f"The integrator {self.name} is broken: {reason}.", entry.remedy) from error
        if not callable(function):
            cause = f"is broken: {entry.function} is not callable."
            raise InputError(f"The integrator {self.name} {cause}", entry.remedy)
        return function  # type: ignore[no-any-return]

    @property
    def remedy(self) -> str:
        """Remedy where it cannot be imported."""
        return "" if self.own else f"It comes from {self.function}: repair or remove that package."

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

    @property
    def carries_attitude(self) -> bool:
        """Whether it declares that ξ rides along; not one that cannot be used."""
        if isinstance(self.source, Command):
            return bool(self.source.attitude)
        if self.own:
            return self.attitude
        try:
            peer: Any = ready(self)
        except (InputError, PeerFailed):
            return False
        return bool(peer.carries_attitude)

    @property
    def declared(self) -> Declared:
        """Its declaration; an empty one where it cannot be used."""
        if isinstance(self.source, Command):
            return self.source.declared
        try:
            return getattr(ready(self), "declared", None) or Declared()
        except (InputError, PeerFailed):
            return Declared()

    @property
    def one_step(self) -> bool:
        """Whether a step depends on the state where it begins alone: unless it declares that it has a memory."""
        return self.own or self.declared.one_step

    def propagate(
        self,
        top: HeavyTop,
        start: State,
        times: Sequence[OrderedRing],
        precision: Precision,
        system: System,
        observer: Observer | None = None,
        *,
        xi: Sequence[Fraction] | None = None,
        again: bool = True,
        **resume: Any,
    ) -> Trajectory:
        """The motion of an exact top and start; every state goes to ``observer``, where there is one.

        xi: of an integrator that :attr:`carries_attitude`.  again: whether a quick call of an integrator of another
        package is made twice, to see whether it is the same.  resume: place and mark as in
        :func:`heavytop.integrate.heyoka.motions.propagate`, of no use to an integrator that knows no places.

        Raises PeerFailed for whatever a third-party integrator does wrong.
        """
        if self.streams and self.set_to:
            raise Unsupported(f"{self.name} does not support a {self.set_to[0]}.", "Choose an integrator that does.")
        if self.streams:
            call = propagator(self, {})
            run: Trajectory = call(top, start, times, precision, system=system, xi=xi, observer=observer, **resume)
            return run
        try:
            peer = ready(self, self.set_to)
            beside = {} if xi is None else {"xi": xi}
            run = peer(top, start, times, precision, system=system, **beside)
            if again and not self.own and run.seconds["run"] < _AGAIN_SECONDS:
                require_equal(self.name, run, peer(top, start, times, precision, system=system, **beside))
        except Unsupported:
            raise
        except InputError as error:  # what a peer of this program cannot be asked for is one row's failure too
            raise PeerFailed(error.cause.removesuffix(".")) from None
        if observer is not None:
            for time, state in zip(run.times, run.states, strict=True):
                observer(time, state)
        return run

    def propagate_many(
        self,
        problems: Sequence[Problem],
        times: Sequence[OrderedRing],
        observer: EnsembleObserver | None = None,
        finished: Finished | None = None,
        threads: int | None = None,
        **options: Any,
    ) -> list[Trajectory]:
        """The motions of ``problems``, as :func:`heavytop.integrate.ensemble.propagate_ensemble`; one after the other
        where the integrator takes no more.  Raises PeerFailed for an option that it does not have: its row fails alone.
        """
        if self.ensemble:
            try:
                many = ensemble_propagator(self, options)
            except InputError as error:
                raise PeerFailed(error.cause.removesuffix(".")) from None
            runs: list[Trajectory] = many(problems, times, observer=observer, finished=finished, threads=threads)
            return runs
        if options.keys() == {"tolerance"}:
            controlled = replace(self, set_to=("tolerance", options["tolerance"]))
            return controlled.propagate_many(problems, times, observer, finished, threads)
        if options:
            raise PeerFailed(f"The integrator {self.name} does not support {', '.join(options)}")
        runs = []
        for index, problem in enumerate(problems):
            watch = None if observer is None else partial(observer, index)
            first = index == 0
            arguments = *_given(problem), times, problem.precision, problem.system, watch
            runs.append(self.propagate(*arguments, xi=problem.xi, again=first))
            if finished is not None:
                finished(index, runs[-1])
        return runs


def _given(problem: Problem) -> tuple[HeavyTop, State]:
    """A top and a start that round to ``problem``; raises Unsupported for a gyrostat that is off its exact data."""
    if problem.system is not GYROSTAT:
        return problem.top, problem.start
    if problem.given is None or Problem.of(*problem.given, problem.precision, problem.system, problem.xi) != problem:
        cause = "Only heyoka and multiword integrate a gyrostat off its exact data."
        raise Unsupported(cause, "Measure drift or work_precision.")
    return problem.given


def foreign(name: str, function: str = "", source: IntegratorSource | None = None) -> Integrator:
    """An integrator of another package, or of a source, whose capabilities are unknown."""
    return Integrator(name, function, None, None, "", own=False, source=source)


def name_of(which: str | IntegratorSource) -> str:
    """The name in rows of an integrator that is named or defined by its source."""
    return which if isinstance(which, str) else which.name


def described(which: str | IntegratorSource, set_to: tuple[str, Fraction] | None = None) -> Integrator:
    """The record, without importing the integrator: of another package's or a file's it knows no capability."""
    if isinstance(which, str):
        record = INTEGRATORS.get(which) or foreign(which)
    else:
        record = which if isinstance(which, Integrator) else foreign(which.name, source=which)
        if isinstance(which, Command):
            record = replace(record, control=which.control)
    return record if set_to is None else replace(record, set_to=set_to)


def load(source: str | Callable[..., Any]) -> Any:
    """The object at ``module:name``, imported; a function itself."""
    return resolve_name(source) if isinstance(source, str) else source


loaded = lru_cache(maxsize=64)(load)  # for this program's own, looked up once


def _peer(name: str, module: str, *needs: str, **capabilities: Any) -> Integrator:
    return Integrator(name, f"{_HERE}.peers.{module}", needs=needs, attitude=True, **capabilities)


INTEGRATORS = {
    entry.name: entry
    for entry in (
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
        with readable(integrator, _YOURS):
            return PythonFile(str((base / python[1]).resolve()), python[2])
    assert toml is not None
    match, path, wanted = toml, base / toml[1], toml[2]
    commands = [command for command in commands_in(path) if wanted in (None, command.name)]
    if len(commands) != 1:
        known = ", ".join(command.name for command in commands_in(path))
        raise InputError(f"{integrator} is ambiguous: {path.name} defines {known}.", f"Give {match[1]}:NAME.")
    return commands[0]


def of_callable(call: Any) -> IntegratorSource:
    """A callable under the name that it gives itself, or of its file and function."""
    if isinstance(call, Command | PythonFile | PythonObject):
        return call
    if not callable(call):
        raise refusal("integrator", "callable", quoted(call), "Give a name, a file or a callable.")
    own = getattr(call, "integrator_name", None)
    file, function = place_of(call)
    plain = PythonFile(file, function).name if file else re.sub(r"[^\w.:+-]", "", function)[:64]
    return PythonObject(own if isinstance(own, str) and own else plain or "callable", call)


def commands_in(path: Path) -> list[Command]:
    """The programs that a TOML file describes; raises InputError for anything else in it."""
    try:
        with readable(path, "Give a readable TOML file.", RecursionError):
            document = tomllib.loads(path.read_text("utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path} is not valid: {error}.", _SHOWN) from None
    tables = document.get("integrator")
    if document.keys() - {"integrator"} or not isinstance(tables, list) or not tables:
        raise InputError(f"{path} must contain [[integrator]] tables only.", _SHOWN)
    commands = [command_of(table, path.parent, str(path)) for table in tables]
    if len({command.name for command in commands}) < len(commands):
        raise InputError(f"{path} gives two integrators the same name.", "Give each a different name.")
    return commands


def command_of(table: Any, folder: Path, where: str) -> Command:
    """The program of a table `[[integrator]]`; raises InputError for an impossible value, with ``where`` it stands."""
    try:
        if isinstance(table, dict) and "folder" in table:
            raise msgspec.ValidationError("Object contains unknown field `folder`")
        command = msgspec.structs.replace(msgspec.convert(table, Command), folder=str(folder.absolute()))
        _require_possible(command)
    except (msgspec.ValidationError, HeavyTopError) as error:
        cause = error.cause if isinstance(error, HeavyTopError) else f"{invalid(error, Command)}."
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
    seconds_of(command.timeout, "timeout")
    if command.order < 0:
        raise InputError(f"order must not be negative; got {command.order}.")
    if command.fixed_grid and command.control != "step":
        raise InputError('fixed_grid needs setting = "step".')
    _ = command.declared  # raises for impossible capabilities


def seconds_of(value: Any, what: str) -> float:
    """A time limit in seconds; raises InputError unless it is above 0."""
    seconds = physical(value, what)
    if not 0 < seconds <= _MOST_SECONDS:
        raise refusal(what, f"positive and at most {_MOST_SECONDS} seconds", quoted(value), "Give seconds, such as 60.")
    return float(seconds)


def known() -> dict[str, Integrator]:
    """Every integrator by name, not yet imported: its own, then those of other packages, which replace none."""
    return INTEGRATORS | _of_packages(tuple(sys.path)) | INTEGRATORS


@lru_cache(maxsize=4)
def _of_packages(path: tuple[str, ...]) -> dict[str, Integrator]:
    """Integrators of the packages on ``sys.path``, looked through once."""
    from importlib.metadata import entry_points  # and with it, email

    entries = entry_points(group=GROUP)
    return {entry.name: foreign(entry.name, entry.value) for entry in entries if entry.name not in FORMER}


def compiles(name: str) -> bool:
    """Whether an integrator of this program compiles its code in each process, which may take ten seconds."""
    entry = INTEGRATORS.get(name)
    return entry is not None and not entry.streams and name != "mpmath:odefun"


def is_third_party(name: str) -> bool:
    """Whether an integrator of that name is not one of this program's."""
    return name not in INTEGRATORS and name not in FORMER


def peer(which: str | IntegratorSource) -> Peer:
    """The peer, imported; raises InputError as :meth:`Integrator.load`."""
    return described(which).load()


def require(which: str | IntegratorSource) -> None:
    """Raises InputError for an unknown integrator, and for one of this program's that cannot be imported.

    One of another package is not imported: how that goes is for the rows to say.  A Python file has to be there.
    """
    integrator = described(which)
    if isinstance(integrator.source, PythonFile) and not Path(integrator.source.path).is_file():
        raise InputError(f"The file {integrator.source.path} does not exist.", "Give FILE.py:FUNCTION.")
    if not integrator.is_known or (integrator.own and isinstance(integrator.function, str)):
        integrator.load()


def ready(which: str | IntegratorSource, control: tuple[str, Fraction] | None = None) -> Peer:
    """The peer with ``control``, ("tolerance", 1e-9) or ("step", 1/50): nothing is looked up in its calls.

    Its calls raise PeerFailed for whatever others do wrong (:mod:`heavytop.integrate.peers.contract`).
    Raises InputError for an unknown integrator and for a control that one of this program's does not have; PeerFailed
    where another package's cannot be used.
    """
    integrator = described(which, control)
    name, own, control = integrator.name, integrator.own, integrator.set_to
    if isinstance(integrator.source, Command):
        return _program(integrator.source, control)
    try:
        chosen = integrator.load()
    except InputError as error:
        if own or not integrator.is_known:
            raise
        raise PeerFailed(error.cause.removesuffix(".")) from None
    declared = candidate if isinstance(candidate := getattr(chosen, "declared", None), Declared) else None
    options: dict[str, Any] = dict([control] if control else [])
    if control is not None or not own:
        with contained(name, " when its arguments were looked at"):
            arguments = _names.__wrapped__(chosen)
        for option in options:
            if arguments is not None and option not in arguments:
                raise no_option(name, option) if own else PeerFailed(f"{name} does not support {option}")
        if not own and "step_limit" in inspect.signature(chosen).parameters:
            options["step_limit"] = STEP_LIMIT
    return CheckedPlugin(name, chosen, own, declared, options)


def _program(command: Command, control: tuple[str, Fraction] | None) -> Peer:
    """The program with that control; one that says that it failed raises PeerFailed with what it said."""
    if control is not None and control[0] != command.control:
        raise PeerFailed(f"{command.name} does not support {control[0]}")
    integrate = partial(command.load(), **dict([control] if control else []))

    def call(*arguments: Any, **options: Any) -> Trajectory:
        run: Trajectory = integrate(*arguments, **options)
        if run.outcome is Outcome.FAILED:
            raise PeerFailed(f"{command.name} failed: {run.flags['failure']}", answered=True)
        return run

    return call


def control_name(which: str | IntegratorSource) -> str:
    """The control of a peer: "step", "tolerance", or "" for neither, as for one that cannot be used."""
    integrator = described(which)
    if integrator.control or isinstance(integrator.source, Command):
        return integrator.control
    for name in _CONTROLS:
        try:
            ready(integrator, (name, Fraction(1, 100)))
        except (InputError, PeerFailed):
            continue
        return name
    return ""


def control_apart(which: str | IntegratorSource) -> str:
    """:func:`control_name`; a third-party one is looked at in a process of its own, which it may end or hold."""
    integrator = described(which)
    if isinstance(integrator.source, Command) or integrator.own:
        return control_name(which)
    return _apart(control_name, which, ended="", late="")


def available() -> dict[str, str | None]:
    """For each peer: None if it can be used, else why not, and the remedy.

    One of this program's is not imported: the packages that it needs are looked for.  One of another package is, in a
    process of its own, which it may end or hold.
    """
    reasons: dict[str, str | None] = {}
    for name, entry in known().items():
        if entry.own:
            reasons[name] = _lacking(name) if entry.lacks else None
        else:
            ended = f"The integrator {name} ends the process that imports it. {entry.remedy}"
            late = f"The integrator {name} is not imported within {_PATIENCE} s. {entry.remedy}"
            reasons[name] = _apart(_lacking, name, ended=ended, late=late)
    return reasons


def _lacking(name: str) -> str | None:
    """Why a peer cannot be used, and the remedy."""
    try:
        peer(name)
    except InputError as error:
        return f"{error.cause} {error.remedy}"
    return None


def _apart(call: Callable[[Any], T], argument: Any, *, ended: str, late: str) -> T | str:
    """``call(argument)`` in a process of its own; ``ended`` where that dies, ``late`` where it takes too long."""
    from concurrent.futures.process import BrokenProcessPool

    from heavytop.processes import GuardedProcess

    process = GuardedProcess()
    try:
        return process.submit(call, argument).result(timeout=_PATIENCE)
    except BrokenProcessPool:
        return ended
    except TimeoutError:
        return late
    finally:
        process.end()


# Runs of so many steps that nobody waits for them are refused, whatever the units of the data.


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
    """True only where far fewer steps than the limit reach the end; in doubles."""
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
            f"A run to t = {six_digits(end)} takes about 1e{math.floor(log10(Fraction(steps)) or 0.0)} steps.",
            f"At most {MOST_STEPS:.0e} are supported: give an earlier time.",
        )


# Integrators by name or source, as callables with the requested options.
#
# An option that an integrator does not have is an error, so none has to accept options without a meaning for it.
# Capabilities: :class:`Integrator`.


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
            limits = options.get("step_limit"), options.get("step")
            require_reach(Problem.of(top, start, precision, system), end, *limits)
        return run(top, start, times, precision, system=system, **more)

    return call


def _unguarded(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    integrator = described(which)
    if isinstance(integrator.source, Command):
        return _with(integrator.source.integrate, integrator.name, options)
    if integrator.streams:
        return _with(loaded(integrator.function), integrator.name, options)
    _with(integrator.load(), integrator.name, options)
    return _with(ready(integrator), integrator.name, options)


def watched(
    which: str | IntegratorSource, options: dict[str, Any], observer: Callable[[Fraction, Any], None]
) -> Callable[..., Any]:
    """:func:`propagator`, with every state given to ``observer``: by a peer at the end of its run."""
    if described(which).streams:
        return propagator(which, {**options, "observer": observer})
    run = propagator(which, options)

    def call(*arguments: Any, **more: Any) -> Any:
        result = run(*arguments, **more)
        for time, state in zip(result.times, result.states, strict=True):
            observer(time, state)
        return result

    return call


def ensemble_propagator(which: str | IntegratorSource, options: dict[str, Any]) -> Callable[..., Any]:
    """A callable that propagates many motions; raises InputError also for an integrator that runs one at a time.

    Its calls raise OutOfReach as those of :func:`propagator`.
    """
    integrator = described(which)
    if not integrator.ensemble:
        require(integrator)
        raise InputError(f"The integrator {integrator.name} does not support ensembles.", "Propagate each motion.")
    _with(loaded(integrator.function), integrator.name, dict.fromkeys(options.keys() - {"threads"}))  # refuses unknown
    run = _with(loaded(integrator.ensemble), integrator.name, options)

    def call(problems: Sequence[Problem], times: Sequence[OrderedRing], **more: Any) -> Any:
        for problem in problems if len(times) else ():
            require_reach(problem, exact(times[-1]), options.get("step_limit"))
        return run(problems, times, **more)

    return call


@lru_cache(maxsize=64)
def _names(function: Callable[..., Any]) -> frozenset[str] | None:
    """The arguments that it takes by name; None where that is anything."""
    parameters = inspect.signature(function).parameters
    if any(parameter.kind is inspect.Parameter.VAR_KEYWORD for parameter in parameters.values()):
        return None
    return frozenset(parameters)


def no_option(which: str | IntegratorSource, option: str) -> InputError:
    """The error of an option that an integrator does not have: what sets its accuracy, or who has that option."""
    entry, name = described(which), name_of(which)
    if option in _CONTROLS and entry.control:
        remedy = f"Leave it out: {argument(entry.control)} sets the accuracy of {name}."
    else:
        streaming = [other.name for other in INTEGRATORS.values() if other.streams]
        remedy = f"Leave it out, or use {' or '.join(streaming) if option == 'step_limit' else 'another integrator'}."
    return InputError(f"The integrator {name} does not support {argument(option)}.", remedy)


def _with(function: Callable[..., Any], name: str, options: dict[str, Any]) -> Callable[..., Any]:
    """``function`` with these options; raises InputError for one that it does not have."""
    # other callables may have no hash
    names = (_names if isinstance(function, FunctionType) else _names.__wrapped__)(function)
    for option in options:
        if names is not None and option not in names:
            raise no_option(name, option)

    def call(*arguments: Any, **more: Any) -> Any:
        return function(*arguments, **more, **options)

    return call
