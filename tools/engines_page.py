"""The table of engines, and their picture, from reports of `python -m validation.engines`.

Run: python tools/engines_page.py results/engines/* [--picture docs/engines.svg]
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt

import heavytop as ht
from heavytop.features.work_precision.curves import WorkPrecisionLine, panels
from heavytop.records import Row

BODY = "generic-body/T=10"
RELATIVE = "solution_error_relative_max"


def digits(row: Row) -> float:
    return max(0.0, -(row.metrics[RELATIVE].log10 or 0.0))


def seconds(line: WorkPrecisionLine, wanted: float) -> str:
    found = line.seconds_at(-wanted)
    return "-" if found is None else f"{found:.2g}"


def lines(paths: list[Path]) -> dict[tuple[str, str], tuple[WorkPrecisionLine, list[Row]]]:
    """By case, and by integrator with its version: the curve and the rows that reached the end, coarse to fine."""
    found = {}
    for path in paths:
        report = ht.read_report(path)
        rows = defaultdict(list)
        for row in report.rows:
            if row.outcome == "success":
                rows[row.case, row.key.subject.name].append(row)
        for case, curves in panels(report.rows).items():
            for line in curves:
                said = report.environment["integrators"][line.integrator].split()[-1]
                found[case, f"{line.integrator} {said}"] = (line, rows[case, line.integrator])
    return found


def table(found: dict[tuple[str, str], tuple[WorkPrecisionLine, list[Row]]], case: str) -> str:
    head = "| integrator | order, claimed | order, seen | digits at the step | s for 3 digits | 6 digits | joint |"
    cells = [head, "|---|---|---|---|---|---|---|"]
    for (body, name), (line, rows) in sorted(found.items()):
        if body != case or not rows:
            continue
        at = ", ".join(
            f"{digits(row):.1f} at {row.key.subject.step or row.key.subject.tolerance}" for row in rows[1::2]
        )
        order = "-" if line.order is None or not digits(rows[-1]) else f"{line.order:.1f}"
        joint = rows[-1].metrics.get("joint_violation_max")
        moved = "-" if joint is None else f"{float(joint):.0e}" if float(joint) else "0"
        cells.append(
            f"| {name} | {line.declared} | {order} | {at} | {seconds(line, 3)} | {seconds(line, 6)} | {moved} |"
        )
    return "\n".join(cells)


def draw(found: dict[tuple[str, str], tuple[WorkPrecisionLine, list[Row]]], out: Path) -> None:
    figure, axes = plt.subplots(figsize=(7.2, 5.6))
    curves = {name: rows for (case, name), (_, rows) in sorted(found.items()) if case == BODY}
    for place, (name, rows) in enumerate(curves.items()):
        points = [
            (float(ht.precision.exact(row.key.subject.step)), digits(row)) for row in rows if row.key.subject.step
        ]
        if points:
            marker = "osD^v<>ph*XPd"[place % 13]
            axes.semilogx(*zip(*points, strict=True), marker=marker, color=f"C{place % 10}", label=name)
    axes.set_xlabel("step [s]")
    axes.set_ylabel("digits right at the worst of 20 samples, T = 10 s")
    axes.invert_xaxis()
    axes.grid(visible=True, alpha=0.3)
    axes.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize=8)
    with mpl.rc_context({"svg.hashsalt": "engines"}):
        figure.savefig(out, metadata={"Date": None}, bbox_inches="tight")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reports", nargs="+", type=Path)
    parser.add_argument("--picture", type=Path)
    asked = parser.parse_args()
    found = lines(asked.reports)
    for case in dict.fromkeys(case for case, _ in found):
        print(f"\n{case}\n\n{table(found, case)}")
    if asked.picture is not None:
        draw(found, asked.picture)


if __name__ == "__main__":
    main()
