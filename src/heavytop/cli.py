"""The command line.  Only this module prints; each command is a few lines that join the rooms.

Exit codes: 0 good, 1 a finding, 2 usage or bad input, 3 incomplete, undecided or incomparable, 130 interrupted.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from heavytop.errors import HeavyTopError, InputError

app = typer.Typer(
    help="Measure how wrong computed and claimed motions of a heavy top are, against references that are proven.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Json = Annotated[bool, typer.Option("--json", help="One JSON document on standard output and nothing else there.")]


def run_command_line() -> int:
    """Run the command in sys.argv; returns or exits with its code.  Errors are printed as cause and remedy."""
    try:
        app()
    except HeavyTopError as error:
        print(f"heavytop: {error}", file=sys.stderr)
        return error.exit_code
    except BrokenPipeError:
        # whoever read our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def command(function: Callable[..., int]) -> Callable[..., None]:
    """A command of the program that ends with the exit code which ``function`` returns."""

    @wraps(function)
    def with_exit_code(*args: Any, **options: Any) -> None:
        raise typer.Exit(function(*args, **options))

    return app.command(name=function.__name__.rstrip("_"))(with_exit_code)


def _print(renderable: Any) -> None:
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=False, width=None if sys.stdout.isatty() else 160)
    console.print(renderable)


def _print_json(document: Any) -> None:
    import msgspec

    print(msgspec.json.format(msgspec.json.encode(document), indent=1).decode())


def _numbers(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


@command
def run(
    plan: Annotated[str, typer.Option(help="smoke, default, long, or a TOML file.")] = "default",
    out: Annotated[Path | None, typer.Option(help="New folder for the report.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the rows that --out already holds.")] = False,
    workers: Annotated[int | None, typer.Option(help="Local processes; as many as there are processors.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to run on instead.")] = None,
) -> int:
    """Run a plan of measurements and write DIR/report.json."""
    from heavytop.suite.plan import expand, load

    loaded, digest = load(plan)
    tasks = expand(loaded)
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers} cannot run anything.", "Give 1 or more.")
    if resume and out is None:
        raise InputError("--resume needs to know what to resume.", "Give the folder with --out.")
    directory = _fresh(out, loaded.name, resume)
    return _run(tasks, {"name": loaded.name, "sha256": digest}, directory, workers or os.cpu_count() or 1, scheduler)


def _run(tasks: Any, plan: dict[str, str], directory: Path, workers: int, scheduler: str | None) -> int:
    from heavytop.precision import available, parse

    missing = {t.precision for t in tasks if t.precision and available()[parse(t.precision).family]}
    if missing:
        raise InputError(
            f"The plan needs {', '.join(sorted(missing))}, which this platform lacks.", "`heavytop list` says why."
        )

    from heavytop.records import SCHEMA, Report
    from heavytop.report import store, text
    from heavytop.report.environment import environment
    from heavytop.suite.checkpoint import Checkpoint
    from heavytop.suite.run import run as run_tasks

    surroundings = environment()
    identity = {**plan, **surroundings["packages"]}
    identity |= {key: str(surroundings[key]) for key in ("commit", "processor", "simd_width_double")}
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with Checkpoint(directory, identity) as checkpoint, _progress(tasks) as advance:
            rows = run_tasks(tasks, checkpoint, advance, min(workers, len(tasks)), scheduler)
            report = Report(SCHEMA, plan, surroundings, rows)
            path = store.write(report, directory)
    except OSError as error:
        raise InputError(f"{directory} cannot be written: {error}.", "Choose a writable --out with space.") from None
    except KeyboardInterrupt:
        print(f"heavytop: interrupted; finished rows are kept: --out {directory} --resume goes on", file=sys.stderr)
        return 130
    _print(text.summary(report))
    print(f"\nReport: {path}")
    return 0 if all(row.outcome == "success" for row in rows) else 3


def _fresh(out: Path | None, plan: str, resume: bool) -> Path:
    """The folder to write to; raises InputError where it holds anything that this run did not put there."""
    from datetime import UTC, datetime

    from heavytop.suite.checkpoint import FILE

    if out is None:
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
        return Path("heavytop-results") / f"{plan}-{stamp}"
    if not out.exists():
        return out
    if not out.is_dir():
        raise InputError(f"{out} is a file.", "Give a new folder with --out.")
    content = {path.name for path in out.iterdir()} - {".lock"}
    if not content or (resume and FILE in content):
        return out
    remedy = "Give a new folder with --out." + (" Or go on with --resume." if FILE in content else "")
    raise InputError(f"{out} already holds {', '.join(sorted(content)[:5])}.", remedy)


class _progress:  # noqa: N801 - a context manager used like a function
    """A bar with ETA on a terminal, nothing elsewhere; called with each finished task."""

    def __init__(self, tasks: Any) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        console = Console(stderr=True)
        self.bar = Progress(*columns, console=console, disable=not console.is_terminal, transient=True)
        self.id = self.bar.add_task("starting", total=sum(task.cost for task in tasks))

    def __enter__(self) -> _progress:
        self.bar.start()
        return self

    def __call__(self, task: Any) -> None:
        self.bar.update(self.id, advance=task.cost, description=task.label[:48])

    def __exit__(self, *_: object) -> None:
        self.bar.stop()


@command
def propagate(
    inertia: Annotated[str, typer.Option(help="Principal moments A,B,C at the fixed point.")],
    weight: Annotated[str, typer.Option(help="Weight P.")],
    centre: Annotated[str, typer.Option(help="Centre of mass a,b,c.")],
    omega: Annotated[str, typer.Option(help="Angular velocity x,y,z at t = 0.")],
    gamma: Annotated[str, typer.Option(help="Unit vector of weight x,y,z at t = 0.")],
    times: Annotated[str, typer.Option(help="Times t1,t2,..., of one sign, strictly away from 0.")],
    precision: Annotated[str, typer.Option(help="double, extended, quad or real:BITS.")] = "double",
    system: Annotated[str, typer.Option(help="heavy_top or gyrostat.")] = "heavy_top",
    attitude: Annotated[bool, typer.Option("--attitude", help="Carry the attitude; give Euler angles.")] = False,
    normalize: Annotated[bool, typer.Option("--normalize", help="Move gamma onto the unit sphere first.")] = False,
    max_steps: Annotated[int | None, typer.Option(help="Stop after that many steps.")] = None,
    json: Json = False,
) -> int:
    """Integrate one motion and print its states.  Numbers are exact: 3, 0.25, 1e-3, -2/5."""
    from heavytop import precision as formats
    from heavytop.top.equations import system as system_named
    from heavytop.top.times import check_times

    top, start = _motion(inertia, weight, centre, omega, gamma, normalize)
    form, which, instants = formats.parse(precision), system_named(system), check_times(_numbers(times))
    if max_steps is not None and max_steps < 1:
        raise InputError(f"--max-steps {max_steps} allows no step.", "Give 1 or more.")
    which.parameters(top, start)

    from heavytop.measure.motion import compute

    motion = compute(top, start, instants, form, which, attitude, max_steps)
    if json:
        _print_json(motion.to_json())
    else:
        from heavytop.report.motion_text import motion_text

        _print(motion_text(motion))
    return 0 if motion.complete else 3


@command
def reference(
    inertia: Annotated[str, typer.Option(help="Principal moments A,B,C at the fixed point.")],
    weight: Annotated[str, typer.Option(help="Weight P.")],
    centre: Annotated[str, typer.Option(help="Centre of mass a,b,c.")],
    omega: Annotated[str, typer.Option(help="Angular velocity x,y,z at t = 0.")],
    gamma: Annotated[str, typer.Option(help="Unit vector of weight x,y,z at t = 0.")],
    times: Annotated[str, typer.Option(help="Times t1,t2,..., of one sign, strictly away from 0.")],
    digits: Annotated[int, typer.Option(help="Proven digits, 1 to 20000.")] = 50,
    system: Annotated[str, typer.Option(help="heavy_top or gyrostat.")] = "heavy_top",
    normalize: Annotated[bool, typer.Option("--normalize", help="Move gamma onto the unit sphere first.")] = False,
    json: Json = False,
) -> int:
    """Print proven states: a closed form where there is one, else a validated enclosure."""
    from heavytop.measure.reference import reference as proven
    from heavytop.top.equations import system as system_named
    from heavytop.top.times import check_times

    top, start = _motion(inertia, weight, centre, omega, gamma, normalize)
    found = proven(top, start, check_times(_numbers(times)), digits, system_named(system))
    if json:
        _print_json(found)
    else:
        from heavytop.report.motion_text import reference_text

        _print(reference_text(found))
    return 0


def _motion(inertia: str, weight: str, centre: str, omega: str, gamma: str, normalize: bool) -> Any:
    """The exact top and start of the options; what no rigid body has is a warning."""
    from heavytop.top.heavy_top import HeavyTop, State, require_physical

    top = HeavyTop(_numbers(inertia), weight, _numbers(centre))
    start = State(_numbers(omega), _numbers(gamma))
    require_physical(top, start)
    start = (start.normalized() if normalize else start).require_unit_gamma()
    for warning in top.warnings():
        print(f"heavytop: warning: {warning}", file=sys.stderr)
    return top, start


@command
def audit(
    claim: Annotated[str, typer.Argument(help="ershkov-general, ershkov-partial, or a TOML file.")],
    system: Annotated[str, typer.Option(help="heavy_top or gyrostat.")] = "heavy_top",
    branch: Annotated[str | None, typer.Option(help="smooth or printed: that branch alone.")] = None,
    json: Json = False,
) -> int:
    """Prove or refute a motion, equation by equation: exit 0 if all hold, 1 if one is refuted, 3 if undecided."""
    from heavytop.claims.audit import audit as audit_named
    from heavytop.claims.audit import only_branch

    report = audit_named(claim, system)
    if branch is not None:
        report = only_branch(report, branch)
    if json:
        _print_json(report.to_json())
    else:
        from heavytop.report.audit_text import audit_text

        _print(audit_text(report))
    return report.exit_code


@command
def figures(out: Annotated[Path, typer.Option(help="Folder for the pictures.")]) -> int:
    """Draw Figs 2-8 of the paper, and the same with the true motion beside the claim, as SVG and PNG."""
    from heavytop.report.figures import draw_figures

    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"{out} already holds other content.", "Give a new folder with --out.")
    try:
        files = draw_figures(out)
    except OSError as error:
        raise InputError(f"{out} cannot be written: {error}.", "Choose a writable --out with space.") from None
    for file in files:
        print(file)
    return 0


@command
def compare(
    baseline: Annotated[Path, typer.Argument(help="Report or its folder.")],
    candidate: Annotated[Path, typer.Argument(help="Report or its folder.")],
    floor: Annotated[str, typer.Option(help="Errors below FLOOR eps are all the same.")] = "4",
    loss: Annotated[str, typer.Option(help="Bits that an error may grow by.")] = "2",
    json: Json = False,
) -> int:
    """Compare two reports: exit 1 if anything is worse, 3 if anything is missing or incomparable, else 0."""
    from heavytop.precision import exact
    from heavytop.report import store, text
    from heavytop.report.compare import Policy
    from heavytop.report.compare import compare as compare_reports

    policy = Policy(floor=exact(floor), loss=exact(loss))
    result = compare_reports(store.read(baseline), store.read(candidate), policy)
    if json:
        rows = [finding.to_json() for finding in result.findings]
        environment = [{"name": n, "baseline": a, "candidate": b} for n, a, b in result.environment]
        _print_json({"verdict": result.verdict, "rows": rows, "environment": environment})
    else:
        _print(text.comparison(result))
    return result.exit_code


@command
def show(report: Annotated[Path, typer.Argument(help="Report or its folder.")]) -> int:
    """Print the summary of a report."""
    from heavytop.report import store, text

    _print(text.summary(store.read(report)))
    return 0


@command
def list_() -> int:
    """List the cases, plans, systems and number formats that are there."""
    from heavytop.precision import available
    from heavytop.suite.cases import CASES
    from heavytop.suite.plan import BUILT_IN

    print("Cases")
    for case in CASES.values():
        print(f"  {case.name:20} {case.system.name:10} {case.about}")
    print(f"Plans\n  {', '.join(BUILT_IN)}, or a TOML file")
    print("Systems\n  heavy_top, gyrostat")
    print("Number formats")
    for name, reason in available().items():
        label = "real:BITS" if name == "real" else name
        note = {"real": "24 to 20000 bits", "double": "53 bits", "extended": "64 bits", "quad": "113 bits"}[name]
        print(f"  {label:10} {note if reason is None else f'not available: {reason}'}")
    return 0
