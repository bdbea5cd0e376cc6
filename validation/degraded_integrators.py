"""Degradations and repairs of an integrator as a comparison sees them: `validation/degraded_integrators.py [SEED]`.

200 pairs of reports, a better one and a worse one: 140 are measured, of an integrator that has one of a dozen faults or
none, 60 are rows of `results/default` with edited errors and bands.  From the
better to the worse, no verdict may be same or better.  100 of them the other way round: no verdict, and no step of a
history, may be worse.  What makes some error larger, or is given a wide band, is no repair.  Exit code 1 where one
fails.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import numpy

from heavytop.harness.rows import data_of
from heavytop.integrate.peers.double import Given, Solved, double_peer
from heavytop.measure.scalar import RELATIVE, UNRESOLVED, of_fraction
from heavytop.precision import decimal_text, exact
from heavytop.records import SCHEMA, Metric, Report, Row, Series
from heavytop.report.compare.noise import Policy
from heavytop.report.compare.verdicts import Verdict

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from support.reports import compare, expand, history, measure, plan_of, store  # noqa: E402

NAME = "degraded:taylor"
CASES = ("euler", "kovalevskaya", "lagrange")
HORIZON = 10
SAMPLES = 40


@dataclass(frozen=True)
class Method:
    """What the integrator does.

    step: divides the spacing of the samples or not.  order, dense: of the series at the end of a step and inside it.
    single: orders from which on coefficients are rounded to single precision.  moment: relative error of I1.
    noise: relative, of every step, anew in every run.  bias: relative, of every step.  between: relative error inside a
    step, 0 at its ends.  tolerance: of an error estimate that makes the steps; 0 for fixed ones.
    """

    step: float = 0.125
    order: int = 18
    dense: int = 18
    single: int = 99
    moment: float = 0.0
    noise: float = 0.0
    bias: float = 0.0
    between: float = 0.0
    tolerance: float = 0.0


HEALTHY = Method()
WIDE = "a wide band"
_method = HEALTHY
_runs = Random()


def _quadratic(given: Given, moment: float) -> tuple[Any, Any]:
    """The field L y + B(y, y) of the problem, with its first moment of inertia off by ``moment``."""
    p = given.parameters
    p = p._replace(inertia=(p.inertia[0] * (1 + moment), *p.inertia[1:]))
    field = lambda y: numpy.array(given.system.field(p, y))  # noqa: E731
    one = numpy.eye(6)
    even = [(field(e) + field(-e)) / 2 for e in one]
    linear = numpy.array([(field(e) - field(-e)) / 2 for e in one]).T
    products = numpy.empty((6, 6, 6))
    for j in range(6):
        for k in range(6):
            both = (field(one[j] + one[k]) + field(-one[j] - one[k])) / 2
            products[:, j, k] = even[j] if j == k else (both - even[j] - even[k]) / 2
    return linear, products.reshape(36, 6)


def _series(method: Method, linear: Any, flat: Any, state: Any) -> Any:
    found, slopes = numpy.empty((method.order + 1, 6)), numpy.empty((6, method.order, 6))
    found[0] = state
    for n in range(method.order):
        slopes[:, n] = (flat @ found[n]).reshape(6, 6)
        value = (slopes[:, n::-1].reshape(6, -1) @ found[: n + 1].ravel() + linear @ found[n]) / (n + 1)
        found[n + 1] = value.astype(numpy.float32) if n + 1 >= method.single else value
    return found


def _solve(given: Given) -> Solved:
    method = _method
    linear, flat = _quadratic(given, method.moment)
    sign = 1.0 if given.times[-1] > 0 else -1.0
    state, index, states, count = given.start.copy(), 0, [], 0
    begins = 0.0
    while len(states) < len(given.times):
        series = _series(method, linear, flat, state)
        ends = method.step * (count + 1)
        if method.tolerance:
            last = max(numpy.abs(series[method.order]).max(), 1e-300)
            ends = begins + (method.tolerance / last) ** (1 / method.order)
        length = ends - begins
        while index < len(given.times) and abs(given.times[index]) <= ends:
            tau = abs(given.times[index]) - begins
            order = method.order if tau == length else min(method.dense, method.order)
            value = (sign * tau) ** numpy.arange(order + 1) @ series[: order + 1]
            inside = 4 * (tau / length) * (1 - tau / length)
            states.append(value * (1 + method.between * (inside if inside > 1e-9 else 0.0)))
            index += 1
        state = (sign * length) ** numpy.arange(method.order + 1) @ series
        state = state * (1 + method.bias) * (1 + method.noise * _runs.gauss(0, 1))
        begins, count = ends, count + 1
    return Solved(states, given.times[-1], round(abs(given.times[-1]) / HEALTHY.step))


taylor = double_peer(NAME, HEALTHY.order, _solve, "step")


@contextmanager
def installed(folder: Path) -> Iterator[None]:
    """The integrator as an entry point of another package, found for as long as this lasts."""
    info = folder / "degraded-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: degraded\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[heavytop.peers]\n{NAME} = {__name__}:taylor\n")
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))


@cache
def report_of(method: Method, case: str, samples: int = SAMPLES) -> Report:
    """The report of one row of drift."""
    global _method
    _method = method
    _runs.seed(repr((method, case)))
    runs = [{"precision": "double", "horizon": str(HORIZON), "samples": samples}]
    plan = plan_of({"name": "p", "measure": [{"kind": "drift", "cases": [case], "integrator": NAME, "runs": runs}]})
    (task,) = expand(plan)
    row = msgspec.structs.replace(measure(task), data=data_of(task.case))
    return Report(SCHEMA, {"name": "p"}, {}, [row])


def degraded(random: Random, method: Method = HEALTHY) -> tuple[str, Method]:
    """The name of a fault, and the method with it, drawn at random."""
    size = 10 ** random.uniform(-10, -3)
    name, change = random.choice(
        [
            ("lower order", {"order": random.randint(4, 9)}),
            ("lower order, off the nodes", {"order": random.randint(4, 9), "step": 0.13}),
            ("dense output of lower order", {"dense": random.randint(2, 7), "step": random.choice([0.13, 0.3, 0.47])}),
            ("looser tolerance", {"tolerance": size}),
            ("single precision", {"single": random.randint(0, 4)}),
            ("perturbed coefficient", {"moment": size}),
            ("larger step", {"step": random.uniform(1.5, 2.5)}),
            ("noise", {"noise": size}),
            ("bias", {"bias": size}),
            ("errors between nodes", {"between": size, "step": random.choice([0.13, 0.3, 0.47])}),
            ("errors between nodes, a few samples off them", {"between": size, "step": 0.25 / 1.999}),
            ("two faults", {"noise": size, "dense": random.randint(2, 7), "step": 0.13}),
        ]
    )
    return name, replace(method, **change)


def error(found: Report) -> float:
    """Its relative error, at least 1e-15; infinite where the run failed."""
    (row,) = found.rows
    return max(float(row.metrics[RELATIVE.text]), 1e-15) if row.outcome == "success" else math.inf


def pairs(seed: int) -> Iterator[tuple[str, Report, Report]]:
    """Name, the better and the worse of two reports, whose relative errors differ by a factor of a hundred or more.

    Of every third pair the better one has a fault too; some of these are at nodes alone, where it does not show.
    """
    random = Random(seed)
    while True:
        case = random.choice(CASES)
        first = HEALTHY
        if random.random() < 1 / 3:
            first = degraded(random)[1]
            if random.random() < 0.5:  # nothing of this shows where all samples are nodes
                first = Method(dense=random.randint(2, 7), between=random.choice([0.0, 1e-6]))
        name, second = degraded(random, first)
        one, two = report_of(first, case), report_of(second, case)
        if error(two) > 100 * error(one):
            yield name, one, two


def repaired(better: Report, worse: Report) -> bool:
    """Whether the first is a repair of the second: no error of it is larger, beyond two bits above 4 eps."""
    pairs = zip(better.rows[0].metrics.values(), worse.rows[0].metrics.values(), strict=False)
    return all(float(a) <= 4 * max(float(b), 4 * 2.0**-52) for a, b in pairs if a.kind == "error")


def scaled(found: Report, factor: str, band: float | None = None) -> Report:
    """Every error larger by a factor, its series too; with that band, where one is given."""
    rows = [_scaled(row, factor, band) for row in found.rows]
    return Report(found.schema, found.plan, found.environment, rows)


def _scaled(row: Row, factor: str, band: float | None) -> Row:
    times = exact(factor)

    def metric(old: Metric) -> Metric:
        if old.kind != "error" or old.log10 is None:
            return old
        new = of_fraction(exact(old.value) * times)
        return msgspec.structs.replace(new, band=old.band if band is None else band, quantity=old.quantity)

    def series(old: Series) -> Series:
        words = ("nan", "missing", UNRESOLVED)
        values = [value if value in words else decimal_text(exact(value) * times, 6) for value in old.values]
        return msgspec.structs.replace(old, values=values)

    metrics = {name: metric(each) for name, each in row.metrics.items()}
    return msgspec.structs.replace(
        row, metrics=metrics, series={name: series(each) for name, each in row.series.items()}
    )


def edited_pairs(found: Report, seed: int) -> Iterator[tuple[str, Report, Report]]:
    """The same from rows of a stored report: a band that excuses what was lost, or that hides what is deterministic."""
    random = Random(seed)
    rows = [row for row in found.rows if row.key.kind in ("drift", "homoclinic") and _resolved(row)]
    while True:
        good = Report(found.schema, found.plan, found.environment, [random.choice(rows)])
        factor = f"1e{random.randint(6, 9)}"
        if random.random() < 0.5:
            wide = round(random.uniform(5, 20), 4)
            yield WIDE, scaled(good, "1", wide), scaled(good, factor, random.choice([None, wide]))
        else:
            yield "a narrow band", good, scaled(good, factor, round(10 ** random.uniform(-4, -2), 4))


def _resolved(row: Row) -> bool:
    """Whether there is room above the errors of a row for larger ones."""
    sizes = [m.log10 for m in row.metrics.values() if m.kind == "error" and m.log10 is not None]
    return row.outcome == "success" and max(sizes) < -10


def verdict(old: Report, new: Report) -> str:
    """What a comparison says."""
    return compare(old, new, Policy()).verdict


def marked_worse(old: Report, new: Report) -> bool:
    """Whether the history of the two has a step to the worse."""
    return any(kind is Verdict.WORSE for track in history([old, new], Policy()) for kind, _ in track.steps.values())


MEASURED, EDITED, REPAIRS = 140, 60, 100


def main(seed: int) -> int:
    with TemporaryDirectory() as folder, installed(Path(folder)):
        found = list(islice(pairs(seed), MEASURED))
    found += islice(edited_pairs(store.read(ROOT / "results" / "default"), seed), EDITED)
    seen, passed = Counter(), Counter()
    for name, better, worse in found:
        said = verdict(better, worse)
        seen[said] += 1
        if said in ("same", "better"):
            passed[name] += 1
    print(f"{len(found)} degradations: {dict(seen)}; passed: {sum(passed.values())} {dict(passed) or ''}")
    repairs, accused = Counter(), Counter()
    mended = [each for each in found if each[0] != WIDE and repaired(each[1], each[2])]
    for name, better, worse in Random(seed).sample(mended, REPAIRS):
        said = verdict(worse, better)
        repairs[said] += 1
        if said == "worse" or marked_worse(worse, better):
            accused[name] += 1
    print(f"{sum(repairs.values())} repairs: {dict(repairs)}; worse: {sum(accused.values())} {dict(accused) or ''}")
    return int(bool(passed or accused))


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1))
