"""Motions of a survey that got worse: two survey.parquet joined by motion, where both hold the same tops.

The quantiles of the row decide the verdict; a fault in a small part of the motions changes only the maximum, and the
list names these motions.  A motion is worse where it no longer reaches its horizon, or where its error has grown by
more than the policy allows and by more than rounding noise: the noise band is the half-width of the central 95 % of
all changes of error, on the narrower side, because a fault widens one side alone.
"""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy

from heavytop.cases import Case
from heavytop.extras import require_extra
from heavytop.features.survey.gathered import DATA, SAME
from heavytop.files import readable
from heavytop.harness.case_text import rerun
from heavytop.harness.plan import uniform
from heavytop.integrate.trajectory import Outcome
from heavytop.precision import exact, log10, parse
from heavytop.records import Row
from heavytop.report.document.motions import LossLimits, WorseMotion, WorseMotions
from heavytop.top.equations import system
from heavytop.top.heavy_top import HeavyTop, State

MOST = 5
"""Motions of a survey that are listed; the others are counted."""
METRIC = "solution_error_relative_max"
"""The metric whose allowance in a policy also applies to the error of a motion."""
_TAIL = 0.025


def worse_motions(old: Row, new: Row, files: tuple[Path, Path], limits: LossLimits) -> WorseMotions | None:
    """The motions of two rows of one survey, from the files of both reports; None where a file is missing.

    Raises InputError for a file that cannot be read.
    """
    if not all(file.is_file() for file in files):
        return None
    before, after = (_records(file, row) for file, row in zip(files, (old, new), strict=True))
    _, here, there = numpy.intersect1d(before["index"], after["index"], return_indices=True)
    if not len(here):
        return WorseMotions(new.identity, reason="they have none in common")
    before, after = ({name: c[k] for name, c in t.items()} for t, k in ((before, here), (after, there)))
    others = [~numpy.isclose(before[name], after[name], rtol=0, atol=0, equal_nan=True) for name in DATA]
    if (other := numpy.logical_or.reduce(others)).any():
        first = before["index"][other][0]
        return WorseMotions(new.identity, len(here), reason=f"motion {first} is another top or start")
    lost = _lost(before, after, limits, old)
    worse = numpy.flatnonzero(lost > 0)
    order = worse[numpy.lexsort((before["index"][worse], -lost[worse]))]
    first = tuple(_motion(new, before, after, index) for index in order[:MOST].tolist())
    return WorseMotions(new.identity, len(here), len(worse), first)


def _records(file: Path, row: Row) -> dict[str, Any]:
    """Columns of the motions of one row, by their index."""
    require_extra("parquet")
    import pyarrow
    from pyarrow.parquet import read_table

    subject, key = row.key.subject, row.key
    same = dict(zip(SAME, (key.case, subject.name, subject.tolerance, key.precision, key.horizon), strict=True))
    columns = ["index", "outcome", "error_max", "digits_right", *DATA]
    with readable(file, "Give the folder of a finished run.", pyarrow.ArrowException):
        table = read_table(file, columns=columns, filters=[(name, "=", text) for name, text in same.items()])
    records = {name: table[name].to_numpy() for name in columns if name != "outcome"}
    return records | {"outcome": table["outcome"].cast("string").to_numpy()}


def _lost(before: dict[str, Any], after: dict[str, Any], limits: LossLimits, row: Row) -> Any:
    """Decades by which the error of each motion grew beyond what is allowed; infinite where it fails now, 0 for none.

    A motion that failed before is never worse.
    """
    reached = [columns["outcome"] == Outcome.SUCCESS.value for columns in (before, after)]
    eps = log10(parse(row.precision).eps)
    assert eps is not None
    floor = 10.0 ** max(limits.floor + eps, -300.0)
    with numpy.errstate(all="ignore"):
        sizes = [numpy.log10(numpy.fmax(columns["error_max"], floor)) for columns in (before, after)]
        grown = numpy.where(reached[0] & reached[1], sizes[1] - sizes[0], 0.0)
        grown = numpy.where(numpy.isnan(grown), 0.0, grown)
    up, down = numpy.quantile(grown, 1 - _TAIL), -numpy.quantile(grown, _TAIL)
    allowed = limits.loss + limits.noise * max(0.0, min(float(up), float(down)))
    return numpy.where(reached[0] & ~reached[1], math.inf, numpy.where(grown > allowed, grown, 0.0))


def _motion(row: Row, before: dict[str, Any], after: dict[str, Any], at: int) -> WorseMotion:
    index, outcome = int(after["index"][at]), str(after["outcome"][at])
    digits = [round(float(columns["digits_right"][at]), 2) for columns in (before, after)]
    known = [None if math.isnan(value) else value for value in digits]
    worst = row.worst if isinstance(row.worst, tuple) else ()
    listed = next((motion.command for motion in worst if motion.index == index), "")
    return WorseMotion(index, known[0], known[1], outcome, listed or _command(row, after, at, outcome))


def _command(row: Row, columns: dict[str, Any], index: int, outcome: str) -> str:
    """The command of the rounded top and start: the motion itself in double, within a rounding in other formats."""
    numbers = [Fraction(repr(float(columns[name][index]))) for name in DATA]
    inertia, moment, rotor, omega, gamma = (numbers[k : k + 3] for k in range(0, 15, 3))
    top = HeavyTop(inertia, 1, moment, rotor if any(rotor) else None)
    case = Case("motion", "a motion of a survey", system(row.system), top, State(omega, gamma))
    (times, _), by = uniform(exact(row.key.horizon), row.samples), row.key.subject
    return rerun(case, times, row.key.precision, by.name, by.tolerance, outcome == Outcome.SUCCESS.value)
