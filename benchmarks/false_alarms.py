"""How often a comparison of true reruns alarms, and what it tells: `python benchmarks/false_alarms.py [RERUNS] [PLAN]`.

The plan is run with seed 0 and with as many other seeds, each of which measures the same motions, the starts of
an ensemble too, with other roundings (`benchmarks/few_starts.toml` is a plan of ensembles of 16 starts).  Each rerun is
compared with seed 0: anything but "same" is a false alarm.  Then every error of each rerun is made larger by a planted
factor: what part of the metrics is worse, and is the report worse every time?
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction
from multiprocessing import get_context

import msgspec

from heavytop.kinds import KINDS
from heavytop.measure.scalar import UNRESOLVED, of_fraction
from heavytop.precision import decimal_text, exact
from heavytop.records import SCHEMA, Report, Series
from heavytop.report.compare import compare
from heavytop.report.comparison_text import headline
from heavytop.report.names import row_name
from heavytop.report.policy import Policy
from heavytop.report.verdicts import Verdict
from heavytop.suite.checkpoint import Saved
from heavytop.suite.plan import Plan, expand, load, of_document

PLAN = {
    "name": "false-alarms",
    "measure": [
        {"kind": "audit", "claims": ["ershkov-partial"], "systems": ["gyrostat"]},
        {
            "kind": "homoclinic",
            "cases": ["ershkov-partial-2", "delone"],
            "precisions": ["double", "extended"],
            "directions": ["forward"],
        },
        {
            "kind": "drift",
            "cases": ["euler", "lagrange", "gyrostat"],
            "runs": [
                {"precision": "double", "horizon": "20", "samples": 100},
                {"precision": "extended", "horizon": "20", "samples": 50},
            ],
        },
        {
            "kind": "drift",
            "cases": ["kovalevskaya", "generic"],
            "runs": [
                {"precision": "double", "horizon": "1000", "samples": 200},
                {"precision": "extended", "horizon": "200", "samples": 100},
                {"precision": "quad", "horizon": "101", "samples": 50},
            ],
        },
    ],
}
_WORDS = ("nan", "missing", UNRESOLVED)
FACTORS = ("2", "5", "10", "30", "100", "1000")


def report(seed: int, plan: Plan) -> Report:
    return Report(
        SCHEMA, {"name": plan.name}, {}, [KINDS[task.key.kind].measure(task, Saved()) for task in expand(plan, seed)]
    )


def spoiled(good: Report, factor: str) -> Report:
    """Every error larger by ``factor``, its series too: else the report contradicts itself."""
    rows = []
    for row in good.rows:
        metrics = dict(row.metrics)
        for name, metric in metrics.items():
            if metric.kind == "error" and metric.log10 is not None:
                found = of_fraction(exact(metric.value) * exact(factor))
                metrics[name] = msgspec.structs.replace(found, band=metric.band)
        series = {name: _larger(each, exact(factor)) for name, each in row.series.items()}
        rows.append(msgspec.structs.replace(row, metrics=metrics, series=series))
    return Report(good.schema, good.plan, good.environment, rows)


def _larger(series: Series, factor: Fraction) -> Series:
    """The numbers of a series of errors, multiplied."""
    values = [value if value in _WORDS else decimal_text(exact(value) * factor, 6) for value in series.values]
    return msgspec.structs.replace(series, values=values)


def main(reruns: int, plan: Plan) -> int:
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        reports = list(pool.map(report, range(reruns + 1), [plan] * (reruns + 1)))
    baseline, others = reports[0], reports[1:]
    results = [compare(baseline, other, Policy(), KINDS) for other in others]
    alarms = [result for result in results if result.verdict != "same"]
    print(f"a report against itself: {compare(baseline, baseline, Policy(), KINDS).verdict}")
    metrics = len(results[0].findings)
    print(f"{len(others) - len(alarms)} of {len(others)} reruns with other seeds: same ({metrics} metrics each)")
    for result in alarms:
        print(" ", headline(result))
        for finding in result.changed:
            print("   ", row_name(finding.row), finding.metric, finding.baseline, finding.candidate, finding.reason)
    print("errors planted in the reruns, every one larger by a factor:")
    for factor in FACTORS:
        planted = [compare(baseline, spoiled(other, factor), Policy(), KINDS) for other in others]
        worse = sum(result.tally.get(Verdict.WORSE, 0) for result in planted)
        reported = sum(result.verdict == "worse" for result in planted)
        errors = sum(m.kind == "error" and m.log10 is not None for row in baseline.rows for m in row.metrics.values())
        print(f"  {factor:>5}: {reported} of {len(others)} reports worse, {worse / errors / len(others):.0%} of errors")
    return bool(alarms)


if __name__ == "__main__":
    chosen = load(sys.argv[2], KINDS)[0] if len(sys.argv) > 2 else of_document(PLAN, KINDS)
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 50, chosen))
