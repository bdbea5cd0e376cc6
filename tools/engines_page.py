"""The tables of engines and a picture for each body, from reports of `python -m validation.engines`.

Run: python tools/engines_page.py results/engines/* [--pictures FOLDER]
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.features.work_precision.curves import OURS, WorkPrecisionLine, panels
from heavytop.records import Row

BODIES = {
    "generic-body": "General body, T = 10 s",
    "middle-axis": "Free, about the axis of the middle moment, T = 10 s",
    "slow-lagrange": "Slow symmetric top, T = 10 s",
    "bruels-cardona-arnold": "Fast top of Brüls, Cardona and Arnold, T = 2 s",
}
DEFAULTS = {
    "mujoco": ("mujoco:Euler", "1/500"),
    "mjx": ("mjx:Euler", "1/500"),
    "drake": ("drake:RK3", "1/1000"),
    "exudyn": ("exudyn:generalized-alpha", "1/100"),
    "pybullet": ("pybullet", "1/240"),
    "dart": ("dart", "1/1000"),
}
"""Integrators and steps, or tolerances, that engines take where nobody chooses; of others a user does."""
SINGLE = "-single"
"""The end of the name of an integrator that computes in single precision."""


@dataclass(frozen=True)
class Curve:
    """An integrator of a version on a body: its line, its points from coarse to fine, heyoka and its long run."""

    report: str
    body: str
    name: str
    line: WorkPrecisionLine
    rows: list[Row]
    heyoka: WorkPrecisionLine | None
    long: Row | None

    @property
    def label(self) -> str:
        """Integrator and version."""
        return f"{self.name} {self.rows[-1].key.subject.version}".rstrip()

    @property
    def best(self) -> Row:
        """The point with most digits."""
        return max(self.rows, key=digits)

    def order(self) -> str:
        """The order that runs show; a dash where no digit is right."""
        return "-" if self.line.order is None or not digits(self.rows[-1]) else f"{self.line.order:z.1f}"

    def seconds(self, wanted: float) -> str:
        """Seconds to so many digits, in those of heyoka."""
        own, ours = self.line.seconds_at(-wanted), self.heyoka and self.heyoka.seconds_at(-wanted)
        return "-" if own is None or ours is None else f"{own / ours:.{0 if own > 10 * ours else 1}f}"

    def drift(self) -> str:
        """How far the energy is off in the long run, and with which power of t that grew over the last decade."""
        if self.long is None or self.long.outcome != "success":
            return "-"
        series = self.long.series["drift_energy"]
        sizes = [(float(t), abs(float(value))) for t, value in zip(series.times, series.values, strict=True)]
        end = sizes[-1][0]
        last, before = (max(size for t, size in sizes if t <= part * end) for part in (1.0, 0.1))
        return f"{last:.0e}, t^{math.log10(last / before):z.1f}" if before else f"{last:.0e}"

    def joint(self) -> str:
        """How far the pivot moved at most over the points."""
        moved = [float(row.metrics["joint_violation_max"]) for row in self.rows if "joint_violation_max" in row.metrics]
        return "-" if not moved else f"{max(moved):.0e}" if max(moved) else "0"


def digits(row: Row) -> float:
    """Digits right at the worst sample."""
    return max(0.0, -(row.metrics["solution_error_relative_max"].log10 or 0.0))


def at_end(row: Row) -> float:
    """Digits right at T."""
    return max(0.0, -(row.metrics["error_final"].log10 or 0.0))


def control(row: Row) -> str:
    """The step, or the tolerance."""
    subject = row.key.subject
    return subject.step or f"{float(ht.precision.exact(subject.tolerance)):.0e}"


def curves(paths: Sequence[Path]) -> list[Curve]:
    """All of the reports, by body and name."""
    found = [curve for path in paths for curve in _of_report(path.name, ht.read_report(path).rows)]
    return sorted(found, key=lambda curve: (list(BODIES).index(curve.body), curve.label))


def _of_report(report: str, rows: Sequence[Row]) -> Iterator[Curve]:
    long = {row.key.subject.name: row for row in rows if row.key.kind == "drift"}
    points = defaultdict(list)
    for row in rows:
        if row.key.kind != "drift" and row.outcome == "success":
            points[row.key.case, row.key.subject.name].append(row)
    for body in dict.fromkeys(case for case, _ in points):
        (lines,) = panels([row for (case, _), own in points.items() for row in own if case == body]).values()
        named = {line.integrator: line for line in lines}
        heyoka = named.pop(OURS, None)
        for name, line in named.items():
            yield Curve(report, body, name, line, points[body, name], heyoka, long.get(name))


def summary(found: Sequence[Curve]) -> Iterator[str]:
    """A line for each engine: as it comes, and the best of its points on the general body."""
    yield "| engine | as it comes | digits | best of what was tried | digits | made again by `--only` |"
    yield "|---|---|---|---|---|---|"
    for report in dict.fromkeys(curve.report for curve in found):
        own = [curve for curve in found if curve.report == report]
        body = own[0].body
        best = max((curve for curve in own if curve.body == body), key=lambda curve: digits(curve.best))
        name, setting = DEFAULTS.get(report.partition("-")[0], ("", ""))
        points = [row for curve in own if (curve.body, curve.name) == (body, name) for row in curve.rows]
        usual = [row for row in points if setting in (row.key.subject.step, row.key.subject.tolerance)]
        default = f"{name} at {control(usual[0])} | {digits(usual[0]):.1f}" if usual else "it has none | -"
        made = report.partition("-")[0]
        only = made if made == report else f"{made}={report}"
        top = f"{best.name} at {control(best.best)} | {digits(best.best):.1f}"
        yield f"| {report.replace('-', ' ')} | {default} | {top} | {only} |"


def table(found: Sequence[Curve], body: str) -> Iterator[str]:
    """The lines of a body."""
    heads = "order, claimed", "seen", "1/step or tolerance", "digits at each", "at T", "3 digits", "6 digits"
    yield f"| integrator | {' | '.join(heads)} | energy | joint | float32 |"
    yield f"|{'---|' * (len(heads) + 4)}"
    own = {curve.label: curve for curve in found if curve.body == body}
    for label, curve in own.items():
        if SINGLE in label:
            continue
        pairs = [(control(row).removeprefix("1/"), f"{digits(row):.1f}") for row in curve.rows]
        points = map(" ".join, zip(*pairs, strict=True))
        single = own.get(label.replace(curve.name, curve.name + SINGLE))
        cells = [label, str(curve.line.declared), curve.order(), *points, f"{at_end(curve.rows[-1]):.1f}"]
        cells += [curve.seconds(3), curve.seconds(6), curve.drift(), curve.joint()]
        yield f"| {' | '.join(cells)} | {f'{digits(single.best):.1f}' if single else '-'} |"


def draw(found: Sequence[Curve], body: str, out: Path) -> None:
    """Digits right against the step, a curve for each integrator."""
    figure = Figure(figsize=(7.2, 4.8))
    axes = figure.subplots()
    own = [curve for curve in found if curve.body == body and curve.rows[0].key.subject.step]
    for place, curve in enumerate(own):
        points = [(float(ht.precision.exact(row.key.subject.step)), digits(row)) for row in curve.rows]
        style = {"marker": "osD^v<>phXPd"[place % 12], "color": f"C{place % 10}", "label": curve.label}
        axes.semilogx(*zip(*points, strict=True), linestyle=("-", "--", ":")[place // 10], **style)
    axes.set_xlabel("step [s]")
    axes.set_ylabel("digits right at the worst of 20 samples")
    axes.invert_xaxis()
    axes.grid(visible=True, alpha=0.3)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2, fontsize=9, frameon=False)
    with mpl.rc_context({"svg.hashsalt": "engines"}):
        figure.savefig(out, metadata={"Date": None}, bbox_inches="tight")


def page(paths: Sequence[Path], pictures: Path | None = None) -> str:
    """The tables in Markdown; with the pictures, which are written to that folder."""
    found = curves(paths)
    parts = ["\n".join(summary(found))]
    for body in dict.fromkeys(curve.body for curve in found):
        parts += [f"### {BODIES[body]}", "\n".join(table(found, body))]
        if pictures is not None:
            draw(found, body, pictures / f"engines-{body}.svg")
            steepest = max((c for c in found if c.body == body), key=lambda c: digits(c.best))
            alt = f"Digits right against the step: {steepest.label} reaches {digits(steepest.best):.1f}."
            parts.append(f"![{alt}](_build/engines-{body}.svg)")
    return "\n\n".join(parts) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reports", nargs="+", type=Path)
    parser.add_argument("--pictures", type=Path)
    given = parser.parse_args()
    print(page(given.reports, given.pictures))


if __name__ == "__main__":
    main()
