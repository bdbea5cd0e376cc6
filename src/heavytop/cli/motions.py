"""`propagate` and `reference`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from heavytop.cli.app import Json, command, numbers, print_json, show_on_terminal
from heavytop.cli.output import say
from heavytop.cli.progress import reaching, watched
from heavytop.errors import InputError

Inertia = Annotated[str, typer.Option(help="Principal moments A,B,C at the fixed point.")]
Weight = Annotated[str, typer.Option(help="Weight P.")]
Centre = Annotated[str, typer.Option(help="Centre of mass a,b,c.")]
Omega = Annotated[str, typer.Option(help="Angular velocity x,y,z at t = 0.")]
Gamma = Annotated[str, typer.Option(help="x,y,z at t = 0: unit vector pointing vertically up, in body axes.")]
Times = Annotated[str, typer.Option(help="Times t1,t2,..., of one sign, strictly away from 0.")]
Rotor = Annotated[str | None, typer.Option(help="Momentum k1,k2,k3 of a rotor: the system is heavy_gyrostat.")]
SystemName = Annotated[
    str | None,
    typer.Option(help="heavy_top, gyrostat or heavy_gyrostat; without it heavy_top, or heavy_gyrostat with --rotor."),
]
Normalize = Annotated[bool, typer.Option("--normalize", help="Move gamma onto the unit sphere first.")]

_PROPAGATE_SECONDS, _REFERENCE_SECONDS = 1.0, 3.0
"""Expected of a run and of an enclosure, before anything is known of them."""
_SLOW_BITS = 2000
"""From here on a single step takes seconds, and about 20 times as long with twice the bits."""


@command
def propagate(
    inertia: Inertia,
    weight: Weight,
    centre: Centre,
    omega: Omega,
    gamma: Gamma,
    times: Times,
    precision: Annotated[
        str, typer.Option(help="double, extended, double-double (of words), quad, real:BITS.")
    ] = "double",
    integrator: Annotated[str, typer.Option(help="One of `heavytop list`, mine.toml or mine.py:solve.")] = "heyoka",
    rotor: Rotor = None,
    system: SystemName = None,
    attitude: Annotated[bool, typer.Option("--attitude", help="Carry the attitude; give Euler angles.")] = False,
    normalize: Normalize = False,
    max_steps: Annotated[int | None, typer.Option(help="Stop after that many steps.")] = None,
    json: Json = False,
) -> int:
    """Integrate one motion and print its states.

    The motion is that of M' = M × Ω + P γ × r, γ' = γ × Ω with M = IΩ; γ points up: the energy is ½ Ω·M + P r·γ.
    Numbers are exact: 3, 0.25, 1e-3, -2/5.
    """
    from heavytop import precision as formats
    from heavytop.top.equations import system_of
    from heavytop.top.times import check_times

    top, start = _motion(inertia, weight, centre, omega, gamma, normalize, rotor)
    form, which, instants = formats.parse(precision), system_of(system, top), check_times(numbers(times))
    if max_steps is not None and max_steps < 1:
        raise InputError(f"--max-steps {max_steps} allows no step.", "Give 1 or more.")
    which.parameters(top, start)
    if form.bits >= _SLOW_BITS and integrator == "heyoka":
        say(
            f"warning: in {form.name} a step sums a Taylor series of order {round(0.35 * form.bits)}: "
            f"seconds at real:{_SLOW_BITS}, 20 times as long with twice the bits; Ctrl-C waits for it.\n"
            "  `heavytop reference` proves as many digits, at once where there is a closed form."
        )

    from heavytop.integrate.peers.source import named
    from heavytop.measure.motion import compute

    end, which_one = instants[-1] or 1, named(integrator)
    with reaching("integration", _PROPAGATE_SECONDS) as reach:
        motion = compute(
            top, start, instants, form, which, attitude, max_steps, which_one, lambda time: reach(float(time / end))
        )
    if json:
        print_json(motion.to_json())
    else:
        from heavytop.report.motion_text import motion_text

        show_on_terminal(motion_text(motion))
    return 0 if motion.complete else 3


@command
def reference(
    inertia: Inertia,
    weight: Weight,
    centre: Centre,
    omega: Omega,
    gamma: Gamma,
    times: Times,
    digits: Annotated[int, typer.Option(help="Proven digits, 1 to 20000.")] = 50,
    rotor: Rotor = None,
    system: SystemName = None,
    attitude: Annotated[bool, typer.Option("--attitude", help="Give xi too, fixed in space and across gamma.")] = False,
    normalize: Normalize = False,
    json: Json = False,
) -> int:
    """Print proven states of one motion.

    By a closed form where there is one, at once; else by a validated enclosure: a second up to t = 100, a few seconds
    up to t = 1000.  The motion is that of M' = M × Ω + P γ × r, γ' = γ × Ω with M = IΩ; γ points up.
    """
    from heavytop.measure.reference import reference as proven
    from heavytop.top.equations import system_of
    from heavytop.top.times import check_times

    top, start = _motion(inertia, weight, centre, omega, gamma, normalize, rotor, of_any_size=True)
    which, instants = system_of(system, top), check_times(numbers(times))
    watch = _Watch([abs(time) for time in instants])
    with watched("reference", watch.fraction, _REFERENCE_SECONDS):
        found = proven(top, start, instants, digits, which, watch.find, attitude)
    if json:
        print_json(found)
    else:
        from heavytop.report.motion_text import reference_text

        show_on_terminal(reference_text(found))
    return 0


class _Watch:
    """How far a reference has come: a closed form takes no time to speak of, an enclosure goes from 0 to each time."""

    def __init__(self, spans: list[Any]) -> None:
        self.last = max(spans)
        self.solution: Any = None

    def find(self, top: Any, start: Any, system: Any) -> Any:
        """The known motion, which is watched from now on."""
        from heavytop.exact.catalogue import find

        self.solution = find(top, start, system)
        return self.solution

    def fraction(self) -> float:
        """Part of the span that is enclosed."""
        reached = getattr(self.solution, "reached", None)
        return float(reached() / self.last) if reached is not None and self.last else 0.0


def _motion(
    inertia: str,
    weight: str,
    centre: str,
    omega: str,
    gamma: str,
    normalize: bool,
    rotor: str | None,
    of_any_size: bool = False,
) -> Any:
    """The exact top and start of the options; what no rigid body has is a warning.

    of_any_size: for what computes with exact numbers alone, which no format bounds.
    """
    from heavytop.top.heavy_top import HeavyTop, State, require_physical

    top = HeavyTop(numbers(inertia), weight, numbers(centre), None if rotor is None else numbers(rotor))
    start = State(numbers(omega), numbers(gamma))
    if not of_any_size:
        require_physical(top, start)
    start = (start.normalized() if normalize else start).require_unit_gamma()
    for warning in top.warnings():
        say(f"warning: {warning}")
    return top, start
