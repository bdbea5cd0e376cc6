"""`propagate` and `reference`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import partial, reduce, wraps
from inspect import Parameter, Signature, signature
from itertools import combinations
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Protocol, TypeAlias, get_args, get_type_hints

import typer

from heavytop.cli.app import Json, command, numbers, print_json, require_apart, show_on_terminal, writing
from heavytop.cli.output import reaching, say, say_former, watched
from heavytop.errors import ExitCode, InputError, options_named
from heavytop.features import FEATURES
from heavytop.files import replace

if TYPE_CHECKING:
    from rich.console import RenderableType

    from heavytop.report.render.motion import MotionTable
    from heavytop.top.attitude import Output


# One motion on the terminal, as JSON, CSV or LaTeX: the same numbers, with the data for a citation.


_SCREEN = Path("-")
_SCREEN_WITHOUT_FILE = ("--latex", "--bibtex")


def with_file_of_latex(arguments: list[str]) -> list[str]:
    """The command-line arguments, with ``-`` for standard output after ``--latex`` and ``--bibtex`` without file."""
    files: list[str] = []
    for argument in (*arguments, "--"):
        if files and files[-1] in _SCREEN_WITHOUT_FILE and argument.startswith("--"):
            files.append(str(_SCREEN))
        files.append(argument)
    return files[:-1]


def made_by() -> tuple[str, str]:
    """The command line, and the version and commit of the program."""
    from heavytop.version import commit, version

    made_from = commit()
    return shlex.join(["heavytop", *sys.argv[1:]]), version() + (f" (commit {made_from})" if made_from else "")


def require_one_output(files: Mapping[str, Path | None], json: bool) -> None:
    """Raise InputError if standard output or a file would get two documents."""
    on_screen = [f"--{name}" for name, path in files.items() if path == _SCREEN] + ["--json"] * json
    if len(on_screen) > 1:
        raise InputError(f"{' and '.join(on_screen)} both print to standard output.", "Give a file for one of them.")
    for a, b in combinations([name for name, path in files.items() if path not in (None, _SCREEN)], 2):
        if files[a] == files[b]:
            raise InputError(f"{files[a]} is requested as {_AS[a]} and as {_AS[b]}.", "Give two files.")


_AS = {"csv": "CSV", "latex": "LaTeX", "bibtex": "BibTeX"}


def farthest(times: Sequence[str]) -> Fraction:
    """The time farthest from 0."""
    from heavytop.precision import exact

    return max(map(exact, times), key=abs)


_PROPAGATE_SECONDS, _REFERENCE_SECONDS = 1.0, 3.0
"""Initial estimates of the seconds of a run and of an enclosure."""
_SLOW_BITS = 2000
"""A step with so many bits takes seconds, and about 20 times as long with twice the bits."""


def _given(help: str, *name: str, kind: Any = str, **more: Any) -> Any:
    return Annotated[kind if kind is bool else kind | None, typer.Option(*name, help=help, **more)]


_TIMES = Annotated[str, typer.Option(help="Times t1,t2,...; of `propagate` increasing or decreasing from 0.")]
_DATA = {
    "inertia": _given("Principal moments A,B,C at the fixed point; with --mass 3, 6 (11,22,33,12,13,23) or 9 numbers."),
    "weight": _given("Weight P."),
    "centre": _given("Centre of mass a,b,c."),
    "omega": _given("Angular velocity x,y,z at t = 0, in body axes."),
    "gamma": _given("x,y,z at t = 0: unit vector pointing vertically up, in body axes."),
    "mass": _given("Mass, in place of --weight, of a body in any axes."),
    "gravity": _given("With --mass: the acceleration of gravity, such as 9.81, or 0."),
    "about": _given("With --mass: reference point of --inertia, 'pivot' or 'centre of mass'."),
    "omega_space": _given("Angular velocity at t = 0 in space axes; needs an attitude."),
    "quaternion": _given("Attitude w,x,y,z at t = 0, body to space."),
    "euler": _given("Attitude as ZXZ:a,b,c or another sequence; radians, or 30deg."),
    "matrix": _given("Attitude R row by row, 9 numbers: v_space = R v_body."),
    "axis_angle": _given("Attitude as x,y,z:angle; radians, or 30deg."),
    "rotor": _given("Momentum k1,k2,k3 of a rotor: the system is heavy_gyrostat."),
    "file": _given("Body in a URDF, MJCF, SDF, USD or TOML file.", "--file", metavar="FILE"),
    "link": _given("Link or body in --file, if it has several."),
}
"""Options of body and start by the keys of a plan."""
_WHICH = _DATA | {
    "case": _given("A case of `heavytop list` in place of body and start.", "--case"),
    "system": _given("heavy_top, gyrostat or heavy_gyrostat; default: heavy_top, or heavy_gyrostat with --rotor."),
    "normalize": _given("Normalize gamma, quaternion or matrix first.", "--normalize", kind=bool),
}
_WHERE = {
    "show": _given("Also quaternion, matrix, euler:ZXZ (any sequence), position, omega-space.", metavar="WHAT"),
    "point": _given("Body point x,y,z of --show position, in place of the centre of mass."),
    "pivot": _given("Position x,y,z of the fixed point in space; default: 0,0,0."),
    "csv": _given("Write the table as CSV, which `score` reads.", kind=Path, metavar="FILE"),
    "latex": _given("Write it as LaTeX (siunitx, booktabs); print it without FILE.", kind=Path, metavar="[FILE]"),
    "bibtex": _given("Write a citation as BibTeX; print it without FILE.", kind=Path, metavar="[FILE]"),
    "json": Json,
}
_SHARED = _WHICH | _WHERE
"""The options that `propagate` and `reference` share: motion and outputs."""


Measurement: TypeAlias = "tuple[Callable[[], dict[str, Any]], Callable[[], RenderableType]]"


class MotionOptions(Protocol):
    """Options of a further measurement of a motion by a feature; a NamedTuple of options of typer."""

    _fields: ClassVar[tuple[str, ...]]

    def require(self) -> str:
        """The name of the measurement for the progress bar; "" for none.  Raises InputError for invalid options."""

    def measure(self, top: Any, start: Any, until: Any, **settings: Any) -> Measurement:
        """A measurement: functions that return entries of the document of the motion, and the text printed after it."""


_FURTHER: list[Any] = [feature.load(feature.motion) for feature in FEATURES if feature.motion]


class _Request:
    """A request, parsed before anything is computed; raises InputError for invalid options."""

    def __init__(self, times: str, options: dict[str, Any], further: list[MotionOptions]) -> None:
        self.files = {name: options[name] for name in _AS}
        self.case, self.json = options["case"], options["json"]
        require_one_output(self.files, self.json)
        written = [path for path in self.files.values() if path != _SCREEN]
        require_apart(written, Path(options["file"]) if options["file"] else None)
        data = {name: options[name] for name in _DATA}
        self.top, self.start, self.system = _motion(data, self.case, options["system"], options["normalize"])
        self.outputs = _outputs(options["show"], options["point"], options["pivot"])
        self.times = numbers(times)
        self.further = [(option, what) for option in further if (what := option.require())]

    def beside(self, expected: float, **settings: Any) -> list[Measurement]:
        """The measurements of features on the motion, up to the time farthest from 0.

        expected: seconds.  settings: of :meth:`MotionOptions.measure`.
        """
        blocks = []
        for options, what in self.further:
            with reaching(what, expected) as reach:
                settings |= {"system": self.system, "reached": _fraction_of(self.times, reach)}
                blocks.append(options.measure(self.top, self.start, farthest(self.times), **settings))
        return blocks

    def write(
        self,
        document: Callable[[], dict[str, Any]],
        make_table: Callable[[], MotionTable],
        text: Callable[[MotionTable], RenderableType],
        beside: Sequence[Measurement],
    ) -> None:
        """Write the requested files, and one document on standard output: JSON, CSV, LaTeX or the table, followed by
        the further measurements.

        Raises InputError for a file that cannot be written.
        """
        on_screen = None
        only_json = self.json and not any(self.files.values())
        table = None if only_json else make_table().of_case(self.case)
        for make, path in self.files.items():
            if path is None or table is None:
                continue
            content = getattr(table, make)()
            if path == _SCREEN:
                on_screen = content
            else:
                with writing():
                    replace(path, content.encode())
                say(f"wrote {path}")
        if self.json:
            command, version = made_by()
            complete = reduce(or_, (entries() for entries, _ in beside), document())
            print_json({**complete, "command": command, "version": version})
        elif on_screen is not None:
            print(on_screen, end="")
        elif table is not None:
            for extra in (text(table), *(shown() for _, shown in beside)):
                show_on_terminal(extra)


def _of_a_motion(function: Callable[..., int]) -> Callable[..., int]:
    """The command with the times and the options of the motion before its own options, and those of outputs after them.

    Typer reads options only from the signature of a function, and neither TypedDict nor Unpack: without the signature
    made here, both commands would repeat the 25 shared options.
    """

    names = (*_SHARED, *signature(function).parameters)
    named = {name: f"--{name.replace('_', '-')}" for name in names} | {"step_limit": "--max-steps"}

    @wraps(function)
    @options_named(named)
    def with_options(times: str, **options: Any) -> int:
        shared = {name: options.pop(name) for name in _SHARED}
        further = [kind(**{name: options.pop(name) for name in kind._fields}) for kind in _FURTHER]
        return function(_Request(times, shared, further), **options)

    def parameter(name: str, hint: Any, default: Any = Parameter.empty) -> Parameter:
        return Parameter(name, Parameter.KEYWORD_ONLY, annotation=hint, default=default)

    def shared(options: dict[str, Any]) -> list[Parameter]:
        return [parameter(name, hint, False if get_args(hint)[0] is bool else None) for name, hint in options.items()]

    middle = []
    for source in (function, *_FURTHER):
        hints, parts = get_type_hints(source, include_extras=True), signature(source).parameters
        middle += [parameter(name, hints[name], part.default) for name, part in parts.items() if name != "request"]
    parameters = [parameter("times", _TIMES), *shared(_WHICH), *middle, *shared(_WHERE)]
    vars(with_options)["__signature__"] = Signature(parameters)
    return with_options


@command
@_of_a_motion
def propagate(
    request: _Request,
    precision: Annotated[
        str, typer.Option(help="double, extended, double-double (of multiword), quad, real:BITS.")
    ] = "double",
    integrator: Annotated[str, typer.Option(help="One of `heavytop list`, mine.toml or mine.py:solve.")] = "heyoka",
    attitude: Annotated[bool, typer.Option("--attitude", help="Propagate the attitude; print Euler angles.")] = False,
    tolerance: Annotated[
        str | None, typer.Option(help="Tolerance of the integrator; default: eps of the format.")
    ] = None,
    step: Annotated[
        str | None, typer.Option(help="Step size of fixed-step integrators (splitting:4); default: 1/100.")
    ] = None,
    max_steps: Annotated[int | None, typer.Option(help="Stop after that many steps.")] = None,
) -> int:
    """Integrate one motion and print its states.

    The motion is that of M' = M × Ω + P γ × r, γ' = γ × Ω with M = IΩ; γ points up: the energy is ½ Ω·M + P r·γ.
    Numbers are exact: 3, 0.25, 1e-3, -2/5.
    """
    from heavytop.api.motions import motion as computed_motion
    from heavytop.integrate.registry import compiles
    from heavytop.report.render.motion import motion_text, of_motion

    say_former([integrator])
    _warn_of_cost(precision, integrator)
    settings: dict[str, Any] = {"integrator": integrator, "tolerance": tolerance, "step_limit": max_steps}
    what = "compiling, at the first call, then integration" if compiles(integrator) else "integration"
    with reaching(what, _PROPAGATE_SECONDS) as reach:
        motion = computed_motion(
            request.top,
            request.start,
            request.times,
            precision,
            system=request.system,
            angles=attitude,
            outputs=request.outputs,
            reached=_fraction_of(request.times, reach),
            step=step,
            **settings,
        )

    beside = request.beside(_PROPAGATE_SECONDS, precision=precision, **settings)
    request.write(motion.to_json, lambda: of_motion(motion, *made_by()), partial(motion_text, motion), beside)
    return ExitCode.GOOD if motion.complete else ExitCode.INCOMPLETE


@command
@_of_a_motion
def reference(
    request: _Request,
    digits: Annotated[int, typer.Option(help="Proven digits, 1 to 20000.")] = 50,
    attitude: Annotated[bool, typer.Option("--attitude", help="Also xi, horizontal and fixed in space.")] = False,
    derivatives: Annotated[
        str | None, typer.Option(help="Also derivatives by start, data (I1..I3, n = P r) or all.", metavar="WHICH")
    ] = None,
    effort: Annotated[str, typer.Option(help="Largest estimated time of an enclosure.", metavar="SECONDS")] = "900",
) -> int:
    """Print proven states of one motion.

    By a closed form where there is one, at once; else by a validated enclosure: a second up to t = 100, a few seconds
    up to t = 1000; derivatives take about ten times as long.  The motion is that of M' = M × Ω + P γ × r, γ' = γ × Ω
    with M = IΩ; γ points up.
    """
    from heavytop.api.motions import reference as proven
    from heavytop.report.render.motion import of_reference, reference_text

    watch, with_attitude = _Progress(request.times), True if attitude or request.outputs else None
    with watched("reference", watch.fraction, _REFERENCE_SECONDS):
        options = {"system": request.system, "attitude": with_attitude, "derivatives": derivatives, "effort": effort}
        known = proven(request.top, request.start, request.times, digits, finder=watch.find, **options)
        known.require_outputs(request.outputs)

    beside = request.beside(_REFERENCE_SECONDS, digits=digits)
    document, text = partial(known.document, request.outputs), partial(reference_text, known)
    request.write(document, lambda: of_reference(known, request.outputs, *made_by()), text, beside)
    return ExitCode.GOOD


def _outputs(show: str | None, point: str | None, pivot: str | None) -> tuple[Output, ...]:
    """The requested outputs; raises InputError for an unknown one, and for a point or pivot without position."""
    from heavytop.top.attitude import outputs

    positions = [None if point_text is None else numbers(point_text) for point_text in (point, pivot)]
    if show is None and positions == [None, None]:
        return ()
    return outputs("" if show is None else show, *positions)


def _warn_of_cost(precision: str, integrator: str) -> None:
    from heavytop.precision import parse

    form = parse(precision)
    if form.bits >= _SLOW_BITS and integrator == "heyoka":
        say(
            f"warning: in {form.name} a step sums a Taylor series of order {round(0.35 * form.bits)}: "
            f"seconds at real:{_SLOW_BITS}, 20 times as long with twice the bits; Ctrl-C waits for it.\n"
            "  `heavytop reference` proves as many digits, at once where there is a closed form."
        )


def _fraction_of(times: list[str], reach: Callable[[float], None]) -> Callable[[Fraction], None]:
    """A function of the time reached, which reports its fraction of the last of ``times`` to a progress bar."""

    def reached(time: Fraction) -> None:
        end = farthest(times)
        reach(float(time / end) if end else 1.0)

    return reached


class _Progress:
    """The progress of a reference: negligible time for a closed form, an enclosure proceeds from 0 to each time."""

    def __init__(self, times: list[str]) -> None:
        self.times = times
        self.solution: Any = None

    def find(self, top: Any, start: Any, system: Any, effort: float) -> Any:
        """The known motion, whose progress is reported from now on."""
        from heavytop.exact.catalogue import find

        self.solution = find(top, start, system, effort)
        return self.solution

    def fraction(self) -> float:
        """The enclosed fraction of the time span."""
        reached = getattr(self.solution, "reached", None)
        last = abs(farthest(self.times))
        return float(reached() / last) if reached is not None and last else 0.0


def _motion(
    texts: dict[str, str | None],
    case: str | None,
    system: str | None,
    normalize: bool,
) -> Any:
    """The exact top or body, the start and the name of the system; warns of moments that no rigid body has.

    texts: the options by the keys of a plan.  case: replaces them.
    """
    if case is None:
        from heavytop.top.bodies import motion_of

        values = {key: _value(key, text) for key, text in texts.items()}
        top, start = motion_of(values, normalize)
    else:
        top, start, system = _of_case(case, system, [key for key, text in texts.items() if text is not None])
    for warning in top.warnings():
        say(f"warning: {warning}")
    return top, start, system


def _value(key: str, text: str | None) -> Any:
    undivided = ("weight", "mass", "gravity", "about", "euler", "axis_angle", "file", "link")
    return text if text is None or key in undivided else numbers(text)


def _of_case(name: str, system: str | None, data_options: list[str]) -> Any:
    """Body, start and system of a case; raises InputError if options give them too."""
    from heavytop.cases import case

    if data_options:
        raise InputError(f"--case {name} and --{data_options[0].replace('_', '-')} were given.", "Give one of them.")
    named = case(name)
    if system not in (None, named.system.name):
        raise InputError(f"The case {name} is of the system {named.system.name}, not {system}.", "Leave --system out.")
    return named.body or named.top, named.given_start or named.start, named.system.name
