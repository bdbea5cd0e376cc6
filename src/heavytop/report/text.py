"""A report in words and tables, for people.  Works on records alone; returns what rich can print."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import Decimal
from fractions import Fraction

from msgspec import structs
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.errors import InputError
from heavytop.measure.digits import digits_kept, digits_text
from heavytop.measure.scalar import UNRESOLVED
from heavytop.precision import decimal_text, exact
from heavytop.records import FAILED, UNMEASURED, Law, Metric, Report, Row
from heavytop.report.printable import printable
from heavytop.report.store import AnyReport
from heavytop.report.work_precision import leads, panels


def short(value: str, digits: int = 3) -> str:
    """A metric's text with few digits; words stay as they are."""
    try:
        number = exact(value)
    except InputError:
        return value
    if number == 0:
        return "0"
    if Fraction(1, 1000) <= abs(number) < 10**5:
        return f"{float(number):.{digits + 2}g}"
    text = f"{Decimal(decimal_text(number, digits)):.{digits - 1}E}"
    mantissa, _, exponent = text.partition("E")
    if exact(text) == number:  # a time such as 10^6 has no more digits
        mantissa = mantissa.rstrip("0").removesuffix(".")
    return f"{mantissa}e{int(exponent)}"


def with_noise(metric: Metric | None, digits: int = 3) -> str:
    """The value of a metric and, where it was measured, the half-width of its rounding noise in decades."""
    if metric is None:
        return "-"
    return short(metric.value, digits) + (f" ± {metric.band:.2f}" if metric.band else "")


def largest_over(rows: Iterable[Row]) -> str:
    """``largest over N samples``, with the least and the most where rows have different numbers of them."""
    counts = sorted({row.samples for row in rows if row.samples})
    if not counts:
        return "largest over the samples"
    return f"largest over {counts[0]}{f' to {counts[-1]}' if len(counts) > 1 else ''} samples"


_DIGITS = "Digits kept: −log10 of the largest |error|/max(1, |true value|) of a component of Ω or γ."
_NOISE = "± is the rounding noise in decades: half the interval that holds 95 % of it."


def summary(report: Report) -> RenderableType:
    """What is known, what the claim gets wrong and from when on, digits kept and drift per format."""
    by_measure: dict[str, list[Row]] = {}
    for row in report.rows:
        if row.outcome not in UNMEASURED:
            by_measure.setdefault(row.measure, []).append(row)
    parts: list[RenderableType] = [head(report, len(report.rows))]
    sections = {
        "audit": _audit,
        "claim_model": _claim_model,
        "claim_evaluation": _claim_evaluation,
        "homoclinic": _homoclinic,
        "break_away_law": _laws,
        "local_error": _local_error,
        "drift": _drift,
        "score": _scored,
        "work_precision": _work_precision,
        "growth": _growth,
    }
    for name, section in sections.items():
        if name in by_measure:
            parts += [Text(), *section(by_measure[name])]
    for name in (name for name in by_measure if name not in sections):
        said = f"Measure {name or 'without a name'}: {len(by_measure[name])} rows, which the page lists (--html FILE)"
        parts += [Text(), Text(printable(said))]
    if failures := [row for row in report.rows if failed(row)]:
        parts += [Text(), Text("Runs that did not reach their horizon", style="bold red")]
        parts += [Text(printable(_failure(row))) for row in failures]
    return Group(*parts)


def failed(row: Row) -> bool:
    """Whether a run did not reach its horizon; that a peer gives up is what work-precision rows are there to show."""
    return row.outcome in UNMEASURED or (row.outcome != "success" and row.measure != "work_precision")


def _failure(row: Row) -> str:
    if row.outcome == FAILED:
        return f"  {row.against.removeprefix('nothing: ')} in {row.precision}"
    if row.outcome in UNMEASURED:
        return f"  {row.measure} of {row.case}, {row.integrator} in {row.precision}: {row.outcome}, {row.against}"
    return f"  {row.case} in {row.precision}: {row.outcome} at t = {row.time_reached} of {row.horizon}"


def head(report: AnyReport, rows: int) -> Text:
    """The plan, how many measurements, and with which versions."""
    packages = report.environment.get("packages", {})
    versions = ", ".join(f"{n} {packages[n]}" for n in ("heavytop", "heyoka", "numpy", "python-flint") if n in packages)
    return Text(printable(f"Plan {report.plan.get('name', '?')}: {rows} measurements ({versions})"))


def title(text: str) -> Text:
    """The first line of a section."""
    return Text(text, style="bold")


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """A table without lines; its first column is words, the others are numbers."""
    made = Table(box=None, pad_edge=True, header_style="dim")
    for index, column in enumerate(columns):
        made.add_column(Text(printable(column)), justify="left" if index == 0 else "right", overflow="fold")
    for row in rows:
        made.add_row(*(Text(printable(cell)) for cell in row))
    return made


def _audit(rows: Sequence[Row]) -> list[RenderableType]:
    parts: list[RenderableType] = [title("Verdict on the paper's solution, equation by equation (heavytop audit)")]
    for row in rows:
        refuted = [name for name, metric in row.metrics.items() if metric.value == "0"]
        undecided = [name for name, metric in row.metrics.items() if metric.value == UNRESOLVED]
        verdict = "refuted" if refuted else "undecided" if undecided else "holds"
        smooth = " on the smooth branch" if row.system == "gyrostat" else ""
        held = len(row.metrics) - len(refuted) - len(undecided)
        line = Text(printable(f"  {row.case} as a motion of {row.system}: "))
        line.append(verdict, style={"refuted": "bold red", "holds": "bold green"}.get(verdict, "bold yellow"))
        line.append(f"{smooth} ({held} of {len(row.metrics)} equations proven, {len(refuted)} refuted")
        smooth_ones = sorted({name.split()[0] for name in refuted if " smooth " in name})
        line.append(f"; refuted on the smooth branch: {', '.join(smooth_ones)})" if smooth_ones else ")")
        parts.append(line)
    return parts


def _claim_model(rows: Sequence[Row]) -> list[RenderableType]:
    parts: list[RenderableType] = [
        title("Claim against truth: the paper's (4.2)-(4.6) as a motion of the heavy top, from its own data at t = 0"),
        Text("  Error of Ω, largest component; the same for γ. Exactly evaluated: no rounding is in these numbers."),
        Text("  Off 1 %: the first |t| at which the largest component of |ΔΩ| is 1 % of α, proven, not a sample."),
    ]
    times = [time for time in ("0.1", "1", "2", "5") if any(_at(row, "omega", time) for row in rows)]
    columns = [
        "case",
        "branch",
        *(f"Ω at |t|={t}" for t in times),
        *(f"γ at |t|={t}" for t in times[:2]),
        "Ω off 1 % of α at |t|",
    ]
    lines = [
        [
            row.case,
            row.integrator.partition(":")[2],
            *(short(_at(row, "omega", t) or "-") for t in times),
            *(short(_at(row, "gamma", t) or "-") for t in times[:2]),
            short(row.metrics["claim_parts_by_1_percent_at"].value),
        ]
        for row in rows
    ]
    parts.append(table(columns, both(lines)))
    parts += [Text(printable(f"  {case}: {against}"), style="dim") for case, against in dict(_truths(rows)).items()]
    return parts


def _truths(rows: Sequence[Row]) -> Iterable[tuple[str, str]]:
    for row in rows:
        yield row.case.partition("/")[0], f"truth is {row.against}"


def _at(row: Row, quantity: str, time: str) -> str | None:
    series = row.series.get(f"claim_model_error_{quantity}")
    if series is None:
        return None
    pairs = {abs(exact(t)): value for t, value in zip(series.times, series.values, strict=True)}
    return pairs.get(exact(time))


def _claim_evaluation(rows: Sequence[Row]) -> list[RenderableType]:
    lines = [
        [
            row.case,
            row.precision,
            row.integrator.partition(":")[2],
            *(short(row.metrics[f"claim_evaluation_error_{q}_max_finite"].value) for q in ("omega", "theta", "psi")),
            *(short(row.metrics[f"claim_evaluation_{q}_not_finite_from"].value) for q in ("psi", "omega")),
        ]
        for row in rows
    ]
    columns = ["case", "format", "form", "Ω error", "θ error", "ψ error", "ψ NaN/inf from |t|", "Ω from |t|"]
    return [
        title("Formulas in floating point: as printed, and in the stable form, each against itself exactly evaluated"),
        Text(f"  Errors are the {largest_over(rows)}."),
        table(columns, both(lines)),
    ]


def both(lines: Sequence[list[str]]) -> list[list[str]]:
    """Lines that are the same forward and backward as one; the direction then is not named."""
    found: dict[tuple[str, ...], list[str]] = {}
    for line in lines:
        case, _, direction = line[0].partition("/")
        found.setdefault((case, *line[1:]), []).append(direction)
    return [
        [case if len(directions) > 1 else f"{case}/{directions[0]}".rstrip("/"), *rest]
        for (case, *rest), directions in found.items()
    ]


def _homoclinic(rows: Sequence[Row]) -> list[RenderableType]:
    lines = []
    for row in rows:
        prefix = "integration_error" if "integration_error_omega_max" in row.metrics else "solution_error"
        error = with_noise(row.metrics.get(f"{prefix}_omega_max"))
        lines.append([row.case, row.precision, error, with_noise(row.metrics["break_away_time"]), row.outcome])
    return [
        title("Integrators on a homoclinic motion, against its closed form"),
        Text("  Ω error: the largest over the samples with rate·|t| <= 10; break-away: Ω wrong by 1e-3 α, where"),
        Text(f"  all significant digits are lost. {_NOISE}"),
        table(["case", "format", "Ω error", "break-away |t|", "outcome"], both(lines)),
    ]


def _laws(rows: Sequence[Row]) -> list[RenderableType]:
    lines = [
        [
            row.case,
            short(row.metrics["break_away_slope"].value),
            short(row.metrics["break_away_slope_expected"].value),
            f"{float(exact(row.metrics['break_away_slope_off_by'].value)):.1%}",
        ]
        for row in rows
    ]
    return [
        title("Break-away time gained per bit of the format"),
        table(["case", "measured", "ln 2 / rate", "off by"], both(lines)),
    ]


def _local_error(rows: Sequence[Row]) -> list[RenderableType]:
    names = ("local_error_ulp_max", "local_error_ulp_rms", "observed_order")
    lines = [
        [
            row.case,
            row.precision,
            str(row.steps),
            *(short(row.metrics[name].value) if name in row.metrics else "-" for name in names),
            "-" if row.order is None else str(row.order),
            row.outcome,
        ]
        for row in rows
    ]
    return [
        title("Single steps, each against the proven motion from where it starts"),
        Text("  Error in eps of the format times the largest component of the state; the order as the steps show it."),
        table(["case", "format", "steps", "largest", "rms", "order seen", "order asked", "outcome"], lines),
    ]


def _drift(rows: Sequence[Row]) -> list[RenderableType]:
    return [
        title("Long runs: distance from the true motion (along the flow, across it) and drift of the first integrals"),
        Text(f"  Both absolute, {largest_over(rows)}: an invariant that holds is no proof that the motion is right."),
        Text(f"  {_DIGITS}"),
        Text(f"  {_NOISE}"),
        _motions(rows),
    ]


def _scored(rows: Sequence[Row]) -> list[RenderableType]:
    return [
        title("Motions computed elsewhere: distance from the true motion, and drift of the first integrals"),
        Text(f"  Both absolute, {largest_over(rows)}."),
        Text(f"  {_DIGITS}"),
        _motions([structs.replace(row, case=f"{row.case} {row.integrator}") for row in rows]),
    ]


def _motions(rows: Sequence[Row]) -> Table:
    lines = []
    for row in rows:
        worst = [
            (name[6:-4], metric)
            for name, metric in row.metrics.items()
            if name.startswith("drift_") and name.endswith("_max")
        ]
        cells = "  ".join(f"{name} {with_noise(metric, 2)}" for name, metric in worst)
        error, across = (
            with_noise(row.metrics[f"solution_error_{name}_max"], 2)
            if f"solution_error_{name}_max" in row.metrics
            else "no reference"
            for name in ("along", "across")
        )
        kept = digits_kept(row)
        digits = "-" if kept is None else digits_text(kept)
        lines.append([row.case, row.precision, row.horizon, str(row.steps), row.outcome, digits, error, across, cells])
    columns = [
        "case",
        "format",
        "T",
        "steps",
        "outcome",
        "digits kept",
        "error along",
        "across",
        "drift of each integral",
    ]
    made = table(columns, lines)
    made.columns[-1].justify = "left"
    return made


def _work_precision(rows: Sequence[Row]) -> list[RenderableType]:
    parts: list[RenderableType] = [title("Work against precision: seconds that an error takes, whole horizon")]
    for case, lines in panels(rows).items():
        cells = []
        for line in lines:
            best = line.best
            found = ["-", "-"] if best is None else [f"{10**best.log10:.1e}", f"{best.seconds:.2g} s"]
            at = (line.seconds_at(log10) for log10 in (-6.0, -10.0, -14.0))
            found += ["-" if seconds is None else f"{seconds:.2g} s" for seconds in at]
            cells.append([line.label, *found, str(len(line.failures) or "")])
        columns = [case, "least error", "takes", "1e-6 takes", "1e-10 takes", "1e-14 takes", "gave up"]
        parts += [table(columns, cells), Text()]
    parts += [Text(printable(f"  {lead.text}"), style="bold") for lead in leads(rows)]
    return parts


def _growth(rows: Sequence[Row]) -> list[RenderableType]:
    lines = [
        [
            " ".join((row.case, *row.integrator.split()[1:])),
            row.precision,
            name.removeprefix("drift_").replace("solution_error_", "error "),
            f"{law.starts} of {row.starts}" if law.starts < row.starts else str(law.starts),
            law.growth,
            _exponent(law),
            short(law.detects or "-", 2),
            short(law.lost_at or "-", 2),
        ]
        for row in rows
        for name, law in row.laws.items()
    ]
    columns = [
        "case",
        "format",
        "quantity",
        "starts",
        "grows like",
        "exponent or rate [95 %]",
        "detects",
        "lost at |t|",
    ]
    chaotic = any(law.growth == "exponential" for row in rows for law in row.laws.values())
    return [
        title("Growth laws: root mean square over random starts, drift of the first integrals and distance from truth"),
        Text("  Detects: the smallest relative fault a step that these starts would have told from the healthy law."),
        *([Text("  Rate: the median over the starts of their finite-time rates.")] if chaotic else []),
        table(columns, lines),
    ]


def _exponent(law: Law) -> str:
    if law.exponent is None:
        return "-"
    return f"{law.exponent:.3f}" + ("" if law.low is None or law.high is None else f" [{law.low:.3f}, {law.high:.3f}]")
