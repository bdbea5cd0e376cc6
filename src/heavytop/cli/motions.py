"""`propagate` and `reference`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heavytop.cli.app import Json, command, numbers, print_json, show_on_terminal, writing
from heavytop.cli.output import reaching, say, say_former, watched
from heavytop.errors import InputError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from heavytop.render.motion import MotionTable
    from heavytop.top.attitude import Output


# One motion on the terminal, as JSON, CSV or LaTeX: the same numbers, with what makes them citable.


_SCREEN = Path("-")
_LATEX = "--latex"


def with_file_of_latex(arguments: list[str]) -> list[str]:
    """The arguments of the command line, with ``-`` for standard output behind a ``--latex`` without a file."""
    found: list[str] = []
    for argument in arguments:
        if found[-1:] == [_LATEX] and argument.startswith("--"):
            found.append(str(_SCREEN))
        found.append(argument)
    return [*found, str(_SCREEN)] if found[-1:] == [_LATEX] else found


def made_by() -> tuple[str, str]:
    """The command as it was typed, and the version and commit of the program."""
    from heavytop.version import commit, version

    made_from = commit()
    return shlex.join(["heavytop", *sys.argv[1:]]), version() + (f" (commit {made_from})" if made_from else "")


def require_one_output(csv: Path | None, latex: Path | None, json: bool) -> None:
    """Raises InputError where standard output would get two documents, or one file two."""
    asked = (("--csv", csv == _SCREEN), (_LATEX, latex == _SCREEN), ("--json", json))
    on_screen = [name for name, wanted in asked if wanted]
    if len(on_screen) > 1:
        raise InputError(f"{' and '.join(on_screen)} both print on standard output.", "Give a file for one of them.")
    if csv is not None and csv == latex != _SCREEN:
        raise InputError(f"{csv} is asked for as CSV and as LaTeX.", "Give two files.")


def write_motion(
    document: Callable[[], dict[str, Any]],
    make_table: Callable[[], MotionTable],
    text: Callable[[MotionTable], RenderableType],
    csv: Path | None,
    latex: Path | None,
    json: bool,
) -> None:
    """Write the files asked for, and one document on standard output: JSON, CSV, LaTeX or the table.

    Raises InputError for a file that cannot be written.
    """
    table = None if json and csv is None and latex is None else make_table()
    screen = None
    for path, make in ((csv, "csv"), (latex, "latex")):
        if path is None or table is None:
            continue
        content = getattr(table, make)()
        if path == _SCREEN:
            screen = content
        else:
            _write_text(path, content)
            say(f"wrote {path}")
    if json:
        command, version = made_by()
        print_json({**document(), "command": command, "version": version})
    elif screen is not None:
        print(screen, end="")
    elif table is not None:
        show_on_terminal(text(table))


def _write_text(path: Path, content: str) -> None:
    with writing():
        try:
            path.write_text(content, encoding="utf-8")
        except (OSError, ValueError) as error:
            raise InputError(f"{path} cannot be written: {error}.") from None


# The options of `propagate` and `reference` for events.


Events = Annotated[
    list[str] | None,
    typer.Option("--events", help="Also the times, up to the last, at which omega1=0 or the like changes sign."),
]
EventDirection = Annotated[
    int, typer.Option("--event-direction", help="1: where it rises with time; -1: where it falls; 0: both.")
]


def requested(texts: Sequence[str] | None, direction: int) -> list[str]:
    """The functions asked for, read before anything is computed; raises InputError for what is none."""
    from heavytop.api.events import require_direction
    from heavytop.event_times.functions import event_function

    require_direction(direction)
    for text in texts or ():
        event_function(text)
    return list(texts or ())


def farthest(times: Sequence[str]) -> Fraction:
    """The time farthest from 0."""
    from heavytop.precision import exact

    return max(map(exact, times), key=abs)


def of_motion(
    functions: Sequence[str],
    direction: int,
    top: Any,
    start: Any,
    times: Sequence[str],
    system: str | None,
    reached: Callable[[Fraction], None],
    settings: dict[str, Any],
) -> list[Any]:
    """The events of each function up to the time farthest from 0; settings: of :func:`heavytop.api.events.events`."""
    if not functions:
        return []
    from heavytop.api.events import events

    until = farthest(times)
    return [
        events(top, start, until, function, direction, system=system, reached=reached, **settings)
        for function in functions
    ]


def with_events(
    document: Callable[[], dict[str, Any]], table: Any, text: Callable[[Any], Any], found: Sequence[Any]
) -> tuple[Callable[[], dict[str, Any]], Any, Callable[[Any], Any]]:
    """The document, the table and the text of a motion, with the events behind, where any were asked for."""
    if not found:
        return document, table, text

    def text_with_events(shown: Any) -> Any:
        from rich.console import Group

        from heavytop.render.motion import events_text

        return Group(text(shown), events_text(found))

    def document_with_events() -> dict[str, Any]:
        return {**document(), "events": [each.to_json() if hasattr(each, "to_json") else each for each in found]}

    return document_with_events, table, text_with_events


Inertia = Annotated[
    str | None,
    typer.Option(help="Principal moments A,B,C at the fixed point; with --mass 3, 6 (11,22,33,12,13,23) or 9 numbers."),
]
Weight = Annotated[str | None, typer.Option(help="Weight P.")]
Mass = Annotated[str | None, typer.Option(help="In place of --weight: the mass, of a body in any axes.")]
Gravity = Annotated[str | None, typer.Option(help="With --mass: the acceleration of gravity, such as 9.81, or 0.")]
About = Annotated[str | None, typer.Option(help="With --mass: what --inertia is about, 'pivot' or 'centre of mass'.")]
Centre = Annotated[str | None, typer.Option(help="Centre of mass a,b,c.")]
CaseName = Annotated[str | None, typer.Option("--case", help="A case of `heavytop list` in place of body and start.")]
Omega = Annotated[str | None, typer.Option(help="Angular velocity x,y,z at t = 0, in body axes.")]
OmegaSpace = Annotated[str | None, typer.Option(help="The same in space axes, with an attitude.")]
Gamma = Annotated[str | None, typer.Option(help="x,y,z at t = 0: unit vector pointing vertically up, in body axes.")]
Quaternion = Annotated[str | None, typer.Option(help="Attitude w,x,y,z at t = 0, body to space.")]
Euler = Annotated[str | None, typer.Option(help="Attitude as ZXZ:a,b,c or another sequence; radians, or 30deg.")]
AxisAngle = Annotated[str | None, typer.Option(help="Attitude as x,y,z:angle; radians, or 30deg.")]
Matrix = Annotated[str | None, typer.Option(help="Attitude R row by row, 9 numbers: v_space = R v_body.")]
Times = Annotated[str, typer.Option(help="Times t1,t2,..., of one sign, strictly away from 0.")]
Rotor = Annotated[str | None, typer.Option(help="Momentum k1,k2,k3 of a rotor: the system is heavy_gyrostat.")]
SystemName = Annotated[
    str | None,
    typer.Option(help="heavy_top, gyrostat or heavy_gyrostat; without it heavy_top, or heavy_gyrostat with --rotor."),
]
Show = Annotated[
    str | None,
    typer.Option(metavar="WHAT", help="Also quaternion, matrix, euler:ZXZ (any sequence), position, omega-space."),
]
Point = Annotated[str | None, typer.Option(help="Point x,y,z of the body, in place of the centre of mass.")]
Pivot = Annotated[str | None, typer.Option(help="Place x,y,z of the fixed point in space, 0,0,0 without it.")]
Csv = Annotated[Path | None, typer.Option(metavar="FILE", help="Write the table as CSV, which `score` reads.")]
Latex = Annotated[
    Path | None, typer.Option(metavar="[FILE]", help="Write it as LaTeX (siunitx, booktabs); print it without FILE.")
]
Normalize = Annotated[bool, typer.Option("--normalize", help="Move gamma, quaternion or matrix to length 1 first.")]

_PROPAGATE_SECONDS, _REFERENCE_SECONDS = 1.0, 3.0
"""Expected of a run and of an enclosure, before anything is known of them."""
_SLOW_BITS = 2000
"""From here on a single step takes seconds, and about 20 times as long with twice the bits."""


@command
def propagate(
    times: Times,
    inertia: Inertia = None,
    weight: Weight = None,
    centre: Centre = None,
    omega: Omega = None,
    gamma: Gamma = None,
    case: CaseName = None,
    mass: Mass = None,
    gravity: Gravity = None,
    about: About = None,
    omega_space: OmegaSpace = None,
    quaternion: Quaternion = None,
    euler: Euler = None,
    matrix: Matrix = None,
    axis_angle: AxisAngle = None,
    precision: Annotated[
        str, typer.Option(help="double, extended, double-double (of multiword), quad, real:BITS.")
    ] = "double",
    integrator: Annotated[str, typer.Option(help="One of `heavytop list`, mine.toml or mine.py:solve.")] = "heyoka",
    rotor: Rotor = None,
    system: SystemName = None,
    attitude: Annotated[bool, typer.Option("--attitude", help="Carry the attitude; give Euler angles.")] = False,
    normalize: Normalize = False,
    tolerance: Annotated[str | None, typer.Option(help="Of the integrator; the eps of the format without it.")] = None,
    max_steps: Annotated[int | None, typer.Option(help="Stop after that many steps.")] = None,
    events: Events = None,
    event_direction: EventDirection = 0,
    show: Show = None,
    point: Point = None,
    pivot: Pivot = None,
    csv: Csv = None,
    latex: Latex = None,
    json: Json = False,
) -> int:
    """Integrate one motion and print its states.

    The motion is that of M' = M × Ω + P γ × r, γ' = γ × Ω with M = IΩ; γ points up: the energy is ½ Ω·M + P r·γ.
    Numbers are exact: 3, 0.25, 1e-3, -2/5.
    """
    from heavytop.api.motions import motion as computed_motion

    given = {
        "inertia": inertia,
        "weight": weight,
        "centre": centre,
        "mass": mass,
        "gravity": gravity,
        "about": about,
        "rotor": rotor,
        "omega": omega,
        "omega_space": omega_space,
        "gamma": gamma,
        "quaternion": quaternion,
        "euler": euler,
        "matrix": matrix,
        "axis_angle": axis_angle,
    }
    require_one_output(csv, latex, json)
    top, start, which = _motion(given, case, system, normalize)
    wanted, instants = _outputs(show, point, pivot), numbers(times)
    say_former([integrator])
    _warn_of_cost(precision, integrator)
    functions = requested(events, event_direction)
    with reaching("integration", _PROPAGATE_SECONDS) as reach:
        motion = computed_motion(
            top,
            start,
            instants,
            precision,
            integrator=integrator,
            system=which,
            angles=attitude,
            outputs=wanted,
            tolerance=tolerance,
            step_limit=max_steps,
            reached=_part_of(instants, reach),
        )

    def table() -> MotionTable:
        from heavytop.render.motion import of_motion as table_of

        return table_of(motion, *made_by()).of_case(case)

    def text(shown: MotionTable) -> RenderableType:
        from heavytop.render.motion import motion_text

        return motion_text(motion, shown)

    with reaching("events", _PROPAGATE_SECONDS) as reach:
        settings = {"precision": precision, "integrator": integrator, "tolerance": tolerance, "step_limit": max_steps}
        found = of_motion(functions, event_direction, top, start, instants, which, _part_of(instants, reach), settings)
    write_motion(*with_events(motion.to_json, table, text, found), csv, latex, json)
    return 0 if motion.complete else 3


@command
def reference(
    times: Times,
    inertia: Inertia = None,
    weight: Weight = None,
    centre: Centre = None,
    omega: Omega = None,
    gamma: Gamma = None,
    case: CaseName = None,
    mass: Mass = None,
    gravity: Gravity = None,
    about: About = None,
    omega_space: OmegaSpace = None,
    quaternion: Quaternion = None,
    euler: Euler = None,
    matrix: Matrix = None,
    axis_angle: AxisAngle = None,
    digits: Annotated[int, typer.Option(help="Proven digits, 1 to 20000.")] = 50,
    rotor: Rotor = None,
    system: SystemName = None,
    attitude: Annotated[bool, typer.Option("--attitude", help="Give xi too, fixed in space and across gamma.")] = False,
    derivatives: Annotated[
        str | None, typer.Option(help="Derivatives too: start, data (I1..I3, n = P r) or all.", metavar="WHICH")
    ] = None,
    normalize: Normalize = False,
    events: Events = None,
    event_direction: EventDirection = 0,
    show: Show = None,
    point: Point = None,
    pivot: Pivot = None,
    csv: Csv = None,
    latex: Latex = None,
    json: Json = False,
) -> int:
    """Print proven states of one motion.

    By a closed form where there is one, at once; else by a validated enclosure: a second up to t = 100, a few seconds
    up to t = 1000; derivatives take about ten times as long.  The motion is that of M' = M × Ω + P γ × r, γ' = γ × Ω
    with M = IΩ; γ points up.
    """
    from heavytop.api.motions import known

    given = {
        "inertia": inertia,
        "weight": weight,
        "centre": centre,
        "mass": mass,
        "gravity": gravity,
        "about": about,
        "rotor": rotor,
        "omega": omega,
        "omega_space": omega_space,
        "gamma": gamma,
        "quaternion": quaternion,
        "euler": euler,
        "matrix": matrix,
        "axis_angle": axis_angle,
    }
    require_one_output(csv, latex, json)
    top, start, which = _motion(given, case, system, normalize)
    wanted, instants = _outputs(show, point, pivot), numbers(times)
    functions = requested(events, event_direction)
    watch, told = _Watch(instants), True if attitude or wanted else None
    with watched("reference", watch.fraction, _REFERENCE_SECONDS):
        found = known(top, start, instants, digits, which, told, derivatives, watch.find)
        found.require_outputs(wanted)

    def table() -> MotionTable:
        from heavytop.render.motion import of_reference

        return of_reference(found, wanted, *made_by()).of_case(case)

    def text(shown: MotionTable) -> RenderableType:
        from heavytop.render.motion import reference_text

        return reference_text(found, shown)

    with reaching("events", _REFERENCE_SECONDS) as reach:
        part, settings = _part_of(instants, reach), {"digits": digits}
        crossed = of_motion(functions, event_direction, top, start, instants, which, part, settings)
    write_motion(*with_events(lambda: found.document(wanted), table, text, crossed), csv, latex, json)
    return 0


def _outputs(show: str | None, point: str | None, pivot: str | None) -> tuple[Output, ...]:
    """The outputs asked for; raises InputError for one that is unknown, and for a point or pivot without a position."""
    from heavytop.top.attitude import outputs

    places = [None if each is None else numbers(each) for each in (point, pivot)]
    if show is None and places == [None, None]:
        return ()
    return outputs("" if show is None else show, *places)


def _warn_of_cost(precision: str, integrator: str) -> None:
    from heavytop.precision import parse

    form = parse(precision)
    if form.bits >= _SLOW_BITS and integrator == "heyoka":
        say(
            f"warning: in {form.name} a step sums a Taylor series of order {round(0.35 * form.bits)}: "
            f"seconds at real:{_SLOW_BITS}, 20 times as long with twice the bits; Ctrl-C waits for it.\n"
            "  `heavytop reference` proves as many digits, at once where there is a closed form."
        )


def _part_of(times: list[str], reach: Callable[[float], None]) -> Callable[[Fraction], None]:
    """What to call with the times reached on the way to the last of ``times``, for a bar that hears of parts."""

    def reached(time: Fraction) -> None:
        end = farthest(times)
        reach(float(time / end) if end else 1.0)

    return reached


class _Watch:
    """How far a reference has come: a closed form takes no time to speak of, an enclosure goes from 0 to each time."""

    def __init__(self, times: list[str]) -> None:
        self.times = times
        self.solution: Any = None

    def find(self, top: Any, start: Any, system: Any) -> Any:
        """The known motion, which is watched from now on."""
        from heavytop.exact.catalogue import find

        self.solution = find(top, start, system)
        return self.solution

    def fraction(self) -> float:
        """Part of the span that is enclosed."""
        reached = getattr(self.solution, "reached", None)
        last = abs(farthest(self.times))
        return float(reached() / last) if reached is not None and last else 0.0


def _motion(
    texts: dict[str, str | None],
    case: str | None,
    system: str | None,
    normalize: bool,
) -> Any:
    """The exact top or body, the start and the name of the system; what no rigid body has is a warning.

    texts: the options, by the keys of a plan.  case: in place of them.
    """
    if case is None:
        from heavytop.top.bodies import motion_of

        given = {key: _value(key, text) for key, text in texts.items()}
        top, start = motion_of(given, normalize)
    else:
        top, start, system = _of_case(case, system, [key for key, text in texts.items() if text is not None])
    for warning in top.warnings():
        say(f"warning: {warning}")
    return top, start, system


def _value(key: str, text: str | None) -> Any:
    whole = ("weight", "mass", "gravity", "about", "euler", "axis_angle")
    return text if text is None or key in whole else numbers(text)


def _of_case(name: str, system: str | None, others: list[str]) -> Any:
    """Body, start and system of a case; raises InputError where options say them too."""
    from heavytop.cases import case

    if others:
        raise InputError(f"--case {name} and --{others[0].replace('_', '-')} were given.", "Give one of them.")
    found = case(name)
    if system not in (None, found.system.name):
        raise InputError(f"The case {name} is of the system {found.system.name}, not {system}.", "Leave --system out.")
    return found.body or found.top, found.given_start or found.start, found.system.name
