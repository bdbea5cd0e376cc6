"""Whether one method, compiled and written in several ways, alarms: `validation/recompiled_integrators.py [PLAN ...]`.

Three Runge-Kutta methods in C, the classical one with a fixed step, the pairs of Dormand and Prince of orders 5 and 8
with a tolerance, are compiled without and with optimisation, with and without fused multiply-add, for the x87, with
-ffast-math, with the stages summed backwards, with powers by exp and log; the classical one is written in Python too,
with floats and with NumPy.  All of them are measured beside heyoka in the plans, and every report of a method is
compared with each other one: two that are not the same are a false alarm.  The plans are gate, smoke, selftest, peers
and validation/many_kinds.toml unless others are named; on motions beyond 1000 units of time the classical method alone
is run, and Python in work_precision up to 20 alone.  `cc` and SciPy are needed.

Of gate, selftest and smoke: no pair of the classical method is an alarm, that with -ffast-math included, and of no
method does an error differ beyond rounding in the same steps, so that the tenth that truncation may grow by decides
nothing. What alarms are single roundings in drift, of the methods with a tolerance at their finest, 1e-15: 15 reruns
in one arithmetic do not tell the mean error of fused multiply-add, of -ffast-math and of the x87.
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy
from scipy.integrate._ivp import dop853_coefficients as dop853

from heavytop.errors import Unsupported
from heavytop.features.kinds import KINDS
from heavytop.features.work_precision import kind as work_precision
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import read
from heavytop.harness.rows import Task
from heavytop.integrate.peers.double import Given, Solved, double_peer
from heavytop.integrate.peers.source import PythonObject
from heavytop.integrate.registry import IntegratorSource, commands_in
from heavytop.precision import exact
from heavytop.records import SCHEMA, Report, Row
from heavytop.report.compare.compare import compare
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.rows import RowPair
from heavytop.report.document.document import row_name
from heavytop.report.document.kind import kind_of

ROOT = Path(__file__).parent
PLANS = ("gate", "smoke", "selftest", "peers", str(ROOT / "many_kinds.toml"))
FLAGS = {
    "-O0": "-O0 -ffp-contract=off",
    "-O2": "-O2 -ffp-contract=off",
    "-O3 fused": "-O3 -march=native -ffp-contract=fast",
    "-O3 x87": "-O3 -mfpmath=387",
    "-O3 -ffast-math": "-O3 -march=native -ffast-math",
    "backwards": "-O2 -ffp-contract=off -DBACKWARDS",
    "backwards fused": "-O3 -march=native -ffp-contract=fast -DBACKWARDS",
    "exp and log": "-O2 -ffp-contract=off -DEXPLOG",
}
"""How each method is compiled."""
APART = ("-O3 x87", "-O3 -ffast-math")
"""Another arithmetic: 64 bits between two stores, sums in any order.  Pairs with these are counted apart."""
RK4 = [[0] * 4, [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6], [0.0] * 4
DP5_A = [
    [],
    [1 / 5],
    [3 / 40, 9 / 40],
    [44 / 45, -56 / 15, 32 / 9],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
]
DP5 = (
    [row + [0.0] * (7 - len(row)) for row in DP5_A],
    [*DP5_A[6], 0.0],
    [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40],
)
DOP853 = dop853.A[:12, :12].tolist(), dop853.B.tolist(), dop853.E5[:12].tolist()
METHODS: dict[str, tuple[Any, int, str]] = {
    "rk4": (RK4, 4, "step"),
    "dp5": (DP5, 5, "tolerance"),
    "dop853": (DOP853, 8, "tolerance"),
}
SOURCE = r"""
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "tableau.h"
static double I[3], n[3];
static double power(double x, double p)
{
#ifdef EXPLOG
    return exp(p * log(x));
#else
    return pow(x, p);
#endif
}
static void field(const double y[6], double f[6])
{
    const double *w = y, *g = y + 3;
    f[0] = ((I[1] - I[2]) * w[1] * w[2] + g[1] * n[2] - g[2] * n[1]) / I[0];
    f[1] = ((I[2] - I[0]) * w[2] * w[0] + g[2] * n[0] - g[0] * n[2]) / I[1];
    f[2] = ((I[0] - I[1]) * w[0] * w[1] + g[0] * n[1] - g[1] * n[0]) / I[2];
    f[3] = g[1] * w[2] - g[2] * w[1];
    f[4] = g[2] * w[0] - g[0] * w[2];
    f[5] = g[0] * w[1] - g[1] * w[0];
}
static double sum(const double *c, double k[STAGES][6], int count, int i)
{
    double s = 0.0;
#ifdef BACKWARDS
    for (int j = count - 1; j >= 0; j--)
#else
    for (int j = 0; j < count; j++)
#endif
        s += c[j] * k[j][i];
    return s;
}
/* the step into z, the size of the error against the tolerance; 0 where the step is fixed */
static double step(const double y[6], double h, double tolerance, double z[6])
{
    double k[STAGES][6], size = 0.0;
    for (int s = 0; s < STAGES; s++) {
        double at[6];
        for (int i = 0; i < 6; i++)
            at[i] = y[i] + h * sum(A[s], k, s, i);
        field(at, k[s]);
    }
    for (int i = 0; i < 6; i++) {
        double scale;
        z[i] = y[i] + h * sum(B, k, STAGES, i);
        scale = tolerance * (1 + fmax(fabs(y[i]), fabs(z[i])));
        size = fmax(size, fabs(h * sum(E, k, STAGES, i)) / scale);
    }
    return size;
}
static void take(char *text, double *values, long count)
{
    for (long i = 0; i < count; i++)
        values[i] = strtod(text, &text);
}
int main(void)
{
    char *line = NULL, *rest;
    size_t room = 0;
    double y[6], setting = FIXED ? 0.01 : 1e-15, *times = NULL;
    long count = 0;
    while (getline(&line, &room, stdin) > 0) {
        const char *name = strtok_r(line, " \n", &rest);
        if (name == NULL)
            continue;
        if (!strcmp(name, "heavytop-integrator"))
            puts("ready mine 1.0");
        else if (!strcmp(name, "run"))
            setting = FIXED ? 0.01 : 1e-15;
        else if (!strcmp(name, "inertia"))
            take(rest, I, 3);
        else if (!strcmp(name, "moment"))
            take(rest, n, 3);
        else if (!strcmp(name, "state"))
            take(rest, y, 6);
        else if (!strcmp(name, "setting"))
            take(rest, &setting, 1);
        else if (!strcmp(name, "times")) {
            count = strtol(rest, &rest, 10);
            times = realloc(times, (count + 1) * sizeof *times);
            take(rest, times, count);
        } else if (!strcmp(name, "go")) {
            double t = 0.0, h = 0.01, z[6];
            long steps = 0, tried = 0;
            for (long i = 0; i < count; i++) {
                double end = times[i], sign = end < t ? -1.0 : 1.0;
                long parts = (long)ceil(fabs(end - t) / setting);
                if (FIXED)
                    for (long p = 0; p < parts; p++, steps++, tried++) {
                        step(y, (end - t) / parts, 1.0, z);
                        memcpy(y, z, sizeof z);
                    }
                while (!FIXED && t != end) {
                    int last = fabs(end - t) <= h;
                    double now = last ? end - t : sign * h, size = fmax(step(y, now, setting, z), 1e-10);
                    tried++;
                    if (size <= 1) {
                        memcpy(y, z, sizeof z);
                        t = last ? end : t + now;
                        steps++;
                    }
                    if (!last || size > 1)
                        h = fabs(now) * fmin(5, fmax(0.2, 0.9 * power(size, -1.0 / ORDER)));
                }
                t = end;
                printf("state %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", t, y[0], y[1], y[2], y[3], y[4], y[5]);
            }
            printf("done steps %ld evaluations %ld\n", steps, STAGES * tried);
        } else if (!strcmp(name, "quit"))
            break;
        fflush(stdout);
    }
    return 0;
}
"""


@dataclass
class Tally:
    """What came of the pairs of reports of one method.

    apart: alarms of pairs one of which has another arithmetic.  moved: of errors that truncation makes, by how much the
    two differ at most, and where.  other: rows of other steps.
    """

    pairs: int = 0
    alarms: int = 0
    apart: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    moved: tuple[float, str] = (0.0, "")
    truncated: int = 0
    rows: int = 0
    other: int = 0


def programs(method: str, root: Path) -> Iterator[tuple[str, IntegratorSource]]:
    """Each way to compile the method, and its program."""
    (a, b, e), order, setting = METHODS[method]
    entries = ["{" + ", ".join(f"{float(c)!r}" for c in row) + "}" for row in a]
    tableau = f"#define STAGES {len(b)}\n#define ORDER {order}.0\n#define FIXED {int(setting == 'step')}\n"
    tableau += f"static const double A[STAGES][STAGES] = {{{', '.join(entries)}}};\n"
    for name, row in (("B", b), ("E", e)):
        tableau += f"static const double {name}[STAGES] = {{{', '.join(f'{float(c)!r}' for c in row)}}};\n"
    for number, (variant, flags) in enumerate(FLAGS.items()):
        folder = root / f"{method}-{number}"
        folder.mkdir()
        (folder / "tableau.h").write_text(tableau)
        (folder / "mine.c").write_text(SOURCE)
        subprocess.run(["cc", *flags.split(), "-o", "mine", "mine.c", "-lm"], cwd=folder, check=True)
        table = f'[[integrator]]\nname = "{method}"\ncommand = ["./mine"]\nsetting = "{setting}"\norder = {order}\n'
        (folder / "mine.toml").write_text(table)
        yield variant, commands_in(folder / "mine.toml")[0]


def _python_rk4(given: Given, combine: Callable[..., Any]) -> Solved:
    """The classical method; ``combine`` makes y + Σ c k."""
    y, t, steps, states = list(map(float, given.start)), 0.0, 0, []
    for end in given.times:
        count = math.ceil(abs(end - t) / given.control)
        h = (end - t) / count if count else 0.0
        for _ in range(count):
            k1 = _field(given, y)
            k2 = _field(given, combine(y, (h / 2, k1)))
            k3 = _field(given, combine(y, (h / 2, k2)))
            k4 = _field(given, combine(y, (h, k3)))
            y = combine(y, (h / 6, k1), (h / 3, k2), (h / 3, k3), (h / 6, k4))
        t, steps = end, steps + count
        states.append(numpy.array(y))
    return Solved(states, given.times[-1], steps, 4 * steps)


def _field(given: Given, y: Any) -> list[float]:
    return [float(value) for value in given.system.field(given.parameters, list(y))]


def _floats(y: Any, *parts: tuple[float, Any]) -> list[float]:
    return [math.fsum([value, *(c * k[i] for c, k in parts)]) for i, value in enumerate(y)]


def _arrays(y: Any, *parts: tuple[float, Any]) -> Any:
    return numpy.asarray(y) + numpy.dot([c for c, _ in parts], numpy.array([k for _, k in parts]))


def in_python() -> Iterator[tuple[str, IntegratorSource]]:
    """The classical method in Python."""
    for name, combine in (("Python", _floats), ("NumPy", _arrays)):
        peer = double_peer("rk4", 4, lambda given, c=combine: _python_rk4(given, c), "step")
        yield name, PythonObject("rk4", peer)


def measured(plan: str, method: str, variants: dict[str, IntegratorSource]) -> dict[str, list[Row]]:
    """The rows of each variant, motion by motion: all of them have one reference then."""
    tasks = {}
    for variant, source in variants.items():
        _, _, found = read(plan, KINDS, 0, source)
        tasks[variant] = [task for task in found if task.key.subject.name == method]
    rows: dict[str, list[Row]] = {variant: [] for variant in variants}
    for same in zip(*tasks.values(), strict=True):
        for variant, task in zip(variants, same, strict=True):
            if _is_quick(task, method, variant):
                with suppress(Unsupported):  # a gyrostat
                    rows[variant].append(KINDS[task.key.kind].measure(task, Saved()))
    return rows


def _is_quick(task: Task, method: str, variant: str) -> bool:
    if task.key.precision != "double":
        return False
    horizon = abs(exact(task.key.horizon))
    if variant in ("Python", "NumPy"):
        return task.key.kind == "work_precision" and horizon <= 20
    return method == "rk4" or horizon <= 1000


def judged(rows: dict[str, list[Row]], tally: Tally) -> None:
    """Every pair of variants, both ways."""
    for first, second in combinations(rows, 2):
        keys = {row.identity for row in rows[first]} & {row.identity for row in rows[second]}
        if not keys:
            continue
        two = [Report(SCHEMA, {}, {}, [row for row in rows[v] if row.identity in keys]) for v in (first, second)]
        for old, new in (two, two[::-1]):
            result = compare(old, new, Policy(), KINDS)
            if first in APART or second in APART:
                tally.apart += result.verdict != "same"
                continue
            tally.pairs += 1
            tally.alarms += result.verdict != "same"
            tally.reasons.update(
                f"{row_name(f.row)} {f.metric} {f.verdict.value}: {f.reason}; {first} and {second}"
                for f in result.changed
            )
        for a, b in zip(two[0].rows, two[1].rows, strict=True):
            tally.rows += 1
            tally.other += (a.steps, a.evaluations) != (b.steps, b.evaluations)
            for name, metric in a.metrics.items():
                match = b.metrics.get(name)
                if match is None or metric.log10 is None or match.log10 is None:
                    continue
                if RowPair(a, b, kind_of(a, KINDS)).is_truncation(metric, match):
                    tally.truncated += 1
                    part = 10 ** abs(match.log10 - metric.log10) - 1
                    tally.moved = max(tally.moved, (part, f"{row_name(a.identity)} {name}; {first} and {second}"))


def main(plans: list[str]) -> int:
    warnings.simplefilter("ignore")
    work_precision._USUAL = work_precision.Repeats(1, 1, 0.0)  # seconds are not compared
    alarms = pairs = 0
    with tempfile.TemporaryDirectory() as folder:
        for method in METHODS:
            variants = dict(programs(method, Path(folder))) | (dict(in_python()) if method == "rk4" else {})
            for plan in plans:
                tally = Tally()
                judged(measured(plan, method, variants), tally)
                alarms, pairs = alarms + tally.alarms, pairs + tally.pairs
                print(
                    f"{Path(plan).stem}, {method}: {tally.alarms} of {tally.pairs} pairs are false alarms, "
                    f"{tally.apart} others of x87 and -ffast-math; "
                    f"{tally.other} of {tally.rows} rows have other steps; beyond rounding, in the same steps, "
                    f"{tally.truncated} errors differ, by {tally.moved[0]:.2g} at most {tally.moved[1]}",
                    flush=True,
                )
                for reason, times in tally.reasons.most_common(6):
                    print(f"  {times} {reason}", flush=True)
    return int(alarms > 0 or not pairs)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or list(PLANS)))
