"""How often a comparison of true reruns alarms, and what it detects: `validation/false_alarms.py [REPORTS] [PLAN]`.

The plan, `gate` unless another is named or a file is given, is run with as many seeds, each of which measures the same
motions, the starts of an ensemble too, with other roundings (`validation/few_starts.toml` is a plan of ensembles of 16
starts, `validation/many_kinds.toml` one of drift).  Rows are computed once, and each report is compared with each other
one: 23 reports are 506 pairs.  A pair that is worse, or has something missing or incomparable, is a false alarm.  Then
every error of each report is made larger by a planted factor and compared with the first: what part of the metrics is
worse, and is the report worse every time?  Exit code 1 where more than one pair in 200 is a false alarm.
"""

from __future__ import annotations

import sys
from collections import Counter
from fractions import Fraction
from itertools import permutations

import msgspec

from heavytop.features.kinds import KINDS
from heavytop.features.work_precision import kind as work_precision
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import Plan, expand, load
from heavytop.measure.scalar import UNRESOLVED, of_fraction
from heavytop.precision import decimal_text, exact
from heavytop.records import SCHEMA, Report, Series
from heavytop.report.compare.compare import compare
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.verdicts import Verdict
from heavytop.report.document.document import row_name

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


def main(count: int, plan: Plan) -> int:
    work_precision._USUAL = work_precision.Repeats(1, 1, 0.0)  # seconds are not compared
    reports = [report(seed, plan) for seed in range(count)]
    pairs, seen, reasons = list(permutations(reports, 2)), Counter(), Counter()
    for two in pairs:
        result = compare(*two, Policy(), KINDS)
        seen[result.verdict] += 1
        reasons.update((row_name(each.row), each.metric, each.verdict.value) for each in result.changed)
    alarms = seen["worse"] + seen["incomparable"]
    print(f"{plan.name}: {alarms} of {len(pairs)} pairs of reruns are false alarms; {dict(seen)}")
    for (name, metric, verdict), times in reasons.most_common(20):
        print(f"  {times} {verdict}: {name} {metric}")
    baseline, *others = reports
    print("errors planted in the reruns, every one larger by a factor:")
    errors = sum(m.kind == "error" and m.log10 is not None for row in baseline.rows for m in row.metrics.values())
    for factor in FACTORS:
        planted = [compare(baseline, spoiled(other, factor), Policy(), KINDS) for other in others]
        worse = sum(each.verdict is Verdict.WORSE and not each.of for result in planted for each in result.changed)
        reported = sum(result.verdict == "worse" for result in planted)
        print(f"  {factor:>5}: {reported} of {len(others)} reports worse, {worse / errors / len(others):.0%} of errors")
    return int(200 * alarms > len(pairs))


if __name__ == "__main__":
    name = sys.argv[2] if len(sys.argv) > 2 else "gate"
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 23, load(name, KINDS)[0]))
