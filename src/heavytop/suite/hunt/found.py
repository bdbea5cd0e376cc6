"""What a hunt found as texts: data, class, command and table of a plan; and the file that keeps it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import Any

import msgspec

from heavytop.errors import InputError
from heavytop.precision import time_text
from heavytop.suite.case_text import forms
from heavytop.suite.cases import Case
from heavytop.suite.files import replace
from heavytop.suite.hunt.draw import Motion
from heavytop.suite.hunt.measured import Measured
from heavytop.suite.hunt.proof import Proof
from heavytop.suite.hunt.search import Asked, Hunted
from heavytop.suite.hunt.special import class_of
from heavytop.suite.plan import Top
from heavytop.top.equations import HEAVY_TOP
from heavytop.top.heavy_top import HeavyTop, data_texts

_PASTE = "It holds [[top]] tables, as heavytop hunt prints them."


def documents(hunted: Hunted, integrator: str) -> list[dict[str, Any]]:
    """Each motion found, worst first, by the keys of `hunt --json`; integrator: as the user named it."""
    pairs = zip(hunted.found, hunted.proofs, strict=True)
    return [_document(hunted.asked, m, p, integrator, i) for i, (m, p) in enumerate(pairs, 1)]


def digits_lost(error: float, eps: float) -> float:
    """Decimal digits of the format that an error costs: all of them where there is no result."""
    if math.isinf(error):
        return round(-math.log10(eps), 1)
    return round(min(max(math.log10(max(error, eps) / eps), 0.0), -math.log10(eps)), 1)


def ratio(error: float, other: float | None, eps: float) -> float | None:
    """The error over that of another integrator on the same motion, which counts as eps at least; None where one came
    to nothing.
    """
    if other is None or math.isinf(error) or math.isinf(other):
        return None
    return float(f"{error / max(other, eps):.3g}")


def case_of(motion: Motion, number: int) -> Case:
    """The motion as a case."""
    return Case(f"hunted-{number}", "found by a hunt", HEAVY_TOP, *motion)


def command_of(asked: Asked, motion: Motion, integrator: str, failed: bool) -> str:
    """The command that shows it again: the digits that are right, or how the run ends."""
    line = forms(case_of(motion, 1))["command"].rpartition(" --times ")[0]
    times = ",".join(time_text(asked.horizon * i / 10) for i in range(1, 11))
    name = "" if asked.precision.name == "double" else f" --precision {asked.precision.name}"
    line += f" --times {times}{name} --integrator {quote(integrator)}"
    return line if failed else f"{line} --json | heavytop score -"


def _document(asked: Asked, m: Measured, proven: Proof, integrator: str, number: int) -> dict[str, Any]:
    eps = float(asked.precision.eps)
    case = case_of(m.motion, number)
    failed = math.isinf(m.error)
    return {
        **data_texts(*m.motion),
        "system": case.system.name,
        "digits_lost": digits_lost(proven.error, eps),
        "ratio": ratio(proven.error, proven.other, eps),
        "outcome": m.outcome,
        "class": class_of(*m.motion),
        "command": command_of(asked, m.motion, integrator, failed),
        "toml": forms(case)["toml"],
    }


def kept(path: Path) -> tuple[Motion, ...]:
    """The motions that a file keeps, none where there is no file yet; raises InputError for any other file."""
    try:
        document = tomllib.loads(path.read_text("utf-8"))
        if document.keys() - {"top"}:
            raise msgspec.ValidationError(f"unknown key {min(document.keys() - {'top'})}")
        cases = [each.case() for each in msgspec.convert(document.get("top", []), list[Top])]
    except FileNotFoundError:
        return ()
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, msgspec.ValidationError, RecursionError) as error:
        raise InputError(f"{path} cannot be read: {error}.", _PASTE) from None
    if any(case.system is not HEAVY_TOP for case in cases):
        raise InputError(f"{path} holds a top of another system than heavy_top.", "Take it out: heavy tops are hunted.")
    return tuple((case.top, case.start) for case in cases)


def keep(path: Path, motions: Sequence[Motion]) -> None:
    """Add motions to the file that are not in it; raises InputError where it cannot be written."""
    before = kept(path)
    every = dict.fromkeys([*map(_plain, before), *map(_plain, motions)])
    if len(every) == len(before):
        return
    tables = [forms(case_of(each, i))["toml"] for i, each in enumerate(every, 1)]
    try:
        replace(path, ("\n\n".join(tables) + "\n").encode())
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}.", "Give a file that can be.") from None


def _plain(motion: Motion) -> Motion:
    top, start = motion
    return HeavyTop(top.inertia, top.weight, top.centre), start
