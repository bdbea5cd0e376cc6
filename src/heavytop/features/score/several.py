"""Several trajectory files at once, in parallel, and the order that files show which differ in their step alone."""

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
from heavytop.features.score.api import Score, read_trajectory, scored
from heavytop.measure.scalar import RELATIVE, digits_text
from heavytop.precision import DOUBLE, exact, exact_text
from heavytop.processes import ChildContext
from heavytop.report.document.document import clip

_ABOVE_ROUNDING = 1000
"""Times eps: an error from which an order is read."""
_WIDTH = 44


@dataclass(frozen=True, slots=True)
class ScoredFile:
    """A file with its score, or why there is none.

    method: what files have in common that differ in their step alone; step: 0 where the file does not say it.
    """

    path: str
    document: dict[str, Any]
    exit_code: int
    digits: str = ""
    explained: str = ""
    method: tuple[str, ...] = ()
    step: Fraction = Fraction(0)
    error: float | None = None


@dataclass(frozen=True, slots=True)
class Order:
    """The order between the two finest steps whose errors are more than rounding; paths: from coarse to fine."""

    paths: tuple[str, ...]
    order: float


def score_files(paths: Sequence[Path], case: str | None, require: str | None, normalize: bool) -> list[ScoredFile]:
    """The score of each file, in their order; as many at once as there are processors."""
    one = partial(_scored_file, case=case, require=require, normalize=normalize)
    with ProcessPoolExecutor(min(len(paths), os.cpu_count() or 1), mp_context=ChildContext()) as pool:
        return list(pool.map(one, map(str, paths)))


def _scored_file(path: str, case: str | None, require: str | None, normalize: bool) -> ScoredFile:
    try:
        given, needed = read_trajectory(path, case, require=require, normalize=normalize)
        found = scored(given, needed)
    except InputError as error:
        return ScoredFile(path, {"file": path, "error": str(error)}, ExitCode.BAD_INPUT, explained=error.cause)
    body = (repr(given.top), repr(given.start), exact_text(given.times[-1]), given.system.name, given.precision.name)
    document = {"file": path, **found.to_json()}
    digits = "-" if found.digits_kept is None else digits_text(found.digits_kept)
    said = "; ".join(each.kind for each in found.assessment.diagnoses)
    return ScoredFile(
        path, document, found.exit_code, digits, said, (given.integrator, *body), _step(given.flags), _error(found)
    )


def _step(flags: dict[str, str]) -> Fraction:
    try:
        return max(exact(flags.get("step", "0")), Fraction(0))
    except InputError:
        return Fraction(0)


def _error(found: Score) -> float | None:
    metric = found.row.metrics.get(RELATIVE.text)
    return None if metric is None or metric.log10 is None else float(metric)


def orders(files: Sequence[ScoredFile]) -> Iterator[Order]:
    """The order of each method of which two files with different steps have an error that is more than rounding."""
    with_step = sorted((each for each in files if each.step), key=lambda each: (each.method, -each.step))
    for _, group in groupby(with_step, key=lambda each: each.method):
        series = list(group)
        resolved = [each for each in series if each.error is not None and each.error > _ABOVE_ROUNDING * DOUBLE.eps]
        pairs = [(a, b) for a, b in pairwise(resolved) if a.step != b.step]
        if pairs:
            coarse, fine = pairs[-1]
            assert coarse.error is not None
            assert fine.error is not None
            order = log2(coarse.error / fine.error) / log2(coarse.step / fine.step)
            yield Order(tuple(each.path for each in series), order)


def text(files: Sequence[ScoredFile]) -> str:
    """A line for each file, and a sentence for each order."""
    width = min(_WIDTH, max(len(each.path) for each in files))
    lines = [f"{'file':{width}}  digits right  explained by"]
    lines += [f"{clip(each.path, width):{width}}  {each.digits:>12}  {each.explained}".rstrip() for each in files]
    for found in orders(files):
        said = f"order {found.order:.1f} over {len(found.paths)} steps"
        lines.append(f"{said}: {clip(found.paths[0], width)} to {clip(found.paths[-1], width)}")
    return "\n".join(lines)


def exit_code(files: Sequence[ScoredFile]) -> int:
    """2 where a file could not be scored, 1 where fewer digits are right than required, 3 where one ended early."""
    codes = {each.exit_code for each in files}
    return next((code for code in (ExitCode.BAD_INPUT, ExitCode.FINDING, ExitCode.INCOMPLETE) if code in codes), 0)
