"""Scores of several trajectory files in parallel, and the order shown by files that differ only in their step."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import groupby, pairwise
from math import log2
from pathlib import Path
from typing import Any

from heavytop.errors import ExitCode, InputError
from heavytop.features.score.api import read_trajectory, scored
from heavytop.features.score.text import cause, requirement
from heavytop.measure.scalar import RELATIVE, digits_text
from heavytop.precision import DOUBLE, exact_text
from heavytop.processes import ChildContext
from heavytop.report.document.document import clip

_ABOVE_ROUNDING = 1000
"""Multiple of eps above which an error shows an order."""
_WIDTH = 44


@dataclass(frozen=True, slots=True)
class ScoredFile:
    """A file with its score, or why it is missing.

    method: equal for files that differ only in their step; step: 0 where the file does not state it.
    required: whether it has the digits that were required, in a sentence.  eps: of its format.
    """

    path: str
    document: dict[str, Any]
    exit_code: int
    digits: str = ""
    explained: str = ""
    method: tuple[str, ...] = ()
    step: Fraction = Fraction(0)
    error: float | None = None
    required: str = ""
    eps: Fraction = DOUBLE.eps


@dataclass(frozen=True, slots=True)
class Order:
    """The order between the two finest steps whose errors are more than rounding.

    paths: from coarse to fine, of the steps with which the error falls.
    """

    paths: tuple[str, ...]
    order: float


def score_files(paths: Sequence[Path], case: str | None, require: str | None, normalize: bool) -> list[ScoredFile]:
    """The score of each file, in their order; as many at once as there are processors."""
    one = partial(_scored_file, case=case, require=require, normalize=normalize)
    with ProcessPoolExecutor(min(len(paths), os.cpu_count() or 1), mp_context=ChildContext()) as pool:
        return list(pool.map(one, map(str, paths)))


def _scored_file(path: str, case: str | None, require: str | None, normalize: bool) -> ScoredFile:
    try:
        motion, needed = read_trajectory(path, case, require=require, normalize=normalize)
        score = scored(motion, needed)
    except InputError as error:
        return ScoredFile(path, {"file": path, "error": str(error)}, ExitCode.BAD_INPUT, explained=error.cause)
    body = (
        repr(motion.top),
        repr(motion.start),
        exact_text(motion.times[-1]),
        motion.system.name,
        motion.precision.name,
    )
    document = {"file": path, **score.to_json()}
    digits = "-" if score.digits_kept is None else digits_text(score.digits_kept)
    said = "; ".join(f"{fit.kind}: {cause(fit, score.row.system)}" for fit in score.assessment.diagnoses)
    method, step = (motion.integrator, *body), motion.step or Fraction(0)
    required = "" if needed is None else requirement(score.row, needed, motion.cut)
    metric = score.row.metrics.get(RELATIVE.text)
    largest = None if metric is None or metric.log10 is None else float(metric)
    eps = motion.precision.eps
    return ScoredFile(path, document, score.exit_code, digits, said, method, step, largest, required, eps)


def orders(files: Sequence[ScoredFile]) -> Iterator[Order]:
    """The order of each method of which two files with different steps have an error that is more than rounding.

    A run that ended early, and one whose error has another explanation than its method, shows no order.
    """
    whole = (file for file in files if file.step and not file.explained and file.exit_code != ExitCode.INCOMPLETE)
    for _, group in groupby(sorted(whole, key=lambda file: (file.method, -file.step)), key=lambda file: file.method):
        series = list(group)
        errors = [(file, file.error) for file in series if file.error and file.error > _ABOVE_ROUNDING * file.eps]
        pairs = [(a, b) for a, b in pairwise(errors) if a[0].step != b[0].step]
        rising = next((at for at, (a, b) in enumerate(reversed(pairs)) if a[1] <= b[1]), len(pairs))
        if rising:
            (coarse, error), (fine, least) = pairs[-1]
            order = log2(error / least) / log2(coarse.step / fine.step)
            first = series.index(pairs[-rising][0][0])
            yield Order(tuple(file.path for file in series[first:]), order)


def text(files: Sequence[ScoredFile]) -> str:
    """A line for each file, and a sentence for each order."""
    width = min(_WIDTH, max(len(file.path) for file in files))
    lines = [f"{'file':{width}}  digits right  explained by"]
    lines += [f"{clip(file.path, width):{width}}  {file.digits:>12}  {file.explained}".rstrip() for file in files]
    if any(file.digits and file.explained for file in files):
        lines.append("`heavytop docs score` explains the names before a colon (What went wrong).")
    for order in orders(files):
        said = f"order {order.order:z.1f} over {len(order.paths)} steps"
        lines.append(f"{said}: {clip(order.paths[0], width)} to {clip(order.paths[-1], width)}")
    return "\n".join([*lines, *(f"{clip(file.path, 400)}: {file.required}" for file in files if file.required)])


def exit_code(files: Sequence[ScoredFile]) -> int:
    """2 where a file could not be scored, 1 where fewer digits are right than required, 3 where one ended early."""
    codes = {file.exit_code for file in files}
    return next((code for code in (ExitCode.BAD_INPUT, ExitCode.FINDING, ExitCode.INCOMPLETE) if code in codes), 0)
